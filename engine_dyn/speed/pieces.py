"""Pieces of work on threads.

Kernels release the interpreter's lock, so a pool of threads distributes the designs of a sweep over
the processors. It can be stopped by Ctrl-C.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor, as_completed
from itertools import chain, islice
from typing import TypeVar

__all__ = ["Progress", "map_on_threads"]

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
    if len(first) > 1:  # to count processors takes some 60 us, a pool 200
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
