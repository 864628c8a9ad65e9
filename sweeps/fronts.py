"""Pareto fronts of numbers of which less is better: the one rule of what beats what.

A design is beaten by one that is below it in one number and not above it in any other. Designs that
are equal in all numbers do not beat each other.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt

from engine_dyn.types import Booleans, Floats, Integers

__all__ = ["front_of", "unbeaten"]


def front_of(first: npt.NDArray[Any], second: npt.NDArray[Any], *more: Any) -> Integers:
    """Positions of the designs that no other is below in one number and not above in the others.

    In order of the first number, then of the second and so on; equal ones as they come. For two
    numbers, sorting takes O(n log n) and the rest O(n): Kung, Luccio and Preparata (1975), On
    finding the maxima of a set of vectors, section 2. More of them take O(n m) for a front of m:
    Chomicki, Godfrey, Gryz and Liang (2003), Skyline with presorting.
    """
    if more:
        return _of_many(np.array([first, second, *more], dtype=float))
    order = np.lexsort((second, first))
    if not order.size:
        return order
    one, other = first[order], second[order]
    below = np.minimum.accumulate(np.concatenate([[math.inf], other[:-1]]))
    # Of pairs that are equal, which follow each other, all are what the first is.
    new = np.concatenate([[True], (np.diff(one) != 0.0) | (np.diff(other) != 0.0)])
    kept = (other < below)[np.flatnonzero(new)][np.cumsum(new) - 1]
    return np.asarray(order[kept], dtype=np.int64)


def _of_many(numbers: Floats) -> Integers:
    """Front of three numbers or more, shape (numbers, designs)."""
    waiting = np.lexsort(numbers[::-1])
    found: list[int] = []
    # What beats a design comes before it in this order: the first that waits is never beaten.
    while waiting.size:
        found.append(int(waiting[0]))
        waiting = waiting[1:]
        waiting = waiting[~_beaten(numbers[:, found[-1]], numbers[:, waiting])]
    return np.array(found, dtype=np.int64)


def _beaten(one: Floats, others: Floats) -> Booleans:
    """Which of the designs `others`, shape (numbers, designs), one design beats."""
    own = one[:, None]
    return np.asarray((others >= own).all(axis=0) & (others > own).any(axis=0))


def unbeaten(front: Floats, designs: Floats) -> Booleans:
    """Which designs, shape (numbers, designs), may stand beside those of a front.

    A design that a design of the front beats is left out; of pairs only one that is above it in the
    second number, and not below in the first. The front is in the order of `front_of`, so that of
    pairs the second number falls along it: looking there is quicker than sorting.
    """
    if not front.size:
        return np.ones(designs.shape[1], dtype=bool)
    if len(front) == 2:
        before = np.searchsorted(front[0], designs[0], side="right") - 1
        return np.asarray((before < 0) | (designs[1] <= front[1][before]))
    left = np.arange(designs.shape[1])
    for one in front.T:
        left = left[~_beaten(one, designs[:, left])]
    kept = np.zeros(designs.shape[1], dtype=bool)
    kept[left] = True
    return kept
