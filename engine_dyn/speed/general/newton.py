"""Newton's method on the whole periodic curve, for one design: docs/method.md section 10.5.

The unknown is e(phi), the kinetic energy over its nominal value, docs/method.md (46) to (48), where
it is called chi:

    e' = w'(phi) - kappa (F/mu - 1),      q = (omega/omega_n)^2 = e/tau,      F = q^(alpha/2)

or any other law F of `engine_dyn.loads.laws`. The curve e is periodic, and tau is 1 (constant
inertia) or Theta(phi)/Theta (variable). The work of the load s = e - 1 - w obeys
s' = -kappa (F/mu - 1), docs/method.md (72), which is discretised with Obreshkov's two-point formula
of fourth order, docs/method.md (63). The nodes store d = e - 1 and not s, because a strong load
follows a work that is far more than the kinetic energy, and their sum would have no digits. Each
Newton step is one pass of a scalar recurrence. The sum of all interval equations says
mean(F) = mu. It replaces the equation of the last interval, so that weak loads (kappa near 0), for
which the condition omega(end) = omega(start) is singular, are as well conditioned as any other.
"""

from __future__ import annotations

import math

from engine_dyn.compilation import by_type, inlined
from engine_dyn.loads.laws import FLOOR, Law, Power, half_of, is_power, load_terms
from engine_dyn.speed.methods import CYCLE_TIME, POWER_MEAN
from engine_dyn.types import Floats

__all__ = ["closure_terms", "newton"]


NEAR = 0.1
"""Relative error of the cycle's time below which Newton's steps are tried in both unknowns."""

MOST_RISES = 60
"""Largest number of values of `rise` that the search for the cycle's time tries."""

TRIED = 15
"""Largest number of Newton's steps for one value of `rise`, which only has to be bracketed."""


@inlined
def closure_terms(q: float, law: Law, closure: int) -> tuple[float, float]:
    """Return the density of the closure's residual, whose mean must vanish, and its derivative.

    Cycle time: q^(-1/2) - 1, docs/method.md (59). Power mean of order alpha: q^(alpha/2) - 1,
    docs/method.md (57), with log q as its limit alpha -> 0, docs/method.md (58).
    """
    base = max(q, FLOOR)
    if closure == CYCLE_TIME:
        value = 1.0 / math.sqrt(base) - 1.0
        slope = -0.5 * (value + 1.0) / base
    elif half_of(law) == 0.0:
        value = math.log(base)
        slope = 1.0 / base
    else:
        value, slope, _ = load_terms(base, law)
        value -= 1.0
    if q < FLOOR:
        value += slope * (q - FLOOR)
    return value, slope


@inlined
def _closed_level(half: float, nodes: int, w: Floats, tau: Floats) -> float:
    """Return the constant s at which the power mean is 1: the solution in the limit of no load.

    docs/method.md (57) and (58). The mean rises with s, and is above 1 where q >= 1 everywhere.
    """
    low, high = -math.inf, -math.inf
    for j in range(nodes):
        low = max(low, FLOOR * tau[j] - 1.0 - w[j])
        high = max(high, tau[j] - 1.0 - w[j])
    level = max(low, 0.0)
    for _ in range(60):
        total = 0.0
        total_slope = 0.0
        for j in range(nodes):
            value, slope = closure_terms((1.0 + w[j] + level) / tau[j], Power(half), POWER_MEAN)
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
                force, first, _ = load_terms((1.0 + new) / tau[j], law)
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


# Longer than usual: one pass is one recurrence, whose state would be the arguments of every part.
@inlined
def _steps(
    kappa: float,
    law: Law,
    closure: int,
    width: float,
    nodes: int,
    w: Floats,
    dw: Floats,
    tau: Floats,
    dtau: Floats,
    d: Floats,
    work: Floats,
    tolerance: float,
    most: int,
) -> tuple[int, float, float, float]:
    """Newton's steps from the start in `d`, docs/method.md (73) to (76).

    Arguments and results are those of `newton`.
    """
    count = float(nodes)
    mu = 1.0
    mu_given = closure == POWER_MEAN
    factor = width * width / 12.0
    change = math.inf
    smallest = 0.0
    for step in range(1, most + 1):
        if not mu_given:
            total = 0.0
            for j in range(nodes):
                value, _, _ = load_terms((1.0 + d[j]) / tau[j], law)
                total += value
            if step == 1:
                mu = total / count
        # docs/method.md (72) and (74): f = s', its derivative along the curve, B = -df/ds, B' and
        # df/dmu.
        for j in range(nodes):
            q = (1.0 + d[j]) / tau[j]
            value, first, second = load_terms(q, law)
            f = -kappa * (value / mu - 1.0)
            dq = (dw[j] + f - q * dtau[j]) / tau[j]
            work[0, j] = f
            work[1, j] = -kappa / mu * first * dq
            work[2, j] = kappa / mu * first / tau[j]
            work[3, j] = kappa / mu * (second * dq - first * dtau[j] / tau[j]) / tau[j]
            work[4, j] = kappa * value / (mu * mu)
            work[5, j] = 0.0
        # delta_j = grow_j delta_0 + shift_j + push_j delta_mu by docs/method.md (75), and the two
        # means that close the system, docs/method.md (76) and (59).
        grow, shift, push = 1.0, 0.0, 0.0
        a11 = a12 = r1 = a21 = a22 = r2 = 0.0
        for j in range(nodes):
            q = (1.0 + d[j]) / tau[j]
            value, slope = closure_terms(q, law, closure)
            slope /= tau[j]
            r1 -= value + slope * shift
            a11 += slope * grow
            a12 += slope * push
            if not mu_given:
                value, first, _ = load_terms(q, law)
                first /= tau[j]
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
def _from_no_load(
    kappa: float,
    law: Law,
    width: float,
    nodes: int,
    w: Floats,
    dw: Floats,
    tau: Floats,
    dtau: Floats,
    d: Floats,
    work: Floats,
    tolerance: float,
    most: int,
) -> tuple[int, float, float, float]:
    """Solve with the power mean as closure; results as `newton`.

    Newton's steps start from the solution without load, docs/method.md (57), after some cycles of
    implicit Euler.
    """
    level = _closed_level(half_of(law), nodes, w, tau)
    for j in range(nodes):
        d[j] = w[j] + level
    if half_of(law) > 0.0 and is_power(law):
        _settle(kappa, law, width, nodes, w, tau, d)
    return _steps(kappa, law, POWER_MEAN, width, nodes, w, dw, tau, dtau, d, work, tolerance, most)


