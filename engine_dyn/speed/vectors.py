"""Numbers of LANES designs side by side, as one value of a kernel.

A vector is computed with as a number is: it stays in registers, and a kernel that is written for
one design solves as many as a vector has lanes. Loops over lanes instead took seven times as long:
the compiler asks at each of them whether its arrays overlap. Without compiling, vectors are arrays.
"""

from __future__ import annotations

import itertools
import math
import operator
from collections.abc import Callable
from typing import Any

import numpy as np
from llvmlite import ir
from numba import types
from numba.extending import lower_builtin, models, register_model, type_callable, typeof_impl

from engine_dyn.plain_arrays import PlainArray, PlainType, address_of, type_of

LANES = 16
"""Designs in a block. With 8 a pass takes 1.3 times as long, because it waits for its results."""

LINE = 8  # Numbers in a cache line: rows that straddle two make kernels 12 to 20 % slower


class VectorType(types.Type):
    """View that kernels have of a vector of numbers, or of truths."""

    def __init__(self, name: str, element: Any) -> None:
        super().__init__(name=name)
        self.element = element


VECTOR, TRUTHS = (
    VectorType("Vector", ir.DoubleType()), VectorType("Truths", ir.IntType(1)),
)  # fmt: skip


@register_model(VectorType)
class _Model(models.PrimitiveModel):
    def __init__(self, manager: Any, kind: VectorType) -> None:
        super().__init__(manager, kind, ir.VectorType(kind.element, LANES))


# --- functions for numbers and vectors ------------------------------------------------------------


def where(truth: Any, one: Any, other: Any) -> Any:
    """Return the first where it is true, the second where not."""
    return np.where(truth, one, other)


def any_of(truths: Any) -> bool:
    """Whether any is true."""
    return bool(np.any(truths))


def read(rows: Any, row: int) -> Any:
    """Vector of a row of `Rows` (row, lane)."""
    return rows[row].copy()


def write(rows: Rows, row: int, value: Any) -> None:
    """Put a vector, or one number for all lanes, into a row of `Rows` (row, lane)."""
    rows[row] = value


# --- compilation of these functions ---------------------------------------------------------------


def _in_all_lanes(builder: Any, value: Any) -> Any:
    """Vector with the same number in all lanes."""
    nothing = ir.Constant(ir.VectorType(value.type, LANES), ir.Undefined)
    index = ir.Constant(ir.VectorType(ir.IntType(32), LANES), [0] * LANES)
    first = builder.insert_element(nothing, value, ir.Constant(ir.IntType(32), 0))
    return builder.shuffle_vector(first, nothing, index)


