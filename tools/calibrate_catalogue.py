"""Fit the modelled cycles of the catalogue engines that publish their power and no diagram.

Spark ignition: the heat follows from the charge, whose `intake_pressure` is fitted to the rated
power; lower loads are the same engine throttled. Two-stroke diesel: heat and compression ratio are
fitted to the mean effective pressure and the largest pressure; lower loads have that compression
ratio. Compressor: clearance and delivery pressure are fitted to the indicated mean effective and
the largest pressure. All else is given or assumed, as the engine files say. The fits are those of
`engine-dyn calibrate`.

Run it from the project's root: `python tools/calibrate_catalogue.py`. It writes the fitted numbers
into sweeps/catalogue/engines/*.toml.
"""

from __future__ import annotations

import math
import tomllib
from typing import Any

import numpy as np
from pages import with_numbers

from engine_dyn.pressure.first_law import FourStrokeCycle, TwoStrokeCycle
from engine_dyn.units import BAR, RPM
from sweeps.lab.speed import cycle_fits
from sweeps.scene.engine.engine_files import PERIODS, catalogue, read_values
from sweeps.scene.engine.modelled_diagrams import modelled_cycle

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
"""Brake power at each engine's own speed [W]."""

PEAK = {"marine_80x345": 171e5, "compressor_79x83": 132.0 * 6894.757}
"""Largest pressure of each engine's cycle [Pa]."""

TAKEN = {"compressor_79x83": 26.0 * 6894.757}
"""Indicated mean effective pressure that a driven machine takes [Pa]."""

HEAT_OF_CHARGE = 0.97 * 44.0e6 / (1.0 + 14.7)
"""Heat of a kilogram of gasoline and air, stoichiometric, 3 % unburnt [J/kg]."""


def cycle_of(table: dict[str, Any], values: dict[str, float]) -> Any:
    """Cycle of a [[diagram]], as the reader of engine files makes it."""
    rest = {key: item for key, item in table.items() if key not in ("load", "speeds", "kind")}
    own = read_values(values, "catalogue")
    two = table["kind"] in ("two_stroke", "compressor")
    period = PERIODS["two-stroke" if two else "four-stroke"]
    return modelled_cycle(table["kind"], rest, "catalogue", period, own)[0]


def fit(
    name: str, table: dict[str, Any], values: dict[str, float], ratio: float = math.nan
) -> dict[str, str]:
    """Fitted numbers of a [[diagram]] of an engine.

    `ratio` is the compression ratio of a two-stroke engine at part load, that of its rated point.
    """
    found: Any
    cycle = cycle_of(table, values)
    if name in TAKEN:
        found = cycle_fits.compressor_of_pressures(cycle, TAKEN[name], PEAK[name])
        return {
            "clearance_ratio": f"{found.clearance_ratio:.5f}",
            "delivery_pressure": f"{found.delivery_pressure / BAR:.5f}",
        }
    friction = cycle_fits.friction_of(values, cycle.period)
    volume = values["cylinders"] * 0.25 * math.pi * values["bore"] ** 2 * values["stroke"]
    rated = RATED[name] * cycle.period / (volume * values["speed"] * RPM)
    goal = rated * table["load"] / 100.0
    if isinstance(cycle, TwoStrokeCycle):
        if table["load"] == 100:
            found = cycle_fits.peak_of_two_stroke(cycle, friction, goal, PEAK[name])
        else:
            found = cycle_fits.heated(cycle, friction, goal, ratio)
        first = {"compression_ratio": f"{found.compression_ratio:.4f}"}
    else:

        def charged(intake: float) -> FourStrokeCycle:
            return cycle_fits.with_charge(cycle, intake, HEAT_OF_CHARGE)

        found = cycle_fits.solved(charged, friction, goal, 0.25e5, 1.6e5, 1.0)
        first = {"intake_pressure": f"{found.intake_pressure / BAR:.5f}"}
    return {**first, "heat": f"{found.heat / BAR:.4f}"}


def main() -> None:
    """Write the fitted numbers into the files."""
    for name in (*TAKEN, *RATED):
        path = catalogue()[name]
        text = path.read_text(encoding="utf-8")
        engine = tomllib.loads(text)
        head, *parts = text.split("[[diagram]]\n")
        if name in TAKEN:  # the clearance is one of the file's [values]
            head, parts = "", [text]
        ratio = math.nan
        for place in reversed(range(len(parts))):  # the rated point is the last one
            found = fit(name, engine["diagram"][place], engine["values"], ratio)
            ratio = float(found.get("compression_ratio", ratio))
            parts[place] = with_numbers(parts[place], found)
            print(f"{name}, diagram {place + 1}: {found}")
        text = "".join(parts) if name in TAKEN else "[[diagram]]\n".join([head, *parts])
        path.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    np.seterr(all="raise")
    main()
