"""docs/method.md, docs/solver.md and the code: cited equations exist, constants are there."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
PACKAGE = ROOT / "engine_dyn"
NOTES = {
    page: (ROOT / "docs" / f"{page}.md").read_text(encoding="utf-8")
    for page in ("method", "solver")
}
EQUATIONS = {
    page: [int(number) for number in re.findall(r"\\tag\{(\d+)\}", text)]
    for page, text in NOTES.items()
}
SECTIONS = {
    page: set(re.findall(r"^##+ (\d+(?:\.\d+)?) ", text, re.MULTILINE))
    for page, text in NOTES.items()
}

CITED = re.compile(r"docs/(method|solver)\.md\s+((?:\(\d+\)(?:(?:,| and| to)\s+(?=\())?)+)")
SECTION_CITED = re.compile(r"docs/(method|solver)\.md,?\s+(?:section|chapter)\s+(\d+(?:\.\d+)?)")


def citations(text: str) -> list[tuple[str, int]]:
    """Pages and equations that a text cites, as "docs/method.md (13), (14) and (52)"."""
    return [
        (page, int(n)) for page, one in CITED.findall(text) for n in re.findall(r"\((\d+)\)", one)
    ]


def without_marks(path: Path) -> str:
    """Text of a source file, comments that go on over several lines as one text."""
    return re.sub(r"\n\s*#\s", "\n", path.read_text(encoding="utf-8"))


@pytest.mark.parametrize("path", sorted(PACKAGE.rglob("*.py")), ids=lambda p: p.stem)
def test_what_the_code_cites_exists(path: Path) -> None:
    text = without_marks(path)
    for page, number in citations(text):
        assert number in EQUATIONS[page], (page, number)
    for page, section in SECTION_CITED.findall(text):
        assert section in SECTIONS[page], (page, section)
    # A mention that is written in any other form would not be checked.
    assert len(re.findall(r"docs/(?:method|solver)\.md", text)) == len(CITED.findall(text)) + len(
        SECTION_CITED.findall(text)
    )
