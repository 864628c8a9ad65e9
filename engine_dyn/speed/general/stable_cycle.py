"""The stable cycle of one design, by following cycles in time: docs/method.md section 10.10.

It is for designs for which the other solvers find none: torques that answer steeply to the speed,
for which Newton's method on the whole curve starts too far away. The equation is of first order, so
cycles from a lower start never cross those from a higher one: they rise or fall, cycle by cycle, to
the next cycle that repeats. If they fall to standstill from above all speeds that a steady cycle
can have, there is none.
"""

from __future__ import annotations

import math

from engine_dyn.compilation import inlined
from engine_dyn.loads.laws import FLOOR, load_terms
from engine_dyn.speed.arguments import Choice
from engine_dyn.speed.general.radau import Interval, interval_of, pass_interval, slope_of
from engine_dyn.speed.general.reduction import Design
from engine_dyn.speed.general.scratch import Scratch
from engine_dyn.speed.general.segments import POWERS, SEGMENTS, Q, place_of
from engine_dyn.speed.methods import CYCLE_TIME
from engine_dyn.speed.tables.extremes import interpolate
from engine_dyn.speed.tables.work_tables import (
    GAS_TORQUE,
    GAS_WORK,
    GAS_WORK_MIDDLE,
    GAS_WORK_TILT,
    QUINTIC,
    SQUARE,
    SQUARE_MIDDLE,
    SQUARE_SLOPE,
    SQUARE_TILT,
)
from engine_dyn.status import CONVERGED, NO_STEADY_STATE, NOT_CONVERGED, STALLED
from engine_dyn.types import Floats

__all__ = ["stable_cycle"]

REPEATS, STANDS, RUNS_AWAY, LOST = range(4)
"""What comes of cycles: they repeat, or reach standstill, or get ever faster, or cannot be told."""

HIGHEST = 1e8
"""Energy over the nominal one above which a design runs away within a cycle."""

MOST_STARTS = 14
"""Largest number of starts between standstill and running away."""

MOST_CYCLES = 80
"""Largest number of cycles that are followed from one start."""

COARSE, FINE = 1e-6, 1e-13
"""Relative errors of an interval: until a cycle is found, and then."""

CLOSED_COARSE, CLOSED_FINE = 1e-5, 1e-12
"""Relative distances of begin and end from the cycle that repeats, likewise."""

MOST_MU, TIMED = 80, 1e-11
"""Largest number of values of mu that are tried for the cycle's time, and its relative error."""


@inlined
def _interval(j: int, width: float, design: Design, variable: bool, table: Floats) -> Interval:
    """The interval after node j, docs/method.md (47)."""
    p = slope_of(
        j, width, table[GAS_WORK], table[GAS_TORQUE], table[GAS_WORK_MIDDLE], table[GAS_WORK_TILT]
    )
    v = slope_of(
        j, width, table[SQUARE], table[SQUARE_SLOPE], table[SQUARE_MIDDLE], table[SQUARE_TILT]
    )
    gas, eta = design.gas, design.eta
    masses = 0.0 if variable else eta
    work = (
        gas * p[0] - masses * v[0],
        gas * p[1] - masses * v[1],
        gas * p[2] - masses * v[2],
        gas * p[3] - masses * v[3],
        gas * p[4] - masses * v[4],
    )
    start = 1.0 + eta * table[SQUARE, j] if variable else 1.0
    return interval_of(work, start, eta if variable else 0.0, v)


@inlined
def _pass_cycle(
    start: float, mu: float, tolerance: float, design: Design, choice: Choice, width: float,
    table: Floats, solved: Floats,
) -> tuple[int, float, float, float]:  # fmt: skip
    """Follow one period from the energy `start` at node 0.

    `solved` gets e - 1 at the nodes as a table of work, with the middles and the tilts between
    them. Returns whether the design STANDS, RUNS_AWAY, is LOST or nothing of this (REPEATS), the
    energy at the end, the factor of a deviation, and the sum of what all intervals may miss.
    """
    nodes = table.shape[1]
    push = design.kappa * width
    e, factor, missed = start, 1.0, 0.0
    for j in range(nodes):
        after = j + 1 if j + 1 < nodes else 0
        interval = _interval(j, width, design, choice.variable, table)
        passed, followed = pass_interval(e, interval, push, mu, tolerance, design.law)
        if not followed:
            return LOST, e, factor, missed
        solved[GAS_WORK, j] = e - 1.0
        # Until the slopes at both ends are known, these are the values in the middle alone.
        solved[GAS_WORK_MIDDLE, j] = passed.middle - 1.0
        solved[GAS_WORK_TILT, j] = passed.slope_middle
        solved[GAS_TORQUE, after] = passed.slope / width
        e = passed.end
        factor *= passed.factor
        missed += passed.missed
        tau = 1.0 + design.eta * table[SQUARE, after] if choice.variable else 1.0
        if not (e > FLOOR * tau):
            return STANDS, e, factor, missed
        if not (e < HIGHEST):
            return RUNS_AWAY, e, factor, missed
    return REPEATS, e, factor, missed


