"""Commands of this folder: `python -m benchmarks [NAME] [--help]`; without a name, the report."""

from __future__ import annotations

import sys
from importlib import import_module

COMMANDS = {
    "studies": "study_times",
    "rates": "study_rates",
    "identification": "identification",
    "compile-times": "compile_times",
    "warm-run": "warm_run",
    "gpu": "gpu",
    "large-study": "large_study",
    "large-runs": "large_runs",
    "stress": "stress.suite",
    "faults": "faults.campaign",
    "soak": "soak",
    "properties": "properties",
    "fuzz": "fuzz.campaign",
    "damage": "fuzz.damage",
}
"""Modules by the names of their commands."""


if __name__ == "__main__":
    name, rest = "report", sys.argv[1:]
    if rest and not rest[0].startswith("-"):
        if rest[0] not in COMMANDS:
            sys.exit(f"{rest[0]}: no command; there are {', '.join(COMMANDS)}")
        name = COMMANDS[rest.pop(0)]
    sys.exit(import_module(f"benchmarks.{name}").main(rest))
