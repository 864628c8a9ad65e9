"""Program of a GPU: the functions of the batch solver, with one lane, a thread a design.

There is no second physics: the functions of `engine_dyn.speed.batch` are compiled for the card as
they stand. Here is what takes the place of vectors and of work tables that are kept.
"""

from __future__ import annotations

import math
from typing import Any

from engine_dyn.loads.laws import Form
from engine_dyn.speed.batch.block import ColumnRows, Curves, Lanes, Peaks, Scratch, WorkTable
from engine_dyn.speed.batch.extremes import KINDS, add_up_node, fill_extremes, find_candidates
from engine_dyn.speed.batch.in_blocks import finish_block
from engine_dyn.speed.batch.solution import solve_curves
from engine_dyn.speed.batch.work_table import (
    Weights,
    fill_work,
    fill_work_table,
    recurrence,
    slope_of_design,
)
from engine_dyn.speed.designs import Angles, Designs, Task
from engine_dyn.speed.fields import AUTO, POWER_MEAN, Results

# --- replacements on the card of functions for vectors: each thread has one lane ------------------


def read(rows: Any, row: int) -> Any:
    """Return the number of a row."""
    return rows[row, 0]


def write(rows: Any, row: int, value: Any) -> None:
    """Put a number into a row."""
    rows[row, 0] = value


def where(truth: Any, one: Any, other: Any) -> Any:
    """Return the first where it is true, the second where not."""
    return one if truth else other


def any_of(truth: Any) -> Any:
    """Whether it is true."""
    return truth


def larger(one: float, other: float) -> float:
    """Larger of two; of two of which one is NaN, the second, as for vectors."""
    return one if one > other else other


def smaller(one: float, other: float) -> float:
    """Smaller of two; of two of which one is NaN, the second, as for vectors."""
    return one if one < other else other


def root(square: float) -> float:
    """Square root, NaN below 0."""
    return math.sqrt(square) if square >= 0.0 else math.nan


def work_at_nodes(block: int, columns: ColumnRows, designs: Designs, scratch: Scratch) -> None:
    """Work at the fine node `peaks.node`, in `peaks.seen`: `nodes.work_at_nodes`, nothing kept."""
    add_up_node(0, scratch.peaks.node[0, 0], 0, columns, designs, scratch)
    for kind in range(2 * KINDS):
        scratch.peaks.seen[kind, 0] = scratch.table.fine[0, kind]


INSTEAD: dict[str, Any] = {
    "LANES": 1, "read": read, "write": write, "where": where, "any_of": any_of,
    "work_at_nodes": work_at_nodes,
    "np": {
        "maximum": larger, "minimum": smaller, "sqrt": root, "abs": math.fabs, "exp": math.exp,
        "expm1": math.expm1,
    },
}  # fmt: skip
"""Replacements of some names that functions of the batch solver use, on a card."""


# --- solving one design on the card ---------------------------------------------------------------


def scratch_of(
    thread: int, width: float, size: int, e: Any, r: Any, whole: Any, mixed: Any, node: Any,
    between: Any,
) -> Scratch:  # fmt: skip
    """Memory of a thread: its column of `r`, whose rows end at `e`, see `row_numbers`."""
    me = slice(thread, thread + 1)
    begin = whole[0:1, me]
    return Scratch(
        Curves(
            r[e[7] : e[8], me], r[e[8] : e[9], me], r[e[9] : e[10], me],
            r[e[10] : e[11], me], r[e[11] : e[12], me], r[e[12] : e[13], me],
            r[e[13] : e[14], me],
        ),
        Lanes(
            r[e[14] : e[15], me], r[e[15] : e[16], me], r[e[16] : e[17], me],
            r[e[17] : e[18], me], r[e[18] : e[19], me], r[e[19] : e[20], me],
            r[e[20] : e[21], me], r[e[21] : e[22], me], r[e[22] : e[23], me],
            r[e[23] : e[24], me], r[e[24] : e[25], me], r[e[25] : e[26], me],
            r[e[26] : e[27], me],
        ),
        r[e[32] : e[33], me],
        WorkTable(
            r[e[0] : e[1], me], r[e[1] : e[2], me], r[e[2] : e[3], me],
            r[e[3] : e[4], me], r[e[4] : e[5], me], r[e[5] : e[6], me],
            r[e[6] : e[7], me],
            node[:, :, thread], begin, mixed[:, :, thread], between,
        ),
        Peaks(
            begin, whole[1:2, me], whole[2:3, me],
            r[e[27] : e[28], me], r[e[28] : e[29], me], r[e[29] : e[30], me],
            r[e[30] : e[31], me], r[e[31] : e[32], me],
        ),
        r[e[33] : e[34], me], width, size,
    )  # fmt: skip


def design_of(which: int, terms: int, numbers: Any, places: Any) -> Designs:
    """Numbers of a design, as of one alone; `places` has its place, and its parts."""
    own, part = numbers[:, which : which + 1], places[:, which : which + 1]
    return Designs(
        own[0:1], own[1:2], own[2:3], own[3:4], own[4:5], own[5:6], own[6:7], own[7:8],
        own[8 : 8 + terms].T, part[0:1], part[1:], own[8 + terms :], part[0:1],
    )  # fmt: skip


def solve_on_card(
    thread: int, threads: int, count: int, kind: int, sign: float, geared: int, tolerance: float,
    iterated: float, width: float, size: int, fine: Any, coarse: Any, jagged: Any, between: Any,
    e: Any, r: Any, whole: Any, mixed: Any, node: Any, numbers: Any, places: Any, wanted: Any,
    scalars: Any, status: Any, left: Any,
) -> None:  # fmt: skip
    """Solve every `threads`-th of `count` designs, from the one that is the thread's number on.

    Arrays are those of `buffers_of`.
    """
    columns, me = ColumnRows(fine, coarse, jagged), slice(thread, thread + 1)
    scratch = scratch_of(thread, width, size, e, r, whole, mixed, node, between)
    form = Form(kind, sign, geared != 0, numbers[0:3, 0:0])
    task = Task(AUTO, False, POWER_MEAN, tolerance, iterated, form, Angles(wanted, numbers))
    results = Results(wanted, scalars, status, scalars, scalars, left)
    intervals, terms = scratch.table.gas.shape[0], fine.shape[1]
    weights = Weights(
        r[e[34] : e[35], me], r[e[35] : e[36], me], r[e[36] : e[37], me],
        r[e[37] : e[38], me], r[e[38] : e[39], me], r[e[39] : e[40], me],
        r[e[40] : e[41], me],
    )  # fmt: skip
    for which in range(thread, count, threads):
        designs = design_of(which, terms, numbers, places)
        slope, direction = slope_of_design(
            designs.speed[0, 0], designs.first[0, 0], designs.second[0, 0], designs.gear[0, 0], form
        )
        found = recurrence(
            designs.kappa[0, 0], slope, direction, width * (size // intervals), intervals
        )
        weights.slope[0, 0], weights.beta[0, 0], weights.state[0, 0] = found[0], found[1], found[2]
        weights.decay[0, 0], weights.of_mass[0, 0] = found[3], found[4]
        weights.of_tilt[0, 0], weights.end[0, 0] = found[5], found[6]
        fill_work_table(0, columns, designs, scratch.table)
        fill_work(0, False, weights, designs, scratch)
        solve_curves(0, False, POWER_MEAN, iterated, form, weights, designs, scratch)
        find_candidates(scratch.lanes, scratch.curves)
        fill_extremes(0, False, columns, weights, designs, scratch)
        finish_block(0, 1, task, designs, results, left[which : which + 1], scratch)
