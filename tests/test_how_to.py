"""docs/how_to, docs/notebook.md and README: what they have runs, and prints what the page shows."""

import re
import shlex
from dataclasses import replace
from pathlib import Path

import matplotlib
import matplotlib.pyplot as plt
import numpy as np
import pytest

import sweeps
from sweeps.scene.engine.engine_files import load_engine
from tests.support.commands import invoke, ok
from tests.support.known_pressures import KnownPressure

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
    without = re.sub(r"(?m)^inertia = .*\n", "", scene)  # as README says
    (tmp_path / "exact.toml").write_text(without, encoding="utf-8")
    diagram = load_engine("si_four_87x101", Path()).family.diagrams[-1]
    recorded = np.column_stack([np.degrees(diagram.angle), diagram.pressure / 1e5])
    heads = "Crank angle [deg],PCYL1 [bar]"
    np.savetxt("recording.csv", recorded, delimiter=",", header=heads, comments="")

    commands = [text.splitlines() for language, text in found if language == "console"]
    make, flywheel, exact, engine_of_own, own, scene_of_own = commands
    assert make == ["make demo", "make test"]
    printed = [run_line(line) for line in [*flywheel, *exact, *engine_of_own]]
    assert any((tmp_path / "flywheel").glob("*.png"))
    # What is filled in by hand, and the comment marks of values and diagram.
    engine = (tmp_path / "my_engine.toml").read_text("utf-8")
    head, values, rest = re.split(r"(?=# These values may be)|(?=# For bearing pressures)", engine)
    assert "geometric_compression_ratio" in values.splitlines()[-2]  # as far as README says
    diagram_text = re.search(r"# (\[\[diagram\]\](?:.*\n)+?# file = \S+)", rest)
    assert diagram_text
    filled = head + re.sub(r"^# (\w+ = )", r"\1", values, flags=re.M)
    filled += diagram_text[1].replace("\n# ", "\n")
    (tmp_path / "my_engine.toml").write_text(filled, encoding="utf-8")
    printed += [run_line(line) for line in own]
    lines = {line.rstrip() for text in printed for line in text.splitlines()}
    for shown in (text for language, text in found if language == "text"):
        assert {line.rstrip() for line in shown.splitlines()} <= lines | {"...", ""}
    assert "compression ratio 18 of the engine" in (tmp_path / "pressure.csv").read_text("utf-8")
    for line in [*scene_of_own, "engine-dyn run my_scene.toml -o own.nc"]:
        run_line(line)
    assert "diagram_speeds" not in invoke("plan", "my_scene.toml").stderr
    # The load of the only diagram is the engine's own; what a file lacks, the scene gives.
    own_values, mark, diagram_of_it = filled.partition("[[diagram]]")
    unknown = r"(?m)^(load|load_\w+|friction_\w+|crankcase_pressure) = .*\n"
    few = re.sub(unknown, "", own_values) + mark + diagram_of_it
    (tmp_path / "few.toml").write_text(few, encoding="utf-8")
    run_line("engine-dyn new of_few.toml --for few.toml")
    run_line("engine-dyn run of_few.toml -o few.nc")
    assert "Usual values" in (tmp_path / "of_few.toml").read_text("utf-8")


@pytest.mark.compiled
def test_own_pressure_that_is_neither_pegged_nor_at_dead_centre(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """README's path: what `import` offers, pasted, gives the delta of the closed form."""
    monkeypatch.chdir(tmp_path)
    late = 1.4
    fired = KnownPressure(18.0, 1.33, inlet=0.93, rise=0.8)
    for name, known, offset in (
        ("recording.csv", fired, 3.1), ("motored.csv", replace(fired, rise=0.0), 2.6),
    ):  # fmt: skip
        angle, cycles = known.recorded(offset, late, cycles=12, noise=0.05)
        running = angle + 720.0 * np.arange(12)[:, None]
        table = np.column_stack([running.ravel(), cycles.ravel()])
        np.savetxt(name, table, delimiter=",", header="CA [deg],PCYL1 [bar]", comments="")
    console = [text.splitlines() for language, text in blocks(README) if language == "console"]
    ((own,),) = [lines for lines in console if "import" in lines[0]]
    (unpegged, pegging) = own.partition(" --pegging inlet --inlet-pressure 0.97")[::2]
    assert pegging
    values = (
        "bore = 0.08\nstroke = 0.09\ncylinders = 4\ncrank_ratio = 0.27\ninertia = 0.3\n"
        "reciprocating_mass = 0.9\nspeed = 1500\nload = 100\nload_exponent = 1\nload_offset = 0\n"
        "crankcase_pressure = 1.0\nfriction_constant = 0.2\nfriction_peak_pressure = 0\n"
        "friction_mean_piston_speed = 0\ngeometric_compression_ratio = 18\n"
    )
    diagram = '[[diagram]]\nload = 100\nkind = "points"\nfile = "pressure.csv"\n'
    engine = f'cycle = "four-stroke"\n[values]\n{values}{diagram}'
    (tmp_path / "my_engine.toml").write_text(engine)

    def delta() -> float:
        """The mean over the designs of the scene, whose speed is that of the engine file."""
        return float(sweeps.run("my_scene.toml")["delta"].mean())

    def lines(command: str) -> list[str]:
        """The warnings of an import."""
        result = invoke(*shlex.split(command)[1:])
        assert result.exit_code == 0, result.output
        return result.stderr.splitlines()

    (level,) = lines(unpegged + pegging)
    said = re.search(r"level: the pressure is ([\d.]+) bar too high", level)
    assert said is not None and float(said[1]) == pytest.approx(3.1, abs=0.05)
    run_line("engine-dyn new my_scene.toml --for my_engine.toml")
    raw = delta()
    motored = lines(
        "engine-dyn import motored.csv --average --engine my_engine.toml -o motored_p.csv"
    )
    shift = next(found for line in motored if (found := re.search(r"--shift (\S+)", line)))
    assert -float(shift[1]) == pytest.approx(late, abs=0.3)
    offer = re.search(r"--pegging inlet --inlet-pressure [\d.]+", level)
    assert offer is not None
    assert lines(f"{unpegged} {offer[0]} {shift[0]}{pegging} --overwrite") == []
    found = delta()
    rows = zip(angle, fired(angle), strict=True)
    text = "".join(f"{a:g},{p:.8g}\n" for a, p in rows)
    (tmp_path / "pressure.csv").write_text(f"crank_angle_deg,pressure_bar\n{text}")
    true = delta()
    assert found == pytest.approx(true, rel=0.01)
    assert abs(raw / true - 1.0) > 0.05


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
