"""Two grids of one table: a coarse one that carries the load's term, a fine one for the extremes.

The term of the load, z, is the integral of an integral of the torque: a tenth of the table's nodes
carry it. What it must not lose is the work between those nodes, so the coarse grid keeps the exact
integrals of P and V over each of its intervals. The extremes of the speed are then refined on the
fine grid, whose nodes are those of `tables`.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from engine_dyn.compilation import formula, inlined, on_stack
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
    "TwoGrid",
    "aliased_beyond",
    "fill_two_grid",
    "make_two_grid",
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

WINDOW_ROWS = 7
"""Rows of memory, a number a fine node, for the search for ripple."""

SMOOTH = 1e-10
"""Share of the steepest slope that ripple has by rounding."""

FINE_FIELDS = 8
F_P, F_V, F_DP, F_DV, F_IP, F_IV, F_MP, F_MV = range(FINE_FIELDS)
"""Of a fine node: P, V, their slopes, antiderivatives (periodic, without mean), and what a cubic
misses in the middle of the interval behind it."""

LARGEST_STEP = 0.05
"""Largest beta times the width of a coarse interval: beyond it the coarse grid is too coarse."""

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
the fine less that over the coarse nodes: what the coarse grid makes wrong in the mean of a
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


STRIP = 16
"""Fine nodes whose means are summed side by side. Refinement times CHUNK is a multiple of it, and
so is the number of fine nodes."""

MEANS = 29
MEAN_ROWS = MEANS * STRIP
"""The first of the constants are means."""

SERIES_DECAYS, SERIES_SHARES = _series_of_work()


class TwoGrid(NamedTuple):
    """Both grids of one table.

    `coarse` is (coarse node, NODE_FIELDS), `chunk` the largest deviations of a chunk of them,
    `fine` (fine node, FINE_FIELDS) with one coarse interval before the first node and behind the
    last, so that nobody wraps. `mix` (weight, lane), flat, are the numbers by which lanes with
    curves of their own add them up, see `own_curves`, and `units` is memory for that; both are
    empty for a table. `windows` (WINDOW_ROWS, fine node) is memory for the search for ripple, empty
    for lanes with curves of their own.
    """

    coarse: Floats
    chunk: Floats
    fine: Floats
    constants: Floats
    mix: Floats
    units: Floats
    windows: Floats


def make_two_grid(nodes: int, ratio: int) -> TwoGrid:
    """Memory for a table of `nodes` nodes, every `ratio`-th of which is a coarse one."""
    coarse = nodes // ratio
    return TwoGrid(
        coarse=np.zeros((coarse, NODE_FIELDS)),
        chunk=np.zeros((coarse // CHUNK, NODE_FIELDS)),
        fine=np.zeros((nodes + 2 * ratio, FINE_FIELDS)),
        constants=np.zeros(CONSTANTS),
        mix=np.zeros(0),
        units=np.zeros((0, 0, 0)),
        windows=np.zeros((WINDOW_ROWS, nodes)),
    )


@inlined
def fill_fine(table: Floats, width: float, ratio: int, fine: Floats) -> None:
    """Fields of the fine nodes. The antiderivative integrates the cubics and their middles."""
    nodes = table.shape[1]
    p, dp, mp = table[GAS_WORK], table[GAS_TORQUE], table[GAS_WORK_MIDDLE]
    v, dv, mv = table[SQUARE], table[SQUARE_SLOPE], table[SQUARE_MIDDLE]
    running = running_v = mean = mean_v = 0.0
    for j in range(nodes):
        after = j + 1 if j + 1 < nodes else 0
        to = fine[ratio + j]
        to[F_P], to[F_V], to[F_DP], to[F_DV] = p[j], v[j], dp[j], dv[j]
        to[F_IP], to[F_IV], to[F_MP], to[F_MV] = running, running_v, mp[j], mv[j]
        mean += running
        mean_v += running_v
        running += integral_of_quartic(width, p[j], p[after], dp[j], dp[after], mp[j])
        running_v += integral_of_quartic(width, v[j], v[after], dv[j], dv[after], mv[j])
    # What is left over a period is the mean of the curve between its nodes, near rounding.
    drift, drift_v = running / nodes, running_v / nodes
    mean = mean / nodes - drift * 0.5 * (nodes - 1)
    mean_v = mean_v / nodes - drift_v * 0.5 * (nodes - 1)
    for j in range(nodes):
        to = fine[ratio + j]
        to[F_IP] -= mean + drift * j
        to[F_IV] -= mean_v + drift_v * j
    for i in range(ratio):
        for field in range(FINE_FIELDS):
            fine[i, field] = fine[nodes + i, field]
            fine[nodes + ratio + i, field] = fine[ratio + i, field]


@formula
def integral_of_quartic(
    width: float, left: float, right: float, left_slope: float, right_slope: float, missed: float
) -> float:
    """Integral over an interval of the cubic and of what it misses, docs/method.md (52) and (53).

    `missed` is what the cubic misses in the middle: 16 t^2 (1 - t)^2 of it has the mean 8/15.
    """
    return width * (
        0.5 * (left + right) + width / 12.0 * (left_slope - right_slope) + 8.0 / 15.0 * missed
    )


@inlined
def fill_means(ratio: int, table: Floats, constants: Floats) -> None:
    """Means over the fine nodes and their differences to those over the coarse ones."""
    nodes = table.shape[1]
    share, share_coarse = 1.0 / nodes, -float(ratio) / nodes
    # Each place of a strip has sums of its own, so that loops over it become vectors. Coarse nodes
    # lie at the same places of every strip.
    weights, sums = on_stack(STRIP), on_stack(MEAN_ROWS)
    for k in range(STRIP):
        weights[k] = share + share_coarse if k % ratio == 0 else share
    for k in range(MEAN_ROWS):
        sums[k] = 0.0
    works, squares = table[GAS_WORK], table[SQUARE]
    for begin in range(0, nodes, STRIP):
        one, other = works[begin : begin + STRIP], squares[begin : begin + STRIP]
        for k in range(STRIP):
            p, v, weight = one[k], other[k], weights[k]
            p2, v2 = p * p, v * v
            pv = p * v
            add_at(PP, k, share * p2, sums)
            add_at(PV, k, share * pv, sums)
            add_at(VV, k, share * v2, sums)
            add_at(CUBES, k, share * p2 * p, sums)
            add_at(CUBES + 1, k, share * p2 * v, sums)
            add_at(CUBES + 2, k, share * pv * v, sums)
            add_at(CUBES + 3, k, share * v2 * v, sums)
            add_at(FOURTHS, k, share * p2 * p2, sums)
            add_at(FOURTHS + 1, k, share * p2 * pv, sums)
            add_at(FOURTHS + 2, k, share * p2 * v2, sums)
            add_at(FOURTHS + 3, k, share * pv * v2, sums)
            add_at(FOURTHS + 4, k, share * v2 * v2, sums)
            add_at(ALIAS_P, k, weight * p, sums)
            add_at(ALIAS_V, k, weight * v, sums)
            add_at(ALIAS_PP, k, weight * p2, sums)
            add_at(ALIAS_PV, k, weight * pv, sums)
            add_at(ALIAS_VV, k, weight * v2, sums)
            add_at(ALIAS_PPP, k, weight * p2 * p, sums)
            add_at(ALIAS_PPV, k, weight * p2 * v, sums)
            add_at(ALIAS_PVV, k, weight * pv * v, sums)
            add_at(ALIAS_VVV, k, weight * v2 * v, sums)
            add_at(ALIAS_PPPP, k, weight * p2 * p2, sums)
            add_at(ALIAS_PPPV, k, weight * p2 * pv, sums)
            add_at(ALIAS_PPVV, k, weight * p2 * v2, sums)
            add_at(ALIAS_PVVV, k, weight * pv * v2, sums)
            add_at(ALIAS_VVVV, k, weight * v2 * v2, sums)
    for i in range(MEANS):
        total = 0.0
        for k in range(STRIP):
            total += sums[i * STRIP + k]
        constants[i] = total
    constants[ALIASED] = aliased_beyond(0.0, constants)


@inlined
def aliased_beyond(least: float, constants: Floats) -> float:
    """Largest part of P and V, and of their squares, that the coarse nodes see wrongly.

    Of what has a mean square of `least` at most, nothing: it is rounding.
    """
    c = constants
    of_p = of_v = 0.0
    if c[PP] > least:
        of_p = max(abs(c[ALIAS_P]) / math.sqrt(c[PP]), abs(c[ALIAS_PP]) / c[PP])
    if c[VV] > least:
        of_v = max(abs(c[ALIAS_V]) / math.sqrt(c[VV]), abs(c[ALIAS_VV]) / c[VV])
    return max(of_p, of_v)


@formula
def add_at(mean: int, k: int, value: float, sums: Floats) -> None:
    """Add to the sum of one mean at a place of a strip."""
    sums[mean * STRIP + k] += value


@inlined
def fill_moments(width: float, ratio: int, two_grid: TwoGrid) -> None:
    """P_MOMENT and V_MOMENT: the first moment is h/2 (I_0 + I_1) less the integral of I."""
    fine, coarse = two_grid.fine, two_grid.coarse
    count = coarse.shape[0]
    step = width * ratio
    for quantity in range(2):
        value, integral, moment = F_P + quantity, F_IP + quantity, P_MOMENT + quantity
        running = mean = 0.0
        for n in range(count):
            begin = ratio * (n + 1)
            ends = fine[begin, integral] + fine[begin + ratio, integral]
            # Euler and Maclaurin: trapezia, and the slopes of I at both ends.
            area = 0.5 * ends + width / 12.0 * (fine[begin, value] - fine[begin + ratio, value])
            for i in range(begin + 1, begin + ratio):
                area += fine[i, integral]
            coarse[n, moment] = running - step * step / 12.0 * coarse[n, quantity]
            mean += coarse[n, moment]
            running += 0.5 * step * ends - width * area
        for n in range(count):
            coarse[n, moment] -= mean / count


@inlined
def fill_ripple(
    width: float, ratio: int, value: Floats, slope: Floats, tilt: Floats, steepest: float,
    quantity: int, two_grid: TwoGrid,
) -> None:  # fmt: skip
    """Ripple and tilt of P or V, for each chunk: what may mislead the search for extremes.

    The search halves a coarse interval by the sign of the slope, which finds one zero of it.
    That is the right one unless the slope waves, perhaps about a line that the other quantity makes
    up for: RIPPLE, half the way that its differences go up and down within RIPPLED intervals beyond
    what one turn needs, times a coarse interval. The extremes lie where the slope is no more than
    its ripple, so they differ by less. Smooth diagrams have none.

    `value`, `slope` and `tilt` are rows of a table, `steepest` is the largest slope.
    """
    nodes, chunk, windows = value.size, two_grid.chunk, two_grid.windows
    before, behind = windows[0], windows[1]
    last = nodes - 1
    for j in range(nodes):
        after = j + 1 if j < last else 0
        rise = value[after] - value[j]
        middle = (1.5 * rise + tilt[j]) / width - 0.25 * (slope[j] + slope[after])
        before[j] = middle - slope[j]
        behind[j] = slope[after] - middle
    # Windows are two halves of RIPPLED/2 intervals each: of every half the way, and its bounds.
    half = RIPPLED // 2
    halves = nodes // half
    way, high, low, tilted = windows[2], windows[3], windows[4], windows[5]
    for i in range(halves):
        begin = i * half
        gone, top, bottom, largest = 0.0, before[begin], before[begin], 0.0
        for j in range(begin, begin + half):
            gone += abs(behind[j] - before[j])
            gone += abs(before[j] - behind[j - 1]) if j > begin else 0.0
            top, bottom = (
                max(top, max(before[j], behind[j])),
                min(bottom, min(before[j], behind[j])),
            )
            largest = max(largest, abs(tilt[j]))
        way[i], high[i], low[i], tilted[i] = gone, top, bottom, largest
    turns = windows[6]
    for i in range(halves):
        after = i + 1 if i + 1 < halves else 0
        start, middle = before[i * half], before[after * half] - behind[i * half + half - 1]
        end = behind[after * half + half - 1]
        gone = way[i] + abs(middle) + way[after]
        top, bottom = max(high[i], high[after]), min(low[i], low[after])
        beyond = 0.5 * (gone - max(2.0 * top - start - end, start + end - 2.0 * bottom))
        turns[i] = beyond if beyond > SMOOTH * steepest else 0.0
    # All windows, half a window apart, in the intervals beside the chunk's nodes.
    of_interval = ratio // half
    for group in range(chunk.shape[0]):
        ripple = largest = 0.0
        first = of_interval * (CHUNK * group - 1)
        count = of_interval * (CHUNK + 1)
        for i in range(first, first + count):
            here = i + halves if i < 0 else (i if i < halves else i - halves)
            largest = max(largest, tilted[here])
            ripple = max(ripple, turns[here] if i < first + count - 1 else 0.0)
        chunk[group, RIPPLE + quantity] = ripple * width * ratio
        chunk[group, TILT + quantity] = largest


@inlined
def fill_series_of_work(coarse: Floats, constants: Floats) -> None:
    """WORK_SERIES and SQUARES_SERIES, through the recurrence's ends at Chebyshev's points."""
    works, squares = on_stack(SERIES_OF_WORK), on_stack(SERIES_OF_WORK)
    for i in range(SERIES_OF_WORK):
        works[i] = squares[i] = 0.0
    for n in range(coarse.shape[0]):
        work, square = coarse[n, WORK], coarse[n, SQUARES]
        for i in range(SERIES_OF_WORK):
            works[i] = SERIES_DECAYS[i] * works[i] + work
            squares[i] = SERIES_DECAYS[i] * squares[i] + square
    for j in range(SERIES_OF_WORK):
        work = square = 0.0
        for i in range(SERIES_OF_WORK):
            work += SERIES_SHARES[j, i] * works[i]
            square += SERIES_SHARES[j, i] * squares[i]
        constants[WORK_SERIES + j] = work
        constants[SQUARES_SERIES + j] = square


@inlined
def fill_chords(ratio: int, value: Floats, above: int, two_grid: TwoGrid) -> None:
    """How far a quantity rises above, and falls below, its chords in the intervals beside a node.

    `value` is its row of a table, `above` the first of the two fields of coarse nodes.
    """
    coarse = two_grid.coarse
    count = coarse.shape[0]
    for n in range(count):
        begin, end = n * ratio, (n + 1) * ratio if n + 1 < count else 0
        left = value[begin]
        step = (value[end] - left) / ratio
        highest = lowest = 0.0
        for i in range(1, ratio):
            off = value[begin + i] - (left + step * i)
            highest, lowest = max(highest, off), min(lowest, off)
        coarse[n, above] = highest
        coarse[n, above + 1] = -lowest
    for field in range(above, above + 2):
        before = coarse[count - 1, field]
        for n in range(count):
            here = coarse[n, field]
            coarse[n, field] = max(before, here)
            before = here
        for group in range(count // CHUNK):
            largest = 0.0
            for i in range(CHUNK):
                largest = max(largest, coarse[CHUNK * group + i, field])
            two_grid.chunk[group, field] = largest


@inlined
def largest_of(numbers: Floats) -> float:
    """Largest magnitude."""
    largest = 0.0
    for j in range(numbers.size):
        largest = max(largest, abs(numbers[j]))
    return largest


@inlined
def fill_two_grid(table: Floats, width: float, ratio: int, two_grid: TwoGrid) -> None:
    """Both grids of a table of `tables.build`."""
    fine, coarse, constants = two_grid.fine, two_grid.coarse, two_grid.constants
    for i in range(CONSTANTS):
        constants[i] = 0.0
    fill_fine(table, width, ratio, fine)
    fill_means(ratio, table, constants)
    count = coarse.shape[0]
    for n in range(count):
        here = ratio * (n + 1)
        coarse[n, P] = fine[here, F_P]
        coarse[n, V] = fine[here, F_V]
        coarse[n, WORK] = fine[here + ratio, F_IP] - fine[here, F_IP]
        coarse[n, SQUARES] = fine[here + ratio, F_IV] - fine[here, F_IV]
    fill_chords(ratio, table[GAS_WORK], P_ABOVE, two_grid)
    fill_chords(ratio, table[SQUARE], V_ABOVE, two_grid)
    fill_moments(width, ratio, two_grid)
    if count <= MOST_IN_SERIES:
        fill_series_of_work(coarse, constants)
    constants[HIGHEST_SLOPE] = largest_of(table[GAS_TORQUE])
    constants[HIGHEST_SLOPE_V] = largest_of(table[SQUARE_SLOPE])
    fill_ripple(
        width, ratio, table[GAS_WORK], table[GAS_TORQUE], table[GAS_WORK_TILT],
        constants[HIGHEST_SLOPE], 0, two_grid,
    )  # fmt: skip
    fill_ripple(
        width, ratio, table[SQUARE], table[SQUARE_SLOPE], table[SQUARE_TILT],
        constants[HIGHEST_SLOPE_V], 1, two_grid,
    )  # fmt: skip
