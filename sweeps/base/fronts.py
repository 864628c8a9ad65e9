"""Pareto fronts of numbers of which less is better: the one rule of what beats what.

A design is beaten by one that is below it in one number and not above it in any other. Designs that
are equal in all numbers do not beat each other.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from engine_dyn.types import Booleans, Floats, Integers


def front_of(first: npt.NDArray[Any], second: npt.NDArray[Any], *more: Any) -> Integers:
    """Positions of the designs that no other is below in one number and not above in the others.

    In order of the first number, then of the second and so on; equal ones as they come. For two
    numbers, sorting takes O(n log n) and the rest O(n); for three, all takes O(n log^2 n), however
    many are in the front: Kung, Luccio and Preparata (1975), On finding the maxima of a set of
    vectors, sections 2 and 3. More of them take O(n m) for a front of m: Chomicki, Godfrey, Gryz
    and Liang (2003), Skyline with presorting.
    """
    if len(more) > 1:
        return _of_many(np.array([first, second, *more], dtype=float))
    numbers = np.array([first, second, *more], dtype=float)
    order = np.argsort(numbers[0], kind="stable")
    least = numbers[0, order]
    if (least[1:] == least[:-1]).any():
        order = np.lexsort(numbers[::-1])
    if not order.size:
        return order
    # Equal designs follow each other: all of them are on the front if the first one is.
    numbers = numbers[:, order]
    new = np.concatenate([[True], (numbers[:, 1:] != numbers[:, :-1]).any(axis=0)])
    unlike = numbers[:, new]
    kept = ~(_beaten_of_three(unlike) if more else _beaten_of_pairs(unlike))
    return np.asarray(order[kept[np.cumsum(new) - 1]], dtype=np.int64)


def _beaten_of_pairs(numbers: Floats) -> Booleans:
    """Whether each of different pairs, in ascending order, is beaten by one before it."""
    second = numbers[1]
    return np.concatenate([[False], np.minimum.accumulate(second[:-1]) <= second[1:]])


def _beaten_of_three(numbers: Floats) -> Booleans:
    """Whether each of different triples, in ascending order, is beaten by one before it."""
    # An earlier triple beats a later one if neither its second nor its third number is larger. Each
    # block of designs is compared with the next block, then blocks twice as long, and so on: in
    # ascending order of the second number, a design of the later block is beaten if a design of the
    # earlier block has come with a third number that is not larger.
    _, second, third = numbers
    count = second.size
    beaten = np.zeros(count, dtype=bool)
    near = 16  # Designs less than so many places apart are compared one by one; a power of two
    for back in range(1, min(near, count)):
        below = (second[:-back] <= second[back:]) & (third[:-back] <= third[back:])
        beaten[back:] |= below
    rank = np.unique(third, return_inverse=True)[1]
    along = np.argsort(second, kind="stable")
    size = near
    while size < count:
        # Beaten designs are left out: the designs that they beat are beaten by others too.
        along = along[~beaten[along]]
        pairs = along // (2 * size)
        along_pairs = np.argsort(pairs.astype(np.min_scalar_type(count // size)), kind="stable")
        here = along[along_pairs]
        # Ranks in each pair of blocks are shifted below those in the pair before it, so that one
        # running minimum serves all pairs
        level = here // (2 * size) * (count + 1)
        first = here // size % 2 == 0
        least = np.minimum.accumulate(np.where(first, rank[here], count) - level) + level
        beaten[here[~first & (least <= rank[here])]] = True
        size *= 2
    return beaten


def _of_many(numbers: Floats) -> Integers:
    """Front for four numbers or more, shape (numbers, designs)."""
    waiting = np.lexsort(numbers[::-1])
    front: list[int] = []
    # No design is beaten by a later one in this order: the first one that is left is never beaten.
    while waiting.size:
        front.append(int(waiting[0]))
        waiting = waiting[1:]
        waiting = waiting[~_beaten(numbers[:, front[-1]], numbers[:, waiting])]
    return np.array(front, dtype=np.int64)


def _beaten(one: Floats, others: Floats) -> Booleans:
    """Whether one design beats each of the designs `others`, shape (numbers, designs)."""
    own = one[:, None]
    return np.asarray((others >= own).all(axis=0) & (others > own).any(axis=0))


def unbeaten(front: Floats, designs: Floats) -> Booleans:
    """Whether designs, shape (numbers, designs), may stand beside those of a front.

    Of pairs, one is left out that is above a pair of the front in the second number, and not below
    in the first. The front is in the order of `front_of`, so that the second number falls along it:
    looking there is quicker than sorting. Of more numbers all may: finding those that do not takes
    as long as the front of all.
    """
    if not front.size or len(front) > 2:
        return np.ones(designs.shape[1], dtype=bool)
    before = np.searchsorted(front[0], designs[0], side="right") - 1
    return np.asarray((before < 0) | (designs[1] <= front[1][before]))
