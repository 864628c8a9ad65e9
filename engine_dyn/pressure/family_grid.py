"""Families of indicator diagrams over load and speed, measured or modelled, on a full grid.

Between neighbours it does in both directions what `family.Family` does over load: the angle is
warped until the peaks meet, the logarithms of the pressures are blended, and the result is a table
of rows between which the diagram is linear in load and in speed.

Angles are in radians, pressures in pascal, speeds in rad/s. Messages speak in rpm.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from engine_dyn.given_numbers import distinct_combinations
from engine_dyn.pressure.diagram import Diagram
from engine_dyn.pressure.family import (
    LARGEST_SHIFT,
    Family,
    RowsOfDiagrams,
    TableAxis,
    blend,
    morph,
    on_common_knots,
)
from engine_dyn.types import Floats, Integers
from engine_dyn.units import DEGREE, RPM


class Place(NamedTuple):
    """Where points of load and speed lie in the table; arrays of one shape.

    The diagram is the sum of four rows: `row` and `row + across` at the lower load, the second with
    the fraction `over_speed`; `row + along` and `row + along + across` at the higher load, which
    has the fraction `over_load`. Where a fraction is exactly 0, the row that it belongs to is not
    needed and need not exist.
    """

    row: Integers
    over_load: Floats
    over_speed: Floats
    along: int
    across: int = 1


@dataclass(frozen=True, eq=False)
class FamilyGrid(RowsOfDiagrams):
    """Indicator diagrams over load and speed, and every point between the outermost.

    Make it with `grid_from_diagrams`, which checks that no diagram is missing.
    """

    # Diagrams over load at each given speed, with the same loads and knots in all.
    columns: tuple[Family, ...]
    speeds: Floats  # Given speeds [rad/s], strictly ascending; shape (S,)
    _rows: dict[int, Diagram] = field(default_factory=dict, init=False, repr=False)

    @property
    def period(self) -> float:
        """Angle of the cycle [rad]."""
        return self.columns[0].period

    @property
    def loads(self) -> Floats:
        """Given loads [percent], strictly ascending."""
        return self.columns[0].loads

    @property
    def low(self) -> float:
        """Lowest load [percent]."""
        return self.columns[0].low

    @property
    def high(self) -> float:
        """Highest load [percent]."""
        return self.columns[0].high

    @property
    def diagrams(self) -> tuple[Diagram, ...]:
        """All given diagrams, those of one speed beside each other."""
        return tuple(diagram for column in self.columns for diagram in column.diagrams)

    def each(self, change: Callable[[Diagram], Diagram]) -> FamilyGrid:
        """Grid of the diagrams that `change` makes of the given ones."""
        return grid_from_diagrams(
            [
                (load, speed, change(diagram))
                for speed, column in zip(self.speeds.tolist(), self.columns, strict=True)
                for load, diagram in zip(column.loads.tolist(), column.diagrams, strict=True)
            ]
        )

    def at_speeds(self, speeds: ArrayLike) -> FamilyAtSpeeds:
        """Diagrams over load at some speeds [rad/s] within the grid, in any order."""
        wanted = np.unique(np.asarray(speeds, dtype=np.float64))
        self.locate(self.low, wanted)
        return FamilyAtSpeeds(self.loads, self.diagrams, self, wanted)

    @property
    def row_count(self) -> int:
        """Number of rows of the table: its loads times its speeds."""
        return self.columns[0].row_count * self.speed_count

    @property
    def speed_count(self) -> int:
        """Number of speeds of the table; rows of one load lie beside each other."""
        return self._speed_axis.count

    def locate(self, load: ArrayLike, speed: ArrayLike) -> Place:
        """Where points lie in the table.

        Parameters
        ----------
        load, speed : array_like
            Loads [percent] and speeds [rad/s]; they broadcast together.

        Raises
        ------
        ValueError
            For a load or a speed outside the grid.
        """
        wanted, turning = np.broadcast_arrays(
            np.asarray(load, dtype=np.float64), np.asarray(speed, dtype=np.float64)
        )
        load_row, over_load = self.columns[0].locate(wanted)
        low, high = float(self.speeds[0]), float(self.speeds[-1])
        slack = 1e-12 * high
        bad = ~((turning >= low - slack) & (turning <= high + slack))
        if bad.any():
            value = float(turning[bad].flat[0]) / RPM
            if len(self.speeds) == 1:
                allowed = f"the engine has diagrams for {low / RPM:g} rpm alone"
            else:
                allowed = f"the engine's diagrams cover {low / RPM:g}..{high / RPM:g} rpm"
            raise ValueError(f"speed {value:g} rpm is not allowed: {allowed}")
        speed_row, over_speed = self._speed_axis.locate(np.clip(turning, low, high))
        along = self.speed_count
        return Place(load_row * along + speed_row, over_load, over_speed, along)

    def _make_row(self, index: int) -> Diagram:
        load_row, speed_row = divmod(index, self.speed_count)
        segment, fraction = self._speed_axis.between(speed_row)
        here = self.columns[segment].row(load_row)
        if fraction == 0.0:
            return here
        return morph(here, self.columns[segment + 1].row(load_row), fraction)

    def at(self, load: float, speed: float) -> Diagram:
        """Diagram at one load [percent] and speed [rad/s]: the blend of its four rows.

        Raises
        ------
        ValueError
            For a load or a speed outside the grid.
        """
        place = self.locate(load, speed)
        row, u, v = int(place.row), float(place.over_load), float(place.over_speed)
        fractions = {
            row: (1.0 - u) * (1.0 - v),
            row + place.across: (1.0 - u) * v,
            row + place.along: u * (1.0 - v),
            row + place.along + place.across: u * v,
        }
        parts = [(self.row(i), fraction) for i, fraction in fractions.items() if fraction > 0.0]
        first = parts[0][0]
        if len(parts) == 1:
            return first
        # The spline is linear in its values, so the blend of slopes is the slope of the blend.
        return Diagram(
            first.angle,
            np.sum([fraction * part.pressure for part, fraction in parts], axis=0),
            np.sum([fraction * part.slope for part, fraction in parts], axis=0),
            first.period,
        )

    def peak(self, load: ArrayLike, speed: ArrayLike) -> Floats:
        """Return p_max [Pa] of the diagram at each load [percent] and speed [rad/s].

        Raises
        ------
        ValueError
            For a load or a speed outside the grid.
        """
        values, places = distinct_combinations(load, speed)
        self.locate(values[:, 0], values[:, 1])
        return np.asarray(np.array([self.at(float(a), float(b)).peak for a, b in values])[places])

    @cached_property
    def _speed_axis(self) -> TableAxis:
        """Axis of the table's rows over speed."""
        # Rows between two given speeds are at most 2 percent of the lower one apart.
        relative = np.diff(self.speeds) / (0.02 * self.speeds[:-1])
        steps: Integers = np.ceil(relative - 1e-9).astype(np.int64)
        return TableAxis(self.speeds, steps)


