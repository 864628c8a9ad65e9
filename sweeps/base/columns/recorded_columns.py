"""Columns of a laboratory's file by name, each with the unit that the file states."""

from __future__ import annotations

import re
from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import NamedTuple, NoReturn

import numpy as np

from engine_dyn.types import Floats
from sweeps.base.columns.headers import split_unit
from sweeps.base.columns.options import PressureOptions
from sweeps.base.columns.units import is_angle_unit, pressure_unit, unit_of_name
from sweeps.base.errors import SceneError, counted, not_known, one_line, shown
from sweeps.base.ratios import BEYOND, LARGEST

MOST_VALUES = 10**8  # Values of a recording, all columns together

MOST_COLUMNS = 20_000  # Columns of a recording; a table with a column for each cycle has hundreds


@dataclass(frozen=True, eq=False)
class Column:
    """One column of a recording."""

    name: str  # Name of the column as the file has it; "column 3" where it has no names
    unit: str  # Unit as the file writes it, such as "bar" or "deg"; "" where it states none
    # Samples, NaN where the file has a blank field or a text; shape (samples,) or (cycles, samples)
    values: Floats
    # The first place (from 0) where the column has a text and no number, and the text.
    text: tuple[int, str] | None = None
    # The first place with a text that is a number in groups of digits or a decimal number.
    doubt: tuple[int, str] | None = None


class Contents(NamedTuple):
    """Columns and notes that the reader of a format finds in a file."""

    columns: list[Column]  # Columns in the order of the file
    first_line: int | None = None  # Line or row of the first sample, from 1; None without lines
    # How the file was read where there was a choice: encoding, sheet, rows left out.
    said: tuple[str, ...] = ()
    marks: tuple[int, ...] = ()


@dataclass(frozen=True, eq=False)
class Recording:
    """Columns of a laboratory's file, and how it was read."""

    label: str  # The file as messages call it
    sha256: str  # Hash of the file's bytes
    columns: dict[str, Column] = field(repr=False)  # Columns by name, in the order of the file
    first_line: int | None = None  # Line or row of the first sample, from 1; None without lines
    # How the file was read where there was a choice: encoding, sheet, rows left out.
    said: tuple[str, ...] = ()
    remarks: tuple[str, ...] = ()  # Choices of the user that had no meaning for the file
    marks: tuple[int, ...] = ()  # Samples (from 0) before which a line MARK stood

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
        """Return the finite values of a column; others are refused with their place."""
        column = self.columns[name]
        where = self.where(name)
        values = column.values
        if column.doubt is not None:
            place, text = column.doubt
            mark = "," if "," in text else "."
            raise SceneError(
                f"{where}, {self.place(place)}: '{text}' is {text.replace(mark, '')} in groups of "
                f"digits, or {text.replace(',', '.')}; give decimal (--decimal): "
                f"'{'.' if mark == ',' else ','}' for groups, '{mark}' for decimals"
            )
        if not values.size:
            raise SceneError(f"{where}: has no values")
        # A NaN among the values makes both the smallest and the largest value NaN.
        if values.min() >= -LARGEST and values.max() <= LARGEST:
            self._check_missing(values, where)
            return values
        bad = np.argwhere(~(np.abs(values) <= LARGEST))
        if np.isfinite(value := values[tuple(bad[0])]):
            raise SceneError(f"{where}, {self.place(int(bad[0][-1]))}: {value:g}: {BEYOND}")
        what = "a blank field or no number"
        if column.text is not None and column.text[0] == bad[0][-1]:
            what = f"'{one_line(column.text[1], 40)}'"
        raise SceneError(f"{where}, {self.place(int(bad[0][-1]))}: {what}: must be a finite number")

    def _check_missing(self, values: Floats, where: str) -> None:
        """Refuse numbers far away from all others that stand for missing values."""
        for end in (float(values.min()), float(values.max())):
            # Loggers write numbers such as 9999 in place of missing ones.
            if abs(end) in (999.0, 9999.0, 99999.0, 999999.0, 999.9, 9999.9, 9.99e9, 9.9e37, 1e30):
                there = values == end
                rest = np.abs(values[~there])
                # Such a number stands for missing values only if it is rare and all others are far
                # smaller, unlike in a signal with two levels.
                if there.mean() < 0.05 and rest.max() < 0.1 * abs(end):
                    place = self.place(int(np.argwhere(there)[0][-1]))
                    raise SceneError(
                        f"{where}, {place}: {end:g}: far from all others, so it seems to stand for "
                        "a value that is missing; must be a measured number"
                    )


