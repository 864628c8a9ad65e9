"""Results of the parts of an engine lie on a dimension of these parts, and nothing is padded."""

from functools import cache
from typing import Any

import pytest

import sweeps
from engine_dyn.quantities.graph import ALONG_SHAFT, QUANTITIES
from sweeps.scene.engine_choices import those_possible
from sweeps.scene.plan.plan import make_plan
from sweeps.scene.reading import read_scene
from tests.support.engine_files import SPLIT_PINS
from tests.support.scenes import NOT_OF_AN_ENGINE, asking
from tests.support.shafts import complete_shaft

pytestmark = pytest.mark.compiled

PARTS = {*ALONG_SHAFT, "piston", "mount"}
"""Not of shafts: only some are dampers, have a diameter or a node."""

LAYOUTS: list[tuple[Any, int, int]] = [
    ("in-line 3", 3, 3), ("V8 cross-plane", 8, 4), ("V6 60 split-pin", 6, 3), (SPLIT_PINS, 4, 2),
    ("boxer 4", 4, 2), ("radial 5", 5, 1), ("VR6 15", 6, 6),
]  # fmt: skip
"""Arrangements, their cylinders and their places along the shaft."""


def scene_of(arrangement: Any, cylinders: int, throws: int, names: list[str]) -> dict[str, Any]:
    given = {
        **NOT_OF_AN_ENGINE["set"],
        "arrangement": arrangement,
        "cylinders": cylinders,
        "bank_offset": 0.03,
    }
    tables = {**NOT_OF_AN_ENGINE, "set": given, "shaft": complete_shaft(throws)}
    return asking(names, **tables, output={"angle_step": 60.0, "highest_order": 2})


@cache
def of_parts() -> list[str]:
    """All quantities of parts of an engine."""
    scene, _ = those_possible(
        [*QUANTITIES], lambda names: read_scene(scene_of("in-line 3", 3, 3, [*names]))
    )
    plan = make_plan(scene)
    return [name for name in scene.quantities if PARTS & {*plan.dims(name)}]


@pytest.mark.parametrize(("arrangement", "cylinders", "throws"), LAYOUTS)
def test_no_part_is_padded(arrangement: Any, cylinders: int, throws: int) -> None:
    asked = of_parts()
    assert {"bay_bending_moment", "throw_torque_order", "torque_after_throw"} <= {*asked}
    found = sweeps.run(scene_of(arrangement, cylinders, throws, asked))
    sizes = {"throw": throws, "bay": throws, "main_bearing": throws + 1, "piston": cylinders}
    assert {name: found.sizes[name] for name in sizes} == sizes
    assert "cylinder" not in found.dims
    for name in asked:
        parts = PARTS & {*map(str, found[name].dims)}
        some = found[name].notnull().any([d for d in found[name].dims if d not in parts])
        assert some.all(), name
