"""Double-acting compressor cylinders: an independent integration of the crank end, ideal cycles,
the force of both ends, the reversal of rod loads, and what is refused."""

import dataclasses
from typing import Any

import numpy as np
import pytest

from engine_dyn.forces.rod_loads import rod_load_extremes
from engine_dyn.geometry.arrangement import TWO_STROKE
from engine_dyn.geometry.cylinders import even_cylinders
from engine_dyn.pressure.diagram import Diagram
from engine_dyn.pressure.double_acting import FILE_UNITS, DoubleActingCycle, ends_of
from engine_dyn.pressure.family import family_from_diagrams
from engine_dyn.pressure.motored import motored
from engine_dyn.units import BAR, DEGREE
from tests.support.cycles import between_lines

USUAL: dict[str, float] = {
    "clearance_ratio": 0.12, "crank_end_clearance_ratio": 0.15, "piston_rod_diameter": 0.09,
    "crank_ratio": 0.25, "suction_pressure": 5.0, "delivery_pressure": 15.0, "suction_loss": 0.1,
    "delivery_loss": 0.2, "compression_exponent": 1.32, "expansion_exponent": 1.22,
    "valve_ramp": 14.0, "valve_lag": 3.0,
}  # fmt: skip
BORE, OUTSIDE = 0.3, 1.01325 * BAR


def cycle(**changes: float) -> DoubleActingCycle:
    """A compressor from values in file units."""
    values = {**USUAL, **changes}
    return DoubleActingCycle(
        **{name: value * FILE_UNITS[name][1] for name, value in values.items()},
        bore=BORE, crankcase_pressure=OUTSIDE,
    )  # fmt: skip


def travel(phi: Any, ratio: float) -> Any:
    """Travel of the piston from top dead centre over the crank radius, written out."""
    return 1.0 - np.cos(phi) + (1.0 - np.sqrt(1.0 - (ratio * np.sin(phi)) ** 2)) / ratio


@pytest.mark.parametrize("changes", [{}, {"crank_ratio": 0.4, "valve_lag": 1.0}])
def test_the_crank_end_against_a_general_integrator(changes: dict[str, float]) -> None:
    model = cycle(**changes)
    ratio = model.crank_ratio

    def swept(psi: float) -> tuple[Any, Any]:
        """At angles after bottom dead centre; away from the crank."""
        phi = psi + np.pi
        root = np.sqrt(1.0 - (ratio * np.sin(phi)) ** 2)
        speed = -np.sin(phi) * (1.0 + ratio * np.cos(phi) / root)
        return 0.5 * (2.0 - travel(phi, ratio)), 0.5 * speed

    marks, pressure = np.arange(360) * DEGREE, model.delivery_pressure
    for _ in range(2):  # the line's pressure makes it forget its start
        expected, pressure = between_lines(
            model, model.crank_end_clearance_ratio, swept, pressure, marks
        )
    np.testing.assert_allclose(
        model.diagram(1.0).crank_end(marks + np.pi), expected, rtol=0.0,
        atol=1e-9 * expected.max(),
    )  # fmt: skip


def test_the_ends_are_not_each_other_half_a_turn_later() -> None:
    model = cycle(crank_end_clearance_ratio=USUAL["clearance_ratio"])
    diagram = model.diagram()
    phi = np.arange(720) * 0.5 * DEGREE
    apart = np.abs(diagram.crank_end(phi + np.pi) - diagram.head_end(phi))
    assert apart.max() > 0.2 * diagram.largest
    long_rod = cycle(
        crank_ratio=1e-4, crank_end_clearance_ratio=USUAL["clearance_ratio"]
    ).diagram()  # the limit without the rod's obliquity
    np.testing.assert_allclose(
        long_rod.crank_end(phi + np.pi), long_rod.head_end(phi), atol=1e-3 * long_rod.largest
    )


def test_the_force_is_that_of_both_ends() -> None:
    diagram = cycle().diagram()
    area, rod = 0.25 * np.pi * BORE**2, 0.25 * np.pi * USUAL["piston_rod_diameter"] ** 2
    phi = np.linspace(-7.0, 7.0, 1001)
    force = diagram.head_end(phi) * area - diagram.crank_end(phi) * (area - rod) - OUTSIDE * rod
    np.testing.assert_allclose(
        (diagram(phi) - OUTSIDE) * area, force, rtol=0.0, atol=1e-12 * np.abs(force).max()
    )


@pytest.mark.parametrize("pressures", [(1.0, 5.0), (5.0, 15.0)])
def test_the_limit_is_the_ideal_cycle_of_both_ends(pressures: tuple[float, float]) -> None:
    """W = n/(n - 1) p_s V_in (r^((n-1)/n) - 1) of each end, V_in its volumetric efficiency."""
    n, ratio = 1.3, pressures[1] / pressures[0]
    model = cycle(
        suction_pressure=pressures[0], delivery_pressure=pressures[1], suction_loss=0.0,
        delivery_loss=0.0, compression_exponent=n, expansion_exponent=n, valve_ramp=1.5,
        valve_lag=0.3,
    )  # fmt: skip
    phi = np.arange(72000) * (2.0 * np.pi / 72000)
    step = np.diff(travel(phi, model.crank_ratio), append=0.0)
    share = (USUAL["piston_rod_diameter"] / BORE) ** 2
    ideal = 0.0
    for clearance, area in ((0.12, 1.0), (0.15, 1.0 - share)):
        efficiency = 1.0 - clearance * (ratio ** (1.0 / n) - 1.0)
        size = n / (n - 1.0) * pressures[0] * BAR * (ratio ** ((n - 1.0) / n) - 1.0)
        ideal += area * efficiency * size
    found = -float((model.diagram()(phi + 0.5 * (phi[1] - phi[0])) * 0.5 * step).sum())
    assert found == pytest.approx(ideal, rel=1e-2)


