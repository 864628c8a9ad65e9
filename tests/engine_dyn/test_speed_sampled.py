"""Designs that have no table in common: curves from harmonics against tables of their own."""

from typing import Any

import numpy as np
import pytest

from engine_dyn.loads.driven_machine import DrivenMachine, torque_over_angle
from engine_dyn.pressure.diagram import diagram_from_points
from engine_dyn.pressure.family import Family, family_from_diagrams
from engine_dyn.speed import dispatch
from engine_dyn.speed.mean_gas import mean_gas_torque
from engine_dyn.speed.mechanisms import BATCH, counted
from engine_dyn.status import CONVERGED, INVALID_INPUT, NO_STEADY_STATE
from oracle.designs import table
from tests.support.held_out import BAR, design_of

pytestmark = pytest.mark.compiled

WANTED = ("delta", "omega_max", "omega_min", "omega_mean")


@pytest.fixture(scope="module")
def family() -> Family:
    degrees, bar = table(design_of("alpha 1, constant, 1 cyl, power_mean").pressure)
    return family_from_diagrams(
        [10.0, 11.0, 13.0],
        [diagram_from_points(np.radians(degrees), f * bar * BAR) for f in (0.9, 1.0, 1.3)],
    )


def designs(count: int, family: Family, cylinders: int) -> dict[str, Any]:
    random = np.random.default_rng(11)
    ratio = random.uniform(0.02, 0.6, count)
    row = random.uniform(0.0, family.row_count - 1.0, count)
    lever = 0.25 * np.pi * 0.1**2 * 0.05
    mean = cylinders * lever * mean_gas_torque(ratio, row, family)
    return {
        "family": family, "crank_ratio": ratio, "row": row, "cylinders": cylinders, "bore": 0.1,
        "scale": random.uniform(0.8, 1.2, count), "double_radius": 0.1, "friction_torque": 0.0,
        "crankcase_pressure": random.uniform(0.0, 1.2e5, count), "offset": 0.0,
        "mass": random.uniform(0.3, 1.0, count), "speed": random.uniform(150.0, 400.0, count),
        "inertia": random.uniform(0.3, 2.0, count), "mean_torque": 0.8 * mean,
    }  # fmt: skip


@pytest.mark.parametrize("cylinders", [1, 4])
@pytest.mark.parametrize("exponent", [0.0, 1.0, 1.6, 2.0])
@pytest.mark.parametrize("model", ["constant", "variable"])
def test_many_are_as_the_general_solver(
    family: Family, cylinders: int, exponent: float, model: str
) -> None:
    inputs = designs(200, family, cylinders)
    many = dispatch.solve(wanted=WANTED, exponent=exponent, inertia_model=model, **inputs)
    known = dispatch.solve(
        wanted=WANTED, exponent=exponent, inertia_model=model, general=True, finer=2,
        tolerance=1e-8, **inputs,
    )  # fmt: skip
    good = known["status"] == CONVERGED
    assert good.sum() > 150 and (many["status"][good] == CONVERGED).all()
    for name in WANTED:
        np.testing.assert_allclose(many[name][good], known[name][good], rtol=1e-6, err_msg=name)
    np.testing.assert_allclose(many["omega_mean"][good], known["omega_mean"][good], rtol=1e-8)


@pytest.mark.parametrize("cylinders", [1, 4])
@pytest.mark.parametrize("exponent", [0.0, 1.6, 2.0])
def test_masses_that_leave_hardly_any_inertia_somewhere(
    family: Family, cylinders: int, exponent: float
) -> None:
    """Beyond some mass the variable inertia vanishes at some angle, also of engines that stop."""
    inputs = designs(400, family, cylinders)
    random = np.random.default_rng(2)
    # sum v^2 falls below its mean by about half the number of cylinders.
    share = random.uniform(0.0, 2.0, 400)
    inputs["mass"] = share * inputs["inertia"] / (0.5 * cylinders * 0.05**2)
    inputs["speed"] = random.uniform(1500.0, 4000.0, 400)
    inputs["mean_torque"] = np.where(random.random(400) < 0.2, -1.0, 1.0) * inputs["mean_torque"]
    many, known = (
        dispatch.solve(
            wanted=WANTED, exponent=exponent, inertia_model="variable", general=general, **inputs
        )
        for general in (False, True)
    )
    np.testing.assert_array_equal(many["status"], known["status"])
    for status in (CONVERGED, NO_STEADY_STATE, INVALID_INPUT):
        assert (many["status"] == status).sum() > 20, status
    good = many["status"] == CONVERGED
    for name in WANTED:
        np.testing.assert_allclose(many[name][good], known[name][good], rtol=1e-6, err_msg=name)


