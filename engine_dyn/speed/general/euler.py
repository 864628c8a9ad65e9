"""The thesis's own method: cycles of explicit Euler steps in omega, one degree each.

docs/method.md (83); Kakaitsas (2015), section 4.2, eqs. 4.1 and 4.2. The method is of first order.
Every step adds energy, docs/method.md (84), so that with a constant load torque the mean speed
climbs without end. The method exists to reproduce printed numbers and should not be used for new
ones.
"""

from __future__ import annotations

import math

from engine_dyn.compilation import inlined
from engine_dyn.types import Floats

__all__ = ["CLOSED_CYCLE", "step_cycles"]


CLOSED_CYCLE = 1e-6
"""Cycles end when the speeds at both ends of one differ by no more than this [rad/s]: Kakaitsas
(2015), section 4.2."""


@inlined
def step_cycles(
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
    """Step through cycles of omega [rad/s] by explicit Euler, docs/method.md (83).

    theta domega/dt = torque - offset - coefficient omega^alpha - dtheta omega^2/2 at `samples`
    angles a cycle, from sample `first`. `trace` gets the samples of the last cycle, `rates` the
    angular acceleration [rad/s2] there. Returns the number of cycles done, whether the cycle
    closed, whether the engine stalled, and the largest, smallest and mean sample of the last cycle.
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
            surplus = torque[j] - offset - coefficient * load - 0.5 * dtheta[j] * omega * omega
            rates[j] = surplus / theta[j]
            omega += rates[j] / omega * width
        mean = total / samples
        if passes == 0 and abs(omega - begin) <= CLOSED_CYCLE:
            return cycle, True, False, top, bottom, mean
    return limit, passes > 0, not (omega > 0.0), top, bottom, mean
