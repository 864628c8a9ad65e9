"""Modelled compressors, single and double acting: an independent integration of each end, ideal
cycles, the force of both ends, the reversal of rod loads, and what is refused."""

import dataclasses
from typing import Any

import numpy as np
import pytest

from engine_dyn import status
from engine_dyn.forces.mechanism import rod_load_extremes
from engine_dyn.geometry.arrangement import TWO_STROKE
from engine_dyn.geometry.cylinders import even_cylinders
from engine_dyn.pressure import compressor, double_acting
from engine_dyn.pressure.compressor import CompressorCycle, tabulate
from engine_dyn.pressure.diagram import Diagram
from engine_dyn.pressure.double_acting import DoubleActingCycle
from engine_dyn.pressure.family import family_from_diagrams
from engine_dyn.units import BAR, DEGREE
from oracle import solution
from tests.support.cycles import between_lines

VALVES: dict[str, float] = {
    "compression_exponent": 1.32, "expansion_exponent": 1.22, "valve_ramp": 14.0, "valve_lag": 3.0,
}  # fmt: skip
SINGLE = VALVES | {
    "clearance_ratio": 0.06, "crank_ratio": 0.2, "suction_pressure": 1.0,
    "delivery_pressure": 8.0, "suction_loss": 0.08, "delivery_loss": 0.5,
}  # fmt: skip
DOUBLE = VALVES | {
    "clearance_ratio": 0.12, "crank_end_clearance_ratio": 0.15, "piston_rod_diameter": 0.09,
    "crank_ratio": 0.25, "suction_pressure": 5.0, "delivery_pressure": 15.0, "suction_loss": 0.1,
    "delivery_loss": 0.2,
}  # fmt: skip
BORE, OUTSIDE = 0.3, 1.01325 * BAR
MARKS = np.arange(360) * DEGREE


def cycle(**changes: float) -> CompressorCycle:
    """A compressor from values in file units."""
    values = SINGLE | changes
    return CompressorCycle(**{k: v * compressor.FILE_FIELDS[k].size for k, v in values.items()})


def double(**changes: float) -> DoubleActingCycle:
    values = DOUBLE | changes
    return DoubleActingCycle(
        **{k: v * double_acting.FILE_FIELDS[k].size for k, v in values.items()},
        bore=BORE, crankcase_pressure=OUTSIDE,
    )  # fmt: skip


def swept(phi: Any, ratio: float) -> tuple[Any, Any]:
    """Travel of the piston from top dead centre over the stroke, and its slope."""
    return 0.5 * solution.position(phi, ratio), 0.5 * solution.velocity(phi, ratio)


@pytest.mark.parametrize(
    "changes",
    [{}, {"delivery_pressure": 3.0, "valve_ramp": 25.0}, {"suction_pressure": 8.0,
     "delivery_pressure": 30.0, "clearance_ratio": 0.15, "valve_lag": 1.0}],
)  # fmt: skip
def test_against_a_general_integrator(changes: dict[str, float]) -> None:
    model = cycle(**changes)
    angle, pressure = model.points(1.0)
    place = np.argmin(np.abs(angle))
    start = float(pressure[place])
    expected, last = between_lines(
        model, model.clearance_ratio, lambda phi: swept(phi, model.crank_ratio), start, MARKS
    )
    np.testing.assert_allclose(
        np.roll(pressure, -place), expected, rtol=0.0, atol=1e-9 * pressure.max()
    )
    assert last == pytest.approx(start, rel=1e-9)


@pytest.mark.parametrize("changes", [{}, {"crank_ratio": 0.4, "valve_lag": 1.0}])
def test_the_crank_end_against_a_general_integrator(changes: dict[str, float]) -> None:
    model = double(**changes)

    def other_end(psi: float) -> tuple[Any, Any]:
        """At angles after bottom dead centre."""
        volume, slope = swept(psi + np.pi, model.crank_ratio)
        return 1.0 - volume, -slope

    pressure = model.delivery_pressure
    for _ in range(2):  # the line's pressure makes it forget its start
        expected, pressure = between_lines(
            model, model.crank_end_clearance_ratio, other_end, pressure, MARKS
        )
    found = model.diagram(1.0).crank_end(MARKS + np.pi)
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-9 * expected.max())


SHARE = (DOUBLE["piston_rod_diameter"] / BORE) ** 2
SHARP = {
    "suction_loss": 0.0, "delivery_loss": 0.0, "compression_exponent": 1.3,
    "expansion_exponent": 1.3, "valve_ramp": 1.5, "valve_lag": 0.3,
}  # fmt: skip


