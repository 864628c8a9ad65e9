"""The script that measures large runs, killed runs and killed workers, small; no time is judged."""

from __future__ import annotations

import tomllib
from pathlib import Path

import pytest

from benchmarks import large_runs
from sweeps.scene.plan.plan import make_plan
from sweeps.scene.reading import read_scene

pytestmark = [pytest.mark.compiled, pytest.mark.slow]


@pytest.mark.parametrize("designs", [50_000, 10_000_000, 100_000_000])
def test_scene_has_about_as_many_designs_as_asked(designs: int) -> None:
    plan = make_plan(read_scene(tomllib.loads(large_runs.scene_text(designs))))
    assert 0.95 * designs < plan.designs < 1.05 * designs


@pytest.mark.skipif(not hasattr(large_runs.os, "wait4"), reason="needs a Unix")
def test_it_measures_and_reports(tmp_path: Path) -> None:
    _, figures = large_runs.measured_sweep(50_000, "100MB", tmp_path)
    assert 33 * figures["designs"] < figures["archive_bytes"] < 40 * figures["designs"]
    # A child's largest resident memory counts what it inherits from the process of the tests.
    assert figures["resident_bytes"] > 1e7
    found = large_runs.kills(50_000, 2, 1, tmp_path)
    assert (found.lost, len(found.kept)) == ([], 2)
    cluster = large_runs.killed_workers(100_000, 1, 1, tmp_path)
    assert cluster.lost == [] and cluster.kept[0] > 0
    assert found.rows()[-1] == ["lost", "nothing"]
