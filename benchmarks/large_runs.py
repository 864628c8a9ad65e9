"""Large sweeps, killed runs and killed workers, measured: docs/reliability/large_runs.csv.

python -m benchmarks.large_runs [--designs N] [--memory SIZE] [--kills N] [--workers-killed N]
                                 [--folder F] [-o FILE]
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import math
import os
import random
import shutil
import subprocess
import sys
import time
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import netCDF4
import numpy as np
import psutil

from benchmarks.command import ROOT, log, part_file, settings, temporary_files_apart, write_part
from benchmarks.tables import save, toml_text
from sweeps.errors import size_text

BLOCK = 1e6
"""Bytes of a block of the runs that are killed: many blocks of few designs."""

COMMAND = """
import sys
from sweeps.running import limits
limits.LARGEST_BLOCK = min(limits.LARGEST_BLOCK, float(sys.argv.pop(1)))
from sweeps.cli.main import main
main()
"""

Rows = list[list[str]]


def scene_text(designs: int) -> str:
    """A product of four axes with about so many designs, and four scalar quantities."""
    ratios, loads = min(50, max(2, designs // 10_000)), 10
    rest = max(4, designs // (ratios * loads))
    speeds = max(2, round(math.sqrt(rest / 2)))
    inertias = max(2, round(rest / speeds))
    return toml_text({
        "title": f"{ratios * loads * speeds * inertias} designs",
        "engine": "ntua",
        "axes": {
            "crank_ratio": {"start": 0.2, "stop": 0.33, "num": ratios},
            "load": {"start": 5, "stop": 75, "num": loads},
            "inertia": {"start": 1.0, "stop": 12.0, "num": inertias, "spacing": "log"},
            "speed": {"start": 1000, "stop": 2000, "num": speeds},
        },
        "output": {"quantities": ["delta", "omega_max", "omega_min", "omega_mean"]},
    })  # fmt: skip


def start(*arguments: str, folder: Path, block: float = BLOCK) -> subprocess.Popen[str]:
    """Start the command, with blocks of at most so many bytes."""
    return subprocess.Popen(
        [sys.executable, "-c", COMMAND, str(block), *arguments], cwd=folder, text=True,
        stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
    )  # fmt: skip


# --- a large sweep ------------------------------------------------------------------------------


def measured_sweep(designs: int, memory: str, folder: Path) -> tuple[Rows, dict[str, Any]]:
    """Run a large sweep by the command; rows of the table, and figures."""
    (folder / "large.toml").write_text(scene_text(designs))
    log("kernels")
    start("run", "first", "-o", "first.nc", folder=folder).communicate()
    log(f"{designs} designs into an archive")
    output, began = folder / "large.nc", time.perf_counter()
    process = start("run", "large.toml", "-o", "large.nc", "--memory", memory, folder=folder,
                    block=1e9)  # fmt: skip
    assert process.stdout is not None
    with process.stdout as stream:
        said = stream.read()
    _, outcome, usage = os.wait4(process.pid, 0)
    wall, process.returncode = time.perf_counter() - began, os.waitstatus_to_exitcode(outcome)
    if process.returncode:
        raise RuntimeError(said)
    # "computing 40.8 s, writing 5.7 s"
    words = next(line for line in said.splitlines() if "computing " in line).split()
    computing, writing = float(words[1]), float(words[4])
    with netCDF4.Dataset(output) as file:
        count = int(file["delta"].size)
        chunks = " x ".join(str(n) for n in file["delta"].chunking())
    size, rate = output.stat().st_size, count / (computing + writing) / 1e6
    resident = usage.ru_maxrss * (1 if sys.platform == "darwin" else 1024)
    output.unlink()
    body = [
        ["designs, four scalar quantities and the status, from the command line", str(count)],
        ["--memory", memory],
        ["archive", size_text(size)],
        ["chunks of a variable", chunks],
        ["largest resident memory, libraries included (required: less than 1 GB)",
         size_text(resident)],
        ["whole run", f"{wall:.1f} s"],
        ["computing, with blocks written meanwhile", f"{computing:.1f} s"],
        ["assembling and syncing the archive", f"{writing:.1f} s"],
        ["throughput of both steps", f"{rate:.2f} million designs/s"],
    ]  # fmt: skip
    figures = {
        "designs": count, "memory": memory, "archive_bytes": size, "resident_bytes": resident,
    }  # fmt: skip
    return body, figures


# --- killed runs and killed workers ---------------------------------------------------------------

STATES = {
    "nothing": "nothing yet (killed while the program started)",
    "archive": "the finished archive",
    "both": "the finished archive, and the folder of blocks beside it",
    "empty": "the folder of blocks, without a finished block",
    "blocks": "the folder of blocks, with finished blocks",
}

PROCESSES = 2


@dataclass
class Killed:
    """What was found after kills of runs, or of workers; seconds, numbers of blocks.

    `alone` and `whole` are seconds of a run by one process and of one as those that are killed.
    """

    designs: int
    alone: float
    whole: float
    blocks: int = 0
    lost: list[str] = field(default_factory=list)
    kept: list[int] = field(default_factory=list)
    took: list[float] = field(default_factory=list)
    counts: Counter[str] = field(default_factory=Counter)


class Runs:
    """Runs of one scene in a folder."""

    def __init__(self, designs: int, folder: Path, *more: str) -> None:
        self.folder, self.more = folder, more
        self.output, self.partial = folder / "out.nc", folder / "out.nc.partial"
        (folder / "scene.toml").write_text(scene_text(designs))
        self.whole()  # kernels
        alone = self.whole()
        self.expected = variables(self.output)
        if more:
            self.whole(*more)
        with netCDF4.Dataset(self.output) as file:
            count = int(file["delta"].size)
        self.found = Killed(count, alone, self.whole(*more) if more else alone)
        if variables(self.output) != self.expected:
            self.found.lost.append("uninterrupted: other bytes in the variables")
        self.clear()

    def start(self, *more: str) -> subprocess.Popen[str]:
        """Start a run."""
        return start("run", "scene.toml", "-o", "out.nc", *more, folder=self.folder)

    def whole(self, *more: str) -> float:
        """Seconds of an uninterrupted run."""
        began = time.perf_counter()
        process = self.start("--overwrite", *more)
        said, _ = process.communicate()
        if process.returncode:
            raise RuntimeError(said)
        return time.perf_counter() - began

    def clear(self) -> None:
        """Remove what a run has left."""
        self.output.unlink(missing_ok=True)
        shutil.rmtree(self.partial, ignore_errors=True)

    def wait(self, process: subprocess.Popen[str], blocks: int = 0) -> None:
        """Wait until a run shows and has so many blocks, or ends."""
        header = self.partial / "run.json"
        while process.poll() is None and not (header.exists() and len(self.blocks()) >= blocks):
            time.sleep(0.002)

    def blocks(self) -> dict[str, int]:
        """Finished blocks, and when they were written."""
        found = {}
        for path in self.partial.glob("block-*.bin"):
            with contextlib.suppress(OSError):  # all is done by now
                found[path.name] = path.stat().st_mtime_ns
        return found

    def state(self) -> str:
        """What is on disk."""
        if self.output.exists():
            with netCDF4.Dataset(self.output):  # readable
                return "both" if self.partial.exists() else "archive"
        if not self.partial.exists():
            return "nothing"
        return "blocks" if self.blocks() else "empty"

    def completed(self, what: str, process: subprocess.Popen[str], kept: dict[str, int]) -> None:
        """Watch a run to its end, and note what went wrong; `kept` are blocks that are finished."""
        written = set()
        while process.poll() is None:
            now = self.blocks()
            written |= {name for name, when in kept.items() if now.get(name, when) != when}
            time.sleep(0.02)
        said, _ = process.communicate()
        wrong = [f"{name} was computed again" for name in sorted(written)]
        if process.returncode:
            wrong.append(f"not completed: {said}")
        elif variables(self.output) != self.expected:
            wrong.append("other bytes in the variables")
        if self.partial.exists():
            wrong.append("the folder of blocks is left")
        self.found.lost += [f"{what}: {each}" for each in wrong]
        self.found.kept.append(len(kept))
        self.clear()


def variables(path: Path) -> str:
    """Hash of all variables of an archive."""
    digest = hashlib.sha256()
    with netCDF4.Dataset(path) as file:
        file.set_auto_maskandscale(False)
        for name in sorted(file.variables):
            values = np.asarray(file[name][...])
            digest.update(f"{name} {values.dtype} {values.shape}".encode())
            digest.update(values.tobytes() if values.dtype != object else repr(values).encode())
    return digest.hexdigest()


def kills(designs: int, count: int, seed: int, folder: Path) -> Killed:
    """Kill runs at random moments, once or more times, resume them, and compare the archives.

    Of ten runs, one is killed while the program starts, nine between the first sign of a run and
    its end, evenly over the time that this takes.
    """
    chance = random.Random(seed)
    runs = Runs(designs, folder)
    began = time.perf_counter()
    process = runs.start()
    runs.wait(process)
    process.kill()
    process.communicate()
    loading, took = time.perf_counter() - began, runs.found.whole
    runs.clear()
    for kill in range(count):
        if kill % 10 == 0:
            log(f"kill {kill + 1} of {count}")
        resume: list[str] = []
        # Every third run is killed again while it resumes.
        for moment in [chance.random() for _ in range(2 if kill % 3 == 2 else 1)]:
            process = runs.start(*resume)
            wait = moment * loading
            if kill % 10:
                runs.wait(process)
                wait = moment * (took - loading)
                # When it resumes, what was there before is no sign of it.
                wait += loading if resume else 0.0
            try:
                process.wait(wait)
            except subprocess.TimeoutExpired:
                process.kill()
            process.communicate()
            resume = ["--resume"]
        runs.found.counts[runs.state()] += 1
        kept = runs.blocks()
        runs.completed(f"kill {kill}", runs.start("--resume"), kept)
    return runs.found


def workers_of(process: subprocess.Popen[str]) -> list[psutil.Process]:
    """Processes of `--scheduler local:N` that compute; none where it has ended."""
    with contextlib.suppress(psutil.NoSuchProcess):
        found = psutil.Process(process.pid).children(recursive=True)
        return [child for child in found if "spawn_main" in " ".join(child.cmdline())]
    return []


def killed_workers(designs: int, count: int, seed: int, folder: Path) -> Killed:
    """Run a scene on processes of this machine, several times, and kill one of them each time.

    Each kill comes when a number of blocks is finished that is drawn evenly. A run that ended
    before its kill came is run again.
    """
    chance = random.Random(seed)
    log("runs of one process and of several, uninterrupted")
    scheduler = ["--scheduler", f"local:{PROCESSES}"]
    runs = Runs(designs, folder, *scheduler)
    for _ in range(10 * count):
        if len(runs.found.took) == count:
            return runs.found
        log(f"worker {len(runs.found.took) + 1} of {count}")
        began = time.perf_counter()
        process = runs.start(*scheduler)
        runs.wait(process)
        header = runs.partial / "run.json"
        runs.found.blocks = runs.found.blocks or json.loads(header.read_text())["blocks"]
        runs.wait(process, chance.randrange(1, max(2, runs.found.blocks - PROCESSES)))
        kept = runs.blocks()
        try:
            chance.choice(workers_of(process)).kill()
        except (IndexError, psutil.NoSuchProcess):
            process.communicate()
            runs.clear()
            continue
        runs.completed(f"worker {len(runs.found.took)}", process, kept)
        runs.found.took.append(time.perf_counter() - began)
    raise RuntimeError("runs end before a worker can be killed: give them more designs")


# --- the rows ---------------------------------------------------------------------------------


HEAD = ["part", "what", "how much"]


def rows_of_kills(found: Killed) -> Rows:
    """What was found after kills of runs."""
    return [
        ["runs", str(found.counts.total())],
        ["designs of each, in many small blocks", str(found.designs)],
        ["a run that is not killed", f"{found.whole:.1f} s"],
        *([f"on disk after the last kill: {words}", str(found.counts[name])]
          for name, words in STATES.items()),
        ["finished blocks found", str(sum(found.kept))],
        ["lost", "; ".join(found.lost) or "nothing"],
    ]  # fmt: skip


def rows_of_workers(found: Killed) -> Rows:
    """What was found after kills of workers."""
    return [
        [f"designs, by --scheduler local:{PROCESSES} (dask.distributed, one thread each)",
         str(found.designs)],
        ["blocks", str(found.blocks)],
        ["runs in which one was killed", str(len(found.took))],
        ["by one process", f"{found.alone:.1f} s"],
        [f"by {PROCESSES} workers, including their start and end", f"{found.whole:.1f} s"],
        ["with a worker killed", f"{min(found.took):.1f} to {max(found.took):.1f} s"],
        ["blocks finished when it was killed", f"{min(found.kept)} to {max(found.kept)}"],
        ["lost", "; ".join(found.lost) or "nothing"],
    ]  # fmt: skip


def main() -> None:
    """Run all of it."""
    part = part_file("large_runs")
    given = settings(
        "benchmarks.large_runs", __doc__, designs=100_000_000, memory="500MB", kills=100,
        kill_designs=500_000, workers_killed=10, seed=1, folder=Path,
        output=part.with_suffix(".csv"), part=part,
    )  # fmt: skip
    with temporary_files_apart(given.folder) as name:
        folder = Path(name)
        sweep, figures = measured_sweep(given.designs, given.memory, folder)
        found = kills(given.kill_designs, given.kills, given.seed, folder)
        cluster = killed_workers(given.kill_designs, given.workers_killed, given.seed, folder)
    parts = {
        "a sweep larger than its memory": sweep, "killed runs": rows_of_kills(found),
        "killed workers": rows_of_workers(cluster),
    }  # fmt: skip
    save(given.output, HEAD, [[part, *row] for part, body in parts.items() for row in body])
    write_part(given.part, {
        **figures, "runs_killed": found.counts.total(), "blocks_found": sum(found.kept),
        "lost": len(found.lost), "workers_killed": len(cluster.kept),
        "lost_by_workers": len(cluster.lost),
    })  # fmt: skip
    print(given.output)
    if found.lost or cluster.lost:
        sys.exit(1)


if __name__ == "__main__":
    main()
