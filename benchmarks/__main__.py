"""Measure everything and write the report.

python -m benchmarks [--quick] [--huge] [--threads N] [--seconds S] [-o FOLDER]
python -m benchmarks studies [--only NAME ...] [--quick]    the table of studies alone
python -m benchmarks quantities [--all] [--only NAME ...]  rates of single quantities
python -m benchmarks rates [--part FRACTION]               rates behind `engine-dyn plan`
python -m benchmarks identification [--cases N]            coverage of fitted intervals
python -m benchmarks compile-times [--short] [--keep]      processor time of compiling
"""

from __future__ import annotations

import argparse
import datetime
import os
import sys
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks import (
    compile_times,
    identification,
    measure,
    own,
    peers,
    problem,
    quantity_times,
    report,
    sampled_peers,
    study_rates,
    study_report,
    study_times,
)
from benchmarks.studies import STUDIES

EXPONENTS, CYLINDERS = (2.0, 1.0, 0.0), (1, 4, 8)


def log(words: str) -> None:
    """Say what goes on."""
    print(f"{time.strftime('%H:%M:%S')}  {words}", file=sys.stderr, flush=True)


def answer_of(
    build: Callable[[int], problem.Scene | problem.Designs], threads: int, size: int
) -> None:
    """Solve `size` designs."""
    own.answer(build(size), threads)


def collect(threads: int, quick: bool, huge: bool, seconds: float) -> report.Measured:
    """One run, in which each timing of a solver takes about `seconds`."""
    began = time.perf_counter()
    runs = 2 if quick else 5
    peak = [measure.limits(threads)]
    log("reference")
    sample = problem.table(64 if quick else 1000)
    exact = problem.reference(sample)
    few = slice(0, 2 if quick else 8)
    agreement = problem.agreement(sample.take(few), exact[few])
    odd = problem.scene(50, 1.6, 4, True)
    some = odd.designs(np.arange(2))
    agreement = max(agreement, problem.agreement(some, problem.reference(some)))
    if agreement > 1e-10:
        raise RuntimeError(f"the reference and oracle differ by {agreement:.1e}")

    pool = peers.Processes(threads)
    others, absent = peers.cases(threads, pool, quick)
    for line in absent:
        log(line)
    log("table of designs that share nothing")
    # The first designs are those of the reference, whatever the length.
    big = problem.joined(sample, problem.table(2_000 if quick else 400_000, seed=2))
    unshared = [case for case in others if case.series != report.SHARING]
    table = measure.compare([*own.cases(threads, quick), *unshared], big, exact, seconds)
    log("sampled designs")
    drawn = sampled_peers.compare(unshared, threads, quick, seconds)
    length = min(len(big), report.default_of(table).timing.count)
    alone = measure.timed_alone(big.take(slice(0, length)), threads, runs)

    loops = [case for case in others if case.scenes]
    series = ("NumPy steps", "Harmonic balance", "JAX scan", "Diffrax", "heyoka")
    quickest = [case for case in others if case.series in series]
    balanced = [case for case in others if case.series == "Harmonic balance"]
    tolerances = [(f"tolerance {t:.0e}", {"tolerance": t}) for t in (1e-6, 1e-4, 1e-8, 1e-10)]
    scenes = []
    kinds = [(a, z, False) for a in EXPONENTS for z in CYLINDERS]
    kinds += [(1.6, 1, False), (1.6, 4, False), (2.0, 1, True), (2.0, 4, True), (1.0, 4, True)]
    for i, (exponent, cylinders, variable) in enumerate(kinds[:: 4 if quick else 1]):
        scene = partial(problem.scene, exponent=exponent, cylinders=cylinders, variable=variable)
        log(f"scene: alpha {exponent:g}, Z {cylinders}{', variable' if variable else ''}")
        solvable = balanced if exponent == 2.0 and not variable else []
        scenes.append(
            measure.in_scene(
                scene, loops + (quickest if i == 0 else solvable), threads, seconds, runs,
                settings=tolerances[: 1 if quick or i > 0 else 4],
            )
        )  # fmt: skip
    pool.close()

    log("number of designs")
    patience = 0.5 if quick else 10.0
    last = 4 if quick else 8 if huge else 7
    sizes = [10**i for i in range(last + 1)]
    if huge:
        patience = 120.0
    scene_of: dict[str, Callable[[int], problem.Scene | problem.Designs]] = {
        "factorial, alpha 2": partial(problem.scene, exponent=2.0),
        "factorial, alpha 1.6": partial(problem.scene, exponent=1.6),
        "table": problem.table,
    }
    numbers = {
        name: measure.against_number(
            sizes if name == "factorial, alpha 2" else sizes[:7], build, threads, patience
        )
        for name, build in scene_of.items()
    }
    log("threads and cylinders")
    counts = sorted({1, threads})

    def sized(build: Callable[[int], problem.Scene | problem.Designs]) -> Any:
        """As many designs as take a while."""
        trial = partial(answer_of, build, threads)
        return build(measure.enough(trial, seconds, 4_000_000))

    by_threads = {}
    for name, build in scene_of.items():
        source = sized(build)
        by_threads[name] = [(n, measure.timed_solve(source, n, runs)) for n in counts]
    by_cylinders = [
        (z, measure.timed_solve(sized(partial(problem.scene, exponent=2.0, cylinders=z)), threads,
                                runs))
        for z in ((1, 4) if quick else range(1, 9))
    ]  # fmt: skip

    log("traces and the machine's limits")
    traces = tuple(
        measure.traces(threads, designs, runs)
        for designs in ((200, 1000) if quick else (20_000, 100_000))
    )
    # The best of two moments: other work on the machine only ever lowers it.
    peak.append(measure.limits(threads))
    flops, flops_one, writing = (max(column) for column in zip(*peak, strict=True))
    studies = study_times.measured(
        STUDIES, threads, runs, 0.005 if quick else 1.0, 2 if quick else 24, log
    )
    log("quantities")
    quantities = quantity_times.measured(
        quantity_times.KINDS, quantity_times.CHOSEN[:: 8 if quick else 1], threads,
        0.05 if quick else 1.0, 1 if quick else 3, log,
    )  # fmt: skip
    log("one design, start-up, compiling")
    latencies = measure.latencies(1 if quick else 5, fresh=not quick)
    log("memory and a large run")
    rate = min(t.rate for t in (numbers["factorial, alpha 2"][-1], scenes[0].ours[0].timing))
    most = 10_000 if quick else 10_000_000
    memory = measure.memory(threads, int(min(most, max(1000, rate * patience))))
    large = measure.big_run(threads, most, 2.0 * patience)
    return report.Measured(
        date=datetime.datetime.now(datetime.UTC).date().isoformat(),
        processor=measure.processor(), lanes=measure.lanes(), threads=threads, quick=quick,
        versions=measure.versions(), absent=absent, agreement=agreement,
        agreed=few.stop + len(some), table=table, table_alone=alone, sampled=drawn, scenes=scenes,
        numbers=numbers, by_threads=by_threads, by_cylinders=by_cylinders, traces=traces,
        flops=flops, flops_one=flops_one, writing=writing, latencies=latencies, memory=memory,
        big=large, studies=studies, quantities=quantities, took=time.perf_counter() - began,
    )  # fmt: skip


