"""Functions that the compiler chooses by the type of an argument."""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable
from typing import Any

from numba import extending

from engine_dyn.compilation.decorators import OPTIONS, inlined

__all__ = ["by_type"]


def by_type(function: Callable[..., Any]) -> Any:
    """Make a function that the compiler chooses by the type of the last argument.

    The function itself is the general case. What is done instead for a class of named tuples is
    registered with ``@function.of(Class)``. The choice costs nothing at run time, because types are
    known when a kernel is compiled.
    """
    general = inlined(function)
    special: dict[Any, Any] = {}
    arguments = ", ".join(inspect.signature(function).parameters)

    @functools.wraps(function)
    def call(*given: Any) -> Any:  # without the compiler
        return special.get(type(given[-1]), general)(*given)

    def choose(*types: Any) -> Any:
        chosen = special.get(getattr(types[-1], "instance_class", None), general)
        names: dict[str, Any] = {"chosen": chosen}
        # Numba wants the arguments by name.
        exec(f"def forward({arguments}): return chosen({arguments})", names)
        return names["forward"]

    def of(kind: type) -> Callable[[Callable[..., Any]], Any]:
        def register(implementation: Callable[..., Any]) -> Any:
            special[kind] = inlined(implementation)
            return special[kind]

        return register

    options: Any = {**OPTIONS, "forceinline": True}
    extending.overload(call, jit_options=options, strict=False)(choose)
    call.of = of  # type: ignore[attr-defined]  # functions may have attributes
    return call
