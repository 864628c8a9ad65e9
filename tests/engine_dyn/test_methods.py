"""The methods of the periodic speed against each other, plain Python, and at their limits."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from engine_dyn import Diagram, diagram_from_points, periodic_speed
from engine_dyn.pressure.family import family_from_diagrams
from engine_dyn.speed import dispatch
from engine_dyn.speed.mean_gas import mean_gas_torque
from engine_dyn.speed.work.maxima import max_between
from engine_dyn.status import (
    CONVERGED,
    INVALID_INPUT,
    NO_STEADY_STATE,
    NOT_CONVERGED,
    PASSES_DONE,
    STALLED,
    TOLERANCE_NOT_MET,
    has_numbers,
)
from oracle.designs import HeldOut, held_out
from oracle.thesis import euler

pytestmark = pytest.mark.compiled

PERIOD = 4.0 * math.pi
BY_NAME = {item.name: item for item in held_out()}


def diagram_of(item: HeldOut, step: float = 0.5) -> Diagram:
    degrees, bar = item.table(step)
    return diagram_from_points(np.radians(degrees), bar * 1e5, PERIOD)


def inputs_of(item: HeldOut) -> dict[str, Any]:
    design = item.design
    names = ("bore", "stroke", "crank_ratio", "reciprocating_mass", "inertia", "cylinders",
             "load_exponent", "load_offset", "friction_torque", "crankcase_pressure",
             "inertia_model", "closure")  # fmt: skip
    return {"speed": design.omega_n, **{name: getattr(design, name) for name in names}}


SOME = [name for name in BY_NAME if name.startswith(("alpha", "strong", "weak"))][::5]


@pytest.mark.parametrize("name", SOME)
def test_auto_and_newton_are_one_solution(name: str) -> None:
    diagram, inputs = diagram_of(BY_NAME[name]), inputs_of(BY_NAME[name])
    auto = periodic_speed(diagram, **inputs)
    newton = periodic_speed(diagram, method="newton", **inputs)
    assert auto.status == newton.status == CONVERGED
    for field in ("delta", "omega_max", "omega_min", "omega_mean", "load_coefficient"):
        assert getattr(auto, field) == pytest.approx(getattr(newton, field), rel=2e-8), field


@pytest.mark.parametrize("model", ["constant", "variable"])
def test_closed_solutions_exist_for_exponents_0_and_2_only(model: str) -> None:
    item = BY_NAME["alpha 1.6, constant, 3 cyl, power_mean"]
    inputs = {**inputs_of(item), "inertia_model": model}
    for exponent in (0.0, 2.0):
        inputs["load_exponent"] = exponent
        closed = periodic_speed(diagram_of(item), method="closed", **inputs)
        auto = periodic_speed(diagram_of(item), **inputs)
        assert closed.delta == pytest.approx(auto.delta, rel=1e-8)
    inputs["load_exponent"] = 1.6
    refused = periodic_speed(diagram_of(item), method="closed", **inputs)
    assert refused.status == INVALID_INPUT and math.isnan(refused.delta)


@pytest.mark.parametrize("passes", [1, 3])
@pytest.mark.parametrize("name", ["alpha 2, constant, 1 cyl, power_mean",
                                  "alpha 0.5, constant, 3 cyl, power_mean"])  # fmt: skip
def test_thesis_method_is_plain_euler_sample_by_sample(name: str, passes: int) -> None:
    item = BY_NAME[name]
    diagram = diagram_of(item, 1.0)  # samples at whole degrees: no interpolation in between
    plain = euler(item.design, passes=passes, start_speed=0.99 * item.design.omega_n)
    angles = np.radians(np.arange(-360.0, 360.0))
    inputs = {k: v for k, v in inputs_of(item).items() if k != "closure"}
    ours = periodic_speed(
        diagram, method="thesis", passes=passes, start_speed=0.99 * item.design.omega_n,
        crank_angle=angles, **inputs,
    )  # fmt: skip
    assert ours.status == PASSES_DONE and ours.iterations == passes
    order = np.argsort(np.mod(np.array(plain.degrees) + 360.0, 720.0))
    # 3 cylinders fire 240 degrees apart: all samples are knots of the spline.
    np.testing.assert_allclose(ours.omega, np.array(plain.omega)[order], rtol=1e-10)
    assert ours.delta == pytest.approx(plain.delta, rel=1e-8)
    assert ours.omega_mean == pytest.approx(plain.omega_mean, rel=1e-10)


def test_thesis_error_is_of_first_order_in_the_oracle() -> None:
    """Halving the step halves what Euler misses (seen on the plain one; ours is the same)."""
    item = BY_NAME["alpha 2, constant, 1 cyl, power_mean"]
    inputs = {k: v for k, v in inputs_of(item).items() if k != "closure"}
    fine = periodic_speed(diagram_of(item), **inputs)
    # A pass begins at nominal speed, half a cycle before firing, as Euler's.
    problem = euler(item.design, step_degrees=1.0 / 64.0, k=fine.load_coefficient)
    misses = [
        euler(item.design, step_degrees=step, k=fine.load_coefficient).omega_mean
        - problem.omega_mean
        for step in (1.0, 0.5, 0.25)
    ]
    assert misses[0] / misses[1] == pytest.approx(2.0, abs=0.1)
    assert misses[1] / misses[2] == pytest.approx(2.0, abs=0.1)


def test_euler_climbs_where_nothing_holds_it() -> None:
    """Exponent 0: each step adds energy; the mean speed rises cycle after cycle."""
    item = BY_NAME["alpha 0, constant, 1 cyl, power_mean"]
    inputs = {k: v for k, v in inputs_of(item).items() if k != "closure"}
    means = [
        periodic_speed(diagram_of(item), method="thesis", passes=n, **inputs).omega_mean
        for n in (1, 200, 400)
    ]
    assert means[0] < means[1] < means[2]
    endless = periodic_speed(diagram_of(item), method="thesis", **inputs)
    assert endless.status in (NOT_CONVERGED, TOLERANCE_NOT_MET)


def test_load_term_is_integrated_to_fourth_order() -> None:
    """Newton's method at twice the nodes: the difference falls sixteenfold."""
    item = BY_NAME["strong, alpha 3, constant, cycle_time"]
    design = item.design
    family = family_from_diagrams([0.0], [diagram_of(item, 0.25)])
    gas = float(mean_gas_torque(design.crank_ratio, 0.0, family))
    torque = 0.25 * np.pi * design.bore**2 * 0.5 * design.stroke * gas

    def mean_speed(finer: int) -> float:
        # A heavy load on a light flywheel, so that the load's work is what limits the result.
        return float(
            dispatch.solve(
                family=family, wanted=("omega_max",), method="newton", finer=finer,
                tolerance=1e-2, crank_ratio=design.crank_ratio, row=0.0, scale=1.0,
                crankcase_pressure=1e5, bore=design.bore, double_radius=design.stroke, mass=0.0,
                speed=design.omega_n, inertia=design.inertia, exponent=3.0, offset=0.0,
                mean_torque=torque, friction_torque=0.0, cylinders=16,
            )["omega_max"]
        )  # fmt: skip

    values = [mean_speed(n) for n in (1, 2, 4, 8)]
    first, second = abs(values[0] - values[3]), abs(values[1] - values[3])
    assert second < 1e-12 * values[3] or first / second > 10.0


