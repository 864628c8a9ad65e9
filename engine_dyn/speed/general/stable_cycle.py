"""The stable cycle of one design, by following cycles in time: docs/solver.md section 10.5.

It is for designs for which the other solvers find none: torques that answer steeply to the speed.
Cycles from a lower start never cross those from a higher one.

One interval of the energy equation, however stiff, is passed by Radau's formula of fifth order. The
equation is docs/method.md (53) for e = chi, forwards in time. Between two nodes, the slope of the
work is a polynomial, docs/solver.md (84), so the formula may take steps of any size there.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from engine_dyn.compilation import inlined
from engine_dyn.loads.laws import FLOOR, Law, is_power, load_terms
from engine_dyn.speed.fields import CYCLE_TIME
from engine_dyn.speed.general.newton import Design, Motion
from engine_dyn.speed.work.interpolation import largest
from engine_dyn.status import CONVERGED, NO_STEADY_STATE, NOT_CONVERGED, STALLED
from engine_dyn.types import Floats

REPEATS, STANDS, RUNS_AWAY, LOST = CONVERGED, STALLED, NO_STEADY_STATE, NOT_CONVERGED
"""Fates of cycles: they repeat, come to standstill, get ever faster, or cannot be determined."""

HIGHEST = 1e8  # Energy over the nominal energy above which a design runs away within a cycle

# Largest number of energies at node 0, between standstill and running away, that are tried as
# starts
MOST_STARTS = 14

PROBABLY = -1.0  # Error that is reported where not all starts could be followed

MOST_CYCLES = 80  # Largest number of cycles that are followed from one start

MOST_STEPS = 600
"""Largest number of Radau's steps for each node of a design; most need less than 100."""

GROWTH = 4.0
"""Safety factor on the growth of a cycle's time, where it is extrapolated down to standstill."""


@inlined
def _pass_cycle(
    start: float, mu: float, tolerance: float, most: int, width: float, design: Design,
    motion: Motion,
) -> tuple[int, float, float, float, int]:  # fmt: skip
    """Follow one period from the energy `start` at node 0.

    `motion` gets e - 1 at the nodes and in the middles, and its slope. Returns whether the design
    STANDS, RUNS_AWAY, is LOST (also after `most` steps) or none of these (REPEATS), the energy at
    the end, the factor of a deviation, the sum of all intervals' errors, and the number of steps.
    """
    push = design.kappa * width
    e, factor, missed, steps = start, 1.0, 0.0, 0
    for j in range(len(motion.w)):
        after = (j + 1) % len(motion.w)
        interval = interval_of(j, width, motion)
        passed = pass_interval(e, interval, push, mu, tolerance, design.law)
        steps += passed.steps
        if not (passed.missed < math.inf) or steps > most:
            return LOST, e, factor, missed, steps
        motion.d[j] = e - 1.0
        motion.between[j] = passed.middle - 1.0
        motion.slope[after] = passed.slope / width
        e = passed.end
        factor *= passed.factor
        missed += passed.missed
        if not (e > FLOOR * motion.tau[after]):
            return STANDS, e, factor, missed, steps
        if not (e < HIGHEST):
            return RUNS_AWAY, e, factor, missed, steps
    return REPEATS, e, factor, missed, steps


