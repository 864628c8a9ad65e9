"""Torque and its orders for other programs: what is written is read back as it was."""

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
import xarray as xr

import sweeps
from sweeps.errors import SceneError
from tests.support.commands import ok, refused
from tests.support.scenes import computed, refusal

pytestmark = pytest.mark.compiled

TORQUE_OF_A_FILE = """
title = "a torque given by its orders"
[values]
inertia = 1
speed = 1500
load_exponent = 0
load_offset = 0
[[diagram]]
kind = "torque"
"""


@pytest.fixture(scope="module")
def archive() -> xr.Dataset:
    names = [f"{scope}torque_{part}" for scope in ("", "throw_") for part in ("order", "phase")]
    return computed(
        [*names, "order_frequency", "torque", "omega", "torque_mean"],
        "si_four_87x101",
        axes={"speed": [1500, 3000]},
    )


def engine_of(folder: Path, diagram: str) -> dict[str, Any]:
    (folder / "engine.toml").write_text(TORQUE_OF_A_FILE + diagram)
    return {"engine": str(folder / "engine.toml"), "output": {"quantities": ["torque"]}}


def sum_of_orders(mean: float, table: pd.DataFrame, angle: Any) -> Any:
    angle = np.deg2rad(angle)[:, None]
    phase = np.deg2rad(table["phase"].to_numpy())
    parts = table["amplitude"].to_numpy() * np.cos(table["order"].to_numpy() * angle + phase)
    return mean + parts.sum(axis=1)


# --- orders as a table ----------------------------------------------------------------------------


def test_orders_are_a_table_with_its_convention(archive: xr.Dataset, tmp_path: Path) -> None:
    done = sweeps.export(archive, tmp_path / "t.csv", orders="throw_torque")
    head = [line for line in (tmp_path / "t.csv").read_text().splitlines() if line[0] == "#"]
    assert "amplitude cos(order phi + phase)" in head[1] and "top dead centre" in head[2]
    assert "amplitude [N m], phase [degree]" in head[4]
    table = pd.read_csv(tmp_path / "t.csv", comment="#", engine="python")
    assert done.rows == len(table) == archive["throw_torque_order"].size
    assert done.columns == (*archive["throw_torque_order"].dims, *table.columns[3:])
    expected = archive[["throw_torque_order", "throw_torque_phase", "order_frequency"]]
    rows = expected.to_dataframe(list(archive["throw_torque_order"].dims)).reset_index()
    np.testing.assert_array_equal(table["amplitude"], rows["throw_torque_order"])
    np.testing.assert_array_equal(table["phase"], rows["throw_torque_phase"])
    np.testing.assert_allclose(table["order_frequency"], table["order"] * table["speed"] / 60)
    number = table["amplitude"] * np.exp(1j * np.deg2rad(table["phase"]))
    np.testing.assert_allclose(table["real"] + 1j * table["imaginary"], number, rtol=1e-12)


@pytest.mark.parametrize("more", [(), ("--units", "torque_order=kN*m,torque_phase=rad")])
def test_a_table_of_orders_is_read_as_a_torque(
    more: tuple[str, ...], archive: xr.Dataset, tmp_path: Path
) -> None:
    archive.to_netcdf(tmp_path / "a.nc")
    ok("export", tmp_path / "a.nc", "-o", tmp_path / "t.csv", "--orders", "torque", "--select",
       "speed=1500", "--head-units", *more)  # fmt: skip
    mean = float(archive["torque_mean"][0])
    found = sweeps.run(engine_of(tmp_path, f'file = "t.csv"\nmean = {mean}\n'))
    one = archive.isel(speed=0)
    table = pd.DataFrame(
        {"order": one["order"], "amplitude": one["torque_order"], "phase": one["torque_phase"]}
    )
    expected = sum_of_orders(mean, table, found["crank_angle"].values)
    np.testing.assert_allclose(found["torque"], expected, atol=1e-12 * np.abs(expected).max())


def test_sine_and_cosine_are_read_as_harmonics_are(tmp_path: Path) -> None:
    (tmp_path / "t.csv").write_text("order,sine,cosine\n0.5,10,20\n3,-8,0\n")
    rows = "[{order = 0.5, sine = 10, cosine = 20}, {order = 3, sine = -8}]"
    found, expected = (
        sweeps.run(engine_of(tmp_path, f"{way}\nmean = 25\n"))["torque"]
        for way in ('file = "t.csv"', f"harmonics = {rows}")
    )
    np.testing.assert_array_equal(found, expected)


@pytest.mark.parametrize(
    ("text", "more", "message"),
    [
        ("order,amplitude,phase\n1,2,3\n2,2,3\n", "", "mean: missing"),
        ("order,amplitude\n1,2\n2,2\n", "mean = 1", "orders need sine and cosine, or amplitude"),
        ("order,sine,cosine\n1,2,3\n1,2,3\n", "mean = 1", "2 orders, 1 of them different: must be"),
        ("order,sine,cosine\n1,2,3\n2,2,3\n", "mean = 1\nangle_column = 1", "a table of orders"),
        ("angle,torque\n" + "".join(f"{i},{i % 2}\n" for i in range(0, 361, 10)), "mean = 1",
         "mean: not allowed together with points"),
    ],
)  # fmt: skip
def test_tables_that_are_no_orders(tmp_path: Path, text: str, more: str, message: str) -> None:
    (tmp_path / "t.csv").write_text(text)
    assert message in refusal(engine_of(tmp_path, f'file = "t.csv"\n{more}\n'))


def test_orders_that_cannot_be_written(archive: xr.Dataset, tmp_path: Path) -> None:
    archive.drop_vars("order_frequency").to_netcdf(tmp_path / "a.nc")
    for orders, message in (("omega", "omega_order, omega_phase"), ("torque", "no order_freq")):
        output = ("-o", tmp_path / "t.csv", "--orders", orders)
        assert message in refused("export", tmp_path / "a.nc", *output)
    with pytest.raises(SceneError, match="not allowed together with orders"):
        sweeps.export(archive, tmp_path / "t.csv", orders="torque", quantities="torque_order")
