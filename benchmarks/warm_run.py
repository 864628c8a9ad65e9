"""What a warm run of two designs costs: calls of our functions, frames down to the kernel, time.

python -m benchmarks.warm_run
"""

from __future__ import annotations

import statistics
import sys
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from types import FrameType
from typing import Any, NamedTuple

import sweeps
from benchmarks.command import ROOT
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


class WarmRun(NamedTuple):
    """Calls of our functions by file and name, functions on the way to the kernel, milliseconds."""

    calls: Counter[str]
    frames: list[str]
    milliseconds: float


@contextmanager
def profiled(note: Callable[[FrameType], None]) -> Iterator[None]:
    """Tell of every call of a function of Python in this thread."""
    before = sys.getprofile()
    sys.setprofile(lambda frame, event, _: note(frame) if event == "call" else None)
    try:
        yield
    finally:
        sys.setprofile(before)


def measure() -> WarmRun:
    """Run the scene until all is warm, then once with its calls noted, then for the time."""
    calls: Counter[str] = Counter()
    frames: list[str] = []

    def note(frame: FrameType) -> None:
        """Count our functions; at the one that calls the kernel, note those on the way to it."""
        if not ours(frame):
            return
        calls[f"{frame.f_code.co_filename}: {frame.f_code.co_qualname}"] += 1
        above: FrameType | None = frame
        while frame.f_code is in_blocks.solve_in_blocks.__code__ and above and ours(above):
            frames.insert(0, f"{Path(above.f_code.co_filename).name}: {above.f_code.co_qualname}")
            above = above.f_back

    run = partial(sweeps.run, SCENE, threads=1)
    for _ in range(3):
        run()
    with profiled(note):
        run()
    times = [seconds_of(run) for _ in range(RUNS)]
    return WarmRun(calls, frames, 1000.0 * statistics.median(times))


def ours(frame: FrameType) -> bool:
    """Whether a function is of one of our packages."""
    return frame.f_code.co_filename.startswith(PACKAGES)


def main() -> None:
    """Measure and print."""
    found = measure()
    files = {place.partition(": ")[0] for place in found.calls}
    print(f"{found.calls.total()} calls of {len(found.calls)} functions in {len(files)} files")
    print(f"{found.milliseconds:.2f} ms, median of {RUNS} runs of two designs on one thread")
    print(f"{len(found.frames)} functions from sweeps.run to the one that calls the kernel:")
    for place in found.frames:
        print(f"  {place}")


if __name__ == "__main__":
    main()
