"""The decorators of kernels and of the functions that they call.

Kernels compile when first called, never on import.
"""

from __future__ import annotations

import weakref
from collections.abc import Callable
from typing import Any

import numba
from numba.core import types

from engine_dyn.compilation import pipeline
from engine_dyn.compilation.cache import keep_on_disk

__all__ = ["FAST_MATH", "formula", "inlined", "kernel"]

FAST_MATH = {"reassoc", "contract", "nsz", "arcp", "afn"}
"""Rounding may differ from strict IEEE order; NaN and infinity keep their meaning (numba#2919)."""

# No references are counted inside kernels: the caller holds all arrays that it hands over, and each
# count is an atomic operation on memory that all threads share. So a kernel makes no arrays but
# those on its stack.
OPTIONS: dict[str, Any] = {
    "nogil": True, "fastmath": FAST_MATH, "error_model": "numpy", "_nrt": False,
}  # fmt: skip

_functions: weakref.WeakSet[Callable[..., Any]] = weakref.WeakSet()


def _compiled(function: Callable[..., Any], compiler: Any, **options: Any) -> Any:
    """Compile a function with one of our compilers where there is one."""
    if pipeline.POSSIBLE:
        options["pipeline_class"] = compiler
    _functions.add(function)
    return numba.njit(**OPTIONS, **options)(function)


def kernel(function: Callable[..., Any]) -> Any:
    """Compile a function without the interpreter lock, lazily, cached by the package's sources.

    With ``NUMBA_DISABLE_JIT=1`` the plain Python function comes back.
    """
    dispatcher = _compiled(function, pipeline.KernelCompiler)
    if hasattr(dispatcher, "enable_caching"):
        keep_on_disk(dispatcher)
    return dispatcher


def inlined(function: Callable[..., Any]) -> Any:
    """Compile a function that only other kernels call; it needs no cache.

    No argument is a literal inside: what Numba itself must know is told by length or dimensions.
    """
    return _part_of_kernels(function)


def formula(function: Callable[..., Any]) -> Any:
    """Compile a small formula that is inlined wherever it is called, so that loops become vectors.

    The compiler by itself leaves a formula that is called often to a call: one table then takes 3
    to 7 % longer, and last digits change. No argument is a literal inside, but constants are known
    to LLVM.
    """
    return _part_of_kernels(function, forceinline=True)


def _part_of_kernels(function: Callable[..., Any], **options: Any) -> Any:
    """Compile a function for kernels to call, without what Python needs to call it.

    Where Python calls it nevertheless, as tests do, it is compiled once more for that.
    """
    alone = _compiled(function, pipeline.KernelCompiler, **options)
    if not pipeline.POSSIBLE or not hasattr(alone, "add_overload"):
        return alone
    options |= {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}
    dispatcher = _compiled(function, pipeline.PartCompiler, **options)

    def add_for_kernels(compiled: Any) -> None:
        dispatcher.overloads[tuple(compiled.signature.args)] = compiled

    resolve = dispatcher.get_call_template

    # Numba would compile it once for each constant that it is called with; where it ends up in its
    # kernel, LLVM knows the constant anyway.
    def resolve_for_any(arguments: Any, named: dict[str, Any]) -> Any:
        return resolve(
            [types.unliteral(kind) for kind in arguments],
            {name: types.unliteral(kind) for name, kind in named.items()},
        )

    # Attributes of this one dispatcher; its class stays as it is.
    dispatcher.get_call_template = resolve_for_any
    dispatcher.add_overload = add_for_kernels
    dispatcher._compile_for_args = alone._compile_for_args
    return dispatcher