def check_size(values: float, columns: int, label: str) -> None:
    """Refuse a recording that claims more values or columns than are read."""
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
    by_name: dict[str, Column] = {}
    for column in contents.columns:
        name, number = column.name, 2
        while name in by_name:
            name, number = f"{column.name} ({number})", number + 1
        by_name[name] = replace(column, name=name)
    if not by_name:
        raise SceneError(f"{label}: no columns of numbers")
    return Recording(
        label, sha256, by_name, contents.first_line, contents.said, marks=contents.marks
    )


_ANGLE = re.compile(
    r"^(ca|cad|crank.*|.*\bangle.*|angle.*|.*_angle.*|phi|φ|theta|.*kurbelwinkel.*|kw|°kw|degca|"
    r"alpha|winkel.*|°ca|deg|фи|"
    r".*(转角|轉角|曲轴角|角度|クランク角|크랭크 ?각|회전 ?각|угол|кут).*|"
    r".*(ángulo|angolo|ângulo|vinkel|kąt|úhel|szög|açısı).*)$", re.I
)  # fmt: skip

_CYCLE = re.compile(r"^(cycle|cyc|zyklus|zyk|c)?[ _.#-]*\d+$", re.I)


class Signals(NamedTuple):
    """Angle and pressure of a recording, as the file has them."""

    angle: Floats | None  # Angle of each sample; None where the file has none; shape (samples,)
    # Name of the column of the angle.
    angle_name: str
    angle_unit: str
    # Pressure of each cylinder by the name of its column; shape (samples,) or (cycles, samples)
    pressures: dict[str, Floats]
    units: dict[str, str]  # Unit of each pressure as the file states it
    said: list[str]  # Choices that were guessed, for messages


def signals_of(recording: Recording, options: PressureOptions) -> Signals:
    """Find angle and pressures; columns that are missing, no numbers or not clear are refused."""
    if _is_wide(recording, options):
        return _rows_of_cycles(recording, options)
    said: list[str] = []
    angle = _angle(recording, options, said)
    pressures = _pressures(recording, options, angle, said)
    numbers = {name: recording.numbers(name) for name in pressures}
    units = {name: recording.columns[name].unit for name in pressures}
    angles = None if angle is None else recording.numbers(angle)
    if angles is not None and angles.ndim > 1:
        angles = _one_row(angles, recording, angle or "")
    as_cycles = options.columns_are
    if as_cycles is None and len(pressures) > 2 and all(map(_CYCLE.match, pressures)):
        as_cycles = "cycles"
        said.append(f"{len(pressures)} columns of pressure, taken as cycles")
    if as_cycles == "cycles" and len(pressures) > 1:
        name = f"{pressures[0]} to {pressures[-1]}"
        numbers = {name: np.array(_equally_long(numbers, recording))}
        units = {name: units[pressures[0]]}
    unit = "" if angle is None else recording.columns[angle].unit
    return Signals(angles, angle or "", unit, numbers, units, said)


def _equally_long(numbers: dict[str, Floats], recording: Recording) -> list[Floats]:
    lengths = {name: values.shape for name, values in numbers.items()}
    first = next(iter(lengths.values()))
    for name, shape in lengths.items():
        if shape != first or len(shape) > 1:
            raise SceneError(
                f"{recording.where(name)}: {shape[-1]} samples, the "
                f"others {first[-1]}; cycles must be equally long"
            )
    return list(numbers.values())


def _one_row(angles: Floats, recording: Recording, name: str) -> Floats:
    """Angles of one cycle, where all cycles have the same."""
    for rows in (angles, angles.T):
        if np.allclose(rows, rows[0], atol=1e-6):
            return np.asarray(rows[0])
    raise SceneError(
        f"{recording.where(name)}: the angles of its "
        f"{angles.shape[0]} rows differ; must be the same in all cycles, or one column"
    )


