"""What all designs of one call of a kernel have in common."""

from __future__ import annotations

from typing import NamedTuple

from engine_dyn.loads.laws import Form
from engine_dyn.speed.storage import Angles

__all__ = ["Task"]


class Task(NamedTuple):
    """What all designs of a call have in common.

    Attributes
    ----------
    method : int
        Code of `engine_dyn.speed.methods`.
    variable : bool
        Whether the inertia varies over the crank angle.
    closure : int
        POWER_MEAN or CYCLE_TIME.
    tolerance, iterated : float
        Relative error of delta aimed at, and error that iterations may leave over the range of q.
    form : Form
        Of the law over speed.
    angles : Angles
        Where curves are wanted.
    """

    method: int
    variable: bool
    closure: int
    tolerance: float
    iterated: float
    form: Form
    angles: Angles
