"""Tables of the reference: what is not a mere copy of the code's own tables."""

import re
from collections.abc import Iterator
from pathlib import Path

import pytest

from engine_dyn.quantities.graph import DIMENSIONS, QUANTITIES
from sweeps.scene.engine.engine_files import catalogue, load_engine
from sweeps.scene.plan.plan import make_plan
from sweeps.scene.reading import built_in_scenes, read_scene
from tests.support.tools import tool

pages = tool("pages")
reference_tables = tool("reference_tables")


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


def shown_keys() -> Iterator[tuple[str, str, str]]:
    """Heading, key, and what a table of the site says of it; nothing where it is only named."""
    for make in reference_tables.KEYS.values():
        place = ""
        for line in make().replace(r"\|", "/").splitlines():
            if line.startswith("### "):
                place = line.removeprefix("### ").removeprefix("At ").replace("`", "")
            elif line.startswith("| `"):
                key, _, told = line.strip("| ").partition("` | ")
                yield place, key.removeprefix("`"), told.replace("`", "")
            elif named := re.match(r"(?:As in|Numbers, each also a key such as) .*?: (.*)\.", line):
                for key, unit in re.findall(r"`(\w+)`((?: \[.*?\])?)", named[1]):
                    yield place, key, unit.strip()


def test_the_file_of_keys_has_all_that_the_site_shows() -> None:
    rows = pages.csv_rows(reference_tables.DOCS / "keys.csv")
    heads = "also|default|allowed|only in"
    seen = 0
    for place, key, told in shown_keys():
        places = {place} if place else {"scene", "[solver]"}
        (row,) = (r for r in rows if r["key"] == key and places & set(r["stands in"].split(", ")))
        unit = f"[{row['unit']}] " if row["unit"] else ""
        kinds = f" | {row['needed by']} | {row['taken by']}"
        default = f"; by default {row['default']}" if row["default"] else ""
        required = "; required" if row["needed by"] == "all" else ""
        about, _, notes = told.removesuffix("</small>").partition("<br><small>")
        meaning = row["meaning"].replace("|", "/")
        known = {unit.strip(), unit + meaning, meaning + (required or default)}
        if place and row["allowed"]:  # a number, of [solver]
            assert all(part in about for part in (meaning, row["allowed"], unit.strip()))
        else:
            assert about.strip() in {*known, (meaning + default + kinds).strip(" |")}, (place, key)
        seen += bool(about.strip())
        for head, note in re.findall(rf"({heads}): (.*?)(?=; (?:{heads}): |$)", notes):
            column = {"also": "synonyms", "only in": "stands in"}.get(head, head)
            assert note in row[column], (key, head)
    assert seen > 300


def test_every_engine_of_the_catalogue_leads_to_its_file() -> None:
    rows = reference_tables.engines()
    for name, path in catalogue().items():
        (link,) = re.findall(rf"^\| \[`{name}`\]\((.*?)\) \| ", rows, re.MULTILINE)
        assert (reference_tables.DOCS / link).resolve() == path.resolve()
        assert load_engine(name, Path()).sources, name
