"""Families of one engine whose modelled cycles differ, their rows made in batches when needed.

A sweep over parameters of the cycle has as many families of diagrams as it has combinations of
them. Their rows follow each other in one table, as in `family_grid.FamilyStack`; but a row is made
when it is first asked for, many at once by kernels, and only those last used are kept. So memory
does not grow with the number of combinations, and no Python code runs once for each.

Only the diagrams between which a load and a speed lie are modelled. A row depends on its own
combination alone.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from engine_dyn.geometry.arrangement import TURN
from engine_dyn.geometry.firing_sequence import SEALED
from engine_dyn.periodic_spline import wrapped
from engine_dyn.pressure.curves import FLAT, Curves, morphed, on_threads, pressures_at, sampled
from engine_dyn.pressure.diagram import Diagram, in_compression, largest_of_rows, table_angles
from engine_dyn.pressure.family import ROW_STEP, Family, TableAxis
from engine_dyn.pressure.family_grid import FamilyAtSpeeds
from engine_dyn.pressure.first_law import tabulate
from engine_dyn.status import CONVERGED
from engine_dyn.types import Booleans, Floats, Integers

PLACES = 2.0**24
"""Fractions of rows are multiples of 1/PLACES: a row plus its fraction is then exact whatever
the combination's number is; loads are rounded to 2e-8 percent."""


class ModelledDiagram(NamedTuple):
    """A cycle by the first law, and the step [degree] at which it is tabulated."""

    cycle: Any
    step: float

    def __call__(self, **changes: float) -> Diagram:
        """Diagram of the cycle with other values (SI) of some fields; ValueError if it is none."""
        changed = replace(self.cycle, **changes) if changes else self.cycle
        return changed.diagram(self.step)


class _Kept:
    """The rows that were made last, by their numbers."""

    def __init__(self) -> None:
        self.numbers: Integers = np.zeros(0, dtype=np.int64)
        self.curves: Curves | None = None

    def take(self, numbers: Integers, make: Callable[[Integers], Curves]) -> Curves:
        """Rows of these numbers; those that are not kept are made, and kept."""
        wanted = np.unique(numbers)
        missing = wanted[~np.isin(wanted, self.numbers, assume_unique=True)]
        if missing.size:
            self._add(make(missing), missing, wanted)
        assert self.curves is not None
        return self.curves._replace(rows=self.curves.rows[np.searchsorted(self.numbers, numbers)])

    def _add(self, made: Curves, missing: Integers, wanted: Integers) -> None:
        """Keep new rows; drop older ones that belong to another block or exceed the memory."""
        old, still = self.curves, np.isin(self.numbers, wanted, assume_unique=True)
        if old is None or not still.any():
            self.numbers, self.curves = missing, made
            return
        # Old rows that this request does not want are dropped where all would exceed 50 MB.
        if old.pressure.nbytes + made.pressure.nbytes > 0.5 * 100e6:
            index = old.rows[still]
            self.numbers = self.numbers[still]
            old = Curves(
                old.pressure[index], old.slope[index], old.known[index], np.arange(index.size)
            )
        numbers = np.concatenate([self.numbers, missing])
        order = np.argsort(numbers)
        self.numbers = numbers[order]
        self.curves = Curves(
            np.concatenate([old.pressure, made.pressure]),
            np.concatenate([old.slope, made.slope]),
            np.concatenate([old.known, made.known]),
            np.concatenate([old.rows, old.pressure.shape[0] + made.rows])[order],
        )


class _State:
    """Cycles and curves that a table keeps from one request to the next."""

    def __init__(self) -> None:
        self.diagrams, self.rows = _Kept(), _Kept()
        self.threads = os.cpu_count() or 1


