"""Largest, smallest and mean speed of a block of designs, and what goes into the results.

The largest u at a coarse node only brackets a maximum. Around it the curve is evaluated at fine
nodes, where the work is known from the columns and the load, which is smoother, is interpolated.
The extreme lies in the interval at whose ends the slope changes its sign, and is that of a quartic.
A local maximum beside another node is looked at too if the curve can rise above the best between
its nodes. docs/method.md chapter 12.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from engine_dyn.compilation import inlined
from engine_dyn.loads.laws import Law, load_terms
from engine_dyn.speed.batch.block import HALO, MANY, Curves, Lanes, Peaks, Scratch
from engine_dyn.speed.batch.weights import Weights
from engine_dyn.speed.designs import Designs
from engine_dyn.speed.work.columns import BETWEEN, MIDDLE, SLOPE, VALUE, Columns
from engine_dyn.speed.work.interpolation import STENCIL
from engine_dyn.speed.work.parts import SQUARE
from engine_dyn.speed.work.summit import WINDOW, cubic_in_middle, peak_between, summit_at
from engine_dyn.types import Booleans, Floats, Integers

__all__ = [
    "One",
    "begin_peaks",
    "end_peaks",
    "fill_peaks",
    "fill_u",
    "find_candidates",
    "mean_speeds",
]


@inlined
def find_candidates(lanes: Lanes, curves: Curves) -> None:
    """Nodes beside which the largest and the smallest u may lie, in `tops` and `bottoms`.

    Beside a local maximum a parabola rises above its node by an eighth of the second difference at
    most; twice as much is looked at.
    """
    high, low, tops, bottoms = lanes.high, lanes.low, lanes.tops, lanes.bottoms
    for k in range(tops.size):
        tops[k] = bottoms[k] = 0.0
    for i in range(curves.drive.shape[0]):
        before, u, after = curves.u[HALO + i - 1], curves.u[HALO + i], curves.u[HALO + i + 1]
        number = MANY + i
        for k in range(tops.size):
            reach = u[k] + 0.25 * (2.0 * u[k] - before[k] - after[k])
            may_be = reach >= high[k] and u[k] >= before[k] and u[k] > after[k]
            tops[k] += number if may_be else 0.0
        for k in range(tops.size):
            reach = u[k] + 0.25 * (2.0 * u[k] - before[k] - after[k])
            may_be = reach <= low[k] and u[k] <= before[k] and u[k] < after[k]
            bottoms[k] += number if may_be else 0.0


@inlined
def mean_speeds(lanes: Lanes, curves: Curves) -> None:
    """Mean of sqrt(q) over the angle, in `lanes.total`.

    The mean of X is 0; what it is over the coarse nodes is taken away again.
    """
    total, nodes = lanes.total, curves.drive.shape[0]
    for k in range(total.size):
        total[k] = 0.0
    for i in range(nodes):
        u, work = curves.u[HALO + i], curves.work[HALO + i]
        for k in range(total.size):
            total[k] += math.sqrt(1.0 + u[k]) - 0.5 * work[k]
    for k in range(total.size):
        total[k] /= nodes


JAGGED = 3.0
"""Margin of what jagged work hides: it is known in the middle of a box, and where the inertia
varies, it may be as low as `LIGHTEST`."""


class One(NamedTuple):
    """Numbers of one design of a block: its number, its lane and what the equation has of it."""

    which: int
    lane: int
    gas: float
    eta: float
    beta: float
    variable: bool
    width: float


@inlined
def highest_between(i: int, lane: int, sign: float, u: Floats) -> float:
    """Highest that a smooth curve could be between a coarse node and the next one."""
    before, here = sign * u[HALO + i - 1, lane], sign * u[HALO + i, lane]
    after, last = sign * u[HALO + i + 1, lane], sign * u[HALO + i + 2, lane]
    bend = max(2.0 * here - before - after, 2.0 * after - here - last, 0.0)
    return max(here, after) + 0.25 * bend


# The functions below take arrays, not tuples of them: each array that is taken out of a tuple is
# counted, and that would cost ten times as much as what is computed here.


@inlined
def fill_fine(
    node: int, which: int, fine: Floats, part: Integers, share: Floats, factor: Floats,
    values: Floats,
) -> None:  # fmt: skip
    """Work table of a design at one fine node, and behind it: `Table.fine`."""
    for kind in range(values.shape[1]):
        gas = square = 0.0
        for piece in range(part.shape[0]):
            if share[piece, which] != 0.0:
                total = 0.0
                for t in range(factor.shape[1]):
                    total += factor[which, t] * fine[kind, part[piece, which], node, t]
                gas += share[piece, which] * total
        for t in range(factor.shape[1]):
            square += factor[which, t] * fine[kind, SQUARE, node, t]
        values[0, kind, node], values[1, kind, node] = gas, square


@inlined
def curve_at(
    node: int, one: One, load: Floats, rest: Floats, steep: Floats, weights: Floats, values: Floats
) -> tuple[float, float]:
    """U of a design at a fine node, and its slope times the width of a fine interval.

    Load and remainder are interpolated between coarse nodes; the integral of X is known where a
    polynomial misses it, docs/method.md (86). The slope of the load is beta (u tau + r), (48).
    """
    stride, lane = weights.shape[0], one.lane
    coarse = node // stride
    place = node - coarse * stride
    work = r = 0.0
    for j in range(STENCIL):
        there = HALO + coarse + j - (STENCIL // 2 - 1)
        work += weights[place, j] * load[there, lane]
        r += weights[place, j] * rest[there, lane]
    rough = one.gas * values[0, BETWEEN, node] - one.eta * values[1, BETWEEN, node]
    work += rough * (one.beta * steep[HALO + coarse, lane])
    moving, turning = one.eta * values[1, VALUE, node], one.eta * values[1, SLOPE, node]
    u = one.gas * values[0, VALUE, node] - moving - work
    slope = one.gas * values[0, SLOPE, node] - turning - one.beta * (u + r)
    if one.variable:
        u /= 1.0 + moving
        slope = (slope - u * turning) / (1.0 + moving)
    return u, one.width * slope


@inlined
def middle_of(
    node: int, after: int, one: One, u: float, slope: float, u_after: float, slope_after: float,
    values: Floats,
) -> float:  # fmt: skip
    """What the cubic through u at both ends of a fine interval misses in its middle.

    The load is smooth: what it misses of the work is known. With variable inertia the cubic is that
    of energy over inertia, docs/method.md (98).
    """
    missed = one.gas * values[0, MIDDLE, node] - one.eta * values[1, MIDDLE, node]
    if not one.variable:
        return missed
    tau = 1.0 + one.eta * values[1, VALUE, node]
    tau_after = 1.0 + one.eta * values[1, VALUE, after]
    d_tau = one.width * one.eta * values[1, SLOPE, node]
    d_tau_after = one.width * one.eta * values[1, SLOPE, after]
    excess = missed + cubic_in_middle(
        u * tau, u_after * tau_after, slope * tau + u * d_tau,
        slope_after * tau_after + u_after * d_tau_after,
    )  # fmt: skip
    inertia = one.eta * values[1, MIDDLE, node] + cubic_in_middle(
        tau, tau_after, d_tau, d_tau_after
    )
    return excess / inertia - cubic_in_middle(u, u_after, slope, slope_after)


@inlined
def node_of(found: float) -> int:
    """Node of the only candidate; 0 where there is none, or where there are several."""
    return int(found - MANY) if MANY <= found < 2.0 * MANY else 0


@inlined
def begin_peaks(lanes: Lanes, curves: Curves, peaks: Peaks) -> None:
    """Guess where between coarse nodes the extremes of each lane are."""
    for side in range(2):
        found = lanes.tops if side == 0 else lanes.bottoms
        sign = 1.0 if side == 0 else -1.0
        windows, place = peaks.windows[side], peaks.place[side]
        for k in range(place.size):
            node = node_of(found[k])
            for i in range(WINDOW):
                windows[i, k] = sign * curves.u[HALO + node + i - WINDOW // 2, k]
        b, c, d, e, f = windows[0], windows[1], windows[2], windows[3], windows[4]
        for k in range(place.size):
            place[k] = summit_at(b[k], c[k], d[k], e[k], f[k])


@inlined
def climb(
    node: int, sign: float, one: One, load: Floats, rest: Floats, steep: Floats, weights: Floats,
    fine: Floats, part: Integers, share: Floats, factor: Floats, known: Booleans, values: Floats,
) -> tuple[float, float, float, float, float]:  # fmt: skip
    """From a fine node up to the next maximum of `sign` times u.

    Returns what `peak_between` takes of the fine interval that holds it: values and slopes at both
    ends, and what the cubic misses in the middle. `known` are the nodes that `values` has.
    """
    size, stride = known.size, weights.shape[0]
    step, last = 0, node
    u = slope = u_last = slope_last = 0.0
    for _ in range(2 * stride + 1):
        if not known[node]:
            known[node] = True
            fill_fine(node, one.which, fine, part, share, factor, values)
        u, slope = curve_at(node, one, load, rest, steep, weights, values)
        if step == 0:
            step = 1 if sign * slope > 0.0 else -1
        elif step * sign * slope <= 0.0:
            break
        u_last, slope_last, last = u, slope, node
        node += step
        node += size if node < 0 else (-size if node >= size else 0)
    if step * sign * slope > 0.0:  # no extreme on this side: the node is the highest
        return sign * u, sign * u, 0.0, 0.0, 0.0
    if step < 0:
        node, last = last, node
        u, slope, u_last, slope_last = u_last, slope_last, u, slope
    middle = middle_of(last, node, one, u_last, slope_last, u, slope, values)
    return sign * u_last, sign * u, sign * slope_last, sign * slope, sign * middle


@inlined
def hidden_rise(which: int, jagged: Floats, part: Integers, share: Floats) -> float:
    """How far P may rise between coarse nodes above what its values there tell."""
    total = 0.0
    for piece in range(part.shape[0]):
        total += abs(share[piece, which]) * jagged[part[piece, which]]
    return JAGGED * total


# Longer than usual: each step needs the arrays of the others, see above.
@inlined
def fill_peaks(
    first: int, count: int, current: int, variable: bool, columns: Columns, weights: Weights,
    designs: Designs, left: Booleans, scratch: Scratch,
) -> None:  # fmt: skip
    """Find the fine intervals of the largest u and -u of the designs of a block.

    From a guess on, fine nodes are looked at until the slope changes its sign. Of several local
    extrema, the largest counts. Where the work is jagged, every fine node of a coarse interval that
    may hold the largest is such a guess. `current` is the number of the table that the fine nodes
    are of.
    """
    curves, lanes, peaks, table = scratch.curves, scratch.lanes, scratch.peaks, scratch.table
    u_at, load, rest = curves.u, curves.load, curves.rest
    steep, at = curves.steep, table.weights
    values, known, all_ends, guess = table.fine, table.known, peaks.ends, peaks.place
    tops, bottoms, high, low = lanes.tops, lanes.bottoms, lanes.high, lanes.low
    fine, part, share, factor = columns.fine, designs.part, designs.share, designs.factor
    gas, eta, beta, number = designs.gas, designs.eta, weights.beta, designs.table
    nodes, size, width = curves.drive.shape[0], known.size, scratch.width
    stride, jagged = size // nodes, columns.jagged
    for lane in range(count):
        which = first + lane
        if left[which]:
            continue
        if number[which] != current:
            current = number[which]
            for j in range(size):
                known[j] = False
        one = One(which, lane, gas[which], eta[which], beta[which], variable, width)
        hidden = gas[which] * hidden_rise(which, jagged, part, share)
        for side in range(2):
            sign = 1.0 if side == 0 else -1.0
            found = tops[lane] if side == 0 else bottoms[lane]
            highest = high[lane] if side == 0 else -low[lane]
            several = hidden > 0.0 or found >= 2.0 * MANY
            begin = 0 if several else node_of(found)
            best = -math.inf
            for i in range(begin, nodes if several else begin + 1):
                node, guesses = i * stride, 1
                if hidden > 0.0:
                    reach = highest_between(i, lane, sign, u_at)
                    guesses = stride if reach + hidden >= highest else 0
                elif several:
                    here = sign * u_at[HALO + i, lane]
                    before = sign * u_at[HALO + i - 1, lane]
                    after = sign * u_at[HALO + i + 1, lane]
                    bend = 2.0 * here - before - after
                    if not (here + 0.25 * bend >= highest and here >= before and here > after):
                        continue
                    node += int(math.floor(0.5 * stride * (after - before) / bend + 0.5))
                else:
                    node += int(math.floor(stride * guess[side, lane] + 0.5))
                node += size if node < 0 else (-size if node >= size else 0)
                for begin_at in range(node, node + guesses):
                    left_u, right_u, left_slope, right_slope, middle = climb(
                        begin_at, sign, one, load, rest, steep, at, fine, part, share, factor,
                        known, values,
                    )  # fmt: skip
                    value, _ = peak_between(left_u, right_u, left_slope, right_slope, middle)
                    if value > best:
                        best = value
                        all_ends[side, 0, lane], all_ends[side, 1, lane] = left_u, right_u
                        all_ends[side, 2, lane] = left_slope
                        all_ends[side, 3, lane] = right_slope
                        all_ends[side, 4, lane] = middle


@inlined
def end_peaks(peaks: Peaks) -> None:
    """Extremes within their intervals, and how much they may miss."""
    for side in range(2):
        ends, value, missed = peaks.ends[side], peaks.value[side], peaks.missed[side]
        left, right, d_left, d_right, middle = ends[0], ends[1], ends[2], ends[3], ends[4]
        for k in range(value.size):
            value[k], bump = peak_between(left[k], right[k], d_left[k], d_right[k], middle[k])
            missed[k] = abs(bump)


@inlined
def fill_u(
    one: One, law: Law, kappa: float, mu: float, columns: Columns, designs: Designs,
    scratch: Scratch, u: Floats, slope: Floats,
) -> None:  # fmt: skip
    """U of a design at all fine nodes, and its slope over the angle, docs/method.md (48)."""
    load, rest = scratch.curves.load, scratch.curves.rest
    steep, at = scratch.curves.steep, scratch.table.weights
    values, fine = scratch.table.fine, columns.fine
    part, share, factor = designs.part, designs.share, designs.factor
    for node in range(u.size):
        fill_fine(node, one.which, fine, part, share, factor, values)
        u[node], _ = curve_at(node, one, load, rest, steep, at, values)
        force, _ = load_terms(1.0 + u[node], law)
        turning = one.eta * values[1, SLOPE, node]
        slope[node] = one.gas * values[0, SLOPE, node] - turning - kappa * (force / mu - 1.0)
        if one.variable:
            slope[node] = (slope[node] - u[node] * turning) / (
                1.0 + one.eta * values[1, VALUE, node]
            )
