"""Evaluated recordings as Datasets, and the sheet that is drawn of them."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from numpy.testing import assert_allclose

import sweeps
from engine_dyn.recordings.heat_release import mean_pressures
from engine_dyn.recordings.recorded_cycles import RecordedCycles
from engine_dyn.recordings.signal_checks import examine
from sweeps.figures import draw
from sweeps.figures.kinds import figures_of
from sweeps.figures.study import study_of
from sweeps.reading.laboratory.evaluation import evaluated
from tests.support import recorded_engine as engine
from tests.support.laboratory import rows, samples


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


def test_it_is_an_archive_that_can_be_written(tmp_path: Path) -> None:
    data = evaluated(engine.cycles(1.0, 2), engine.GEOMETRY)
    data.to_netcdf(tmp_path / "recording.nc", engine="netcdf4")
    with xr.open_dataset(tmp_path / "recording.nc", engine="netcdf4") as found:
        xr.testing.assert_allclose(found, data)


def test_the_sheets_of_many_cycles_and_of_one() -> None:
    data = evaluated(engine.cycles(1.0, 30, noise=2e4), engine.GEOMETRY)
    assert titles(data) == [
        "Whole cycle", "Around firing dead centre", "p - V", "log p - log V",
        "Rate of apparent heat release", "Apparent net heat released",
        "Imep, mean and standard deviation", "Largest pressure over its angle",
    ]  # fmt: skip
    # The sheet of one cycle without a compression ratio.
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


def test_a_two_stroke_recording() -> None:
    angle = np.arange(-180.0, 180.0, 1.0) * engine.DEGREE
    volume = engine.volume(angle)
    p = 1e5 * (volume.max() / volume) ** np.where(angle < 0.0, 1.35, 1.2)
    cycles = RecordedCycles(angle, np.tile(p, (2, 1)), 2.0 * np.pi)
    data = evaluated(cycles, engine.GEOMETRY)
    assert data.compression_exponent.attrs["from_angle"] == -85.0
    assert float(data.compression_exponent) == pytest.approx(1.35)
    assert float(data.expansion_exponent) == pytest.approx(1.2)
    figure(data)


def test_findings_stand_below_the_figure() -> None:
    cycles = engine.cycles(0.5, shift=6.0)
    data = evaluated(cycles, engine.GEOMETRY, findings=examine(cycles, engine.GEOMETRY))
    texts = " ".join(text.get_text().replace("\n", " ") for text in figure(data).texts)
    assert "dead_centre: compression and expansion" in texts
    assert "imep" in texts


def test_pressures_that_are_not_positive_are_drawn_too(tmp_path: Path) -> None:
    cycles = engine.cycles(1.0)
    gauge = RecordedCycles(cycles.angle, cycles.pressure - 2e5)
    data = evaluated(gauge, engine.GEOMETRY)
    assert "compression_exponent" not in data
    names = {path.stem for path in draw(data, tmp_path)}
    assert "recorded_pressure" in names


def test_a_ratio_that_the_scene_sets_makes_a_logarithmic_diagram() -> None:
    angle = np.arange(-180.0, 180.0, 2.0)
    travel = 1.0 - np.cos(np.radians(angle))
    data = xr.Dataset(
        {
            "pressure": ("crank_angle", 1.0 + 50.0 * np.exp(-((angle / 40.0) ** 2))),
            "position": ("crank_angle", travel),
        },
        {"crank_angle": angle},
    )
    for parameters, count in (("", 1), ('{"compression_ratio": 11.0}', 2), ("[]", 1)):
        data.attrs["parameters"] = parameters
        found = dict(figures_of(study_of(data, {})))["work_diagrams"]
        assert len(found.axes) == count
    data.attrs["parameters"] = '{"compression_ratio": 11.0}'
    panel = dict(figures_of(study_of(data, {})))["work_diagrams"].axes[1]
    assert np.min(panel.lines[0].get_xdata()) == pytest.approx(0.1)


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
