"""Archives: how they are written, interrupted, compared, and made without computing."""

import json
import tempfile
import tomllib
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

import sweeps
from sweeps.running.archive import netcdf
from sweeps.running.archive.labels import label
from sweeps.running.archive.partial import Partial
from sweeps.running.compute import into_archive, limits
from sweeps.running.compute.computation import Computation
from sweeps.running.compute.options import Options, Stopped
from sweeps.running.join.merge import merge
from sweeps.scene.plan.blocks import Block, Results
from sweeps.scene.plan.plan import Plan, make_plan
from sweeps.scene.plan.shards import shard
from sweeps.scene.reading import read_scene

from .commands import ok
from .scenes import MAP


def of_run(attributes: dict[str, Any]) -> dict[str, Any]:
    """Attributes without those that no two runs share."""
    left = {k: v for k, v in attributes.items() if k not in ("history", "seconds", "command_line")}
    # Where the scene lies does not matter, what it names does.
    return {**left, "input_files": json.loads(left["input_files"])["files"]}


def assert_same(path: Path, expected: xr.Dataset) -> None:
    """The same variables to the byte, the same labels."""
    with netcdf.open_archive(path) as opened:
        found = opened.load()
    expected = expected.copy()
    found.attrs, expected.attrs = of_run(found.attrs), of_run(expected.attrs)
    xr.testing.assert_identical(found, expected)
    for name, variable in expected.variables.items():
        if variable.dtype.kind != "O":
            assert found[name].dtype == variable.dtype, name
            assert found[name].values.tobytes() == variable.values.tobytes(), name


def plan_of(folder: Path, text: str = MAP) -> Plan:
    path = folder / "scene.toml"
    path.write_text(text)
    return make_plan(read_scene(path))


def run(scene: Any, path: Path, **options: Any) -> None:
    into_archive.run(make_plan(read_scene(scene)), path, Options(**options))


def shards(scene: Any, count: int, folder: Path, **options: Any) -> list[Path]:
    """Archives of all shards of a scene."""
    plan = make_plan(read_scene(scene))
    paths = [folder / f"shard_{number}.nc" for number in range(1, count + 1)]
    for number, path in enumerate(paths, start=1):
        into_archive.run(shard(plan, number, count), path, Options(**options))
    return paths


def assert_same_in_parts(scene: Any, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """In memory, in an archive, in shards, computed again and in blocks: the same bits."""
    whole = folder / "whole.nc"
    run(scene, whole)
    with netcdf.open_archive(whole) as opened:
        expected = opened.load()
    xr.testing.assert_equal(sweeps.run(scene), expected)
    merge(shards(scene, 2, folder), folder / "merged.nc", Options())
    assert_same(folder / "merged.nc", expected)
    ok("rerun", whole, "-o", folder / "again.nc")
    assert_same(folder / "again.nc", expected)
    monkeypatch.setattr(limits, "LARGEST_BLOCK", 2e3)
    run(scene, folder / "blocks.nc")
    assert_same(folder / "blocks.nc", expected)


def stop_after(monkeypatch: pytest.MonkeyPatch, blocks: int, error: BaseException) -> None:
    """Let so many blocks be written, then raise."""
    write = Partial.write
    count = [0]

    def counted(self: Partial, *arguments: Any) -> int:
        count[0] += 1
        if count[0] > blocks:
            raise error
        return write(self, *arguments)

    monkeypatch.setattr(Partial, "write", counted)


def watch_blocks(monkeypatch: pytest.MonkeyPatch) -> list[tuple[Plan, Block]]:
    """Blocks that are computed from now on, each with its plan; the list grows."""
    seen: list[tuple[Plan, Block]] = []
    results = Computation.results

    def watched(self: Computation, block: Block) -> Results:
        seen.append((self.plan, block))
        return results(self, block)

    monkeypatch.setattr(Computation, "results", watched)
    return seen


def interrupted(plan: Plan, output: Path, monkeypatch: pytest.MonkeyPatch, blocks: int = 3) -> None:
    """Leave an interrupted run."""
    with monkeypatch.context() as patch:
        stop_after(patch, blocks, KeyboardInterrupt())
        with pytest.raises(Stopped, match=rf"{blocks} of \d+ blocks are finished"):
            into_archive.run(plan, output, Options())
    assert not output.exists()
    assert len(Partial.of(output).finished()) == blocks


SMALL: dict[str, Any] = {
    "title": "small",
    "engine": "diesel_105x137",
    "axes": {"speed": [1500, 1600, 1700], "inertia": [1.0, 2.0]},
    "solver": {"method": ["auto", "newton"]},
    "output": {"quantities": ["delta", "omega", "imep", "gas_torque"], "angle_step": 30},
}

PLAIN = """\
engine = "diesel_105x137"

[axes]
speed = { start = 1000, stop = 2000, num = 40 }
stroke = { start = 0.1, stop = 0.2, num = 40 }

[output]
quantities = ["mean_piston_speed"]
"""
"""A scene that needs no compiled kernel."""


@cache
def sound_archive(part: bool = False) -> bytes:
    """An archive of `SMALL`, or of one of its shards, whose numbers nobody computed."""
    plan = make_plan(read_scene(SMALL))
    if part:
        plan = shard(plan, 1, 3)
    results = {}
    for name in plan.outputs:
        shape = tuple(plan.sizes[d] for d in plan.dims(name))
        results[name] = (
            np.zeros(shape, "i1") if name == "status" else 1.0 + np.indices(shape).sum(0)
        )
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "sound.nc"
        netcdf.write(label(plan, results, seconds=1.0), path)
        return path.read_bytes()


@cache
def interrupted_files() -> dict[str, bytes]:
    """Files of an interrupted run of `PLAIN`, by their names, without its lock."""
    with tempfile.TemporaryDirectory() as folder, pytest.MonkeyPatch.context() as patch:
        output = Path(folder) / "interrupted.nc"
        patch.setattr(limits, "LARGEST_BLOCK", 4e3)
        stop_after(patch, 3, KeyboardInterrupt())
        with suppress(Stopped):
            into_archive.run(make_plan(read_scene(tomllib.loads(PLAIN))), output, Options())
        found = Partial.of(output).path.iterdir()
        return {path.name: path.read_bytes() for path in found if path.name != "lock"}
