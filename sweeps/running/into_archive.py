"""Sweeps larger than memory: blocks are computed, written as they are done, and put together.

While one block is computed, the one before is written by a thread of its own. Finished blocks are
files (`sweeps.archive.partial`), so a run that is killed has lost nothing but the unfinished ones.
When all are there, they are laid into one netCDF file under a temporary name, which is renamed. A
run of one block writes no block: it goes into the file at once. Where there is a scheduler, its
workers compute and write the blocks (`sweeps.running.cluster`); all else is the same.
"""

from __future__ import annotations

import errno
import json
import math
import shutil
import sys
import time
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import ExitStack
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt
import psutil

from engine_dyn.status import MEANINGS
from engine_dyn.types import Integers
from sweeps.archive import netcdf
from sweeps.archive.labels import Labels, describe, to_file_units
from sweeps.archive.netcdf import slabs
from sweeps.archive.partial import Damaged, Partial
from sweeps.archive.provenance import (
    check_identity,
    differences,
    identity,
    kind_differences,
    machine_kind,
)
from sweeps.errors import SceneError, counted, one_line, size_text
from sweeps.planning.blocks import Block, along, block_count, blocks, cut_to, holds
from sweeps.planning.plan import Plan, make_plan
from sweeps.reading.netcdf_files import opened_archive
from sweeps.running.in_memory import computed
from sweeps.scene.model import Scene
from sweeps.scene.reading import read_scene

if TYPE_CHECKING:
    from sweeps.running.cluster import Workers

__all__ = [
    "Finished",
    "Options",
    "Stopped",
    "archive_bytes",
    "block_bytes",
    "check_room",
    "in_file",
    "run",
    "stopped",
    "stream",
]

LARGEST_BLOCK = 64e6
"""Bytes of the arrays of one block, about: larger ones are not quicker."""

SMALLEST_BLOCK = 4e6

AT_ONCE = 4
"""Times the arrays of one block that exist: computed once for all, computed, written, kernels'."""

TRIES = 3
"""How often blocks that turn out to be damaged are computed again."""

BESIDE = 0.03
"""Share of an archive that is neither results nor coordinates, at most: see `archive.WASTE`."""

_COUNTED = 1_000_000
"""Outcomes that are counted at a time."""

_NO_ROOM = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)


class Stopped(Exception):
    """A run that did not come to its end; the message says how to go on."""


class Lost(Exception):
    """Those who compute cannot go on; the message says why."""


@dataclass(frozen=True)
class Options:
    """How a run writes its archive.

    Parameters
    ----------
    resume : bool
        Complete an interrupted run; start where there is none.
    overwrite : bool
        Replace an archive, and begin an interrupted run again.
    memory : float, optional
        Bytes that arrays and buffers may take beyond the loaded libraries.
    threads : int, optional
        As many as the machine has processors, unless given.
    progress : bool
        Show a progress bar.
    level : int, optional
        Of compression, 0 to 9; that of the archives that it is made from, or none.
    single : bool
        Results in 32 bits.
    command : str
        The command line, for the archive.
    again : str
        The command that goes on with this run, for messages.
    scheduler : str
        Address of a dask scheduler whose workers compute, or `local:N` for N processes.
    tell : callable
        Gets a line where one has to wait for others.
    """

    resume: bool = False
    overwrite: bool = False
    memory: float | None = None
    threads: int | None = None
    progress: bool = False
    level: int | None = None
    single: bool = False
    command: str = ""
    again: str = "the same command with --resume"
    scheduler: str = ""
    tell: Callable[[str], None] = lambda _: None


@dataclass
class Finished:
    """What a run did: outcomes by their codes, blocks, seconds."""

    codes: Integers = field(default_factory=lambda: np.zeros(len(MEANINGS), dtype=np.int64))
    blocks: int = 1
    before: int = 0
    computing: float = 0.0
    writing: float = 0.0
    already: bool = False

    @property
    def outcomes(self) -> dict[str, int]:
        """Number of designs of each outcome, in the order of the codes; those that there are."""
        return {name: int(n) for name, n in zip(MEANINGS, self.codes, strict=True) if n}

    def count(self, status: npt.NDArray[Any]) -> None:
        """Add the outcomes of some designs."""
        codes = status.reshape(-1)
        for begin in range(0, codes.size, _COUNTED):
            # Piece by piece: counting makes an index of eight bytes out of each code.
            self.codes += np.bincount(codes[begin : begin + _COUNTED], minlength=len(MEANINGS))


