"""Pieces of work on threads.

Kernels release the interpreter's lock, so a pool of threads distributes the designs of a sweep over
the processors. It reports progress and can be stopped by Ctrl-C.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor, as_completed
from itertools import chain, islice
from typing import Any

__all__ = ["Progress", "run_on_threads"]

Progress = Callable[[int], None]


def run_on_threads(
    jobs: Iterator[Any], do: Callable[[Any], None], threads: int, progress: Progress | None = None
) -> None:
    """Do all jobs, on so many threads at most; `progress` is told the `size` of each.

    Jobs are made in the calling thread, while others are done already.
    """
    first = list(islice(jobs, 2))
    all_jobs = chain(first, jobs)
    if threads == 1 or len(first) < 2:  # a pool costs some 200 us
        for job in all_jobs:
            do(job)
            if progress:
                progress(job.size)
        return
    with ThreadPoolExecutor(threads) as pool:
        try:
            sizes = {pool.submit(do, job): job.size for job in all_jobs}
            for done in as_completed(sizes):
                done.result()
                if progress:
                    progress(sizes[done])
        except BaseException:
            pool.shutdown(wait=True, cancel_futures=True)
            raise
