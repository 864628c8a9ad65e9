"""From broadcasting arrays to what kernels take.

A sweep is split into parts that are alike, and all inputs are packed into one flat array.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from engine_dyn.speed.fields import INPUT_NAMES, INPUTS, OUTPUT, TABLE_INPUTS
from engine_dyn.speed.product import Product
from engine_dyn.types import Floats, Integers

__all__ = ["Packed", "Part", "aligned", "split"]


def aligned(array: Any, rank: int) -> npt.NDArray[Any]:
    """Array with axes of size 1 put before its own, as broadcasting would."""
    array = np.asarray(array)
    return array.reshape((1,) * (rank - array.ndim) + array.shape)


@dataclass(frozen=True)
class Part:
    """Designs that one kernel call can treat alike: positions along each axis, and their keys."""

    positions: tuple[Integers, ...]
    keys: tuple[Any, ...]

    @property
    def size(self) -> int:
        """Number of designs."""
        return math.prod(len(p) for p in self.positions)

    def take(self, array: npt.NDArray[Any]) -> npt.NDArray[Any]:
        """Elements of a broadcasting array that belong to the part."""
        for axis, positions in enumerate(self.positions):
            if array.shape[axis] > 1:
                array = array.take(positions, axis=axis)
        return array


def split(shape: tuple[int, ...], keys: Sequence[npt.NDArray[Any]]) -> list[Part]:
    """Split a product of axes so that every key has one value within a part.

    Keys are whole numbers from 0 on. A key may vary along one axis at most, as every parameter of a
    scene does.
    """
    along: list[list[int]] = [[] for _ in shape]
    for number, key in enumerate(keys):
        axes = [axis for axis, size in enumerate(key.shape) if size > 1]
        if len(axes) > 1:
            raise ValueError("a choice (cylinders, method, model) may vary along one axis only")
        if axes:
            along[axes[0]].append(number)
    choices: list[list[tuple[Integers, dict[int, Any]]]] = []
    for axis, size in enumerate(shape):
        if not along[axis]:
            choices.append([(np.arange(size), {})])
            continue
        # The keys are small whole numbers, and the axis can be long: they are counted, not sorted.
        which = np.zeros(size, dtype=np.int64)
        taken: list[dict[int, Any]] = [{}]
        for number in along[axis]:
            key = keys[number].reshape(-1)
            found = np.flatnonzero(np.bincount(key))
            which = which * found.size + np.searchsorted(found, key)
            taken = [{**one, number: value} for one in taken for value in found]
        choices.append(
            [(np.flatnonzero(which == i), taken[i]) for i in np.flatnonzero(np.bincount(which))]
        )
    fixed = {number: key.reshape(-1)[0] for number, key in enumerate(keys)}
    parts = []
    for combination in itertools.product(*choices):
        values = dict(fixed)
        for _, chosen in combination:
            values.update(chosen)
        parts.append(Part(tuple(p for p, _ in combination), tuple(values.values())))
    return parts


@dataclass(frozen=True)
class Packed:
    """All inputs of a sweep in one flat array, with strides along each axis of the sweep."""

    values: Floats
    start: Integers
    strides: Integers

    @classmethod
    def of(cls, inputs: Mapping[str, Any], shape: tuple[int, ...]) -> Packed:
        """Pack inputs that broadcast to `shape`."""
        rank = len(shape)
        strides = np.zeros((max(rank, 1), INPUTS), dtype=np.int64)
        start = np.zeros(INPUTS, dtype=np.int64)
        # Plain numbers first: for a single design nearly all inputs are, and an array of each would
        # cost time.
        numbers = {i: inputs[n] for i, n in enumerate(INPUT_NAMES) if isinstance(inputs[n], float)}
        start[list(numbers)] = range(len(numbers))
        place = len(numbers)
        pieces = [np.array(list(numbers.values()), dtype=np.float64)]
        for i, name in enumerate(INPUT_NAMES):
            if i in numbers:
                continue
            array = aligned(np.asarray(inputs[name], dtype=np.float64), rank)
            start[i] = place
            place += array.size
            pieces.append(array.ravel())
            strides[:, i] = _strides(array.shape)
        strides[:, OUTPUT] = _strides(shape)
        return cls(np.concatenate(pieces), start, strides)

    def product(self, part: Part) -> Product:
        """Return a part for kernels."""
        sizes = [len(p) for p in part.positions]
        of_table = np.any(self.strides[:, :TABLE_INPUTS], axis=1).tolist()
        # The last axis is a line, see `inputs.take_designs`. A line of length 1 would cost half as
        # much as solving its design.
        axes = sorted(range(len(sizes)), key=lambda axis: sizes[axis] > 1)
        return Product(
            table_axes=np.array([a for a in axes if of_table[a]], dtype=np.int64),
            other_axes=np.array([a for a in axes if not of_table[a]], dtype=np.int64),
            shape=np.array(sizes or [1], dtype=np.int64),
            strides=self.strides,
            positions=np.concatenate([*part.positions, [0]], dtype=np.int64),
            position_start=np.array([0, *itertools.accumulate(sizes)], dtype=np.int64),
            values=self.values,
            value_start=self.start,
            places=np.arange(INPUTS),
        )


def _strides(shape: tuple[int, ...]) -> list[int]:
    """Steps of a flat index along each axis, 0 along axes of size 1; at least one number."""
    steps = [0] * len(shape)
    step = 1
    for axis in reversed(range(len(shape))):
        if shape[axis] > 1:
            steps[axis] = step
            step *= shape[axis]
    return steps or [0]
