"""Rows of a sheet of an .xlsx file, read by openpyxl: values only, no macros, no links."""

from __future__ import annotations

import io
import zipfile
from typing import Any

from sweeps.errors import SceneError, not_known, size_text
from sweeps.reading.libraries import library, library_reading

__all__ = ["sheet_rows"]

MOST_INFLATED = 1 << 30
"""Bytes of all parts of an .xlsx file, which is a ZIP archive of XML texts."""

MOST_CELLS = 2 * 10**7
MOST_ROWS = 1 << 20  # of a sheet

_OLE = b"\xd0\xcf\x11\xe0"


def sheet_rows(data: bytes, label: str, wanted: str | None = None) -> list[list[Any]]:
    """Return the rows of a sheet, without the empty cells at their ends.

    Parameters
    ----------
    data : bytes
        The file.
    label : str
        The file as messages should call it.
    wanted : str, optional
        Name of the sheet; the first one if not given.

    Raises
    ------
    SceneError
        In one line: protected by a password, too large, damaged, no such sheet; openpyxl is not
        installed.
    """
    if data[:4] == _OLE:
        raise SceneError(
            f"{label}: protected by a password, or an old .xls file; save it as .xlsx without a "
            "password"
        )
    openpyxl = library("openpyxl", "openpyxl", label)
    with library_reading(label, "an .xlsx file"):
        with zipfile.ZipFile(io.BytesIO(data)) as parts:
            inflated = sum(part.file_size for part in parts.infolist())
        if inflated > MOST_INFLATED:
            raise SceneError(
                f"{label}: {size_text(inflated)} when inflated; must be at most "
                f"{size_text(MOST_INFLATED)}"
            )
        book = openpyxl.load_workbook(
            io.BytesIO(data), read_only=True, data_only=True, keep_links=False
        )
        try:
            return _rows(_sheet(book, wanted, label), label)
        finally:
            book.close()


def _sheet(book: Any, wanted: str | None, label: str) -> Any:
    """The sheet that is wanted; the first one that is no chart if none is."""
    sheets = {sheet.title: sheet for sheet in book.worksheets}
    if wanted is not None and wanted not in sheets:
        raise SceneError(f"{label}: sheet '{wanted}': not found{not_known(wanted, sheets)}")
    if not sheets:
        raise SceneError(f"{label}: has no sheet with cells")
    return sheets[wanted] if wanted is not None else next(iter(sheets.values()))


def _rows(sheet: Any, label: str) -> list[list[Any]]:
    """Rows of a sheet without the empty cells at their ends; a sheet may claim any size."""
    rows: list[list[Any]] = []
    cells = 0
    sheet.reset_dimensions()  # what it claims; rows would be filled up to it
    for row in sheet.iter_rows(values_only=True):
        values = list(row)
        while values and (values[-1] is None or values[-1] == ""):
            values.pop()
        rows.append(values)
        cells += len(values)
        if cells > MOST_CELLS or len(rows) > MOST_ROWS:
            raise SceneError(f"{label}: more than {MOST_CELLS:g} cells or {MOST_ROWS:g} rows")
    while rows and not rows[-1]:
        rows.pop()
    return rows
