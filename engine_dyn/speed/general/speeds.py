"""Extreme and mean speeds at the fine nodes, docs/solver.md chapter 12, and their error (101)."""

from __future__ import annotations

import math

from engine_dyn.compilation import inlined
from engine_dyn.loads.laws import FLOOR, is_power
from engine_dyn.speed.general.motion import Design, Motion
from engine_dyn.speed.general.newton import closure_terms, fill_force
from engine_dyn.speed.work.interpolation import cubic_in_middle, largest, max_between
from engine_dyn.types import Floats

STRONG_LOAD = 1e-3
"""Limit of kappa times the width of an interval. Below it, the error of the two-point formula is
negligible. Above it, that error is estimated, docs/solver.md (103)."""


@inlined
def _peak(sign: float, j: int, width: float, motion: Motion) -> tuple[float, float]:
    """Largest sign * q in the interval behind node j, at whose ends it rises and falls.

    docs/solver.md (98) to (100), and how much it may miss.
    """
    q, tau = motion.q, motion.tau
    n = (j + 1) % len(q)
    left, right, d_left, d_right = q[j], q[n], width * motion.rate[j], width * motion.rate[n]
    turn_left, turn_right = width * motion.dtau[j], width * motion.dtau[n]
    energy = motion.w_missed[j] + cubic_in_middle(
        left * tau[j], right * tau[n], d_left * tau[j] + left * turn_left,
        d_right * tau[n] + right * turn_right,
    )  # fmt: skip
    inertia = motion.tau_missed[j] + cubic_in_middle(tau[j], tau[n], turn_left, turn_right)
    middle = energy / inertia - cubic_in_middle(left, right, d_left, d_right)
    value, bump = max_between(
        sign * left, sign * right, sign * d_left, sign * d_right, sign * middle
    )
    return value, abs(bump)


@inlined
def _extreme(sign: float, width: float, motion: Motion) -> tuple[float, float]:
    """Largest (sign 1) or smallest (-1) q, and how much it may miss.

    Every interval is looked at in which a local maximum may be higher than the highest node.
    """
    q, rate, node = motion.q, motion.rate, 0
    for j in range(len(q)):
        node = j if sign * q[j] > sign * q[node] else node
    highest = sign * q[node]
    # Beside an extreme node the slope changes its sign, unless the nodes do not resolve it.
    best, miss = highest, width * abs(rate[node])
    for j in range(len(q)):
        n = (j + 1) % len(q)
        up, down = sign * rate[j], sign * rate[n]
        if up >= 0.0 and down < 0.0 and sign * q[j] + width * up >= highest:
            value, missed = _peak(sign, j, width, motion)
            # Rounding may place it below the node at which the interval begins or ends.
            if value >= best or (best == highest and node in (j, n)):
                best, miss = max(value, best), missed
    return sign * best, miss


@inlined
def _mean(closure: int, design: Design, motion: Motion) -> tuple[float, float]:
    """Mean of sqrt(q), and what the nodes do not resolve: docs/solver.md (102).

    That is the relative difference of the means over even and odd nodes, of speed and closure.
    """
    q, total, speed, closed = motion.q, 0.0, 0.0, 0.0
    for j in range(len(q)):
        sign = 1.0 if j % 2 == 0 else -1.0
        root = math.sqrt(q[j])
        value, _ = closure_terms(q[j], motion.force[j], motion.first[j], design.flat, closure)
        total += root
        speed += sign * root
        closed += sign * value
    return total / len(q), abs(speed) / total + abs(closed) / len(q)


@inlined
def _load_missed(mu: float, width: float, design: Design, force: Floats) -> float:
    """Error of the two-point formula in q: the numerator of docs/solver.md (103)."""
    n = len(force)
    largest = 0.0
    for j in range(n):
        third = force[j] - 3.0 * (force[(j - 1) % n] - force[(j - 2) % n]) - force[(j - 3) % n]
        largest = max(largest, abs(third))
    return 8.0 * (1.0 / 720.0 + 1.0 / 384.0) * width * abs(design.kappa) / mu * largest


@inlined
def _fill_solution(mu: float, missed: float, width: float, design: Design, motion: Motion) -> None:
    """Fill in q and its slope at the nodes, docs/solver.md (97).

    Of a solution that was followed in time, where `missed` is not 0, the slope of the energy is
    known, and no difference of large numbers; what cubics miss is that of the energy then, not of
    the work.
    """
    d, slope, tau = motion.d, motion.slope, motion.tau
    fill_force(design, motion)
    for j in range(len(d)):
        if missed == 0.0:
            slope[j] = motion.dw[j] - design.kappa * (motion.force[j] / mu - 1.0)
        motion.q[j] = (1.0 + d[j]) / tau[j]
        motion.rate[j] = (slope[j] - motion.q[j] * motion.dtau[j]) / tau[j]
    if missed > 0.0:
        for j in range(len(d)):
            n = (j + 1) % len(d)
            cubic = cubic_in_middle(d[j], d[n], width * slope[j], width * slope[n])
            motion.w_missed[j] = motion.between[j] - cubic


@inlined
def speeds_of(
    mu: float, missed: float, width: float, closure: int, design: Design, motion: Motion
) -> tuple[float, float, float, float, float, float]:
    """Largest, smallest and mean speed and the range [rad/s], and the relative error of delta.

    docs/solver.md (101) and (104). `missed` is what the solution may miss of q in all. The last
    number is the part of the error that integrating the load has. All are NaN where the smallest q
    is not above FLOOR.
    """
    _fill_solution(mu, missed, width, design, motion)
    nan, nominal = math.nan, design.nominal
    low = low_miss = high = high_miss = 0.0
    for sign in (1.0, -1.0):  # one call, because the compiler copies it to each
        high, high_miss = low, low_miss
        low, low_miss = _extreme(sign, width, motion)
    if not (low > FLOOR):
        return nan, nan, nan, nan, nan, nan
    range_of_q = high - low
    mean, unresolved = _mean(closure, design, motion)
    high, low = math.sqrt(high), math.sqrt(low)
    span = range_of_q / (high + low)
    error = of_load = 0.0
    if span > 0.0:
        error = 0.5 * ((high_miss + missed) / high + (low_miss + missed) / low)
        error = (error + design.unsure / low) / span
    elif largest(1.0, motion.dw) > 0.0 or largest(1.0, motion.dtau) > 0.0:
        error = 1.0  # work is done, but the fluctuation is below rounding: 0 misses all of it
    error += unresolved
    strong = abs(design.kappa) * width > STRONG_LOAD or not is_power(design.law)
    if strong and range_of_q > 0.0 and missed == 0.0:
        of_load = _load_missed(mu, width, design, motion.force) / range_of_q
    error += of_load
    near_stall = max(1.0, span / low)
    error *= near_stall
    return (
        nominal * high, nominal * low, nominal * mean, nominal * span, error, near_stall * of_load
    )  # fmt: skip
