"""The fuzzer: some inputs of each of its targets, the same in every run."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tomllib
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings

from benchmarks.fuzz import damage
from benchmarks.fuzz.campaign import TARGETS
from benchmarks.fuzz.changes import toml_text
from benchmarks.fuzz.checking import COUNTS
from benchmarks.fuzz.damage import read_damaged
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
def test_a_campaign_counts_what_it_made(tmp_path: Path) -> None:
    part = tmp_path / "fuzz.json"
    words = [sys.executable, "-m", "benchmarks.fuzz", "--target", "table", "--seconds", "0.1"]
    words += ["--part", str(part)]
    done = subprocess.run(words, cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    first, counts = done.stdout.splitlines()
    assert first.startswith("seed ")
    assert json.loads(counts.removeprefix("table: "))["refused"] > 0
    assert json.loads(part.read_text(encoding="utf-8"))["wrong"] == []


def test_written_toml_is_what_was_meant() -> None:
    for data in (*scenes().values(), *engines().values()):
        tree = tomllib.loads(data.decode())
        assert tomllib.loads(toml_text(tree)) == tree


@pytest.mark.skipif(not hasattr(os, "fork"), reason="reads what is not cleared in forks")
def test_damaged_bytes_are_taken_or_refused(tmp_path: Path) -> None:
    counts = read_damaged(range(120), 3, tmp_path)
    assert counts["files"] == 120
    assert 20 < counts["taken"] < 100


@pytest.mark.slow
@pytest.mark.skipif(not hasattr(os, "fork"), reason="reads what is not cleared in forks")
def test_a_campaign_of_damage_finds_what_hangs_and_goes_on(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A worker that hangs is killed, its file kept; what was read is not read again."""
    slow = "import time\nfrom benchmarks.fuzz import damage\nread = damage.Reader.read\n"
    slow += "def late(self, number, seed):\n    if number == 2:\n        time.sleep(3600)\n"
    slow += "    read(self, number, seed)\ndamage.Reader.read = late\ndamage._work(4)\n"
    started = damage.Campaign.started

    def late(self: damage.Campaign) -> subprocess.Popen[bytes]:
        self.words = [sys.executable, "-c", slow]
        return started(self)

    monkeypatch.setattr(damage.Campaign, "started", late)
    monkeypatch.setattr(damage, "LONGEST", 1.0)
    counts = damage.campaign(tmp_path, 5, 4, 1, 600.0)
    assert counts["wrong"] == 1 and (tmp_path / "2.nc").exists()
    before = dict(counts)
    assert damage.campaign(tmp_path, 5, 4, 1, 600.0) == before
