"""Runs on more than one machine: dask.distributed hands out blocks, workers write them.

Workers write the same finished blocks as a run of one process (`sweeps.running.archive.partial`)
into the same folder, on a file system that all of them share, and the process that asked puts them
together. So resuming, checksums, the lock, `info` and the archive itself are those of any run, a
killed worker loses only the block that it was computing, and only numbers of blocks go over the
network. dask decides which worker computes which block, and chooses another one where a worker is
lost.

The alternative, each worker running a shard into an archive of its own, which `merge` joins, was
rejected: a killed worker would lose its whole shard, and resuming, locking and reporting would have
to be written a second time, for a folder of archives.

dask is imported in this file alone, and only when it is used.
"""

from __future__ import annotations

import asyncio
import logging
import re
import secrets
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import CancelledError
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass
from typing import Any

import psutil

from sweeps.base import array_libraries
from sweeps.base.errors import SceneError, counted, one_line
from sweeps.running.archive.partial import Partial
from sweeps.running.archive.provenance import kind_differences, versions
from sweeps.running.compute import worker
from sweeps.running.compute.limits import AT_ONCE, SMALLEST_BLOCK
from sweeps.scene.plan.blocks import passing_bytes
from sweeps.scene.plan.plan import Plan

LOCAL = "local:"

MOST = 1024  # Largest number of processes on one machine

EACH = 4  # Smallest number of blocks for each worker, so that none waits long for the last one

FEWEST = 64  # Smallest number of blocks of a run, because more workers may join later

_TICK = 0.05  # Seconds between two checks for finished blocks


class Lost(Exception):
    """The workers cannot go on; the message says why."""


def check_address(text: str) -> int:
    """Check the value of --scheduler; returns the number of processes, or 0 for an address."""
    local = re.fullmatch(rf"{LOCAL}(\d{{1,9}})", text, re.ASCII)
    if local and 1 <= int(local[1]) <= MOST:
        return int(local[1])
    if re.fullmatch(r"(tcp|tls|ucx|ws|wss)://\S+", text):
        return 0
    raise SceneError(
        f"--scheduler {one_line(text, 100)}: must be the address of a dask scheduler such as "
        f"tcp://host:8786, or {LOCAL}N for N processes on this machine, 1 to {MOST}"
    )


@contextmanager
def connected(address: str, tell: Callable[[str], None] = lambda _: None) -> Iterator[DaskWorkers]:
    """Workers of a scheduler, or of processes that live as long as this context.

    See `check_address` on `address`; `tell` gets a line where one has to wait for workers. Refused
    are a scheduler that does not answer, workers that cannot be used or are not alike, and any
    address where dask is not installed.
    """
    processes = check_address(address)
    array_libraries.let_in("dask")
    try:
        import distributed
    except ImportError as error:
        raise SceneError(
            f"--scheduler {address}: needs dask ({one_line(error)}): "
            "pip install 'engine-dyn[cluster]'"
        ) from None
    with _quiet(), ExitStack() as stack:
        place: Any = address
        if processes:
            # The memory of a run is limited anyway; dask would kill workers that it takes for too
            # large.
            place = stack.enter_context(distributed.LocalCluster(
                n_workers=processes, threads_per_worker=1, processes=True, memory_limit=0,
                dashboard_address="127.0.0.1:0", silence_logs=logging.CRITICAL,
                preload=["sweeps.running.compute.worker"],
            ))  # fmt: skip
        else:
            _check_reached(address)
        try:
            client = stack.enter_context(distributed.Client(place, set_as_default=False))
        except (OSError, ValueError, TimeoutError, ImportError) as error:
            raise _not_reached(address, error) from None
        yield _checked(client, address, tell)


def _check_reached(address: str) -> None:
    """Connect once: dask's client does not end after a failure that it does not expect."""
    # Failures that dask's client does not expect are those of `tls://` without dask's TLS settings,
    # and of protocols that need a package.
    from distributed.comm.core import connect
    from distributed.security import Security

    async def reach() -> None:
        arguments = Security().get_connection_args("client")
        comm = await connect(address, **arguments)
        await comm.close()

    try:
        asyncio.run(reach())
    except Exception as error:  # The library of the protocol may raise any error
        raise _not_reached(address, error) from None


