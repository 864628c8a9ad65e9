"""Steps of high order through Lobatto's five points, both ends of the step among them.

The rates at the points are joined by a polynomial of degree 4. Its integral up to each point gives
the next values there, until they no longer change. At the end of the step the order is 8; between,
the polynomial gives the solution anywhere, so that an event within the step is found without
stepping again, and the step goes on behind it with the same points.

Source: Hairer, Norsett and Wanner, Solving Ordinary Differential Equations I, Springer 1993,
ch. II.7 (collocation; Lobatto's points).
"""

from __future__ import annotations

import math

import numpy as np

from engine_dyn.compilation import formula, inlined
from engine_dyn.types import Floats

_AWAY = 0.5 * math.sqrt(3.0 / 7.0)
POINTS = (0.0, 0.5 - _AWAY, 0.5, 0.5 + _AWAY, 1.0)
"""Lobatto's points on [0, 1]."""

_coefficients = np.linalg.inv(np.array(POINTS)[:, None] ** np.arange(5.0))
COEFFICIENTS = tuple(tuple(row) for row in _coefficients.tolist())
"""Coefficient of the power j of the place (row) that belongs to the value at point k (column)."""

_integrals = (
    np.array(POINTS)[1:, None] ** np.arange(1.0, 6.0) / np.arange(1.0, 6.0)
) @ _coefficients
INTEGRALS = tuple(tuple(row) for row in _integrals.tolist())
"""Integral from 0 to point j = 1 to 4 (row), of the value at point k (column)."""


@formula
def integrated(
    a: float, b: float, c: float, d: float, e: float
) -> tuple[float, float, float, float]:
    """Integrals from 0 to the points 1 to 4 of the polynomial through five values."""
    m = INTEGRALS
    return (
        m[0][0] * a + m[0][1] * b + m[0][2] * c + m[0][3] * d + m[0][4] * e,
        m[1][0] * a + m[1][1] * b + m[1][2] * c + m[1][3] * d + m[1][4] * e,
        m[2][0] * a + m[2][1] * b + m[2][2] * c + m[2][3] * d + m[2][4] * e,
        m[3][0] * a + m[3][1] * b + m[3][2] * c + m[3][3] * d + m[3][4] * e,
    )


@inlined
def dot(a: Floats, b: Floats) -> float:
    """Sum of products of five weights and five values."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3] + a[4] * b[4]


@inlined
def weigh(s: float, integral: Floats, value: Floats) -> None:
    """Weights of the values at the points in the integral from 0 to a place, and in the value."""
    for k in range(5):
        a, b, c = COEFFICIENTS[0][k], COEFFICIENTS[1][k], COEFFICIENTS[2][k]
        d, e = COEFFICIENTS[3][k], COEFFICIENTS[4][k]
        value[k] = a + s * (b + s * (c + s * (d + s * e)))
        integral[k] = s * (a + s * (b / 2.0 + s * (c / 3.0 + s * (d / 4.0 + s * e / 5.0))))


@inlined
def fit(values: Floats, power: Floats) -> None:
    """Coefficients of the polynomial through five values: `power` gets those of place^0 to ^4."""
    for j in range(5):
        row = COEFFICIENTS[j]
        total = 0.0
        for k in range(5):
            total += row[k] * values[k]
        power[j] = total


@inlined
def value_at(s: float, power: Floats) -> float:
    """Polynomial at a place."""
    return power[0] + s * (power[1] + s * (power[2] + s * (power[3] + s * power[4])))


@inlined
def slope_at(s: float, power: Floats) -> float:
    """Its slope over the place."""
    return power[1] + s * (2.0 * power[2] + s * (3.0 * power[3] + s * 4.0 * power[4]))


@inlined
def integral_at(s: float, power: Floats) -> float:
    """Its integral from 0 to a place."""
    return s * (
        power[0] + s * (power[1] / 2.0 + s * (power[2] / 3.0 + s * (power[3] / 4.0
        + s * power[4] / 5.0)))
    )  # fmt: skip


@inlined
def reaches(level: float, a: float, b: float, power: Floats, sign: float) -> float:
    """First place in (a, b] where sign (value - level) turns positive; above 2 if nowhere.

    Looked for between Lobatto's points, and found by halving.
    """
    low = a
    for k in range(1, 5):
        high = min(POINTS[k], b)
        if high > low:
            if sign * (value_at(high, power) - level) > 0.0:
                for _ in range(52):
                    middle = 0.5 * (low + high)
                    if sign * (value_at(middle, power) - level) > 0.0:
                        high = middle
                    else:
                        low = middle
                return high
            low = high
    return 3.0


_slopes = np.array(POINTS)[:, None] ** np.maximum(np.arange(10.0) - 1.0, 0.0) * np.arange(10.0)
_of_both = np.linalg.inv(np.concatenate([np.array(POINTS)[:, None] ** np.arange(10.0), _slopes]))
BOTH = tuple(tuple(row) for row in _of_both.tolist())
"""Coefficient of the power j (row) of five values and five slopes (column)."""


@inlined
def largest(
    a: float, b: float, values: Floats, slopes: Floats, power: Floats, sign: float
) -> float:
    """Largest value in [a, b] of sign times the polynomial with these values and slopes.

    At an end or a point, or between the points where sign times the slope turns from above to below
    0 and the values are largest; by Newton's method. `power` is scratch of length 10.
    """
    best, top, left = -math.inf, -math.inf, -1
    for k in range(5):
        if a <= POINTS[k] <= b:
            best = max(best, sign * values[k])
        if k < 4 and sign * slopes[k] > 0.0 >= sign * slopes[k + 1]:
            higher = max(sign * values[k], sign * values[k + 1])
            if higher > top and POINTS[k] < b and POINTS[k + 1] > a:
                top, left = higher, k
    if left < 0 and a == 0.0 and b == 1.0:
        return best
    for j in range(1, 10):
        row, total = BOTH[j], 0.0
        for k in range(5):
            total += row[k] * (values[k] - values[0]) + row[5 + k] * slopes[k]
        power[j] = total
    for way in range(3):  # both ends, and the place between points
        at, low, high = (a, a, a) if way == 0 else (b, b, b)
        if way == 2:
            if left < 0:
                break
            low, high = max(POINTS[left], a), min(POINTS[left + 1], b)
            at = min(max(0.5 * (POINTS[left] + POINTS[left + 1]), low), high)
        for _ in range(8):
            value, slope, bend = power[9], 0.0, 0.0
            for j in range(8, 0, -1):
                bend = bend * at + slope
                slope = slope * at + value
                value = value * at + power[j]
            # Horner's sum lacks the factor of its place.
            bend, slope, value = 2.0 * (bend * at + slope), slope * at + value, value * at
            best = max(best, sign * (values[0] + value))
            if low == high or not sign * bend < 0.0:
                break
            at = min(max(at - slope / bend, low), high)
    return best
