"""Integrals of pressure times velocity over the intervals of a period: the kernel of columns."""

from __future__ import annotations

import math

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from engine_dyn.compilation import kernel
from engine_dyn.speed.work.interpolation import MEAN_BY_PAIRS, STENCIL, weights_between
from engine_dyn.types import Floats

__all__ = ["POINTS", "WEIGHTS", "add_products", "arranged", "cumulate"]

_GAUSS = 0.5 + np.array([-1.0, 0.0, 1.0]) * math.sqrt(0.15)
POINTS = np.concatenate([0.5 * _GAUSS, 0.5 + 0.5 * _GAUSS])
WEIGHTS = np.tile([5.0, 8.0, 5.0], 2) / 36.0
"""Quadrature of an interval of width 1, docs/solver.md (56): Gauss's three points on each half."""


@kernel
def add_products(
    pressure: Floats, begin: int, velocity: Floats, weights: Floats, total: Floats
) -> None:
    """Add weight times pressure times velocity at the points of every interval, folded.

    `pressure` (row, point) from `begin` on and `velocity` (term, point) have the first point of all
    intervals of the cycle, then the second one, and so on; `total` is (row, term, node). The cycle
    is folded at the period of so many intervals as there are nodes.
    """
    rows, terms, nodes = total.shape
    steps = velocity.shape[1] // weights.size
    for row in range(rows):
        for term in range(terms):
            sums = total[row, term]
            for point in range(weights.size):
                weight = weights[point]
                for first in range(point * steps, (point + 1) * steps, nodes):
                    here = pressure[row, begin + first : begin + first + nodes]
                    speed = velocity[term, first : first + nodes]
                    for i in range(nodes):
                        sums[i] += weight * here[i] * speed[i]


def cumulate(sums: Floats, halves: Floats, rates: Floats, width: float) -> Floats:
    """Turn mean torques of intervals into the work at nodes and between, docs/method.md (50).

    All are (part, term, node): `sums` has the mean torque of each interval, and gets the work at
    the node before it, without its mean; `halves` has what the first half of each adds to that, and
    gets the work in its middle; `rates` has the torque at the nodes, and loses its mean, which is
    returned, (part, term). `width` is that of an interval [rad].
    """
    level = sums.mean(axis=-1, keepdims=True)
    after = np.cumsum(width * (sums - level), axis=-1)
    sums[..., 0], sums[..., 1:] = 0.0, after[..., :-1]
    halves[:] = sums + width * (halves - 0.5 * level)
    # Simpson's rule, as for the means over coarse intervals.
    total = (sums + 2.0 * halves).mean(axis=-1, keepdims=True) / 3.0
    sums -= total
    halves -= total
    rates -= level
    return np.asarray(level[..., 0])


def arranged(
    work: Floats, halves: Floats, rates: Floats, width: float, stride: int
) -> tuple[Floats, Floats]:
    """Work in the order in which solvers read it: `fine` and `coarse` of `columns.Columns`.

    What is missed of the middles is docs/solver.md (60), of the integral of the work (63), and of
    its mean over a coarse interval (72). `width` is that of an interval [rad].
    """
    after = np.roll(work, -1, axis=-1)
    cubic = 0.5 * (work + after) + 0.125 * width * (rates - np.roll(rates, -1, axis=-1))
    mean = (work + 4.0 * halves + after) / 6.0  # Simpson's rule is exact for cubics
    integral, until = np.zeros_like(mean), np.cumsum(mean, axis=-1)
    integral[..., 1:], total = until[..., :-1], until[..., -1:]
    before = STENCIL // 2 - 1
    known = integral[..., ::stride]
    # `total` is nearly 0: the work has no mean.
    ends = known[..., -before:] - total, known[..., : STENCIL - 1 - before] + total
    known = np.concatenate([ends[0], known, ends[1]], axis=-1)
    smooth = sliding_window_view(known, STENCIL, axis=-1) @ weights_between(stride).T
    missed = width * (integral - smooth.reshape(integral.shape))
    coarse = work[..., ::stride]
    mean = mean.reshape(*coarse.shape, stride).mean(axis=-1)
    for m, weight in enumerate(MEAN_BY_PAIRS):
        mean -= weight * (np.roll(coarse, m, axis=-1) + np.roll(coarse, -1 - m, axis=-1))
    fine, wide = (
        np.ascontiguousarray(np.stack(curves, axis=1).transpose(0, 3, 1, 2))
        for curves in ([work, rates, halves - cubic, missed], [coarse, mean])
    )
    return fine, wide
