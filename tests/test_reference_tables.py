"""Tables of the reference: what is not a mere copy of the code's own tables."""

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


def test_every_engine_of_the_catalogue_leads_to_its_file() -> None:
    rows = reference_tables.engines()
    for name, path in catalogue().items():
        (link,) = re.findall(rf"^\| \[`{name}`\]\((.*?)\) \| ", rows, re.MULTILINE)
        assert (reference_tables.DOCS / link).resolve() == path.resolve()
        assert load_engine(name, Path()).sources, name
