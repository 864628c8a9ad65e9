"""Shards that were reduced as they were computed become one: their reductions are added.

What they know are whole numbers, kept designs and extremes, so that the result is that of one run
to the bit.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from sweeps.base.errors import SceneError
from sweeps.running.archive.contents import Contents, damage_refused, plan_of
from sweeps.running.archive.labels import describe
from sweeps.running.archive.netcdf import open_archive, publish
from sweeps.running.archive.partial import Partial
from sweeps.running.compute.options import Options
from sweeps.running.reduce.reduction import Reduction, state_in
from sweeps.scene.plan.plan import Plan

__all__ = ["check_shards", "write_merged"]


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
