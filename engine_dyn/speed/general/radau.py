"""One interval of the energy equation, however stiff: Radau's formula of fifth order.

The equation is docs/method.md (53) for e = chi, forwards in time. Between two nodes, the slope of
the work is a polynomial, docs/solver.md (84), so the formula may take steps of any size there.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from engine_dyn.compilation import inlined
from engine_dyn.loads.laws import Law, load_terms
from engine_dyn.speed.general.motion import Motion
from engine_dyn.types import Floats

ROOT = math.sqrt(6.0)

# Radau IIA with three stages, docs/solver.md (85); Hairer and Wanner, Solving Ordinary
# Differential Equations II, table IV.5.6: places, weights, and the slope of the polynomial through
# start and stages at the end of the step.
PLACE_1, PLACE_2 = (4.0 - ROOT) / 10.0, (4.0 + ROOT) / 10.0
A11, A12 = (88.0 - 7.0 * ROOT) / 360.0, (296.0 - 169.0 * ROOT) / 1800.0
A21, A22 = (296.0 + 169.0 * ROOT) / 1800.0, (88.0 + 7.0 * ROOT) / 360.0
A13, A23 = (-2.0 + 3.0 * ROOT) / 225.0, (-2.0 - 3.0 * ROOT) / 225.0
A31, A32, A33 = (16.0 - ROOT) / 36.0, (16.0 + ROOT) / 36.0, 1.0 / 9.0
END_1 = (1.0 - PLACE_2) / (PLACE_1 * (PLACE_1 - PLACE_2) * (PLACE_1 - 1.0))
END_2 = (1.0 - PLACE_1) / (PLACE_2 * (PLACE_2 - PLACE_1) * (PLACE_2 - 1.0))
END_3 = 1.0 + 1.0 / (1.0 - PLACE_1) + 1.0 / (1.0 - PLACE_2)

Quartic = tuple[float, float, float, float, float]
"""Coefficients of a polynomial in t from 0 to 1, ascending."""

MOST_STEPS = 256
"""Steps of an interval at most, a power of two."""


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
    """One step of `size` from t: the energy at its end, the slope there, the factor of a deviation.

    The stages are those of docs/solver.md (85), found by Newton's method; whether they were is the
    last result. The slope, times the width, is that of the polynomial through them, (86), because
    the terms of the equation itself nearly cancel where it is stiff.
    """
    z1 = z2 = z3 = 0.0
    factor, found = 1.0, False
    last = math.inf
    for _ in range(15):  # Newton's steps
        f1, j1 = rate_at(t + PLACE_1 * size, e + z1, interval, push, mu, law)
        f2, j2 = rate_at(t + PLACE_2 * size, e + z2, interval, push, mu, law)
        f3, j3 = rate_at(t + size, e + z3, interval, push, mu, law)
        r1 = size * (A11 * f1 + A12 * f2 + A13 * f3) - z1
        r2 = size * (A21 * f1 + A22 * f2 + A23 * f3) - z2
        r3 = size * (A31 * f1 + A32 * f2 + A33 * f3) - z3
        j1, j2, j3 = size * j1, size * j2, size * j3
        # (1 - A J) dz = r, and (1 - A J) x = 1 for a deviation of the start.
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
        # Rounding ends the convergence where terms that nearly cancel are large.
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
        # NaN where one of both could not be followed.
        difference = abs(e - before) if followed else math.nan
        settled = difference >= 0.5 * last and difference <= 1e-9 * abs(e)
        if difference <= tolerance * abs(e) or settled or 2 * steps > MOST_STEPS:
            return Passed(e, middle, slope, factor, difference, taken)
        before = e if followed else math.nan
        last = math.inf if math.isnan(difference) else difference
        steps *= 2
