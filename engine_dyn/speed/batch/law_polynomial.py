"""A polynomial that stands for the law of a design in the range of its speeds.

The law is asked at Chebyshev points only, whatever law it is; the passes of a block then evaluate
polynomials, which are vectors over its designs. docs/solver.md (76).
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from engine_dyn.compilation import inlined
from engine_dyn.loads.laws import Law, load_terms
from engine_dyn.speed.batch.block import MOST_TERMS
from engine_dyn.speed.methods import CYCLE_TIME
from engine_dyn.types import Floats

__all__ = ["fit_law"]

SIZES = (8, 12, MOST_TERMS)
"""Numbers of terms that are tried."""

MARGIN = 0.3
"""Part of the range of u by which the range of the polynomial is wider on both sides."""

NARROWEST = 0.01
"""Least half-width of that range."""

SLOWEST = 0.04
"""Least q of that range: slower designs are left to the general solver."""

WITHIN = 1e-10
"""Largest of the last coefficients, over the range of the law."""


def _tables() -> tuple[Floats, Floats]:
    """Points, and matrices from values there to coefficients of powers."""
    points = np.zeros((len(SIZES), MOST_TERMS))
    powers = np.zeros((len(SIZES), MOST_TERMS, MOST_TERMS))
    for i, size in enumerate(SIZES):
        angle = (np.arange(size) + 0.5) * np.pi / size
        points[i, :size] = np.cos(angle)
        matrix = 2.0 / size * np.cos(np.outer(np.arange(size), angle))
        matrix[0] *= 0.5
        for column in range(size):
            found = np.polynomial.chebyshev.cheb2poly(matrix[:, column])
            powers[i, : len(found), column] = found
    return points, powers


_POINTS, _POWERS = _tables()


@inlined
def closing_function(q: float, closure: int) -> float:
    """What closes a design whose law does not depend on the speed, with the slope 1 at q = 1.

    docs/method.md (65) and (66).
    """
    if closure == CYCLE_TIME:
        return 2.0 - 2.0 / math.sqrt(q)
    return math.log(q)


@inlined
def fit_law(
    law: Law, flat: bool, closure: int, low: float, high: float, lane: int, terms: Any,
    values: Floats,
) -> tuple[int, float, float]:  # fmt: skip
    """Polynomial for F - 1 over u from `low` to `high`, and somewhat beyond.

    `terms` (power, lane) gets its coefficients over (u - centre) half. Where the law is `flat`, it
    is that of the closure. Returns how many there are, 0 where no polynomial is good enough, the
    centre and 1 over the half-width of the range. `values` is scratch.
    """
    centre = 0.5 * (low + high)
    half = max((0.5 + MARGIN) * (high - low), NARROWEST)
    if not (1.0 + centre - half > SLOWEST):
        return 0, 0.0, 1.0
    for n in range(MOST_TERMS):
        terms[n, lane] = 0.0
    for i in range(len(SIZES)):
        size = SIZES[i]
        least, most = math.inf, -math.inf
        for m in range(size):
            q = 1.0 + centre + half * _POINTS[i, m]
            values[m] = closing_function(q, closure) if flat else load_terms(q, law)[0] - 1.0
            least, most = min(least, values[m]), max(most, values[m])
        for n in range(size):
            total = 0.0
            for m in range(size):
                total += _POWERS[i, n, m] * values[m]
            terms[n, lane] = total
        # T_n begins with 2^(n - 1) x^n: so much smaller are the last two Chebyshev coefficients.
        missed = abs(terms[size - 1, lane]) + 2.0 * abs(terms[size - 2, lane])
        if missed * 0.5 ** (size - 2) <= WITHIN * (most - least):
            return size, centre, 1.0 / half
    return 0, 0.0, 1.0
