"""A product of axes as kernels see it: flat values, strides, and the positions of one part."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from engine_dyn.compilation import inlined
from engine_dyn.speed.fields import OUTPUT
from engine_dyn.types import Floats, Integers

__all__ = [
    "Product",
    "add_offsets",
    "count_of",
    "offsets_at",
    "places_of_results",
    "take_offsets",
    "varies",
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
    places : ndarray
        The places of all inputs and of OUTPUT.
    """

    table_axes: Integers
    other_axes: Integers
    shape: Integers
    strides: Integers
    positions: Integers
    position_start: Integers
    values: Floats
    value_start: Integers
    places: Integers


@inlined
def count_of(axes: Integers, product: Product) -> int:
    """Number of combinations along `axes`."""
    count = 1
    for i in range(axes.size):
        count *= product.shape[axes[i]]
    return count


@inlined
def add_offsets(
    index: int, axes: Integers, fields: Integers, product: Product, offsets: Integers
) -> None:
    """Add to the places of some inputs what flat `index` over `axes` makes of them.

    The last axis runs fastest.
    """
    for back in range(axes.size):
        axis = axes[axes.size - 1 - back]
        size = product.shape[axis]
        here = product.positions[product.position_start[axis] + index % size]
        index //= size
        for i in range(fields.size):
            offsets[fields[i]] += product.strides[axis, fields[i]] * here


@inlined
def take_offsets(fields: Integers, start: Integers, offsets: Integers) -> None:
    """Start with the places of some inputs."""
    for i in range(fields.size):
        offsets[fields[i]] = start[fields[i]]


@inlined
def offsets_at(
    index: int, axes: Integers, product: Product, start: Integers, offsets: Integers
) -> None:
    """Place of every input in `values` (of OUTPUT in the results) at flat `index` over `axes`.

    `start` is added: the offsets of the other axes.
    """
    take_offsets(product.places, start, offsets)
    add_offsets(index, axes, product.places, product, offsets)


@inlined
def varies(field: int, product: Product) -> bool:
    """Whether an input, or the place of the results, differs between designs."""
    steps = 0
    for axis in range(product.strides.shape[0]):
        steps += abs(product.strides[axis, field])
    return steps > 0


def places_of_results(chosen: Integers, product: Product) -> Integers:
    """Places of the results of the designs `chosen` of a part, as `offsets_at` makes them."""
    axes = np.concatenate([product.table_axes, product.other_axes])
    along = np.unravel_index(chosen, tuple(product.shape[axes])) if axes.size else ()
    places = np.full(chosen.shape, product.value_start[OUTPUT])
    for axis, here in zip(axes, along, strict=True):
        position = product.positions[product.position_start[axis] + here]
        places += product.strides[axis, OUTPUT] * position
    return places
