"""Weights of the recurrence along the coarse nodes, for each design."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from engine_dyn.compilation import inlined, kernel
from engine_dyn.loads.laws import LAWS, Form, law_of, load_terms, slope_and_sign
from engine_dyn.plain_arrays import plain
from engine_dyn.speed.batch.block import LEFT, SOLVING
from engine_dyn.speed.designs import Designs
from engine_dyn.speed.vectors import where
from engine_dyn.types import Floats

TINY = 1e-11  # Least beta [1/rad]: where there is no load, it stands for the limit of a weak one

LARGEST_STEP = 0.05
"""Largest beta times coarse interval: a stronger load is left to the general solver."""


class Weights(NamedTuple):
    """Numbers of each design, docs/solver.md (71) and (74), shape (designs,)."""

    slope: Floats  # s, the slope of the law at the nominal speed
    beta: Floats  # kappa s [1/rad]
    state: Floats  # `SOLVING`, or `LEFT` where the load is too strong, or a drive
    # exp(-beta h), and the weights of mean and first moment of an interval.
    decay: Floats
    of_mass: Floats
    of_tilt: Floats
    end: Floats  # 1 - exp(-beta Phi_s)


def weights_of(designs: Designs, form: Form, width: float, nodes: int) -> Weights:
    """Weights for coarse intervals of this width [rad], so many in a period."""
    if LAWS[form.kind].torque is None:
        slope, sign = np.empty(designs.kappa.size), np.empty(designs.kappa.size)
        _of_table(plain(designs), plain(form), slope, sign)
    else:
        slope, sign = slope_and_sign(designs.speed, designs.first, designs.second, form)
    with np.errstate(invalid="ignore"):
        found = recurrence(designs.kappa, np.ascontiguousarray(slope), sign, width, nodes)
    return Weights._make(found)


def recurrence(kappa: Any, slope: Any, sign: Any, width: float, nodes: int) -> tuple[Any, ...]:
    """Members of `Weights`, in its order, of arrays or of the numbers of one design.

    `sign` has that of the mean torque that the law needs. No load drives, no driver brakes, and
    both oppose deviations or do not depend on the speed.
    """
    step = kappa * slope * width
    solvable = (kappa * sign > 0.0) & (step >= 0.0) & (step <= LARGEST_STEP)
    x = where(solvable, np.maximum(step, TINY * width), TINY * width)
    square = x * x
    of_tilt = square * np.exp(-0.5 * x) * (1.0 + square * (0.025 + square / 4480.0))
    return (
        slope, x / width, where(solvable, SOLVING, LEFT), np.exp(-x), -np.expm1(-x), of_tilt,
        -np.expm1(-x * nodes),
    )  # fmt: skip


@inlined
def slope_of_design(
    speed: float, first: float, second: float, gear: float, form: Form
) -> tuple[float, float]:
    """F'(1) of a design, and a number with the sign of the mean torque that its law needs."""
    law, sign = law_of(speed, first, second, gear, form)
    return load_terms(1.0, law)[1], sign


@kernel
def _of_table(designs: Designs, form: Form, slope: Floats, sign: Floats) -> None:
    """F'(1) of a table over speed, and the sign of the mean torque that it needs."""
    for i in range(slope.size):
        slope[i], sign[i] = slope_of_design(designs.speed[i], 0.0, 0.0, designs.gear[i], form)
