"""Tables of archives as Excel files."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sweeps.base.errors import SceneError, one_line, plain_number
from sweeps.decide.explore.attributes import members_of

if TYPE_CHECKING:
    import xarray as xr

MOST_ROWS = 1_048_576  # Largest number of rows of a sheet of Excel

HEADS = 2  # Rows above the numbers: names and units

DIGITS = 7  # Significant digits that are written: results are not known better

LONGEST = 32_767  # Characters of a cell of Excel


def check_rows(rows: int, path: Path) -> None:
    """Refuse what has more rows than a sheet.

    Raises
    ------
    SceneError
        Naming how many there may be.
    """
    if rows > MOST_ROWS - HEADS:
        raise SceneError(
            f"{path}: {rows:,} rows; a sheet of Excel has room for {MOST_ROWS - HEADS:,}; write "
            ".csv or .parquet"
        )


@contextmanager
def workbook(
    path: Path, columns: Mapping[str, xr.Variable], archive: xr.Dataset
) -> Iterator[Callable[[Mapping[str, Any]], None]]:
    """Write sheets of results, axes, assumptions and provenance.

    Parameters
    ----------
    path : Path
        The file.
    columns : mapping of Variable
        Of the results, by the names of their columns.
    archive : Dataset
        What they come from.
    """
    from openpyxl import Workbook
    from openpyxl.styles import Font
    from openpyxl.utils import get_column_letter

    book = Workbook(write_only=True)
    sheet = book.create_sheet("results")
    sheet.freeze_panes = f"A{HEADS + 1}"
    for place, name in enumerate(columns, start=1):
        sheet.column_dimensions[get_column_letter(place)].width = max(12, len(name) + 2)
    bold, grey = Font(bold=True), Font(italic=True, color="00666666")
    sheet.append(_styled(sheet, list(columns), bold))
    sheet.append(_styled(sheet, [unit_of(v) for v in columns.values()], grey))

    def put(table: Mapping[str, Any]) -> None:
        for row in zip(*(table[name] for name in columns), strict=True):
            sheet.append([_cell(value) for value in row])

    yield put
    for title, rows in _about(archive).items():
        sheet = book.create_sheet(title)
        sheet.column_dimensions["A"].width = 28
        sheet.column_dimensions["B"].width = 60
        for number, row in enumerate(rows):
            sheet.append(_styled(sheet, row, bold) if number == 0 else [_cell(c) for c in row])
    # An open file: openpyxl judges a path by its extension, which an unfinished file has not.
    with path.open("wb") as stream:
        book.save(stream)


def unit_of(variable: xr.Variable) -> str:
    """Return the unit of a column of numbers; nothing for texts, outcomes and plain numbers."""
    unit = str(variable.attrs.get("units", ""))
    return "" if unit == "1" or variable.dtype.kind not in "fiu" else unit


def not_computed(text: str) -> str:
    """Return a text that no spreadsheet takes for a formula: one that begins like it gets a quote.

    Blanks before it do not count, nor do the wide signs of Asian keyboards; a number stays one.
    """
    if text.lstrip()[:1] not in tuple("=+-@\uff1d\uff0b\uff0d\uff20"):
        return text
    try:
        plain_number(text)
    except ValueError:
        return f"'{text}"
    return text


def _styled(sheet: Any, values: list[Any], font: Any) -> list[Any]:
    from openpyxl.cell import WriteOnlyCell

    cells = [WriteOnlyCell(sheet, value=_cell(value)) for value in values]
    for cell in cells:
        cell.font = font
    return cells


def _cell(value: Any) -> Any:
    """A number with the digits that count, or a text; nothing where a number is missing."""
    if isinstance(value, str):
        return not_computed(one_line(value, LONGEST))
    number = float(value)
    if not math.isfinite(number):
        return None if math.isnan(number) else str(number)
    return int(number) if number.is_integer() else float(f"{number:.{DIGITS}g}")


def _about(archive: xr.Dataset) -> dict[str, list[list[Any]]]:
    """Rows of the other sheets."""
    axes: list[list[Any]] = [["axis", "what it is", "unit", "values"]]
    for name, coordinate in archive.coords.items():
        if coordinate.ndim == 1:
            texts = ", ".join(f"{v:.7g}" if coordinate.dtype.kind in "fiu" else str(v)
                              for v in coordinate.values[:100].tolist())  # fmt: skip
            axes.append([str(name), str(coordinate.attrs.get("long_name", "")),
                         str(coordinate.attrs.get("units", "")),
                         texts + (" ..." if coordinate.size > 100 else "")])  # fmt: skip
    assumptions: list[list[Any]] = [["assumed", "why"]]
    assumptions += [[key, text] for key, text in _members(archive, "engine_assumed")]
    assumptions += [["warning", w] for w in str(archive.attrs.get("warnings", "")).splitlines()]
    parameters: list[list[Any]] = [["parameter", "value"]]
    parameters += [[key, _plain(text)] for key, text in _members(archive, "parameters")]
    left = {"engine_assumed", "warnings", "parameters", "input_files"}
    provenance: list[list[Any]] = [["attribute", "value"]]
    provenance += [[str(k), str(v)] for k, v in archive.attrs.items() if k not in left]
    return {
        "axes": axes,
        "assumptions": assumptions,
        "parameters": parameters,
        "provenance": provenance,
    }


def _plain(text: str) -> Any:
    try:
        return float(text)
    except ValueError:
        return text


def _members(archive: xr.Dataset, key: str) -> list[tuple[str, str]]:
    """Members of an attribute in JSON, as texts."""
    members = members_of(archive, key)
    return [(str(k), v if isinstance(v, str) else json.dumps(v)) for k, v in members.items()]
