"""Logs of levels, of intervals, and sounds: delta of a speed in closed form is found again.

The speed is mean (1 + sum of cosines), as pulses see it; delta of the means between the teeth of a
fine wheel is less than a hundredth below that of the curve.
"""

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

import sweeps
from engine_dyn.geometry.toothed_wheel import wheel_from_text
from sweeps.base.errors import SceneError
from sweeps.lab.speed.measured_files import records_of
from sweeps.lab.speed.recorded_speeds import cycles_in_a_row
from sweeps.scene.reading import read_scene
from sweeps.view.figures import draw
from sweeps.view.texts.lab_texts import measured_text
from tests.support.scenes import refusal_of
from tests.support.teeth import TurningEngine, pulses, tooth_times
from tests.support.tiers import every

ENGINE = TurningEngine(
    94.2, {0.5: (0.01, 0.3), 1.0: (0.008, 1.0), 1.5: (0.01, -0.5), 2.0: (0.02, 0.2)}
)
TURNS = 21
PHI = np.linspace(0.0, 4.0 * np.pi, 7201)
SPEED = ENGINE.speed(PHI)
DELTA = np.ptp(SPEED) * ENGINE.time(np.array(4.0 * np.pi)) / (4.0 * np.pi)
TOOTH = np.deg2rad(2.4)


def times_of(text: str, later: float = 0.0) -> np.ndarray:
    """Times from 10 ms on; `later` is the angle of the other edge behind the first one [rad]."""
    return 0.01 + tooth_times(ENGINE, wheel_from_text(text).width, TURNS, later)


def levels(marked: bool = False) -> list[tuple[float, int, int]]:
    """Rows at each change: time, level of the wheel's sensor, level of a mark's sensor."""
    changes = [(time, 0, 1) for time in times_of("60-2")]
    changes += [(time, 0, 0) for time in times_of("60-2", TOOTH)]
    if marked:
        marks = ENGINE.time(np.deg2rad(12.0) + 2.0 * np.pi * np.arange(TURNS)) + 0.01
        changes += [(time, 1, 1) for time in marks] + [(time + 4e-4, 1, 0) for time in marks]
    return states(changes)


def states(changes: list[tuple[float, int, int]]) -> list[tuple[float, int, int]]:
    """Both levels at each change of one of them."""
    state, rows = [0, 0], []
    for time, channel, level in sorted(changes):
        state[channel] = level
        rows.append((time, state[0], state[1]))
    return rows


def log_of(folder: Path, head: str, rows: Any) -> Path:
    """A file of these rows; of more columns than the head has, the first ones."""
    path, columns = folder / "levels.csv", head.count(",") + 1
    table = np.array(rows).reshape(len(rows), -1)[:, :columns]
    np.savetxt(path, table, delimiter=",", fmt="%.9f", header=head, comments="")
    return path


def compared(file: Path, kind: str, wheel: str, **keys: Any) -> xr.Dataset:
    of_wheel = {"wheel": wheel, "tooth_errors": "none"} if wheel else {}
    return sweeps.measured(
        engine="ntua", set={"speed": 900}, output={"quantities": ["delta"]},
        measured={"file": str(file), "kind": kind} | of_wheel | keys,
    )  # fmt: skip


