"""Hostile files by the thousand: whatever reads files takes them, or refuses them in one line.

`python -m benchmarks.fuzz --seconds 600` runs every target for its share of the time, each in a
process of its own with limited memory, and prints how many inputs it made, how many of them were
taken and refused, and what went wrong. That is made small by hypothesis, which draws the inputs,
and printed; the process ends with 1. benchmarks/tests/test_fuzz.py runs these targets
too, each with some inputs that are the same every time. `benchmarks.fuzz.damage` damages the bytes
of archives by the hundred thousand.
"""

from __future__ import annotations

import random
import signal
import sys
import time
from collections import Counter
from typing import Any, NoReturn

import hypothesis

from benchmarks.command import part_file, settings, temporary_files_apart, write_part
from benchmarks.fuzz.hostile import COUNTS
from benchmarks.fuzz.targets import TARGETS
from benchmarks.workers import Lost, answers

__all__ = ["main"]

MEMORY = 8 << 30
"""Bytes of addresses that a process of the campaign may use: libraries map two or three alone."""

LONGEST = 60
"""Seconds of the processor that one input may take; where it waits, ten times that of the clock."""


def too_slow(*_: Any) -> NoReturn:
    """End an input that takes too long."""
    raise TimeoutError(f"more than {LONGEST} s")


def limited() -> None:
    """Limit memory and time of this process."""
    import resource

    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    signal.signal(signal.SIGALRM, too_slow)
    signal.signal(signal.SIGPROF, too_slow)


def campaign(job: tuple[str, float, int]) -> Counter[str]:
    """Run one target for some seconds; how many inputs were made, taken and refused."""
    name, seconds, number = job
    make, check = TARGETS[name]
    end = time.monotonic() + seconds
    COUNTS.clear()

    @hypothesis.settings(
        max_examples=25, deadline=None, database=None, derandomize=False,
        suppress_health_check=list(hypothesis.HealthCheck), print_blob=True,
    )  # fmt: skip
    @hypothesis.given(make())
    def timed(example: Any) -> None:
        COUNTS["inputs"] += 1
        signal.alarm(10 * LONGEST)
        signal.setitimer(signal.ITIMER_PROF, LONGEST)
        try:
            check(example)
        finally:
            signal.alarm(0)
            signal.setitimer(signal.ITIMER_PROF, 0)

    while True:
        hypothesis.seed(number)(timed)()
        number += 1
        if time.monotonic() >= end:
            return COUNTS


def main() -> None:
    """Run every target in a process of its own."""
    given = settings(
        "benchmarks.fuzz", __doc__, seconds=600.0, target=list(TARGETS), seed=int,
        part=part_file("fuzz"),
    )  # fmt: skip
    chosen = given.target or list(TARGETS)
    number = random.SystemRandom().randrange(2**31) if given.seed is None else given.seed
    print(f"seed {number}", flush=True)
    failed, targets = [], {}
    for name in chosen:
        job = name, given.seconds / len(chosen), number
        with temporary_files_apart():
            (found,) = answers(campaign, [job], 1, start=limited)
        targets[name] = {} if isinstance(found, Lost) else dict(found)
        if isinstance(found, Lost):
            failed.append(name)
            print(f"{name}: {found.why}", flush=True)
        else:
            print(f"{name}: {targets[name]}", flush=True)
    figures = {"seed": number, "seconds": given.seconds, "targets": targets}
    write_part(given.part, {**figures, "wrong": failed})
    if failed:
        sys.exit(f"failed: {', '.join(failed)}")
