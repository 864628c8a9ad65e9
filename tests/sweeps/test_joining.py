"""Shards, extended and merged archives, and archives made again: the bytes of one whole run."""

import json
import shutil
import tomllib
from pathlib import Path
from typing import Any

import netCDF4
import numpy as np
import pytest
import xarray as xr
from numpy.testing import assert_array_equal

import sweeps
from sweeps.running.archive.contents import read_contents
from sweeps.running.archive.netcdf import open_archive
from sweeps.running.archive.partial import Partial
from sweeps.running.compute import limits
from tests.support.archives import (
    assert_same,
    of_run,
    run,
    shards,
    stop_after,
    watch_blocks,
)
from tests.support.commands import invoke, ok, refused
from tests.support.engine_files import ENGINES
from tests.support.scenes import DESIGN_TABLE, LARGE_MAP, TO_JOIN, write_scene

pytestmark = pytest.mark.compiled

LONG = {
    "engine": "ntua",
    "axes": {"inertia": np.geomspace(1.0, 12.0, 1500).tolist(), "load": [10, 50]},
    "output": {"quantities": ["delta", "omega_max"]},
}


@pytest.mark.parametrize("name", ["scene", "table", "long"])
@pytest.mark.parametrize("count", [2, 5])
def test_shards_make_up_the_whole(
    name: str, count: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    scene: Any = {"table": DESIGN_TABLE, "long": LONG}.get(name)
    if scene is None:
        scene = tmp_path / "scene.toml"
        scene.write_text(TO_JOIN)
    monkeypatch.setattr(limits, "LARGEST_BLOCK", 2e4)
    paths = shards(scene, count, tmp_path)
    ok("merge", *reversed(paths), "-o", tmp_path / "whole.nc")
    assert_same(tmp_path / "whole.nc", sweeps.run(scene))
    with open_archive(tmp_path / "whole.nc") as opened:
        assert len(opened.attrs["history"].splitlines()) >= 2
    # A shard that is there twice does no harm, one that is missing does.
    ok("merge", *paths, paths[0], "-o", tmp_path / "whole.nc", "--overwrite")
    assert_same(tmp_path / "whole.nc", sweeps.run(scene))
    text = refused("merge", *paths[1:], paths[-1], "-o", tmp_path / "no.nc")
    assert "shards are missing" in text
    assert not (tmp_path / "no.nc").exists()


def test_shards_by_the_command(tmp_path: Path) -> None:
    (tmp_path / "scene.toml").write_text(TO_JOIN)
    for i in (1, 2, 3):
        ok("run", tmp_path / "scene.toml", "-o", tmp_path / f"{i}.nc", "--shard", f"{i}/3")
    with open_archive(tmp_path / "2.nc") as opened:
        assert opened["delta"].shape == (4, 2)
        assert json.loads(opened.attrs["part"])["shard"] == "2/3"
    # It is not the archive of the scene, nor of another shard.
    for other in ([], ["--shard", "1/3"]):
        text = refused("run", tmp_path / "scene.toml", "-o", tmp_path / "2.nc", "--resume", *other)
        assert "part" in text
    ok("run", tmp_path / "scene.toml", "-o", tmp_path / "2.nc", "--resume", "--shard", "2/3")
    ok("merge", *(tmp_path / f"{i}.nc" for i in (1, 2, 3)), "-o", tmp_path / "whole.nc")
    assert_same(tmp_path / "whole.nc", sweeps.run(tmp_path / "scene.toml"))
    ok("rerun", tmp_path / "2.nc", "-o", tmp_path / "again.nc")
    with open_archive(tmp_path / "2.nc") as opened:
        assert_same(tmp_path / "again.nc", opened.load())


SPEEDS = {"speed": [1000.0, 1100.0, 1200.0, 1500.0], "inertia": [1.0, 2.0, 3.0, 8.0]}
LOADS = {"load": [10.0, 30.0, 50.0, 90.0], "inertia": np.geomspace(1.0, 12.0, 12).tolist()}


@pytest.mark.parametrize(
    ("every", "axis", "parts", "slab", "chunk"),
    [
        (SPEEDS, "speed", (slice(0, 3, 2), slice(1, 4)), 500.0, None),  # 1200 is in both
        (SPEEDS, "inertia", (slice(0, 3, 2), slice(1, 4)), 500.0, None),
        # Copied in ranges of which one archive has no point.
        (LOADS, "load", (slice(0, 2), slice(2, 4)), 100.0, 8),
        (LOADS, "inertia", (slice(0, 6), slice(6, 12)), 100.0, 8),
    ],
)
def test_archives_that_differ_in_one_axis(
    every: Any, axis: str, parts: Any, slab: float, chunk: int | None, tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    monkeypatch.setattr("sweeps.base.netcdf.netcdf_files.SLAB", slab)
    if chunk:
        monkeypatch.setattr("sweeps.running.archive.netcdf.CHUNK", chunk)
    scene = {"engine": "ntua", "output": {"quantities": ["delta", "imep", "load_torque"]}}
    for number, part in enumerate(parts):
        run({**scene, "axes": {**every, axis: every[axis][part]}}, tmp_path / f"{number}.nc")
    ok("merge", tmp_path / "1.nc", tmp_path / "0.nc", "-o", tmp_path / "both.nc")
    assert_same(tmp_path / "both.nc", sweeps.run({**scene, "axes": every}))


def changed(path: Path, target: Path, name: str, place: Any, value: float) -> Path:
    shutil.copy(path, target)
    with netCDF4.Dataset(target, "a") as file:
        file[name][place] = value
    return target


def test_conflicts_are_errors(tmp_path: Path) -> None:
    scene = {"engine": "ntua", "output": {"quantities": ["delta", "imep"]}}
    one, two = tmp_path / "one.nc", tmp_path / "two.nc"
    run({**scene, "axes": {"speed": [1000, 1200]}}, one)
    run({**scene, "axes": {"speed": [1200, 1500]}}, two)
    out = tmp_path / "out.nc"
    bad = changed(two, tmp_path / "bad.nc", "delta", 0, 0.5)
    assert "bad.nc: delta = 0.5, and " in refused("merge", one, bad, "-o", out)
    bad = changed(two, tmp_path / "bad.nc", "status", 0, 1)
    assert "bad.nc: status = 1, and 0 in" in refused("merge", one, bad, "-o", out)
    # What does not depend on the axis is one number in both.
    bad = changed(two, tmp_path / "bad.nc", "imep", (), np.nan)
    assert "bad.nc: imep = nan" in refused("merge", one, bad, "-o", out)
    # NaN on both sides is no conflict.
    also = changed(one, tmp_path / "also.nc", "imep", (), np.nan)
    ok("merge", also, bad, "-o", out)
    for other, said in (
        ({**scene, "axes": {"speed": [1500]}, "set": {"load": 20}}, "[set]"),
        ({**scene, "axes": {"speed": [1500]}, "engine": "b112"}, "engine"),
        ({**scene, "axes": {"load": [50]}}, "[axes]"),
        ({"engine": "ntua", "axes": {"speed": [1500]}, "output": {"quantities": ["delta"]}}, "qua"),
    ):
        run(other, tmp_path / "other.nc", overwrite=True)
        text = refused("merge", one, tmp_path / "other.nc", "-o", tmp_path / "no.nc")
        assert "its scene differs from that of" in text and said in text
    run({**scene, "axes": {"speed": [1500]}}, tmp_path / "other.nc", overwrite=True, single=True)
    assert "numbers" in refused("merge", one, tmp_path / "other.nc", "-o", tmp_path / "no.nc")
    grid = {"speed": [1000, 1200], "inertia": [1, 2]}
    run({**scene, "axes": grid}, tmp_path / "a.nc")
    run({**scene, "axes": {"speed": [1500], "inertia": [3]}}, tmp_path / "b.nc")
    text = refused("merge", tmp_path / "a.nc", tmp_path / "b.nc", "-o", tmp_path / "no.nc")
    assert "more than one axis (speed, inertia)" in text
    assert "two archives or more" in refused("merge", one, "-o", tmp_path / "no.nc")
    assert "exists" in refused("merge", one, two, "-o", out)
    assert "no such file" in refused("merge", one, tmp_path / "none.nc", "-o", tmp_path / "no.nc")
    (tmp_path / "text.nc").write_text("no archive")
    assert "not a netCDF" in refused("merge", one, tmp_path / "text.nc", "-o", tmp_path / "no.nc")
    xr.Dataset({"x": 1.0}).to_netcdf(tmp_path / "plain.nc", engine="netcdf4")
    text = refused("merge", one, tmp_path / "plain.nc", "-o", tmp_path / "no.nc")
    assert "no attribute 'scene'" in text
    assert not list(tmp_path.glob("no.nc*")) and not list(tmp_path.glob("*.partial"))


@pytest.mark.parametrize(
    ("axis", "values"), [("speed", "1300,1100"), ("speed", "900"), ("inertia", "4.2,20,1")]
)
def test_extend_computes_only_what_is_new(
    axis: str, values: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "scene.toml").write_text(TO_JOIN)
    path = tmp_path / "out.nc"
    run(tmp_path / "scene.toml", path, level=1)
    before = sweeps.run(tmp_path / "scene.toml")
    computed = watch_blocks(monkeypatch)
    (tmp_path / "scene.toml").unlink()
    assert f"of {axis}" in ok("extend", path, "--axis", f"{axis}={values}")
    new = [float(v) for v in values.split(",")]
    assert [plan.designs for plan, _ in computed] == [
        before["delta"].size // before.sizes[axis] * len(new)
    ]
    union = np.sort(np.concatenate([before[axis].values, new]))
    scene = tomllib.loads(TO_JOIN)
    expected = sweeps.run({**scene, "axes": {**scene["axes"], axis: union.tolist()}})
    with open_archive(path) as found:
        assert found[axis].values.tolist() == union.tolist()
        for name in expected.variables:
            assert_array_equal(found[name], expected[name])
        assert len(found.attrs["history"].splitlines()) == 3
        # What is there now can be extended again, merged, made again.
        assert json.loads(found.attrs["scene"])["axes"][axis] == union.tolist()
    ok("rerun", path, "-o", tmp_path / "again.nc")
    for each in (path, tmp_path / "again.nc"):
        with netCDF4.Dataset(each) as file:
            assert file["delta"].filters()["complevel"] == 1  # as it was
    with open_archive(path) as first, open_archive(tmp_path / "again.nc") as second:
        xr.testing.assert_equal(first.load(), second.load())
    assert sorted(p.name for p in tmp_path.iterdir()) == ["again.nc", "out.nc"]


def test_extend_refuses(tmp_path: Path) -> None:
    path = tmp_path / "out.nc"
    (tmp_path / "scene.toml").write_text(TO_JOIN)
    run(tmp_path / "scene.toml", path)
    before = path.read_bytes()
    for axis, said in (
        ("speed=1200", "already on the axis"),
        ("speed=1300,1300", "twice"),
        ("speed=-1", "must be a finite number above 0"),
        ("load=50", "not an axis; must be one of speed, inertia"),
        ("speed", "AXIS=VALUE"),
        ("speed=", "AXIS=VALUE"),
        ("speed=fast", "must be a number in rpm"),
        ("speed=nan", "must be a number in rpm"),
    ):
        assert said in refused("extend", path, "--axis", axis), axis
    with netCDF4.Dataset(path, "a") as file:
        found = json.loads(file.identity)
        found["versions"]["kernels"] = "other"
        file.identity = json.dumps(found)
    assert "version of kernels" in refused("extend", path, "--axis", "speed=1300")
    path.write_bytes(before)
    with Partial.of(path).locked(path):
        assert "another run" in refused("extend", path, "--axis", "speed=1300")
        Partial.of(path).remove()
    assert path.read_bytes() == before
    assert sorted(p.name for p in tmp_path.iterdir()) == ["out.nc", "scene.toml"]


def extended(folder: Path, monkeypatch: pytest.MonkeyPatch, blocks: int = 3) -> tuple[Path, str]:
    """An archive whose extension was interrupted after some blocks, and what was said."""
    path = folder / "out.nc"
    (folder / "scene.toml").write_text(LARGE_MAP)
    run(folder / "scene.toml", path)
    before = path.read_bytes()
    with monkeypatch.context() as patch:
        stop_after(patch, blocks, KeyboardInterrupt())
        result = invoke("extend", path, "--axis", EXTENSION)
    assert result.exit_code == 1, result.output
    assert path.read_bytes() == before
    assert len(Partial.of(path).adding().finished()) == blocks
    return path, result.stderr


EXTENSION = "speed=" + ",".join(str(1900 + 10 * i) for i in range(40))


def assert_extended(path: Path) -> None:
    with open_archive(path) as found:
        speeds = found["speed"].values
        assert speeds.size == 140 and (np.diff(speeds) > 0).all()
        raw = json.loads(found.attrs["scene"])
        expected = sweeps.run({**raw, "axes": {**raw["axes"], "speed": speeds.tolist()}})
        for name in expected.data_vars:
            assert_array_equal(found[name], expected[name])


def test_an_extension_killed_at_its_last_moments(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """When all is computed and not put together, and when all is done but the folder is there."""
    path = tmp_path / "out.nc"
    (tmp_path / "scene.toml").write_text(LARGE_MAP)
    run(tmp_path / "scene.toml", path)

    def stop(*_: Any) -> None:
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr("sweeps.running.join.merge._copy", stop)
        assert "to continue" in invoke("extend", path, "--axis", EXTENSION).stderr
    remove = Partial.remove

    def stop_here(self: Partial) -> None:
        stop() if self.path.name == "out.nc.partial" else remove(self)

    with monkeypatch.context() as patch:
        patch.setattr(Partial, "remove", stop_here)
        seen = watch_blocks(patch)
        assert invoke("extend", path, "--axis", EXTENSION).exit_code == 1
    assert seen == []
    assert_extended(path)
    assert (tmp_path / "out.nc.partial" / "added.nc").exists()
    ok("extend", path, "--axis", EXTENSION)
    assert_extended(path)
    assert sorted(p.name for p in tmp_path.iterdir()) == ["out.nc", "scene.toml"]


@pytest.mark.parametrize("name", ["files", "table", "long", "thesis"])
def test_rerun_needs_nothing_but_the_archive(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = tmp_path / "study"
    folder.mkdir()
    scene: Any = {"table": DESIGN_TABLE, "long": LONG, "thesis": "thesis"}.get(name)
    if scene is None:
        pressure = (ENGINES / "diesel_105x137_pressure.csv").read_text()
        (folder / "deep").mkdir()
        (folder / "deep" / "pressure.csv").write_text(pressure)
        (folder / "measured é.csv").write_text(pressure.replace(",1.0", ",1.01"))
        engine = (ENGINES / "diesel_105x137.toml").read_text()
        (folder / "deep" / "my.toml").write_text(
            engine.replace("diesel_105x137_pressure.csv", "../deep/pressure.csv")
        )
        table = "\n".join(f"{0.5 + 0.1 * i!r},number {i}" for i in range(1200))
        (folder / "table.csv").write_text("inertia,case\n" + table)
        (folder / "published.csv").write_text("speed,delta,case\n1200,0.1,number 3\n")
        scene = write_scene(
            folder, ["delta", "imep"], engine="deep/my.toml", designs={"file": "table.csv"},
            axes={"speed": [1200, 1500]}, indicator={"file": "measured é.csv"},
            reference={"file": "published.csv"},
        )  # fmt: skip
    expected = sweeps.run(scene)
    run(scene, tmp_path / "out.nc")
    shutil.rmtree(folder)
    monkeypatch.setattr(Path, "read_bytes", lambda self: pytest.fail(f"{self} is read"))
    ok("rerun", tmp_path / "out.nc", "-o", tmp_path / "again.nc")
    monkeypatch.undo()
    assert_same(tmp_path / "again.nc", expected)
    about = read_contents(tmp_path / "again.nc")
    if name == "files":
        names = {Path(n).name for n in about.files}
        assert names == {"my.toml", "pressure.csv", "measured é.csv", "published.csv"}
        assert about.files["deep/../deep/pressure.csv"].decode() == pressure
    assert of_run(expected.attrs)["scene"] == about.attributes["scene"]


def test_provenance_is_complete(tmp_path: Path) -> None:
    ok("run", "thesis", "-o", tmp_path / "out.nc")
    text = ok("info", tmp_path / "out.nc", "--provenance")
    with netCDF4.Dataset(tmp_path / "out.nc") as file:
        attributes = {name: file.getncattr(name) for name in file.ncattrs()}
    for name in ("scene", "engine", "input_files", "indicator_diagrams", "software", "machine",
                 "history", "command_line", "threading_layer", "seconds", "identity"):  # fmt: skip
        assert attributes[name], name
        assert name in text
    files = json.loads(attributes["input_files"])["files"]
    assert set(files) == {
        "sweeps/catalogue/engines/ntua.toml",
        "sweeps/catalogue/scenes/kakaitsas_tables_5_3_and_5_4.csv",
    }
    assert len(text.splitlines()) < 400 and max(map(len, text.splitlines())) < 1100
    diagrams = json.loads(attributes["indicator_diagrams"])
    assert len(diagrams) == 3 and all(len(d["sha256"]) == 64 for d in diagrams)


@pytest.mark.parametrize("damage", ["text", "json", "hash", "bomb"])
def test_what_is_held_may_be_damaged(damage: str, tmp_path: Path) -> None:
    run("first", tmp_path / "out.nc")
    with netCDF4.Dataset(tmp_path / "out.nc", "a") as file:
        found = json.loads(file.input_files)
        entry = found["files"]["sweeps/catalogue/engines/ntua.toml"]
        if damage == "text":
            entry["text"] += " "
        elif damage == "hash":
            del entry["sha256"]
        elif damage == "bomb":
            import base64
            import zlib

            del entry["text"]
            entry["zlib"] = base64.b64encode(zlib.compress(bytes(1 << 28))).decode()
        file.input_files = "{" if damage == "json" else json.dumps(found)
    text = refused("rerun", tmp_path / "out.nc", "-o", tmp_path / "again.nc")
    assert "damaged" in text
