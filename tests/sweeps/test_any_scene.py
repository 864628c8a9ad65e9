"""Scenes of every kind, drawn: the same in parts, in another order, alone, and by the oracle.

`make properties` draws many more than the suite.
"""

import math
import re
import warnings
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from hypothesis import HealthCheck, event, given, note, settings
from hypothesis import strategies as st

import sweeps
from engine_dyn.quantities.graph import NUMBERED, PARAMETERS
from oracle import solution
from sweeps.running.compute import in_memory, into_archive, limits
from sweeps.running.compute.options import Options
from sweeps.scene.engine.cylinder_keys import CYLINDER_KEYS
from sweeps.scene.features import KEYS_OF_SET
from sweeps.scene.json_schema import scene_schema
from sweeps.scene.plan.plan import make_plan
from sweeps.scene.plan.shards import shard
from sweeps.scene.reading import read_scene
from tests.support import any_scene

# What is drawn is near engines, not always within what they have.
pytestmark = [
    pytest.mark.compiled, pytest.mark.slow,
    pytest.mark.filterwarnings("ignore::engine_dyn.ImplausibleWarning"),
]  # fmt: skip

# `make properties` has a profile of its own, with hundreds of scenes.
SCENES = settings.default.max_examples if settings.default.max_examples > 100 else 12

quick = settings(
    max_examples=SCENES, suppress_health_check=[HealthCheck.too_slow, HealthCheck.filter_too_much]
)


