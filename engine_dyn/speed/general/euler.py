"""The thesis's own method: explicit Euler in omega, one degree a step, cycles repeated.

Kakaitsas (2015), section 4.2, eqs. 4.1 and 4.2. First order; it adds energy at every step (the
square of the increment), so that with a constant load torque the mean speed climbs for ever.
Kept to reproduce printed numbers as they were made, not to be used for new ones.
"""

from __future__ import annotations

import math

from engine_dyn.compilation import inlined
from engine_dyn.types import Floats

__all__ = ["CLOSED", "march_cycles"]


CLOSED = 1e-6
"""Cycles end when the speed at the end of one is within this of its start [rad/s] (section 4.2)."""


@inlined
def march_cycles(
    torque: Floats,
    theta: Floats,
    dtheta: Floats,
    samples: int,
    width: float,
    offset: float,
    coefficient: float,
    alpha: float,
    start: float,
    first: int,
    passes: int,
    most: int,
    trace: Floats,
    rates: Floats,
) -> tuple[int, bool, bool, float, float, float]:
    """March omega [rad/s] with explicit Euler.

    `trace` gets the last cycle's samples, `rates` the angular acceleration [rad/s2] there.
    theta domega/dt = torque - offset - coefficient omega^alpha - dtheta omega^2/2 at `samples`
    angles a cycle, from sample `first`. Returns cycles done, whether closed, whether stalled, and
    the largest, smallest and mean sample of the last cycle.
    """
    omega = start
    limit = passes if passes > 0 else most
    top = bottom = mean = 0.0
    for cycle in range(1, limit + 1):
        begin = omega
        top, bottom, total = -math.inf, math.inf, 0.0
        for i in range(samples):
            j = first + i
            j = j - samples if j >= samples else j
            if not (omega > 0.0):
                return cycle, False, True, top, bottom, mean
            trace[j] = omega
            top = max(top, omega)
            bottom = min(bottom, omega)
            total += omega
            if alpha == 2.0:
                load = omega * omega
            elif alpha == 1.0:
                load = omega
            elif alpha == 0.0:
                load = 1.0
            else:
                load = omega**alpha
            rest = torque[j] - offset - coefficient * load - 0.5 * dtheta[j] * omega * omega
            rates[j] = rest / theta[j]
            omega += rates[j] / omega * width
        mean = total / samples
        if passes == 0 and abs(omega - begin) <= CLOSED:
            return cycle, True, False, top, bottom, mean
    return limit, passes > 0, not (omega > 0.0), top, bottom, mean
