"""Archives that are computed again, from what they contain and nothing else."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from sweeps.running.archive.contents import (
    check_confidential,
    part_of,
    plan_of,
    read_contents,
    with_confidential,
)
from sweeps.running.archive.provenance import differences, identity
from sweeps.running.compute.into_archive import run
from sweeps.running.compute.options import Options
from sweeps.scene.plan.plan import Plan

__all__ = ["rerun"]


def rerun(
    path: Path, output: Path, options: Options, indicator: Path | None = None
) -> tuple[Plan, list[str]]:
    """Compute again what an archive contains.

    Parameters
    ----------
    path : Path
        An archive; no other file is read, but `indicator`.
    output : Path
        The archive to write.
    options : Options
        How the new archive is written.
    indicator : Path, optional
        The diagram of an archive that holds only its hash, because it is confidential: the raw
        file, or what `engine-dyn import` made of it.

    Returns
    -------
    plan, differences
        What was computed, and what differed when the archive was made, such as versions: where
        nothing did, the variables are the same to the byte on the same kind of processor.

    Raises
    ------
    SceneError
        Where it is no archive that this version's `run` wrote, or a shard without the values that
        all shards share; else as `sweeps.running.compute.into_archive.run`.
    Stopped
        As `sweeps.running.compute.into_archive.run`.
    """
    old = read_contents(path)
    if indicator is not None:
        old = with_confidential(old, indicator)
    plan = part_of(old, plan_of(old))
    check_confidential(old, plan)
    found = differences(old.identity, identity(plan, numbers=str(old.identity["numbers"])))
    level = old.level if options.level is None else options.level
    run(plan, output, replace(options, single=old.single, level=level))
    return plan, found
