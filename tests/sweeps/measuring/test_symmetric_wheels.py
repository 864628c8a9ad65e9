"""Recordings of a wheel that looks the same three times in a turn."""

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import sweeps
from engine_dyn.recordings.wheel import wheel_from_text
from sweeps.errors import SceneError
from sweeps.measuring.cycles_in_a_row import cycles_in_a_row
from sweeps.measuring.measured_files import records_of
from sweeps.scene.reading import read_scene
from tests.support.scenes import refusal_of
from tests.support.teeth import SampledEngine, random_errors, tooth_times, write_times

WHEEL = wheel_from_text("36-2-2-2")
ERRORS = random_errors(WHEEL.width, 0.003, 3)
GAP = 50.0  # degree
LATE = (0, 10, 20)  # teeth after the first one with which the recordings begin
LOADS = [20, 50, 80]


@pytest.fixture(scope="module")
def engines() -> dict[int, SampledEngine]:
    """`ntua` at some loads."""
    computed = sweeps.run(
        {"engine": "ntua", "set": {"speed": 1200}, "axes": {"load": LOADS},
         "output": {"quantities": ["omega"]}}
    )  # fmt: skip
    phi = np.deg2rad(computed.crank_angle.values)
    return {load: SampledEngine(phi, computed.omega.sel(load=load).values) for load in LOADS}


def write(path: Path, engine: SampledEngine, late: int, errors: np.ndarray) -> None:
    times = tooth_times(engine, WHEEL.width, 25, np.deg2rad(GAP), errors)[late:]
    write_times(path, times - times[0])


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory, engines: dict[int, SampledEngine]) -> Path:
    """Times of the teeth."""
    folder = tmp_path_factory.mktemp("symmetric")
    for load, late in zip(LOADS, LATE, strict=True):
        write(folder / f"load_{load}.csv", engines[load], late, ERRORS)
    return folder


def compared(folder: Path, **keys: Any) -> Any:
    given = {"kind": "teeth", "wheel": "36-2-2-2", "at": {"load": LOADS},
             "file": [str(folder / f"load_{load}.csv") for load in LOADS], **keys}  # fmt: skip
    return sweeps.measured(
        engine="ntua", set={"speed": 1200}, axes={"load": LOADS},
        output={"quantities": ["delta"]}, measured=given,
    )  # fmt: skip


def test_each_recording_begins_with_its_own_group(folder: Path) -> None:
    found = compared(folder, gap_angle=GAP)
    assert found.recorded_cycles.values.tolist() == [12, 12, 12]
    assert np.all(found.correlation > 0.999)
    assert np.allclose(found.tooth_error, ERRORS, atol=5e-4)
    for load, first in zip(LOADS, (1, 21, 11), strict=True):
        assert (
            f"load_{load}.csv: 3 teeth of 36-2-2-2 could be the first one; that of pulse {first}"
            in found.attrs["remarks"]
        )


def test_the_first_tooth_is_stated(folder: Path) -> None:
    free = compared(folder, gap_angle=GAP)
    stated = compared(folder, gap_angle=GAP, first_tooth=[1, 21, 11])
    assert "could be the first one" not in stated.attrs["remarks"]
    assert np.allclose(free.delta_measured, stated.delta_measured, rtol=1e-3)
    other = compared(folder, gap_angle=GAP, first_tooth=[11, 21, 11])
    assert np.all(other.correlation[0] < stated.correlation[0])


@pytest.mark.parametrize(
    ("keys", "said"),
    [
        ({"first_tooth": 0}, "must be a number from 1"),
        ({"first_tooth": [1, 2]}, "one for each of 3 files"),
        ({"first_tooth": 2}, "pulse 2 is not the first of a group"),
        ({"first_tooth": 1, "wheel": "60-2"}, "several teeth could be the first"),
    ],
)
def test_no_first_tooth(folder: Path, keys: dict[str, Any], said: str) -> None:
    assert re.search(said, refusal_of(lambda: compared(folder, **keys)))


def test_the_intervals_left_out_are_counted_from_the_first_tooth(
    tmp_path: Path, engines: dict[int, SampledEngine]
) -> None:
    """One tooth is off by a tenth of a pitch, in a recording that begins ten teeth later."""
    path, off = tmp_path / "times.csv", np.zeros(30)
    off[4:6] = 0.1, -0.1
    write(path, engines[50], 10, off)
    found = sweeps.measured(
        engine="ntua", set={"speed": 1200, "load": 50}, output={"quantities": ["delta"]},
        measured={"kind": "teeth", "wheel": "36-2-2-2", "file": str(path), "gap_angle": GAP},
    )  # fmt: skip
    assert "intervals 5, 6 of 30 after the gap" in found.attrs["remarks"]
    used = found.omega_raw[0].values[found.interval_used.values == 1]
    speeds = engines[50].speed(np.linspace(0.0, 4.0 * np.pi, 721))
    assert np.ptp(used) < np.ptp(speeds) < np.ptp(found.omega_raw[0].values)


@pytest.mark.parametrize("late", LATE)
def test_given_errors_belong_to_the_first_tooth(
    tmp_path: Path, engines: dict[int, SampledEngine], late: int
) -> None:
    """Rows of cycles begin with the recording; the errors do not."""
    path, engine, width = tmp_path / "times.csv", engines[50], WHEEL.width * (1.0 + ERRORS)
    write(path, engine, late, ERRORS)
    at = np.concatenate([[0.0], np.cumsum(np.tile(width, 3))])
    # on the average, the teeth are where they would be without errors
    gap = GAP + np.rad2deg(np.mean(at[:30] - np.cumsum(WHEEL.width) + WHEEL.width))
    given = read_scene(
        engine="ntua", output={"quantities": ["delta"]},
        measured={"file": str(path), "kind": "teeth", "wheel": "36-2-2-2", "gap_angle": gap,
                  "tooth_errors": ERRORS.tolist()},
    ).measured  # fmt: skip
    assert given is not None
    (record,) = records_of(given, 4.0 * np.pi, "scene")
    angle = np.linspace(-2.0 * np.pi, 2.0 * np.pi, 720, endpoint=False)
    row = cycles_in_a_row(record, given, angle, engine.speed(angle), 4.0 * np.pi, 1, "scene")
    edges = np.deg2rad(GAP) + at[late : late + 61]
    assert row.start == pytest.approx(edges[0], abs=1e-6)
    assert np.allclose(row.mean, np.diff(edges) / np.diff(engine.time(edges)), rtol=1e-5)


def test_a_fit_asks_for_the_first_tooth(folder: Path) -> None:
    with pytest.raises(SceneError, match="first_tooth: missing; 3 teeth"):
        sweeps.identify(
            vary=["inertia"], engine="ntua", set={"speed": 1200}, axes={"load": LOADS},
            output={"quantities": ["delta"]},
            measured={"kind": "teeth", "wheel": "36-2-2-2", "at": {"load": LOADS},
                      "file": [str(folder / f"load_{load}.csv") for load in LOADS]},
        )  # fmt: skip