@inlined
def _follow(
    start: float, above: float, mu: float, fine: bool, design: Design, choice: Choice,
    width: float, table: Floats, solved: Floats,
) -> tuple[int, float, float, int]:  # fmt: skip
    """Follow cycles from the energy `start` at node 0 until they repeat.

    One that begins above every steady cycle, `above`, and ends still higher never comes back.
    Returns what comes of them, the energy at node 0, what the last one may miss, and their number.
    Where a deviation shrinks slowly, the next start is where this shrinking leads to,
    docs/method.md (128); from where that led to standstill, the cycles are followed one by one.
    """
    tolerance, closed = (FINE, CLOSED_FINE) if fine else (COARSE, CLOSED_COARSE)
    e, plain, hurried = start, start, True
    for cycle in range(1, MOST_CYCLES + 1):
        fate, end, factor, missed = _pass_cycle(
            e, mu, tolerance, design, choice, width, table, solved
        )
        if fate != REPEATS:
            if not hurried or e == plain:
                return fate, e, missed, cycle
            e, hurried = plain, False
            continue
        if e >= above and end > e:
            return RUNS_AWAY, e, missed, cycle
        step = end - e
        plain = end
        # Multiples of rounding only: a steady cycle that repels is none.
        rounded = abs(step) <= 2e-14 * abs(end)
        if factor < 1.0:
            step /= 1.0 - factor
            if abs(step) <= closed * abs(end) or rounded:
                return REPEATS, e, missed + abs(step), cycle
        if hurried and factor < 1.0 and abs(step) <= 0.5 * e:
            e += step
        else:
            e = end
    return LOST, e, math.inf, MOST_CYCLES


@inlined
def _found(
    start: float, above: float, mu: float, design: Design, choice: Choice, width: float,
    table: Floats, solved: Floats,
) -> tuple[int, float, float, int]:  # fmt: skip
    """The stable cycle for one mu: from `start`, and from elsewhere where that leads to none.

    Starts that lead to standstill lie below all that run away, and steady cycles between them, so
    the next start is higher or lower.
    """
    low, high = 0.0, above
    runs_away = False
    e, cycles = start, 0
    fate = LOST
    for _ in range(MOST_STARTS):
        fate, found, _, more = _follow(e, above, mu, False, design, choice, width, table, solved)
        cycles += more
        if fate == REPEATS:
            fate, found, missed, more = _follow(
                found, above, mu, True, design, choice, width, table, solved
            )
            return fate, found, missed, cycles + more
        if fate == LOST or (fate == STANDS and e >= above):
            return fate, found, math.inf, cycles
        if fate == RUNS_AWAY:
            runs_away, high = True, min(e, high)
            e = 0.5 * (low + high)
        else:
            low = max(e, low)
            e = 0.5 * (low + high) if runs_away else above
    return (RUNS_AWAY if runs_away else fate), e, math.inf, cycles


@inlined
def _late(design: Design, variable: bool, table: Floats, solved: Floats) -> float:
    """Relative excess of the cycle's time over that at nominal speed, docs/method.md (59)."""
    nodes = table.shape[1]
    total = 0.0
    for j in range(nodes):
        tau = 1.0 + design.eta * table[SQUARE, j] if variable else 1.0
        total += math.sqrt(tau / (1.0 + solved[GAS_WORK, j])) - 1.0
    return total / nodes


@inlined
def _starts(design: Design, choice: Choice, width: float, table: Floats) -> tuple[float, float]:
    """Energies at node 0 from which cycles are followed: near nominal, and above all.

    A steady cycle has the nominal speed somewhere. From there on it gains no more than the range of
    the work and the load of a cycle, docs/method.md (129).
    """
    nodes = table.shape[1]
    masses = 0.0 if choice.variable else design.eta
    least, most, widest = math.inf, -math.inf, 1.0
    for j in range(nodes):
        work = design.gas * table[GAS_WORK, j] - masses * table[SQUARE, j]
        least, most = min(least, work), max(most, work)
        if choice.variable:
            widest = max(widest, 1.0 + design.eta * table[SQUARE, j])
    first = design.gas * table[GAS_WORK, 0] - masses * table[SQUARE, 0]
    near = 1.0 + design.eta * table[SQUARE, 0] if choice.variable else 1.0
    above = widest + (most - least) + abs(design.kappa) * width * nodes
    return max(near + first, near), above


