"""A motor, and a load a + k (b omega + c omega^2), in the batch solver."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from engine_dyn.loads.driven_machine import DrivenMachine, torque_over_angle
from engine_dyn.loads.laws import Curve, Law, LinearSquare, load_terms
from engine_dyn.pressure.diagram import diagram_from_points
from engine_dyn.pressure.family import Family, family_from_diagrams
from engine_dyn.speed import dispatch
from engine_dyn.speed.batch import rational
from engine_dyn.speed.batch.powers import SERIES_RANGE, SERIES_ROWS
from engine_dyn.speed.batch.state import LANES, LAW_LINEAR, LAW_RISE, LAW_SLOPE, LAW_SQUARE
from engine_dyn.speed.mean_gas import mean_gas_torque
from engine_dyn.speed.mechanisms import GENERAL, OWN_CURVES, SHARED_TABLES, counted
from engine_dyn.status import CONVERGED, NO_STEADY_STATE
from oracle.designs import table
from tests.support.held_out import BAR, design_of

Inputs = dict[str, Any]

SPEEDS = ("delta", "omega_max", "omega_min", "omega_mean")
COUNT = 200
NO_TABLE = np.zeros((3, 0))


def python(function: Any) -> Callable[..., Any]:
    """Return a formula as plain Python, with or without the compiler."""
    found: Callable[..., Any] = getattr(function, "py_func", function)
    return found


# --- the law -------------------------------------------------------------------------------------

MOTORS = [(150.0, 157.0, 0.16), (150.0, 150.3, 0.3), (150.0, 144.0, 0.1), (150.0, 180.0, 0.25)]


def numbers_and_laws() -> list[tuple[tuple[float, ...], Law]]:
    """Numbers a, n, m and l of a law, and the same law as the general solver has it."""
    found: list[tuple[tuple[float, ...], Law]] = []
    for speed, synchronous, slip in MOTORS:
        numbers = python(rational.motor_numbers)(speed, synchronous, slip)
        ratio = (1.0 - speed / synchronous) / slip
        law = Curve(speed, 0.5 * (ratio + 1.0 / ratio), synchronous, slip, NO_TABLE)
        found.append((numbers, law))
    for linear, square in ((3.0, 0.0), (3.0, 0.01), (0.0, 0.2)):
        weight = linear / (linear + 150.0 * square)
        numbers = python(rational.linear_square_numbers)(150.0, linear, square)
        found.append((numbers, LinearSquare(weight)))
    return found


@pytest.mark.quick
@pytest.mark.parametrize(("numbers", "law"), numbers_and_laws())
def test_numbers_are_those_of_the_law(numbers: tuple[float, ...], law: Law) -> None:
    """F - 1 - a u, its slope and its first terms; of a driver with the other sign."""
    a, n, m, square = numbers
    _, first, second = load_terms(1.0, law)
    sign = math.copysign(1.0, first)
    assert a > 0.0 and a == pytest.approx(sign * first, rel=1e-12)
    state, coefficients = np.zeros(LAW_SQUARE + LANES), np.zeros(SERIES_ROWS)
    for row, number in zip((LAW_SLOPE, LAW_RISE, LAW_LINEAR, LAW_SQUARE), numbers, strict=True):
        state[row] = number
    rational.fill_rational(1, state, coefficients)
    for u in np.linspace(-SERIES_RANGE, SERIES_RANGE, 41):
        value, slope, _ = load_terms(1.0 + u, law)
        expected = sign * (value - 1.0) - a * u
        e = math.sqrt(1.0 + u) - 1.0
        assert python(rational.remainder_over_speed)(e, 0, coefficients) == pytest.approx(
            expected, abs=1e-13 * a
        )
        assert python(rational.rational_remainder)(u, 0, coefficients) == pytest.approx(
            expected, abs=2e-9 * a
        )
        ratio = python(rational.slope_over_nominal)(e, n, m, square)
        assert a * ratio == pytest.approx(sign * slope, rel=1e-9, abs=1e-12 * a)
        assert python(rational.keeps_its_sense)(min(u, 0.0), max(u, 0.0), 0, state) == (ratio > 0.0)
        assert python(rational.rational_slope)(u, a, 0.1, 0, coefficients) == pytest.approx(
            sign * slope - 1.1 * a, abs=1e-7 * a
        )
    b2, b3, b4 = python(rational.terms_of_rational)(n, m, square)
    assert 2.0 * b2 == pytest.approx(second / first, abs=1e-9)
    # In fifth order, the difference to both sides of 1 has no even term, and the sum no odd one.
    u = 1e-2
    above, below = (sign * (load_terms(1.0 + s * u, law)[0] - 1.0) / a for s in (1.0, -1.0))
    assert (above - below) / 2.0 == pytest.approx(u + b3 * u**3, abs=1e4 * u**5)
    assert (above + below) / 2.0 == pytest.approx(b2 * u**2 + b4 * u**4, abs=1e5 * u**6)


# --- designs -------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def family() -> Family:
    degrees, bar = table(design_of("alpha 1, constant, 1 cyl, power_mean").pressure)
    return family_from_diagrams([10.0], [diagram_from_points(np.radians(degrees), bar * BAR)])


def engines(family: Family, cylinders: int, shared: bool) -> Inputs:
    """Designs with a torque that is not that of the load yet; `shared` ones have one table."""
    random = np.random.default_rng(11)
    ratio = 0.3 if shared else random.uniform(0.1, 0.4, COUNT)
    lever = 0.25 * np.pi * 0.1**2 * 0.05
    return {
        "family": family, "crank_ratio": ratio, "row": 0.0, "cylinders": cylinders, "bore": 0.1,
        "scale": 1.0, "double_radius": 0.1, "friction_torque": 0.0, "exponent": 1.0,
        "crankcase_pressure": 1e5, "offset": random.uniform(0.0, 3.0, COUNT),
        "mass": random.uniform(0.3, 1.0, COUNT), "speed": random.uniform(150.0, 300.0, COUNT),
        "inertia": cylinders * random.uniform(0.6, 3.0, COUNT),
        "mean_torque": 0.8 * cylinders * lever * mean_gas_torque(ratio, 0.0, family),
    }  # fmt: skip


def motor(inputs: Inputs) -> Inputs:
    random = np.random.default_rng(3)
    return inputs | {
        "driven": DrivenMachine(motor=True), "mean_torque": -inputs["mean_torque"],
        "synchronous_speed": inputs["speed"] * random.uniform(1.02, 1.1, COUNT),
        "breakdown_slip": random.uniform(0.15, 0.5, COUNT),
    }  # fmt: skip


def generator(inputs: Inputs) -> Inputs:
    """The motor brakes an engine that turns it faster."""
    random = np.random.default_rng(4)
    return inputs | {
        "driven": DrivenMachine(motor=True), "breakdown_slip": random.uniform(0.15, 0.5, COUNT),
        "synchronous_speed": inputs["speed"] * random.uniform(0.92, 0.98, COUNT),
    }  # fmt: skip


def linear_square(inputs: Inputs) -> Inputs:
    random = np.random.default_rng(5)
    return inputs | {
        "driven": DrivenMachine(load_law="linear_square"), "load_linear": 2.0,
        "load_square": random.uniform(0.0, 0.05, COUNT),
    }  # fmt: skip


def pumping(inputs: Inputs) -> Inputs:
    """A motor drives the machine, which drives a pump of three pistons too."""
    angle = np.radians(np.arange(0.0, 360.0, 2.0))
    wave = 5.0 + 3.0 * np.cos(3.0 * angle)
    load = torque_over_angle(angle, wave, own_angle=True)
    found = motor(inputs)
    return found | {
        "driven": DrivenMachine(over_angle=load, motor=True), "gear_ratio": 1.0,
        "load_phase": 0.4, "offset": found["offset"] + load.mean,
    }  # fmt: skip


def solve(inputs: Inputs, **more: Any) -> Inputs:
    return dispatch.solve(**{"wanted": SPEEDS, **inputs, **more})


CASES = {
    "motor": motor, "generator": generator, "linear and square": linear_square, "pump": pumping
}  # fmt: skip


@pytest.mark.compiled
@pytest.mark.parametrize("model", ["constant", "variable"])
@pytest.mark.parametrize(
    ("cylinders", "shared"),
    [(1, False), (4, False), (2, True)],
    ids=["own curves", "four cylinders", "shared tables"],
)
@pytest.mark.parametrize("case", CASES)
def test_as_the_general_solver(
    family: Family, case: str, cylinders: int, shared: bool, model: str
) -> None:
    inputs = CASES[case](engines(family, cylinders, shared)) | {"inertia_model": model}
    with counted() as tally:
        many = solve(inputs)
    # Tables do not contain a load over angle.
    assert tally.designs[SHARED_TABLES if shared and case != "pump" else OWN_CURVES] == COUNT
    assert tally.deferred < COUNT / 2
    known = solve(inputs, general=True, finer=2, tolerance=1e-8)
    good = known["status"] == CONVERGED
    assert good.sum() > 0.7 * COUNT and (many["status"][good] == CONVERGED).all()
    for name in SPEEDS:
        np.testing.assert_allclose(many[name][good], known[name][good], rtol=1e-6, err_msg=name)
    np.testing.assert_allclose(many["omega_mean"][good], known["omega_mean"][good], rtol=1e-8)
    # A design does not know its neighbours, nor its thread.
    order = np.random.default_rng(1).permutation(COUNT)[:90]
    taken = {k: v[order] if isinstance(v, np.ndarray) and v.ndim else v for k, v in inputs.items()}
    sharing = (1, COUNT) if shared else (COUNT, 1)
    part = solve(taken, sharing=sharing, threads=3)
    for name in (*SPEEDS, "status"):
        np.testing.assert_array_equal(part[name], many[name][order])


@pytest.mark.compiled
def test_speeds_beyond_the_breakdown_slip_are_deferred(family: Family) -> None:
    """There a motor's torque falls as it slows down, and some machines have no stable speed."""
    inputs = motor(engines(family, 1, False))
    slips = np.linspace(1.0, 0.2, COUNT)  # the nominal slip over the breakdown slip
    inputs["breakdown_slip"] = (1.0 - inputs["speed"] / inputs["synchronous_speed"]) / slips
    inputs["breakdown_slip"][5] = 0.5 * inputs["breakdown_slip"][5]
    inputs["mean_torque"][9] = -inputs["mean_torque"][9]  # drives the motor, which drives too
    with counted() as tally:
        many = solve(inputs)
    known = solve(inputs, general=True)
    assert 10 < tally.deferred < COUNT
    np.testing.assert_array_equal(many["status"], known["status"])
    assert (many["status"][[5, 9]] == NO_STEADY_STATE).all()
    for name in SPEEDS:
        np.testing.assert_allclose(many[name], known[name], rtol=1e-6, err_msg=name)


