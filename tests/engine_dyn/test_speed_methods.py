"""Methods of the periodic speed: one answer, orders observed, closures, outcomes at the edges."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from engine_dyn.loads.laws import POWER, Form, law_of
from engine_dyn.speed import dispatch
from engine_dyn.speed.fields import CYCLE_TIME, POWER_MEAN
from engine_dyn.speed.general.newton import Design, make_motion, newton
from engine_dyn.speed.torque import torque_extremes
from engine_dyn.status import (
    CONVERGED,
    INVALID_INPUT,
    NO_STEADY_STATE,
    NOT_CONVERGED,
    PASSES_DONE,
    STALLED,
    TOLERANCE_NOT_MET,
)
from oracle import golden
from oracle.thesis import euler
from tests.support.held_out import design_of, family_of, inputs_of, items, solved

compiled = pytest.mark.compiled

CYCLE = 4.0 * np.pi
SINGLE = "alpha 2, constant, 1 cyl, power_mean"


def smooth(nodes: int, variable: bool = False) -> tuple[Any, ...]:
    """Return w, w', tau, tau' at the nodes of a period of 2 pi."""
    phi = np.arange(nodes) * (2.0 * np.pi / nodes)
    w = 0.5 * np.sin(phi) + 0.1 * np.cos(2.0 * phi)
    dw = 0.5 * np.cos(phi) - 0.2 * np.sin(2.0 * phi)
    tau = 1.0 + variable * 0.2 * np.cos(phi)
    return w, dw, tau, -variable * 0.2 * np.sin(phi)


def by_newton(
    nodes: int, half: float, closure: int = POWER_MEAN, kappa: float = 2.0, variable: bool = False
) -> tuple[int, float, Any]:
    """Return steps, mu and q at the nodes."""
    w, dw, tau, dtau = smooth(nodes, variable)
    motion = make_motion(nodes)
    for array, values in zip(motion[:4], (w, dw, tau, dtau), strict=True):
        array[:] = values
    law, _ = law_of(1.0, 2.0 * half, 0.0, 1.0, Form(POWER, 1.0, False, np.zeros((3, 0))))
    design = Design(0.0, kappa, law, half, half == 0.0, 1.0)
    steps, mu, _ = newton(closure, 2.0 * np.pi / nodes, design, motion)
    return steps, mu, (1.0 + motion.d) / tau


@pytest.mark.parametrize("variable", [False, True])
@pytest.mark.parametrize("closure", [POWER_MEAN, CYCLE_TIME])
@pytest.mark.parametrize("half", [0.25, 1.0, 1.5])
def test_two_point_formula_is_of_fourth_order(half: float, closure: int, variable: bool) -> None:
    steps, mu, exact = by_newton(192, half, closure, variable=variable)
    assert steps > 0
    misses = []
    for nodes in (12, 24, 48):
        _, coarse_mu, coarse = by_newton(nodes, half, closure, variable=variable)
        misses.append(np.abs(coarse - exact[:: 192 // nodes]).max() + abs(coarse_mu - mu))
    # Halving the step divides the miss by 16, at least once the shape is resolved.
    assert misses[0] / misses[1] > 8.0
    assert misses[1] / misses[2] > 13.0


@compiled
@pytest.mark.parametrize("kappa", [1e-6, 0.01, 1.0, 30.0, 1000.0])
@pytest.mark.parametrize("half", [0.15, 0.5, 1.0, 2.0, 6.0])
def test_newton_finds_it_from_weak_to_overwhelming_loads(half: float, kappa: float) -> None:
    for closure in (POWER_MEAN, CYCLE_TIME):
        steps, _, q = by_newton(512, half, closure, kappa)
        assert steps > 0
        assert q.min() > 0.0
        closed = np.mean(q**half) if closure == POWER_MEAN else np.mean(q**-0.5)
        assert closed == pytest.approx(1.0, abs=1e-10)


@compiled
@pytest.mark.parametrize("model", ["constant", "variable"])
@pytest.mark.parametrize("exponent", [0.0, 0.5, 1.0, 1.6, 2.0, 3.0])
def test_all_methods_are_one_solution(exponent: float, model: str) -> None:
    design = replace(
        design_of("alpha 1, constant, 3 cyl, power_mean"),
        load_exponent=exponent, inertia_model=model,
    )  # fmt: skip
    auto = solved(design)
    methods = ["newton"] + (["closed"] if exponent in (0.0, 2.0) else [])
    for method in methods:
        found = solved(design, method=method)
        assert found.status == CONVERGED, method
        for name in ("delta", "omega_max", "omega_min", "omega_mean", "load_coefficient"):
            assert getattr(found, name) == pytest.approx(getattr(auto, name), rel=1e-7), name


@compiled
@pytest.mark.parametrize("degrees", [-180.0, 0.0, 37.0, 360.0, -360.0])
@pytest.mark.parametrize(
    ("exponent", "offset", "count"), [(2.0, 0.0, 1), (1.0, -20.0, 3), (0.0, 5.0, 2), (1.6, 0.0, 4)]
)
def test_thesis_method_from_any_start(
    exponent: float, offset: float, count: int, degrees: float
) -> None:
    """Sample by sample the Euler in plain Python; firing angles fall on the points."""
    design = replace(design_of(SINGLE), load_exponent=exponent, load_offset=offset, cylinders=count)
    plain = euler(design, passes=2, start_speed=1.01 * design.omega_n, start_degrees=degrees)
    found = solved(
        design, method="thesis", passes=2, start_speed=1.01 * design.omega_n,
        start_angle=np.radians(degrees), crank_angle=np.radians(plain.degrees),
    )  # fmt: skip
    assert found.status == PASSES_DONE and found.iterations == 2
    np.testing.assert_allclose(found.omega, plain.omega, rtol=1e-11)
    for name in ("omega_max", "omega_min", "omega_mean", "delta"):
        assert getattr(found, name) == pytest.approx(getattr(plain, name), rel=1e-9)


@compiled
def test_error_of_the_thesis_method_is_reported() -> None:
    design = design_of(SINGLE)
    exact = solved(design).delta
    found = solved(design, method="thesis", passes=1)
    assert found.delta_error == pytest.approx(abs(found.delta / exact - 1.0), abs=1e-6)
    assert found.delta_error > 1e-4


@compiled
@pytest.mark.parametrize("count", [1, 4])
def test_euler_climbs_under_a_constant_load(count: int) -> None:
    """Exponent 0: nothing opposes the energy that every step adds."""
    design = replace(design_of(SINGLE), load_exponent=0.0, cylinders=count)
    means = [solved(design, method="thesis", passes=n).omega_mean for n in (1, 100, 300)]
    assert means[1] - means[0] > 1e-6 * design.omega_n
    # Twice as many further cycles, about twice the climb.
    assert (means[2] - means[0]) / (means[1] - means[0]) == pytest.approx(299.0 / 99.0, rel=0.2)
    assert solved(design, method="thesis").status in (NOT_CONVERGED, TOLERANCE_NOT_MET)


@compiled
@pytest.mark.parametrize("method", ["auto", "newton"])
@pytest.mark.parametrize("model", ["constant", "variable"])
@pytest.mark.parametrize("exponent", [0.0, 0.3, 1.0, 2.0, 5.0])
def test_closures(exponent: float, model: str, method: str) -> None:
    design = replace(
        design_of("strong, alpha 1, constant, power_mean"),
        load_exponent=exponent, inertia_model=model,
    )  # fmt: skip
    angles = np.arange(2880) * (CYCLE / 2880)
    for closure in ("power_mean", "cycle_time"):
        found = solved(design, method=method, closure=closure, crank_angle=angles)
        assert found.status == CONVERGED
        if closure == "cycle_time":
            mean = 1.0 / np.mean(1.0 / found.omega)
        elif exponent == 0.0:
            mean = np.exp(np.mean(np.log(found.omega)))
        else:
            mean = np.mean(found.omega**exponent) ** (1.0 / exponent)
        assert mean == pytest.approx(design.omega_n, rel=1e-8)
        assert np.mean(found.omega) == pytest.approx(found.omega_mean, rel=1e-8)
        # The load takes up what the engine gives.
        load = found.load_coefficient * np.mean(found.omega**exponent)
        assert load + design.load_offset == pytest.approx(found.torque_mean, rel=1e-7)
        assert found.omega.max() <= found.omega_max * (1.0 + 1e-9)
        assert found.omega.min() >= found.omega_min * (1.0 - 1e-9)


@compiled
@pytest.mark.parametrize("closure", ["power_mean", "cycle_time"])
@pytest.mark.parametrize("model", ["constant", "variable"])
def test_small_exponents_tend_to_the_constant_load(model: str, closure: str) -> None:
    """The power mean of order alpha is above the geometric one by alpha/2 var(log omega)."""
    design = replace(design_of(SINGLE), inertia_model=model, closure=closure)
    limit = solved(design, load_exponent=0.0)
    for exponent in (1e-15, 1e-12, 1e-10, 1e-9, 1e-8, 1.1e-8, 5e-8, 5.1e-8, 1e-7, 1e-5, 1e-3):
        found = solved(design, load_exponent=exponent)
        assert found.status == CONVERGED
        assert found.omega_mean == pytest.approx(limit.omega_mean, rel=0.1 * exponent + 1e-7)
        assert found.delta == pytest.approx(limit.delta, rel=exponent + 1e-7)


@compiled
@pytest.mark.parametrize("exponent", [20.0, 100.0, 300.0])
def test_large_exponents(exponent: float) -> None:
    design = design_of(SINGLE)
    found = solved(design, load_exponent=exponent)
    # The estimate of the error is cautious: at an exponent of 300 it is a few times the tolerance.
    assert found.status in (CONVERGED, TOLERANCE_NOT_MET) and found.delta_error < 1e-5
    # The stiffer the load, the less the speed may vary; the largest speed tends to the nominal.
    assert found.delta < solved(design, load_exponent=2.0).delta
    assert found.omega_max == pytest.approx(design.omega_n, rel=0.1)


@compiled
@pytest.mark.parametrize("name", [n for n, item in items().items() if item.exact])
def test_no_load(name: str) -> None:
    """The offset takes all: k is zero, and the closure fixes the speed."""
    design, known = design_of(name), golden.read()[name]
    offset = solved(design).torque_mean
    found = solved(design, load_offset=offset)
    assert found.status == CONVERGED
    assert found.load_coefficient == 0.0
    for quantity in ("delta", "omega_max", "omega_min", "omega_mean"):
        assert getattr(found, quantity) == pytest.approx(known[quantity], rel=1e-6)


@compiled
@pytest.mark.parametrize("method", ["auto", "newton", "thesis"])
@pytest.mark.parametrize("exponent", [0.0, 1.0, 1.6, 2.0])
def test_mean_torque_below_the_offset(exponent: float, method: str) -> None:
    design = replace(design_of(SINGLE), load_exponent=exponent)
    inputs = inputs_of(design, family_of(design))
    inputs.pop("closure")
    extremes = {k: v for k, v in inputs.items() if k not in (
        "inertia", "exponent", "offset", "mean_torque", "inertia_model")}  # fmt: skip
    span = torque_extremes(wanted=("torque_max", "torque_min"), **extremes)
    span = float(span["torque_max"] - span["torque_min"])
    for excess, status in ((2e-9, NO_STEADY_STATE), (0.1, NO_STEADY_STATE), (0.5e-9, None)):
        inputs["offset"] = inputs["mean_torque"] + excess * span
        passes = {"passes": 3.0} if method == "thesis" else {}
        found = dispatch.solve(wanted=("delta",), method=method, **inputs, **passes)
        if status is None:
            assert int(found["status"]) in (CONVERGED, PASSES_DONE)
            assert np.isfinite(found["delta"])
        else:
            assert int(found["status"]) == status
            assert np.isnan(found["delta"])


@compiled
@pytest.mark.parametrize("method", ["auto", "newton", "closed", "thesis"])
def test_stall(method: str) -> None:
    found = solved(design_of("stalled, alpha 2, constant"), method=method)
    assert found.status == STALLED
    for quantity in ("delta", "omega_max", "omega_min", "omega_mean", "delta_error"):
        assert math.isnan(getattr(found, quantity))


@compiled
@pytest.mark.parametrize("method", ["auto", "newton", "thesis"])
def test_vanishing_inertia_is_invalid(method: str) -> None:
    design = design_of("inertia vanishes, 1 cyl")
    assert solved(design, method=method, closure="power_mean").status == INVALID_INPUT
    constant = replace(design, inertia_model="constant")
    assert solved(constant, method=method).status != INVALID_INPUT


@compiled
@pytest.mark.parametrize(
    "bad",
    [
        {"tolerance": 0.0}, {"load_exponent": -1.0}, {"speed": 0.0},
        {"crankcase_pressure": -1.0}, {"cylinders": 1.5},
        {"closure": "cycle_time", "method": "thesis"}, {"method": "Auto"}, {"crank_ratio": 0.0},
        {"passes": 0}, {"passes": -1}, {"passes": 1.5}, {"start_speed": -1.0},
        {"inertia": 0.0}, {"bore": -1.0}, {"crank_ratio": 1.0}, {"cylinders": 0},
        {"inertia_model": "elastic"}, {"reciprocating_mass": -1.0},
    ],
    ids=str,
)  # fmt: skip
def test_bad_values_are_refused(bad: dict[str, Any]) -> None:
    with pytest.raises(ValueError, match=next(iter(bad))) as caught:
        solved(design_of(SINGLE), **bad)
    assert "\n" not in str(caught.value)
