"""Thousands of runs in one process; many threads and processes at once; readers beside a writer.

What must hold: memory does not grow, no file descriptor, thread or temporary file is left, every
result is that of the same scene alone (to the byte), and a reader sees the old archive or the new
one.
"""

from __future__ import annotations

import contextlib
import gc
import itertools
import tempfile
import threading
import time
from collections import defaultdict
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any
from unittest import mock

import numpy as np
import psutil

import sweeps
from benchmarks.command import campaign, temporary_files_apart
from benchmarks.workers import in_processes
from sweeps.running.compute import into_archive, limits
from sweeps.running.compute.computation import Computation
from sweeps.running.compute.options import Options, Stopped
from sweeps.scene.plan.blocks import Block, Results
from sweeps.scene.plan.plan import make_plan
from sweeps.scene.reading import read_scene

GROWTH = 4096.0
"""Bytes a run by which memory may grow at most. A result, a plan, a file or a table that stayed
would be more: the smallest scene below has tables of 50 kB."""

BLOCK = 3e4
"""Bytes of a block: scenes have several."""

THREADS, PROCESSES = 6, 4


def _scene(engine: str, speeds: list[float], quantities: list[str], **more: Any) -> dict[str, Any]:
    return {
        "engine": engine,
        "silenced_warnings": ["all"],  # one inertia for all engines
        "axes": {"speed": speeds, "inertia": np.linspace(1.5, 6.0, 60).tolist()},
        "output": {"quantities": quantities, "angle_step": 30.0},
        **more,
    }


SCENES: dict[str, dict[str, Any]] = {
    "scalars": _scene("ntua", [1000, 1200, 1500], ["delta", "imep"]),
    "curves": _scene("diesel_105x137", [1500, 1600], ["delta", "omega", "torque"]),
    "methods": _scene("ntua", [1000, 1200], ["delta"], solver={"method": ["auto", "newton"]}),
    "six cylinders": _scene("v6_96x81", [2000, 3000], ["delta", "shaking_force_max"]),
    "two-stroke": _scene("marine_80x345", [72, 80], ["delta", "load_torque"]),
}

WRONG: dict[str, Any] = {**SCENES["scalars"], "axes": {"speed": [1000, -1]}}


# --- one process --------------------------------------------------------------------------------


def sample() -> dict[str, int]:
    """What this process has."""
    gc.collect()
    process = psutil.Process()
    return {"resident": process.memory_info().rss, "descriptors": process.num_fds(),
            "threads": process.num_threads()}  # fmt: skip


def results(dataset: Any) -> dict[str, bytes]:
    """Values of all results."""
    return {str(name): dataset[name].values.tobytes() for name in sorted(dataset.data_vars)}


def _kinds_of_runs(folder: Path, alone: dict[str, dict[str, bytes]]) -> list[Callable[[str], bool]]:
    """What is done in turn, with each of the scenes; false where a result is not right."""

    def in_memory(name: str) -> bool:
        return results(sweeps.run(SCENES[name])) == alone[name]

    def archive(name: str) -> bool:
        output = folder / "out.nc"
        sweeps.stream(SCENES[name], output, overwrite=True)
        with sweeps.open(output) as found:
            return results(found) == alone[name]

    def refused(name: str) -> bool:
        with contextlib.suppress(sweeps.SceneError):
            sweeps.run(WRONG)
            return False
        return True

    def interrupted(name: str) -> bool:
        output = folder / "kept.nc"
        output.unlink(missing_ok=True)
        plan = make_plan(read_scene(SCENES[name]))
        with _stops_after_one_block(), contextlib.suppress(Stopped):
            into_archive.run(plan, output, Options(overwrite=True))
        into_archive.run(plan, output, Options(resume=True))
        with sweeps.open(output) as found:
            return results(found) == alone[name]

    return [in_memory, archive, refused, interrupted]


