"""Indicator diagrams: cylinder pressure over crank angle, and families of them over load.

A diagram is a periodic cubic spline through tabulated absolute pressures. It is the least that
keeps the torque smooth: linear interpolation of a diagram at 1 degree would limit every later
quadrature to second order. A family holds diagrams of several loads and gives the diagram of any
load between the outermost ones.

Angles are in radians from firing top dead centre, pressures in pascal, absolute. Messages speak in
degrees and bar, because people read them.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from engine_dyn.types import Floats, Integers
from engine_dyn.units import BAR, DEGREE

__all__ = [
    "FOUR_STROKE",
    "TWO_STROKE",
    "Diagram",
    "Family",
    "blend",
    "diagram_from_points",
    "family_from_diagrams",
    "morph",
    "on_common_knots",
    "periodic_spline_slopes",
]


FOUR_STROKE = 4.0 * math.pi
TWO_STROKE = 2.0 * math.pi


# What a diagram must look like to be taken for one. Measured files are sparse in the gas
# exchange, so the gap allowed there is wide; where the pressure is made it is narrow.
MINIMUM_POINTS = 16
LARGEST_GAP = 60.0 * DEGREE
LARGEST_GAP_NEAR_FIRING = 15.0 * DEGREE
NEAR_FIRING = 60.0 * DEGREE
PEAK_FROM, PEAK_TO = -30.0 * DEGREE, 60.0 * DEGREE
ENDS_TOLERANCE = 0.02
LARGEST_PRESSURE = 500.0 * BAR

# Family table: the step between rows, and the reach of the warp on both sides of the peak.
ROW_STEP = 0.5
WARP_BEFORE = 40.0 * DEGREE
WARP_AFTER = 80.0 * DEGREE
WARP_PER_SHIFT = 2.5
LARGEST_SHIFT = 60.0 * DEGREE
COMMON_STEP = 0.25 * DEGREE


def periodic_spline_slopes(angle: Floats, pressure: Floats, period: float) -> Floats:
    """Slopes at the knots of the periodic cubic spline through given points.

    Continuity of the second derivative at knot i, with h_i the step after it and d_i the divided
    difference over that step, reads

        h_i s_(i-1) + 2 (h_(i-1) + h_i) s_i + h_(i-1) s_(i+1) = 3 (h_i d_(i-1) + h_(i-1) d_i),

    a cyclic tridiagonal system (de Boor, A Practical Guide to Splines, Springer 2001, ch. IV),
    solved by elimination with the corner entries taken out as a rank-one change (Sherman and
    Morrison 1950). It is diagonally dominant, so no pivoting is needed.

    Parameters
    ----------
    angle : ndarray, shape (K,)
        Strictly ascending knots [rad] within one period, its end not repeated. K >= 3.
    pressure : ndarray, shape (K,)
        Values at the knots, any unit.
    period : float
        Period [rad].

    Returns
    -------
    ndarray, shape (K,)
        Slope at each knot, unit of `pressure` per radian.
    """
    count = len(angle)
    step = np.diff(angle, append=angle[0] + period)
    divided = np.diff(pressure, append=pressure[0]) / step
    before = np.roll(step, 1)
    lower = step
    upper = before
    diagonal = 2.0 * (before + step)
    right = 3.0 * (step * np.roll(divided, 1) + before * divided)

    # A = T + u w^T with u = (gamma, 0, .., 0, upper_last), w = (1, 0, .., 0, lower_first / gamma).
    gamma = -diagonal[0]
    diagonal = diagonal.copy()
    diagonal[0] -= gamma
    diagonal[-1] -= upper[-1] * lower[0] / gamma
    low, dia, upp = lower.tolist(), diagonal.tolist(), upper.tolist()
    first = right.tolist()
    second = [0.0] * count
    second[0] = float(gamma)
    second[-1] = upp[-1]
    for i in range(1, count):
        factor = low[i] / dia[i - 1]
        dia[i] -= factor * upp[i - 1]
        first[i] -= factor * first[i - 1]
        second[i] -= factor * second[i - 1]
    first[-1] /= dia[-1]
    second[-1] /= dia[-1]
    for i in range(count - 2, -1, -1):
        first[i] = (first[i] - upp[i] * first[i + 1]) / dia[i]
        second[i] = (second[i] - upp[i] * second[i + 1]) / dia[i]
    corner = float(lower[0] / gamma)
    share = (first[0] + corner * first[-1]) / (1.0 + second[0] + corner * second[-1])
    return np.asarray(first) - share * np.asarray(second)


@dataclass(frozen=True, eq=False)
class Diagram:
    """Cylinder pressure over one cycle, as a periodic cubic spline through tabulated points.

    Make it with `diagram_from_points`, which checks the points and finds the slopes.

    Attributes
    ----------
    angle : ndarray, shape (K,)
        Knots [rad], strictly ascending from >= -period/2 to < period/2 (no repeated end);
        0 is firing top dead centre.
    pressure : ndarray, shape (K,)
        Absolute pressure at the knots [Pa].
    slope : ndarray, shape (K,)
        dp/dphi of the spline at the knots [Pa/rad]. Between knots the spline is the cubic Hermite
        polynomial of the two values and slopes.
    period : float
        4 pi (four-stroke) or 2 pi (two-stroke).
    motored : callable, optional
        Makes the diagram without combustion, where that is known: see `pressure.motored`.
    """

    angle: Floats
    pressure: Floats
    slope: Floats
    period: float = FOUR_STROKE
    motored: Callable[[], Diagram] | None = field(default=None, repr=False)

    def __call__(self, phi: ArrayLike) -> Floats:
        """Pressure [Pa] at any crank angle [rad], scalar or array; the angle wraps."""
        p0, p1, s0, s1, step, t = self._pieces(phi)
        rest = 1.0 - t
        # Hermite's basis is 1, 0, 0, 0 at a knot, so tabulated pressures come back exactly.
        result: Floats = (
            p0 * (rest * rest * (1.0 + 2.0 * t))
            + p1 * (t * t * (3.0 - 2.0 * t))
            + step * (s0 * (t * rest * rest) - s1 * (t * t * rest))
        )
        return result

    def derivative(self, phi: ArrayLike) -> Floats:
        """dp/dphi [Pa/rad] of the spline at any crank angle [rad]; the angle wraps."""
        p0, p1, s0, s1, step, t = self._pieces(phi)
        rest = 1.0 - t
        result: Floats = (
            6.0 * t * rest * (p1 - p0) / step
            + s0 * (rest * (1.0 - 3.0 * t))
            + s1 * (t * (3.0 * t - 2.0))
        )
        return result

    @property
    def peak(self) -> float:
        """Largest tabulated pressure [Pa] (the p_max of Kakaitsas 2015, eq. 3.9)."""
        return float(self.pressure.max())

    @property
    def peak_angle(self) -> float:
        """Angle [rad] where the spline is largest beside the largest tabulated pressure."""
        top = int(np.argmax(self.pressure))
        count = len(self.angle)
        # The spline rises before the summit and falls after it: take the interval that holds it.
        left = top if self.slope[top] >= 0.0 else (top - 1) % count
        right = (left + 1) % count
        step = (self.angle[right] - self.angle[left]) % self.period
        t = _stationary(
            np.array([self.pressure[left]]),
            np.array([self.pressure[right]]),
            np.array([self.slope[left]]),
            np.array([self.slope[right]]),
            np.array([step]),
        )
        best, value = float(self.angle[top]), self.peak
        for place in t[np.isfinite(t)]:
            where = float(_wrap(self.angle[left] + place * step, self.period))
            here = float(self(where))
            if here > value:
                best, value = where, here
        return best

    @property
    def lowest(self) -> float:
        """Smallest pressure [Pa] of the spline, between the knots included."""
        p0, p1 = self.pressure, np.roll(self.pressure, -1)
        s0, s1 = self.slope, np.roll(self.slope, -1)
        step = np.diff(self.angle, append=self.angle[0] + self.period)
        t = _stationary(p0, p1, s0, s1, step)
        inside = np.isfinite(t)
        phi = (self.angle[:, None] + t * step[:, None])[inside]
        low = float(self.pressure.min())
        return min(low, float(self(phi).min())) if phi.size else low

    def scaled(self, factor: float) -> Diagram:
        """Return the diagram with every pressure multiplied by `factor` (> 0).

        Raises
        ------
        ValueError
            If the factor is not positive and finite.
        """
        if not (math.isfinite(factor) and factor > 0.0):
            raise ValueError(f"pressure scale {factor:g} is not allowed: it must be positive")
        without = self.motored
        motored = None if without is None else lambda: without().scaled(factor)
        return Diagram(
            self.angle, self.pressure * factor, self.slope * factor, self.period, motored
        )

    def _pieces(self, phi: ArrayLike) -> tuple[Floats, ...]:
        """Find values, slopes, step and local coordinate of the interval of each angle."""
        wrapped = _wrap(np.asarray(phi, dtype=np.float64), self.period)
        count = len(self.angle)
        left = np.searchsorted(self.angle, wrapped, side="right") - 1
        # Before the first knot lies the interval that wraps; index -1 is its left knot.
        right = (left + 1) % count
        start = self.angle[left] - np.where(left < 0, self.period, 0.0)
        step = self.angle[right] - start + np.where((right == 0) & (left >= 0), self.period, 0.0)
        t = (wrapped - start) / step
        return (
            self.pressure[left],
            self.pressure[right],
            self.slope[left],
            self.slope[right],
            step,
            t,
        )


def diagram_from_points(
    angle: ArrayLike, pressure: ArrayLike, period: float = FOUR_STROKE
) -> Diagram:
    """Check the points of an indicator diagram and join them by a periodic cubic spline.

    Any sampling will do, as long as it covers the cycle. Where both ends of the cycle are given
    (they are the same angle), their mean is taken.

    Parameters
    ----------
    angle : array_like, shape (K,)
        Crank angle [rad], strictly ascending within -period/2..period/2, 0 at firing top dead
        centre.
    pressure : array_like, shape (K,)
        Absolute cylinder pressure [Pa].
    period : float
        4 pi (four-stroke, the default) or 2 pi (two-stroke).

    Returns
    -------
    Diagram

    Raises
    ------
    ValueError
        With one line that names the place, the value and what is allowed: other lengths, too few
        points, values that are not finite, angles that do not ascend or lie outside the cycle,
        gaps over 60 degrees (15 degrees within 60 degrees of the firing dead centre), pressure
        that is not positive (also between the points) or above 500 bar, ends that differ by more
        than 2 % of p_max, a peak outside -30..60 degrees, pressure that does not rise through
        the compression.
    """
    if not (math.isclose(period, FOUR_STROKE) or math.isclose(period, TWO_STROKE)):
        raise ValueError(f"period {_deg(period)} degrees is not allowed: it must be 720 or 360")
    phi = np.array(angle, dtype=np.float64)
    p = np.array(pressure, dtype=np.float64)
    if phi.ndim != 1 or p.ndim != 1 or len(phi) != len(p):
        raise ValueError(
            f"crank angles of shape {phi.shape} and pressures of shape {p.shape}: "
            "both must be lists of the same length"
        )
    if len(phi) < MINIMUM_POINTS:
        raise ValueError(f"{len(phi)} points are too few: at least {MINIMUM_POINTS} are needed")
    _check_values(phi, p, period)
    phi, p = _join_ends(phi, p, period)
    _check_coverage(phi, period)
    _check_phase(phi, p, period)
    diagram = Diagram(phi, p, periodic_spline_slopes(phi, p, period), period)
    lowest = diagram.lowest
    if lowest <= 0.0:
        raise ValueError(
            f"the smooth curve through the points falls to {lowest / BAR:.3g} bar between them: "
            "the points are too far apart or scatter too much where the pressure is low"
        )
    return diagram


def _check_values(phi: Floats, p: Floats, period: float) -> None:
    """Refuse points that are wrong by themselves or by their order."""
    half = period / 2.0
    slack = 1e-9 * period
    bad = np.flatnonzero(~(np.isfinite(phi) & np.isfinite(p)))
    if bad.size:
        i = int(bad[0])
        raise ValueError(
            f"point {i + 1}: crank angle {_deg(phi[i])} degrees, pressure {_bar(p[i])} bar: "
            "both must be finite numbers"
        )
    bad = np.flatnonzero((phi < -half - slack) | (phi > half + slack))
    if bad.size:
        i = int(bad[0])
        raise ValueError(
            f"point {i + 1}: crank angle {_deg(phi[i])} degrees is outside "
            f"{_deg(-half)}..{_deg(half)} (0 is firing top dead centre)"
        )
    bad = np.flatnonzero(np.diff(phi) <= 0.0)
    if bad.size:
        i = int(bad[0]) + 1
        raise ValueError(
            f"point {i + 1}: crank angle {_deg(phi[i])} degrees after {_deg(phi[i - 1])}: "
            "angles must be strictly ascending"
        )
    bad = np.flatnonzero(p <= 0.0)
    if bad.size:
        i = int(bad[0])
        raise ValueError(
            f"point {i + 1}: pressure {_bar(p[i])} bar at {_deg(phi[i])} degrees: "
            "absolute pressure must be positive (is it gauge pressure?)"
        )
    top = int(np.argmax(p))
    if p[top] > LARGEST_PRESSURE:
        raise ValueError(
            f"point {top + 1}: pressure {_bar(p[top])} bar at {_deg(phi[top])} degrees is above "
            f"{_bar(LARGEST_PRESSURE)} bar{_unit_hint(p)}"
        )


def _unit_hint(p: Floats) -> str:
    """Name the unit the values were probably in: gas exchange happens near one atmosphere."""
    low = float(p.min()) / BAR
    if 50.0 <= low <= 400.0:
        return " (it looks like kilopascal)"
    if 7.0 <= low < 50.0:
        return " (it looks like psi)"
    if low >= 2e4:
        return " (it looks like pascal)"
    return ""


def _join_ends(phi: Floats, p: Floats, period: float) -> tuple[Floats, Floats]:
    """Make one point of both ends of the cycle, with the mean of their pressures."""
    half = period / 2.0
    slack = 1e-9 * period
    at_start = abs(phi[0] + half) <= slack
    at_end = abs(phi[-1] - half) <= slack
    if at_start:
        phi[0] = -half
    if not at_end:
        return phi, p
    if not at_start:
        # The end alone: the same angle one period earlier.
        return np.concatenate(([-half], phi[:-1])), np.concatenate(([p[-1]], p[:-1]))
    differ = abs(p[0] - p[-1])
    largest = float(p.max())
    if differ > ENDS_TOLERANCE * largest:
        raise ValueError(
            f"pressure {_bar(p[0])} bar at {_deg(-half)} degrees and {_bar(p[-1])} bar at "
            f"{_deg(half)}, which is the same angle: they differ by {_bar(differ)} bar, allowed is "
            f"2 % of the peak, {_bar(ENDS_TOLERANCE * largest)} bar"
        )
    p[0] = 0.5 * (p[0] + p[-1])
    return phi[:-1], p[:-1]


def _check_coverage(phi: Floats, period: float) -> None:
    """Refuse gaps too wide for a spline to bridge."""
    step = np.diff(phi, append=phi[0] + period)
    end = phi + step
    near = (phi < NEAR_FIRING) & (end > -NEAR_FIRING)
    # The gap that wraps ends in the next period.
    near |= (phi < NEAR_FIRING + period) & (end > period - NEAR_FIRING)
    slack = 1e-9 * period
    for allowed, where, part in (
        (LARGEST_GAP, np.full(len(phi), True), ""),
        (LARGEST_GAP_NEAR_FIRING, near, f" within {_deg(NEAR_FIRING)} degrees of firing"),
    ):
        wide = np.flatnonzero(where & (step > allowed + slack))
        if wide.size:
            i = int(wide[np.argmax(step[wide])])
            raise ValueError(
                f"no pressure between {_deg(phi[i])} and {_deg(_wrap(end[i], period))} degrees: "
                f"a gap of {_deg(step[i])} degrees, allowed are {_deg(allowed)}{part}"
            )


def _check_phase(phi: Floats, p: Floats, period: float) -> None:
    """Refuse a peak away from firing dead centre, or no compression before it."""
    top = int(np.argmax(p))
    place = float(phi[top])
    if not PEAK_FROM <= place <= PEAK_TO:
        hint = ""
        for shift in (360.0, 180.0):
            for sign in (-1.0, 1.0):
                moved = float(_wrap(place + sign * shift * DEGREE, period))
                fits = PEAK_FROM <= moved <= PEAK_TO
                if not hint and fits and shift * DEGREE < period:
                    hint = f" (the diagram looks shifted by {shift:.0f} degrees)"
        raise ValueError(
            f"point {top + 1}: the peak, {_bar(p[top])} bar, is at {_deg(place)} degrees, allowed "
            f"is {_deg(PEAK_FROM)}..{_deg(PEAK_TO)}: 0 must be firing top dead centre{hint}"
        )
    early, late = (-120.0, -20.0) if math.isclose(period, FOUR_STROKE) else (-80.0, -20.0)
    before, after = np.interp(np.array([early, late]) * DEGREE, phi, p, period=period)
    if after <= before:
        raise ValueError(
            f"pressure {_bar(before)} bar at {early:g} degrees and {_bar(after)} bar at {late:g}: "
            "it must rise through the compression; 0 must be firing top dead centre and angles "
            "must grow with rotation"
        )


@dataclass(frozen=True, eq=False)
class Family:
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
    """

    loads: Floats
    diagrams: tuple[Diagram, ...]
    _rows: dict[int, Diagram] = field(default_factory=dict, init=False, repr=False)

    @property
    def low(self) -> float:
        """Lowest load [percent]."""
        return float(self.loads[0])

    @property
    def high(self) -> float:
        """Highest load [percent]."""
        return float(self.loads[-1])

    @property
    def row_count(self) -> int:
        """Number of rows of the table."""
        return int(self._first_rows[-1]) + 1

    @property
    def row_loads(self) -> Floats:
        """Load [percent] of every row, ascending."""
        pieces = [
            np.linspace(self.loads[i], self.loads[i + 1], count, endpoint=False)
            for i, count in enumerate(self._row_steps)
        ]
        return np.concatenate([*pieces, self.loads[-1:]])

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
            Share of the next row, 0 <= weight < 1. It is exactly 0 on a row (the last included),
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
        first = self._first_rows
        steps = np.append(self._row_steps, 1)
        segment = np.searchsorted(self.loads, wanted, side="right") - 1
        width = np.diff(self.loads, append=self.loads[-1] + 1.0)
        place = (wanted - self.loads[segment]) / width[segment] * steps[segment]
        # A load meant to be a row (12.5 of a linspace) is taken as the row.
        nearest = np.rint(place)
        place = np.where(np.abs(place - nearest) <= 1e-9, nearest, place)
        whole = np.floor(place)
        row: Integers = (first[segment] + whole).astype(np.int64)
        return row, np.asarray(place - whole, dtype=np.float64)

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
            first = self._first_rows
            segment = int(np.searchsorted(first, index, side="right")) - 1
            inside = index - int(first[segment])
            if inside == 0:
                known = self.diagrams[segment]
            else:
                share = inside / int(self._row_steps[segment])
                known = morph(self.diagrams[segment], self.diagrams[segment + 1], share)
            self._rows[index] = known
        return known

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
        lower, share = self.row(below), place - below
        return lower if share == 0.0 else blend(lower, self.row(below + 1), share)

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
        wanted = np.asarray(place, dtype=np.float64)
        values, places = np.unique(wanted, return_inverse=True)
        peaks = np.array([self.between(float(value)).peak for value in values])
        return peaks[places].reshape(wanted.shape)

    def each(self, change: Callable[[Diagram], Diagram]) -> Family:
        """Family of the diagrams that `change` makes of the given ones."""
        return family_from_diagrams(self.loads.tolist(), [change(d) for d in self.diagrams])

    @cached_property
    def _row_steps(self) -> Integers:
        """Count the table steps between each two given loads."""
        steps: Integers = np.ceil(np.diff(self.loads) / ROW_STEP - 1e-9).astype(np.int64)
        return steps

    @cached_property
    def _first_rows(self) -> Integers:
        """Find the row of each given load."""
        rows: Integers = np.concatenate(([0], np.cumsum(self._row_steps))).astype(np.int64)
        return rows


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
    """
    values = np.array(loads, dtype=np.float64)
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
            f"{_deg(shift[i])} degrees apart, allowed are {_deg(LARGEST_SHIFT)}"
        )
    return Family(values, on_common_knots(diagrams))


def on_common_knots(diagrams: Sequence[Diagram]) -> tuple[Diagram, ...]:
    """Bring diagrams of one period to the same knots, as `family_from_diagrams` says."""
    first = diagrams[0]
    if all(np.array_equal(d.angle, first.angle) for d in diagrams):
        return tuple(diagrams)
    count = round(first.period / COMMON_STEP)
    phi: Floats = np.arange(-(count // 2), count - count // 2, dtype=np.float64)
    phi *= first.period / count
    common = [(d(phi), d.period, d.motored) for d in diagrams]
    return tuple(Diagram(phi, p, periodic_spline_slopes(phi, p, t), t, m) for p, t, m in common)


def blend(lower: Diagram, upper: Diagram, share: float) -> Diagram:
    """Make the linear blend of two diagrams with the same knots, with `share` of the second."""
    # The spline is linear in its values, so the blend of slopes is the slope of the blend.
    return Diagram(
        lower.angle,
        (1.0 - share) * lower.pressure + share * upper.pressure,
        (1.0 - share) * lower.slope + share * upper.slope,
        lower.period,
    )


def morph(start: Diagram, end: Diagram, share: float) -> Diagram:
    """Make the diagram at a share (0..1) of the way between two with the same knots."""
    from_angle, to_angle = start.peak_angle, end.peak_angle
    peak = from_angle + share * (to_angle - from_angle)
    shift = abs(to_angle - from_angle)
    room = start.period / 2.0 - PEAK_TO
    before = min(max(WARP_BEFORE, WARP_PER_SHIFT * shift), room)
    after = min(max(WARP_AFTER, WARP_PER_SHIFT * shift), room)
    distance = start.angle - peak
    reach = np.where(distance < 0.0, before, after)
    # (1 - u^2)^3 is smooth, one at the peak and zero with two derivatives at its ends; its slope
    # stays under 1.72 / reach, so the warp is monotone for shifts up to 0.58 of the reach.
    bump = np.maximum(1.0 - (distance / reach) ** 2, 0.0) ** 3
    low = start(start.angle + (from_angle - peak) * bump)
    high = end(start.angle + (to_angle - peak) * bump)
    pressure = np.exp((1.0 - share) * np.log(low) + share * np.log(high))
    slope = periodic_spline_slopes(start.angle, pressure, start.period)
    return Diagram(start.angle, pressure, slope, start.period)


def _stationary(p0: Floats, p1: Floats, s0: Floats, s1: Floats, step: Floats) -> Floats:
    """Find where in (0, 1) each cubic is stationary, shape (K, 2), NaN where it is not."""
    # Derivative of the Hermite cubic in t: 3 a t^2 + 2 b t + c.
    c = step * s0
    b = 3.0 * (p1 - p0) - step * (2.0 * s0 + s1)
    a = step * (s0 + s1) - 2.0 * (p1 - p0)
    root = np.sqrt(np.maximum(b * b - 3.0 * a * c, 0.0))
    real = b * b >= 3.0 * a * c
    # The form that does not cancel: q = -(b + sign(b) root), t = q / 3a and c / q.
    q = -(b + np.copysign(root, b))
    with np.errstate(divide="ignore", invalid="ignore"):
        t = np.stack([q / (3.0 * a), c / q], axis=-1)
    return np.where(real[:, None] & (t > 0.0) & (t < 1.0), t, np.nan)


def _wrap(phi: ArrayLike, period: float) -> Floats:
    """Bring angles into -period/2 <= phi < period/2; those already there stay as they are."""
    value = np.asarray(phi, dtype=np.float64)
    wrapped: Floats = value - period * np.floor(value / period + 0.5)
    return wrapped


def _deg(value: ArrayLike) -> str:
    return f"{float(np.asarray(value)) / DEGREE:.6g}"


def _bar(value: ArrayLike) -> str:
    return f"{float(np.asarray(value)) / BAR:.6g}"