@pytest.mark.parametrize(
    ("make", "low", "high", "ends"),
    [
        *((cycle, 1.0, high, [(0.06, 1.0)]) for high in (2.0, 5.0, 8.0)),
        *((double, low, high, [(0.12, 1.0), (0.15, 1.0 - SHARE)])
          for low, high in ((1.0, 5.0), (5.0, 15.0))),
    ],
)  # fmt: skip
def test_the_limit_is_the_ideal_cycle_of_each_end(
    make: Any, low: float, high: float, ends: list[tuple[float, float]]
) -> None:
    """W = n/(n - 1) p_s V_in (r^((n-1)/n) - 1), V_in the volumetric efficiency times V_h."""
    n, ratio = 1.3, high / low
    model = make(suction_pressure=low, delivery_pressure=high, **SHARP)
    size = n / (n - 1.0) * low * BAR * (ratio ** ((n - 1.0) / n) - 1.0)
    ideal = size * sum(area * (1.0 - c * (ratio ** (1.0 / n) - 1.0)) for c, area in ends)
    phi = (np.arange(72000) + 0.5) * (2.0 * np.pi / 72000)
    work = (model.diagram()(phi) * swept(phi, model.crank_ratio)[1]).mean() * 2.0 * np.pi
    assert -work == pytest.approx(ideal, rel=1e-2)


def test_a_batch_is_its_cycles_and_leaves_out_the_impossible() -> None:
    delivery = np.array([4.0, 8.0, 0.5, 60.0]) * BAR
    found = tabulate({**dataclasses.asdict(cycle()), "delivery_pressure": delivery}, 1.0)
    assert found.status.tolist() == [
        status.CONVERGED, status.CONVERGED, status.INVALID_INPUT, status.INVALID_INPUT
    ]  # fmt: skip
    for i in range(2):
        one = cycle(delivery_pressure=delivery[i] / BAR)
        np.testing.assert_array_equal(found.pressure[i], one.points(1.0)[1])
    assert np.isnan(found.pressure[2:]).all()


@pytest.mark.parametrize(
    ("make", "changes", "words"),
    [
        *((cycle, *case) for case in [
        ({"clearance_ratio": 0.0}, "clearance_ratio = 0: must be above 0 and below 0.5"),
        ({"delivery_pressure": 0.9}, "delivery_pressure = 0.9 bar: must be above suction_pressure"),
        ({"delivery_pressure": 60.0}, "delivery_pressure = 60 bar: must be lower: gas re-expand"),
        ({"delivery_pressure": 30.0, "clearance_ratio": 0.001, "compression_exponent": 1.0,
          "valve_ramp": 40.0}, "delivery_pressure = 30 bar: must be lower: it is reached too late"),
        ({"suction_loss": 0.8}, "suction_loss = 0.8 bar: must be at most half"),
        ({"valve_ramp": 1.0}, "valve_ramp = 1 degree: must be above 1 and below 45 d"),
        ({"valve_lag": float("nan")}, "valve_lag = nan: must be a finite number"),
        ]),
        *((double, *case) for case in [
        ({"piston_rod_diameter": 0.3}, "piston_rod_diameter = 0.3 m: must be below the bore, 0.3"),
        ({"piston_rod_diameter": 0.0}, "piston_rod_diameter = 0: must be a finite number above 0"),
        ({"crank_end_clearance_ratio": 0.5}, "crank_end_clearance_ratio = 0.5: must be below 0.5"),
        ({"crank_end_clearance_ratio": np.nan}, "crank_end_clearance_ratio = nan: must be a"),
        ({"crank_end_clearance_ratio": 0.45, "delivery_pressure": 23.0},
         "re-expanding from the clearance volume leaves no suction, at the crank end"),
        ({"delivery_pressure": 4.0}, "delivery_pressure = 4 bar: must be above suction_pressure"),
        ]),
    ],
)  # fmt: skip
def test_bad_parameters(make: Any, changes: dict[str, float], words: str) -> None:
    with pytest.raises(ValueError) as caught:
        make(**changes)
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)


def test_the_ends_are_not_each_other_half_a_turn_later() -> None:
    model = double(crank_end_clearance_ratio=DOUBLE["clearance_ratio"])
    diagram = model.diagram()
    phi = np.arange(720) * 0.5 * DEGREE
    apart = np.abs(diagram.crank_end(phi + np.pi) - diagram.head_end(phi))
    assert apart.max() > 0.2 * diagram.largest
    long_rod = double(
        crank_ratio=1e-4, crank_end_clearance_ratio=DOUBLE["clearance_ratio"]
    ).diagram()  # the limit without the rod's obliquity
    np.testing.assert_allclose(
        long_rod.crank_end(phi + np.pi), long_rod.head_end(phi), atol=1e-3 * long_rod.largest
    )


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
