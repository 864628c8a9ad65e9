"""Integrals of pressure times velocity over the intervals of a period: the kernel of columns."""

from __future__ import annotations

import math

import numpy as np

from engine_dyn.compilation import inlined, kernel
from engine_dyn.speed.work.interpolation import MEAN_BY_PAIRS
from engine_dyn.types import Floats

__all__ = ["POINTS", "WEIGHTS", "add_products", "arrange", "cumulate"]

_GAUSS = 0.5 + np.array([-1.0, 0.0, 1.0]) * math.sqrt(0.15)
POINTS = np.concatenate([0.5 * _GAUSS, 0.5 + 0.5 * _GAUSS])
WEIGHTS = np.tile([5.0, 8.0, 5.0], 2) / 36.0
"""Quadrature of an interval of width 1, docs/method.md (56): Gauss's three points on each half."""


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
def cumulate(sums: Floats, halves: Floats, rates: Floats, width: float, mean: Floats) -> None:
    """Turn mean torques of intervals into the work at nodes and between, docs/method.md (50).

    All are (part, term, node): `sums` has the mean torque of each interval, and gets the work at
    the node before it, without its mean; `halves` has what the first half of each adds to that, and
    gets the work in its middle; `rates` has the torque at the nodes, and loses its mean, which
    `mean` (part, term) gets. `width` is that of an interval [rad].
    """
    parts, terms, nodes = sums.shape
    for part in range(parts):
        for term in range(terms):
            work, half, rate = sums[part, term], halves[part, term], rates[part, term]
            level = 0.0
            for i in range(nodes):
                level += work[i]
            level /= nodes
            mean[part, term] = level
            here = total = 0.0
            for i in range(nodes):
                half[i] = here + width * (half[i] - 0.5 * level)
                after = here + width * (work[i] - level)
                work[i] = here
                # Simpson's rule, as for the means over coarse intervals.
                total += (here + 2.0 * half[i]) / 3.0
                here = after
            total /= nodes
            for i in range(nodes):
                work[i] -= total
                half[i] -= total
                rate[i] -= level


@inlined
def simpson(i: int, work: Floats, half: Floats) -> float:
    """Mean of the work over an interval by Simpson's rule, which is exact for cubics."""
    n = i + 1 if i + 1 < work.size else 0
    return (work[i] + 4.0 * half[i] + work[n]) / 6.0


@kernel
def arrange(
    work: Floats, halves: Floats, rates: Floats, width: float, fine: Floats, weights: Floats,
    coarse: Floats, integral: Floats,
) -> None:  # fmt: skip
    """Put what `cumulate` gives into the order in which solvers read it: `fine`, `coarse`.

    Their shapes and meanings are those of `columns.Columns`; what is missed of the middles is
    docs/method.md (60), of the integral of the work (63), and of its mean (72). `weights` (node,
    coarse node) are of the polynomial through coarse nodes, `integral` (coarse nodes and a stencil)
    is scratch, `width` that of an interval [rad].
    """
    parts, terms, nodes = work.shape
    stride, many = nodes // coarse.shape[1], coarse.shape[1]
    before = weights.shape[1] // 2 - 1
    for part in range(parts):
        for term in range(terms):
            w, half, slope = work[part, term], halves[part, term], rates[part, term]
            for i in range(nodes):
                n = i + 1 if i + 1 < nodes else 0
                cubic = 0.5 * (w[i] + w[n]) + 0.125 * width * (slope[i] - slope[n])
                fine[part, i, 0, term], fine[part, i, 1, term] = w[i], slope[i]
                fine[part, i, 2, term] = half[i] - cubic
            total = 0.0
            for j in range(many):
                integral[before + j] = total
                for i in range(j * stride, (j + 1) * stride):
                    total += simpson(i, w, half)
                pairs = 0.0
                for m in range(3):
                    pair = w[(j - m) % many * stride] + w[(j + m + 1) % many * stride]
                    pairs += MEAN_BY_PAIRS[m] * pair
                coarse[part, j, 0, term] = w[j * stride]
                coarse[part, j, 1, term] = (total - integral[before + j]) / stride - pairs
            # `total` is nearly 0: the work has no mean.
            for m in range(before):
                integral[m] = integral[many + m] - total
            for m in range(before + many, integral.size):
                integral[m] = integral[m - many] + total
            for j in range(many):
                running = integral[before + j]
                for k in range(stride):
                    i = j * stride + k
                    smooth = 0.0
                    for m in range(weights.shape[1]):
                        smooth += weights[k, m] * integral[j + m]
                    fine[part, i, 3, term] = width * (running - smooth)
                    running += simpson(i, w, half)
