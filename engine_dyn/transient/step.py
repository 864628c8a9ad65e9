"""Kinetic energy and time over one step of the crank angle, exact in the work of the gas.

E' = T_gas - T_against, dt/dphi = 1/omega, E = Theta omega^2/2 (Eksergian; docs/method.md chapter
7). With E = E_0 + w + y, the work w of the gas is known at the points of the step, so that only the
smooth y is integrated.
"""

from __future__ import annotations

import math

from engine_dyn.compilation import inlined
from engine_dyn.transient.lobatto import POINTS, dot, integrated, weigh
from engine_dyn.transient.work import Law, Work, expand, torque_of
from engine_dyn.types import Floats

NEAR = 0.02  # Change of the speed's square after which the series is expanded anew
FAR = 0.05  # Largest |z| for which the series is taken
MOST_SWEEPS = 12
TOLERANCE = 3e-12  # Expected relative error of the kinetic energy at which sweeps end


@inlined
def _against(z: float, square: float, later: float, law: Law, work: Work) -> float:
    """Torque by its series; `later` is the time since the law's."""
    s, z2 = work.series, z * z
    total = s[0] + s[1] * z + z2 * ((s[2] + s[3] * z) + z2 * (s[4] + s[5] * z))
    if law.ramp != 0.0:
        total += later * (s[6] + s[7] * z + z2 * ((s[8] + s[9] * z) + z2 * (s[10] + s[11] * z)))
    return law.constant + law.square * square + total


@inlined
def _integrate(
    begin: float, place: float, width: float, values: Floats, sums: Floats, work: Work
) -> float:
    """Put the integral of values to each point, from `begin` at a place, into `sums`; its change.

    The change is the sum of those at the beginning, the middle and the end.
    """
    a, b, c, d = integrated(values[0], values[1], values[2], values[3], values[4])
    if place > 0.0:
        begin -= width * dot(work.begin_integral, values)
    middle, end = begin + width * b, begin + width * d
    change = abs(begin - sums[0]) + abs(middle - sums[2]) + abs(end - sums[4])
    sums[0], sums[1], sums[2] = begin, begin + width * a, middle
    sums[3], sums[4] = begin + width * c, end
    return change


@inlined
def solve(
    energy: float, y: float, time: float, place: float, square: float, width: float,
    slowest: float, law: Law, work: Work,
) -> bool:  # fmt: skip
    """Follow a step from a place in it on; False if the speed falls too low or sweeps diverge.

    Parameters
    ----------
    energy : float
        Kinetic energy at the beginning of the step [J], without what `y` adds.
    y, time, square : float
        At `place`: y [J], time [s], square of the speed [rad2/s2].
    place : float
        In [0, 1).
    width : float
        Of the step [rad].
    slowest : float
        Square of the speed below which the step is refused.
    law, work
        `work` gets y, squares of speeds, speeds, rates, slownesses and times at the points,
        continued to the beginning of the step if `place` is behind it.
    """
    added, squares, rate, slow = work.added, work.square, work.rate, work.slowness
    if law.ramp != 0.0 or not abs(square * work.series[12] - 1.0) <= NEAR:
        expand(square, law, work)
    if place > 0.0:
        weigh(place, work.begin_integral, work.begin_value)
    about = work.series[12]
    first = -_against(square * about - 1.0, square, time - law.since, law, work)
    for k in range(5):
        added[k] = y + width * (POINTS[k] - place) * first
        work.time[k] = time
    before, solved = 0.0, False
    for _ in range(MOST_SWEEPS):
        low, high = math.inf, 0.0
        for k in range(5):
            v = (energy + work.gas[k] + added[k]) * work.inverse[k]
            low, high, squares[k] = min(low, v), max(high, v), v
        if not low > slowest:
            break
        if law.ramp != 0.0:
            for k in range(5):
                slow[k] = 1.0 / math.sqrt(squares[k])
            _integrate(time, place, width, slow, work.time, work)
        near = high * about < 1.0 + FAR and low * about > 1.0 - FAR
        for k in range(5):
            v, later = squares[k], work.time[k] - law.since
            if near:
                rate[k] = -_against(v * about - 1.0, v, later, law, work)
            else:
                rate[k] = -torque_of(v, later, law)
        change = _integrate(y, place, width, rate, added, work)
        # Each sweep reduces the error by about as much as it reduces the change.
        if change * change <= TOLERANCE * energy * before or change <= 1e-15 * energy:
            solved = True
            break
        before = change
    if not solved:
        return False
    for k in range(5):
        squares[k] = (energy + work.gas[k] + added[k]) * work.inverse[k]
        solved = solved and squares[k] > slowest
        work.omega[k] = math.sqrt(max(squares[k], slowest))
        slow[k] = 1.0 / work.omega[k]
    _integrate(time, place, width, slow, work.time, work)
    return solved
