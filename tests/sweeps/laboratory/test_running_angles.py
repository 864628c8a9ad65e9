"""Recordings whose angle runs over several cycles that differ: samples of two are never mixed."""

from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from sweeps.reading.laboratory.imported_pressure import ImportedPressure
from sweeps.reading.pressure_recordings import read_pressure
from tests.support import recorded_engine
from tests.support.laboratory import DEGREE, imep, rows

HEATS = (300.0, 1500.0, 900.0, 600.0)
"""Of the cycles that fire at 0, at one period, at two and so on [J]."""

FINE = np.arange(-360.0, 360.0, 0.1)


@cache
def one_cycle(heat: float) -> Any:
    return recorded_engine.pressure(FINE * DEGREE, heat=heat)


def true_imep(heat: float, period: float = 720.0) -> float:
    inside = np.abs(FINE + 1e-6) < 0.5 * period
    return imep(FINE[inside] * DEGREE, one_cycle(heat)[inside])


def running(angle: Any, period: float = 720.0) -> Any:
    """Pressures [bar] of cycles with different heats, the first fires at 0."""
    number = np.floor(angle / period + 0.5).astype(int)
    pressures = [
        np.interp(angle - k * period, FINE, one_cycle(heat), period=720.0)
        for k, heat in enumerate(HEATS)
    ]
    return np.choose(number, pressures) / 1e5


def read(path: Path, angle: Any, pressure: Any, **options: Any) -> ImportedPressure:
    path.write_text("CA [deg],p [bar]\n" + rows(angle, pressure))
    return read_pressure(path, **options)


def works(found: ImportedPressure) -> list[float]:
    cycles = found.recorded["p"]
    return [imep(cycles.angle, pressure) for pressure in cycles.pressure]


FORMS = {
    "running": lambda angle: angle,
    "running from -360": lambda angle: angle - 720.0,
    "begins again at 720": lambda angle: angle % 720.0,
    "begins again at 360": lambda angle: angle % 360.0,
    "begins again at -360": lambda angle: (angle + 360.0) % 720.0 - 360.0,
    "falls": lambda angle: -angle,
}


@pytest.mark.parametrize("step", [0.5, 0.7])
@pytest.mark.parametrize("form", FORMS)
def test_of_one_and_a_half_cycles_the_whole_one_is_taken(
    form: str, step: float, tmp_path: Path
) -> None:
    """Both were folded onto one another: samples of the two cycles took turns."""
    angle = np.arange(0.0, 1080.0 + 1e-9, step)
    found = read(tmp_path / "a.csv", FORMS[form](angle), running(angle))
    assert works(found) == pytest.approx([true_imep(1500.0)], rel=2e-3)
    assert any("first 360 degree are no whole cycle" in line for line in found.steps)


@pytest.mark.parametrize("form", ["running", "begins again at 720"])
@pytest.mark.parametrize("end", [1080.0, 1152.0, 1500.0])
def test_rows_in_reverse_order_are_turned(form: str, end: float, tmp_path: Path) -> None:
    """They were counted backward: the work came out negative, of a little burnt "motored"."""
    angle = np.arange(0.0, end + 1e-9, 0.5)
    found = read(tmp_path / "a.csv", FORMS[form](angle)[::-1], running(angle)[::-1])
    assert works(found) == pytest.approx([true_imep(1500.0)], rel=2e-3)
    assert "the rows are in reverse order" in found.steps
    assert not any("counted backward" in line for line in found.steps)


