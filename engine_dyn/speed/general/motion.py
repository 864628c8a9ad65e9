"""The equation of one design at the fine nodes of its period, and the memory of its solution."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from engine_dyn.compilation import inlined
from engine_dyn.loads.laws import Law, is_power, law_of, slope_of
from engine_dyn.plain_arrays import plain
from engine_dyn.speed.designs import Designs
from engine_dyn.speed.methods import CLOSED
from engine_dyn.speed.results import IDLE
from engine_dyn.speed.storage import Task
from engine_dyn.speed.work.columns import MIDDLE, SLOPE, SQUARE, VALUE, Columns
from engine_dyn.status import CONVERGED, INVALID_INPUT, NO_STEADY_STATE
from engine_dyn.types import Floats


class Design(NamedTuple):
    """Reduced numbers of one design, docs/method.md (51).

    `unsure` is that of `Designs`, `slope` is F'(1), `flat` says that the law does not depend on the
    speed from half to twice the nominal one, `nominal` is omega_n [rad/s].
    """

    unsure: float
    kappa: float
    law: Law
    slope: float
    flat: bool
    nominal: float


class Motion(NamedTuple):
    """Equation and solution of one design, docs/method.md (53) and (54); all of shape (node,).

    Attributes
    ----------
    w, dw, tau, dtau : ndarray
        Reduced work, inertia over its mean, and their slopes.
    w_missed, tau_missed : ndarray
        What cubics through values and slopes miss in the middle of the intervals behind.
    d, q, rate, force, first : ndarray
        chi - 1, q and its slope, F(q) and its slope, of the solution.
    slope, between : ndarray
        Slope of chi, and chi - 1 in the middle of intervals, where cycles were followed in time.
    f, df, b, db, by_mu, grow, shift, push : ndarray
        Scratch of Newton's method.
    """

    w: Floats
    dw: Floats
    tau: Floats
    dtau: Floats
    w_missed: Floats
    tau_missed: Floats
    d: Floats
    q: Floats
    rate: Floats
    force: Floats
    first: Floats
    slope: Floats
    between: Floats
    f: Floats
    df: Floats
    b: Floats
    db: Floats
    by_mu: Floats
    grow: Floats
    shift: Floats
    push: Floats


def make_motion(nodes: int) -> Motion:
    """Memory of one design."""
    return Motion(*(plain(np.zeros(nodes)) for _ in Motion._fields))


@inlined
def part_of(piece: int, which: int, designs: Designs) -> tuple[int, float]:
    """Part of the columns, and its share in a design's work; the last piece is the masses."""
    if piece < designs.part.shape[0]:
        return designs.part[piece, which], designs.gas[which] * designs.share[piece, which]
    return SQUARE, -designs.eta[which]


@inlined
def add_row(curve: Floats, share: float, column: Floats, row: int, factor: Floats) -> None:
    """Add a share of one row of a part of `Columns.fine` to a curve."""
    for j in range(len(curve)):
        total = 0.0
        for t in range(len(factor)):
            total += factor[t] * column[j, row, t]
        curve[j] += share * total


@inlined
def fill_motion(
    which: int, variable: bool, columns: Columns, designs: Designs, motion: Motion
) -> None:
    """Fill in w, w', tau and tau' at the nodes: docs/method.md (54)."""
    work = (motion.w, motion.dw, motion.w_missed)
    inertia = (motion.tau, motion.dtau, motion.tau_missed)
    for j in range(len(motion.w)):
        motion.w[j] = motion.dw[j] = motion.w_missed[j] = 0.0
        motion.tau[j], motion.dtau[j], motion.tau_missed[j] = 1.0, 0.0, 0.0
    for piece in range(designs.part.shape[0] + 1):
        part, share = part_of(piece, which, designs)
        in_tau = variable and piece == designs.part.shape[0]
        curves, share = inertia if in_tau else work, -share if in_tau else share
        if share != 0.0:
            for row in (VALUE, SLOPE, MIDDLE):
                add_row(curves[row], share, columns.fine[part], row, designs.factor[which])


@inlined
def begin_design(
    which: int, task: Task, columns: Columns, designs: Designs, motion: Motion
) -> tuple[Design, int]:
    """Fill in the curve of a design; its numbers and outcome so far: docs/method.md (51), (67)."""
    fill_motion(which, task.variable, columns, designs, motion)
    law, sign = law_of(
        designs.speed[which], designs.first[which], designs.second[which], designs.gear[which],
        task.form,
    )  # fmt: skip
    kappa = designs.kappa[which]
    high, low, least = -math.inf, math.inf, math.inf
    for j in range(len(motion.w)):
        # The torque at nominal speed; with variable inertia, that of the masses is in tau.
        torque = motion.dw[j] - motion.dtau[j]
        high, low, least = max(high, torque), min(low, torque), min(least, motion.tau[j])
    code = CONVERGED
    if abs(kappa) <= IDLE * (high - low):
        kappa = 0.0
    elif not (kappa * sign > 0.0):
        code = NO_STEADY_STATE
    if sign == 0.0:
        code = NO_STEADY_STATE
    elif math.isnan(sign) or not (least > 0.0):
        code = INVALID_INPUT
    closed = is_power(law) and (law.first == 0.0 or law.first == 2.0)
    if task.method == CLOSED and not closed:
        code = INVALID_INPUT
    slope, flat = slope_of(law)
    return Design(designs.unsure[which], kappa, law, slope, flat, designs.speed[which]), code


@inlined
def opposes(slope: float, design: Design) -> bool:
    """Whether load or driver oppose a deviation, or leave it as it is: docs/method.md (92), (93).

    `slope` has the sign of the law's slope: F'(1) at the nominal speed, or its mean over a cycle. A
    power law always does, and one that does not depend on the speed leaves the deviation.
    """
    return is_power(design.law) or design.flat or design.kappa == 0.0 or design.kappa * slope > 0.0
