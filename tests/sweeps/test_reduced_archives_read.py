"""What reads archives reads those that hold reductions, as numbers of all designs say it."""

import csv
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from numpy.testing import assert_allclose, assert_array_equal

import sweeps
from sweeps.dimensions import STATE
from sweeps.exploring.compare import compare
from sweeps.figures.drawing import figures
from sweeps.reducing.statistics import MOST_BINS, Statistics
from tests.support.commands import ok, refused

pytestmark = pytest.mark.compiled

STORED: dict[str, Any] = {
    "engine": "ntua",
    "axes": {
        "inertia": np.linspace(0.2, 20.0, 23).tolist(),  # the lightest stall
        "load": [50.0, 90.0],
        "speed": [900.0, 1200.0, 1500.0],
        "crank_ratio": np.linspace(0.2, 0.3, 9).tolist(),
    },
    "output": {"quantities": ["delta", "omega_max", "torque_mean", "status"]},
}

ASKED: dict[str, Any] = {
    "over": ["inertia", "crank_ratio", "load"],
    "at_every": ["load", "speed"],
    "within": "delta <= 1/22",
    "best": [{"least": "inertia", "within": "delta <= 1/22", "number": 7}],
    "front": [{"of": ["inertia", "delta"]}],
}


@pytest.fixture(scope="module")
def stored() -> xr.Dataset:
    """All designs."""
    return sweeps.run(**STORED)


