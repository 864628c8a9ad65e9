"""The one place that knows Numba's flags and where compiled kernels are kept.

Kernels compile when first called, never on import. Compiled code is cached on disk; the cache is
keyed by a hash of every source file of this package, because Numba itself only looks at the file
that holds the function and would not see an edit in a file it calls (numba#1833, #9483).
"""

from __future__ import annotations

import contextlib
import hashlib
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numba
from numba.core import caching

__all__ = ["FAST_MATH", "is_cached", "kernel", "source_hash"]

FAST_MATH = {"reassoc", "contract", "nsz", "arcp", "afn"}
"""Rounding may differ from strict IEEE order; NaN and infinity keep their meaning (numba#2919)."""


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


def _stamped(locator: Any) -> Any:
    """Return `locator` with the package's source hash as the stamp of a cached function."""

    def get_source_stamp(self: Any) -> str:
        return source_hash()

    return type(f"Stamped{locator.__name__}", (locator,), {"get_source_stamp": get_source_stamp})


# Numba's own places in Numba's own order: a folder named by NUMBA_CACHE_DIR, beside the source,
# the user's own folder.
_Implementation: Any = type(
    "_Implementation",
    (caching.CompileResultCacheImpl,),
    {"_locator_classes": [_stamped(locator) for locator in caching.CacheImpl._locator_classes]},
)


class _Cache(caching.FunctionCache):
    _impl_class = _Implementation


def kernel(function: Callable[..., Any]) -> Any:
    """Compile a function without the interpreter lock, lazily, cached by the package's sources.

    With ``NUMBA_DISABLE_JIT=1`` the plain Python function comes back.
    """
    dispatcher: Any = inlined(function)
    if hasattr(dispatcher, "enable_caching"):
        # Without any writable folder, kernels are compiled every time.
        with contextlib.suppress(RuntimeError):
            dispatcher._cache = _Cache(dispatcher.py_func)
    return dispatcher


def inlined(function: Callable[..., Any]) -> Any:
    """Compile a small formula that only other kernels call; it is inlined and needs no cache."""
    return numba.njit(nogil=True, fastmath=FAST_MATH, error_model="numpy")(function)


def is_cached(dispatcher: Any) -> bool:
    """Whether a kernel is compiled for this version, on disk or in this process."""
    if getattr(dispatcher, "signatures", True):  # compiled here, or not compiled at all
        return True
    file: Any = getattr(dispatcher._cache, "_cache_file", None)
    return file is not None and bool(file._load_index())
