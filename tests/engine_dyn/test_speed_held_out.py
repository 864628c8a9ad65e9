"""Held-out designs through `periodic_speed`, their pressure as points at half degrees.

Numbers to compare with are those of oracle (two independent methods that agree to 1e-9). The
limits asked for are 1e-5 in delta and the extremes, 1e-7 in the mean speed and 2e-6 in the mean
torque; what is asserted here is what the default tolerance of 1e-6 promises, and it leaves a
hundredfold margin: largest differences found (2026-11) are 3e-9 in delta, 2e-9 in the extremes,
4e-10 in the mean speed, 4e-11 in the mean torque.
"""

import math
from dataclasses import replace
from typing import Any

import pytest

from engine_dyn.speed.torque import torque_extremes
from engine_dyn.status import MEANINGS, has_numbers
from oracle import golden
from oracle.designs import SmoothPressure
from tests.support.held_out import design_of, family_of, items, solved, torque_inputs_of

pytestmark = [pytest.mark.compiled, pytest.mark.quick]

GOLDEN = golden.read()
CASES = [name for name, item in items().items() if not item.exact]
RUNNING = [name for name in CASES if GOLDEN[name]["status"] == "converged"]

LIMITS = {"delta": 1e-6, "omega_max": 1e-6, "omega_min": 1e-6, "omega_mean": 1e-8}


@pytest.mark.parametrize("name", CASES)
def test_held_out(name: str) -> None:
    found, known = solved(design_of(name)), GOLDEN[name]
    assert MEANINGS[found.status] == known["status"]
    # The spline through the points is all that separates the mean torques.
    assert found.torque_mean == pytest.approx(known["torque_mean"], rel=1e-8)
    if not has_numbers(found.status):
        for quantity in LIMITS:
            assert math.isnan(getattr(found, quantity))
        return
    for quantity, limit in LIMITS.items():
        assert getattr(found, quantity) == pytest.approx(known[quantity], rel=limit), quantity
    # The load is a difference of torques: its error is theirs.
    error = (
        abs(found.load_coefficient - known["k"])
        * design_of(name).omega_n ** design_of(name).load_exponent
    )
    assert error <= 1e-8 * (known["load_torque_nominal"] + known["torque_mean"])
    assert abs(found.delta / known["delta"] - 1.0) <= max(found.delta_error, 1e-8)


@pytest.mark.parametrize(
    "name", [n for n in RUNNING if n.startswith("alpha 0, constant") or "strong, alpha 0, " in n]
)
def test_energy_swing_is_that_of_the_flywheel_under_a_constant_load(name: str) -> None:
    """There the work of torque less mean torque all goes into the flywheel."""
    design, known = design_of(name), GOLDEN[name]
    inputs = torque_inputs_of(design, family_of(design))
    found = float(torque_extremes(wanted=["energy_swing"], **inputs)["energy_swing"])
    assert found == pytest.approx(known["energy_swing"], rel=1e-7)


@pytest.mark.parametrize("step", [1.0, 2.0])
def test_coarser_points_cost_what_a_cubic_spline_costs(step: float) -> None:
    """Fourth order in the step of the points: sixteen times the error for twice the step."""
    design = design_of("alpha 1, variable, 3 cyl, power_mean")
    exact = GOLDEN["alpha 1, variable, 3 cyl, power_mean"]["delta"]
    coarse = abs(solved(design, step).delta / exact - 1.0)
    half = abs(solved(design, 0.5 * step).delta / exact - 1.0)
    assert coarse < 1e-5 * step**4
    # Below 1e-9 the difference is the solver's own error, not the spline's.
    assert half < max(coarse / 8.0, 1e-9)


STRONG: dict[str, tuple[tuple[float, ...], dict[str, Any], float, float]] = {
    "cubic": (
        (1.0410084168057645, 0.9938128949152902, 13.356817836777815, 1.3190373217817688,
         28.780983483397492, 0.21009657455133127, 134, 9.365072256525085, 0.8414266210287239, 25),
        {"bore": 0.09684819872723134, "stroke": 0.1000051910897629,
         "crank_ratio": 0.28068734229148634, "reciprocating_mass": 1.420569341810248,
         "inertia": 0.0016245395550889743, "speed_rpm": 1798.217366232829, "cylinders": 12,
         "load_exponent": 4, "load_offset": 0.0, "friction_torque": 40.88979548343846,
         "crankcase_pressure": 103686.23934921266, "inertia_model": "constant"},
        0.395208317373375, 0.7994625456662973,
    ),
    "high": (
        (0.9769091465993976, 0.9572539334192026, 14.126264908607354, 1.3496842503387034,
         52.64452832812425, 0.24679067232328364, 190, 4.037260504393423, 0.9408985380706849, 29),
        {"bore": 0.08866345724610729, "stroke": 0.0848409564538059,
         "crank_ratio": 0.21258153575164818, "reciprocating_mass": 1.0486276971036173,
         "inertia": 0.020792203625106614, "speed_rpm": 1649.1583430309042, "cylinders": 5,
         "load_exponent": 12, "load_offset": -158.27915169176134,
         "friction_torque": 16.807096009408266, "crankcase_pressure": 99646.42797612134,
         "inertia_model": "variable"},
        0.2718796373068459, 0.860435217722,
    ),
}  # fmt: skip
"""Strong loads on very light flywheels, where Newton's method once diverged and called them
stalled: pressure, design, and delta and the smallest speed of oracle/solution.py."""


@pytest.mark.parametrize("name", STRONG)
def test_strong_loads_and_light_flywheels(name: str) -> None:
    pressure, values, delta, smallest = STRONG[name]
    design = replace(
        design_of(CASES[0]), pressure=SmoothPressure(*pressure), closure="cycle_time", **values
    )
    found = solved(design)
    assert MEANINGS[found.status] == "converged"
    assert found.delta == pytest.approx(delta, rel=1e-6)
    assert found.omega_min / design.omega_n == pytest.approx(smallest, rel=1e-6)
