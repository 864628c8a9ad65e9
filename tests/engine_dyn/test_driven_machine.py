"""Loads over angle and speed, drivers: an independent solver, exact equivalents, outcomes."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.interpolate import CubicSpline, PchipInterpolator

from engine_dyn import status
from engine_dyn.loads.driven_machine import (
    DrivenMachine,
    constant_load,
    motor_torque,
    synchronous_speed,
)
from engine_dyn.loads.torque_curves import torque_over_angle, torque_over_speed
from engine_dyn.speed import dispatch
from engine_dyn.speed.torque import torque_extremes
from oracle import solution
from oracle.designs import _mean as mean_of
from oracle.solution import Design, Problem
from tests.support.held_out import design_of, family_of, inputs_of, solved, torque_inputs_of

compiled = pytest.mark.compiled

CYCLE = 4.0 * np.pi
ANGLES = np.radians(np.arange(0.0, 360.0, 1.0))
STRAIGHT = torque_over_speed([10.0, 500.0], [1.0, 50.0])
TOLERANCE = 1e-6  # the issue's


def lobes(size: float, theta: Any = ANGLES) -> Any:
    """Torque of a made-up load over its own angle [N m]; its mean is `size`."""
    return size * (
        1.0 + 0.8 * np.cos(theta) + 0.5 * np.sin(3.0 * theta) + 0.2 * np.cos(5.0 * theta)
    )


def design_and_problem(name: str, motored: bool = False) -> tuple[Design, Problem]:
    design = design_of(name)
    if motored:  # friction beyond what the gas gives: the mean torque is negative
        design = replace(design, friction_torque=design.friction_torque + 1.5 * mean_of(design))
    return design, solution.problem_of(design)[0]


def with_angle_load(
    problem: Problem, size: float, gear: float, phase: float, factor: float
) -> Problem:
    """Return the oracle's problem with a load over its own angle, which it has as a formula."""
    engine = problem.torque

    def rest(phi: Any) -> Any:
        return engine(phi) - factor * gear * lobes(size, gear * np.asarray(phi) + phase)

    return replace(problem, torque=rest, torque_mean=problem.torque_mean - factor * gear * size)


def law_of_curve(curve: Any, slope: Any, nominal: float) -> Any:
    """F and its slope over u for the oracle."""
    at = float(curve(nominal))

    def law(u: float) -> tuple[float, float]:
        omega = nominal * np.sqrt(u)
        return float(curve(omega)) / at, float(slope(omega)) / at * omega / (2.0 * u)

    return law


def agree(problem: Problem, found: Any) -> None:
    expected = solution.periodic_speed(problem)
    assert expected.status == "converged"
    assert found.status == status.CONVERGED
    delta = (expected.omega_max - expected.omega_min) / expected.omega_mean
    assert found.delta == pytest.approx(delta, rel=TOLERANCE)
    for name in ("omega_mean", "omega_max", "omega_min"):
        assert getattr(found, name) == pytest.approx(getattr(expected, name), rel=TOLERANCE)


@compiled
@pytest.mark.parametrize(
    ("name", "gear"),
    [
        ("alpha 2, constant, 6 cyl, power_mean", 0.5),
        ("alpha 1, variable, 1 cyl, power_mean", 2.0),
        ("alpha 0, constant, 3 cyl, power_mean", 1.5),
    ],
)
def test_load_over_its_own_angle_against_the_independent_solver(name: str, gear: float) -> None:
    design, problem = design_and_problem(name)
    size = 0.3 * problem.torque_mean
    driven = DrivenMachine(torque_over_angle(ANGLES, lobes(size), own_angle=True))
    found = solved(design, driven=driven, gear_ratio=gear, load_phase=0.7, load_scale=0.9)
    agree(with_angle_load(problem, size, gear, 0.7, 0.9), found)


