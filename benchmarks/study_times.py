"""Every kind of study of `benchmarks.studies`, timed as people run it, with its errors.

python -m benchmarks studies [--only NAME ...] [--quick] [--threads N] [--runs N]

prints the table; `python -m benchmarks` writes it into docs/benchmarks/studies.csv.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

import sweeps
from benchmarks import measure, peers, problem
from benchmarks.command import CPUS, settings
from benchmarks.measure import Errors, Timing
from benchmarks.studies import LOOP, ONE_TABLE, STUDIES, Study, study
from benchmarks.study_errors import Differences, differences
from benchmarks.tables import number, rows, small, span
from engine_dyn.speed.mechanisms import BATCH, Tally, counted
from engine_dyn.status import CONVERGED

__all__ = ["HEAD", "Measurement", "Studies", "body", "measured", "ratio_of"]

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
    found = []
    for one, scene in zip(chosen, scenes, strict=True):
        log(f"study {one.name}: errors")
        with counted() as tally:
            archive = sweeps.run(scene, threads=threads)
        status = archive["status"].values.reshape(-1)
        index = np.random.default_rng(7).permutation(status.size)
        errors_of_study = differences(scene, archive, index, checked)
        found.append((status.size, float(np.mean(status == CONVERGED)), tally, errors_of_study))
    log("warm runs")
    works: list[Callable[[], Any]] = [
        partial(loop, designs),
        *(partial(sweeps.run, s, threads=threads) for s in scenes),
    ]
    of_loop, *times = (seconds for seconds, _ in measure.in_turns(works, [runs] * len(works)))
    measured_rows = [
        Measurement(one, Timing(size, seconds), first, converged, tally, of_study)
        for one, seconds, first, (size, converged, tally, of_study) in zip(
            chosen, times, compiling, found, strict=True
        )
    ]
    return Studies(tuple(measured_rows), Timing(len(designs), of_loop), errors)


# The table ----------------------------------------------------------------------------------------

HEAD = ["study", "ratio", "aim", "long-term aim", "over", "designs/s", "designs", "deferred",
        "general", "error of delta", "of speeds", "delta_error covers", "status 0",
        "compiling"]  # fmt: skip


def body(found: Studies) -> list[list[str]]:
    """One row a study; ratios below their aim are bold."""
    return [_row(found, row) for row in found.rows]


def _row(found: Studies, row: Measurement) -> list[str]:
    aim = row.study.aim
    ratio, wanted, hoped_for, to = math.nan, "-", "-", "-"
    if aim is not None:
        ratio, wanted, to = ratio_of(found, row), f"{aim.wanted:.2g}", aim.of
        hoped_for = "-" if aim.hoped_for is None else f"{aim.hoped_for:.2g}"
    reached = aim is None or not math.isfinite(ratio) or ratio >= aim.wanted
    shown = "-" if not math.isfinite(ratio) else f"{ratio:.2g}"
    tally, errors = row.tally, row.errors
    left = tally.deferred / (tally.designs[BATCH] or math.nan)
    return [
        row.study.words, shown if reached else f"**{shown}**", wanted, hoped_for, to,
        number(row.timing.rate), number(row.timing.count, 6), _percent(left),
        _percent(tally.general_share), small(errors.delta), small(errors.speeds),
        _percent(errors.honest), _percent(row.converged),
        "-" if row.compiling < 0.05 else span(row.compiling),
    ]  # fmt: skip


def _percent(share: float) -> str:
    """A share, with two digits where it is small."""
    return "-" if math.isnan(share) else f"{100.0 * share:.3g} %"


def main(arguments: Sequence[str]) -> None:
    """Measure and print."""
    given = settings(
        "benchmarks studies", __doc__, arguments, only=[one.name for one in STUDIES], quick=False,
        threads=CPUS, runs=int,
    )  # fmt: skip
    runs = given.runs or (2 if given.quick else 5)
    chosen = [study(name) for name in given.only] if given.only else STUDIES
    size, checked = (0.01, 4) if given.quick else (1.0, 24)
    found = measured(chosen, given.threads, runs, size, checked)
    print("\n".join(rows(HEAD, body(found))))
