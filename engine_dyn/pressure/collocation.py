"""Steps of high order: a polynomial through the rates at Gauss's points of an interval.

One interval of y' = f(phi, y) is solved as a whole. With the derivative J = df/dy at the last
values, Newton's method is a linear equation, whose solution needs two integrals:

    y = G (y_0 + int (f - J y)/G dphi),   G = exp(int J dphi),

both of the polynomial through their values at the points. At the end of the interval the order is
twice the number of points; between, the polynomial through the rates gives the solution anywhere.

Sources
-------
Hairer and Wanner, Solving Ordinary Differential Equations II, Springer 1996, ch. IV.5: collocation
at Gauss's points. Kantorovich and Akilov, Functional Analysis, Pergamon 1982, ch. XVIII: Newton's
method for differential equations.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from engine_dyn.compilation import formula
from engine_dyn.types import Floats

POINTS = 12  # Collocation points of an interval


def _matrices() -> tuple[Floats, Floats, Floats, Floats]:
    """Points on [0, 1], integrals up to them and to 1, and the polynomial's coefficients.

    The coefficients are of powers of x = 2 t - 1. A row of each matrix belongs to the rate at a
    point.
    """
    points, _ = np.polynomial.legendre.leggauss(POINTS)
    powers = np.arange(POINTS)
    coefficients = np.linalg.inv(points[:, None] ** powers)
    ends = np.append(points, 1.0)
    to_end = (ends[:, None] ** (powers + 1) - (-1.0) ** (powers + 1)) / (powers + 1)
    integrals = 0.5 * (to_end @ coefficients)
    return (
        0.5 * (points + 1.0), np.ascontiguousarray(integrals[:-1].T), integrals[-1].copy(),
        np.ascontiguousarray(coefficients.T),
    )  # fmt: skip


PLACES, INTEGRALS, WEIGHTS, COEFFICIENTS = _matrices()
"""Collocation points of an interval; weights of integrals up to each and over all; coefficients."""


# Largest |x| for which `short_exp` serves, the sixteenth power of the series of exp(x/16): the
# compiler vectorises it, but not calls of the library's function.
SHORT = 6.0


@formula
def short_exp(x: float) -> float:
    """exp(x) for |x| <= SHORT, to a few roundings."""
    t = 0.0625 * x
    total = 1.0 + t / 12.0
    for i in range(11, 0, -1):
        total = 1.0 + t / i * total
    total *= total
    total *= total
    total *= total
    return total * total


@formula
def short_turn(t: float) -> tuple[float, float]:
    """Sine and cosine of an angle up to 0.3 rad."""
    square = t * t
    sine, cosine = 1.0, 1.0
    for i in range(6, 0, -1):
        sine = 1.0 - square / (2.0 * i * (2.0 * i + 1.0)) * sine
        cosine = 1.0 - square / (2.0 * i * (2.0 * i - 1.0)) * cosine
    return t * sine, cosine


class Solution(NamedTuple):
    """Values of one solution at the points of an interval, its rates and their derivatives J.

    `coefficients` are those of the polynomial through the rates; the other two are scratch.
    """

    values: Floats
    rates: Floats
    slopes: Floats
    coefficients: Floats
    growth: Floats
    sums: Floats


@formula
def improve(solution: Solution, start: float, width: float) -> tuple[float, float]:
    """Take one step of Newton's method; value at the end of the interval, and largest change.

    `rates` and `slopes` are those of `values`; afterwards all three hold for the new values, as
    far as the equation is linear.
    """
    values, rates, slopes = solution.values, solution.rates, solution.slopes
    growth, sums = solution.growth, solution.sums
    for i in range(POINTS):
        sums[i] = 0.0
    whole = 0.0
    for j in range(POINTS):
        slope = width * slopes[j]
        whole += WEIGHTS[j] * slope
        for i in range(POINTS):
            sums[i] += INTEGRALS[j, i] * slope
    far = 0.0
    for i in range(POINTS):
        far = max(far, abs(sums[i]))
    if far <= SHORT:
        for i in range(POINTS):
            growth[i] = short_exp(sums[i])
    else:
        for i in range(POINTS):
            growth[i] = math.exp(sums[i])
    for i in range(POINTS):
        sums[i] = start
    end = start
    for j in range(POINTS):
        rest = width * (rates[j] - slopes[j] * values[j]) / growth[j]
        end += WEIGHTS[j] * rest
        for i in range(POINTS):
            sums[i] += INTEGRALS[j, i] * rest
    change = 0.0
    for i in range(POINTS):
        better = growth[i] * sums[i]
        difference = better - values[i]
        change = max(change, abs(difference))
        rates[i] += slopes[i] * difference
        values[i] = better
    return math.exp(whole) * end, change


@formula
def guess(solution: Solution, start: float, rate: float, width: float) -> None:
    """First values: a straight line."""
    for i in range(POINTS):
        solution.values[i] = start + rate * width * PLACES[i]


@formula
def fit(solution: Solution, start: float, width: float) -> float:
    """Fit the polynomial through the rates; what the curve is in the middle of the interval."""
    found, rates = solution.coefficients, solution.rates
    for i in range(POINTS):
        found[i] = 0.0
    for j in range(POINTS):
        for i in range(POINTS):
            found[i] += COEFFICIENTS[j, i] * rates[j]
    rise, sign = 0.0, 1.0
    for i in range(POINTS):
        rise += sign * found[i] / (i + 1.0)
        sign = -sign
    return start + 0.5 * width * rise


@formula
def curve_at(solution: Solution, middle: float, width: float, x: float) -> tuple[float, float]:
    """Value and rate at x, from -1 to 1 over the interval; `middle` is what `fit` found."""
    found = solution.coefficients
    rate, rise = found[POINTS - 1], found[POINTS - 1] / POINTS
    for i in range(POINTS - 2, -1, -1):
        rate = rate * x + found[i]
        rise = rise * x + found[i] / (i + 1.0)
    return middle + 0.5 * width * rise * x, rate
