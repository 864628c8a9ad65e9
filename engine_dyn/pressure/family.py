"""Families of indicator diagrams over load, and the table of rows in which they are kept.

A family holds the diagrams of several loads and gives the diagram of any load between the
outermost ones. Angles are in radians from firing top dead centre, pressures in pascal, absolute.
Arrays that follow from a family are kept for whoever asks for the same next.
"""

from __future__ import annotations

import math
import os
import threading
from collections.abc import Callable, Hashable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, TypeVar, cast
from weakref import WeakKeyDictionary

import numpy as np
import numpy.typing as npt
from numpy.typing import ArrayLike

from engine_dyn.given_numbers import given_array
from engine_dyn.periodic_spline import periodic_spline_slopes
from engine_dyn.pressure.diagram import Diagram, largest_of_blends
from engine_dyn.pressure.point_checks import PEAK_TO, degrees
from engine_dyn.types import Floats, Integers
from engine_dyn.units import DEGREE

# Step between rows [percent of load]; angles before and after the peak of the pressure over which
# it is warped, each at least WARP_PER_SHIFT times the shift of the peak; largest such shift.
ROW_STEP = 0.5
WARP_BEFORE = 40.0 * DEGREE
WARP_AFTER = 80.0 * DEGREE
WARP_PER_SHIFT = 2.5
LARGEST_SHIFT = 60.0 * DEGREE

ROWS_AT_ONCE = 256
"""Number of rows whose largest pressures are searched together, so that memory stays in bounds."""


@dataclass(frozen=True, eq=False)
class TableAxis:
    """Rows of a table over one parameter: the given values, and equal steps between each two."""

    given: Floats  # Given values of the axis, strictly ascending; each of them is a row; shape (K,)
    steps: Integers  # Number of steps between neighbouring given values; shape (K - 1,)

    @cached_property
    def first(self) -> Integers:
        """Row of each given value."""
        return np.concatenate(([0], np.cumsum(self.steps))).astype(np.int64)

    @property
    def count(self) -> int:
        """Number of rows."""
        return int(self.first[-1]) + 1

    @property
    def values(self) -> Floats:
        """Value of every row, ascending."""
        pieces = [
            np.linspace(self.given[i], self.given[i + 1], count, endpoint=False)
            for i, count in enumerate(self.steps)
        ]
        return np.concatenate([*pieces, self.given[-1:]])

    @cached_property
    def _widths(self) -> tuple[Floats, Integers]:
        """Distance from each given value to the next, and steps; the last value stands alone."""
        return np.diff(self.given, append=self.given[-1] + 1.0), np.append(self.steps, 1)

    def locate(self, wanted: Floats) -> tuple[Integers, Floats]:
        """Row at or below each value within the axis, and the fraction of the step to the next."""
        segment = np.searchsorted(self.given, wanted, side="right") - 1
        width, steps = self._widths
        place = (wanted - self.given[segment]) / width[segment] * steps[segment]
        # A value that misses a row by rounding counts as the row.
        nearest = np.rint(place)
        place = np.where(np.abs(place - nearest) <= 1e-9, nearest, place)
        whole = np.floor(place)
        row = (self.first[segment] + whole).astype(np.int64)
        return row, np.asarray(place - whole, dtype=np.float64)

    def between(self, row: int) -> tuple[int, float]:
        """Number of the given value at or below a row, and the fraction of the way to the next."""
        segment = int(np.searchsorted(self.first, row, side="right")) - 1
        inside = row - int(self.first[segment])
        return segment, inside / int(self.steps[segment]) if inside else 0.0


class RowsOfDiagrams:
    """A table of diagrams, whose rows are made when they are first asked for."""

    _rows: dict[int, Diagram]

    @property
    def period(self) -> float:
        """Angle of the cycle [rad]."""
        raise NotImplementedError

    @property
    def row_count(self) -> int:
        """Number of rows of the table."""
        raise NotImplementedError

    def row(self, index: int) -> Diagram:
        """Diagram of one row of the table, made when first asked for.

        Raises
        ------
        IndexError
            For a row outside 0..row_count - 1.
        """
        if not 0 <= index < self.row_count:
            raise IndexError(f"row {index} is not in 0..{self.row_count - 1}")
        known = self._rows.get(index)
        if known is None:
            known = self._rows[index] = self._make_row(index)
        return known

    def _make_row(self, index: int) -> Diagram:
        raise NotImplementedError


