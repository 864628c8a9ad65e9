"""Repetition of cycles in the energy form, from a start speed until the cycle closes.

A test bed does the same, and Kakaitsas (2015), section 4.2, does it in omega. Here the unknown is
the energy e = tau q of `newton`, and the work of gas and masses between nodes is exact, so that
only the load's work is integrated: by the two-point formula of docs/method.md (63), predicted by
Taylor's formula and solved by Newton's method (docs/method.md section 10.8).
"""

from __future__ import annotations

import math

from engine_dyn.compilation import inlined
from engine_dyn.loads.laws import FLOOR, Law, load_terms
from engine_dyn.types import Floats

__all__ = ["MOST_CYCLES", "repeat_cycles"]


MOST_CYCLES = 30000
"""Largest number of cycles where none is given."""

MOST_CORRECTIONS = 20
"""Largest number of Newton's steps from one node to the next."""


@inlined
def repeat_cycles(
    kappa: float,
    law: Law,
    width: float,
    nodes: int,
    w: Floats,
    dw: Floats,
    tau: Floats,
    dtau: Floats,
    d: Floats,
    start: float,
    first: int,
    periods_a_cycle: int,
    passes: int,
    tolerance: float,
) -> tuple[int, bool, bool]:
    """Integrate s from q = `start` at node `first`, docs/method.md (63) and (72), with mu = 1.

    Afterwards `d` has s + w of the last period. Stops after `passes` cycles, or with passes = 0
    when the change over a cycle, extrapolated with the observed contraction, is at most
    `tolerance`, because a small change alone does not mean a small error. Returns the number of
    cycles done, whether the cycle closed, and whether the engine stalled.
    """
    value = start * tau[first] - 1.0 - w[first]
    factor = width * width / 12.0
    last = math.inf
    most = passes if passes > 0 else MOST_CYCLES
    for cycle in range(1, most + 1):
        begin = value
        for _ in range(periods_a_cycle):
            for i in range(nodes):
                j = first + i
                j = j - nodes if j >= nodes else j
                k = j + 1 if j + 1 < nodes else 0
                d[j] = value + w[j]
                q0 = (1.0 + w[j] + value) / tau[j]
                if not (q0 > FLOOR):
                    return cycle, False, True
                f0, d0, _ = load_terms(q0, law)
                f0 = -kappa * (f0 - 1.0)
                g0 = -kappa * d0 * (dw[j] + f0 - q0 * dtau[j]) / tau[j]
                new = value + width * (f0 + 0.5 * width * g0)
                for _ in range(MOST_CORRECTIONS):
                    q1 = (1.0 + w[k] + new) / tau[k]
                    f1, d1, dd1 = load_terms(q1, law)
                    f1 = -kappa * (f1 - 1.0)
                    dq1 = (dw[k] + f1 - q1 * dtau[k]) / tau[k]
                    g1 = -kappa * d1 * dq1
                    miss = value + 0.5 * width * (f0 + f1) + factor * (g0 - g1) - new
                    # Newton's step, because a load that is strong against the inertia makes the
                    # formula stiff.
                    b1 = kappa * d1 / tau[k]
                    turn = kappa * (dd1 * dq1 - d1 * dtau[k] / tau[k]) / tau[k]
                    move = miss / (1.0 + 0.5 * width * b1 + factor * (b1 * b1 - turn))
                    new += move
                    if abs(move) <= 1e-15:
                        break
                value = new
        change = abs(value - begin)
        if passes == 0:
            rate = min(change / last, 0.999999) if last < math.inf and last > 0.0 else 0.0
            if cycle > 1 and change * rate / (1.0 - rate) <= tolerance:
                return cycle, True, False
            if change <= 1e-15:
                return cycle, True, False
        last = change
    return most, passes > 0, False
