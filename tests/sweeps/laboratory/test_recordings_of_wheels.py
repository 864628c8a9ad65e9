"""Pressure sampled over time beside the signal of a toothed wheel: which edge the angles mean."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import sweeps
from sweeps.reading.pressure_recordings import read_pressure
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


@pytest.mark.parametrize("name", ["time_ns", "Time (ns)", "t ns"])
def test_times_in_other_units(name: str, raw: Path, tmp_path: Path) -> None:
    """Of nanoseconds taken as seconds, intervals would be too long for teeth."""
    times, *others = np.loadtxt(raw, delimiter=",", skiprows=1).T
    path = tmp_path / "run.csv"
    path.write_text(f"{name},wheel [V],p [bar]\n" + rows(np.round(1e9 * times), *others))
    mean = read_pressure(path, edge="rising", gap_angle=RISING, threshold=2.5, **KEYS).mean
    assert imep(mean.angle, mean.pressure[0]) == pytest.approx(true_imep(), rel=2e-3)


def test_another_edge_is_a_tooth_away_and_a_chosen_one_told(raw: Path) -> None:
    """What a wrong edge costs is far more than the tolerance above."""
    mean = read_pressure(raw, edge="falling", gap_angle=RISING, threshold=2.5, **KEYS).mean
    assert abs(imep(mean.angle, mean.pressure[0]) / true_imep() - 1.0) > 0.05
    # An edge that was chosen is told.
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


def test_threshold_hysteresis_and_a_missing_gap_angle(raw: Path) -> None:
    found = read_pressure(
        raw, gap_angle=RISING, edge="rising", threshold=2.25, hysteresis=0.125, **KEYS
    )
    assert any("threshold 2.25 ± 0.12 (rising edge" in step for step in found.steps)
    with pytest.raises(sweeps.SceneError, match=r"run\.csv: .*pulses"):
        read_pressure(raw, gap_angle=RISING, threshold=7.0, **KEYS)
    with pytest.raises(sweeps.SceneError, match="'rising' or 'falling'"):
        read_pressure(raw, gap_angle=RISING, edge="both", **KEYS)
    # A missing gap angle is refused.
    with pytest.raises(sweeps.SceneError) as failure:
        read_pressure(raw, edge="falling", **KEYS)
    message = str(failure.value)
    assert message.isprintable()
    assert "gap_angle: missing; must be the crank angle in degree at which the falling" in message


def test_a_motored_recording_shows_the_gap_angle(tmp_path: Path) -> None:
    """As the refusal says: the angle of the largest pressure times -1, less the loss angle."""
    write(tmp_path / "off.csv", heat=0.0)
    found = read_pressure(tmp_path / "off.csv", gap_angle=0.0, edge="rising", **KEYS)
    (cycles,) = found.recorded.values()
    top = cycles.angle[np.argmax(cycles.mean)] / DEGREE
    fine = np.arange(-5.0, 5.0, 0.01)
    loss = -fine[np.argmax(recorded_engine.pressure(fine * DEGREE, heat=0.0))]
    assert (-top - loss) % 360.0 == pytest.approx(RISING, abs=0.5)  # a step of the grid


@pytest.mark.parametrize("head", ["t [s],wheel,p [bar]", "Zeit/s,wheel/V,Druck/bar"])
def test_columns_of_times(head: str, tmp_path: Path) -> None:
    write(tmp_path / "run.csv", head)
    told = read_pressure(tmp_path / "run.csv", gap_angle=RISING, **KEYS).steps
    assert any(f"column '{head[:4].split('/')[0].split(' ')[0]}' taken as the time" in step
               for step in told)  # fmt: skip
