"""Sweeps larger than memory: blocks are computed, written as they are done, and put together.

While one block is computed, the one before is written by a thread of its own. Finished blocks are
files (`sweeps.running.archive.partial`), so a run that is killed has lost nothing but the
unfinished ones. When all blocks are finished, they are copied into one netCDF file under a
temporary name, which is renamed. A run of one block writes no block: its results go into the file
at once. Where there are workers (`sweeps.running.compute.cluster`), they compute and write the
blocks; all else is the same.
"""

from __future__ import annotations

import json
import math
import sys
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import nullcontext, suppress
from dataclasses import dataclass, replace
from functools import cached_property, partial
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from engine_dyn.compilation import seconds_compiling
from engine_dyn.status import MEANINGS
from sweeps.base.dimensions import OUTCOMES, STATUS
from sweeps.base.errors import SceneError, counted, one_line, printable, shown, size_text
from sweeps.base.netcdf.netcdf_files import DAMAGE, opened_archive
from sweeps.running.archive import netcdf
from sweeps.running.archive.labels import Labels, as_stored, describe
from sweeps.running.archive.netcdf import slabs
from sweeps.running.archive.partial import Damaged, Partial, made_folder
from sweeps.running.archive.provenance import (
    check_identity,
    differences,
    identity,
    kind_differences,
    machine_kind,
    machine_text,
)
from sweeps.running.archive.warnings import ATTRIBUTE
from sweeps.running.compute.cluster import DaskWorkers, connected
from sweeps.running.compute.computation import Computation
from sweeps.running.compute.failures import remove_folder, stopped_by_failures
from sweeps.running.compute.limits import block_bytes, check_disk
from sweeps.running.compute.options import Finished, Options, Stopped
from sweeps.running.compute.progress import progress_bar
from sweeps.running.compute.reduced import Units
from sweeps.scene.crossings import refused
from sweeps.scene.plan.blocks import (
    Block,
    Results,
    belongs,
    block_count,
    blocks,
    index_of,
    lengths_within,
    shape_in,
)
from sweeps.scene.plan.plan import Plan

T = TypeVar("T")

_Written = tuple[int, Block, Results | None]
"""A block with its number, and its arrays unless they are damaged."""