def check(found: xr.Dataset, cycles: int = TURNS // 2) -> None:
    assert float(found.delta_measured_raw[0]) == pytest.approx(DELTA, rel=0.02)
    assert int(found.recorded_cycles[0]) == cycles


@pytest.mark.parametrize("marked", [False, True])
@pytest.mark.parametrize("edge", [None, "rising", "falling"])
def test_levels_at_their_changes(tmp_path: Path, marked: bool, edge: str | None) -> None:
    path = log_of(tmp_path, "Time [s],Channel 0,Channel 1", levels(marked))
    keys = {"column": "Channel 0"} | ({} if edge is None else {"edge": edge})
    found = compared(path, "encoder", "60-2", **keys)
    check(found)
    said = "the level is logged at its changes; the {} edge is used"
    used = [one for one in ("rising", "falling") if said.format(one) in found.attrs["remarks"]]
    assert used == [edge] if edge else len(used) == 1


def test_coarse_samples_of_two_levels_are_no_changes(tmp_path: Path) -> None:
    """With 2.9 samples from tooth to tooth, two thirds of the samples change the level."""
    up, down = times_of("60"), times_of("60", np.deg2rad(3.0))
    step = 2.0 * np.pi / 94.2 / 60.0 / 2.9
    at = np.arange(0.0, up[-1], step)
    level = (np.searchsorted(up, at) - np.searchsorted(down, at)).clip(0, 1)
    assert 0.6 < np.mean(np.diff(level) != 0) < 0.75
    path = log_of(tmp_path, "time,level", np.column_stack([at, level]))
    remarks = compared(path, "encoder", "60", gap_angle=0.0).attrs["remarks"]
    assert "samples from tooth to tooth" in remarks and "aliasing" in remarks
    assert "logged at its changes" not in remarks


@pytest.mark.parametrize(
    ("head", "factor", "keys"),
    [
        ("ToothTime\nus\n", 1e6, {}), ("tooth_us\n", 1e6, {}), ("interval\n", 1e3, {"unit": "ms"}),
        ("interval [ms]\n", 1e3, {}),
    ],
)  # fmt: skip
def test_intervals(tmp_path: Path, head: str, factor: float, keys: dict[str, Any]) -> None:
    path = tmp_path / "intervals.csv"
    steps = np.diff(times_of("36-1")) * factor
    path.write_text(head + "".join(f"{one:.6f}\n" for one in steps))
    found = compared(path, "teeth", "36-1", **keys)
    check(found)
    assert "taken as intervals" in found.attrs["remarks"]
    assert float(found.omega_mean_measured[0]) == pytest.approx(94.2, rel=0.01)


@pytest.mark.parametrize("channels", every(2, (1, 2)))
def test_a_sound(tmp_path: Path, channels: int) -> None:
    """A sensor at the microphone's socket, of which the mean is lost: 48 kHz, 16 bit."""
    wavfile = pytest.importorskip("scipy.io.wavfile")
    times, rate = times_of("36-1"), 48_000
    signal = pulses(times, 1.0 / rate, int(times[-1] * rate) + 50, 2.5e-4, 2e4)
    signal = np.round(signal - signal.mean()).astype(np.int16)
    path = tmp_path / "sensor.wav"
    wavfile.write(path, rate, signal if channels == 1 else np.stack([0 * signal, signal], axis=1))
    check(compared(path, "encoder", "36-1", **({} if channels == 1 else {"column": "channel 2"})))
    path.write_bytes(path.read_bytes()[:30])
    assert re.search(
        r"not a .wav file, or a damaged one", refusal_of(lambda: compared(path, "encoder", "36-1"))
    )


def test_times_of_a_counter_that_begins_again(tmp_path: Path) -> None:
    """16 bits of microseconds: their steps back are no gaps between intervals."""
    times = 1e6 * times_of("60-2")
    path = tmp_path / "times.csv"
    path.write_text("time_us\n" + "".join(f"{one % 65536.0:.0f}\n" for one in times))
    line = 2 + int(np.argmax(times > 65536.0))
    assert re.search(
        rf"column 'time_us', line {line}: .*begin again",
        refusal_of(lambda: compared(path, "teeth", "60-2")),
    )


@pytest.mark.parametrize("pages", [1, 2, 5])
def test_time_that_passes_at_marks_is_in_no_interval(tmp_path: Path, pages: int) -> None:
    """Loggers write MARK lines between pages; the teeth that pass meanwhile are not logged."""
    intervals = np.diff(times_of("36-1"))
    longest, part = 13 * 35 + 7, (len(intervals) - 13 * 35 - 7) // pages
    lines, start = ["#Firmware: x", "ToothTime", "us"], 0
    for page in range(pages):
        length = longest if page == pages // 2 else part - 3
        lines.append(f"MARK {page:03d} - page - Fri May 03 10:00:00 2024")
        lines += [f"{1e6 * one:.3f}" for one in intervals[start : start + length]]
        start += length + 3
    (tmp_path / "log.csv").write_text("\n".join(lines) + "\n")
    found = compared(tmp_path / "log.csv", "teeth", "36-1")
    check(found, 6)
    assert ("MARK" in found.attrs["remarks"]) == (pages > 1)


def test_a_recording_without_a_computed_speed(tmp_path: Path) -> None:
    """At the speed of cranking `ntua` stalls; what is measured does not need it."""
    path = log_of(tmp_path, "time,level", levels())
    given = {"file": str(path), "kind": "encoder", "wheel": "60-2"}
    scene: dict[str, Any] = {"engine": "ntua", "output": {"quantities": ["delta"]}}
    found = sweeps.measured(**scene, set={"speed": 250}, measured=given)
    check(found)
    for name in ("delta", "delta_through_wheel", "correlation", "rms_difference_raw"):
        assert np.isnan(found[name]).all()
    assert "levels.csv: has no computed speed (stalled)" in found.attrs["remarks"]
    assert "because there is no computed speed" in found.attrs["gap_angle_from"]
    assert np.isfinite(found.omega_measured).all()
    assert " - " in measured_text(found) and "nan" not in measured_text(found)
    assert len(draw(found, tmp_path / "figures")) == 5
    stated = sweeps.measured(**scene, set={"speed": 250}, measured={**given, "gap_angle": 90})
    assert stated.attrs["gap_angle"] == pytest.approx(90.0)


@pytest.mark.parametrize(("edge", "late"), [("rising", 12.0), ("falling", 9.6)])
def test_a_mark_tells_the_angle_of_the_wheel(tmp_path: Path, edge: str, late: float) -> None:
    """The mark rises 12 degrees after the first tooth; its other edge comes 2.4 degrees later."""
    path = log_of(tmp_path, "Time [s],Channel 0,Channel 1", levels(marked=True))
    keys: dict[str, Any] = {"column": "Channel 0", "edge": edge}
    found = compared(path, "encoder", "60-2", mark_column="Channel 1", mark_angle=40.0, **keys)
    check(found)
    assert found.attrs["gap_angle"] == pytest.approx(40.0 - late, abs=0.05)
    assert found.attrs["gap_angle_from"] == "the mark"
    # Without its name the wheel is the column beside time and mark.
    same = compared(path, "encoder", "60-2", mark_column="Channel 1", mark_angle=40.0, edge=edge)
    assert same.attrs["gap_angle"] == found.attrs["gap_angle"]
    assert "passes once a revolution" in found.attrs["remarks"]
    for wrong, said in (
        ({"mark_column": "Channel 1", "gap_angle": 30.0}, "gap_angle and mark_column"),
        ({"mark_angle": 30.0}, "mark_angle: has no effect without mark_column"),
        ({"mark_column": "Channel 0"}, "column 'Channel 0': mark: passes"),
    ):
        with pytest.raises(SceneError, match=said):
            compared(path, "encoder", "60-2", **keys, **wrong)


TOP = np.rad2deg(PHI[SPEED.argmax()])


def top_of(found: xr.Dataset) -> float:
    """Crank angle of the largest speed that was measured [degree]."""
    return float(found.crank_angle[int(found.omega_measured[0].values.argmax())])


@pytest.mark.parametrize("turn", [0, 1])
def test_a_cam_tells_the_revolution(tmp_path: Path, turn: int) -> None:
    """The mark of the first turn or of the second one is said to be in the first one."""
    rows, passed, last = [], 0, 0
    for time, one, other in levels(marked=True):
        passed += other > last
        last = other
        rows.append((time, one, int(other and passed % 2 == 1 - turn)))
    path = log_of(tmp_path, "Time [s],A,B", rows)
    found = compared(
        path, "encoder", "60-2", column="A", edge="rising", mark_column="B", mark_angle=12.0
    )
    check(found, cycles=TURNS // 2 - (turn == 0))
    assert "passes once a cycle" in found.attrs["remarks"]
    away = (top_of(found) - (TOP - 360.0 * turn) + 360.0) % 720.0 - 360.0
    assert abs(away) < 6.0
    # cylinders that fire evenly leave the revolution to the mark, too
    table = {"file": str(path), "kind": "encoder", "wheel": "60-2", "column": "A",
             "edge": "rising", "mark_column": "B", "mark_angle": 12.0}  # fmt: skip
    given = read_scene(engine="ntua", output={"quantities": ["delta"]}, measured=table).measured
    assert given is not None
    (record,) = records_of(given, 4.0 * np.pi, "scene")
    angle = np.linspace(-2.0 * np.pi, 2.0 * np.pi, 720, endpoint=False)
    speed = 94.0 + np.cos(angle)
    row = cycles_in_a_row(record, given, angle, speed, 4.0 * np.pi, 2, "scene")
    assert row.turn_known and row.start_from == "the mark"
    assert row.start == pytest.approx(0.0, abs=1e-3)


def test_a_sample_rate_that_the_times_contradict(tmp_path: Path) -> None:
    path = log_of(tmp_path, "t_s,v", [(n / 5e4, n % 9) for n in range(2000)])
    with pytest.raises(SceneError, match="has 50000 samples per second; sample_rate = 25000"):
        compared(path, "encoder", "60-2", column="v", sample_rate=25000.0)
    with pytest.raises(SceneError, match="sample_rate and time_column: only one"):
        compared(path, "encoder", "60-2", column="v", time_column="t_s", sample_rate=5e4)
    with pytest.raises(SceneError, match="sample_rate and unit: only one"):
        compared(path, "encoder", "60-2", column="v", unit="ms", sample_rate=5e4)
    for key, value in (("sample_rate", 5e4), ("edge", "rising"), ("angle_shift", 0.0)):
        with pytest.raises(SceneError, match=f"{key}: has no effect without kind ="):
            compared(path, "teeth", "60-2", **{key: value})
