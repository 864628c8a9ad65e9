"""Laboratory files and their cycles in scenes, archives and the command."""

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from numpy.testing import assert_allclose

import sweeps
from engine_dyn.quantities import graph
from sweeps.base.errors import SceneError
from sweeps.scene.features.indicator import TELLING
from sweeps.scene.features.indicator_files import HEADER
from tests.support.commands import invoke, ok, refused
from tests.support.laboratory import (
    avl,
    excel_german,
    fixed_width,
    four_cylinders,
    matlab,
    rows,
    rows_of_cycles,
    samples,
)
from tests.support.scenes import write_scene


def scene(folder: Path, keys: str, top: str = "") -> Path:
    path = folder / "scene.toml"
    path.write_text(
        f'engine = "ntua"\n{top}\n[indicator]\n{keys}\n[output]\nquantities = ["imep"]\n'
    )
    return path


def test_a_scene_takes_what_import_writes_and_what_it_reads(tmp_path: Path) -> None:
    excel_german(tmp_path / "excel.csv")
    made = ok("import", tmp_path / "excel.csv", "-o", tmp_path / "pressure.csv",
                   "--engine", "ntua")  # fmt: skip
    assert "column 'Kurbelwinkel' taken as the crank angle" in made
    raw = sweeps.read_scene(scene(tmp_path, 'file = "excel.csv"'))
    done = sweeps.read_scene(scene(tmp_path, 'file = "pressure.csv"'))
    assert raw.indicator is not None and done.indicator is not None
    assert np.array_equal(raw.indicator.angle, done.indicator.angle)
    assert np.array_equal(raw.indicator.pressure, done.indicator.pressure)
    assert raw.indicator_notes == done.indicator_notes
    assert raw.indicator_notes[1] == "raw file: excel.csv"


def test_an_archive_holds_the_diagram_and_what_was_done(tmp_path: Path) -> None:
    matlab(tmp_path / "run.mat")
    path = scene(tmp_path, 'file = "run.mat"\nunit = "MPa"\naverage = true\nangle_step = 1.0')
    ok("run", path, "-o", tmp_path / "a.nc")
    (tmp_path / "run.mat").unlink()
    ok("rerun", tmp_path / "a.nc", "-o", tmp_path / "b.nc")
    with sweeps.open(tmp_path / "a.nc") as one, sweeps.open(tmp_path / "b.nc") as other:
        assert float(one.imep) == float(other.imep)
        notes = one.attrs["indicator_notes"].splitlines()
        assert "average of 20 cycles" in notes and notes[2].startswith("sha256 of the raw file: ")
        kept = json.loads(one.attrs["input_files"])["files"]["run.mat"]
    assert kept.get("text", HEADER).startswith(HEADER)
    told = ok("info", tmp_path / "a.nc", "--provenance")
    line = told[told.index("input_files") :].splitlines()
    assert "of the CSV that was made of it" in line[0]
    assert any(f"run.mat: sha256 {kept['sha256']}" in row for row in line[1:])


@pytest.mark.parametrize("head", ["angle_deg,sensor_V\n", "angle [deg],sensor [V]\n"])
@pytest.mark.parametrize("volts", ["10, 0.5", "[10, 0.5]", " [ 10,0.5 ] "])
def test_a_calibration_is_written_as_its_help_says(volts: str, head: str, tmp_path: Path) -> None:
    angle, pressure = samples(-360.0)
    (tmp_path / "v.csv").write_text(head + rows(angle, pressure / 10.0 - 0.05, form=".8f"))
    words = ["import", tmp_path / "v.csv", "-o", tmp_path / "p.csv"]
    ok(*words, "--calibration", volts)
    found = sweeps.read_pressure(tmp_path / "p.csv").mean.pressure[0] / 1e5
    assert np.allclose(found, pressure, atol=1e-5)
    for wrong in ("[10, 0.5", "10", "[]"):
        told = refused(*words, "--overwrite", "--calibration", wrong)
        assert "must be a list of two numbers" in told


@pytest.mark.parametrize("confidential", ["", "\nconfidential = true"])
@pytest.mark.parametrize("form", ["", '\nformat = "fixed_width"'])
def test_an_archive_holds_the_diagram_of_a_file_of_any_ending(
    tmp_path: Path, confidential: str, form: str
) -> None:
    (fixed_width if form else avl)(tmp_path / "run12.prn")
    path = scene(tmp_path, f'file = "run12.prn"{form}{confidential}')
    ok("run", path, "-o", tmp_path / "a.nc")
    words = ["--indicator", tmp_path / "run12.prn"] if confidential else []
    ok("rerun", tmp_path / "a.nc", "-o", tmp_path / "b.nc", *words)
    with sweeps.open(tmp_path / "a.nc") as one, sweeps.open(tmp_path / "b.nc") as other:
        assert float(one.imep) == float(other.imep)


