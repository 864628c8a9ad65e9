"""The project alone: rates, traces, single designs, start-up, and a large run."""

from __future__ import annotations

import os
import statistics
import subprocess
import sys
import tempfile
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator

import sweeps
from benchmarks import problem
from benchmarks.command import PROGRAM, ROOT, log
from benchmarks.measure import Run, Timing, enough, seconds_of, warm
from benchmarks.problem import Designs, answer, diagram, scene
from benchmarks.tables import number, span, toml_text
from engine_dyn import periodic_speed

BUILD: dict[str, Callable[[int], Designs]] = {
    "factorial, alpha 2": partial(scene, exponent=2.0),
    "factorial, alpha 1.6": partial(scene, exponent=1.6),
    "table": problem.table,
}


def timed(source: Designs, threads: int, runs: int) -> Timing:
    """Warm times of a scene or a table."""
    return warm(partial(answer, source, threads), len(source), runs)


def against_number(build: Callable[[int], Designs], run: Run, powers: int) -> list[Timing]:
    """Times of 1, 10, 100 ... designs, as long as they are expected to be short."""
    patience = 120.0 if run.huge else 0.5 if run.quick else 10.0
    found: list[Timing] = []
    for size in (10**i for i in range(powers)):
        source = build(size)
        expected = len(source) / found[-1].rate if found else 0.0
        if expected > patience:
            break
        found.append(timed(source, run.threads, 5 if expected < 1.0 else 2))
    return found


def rates(run: Run) -> Figure:
    """Rates against the number of designs, threads and cylinders; the figure of the first."""
    log("number of designs")
    powers = 5 if run.quick else 9 if run.huge else 8
    numbers = {
        name: against_number(build, run, powers if name == "factorial, alpha 2" else min(powers, 7))
        for name, build in BUILD.items()
    }
    body = []
    for size in sorted({t.count for timings in numbers.values() for t in timings}):
        here = [next((t for t in timings if t.count == size), None) for timings in numbers.values()]
        cells = [f"{number(t.rate)} ({span(t.median)})" if t else "-" for t in here]
        body.append([number(size, 3), *cells])
    run.save("numbers", ["designs", *(f"{name}, designs/s" for name in numbers)], body)
    log("threads and cylinders")

    def busy(build: Callable[[int], Designs]) -> Designs:
        """As many designs as take a while."""
        work = lambda size: answer(build(size), run.threads)  # noqa: E731
        return build(enough(work, run.seconds, 4_000_000))

    counts = sorted({1, run.threads})
    body = []
    for name, build in BUILD.items():
        each = [timed(source, n, run.runs).rate for source in [busy(build)] for n in counts]
        body.append([name, *map(number, each), f"{each[-1] / each[0]:.2f}"])
    heads = [f"{n} thread{'s'[: n > 1]}, designs/s" for n in counts]
    run.save("threads", ["designs", *heads, "ratio"], body)
    cylinders = (1, 4) if run.quick else range(1, 9)
    of = {z: busy(partial(scene, exponent=2.0, cylinders=z)) for z in cylinders}
    body = [[str(z), number(timed(one, run.threads, run.runs).rate)] for z, one in of.items()]
    run.save("cylinders", ["cylinders", "designs/s"], body)
    return throughput(numbers)


def throughput(numbers: dict[str, list[Timing]]) -> Figure:
    """Designs a second against their number."""
    figure = Figure(figsize=(4.6, 3.2), layout="constrained")
    FigureCanvasAgg(figure)
    ax = figure.subplots()
    looks = (("#D55E00", "o"), ("#CC79A7", "s"), ("#0072B2", "D"))
    for (name, timings), (colour, marker) in zip(numbers.items(), looks, strict=True):
        ax.plot([t.count for t in timings], [t.rate for t in timings], color=colour, marker=marker,
                label=name)  # fmt: skip
    ax.set(xscale="log", yscale="log", xlabel="designs in one call", ylabel="designs/s")
    ax.xaxis.set_major_locator(LogLocator(numticks=12))
    ax.yaxis.set_major_locator(LogLocator(numticks=12))
    ax.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:,.0f}"))
    ax.minorticks_off()
    ax.legend(loc="lower right")
    return figure


def traces(run: Run, angles: int = 720) -> dict[str, str]:
    """Omega over crank angle of scenes (alpha 2, Z 1), and NumPy writing arrays of that size."""
    log("traces")
    phi = np.linspace(-2.0 * np.pi, 2.0 * np.pi, angles, endpoint=False)
    body = []
    for designs in (200, 1000) if run.quick else (20_000, 100_000):
        source = scene(designs, 2.0)
        solve = partial(answer, source, run.threads, ("omega",), crank_angle=phi)
        solve()
        times = []
        for _ in range(run.runs):
            solving = seconds_of(solve)
            arrays: list[Any] = []
            # Memory that the system first has to hand out, as the run's has; then the same again.
            fresh = seconds_of(lambda kept, n: kept.append(np.full((n, angles), 1.5)), arrays,
                               len(source))  # fmt: skip
            times.append((solving, fresh, seconds_of(arrays[0].fill, 2.5)))
        solving, fresh, again = map(statistics.median, zip(*times, strict=True))
        size = 8 * len(source) * angles
        body.append([
            number(len(source), 3), f"{size / 1e6:.0f}", span(solving),
            f"{size / solving / 1e9:.2g}", span(fresh), f"{solving / fresh:.2g}", span(again),
        ])  # fmt: skip
    head = ["designs", "MB", "time", "GB/s", "NumPy, new array", "times its time", "array in use"]
    run.save("traces", head, body)
    return {"angles": str(angles)}


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
    code = (
        "import time; a = time.perf_counter(); import numba; b = time.perf_counter();"
        "import engine_dyn; print(b - a, time.perf_counter() - b)"
    )
    of_numba, own = map(statistics.median, zip(*(_child(code) for _ in range(runs)), strict=True))
    times = {
        "engine_dyn.periodic_speed, warm": one,
        "sweeps.run(dict), warm": other,
        "engine-dyn run, one design, new process, cache warm": warm,
        "engine-dyn run, one design, first ever (compiles), of three": first,
        "compiling, the difference": first - warm,
        "import numba": of_numba,
        "import engine_dyn after it": own,
    }
    run.save("single", ["what", "time"], [[what, span(s)] for what, s in times.items()])


def factorial(size: int) -> dict[str, Any]:
    """Scene of about so many designs, four quantities."""
    side = round(size ** (1.0 / 3.0))
    return {
        "engine": "ntua",
        "axes": {
            "inertia": {"start": 1.5, "stop": 8.0, "num": side, "spacing": "log"},
            "speed": {"start": 1000, "stop": 2000, "num": side},
            "reciprocating_mass": {"start": 3.0, "stop": 9.0, "num": max(1, size // side**2)},
        },
        "output": {"quantities": ["delta", "omega_max", "omega_min", "omega_mean"]},
    }


def big_run(run: Run) -> dict[str, str]:
    """`engine-dyn run` of many designs, four quantities; fewer if it would take long."""
    log("a large run")
    most, patience = (10_000, 1.0) if run.quick else (10_000_000, 240.0 if run.huge else 20.0)
    small = most // 100
    compute = partial(sweeps.run, threads=run.threads)
    took = min(seconds_of(compute, factorial(small)) for _ in range(2))
    size = max(small, min(most, int(small * patience / max(took, 1e-3))))
    asked = factorial(most if size > most // 2 else size)
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
