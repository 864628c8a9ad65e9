"""A product of axes as kernels see it: flat values, strides, and the positions of one part."""

from __future__ import annotations

from typing import NamedTuple

from engine_dyn.compilation import inlined
from engine_dyn.speed.fields import INPUTS, OUTPUT
from engine_dyn.types import Floats, Integers

__all__ = [
    "Product",
    "count_of",
    "offsets_at",
    "other_offsets_at",
    "value_at",
    "varies",
    "varying_offsets_at",
]


class Product(NamedTuple):
    """Inputs of a part of a sweep.

    Attributes
    ----------
    table_axes, other_axes : ndarray
        Axes on which the tables depend, and the others.
    shape : ndarray
        Positions along each axis.
    strides : ndarray, shape (axes, INPUTS)
        Step of each input's flat index per position of the whole axis; 0 where it does not depend.
    positions, position_start : ndarray
        Where along each axis the part lies; the positions of all axes one after the other.
    values, value_start : ndarray
        All inputs one after the other, flat.
    """

    table_axes: Integers
    other_axes: Integers
    shape: Integers
    strides: Integers
    positions: Integers
    position_start: Integers
    values: Floats
    value_start: Integers


@inlined
def count_of(axes: Integers, product: Product) -> int:
    """Number of combinations along `axes`."""
    count = 1
    for i in range(axes.size):
        count *= product.shape[axes[i]]
    return count


@inlined
def offsets_at(
    index: int, axes: Integers, product: Product, start: Integers, offsets: Integers
) -> None:
    """Place of every input in `values` (of OUTPUT in the results) at flat `index` over `axes`.

    The last axis runs fastest. `start` is added: the offsets of the other axes.
    """
    for i in range(INPUTS):
        offsets[i] = start[i]
    for back in range(axes.size):
        axis = axes[axes.size - 1 - back]
        size = product.shape[axis]
        here = product.positions[product.position_start[axis] + index % size]
        index //= size
        for i in range(INPUTS):
            offsets[i] += product.strides[axis, i] * here


@inlined
def varies(field: int, product: Product) -> bool:
    """Whether an input, or the place of the results, differs between designs."""
    steps = 0
    for axis in range(product.strides.shape[0]):
        steps += abs(product.strides[axis, field])
    return steps > 0


@inlined
def varying_offsets_at(
    table: int, other: int, fields: Integers, product: Product, offsets: Integers
) -> None:
    """As `offsets_at`, for some fields, at flat indices over both kinds of axes."""
    for i in range(fields.size):
        offsets[fields[i]] = product.value_start[fields[i]]
    for kind in range(2):
        axes, index = (product.table_axes, table) if kind == 0 else (product.other_axes, other)
        for back in range(axes.size):
            axis = axes[axes.size - 1 - back]
            size = product.shape[axis]
            here = product.positions[product.position_start[axis] + index % size]
            index //= size
            for i in range(fields.size):
                offsets[fields[i]] += product.strides[axis, fields[i]] * here


@inlined
def other_offsets_at(
    index: int, fields: Integers, product: Product, start: Integers, offsets: Integers
) -> None:
    """As `offsets_at` over the other axes, for some fields and the place of the results."""
    for i in range(fields.size):
        offsets[fields[i]] = start[fields[i]]
    offsets[OUTPUT] = start[OUTPUT]
    axes = product.other_axes
    for back in range(axes.size):
        axis = axes[axes.size - 1 - back]
        size = product.shape[axis]
        here = product.positions[product.position_start[axis] + index % size]
        index //= size
        for i in range(fields.size):
            offsets[fields[i]] += product.strides[axis, fields[i]] * here
        offsets[OUTPUT] += product.strides[axis, OUTPUT] * here


@inlined
def value_at(which: int, index: int, product: Product) -> float:
    """Value of one input on which tables depend, at flat `index` over the axes of tables."""
    axes = product.table_axes
    place = product.value_start[which]
    for back in range(axes.size):
        axis = axes[axes.size - 1 - back]
        size = product.shape[axis]
        here = product.positions[product.position_start[axis] + index % size]
        index //= size
        place += product.strides[axis, which] * here
    return product.values[place]
