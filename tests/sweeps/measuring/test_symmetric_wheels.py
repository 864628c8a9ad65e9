"""Recordings of a wheel that looks the same three times in a turn."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import sweeps
from engine_dyn.recordings.wheel import wheel_from_text
from sweeps.errors import SceneError
from tests.support.teeth import TurningEngine, random_errors, tooth_times

WHEEL = wheel_from_text("36-2-2-2")
ERRORS = random_errors(WHEEL.width, 0.003, 3)
GAP = 50.0  # degree
LATE = (0, 10, 20)  # teeth after the first one with which the recordings begin
LOADS = [20, 50, 80]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Times of the teeth of `ntua`, whose speed is taken as a Fourier series of 1/omega."""
    folder = tmp_path_factory.mktemp("symmetric")
    computed = sweeps.run(
        {"engine": "ntua", "set": {"speed": 1200}, "axes": {"load": LOADS},
         "output": {"quantities": ["omega"]}}
    )  # fmt: skip
    phi = np.deg2rad(computed.crank_angle.values)
    for load, late in zip(LOADS, LATE, strict=True):
        slow = 1.0 / computed.omega.sel(load=load).values
        waves = {}
        for order in 0.5 * np.arange(1, 61):
            wave = 2.0 * np.mean(slow * np.exp(-1j * order * phi)) / slow.mean()
            waves[float(order)] = (abs(wave), float(np.angle(wave)))
        engine = TurningEngine(1.0 / slow.mean(), waves)
        times = tooth_times(engine, WHEEL.width, 25, np.deg2rad(GAP), ERRORS)[late:]
        text = "\n".join(f"{one - times[0]:.9f}" for one in times)
        (folder / f"load_{load}.csv").write_text(f"time [s]\n{text}\n")
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
    with pytest.raises(SceneError, match=said) as refused:
        compared(folder, **keys)
    assert "\n" not in str(refused.value)


def test_a_fit_asks_for_the_first_tooth(folder: Path) -> None:
    with pytest.raises(SceneError, match="first_tooth: missing; 3 teeth"):
        sweeps.identify(
            vary=["inertia"], engine="ntua", set={"speed": 1200}, axes={"load": LOADS},
            output={"quantities": ["delta"]},
            measured={"kind": "teeth", "wheel": "36-2-2-2", "at": {"load": LOADS},
                      "file": [str(folder / f"load_{load}.csv") for load in LOADS]},
        )  # fmt: skip
