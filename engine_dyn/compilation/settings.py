"""What Numba is set to, and when it compiles, which takes a while and is said."""

from __future__ import annotations

import logging
from collections.abc import Callable
from typing import Any

import numba
from llvmlite import binding
from numba.core import config, event

__all__ = [
    "COMPILED", "COMPILING", "NUMBA", "listen_for", "not_kept", "on_compiling", "processor",
    "processor_features", "seconds_compiling", "threading_layer",
]  # fmt: skip

COMPILING = "compiling kernels for this kind of scene (once; later runs of the kind start at once)"

NUMBA: Any = config
"""Numba's own settings, which its environment variables and files determine."""

COMPILED = not NUMBA.DISABLE_JIT
"""False with ``NUMBA_DISABLE_JIT=1``: kernels are then plain Python functions."""


def processor() -> str:
    """Kind of processor that kernels are compiled for: where it is the same, so are all bits."""
    return str(NUMBA.CPU_NAME or binding.get_host_cpu_name())


def processor_features() -> tuple[str, ...]:
    """Instructions that kernels may use, sorted: a virtual machine may have fewer than its kind."""
    chosen = NUMBA.CPU_FEATURES
    features = binding.get_host_cpu_features().flatten() if chosen is None else chosen
    return tuple(sorted(f[1:] for f in features.split(",") if f.startswith("+")))


def threading_layer() -> str:
    """Numba's threading layer, where one is in use; kernels of this package need none."""
    try:
        return str(numba.threading_layer())  # type: ignore[attr-defined]
    except ValueError:  # none was started
        return "none; kernels run on a pool of threads"


class _Listener(event.TimingListener):
    """Counts the time of compilations of our functions; of one within another once."""

    def __init__(self) -> None:
        super().__init__()
        self.functions: set[Callable[..., Any]] = set()
        self.told = self.told_not_kept = False
        self.tell: Callable[[], None] = lambda: logging.getLogger("engine_dyn").warning(COMPILING)

    def notify(self, event: Any) -> None:
        """Take note of a beginning or an end; Numba's lock lets one thread compile at a time."""
        if event.data["dispatcher"].py_func in self.functions:
            if not self.told:
                self.told = True
                self.tell()
            super().notify(event)


_listener = _Listener()


def listen_for(function: Callable[..., Any]) -> None:
    """Announce the compilation of a function; until the first one, Numba is left as it is."""
    if not _listener.functions:
        event.register("numba:compile", _listener)
    _listener.functions.add(function)


def seconds_compiling() -> float:
    """Seconds that this process has spent compiling kernels so far."""
    return _listener.duration if _listener.done else 0.0


def on_compiling(tell: Callable[[], None]) -> None:
    """Call `tell` once, when the first kernel has to be compiled; else the logger warns of it."""
    _listener.tell = tell


def not_kept(error: Exception) -> None:
    """Say once, through the logger, that compiled kernels cannot be kept on disk."""
    if not _listener.told_not_kept:
        _listener.told_not_kept = True
        text = "compiled kernels cannot be cached (%s): later runs will compile them again"
        logging.getLogger("engine_dyn").warning(text, error)
