"""The front of the batch solver: memory of a call, and the kernel that solves blocks."""

from __future__ import annotations

import math

import numpy as np

from engine_dyn.compilation import inlined, kernel
from engine_dyn.loads.laws import covers
from engine_dyn.plain_arrays import plain
from engine_dyn.speed.batch.block import LEFT, ColumnRows, Scratch, column_rows, make_scratch
from engine_dyn.speed.batch.extremes import fill_curves, fill_extremes, find_candidates
from engine_dyn.speed.batch.solution import solve_curves
from engine_dyn.speed.batch.work_table import Weights, fill_work, fill_work_table, weights_of
from engine_dyn.speed.designs import Designs, Task, store, store_curves
from engine_dyn.speed.fields import Results
from engine_dyn.speed.vectors import LANES, rows_of
from engine_dyn.speed.work.columns import Columns
from engine_dyn.status import CONVERGED, TOLERANCE_NOT_MET
from engine_dyn.types import Booleans, Floats

# Lowest u = (omega/omega_n)^2 - 1 of a design; slower designs are left to the general solver
LOWEST = -0.9


def solve_in_blocks(
    task: Task, columns: Columns, designs: Designs, results: Results, left: Booleans
) -> None:
    """Solve designs that share columns; `left` says which remain for the general solver.

    `left` has as many entries as there are designs; the arrays of `designs` are filled up to whole
    blocks.
    """
    nodes, coarse = columns.fine.shape[1], columns.coarse.shape[1]
    weights = weights_of(designs, task.form, columns.width * (nodes // coarse), coarse)
    curves = np.empty((2, LANES, nodes if task.angles.node.size else 0))
    blocks = Designs(*map(rows_of, designs))._replace(
        factor=plain(designs.factor), part=plain(designs.part), share=plain(designs.share)
    )
    # Booleans are passed as bytes: Numba mistakes boolean arrays of `PlainArray` for common ones,
    # and would search for the kernel anew.
    still_left = plain(left.view(np.uint8))
    solve_blocks(
        left.size, plain(task), column_rows(columns), Weights(*map(rows_of, weights)), blocks,
        plain(results), still_left, make_scratch(columns), plain(curves),
    )  # fmt: skip


@inlined
def finish_block(
    block: int, here: int, task: Task, designs: Designs, results: Results, left: Booleans,
    scratch: Scratch,
) -> None:  # fmt: skip
    """Write the results of a block; `left` marks what is left to the general solver."""
    value, missed = scratch.peaks.value, scratch.peaks.missed
    lanes = scratch.lanes
    mean, mu, passes = lanes.mean, lanes.mu, lanes.passes
    speeds, unsure, gears, target = designs.speed, designs.unsure, designs.gear, designs.target
    wanted, scalars, status, form = results.wanted, results.scalars, results.status, task.form
    for lane in range(here):
        which = block * LANES + lane
        left[which] = lanes.state[0, lane] == LEFT or not (lanes.low[0, lane] > LOWEST)
        if left[which]:
            continue
        top, bottom = value[0, lane], value[1, lane]
        fast, slow, speed = math.sqrt(1.0 + top), math.sqrt(1.0 - bottom), speeds[block, lane]
        # Difference of two roots, without subtracting nearly equal numbers.
        span = (top + bottom) / (fast + slow)
        gear = gears[block, lane] if form.own else 1.0
        good = span > 0.0 and bottom < -LOWEST
        if not (good and covers(gear * speed * fast, gear * speed * slow, form)):
            left[which] = True
            continue
        error = 0.5 * (missed[0, lane] / fast + missed[1, lane] / slow)
        error += unsure[block, lane] / slow
        error *= max(1.0, span / slow) / span
        place = target[block, lane]
        status[place] = CONVERGED if error <= task.tolerance else TOLERANCE_NOT_MET
        store(
            place, speed * fast, speed * slow, speed * mean[0, lane], speed * span, mu[0, lane],
            error, passes[0, lane], wanted, scalars,
        )  # fmt: skip


@kernel
def solve_blocks(
    count: int, task: Task, columns: ColumnRows, weights: Weights, designs: Designs,
    results: Results, left: Booleans, scratch: Scratch, fine: Floats,
) -> None:  # fmt: skip
    """Solve the first `count` designs; `left` says which remain for the general solver.

    The arrays of designs are filled up to whole blocks. `fine` is scratch for curves, (2, lane,
    fine node).
    """
    number = designs.table
    known = -1  # number of the work table that all designs of the previous block share; -1: none
    for block in range(-(-count // LANES)):
        first, last = number[block, 0], number[block, LANES - 1]
        if not first == last == known:
            fill_work_table(block, columns, designs, scratch.table)
        known = first if first == last else -1
        here = min(LANES, count - block * LANES)
        # The five functions below are called one by one: a function for all of them, with
        # everything inlined, took a second to compile.
        fill_work(block, task.variable, weights, designs, scratch)
        solve_curves(
            block, task.variable, task.closure, task.iterated, task.form, weights, designs, scratch
        )
        find_candidates(scratch.lanes, scratch.curves)
        fill_extremes(block, task.variable, columns, weights, designs, scratch)
        finish_block(block, here, task, designs, results, left, scratch)
        if len(task.angles.node) > 0:
            fill_curves(block, task.variable, columns, weights, designs, scratch, fine)
            for lane in range(here):
                if not left[block * LANES + lane]:
                    store_curves(
                        designs.target[block, lane], designs.speed[block, lane], fine[0, lane],
                        fine[1, lane], task.angles, results,
                    )  # fmt: skip
