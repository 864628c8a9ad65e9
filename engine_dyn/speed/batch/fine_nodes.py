"""Speed of a block of designs at fine nodes, another one for each.

There the work is known from the columns, and the load is interpolated between coarse nodes.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from engine_dyn.compilation import inlined
from engine_dyn.speed.batch.block import HALO, ColumnRows, Scratch
from engine_dyn.speed.batch.weights import Weights
from engine_dyn.speed.designs import Designs
from engine_dyn.speed.vectors import LANES, read, write
from engine_dyn.speed.work.columns import BETWEEN, MIDDLE, SLOPE, SQUARE, VALUE
from engine_dyn.speed.work.interpolation import BEFORE, STENCIL
from engine_dyn.types import Floats

KINDS = 4
"""What `Columns.fine` has of each part."""

LOAD, SMOOTH, REST, STEEP = range(2 * KINDS, 2 * KINDS + 4)
"""Rows of `Peaks.seen` behind those of P and V."""


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
