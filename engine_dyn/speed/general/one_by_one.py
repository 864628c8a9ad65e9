"""The general solver: any designs, one after the other.

Extreme and mean speeds at the fine nodes are those of docs/solver.md chapter 12, their error (101).
"""

from __future__ import annotations

import math

import numpy as np

from engine_dyn import status
from engine_dyn.compilation import inlined, kernel
from engine_dyn.loads.laws import FLOOR, POWER, covers, is_power, load_terms
from engine_dyn.plain_arrays import plain
from engine_dyn.speed.designs import Designs, Task, store, store_curves, store_nothing
from engine_dyn.speed.fields import POWER_MEAN, Results
from engine_dyn.speed.general.newton import (
    Design,
    Motion,
    begin_design,
    closure_terms,
    fill_force,
    make_motion,
    newton,
    opposes,
)
from engine_dyn.speed.general.stable_cycle import stable_cycle
from engine_dyn.speed.work.columns import Columns
from engine_dyn.speed.work.interpolation import cubic_in_middle, largest, max_between
from engine_dyn.types import Booleans, Floats, Integers

ROUNDED = 1.0 + 1e-9  # Factor by which rounding may put the mean speed outside the extremes


def solve_one_by_one(
    chosen: Integers, task: Task, columns: Columns, designs: Designs, results: Results, last: bool
) -> None:
    """Solve the designs `chosen`, such as those that the batch solver leaves.

    Where Newton's method finds no solution, cycles are followed in time. `last` says that no more
    nodes are tried.
    """
    task, columns, designs, results = map(plain, (task, columns, designs, results))
    motion = make_motion(columns.fine.shape[1])
    unresolved = np.zeros(designs.kappa.size, dtype=np.bool_)
    solve_designs(chosen, task, columns, designs, motion, results, unresolved, last)
    outcomes = followed(task, last)
    left = chosen[np.isin(results.status[designs.target[chosen]], outcomes) & ~unresolved[chosen]]
    # The general solver is compiled only where designs are left to it.
    if left.size:
        follow_designs(left, task, columns, designs, motion, results)


def followed(task: Task, last: bool) -> tuple[int, ...]:
    """Outcomes of Newton's method after which cycles are followed.

    With a power of the speed its stalls are certain. With other laws it may find a false solution,
    such as one beyond the ends of a table. The last number of nodes is where a missed tolerance
    counts: the load may be so strong that no number of nodes resolves it.
    """
    doubtful = (status.NOT_CONVERGED, status.STALLED, status.NO_STEADY_STATE, status.INVALID_INPUT)
    of_law = () if task.form.kind == POWER else doubtful
    return (*of_law, status.NOT_CONVERGED, status.TOLERANCE_NOT_MET) if last else of_law


@kernel
def solve_designs(
    chosen: Integers, task: Task, columns: Columns, designs: Designs, motion: Motion,
    results: Results, unresolved: Booleans, last: bool,
) -> None:  # fmt: skip
    """Solve the designs `chosen` by Newton's method; `motion` is scratch.

    Stalls that more nodes may disprove are not converged, unless these are the `last`. Designs
    whose nodes miss the tolerance, however exactly the load is integrated, are `unresolved`.
    """
    width = columns.width
    for which in chosen:
        design, code = begin_design(which, task, columns, designs, motion)
        mu, steps, doubted = 1.0, 0, False
        if code == status.CONVERGED:
            with_mean = task.closure == POWER_MEAN and is_power(design.law)
            if with_mean and _must_stall(width, design, motion):
                code = status.STALLED
            else:
                steps, mu, smallest = newton(task.closure, width, design, motion)
                # With a given cycle time, the load may be less than that of the first tries.
                timed = task.closure != POWER_MEAN
                if steps < 0:
                    code = status.NOT_CONVERGED if timed or smallest > FLOOR else status.STALLED
                else:
                    # A smallest q far below 0 is a stall, whatever the number of nodes. Near 0,
                    # means over the nodes do not resolve a closure that is singular at 0.
                    doubted = smallest > (FLOOR if last else -0.01)
                    if doubted and with_mean and _falls_short(width, design, motion):
                        doubted = False
        rest = _write(
            which, code, mu, 0.0, steps, width, doubted, task, design, designs, motion, results
        )
        # Following cycles in time reduces only the error of integrating a weak power load: where
        # the rest of the error is too large, more nodes are needed.
        gentle = is_power(design.law) and abs(design.kappa) * width <= 0.1
        unresolved[which] = gentle and rest > task.tolerance


@kernel
def follow_designs(
    chosen: Integers, task: Task, columns: Columns, designs: Designs, motion: Motion,
    results: Results,
) -> None:  # fmt: skip
    """Follow cycles of the designs `chosen`, for which Newton's method found none.

    A design that has no stable cycle near or above the nominal speed gets the outcome that this
    says; one without torque to balance, or whose law repels the nominal speed, keeps its outcome.
    """
    width = columns.width
    for which in chosen:
        design, code = begin_design(which, task, columns, designs, motion)
        holds = not design.flat and opposes(design.slope, design)
        if code != status.CONVERGED or design.kappa == 0.0 or not holds:
            continue
        missed_tolerance = results.status[designs.target[which]] == status.TOLERANCE_NOT_MET
        # Cycles followed in time are more exact than Newton's method only under a strong
        # load: under a weak one, deviations shrink so slowly that rounding blurs the speed.
        if missed_tolerance and abs(design.kappa) * width <= STRONG_LOAD:
            continue
        code, cycles, mu, missed = stable_cycle(task.closure, width, design, motion)
        if missed_tolerance and code != status.CONVERGED:
            continue
        missed = max(missed, 1e-15)
        _write(
            which, code, mu, missed, cycles, width, False, task, design, designs, motion, results
        )


