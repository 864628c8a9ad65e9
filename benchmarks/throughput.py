"""The project alone: single designs, start-up, and a large run."""

from __future__ import annotations

import os
import statistics
import subprocess
import sys
import tempfile
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

import sweeps
from benchmarks.command import PROGRAM, ROOT, log
from benchmarks.measure import Run, seconds_of
from benchmarks.problem import diagram
from benchmarks.studies import one_table
from benchmarks.tables import number, span, toml_text
from engine_dyn import periodic_speed

FIRST_RUNS = 3
"""Runs of the command that compile, each into a cache of its own."""

ONE_DESIGN = {"engine": "ntua", "output": {"quantities": ["delta"]}}


def _child(code: str) -> list[float]:
    """Numbers that a fresh Python prints."""
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=ROOT
    )
    return [float(word) for word in done.stdout.split()]


def _command(scene: dict[str, Any], folder: Path, **environment: str) -> float:
    """Seconds of `engine-dyn run` of a scene."""
    (folder / "scene.toml").write_text(toml_text(scene), encoding="utf-8")
    words = [PROGRAM, "run", "scene.toml", "-o", "out.nc", "--overwrite"]
    return seconds_of(
        subprocess.run, words, check=True, capture_output=True, cwd=folder,
        env={**os.environ, **environment},
    )  # fmt: skip


def one_design(runs: int) -> tuple[float, float]:
    """Seconds of one design in this process, warm: by `periodic_speed`, by `sweeps.run`."""
    single = partial(
        periodic_speed, diagram(), bore=0.14, stroke=0.18, crank_ratio=0.2571,
        reciprocating_mass=6.67, inertia=2.0, speed=125.66, friction_torque=30.0,
    )  # fmt: skip
    single(), sweeps.run(ONE_DESIGN)
    return (
        statistics.median(seconds_of(single) for _ in range(20 * runs)),
        statistics.median(seconds_of(sweeps.run, ONE_DESIGN) for _ in range(4 * runs)),
    )


def single(run: Run) -> None:
    """Times of one design, in a process warm, and as a command with a cold and a warm cache.

    Processes of their own: the threads of peers that ran in this one would be measured along. The
    cold cache not in a quick run; seconds that were not measured are NaN.
    """
    log("one design, start-up, compiling")
    runs, fresh = (1, False) if run.quick else (5, True)
    one, other = _child(f"from benchmarks.throughput import one_design; print(*one_design({runs}))")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        caches = [str(folder / f"cache{i}") for i in range(FIRST_RUNS)] if fresh else []
        cold = [_command(ONE_DESIGN, folder, NUMBA_CACHE_DIR=cache) for cache in caches]
        given = {"NUMBA_CACHE_DIR": caches[0]} if fresh else {}
        warm = statistics.median(_command(ONE_DESIGN, folder, **given) for _ in range(runs))
    first = statistics.median(cold) if cold else np.nan
    times = {
        "engine_dyn.periodic_speed, warm": one,
        "sweeps.run(dict), warm": other,
        "engine-dyn run, one design, new process, cache warm": warm,
        "engine-dyn run, one design, first ever (compiles), of three": first,
        "compiling, the difference": first - warm,
    }
    run.save("single", ["what", "time"], [[what, span(s)] for what, s in times.items()])


def big_run(run: Run) -> dict[str, str]:
    """`engine-dyn run` of many designs, four quantities; fewer if it would take long."""
    log("a large run")
    most, patience = (10_000, 1.0) if run.quick else (10_000_000, 20.0)
    small = most // 100
    compute = partial(sweeps.run, threads=run.threads)
    took = min(seconds_of(compute, one_table(small)) for _ in range(2))
    size = max(small, min(most, int(small * patience / max(took, 1e-3))))
    asked = one_table(most if size > most // 2 else size)
    computing = seconds_of(compute, asked)
    designs = int(np.prod([axis["num"] for axis in asked["axes"].values()]))
    with tempfile.TemporaryDirectory() as name:
        command = _command(asked, Path(name))
        written = (Path(name) / "out.nc").stat().st_size
    return {
        "big_run": f"{number(designs, 3)} designs in {span(command)}",
        "big_run_means": "`engine-dyn run`, engine `ntua`, inertia x speed x reciprocating mass, "
        f"four results: {span(computing)} of it for computing, the rest for starting and for "
        f"writing {written / 1e6:.0f} MB",
    }
