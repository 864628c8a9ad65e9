"""The front of the batch solver: memory of a call of its kernel."""

from __future__ import annotations

import numpy as np

from engine_dyn.speed.batch.block import make_scratch, tables_of
from engine_dyn.speed.batch.driver import solve_blocks
from engine_dyn.speed.batch.weights import Weights, weights_of
from engine_dyn.speed.designs import Designs
from engine_dyn.speed.results import Results
from engine_dyn.speed.task import Task
from engine_dyn.speed.vectors import LANES, rows_of
from engine_dyn.speed.work.columns import Columns
from engine_dyn.types import Booleans

__all__ = ["solve_in_blocks"]


def solve_in_blocks(
    task: Task, columns: Columns, designs: Designs, results: Results, left: Booleans
) -> None:
    """Solve designs that share columns; `left` says which remain for the general solver.

    `left` has as many entries as there are designs; the arrays of `designs` are filled up to whole
    blocks.
    """
    nodes, coarse = columns.fine.shape[1], columns.coarse.shape[1]
    weights = weights_of(designs, task.form, columns.width * (nodes // coarse), coarse)
    curves = task.angles.node.size > 0
    solve_blocks(
        left.size, task, tables_of(columns), Weights(*(rows_of(array) for array in weights)),
        in_blocks(designs), results, left, make_scratch(columns),
        np.empty((4, LANES, nodes if curves else 0)),
    )  # fmt: skip


def in_blocks(designs: Designs) -> Designs:
    """Designs as kernels take them: numbers in rows (block, lane)."""
    found = [rows_of(array) for array in designs]
    return Designs(*found)._replace(
        factor=rows_of(designs.factor, designs.factor.shape[1]),
        part=rows_of(designs.part, designs.target.size),
        share=rows_of(designs.share, designs.target.size),
    )
