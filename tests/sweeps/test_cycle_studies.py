"""Studies of many modelled cycles: any number, in blocks, the same bits however they are cut."""

import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_array_equal

import sweeps
from sweeps.running.compute import in_memory
from sweeps.running.compute.streaming import stream
from sweeps.scene.plan import blocks
from sweeps.scene.plan.blocks import divided
from sweeps.scene.plan.plan import make_plan
from sweeps.scene.plan.shards import shard
from sweeps.scene.reading import read_scene

pytestmark = pytest.mark.compiled

QUANTITIES = ("delta", "omega_max", "torque_max", "imep", "peak_pressure", "status")


def study(
    count: int, quantities: tuple[str, ...] = QUANTITIES, *, loads: bool = False, **more: Any
) -> dict[str, Any]:
    """Scene of `count` designs drawn at random; the first ones are the same for any count."""
    rng = np.random.default_rng(5)
    drawn = rng.uniform(size=(count, 3))
    designs = {
        "combustion_start": (-35.0 + 25.0 * drawn[:, 0]).tolist(),
        "compression_ratio": (8.0 + 4.0 * drawn[:, 1]).tolist(),
        "heat": (15.0 + 18.0 * drawn[:, 2]).tolist(),
    }
    if loads:
        designs["load"] = [[30.0, 100.0, 64.3, 77.0][i % 4] for i in range(count)]
    asked = {"quantities": list(quantities), "angle_step": 30.0}
    return {"engine": "si_four_87x101", "designs": designs, "output": asked, **more}


def some_of(scene: dict[str, Any], places: Any) -> dict[str, Any]:
    columns = {key: np.asarray(column)[places].tolist() for key, column in scene["designs"].items()}
    return {**scene, "designs": columns}


def assert_same(found: Any, expected: Any, places: Any) -> None:
    for name, values in found.data_vars.items():
        assert_array_equal(values.values, expected[name].values[places], err_msg=name)


def small_blocks(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(blocks, "LIMIT", 10e6)


@pytest.mark.parametrize("loads", [False, True])
def test_bits_of_a_design(monkeypatch: pytest.MonkeyPatch, loads: bool) -> None:
    """Alone, permuted, by one thread and in blocks."""
    names = (
        *QUANTITIES,
        "crank_pin_load_max",
        "main_journal_load_max",
        "gas_torque_order",
        "pressure",
        "omega",
    )
    scene = study(150, names if loads else (*QUANTITIES, "delta_error"), loads=loads)
    whole = sweeps.run(scene)
    assert (whole["status"] == 0).all()
    assert not divided(make_plan(read_scene(scene)))[0]
    permuted = np.random.default_rng(1).permutation(150)
    for places in ([17], [3, 99, 120, 149], permuted):
        assert_same(sweeps.run(some_of(scene, places)), whole, places)
    assert_same(sweeps.run(scene, threads=1), whole, slice(None))
    small_blocks(monkeypatch)
    assert divided(make_plan(read_scene(scene)))[0]["design"] <= 75
    assert_same(sweeps.run(scene), whole, slice(None))


def test_any_number_of_cycles_in_blocks(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """More than 1024 were refused. The archive has the bits of a run in memory, and of shards."""
    scene = study(1500)
    plan = make_plan(read_scene(scene))
    assert 100 < divided(plan)[0]["design"] < 1000
    whole = in_memory.run(scene)
    assert (whole["status"] == 0).all()
    done = stream(scene, tmp_path / "x.nc", memory=100e6)
    assert done.blocks > 1
    with sweeps.open(tmp_path / "x.nc") as archive:
        assert_same(archive[list(QUANTITIES)], whole, slice(None))
    part = in_memory.compute(shard(plan, 2, 3))
    for name in ("delta", "imep"):
        expected = in_memory.compute(plan)[name][500:1000]
        assert_array_equal(part[name], expected)


def calls(scene: dict[str, Any]) -> int:
    """Calls of Python functions while a scene that has been planned is computed."""
    plan, count = make_plan(read_scene(scene)), 0

    def note(frame: Any, event: str, argument: Any) -> None:
        nonlocal count
        count += event == "call"

    sys.setprofile(note)
    try:
        in_memory.compute(plan, threads=1)
    finally:
        sys.setprofile(None)
    return count


@pytest.mark.parametrize(
    ("quantities", "most"),
    [
        (("delta", "torque_max", "imep", "peak_pressure"), 60),
        (("gas_torque_order",), 400),
        (("pressure",), 60),
        (("piston_pin_load_max",), 400),
        (("main_journal_load_max",), 1600),
    ],
)
def test_no_python_once_per_design(
    monkeypatch: pytest.MonkeyPatch, quantities: tuple[str, ...], most: int
) -> None:
    """In one block; orders and loads of bearings are found in pieces of some designs."""
    monkeypatch.setattr(blocks, "LIMIT", 1e9)
    few, many = study(64, quantities), study(320, quantities)
    calls(few), calls(many)
    assert calls(many) - calls(few) < most
