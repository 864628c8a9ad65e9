"""What Numba is set to, and what processor it compiles for."""

from __future__ import annotations

from typing import Any

import numba
from numba.core import codegen

__all__ = ["COMPILED", "NUMBA", "processor", "processor_features", "threading_layer"]

# Neither module declares all the names that it has.
_codegen: Any = codegen
_numba: Any = numba

NUMBA: Any = numba.config
"""Numba's own settings, which its environment variables and files determine."""

COMPILED = not NUMBA.DISABLE_JIT
"""False with ``NUMBA_DISABLE_JIT=1``: kernels are then plain Python functions."""


def processor() -> str:
    """Kind of processor that kernels are compiled for: where it is the same, so are all bits."""
    return str(NUMBA.CPU_NAME or _codegen.ll.get_host_cpu_name())


def processor_features() -> tuple[str, ...]:
    """Instructions that kernels may use, sorted: a virtual machine may have fewer than its kind."""
    chosen = NUMBA.CPU_FEATURES
    features = _codegen.get_host_cpu_features() if chosen is None else chosen
    return tuple(sorted(f[1:] for f in features.split(",") if f.startswith("+")))


def threading_layer() -> str:
    """Numba's threading layer, where one is in use; kernels of this package need none."""
    try:
        return str(_numba.threading_layer())
    except ValueError:  # none was started
        return "none; kernels run on a pool of threads"
