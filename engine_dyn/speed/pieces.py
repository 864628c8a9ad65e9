"""Pieces of work on threads.

Kernels hold no interpreter lock, so a pool of threads shares the designs of a sweep between the
processors, gives progress, and lets Ctrl-C through.
"""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

__all__ = ["FEWEST", "PIECE", "Progress", "run_pieces", "shared_by"]

Progress = Callable[[int], None]

PIECE = 16384
"""Designs of one call at most: long against the cost of a call, short for progress and Ctrl-C."""

FEWEST = 64
"""Designs that are worth a thread: some 50 us each by a general method. A pool takes 200 us, and
milliseconds where other programs use the processors."""


def shared_by(designs: int, threads: int, fewest: int) -> int:
    """How many of the threads share the work."""
    return max(1, min(threads, designs // fewest))


def run_pieces(
    designs: int, work: Callable[[int, int], None], threads: int, progress: Progress | None,
    largest: int = PIECE, fewest: int = FEWEST,
) -> None:  # fmt: skip
    """Call `work(begin, end)` over all designs, on threads when there is enough to share.

    That is from `fewest` designs a thread on.
    """
    threads = shared_by(designs, threads, fewest)
    size = max(1, min(largest, designs))
    if threads > 1:  # several pieces a thread even out the load; each begins with a table
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
