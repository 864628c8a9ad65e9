"""What a warm run of two designs costs: calls of our functions, frames down to the kernel, time.

python -m benchmarks.warm_run
"""

from __future__ import annotations

import statistics
import sys
import time
from collections import Counter
from pathlib import Path
from types import FrameType
from typing import Any, NamedTuple

import sweeps
from benchmarks.command import ROOT
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


def measure() -> WarmRun:
    """Run the scene until all is warm, then once with its calls noted, then for the time."""
    for _ in range(3):
        sweeps.run(SCENE, threads=1)
    calls: Counter[str] = Counter()
    frames: list[str] = []

    def name(frame: FrameType) -> str:
        code = frame.f_code
        return f"{Path(code.co_filename).name}: {code.co_qualname}"

    def note(frame: FrameType, event: str, argument: Any) -> None:
        if event != "call" or not frame.f_code.co_filename.startswith(PACKAGES):
            return
        calls[f"{frame.f_code.co_filename}: {frame.f_code.co_qualname}"] += 1
        if frame.f_code is in_blocks.solve_in_blocks.__code__:
            above: FrameType | None = frame
            while above is not None and above.f_code.co_filename.startswith(PACKAGES):
                frames.insert(0, name(above))
                above = above.f_back

    sys.setprofile(note)
    try:
        sweeps.run(SCENE, threads=1)
    finally:
        sys.setprofile(None)
    times = []
    for _ in range(RUNS):
        began = time.perf_counter()
        sweeps.run(SCENE, threads=1)
        times.append(time.perf_counter() - began)
    return WarmRun(calls, frames, 1000.0 * statistics.median(times))


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
