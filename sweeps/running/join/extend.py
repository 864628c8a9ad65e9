"""Points are added to an axis or to the sample of an archive; only these are computed."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from engine_dyn.types import Integers
from sweeps.base.dimensions import DESIGN
from sweeps.base.errors import SceneError
from sweeps.running.archive.contents import (
    Contents,
    check_confidential,
    part_of,
    plan_of,
    read_contents,
    with_confidential,
)
from sweeps.running.archive.partial import Partial
from sweeps.running.archive.provenance import differences, identity
from sweeps.running.compute.failures import remove_folder
from sweeps.running.compute.into_archive import run
from sweeps.running.compute.options import Options, Stopped
from sweeps.running.join.merge import write_joined
from sweeps.running.join.places import Joined, places_in, union_of
from sweeps.scene.crossings import refused
from sweeps.scene.plan.plan import Plan
from sweeps.scene.plan.shards import part
from sweeps.scene.sample import SEARCH, WORDS, drawn, read_sample


def extend(path: Path, axis: str, values: Sequence[float], options: Options) -> Plan:
    """Add points to an axis of an archive, in its units; only these are computed.

    The archive is replaced when the new one is complete; its results stay as they are. Where the
    same extension was interrupted before, its finished blocks are used. Returned is the plan of
    what the archive contains then. Refused are an axis that it does not have, values that it has
    already, an archive of another version, and, unless `options.overwrite` is set, an archive whose
    other extension was interrupted. Raises `Stopped` where it is interrupted, or cannot be written.
    """
    return _replaced(path, options, lambda old, partial: _more_values(old, axis, values, partial))


def extend_sample(path: Path, number: int, options: Options) -> Plan:
    """Draw more points of the sample of an archive; only these are computed.

    They are the following points of the same sequence: the archive is then the one that a sample of
    `number` points gives at once. Returned is its plan. Refused are an archive without a sample, a
    sample that cannot be extended or has as many points, and what `extend` refuses.
    """
    return _replaced(path, options, lambda old, partial: _more_points(old, number, partial))


@dataclass(frozen=True)
class _Longer:
    """The larger scene that an archive is extended to."""

    plan: Plan  # Plan of the extended archive
    axis: str  # The dimension that grows
    # Positions along the axis that are computed, and those that the archive had before.
    new: Integers
    before: Integers
    piece: dict[str, Any]  # Part of the scene that is computed, for the archive of the new points


def _replaced(
    path: Path, options: Options, longer: Callable[[Contents, Partial], _Longer | Plan]
) -> Plan:
    """Compute the new points of an archive, and replace it by the joined one."""
    partial = Partial.of(path)
    with partial.locked(path):  # The lock keeps others from changing the archive
        if partial.header() is not None and partial.finished():
            raise SceneError(f"{partial.path}: contains an interrupted run; complete it first")
        if options.overwrite:
            partial.clear()
        try:
            old = read_contents(path)
            if old.piece:
                raise SceneError(f"{path}: is a shard; merge all shards first")
            if "reduce" in old.source:
                raise refused("extend", "[reduce]", str(path))
            larger = longer(old, partial)
            plan = larger if isinstance(larger, Plan) else _joined(old, larger, options, partial)
        except Stopped as error:
            reason = re.split(r"; (?=\d+ of |nothing written)", str(error))[0]
            kept = f", finished blocks are kept in {partial.path}; to continue: "
            how = f"{kept}{options.resume_command}" if partial.give_up() else ""
            raise Stopped(f"{reason}; {path} is unchanged{how}") from None
        remove_folder(partial, path)
        return plan


def _more_values(
    old: Contents, axis: str, values: Sequence[float], partial: Partial
) -> _Longer | Plan:
    """Plan more points of an axis; the archive's own plan where it has them already."""
    _check_axis(old, axis)
    before = np.asarray(old.values[axis])
    if _computed(partial, axis, values) and np.isin(values, before).all():
        return plan_of(old)  # A killed extension had done everything except to remove the folder
    _check_new(old.path, axis, values, before)
    _check_version(old, plan_of(old))
    falls = len(before) > 1 and bool((np.diff(before) < 0).all())
    union = union_of([before, np.sort(values)[:: -1 if falls else 1]])
    plan = plan_of(old, axis=axis, values=union)
    new = np.flatnonzero(~np.isin(union, before))
    piece = {"axis": axis, "values": len(new)}
    return _Longer(plan, axis, new, places_in(union, before), piece)