@compiled
@pytest.mark.parametrize(
    "name",
    [
        "alpha 2, constant, 1 cyl, power_mean",
        "alpha 1, variable, 1 cyl, cycle_time",
        "strong, alpha 2, constant, power_mean",
    ],
)
def test_load_over_speed_against_the_independent_solver(name: str) -> None:
    design, problem = design_and_problem(name)
    speeds = design.omega_n * np.linspace(0.5, 1.5, 7)
    torque = np.array([5.0, 20.0, 60.0, 100.0, 170.0, 290.0, 500.0])
    curve = PchipInterpolator(speeds, torque)
    law = law_of_curve(curve, curve.derivative(), design.omega_n)
    driven = DrivenMachine(load_over_speed=torque_over_speed(speeds, torque))
    found = solved(design, driven=driven)
    agree(replace(problem, law=law), found)
    # k T(omega) takes the mean torque
    phi = np.arange(2880) * CYCLE / 2880
    traced = solved(design, driven=driven, crank_angle=phi)
    taken = traced.load_coefficient * np.mean(curve(traced.omega))
    assert taken == pytest.approx(problem.torque_mean, rel=1e-6)


@compiled
@pytest.mark.parametrize("method", ["auto", "newton"])
@pytest.mark.parametrize(
    "name",
    [
        "alpha 2, constant, 1 cyl, power_mean",
        "alpha 1, variable, 1 cyl, cycle_time",
        "strong, alpha 2, constant, power_mean",
        "alpha 1, variable, 1 cyl, power_mean",
    ],
)
def test_linear_and_square_load_against_the_independent_solver(name: str, method: str) -> None:
    """k (b omega + c omega^2) takes what the engine gives beyond a, which k does not scale."""
    design, problem = design_and_problem(name)
    linear, square = 3.0, 2.0 / design.omega_n  # the square part is two fifths at nominal speed

    def load(omega: Any) -> Any:
        return linear * omega + square * omega**2

    law = law_of_curve(load, lambda omega: linear + 2.0 * square * omega, design.omega_n)
    found = solved(
        design, load_exponent=None, load_linear=linear, load_square=square, method=method,
        crank_angle=np.arange(2880) * CYCLE / 2880,
    )  # fmt: skip
    agree(replace(problem, law=law), found)
    surplus = found.torque_mean - design.load_offset
    assert found.load_coefficient * np.mean(load(found.omega)) == pytest.approx(surplus, rel=1e-6)
    if "power_mean" in name:  # up to the hundredth of the tolerance that iterations may leave
        nominal = float(load(design.omega_n))
        assert found.load_coefficient * nominal == pytest.approx(surplus, rel=1e-8)


@compiled
@pytest.mark.parametrize(
    ("name", "load"),
    [
        ("alpha 2, constant, 1 cyl, power_mean", False),
        ("alpha 2, variable, 3 cyl, power_mean", True),
        ("alpha 2, variable, 1 cyl, cycle_time", False),
        ("strong, alpha 2, constant, power_mean", False),
    ],
)
def test_driven_by_a_motor_against_the_independent_solver(name: str, load: bool) -> None:
    design, problem = design_and_problem(name, motored=True)
    synchronous, slip = 1.04 * design.omega_n, 0.15

    def torque(omega: float) -> float:
        s = 1.0 - omega / synchronous
        return 2.0 / (s / slip + slip / s) if s else 0.0

    def slope(omega: float) -> float:
        s = 1.0 - omega / synchronous
        return -2.0 * slip * (slip**2 - s**2) / (s**2 + slip**2) ** 2 / synchronous

    over, more = None, {}
    if load:
        size = -0.2 * problem.torque_mean
        over = torque_over_angle(ANGLES, lobes(size), own_angle=True)
        more = {"gear_ratio": 1.5, "load_phase": -0.4}
        problem = with_angle_load(problem, size, 1.5, -0.4, 1.0)
    problem = replace(problem, law=law_of_curve(torque, slope, design.omega_n), sign=-1.0)
    found = solved(
        design, driven=DrivenMachine(over, motor=True), synchronous_speed=synchronous,
        breakdown_slip=slip, breakdown_torque=50.0, **more,
    )  # fmt: skip
    agree(problem, found)
    assert found.load_coefficient == 0.0 and found.driver_factor > 0.0


