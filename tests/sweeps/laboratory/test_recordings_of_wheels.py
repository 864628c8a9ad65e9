"""Recordings over time beside a wheel, and of running angles over several cycles."""

from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import sweeps
from sweeps.lab.pressure.imported_pressure import ImportedPressure
from sweeps.lab.pressure.reading import read_pressure
from tests.support import recorded_engine
from tests.support.laboratory import DEGREE, imep, rows

RATE = 9000.0
"""[degree/s]: 1500 rpm."""

RISING = 78.0
"""Crank angle of the rising edge of the first tooth after the gap [degree]."""

WIDTH = 3.0
"""Of the teeth [degree]; they are half a pitch wide."""

KEYS: dict[str, Any] = {"encoder_column": "wheel", "wheel": "60-2", "average": True,
                        "angle_step": 0.5}  # fmt: skip


def write(path: Path, head: str = "Time (s),wheel [V],p [bar]", heat: float = 1500.0) -> None:
    """A speed that swings over the cycle; edges that take a degree, as sensors have them."""
    times = 1e-5 * np.arange(40_000)
    angle = RATE * times + 1.5 * np.sin(2.0 * np.pi * RATE * times / 360.0)
    inside = (angle + 360.0) % 720.0 - 360.0
    after = (angle - RISING) % 360.0
    place = after % 6.0
    edges = np.clip(place + 0.5, 0.0, 1.0) - np.clip(place - WIDTH + 0.5, 0.0, 1.0)
    edges += np.clip(place - 6.0 + 0.5, 0.0, 1.0)
    toothed = (after < 346.0) | (after > 357.0)
    signal = 5.0 * edges * toothed
    pressure = recorded_engine.pressure(inside * DEGREE, heat=heat) / 1e5
    path.write_text(f"{head}\n" + rows(times, signal, pressure))


def true_imep() -> float:
    angle = np.arange(-360.0, 360.0, 0.05) * DEGREE
    return imep(angle, recorded_engine.pressure(angle))


