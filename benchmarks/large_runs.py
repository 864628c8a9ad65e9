"""A large sweep, killed runs and killed workers.

No finished block of a killed run may be written again, and the variables of every archive must be
those of an undisturbed run, to the byte.
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
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import netCDF4
import numpy as np
import psutil

from benchmarks.command import ROOT, campaign, log
from benchmarks.tables import save, toml_text
from sweeps.base.errors import size_text

BLOCK = 1e6
"""Bytes of a block of the runs that are killed: many blocks of few designs."""

COMMAND = """
import sys
from sweeps.running.compute import limits
limits.LARGEST_BLOCK = min(limits.LARGEST_BLOCK, float(sys.argv.pop(1)))
from sweeps.cli.main import main
main()
"""

WORKERS = ("--scheduler", "local:2")

Rows = list[list[str]]


def scene_text(designs: int) -> str:
    """A product of four axes with about so many designs, and four scalar quantities."""
    ratios, loads = min(50, max(2, designs // 10_000)), 10
    rest = max(4, designs // (ratios * loads))
    speeds = max(2, round(math.sqrt(rest / 2)))
    inertias = max(2, round(rest / speeds))
    return toml_text({
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
    with netCDF4.Dataset(output) as file:
        count = int(file["delta"].size)
    size, rate = output.stat().st_size, count / (float(words[1]) + float(words[4])) / 1e6
    resident = usage.ru_maxrss * (1 if sys.platform == "darwin" else 1024)
    output.unlink()
    body = [
        ["designs, four scalar quantities and the status, from the command line", str(count)],
        ["--memory", memory],
        ["archive", size_text(size)],
        ["largest resident memory, libraries included (required: less than 1 GB)",
         size_text(resident)],
        ["whole run", f"{wall:.1f} s"],
        ["computing, with blocks written meanwhile", f"{words[1]} s"],
        ["assembling and syncing the archive", f"{words[4]} s"],
        ["throughput of both steps", f"{rate:.2f} million designs/s"],
    ]  # fmt: skip
    return body, {"designs": count, "memory": memory, "archive_bytes": size,
                  "resident_bytes": resident}  # fmt: skip


class Runs:
    """Runs of one scene in a folder that are killed and completed; what was kept and lost."""

    def __init__(self, designs: int, folder: Path) -> None:
        self.folder, self.output = folder, folder / "out.nc"
        self.partial = folder / "out.nc.partial"
        (folder / "scene.toml").write_text(scene_text(designs))
        self.lost: list[str] = []
        self.kept: list[int] = []
        self.clear()
        for _ in range(2):  # the first one compiles
            began = time.perf_counter()
            process = self.start("--overwrite")
            self.wait(process)
            self.loading = time.perf_counter() - began
            said, _ = process.communicate()
            self.took = time.perf_counter() - began
        if not self.output.exists():
            raise RuntimeError(said)
        self.expected = variables(self.output)
        self.clear()

    def start(self, *more: str) -> subprocess.Popen[str]:
        """Start a run."""
        return start("run", "scene.toml", "-o", "out.nc", *more, folder=self.folder)

    def wait(self, process: subprocess.Popen[str], blocks: int = 0) -> None:
        """Wait until a run shows and has so many blocks, or ends."""
        header = self.partial / "run.json"
        while process.poll() is None and not (header.exists() and len(self.blocks()) >= blocks):
            time.sleep(0.002)

    def clear(self) -> None:
        """Remove what a run has left."""
        self.output.unlink(missing_ok=True)
        shutil.rmtree(self.partial, ignore_errors=True)

    def blocks(self) -> dict[str, int]:
        """Finished blocks, and when they were written."""
        found = {}
        for path in self.partial.glob("block-*.bin"):
            with contextlib.suppress(OSError):  # all is done by now
                found[path.name] = path.stat().st_mtime_ns
        return found

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
        self.lost += [f"{what}: {each}" for each in wrong]
        self.kept.append(len(kept))
        self.clear()

    def rows(self) -> Rows:
        """What was found."""
        return [
            ["runs", str(len(self.kept))],
            ["a run that is not killed", f"{self.took:.1f} s"],
            ["finished blocks found", str(sum(self.kept))],
            ["lost", "; ".join(self.lost) or "nothing"],
        ]


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


def kills(designs: int, count: int, seed: int, folder: Path) -> Runs:
    """Kill runs, every third twice; resume them, and compare the archives.

    Of ten runs, one is killed while the program starts, nine evenly between then and its end.
    """
    chance, runs = random.Random(seed), Runs(designs, folder)
    for kill in range(count):
        log(f"kill {kill + 1} of {count}")
        for again in range(2 if kill % 3 == 2 else 1):
            process = runs.start(*["--resume"] * again)
            moment = chance.random() * runs.loading
            if kill % 10:
                runs.wait(process)
                # When it resumes, what was there before is no sign of it.
                moment = chance.random() * (runs.took - runs.loading) + again * runs.loading
            with contextlib.suppress(subprocess.TimeoutExpired):
                process.wait(moment)
            process.kill()
            process.communicate()
        kept = runs.blocks()
        runs.completed(f"kill {kill}", runs.start("--resume"), kept)
    return runs


def killed_workers(designs: int, count: int, seed: int, folder: Path) -> Runs:
    """Kill one of the processes of a run on several, after a number of blocks drawn evenly.

    A run that ended before its kill came is run again.
    """
    chance, runs = random.Random(seed), Runs(designs, folder)
    for _ in range(10 * count):
        if len(runs.kept) == count:
            return runs
        log(f"worker {len(runs.kept) + 1} of {count}")
        process = runs.start(*WORKERS)
        runs.wait(process)
        header = runs.partial / "run.json"
        most = json.loads(header.read_text())["blocks"] if header.exists() else 0
        runs.wait(process, chance.randrange(1, max(2, most - 2)))
        kept = runs.blocks()
        try:
            children = psutil.Process(process.pid).children(recursive=True)
            workers = [each for each in children if "spawn_main" in " ".join(each.cmdline())]
            chance.choice(workers).kill()
        except (IndexError, psutil.NoSuchProcess):
            process.communicate()
            runs.clear()
            continue
        runs.completed(f"worker {len(runs.kept)}", process, kept)
    raise RuntimeError("runs end before a worker can be killed: give them more designs")


def work(folder: Path, given: Any) -> dict[str, Any]:
    """All of it; the table lies beside the figures."""
    sweep, figures = measured_sweep(given.designs, given.memory, folder)
    found = kills(given.kill_designs, given.kills, given.seed, folder)
    cluster = killed_workers(given.kill_designs, given.workers_killed, given.seed, folder)
    parts = {
        "a sweep larger than its memory": sweep, "killed runs": found.rows(),
        "killed workers": cluster.rows(),
    }  # fmt: skip
    body = [[part, *row] for part, rows in parts.items() for row in rows]
    save(given.output.with_suffix(".csv"), ["part", "what", "how much"], body)
    return {
        **figures, "runs_killed": len(found.kept), "blocks_found": sum(found.kept),
        "lost": len(found.lost), "workers_killed": len(cluster.kept),
        "lost_by_workers": len(cluster.lost), "wrong": found.lost + cluster.lost,
    }  # fmt: skip


def main(arguments: Sequence[str]) -> int:
    """Run all of it."""
    return campaign(
        "large-runs", __doc__, arguments, work, designs=100_000_000, memory="500MB", kills=100,
        kill_designs=500_000, workers_killed=10, seed=1,
    )  # fmt: skip
