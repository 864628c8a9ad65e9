"""Every kind of study of `benchmarks.studies`, timed as people run it, with its errors.

`make studies` prints the table, `make bench` writes it into docs/benchmarks/studies.csv.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import partial
from typing import NamedTuple

import numpy as np

import sweeps
from benchmarks import measure, peers, problem
from benchmarks.command import CPUS, settings
from benchmarks.measure import Errors, Timing
from benchmarks.studies import STUDIES, Scene, Study, study
from benchmarks.study_errors import Differences, differences
from benchmarks.tables import number, rows, small, span
from engine_dyn.speed.mechanisms import BATCH, Tally, counted
from engine_dyn.status import CONVERGED

LOOP_STEPS = 180
"""Steps of the loop that studies are compared with: its worst error is 1.6e-6 then."""

FIRST = 300
"""Designs of the first run of a study, which compiles."""


class Measurement(NamedTuple):
    """One study, measured."""

    study: Study
    timing: Timing  # of warm runs
    compiling: float  # seconds of the first small run beyond the second one, which had the cache
    converged: float  # share of designs with status 0
    tally: Tally  # designs by what solved them
    errors: Differences  # of some designs, against an independent solver


class Studies(NamedTuple):
    """All studies of one run, and the rate and errors of the loop that they are compared with."""

    rows: list[Measurement]
    loop: Timing
    loop_errors: Errors


def measured(
    chosen: Sequence[Study], threads: int, runs: int, share: float = 1.0, checked: int = 24,
    log: Callable[[str], None] = print,
) -> Studies:  # fmt: skip
    """Time some studies, which take turns run by run, the loop among them.

    Each has a `share` of its designs; `checked` of them are compared with the independent solver, a
    tenth as many where it solves them one by one.
    """
    loop = peers.numba_loop(LOOP_STEPS, threads)
    designs = problem.table(max(1000, int(200_000 * share)), (2.0,))
    exact = problem.reference(designs.take(slice(0, 200)))
    errors = measure.errors_of(loop(designs), exact)
    scenes: list[Scene] = []
    found: list[tuple[int, float, float, Tally, Differences]] = []
    for one in chosen:
        log(f"study {one.name}: compiling and errors")
        small = one.build(FIRST)
        first, second = (measure.seconds_of(sweeps.run, small, threads=threads) for _ in range(2))
        scenes.append(one.build(max(FIRST, int(one.designs * share))))
        with counted() as tally:
            archive = sweeps.run(scenes[-1], threads=threads)
        status = archive["status"].values.reshape(-1)
        index = np.random.default_rng(7).permutation(status.size)
        converged = float(np.mean(status == CONVERGED))
        of_study = differences(scenes[-1], archive, index, checked)
        found.append((status.size, max(0.0, first - second), converged, tally, of_study))
    log("warm runs")
    works = [partial(sweeps.run, scene, threads=threads) for scene in scenes]
    turns = measure.in_turns([partial(loop, designs), *works], [runs] * (len(works) + 1))
    of_loop, *times = (seconds for seconds, _ in turns)
    rows = [
        Measurement(one, Timing(each[0], seconds), *each[1:])
        for one, seconds, each in zip(chosen, times, found, strict=True)
    ]
    return Studies(rows, Timing(len(designs), of_loop), errors)


# The table ----------------------------------------------------------------------------------------

HEAD = ["study", "times the loop", "designs/s", "designs", "deferred",
        "general", "error of delta", "of speeds", "delta_error covers", "status 0",
        "compiling"]  # fmt: skip


def body(found: Studies) -> list[list[str]]:
    """One row a study."""
    lines = []
    for one, timing, compiling, converged, tally, errors in found.rows:
        left = tally.deferred / (tally.designs[BATCH] or math.nan)
        lines.append([
            one.words, f"{timing.rate / found.loop.rate:.2g}", number(timing.rate),
            number(timing.count, 6), _percent(left), _percent(tally.general_share),
            small(errors.delta), small(errors.speeds), _percent(errors.honest),
            _percent(converged), "-" if compiling < 0.05 else span(compiling),
        ])  # fmt: skip
    return lines


def _percent(share: float) -> str:
    """A share, with two digits where it is small."""
    return "-" if math.isnan(share) else f"{100.0 * share:.3g} %"


def main(arguments: Sequence[str]) -> None:
    """Measure and print."""
    given = settings(
        "studies", __doc__, arguments, only=[one.name for one in STUDIES], quick=False,
        threads=CPUS, runs=int,
    )  # fmt: skip
    runs = given.runs or (2 if given.quick else 5)
    chosen = [study(name) for name in given.only] if given.only else STUDIES
    size, checked = (0.01, 4) if given.quick else (1.0, 24)
    found = measured(chosen, given.threads, runs, size, checked)
    print("\n".join(rows(HEAD, body(found))))
