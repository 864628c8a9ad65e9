"""The equation of one design at the fine nodes of its period, and the memory of its solution."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from engine_dyn.compilation import inlined
from engine_dyn.loads.laws import TABLE, Law, is_power, law_of, load_terms
from engine_dyn.speed.designs import Designs
from engine_dyn.speed.methods import CLOSED
from engine_dyn.speed.results import IDLE
from engine_dyn.speed.task import Task
from engine_dyn.speed.work.columns import SLOPE, VALUE, Columns
from engine_dyn.speed.work.parts import SQUARE
from engine_dyn.status import CONVERGED, INVALID_INPUT, NO_STEADY_STATE
from engine_dyn.types import Floats

__all__ = ["Curve", "Design", "begin_design", "fill_curve", "make_curve", "pulls_back"]


class Design(NamedTuple):
    """Reduced numbers of one design, docs/method.md (51).

    `unsure` is that of `Designs`, `slope` is F'(1), `flat` says that the law does not depend on the
    speed, `nominal` is omega_n [rad/s].
    """

    unsure: float
    kappa: float
    law: Law
    slope: float
    flat: bool
    nominal: float


class Curve(NamedTuple):
    """Equation and solution of one design at the nodes, docs/method.md (53) and (54).

    Attributes
    ----------
    w, dw, tau, dtau : ndarray, shape (node,)
        Reduced work, inertia over its mean, and their slopes.
    w_missed, tau_missed : ndarray, shape (node,)
        What cubics through values and slopes miss in the middle of the intervals behind.
    d, q : ndarray, shape (node,)
        chi - 1 and q of the solution.
    force, first : ndarray, shape (node,)
        F(q) and its slope.
    rate : ndarray, shape (node,)
        Slope of q.
    slope, between : ndarray, shape (node,)
        Slope of chi, and chi - 1 in the middle of intervals, where cycles were followed in time.
    work : ndarray, shape (6, node)
        Scratch.
    """

    w: Floats
    dw: Floats
    tau: Floats
    dtau: Floats
    w_missed: Floats
    tau_missed: Floats
    d: Floats
    q: Floats
    force: Floats
    first: Floats
    rate: Floats
    slope: Floats
    between: Floats
    work: Floats


def make_curve(nodes: int) -> Curve:
    """Memory of one design."""
    return Curve(
        **{name: np.zeros((6, nodes) if name == "work" else nodes) for name in Curve._fields}
    )


@inlined
def _add_part(
    part: int, share: float, columns: Columns, factor: Floats, value: Floats, slope: Floats,
    missed: Floats,
) -> None:  # fmt: skip
    """Add a part of the columns to a curve, to its slope, and to what cubics miss of it."""
    for row in range(3):
        curve = value if row == VALUE else (slope if row == SLOPE else missed)
        column = columns.fine[part]
        for j in range(curve.size):
            total = 0.0
            for t in range(factor.size):
                total += factor[t] * column[j, row, t]
            curve[j] += share * total


@inlined
def fill_curve(
    which: int, variable: bool, columns: Columns, designs: Designs, curve: Curve
) -> None:
    """Fill in w, w', tau and tau' at the nodes: docs/method.md (54)."""
    for j in range(curve.w.size):
        curve.w[j] = curve.dw[j] = curve.w_missed[j] = curve.dtau[j] = curve.tau_missed[j] = 0.0
        curve.tau[j] = 1.0
    gas, eta, factor = designs.gas[which], designs.eta[which], designs.factor[which]
    for piece in range(designs.part.shape[0]):
        share = gas * designs.share[piece, which]
        if share != 0.0:
            part = designs.part[piece, which]
            _add_part(part, share, columns, factor, curve.w, curve.dw, curve.w_missed)
    if variable:
        _add_part(SQUARE, eta, columns, factor, curve.tau, curve.dtau, curve.tau_missed)
    else:
        _add_part(SQUARE, -eta, columns, factor, curve.w, curve.dw, curve.w_missed)


@inlined
def _slope_of(law: Law) -> tuple[float, bool]:
    """F'(1) of a law, and whether it does not depend on the speed, from half to twice the nominal.

    A table that does not is refused: it holds no speed.
    """
    flat, found = law.kind != TABLE, 0.0
    for i in range(3):
        q = 0.25 * 4.0**i
        value, slope = load_terms(q, law)
        flat = flat and value == 1.0 and slope == 0.0
        found = slope if i == 1 else found
    return found, flat


@inlined
def begin_design(which: int, task: Task, designs: Designs, curve: Curve) -> tuple[Design, int]:
    """Reduced numbers of a design whose curve is filled in, and its outcome so far.

    docs/method.md (51), and (67) for idle.
    """
    law, sign = law_of(
        designs.speed[which], designs.first[which], designs.second[which], designs.gear[which],
        task.form,
    )  # fmt: skip
    kappa = designs.kappa[which]
    high, low, least = -math.inf, math.inf, math.inf
    for j in range(curve.w.size):
        # Of the torque at nominal speed; with variable inertia, that of the masses is in tau.
        torque = curve.dw[j] - curve.dtau[j]
        high, low, least = max(high, torque), min(low, torque), min(least, curve.tau[j])
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
    slope, flat = _slope_of(law)
    return Design(designs.unsure[which], kappa, law, slope, flat, designs.speed[which]), code


@inlined
def pulls_back(design: Design) -> bool:
    """Whether load or driver oppose a deviation from the nominal speed, or leave it as it is.

    docs/method.md (92).
    """
    if is_power(design.law) or design.flat or design.kappa == 0.0:
        return True
    return design.kappa * design.slope > 0.0
