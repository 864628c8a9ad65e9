"""docs/how_to, docs/notebook.md and README: what they have runs, and prints what the page shows."""

import re
import shlex
from pathlib import Path

import matplotlib
import matplotlib.pyplot as plt
import numpy as np
import pytest

from sweeps.reading.engine_files import load_engine
from tests.support.commands import ok

ROOT = Path(__file__).resolve().parents[1]
FOLDER = ROOT / "docs" / "how_to"
PAGES = {path.stem: path.read_text("utf-8") for path in sorted(FOLDER.glob("*.md"))}
README = (ROOT / "README.md").read_text("utf-8")
FILES = ("csv", "ini", "toml")
"""Languages of blocks that are files; the first line is a comment with the file's name."""


def blocks(text: str) -> list[tuple[str, str]]:
    """Language and text of all code blocks, in order."""
    return [
        (language, block)
        for language, block in re.findall(r"^```(.*?)\n(.*?)^```", text, re.S | re.M)
        if not language.startswith("{")
    ]


def run_line(line: str) -> str:
    """What a line of a block prints that succeeds."""
    program, *arguments = shlex.split(line, comments=True)
    assert program == "engine-dyn", line
    return ok(*arguments)


def trimmed(text: str) -> str:
    return "\n".join(line.rstrip() for line in text.splitlines()).strip()


@pytest.mark.compiled
@pytest.mark.parametrize("page", sorted(PAGES))
def test_blocks_run(page: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    matplotlib.use("agg")
    space: dict[str, object] = {}
    printed: list[str] = []
    for language, text in blocks(PAGES[page]):
        if language in FILES:
            (name,) = re.findall(r"\A# ([\w.]+\.\w+)", text)
            (tmp_path / name).write_text(text, encoding="utf-8")
        elif language == "console":
            for line in text.splitlines():
                printed.append(trimmed(run_line(line)))
        elif language == "python":
            exec(text, space)
        else:
            # What one of the commands above it has printed.
            assert language == "text"
            assert trimmed(text) in printed
    plt.close("all")


@pytest.mark.compiled
def test_commands_of_the_readme(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Its scene and its Python are run by test_documents; `make` is what runs the tests."""
    monkeypatch.chdir(tmp_path)
    matplotlib.use("agg")
    found = blocks(README)
    (scene,) = (text for language, text in found if language == "toml")
    (tmp_path / "flywheel.toml").write_text(scene, encoding="utf-8")
    diagram = load_engine("si_four_87x101", Path()).family.diagrams[-1]
    recorded = np.column_stack([np.degrees(diagram.angle), diagram.pressure / 1e5])
    heads = "Crank angle [deg],PCYL1 [bar]"
    np.savetxt("recording.csv", recorded, delimiter=",", header=heads, comments="")

    commands = [text.splitlines() for language, text in found if language == "console"]
    make, flywheel, own, scene_of_own = commands
    assert make == ["make demo", "make test"]
    for line in [*flywheel, *own]:
        run_line(line)
    assert any((tmp_path / "flywheel").glob("*.png"))
    # What is filled in by hand, and the comment marks of values and diagram.
    engine = (tmp_path / "my_engine.toml").read_text("utf-8")
    head, values, rest = re.split(r"(?=# These values may be)|(?=# For bearing pressures)", engine)
    diagram_text = re.search(r"# (\[\[diagram\]\](?:.*\n)+?# file = \S+)", rest)
    assert diagram_text
    filled = head + re.sub(r"^# (\w+ = )", r"\1", values, flags=re.M)
    filled += diagram_text[1].replace("\n# ", "\n")
    (tmp_path / "my_engine.toml").write_text(filled, encoding="utf-8")
    for line in [*scene_of_own, "engine-dyn run my_scene.toml -o own.nc"]:
        run_line(line)
    # The load of the only diagram is the engine's own; what a file lacks, the scene gives.
    own_values, mark, diagram_of_it = filled.partition("[[diagram]]")
    unknown = r"(?m)^(load|load_\w+|friction_\w+|crankcase_pressure) = .*\n"
    few = re.sub(unknown, "", own_values) + mark + diagram_of_it
    (tmp_path / "few.toml").write_text(few, encoding="utf-8")
    run_line("engine-dyn new of_few.toml --for few.toml")
    run_line("engine-dyn run of_few.toml -o few.nc")
    assert "Usual values" in (tmp_path / "of_few.toml").read_text("utf-8")


def test_the_index_names_every_page() -> None:
    listed = re.findall(r"\]\((\w+)\.md\)", PAGES["index"])
    assert sorted(listed) == sorted(set(PAGES) - {"index"})
    (tree,) = re.findall(r"^```{toctree}\n:hidden:\n\n(.*?)^```", PAGES["index"], re.S | re.M)
    assert sorted(tree.split()) == sorted(listed)


@pytest.mark.compiled
def test_the_notebook_prints_what_its_page_says(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    matplotlib.use("agg")
    blocks = re.findall(
        r"```python\n(.*?)```(?:\n\n```text\n(.*?)```)?",
        (FOLDER.parent / "notebook.md").read_text("utf-8"),
        re.DOTALL,
    )
    assert len(blocks) >= 8
    space: dict[str, object] = {}
    for code, told in blocks:
        exec(code, space)
        printed = "\n".join(line.rstrip() for line in capsys.readouterr().out.splitlines())
        assert printed.rstrip("\n") == told.rstrip("\n")
    for name in ("torque.png", "mine.png"):
        assert (tmp_path / name).stat().st_size > 10_000
    plt.close("all")