@inlined
def newton(
    kappa: float,
    law: Law,
    closure: int,
    width: float,
    nodes: int,
    w: Floats,
    dw: Floats,
    tau: Floats,
    dtau: Floats,
    d: Floats,
    work: Floats,
    tolerance: float,
    most: int,
) -> tuple[int, float, float, float]:
    """Solve for d at the nodes, in place.

    `work` is scratch (8, nodes). Returns the number of steps (negative: not converged), mu, the
    last change and the smallest q. With the closure `cycle_time`, mu is unknown too,
    docs/method.md (77).
    """
    if closure == POWER_MEAN:
        return _from_no_load(kappa, law, width, nodes, w, dw, tau, dtau, d, work, tolerance, most)
    return _with_cycle_time(
        closure, kappa, width, nodes, w, dw, tau, dtau, d, work, tolerance, most, law
    )


@by_type
def _with_cycle_time(
    closure: int, kappa: float, width: float, nodes: int, w: Floats, dw: Floats, tau: Floats,
    dtau: Floats, d: Floats, work: Floats, tolerance: float, most: int, law: Law,
) -> tuple[int, float, float, float]:  # fmt: skip
    """Solve with the cycle's time as closure, from the solution with the power mean.

    Arguments and results as of `newton`.
    """
    taken, _, change, smallest = _from_no_load(
        kappa, law, width, nodes, w, dw, tau, dtau, d, work, tolerance, most
    )
    if taken < 0:
        return taken, 1.0, change, smallest
    more, mu, change, smallest = _steps(
        kappa, law, closure, width, nodes, w, dw, tau, dtau, d, work, tolerance, most
    )
    return (taken + more if more > 0 else more), mu, change, smallest


@_with_cycle_time.of(Power)
def _with_cycle_time_of_power(
    closure: int, kappa: float, width: float, nodes: int, w: Floats, dw: Floats, tau: Floats,
    dtau: Floats, d: Floats, work: Floats, tolerance: float, most: int, law: Power,
) -> tuple[int, float, float, float]:  # fmt: skip
    """As `_with_cycle_time` for a power of the speed, by similarity: docs/method.md (77).

    A problem whose mu is rise^half is, in units of the speed at which mu is 1, the problem of the
    power mean with kappa, w and 1 + d divided by `rise`. The cycle's time falls steadily with
    `rise`. Near the right value, Newton's steps in both unknowns finish the search.
    """
    low, high = 0.0, math.inf
    rise = 1.0
    steps = 0
    stalls = False
    change = smallest = 0.0
    lower, d_lower = work[6], work[7]
    for _ in range(MOST_RISES):
        for j in range(nodes):
            lower[j], d_lower[j] = w[j] / rise, dw[j] / rise
        taken, _, change, smallest = _from_no_load(
            kappa / rise, law, width, nodes, lower, d_lower, tau, dtau, d, work, tolerance,
            TRIED,
        )  # fmt: skip
        steps += abs(taken)
        time = math.inf
        if taken > 0 and smallest > FLOOR:
            time = 0.0
            for j in range(nodes):
                d[j] = rise * (1.0 + d[j]) - 1.0
                time += math.sqrt(tau[j] / (1.0 + d[j]))
            time /= nodes
        if time > 1.0:
            low, stalls = rise, time == math.inf
        else:
            high = rise
        guess = rise * time * time
        if abs(time - 1.0) < NEAR:
            taken, mu, change, smallest = _steps(
                kappa, law, closure, width, nodes, w, dw, tau, dtau, d, work, tolerance, TRIED
            )
            steps += abs(taken)
            if taken > 0 and smallest > FLOOR:
                return steps, mu, change, smallest
        if high - low <= 1e-4 * low:
            break
        if low < guess < high and guess < math.inf:
            rise = guess
        else:
            rise = 2.0 * rise if high == math.inf else math.sqrt(low * high)
    # If the time reaches the asked one only by stalling, the engine stalls at the asked one.
    return -steps, 1.0, change, 0.0 if stalls else smallest
