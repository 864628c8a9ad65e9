"""Archives that are computed again, from what they contain and nothing else."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from sweeps.archive.contents import part_of, plan_of, read_contents
from sweeps.archive.provenance import differences, identity
from sweeps.planning.plan import Plan
from sweeps.running.into_archive import run
from sweeps.running.options import Options

__all__ = ["rerun"]


def rerun(path: Path, output: Path, options: Options) -> tuple[Plan, list[str]]:
    """Compute again what an archive contains.

    Parameters
    ----------
    path : Path
        An archive; no other file is read.
    output : Path
        The archive to write.
    options : Options
        How the new archive is written.

    Returns
    -------
    plan, differences
        What was computed, and what differed when the archive was made, such as versions: where
        nothing did, the variables are the same to the byte on the same kind of processor.

    Raises
    ------
    SceneError
        Where it is no archive that this version's `run` wrote, or a shard without the values that
        all shards share; else as `sweeps.running.into_archive.run`.
    Stopped
        As `sweeps.running.into_archive.run`.
    """
    old = read_contents(path)
    plan = part_of(old, plan_of(old))
    found = differences(old.identity, identity(plan, numbers=str(old.identity["numbers"])))
    level = old.level if options.level is None else options.level
    run(plan, output, replace(options, single=old.single, level=level))
    return plan, found