@pytest.fixture(scope="module")
def archive(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The same designs, reduced."""
    path = tmp_path_factory.mktemp("reduced") / "reduced.nc"
    sweeps.stream(**STORED, reduce=ASKED, archive=path)
    return path


@pytest.fixture(scope="module")
def nothing(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Designs of which a search keeps none."""
    path = tmp_path_factory.mktemp("nothing") / "nothing.nc"
    best = [{"least": "inertia", "within": "delta <= 1/500000"}]
    sweeps.stream(**STORED, reduce={"at_every": ["load", "speed"], "best": best}, archive=path)
    return path


def test_histograms_count_the_values_of_all_designs(stored: xr.Dataset, archive: Path) -> None:
    with sweeps.open(archive) as found:
        for name in ("delta", "omega_max", "torque_mean"):
            edges = np.append(found[f"{name}_bin_low"], found[f"{name}_bin_high"][-1])
            counts = found[f"{name}_histogram"].transpose("speed", ...).values
            assert 8 < counts.shape[1] <= MOST_BINS
            for here, speed in zip(counts, found.speed, strict=True):
                values = stored[name].sel(speed=speed).values
                values = values[np.isfinite(values)]
                assert_array_equal(here, np.histogram(values, edges)[0])


@pytest.mark.parametrize("spread", [1e-9, 1.0, 3.0, 40.0])
@pytest.mark.parametrize("middle", [-5.0, 0.0, 7.0, 1e6])
def test_histograms_of_any_numbers(middle: float, spread: float) -> None:
    values = middle + spread * np.random.default_rng(3).standard_normal((2, 4000))
    values = np.exp(values / 10.0) if middle == 7.0 else values  # over several octaves
    statistics = Statistics([2])
    statistics.add(values, [slice(0, 2)])
    edges, counts = statistics.histogram()
    assert counts.shape[1] <= MOST_BINS
    assert edges[0] <= values.min() < edges[1]
    assert edges[-2] <= values.max() < edges[-1]
    for row, here in zip(values, counts, strict=True):
        assert_array_equal(here, np.histogram(row, edges)[0])


def test_info_tells_of_all_designs(stored: xr.Dataset, archive: Path) -> None:
    text = ok("info", archive)
    codes, counts = np.unique(stored.status.values, return_counts=True)
    assert codes.tolist() == [0, 1], "some designs shall stall"
    assert f"{stored.status.size} designs reduced" in text
    assert f"\n  converged: {counts[0]}\n  stalled: {counts[1]}\n" in text
    within = int((stored.delta <= 1 / 22).sum())
    assert f"\n  delta <= 1/22: {within:,} of {stored.status.size:,}\n" in text
    fulfil = int((stored.delta <= 1 / 22).all(["load", "speed"]).sum())
    assert f"7 kept; {fulfil} of 207 designs fulfil delta <= 1/22 at every load and speed" in text
    means = stored.delta.mean(["inertia", "crank_ratio", "load"])
    row = next(line for line in text.splitlines() if line.startswith("  delta   "))
    low, high = (float(word) for word in row.split()[1:4:2])
    assert_allclose([low, high], [means.min(), means.max()], rtol=5e-4)
    assert STATE not in text and "state_byte" not in text and "status_mean" not in text


def test_show_and_export_have_a_row_for_each_kept_design(
    stored: xr.Dataset, archive: Path, tmp_path: Path
) -> None:
    table = tmp_path / "table.csv"
    ok("export", archive, "-o", table)
    with table.open() as file:
        rows = list(csv.DictReader(file))
    assert {"rank_1", "rank_2", "delta", "status"} <= set(rows[0])
    assert not [name for name in rows[0] if name.startswith(("delta_", STATE))]
    keys = ("inertia", "load", "speed", "crank_ratio")
    for row in rows:
        one = stored.sel({key: float(row[key]) for key in keys}, method="nearest")
        assert float(row["delta"]) == float(one.delta)
    best = sweeps.best(stored, least="inertia", within="delta <= 1/22", at_every=["load", "speed"])
    first = [float(row["inertia"]) for row in rows if row["rank_1"] == "1.0"]
    assert first == [float(best.inertia)] * 6
    shown = ok("show", archive, "--limit", "6")
    assert "rank_1 1" in shown and f"inertia {float(best.inertia):.2f}" in shown
    text = ok("show", archive, "--quantities", "delta_mean,delta_count")
    assert str(int(stored.delta.isel(speed=0).count())) in text
    refused("show", archive, "--quantities", STATE)


def test_without_kept_designs_statistics_are_shown(nothing: Path, tmp_path: Path) -> None:
    text = ok("show", nothing)
    assert "statistics over inertia, load, speed, crank_ratio" in text and "0 kept" in text
    assert "no design was kept" in refused("export", nothing, "-o", tmp_path / "table.csv")
    assert "no design meets all conditions" in ok("info", nothing)


def test_compare_passes_over_the_state(stored: xr.Dataset, archive: Path) -> None:
    in_memory = sweeps.run(**STORED, reduce=ASKED)
    with sweeps.open(archive) as found:
        assert STATE in in_memory and STATE not in found
        assert compare(in_memory, found).same


def test_figures_are_distributions_and_kept_designs(archive: Path, nothing: Path) -> None:
    with sweeps.open(archive) as found, sweeps.open(nothing) as empty:
        drawn, others = figures(found), figures(empty)
        shares = found.delta_histogram.isel(speed=1).values
    distributions = {f"distribution_{name}" for name in ("delta", "omega_max", "torque_mean")}
    assert distributions | {"pareto_inertia_delta"} <= set(drawn)
    assert set(others) == distributions
    assert not [stem for stem in drawn if "rank" in stem or "state" in stem or "quantile" in stem]
    panel = drawn["distribution_delta"].axes[1]
    heights, edges, _ = panel.patches[0].get_data()  # type: ignore[attr-defined]
    drawn_shares = heights * np.diff(np.log10(edges)) / 100.0  # bins of equal ratio, about
    assert_allclose(drawn_shares, shares / shares.sum(), rtol=1e-12)


def test_reports_tell_statistics_counts_and_searches(
    stored: xr.Dataset, archive: Path, nothing: Path, tmp_path: Path
) -> None:
    pytest.importorskip("bokeh")
    page = sweeps.report(archive, tmp_path / "report.html").read_text()
    counts = np.unique(stored.status.values, return_counts=True)[1]
    assert f'<td>stalled</td><td class="number">{counts[1]}</td>' in page
    for head in ("Statistics of all designs", "Designs within limits", "Searches"):
        assert f"<h3>{head}" in page
    within = int((stored.delta <= 1 / 22).sum())
    assert f'<td>delta &lt;= 1/22</td><td class="number">{within:,}</td>' in page
    other = sweeps.report(nothing, tmp_path / "nothing.html").read_text()
    assert "0 kept" in other and "<h3>Designs within limits" not in other
