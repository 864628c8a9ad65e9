"""Jobs by processes that stay, each of which is replaced where it crashes or hangs."""

from __future__ import annotations

import contextlib
import math
import threading
import time
import traceback
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from multiprocessing import get_context
from typing import Any

import psutil

from benchmarks.command import CPUS


@dataclass(frozen=True)
class Lost:
    """Why a job has no answer."""

    why: str


def _serve(pipe: Any, work: Callable[[Any], Any], start: Callable[[], Any]) -> None:
    """Answer jobs until there are no more."""
    start()
    with contextlib.suppress(EOFError):
        while True:
            job = pipe.recv()
            try:
                pipe.send(work(job))
            except Exception:
                pipe.send(Lost(traceback.format_exc()[-6000:]))


class _Worker:
    """A process that answers jobs."""

    def __init__(self, work: Callable[[Any], Any], start: Callable[[], Any]) -> None:
        context = get_context("spawn")
        self.pipe, theirs = context.Pipe()
        self.process = context.Process(target=_serve, args=(theirs, work, start))
        self.process.start()
        theirs.close()

    def answer(self, job: Any, limit: float) -> Any:
        """Answer of a job; a `Lost`, and an ended process, where it has none."""
        used, began = self.spent(), time.monotonic()
        try:
            self.pipe.send(job)
            while not self.pipe.poll(min(1.0, limit)):
                if self.spent() - used > limit or time.monotonic() - began > 10.0 * limit:
                    self.end()
                    return Lost(f"no answer in {limit:g} s")
            return self.pipe.recv()
        except (EOFError, OSError):
            self.process.join()
            return Lost(f"ended with status {self.process.exitcode}")

    def spent(self) -> float:
        """Seconds of the processor so far."""
        with contextlib.suppress(psutil.NoSuchProcess):
            return sum(psutil.Process(self.process.pid).cpu_times()[:2])
        return math.inf

    def end(self) -> None:
        """Kill the process."""
        self.process.kill()
        self.process.join()


def answers(
    work: Callable[[Any], Any], jobs: Iterable[Any], processes: int = CPUS,
    limit: float = math.inf, start: Callable[[], Any] = int,
) -> Iterator[Any]:  # fmt: skip
    """Answers to jobs, in their order, by processes of their own.

    Parameters
    ----------
    work : callable
        From a job to its answer. Where it raises, crashes or hangs, the answer is a `Lost`.
    jobs : iterable
        What is to be done.
    processes : int
        Their number.
    limit : float
        Seconds of the processor that a job may take; of the clock, ten times that. The first job of
        a process waits for its imports and its start.
    start : callable
        What each process does first.
    """
    own, workers = threading.local(), []

    def one(job: Any) -> Any:
        first = not hasattr(own, "worker") or not own.worker.process.is_alive()
        if first:
            own.worker = _Worker(work, start)
            workers.append(own.worker)
        return own.worker.answer(job, limit * (5 if first else 1))

    threads = ThreadPoolExecutor(processes)
    try:
        yield from threads.map(one, jobs)
    finally:
        threads.shutdown(wait=False, cancel_futures=True)
        for worker in workers:
            worker.end()


def in_processes(
    work: Callable[[Any], Any], jobs: Iterable[Any], processes: int = CPUS
) -> Iterator[Any]:
    """The same where every job must have an answer.

    Raises
    ------
    RuntimeError
        With what went wrong.
    """
    for answer in answers(work, jobs, processes):
        if isinstance(answer, Lost):
            raise RuntimeError(answer.why)
        yield answer
