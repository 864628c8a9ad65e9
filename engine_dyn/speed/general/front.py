"""The front of the general solver: what its kernels need beside the designs."""

from __future__ import annotations

import numpy as np

from engine_dyn.loads.laws import POWER
from engine_dyn.speed.designs import Designs
from engine_dyn.speed.general.curve import make_curve
from engine_dyn.speed.general.driver import follow_designs, solve_designs
from engine_dyn.speed.results import Results
from engine_dyn.speed.task import Task
from engine_dyn.speed.work.columns import Columns
from engine_dyn.status import (
    INVALID_INPUT,
    NO_STEADY_STATE,
    NOT_CONVERGED,
    STALLED,
    TOLERANCE_NOT_MET,
)
from engine_dyn.types import Integers

__all__ = ["solve_one_by_one"]


def solve_one_by_one(
    chosen: Integers, task: Task, columns: Columns, designs: Designs, results: Results, last: bool
) -> None:
    """Solve the designs `chosen`, such as those that the batch solver leaves.

    Where Newton's method finds no solution, cycles are followed in time. `last` says that no more
    nodes are tried.
    """
    curve = make_curve(columns.fine.shape[1])
    solve_designs(chosen, task, columns, designs, curve, results)
    outcomes = followed(task, last)
    left = chosen[np.isin(results.status[designs.target[chosen]], outcomes)]
    # Compiled only where there are such designs.
    if left.size:
        follow_designs(left, task, columns, designs, curve, results)


def followed(task: Task, last: bool) -> tuple[int, ...]:
    """Outcomes of Newton's method after which cycles are followed.

    With a power of the speed its stalls are certain. With other laws it may find a false solution,
    such as one beyond the ends of a table. The last number of nodes is where a missed tolerance
    counts: the load may be so strong that no number of nodes resolves it.
    """
    doubtful = (NOT_CONVERGED, STALLED, NO_STEADY_STATE, INVALID_INPUT)
    of_law = () if task.form.kind == POWER else doubtful
    return (*of_law, NOT_CONVERGED, TOLERANCE_NOT_MET) if last else of_law
