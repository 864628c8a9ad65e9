"""The equation of one design at the fine nodes of its period, and Newton's method for it.

The method works on the whole periodic curve: docs/solver.md section 10.4. With e the kinetic energy
over its nominal value, docs/method.md (53) to (55), where it is chi,

    e' = w'(phi) - kappa (F/mu - 1),      q = (omega/omega_n)^2 = e/tau.

The nodes store d = e - 1. Each step is one pass of a scalar recurrence, in which mean(F) = mu
replaces the equation of the last interval.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from engine_dyn.compilation import inlined
from engine_dyn.loads.laws import FLOOR, Law, is_power, law_of, load_terms, slope_of
from engine_dyn.plain_arrays import plain
from engine_dyn.speed.designs import Designs, Task
from engine_dyn.speed.fields import CLOSED, CYCLE_TIME, IDLE, POWER_MEAN
from engine_dyn.speed.work.columns import MIDDLE, SLOPE, SQUARE, VALUE, Columns
from engine_dyn.status import CONVERGED, INVALID_INPUT, NO_STEADY_STATE
from engine_dyn.types import Floats

MOST_STEPS = 60  # Largest number of Newton's steps


@inlined
def closure_terms(
    q: float, force: float, first: float, flat: bool, closure: int
) -> tuple[float, float]:
    """Function whose mean the closure makes 0, and its derivative; `force` and `first` are of F.

    Cycle time: q^(-1/2) - 1, docs/method.md (66). Power mean of order alpha: q^(alpha/2) - 1,
    docs/method.md (64), with log q as its limit alpha -> 0, docs/method.md (65).
    """
    if closure != CYCLE_TIME and not flat:
        return force - 1.0, first
    base = max(q, FLOOR)
    value, slope = math.log(base), 1.0 / base
    if closure == CYCLE_TIME:
        root = 1.0 / math.sqrt(base)
        value, slope = root - 1.0, -0.5 * root / base
    return value + slope * min(q - FLOOR, 0.0), slope


@inlined
def _start(motion: Motion) -> None:
    """Fill `motion.d` with the work at a level that gives q > 0 and a mean of q of 1."""
    w, tau, nodes = motion.w, motion.tau, len(motion.w)
    total, slope, low = 0.0, 0.0, -math.inf
    for j in range(nodes):
        total += (1.0 + w[j]) / tau[j]
        slope += 1.0 / tau[j]
        low = max(low, FLOOR * tau[j] - 1.0 - w[j])
    level = max((nodes - total) / slope, low)
    for j in range(nodes):
        motion.d[j] = w[j] + level


@inlined
def _settle(width: float, design: Design, motion: Motion) -> None:
    """Repeat cycles of implicit Euler steps from d[0] until they nearly close, a few at most."""
    w, tau, d, nodes = motion.w, motion.tau, motion.d, len(motion.w)
    value, push = d[0], design.kappa * width
    for _ in range(12):
        begin = value
        for i in range(nodes):
            j = (i + 1) % nodes
            low, high = -math.inf, math.inf
            base, new = value + (w[j] - w[i]), value
            for _ in range(60):
                force, first = load_terms((1.0 + new) / tau[j], design.law)
                residual = new - base + push * (force - 1.0)
                slope = 1.0 + push * first / tau[j]
                # The slope is at least 1, so the root is no farther than the residual.
                if residual > 0.0:
                    high, low = new, max(low, new - residual)
                else:
                    low, high = new, min(high, new - residual)
                if abs(residual) <= 1e-6 * slope:
                    break
                new -= residual / slope
                if not (low < new < high):
                    new = 0.5 * (low + high)
            value = d[j] = new
        if abs(value - begin) <= 1e-3:
            return


@inlined
def fill_force(design: Design, motion: Motion) -> None:
    """F and its slope at the nodes."""
    for j in range(len(motion.d)):
        q = (1.0 + motion.d[j]) / motion.tau[j]
        motion.force[j], motion.first[j] = load_terms(q, design.law)


@inlined
def _fill_recurrence(mu: float, fixed: bool, width: float, design: Design, motion: Motion) -> None:
    """Fill delta_j = grow_j delta_0 + shift_j + push_j delta_mu, docs/solver.md (82).

    First, by docs/solver.md (78) and (81): f = s', its derivative along the curve, B = -df/ds, B'
    and df/dmu. With `fixed` mu, `push` is 0.
    """
    d, w, f, df, b, db, by_mu = (
        motion.d, motion.w, motion.f, motion.df, motion.b, motion.db, motion.by_mu,
    )  # fmt: skip
    half, factor, strength = 0.5 * width, width * width / 12.0, design.kappa / mu
    for j in range(len(d)):
        tau, first = motion.tau[j], motion.first[j]
        f[j] = -design.kappa * (motion.force[j] / mu - 1.0)
        rate = (motion.dw[j] + f[j] - (1.0 + d[j]) / tau * motion.dtau[j]) / tau
        df[j] = -strength * first * rate
        b[j] = strength * first / tau
        # The law's curvature is neglected: it affects only the speed of convergence.
        db[j] = -strength * first * motion.dtau[j] / (tau * tau)
        by_mu[j] = 0.0 if fixed else strength * motion.force[j] / mu
    motion.grow[0], motion.shift[0], motion.push[0] = 1.0, 0.0, 0.0
    for j in range(len(d) - 1):
        n = j + 1
        residual = d[n] - d[j] - (w[n] - w[j]) - half * (f[j] + f[n]) - factor * (df[j] - df[n])
        before = 1.0 - half * b[j] + factor * (b[j] * b[j] - db[j])
        behind = 1.0 + half * b[n] + factor * (b[n] * b[n] - db[n])
        motion.grow[n] = motion.grow[j] * before / behind
        motion.shift[n] = (motion.shift[j] * before - residual) / behind
        motion.push[n] = (motion.push[j] * before + half * (by_mu[j] + by_mu[n])) / behind


@inlined
def _ends(
    mu: float, fixed: bool, closure: int, design: Design, motion: Motion
) -> tuple[float, float]:
    """Changes delta_0 and delta_mu: docs/solver.md (83), docs/method.md (66); mu may be `fixed`."""
    a11 = a12 = r1 = a21 = r2 = 0.0
    a22 = 1.0 if fixed else 0.0
    for j in range(len(motion.d)):
        tau, force, first = motion.tau[j], motion.force[j], motion.first[j]
        grow, shift, push = motion.grow[j], motion.shift[j], motion.push[j]
        value, slope = closure_terms((1.0 + motion.d[j]) / tau, force, first, design.flat, closure)
        slope /= tau
        r1 -= value + slope * shift
        a11 += slope * grow
        a12 += slope * push
        if not fixed:
            r2 -= force - mu + first / tau * shift
            a21 += first / tau * grow
            a22 += first / tau * push - 1.0
    determinant = a11 * a22 - a12 * a21
    return (r1 * a22 - a12 * r2) / determinant, (a11 * r2 - a21 * r1) / determinant


@inlined
def _steps(closure: int, width: float, design: Design, motion: Motion) -> tuple[int, float, float]:
    """Newton's steps from the start in `motion.d`, docs/solver.md (80) to (83), for `newton`."""
    d, tau, delta, nodes = motion.d, motion.tau, motion.shift, len(motion.w)
    fixed, mu, smallest = closure == POWER_MEAN, 1.0, 0.0
    for step in range(1, MOST_STEPS + 1):
        fill_force(design, motion)
        if step == 1 and not fixed:
            mu = 0.0
            for j in range(nodes):
                mu += motion.force[j] / nodes
        _fill_recurrence(mu, fixed, width, design, motion)
        start, change_mu = _ends(mu, fixed, closure, design, motion)
        # The step is shortened so that no q changes by more than 2 max(q, 1/4), and mu stays above
        # a quarter of its value.
        fraction = 1.0 if change_mu > -0.75 * mu else 0.75 * mu / -change_mu
        for j in range(nodes):
            delta[j] += motion.grow[j] * start + motion.push[j] * change_mu
            most = 2.0 * max(1.0 + d[j], 0.25 * tau[j])
            if abs(delta[j]) * fraction > most:
                fraction = most / abs(delta[j])
        change, smallest = 0.0, math.inf
        for j in range(nodes):
            d[j] += fraction * delta[j]
            change = max(change, abs(fraction * delta[j]))
            smallest = min(smallest, (1.0 + d[j]) / tau[j])
        mu += fraction * change_mu
        if not (change < 1e300):
            return -step, mu, smallest
        # Newton's method squares the error: after a step this small no error remains.
        if fraction == 1.0 and change <= 1e-7:
            return step, mu, smallest
    return -MOST_STEPS, mu, smallest


@inlined
def newton(closure: int, width: float, design: Design, motion: Motion) -> tuple[int, float, float]:
    """Solve for d at the nodes, in place; `width` is the angle between them [rad].

    The start is where the mean of q is 1, after some cycles of implicit Euler. With `cycle_time`,
    mu is unknown too: steps go on from the solution with the power mean, or begin again. Returns
    their number (negative: not converged), mu and the smallest q.
    """
    taken, mu, smallest = 0, 1.0, 0.0
    for number in range(3):
        if number != 1:
            _start(motion)
        if number == 0 and is_power(design.law) and not design.flat:
            _settle(width, design, motion)
        wanted = POWER_MEAN if number == 0 else closure
        more, new_mu, least = _steps(wanted, width, design, motion)
        runs = more > 0 and least > FLOOR
        taken = more if more < 0 else max(taken, 0) + more
        if number < 2 or runs:
            mu, smallest = new_mu, least  # where the last try fails, those of the try before stay
        if wanted == closure and (runs or closure == POWER_MEAN):
            break
    return taken, mu, smallest


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
        # Torque at nominal speed; with variable inertia, the masses' part is -tau', not in w'.
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
