"""Sweeps through the kernels: shapes, independence to the bit, energy balance, every outcome."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from engine_dyn.speed import dispatch
from engine_dyn.speed.fields import CLOSURES, INERTIA_MODELS, METHOD_NAMES, SCALAR_NAMES
from engine_dyn.speed.torque import mean_gas_torque
from engine_dyn.status import (
    CONVERGED,
    MEANINGS,
    NOT_CONVERGED,
    STALLED,
    TOLERANCE_NOT_MET,
    has_numbers,
)
from oracle import golden
from oracle.solution import Design
from tests.support.held_out import design_of, family_of, inputs_of, items
from tests.support.sampled_designs import three_loads

pytestmark = pytest.mark.compiled

NAME = "alpha 1, constant, 1 cyl, power_mean"
CURVES = ("omega", "angular_acceleration")
WANTED = (*SCALAR_NAMES, *CURVES)
ANGLES = np.radians(np.arange(-360.0, 360.0, 30.0))


@pytest.fixture(scope="module")
def design() -> Design:
    return design_of(NAME)


@pytest.fixture(scope="module")
def inputs(design: Design) -> dict[str, Any]:
    """With three diagrams, for a product with rows."""
    return inputs_of(design, three_loads())


SCALARS = tuple(name for name in SCALAR_NAMES if name != "iterations")
ASKED: dict[str, dict[str, Any]] = {
    "curves": {"wanted": WANTED, "crank_angle": ANGLES},
    "numbers only": {"wanted": SCALARS},
}
"""Curves make another way through the kernels than numbers alone."""


def solve(inputs: dict[str, Any], **changes: Any) -> dict[str, Any]:
    return dispatch.solve(**{**ASKED["curves"], **inputs, **changes})


def same(one: dict[str, Any], other: dict[str, Any]) -> None:
    assert one.keys() == other.keys()
    for name in one:
        np.testing.assert_array_equal(one[name], other[name], err_msg=name)


PRODUCT: dict[str, tuple[int, list[Any]]] = {
    # axis of the product, values
    "inertia": (0, [0.02, 0.1, 0.3, 0.9, 2.7, 8.1, 30.0]),
    "crank_ratio": (1, [0.2, 0.31]),
    "row": (2, [0.0, 1.25, 4.0]),
    "exponent": (3, [0.0, 1.0, 1.6, 2.0, 1.6001]),
    "cylinders": (4, [1, 7, 4, 11]),
    "inertia_model": (5, ["constant", "variable"]),
}


def product(order: tuple[int, ...] = (0, 1, 2, 3, 4, 5)) -> dict[str, Any]:
    """Arguments with one axis each, at the places that `order` gives."""
    found = {}
    for name, (axis, values) in PRODUCT.items():
        shape = [1] * len(PRODUCT)
        shape[order[axis]] = len(values)
        found[name] = np.array(values).reshape(shape)
    return found


@pytest.fixture(scope="module", params=ASKED)
def asked(request: pytest.FixtureRequest) -> dict[str, Any]:
    return ASKED[request.param]


@pytest.fixture(scope="module")
def whole(inputs: dict[str, Any], asked: dict[str, Any]) -> dict[str, Any]:
    return dispatch.solve(**asked, **{**inputs, **product()}, threads=2)


def test_threads_do_not_matter(
    whole: dict[str, Any], inputs: dict[str, Any], asked: dict[str, Any]
) -> None:
    for threads in (1, 5):
        same(dispatch.solve(**asked, **{**inputs, **product()}, threads=threads), whole)


def test_neighbours_do_not_matter(
    whole: dict[str, Any], inputs: dict[str, Any], asked: dict[str, Any]
) -> None:
    """Any design alone, or in any company, gives the same bits."""
    random = np.random.default_rng(7)
    shape = whole["status"].shape
    arguments = product()
    for _ in range(40):
        index = tuple(int(random.integers(n)) for n in shape)
        alone = {
            name: arguments[name].reshape(-1)[index[axis]] for name, (axis, _) in PRODUCT.items()
        }
        found = dispatch.solve(**asked, **{**inputs, **alone})
        for name, array in whole.items():
            np.testing.assert_array_equal(found[name], array[index], err_msg=f"{name} {index}")
    # All of them as unrelated designs of one axis, in a random order.
    picks = random.permutation(np.prod(shape))[:300]
    places = np.unravel_index(picks, shape)
    column = {
        name: arguments[name].reshape(-1)[places[axis]] for name, (axis, _) in PRODUCT.items()
    }
    found = dispatch.solve(**asked, **{**inputs, **column})
    for name, array in whole.items():
        np.testing.assert_array_equal(found[name], array[places], err_msg=name)


def test_broadcasting_and_scalars(inputs: dict[str, Any]) -> None:
    one = solve(inputs)
    assert one["delta"].shape == () and one["omega"].shape == ANGLES.shape
    two = solve(inputs, inertia=np.array([[0.4, 0.8, 1.2]]), speed=np.array([[100.0], [200.0]]))
    assert two["delta"].shape == (2, 3) and two["status"].dtype == np.int8
    assert solve(inputs, inertia=np.array([0.4]))["delta"].shape == (1,)
    only = dispatch.solve(wanted=("omega_max",), **inputs)
    assert set(only) == {"omega_max", "status"}
    assert float(only["omega_max"]) == pytest.approx(float(one["omega_max"]), rel=1e-8)
    # Nothing but the status.
    assert set(dispatch.solve(wanted=(), **inputs)) == {"status"}


@pytest.mark.parametrize("name", [n for n in items() if n.startswith(("strong", "all but"))])
def test_tight_tolerances_are_met_by_more_nodes(name: str) -> None:
    design = design_of(name)
    known = golden.read()[name]
    inputs = inputs_of(design, family_of(design, 0.25))
    tight = dispatch.solve(wanted=SCALAR_NAMES, tolerance=1e-9, **inputs)
    if known["status"] == "stalled":
        assert int(tight["status"]) == STALLED
        return
    assert int(tight["status"]) == CONVERGED
    # The spline through quarter degrees is good to 1e-9.
    assert float(tight["delta"]) == pytest.approx(known["delta"], rel=5e-9)
    loose = dispatch.solve(wanted=SCALAR_NAMES, tolerance=1e-3, **inputs)
    assert float(loose["delta"]) == pytest.approx(known["delta"], rel=1e-3)
    assert float(loose["delta_error"]) <= 1e-3


def test_estimated_error_covers_the_true_one(design: Design) -> None:
    """Light flywheels, many cylinders, strong loads: where the load's own error rules."""
    for count in (3, 8, 16, 24):
        engine = replace(design, cylinders=count)
        inputs = inputs_of(engine, family_of(engine))
        inertia = design.inertia / count * np.geomspace(0.003, 3.0, 40)
        for exponent, model in ((0.5, "constant"), (2.0, "variable"), (4.0, "constant")):
            changes = {"inertia": inertia, "exponent": exponent, "inertia_model": model}
            found = dispatch.solve(wanted=SCALAR_NAMES, **{**inputs, **changes})
            exact = dispatch.solve(
                wanted=SCALAR_NAMES, tolerance=1e-9, finer=16, **{**inputs, **changes}
            )
            good = (found["status"] == CONVERGED) & np.isin(exact["status"], (0, 5))
            assert good.sum() > 10
            np.testing.assert_allclose(found["delta"][good], exact["delta"][good], rtol=1e-6)


