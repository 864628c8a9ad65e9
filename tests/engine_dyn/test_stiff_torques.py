"""Torques that answer stiffly to the speed: cycles followed in time by SciPy find the same."""

import math
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest
from scipy.interpolate import CubicSpline, PchipInterpolator

from engine_dyn import diagram_from_points, periodic_speed, status
from engine_dyn.loads.driven_machine import DrivenMachine
from engine_dyn.loads.laws import LINEAR_SQUARE, Form, law_of
from engine_dyn.loads.torque_curves import torque_over_speed
from engine_dyn.speed.general import one_by_one, stable_cycle
from oracle import in_time, solution
from oracle.in_time import Cycle, Stiff
from oracle.solution import Design
from tests.support.held_out import design_of, solved

compiled = pytest.mark.compiled

CYCLE = 4.0 * math.pi
BORE = STROKE = 0.1
RATIO, MASS, FRICTION = 0.25, 1.0, 300.0
NOMINAL = 1500.0 * math.pi / 30.0
SLIP, BREAKDOWN = 0.033, 0.16
SYNCHRONOUS = 1.0 / (1.0 - SLIP)
TOLERANCE = 1e-6


def pressure(phi: Any) -> Any:
    """A motored cylinder: compressed and expanded by 16 to 1 about firing dead centre."""
    near = np.abs(np.mod(phi + CYCLE / 2.0, CYCLE) - CYCLE / 2.0) <= math.pi
    volume = 1.0 + 15.0 * 0.5 * (1.0 - np.cos(phi))
    return 1e5 * np.where(near, (16.0 / volume) ** 1.35, 1.0)


@cache
def points() -> tuple[Any, Any]:
    phi = np.radians(np.arange(-360.0, 360.25, 0.5))
    return phi, pressure(phi)


def motored(inertia: float, driven: DrivenMachine, **more: Any) -> Any:
    return periodic_speed(
        diagram_from_points(*points()), bore=BORE, stroke=STROKE, crank_ratio=RATIO,
        reciprocating_mass=MASS, inertia=inertia, speed=NOMINAL, friction_torque=FRICTION,
        driven=driven, **more,
    )  # fmt: skip


def with_motor(inertia: float, **more: Any) -> Any:
    return motored(
        inertia, DrivenMachine(motor=True), synchronous_speed=SYNCHRONOUS * NOMINAL,
        breakdown_slip=BREAKDOWN, breakdown_torque=900.0, **more,
    )  # fmt: skip


def kloss(x: Any, breakdown: float = BREAKDOWN) -> tuple[Any, Any]:
    s = 1.0 - x / SYNCHRONOUS
    below = s * s + breakdown**2
    return s / below, -(breakdown**2 - s * s) / below**2 / SYNCHRONOUS


def equation(inertia: float, torque: Any, variable: bool = False, mu: float = 1.0) -> Stiff:
    """docs/method.md (53) from the points of the pressure and a torque over omega/omega_n."""
    phi, p = points()
    curve = CubicSpline(phi, np.append(p[:-1], p[0]), bc_type="periodic")
    problem, _ = solution.problem_of(Design(
        lambda at: curve(np.mod(at + CYCLE / 2.0, CYCLE) - CYCLE / 2.0), bore=BORE, stroke=STROKE,
        crank_ratio=RATIO, reciprocating_mass=MASS, inertia=inertia, speed_rpm=1500.0,
        friction_torque=FRICTION, crankcase_pressure=101325.0,
        inertia_model="variable" if variable else "constant",
    ))  # fmt: skip
    at = np.linspace(0.0, CYCLE, 14401)
    energy = 0.5 * inertia * NOMINAL**2
    rate = CubicSpline(at, (problem.torque(at) - problem.torque_mean) / energy)

    def law(q: Any) -> tuple[Any, Any]:
        x = np.sqrt(np.maximum(q, 1e-9))
        value, slope = torque(x)
        return value / torque(1.0)[0], slope / torque(1.0)[0] * 0.5 / x

    made = Stiff(lambda a: rate(np.mod(a, CYCLE)), problem.torque_mean / energy, law, CYCLE, mu=mu)
    return replace(made, theta=problem.inertia_ratio) if variable else made


