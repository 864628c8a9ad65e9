"""Moments that hang on the distance of banks: that of boxers by default, others are refused."""

import csv
import json
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import sweeps
from engine_dyn.forces import balance
from engine_dyn.geometry.arrangement import FOUR_STROKE
from engine_dyn.geometry.layouts import arrangement_from_text
from engine_dyn.quantities.graph import QUANTITIES
from engine_dyn.units import RPM
from sweeps.base.errors import SceneError
from sweeps.scene.engine.engine_files import load_engine
from sweeps.scene.engine_choices import those_possible
from sweeps.scene.plan.plan import make_plan
from sweeps.scene.reading import read_scene
from tests.support.scenes import asking, computed

pytestmark = pytest.mark.compiled

SPACING, OFFSET = 0.09, 0.031
TABLE = Path(__file__).parents[1] / "reference" / "free_forces_and_moments.csv"


def layouts() -> list[str]:
    """Every four-stroke layout of the table of free forces and moments but stars.

    Their rods work in one plane, which an offset of the banks would tear apart.
    """
    lines = TABLE.read_text(encoding="utf-8").splitlines()
    rows = csv.DictReader(line for line in lines if not line.startswith("#"))
    every = [row["layout"] for row in rows if row["cycle"] == "720"]
    return [layout for layout in every if not layout.startswith("radial")]


def scene_of(layout: str, names: list[str], **given: float) -> dict[str, Any]:
    count = len(arrangement_from_text(layout, FOUR_STROKE).cylinders)
    more = {"arrangement": layout, "cylinders": count, "cylinder_spacing": SPACING,
            "counterweight_fraction": 0.4, **given}  # fmt: skip
    mounts = [{"lateral": y, "position": x} for y in (-0.3, 0.3) for x in (-0.1, 0.4)]
    return asking(
        names, set=more, mounts=mounts, output={"angle_step": 30.0, "highest_order": 4},
        silenced_warnings=["all"],
    )  # fmt: skip


@cache
def moments() -> list[str]:
    """Quantities that take the distance of banks."""
    scene, _ = those_possible(
        [*QUANTITIES], lambda names: read_scene(scene_of("boxer 4", [*names], bank_offset=OFFSET))
    )
    each = {name: read_scene(scene_of("boxer 4", [name], bank_offset=OFFSET))
            for name in scene.quantities}  # fmt: skip
    return [name for name in each if "bank_offset" not in make_plan(each[name]).unused_settings]


def test_quantities_that_take_the_distance_are_found() -> None:
    assert {
        "shaking_moment", "shaking_moment_max", "shaking_moment_first", "shaking_moment_second",
        "shaking_moment_major", "reciprocating_moment", "residual_rotating_moment",
        "balance_couple_required", "bay_bending_moment", "bay_bending_moment_max", "mount_force",
    } <= {*moments()}  # fmt: skip


@pytest.mark.parametrize("layout", layouts())
def test_no_moment_is_0_for_want_of_a_distance(layout: str) -> None:
    """What is 0 without an offset of the banks is 0 with one too; else it is refused by name."""
    possible: list[str] = []
    for name in moments():
        try:
            read_scene(scene_of(layout, [name]))
            possible.append(name)
        except SceneError as error:
            assert "needs bank_offset" in str(error)
    if not possible:
        return
    found = sweeps.run(scene_of(layout, possible))
    given = sweeps.run(scene_of(layout, possible, bank_offset=OFFSET))
    unit = float(computed(["inertia_force_unit"])["inertia_force_unit"]) * OFFSET
    for name in possible:
        if name != "shaking_moment_inclination" and float(np.abs(found[name]).max()) < 1e-9 * unit:
            assert float(np.abs(given[name]).max()) < 1e-3 * unit, name


@pytest.mark.parametrize("apart", [0.036, 0.05])
@pytest.mark.parametrize("speed", [3000.0, 6750.0])
def test_a_boxer_twin_has_the_moment_of_its_two_throws(apart: float, speed: float) -> None:
    """m r omega^2 a (1 + lambda), exact where both pistons are at their upper dead centre."""
    found = computed(
        ["shaking_force_max", "shaking_moment_max"], engine="boxer_twin_101x70",
        set={"cylinder_spacing": apart, "speed": speed},
    )  # fmt: skip
    own = load_engine("boxer_twin_101x70", Path()).values
    radius, ratio = 0.5 * own["stroke"], own["crank_ratio"]
    mass = own["piston_mass"] + own["rod_mass"] * own["rod_centre_of_gravity"] * ratio / radius
    expected = mass * radius * (speed * RPM) ** 2 * apart * (1.0 + ratio)
    assert float(found["shaking_moment_max"]) == pytest.approx(expected, rel=1e-9)
    assert float(found["shaking_force_max"]) == 0.0


@pytest.mark.parametrize(("pairs", "first", "second"), [(1, 1.0, 1.0), (2, 0.0, 2.0), (3, 0, 0)])
def test_boxers_have_the_moments_of_the_table(pairs: int, first: float, second: float) -> None:
    """docs/layouts.md: over m r omega^2 a and, of second order, lambda m r omega^2 a."""
    layout = f"boxer {2 * pairs}"
    names = ["shaking_moment_major", "inertia_force_unit"]
    found = sweeps.run({**scene_of(layout, names), "set": {
        "arrangement": layout, "cylinders": 2 * pairs, "cylinder_spacing": SPACING,
    }})  # fmt: skip
    unit = float(found["inertia_force_unit"]) * SPACING
    ratio = load_engine("ntua", Path()).values["crank_ratio"]
    exact = abs(balance.acceleration_harmonics(2.0, ratio))
    major = found["shaking_moment_major"].sel(order=[1.0, 2.0]).values / unit
    np.testing.assert_allclose(major, np.array([first, second * exact]), atol=1e-9)


def test_archives_say_that_the_distance_was_assumed() -> None:
    def assumed(**more: float) -> str:
        settings = {"cylinder_spacing": 0.05, "speed": 3000.0, **more}
        output = {"quantities": ["shaking_moment_rms"]}
        archive = sweeps.run(engine="boxer_twin_101x70", set=settings, output=output)
        return str(json.loads(archive.attrs["engine_assumed"]).get("bank_offset"))

    assert assumed() == "not given: the cylinder_spacing of a boxer"
    assert assumed(bank_offset=0.04) == "None"
