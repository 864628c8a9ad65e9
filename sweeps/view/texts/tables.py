"""Designs as a table on the terminal, and notes on the values that were asked for."""

from __future__ import annotations

import itertools
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from engine_dyn.status import MEANINGS, has_numbers
from sweeps.base.dimensions import number_inside, words_of
from sweeps.base.errors import counted, one_line
from sweeps.base.numbers import DIGITS, digits_of, finest, last_digit, number_text
from sweeps.decide.explore.rows import Rows
from sweeps.view.texts.readable_units import converted, unit_choices

if TYPE_CHECKING:
    import xarray as xr

OF_BANDS = "in brackets: 95 % range due to the uncertain values"


def last_digits(columns: Mapping[str, Any]) -> dict[str, int]:
    """Powers of ten of the last digits that `omega_max` beside `omega_min` needs, by name.

    The largest and the smallest value of one thing, by their names, get as many places as their
    difference needs to have three digits, and the mean as many; its differences from them have
    two. `columns` are numbers or arrays that broadcast, in one unit for each thing.
    """
    things: dict[str, list[str]] = {}
    for name in columns:
        things.setdefault(re.sub(r"_(?:max|min|mean)(?=_|$)", "", name), []).append(name)
    lasts: dict[str, int] = {}
    for thing, names in things.items():
        pairs = itertools.combinations([n for n in names if n != thing], 2)
        last = finest(*(
            last_digit(columns[a], columns[b], 2 if "_mean" in a + b else 3) for a, b in pairs
        ))  # fmt: skip
        if last is not None:
            lasts |= dict.fromkeys(names, last)
    return lasts


def without_rounding(values: npt.NDArray[Any], unit: str) -> npt.NDArray[Any]:
    """Results with 0 for rounding, compared with the largest of them or with 1 of their unit.

    Numbers without a unit, such as relative errors, may all be small.
    """
    sizes = np.abs(values.astype(float))
    largest = sizes.max(initial=0.0 if unit in ("", "1") else 1.0, where=np.isfinite(sizes))
    return np.where(sizes < 1e-12 * largest, 0.0, values)


def aligned(rows: Sequence[Sequence[str]], left: Sequence[int] = ()) -> list[str]:
    """Lines of texts in columns to the right, or to the left where their numbers are given."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    lines = []
    for row in rows:
        cells = [
            text.ljust(width) if number in left else text.rjust(width)
            for number, (text, width) in enumerate(zip(row, widths, strict=True))
        ]
        lines.append("  ".join(cells).rstrip())
    return lines


NONE_IF = ", none if "
"""Words before the reason for a missing value, at the end of a quantity's meaning."""


