"""What processes on a cluster do: compute blocks of a run, and write them into its folder.

A worker is told the folder, the run's key and the number of a block, nothing else: the scene lies
in the folder as plain data, as archives hold it, and a worker makes its own plan of it. Whether
that is the plan of the one who asks, the identity in the folder says. Nothing is raised, nothing
but texts and numbers is returned: an exception would have to be understood at the other end.
"""

from __future__ import annotations

import os
import platform
import signal
from collections import deque
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from sweeps.archive.partial import Damaged, Partial
from sweeps.errors import SceneError, one_line

if TYPE_CHECKING:
    from sweeps.planning.blocks import Block
    from sweeps.planning.plan import Plan

__all__ = ["about", "block", "hand_over", "look"]

Answer = tuple[str, Any]
"""A word and what belongs to it: ("done", bytes), ("refused", text), ("os", [number, text])."""


def dask_setup(_: Any) -> None:
    """Leave ctrl-C to the process that asked: dask calls this in processes of `local:N`."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def hand_over(here: Partial, plan: Plan) -> None:
    """Put the scene of a plan into the folder of its run."""
    from sweeps.archive.provenance import files_text

    scene = (plan.whole or plan).scene
    values = {**scene.axes, **scene.designs}
    words = {name: list(v) for name, v in values.items() if isinstance(v, tuple)}
    here.write_scene(
        {
            "scene": scene.source,
            "name": plan.name,
            "files": files_text(scene.folder, scene.files),
            "words": {**words, **{name: list(texts) for name, texts in scene.labels.items()}},
            "part": plan.piece,
        },
        {name: np.asarray(v) for name, v in values.items() if not isinstance(v, tuple)},
    )


def plan_of_folder(here: Partial, identity: Mapping[str, Any]) -> Plan:
    """Plan of the scene that lies in a folder, which reads no other file.

    Raises
    ------
    SceneError
        Where it cannot be read, or is none that this version can plan.
    """
    import json

    from sweeps.archive.contents import Held, plan_of
    from sweeps.archive.provenance import files_from_text
    from sweeps.planning.shards import shard

    try:
        told, columns = here.read_scene()
    except Damaged as error:
        raise SceneError(str(error)) from None
    folder, files = files_from_text(told["files"])
    values = {**columns, **told["words"]}
    source = Held(
        here.path, {"scene_name": told["name"]}, told["scene"], folder, files, dict(identity),
        {}, values, {}, 0,
    )  # fmt: skip
    plan = plan_of(source, whole=values)
    if told["part"]:
        number, _, count = json.loads(told["part"])["shard"].partition("/")
        plan = shard(plan, int(number), int(count))
    return plan


def about(dask_worker: Any = None) -> dict[str, Any]:
    """Tell what a worker is: its machine, versions and threads."""
    from engine_dyn.compilation import own_cache
    from sweeps.archive.provenance import machine_kind, machine_text, versions

    threads = 1 if dask_worker is None else int(dask_worker.state.nthreads)
    return {
        "host": platform.node(),
        "process": os.getpid(),
        "machine": machine_text(),
        "kind": machine_kind(),
        "versions": versions(),
        "cache": own_cache() if threads == 1 else "",
        "threads": threads,
    }


def look(folder: str, key: str) -> str:
    """Look for the folder of a run; what is wrong with it, empty if nothing."""
    here = Partial(Path(folder))
    if here.header() is None or here.key != key:
        return f"does not see {folder}, or another one of that name"
    try:
        here.try_writing()
    except OSError as error:
        return f"cannot write into {folder} ({one_line(error.strerror)})"
    return ""


def block(folder: str, key: str, number: int) -> Answer:
    """Compute one block of a run and write it; nothing is done where it is there already."""
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


_WORK: dict[tuple[str, str], _Work] = {}
"""The run that this process is at, one at most."""


def _work_of(folder: str, key: str) -> _Work:
    if (folder, key) not in _WORK:
        _WORK.clear()  # a plan may be large
        _WORK[folder, key] = _Work(folder, key)
    return _WORK[folder, key]


class _Work:
    """A run as one worker sees it.

    What no block changes is computed once, as in a run of one process: `runner.computed` goes on
    with one block after the other, as they come.
    """

    def __init__(self, folder: str, key: str) -> None:
        from distributed import get_worker

        from engine_dyn.compilation import own_cache
        from sweeps.archive.labels import describe
        from sweeps.archive.provenance import differences, identity, kind_differences, machine_kind
        from sweeps.planning.blocks import blocks
        from sweeps.running.in_memory import computed

        own_cache()
        self.here = Partial(Path(folder))
        header = self.here.header()
        if header is None or self.here.key != key:
            raise SceneError(f"does not see {folder}, or another one of that name")
        threads = int(get_worker().state.nthreads)
        if threads != 1:
            raise SceneError(f"has {threads} threads; must have one (--nthreads 1)")
        wanted = header["identity"]
        self.plan = plan_of_folder(self.here, wanted)
        found = differences(wanted, identity(self.plan, numbers=wanted["numbers"]))
        found += kind_differences(header["kind"], machine_kind())
        if found:
            raise SceneError(f"is of another kind than the run: {'; '.join(found)}")
        self.labels = describe(self.plan, single=wanted["numbers"] == "float32")
        lengths = {str(d): int(n) for d, n in header["lengths"].items()}
        self.blocks = list(blocks(self.plan, lengths))
        self.next: deque[Block] = deque()
        self.results = computed(self.plan, lengths, self._chosen(), threads=1)

    def _chosen(self) -> Iterator[Block]:
        while True:
            yield self.next.popleft()

    def do(self, number: int) -> int:
        """Compute a block and write it, unless a worker that died meanwhile has done so."""
        from sweeps.running.into_archive import in_file

        try:
            return sum(array.nbytes for array in self.here.read(number).values())
        except Damaged:
            pass
        self.next.append(self.blocks[number])
        _, parts = next(self.results)
        arrays = {name: in_file(self.labels, name, parts.pop(name)) for name in list(parts)}
        return self.here.write(number, arrays)