@inlined
def _follow(
    start: float, above: float, mu: float, fine: bool, most: int, width: float, design: Design,
    motion: Motion,
) -> tuple[int, float, float, int, int]:  # fmt: skip
    """Follow cycles from the energy `start` at node 0 until they repeat.

    Where a deviation shrinks, the next start is its limit, docs/solver.md (87). `above` exceeds
    every steady cycle. Returns the fate, the energy at node 0, the last cycle's error, the number
    of cycles and that of steps, which are `most` or hardly more.
    """
    # Relative error of an interval, and relative distance of begin and end from the repeated cycle:
    # the first of each pair once a cycle has been found (`fine`), the second until then.
    tolerance, closed = (1e-13, 1e-12) if fine else (1e-6, 1e-5)
    e, plain, hurried, steps = start, start, True, 0
    for cycle in range(1, MOST_CYCLES + 1):
        fate, end, factor, missed, more = _pass_cycle(
            e, mu, tolerance, most - steps, width, design, motion
        )
        steps += more
        if fate != REPEATS:
            if not hurried or e == plain:
                return fate, e, missed, cycle, steps
            e, hurried = plain, False
            continue
        if e >= above and end > e:
            return RUNS_AWAY, e, missed, cycle, steps
        step, plain = end - e, end
        # A cycle also counts as repeated where its ends differ by a small multiple of rounding. A
        # steady cycle that repels others, with a factor of 1 or more, does not count.
        rounded = abs(step) <= 2e-14 * abs(end)
        if factor < 1.0:
            step /= 1.0 - factor
            if abs(step) <= closed * abs(end) or rounded:
                return REPEATS, e, missed + abs(step), cycle, steps
        e = e + step if hurried and factor < 1.0 and abs(step) <= 0.5 * e else end
    return LOST, e, math.inf, MOST_CYCLES, steps


@inlined
def _cycle_at(
    start: float, above: float, mu: float, most: int, width: float, design: Design, motion: Motion
) -> tuple[int, float, float, int, int]:
    """The stable cycle for one mu: from `start`, or from a start higher or lower than that.

    A start may be so high that its load is too strong to be followed; then a lower one is tried. A
    load that grows with a power of the speed lets no design run away.
    """
    low, high, e = 0.0, above, start
    bounded = is_power(design.law) and design.kappa > 0.0
    too_high, runs_away, fate, cycles, steps = False, False, LOST, 0, 0
    for _ in range(MOST_STARTS):
        fate, node, _, more, taken = _follow(
            e, above, mu, False, most - steps, width, design, motion
        )
        cycles, steps = cycles + more, steps + taken
        if fate == REPEATS:
            fate, node, missed, more, taken = _follow(
                node, above, mu, True, most - steps, width, design, motion
            )
            return fate, node, missed, cycles + more, steps + taken
        if (fate == LOST and (e <= start or steps >= most)) or (fate == STANDS and e >= above):
            return fate, node, math.inf, cycles, steps
        if fate == STANDS:
            low = max(e, low)
            e = 0.5 * (low + high) if runs_away or too_high else above
        else:
            runs_away, too_high = runs_away or fate == RUNS_AWAY, too_high or fate == LOST
            high = min(e, high)
            e = 0.5 * (low + high)
    # All starts that can be followed come to standstill: probably the others do too
    if too_high and low > start:
        return STANDS, e, PROBABLY, cycles, steps
    if too_high or (runs_away and bounded):
        fate = LOST
    elif runs_away:
        fate = RUNS_AWAY
    return fate, e, math.inf, cycles, steps


@inlined
def _late(motion: Motion) -> float:
    """Relative excess of the cycle's time over that at nominal speed, docs/method.md (66)."""
    total = 0.0
    for j in range(len(motion.d)):
        total += math.sqrt(motion.tau[j] / (1.0 + motion.d[j])) - 1.0
    return total / len(motion.d)


@inlined
def _slowest(motion: Motion) -> float:
    """Smallest q at the nodes of a cycle that was followed."""
    least = math.inf
    for j in range(len(motion.d)):
        least = min(least, (1.0 + motion.d[j]) / motion.tau[j])
    return least


