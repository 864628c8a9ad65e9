"""The driver of the batch solver: a kernel that solves designs in blocks."""

from __future__ import annotations

import math

from engine_dyn.compilation import inlined, kernel
from engine_dyn.loads.laws import covers
from engine_dyn.speed.batch.block import LEFT, Scratch, repeat_ends
from engine_dyn.speed.batch.extremes import (
    fill_extremes,
    find_candidates,
    mean_speeds,
)
from engine_dyn.speed.batch.nodes import fill_curves
from engine_dyn.speed.batch.solution import solve_curves
from engine_dyn.speed.batch.tables import fill_tables, fill_work
from engine_dyn.speed.batch.weights import Weights
from engine_dyn.speed.designs import Designs
from engine_dyn.speed.results import CANCELLED, ROUNDING, Results
from engine_dyn.speed.storage import store, store_curves
from engine_dyn.speed.task import Task
from engine_dyn.speed.vectors import LANES
from engine_dyn.speed.work.columns import Columns
from engine_dyn.status import CONVERGED, TOLERANCE_NOT_MET
from engine_dyn.types import Booleans, Floats

__all__ = ["solve_blocks"]

LOWEST = -0.9
"""Least u of a design; what is slower is left to the general solver."""


@inlined
def finish_block(
    first: int, count: int, task: Task, designs: Designs, results: Results, left: Booleans,
    scratch: Scratch,
) -> None:  # fmt: skip
    """Write the results of a block; `left` marks what is left to the general solver."""
    value, missed = scratch.peaks.value, scratch.peaks.missed
    lanes = scratch.lanes
    mean, mu, passes = lanes.mean, lanes.mu, lanes.passes
    speeds, eta, gears, target = designs.speed, designs.eta, designs.gear, designs.target
    wanted, scalars, status, form = results.wanted, results.scalars, results.status, task.form
    for lane in range(count):
        which = first + lane
        left[which] = lanes.state[0, lane] == LEFT or not (lanes.low[0, lane] > LOWEST)
        if left[which]:
            continue
        top, bottom = value[0, lane], value[1, lane]
        fast, slow, speed = math.sqrt(1.0 + top), math.sqrt(1.0 - bottom), speeds[which]
        # The difference of two roots, without cancellation.
        span = (top + bottom) / (fast + slow)
        gear = gears[which] if form.own else 1.0
        good = span > 0.0 and bottom < -LOWEST
        if not (good and covers(gear * speed * fast, gear * speed * slow, form)):
            left[which] = True
            continue
        error = 0.5 * (missed[0, lane] / fast + missed[1, lane] / slow)
        error += ROUNDING * (1.0 + CANCELLED * eta[which]) / slow
        error *= max(1.0, span / slow) / span
        status[target[which]] = CONVERGED if error <= task.tolerance else TOLERANCE_NOT_MET
        store(
            target[which], speed * fast, speed * slow, speed * mean[0, lane], speed * span,
            mu[0, lane], error, passes[0, lane], wanted, scalars,
        )  # fmt: skip


@kernel
def solve_blocks(
    count: int, task: Task, columns: Columns, weights: Weights, designs: Designs, results: Results,
    left: Booleans, scratch: Scratch, q: Floats, rate: Floats,
) -> None:  # fmt: skip
    """Solve the first `count` designs; `left` says which remain for the general solver.

    The arrays of designs are filled up to whole blocks. `q` and `rate` are scratch, of all lanes
    at the fine nodes.
    """
    lanes, curves, number = scratch.lanes, scratch.curves, designs.table
    current = -1  # number of the table of all designs of the block before; -1 where they differ
    for first in range(0, count, LANES):
        same = number[first] == number[first + LANES - 1]
        if not (same and number[first] == current):
            fill_tables(first, columns, designs, scratch.table)
        fill_work(first, task.variable, weights, designs, scratch)
        solve_curves(
            first, task.variable, task.closure, task.iterated, task.form, weights, designs, scratch
        )
        find_candidates(lanes, curves)
        repeat_ends(curves.load)
        mean_speeds(lanes, curves)
        current = number[first] if same else -1
        fill_extremes(first, task.variable, columns, weights, designs, scratch)
        here = min(LANES, count - first)
        finish_block(first, here, task, designs, results, left, scratch)
        if task.angles.node.size > 0:
            fill_curves(
                first, task.variable, task.form, columns, weights, designs, scratch, q, rate
            )
            for lane in range(here):
                which = first + lane
                if not left[which]:
                    store_curves(
                        designs.target[which], designs.speed[which], q[lane], rate[lane],
                        task.angles, results,
                    )  # fmt: skip
