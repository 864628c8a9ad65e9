"""Numbers as people read them: digits, units and widths are the same on every door."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from hypothesis import assume, given
from hypothesis import strategies as st

import sweeps
from engine_dyn.quantities.graph import ALL_QUANTITIES
from sweeps.base.errors import SceneError
from sweeps.base.numbers import digits_of, number_text, number_texts
from sweeps.decide.explore.export import with_digits
from sweeps.decide.explore.rows import rows
from sweeps.scene.reading import read_scene
from sweeps.view.figures.wording import typeset
from sweeps.view.report.embedding import choices_of, described
from sweeps.view.report.key_results import results
from sweeps.view.texts.archives import archive_text
from sweeps.view.texts.loads import load_line
from sweeps.view.texts.readable_dataset import readable_dataset
from sweeps.view.texts.readable_units import READABLE, SHOWN, readable_of_archive
from sweeps.view.texts.tables import last_digits, number_cells, rows_text
from tests.support.commands import invoke, ok, refused

ENDS = ("_max", "_min", "_mean")


@given(st.floats(1.0, 1e6), st.floats(1e-6, 0.9))
def test_a_difference_can_be_read_off_its_two_numbers(mean: float, part: float) -> None:
    high, low = mean * (1.0 + 0.5 * part), mean * (1.0 - 0.5 * part)
    last = last_digits({"omega_max": high, "omega_min": low})["omega_max"]
    told = [float(number_text(value, last=last)) for value in (high, low)]
    # Three digits of the difference, and rounding of both numbers
    assert told[0] - told[1] == pytest.approx(high - low, rel=0.0101)
    assert len(set(number_texts([high, low]))) == 2


def test_numbers_that_differ_by_rounding_alone_get_no_more_digits() -> None:
    assert last_digits({"omega_max": 1500.0000001, "omega_min": 1500.0}) == {}
    assert number_texts([1500.00000001, 1500.0]) == ["1500", "1500"]
    assert number_texts([math.nan, 2.0, math.inf, -math.inf]) == ["-", "2", "inf", "-inf"]
    assert number_text(1500.7, last=-1) == "1500.7" and number_text(0.0, last=-3) == "0"


@given(st.lists(st.floats(-1e9, 1e9).filter(lambda v: abs(v) > 1e-9), min_size=2, max_size=6))
def test_different_numbers_have_different_texts(values: list[float]) -> None:
    distinct = np.unique(values)
    sizes = np.maximum(np.abs(distinct[1:]), np.abs(distinct[:-1]))
    assume((np.diff(distinct) > 2e-7 * sizes).all())
    assert len(set(number_texts(distinct.tolist()))) == distinct.size
    digits = digits_of(distinct)
    assert len({typeset(value, digits) for value in distinct}) == distinct.size


def test_values_of_wide_axes_get_no_digits_for_their_smallest_step() -> None:
    assert digits_of(np.geomspace(1e-3, 1e3, 40)) == 4
    assert digits_of([1500.04, 1499.96]) == 6 and digits_of([0.3, 0.1 + 0.2, 1.0]) == 4
    assert digits_of([]) == digits_of([np.nan, 2.0]) == 4


def test_figures_write_the_same_number_in_their_own_letters() -> None:
    assert typeset(-0.25) == "\N{MINUS SIGN}0.25" and number_text(-0.25) == "-0.2500"
    assert typeset(1.5e8) == r"1.5$\times 10^{8}$" and number_text(1.5e8) == "1.5e+08"


@pytest.fixture(scope="module")
def alike() -> xr.Dataset:
    """All single numbers that are a largest, smallest or mean value; pairs differ by 6e-4."""
    names = [
        name for name, node in ALL_QUANTITIES.items()
        if name.endswith(ENDS) and node.kind != "curve" and not node.adds
    ]  # fmt: skip
    base = 1500.0 * np.pi / 30.0 * np.array([1.0, 1.2, 1.3, 1.4])
    factors = {"_max": 1.0003, "_min": 0.9997, "_mean": 1.0}
    made = xr.Dataset(coords={"inertia": ("inertia", [1.0, 2.0, 3.0, 4.0], {"units": "kg m2"})})
    for name in names:
        times = next(times for end, times in factors.items() if name.endswith(end))
        made[name] = ("inertia", base * times, {"units": ALL_QUANTITIES[name].unit or "1"})
    return made


def stems(archive: xr.Dataset) -> dict[str, list[str]]:
    found: dict[str, list[str]] = {}
    for name in map(str, archive.data_vars):
        found.setdefault(name.rpartition("_")[0], []).append(name)
    return {stem: names for stem, names in found.items() if len(names) > 1}


def test_no_table_shows_a_largest_and_a_smallest_number_as_equal(alike: xr.Dataset) -> None:
    pairs = stems(alike)
    assert {"omega", "torque", "mount_force"} & pairs.keys() >= {"omega", "torque"}
    shown = rows(alike, limit=50)
    cells = {name: number_cells(shown, name, READABLE.get(unit))[0]
             for name, unit in shown.units.items()}  # fmt: skip
    path = Path(__file__)  # info only asks for the size of the file
    lines = archive_text(alike, str(path)).splitlines()
    info = {line.split()[0]: " ".join(line.split()[1:4]) for line in lines if line.strip()}
    report = results(alike, choices_of(alike, None))
    for names in pairs.values():
        assert len({cells[name] for name in names}) == len(names)
        for texts in zip(*(cells[name] for name in names), strict=True):
            assert len(set(texts)) == len(names), names
        assert len({info[name] for name in names}) == len(names), names
        for text in (text for name in names for text in cells[name]):
            assert f">{text}<" in report


def test_one_quantity_has_one_unit_on_every_door() -> None:
    units = sorted({node.unit for node in ALL_QUANTITIES.values() if node.unit})
    assert set(READABLE) <= {*units, "m"}
    archive = xr.Dataset(
        {f"one_{i}": ("inertia", [3.0, 4.0, 5.0, 6.0], {"units": unit})
         for i, unit in enumerate(units)},
        coords={"inertia": [1.0, 2.0, 3.0, 4.0]},
    )  # fmt: skip
    choices = choices_of(archive, None)
    shown = rows(archive)
    page = described(archive, choices)
    figures = readable_dataset(archive)
    lines = archive_text(archive, __file__).splitlines()
    info = {line.split()[0]: line for line in lines if line.startswith("  one_")}
    for i, unit in enumerate(units):
        name, wanted = f"one_{i}", READABLE.get(unit, unit)
        assert number_cells(shown, name, choices.get(name))[1] == SHOWN.get(wanted, wanted)
        assert page.quantities[name]["unit"] == SHOWN.get(wanted, wanted)
        assert figures[name].attrs["units"] == wanted
        assert wanted == "1" or f" {wanted}  " in info[name]
        assert readable_of_archive("archive", archive.variables) == {}


@pytest.mark.parametrize("digits", [1, 4, 10, 12, 15])
def test_rounded_numbers_are_those_of_their_text(digits: int) -> None:
    source = np.random.default_rng(3)
    values = source.normal(size=2000) * 10.0 ** source.integers(-30, 30, 2000)
    values = np.concatenate([values, [0.0, np.nan, np.inf, -np.inf, 1e300, 5e-324]])
    expected = [float(f"{value:.{digits}g}") for value in values]
    np.testing.assert_array_equal(with_digits(values, digits), expected)


SCENE: dict[str, Any] = {
    "engine": "ntua",
    "set": {"speed": 1500},
    "axes": {"load": [50, 90], "inertia": [2.0, 100.0 / 3.0]},
    "output": {"quantities": ["delta", "omega_max", "omega_min", "brake_power", "torque_mean",
                              "torque_max", "torque_min", "energy_swing", "imep"]},
}  # fmt: skip


@pytest.fixture(scope="module")
def archive() -> xr.Dataset:
    return sweeps.run(SCENE)


@pytest.fixture(scope="module")
def path(archive: xr.Dataset, tmp_path_factory: pytest.TempPathFactory) -> Path:
    found = tmp_path_factory.mktemp("readable") / "a.nc"
    archive.to_netcdf(found)
    return found


@pytest.mark.compiled
def test_exported_digits_are_those_that_the_tolerance_carries(
    archive: xr.Dataset, path: Path, tmp_path: Path
) -> None:
    import pandas as pd

    told = ok("export", path, "-o", tmp_path / "t.csv")
    assert (
        "units: load percent, inertia kg m2, omega_max rad s-1" in told and "--head-units" in told
    )
    table = pd.read_csv(tmp_path / "t.csv", engine="python")
    np.testing.assert_array_equal(np.unique(table["inertia"]), archive["inertia"])
    ten = with_digits(archive["omega_max"].values, 10).ravel()
    np.testing.assert_array_equal(table["omega_max"], ten)
    assert (
        max(len(text) for text in (tmp_path / "t.csv").read_text().split("\n")[1].split(",")) < 13
    )
    ok("export", path, "-o", tmp_path / "all.csv", "--digits", "all", "--head-units")
    table = pd.read_csv(tmp_path / "all.csv", engine="python")
    np.testing.assert_array_equal(table["omega_max [rad s-1]"], archive["omega_max"].values.ravel())
    fine = archive.copy()
    fine.attrs["scene"] = '{"solver": {"tolerance": 1e-9}}'
    sweeps.export(fine, tmp_path / "fine.csv")
    table = pd.read_csv(tmp_path / "fine.csv", engine="python")
    thirteen = with_digits(archive["omega_max"].values.ravel(), 13)
    np.testing.assert_array_equal(table["omega_max"], thirteen)
    for bad in ("0", "18", "-1", "1e1", "many", ""):
        assert "must be from 1 to 17, or all" in refused(
            "export", path, "-o", tmp_path / "b.csv", "--digits", bad
        )
    with pytest.raises(SceneError, match=r"has all digits; digits is for \.csv and \.xlsx"):
        sweeps.export(archive, tmp_path / "b.parquet", digits=5)
    assert not (tmp_path / "b.csv").exists()


@pytest.mark.compiled
def test_a_pipe_breaks_no_row_unless_columns_tells_its_width(
    path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("COLUMNS", raising=False)
    names = ("delta", "omega_max", "brake_power", "torque_max", "energy_swing", "imep")
    whole = ok("show", path)
    (head,) = (line for line in whole.splitlines() if "inertia" in line and "[" in line)
    assert all(name in head for name in names) and len(head) > 100
    with monkeypatch.context() as changed:
        changed.setenv("COLUMNS", "60")
        narrow = ok("show", path)
    tables = [line for line in narrow.splitlines() if not line.startswith("the same")]
    assert max(map(len, tables)) <= 60 and sum("inertia" in line for line in tables) > 1
    for bad in ("0", "-3", "wide", "1e3", "9" * 30):
        with monkeypatch.context() as changed:  # pytest itself reads the variable
            changed.setenv("COLUMNS", bad)
            assert ok("show", path) == whole


@pytest.mark.compiled
def test_the_load_is_told_with_its_torque(archive: xr.Dataset, path: Path, tmp_path: Path) -> None:
    low, high = archive["torque_mean"].values
    texts = number_texts([low, high])
    line = load_line(read_scene(SCENE))
    assert line == (
        "load names a diagram of the engine, not a share of the torque: at 1500 rpm, 50 % gives "
        f"{texts[0]} N m, {100 * low / high:.0f} % of that at 90 %; 90 % gives {texts[1]} N m"
    )
    one = {**SCENE, "set": {"speed": 1500, "load": 50}, "axes": {"inertia": [2.0]}}
    assert load_line(read_scene(one)) == line
    assert load_line(read_scene({**SCENE, "engine": "b112", "axes": {"inertia": [2.0]}})) == ""
    assert f"not shares of the torque, which is {', '.join(texts)} N m" in ok("info", path)
    (tmp_path / "s.toml").write_text(
        'engine = "ntua"\n[set]\nload = 50\nspeed = 1500\n[output]\nquantities = ["delta"]\n'
    )
    assert line in invoke("run", tmp_path / "s.toml", "-o", tmp_path / "s.nc").output
    assert "load is the name of a diagram" in ok("info", "ntua")


@pytest.mark.compiled
def test_the_same_numbers_in_run_and_show(archive: xr.Dataset) -> None:
    one = rows_text(rows(archive, select={"load": 50, "inertia": 100.0 / 3.0}))
    told = {line.split()[0]: line.split()[1:3] for line in one.splitlines() if line[:1].isalpha()}
    high, low = (float(told[name][0]) for name in ("omega_max", "omega_min"))
    delta = float(told["delta"][0])
    assert told["omega_max"][1] == "rpm" and told["brake_power"][1] == "kW"
    assert (high - low) / 1500.0 == pytest.approx(delta, rel=0.02)
