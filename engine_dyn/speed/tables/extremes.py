"""Extremes of a periodic curve that is known by its value and slope at nodes.

The error of the largest sample is O(h^2). A cubic Hermite interpolant through values and slopes has
the error O(h^4), and the known value in the middle of the interval improves it by one order. The
correction by the middle is at the same time a measure of the interpolation error.
docs/method.md chapter 12.
"""

from __future__ import annotations

import math

from engine_dyn.compilation import formula

__all__ = ["interpolate", "refine", "slope_between"]


@formula
def interpolate(t: float, left: float, right: float, d_left: float, d_right: float) -> float:
    """Value at t in [0, 1] of the cubic of docs/method.md (37); slopes are times the width."""
    rise = right - left
    b = 3.0 * rise - 2.0 * d_left - d_right
    a = d_left + d_right - 2.0 * rise
    return left + t * (d_left + t * (b + t * a))


@formula
def slope_between(t: float, left: float, right: float, d_left: float, d_right: float) -> float:
    """Slope of the cubic of docs/method.md (37) at t, times the interval's width."""
    rise = right - left
    b = 3.0 * rise - 2.0 * d_left - d_right
    a = d_left + d_right - 2.0 * rise
    return d_left + t * (2.0 * b + 3.0 * t * a)


@formula
def refine(
    left: float, right: float, d_left: float, d_right: float, middle: float
) -> tuple[float, float, float]:
    """Extreme of a curve within one interval at whose ends its slope changes sign.

    docs/method.md (90) is its place, (91) its value.

    Parameters
    ----------
    left, right : float
        Values at the ends.
    d_left, d_right : float
        Slopes times the interval's width.
    middle : float
        True value in the middle less the cubic's.

    Returns
    -------
    tuple of float
        The extreme, its place t in [0, 1], and the correction by the middle in it.
    """
    rise = right - left
    b = 3.0 * rise - 2.0 * d_left - d_right
    a = d_left + d_right - 2.0 * rise
    root = math.sqrt(max(b * b - 3.0 * a * d_left, 0.0))
    # d_left > 0 is a maximum, where the second derivative 2b + 6at is negative at the root.
    below = b - root if d_left > 0.0 else b + root
    t = -d_left / below if below != 0.0 else 0.0
    t = min(max(t, 0.0), 1.0)
    bump = 16.0 * t * t * (1.0 - t) * (1.0 - t) * middle
    return left + t * (d_left + t * (b + t * a)) + bump, t, bump
