"""Integrals of pressure times velocity over the intervals of a period: the kernel of columns."""

from __future__ import annotations

import math

import numpy as np

from engine_dyn.compilation import kernel
from engine_dyn.speed.work.interpolation import BEFORE, MEAN_BY_PAIRS, STENCIL
from engine_dyn.types import Floats

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


@kernel
def cumulate(sums: Floats, halves: Floats, rates: Floats, width: float) -> Floats:
    """Turn mean torques of intervals into the work at nodes and between, docs/method.md (50).

    All are (part, term, node): `sums` has the mean torque of each interval, and gets the work at
    the node before it, without its mean; `halves` has what the first half of each adds to that, and
    gets the work in its middle; `rates` has the torque at the nodes, and loses its mean, which is
    returned, (part, term). `width` is that of an interval [rad].
    """
    parts, terms, nodes = sums.shape
    mean = np.empty((parts, terms))
    for part in range(parts):
        for term in range(terms):
            work, half, rate = sums[part, term], halves[part, term], rates[part, term]
            level = 0.0
            for i in range(nodes):
                level += work[i] / nodes
            done = total = 0.0
            for i in range(nodes):
                rise = work[i] - level
                work[i], half[i] = done, done + (half[i] - 0.5 * level) * width
                rate[i] -= level
                done += rise * width
                # Simpson's rule, as for the means over coarse intervals.
                total += (work[i] + 2.0 * half[i]) / (3.0 * nodes)
            for i in range(nodes):
                work[i] -= total
                half[i] -= total
            mean[part, term] = level
    return mean


@kernel
def arrange(
    work: Floats, halves: Floats, rates: Floats, width: float, weights: Floats, fine: Floats,
    coarse: Floats,
) -> None:  # fmt: skip
    """Put the work in the order in which solvers read it, `fine` and `coarse` of `columns.Columns`.

    What is missed of the middles is docs/solver.md (60), of the integral of the work (63), and of
    its mean over a coarse interval (72). `width` is that of an interval [rad]; `weights` are those
    of `weights_between`.
    """
    parts, terms, nodes = work.shape
    stride, wide = weights.shape[0], nodes // weights.shape[0]
    integral, missed = np.empty(nodes + 1), np.empty(wide)
    # Integral and work at the coarse nodes, with half a stencil more at both ends.
    sparse, around = np.empty(wide + STENCIL), np.empty(wide + STENCIL)
    for part in range(parts):
        for term in range(terms):
            y, half, slope = work[part, term], halves[part, term], rates[part, term]
            total = 0.0
            for i in range(nodes):
                after = i + 1 if i + 1 < nodes else 0
                cubic = 0.5 * (y[i] + y[after]) + 0.125 * width * (slope[i] - slope[after])
                fine[part, i, 0, term], fine[part, i, 1, term] = y[i], slope[i]
                fine[part, i, 2, term], integral[i] = half[i] - cubic, total
                total += (y[i] + 4.0 * half[i] + y[after]) / 6.0  # exact for cubics
            integral[nodes] = total  # nearly 0: the work has no mean
            for c in range(wide + STENCIL):
                turn = (c - BEFORE + wide) // wide - 1
                node = (c - BEFORE - turn * wide) * stride
                sparse[c], around[c] = integral[node] + turn * total, y[node]
            # All intervals beside each other: that is twice as fast as one after the other.
            for place in range(stride):
                for c in range(wide):
                    missed[c] = integral[c * stride + place]
                for m in range(STENCIL):
                    for c in range(wide):
                        missed[c] -= weights[place, m] * sparse[c + m]
                for c in range(wide):
                    fine[part, c * stride + place, 3, term] = width * missed[c]
            for c in range(wide):
                at = c + BEFORE
                mean = (sparse[at + 1] - sparse[at]) / stride
                for m in range(len(MEAN_BY_PAIRS)):
                    mean -= MEAN_BY_PAIRS[m] * (around[at - m] + around[at + 1 + m])
                coarse[part, c, 0, term], coarse[part, c, 1, term] = around[at], mean
