"""Indicator diagrams: cylinder pressure over crank angle.

A diagram is a periodic cubic spline through tabulated absolute pressures. A cubic is the lowest
degree that keeps the torque smooth: linear interpolation of a diagram at 1 degree would limit every
later quadrature to second order.

Angles are in radians from firing top dead centre, pressures in pascal, absolute.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from engine_dyn.geometry.arrangement import FOUR_STROKE, TURN
from engine_dyn.given_numbers import given_array, given_number
from engine_dyn.periodic_spline import periodic_spline_slopes, wrapped
from engine_dyn.pressure.point_checks import checked_points
from engine_dyn.types import Floats, Integers
from engine_dyn.units import BAR, DEGREE


def never_burns() -> Diagram:
    """In place of `Diagram.motored`: cylinders of compressors and pumps have no combustion.

    Raises
    ------
    ValueError
        Always, one line.
    """
    raise ValueError(
        "a compressor or pump has no diagram without its own; factors on its pressure must be 1, "
        "and misfire 0"
    )


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

    Examples
    --------
    >>> import engine_dyn
    >>> import numpy as np
    >>> degrees = [-360, -300, -240, -180, -135, -90, -60, -45, -30, -15, 0, 10, 20, 30, 45, 60]
    >>> bar = [1.0, 1.0, 1.0, 1.0, 1.2, 2.2, 4.3, 7.1, 14, 28, 48, 56, 46, 32, 18, 11]
    >>> degrees += [75, 90, 120, 150, 180, 240, 300]
    >>> bar += [7.5, 5.5, 3.6, 2.3, 1.2, 1.0, 1.0]
    >>> diagram = engine_dyn.diagram_from_points(np.radians(degrees), 1e5 * np.array(bar))
    >>> diagram.angle.size
    23
    >>> round(float(diagram(np.radians(730))) / 1e5, 1)  # periodic: 730 degrees is 10
    56.0
    """

    angle: Floats
    pressure: Floats
    slope: Floats
    period: float = FOUR_STROKE
    motored: Callable[[], Diagram] | None = field(default=None, repr=False)

    def __call__(self, phi: ArrayLike) -> Floats:
        """Pressure [Pa] at any crank angle [rad], scalar or array; the angle wraps."""
        return _pressure_of(self.pressure, self.slope, self._pieces(given_array("phi", phi)))

    def derivative(self, phi: ArrayLike) -> Floats:
        """dp/dphi [Pa/rad] of the spline at any crank angle [rad]; the angle wraps."""
        return _slope_of(self.pressure, self.slope, self._pieces(given_array("phi", phi)))

    @property
    def peak(self) -> float:
        """Largest tabulated pressure [Pa] (the p_max of Kakaitsas 2015, eq. 3.9)."""
        return float(self.pressure.max())

    @property
    def peak_angle(self) -> float:
        """Angle [rad] where the spline is largest beside the largest tabulated pressure."""
        top = int(np.argmax(self.pressure))
        count = len(self.angle)
        # The maximum lies on the side to which the spline rises from the knot of largest pressure.
        left = top if self.slope[top] >= 0.0 else (top - 1) % count
        right = (left + 1) % count
        step = (self.angle[right] - self.angle[left]) % self.period
        p, s = self.pressure, self.slope
        t = _stationary(*np.array([p[left], p[right], s[left], s[right], step])[:, None])
        best, value = float(self.angle[top]), self.peak
        for place in t[np.isfinite(t)]:
            where = float(wrapped(self.angle[left] + place * step, self.period))
            here = float(self(where))
            if here > value:
                best, value = where, here
        return best

    @property
    def widest_gap(self) -> float:
        """Gap [rad] that samples of the curve may have at most to show each of its crests.

        Of equal steps, the widest whose knots predict those between them, by cubics; else the
        narrowest gap of the knots.
        """
        gaps, pressure = np.diff(self.angle), self.pressure
        gap = float(gaps.min())
        if not np.allclose(gaps, gap, rtol=1e-6):
            return gap
        while pressure.size % 2 == 0 and pressure.size > 8:
            near, between = pressure[::2], pressure[1::2]
            predicted = 9.0 * (near + np.roll(near, -1)) - np.roll(near, 1) - np.roll(near, -2)
            # In a smooth diagram, cubics through every other knot miss the knots between by no more
            # than 1e-6 of the pressure's range.
            if np.abs(between - predicted / 16.0).max() > 1e-6 * np.ptp(self.pressure):
                break
            gap, pressure = 2.0 * gap, near
        return gap

    @property
    def lowest(self) -> float:
        """Smallest pressure [Pa] of the spline, between the knots included."""
        p0, p1 = self.pressure, np.roll(self.pressure, -1)
        s0, s1 = self.slope, np.roll(self.slope, -1)
        step = np.diff(self.angle, append=self.angle[0] + self.period)
        t = _stationary(p0, p1, s0, s1, step)
        phi = (self.angle[:, None] + t * step[:, None])[np.isfinite(t)]
        low = float(self.pressure.min())
        return min(low, float(self(phi).min())) if phi.size else low

    def scaled(self, factor: float) -> Diagram:
        """Return the diagram with every pressure multiplied by `factor` (> 0).

        Raises
        ------
        ValueError
            If the factor is not positive and finite.
        """
        factor = given_number("factor", factor)
        if not (math.isfinite(factor) and factor > 0.0):
            raise ValueError(f"pressure scale {factor:g} is not allowed: it must be positive")
        without = self.motored
        motored = None if without is None else lambda: without().scaled(factor)
        return Diagram(
            self.angle, self.pressure * factor, self.slope * factor, self.period, motored
        )

    def _pieces(self, phi: ArrayLike) -> _Pieces:
        """Find the interval of knots that contains each angle."""
        inside = wrapped(np.asarray(phi, dtype=np.float64), self.period)
        count = len(self.angle)
        left = np.searchsorted(self.angle, inside, side="right") - 1
        # An angle before the first knot lies in the interval that begins at the last knot of the
        # cycle before, index -1.
        right = (left + 1) % count
        start = self.angle[left] - np.where(left < 0, self.period, 0.0)
        step = self.angle[right] - start + np.where((right == 0) & (left >= 0), self.period, 0.0)
        return _Pieces(left, right, step, (inside - start) / step)


