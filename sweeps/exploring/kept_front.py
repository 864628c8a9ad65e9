"""The Pareto front of designs that come a range at a time, and the archive at these designs."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from engine_dyn.types import Floats, Integers
from sweeps.fronts import front_of, unbeaten

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["FRONT", "Front"]

FRONT = "front"
"""Dimension along which the designs of a Pareto front lie."""


class Front:
    """Designs that none of those that came so far beats.

    Attributes
    ----------
    values : ndarray, shape (numbers, designs)
        Their numbers, of which less is better, in the order of `sweeps.fronts.front_of`.
    places : ndarray, shape (designs,)
        Which designs they are.
    """

    def __init__(self, numbers: int) -> None:
        self.values: Floats = np.empty((numbers, 0))
        self.places: Integers = np.empty(0, dtype=np.int64)

    def add(self, values: Floats, places: Integers) -> None:
        """Add designs, values of shape (numbers, designs)."""
        candidates = unbeaten(self.values, values)
        both = np.hstack([self.values, values[:, candidates]])
        kept = front_of(*both)
        self.values = both[:, kept]
        self.places = np.concatenate([self.places, places[candidates]])[kept]

    def taken_of(self, archive: xr.Dataset, dims: Sequence[str]) -> xr.Dataset:
        """The archive at these designs, along `FRONT`; places count along `dims`."""
        import xarray as xr

        if not dims:
            return archive.expand_dims(FRONT)
        at = np.unravel_index(self.places, [archive.sizes[d] for d in dims])
        return archive.isel({d: xr.Variable((FRONT,), i) for d, i in zip(dims, at, strict=True)})
