"""The decorators of compiled functions; with ``NUMBA_DISABLE_JIT=1`` they leave plain Python."""

from __future__ import annotations

import functools
import os
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

from engine_dyn.compilation.cache import archive_of, pack, unpacked
from engine_dyn.compilation.settings import COMPILED, listen_for, not_kept, seconds_compiling

# Rounding may differ from strict IEEE order; NaN and infinity keep their meaning (numba#2919).
FAST_MATH = {"reassoc", "contract", "nsz", "arcp", "afn"}
OPTIONS: dict[str, Any] = {"nogil": True, "fastmath": FAST_MATH, "error_model": "numpy"}

# A kernel has all that it calls inlined: else that would be optimised apart from a new kernel, but
# together with one from the disk, and last digits would tell. Without what only Python needs, it
# takes a sixth less time to compile.
PART = {"forceinline": True, "no_cpython_wrapper": True, "no_cfunc_wrapper": True, **OPTIONS}


class _Compiled:
    """A function that Python and kernels may call, compiled for each when it first does."""

    _lock, _process = threading.Lock(), 0
    _kept: tuple[str, Path] | None = None

    def __init__(self, function: Callable[..., Any]) -> None:
        functools.update_wrapper(self, function)
        self.py_func = function

    @functools.cached_property
    def part(self) -> Any:
        """The arrays that kernels see in its place."""
        import numba

        return numba.njit(**PART)(self.py_func)

    def __call__(self, *given: Any) -> Any:
        if self._process != os.getpid():  # at first, and in a fork, whose folder is another
            with self._lock:
                if self._process != os.getpid():
                    self._whole, self._process = self._made(), os.getpid()
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
        import numba
        from numba.core import config
        from numba.extending import typeof_impl

        if _Compiled not in typeof_impl.registry:
            typeof_impl.register(_Compiled)(lambda compiled, _: numba.typeof(compiled.part))
        listen_for(self.py_func)
        # Without the second, which newer versions have, Numba might take another folder.
        ours = {"CACHE_DIR": "", "CACHE_LOCATOR_CLASSES": "UserProvidedCacheLocator"}
        before = {name: getattr(config, name, "") for name in ours}
        try:
            archive = archive_of(self.py_func)
            self._kept = unpacked(archive), archive
            vars(config).update(ours, CACHE_DIR=self._kept[0])
            return numba.njit(cache=True, **OPTIONS)(self.py_func)
        except (OSError, RuntimeError) as error:
            not_kept(error)
            self._kept = None
            return numba.njit(**OPTIONS)(self.py_func)
        finally:
            vars(config).update(before)


if hasattr(os, "register_at_fork"):  # a fork lacks the thread that may hold the lock
    os.register_at_fork(after_in_child=lambda: setattr(_Compiled, "_lock", threading.Lock()))


def kernel(function: Callable[..., Any]) -> Any:
    """Compile a function without the interpreter lock, for Python to call; kept on disk."""
    return _Compiled(function) if COMPILED else function


inlined = formula = kernel
"""The same, of functions that kernels call, and Python in tests; formulas take numbers alone."""
