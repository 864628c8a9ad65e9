"""Instructions that LLVM does not choose by itself: transposition in registers, wide vectors."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt
from llvmlite import ir
from numba.core import cgutils, types
from numba.extending import intrinsic

from engine_dyn.compilation.settings import COMPILED

__all__ = [
    "SQUARE_SIDE",
    "turn_eights",
    "turn_fours",
    "turn_pairs",
    "wide_vectors",
]

SQUARE_SIDE = 8
"""Lanes that `turn_eights` and its like serve at a time."""


def _transposed(builder: Any, rows: list[Any]) -> list[Any]:
    """Vectors of SQUARE_SIDE numbers with squares of them transposed, side by side.

    A square has as many numbers a side as there are vectors, 2, 4 or 8.
    """
    numbers = ir.VectorType(ir.IntType(32), SQUARE_SIDE)
    half = 1
    # Squares of one, then two, then four numbers a side change places across the diagonal.
    while half < len(rows):
        for i in range(len(rows)):
            if i & half == 0:
                pair = rows[i], rows[i + half]
                for up in (0, half):
                    mask = [
                        (j & ~half) + up + (SQUARE_SIDE if j & half else 0)
                        for j in range(SQUARE_SIDE)
                    ]
                    rows[i + up] = builder.shuffle_vector(*pair, ir.Constant(numbers, mask))
        half *= 2
    return rows


def _turn_rows(fields: int) -> Callable[..., Any]:
    """Intrinsic behind `turn_pairs` and its like."""
    part = ir.VectorType(ir.DoubleType(), fields)

    def turn(typing: Any, source: Any, column: Any, places: Any, begin: Any, target: Any) -> Any:
        def build(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            table, at, to = (
                context.make_array(signature.args[i])(context, builder, arguments[i])
                for i in (0, 2, 4)
            )
            width = cgutils.unpack_tuple(builder, table.shape, 2)[1]

            def row(i: int) -> Any:
                number = builder.add(arguments[3], ir.Constant(arguments[3].type, i))
                place = builder.load(builder.gep(at.data, [number]))
                offset = builder.add(builder.mul(place, width), arguments[1])
                here = builder.bitcast(builder.gep(table.data, [offset]), part.as_pointer())
                return builder.load(here, align=8)

            parts = [row(i) for i in range(SQUARE_SIDE)]
            # Vector i holds rows i, i + fields ..., one behind the other.
            while len(parts) > fields:
                both = list(range(2 * parts[0].type.count))
                mask = ir.Constant(ir.VectorType(ir.IntType(32), len(both)), both)
                parts = [
                    builder.shuffle_vector(parts[i], parts[i + fields], mask)
                    for i in range(len(parts))
                    if i & fields == 0
                ]
            for i, turned in enumerate(_transposed(builder, parts)):
                height = cgutils.unpack_tuple(builder, to.shape, 1)[0]
                step = builder.sdiv(height, ir.Constant(height.type, fields))
                offset = builder.add(builder.mul(step, ir.Constant(step.type, i)), arguments[3])
                pointer = builder.bitcast(builder.gep(to.data, [offset]), turned.type.as_pointer())
                builder.store(turned, pointer, align=8)
            return context.get_dummy_value()

        return types.none(source, types.intp, places, types.intp, target), build

    return turn


def _turn_rows_plainly(fields: int) -> Callable[..., None]:
    def turn(
        source: npt.NDArray[np.float64], column: int, places: npt.NDArray[np.int64], begin: int,
        target: npt.NDArray[np.float64],
    ) -> None:  # fmt: skip
        height = target.size // fields
        for k in range(begin, begin + SQUARE_SIDE):
            target[k::height] = source[places[k], column : column + fields]

    return turn


def _wide(typing: Any) -> Any:
    def build(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        # llvmlite's own set knows attributes without values only; it prints what it holds.
        set.add(builder.function.attributes, '"prefer-vector-width"="512"')
        return context.get_dummy_value()

    return types.none(), build


turn_pairs: Any = intrinsic(_turn_rows(2)) if COMPILED else _turn_rows_plainly(2)
turn_fours: Any = intrinsic(_turn_rows(4)) if COMPILED else _turn_rows_plainly(4)
turn_eights: Any = intrinsic(_turn_rows(8)) if COMPILED else _turn_rows_plainly(8)
"""`turn_eights(source, column, places, begin, target)` takes eight numbers from a column on of the
rows of `source` that SQUARE_SIDE lanes look at, `places` from `begin` on, and writes them to those
lanes of the eight rows of `target`; its like take fewer. A row is read at once, not gathered: with
loops in its place one table takes 25 % longer with exponents 2 and 0 and 7 % with 1.5, designs with
curves from harmonics 22 %."""

wide_vectors: Any = intrinsic(_wide) if COMPILED else lambda: None
"""Says inside a kernel that its vectors should be as wide as the processor has them.

For some processors the compiler prefers half the width, which is meant for programs that use
vectors now and then; here they are all there is. Only the kernel that calls it is affected.
Without it one table takes 2.8 times as long with exponents 2 and 0 and 1.6 times with 1.5, designs
with curves from harmonics 1.07 times (a Xeon with AVX-512).
"""
