"""Arrays on the stack of a kernel: the only arrays that a kernel may make itself."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt
from numba.core import cgutils, types
from numba.core.errors import RequireLiteralValue
from numba.extending import intrinsic
from numba.np import arrayobj

from engine_dyn.compilation.settings import COMPILED

__all__ = ["indices_on_stack", "on_stack", "rows_on_stack"]


def _stack_of(kind: Any) -> Callable[..., Any]:
    array = types.Array(kind, 1, "C")

    def on_stack(typing: Any, size: Any) -> Any:
        if not isinstance(size, types.IntegerLiteral):
            raise RequireLiteralValue(size)

        def build(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            made = arrayobj.make_array(array)(context, builder)
            pointer = cgutils.alloca_once(
                builder, context.get_value_type(kind), size=size.literal_value
            )
            pointer.align = 64  # else most wide loads and stores reach into two lines of the cache
            width = context.get_constant(types.intp, 8)
            arrayobj.populate_array(
                made, data=pointer, shape=[arguments[0]], strides=[width], itemsize=width,
                meminfo=None,
            )  # fmt: skip
            return made._getvalue()

        return array(size), build

    return on_stack


def _rows(typing: Any, size: Any) -> Any:
    array = types.Array(types.float64, 1, "C")

    def build(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        made = arrayobj.make_array(array)(context, builder)
        pointer = builder.alloca(context.get_value_type(types.float64), size=arguments[0])
        pointer.align = 64
        width = context.get_constant(types.intp, 8)
        arrayobj.populate_array(
            made, data=pointer, shape=[arguments[0]], strides=[width], itemsize=width, meminfo=None
        )
        return made._getvalue()

    return array(types.intp), build


def _empty(size: int) -> npt.NDArray[np.float64]:
    return np.empty(size)


def _empty_indices(size: int) -> npt.NDArray[np.int64]:
    return np.empty(size, dtype=np.int64)


on_stack: Any = intrinsic(_stack_of(types.float64)) if COMPILED else _empty
"""Array of a constant number of floats, for kernels: a loop that writes to it and reads other
arrays at places of its own can become vectors, because nothing else can point there."""

indices_on_stack: Any = intrinsic(_stack_of(types.int64)) if COMPILED else _empty_indices
"""The same of whole numbers."""

rows_on_stack: Any = intrinsic(_rows) if COMPILED else _empty
"""As `on_stack`, of a number that only the kernel knows. Not in a loop: the stack would grow, which
is one or two megabytes on some systems."""