@inlined
def _must_stall(width: float, design: Design, motion: Motion) -> bool:
    """Whether a power law with the power mean stalls always: docs/method.md (94)."""
    most = largest(1.0, motion.w)
    least = design.kappa * width * len(motion.w) - largest(-1.0, motion.w)
    # Where the upper bound of the energy is below 1, its mean is not above 1, unless tau is small:
    # most designs end here.
    if most - least < 1.0:
        return False
    total = 0.0
    for j in range(len(motion.w)):
        q = max((motion.w[j] - least) / motion.tau[j], FLOOR)
        total += math.log(q) if design.flat else load_terms(q, design.law)[0] - 1.0
    # The mean must exceed 0 by a margin, because a mean over nodes stands for an integral.
    return total > 0.01 * len(motion.w)


@inlined
def _falls_short(width: float, design: Design, motion: Motion) -> bool:
    """Whether a solution near 0 under a dominating load falls far below 0 even without it."""
    nodes = len(motion.w)
    if design.flat or not (design.kappa > 0.0):
        return False
    rise = design.kappa * width
    for begin in range(nodes):
        if not (1.0 + motion.d[begin] > FLOOR * motion.tau[begin]):
            continue
        after = (begin + 1) % nodes
        if 1.0 + motion.d[after] > FLOOR * motion.tau[after]:
            continue
        e = 1.0 + motion.d[begin]
        for k in range(nodes):
            j, n = (begin + k) % nodes, (begin + k + 1) % nodes
            e += motion.w[n] - motion.w[j] + rise
            if e < -0.05:  # e is over the nominal energy; more nodes change it by less
                return True
    return False


@inlined
def _write(
    which: int, code: int, mu: float, missed: float, steps: int, width: float, doubted: bool,
    task: Task, design: Design, designs: Designs, motion: Motion, results: Results,
) -> float:  # fmt: skip
    """Judge a solution, docs/method.md section 13.3, and write its results.

    Where it is `doubted`, more nodes may disprove a stall. Returns the part of the error that
    is not due to integrating the load, NaN where there is no solution.
    """
    high = low = mean = span = error = of_load = math.nan
    holds = opposes(design.slope, design)
    if code == status.CONVERGED:
        high, low, mean, span, error, of_load = speeds_of(
            mu, missed, width, task.closure, design, motion
        )
        gear, slope = design.law.nominal / design.nominal, 0.0
        for j in range(len(motion.q)):
            slope += motion.first[j] / motion.tau[j]
        if not (low > 0.0):
            code = status.NOT_CONVERGED if doubted else status.STALLED
        elif not covers(gear * high, gear * low, task.form):
            code = status.INVALID_INPUT if holds else status.NO_STEADY_STATE
        elif not opposes(slope, design):  # small deviations grow, docs/method.md (93)
            code = status.NO_STEADY_STATE
        elif not (low <= mean * ROUNDED and mean <= high * ROUNDED):
            # The load is so strong that the nodes do not resolve the curve.
            code = status.NOT_CONVERGED
        elif not (error <= task.tolerance):
            code = status.TOLERANCE_NOT_MET
    if (code == status.STALLED or code == status.NOT_CONVERGED) and not holds:
        code = status.NO_STEADY_STATE
    target = designs.target[which]
    if code != status.CONVERGED and code != status.TOLERANCE_NOT_MET:
        store_nothing(target, code, results)
        return math.nan
    results.status[target] = code
    store(target, high, low, mean, span, mu, error, float(steps), results.wanted, results.scalars)
    store_curves(target, design.nominal, motion.q, motion.rate, task.angles, results)
    return error - of_load


STRONG_LOAD = 1e-3
"""Largest kappa times an interval's width for which the error of the two-point formula is
negligible. Above it, that error is estimated, docs/solver.md (103)."""


@inlined
def _peak(sign: float, j: int, width: float, motion: Motion) -> tuple[float, float]:
    """Largest sign * q between nodes j and j + 1, and its error: docs/solver.md (98) to (100)."""
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
    """Largest (sign 1) or smallest (-1) q, and its error, over all intervals that may have it."""
    q, rate, node = motion.q, motion.rate, 0
    for j in range(len(q)):
        node = j if sign * q[j] > sign * q[node] else node
    highest = sign * q[node]
    # Next to an extreme node the slope changes its sign, unless the nodes do not resolve it.
    best, miss = highest, width * abs(rate[node])
    for j in range(len(q)):
        n = (j + 1) % len(q)
        up, down = sign * rate[j], sign * rate[n]
        if up >= 0.0 and down < 0.0 and sign * q[j] + width * up >= highest:
            value, missed = _peak(sign, j, width, motion)
            # By rounding, the extreme may be below the node at which the interval begins or ends.
            if value >= best or (best == highest and node in (j, n)):
                best, miss = max(value, best), missed
    return sign * best, miss


@inlined
def _mean(closure: int, design: Design, motion: Motion) -> tuple[float, float]:
    """Mean of sqrt(q), and its error by even and odd nodes: docs/solver.md (102)."""
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

    Where cycles were followed in time (`missed` is not 0), the slope is that of their energy, which
    is no difference of large numbers; cubics then miss a part of the energy instead of the work.
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
    for sign in (1.0, -1.0):  # one call: the compiler copies it to each
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
        error = 1.0  # the fluctuation is below rounding: a delta of 0 misses all of it
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