def rows_text(
    rows: Rows, units: str | None = None, width: int | None = None, *, python: bool = False
) -> str:
    """Write designs as a table, no wider than a terminal of some `width`.

    `units` are those of columns, ``power=kW,speed=rpm``, or `archive` for those of the archive;
    SceneError refuses units that do not fit. What more could be shown is named by options of the
    command, or by keywords if `python`.
    """
    limit, select, names_of = (
        ("limit=...", "select=dict({})", 'quantities="{}"')
        if python
        else ("--limit", "--select {}", "--quantities {}")
    )
    known = {name: unit for name, unit in rows.units.items() if name not in rows.changes}
    choices = unit_choices(units, known)
    columns = {name: _column(rows, name, choices.get(name)) for name in rows.table}
    lines = []
    if rows.fixed:
        lines.append("at " + ", ".join(f"{k} = {_fixed(v)}" for k, v in rows.fixed.items()))
    line_width = 100  # Characters of a line where the output is no terminal
    if rows.number <= 3:  # Up to three designs are the columns of one table
        lines.append(_upright(columns, rows, width or line_width))
    else:
        same = {n: c for n, c in columns.items() if len({*c.cells}) == 1 and n not in rows.changes}
        columns = {n: c for n, c in columns.items() if n not in same}
        lines.append(_wide(columns, rows, width or line_width))
        if same:
            told = (f"{n} {c.cells[0]} {c.unit}".rstrip() for n, c in same.items())
            lines.append(f"the same in all of these rows: {', '.join(told)}")
        computed = _computed(rows)
        for name, column in {**columns, **same}.items():
            reason = rows.texts.get(name, "").partition(NONE_IF)[2]
            if reason and "-" in itertools.compress(column.cells, computed):
                lines.append(f"{name} -: none if {reason}")
    shown = rows.number
    if shown < rows.designs:
        what = "row" if rows.listed else "design"
        lines.append(f"{shown:,} of {counted(rows.designs, what)}; {limit} shows more")
    if rows.curves:
        lines.append(f"not shown, because they are curves: {', '.join(rows.curves)}")
    for one, names in rows.several.items():
        over = ", ".join(part.partition("=")[0] for part in one.split(","))
        lines.append(
            f"not shown, because they have several numbers for each design (over {over}): "
            f"{', '.join(names)}; {select.format(one)} shows one of them, "
            f"{names_of.format(names[0])} all"
        )
    if rows.bands:
        lines.append(OF_BANDS)
    if rows.elasticities:
        lines.append(
            f"a row for each parameter: engine-dyn show --quantities {','.join(rows.elasticities)}"
        )
    return "\n".join(lines)


def _computed(rows: Rows) -> npt.NDArray[np.bool_]:
    """Whether rows have results: by their status, and by quantities that all engines have."""
    failed = [word for code, word in enumerate(MEANINGS) if not has_numbers(code)]
    statuses = rows.table.get("status", np.full(rows.number, ""))
    good = np.array([status not in failed for status in statuses])
    others = [n for n in rows.units if n not in rows.given and NONE_IF not in rows.texts.get(n, "")]
    return good & np.any([~np.isnan(rows.table[n]) for n in others], axis=0) if others else good


@dataclass(frozen=True)
class _Column:
    """Cells of a column as texts; `number` says whether they are numbers."""

    name: str
    unit: str
    cells: tuple[str, ...]
    number: bool

    @property
    def head(self) -> str:
        return f"{self.name} [{self.unit}]" if self.unit else self.name

    @property
    def width(self) -> int:
        return max(len(self.head), *(len(cell) for cell in self.cells), 0)


def _column(rows: Rows, name: str, wanted: str | None) -> _Column:
    values = rows.table[name]
    if name not in rows.units:
        return _Column(name, "", tuple(one_line(value, 40) for value in values), number=False)
    cells, unit = number_cells(rows, name, wanted)
    return _Column(name, unit, cells, number=True)


def number_cells(rows: Rows, name: str, wanted: str | None) -> tuple[tuple[str, ...], str]:
    """Numbers of a column as texts, uncertain ones with their band, and the unit they are in."""
    factor, unit = converted(rows.units[name], wanted)
    # Changes in percent have three digits and a sign.
    digits, sign = (3, "+") if name in rows.changes else (DIGITS, "")
    values = rows.table[name]
    last = None
    if name in rows.given:
        digits = digits_of(values * factor)
    elif name not in rows.changes:
        values = without_rounding(values, rows.units[name])
        alike = {n: rows.table[n] * factor for n, of in rows.units.items()
                 if of == rows.units[name] and n not in rows.given}  # fmt: skip
        last = last_digits(alike).get(name)
    cells = [number_text(float(value) * factor, digits, sign, last) for value in values]
    if name in rows.bands:
        low, high = (end * factor for end in rows.bands[name])
        last = finest(last, last_digit(low, high))
        cells = [
            " ".join((number_text(float(value) * factor, digits, sign, last),
                      f"({number_text(a, digits, last=last)} to "
                      f"{number_text(b, digits, last=last)})"))
            for value, a, b in zip(values, low, high, strict=True)
        ]  # fmt: skip
    return tuple(cells), unit


