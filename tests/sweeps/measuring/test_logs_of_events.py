"""Logs of levels, of intervals, and sounds: delta of a speed in closed form is found again.

The speed is mean (1 + sum of cosines), as pulses see it; delta of the means between the teeth of a
fine wheel is less than a hundredth below that of the curve.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

import sweeps
from engine_dyn.recordings.wheel import wheel_from_text
from sweeps.errors import SceneError
from sweeps.figures import draw
from sweeps.presenting.measured import measured_text
from tests.support.teeth import TurningEngine, pulses, tooth_times

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
    state, rows = [0, 0], []
    for time, channel, level in sorted(changes):
        state[channel] = level
        rows.append((time, state[0], state[1]))
    return rows


def compared(file: Path, kind: str, wheel: str, **keys: Any) -> xr.Dataset:
    return sweeps.measured(
        engine="ntua", set={"speed": 900}, output={"quantities": ["delta"]},
        measured={"file": str(file), "kind": kind, "wheel": wheel, "tooth_errors": "none", **keys},
    )  # fmt: skip


def check(found: xr.Dataset) -> None:
    assert float(found.delta_measured_raw[0]) == pytest.approx(DELTA, rel=0.02)
    assert int(found.recorded_cycles[0]) == TURNS // 2


@pytest.mark.parametrize("marked", [False, True])
@pytest.mark.parametrize("edge", [None, "rising", "falling"])
def test_levels_at_their_changes(tmp_path: Path, marked: bool, edge: str | None) -> None:
    path = tmp_path / "levels.csv"
    rows = "\n".join(f"{t:.9f},{one},{other}" for t, one, other in levels(marked))
    path.write_text("Time [s],Channel 0,Channel 1\n" + rows + "\n")
    keys = {"column": "Channel 0"} | ({} if edge is None else {"edge": edge})
    found = compared(path, "encoder", "60-2", **keys)
    check(found)
    assert f"the {edge or ''}" in found.attrs["remarks"]


def test_steady_levels_are_no_samples(tmp_path: Path) -> None:
    """Evenly spaced changes are changes too."""
    path = tmp_path / "levels.csv"
    rows = "\n".join(f"{0.001 * n:.4f},{n % 2}" for n in range(601))
    path.write_text("time,level\n" + rows + "\n")
    found = compared(path, "encoder", "60", gap_angle=0.0)
    assert float(found.omega_mean_measured[0]) == pytest.approx(2.0 * np.pi / 0.12)


def test_levels_and_samples_do_not_mix(tmp_path: Path) -> None:
    time = np.arange(0.0, times_of("60-2")[-1], 2e-5)
    signal = pulses(times_of("60-2"), 2e-5, time.size, 2.5e-4)
    for name, rows in (("log.csv", [(t, one) for t, one, _ in levels()]),
                       ("samples.csv", zip(time, signal, strict=True))):  # fmt: skip
        text = "\n".join(f"{t:.9f},{one:g}" for t, one in rows)
        (tmp_path / name).write_text("time,level\n" + text + "\n")
    with pytest.raises(SceneError, match=r"log.csv has levels .*samples.csv samples"):
        sweeps.measured(
            engine="ntua", axes={"load": [20, 50]}, output={"quantities": ["delta"]},
            measured={"file": [str(tmp_path / "log.csv"), str(tmp_path / "samples.csv")],
                      "kind": "encoder", "wheel": "60-2", "at": {"load": [20, 50]}},
        )  # fmt: skip


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


@pytest.mark.parametrize("kind", ["teeth", "encoder"])
def test_the_unit_of_time_in_a_name(tmp_path: Path, kind: str) -> None:
    path = tmp_path / "times.csv"
    rows = [(t, one) for t, one, _ in levels()]
    if kind == "teeth":
        path.write_text("time_us\n" + "".join(f"{1e6 * t:.3f}\n" for t in times_of("60-2")))
    else:
        path.write_text("time_us,level\n" + "".join(f"{1e6 * t:.3f},{x}\n" for t, x in rows))
    found = compared(path, kind, "60-2")
    check(found)
    assert float(found.omega_mean_measured[0]) == pytest.approx(94.2, rel=0.01)


@pytest.mark.parametrize("channels", [1, 2])
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
    with pytest.raises(SceneError, match=r"not a .wav file, or a damaged one") as refused:
        compared(path, "encoder", "36-1")
    assert "\n" not in str(refused.value)


def test_times_with_a_fault_are_no_intervals(tmp_path: Path) -> None:
    times = times_of("36-1")
    times[100] = times[99]
    path = tmp_path / "times.csv"
    path.write_text("time [s]\n" + "".join(f"{one:.9f}\n" for one in times))
    with pytest.raises(SceneError, match=r"number 101 .* is not later"):
        compared(path, "teeth", "36-1")


def test_a_recording_without_a_computed_speed(tmp_path: Path) -> None:
    """At the speed of cranking `ntua` stalls; what is measured does not need it."""
    path = tmp_path / "levels.csv"
    rows = "\n".join(f"{t:.9f},{one}" for t, one, _ in levels())
    path.write_text("time,level\n" + rows + "\n")
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


def test_one_of_two_recordings_without_a_computed_speed(tmp_path: Path) -> None:
    path = tmp_path / "times.csv"
    path.write_text("time [s]\n" + "".join(f"{one:.9f}\n" for one in times_of("60-2")))
    axes, at = {"speed": [250, 900]}, {"speed": [250, 900]}
    given = {"kind": "teeth", "wheel": "60-2", "at": at, "file": [str(path), str(path)]}
    scene: dict[str, Any] = {"engine": "ntua", "output": {"quantities": ["delta"]}}
    found = sweeps.measured(**scene, axes=axes, measured=given)
    alone = sweeps.measured(
        **scene, set={"speed": 900}, measured={"kind": "teeth", "wheel": "60-2", "file": str(path)}
    )
    assert np.allclose(found.delta_measured_raw, alone.delta_measured_raw)
    assert found.attrs["gap_angle"] == pytest.approx(alone.attrs["gap_angle"])
    assert np.isnan(found.correlation[0])
    assert float(found.correlation[1]) == pytest.approx(float(alone.correlation[0]))


def test_speed_over_angle_without_a_computed_speed(tmp_path: Path) -> None:
    angle = np.arange(-360.0, 360.0)
    rpm = ENGINE.speed(np.deg2rad(angle)) * 30.0 / np.pi
    path = tmp_path / "speed.csv"
    rows = "\n".join(f"{a:g},{v:.6f}" for a, v in zip(angle, rpm, strict=True))
    path.write_text("angle_deg,speed_rpm\n" + rows + "\n")
    found = sweeps.measured(
        engine="ntua", set={"speed": 250}, output={"quantities": ["delta"]},
        measured={"file": str(path), "kind": "speed"},
    )  # fmt: skip
    assert float(found.delta_measured[0]) == pytest.approx(np.ptp(rpm) / rpm.mean(), rel=1e-4)
    assert np.isnan(found.correlation).all()
