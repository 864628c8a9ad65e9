"""Modelled cycles beside what textbooks give with all inputs: closed forms and one integral.

Numbers for docs/validation.md; the same comparisons, with limits, are in
tests/engine_dyn/test_first_law.py.
"""

from __future__ import annotations

import math
from dataclasses import fields, replace
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from scipy.integrate import solve_ivp

from engine_dyn.geometry.slider_crank import velocity
from engine_dyn.pressure.first_law import FourStrokeCycle, tabulate
from engine_dyn.units import DEGREE
from sweeps.reading.engine_files import load_engine

GAMMA = 1.4
TEMPERATURE = 300.0
LONGEST_ROD = 1e-4
"""Crank ratio of a rod so long that the piston's way is a cosine, within 3e-5 of the stroke."""


class Textbook(NamedTuple):
    """Largest pressure and mean effective pressure over that at the start, and efficiency [1]."""

    largest: float
    mean: float
    efficiency: float


def ideal(ratio: float, heat: float, start: float, duration: float, form: float) -> Textbook:
    """Our cycle: closed from dead centre to dead centre, constant gamma, no loss.

    Parameters
    ----------
    ratio : float
        Compression ratio.
    heat : float
        Heat over pressure and volume at the start of the compression [1].
    start, duration : float
        Of the combustion [degree].
    form : float
        Wiebe's exponent less 1; its factor is 5.
    """
    model = FourStrokeCycle(
        compression_ratio=ratio, crank_ratio=LONGEST_ROD, intake_pressure=1e5,
        exhaust_pressure=1e5, charge_temperature=TEMPERATURE, heat=0.0,
        combustion_start=start * DEGREE, combustion_duration=duration * DEGREE,
        combustion_form=form, wiebe_factor=5.0, gamma_300=GAMMA, gamma_slope=0.0,
        valve_ramp=20.0 * DEGREE, valve_lag=2.0 * DEGREE, intake_loss=0.0, exhaust_loss=0.0,
        intake_closing=-179.999 * DEGREE, exhaust_opening=179.999 * DEGREE,
    )  # fmt: skip
    first = float(_table(model).trapped_pressure)
    found = _table(replace(model, heat=heat * first * ratio / (ratio - 1.0)))
    trapped = float(found.trapped_pressure)
    return Textbook(
        float(found.pressure.max()) / trapped,
        float(found.work) / trapped,
        float(found.work) / float(found.heat),
    )


def _table(model: FourStrokeCycle) -> Any:
    return tabulate(FourStrokeCycle, {f.name: getattr(model, f.name) for f in fields(model)}, 0.25)


def otto(ratio: float, heat: float) -> Textbook:
    """Air-standard cycle of constant volume, in closed form (Heywood, section 5.4.1)."""
    efficiency = 1.0 - ratio ** (1.0 - GAMMA)
    largest = ratio**GAMMA + (GAMMA - 1.0) * heat * ratio
    return Textbook(largest, efficiency * heat * ratio / (ratio - 1.0), efficiency)


def finite_release(
    ratio: float, heat: float, start: float, duration: float, form: float
) -> Textbook:
    """Finite heat release (Ferguson and Kirkpatrick, Internal Combustion Engines, ch. 2).

    dp/dtheta = (-gamma p dV/dtheta + (gamma - 1) Q dx/dtheta)/V with V = 1 + (r - 1)/2 (1 - cos),
    over its value at bottom dead centre, and Wiebe's x with factor 5 and exponent form + 1.
    """
    begin, size, power = start * DEGREE, duration * DEGREE, form + 1.0

    def rates(theta: float, y: Any) -> list[float]:
        volume = (1.0 + 0.5 * (ratio - 1.0) * (1.0 - math.cos(theta))) / ratio
        growth = 0.5 * (ratio - 1.0) * math.sin(theta) / ratio
        time = max(theta - begin, 0.0) / size
        burning = 5.0 * power * time ** (power - 1.0) * math.exp(-5.0 * time**power) / size
        rate = (-GAMMA * y[0] * growth + (GAMMA - 1.0) * heat * burning) / volume
        return [rate, y[0] * growth]

    pressure, work, largest = 1.0, 0.0, 1.0
    marks = [-math.pi, begin, begin + 0.25 * size, begin + size, math.pi]
    for low, high in pairwise(marks):
        places = np.linspace(low, high, 20001)
        run = solve_ivp(
            rates, (low, high), [pressure, work], method="DOP853", rtol=1e-12, atol=1e-12,
            t_eval=places,
        )  # fmt: skip
        pressure, work = float(run.y[0, -1]), float(run.y[1, -1])
        largest = max(largest, float(run.y[0].max()))
    return Textbook(largest, work * ratio / (ratio - 1.0), work / heat)


HEAT_OF_OTTO = (2000.0 / 300.0 - 8.0 ** (GAMMA - 1.0)) / (GAMMA - 1.0)
"""Heats from 300 K and a ratio of 8 up to 2000 K: Moran and Shapiro's engine of 540 and 3600 R."""


def rows() -> list[list[str]]:
    """Rows of the table: what, largest pressure, mean pressure, efficiency, each beside ours."""
    found = []
    exact = otto(8.0, HEAT_OF_OTTO)
    for duration in (16.0, 8.0, 4.0):
        ours = ideal(8.0, HEAT_OF_OTTO, -0.5 * duration, duration, 2.0)
        found.append(_row(f"constant volume; ours burns over {duration:g}°", exact, ours))
    for start in (-20.0, 0.0):
        case = (10.0, 20.0, start, 40.0, 2.0)
        found.append(_row(f"finite release from {start:g}°", finite_release(*case), ideal(*case)))
    return found


def _row(what: str, given: Textbook, ours: Textbook) -> list[str]:
    pairs = zip(given, ours, strict=True)
    return [what, *(f"{value:.5g}" for pair in pairs for value in pair)]


def measured_remark() -> str:
    """Say what the measured diagram of the catalogue leaves open."""
    engine = load_engine("diesel_105x137")
    diagram = engine.family.diagrams[-1]
    angle = np.arange(7200) * (diagram.period / 7200) - 0.5 * diagram.period
    speed = velocity(angle, engine.values["crank_ratio"])
    mean = 0.5 * diagram.period * float((diagram(angle) * speed).mean())
    return (
        f"The measured diagram of `diesel_105x137` has a largest pressure of "
        f"{diagram.peak / 1e5:.4g} bar and an indicated mean pressure of {mean / 1e5:.4g} bar, but "
        "its sources give no compression ratio, boost, fuel or timing. The thesis prints neither "
        "these nor its diagrams. So nothing can be predicted for either engine."
    )
