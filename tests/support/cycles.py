"""Modelled cycles by the first law, of each kind and heat loss."""

from typing import Any

from engine_dyn.pressure.first_law import FourStrokeCycle, TwoStrokeCycle
from engine_dyn.pressure.first_law_fields import FOUR_STROKE_UNITS, TWO_STROKE_UNITS

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
