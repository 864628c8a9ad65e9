"""Speed over crank angle of designs solved in lanes: against finer solutions and the oracle."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from engine_dyn.speed import dispatch
from engine_dyn.speed.fields import INERTIA_MODELS, SCALAR_NAMES
from engine_dyn.status import CONVERGED
from oracle import solution
from tests.support.differences import slope
from tests.support.held_out import design_of, family_of, inputs_of
from tests.support.tiers import all_but

pytestmark = [pytest.mark.compiled, pytest.mark.quick]

NAME = "alpha 1, constant, 1 cyl, power_mean"
CURVES = ("omega", "angular_acceleration")
SPEEDS = ("delta", "omega_max", "omega_min", "omega_mean")
SCALARS = tuple(name for name in SCALAR_NAMES if name != "delta_error")
# Angles that are nodes of the finer solutions, beyond one cycle and not in order.
ANGLES = np.random.default_rng(3).permutation(np.pi / 72.0 * np.arange(-144, 288))
INERTIA = np.geomspace(0.2, 10.0, 21)


def inputs(cylinders: int = 1, **changes: Any) -> dict[str, Any]:
    design = replace(design_of(NAME), cylinders=cylinders)
    return {**inputs_of(design, family_of(design, 1.0)), "inertia": INERTIA, **changes}


# Every pair of settings; in the first tier every setting.
SETTINGS = [
    (cylinders, exponent, INERTIA_MODELS[(i + j) % 2])
    for i, cylinders in enumerate((1, 4, 7, 11))
    for j, exponent in enumerate((0.0, 1.0, 1.6, 2.0))
]


@pytest.mark.parametrize(
    ("cylinders", "exponent", "model"),
    all_but({*SETTINGS} - {SETTINGS[i] for i in (0, 6, 11, 13)}, SETTINGS),
)
def test_curves_are_those_of_the_oracle(cylinders: int, exponent: float, model: str) -> None:
    design = replace(
        design_of(NAME), cylinders=cylinders, load_exponent=exponent, inertia_model=model
    )
    found = dispatch.solve(
        wanted=(*SPEEDS, *CURVES), crank_angle=ANGLES, **inputs_of(design, family_of(design, 0.25))
    )
    exact = solution.solve(design)
    assert int(found["status"]) == CONVERGED
    for name in SPEEDS:
        assert float(found[name]) == pytest.approx(getattr(exact, name), rel=1e-7), name
    np.testing.assert_allclose(found["omega"], exact.omega(ANGLES), rtol=1e-8)
    rates = slope(lambda phi: 0.5 * exact.omega(phi) ** 2, ANGLES, 2e-3)
    np.testing.assert_allclose(
        found["angular_acceleration"], rates, rtol=0.0, atol=1e-8 * np.ptp(rates)
    )


@pytest.mark.parametrize("cylinders", [1, 4])
def test_scalars_do_not_know_of_curves(cylinders: int) -> None:
    arguments = inputs(
        cylinders, exponent=np.array([0.0, 1.0, 1.6, 2.0])[:, None],
        inertia_model=np.array(INERTIA_MODELS)[:, None, None],
        inertia=np.geomspace(0.02, 10.0, 50),
    )  # fmt: skip
    alone = dispatch.solve(wanted=SCALARS, **arguments)
    for wanted in (CURVES, CURVES[:1], CURVES[1:]):
        both = dispatch.solve(wanted=(*SCALARS, *wanted), crank_angle=ANGLES, **arguments)
        for name in (*SCALARS, "status"):
            np.testing.assert_array_equal(both[name], alone[name], err_msg=name)
        assert {*SCALARS, *wanted, "status"} == set(both)


@pytest.mark.parametrize("model", INERTIA_MODELS)
@pytest.mark.parametrize("exponent", [1.0, 2.0])
@pytest.mark.parametrize("cylinders", [1, 4])
@pytest.mark.parametrize("first", [3, 8])
def test_curves_do_not_know_their_lane(
    first: int, cylinders: int, exponent: float, model: str
) -> None:
    """Bits are the same in any lane: code for known lanes may differ from vector to vector."""
    inertia = np.geomspace(0.9, 10.0, 2000)
    arguments = inputs(cylinders, exponent=exponent, inertia_model=model, inertia=inertia)
    found = dispatch.solve(wanted=CURVES, crank_angle=ANGLES, **arguments)
    arguments["inertia"] = inertia[first:]
    moved = dispatch.solve(wanted=CURVES, crank_angle=ANGLES, **arguments)
    for name in CURVES:
        np.testing.assert_array_equal(moved[name], found[name][first:], err_msg=name)


def test_even_firing_repeats_to_the_bit() -> None:
    phi = np.radians(np.arange(-360.0, 360.0))
    found = dispatch.solve(wanted=CURVES, crank_angle=phi, **inputs(4))
    for name in CURVES:
        parts = found[name].reshape(INERTIA.size, 4, 180)
        np.testing.assert_array_equal(parts, np.repeat(parts[:, :1], 4, axis=1))


@pytest.mark.parametrize("designs", [1, 3, 40])
def test_many_tables(designs: int) -> None:
    """Tables change within what is solved before curves are written, and between."""
    ratios = np.linspace(0.15, 0.35, 70)[:, None]
    arguments = inputs(crank_ratio=ratios, inertia=np.geomspace(0.9, 4.0, designs))
    found = dispatch.solve(wanted=("omega",), crank_angle=ANGLES[:50], threads=2, **arguments)
    assert (found["status"] == CONVERGED).all()
    for i in (0, 33, 63, 64, 69):
        alone = {**arguments, "crank_ratio": ratios[i]}
        part = dispatch.solve(wanted=("omega",), crank_angle=ANGLES[:50], **alone)
        np.testing.assert_array_equal(part["omega"], found["omega"][i])
