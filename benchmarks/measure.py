"""Timing, errors, and what has to be measured from outside: start-up, compilation, memory."""

from __future__ import annotations

import os
import platform
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import partial
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import numba
import numpy as np

import sweeps
from benchmarks import own
from benchmarks.peers import Case
from benchmarks.problem import Designs, Scene, diagram, own_inputs, reference, scene
from engine_dyn import compilation, periodic_speed
from engine_dyn.speed import dispatch
from engine_dyn.types import Floats

contracted: Any = numba.njit(nogil=True, fastmath={"contract"}, error_model="numpy")
ROOT = Path(__file__).resolve().parents[1]


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
    return Errors(
        float(np.median(answered)),
        float(np.quantile(answered, 0.99)),
        float(answered.max()),
        1.0 - answered.size / count,
        count,
    )


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


def compare(cases: Sequence[Case], designs: Designs, exact: Floats, seconds: float) -> list[Result]:
    """Time every case on the same designs, all cases taking turns run by run.

    Each case solves as many of the first designs as take about `seconds`.
    """
    sources = []
    for case in cases:
        chosen = np.arange(len(designs))
        if case.exponents:
            chosen = np.flatnonzero(np.isin(designs.exponent, case.exponents))
        sources.append(chosen)

    def solve(i: int, count: int) -> Floats:
        return cases[i].solve(designs.take(sources[i][:count]))

    firsts, counts = [], []
    for i, case in enumerate(cases):
        firsts.append(seconds_of(solve, i, 8))
        counts.append(
            enough(partial(solve, i), seconds, min(case.most, sources[i].size), case.least)
        )
    times: list[list[float]] = [[] for _ in cases]
    found: list[Floats] = [np.zeros(0) for _ in cases]
    for run in range(max(case.runs for case in cases)):
        for i, case in enumerate(cases):
            if run < case.runs:
                part = designs.take(sources[i][: counts[i]])
                begin = time.perf_counter()
                found[i] = case.solve(part)
                times[i].append(time.perf_counter() - begin)
    results = []
    for i, case in enumerate(cases):
        index = sources[i][: counts[i]]
        known = index < exact.size
        results.append(
            Result(
                case,
                Timing(counts[i], tuple(times[i])),
                errors_of(found[i][known], exact[index[known]]),
                firsts[i],
            )
        )
    return results


# Own throughput -----------------------------------------------------------------------------------


@dataclass(frozen=True)
class SceneResult:
    """A factorial scene: this project (the default first), and peers on some of its designs."""

    scene: Scene
    ours: list[Result]
    peers: list[Result]

    @property
    def name(self) -> str:
        """What is written of the scene."""
        variable = ", variable" if self.scene.variable else ""
        return f"factorial, alpha {self.scene.exponent:g}, Z {self.scene.cylinders}{variable}"


DEFAULT = ("tolerance 1e-06", {"tolerance": 1e-6})


def in_scene(
    build: Callable[[int], Scene], peers: Sequence[Case], threads: int, seconds: float, runs: int,
    settings: Sequence[tuple[str, dict[str, Any]]] = (DEFAULT,), most: int = 10_000_000,
) -> SceneResult:  # fmt: skip
    """Time this project on whole scenes and the peers on designs drawn from the first, in turns.

    Every setting gets a scene as large as keeps it busy; the first is the default.
    """
    wholes, indices, exacts = [], [], []
    for _, options in settings:

        def trial(size: int, options: dict[str, Any] = options) -> None:
            own.answer(build(size), threads, **options)

        whole = build(enough(trial, seconds, most, 1000))
        index = np.random.default_rng(2).permutation(whole.size)[:200_000]
        wholes.append(whole)
        indices.append(index)
        exacts.append(reference(whole.designs(index[:200])))
    designs = wholes[0].designs(indices[0])
    times: list[list[float]] = [[] for _ in settings]
    errors: list[Errors] = []
    theirs: list[Result] = []
    groups = [peers[i : i + 4] for i in range(0, len(peers), 4)]
    for turn in range(max(runs, len(groups))):
        for i, (_, options) in enumerate(settings):
            begin = time.perf_counter()
            delta = own.answer(wholes[i], threads, **options)["delta"]
            times[i].append(time.perf_counter() - begin)
            if turn == 0:
                errors.append(errors_of(delta.ravel()[indices[i]], exacts[i]))
        if turn < len(groups):
            few = [replace(case, runs=min(case.runs, 3)) for case in groups[turn]]
            theirs += compare(few, designs, exacts[0], seconds)
    ours = [
        Result(
            Case("auto", setting, own.own(threads, **options)),
            Timing(wholes[i].size, tuple(times[i])),
            errors[i],
            np.nan,
        )
        for i, (setting, options) in enumerate(settings)
    ]
    return SceneResult(wholes[0], ours, theirs)


