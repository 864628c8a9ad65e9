"""Worked examples of textbooks, the map of missed cycles, and their pages."""

import importlib
import re
import sys
from typing import Any

import numpy as np
import pytest

from engine_dyn.units import BAR, RPM
from tests.sweeps.processes import ROOT

# Scripts import each other by their bare names, as when they are run.
sys.path.insert(0, str(ROOT / "tools"))
textbook: Any = importlib.import_module("textbook_examples")
reference_tables: Any = importlib.import_module("reference_tables")
tool: Any = importlib.import_module("worked_examples")

VALUES = [(one, value) for one in textbook.EXAMPLES.values() for value in one["values"]]
POSED = [
    pytest.param(one, value, id=f"{one['id']} {value['name']}")
    for one, value in VALUES
    if "needs" not in value
]


@pytest.mark.compiled
@pytest.mark.parametrize(("example", "value"), POSED)
def test_ours_is_the_independent_value(example: dict[str, Any], value: dict[str, Any]) -> None:
    one = textbook.result(example, value)
    assert one.agrees, (one.independent, one.ours)


def test_every_value_is_posed_in_one_way_or_says_what_it_needs() -> None:
    for one, value in VALUES:
        assert len(value.keys() & {"ask", "function", "needs"}) == 1, (one["id"], value["name"])
        assert ("tolerance" in value) == ("reason" in value)
        assert value.get("tolerance", 0.0) <= 1e-3
        assert ("wrong" in value) == ("why" in value)
    assert {value["needs"] for _, value in VALUES if "needs" in value} == set(
        textbook.DATA["needs"]
    )


def test_the_site_shows_what_is_printed() -> None:
    shown = reference_tables.examples()
    rows = [line for line in shown.splitlines() if line.startswith("| ")]
    assert len(rows) == 2 * len(tool.SUBJECTS) + sum("printed" in value for _, value in VALUES)
    for one, value in VALUES:
        part = shown.partition(f"## {tool.SUBJECTS[one['subject']]}\n")[2].partition("\n## ")[0]
        own = re.split(r"\n(?=\| \S)", part)
        (of_example,) = (lines for lines in own if lines.startswith(f"| {one['label']} |"))
        unit = "" if value["unit"] == "1" else f" [{value['unit']}]"
        row = f" | {value['name']}{unit} | {value.get('printed')} | "
        assert (row in of_example) == ("printed" in value), (one["id"], value["name"])


@pytest.mark.compiled
def test_the_page_is_current() -> None:
    for path, text in tool.documents().items():
        assert path.read_text(encoding="utf-8") == text, path.name


sys.path.insert(0, str(ROOT / "tools"))
missed: Any = importlib.import_module("misfire_map")


@pytest.fixture(scope="module")
def motors() -> dict[str, Any]:
    return {name: missed.Motor(name) for name in missed.ENGINES}


@pytest.mark.parametrize(
    ("name", "speed", "imep", "case"),
    [
        ("si_four_87x101", 6000.0, 1.0, missed.UNKNOWN),
        ("v6_96x81", 6000.0, 1.0, missed.UNKNOWN),
        ("v6_96x81", 3000.0, 2.0, missed.LEARNED),
    ],
)
def test_rates_of_drawn_speeds_are_those_of_the_formulas(
    motors: dict[str, Any], name: str, speed: float, imep: float, case: Any
) -> None:
    """Within four standard deviations of a count; cycles of a recording share its wheel."""
    # three false alarms in ten cycles: rare ones would leave nothing to count in so few
    one = missed.counted(
        motors[name], speed * RPM, imep * BAR, case, recordings=400, false_alarms=0.3, seed=5
    )
    recordings, alarms = 200, one.alarms_expected
    tries = recordings * len(motors[name].firing)  # as if all cycles of a recording were one
    assert abs(one.alarms - alarms) < 4.0 * np.sqrt(alarms * (1.0 - alarms) / tries)
    spread = np.sqrt(one.found_expected * (1.0 - one.found_expected) / recordings)
    assert abs(one.found - one.found_expected) < 4.0 * spread
    assert one.cycles >= 400


def test_the_page_of_missed_cycles_is_current(motors: dict[str, Any]) -> None:
    page = missed.DOCUMENT.read_text(encoding="utf-8")
    assert "{{" not in page
    kept = (missed.BESIDE / "corner.csv").read_text(encoding="utf-8")
    assert kept == missed.csv_text(missed.corner_table(motors))
    linked = set(re.findall(r"\]\(misfire/(\w+)\.csv\)", page))
    assert linked == {path.stem for path in missed.BESIDE.iterdir()}
