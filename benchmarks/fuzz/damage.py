"""Damaged archives by the hundred thousand: none hangs, none ends with status 1 or a signal.

`python -m benchmarks.fuzz.damage --number 100000` makes damaged archives and tables of designs
(`benchmarks.fuzz.damaged_bytes`) and reads each as the commands do, in processes that stay; each
says which file it reads, and is killed where that takes more than `LONGEST` seconds of the
processor. Freed memory is overwritten there (glibc), so that a library that uses it fails. What
went wrong is kept in the folder, with the file. The same command goes on where it was stopped.

Every archive that can be opened is read as by `plot`, as by `info`, and as by one of `compare`,
`export`, `merge` and `rerun`, in turn; of `plot` nothing is drawn, of `rerun` nothing computed.
Each is first read by a fork of the process, in place of the child of a command: to start that again
after every file that it refuses would take most of the time.
"""

from __future__ import annotations

import faulthandler
import json
import os
import signal
import sys
import tempfile
import threading
import time
import traceback
import warnings
from collections import Counter
from collections.abc import Callable
from multiprocessing import get_context
from pathlib import Path
from typing import Any
from unittest import mock

import psutil

from benchmarks.command import CPUS, ROOT, part_file, settings, temporary_files_apart, write_part
from benchmarks.fuzz.checking import COUNTS, in_one_line, refused_or_taken
from benchmarks.fuzz.damaged_bytes import damaged, sound_files
from sweeps.archive.contents import part_of, plan_of, read_contents
from sweeps.cli.files import opened
from sweeps.figures.study import study_of
from sweeps.reading.design_files import read_designs
from sweeps.reading.netcdf_child import OPENING
from sweeps.reading.netcdf_files import opened_archive
from sweeps.reading.netcdf_whole import read_all

__all__ = ["LONGEST", "campaign", "main", "read_damaged"]

LONGEST = 20.0
"""Seconds of the processor that the reading of one file may take; of the clock, ten times that."""

CHUNK = 200
"""Files of one task of a process."""

FORK_SECONDS = 0.5
"""Seconds of the processor that a fork may read a file."""


# --- one file -------------------------------------------------------------------------------------


