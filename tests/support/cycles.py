"""Modelled cycles by the first law, of each kind and heat loss, and compressors integrated here."""

import itertools
from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

from engine_dyn.pressure.first_law import FourStrokeCycle, TwoStrokeCycle
from engine_dyn.pressure.first_law_formulas import FOUR_STROKE_UNITS, TWO_STROKE_UNITS

# A throttled spark-ignition engine, a turbocharged diesel, a slow uniflow two-stroke.
SPARK: dict[str, Any] = {
    "compression_ratio": 10.0, "crank_ratio": 0.28, "intake_pressure": 0.7,
    "exhaust_pressure": 1.05, "charge_temperature": 340.0, "heat": 14.0,
    "combustion_start": -18.0, "combustion_duration": 55.0, "combustion_form": 2.0,
    "valve_ramp": 40.0, "valve_lag": 8.0, "intake_loss": 0.06, "exhaust_loss": 0.05,
    "intake_closing": -125.0, "exhaust_opening": 130.0,
}  # fmt: skip
DIESEL: dict[str, Any] = {
    **SPARK, "compression_ratio": 17.0, "intake_pressure": 1.9, "exhaust_pressure": 1.7,
    "charge_temperature": 370.0, "heat": 25.0, "combustion_start": -4.0,
    "combustion_duration": 75.0, "combustion_form": 1.2, "premixed_share": 0.12,
    "premixed_start": -6.0, "premixed_duration": 9.0, "premixed_form": 2.0,
}  # fmt: skip
PORTS: dict[str, Any] = {
    "compression_ratio": 14.0, "crank_ratio": 0.45, "intake_pressure": 3.0,
    "exhaust_pressure": 2.6, "charge_temperature": 350.0, "heat": 24.0, "combustion_start": -2.0,
    "combustion_duration": 60.0, "combustion_form": 1.0, "valve_ramp": 20.0, "valve_lag": 5.0,
    "exhaust_opening": 110.0, "scavenge_opening": 135.0,
}  # fmt: skip
WALL: dict[str, dict[str, Any]] = {
    "adiabatic": {},
    "polytropic": {
        "wall": "polytropic", "compression_exponent": 1.34, "expansion_exponent": 1.28,
    },
    "woschni": {
        "wall": "woschni", "wall_temperature": 440.0, "bore": 0.1, "stroke": 0.12, "speed": 1800.0,
    },
}  # fmt: skip

CASES = {
    "spark, adiabatic": (FourStrokeCycle, SPARK, "adiabatic"),
    "spark, woschni": (FourStrokeCycle, SPARK, "woschni"),
    "diesel, polytropic": (FourStrokeCycle, DIESEL, "polytropic"),
    "diesel, woschni": (FourStrokeCycle, DIESEL, "woschni"),
    "motored, woschni": (FourStrokeCycle, {**DIESEL, "heat": 0.0}, "woschni"),
    "ports, woschni": (TwoStrokeCycle, PORTS, "woschni"),
    "uniflow, polytropic": (TwoStrokeCycle, {**PORTS, "exhaust_closing": -140.0}, "polytropic"),
    "diesel, woschni, offset": (FourStrokeCycle, {**DIESEL, "offset_ratio": 0.4}, "woschni"),
    "ports, polytropic, offset": (TwoStrokeCycle, {**PORTS, "offset_ratio": -0.3}, "polytropic"),
}


def built(kind: Any, values: dict[str, Any], **changes: Any) -> Any:
    """A cycle from values in file units."""
    units = FOUR_STROKE_UNITS if kind is FourStrokeCycle else TWO_STROKE_UNITS
    parts = {**values, **changes}
    return kind(**{n: v if n == "wall" else v * units[n][1] for n, v in parts.items()})


def case(name: str, **changes: Any) -> Any:
    kind, values, wall = CASES[name]
    return built(kind, {**values, **WALL[wall]}, **changes)


def smooth_step(u: float) -> float:
    t = min(max(u, 0.0), 1.0)
    return t**3 * (10.0 + t * (6.0 * t - 15.0))


def between_lines(
    model: Any, clearance: float, swept: Callable[[float], tuple[Any, Any]], start: float,
    marks: Any,
) -> tuple[Any, float]:  # fmt: skip
    """Pressure of a compressor's end at marks from 0 to 2 pi, and last, by a general integrator.

    `swept` gives the volume without the clearance and its slope, over the swept volume, at angles
    after the least volume; `start` is the pressure there.
    """
    ratio = model.delivery_pressure / model.suction_pressure
    ramp, lag = model.valve_ramp, model.valve_lag

    def opening(volume: float) -> float:
        """Angle of a volume by bisection, 0..pi."""
        low, high = 0.0, np.pi
        for _ in range(80):
            middle = 0.5 * (low + high)
            below = clearance + swept(middle)[0] < volume
            low, high = (middle, high) if below else (low, middle)
        return 0.5 * (low + high)

    suction = opening(clearance * ratio ** (1.0 / model.expansion_exponent))
    delivery = opening((1.0 + clearance) * ratio ** (-1.0 / model.compression_exponent))
    delivery = 2.0 * np.pi - delivery

    def right(phi: float, y: Any) -> Any:
        volume, rate = swept(phi)
        square = (2.0 * rate) ** 2
        inward = smooth_step((phi - suction) / ramp) * smooth_step((np.pi - phi) / ramp)
        outward = smooth_step((phi - delivery) / ramp) * smooth_step((2 * np.pi - phi) / ramp)
        closed = 0.5 * (suction + np.pi) < phi < 0.5 * (delivery + 2.0 * np.pi)
        n = model.compression_exponent if closed else model.expansion_exponent
        low = model.suction_pressure - model.suction_loss * square
        high = model.delivery_pressure + model.delivery_loss * square
        gas = -n * y[0] * rate / (clearance + volume) * (1.0 - inward - outward)
        return [gas + (inward * (low - y[0]) + outward * (high - y[0])) / lag]

    edges = [0.0, suction, suction + ramp, np.pi - ramp, np.pi, delivery, delivery + ramp,
             2.0 * np.pi - ramp, 2.0 * np.pi]  # fmt: skip
    y, found = np.array([start]), []
    for low, high in itertools.pairwise(edges):
        here = marks[(marks >= low) & (marks < high)]
        run = solve_ivp(
            right, (low, high), y, method="DOP853", rtol=3e-13, atol=1e-7,
            max_step=np.pi / 180.0, t_eval=np.append(here, high),
        )  # fmt: skip
        y = run.y[:, -1]
        found.append(run.y[0, :-1])
    return np.concatenate(found), float(y[0])
