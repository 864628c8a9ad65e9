"""Archives of samples: sharded, resumed and extended ones are those of one whole run to the bit."""

from pathlib import Path
from typing import Any

import pytest
from numpy.testing import assert_allclose

import sweeps
from sweeps.running.archive.netcdf import open_archive
from sweeps.running.compute import into_archive, limits
from sweeps.running.compute.options import Options, Stopped
from sweeps.running.join.extend import extend_sample
from sweeps.running.join.merge import merge
from sweeps.scene.plan.plan import make_plan
from sweeps.scene.reading import read_scene
from tests.support.archives import assert_same, interrupted, run, shards, stop_after
from tests.support.commands import invoke, ok, refused

pytestmark = pytest.mark.compiled

SAMPLE: dict[str, Any] = {
    "method": "sobol",
    "number": 256,
    "seed": 7,
    "inertia": {"low": 1.0, "high": 12.0, "spacing": "log"},
    "reciprocating_mass": {"mean": 6.67, "deviation": 0.3, "low": 5.0, "high": 8.0},
    "rod_length": {"low": 0.3, "mode": 0.35, "high": 0.45},
    "cylinders": [1, 2, 4, 6],
}


def scene(**sample: Any) -> dict[str, Any]:
    return {
        "engine": "ntua",
        "sample": {**SAMPLE, **sample},
        "axes": {"speed": [1200.0, 1500.0]},
        "output": {"quantities": ["delta", "omega_max", "torque_mean"]},
    }


def words() -> dict[str, Any]:
    """Words and numbers together: each arrangement is an ordinary scene of its own."""
    return {
        "engine": "si_four_87x101",
        "set": {"speed": 3000.0},
        "sample": {
            "number": 16,
            "seed": 3,
            "inertia": {"low": 0.2, "high": 0.4},
            "arrangement": ["in-line 4", "V6 60 split-pin 1-4-3-6-2-5", "in-line 6"],
        },
        "axes": {"load": [50.0, 100.0]},
        "output": {"quantities": ["delta", "brake_power"]},
    }


@pytest.fixture(autouse=True)
def _small_blocks(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(limits, "LARGEST_BLOCK", 4e4)


@pytest.mark.parametrize("method", ["sobol", "saltelli"])
@pytest.mark.parametrize("few", [2, 32])
def test_an_extended_sample_is_the_whole_one(method: str, few: int, tmp_path: Path) -> None:
    whole, grown = tmp_path / "whole.nc", tmp_path / "grown.nc"
    run(scene(method=method), whole)
    run(scene(method=method, number=few), grown)
    extend_sample(grown, 64, Options())
    extend_sample(grown, 256, Options())
    assert_same(grown, open_archive(whole).load())


def test_shards_and_resumed_runs_are_the_whole_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole = tmp_path / "whole.nc"
    run(scene(), whole)
    expected = open_archive(whole).load()
    merge(shards(scene(), 3, tmp_path), tmp_path / "merged.nc", Options())
    assert_same(tmp_path / "merged.nc", expected)

    plan = make_plan(read_scene(scene()))
    resumed = tmp_path / "resumed.nc"
    interrupted(plan, resumed, monkeypatch)
    into_archive.run(plan, resumed, Options(resume=True))
    assert_same(resumed, expected)


def test_an_interrupted_extension_goes_on(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    whole, grown = tmp_path / "whole.nc", tmp_path / "grown.nc"
    run(scene(), whole)
    run(scene(number=16), grown)
    before = grown.read_bytes()
    with monkeypatch.context() as patch:
        stop_after(patch, 2, KeyboardInterrupt())
        with pytest.raises(Stopped, match="is unchanged"):
            extend_sample(grown, 256, Options(resume_command="engine-dyn extend"))
    assert grown.read_bytes() == before
    extend_sample(grown, 256, Options())
    assert_same(grown, open_archive(whole).load())


def test_an_extension_that_would_draw_other_values_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from sweeps.scene import sample

    path = tmp_path / "sample.nc"
    run(scene(number=16), path)
    positions = sample.Drawing._positions
    monkeypatch.setattr(sample.Drawing, "_positions", lambda *of: 1.0 - positions(*of))
    assert "draws different values of inertia" in refused("extend", path, "--number", "32")
    monkeypatch.undo()
    assert invoke("extend", path, "--number", "32", "-q").exit_code == 0


@pytest.mark.parametrize(
    ("number", "method", "expected"),
    [
        ("16", "sobol", "--number 16: must be above 16, which the archive has"),
        ("24", "saltelli", "number = 24: must be a power of two"),
        ("32", "latin_hypercube", "--number 32: a Latin hypercube cannot be extended"),
    ],
)
def test_extensions_that_are_refused(
    number: str, method: str, expected: str, tmp_path: Path
) -> None:
    path = tmp_path / "sample.nc"
    run(scene(number=16, method=method), path)
    before = path.read_bytes()
    assert expected in refused("extend", path, "--number", number)
    assert path.read_bytes() == before
    assert [p.name for p in tmp_path.iterdir()] == ["sample.nc"]


def test_words_are_drawn_as_designs_that_are_given(tmp_path: Path) -> None:
    path, again, raw = tmp_path / "words.nc", tmp_path / "again.nc", words()
    run(raw, path)
    drawn = sweeps.sample(
        {key: raw["sample"][key] for key in ("inertia", "arrangement")}, 16, seed=3
    )
    assert drawn["arrangement"].nunique() == 3
    given = {key: value for key, value in raw.items() if key != "sample"}
    expected = sweeps.run(given, designs=drawn)
    with open_archive(path) as archive:
        assert archive.arrangement.values.tolist() == drawn["arrangement"].tolist()
        for name in ("delta", "brake_power"):
            assert archive[name].dims == ("design", "load")
            assert_allclose(
                archive[name].values, expected[name].transpose("design", "load").values, rtol=1e-12
            )
    ok("rerun", path, "-o", again)
    assert_same(again, open_archive(path).load())
