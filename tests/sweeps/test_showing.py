"""Numbers of archives on the terminal, their units, and changes from the nominal design."""

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from numpy.testing import assert_allclose, assert_array_equal

import sweeps
from sweeps.base.errors import SceneError
from sweeps.base.numbers import number_text
from sweeps.decide.explore.rows import rows
from sweeps.running.reduce import ranges as reading
from sweeps.view.texts.readable_units import factor
from sweeps.view.texts.tables import rows_text
from tests.support.archives import run
from tests.support.commands import ok, refused

pytestmark = pytest.mark.compiled

SCENE: dict[str, Any] = {
    "engine": "ntua",
    "axes": {"load": [20, 50, 80], "inertia": [1.5, 2.0, 3.0, 5.0]},
    "output": {"quantities": ["delta", "omega_max", "brake_power", "omega"]},
}


@pytest.fixture(scope="module")
def archive() -> xr.Dataset:
    return sweeps.run(SCENE)


@pytest.fixture(scope="module")
def path(archive: xr.Dataset, tmp_path_factory: pytest.TempPathFactory) -> Path:
    found = tmp_path_factory.mktemp("showing") / "map.nc"
    archive.to_netcdf(found)
    return found


def test_rows_are_the_designs_or_changes_in_percent(archive: xr.Dataset) -> None:
    found = rows(archive)
    assert list(found.table) == [
        "load", "inertia", "delta", "omega_max", "brake_power", "status",
    ]  # fmt: skip
    assert_array_equal(found.table["delta"], archive.delta.values.ravel())
    assert_array_equal(found.table["load"], np.repeat([20.0, 50.0, 80.0], 4))
    assert found.designs == 12 and found.curves == ("omega",)
    assert set(found.table["status"]) == {"converged"}
    data = archive.copy(deep=True)
    data.delta[1, 2] = np.nan
    for sort in ("delta", "-delta"):
        found = rows(data, sort=sort).table["delta"]
        assert np.isnan(found[-1]) and np.isfinite(found[:-1]).all()
    found = rows(archive, select={"load": 50}, relative_to={"inertia": 2.0})
    here = archive.delta.sel(load=50)
    assert_allclose(found.table["delta"], 100.0 * (here / here.sel(inertia=2.0) - 1.0))
    assert found.units["delta"] == "percent" and found.fixed == {"load": 50.0}
    first = rows(archive, relative_to={}).table
    assert first["delta"][0] == 0.0
    with pytest.raises(SceneError, match="not a single design; also give a value of inertia"):
        rows(archive, relative_to={"load": 50})


