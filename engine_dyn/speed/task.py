"""What all designs of one call of a kernel have in common."""

from __future__ import annotations

from typing import NamedTuple

from engine_dyn.loads.laws import Form
from engine_dyn.speed.storage import Angles

__all__ = ["Task"]


class Task(NamedTuple):
    """Arguments of `dispatch.solve` as kernels take them.

    `method` and `closure` are codes of `engine_dyn.speed.methods`, `variable` says whether the
    inertia varies over the crank angle, `tolerance` is the relative error of delta aimed at,
    `iterated` the error over the range of q that iterations may leave, and curves are wanted at
    `angles`.
    """

    method: int
    variable: bool
    closure: int
    tolerance: float
    iterated: float
    form: Form
    angles: Angles
