"""Hostile files by the thousand: whatever reads files takes them, or refuses them in one line.

Every target runs for its share of the time, in a process of its own with limited memory. What goes
wrong is made small by hypothesis, which draws the inputs, and printed. Tests run the targets too,
with some inputs that are the same every time.
"""

from __future__ import annotations

import random
import signal
import time
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NoReturn

import hypothesis

from benchmarks import command
from benchmarks.fuzz.hostile import COUNTS
from benchmarks.fuzz.targets import TARGETS
from benchmarks.workers import Lost, answers

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


def work(_: Path, given: Any) -> dict[str, Any]:
    """Run every target in a process of its own."""
    chosen = given.target or list(TARGETS)
    seed = random.SystemRandom().randrange(2**31) if given.seed is None else given.seed
    wrong, targets = [], {}
    for name in chosen:
        job = name, given.seconds / len(chosen), seed
        with command.temporary_files_apart():
            (found,) = answers(campaign, [job], 1, start=limited)
        targets[name] = {} if isinstance(found, Lost) else dict(found)
        command.log(f"{name}: {found.why if isinstance(found, Lost) else targets[name]}")
        wrong += [name] * isinstance(found, Lost)
    return {"seed": seed, "seconds": given.seconds, "targets": targets, "wrong": wrong}


def main(arguments: Sequence[str]) -> int:
    """Run all of it."""
    return command.campaign(
        "fuzz", __doc__, arguments, work, seconds=600.0, target=list(TARGETS), seed=int
    )
