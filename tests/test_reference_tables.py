"""Tables of the reference: what is not a mere copy of the code's own tables."""

import csv
import importlib
import re
import sys
from pathlib import Path
from typing import Any

import pytest

from engine_dyn.quantities.graph import DIMENSIONS, QUANTITIES
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
    """In a row of its own, or named in the row of the quantity that it belongs to."""
    page = reference_tables.quantities()
    belonging = [line.split("and: ")[1] for line in page.splitlines() if "and: " in line]
    for name in QUANTITIES:
        named = sum(f"`{name}`" in names for names in belonging)
        assert page.count(f"\n| `{name}` |") + named == 1, name


def test_every_engine_of_the_catalogue_has_its_sources_and_assumptions() -> None:
    rows, sources = reference_tables.engines(), reference_tables.engine_sources()
    assumed = list(csv.reader(reference_tables.assumption_file().splitlines()))
    for name in catalogue():
        engine = load_engine(name, Path())
        assert rows.count(f"| [`{name}`](#{name}) | {engine.title} |") == 1, name
        part = sources.partition(f"### `{name}`\n")[2].partition("### ")[0]
        same = re.search(r"^As \[`(\w+)`\]", part, re.MULTILINE)
        if same:
            assert load_engine(same[1], Path()).sources == engine.sources, name
        else:
            assert part.count("\n- ") == len(engine.sources), name
        assert {row[1] for row in assumed if row[0] == name} == set(engine.assumed)