@dataclass(frozen=True, eq=False)
class Family(RowsOfDiagrams):
    """Indicator diagrams of one engine over load, and every load between the outermost.

    A blend of two diagrams whose peaks lie at different angles would have two humps. So the angle
    of each is first warped smoothly until the peaks lie at the interpolated angle (the warp is the
    identity away from the combustion), and the logarithms of the pressures are blended: the peak
    is then the weighted geometric mean of the two. Because the warp is dear, the family is defined
    as a table: rows at steps of at most 0.5 percent load, the given loads being rows exactly and
    reproducing the given diagrams, and the diagram of any other load the linear blend of its two
    neighbouring rows. Rows are made when first asked for; each depends on its two given diagrams
    alone, so results do not depend on which other loads are asked for.

    Make it with `family_from_diagrams`, which brings the diagrams to common knots.

    Attributes
    ----------
    loads : ndarray, shape (L,)
        Loads [percent], strictly ascending.
    diagrams : tuple of Diagram
        One for each load, all with the same knots and period.
    of_cylinders : mapping
        Families of single cylinders, by their numbers from 1, with the same loads and period.

    Examples
    --------
    >>> import engine_dyn
    >>> import numpy as np
    >>> degrees = [-360, -300, -240, -180, -135, -90, -60, -45, -30, -15, 0, 10, 20, 30, 45, 60]
    >>> bar = [1.0, 1.0, 1.0, 1.0, 1.2, 2.2, 4.3, 7.1, 14, 28, 48, 56, 46, 32, 18, 11]
    >>> degrees += [75, 90, 120, 150, 180, 240, 300]
    >>> bar += [7.5, 5.5, 3.6, 2.3, 1.2, 1.0, 1.0]
    >>> diagram = engine_dyn.diagram_from_points(np.radians(degrees), 1e5 * np.array(bar))
    >>> light = engine_dyn.diagram_from_points(np.radians(degrees), 0.8e5 * np.array(bar))
    >>> family = engine_dyn.family_from_diagrams([50, 100], [light, diagram])
    >>> len(family.diagrams)
    2
    """

    loads: Floats
    diagrams: tuple[Diagram, ...]
    of_cylinders: Mapping[int, Family] = field(default_factory=dict, kw_only=True)
    _rows: dict[int, Diagram] = field(default_factory=dict, init=False, repr=False)

    @property
    def period(self) -> float:
        """Angle of the cycle [rad]."""
        return self.diagrams[0].period

    @property
    def low(self) -> float:
        """Lowest load [percent]."""
        return float(self.loads[0])

    @property
    def high(self) -> float:
        """Highest load [percent]."""
        return float(self.loads[-1])

    @property
    def resolution(self) -> float:
        """Difference of loads [percent] below which diagrams are the same; 0: only rounding."""
        return 0.0

    @property
    def row_count(self) -> int:
        """Number of rows of the table."""
        return self._axis.count

    @property
    def row_loads(self) -> Floats:
        """Load [percent] of every row, ascending."""
        return self._axis.values

    def locate(self, load: ArrayLike) -> tuple[Integers, Floats]:
        """Where loads lie in the table.

        Parameters
        ----------
        load : array_like
            Loads [percent], any shape.

        Returns
        -------
        row : ndarray of int64, shape of `load`
            Row at or below the load.
        weight : ndarray, shape of `load`
            Fraction of the next row, 0 <= weight < 1. It is exactly 0 on a row (the last included),
            where the next row is not needed and need not exist.

        Raises
        ------
        ValueError
            For a load outside the family.
        """
        wanted = np.asarray(load, dtype=np.float64)
        bad = ~((wanted >= self.low) & (wanted <= self.high))
        if bad.any():
            value = float(wanted[bad].flat[0])
            if len(self.loads) == 1:
                allowed = f"the engine has one diagram, for {self.low:g} percent"
            else:
                allowed = f"the engine's diagrams cover {self.low:g}..{self.high:g} percent"
            raise ValueError(f"load {value:g} percent is not allowed: {allowed}")
        return self._axis.locate(wanted)

    def _make_row(self, index: int) -> Diagram:
        segment, fraction = self._axis.between(index)
        here = self.diagrams[segment]
        return here if fraction == 0.0 else morph(here, self.diagrams[segment + 1], fraction)

    def at(self, load: float) -> Diagram:
        """Diagram at one load [percent]: the linear blend of its two neighbouring rows.

        Raises
        ------
        ValueError
            For a load outside the family.
        """
        row, weight = self.locate(load)
        return self.between(float(row + weight))

    def between(self, place: float) -> Diagram:
        """Diagram at a place in the table: a row, or so much of the way from it to the next."""
        below = math.floor(place)
        lower, fraction = self.row(below), place - below
        return lower if fraction == 0.0 else blend(lower, self.row(below + 1), fraction)

    def peak(self, load: ArrayLike) -> Floats:
        """Return p_max [Pa] of the diagram at each load [percent], as `at(load).peak` gives it.

        Raises
        ------
        ValueError
            For a load outside the family.
        """
        row, weight = self.locate(load)
        return self.peak_between(row + weight)

    def peak_between(self, place: ArrayLike) -> Floats:
        """Return p_max [Pa] of the diagram at each place in the table, see `between`."""
        return peaks_between(place, lambda row: self.row(row).pressure)

    def each(self, change: Callable[[Diagram], Diagram]) -> Family:
        """Family of the diagrams that `change` makes of the given ones."""
        return family_from_diagrams(self.loads.tolist(), [change(d) for d in self.diagrams])

    @cached_property
    def _axis(self) -> TableAxis:
        """Axis of the table's rows over load."""
        steps: Integers = np.ceil(np.diff(self.loads) / ROW_STEP - 1e-9).astype(np.int64)
        return TableAxis(self.loads, steps)


