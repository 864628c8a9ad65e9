"""Archives of one scene become one: shards, archives that differ in the values of one axis.

Nothing is computed. What two archives both hold must be the same in both; that holds too for what
does not depend on the axis in which they differ.
"""

from __future__ import annotations

import json
import re
from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from engine_dyn.types import Floats, Integers
from sweeps.archive import netcdf
from sweeps.archive.contents import Held, held, plan_of, sound
from sweeps.archive.labels import Labels, describe
from sweeps.archive.netcdf import slabs
from sweeps.archive.partial import Partial
from sweeps.archive.provenance import differences, identity
from sweeps.dimensions import DESIGN
from sweeps.errors import SceneError, counted, one_line
from sweeps.planning.plan import Plan
from sweeps.planning.shards import part
from sweeps.reading.netcdf_files import opened_archive
from sweeps.running.into_archive import Options, Stopped, archive_bytes, check_room, run, stopped

__all__ = ["Parts", "extend", "merge", "together"]

Places = Integers


def merge(paths: Sequence[Path], output: Path, options: Options) -> Plan:
    """Join archives of one scene.

    Parameters
    ----------
    paths : sequence of Path
        All shards of a scene, or archives that differ in the values of one axis.
    output : Path
        The archive to write.
    options : Options
        `overwrite`, `level` and `command` count.

    Returns
    -------
    Plan
        Of what the new archive holds.

    Raises
    ------
    SceneError
        Where they are not of one scene, version or kind, where something is missing, or where two
        of them say different things of one design.
    Stopped
        Where the archive cannot be written.
    """
    if len(paths) < 2:
        raise SceneError("merge: needs two archives or more")
    parts = together(paths)
    shards = bool(parts.archives[0].piece)
    _write(parts.plan, parts.axis, parts.archives, parts.places, output, options, exact=shards)
    return parts.plan


@dataclass(frozen=True)
class Parts:
    """Archives of one scene, and where their points lie in the whole.

    Attributes
    ----------
    plan : Plan
        Of the whole.
    axis : str
        Along which they are joined; empty where they hold the same.
    archives : list of Held
        The parts.
    places : list of ndarray
        Of each archive, the positions of its points along the axis.
    """

    plan: Plan
    axis: str
    archives: list[Held]
    places: list[Places]

    def labels(self, options: Options) -> Labels:
        """Labels of the whole, with the history of its parts."""
        return _labels(self.plan, self.archives, options)


def together(paths: Sequence[Path]) -> Parts:
    """Find out what belongs where, without reading any results.

    Raises
    ------
    SceneError
        As `merge`, but for what archives say of one design.
    """
    archives = [held(path) for path in paths]
    first = archives[0]
    shards = bool(first.piece)
    for other in archives[1:]:
        if bool(other.piece) != shards:
            raise SceneError(
                f"{other.path}: {'a shard' if other.piece else 'no shard'}, and {first.path} is "
                f"{'one' if shards else 'none'}; merge shards first"
            )
    with sound(first.path):
        axis, plan, places = _of_shards(archives) if shards else _of_axis(archives)
    return Parts(plan, axis, archives, places)


def extend(path: Path, axis: str, values: Sequence[float], options: Options) -> Plan:
    """Add points to an axis of an archive; only these are computed.

    The archive is replaced when the new one is whole. What it held stays as it is. Where the same
    extension was interrupted before, its finished blocks are used.

    Raises
    ------
    SceneError
        Where it has no such axis, has the values already, or was made by another version; where
        another extension was interrupted, unless `options.overwrite` is set.
    Stopped
        Where it was interrupted, or cannot be written.
    """
    here = Partial.of(path)
    with here.locked(path):  # what is there now is what is extended
        if here.header() is not None and here.finished():
            raise SceneError(f"{here.path}: holds an interrupted run; complete it first")
        if options.overwrite:
            here.clear()
        try:
            return _extended(path, axis, values, options, here)
        except Stopped as error:
            reason = re.split(r"; (?=\d+ of |nothing written)", str(error))[0]
            left = ""
            if here.adds():
                left = f", what is finished is kept in {here.path}; to go on: {options.again}"
            raise Stopped(f"{reason}; {path} is as it was{left}") from None
        finally:
            if not here.adds():
                here.remove()


