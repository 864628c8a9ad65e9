"""Recordings in sheets of .xlsx files."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from sweeps.errors import SceneError, one_line
from sweeps.reading.laboratory.headers import names_and_units, start_of_numbers
from sweeps.reading.laboratory.reading_choices import ReadingChoices
from sweeps.reading.laboratory.recorded_columns import Column, Contents, check_size
from sweeps.reading.sheets import sheet_rows

__all__ = ["read"]

HEAD = 200
"""Rows that are looked at for names and units."""


def read(path: Path, data: bytes, label: str, choices: ReadingChoices) -> Contents:
    """Columns of a sheet, the first one unless `choices.sheet` names another, and its first row.

    Raises
    ------
    SceneError
        In one line.
    """
    del path
    return _columns(sheet_rows(data, label, choices.sheet), label)


def _columns(rows: list[list[Any]], label: str) -> Contents:
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
    return Contents(columns, first + 1)