@compiled
@pytest.mark.parametrize("gear", [0.5, 1.0, 1.5, 3.0])
def test_the_part_of_the_cycle_follows_from_engine_and_load(gear: float) -> None:
    """Solved by period or as unequal cylinders, which have none but the cycle."""
    design = design_of("alpha 2, constant, 6 cyl, power_mean")
    over = torque_over_angle(ANGLES, lobes(50.0), own_angle=True)
    keys = {"driven": DrivenMachine(over), "gear_ratio": gear}
    found = solved(design, **keys)
    same = solved(design, mass_factor=(1.0,) * 5 + (1.0 + 1e-13,), **keys)
    assert found.delta == pytest.approx(same.delta, rel=1e-9)


def motor(design: Design, synchronous: float, slip: float, **more: Any) -> int:
    keys = {"synchronous_speed": synchronous * design.omega_n, "breakdown_slip": slip}
    return solved(design, driven=DrivenMachine(motor=True), **keys, **more).status


@compiled
def test_outcomes_tell_the_truth() -> None:
    design, _ = design_and_problem("alpha 2, constant, 3 cyl, power_mean", motored=True)
    engine = design_of("alpha 2, constant, 3 cyl, power_mean")
    assert solved(design).status == status.NO_STEADY_STATE  # nothing drives
    assert motor(design, 1.04, 0.15) == status.CONVERGED
    assert motor(design, 0.99, 0.15) == status.NO_STEADY_STATE  # the motor would brake
    assert motor(engine, 0.96, 0.15) == status.CONVERGED  # and so it can an engine
    assert motor(engine, 1.04, 0.15) == status.NO_STEADY_STATE
    # Beyond the breakdown a little less speed is a little less torque: it does not hold.
    assert motor(design, 1.5, 0.15) == status.NO_STEADY_STATE
    with pytest.raises(ValueError, match="method 'closed' supports only"):
        motor(design, 1.04, 0.15, method="closed")
    with pytest.raises(ValueError, match="method 'closed' supports only"):
        solved(engine, load_exponent=None, load_linear=1.0, method="closed")

    def over(low: float, high: float, *torque: float) -> int:
        speeds = np.linspace(low, high, len(torque)) * engine.omega_n
        curve = torque_over_speed(speeds, torque)
        return solved(engine, driven=DrivenMachine(load_over_speed=curve)).status

    assert over(0.5, 1.5, 10.0, 30.0) == status.CONVERGED
    assert over(0.5, 1.5, 30.0, 10.0) == status.NO_STEADY_STATE  # falls
    assert over(0.5, 1.5, 20.0, 20.0) == status.NO_STEADY_STATE  # holds no speed
    assert over(0.5, 0.9, 10.0, 30.0) == status.INVALID_INPUT  # nominal speed not covered
    assert over(0.5, 1.0001, 10.0, 30.0) == status.INVALID_INPUT  # not the fastest speed


