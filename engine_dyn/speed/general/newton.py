"""Newton's method on the whole periodic curve, for one design: docs/method.md section 10.4.

The unknown is e(phi), the kinetic energy over its nominal value, docs/method.md (53) to (55), where
it is called chi:

    e' = w'(phi) - kappa (F/mu - 1),      q = (omega/omega_n)^2 = e/tau,      F = q^(alpha/2)

or any other law F of `engine_dyn.loads.laws`. The curve e is periodic, and tau is 1 (constant
inertia) or Theta(phi)/Theta (variable). The work of the load s = e - 1 - w obeys
s' = -kappa (F/mu - 1), docs/method.md (78), which is discretised with Obreshkov's two-point formula
of fourth order, docs/method.md (79). The nodes store d = e - 1 and not s, because a strong load
follows a work that is far more than the kinetic energy, and their sum would have no digits. Each
Newton step is one pass of a scalar recurrence. The sum of all interval equations says
mean(F) = mu. It replaces the equation of the last interval, so that weak loads (kappa near 0), for
which the condition omega(end) = omega(start) is singular, are as well conditioned as any other.
"""

from __future__ import annotations

import math

from engine_dyn.compilation import inlined
from engine_dyn.loads.laws import FLOOR, Law, is_power, load_terms
from engine_dyn.speed.general.curve import Curve, Design
from engine_dyn.speed.methods import CYCLE_TIME, POWER_MEAN
from engine_dyn.types import Floats

__all__ = ["closure_terms", "fill_force", "newton"]


@inlined
def closure_terms(
    q: float, force: float, first: float, flat: bool, closure: int
) -> tuple[float, float]:
    """Return the density of the closure's residual, whose mean must vanish, and its derivative.

    `force` and `first` are F(q) and its slope.

    Cycle time: q^(-1/2) - 1, docs/method.md (66). Power mean of order alpha: q^(alpha/2) - 1,
    docs/method.md (64), with log q as its limit alpha -> 0, docs/method.md (65).
    """
    if closure != CYCLE_TIME and not flat:
        return force - 1.0, first
    base = max(q, FLOOR)
    if closure == CYCLE_TIME:
        value = 1.0 / math.sqrt(base) - 1.0
        slope = -0.5 * (value + 1.0) / base
    else:
        value = math.log(base)
        slope = 1.0 / base
    if q < FLOOR:
        value += slope * (q - FLOOR)
    return value, slope


@inlined
def _closed_level(design: Design, curve: Curve) -> float:
    """Return the constant s at which the power mean is 1: the solution in the limit of no load.

    docs/method.md (64) and (65). The mean rises with s, and is above 1 where q >= 1 everywhere. For
    laws that are no power, it is the mean of q.
    """
    w, tau, nodes = curve.w, curve.tau, curve.w.size
    power = is_power(design.law)
    low, high = -math.inf, -math.inf
    for j in range(nodes):
        low = max(low, FLOOR * tau[j] - 1.0 - w[j])
        high = max(high, tau[j] - 1.0 - w[j])
    level = max(low, 0.0)
    for _ in range(60):
        total = 0.0
        total_slope = 0.0
        for j in range(nodes):
            q = (1.0 + w[j] + level) / tau[j]
            value, slope = q - 1.0, 1.0
            if power or design.flat:
                force, first = load_terms(q, design.law)
                value, slope = closure_terms(q, force, first, design.flat, POWER_MEAN)
            total += value
            total_slope += slope / tau[j]
        if total > 0.0:
            high = level
        else:
            low = level
        if abs(total) <= 1e-6 * nodes:
            break
        level -= total / total_slope
        if not (low < level < high):
            level = 0.5 * (low + high)
    return level


@inlined
def _settle(
    kappa: float, law: Law, width: float, nodes: int, w: Floats, tau: Floats, d: Floats
) -> None:
    """Repeat cycles of implicit Euler steps from d[0] until they nearly close.

    The load opposes every deviation, so the cycles converge from any start, and faster the stronger
    the load is. After a few cycles the function ends in any case, because a weak load needs no
    better start.
    """
    value = d[0]
    push = kappa * width
    for _ in range(12):
        begin = value
        for i in range(nodes):
            j = i + 1 if i + 1 < nodes else 0
            low, high = -math.inf, math.inf
            base, new = value + (w[j] - w[i]), value
            for _ in range(60):
                force, first = load_terms((1.0 + new) / tau[j], law)
                residual = new - base + push * (force - 1.0)
                slope = 1.0 + push * first / tau[j]
                # The slope is at least 1: the root is within the residual.
                if residual > 0.0:
                    high, low = new, max(low, new - residual)
                else:
                    low, high = new, min(high, new - residual)
                if abs(residual) <= 1e-6 * slope:
                    break
                new -= residual / slope
                if not (low < new < high):
                    new = 0.5 * (low + high)
            value = new
            d[j] = value
        if abs(value - begin) <= 1e-3:
            return


@inlined
def fill_force(design: Design, curve: Curve) -> None:
    """F and its slope at the nodes."""
    for j in range(curve.d.size):
        q = (1.0 + curve.d[j]) / curve.tau[j]
        curve.force[j], curve.first[j] = load_terms(q, design.law)


