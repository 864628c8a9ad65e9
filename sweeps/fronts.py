"""Pareto fronts of two numbers of which less is better: the one rule of what beats what.

A pair is beaten by one that is below it in one number and not above it in the other. Equal pairs do
not beat each other.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt

from engine_dyn.types import Floats, Integers

__all__ = ["front_of", "unbeaten"]


def front_of(first: npt.NDArray[Any], second: npt.NDArray[Any]) -> Integers:
    """Positions of the pairs that no other is below in one number and not above in the other.

    In order of the first number, equal ones as they come. Sorting takes O(n log n), the rest O(n).
    Source: Kung, Luccio and Preparata (1975), On finding the maxima of a set of vectors, section 2.
    """
    order = np.lexsort((second, first))
    if not order.size:
        return order
    one, other = first[order], second[order]
    below = np.minimum.accumulate(np.concatenate([[math.inf], other[:-1]]))
    # Of pairs that are equal, which follow each other, all are what the first is.
    new = np.concatenate([[True], (np.diff(one) != 0.0) | (np.diff(other) != 0.0)])
    kept = (other < below)[np.flatnonzero(new)][np.cumsum(new) - 1]
    return np.asarray(order[kept], dtype=np.int64)


def unbeaten(front: Floats, pairs: Floats) -> npt.NDArray[np.bool_]:
    """Which pairs no pair of a front is below in the second number, and not above in the first.

    Quicker than sorting them: the second number falls along a front.
    """
    if not front.size:
        return np.ones(pairs.shape[1], dtype=bool)
    before = np.searchsorted(front[0], pairs[0], side="right") - 1
    return np.asarray((before < 0) | (pairs[1] <= front[1][before]))