def stream(
    scene: str | Path | Mapping[str, Any] | Scene,
    output: str | Path,
    *,
    resume: bool = False,
    overwrite: bool = False,
    memory: float | None = None,
    threads: int | None = None,
    scheduler: str = "",
    compression: int = 0,
    single: bool = False,
    progress: bool = False,
) -> Finished:
    """Run a scene into an archive, block by block, as the command does.

    Parameters
    ----------
    scene : str, Path, dict or Scene
        See `sweeps.run`.
    output : str or Path
        The archive to write; `sweeps.open` opens it.
    resume : bool
        Complete an interrupted run; start where there is none.
    overwrite : bool
        Replace an archive, and begin an interrupted run again.
    memory : float, optional
        Bytes that arrays and buffers may take beyond the loaded libraries.
    threads : int, optional
        As many as the machine has processors, unless given.
    scheduler : str
        Address of a dask scheduler whose workers compute the blocks, such as
        `cluster.scheduler_address`, or `local:N` for N processes of this machine. A program that
        starts processes needs the usual ``if __name__ == "__main__":``.
    compression : int
        0 (none) to 9.
    single : bool
        Results in 32 bits.
    progress : bool
        Show a progress bar.

    Returns
    -------
    Finished
        Outcomes, number of blocks, seconds.

    Raises
    ------
    SceneError, Stopped, OSError
        See `run` of this module.
    """
    options = Options(
        resume=resume, overwrite=overwrite, memory=memory, threads=threads, scheduler=scheduler,
        level=compression, single=single, progress=progress,
        again="the same with resume=True",
    )  # fmt: skip
    return run(make_plan(read_scene(scene)), Path(output), options)


def run(plan: Plan, output: Path, options: Options) -> Finished:
    """Compute a plan into an archive, in bounded memory.

    Raises
    ------
    SceneError
        Where the archive does not fit the disk, or the run not into the memory that it may take;
        where the output exists, is being written by another run, or is an interrupted run that was
        not asked to be resumed, or one of something else; where workers cannot be used.
    Stopped
        Where it was interrupted or could not be written, with how to go on.
    OSError
        Where nothing can be written at all.
    """
    output.parent.mkdir(parents=True, exist_ok=True)
    here = Partial.of(output)
    now = identity(plan, numbers="float32" if options.single else "float64")
    with here.locked(output):
        try:
            if options.resume and not options.overwrite and output.exists():
                done = _already(plan, output, now)
                if not here.adds():
                    here.remove()
                return done
            if output.exists() and not options.overwrite:
                raise SceneError(f"{output}: exists; use --overwrite to replace it")
            with ExitStack() as stack:
                workers = None
                if options.scheduler:
                    from sweeps.running.cluster import connected

                    workers = stack.enter_context(connected(options.scheduler, options.tell))
                return _run(plan, output, options, here, now, workers)
        finally:
            if not here.finished() and not here.adds():
                here.remove()


def _run(
    plan: Plan, output: Path, options: Options, here: Partial, now: dict[str, Any],
    workers: Workers | None,
) -> Finished:  # fmt: skip
    kind = machine_kind() if workers is None else workers.kind
    header = here.header()
    if header is not None and here.finished():
        if options.resume:
            try:
                check_identity(header["identity"])
                found = differences(header["identity"], now)
                found += kind_differences(header.get("kind", {}), kind)
            except (ValueError, KeyError, TypeError, AttributeError):
                found = ["what it says of itself is damaged"]
            if found:
                raise SceneError(
                    f"{here.path}: cannot be resumed, it is a run of something else: "
                    f"{'; '.join(found)}; --overwrite instead of --resume begins again"
                )
        elif options.overwrite:
            header = None
        else:
            raise SceneError(
                f"{here.path}: holds an interrupted run; --resume completes it, --overwrite begins "
                "again"
            )
    else:
        header = None
    limit = block_bytes(plan, options.memory)
    if header is None:
        here.clear()
        if workers is not None:
            limit = workers.block_bytes(plan, limit)
        lengths = cut_to(plan, limit)
    else:
        here.tidy()
        lengths = {str(d): int(n) for d, n in header["lengths"].items()}
        if options.memory is not None and header["block_bytes"] > limit:
            raise SceneError(
                f"{here.path}: cannot be resumed with --memory {size_text(options.memory)}: its "
                "blocks are larger; give as much as the first time"
            )
    count = block_count(plan, lengths)
    done = Finished(blocks=count, before=len(here.finished()))
    tight = _check_disk(plan, output, options, count, done.before)
    whole = count == 1 and workers is None and header is None
    if header is None and not whole:
        started = time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime())
        here.begin(
            {
                "identity": now,
                "kind": kind,
                "lengths": lengths,
                "blocks": count,
                "block_bytes": limit,
                "title": plan.scene.title,
                "designs": plan.designs,
                "output": output.name,
                "command_line": options.command,
                "started": started,
            }
        )
    try:
        if whole:
            _run_whole(plan, output, options, here, done)
        else:
            _run_blocks(plan, output, options, here, lengths, done, workers, tight=tight)
    except KeyboardInterrupt:
        raise Stopped(f"interrupted; {_left(here, count, options)}") from None
    except Lost as error:
        raise Stopped(f"{error}; {_left(here, count, options)}") from None
    except (OSError, RuntimeError) as error:
        raise stopped(error, output, _left(here, count, options)) from None
    finally:
        here.archive.unlink(missing_ok=True)
    here.remove()
    return done


