"""Archives of one scene become one: shards, archives that differ in the values of one axis.

Nothing is computed. Designs that several archives contain must have the same results in all; that
holds too for results that do not depend on the axis in which the archives differ.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from sweeps.base.errors import SceneError
from sweeps.running.archive.contents import Contents, damage_refused, plan_of, read_contents
from sweeps.running.archive.labels import describe
from sweeps.running.archive.netcdf import open_archive, publish
from sweeps.running.archive.partial import Partial, made_folder
from sweeps.running.compute.failures import remove_folder, stopped_by_failures
from sweeps.running.compute.limits import archive_bytes, check_room
from sweeps.running.compute.options import Options
from sweeps.running.join.copying import write_joined
from sweeps.running.join.places import check_same, find_places
from sweeps.running.reduce.reduction import Reduction, state_in
from sweeps.scene.plan.plan import Plan


def check_shards(archives: Sequence[Contents]) -> Plan:
    """Plan of the whole scene whose shards these are, each once.

    Raises
    ------
    SceneError
        Where they are no shards, where one is missing or given twice.
    """
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
    """Add the reductions of shards, and write the archive.

    Raises
    ------
    SceneError
        Where one is damaged.
    """
    labels = describe(plan, command=options.command, single=archives[0].single)
    whole = Reduction(plan, labels)
    for one in archives:
        with damage_refused(one.path), open_archive(one.path) as archive:
            whole.merge(state_in(archive, str(one.path)))
    whole.write(partial.archive, sum(one.attributes["seconds"] for one in archives))
    publish(partial.archive, output)


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
        Of what the new archive contains.

    Raises
    ------
    SceneError
        Where they are not of one scene, version or kind, where something is missing, or where two
        of them have different results of one design.
    Stopped
        Where the archive cannot be written.
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