def test_extreme_of_a_cubic_is_exact_and_of_a_sine_of_fifth_order() -> None:
    def sine(h: float, shift: float) -> float:
        a, b = math.pi / 2 - shift * h, math.pi / 2 + (1 - shift) * h
        middle = math.sin(0.5 * (a + b)) - (
            0.5 * (math.sin(a) + math.sin(b)) + 0.125 * h * (math.cos(a) - math.cos(b))
        )
        value, _ = max_between(math.sin(a), math.sin(b), h * math.cos(a), h * math.cos(b), middle)
        return abs(value - 1.0)

    worst = [max(sine(h, s) for s in np.linspace(0.05, 0.95, 19)) for h in (0.4, 0.2, 0.1)]
    assert worst[0] / worst[1] > 30.0 and worst[1] / worst[2] > 30.0
    # t - t^2 on [0, 1]: maximum 1/4 at 1/2
    assert max_between(0.0, 0.0, 1.0, -1.0, 0.0) == pytest.approx((0.25, 0.0))


def test_idle_and_overload() -> None:
    item = BY_NAME["alpha 1, constant, 3 cyl, power_mean"]
    inputs = inputs_of(item)
    loaded = periodic_speed(diagram_of(item), **inputs)
    inputs["load_offset"] = loaded.torque_mean
    idle = periodic_speed(diagram_of(item), **inputs)
    assert idle.status == CONVERGED
    assert idle.load_coefficient == pytest.approx(0.0, abs=1e-12)
    assert idle.omega_mean == pytest.approx(inputs["speed"], rel=1e-12)  # exponent 1
    inputs["load_offset"] = 1.001 * loaded.torque_mean
    over = periodic_speed(diagram_of(item), **inputs)
    assert over.status == NO_STEADY_STATE and math.isnan(over.omega_max)