# Longer than usual: one pass is one recurrence, whose state would be the arguments of every part.
@inlined
def _steps(
    closure: int, width: float, tolerance: float, most: int, design: Design, curve: Curve
) -> tuple[int, float, float, float]:
    """Newton's steps from the start in `curve.d`, docs/method.md (80) to (83).

    Arguments and results are those of `newton`.
    """
    kappa = design.kappa
    w, dw, tau, dtau = curve.w, curve.dw, curve.tau, curve.dtau
    d, work, nodes = curve.d, curve.work, curve.w.size
    mu = 1.0
    mu_given = closure == POWER_MEAN
    factor = width * width / 12.0
    change = math.inf
    smallest = 0.0
    for step in range(1, most + 1):
        fill_force(design, curve)
        if step == 1 and not mu_given:
            mu = 0.0
            for j in range(nodes):
                mu += curve.force[j] / nodes
        # docs/method.md (78) and (81): f = s', its derivative along the curve, B = -df/ds, B' and
        # df/dmu.
        for j in range(nodes):
            q = (1.0 + d[j]) / tau[j]
            value, first = curve.force[j], curve.first[j]
            f = -kappa * (value / mu - 1.0)
            dq = (dw[j] + f - q * dtau[j]) / tau[j]
            work[0, j] = f
            work[1, j] = -kappa / mu * first * dq
            work[2, j] = kappa / mu * first / tau[j]
            # B' without the bend of the law, which only the speed of convergence depends on.
            work[3, j] = -kappa / mu * first * dtau[j] / (tau[j] * tau[j])
            work[4, j] = kappa * value / (mu * mu)
            work[5, j] = 0.0
        # delta_j = grow_j delta_0 + shift_j + push_j delta_mu by docs/method.md (82), and the two
        # means that close the system, docs/method.md (83) and (66).
        grow, shift, push = 1.0, 0.0, 0.0
        a11 = a12 = r1 = a21 = a22 = r2 = 0.0
        for j in range(nodes):
            q = (1.0 + d[j]) / tau[j]
            value, slope = closure_terms(q, curve.force[j], curve.first[j], design.flat, closure)
            slope /= tau[j]
            r1 -= value + slope * shift
            a11 += slope * grow
            a12 += slope * push
            if not mu_given:
                value, first = curve.force[j], curve.first[j] / tau[j]
                r2 -= value - mu + first * shift
                a21 += first * grow
                a22 += first * push - 1.0
            work[5, j] = grow
            # Rows 0 and 4 are no longer needed at j once the interval after j is done.
            if j + 1 < nodes:
                residual = (
                    (d[j + 1] - d[j])
                    - (w[j + 1] - w[j])
                    - 0.5 * width * (work[0, j] + work[0, j + 1])
                    - factor * (work[1, j] - work[1, j + 1])
                )
                b0, b1 = work[2, j], work[2, j + 1]
                before = 1.0 - 0.5 * width * b0 + factor * (b0 * b0 - work[3, j])
                behind = 1.0 + 0.5 * width * b1 + factor * (b1 * b1 - work[3, j + 1])
                source = 0.5 * width * (work[4, j] + work[4, j + 1])
                work[0, j] = shift
                work[4, j] = push
                grow = grow * before / behind
                shift = (shift * before - residual) / behind
                push = (push * before + source) / behind
        work[0, nodes - 1] = shift
        work[4, nodes - 1] = push
        if mu_given:
            start = r1 / a11
            change_mu = 0.0
        else:
            determinant = a11 * a22 - a12 * a21
            start = (r1 * a22 - a12 * r2) / determinant
            change_mu = (a11 * r2 - a21 * r1) / determinant
        # The step is shortened so that no q changes by more than 2 max(q, 1/4).
        fraction = 1.0
        for j in range(nodes):
            delta = (work[5, j] * start + work[0, j] + work[4, j] * change_mu) / tau[j]
            q = max((1.0 + d[j]) / tau[j], 0.25)
            if abs(delta) * fraction > 2.0 * q:
                fraction = 2.0 * q / abs(delta)
        change = 0.0
        smallest = math.inf
        for j in range(nodes):
            delta = fraction * (work[5, j] * start + work[0, j] + work[4, j] * change_mu)
            d[j] += delta
            change = max(change, abs(delta))
            smallest = min(smallest, (1.0 + d[j]) / tau[j])
        mu += fraction * change_mu
        if not mu_given:
            mu = max(mu, FLOOR)
        if not (change < 1e300):
            return -step, mu, change, smallest
        # Newton's method squares the error, so after a step this small nothing of it remains.
        if fraction == 1.0 and change <= tolerance:
            return step, mu, change, smallest
    return -most, mu, change, smallest


@inlined
def newton(
    closure: int, width: float, tolerance: float, most: int, design: Design, curve: Curve
) -> tuple[int, float, float, float]:
    """Solve for d at the nodes, in place; `width` is the angle between them [rad].

    Newton's steps start from the solution without load, docs/method.md (64), after some cycles of
    implicit Euler. With the closure `cycle_time`, mu is unknown too, and they start from the
    solution with the power mean. Returns the number of steps (negative: not converged), mu, the
    last change and the smallest q.
    """
    level = _closed_level(design, curve)
    for j in range(curve.d.size):
        curve.d[j] = curve.w[j] + level
    if is_power(design.law) and not design.flat:
        _settle(design.kappa, design.law, width, curve.d.size, curve.w, curve.tau, curve.d)
    taken, mu, change, smallest = 0, 1.0, math.inf, 0.0
    for wanted in (POWER_MEAN, closure):
        if wanted == POWER_MEAN and taken > 0:
            break
        more, mu, change, smallest = _steps(wanted, width, tolerance, most, design, curve)
        if more < 0:
            return more, 1.0, change, smallest
        taken += more
    return taken, mu, change, smallest
