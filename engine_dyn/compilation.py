"""The one place that knows Numba's flags and where compiled kernels are kept.

Kernels compile when first called, never on import. Compiled code is cached on disk; the cache is
keyed by a hash of every source file of this package, because Numba itself only looks at the file
that holds the function and would not see an edit in a file it calls (numba#1833, #9483).
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numba
from numba.core import caching

__all__ = ["FAST_MATH", "is_cached", "kernel", "source_hash"]

FAST_MATH = {"reassoc", "contract", "nsz", "arcp", "afn"}
"""Rounding may differ from strict IEEE order; NaN and infinity keep their meaning (numba#2919)."""

_kernels: list[Any] = []


@cache
def source_hash() -> str:
    """Hash of all sources of this package and of the versions that compile them."""
    digest = hashlib.sha256()
    folder = Path(__file__).parent
    for path in sorted(folder.rglob("*.py")):
        digest.update(str(path.relative_to(folder)).encode())
        digest.update(path.read_bytes())
    digest.update(f"{numba.__version__} {sorted(FAST_MATH)}".encode())
    return digest.hexdigest()


def _stamped(locator: type) -> type:
    """Return `locator` with the package's source hash as the stamp of a cached function."""

    class Stamped(locator):  # type: ignore[misc]
        def get_source_stamp(self) -> str:
            return source_hash()

    return Stamped


class _Implementation(caching.CompileResultCacheImpl):  # type: ignore[misc]
    # Numba's own places in Numba's own order: a folder named by NUMBA_CACHE_DIR, beside the source,
    # the user's own folder.
    _locator_classes = [_stamped(locator) for locator in caching.CacheImpl._locator_classes]


class _Cache(caching.FunctionCache):  # type: ignore[misc]
    _impl_class = _Implementation


def kernel(function: Callable[..., Any]) -> Any:
    """Compile a function without the interpreter lock, lazily, cached by the package's sources.

    With ``NUMBA_DISABLE_JIT=1`` the plain Python function comes back.
    """
    dispatcher = numba.njit(nogil=True, fastmath=FAST_MATH, error_model="numpy")(function)
    if hasattr(dispatcher, "enable_caching"):
        try:
            dispatcher._cache = _Cache(dispatcher.py_func)
        except RuntimeError:  # no writable folder at all: compile every time
            pass
        _kernels.append(dispatcher)
    return dispatcher


def inlined(function: Callable[..., Any]) -> Any:
    """Compile a small formula that only other kernels call; it is inlined and needs no cache."""
    return numba.njit(nogil=True, fastmath=FAST_MATH, error_model="numpy")(function)


def is_cached() -> bool:
    """Whether every kernel entered so far has compiled code of this version on disk or in memory."""
    from engine_dyn.speed import lanes

    for dispatcher in (lanes.march,):
        if getattr(dispatcher, "signatures", True):
            continue
        store = getattr(dispatcher, "_cache", None)
        impl = getattr(store, "_cache_file", None)
        if impl is None:
            return False
        if not os.path.exists(os.path.join(store.cache_path, impl._index_name)):
            return False
        if not impl._load_index():
            return False
    return True
