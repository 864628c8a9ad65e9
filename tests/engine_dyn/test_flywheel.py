"""Flywheel: Asgari's two methods with their printed numbers, and the exact inertia."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import brentq

from engine_dyn import flywheel, periodic_speed
from engine_dyn.loads.friction import FrictionShape
from engine_dyn.pressure.diagram import Diagram
from engine_dyn.pressure.family import family_from_diagrams
from engine_dyn.speed import dispatch
from engine_dyn.speed.api import energy_swing
from engine_dyn.speed.required import search, solve_for_inertia
from engine_dyn.speed.torque import mean_gas_torque
from engine_dyn.status import CONVERGED, INVALID_INPUT, STALLED, TOLERANCE_NOT_MET
from oracle import solution
from oracle.solution import CYCLE
from sweeps.scene.engine.engine_files import load_engine
from tests.support.held_out import design_of, family_of, inputs_of

pytestmark = pytest.mark.compiled

SPEED = 3000 * math.pi / 30


def test_method_one() -> None:
    """Rim 42.41 m/s (printed 42.23), mean diameter 0.24 m, 0.09/0.11 = 0.82."""
    given: dict[str, Any] = {
        "outer_diameter": 0.27, "inner_diameter": 0.21, "stroke": 0.071, "speed": SPEED,
        "flywheel_inertia": 0.09, "inertia": 0.11,
    }  # fmt: skip
    found = flywheel.method_one(**given)
    assert found.rim_speed == pytest.approx(math.pi * 0.27 * 3000 / 60)
    assert found.rim_speed == pytest.approx(42.41, abs=5e-3)
    assert found.mean_diameter == pytest.approx(0.24)
    assert found.share_of_inertia == pytest.approx(0.82, abs=5e-3)
    assert found.speed_is_usual and found.inertia_is_usual
    # 2 S to 3 S with the stroke that the crank radius of 35.5 mm gives, not the printed 85 mm
    assert not found.diameter_is_usual
    assert flywheel.method_one(**{**given, "stroke": 0.085}).diameter_is_usual
    # the ratio as the text defines it, to what turns without the flywheel, is far outside
    without = flywheel.method_one(**{**given, "inertia": 0.02}, material="cast iron")
    assert not without.inertia_is_usual and not without.speed_is_usual


def test_method_two() -> None:
    """W = 280 J ... I = 0.09 kg m2, 6.15 kg; the energy swing is 352.9 J, printed 353.9."""
    found = flywheel.triangular_torque(7000.0, SPEED, 0.04)
    assert found.work == pytest.approx(280.0)
    assert found.expansion_work == pytest.approx(420.0)
    for value, printed in ((found.torque_max, 267.3), (found.torque_mean, 22.2)):
        assert math.floor(10.0 * value) / 10.0 == printed  # cut, not rounded
    assert found.torque_excess == pytest.approx(245.1, abs=5e-3)
    assert found.base == pytest.approx(2.88, abs=5e-3)
    assert found.energy_swing == pytest.approx(352.9, abs=0.05)
    assert found.energy_swing != pytest.approx(353.9, abs=0.5)
    assert found.inertia == pytest.approx(0.09, abs=5e-3)
    mass = flywheel.ring_mass(0.09, 0.27, 0.21)
    assert math.floor(100.0 * mass) / 100.0 == 6.15


def test_triangle_is_what_a_torque_of_that_shape_has() -> None:
    """The same by integration: a triangle over half a turn, its mean taken off."""
    found = flywheel.triangular_torque(9000.0, 180.0, 0.02)
    phi = np.linspace(0.0, 4.0 * math.pi, 400_001)
    torque = np.where(phi < math.pi, found.torque_max * (1.0 - phi / math.pi), 0.0)
    step = phi[1] - phi[0]
    net = torque.mean() - found.work / (4.0 * math.pi) * 1.5
    assert abs(net) < 1e-3 * found.torque_max  # expansion alone: 3/2 of the cycle's work
    above = np.maximum(torque - found.torque_mean, 0.0)
    assert above.sum() * step == pytest.approx(found.energy_swing, rel=1e-4)
    assert (above > 0.0).sum() * step == pytest.approx(found.base, rel=1e-4)
    swing = found.inertia * (181.8**2 - 178.2**2) / 2.0
    assert swing == pytest.approx(found.energy_swing, rel=1e-12)


def test_ring() -> None:
    mass, outer, inner = 6.0, 0.27, 0.21
    area = math.pi * ((0.5 * outer) ** 2 - (0.5 * inner) ** 2)
    by_rings = quad(lambda r: 2.0 * math.pi * r**3 * mass / area, 0.5 * inner, 0.5 * outer)[0]
    assert flywheel.ring_inertia(mass, outer, inner) == pytest.approx(by_rings, rel=1e-12)
    assert flywheel.ring_mass(by_rings, outer, inner) == pytest.approx(mass, rel=1e-12)
    thickness = flywheel.ring_thickness(mass, outer, inner, 7850.0)
    assert thickness * area * 7850.0 == pytest.approx(mass, rel=1e-12)


ENGINE: dict[str, Any] = {
    "bore": 0.14, "stroke": 0.18, "crank_ratio": 0.2571, "reciprocating_mass": 6.67,
    "speed": 125.66, "friction_torque": 32.8,
}  # fmt: skip


@pytest.fixture(scope="module")
def diagram() -> Diagram:
    return load_engine("ntua", Path()).family.diagrams[1]


@pytest.mark.parametrize("model", ["constant", "variable"])
@pytest.mark.parametrize("exponent", [0.0, 1.6, 2.0])
def test_one_engine(diagram: Diagram, model: str, exponent: float) -> None:
    """Against a bracketing root of the periodic solution, over inertia and not its logarithm."""
    given = {**ENGINE, "inertia_model": model, "load_exponent": exponent}
    for wanted in (0.003, 0.1, 0.8):
        found = flywheel.required_inertia(diagram, wanted, **given)
        root = brentq(
            lambda inertia, goal=wanted: periodic_speed(diagram, inertia=inertia, **given).delta
            - goal,
            0.9 * found.inertia, 1.1 * found.inertia, xtol=1e-12, rtol=1e-9,
        )  # fmt: skip
        assert found.inertia == pytest.approx(root, rel=1e-6)
        assert found.delta == pytest.approx(wanted, rel=2e-7)
        assert found.by_energy_swing == pytest.approx(
            found.energy_swing / (wanted * ENGINE["speed"] ** 2)
        )
    small = flywheel.required_inertia(diagram, 1e-4, **given)
    assert abs(small.energy_swing_error) < 1e-3
    assert small.status == CONVERGED


def batch(diagram: Diagram, **more: Any) -> dict[str, Any]:
    family = family_from_diagrams([0.0], [diagram])
    mean = float(mean_gas_torque(0.2571, 0.0, family)) * np.pi / 4 * 0.14**2 * 0.09 - 32.8
    return {
        "family": family, "crank_ratio": 0.2571, "row": 0.0, "scale": 1.0,
        "crankcase_pressure": 101325.0, "bore": 0.14, "double_radius": 0.18, "mass": 6.67,
        "speed": 125.66, "exponent": 2.0, "offset": 0.0, "mean_torque": mean,
        "friction_torque": 32.8, "energy_swing": energy_swing(diagram, **{
            name: value for name, value in ENGINE.items() if name != "friction_torque"
        }), **more,
    }  # fmt: skip


def test_energy_swing_of_friction_over_the_stroke(diagram: Diagram) -> None:
    """Its size stands in test_unequal_cylinders; here what a shape and a mean torque change."""
    shape = FrictionShape(0.3, 0.2, 0.2, 0.2, 1.5e5)
    given = {name: ENGINE[name] for name in ENGINE if name != "friction_torque"}
    found = energy_swing(diagram, **given, friction_shape=shape, friction_torque=100.0)
    plain = energy_swing(diagram, **given)
    assert abs(found / plain - 1.0) > 1e-3
    # a constant torque has no part in it
    assert energy_swing(diagram, **given, friction_torque=100.0) == plain
    # the estimate of the inertia is made of it
    estimate = flywheel.required_inertia(
        diagram, 0.05, **given, load_exponent=2.0, friction_shape=shape, friction_torque=100.0
    )
    assert estimate.energy_swing == found
    with pytest.raises(ValueError, match=r"friction_torque = nan: must be a finite number"):
        energy_swing(diagram, **given, friction_torque=np.nan)


def test_variable_inertia_that_the_moving_parts_exceed(diagram: Diagram) -> None:
    """The lightest engine is its own moving parts: no outcome of the speed, bad input."""
    heavy = batch(diagram, mass=500.0, speed=20.0, energy_swing=500.0)
    found = solve_for_inertia(wanted_delta=1.9, inertia_model="variable", **heavy)
    assert int(found.status) in (STALLED, INVALID_INPUT)
    assert np.isnan(found.inertia)


def test_search_on_curves_of_its_own() -> None:
    """Slopes unlike -1, a jump across the wanted value, an end below which nothing runs."""
    goal = np.array([0.1, 0.1, 0.1, 0.1])

    def outcome(active: Any, inertia: Any) -> Any:
        theta = inertia[active]
        curves = np.stack(
            [
                0.3 * theta**-0.5,
                0.5 * theta**-2.5,
                np.where(theta > 3.0, 0.05, 0.2),
                np.full_like(theta, 0.04),
            ]
        )
        code = np.zeros(active.size, dtype=np.int8)
        code[(active == 3) & (theta < 2.0)] = STALLED
        delta = np.where(code == 0, curves[active, np.arange(active.size)], np.nan)
        return delta, code

    found = search(outcome, np.full(4, 50.0), goal, 1e-6)
    assert found.status.tolist() == [CONVERGED, CONVERGED, TOLERANCE_NOT_MET, STALLED]
    assert found.inertia[:3] == pytest.approx([9.0, 5.0**0.4, 3.0], rel=1e-6)
    assert found.largest[3] == pytest.approx(0.04)
    assert found.lightest[3] == pytest.approx(2.0)


# ---- torque of the shaft beside the flywheel


@pytest.mark.parametrize(
    "name",
    [
        "alpha 2, constant, 1 cyl, power_mean",
        "alpha 1, variable, 1 cyl, power_mean",
        "alpha 1, variable, 1 cyl, cycle_time",
    ],
)
@pytest.mark.parametrize("share", [0.0, 0.7, 0.95])
def test_it_is_what_the_engine_gives_less_what_accelerates_the_running_gear(
    name: str, share: float
) -> None:
    """In front of the cut, with the independent solver's speed alone.

    Theta_v(phi) eps + Theta_v'(phi) omega^2/2 accelerates the running gear, where Theta_v(phi) is
    all of the inertia less that behind the cut, which does not change with the angle. The
    acceleration is a finite difference of omega^2/2 over the angle.
    """
    design = design_of(name)
    problem = solution.problem_of(design)[0]
    phi = np.arange(720) * CYCLE / 720 - 0.5 * CYCLE
    behind = share * design.inertia
    speed, step = solution.periodic_speed(problem).omega, 1e-4
    rate = (speed(phi + step) ** 2 - speed(phi - step) ** 2) / (4.0 * step)
    ratio, slope = problem.inertia_ratio(phi), problem.inertia_slope(phi)
    in_front = problem.torque(phi) - (design.inertia * ratio - behind) * rate
    in_front = in_front - 0.5 * design.inertia * slope * speed(phi) ** 2

    inputs = inputs_of(design, family_of(design, 0.25))
    found = dispatch.solve(
        wanted=("omega", "angular_acceleration", "load_factor"), crank_angle=phi, **inputs
    )
    surplus = float(found["load_factor"]) * (problem.torque_mean - design.load_offset)
    load = design.load_offset + surplus * (found["omega"] / design.omega_n) ** design.load_exponent
    torque = flywheel.shaft_torque(load, behind, found["angular_acceleration"])
    # Between two nodes the acceleration is a cubic's.
    np.testing.assert_allclose(torque, in_front, rtol=0.0, atol=2e-4 * np.ptp(in_front))
