"""The largest value of a curve between its samples."""

from __future__ import annotations

from typing import Any

import numpy as np

__all__ = ["largest_of_cycle"]


def largest_of_cycle(curve: Any) -> Any:
    """Largest value of curves whose points are equal steps of one cycle, along the last axis.

    A parabola through the largest point and its neighbours refines it.

    Examples
    --------
    >>> angle = np.arange(0.0, 2.0 * np.pi, np.pi / 180.0)
    >>> round(float(largest_of_cycle(np.cos(angle - 0.1234))), 7)
    1.0
    """
    values = np.asarray(curve, dtype=float)
    top = np.argmax(values, axis=-1)[..., None]
    before, here, after = (
        np.take_along_axis(values, (top + step) % values.shape[-1], axis=-1)[..., 0]
        for step in (-1, 0, 1)
    )
    bend = before - 2.0 * here + after
    with np.errstate(invalid="ignore", divide="ignore"):
        rise = np.square(before - after) / (8.0 * bend)
    return here - np.where(bend < 0.0, rise, 0.0)
