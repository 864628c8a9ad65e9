"""Draw many scenes of every kind, as tests/sweeps/test_any_scene.py draws some.

python -m benchmarks.properties [--scenes N] [--seed N] [-o FILE]

The summary (docs/reliability/properties.json) has the number of scenes that each property held for.
Exit status 1 where one failed; pytest then shows the smallest scene that it fails for.
"""

from __future__ import annotations

import os
import random
import re
import subprocess
import sys

from benchmarks.command import ROOT, part_file, settings, write_part

_TEST = re.compile(r"test_any_scene\.py::(\w+):$")
_COUNT = re.compile(r"(\d+) passing, (\d+) failing(?:, and (\d+) invalid)?|"
                    r"(\d+) passing examples, (\d+) failing examples, (\d+) invalid")  # fmt: skip


def counts(statistics: str) -> dict[str, dict[str, int]]:
    """Passing and failing examples of each test, from hypothesis's statistics."""
    found: dict[str, dict[str, int]] = {}
    name = ""
    for line in statistics.splitlines():
        if test := _TEST.search(line.strip()):
            name = test[1]
        elif name and (count := _COUNT.search(line)):
            passing, failing = (int(count[i] or count[i + 3]) for i in (1, 2))
            here = found.setdefault(name, {"passing": 0, "failing": 0})
            here["passing"] += passing
            here["failing"] += failing
    return found


def main() -> None:
    """Run the tests with many examples."""
    options = settings(
        "benchmarks.properties", __doc__, scenes=500, seed=random.randrange(1 << 30),
        output=part_file("properties"),
    )  # fmt: skip
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "tests/sweeps/test_any_scene.py",
         "--hypothesis-profile=many", f"--hypothesis-seed={options.seed}",
         "--hypothesis-show-statistics"],
        cwd=ROOT, env={**os.environ, "SCENES": str(options.scenes)}, stdout=subprocess.PIPE,
        text=True,
    )  # fmt: skip
    print(done.stdout)
    properties = counts(done.stdout)
    write_part(
        options.output,
        {"seed": options.seed, "scenes": options.scenes, "properties": properties,
         "passed": done.returncode == 0},
    )  # fmt: skip
    sys.exit(1 if done.returncode else 0)


if __name__ == "__main__":
    main()
