"""Engines of the catalogue: values, arrangements, published power, and each runs over speed."""

import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import sweeps
from engine_dyn.quantities.graph import PARAMETERS
from sweeps.base.checks import check_range, number
from sweeps.scene.engine.engine_files import catalogue, load_engine
from tests.support.scenes import computed
from tests.support.tools import tool

calibration = tool("calibrate_catalogue")
FITTED = calibration.RATED
DRIVEN = calibration.TAKEN


def raw_of(path: Path) -> dict[str, Any]:
    return tomllib.loads(path.read_text(encoding="utf-8"))


def test_the_catalogue() -> None:
    assert {*FITTED, *DRIVEN, "b112", "diesel_105x137", "ntua", "ntua_all_rows"} == set(catalogue())


@pytest.mark.compiled
@pytest.mark.parametrize("name", catalogue())
def test_runs_over_speed(name: str) -> None:
    engine = load_engine(name, Path())
    speeds = engine.values["speed"] * np.array([0.7, 0.85, 1.0])
    if engine.pressure_scale is not None:
        speeds = np.linspace(engine.pressure_scale[0][0], engine.pressure_scale[0][-1], 3)
    found = computed(
        ["delta", "torque_mean", "torque_max", "torque"], name, axes={"speed": speeds.tolist()}
    )
    assert (found["status"] == 0).all()
    assert ((found["delta"] > 0.0) & (found["delta"] < 0.5)).all()
    assert found["torque_max"].values == pytest.approx(found["torque"].max("crank_angle"), rel=5e-3)
    assert found["torque"].mean("crank_angle").values == pytest.approx(
        found["torque_mean"].values, rel=1e-4
    )


@pytest.mark.compiled
@pytest.mark.parametrize("name", FITTED)
def test_published_power(name: str) -> None:
    """At every load of the file: that share of the mean effective pressure at rated power."""
    loads = sorted({*load_engine(name, Path()).family.loads.tolist(), 100.0})
    found = computed(
        ["brake_power", "peak_pressure"],
        name,
        **{"axes": {"load": loads}} if len(loads) > 1 else {},
    )
    power = found["brake_power"].values.reshape(-1)
    np.testing.assert_allclose(power, FITTED[name] * np.array(loads) / 100.0, rtol=1e-3)
    if name in calibration.PEAK:
        rated = found["peak_pressure"].sel(load=100)
        assert float(rated) * 1e5 == pytest.approx(calibration.PEAK[name], rel=1e-3)


@pytest.mark.parametrize("name", [*FITTED, *DRIVEN])
def test_fitted_numbers_are_those_of_the_fit(name: str) -> None:
    """Run the calibration of the last diagram again."""
    engine = raw_of(catalogue()[name])
    table = engine["diagram"][-1]
    fit = calibration.fit(name, table, engine["values"])
    for key, text in fit.items():
        assert float(text) == pytest.approx(table[key], rel=1e-3)


@pytest.mark.compiled
def test_the_marine_diesel_follows_its_propeller() -> None:
    """Power as the cube of the speed down to half of it; a lower mean pressure at each."""
    power = FITTED["marine_80x345"]
    found = computed(
        ["delta", "brake_power", "peak_pressure"],
        "marine_80x345",
        set={"rated_power": power, "rated_speed": 72},
        axes={"speed": [36.5, 45.0, 54.0, 63.0, 71.9]},
        characteristic={"kind": "propeller"},
    )
    assert (found["status"] == 0).all()
    share = (found["speed"].values / 72.0) ** 3
    np.testing.assert_allclose(found["brake_power"], power * share, rtol=1e-6)
    assert (np.diff(found["peak_pressure"]) > 0.0).all()
    assert 50.0 < float(found["peak_pressure"][0]) < 0.5 * float(found["peak_pressure"][-1])


@pytest.mark.compiled
@pytest.mark.parametrize("name", DRIVEN)
def test_published_pressures_of_driven_machines(name: str) -> None:
    found = sweeps.run(
        {"engine": name, "output": {"quantities": ["imep", "peak_pressure", "driver_factor"]}}
    )
    assert float(found["imep"]) * 1e5 == pytest.approx(-DRIVEN[name], rel=1e-3)
    assert float(found["peak_pressure"]) * 1e5 == pytest.approx(calibration.PEAK[name], rel=1e-3)
    assert 0.5 < float(found["driver_factor"]) < 1.0  # the motor in the file is large enough


@pytest.mark.parametrize(
    "path", [catalogue()[name] for name in [*FITTED, *DRIVEN]], ids=lambda p: p.stem
)
def test_every_assumed_number_is_named_with_its_reason(path: Path) -> None:
    raw = raw_of(path)
    known = {
        *raw["values"],
        *(key for table in raw["diagram"] for key in table),
        "arrangement",
        "diagram",
    }
    for key, reason in raw["assumed"].items():
        assert key in known
        assert len(reason) > 10
    for line in path.read_text(encoding="utf-8").splitlines():
        if line.endswith(("; assumed", "; fitted", "# assumed")):
            assert line.split(" = ")[0] in raw["assumed"], line
    for key, value in raw["values"].items():
        node = PARAMETERS[key]
        check_range(number(value, key, node), key, node)


def test_the_digitised_diagram_is_smoothed_within_its_error() -> None:
    smoothing = tool("smooth_digitised")
    angle, pressure = smoothing.digitised()
    smoothed, error = smoothing.smoothed_points(angle, pressure)
    text = smoothing.SMOOTHED.read_text(encoding="utf-8")
    written = np.loadtxt(text.splitlines()[6:], delimiter=",")
    np.testing.assert_allclose(written[:, 0], angle, atol=1e-9)
    np.testing.assert_allclose(written[:, 1], smoothed, atol=2e-6)
    assert text.startswith(smoothing.HEAD)

    moved = (angle > -30.0) & (angle < 60.0)
    np.testing.assert_array_equal(smoothed[~moved], pressure[~moved])
    assert (((smoothed - pressure)[moved] / error) ** 2).mean() == pytest.approx(1.0, abs=1e-6)
