"""A warm run of two designs passes through few functions."""

from __future__ import annotations

import pytest

from benchmarks import warm_run

MOST_CALLS, MOST_FRAMES = 2500, 10


@pytest.mark.compiled
@pytest.mark.slow
def test_a_warm_run_makes_few_calls() -> None:
    found = warm_run.measure()
    assert 0 < found.calls.total() < MOST_CALLS
    assert 0 < len(found.frames) < MOST_FRAMES
    assert found.frames[0] == "in_memory.py: run"