@compiled
def test_designs_of_a_sweep_are_those_alone() -> None:
    """Gear ratios, phases, factors and motors as arrays, in any order."""
    design, _ = design_and_problem("alpha 2, constant, 6 cyl, power_mean", motored=True)
    family = family_of(design)
    over = torque_over_angle(ANGLES, lobes(40.0), own_angle=True)
    inputs = inputs_of(design, family)
    gear = np.array([0.5, 1.0, 3.0])[:, None, None]
    scale = np.array([0.0, 1.0])[:, None]
    slip = np.array([0.1, 0.3, 0.2])
    inputs["offset"] = constant_load(0.0, over, gear, scale)
    found = dispatch.solve(
        wanted=("delta", "omega_mean"), driven=DrivenMachine(over, motor=True), gear_ratio=gear,
        load_phase=0.3, load_scale=scale, breakdown_slip=slip,
        synchronous_speed=1.05 * design.omega_n, **inputs,
    )  # fmt: skip
    assert found["delta"].shape == (3, 2, 3)
    assert (found["status"] == status.CONVERGED).all()
    for place in ((0, 0, 0), (0, 1, 2), (2, 1, 1)):
        one = solved(
            design, driven=DrivenMachine(over, motor=True), gear_ratio=float(gear[place[0], 0, 0]),
            load_phase=0.3, load_scale=float(scale[place[1], 0]),
            synchronous_speed=1.05 * design.omega_n, breakdown_slip=float(slip[place[2]]),
        )  # fmt: skip
        assert found["delta"][place] == pytest.approx(one.delta, rel=1e-12)


@compiled
@pytest.mark.parametrize("gear", [0.5, 1.5])
def test_energy_swing_less_a_load_over_angle(gear: float) -> None:
    """With a load that the speed does not change, all of it goes into the flywheel."""
    design, _ = design_and_problem("alpha 0, constant, 3 cyl, power_mean")
    size = 0.3 * mean_of(design)
    driven = DrivenMachine(torque_over_angle(ANGLES, lobes(size), own_angle=True))
    keys: dict[str, Any] = {"driven": driven, "gear_ratio": gear, "load_phase": 0.7}
    inputs = torque_inputs_of(design, family_of(design))
    wanted = ("torque_max", "torque_min", "energy_swing")
    scale = np.array([0.9, 0.0, 0.4])
    found = torque_extremes(wanted=wanted, load_scale=scale, **keys, **inputs)
    for factor, swing in zip(scale.tolist(), found["energy_swing"], strict=True):
        one = solved(design, load_scale=factor, **keys)
        energy = 0.5 * design.inertia * (one.omega_max**2 - one.omega_min**2)
        assert swing == pytest.approx(energy, rel=1e-6)
    # the torque is the engine's own, whatever the load
    plain = torque_extremes(wanted=wanted, **inputs)
    for name in ("torque_max", "torque_min"):
        span = plain["torque_max"] - plain["torque_min"]
        assert found[name] == pytest.approx(float(plain[name]), abs=1e-7 * span)
    assert found["energy_swing"][1] == pytest.approx(float(plain["energy_swing"]), rel=1e-7)
    assert abs(found["energy_swing"][0] / plain["energy_swing"] - 1.0) > 0.01


def test_curves_over_angle_are_periodic_splines() -> None:
    rng = np.random.default_rng(3)
    angle = np.sort(rng.uniform(-3.0, 3.2, 40))
    angle = np.append(angle, angle[0] + 2.0 * np.pi)
    torque = rng.normal(size=41)
    torque[-1] = torque[0]
    curve = torque_over_angle(angle, torque)
    spline = CubicSpline(angle, torque, bc_type="periodic")
    theta = np.linspace(-20.0, 20.0, 501)
    place = angle[0] + np.mod(theta - angle[0], 2.0 * np.pi)
    np.testing.assert_allclose(curve(theta), spline(place), atol=1e-12)
    mean = spline.integrate(angle[0], angle[-1]) / (2.0 * np.pi)
    assert curve.mean == pytest.approx(float(mean), abs=1e-13)
    work = spline.antiderivative()
    expected = work(place) - work(angle[0]) - mean * (place - angle[0])
    np.testing.assert_allclose(curve.work(theta), expected, atol=1e-12)
    np.testing.assert_allclose(curve(theta), spline(place), atol=1e-12)