def main() -> None:
    """Measure and write."""
    if sys.argv[1:2] == ["studies"]:
        study_times.main(sys.argv[2:], study_report.table)
        return
    if sys.argv[1:2] == ["quantities"]:
        quantity_times.main(sys.argv[2:])
        return
    if sys.argv[1:2] == ["rates"]:
        study_rates.main(sys.argv[2:])
        return
    if sys.argv[1:2] == ["identification"]:
        identification.main(sys.argv[2:])
        return
    if sys.argv[1:2] == ["compile-times"]:
        compile_times.main(sys.argv[2:])
        return
    parser = argparse.ArgumentParser(description="run time against error, throughput, memory")
    parser.add_argument("--quick", action="store_true", help="a minute, to see that it works")
    parser.add_argument("--huge", action="store_true", help="up to 10^8 designs")
    parser.add_argument("--threads", type=int, default=os.cpu_count() or 1)
    parser.add_argument("--seconds", type=float, help="time of one run of a solver (0.4)")
    parser.add_argument("-o", "--output", type=Path, help="default: docs, or out/bench if quick")
    options = parser.parse_args()
    folder = options.output or (
        measure.ROOT / "out" / "bench" if options.quick else measure.ROOT / "docs"
    )
    seconds = options.seconds or (0.05 if options.quick else 0.4)
    measured = collect(options.threads, options.quick, options.huge, seconds)
    report.write(measured, folder)
    log(f"{measured.took:.0f} s")
    print(folder / "benchmarks.md")


if __name__ == "__main__":
    main()
