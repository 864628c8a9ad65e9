"""Speed of a block of designs at fine nodes, another one for each.

There the work is known from the columns, and the load is interpolated between coarse nodes.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from engine_dyn.compilation import inlined
from engine_dyn.loads.laws import Form, is_proportional, law_of, load_terms
from engine_dyn.speed.batch.block import HALO, ColumnRows, Scratch
from engine_dyn.speed.batch.weights import Weights
from engine_dyn.speed.designs import Designs
from engine_dyn.speed.vectors import LANES, read, write
from engine_dyn.speed.work.columns import BETWEEN, MIDDLE, SLOPE, VALUE
from engine_dyn.speed.work.interpolation import STENCIL
from engine_dyn.speed.work.parts import SQUARE
from engine_dyn.types import Floats

__all__ = ["Seen", "fill_curves", "load_at_nodes", "seen_by", "work_at_nodes"]

KINDS = 4
"""What `Columns.fine` has of each part."""

LOAD, REST, STEEP = range(2 * KINDS, 2 * KINDS + 3)
"""Rows of `Peaks.seen` behind those of P and V."""


class Seen(NamedTuple):
    """What is seen at a fine node of each lane.

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
def work_at_nodes(block: int, columns: ColumnRows, designs: Designs, scratch: Scratch) -> None:
    """Work of each lane at its fine node `peaks.node`, in the rows `peaks.seen`.

    Work tables are kept while designs have them in common.
    """
    table, seen, nodes = scratch.table, scratch.peaks.seen, scratch.peaks.node
    known, mixed, values = table.known, table.mixed, table.fine
    fine, factor, number = columns.fine, designs.factor, designs.table
    part, share, terms = designs.part, designs.share, mixed.shape[1]
    for k in range(LANES):
        which, node = block * LANES + k, nodes[0, k]
        if known[0, node] != number[block, k]:
            known[0, node] = number[block, k]
            for kind in range(KINDS):
                for t in range(terms):
                    mixed[kind, t] = 0.0
            for piece in range(part.shape[0]):
                here = KINDS * (part[piece, which] * known.shape[1] + node)
                of_part = share[piece, which]
                for kind in range(KINDS):
                    for t in range(terms):
                        mixed[kind, t] += of_part * fine[here + kind, t]
            here = KINDS * (SQUARE * known.shape[1] + node)
            for kind in range(KINDS):
                gas = square = 0.0
                for t in range(terms):
                    gas += factor[which, t] * mixed[kind, t]
                    square += factor[which, t] * fine[here + kind, t]
                values[node, kind], values[node, KINDS + kind] = gas, square
        for kind in range(2 * KINDS):
            seen[kind, k] = values[node, kind]


@inlined
def load_at_nodes(scratch: Scratch) -> None:
    """Load of each lane at its fine node, by a polynomial through coarse nodes."""
    weights, curves, peaks = scratch.table.weights, scratch.curves, scratch.peaks
    seen = peaks.seen
    for k in range(LANES):
        coarse, place = peaks.node[0, k] // weights.shape[0], peaks.node[0, k] % weights.shape[0]
        y = r = 0.0
        for j in range(STENCIL):
            there = HALO + coarse + j - (STENCIL // 2 - 1)
            y += weights[place, j] * curves.load[there, k]
            r += weights[place, j] * (curves.drive[there, k] - curves.work[there, k])
        seen[LOAD, k], seen[REST, k], seen[STEEP, k] = y, r, curves.steep[coarse, k]


@inlined
def load_at_node(node: int, scratch: Scratch) -> None:
    """The same, where all lanes are at one node."""
    weights, curves, seen = scratch.table.weights, scratch.curves, scratch.peaks.seen
    coarse, place = node // weights.shape[0], node % weights.shape[0]
    y = r = 0.0 * read(curves.steep, coarse)
    for j in range(STENCIL):
        there = HALO + coarse + j - (STENCIL // 2 - 1)
        y = y + weights[place, j] * read(curves.load, there)
        r = r + weights[place, j] * (read(curves.drive, there) - read(curves.work, there))
    write(seen, LOAD, y)
    write(seen, REST, r)
    write(seen, STEEP, read(curves.steep, coarse))


@inlined
def seen_by(
    block: int, variable: bool, weights: Weights, designs: Designs, scratch: Scratch
) -> Seen:
    """U and its slope at the nodes that were looked at, docs/solver.md (96).

    The integral of X is known where a polynomial misses it. The slope of the load is
    beta (u tau + r).
    """
    seen, width = scratch.peaks.seen, scratch.width
    gas, eta, beta = read(designs.gas, block), read(designs.eta, block), read(weights.beta, block)
    moving, turning = eta * read(seen, KINDS + VALUE), eta * read(seen, KINDS + SLOPE)
    rough = gas * read(seen, BETWEEN) - eta * read(seen, KINDS + BETWEEN)
    energy = gas * read(seen, VALUE) - moving
    energy = energy - (read(seen, LOAD) + rough * (beta * read(seen, STEEP)))
    slope = gas * read(seen, SLOPE) - turning - beta * (energy + read(seen, REST))
    tau_middle = eta * read(seen, KINDS + MIDDLE)
    middle = gas * read(seen, MIDDLE) - tau_middle
    u, tau = energy, 1.0 + moving
    if variable:
        u = energy / tau
        slope = (slope - u * turning) / tau
    return Seen(u, width * slope, middle, tau, width * turning, tau_middle)


@inlined
def fill_curves(
    block: int, variable: bool, form: Form, columns: ColumnRows, weights: Weights, designs: Designs,
    scratch: Scratch, curves: Floats,
) -> None:  # fmt: skip
    """Q of the designs of a block at all fine nodes, and its slope (97): (4, lane, node).

    The other two are scratch: slopes of tau, and tau.
    """
    nodes, seen, lanes = scratch.peaks.node, scratch.peaks.seen, scratch.lanes
    value, gas, eta = scratch.peaks.value, designs.gas, designs.eta
    for node in range(curves.shape[2]):
        for k in range(LANES):
            nodes[0, k] = node
        work_at_nodes(block, columns, designs, scratch)
        load_at_node(node, scratch)
        write(value, 0, seen_by(block, variable, weights, designs, scratch).u)
        for k in range(LANES):
            turning = eta[block, k] * seen[KINDS + SLOPE, k]
            curves[0, k, node] = value[0, k]
            curves[1, k, node] = gas[block, k] * seen[SLOPE, k] - turning
            curves[2, k, node] = turning if variable else 0.0
            curves[3, k, node] = 1.0 + eta[block, k] * seen[KINDS + VALUE, k] if variable else 1.0
    for k in range(LANES):
        law, _ = law_of(
            designs.speed[block, k], designs.first[block, k], designs.second[block, k],
            designs.gear[block, k], form,
        )  # fmt: skip
        kappa, gain = designs.kappa[block, k], 1.0 / lanes.mu[0, k]
        for node in range(curves.shape[2]):
            u = curves[0, k, node]
            force = 1.0 + u
            if not is_proportional(designs.first[block, k], form):  # which needs no power
                force, _ = load_terms(1.0 + u, law)
            slope = curves[1, k, node] - kappa * (force * gain - 1.0)
            curves[0, k, node] = 1.0 + u
            curves[1, k, node] = (slope - u * curves[2, k, node]) / curves[3, k, node]