@contextlib.contextmanager
def _stops_after_one_block() -> Iterator[None]:
    """As Ctrl-C does, while the second block is computed."""
    original, numbers = Computation.results, itertools.count()

    def stopping(self: Computation, block: Block) -> Results:
        if next(numbers) == 1:
            raise KeyboardInterrupt
        return original(self, block)

    with mock.patch.object(Computation, "results", stopping):
        yield


def one_process(runs: int, folder: Path) -> tuple[list[str], dict[str, Any]]:
    """Run scenes of all kinds one after the other, in this process; what fell, and figures."""
    wrong, began = [], time.perf_counter()
    alone = {name: results(sweeps.run(scene)) for name, scene in SCENES.items()}
    kinds, names = _kinds_of_runs(folder, alone), list(SCENES)
    before = set(Path(tempfile.gettempdir()).iterdir())
    counts: list[int] = []
    samples: dict[str, list[int]] = defaultdict(list)
    for run in range(runs):
        name = names[run // len(kinds) % len(names)]
        if not kinds[run % len(kinds)](name):
            wrong.append(f"run {run}, {name}: another result than alone")
        # The first quarter is left out: caches fill.
        if (run + 1) % (len(kinds) * len(names)) == 0 and run >= runs // 4:
            counts.append(run + 1)
            for what, value in sample().items():
                samples[what].append(value)
    left = [path.name for path in folder.iterdir() if path.name not in ("out.nc", "kept.nc")]
    left += [path.name for path in set(Path(tempfile.gettempdir()).iterdir()) - before]
    wrong += [f"left: {name}" for name in left]
    grows = float(np.polyfit(counts, samples["resident"], 1)[0])
    if grows > GROWTH:
        wrong.append(f"memory grows by {grows:.0f} bytes a run")
    for what in ("descriptors", "threads"):
        if samples[what][-1] > samples[what][0]:
            wrong.append(f"{what}: {samples[what][0]}, at the end {samples[what][-1]}")
    return wrong, {
        "runs": runs, "seconds": round(time.perf_counter() - began, 1),
        "growth_bytes_per_run": round(grows, 1), "growth_allowed": GROWTH,
        **{what: [values[0], values[-1]] for what, values in samples.items()},
    }  # fmt: skip


# --- many at once -------------------------------------------------------------------------------


def many_threads(rounds: int, folder: Path) -> list[str]:
    """Run, write and read scenes from several threads; what fell."""
    alone = {name: results(sweeps.run(scene)) for name, scene in SCENES.items()}
    wrong: list[str] = []

    def work(number: int) -> None:
        own = folder / f"thread {number}"
        own.mkdir(exist_ok=True)
        try:
            kinds = _kinds_of_runs(own, alone)[:3]  # Ctrl-C goes to the main thread alone
            for turn in range(number, number + rounds):
                name = list(SCENES)[turn % len(SCENES)]
                if not kinds[turn % len(kinds)](name):
                    wrong.append(f"thread {number}, {name}: another result than alone")
        except Exception as error:
            wrong.append(f"thread {number}: {type(error).__name__}: {error}")

    with ThreadPoolExecutor(THREADS) as pool:
        list(pool.map(work, range(THREADS)))
    return wrong


def _in_process(job: tuple[int, int, Path, bool]) -> tuple[list[str], int]:
    """Write archives, each process its own or all the same one; what fell, how many refused."""
    number, rounds, folder, own = job
    limits.LARGEST_BLOCK = BLOCK
    wrong: list[str] = []
    refused = 0
    names = list(SCENES) if own else ["scalars"]
    alone = {name: results(sweeps.run(SCENES[name])) for name in names}
    output = folder / (f"process {number}.nc" if own else "one for all.nc")
    for turn in range(number, number + rounds):
        name = names[turn % len(names)]
        try:
            sweeps.stream(SCENES[name], output, overwrite=True, threads=1)
        except sweeps.SceneError as error:
            if own or "another run is writing to it" not in str(error):
                wrong.append(f"process {number}: {error}")
            refused += 1
            continue
        with sweeps.open(output) as found:
            if results(found) != alone[name]:
                wrong.append(f"process {number}, {name}: another result than alone")
    return wrong, refused


def many_processes(rounds: int, folder: Path, *, own: bool) -> tuple[list[str], int]:
    """Write archives from several processes; what fell, and how often one was refused."""
    jobs = [(number, rounds, folder, own) for number in range(PROCESSES)]
    wrong, refused = _gathered(_in_process, jobs)
    left = [p.name for p in folder.iterdir() if p.suffix == ".partial"]
    return wrong + [f"left: {name}" for name in left], refused


def _gathered(work: Callable[[Any], Any], jobs: list[Any]) -> tuple[list[str], int]:
    """What processes say: lines, and a sum."""
    said = list(in_processes(work, jobs, len(jobs)))
    return [line for lines, _ in said for line in lines], sum(count for _, count in said)


# --- readers beside a writer --------------------------------------------------------------------

OLD, NEW = SCENES["scalars"], {**SCENES["scalars"], "set": {"load": 30}}

FEW_READS = 20
"""So few reads of a slow reader may all find the same archive."""


def _read(job: tuple[int, Path]) -> tuple[list[str], int]:
    """Read an archive again and again; each must be the old one or the new one."""
    number, folder = job
    wrong: list[str] = []
    reads, seen = 0, set()
    known = [results(sweeps.run(scene)) for scene in (OLD, NEW)]
    (folder / f"ready {number}").touch()
    while not (folder / "ends").exists() or not reads:
        with sweeps.open(folder / "read.nc") as found:
            values, new = results(found), '"load"' in found.attrs["scene"]
        reads += 1
        if values not in known:
            wrong.append("a reader saw neither the old archive nor the new one")
        elif values != known[new]:
            wrong.append("a reader saw the scene of one archive with results of the other")
        seen.add(new)
    if len(seen) < 2 and reads >= FEW_READS:
        wrong.append("a reader saw only one of the two archives")
    return wrong, reads


def readers_beside_a_writer(replacements: int, folder: Path) -> tuple[list[str], int]:
    """Replace an archive again and again while others read it; what fell, and how many reads."""
    output, readers = folder / "read.nc", PROCESSES - 1
    sweeps.stream(OLD, output)

    def write() -> None:
        until = time.monotonic() + 600.0
        while len(list(folder.glob("ready *"))) < readers and time.monotonic() < until:
            time.sleep(0.1)
        for number in range(replacements):
            sweeps.stream((NEW, OLD)[number % 2], output, overwrite=True, threads=1)
        (folder / "ends").touch()

    writer = threading.Thread(target=write)
    writer.start()
    try:
        return _gathered(_read, [(n, folder) for n in range(readers)])
    finally:
        (folder / "ends").touch()
        writer.join()


# --- all of it ----------------------------------------------------------------------------------


def work(folder: Path, given: Any) -> dict[str, Any]:
    """All of it; figures, and what fell."""
    parts = {name: folder / name for name in ("one", "threads", "own", "same", "readers")}
    for part in parts.values():
        part.mkdir()
    with mock.patch.object(limits, "LARGEST_BLOCK", BLOCK), temporary_files_apart(folder):
        wrong, figures = one_process(given.runs, parts["one"])
        wrong += many_threads(given.rounds, parts["threads"])
        wrong += many_processes(given.rounds, parts["own"], own=True)[0]
        same, refused = many_processes(given.rounds, parts["same"], own=False)
        beside, reads = readers_beside_a_writer(given.replacements, parts["readers"])
    return {
        **figures, "threads_at_once": THREADS, "processes_at_once": PROCESSES,
        "rounds_each": given.rounds, "refused_on_one_output": refused,
        "replacements": given.replacements, "reads_beside_a_writer": reads,
        "wrong": wrong + same + beside,
    }  # fmt: skip


def main(arguments: Sequence[str]) -> int:
    """Run all of it."""
    return campaign("soak", __doc__, arguments, work, runs=2000, rounds=60, replacements=400)