def timed_solve(source: Scene | Designs, threads: int, runs: int, **options: Any) -> Timing:
    """Warm times of this project on a scene or a table."""
    count = source.size if isinstance(source, Scene) else len(source)
    own.answer(source, threads, **options)
    times = [seconds_of(own.answer, source, threads, **options) for _ in range(runs)]
    return Timing(count, tuple(times))


def timed_alone(designs: Designs, threads: int, runs: int) -> Timing:
    """Warm times of `sweep.solve` on a table, the mean torque being given."""
    inputs = own_inputs(designs, own.FAMILY)
    solve = partial(dispatch.solve, wanted=("delta",), threads=threads, **inputs)
    return Timing(len(designs), tuple(seconds_of(solve) for _ in range(runs)))


def against_number(
    sizes: Sequence[int], build: Callable[[int], Scene | Designs], threads: int, patience: float
) -> list[Timing]:
    """Throughput against the number of designs; sizes expected beyond `patience` s are left out."""
    found: list[Timing] = []
    for size in sizes:
        source = build(size)
        count = source.size if isinstance(source, Scene) else len(source)
        if found and count / found[-1].rate > patience:
            break
        runs = 5 if not found or count / found[-1].rate < 1.0 else 2
        if size < 10_000_000:
            own.answer(source, threads)
        times = [seconds_of(own.answer, source, threads) for _ in range(runs)]
        found.append(Timing(count, tuple(times)))
    return found


@dataclass(frozen=True)
class Traces:
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
    shape = (source.size, angles)
    times: list[tuple[float, float, float]] = []
    solve = partial(own.answer, source, threads, ("omega",), crank_angle=phi)
    solve()
    for _ in range(runs):
        solving = seconds_of(solve)
        begin = time.perf_counter()
        array = np.full(shape, 1.5)
        fresh = time.perf_counter() - begin
        times.append((solving, fresh, seconds_of(array.fill, 2.5)))
        del array
    return Traces(
        source.size, angles, *(statistics.median(column) for column in zip(*times, strict=True))
    )


# Limits of the machine ----------------------------------------------------------------------------


@contracted
def _fused(x: Floats, out: Floats, repeats: int) -> None:
    """16 fused multiplications and additions an element: few loads, chains that overlap."""
    for _ in range(repeats):
        for i in range(x.size):
            y, a = out[i], x[i]
            for _ in range(16):
                y = y * a + 0.5
            out[i] = y


def peak_flops(threads: int, seconds: float = 0.3) -> float:
    """Fused multiplications and additions per second x 2, on `threads` threads, best of five."""
    size = 1024
    arrays = [(np.full(size, 0.5), np.full(size, 0.5)) for _ in range(threads)]
    _fused(*arrays[0], 1)
    repeats = 100
    while seconds_of(_fused, *arrays[0], repeats) < 0.2 * seconds:
        repeats *= 2
    best = np.inf
    with ThreadPoolExecutor(threads) as pool:
        for _ in range(5):
            begin = time.perf_counter()
            list(pool.map(lambda pair: _fused(*pair, repeats), arrays))
            best = min(best, time.perf_counter() - begin)
    return 2.0 * 16.0 * size * repeats * threads / best