def _not_reached(address: str, error: Exception) -> SceneError:
    hint = ""
    if address.startswith(("tls:", "wss:")):
        hint = "; dask's configuration must name the certificates (distributed.comm.tls)"
    return SceneError(
        f"--scheduler {address}: cannot be reached ({one_line(error, 200) or type(error).__name__})"
        f"{hint}"
    )


@contextmanager
def _quiet() -> Iterator[None]:
    """Silence dask's client: failures are reported in one line, without its tracebacks."""
    logs = [logging.getLogger(name) for name in ("distributed", "distributed.client")]
    levels = [log.level for log in logs]
    for log in logs:
        log.setLevel(logging.CRITICAL + 1)
    try:
        yield
    finally:
        for log, level in zip(logs, levels, strict=True):
            log.setLevel(level)


def _checked(client: Any, address: str, tell: Callable[[str], None]) -> DaskWorkers:
    """Wait for a worker, and check that all present workers can be used together."""
    if not client.nthreads():
        tell(f"{address}: no workers yet; waiting for the first")
        client.wait_for_workers(1)
    answers = _asked(client, address, worker.about)
    first, own = next(iter(answers.values())), versions()
    for where, answer in answers.items():
        named = f"--scheduler {address}: worker {where} on {answer['host']}"
        other = [
            f"{name} (is {answer['versions'].get(name, 'missing')}, here {version})"
            for name, version in own.items()
            if answer["versions"].get(name) != version
        ]
        if other:
            raise SceneError(f"{named}: versions differ from those here: {', '.join(other)}")
        if answer["threads"] != 1:
            raise SceneError(
                f"{named}: has {answer['threads']} threads; must have one (--nthreads 1, and more "
                "workers instead)"
            )
        kind = kind_differences(first["kind"], answer["kind"])
        if kind:
            raise SceneError(
                f"{named}: a different kind of machine from {first['host']}, which would give "
                f"different last digits: {'; '.join(kind)}"
            )
    machines = [t["machine"] for t in answers.values()]
    return DaskWorkers(client, address, first["kind"], machines, tell)


def _asked(client: Any, address: str, question: Callable[..., Any], *arguments: Any) -> Any:
    """Answers of all workers, by their addresses."""
    try:
        answers = client.run(question, *arguments, on_error="return")
    except (OSError, TimeoutError, CancelledError) as error:
        raise SceneError(
            f"--scheduler {address}: can no longer be reached ({one_line(error, 200)})"
        ) from None
    for where, answer in answers.items():
        if isinstance(answer, Exception):
            reason = f"{type(answer).__name__}: {one_line(answer)}"
            if isinstance(answer, ImportError):
                reason = f"has no engine-dyn of this version ({one_line(answer)})"
            raise SceneError(f"--scheduler {address}: worker {where}: {reason}")
    return answers


