"""Torque and its orders for other programs: what is written is read back as it was."""

import json
import subprocess
import sys
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
import pyuff
import xarray as xr
from numpy.testing import assert_allclose, assert_array_equal

import sweeps
from sweeps.base.columns.recording import read_recording
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
    assert_array_equal(table["amplitude"], rows["throw_torque_order"])
    assert_array_equal(table["phase"], rows["throw_torque_phase"])
    assert_allclose(table["order_frequency"], table["order"] * table["speed"] / 60)
    number = table["amplitude"] * np.exp(1j * np.deg2rad(table["phase"]))
    assert_allclose(table["real"] + 1j * table["imaginary"], number, rtol=1e-12)


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
    assert_allclose(found["torque"], expected, atol=1e-12 * np.abs(expected).max())


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


DIGITS = 1e-11
"""Of ordinates: twelve digits are written."""


def data_sets(path: Path) -> list[dict[str, Any]]:
    sets = pyuff.UFF(str(path)).read_sets()
    return sets if isinstance(sets, list) else [sets]


def test_a_universal_file_has_a_data_set_for_each_curve(
    archive: xr.Dataset, tmp_path: Path
) -> None:
    done = sweeps.export(archive, tmp_path / "t.uff", quantities=["torque", "omega"])
    sets = data_sets(tmp_path / "t.uff")
    assert (done.rows, done.left_out) == (2 * archive["torque"].size, ())
    assert done.columns == ("crank_angle", "torque", "omega")
    designs = [(name, place) for name in ("torque", "omega") for place in range(2)]
    for (name, place), one in zip(designs, sets, strict=True):
        assert_array_equal(one["x"], archive["crank_angle"])
        assert_allclose(one["data"], archive[name][place], rtol=DIGITS)
        assert one["id1"].startswith(f"{name}: ") and "in-line four" in one["id2"]
        assert one["id4"] == f"speed = {(1500, 3000)[place]} rpm"
        assert "phi = 0: firing dead centre of cylinder 1" in one["id5"]
        assert (one["abscissa_axis_lab"], one["ordinate_axis_lab"]) == ("crank_angle", name)
        assert one["abscissa_axis_units_lab"] == "degree"
        assert one["ordinate_axis_units_lab"] == archive[name].attrs["units"]
        moment = (one["ordinate_len_unit_exp"], one["ordinate_force_unit_exp"])
        assert moment == ((1, 1) if name == "torque" else (0, 0))
    found = read_recording(tmp_path / "t.uff").columns
    assert list(found) == ["crank_angle", "torque", "torque (2)", "omega", "omega (2)"]
    assert found["omega (2)"].unit == "rad s-1"


@pytest.mark.parametrize("more", [(), ("--units", "torque=kN*m")])
def test_a_torque_of_a_universal_file_is_read_as_points(
    more: tuple[str, ...], archive: xr.Dataset, tmp_path: Path
) -> None:
    archive.to_netcdf(tmp_path / "a.nc")
    ok("export", tmp_path / "a.nc", "-o", tmp_path / "t.uff", "--quantities", "torque", "--select",
       "speed=3000", *more)  # fmt: skip
    found = sweeps.run(engine_of(tmp_path, 'file = "t.uff"\n'))["torque"]
    expected = archive["torque"].sel(speed=3000)
    here = expected.sel(crank_angle=found["crank_angle"])
    assert_allclose(found, here, atol=DIGITS * np.abs(expected).max().item())


def test_orders_of_a_universal_file_are_read_as_a_torque(
    archive: xr.Dataset, tmp_path: Path
) -> None:
    one = archive.isel(speed=[1])
    sweeps.export(one, tmp_path / "o.uff", orders="torque")
    found = sweeps.run(engine_of(tmp_path, 'file = "o.uff"\nmean = 25\n'))["torque"]
    table = pd.DataFrame({
        "order": one["order"], "amplitude": one["torque_order"][0], "phase": one["torque_phase"][0]
    })  # fmt: skip
    expected = sum_of_orders(25, table, found["crank_angle"].values)
    assert_allclose(found, expected, atol=10 * DIGITS * np.abs(expected).max())


