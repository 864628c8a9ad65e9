"""Archives read as one, and designs found in them."""

import re
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_array_equal

import sweeps
from sweeps.base.errors import SceneError
from sweeps.base.fronts import front_of
from sweeps.decide.explore import opening
from sweeps.running.archive.netcdf import open_archive
from sweeps.running.reduce import ranges
from sweeps.running.reduce.searches import Front
from sweeps.scene.conditions import constraint
from tests.support.archives import run, shards
from tests.support.commands import ok
from tests.support.scenes import DESIGN_TABLE, TO_JOIN, refusal_of

pytestmark = pytest.mark.compiled


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("reading") / "scene.toml"
    path.write_text(TO_JOIN)
    return path


@pytest.fixture(scope="module")
def whole(scene: Path) -> xr.Dataset:
    return sweeps.run(scene)


@pytest.fixture(scope="module")
def table() -> xr.Dataset:
    return sweeps.run(DESIGN_TABLE)


def without_history(dataset: xr.Dataset) -> xr.Dataset:
    own = ("history", "seconds", "command_line", "input_files")
    return dataset.assign_attrs(dict.fromkeys(own, ""))


@pytest.mark.parametrize("name", ["scene", "table"])
def test_shards_open_as_what_merge_writes(name: str, scene: Path, tmp_path: Path) -> None:
    paths = shards(scene if name == "scene" else DESIGN_TABLE, 3, tmp_path)
    ok("merge", *paths, "-o", tmp_path / "whole.nc")
    with sweeps.open(paths[::-1]) as lazy, open_archive(tmp_path / "whole.nc") as merged:
        xr.testing.assert_identical(without_history(lazy.load()), without_history(merged.load()))
        assert len(lazy.attrs["history"].splitlines()) >= 2


def test_nothing_is_read_before_it_is_used(
    scene: Path, tmp_path: Path, whole: xr.Dataset, monkeypatch: pytest.MonkeyPatch
) -> None:
    paths = shards(scene, 3, tmp_path)
    sweeps.open(paths).close()  # xarray looks for dask the first time
    monkeypatch.setitem(sys.modules, "dask", None)
    read: list[tuple[int, ...]] = []
    of_file = opening._slice_of

    def counting(places: Any) -> Any:
        read.append(tuple(places))
        return of_file(places)

    monkeypatch.setattr(opening, "_slice_of", counting)
    with sweeps.open(paths) as lazy:
        cut = lazy["delta"].isel(speed=1, inertia=[6, 0, 1])
        assert lazy["delta"].shape == (4, 7)
        assert not read
        assert_array_equal(cut.values, whole["delta"].values[1, [6, 0, 1]])
        # Of seven points, three shards have 2, 2 and 3: the middle one is not asked.
        assert read == [(0, 1), (2,)]
        for key in (np.s_[::-1, 5], np.s_[1:3, 1::2], np.s_[2, 3], np.s_[[3, 0], [4, 2]], np.s_[:]):
            expected = whole["delta"][key] if key != np.s_[:] else whole["delta"]
            assert_array_equal(lazy["delta"][key].values, expected.values)
        here = xr.Variable(("front",), [3, 0, 3]), xr.Variable(("front",), [1, 6, 1])
        points = lazy["delta"].isel(speed=here[0], inertia=here[1])
        assert_array_equal(points, whole["delta"].values[[3, 0, 3], [1, 6, 1]])


def test_what_does_not_open(scene: Path, tmp_path: Path) -> None:
    paths = shards(scene, 3, tmp_path)
    other = tmp_path / "other.nc"
    run({"engine": "ntua", "output": {"quantities": ["delta"]}}, other)
    text = tmp_path / "text.nc"
    text.write_text("no archive")
    foreign = tmp_path / "foreign.nc"
    xr.Dataset({"delta": ("x", [1.0])}).to_netcdf(foreign, engine="netcdf4")
    for wrong, told in (
        ([], "no archive"),
        (tmp_path / "none.nc", "no such file"),
        ("a" * 5000, "no such file"),
        (tmp_path, "is not a file"),
        (text, "not a netCDF archive"),
        (foreign, "not an archive written by `run`"),
        ([paths[0], tmp_path / "none.nc"], "no such file"),
        ([paths[0], foreign], "foreign.nc"),
        (paths[:2], "shards are missing"),
        ([paths[0], other], "other.nc"),
    ):
        assert re.search(told, refusal_of(lambda wrong=wrong: sweeps.open(wrong)))


