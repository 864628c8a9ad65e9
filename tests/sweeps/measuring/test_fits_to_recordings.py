"""Fits to speed over angle, own parameters of recordings, uncertain pressures, figures."""

from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from numpy.testing import assert_allclose

import sweeps
from sweeps.errors import SceneError
from sweeps.figures import draw
from sweeps.measuring.identification import Varied
from tests.support.commands import ok, refused
from tests.support.recorded_speeds import LOADS, WHEEL, Recorded, write_speeds, write_teeth
from tests.support.teeth import random_errors

GAP = -40.0
ERRORS = random_errors(WHEEL.width, 0.003, 3)


@pytest.fixture(scope="module")
def over_angle(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_speeds(tmp_path_factory.mktemp("speeds"), [Recorded()] * 3)


@pytest.fixture(scope="module")
def of_teeth(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Own inertia, and a pressure that the second recording has too large."""
    made = [Recorded(), Recorded(2.5), Recorded(2.2, factor=1.06)]
    return write_teeth(tmp_path_factory.mktemp("own"), made, ERRORS, GAP)


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


def test_speed_over_angle_needs_cycles_and_has_no_wheel(tmp_path: Path, over_angle: Path) -> None:
    path = write_speeds(tmp_path, [Recorded()] * 3, cycles=1)
    assert "load_0.csv: one cycle has no scatter; a fit needs two or more cycles" in refused(
        "identify", path, "--vary", "inertia"
    )
    assert "gap_angle: cannot be fitted to speed over angle" in refused(
        "identify", over_angle, "--vary", "inertia,gap_angle"
    )


def test_fine_samples_are_thinned(tmp_path: Path) -> None:
    path = write_speeds(tmp_path, [Recorded()] * 3, cycles=4, step=0.5)
    fit = sweeps.identify(path, ["inertia"], predict=False)
    assert fit.sizes["interval"] == 720
    assert inside(fit, "inertia", 2.2, 6.0)  # four cycles say little of their spread


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


def test_predictions_leave_out_own_parameters(over_angle: Path) -> None:
    """All are own: what is left is the scene as it is."""
    fit = sweeps.identify(over_angle, {"inertia": Varied(own=True)})
    scene = sweeps.run(
        {
            "engine": "ntua", "set": {"speed": 1500}, "designs": {"load": list(LOADS)},
            "solver": {"closure": "cycle_time", "inertia_model": "variable"},
            "output": {"quantities": ["delta"]},
        }
    )  # fmt: skip
    assert_allclose(fit.delta_predicted, scene.delta, rtol=5e-3)


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


def test_figures(of_teeth: Path, tmp_path: Path) -> None:
    """Each figure is drawn, and nothing of a fit goes to other kinds."""
    output = tmp_path / "fit.nc"
    ok("identify", of_teeth, "--vary", "inertia,gap_angle", "-o", output)
    assert {Path(line).stem for line in ok("plot", output).splitlines()} == FIGURES
    with sweeps.open_archive(output) as archive:
        assert archive.attrs["recordings"].count("sha256") == 3
        paths = draw(archive.load(), tmp_path / "svg", "svg")
    text = next(path for path in paths if path.stem == "fit_delta").read_text()
    assert "predicted from the others" in text and "95 % intervals" in text


def test_figures_of_one_parameter_and_one_recording(tmp_path: Path) -> None:
    path = write_speeds(tmp_path, [Recorded()] * 3, cycles=4)
    scene = path.read_text()
    path.write_text(
        scene.replace('["load_0.csv", "load_1.csv", "load_2.csv"]', '"load_2.csv"')
        .replace("[1, 2, 3]", "[3]")
    )  # fmt: skip
    fit = sweeps.identify(path, ["inertia"])
    assert {path.stem for path in draw(fit, tmp_path / "one")} == {
        "fitted_speed", "fit_residuals", "fit_delta",
    }  # fmt: skip


@pytest.mark.parametrize(
    ("options", "told"),
    [
        (("--vary", "gap_angle", "--own", "gap_angle"),
         "gap_angle: cannot have a separate value for each"),
        (("--vary", "gap_angle=0..90"), "gap_angle: found at -40"),
        (("--vary", "inertia", "--prior", "inertia=nan+-1"),
         "inertia: nan is not allowed as bound"),
        (("--vary", "inertia", "--prior", "inertia=2+-inf"),
         "standard deviation inf of the prior must be positive"),
        (("--vary", "inertia", "--prior", "inertia=-2+-1"), "inertia: start -2 must lie from 0"),
        (("--vary", "inertia", "--teeth", "0"), "teeth: standard deviation 0 must be positive"),
        (("--vary", "inertia@1"), "inertia@1: must be inertia; use own"),
    ],
)  # fmt: skip
def test_bad_options(of_teeth: Path, options: tuple[str, ...], told: str) -> None:
    assert told in refused("identify", of_teeth, *options)


def test_a_prior_without_its_deviation(of_teeth: Path) -> None:
    with pytest.raises(SceneError, match="inertia: a prior needs a value and a standard deviation"):
        sweeps.identify(of_teeth, {"inertia": Varied(prior=2.0)})
