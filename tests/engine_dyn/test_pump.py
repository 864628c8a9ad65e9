"""The modelled pump: its work against volumes, its slopes, its dead centres, what is refused."""

import itertools
import math
from typing import Any

import numpy as np
import pytest
from scipy.integrate import quad

from engine_dyn.geometry.slider_crank import dead_centres, velocity
from engine_dyn.pressure.compressor import PUMP_FIELDS, PumpCycle
from oracle.solution import position

DEGREE = math.pi / 180.0
BAR = 1e5

USUAL = {
    "crank_ratio": 0.2, "suction_pressure": 2.0, "delivery_pressure": 30.0, "valve_ramp": 8.0,
    "suction_loss": 0.4, "delivery_loss": 1.2, "offset_ratio": 0.25,
}  # fmt: skip


def cycle(**changes: float) -> PumpCycle:
    """A pump from values in file units."""
    values = {**USUAL, **changes}
    return PumpCycle(**{name: value * PUMP_FIELDS[name].size for name, value in values.items()})


def indicated(model: PumpCycle) -> float:
    """Work of a turn over crank radius and area, of the curve: integral of p dx [Pa]."""
    bottom = float(dead_centres(model.crank_ratio, model.offset_ratio).bottom)
    marks = [0.0, model.valve_ramp, bottom, bottom + model.valve_ramp, 2.0 * math.pi]

    def rate(phi: float) -> float:
        pressure, _ = model.pressure_and_slope(phi)
        return float(pressure * velocity(phi, model.crank_ratio, model.offset_ratio))

    parts = itertools.pairwise(marks)
    return sum(quad(rate, low, high, epsabs=1e-3, epsrel=1e-13)[0] for low, high in parts)


@pytest.mark.parametrize("offset", [0.0, 0.25, -0.6])
@pytest.mark.parametrize("ramp", [3.5, 8.0, 40.0])
def test_work_of_a_turn_without_losses(offset: float, ramp: float) -> None:
    """The difference of the levels times the stroke, less what the piston moves in the changes.

    After a dead centre the piston has gone x(ramp) of its way at most on the wrong level: the work
    lies between the ideal one and one that is short by those two pieces.
    """
    model = cycle(offset_ratio=offset, valve_ramp=ramp, suction_loss=0.0, delivery_loss=0.0)
    bottom = float(dead_centres(0.2, offset).bottom)
    stroke = position(bottom, 0.2, offset)
    ideal = -28.0 * BAR * stroke
    lost = (
        position(ramp * DEGREE, 0.2, offset)
        + stroke
        - position(bottom + ramp * DEGREE, 0.2, offset)
    )
    work = indicated(model)
    assert ideal < work < ideal + 28.0 * BAR * lost

    # By parts, with the step's own slope: the piston's way is weighted with how the level changes.
    def late(start: float) -> float:
        def weighted(t: float) -> float:
            way = abs(
                position(start + t * ramp * DEGREE, 0.2, offset) - position(start, 0.2, offset)
            )
            return 30.0 * (t * (1.0 - t)) ** 2 * way

        return quad(weighted, 0.0, 1.0, epsrel=1e-13)[0]

    assert work == pytest.approx(ideal + 28.0 * BAR * (late(0.0) + late(bottom)), rel=1e-10)


def test_losses_in_the_valves_are_taken_from_outside() -> None:
    """c v^2 over each stroke, less and more in the changes: beyond the levels' own work."""
    without = indicated(cycle(suction_loss=0.0, delivery_loss=0.0))
    model = cycle()
    bottom = float(dead_centres(0.2, 0.25).bottom)
    suction, _ = quad(lambda a: 0.4 * BAR * velocity(a, 0.2, 0.25) ** 3, 0.0, bottom)
    delivery, _ = quad(lambda a: 1.2 * BAR * velocity(a, 0.2, 0.25) ** 3, bottom, 2.0 * np.pi)
    more = without - indicated(model)
    assert more == pytest.approx(suction - delivery, rel=2e-3)
    assert more > 0.0


def test_the_diagram_is_the_curve() -> None:
    model = cycle()
    diagram = model.diagram()
    phi = np.linspace(-np.pi, np.pi, 20001)
    exact, slope = model.pressure_and_slope(phi)
    # Hermite's error: h^4/384 of the step's fourth derivative, 360 at most, and h^3/192 of the jump
    # of its third, 60, where the bottom dead centre is no knot.
    part = 0.5 / 8.0
    bound = 29.6 * BAR * (360.0 / 384.0 * part**4 + 60.0 / 192.0 * part**3)
    assert np.abs(diagram(phi) - exact).max() < bound
    h = 1e-5
    centred = model.pressure_and_slope(phi + h)[0] - model.pressure_and_slope(phi - h)[0]
    np.testing.assert_allclose(slope, centred / (2.0 * h), rtol=0.0, atol=1e-6 * slope.max())
    with pytest.raises(ValueError, match="step = 7 degree: 360 must be a multiple"):
        model.diagram(7.0)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"delivery_pressure": 2.0}, "delivery_pressure = 2 bar: must be above suction_pressure"),
        ({"suction_loss": 1.1}, "suction_loss = 1.1 bar: must be at most half of suction_press"),
        ({"valve_ramp": 1.0}, "valve_ramp = 1 degree: must be above 3 and below 90 degree"),
        ({"crank_ratio": 1.0}, "crank_ratio = 1: must be above 0 and below 1"),
        ({"suction_pressure": np.nan}, "suction_pressure = nan: must be a finite number"),
        ({"offset_ratio": 6.0}, "offset"),
    ],
)
def test_what_is_refused(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message) as caught:
        cycle(**changes)
    assert "\n" not in str(caught.value)
