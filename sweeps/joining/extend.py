"""Points are added to an axis of an archive; only these are computed."""

from __future__ import annotations

import json
import re
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import numpy as np

from sweeps.archive.contents import Contents, plan_of, read_contents
from sweeps.archive.partial import Partial
from sweeps.archive.provenance import differences, identity
from sweeps.errors import SceneError
from sweeps.joining.copying import write_joined
from sweeps.joining.places import Joined, places_in, union_of
from sweeps.planning.plan import Plan
from sweeps.planning.shards import part
from sweeps.running.into_archive import remove_folder, run
from sweeps.running.options import Options, Stopped

__all__ = ["extend"]


def extend(path: Path, axis: str, values: Sequence[float], options: Options) -> Plan:
    """Add points to an axis of an archive; only these are computed.

    The archive is replaced when the new one is complete; its results stay as they are. Where the
    same extension was interrupted before, its finished blocks are used.

    Parameters
    ----------
    path : Path
        The archive.
    axis : str
        One of its axes of numbers.
    values : sequence of float
        The points to add, in the units of the archive.
    options : Options
        How the new points are computed and written.

    Returns
    -------
    Plan
        Of what the archive contains then.

    Raises
    ------
    SceneError
        Where it has no such axis, has the values already, or was made by another version; where
        another extension was interrupted, unless `options.overwrite` is set.
    Stopped
        Where it was interrupted, or cannot be written.
    """
    partial = Partial.of(path)
    with partial.locked(path):  # what is in the archive now is what is extended
        if partial.header() is not None and partial.finished():
            raise SceneError(f"{partial.path}: holds an interrupted run; complete it first")
        if options.overwrite:
            partial.clear()
        try:
            plan = _extended(path, axis, values, options, partial)
        except Stopped as error:
            reason = re.split(r"; (?=\d+ of |nothing written)", str(error))[0]
            kept = f", what is finished is kept in {partial.path}; to go on: "
            how = f"{kept}{options.resume_command}" if _keeps(partial) else ""
            raise Stopped(f"{reason}; {path} is as it was{how}") from None
        except BaseException:
            _keeps(partial)
            raise
        remove_folder(partial, path)
        return plan


def _keeps(partial: Partial) -> bool:
    """Whether anything of an extension that failed is kept; the folder is removed if not."""
    with suppress(OSError):
        if partial.adds():
            return True
        partial.remove()
    return False


def _extended(
    path: Path, axis: str, values: Sequence[float], options: Options, partial: Partial
) -> Plan:
    old = read_contents(path)
    _check_axis(old, axis)
    before = np.asarray(old.values[axis])
    if _computed(partial, axis, values) and np.isin(values, before).all():
        return plan_of(old)  # killed when all was done but the removal of the folder
    _check_new(path, axis, values, before)
    _check_version(old, plan_of(old))
    falls = len(before) > 1 and bool((np.diff(before) < 0).all())
    union = union_of([before, np.sort(values)[:: -1 if falls else 1]])
    plan = plan_of(old, axis=axis, values=union)
    new = np.flatnonzero(~np.isin(union, before))
    piece = json.dumps({"axis": axis, "values": len(new)})
    adding = replace(options, overwrite=False, resume=True, single=old.single)
    try:
        run(part(plan, axis, new, piece), partial.added, adding)
    except SceneError as error:
        if not partial.adds():
            raise
        raise SceneError(
            f"{partial.path}: holds another extension, which was interrupted ({error}); complete "
            "that first, or use --overwrite to drop it"
        ) from None
    both = [old, read_contents(partial.added)]
    places = [places_in(union, archive.values[axis]) for archive in both]
    joined = Joined(plan, axis, both, places)
    try:
        write_joined(joined, path, partial, options, tolerance=plan.scene.tolerance)
    except SceneError as error:
        partial.remove()  # another attempt would end in the same way
        raise SceneError(f"{path}: the new points do not belong to it: {error}") from None
    return plan


def _check_axis(archive: Contents, axis: str) -> None:
    """Check that an archive is whole, and has an axis of numbers of this name."""
    if archive.piece:
        raise SceneError(f"{archive.path}: a shard; merge all shards first")
    axes = [a for a in archive.source.get("axes", {}) if _is_numbers(archive, a)]
    if axis not in axes:
        raise SceneError(
            f"{archive.path}: --axis {axis}: not an axis; must be one of "
            f"{', '.join(axes) or 'none'}"
        )


def _is_numbers(archive: Contents, axis: str) -> bool:
    values = archive.values.get(axis)
    return isinstance(values, np.ndarray) and values.dtype.kind == "f"


def _computed(partial: Partial, axis: str, values: Sequence[float]) -> bool:
    """Whether these values, and no others, are computed and wait for being added."""
    if not partial.added.exists():
        return False
    try:
        found = read_contents(partial.added).values.get(axis, ())
    except SceneError:  # it cannot be read: it is computed again
        partial.added.unlink()
        return False
    return np.array_equal(np.sort(np.asarray(found)), np.sort(values))


def _check_new(path: Path, axis: str, values: Sequence[float], before: np.ndarray) -> None:
    """Check that none of the values is on the axis, or given twice."""
    for number, value in enumerate(values):
        if value in before:
            raise SceneError(f"{path}: --axis {axis}: {value:.12g} is on the axis already")
        if value in values[:number]:
            raise SceneError(f"{path}: --axis {axis}: {value:.12g} is given twice")


def _check_version(archive: Contents, plan: Plan) -> None:
    """Check that the numbers of an archive are those that would be computed now."""
    numbers = str(archive.identity.get("numbers"))
    found = differences(archive.identity, identity(plan, numbers=numbers))
    if found:
        raise SceneError(
            f"{archive.path}: was made differently than it would be now: {'; '.join(found)}; "
            "`engine-dyn rerun` computes it again"
        )