def _extended(
    path: Path, axis: str, values: Sequence[float], options: Options, here: Partial
) -> Plan:
    old = held(path)
    if old.piece:
        raise SceneError(f"{path}: a shard; merge all shards first")
    axes = [a for a in old.source.get("axes", {}) if _is_numbers(old, a)]
    if axis not in axes:
        raise SceneError(
            f"{path}: --axis {axis}: not an axis; must be one of {', '.join(axes) or 'none'}"
        )
    before = np.asarray(old.values[axis])
    if _added(here, axis, values) and np.isin(values, before).all():
        here.remove()  # killed when all was done but this
        return plan_of(old)
    for number, value in enumerate(values):
        if value in before:
            raise SceneError(f"{path}: --axis {axis}: {value:.12g} is on the axis already")
        if value in values[:number]:
            raise SceneError(f"{path}: --axis {axis}: {value:.12g} stands there twice; each once")
    _check_version(old, plan_of(old))
    falls = len(before) > 1 and bool((np.diff(before) < 0).all())
    union = _ordered([before, np.sort(values)[:: -1 if falls else 1]])
    whole = plan_of(old, axis=axis, values=union)
    new = np.flatnonzero(~np.isin(union, before))
    piece = json.dumps({"axis": axis, "values": len(new)})
    more = replace(options, overwrite=False, resume=True, single=old.single)
    try:
        run(part(whole, axis, new, piece), here.added, more)
    except SceneError as error:
        if not here.adds():
            raise
        raise SceneError(
            f"{here.path}: holds another extension, which was interrupted ({error}); complete that "
            "first, or use --overwrite to drop it"
        ) from None
    both = [old, held(here.added)]
    places = [_places_in(union, a.values[axis]) for a in both]
    _put_together(whole, axis, both, places, path, here, more, exact=False)
    here.remove()
    return whole


def _added(here: Partial, axis: str, values: Sequence[float]) -> bool:
    """Whether these values, and no others, are computed and wait for being added."""
    if not here.added.exists():
        return False
    try:
        found = held(here.added).values.get(axis, ())
    except SceneError:  # it cannot be read: it is computed again
        here.added.unlink()
        return False
    return np.array_equal(np.sort(np.asarray(found)), np.sort(values))


def _is_numbers(archive: Held, axis: str) -> bool:
    values = archive.values.get(axis)
    return isinstance(values, np.ndarray) and values.dtype.kind == "f"


def _check_version(archive: Held, plan: Plan) -> None:
    """Check that the numbers of an archive are those that would be computed now."""
    numbers = str(archive.identity.get("numbers"))
    found = differences(archive.identity, identity(plan, numbers=numbers))
    if found:
        raise SceneError(
            f"{archive.path}: was made otherwise than it would be now: {'; '.join(found)}; "
            "`engine-dyn rerun` makes it again"
        )


# --- what belongs where ---------------------------------------------------------------------------


def _of_shards(archives: Sequence[Held]) -> tuple[str, Plan, list[Places]]:
    """Axis along which shards are cut, the plan of the whole, and the places of each."""
    first = archives[0]
    axis, size = first.piece["axis"], int(first.piece["of"])
    places = []
    for other in archives:
        _check_same(first, other, but_part=True)
        if other.piece["axis"] != axis or other.piece["of"] != size:
            raise SceneError(f"{other.path}: a shard of another division than {first.path}")
        begin = int(other.piece["first"])
        places.append(np.arange(begin, begin + len(other.values[axis])))
    missing = size - np.unique(np.concatenate(places)).size
    if missing:
        parts = first.piece["shard"].partition("/")[2]
        have = ", ".join(sorted({a.piece["shard"] for a in archives}))
        raise SceneError(
            f"shards are missing: {counted(missing, 'point')} of {axis}; of {parts} "
            f"shards there are {have}"
        )
    whole: dict[str, Any] = dict(first.values)
    for name, values in first.values.items():
        if first.along[name] == axis:
            joined = np.empty(size, dtype=values.dtype)
            for other, here in zip(archives, places, strict=True):
                joined[here] = other.values[name]
            whole[name] = joined
    plan = plan_of(first, whole=whole)
    _check_values(plan, axis, archives, places)
    return axis, plan, places


