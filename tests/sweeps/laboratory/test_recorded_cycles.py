"""Recorded cycles as an axis: each as if it repeated for ever."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from numpy.testing import assert_allclose

import sweeps
from sweeps.errors import SceneError
from sweeps.presenting.archives import recorded_cycle_lines
from tests.support.commands import ok, refused
from tests.support.laboratory import four_cylinders, rows_of_cycles
from tests.support.scenes import write_scene

COUNT = 5
QUANTITIES = ["delta", "imep", "peak_pressure", "omega"]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("recorded")
    rows_of_cycles(folder / "run.csv")
    return folder


def scene(folder: Path, **tables: Any) -> dict[str, Any]:
    return {
        "engine": "ntua",
        "indicator": {"file": str(folder / "run.csv"), "unit": "bar", **tables.pop("keys", {})},
        "output": {"quantities": QUANTITIES},
        **tables,
    }


@pytest.fixture(scope="module")
def cycles(folder: Path) -> xr.Dataset:
    axes = {"recorded_cycle": list(range(1, COUNT + 1)), "inertia": [2.0, 4.0]}
    return sweeps.run(scene(folder, axes=axes))


def test_each_cycle_is_that_cycle_alone_and_all_scatter_about_their_mean(
    folder: Path, cycles: xr.Dataset
) -> None:
    assert cycles["delta"].dims == ("recorded_cycle", "inertia")
    assert cycles["imep"].dims == cycles["peak_pressure"].dims == ("recorded_cycle",)
    assert (cycles["status"] == 0).all()
    for number in (1, 4):
        alone = sweeps.run(scene(folder, keys={"cycle": number}, axes={"inertia": [2.0, 4.0]}))
        here = cycles.sel(recorded_cycle=number)
        for name in QUANTITIES:
            assert_allclose(here[name], alone[name], rtol=2e-6)
    mean = sweeps.run(scene(folder, keys={"average": True}, axes={"inertia": [2.0, 4.0]}))
    assert len(np.unique(cycles["imep"])) == COUNT
    # imep is linear in the pressure, delta nearly so.
    assert float(cycles["imep"].mean()) == pytest.approx(float(mean["imep"]), rel=1e-6)
    off = cycles["delta"].mean("recorded_cycle") / mean["delta"] - 1.0
    assert (np.abs(off) < 0.01).all() and (cycles["delta"].std("recorded_cycle") > 0.0).all()
    # Numbers do not depend on which cycles are asked for.
    some = sweeps.run(scene(folder, axes={"recorded_cycle": [4, 2], "inertia": [2.0]}))
    for name in QUANTITIES:
        there = cycles[name].sel(recorded_cycle=[4, 2])
        there = there.sel(inertia=[2.0]) if "inertia" in there.dims else there
        assert (some[name].values == there.values).all(), name


def test_run_and_info_tell_the_spread(folder: Path, cycles: xr.Dataset, tmp_path: Path) -> None:
    cycles.to_netcdf(tmp_path / "cycles.nc")
    text = ok("info", tmp_path / "cycles.nc")
    told = {line.split(":")[0].strip(): line.split(": ")[1] for line in text.splitlines()
            if line.endswith(f"; {COUNT} cycles")}  # fmt: skip
    assert set(told) == {"delta at inertia 2", "delta at inertia 4", "imep", "peak_pressure"}
    works = cycles["imep"]
    share = 100.0 * float(works.std(ddof=1) / works.mean())
    assert f"({share:.1f} %) bar" in told["imep"]
    assert told["delta at inertia 2"].startswith(f"{float(cycles.delta[:, 0].mean()):.5f}"[:6])
    lines = recorded_cycle_lines(cycles.isel(recorded_cycle=[0]))
    assert lines == []  # one cycle has no spread


def test_archives_hold_all_cycles(folder: Path, tmp_path: Path) -> None:
    (tmp_path / "run.csv").write_bytes((folder / "run.csv").read_bytes())
    table = {"file": "run.csv", "unit": "bar"}
    path = write_scene(tmp_path, axes={"recorded_cycle": [1, 5]}, indicator=table)
    ok("run", path, "-o", tmp_path / "a.nc")
    (tmp_path / "run.csv").unlink()
    ok("rerun", tmp_path / "a.nc", "-o", tmp_path / "b.nc")
    ok("extend", tmp_path / "b.nc", "--axis", "recorded_cycle=3")
    with sweeps.open(tmp_path / "a.nc") as one, sweeps.open(tmp_path / "b.nc") as other:
        assert other["recorded_cycle"].values.tolist() == [1, 3, 5]
        assert (one["delta"].values == other["delta"].sel(recorded_cycle=[1, 5]).values).all()


def test_what_has_no_such_cycles_is_refused(folder: Path, tmp_path: Path) -> None:
    with pytest.raises(SceneError, match=r"recorded_cycle = 6: must be from 1 to 5"):
        sweeps.run(scene(folder, axes={"recorded_cycle": [1, 6]}))
    with pytest.raises(SceneError, match=r"recorded_cycle.*must be from 1 to 1"):
        sweeps.run(scene(folder, keys={"average": True}, axes={"recorded_cycle": [1, 2]}))
    with pytest.raises(SceneError, match="recorded_cycle: needs \\[indicator\\]"):
        sweeps.run({"engine": "ntua", "axes": {"recorded_cycle": [1]},
                    "output": {"quantities": ["delta"]}})  # fmt: skip
    four_cylinders(tmp_path / "four.csv")
    wrong = scene(folder, axes={"recorded_cycle": [1]})
    wrong["indicator"] = {"file": str(tmp_path / "four.csv")}
    with pytest.raises(SceneError, match="recorded cycles of 4 cylinders; must be of one"):
        sweeps.run(wrong)
    path = write_scene(tmp_path, axes={"recorded_cycle": [1.5]})
    assert "recorded_cycle = 1.5" in refused("run", path, "-o", tmp_path / "a.nc")