def test_curves_over_speed_are_scipys_monotone_ones() -> None:
    rng = np.random.default_rng(5)
    for count in (2, 3, 4, 12):
        speed = np.cumsum(rng.uniform(1.0, 9.0, count))
        torque = rng.uniform(0.0, 10.0, count)
        curve = torque_over_speed(speed, torque)
        expected = PchipInterpolator(speed, torque)
        omega = np.linspace(speed[0], speed[-1], 201)
        np.testing.assert_allclose(curve(omega), expected(omega), atol=1e-11)
        assert np.isnan(curve(speed[-1] + 1.0)) and np.isnan(curve(speed[0] - 1.0))
    rising = torque_over_speed([1, 2, 3, 9], [0, 1, 1, 7])(np.linspace(1, 9, 99))
    assert (np.diff(rising) >= 0.0).all()


def test_kloss() -> None:
    """Largest at the breakdown slip, none at synchronous speed; 2 M_b s/s_b for small slip."""
    omega = np.linspace(1.0, 156.0, 5000)
    torque = motor_torque(omega, 157.0, 0.2, 40.0)
    assert torque.max() == pytest.approx(40.0, rel=1e-6)
    assert omega[torque.argmax()] == pytest.approx(0.8 * 157.0, rel=1e-3)
    assert motor_torque(157.0, 157.0, 0.2, 40.0) == 0.0
    assert motor_torque(157.0 * (1.0 - 1e-5), 157.0, 0.2, 40.0) == pytest.approx(4e-3, rel=1e-6)
    assert motor_torque(160.0, 157.0, 0.2) < 0.0
    assert 1.0 - 100.0 / synchronous_speed(100.0, 0.04) == pytest.approx(0.04)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: torque_over_angle([0.0, 1.0], [1.0, 2.0]), "2 points: must be at least 8"),
        (lambda: torque_over_angle(ANGLES[:196], lobes(1.0)[:196]), "covers 195 degrees"),
        (lambda: torque_over_angle(ANGLES[::-1], lobes(1.0)), "point 2: angle = 358 degree after"),
        (lambda: torque_over_angle(np.append(ANGLES, 2.0 * np.pi), np.arange(361.0)), "same angle"),
        (lambda: torque_over_angle(ANGLES, np.where(ANGLES > 3.0, np.nan, 1.0)), "finite"),
        (lambda: torque_over_speed([1.0], [2.0]), "1 points: must be at least 2"),
        (lambda: torque_over_speed([-1.0, 2.0], [2.0, 3.0]), "point 1: speed"),
        (lambda: torque_over_speed([1.0, 2.0], [2.0, -3.0]), "point 2: torque = -3"),
        (lambda: torque_over_speed([1.0, 2.0], [2.0]), "equally long"),
    ],
)
def test_bad_curves_are_refused(make: Any, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        make()


@compiled
@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ({"load_linear": -1.0}, "load_linear = -1: must be zero or a positive number"),
        ({"load_square": np.inf}, "load_square = inf"),
        ({"load_linear": 1.0, "load_exponent": 2.0}, "load_exponent: not allowed together"),
        ({"load_linear": 1.0, "method": "thesis"}, "supports only the load law"),
        (
            {"driven": DrivenMachine(motor=True), "synchronous_speed": 1.0, "breakdown_slip": 0.2,
             "method": "thesis"},
            "thesis",
        ),
        ({"load_square": 1.0, "driven": DrivenMachine(load_over_speed=STRAIGHT)},
         "not allowed together with a driver or a table over speed"),
        ({"driven": DrivenMachine(motor=True)}, "synchronous_speed: missing"),
        (
            {"driven": DrivenMachine(motor=True), "synchronous_speed": 1.0, "breakdown_slip": -1.0},
            "breakdown_slip = -1",
        ),
        (
            {"driven": DrivenMachine(torque_over_angle(ANGLES, lobes(1.0), True)),
             "gear_ratio": 0.7},
            "gear_ratio = 0.7",
        ),
    ],
)  # fmt: skip
def test_bad_calls_are_refused(keys: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        solved(design_of("alpha 2, constant, 1 cyl, power_mean"), **{"load_exponent": None, **keys})
