"""Formats of archives: version 0.1's can be read, newer ones are refused in one line."""

import shutil
from pathlib import Path

import netCDF4
import pytest

import sweeps
from sweeps.base.errors import SceneError
from sweeps.base.netcdf import ARCHIVE_FORMAT
from sweeps.catalogue import SCENES
from sweeps.running.archive.contents import files_as_now, plan_of, read_contents
from sweeps.running.archive.provenance import differences, identity
from tests.support.commands import invoke, ok, refused

pytestmark = pytest.mark.quick

OLD = Path(__file__).resolve().parents[1] / "data" / "version_0_1.nc"


@pytest.fixture
def old(tmp_path: Path) -> Path:
    return Path(shutil.copy(OLD, tmp_path / "old.nc"))


def of_format(path: Path, text: str) -> Path:
    with netCDF4.Dataset(path, "a") as file:
        file.setncattr("archive_format", text)
    return path


def test_an_archive_of_version_0_1_is_opened(old: Path, tmp_path: Path) -> None:
    with sweeps.open(old) as archive:
        assert "archive_format" not in archive.attrs
        assert archive["delta"].sizes == {"inertia": 3, "speed": 2, "design": 2}
        assert (archive["status"] == 0).all()
        assert list(archive["case"].values) == ["rod 300 mm", "rod 450 mm"]
        small = sweeps.best(archive, least="delta", at_every="speed")
        assert float(small["inertia"]) == 8.0
    told = ok("info", old)
    assert "12 designs" in told and "converged: 12" in told
    assert len(ok("plot", old, "-o", tmp_path / "figures").splitlines()) >= 3
    ok("export", old, "-o", tmp_path / "old.csv")
    assert len((tmp_path / "old.csv").read_text().splitlines()) == 13
    assert "axes: the same" in ok("compare", old, OLD, "--tolerance", "0")
    line = refused("extend", old, "--axis", "speed=1200")
    assert "would be made in a different way now: version of engine-dyn (was 0.1.0" in line
    assert "; version of kernels (was" in line
    assert "`engine-dyn rerun` computes it again" in line


def test_the_numbers_of_version_0_1_are_those_of_now(old: Path, tmp_path: Path) -> None:
    """Its scene is run again from what the archive contains; the catalogue is not asked."""
    result = invoke("rerun", old, "-o", tmp_path / "now.nc")
    assert result.exit_code == 0, result.output
    assert "made in a different way" in result.stderr and "file ntua.toml" not in result.stderr
    ok("compare", old, tmp_path / "now.nc", "--tolerance", "1e-7")
    with sweeps.open(tmp_path / "now.nc") as archive:
        assert archive.attrs["archive_format"] == str(ARCHIVE_FORMAT)


@pytest.mark.parametrize("version", [1, ARCHIVE_FORMAT])
def test_files_of_the_package_are_found_wherever_it_lay(version: int) -> None:
    inside = "sweeps/scenes" if version == 1 else "sweeps/catalogue/scenes"
    folder, files = files_as_now(
        f"/elsewhere/{inside}", {f"{inside}/p.csv": b"", "q": b""}, version
    )
    assert folder == str(SCENES)
    assert list(files) == ["sweeps/catalogue/scenes/p.csv", "q"]
    assert files_as_now("/my/scenes", {"/my/scenes/p.csv": b""}, version)[0] == "/my/scenes"


def test_a_built_in_scene_is_planned_from_an_archive_of_another_place(tmp_path: Path) -> None:
    """Its published values lie in the package, which may lie elsewhere on another machine."""
    path = tmp_path / "thesis.nc"
    dataset = sweeps.run("thesis")
    dataset.attrs["input_files"] = dataset.attrs["input_files"].replace(
        str(SCENES.parents[2]), "/x"
    )
    dataset.to_netcdf(path, engine="netcdf4")
    contents = read_contents(path)
    plan = plan_of(contents)
    assert plan.scene.reference is not None
    assert differences(contents.identity, identity(plan)) == []


def test_a_newer_format_is_refused(old: Path, tmp_path: Path) -> None:
    newer = of_format(old, str(ARCHIVE_FORMAT + 1))
    expected = (
        f"an archive of format {ARCHIVE_FORMAT + 1}, written by a newer version; "
        f"this version of engine-dyn reads formats up to {ARCHIVE_FORMAT}"
    )
    for command in ("info", "plot", "rerun", "export", "compare", "merge", "extend"):
        more: list[str | Path] = [OLD] if command in ("compare", "merge") else []
        more += ["-o", tmp_path / "x.csv"] if command == "export" else []
        more += ["-o", tmp_path / "x.nc"] if command in ("rerun", "merge") else []
        more += ["--axis", "speed=1200"] if command == "extend" else []
        assert expected in refused(command, newer, *more)
    for opening in (sweeps.open, sweeps.open_archive):
        with pytest.raises(SceneError, match=expected):
            opening(newer)
