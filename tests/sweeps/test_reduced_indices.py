"""What reads reduced archives, and Sobol' indices that are summed as designs are computed."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from numpy.testing import assert_array_equal
from SALib.analyze import sobol
from SALib.test_functions import Ishigami

import sweeps
from engine_dyn.status import WITH_NUMBERS
from engine_dyn.types import Floats
from sweeps.running.compute.reduced import Units
from sweeps.running.reduce.indices import Indices
from sweeps.running.reduce.statistics import MOST_BINS, Statistics
from sweeps.scene.distributions import Uniform
from sweeps.scene.plan.blocks import lengths_within
from sweeps.scene.plan.plan import Plan, make_plan
from sweeps.scene.plan.shards import shard
from sweeps.scene.reading import read_scene
from sweeps.scene.sample import Sample, drawn
from tests.support.scenes import asking, computed

pytestmark = pytest.mark.compiled

KEYS = ("inertia", "reciprocating_mass", "speed")

SAMPLE: dict[str, Any] = {
    "method": "saltelli", "number": 256, "seed": 3, "inertia": {"low": 2.0, "high": 12.0},
    "reciprocating_mass": {"low": 4.0, "high": 9.0}, "speed": {"low": 1000.0, "high": 1500.0},
}  # fmt: skip

BESIDE: dict[str, Any] = {"sample": SAMPLE, "axes": {"load": [40.0, 90.0]}}


def ishigami(number: int, seed: int) -> tuple[Sample, Floats]:
    """A sample, and Ishigami's function of its designs."""
    sample = Sample("saltelli", number, seed, dict.fromkeys(KEYS, Uniform(-np.pi, np.pi)))
    columns = drawn(sample)
    return sample, Ishigami.evaluate(np.column_stack([columns[key] for key in KEYS]))


def indices_of(sample: Sample, values: Floats) -> Indices:
    found = Indices(sample, ())
    found.add(values, (), 0)
    return found


def by_salib(values: Floats, many: int) -> Floats:
    problem = {"num_vars": many, "names": [*map(str, range(many))], "bounds": [[0, 1]] * many}
    found = sobol.analyze(problem, values, calc_second_order=False, seed=1)
    return np.array([found["S1"], found["ST"]])


def kept(archive: xr.Dataset, name: str, group: int) -> Floats:
    """Values of the groups in which every design has a number."""
    good = np.isin(archive.status.values, WITH_NUMBERS).reshape(-1, group).all(axis=1)
    return np.asarray(archive[name].values.reshape(-1, group)[good].reshape(-1))


@pytest.mark.parametrize("order", [["sample", "axes"], ["axes", "sample"]])
def test_as_of_the_stored_designs(order: list[str]) -> None:
    tables = {name: BESIDE[name] for name in order}
    quantities = ["delta", "omega_max", "bmep"]
    stored = sweeps.sensitivities(computed(quantities, **tables))
    reduced = computed(quantities, **tables, reduce={"over": "design"})
    found = sweeps.sensitivities(reduced)
    assert {*found.data_vars} <= {*stored.data_vars}
    names = [n for n in stored.data_vars if str(n).endswith(("_first", "_total", "_left_out"))]
    assert len(names) == 9 and "load" in found.delta_first.dims
    for name in names:
        assert found[name].dims == stored[name].dims
        assert np.abs(found[name].values - stored[name].values).max() < 1e-9
        assert found[name].attrs == stored[name].attrs
        assert np.array_equal(found[name].values, reduced[name].values)
    for name in ("parameter", "parameter_long_name"):
        assert np.array_equal(found[name].values, stored[name].values)
    assert len(sweeps.sensitivities(reduced, "bmep").data_vars) == 5