def named_column(recording: Recording, wanted: str | int, key: str) -> str:
    """Name of a column that is given by its name, with or without its unit, or by its number.

    Raises
    ------
    SceneError
        Where there is none; `key` is what gives it.
    """
    names = list(recording.columns)
    if isinstance(wanted, str) and wanted in recording.columns:
        return wanted
    if isinstance(wanted, str):
        name, unit = split_unit(wanted)  # A name may have its unit, as in the file
        if unit and name in recording.columns and recording.columns[name].unit == unit:
            return name
    number = int(wanted) if str(wanted).isascii() and str(wanted).isdigit() else 0
    if 1 <= number <= len(names):
        return names[number - 1]
    shortened = names[:20]
    what = not_known(str(wanted), shortened, also=f"; or a number from 1 to {len(names)}")
    raise SceneError(f"{recording.label}: {key} = {shown(wanted)}: no such column{what}")


def wanted_pressures(recording: Recording, options: PressureOptions) -> list[str] | None:
    """Names of the columns of pressure that are asked for; None where they are to be guessed.

    Raises
    ------
    SceneError
        Where there is no such column.
    """
    wanted = options.pressure_column
    if wanted is None:
        return None
    listed = wanted if isinstance(wanted, list) else [wanted]
    return [named_column(recording, item, "pressure_column") for item in listed]


def _angle(recording: Recording, options: PressureOptions, said: list[str]) -> str | None:
    if options.angle_column is not None:
        return named_column(recording, options.angle_column, "angle_column")
    if options.angle_increment is not None:
        return None
    columns = recording.columns
    good = [n for n, c in columns.items() if is_angle_unit(c.unit)]
    if len(good) != 1:
        good = [n for n in good or columns if _called(n, _ANGLE) or n.lower().endswith("_deg")]
    if not good and all(n.startswith("column ") for n in columns):
        good = [n for n in columns if _looks_like_angles(columns[n].values)]
        good = good[:1] if len(columns) == 2 else good
    if len(good) == 1:
        said.append(f"column '{good[0]}' taken as the crank angle")
        return good[0]
    _unclear(recording, "angle_column", good)


def _looks_like_angles(values: Floats) -> bool:
    """Whether values rise or fall in even steps, but for jumps at the ends of cycles."""
    if values.ndim > 1 or len(values) < 8:
        return False
    steps = np.diff(values)
    usual = float(np.median(steps))
    return usual != 0.0 and float(np.mean(np.abs(steps - usual) < 0.2 * abs(usual))) > 0.9


def _pressures(
    recording: Recording, options: PressureOptions, angle: str | None, said: list[str]
) -> list[str]:
    pressures = wanted_pressures(recording, options)
    if pressures is not None:
        if not pressures:
            raise SceneError(f"{recording.label}: pressure_column = []: must name a column")
        if angle in pressures or len(set(pressures)) < len(pressures):
            raise SceneError(
                f"{recording.label}: pressure_column: names a column twice, or that of the angle"
            )
        return pressures
    rest = {n: c for n, c in recording.columns.items() if n != angle}
    stated = [n for n, c in rest.items() if c.unit and _is_pressure(c.unit, recording.label)]
    pressure = re.compile(
        r"^(p|p[ _.-]?\d+|.*p[ _.-]?cyl.*|.*cyl.*p(ress.*)?\d*|.*press.*|.*druck.*|.*p[ _.-]?zyl.*|"
        r"p[ _.-]?mean|indicated.*|kistler.*|pzyl.*|(.*[^电電])?(压|壓|圧).*|"
        r".*(압력|давлен|тиск).*|"
        r".*(presión|presion|pressão|tryck|trykk?|ciśnien|tlak|nyomás|basınc).*)$", re.I
    )  # fmt: skip
    named = [n for n in rest if _called(n, pressure) or _CYCLE.match(n)]
    good = [n for n in stated if n in named] or stated or named
    good = good or [n for n in rest if _is_pressure(unit_of_name(n, ""), recording.label)]
    elsewhere = re.compile(
        r"(inta|inlet|exh|manifold|rail|boost|ambient|oil|fuel|saug|abgas|进气|"
        r"排气|機油|机油|吸気|排気|흡기|배기|впуск|выпуск|масл|топлив|admis|échap|aspira|scarico|escape)",
        re.I,
    )
    good = [n for n in good if not elsewhere.search(n)]
    # Beside mean pressures, a file may have their spread over the cycles, which is no pressure.
    spread = re.compile(
        r"(^|[ _.-])(min|max|std|stdev|stddev|dev|sigma|var|cov|upper|lower)\.?$", re.I
    )
    good = [n for n in good if not spread.search(n)] or good
    if not good and len(rest) == 1:
        good = list(rest)
    if any(_again(one, other) for one in good for other in good):
        _unclear(recording, "pressure_column", good)
    if not good and options.columns_are is not None:
        good = [n for n, c in rest.items() if not c.unit or pressure_unit(c.unit)]
    if not good or (
        len(good) > 12 and options.columns_are is None and not all(map(_CYCLE.match, good))
    ):
        _unclear(recording, "pressure_column", good)
    names = ", ".join(f"'{n}'" for n in good)
    what = "column" if len(good) == 1 else "columns"
    said.append(one_line(f"{what} {names} taken as the cylinder pressure", 300))
    return good