def own_diagrams(family: Family, number: int) -> Family:
    """Diagrams of a cylinder, by `Member.diagram`: its own, or those of the engine for 0."""
    return family.of_cylinders[number] if number else family


def flat_family(period: float) -> Family:
    """Family of one diagram without any pressure: of an engine whose torque is given instead.

    `period` is that of the torque [rad].
    """
    angle = period * (np.arange(8) / 8.0 - 0.5)
    nothing = np.zeros(8)
    return Family(np.zeros(1), (Diagram(angle, nothing, nothing, period),))


def family_from_diagrams(loads: Sequence[float], diagrams: Sequence[Diagram]) -> Family:
    """Check loads and diagrams and make a family of them.

    Diagrams with the same knots are kept as they are; others are resampled from their splines to a
    common uniform grid of 0.25 degree.

    Parameters
    ----------
    loads : sequence of float, length L >= 1
        Loads [percent], strictly ascending, 0 or more.
    diagrams : sequence of Diagram, length L
        The diagram of each load, all of the same period.

    Raises
    ------
    ValueError
        For unequal lengths, loads that do not ascend, are negative or not finite, different
        periods, or peaks of neighbouring loads more than 60 degrees apart.

    Examples
    --------
    >>> import engine_dyn
    >>> import numpy as np
    >>> degrees = [-360, -300, -240, -180, -135, -90, -60, -45, -30, -15, 0, 10, 20, 30, 45, 60]
    >>> bar = [1.0, 1.0, 1.0, 1.0, 1.2, 2.2, 4.3, 7.1, 14, 28, 48, 56, 46, 32, 18, 11]
    >>> degrees += [75, 90, 120, 150, 180, 240, 300]
    >>> bar += [7.5, 5.5, 3.6, 2.3, 1.2, 1.0, 1.0]
    >>> diagram = engine_dyn.diagram_from_points(np.radians(degrees), 1e5 * np.array(bar))
    >>> light = engine_dyn.diagram_from_points(np.radians(degrees), 0.8e5 * np.array(bar))
    >>> family = engine_dyn.family_from_diagrams([50, 100], [light, diagram])
    >>> family.loads
    array([ 50., 100.])
    """
    values = given_array("loads", loads).copy()
    if values.ndim != 1 or len(values) == 0 or len(values) != len(diagrams):
        raise ValueError(
            f"{values.size} loads for {len(diagrams)} diagrams: one for each is needed"
        )
    if not np.isfinite(values).all() or values[0] < 0.0 or (np.diff(values) <= 0.0).any():
        raise ValueError(
            f"loads {values.tolist()} percent: they must ascend strictly from 0 or more"
        )
    first = diagrams[0]
    if any(d.period != first.period for d in diagrams):
        raise ValueError("diagrams of one family must be all four-stroke or all two-stroke")
    shift = np.abs(np.diff([d.peak_angle for d in diagrams]))
    if (shift > LARGEST_SHIFT).any():
        i = int(np.argmax(shift))
        raise ValueError(
            f"peaks of the diagrams at {values[i]:g} and {values[i + 1]:g} percent load are "
            f"{degrees(shift[i])} degrees apart, allowed are {degrees(LARGEST_SHIFT)}"
        )
    return Family(values, on_common_knots(diagrams))