@inlined
def stable_cycle(
    closure: int, width: float, design: Design, motion: Motion
) -> tuple[int, int, float, float]:
    """Find the stable cycle of a design; `motion` gets chi - 1 at the nodes, and its slope.

    With the closure `cycle_time`, mu is searched by secants within a bracket of ln mu, halved where
    they are slow. Returns the outcome, the number of cycles, mu, and what the numerical integration
    may miss of the energy.

    Beside standstill the cycle's time grows with the logarithm of the smallest q. Where `GROWTH`
    times what it grew from one mu to the next leaves it too short at `FLOOR`, the engine stalls.
    """
    sense = 1.0 if design.kappa > 0.0 else -1.0
    # Values of `sense` ln mu for which the cycle takes too long (`slow`) and too short (`quick`).
    # Until they are known, `late_slow` and `late_quick` are 0.
    here = slow = quick = late_slow = late_quick = 0.0
    # A steady cycle has the nominal speed somewhere. From there it gains no more than the range of
    # the work and the load of a cycle, docs/solver.md (88): no steady cycle begins `above`.
    range_of_work = largest(1.0, motion.w) + largest(-1.0, motion.w)
    gain = range_of_work + abs(design.kappa) * width * len(motion.w)
    e, above = motion.tau[0] + max(motion.w[0], 0.0), max(largest(1.0, motion.tau), 1.0) + gain
    step, cycles, steps, least, sure = 0.05, 0, 0, False, True
    slowest = late_before = math.inf
    for number in range(80):  # trial values of mu
        mu = math.exp(sense * here)
        fate, node, missed, more, taken = _cycle_at(
            e, above, mu, MOST_STEPS * len(motion.w) - steps, width, design, motion
        )
        cycles, steps = cycles + more, steps + taken
        sure = sure and missed != PROBABLY
        if number == 0 and (closure != CYCLE_TIME or fate == RUNS_AWAY):
            return (fate if sure else NOT_CONVERGED), cycles, mu, missed
        if fate == LOST:
            break
        if fate == REPEATS:
            e, late = node, _late(motion)
            before, slowest = slowest, _slowest(motion)
            # Where the smallest (omega/omega_n)^2 is below 1e-2, the cycle's time grows with its
            # logarithm.
            near = late_slow == math.inf and slowest < before < 1e-2
            if near and late_before < late < 0.0 and sure:
                grows = (late - late_before) / math.log(before / slowest)
                if late + GROWTH * grows * math.log(slowest / FLOOR) < 0.0:
                    return STALLED, cycles, 1.0, math.inf
            late_before = late
        else:
            late = math.inf if fate == STANDS else -math.inf
            e = above if number == 0 and sure else e
        if abs(late) <= 1e-11:
            return CONVERGED, cycles, mu, missed
        if late > 0.0:
            slow, late_slow = here, late
        else:
            quick, late_quick = here, late
        if late_slow > 0.0 > late_quick:
            wide = quick - slow
            if not (abs(wide) > 1e-14 * (1.0 + abs(quick))):
                least = True
                break
            here = slow + 0.5 * wide
            if late_slow < math.inf and late_quick > -math.inf and number % 3 != 2:
                here = slow + wide * late_slow / (late_slow - late_quick)
        else:
            here += step if late_slow > 0.0 else -step
            step *= 2.0
    # Where rounding leaves no value of mu between the ends of the bracket, a larger error of the
    # cycle's time is accepted, and added to the error of the energy.
    if least and max(late_slow, -late_quick) <= 1e-6:
        return CONVERGED, cycles, mu, missed + max(late_slow, -late_quick)
    # The engine stalls where even a cycle near standstill takes less time than it should.
    stalls = sure and least and late_slow == math.inf
    return (STALLED if stalls else NOT_CONVERGED), cycles, 1.0, math.inf


ROOT = math.sqrt(6.0)

