"""The load a + k (b omega + c omega^2) against the independent solver and against its limits."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from engine_dyn import status
from engine_dyn.loads.driven_machine import DrivenMachine, torque_over_speed
from oracle import solution
from oracle.solution import CYCLE
from tests.support.held_out import design_of, solved

pytestmark = pytest.mark.compiled

TOLERANCE = 1e-6


CASES = [
    (name, method)
    for name in (
        "alpha 2, constant, 1 cyl, power_mean",
        "alpha 1, variable, 1 cyl, cycle_time",
        "strong, alpha 2, constant, power_mean",
        "alpha 1, variable, 1 cyl, power_mean",
    )
    for method in ("auto", "newton")
]


@pytest.mark.parametrize(("name", "method"), CASES)
def test_against_the_independent_solver(name: str, method: str) -> None:
    design = design_of(name)
    linear, square = 3.0, 2.0 / design.omega_n  # the square part is two fifths at nominal speed
    nominal = linear * design.omega_n + square * design.omega_n**2

    def law(u: float) -> tuple[float, float]:
        omega = design.omega_n * np.sqrt(u)
        slope = (linear + 2.0 * square * omega) * 0.5 * omega / u
        return (linear * omega + square * omega**2) / nominal, slope / nominal

    expected = solution.periodic_speed(replace(solution.problem_of(design)[0], law=law))
    phi = np.arange(2880) * CYCLE / 2880
    found = solved(
        design, load_exponent=None, load_linear=linear, load_square=square, method=method,
        crank_angle=phi,
    )  # fmt: skip
    assert expected.status == "converged"
    assert found.status == status.CONVERGED
    delta = (expected.omega_max - expected.omega_min) / expected.omega_mean
    assert found.delta == pytest.approx(delta, rel=TOLERANCE)
    for speed in ("omega_mean", "omega_max", "omega_min"):
        assert getattr(found, speed) == pytest.approx(getattr(expected, speed), rel=TOLERANCE)
    # k (b omega + c omega^2) takes what the engine gives beyond a, which k does not scale.
    taken = found.load_coefficient * np.mean(linear * found.omega + square * found.omega**2)
    assert taken == pytest.approx(found.torque_mean - design.load_offset, rel=1e-6)
    if "power_mean" in name:  # up to the hundredth of the tolerance that iterations may leave
        assert found.load_coefficient * nominal == pytest.approx(
            found.torque_mean - design.load_offset, rel=1e-8
        )


def test_closed_form_and_thesis_cannot_solve_it() -> None:
    design = design_of("alpha 2, constant, 1 cyl, power_mean")
    found = solved(design, load_exponent=None, load_linear=1.0, method="closed")
    assert found.status == status.INVALID_INPUT
    with pytest.raises(ValueError, match="supports only the load law"):
        solved(design, load_exponent=None, load_linear=1.0, method="thesis")


TABLE = torque_over_speed(np.array([10.0, 500.0]), np.array([1.0, 50.0]))


@pytest.mark.parametrize(
    ("given", "says"),
    [
        ({"load_linear": -1.0}, "load_linear = -1: must be zero or a positive number"),
        ({"load_square": np.inf}, "load_square = inf"),
        ({"load_linear": 1.0, "load_exponent": 2.0}, "load_exponent: not allowed together"),
        ({"load_square": 1.0, "driven": DrivenMachine(load_over_speed=TABLE)},
         "not allowed together with a driver or a table over speed"),
    ],
)  # fmt: skip
def test_bad_input(given: dict[str, Any], says: str) -> None:
    design = design_of("alpha 2, constant, 1 cyl, power_mean")
    with pytest.raises(ValueError, match=says):
        solved(design, **{"load_exponent": None, **given})
