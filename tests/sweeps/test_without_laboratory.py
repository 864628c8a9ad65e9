"""Everything but the evaluation of recordings runs where the laboratory is not installed."""

import math
import subprocess
from importlib.util import find_spec
from pathlib import Path

import pytest

import sweeps
from tests.sweeps.processes import python

# An import of these packages fails, as if they were not installed.
REFUSED = """
import sys
from importlib.abc import MetaPathFinder

class Refusing(MetaPathFinder):
    def find_spec(self, name, path=None, target=None):
        if name.startswith(("sweeps.lab", "engine_dyn.recordings")):
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)

sys.meta_path.insert(0, Refusing())
from sweeps.cli.main import main
for line in sys.argv[1:]:
    main(line.split(), standalone_mode=line == sys.argv[-1])
"""


def commands(*lines: str, folder: Path) -> subprocess.CompletedProcess[str]:
    return python(REFUSED, *lines, cwd=folder)


@pytest.mark.slow
@pytest.mark.compiled
@pytest.mark.skipif(find_spec("bokeh") is None, reason="bokeh is not installed")
def test_a_run_a_plot_and_a_report(tmp_path: Path) -> None:
    done = commands(
        "run first -q -o first.nc",
        "plot first.nc -o figures",
        "report first.nc -o first.html",
        folder=tmp_path,
    )
    assert (done.returncode, done.stderr) == (0, "")
    assert any((tmp_path / "figures").iterdir()) and (tmp_path / "first.html").exists()


MISSING = "the evaluation of recordings (sweeps.lab) is not installed; python -m pip install"


@pytest.fixture
def recording(tmp_path: Path) -> Path:
    path = tmp_path / "run.csv"
    rows = [
        f"{angle};{1 + 60 * math.exp(-(((angle - 10) / 45) ** 2)):.4f}"
        for angle in range(-360, 360, 2)
    ]
    path.write_text("\n".join(["angle [deg];p [bar]", *rows]), encoding="utf-8")
    return path


@pytest.mark.parametrize("line", ["import run.csv -o out.csv", "run scene.toml -o out.nc"])
def test_a_recording_is_refused_in_one_line(line: str, recording: Path) -> None:
    scene = 'engine = "ntua"\n[indicator]\nfile = "run.csv"\n[output]\nquantities = ["imep"]\n'
    recording.with_name("scene.toml").write_text(scene, encoding="utf-8")
    done = commands(line, folder=recording.parent)
    assert done.returncode in (1, 2)
    assert MISSING in done.stderr
    assert done.stderr.count("\n") == 1
    assert not recording.with_name(line.split()[-1]).exists()


def test_a_checkout_that_was_installed_before_reads_recordings(
    recording: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("sweeps.scene.features.indicator.entry_points", lambda **_: ())
    result = sweeps.run(
        engine="ntua", indicator={"file": recording}, output={"quantities": ["imep"]}
    )
    assert "imep" in result
