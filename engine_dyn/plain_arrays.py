"""Arrays of which kernels see the address and the shape alone.

Of an array in a named tuple, Numba takes apart seven fields and counts a reference wherever it is
handed on. Without that a kernel of many such arrays takes a quarter less time to compile; and
counting, for which a processor stops all else, took 40 % of the time of designs with one work
table. Whoever calls the kernel keeps the arrays. Kernels index them, wholly or from the first axis
on, and ask for `len` and `shape`.
"""

from __future__ import annotations

import operator
from functools import lru_cache
from typing import Any

import numpy as np
from numba import from_dtype, types
from numba.core import cgutils
from numba.extending import (
    NativeValue,
    lower_builtin,
    make_attribute_wrapper,
    models,
    register_model,
    type_callable,
    typeof_impl,
    unbox,
)


class PlainArray(np.ndarray):
    """A view of an array for kernels; it is contiguous."""

    # Without this attribute Numba takes this class for a common array, and searches for the
    # compiled kernel at each call: a sixth of a small run's time. Boolean and read-only arrays are
    # taken for common ones even with it.
    __numba_array_subtype_dispatch__ = True


def plain(value: Any) -> Any:
    """Views of an array, or of all arrays of a named tuple, and of those in it."""
    if isinstance(value, tuple):
        return type(value)(*map(plain, value))
    if not isinstance(value, np.ndarray) or isinstance(value, PlainArray):
        return value
    return np.ascontiguousarray(value).view(PlainArray) if value.ndim else value.item()


class PlainType(types.Type):
    """The part of an array that kernels see; the last axis may have a length that is known."""

    def __init__(self, item: Any, ndim: int, columns: int = 0) -> None:
        super().__init__(name=f"PlainArray({item}, {ndim}, {columns})")
        self.item, self.ndim, self.columns = item, ndim, columns


@lru_cache
def type_of(dtype: Any, ndim: int, columns: int = 0) -> PlainType:
    """Type of such arrays; Numba asks for it at every call of a kernel."""
    return PlainType(from_dtype(dtype), ndim, columns)


typeof_impl.register(PlainArray)(lambda array, context: type_of(array.dtype, array.ndim))


@register_model(PlainType)
class _Model(models.StructModel):
    def __init__(self, manager: Any, kind: PlainType) -> None:
        shape = types.UniTuple(types.intp, kind.ndim - bool(kind.columns))
        super().__init__(manager, kind, [("data", types.CPointer(kind.item)), ("shape", shape)])


make_attribute_wrapper(PlainType, "shape", "shape")


@unbox(PlainType)
def _unbox(kind: Any, array: Any, c: Any) -> Any:
    """Read an array's address and shape from the Python object."""
    whole = types.Array(kind.item, kind.ndim, "C")
    native = c.unbox(whole, array).value
    native_array = c.context.make_array(whole)(c.context, c.builder, native)
    shape = cgutils.unpack_tuple(c.builder, native_array.shape)[: kind.ndim - bool(kind.columns)]
    packed = c.builder.bitcast(
        native_array.data, c.context.get_value_type(types.CPointer(kind.item))
    )
    made = cgutils.pack_struct(c.builder, [packed, cgutils.pack_array(c.builder, shape)])
    c.context.nrt.decref(c.builder, whole, native)
    return NativeValue(made)


@type_callable(len)
def _length_kind(context: Any) -> Any:
    return lambda array: types.intp if isinstance(array, PlainType) else None


@lower_builtin(len, PlainType)
def _length(context: Any, builder: Any, signature: Any, values: Any) -> Any:
    array = cgutils.create_struct_proxy(signature.args[0])(context, builder, values[0])
    return builder.extract_value(array.shape, 0)


def address_of(context: Any, builder: Any, signature: Any, values: Any) -> Any:
    """Address of what the first indices of an array lead to."""
    kind, index = signature.args[:2]
    several = isinstance(index, types.BaseTuple)
    indices = cgutils.unpack_tuple(builder, values[1]) if several else [values[1]]
    array = cgutils.create_struct_proxy(kind)(context, builder, values[0])
    lengths = cgutils.unpack_tuple(builder, array.shape)
    if kind.columns:
        lengths.append(lengths[0].type(kind.columns))
    place = lengths[0].type(0)
    for axis, length in enumerate(lengths):
        place = builder.mul(place, length) if axis else place
        if axis < len(indices):
            kind_of_index = index[axis] if several else index
            here = context.cast(builder, indices[axis], kind_of_index, types.intp)
            place = builder.add(place, here) if axis else here
    return builder.gep(array.data, [place])


@type_callable(operator.getitem)
def _item_kind(context: Any) -> Any:
    def kind_of(array: Any, index: Any) -> Any:
        if not isinstance(array, PlainType):
            return None
        given = len(index) if isinstance(index, types.BaseTuple) else 1
        return array.item if given == array.ndim else PlainType(array.item, array.ndim - given)

    return kind_of


@type_callable(operator.setitem)
def _put_kind(context: Any) -> Any:
    return lambda array, index, value: types.void if isinstance(array, PlainType) else None


def _item(context: Any, builder: Any, signature: Any, values: Any) -> Any:
    """A number, or the array over the axes that are left after indexing."""
    address, kind_of_item = address_of(context, builder, signature, values), signature.return_type
    if not isinstance(kind_of_item, PlainType):
        return context.unpack_value(builder, kind_of_item, address)
    array = cgutils.create_struct_proxy(signature.args[0])(context, builder, values[0])
    lengths = cgutils.unpack_tuple(builder, array.shape)[-kind_of_item.ndim :]
    return cgutils.pack_struct(builder, [address, cgutils.pack_array(builder, lengths)])


def _put(context: Any, builder: Any, signature: Any, values: Any) -> Any:
    item = signature.args[0].item
    value = context.cast(builder, values[2], signature.args[2], item)
    context.pack_value(builder, item, value, address_of(context, builder, signature, values))
    return context.get_dummy_value()


for _index in (types.BaseTuple, types.Integer):
    lower_builtin(operator.getitem, PlainType, _index)(_item)
    for _value in (types.Number, types.Boolean):
        lower_builtin(operator.setitem, PlainType, _index, _value)(_put)
