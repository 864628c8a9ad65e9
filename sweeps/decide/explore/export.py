"""Archives for programs that read no netCDF: CSV, Parquet and Excel; curves as UFF and FMU.

A table has a row for each design, or for each design and crank angle; it is written a range of
rows at a time.
"""

from __future__ import annotations

import json
import math
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from sweeps.base.arguments import a_path, check_dataset
from sweeps.base.errors import SceneError, one_line, plain_number, shown
from sweeps.base.files.libraries import library
from sweeps.base.naming import DESCRIPTION, meaning_of
from sweeps.decide.explore.attributes import members_of, of_designs
from sweeps.decide.explore.columns import (
    check_one_table,
    chosen_quantities,
    columns_of,
    dims_of,
    in_words,
    words_for_numbers,
)
from sweeps.decide.explore.curve_formats import (
    COLUMNS,
    CONVENTION,
    functional_mockup_unit,
    order_table,
    universal_file,
)
from sweeps.running.archive import netcdf as archives
from sweeps.running.reduce.ranges import ranges

if TYPE_CHECKING:
    import xarray as xr

ROWS = 1 << 18  # Rows that are written at a time


@dataclass(frozen=True)
class Exported:
    """The choice of results for an exported table.

    Attributes
    ----------
    rows : int
        Number of rows, the header not counted; of curves, of points.
    columns : tuple of str
        Axes first, then columns of designs, then quantities.
    left_out : tuple of str
        Quantities that are not in it: curves, unless they were asked for; in a .uff file, those of
        designs without values.
    units : dict of str to str
        Units of the columns of a table, by name; plain numbers and words have none.
    """

    rows: int
    columns: tuple[str, ...]
    left_out: tuple[str, ...]
    units: Mapping[str, str] = field(default_factory=dict)


def export(
    archive: xr.Dataset, path: str | Path, *, quantities: str | Sequence[str] | None = None,
    orders: str | None = None, overwrite: bool = False, head_units: bool = False,
    digits: int | str | None = None,
) -> Exported:  # fmt: skip
    """Write an archive as a table, or its curves for other programs.

    Axes come first and the last varies fastest, then columns of designs, then quantities, all in
    the units of the archive; words and outcomes are texts. A missing number is an empty
    field of a CSV file or a sheet and NaN in Parquet, where each column also has its unit (metadata
    `units`). An Excel file has units in its second row, and sheets of axes, assumptions and
    provenance.
    A universal file (.uff) has a data set 58 for each curve of each design, an FMU (.fmu) the
    curves of one design as outputs over the crank angle; see docs/archives.md.
    The file is complete or does not exist.

    Parameters
    ----------
    archive : Dataset
        As `sweeps.open` or `sweeps.run` returns it; it may be larger than memory.
    path : str or Path
        The file; its extension, .csv, .parquet, .xlsx, .uff or .fmu, says which format.
    quantities : str or sequence of str, optional
        Those to write; if not given, all that have one number for each design. With a curve, such
        as omega over crank_angle, there is a row for each of its points. In .uff and .fmu, curves
        alone; if not given, all over the crank angle.
    orders : str, optional
        In place of quantities: what to write the orders of, such as "torque", of which the archive
        has `torque_order` and `torque_phase`, beside `order_frequency`. There is a row for each
        order, with frequency, amplitude, phase, real and imaginary part; a CSV file begins with
        lines (#) that state the convention of the phase. A .uff file has them as complex values.
    overwrite : bool
        Replace an older file.
    head_units : bool
        Write units into the heads of a CSV file: ``omega_max [rad s-1]``.
    digits : int or str, optional
        Significant digits of results in a .csv or .xlsx file, from 1 to 17, or "all" for every bit.
        If not given, those that the tolerance of the solution carries, and three more, because
        speeds differ by about a thousandth of themselves: 10 at the usual tolerance of 1e-6. Of
        orders, all. Values of axes and columns of designs are never rounded.

    Raises
    ------
    SceneError
        For another extension, quantities or orders that the archive does not have or that do not
        fit into one table or no curves, several designs in an FMU, or a file that exists; for a
        format whose library is not installed, and more rows than a sheet has.
    OSError
        Where the table cannot be written.

    Examples
    --------
    >>> import sweeps
    >>> archive = sweeps.run("first")
    >>> sweeps.export(archive, "table.csv", quantities="delta").rows
    75
    >>> with open("table.csv") as file:
    ...     print(file.readline().strip())
    load,inertia,delta
    """
    path = a_path(path, "path")
    check_dataset(archive)
    opener = check_format(path)
    if path.exists() and not overwrite:
        raise SceneError(f"{path}: exists and is not overwritten")
    if head_units and path.suffix.lower() != ".csv":
        raise SceneError(f"{path}: has units of its own; head_units is for .csv")
    places = _digits(digits, archive, orders)
    if digits is not None and path.suffix.lower() not in ROUNDED:
        raise SceneError(f"{path}: has all digits; digits is for {' and '.join(ROUNDED)}")
    if orders is not None and quantities is not None:
        raise SceneError("quantities: not allowed together with orders")
    if path.suffix.lower() in CURVES:
        with archives.replaced(path) as partial:
            return Exported(*opener(partial, archive, quantities, orders))
    if orders is not None:
        archive, quantities = order_table(archive, orders), COLUMNS
    names = chosen_quantities(archive, quantities)
    check_one_table(archive, names)
    dims = dims_of(archive, names)
    shape = [archive.sizes[d] for d in dims]
    columns = columns_of(archive, dims, names)
    left_out = [] if quantities else [n for n in of_designs(archive) if n not in names]
    if path.suffix.lower() == ".xlsx":
        check_rows(math.prod(shape), path)
    written = {_head(n, v) if head_units else n: v for n, v in columns.items()}
    words = words_for_numbers(written)
    rounded = names if path.suffix.lower() in ROUNDED and places < ALL_DIGITS else []
    rounded = [n for n in rounded if n not in words and columns[n].dtype.kind == "f"]
    heads = dict(zip(columns, written, strict=True))
    rows = 0
    with archives.replaced(path) as partial, opener(partial, written, archive) as put:
        for _, extent, arrays in ranges(written, dims, shape, 8.0 * ROWS, in_order=True):
            table = {n: np.broadcast_to(a, extent).reshape(-1) for n, a in arrays.items()}
            for name in (heads[n] for n in rounded):
                table[name] = with_digits(table[name], places)
            for name, meant in words.items():
                table[name] = in_words(table[name], meant)
            put(table)
            rows += len(next(iter(table.values())))
    units = {name: unit_of(v) for name, v in columns.items() if heads[name] not in words}
    units = {name: unit for name, unit in units.items() if unit}
    return Exported(rows, tuple(columns), tuple(left_out), units)