def agree(found: Any, cycle: Cycle) -> None:
    assert cycle.closed and cycle.decay < 0.0
    assert found.status == status.CONVERGED
    assert found.delta == pytest.approx(cycle.delta, rel=TOLERANCE)
    assert found.omega_max == pytest.approx(NOMINAL * cycle.highest, rel=TOLERANCE)
    assert found.omega_min == pytest.approx(NOMINAL * cycle.lowest, rel=TOLERANCE)
    assert found.omega_mean == pytest.approx(NOMINAL * cycle.mean, rel=TOLERANCE)
    # The samples of the cycle followed in time leave some 1e-9.
    assert abs(found.delta / cycle.delta - 1.0) <= found.delta_error + 5e-9


@compiled
@pytest.mark.parametrize("model", ["constant", "variable"])
@pytest.mark.parametrize("inertia", [0.03, 0.02, 0.01, 0.003])
def test_a_motor_with_a_light_flywheel(inertia: float, model: str) -> None:
    """Deviations shrink by e^-100 to e^-1340 in a cycle; 0.02 was stalled, 0.01 not converged."""
    cycle = in_time.follow(equation(inertia, kloss, model == "variable"))
    assert cycle.decay < -100.0
    agree(with_motor(inertia, inertia_model=model), cycle)


@compiled
def test_every_flywheel_with_a_driver_over_speed() -> None:
    """The outcomes were 0, 5, 1, 5, 1 one after the other as the flywheel got lighter."""
    x = np.array([0.0, 0.5, 0.9, 1.0, 1.1, 1.5])
    y = np.array([4000.0, 3000.0, 1500.0, 330.0, -800.0, -2500.0])
    curve = PchipInterpolator(x, y)
    slope = curve.derivative()
    driven = DrivenMachine(driver_over_speed=torque_over_speed(NOMINAL * x, y, driver=True))
    for inertia in (0.3, 0.1, 0.03, 0.01, 0.003, 0.001, 0.0003, 0.0001):
        cycle = in_time.follow(equation(inertia, lambda at: (curve(at), slope(at))))
        agree(motored(inertia, driven), cycle)


@compiled
def test_a_motor_that_cannot_carry_the_machine_over_stalls() -> None:
    """Cycles from far above fall to standstill: there is no steady one below."""
    weak = {"synchronous_speed": SYNCHRONOUS * NOMINAL, "breakdown_slip": 0.05}
    found = motored(0.004, DrivenMachine(motor=True), **weak)
    assert in_time.follow(equation(0.004, lambda x: kloss(x, 0.05)), start=25.0).stands
    assert found.status == status.STALLED
    assert math.isnan(found.delta)