def test_near_stall_the_outcomes_are_in_order(design: Design, inputs: dict[str, Any]) -> None:
    """Less and less inertia: converged, then perhaps unresolved, then stalled."""
    inertia = design.inertia * np.geomspace(1.0, 0.01, 200)[::2]
    for exponent in (0.0, 1.0, 2.0):
        for closure in ("power_mean", "cycle_time"):
            found = solve(inputs, inertia=inertia, exponent=exponent, closure=closure,
                          wanted=("delta", "omega_min"))  # fmt: skip
            status = found["status"]
            first = int(np.flatnonzero(status != CONVERGED)[0])
            assert first > 10
            assert (np.diff(found["delta"][:first]) > 0.0).all()
            last = int(np.flatnonzero(status != STALLED)[-1])
            # Between them at most a narrow band of designs that nearly touch zero, at whose end a
            # few are neither solved nor shown to stall: the steps of followed cycles are bounded.
            between = status[first : last + 1].tolist()
            unknown = between.count(NOT_CONVERGED)
            assert unknown <= 3
            assert set(between[: len(between) - unknown]) <= {CONVERGED, STALLED, TOLERANCE_NOT_MET}
            assert last - first <= 20
            assert (status[last + 1 :] == STALLED).all()


WIDE = st.floats(-9.0, 9.0).map(lambda power: 10.0**power)


@settings(max_examples=60)
@given(
    inertia=WIDE,
    mass=st.one_of(st.just(0.0), WIDE),
    speed=WIDE,
    bore=st.floats(1e-4, 10.0),
    stroke=st.floats(1e-4, 10.0),
    ratio=st.floats(1e-9, 0.999999),
    exponent=st.one_of(st.sampled_from([0.0, 1.0, 2.0]), st.floats(0.0, 40.0)),
    share=st.one_of(st.just(1.0), st.floats(-100.0, 2.0)),
    count=st.integers(1, 24),
    model=st.sampled_from(INERTIA_MODELS),
    closure=st.sampled_from(CLOSURES),
    method=st.sampled_from(METHOD_NAMES),
    passes=st.integers(0, 3),
)
def test_any_design_has_an_outcome(
    inertia: float, mass: float, speed: float, bore: float, stroke: float, ratio: float,
    exponent: float, share: float, count: int, model: str, closure: str, method: str, passes: int,
) -> None:  # fmt: skip
    """No exception, a code that exists, numbers where the code says so and NaN elsewhere."""
    if method == "thesis":
        closure, passes = "power_mean", max(passes, 1)
    family = FAMILY
    mean_gas = float(mean_gas_torque(ratio, 0.0, family))
    torque = count * 0.125 * np.pi * bore**2 * stroke * mean_gas
    found = dispatch.solve(
        family=family, wanted=WANTED, crank_angle=ANGLES, crank_ratio=ratio, row=0.0, scale=1.0,
        crankcase_pressure=1e5, bore=bore, double_radius=stroke, mass=mass, speed=speed,
        inertia=inertia,
        exponent=exponent, offset=share * torque, mean_torque=torque, friction_torque=0.0,
        cylinders=count, inertia_model=model, closure=closure, method=method, passes=float(passes),
    )  # fmt: skip
    code = int(found["status"])
    assert 0 <= code < len(MEANINGS)
    for name in WANTED:
        assert np.isfinite(found[name]).all() == has_numbers(code), name
        assert np.isnan(found[name]).all() == (not has_numbers(code)), name
    if has_numbers(code):
        assert 0.0 < found["omega_min"] <= found["omega_mean"] * (1.0 + 1e-12)
        assert found["omega_mean"] <= found["omega_max"] * (1.0 + 1e-12)
        assert found["delta"] >= 0.0


FAMILY = family_of(design_of(NAME))
