"""Fit the modelled cycles of the catalogue engines that publish their power and no diagram.

Spark ignition: the charge is what the cylinder traps, with gasoline at the air's stoichiometric
share, so the heat follows from `intake_pressure`, which is fitted to the rated power; above
atmosphere it stands for a tuned intake. Lower loads are the same engine throttled until the brake
mean effective pressure is that share of the rated one. Two-stroke diesel: heat and compression
ratio are fitted to the mean effective pressure and the largest pressure; lower loads have that
compression ratio, and the heat for their share of the mean effective pressure. Compressor:
clearance and delivery pressure are fitted to the indicated mean effective and the largest pressure.
All else is given or assumed, as they say. The fits are those of `engine-dyn calibrate`.

    python tools/calibrate_catalogue.py    # writes the fitted numbers into
    sweeps/catalogue/engines/*.toml
"""

from __future__ import annotations

import math
import re
import tomllib
from typing import Any

import numpy as np

from engine_dyn.pressure.compressor import CompressorCycle
from engine_dyn.pressure.first_law import FourStrokeCycle, TwoStrokeCycle
from engine_dyn.units import BAR, RPM
from sweeps.measuring import cycle_fits
from sweeps.reading.engine_files import PERIODS, catalogue, read_values
from sweeps.reading.modelled_diagrams import modelled_cycle

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

COLUMN = 40
"""Of the files, where comments begin."""


def cycle_of(table: dict[str, Any], values: dict[str, float]) -> Any:
    """Cycle of a [[diagram]], as the reader of engine files makes it."""
    rest = {key: item for key, item in table.items() if key not in ("load", "kind")}
    own = read_values(values, "catalogue")
    two = table["kind"] in ("two_stroke", "compressor")
    period = PERIODS["two-stroke" if two else "four-stroke"]
    return modelled_cycle(table["kind"], rest, "catalogue", period, own)[0]


def spark_ignition(cycle: FourStrokeCycle, values: dict[str, float], goal: float) -> dict[str, str]:
    """Intake pressure and heat that make a mean effective pressure."""

    def charged(intake: float) -> FourStrokeCycle:
        return cycle_fits.with_charge(cycle, intake, HEAT_OF_CHARGE)

    friction = cycle_fits.friction_of(values, cycle.period)
    found = cycle_fits.solved(charged, friction, goal, 0.25e5, 1.6e5, 1.0)
    return {
        "intake_pressure": f"{found.intake_pressure / BAR:.5f}",
        "heat": f"{found.heat / BAR:.4f}",
    }


def two_stroke(
    cycle: TwoStrokeCycle, values: dict[str, float], goal: float, peak: float
) -> dict[str, str]:
    """Heat and compression ratio that make a mean effective pressure and a largest pressure."""
    friction = cycle_fits.friction_of(values, cycle.period)
    return _of_two_stroke(cycle_fits.peak_of_two_stroke(cycle, friction, goal, peak))


def two_stroke_at_part_load(
    cycle: TwoStrokeCycle, values: dict[str, float], goal: float, ratio: float
) -> dict[str, str]:
    """Heat that makes a mean effective pressure with a given compression ratio, and that ratio."""
    friction = cycle_fits.friction_of(values, cycle.period)
    return _of_two_stroke(cycle_fits.heated(cycle, friction, goal, ratio))


def _of_two_stroke(found: TwoStrokeCycle) -> dict[str, str]:
    return {
        "compression_ratio": f"{found.compression_ratio:.4f}",
        "heat": f"{found.heat / BAR:.4f}",
    }


def compressor(cycle: CompressorCycle, goal: float, peak: float) -> dict[str, str]:
    """Clearance and delivery pressure that make a mean effective and a largest pressure."""
    found = cycle_fits.compressor_of_pressures(cycle, goal, peak)
    return {
        "clearance_ratio": f"{found.clearance_ratio:.5f}",
        "delivery_pressure": f"{found.delivery_pressure / BAR:.5f}",
    }


def main() -> None:
    """Write the fitted numbers into the files."""
    for name, goal in TAKEN.items():
        path = catalogue()[name]
        text = path.read_text(encoding="utf-8")
        engine = tomllib.loads(text)
        cycle = cycle_of(engine["diagram"][0], engine["values"])
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
