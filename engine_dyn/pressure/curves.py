"""Many diagrams with the same equally spaced knots: sampled, morphed and blended by kernels.

What `diagram.Diagram` and `family.morph` do with one diagram is done here with the rows of arrays.
Each row depends on its own sources alone, so its bits do not depend on what else is computed.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from engine_dyn.compilation import inlined, kernel
from engine_dyn.pressure.family import LARGEST_SHIFT, WARP_AFTER, WARP_BEFORE, WARP_PER_SHIFT
from engine_dyn.pressure.point_checks import PEAK_TO
from engine_dyn.types import Booleans, Floats, Integers

FEWEST = 8  # Smallest number of rows that are worth a thread: each takes some 50 us

FLAT = 1e5
"""Pressure [Pa] of rows without a cycle: a number, so that it does not affect other designs."""


class Curves(NamedTuple):
    """Diagrams with the same knots, whose rows are wanted in some order."""

    # Absolute pressure [Pa] at the knots and its derivative over the angle [Pa/rad]; shape (R, K)
    pressure: Floats
    slope: Floats
    known: Booleans  # Whether each row is a diagram; shape (R,)
    rows: Integers  # Row of the table for each requested diagram


def on_threads(
    size: int, work: Callable[[int, int], None], threads: int, fewest: int = FEWEST
) -> None:
    """Call `work(begin, end)` over all rows, on threads with at least `fewest` rows each."""
    threads = max(1, min(threads, size // fewest))
    if threads == 1:
        work(0, size)
        return
    pieces = min(4 * threads, size // fewest)
    edges = [size * i // pieces for i in range(pieces + 1)]
    with ThreadPoolExecutor(threads) as pool:
        list(pool.map(work, edges[:-1], edges[1:]))


@inlined
def place_of(phi: float, count: int, period: float) -> tuple[int, float]:
    """Knot at or before an angle, and the fraction of the way to the next."""
    place = (phi / period + 0.5) * count
    # An angle that misses a knot by rounding counts as the knot.
    nearest = math.floor(place + 0.5)
    if abs(place - nearest) < 1e-9:
        place = nearest
    left = math.floor(place)
    return int(left - count * math.floor(left / count)), place - left


@inlined
def hermite_at(
    pressure: Floats, slope: Floats, left: int, t: float, step: float
) -> tuple[float, float]:
    """Pressure and slope of the cubic at a fraction t after a knot."""
    right = left + 1 if left + 1 < pressure.size else 0
    p0, p1, s0, s1 = pressure[left], pressure[right], slope[left], slope[right]
    rest = 1.0 - t
    value = p0 * (rest * rest * (1.0 + 2.0 * t)) + p1 * (t * t * (3.0 - 2.0 * t))
    value += step * (s0 * (t * rest * rest) - s1 * (t * t * rest))
    rise = 6.0 * t * rest * (p1 - p0) / step
    return value, rise + s0 * (rest * (1.0 - 3.0 * t)) + s1 * (t * (3.0 * t - 2.0))


def sampled(
    curves: Curves, angle: Floats, period: float, threads: int, slopes: bool = False
) -> tuple[Floats, Floats]:
    """Pressure, and slope if wanted, of each diagram at crank angles [rad], shape (R, angles)."""
    shape = curves.rows.size, angle.size
    values = np.empty(shape)
    rises = np.empty(shape if slopes else (shape[0], 0))
    # Indices are unsigned: Numba checks of signed ones whether they count from the end.
    places = np.empty((2, angle.size), dtype=np.uint64)
    weights = np.empty((angle.size, 8))
    _weigh(angle, curves.pressure.shape[1], period, places, weights)

    def work(begin: int, end: int) -> None:
        _sample(
            curves.pressure, curves.slope, curves.rows[begin:end], places, weights,
            values[begin:end], rises[begin:end],
        )  # fmt: skip

    on_threads(shape[0], work, threads)
    return values, rises


@kernel
def _weigh(angle: Floats, count: int, period: float, places: Integers, weights: Floats) -> None:
    """Knots beside angles, and the weights of their values and slopes: see `hermite_at`."""
    step = period / count
    for i in range(angle.size):
        left, t = place_of(angle[i], count, period)
        rest = 1.0 - t
        places[0, i], places[1, i] = left, left + 1 if left + 1 < count else 0
        weights[i, 0], weights[i, 1] = rest * rest * (1.0 + 2.0 * t), t * t * (3.0 - 2.0 * t)
        weights[i, 2], weights[i, 3] = step * (t * rest * rest), -step * (t * t * rest)
        weights[i, 5] = 6.0 * t * rest / step
        weights[i, 4] = -weights[i, 5]
        weights[i, 6], weights[i, 7] = rest * (1.0 - 3.0 * t), t * (3.0 * t - 2.0)


@kernel
def _sample(
    pressure: Floats, slope: Floats, rows: Integers, places: Integers, weights: Floats,
    values: Floats, rises: Floats,
) -> None:  # fmt: skip
    left, right = places[0], places[1]
    for row in range(rows.size):
        p, s = pressure[rows[row]], slope[rows[row]]
        for i in range(left.size):
            values[row, i] = (
                p[left[i]] * weights[i, 0] + p[right[i]] * weights[i, 1]
                + s[left[i]] * weights[i, 2] + s[right[i]] * weights[i, 3]
            )  # fmt: skip
        if rises.shape[1] > 0:
            for i in range(left.size):
                rises[row, i] = (
                    p[left[i]] * weights[i, 4] + p[right[i]] * weights[i, 5]
                    + s[left[i]] * weights[i, 6] + s[right[i]] * weights[i, 7]
                )  # fmt: skip


@kernel
def pressures_at(
    pressure: Floats, slope: Floats, first: Integers, second: Integers, weight: Floats,
    design: Integers, phi: Floats, period: float, values: Floats,
) -> None:  # fmt: skip
    """Pressure of design `design[i]` at the angle `phi[i]` [rad], for every i.

    A design has the row `first` and, with its weight, the row `second`.
    """
    count = pressure.shape[1]
    step = period / count
    for i in range(phi.size):
        left, t = place_of(phi[i], count, period)
        number = design[i]
        row, share = first[number], weight[number]
        values[i], _ = hermite_at(pressure[row], slope[row], left, t, step)
        if share > 0.0:
            row = second[number]
            other, _ = hermite_at(pressure[row], slope[row], left, t, step)
            values[i] = (1.0 - share) * values[i] + share * other


@inlined
def peak_angle_of(pressure: Floats, slope: Floats, period: float) -> float:
    """Angle of the spline's maximum beside the largest pressure at a knot, as `Diagram`'s."""
    count = pressure.size
    step = period / count
    top = 0
    for i in range(count):
        if pressure[i] > pressure[top]:
            top = i
    left = top if slope[top] >= 0.0 else top - 1
    left = left if left >= 0 else count - 1
    right = left + 1 if left + 1 < count else 0
    p0, p1, s0, s1 = pressure[left], pressure[right], slope[left], slope[right]
    c = step * s0
    b = 3.0 * (p1 - p0) - step * (2.0 * s0 + s1)
    a = step * (s0 + s1) - 2.0 * (p1 - p0)
    best, angle = pressure[top], top * step - 0.5 * period
    square = b * b - 3.0 * a * c
    if square < 0.0:
        return angle
    # This form of the quadratic formula does not subtract nearly equal numbers.
    q = -(b + math.copysign(math.sqrt(square), b))
    for number in range(2):
        t = 0.0
        if number == 0 and a != 0.0:
            t = q / (3.0 * a)
        elif number == 1 and q != 0.0:
            t = c / q
        if 0.0 < t < 1.0:
            value, _ = hermite_at(pressure, slope, left, t, step)
            if value > best:
                best, angle = value, (left + t) * step - 0.5 * period
    return angle if angle < 0.5 * period else angle - period


def morphed(
    curves: Curves, first: Integers, second: Integers, fraction: Floats, period: float, threads: int
) -> Curves:
    """Diagrams at fractions of the way between two: see `family.morph`.

    Parameters
    ----------
    curves : Curves
        The sources.
    first, second : ndarray of int64, shape (R,)
        Places in `curves.rows`. Where the fraction is 0, the second is not used.
    fraction : ndarray, shape (R,)
        0 <= fraction < 1.
    period : float
        [rad].
    threads : int
        Largest number of threads.

    Returns
    -------
    Curves
        Not known where a source is not, or where the peaks lie more than 60 degrees apart.
    """
    count = curves.pressure.shape[1]
    pressure = np.empty((first.size, count))
    slope, known = np.empty(pressure.shape), np.empty(first.size, dtype=np.bool_)
    diagonal, correction = _elimination(count)
    one, other = curves.rows[first], curves.rows[second]

    def work(begin: int, end: int) -> None:
        here = slice(begin, end)
        _morph(
            curves.pressure, curves.slope, curves.known, one[here], other[here], fraction[here],
            period, diagonal, correction, pressure[here], slope[here], known[here],
        )  # fmt: skip

    on_threads(first.size, work, threads)
    return Curves(pressure, slope, known, np.arange(first.size))


@lru_cache(maxsize=16)
def _elimination(count: int) -> tuple[Floats, Floats]:
    """Diagonal and corners after elimination of 1, 4, 1 (see `periodic_spline_slopes`)."""
    diagonal, corner = np.full(count, 4.0), np.zeros(count)
    diagonal[0], diagonal[-1] = 8.0, 4.25
    corner[0], corner[-1] = -4.0, 1.0
    for i in range(1, count):
        diagonal[i] -= 1.0 / diagonal[i - 1]
        corner[i] -= corner[i - 1] / diagonal[i - 1]
    corner[-1] /= diagonal[-1]
    for i in range(count - 2, -1, -1):
        corner[i] = (corner[i] - corner[i + 1]) / diagonal[i]
    return 1.0 / diagonal, corner


@inlined
def spline_slopes(
    values: Floats, step: float, inverse: Floats, corner: Floats, slope: Floats
) -> None:
    """Slopes of the periodic cubic spline through equally spaced points; see `_elimination`."""
    last = values.size - 1
    slope[0] = 3.0 * (values[1] - values[last]) / step
    for i in range(1, last + 1):
        after = values[i + 1] if i < last else values[0]
        slope[i] = 3.0 * (after - values[i - 1]) / step - slope[i - 1] * inverse[i - 1]
    slope[last] *= inverse[last]
    for i in range(last - 1, -1, -1):
        slope[i] = (slope[i] - slope[i + 1]) * inverse[i]
    factor = (slope[0] - 0.25 * slope[last]) / (1.0 + corner[0] - 0.25 * corner[last])
    for i in range(last + 1):
        slope[i] -= factor * corner[i]


@kernel
def _morph(
    pressures: Floats, slopes: Floats, is_known: Booleans, first: Integers, second: Integers,
    fraction: Floats, period: float, inverse: Floats, corner: Floats, result: Floats,
    result_slope: Floats, known: Booleans,
) -> None:  # fmt: skip
    count = pressures.shape[1]
    step = period / count
    for row in range(first.size):
        f = fraction[row]
        one, other = first[row], second[row] if f > 0.0 else first[row]
        known[row] = is_known[one] and is_known[other]
        pressure, slope = result[row], result_slope[row]
        if f == 0.0 and known[row]:
            for i in range(count):
                pressure[i], slope[i] = pressures[one, i], slopes[one, i]
            continue
        from_angle = peak_angle_of(pressures[one], slopes[one], period)
        to_angle = from_angle
        if f > 0.0 and known[row]:
            to_angle = peak_angle_of(pressures[other], slopes[other], period)
            known[row] = abs(to_angle - from_angle) <= LARGEST_SHIFT
        if not known[row]:
            for i in range(count):
                pressure[i], slope[i] = FLAT, 0.0
            continue
        peak = from_angle + f * (to_angle - from_angle)
        shift = abs(to_angle - from_angle)
        room = 0.5 * period - PEAK_TO
        before = min(max(WARP_BEFORE, WARP_PER_SHIFT * shift), room)
        after = min(max(WARP_AFTER, WARP_PER_SHIFT * shift), room)
        for i in range(count):
            angle = i * step - 0.5 * period
            distance = angle - peak
            part = distance / (before if distance < 0.0 else after)
            bump = max(1.0 - part * part, 0.0)
            bump = bump * bump * bump
            low, high = pressures[one, i], pressures[other, i]
            if bump > 0.0:  # only angles near the combustion are warped
                left, t = place_of(angle + (from_angle - peak) * bump, count, period)
                low, _ = hermite_at(pressures[one], slopes[one], left, t, step)
                left, t = place_of(angle + (to_angle - peak) * bump, count, period)
                high, _ = hermite_at(pressures[other], slopes[other], left, t, step)
            # Geometric interpolation low^(1 - f) high^f.
            pressure[i] = low * math.exp(f * math.log(high / low))
        spline_slopes(pressure, step, inverse, corner, slope)
