"""docs/how_to: every scene, command and piece of Python runs, and prints what the page shows."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import matplotlib
import matplotlib.pyplot as plt
import pytest

from tests.support.commands import ok

FOLDER = Path(__file__).resolve().parents[1] / "docs" / "how_to"
PAGES = {path.stem: path.read_text("utf-8") for path in sorted(FOLDER.glob("*.md"))}
FILES = ("csv", "ini", "toml")
"""Languages of blocks that are files; the first line is a comment with the file's name."""


def blocks(page: str) -> list[tuple[str, str]]:
    """Language and text of all code blocks of a page, in order."""
    return [
        (language, text)
        for language, text in re.findall(r"^```(.*?)\n(.*?)^```", PAGES[page], re.S | re.M)
        if not language.startswith("{")
    ]


def trimmed(text: str) -> str:
    return "\n".join(line.rstrip() for line in text.splitlines()).strip()


@pytest.mark.compiled
@pytest.mark.parametrize("page", sorted(PAGES))
def test_blocks_run(page: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    matplotlib.use("agg")
    space: dict[str, object] = {}
    printed: list[str] = []
    for language, text in blocks(page):
        if language in FILES:
            (name,) = re.findall(r"\A# ([\w.]+\.\w+)", text)
            (tmp_path / name).write_text(text, encoding="utf-8")
        elif language == "console":
            for line in text.splitlines():
                program, *arguments = shlex.split(line, comments=True)
                assert program == "engine-dyn", line
                printed.append(trimmed(ok(*arguments)))
        elif language == "python":
            exec(text, space)
        else:
            # What one of the commands above it has printed.
            assert language == "text"
            assert trimmed(text) in printed
    plt.close("all")


@pytest.mark.parametrize("page", sorted(PAGES))
def test_links_lead_to_files(page: str) -> None:
    for link in re.findall(r"\]\(([^)#]+)(?:#[^)]*)?\)", PAGES[page]):
        assert (FOLDER / link).is_file(), link


def test_the_index_names_every_page() -> None:
    listed = re.findall(r"\]\((\w+)\.md\)", PAGES["index"])
    assert sorted(listed) == sorted(set(PAGES) - {"index"})
    (tree,) = re.findall(r"^```{toctree}\n:hidden:\n\n(.*?)^```", PAGES["index"], re.S | re.M)
    assert sorted(tree.split()) == sorted(listed)


def test_pages_are_short() -> None:
    for page in set(PAGES) - {"index"}:
        assert len(PAGES[page].split()) < 500, page
