"""What a warm run of two designs costs: calls of our functions, frames down to the kernel, time."""

from __future__ import annotations

import statistics
import sys
from collections import Counter
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from types import FrameType
from typing import Any

import sweeps
from benchmarks.command import ROOT, settings
from benchmarks.measure import seconds_of
from engine_dyn.speed.batch import in_blocks

SCENE: dict[str, Any] = {
    "engine": "ntua",
    "set": {"speed": 1500.0, "load": 90.0},
    "axes": {"inertia": [2.0, 3.0]},
    "output": {"quantities": ["delta"]},
}

RUNS = 51
"""Runs whose median is told."""

PACKAGES = tuple(str(ROOT / name) for name in ("engine_dyn", "sweeps"))


def ours(place: str) -> bool:
    """Whether a function is of one of our packages."""
    return place.startswith(PACKAGES)


def called(work: Callable[[], Any]) -> tuple[Counter[str], list[str]]:
    """Calls of functions of Python in this thread, and our functions on the way to the kernel."""
    calls: Counter[str] = Counter()
    way: list[str] = []

    def note(frame: FrameType | None, event: str, _: Any) -> None:
        if event != "call" or frame is None:
            return
        calls[_place(frame)] += 1
        if frame.f_code is in_blocks.solve_in_blocks.__code__:
            while frame and ours(_place(frame)):
                way.insert(0, _place(frame))
                frame = frame.f_back

    before = sys.getprofile()
    sys.setprofile(note)
    try:
        work()
    finally:
        sys.setprofile(before)
    return calls, way


def _place(frame: FrameType) -> str:
    """File and name of a function."""
    return f"{frame.f_code.co_filename}: {frame.f_code.co_qualname}"


def warm() -> Callable[[], Any]:
    """A run for which all is warm."""
    run = partial(sweeps.run, SCENE, threads=1)
    for _ in range(3):
        run()
    return run


def main(arguments: Sequence[str]) -> None:
    """Measure and print."""
    settings("warm-run", __doc__, arguments)
    run = warm()
    every, way = called(run)
    calls = Counter({place: count for place, count in every.items() if ours(place)})
    files = {place.partition(": ")[0] for place in calls}
    seconds = statistics.median(seconds_of(run) for _ in range(RUNS))
    print(f"{calls.total()} calls of {len(calls)} functions in {len(files)} files")
    print(f"{1000.0 * seconds:.2f} ms, median of {RUNS} runs of two designs on one thread")
    print(f"{len(way)} functions from sweeps.run to the one that calls the kernel:")
    for place in way:
        print(f"  {Path(place).name}")