def test_power_mean_is_the_nominal_speed() -> None:
    for exponent in (0.5, 1.0, 2.0, 3.0):
        item = BY_NAME[f"alpha {exponent:g}, variable, 1 cyl, power_mean"]
        inputs = inputs_of(item)
        angles = np.linspace(-2 * np.pi, 2 * np.pi, 720, endpoint=False)
        result = periodic_speed(diagram_of(item), crank_angle=angles, **inputs)
        power = np.mean(result.omega**exponent) ** (1.0 / exponent)
        assert power == pytest.approx(inputs["speed"], rel=1e-9)


def test_absurd_designs_have_true_outcomes() -> None:
    """Never an exception, NaN exactly where there is no number."""
    random = np.random.default_rng(3)
    item = BY_NAME["alpha 2, constant, 1 cyl, power_mean"]
    family = family_from_diagrams([0.0], [diagram_of(item)])
    count = 600
    ratio = 10.0 ** random.uniform(-6, np.log10(0.999), count)
    gas = mean_gas_torque(ratio, np.zeros(count), family)
    cylinders = random.integers(1, 17, count)
    bore, stroke = 0.1, 0.1
    torque = cylinders * 0.25 * np.pi * bore**2 * 0.5 * stroke * gas
    result = dispatch.solve(
        family=family, wanted=("delta", "omega_max", "omega_min", "omega_mean"),
        inertia_model=random.choice(["constant", "variable"], count), cylinders=cylinders,
        crank_ratio=ratio, row=np.zeros(count), scale=1.0, crankcase_pressure=1e5, bore=bore,
        double_radius=stroke, mass=10.0 ** random.uniform(-6, 4, count),
        speed=10.0 ** random.uniform(0, 5, count) * np.pi / 30,
        inertia=10.0 ** random.uniform(-6, 6, count), exponent=random.uniform(0, 10, count),
        offset=torque * random.choice([0.0, 1.0 - 1e-6, 1.1], count), mean_torque=torque,
        friction_torque=0.0,
    )  # fmt: skip
    good = np.vectorize(has_numbers)(result["status"])
    for name in ("delta", "omega_max", "omega_min", "omega_mean"):
        np.testing.assert_array_equal(np.isfinite(result[name]), good)
    assert np.all(result["omega_min"][good] <= result["omega_mean"][good] * (1 + 1e-12))
    assert np.all(result["omega_max"][good] >= result["omega_mean"][good] * (1 - 1e-12))
    assert np.all(result["omega_min"][good] > 0.0)
    assert {CONVERGED, STALLED, NO_STEADY_STATE, INVALID_INPUT} <= set(result["status"].tolist())


def test_bad_arguments_are_refused() -> None:
    item = BY_NAME["alpha 2, constant, 1 cyl, power_mean"]
    diagram, inputs = diagram_of(item), inputs_of(item)
    for change in (
        {"inertia": 0.0}, {"bore": -1.0}, {"speed": math.nan}, {"crank_ratio": 1.0},
        {"cylinders": 0}, {"method": "magic"}, {"inertia_model": "elastic"},
        {"closure": "cycle_time", "method": "thesis"}, {"load_offset": math.inf},
        {"reciprocating_mass": -1.0},
    ):  # fmt: skip
        with pytest.raises(ValueError, match=next(iter(change))):
            periodic_speed(diagram, **{**inputs, **change})
