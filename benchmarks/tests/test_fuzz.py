"""The fuzzer: some inputs of each of its targets, the same in every run."""

from __future__ import annotations

import json
import subprocess
import sys
import tomllib
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings

from benchmarks.fuzz.campaign import TARGETS
from benchmarks.fuzz.changes import toml_text
from benchmarks.fuzz.checking import COUNTS
from benchmarks.fuzz.sandbox import engines, scenes

ROOT = Path(__file__).resolve().parents[2]

EXAMPLES = {"figures": 3, "archive": 12, "engine": 12}
"""Inputs of a target where they take long; else as many as the profile says."""


@pytest.mark.parametrize("name", list(TARGETS))
def test_hostile_input_is_taken_or_refused_in_one_line(name: str) -> None:
    make, check = TARGETS[name]
    count = EXAMPLES.get(name, settings.default.max_examples if settings.default else 25)

    @settings(max_examples=count, suppress_health_check=list(HealthCheck))
    @given(make())
    def run(example: Any) -> None:
        check(example)

    before = sum(COUNTS.values())
    run()
    assert sum(COUNTS.values()) > before


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="has no such files")
def test_a_campaign_counts_what_it_made() -> None:
    words = [sys.executable, "-m", "benchmarks.fuzz", "--target", "table", "--seconds", "0.1"]
    done = subprocess.run(words, cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    first, counts = done.stdout.splitlines()
    assert first.startswith("seed ")
    assert json.loads(counts.removeprefix("table: "))["refused"] > 0


def test_written_toml_is_what_was_meant() -> None:
    for data in (*scenes().values(), *engines().values()):
        tree = tomllib.loads(data.decode())
        assert tomllib.loads(toml_text(tree)) == tree
