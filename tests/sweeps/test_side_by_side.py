"""Several engines or arrangements in one scene: the numbers of each alone, in one archive."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from numpy.testing import assert_array_equal

import sweeps
from sweeps.catalogue import ENGINES
from sweeps.running.compute import into_archive, limits
from sweeps.running.compute.options import Options
from sweeps.scene.model import SeveralEngines
from sweeps.scene.plan.forecast import text
from sweeps.scene.plan.plan import make_plan
from sweeps.scene.reading import read_scene
from tests.support.archives import assert_same, assert_same_in_parts, interrupted
from tests.support.commands import ok, refused
from tests.support.scenes import refusal, write_scene

pytestmark = pytest.mark.compiled

V6 = "V6 60 split-pin 1-4-3-6-2-5"
OUTPUT = {
    "quantities": ["delta", "brake_power", "torque_order", "main_journal_load_max", "omega"],
    "angle_step": 30,
    "highest_order": 3,
}
ENGINES_BESIDE: dict[str, Any] = {
    "axes": {"speed": [1300, 1500], "engine": ["ntua", "v6_96x81", "marine_80x345"],
        "inertia": [0.5, 2.0, 5.0]},
    "set": {"load": 50},
    "silenced_warnings": ["all"],
    "output": OUTPUT,
}  # fmt: skip
"""A one-cylinder engine, a six-cylinder engine, and a two-stroke engine of seven cylinders."""

TABLE: dict[str, Any] = {
    "designs": {"case": ["A", "B", "C", "D"], "engine": ["ntua", "v6_96x81", "ntua", "v6_96x81"],
        "arrangement": ["in-line 1", V6, "in-line 2", "in-line 6"],
        "inertia": [5.0, 0.3, 10.0, 0.5]},
    "axes": {"load": [50, 80]},
    "output": OUTPUT,
}  # fmt: skip


def alone(raw: dict[str, Any], engine: str, **settings: Any) -> xr.Dataset:
    axes = {k: v for k, v in raw["axes"].items() if k not in ("engine", "arrangement")}
    given = {**raw.get("set", {}), **settings}
    return sweeps.run({**raw, "engine": engine, "axes": axes, "set": given})


def assert_numbers(found: xr.Dataset, expected: xr.Dataset) -> None:
    """The same bits at the points of one engine, and nothing at those of others."""
    for name, own in expected.data_vars.items():
        values = found[name]
        for dimension in own.dims:
            inside = np.isin(values[dimension].values, own[dimension].values)
            assert inside.sum() == own.sizes[dimension]
            if not inside.all():
                assert np.isnan(values.isel({dimension: ~inside}).values).all(), name
                values = values.isel({dimension: inside})
        for dimension in values.dims:
            if dimension not in own.dims:
                own = own.expand_dims({dimension: values.sizes[dimension]})
        own = own.transpose(*values.dims)
        assert values.dtype == own.dtype
        assert_array_equal(values.values, own.values, err_msg=str(name))


@pytest.fixture(scope="module")
def engines() -> xr.Dataset:
    return sweeps.run(ENGINES_BESIDE)


def test_numbers_are_those_of_each_engine_alone(engines):
    assert engines["delta"].dims == ("speed", "engine", "inertia")
    assert engines["engine_name"].values.tolist() == ENGINES_BESIDE["axes"]["engine"]
    assert engines.sizes["main_bearing"] == 8
    for number, engine in enumerate(ENGINES_BESIDE["axes"]["engine"]):
        assert_numbers(engines.isel(engine=number), alone(ENGINES_BESIDE, engine))
    assert np.isfinite(engines["delta"].isel(engine=[0, 1]).values).all()


def test_one_engine_in_a_list_is_that_engine_and_a_list_at_the_top_varies_slowest():
    raw = {**ENGINES_BESIDE, "axes": {"engine": ["ntua"], "inertia": [1.0, 2.0]}}
    found = sweeps.run(raw)
    assert found.sizes["engine"] == 1
    assert_numbers(found.isel(engine=0), alone(raw, "ntua"))
    axes = {k: v for k, v in ENGINES_BESIDE["axes"].items() if k != "engine"}
    raw = {**ENGINES_BESIDE, "axes": axes, "engine": ["ntua", "v6_96x81"]}
    scene = read_scene(raw)
    assert scene.dimensions == ("engine", "speed", "inertia")
    assert [one.engine.name for one in scene.ordinary_scenes] == ["ntua", "v6_96x81"]
    assert "engine ntua, v6_96x81" in repr(scene) and "12 designs" in repr(make_plan(scene))
    # Arrangements of the engine's own number of cylinders stay one scene.
    raw = {"engine": "v6_96x81", "axes": {"arrangement": [V6, "in-line 6"]}, "output": OUTPUT}
    assert not isinstance(read_scene(raw), SeveralEngines)


@pytest.mark.parametrize("named", [True, False])
def test_engines_of_files_are_called_by_their_names(named: bool, tmp_path: Path) -> None:
    for name, own in (("one", "ntua"), ("six", "v6_96x81")):
        text = ENGINES.joinpath(f"{own}.toml").read_text(encoding="utf-8")
        lines = [line for line in text.splitlines() if not line.startswith("name =")]
        lines[:0] = [f'name = "{name if named else "the same"}"']
        tmp_path.joinpath(f"my_{name}.toml").write_text("\n".join(lines), encoding="utf-8")
    files = [str(tmp_path / f"my_{name}.toml") for name in ("one", "six")]
    scene = {"output": {"quantities": ["mean_piston_speed"]}}
    of_axis = sweeps.run({**scene, "axes": {"engine": files}})
    assert of_axis["engine_name"].values.tolist() == (["one", "six"] if named else files)
    names = ["one", "six"] if named else files
    assert of_axis.attrs["engine"] == ", ".join(names)
    told = json.loads(of_axis.attrs["engine_assumed"])
    assert {key.rpartition(": ")[0] for key in told} == set(names)
    of_rows = sweeps.run({**scene, "designs": {"engine": [*files, files[0]]}})
    assert of_rows["engine"].values.tolist() == [*files, files[0]]  # which `rerun` reads back


@pytest.fixture
def with_spacing(tmp_path):
    """A folder with an engine file that gives a spacing, which those of the catalogue do not."""
    text = (ENGINES / "ntua.toml").read_text().replace('name = "ntua"', 'name = "spaced"')
    (tmp_path / "spaced.toml").write_text(text.replace("bore =", "cylinder_spacing = 0.2\nbore ="))
    return tmp_path


def test_missing_quantities(with_spacing):
    asked, engines = ["shaking_moment_max", "delta"], ["ntua", "spaced.toml"]
    scene = write_scene(with_spacing, asked, engine=engines, axes={"inertia": [2.0, 5.0]})
    read = read_scene(scene)
    assert read.quantities == ("shaking_moment_max", "delta")
    assert read.ordinary_scenes[0].quantities == ("delta",)
    found = sweeps.run(scene)
    assert np.isnan(found["shaking_moment_max"].sel(engine=0).values).all()
    assert np.isfinite(found["shaking_moment_max"].sel(engine=1).values).all()
    assert found["shaking_moment_max"].attrs["comment"] == "not available for ntua"
    assert (found["status"] == 0).all()
    assert "not available, because this engine lacks input for them: shaking_moment_max" in text(
        make_plan(read)
    )


@pytest.mark.parametrize("raw", [ENGINES_BESIDE, TABLE], ids=["axis", "table"])
def test_parts_and_resumed_runs_are_the_whole(raw, tmp_path, monkeypatch):
    assert_same_in_parts(raw, tmp_path, monkeypatch)
    plan, output = make_plan(read_scene(raw)), tmp_path / "out.nc"
    monkeypatch.setattr(limits, "LARGEST_BLOCK", 4e3)
    interrupted(plan, output, monkeypatch)
    done = into_archive.run(plan, output, Options(resume=True))
    assert done.before == 3 and done.blocks > 6
    assert_same(output, sweeps.run(raw))


def test_extend_adds_points_but_no_engine(tmp_path):
    output = tmp_path / "out.nc"
    sweeps.stream({**ENGINES_BESIDE, "output": {"quantities": ["delta"]}}, output)
    ok("extend", output, "--axis", "speed=1400")
    with sweeps.open_archive(output) as found:
        own = alone({**ENGINES_BESIDE, "axes": {"inertia": [0.5, 2.0, 5.0]}}, "ntua", speed=1400)
        assert_array_equal(found["delta"].isel(speed=1, engine=0), own["delta"])
    told = refused("extend", output, "--axis", "engine=b112")
    assert "engine cannot be added to an archive" in told


DELTA = {"quantities": ["delta"]}


@pytest.mark.parametrize(
    ("raw", "words"),
    [
        ({"engine": ["ntua", "ntau"]}, "engine number 2 = 'ntau': unknown engine; did you mean"),
        ({"engine": ["ntua", "ntua"]}, "engine: duplicate 'ntua': the same engine as number 1"),
        ({"engine": []}, "engine = []: must be a list of strings"),
        ({"axes": {"engine": "ntua"}}, "[axes] engine = 'ntua': must be a list of strings"),
        ({"axes": {"engine": ["ntua", 3]}},
        "[axes] engine = ['ntua', 3]: must be a list of strings"),
        ({"engine": "ntua", "axes": {"engine": ["b112"]}}, "given at the top and in [axes]"),
        ({"engine": "ntua", "designs": {"engine": ["b112"], "inertia": [1.0]}},
         "given at the top and in [designs]"),
        ({"axes": {"inertia": [1.0]}}, "engine: missing; must be a string"),
        ({"designs": {"inertia": [1.0]}}, "engine: missing; must be a string"),
        ({"designs": {"engine": ["ntua", "b1112"]}}, "[designs] engine, row 2 = 'b1112': unknown"),
        ({"engine": ["ntua", "v6_96x81"], "axes": {"load": [50, 95]}},
         "engine 'ntua': [axes] load = 95: must be from 0 to 90 percent"),
        ({"engine": ["ntua", "v6_96x81"], "set": {"arrangement": "in-line 1"}},
         "engine 'v6_96x81': [set] arrangement = 'in-line 1': has 1 cylinders, the engine 6"),
        ({"engine": "ntua", "axes": {"arrangement": ["in-line 2", "V7 upside-down"]}},
         "arrangement"),
        ({"engine": ["ntua", "b112"], "axes": {"arrangement": ["in-line 2"], "cylinders": [2]}},
         "[axes] cylinders: not allowed here; it follows from each arrangement"),
        ({"engine": "ntua", "axes": {"arrangement": ["in-line 2", "in-line 2"]}},
         "arrangement: duplicate 'in-line 2'"),
        ({"engine": ["ntua", "b112"], "reference": {"file": "published.csv"}},
         "[reference]: applies to one engine, but the scene has several"),
        ({"engine": ["ntua", "b112"], "set": {"arrangement": "in-line 2"},
          "designs": {"arrangement": ["in-line 2"], "inertia": [1.0]}},
         "arrangement: given in [set] and [designs]; give it once"),
        ({"engine": ["ntua", "b112"], "set": {"inertai": 2.0}}, "inertai: unknown key"),
        ({"engine": ["ntua", "b112"], "output": {"quantities": ["delta", "delta_elasticity"]}},
         "elasticities of 'delta': only for one engine"),
        ({"engine": [str(ENGINES / "ntua.toml"), f"{ENGINES}/./ntua.toml"]},
         "the same engine as number 1"),
    ],
)  # fmt: skip
def test_refused(raw, words):
    assert words in refusal({"output": DELTA, **raw})