@dataclass(frozen=True, eq=False)
class FamilyAtSpeeds(Family):
    """Families over load at some speeds of a grid, their rows behind each other in one table.

    What blends two neighbouring rows then sees a family over load, at each of the speeds. Make it
    with `FamilyGrid.at_speeds`. `diagrams` are those given, at all speeds of the grid.
    """

    grid: FamilyGrid
    speeds: Floats

    @property
    def row_count(self) -> int:
        """Number of rows of the table."""
        return self._rows_of_speed * len(self.speeds)

    @property
    def _rows_of_speed(self) -> int:
        return self.grid.columns[0].row_count

    def place(self, load: ArrayLike, speed: ArrayLike) -> Floats:
        """Return the places in the table of loads [percent] at speeds [rad/s] out of `speeds`."""
        row, weight = self.locate(load)
        wanted = np.asarray(speed, dtype=np.float64)
        above = np.searchsorted(self.speeds, wanted).clip(0, len(self.speeds) - 1)
        below = np.maximum(above - 1, 0)
        nearer = np.abs(self.speeds[below] - wanted) < np.abs(self.speeds[above] - wanted)
        return np.asarray(row + weight + np.where(nearer, below, above) * self._rows_of_speed)

    def _make_row(self, index: int) -> Diagram:
        number, load_row = divmod(index, self._rows_of_speed)
        place = self.grid.locate(self.low, self.speeds[number])
        here = load_row * place.along + int(place.row)
        lower, fraction = self.grid.row(here), float(place.over_speed)
        if fraction == 0.0:
            return lower
        return blend(lower, self.grid.row(here + place.across), fraction)

    def each(self, change: Callable[[Diagram], Diagram]) -> FamilyAtSpeeds:
        """Family of the diagrams that `change` makes of the given ones."""
        return self.grid.each(change).at_speeds(self.speeds)


