"""Times and errors: what every benchmark of run time is made of."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks import page
from benchmarks.command import processor
from engine_dyn import compilation
from engine_dyn.types import Floats


@dataclass(frozen=True)
class Run:
    """One run of the benchmark: its threads, its length, and where its tables go.

    `seconds` is what each timing of a solver takes about.
    """

    threads: int
    quick: bool
    seconds: float
    folder: Path

    @property
    def runs(self) -> int:
        """Warm runs of each measurement."""
        return 2 if self.quick else 5

    def save(self, name: str, head: Sequence[str], body: Sequence[Sequence[str]]) -> None:
        """Write a table beside the page."""
        page.save(self.folder, name, head, body)


@dataclass(frozen=True)
class Timing:
    """Designs solved in a run and the seconds of each run."""

    count: int
    seconds: tuple[float, ...]

    @property
    def median(self) -> float:
        """Seconds."""
        return statistics.median(self.seconds)

    @property
    def rate(self) -> float:
        """Designs per second."""
        return self.count / self.median

    @property
    def spread(self) -> float:
        """Slowest over fastest run: how noisy the machine was."""
        return max(self.seconds) / min(self.seconds)


@dataclass(frozen=True)
class Errors:
    """Of delta, relative, over the designs that the reference covers."""

    median: float
    most: float  # of 99 in 100
    worst: float
    unanswered: float  # share of designs without a number
    checked: int


def errors_of(delta: Floats, exact: Floats) -> Errors:
    """Relative errors of `delta`, whose first designs are those of `exact`."""
    count = min(delta.size, exact.size)
    error = np.abs(delta[:count] / exact[:count] - 1.0)
    answered = error[np.isfinite(error)]
    if answered.size == 0:
        return Errors(np.nan, np.nan, np.nan, 1.0, count)
    median, most, worst = np.quantile(answered, (0.5, 0.99, 1.0)).tolist()
    return Errors(median, most, worst, 1.0 - answered.size / count, count)


def seconds_of(work: Callable[..., Any], *arguments: Any, **options: Any) -> float:
    """Wall time of one call."""
    begin = time.perf_counter()
    work(*arguments, **options)
    return time.perf_counter() - begin


def enough(work: Callable[[int], Any], seconds: float, most: int, least: int = 16) -> int:
    """How many designs take about `seconds`, found by doing; from `least` to `most`."""
    count = min(least, most)
    while True:
        took = seconds_of(work, count)
        if took > 0.4 * seconds:  # once more: a number of designs can need a kernel of its own
            took = seconds_of(work, count)
        if took > 0.4 * seconds or count == most:
            break
        count = min(most, int(count * min(16.0, max(1.5, seconds / max(took, 1e-9)))))
    return max(min(least, most), min(most, int(count * min(1.0, seconds / took))))


def in_turns(
    works: Sequence[Callable[[], Any]], runs: Sequence[int]
) -> list[tuple[tuple[float, ...], Any]]:
    """Seconds of each run of each work, all taking turns, and what it gave last."""
    times: list[list[float]] = [[] for _ in works]
    found: list[Any] = [None for _ in works]
    for turn in range(max(runs, default=0)):
        for i, work in enumerate(works):
            if turn < runs[i]:
                begin = time.perf_counter()
                found[i] = work()
                times[i].append(time.perf_counter() - begin)
    return list(zip(map(tuple, times), found, strict=True))


def machine(threads: int) -> str:
    """Name of the processor, the generation that kernels are compiled for, width of its vectors."""
    from llvmlite import binding

    features = binding.get_host_cpu_features()
    widths = {"avx512f": "AVX-512", "avx2": "AVX2", "neon": "NEON"}
    lanes = [words for name, words in widths.items() if features.get(name)]
    generation = f"{processor()} ({compilation.processor()})"
    return f"{generation}, {threads} threads, {[*lanes, 'no vector unit known'][0]}"