def test_a_unit_alone_in_its_row_is_one(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    angle = np.arange(-360.0, 360.0, 0.5)
    lines = rows(angle, 100.0 * one_cycle(600.0)[::5] / 1e5)
    path.write_text("angle,p\n,kPa\n" + lines)
    assert works(read_pressure(path)) == pytest.approx([true_imep(600.0)], rel=2e-3)


def test_a_cycle_is_cut_elsewhere_where_none_is_whole(tmp_path: Path) -> None:
    """From -100 to 900 only the closed part of the cycle that fires at 720 is whole."""
    angle = np.arange(-100.0, 900.0 + 1e-9, 0.7)
    found = read(tmp_path / "a.csv", angle, running(angle))
    assert works(found) == pytest.approx([true_imep(1500.0)], rel=1e-2)
    assert any("no whole cycle" in s and "cut at 180 degree" in s for s in found.steps)
    assert any("first 280 degree are no whole cycle" in s for s in found.steps)


@pytest.mark.parametrize("form", ["running", "begins again at 360", "falls"])
def test_steps_that_do_not_divide_the_cycle_get_one_grid(form: str, tmp_path: Path) -> None:
    """Without `angle_step` they were refused."""
    angle = np.arange(-200.0, 1960.0 + 1e-9, 0.7)
    found = read(tmp_path / "a.csv", FORMS[form](angle), running(angle), average=True)
    expected = [true_imep(1500.0), true_imep(900.0)]
    assert works(found) == pytest.approx(expected, rel=2e-3)
    mean = imep(found.mean.angle, found.mean.pressure[0])
    assert mean == pytest.approx(sum(expected) / 2.0, rel=2e-3)
    text = "\n".join(found.steps)
    assert "first 560 degree" in text and "last 160.2 degree" in text and "grid of 1029" in text


def test_an_angle_that_jitters_loses_no_cycle(tmp_path: Path) -> None:
    angle = np.arange(-360.0, 3 * 720.0 - 360.0 + 1e-9, 0.5)
    off = 0.1 * np.random.default_rng(4).uniform(-1.0, 1.0, len(angle))
    angle = np.maximum(angle + off, -360.0)
    found = read(tmp_path / "a.csv", angle, running(np.minimum(angle, 1799.9)), angle_step=1.0)
    assert works(found) == pytest.approx([true_imep(heat) for heat in HEATS[:3]], rel=3e-3)
    assert not any("left out" in line for line in found.steps)


def test_of_the_end_of_a_cycle_that_is_the_beginning_of_the_next_one_is_kept(
    tmp_path: Path,
) -> None:
    """The file was refused: an angle occurred twice."""
    angle = np.concatenate([np.arange(0.0, 720.0 + 1e-9, 0.5)] * 3)
    ran = angle + 720.0 * np.repeat([0, 1, 2], len(angle) // 3)
    found = read(tmp_path / "a.csv", angle, running(ran))
    expected = [true_imep(1500.0), true_imep(900.0)]
    assert works(found) == pytest.approx(expected, rel=2e-3)


@pytest.mark.parametrize(("first", "last"), [(0.0, 540.0), (-180.0, 400.0)])
def test_two_stroke_cycles_are_revolutions(first: float, last: float, tmp_path: Path) -> None:
    angle = np.arange(first, last + 1e-9, 0.7)
    pressure = running(angle, 360.0)
    found = read(tmp_path / "a.csv", angle, pressure, two_stroke=True)
    heat = 1500.0 if first == 0.0 else 300.0
    assert works(found) == pytest.approx([true_imep(heat, 360.0)], rel=3e-3)
    assert any("no whole cycle and left out" in line for line in found.steps)


def test_one_cycle_from_any_angle_is_whole(tmp_path: Path) -> None:
    """Nothing is left out of it, and nothing is said."""
    for first in (-360.0, -180.0, 0.0, 100.0):
        angle = np.arange(first, first + 720.0 + 1e-9, 0.5)
        pressure = np.interp(angle, FINE, one_cycle(1500.0), period=720.0) / 1e5
        found = read(tmp_path / "a.csv", angle, pressure)
        assert works(found) == pytest.approx([true_imep(1500.0)], rel=2e-3)
        assert not any("whole cycle" in line for line in found.steps)


def test_a_sample_that_is_missing_costs_no_cycle(tmp_path: Path) -> None:
    """The other cycles keep what they are; without `angle_step` the file was refused."""
    angle = np.delete(np.arange(-360.0, 4 * 720.0 - 360.0, 0.5), 2 * 1440 - 1)
    found = read(tmp_path / "a.csv", (angle + 360.0) % 720.0 - 360.0, running(angle))
    assert works(found) == pytest.approx([true_imep(heat) for heat in HEATS], rel=2e-3)
    assert any("cycles of 1439 to 1440 samples" in line for line in found.steps)