def extremes(force: Any, **more: Any) -> Any:
    """Extremes of the rod loads of a piston without mass on which a force acts [N]."""
    angle = np.asarray(np.arange(-360, 360) * 0.5 * DEGREE, dtype=np.float64)
    slope = (force(angle + 1e-5) - force(angle - 1e-5)) / 2e-5
    area = 0.25 * np.pi * 0.1**2
    family = family_from_diagrams(
        [100.0], [Diagram(angle, force(angle) / area, slope / area, TWO_STROKE)]
    )
    numbers = {
        "crank_ratio": 0.2, "double_radius": 0.2, "offset_ratio": 0.0, "bore": 0.1, "row": 0.0,
        "pressure_scale": 1.0, "crankcase_pressure": 0.0, "piston_mass": 0.0, "speed": 100.0,
        "cylinder_set": 1, **more,
    }  # fmt: skip
    return rod_load_extremes(numbers, family, {1: even_cylinders(1, TWO_STROKE)}, TWO_STROKE)


@pytest.mark.parametrize(
    ("force", "reversal", "ratio"),
    [
        (lambda x: 1e3 * np.cos(x), 180.0, 1.0),
        # cos x > 0.9 for twice its arc cosine
        (lambda x: 1e3 * (np.cos(x) - 0.9), 2.0 * np.degrees(np.arccos(0.9)), 0.1 / 1.9),
        (lambda x: -1e3 * (np.cos(x - 1.0) - 0.9), 2.0 * np.degrees(np.arccos(0.9)), 0.1 / 1.9),
        # Three stretches of 60 degrees do not add up.
        (lambda x: 1e3 * np.cos(3.0 * x), 60.0, 1.0),
        (lambda x: 1e3 * (np.cos(x) + 1.5), 0.0, 0.0),
        (lambda x: -1e3 * (np.cos(x) + 1.5), 0.0, 0.0),
    ],
)
def test_the_reversal_of_loads_in_closed_form(force: Any, reversal: float, ratio: float) -> None:
    found = extremes(force)
    # Straight lines over h = 0.5 degree miss each zero by h^2/8 of f''/f', here 1.1e-3 degree.
    assert np.degrees(found["reversal"]) == pytest.approx(reversal, abs=3e-3)
    assert found["ratio"] == pytest.approx(ratio, abs=1e-5)
    phi = np.arange(36000) * 0.01 * DEGREE
    assert found["compression"] == pytest.approx(max(force(phi).max(), 0.0), abs=1e-2)
    assert found["tension"] == pytest.approx(max(-force(phi).min(), 0.0), abs=1e-2)
    assert found["gas_tension"] == found["tension"]


def test_designs_of_any_shape_and_one_that_failed() -> None:
    speed = np.array([[50.0, 100.0, np.nan], [10.0, 20.0, 30.0]])
    found = extremes(lambda x: 1e3 * np.cos(x), piston_mass=5.0, speed=speed)
    assert found.shape == (2, 3)
    for place in np.ndindex(2, 3):
        one = extremes(lambda x: 1e3 * np.cos(x), piston_mass=5.0, speed=speed[place])
        for name in found.dtype.names:
            np.testing.assert_array_equal(found[place][name], one[name])
    assert np.isnan(found["reversal"][0, 2]) and np.isnan(found["compression"][0, 2])
    # 5 kg on 0.1 m at 100 rad/s pull 5 kN (1 + 0.2) at top dead centre, against 1 kN.
    assert found["tension"][0, 1] == pytest.approx(5e3 * 1.2 - 1e3, rel=1e-12)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"piston_rod_diameter": 0.3}, "piston_rod_diameter = 0.3 m: must be below the bore, 0.3"),
        ({"piston_rod_diameter": 0.0}, "piston_rod_diameter = 0: must be a finite number above 0"),
        ({"crank_end_clearance_ratio": 0.5}, "crank_end_clearance_ratio = 0.5: must be below 0.5"),
        ({"crank_end_clearance_ratio": np.nan}, "crank_end_clearance_ratio = nan: must be a"),
        ({"crank_end_clearance_ratio": 0.45, "delivery_pressure": 23.0},
         "re-expanding from the clearance volume leaves no suction, at the crank end"),
        ({"delivery_pressure": 4.0}, "delivery_pressure = 4 bar: must be above suction_pressure"),
    ],
)  # fmt: skip
def test_refused(changes: dict[str, float], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        cycle(**changes)


def test_a_step_that_halves_no_turn_is_refused() -> None:
    with pytest.raises(ValueError, match="step = 8 degree: 180 must be a multiple of it"):
        cycle().diagram(8.0)
    with pytest.raises(ValueError, match="crankcase_pressure: must be a finite number"):
        dataclasses.replace(cycle(), crankcase_pressure=-1.0)


def test_a_cylinder_always_compresses() -> None:
    diagram = cycle().diagram()
    assert ends_of(family_from_diagrams([100.0], [diagram])) is diagram
    with pytest.raises(ValueError, match="a double-acting cylinder has no diagram without"):
        motored(diagram)
