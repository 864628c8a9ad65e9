"""Fit the modelled cycles of the catalogue engines that publish their power and no diagram.

Spark ignition: the charge is what the cylinder traps, with gasoline at the air's stoichiometric
share, so the heat follows from `intake_pressure`, which is fitted to the rated power; above
atmosphere it stands for a tuned intake. Lower loads are the same engine throttled until the brake
mean effective pressure is that share of the rated one. Two-stroke diesel: heat and compression
ratio are fitted to the mean effective pressure and the largest pressure; lower loads have that
compression ratio, and the heat for their share of the mean effective pressure. Compressor:
clearance and delivery pressure are fitted to the indicated mean effective and the largest pressure.
All else is given or assumed, as they say.

    python tools/calibrate_catalogue.py    # writes the fitted numbers into
    sweeps/catalogue/engines/*.toml
"""

from __future__ import annotations

import math
import re
import tomllib
from dataclasses import fields, replace
from typing import Any

import numpy as np
from scipy.optimize import brentq

from engine_dyn.geometry.slider_crank import velocity
from engine_dyn.loads.friction import friction_mean_effective_pressure, mean_piston_speed
from engine_dyn.pressure.compressor import FILE_UNITS, CompressorCycle
from engine_dyn.pressure.first_law import FourStrokeCycle, TwoStrokeCycle, tabulate
from engine_dyn.pressure.first_law_fields import FIELDS_OF_WALL
from engine_dyn.units import BAR, RPM
from sweeps.reading.engine_files import catalogue

RATED = {
    "boxer_twin_101x70": 62.5e3,
    "marine_80x345": 25190e3,
    "parallel_twin_180": 50e3,
    "parallel_twin_270": 50e3,
    "parallel_twin_360": 50e3,
    "si_four_87x101": 112e3,
    "v6_96x81": 186.4e3,
    "v8_cross_plane_93x86": 175.2e3,
    "v8_flat_plane_94x93": 392.2e3,
}
"""Brake power at the engine's own speed [W]."""

PEAK = {"marine_80x345": 171e5, "compressor_79x83": 132.0 * 6894.757}
"""Largest pressure [Pa]."""

TAKEN = {"compressor_79x83": 26.0 * 6894.757}
"""Indicated mean effective pressure that a driven machine takes [Pa]."""

HEAT_OF_CHARGE = 0.97 * 44.0e6 / (1.0 + 14.7)
"""Of a kilogram of gasoline and air, stoichiometric, 3 % unburnt [J/kg]."""

GAS_CONSTANT = 287.0

COLUMN = 40
"""Of the files, where comments begin."""


def cycle_of(table: dict[str, Any], values: dict[str, float]) -> Any:
    """Cycle of a [[diagram]], as `sweeps.reading.modelled_diagrams` makes it."""
    kind = FourStrokeCycle if table["kind"] == "first_law" else TwoStrokeCycle
    ratio = 0.5 * values["stroke"] / values["rod_length"]
    known = {**values, "crank_ratio": ratio, **table}
    wall = FIELDS_OF_WALL[table["wall"]]
    others = {name for names in FIELDS_OF_WALL.values() for name in names} - set(wall)
    names = [f.name for f in fields(kind) if f.name in known and f.name not in {*others, "wall"}]
    return kind(wall=table["wall"], **{n: known[n] * kind.units[n][1] for n in names})


def brake_mean_pressure(cycle: Any, values: dict[str, float]) -> float:
    """Brake mean effective pressure [Pa]."""
    angle, pressure = cycle.points()
    indicated = 0.5 * cycle.period * float((pressure * velocity(angle, cycle.crank_ratio)).mean())
    friction = friction_mean_effective_pressure(
        values["friction_constant"] * BAR, values["friction_peak_pressure"],
        values["friction_mean_piston_speed"] * BAR, pressure.max(),
        mean_piston_speed(values["stroke"], values["speed"] * RPM),
    )  # fmt: skip
    return indicated - float(friction)


def with_charge(cycle: FourStrokeCycle, intake: float) -> FourStrokeCycle:
    """Return the cycle with this intake pressure [Pa], and the heat of what it then traps."""
    empty = replace(cycle, intake_pressure=intake, heat=0.0)
    values = {f.name: getattr(empty, f.name) for f in fields(empty)}
    trapped = float(tabulate(FourStrokeCycle, values).trapped_pressure)
    mass = trapped * float(cycle.volume(cycle.intake_closing))
    mass /= GAS_CONSTANT * cycle.charge_temperature
    return replace(empty, heat=HEAT_OF_CHARGE * mass)


def spark_ignition(cycle: FourStrokeCycle, values: dict[str, float], goal: float) -> dict[str, str]:
    """Intake pressure and heat that make a mean effective pressure."""

    def miss(intake: float) -> float:
        return brake_mean_pressure(with_charge(cycle, intake), values) - goal

    found = with_charge(cycle, float(brentq(miss, 0.25e5, 1.6e5, xtol=1.0)))
    return {
        "intake_pressure": f"{found.intake_pressure / BAR:.5f}",
        "heat": f"{found.heat / BAR:.4f}",
    }