def on_common_knots(diagrams: Sequence[Diagram]) -> tuple[Diagram, ...]:
    """Bring diagrams of one period to the same knots, as `family_from_diagrams` says."""
    first = diagrams[0]
    if all(np.array_equal(d.angle, first.angle) for d in diagrams):
        return tuple(diagrams)
    count = round(first.period / (0.25 * DEGREE))
    phi: Floats = np.arange(-(count // 2), count - count // 2, dtype=np.float64)
    phi *= first.period / count
    common = [(d(phi), d.period, d.motored) for d in diagrams]
    return tuple(Diagram(phi, p, periodic_spline_slopes(phi, p, t), t, m) for p, t, m in common)


def blend(lower: Diagram, upper: Diagram, fraction: float) -> Diagram:
    """Make the linear blend of two diagrams with the same knots, with `fraction` of the second."""
    # The spline is linear in its values, so the blend of slopes is the slope of the blend.
    return Diagram(
        lower.angle,
        (1.0 - fraction) * lower.pressure + fraction * upper.pressure,
        (1.0 - fraction) * lower.slope + fraction * upper.slope,
        lower.period,
    )


def peaks_between(place: ArrayLike, pressure_of: Callable[[int], Floats]) -> Floats:
    """Return the largest tabulated pressure at each place in a table of rows.

    The largest value of a blend of two rows is at one of few knots: at no knot that another one
    exceeds, or equals, in both rows. Rounding does not change this, so the result has the bits of
    the largest value of all knots.

    Parameters
    ----------
    place : array_like
        A row, or a part of the way from it to the next, as of `Family.between`.
    pressure_of : callable
        Pressures of a row, at the knots that all rows have in common. It is called once for each
        row.

    Returns
    -------
    ndarray
        Shape of `place`, unit of the rows.
    """
    wanted = np.asarray(place, dtype=np.float64)
    flat = wanted.reshape(-1)
    below = np.floor(flat)
    fraction = flat - below
    lower = below.astype(np.int64)
    if flat.size == 1:  # for one place, this takes a tenth of the time of the table below
        curve = pressure_of(int(lower[0]))
        if fraction[0] > 0.0:
            curve = (1.0 - fraction[0]) * curve + fraction[0] * pressure_of(int(lower[0]) + 1)
        return np.full(wanted.shape, curve.max())
    # There are few rows and many designs: rows are marked instead of sorted.
    starts, blended = (np.zeros(int(lower.max()) + 1, dtype=np.bool_) for _ in range(2))
    starts[lower] = True
    blended[lower[fraction > 0.0]] = True
    rows = np.flatnonzero(starts)
    table = np.zeros(starts.size, dtype=np.int64)
    table[rows] = np.arange(rows.size)
    parts = [
        _top_knots(rows[first : first + ROWS_AT_ONCE], blended, pressure_of)
        for first in range(0, rows.size, ROWS_AT_ONCE)
    ]
    most = max(part.shape[2] for part in parts)
    low, high = np.concatenate([_filled(part, most) for part in parts], axis=1)
    here, rest = table[lower], 1.0 - fraction
    peaks: Floats = rest * low[here, 0] + fraction * high[here, 0]
    for knot in range(1, most):
        np.maximum(peaks, rest * low[here, knot] + fraction * high[here, knot], out=peaks)
    return peaks.reshape(wanted.shape)


def largest_between(place: ArrayLike, diagram_of: Callable[[int], Diagram]) -> Floats:
    """Return the largest pressure at each place in a table of rows, between their knots too.

    A place is a row plus the fraction of the way to the next; `diagram_of` gives the diagram of a
    row, and all rows have their knots in common.
    """
    wanted = np.asarray(place, dtype=np.float64)
    flat = wanted.reshape(-1)
    below = np.floor(flat)
    fraction = flat - below
    peaks = np.empty(flat.size)
    order = np.argsort(below, kind="stable")
    for here in np.split(order, np.flatnonzero(np.diff(below[order])) + 1):
        if here.size:
            row, shares = int(below[here[0]]), fraction[here]
            first = diagram_of(row)
            second = diagram_of(row + 1) if shares.any() else first
            peaks[here] = largest_of_blends(first, second, shares)
    return peaks.reshape(wanted.shape)


def _filled(parts: Floats, count: int) -> Floats:
    """Array whose last axis is padded with its first values, which changes no maximum."""
    return np.concatenate(
        [parts, np.repeat(parts[:, :, :1], count - parts.shape[2], axis=2)], axis=2
    )


def _top_knots(
    rows: Integers, blended: npt.NDArray[np.bool_], pressure_of: Callable[[int], Floats]
) -> Floats:
    """Pressures of rows and their successors, at the knots that may be a blend's maximum.

    Shape (2, rows, knots). A row that is not marked in `blended` is its own successor.
    """
    known: dict[int, Floats] = {}
    for row in rows.tolist():
        known.setdefault(row, pressure_of(row))
        if blended[row]:
            known[row + 1] = pressure_of(row + 1)
    here = np.stack([known[row] for row in rows.tolist()])
    after = np.stack([known[row + 1 if blended[row] else row] for row in rows.tolist()])
    each = np.arange(rows.size)
    first = np.where(here == here.max(axis=1, keepdims=True), after, -np.inf).argmax(axis=1)
    last = np.where(after == after.max(axis=1, keepdims=True), here, -np.inf).argmax(axis=1)
    between = (here > here[each, last, None]) & (after > after[each, first, None])
    of_row, knot = np.nonzero(between)
    count = np.bincount(of_row, minlength=rows.size)
    knots = np.repeat(first[:, None], 2 + int(count.max()), axis=1)
    knots[:, 1] = last
    knots[of_row, 2 + np.arange(of_row.size) - (np.cumsum(count) - count)[of_row]] = knot
    return np.stack([np.take_along_axis(curve, knots, axis=1) for curve in (here, after)])


def morph(start: Diagram, end: Diagram, fraction: float) -> Diagram:
    """Make the diagram at a fraction (0..1) of the way between two with the same knots."""
    from_angle, to_angle = start.peak_angle, end.peak_angle
    peak = from_angle + fraction * (to_angle - from_angle)
    shift = abs(to_angle - from_angle)
    room = start.period / 2.0 - PEAK_TO
    before = min(max(WARP_BEFORE, WARP_PER_SHIFT * shift), room)
    after = min(max(WARP_AFTER, WARP_PER_SHIFT * shift), room)
    distance = start.angle - peak
    # The bump (1 - u^2)^3 is smooth, 1 at the peak and 0 with two derivatives at its ends; its
    # slope stays under 1.72 / reach, so the warp is monotone for shifts up to 0.58 of the reach.
    bump = np.maximum(1.0 - (distance / np.where(distance < 0.0, before, after)) ** 2, 0.0) ** 3
    low = start(start.angle + (from_angle - peak) * bump)
    high = end(start.angle + (to_angle - peak) * bump)
    pressure = np.exp((1.0 - fraction) * np.log(low) + fraction * np.log(high))
    slope = periodic_spline_slopes(start.angle, pressure, start.period)
    return Diagram(start.angle, pressure, slope, start.period)


Arrays = TypeVar("Arrays", bound=tuple[npt.NDArray[Any], ...])

_kept: WeakKeyDictionary[Family, dict[Hashable, tuple[npt.NDArray[Any], ...]]] = WeakKeyDictionary()
_making: dict[tuple[int, Hashable], threading.Lock] = {}
_lock = threading.Lock()


def _renew() -> None:
    """Make new locks after a fork: a thread that no longer exists may have held the old ones."""
    global _lock
    _lock = threading.Lock()
    _making.clear()


if hasattr(os, "register_at_fork"):  # Windows has no fork
    os.register_at_fork(after_in_child=_renew)


def remembered(family: Family, key: Hashable, make: Callable[[], Arrays]) -> Arrays:
    """Return the arrays of this key, or those that `make` gives. They must not be changed."""
    mine = id(family), key
    with _lock:
        making = _making.setdefault(mine, threading.Lock())
    try:
        with making:  # threads that need the same table wait for the one that makes it
            with _lock:
                known = _kept.get(family, {}).get(key)
            if known is not None:
                return cast("Arrays", known)
            made = make()
            with _lock:
                kept = _kept.setdefault(family, {})
                kept[key] = made
                # The oldest arrays are dropped. There is room for all groups of a sweep, because a
                # search for an inertia solves each group many times.
                while kept and (len(kept) > 64 or _bytes_of(kept) > 160_000_000):
                    kept.pop(next(iter(kept)))
            return made
    finally:
        with _lock:
            _making.pop(mine, None)


def _bytes_of(kept: dict[Hashable, tuple[npt.NDArray[Any], ...]]) -> int:
    return sum(array.nbytes for arrays in kept.values() for array in arrays)
