"""The front of the batch solver: memory of a call of its kernel."""

from __future__ import annotations

import numpy as np

from engine_dyn.speed.batch.block import make_scratch
from engine_dyn.speed.batch.driver import solve_blocks
from engine_dyn.speed.batch.weights import weights_of
from engine_dyn.speed.designs import Designs
from engine_dyn.speed.results import Results
from engine_dyn.speed.task import Task
from engine_dyn.speed.vectors import LANES
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
    nodes = columns.fine.shape[1]
    coarse = columns.coarse.shape[1]
    weights = weights_of(designs, task.form, columns.width * (nodes // coarse), coarse)
    solve_blocks(
        left.size, task, columns, weights, designs, results, left,
        make_scratch(coarse, nodes, len(columns.degrees), columns.width), np.empty((LANES, nodes)), np.empty((LANES, nodes)),
    )  # fmt: skip