def peak_writing(threads: int, size: int = 1 << 25) -> float:
    """Bytes per second written by NumPy into memory that is in use, on `threads` threads."""
    arrays = [np.zeros(size // threads) for _ in range(threads)]
    best = np.inf
    with ThreadPoolExecutor(threads) as pool:
        for _ in range(5):
            begin = time.perf_counter()
            list(pool.map(lambda array: array.fill(1.0), arrays))
            best = min(best, time.perf_counter() - begin)
    return 8.0 * (size // threads) * threads / best


def limits(threads: int) -> tuple[float, float, float]:
    """Flops with all threads and with one, bytes per second written."""
    one = peak_flops(1)
    return max(one, peak_flops(threads)), one, peak_writing(threads)


# From outside -------------------------------------------------------------------------------------


FIRST_RUNS = 3
"""Runs of the command that compile, each into a cache of its own."""

ONE_DESIGN = {"engine": "ntua", "output": {"quantities": ["delta"]}}
ONE_SCENE = 'engine = "ntua"\n\n[output]\nquantities = ["delta"]\n'


def _child(code: str, environment: dict[str, str] | None = None) -> str:
    """What a fresh Python prints."""
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=ROOT,
        env={**os.environ, **(environment or {})},
    )  # fmt: skip
    return done.stdout


def _command(scene_file: Path, output: Path, environment: dict[str, str]) -> float:
    command = Path(sys.executable).with_name("engine-dyn")
    begin = time.perf_counter()
    subprocess.run(
        [command, "run", scene_file, "-o", output, "--overwrite"], check=True, capture_output=True,
        env={**os.environ, **environment},
    )  # fmt: skip
    return time.perf_counter() - begin


@dataclass(frozen=True)
class Latencies:
    """Seconds."""

    periodic_speed: float
    run: float
    command: float
    first_command: float
    import_numba: float
    import_own: float


def one_design(runs: int) -> tuple[float, float]:
    """Seconds of one design in this process, warm: by `periodic_speed`, by `sweeps.run`."""
    one = diagram()

    def single() -> Any:
        return periodic_speed(
            one, bore=0.14, stroke=0.18, crank_ratio=0.2571, reciprocating_mass=6.67,
            inertia=2.0, speed=125.66, friction_torque=30.0,
        )  # fmt: skip

    single(), sweeps.run(ONE_DESIGN)
    return (
        statistics.median(seconds_of(single) for _ in range(20 * runs)),
        statistics.median(seconds_of(sweeps.run, ONE_DESIGN) for _ in range(4 * runs)),
    )


def latencies(runs: int, fresh: bool) -> Latencies:
    """One design: in a process warm, and as a command with a cold (if `fresh`) and a warm cache.

    Processes of their own: the threads of peers that ran in this one would be measured along.
    Seconds that were not measured are NaN.
    """
    asked = f"from benchmarks.measure import one_design; print(*one_design({runs}))"
    of_single, of_run = (float(word) for word in _child(asked).split())
    with tempfile.TemporaryDirectory() as folder:
        file, output = Path(folder) / "one.toml", Path(folder) / "one.nc"
        file.write_text(ONE_SCENE, encoding="utf-8")
        caches = [{"NUMBA_CACHE_DIR": str(Path(folder) / f"cache{i}")} for i in range(FIRST_RUNS)]
        first = [_command(file, output, cache) for cache in caches] if fresh else [np.nan]
        warm = [_command(file, output, caches[0] if fresh else {}) for _ in range(runs)]
    code = (
        "import time; a = time.perf_counter(); import numba; b = time.perf_counter();"
        "import engine_dyn; print(b - a, time.perf_counter() - b)"
    )
    imports = [[float(word) for word in _child(code).split()] for _ in range(runs)]
    return Latencies(
        of_single, of_run, statistics.median(warm), statistics.median(first),
        statistics.median(row[0] for row in imports), statistics.median(row[1] for row in imports),
    )  # fmt: skip


@dataclass(frozen=True)
class Memory:
    """Bytes: what a run adds to a process warmed with one design, and its results."""

    what: str
    designs: int
    added: int
    results: int

    @property
    def overhead(self) -> int:
        """Beyond the results."""
        return self.added - self.results


PEAK = """
import gc
from pathlib import Path
def peak():
    lines = Path("/proc/self/status").read_text().splitlines()
    return 1024 * int(next(line for line in lines if line.startswith("VmHWM")).split()[1])
{prepare}
gc.collect()
Path("/proc/self/clear_refs").write_text("5")  # the peak so far is forgotten
before = peak()
result = work({size})
print(peak() - before, count(result), held(result))
"""

SOLVING = """
from benchmarks import own
from benchmarks.problem import scene
def work(size):
    return own.answer(scene(size, 2.0), {threads})
def count(result):
    return result["delta"].size
def held(result):
    return sum(a.nbytes for a in result.values())
work(1)
"""

RUNNING = """
import numpy as np
import sweeps
def work(size):
    side = round(size ** (1 / 3))
    return sweeps.run({{
        "engine": "ntua",
        "axes": {{"inertia": np.geomspace(1.5, 8.0, side).tolist(),
                 "speed": np.linspace(1000.0, 2000.0, side).tolist(),
                 "reciprocating_mass": np.linspace(3.0, 9.0, size // side**2).tolist()}},
        "output": {{"quantities": ["delta", "omega_max", "omega_min", "omega_mean"]}},
    }}, threads={threads})
def count(result):
    return result["delta"].size
def held(result):
    return sum(v.nbytes for v in result.variables.values())
work(1)
"""


def memory(threads: int, size: int) -> list[Memory]:
    """Peak resident memory of the solver and of a whole run, in processes of their own (Linux)."""
    if not Path("/proc/self/clear_refs").exists():
        return []
    found = []
    for what, prepare in (("sweep.solve", SOLVING), ("sweeps.run", RUNNING)):
        text = PEAK.format(prepare=prepare.format(threads=threads), size=size)
        added, count, held = (int(word) for word in _child(text).split())
        found.append(Memory(what, count, added, held))
    return found


@dataclass(frozen=True)
class BigRun:
    """A scene run by the command, and the same computed only; seconds and bytes."""

    designs: int
    command: float
    computing: float
    size: int


def big_run(threads: int, most: int, patience: float) -> BigRun:
    """`engine-dyn run` of up to `most` designs, four quantities; fewer if it would take long."""

    def axes(size: int) -> dict[str, Any]:
        side = round(size ** (1.0 / 3.0))
        return {
            "inertia": {"start": 1.5, "stop": 8.0, "num": side, "spacing": "log"},
            "speed": {"start": 1000, "stop": 2000, "num": side},
            "reciprocating_mass": {"start": 3.0, "stop": 9.0, "num": max(1, size // side**2)},
        }

    quantities = ["delta", "omega_max", "omega_min", "omega_mean"]

    def compute(size: int) -> int:
        whole = sweeps.run(
            {"engine": "ntua", "axes": axes(size), "output": {"quantities": quantities}},
            threads=threads,
        )
        return int(whole["delta"].size)

    small = most // 100
    took = min(seconds_of(lambda: compute(small)) for _ in range(2))
    size = max(small, min(most, int(small * patience / max(took, 1e-3))))
    if size > most // 2:
        size = most
    begin = time.perf_counter()
    designs = compute(size)
    computing = time.perf_counter() - begin
    lines = ['engine = "ntua"', "", "[axes]"]
    for name, values in axes(size).items():
        inner = ", ".join(
            f'{k} = "{v}"' if isinstance(v, str) else f"{k} = {v}" for k, v in values.items()
        )
        lines.append(f"{name} = {{ {inner} }}")
    lines += ["", "[output]", f"quantities = {quantities}".replace("'", '"'), ""]
    with tempfile.TemporaryDirectory() as folder:
        file, output = Path(folder) / "big.toml", Path(folder) / "big.nc"
        file.write_text("\n".join(lines), encoding="utf-8")
        command = _command(file, output, {})
        return BigRun(designs, command, computing, output.stat().st_size)


# The machine --------------------------------------------------------------------------------------


def processor() -> str:
    """Name of the processor, and the generation that kernels are compiled for."""
    try:
        lines = Path("/proc/cpuinfo").read_text("utf-8").splitlines()
        name = next(line.split(":")[1].strip() for line in lines if line.startswith("model name"))
    except (OSError, StopIteration):
        name = platform.processor() or platform.machine()
    return f"{name} ({compilation.processor()})"


def lanes() -> str:
    """Width of a vector register as compiled code uses it here."""
    from llvmlite import binding

    features = binding.get_host_cpu_features()
    for name, words in (("avx512f", "AVX-512"), ("avx2", "AVX2"), ("neon", "NEON")):
        if features.get(name):
            return words
    return "no vector unit known"


def versions() -> list[tuple[str, str]]:
    """Of Python and the packages compared, as installed."""
    found = [("Python", platform.python_version())]
    for name in ("engine-dyn", "numpy", "numba", "scipy", "xarray", "netCDF4", "jax", "diffrax",
                 "heyoka", "numbalsoda"):  # fmt: skip
        try:
            found.append((name, version(name)))
        except PackageNotFoundError:
            continue
    return found
