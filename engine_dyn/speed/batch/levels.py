"""Two levels of one table: a coarse one that carries the load's term, a fine one for the extremes.

The term of the load, z, is the integral of an integral of the torque: a tenth of the table's nodes
carry it. What it must not lose is the work between those nodes, so the coarse level keeps the exact
integrals of P and V over each of its intervals. The extremes of the speed are then refined on the
fine level, whose nodes are those of `tables`.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from engine_dyn.compilation import inlined
from engine_dyn.speed.tables.work_tables import (
    GAS_TORQUE,
    GAS_WORK,
    GAS_WORK_MIDDLE,
    GAS_WORK_TILT,
    SQUARE,
    SQUARE_MIDDLE,
    SQUARE_SLOPE,
    SQUARE_TILT,
)
from engine_dyn.types import Floats

__all__ = [
    "CHUNK",
    "CONSTANTS",
    "FINE_FIELDS",
    "LARGEST_STEP",
    "MOST_IN_SERIES",
    "NODE_FIELDS",
    "SERIES_OF_WORK",
    "SQUARES_SERIES",
    "WORK_SERIES",
    "Levels",
    "fill_levels",
    "make_levels",
]


CHUNK = 4
"""Coarse nodes that one pass over the lanes takes at once; their number is a multiple of it."""

NODE_FIELDS = 10
P, V, P_MOMENT, V_MOMENT, WORK, SQUARES, P_ABOVE, P_BELOW, V_ABOVE, V_BELOW = range(NODE_FIELDS)
"""Of a coarse node: P and V; the sum of their first moments about the middles of all intervals
before it, less what that is for a line, h^2/12 of P and V; their integrals over the interval behind
it; how far they rise above and fall below their chords in the two intervals beside it."""

RIPPLE, RIPPLE_V = P, V
"""Of a chunk, in the places of P and V: what may mislead the search for extremes, `fill_ripple`."""

TILT, TILT_V = WORK, SQUARES
"""Of a chunk, in the places of their integrals: the largest TILT of `tables` beside its nodes."""

RIPPLED = 8
"""Fine intervals within which the slope of a smooth diagram has one inflection at most."""

SMOOTH = 1e-10
"""Share of the steepest slope that ripple has by rounding."""

FINE_FIELDS = 8
F_P, F_V, F_DP, F_DV, F_IP, F_IV, F_MP, F_MV = range(FINE_FIELDS)
"""Of a fine node: P, V, their slopes, antiderivatives (periodic, without mean), and what a cubic
misses in the middle of the interval behind it."""

LARGEST_STEP = 0.05
"""Largest beta times the width of a coarse interval: beyond it the coarse level is too coarse."""

SERIES_OF_WORK, MOST_IN_SERIES = 16, 100
"""Terms, and up to how many coarse nodes they leave 1e-11 of the work that drives the recurrence:
3e-13 by theory, the rest by rounding."""

CONSTANTS = 29 + 2 * SERIES_OF_WORK
WORK_SERIES, SQUARES_SERIES = 29, 29 + SERIES_OF_WORK
PP, PV, VV = 0, 1, 2
(
    ALIAS_P, ALIAS_V, ALIAS_PP, ALIAS_PV, ALIAS_VV, ALIAS_PPP, ALIAS_PPV, ALIAS_PVV, ALIAS_VVV,
    ALIAS_PPPP, ALIAS_PPPV, ALIAS_PPVV, ALIAS_PVVV, ALIAS_VVVV,
) = range(3, 17)  # fmt: skip
HIGHEST_SLOPE, HIGHEST_SLOPE_V, ALIASED = 17, 18, 19
CUBES, FOURTHS = 20, 24
"""Of a table: the means of P^2, P V, V^2; ALIAS, for P^i V^k with i + k from 1 to 4, its mean over
the fine less that over the coarse nodes: what the coarse level makes wrong in the mean of a
function of the speed; the largest slopes; ALIASED, the largest
of the first four of those differences over the values themselves; the means of P^3, P^2 V ... V^3
and of P^4 ... V^4. WORK_SERIES and SQUARES_SERIES: where the load's recurrence ends that starts
from zero, driven by WORK or SQUARES, as a polynomial in 2 x/LARGEST_STEP - 1, x = beta h; of up to
MOST_IN_SERIES coarse nodes."""


def _series_of_work() -> tuple[Floats, Floats]:
    """Return exp(-x) at Chebyshev's points of x, and what makes a polynomial of values there."""
    order = np.arange(SERIES_OF_WORK)
    angle = math.pi * (order + 0.5) / SERIES_OF_WORK
    share = 2.0 / SERIES_OF_WORK * np.cos(np.outer(order, angle))
    share[0] *= 0.5
    powers = np.zeros((SERIES_OF_WORK, SERIES_OF_WORK))  # of Chebyshev's polynomials, a row each
    powers[0, 0] = powers[1, 1] = 1.0
    for i in range(2, SERIES_OF_WORK):
        powers[i, 1:] = 2.0 * powers[i - 1, :-1]
        powers[i] -= powers[i - 2]
    return np.exp(-0.5 * LARGEST_STEP * (1.0 + np.cos(angle))), powers.T @ share


