"""`info`, `show` and `run` read archives without xarray, and tell the same as with it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from numpy.testing import assert_array_equal

import sweeps
from sweeps.archive.stored_dataset import stored_dataset
from sweeps.errors import SceneError
from sweeps.exploring.rows import rows
from sweeps.exploring.slices import nearest
from sweeps.presenting.archives import archive_text
from sweeps.presenting.published import text as published_text
from sweeps.presenting.tables import rows_text
from tests.support.commands import ok

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


def test_damaged_values_are_told_in_one_line(tmp_path: Path) -> None:
    path = tmp_path / "made.nc"
    chunks = {"omega": {"zlib": True, "complevel": 6, "chunksizes": (1, 3, 5)}}
    made().to_netcdf(path, engine="netcdf4", encoding=chunks)
    raw = path.read_bytes()
    packed = raw.rindex(b"x\x9c")  # how zlib begins the last chunk
    path.write_bytes(raw[:packed] + bytes(8) + raw[packed + 8 :])
    with (
        stored_dataset(path) as archive,
        pytest.raises(SceneError, match="damaged: omega: cannot be read"),
    ):
        print(archive["omega"].values)


def test_commands_tell_it(tmp_path: Path) -> None:
    path = written(tmp_path)
    with sweeps.open(path) as archive:
        assert ok("info", path, "--provenance").rstrip() == texts(archive, path)[0]
