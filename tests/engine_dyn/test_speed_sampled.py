"""The batch solver against the general one: designs with tables of their own, drivers and laws."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from engine_dyn.loads.driven_machine import DrivenMachine
from engine_dyn.loads.torque_curves import torque_over_angle
from engine_dyn.pressure.diagram import diagram_from_points
from engine_dyn.pressure.family import Family, family_from_diagrams
from engine_dyn.speed import dispatch
from engine_dyn.speed.mechanisms import BATCH, counted
from engine_dyn.speed.torque import mean_gas_torque
from engine_dyn.status import CONVERGED, INVALID_INPUT, NO_STEADY_STATE
from oracle.designs import SmoothPressure, table
from tests.support.sampled_designs import sampled_designs, three_loads

pytestmark = pytest.mark.compiled

Inputs = dict[str, Any]

SPEEDS = ("delta", "omega_max", "omega_min", "omega_mean")
COUNT = 200
FINE = {"general": True, "finer": 2, "tolerance": 1e-8}


@pytest.fixture(scope="module")
def family() -> Family:
    return three_loads()


def designs(family: Family, cylinders: int) -> Inputs:
    """Designs that have no table in common."""
    return sampled_designs(family, COUNT, cylinders, seed=11, largest_ratio=0.6, exponent=1.6)


def with_one_table(inputs: Inputs) -> Inputs:
    mean = float(np.median(inputs["mean_torque"]))
    return inputs | {
        "crank_ratio": 0.3, "row": 1.4, "scale": 1.0, "crankcase_pressure": 1e5, "mean_torque": mean
    }  # fmt: skip


def with_offset(inputs: Inputs, largest: float = 0.55) -> Inputs:
    """Of either sign, and one design without; some crank ratios lie beyond all intervals."""
    offset = np.random.default_rng(5).uniform(-largest, largest, COUNT)
    offset[COUNT // 2] = 0.0
    return inputs | {"offset_ratio": offset, "crank_ratio": 0.55 * inputs["crank_ratio"]}


def with_large_crank_ratios(inputs: Inputs) -> Inputs:
    ratios = np.linspace(0.7, 0.95, COUNT)
    return inputs | {"crank_ratio": ratios, "inertia": np.full(COUNT, 5.0) * inputs["cylinders"]}


def with_load_over_angle(inputs: Inputs) -> Inputs:
    """A pump of three pistons, of a size of its own for each design."""
    angle = np.radians(np.arange(0.0, 360.0, 2.0))
    wave = 10.0 * np.abs(np.sin(1.5 * angle)) + 3.0 * np.cos(angle)
    load = torque_over_angle(angle, wave, own_angle=True)
    scale = np.random.default_rng(6).uniform(0.0, 1.5, COUNT)
    scale[3] = 0.0
    return inputs | {
        "driven": DrivenMachine(over_angle=load), "gear_ratio": 2.0, "load_phase": 0.4,
        "load_scale": scale, "offset": 2.0 * scale * load.mean, "speed": 2.0 * inputs["speed"],
    }  # fmt: skip


def with_offset_and_load_over_angle(inputs: Inputs) -> Inputs:
    return with_load_over_angle(with_offset(inputs, 0.1))


def with_motor(inputs: Inputs) -> Inputs:
    random = np.random.default_rng(3)
    return inputs | {
        "driven": DrivenMachine(motor=True), "mean_torque": -inputs["mean_torque"],
        "synchronous_speed": inputs["speed"] * random.uniform(1.02, 1.1, COUNT),
        "breakdown_slip": random.uniform(0.15, 0.5, COUNT),
    }  # fmt: skip


def with_generator(inputs: Inputs) -> Inputs:
    """The motor brakes an engine that turns it faster."""
    random = np.random.default_rng(4)
    return inputs | {
        "driven": DrivenMachine(motor=True), "breakdown_slip": random.uniform(0.15, 0.5, COUNT),
        "synchronous_speed": inputs["speed"] * random.uniform(0.92, 0.98, COUNT),
    }  # fmt: skip


def with_linear_and_square_load(inputs: Inputs) -> Inputs:
    return inputs | {
        "driven": DrivenMachine(load_law="linear_square"), "load_linear": 2.0,
        "load_square": np.random.default_rng(5).uniform(0.0, 0.05, COUNT),
    }  # fmt: skip


def with_motor_and_pump(inputs: Inputs) -> Inputs:
    angle = np.radians(np.arange(0.0, 360.0, 2.0))
    load = torque_over_angle(angle, 5.0 + 3.0 * np.cos(3.0 * angle), own_angle=True)
    return with_motor(inputs) | {
        "driven": DrivenMachine(over_angle=load, motor=True), "gear_ratio": 1.0,
        "load_phase": 0.4, "offset": load.mean,
    }  # fmt: skip


def as_they_are(inputs: Inputs) -> Inputs:
    return inputs


Change = Callable[[Inputs], Inputs]

CASES: list[tuple[Change, dict[str, Any]]] = [
    *((as_they_are, {"exponent": alpha, "closure": closure})
      for alpha in (0.0, 1.0, 1.6, 2.0) for closure in ("power_mean", "cycle_time")),
    *((change, {"exponent": alpha})
      for change in (with_offset, with_load_over_angle, with_offset_and_load_over_angle)
      for alpha in (0.0, 1.6, 2.0)),
    (with_large_crank_ratios, {"exponent": 2.0}),
    (with_motor, {}), (with_motor, {"closure": "cycle_time"}), (with_generator, {}),
    (with_linear_and_square_load, {}), (with_motor_and_pump, {}),
]  # fmt: skip


EACH = [
    (number, cylinders, shared)
    for number, (change, _) in enumerate(CASES)
    for place, (cylinders, shared) in enumerate(((1, False), (4, False), (2, True)))
    if not (shared and change in (with_offset, with_large_crank_ratios))
    and not (change is with_offset_and_load_over_angle and place != number % 3)
]
"""Numbers of cases, numbers of cylinders, and whether the designs share one table.

