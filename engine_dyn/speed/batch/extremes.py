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
from engine_dyn.speed.batch.block import HALO, MANY, Curves, Lanes, Peaks, Scratch
from engine_dyn.speed.batch.tables import fill_fine
from engine_dyn.speed.designs import Designs
from engine_dyn.speed.work.interpolation import STENCIL
from engine_dyn.speed.work.columns import Columns
from engine_dyn.speed.work.summit import WINDOW, cubic_in_middle, peak_between, summit_at
from engine_dyn.types import Floats

__all__ = ["begin_peaks", "end_peaks", "fill_peak", "fill_u", "find_candidates", "mean_speeds"]


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


class Point(NamedTuple):
    """A fine node of a lane: number, coarse node before it, and fine intervals from there."""

    node: int
    coarse: int
    part: int


@inlined
def point_of(node: int, fine: int, stride: int) -> Point:
    """Fine node of any number, which may lie outside the period."""
    node -= fine * int(math.floor(node / fine))
    coarse = node // stride
    return Point(node, coarse, node - coarse * stride)


@inlined
def load_at(weights: Floats, point: Point, half: int, lane: int, load: Floats) -> float:
    """Load of a lane, or its slope, interpolated at a fine node (half 0) or behind it (1)."""
    total = 0.0
    for j in range(STENCIL):
        total += (
            weights[2 * point.part + half, j]
            * load[HALO + point.coarse + j - (STENCIL // 2 - 1), lane]
        )
    return total


@inlined
def curve_at(
    point: Point, width: float, lane: int, which: int, variable: bool, columns: Columns,
    designs: Designs, scratch: Scratch,
) -> tuple[float, float]:  # fmt: skip
    """U of a lane at a fine node, and its slope times the width of a fine interval."""
    table, load = scratch.table, scratch.curves.load
    fill_fine(point.node, which, columns, designs, table)
    gas, eta, node = designs.gas[which], designs.eta[which], point.node
    stride = table.between.shape[0] // 2
    moving, turning = eta * table.fine_square[0, node], eta * table.fine_square[1, node]
    # The integral of X is known where a polynomial through coarse nodes misses it.
    rough = gas * table.fine_gas[3, node] - eta * table.fine_square[3, node]
    rough *= scratch.lanes.beta[lane] * scratch.curves.steep[HALO + point.coarse, lane]
    u = gas * table.fine_gas[0, node] - moving
    u -= load_at(table.between, point, 0, lane, load) + rough
    slope = width * (gas * table.fine_gas[1, node] - turning)
    slope -= load_at(table.rising, point, 0, lane, load) / stride
    if variable:
        u /= 1.0 + moving
        slope = (slope - width * u * turning) / (1.0 + moving)
    return u, slope


@inlined
def middle_of(
    point: Point, u: float, slope: float, u_after: float, slope_after: float, lane: int, which: int,
    variable: bool, designs: Designs, scratch: Scratch,
) -> float:  # fmt: skip
    """What the cubic through u at both ends of a fine interval misses in its middle.

    The load is smooth: what it misses of the work is known. With variable inertia the cubic is that
    of energy over inertia, docs/method.md (100).
    """
    table, node = scratch.table, point.node
    gas, eta = designs.gas[which], designs.eta[which]
    missed = gas * table.fine_gas[2, node] - eta * table.fine_square[2, node]
    if not variable:
        return missed
    n = node + 1 if node + 1 < table.known.size else 0
    square, turn = table.fine_square[0], table.fine_square[1]
    tau, tau_after = 1.0 + eta * square[node], 1.0 + eta * square[n]
    width = scratch.width
    d_tau, d_tau_after = width * eta * turn[node], width * eta * turn[n]
    excess = missed + cubic_in_middle(
        u * tau,
        u_after * tau_after,
        slope * tau + u * d_tau,
        slope_after * tau_after + u_after * d_tau_after,
    )
    inertia = eta * table.fine_square[2, node] + cubic_in_middle(tau, tau_after, d_tau, d_tau_after)
    return excess / inertia - cubic_in_middle(u, u_after, slope, slope_after)


@inlined
def fill_interval(
    sign: float, start: int, lane: int, which: int, variable: bool, columns: Columns,
    designs: Designs, scratch: Scratch, ends: Floats,
) -> None:  # fmt: skip
    """Find the fine interval that holds a maximum of sign * u; the search begins at a fine node.

    `ends` gets the lane's numbers of `Peaks.ends`.
    """
    fine, stride = scratch.table.known.size, scratch.table.between.shape[0] // 2
    width = scratch.width
    here = point_of(start, fine, stride)
    u, slope = curve_at(here, width, lane, which, variable, columns, designs, scratch)
    step = 1 if sign * slope > 0.0 else -1
    for _ in range(2 * stride):
        start += step
        there = point_of(start, fine, stride)
        u_there, slope_there = curve_at(
            there, width, lane, which, variable, columns, designs, scratch
        )
        if step * sign * slope_there <= 0.0:
            if step < 0:
                here, u, slope, u_there, slope_there = there, u_there, slope_there, u, slope
            ends[0, lane], ends[1, lane] = sign * u, sign * u_there
            ends[2, lane], ends[3, lane] = sign * slope, sign * slope_there
            ends[4, lane] = sign * middle_of(
                here, u, slope, u_there, slope_there, lane, which, variable, designs, scratch
            )
            return
        here, u, slope = there, u_there, slope_there
    # No extreme on this side: the node is the highest that there is.
    ends[0, lane] = ends[1, lane] = sign * u
    ends[2, lane] = ends[3, lane] = ends[4, lane] = 0.0


@inlined
def fill_several(
    sign: float, lane: int, which: int, variable: bool, columns: Columns, designs: Designs,
    scratch: Scratch, ends: Floats,
) -> None:  # fmt: skip
    """Find the fine interval that holds the largest of several local maxima of sign * u."""
    lanes, curves = scratch.lanes, scratch.curves
    highest = lanes.high[lane] if sign > 0.0 else -lanes.low[lane]
    stride = scratch.table.between.shape[0] // 2
    best, place = -math.inf, 0
    for i in range(curves.drive.shape[0]):
        here = sign * curves.u[HALO + i, lane]
        before, after = sign * curves.u[HALO + i - 1, lane], sign * curves.u[HALO + i + 1, lane]
        bend = 2.0 * here - before - after
        if here + 0.25 * bend >= highest and here >= before and here > after:
            start = i * stride + int(math.floor(0.5 * stride * (after - before) / bend + 0.5))
            fill_interval(sign, start, lane, which, variable, columns, designs, scratch, ends)
            value, _ = peak_between(
                ends[0, lane], ends[1, lane], ends[2, lane], ends[3, lane], ends[4, lane]
            )
            if value > best:
                best, place = value, start
    fill_interval(sign, place, lane, which, variable, columns, designs, scratch, ends)


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
def fill_peak(
    side: int, lane: int, which: int, variable: bool, columns: Columns, designs: Designs,
    scratch: Scratch,
) -> None:  # fmt: skip
    """Find the fine interval of the largest u (side 0) or -u (1) of a lane."""
    lanes, peaks = scratch.lanes, scratch.peaks
    found = lanes.tops[lane] if side == 0 else lanes.bottoms[lane]
    sign = 1.0 if side == 0 else -1.0
    ends = peaks.ends[side]
    if found >= 2.0 * MANY:
        fill_several(sign, lane, which, variable, columns, designs, scratch, ends)
        return
    stride = scratch.table.between.shape[0] // 2
    start = node_of(found) * stride + int(math.floor(stride * peaks.place[side, lane] + 0.5))
    fill_interval(sign, start, lane, which, variable, columns, designs, scratch, ends)


@inlined
def end_peaks(peaks: Peaks) -> None:
    """Extremes within their intervals, and how much they may miss."""
    for side in range(2):
        ends, value, missed = peaks.ends[side], peaks.value[side], peaks.missed[side]
        left, right, d_left, d_right, middle = ends[0], ends[1], ends[2], ends[3], ends[4]
        for k in range(value.size):
            value[k], _ = peak_between(left[k], right[k], d_left[k], d_right[k], middle[k])
        for k in range(value.size):
            _, bump = peak_between(left[k], right[k], d_left[k], d_right[k], middle[k])
            missed[k] = abs(bump)


@inlined
def fill_u(
    lane: int, which: int, variable: bool, columns: Columns, designs: Designs, scratch: Scratch,
    u: Floats, slope: Floats,
) -> None:  # fmt: skip
    """U of a lane at all fine nodes, and its slope over the angle."""
    fine, stride = scratch.table.known.size, scratch.table.between.shape[0] // 2
    for node in range(fine):
        u[node], slope[node] = curve_at(
            point_of(node, fine, stride), scratch.width, lane, which, variable, columns, designs,
            scratch,
        )  # fmt: skip
        slope[node] /= scratch.width
