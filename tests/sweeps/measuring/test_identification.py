"""Parameters of a synthetic engine from the times of its teeth."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from numpy.testing import assert_allclose

import sweeps
from sweeps.errors import SceneError
from sweeps.measuring.computed_speeds import SpeedsOfRecordings
from sweeps.measuring.fitted_recordings import FittedRecordings, Seen
from sweeps.presenting.fits import fit_text
from sweeps.scene.reading import read_scene
from tests.support.commands import ok, refused
from tests.support.recorded_speeds import LOADS, WHEEL, Recorded, write_teeth
from tests.support.teeth import random_errors

ERRORS = random_errors(WHEEL.width, 0.004, 3)
GAP = -40.0
INERTIA = Recorded().inertia


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Recordings of 20 cycles at three loads, and their scene."""
    folder = tmp_path_factory.mktemp("recorded")
    write_teeth(folder, [Recorded()] * 3, ERRORS, GAP, cycles=20)
    return folder


@pytest.fixture(scope="module")
def fitted(folder: Path) -> xr.Dataset:
    return sweeps.identify(folder / "scene.toml", ["inertia", "gap_angle"])


def test_what_made_the_recordings_is_found_and_those_left_out_predicted(fitted: xr.Dataset) -> None:
    assert fitted.parameter.values.tolist() == ["inertia", "gap_angle"]
    assert fitted.unit.values.tolist() == ["kg m2", "degree"]
    for place, truth in enumerate((INERTIA, GAP)):
        assert fitted.value_low[place] < truth < fitted.value_high[place]
    assert float(fitted.value_deviation[0]) < 0.02
    off = fitted.tooth_error.values - ERRORS
    assert np.abs(off).max() < 5.0 * float(fitted.tooth_error_deviation.mean())
    assert fitted.attrs["likelihood_of_noise"] > 0.01
    assert fitted.attrs["condition_number"] < 100.0
    assert_allclose(fitted.speed.values, 1500.0, rtol=2e-3)
    # Recordings that were left out are predicted.
    off = fitted.delta_predicted - fitted.delta_measured_raw
    unsure = np.hypot(fitted.delta_predicted_deviation, fitted.delta_measured_raw_uncertainty)
    assert (np.abs(off) < 4.0 * unsure).all()


def test_shifted_diagrams_shift_the_speed(folder: Path) -> None:
    """A whole cycle of shift is none; a factor on pressure and crankcase is one on the torque."""
    scene = read_scene(folder / "scene.toml")
    places = [{"load": load, "speed": 1500.0} for load in LOADS]
    computed = SpeedsOfRecordings.of(scene, places, ["dead_centre_shift", "pegging"])
    _, speed = computed.speeds(np.array([[0.0, 0.0], [720.0, 0.0], [1.0, 0.0], [0.0, 0.5]]))
    assert speed.shape == (4, 3, 720)
    assert_allclose(speed[1], speed[0], rtol=1e-9)
    assert np.abs(speed[2] - speed[0]).max() > 0.01
    assert np.abs(speed[3] - speed[0]).max() > 0.01
    own = SpeedsOfRecordings.of(scene, places, ["inertia@2"])
    _, speed = own.speeds(np.array([[2.0], [3.0]]))
    assert (speed[0, [0, 2]] == speed[1, [0, 2]]).all()
    assert np.ptp(speed[1, 1]) < np.ptp(speed[0, 1])


def test_a_wrong_dead_centre_moves_diagrams_and_wheel(folder: Path) -> None:
    """Both together are as each of them by the same angle."""
    scene = read_scene(folder / "scene.toml")
    given = FittedRecordings.of(scene, "scene")

    def seen(keys: list[str], values: list[float]) -> np.ndarray[Any, Any]:
        computed = SpeedsOfRecordings.of(scene, given.places, keys)
        starts = np.deg2rad([GAP, GAP, GAP])
        return np.array(Seen(given, computed, starts[0], starts)(np.array([values])))

    both = seen(["recording_shift"], [2.0])
    assert_allclose(both, seen(["dead_centre_shift", "gap_angle"], [2.0, 2.0]))
    for key in ("dead_centre_shift", "gap_angle"):
        assert np.abs(both - seen([key], [2.0])).max() > 1e-4


