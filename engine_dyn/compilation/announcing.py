"""Saying that kernels are compiled, which takes a while."""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

__all__ = ["COMPILING", "announce", "not_kept", "on_compiling", "seconds_compiling", "timed"]

COMPILING = "compiling kernels for this kind of scene (once; later runs of the kind start at once)"


class _Announcement:
    """What is done when the first kernel of this process has to be compiled."""

    def __init__(self) -> None:
        self.tell: Callable[[], None] = lambda: logging.getLogger("engine_dyn").warning(COMPILING)
        self.told = False
        self.told_not_kept = False


_announcement = _Announcement()


class _Clock(threading.local):
    """How deep in compilers a thread is: they call each other."""

    depth = 0


_clock = _Clock()
_spent = [0.0]
"""Seconds that this process has spent compiling."""


@contextmanager
def timed() -> Iterator[None]:
    """Count the time of a compiler, but not twice where it calls another one."""
    began = time.perf_counter()
    _clock.depth += 1
    try:
        yield
    finally:
        _clock.depth -= 1
        if _clock.depth == 0:
            _spent[0] += time.perf_counter() - began


def seconds_compiling() -> float:
    """Seconds that this process has spent compiling kernels so far."""
    return _spent[0]


def announce() -> None:
    """Tell once; called by the compilers of `pipeline` before they compile anything."""
    if not _announcement.told:
        _announcement.told = True
        _announcement.tell()


def on_compiling(tell: Callable[[], None]) -> None:
    """Call `tell` once, when the first kernel of this process has to be compiled.

    Unless this is called, the logger "engine_dyn" says so as a warning, which Python prints.
    """
    _announcement.tell = tell


def not_kept(folder: str, error: OSError) -> None:
    """Say once, through the logger, that compiled kernels cannot be kept on disk."""
    if not _announcement.told_not_kept:
        _announcement.told_not_kept = True
        logging.getLogger("engine_dyn").warning(
            "compiled kernels cannot be cached in %s (%s): later runs will compile them again",
            folder, error.strerror or error,
        )  # fmt: skip
