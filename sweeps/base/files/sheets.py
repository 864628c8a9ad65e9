"""Rows of a sheet of an .xlsx file, read by openpyxl: values only, no macros, no links.

A small file can hold styles or names that keep openpyxl busy for minutes and fill the memory. So it
runs in a process of its own, with limits that grow with the size of the sheets.
"""

from __future__ import annotations

import io
import json
import sys
import zipfile
from typing import Any

from sweeps.base.errors import SceneError, not_known, size_text
from sweeps.base.files.child_process import Limits, answer_apart, answering
from sweeps.base.files.libraries import library, library_reading

# Largest number of bytes of all inflated parts of an .xlsx file, a ZIP archive of XML
MOST_INFLATED = 1 << 30

MOST_CELLS = 2 * 10**7
MOST_ROWS = 1 << 20  # Largest number of rows of a sheet

MOST_TEXT = 1 << 27  # Largest number of characters of all cells together; cells may share one text

LONGEST_TEXT = 1 << 15  # Characters of a cell that are kept; Excel itself allows no more

SECONDS, RATE = 10.0, 1e6
"""Seconds that reading a sheet may take, besides one for each so many bytes of XML (openpyxl reads
some 8e6)."""

MEMORY, MEMORY_RATE, MOST_MEMORY = 1 << 29, 40, 6 << 30
"""Bytes of memory that reading a sheet may take, how many more for each byte of XML, and the most.
"""

COMPRESSED = 30
"""Largest number of bytes of XML that a byte of a compressed file stands for, where limits are set
by its size."""


def sheets(
    data: bytes, label: str, wanted: str | None = None, *, first: bool = False
) -> dict[str, list[list[Any]]]:
    """Return the rows of sheets by their names, without the empty cells at their ends.

    `label` is the file as messages call it, and `wanted` the name of the only sheet that is read;
    `first` says that only the first one is. Refused are files that are protected by a password, too
    large or damaged, a sheet that there is not, and any file where openpyxl is not installed.
    """
    if data[:4] == b"\xd0\xcf\x11\xe0":
        raise SceneError(
            f"{label}: protected by a password, or an old .xls file; save it as .xlsx without a "
            "password"
        )
    library("openpyxl", "openpyxl", label)
    with library_reading(label, "an .xlsx file"), zipfile.ZipFile(io.BytesIO(data)) as parts:
        sizes = {part.filename: part.file_size for part in parts.infolist()}
    inflated = sum(sizes.values())
    if inflated > MOST_INFLATED:
        raise SceneError(
            f"{label}: {size_text(inflated)} when inflated; must be at most "
            f"{size_text(MOST_INFLATED)}"
        )
    with_cells = ("xl/worksheets/", "xl/sharedStrings")
    cells = sum(size for part, size in sizes.items() if part.startswith(with_cells))
    cells = min(cells, COMPRESSED * len(data))
    memory = min(MEMORY + MEMORY_RATE * cells, MOST_MEMORY)
    limits = Limits(memory, SECONDS + cells / RATE)
    asked = json.dumps([label, wanted, first])
    answer = answer_apart(__name__, asked, data, limits, label, "an .xlsx file")
    tables: dict[str, list[list[Any]]] = json.loads(answer)
    return tables


def _answer() -> list[bytes]:
    label, wanted, first = json.loads(sys.argv[1])
    return [json.dumps(_read(sys.stdin.buffer.read(), label, wanted, first)).encode("ascii")]


def _read(data: bytes, label: str, wanted: str | None, first: bool) -> dict[str, list[list[Any]]]:
    import openpyxl

    with library_reading(label, "an .xlsx file"):
        book = openpyxl.load_workbook(
            io.BytesIO(data), read_only=True, data_only=True, keep_links=False
        )
        try:
            chosen = _chosen(book, wanted, first, label)
            return {title: _rows(sheet, label) for title, sheet in chosen.items()}
        finally:
            book.close()


def _chosen(book: Any, wanted: str | None, first: bool, label: str) -> dict[str, Any]:
    """The sheets that are read; sheets of charts have no cells."""
    titles = {sheet.title: sheet for sheet in book.worksheets}
    if wanted is not None and wanted not in titles:
        raise SceneError(f"{label}: sheet '{wanted}': not found{not_known(wanted, titles)}")
    if not titles:
        raise SceneError(f"{label}: has no sheet with cells")
    if wanted is not None:
        return {wanted: titles[wanted]}
    return dict([next(iter(titles.items()))]) if first else titles


def _rows(sheet: Any, label: str) -> list[list[Any]]:
    """Rows of a sheet without the empty cells at their ends; a sheet may claim any size."""
    rows: list[list[Any]] = []
    cells = letters = 0
    sheet.reset_dimensions()  # Rows would be filled up to the size that the file claims
    for row in sheet.iter_rows(values_only=True):
        values = [_plain(value) for value in row]
        while values and (values[-1] is None or values[-1] == ""):
            values.pop()
        rows.append(values)
        cells += len(values)
        letters += sum(len(value) for value in values if isinstance(value, str))
        if letters > MOST_TEXT:
            raise SceneError(f"{label}: more than {MOST_TEXT} characters of text in its cells")
        if cells > MOST_CELLS or len(rows) > MOST_ROWS:
            raise SceneError(f"{label}: more than {MOST_CELLS:g} cells or {MOST_ROWS:g} rows")
    while rows and not rows[-1]:
        rows.pop()
    return rows


def _plain(value: Any) -> Any:
    """Value of a cell as JSON has it; dates and whole numbers of any length are texts."""
    if value is None or isinstance(value, bool | float):
        return value
    if isinstance(value, int) and abs(value) < 1 << 63:
        return value
    return str(value)[:LONGEST_TEXT]


if __name__ == "__main__":
    answering(_answer)
