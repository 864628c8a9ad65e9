"""What an archive that is mailed to others says of the folders that it was made in."""

import json
import shutil
from pathlib import Path

import netCDF4
import pytest

import sweeps
from sweeps.cli.running import _without_folders
from sweeps.running.archive.contents import plan_of, read_contents
from tests.support.commands import ok
from tests.support.engine_files import ENGINES

SCENE = """
engine = "{engine}"
axes.inertia = [2.0, 3.0]
output.quantities = ["delta"]
"""


@pytest.fixture
def study(tmp_path: Path) -> Path:
    """A folder that nobody else should hear of, with an engine in a folder of its own."""
    folder = tmp_path / "secret_customer"
    (folder / "engines").mkdir(parents=True)
    shutil.copy(ENGINES / "ntua.toml", folder / "engines" / "own.toml")
    for source in ENGINES.glob("ntua*.csv"):
        shutil.copy(source, folder / "engines")
    (folder / "scene.toml").write_text(SCENE.format(engine="engines/own.toml"))
    return folder


def texts_of(path: Path) -> str:
    with netCDF4.Dataset(path) as file:
        own = [str(file.getncattr(name)) for name in file.ncattrs()]
        more = [str(v.getncattr(name)) for v in file.variables.values() for name in v.ncattrs()]
        return "\n".join(own + more)


@pytest.mark.compiled
@pytest.mark.parametrize("where", ["whole path", "from within"])
def test_folders_stay_at_home(study: Path, where: str, monkeypatch: pytest.MonkeyPatch) -> None:
    output = study / "out.nc"
    if where == "from within":
        monkeypatch.chdir(study)
    scene = study / "scene.toml" if where == "whole path" else Path("scene.toml")
    ok("run", scene, "-o", output)
    assert "secret_customer" not in texts_of(output)
    contents = read_contents(output)
    assert contents.folder == ""
    assert "engines/own.toml" in contents.files
    shutil.rmtree(study / "engines")
    again = study.parent / "again.nc"
    ok("rerun", output, "-o", again)
    assert "secret_customer" not in texts_of(again)
    assert plan_of(read_contents(again)).designs == 2


@pytest.mark.compiled
def test_folders_are_kept_when_asked_for(study: Path) -> None:
    output = study / "out.nc"
    ok("run", study / "scene.toml", "-o", output, "--full-paths")
    with netCDF4.Dataset(output) as file:
        kept = json.loads(file.input_files)
    assert kept["folder"] == str(study)
    assert str(study / "engines" / "own.toml") in kept["files"]
    sweeps.stream(study / "scene.toml", study / "two.nc", full_paths=True)
    assert "secret_customer" in texts_of(study / "two.nc")


@pytest.mark.parametrize(
    ("given", "kept"),
    [
        ("/home/me/scene.toml", "scene.toml"), ("scene.toml", "scene.toml"),
        ("studies/scene.toml", "studies/scene.toml"), ("../other/scene.toml", "scene.toml"),
        ("--output=/home/me/out.nc", "--output=out.nc"), ("-o/home/me/out.nc", "-oout.nc"),
        ("--memory=2GB", "--memory=2GB"), ("speed=1500,1600", "speed=1500,1600"),
        ("--shard=1/4", "--shard=1/4"), ("1/4", "1/4"), ("tcp://host:8786", "tcp://host:8786"),
    ],
)  # fmt: skip
def test_command_line_without_folders(given: str, kept: str) -> None:
    assert _without_folders(given) == kept