class _Pieces(NamedTuple):
    """Intervals of some angles: knots at both ends, step between them, fraction of the step."""

    left: Integers
    right: Integers
    step: Floats
    part: Floats


def _pressure_of(pressure: Floats, slope: Floats, at: _Pieces) -> Floats:
    """Pressure of one diagram or, along the first axis, of many diagrams."""
    p0, p1, s0, s1 = _ends_of(pressure, slope, at)
    step, t = at.step, at.part
    rest = 1.0 - t
    # Hermite's basis is 1, 0, 0, 0 at a knot, so tabulated pressures come back exactly.
    return (
        p0 * (rest * rest * (1.0 + 2.0 * t))
        + p1 * (t * t * (3.0 - 2.0 * t))
        + step * (s0 * (t * rest * rest) - s1 * (t * t * rest))
    )


def _slope_of(pressure: Floats, slope: Floats, at: _Pieces) -> Floats:
    """Slope dp/dphi of one diagram or, along the first axis, of many diagrams."""
    p0, p1, s0, s1 = _ends_of(pressure, slope, at)
    step, t = at.step, at.part
    rest = 1.0 - t
    return (
        6.0 * t * rest * (p1 - p0) / step
        + s0 * (rest * (1.0 - 3.0 * t))
        + s1 * (t * (3.0 * t - 2.0))
    )


def _ends_of(pressure: Floats, slope: Floats, at: _Pieces) -> tuple[Floats, ...]:
    """Pressure and slope at both ends of the intervals."""
    return tuple(
        np.take(values, knots, axis=-1)
        for values in (pressure, slope)
        for knots in (at.left, at.right)
    )