slow = settings(quick, max_examples=SCENES // 4)


def differing(found: xr.Dataset, expected: xr.Dataset) -> list[str]:
    """Names of the results that have other bits."""
    assert set(found.data_vars) == set(expected.data_vars)
    bad = []
    for name, variable in expected.data_vars.items():
        ours, theirs = found[name].transpose(*variable.dims).values, variable.values
        same = np.asarray(ours == theirs)
        if theirs.dtype.kind == "f":
            same |= np.isnan(ours) & np.isnan(theirs)
        if ours.shape != theirs.shape or not same.all():
            bad.append(str(name))
    return bad


def test_strategies_use_the_whole_language() -> None:
    """Every key of the schema, and hardly a scene that is refused."""
    seen: Counter[str] = Counter()
    any_scene.REFUSED.clear()

    @settings(
        max_examples=2000, derandomize=True, database=None, suppress_health_check=list(HealthCheck)
    )
    @given(any_scene.scenes())
    def draw(scene: dict[str, Any]) -> None:
        seen.update(any_scene.keys_of(scene))

    draw()
    schema = scene_schema()
    wanted = {*schema["properties"], *CYLINDER_KEYS, *KEYS_OF_SET, "case", "firing_pattern"}
    wanted |= {key for key in PARAMETERS if key not in NUMBERED}
    wanted |= {re.sub(r"_\d+$", "_*", key) for key in NUMBERED}
    for table in ("Solver", "Output", "Range", "Characteristic"):
        wanted |= set(schema["$defs"][table]["properties"])
    wanted -= {"measured", "recorded_cycle"}  # of recordings: they have own tests
    # These stand in their tables
    wanted -= {"transient_command_angle", "governor_gain", "starter_torque", "clutch_time"}
    wanted -= {"largest_speed", "smallest_speed"}  # of torque diagrams: so do these
    wanted -= {"sample", "uncertainty"}  # tests/sweeps/sampling: in parts, alone, of whole sweeps
    wanted -= {"bore_*"}  # of cylinders with bores of their own: test_single_makes.py
    wanted -= {"passing_start", "passing_end", "speed_ramp"}  # test_shaft_passing.py
    wanted -= {"modal_damping_*"}  # without the heat of shafts: test_shaft_excitations.py
    wanted -= {"reduce"}  # what becomes of results, not what is computed: test_reduced.py
    assert sorted(wanted - seen.keys()) == [], sorted(wanted - seen.keys())
    assert len(any_scene.REFUSED) < 0.05 * seen["engine"], any_scene.REFUSED[:10]


@quick
@given(any_scene.scenes(), st.integers(2, 4), st.sampled_from([300.0, 2e3, 1e4]))
def test_in_parts(
    tmp_path_factory: pytest.TempPathFactory, scene: dict[str, Any], count: int, block: float
) -> None:
    """In blocks into an archive, and as shards: the bits of the whole."""
    note(repr(scene))
    whole = sweeps.run(scene)
    output = Path(tmp_path_factory.mktemp("parts")) / "out.nc"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(limits, "LARGEST_BLOCK", block)
        done = into_archive.run(make_plan(read_scene(scene)), output, Options())
    event(f"{min(done.blocks, 4)} blocks")
    with sweeps.open(output) as opened:
        assert differing(opened, whole) == []
    plan = make_plan(read_scene(scene))
    for number in range(1, count + 1):
        try:
            part = shard(plan, number, count)
        except sweeps.SceneError as error:
            assert "the longest axis has" in str(error)
            return
        (axis,) = [d for d in plan.sizes if part.sizes[d] != plan.sizes[d]] or [""]
        here = in_memory.compute(part)
        first = plan.sizes[axis] * (number - 1) // count if axis else 0
        everything = in_memory.compute(plan)
        for name, values in here.items():
            dims = plan.dims(name)
            place = tuple(
                slice(first, first + part.sizes[d]) if d == axis else slice(None) for d in dims
            )
            theirs = everything[name][place]
            assert np.array_equal(values, theirs, equal_nan=True), name


@quick
@given(any_scene.scenes())
def test_in_another_order(scene: dict[str, Any]) -> None:
    """Axes in another order, and their values and the designs backwards."""
    note(repr(scene))
    whole, other = sweeps.run(any_scene.listed(scene)), sweeps.run(any_scene.reversed_scene(scene))
    backwards = {*scene.get("axes", {}), *(["design"] if "designs" in scene else [])}
    dims = {d: slice(None, None, -1) for d in other.dims if d in backwards}
    event(f"{len(backwards)} axes")
    assert differing(other.isel(dims), whole) == []


@quick
@given(any_scene.scenes(), st.data())
def test_alone(scene: dict[str, Any], data: st.DataObject) -> None:
    """One of the designs, in a scene of its own."""
    whole = sweeps.run(any_scene.listed(scene))
    places = {
        str(d): data.draw(st.integers(0, whole.sizes[d] - 1), label=str(d))
        for d in [*scene.get("axes", {}), *(["design"] if "designs" in scene else [])]
        if d in whole.sizes
    }
    alone = sweeps.run(any_scene.one_of(scene, places))
    chosen = whole.isel({d: slice(i, i + 1) for d, i in places.items()})
    # What one design does not depend on (a misfire of no cylinder) may be an axis for all.
    assert differing(alone.squeeze(), _as_wide(chosen, alone).squeeze()) == []


def _as_wide(dataset: xr.Dataset, like: xr.Dataset) -> xr.Dataset:
    """Without the cylinders, angles and orders that only others have.

    Orders by their values: a longer pattern beside has thirds between the ones that both have.
    """
    cut = {d: slice(0, like.sizes[d]) for d in like.sizes if like.sizes[d] < dataset.sizes[d]}
    if cut.pop("order", None):
        dataset = dataset.sel(order=like["order"].values)
    return dataset.isel(cut)


def design_at(scene: Any, dataset: xr.Dataset, places: dict[str, int]) -> solution.Design:
    """A point of a scene as the oracle takes it; the diagram is that of the packages."""
    engine = scene.engine

    def value(key: str, default: float = math.nan) -> float:
        if key in scene.settings:
            return float(scene.settings[key])
        if key in scene.axes:
            return float(scene.axes[key][places[key]])
        if key in scene.designs:
            return float(scene.designs[key][places["design"]])
        return float(engine.values.get(key, default))

    diagram = engine.family.at(value("load"))
    if engine.pressure_scale is not None:
        speeds, factors = engine.pressure_scale
        diagram = diagram.scaled(float(np.interp(value("speed"), speeds, factors)))
    stroke = value("stroke")
    ratio = value("crank_ratio")
    if scene.gives("rod_length"):
        ratio = stroke / 2.0 / value("rod_length")
    rod = 2.0 * ratio  # stroke / rod length
    mass = value("reciprocating_mass")
    if not scene.gives("reciprocating_mass") and "reciprocating_mass" not in engine.values:
        share = value("rod_centre_of_gravity") / (stroke / rod)
        mass = value("piston_mass") + value("rod_mass") * share
    cylinders = int(value("cylinders"))
    own = scene.own_cylinders
    angles = (
        None
        if own is None or own.arrangement is None
        else tuple(c.firing_angle for c in own.arrangement.cylinders)
    )
    return solution.Design(
        pressure=diagram, bore=value("bore"), stroke=stroke, crank_ratio=ratio,
        reciprocating_mass=mass, inertia=value("inertia"), speed_rpm=value("speed"),
        cylinders=cylinders, load_exponent=value("load_exponent"),
        load_offset=value("load_offset", 0.0),
        friction_torque=float(dataset["friction_torque"].isel(places, missing_dims="ignore")),
        crankcase_pressure=1e5 * value("crankcase_pressure"),
        inertia_model=scene.inertia_models[0], closure=scene.closure, firing_angles=angles,
    )  # fmt: skip


@slow
@given(any_scene.scenes(simple=True), st.data())
def test_by_the_oracle(scene: dict[str, Any], data: st.DataObject) -> None:
    """Adaptive integration of one design, against what the scene has for it."""
    read = read_scene(scene)
    if read.engine.period < 10.0 or "inertia" not in {*read.engine.values}:
        event("not covered")
        return
    if read.closure == "cycle_time" and "variable" in read.inertia_models:
        event("takes the adaptive integration a quarter of an hour")  # `make stress` has them
        return
    scene["output"]["quantities"] = ["delta", "omega_max", "omega_min", "friction_torque"]
    scene = any_scene.listed(scene)
    note(repr(scene))
    read, found = read_scene(scene), sweeps.run(scene)
    places = {
        str(d): data.draw(st.integers(0, found.sizes[d] - 1), label=str(d)) for d in found.sizes
    }
    here = found.isel(places, missing_dims="ignore")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # the integration tells of steps that it shortens
        exact = solution.solve(design_at(read, found, places))
    status = int(here["status"])
    event(exact.status)
    if status != 0:
        assert exact.status != "converged" or status == 5, (status, exact.status)
        return
    assert exact.status == "converged"
    for name in ("omega_max", "omega_min"):
        assert float(here[name]) == pytest.approx(getattr(exact, name), rel=1e-6), name
    assert float(here["delta"]) == pytest.approx(exact.delta, rel=2e-6, abs=1e-9)
