"""[reduce]: what is asked of all designs, against archives of all these designs."""

import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from numpy.testing import assert_allclose, assert_array_equal

import sweeps
from sweeps.base.errors import SceneError
from sweeps.running.compute import limits, reduced
from sweeps.scene import sample
from sweeps.scene.plan.plan import make_plan
from sweeps.scene.reading import read_scene
from sweeps.scene.sample import Drawing, read_sample
from tests.support.archives import stop_after
from tests.support.commands import ok, refused
from tests.support.scenes import toml

pytestmark = pytest.mark.compiled

NUMBER = 2048

SAMPLE: dict[str, Any] = {
    "engine": "ntua",
    "set": {"load": 90, "speed": 1500},
    "sample": {
        "number": NUMBER,
        "inertia": {"low": 0.05, "high": 12.0},  # the lightest stall
        "crank_ratio": {"low": 0.2, "high": 0.3},
    },
    "output": {"quantities": ["delta", "omega_max", "torque_mean", "delta_error"]},
}

ASKED: dict[str, Any] = {
    "within": ["delta <= 1/20", "crank_ratio <= 0.25"],
    "best": [
        {"least": "inertia", "within": "delta <= 1/20", "number": 15},
        {"most": "omega_max", "number": 4},
    ],
    "front": [
        {"of": ["inertia", "delta"], "within": "crank_ratio <= 0.28"},
        {"of": ["inertia", "delta", "crank_ratio"], "most": "crank_ratio"},
    ],
}

GRID: dict[str, Any] = {
    "engine": "ntua",
    "axes": {
        "inertia": np.linspace(1.0, 20.0, 17).tolist(),
        "load": [50.0, 90.0],
        "speed": [900.0, 1200.0, 1500.0],
        "crank_ratio": np.linspace(0.2, 0.3, 9).tolist(),
    },
    "output": {"quantities": ["delta", "torque_mean"]},
}


@pytest.fixture
def portions(monkeypatch: pytest.MonkeyPatch) -> None:
    """Samples are drawn 256 designs at a time, and blocks are smaller still."""
    monkeypatch.setattr(sample, "PORTION", 256)
    monkeypatch.setattr(reduced, "LARGEST_BLOCK", 2e4)
    monkeypatch.setattr(limits, "LARGEST_BLOCK", 2e4)


@pytest.fixture(scope="module")
def whole() -> xr.Dataset:
    return sweeps.run(**SAMPLE)


def text_of(scene: dict[str, Any]) -> str:
    return "".join(f"{key} = {toml(value)}\n" for key, value in scene.items())


def same(one: xr.Dataset, two: xr.Dataset) -> None:
    """Check that all variables are the same to the bit."""
    assert set(one.variables) == set(two.variables)
    for name in one.variables:
        assert_array_equal(one[name].values, two[name].values, str(name))


def kept(archive: xr.Dataset, number: int) -> xr.Dataset:
    """Designs of one search in the order of their ranks."""
    rank = archive["rank"].values[number]
    places = np.flatnonzero(rank)
    return archive.isel(design=places[np.argsort(rank[places])])


@pytest.mark.usefixtures("portions")
def test_statistics_are_those_of_all_designs(whole: xr.Dataset) -> None:
    found = sweeps.run(**SAMPLE, reduce=ASKED)
    assert set(whole.status.values.tolist()) != {0}, "some designs shall fail"
    for name in SAMPLE["output"]["quantities"]:
        values = whole[name].values.astype(float)
        values = values[np.isfinite(values)]
        assert int(found[f"{name}_count"]) == values.size
        # NumPy's own sums are rounded; these are not.
        assert float(found[f"{name}_mean"]) == pytest.approx(values.mean(), rel=1e-14)
        assert float(found[f"{name}_deviation"]) == pytest.approx(values.std(), rel=1e-9, abs=1e-9)
        assert float(found[f"{name}_smallest"]) == values.min()
        assert float(found[f"{name}_largest"]) == values.max()
        exact = np.quantile(values, found["quantile"].values)
        away = np.abs(found[f"{name}_quantile"].values - exact)
        assert (away <= found[f"{name}_quantile_error"].values * (1 + 1e-12)).all()
        assert (found[f"{name}_quantile_error"].values <= 2.0**-9 * np.abs(exact)).all()
    codes, counts = np.unique(whole.status.values, return_counts=True)
    assert found.outcomes.values.tolist() == counts.tolist()
    assert len(found.outcome) == len(codes)
    light, low = whole.delta.values <= 1 / 20, whole.crank_ratio.values <= 0.25
    solved = np.isfinite(whole.delta.values)
    expected = [light.sum(), (low & solved).sum(), (light & low).sum()]
    assert found.designs_within.values.tolist() == expected


