"""Seconds of the pieces of work that `engine-dyn plan` estimates times by, fitted to measurements.

Times studies of `benchmarks.studies` at two sizes, by the processor time of one thread, so that a
busy machine counts little; writes them into `benchmarks/recorded_times.csv`, fits the seconds of
each piece of work (see `sweeps.scene.plan.forecast.work_of`) so that relative errors are least, and
writes `sweeps/scene/plan/rates.py`. Pieces that no study has keep their seconds.
"""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple
from unittest import mock
from weakref import WeakKeyDictionary

import numpy as np
from scipy.optimize import nnls

import sweeps
from benchmarks import tables
from benchmarks.command import settings
from benchmarks.studies import STUDIES, Scene, study
from engine_dyn.pressure import family
from sweeps.scene.plan import rates
from sweeps.scene.plan.forecast import seconds_of_computing, work_of
from sweeps.scene.plan.plan import Plan, make_plan
from sweeps.scene.reading import read_scene

SHARES = (0.05, 1.0)
"""Parts of a study's designs that are timed."""

FILE = Path(rates.__file__)

TIMES = Path(__file__).with_name("recorded_times.csv")


class Recorded(NamedTuple):
    """A study of `benchmarks.studies` that was timed for the calibration."""

    study: str
    designs: int
    cores: int
    seconds: float


def recorded_times() -> list[Recorded]:
    """What the seconds were fitted to."""
    return [
        Recorded(row["study"], int(row["designs"]), int(row["cores"]), float(row["seconds"]))
        for row in tables.read(TIMES)
    ]


def plan_of(recorded: Recorded) -> Plan:
    """Plan of a study that was timed."""
    return make_plan(read_scene(study(recorded.study).build(recorded.designs)))


def seconds_of_run(scene: Scene) -> float:
    """Processor time of a run that is warm but for its columns, which a command makes anew."""
    with mock.patch.object(family, "_kept", WeakKeyDictionary()):
        begin = time.process_time()
        sweeps.run(scene, threads=1)
        return time.process_time() - begin


def timed(runs: int, share: float) -> list[Recorded]:
    """Time all studies, whose kernels are compiled."""
    found = []
    for one in STUDIES:
        for part in SHARES:
            size = max(300, int(one.designs * part * share))
            scene = one.build(size)
            sweeps.run(scene, threads=1)
            times = [seconds_of_run(scene) for _ in range(runs)]
            # The least: other work on the machine only ever adds.
            found.append(Recorded(one.name, size, 1, min(times)))
            print(f"{one.name:<20}{size:>10}{found[-1].seconds:>12.4f} s", flush=True)
    return found


def fitted(recorded: Sequence[Recorded]) -> dict[str, float]:
    """Seconds of one core for each piece of work, by least squares of relative errors."""
    work = [work_of(plan_of(each)) for each in recorded]
    names = [name for name in rates.SECONDS if any(each.get(name) for each in work)]
    parts = {
        name: np.array(
            [
                each.get(name, 0.0) / (1 if name in rates.SERIAL else one.cores) / one.seconds
                for each, one in zip(work, recorded, strict=True)
            ]
        )
        for name in names
    }
    seconds = dict(rates.SECONDS)
    while names:
        # What the studies cannot tell apart from other work keeps its seconds.
        kept = [part * seconds[name] for name, part in parts.items() if name not in names]
        rest = np.ones(len(recorded)) - sum(kept)
        matrix = np.stack([parts[name] for name in names], axis=1)
        # Columns of one size, because the solver looks for digits in absolute numbers.
        size = matrix.max(axis=0)
        found, _ = nnls(matrix / size, rest)
        if found.all():
            return seconds | dict(zip(names, (found / size).tolist(), strict=True))
        names = [name for name, value in zip(names, found, strict=True) if value]
    return seconds


def written(text: str, seconds: Mapping[str, float]) -> str:
    """Text of `rates.py` with other numbers."""
    before, rest = text.split("SECONDS: dict[str, float] = {\n", 1)
    lines = [f'    "{name}": {value:.3g},\n' for name, value in seconds.items()]
    after = rest[rest.index("}\n") :]
    return f"{before}SECONDS: dict[str, float] = {{\n{''.join(lines)}{after}"


def main(arguments: Sequence[str]) -> None:
    """Measure, fit, write, and print what the fit makes of the measurements."""
    given = settings("rates", __doc__, arguments, part=1.0, runs=3, output=FILE)
    recorded = timed(given.runs, given.part)
    seconds = fitted(recorded)
    body = [(r.study, str(r.designs), str(r.cores), f"{r.seconds:.4g}") for r in recorded]
    tables.save(TIMES, Recorded._fields, body)
    given.output.write_text(written(FILE.read_text(encoding="utf-8"), seconds), encoding="utf-8")
    rates.SECONDS.update(seconds)
    for each in recorded:
        estimated = seconds_of_computing(plan_of(each), each.cores)
        print(f"{each.study:<20}{each.designs:>10}{estimated / each.seconds:>8.2f} of its time")