SERIES_DECAYS, SERIES_SHARES = _series_of_work()


class Levels(NamedTuple):
    """Both levels of one table.

    `coarse` is (coarse node, NODE_FIELDS), `chunk` the largest deviations of a chunk of them,
    `fine` (fine node, FINE_FIELDS) with one coarse interval before the first node and behind the
    last, so that nobody wraps. `mix` (weight, lane), flat, are the numbers by which lanes with
    curves of their own add them up, see `harmonics`, and `units` is memory for
    that; both are empty for a table.
    """

    coarse: Floats
    chunk: Floats
    fine: Floats
    constants: Floats
    mix: Floats
    units: Floats


def make_levels(nodes: int, ratio: int) -> Levels:
    """Memory for a table of `nodes` nodes, every `ratio`-th of which is a coarse one."""
    coarse = nodes // ratio
    return Levels(
        coarse=np.zeros((coarse, NODE_FIELDS)),
        chunk=np.zeros((coarse // CHUNK, NODE_FIELDS)),
        fine=np.zeros((nodes + 2 * ratio, FINE_FIELDS)),
        constants=np.zeros(CONSTANTS),
        mix=np.zeros(0),
        units=np.zeros((0, 0, 0)),
    )


@inlined
def fill_fine(table: Floats, width: float, ratio: int, fine: Floats) -> None:
    """Fields of the fine nodes. The antiderivative integrates the cubics and their middles."""
    nodes = table.shape[1]
    for quantity in range(2):
        value = GAS_WORK if quantity == 0 else SQUARE
        slope = GAS_TORQUE if quantity == 0 else SQUARE_SLOPE
        middle = GAS_WORK_MIDDLE if quantity == 0 else SQUARE_MIDDLE
        running = mean = 0.0
        for j in range(nodes):
            after = j + 1 if j + 1 < nodes else 0
            here = ratio + j
            fine[here, F_P + quantity] = table[value, j]
            fine[here, F_DP + quantity] = table[slope, j]
            fine[here, F_MP + quantity] = table[middle, j]
            fine[here, F_IP + quantity] = running
            mean += running
            running += width * (
                0.5 * (table[value, j] + table[value, after])
                + width / 12.0 * (table[slope, j] - table[slope, after])
                + 8.0 / 15.0 * table[middle, j]
            )
        # What is left over a period is the mean of the curve between its nodes, near rounding.
        drift = running / nodes
        mean = mean / nodes - drift * 0.5 * (nodes - 1)
        for j in range(nodes):
            fine[ratio + j, F_IP + quantity] -= mean + drift * j
    for field in range(FINE_FIELDS):
        for i in range(ratio):
            fine[i, field] = fine[nodes + i, field]
            fine[nodes + ratio + i, field] = fine[ratio + i, field]


@inlined
def fill_means(ratio: int, fine: Floats, constants: Floats) -> None:
    """Means over the fine nodes and their differences to those over the coarse ones."""
    nodes = fine.shape[0] - 2 * ratio
    for i in range(CONSTANTS):
        constants[i] = 0.0
    share, share_coarse = 1.0 / nodes, -float(ratio) / nodes
    for j in range(nodes):
        p, v = fine[ratio + j, F_P], fine[ratio + j, F_V]
        weight = share
        if j % ratio == 0:
            weight += share_coarse
        constants[PP] += share * p * p
        constants[PV] += share * p * v
        constants[VV] += share * v * v
        constants[CUBES] += share * p * p * p
        constants[CUBES + 1] += share * p * p * v
        constants[CUBES + 2] += share * p * v * v
        constants[CUBES + 3] += share * v * v * v
        constants[FOURTHS] += share * p * p * p * p
        constants[FOURTHS + 1] += share * p * p * p * v
        constants[FOURTHS + 2] += share * p * p * v * v
        constants[FOURTHS + 3] += share * p * v * v * v
        constants[FOURTHS + 4] += share * v * v * v * v
        p2, v2 = weight * p * p, v * v
        constants[ALIAS_P] += weight * p
        constants[ALIAS_V] += weight * v
        constants[ALIAS_PP] += p2
        constants[ALIAS_PV] += weight * p * v
        constants[ALIAS_VV] += weight * v2
        constants[ALIAS_PPP] += p2 * p
        constants[ALIAS_PPV] += p2 * v
        constants[ALIAS_PVV] += weight * p * v2
        constants[ALIAS_VVV] += weight * v2 * v
        constants[ALIAS_PPPP] += p2 * p * p
        constants[ALIAS_PPPV] += p2 * p * v
        constants[ALIAS_PPVV] += p2 * v2
        constants[ALIAS_PVVV] += weight * p * v2 * v
        constants[ALIAS_VVVV] += weight * v2 * v2
    c = constants
    root_p, root_v = math.sqrt(c[PP]), math.sqrt(c[VV])
    of_p = max(abs(c[ALIAS_P]) / root_p, abs(c[ALIAS_PP]) / c[PP]) if c[PP] > 0.0 else 0.0
    of_v = max(abs(c[ALIAS_V]) / root_v, abs(c[ALIAS_VV]) / c[VV]) if c[VV] > 0.0 else 0.0
    constants[ALIASED] = max(of_p, of_v)


@inlined
def fill_moments(width: float, ratio: int, levels: Levels) -> None:
    """P_MOMENT and V_MOMENT: the first moment is h/2 (I_0 + I_1) less the integral of I."""
    fine, coarse = levels.fine, levels.coarse
    count = coarse.shape[0]
    step = width * ratio
    for quantity in range(2):
        running = mean = 0.0
        for n in range(count):
            begin = ratio * (n + 1)
            area = 0.0
            for i in range(begin, begin + ratio):
                area += 0.5 * (fine[i, F_IP + quantity] + fine[i + 1, F_IP + quantity])
                area += width / 12.0 * (fine[i, F_P + quantity] - fine[i + 1, F_P + quantity])
            coarse[n, P_MOMENT + quantity] = running - step * step / 12.0 * coarse[n, quantity]
            mean += coarse[n, P_MOMENT + quantity]
            ends = fine[begin, F_IP + quantity] + fine[begin + ratio, F_IP + quantity]
            running += 0.5 * step * ends - width * area
        for n in range(count):
            coarse[n, P_MOMENT + quantity] -= mean / count


@inlined
def fill_ripple(table: Floats, width: float, ratio: int, levels: Levels) -> None:
    """Ripple and tilt of P and V, for each chunk: what may mislead the search for extremes.

    The search halves a coarse interval by the sign of the slope, which finds one zero of it.
    That is the right one unless the slope waves, perhaps about a line that the other quantity makes
    up for: RIPPLE, half the way that its differences go up and down within RIPPLED intervals beyond
    what one turn needs, times a coarse interval. The extremes lie where the slope is no more than
    its ripple, so they differ by less. Smooth diagrams have none.
    """
    nodes, chunk = table.shape[1], levels.chunk
    for quantity in range(2):
        value = GAS_WORK if quantity == 0 else SQUARE
        slope = GAS_TORQUE if quantity == 0 else SQUARE_SLOPE
        tilt = GAS_WORK_TILT if quantity == 0 else SQUARE_TILT
        steepest = levels.constants[HIGHEST_SLOPE if quantity == 0 else HIGHEST_SLOPE_V]
        for group in range(chunk.shape[0]):
            ripple = tilted = 0.0
            # All windows, half a window apart, in the intervals beside the chunk's nodes.
            first = ratio * (CHUNK * group - 1)
            for begin in range(first, first + ratio * (CHUNK + 1) - RIPPLED + 1, RIPPLED // 2):
                way = start = last = high = low = 0.0
                for i in range(begin, begin + RIPPLED):
                    j = i + nodes if i < 0 else (i if i < nodes else i - nodes)
                    after = j + 1 if j + 1 < nodes else 0
                    here, there = table[slope, j], table[slope, after]
                    tilted = max(tilted, abs(table[tilt, j]))
                    rise = table[value, after] - table[value, j]
                    middle = (1.5 * rise + table[tilt, j]) / width - 0.25 * (here + there)
                    before, behind = middle - here, there - middle
                    if i == begin:
                        start = last = high = low = before
                    way += abs(before - last) + abs(behind - before)
                    high, low = max(high, max(before, behind)), min(low, min(before, behind))
                    last = behind
                needed = max(2.0 * high - start - last, start + last - 2.0 * low)
                turns = 0.5 * (way - needed)
                ripple = max(ripple, turns if turns > SMOOTH * steepest else 0.0)
            chunk[group, RIPPLE + quantity] = ripple * width * ratio
            chunk[group, TILT + quantity] = tilted


@inlined
def fill_series_of_work(coarse: Floats, constants: Floats) -> None:
    """WORK_SERIES and SQUARES_SERIES, through the recurrence's ends at Chebyshev's points."""
    for i in range(SERIES_OF_WORK):
        work = squares = 0.0
        for n in range(coarse.shape[0]):
            work = SERIES_DECAYS[i] * work + coarse[n, WORK]
            squares = SERIES_DECAYS[i] * squares + coarse[n, SQUARES]
        for j in range(SERIES_OF_WORK):
            constants[WORK_SERIES + j] += SERIES_SHARES[j, i] * work
            constants[SQUARES_SERIES + j] += SERIES_SHARES[j, i] * squares


@inlined
def fill_levels(table: Floats, width: float, ratio: int, levels: Levels) -> None:
    """Both levels of a table of `tables.build`."""
    fine, coarse = levels.fine, levels.coarse
    fill_fine(table, width, ratio, fine)
    fill_means(ratio, fine, levels.constants)
    count = coarse.shape[0]
    for n in range(count):
        here = ratio * (n + 1)
        coarse[n, P] = fine[here, F_P]
        coarse[n, V] = fine[here, F_V]
        coarse[n, WORK] = fine[here + ratio, F_IP] - fine[here, F_IP]
        coarse[n, SQUARES] = fine[here + ratio, F_IV] - fine[here, F_IV]
        for quantity in range(2):
            above = below = 0.0
            for begin in (here - ratio, here):
                left = fine[begin, F_P + quantity]
                # The interval's end: one row further lies in the margin for the last node too.
                step = (fine[begin + ratio, F_P + quantity] - left) / ratio
                for i in range(1, ratio):
                    off = fine[begin + i, F_P + quantity] - (left + step * i)
                    above = max(above, off)
                    below = max(below, -off)
            coarse[n, P_ABOVE + 2 * quantity] = above
            coarse[n, P_BELOW + 2 * quantity] = below
    fill_moments(width, ratio, levels)
    if count <= MOST_IN_SERIES:
        fill_series_of_work(coarse, levels.constants)
    for group in range(count // CHUNK):
        for field in range(P_ABOVE, V_BELOW + 1):
            largest = 0.0
            for i in range(CHUNK):
                largest = max(largest, coarse[CHUNK * group + i, field])
            levels.chunk[group, field] = largest
    slope = slope_v = 0.0
    for j in range(fine.shape[0]):
        slope = max(slope, abs(fine[j, F_DP]))
        slope_v = max(slope_v, abs(fine[j, F_DV]))
    levels.constants[HIGHEST_SLOPE] = slope
    levels.constants[HIGHEST_SLOPE_V] = slope_v
    fill_ripple(table, width, ratio, levels)
