"""Large sweeps, killed runs and killed workers, measured: docs/reliability/large_runs.csv.

python -m benchmarks.large_runs [--designs N] [--memory SIZE] [--kills N] [--workers-killed N]
                                 [--folder F] [-o FILE]
"""

from __future__ import annotations

import argparse
import contextlib
import csv
import hashlib
import json
import math
import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import netCDF4
import numpy as np
import psutil

from benchmarks.reliability_parts import part_file, write_part
from sweeps.errors import size_text

ROOT = Path(__file__).resolve().parents[1]

QUANTITIES = ["delta", "omega_max", "omega_min", "omega_mean"]

BLOCK = 1e6
"""Bytes of a block of the runs that are killed: many blocks of few designs."""

COMMAND = """
import sys
from sweeps.running import limits
limits.LARGEST_BLOCK = min(limits.LARGEST_BLOCK, float(sys.argv.pop(1)))
from sweeps.cli.main import main
main()
"""

IN_MEMORY = """
import sys, time
from sweeps.planning.plan import make_plan
from sweeps.running.in_memory import compute
from sweeps.scene.reading import read_scene
plan = make_plan(read_scene(sys.argv[1]))
compute(make_plan(read_scene("first")))
began = time.perf_counter()
compute(plan)
print(plan.designs / (time.perf_counter() - began))
"""


def log(words: str) -> None:
    """Say what goes on."""
    print(f"{time.strftime('%H:%M:%S')}  {words}", file=sys.stderr, flush=True)


def environment() -> dict[str, str]:
    return {**os.environ, "PYTHONPATH": str(ROOT)}


