"""Powers of q = 1 + u as series, docs/method.md (102) to (105)."""

from __future__ import annotations

from engine_dyn.compilation import formula, inlined, wide_vectors
from engine_dyn.speed.batch.state import LANES, LAW_SLOPE
from engine_dyn.types import Floats

__all__ = [
    "DEEPEST",
    "HIGHEST",
    "SERIES_RANGE",
    "SERIES_ROWS",
    "SERIES_TERMS",
    "exp_of",
    "fill_series",
    "finite",
    "inverses",
    "log_of",
    "loss_of",
    "power_remainder",
    "power_slope",
    "root_remainder",
    "root_slope",
]

SERIES_TERMS = 11

SERIES_ROWS = SERIES_TERMS * LANES
"""Memory for the coefficients of q^a from u^2 on."""

SERIES_RANGE = 0.2
"""Largest u of a design whose powers are series in u, cheaper than roots and logarithms. Designs
decide each for themselves: neighbours must not count."""

DEEPEST, HIGHEST = -0.5, 1.0
"""Range of u in which the series of the logarithm has converged."""


@formula
def loss_of(x: float) -> float:
    """1 - exp(-x) for x up to 0.1, to rounding, without the library's call."""
    return x * (1.0 - x / 2.0 * (1.0 - x / 3.0 * (1.0 - x / 4.0 * (1.0 - x / 5.0 * (
        1.0 - x / 6.0 * (1.0 - x / 7.0 * (1.0 - x / 8.0)))))))  # fmt: skip


@formula
def log_of(u: float) -> float:
    """log(1 + u) for u from -0.5 to 1, to 2e-13: the series of the inverse tangent."""
    state = u / (2.0 + u)
    t = state * state
    return 2.0 * state * (1.0 + t * (1.0 / 3.0 + t * (1.0 / 5.0 + t * (1.0 / 7.0 + t * (1.0 / 9.0
        + t * (1.0 / 11.0 + t * (1.0 / 13.0 + t * (1.0 / 15.0 + t * (1.0 / 17.0 + t * (
            1.0 / 19.0 + t * (1.0 / 21.0 + t / 23.0)))))))))))  # fmt: skip


@formula
def root_remainder(u: float) -> float:
    """sqrt(1 + u) - 1 - u/2 for |u| up to SERIES_RANGE, to 2e-10."""
    t = -0.013766597627549452
    t = 0.016906002491926194 + u * t
    t = -0.020494166543278344 + u * t
    t = 0.027327718813054118 + u * t
    t = -0.03906256848919286 + u * t
    t = 0.06250008045206959 + u * t
    t = -0.125 + u * t
    return u * u * t


@formula
def exp_of(x: float) -> float:
    """exp(x) for x from -8 to 8: the series of a thirty-second, squared five times."""
    y = x / 32.0
    e = 1.0 + y * (1.0 + y / 2.0 * (1.0 + y / 3.0 * (1.0 + y / 4.0 * (1.0 + y / 5.0 * (
        1.0 + y / 6.0 * (1.0 + y / 7.0 * (1.0 + y / 8.0 * (1.0 + y / 9.0))))))))  # fmt: skip
    e *= e
    e *= e
    e *= e
    e *= e
    return e * e


@formula
def inverses(a: float, b: float, c: float, d: float) -> tuple[float, float, float, float]:
    """One division for four: the inverse of each is that of all times the other three."""
    first, second = a * b, c * d
    inverse = 1.0 / (first * second)
    after, before = inverse * second, inverse * first
    return after * b, after * a, before * d, before * c


@inlined
def fill_series(lanes: int, state: Floats, series: Floats) -> None:
    """Binomial coefficients of q^a from u^2 on."""
    wide_vectors()
    for k in range(lanes):
        series[k] = 0.5 * state[LAW_SLOPE + k] * (state[LAW_SLOPE + k] - 1.0)
    for i in range(1, SERIES_TERMS):
        here = series[i * LANES : (i + 1) * LANES]
        before = series[(i - 1) * LANES : i * LANES]
        for k in range(lanes):
            here[k] = before[k] * (state[LAW_SLOPE + k] - (i + 1.0)) / (i + 2.0)


@formula
def power_remainder(u: float, k: int, series: Floats) -> float:
    """(1 + u)^a - 1 - a u for |u| up to SERIES_RANGE, to 1e-11, from its coefficients."""
    total = series[10 * LANES + k]
    total = series[9 * LANES + k] + u * total
    total = series[8 * LANES + k] + u * total
    total = series[7 * LANES + k] + u * total
    total = series[6 * LANES + k] + u * total
    total = series[5 * LANES + k] + u * total
    total = series[4 * LANES + k] + u * total
    total = series[3 * LANES + k] + u * total
    total = series[2 * LANES + k] + u * total
    total = series[LANES + k] + u * total
    return u * u * (series[k] + u * total)


@formula
def power_slope(u: float, half: float, turning: float, k: int, series: Floats) -> float:
    """Slope a (q^(a-1) - tau) of the remainder, from the first coefficients of `power_remainder`.

    `turning` is tau - 1. For |u| up to SERIES_RANGE, to some 1e-5: its steps are small.
    """
    total = 5.0 * series[3 * LANES + k] + u * (6.0 * series[4 * LANES + k])
    total = 4.0 * series[2 * LANES + k] + u * total
    total = 3.0 * series[LANES + k] + u * total
    return u * (2.0 * series[k] + u * total) - half * turning


@formula
def root_slope(u: float, turning: float) -> float:
    """`power_slope` of the square root, by a polynomial through Chebyshev's points."""
    total = -0.1613230995497165 + u * 0.14137230040045798
    total = 0.1874766304172176 + u * total
    return u * (-0.24997452593493807 + u * total) - 0.5 * turning


@formula
def finite(x: float) -> float:
    """Return x, or some finite number where memory holds what a deferred design wrote there.

    Times zero that is nothing, for the design that has the lane next.
    """
    return min(1e300, max(-1e300, x))
