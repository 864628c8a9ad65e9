"""The driver of the batch solver: a kernel that solves designs in blocks."""

from __future__ import annotations

import math

from engine_dyn.compilation import inlined, kernel
from engine_dyn.loads.laws import covers, law_of
from engine_dyn.speed.batch.block import LANES, LEFT, Scratch
from engine_dyn.speed.batch.extremes import (
    One,
    begin_peaks,
    end_peaks,
    fill_peaks,
    fill_u,
    find_candidates,
    mean_speeds,
)
from engine_dyn.speed.batch.solution import repeat_ends, solve_curves
from engine_dyn.speed.batch.tables import fill_block
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
def finish_block(
    first: int, count: int, task: Task, designs: Designs, results: Results, left: Booleans,
    scratch: Scratch,
) -> None:  # fmt: skip
    """Write the results of a block; `left` marks what is left to the general solver."""
    value, missed = scratch.peaks.value, scratch.peaks.missed
    total, mu, passes = scratch.lanes.total, scratch.lanes.mu, scratch.lanes.passes
    speeds, eta, gears, target = designs.speed, designs.eta, designs.gear, designs.target
    wanted, scalars, status, form = results.wanted, results.scalars, results.status, task.form
    for lane in range(count):
        which = first + lane
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
            target[which], speed * fast, speed * slow, speed * total[lane], speed * span, mu[lane],
            error, passes[lane], wanted, scalars,
        )  # fmt: skip


@kernel
def solve_blocks(
    count: int, task: Task, columns: Columns, weights: Weights, designs: Designs, results: Results,
    left: Booleans, scratch: Scratch, q: Floats, rate: Floats,
) -> None:  # fmt: skip
    """Solve the first `count` designs; `left` says which remain for the general solver.

    The arrays of designs are filled up to whole blocks. `q` and `rate` are scratch, as long as the
    fine nodes.
    """
    lanes, curves = scratch.lanes, scratch.curves
    current = -1
    for first in range(0, count, LANES):
        before = current
        current = fill_block(first, current, task, columns, weights, designs, scratch.table, curves)
        solve_curves(
            first, task.variable, task.closure, task.iterated, task.form, weights, designs, scratch
        )
        repeat_ends(curves.u)
        repeat_ends(curves.load)
        find_candidates(lanes, curves)
        mean_speeds(lanes, curves)
        begin_peaks(lanes, curves, scratch.peaks)
        here = min(LANES, count - first)
        for lane in range(here):
            slow = lanes.state[lane] == LEFT or not (lanes.low[lane] > LOWEST)
            left[first + lane] = slow
        # Fine nodes are known where the whole block has the table of the block before.
        same = designs.table[first] == designs.table[first + here - 1] == before
        fill_peaks(
            first, here, before if same else -1, task.variable, columns, weights, designs, left,
            scratch,
        )  # fmt: skip
        end_peaks(scratch.peaks)
        finish_block(first, here, task, designs, results, left, scratch)
        if task.angles.node.size > 0:
            # These overwrite the fine nodes.
            current = -1
            for lane in range(here):
                which = first + lane
                if left[which]:
                    continue
                one = One(
                    which, lane, designs.gas[which], designs.eta[which], weights.beta[which],
                    task.variable, scratch.width,
                )  # fmt: skip
                law, _ = law_of(
                    designs.speed[which], designs.first[which], designs.second[which],
                    designs.gear[which], task.form,
                )  # fmt: skip
                fill_u(
                    one, law, designs.kappa[which], lanes.mu[lane], columns, designs, scratch, q,
                    rate,
                )  # fmt: skip
                for node in range(q.size):
                    q[node] += 1.0
                store_curves(
                    designs.target[which], designs.speed[which], q, rate, task.angles, results
                )