DRIVER = """
import json, sys
sys.path.insert(0, sys.argv[1])
from crank_angle_curves import CrankAngleCurves
angles, speed, times = json.loads(sys.argv[2])
one = CrankAngleCurves(instance_name="one", resources=sys.argv[1])
place = {variable.name: number for number, variable in one.vars.items()}
outputs = [number for name, number in place.items() if name not in ("crank_angle", "mean_speed")]
one.set_real([place["mean_speed"]], [speed])
one.setup_experiment(times[0], None, None)
found = []
for angle, before, after in zip(angles, times, times[1:]):
    one.do_step(before, after - before)
    one.set_real([place["crank_angle"]], [angle])
    found.append(one.get_real(outputs))
print(json.dumps(found))
"""


def outputs_of(path: Path, angles: Any, speed: float = 0.0, times: Any = None) -> Any:
    """Outputs of an FMU's script, run with what the FMU has alone (-S: no installed packages)."""
    with zipfile.ZipFile(path) as packed:
        packed.extractall(path.with_suffix(""))
    times = np.arange(len(angles) + 1.0) if times is None else times
    asked = json.dumps([list(angles), speed, list(times)])
    command = [sys.executable, "-I", "-S", "-c", DRIVER, str(path.with_suffix("") / "resources")]
    done = subprocess.run([*command, asked], capture_output=True, text=True, check=True)
    return np.array(json.loads(done.stdout))


def test_an_fmu_has_the_curves_of_a_design_over_any_angle(
    archive: xr.Dataset, tmp_path: Path
) -> None:
    archive.to_netcdf(tmp_path / "a.nc")
    ok("export", tmp_path / "a.nc", "-o", tmp_path / "t.fmu", "--quantities", "torque,omega",
       "--select", "speed=1500")  # fmt: skip
    one = archive.sel(speed=1500)
    angle = np.deg2rad(one["crank_angle"].values)
    expected = np.stack([one["torque"], one["omega"]], axis=1)
    for turned in (0.0, -8.0 * np.pi, 20.0 * np.pi):
        found = outputs_of(tmp_path / "t.fmu", angle + turned)
        assert_allclose(found, expected, rtol=0, atol=1e-9 * 1e3)
    times = np.deg2rad(np.arange(721.0)) / 150.0
    driven = outputs_of(tmp_path / "t.fmu", np.full(720, angle[0]), 150.0, times)
    assert_allclose(driven, np.roll(expected, -1, axis=0), rtol=0, atol=1e-9 * 1e3)


def test_an_fmu_interpolates_with_the_error_of_its_cubic(
    archive: xr.Dataset, tmp_path: Path
) -> None:
    one = archive.isel(speed=0)
    angle = np.deg2rad(one["crank_angle"])
    wave = one.assign(torque=one["torque"].copy(data=7.0 + 100.0 * np.cos(2.5 * angle + 0.4)))
    sweeps.export(wave, tmp_path / "t.fmu", quantities="torque")
    between = np.linspace(-40.0, 40.0, 997)
    found = outputs_of(tmp_path / "t.fmu", between)[:, 0]
    # Slopes of central differences miss h^2/6 f''', of which the cubic takes h x (1-x) (1-2x).
    step = float(angle[1] - angle[0])
    allowed = 1.2 * step**3 / 6.0 * 100.0 * 2.5**3 / (6.0 * np.sqrt(3.0))
    worst = np.abs(found - (7.0 + 100.0 * np.cos(2.5 * between + 0.4))).max()
    assert 0.5 * allowed < worst < allowed


@pytest.mark.parametrize(
    ("name", "more", "message"),
    [
        ("t.fmu", (), "torque: has 2 values of speed, but an FMU has one design; --select speed"),
        ("t.fmu", ("--orders", "torque"), "orders: an FMU has curves over the crank angle"),
        ("t.fmu", ("--quantities", "torque_mean"), "torque_mean: no curve; must lie over crank_a"),
        ("t.fmu", ("--quantities", "torque_order"), "torque_order: no curve"),
        ("t.uff", ("--quantities", "torque_mean"), "no curve; must lie over crank_angle or order"),
        ("t.uff", ("--quantities", "torqe"), "did you mean 'torque'"),
        ("t.uff", ("--orders", "omega"), "omega_order"),
        ("t.uff", ("--head-units",), "head_units is for .csv"),
        ("t.unv", (), "must end in .csv or .parquet or .xlsx or .uff or .fmu"),
    ],
)
def test_what_is_no_file_of_curves(
    name: str, more: tuple[str, ...], message: str, archive: xr.Dataset, tmp_path: Path
) -> None:
    archive.to_netcdf(tmp_path / "a.nc")
    assert message in refused("export", tmp_path / "a.nc", "-o", tmp_path / name, *more)
    assert [path.name for path in tmp_path.iterdir()] == ["a.nc"]
