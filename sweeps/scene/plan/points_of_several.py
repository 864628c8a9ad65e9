"""Points of the dimensions that quantities add, where several engines lie side by side.

Engines have other numbers of cylinders, and two-stroke engines another cycle: the points of all of
them are those of each, in order, and results are missing where an engine has no such point.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from engine_dyn.types import Integers

__all__ = ["points_of_several"]

DECIMALS = 9
"""Angles that are the same to so many places are the same point."""

Points = Mapping[str, npt.NDArray[Any]]


def points_of_several(each: Sequence[Points]) -> tuple[Points, list[dict[str, Integers]]]:
    """Points of all, and the places of the points of each among them."""
    joined: dict[str, npt.NDArray[Any]] = {}
    for name in dict.fromkeys(name for points in each for name in points):
        own = [points[name] for points in each]
        if all(np.array_equal(own[0], other) for other in own):
            joined[name] = own[0]
            continue
        together = np.concatenate(own)
        if together.dtype.kind == "f":
            _, first = np.unique(np.round(together, DECIMALS), return_index=True)
            joined[name] = together[first]
        else:
            joined[name] = np.unique(together)
    places = [
        {name: _places(joined[name], values) for name, values in points.items()} for points in each
    ]
    return joined, places


def _places(joined: npt.NDArray[Any], own: npt.NDArray[Any]) -> Integers:
    """Positions of points among all."""
    if own is joined or np.array_equal(own, joined):
        return np.arange(len(joined))
    if own.dtype.kind == "f":
        joined, own = np.round(joined, DECIMALS), np.round(own, DECIMALS)
    return np.asarray(np.searchsorted(joined, own), dtype=np.int64)
