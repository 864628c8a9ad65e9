"""Recordings in sheets of .xlsx files."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from sweeps.base.columns.headers import names_and_units, start_of_numbers
from sweeps.base.columns.reading_choices import ReadingChoices
from sweeps.base.columns.recorded_columns import Column, Contents, check_size
from sweeps.base.errors import SceneError, counted, one_line
from sweeps.base.files.sheets import sheets

__all__ = ["read"]

HEAD = 200
"""Rows that are looked at for names and units."""

FAR_LONGER = 10
"""Ratio of rows from which on a table further behind is the recording, and the first a summary."""

NAMED = 20
"""Sheets that are named in a message."""


def read(path: Path, data: bytes, label: str, choices: ReadingChoices) -> Contents:
    """Columns of a sheet, and its first row.

    Without `choices.sheet` that is the first one with a table of numbers, or one whose table is far
    longer.

    Raises
    ------
    SceneError
        In one line.
    """
    del path
    found = sheets(data, label, choices.sheet)
    starts = {title: start_of_numbers(_texts(rows[:HEAD])) for title, rows in found.items()}
    tables = {title: start for title, start in starts.items() if start is not None}
    names = ", ".join(f"'{one_line(title, 60)}'" for title in list(found)[:NAMED])
    if not tables:
        where = f"of the sheet {names}" if len(found) == 1 else f"of any sheet: {names}"
        raise SceneError(f"{label}: no table of numbers in the first {HEAD} rows {where}")
    lengths = {title: len(found[title]) - start[0] for title, start in tables.items()}
    taken = first = next(iter(tables))
    longest = max(lengths, key=lengths.__getitem__)
    if lengths[longest] > FAR_LONGER * lengths[first]:
        taken = longest
    said = []
    if len(found) > 1:
        said = [f"sheet '{one_line(taken, 60)}' of {names} read (sheet takes another one)"]
    first_row, width = tables[taken]
    beside = sum(len(row) > width for row in found[taken][first_row:])
    if beside:
        said.append(f"values right of the table in {counted(beside, 'row')} left out")
    return _columns(found[taken], tables[taken], label)._replace(said=tuple(said))


def _texts(rows: list[list[Any]]) -> list[list[str]]:
    return [["" if value is None else str(value) for value in row] for row in rows]


def _columns(rows: list[list[Any]], start: tuple[int, int], label: str) -> Contents:
    first, width = start
    body = rows[first:]
    check_size(float(len(body)) * width, width, label)
    names, units = names_and_units(_texts(rows[:first]), width)
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