@pytest.mark.usefixtures("portions")
def test_kept_designs_are_the_best_of_all(whole: xr.Dataset) -> None:
    found = sweeps.run(**SAMPLE, reduce=ASKED)
    good = np.flatnonzero(whole.delta.values <= 1 / 20)
    expected = good[np.argsort(whole.inertia.values[good], kind="stable")][:15]
    assert kept(found, 0).design.values.tolist() == expected.tolist()
    for name in (*SAMPLE["output"]["quantities"], "inertia", "crank_ratio", "status"):
        assert_array_equal(kept(found, 0)[name], whole[name][expected])
    solved = np.flatnonzero(np.isfinite(whole.delta.values))
    fastest = solved[np.argsort(-whole.omega_max.values[solved], kind="stable")][:4]
    assert kept(found, 1).design.values.tolist() == fastest.tolist()
    front = sweeps.pareto(whole, "inertia", "delta", within="crank_ratio <= 0.28")
    assert_array_equal(kept(found, 2).delta, front.delta)
    three = sweeps.pareto(whole, "inertia", "delta", "crank_ratio", most="crank_ratio")
    assert_array_equal(kept(found, 3).inertia, three.inertia)


def test_the_same_bits_whatever_the_blocks(monkeypatch: pytest.MonkeyPatch) -> None:
    scene = {**SAMPLE, "sample": {**SAMPLE["sample"], "number": 512}, "reduce": ASKED}
    one = sweeps.run(**scene, threads=2)
    for portion, block in ((32, 2.5e3), (128, 1.5e4)):
        monkeypatch.setattr(sample, "PORTION", portion)
        monkeypatch.setattr(reduced, "LARGEST_BLOCK", block)
        assert len(make_plan(read_scene(**scene)).portions) == 512 // portion
        same(one, sweeps.run(**scene, threads=1))


@pytest.mark.usefixtures("portions")
@pytest.mark.parametrize("number", [1000, 257, 1023, 1800])
def test_every_design_of_any_number_counts(number: int) -> None:
    """Portions are equal parts of the sample, also where its number is no power of two."""
    drawing = {**SAMPLE["sample"], "number": number}
    scene = {**SAMPLE, "sample": drawing, "output": {"quantities": ["delta"]}}
    made = make_plan(read_scene(**scene, reduce={"best": [{"least": "inertia"}]}))
    assert made.designs == number
    found = sweeps.run(**scene, reduce={"within": "delta <= 1/20", "best": [{"least": "inertia"}]})
    stored = sweeps.run(**scene)
    assert int(found["outcomes"].sum()) == number
    assert found["designs_within"].values.sum() == (stored["delta"] <= 1 / 20).sum()


@pytest.mark.usefixtures("portions")
def test_a_number_without_parts_is_refused_with_one_near() -> None:
    prime = {**SAMPLE, "sample": {**SAMPLE["sample"], "number": 4093}}
    with pytest.raises(SceneError, match=r"number = 4093: must be a multiple .*, such as 409[0-9]"):
        read_scene(**prime, reduce={"best": [{"least": "inertia"}]})


@pytest.mark.usefixtures("portions")
def test_axes_may_be_left_or_looked_at_at_every_point() -> None:
    all_of_them = sweeps.run(**GRID)
    within = "delta <= 1/25"
    asked = {
        "over": ["inertia", "crank_ratio", "load"],
        "at_every": ["load", "speed"],
        "within": within,
        "best": [{"least": "inertia", "within": within, "number": 12}],
    }
    found = sweeps.run(**GRID, reduce=asked)
    over = ["inertia", "crank_ratio", "load"]
    assert found.delta_mean.dims == ("speed",)
    assert_allclose(found.delta_mean, all_of_them.delta.mean(over), rtol=1e-14)
    assert_array_equal(found.delta_largest, all_of_them.delta.max(over))
    below = (all_of_them.delta <= 1 / 25).sum(over)
    assert_array_equal(found.designs_within.values[:, 0], below)
    # A quantity that does not depend on the inertia has each of its values once.
    assert found.torque_mean_count.values.tolist() == [18, 18, 18]
    best = sweeps.best(all_of_them, least="inertia", within=within, at_every=["load", "speed"])
    one = sweeps.best(found, least="inertia", within=within, at_every=["speed", "load"])
    for name in ("delta", "inertia", "crank_ratio", "load", "speed"):
        values = one[name].transpose(*best[name].dims)
        assert_array_equal(values, best[name], name)
    good = (all_of_them.delta <= 1 / 25).all(["load", "speed"])
    assert f"{int(good.sum())} of 153 designs fulfil" in one.attrs["search"]
    # What was solved is told as designs, each at some points.
    said = "153 designs at 6 points each"
    assert make_plan(read_scene(**GRID, reduce=asked)).designs_text == said
    assert found.attrs["history"].endswith(f"computed {said}")


