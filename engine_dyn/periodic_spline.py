"""Cubics through tabulated points: periodic splines over angle, monotone ones over speed."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from engine_dyn.types import Floats


def periodic_spline_slopes(angle: Floats, values: Floats, period: float) -> Floats:
    """Slopes at the knots of the periodic cubic spline through given points.

    Continuity of the second derivative at knot i, with h_i the step after it and d_i the divided
    difference over that step, reads

        h_i s_(i-1) + 2 (h_(i-1) + h_i) s_i + h_(i-1) s_(i+1) = 3 (h_i d_(i-1) + h_(i-1) d_i),

    a cyclic tridiagonal system (de Boor, A Practical Guide to Splines, Springer 2001, ch. IV),
    solved by elimination with the corner entries taken out as a rank-one change (Sherman and
    Morrison 1950). It is diagonally dominant, so no pivoting is needed.

    Parameters
    ----------
    angle : ndarray, shape (K,)
        Strictly ascending knots [rad] within one period, its end not repeated. K >= 3.
    values : ndarray, shape (K,)
        Values at the knots, any unit.
    period : float
        Period [rad].

    Returns
    -------
    ndarray, shape (K,)
        Slope at each knot, unit of `values` per radian.
    """
    count = len(angle)
    step = np.diff(angle, append=angle[0] + period)
    divided = np.diff(values, append=values[0]) / step
    before = np.roll(step, 1)  # the system has `step` below its diagonal and `before` above it
    diagonal = 2.0 * (before + step)
    right = 3.0 * (step * np.roll(divided, 1) + before * divided)
    # The cyclic matrix is T + u w^T, with T tridiagonal, u = (gamma, 0, .., 0, upper_last) and
    # w = (1, 0, .., 0, lower_first / gamma).
    gamma = -diagonal[0]
    diagonal[0] -= gamma
    diagonal[-1] -= before[-1] * step[0] / gamma
    low, dia, upp = step.tolist(), diagonal.tolist(), before.tolist()
    first = right.tolist()
    second = [0.0] * count
    second[0] = float(gamma)
    second[-1] = upp[-1]
    for i in range(1, count):
        factor = low[i] / dia[i - 1]
        dia[i] -= factor * upp[i - 1]
        first[i] -= factor * first[i - 1]
        second[i] -= factor * second[i - 1]
    first[-1] /= dia[-1]
    second[-1] /= dia[-1]
    for i in range(count - 2, -1, -1):
        first[i] = (first[i] - upp[i] * first[i + 1]) / dia[i]
        second[i] = (second[i] - upp[i] * second[i + 1]) / dia[i]
    corner = float(step[0] / gamma)
    correction = (first[0] + corner * first[-1]) / (1.0 + second[0] + corner * second[-1])
    return np.asarray(first) - correction * np.asarray(second)


def wrapped(phi: ArrayLike, period: float) -> Floats:
    """Bring angles into -period/2 <= phi < period/2; those already there stay as they are."""
    value = np.asarray(phi, dtype=np.float64)
    return value - period * np.floor(value / period + 0.5)


def monotone_slopes(x: Floats, y: Floats) -> Floats:
    """Slopes of the monotone piecewise cubic through some points: docs/method.md (44)."""
    step = np.diff(x)
    rise = np.diff(y) / step
    if len(x) == 2:
        return np.repeat(rise, 2)
    slope = np.zeros_like(y)
    before, after = step[:-1], step[1:]
    left, right = rise[:-1], rise[1:]
    same = left * right > 0.0
    w1, w2 = 2.0 * after + before, after + 2.0 * before
    with np.errstate(divide="ignore", invalid="ignore"):
        slope[1:-1] = np.where(same, (w1 + w2) / (w1 / left + w2 / right), 0.0)
    for end, (h0, h1, d0, d1) in (
        (0, (step[0], step[1], rise[0], rise[1])),
        (-1, (step[-1], step[-2], rise[-1], rise[-2])),
    ):
        # One-sided slope through three points, limited so that the curve does not turn (Moler,
        # Numerical Computing, chapter 3).
        value = ((2.0 * h0 + h1) * d0 - h0 * d1) / (h0 + h1)
        if value * d0 <= 0.0:
            value = 0.0
        elif d0 * d1 <= 0.0 and abs(value) > 3.0 * abs(d0):
            value = 3.0 * d0
        slope[end] = value
    return slope
