"""Worked examples of textbooks, and their page.

They stand in tests/reference/worked_examples.toml; tools/textbook_examples.py poses them, for the
page as well. Ours must be what an independent calculation gives, within the tolerance stated there.
"""

import importlib
import re
import sys
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).resolve().parents[2]

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


def printed_is_right(value: dict[str, Any]) -> bool:
    """Whether the printed value is within one unit of its last digit of its own formula."""
    if isinstance(value["expected"], str):
        return bool(value["printed"] == value["expected"])
    unit = 10.0 ** -len(value["printed"].partition(".")[2])
    return bool(abs(float(value["printed"]) - value["expected"]) <= 1.000001 * unit)


def test_whoever_is_wrong_is_named() -> None:
    for one, value in VALUES:
        if "printed" in value and "expected" in value:
            assert printed_is_right(value) != ("wrong" in value), (one["id"], value["name"])


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


def test_the_page_of_validation_counts_those_with_errors() -> None:
    errors = {one["id"] for one, value in VALUES if value.get("wrong") in ("companion", "solution")}
    page = (ROOT / "docs" / "validation.md").read_text("utf-8")
    assert f"| of worked examples of textbooks | {len(errors)} |" in page


@pytest.mark.compiled
def test_the_page_is_current() -> None:
    for path, text in tool.documents().items():
        assert path.read_text(encoding="utf-8") == text, path.name