@pytest.mark.parametrize(("low", "ending"), [(0.5, ""), (0.2, "_conditional")])
@pytest.mark.filterwarnings("ignore::engine_dyn.ImplausibleWarning")
def test_groups_with_failed_designs_are_left_out(low: float, ending: str) -> None:
    sample = {
        "method": "saltelli", "number": 1024, "seed": 3,
        "inertia": {"low": low, "high": 6.0}, "speed": {"low": 700.0, "high": 1500.0},
    }  # fmt: skip
    tables: dict[str, Any] = {"sample": sample, "set": {"load": 90.0, "load_exponent": 0.5}}
    # A mean torque is known even where the engine stalls.
    stored = computed(["delta", "torque_mean"], **tables)
    reduced = computed(["delta", "torque_mean"], **tables, reduce={})
    assert np.isfinite(stored.torque_mean).all()
    failed = ~np.isin(stored.status.values, WITH_NUMBERS)
    groups = failed.reshape(-1, 4).any(axis=1).sum()
    assert (failed.mean() > 0.01) == bool(ending) and 10 < groups < failed.sum()
    found = sweeps.sensitivities(reduced)
    for name in ("delta", "torque_mean"):
        assert found[f"{name}_left_out"] == failed.sum()
        assert reduced[f"{name}_groups_left_out"] == groups
        expected = by_salib(kept(stored, name, 4), 2)
        for key, one in zip(("first", "total"), expected, strict=True):
            assert np.abs(found[f"{name}_{key}{ending}"].values - one).max() < 1e-9


def plan_of(**tables: Any) -> Plan:
    return make_plan(read_scene(asking(["delta"], **tables, reduce={"over": "design"})))


def test_the_same_bits_whatever_the_portions_units_and_shards(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    plan = plan_of(**BESIDE)

    def states(plan: Plan, limit: float) -> list[Any]:
        units = Units(plan, lengths_within(plan, limit))
        return [state for _, state in units.states([*range(len(units))])]

    (whole,) = states(plan, 1e9)
    shards = [shard(plan, n, 3) for n in (1, 2, 3)]
    assert all(one.sizes["design"] % 5 == 0 for one in shards)
    monkeypatch.setattr("sweeps.scene.sample.PORTION", 320)
    portions = plan_of(**BESIDE)
    assert len(portions.portions) == 4
    monkeypatch.setattr("sweeps.running.compute.reduced.MOST_UNITS", 7)
    for parts in (states(plan, 3e4), [s for one in shards for s in states(one, 3e4)],
                  states(portions, 1e9), states(portions, 3e4)):  # fmt: skip
        assert len(parts) > 3
        found = Units(plan, {}).empty()
        for part in parts:
            found.merge(part)
        alike = {key: one for key, one in found.state().items() if key.startswith("indices")}
        assert len(alike) == 5
        assert all(np.array_equal(one, whole[key]) for key, one in alike.items())


def test_known_indices_are_within_their_intervals() -> None:
    # Saltelli et al. 2000, with a = 7, b = 0.1.
    a, b, pi = 7.0, 0.1, np.pi
    one, two = 0.5 * (1 + b * pi**4 / 5) ** 2, a**2 / 8
    both = b**2 * pi**8 * (1 / 18 - 1 / 50)
    exact = np.array([[one, two, 0.0], [one + both, two, both]]) / (one + two + both)
    inside = []
    for seed in range(1, 41):
        sample, values = ishigami(2048, seed)
        found = indices_of(sample, values).results()
        error = np.abs(np.array([found["first"], found["total"]]) - exact)
        assert error.max() < 0.1
        assert np.abs(np.array([found["first"], found["total"]]) - by_salib(values, 3)).max() < 1e-9
        half = np.array([found["first_confidence"], found["total_confidence"]])
        assert half.max() < 0.2
        inside.append(error < half)
    # 95 % intervals; batches of a Sobol' sequence differ more than independent samples would say.
    assert np.mean(inside) > 0.9


def test_what_does_not_vary_and_what_varies_little() -> None:
    sample, values = ishigami(64, 1)
    for key, found in indices_of(sample, np.full_like(values, 0.1)).results().items():
        assert np.array_equal(found, np.zeros(3)), key
    assert all(np.isnan(v).all() for v in Indices(sample, ()).results().values())
    # The spacing of numbers around 2^30 is 2e-7 of the deviation here.
    far = indices_of(sample, values + 2.0**30).results()
    assert np.abs(far["total"] - by_salib(values, 3)[1]).max() < 1e-6


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
    return sweeps.run(**STORED)


@pytest.fixture(scope="module")
def archive(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("reduced") / "reduced.nc"
    sweeps.stream(**STORED, reduce=ASKED, archive=path)
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
