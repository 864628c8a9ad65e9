"""Measure everything and write the report.

python -m benchmarks [--quick] [--huge] [--threads N] [--seconds S] [-o FOLDER]
python -m benchmarks studies [--only NAME ...] [--quick]    the table of studies alone
python -m benchmarks quantities [--all] [--only NAME ...]  rates of single quantities
python -m benchmarks rates [--part FRACTION]               rates behind `engine-dyn plan`
python -m benchmarks identification [--cases N]            coverage of fitted intervals
python -m benchmarks compile-times [--short] [--keep]      processor time of compiling

`--quick` takes a minute, to see that it works; `--huge` goes up to 10^8 designs.
"""

from __future__ import annotations

import datetime
import sys
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np

from benchmarks import (
    compile_times,
    identification,
    measure,
    peers,
    problem,
    quantity_times,
    report,
    study_rates,
    study_times,
)
from benchmarks.command import CPUS, ROOT, log, settings
from benchmarks.studies import STUDIES

COMMANDS = {
    "studies": study_times.main,
    "quantities": quantity_times.main,
    "rates": study_rates.main,
    "identification": identification.main,
    "compile-times": compile_times.main,
}

Build = Callable[[int], problem.Designs]


def collect(threads: int, quick: bool, huge: bool, seconds: float) -> report.Measured:
    """One run, in which each timing of a solver takes about `seconds`."""
    began = time.perf_counter()
    runs = 2 if quick else 5
    peak = [measure.limits(threads)]
    log("reference")
    sample = problem.table(64 if quick else 1000)
    exact = problem.reference(sample)
    few = slice(0, 2 if quick else 8)
    some = problem.scene(50, 1.6, 4, True).take(np.arange(2))
    agreement = max(
        problem.agreement(sample.take(few), exact[few]),
        problem.agreement(some, problem.reference(some)),
    )
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
    table = measure.compare([*measure.own_cases(threads, quick), *unshared], big, exact, seconds)
    log("sampled designs")
    drawn = problem.sampled(2_000 if quick else 400_000)
    of_drawn = problem.reference(drawn.take(slice(0, 16 if quick else 200)))
    # Euler is written for one load, and SciPy's other solver is its slower one.
    able = [c for c in unshared if c.series not in ("Euler in Python", "SciPy solve_bvp")]
    own = [
        peers.Case("auto", f"tolerance {t:.0e}", measure.own_solver(threads, tolerance=t))
        for t in ((1e-6,) if quick else (1e-6, 1e-4, 1e-8))
    ]
    sampled = measure.compare([*own, *map(measure.by_cylinders, able)], drawn, of_drawn, seconds)
    length = min(len(big), report.default_of(table).timing.count)
    alone = measure.timed_alone(big.take(slice(0, length)), threads, runs)

    loops = [case for case in others if case.scenes]
    balanced = [case for case in others if case.series == report.BALANCE]
    left_out = ("Euler in Python", "SciPy solve_ivp", "SciPy solve_bvp")
    quickest = [case for case in others if not case.scenes and case.series not in left_out]
    kinds = [(a, z, False) for a in (2.0, 1.0, 0.0) for z in (1, 4, 8)]
    kinds += [(1.6, 1, False), (1.6, 4, False), (2.0, 1, True), (2.0, 4, True), (1.0, 4, True)]
    scenes = []
    for i, (exponent, cylinders, variable) in enumerate(kinds[:: 4 if quick else 1]):
        scene = partial(problem.scene, exponent=exponent, cylinders=cylinders, variable=variable)
        log(f"scene: alpha {exponent:g}, Z {cylinders}{', variable' if variable else ''}")
        solvable = balanced if exponent == 2.0 and not variable else []
        tolerances = (1e-6, 1e-4, 1e-8, 1e-10)[: 1 if quick or i > 0 else 4]
        beside = loops + (quickest if i == 0 else solvable)
        scenes.append(measure.in_scene(scene, beside, threads, seconds, runs, tolerances))
    pool.close()

    log("number of designs")
    patience = 120.0 if huge else 0.5 if quick else 10.0
    sizes = [10**i for i in range(1 + (4 if quick else 8 if huge else 7))]
    scene_of: dict[str, Build] = {
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

    def sized(build: Build) -> problem.Designs:
        """As many designs as take a while."""
        return build(
            measure.enough(lambda size: problem.answer(build(size), threads), seconds, 4_000_000)
        )

    by_threads = {}
    for name, build in scene_of.items():
        source = sized(build)
        by_threads[name] = [(n, measure.timed_solve(source, n, runs)) for n in sorted({1, threads})]
    by_cylinders = []
    for z in (1, 4) if quick else range(1, 9):
        source = sized(partial(problem.scene, exponent=2.0, cylinders=z))
        by_cylinders.append((z, measure.timed_solve(source, threads, runs)))

    log("traces and the machine's limits")
    arrays = (200, 1000) if quick else (20_000, 100_000)
    traces = [measure.traces(threads, designs, runs) for designs in arrays]
    # The best of two moments: other work on the machine only ever lowers it.
    peak.append(measure.limits(threads))
    flops, writing = map(max, zip(*peak, strict=True))
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
    return report.Measured(
        date=datetime.datetime.now(datetime.UTC).date().isoformat(),
        machine=measure.machine(threads), threads=threads, quick=quick, absent=absent,
        agreement=agreement, agreed=few.stop + len(some), table=table, table_alone=alone,
        sampled=sampled, scenes=scenes, numbers=numbers, by_threads=by_threads,
        by_cylinders=by_cylinders, traces=traces, flops=flops, writing=writing,
        latencies=latencies,
        memory=measure.memory(threads, int(min(most, max(1000, rate * patience)))),
        big=measure.big_run(threads, most, 2.0 * patience), studies=studies,
        quantities=quantities, took=time.perf_counter() - began,
    )  # fmt: skip


def main() -> None:
    """Measure and write."""
    if sys.argv[1:] and sys.argv[1] in COMMANDS:
        COMMANDS[sys.argv[1]](sys.argv[2:])
        return
    given = settings(
        "benchmarks", __doc__, quick=False, huge=False, threads=CPUS, seconds=float, output=Path
    )
    folder = given.output or (ROOT / "out" / "bench" if given.quick else ROOT / "docs")
    seconds = given.seconds or (0.05 if given.quick else 0.4)
    measured = collect(given.threads, given.quick, given.huge, seconds)
    report.write(measured, folder)
    log(f"{measured.took:.0f} s")
    print(folder / "benchmarks.md")


if __name__ == "__main__":
    main()
