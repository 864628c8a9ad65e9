"""Pieces of work on threads, and how many designs each solver solves.

Kernels release the interpreter's lock, so a pool of threads distributes the designs of a sweep over
the processors. It can be stopped by Ctrl-C. To count, call `dispatch.solve` within `counted`.
"""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor, as_completed
from contextlib import contextmanager
from contextvars import ContextVar
from itertools import chain, islice
from typing import TypeVar

BATCH, GENERAL = "batch solver", "general solver"


class Tally:
    """Counts of designs by solver; designs that are solved again count again.

    `notes` has of each piece of work its solver, the number of designs, and how many of these the
    batch solver left to the general one. Threads may add to it.
    """

    def __init__(self) -> None:
        self.notes: list[tuple[str, int, int]] = []

    @property
    def designs(self) -> Counter[str]:
        """Numbers of designs that each solver was given."""
        return sum((Counter({solver: count}) for solver, count, _ in self.notes), Counter())

    @property
    def deferred(self) -> int:
        """Number of designs that the batch solver left."""
        return sum(left for _, _, left in self.notes)

    @property
    def general_share(self) -> float:
        """Fraction of all designs that the general solver solved; NaN without any."""
        total = self.designs.total()
        return (self.designs[GENERAL] + self.deferred) / total if total else float("nan")


_TALLY: ContextVar[Tally | None] = ContextVar("tally", default=None)


def tally_in_use() -> Tally | None:
    """Return the tally of the innermost `counted` around the caller, or None."""
    return _TALLY.get()


@contextmanager
def counted() -> Iterator[Tally]:
    """Count the designs that this thread solves within the block, by what solves them."""
    tally = Tally()
    token = _TALLY.set(tally)
    try:
        yield tally
    finally:
        _TALLY.reset(token)


Progress = Callable[[int], None]

Job = TypeVar("Job")
Result = TypeVar("Result")


def map_on_threads(
    do: Callable[[Job], Result], jobs: Iterable[Job], threads: int | None
) -> Iterator[Result]:
    """Results of jobs in the order in which they are done, one thread a processor unless given.

    Jobs are made in the calling thread, while others are done already.
    """
    rest = iter(jobs)
    first = list(islice(rest, 2))
    all_jobs = chain(first, rest)
    if len(first) > 1:  # counting processors takes some 60 us, making a pool 200
        threads = threads or os.cpu_count() or 1
        if threads > 1:
            return _on_pool(do, all_jobs, threads)
    return map(do, all_jobs)


def _on_pool(do: Callable[[Job], Result], jobs: Iterable[Job], threads: int) -> Iterator[Result]:
    with ThreadPoolExecutor(threads) as pool:
        try:
            for done in as_completed([pool.submit(do, job) for job in jobs]):
                yield done.result()
        except BaseException:
            pool.shutdown(wait=True, cancel_futures=True)
            raise
