"""Parameters of synthetic engines from recorded teeth and speeds."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from numpy.testing import assert_allclose

import sweeps
from sweeps.base.errors import SceneError
from sweeps.lab.speed.computed_speeds import SpeedsOfRecordings
from sweeps.lab.speed.fit_results import FittedRecordings, Seen
from sweeps.lab.speed.identification import Varied
from sweeps.scene.reading import read_scene
from sweeps.view.figures import draw
from tests.support.commands import ok, refused
from tests.support.recorded_speeds import LOADS, WHEEL, Recorded, write_speeds, write_teeth
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


OWN_ERRORS = random_errors(WHEEL.width, 0.003, 3)


@pytest.fixture(scope="module")
def over_angle(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_speeds(tmp_path_factory.mktemp("speeds"), [Recorded()] * 3)


@pytest.fixture(scope="module")
def of_teeth(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Own inertia, and a pressure that the second recording has too large."""
    made = [Recorded(), Recorded(2.5), Recorded(2.2, factor=1.06)]
    return write_teeth(tmp_path_factory.mktemp("own"), made, OWN_ERRORS, GAP)


def inside(fit: xr.Dataset, name: str, truth: float, sigmas: float = 4.0) -> bool:
    one = fit.sel(parameter=name)
    return bool(abs(one.value - truth) < sigmas * one.value_deviation)


def test_speed_over_angle(over_angle: Path) -> None:
    fit = sweeps.identify(over_angle, ["inertia", "dead_centre_shift"])
    assert inside(fit, "inertia", 2.2) and inside(fit, "dead_centre_shift", 0.0)
    assert 0.0 < float(fit.value_deviation[0]) < 0.02
    assert fit.attrs["likelihood_of_noise"] > 0.01
    assert fit.sizes["interval"] == 180 and "tooth_error" not in fit and "wheel" not in fit.attrs
    assert fit.recorded_cycles.values.tolist() == [15, 15, 15]
    assert_allclose(fit.speed, 1500.0, rtol=1e-3)
    off = np.abs(fit.delta_predicted - fit.delta_measured_raw)
    unsure = np.hypot(fit.delta_predicted_deviation, fit.delta_measured_raw_uncertainty)
    assert (off < 4.0 * unsure).all()


def test_each_recording_has_its_own_value(of_teeth: Path) -> None:
    """A load that turns with another inertia, a diagram that is too large: both are found."""
    told = ok(
        "identify", of_teeth, "--vary", "inertia,gap_angle,pressure_factor", "--own",
        "inertia,pressure_factor", "--prior", "pressure_factor=1+-0.0001", "--no-predictions",
    )  # fmt: skip
    assert "inertia@3" in told and "pressure_factor@1" in told
    fit = sweeps.identify(
        of_teeth, {"inertia": Varied(own=True), "gap_angle": Varied()}, predict=False
    )
    assert fit.parameter.values.tolist() == ["inertia@1", "inertia@2", "inertia@3", "gap_angle"]
    assert inside(fit, "inertia@1", 2.2) and inside(fit, "inertia@2", 2.5)
    # Of the third one the inertia is too small by its factor on the pressure, nearly.
    assert float(fit.value[2]) == pytest.approx(2.2 / 1.06, rel=0.015)
    assert inside(fit, "gap_angle", GAP)


@pytest.mark.parametrize("made", [Recorded(shift=1.0), Recorded(pegging=0.3)], ids=str)
def test_uncertain_pressures_make_the_inertia_uncertain(tmp_path: Path, made: Recorded) -> None:
    """A dead centre or a pegging that is wrong makes the inertia wrong, unless both have priors."""
    path = write_teeth(tmp_path, [made] * 3, np.zeros(WHEEL.teeth), GAP)
    keys = {"inertia": Varied(), "gap_angle": Varied()}
    trusting = sweeps.identify(path, keys, teeth="perfect", predict=False)
    unsure = {
        "dead_centre_shift": Varied(prior=0.0, deviation=1.0),
        "pegging": Varied(prior=0.0, deviation=0.3),
    }
    careful = sweeps.identify(path, keys | unsure, teeth="perfect", predict=False)
    assert not inside(trusting, "inertia", 2.2)
    assert trusting.attrs["likelihood_of_noise"] < 0.05
    assert inside(careful, "inertia", 2.2)
    assert careful.attrs["likelihood_of_noise"] > 0.05
    assert careful.value_deviation[0] > 1.2 * trusting.value_deviation[0]
    assert inside(careful, "dead_centre_shift", made.shift)
    assert inside(careful, "pegging", made.pegging)


FIGURES = {"fitted_speed", "fit_residuals", "fit_delta", "fit_correlations", "tooth_errors"}


@pytest.mark.slow
def test_figures(of_teeth: Path, tmp_path: Path) -> None:
    output = tmp_path / "fit.nc"
    ok("identify", of_teeth, "--vary", "inertia,gap_angle", "-o", output)
    assert {Path(line).stem for line in ok("plot", output).splitlines()} == FIGURES
    with sweeps.open_archive(output) as archive:
        assert archive.attrs["recordings"].count("sha256") == 3
        paths = draw(archive.load(), tmp_path / "svg", "svg")
    text = next(path for path in paths if path.stem == "fit_delta").read_text()
    assert "predicted from the others" in text and "95 % intervals" in text