def test_a_confidential_diagram_stays_out_of_the_archive(tmp_path: Path) -> None:
    avl(tmp_path / "avl.csv")
    path = scene(tmp_path, 'file = "avl.csv"\nshift = 1.0\nconfidential = true')
    ok("run", path, "-o", tmp_path / "a.nc")
    with sweeps.open(tmp_path / "a.nc") as archive:
        kept = json.loads(archive.attrs["input_files"])["files"]["avl.csv"]
    assert sorted(kept) == ["samples_sha256", "sha256"]
    assert "confidential" in refused("rerun", tmp_path / "a.nc", "-o", tmp_path / "b.nc")
    excel_german(tmp_path / "other.csv")
    assert "not the diagram" in refused(
        "rerun", tmp_path / "a.nc", "-o", tmp_path / "b.nc", "--indicator", tmp_path / "other.csv"
    )
    assert not (tmp_path / "b.nc").exists()
    ok("rerun", tmp_path / "a.nc", "-o", tmp_path / "b.nc", "--indicator",
                    tmp_path / "avl.csv")  # fmt: skip
    with sweeps.open(tmp_path / "a.nc") as one, sweeps.open(tmp_path / "b.nc") as other:
        assert float(one.imep) == float(other.imep)
        kept = json.loads(other.attrs["input_files"])["files"]["avl.csv"]
    assert "text" not in kept and "zlib" not in kept


"""Beside a confidential diagram: all cylinders, single numbers, and what has no pressure in it."""


def test_no_curve_of_one_cylinder_escapes() -> None:
    """By the words of the graph, which the set is not made from.

    Curves of one cylinder, throw or bearing are refused, but for those of masses and geometry.
    """
    masses = (
        "inertia", "rod_couple", "acceleration", "velocity", "position", "rod_angle",
        "cylinder_volume", "crosshead_inertia_load",
        "crank_end_pressure",  # the crankcase's, wherever [indicator] is allowed
    )  # fmt: skip
    of_one = {
        name
        for name, node in graph.ALL_QUANTITIES.items()
        if node.kind == "curve"
        and re.search("cylinder 1|one cylinder|main.journal|each throw", node.long_name)
        and not name.startswith(masses)
    }
    curves = {name for name in TELLING if graph.ALL_QUANTITIES[name].kind == "curve"}
    assert curves == of_one


def test_confidential_notes_tell_no_pressure(tmp_path: Path) -> None:
    angle, pressure = samples(-360.0)
    (tmp_path / "p.csv").write_text("CA [deg],p [bar]\n" + rows(angle, np.minimum(pressure, 40.0)))
    ok("import", tmp_path / "p.csv", "-o", tmp_path / "made.csv")
    assert "imep" in (tmp_path / "made.csv").read_text()
    for name in ("p.csv", "made.csv"):
        open_ = sweeps.read_scene(scene(tmp_path, f'file = "{name}"'))
        assert any(": imep " in note for note in open_.indicator_notes)
        path = scene(tmp_path, f'file = "{name}"\nconfidential = true')
        run = invoke("run", path, "-o", tmp_path / f"{name}.nc")
        assert run.exit_code == 0, run.output
        assert "\nimep  " in run.stdout  # which the scene asks for
        with sweeps.open(tmp_path / f"{name}.nc") as archive:
            notes, warnings = archive.attrs["indicator_notes"], archive.attrs["warnings"]
        assert "raw file: p.csv" in notes and "sha256" in notes and "clipped" in notes
        for text in (notes, warnings, run.stderr):
            assert "imep " not in text and not re.search(r"\d bar", text), text