def _teach(function: Any, build: Callable[..., Any], result: Any, of_numbers: Any = None) -> None:
    """Compile a function of vectors and numbers: `build` makes its instructions.

    `result` is the type with any vector among the inputs, `of_numbers` with none; None where Numba
    knows it. If one of two inputs is NaN, larger and smaller are the second.
    """
    inputs = build.__code__.co_argcount - 1

    def kind_of(*given: Any) -> Any:
        return result if any(isinstance(kind, VectorType) for kind in given) else of_numbers

    typers = (lambda a: kind_of(a), lambda a, b: kind_of(a, b), lambda a, b, c: kind_of(a, b, c))
    type_callable(function)(lambda context: typers[inputs - 1])

    def lower(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        wide, given = isinstance(signature.return_type, VectorType), []
        for kind, value in zip(signature.args, values, strict=True):
            if isinstance(kind, types.Number):
                number = context.cast(builder, value, kind, types.float64)
                given.append(_in_all_lanes(builder, number) if wide else number)
            else:
                given.append(value)
        return build(builder, *given)

    for kinds in itertools.product((VectorType, types.Number, types.Boolean), repeat=inputs):
        if VectorType in kinds or of_numbers is not None:
            lower_builtin(function, *kinds)(lower)


def _intrinsic(name: str) -> Callable[..., Any]:
    """Instruction of LLVM that takes one value."""

    def build(builder: Any, a: Any) -> Any:
        whole, kind = ir.FunctionType(a.type, [a.type]), f"llvm.{name}.v{LANES}f64"
        return builder.call(builder.module.declare_intrinsic(kind, fnty=whole), [a])

    return build


def _select(sign: str) -> Callable[..., Any]:
    """Instruction that gives the first of two where it compares so with the second."""
    return lambda builder, a, b: builder.select(builder.fcmp_ordered(sign, a, b), a, b)


NUMBER = types.float64
_teach(operator.add, lambda builder, a, b: builder.fadd(a, b), VECTOR)
_teach(operator.sub, lambda builder, a, b: builder.fsub(a, b), VECTOR)
_teach(operator.mul, lambda builder, a, b: builder.fmul(a, b), VECTOR)
_teach(operator.truediv, lambda builder, a, b: builder.fdiv(a, b), VECTOR)
_teach(operator.gt, lambda builder, a, b: builder.fcmp_ordered(">", a, b), TRUTHS)
_teach(operator.ge, lambda builder, a, b: builder.fcmp_ordered(">=", a, b), TRUTHS)
_teach(operator.lt, lambda builder, a, b: builder.fcmp_ordered("<", a, b), TRUTHS)
_teach(operator.le, lambda builder, a, b: builder.fcmp_ordered("<=", a, b), TRUTHS)
_teach(operator.and_, lambda builder, a, b: builder.and_(a, b), TRUTHS)
_teach(np.maximum, _select(">"), VECTOR)
_teach(np.minimum, _select("<"), VECTOR)
_teach(np.sqrt, _intrinsic("sqrt"), VECTOR)
_teach(np.abs, _intrinsic("fabs"), VECTOR)
_teach(where, lambda builder, a, b, c: builder.select(a, b, c), VECTOR, NUMBER)


@type_callable(any_of)
def _any_kind(context: Any) -> Any:
    return lambda truths: types.boolean


@lower_builtin(any_of, VectorType)
def _any(context: Any, builder: Any, signature: Any, values: Any) -> Any:
    whole = builder.bitcast(values[0], ir.IntType(LANES))
    return builder.icmp_unsigned("!=", whole, ir.Constant(whole.type, 0))


# --- rows of vectors ------------------------------------------------------------------------------


class Rows(PlainArray):
    """Vectors, or whole numbers of each lane, (row, lane)."""


def rows_of(array: Any) -> Rows:
    """The same numbers, in rows of LANES."""
    return np.ascontiguousarray(array).reshape(-1, LANES).view(Rows)


def new_plain(*shape: int) -> PlainArray:
    """Zeros, the first of which begins a line of the processor's cache."""
    size = math.prod(shape)
    whole = np.zeros(size + LINE)
    first = -whole.ctypes.data % (8 * LINE) // 8
    return whole[first : first + size].reshape(shape).view(PlainArray)


def new_rows(rows: int) -> Rows:
    """Rows of zeros."""
    return new_plain(rows, LANES).view(Rows)


typeof_impl.register(Rows)(lambda rows, context: type_of(rows.dtype, 2, LANES))


def _vector_at(context: Any, builder: Any, signature: Any, values: Any) -> Any:
    """Address of a vector."""
    place = address_of(context, builder, signature, values)
    return builder.bitcast(place, ir.VectorType(ir.DoubleType(), LANES).as_pointer())


def _read(context: Any, builder: Any, signature: Any, values: Any) -> Any:
    return builder.load(_vector_at(context, builder, signature, values), align=8)


def _write(context: Any, builder: Any, signature: Any, values: Any) -> Any:
    value = values[2]
    if isinstance(signature.args[2], types.Number):
        value = _in_all_lanes(builder, context.cast(builder, value, signature.args[2], NUMBER))
    builder.store(value, _vector_at(context, builder, signature, values), align=8)
    return context.get_dummy_value()


type_callable(read)(lambda context: lambda array, row: VECTOR)
type_callable(write)(lambda context: lambda array, row, value: types.void)
lower_builtin(read, PlainType, types.Integer)(_read)
lower_builtin(write, PlainType, types.Integer, VectorType)(_write)
lower_builtin(write, PlainType, types.Integer, types.Number)(_write)