ALL_DIGITS = 17  # Significant digits that hold every bit of a number

ROUNDED = (".csv", ".xlsx")
"""Endings of files whose results are rounded to the digits that they carry."""


def _digits(asked: int | str | None, archive: xr.Dataset, orders: str | None) -> int:
    """Significant digits of results: those asked for, or those that they carry."""
    if asked is None:
        if orders is not None:
            return ALL_DIGITS  # Other programs compute with them
        solver = members_of(archive, "scene").get("solver")
        tolerance = solver.get("tolerance") if isinstance(solver, dict) else None
        if not isinstance(tolerance, float) or not 0.0 < tolerance < 1.0:
            tolerance = 1e-6  # The usual one of scenes
        return min(4 - math.floor(math.log10(1.0000001 * tolerance)), ALL_DIGITS)
    text = str(asked).strip()
    if text != "all" and not (re.fullmatch("[1-9][0-9]?", text) and int(text) <= ALL_DIGITS):
        raise SceneError(f"digits = {shown(text)}: must be from 1 to {ALL_DIGITS}, or all")
    return ALL_DIGITS if text == "all" else int(text)


def with_digits(values: npt.NDArray[Any], digits: int) -> npt.NDArray[Any]:
    """Return numbers rounded to some significant digits, each the nearest to its decimal text."""
    values = np.asarray(values, float)
    sizes = np.abs(values)
    plain = np.isfinite(values) & (sizes > 0.0)
    power = np.zeros(values.shape)
    power[plain] = digits - 1 - np.floor(np.log10(sizes[plain]))
    # Powers of ten are exact numbers up to 1e22; a product has a rounding error of its own, which
    # twelve digits do not show
    easy = plain & (np.abs(power) <= 22) & (digits <= 12)
    up, down = 10.0 ** np.clip(power, 0, 22), 10.0 ** np.clip(-power, 0, 22)
    result = np.where(easy, np.round(values * up / down) / up * down, values)
    for place in np.flatnonzero(plain & ~easy):
        result[place] = float(f"{values[place]:.{digits}g}")
    return result


def _head(name: str, variable: xr.Variable) -> str:
    unit = unit_of(variable)
    return f"{name} [{unit}]" if unit else name


