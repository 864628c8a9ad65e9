"""Tables of the reference: what is not a mere copy of the code's own tables."""

from __future__ import annotations

import importlib
import sys
from pathlib import Path
from typing import Any

import pytest

from engine_dyn.quantities.graph import DIMENSIONS, QUANTITIES
from engine_dyn.status import MEANINGS
from sweeps.planning.plan import make_plan
from sweeps.reading.engine_files import catalogue, load_engine
from sweeps.scene.reading import built_in_scenes, read_scene

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tools"))
reference_tables: Any = importlib.import_module("reference_tables")


@pytest.mark.parametrize("name", ["rakopoulos", "rakopoulos_two_stroke", "four_cylinder",
                                  "asgari", "mosakowski", "lecture18_idle", "thesis"])  # fmt: skip
def test_dimensions_are_those_of_the_plan(name: str) -> None:
    assert name in built_in_scenes()
    scene = read_scene(name)
    stages = {stage.node.name: stage for stage in make_plan(scene).stages}
    for quantity in set(scene.quantities) & set(QUANTITIES) & set(stages):
        planned = set(stages[quantity].dims) & set(DIMENSIONS)
        assert reference_tables.dimensions(quantity) == planned, quantity


def test_every_quantity_is_on_the_page_once() -> None:
    page = reference_tables.quantities()
    for name in QUANTITIES:
        assert page.count(f"\n| `{name}` |") == 1, name


def test_every_outcome_says_what_to_do() -> None:
    assert set(reference_tables.OUTCOMES) == set(MEANINGS)
    for meaning, remedy in reference_tables.OUTCOMES.values():
        assert meaning.endswith(".")
        assert remedy.endswith(".")


def test_keys_say_where_they_stand() -> None:
    rows = {line.split("`")[1]: line for line in reference_tables.keys().splitlines()[2:]}
    assert rows["bore"].endswith("| scene, engine file |")
    assert rows["compression_ratio"].endswith("| scene |")
    assert rows["passes"].endswith("| `[solver]`, `[designs]` |")
    assert "cylinder diameter" in rows["bore"]
    assert "one of `chen_flynn`, `patton_nitschke_heywood`" in rows["friction_law"]


def test_every_engine_of_the_catalogue_has_its_sources_and_assumptions() -> None:
    rows, sources = reference_tables.engines(), reference_tables.engine_sources()
    for name in catalogue():
        engine = load_engine(name, Path())
        assert rows.count(f"| [`{name}`](#{name}) | {engine.title} |") == 1, name
        part = sources.partition(f"### `{name}`\n")[2].partition("### ")[0]
        assert part.count("\n- ") == len(engine.sources), name
        assert all(f"`{key}`" in part for key in engine.assumed if key != "diagram"), name