@pytest.mark.parametrize("sort", ["delta", "-delta", "-inertia", "status"])
@pytest.mark.parametrize("size", [8.0, 8e6])
def test_the_first_of_an_order_whatever_is_read_at_once(
    archive: xr.Dataset, sort: str, size: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(reading, "RANGE", size)
    monkeypatch.setattr(reading.ranges, "__defaults__", (size,))
    frame = archive[["delta", "omega_max", "brake_power", "status"]].to_dataframe().reset_index()
    wanted = frame.sort_values(
        sort.removeprefix("-"), ascending=not sort.startswith("-"), kind="stable"
    )
    found = rows(archive, sort=sort, limit=5).table
    assert_array_equal(found["delta"], wanted.delta.to_numpy()[:5])


def test_units_for_people_and_their_factors(archive: xr.Dataset) -> None:
    text = rows_text(rows(archive, select={"load": 50, "inertia": 2.0}))
    speed, power = (float(archive[n].sel(load=50, **{"inertia": 2.0} if n != "brake_power" else {}))
                    for n in ("omega_max", "brake_power"))  # fmt: skip
    told = {line.split()[0]: line.split() for line in text.splitlines() if line.strip()}
    assert float(told["omega_max"][1]) == pytest.approx(speed * 30.0 / np.pi, rel=1e-3)
    assert told["omega_max"][2] == "rpm"
    assert float(told["brake_power"][1]) == pytest.approx(power / 1e3, rel=1e-3)
    kept = rows_text(rows(archive, select={"load": 50, "inertia": 2.0}), units="archive")
    assert re.search(r"omega_max +[0-9.]+ +rad/s", kept)
    other = rows_text(rows(archive), units="power=hp,omega_max=1/min")
    assert "brake_power [hp]" in other and "omega_max [1/min]" in other
    assert factor("rad s-1", "rpm") == pytest.approx(30.0 / np.pi)
    assert factor("kg m2", "g*m^2") == pytest.approx(1e3)
    assert factor("bar", "MPa") == pytest.approx(0.1)
    assert factor("1", "percent") == pytest.approx(100.0)
    assert factor("W", "hp") == pytest.approx(1.0 / 745.6998715822702)
    for bad in ("9**9**9", "kW; import os", "frobs", "", "m" * 99):
        with pytest.raises(SceneError, match="must be a unit"):
            factor("W", bad)
    with pytest.raises(SceneError, match="cannot be used for a quantity in"):
        factor("W", "bar")


def test_the_command(path: Path) -> None:
    told = ok("show", path, "--sort=-delta", "--limit", "5")
    assert "5 of 12 designs" in told and "the same in all" in told
    assert "not shown, because they are curves: omega" in told
    assert all(len(line) <= 130 for line in told.splitlines())
    one = ok("show", path, "--select", "load=50,inertia=2")
    assert "coefficient of speed fluctuation" in one and "at load = 50, inertia = 2" in one
    assert "+" in ok("show", path, "--relative-to", "first", "--quantities", "delta,omega_max")


@pytest.mark.parametrize(
    ("fraction", "status", "force", "said"),
    [(np.nan, 0, 1.0, True), (np.nan, 4, 1.0, False), (np.nan, 0, np.nan, False),
     (0.5, 0, 1.0, False)],
)  # fmt: skip
def test_the_reason_of_a_missing_value_is_that_of_its_own_row(
    fraction: float, status: int, force: float, said: bool
) -> None:
    def over(values: list[float], text: str) -> tuple[str, list[float], dict[str, str]]:
        return "inertia", values, {"long_name": text, "units": "1"}

    made = xr.Dataset(
        {"fraction": over([0.5, 0.4, 0.3, fraction], "best fraction, none if throws cancel"),
         "force": over([1.0, 2.0, 3.0, force], "force"),
         "status": over([0, 0, 0, status], "outcome")},
        coords={"inertia": [1.0, 2.0, 3.0, 4.0]},
    )  # fmt: skip
    assert ("fraction -: none if throws cancel" in rows_text(rows(made))) is said


@pytest.fixture(scope="module")
def of_bearings(tmp_path_factory: pytest.TempPathFactory) -> Path:
    archive = sweeps.run(
        engine="si_four_87x101",
        axes={"load": [50, 100]},
        output={
            "quantities": ["delta", "omega", "torque_order", "main_journal_load_max",
                           "main_journal_load_mean"],
        },
    )  # fmt: skip
    found = tmp_path_factory.mktemp("bearings") / "four.nc"
    archive.to_netcdf(found)
    return found


def test_several_numbers_for_each_design_have_rows_or_hints(
    of_bearings: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    told = ok("show", of_bearings).splitlines()
    assert "not shown, because they are curves: omega" in told
    assert (
        "not shown, because they have several numbers for each design (over main_bearing): "
        "main_journal_load_max, main_journal_load_mean; --select main_bearing=2 shows one of them, "
        "--quantities main_journal_load_max all"
    ) in told
    one = ok("show", of_bearings, "--select", "main_bearing=2", "--quantities",
             "main_journal_load_max")  # fmt: skip
    with sweeps.open(of_bearings) as data:
        expected = data.main_journal_load_max.sel(main_bearing=2).values / 1e3
    assert all(number_text(float(value)) in one for value in expected)
    assert "not shown" not in one  # what was not asked for
    with sweeps.open(of_bearings) as data:
        found = rows(data, select={"load": 50}, quantities=["main_journal_load_max", "delta"])
        loads = data.main_journal_load_max.sel(load=50)
        assert_array_equal(found.table["main_journal_load_max"], loads)
        assert_array_equal(found.table["main_bearing"], data.main_bearing)
        largest = rows(data, quantities="torque_order", sort="-torque_order", limit=1)
        assert float(largest.table["torque_order"][0]) == float(data.torque_order.max())
        assert largest.designs == data.torque_order.size
    assert "1 of 10 rows; --limit" in ok(
        "show", of_bearings, "--quantities", "main_journal_load_max", "--limit", "1"
    )
    names = "torque_order,main_journal_load_max"
    told = refused("show", of_bearings, "--quantities", names)
    assert "(over main_bearing) do not fit into one table" in told
    with sweeps.open(of_bearings) as data:
        data.dyn.show()
    told = capsys.readouterr().out
    assert 'select=dict(order=1) shows one of them, quantities="torque_order" all' in told
    assert "--select" not in told


@pytest.fixture(scope="module")
def grid(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("nominal") / "grid.nc"
    scene: dict[str, Any] = {
        "engine": "ntua",  # its own values: 1200 rpm, 50 percent, 2 kg m2
        "axes": {"speed": [1000.0, 1200.0, 1500.0], "inertia": [1.0, 2.0]},
        "output": {"quantities": ["delta", "brake_power"]},
    }
    run(scene, path)
    return path


def test_nominal_is_the_engines_own_design(grid: Path) -> None:
    with sweeps.open(grid) as found:
        named = found.dyn.table(relative_to="nominal")
        given = found.dyn.table(relative_to={"speed": 1200.0, "inertia": 2.0})
    assert named.equals(given)
    own = named[(named["speed"] == 1200.0) & (named["inertia"] == 2.0)]
    assert own["delta"].item() == 0.0 and (named["delta"] != 0.0).sum() == 5
    assert "+" in ok("show", grid, "--relative-to", "nominal")
    with sweeps.open(grid) as found:
        part = found.isel(speed=[0, 2])
        with pytest.raises(SceneError, match="speed = 1200, the engine's own value, is not on"):
            rows(part, relative_to="nominal")
        without = found.assign_attrs(engine_values="{}")
        with pytest.raises(SceneError, match="the archive has no value of the engine for it"):
            rows(without, relative_to="nominal")
