"""What Numba is set to, and when it compiles, which takes a while and is said.

Numba takes a third of a second to import: it is, when the first kernel is called.
"""

from __future__ import annotations

import logging
import os
import time
from collections.abc import Callable
from typing import Any

__all__ = [
    "COMPILED", "COMPILING", "listen_for", "not_kept", "on_compiling", "processor",
    "processor_features", "seconds_compiling", "settings", "threading_layer",
]  # fmt: skip

COMPILING = "compiling kernels for this kind of scene (once; later runs of the kind start at once)"

COMPILED = os.environ.get("NUMBA_DISABLE_JIT", "0") in {"", "0"}
"""False with ``NUMBA_DISABLE_JIT=1``: kernels are then plain Python functions."""


def settings() -> Any:
    """Return Numba's own settings, which its environment variables and files determine."""
    from numba.core import config

    return config


def processor() -> str:
    """Kind of processor that kernels are compiled for: where it is the same, so are all bits."""
    from llvmlite import binding

    return str(settings().CPU_NAME or binding.get_host_cpu_name())


def processor_features() -> tuple[str, ...]:
    """Instructions that kernels may use, sorted: a virtual machine may have fewer than its kind."""
    from llvmlite import binding

    chosen = settings().CPU_FEATURES
    features = binding.get_host_cpu_features().flatten() if chosen is None else chosen
    return tuple(sorted(f[1:] for f in features.split(",") if f.startswith("+")))


def threading_layer() -> str:
    """Numba's threading layer, where one is in use; kernels of this package need none."""
    import numba

    try:
        return str(numba.threading_layer())  # type: ignore[attr-defined]
    except ValueError:  # none was started
        return "none; kernels run on a pool of threads"


class _Clock:
    """Counts the time of compilations of our functions; of one within another once.

    Numba calls it as one of its listeners (`numba.core.event`); it holds no other state of Numba,
    so that asking for the time does not import it.
    """

    def __init__(self) -> None:
        self.functions: set[Callable[..., Any]] = set()
        self.told = self.told_not_kept = False
        self.seconds, self.began, self.depth = 0.0, 0.0, 0
        self.tell: Callable[[], None] = lambda: logging.getLogger("engine_dyn").warning(COMPILING)

    def notify(self, event: Any) -> None:
        """Take note of a beginning or an end; Numba's lock lets one thread compile at a time."""
        if event.data["dispatcher"].py_func not in self.functions:
            return
        if not self.told:
            self.told = True
            self.tell()
        if event.is_start and self.depth == 0:
            self.began = time.perf_counter()
        self.depth += 1 if event.is_start else -1
        if self.depth == 0:
            self.seconds += time.perf_counter() - self.began


_clock = _Clock()


def listen_for(function: Callable[..., Any]) -> None:
    """Announce the compilation of a function; until the first one, Numba is left as it is."""
    if not _clock.functions:
        from numba.core import event

        event.Listener.register(_Clock)
        event.register("numba:compile", _clock)
    _clock.functions.add(function)


def seconds_compiling() -> float:
    """Seconds that this process has spent compiling kernels so far."""
    return _clock.seconds


def on_compiling(tell: Callable[[], None]) -> None:
    """Call `tell` once, when the first kernel has to be compiled; else the logger warns of it."""
    _clock.tell = tell


def not_kept(error: Exception) -> None:
    """Say once, through the logger, that compiled kernels cannot be kept on disk."""
    if not _clock.told_not_kept:
        _clock.told_not_kept = True
        text = "compiled kernels cannot be cached (%s): later runs will compile them again"
        logging.getLogger("engine_dyn").warning(text, error)