@inlined
def _with_time(
    e: float, above: float, late: float, design: Design, choice: Choice, width: float,
    table: Floats, solved: Floats,
) -> tuple[int, float, float, int]:  # fmt: skip
    """The stable cycle whose time is that at nominal speed; mu in place of the energy.

    More mu is less load, or less drive, so the cycle's time falls or rises with it throughout. The
    search is by secants within a bracket of ln mu, halved where they are slow.
    """
    sense = 1.0 if design.kappa > 0.0 else -1.0
    # From `slow` on, the cycle takes longer than it should; from `quick` on, less long.
    here = slow = quick = 0.0
    late_slow = late_quick = 0.0
    has_slow = has_quick = False
    step, cycles, missed = 0.05, 0, 0.0
    for number in range(MOST_MU):
        if number > 0:
            fate, found, missed, more = _found(
                e, above, math.exp(sense * here), design, choice, width, table, solved
            )
            cycles += more
            if fate == REPEATS:
                e, late = found, _late(design, choice.variable, table, solved)
            elif fate == LOST:
                break
            else:
                late = math.inf if fate == STANDS else -math.inf
        if abs(late) <= TIMED:
            return CONVERGED, math.exp(sense * here), missed, cycles
        if late > 0.0:
            slow, late_slow, has_slow = here, late, True
        else:
            quick, late_quick, has_quick = here, late, True
        if has_slow and has_quick:
            wide = quick - slow
            if not (abs(wide) > 1e-14 * (1.0 + abs(quick))):
                break
            here = slow + 0.5 * wide
            if late_slow < math.inf and late_quick > -math.inf and number % 3 != 2:
                here = slow + wide * late_slow / (late_slow - late_quick)
        else:
            here += step if has_slow else -step
            step *= 2.0
    stands = has_slow and late_slow == math.inf
    return (STALLED if stands else NOT_CONVERGED), 1.0, missed, cycles


@inlined
def _finish(
    design: Design, choice: Choice, width: float, table: Floats, solved: Floats, records: Floats
) -> None:
    """Make `solved` the table of a design without load, and write q and F to the records.

    The tilts bound what the quartic misses of the solution. They include what the table of the work
    may miss, which the load damps: docs/method.md section 10.7.
    """
    nodes = table.shape[1]
    for j in range(nodes):
        after = j + 1 if j + 1 < nodes else 0
        left, right = solved[GAS_WORK, j], solved[GAS_WORK, after]
        slope_left, slope_right = width * solved[GAS_TORQUE, j], width * solved[GAS_TORQUE, after]
        tau = 1.0
        if choice.variable:
            tau += design.eta * table[SQUARE, j]
        q = (1.0 + left) / tau
        here = place_of(j, nodes // SEGMENTS)
        force, first, _ = load_terms(q, design.law)
        records[here + Q] = q
        records[here + POWERS] = force
        solved[GAS_WORK_MIDDLE, j] -= interpolate(0.5, left, right, slope_left, slope_right)
        cubic = 1.5 * (right - left) - 0.25 * (slope_left + slope_right)
        x = design.kappa * width * first / tau
        damped = min(1.0, 0.5 / (QUINTIC * x)) if x > 0.0 else 1.0
        missed = design.gas * abs(table[GAS_WORK_TILT, j]) + design.eta * abs(table[SQUARE_TILT, j])
        solved[GAS_WORK_TILT, j] = abs(solved[GAS_WORK_TILT, j] - cubic) + damped * missed
        for row in (SQUARE, SQUARE_SLOPE, SQUARE_MIDDLE, SQUARE_TILT):
            solved[row, j] = table[row, j] if choice.variable else 0.0


@inlined
def stable_cycle(
    design: Design, choice: Choice, width: float, scratch: Scratch
) -> tuple[int, int, float, float]:
    """Find the stable cycle of a design.

    The records get q and F at the nodes, `scratch.curve` the energy as a table of work. Returns the
    outcome, the number of cycles, mu, and what the numerical integration may miss of q.
    """
    table, solved = scratch.table, scratch.curve
    start, above = _starts(design, choice, width, table)
    mu = 1.0
    fate, e, missed, cycles = _found(start, above, mu, design, choice, width, table, solved)
    code = CONVERGED
    if choice.closure == CYCLE_TIME and (fate == REPEATS or fate == STANDS):
        late = _late(design, choice.variable, table, solved) if fate == REPEATS else math.inf
        code, mu, missed, more = _with_time(
            e if fate == REPEATS else above, above, late, design, choice, width, table, solved
        )
        cycles += more
    elif fate == STANDS:
        code = STALLED
    elif fate == RUNS_AWAY:
        code = NO_STEADY_STATE
    elif fate == LOST:
        code = NOT_CONVERGED
    if code == CONVERGED:
        _finish(design, choice, width, table, solved, scratch.records)
    return code, cycles, mu, missed