def heated(
    cycle: TwoStrokeCycle, values: dict[str, float], goal: float, ratio: float
) -> TwoStrokeCycle:
    """Return the cycle with a compression ratio and the heat that makes a mean pressure."""
    changed = replace(cycle, compression_ratio=ratio)

    def miss(heat: float) -> float:
        return brake_mean_pressure(replace(changed, heat=heat), values) - goal

    return replace(changed, heat=float(brentq(miss, 0.5 * goal, 4.0 * goal, xtol=10.0)))


def two_stroke(
    cycle: TwoStrokeCycle, values: dict[str, float], goal: float, peak: float
) -> dict[str, str]:
    """Heat and compression ratio that make a mean effective pressure and a largest pressure."""

    def too_high(ratio: float) -> float:
        return float(heated(cycle, values, goal, ratio).points()[1].max()) - peak

    return two_stroke_at_part_load(
        cycle, values, goal, float(brentq(too_high, 8.0, 30.0, xtol=1e-6))
    )


def two_stroke_at_part_load(
    cycle: TwoStrokeCycle, values: dict[str, float], goal: float, ratio: float
) -> dict[str, str]:
    """Heat that makes a mean effective pressure with a given compression ratio, and that ratio."""
    found = heated(cycle, values, goal, ratio)
    return {
        "compression_ratio": f"{found.compression_ratio:.4f}",
        "heat": f"{found.heat / BAR:.4f}",
    }


def compressor(cycle: CompressorCycle, goal: float, peak: float) -> dict[str, str]:
    """Clearance and delivery pressure that make a mean effective and a largest pressure."""

    def with_clearance(changed: CompressorCycle) -> CompressorCycle:
        def miss(clearance: float) -> float:
            made = replace(changed, clearance_ratio=clearance)
            angle, pressure = made.points()
            work = float((pressure * velocity(angle, made.crank_ratio)).mean())
            return -math.pi * work - goal

        return replace(changed, clearance_ratio=float(brentq(miss, 0.01, 0.08, xtol=1e-9)))

    def too_high(delivery: float) -> float:
        made = with_clearance(replace(cycle, delivery_pressure=delivery))
        return float(made.points()[1].max()) - peak

    found = with_clearance(
        replace(cycle, delivery_pressure=float(brentq(too_high, 0.85 * peak, peak, xtol=1.0)))
    )
    return {
        "clearance_ratio": f"{found.clearance_ratio:.5f}",
        "delivery_pressure": f"{found.delivery_pressure / BAR:.5f}",
    }


def compressor_of(table: dict[str, Any], values: dict[str, float]) -> CompressorCycle:
    """Cycle of a [[diagram]] of kind "compressor"."""
    ratio = 0.5 * values["stroke"] / values["rod_length"]
    known = {"crank_ratio": ratio, **table}
    return CompressorCycle(**{n: known[n] * size for n, (_, size) in FILE_UNITS.items()})


def main() -> None:
    """Write the fitted numbers into the files."""
    for name, goal in TAKEN.items():
        path = catalogue()[name]
        text = path.read_text(encoding="utf-8")
        engine = tomllib.loads(text)
        cycle = compressor_of(engine["diagram"][0], engine["values"])
        for key, number in compressor(cycle, goal, PEAK[name]).items():
            line = f"{key} = {number}".ljust(COLUMN)
            text = re.sub(rf"(?m)^{key} = [0-9.]+ *(?=#)", line, text)
            print(f"{name}: {key} = {number}")
        path.write_text(text, encoding="utf-8")
    for name, power in RATED.items():
        path = catalogue()[name]
        text = path.read_text(encoding="utf-8")
        engine = tomllib.loads(text)
        values, tables = engine["values"], engine["diagram"]
        head, *parts = text.split("[[diagram]]\n")
        volume = values["cylinders"] * 0.25 * math.pi * values["bore"] ** 2 * values["stroke"]
        ratio = math.nan  # of the rated point, which comes last in the file
        for i, table in reversed(list(enumerate(tables))):
            cycle = cycle_of(table, values)
            rated = power * cycle.period / (volume * values["speed"] * RPM)
            goal = rated * table["load"] / 100.0
            if not isinstance(cycle, TwoStrokeCycle):
                found = spark_ignition(cycle, values, goal)
            elif table["load"] == 100:
                found = two_stroke(cycle, values, goal, PEAK[name])
                ratio = float(found["compression_ratio"])
            else:
                found = two_stroke_at_part_load(cycle, values, goal, ratio)
            for key, number in found.items():
                line = f"{key} = {number}".ljust(COLUMN)
                parts[i] = re.sub(rf"(?m)^{key} = [0-9.]+ *(?=#)", line, parts[i])
                print(f"{name} {table['load']} percent: {key} = {number}")
        path.write_text("[[diagram]]\n".join([head, *parts]), encoding="utf-8")


if __name__ == "__main__":
    np.seterr(all="raise")
    main()
