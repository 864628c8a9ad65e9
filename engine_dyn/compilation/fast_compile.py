"""What only makes compilation faster; ``ENGINE_DYN_FAST_COMPILE=0`` switches all of it off.

Nothing of Numba is replaced. Each device below belongs to one compilation of one of our functions
(`engine_dyn.compilation.pipeline` puts them there), so other people's functions never meet it. The
results are the same to the bit without. Each docstring says what its device saves of the first run
of one design, in processor time.
"""

from __future__ import annotations

import contextlib
import gc
import os
from collections.abc import Iterator
from typing import Any

from numba.core import compiler
from numba.core.compiler_lock import global_compiler_lock

__all__ = ["FAST", "collector_at_rest", "faster_flags"]

FAST = os.environ.get("ENGINE_DYN_FAST_COMPILE", "1").strip() != "0"
"""Whether compilation is made faster; it is unless the environment variable is 0."""

_lock: Any = global_compiler_lock


@contextlib.contextmanager
def collector_at_rest() -> Iterator[None]:
    """Keep the garbage collector still while one of our functions compiles (saves 8 %).

    It would search through everything that the compiler holds again and again. Functions compile
    within the kernel that calls them: the inner ones find the collector off and leave it so.
    Numba's own lock, which any compilation must hold, keeps other threads' compilations out.
    """
    if not FAST:
        yield
        return
    with _lock:
        enabled = gc.isenabled()
        try:
            if enabled:
                gc.disable()
            yield
        finally:
            if enabled:
                gc.enable()


def _make_flags() -> Any:
    """Subclass of Numba's flags, or None where they are not made as expected."""
    flags: Any = compiler.Flags
    try:
        defaults = {name: option.default for name, option in flags.options.items()}
        names_hash = hash(flags())  # Numba's hash is that of the names, whatever the values

        # The name of the class becomes part of the compiled functions' names: it stays the same.
        class Flags(flags):
            """Numba's flags, with a faster way to all their values."""

            def values(self) -> dict[str, Any]:
                return {**defaults, **self._values}

            def __eq__(self, other: object) -> bool:
                set_alike = type(other) is type(self) and self._values == other._values
                return set_alike or bool(super().__eq__(other))

            def __hash__(self) -> int:
                return names_hash

        example = flags()
        example.error_model = "numpy"
        as_expected = hash(example) == names_hash and Flags(example).values() == example.values()
        return Flags if as_expected else None
    except (AttributeError, TypeError):
        return None


_FLAGS = _make_flags() if FAST else None


def faster_flags(flags: Any) -> Any:
    """Copy of `flags` whose values are read at once instead of one by one (saves 6 %).

    Numba compares all flags at each call in a kernel, and reads each through a property.
    """
    return flags if _FLAGS is None else _FLAGS(flags)
