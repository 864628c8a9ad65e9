"""Every kind of study of `benchmarks.studies`, timed as people run it, with its errors.

python -m benchmarks studies [--only NAME ...] [--quick] [--threads N] [--runs N]

prints the table; `python -m benchmarks` writes it into docs/benchmarks/studies.csv.
"""

from __future__ import annotations

import argparse
import os
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

import sweeps
from benchmarks import measure, peers, problem
from benchmarks.measure import Errors, Timing
from benchmarks.studies import LOOP, ONE_TABLE, STUDIES, Study, study
from benchmarks.study_errors import Differences, differences
from engine_dyn.speed.mechanisms import Tally, counted
from engine_dyn.status import CONVERGED

__all__ = ["Measurement", "Studies", "measured", "ratio_of"]

LOOP_STEPS = 180
"""Steps of the loop that studies are compared with: its worst error is 1.6e-6 then."""

FIRST = 300
"""Designs of the first run of a study, which compiles."""


@dataclass(frozen=True)
class Measurement:
    """One study, measured.

    Attributes
    ----------
    study : Study
    timing : Timing
        Of warm runs.
    compiling : float
        Seconds of the first small run beyond the second one: compiling, or loading from the cache.
    converged : float
        Share of designs with status 0.
    tally : Tally
        Designs by what solved them.
    errors : Differences
        Of some designs, against an independent solver.
    """

    study: Study
    timing: Timing
    compiling: float
    converged: float
    tally: Tally
    errors: Differences


@dataclass(frozen=True)
class Studies:
    """All studies of one run, and the rate and errors of the loop that they are compared with."""

    threads: int
    rows: tuple[Measurement, ...]
    loop: Timing
    loop_errors: Errors


def ratio_of(found: Studies, row: Measurement) -> float:
    """Rate of a study over what its aim refers to; NaN where that was not measured."""
    aim = row.study.aim
    assert aim is not None
    if aim.of == LOOP:
        return row.timing.rate / found.loop.rate
    name = "one_table" if aim.of == ONE_TABLE else aim.of
    rates = [other.timing.rate for other in found.rows if other.study.name == name]
    return row.timing.rate / rates[0] if rates else float("nan")


def measured(
    chosen: Sequence[Study], threads: int, runs: int, share: float = 1.0, checked: int = 24,
    log: Callable[[str], None] = print,
) -> Studies:  # fmt: skip
    """Time some studies, which take turns run by run, the loop among them.

    Parameters
    ----------
    chosen : sequence of Study
        Which.
    threads, runs : int
        Threads of each run; warm runs of each study.
    share : float
        Of the designs that a measurement has.
    checked : int
        Designs that are compared with the independent solver; a tenth as many where it solves them
        one by one.
    log : callable
        Told what goes on.
    """
    loop = peers.numba_loop(LOOP_STEPS, threads)
    designs = problem.table(max(1000, int(200_000 * share)), (2.0,))
    exact = problem.reference(designs.take(slice(0, 200)))
    errors = measure.errors_of(loop(designs), exact)
    scenes, compiling = [], []
    for one in chosen:
        log(f"study {one.name}: compiling")
        small = one.build(FIRST)
        first, second = (measure.seconds_of(sweeps.run, small, threads=threads) for _ in range(2))
        compiling.append(max(0.0, first - second))
        scenes.append(one.build(max(FIRST, int(one.designs * share))))
    times: list[list[float]] = [[] for _ in chosen]
    of_loop: list[float] = []
    tallies = [Tally() for _ in chosen]
    archives: list[Any] = [None] * len(chosen)
    for turn in range(runs + 1):  # the first is not timed
        if turn:
            of_loop.append(measure.seconds_of(loop, designs))
        for i, scene in enumerate(scenes):
            with counted() as tally:
                begin = time.perf_counter()
                found = sweeps.run(scene, threads=threads)
                took = time.perf_counter() - begin
            if turn:
                times[i].append(took)
                continue
            log(f"study {chosen[i].name}: {found['delta'].size} designs, {took:.2f} s")
            tallies[i], archives[i] = tally, found
    rows = []
    for i, one in enumerate(chosen):
        log(f"study {one.name}: errors")
        archive: Any = archives[i]
        status = archive["status"].values.reshape(-1)
        index = np.random.default_rng(7).permutation(status.size)
        rows.append(
            Measurement(
                one, Timing(status.size, tuple(times[i])), compiling[i],
                float(np.mean(status == CONVERGED)), tallies[i],
                differences(scenes[i], archive, index, checked),
            )
        )  # fmt: skip
    return Studies(threads, tuple(rows), Timing(len(designs), tuple(of_loop)), errors)


def main(arguments: Sequence[str], table: Callable[[Studies], Sequence[str]]) -> None:
    """Measure and print what `table` makes of it."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks studies", description=__doc__)
    parser.add_argument("--only", nargs="+", type=study, metavar="NAME", help="some studies")
    parser.add_argument("--quick", action="store_true", help="small numbers of designs")
    parser.add_argument("--threads", type=int, default=os.cpu_count() or 1)
    parser.add_argument("--runs", type=int, help="warm runs of each (5; 2 if quick)")
    options = parser.parse_args(arguments)
    runs = options.runs or (2 if options.quick else 5)
    size, checked = (0.01, 4) if options.quick else (1.0, 24)
    print("\n".join(table(measured(options.only or STUDIES, options.threads, runs, size, checked))))
