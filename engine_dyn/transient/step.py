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
def solve(
    energy: float, y: float, time: float, place: float, square: float, width: float,
    slowest: float, law: Law, work: Work,
) -> tuple[bool, float, float]:  # fmt: skip
    """Follow a step from a place in it on.

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
        `work` gets squares of speeds, rates, slownesses and times at the points, continued to the
        beginning of the step if `place` is behind it.

    Returns
    -------
    solved : bool
        False where the speed falls too low or the sweeps do not converge.
    y_begin, y_end : float
        y at both ends of the step [J].
    """
    gas, inverse, rate, slow = work.gas, work.inverse, work.rate, work.slowness
    if law.ramp != 0.0 or not abs(square * work.series[12] - 1.0) <= NEAR:
        expand(square, law, work)
    if place > 0.0:
        weigh(place, work.begin_integral, work.begin_value)
    about = work.series[12]
    first = -_against(square * about - 1.0, square, time - law.since, law, work)
    y0 = y - width * place * first
    y1, y2 = y0 + width * POINTS[1] * first, y0 + width * POINTS[2] * first
    y3, y4 = y0 + width * POINTS[3] * first, y0 + width * first
    l0 = l1 = l2 = l3 = l4 = time - law.since
    before = 0.0
    solved = False
    for _ in range(MOST_SWEEPS):
        v0 = (energy + y0) * inverse[0]
        v1 = (energy + gas[1] + y1) * inverse[1]
        v2 = (energy + gas[2] + y2) * inverse[2]
        v3 = (energy + gas[3] + y3) * inverse[3]
        v4 = (energy + gas[4] + y4) * inverse[4]
        low = min(min(min(v0, v1), min(v2, v3)), v4)
        if not low > slowest:
            break
        high = max(max(max(v0, v1), max(v2, v3)), v4)
        if law.ramp != 0.0:
            slow[0], slow[1], slow[2] = (
                1.0 / math.sqrt(v0),
                1.0 / math.sqrt(v1),
                1.0 / math.sqrt(v2),
            )
            slow[3], slow[4] = 1.0 / math.sqrt(v3), 1.0 / math.sqrt(v4)
            l1, l2, l3, l4 = integrated(slow[0], slow[1], slow[2], slow[3], slow[4])
            l0 = time - law.since
            if place > 0.0:
                l0 -= width * dot(work.begin_integral, slow)
            l1, l2, l3, l4 = l0 + width * l1, l0 + width * l2, l0 + width * l3, l0 + width * l4
        if high * about < 1.0 + FAR and low * about > 1.0 - FAR:
            rate[0] = -_against(v0 * about - 1.0, v0, l0, law, work)
            rate[1] = -_against(v1 * about - 1.0, v1, l1, law, work)
            rate[2] = -_against(v2 * about - 1.0, v2, l2, law, work)
            rate[3] = -_against(v3 * about - 1.0, v3, l3, law, work)
            rate[4] = -_against(v4 * about - 1.0, v4, l4, law, work)
        else:
            work.square[0], work.square[1], work.square[2] = v0, v1, v2
            work.square[3], work.square[4] = v3, v4
            work.time[0], work.time[1], work.time[2], work.time[3], work.time[4] = (
                l0,
                l1,
                l2,
                l3,
                l4,
            )
            for k in range(5):
                rate[k] = -torque_of(work.square[k], law.since + work.time[k], law)
        d1, d2, d3, d4 = integrated(rate[0], rate[1], rate[2], rate[3], rate[4])
        begin = y
        if place > 0.0:
            begin -= width * dot(work.begin_integral, rate)
        change = abs(begin + width * d4 - y4) + abs(begin + width * d2 - y2) + abs(begin - y0)
        y0, y1, y2 = begin, begin + width * d1, begin + width * d2
        y3, y4 = begin + width * d3, begin + width * d4
        # Each sweep reduces the error by about as much as it reduces the change.
        if change * change <= TOLERANCE * energy * before or change <= 1e-15 * energy:
            solved = True
            break
        before = change
    if solved:
        work.square[0] = (energy + y0) * inverse[0]
        work.square[1] = (energy + gas[1] + y1) * inverse[1]
        work.square[2] = (energy + gas[2] + y2) * inverse[2]
        work.square[3] = (energy + gas[3] + y3) * inverse[3]
        work.square[4] = (energy + gas[4] + y4) * inverse[4]
        for k in range(5):
            solved = solved and work.square[k] > slowest
            work.omega[k] = math.sqrt(max(work.square[k], slowest))
            slow[k] = 1.0 / work.omega[k]
        begin = time
        if place > 0.0:
            begin -= width * dot(work.begin_integral, slow)
        d1, d2, d3, d4 = integrated(slow[0], slow[1], slow[2], slow[3], slow[4])
        work.time[0], work.time[1], work.time[2] = begin, begin + width * d1, begin + width * d2
        work.time[3], work.time[4] = begin + width * d3, begin + width * d4
    return solved, y0, y4
