"""What a laboratory's file holds: columns by name, each with the unit that the file states."""

from __future__ import annotations

from bisect import bisect_right
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from engine_dyn.types import Floats
from sweeps.base.errors import SceneError, counted, one_line
from sweeps.base.ratios import BEYOND, LARGEST

__all__ = [
    "MOST_COLUMNS",
    "MOST_VALUES",
    "Column",
    "Contents",
    "Recording",
    "check_size",
    "recording_of",
]

MOST_VALUES = 10**8
"""Values of a recording, all columns together."""

MISSING = (999.0, 9999.0, 99999.0, 999999.0, 999.9, 9999.9, 9.99e9, 9.9e37, 1e30)
"""Sizes of numbers that loggers write for missing ones."""

FAR = 0.1
"""Largest of all other numbers over such a number."""

FEW = 0.05
"""Most share of such numbers: two levels of a signal are none."""

MOST_COLUMNS = 20_000
"""Columns of a recording; a table with a column for each cycle has hundreds."""


@dataclass(frozen=True, eq=False)
class Column:
    """One column of a recording.

    Attributes
    ----------
    name : str
        As the file calls it; "column 3" where it has no names.
    unit : str
        As the file writes it, such as "bar" or "deg"; "" where it states none.
    values : ndarray, shape (samples,) or (cycles, samples)
        NaN where the file has a blank field, or a text.
    text : tuple of int and str, optional
        The first place (from 0) where there is a text and no number, and the text.
    """

    name: str
    unit: str
    values: Floats
    text: tuple[int, str] | None = None


class Contents(NamedTuple):
    """Columns and notes that the reader of a format finds in a file.

    Attributes
    ----------
    columns : list of Column
        In the order of the file.
    first_line : int, optional
        As `Recording`.
    said, marks : tuple
        As `Recording`.
    """

    columns: list[Column]
    first_line: int | None = None
    said: tuple[str, ...] = ()
    marks: tuple[int, ...] = ()


@dataclass(frozen=True, eq=False)
class Recording:
    """What a laboratory's file holds.

    Attributes
    ----------
    label : str
        The file as messages call it.
    sha256 : str
        Hash of the file's bytes.
    columns : dict of Column
        By name, in the order of the file.
    first_line : int, optional
        Number of the line (of a sheet: of the row) of the first sample; None for other files.
    said : tuple of str
        How the file was read where there was a choice: encoding, sheet, what was left out.
    remarks : tuple of str
        Which choices of the user had no meaning for the file.
    marks : tuple of int
        Samples (from 0) before which a line MARK stood: time may have passed there.
    """

    label: str
    sha256: str
    columns: dict[str, Column] = field(repr=False)
    first_line: int | None = None
    said: tuple[str, ...] = ()
    remarks: tuple[str, ...] = ()
    marks: tuple[int, ...] = ()

    def place(self, sample: int) -> str:
        """Return the place of a sample (from 0), as editors and sheets show it: "line 12"."""
        if self.first_line is None:
            return f"sample {sample + 1}"
        return f"line {self.first_line + sample + bisect_right(self.marks, sample)}"

    def at(self, sample: int) -> str:
        """Return the file and the place of a sample (from 0) in it."""
        return f"{self.label}, {self.place(sample)}"

    def where(self, name: str) -> str:
        """Return the file and a column of it, as messages call them."""
        return f"{self.label}, column '{one_line(name, 60)}'"

    def numbers(self, name: str) -> Floats:
        """Return the finite values of a column.

        Raises
        ------
        SceneError
            With the place, where the column has a text, a blank field or an infinite value.
        """
        column = self.columns[name]
        where = self.where(name)
        values = column.values
        if not values.size:
            raise SceneError(f"{where}: has no values")
        # Of a NaN among them, both are NaN: no array is made.
        if values.min() >= -LARGEST and values.max() <= LARGEST:
            self._check_missing(values, where)
            return values
        bad = np.argwhere(~(np.abs(values) <= LARGEST))
        if np.isfinite(value := values[tuple(bad[0])]):
            raise SceneError(f"{where}, {self.place(int(bad[0][-1]))}: {value:g}: {BEYOND}")
        what = "a blank field or no number"
        if column.text is not None:
            what = f"'{one_line(column.text[1], 40)}'"
        raise SceneError(f"{where}, {self.place(int(bad[0][-1]))}: {what}: must be a finite number")

    def _check_missing(self, values: Floats, where: str) -> None:
        """Refuse numbers that stand for missing ones far away from all others."""
        for end in (float(values.min()), float(values.max())):
            if abs(end) in MISSING:
                there = values == end
                rest = np.abs(values[~there])
                if there.mean() < FEW and rest.max() < FAR * abs(end):
                    place = self.place(int(np.argwhere(there)[0][-1]))
                    raise SceneError(
                        f"{where}, {place}: {end:g}: far from all others, so it seems to stand for "
                        "a value that is missing; must be a measured number"
                    )


def check_size(values: float, columns: int, label: str) -> None:
    """Refuse a recording that claims more values or columns than are read.

    Raises
    ------
    SceneError
        With the number.
    """
    if columns > MOST_COLUMNS:
        raise SceneError(f"{label}: {counted(columns, 'column')}; must be at most {MOST_COLUMNS}")
    if values > MOST_VALUES:
        raise SceneError(f"{label}: {values:.3g} values; must be at most {MOST_VALUES:g}")


def recording_of(label: str, sha256: str, contents: Contents) -> Recording:
    """Make a recording of columns whose names may repeat; the later ones get a number.

    Raises
    ------
    SceneError
        Where there are none.
    """
    found: dict[str, Column] = {}
    for column in contents.columns:
        name, number = column.name, 2
        while name in found:
            name, number = f"{column.name} ({number})", number + 1
        found[name] = Column(name, column.unit, column.values, column.text)
    if not found:
        raise SceneError(f"{label}: no columns of numbers")
    return Recording(label, sha256, found, contents.first_line, contents.said, marks=contents.marks)