class Reader:
    """Reads damaged files as the commands do, in one folder."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.other = folder / "other.nc"
        self.other.write_bytes(sound_files()["archive"])
        self.counts: Counter[str] = Counter()

    def read(self, number: int, seed: int) -> None:
        """Read one damaged file; what is neither taken nor refused in one line goes up."""
        made = damaged(number, seed)
        path = self.folder / f"{number}.nc"
        path.write_bytes(made.data)
        self.counts["files"] += 1
        before = COUNTS["taken"]
        try:
            if made.name.endswith("table"):
                refused_or_taken(lambda: read_designs(path, "damaged"))
            else:
                self.as_archive(number, path)
        finally:
            path.unlink()
        self.counts["taken" if COUNTS["taken"] > before else "refused"] += 1

    def as_archive(self, number: int, path: Path) -> None:
        """Read an archive as the commands do: all values, as `info`, and as one of the others.

        All of them open it by the same door; what that refuses is seldom given to the others too.
        """

        def at_the_door() -> None:
            with opened_archive(path):
                pass

        def as_plot() -> None:
            with opened(path) as dataset:
                dataset.load()
                study_of(dataset, {})

        table, merged = self.folder / "table.csv", self.folder / "merged.nc"
        others: list[Callable[[], Any]] = [
            lambda: in_one_line("compare", path, self.other),
            lambda: in_one_line("export", path, "-o", table, "--overwrite"),
            lambda: in_one_line("merge", path, self.other, "-o", merged, "--overwrite"),
            lambda: refused_or_taken(lambda: part_of(old := read_contents(path), plan_of(old))),
        ]
        opens = refused_or_taken(at_the_door)
        self.counts["opened"] += opens
        if opens:
            refused_or_taken(as_plot)
            in_one_line("info", path)
            in_one_line("show", path)
            others[number % len(others)]()
        elif number % 20 == 0:
            for other in others:
                other()
        for made in (table, merged):
            made.unlink(missing_ok=True)


def read_damaged(numbers: range, seed: int, folder: Path) -> Counter[str]:
    """Read damaged files in this process."""
    with _in_forks():
        reader = Reader(folder)
        for number in numbers:
            reader.read(number, seed)
    return reader.counts


def _in_forks() -> Any:
    """Read files in forks of this process, in place of the child."""
    return mock.patch("sweeps.reading.netcdf_files.read_apart", _read_in_fork)


def _read_in_fork(path: Path, whole: bool = False) -> None:
    most = psutil.Process().memory_info().rss + OPENING
    with warnings.catch_warnings():
        # Of threads that the fork lacks: the library does not wait for them.
        warnings.simplefilter("ignore", DeprecationWarning)
        child = os.fork()
    if not child:
        faulthandler.disable()
        status = 1
        try:
            read_all(path, FORK_SECONDS, whole, lambda: None)
            status = 0
        finally:
            os._exit(status)
    watched = psutil.Process(child)
    while not (ended := os.waitpid(child, os.WNOHANG))[0]:
        time.sleep(0.002)
        if watched.memory_info().rss > most:
            os.kill(child, signal.SIGKILL)
    if ended[1]:
        raise OSError(22, "damaged: a fork could not read it")


# --- processes that stay --------------------------------------------------------------------------


def work(pipe: Any, seed: int) -> None:
    """Read the files of the ranges that come; say which, and what went wrong."""
    for stream in (1, 2):
        os.dup2(os.open(os.devnull, os.O_WRONLY), stream)
    with tempfile.TemporaryDirectory() as folder, _in_forks():
        reader = Reader(Path(folder))
        while True:
            for number in range(*pipe.recv()):
                pipe.send(number)
                try:
                    reader.read(number, seed)
                except Exception:
                    pipe.send((number, traceback.format_exc()[-3000:]))
            pipe.send(reader.counts)
            reader.counts.clear()


class Worker:
    """A process that reads files until it is ended."""

    def __init__(self, seed: int) -> None:
        os.environ["MALLOC_PERTURB_"] = "165"  # of the process: freed memory is overwritten
        context = get_context("spawn")
        self.pipe, theirs = context.Pipe()
        self.process = context.Process(target=work, args=(theirs, seed), daemon=True)
        self.process.start()
        theirs.close()

    def end(self) -> None:
        """Kill it and wait."""
        self.process.kill()
        self.process.join()


class Campaign:
    """Many damaged files, and what is known of them; kept in a folder."""

    def __init__(self, folder: Path, number: int, seed: int) -> None:
        folder.mkdir(parents=True, exist_ok=True)
        self.folder, self.number, self.seed = folder, number, seed
        self.lock = threading.Lock()
        self.done: set[int] = set()
        self.counts: Counter[str] = Counter()
        self.seconds = 0.0
        state = folder / "state.json"
        if state.exists():
            known = json.loads(state.read_text())
            if known["seed"] != seed:
                raise SystemExit(f"{state}: of seed {known['seed']}; name another folder")
            self.done, self.seconds = set(known["done"]), known["seconds"]
            self.counts.update(known["counts"])

    def run(self, workers: int, seconds: float) -> None:
        """Read what is left."""
        begin, before = time.monotonic(), self.seconds
        tasks = iter([n for n in range(-(-self.number // CHUNK)) if n not in self.done])

        def one() -> None:
            worker: Worker | None = None
            while time.monotonic() - begin < seconds:
                with self.lock:
                    chunk = next(tasks, None)
                if chunk is None:
                    break
                worker = self.chunk(chunk, worker)
                with self.lock:
                    self.done.add(chunk)
                    self.seconds = before + time.monotonic() - begin
                    self.save()
            if worker is not None:
                worker.end()

        threads = [threading.Thread(target=one) for _ in range(workers)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()

    def save(self) -> None:
        state = {
            "seed": self.seed, "done": sorted(self.done), "counts": self.counts,
            "seconds": self.seconds,
        }  # fmt: skip
        new = self.folder / "state.json.new"
        new.write_text(json.dumps(state))
        new.replace(self.folder / "state.json")

    def chunk(self, chunk: int, worker: Worker | None) -> Worker | None:
        """Let a process read the files of one task; another one where it dies."""
        begin, end = chunk * CHUNK, min((chunk + 1) * CHUNK, self.number)
        while begin < end:
            worker = worker or Worker(self.seed)
            worker.pipe.send((begin, end))
            failed = self.watched(worker, begin)
            if failed is None:
                return worker
            worker.end()
            worker, begin = None, failed + 1
        return worker

    def watched(self, worker: Worker, number: int) -> int | None:
        """Follow a process to the end of its task; the number of the file that stopped it."""
        process = psutil.Process(worker.process.pid)
        # The first file waits for imports and for the sound files.
        since, used, longest = time.monotonic(), 0.0, 5 * LONGEST
        first = number
        while True:
            try:
                if not worker.pipe.poll(1.0):
                    spent = sum(process.cpu_times()[:2]) - used
                    if spent > longest or time.monotonic() - since > 10 * longest:
                        self.found(number, f"more than {longest} s")
                        return number
                    continue
                said = worker.pipe.recv()
            except EOFError:
                worker.process.join()
                self.found(number, f"ended with {worker.process.exitcode}")
                return number
            if isinstance(said, tuple):
                self.found(*said)
            elif isinstance(said, Counter):
                with self.lock:
                    self.counts.update(said)
                return None
            else:
                number, since = said, time.monotonic()
                used = sum(process.cpu_times()[:2])
                longest = LONGEST * (5 if number == first else 1)

    def found(self, number: int, why: str) -> None:
        """Keep what went wrong, and the file."""
        made = damaged(number, self.seed)
        with self.lock:
            self.counts["wrong"] += 1
            (self.folder / f"{number}.nc").write_bytes(made.data)
            (self.folder / f"{number}.txt").write_text(f"{made.name}, {made.kind}\n{why}\n")
            print(f"{number}: {made.name}, {made.kind}: {why.strip().splitlines()[-1]}", flush=True)


def campaign(folder: Path, number: int, seed: int, workers: int, seconds: float) -> Counter[str]:
    """Read damaged files in processes that stay; how many were taken, refused and wrong."""
    many = Campaign(folder, number, seed)
    many.run(workers, seconds)
    counts, spent = many.counts, many.seconds
    print(f"seed {seed}: {json.dumps(counts)} in {spent:.0f} s, {workers} processes at last")
    return counts


def main() -> None:
    """Read the command line and run the campaign."""
    given = settings(
        "benchmarks.fuzz.damage", __doc__, number=100_000, seed=1, workers=CPUS,
        seconds=float("inf"), folder=ROOT / "out" / "damage", part=part_file("damage"),
    )  # fmt: skip
    fast = "/dev/shm" if os.access("/dev/shm", os.W_OK) else None
    with temporary_files_apart(fast):
        counts = campaign(given.folder, given.number, given.seed, given.workers, given.seconds)
    write_part(given.part, {"seed": given.seed, "asked": given.number, **counts})
    if counts["wrong"]:
        sys.exit(f"wrong: {counts['wrong']}; see {given.folder}")


if __name__ == "__main__":
    main()
