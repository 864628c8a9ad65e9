"""Blocks: the same numbers, bit for bit, however a plan is cut."""

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from sweeps.running.compute.in_memory import compute
from sweeps.scene.plan import blocks
from sweeps.scene.plan.plan import Plan, make_plan
from sweeps.scene.reading import read_scene
from tests.support.scenes import IN_BLOCKS

pytestmark = pytest.mark.quick


def plan_of(name: str) -> Plan:
    return make_plan(read_scene({"engine": "ntua", **IN_BLOCKS[name]}))


@pytest.mark.parametrize("name", IN_BLOCKS)
@pytest.mark.parametrize("limit", [0.0, 3e3])
def test_blocks_change_nothing(name: str, limit: float, monkeypatch: pytest.MonkeyPatch) -> None:
    plan = plan_of(name)
    assert blocks.divided(plan)[0] == {}
    whole = compute(plan)
    monkeypatch.setattr(blocks, "LIMIT", limit)
    if limit == 0.0:
        assert all(length == 1 for length in blocks.divided(plan)[0].values())
    cut = compute(plan)
    assert list(cut) == list(whole)
    for quantity, array in whole.items():
        assert cut[quantity].dtype == array.dtype
        assert_array_equal(cut[quantity], array)


def test_blocks_cover_every_design_once(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(blocks, "LIMIT", 3e3)
    plan = plan_of("a product")
    seen = np.zeros([plan.sizes[d] for d in plan.scene.dimensions])
    lengths = blocks.divided(plan)[0]
    for block in blocks.blocks(plan, lengths):
        seen[blocks.index_of(plan.scene.dimensions, block)] += 1
        assert all(part.stop - part.start <= lengths[d] for d, part in block.items())
    assert (seen == 1).all()


def test_the_axes_of_tables_are_cut_first(monkeypatch: pytest.MonkeyPatch) -> None:
    """So no table of work is made twice."""
    plan = plan_of("a product")
    monkeypatch.setattr(blocks, "LIMIT", 0.5 * blocks.passing_bytes(plan, plan.sizes))
    assert set(blocks.divided(plan)[0]) == {"crank_ratio"}


def test_a_block_of_a_large_table_fits() -> None:
    columns = {key: np.linspace(0.1, 0.2, 1_000_000) for key in ("stroke", "bore", "crank_ratio")}
    scene = {"engine": "ntua", "designs": columns, "output": {"quantities": ["delta"]}}
    plan = make_plan(read_scene(scene))
    lengths = blocks.divided(plan)[0]
    assert 10_000 < lengths["design"] < 500_000
    assert blocks.passing_bytes(plan, lengths) <= blocks.LIMIT
    assert blocks.divided(plan)[1] <= plan.output_bytes + blocks.LIMIT
