"""Extremes of a periodic curve known by value and slope at nodes.

The largest sample is off by O(h^2). A cubic Hermite interpolant through value and slope leaves
O(h^4), and the known value in the middle of the interval one order more; what the middle adds is at
the same time a measure of the interpolation error.
"""

from __future__ import annotations

import math

from engine_dyn.compilation import formula

__all__ = ["interpolate", "refine", "slope_between"]


@formula
def interpolate(t: float, left: float, right: float, d_left: float, d_right: float) -> float:
    """Cubic Hermite value at t in [0, 1]; slopes are times the interval's width."""
    rise = right - left
    b = 3.0 * rise - 2.0 * d_left - d_right
    a = d_left + d_right - 2.0 * rise
    return left + t * (d_left + t * (b + t * a))


@formula
def slope_between(t: float, left: float, right: float, d_left: float, d_right: float) -> float:
    """Slope of the cubic Hermite interpolant at t, times the interval's width."""
    rise = right - left
    b = 3.0 * rise - 2.0 * d_left - d_right
    a = d_left + d_right - 2.0 * rise
    return d_left + t * (2.0 * b + 3.0 * t * a)


@formula
def refine(
    left: float, right: float, d_left: float, d_right: float, middle: float
) -> tuple[float, float, float]:
    """Extreme of a curve within one interval at whose ends its slope changes sign.

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
        The extreme, its place t in [0, 1], and what the middle added to it.
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