def _left(here: Partial, count: int, options: Options) -> str:
    """What an interrupted run leaves, and how to go on."""
    finished = len(here.finished())
    if not finished:
        return "nothing written"
    return (
        f"{finished} of {counted(count, 'block')} are finished in {here.path}; to go on: "
        f"{options.again}"
    )


def stopped(error: Exception, output: Path, left: str) -> Exception:
    """What to raise for an error of a run: `Stopped`, where the disk is to blame."""
    if not _about_disk(error):
        return error
    reason = one_line(getattr(error, "strerror", None) or error, 200)
    free = size_text(shutil.disk_usage(output.parent).free)
    return Stopped(f"{output}: cannot be written ({reason}; {free} are free); {left}")


def _about_disk(error: BaseException) -> bool:
    """Whether a write failed for want of room; netCDF's errors do not tell."""
    return (
        isinstance(error, OSError)
        and (error.errno in (*_NO_ROOM, errno.EIO) or (error.errno or 0) < 0)
    ) or "NetCDF" in str(error)


# --- sizes --------------------------------------------------------------------------------------


def block_bytes(plan: Plan, memory: float | None) -> float:
    """Bytes that the arrays of one block may take, so that a run takes no more than `memory`.

    Raises
    ------
    SceneError
        Where that leaves nothing, or the machine has less.
    """
    given = [np.asarray(v.data).nbytes for v in plan.leaves.values() if v.dims]
    fixed = float(sum(given))
    limit = LARGEST_BLOCK
    if memory is not None:
        limit = min(limit, (memory - fixed) / AT_ONCE)
        smallest = min(SMALLEST_BLOCK, LARGEST_BLOCK)
        if limit < smallest:
            raise SceneError(
                f"{plan.name}: --memory {size_text(memory)}: {counted(plan.designs, 'design')} "
                f"with columns of {size_text(fixed)} need at least "
                f"{size_text(fixed + AT_ONCE * smallest)}"
            )
    need, free = fixed + AT_ONCE * limit, psutil.virtual_memory().available
    if need > 0.9 * free:
        raise SceneError(
            f"{plan.name}: {counted(plan.designs, 'design')} need {size_text(need)} of memory, "
            f"{size_text(free)} are free"
        )
    return limit


def archive_bytes(plan: Plan, *, single: bool = False) -> int:
    """Size of an archive's variables and coordinates, uncompressed."""
    total = 0
    for name in plan.outputs:
        size = math.prod(plan.sizes[d] for d in plan.dims(name))
        total += size * (1 if name == "status" else 4 if single else 8)
    return total + 8 * sum(plan.sizes[d] for d in plan.scene.dimensions)


def _check_disk(plan: Plan, output: Path, options: Options, count: int, before: int) -> bool:
    """Refuse what does not fit the disk, before anything is computed.

    Returns whether it fits but for the room that blocks and archive take together: then blocks
    are given up as they are put together.
    """
    size = archive_bytes(plan, single=options.single)
    if count == 1:
        check_room(plan, output, size, size)
        return False
    missing = size * (count - before) / count
    check_room(plan, output, size, missing + (BESIDE + 1.0 / count) * size)
    return size + missing > shutil.disk_usage(output.parent).free


