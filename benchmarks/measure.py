"""Timing, errors, and what has to be measured from outside: start-up, compilation, memory."""

from __future__ import annotations

import os
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numba
import numpy as np

import sweeps
from benchmarks.command import PROGRAM, ROOT, processor
from benchmarks.peers import Case, Solver
from benchmarks.problem import Designs, answer, diagram, own_inputs, reference, scene
from benchmarks.tables import toml_text
from engine_dyn import compilation, periodic_speed
from engine_dyn.speed import dispatch
from engine_dyn.types import Floats

contracted: Any = numba.njit(nogil=True, fastmath={"contract"}, error_model="numpy")


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


@dataclass(frozen=True)
class Result:
    """A case, its time and its error."""

    case: Case
    timing: Timing
    errors: Errors
    first: float  # seconds of the first call, which compiles


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
    works: Sequence[Callable[[], Any]], runs: Sequence[int],
    clock: Callable[[], float] = time.perf_counter,
) -> list[tuple[tuple[float, ...], Any]]:  # fmt: skip
    """Seconds of each run of each work, all taking turns, and what it gave last."""
    times: list[list[float]] = [[] for _ in works]
    found: list[Any] = [None for _ in works]
    for turn in range(max(runs, default=0)):
        for i, work in enumerate(works):
            if turn < runs[i]:
                begin = clock()
                found[i] = work()
                times[i].append(clock() - begin)
    return list(zip(map(tuple, times), found, strict=True))


def own_solver(threads: int, **options: Any) -> Solver:
    """Delta of a table of designs by this project."""
    return lambda designs: np.asarray(answer(designs, threads, **options)["delta"])


def own_cases(threads: int, quick: bool) -> list[Case]:
    """Every method of this project, at several tolerances and node counts."""
    one = partial(own_solver, threads)
    auto = (1e-6,) if quick else (1e-4, 1e-6, 1e-8, 1e-10)
    found = [Case("auto", f"tolerance {t:.0e}", one(tolerance=t)) for t in auto]
    for n in () if quick else (2, 4):
        found.append(Case("auto", f"tolerance 1e-06, nodes x {n}", one(finer=n)))
    for n in (1,) if quick else (1, 2, 4):
        found.append(Case("newton", f"nodes x {n}", one(method="newton", finer=n)))
    return [
        *found,
        # What peers that solve exponent 2 alone are compared with.
        Case("auto", "tolerance 1e-06, exponent 2", one(tolerance=1e-6), exponents=(2.0,)),
        Case("closed", "exponents 0 and 2", one(method="closed"), exponents=(0.0, 2.0)),
        # Repeating cycles takes hundreds of them: few runs. Euler never closes at 0.
        Case("thesis", "Euler, 1 degree", one(method="thesis"), 3, exponents=(1.0, 1.6, 2.0)),
    ]


def by_cylinders(case: Case) -> Case:
    """A peer that solves the designs of one number of cylinders after the other."""

    def solve(designs: Designs) -> Floats:
        delta = np.empty(len(designs))
        for count in np.unique(designs.cylinders).tolist():
            index = np.flatnonzero(designs.cylinders == count)
            delta[index] = case.solve(replace(designs.take(index), cylinders=count))
        return delta

    return replace(case, solve=solve)


def compare(cases: Sequence[Case], designs: Designs, exact: Floats, seconds: float) -> list[Result]:
    """Time every case on the same designs, all cases taking turns run by run.

    Each case solves as many of the first designs as take about `seconds`.
    """
    indices, works, firsts = [], [], []
    for case in cases:
        index = np.arange(len(designs))
        if case.exponents:
            index = np.flatnonzero(np.isin(designs.exponent, case.exponents))

        def solve(count: int, case: Case = case, index: Any = index) -> Floats:
            return case.solve(designs.take(index[:count]))

        firsts.append(seconds_of(solve, 8))
        count = enough(solve, seconds, min(case.most, index.size), case.least)
        indices.append(index[:count])
        works.append(partial(case.solve, designs.take(index[:count])))
    results = []
    for case, first, index, (times, delta) in zip(
        cases, firsts, indices, in_turns(works, [case.runs for case in cases]), strict=True
    ):
        known = index < exact.size
        errors = errors_of(delta[known], exact[index[known]])
        results.append(Result(case, Timing(index.size, times), errors, first))
    return results


# Own throughput -----------------------------------------------------------------------------------