def test_import_replaces_nothing_unasked_and_leaves_nothing_half(tmp_path: Path) -> None:
    avl(tmp_path / "avl.csv")
    before = (tmp_path / "avl.csv").read_bytes()
    assert "is the raw file" in refused(
        "import", tmp_path / "avl.csv", "-o", tmp_path / "avl.csv", "--overwrite"
    )
    for words in (["--unit", "kg"], ["--angle-step", "x"], ["--cycle", "0"], ["--shift", "1e9"]):
        refused("import", tmp_path / "avl.csv", "-o", tmp_path / "new" / "p.csv", *words)
    assert [p.name for p in tmp_path.iterdir()] == ["avl.csv"]
    assert (tmp_path / "avl.csv").read_bytes() == before
    for name in ("p.xlsx", "p.nc", "p.MAT", "p.parquet", "p.png"):
        told = refused("import", tmp_path / "avl.csv", "-o", tmp_path / name)
        assert f"{name}: -o must name a text file, such as pressure.csv" in told
    for wrong in ("97", "-1", "970", "0"):
        told = refused("import", tmp_path / "avl.csv", "-o", tmp_path / "p.csv",
                       "--pegging", "inlet", "--inlet-pressure", wrong)  # fmt: skip
        assert f"--inlet-pressure = {wrong}: must be a number above 0 and up to 20, in bar" in told
    words = ["import", tmp_path / "avl.csv", "-o", tmp_path / "new" / "p.csv"]
    ok(*words)
    # The file that exists is said before anything is read.
    (tmp_path / "avl.csv").write_text("no numbers")
    assert "--overwrite" in refused(*words)


COUNT = 5
QUANTITIES = ["delta", "imep", "peak_pressure", "omega"]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("recorded")
    rows_of_cycles(folder / "run.csv")
    return folder


def recorded(folder: Path, **tables: Any) -> dict[str, Any]:
    return {
        "engine": "ntua",
        "indicator": {"file": str(folder / "run.csv"), "unit": "bar", **tables.pop("keys", {})},
        "output": {"quantities": QUANTITIES},
        **tables,
    }


@pytest.fixture(scope="module")
def cycles(folder: Path) -> xr.Dataset:
    axes = {"recorded_cycle": list(range(1, COUNT + 1)), "inertia": [2.0, 4.0]}
    return sweeps.run(recorded(folder, axes=axes))


def test_each_cycle_is_that_cycle_alone_and_all_scatter_about_their_mean(
    folder: Path, cycles: xr.Dataset
) -> None:
    assert cycles["delta"].dims == ("recorded_cycle", "inertia")
    assert cycles["imep"].dims == cycles["peak_pressure"].dims == ("recorded_cycle",)
    assert (cycles["status"] == 0).all()
    for number in (1, 4):
        alone = sweeps.run(recorded(folder, keys={"cycle": number}, axes={"inertia": [2.0, 4.0]}))
        here = cycles.sel(recorded_cycle=number)
        for name in QUANTITIES:
            assert_allclose(here[name], alone[name], rtol=2e-6)
    mean = sweeps.run(recorded(folder, keys={"average": True}, axes={"inertia": [2.0, 4.0]}))
    assert len(np.unique(cycles["imep"])) == COUNT
    # imep is linear in the pressure, delta nearly so.
    assert float(cycles["imep"].mean()) == pytest.approx(float(mean["imep"]), rel=1e-6)
    off = cycles["delta"].mean("recorded_cycle") / mean["delta"] - 1.0
    assert (np.abs(off) < 0.01).all() and (cycles["delta"].std("recorded_cycle") > 0.0).all()
    # Numbers do not depend on which cycles are asked for.
    some = sweeps.run(recorded(folder, axes={"recorded_cycle": [4, 2], "inertia": [2.0]}))
    for name in QUANTITIES:
        there = cycles[name].sel(recorded_cycle=[4, 2])
        there = there.sel(inertia=[2.0]) if "inertia" in there.dims else there
        assert (some[name].values == there.values).all(), name


def test_what_has_no_such_cycles_is_refused(folder: Path, tmp_path: Path) -> None:
    with pytest.raises(SceneError, match=r"recorded_cycle = 6: must be from 1 to 5"):
        sweeps.run(recorded(folder, axes={"recorded_cycle": [1, 6]}))
    with pytest.raises(SceneError, match=r"recorded_cycle.*must be from 1 to 1"):
        sweeps.run(recorded(folder, keys={"average": True}, axes={"recorded_cycle": [1, 2]}))
    with pytest.raises(SceneError, match="recorded_cycle: needs \\[indicator\\]"):
        sweeps.run({"engine": "ntua", "axes": {"recorded_cycle": [1]},
                    "output": {"quantities": ["delta"]}})  # fmt: skip
    four_cylinders(tmp_path / "four.csv")
    wrong = recorded(folder, axes={"recorded_cycle": [1]})
    wrong["indicator"] = {"file": str(tmp_path / "four.csv")}
    with pytest.raises(SceneError, match="recorded cycles of 4 cylinders; must be of one"):
        sweeps.run(wrong)
    path = write_scene(tmp_path, axes={"recorded_cycle": [1.5]})
    assert "recorded_cycle = 1.5" in refused("run", path, "-o", tmp_path / "a.nc")
