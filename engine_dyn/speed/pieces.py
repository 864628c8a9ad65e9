"""Pieces of work on threads.

Kernels release the interpreter's lock, so a pool of threads distributes the designs of a sweep over
the processors. It can be stopped by Ctrl-C.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor, as_completed
from itertools import chain, islice
from typing import TypeVar

__all__ = ["Progress", "do_on_threads"]

Progress = Callable[[int], None]

Job = TypeVar("Job")


def do_on_threads(
    do: Callable[[Job], int], jobs: Iterable[Job], threads: int | None,
    progress: Progress | None = None,
) -> None:  # fmt: skip
    """Do jobs on so many threads at most, None for one a processor.

    Jobs are made in the calling thread, while others are done already. `do` returns the number of
    designs, which `progress` is told.
    """
    tell, rest = progress or (lambda done: None), iter(jobs)
    threads = threads or os.cpu_count() or 1
    first = list(islice(rest, 2))
    if threads == 1 or len(first) < 2:  # a pool costs some 200 us
        for job in chain(first, rest):
            tell(do(job))
        return
    with ThreadPoolExecutor(threads) as pool:
        try:
            for done in as_completed([pool.submit(do, job) for job in chain(first, rest)]):
                tell(done.result())
        except BaseException:
            pool.shutdown(wait=True, cancel_futures=True)
            raise