def values_at(diagrams: Sequence[Diagram], phi: Floats, out: Floats) -> None:
    """Pressure [Pa] of some diagrams at the same angles.

    Parameters
    ----------
    diagrams : sequence of Diagram
        Of one period. Intervals are searched once for those that follow each other with the same
        knots.
    phi : ndarray, shape (N,)
        Crank angles [rad].
    out : ndarray, shape (diagrams, N)
        Gets the values, with the bits of `Diagram.__call__`.
    """
    # Number of diagrams that are computed together: their values fit in a processor's cache.
    most = max(1, 65536 // phi.size)
    angle, at = None, None
    first = 0
    while first < len(diagrams):
        if at is None or angle is None or not _same(diagrams[first].angle, angle):
            angle = diagrams[first].angle
            at = diagrams[first]._pieces(phi)
        some = [diagrams[first]]
        for one in diagrams[first + 1 : first + most]:
            if not _same(one.angle, angle):
                break
            some.append(one)
        pressure, slope = (np.stack([getattr(d, n) for d in some]) for n in ("pressure", "slope"))
        out[first : first + len(some)] = _pressure_of(pressure, slope, at)
        first += len(some)


def values_of_each(diagrams: Sequence[Diagram], which: Integers, phi: Floats) -> Floats:
    """Pressure [Pa] of one of some diagrams at each angle [rad], with the bits of their calls."""
    angle = diagrams[0].angle
    if not all(_same(one.angle, angle) for one in diagrams):
        values = np.empty(phi.shape)
        for number, one in enumerate(diagrams):
            here = which == number
            values[here] = one(phi[here])
        return values
    pressure, slope = (np.concatenate([getattr(d, n) for d in diagrams])
                       for n in ("pressure", "slope"))  # fmt: skip
    at, first = diagrams[0]._pieces(phi), which * angle.size
    at = at._replace(left=at.left % angle.size + first, right=at.right + first)
    return _pressure_of(pressure, slope, at)


def largest_of_blends(first: Diagram, second: Diagram, fraction: Floats) -> Floats:
    """Largest pressure [Pa] of blends of two diagrams with the same knots, between knots too.

    Shape of `fraction` (N,), the part of the way from the first to the second. A blend is nowhere
    above the blend of what each interval reaches in both, so that few intervals count: not those
    that are below, in both diagrams, what these have at the knot where one of them is largest.
    """
    step = np.diff(first.angle, append=first.angle[0] + first.period)
    ends = [
        np.stack([d.pressure, np.roll(d.pressure, -1), d.slope, np.roll(d.slope, -1)])
        for d in (first, second)
    ]
    reach = [_tops(one, step) for one in ends]
    counts = np.ones(step.size, dtype=np.bool_)
    for top in (np.argmax(first.pressure), np.argmax(second.pressure)):
        counts &= (reach[0] >= first.pressure[top]) | (reach[1] >= second.pressure[top])
    share, each = fraction[:, None], np.tile(step[counts], (fraction.size, 1))
    blended = [
        (1.0 - share) * one[counts] + share * other[counts]
        for one, other in zip(*ends, strict=True)
    ]
    return np.asarray(_tops(np.stack(blended), each).max(axis=1))


def largest_of_rows(pressure: Floats, slope: Floats, step: Floats) -> Floats:
    """Largest pressure [Pa] of diagrams along the first axis, between their knots too.

    `step` are the steps behind the knots [rad], common to all.
    """
    after, rise = np.roll(pressure, -1, axis=1), np.roll(slope, -1, axis=1)
    # A Hermite cubic is nowhere above its higher end plus 4/27 of the step times the slopes that
    # lead upwards from both ends into the step.
    most = 4.0 / 27.0 * step * (np.maximum(slope, 0.0) + np.maximum(-rise, 0.0))
    most += np.maximum(pressure, after)
    row, knot = np.nonzero(most >= pressure.max(axis=1, keepdims=True))
    ends = np.stack([values[row, knot] for values in (pressure, after, slope, rise)])
    peaks = np.full(len(pressure), np.nan)
    np.fmax.at(peaks, row, _tops(ends, step[knot]))
    return peaks


def _tops(ends: Floats, step: Floats) -> Floats:
    """Largest value of cubics, ends included, from the pressures and slopes at both ends."""
    flat = [one.reshape(-1) for one in (*ends, step)]
    places = _stationary(*flat)
    knots = np.arange(places.shape[0])[:, None]
    at = _Pieces(knots, knots + places.shape[0], flat[4][:, None], np.nan_to_num(places))
    inside = _pressure_of(np.concatenate(flat[:2]), np.concatenate(flat[2:4]), at)
    return np.asarray(np.maximum(inside.max(axis=1), flat[1]).reshape(step.shape))


def _same(one: Floats, other: Floats) -> bool:
    """Whether two arrays of knots are the same."""
    return one is other or np.array_equal(one, other)


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
        that is not positive (also between the points) or above 500 bar, or nowhere above 0.01 bar,
        ends that differ by more than 2 % of p_max, a peak outside -30..60 degrees, pressure that
        does not rise through the compression.

    Examples
    --------
    >>> import engine_dyn
    >>> import numpy as np
    >>> degrees = [-360, -300, -240, -180, -135, -90, -60, -45, -30, -15, 0, 10, 20, 30, 45, 60]
    >>> bar = [1.0, 1.0, 1.0, 1.0, 1.2, 2.2, 4.3, 7.1, 14, 28, 48, 56, 46, 32, 18, 11]
    >>> degrees += [75, 90, 120, 150, 180, 240, 300]
    >>> bar += [7.5, 5.5, 3.6, 2.3, 1.2, 1.0, 1.0]
    >>> diagram = engine_dyn.diagram_from_points(np.radians(degrees), 1e5 * np.array(bar))
    >>> round(float(diagram(np.radians(10))) / 1e5, 1)
    56.0
    """
    phi, p = checked_points(angle, pressure, period)
    diagram = Diagram(phi, p, periodic_spline_slopes(phi, p, period), period)
    lowest = diagram.lowest
    if lowest <= 0.0:
        raise ValueError(
            f"the smooth curve through the points falls to {lowest / BAR:.3g} bar between them: "
            "the points are too far apart or scatter too much where the pressure is low"
        )
    return diagram


def in_compression(phi: ArrayLike) -> Floats:
    """Angle [rad] of the compression stroke at which a closed cylinder has the same volume.

    Dead centres are those of a cylinder without offset.
    """
    return -np.abs(wrapped(phi, TURN))


def table_angles(period: float, step_degrees: float) -> Floats:
    """Crank angles [rad] of a table from -period/2, end excluded.

    Raises
    ------
    ValueError
        If the step does not divide the cycle or is over 10 degrees.
    """
    whole = round(period / DEGREE)
    count = round(whole / step_degrees) if step_degrees > 0.0 else 0
    if count * 10 < whole or not math.isclose(count * step_degrees, whole, rel_tol=1e-12):
        raise ValueError(
            f"step = {step_degrees:g} degree: {whole} must be a multiple of it, at most 10"
        )
    return np.arange(count, dtype=np.float64) * (period / count) - 0.5 * period


def _stationary(p0: Floats, p1: Floats, s0: Floats, s1: Floats, step: Floats) -> Floats:
    """Points in (0, 1) at which each cubic is stationary, shape (K, 2), NaN where there is none."""
    # Derivative of the Hermite cubic in t: 3 a t^2 + 2 b t + c.
    c = step * s0
    b = 3.0 * (p1 - p0) - step * (2.0 * s0 + s1)
    a = step * (s0 + s1) - 2.0 * (p1 - p0)
    root = np.sqrt(np.maximum(b * b - 3.0 * a * c, 0.0))
    real = b * b >= 3.0 * a * c
    # The quadratic formula in a form that does not subtract nearly equal numbers:
    # q = -(b + sign(b) root), t = q / 3a and c / q.
    q = -(b + np.copysign(root, b))
    with np.errstate(divide="ignore", invalid="ignore"):
        t = np.stack([q / (3.0 * a), c / q], axis=-1)
    return np.where(real[:, None] & (t > 0.0) & (t < 1.0), t, np.nan)