def _check_values(plan: Plan, axis: str, archives: Sequence[Held], places: list[Places]) -> None:
    """Check that the coordinates of archives are those of the plan."""
    labels = describe(plan)
    for other, here in zip(archives, places, strict=True):
        for name, values in other.values.items():
            known = labels.coordinates.get(name)
            if known is None or known.data is None:
                continue
            expected = known.data[here] if known.dims == (axis,) else known.data
            if name == DESIGN == axis:  # a shard numbers its own designs
                continue
            if name == axis and known.data.dtype.kind == "i":  # and its own words
                continue
            if not np.array_equal(values, expected):
                raise SceneError(f"{other.path}: other values of {name} than its scene has")


def _of_axis(archives: Sequence[Held]) -> tuple[str, Plan, list[Places]]:
    """Axis in which archives differ, the plan of all, and the places of each."""
    first = archives[0]
    axes = list(first.source.get("axes", {}))
    differing = [
        axis
        for axis in axes
        if any(
            axis in other.values and not np.array_equal(other.values[axis], first.values[axis])
            for other in archives
        )
    ]
    if len(differing) > 1:
        raise SceneError(
            f"archives differ in more than one axis ({', '.join(differing)}); merge along one axis "
            "after the other"
        )
    axis = differing[0] if differing else next(iter(axes), "")
    for other in archives[1:]:
        _check_same(first, other, axis=axis)
    if not axis:
        return "", plan_of(first), [np.zeros(0, dtype=np.int64) for _ in archives]
    union = _ordered([np.asarray(other.values[axis]) for other in archives])
    plan = plan_of(first, axis=axis, values=union) if differing else plan_of(first)
    return axis, plan, [_places_in(union, other.values[axis]) for other in archives]


def _check_same(first: Held, other: Held, *, axis: str = "", but_part: bool = False) -> None:
    """Check that two archives are of one scene, version and kind."""
    left = {"part"} if but_part else set()
    one, two = (
        {key: value for key, value in a.identity.items() if key not in left} for a in (first, other)
    )
    found = differences(one, two, but=axis)
    if found:
        raise SceneError(f"{other.path}: of another scene than {first.path}: {'; '.join(found)}")


def _ordered(values: Sequence[Floats]) -> Floats:
    """All values once: sorted where each is, else in the order in which they come."""
    together = np.concatenate(values)
    if all((np.diff(v) > 0).all() for v in values):
        return np.unique(together)
    if all((np.diff(v) < 0).all() for v in values):
        return np.unique(together)[::-1]
    _, index = np.unique(together, return_index=True)
    return np.asarray(together[np.sort(index)])


def _places_in(union: Floats, values: Any) -> Places:
    order = np.argsort(union)
    return np.asarray(order[np.searchsorted(union, values, sorter=order)], dtype=np.int64)


# --- writing --------------------------------------------------------------------------------------


def _write(
    plan: Plan, axis: str, archives: Sequence[Held], places: list[Places], output: Path,
    options: Options, *, exact: bool,
) -> None:  # fmt: skip
    output.parent.mkdir(parents=True, exist_ok=True)
    here = Partial.of(output)
    with here.locked(output):
        if output.exists() and not options.overwrite:
            raise SceneError(f"{output}: exists; use --overwrite to replace it")
        if here.header() is not None and here.finished():
            raise SceneError(f"{here.path}: holds an interrupted run; complete it first")
        here.clear()
        single = archives[0].single
        try:
            size = archive_bytes(plan, single=single)
            check_room(plan, output, size, size)
            more = replace(options, single=single)
            _put_together(plan, axis, archives, places, output, here, more, exact=exact)
        finally:
            here.remove()


def _put_together(
    plan: Plan, axis: str, archives: Sequence[Held], places: list[Places], output: Path,
    here: Partial, options: Options, *, exact: bool,
) -> None:  # fmt: skip
    """Copy what archives hold into one, which then gets the name of the output."""
    labels = _labels(plan, archives, options)
    tolerance = 0.0 if exact else plan.scene.tolerance
    try:
        with (
            ExitStack() as stack,
            netcdf.new(
                here.archive,
                labels,
                {},
                level=archives[0].level if options.level is None else options.level,
            ) as new,
        ):
            sources = [
                _Source(a, stack.enter_context(opened_archive(a.path)), p)
                for a, p in zip(archives, places, strict=True)
            ]
            for name in plan.outputs:
                _copy(name, axis, labels, sources, new, tolerance)
        netcdf.publish(here.archive, output)
    except KeyboardInterrupt:
        raise Stopped("interrupted; nothing written") from None
    except (OSError, RuntimeError) as error:
        raise stopped(error, output, "nothing written") from None


