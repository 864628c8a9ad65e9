"""Arrays that follow from a family of diagrams, kept for whoever asks for the same next."""

from __future__ import annotations

import os
import threading
from collections.abc import Callable, Hashable
from typing import Any, TypeVar, cast
from weakref import WeakKeyDictionary

import numpy.typing as npt

from engine_dyn.pressure.family import Family

Arrays = TypeVar("Arrays", bound=tuple[npt.NDArray[Any], ...])


_kept: WeakKeyDictionary[Family, dict[Hashable, tuple[npt.NDArray[Any], ...]]] = WeakKeyDictionary()
_making: dict[tuple[int, Hashable], threading.Lock] = {}
_lock = threading.Lock()


def _renew() -> None:
    """After a fork: a thread that is not there any more may have held the locks."""
    global _lock
    _lock = threading.Lock()
    _making.clear()


if hasattr(os, "register_at_fork"):  # not on Windows
    os.register_at_fork(after_in_child=_renew)


def remembered(family: Family, key: Hashable, make: Callable[[], Arrays]) -> Arrays:
    """Return the arrays of this key, or those that `make` gives. They must not be changed."""
    mine = id(family), key
    with _lock:
        making = _making.setdefault(mine, threading.Lock())
    try:
        with making:  # threads that want the same wait for the one that makes it
            with _lock:
                known = _kept.get(family, {}).get(key)
            if known is not None:
                return cast("Arrays", known)
            made = make()
            with _lock:
                kept = _kept.setdefault(family, {})
                kept[key] = made
                # As many as all groups of a sweep have, which a search for an inertia solves again.
                while kept and (len(kept) > 64 or _bytes_of(kept) > 160_000_000):
                    kept.pop(next(iter(kept)))
            return made
    finally:
        with _lock:
            _making.pop(mine, None)


def _bytes_of(kept: dict[Hashable, tuple[npt.NDArray[Any], ...]]) -> int:
    return sum(array.nbytes for arrays in kept.values() for array in arrays)