# Radau IIA with three stages, docs/solver.md (85); Hairer and Wanner, Solving Ordinary Differential
# Equations II, table IV.5.6: places, weights, and the end slope of the polynomial through start and
# stages.
PLACE_1, PLACE_2 = (4.0 - ROOT) / 10.0, (4.0 + ROOT) / 10.0
A11, A12 = (88.0 - 7.0 * ROOT) / 360.0, (296.0 - 169.0 * ROOT) / 1800.0
A21, A22 = (296.0 + 169.0 * ROOT) / 1800.0, (88.0 + 7.0 * ROOT) / 360.0
A13, A23 = (-2.0 + 3.0 * ROOT) / 225.0, (-2.0 - 3.0 * ROOT) / 225.0
A31, A32, A33 = (16.0 - ROOT) / 36.0, (16.0 + ROOT) / 36.0, 1.0 / 9.0
END_1 = (1.0 - PLACE_2) / (PLACE_1 * (PLACE_1 - PLACE_2) * (PLACE_1 - 1.0))
END_2 = (1.0 - PLACE_1) / (PLACE_2 * (PLACE_2 - PLACE_1) * (PLACE_2 - 1.0))
END_3 = 1.0 + 1.0 / (1.0 - PLACE_1) + 1.0 / (1.0 - PLACE_2)

Quartic = tuple[float, float, float, float, float]
"""Coefficients of a polynomial in t from 0 to 1, in ascending order."""

MOST_RADAU_STEPS = 256  # Largest number of steps of an interval, a power of two


class Interval(NamedTuple):
    """Slope of the work times the width, tau at the begin, and its slope: docs/solver.md (84).

    That slope is times the width too, and its coefficients are divided by 1 to 5.
    """

    work: Quartic
    start: float
    turn: Quartic


class Passed(NamedTuple):
    """Energy at the end of an interval.

    `end` and `middle` are its values there, `slope` its slope at the end times the width, `factor`
    that of a small deviation over the interval, and `missed` bounds the error of one passage; it is
    NaN where the equation could not be followed. `steps` counts all steps, also those given up.
    """

    end: float
    middle: float
    slope: float
    factor: float
    missed: float
    steps: int


@inlined
def slope_of(j: int, width: float, value: Floats, slope: Floats) -> Quartic:
    """Coefficients of the slope, times the width, between node j and the next: docs/solver.md (84).

    The quartic through four slopes whose integral is the rise of the values.
    """
    nodes = len(value)
    after, far = (j + 1) % nodes, (j + 2) % nodes
    s0, s1 = width * slope[(j - 1) % nodes], width * slope[j]
    s2, s3 = width * slope[after], width * slope[far]
    c0, c1 = s1, -s0 / 3.0 - 0.5 * s1 + s2 - s3 / 6.0
    c2, c3 = 0.5 * (s0 + s2) - s1, (s3 - s0) / 6.0 + 0.5 * (s1 - s2)
    missed = 30.0 / 11.0 * (value[after] - value[j] - (c0 + c1 / 2.0 + c2 / 3.0 + c3 / 4.0))
    return c0, c1 + 2.0 * missed, c2 - missed, c3 - 2.0 * missed, missed


@inlined
def interval_of(j: int, width: float, motion: Motion) -> Interval:
    """The interval between node j and the next."""
    c = slope_of(j, width, motion.tau, motion.dtau)
    turn = c[0], c[1] / 2.0, c[2] / 3.0, c[3] / 4.0, c[4] / 5.0
    return Interval(slope_of(j, width, motion.w, motion.dw), motion.tau[j], turn)


@inlined
def rate_at(
    t: float, e: float, interval: Interval, push: float, mu: float, law: Law
) -> tuple[float, float]:
    """Slope of e times the width, docs/method.md (53), and its derivative over e.

    `push` is kappa times the width.
    """
    c, s = interval.work, interval.turn
    tau = interval.start + t * (s[0] + t * (s[1] + t * (s[2] + t * (s[3] + t * s[4]))))
    force, first = load_terms(e / tau, law)
    rate = c[0] + t * (c[1] + t * (c[2] + t * (c[3] + t * c[4]))) - push * (force / mu - 1.0)
    return rate, -push / mu * first / tau


