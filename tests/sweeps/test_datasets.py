"""Archives: names, units, axes and outcomes; whole files or none; read without xarray."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import cf_units
import numpy as np
import pytest
import xarray as xr
from numpy.testing import assert_array_equal

import sweeps
from sweeps.decide.explore.opening import nearest
from sweeps.decide.explore.rows import rows
from sweeps.running.archive import netcdf
from sweeps.running.archive.stored_dataset import stored_dataset
from sweeps.view.texts.archives import archive_text
from sweeps.view.texts.published import text as published_text
from sweeps.view.texts.tables import rows_text

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
    assert dataset["delta"].dims == ("inertia", "load_offset", "method")
    assert dataset["method"].values.tolist() == [0, 1]
    assert dataset["method_name"].values.tolist() == ["auto", "thesis"]
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


CASES = ["light", "schwer, größer", "nominal"]


def made() -> xr.Dataset:
    """Numbers over two axes and over designs with labels; words, a code, a curve, no value."""
    speed, inertia = np.array([900.0, 1200.0, 1500.0, 1800.0]), np.array([5.0, 2.0])
    designs, both = ("design",), ("speed", "design")
    delta = 1.0 / (speed[:, None] * np.arange(1.0, 4.0))
    delta[1, 2] = np.nan
    return xr.Dataset(
        {
            "delta": (both, delta, {"units": "1", "long_name": "fluctuation, none if too slow"}),
            "delta_published": (both, 1.01 * delta, {"units": "1"}),
            "omega": (
                (*both, "crank_angle"), np.ones((4, 3, 5)) * np.arange(5.0), {"units": "rad s-1"},
            ),
            "imep": (("recorded_cycle",), np.array([3.0, 3.5, 4.0]), {"units": "bar"}),
            "brake_power": ((), np.float64(5e3), {"units": "W", "long_name": "power"}),
            "status": (both, np.where(np.isnan(delta), 3, 0).astype(np.int8)),
        },
        coords={
            "speed": ("speed", speed, {"units": "rpm"}),
            "case": (designs, np.array(CASES, dtype=object)),
            "inertia": ("inertia", inertia, {"units": "kg m2"}),
            "bore": (designs, np.array([0.1, 0.2, 0.3]), {"units": "m"}),
            "crank_angle": ("crank_angle", np.linspace(0.0, 720.0, 5), {"units": "degree"}),
            "recorded_cycle": ("recorded_cycle", np.arange(1.0, 4.0)),
            "tag": ((), "a word"),
        },
        attrs={"scene": "{}", "title": "made", "engine_values": '{"speed": 1200.0}'},
    )  # fmt: skip


def written(folder: Path, **options: Any) -> Path:
    path = folder / "made.nc"
    made().to_netcdf(path, engine="netcdf4", **options)
    return path


def texts(archive: xr.Dataset, path: Path) -> list[str]:
    """All that the commands tell of an archive."""
    return [
        archive_text(archive, str(path), provenance=True),
        archive_text(archive, str(path), units="power=hp,bore=mm,speed=rad/s"),
        rows_text(rows(archive)),
        rows_text(rows(archive, sort="-delta", limit=3)),
        rows_text(rows(archive, quantities=["delta", "status"], relative_to="nominal")),
        rows_text(rows(archive, select={"case": CASES[1]}, quantities=["delta", "status"])),
        rows_text(rows(nearest(archive, case="light", speed=1300.0))),
        published_text(archive),
    ]


@pytest.mark.parametrize(
    "options",
    [
        {},
        {"format": "NETCDF3_64BIT"},
        {"encoding": {"case": {"dtype": "S1"}}, "unlimited_dims": ["speed"]},
        {"encoding": {"delta": {"zlib": True, "complevel": 4, "chunksizes": (3, 2)}}},
        {"encoding": {"delta": {"dtype": "float32", "_FillValue": -1.0}}},
        {"encoding": {"delta": {"dtype": "i2", "scale_factor": 2.0**-15, "_FillValue": -1}}},
    ],
    ids=["as_run", "netcdf3", "letters", "compressed", "filled", "packed"],
)
def test_the_same_is_told_as_with_xarray(options: dict[str, Any], tmp_path: Path) -> None:
    path = written(tmp_path, **options)
    with sweeps.open(path) as archive:
        expected = texts(archive, path)
    with stored_dataset(path) as archive:
        assert texts(archive, path) == expected
    assert all(expected) and CASES[1] in expected[2]


def test_parts_of_parts_are_read_in_place(tmp_path: Path) -> None:
    path = written(tmp_path)
    whole = made().omega
    with stored_dataset(path) as archive:
        for places in (
            {"speed": slice(1, 4), "design": [2, 0]},
            {"speed": 2, "crank_angle": slice(None, None, 2)},
            {"speed": slice(None, None, -1), "crank_angle": slice(3, 1, -1)},
            {"design": np.array([1]), "crank_angle": slice(3, 3)},
        ):
            part, expected = archive["omega"].isel(places), whole.isel(places)
            assert part.dims == expected.dims and part.shape == expected.shape
            assert_array_equal(part.values, expected)
            first = {d: 0 for d, n in expected.sizes.items() if n}
            assert_array_equal(part.isel(first).values, expected.isel(first))
