"""Curves that are known at nodes: weights of polynomials between them, and their maxima."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import Any

import numpy as np

from engine_dyn.compilation import inlined
from engine_dyn.speed.vectors import where
from engine_dyn.types import Floats

MEAN_BY_PAIRS = (802.0 / 1440.0, -93.0 / 1440.0, 11.0 / 1440.0)
"""Weights of pairs of nodes around an interval, from the inner pair on, in the mean over it."""

STENCIL = 8
"""Number of nodes of the interpolating polynomial: three before the interval, three behind it."""

BEFORE = STENCIL // 2 - 1  # Number of the polynomial's nodes before the interval


def lagrange_weights(t: Floats) -> Floats:
    """Weights of the nodes -3..4 of a polynomial at the fractions t, shape (fraction, STENCIL)."""
    nodes = np.arange(STENCIL) - BEFORE
    return np.stack(
        [np.prod([(t - m) / (node - m) for m in nodes if m != node], axis=0) for node in nodes],
        axis=1,
    )


@lru_cache(maxsize=32)
def weights_between(parts: int) -> Floats:
    """Weights of the nodes at so many equal parts of an interval, shape (part, STENCIL)."""
    return lagrange_weights(np.arange(parts) / parts)


@inlined
def largest(sign: float, curve: Floats) -> float:
    """Largest sign * value; NumPy's own function takes half a second to compile."""
    found = -math.inf
    for j in range(len(curve)):
        found = max(found, sign * curve[j])
    return found


@inlined
def max_near(b: Any, c: Any, d: Any, e: Any, f: Any) -> Any:
    """Place of the maximum near the middle of five equidistant values, counted from d.

    That of the polynomial of fourth degree (Stirling), by three of Newton's steps. It is a guess.
    """
    d1 = 0.5 * (e - c)
    d2 = e - 2.0 * d + c
    d3 = 0.5 * (f - b) - (e - c)
    d4 = f - 4.0 * e + 6.0 * d - 4.0 * c + b
    t = 0.0 * d
    for _ in range(3):
        slope = d1 + t * d2 + (3.0 * t * t - 1.0) / 6.0 * d3 + (2.0 * t * t - 1.0) / 12.0 * t * d4
        bend = d2 + t * d3 + (6.0 * t * t - 1.0) / 12.0 * d4
        t = where(bend < 0.0, t - slope / bend, 0.0)
        t = np.minimum(1.0, np.maximum(-1.0, t))
    return t


@inlined
def cubic_in_middle(left: Any, right: Any, d_left: Any, d_right: Any) -> Any:
    """Cubic Hermite interpolant in the middle of an interval, docs/solver.md (60)."""
    return 0.5 * (left + right) + 0.125 * (d_left - d_right)


@inlined
def max_between(left: Any, right: Any, d_left: Any, d_right: Any, middle: Any) -> tuple[Any, Any]:
    """Maximum of a curve within an interval that rises at its begin and falls at its end.

    docs/solver.md (98) is its place, (99) its value. Given are, as numbers or vectors, the values
    at the ends, the slopes times the width, and the true value in the middle less the cubic's.
    Returns the maximum, and the correction by the middle in it.
    """
    rise = right - left
    b = 3.0 * rise - 2.0 * d_left - d_right
    a = d_left + d_right - 2.0 * rise
    below = b - np.sqrt(np.maximum(b * b - 3.0 * a * d_left, 0.0))
    t = where(np.abs(below) > 0.0, (0.0 - d_left) / below, 0.0)
    t = np.minimum(np.maximum(t, 0.0), 1.0)
    bump = 16.0 * t * t * (1.0 - t) * (1.0 - t) * middle
    return left + t * (d_left + t * (b + t * a)) + bump, bump
