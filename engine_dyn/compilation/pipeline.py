"""How kernels, and the functions that only they call, become machine code.

Numba lets a decorator bring its own compiler (``pipeline_class``). Ours differs from Numba's in the
code libraries alone: each function gets one of the classes below, which are subclasses, so nothing
of Numba is replaced and no other function is affected.

They determine the last digits of results, because LLVM inlines, and so rounds, differently with
other linkage. That is why they are not among the devices that `fast_compile` switches off. Without
them (`POSSIBLE` is false with versions of Numba that lack what they override) kernels compute the
same within rounding, but compile in about twice the time.
"""

from __future__ import annotations

import hashlib
import re
from collections.abc import Callable
from typing import Any

import numba
from numba.core import codegen, compiler

from engine_dyn.compilation.announcing import announce, timed
from engine_dyn.compilation.fast_compile import FAST, collector_at_rest, faster_flags

__all__ = ["POSSIBLE", "KernelCompiler", "PartCompiler"]

_codegen: Any = codegen
_compiler: Any = compiler
_Library: Any = getattr(codegen, "JITCodeLibrary", object)
_Compiler: Any = getattr(compiler, "Compiler", object)


def _known() -> bool:
    """Whether this is a version of Numba that the code below was tried with, with what it needs."""
    version = re.match(r"(\d+)\.(\d+)", numba.__version__)
    if version is None or not (0, 61) <= (int(version[1]), int(version[2])) < (0, 69):
        return False
    needed = (
        "_optimize_final_module",
        "_finalize_final_module",
        "_finalize_dynamic_globals",
        "codegen",
        "enable_object_caching",
    )
    return all(hasattr(_Library, name) for name in needed) and hasattr(_Compiler, "compile_extra")


POSSIBLE = _known()
"""Whether this version of Numba has what is overridden here."""


class _KernelLibrary(_Library):
    """Code of a kernel with copies of its own of all that it calls.

    Numba links functions as weak symbols, which the loader resolves to the first copy in the
    process. For a kernel that was just compiled that is a copy optimised apart from its caller,
    other than for a kernel from the cache, and the last digit of a result could tell them apart.
    """

    def _optimize_final_module(self) -> None:
        linkage = _codegen.ll.Linkage
        defined = [f for f in self._final_module.functions if not f.is_declaration]
        public = sorted(f.name for f in defined if f.linkage == linkage.external)
        # New names too: the loader finds even private functions by name, and LLVM may have taken
        # arguments away from private ones.
        tag = hashlib.sha256("".join(public).encode()).hexdigest()[:16]
        for function in defined:
            if function.linkage == linkage.linkonce_odr:
                function.linkage = linkage.internal
                function.name = f"{function.name}.{tag}"
        super()._optimize_final_module()


class _WithoutEnvironment:
    """Stands for the code generator of a library that no Python code calls."""

    def set_env(self, name: str, environment: Any) -> None:
        """Numba would write to an address that only machine code has."""


class _PartLibrary(_Library):
    """Code of a function that only kernels call, where it is linked in as LLVM's bitcode.

    Numba makes machine code of it nevertheless, which nobody runs: leaving that out saves 13 %.
    """

    def _optimize_final_module(self) -> None:
        # What is always inlined is optimised where it ends up: formulas, and functions that inherit
        # the flag from a formula that calls them. A function for which LLVM has found further
        # attributes lists them in one string with this one, so it does not match and is optimised
        # here. To match it as well would change the last digits of results.
        linkage = _codegen.ll.Linkage
        defined = [f for f in self._final_module.functions if not f.is_declaration]
        public = [f for f in defined if f.linkage == linkage.external]
        if not all(b"alwaysinline" in f.attributes for f in public):
            super()._optimize_final_module()

    if FAST:

        def _finalize_final_module(self) -> None:
            self._finalize_dynamic_globals()
            self._finalized = True

        @property
        def codegen(self) -> Any:
            return _WithoutEnvironment()


class KernelCompiler(_Compiler):
    """Numba's compiler for a function that Python calls."""

    def __init__(self, typing: Any, target: Any, library: Any, *others: Any) -> None:
        *first, flags, locals_ = others
        super().__init__(typing, target, library, *first, faster_flags(flags), locals_)

    def compile_extra(self, function: Callable[..., Any]) -> Any:
        """Compile a Python function into a library of one of the classes above."""
        announce()
        library = self._library()(self.state.targetctx.codegen(), function.__qualname__)
        library.enable_object_caching()
        self.state.library = library
        with timed(), collector_at_rest():
            return super().compile_extra(function)

    def _library(self) -> Any:
        return _KernelLibrary


class PartCompiler(KernelCompiler):
    """Numba's compiler for a function that only kernels call."""

    def _library(self) -> Any:
        return _PartLibrary