def scene_text(designs: int) -> str:
    """A product of four axes with about so many designs, and four scalar quantities."""
    ratios, loads = min(50, max(2, designs // 10_000)), 10
    rest = max(4, designs // (ratios * loads))
    speeds = max(2, round(math.sqrt(rest / 2)))
    inertias = max(2, round(rest / speeds))
    return f"""\
title = "{ratios * loads * speeds * inertias} designs"
engine = "ntua"

[axes]
crank_ratio = {{ start = 0.2, stop = 0.33, num = {ratios} }}
load = {{ start = 5, stop = 75, num = {loads} }}
inertia = {{ start = 1.0, stop = 12.0, num = {inertias}, spacing = "log" }}
speed = {{ start = 1000, stop = 2000, num = {speeds} }}

[output]
quantities = {json.dumps(QUANTITIES)}
"""


def start(*arguments: str, folder: Path, block: float = BLOCK) -> subprocess.Popen[str]:
    """Start the command, with blocks of at most so many bytes."""
    return subprocess.Popen(
        [sys.executable, "-c", COMMAND, str(block), *arguments],
        cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=environment(),
    )  # fmt: skip


# --- a large sweep ------------------------------------------------------------------------------


@dataclass(frozen=True)
class Sweep:
    """What one large run took; bytes, seconds, designs a second."""

    designs: int
    blocks: str
    memory: str
    archive: int
    resident: int
    wall: float
    computing: float
    writing: float
    in_memory: float
    compared: int
    disk: float

    @property
    def rate(self) -> float:
        """Designs a second, from the first block to the archive's name."""
        return self.designs / (self.computing + self.writing)

    @property
    def disk_rate(self) -> float:
        """Designs a second at which the same disk writes and syncs the archive's bytes."""
        return self.disk / (self.archive / self.designs)

    @property
    def required(self) -> float:
        """Half of what memory, or the disk, allows."""
        return 0.5 * min(self.in_memory, self.disk_rate)


def disk_speed(folder: Path, size: int) -> float:
    """Bytes a second at which a file is written and synced."""
    piece = np.random.default_rng(1).bytes(1 << 24)
    path = folder / "speed.bin"
    began = time.perf_counter()
    with path.open("wb") as stream:
        left = size
        while left > 0:
            left -= stream.write(piece[: min(left, len(piece))])
        stream.flush()
        os.fsync(stream.fileno())
    took = time.perf_counter() - began
    path.unlink()
    return size / took


def measured_sweep(designs: int, memory: str, folder: Path) -> Sweep:
    """Run a large sweep by the command, and what it is compared with before and after it."""
    (folder / "large.toml").write_text(scene_text(designs))
    compared = min(designs, 10_000_000)
    (folder / "compared.toml").write_text(scene_text(compared))

    def in_memory() -> float:
        done = subprocess.run(
            [sys.executable, "-c", IN_MEMORY, str(folder / "compared.toml")],
            capture_output=True, text=True, check=True, env=environment(),
        )  # fmt: skip
        return float(done.stdout)

    log("kernels")
    subprocess.run(
        [sys.executable, "-c", COMMAND, "1e9", "run", "first", "-o", str(folder / "first.nc")],
        check=True, capture_output=True, env=environment(),
    )  # fmt: skip
    log(f"{compared} designs in memory")
    rates = [in_memory()]
    log(f"{designs} designs into an archive")
    output, said = folder / "large.nc", folder / "said.txt"
    began = time.perf_counter()
    with said.open("w") as stream:
        process = subprocess.Popen(
            [sys.executable, "-c", COMMAND, "1e9", "run", str(folder / "large.toml"),
             "-o", str(output), "--memory", memory],
            stdout=stream, stderr=stream, env=environment(),
        )  # fmt: skip
        _, outcome, usage = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(outcome)
    wall = time.perf_counter() - began
    text = said.read_text()
    if process.returncode:
        raise RuntimeError(text)
    line = next(line for line in text.splitlines() if "computing " in line)
    size = output.stat().st_size
    with netCDF4.Dataset(output) as file:
        count = int(file["delta"].size)
        chunks = " x ".join(str(n) for n in file["delta"].chunking())
    log("the disk, and memory again")
    disk = max(disk_speed(folder, size) for _ in range(2))
    rates.append(in_memory())
    output.unlink()
    words = line.split()
    unit = 1 if sys.platform == "darwin" else 1024
    return Sweep(
        designs=count, blocks=chunks, memory=memory, archive=size,
        resident=usage.ru_maxrss * unit, wall=wall, computing=float(words[1]),
        writing=float(words[4]), in_memory=max(rates), compared=compared, disk=disk,
    )  # fmt: skip


# --- killed runs --------------------------------------------------------------------------------


@dataclass
class Kills:
    """What was found after kills at random moments."""

    designs: int
    whole: float
    counts: dict[str, int]
    lost: list[str]
    blocks_kept: int = 0
    blocks_all: int = 0


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


def kills(designs: int, count: int, seed: int, folder: Path) -> Kills:
    """Kill runs at random moments, once or more times, resume them, and compare the archives.

    Of ten runs, one is killed while the program starts, nine between the first sign of a run and
    its end, evenly over the time that this takes.
    """
    chance = random.Random(seed)
    (folder / "scene.toml").write_text(scene_text(designs))

    def whole() -> float:
        began = time.perf_counter()
        process = start("run", "scene.toml", "-o", "whole.nc", "--overwrite", folder=folder)
        _, errors = process.communicate()
        if process.returncode:
            raise RuntimeError(errors)
        return time.perf_counter() - began

    def begun() -> bool:
        return (partial / "run.json").exists()

    def started() -> float:
        """Seconds until a run shows."""
        began = time.perf_counter()
        process = start("run", "scene.toml", "-o", "out.nc", folder=folder)
        while process.poll() is None and not begun():
            time.sleep(0.005)
        process.kill()
        process.communicate()
        shutil.rmtree(partial, ignore_errors=True)
        output.unlink(missing_ok=True)
        return time.perf_counter() - began

    output, partial = folder / "out.nc", folder / "out.nc.partial"
    whole()  # kernels
    took = whole()
    loading = started()
    expected = variables(folder / "whole.nc")
    with netCDF4.Dataset(folder / "whole.nc") as file:
        number = int(file["delta"].size)
    found = Kills(number, took, dict.fromkeys(STATES, 0), [])
    for kill in range(count):
        if kill % 10 == 0:
            log(f"kill {kill + 1} of {count}")
        resume: list[str] = []
        # Every third run is killed again while it resumes.
        for moment in [chance.random() for _ in range(2 if kill % 3 == 2 else 1)]:
            process = start("run", "scene.toml", "-o", "out.nc", *resume, folder=folder)
            wait = moment * loading
            if kill % 10:
                while process.poll() is None and not begun():
                    time.sleep(0.002)
                wait = moment * (took - loading)
                # When it resumes, what was there before is no sign of it.
                wait += loading if resume else 0.0
            try:
                process.wait(wait)
            except subprocess.TimeoutExpired:
                process.send_signal(signal.SIGKILL)
            process.communicate()
            resume = ["--resume"]
        found.counts[_state(output, partial)] += 1
        kept = {p.name: p.stat().st_mtime_ns for p in partial.glob("block-*.bin")}
        recomputed = _watched_resume(folder, partial, kept)
        if recomputed:
            found.lost.append(f"kill {kill}: {recomputed}")
        elif variables(output) != expected:
            found.lost.append(f"kill {kill}: other bytes in the variables")
        if partial.exists():
            found.lost.append(f"kill {kill}: the folder of blocks is left")
        found.blocks_kept += len(kept)
        output.unlink(missing_ok=True)
        shutil.rmtree(partial, ignore_errors=True)
    return found


STATES = {
    "nothing": "nothing yet (killed while the program started)",
    "archive": "the finished archive",
    "both": "the finished archive, and the folder of blocks beside it",
    "empty": "the folder of blocks, without a finished block",
    "blocks": "the folder of blocks, with finished blocks",
}


def _state(output: Path, partial: Path) -> str:
    if output.exists():
        with netCDF4.Dataset(output):  # readable
            return "both" if partial.exists() else "archive"
    if not partial.exists():
        return "nothing"
    return "blocks" if list(partial.glob("block-*.bin")) else "empty"


def _watched_resume(folder: Path, partial: Path, kept: dict[str, int]) -> str:
    """Resume; what went wrong, empty if nothing."""
    process = start("run", "scene.toml", "-o", "out.nc", "--resume", folder=folder)
    written = _written_again(process, partial, kept)
    _, errors = process.communicate()
    return written or (f"--resume failed: {errors}" if process.returncode else "")


def _written_again(process: subprocess.Popen[str], partial: Path, kept: dict[str, int]) -> str:
    """Watch a run to its end: which finished block it wrote once more, if any."""
    written = ""
    while process.poll() is None:
        for name, when in kept.items():
            try:
                if (partial / name).stat().st_mtime_ns != when:
                    written = f"{name} was computed again"
            except OSError:
                pass
        time.sleep(0.02)
    return written


# --- a cluster ----------------------------------------------------------------------------------


@dataclass
class Cluster:
    """What was found when workers of a local cluster were killed; seconds, numbers of blocks."""

    designs: int
    blocks: int
    local: float
    whole: float
    killed: list[float]
    kept: list[int]
    lost: list[str]


PROCESSES = 2


def workers_of(process: subprocess.Popen[str]) -> list[psutil.Process]:
    """Processes of `--scheduler local:N` that compute; none where it has ended."""
    with contextlib.suppress(psutil.NoSuchProcess):
        found = psutil.Process(process.pid).children(recursive=True)
        return [child for child in found if "spawn_main" in " ".join(child.cmdline())]
    return []


def killed_workers(designs: int, count: int, seed: int, folder: Path) -> Cluster:
    """Run a scene on processes of this machine, several times, and kill one of them each time.

    Each kill comes when a number of blocks is finished that is drawn evenly. A run that ended
    before its kill came is run again.
    """
    chance = random.Random(seed)
    (folder / "scene.toml").write_text(scene_text(designs))
    output, partial = folder / "cluster.nc", folder / "cluster.nc.partial"
    scheduler = ["--scheduler", f"local:{PROCESSES}"]

    def whole(*more: str) -> float:
        began = time.perf_counter()
        process = start(
            "run", "scene.toml", "-o", "cluster.nc", "--overwrite", *more, folder=folder
        )
        _, errors = process.communicate()
        if process.returncode:
            raise RuntimeError(errors)
        return time.perf_counter() - began

    log("runs of one process and of several, uninterrupted")
    whole()  # kernels
    local = whole()
    expected = variables(output)
    whole(*scheduler)
    found = Cluster(0, 0, local, whole(*scheduler), [], [], [])
    with netCDF4.Dataset(output) as file:
        found.designs = int(file["delta"].size)
    if variables(output) != expected:
        found.lost.append("uninterrupted: other bytes in the variables")
    tried = 0
    while len(found.killed) < count:
        tried += 1
        if tried > 10 * count:
            raise RuntimeError("runs end before a worker can be killed: give them more designs")
        kill = len(found.killed)
        log(f"worker {kill + 1} of {count}")
        output.unlink(missing_ok=True)
        began = time.perf_counter()
        process = start("run", "scene.toml", "-o", "cluster.nc", *scheduler, folder=folder)
        while process.poll() is None and not (partial / "run.json").exists():
            time.sleep(0.005)
        found.blocks = found.blocks or json.loads((partial / "run.json").read_text())["blocks"]
        wanted = chance.randrange(1, max(2, found.blocks - PROCESSES))
        while process.poll() is None and len(_blocks(partial)) < wanted:
            time.sleep(0.002)
        kept = _blocks(partial)
        try:
            chance.choice(workers_of(process)).kill()
        except (IndexError, psutil.NoSuchProcess):
            process.communicate()
            continue
        written = _written_again(process, partial, kept)
        _, errors = process.communicate()
        if process.returncode:
            found.lost.append(f"worker {kill}: {errors}")
        elif written:
            found.lost.append(f"worker {kill}: {written}")
        elif variables(output) != expected:
            found.lost.append(f"worker {kill}: other bytes in the variables")
        found.killed.append(time.perf_counter() - began)
        found.kept.append(len(kept))
    output.unlink(missing_ok=True)
    return found


def _blocks(partial: Path) -> dict[str, int]:
    """Finished blocks, and when they were written."""
    found = {}
    for path in partial.glob("block-*.bin"):
        with contextlib.suppress(OSError):  # all is done by now
            found[path.name] = path.stat().st_mtime_ns
    return found


# --- the rows ---------------------------------------------------------------------------------


def rows(sweep: Sweep, found: Kills, cluster: Cluster) -> list[list[str]]:
    """Everything measured, one fact a row: part, what, how much."""
    large, killed, workers = "a sweep larger than its memory", "killed runs", "killed workers"
    return [
        [large, "designs, four scalar quantities and the status, from the command line",
         str(sweep.designs)],
        [large, "--memory", sweep.memory],
        [large, "archive", size_text(sweep.archive)],
        [large, "chunks of a variable", sweep.blocks],
        [large, "largest resident memory, libraries included (required: less than 1 GB)",
         size_text(sweep.resident)],
        [large, "whole run", f"{sweep.wall:.1f} s"],
        [large, "computing, with blocks written meanwhile", f"{sweep.computing:.1f} s"],
        [large, "assembling and syncing the archive", f"{sweep.writing:.1f} s"],
        [large, "throughput of both steps", f"{sweep.rate / 1e6:.2f} million designs/s"],
        [large, f"in memory ({sweep.compared} designs; the better of one run before and one after)",
         f"{sweep.in_memory / 1e6:.2f} million designs/s"],
        [large, "the disk alone, writing and syncing the same bytes",
         f"{size_text(sweep.disk)}/s, {sweep.disk_rate / 1e6:.2f} million designs/s"],
        [large, "required: half of the lesser of the last two rates",
         f"{sweep.required / 1e6:.2f} million designs/s"],
        [killed, "runs", str(sum(found.counts.values()))],
        [killed, "designs of each, in many small blocks", str(found.designs)],
        [killed, "a run that is not killed", f"{found.whole:.1f} s"],
        *([killed, f"on disk after the last kill: {words}", str(found.counts[name])]
          for name, words in STATES.items()),
        [killed, "finished blocks found", str(found.blocks_kept)],
        [killed, "lost", "; ".join(found.lost) or "nothing"],
        [workers, f"designs, by --scheduler local:{PROCESSES} (dask.distributed, one thread each)",
         str(cluster.designs)],
        [workers, "blocks", str(cluster.blocks)],
        [workers, "runs in which one was killed", str(len(cluster.killed))],
        [workers, "by one process", f"{cluster.local:.1f} s"],
        [workers, f"by {PROCESSES} workers, including their start and end",
         f"{cluster.whole:.1f} s"],
        [workers, "with a worker killed",
         f"{min(cluster.killed):.1f} to {max(cluster.killed):.1f} s"],
        [workers, "blocks finished when it was killed",
         f"{min(cluster.kept)} to {max(cluster.kept)}"],
        [workers, "lost", "; ".join(cluster.lost) or "nothing"],
    ]  # fmt: skip


def save(path: Path, body: list[list[str]]) -> None:
    """Write the rows as a file."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerows([["part", "what", "how much"], *body])


def figures(sweep: Sweep, found: Kills, cluster: Cluster) -> dict[str, Any]:
    """What docs/trust.md tells of these runs."""
    return {
        "designs": sweep.designs,
        "memory": sweep.memory,
        "archive_bytes": sweep.archive,
        "resident_bytes": sweep.resident,
        "runs_killed": sum(found.counts.values()),
        "blocks_found": found.blocks_kept,
        "lost": len(found.lost),
        "workers_killed": len(cluster.kept),
        "lost_by_workers": len(cluster.lost),
    }


def main() -> None:
    """Run all of it."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.large_runs")
    parser.add_argument("--designs", type=int, default=100_000_000)
    parser.add_argument("--memory", default="500MB")
    parser.add_argument("--kills", type=int, default=100)
    parser.add_argument("--kill-designs", type=int, default=500_000)
    parser.add_argument("--workers-killed", type=int, default=10)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--folder", type=Path, help="where runs are written; a temporary folder")
    parser.add_argument(
        "-o", "--output", type=Path, default=part_file("large_runs").with_suffix(".csv")
    )
    parser.add_argument("--part", type=Path, default=part_file("large_runs"))
    options: Any = parser.parse_args()
    with tempfile.TemporaryDirectory(dir=options.folder) as name:
        folder = Path(name)
        sweep = measured_sweep(options.designs, options.memory, folder)
        found = kills(options.kill_designs, options.kills, options.seed, folder)
        cluster = killed_workers(options.kill_designs, options.workers_killed, options.seed, folder)
    save(options.output, rows(sweep, found, cluster))
    write_part(options.part, figures(sweep, found, cluster))
    print(options.output)
    if found.lost or cluster.lost:
        sys.exit(1)


if __name__ == "__main__":
    main()