def meaning(rows: Rows, name: str) -> str:
    """Meaning of a column, and the parameter that most of its uncertainty comes from."""
    text = one_line(rows.texts.get(name, ""))
    return f"{text}; uncertainty mostly from {rows.mainly[name]}" if name in rows.mainly else text


def _fixed(value: Any) -> str:
    return number_text(float(value)) if isinstance(value, int | float) else one_line(value, 40)


def _table(*, show_header: bool = True) -> Any:
    from rich import box
    from rich.table import Table

    return Table(box=box.SIMPLE_HEAD if show_header else None, pad_edge=False,
                 show_header=show_header)  # fmt: skip


def _printed(table: Any, width: int) -> str:
    from rich.console import Console

    console = Console(width=width, color_system=None, highlight=False, markup=False)
    with console.capture() as captured:
        console.print(table)
    return "\n".join(line.rstrip() for line in captured.get().splitlines() if line.strip())


def _upright(columns: Mapping[str, _Column], rows: Rows, width: int) -> str:
    """Table with a line for each quantity; a few designs have room next to each other."""
    table = _table(show_header=rows.number > 1)
    table.add_column("")
    for number in range(rows.number):
        table.add_column(str(number + 1), justify="right", no_wrap=True)
    table.add_column("")
    table.add_column("", overflow="fold")
    for name, column in columns.items():
        table.add_row(name, *column.cells, column.unit, meaning(rows, name))
    return _printed(table, width)


def _wide(columns: Mapping[str, _Column], rows: Rows, width: int) -> str:
    """Table with a column for each quantity, or several tables below each other."""
    # If the columns that name a design take more than half of a line, they stand in a table of
    # their own, and the others repeat one column as the row's name.
    given = [c for n, c in columns.items() if n in rows.given]
    others = [c for n, c in columns.items() if n not in rows.given]
    texts = []
    if _needed([*given, *others]) > width and 2 * _needed(given) > width:
        telling = [c for c in given if len(set(c.cells)) == len(c.cells)]
        words = [c for c in telling if not c.number]
        if telling and len(given) > 1:
            texts.append(_columns_text(given, rows, width))
            given = (words or telling)[:1]
    parts: list[list[_Column]] = [[]]
    for column in others:
        if parts[-1] and _needed([*given, *parts[-1], column]) > width:
            parts.append([])
        parts[-1].append(column)
    texts += [_columns_text([*given, *part], rows, width) for part in parts]
    return "\n\n".join(texts)


def _needed(columns: Sequence[_Column]) -> int:
    return sum(c.width + 3 for c in columns)


def _columns_text(columns: Sequence[_Column], rows: Rows, width: int) -> str:
    table = _table()
    for column in columns:
        table.add_column(column.head, justify="right" if column.number else "left", no_wrap=True)
    for place in range(rows.number):
        table.add_row(*(column.cells[place] for column in columns))
    return _printed(table, max(width, _needed(columns)))


def nearest_notes(archive: xr.Dataset, values: Mapping[str, float | str]) -> list[str]:
    """Notes on values of axes that the archive does not have, for which the nearest are taken.

    Numbers that look alike in a table, with its four digits, are the same. Words, and names that
    are no axes, are left to whoever cuts the archive; SceneError refuses numbers outside their
    axis.
    """
    notes = []
    words = words_of(archive)
    for name, value in values.items():
        if name in words or name not in archive.dims or name not in archive.coords:
            continue
        axis = archive[name].values
        if axis.dtype.kind not in "iuf":
            continue
        number, unit = number_inside(archive, name, value)
        taken = float(axis[np.nanargmin(np.abs(axis - number))])
        if number_text(taken) != number_text(number):
            notes.append(
                f"{name} = {number:.12g}{unit} is not in the archive; the nearest value, "
                f"{number_text(taken)}{unit}, was taken"
            )
    return notes
