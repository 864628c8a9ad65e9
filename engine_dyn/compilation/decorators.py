"""The decorators of kernels and of the functions that they call.

Nothing compiles on import. With ``NUMBA_DISABLE_JIT=1`` plain Python functions come back.
"""

from __future__ import annotations

import functools
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numba
from numba.extending import typeof_impl

from engine_dyn.compilation.cache import archive_of, pack, unpacked
from engine_dyn.compilation.settings import COMPILED, NUMBA, listen_for, not_kept, seconds_compiling

__all__ = ["OPTIONS", "formula", "inlined", "kernel"]

# Rounding may differ from strict IEEE order; NaN and infinity keep their meaning (numba#2919).
FAST_MATH = {"reassoc", "contract", "nsz", "arcp", "afn"}
OPTIONS: dict[str, Any] = {"nogil": True, "fastmath": FAST_MATH, "error_model": "numpy"}

# All that a kernel calls is inlined: else it would be optimised apart from a kernel that was just
# compiled, but together with one from the disk, and last digits of results would tell. What only
# Python needs is left out, which saves a sixth of the time to compile.
PART = {"forceinline": True, "no_cpython_wrapper": True, "no_cfunc_wrapper": True, **OPTIONS}


class _Compiled:
    """A function that Python and kernels may call, compiled for each when it first does."""

    _lock = threading.Lock()

    def __init__(self, function: Callable[..., Any]) -> None:
        functools.update_wrapper(self, function)
        self.py_func, self.part = function, numba.njit(**PART)(function)
        self._whole: Any = None
        self._kept: tuple[str, Path] | None = None

    def __call__(self, *given: Any) -> Any:
        if self._whole is None:
            with self._lock:  # threads may come at once
                self._whole = self._whole or self._made()
        before = seconds_compiling()
        try:
            result = self._whole(*given)
        except OSError as error:  # from Numba's cache on a full disk, when all is compiled already
            not_kept(error)
            result = self._whole(*given)
        if self._kept is not None and seconds_compiling() != before:
            pack(*self._kept)
        return result

    def _made(self) -> Any:
        listen_for(self.py_func)
        # Without the second, which newer versions have, Numba might take another folder.
        ours = {"CACHE_DIR": "", "CACHE_LOCATOR_CLASSES": "UserProvidedCacheLocator"}
        before = {name: getattr(NUMBA, name, "") for name in ours}
        try:
            archive = archive_of(self.py_func)
            folder = unpacked(archive)
            vars(NUMBA).update(ours, CACHE_DIR=folder)
            made, self._kept = numba.njit(cache=True, **OPTIONS)(self.py_func), (folder, archive)
            return made
        except (OSError, RuntimeError) as error:
            not_kept(error)
            return numba.njit(**OPTIONS)(self.py_func)
        finally:
            vars(NUMBA).update(before)


# What kernels see in its place.
typeof_impl.register(_Compiled)(lambda compiled, _: numba.typeof(compiled.part))


def kernel(function: Callable[..., Any]) -> Any:
    """Compile a function without the interpreter lock, for Python to call; kept on disk."""
    return _Compiled(function) if COMPILED else function


inlined = formula = kernel
"""The same, of functions that kernels call, and Python in tests; formulas take numbers alone."""
