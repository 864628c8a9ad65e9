"""Linear algebra on one thread: its sums are then in one order, however many processors there are.

BLAS and LAPACK divide products and decompositions among threads, and round differently with each
number of them. Their matrices are small here: threads would not make them faster.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from functools import lru_cache
from threading import Lock
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from threadpoolctl import ThreadpoolController

_lock = Lock()
_limits: dict[bool, Any] = {}
"""Limits in force, by whether SciPy was loaded, which brings a library of its own."""

_inside = 0  # Contexts of `linear_algebra_on_one_thread` that are open, on all threads


@lru_cache(maxsize=2)
def _libraries(scipy: bool) -> ThreadpoolController:
    """Thread pools of the loaded libraries; the search takes a millisecond and is done once."""
    from threadpoolctl import ThreadpoolController

    return ThreadpoolController()


@contextmanager
def linear_algebra_on_one_thread() -> Iterator[None]:
    """Context, or decorator, in which NumPy and SciPy use one thread for linear algebra.

    The limit is that of the whole process, and ends with the last one that asked for it.
    """
    global _inside  # The number of contexts is that of the whole process
    with _lock:
        scipy = "scipy.linalg" in sys.modules
        if scipy not in _limits:
            _limits[scipy] = _libraries(scipy).limit(limits=1, user_api="blas")
        _inside += 1
    try:
        yield
    finally:
        with _lock:
            _inside -= 1
            while _limits and not _inside:
                _limits.popitem()[1].restore_original_limits()