def _called(name: str, words: re.Pattern[str]) -> bool:
    """Whether a column, without group or structure ("run.CA"), has a name with one of the words."""
    return any(words.match(one) for one in (name, re.split(r"[./]", name)[-1]))


def _again(name: str, other: str) -> bool:
    """Whether a column seems to be another one again, such as PCYL1_FILT beside PCYL1."""
    return len(other) > 2 and re.match(re.escape(other) + r"[ _.-]+[a-z]", name, re.I) is not None


def _is_pressure(unit: str, label: str) -> bool:
    known_unit = pressure_unit(unit)
    return known_unit is not None and not known_unit.voltage


def _unclear(recording: Recording, key: str, candidates: Sequence[str]) -> NoReturn:
    """Refuse a recording whose columns are not clear; it always raises `SceneError`."""
    which = candidates or list(recording.columns)
    listed = one_line(", ".join(f"'{name}'" for name in which[:20]), 300)
    what = "ambiguous" if candidates else "cannot be determined from the columns"
    without = ", or, without one, angle_start and angle_increment" if key == "angle_column" else ""
    raise SceneError(
        f"{recording.label}: {key}: {what} ({listed}); give the name or number of one{without}"
    )


def _is_wide(recording: Recording, options: PressureOptions) -> bool:
    """Whether each row of a table is a cycle."""
    columns = recording.columns.values()
    # A table of 60 columns of numbers or more may have a cycle in each row.
    return (
        options.angle_column is None and options.pressure_column is None
        and options.columns_are is None
        and len(columns) >= 60 and all(c.values.ndim == 1 for c in columns)
        and not any(_ANGLE.match(c.name) for c in columns)
    )  # fmt: skip


def _rows_of_cycles(recording: Recording, options: PressureOptions) -> Signals:
    """Cycles that are rows, below a row of angles or without angles."""
    columns = list(recording.columns.values())
    said = ["each row taken as a cycle"]
    try:
        names = np.array([float(c.name) for c in columns[1:]])
    except ValueError:
        names = np.zeros(0)
    if len(names) and np.all(np.diff(names) > 0.0) and options.angle_increment is None:
        chosen, angles, first = columns[1:], names, 0
    else:
        # A column of labels, such as the number of the cycle, has no angle in the first row.
        chosen = [c for c in columns if np.isfinite(c.values[0])]
        top = np.array([c.values[0] for c in chosen])
        if options.angle_increment is not None:
            angles, first = None, 0
        elif len(top) > 1 and (np.all(np.diff(top) > 0.0) or np.all(np.diff(top) < 0.0)):
            angles, first = top, 1
            said.append("the first row taken as the crank angle")
        else:
            raise SceneError(
                f"{recording.label}: {len(columns)} columns, and no angle among them; must have an "
                "angle in the first row, or angle_start and angle_increment"
            )
    values = [recording.numbers(c.name)[first:] for c in chosen]
    matrix = np.array(values).T
    if not matrix.size:
        raise SceneError(f"{recording.label}: no rows of pressure below the row of angles")
    return Signals(angles, "first row", "", {"rows": matrix}, {"rows": chosen[0].unit}, said)
