"""Pieces of work on threads.

Kernels release the interpreter's lock, so a pool of threads distributes the designs of a sweep over
the processors. It reports progress and can be stopped by Ctrl-C.
"""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

__all__ = ["FEWEST", "PIECE", "Progress", "run_pieces", "shared_by"]

Progress = Callable[[int], None]

PIECE = 16384
"""Largest number of designs of one call: long against the cost of a call, short for progress and
Ctrl-C."""

FEWEST = 64
"""Least number of designs that are worth a thread. A design takes some 50 us by the general solver;
a pool takes 200 us, and milliseconds where other programs use the processors."""


def shared_by(designs: int, threads: int, fewest: int) -> int:
    """Number of threads that the work is distributed over."""
    return max(1, min(threads, designs // fewest))


def run_pieces(
    designs: int, work: Callable[[int, int], None], threads: int, progress: Progress | None,
    largest: int = PIECE, fewest: int = FEWEST,
) -> None:  # fmt: skip
    """Call `work(begin, end)` over all designs, on threads with at least `fewest` designs each."""
    threads = shared_by(designs, threads, fewest)
    size = max(1, min(largest, designs))
    if threads > 1:  # several pieces a thread balance the load; each begins with a table
        size = min(largest, max(-(-designs // (threads * 8)), fewest // 4))
    pieces = [(begin, min(begin + size, designs)) for begin in range(0, designs, size)]
    if threads == 1:
        for begin, end in pieces:
            work(begin, end)
            if progress:
                progress(end - begin)
        return
    with ThreadPoolExecutor(threads) as pool:
        futures = [(pool.submit(work, *piece), piece) for piece in pieces]
        try:
            for future, (begin, end) in futures:
                future.result()
                if progress:
                    progress(end - begin)
        except BaseException:
            pool.shutdown(wait=True, cancel_futures=True)
            raise