def check_room(plan: Plan, output: Path, size: float, need: float) -> None:
    """Refuse what does not fit the disk.

    Raises
    ------
    SceneError
        With the size, and what is free.
    """
    free = shutil.disk_usage(output.parent).free
    if need > free:
        raise SceneError(
            f"{plan.name}: {counted(plan.designs, 'design')} make an archive of "
            f"{size_text(size)}; {size_text(free)} are free where {output} would be; ask for fewer "
            "points or fewer quantities"
        )


# --- computing and writing ----------------------------------------------------------------------


def _labels(plan: Plan, options: Options, seconds: float, workers: Workers | None = None) -> Labels:
    return describe(
        plan, seconds=seconds, command=options.command, single=options.single,
        machine="" if workers is None else workers.text,
    )  # fmt: skip


def in_file(labels: Labels, name: str, part: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """Results as they stand in the archive."""
    variable = labels.variables[name]
    found = to_file_units(variable, part)
    if found.dtype.str[1:] == variable.kind:
        return found
    with np.errstate(over="ignore"):  # beyond 32 bits it is infinite
        return found.astype(variable.kind)


def _run_whole(plan: Plan, output: Path, options: Options, here: Partial, done: Finished) -> None:
    """Compute in one piece, straight into the file."""
    began = time.perf_counter()
    ((_, parts),) = computed(plan, {}, [{}], progress=options.progress, threads=options.threads)
    done.computing = time.perf_counter() - began
    labels = _labels(plan, options, done.computing)
    with netcdf.new(here.archive, labels, {}, level=options.level or 0) as file:
        for name in plan.outputs:
            part = in_file(labels, name, parts.pop(name))
            file.put(name, (), part)
            if name == "status":
                done.count(part)
    _publish(here, output, options)
    done.writing = time.perf_counter() - began - done.computing


def _run_blocks(
    plan: Plan, output: Path, options: Options, here: Partial, lengths: dict[str, int],
    done: Finished, workers: Workers | None, *, tight: bool,
) -> None:  # fmt: skip
    """Compute the blocks that are not there, then put all of them together."""
    for _ in range(TRIES):
        began = time.perf_counter()
        there = set(here.finished())
        missing = [(n, b) for n, b in enumerate(blocks(plan, lengths)) if n not in there]
        if missing and workers is not None:
            _compute_elsewhere(plan, options, here, missing, workers)
        elif missing:
            _compute(plan, options, here, lengths, missing)
        done.computing += time.perf_counter() - began
        began = time.perf_counter()
        done.codes[:] = 0
        labels = _labels(plan, options, done.computing, workers)
        damaged = _assemble(plan, options, here, lengths, labels, done, tight=tight)
        if not damaged:
            _publish(here, output, options)
            done.writing += time.perf_counter() - began
            return
        for number in damaged:
            here.discard(number)
        done.before -= len(damaged)
        done.writing += time.perf_counter() - began
    raise Stopped(
        f"{here.path}: blocks are damaged as soon as they are written; is the disk sound?"
    )


def _compute(
    plan: Plan, options: Options, here: Partial, lengths: dict[str, int],
    missing: list[tuple[int, Block]],
) -> None:  # fmt: skip
    """Compute blocks; each is written while the next is computed."""
    labels = _labels(plan, options, 0.0)
    results = computed(
        plan, lengths, (block for _, block in missing),
        progress=options.progress, threads=options.threads,
    )  # fmt: skip
    with ThreadPoolExecutor(1) as pool:
        # One thread, one block: what comes next waits, whether the disk or the processor is slow.
        written: Future[int] | None = None
        for (number, _), (_, parts) in zip(missing, results, strict=True):
            arrays = {name: in_file(labels, name, parts.pop(name)) for name in list(parts)}
            if written is not None:
                written.result()
            written = pool.submit(here.write, number, arrays)
        if written is not None:
            written.result()


def _compute_elsewhere(
    plan: Plan, options: Options, here: Partial, missing: list[tuple[int, Block]], workers: Workers
) -> None:
    """Have blocks computed and written by others."""
    designs = {
        number: math.prod(
            len(range(*block[d].indices(plan.sizes[d]))) if d in block else plan.sizes[d]
            for d in plan.scene.dimensions
        )
        for number, block in missing
    }
    with ExitStack() as stack:
        bar: Any = None
        if options.progress:
            from tqdm import tqdm

            bar = stack.enter_context(tqdm(
                total=sum(designs.values()), unit=" designs", unit_scale=True, delay=1.0,
                leave=False, file=sys.stderr,
            ))  # fmt: skip

        def show(number: int) -> None:
            if bar is not None:
                bar.update(designs[number])

        workers.compute(here, plan, list(designs), show)


def _assemble(
    plan: Plan, options: Options, here: Partial, lengths: Mapping[str, int], labels: Labels,
    done: Finished, *, tight: bool,
) -> list[int]:  # fmt: skip
    """Lay all blocks into one file; returns the numbers of those that are damaged.

    Where it is `tight`, each block makes room for the next.
    """
    damaged: list[int] = []
    with netcdf.new(here.archive, labels, lengths, level=options.level or 0) as file:
        for number, block, arrays in _read_ahead(plan, here, lengths, labels):
            if arrays is None:
                damaged.append(number)
                continue
            if damaged:
                continue  # the file is of no use any more, but what else is damaged is
            for name, part in arrays.items():
                file.put(name, along(labels.variables[name].dims, block), part)
            if "status" in arrays:
                done.count(arrays["status"])
            if tight:
                here.discard(number)
    return damaged


def _read_ahead(
    plan: Plan, here: Partial, lengths: Mapping[str, int], labels: Labels
) -> Iterator[tuple[int, Block, dict[str, npt.NDArray[Any]] | None]]:
    """All blocks in turn and what they hold, None if damaged; the next is read meanwhile."""

    def read(number: int, block: Block) -> dict[str, npt.NDArray[Any]] | None:
        try:
            return _read(here, number, _held(plan, labels, block))
        except Damaged:
            return None

    with ThreadPoolExecutor(1) as reader:
        before: tuple[int, Block, Future[dict[str, npt.NDArray[Any]] | None]] | None = None
        for number, block in enumerate(blocks(plan, dict(lengths))):
            this = number, block, reader.submit(read, number, block)
            if before is not None:
                yield before[0], before[1], before[2].result()
            before = this
        if before is not None:
            yield before[0], before[1], before[2].result()


def _held(plan: Plan, labels: Labels, block: Block) -> dict[str, tuple[tuple[int, ...], str]]:
    """Shape and kind of all that a block holds."""
    found = {}
    for name in plan.outputs:
        dims = plan.dims(name)
        if holds(block, dims):
            places = (block.get(d, slice(0, plan.sizes[d])) for d in dims)
            shape = tuple(place.stop - place.start for place in places)
            found[name] = shape, labels.variables[name].kind
    return found


def _read(
    here: Partial, number: int, expected: Mapping[str, tuple[tuple[int, ...], str]]
) -> dict[str, npt.NDArray[Any]]:
    """Read a block that holds what it must.

    Raises
    ------
    Damaged
        Where it does not, though its hash is right.
    """
    size = sum(math.prod(shape) * np.dtype(kind).itemsize for shape, kind in expected.values())
    arrays = here.read(number, size)
    if {n: (a.shape, a.dtype.str[1:]) for n, a in arrays.items()} != dict(expected):
        raise Damaged(f"block {number} of {here.path}: holds something else")
    return arrays


def _publish(here: Partial, output: Path, options: Options) -> None:
    """Give the archive its name, unless somebody else has taken it meanwhile."""
    if output.exists() and not options.overwrite:
        raise SceneError(
            f"{output}: exists by now; move it and use --resume, or --resume --overwrite"
        )
    netcdf.publish(here.archive, output)


# --- what is there already ----------------------------------------------------------------------


def _already(plan: Plan, output: Path, now: dict[str, Any]) -> Finished:
    """Check that a finished archive is what would be computed."""
    try:
        with opened_archive(output) as file:
            before = json.loads(file.getncattr("identity"))
            done = Finished(already=True)
            if "status" in file.variables:
                status = file.variables["status"]
                for place in slabs(status.shape, (1,) * status.ndim, 1, _COUNTED):
                    done.count(np.asarray(status[place if place else ...]))
            found = differences(before, now)
    except (OSError, RuntimeError, ValueError, AttributeError, TypeError, RecursionError) as error:
        reason = one_line(getattr(error, "strerror", None) or error, 200)
        raise SceneError(
            f"{output}: exists and is no archive that a run of this scene wrote ({reason}); "
            "--overwrite replaces it"
        ) from None
    if found:
        raise SceneError(
            f"{output}: exists and is an archive of something else: {'; '.join(found)}; "
            "--overwrite replaces it"
        )
    return done