@pytest.fixture
def archive(portions: None, tmp_path: Path) -> Iterator[Path]:
    path = tmp_path / "reduced.nc"
    sweeps.stream(**SAMPLE, reduce=ASKED, archive=path)
    yield path


def loaded(path: Path) -> xr.Dataset:
    with sweeps.open_archive(path) as opened:
        return opened.load()


def test_an_archive_holds_what_run_returns(archive: Path) -> None:
    same(loaded(archive), sweeps.run(**SAMPLE, reduce=ASKED))


def test_a_killed_run_is_completed(archive: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = archive.with_name("killed.nc")
    with monkeypatch.context() as patch:
        stop_after(patch, 3, KeyboardInterrupt())
        with pytest.raises(Exception, match=r"3 of .* blocks are finished"):
            sweeps.stream(**SAMPLE, reduce=ASKED, archive=path)
    done = sweeps.stream(**SAMPLE, reduce=ASKED, archive=path, resume=True)
    assert done.before == 3
    assert done.outcomes == sweeps.stream(
        **SAMPLE, reduce=ASKED, archive=path, resume=True
    ).outcomes  # complete by now  # fmt: skip
    same(loaded(path), loaded(archive))


def searched(path: Path) -> list[int]:
    """Numbers of the text on each search: designs that fulfil, and designs of all."""
    texts = [kept["text"] for kept in json.loads(loaded(path).attrs["reduction"])["kept"]]
    found = [re.match(r"([\d,]+) of ([\d,]+) designs", text) for text in texts]
    assert found and all(found)
    return [int(n.replace(",", "")) for one in found if one for n in one.groups()]


def test_shards_merge_to_the_whole(archive: Path, tmp_path: Path) -> None:
    scene = tmp_path / "scene.json.toml"
    scene.write_text(text_of({**SAMPLE, "reduce": ASKED}))
    parts = [tmp_path / f"part{n}.nc" for n in (1, 2, 3)]
    for number, part in enumerate(parts, 1):
        ok("run", scene, "-o", part, "--shard", f"{number}/3", "-q")
    merged = tmp_path / "merged.nc"
    ok("merge", parts[1], parts[0], parts[2], "-o", merged)
    same(loaded(merged), loaded(archive))
    counts = [searched(part) for part in parts]
    assert [sum(numbers) for numbers in zip(*counts, strict=True)] == searched(archive)
    out = tmp_path / "no.nc"
    assert "shards are missing: 3/3" in refused("merge", parts[0], parts[1], "-o", out)
    assert "is given twice" in refused("merge", *parts, parts[0], "-o", out)
    assert "no shard of a scene with [reduce]" in refused("merge", archive, parts[0], "-o", out)
    again = tmp_path / "again.nc"
    ok("rerun", parts[1], "-o", again, "-q")
    same(loaded(again), loaded(parts[1]))
    assert not out.exists()


def test_a_front_and_stricter_limits_answer_best(tmp_path: Path) -> None:
    study = {**SAMPLE, "set": {"speed": 1500}, "axes": {"load": [50.0, 80.0]}}
    whole = sweeps.run(**study)
    asked = {"at_every": ["load"], "front": [{"of": ["inertia", "delta"]}],
             "best": [{"least": "inertia", "within": "delta <= 1/20", "number": 50}]}  # fmt: skip
    path = tmp_path / "reduced.nc"
    sweeps.stream(**study, reduce=asked, archive=path)
    found = loaded(path)
    delta = whole.delta.max("load", skipna=False).values
    for limit in (0.02, float(np.sort(delta)[3])):
        one = sweeps.best(found, least="inertia", within=f"delta <= {limit}", at_every="load")
        assert float(one.inertia) == whole.inertia.values[delta <= limit].min()
    one = sweeps.best(found, least="delta", at_every="load")  # An end of the front
    assert float(one.delta.max()) == np.nanmin(delta)
    with pytest.raises(SceneError, match=r"holds .* for 0 .*kept all designs of the front"):
        sweeps.best(found, least="inertia", within="delta <= 1e-6", at_every="load")
    with pytest.raises(SceneError, match="at_every load"):
        sweeps.best(found, least="inertia", within="delta <= 0.02")
    with pytest.raises(SceneError, match="another search needs a run"):
        sweeps.best(found, least="inertia", within="delta >= 0.02", at_every="load")


def test_what_an_archive_cannot_answer_is_said(archive: Path) -> None:
    found = loaded(archive)
    with pytest.raises(SceneError, match="kept the 15 best by least inertia within delta <= 1/20"):
        sweeps.best(found, least="torque_mean")
    with pytest.raises(SceneError, match="kept the 15 best"):
        sweeps.best(found, least="inertia", within="delta >= 1/20")
    with pytest.raises(SceneError, match="another search needs a run"):
        sweeps.pareto(found, "inertia", "delta")
    with pytest.raises(SceneError, match=r"that \[reduce\] kept, and not all"):
        sweeps.best(found, least="inertia", within=["delta <= 1/20", "torque_mean >= 1e6"])
    stricter = kept(found, 0).crank_ratio.values.min() * (1 + 1e-9)
    one = sweeps.best(
        found, least="inertia", within=["delta <= 0.05", f"crank_ratio <= {stricter}"]
    )
    assert float(one.inertia) in kept(found, 0).inertia.values
    assert "has not the values" in refused("extend", archive, "--number", str(2 * NUMBER))
    with pytest.raises(SceneError, match="merge"):
        sweeps.open([archive, archive])


@pytest.mark.parametrize("method", ["sobol", "saltelli"])
def test_portions_are_those_of_the_whole_sample(method: str) -> None:
    table = {"method": method, "number": 64, "seed": 5, "inertia": {"low": 1.0, "high": 2.0},
             "bore": {"low": 0.1, "high": 0.2}, "cylinders": {"low": 1, "high": 8}}  # fmt: skip
    asked = read_sample(table, "sample")
    all_of_it = Drawing(asked).columns(0, 64)
    drawing = Drawing(asked)
    for begin, count in ((0, 16), (32, 32), (16, 16)):  # in order, skipped, backwards
        part = drawing.columns(begin, count)
        for key, values in part.items():
            expected = all_of_it[key][begin * asked.group : (begin + count) * asked.group]
            assert_array_equal(values, expected)


@pytest.mark.parametrize(
    ("asked", "said"),
    [
        ({"over": "bore"}, "over: 'bore': not in the scene. Allowed: design"),
        ({"statistics": ["delat"]}, "statistics: 'delat': not in the scene"),
        ({"quantiles": [0.5, 1.5]}, "quantiles = 1.5: must be between 0 and 1"),
        ({"best": [{}]}, "best 1: needs least or most"),
        ({"best": [{"least": "delta", "most": "delta"}]}, "least and most are both given"),
        ({"best": [{"least": "omega"}]}, "best 1: 'omega': not in the scene"),
        ({"best": [{"least": "delta", "number": 0}]}, "number = 0"),
        ({"front": [{"of": ["delta"]}]}, "must be a list of two or three"),
        ({"front": [{"of": ["delta", "delta"]}]}, "names must differ"),
        ({"best": [{"least": "delta", "within": "delta < few"}]}, "delta"),
        ({"within": "omega <= 3"}, "scene: [reduce]: 'omega': not in the archive"),
        ({"best": 3}, "best = 3: must be a list of tables [[reduce.best]]"),
        ({"at_every": "speed"}, "at_every: 'speed': not in the scene"),
        ({"over": "inertia"}, "'inertia': is given by [sample]; use 'design'"),
        ({"best": [{"least": "delta", "not_counted": "stalled"}]}, "only used with at_every"),
        ({"bset": []}, "bset: unknown key"),
        ({"over": [], "best": [{"least": "delta"}]}, "over: leaves design, 2048 points"),
    ],
)
def test_bad_input_is_told_in_one_line(asked: dict[str, Any], said: str) -> None:
    with pytest.raises(SceneError) as told:
        sweeps.run(**SAMPLE, reduce=asked)
    assert said in str(told.value)
    assert "\n" not in str(told.value)


@pytest.mark.parametrize(
    ("more", "said"),
    [
        ({"output": {"quantities": ["torque"]}}, "torque varies over crank_angle"),
        ({"uncertainty": {"number": 8, "bore": {"low": 0.13, "high": 0.14}}}, "[uncertainty]"),
        ({"engine": ["ntua", "si_four_87x101"]}, "several engines"),
    ],
)
def test_what_has_more_than_one_number_a_design_is_refused(more: dict[str, Any], said: str) -> None:
    with pytest.raises(SceneError) as told:
        sweeps.run(**{**SAMPLE, **more}, reduce={})
    assert said in str(told.value)
