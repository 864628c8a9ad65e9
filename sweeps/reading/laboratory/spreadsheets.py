"""Recordings in sheets of .xlsx files, read by openpyxl: values only, no macros, no links."""

from __future__ import annotations

import io
import zipfile
from pathlib import Path
from typing import Any

import numpy as np

from sweeps.errors import SceneError, not_known, one_line, size_text
from sweeps.reading.laboratory.headers import names_and_units, start_of_numbers
from sweeps.reading.laboratory.libraries import library, library_reading
from sweeps.reading.laboratory.reading_choices import ReadingChoices
from sweeps.reading.laboratory.recorded_columns import Column, check_size

__all__ = ["read"]

MOST_INFLATED = 1 << 30
"""Bytes of all parts of an .xlsx file, which is a ZIP archive of XML texts."""

MOST_CELLS = 2 * 10**7
MOST_ROWS = 1 << 20  # of a sheet
HEAD = 200
"""Rows that are looked at for names and units."""

_OLE = b"\xd0\xcf\x11\xe0"


def read(
    path: Path, data: bytes, label: str, choices: ReadingChoices
) -> tuple[list[Column], int | None]:
    """Columns of a sheet, the first one unless `choices.sheet` names another, and its first row.

    Raises
    ------
    SceneError
        In one line.
    """
    del path
    if data[:4] == _OLE:
        raise SceneError(
            f"{label}: protected by a password, or an old .xls; save it as .xlsx without password"
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
            rows = _rows(_sheet(book, choices.sheet, label), label)
        finally:
            book.close()
    return _columns(rows, label)


def _sheet(book: Any, wanted: str | None, label: str) -> Any:
    """The sheet that is wanted; the first one that is no chart if none is."""
    sheets = {sheet.title: sheet for sheet in book.worksheets}
    if wanted is not None and wanted not in sheets:
        raise SceneError(f"{label}: sheet '{wanted}': there is none{not_known(wanted, sheets)}")
    if not sheets:
        raise SceneError(f"{label}: has no sheet of cells")
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


def _columns(rows: list[list[Any]], label: str) -> tuple[list[Column], int | None]:
    texts = [["" if value is None else str(value) for value in row] for row in rows[:HEAD]]
    start = start_of_numbers(texts)
    if start is None:
        raise SceneError(f"{label}: no table of numbers in the first {HEAD} rows of the sheet")
    first, width = start
    body = rows[first:]
    check_size(float(len(body)) * width, width, label)
    names, units = names_and_units(texts[:first], width)
    columns = []
    for place, (name, unit) in enumerate(zip(names, units, strict=True)):
        values = np.full(len(body), np.nan)
        text: tuple[int, str] | None = None
        for number, row in enumerate(body):
            value = row[place] if place < len(row) else None
            if isinstance(value, int | float) and not isinstance(value, bool):
                values[number] = float(value) if abs(value) < 1e300 else np.nan
            elif value is not None and text is None:
                text = (number, one_line(value, 60))
        if not np.isnan(values).all():
            columns.append(Column(name, unit, values, text))
    return columns, first + 1