def test_best_is_what_looking_at_all_finds(
    whole: xr.Dataset, table: xr.Dataset, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(ranges.ranges, "__defaults__", (24.0,))  # three designs at a time
    limit = float(whole["delta"].median())
    found = sweeps.best(whole, least="inertia", within=[f"delta <= {limit!r}", "speed >= 1100"])
    rows = whole[["delta"]].to_dataframe().reset_index()
    rows = rows[(rows["delta"] <= limit) & (rows["speed"] >= 1100)]
    first = rows.sort_values(["inertia", "speed"]).iloc[0]
    for name in ("inertia", "speed", "delta"):
        assert float(found[name]) == first[name]
    assert found["imep"].ndim == 0
    most = sweeps.best(whole, most="delta", within="speed > 0")
    assert float(most["delta"]) == float(whole["delta"].max())
    found = sweeps.best(table, most="stroke")
    assert "design" not in found["imep"].dims
    assert set(table["delta"].dims) - set(found["delta"].dims) == {"design"}
    assert float(found["stroke"]) == 0.2
    one = xr.Dataset({"delta": 0.01, "imep": 5.0})
    assert float(sweeps.best(one, least="delta", within="imep > 4")["delta"]) == 0.01
    assert sweeps.pareto(one, "delta", "imep").sizes == {"front": 1}


def test_failed_designs_are_not_the_best() -> None:
    archive = xr.Dataset(
        {
            "delta": ("inertia", [np.nan, 0.01, 0.02, 0.03]),
            "status": ("inertia", np.array([0, 3, 0, 0], np.int8), {}),
        },
        {"inertia": [1.0, 2.0, 3.0, 4.0]},
    )
    assert float(sweeps.best(archive, least="inertia")["inertia"]) == 1.0
    assert float(sweeps.best(archive, least="inertia", within="delta<1")["inertia"]) == 3.0
    assert float(sweeps.best(archive, least="delta")["inertia"]) == 3.0
    front = sweeps.pareto(archive, "delta", "inertia")
    assert front["inertia"].values.tolist() == [3.0]
    with pytest.raises(
        SceneError, match="no design meets all conditions; 2 of 4 designs have a result"
    ):
        sweeps.best(archive, least="inertia", within=["delta < 0.001"])


UNITS = {
    "brake_power": "W", "delta": "1", "speed": "rpm", "omega_max": "rad s-1", "load": "percent",
    "inertia": "kg m2",
}  # fmt: skip


@pytest.mark.parametrize(
    ("text", "name", "sign", "limit"),
    [
        ("delta <= 1/150", "delta", "<=", 1 / 150), (" omega_max>1e3 ", "omega_max", ">", 1000.0),
        ("a < -2.5 / 1e1", "a", "<", -0.25), ("load >= 50", "load", ">=", 50.0),
        ("brake_power >= 60", "brake_power", ">=", 60.0),
        ("brake_power >= 60 kW", "brake_power", ">=", 60e3),
        ("brake_power>=60kW", "brake_power", ">=", 60e3),
        ("brake_power > 1.5e-2 MW", "brake_power", ">", 15e3),
        ("delta <= 0.5 %", "delta", "<=", 0.005), ("load >= 50 %", "load", ">=", 50.0),
        ("speed < 1500 1/min", "speed", "<", 1500.0), ("inertia < 2 kg m2", "inertia", "<", 2.0),
        ("speed < 157.0796327 rad/s", "speed", "<", 1500.0),
        ("omega_max < 1500 rpm", "omega_max", "<", 157.0796327),
        ("inertia < 5e3 kg cm²", "inertia", "<", 0.5),
        # what does not fit
        ("brake_power >= 60 bar", "",
         "", "condition on brake_power: limit = '60 bar': must be a number in W"),
        ("brake_power >= 60 kVA", "", "", "is apparent power"),
        ("delta <= 5 pumps", "", "", "without a unit, or in percent"),
        # pint would count radians
        ("omega_max <= 1500 1/min", "", "", "must be a number in rad s-1"),
        ("brake_power >= 60 W**9**9", "", "", "must be a number in W"),
        ("brake_power >= 60 kW; import os", "", "", "must be a number in W"),
    ],
)  # fmt: skip
def test_conditions_with_units(text: str, name: str, sign: str, limit: float | str) -> None:
    if isinstance(limit, str):
        with pytest.raises(SceneError, match=re.escape(limit)):
            constraint(text, UNITS.get)
        return
    found = constraint(text, UNITS.get)
    assert (found.name, found.sign) == (name, sign)
    assert found.limit == pytest.approx(limit, rel=1e-9)
    shown, given = (one.partition(sign)[2].strip() for one in (str(found), text))
    assert shown == given or given in ("1e3", "-2.5 / 1e1")  # which have a plainer form


@pytest.mark.parametrize(
    "text", ["", "delta", "delta = 1", "delta <= ", "imep <= x", "delta <= 1/0", "delta <= nan",
             "1 <= delta <= 2", "delta <= 1/2/3", "__import__('os') < 1", "delta < 1e999"],
)  # fmt: skip
def test_what_is_no_condition(text: str, whole: xr.Dataset) -> None:
    with pytest.raises(SceneError, match=r"condition .*: must be a name"):
        sweeps.best(whole, least="inertia", within=text)


def test_what_best_and_pareto_refuse(whole: xr.Dataset) -> None:
    one = whole.isel(speed=0)
    for call, told in (
        (lambda: sweeps.best(whole), "needs least or most, with a quantity"),
        (lambda: sweeps.best(whole, least="delta", most="imep"), "least and most are both given"),
        (lambda: sweeps.best(whole, least="dleta"), "did you mean 'delta'"),
        (lambda: sweeps.best(whole, least="load_torque"), "over crank_angle"),
        (lambda: sweeps.best(whole, least="delta", within="lod < 1"), "not in the archive"),
        (lambda: sweeps.best(one, least="delta", within="delta < 0"), "0 with delta < 0"),
        (lambda: sweeps.pareto(whole, "delta", "delta"), "is given twice"),
        (lambda: sweeps.pareto(whole, "delta", "imep", most="inertia"), "must be delta or imep"),
    ):
        with pytest.raises(SceneError, match=told):
            call()


def looked_at(first: Any, second: Any) -> set[int]:
    """Every pair against every other."""
    return {
        i
        for i in range(len(first))
        if not any(
            first[j] <= first[i] and second[j] <= second[i]
            and (first[j] < first[i] or second[j] < second[i])
            for j in range(len(first))
        )
    }  # fmt: skip


@given(st.integers(1, 5), st.data())
def test_front_of_many_numbers_is_what_comparing_all_finds(many: int, data: Any) -> None:
    designs = data.draw(
        st.lists(st.tuples(*[st.integers(-2, 3)] * (many + 1)), min_size=1, max_size=30)
    )
    numbers = np.array(designs, dtype=float).T
    found = front_of(*numbers)
    below = (numbers[:, :, None] <= numbers[:, None]).all(0)
    less = (numbers[:, :, None] < numbers[:, None]).any(0)
    assert found.tolist() and set(found) == set(np.flatnonzero(~(below & less).any(0)))
    assert len(found) == len(set(found))
    assert (np.diff(numbers[0][found]) >= 0.0).all()
    # taken in two parts, it is the same
    half = numbers.shape[1] // 2
    front = Front(len(numbers))
    front.add(numbers[:, :half], np.arange(half))
    front.add(numbers[:, half:], np.arange(half, numbers.shape[1]))
    assert set(front.places) == set(found)
    assert_array_equal(front.values, numbers[:, front.places])


@pytest.mark.parametrize("values", [3, 20, 10**9])
@pytest.mark.parametrize("many", [2, 3])
def test_front_of_thousands_is_what_comparing_all_finds(many: int, values: int) -> None:
    """Also with equal numbers and infinite ones, and as designs come in parts."""
    draw = np.random.default_rng(7)
    numbers = draw.integers(0, values, (many, 3000)).astype(float)
    numbers[draw.random(numbers.shape) < 0.02] = np.inf
    expected = np.flatnonzero([
        not ((numbers <= one[:, None]).all(0) & (numbers < one[:, None]).any(0)).any()
        for one in numbers.T
    ])  # fmt: skip
    assert_array_equal(np.sort(front_of(*numbers)), expected)
    front = Front(many)
    for part in np.array_split(np.arange(3000), 7):
        front.add(numbers[:, part], part)
    assert_array_equal(np.sort(front.places), expected)


def test_pareto_of_an_archive(whole: xr.Dataset, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ranges.ranges, "__defaults__", (24.0,))
    front = sweeps.pareto(whole, "delta", "torque_max", most=["torque_max"], within="speed < 1550")
    cut = whole.isel(speed=slice(0, 3))
    delta, torque = (
        np.asarray(a.broadcast_like(cut["delta"]).transpose(*cut["delta"].dims)).reshape(-1)
        for a in (cut["delta"], cut["torque_max"])
    )
    expected = sorted(looked_at(delta, -torque), key=lambda i: delta[i])
    assert_array_equal(front["delta"], delta[expected])
    assert_array_equal(front["torque_max"], torque[expected])
    assert front["delta"].dims == ("front",)
    assert front["load_torque"].dims == ("front", "crank_angle")
    for i in range(front.sizes["front"]):
        one = front.isel(front=i)
        again = whole.sel(speed=float(one["speed"]), inertia=float(one["inertia"]))
        assert float(again["delta"]) == float(one["delta"])
