"""Saying that kernels are compiled, which takes a while."""

from __future__ import annotations

import logging
from collections.abc import Callable

__all__ = ["COMPILING", "announce", "not_kept", "on_compiling"]

COMPILING = "compiling kernels (once for this version; later runs start at once)"


class _Announcement:
    """What is done when the first kernel of this process has to be compiled."""

    def __init__(self) -> None:
        self.tell: Callable[[], None] = lambda: logging.getLogger("engine_dyn").warning(COMPILING)
        self.told = False
        self.told_not_kept = False


_announcement = _Announcement()


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
