"""Weak loads: how long cycles must be repeated, what Euler adds, and which closure loses digits.

The engine is the catalogue's `ntua` at 50 % load and 1200 rpm with a flywheel of 1.5 kg m2; the
load's offset takes more and more of the mean torque, so that less and less of it depends on speed.
With load exponent 2 a deviation of omega^2 shrinks by rho = exp(-kappa 4 pi) in a cycle.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from benchmarks.stress import draw
from engine_dyn import PeriodicSpeed, periodic_speed
from engine_dyn.status import CONVERGED, NOT_CONVERGED
from engine_dyn.types import Floats
from oracle import spline
from oracle.solution import CYCLE

BORE, STROKE, RATIO, MASS, INERTIA, FRICTION, CRANKCASE = (
    0.14, 0.18, 0.2571, 6.67, 1.5, 32.776, 101325.0,
)  # fmt: skip
SPEED = 1200.0 * math.pi / 30.0
ROW = 100

WEAKNESS = tuple(float(10.0 ** (-k / 4.0)) for k in range(4, 17))
"""1 - rho: from 0.1 to 1e-4."""

STOP = 1e-6
"""rad/s: repetition ends where the speeds at begin and end of a cycle differ by less."""

LEFT = 1e-9
"""Share of a deviation at which an exact repetition of cycles ends."""

DRIFT = (1, 10, 100, 1000, 3000, 10000)
"""Cycles of explicit Euler with a constant load torque."""


@dataclass(frozen=True)
class Weak:
    """One weakness: cycles until repetition ends, and relative errors of the mean speed.

    `euler` is explicit Euler at one degree, NaN where it does not end; `repetition` is any exact
    repetition of cycles, which ends where `LEFT` of a deviation is left. `iterations` are those of
    the closed or periodic solution.
    """

    weakness: float
    euler: float
    repetition: float
    iterations: int
    error_euler: float
    error_stop: float
    error_start: float
    error_mean: float


def solved(offset: float, exponent: float = 2.0, **options: Any) -> PeriodicSpeed:
    """The engine with an offset of the load torque [N m]."""
    return periodic_speed(
        draw.family().row(ROW), bore=BORE, stroke=STROKE, crank_ratio=RATIO,
        reciprocating_mass=MASS, inertia=INERTIA, speed=SPEED, load_exponent=exponent,
        load_offset=offset, friction_torque=FRICTION, crankcase_pressure=CRANKCASE, **options,
    )  # fmt: skip


def exact(offset: float, mean: float) -> spline.Solutions:
    """The same by the independent solver."""
    columns = {
        "row": float(ROW), "crankcase": CRANKCASE, "crank_ratio": RATIO, "bore": BORE,
        "stroke": STROKE, "mass": MASS, "inertia": INERTIA, "speed": SPEED, "exponent": 2.0,
        "mean_torque": mean, "offset": offset, "cylinders": 1, "variable": False,
    }  # fmt: skip
    return draw.exact(columns, "power_mean")


def march(offset: float, mean: float) -> tuple[Floats, Floats]:
    """One cycle of u = (omega/omega_n)^2 by Runge and Kutta's formula at one degree.

    u' = D(phi) - kappa u is linear. Returns at every degree what a cycle from u = 0 has added, and
    the share of u that is left.
    """
    scale = 2.0 / (INERTIA * SPEED**2)
    kappa = scale * (mean - offset)
    phi = np.arange(1441) * (CYCLE / 1440)
    lever = 0.25 * math.pi * BORE**2 * 0.5 * STROKE
    v, b = spline.velocity(phi, RATIO), spline.acceleration(phi, RATIO)
    torque = lever * (draw.family().row(ROW)(phi) - CRANKCASE) * v - FRICTION
    torque -= MASS * (0.5 * STROKE * SPEED) ** 2 * b * v
    drive = scale * (torque - offset)
    h = CYCLE / 720
    u = np.zeros(721)
    for i in range(720):
        d0, d1, d2 = drive[2 * i : 2 * i + 3]
        k1 = d0 - kappa * u[i]
        k2 = d1 - kappa * (u[i] + 0.5 * h * k1)
        k3 = d1 - kappa * (u[i] + 0.5 * h * k2)
        k4 = d2 - kappa * (u[i] + h * k3)
        u[i + 1] = u[i] + h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
    z = kappa * h
    kept = 1.0 - z + z**2 / 2.0 - z**3 / 6.0 + z**4 / 24.0
    return u, np.asarray(kept ** np.arange(721))


def closures(offset: float, mean: float) -> tuple[float, float, float]:
    """Relative errors of the mean speed: stopped repetition, end = start, and power mean."""
    true = float(exact(offset, mean).omega_mean[0]) / SPEED
    u, kept = march(offset, mean)

    def mean_of(start: float) -> float:
        """Mean speed over nominal of the cycle that starts with `start`."""
        return float(np.sqrt(u + start * kept)[:720].mean())

    returning = u[720] / (1.0 - kept[720])
    powered = (1.0 - u[:720].mean()) / kept[:720].mean()
    # Repetition from 1 % above, until it closes; its own solution is the periodic one of the march.
    start = returning * 1.02
    while abs(math.sqrt(kept[720] * start + u[720]) - math.sqrt(start)) * SPEED >= STOP:
        start = kept[720] * start + u[720]
    settled = mean_of(returning)
    return (
        abs(mean_of(start) / settled - 1.0),
        abs(settled / true - 1.0),
        abs(mean_of(powered) / true - 1.0),
    )


def study() -> list[Weak]:
    """All weaknesses."""
    mean = solved(0.0).torque_mean
    found = []
    for weakness in WEAKNESS:
        kappa = -math.log1p(-weakness) / CYCLE
        offset = mean - 0.5 * INERTIA * SPEED**2 * kappa
        ours, euler = (solved(offset, method=method) for method in ("auto", "thesis"))
        if ours.status != CONVERGED:
            raise RuntimeError(f"1 - rho = {weakness:g}: status {ours.status}")
        stop, start, power = closures(offset, mean)
        found.append(
            Weak(
                weakness=weakness,
                euler=math.nan if euler.status == NOT_CONVERGED else float(euler.iterations),
                repetition=math.ceil(math.log(LEFT) / math.log1p(-weakness)),
                iterations=ours.iterations,
                error_euler=abs(euler.omega_mean / ours.omega_mean - 1.0),
                error_stop=stop,
                error_start=start,
                error_mean=power,
            )
        )
    return found


def drift() -> tuple[list[float], float]:
    """Mean speed after cycles of Euler with a constant load torque, and of the cure [rad/s]."""
    means = [solved(0.0, 0.0, method="thesis", passes=n).omega_mean for n in DRIFT]
    return means, solved(0.0, 0.0).omega_mean
