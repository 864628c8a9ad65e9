"""The driver of the batch solver: a kernel that solves designs in blocks."""

from __future__ import annotations

import math

from engine_dyn.compilation import inlined, kernel
from engine_dyn.speed.batch.block import LANES, LEFT, Scratch
from engine_dyn.speed.batch.extremes import (
    begin_peaks,
    end_peaks,
    fill_peak,
    fill_u,
    find_candidates,
    mean_speeds,
)
from engine_dyn.speed.batch.solution import repeat_ends, solve_curves
from engine_dyn.speed.batch.tables import fill_block, fill_factors, forget_fine, is_same_table
from engine_dyn.speed.batch.weights import Weights
from engine_dyn.speed.designs import Designs
from engine_dyn.speed.results import CANCELLED, ROUNDING, Results
from engine_dyn.speed.storage import store, store_curves
from engine_dyn.speed.task import Task
from engine_dyn.speed.work.columns import Columns
from engine_dyn.status import CONVERGED, TOLERANCE_NOT_MET
from engine_dyn.types import Booleans, Floats

__all__ = ["solve_blocks"]

LOWEST = -0.9
"""Least u of a design; what is slower is left to the general solver."""


@inlined
def write_curves(
    lane: int, which: int, task: Task, columns: Columns, designs: Designs, results: Results,
    scratch: Scratch, q: Floats, rate: Floats,
) -> None:  # fmt: skip
    """Write the curves of a lane; q and its slope at the fine nodes are scratch."""
    fill_u(lane, which, task.variable, columns, designs, scratch, q, rate)
    for node in range(q.size):
        q[node] += 1.0
    store_curves(designs.target[which], designs.speed[which], q, rate, task.angles, results)


@inlined
def finish_lane(
    lane: int, which: int, task: Task, designs: Designs, results: Results, scratch: Scratch
) -> bool:
    """Write the results of a lane; false where it is left to the general solver."""
    lanes, peaks = scratch.lanes, scratch.peaks
    top, bottom = peaks.value[0, lane], peaks.value[1, lane]
    fast, slow, mean = math.sqrt(1.0 + top), math.sqrt(1.0 - bottom), lanes.total[lane]
    error = 0.5 * (peaks.missed[0, lane] / fast + peaks.missed[1, lane] / slow)
    error += ROUNDING * (1.0 + CANCELLED * designs.eta[which]) / slow
    # The difference of two roots, without cancellation.
    span = (top + bottom) / (fast + slow)
    if not (span > 0.0 and bottom < -LOWEST):
        return False
    error *= max(1.0, span / slow) / span
    code = CONVERGED if error <= task.tolerance else TOLERANCE_NOT_MET
    speed = designs.speed[which]
    store(
        designs.target[which], code, speed * fast, speed * slow, speed * mean, speed * span,
        lanes.mu[lane], error, lanes.passes[lane], results,
    )  # fmt: skip
    return True


@kernel
def solve_blocks(
    count: int, task: Task, columns: Columns, weights: Weights, designs: Designs, results: Results,
    left: Booleans, scratch: Scratch, q: Floats, rate: Floats,
) -> None:  # fmt: skip
    """Solve the first `count` designs; `left` says which remain for the general solver.

    The arrays of designs are filled up to whole blocks. `q` and `rate` are scratch, as long as the
    fine nodes.
    """
    table, lanes = scratch.table, scratch.lanes
    current = -1
    for first in range(0, count, LANES):
        current = fill_block(
            first, current, task, columns, weights, designs, table, scratch.curves
        )
        solve_curves(
            first, task.variable, task.closure, task.iterated, task.form, weights, designs, scratch
        )
        repeat_ends(scratch.curves.u)
        repeat_ends(scratch.curves.load)
        find_candidates(lanes, scratch.curves)
        mean_speeds(lanes, scratch.curves)
        begin_peaks(lanes, scratch.curves, scratch.peaks)
        there, here = current, min(LANES, count - first)
        for lane in range(here):
            which = first + lane
            left[which] = lanes.state[lane] == LEFT or not (lanes.low[lane] > LOWEST)
            if left[which]:
                continue
            if not is_same_table(there, which, designs):
                fill_factors(which, columns, designs, table.factor)
                forget_fine(table)
                current = -1
            there = which
            for side in range(2):
                fill_peak(side, lane, which, task.variable, columns, designs, scratch)
            if task.angles.node.size > 0:
                write_curves(lane, which, task, columns, designs, results, scratch, q, rate)
        end_peaks(scratch.peaks)
        for lane in range(here):
            if not left[first + lane]:
                left[first + lane] = not finish_lane(lane, first + lane, task, designs, results, scratch)
