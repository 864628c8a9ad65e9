"""docs/method.md and the code: cited equations exist, constants are where the note says."""

from __future__ import annotations

import importlib
import re
import sys
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).resolve().parents[1]
PACKAGE = ROOT / "engine_dyn"
METHOD = (ROOT / "docs" / "method.md").read_text(encoding="utf-8")
EQUATIONS = [int(number) for number in re.findall(r"\\tag\{(\d+)\}", METHOD)]
SECTIONS = set(re.findall(r"^##+ (\d+(?:\.\d+)?) ", METHOD, re.MULTILINE))

# Scripts import each other by their bare names, as when they are run.
sys.path.insert(0, str(ROOT / "tools"))
method_constants: Any = importlib.import_module("method_constants")

CITED = re.compile(r"docs/method\.md\s+((?:\(\d+\)(?:(?:,| and| to)\s+(?=\())?)+)")
SECTION_CITED = re.compile(r"docs/method\.md,?\s+(?:section|chapter)\s+(\d+(?:\.\d+)?)")


def citations(text: str) -> list[int]:
    """Equations that a text cites, in the form "docs/method.md (13), (14) and (61)"."""
    return [int(n) for one in CITED.findall(text) for n in re.findall(r"\((\d+)\)", one)]


def without_marks(path: Path) -> str:
    """Text of a source file, comments that go on over several lines as one text."""
    return re.sub(r"\n\s*#\s", "\n", path.read_text(encoding="utf-8"))


def test_equations_are_numbered_in_order() -> None:
    assert list(range(1, len(EQUATIONS) + 1)) == EQUATIONS


def test_equations_that_the_text_names_exist() -> None:
    named = {int(number) for number in re.findall(r"(?<=[ (])\((\d{1,3})\)", METHOD)}
    assert named
    assert named <= set(EQUATIONS)


def test_citations_are_read() -> None:
    assert citations("see docs/method.md (13), (14) and\n    (61), which") == [13, 14, 61]
    assert citations("docs/method.md (7) to (9).") == [7, 9]
    assert citations("docs/method.md (7), by hand (8)") == [7]


@pytest.mark.parametrize("path", sorted(PACKAGE.rglob("*.py")), ids=lambda p: p.stem)
def test_what_the_code_cites_exists(path: Path) -> None:
    text = without_marks(path)
    for number in citations(text):
        assert number in EQUATIONS, number
    for section in SECTION_CITED.findall(text):
        assert section in SECTIONS, section
    # A mention that is written in any other form would not be checked.
    assert text.count("docs/method.md") == len(CITED.findall(text)) + len(
        SECTION_CITED.findall(text)
    )


def test_the_solution_is_cited_throughout() -> None:
    cited = {number for path in PACKAGE.rglob("*.py") for number in citations(without_marks(path))}
    assert len(cited) > 2 * len(EQUATIONS) / 3  # the others are steps of a derivation


def test_constants_are_derived_again(capsys: pytest.CaptureFixture[str]) -> None:
    assert method_constants.main() == 0, capsys.readouterr().out


def test_constants_are_in_the_modules_that_the_table_names() -> None:
    table = METHOD[METHOD.index("## 14 Constants") : METHOD.index("## 15 ")]
    rows = [line.split(" | ")[0] for line in table.splitlines() if line.startswith("| `")]
    assert len(rows) > 40
    for row in rows:
        files = [
            PACKAGE / f"{name}.py" for name in re.findall(r"`([a-z0-9_]+(?:/[a-z0-9_]+)*)`", row)
        ]
        assert files, row
        source = "".join(file.read_text(encoding="utf-8") for file in files)
        for name in re.findall(r"`([A-Z]\w+)`", row):
            assert re.search(rf"\b{name}\b", source), (name, row)
