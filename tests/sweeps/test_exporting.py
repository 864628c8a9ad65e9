"""Tables of archives, and two archives against each other."""

import sys
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pyarrow.parquet as pq
import pytest
import xarray as xr
from numpy.testing import assert_allclose, assert_array_equal

import sweeps
from sweeps.base.errors import SceneError
from sweeps.decide.explore import compare as comparing
from sweeps.decide.explore import export
from sweeps.decide.explore.compare import compare
from sweeps.view.texts.comparison import comparison_text
from tests.support.archives import run
from tests.support.commands import invoke, ok, refused
from tests.support.scenes import DESIGN_TABLE, TO_JOIN, asking

pytestmark = pytest.mark.compiled

KINDS = ("csv", "parquet")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("exporting")
    (folder / "scene.toml").write_text(TO_JOIN)
    run(folder / "scene.toml", folder / "a.nc")
    return folder


@pytest.fixture
def archive(folder: Path) -> Any:
    with sweeps.open(folder / "a.nc") as opened:
        yield opened


def read(path: Path) -> pd.DataFrame:
    if path.suffix == ".csv":
        return pd.read_csv(path, engine="python")  # which reads every digit
    return pq.read_table(path).to_pandas()


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("rows", [1, 5, 1 << 18])
def test_a_table_has_the_numbers_of_the_archive(
    kind: str, rows: int, archive: xr.Dataset, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(export, "ROWS", rows)
    exact: Any = {"digits": "all"} if kind == "csv" else {}
    done = sweeps.export(archive, tmp_path / f"t.{kind}", **exact)
    table = read(tmp_path / f"t.{kind}")
    assert done.rows == len(table) == 28
    assert done.left_out == ("load_torque",)
    assert tuple(table.columns) == done.columns
    values = archive.drop_vars(["load_torque", "crank_angle"]).to_dataframe(["speed", "inertia"])
    expected = values.reset_index()
    for name in table.columns:
        if name != "status":
            assert_array_equal(table[name], expected[name])
    assert set(table["status"]) == {"converged"}
    if kind == "parquet":
        schema = pq.read_schema(tmp_path / "t.parquet")
        assert schema.field("imep").metadata[b"units"] == b"bar"
        assert schema.field("speed").metadata[b"units"] == b"rpm"


@pytest.mark.parametrize("kind", KINDS)
def test_curves_words_and_columns_of_designs(kind: str, tmp_path: Path) -> None:
    archive = sweeps.run(DESIGN_TABLE)
    archive["delta"].values[0] = np.nan
    path = tmp_path / f"t.{kind}"
    exact: Any = {"digits": "all"} if kind == "csv" else {}
    done = sweeps.export(archive, path, **exact)
    table = read(path)
    assert list(table.columns[:3]) == [d for d in archive["delta"].dims]
    assert {"case", "stroke", "cylinders", "delta", "imep", "status"} <= set(table.columns)
    assert "torque_after_throw" in done.left_out
    assert len(table) == archive["delta"].size
    for _, row in table.iloc[[0, 17, 40, -1]].iterrows():
        one = sweeps.nearest(archive, case=row["case"], load=row["load"], method=row["method"])
        for name in ("delta", "imep", "stroke", "cylinders"):
            assert_array_equal(row[name], float(one[name]))
    assert table["delta"].isna().sum() == int(archive["delta"].isnull().sum()) > 6
    done = sweeps.export(archive, path, quantities=["torque_after_throw", "imep"], overwrite=True)
    table = read(path)
    assert len(table) == done.rows == xr.broadcast(
        archive["torque_after_throw"], archive["imep"]
    )[0].size  # fmt: skip
    assert {"crank_angle", "case", "imep"} <= set(table.columns)
    assert "delta" not in table.columns
    assert done.left_out == ()
    # The word of an axis that was cut is there too.
    cut = sweeps.nearest(archive, method="newton")
    sweeps.export(cut, path, quantities="delta", overwrite=True)
    table = read(path)
    assert set(table["method"]) == {"newton"} and "method_name" not in table.columns


@pytest.mark.parametrize("kind", KINDS)
def test_a_failure_leaves_nothing(
    kind: str, archive: xr.Dataset, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / f"t.{kind}"
    path.write_text("old")
    monkeypatch.setattr(export, "ROWS", 5)
    ranges, count = export.ranges, 0

    def failing(*arguments: Any, **options: Any) -> Any:
        nonlocal count
        for item in ranges(*arguments, **options):
            count += 1
            if count == 3:
                raise OSError(28, "No space left on device")
            yield item

    monkeypatch.setattr(export, "ranges", failing)
    with pytest.raises(OSError, match="No space"):
        sweeps.export(archive, path, overwrite=True)
    assert path.read_text() == "old"
    assert [p.name for p in tmp_path.iterdir()] == [path.name]


def test_by_the_command_whole_or_a_slice(
    folder: Path, archive: xr.Dataset, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)  # Only folders below the current one are created
    path, source = tmp_path / "deep" / "t.csv", folder / "a.nc"
    assert "28 rows, 7 columns" in ok("export", source, "-o", path)
    assert path.read_text(encoding="utf-8").startswith("speed,inertia,")
    ok("export", source, "-o", tmp_path / "c.parquet", "--quantities", "load_torque, imep")
    assert len(read(tmp_path / "c.parquet")) > 28
    first = float(archive.speed[0])
    chosen = ("--select", f"speed={first}", "--units", "speed=rad/s", "--overwrite",
              "--digits", "all")  # fmt: skip
    ok("export", source, "-o", path, *chosen)
    table, part = read(path), archive.isel(speed=0)
    assert_array_equal(table["delta"], part.delta)
    assert_allclose(table["speed"], first * np.pi / 30.0)
    told = invoke("export", source, "-o", path, "--select", "speed=1501", "--overwrite")
    assert "speed = 1501 rpm is not in the archive; the nearest value, 1500 rpm" in told.stderr
    outside = ("--select", "speed=9", "--overwrite")
    assert "speed = 9 rpm: outside the axis" in refused("export", source, "-o", path, *outside)


def test_an_exported_table_of_axes_is_a_table_of_designs(folder: Path, tmp_path: Path) -> None:
    with sweeps.open(folder / "a.nc") as opened:
        sweeps.export(opened, tmp_path / "t.csv", quantities="delta")
    table = read(tmp_path / "t.csv")
    table[["speed", "inertia"]].to_csv(tmp_path / "designs.csv", index=False)
    scene = asking(["delta"], designs={"file": str(tmp_path / "designs.csv")})
    assert_allclose(sweeps.run(scene)["delta"], table["delta"], rtol=1e-6)


def test_what_is_refused(
    folder: Path, tmp_path: Path, archive: xr.Dataset, monkeypatch: pytest.MonkeyPatch
) -> None:
    source = folder / "a.nc"
    (tmp_path / "there.csv").write_text("old")
    for arguments, told in (
        (("-o", tmp_path / "t.ods"), "must end in .csv or .parquet"),
        (("-o", tmp_path / "there.csv"), "exists"),
        (("-o", tmp_path), "must end in"),
        (("-o", tmp_path / "t.csv", "--quantities", "dleta"), "did you mean 'delta'"),
        (("-o", tmp_path / "t.csv", "--quantities", "delta,delta"), "twice"),
        (("-o", tmp_path / "t.csv", "--quantities", ""), "not a quantity"),
    ):
        assert told in refused("export", source, *arguments)
    assert "no such file" in refused("export", tmp_path / "no.nc", "-o", tmp_path / "t.csv")
    assert not (tmp_path / "t.csv").exists()
    with pytest.raises(SceneError, match="no quantity has one number per design"):
        sweeps.export(archive[["load_torque"]], tmp_path / "t.csv")
    monkeypatch.setitem(sys.modules, "pyarrow.parquet", None)
    text = refused("export", source, "-o", tmp_path / "t.parquet")
    assert "pip install 'engine-dyn[parquet]'" in text


def test_an_excel_file_has_units_and_what_was_assumed(archive: xr.Dataset, tmp_path: Path) -> None:
    done = sweeps.export(archive, tmp_path / "results.xlsx")
    sheets = pd.read_excel(tmp_path / "results.xlsx", sheet_name=None, header=None)
    assert list(sheets) == ["results", "axes", "assumptions", "parameters", "provenance"]
    results = sheets["results"]
    assert tuple(results.iloc[0]) == done.columns and len(results) == done.rows + 2
    units = dict(zip(results.iloc[0], results.iloc[1], strict=True))
    sweeps.export(archive, tmp_path / "results.csv")
    table = pd.read_csv(tmp_path / "results.csv")
    for place, name in enumerate(done.columns):
        cells = results[place].iloc[2:].reset_index(drop=True)
        if name in archive and archive[name].dtype.kind == "f":
            assert units[name] == archive[name].attrs["units"] or archive[name].units == "1"
            assert_allclose(cells.to_numpy(float), table[name], rtol=1e-6)
        else:
            assert (cells.astype(str) == table[name].astype(str)).all()
    assert "load_offset" in set(sheets["assumptions"][0])
    assert "history" in set(sheets["provenance"][0])


def test_texts_of_an_excel_file_are_not_computed_and_more_rows_than_it_has_refused(
    archive: xr.Dataset, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from openpyxl import load_workbook

    from sweeps.decide.explore import export as exporting

    data = archive.assign_attrs(title='=HYPERLINK("http://localhost")')
    sweeps.export(data, tmp_path / "results.xlsx")
    book = load_workbook(tmp_path / "results.xlsx")
    cells = [cell for sheet in book for row in sheet.iter_rows() for cell in row]
    assert not any(cell.data_type == "f" for cell in cells)
    monkeypatch.setattr(exporting, "MOST_ROWS", 5)
    with pytest.raises(SceneError, match=r"rows; a sheet of Excel has room for 3"):
        sweeps.export(archive, tmp_path / "more.xlsx")
    assert [path.name for path in tmp_path.iterdir()] == ["results.xlsx"]


@pytest.fixture
def whole(folder: Path) -> xr.Dataset:
    with sweeps.open(folder / "a.nc") as opened:
        return opened.load()


def test_the_largest_difference_and_where(
    whole: xr.Dataset, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(comparing.ranges, "__defaults__", (24.0,))  # three values at a time
    other = whole.copy(deep=True)
    delta = other["delta"].values
    delta[1, 2] *= 1.001
    delta[3, 0] *= 0.99
    delta[0, 4] = np.nan
    imep = other["imep"].values
    imep += 0.25
    found = {d.name: d for d in compare(whole, other).quantities}
    first = whole["delta"].values
    assert found["delta"].count == 28
    assert found["delta"].differing == 3
    assert found["delta"].only_one == 1
    inertia = whole["inertia"].values
    assert found["delta"].only_at == {"speed": 1000.0, "inertia": inertia[4]}
    assert found["delta"].relative == pytest.approx(0.01, rel=1e-9)
    assert found["delta"].relative_at == {"speed": 1600.0, "inertia": inertia[0]}
    assert found["delta"].relative_pair == (first[3, 0], delta[3, 0])
    gap = np.abs(delta - first)
    assert found["delta"].largest == np.nanmax(gap)
    at = np.unravel_index(np.nanargmax(gap), gap.shape)
    assert list(found["delta"].largest_at.values()) == [
        whole["speed"].values[at[0]], inertia[at[1]],
    ]  # fmt: skip
    assert found["imep"].largest == pytest.approx(0.25, rel=1e-12)
    assert found["fmep"].differing == 0
    assert not compare(whole, other).same
    text = comparison_text(compare(whole, other))
    assert "3 of 28 values differ" in text
    assert "largest relative difference 0.01: " in text
    assert "at speed=1600, inertia=1.5" in text
    assert "1 with a number in only one archive, first at speed=1000, inertia=" in text
