"""Runs into an archive as programs ask for them."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Unpack

from engine_dyn.plausibility.judgement import ImplausibleWarning
from sweeps.base.arguments import a_path, thread_count, usable_device
from sweeps.base.errors import SceneError, shown
from sweeps.running.compute.into_archive import run
from sweeps.running.compute.options import Finished, Options
from sweeps.scene.keywords import TablesButOutput, tables_in_signature
from sweeps.scene.model import Scene
from sweeps.scene.plan.plan import make_plan
from sweeps.scene.reading import read_scene


@tables_in_signature
def stream(
    scene: str | Path | Mapping[str, Any] | Scene | None = None,
    output: str | Path | Mapping[str, Any] | None = None,
    *,
    resume: bool = False,
    overwrite: bool = False,
    memory: float | None = None,
    threads: int | None = None,
    device: str = "cpu",
    scheduler: str = "",
    compression: int = 0,
    single: bool = False,
    progress: bool = False,
    full_paths: bool = False,
    archive: str | Path | None = None,
    **tables: Unpack[TablesButOutput],
) -> Finished:
    """Run a scene into an archive, block by block, as the command does.

    Parameters
    ----------
    scene : str, Path, dict or Scene, optional
        See `sweeps.run`.
    output : str or Path
        The archive to write; `sweeps.open` opens it. A dict is the table [output] of the scene,
        and `archive` names the archive.
    resume : bool
        Complete an interrupted run; start where there is none.
    overwrite : bool
        Replace an archive, and begin an interrupted run again.
    memory : float, optional
        Bytes that arrays and buffers may take beyond the loaded libraries.
    threads : int, optional
        As many as the machine has processors, unless given.
    device : str
        "cpu", or "cuda": see `sweeps.run`.
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
    full_paths : bool
        Whether the archive keeps the folders of the files that it was made from.
    archive : str or Path, optional
        The archive to write, where `output` is the scene's table.
    **tables
        Tables of a scene as keywords; see `sweeps.read_scene`.

    Returns
    -------
    Finished
        Outcomes, number of blocks, seconds.

    Raises
    ------
    SceneError, Stopped, OSError
        See `sweeps.running.compute.into_archive.run`.

    Warns
    -----
    engine_dyn.ImplausibleWarning
        For values that engines do not have, as `sweeps.run`.

    Examples
    --------
    >>> import sweeps
    >>> finished = sweeps.stream(
    ...     archive="delta.nc",
    ...     engine="ntua",
    ...     axes={"inertia": [2, 4]},
    ...     output={"quantities": ["delta"]},
    ... )
    >>> finished.outcomes
    {'converged': 2}
    """
    given: dict[str, Any] = dict(tables)
    if isinstance(output, Mapping):
        given["output"] = output
    elif archive is None:
        archive = output
    elif output is not None:
        raise SceneError(
            f"output = {shown(output)}: must be the scene's table [output] beside archive"
        )
    path = a_path(archive, "archive" if isinstance(output, Mapping) else "output")
    options = Options(
        resume=resume, overwrite=overwrite, memory=memory, threads=thread_count(threads),
        device=usable_device(device), level=compression, single=single, progress=progress,
        full_paths=full_paths, resume_command="the same with resume=True",
    )  # fmt: skip
    done = run(make_plan(read_scene(scene, **given)), path, options, scheduler)
    for line in done.warnings:
        warnings.warn(line, ImplausibleWarning, stacklevel=2)
    return done
