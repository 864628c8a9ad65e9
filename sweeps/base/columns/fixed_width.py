"""Recordings in text files whose columns have fixed places, where fields may be blank.

A column is where lines of numbers have characters, between places where all of them are blank.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from sweeps.base.columns.encodings import encoding_of
from sweeps.base.columns.headers import is_number, names_and_units, number_of
from sweeps.base.columns.reading_choices import ReadingChoices
from sweeps.base.columns.recorded_columns import Column, Contents, check_size
from sweeps.base.columns.text_tables import LINES
from sweeps.base.errors import SceneError, one_line

__all__ = ["read"]


def read(path: Path, data: bytes, label: str, choices: ReadingChoices) -> Contents:
    """Columns of a text file with fixed places, and the line of the first sample.

    Raises
    ------
    SceneError
        In one line.
    """
    del path
    encoding, said = encoding_of(data, label, choices.encoding)
    text = data.decode(encoding, "replace")
    lines = text.rstrip().splitlines()
    found = _start(lines[:LINES], choices)
    if found is None:
        raise SceneError(
            f"{label}: no lines of numbers in its first {LINES} lines; must be columns of numbers "
            "at fixed places"
        )
    first, decimal = found
    body = lines[first:]
    places = _places(body)
    check_size(float(len(body)) * len(places), len(places), label)
    # Names may be wider than the numbers below them.
    for above in (lines[max(first - 2, 0) :], lines[max(first - 1, 0) :]):
        wider = _places(above)
        if len(wider) == len(places) and all(map(_within, places, wider)):
            places = wider
            break
    head = [[line[place].strip() for place in places] for line in lines[:first]]
    names, units = names_and_units(head, len(places))
    columns = [
        _column(name, unit, [line[place].strip() for line in body], decimal)
        for name, unit, place in zip(names, units, places, strict=True)
    ]
    return Contents(columns, first + 1, tuple(filter(None, [said])))


def _start(lines: Sequence[str], choices: ReadingChoices) -> tuple[int, str] | None:
    """The first of six lines of numbers, or of all that are left, and their decimal mark."""
    for decimal in (".", ",") if choices.decimal is None else (choices.decimal,):
        numeric = [
            bool(line.strip()) and all(is_number(field, decimal) for field in line.split())
            for line in lines
        ]
        for first in range(len(lines)):
            if all(numeric[first : first + 6]):
                return first, decimal
    return None


def _places(lines: Sequence[str]) -> list[slice]:
    """Where columns are: between places where all lines are blank."""
    used = np.zeros(max(map(len, lines)) + 2, dtype=bool)
    for line in lines:
        used[1 : len(line) + 1] |= np.array([not letter.isspace() for letter in line], dtype=bool)
    begins, ends = np.flatnonzero(np.diff(used)).reshape(-1, 2).T
    return [slice(int(begin), int(end)) for begin, end in zip(begins, ends, strict=True)]


def _within(place: slice, wider: slice) -> bool:
    """Whether a column of numbers lies below one name."""
    return bool(wider.start <= place.start and place.stop <= wider.stop)


def _column(name: str, unit: str, fields: Sequence[str], decimal: str) -> Column:
    """One column; where it has texts, the first of them."""
    values = np.full(len(fields), np.nan)
    text: tuple[int, str] | None = None
    for place, field in enumerate(fields):
        if is_number(field, decimal):
            values[place] = number_of(field, decimal)
        elif field and text is None:
            text = (place, one_line(field, 60))
    return Column(name, unit, values, text)
