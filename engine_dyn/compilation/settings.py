"""Settings of Numba, and when it compiles; this is imported when a kernel is first called."""

from __future__ import annotations

import logging
import os
from collections.abc import Callable
from functools import cache
from typing import Any

COMPILING = "compiling kernels for this kind of scene (once; later runs of the kind start at once)"

COMPILED = os.environ.get("NUMBA_DISABLE_JIT", "0") in {"", "0"}
"""False with ``NUMBA_DISABLE_JIT=1``: kernels are then plain Python functions."""


def processor() -> str:
    """Kind of processor that kernels are compiled for: where it is the same, so are all bits."""
    from llvmlite import binding
    from numba.core import config

    return str(vars(config)["CPU_NAME"] or binding.get_host_cpu_name())


def processor_features() -> tuple[str, ...]:
    """Instructions that kernels may use, sorted: a virtual machine may have fewer than its kind."""
    from llvmlite import binding
    from numba.core import config

    chosen = vars(config)["CPU_FEATURES"]
    features = binding.get_host_cpu_features().flatten() if chosen is None else chosen
    return tuple(sorted(f[1:] for f in features.split(",") if f.startswith("+")))


_functions: set[Callable[..., Any]] = set()
_said: set[str] = set()
_tell = [lambda: logging.getLogger("engine_dyn").warning(COMPILING)]


@cache
def _listener() -> Any:
    """Count the time of compilations of our functions; of one within another once."""
    from numba.core import event

    class Listener(event.TimingListener):
        def notify(self, event: Any) -> None:  # Numba's lock lets one thread compile at a time
            if event.data["dispatcher"].py_func in _functions:
                if "compiling" not in _said:
                    _said.add("compiling")
                    _tell[0]()
                super().notify(event)

    listener = Listener()
    event.register("numba:compile", listener)
    return listener


def listen_for(function: Callable[..., Any]) -> None:
    """Announce the compilation of a function; until the first one, Numba is left as it is."""
    _functions.add(function)
    _listener()


def seconds_compiling() -> float:
    """Seconds that this process has spent compiling kernels so far."""
    return float(_listener().duration) if _functions and _listener().done else 0.0


def on_compiling(tell: Callable[[], None]) -> None:
    """Call `tell` once, when the first kernel has to be compiled; else the logger warns of it."""
    _tell[0] = tell


def not_kept(error: Exception) -> None:
    """Say once, through the logger, that compiled kernels cannot be kept on disk."""
    if "not kept" not in _said:
        _said.add("not kept")
        text = "compiled kernels cannot be cached (%s): later runs will compile them again"
        logging.getLogger("engine_dyn").warning(text, error)