@dataclass(frozen=True)
class SceneResult:
    """A factorial scene: this project (the default first), and peers on some of its designs."""

    scene: Designs
    ours: list[Result]
    peers: list[Result]

    @property
    def name(self) -> str:
        """What is written of the scene."""
        variable = ", variable" if self.scene.variable else ""
        return f"factorial, alpha {self.scene.exponent:g}, Z {self.scene.cylinders}{variable}"


def in_scene(
    build: Callable[[int], Designs], peers: Sequence[Case], threads: int, seconds: float, runs: int,
    tolerances: Sequence[float] = (1e-6,), most: int = 10_000_000,
) -> SceneResult:  # fmt: skip
    """Time this project on whole scenes, the peers on designs drawn from the first.

    Every tolerance gets a scene as large as keeps it busy; the first is the default.
    """
    ours: list[Result] = []
    sources = []
    for tolerance in tolerances:
        count = enough(
            lambda size, tolerance=tolerance: answer(build(size), threads, tolerance=tolerance),  # type: ignore[misc]
            seconds, most, 1000,
        )  # fmt: skip
        sources.append(build(count))
    works = [
        partial(answer, source, threads, tolerance=tolerance)
        for source, tolerance in zip(sources, tolerances, strict=True)
    ]
    drawn = [np.random.default_rng(2).permutation(len(source))[:200_000] for source in sources]
    exacts = [
        reference(source.take(index[:200])) for source, index in zip(sources, drawn, strict=True)
    ]
    for i, (times, found) in enumerate(in_turns(works, [runs] * len(works))):
        case = Case("auto", f"tolerance {tolerances[i]:.0e}", own_solver(threads))
        errors = errors_of(found["delta"].ravel()[drawn[i]], exacts[i])
        ours.append(Result(case, Timing(len(sources[i]), times), errors, np.nan))
    few = [replace(case, runs=min(case.runs, 3)) for case in peers]
    theirs = compare(few, sources[0].take(drawn[0]), exacts[0], seconds)
    return SceneResult(sources[0], ours, theirs)


def timed_solve(source: Designs, threads: int, runs: int) -> Timing:
    """Warm times of this project on a scene or a table."""
    answer(source, threads)
    return Timing(
        len(source), tuple(seconds_of(answer, source, threads) for _ in range(runs))
    )  # fmt: skip


def timed_alone(designs: Designs, threads: int, runs: int) -> Timing:
    """Warm times of `sweep.solve` on a table, the mean torque being given."""
    solve = partial(dispatch.solve, wanted=("delta",), threads=threads, **own_inputs(designs))
    return Timing(len(designs), tuple(seconds_of(solve) for _ in range(runs)))


def against_number(
    sizes: Sequence[int], build: Callable[[int], Designs], threads: int, patience: float
) -> list[Timing]:
    """Throughput against the number of designs; sizes expected beyond `patience` s are left out."""
    found: list[Timing] = []
    for size in sizes:
        source = build(size)
        expected = len(source) / found[-1].rate if found else 0.0
        if expected > patience:
            break
        found.append(timed_solve(source, threads, 5 if expected < 1.0 else 2))
    return found


class Traces(NamedTuple):
    """Seconds of a run that stores omega, and of NumPy writing an array of the same size."""

    designs: int
    angles: int
    solving: float
    fresh: float  # np.full: memory that the system first has to hand out, as the run's has
    again: float  # the same array filled once more

    @property
    def size(self) -> int:
        """Bytes."""
        return 8 * self.designs * self.angles


def traces(threads: int, designs: int, runs: int, angles: int = 720) -> Traces:
    """Omega over crank angle of a scene (alpha 2, Z 1)."""
    source = scene(designs, 2.0)
    phi = np.linspace(-2.0 * np.pi, 2.0 * np.pi, angles, endpoint=False)
    shape = (len(source), angles)
    solve = partial(answer, source, threads, ("omega",), crank_angle=phi)
    solve()
    times = []
    for _ in range(runs):
        solving = seconds_of(solve)
        begin = time.perf_counter()
        array = np.full(shape, 1.5)
        fresh = time.perf_counter() - begin
        times.append((solving, fresh, seconds_of(array.fill, 2.5)))
        del array
    return Traces(len(source), angles, *map(statistics.median, zip(*times, strict=True)))


# The machine --------------------------------------------------------------------------------------


@contracted
def _fused(x: Floats, out: Floats, repeats: int) -> None:
    """16 fused multiplications and additions an element: few loads, chains that overlap."""
    for _ in range(repeats):
        for i in range(x.size):
            y, a = out[i], x[i]
            for _ in range(16):
                y = y * a + 0.5
            out[i] = y