def _labels(plan: Plan, archives: Sequence[Held], options: Options) -> Labels:
    """Labels of the whole, with the history of its parts."""
    seconds = sum(float(a.attributes.get("seconds", 0.0)) for a in archives)
    labels = describe(plan, seconds=seconds, command=options.command, single=options.single)
    made = str(labels.attributes["history"]).replace(" computed ", " joined ")
    told = [str(a.attributes.get("history", "")) for a in archives]
    history = "\n".join(dict.fromkeys([*"\n".join(told).splitlines(), made]))
    return replace(labels, attributes={**labels.attributes, "history": history})


@dataclass(frozen=True)
class _Source:
    """An archive that is open, and where its points lie along the axis."""

    archive: Held
    file: Any
    places: Places

    def read(
        self, name: str, place: tuple[slice, ...], along: int
    ) -> tuple[Places, npt.NDArray[Any]]:
        """Return which points of a range it has along the axis, and its values there.

        Of a variable without the axis (`along` is -1) it has the one that there is.
        """
        if along < 0:
            values = self._values(name, place if place else ...)
            return np.zeros(1, dtype=np.int64), values[np.newaxis]
        begin, end = place[along].start, place[along].stop
        own = np.flatnonzero((self.places >= begin) & (self.places < end))
        if not own.size:
            return own, np.empty(0)
        first = int(own.min())
        inside = [*place]
        inside[along] = slice(first, int(own.max()) + 1)
        read = self._values(name, tuple(inside))
        return self.places[own] - begin, np.moveaxis(
            np.take(read, own - first, axis=along), along, 0
        )

    def _values(self, name: str, place: Any) -> npt.NDArray[Any]:
        try:
            return np.asarray(self.file.variables[name][place])
        except RuntimeError as error:  # not to be taken for one of the archive that is written
            raise SceneError(
                f"{self.archive.path}: {name}: cannot be read ({one_line(error, 200)})"
            ) from None


def _copy(
    name: str, axis: str, labels: Labels, sources: Sequence[_Source], new: netcdf.Writer,
    tolerance: float,
) -> None:  # fmt: skip
    """Copy one variable, piece by piece, checking what several archives hold."""
    dims, shape = labels.variables[name].dims, labels.shape(name)
    kind = np.dtype(labels.variables[name].kind)
    for source in sources:
        found = source.file.variables.get(name)
        own = tuple(len(source.places) if d == axis else labels.sizes[d] for d in dims)
        if found is None or found.dimensions != dims or found.shape != own or found.dtype != kind:
            raise SceneError(f"{source.archive.path}: has no {name} over ({', '.join(dims)})")
    along = dims.index(axis) if axis in dims else -1
    for place in slabs(shape, netcdf.chunks_of(dims, shape, {}), kind.itemsize):
        extent = [s.stop - s.start for s in place]
        count = extent.pop(along) if along >= 0 else 1
        values = np.empty((count, *extent), dtype=kind)  # the axis comes first
        owner = np.full(count, -1)
        for number, source in enumerate(sources):
            here, theirs = source.read(name, place, along)
            twice = owner[here] >= 0
            if twice.any():
                both = here[twice]
                _check_agreement(
                    name, source, sources[int(owner[both][0])],
                    theirs[twice], values[both], tolerance,
                )  # fmt: skip
            values[here[~twice]] = theirs[~twice]
            owner[here[~twice]] = number
        new.put(name, place, values[0] if along < 0 else np.moveaxis(values, 0, along))


def _check_agreement(
    name: str, source: _Source, first: _Source, theirs: npt.NDArray[Any], ours: npt.NDArray[Any],
    tolerance: float,
) -> None:  # fmt: skip
    """Check that two archives say the same of the same designs."""
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