# Longer than usual: a system of three equations, written out, because kernels make no arrays.
@inlined
def _step(
    t: float, size: float, e: float, interval: Interval, push: float, mu: float, law: Law
) -> tuple[float, float, float, bool]:
    """One step of `size` from t: energy at its end, slope there, factor of a deviation, success.

    Newton's method solves the stages of docs/solver.md (85). The slope, times the width, is the
    polynomial's, (86), because the equation's own terms nearly cancel where it is stiff.
    """
    z1 = z2 = z3 = 0.0
    factor, found = 1.0, False
    last = math.inf
    for _ in range(15):  # steps of Newton's method
        f1, j1 = rate_at(t + PLACE_1 * size, e + z1, interval, push, mu, law)
        f2, j2 = rate_at(t + PLACE_2 * size, e + z2, interval, push, mu, law)
        f3, j3 = rate_at(t + size, e + z3, interval, push, mu, law)
        r1 = size * (A11 * f1 + A12 * f2 + A13 * f3) - z1
        r2 = size * (A21 * f1 + A22 * f2 + A23 * f3) - z2
        r3 = size * (A31 * f1 + A32 * f2 + A33 * f3) - z3
        j1, j2, j3 = size * j1, size * j2, size * j3
        # Elimination for (1 - A J) dz = r, and for (1 - A J) x = 1, a deviation of the start.
        below = 1.0 / (1.0 - A11 * j1)
        up12, up13 = -A12 * j2 * below, -A13 * j3 * below
        r1, x1 = r1 * below, below
        m22, m23 = 1.0 - A22 * j2 + A21 * j1 * up12, -A23 * j3 + A21 * j1 * up13
        m32, m33 = -A32 * j2 + A31 * j1 * up12, 1.0 - A33 * j3 + A31 * j1 * up13
        r2, x2 = r2 + A21 * j1 * r1, 1.0 + A21 * j1 * x1
        r3, x3 = r3 + A31 * j1 * r1, 1.0 + A31 * j1 * x1
        share = m32 / m22
        below = 1.0 / (m33 - share * m23)
        d3, factor = (r3 - share * r2) * below, (x3 - share * x2) * below
        d2 = (r2 - m23 * d3) / m22
        d1 = r1 - up12 * d2 - up13 * d3
        z1, z2, z3 = z1 + d1, z2 + d2, z3 + d3
        change = abs(d1) + abs(d2) + abs(d3)
        if not (change < 1e300):
            break
        scale = abs(e) + abs(z3)
        # Rounding ends the convergence where large terms nearly cancel.
        found = change <= 1e-14 * scale or (change >= 0.5 * last and change <= 1e-10 * scale)
        if found:
            break
        last = change
    slope = (END_1 * z1 + END_2 * z2 + END_3 * z3) / size
    return e + z3, slope, factor, found


@inlined
def pass_interval(
    start: float, interval: Interval, push: float, mu: float, tolerance: float, law: Law
) -> Passed:
    """Pass an interval in so many equal steps that twice as many give the same energy at its end.

    The difference is at most `tolerance` times the energy, or what twice as many steps do not
    improve.
    """
    steps, taken, before, last = 1, 0, math.nan, math.inf
    while True:
        e, middle, slope, factor, followed = start, start, 0.0, 1.0, True
        for k in range(steps):
            e, slope, more, found = _step(k / steps, 1.0 / steps, e, interval, push, mu, law)
            factor *= more
            taken += 1
            followed = followed and found
            if not followed:
                break
            if 2 * (k + 1) == steps:
                middle = e
        # The difference is NaN where one of both numbers of steps could not be followed.
        difference = abs(e - before) if followed else math.nan
        settled = difference >= 0.5 * last and difference <= 1e-9 * abs(e)
        if difference <= tolerance * abs(e) or settled or 2 * steps > MOST_RADAU_STEPS:
            return Passed(e, middle, slope, factor, difference, taken)
        before = e if followed else math.nan
        last = math.inf if math.isnan(difference) else difference
        steps *= 2