Of offset and load over the angle together, which takes the general solver longest, each exponent
has one number of cylinders; of either alone, all of them.
"""


def solve(inputs: Inputs, **more: Any) -> Inputs:
    return dispatch.solve(**{"wanted": (*SPEEDS, "load_factor"), **inputs, **more})


def taken(inputs: Inputs, which: Any) -> Inputs:
    return {k: v[which] if isinstance(v, np.ndarray) and v.ndim else v for k, v in inputs.items()}


@pytest.mark.parametrize(("number", "cylinders", "shared"), EACH)
def test_as_the_general_solver(family: Family, number: int, cylinders: int, shared: bool) -> None:
    model = "variable" if (number + cylinders) % 2 else "constant"
    change, choice = CASES[number]
    inputs = designs(family, cylinders)
    inputs = change(with_one_table(inputs) if shared else inputs)
    inputs |= {"inertia_model": model, **choice}
    with counted() as tally:
        many = solve(inputs)
    assert tally.designs[BATCH] >= COUNT
    assert tally.deferred < COUNT / 2
    some = slice(None, None, 12)  # of the designs: the general solver takes long
    known, found = solve(taken(inputs, some), **FINE), taken(many, some)
    good = known["status"] == CONVERGED
    assert good.sum() > 0.5 * good.size and (found["status"][good] == CONVERGED).all()
    for name in (*SPEEDS, "load_factor"):
        np.testing.assert_allclose(found[name][good], known[name][good], rtol=1e-6, err_msg=name)
    np.testing.assert_allclose(found["omega_mean"][good], known["omega_mean"][good], rtol=1e-8)
    # A design does not know its neighbours, nor its thread.
    order = np.random.default_rng(1).permutation(COUNT)[:90]
    part = solve(taken(inputs, order), threads=3)
    for name in (*SPEEDS, "status"):
        np.testing.assert_array_equal(part[name], many[name][order])


@pytest.mark.parametrize("cylinders", [1, 4])
@pytest.mark.parametrize("exponent", [0.0, 1.6, 2.0])
def test_masses_that_leave_hardly_any_inertia_somewhere(
    family: Family, cylinders: int, exponent: float
) -> None:
    """Beyond some mass the variable inertia vanishes at some angle, also of engines that stop."""
    inputs = designs(family, cylinders) | {"inertia_model": "variable", "exponent": exponent}
    random = np.random.default_rng(2)
    # sum v^2 falls below its mean by about half the number of cylinders.
    share = random.uniform(0.0, 2.0, COUNT)
    inputs["mass"] = share * inputs["inertia"] / (0.5 * cylinders * 0.05**2)
    inputs["speed"] = random.uniform(1500.0, 4000.0, COUNT)
    inputs["mean_torque"] = np.where(random.random(COUNT) < 0.2, -1.0, 1.0) * inputs["mean_torque"]
    many, known = (solve(inputs, general=general) for general in (False, True))
    np.testing.assert_array_equal(many["status"], known["status"])
    for status in (CONVERGED, NO_STEADY_STATE, INVALID_INPUT):
        assert (many["status"] == status).sum() > 10, status
    good = many["status"] == CONVERGED
    for name in SPEEDS:
        np.testing.assert_allclose(many[name][good], known[name][good], rtol=1e-6, err_msg=name)


def test_speeds_beyond_the_breakdown_slip_are_deferred(family: Family) -> None:
    """There a motor's torque falls as it slows down, and some machines have no stable speed."""
    inputs = with_motor(designs(family, 1))
    slips = np.linspace(1.0, 0.2, COUNT)  # the nominal slip over the breakdown slip
    inputs["breakdown_slip"] = (1.0 - inputs["speed"] / inputs["synchronous_speed"]) / slips
    inputs["breakdown_slip"][5] = 0.5 * inputs["breakdown_slip"][5]
    inputs["mean_torque"][9] = -inputs["mean_torque"][9]  # drives the motor, which drives too
    with counted() as tally:
        many = solve(inputs)
    some = slice(1, None, 4)  # of the designs, with both that have no stable speed
    known, found = solve(taken(inputs, some), general=True), taken(many, some)
    assert 10 < tally.deferred < COUNT
    np.testing.assert_array_equal(found["status"], known["status"])
    assert (many["status"][[5, 9]] == NO_STEADY_STATE).all()
    for name in SPEEDS:
        np.testing.assert_allclose(found[name], known[name], rtol=1e-6, err_msg=name)