@dataclass(frozen=True, eq=False)
class FamilyStack(Family):
    """Families of one engine whose modelled cycles differ, their rows behind each other.

    All have the same loads and as many rows. Make it with `FamilyStack.of`.
    """

    members: tuple[Family, ...]

    @classmethod
    def of(cls, members: Sequence[Family]) -> FamilyStack:
        """Stack families of the same loads and speeds."""
        diagrams = tuple(diagram for member in members for diagram in member.diagrams)
        return cls(members[0].loads, diagrams, tuple(members))

    @property
    def row_count(self) -> int:
        """Number of rows of the table."""
        return self.members[0].row_count * len(self.members)

    def place(self, load: ArrayLike, speed: ArrayLike) -> Floats:
        """Places of loads and speeds in the table of one member, where they have speeds."""
        first = self.members[0]
        assert isinstance(first, FamilyAtSpeeds)
        return first.place(load, speed)

    def row_of(self, number: ArrayLike, place: ArrayLike) -> Floats:
        """Places in the table of the members `number`, by the places in their own tables."""
        before = np.asarray(number, dtype=np.float64) * self.members[0].row_count
        return np.asarray(before + np.asarray(place))

    def _make_row(self, index: int) -> Diagram:
        number, row = divmod(index, self.members[0].row_count)
        return self.members[number].row(row)

    def each(self, change: Callable[[Diagram], Diagram]) -> FamilyStack:
        """Stack of the families of the diagrams that `change` makes."""
        return FamilyStack.of([member.each(change) for member in self.members])


def grid_from_diagrams(entries: Sequence[tuple[float, float, Diagram]]) -> FamilyGrid:
    """Check diagrams over load and speed and make a grid of them.

    Parameters
    ----------
    entries : sequence of (load, speed, diagram)
        Load [percent], speed [rad/s] and diagram, in any order: every load at every speed once.

    Raises
    ------
    ValueError
        With one line that names the first of: no diagrams, loads that are negative or not finite,
        speeds that are not positive, a point given twice, a point that is missing, different
        periods, peaks of neighbours more than 60 degrees apart.
    """
    if not entries:
        raise ValueError("a grid needs at least one diagram")
    for load, speed, _ in entries:
        if not (math.isfinite(load) and load >= 0.0):
            raise ValueError(f"load {load:g} percent is not allowed: it must be 0 or more")
        if not (math.isfinite(speed) and speed > 0.0):
            raise ValueError(f"speed {speed / RPM:g} rpm is not allowed: it must be positive")
    loads = sorted({load for load, _, _ in entries})
    speeds = sorted({speed for _, speed, _ in entries})
    diagrams_at: dict[tuple[float, float], Diagram] = {}
    for load, speed, diagram in entries:
        if (load, speed) in diagrams_at:
            raise ValueError(f"two diagrams for {_point(load, speed)}: one is allowed")
        diagrams_at[load, speed] = diagram
    for load in loads:
        for speed in speeds:
            if (load, speed) not in diagrams_at:
                raise ValueError(
                    f"no diagram for {_point(load, speed)}: each of the {len(loads)} loads needs "
                    f"one at each of the {len(speeds)} speeds"
                )
    period = entries[0][2].period
    if any(diagram.period != period for _, _, diagram in entries):
        raise ValueError("diagrams of one grid must be all four-stroke or all two-stroke")
    common = on_common_knots([diagrams_at[load, speed] for speed in speeds for load in loads])
    columns = [common[i * len(loads) : (i + 1) * len(loads)] for i in range(len(speeds))]
    places = np.array([[diagram.peak_angle for diagram in column] for column in columns])
    for i, j in np.ndindex(places.shape):
        for k, m in ((i + 1, j), (i, j + 1)):
            if k == len(speeds) or m == len(loads):
                continue
            shift = abs(float(places[i, j] - places[k, m]))
            if shift > LARGEST_SHIFT:
                raise ValueError(
                    f"peaks of the diagrams for {_point(loads[j], speeds[i])} and "
                    f"{_point(loads[m], speeds[k])} are {shift / DEGREE:.6g} degrees apart, "
                    f"allowed are {LARGEST_SHIFT / DEGREE:g}"
                )
    values = np.array(loads, dtype=np.float64)
    return FamilyGrid(tuple(Family(values, column) for column in columns), np.array(speeds))


def _point(load: float, speed: float) -> str:
    return f"{load:g} percent at {speed / RPM:g} rpm"
