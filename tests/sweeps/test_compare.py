"""Two archives against each other: what is the same, what differs, by how much and where."""

from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import sweeps
from sweeps.exploring import compare as comparing
from sweeps.exploring.compare import compare
from sweeps.presenting.comparison import comparison_text
from tests.support.archives import run
from tests.support.commands import invoke, ok, refused
from tests.support.scenes import DESIGN_TABLE, TO_JOIN

pytestmark = pytest.mark.compiled


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("compare")
    (folder / "scene.toml").write_text(TO_JOIN)
    run(folder / "scene.toml", folder / "a.nc")
    return folder


@pytest.fixture
def archive(folder: Path) -> xr.Dataset:
    with sweeps.open(folder / "a.nc") as opened:
        return opened.load()


def test_an_archive_is_the_same_as_itself(folder: Path) -> None:
    run(folder / "scene.toml", folder / "again.nc", overwrite=True)
    text = ok("compare", folder / "a.nc", folder / "again.nc", "--tolerance", "0")
    assert text.startswith("axes: the same\n")
    assert "delta" in text and "the same in 28 values" in text
    assert "differ" not in text
    assert "otherwise" not in text


def test_the_largest_difference_and_where(
    archive: xr.Dataset, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(comparing.ranges, "__defaults__", (24.0,))  # three values at a time
    other = archive.copy(deep=True)
    delta = other["delta"].values
    delta[1, 2] *= 1.001
    delta[3, 0] *= 0.99
    delta[0, 4] = np.nan
    imep = other["imep"].values
    imep += 0.25
    found = {d.name: d for d in compare(archive, other).quantities}
    first = archive["delta"].values
    assert found["delta"].count == 28
    assert found["delta"].differing == 3
    assert found["delta"].only_one == 1
    inertia = archive["inertia"].values
    assert found["delta"].only_at == {"speed": 1000.0, "inertia": inertia[4]}
    assert found["delta"].relative == pytest.approx(0.01, rel=1e-9)
    assert found["delta"].relative_at == {"speed": 1600.0, "inertia": inertia[0]}
    assert found["delta"].relative_pair == (first[3, 0], delta[3, 0])
    gap = np.abs(delta - first)
    assert found["delta"].largest == np.nanmax(gap)
    at = np.unravel_index(np.nanargmax(gap), gap.shape)
    assert list(found["delta"].largest_at.values()) == [
        archive["speed"].values[at[0]], inertia[at[1]],
    ]  # fmt: skip
    assert found["imep"].largest == pytest.approx(0.25, rel=1e-12)
    assert found["fmep"].differing == 0
    assert not compare(archive, other).same
    text = comparison_text(compare(archive, other))
    assert "3 of 28 values differ" in text
    assert "largest relative difference 0.01: " in text
    assert "at speed=1600, inertia=1.5" in text
    assert "1 with a number in only one archive, first at speed=1000, inertia=" in text


def test_infinities_zeros_and_both_not_a_number() -> None:
    one = xr.Dataset({"q": ("x", [0.0, np.nan, np.inf, np.inf, 1.0, 0.0])})
    two = xr.Dataset({"q": ("x", [0.0, np.nan, np.inf, -np.inf, 1.0, -0.0])})
    (found,) = compare(one, two).quantities
    assert found.differing == 1
    assert found.relative == np.inf
    assert found.relative_at == {"x": 3}
    (found,) = compare(one.isel(x=[0, 1, 2, 4, 5]), two.isel(x=[0, 1, 2, 4, 5])).quantities
    assert found.differing == 0


def test_where_axes_differ_common_values_are_compared(archive: xr.Dataset) -> None:
    other = archive.isel(speed=[3, 0, 2]).copy(deep=True)
    other["delta"].values[0, 0] += 1.0  # at 1600 rpm
    found = compare(archive, other)
    assert found.axes == ["speed: 3 values in both, of 4 in the first and 3 in the second"]
    (delta,) = (d for d in found.quantities if d.name == "delta")
    assert delta.count == 21
    assert delta.differing == 1
    assert delta.largest_at["speed"] == 1600.0
    turned = compare(archive, archive.isel(inertia=slice(None, None, -1)))
    assert turned.axes == ["inertia: the same 7 values in another order"]
    assert not any(d.differing for d in turned.quantities)
    apart = compare(archive.isel(speed=[0]), archive.isel(speed=[1]))
    assert "delta: no axis point is in both archives" in apart.not_compared


def test_words_and_tables_of_designs() -> None:
    table = sweeps.run(DESIGN_TABLE)
    other = table.isel(method=[1], design=[4, 2]).copy(deep=True)
    other["delta"].values[0] *= 2.0
    found = compare(table, other)
    assert found.axes == [
        "design: 2 values in both, of 12 in the first and 2 in the second",
        "method: 1 value in both, of 2 in the first and 1 in the second",
    ]
    (delta,) = (d for d in found.quantities if d.name == "delta")
    assert delta.relative == 0.5
    assert delta.relative_at["design"] == "design 4"
    assert delta.relative_at["method"] == "newton"


def test_quantities_of_one_archive_only(archive: xr.Dataset) -> None:
    other = archive.drop_vars("imep").assign(more=archive["delta"])
    other["fmep"] = other["fmep"].assign_attrs(units="Pa")
    other["torque_max"] = other["torque_max"].isel(inertia=0) if (
        "inertia" in other["torque_max"].dims
    ) else other["torque_max"].expand_dims(inertia=other["inertia"])  # fmt: skip
    found = compare(archive, other)
    assert found.only_first == ["imep"]
    assert found.only_second == ["more"]
    assert "fmep: in bar and in Pa" in found.not_compared
    assert any(text.startswith("torque_max: over (") for text in found.not_compared)
    assert not found.within(1.0)
    text = comparison_text(found)
    assert "only in the first: imep" in text


def test_by_the_command(folder: Path) -> None:
    (folder / "other.toml").write_text(TO_JOIN.replace("stop = 9.0", "stop = 9.1"))
    run(folder / "other.toml", folder / "other.nc", overwrite=True)
    text = ok("compare", folder / "a.nc", folder / "other.nc")
    names = folder / "a.nc", folder / "other.nc"
    assert f"axes: inertia: 1 value in both, of 7 in {names[0]} and 7 in {names[1]}" in text
    assert (
        f"made in different ways: scene: [axes] inertia stop (in {names[0]} 9.0, in {names[1]} 9.1)"
        in text
    )
    told = invoke("compare", folder / "a.nc", folder / "other.nc", "--tolerance", "0.1")
    assert told.exit_code == 1
    assert "differ by more than 0.1" in told.stderr


def test_what_is_refused(folder: Path) -> None:
    (folder / "text.nc").write_text("text")
    assert "no such file" in refused("compare", folder / "none.nc", folder / "a.nc")
    assert "not a netCDF archive" in refused("compare", folder / "a.nc", folder / "text.nc")
    for wrong in ("-1", "nan", "much", "inf"):
        text = refused("compare", folder / "a.nc", folder / "a.nc", "--tolerance", wrong)
        assert "--tolerance" in text