@pytest.mark.parametrize("change", [with_motor, with_linear_and_square_load])
def test_the_error_of_delta_is_covered(family: Family, change: Change) -> None:
    inputs = change(designs(family, 2))
    found = solve(inputs, wanted=("delta", "delta_error"))
    known = solve(inputs, general=True, finer=4, tolerance=1e-9)
    good = (found["status"] == CONVERGED) & (known["status"] == CONVERGED)
    assert good.sum() > 0.7 * COUNT
    error = np.abs(found["delta"] / known["delta"] - 1.0)[good]
    assert (error <= found["delta_error"][good]).all()
    assert np.median(found["delta_error"][good]) < 1e-7


@pytest.mark.parametrize("model", ["constant", "variable"])
def test_curves_over_the_crank_angle_of_a_motor(family: Family, model: str) -> None:
    inputs = with_motor(with_one_table(designs(family, 1))) | {"inertia_model": model}
    inputs |= {
        "wanted": ("omega", "angular_acceleration"), "crank_angle": np.linspace(-6.0, 6.0, 97)
    }  # fmt: skip
    with counted() as tally:
        found = solve(inputs)
    assert tally.designs[BATCH] == COUNT and tally.deferred < COUNT / 2
    known = solve(inputs, **FINE)
    np.testing.assert_allclose(found["omega"], known["omega"], rtol=1e-6)
    scale = np.nanmax(np.abs(known["angular_acceleration"]), axis=-1, keepdims=True)
    difference = (found["angular_acceleration"] - known["angular_acceleration"]) / scale
    assert np.nanmax(np.abs(difference)) < 1e-5


@pytest.mark.quick
@pytest.mark.parametrize("method", ["auto", "newton"])
def test_of_two_valleys_the_deeper_one_counts(method: str) -> None:
    """The lower node lies in the other valley: 3e-7 of the speed would be missed."""
    degrees, bar = table(SmoothPressure(
        charge=1.0, compression=1.0, ratio=14.0, polytropic=1.33,
        burn=40.0, burn_angle=np.radians(10.0), burn_order=120,
        after=6.0, after_angle=np.radians(45.0), after_order=30,
    ))  # fmt: skip
    family = family_from_diagrams([0.0], [diagram_from_points(np.radians(degrees), bar * 1e5)])
    gas = float(mean_gas_torque(0.2571, 0.0, family))
    inputs: Inputs = {
        "family": family, "row": 0.0, "scale": 1.0, "crankcase_pressure": 1e5, "bore": 0.14,
        "double_radius": 0.18, "offset": 0.0, "crank_ratio": 0.2571, "exponent": 2.0,
        "mass": 5.6666666667, "speed": 193.33333333, "inertia": 1.8066586629,
        "friction_torque": 180.0, "cylinders": 6, "inertia_model": "variable",
        "mean_torque": 6.0 * 0.25 * np.pi * 0.14**2 * 0.09 * gas - 180.0,
    }  # fmt: skip
    angles = np.linspace(0.0, 2.0 * np.pi / 3.0, 2401)
    found = solve(inputs, wanted=("omega_min",), method=method)
    curve = solve(inputs, wanted=("omega",), method="newton", finer=4, tolerance=1e-9,
                  crank_angle=angles)["omega"]  # fmt: skip
    assert found["omega_min"].item() == pytest.approx(curve.min(), rel=1e-8)
