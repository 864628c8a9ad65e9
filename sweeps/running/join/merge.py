"""Archives of one scene become one: shards, archives that differ in the values of one axis.

Nothing is computed. Designs that several archives contain must have the same results in all; that
holds too for results that do not depend on the axis in which the archives differ.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from engine_dyn.types import Integers
from sweeps.base.errors import SceneError, counted
from sweeps.base.netcdf.netcdf_files import damaged_values, opened_archive
from sweeps.running.archive import netcdf
from sweeps.running.archive.contents import Contents, damage_refused, plan_of, read_contents
from sweeps.running.archive.labels import Labels, describe
from sweeps.running.archive.netcdf import open_archive, publish, slabs
from sweeps.running.archive.partial import Partial, made_folder
from sweeps.running.compute.failures import remove_folder, stopped_by_failures
from sweeps.running.compute.limits import archive_bytes, check_room
from sweeps.running.compute.options import Options
from sweeps.running.join.places import Joined, check_same, find_places
from sweeps.running.reduce.reduction import Reduction, state_in
from sweeps.scene.plan.plan import Plan


def check_shards(archives: Sequence[Contents]) -> Plan:
    """Plan of the whole scene whose shards these are; all must be given, each once."""
    first = archives[0]
    for one in archives:
        if "reduce" not in one.source or not one.piece:
            raise SceneError(
                f"{one.path}: no shard of a scene with [reduce]; only such shards are merged"
            )
    count = int(first.piece["shard"].partition("/")[2])
    numbers = [one.piece["shard"] for one in archives]
    for number in numbers:
        if numbers.count(number) > 1:
            raise SceneError(f"shard {number} is given twice, which would count its designs twice")
    missing = {f"{number}/{count}" for number in range(1, count + 1)} - set(numbers)
    if missing:
        given = ", ".join(sorted(numbers))
        raise SceneError(
            f"shards are missing: {', '.join(sorted(missing))}; given are {given} of {count} shards"
        )
    return plan_of(first)


def write_merged(
    plan: Plan, archives: Sequence[Contents], output: Path, partial: Partial, options: Options
) -> None:
    """Add the reductions of shards, and write the archive; damaged ones are refused."""
    labels = describe(plan, command=options.command, single=archives[0].single)
    whole = Reduction(plan, labels)
    for one in archives:
        with damage_refused(one.path), open_archive(one.path) as archive:
            whole.merge(state_in(archive, str(one.path)))
    whole.write(partial.archive, sum(one.attributes["seconds"] for one in archives))
    publish(partial.archive, output)


def merge(paths: Sequence[Path], output: Path, options: Options) -> Plan:
    """Join archives of one scene: all shards, or archives that differ in the values of one axis.

    Of `options`, `overwrite`, `level` and `command` count. Returned is the plan of what the new
    archive contains. Refused are archives that are not of one scene, version and kind, that lack
    something, or that have different results of one design. Raises `Stopped` where the archive
    cannot be written.
    """
    if len(paths) < 2:
        raise SceneError("merge: needs two archives or more")
    archives = [read_contents(path) for path in paths]
    reduced = any("reduce" in one.source for one in archives)
    if reduced:
        plan = check_shards(archives)
        for other in archives[1:]:
            check_same(archives[0], other, shards=True)
    else:
        joined = find_places(archives)
        plan = joined.plan
    made_folder(output.parent)
    partial = Partial.of(output)
    with partial.locked(output):
        if output.exists() and not options.overwrite:
            raise SceneError(f"{output}: exists; use --overwrite to replace it")
        if partial.header() is not None and partial.finished():
            raise SceneError(f"{partial.path}: contains an interrupted run; complete it first")
        partial.clear()
        if reduced:
            with stopped_by_failures(output, lambda: "nothing written"):
                write_merged(plan, archives, output, partial, options)
            remove_folder(partial, output)
            return plan
        size = archive_bytes(plan, single=joined.archives[0].single)
        check_room(plan, output, size, size)
        tolerance = 0.0 if joined.shards else plan.scene.tolerance
        write_joined(joined, output, partial, options, tolerance=tolerance)
        remove_folder(partial, output)
    return plan


def write_joined(
    joined: Joined, output: Path, partial: Partial, options: Options, *, tolerance: float
) -> None:
    """Copy what archives contain into one, which then gets the name of the output.

    `partial` is the folder in which it is put together. Of `options`, `level` and `command` count;
    `tolerance` is the largest relative difference between archives that have the same design.
    Archives that lack results, or contradict each other, are refused.
    """
    labels = joined.labels(options.command)
    level = joined.archives[0].level if options.level is None else options.level
    with stopped_by_failures(output, lambda: "nothing written"):
        with ExitStack() as stack, netcdf.new(partial.archive, labels, {}, level=level) as new:
            sources = [
                _Source(archive, stack.enter_context(opened_archive(archive.path)), places)
                for archive, places in zip(joined.archives, joined.places, strict=True)
            ]
            for name in joined.plan.outputs:
                _copy(name, joined.axis, labels, sources, new, tolerance)
        netcdf.publish(partial.archive, output)


@dataclass(frozen=True)
class _Source:
    """An open archive, and the places of its points along the axis."""

    archive: Contents
    file: Any
    places: Integers

    def read(
        self, name: str, place: tuple[slice, ...], axis_at: int
    ) -> tuple[Integers, npt.NDArray[Any]]:
        """Return which points of a range it has along the axis, and its values there.

        A variable without the axis (`axis_at` is -1) counts as one point.
        """
        if axis_at < 0:
            values = self._values(name, place if place else ...)
            return np.zeros(1, dtype=np.int64), values[np.newaxis]
        begin, end = place[axis_at].start, place[axis_at].stop
        own = np.flatnonzero((self.places >= begin) & (self.places < end))
        if not own.size:
            return own, np.empty(0)
        first = int(own.min())
        inside = [*place]
        inside[axis_at] = slice(first, int(own.max()) + 1)
        read = self._values(name, tuple(inside))
        return self.places[own] - begin, np.moveaxis(
            np.take(read, own - first, axis=axis_at), axis_at, 0
        )

    def _values(self, name: str, place: Any) -> npt.NDArray[Any]:
        with damaged_values(self.archive.path, name):  # A damaged archive is no failure of writing
            return np.asarray(self.file.variables[name][place])


def _copy(
    name: str, axis: str, labels: Labels, sources: Sequence[_Source], new: netcdf.Writer,
    tolerance: float,
) -> None:  # fmt: skip
    """Copy one variable, range by range; archives that share points must agree."""
    dims, shape = labels.variables[name].dims, labels.shape(name)
    kind = np.dtype(labels.variables[name].kind)
    for source in sources:
        stored = source.file.variables.get(name)
        own = tuple(len(source.places) if d == axis else labels.sizes[d] for d in dims)
        if stored is not None and stored.dimensions == dims:
            for d, there, wanted in zip(dims, stored.shape, own, strict=True):
                if there != wanted:
                    raise SceneError(
                        f"{source.archive.path}: {name} has {counted(there, d)}, where {wanted} "
                        "are joined"
                    )
        if (
            stored is None
            or stored.dimensions != dims
            or stored.shape != own
            or stored.dtype != kind
        ):
            raise SceneError(f"{source.archive.path}: has no {name} over ({', '.join(dims)})")
    axis_at = dims.index(axis) if axis in dims else -1
    for place in slabs(shape, netcdf.chunks_of(dims, shape, {}), kind.itemsize):
        extent = [s.stop - s.start for s in place]
        count = extent.pop(axis_at) if axis_at >= 0 else 1
        values = np.empty((count, *extent), dtype=kind)  # The axis comes first
        owner = np.full(count, -1)
        for number, source in enumerate(sources):
            here, theirs = source.read(name, place, axis_at)
            if not here.size:
                continue
            twice = owner[here] >= 0
            if twice.any():
                both = here[twice]
                _check_agreement(
                    name, source, sources[int(owner[both][0])],
                    theirs[twice], values[both], tolerance,
                )  # fmt: skip
            values[here[~twice]] = theirs[~twice]
            owner[here[~twice]] = number
        new.put(name, place, values[0] if axis_at < 0 else np.moveaxis(values, 0, axis_at))


def _check_agreement(
    name: str, source: _Source, first: _Source, theirs: npt.NDArray[Any], ours: npt.NDArray[Any],
    tolerance: float,
) -> None:  # fmt: skip
    """Check that two archives have the same results for the same designs."""
    if theirs.dtype.kind == "f":
        bad = ~np.isclose(theirs, ours, rtol=tolerance, atol=0.0, equal_nan=True)
    else:
        bad = theirs != ours
    if bad.any():
        place = tuple(int(i) for i in np.argwhere(bad)[0])
        raise SceneError(
            f"{source.archive.path}: {name} = {theirs[place]}, and {ours[place]} in "
            f"{first.archive.path} for the same design ({counted(int(bad.sum()), 'conflict')} at "
            "least)"
        )