def test_predictions_are_near_the_measured_speeds(folder: Path) -> None:
    fit = sweeps.identify(folder / "scene.toml", ["inertia", "load_exponent", "gap_angle"])
    used = fit.interval_used.values == 1
    off = (fit.omega_predicted / fit.omega_raw - 1.0).values[:, used]
    assert 0.0 < np.abs(off).max() < 0.01  # teeth alone are wrong by 0.4 %, speeds by 2 %
    shown = fit.omega_predicted.values[:, used]
    assert_allclose(np.ptp(shown, axis=1) / shown.mean(axis=1), fit.delta_predicted,
                               rtol=1e-3)  # fmt: skip


@pytest.mark.parametrize(
    ("key", "said"),
    [
        ("reciprocating_mass", "reciprocating_mass, the tooth errors: cannot be"),
        ("pressure_factor", "inertia, pressure_factor.*cannot be determined separately"),
    ],
)
def test_what_cannot_be_told_apart_is_refused(folder: Path, key: str, said: str) -> None:
    with pytest.raises(SceneError, match=said):
        sweeps.identify(folder / "scene.toml", ["inertia", key], predict=False)


def test_command(folder: Path) -> None:
    output = folder / "fit.nc"
    arguments = ("identify", folder / "scene.toml", "--vary", "inertia=0.5..9,gap_angle")
    told = ok(*arguments, "--no-predictions", "-o", output)
    assert "Recorded: fit to 3 recordings" in told and "kg m2  (95 %: 2." in told
    with xr.open_dataset(output) as written:
        assert written.sizes["recording"] == 3
    assert "exists" in refused(*arguments, "-o", output)


def test_a_value_at_its_bound_is_told(folder: Path, fitted: xr.Dataset) -> None:
    told = ok("identify", folder / "scene.toml", "--vary", "inertia=1..2.1,gap_angle",
              "--no-predictions")  # fmt: skip
    rows = told.splitlines()
    assert rows[1].strip().startswith("inertia") and rows[1].endswith("to 2.1), at its bound")
    assert "bound" not in rows[2]
    # The bound is wrong by many standard deviations, which noise never is.
    assert "likelihood of noise at most 0.001\n" in told
    assert "bound" not in fit_text(fitted) and "at most" not in fit_text(fitted)
    assert fitted.at_bound.values.tolist() == [0, 0]


@pytest.mark.parametrize(
    ("options", "told"),
    [
        (("--vary", "inertai"),
         "inertai: not a parameter that can be fitted; did you mean 'inertia'"),
        (("--vary", "inertia=3"), "must be KEY or KEY=LOW..HIGH"),
        (("--vary", "inertia=x..3"), "--vary inertia=x..3: x is not a number"),
        (("--vary", "inertia=3..1"), "inertia: from 3 to 1: must ascend"),
        (("--vary", "inertia=3..4"), "inertia: start 2 must lie from 3 to 4"),
        (("--vary", "inertia,inertia"), "must be KEY or KEY=LOW..HIGH"),
        (("--vary", "inertia", "--prior", "bore=1+-1"), "KEY one of --vary"),
        (("--vary", "inertia", "--prior", "inertia=1"), "must be KEY=VALUE+-DEVIATION"),
        (("--vary", "inertia", "--prior", "inertia=1+-0"), "must be positive"),
        (("--vary", "recording_shift", "--own", "recording_shift"), "the wheel is the same"),
        (("--vary", "inertia", "--own", "bore"), "--own bore: must be one of --vary"),
        (("--vary", "inertia", "--teeth", "good"), "--teeth good: must be estimated, perfect, or"),
    ],
)  # fmt: skip
def test_bad_options(folder: Path, options: tuple[str, ...], told: str) -> None:
    assert told in refused("identify", folder / "scene.toml", *options)


def test_a_scene_without_recordings() -> None:
    assert "[measured] is missing" in refused("identify", "first", "--vary", "inertia")