@dataclass(frozen=True)
class DaskWorkers:
    """Workers of a dask scheduler, which write blocks into the folder of an unfinished archive."""

    client: Any  # The connection to the scheduler
    address: str  # Address of the scheduler, as the user gave it
    kind: dict[str, str]  # Kind of the workers' machines: see `provenance.machine_kind`
    machines: list[str]  # One line for each of the workers' machines
    tell: Callable[[str], None]  # Receives a line of text while the run waits for workers

    @property
    def text(self) -> str:
        """Machines of the workers, for the archive."""
        counts = {name: self.machines.count(name) for name in dict.fromkeys(self.machines)}
        listed = "; ".join(f"{counted(n, 'worker')} on {name}" for name, n in counts.items())
        return f"{self.address}: {listed}"

    def block_bytes(self, plan: Plan, limit: float) -> float:
        """Bytes of a block, so that there are enough blocks for all workers, and enough memory."""
        if self.address.startswith(LOCAL):
            free = psutil.virtual_memory().available
            limit = min(limit, 0.5 * free / (AT_ONCE * len(self.machines)))
        total = passing_bytes(plan, {})
        each = total / max(FEWEST, EACH * len(self.machines))
        return min(limit, max(SMALLEST_BLOCK, each))

    def compute(
        self, partial: Partial, plan: Plan, numbers: Sequence[int], done: Callable[[int], None]
    ) -> None:
        """Have blocks computed and written; `done` gets the number of each.

        Raises
        ------
        SceneError
            Where a worker does not see the folder, is of another kind, or refuses the scene.
        OSError
            Where a worker cannot write.
        Lost
            Where the cluster cannot go on.
        """
        from distributed import as_completed

        worker.hand_over(partial, plan)
        folder = str(partial.path.absolute())
        seen = _asked(self.client, self.address, worker.look, folder, partial.key)
        for where, wrong in seen.items():
            if wrong:
                raise SceneError(
                    f"--scheduler {self.address}: worker {where} {wrong}; the output must be on a "
                    "file system that all workers share"
                )
        run = secrets.token_hex(4)
        futures = {}
        for number in numbers:
            future = self.client.submit(
                worker.block, folder, partial.key, number,
                key=f"engine-dyn-{run}-{number}", pure=False,
            )  # fmt: skip
            futures[future.key] = future, number
        try:
            finished = as_completed(
                [future for future, _ in futures.values()], loop=self.client.loop
            )
            heard, warned = time.monotonic(), False
            while not finished.is_empty():
                if self.client.status != "running":
                    raise Lost(f"{self.address}: the scheduler has disappeared")
                if not finished.has_ready():
                    time.sleep(_TICK)
                    # After five seconds without a finished block, the workers may have disappeared.
                    if time.monotonic() - heard > 5.0 and not warned and not self._any_worker():
                        self.tell(
                            f"{self.address}: all workers have disappeared; waiting for others"
                        )
                        warned = True
                    continue
                heard, warned = time.monotonic(), False
                for future in finished.next_batch(block=False):
                    if future.status in ("pending", "lost"):
                        # The worker died with its answer: another one is asked, and finds the block
                        # finished.
                        finished.add(future)
                        continue
                    _check(future, self.address)
                    done(futures.pop(future.key)[1])
            _wait_for(partial, numbers)
        finally:
            if self.client.status == "running":
                with suppress(OSError, TimeoutError, CancelledError):  # The workers may have ended
                    self.client.cancel([future for future, _ in futures.values()])

    def _any_worker(self) -> bool:
        try:
            return bool(self.client.nthreads())
        except (OSError, TimeoutError, CancelledError) as error:
            raise _without_scheduler(self.address, error) from None


def _wait_for(partial: Partial, numbers: Sequence[int]) -> None:
    """Wait until finished blocks are visible: a network file system may show new files late."""
    # Seconds after which a file from another machine must be visible
    end = time.monotonic() + 60.0
    while not set(numbers) <= set(partial.finished()) and time.monotonic() < end:
        time.sleep(_TICK)


def _without_scheduler(address: str, error: Exception) -> Lost:
    return Lost(f"{address}: the scheduler has disappeared ({one_line(error, 200)})")


def _check(future: Any, address: str) -> None:
    """Raise the error in the answer of a worker; nothing where its block is finished."""
    if future.status == "finished":
        try:
            word, what = future.result()
        except Exception as error:  # The answer was lost with the scheduler or a worker
            raise _without_scheduler(address, error) from None
        if word == "refused":
            raise SceneError(f"--scheduler {address}: {what}")
        if word == "os":
            raise OSError(*what)
        if word != "done":
            raise Lost(f"{address}: {what}")
        return
    if future.status == "error":
        cause = future.exception()
        raise Lost(f"{address}: {type(cause).__name__}: {one_line(cause, 300)}")
    raise Lost(f"{address}: the scheduler has abandoned the run")