@pytest.mark.compiled
@pytest.mark.parametrize("case", ["motor", "linear and square"])
def test_the_error_of_delta_is_covered(family: Family, case: str) -> None:
    inputs = CASES[case](engines(family, 2, False))
    found = solve(inputs, wanted=("delta", "delta_error"))
    known = solve(inputs, general=True, finer=4, tolerance=1e-9)
    good = (found["status"] == CONVERGED) & (known["status"] == CONVERGED)
    assert good.sum() > 0.7 * COUNT
    error = np.abs(found["delta"] / known["delta"] - 1.0)[good]
    assert (error <= found["delta_error"][good]).all()
    assert np.median(found["delta_error"][good]) < 1e-7


@pytest.mark.compiled
@pytest.mark.parametrize("model", ["constant", "variable"])
def test_curves_over_the_crank_angle(family: Family, model: str) -> None:
    inputs = motor(engines(family, 1, True)) | {"inertia_model": model}
    curves = {
        "wanted": ("omega", "angular_acceleration"),
        "crank_angle": np.linspace(-6.0, 6.0, 97),
    }
    with counted() as tally:
        found = solve(inputs, **curves)
    assert tally.designs[SHARED_TABLES] == COUNT and tally.deferred < COUNT / 2
    known = solve(inputs, general=True, finer=2, tolerance=1e-8, **curves)
    np.testing.assert_allclose(found["omega"], known["omega"], rtol=1e-6)
    scale = np.nanmax(np.abs(known["angular_acceleration"]), axis=-1, keepdims=True)
    difference = (found["angular_acceleration"] - known["angular_acceleration"]) / scale
    assert np.nanmax(np.abs(difference)) < 1e-5


@pytest.mark.compiled
@pytest.mark.parametrize("exponent", [1.0, 2.0])
def test_one_part_of_the_load_is_a_power(family: Family, exponent: float) -> None:
    inputs = engines(family, 2, False) | {"inertia_model": "variable"}
    power = solve(inputs, exponent=exponent)
    name = "load_linear" if exponent == 1.0 else "load_square"
    law = {"driven": DrivenMachine(load_law="linear_square"), name: 0.3}
    found = solve(inputs, **law)
    for speed in SPEEDS:
        np.testing.assert_allclose(found[speed], power[speed], rtol=2e-8)


@pytest.mark.compiled
def test_the_cycle_time_of_a_motor_is_left_to_the_general_solver(family: Family) -> None:
    inputs = motor(engines(family, 1, False)) | {"closure": "cycle_time"}
    with counted() as tally:
        solve(inputs)
    assert dict(tally.designs) == {GENERAL: COUNT}