def run(
    plan: Plan, output: Path, options: Options, scheduler: str = "",
    tell: Callable[[str], None] = lambda _: None,
) -> Finished:  # fmt: skip
    """Compute a plan into an archive, in bounded memory.

    Parameters
    ----------
    plan : Plan
        What is computed.
    output : Path
        The archive to write.
    options : Options
        How it is written.
    scheduler : str
        Address of a dask scheduler whose workers compute the blocks, or `local:N` for N processes
        of this machine; empty for this process alone.
    tell : callable
        Gets a line where one has to wait for workers.

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
    if scheduler and options.device != "cpu":
        raise refused("a device", "a scheduler", f"device {options.device!r}")
    made_folder(output.parent)
    folder = Partial.of(output)
    now = identity(plan, numbers="float32" if options.single else "float64")
    with folder.locked(output):
        if options.resume and not options.overwrite and output.exists():
            done = _already(output, now)
            if not folder.has_added_points():
                remove_folder(folder, output)
            return done
        if output.exists() and not options.overwrite:
            raise SceneError(f"{output}: exists; use --overwrite to replace it")
        with connected(scheduler, tell) if scheduler else nullcontext() as workers:
            kind = _Run if plan.scene.reduce is None else _ReducedRun
            return kind(plan, output, options, folder, workers).complete(now)


@dataclass(frozen=True)
class _Run:
    """One run: its plan, who computes it, the archive, and the folder of its blocks."""

    plan: Plan
    output: Path
    options: Options
    partial: Partial
    workers: DaskWorkers | None

    def complete(self, now: dict[str, Any]) -> Finished:
        """Compute what is missing, and write the archive; `now` is the identity of the plan."""
        kind = machine_kind() if self.workers is None else dict(self.workers.kind)
        if self.options.device != "cpu":  # A graphics card gives other last digits
            kind["device"] = self.options.device
        header = self._interrupted(now, kind)
        lengths, limit = self._lengths(header)
        count = self._count(lengths)
        done = Finished(blocks=count, before=len(self.partial.finished()))
        compiled = seconds_compiling()
        discard = self._check_disk(count, done.before)
        one_piece = count == 1 and self.workers is None and header is None
        if header is None and not one_piece:
            self._begin(now, kind, lengths, limit)
        try:
            with stopped_by_failures(self.output, partial(self._remains, count)):
                self._write(lengths, done, one_piece=one_piece, discard=discard)
        finally:
            with suppress(OSError):  # The next run removes the folder
                self.partial.archive.unlink(missing_ok=True)
        remove_folder(self.partial, self.output)
        done.compiling = seconds_compiling() - compiled
        return done

    # --- an interrupted run --------------------------------------------------------------------

    def _interrupted(self, now: dict[str, Any], kind: dict[str, str]) -> dict[str, Any] | None:
        """Header of the interrupted run that is resumed; None where a run begins."""
        header = self.partial.header()
        if header is None or not self.partial.finished():
            return None
        if self.options.resume:
            try:
                check_identity(header["identity"])
                unequal = differences(header["identity"], now)
                unequal += kind_differences(header.get("kind", {}), kind)
            except (ValueError, KeyError, TypeError, AttributeError):
                unequal = ["its description is damaged"]
            if unequal:
                raise SceneError(
                    f"{self.partial.path}: cannot be resumed, because it belongs to a different "
                    "run: "
                    f"{'; '.join(unequal)}; use --overwrite instead of --resume to start again"
                )
            return header
        if self.options.overwrite:
            return None
        raise SceneError(
            f"{self.partial.path}: contains an interrupted run; use --resume to complete it, or "
            "--overwrite to start again"
        )

    def _lengths(self, header: dict[str, Any] | None) -> tuple[dict[str, int], float]:
        """Lengths of the blocks, as before where a run is resumed, and the limit of their bytes."""
        options = self.options
        limit = block_bytes(self.plan, options.memory)
        if header is None:
            self.partial.clear()
            if self.workers is not None:
                limit = self.workers.block_bytes(self.plan, limit)
            return lengths_within(self.plan, limit), limit
        self.partial.tidy()
        if options.memory is not None and header["block_bytes"] > limit:
            raise SceneError(
                f"{self.partial.path}: cannot be resumed with --memory "
                f"{size_text(options.memory)}: its blocks are larger; use at least the memory "
                "limit of the first run"
            )
        lengths = {str(d): int(n) for d, n in header["lengths"].items()}
        known = lengths.keys() <= self.plan.sizes.keys()
        if not known or self._count(lengths) != header["blocks"]:
            raise SceneError(
                f"{self.partial.path}: run.json is damaged: it has blocks of "
                f"{shown(header['lengths'])}, which are not {header['blocks']} of this scene; use "
                "--overwrite to start again"
            )
        return lengths, limit

    def _begin(
        self, now: dict[str, Any], kind: dict[str, str], lengths: dict[str, int], limit: float
    ) -> None:
        """Write the header of a run into its folder."""
        self.partial.begin(
            {
                "identity": now,
                "kind": kind,
                "lengths": lengths,
                "blocks": self._count(lengths),
                "block_bytes": limit,
                "title": self.plan.scene.title,
                "designs": self.plan.designs,
                "output": self.output.name,
                "command_line": self.options.command,
                "resume_command": printable(self.options.resume_command),
                "started": time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime()),
            }
        )

    def _count(self, lengths: Mapping[str, int]) -> int:
        """Number of blocks that are written."""
        return block_count(self.plan, lengths)

    def _check_disk(self, count: int, finished: int) -> bool:
        return check_disk(self.plan, self.output, count, finished, single=self.options.single)

    def _remains(self, count: int) -> str:
        """Text on the blocks that an interrupted run keeps, and the command that goes on."""
        finished = len(self.partial.finished())
        if not finished:
            return "nothing written"
        return (
            f"{finished} of {counted(count, 'block')} are finished in {self.partial.path}; to "
            f"continue: {self.options.resume_command}"
        )

    # --- computing ----------------------------------------------------------------------------

    @cached_property
    def labels(self) -> Labels:
        """Labels of the archive, without the seconds that computing took."""
        card = "" if self.options.device == "cpu" else f"{machine_text()}, {self.options.device}"
        return describe(
            self.plan, command=self.options.command, single=self.options.single,
            machine=card if self.workers is None else self.workers.text,
            full_paths=self.options.full_paths,
        )  # fmt: skip

    def _write(
        self, lengths: dict[str, int], done: Finished, *, one_piece: bool, discard: bool
    ) -> None:
        """Compute the missing blocks, then join all of them."""
        # Damaged blocks are computed again: there are three attempts in all.
        for _ in range(3):
            began = time.perf_counter()
            written = self._all_blocks(lengths, one_piece=one_piece)
            done.computing += time.perf_counter() - began
            began = time.perf_counter()
            for counts in done.codes.values():
                counts[:] = 0
            damaged = self._assemble(lengths, written, done, discard=discard)
            if not damaged:
                self._publish()
                done.writing += time.perf_counter() - began
                return
            for number in damaged:
                self.partial.discard(number)
            done.before -= len(damaged)
            done.damaged += len(damaged)
            done.writing += time.perf_counter() - began
        raise Stopped(
            f"{self.partial.path}: blocks are damaged as soon as they are written; check the disk"
        )

    def _all_blocks(self, lengths: dict[str, int], *, one_piece: bool) -> Iterable[_Written]:
        """Compute the missing blocks; return all, read one by one from the disk."""
        # A single block is never on the disk. Each of several is written while the next one is
        # computed.
        finished = set(self.partial.finished())
        every = self._every(lengths)
        missing = {n: block for n, block in every.items() if n not in finished}
        if one_piece:
            return list(self._computed(lengths, missing))
        if missing and self.workers is not None:
            self._compute_by(self.workers, missing)
        elif missing:
            done = self._computed(lengths, missing)
            writing = _one_ahead(partial(self.partial.write, n, arrays) for n, _, arrays in done)
            for _ in writing:
                pass
        return _one_ahead(partial(self._read, number, block) for number, block in every.items())

    def _every(self, lengths: Mapping[str, int]) -> dict[int, Block]:
        """All blocks by their numbers."""
        return dict(enumerate(blocks(self.plan, lengths)))

    def _designs(self, block: Block) -> int:
        """Number of designs in a block."""
        return math.prod(shape_in(self.plan, self.plan.scene.dimensions, block))

    def _computed(
        self, lengths: dict[str, int], missing: Mapping[int, Block]
    ) -> Iterator[tuple[int, Block, Results]]:
        """Compute one block after the other."""
        options = self.options
        with Computation(
            self.plan, lengths, progress=options.progress, threads=options.threads,
            device=options.device,
        ) as computation:  # fmt: skip
            for number, block in missing.items():
                yield number, block, as_stored(self.labels, computation.results(block))

    def _compute_by(self, workers: DaskWorkers, missing: Mapping[int, Block]) -> None:
        """Have blocks computed and written by workers."""
        designs = {number: self._designs(block) for number, block in missing.items()}
        with progress_bar(
            total=sum(designs.values()), unit=" designs", unit_scale=True,
            file=sys.stderr, disable=not self.options.progress,
        ) as bar:  # fmt: skip

            def show(number: int) -> None:
                bar.update(designs[number])

            workers.compute(self.partial, self.plan, list(designs), show)

    # --- joining ------------------------------------------------------------------------------

    def _assemble(
        self, lengths: Mapping[str, int], written: Iterable[_Written],
        done: Finished, *, discard: bool,
    ) -> list[int]:  # fmt: skip
        """Copy all blocks into one file; return the numbers of the damaged ones."""
        # With `discard`, each block is deleted once it has been copied.
        seconds = {"seconds": round(done.computing, 3)}
        labels = replace(self.labels, attributes={**self.labels.attributes, **seconds})
        damaged: list[int] = []
        level = self.options.level or 0
        with netcdf.new(self.partial.archive, labels, lengths, level=level) as file:
            for number, block, arrays in written:
                if arrays is None:
                    damaged.append(number)
                    continue
                if damaged:
                    # The file is useless after a damaged block, but other damaged ones are looked
                    # for
                    continue
                for name, values in arrays.items():
                    file.put(name, index_of(labels.variables[name].dims, block), values)
                for name in OUTCOMES:
                    if name in arrays:
                        done.count(name, arrays[name])
                if discard:
                    self.partial.discard(number)
            done.warnings = tuple(file.warnings.splitlines())
        return damaged

    def _read(self, number: int, block: Block) -> _Written:
        """Read the arrays of a block; None where they are damaged, or do not belong to the plan."""
        # Another program may have written other arrays with the right hash.
        expected = {}
        for name in self.plan.outputs:
            dims = self.plan.dims(name)
            if belongs(block, dims):
                kind = self.labels.variables[name].kind
                expected[name] = shape_in(self.plan, dims, block), kind
        size = sum(math.prod(shape) * np.dtype(kind).itemsize for shape, kind in expected.values())
        try:
            arrays = self.partial.read(number, size)
        except Damaged:
            return number, block, None
        layout = {name: (array.shape, array.dtype.str[1:]) for name, array in arrays.items()}
        return number, block, arrays if layout == expected else None

    def _publish(self) -> None:
        """Give the archive its name, unless such a file exists by now."""
        if self.output.exists() and not self.options.overwrite:
            raise SceneError(
                f"{self.output}: has been created in the meantime; move it and use --resume, or "
                "use --resume --overwrite"
            )
        netcdf.publish(self.partial.archive, self.output)


class _ReducedRun(_Run):
    """A run whose blocks are reductions of units: see `sweeps.running.compute.reduced`."""

    def _units(self, lengths: Mapping[str, int]) -> Units:
        given = self.options
        return Units(
            self.plan, lengths, labels=self.labels, threads=given.threads, device=given.device,
            progress=given.progress)  # fmt: skip

    def _count(self, lengths: Mapping[str, int]) -> int:
        return len(self._units(lengths))

    def _check_disk(self, count: int, finished: int) -> bool:
        return False  # Few designs are kept: the room on the disk is not checked

    def _every(self, lengths: Mapping[str, int]) -> dict[int, Block]:
        return {number: {} for number in range(self._count(lengths))}

    def _designs(self, block: Block) -> int:
        return 1

    def _computed(
        self, lengths: dict[str, int], missing: Mapping[int, Block]
    ) -> Iterator[tuple[int, Block, Results]]:
        for number, state in self._units(lengths).states([*missing]):
            yield number, {}, state

    def _read(self, number: int, block: Block) -> _Written:
        try:
            return number, block, self.partial.read(number)
        except Damaged:
            return number, block, None

    def _assemble(
        self, lengths: Mapping[str, int], written: Iterable[_Written],
        done: Finished, *, discard: bool,
    ) -> list[int]:  # fmt: skip
        whole = self._units(lengths).empty()
        damaged = []
        for number, _, state in written:
            try:
                whole.merge(state or {})
            except (KeyError, ValueError, IndexError):
                damaged.append(number)
        if not damaged:
            done.codes[STATUS] += whole.outcomes.reshape(-1, len(MEANINGS)).sum(axis=0)
            done.warnings = whole.warnings
            done.found = whole.found
            whole.write(self.partial.archive, done.computing)
        return damaged


def _one_ahead(jobs: Iterable[Callable[[], T]]) -> Iterator[T]:
    """Results of jobs in their order; a thread does each job while the result before it is used."""
    # There is one thread and one job: the next job waits, whether disk or processor is slow.
    with ThreadPoolExecutor(1) as pool:
        before: Future[T] | None = None
        for job in jobs:
            this = pool.submit(job)
            if before is not None:
                yield before.result()
            before = this
        if before is not None:
            yield before.result()


def _already(output: Path, now: dict[str, Any]) -> Finished:
    """Check that a finished archive equals what would be computed."""
    try:
        with opened_archive(output) as file:
            before = json.loads(file.getncattr("identity"))
            told = getattr(file, ATTRIBUTE) if ATTRIBUTE in file.ncattrs() else ""
            done = Finished(already=True, warnings=tuple(str(told).splitlines()))
            if "outcomes" in file.variables:  # Counts of all designs; `status` has the kept ones
                counts = np.asarray(file.variables["outcomes"][...])
                codes = [MEANINGS.index(word) for word in file.variables["outcome"][...]]
                done.codes[STATUS][codes] = counts.reshape(-1, len(codes)).sum(axis=0)
            else:
                for name in {*OUTCOMES} & file.variables.keys():
                    status = file.variables[name]
                    for place in slabs(status.shape, (1,) * status.ndim, 1, 1_000_000):
                        done.count(name, np.asarray(status[place if place else ...]))
            unequal = differences(before, now)
    except DAMAGE as error:
        reason = one_line(getattr(error, "strerror", None) or error, 200)
        raise SceneError(
            f"{output}: exists and is not an archive of this scene ({reason}); "
            "use --overwrite to replace it"
        ) from None
    if unequal:
        raise SceneError(
            f"{output}: exists and is an archive of something else: {'; '.join(unequal)}; "
            "use --overwrite to replace it"
        )
    return done
