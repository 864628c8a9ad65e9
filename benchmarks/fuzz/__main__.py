"""Hostile files by the thousand: whatever reads files takes them, or refuses them in one line.

`python -m benchmarks.fuzz --seconds 600` runs every target for its share of the time, each in a
process of its own with limited memory, and prints how many inputs it made, how many of them were
taken and refused, and what went wrong. That is made small by hypothesis, which draws the inputs,
and printed; the process ends with 1. benchmarks/tests/test_fuzz.py runs these targets
too, each with some inputs that are the same every time. `benchmarks.fuzz.damage` damages the bytes
of archives by the hundred thousand.
"""

from __future__ import annotations

import json
import random
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from typing import Any, NoReturn

import hypothesis
from hypothesis import HealthCheck, given, seed
from hypothesis import strategies as st

from benchmarks.command import ROOT, part_file, settings, temporary_files_apart, write_part
from benchmarks.fuzz.archives import archives, check_archive, check_figures
from benchmarks.fuzz.binary_tables import binary_tables, check_binary_table
from benchmarks.fuzz.checking import COUNTS
from benchmarks.fuzz.command_lines import check_command_line, command_lines
from benchmarks.fuzz.measured_speeds import check_measured_speed, measured_speeds
from benchmarks.fuzz.partials import check_partial, partials
from benchmarks.fuzz.recordings import check_recording, recordings
from benchmarks.fuzz.sandbox import engines, scenes
from benchmarks.fuzz.texts import check_engine, check_scene, check_table, tables, texts

__all__ = ["MEMORY", "TARGETS", "main"]

MEMORY = 8 << 30
"""Bytes of addresses that a process of the campaign may use: libraries map two or three alone."""

LONGEST = 60
"""Seconds of the processor that one input may take; where it waits, ten times that of the clock."""

TARGETS: dict[str, tuple[Callable[[], st.SearchStrategy[Any]], Callable[[Any], None]]] = {
    "scene": (lambda: texts(scenes()), check_scene),
    "engine": (lambda: texts(engines()), check_engine),
    "table": (tables, check_table),
    "binary table": (binary_tables, check_binary_table),
    "recording": (recordings, check_recording),
    "measured speed": (measured_speeds, check_measured_speed),
    "archive": (archives, check_archive),
    "figures": (archives, check_figures),
    "partial": (partials, check_partial),
    "command line": (command_lines, check_command_line),
}


def campaign(name: str, seconds: float, number: int) -> None:
    """Run one target in this process; ends it."""
    import resource

    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    make, check = TARGETS[name]
    strategy = make()
    end = time.monotonic() + seconds

    def timed(example: Any) -> None:
        COUNTS["inputs"] += 1
        signal.alarm(10 * LONGEST)
        signal.setitimer(signal.ITIMER_PROF, LONGEST)
        try:
            check(example)
        finally:
            signal.alarm(0)
            signal.setitimer(signal.ITIMER_PROF, 0)

    @hypothesis.settings(
        max_examples=25, deadline=None, database=None, derandomize=False,
        suppress_health_check=list(HealthCheck), print_blob=True,
    )  # fmt: skip
    @given(strategy)
    def test(example: Any) -> None:
        timed(example)

    def too_slow(*_: Any) -> NoReturn:
        raise TimeoutError(f"more than {LONGEST} s")

    signal.signal(signal.SIGALRM, too_slow)
    signal.signal(signal.SIGPROF, too_slow)
    try:
        while time.monotonic() < end:
            seed(number)(test)()
            number += 1
    finally:
        print(json.dumps(COUNTS), flush=True)


def main() -> None:
    """Run every target in a process of its own."""
    given_ = settings(
        "benchmarks.fuzz", __doc__, seconds=600.0, target=list(TARGETS), seed=int,
        part=part_file("fuzz"), here=False,
    )  # fmt: skip
    chosen = given_.target or list(TARGETS)
    number = random.SystemRandom().randrange(2**31) if given_.seed is None else given_.seed
    share = given_.seconds / len(chosen)
    if given_.here:
        campaign(chosen[0], share, number)
        return
    failed, targets = [], {}
    print(f"seed {number}", flush=True)
    for name in chosen:
        words = [sys.executable, "-m", "benchmarks.fuzz", "--here", "--target", name]
        words += ["--seconds", str(share), "--seed", str(number)]
        with temporary_files_apart():
            done = subprocess.run(words, capture_output=True, text=True, cwd=ROOT)
        counts = (done.stdout.splitlines() or ["{}"])[-1]
        print(f"{name}: {counts}", flush=True)
        targets[name] = json.loads(counts)
        if done.returncode:
            failed.append(name)
            print(f"{name}: ended with {done.returncode}\n{done.stderr[-6000:]}", flush=True)
    figures = {"seed": number, "seconds": given_.seconds, "targets": targets}
    write_part(given_.part, {**figures, "wrong": failed})
    if failed:
        sys.exit(f"failed: {', '.join(failed)}")


if __name__ == "__main__":
    main()
