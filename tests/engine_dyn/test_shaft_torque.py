"""Torque of the shaft beside the flywheel: from behind as it is computed, and from in front."""

import math

import numpy as np
import pytest

from engine_dyn import flywheel
from engine_dyn.speed import dispatch
from oracle import solution
from oracle.solution import CYCLE
from tests.support.held_out import design_of, family_of, inputs_of

pytestmark = pytest.mark.compiled


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
    # As for the acceleration in test_speed_sweep.
    np.testing.assert_allclose(torque, in_front, rtol=0.0, atol=2e-4 * np.ptp(in_front))


def test_verdicts() -> None:
    found = flywheel.verdict([1.999, 2.0, 2.5, 3.0, 3.001, math.nan], 2.0, 3.0)
    np.testing.assert_array_equal(found, [1.0, 0.0, 0.0, 0.0, 2.0, math.nan])
    assert flywheel.VERDICTS == ("within", "below", "above")


def test_the_inertia_behind_is_the_rest() -> None:
    assert flywheel.inertia_behind(2.0, 0.25) == 1.75
    assert np.isnan(flywheel.inertia_behind([0.2, 0.3], 0.25)).tolist() == [True, False]
