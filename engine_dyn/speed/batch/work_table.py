"""From columns to the work of a block of designs."""

from __future__ import annotations

import numpy as np

from engine_dyn.compilation import inlined
from engine_dyn.speed.batch.block import HALO, LEFT, ColumnRows, Scratch, WorkTable, repeat_ends
from engine_dyn.speed.batch.weights import Weights
from engine_dyn.speed.designs import Designs
from engine_dyn.speed.vectors import LANES, Rows, read, where, write
from engine_dyn.speed.work.columns import SQUARE

LIGHTEST = 0.4
"""Least inertia over its mean at any node; a design with less is left to the general solver."""


@inlined
def add_columns(part: int, coarse: Rows, table: WorkTable, curve: Rows, missed: Rows) -> None:
    """Add the columns of a part, times `table.share` and the factors."""
    shared, share = table.shared, read(table.share, 0)
    for t in range(len(shared)):
        write(shared, t, share * read(table.factor, t))
    for i in range(len(curve)):
        place = 2 * (part * len(curve) + i)
        value, rough = read(curve, i), read(missed, i)
        for t in range(len(shared)):
            factor = read(shared, t)
            value = value + factor * coarse[place, t]
            rough = rough + factor * coarse[place + 1, t]
        write(curve, i, value)
        write(missed, i, rough)


@inlined
def fill_work_table(block: int, columns: ColumnRows, designs: Designs, table: WorkTable) -> None:
    """Work tables of the designs of a block."""
    coarse, part, share, first = columns.coarse, designs.part, designs.share, block * LANES
    for t in range(len(table.factor)):
        for lane in range(LANES):
            table.factor[t, lane] = designs.factor[first + lane, t]
    for i in range(len(table.gas)):
        write(table.gas, i, 0.0)
        write(table.gas_missed, i, 0.0)
        write(table.square, i, 0.0)
        write(table.square_missed, i, 0.0)
    write(table.share, 0, 1.0)
    add_columns(SQUARE, coarse, table, table.square, table.square_missed)
    for piece in range(len(part)):
        # Designs that have a part in common follow each other; others get 0 of it.
        begin = 0
        while begin < LANES:
            which, some, end = part[piece, first + begin], False, begin
            write(table.share, 0, 0.0)
            while end < LANES and part[piece, first + end] == which:
                table.share[0, end] = share[piece, first + end]
                some = some or share[piece, first + end] != 0.0
                end += 1
            if some:
                add_columns(which, coarse, table, table.gas, table.gas_missed)
            begin = end


@inlined
def fill_work(
    block: int, variable: bool, weights: Weights, designs: Designs, scratch: Scratch
) -> None:
    """X of a block, docs/method.md (55), what six nodes miss of it, and 1/tau.

    Designs whose variable inertia falls too low somewhere are left to the general solver.
    """
    table, curves, state = scratch.table, scratch.curves, read(weights.state, block)
    gas, eta = read(designs.gas, block), read(designs.eta, block)
    lightest = 1.0 + 0.0 * eta
    for i in range(len(table.gas)):
        v = eta * read(table.square, i)
        write(curves.work, HALO + i, gas * read(table.gas, i) - v)
        write(
            curves.missed, i, gas * read(table.gas_missed, i) - eta * read(table.square_missed, i)
        )
        if variable:
            lightest = np.minimum(1.0 + v, lightest)
            write(curves.light, i, 1.0 / (1.0 + v))
    repeat_ends(curves.work)
    if variable:
        state = where(lightest > LIGHTEST, state, LEFT)
    write(scratch.lanes.state, 0, state)
