"""Archives: names, units, axes and outcomes as the contract has them; whole files or none."""

import json
from pathlib import Path
from typing import Any

import cf_units
import numpy as np
import pytest
import xarray as xr
from numpy.testing import assert_array_equal

import sweeps
from sweeps.archive import netcdf

SCENE: dict[str, Any] = {
    "title": "outcomes",
    "engine": "ntua",
    "axes": {"inertia": [0.02, 0.05, 2.0], "load_offset": [0.0, 500.0]},
    "solver": {"method": ["auto", "thesis"], "passes": 2},
    "output": {
        "quantities": ["delta", "omega", "torque", "friction_torque", "load_coefficient", "imep"],
        "angle_step": 4.0,
    },
}


@pytest.fixture(scope="module")
def dataset() -> xr.Dataset:
    return sweeps.run(SCENE)


def test_every_variable_is_described_and_words_are_coordinates(dataset: xr.Dataset) -> None:
    for name, variable in dataset.variables.items():
        assert variable.attrs["long_name"], name
        cf_units.Unit(variable.attrs["units"])
    assert dataset["load_coefficient"].attrs["units"] == "N m s2"
    assert dataset.attrs["Conventions"] == "CF-1.11"
    assert json.loads(dataset.attrs["scene"]) == SCENE
    for key in ("title", "history", "source", "software", "engine", "parameters"):
        assert dataset.attrs[key], key
    # Words are auxiliary coordinates.
    assert dataset["delta"].dims == ("inertia", "load_offset", "method")
    assert dataset["method"].values.tolist() == [0, 1]
    assert dataset["method_name"].values.tolist() == ["auto", "thesis"]
    # Angles and means.
    angle = dataset["crank_angle"].values
    assert (angle[0], angle[-1], len(angle)) == (-360.0, 356.0, 180)
    mean = dataset["torque"].mean("crank_angle")
    single = sweeps.run({"engine": "ntua", "output": {"quantities": ["torque_mean"]}})
    swing = float(dataset["torque"].max() - dataset["torque"].min())
    assert float(mean) == pytest.approx(float(single["torque_mean"]), abs=1e-6 * swing)


def test_outcomes_and_numbers_belong_together(dataset: xr.Dataset) -> None:
    words = dataset["status"].attrs["flag_meanings"].split()
    assert dataset["status"].attrs["flag_values"].tolist() == list(range(7))
    seen = {words[code] for code in dataset["status"].values.ravel().tolist()}
    assert seen == {"converged", "stalled", "no_steady_state", "passes_done"}
    good = dataset["status"].isin([0, 5, 6])
    assert_array_equal(np.isfinite(dataset["delta"]), good)
    assert_array_equal(np.isfinite(dataset["omega"]).all("crank_angle"), good)
    for name in ("torque", "friction_torque", "imep", "load_coefficient"):
        assert np.isfinite(dataset[name]).all()


def test_unit_of_load_coefficient_only_where_it_has_one() -> None:
    scene = {"engine": "ntua", "output": {"quantities": ["load_coefficient"]}}
    for exponents, unit in (([0], "N m"), ([1], "N m s"), ([3], "N m s3"), ([1.6], None),
                            ([1, 2], None)):  # fmt: skip
        result = sweeps.run({**scene, "axes": {"load_exponent": exponents}})
        assert result["load_coefficient"].attrs.get("units") == unit


def test_designs_and_axes_multiply(tmp_path: Path) -> None:
    scene = {
        "engine": "ntua",
        "designs": {"case": ["short rod", "long rod"], "rod_length": [0.30, 0.45]},
        "axes": {"speed": [1000, 1200, 1400]},
        "output": {"quantities": ["delta", "mean_piston_speed", "rotating_mass"]},
    }
    result = sweeps.run(scene)
    assert result["delta"].dims == ("design", "speed")
    assert result["mean_piston_speed"].dims == ("speed",)
    assert result["rotating_mass"].dims == ("design",)
    assert result["case"].values.tolist() == ["short rod", "long rod"]
    path = tmp_path / "out.nc"
    netcdf.write(result, path)
    with netcdf.open_archive(path) as opened:
        xr.testing.assert_equal(opened.load(), result)
        assert all("_FillValue" not in opened[c].encoding for c in opened.coords)


def test_rules_of_the_rod() -> None:
    """stroke keeps the crank ratio; crank_ratio and rod_length change the rod and its split."""

    def mass(**values: float) -> float:
        scene = {"engine": "ntua", "set": values, "output": {"quantities": ["rotating_mass"]}}
        return float(sweeps.run(scene)["rotating_mass"])

    split = 1.0 + 6.33 * (1.0 - 0.094 / 0.35)
    assert mass() == pytest.approx(split)
    assert mass(rod_length=0.45) == pytest.approx(1.0 + 6.33 * (1.0 - 0.094 / 0.45))
    assert mass(crank_ratio=0.2) == mass(rod_length=0.45)
    assert mass(stroke=0.36) == pytest.approx(1.0 + 6.33 * (1.0 - 0.094 / 0.70))


def test_failed_write_leaves_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    result = sweeps.run({"engine": "ntua", "output": {"quantities": ["imep"]}})
    path = tmp_path / "out.nc"
    path.write_text("old")
    with pytest.raises(FileExistsError):
        netcdf.write(result, path)
    monkeypatch.setattr(xr.Dataset, "to_netcdf", lambda *_, **__: (_ for _ in ()).throw(OSError()))
    with pytest.raises(OSError):
        netcdf.write(result, path, overwrite=True)
    assert path.read_text() == "old" and list(tmp_path.iterdir()) == [path]
