"""Draw many scenes of every kind, as tests/sweeps/test_any_scene.py draws some.

Every pair of features and 2,000 triples are computed by tests/sweeps/test_crossings_drawn.py. The
figures have the number of scenes that each property held for; pytest shows the smallest scene
that one fails for.
"""

from __future__ import annotations

import os
import random
import re
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from benchmarks.command import ROOT, campaign

_TEST = re.compile(r"test_any_scene\.py::(\w+):$")
_COUNT = re.compile(r"(\d+) passing(?: examples)?, (\d+) failing")


def counts(statistics: str) -> dict[str, dict[str, int]]:
    """Passing and failing examples of each test, from hypothesis's statistics."""
    found: dict[str, dict[str, int]] = {}
    name = ""
    for line in statistics.splitlines():
        if test := _TEST.search(line.strip()):
            name = test[1]
        elif name and (count := _COUNT.search(line)):
            here = found.setdefault(name, {"passing": 0, "failing": 0})
            here["passing"] += int(count[1])
            here["failing"] += int(count[2])
    return found


def work(_: Path, given: Any) -> dict[str, Any]:
    """Run the tests with many examples."""
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "tests/sweeps/test_any_scene.py",
         "--hypothesis-profile=many", f"--hypothesis-seed={given.seed}",
         "--hypothesis-show-statistics"],
        cwd=ROOT, env={**os.environ, "SCENES": str(given.scenes)}, stdout=subprocess.PIPE,
        text=True,
    )  # fmt: skip
    print(done.stdout)
    crossed = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-rP", "tests/sweeps/test_crossings_drawn.py"],
        cwd=ROOT, env={**os.environ, "CROSSINGS": str(given.triples)}, stdout=subprocess.PIPE,
        text=True,
    )  # fmt: skip
    print(crossed.stdout)
    return {
        "seed": given.seed,
        "scenes": given.scenes,
        "triples": given.triples,
        "properties": counts(done.stdout),
        "wrong": done.returncode or crossed.returncode,
    }


def main(arguments: Sequence[str]) -> int:
    """Run all of it."""
    seed = random.randrange(1 << 30)
    return campaign("properties", __doc__, arguments, work, scenes=500, triples=2000, seed=seed)