def limits(threads: int, size: int = 1024, repeats: int = 200_000) -> tuple[float, float]:
    """Fused multiplications and additions per second x 2, and bytes per second that NumPy writes.

    On all threads; the best of five runs each.
    """
    pairs = [(np.full(size, 0.5), np.full(size, 0.5)) for _ in range(threads)]
    arrays = [np.zeros((1 << 25) // threads) for _ in range(threads)]
    _fused(*pairs[0], 1)
    with ThreadPoolExecutor(threads) as pool:
        flops = min(
            seconds_of(lambda: list(pool.map(lambda pair: _fused(*pair, repeats), pairs)))
            for _ in range(5)
        )
        writing = min(
            seconds_of(lambda: list(pool.map(lambda array: array.fill(1.0), arrays)))
            for _ in range(5)
        )
    return 32.0 * size * repeats * threads / flops, 8.0 * arrays[0].size * threads / writing


def machine(threads: int) -> str:
    """Name of the processor, the generation that kernels are compiled for, width of its vectors."""
    from llvmlite import binding

    features = binding.get_host_cpu_features()
    widths = {"avx512f": "AVX-512", "avx2": "AVX2", "neon": "NEON"}
    lanes = [words for name, words in widths.items() if features.get(name)]
    generation = f"{processor()} ({compilation.processor()})"
    return f"{generation}, {threads} threads, {[*lanes, 'no vector unit known'][0]}"


# From outside -------------------------------------------------------------------------------------


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


def latencies(runs: int, fresh: bool) -> dict[str, float]:
    """Seconds of one design, in a process warm, and as a command with a cold and a warm cache.

    Processes of their own: the threads of peers that ran in this one would be measured along. The
    cold cache only where `fresh`; seconds that were not measured are NaN.
    """
    single, run = _child(f"from benchmarks.measure import one_design; print(*one_design({runs}))")
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
    return {
        "engine_dyn.periodic_speed, warm": single,
        "sweeps.run(dict), warm": run,
        "engine-dyn run, one design, new process, cache warm": warm,
        "engine-dyn run, one design, first ever (compiles), of three": first,
        "compiling, the difference": first - warm,
        "import numba": of_numba,
        "import engine_dyn after it": own,
    }


class Memory(NamedTuple):
    """Bytes: what a run adds to a process warmed with one design, and its results."""

    what: str
    designs: int
    added: int
    results: int


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


PEAK = """
import gc
import sweeps
from pathlib import Path
from benchmarks.measure import answer, factorial, scene
def peak():
    lines = Path("/proc/self/status").read_text().splitlines()
    return 1024 * int(next(line for line in lines if line.startswith("VmHWM")).split()[1])
def work(size):
    return {work}
work(8)
gc.collect()
Path("/proc/self/clear_refs").write_text("5")  # the peak so far is forgotten
before = peak()
result = work({size})
print(peak() - before, result["delta"].size, sum(v.nbytes for v in dict({variables}).values()))
"""


def memory(threads: int, size: int) -> list[Memory]:
    """Peak resident memory of the solver and of a whole run, in processes of their own (Linux)."""
    if not Path("/proc/self/clear_refs").exists():
        return []
    found = []
    for what, work, variables in (
        ("sweep.solve", f"answer(scene(size, 2.0), {threads})", "result"),
        ("sweeps.run", f"sweeps.run(factorial(size), threads={threads})", "result.variables"),
    ):
        code = PEAK.format(work=work, size=size, variables=variables)
        added, count, held = map(int, _child(code))
        found.append(Memory(what, count, added, held))
    return found


class BigRun(NamedTuple):
    """A scene run by the command, and the same computed only; seconds and bytes."""

    designs: int
    command: float
    computing: float
    size: int


def big_run(threads: int, most: int, patience: float) -> BigRun:
    """`engine-dyn run` of up to `most` designs, four quantities; fewer if it would take long."""
    small = most // 100
    compute = partial(sweeps.run, threads=threads)
    took = min(seconds_of(compute, factorial(small)) for _ in range(2))
    size = max(small, min(most, int(small * patience / max(took, 1e-3))))
    if size > most // 2:
        size = most
    asked = factorial(size)
    computing = seconds_of(compute, asked)
    designs = int(np.prod([axis["num"] for axis in asked["axes"].values()]))
    with tempfile.TemporaryDirectory() as name:
        command = _command(asked, Path(name))
        return BigRun(designs, command, computing, (Path(name) / "out.nc").stat().st_size)