@compiled
@pytest.mark.parametrize(
    ("name", "changes"),
    [
        ("alpha 2, constant, 1 cyl, power_mean", {}),
        ("alpha 1.6, variable, 3 cyl, power_mean", {}),
        ("alpha 1, variable, 1 cyl, cycle_time", {}),
        ("strong, alpha 3, constant, cycle_time", {}),
        ("alpha 2, variable, 3 cyl, power_mean", {"load_linear": 1.0, "load_square": 0.01}),
        ("alpha 2, constant, 6 cyl, power_mean", {"load_offset": 20.0}),
    ],
)
def test_cycles_in_time_end_where_the_other_methods_do(
    name: str, changes: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Designs that need no other solver, given to this one."""
    design = design_of(name)
    if "load_linear" in changes:
        changes = {**changes, "load_exponent": None}
    expected = solved(design, method="newton", **changes)
    with monkeypatch.context() as patched:
        patched.setattr(one_by_one, "followed", lambda *_: tuple(range(7)))
        found = solved(design, method="newton", **changes)
    assert found.status == expected.status == status.CONVERGED
    assert found.iterations != expected.iterations  # another method indeed
    for key in ("delta", "omega_max", "omega_min", "omega_mean", "load_coefficient"):
        assert getattr(found, key) == pytest.approx(getattr(expected, key), rel=1e-8)


@compiled
def test_curves_over_the_angle_of_a_stiff_design() -> None:
    angles = np.radians(np.arange(0.0, 720.0, 30.0))
    found = with_motor(0.01, crank_angle=angles)
    assert found.status == status.CONVERGED
    assert np.all(found.omega <= found.omega_max * (1.0 + 1e-9))
    problem = equation(0.01, kloss)
    # From the speed at an angle, the equation leads to the speed at the next one.
    for i in range(0, angles.size - 1, 5):
        part = replace(
            problem, period=float(angles[i + 1] - angles[i]),
            work_rate=lambda a, i=i: problem.work_rate(a + angles[i]),
        )  # fmt: skip
        end = in_time.after(part, float(found.omega[i] / NOMINAL) ** 2)
        assert math.sqrt(end) * NOMINAL == pytest.approx(found.omega[i + 1], rel=1e-7)


@pytest.mark.parametrize("push", [1e-3, 1.0, 1e3, 1e7])
def test_an_interval_of_a_linear_law(push: float) -> None:
    """e' = c - push (e - 1) over one interval: e = 1 + c/push + (e_0 - 1 - c/push) exp(-push)."""
    c, start = 0.3, 1.7
    interval = stable_cycle.Interval((c, 0.0, 0.0, 0.0, 0.0), 1.0, (0.0, 0.0, 0.0, 0.0, 0.0))
    proportional, _ = law_of(80.0, 0.0, 1.0, 1.0, Form(LINEAR_SQUARE, 1.0, False, np.zeros((3, 0))))
    passed = stable_cycle.pass_interval(start, interval, push, 1.0, 1e-13, proportional)
    steady = 1.0 + c / push
    assert passed.missed < math.inf
    assert passed.end == pytest.approx(steady + (start - steady) * math.exp(-push), rel=1e-10)
    # What the factor is in a stiff interval does not matter, as long as it is small.
    assert passed.factor == pytest.approx(math.exp(-push), rel=1e-9, abs=1e-2)


@compiled
@pytest.mark.parametrize(
    "changes",
    [
        *({"method": method, "inertia_model": model}
          for method in ("auto", "newton", "closed") for model in ("constant", "variable")),
        *({"load_exponent": exponent, "closure": closure}
          for exponent in (0.0, 1.0, 1.6, 2.0) for closure in ("power_mean", "cycle_time")),
    ],
    ids=str,
)  # fmt: skip
def test_a_fluctuation_below_rounding_is_no_number(changes: dict[str, Any]) -> None:
    """Delta was 0 with status 0; truly it is 1e-17 and less, but not nothing."""
    design = design_of("alpha 2, constant, 1 cyl, power_mean")
    for inertia in (1e16, 1e17, 1e20):
        found = solved(design, inertia=inertia, **changes)
        assert found.status == status.TOLERANCE_NOT_MET, inertia
        assert found.delta_error >= 1.0
        assert found.delta <= 1e-15


@compiled
def test_a_braking_motor_that_is_pushed_past_its_breakdown_torque_runs_away() -> None:
    """A light flywheel: the stroke of one cylinder is more than such a motor holds."""
    design = design_of("alpha 2, constant, 1 cyl, power_mean")
    keys: dict[str, Any] = {
        "driven": DrivenMachine(motor=True), "synchronous_speed": 0.998 * design.omega_n,
        "breakdown_slip": 0.01,
    }  # fmt: skip
    assert solved(design, **keys, inertia=100.0 * design.inertia).status == status.CONVERGED
    assert solved(design, **keys, inertia=0.1 * design.inertia).status == status.NO_STEADY_STATE
