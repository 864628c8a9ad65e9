"""Start and stop: place in a step and speed over the time, by Runge and Kutta's formula.

At a standstill, torque against the rotation is dry friction: it holds whatever does not exceed it.
A shaft that is turned back goes back through the works of the gas by which it came.
"""

from __future__ import annotations

import math

from engine_dyn.compilation import inlined
from engine_dyn.transient.lobatto import slope_at, value_at
from engine_dyn.transient.work import Law
from engine_dyn.types import Floats

SUBSTEPS = 12  # At least so many a step
END, BEGIN, STANDSTILL, OVERRUN, RELEASED, KINDS = range(1, 7)
"""What a piece of time ends with; 0 is nothing of these, and `KINDS` their number."""


@inlined
def drive(s: float, width: float, gas: Floats) -> float:
    """Torque of the gas [N m] at a place."""
    return slope_at(s, gas) / width


@inlined
def against(omega: float, later: float, law: Law, slowest: float) -> float:
    """Torque against a rotation of this speed, 0 included [N m]; `later` as of the law's time.

    A load that grows as the speed falls (a power) stays as it is at the lowest speed.
    """
    fast = abs(omega)
    torque = law.constant + fast * (law.linear + law.square * fast)
    load = law.load + law.ramp * later
    if law.half == 0.0:
        torque += load
    elif load != 0.0:
        at = max(fast, slowest) if law.half < 0.0 else fast
        if at > 0.0:
            torque += load * math.exp(law.half * math.log(at * at * law.nominal))
    return torque


@inlined
def moved(
    s: float, omega: float, later: float, dt: float, way: float, width: float, starter: float,
    top: float, slowest: float, gas: Floats, inertia: Floats, law: Law,
) -> tuple[float, float]:  # fmt: skip
    """Place and speed after a time `dt`; `way` is the sense in which torque is against (1, -1).

    `gas` and `inertia` are polynomials of work and inertia over the place.
    """
    ds = dw = qs = qw = 0.0
    for stage in range(4):
        share = 0.0 if stage == 0 else (dt if stage == 3 else 0.5 * dt)
        si, wi = s + share * qs, omega + share * qw
        rest = against(wi, later + share, law, slowest)
        torque = drive(si, width, gas) - (way * rest if rest > 0.0 else rest)
        if starter > 0.0:
            torque += starter * (1.0 - wi / top)
        torque -= 0.5 * slope_at(si, inertia) / width * wi * wi
        qs, qw = wi / width, torque / value_at(si, inertia)
        weight = 1.0 if stage == 0 or stage == 3 else 2.0
        ds += weight * qs
        dw += weight * qw
    return s + dt / 6.0 * ds, omega + dt / 6.0 * dw


@inlined
def excess(
    kind: int, s: float, omega: float, way: float, overrun: float, top: float, release: float
) -> float:
    """Positive where the end of a kind is passed; `overrun` is 1 below the top, -1 above it."""
    if kind == 0:
        return 1.0
    if kind == END:
        return s - 1.0
    if kind == BEGIN:
        return -s
    if kind == STANDSTILL:
        return -way * omega
    if kind == OVERRUN:
        return overrun * (omega - top)
    return omega - release
