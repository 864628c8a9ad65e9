"""Cubic pieces of curves that are tabulated by values and slopes at points.

Tables of loads over angle, and of loads and drivers over speed, are such curves.
"""

from __future__ import annotations

from engine_dyn.compilation import inlined
from engine_dyn.types import Floats

__all__ = ["piece_at"]


@inlined
def piece_at(
    place: float, points: Floats, values: Floats, slopes: Floats
) -> tuple[int, float, float, float, float, float, float]:
    """Number and width of the piece, t in [0, 1] within it, and its cubic's coefficients.

    docs/method.md (43). The value is y + t (m + t (c + t d)), from the constant y to d of t^3.
    """
    low, high = 0, len(points) - 1
    while high - low > 1:
        middle = (low + high) // 2
        if points[middle] <= place:
            low = middle
        else:
            high = middle
    step = points[high] - points[low]
    t = (place - points[low]) / step
    y0, m0, m1 = values[low], step * slopes[low], step * slopes[high]
    c = 3.0 * (values[high] - y0) - 2.0 * m0 - m1
    d = -2.0 * (values[high] - y0) + m0 + m1
    return low, step, t, y0, m0, c, d
