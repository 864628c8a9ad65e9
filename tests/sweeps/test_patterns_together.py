"""Results of a firing pattern are the same bits alone and beside others that repeat later."""

import math
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
import xarray as xr

from sweeps.running.compute.in_memory import compute, run
from sweeps.scene.plan import blocks
from sweeps.scene.plan.leaves import points_of
from sweeps.scene.plan.plan import make_plan
from sweeps.scene.plan.shards import shard
from sweeps.scene.reading import read_scene
from tests.support.crossing_scenes import possible

PATTERNS = ["1", "110", "11010", "1111110", "deviation 0.05, 2 cycles, seed 3"]
"""Of 1, 3, 5, 7 and 2 cycles of four cylinders: 210 together."""

FOUR = {"engine": "si_four_87x101", "set": {"speed": 1500.0}}
SHAFT = {**FOUR, "engine": "diesel_105x137", "shaft": "diesel_105x137_generator_set"}
GRID = {
    **FOUR,
    "set": {"speed": 1500.0, "synchronising_torque": 1e4, "pole_pairs": 2, "damping_torque": 10.0},
}


def scene_of(scene: dict[str, Any], patterns: list[str], quantities: list[str]) -> dict[str, Any]:
    return {
        **scene, "silenced_warnings": ["all"], "axes": {"firing_pattern": patterns},
        "output": {"quantities": quantities, "angle_step": 15, "highest_order": 4},
    }  # fmt: skip


def differing(alone: xr.Dataset, beside: xr.Dataset) -> list[str]:
    """Variables whose bits differ where both have points; each point of `alone` must be there."""
    there = {d: np.isin(beside[d], alone[d]) for d in alone.dims if d in alone.coords}
    assert all(places.sum() == alone.sizes[d] for d, places in there.items()), there
    part = beside.isel({d: np.flatnonzero(places) for d, places in there.items()})
    pairs = ((name, values, part[name]) for name, values in alone.items())
    return [
        str(name) for name, one, other in pairs
        if not np.array_equal(one, other, equal_nan=one.dtype.kind == "f")
    ]  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize(
    ("scene", "patterns"),
    [(FOUR, [PATTERNS[0], *PATTERNS[2:]]), (SHAFT, PATTERNS[::2]), (GRID, PATTERNS[::2])],
    ids=["engine", "shaft", "grid"],
)
def test_every_quantity_has_the_same_bits_alone_and_beside(
    scene: dict[str, Any], patterns: list[str]
) -> None:
    names = possible(scene_of(scene, ["1"], ["delta"]))
    assert len(names) > 200
    together = run(scene_of(scene, patterns, names))
    assert together.sizes["firing_cycle"] % (70 if scene is FOUR else 10) == 0
    for number, pattern in enumerate(patterns):
        alone = run(scene_of(scene, [pattern], names)).isel(firing_pattern=0)
        assert differing(alone, together.isel(firing_pattern=number)) == [], pattern


@pytest.mark.slow
def test_axis_designs_blocks_and_shards_give_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    asked = ["delta", "cycle_delta", "omega", "torque_order", "inertia_torque_order", "torque_max"]
    scene = scene_of(FOUR, PATTERNS, asked)
    scene["axes"]["load"] = [60, 100]
    labelled, plan = run(scene), make_plan(read_scene(scene))
    whole = compute(plan)
    rows = [(p, load) for load in (100, 60) for p in reversed(range(len(PATTERNS)))]
    columns = {
        "firing_pattern": [PATTERNS[p] for p, _ in rows], "load": [load for _, load in rows],
    }  # fmt: skip
    of_designs = run({k: v for k, v in scene.items() if k != "axes"}, designs=columns)
    for row, (pattern, load) in enumerate(rows):
        expected = labelled.isel(firing_pattern=pattern).sel(load=load)
        for name in asked:
            assert np.array_equal(of_designs[name].isel(design=row), expected[name]), (name, row)
    monkeypatch.setattr(blocks, "LIMIT", 0.0)
    assert blocks.divided(plan)[0]
    for name, values in compute(plan).items():
        assert np.array_equal(values, whole[name]), name
    for number in range(1, 4):
        part = shard(plan, number, 3)
        about = part.sizes["firing_pattern"]
        begin = len(PATTERNS) * (number - 1) // 3
        for name, values in compute(part).items():
            assert np.array_equal(values, whole[name][begin : begin + about]), name


def test_curves_repeat_and_other_orders_are_nothing() -> None:
    """Between those of the pattern's own cycles, of which "1" has one and the scene 105."""
    found = run(scene_of(FOUR, PATTERNS[:4], ["omega", "cycle_delta", "torque_order"]))
    one = found.isel(firing_pattern=0)
    assert np.ptp(one.omega.values.reshape(105, -1), axis=0).max() == 0.0
    assert np.ptp(one.cycle_delta.values) == 0.0
    own = one.order.values * 2.0 % 1.0 == 0.0
    assert own.sum() == 8
    assert (one.torque_order.values[~own] == 0.0).all()
    assert (one.torque_order.values[one.order.values % 2.0 == 0.0] > 1.0).all()


def test_orders_of_every_union_are_quotients_of_whole_numbers() -> None:
    """Of any lengths that repeat together after up to 210 cycles: each finds its own orders."""
    for engine, turns in (("si_four_87x101", 2), ("marine_80x345", 1)):
        scene = read_scene({"engine": engine, "output": {"quantities": ["imep"]}})
        assert round(scene.engine.period / math.tau) == turns
        highest = scene.highest_order
        orders = {n: points_of(scene, n)["order"] for n in range(1, 211)}
        for cycles, found in orders.items():
            count = math.floor(highest * turns * cycles)
            exact = [float(Fraction(k, turns * cycles)) for k in range(1, count + 1)]
            assert found.tolist() == exact
            for part in range(1, cycles + 1):
                if cycles % part == 0:
                    assert np.isin(orders[part], found).all(), (cycles, part)


def test_elasticities_of_patterns_that_repeat_after_different_cycles() -> None:
    """Beside others each pattern has the elasticities that it has alone."""
    asked = ["delta", "delta_elasticity"]
    whole = run(scene_of(FOUR, ["1", "110"], asked))
    for place, pattern in enumerate(("1", "110")):
        alone = run(scene_of(FOUR, [pattern], asked)).drop_vars("firing_pattern")
        assert alone["delta_elasticity"].notnull().any()
        assert differing(alone, whole.isel(firing_pattern=[place])) == []
