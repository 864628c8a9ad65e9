"""Work of processes on a cluster: they compute blocks of a run, and write them into its folder.

A worker gets the folder, the run's key and the number of a block, nothing else: the scene lies in
the folder as plain data, in the form that archives have, and a worker makes its own plan of it. The
identity in the folder says whether that is the plan of the process that asked. Workers raise
nothing and return only texts and numbers: the other side might not be able to load an exception.
"""

from __future__ import annotations

import json
import os
import platform
import signal
from pathlib import Path
from typing import Any

import numpy as np

from sweeps.base.errors import SceneError, one_line
from sweeps.base.netcdf import ARCHIVE_FORMAT
from sweeps.running.archive.contents import Contents, files_as_now, plan_of
from sweeps.running.archive.labels import as_stored, describe
from sweeps.running.archive.partial import Damaged, Partial
from sweeps.running.archive.provenance import (
    differences,
    files_from_text,
    files_text,
    identity,
    kind_differences,
    machine_kind,
    machine_text,
    versions,
)
from sweeps.running.compute.computation import Computation
from sweeps.running.compute.reduced import Units
from sweeps.scene.plan.blocks import blocks
from sweeps.scene.plan.plan import Plan
from sweeps.scene.plan.shards import shard


def dask_setup(_: Any) -> None:
    """Leave Ctrl-C to the process that asked; dask calls this in processes of `local:N`."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def hand_over(partial: Partial, plan: Plan) -> None:
    """Put the scene of a plan into the folder of its run."""
    scene = (plan.whole or plan).scene
    values = {**scene.axes, **scene.designs}
    words = {name: list(v) for name, v in values.items() if isinstance(v, tuple)}
    partial.write_scene(
        {
            "scene": scene.source,
            "name": plan.name,
            "files": files_text(scene.folder, scene.files),
            "words": {**words, **{name: list(texts) for name, texts in scene.labels.items()}},
            "part": plan.piece,
        },
        {name: np.asarray(v) for name, v in values.items() if not isinstance(v, tuple)},
    )


def plan_of_folder(partial: Partial) -> Plan:
    """Plan of the scene that lies in a folder, which reads no other file."""
    try:
        scene, columns = partial.read_scene()
    except Damaged as error:
        raise SceneError(str(error)) from None
    folder, files = files_as_now(*files_from_text(scene["files"]), ARCHIVE_FORMAT)
    values = {**columns, **scene["words"]}
    about = {"scene_name": scene["name"]}
    plan = plan_of(Contents(partial.path, about, scene["scene"], folder, files, values))
    if scene["part"]:
        number, _, count = json.loads(scene["part"])["shard"].partition("/")
        plan = shard(plan, int(number), int(count))
    return plan


def about(dask_worker: Any = None) -> dict[str, Any]:
    """Machine, versions and threads of a worker."""
    threads = 1 if dask_worker is None else int(dask_worker.state.nthreads)
    return {
        "host": platform.node(),
        "process": os.getpid(),
        "machine": machine_text(),
        "kind": machine_kind(),
        "versions": versions(),
        "threads": threads,
    }


def look(folder: str, key: str) -> str:
    """Look for the folder of a run; returns what is wrong with it, empty if nothing is."""
    partial = Partial(Path(folder))
    if partial.header() is None or partial.key != key:
        return f"does not see {folder}, or sees a different folder of that name"
    try:
        partial.try_writing()
    except OSError as error:
        return f"cannot write into {folder} ({one_line(error.strerror)})"
    return ""


def block(folder: str, key: str, number: int) -> tuple[str, Any]:
    """Compute one block of a run and write it; nothing is done where it is finished already.

    Returns a word and its details: ("done", bytes), ("refused", text), ("os", [number, text]).
    """
    try:
        return "done", _work_of(folder, key).do(number)
    except SceneError as error:
        _WORK.clear()
        return "refused", f"{_where()}: {error}"
    except OSError as error:
        _WORK.clear()
        return "os", [error.errno, f"{error.strerror or error}, on {_where()}"]
    except Exception as error:
        _WORK.clear()
        return "failed", f"{_where()}: {type(error).__name__}: {one_line(error)}"


def _where() -> str:
    return f"worker on {platform.node()}"


_WORK: dict[tuple[str, str], _Work] = {}  # Runs for which this process computes, at most one


def _work_of(folder: str, key: str) -> _Work:
    if (folder, key) not in _WORK:
        _WORK.clear()  # A plan may be large, so that only one is kept
        _WORK[folder, key] = _Work(folder, key)
    return _WORK[folder, key]


class _Work:
    """A run as seen by one worker: its plan, whose blocks are computed on demand."""

    def __init__(self, folder: str, key: str) -> None:
        from distributed import get_worker

        self.partial = Partial(Path(folder))
        header = self.partial.header()
        if header is None or self.partial.key != key:
            raise SceneError(f"does not see {folder}, or sees a different folder of that name")
        threads = int(get_worker().state.nthreads)
        if threads != 1:
            raise SceneError(f"has {threads} threads; must have one (--nthreads 1)")
        wanted = header["identity"]
        self.plan = plan_of_folder(self.partial)
        unequal = differences(wanted, identity(self.plan, numbers=wanted["numbers"]))
        unequal += kind_differences(header["kind"], machine_kind())
        if unequal:
            raise SceneError(f"is of a different kind from the run: {'; '.join(unequal)}")
        self.labels = describe(self.plan, single=wanted["numbers"] == "float32")
        lengths = {str(d): int(n) for d, n in header["lengths"].items()}
        self.units = None
        if self.plan.scene.reduce is not None:
            self.units = Units(self.plan, lengths, labels=self.labels, threads=1)
            return
        self.blocks = list(blocks(self.plan, lengths))
        self.computation = Computation(self.plan, lengths, threads=1)

    def do(self, number: int) -> int:
        """Compute a block and write it, unless a worker that died meanwhile has done so."""
        try:
            return sum(array.nbytes for array in self.partial.read(number).values())
        except Damaged:
            pass
        if self.units is not None:
            ((_, state),) = self.units.states([number])
            return self.partial.write(number, state)
        results = self.computation.results(self.blocks[number])
        return self.partial.write(number, as_stored(self.labels, results))