def with_offset(inputs: dict[str, Any], largest: float) -> dict[str, Any]:
    """The same designs, each with an offset of either sign, and one of them without."""
    size = inputs["crank_ratio"].size
    offset = np.random.default_rng(5).uniform(-largest, largest, size)
    offset[size // 2] = 0.0
    return inputs | {"offset_ratio": offset, "crank_ratio": 0.55 * inputs["crank_ratio"]}


def with_load_over_angle(inputs: dict[str, Any]) -> dict[str, Any]:
    """The same designs, each driving a pump of three pistons of a size of its own."""
    angle = np.radians(np.arange(0.0, 360.0, 2.0))
    wave = 10.0 * np.abs(np.sin(1.5 * angle)) + 3.0 * np.cos(angle)
    load = torque_over_angle(angle, wave, own_angle=True)
    scale = np.random.default_rng(6).uniform(0.0, 1.5, inputs["row"].size)
    scale[3] = 0.0
    return inputs | {
        "driven": DrivenMachine(over_angle=load), "gear_ratio": 2.0, "load_phase": 0.4,
        "load_scale": scale, "offset": 2.0 * scale * load.mean, "speed": 2.0 * inputs["speed"],
    }  # fmt: skip


VARIANTS = {
    "offset": lambda inputs: with_offset(inputs, 0.55),
    "load over angle": with_load_over_angle,
    "both": lambda inputs: with_load_over_angle(with_offset(inputs, 0.1)),
}


@pytest.mark.parametrize("variant", VARIANTS)
@pytest.mark.parametrize("cylinders", [1, 4])
@pytest.mark.parametrize("exponent", [0.0, 1.6, 2.0])
def test_an_offset_and_a_load_over_angle_are_in_the_curves(
    family: Family, cylinders: int, exponent: float, variant: str
) -> None:
    """With the largest offsets, some crank ratios lie beyond all intervals."""
    inputs = VARIANTS[variant](designs(150, family, cylinders))
    with counted() as tally:
        many = dispatch.solve(wanted=WANTED, exponent=exponent, **inputs)
    assert tally.designs[BATCH] >= 150 and tally.deferred < 75
    known = dispatch.solve(
        wanted=WANTED, exponent=exponent, general=True, finer=2, tolerance=1e-8, **inputs
    )
    good = known["status"] == CONVERGED
    assert good.sum() > 100 and (many["status"][good] == CONVERGED).all()
    for name in WANTED:
        np.testing.assert_allclose(many[name][good], known[name][good], rtol=1e-6, err_msg=name)
    order = np.random.default_rng(1).permutation(150)[:90]
    taken = {k: v[order] if isinstance(v, np.ndarray) else v for k, v in inputs.items()}
    part = dispatch.solve(wanted=WANTED, exponent=exponent, **taken)
    for name in WANTED:
        np.testing.assert_array_equal(part[name], many[name][order])


def test_mean_torque_of_many_is_that_of_each(family: Family) -> None:
    random = np.random.default_rng(2)
    ratio, row = random.uniform(0.1, 0.5, 3000), random.uniform(0.0, 6.0, 3000)
    offset = np.where(np.arange(3000) % 500 == 0, 0.0, random.uniform(-0.5, 0.5, 3000))
    many = mean_gas_torque(ratio, row, family, offset)
    some = slice(0, 3000, 250)
    for *one, found in zip(ratio[some], row[some], offset[some], many[some], strict=True):
        alone = mean_gas_torque(one[0], one[1], family, one[2])
        assert found == pytest.approx(float(alone), rel=1e-12)


def test_crank_ratios_beyond_all_intervals_are_solved_too(family: Family) -> None:
    inputs = designs(100, family, 1)
    inputs["crank_ratio"] = np.linspace(0.7, 0.95, 100)
    inputs["inertia"] = np.full(100, 5.0)
    many = dispatch.solve(wanted=WANTED, exponent=2.0, **inputs)
    known = dispatch.solve(wanted=WANTED, exponent=2.0, general=True, finer=2, **inputs)
    good = known["status"] == CONVERGED
    assert good.sum() > 80
    np.testing.assert_allclose(many["delta"][good], known["delta"][good], rtol=1e-6)


def test_company_with_a_larger_crank_ratio_does_not_matter(family: Family) -> None:
    """Whose columns are added up follows from the crank ratio of a design alone."""
    inputs = designs(200, family, 1)
    whole = dispatch.solve(wanted=WANTED, exponent=2.0, **inputs)
    small = inputs["crank_ratio"] < 0.36
    assert 0 < small.sum() < 200
    taken = {k: v[small] if isinstance(v, np.ndarray) else v for k, v in inputs.items()}
    part = dispatch.solve(wanted=WANTED, exponent=2.0, **taken)
    for name in WANTED:
        np.testing.assert_array_equal(part[name], whole[name][small])


@pytest.mark.parametrize("exponent", [0.0, 1.0, 1.6, 2.0])
@pytest.mark.parametrize("model", ["constant", "variable"])
@pytest.mark.parametrize("own", [False, True], ids=["shared", "own"])
def test_cycle_time_is_that_of_the_general_solver(
    family: Family, exponent: float, model: str, own: bool
) -> None:
    """With a table that designs have in common, and with curves of their own."""
    inputs = designs(150, family, 1)
    if not own:
        inputs |= {"crank_ratio": 0.3, "row": 1.4, "scale": 1.0, "crankcase_pressure": 1e5}
        inputs["mean_torque"] = float(np.median(inputs["mean_torque"]))
    wanted = (*WANTED, "load_factor")
    choice = {"closure": "cycle_time", "exponent": exponent, "inertia_model": model}
    with counted() as tally:
        many = dispatch.solve(wanted=wanted, **choice, **inputs)
    known = dispatch.solve(wanted=wanted, general=True, finer=2, tolerance=1e-8, **choice, **inputs)
    good = known["status"] == CONVERGED
    assert good.sum() > 100 and (many["status"][good] == CONVERGED).all()
    assert tally.deferred < 0.3 * good.size
    for name in wanted:
        np.testing.assert_allclose(many[name][good], known[name][good], rtol=1e-6, err_msg=name)