def check_format(path: Path) -> Callable[..., Any]:
    """Return the function that writes files with this extension.

    SceneError refuses an unknown extension, and a format whose library is not installed.
    """
    kind = path.suffix.lower()
    # Functions that write the formats, by the extensions of their files
    known = {".csv": _csv, ".parquet": _parquet, ".xlsx": workbook, **CURVES}
    if kind not in known:
        raise SceneError(f"{path}: must end in {' or '.join(known)}")
    # By extension: the module that a format needs, its package, and the extra that installs it
    needs = {
        ".parquet": ("pyarrow.parquet", "pyarrow", "parquet"),
        ".xlsx": ("openpyxl", "openpyxl", "excel"),
        ".uff": ("pyuff", "pyuff", "exchange"),
        ".fmu": ("pythonfmu", "pythonfmu", "exchange"),
    }
    if kind in needs:
        module, package, extra = needs[kind]
        library(module, package, str(path), extra)
    return known[kind]


# --- formats --------------------------------------------------------------------------------------

Put = Callable[[Mapping[str, Any]], None]


@contextmanager
def _csv(path: Path, columns: Mapping[str, xr.Variable], archive: xr.Dataset) -> Iterator[Put]:
    import pandas as pd

    with path.open("w", encoding="utf-8", newline="") as stream:
        stream.writelines(f"# {line}\n" for line in archive.attrs.get(CONVENTION, "").splitlines())
        heads = [not_computed(one_line(name)) for name in columns]
        pd.DataFrame(columns=heads).to_csv(stream, index=False, lineterminator="\n")

        def put(table: Mapping[str, Any]) -> None:
            texts = {name: _not_computed(values) for name, values in table.items()}
            pd.DataFrame(texts).to_csv(stream, index=False, header=False, lineterminator="\n")

        yield put


def _not_computed(values: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """Names of designs that no spreadsheet takes for formulas; numbers as they are."""
    if values.dtype.kind not in "UOT":
        return values
    names, places = np.unique(values.astype(str), return_inverse=True)
    safe = [not_computed(one_line(name, LONGEST)) for name in names.tolist()]
    return np.array(safe, dtype=object)[places.reshape(values.shape)]


@contextmanager
def _parquet(path: Path, columns: Mapping[str, xr.Variable], archive: xr.Dataset) -> Iterator[Put]:
    import pyarrow as pa
    import pyarrow.parquet as pq

    words = words_for_numbers(columns)

    def field(name: str, variable: xr.Variable) -> Any:
        is_text = name in words or variable.dtype.kind in "UOT"
        kind = pa.string() if is_text else pa.from_numpy_dtype(variable.dtype)
        about = {
            key: str(variable.attrs[key])
            for key in ("units", "long_name", DESCRIPTION)
            if key in variable.attrs
        }
        return pa.field(name, kind, metadata=about)

    schema = pa.schema([field(name, variable) for name, variable in columns.items()])
    with pq.ParquetWriter(path, schema) as writer:

        def put(table: Mapping[str, Any]) -> None:
            arrays = [pa.array(table[f.name], f.type, from_pandas=False) for f in schema]
            writer.write_table(pa.table(arrays, schema=schema))

        yield put


MOST_ROWS = 1_048_576  # Largest number of rows of a sheet of Excel

HEADS = 2  # Rows above the numbers: names and units

LONGEST = 32_767  # Largest number of characters of a cell of Excel


def check_rows(rows: int, path: Path) -> None:
    """Refuse what has more rows than a sheet, naming how many there may be."""
    if rows > MOST_ROWS - HEADS:
        raise SceneError(
            f"{path}: {rows:,} rows; a sheet of Excel has room for {MOST_ROWS - HEADS:,}; write "
            ".csv or .parquet"
        )


@contextmanager
def workbook(
    path: Path, columns: Mapping[str, xr.Variable], archive: xr.Dataset
) -> Iterator[Callable[[Mapping[str, Any]], None]]:
    """Write sheets of results, by the names of their columns, axes, assumptions and provenance."""
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
    # The file is opened here: openpyxl judges a path by its extension, which an unfinished file
    # lacks.
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
    """A number or a text; nothing where a number is missing."""
    if isinstance(value, str):
        return not_computed(one_line(value, LONGEST))
    number = float(value)
    if not math.isfinite(number):
        return None if math.isnan(number) else str(number)
    return int(number) if number.is_integer() else number


def _about(archive: xr.Dataset) -> dict[str, list[list[Any]]]:
    """Rows of the other sheets."""
    axes: list[list[Any]] = [["axis", "what it is", "unit", "values"]]
    for name, coordinate in archive.coords.items():
        if coordinate.ndim == 1:
            texts = ", ".join(f"{v:.7g}" if coordinate.dtype.kind in "fiu" else str(v)
                              for v in coordinate.values[:100].tolist())  # fmt: skip
            axes.append([str(name), meaning_of(coordinate.attrs),
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


CURVES: Mapping[str, Callable[..., Any]] = {
    ".uff": universal_file,
    ".fmu": functional_mockup_unit,
}
"""Function that writes each format of curves, which are no tables."""
