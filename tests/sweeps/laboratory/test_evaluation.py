"""Evaluated recordings, their sheet, and what `import` takes from an engine."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from numpy.testing import assert_allclose

import sweeps
from engine_dyn.recordings.heat_release import mean_pressures
from sweeps.lab.pressure.evaluation import evaluated
from sweeps.lab.pressure.reading import read_pressure
from sweeps.scene.engine.engine_files import load_engine
from sweeps.view.figures.kinds import figures_of
from sweeps.view.figures.study import study_of
from tests.support import recorded_engine as engine
from tests.support.laboratory import four_cylinders, imep, own, rows, samples


def figure(data: xr.Dataset) -> object:
    return dict(figures_of(study_of(data, {})))["recorded_pressure"]


def titles(data: xr.Dataset) -> list[str]:
    drawn = [panel for panel in figure(data).axes if panel.get_visible() and panel.axison]
    return [panel.get_title() for panel in drawn]


def test_values_are_those_of_the_cycles() -> None:
    cycles = engine.cycles(1.0, 5, noise=2e3, gamma=1.35, fall=0.0, loss=0.0, heat=1500.0)
    data = evaluated(cycles, engine.GEOMETRY)  # with the same ratio of specific heats
    works = mean_pressures(cycles, engine.GEOMETRY)
    assert_allclose(data.imep_of_cycle, works.net / 1e5)
    assert_allclose(data.cylinder_volume, engine.volume(cycles.angle) * 1e6)
    assert float(data.imep) == pytest.approx(float(data.imep_gross + data.imep_pumping))
    assert float(data.heat_released.max()) == pytest.approx(1500.0, rel=0.01)
    assert data.pressure.dims == ("crank_angle",)
    for name in data.data_vars:
        assert {"long_name", "units"} <= set(data[name].attrs), name


def test_the_sheets_of_many_cycles_and_of_one() -> None:
    data = evaluated(engine.cycles(1.0, 30, noise=2e4), engine.GEOMETRY)
    assert titles(data) == [
        "Whole cycle", "Around firing dead centre", "p - V", "log p - log V",
        "Rate of apparent heat release", "Apparent net heat released",
        "Imep, mean and standard deviation", "Largest pressure over its angle",
    ]  # fmt: skip
    geometry = replace(engine.GEOMETRY, compression_ratio=None)
    data = evaluated(engine.cycles(1.0), geometry)
    assert "cylinder_volume" not in data
    assert titles(data) == ["Whole cycle", "Around firing dead centre", "p - V"]


@pytest.mark.parametrize("ratio", [None, 16.0])
def test_without_bore_and_stroke_volumes_are_relative(ratio: float | None, tmp_path: Path) -> None:
    """They were those of a cylinder of 1 m, with its heat in joules."""
    angle, pressure = samples(-360.0)
    (tmp_path / "p.csv").write_text("CA [deg],p [bar]\n" + rows(angle, pressure))
    keys = {"compression_ratio": ratio} if ratio else {}
    crank_ratio = engine.GEOMETRY.crank_ratio
    found = sweeps.read_pressure(tmp_path / "p.csv", crank_ratio=crank_ratio, **keys)
    assert not found.sized
    cycles = found.recorded["p"]
    data = evaluated(cycles, found.geometry, sized=found.sized)
    clearance = engine.SWEPT / (engine.RATIO - 1.0)
    expected = (engine.volume(cycles.angle) - (0.0 if ratio else clearance)) / engine.SWEPT
    name = "relative_volume" if ratio else "relative_displaced_volume"
    assert_allclose(data[name], expected, atol=1e-12)
    assert data[name].attrs["units"] == "1"
    assert not {"cylinder_volume", "displaced_volume", "heat_released"} & set(data)
    logarithmic = ["log p - log V"] if ratio else []
    assert titles(data) == ["Whole cycle", "Around firing dead centre", "p - V", *logarithmic]
    told = " ".join(text.get_text() for text in figure(data).texts).replace("\n", " ")
    assert "bore and stroke unknown: relative volume, no heat release" in told
    known = sweeps.read_pressure(tmp_path / "p.csv", engine="ntua")
    assert known.sized


@pytest.mark.parametrize("ratio", [False, True])
def test_work_diagrams_of_an_archive(ratio: bool) -> None:
    angle = np.arange(-360.0, 360.0, 2.0)
    travel = 1.0 - np.cos(np.radians(angle))
    p = 1.0 + 50.0 * np.exp(-((angle / 40.0) ** 2))
    axis = "compression_ratio" if ratio else "load"
    values = [10.0, 16.0] if ratio else [50.0, 100.0]
    data = xr.Dataset(
        {
            "pressure": ((axis, "crank_angle"), [p, 1.5 * p], {"long_name": "p", "units": "bar"}),
            "position": ("crank_angle", travel, {"long_name": "x/r", "units": "1"}),
        },
        {axis: values, "crank_angle": angle},
    )
    drawn = dict(figures_of(study_of(data, {})))
    found = next(figure for name, figure in drawn.items() if name.startswith("work_diagrams"))
    panels = [panel for panel in found.axes if panel.lines]
    assert len(panels) == 1 + ratio
    x = np.asarray(panels[0].lines[0].get_xdata(), dtype=float)
    lowest = 1.0 / (values[0] - 1.0) if ratio else 0.0
    assert x.min() == pytest.approx(lowest, abs=1e-12)
    assert x.max() == pytest.approx(lowest + 1.0)
    if ratio:
        assert panels[1].get_xscale() == panels[1].get_yscale() == "log"


OWN = """\
title = "An engine that is yet to be measured"
cycle = "four-stroke"
firing_order = [1, 3, 4, 2]

