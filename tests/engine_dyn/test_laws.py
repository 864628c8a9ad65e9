"""A motor, and a load a + k (b omega + c omega^2), in the batch solver."""

import math
from typing import Any

import numpy as np
import pytest

from engine_dyn.loads import laws
from engine_dyn.loads.driven_machine import DrivenMachine, torque_over_angle
from engine_dyn.pressure.diagram import diagram_from_points
from engine_dyn.pressure.family import Family, family_from_diagrams
from engine_dyn.speed import dispatch
from engine_dyn.speed.batch import block
from engine_dyn.speed.batch.law_polynomial import fit_laws
from engine_dyn.speed.designs import Designs
from engine_dyn.speed.mean_gas import mean_gas_torque
from engine_dyn.speed.mechanisms import BATCH, counted
from engine_dyn.speed.methods import CYCLE_TIME, POWER_MEAN
from engine_dyn.speed.vectors import new_rows
from engine_dyn.status import CONVERGED, NO_STEADY_STATE
from engine_dyn.types import Floats
from oracle.designs import table
from tests.support.held_out import BAR, design_of

Inputs = dict[str, Any]

SPEEDS = ("delta", "omega_max", "omega_min", "omega_mean")
COUNT = 200
NO_TABLE = np.zeros((3, 0))

MOTORS = [(150.0, 157.0, 0.16), (150.0, 150.3, 0.3), (150.0, 144.0, 0.1), (150.0, 180.0, 0.25)]

NUMBERS = [
    *((laws.MOTOR, -1.0, *numbers) for numbers in MOTORS),
    *((laws.LINEAR_SQUARE, 1.0, 150.0, *pair) for pair in ((3.0, 0.0), (3.0, 0.01), (0.0, 0.2))),
    *((laws.POWER, 1.0, 150.0, alpha, 0.0) for alpha in (0.5, 1.0, 3.0, 12.0)),
]


def polynomial(
    form: laws.Form, speed: float, first: float, second: float, closure: int, low: float,
    high: float, flat: bool,
) -> tuple[int, float, float, Floats]:  # fmt: skip
    """Polynomial of one lane of a block whose others are done: terms, centre, 1/half, numbers."""
    lane = 3
    lanes = block.Lanes(*(new_rows(1) for _ in block.Lanes._fields))
    lanes.state[0, lane], lanes.free[0, lane] = block.SOLVING, 0.0 if flat else 1.0
    lanes.low[0, lane], lanes.high[0, lane] = low, high
    designs = Designs(*(new_rows(1) for _ in Designs._fields))._replace(
        speed=new_rows(1) + speed, first=new_rows(1) + first, second=new_rows(1) + second,
        gear=new_rows(1) + 1.0,
    )  # fmt: skip
    law, values = new_rows(block.MOST_TERMS), new_rows(block.MOST_TERMS)
    count = fit_laws(0, closure, form, designs, lanes, law, values)
    assert (lanes.state[0, lane] == block.SOLVING) == (count > 0)
    assert not np.delete(law, lane, axis=1).any()
    return count, float(lanes.centre[0, lane]), float(lanes.half[0, lane]), np.array(law[:, lane])


@pytest.mark.quick
@pytest.mark.parametrize(("kind", "sign", "speed", "first", "second"), NUMBERS)
def test_a_polynomial_stands_for_every_law(
    kind: int, sign: float, speed: float, first: float, second: float
) -> None:
    """Within its range it is as good as it says, or there is none."""
    form = laws.Form(kind, sign, False, NO_TABLE)
    law, _ = laws.law_of(speed, first, second, 1.0, form)
    for low, high in ((-1e-4, 2e-4), (-0.05, 0.06), (-0.3, 0.4)):
        count, centre, half, terms = polynomial(
            form, speed, first, second, POWER_MEAN, low, high, flat=False
        )
        if count == 0:
            assert high > 0.1  # where a motor's torque turns back
            continue
        u = np.linspace(low, high, 101)
        exact = np.array([laws.load_terms(1.0 + one, law)[0] - 1.0 for one in u])
        found = np.polynomial.polynomial.polyval((u - centre) * half, terms)
        assert np.abs(found - exact).max() <= 1e-9 * np.ptp(exact) + 1e-14
        assert not terms[count:].any()


@pytest.mark.quick
@pytest.mark.parametrize("closure", [POWER_MEAN, CYCLE_TIME])
def test_a_law_without_slope_is_that_of_the_closure(closure: int) -> None:
    form = laws.Form(laws.POWER, 1.0, False, NO_TABLE)
    _, centre, half, terms = polynomial(form, 150.0, 0.0, 0.0, closure, -0.1, 0.1, flat=True)
    for u in (-0.1, -0.01, 0.0, 0.1):
        found = np.polynomial.polynomial.polyval((u - centre) * half, terms)
        exact = math.log1p(u) if closure == POWER_MEAN else 2.0 - 2.0 / math.sqrt(1.0 + u)
        assert found == pytest.approx(exact, abs=1e-10)


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
    assert tally.designs[BATCH] >= COUNT
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
    part = solve(taken, threads=3)
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
    assert tally.designs[BATCH] == COUNT and tally.deferred < COUNT / 2
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
def test_the_cycle_time_of_a_motor(family: Family) -> None:
    inputs = motor(engines(family, 1, False)) | {"closure": "cycle_time"}
    wanted = (*SPEEDS, "load_factor")
    with counted() as tally:
        found = solve(inputs, wanted=wanted)
    assert tally.deferred < COUNT / 2
    known = solve(inputs, wanted=wanted, general=True, finer=2, tolerance=1e-8)
    good = (known["status"] == CONVERGED) & (found["status"] == CONVERGED)
    assert good.sum() > 0.7 * COUNT
    for name in wanted:
        np.testing.assert_allclose(found[name][good], known[name][good], rtol=1e-6, err_msg=name)
