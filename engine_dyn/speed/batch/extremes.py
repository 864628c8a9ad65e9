"""Largest, smallest and mean speed of a block of designs: docs/solver.md chapter 12.

The largest u at a coarse node only brackets a maximum. Around it the curve is evaluated at fine
nodes, up to the interval at whose ends the slope changes its sign. A local maximum beside another
node is looked at too if the curve can rise above the best between its nodes. At
fine nodes the work is known from the columns, and the load is interpolated between coarse nodes.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from engine_dyn.compilation import inlined
from engine_dyn.speed.batch.block import (
    HALO,
    MANY,
    ColumnRows,
    Curves,
    Lanes,
    Peaks,
    Scratch,
    repeat_ends,
)
from engine_dyn.speed.batch.work_table import Weights
from engine_dyn.speed.designs import Designs
from engine_dyn.speed.vectors import LANES, Rows, any_of, read, where, write
from engine_dyn.speed.work.columns import BETWEEN, MIDDLE, SLOPE, SQUARE, VALUE
from engine_dyn.speed.work.interpolation import BEFORE, STENCIL, cubic_in_middle, max_between
from engine_dyn.types import Floats

JAGGED = 3.0
"""Margin of the rise that jagged work hides: it is known in the middle of a box, and a variable
inertia of 0.4 of its mean or more divides it."""


@inlined
def find_candidates(lanes: Lanes, curves: Curves) -> None:
    """Nodes beside which the largest and the smallest u may lie, in `tops` and `bottoms`.

    They are those of docs/solver.md (95). `mean` gets that of sqrt(q); the mean of X is 0, and what
    it is over the coarse nodes is taken away again.
    """
    repeat_ends(curves.u)
    repeat_ends(curves.load)  # for interpolation of the load
    high, low = read(lanes.high, 0), read(lanes.low, 0)
    tops, bottoms, total, nodes = 0.0 * high, 0.0 * high, 0.0 * high, len(curves.missed)
    before, u = read(curves.u, HALO - 1), read(curves.u, HALO)
    for i in range(nodes):
        after = read(curves.u, HALO + i + 1)
        total = total + (np.sqrt(1.0 + u) - 0.5 * read(curves.work, HALO + i))
        reach = 1.5 * u - 0.25 * (before + after)
        top = (reach >= high) & (u >= before) & (u > after)
        bottom = (low >= reach) & (before >= u) & (after > u)
        tops = tops + where(top, MANY + i, 0.0)
        bottoms = bottoms + where(bottom, MANY + i, 0.0)
        before, u = u, after
    write(lanes.tops, 0, tops)
    write(lanes.bottoms, 0, bottoms)
    write(lanes.mean, 0, total / nodes)


@inlined
def begin_search(found: Rows, size: int, stride: int, peaks: Peaks) -> None:
    """Fine nodes between which starts are searched: all, unless a lane has one candidate only."""
    for k in range(LANES):
        alone = MANY <= found[0, k] < 2.0 * MANY and peaks.hidden[0, k] == 0.0
        start = stride * int(found[0, k] - MANY) if alone else 0
        peaks.start[0, k], peaks.end[0, k] = start, start + stride if alone else size


@inlined
def may_hold(
    i: int, k: int, sign: float, highest: float, hidden: float, u: Rows
) -> tuple[bool, float]:
    """Whether the largest u may lie beside a coarse node, and where from it.

    Of jagged work, whether it may lie between this node and the next one.
    """
    before, here = sign * u[HALO + i - 1, k], sign * u[HALO + i, k]
    after = sign * u[HALO + i + 1, k]
    bend = 2.0 * here - before - after
    if hidden == 0.0:
        top = here >= before and here > after and here + 0.25 * bend >= highest
        return top, 0.5 * (after - before) / bend if top else 0.0
    last = sign * u[HALO + i + 2, k]
    rise = 0.25 * max(bend, 2.0 * after - here - last, 0.0) + hidden
    return max(here, after) + rise >= highest, 0.0


@inlined
def next_starts(sign: float, size: int, stride: int, high: Rows, u: Rows, peaks: Peaks) -> None:
    """Fine nodes from which to climb next, in `peaks.node`.

    `peaks.step` is 1 for lanes that have one, else 0. Of jagged work, every fine node of an
    interval is one that may hold the largest u.
    """
    for k in range(LANES):
        start, hidden = peaks.start[0, k], peaks.hidden[0, k]
        peaks.step[0, k] = 0.0
        while start < peaks.end[0, k] and peaks.step[0, k] == 0.0:
            held, place = may_hold(start // stride, k, sign, sign * high[0, k], hidden, u)
            if held:
                peaks.node[0, k] = (start + int(math.floor(stride * place + 0.5))) % size
                peaks.step[0, k] = 1.0
            start += 1 if held and hidden > 0.0 else stride - start % stride
        peaks.start[0, k] = start


@inlined
def chosen(truth: Any, one: Seen, other: Seen) -> Seen:
    """Return the first where it is true, the second where not."""
    return Seen(
        where(truth, one.u, other.u), where(truth, one.slope, other.slope),
        where(truth, one.middle, other.middle), where(truth, one.tau, other.tau),
        where(truth, one.turning, other.turning), where(truth, one.tau_middle, other.tau_middle),
    )  # fmt: skip


@inlined
def middle_of(variable: bool, left: Seen, right: Seen) -> Any:
    """Error, in the middle of a fine interval, of the cubic through u at both of its ends.

    The load is smooth: what it misses of the work is known. With variable inertia the cubic is that
    of energy over inertia, docs/solver.md (100).
    """
    if not variable:
        return left.middle
    excess = left.middle + cubic_in_middle(
        left.u * left.tau, right.u * right.tau, left.slope * left.tau + left.u * left.turning,
        right.slope * right.tau + right.u * right.turning,
    )  # fmt: skip
    inertia = left.tau_middle + cubic_in_middle(left.tau, right.tau, left.turning, right.turning)
    return excess / inertia - cubic_in_middle(left.u, right.u, left.slope, right.slope)


@inlined
def climb(
    block: int, sign: float, variable: bool, columns: ColumnRows, weights: Weights,
    designs: Designs, scratch: Scratch,
) -> tuple[Any, Any]:  # fmt: skip
    """From the fine nodes `peaks.node` up to the next maximum of `sign` times u.

    Returns it, and the correction by the middle in it.
    """
    peaks, stride = scratch.peaks, len(scratch.table.weights)
    step = 0.0 * read(weights.beta, block)
    going = step >= 0.0
    last = now = Seen(step, step, step, step, step, step)
    for number in range(2 * stride + 2):
        work_at_nodes(block, columns, designs, scratch)
        load_at_nodes(scratch)
        here = seen_by(block, variable, weights, designs, scratch)
        rising = sign * here.slope
        if number == 0:
            step = where(rising > 0.0, 1.0, -1.0)
            last = here
        else:
            now = chosen(going, here, now)
            further = going & (step * rising > 0.0)
            last = chosen(further, here, last)
            going = further
        if not any_of(going):
            break
        write(peaks.step, 0, where(going, step, 0.0))
        for k in range(LANES):
            node = peaks.node[0, k] + int(peaks.step[0, k])
            peaks.node[0, k] = node % scratch.size
    left, right = chosen(step > 0.0, last, now), chosen(step > 0.0, now, last)
    middle = middle_of(variable, left, right)
    value, bump = max_between(
        sign * left.u, sign * right.u, sign * left.slope, sign * right.slope, sign * middle
    )
    # Where no extreme lies on this side, the node is the highest.
    return where(going, sign * last.u, value), where(going, 0.0, np.abs(bump))


@inlined
def fill_hidden(block: int, columns: ColumnRows, designs: Designs, peaks: Peaks) -> None:
    """How far u may rise between coarse nodes above what their values tell."""
    part, share, jagged = designs.part, designs.share, columns.jagged
    for k in range(LANES):
        total = 0.0
        for piece in range(len(part)):
            which = block * LANES + k
            total += abs(share[piece, which]) * jagged[0, part[piece, which]]
        peaks.hidden[0, k] = JAGGED * designs.gas[block, k] * total


@inlined
def fill_extremes(
    block: int, variable: bool, columns: ColumnRows, weights: Weights, designs: Designs,
    scratch: Scratch,
) -> None:  # fmt: skip
    """Largest u and -u of the designs of a block, and how much they may miss, in `peaks`."""
    curves, lanes, peaks = scratch.curves, scratch.lanes, scratch.peaks
    size, stride = scratch.size, len(scratch.table.weights)
    fill_hidden(block, columns, designs, peaks)
    for side in range(2):
        sign = 1.0 if side == 0 else -1.0
        found = lanes.tops if side == 0 else lanes.bottoms
        high = lanes.high if side == 0 else lanes.low
        begin_search(found, size, stride, peaks)
        best, missed = -1e300 + 0.0 * read(high, 0), 0.0 * read(high, 0)
        for _ in range(size + 1):
            next_starts(sign, size, stride, high, curves.u, peaks)
            begun = (
                read(peaks.step, 0) > 0.0
            )  # other lanes (designs) have no start left to search from
            if not any_of(begun):
                break
            value, bump = climb(block, sign, variable, columns, weights, designs, scratch)
            better = begun & (value > best)
            best, missed = where(better, value, best), where(better, bump, missed)
        write(peaks.value, side, best)
        write(peaks.missed, side, missed)


KINDS = 4  # Number of values that `Columns.fine` has for each part

LOAD, SMOOTH, REST, STEEP = range(2 * KINDS, 2 * KINDS + 4)
"""Rows of `Peaks.seen` behind the rows of P and V."""


class Seen(NamedTuple):
    """Values at a fine node of each lane.

    u, what a cubic through the work misses in the middle of the fine interval behind, tau, and what
    a cubic misses of it. Slopes of u and tau are times the width of a fine interval.
    """

    u: Any
    slope: Any
    middle: Any
    tau: Any
    turning: Any
    tau_middle: Any


@inlined
def add_up_node(
    which: int, node: int, place: int, columns: ColumnRows, designs: Designs, scratch: Scratch
) -> None:
    """Work of a design at a fine node, in the row `place` of `WorkTable.fine`."""
    mixed, values, size = scratch.table.mixed, scratch.table.fine, scratch.size
    fine, factor, terms = columns.fine, designs.factor, mixed.shape[1]
    part, share = designs.part, designs.share
    for kind in range(KINDS):
        for t in range(terms):
            mixed[kind, t] = 0.0
    for piece in range(len(part)):
        here = KINDS * (part[piece, which] * size + node)
        of_part = share[piece, which]
        for kind in range(KINDS):
            for t in range(terms):
                mixed[kind, t] += of_part * fine[here + kind, t]
    here = KINDS * (SQUARE * size + node)
    for kind in range(KINDS):
        gas = square = 0.0
        for t in range(terms):
            gas += factor[which, t] * mixed[kind, t]
            square += factor[which, t] * fine[here + kind, t]
        values[place, kind], values[place, KINDS + kind] = gas, square


@inlined
def work_at_nodes(block: int, columns: ColumnRows, designs: Designs, scratch: Scratch) -> None:
    """Work of each lane at its fine node `peaks.node`, in the rows `peaks.seen`.

    Work tables are kept while designs have them in common.
    """
    table, seen, nodes = scratch.table, scratch.peaks.seen, scratch.peaks.node
    known, values, number = table.known, table.fine, designs.table
    for k in range(LANES):
        node = nodes[0, k]
        if known[0, node] != number[block, k]:
            known[0, node] = number[block, k]
            add_up_node(block * LANES + k, node, node, columns, designs, scratch)
        for kind in range(2 * KINDS):
            seen[kind, k] = values[node, kind]


@inlined
def load_at_nodes(scratch: Scratch) -> None:
    """Load of each lane at its fine node, by a polynomial through coarse nodes."""
    weights, curves, peaks = scratch.table.weights, scratch.curves, scratch.peaks
    seen = peaks.seen
    for k in range(LANES):
        coarse, place = peaks.node[0, k] // len(weights), peaks.node[0, k] % len(weights)
        y = work = drive = 0.0
        for j in range(STENCIL):
            there = HALO + coarse + j - BEFORE
            y += weights[place, j] * curves.load[there, k]
            work += weights[place, j] * curves.work[there, k]
            drive += weights[place, j] * curves.drive[there, k]
        seen[LOAD, k], seen[SMOOTH, k], seen[REST, k] = y, work, drive - work
        seen[STEEP, k] = curves.steep[coarse, k]


@inlined
def seen_by(
    block: int, variable: bool, weights: Weights, designs: Designs, scratch: Scratch
) -> Seen:
    """U and its slope at the nodes that were looked at, docs/solver.md (96).

    What polynomials through coarse nodes miss of X and of its integral is known, and so what they
    miss of the load and of r, docs/solver.md (73). The slope of the load is beta (u tau + r).
    """
    seen, width = scratch.peaks.seen, scratch.width
    gas, eta, beta = read(designs.gas, block), read(designs.eta, block), read(weights.beta, block)
    moving, turning = eta * read(seen, KINDS + VALUE), eta * read(seen, KINDS + SLOPE)
    rough = gas * read(seen, BETWEEN) - eta * read(seen, KINDS + BETWEEN)
    work, steep = gas * read(seen, VALUE) - moving, read(seen, STEEP)
    energy = work - (read(seen, LOAD) + rough * (beta * steep))
    rest = read(seen, REST) + (steep - 1.0) * (work - read(seen, SMOOTH))
    slope = gas * read(seen, SLOPE) - turning - beta * (energy + rest)
    tau_middle = eta * read(seen, KINDS + MIDDLE)
    middle = gas * read(seen, MIDDLE) - tau_middle
    u, tau = energy, 1.0 + moving
    if variable:
        u = energy / tau
        slope = (slope - u * turning) / tau
    return Seen(u, width * slope, middle, tau, width * turning, tau_middle)


@inlined
def fill_curves(
    block: int, variable: bool, columns: ColumnRows, weights: Weights, designs: Designs,
    scratch: Scratch, curves: Floats,
) -> None:  # fmt: skip
    """Q of the designs of a block at all fine nodes, and its slope: (2, lane, node)."""
    nodes, found = scratch.peaks.node, scratch.peaks.value
    for node in range(curves.shape[2]):
        for k in range(LANES):
            nodes[0, k] = node
        work_at_nodes(block, columns, designs, scratch)
        load_at_nodes(scratch)
        seen = seen_by(block, variable, weights, designs, scratch)
        write(found, 0, 1.0 + seen.u)
        write(found, 1, seen.slope * (1.0 / scratch.width))
        for k in range(LANES):
            curves[0, k, node], curves[1, k, node] = found[0, k], found[1, k]