@pytest.fixture(scope="module")
def raw(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("wheel") / "run.csv"
    write(path)
    return path


@pytest.mark.parametrize(("edge", "gap_angle"), [("rising", RISING), ("falling", RISING + WIDTH)])
def test_each_edge_has_its_own_gap_angle(edge: str, gap_angle: float, raw: Path) -> None:
    found = read_pressure(raw, edge=edge, gap_angle=gap_angle, threshold=2.5, **KEYS)
    mean = found.mean
    assert imep(mean.angle, mean.pressure[0]) == pytest.approx(true_imep(), rel=2e-3)
    told = "\n".join(found.steps)
    assert f"the {edge} edge of the first tooth after the longest gap at {gap_angle:g}" in told
    assert f"({edge} edge; the signal swings from 0 to 5)" in told
    assert "was chosen" not in told
    assert "column 'Time' taken as the time" in told


def test_another_edge_is_a_tooth_away_and_a_chosen_one_told(raw: Path) -> None:
    """What a wrong edge costs is far more than the tolerance above."""
    mean = read_pressure(raw, edge="falling", gap_angle=RISING, threshold=2.5, **KEYS).mean
    assert abs(imep(mean.angle, mean.pressure[0]) / true_imep() - 1.0) > 0.05
    told = "\n".join(read_pressure(raw, gap_angle=RISING, **KEYS).steps)
    assert "edge was chosen" in told and "one tooth width away" in told


@pytest.mark.parametrize("every", [1, 2])
def test_a_mark_replaces_the_gap_angle(every: int, raw: Path, tmp_path: Path) -> None:
    """It rises at 100 degrees, in each revolution or in the first of each cycle."""
    table = np.loadtxt(raw, delimiter=",", skiprows=1)
    angle = RATE * table[:, 0] + 1.5 * np.sin(2.0 * np.pi * RATE * table[:, 0] / 360.0)
    mark = (angle - 100.0) % (360.0 * every) < 20.0
    path = tmp_path / "marked.csv"
    path.write_text("Time (s),wheel [V],p [bar],mark [V]\n" + rows(*table.T, 3.3 * mark))
    found = read_pressure(path, edge="rising", mark_column="mark", mark_angle=100.0, **KEYS)
    assert imep(found.mean.angle, found.mean.pressure[0]) == pytest.approx(true_imep(), rel=2e-3)
    told = "\n".join(found.steps)
    assert f"passes once a {'cycle' if every == 2 else 'revolution'}" in told
    with pytest.raises(sweeps.SceneError, match="gap_angle and mark_column: only one"):
        read_pressure(path, mark_column="mark", gap_angle=78.0, **KEYS)


def test_a_motored_recording_shows_the_gap_angle(tmp_path: Path) -> None:
    """As the refusal says: the angle of the largest pressure times -1, less the loss angle."""
    write(tmp_path / "off.csv", heat=0.0)
    found = read_pressure(tmp_path / "off.csv", gap_angle=0.0, edge="rising", **KEYS)
    (cycles,) = found.recorded.values()
    top = cycles.angle[np.argmax(cycles.mean)] / DEGREE
    fine = np.arange(-5.0, 5.0, 0.01)
    loss = -fine[np.argmax(recorded_engine.pressure(fine * DEGREE, heat=0.0))]
    assert (-top - loss) % 360.0 == pytest.approx(RISING, abs=0.5)  # a step of the grid


HEATS = (300.0, 1500.0, 900.0, 600.0)
"""Of the cycles that fire at 0, at one period, at two and so on [J]."""

FINE = np.arange(-360.0, 360.0, 0.1)


@cache
def one_cycle(heat: float) -> Any:
    return recorded_engine.pressure(FINE * DEGREE, heat=heat)


def imep_of(heat: float, period: float = 720.0) -> float:
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
    assert works(found) == pytest.approx([imep_of(1500.0)], rel=2e-3)
    assert any("first 360 degree are no whole cycle" in line for line in found.steps)


@pytest.mark.parametrize("form", ["running", "begins again at 720"])
@pytest.mark.parametrize("end", [1080.0, 1152.0, 1500.0])
def test_rows_in_reverse_order_are_turned(form: str, end: float, tmp_path: Path) -> None:
    """They were counted backward: the work came out negative, of a little burnt "motored"."""
    angle = np.arange(0.0, end + 1e-9, 0.5)
    found = read(tmp_path / "a.csv", FORMS[form](angle)[::-1], running(angle)[::-1])
    assert works(found) == pytest.approx([imep_of(1500.0)], rel=2e-3)
    assert "the rows are in reverse order" in found.steps
    assert not any("counted backward" in line for line in found.steps)


@pytest.mark.parametrize("form", ["running", "begins again at 360", "falls"])
def test_steps_that_do_not_divide_the_cycle_get_one_grid(form: str, tmp_path: Path) -> None:
    """Without `angle_step` they were refused."""
    angle = np.arange(-200.0, 1960.0 + 1e-9, 0.7)
    found = read(tmp_path / "a.csv", FORMS[form](angle), running(angle), average=True)
    expected = [imep_of(1500.0), imep_of(900.0)]
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
    assert works(found) == pytest.approx([imep_of(heat) for heat in HEATS[:3]], rel=3e-3)
    assert not any("left out" in line for line in found.steps)


@pytest.mark.parametrize(("first", "last"), [(0.0, 540.0), (-180.0, 400.0)])
def test_two_stroke_cycles_are_revolutions(first: float, last: float, tmp_path: Path) -> None:
    angle = np.arange(first, last + 1e-9, 0.7)
    pressure = running(angle, 360.0)
    found = read(tmp_path / "a.csv", angle, pressure, two_stroke=True)
    heat = 1500.0 if first == 0.0 else 300.0
    assert works(found) == pytest.approx([imep_of(heat, 360.0)], rel=3e-3)
    assert any("no whole cycle and left out" in line for line in found.steps)


def test_a_sample_that_is_missing_costs_no_cycle(tmp_path: Path) -> None:
    """The other cycles keep what they are; without `angle_step` the file was refused."""
    angle = np.delete(np.arange(-360.0, 4 * 720.0 - 360.0, 0.5), 2 * 1440 - 1)
    found = read(tmp_path / "a.csv", (angle + 360.0) % 720.0 - 360.0, running(angle))
    assert works(found) == pytest.approx([imep_of(heat) for heat in HEATS], rel=2e-3)
    assert any("cycles of 1439 to 1440 samples" in line for line in found.steps)