def _more_points(old: Contents, number: int, partial: Partial) -> _Longer | Plan:
    """Plan more points of a sample; the archive's own plan where a killed extension had added them.

    The drawn values in the archive count: other versions of the libraries may draw others, which is
    refused.
    """
    had = plan_of(old)
    sample = had.scene.sample
    where = f"{old.path}: --number {number}"
    if sample is None:
        raise SceneError(f"{where}: the scene has no [sample]; --axis adds points to an axis")
    if sample.method == SEARCH:
        raise refused("extend", "designs that a search has found", where)
    if sample.method == "latin_hypercube":
        raise refused("extend", "a sample of method latin_hypercube", where)
    if number == sample.number and partial.added.exists():
        return had  # A killed extension had done everything except to remove the folder
    if number <= sample.number:
        raise SceneError(f"{where}: must be above {sample.number}, which the archive has")
    _check_version(old, had)
    source = {**old.source, "sample": {**old.source["sample"], "number": number}}
    whole = read_sample(source["sample"], f"{old.path}: [sample]", words=WORDS)
    columns = drawn(whole)
    count = had.sizes[DESIGN]
    before: dict[str, Any] = {**had.scene.designs, **had.scene.labels}
    for key, values in before.items():
        if not np.array_equal(columns[key][:count], values):
            raise SceneError(
                f"{where}: the installed SciPy or SALib draws different values of {key} from "
                "those in the archive; install the versions it was made with"
            )
    plan = plan_of(replace(old, source=source), coordinates={**old.values, **columns})
    total = plan.sizes[DESIGN]
    piece = {"axis": DESIGN, "values": total - count}
    return _Longer(plan, DESIGN, np.arange(count, total), np.arange(count), piece)


def _joined(old: Contents, longer: _Longer, options: Options, partial: Partial) -> Plan:
    """Compute the new points, and join them to the archive."""
    adding = replace(options, overwrite=False, resume=True, single=old.single)
    added = part(longer.plan, longer.axis, longer.new, json.dumps(longer.piece))
    try:
        run(added, partial.added, adding)
    except SceneError as error:
        if not partial.has_added_points():
            raise
        raise SceneError(
            f"{partial.path}: contains another interrupted extension ({error}); complete that "
            "first, or use --overwrite to discard it"
        ) from None
    both = [old, read_contents(partial.added)]
    joined = Joined(longer.plan, longer.axis, both, [longer.before, longer.new])
    try:
        write_joined(joined, old.path, partial, options, tolerance=longer.plan.scene.tolerance)
    except SceneError as error:
        partial.remove()  # Another attempt would fail in the same way
        raise SceneError(f"{old.path}: the new points do not fit it: {error}") from None
    return longer.plan


def _check_axis(archive: Contents, axis: str) -> None:
    """Check that an archive has an axis of numbers of this name."""
    values = archive.values
    axes = [
        a for a in archive.source.get("axes", {}) if a in values and values[a].dtype.kind == "f"
    ]
    if axis not in axes:
        raise SceneError(
            f"{archive.path}: --axis {axis}: not an axis; must be one of "
            f"{', '.join(axes) or 'none'}"
        )


def _computed(partial: Partial, axis: str, values: Sequence[float]) -> bool:
    """Whether exactly these values are computed and wait for being added."""
    if not partial.added.exists():
        return False
    try:
        computed = read_contents(partial.added).values.get(axis, ())
    except SceneError:  # A file that cannot be read is computed again
        partial.added.unlink()
        return False
    return np.array_equal(np.sort(np.asarray(computed)), np.sort(values))


def _check_new(path: Path, axis: str, values: Sequence[float], before: np.ndarray) -> None:
    """Check that none of the values is on the axis, or given twice."""
    for number, value in enumerate(values):
        if value in before:
            raise SceneError(f"{path}: --axis {axis}: {value:.12g} is already on the axis")
        if value in values[:number]:
            raise SceneError(f"{path}: --axis {axis}: {value:.12g} is given twice")


def _check_version(archive: Contents, plan: Plan) -> None:
    """Check that this version computes the same numbers as the archive holds."""
    numbers = str(archive.identity.get("numbers"))
    unequal = differences(archive.identity, identity(plan, numbers=numbers))
    if unequal:
        raise SceneError(
            f"{archive.path}: would be made in a different way now: {'; '.join(unequal)}; "
            "`engine-dyn rerun` computes it again"
        )


def rerun(
    path: Path, output: Path, options: Options, indicator: Path | None = None
) -> tuple[Plan, list[str]]:
    """Compute again what an archive contains; no other file is read, but `indicator`.

    `indicator` is the diagram of an archive that holds only its hash, because it is confidential:
    the raw file, or what `engine-dyn import` made of it. Returned are the plan, and what differed
    when the archive was made, such as versions: where nothing did, the variables are the same to
    the byte on the same kind of processor. Refused are archives that this version's `run` did not
    write, shards without the values that all shards share, and what `run` refuses.
    """
    old = read_contents(path)
    if indicator is not None:
        old = with_confidential(old, indicator)
    plan = part_of(old, plan_of(old))
    check_confidential(old, plan)
    unequal = differences(old.identity, identity(plan, numbers=str(old.identity["numbers"])))
    level = old.level if options.level is None else options.level
    run(plan, output, replace(options, single=old.single, level=level))
    return plan, unequal