[values]
bore = 0.1
stroke = 0.12
rod_length = 0.21
cylinders = 4
"""


def written(folder: Path, more: str = "") -> str:
    (folder / "mine.toml").write_text(OWN + more)
    return str(folder / "mine.toml")


def test_engines_need_no_diagrams_and_give_measures_and_firing_angles(tmp_path: Path) -> None:
    own(tmp_path / "raw.csv")
    found = read_pressure(tmp_path / "raw.csv", engine=written(tmp_path))
    assert found.geometry.crank_ratio == pytest.approx(engine.GEOMETRY.crank_ratio)
    assert (found.geometry.bore, found.geometry.stroke) == (0.1, 0.12)
    assert found.geometry.compression_ratio is None
    assert not any("assumed" in line for line in found.warnings)
    four_cylinders(tmp_path / "four.csv")
    told = read_pressure(tmp_path / "four.csv", engine=written(tmp_path)).steps
    assert "cylinders fire at 0, 540, 180, 360 degree, from the engine file" in told
    own(tmp_path / "raw.csv")
    by_name = read_pressure(tmp_path / "raw.csv", engine="boxer_twin_101x70").geometry
    loaded = read_pressure(tmp_path / "raw.csv", engine=load_engine("boxer_twin_101x70")).geometry
    assert by_name == loaded
    assert by_name.compression_ratio == 10.3


def test_less_torque_than_at_the_shaft_is_warned_of(tmp_path: Path) -> None:
    """A pressure two degrees early does that, and nothing else told of it."""
    own(tmp_path / "raw.csv")
    keys = {"engine": written(tmp_path)}
    angle, pressure = samples(-360.0)
    works = {}
    for shift in (0.0, -2.0):
        moved = np.interp(angle - shift, angle, pressure, period=720.0)
        mean_pressure = imep(angle * engine.DEGREE, moved * 1e5) * 1e5
        works[shift] = mean_pressure * engine.SWEPT * 4.0 / (4.0 * np.pi)
    brake = 0.95 * works[0.0]
    assert works[-2.0] < brake
    for shift, count in ((0.0, 0), (-2.0, 1)):
        found = read_pressure(tmp_path / "raw.csv", shift=shift, brake_torque=brake, **keys)
        told = [line for line in found.warnings if line.startswith("brake_torque: ")]
        assert len(told) == count
        agreed = [line for line in found.steps if "mechanical efficiency" in line]
        assert len(agreed) == 1 - count
        assert all(line.endswith(f"mechanical efficiency {0.95:.1%}") for line in agreed)
    indicated = float(told[0].split("indicated torque is ")[1].split(" N m")[0])
    assert indicated == pytest.approx(works[-2.0], rel=3e-3)
    assert f"less than the {brake:.4g} N m at the shaft" in told[0]
    with pytest.raises(sweeps.SceneError, match="needs an engine with bore, stroke and cylinders"):
        read_pressure(tmp_path / "raw.csv", brake_torque=brake)


def test_what_is_no_engine_is_refused(tmp_path: Path) -> None:
    own(tmp_path / "raw.csv")
    for name, said in (("ntuaa", "unknown engine"), (str(tmp_path / "no.toml"), "no such file")):
        with pytest.raises(sweeps.SceneError, match=said):
            read_pressure(tmp_path / "raw.csv", engine=name)
    path = written(tmp_path)
    (tmp_path / "mine.toml").write_text(OWN.replace("bore = 0.1", "bore = -1"))
    with pytest.raises(sweeps.SceneError, match="bore = -1"):
        read_pressure(tmp_path / "raw.csv", engine=path)


def test_notes_on_a_confidential_recording_hold_no_work(tmp_path: Path) -> None:
    """Neither torques nor what a degree is worth, from which the imep follows."""
    from sweeps.scene.features.indicator import without_pressures

    own(tmp_path / "raw.csv")
    found = read_pressure(
        tmp_path / "raw.csv", engine=written(tmp_path), brake_torque=1.0, pegging="inlet",
        inlet_pressure=1.0,
    )  # fmt: skip
    kept = without_pressures(found.steps)
    (torque,) = [one for one in kept if "mechanical efficiency" in one]
    (worth,) = [one for one in kept if " of imep" in one]
    assert not any(letter.isdigit() for letter in torque)
    assert "is worth ... bar (...%) of imep" in worth
