"""A study of the catalogue's V6 over eight parameters, however many designs it takes.

Saltelli's design of so many base points is drawn, computed at two speeds and reduced as it goes
(`[reduce]`): the least inertia under conditions, the front of inertia and irregularity, Sobol'
indices and quantiles of the irregularity. A run that was interrupted is completed with --resume.
"""

from __future__ import annotations

import subprocess
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from benchmarks.command import PROGRAM, ROOT, log, settings
from benchmarks.measure import seconds_of
from benchmarks.tables import number, toml_text

RANGES = {
    "inertia": (0.15, 0.35), "piston_mass": (0.45, 0.75), "rod_mass": (0.45, 0.75),
    "rod_length": (0.135, 0.175), "rod_centre_of_gravity": (0.03, 0.055),
    "bore": (0.093, 0.099), "stroke": (0.078, 0.084), "pin_offset": (0.0, 0.0015),
}  # fmt: skip
"""Around the engine's own 0.2, 0.6, 0.647, 0.15, 0.042, 0.096, 0.081 and 0; kg m2, kg, m."""

SPEEDS = (1000.0, 6000.0)
"""At the first, gas moves the speed, at the second masses; rpm, full load."""

CONDITIONS = ("delta <= 1/9", "torque_mean >= 282 N m")
"""At both speeds, about what the engine itself reaches."""

SHOWN = 5
"""Best designs that are kept, and designs of each search that are printed."""


def scene(points: int) -> dict[str, Any]:
    """The study with so many base points."""
    ranges = {name: {"low": low, "high": high} for name, (low, high) in RANGES.items()}
    return {
        "title": "V6, eight parameters",
        "engine": "v6_96x81",
        "sample": {"method": "saltelli", "number": points, "seed": 1, **ranges},
        "axes": {"speed": [*SPEEDS]},
        "output": {"quantities": ["delta", "torque_mean", "delta_error"]},
        "reduce": {
            "statistics": ["delta", "delta_error"],
            "over": "design",
            "within": [*CONDITIONS],
            "at_every": "speed",
            "best": [{"least": "inertia", "within": [*CONDITIONS], "number": SHOWN}],
            "front": [{"of": ["inertia", "delta"], "within": CONDITIONS[1]}],
        },
    }


def main(arguments: Sequence[str]) -> None:
    """Run the study and print what it found."""
    given = settings(
        "large-study", __doc__, arguments, points=1 << 17, resume=False,
        output=ROOT / "out" / "large_study.nc",
    )  # fmt: skip
    path: Path = given.output
    path.parent.mkdir(parents=True, exist_ok=True)
    path.with_suffix(".toml").write_text(toml_text(scene(given.points)), encoding="utf-8")
    designs = given.points * (len(RANGES) + 2) * len(SPEEDS)
    log(f"{designs:,} designs")

    def command(*words: Any) -> None:
        subprocess.run([PROGRAM, *words], check=True)

    again = "--resume" if given.resume else "--overwrite"
    seconds = seconds_of(command, "run", path.with_suffix(".toml"), "-o", path, again)
    log(f"{seconds:.1f} s, {number(designs / seconds)} designs/s, compiling and writing included")
    command("info", path)
    for search in ("rank_1", "rank_2"):
        command("show", path, "--sort", search, "--quantities", "delta,torque_mean",
                "--limit", str(SHOWN * len(SPEEDS)))  # fmt: skip
    command("sensitivities", path)
