"""Damaged archives by the hundred thousand: none hangs, none ends with status 1 or a signal.

Damaged archives and tables of designs (see `damaged_bytes`) are read as the commands do, in
processes that stay; one that takes more than `LONGEST` seconds of the processor is killed. Freed
memory is overwritten there (glibc), so that a library that uses it fails. What went wrong is kept
in the folder, with the file. With `--first` a campaign goes on where it was stopped.

Every archive that can be opened is read as by `plot`, as by `info`, and as by one of `compare`,
`export`, `merge` and `rerun`, in turn; of `plot` nothing is drawn, of `rerun` nothing computed.
Each is first read by a fork (`forks`), then by the child of a command: to start that again after
every file that it refuses would take most of the time, and a fork refuses nearly all of these.
What the fork survives by luck, the child may not: its memory is laid out anew.
"""

from __future__ import annotations

import json
import os
import tempfile
from collections import Counter
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any
from unittest import mock

from benchmarks import command
from benchmarks.command import CPUS, ROOT
from benchmarks.fuzz.damaged_bytes import damaged, sound_files
from benchmarks.fuzz.forks import read_in_fork
from benchmarks.fuzz.hostile import COUNTS, in_one_line, refused_or_taken
from benchmarks.workers import Lost, answers
from sweeps.base.netcdf.netcdf_child import read_apart
from sweeps.base.netcdf.netcdf_files import opened_archive
from sweeps.cli.files import opened
from sweeps.running.archive.contents import part_of, plan_of, read_contents
from sweeps.scene.design_files.design_files import read_designs
from sweeps.view.figures.study import study_of

LONGEST = 20.0
"""Seconds of the processor that the reading of one file may take; of the clock, ten times that."""

BATCH = 1000
"""Files after which the counts are printed."""


def read_damaged(job: tuple[int, int]) -> Counter[str]:
    """Read the damaged file of a number and a seed; what is neither taken nor refused goes up."""
    number, seed = job
    made, before = damaged(number, seed), COUNTS["taken"]
    counts = Counter(files=1)
    with tempfile.TemporaryDirectory() as name, _in_forks():
        path = Path(name) / f"{number}.nc"
        path.write_bytes(made.data)
        if made.name.endswith("table"):
            refused_or_taken(lambda: read_designs(path, "damaged"))
        else:
            counts["opened"] += read_archive(number, path)
    counts["taken" if COUNTS["taken"] > before else "refused"] += 1
    return counts


def read_archive(number: int, path: Path) -> bool:
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

    other = path.with_name("other.nc")
    other.write_bytes(sound_files()["archive"])
    table, merged = path.with_name("table.csv"), path.with_name("merged.nc")
    others: list[Callable[[], Any]] = [
        lambda: in_one_line("compare", path, other),
        lambda: in_one_line("export", path, "-o", table, "--overwrite"),
        lambda: in_one_line("merge", path, other, "-o", merged, "--overwrite"),
        lambda: refused_or_taken(lambda: part_of(old := read_contents(path), plan_of(old))),
    ]
    opens = refused_or_taken(at_the_door)
    if opens:
        refused_or_taken(as_plot)
        in_one_line("info", path)
        in_one_line("show", path)
        others[number % len(others)]()
    elif number % 20 == 0:
        for read in others:
            read()
    return opens


def _in_forks() -> Any:
    """Read files in forks before the child of a command."""
    return mock.patch("sweeps.base.netcdf.netcdf_files.read_apart", _read_in_both)


def _read_in_both(path: Path, whole: bool = False) -> None:
    read_in_fork(path, whole)
    read_apart(path, whole)


def silent() -> None:
    """Make the sound files, and say nothing from now on."""
    sound_files()
    for stream in (1, 2):
        os.dup2(os.open(os.devnull, os.O_WRONLY), stream)


def campaign(
    folder: Path, first: int, number: int, seed: int, workers: int,
    read: Callable[[Any], Any] = read_damaged,
) -> Counter[str]:  # fmt: skip
    """Read damaged files from the first number on; how many were taken, refused and wrong."""
    folder.mkdir(parents=True, exist_ok=True)
    os.environ["MALLOC_PERTURB_"] = "165"  # of the processes: freed memory is overwritten
    counts = Counter(wrong=0)
    jobs = [(n, seed) for n in range(first, first + number)]
    for job, answer in zip(jobs, answers(read, jobs, workers, LONGEST, silent), strict=True):
        if isinstance(answer, Lost):
            counts["wrong"] += 1
            keep(folder, *job, answer.why)
        else:
            counts.update(answer)
        if (job[0] + 1) % BATCH == 0:
            print(f"number {job[0]}: {json.dumps(counts)}", flush=True)
    return counts


def keep(folder: Path, number: int, seed: int, why: str) -> None:
    """Keep what went wrong, and the file."""
    made = damaged(number, seed)
    (folder / f"{number}.nc").write_bytes(made.data)
    (folder / f"{number}.txt").write_text(f"{made.name}, {made.kind}\n{why}\n")
    print(f"{number}: {made.name}, {made.kind}: {why.strip().splitlines()[-1]}", flush=True)


def work(_: Path, given: Any) -> dict[str, Any]:
    """Read so many damaged files."""
    counts = campaign(given.folder, given.first, given.number, given.seed, given.workers)
    return {"seed": given.seed, "asked": given.number, **counts}


def main(arguments: Sequence[str]) -> int:
    """Run the campaign."""
    fast = "/dev/shm" if os.access("/dev/shm", os.W_OK) else None
    return command.campaign(
        "damage", __doc__, arguments, work, fast, first=0, number=100_000, seed=1, workers=CPUS,
        folder=ROOT / "out" / "damage",
    )  # fmt: skip