@dataclass(frozen=True, eq=False)
class CycleTable(Family):
    """Diagrams over load, and over speed where the engine has them so, of many modelled cycles.

    Attributes
    ----------
    loads, diagrams
        Those of the engine's own family, without changes.
    own : Family
        The engine's own family; a `FamilyAtSpeeds` where its diagrams depend on the speed too.
    cycles : tuple of ModelledDiagram
        For each of `diagrams`, in their order.
    changes : mapping of ndarray, shape (N,)
        Values (SI) of fields of the cycles, in place of theirs, for each combination.
    """

    own: Family
    cycles: tuple[ModelledDiagram, ...]
    changes: Mapping[str, Floats]
    _state: _State = field(default_factory=_State, init=False, repr=False)

    @classmethod
    def of(
        cls, own: Family, cycles: Sequence[ModelledDiagram], changes: Mapping[str, Floats]
    ) -> CycleTable:
        """Make the table of an engine's family and the combinations of a sweep."""
        return cls(own.loads, own.diagrams, own, tuple(cycles), changes)

    def __getstate__(self) -> dict[str, Any]:
        """Leave out what can be made again."""
        return {item.name: getattr(self, item.name) for item in fields(self) if item.init}

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Take the fields, with nothing kept."""
        self.__dict__.update(state, _rows={}, _state=_State())

    @property
    def combinations(self) -> int:
        """Number of combinations of parameters."""
        return int(next(iter(self.changes.values())).size)

    @property
    def resolution(self) -> float:
        """Difference of loads [percent] below which diagrams are the same: see `PLACES`."""
        return ROW_STEP / PLACES

    @property
    def row_count(self) -> int:
        """Number of rows of the table."""
        return self.own.row_count * self.combinations

    @property
    def angle(self) -> Floats:
        """Knots of all diagrams [rad]."""
        return table_angles(self.period, self._step)

    @cached_property
    def _step(self) -> float:
        steps = {cycle.step for cycle in self.cycles}
        # An engine that gives its diagrams different steps has 0.25 degree for all.
        return steps.pop() if len(steps) == 1 else 0.25

    def place(self, load: ArrayLike, speed: ArrayLike) -> Floats:
        """Places of loads and speeds in the table of one combination, where they have speeds."""
        assert isinstance(self.own, FamilyAtSpeeds)
        return self.own.place(load, speed)

    def row_of(self, number: ArrayLike, place: ArrayLike) -> Floats:
        """Places in the table of combinations, by the places in the table of each."""
        before = np.asarray(number, dtype=np.float64) * self.own.row_count
        return np.asarray(before + np.rint(np.asarray(place) * PLACES) / PLACES)

    def emptied(self) -> CycleTable:
        """The same table, of which no row is kept."""
        return CycleTable.of(self.own, self.cycles, self.changes)

    def use_threads(self, threads: int | None) -> None:
        """Make rows on as many threads at most from now on; one for each processor unless given."""
        self._state.threads = threads or os.cpu_count() or 1

    @property
    def threads(self) -> int:
        """Largest number of threads on which rows are made."""
        return self._state.threads

    # --- requests for pressures -------------------------------------------------------------------

    def curves(self, rows: Integers) -> Curves:
        """Rows of the table; those without a cycle are flat."""
        return self._state.rows.take(rows, self._make_rows)

    def known(self, place: ArrayLike) -> Booleans:
        """Whether there is a cycle at each place in the table."""
        wanted = np.asarray(place, dtype=np.float64)
        below, weight = _split(wanted.reshape(-1))
        curves = self.curves(np.concatenate([below, below + (weight > 0.0)]))
        both = curves.known[curves.rows].reshape(2, -1)
        return np.asarray((both[0] & both[1]).reshape(wanted.shape))

    def diagrams_known(self, number: ArrayLike) -> Booleans:
        """Whether each of the diagrams of combinations is a cycle; these are the last axis."""
        numbers = np.asarray(number, dtype=np.int64)
        each = np.arange(len(self.cycles))
        curves = self._diagrams((numbers.reshape(-1, 1) * each.size + each).reshape(-1))
        return np.asarray(curves.known[curves.rows].reshape(*numbers.shape, each.size))

    def refusal(self, number: int) -> str:
        """Why a combination is no cycle: the first diagram's words."""
        fields_of = {name: float(values[number]) for name, values in self.changes.items()}
        try:
            for cycle in self.cycles:
                cycle(**fields_of)
        except ValueError as error:
            return str(error)
        return "peaks of its diagrams lie too far apart"

    def sampled(
        self, rows: Integers, angle: Floats, factor: float = 1.0, *, slopes: bool = False
    ) -> tuple[Floats, Floats]:
        """Pressure [Pa] of rows at crank angles, and its slope if wanted; shape (rows, angles).

        `factor` is that of a cylinder: see `motored`.
        """
        if factor == SEALED:
            values, rises = self.motored.sampled(rows, in_compression(angle), slopes=slopes)
            return values, -np.sign(wrapped(angle, TURN)) * rises if slopes else rises
        values, rises = sampled(self.curves(rows), angle, self.period, self.threads, slopes)
        if factor != 1.0:
            base, rise = self.motored.sampled(rows, angle, slopes=slopes)
            values, rises = base + factor * (values - base), rise + factor * (rises - rise)
        return values, rises

    def pressures(self, phi: ArrayLike, place: ArrayLike, factor: float = 1.0) -> Floats:
        """Pressure [Pa] at crank angles of the diagrams at places in the table, broadcasting."""
        if factor == SEALED:
            return self.motored.pressures(in_compression(phi), place)
        wanted, phi = np.asarray(place, dtype=np.float64), np.asarray(phi, dtype=np.float64)
        values, number = np.unique(wanted, return_inverse=True)
        if phi.ndim and phi.size == phi.shape[-1] and (not wanted.ndim or wanted.shape[-1] == 1):
            curves_at = self._sampled_between(values, phi.reshape(-1), factor)
            shape = np.broadcast_shapes(phi.shape, wanted.shape)
            if not np.array_equal(number.reshape(-1), np.arange(values.size)):
                curves_at = curves_at[number.reshape(-1)]
            return curves_at.reshape(shape)
        below, weight = _split(values)
        above = below + (weight > 0.0)
        distinct = np.unique(np.concatenate([below, above]))
        curves = self.curves(distinct)
        first, second = (curves.rows[np.searchsorted(distinct, rows)] for rows in (below, above))
        angle, which = np.broadcast_arrays(phi, number.reshape(wanted.shape))
        pressure = np.empty(angle.shape)
        angles, designs = np.array(angle).reshape(-1), np.array(which).reshape(-1)
        flat = pressure.reshape(-1)

        def work(begin: int, end: int) -> None:
            here = slice(begin, end)
            pressures_at(
                curves.pressure, curves.slope, first, second, weight, designs[here], angles[here],
                self.period, flat[here],
            )  # fmt: skip

        on_threads(angles.size, work, self.threads, fewest=4096)
        if factor != 1.0:
            base = self.motored.pressures(phi, place)
            pressure = base + factor * (pressure - base)
        return pressure

    def _sampled_between(self, place: Floats, phi: Floats, factor: float) -> Floats:
        """Pressure at the same angles for all places, shape (places, angles)."""
        below, weight = _split(place)
        some = np.flatnonzero(weight)
        self.curves(np.concatenate([below, below[some] + 1]))  # all rows are made at once
        pressure = self.sampled(below, phi, factor)[0]
        if some.size:
            share = weight[some, None]
            above = self.sampled(below[some] + 1, phi, factor)[0]
            pressure[some] = (1.0 - share) * pressure[some] + share * above
        return pressure

    def peak_between(self, place: ArrayLike) -> Floats:
        """Return p_max [Pa] of the diagram at each place in the table, see `between`."""
        return self.peaks(place)

    def peaks(self, place: ArrayLike, factor: float = 1.0, *, between: bool = False) -> Floats:
        """Largest pressure [Pa] at each place, for a cylinder with a factor on it: see `motored`.

        With `between`, also of the curves between their knots.
        """
        wanted = np.asarray(place, dtype=np.float64)
        values, number = np.unique(wanted, return_inverse=True)
        peaks = np.empty(values.size)
        for begin in range(0, values.size, 512):
            here = slice(begin, begin + 512)
            below, weight = _split(values[here])
            pressure, slope = self.at_knots(below, factor)
            some = np.flatnonzero(weight)
            if some.size:
                share = weight[some, None]
                above, rise = self.at_knots(below[some] + 1, factor)
                pressure[some] = (1.0 - share) * pressure[some] + share * above
                slope[some] = (1.0 - share) * slope[some] + share * rise
            peaks[here] = pressure.max(axis=1)
            if between:
                step = np.diff(self.angle, append=self.angle[0] + self.period)
                peaks[here] = largest_of_rows(pressure, slope, step)
        return peaks[number.reshape(-1)].reshape(wanted.shape)

    def at_knots(self, rows: Integers, factor: float) -> tuple[Floats, Floats]:
        """Pressure [Pa] of rows at the knots, and its slope; `factor` as of `sampled`."""
        if factor == SEALED:
            return self.sampled(rows, self.angle, factor, slopes=True)
        curves = self.curves(rows)
        pressure, slope = curves.pressure[curves.rows], curves.slope[curves.rows]
        if factor != 1.0:
            base, rise = self.motored.at_knots(rows, 1.0)
            pressure, slope = base + factor * (pressure - base), rise + factor * (slope - rise)
        return pressure, slope

    @cached_property
    def motored(self) -> CycleTable:
        """The same cycles without heat."""
        without = tuple(
            cycle._replace(cycle=replace(cycle.cycle, heat=0.0)) for cycle in self.cycles
        )
        changes = dict(self.changes)
        if "heat" in changes:
            changes["heat"] = np.zeros(self.combinations)
        return CycleTable.of(self.own, without, changes)

    def row(self, index: int) -> Diagram:
        """Diagram of one row; for many, see `curves`."""
        if not 0 <= index < self.row_count:
            raise IndexError(f"row {index} is not in 0..{self.row_count - 1}")
        curves = self.curves(np.array([index]))
        place = int(curves.rows[0])
        return Diagram(self.angle, curves.pressure[place], curves.slope[place], self.period)

    def each(self, change: Callable[[Diagram], Diagram]) -> Family:
        """Not known of a table: its diagrams are made when they are asked for."""
        raise NotImplementedError

    # --- making of rows ---------------------------------------------------------------------------

    def _make_rows(self, rows: Integers) -> Curves:
        number, place = np.divmod(rows, self.own.row_count)
        if not isinstance(self.own, FamilyAtSpeeds):
            return self._over_load(number, np.zeros_like(number), place)
        speed, load_row = np.divmod(place, self.own.row_count // len(self.own.speeds))
        where = self.own.grid.locate(self.own.low, self.own.speeds[speed])
        lower = self._over_speed(number, where.row, load_row)
        some = np.flatnonzero(where.over_speed)
        if some.size:
            upper = self._over_speed(number[some], where.row[some] + where.across, load_row[some])
            share = where.over_speed[some, None]
            for mine, other in zip(lower[:2], upper[:2], strict=True):
                mine[some] = (1.0 - share) * mine[some] + share * other
            lower.known[some] &= upper.known
            lower.pressure[~lower.known], lower.slope[~lower.known] = FLAT, 0.0
        return lower

    def _over_load(self, number: Integers, column: Integers, row: Integers) -> Curves:
        """Rows over load at given speeds, whose numbers are in `column`."""
        segment, fraction = _between(self._axis, row)
        first = number * len(self.cycles) + column * len(self.loads) + segment
        return self._morphed(first, first + 1, fraction, self._diagrams)

    def _over_speed(self, number: Integers, speed_row: Integers, load_row: Integers) -> Curves:
        """Rows over load at given rows over speed."""
        assert isinstance(self.own, FamilyAtSpeeds)
        rows, columns = self._axis.count, len(self.own.grid.speeds)
        segment, fraction = _between(self.own.grid._speed_axis, speed_row)
        code = (number * columns + segment) * rows + load_row

        def make(codes: Integers) -> Curves:
            which, row = np.divmod(codes, rows)
            return self._over_load(*np.divmod(which, columns), row)

        return self._morphed(code, code + rows, fraction, make)

    def _morphed(
        self, first: Integers, second: Integers, fraction: Floats,
        make: Callable[[Integers], Curves],
    ) -> Curves:  # fmt: skip
        """Rows interpolated between two of those that `make` makes from numbers."""
        second = np.where(fraction > 0.0, second, first)
        wanted = np.unique(np.concatenate([first, second]))
        places = np.searchsorted(wanted, first), np.searchsorted(wanted, second)
        return morphed(make(wanted), *places, fraction, self.period, self.threads)

    def _diagrams(self, numbers: Integers) -> Curves:
        """Modelled diagrams by number: the combination's times their count, plus their place."""
        return self._state.diagrams.take(numbers, self._model)

    def _model(self, numbers: Integers) -> Curves:
        combination, which = np.divmod(numbers, len(self.cycles))
        shape = numbers.size, self.angle.size
        curves = Curves(
            np.full(shape, FLAT), np.zeros(shape), np.zeros(shape[0], dtype=np.bool_),
            np.arange(shape[0]),
        )  # fmt: skip
        for place in np.unique(which).tolist():
            here = np.flatnonzero(which == place)
            cycle = self.cycles[place].cycle
            values = {item.name: getattr(cycle, item.name) for item in fields(cycle)}
            values |= {name: v[combination[here]] for name, v in self.changes.items()}
            table = tabulate(type(cycle), values, self._step, self.threads)
            good = table.status == CONVERGED
            chosen = here[good]
            curves.pressure[chosen], curves.slope[chosen] = table.pressure[good], table.slope[good]
            curves.known[chosen] = True
        return curves


def _split(place: Floats) -> tuple[Integers, Floats]:
    """Row at or below each place, and the fraction of the way to the next row."""
    below = np.floor(place)
    return below.astype(np.int64), place - below


def _between(axis: TableAxis, row: Integers) -> tuple[Integers, Floats]:
    """Index of the given value at or below each row, and the fraction of the way to the next."""
    segment = np.searchsorted(axis.first, row, side="right") - 1
    return segment, np.asarray((row - axis.first[segment]) / np.append(axis.steps, 1)[segment])
