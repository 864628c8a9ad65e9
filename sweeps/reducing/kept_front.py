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

AT_ONCE = 1 << 16
"""Designs that are added at a time."""


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
        """Add designs, values of shape (numbers, designs).

        Some at a time: what the first ones leave of a front spares the others the sorting.
        """
        for begin in range(0, values.shape[1], AT_ONCE):
            some = values[:, begin : begin + AT_ONCE]
            candidates = unbeaten(self.values, some)
            both = np.hstack([self.values, some[:, candidates]])
            kept = front_of(*both)
            self.values = both[:, kept]
            here = places[begin : begin + AT_ONCE][candidates]
            self.places = np.concatenate([self.places, here])[kept]

    def taken_of(self, archive: xr.Dataset, dims: Sequence[str]) -> xr.Dataset:
        """The archive at these designs, along `FRONT`; places count along `dims`."""
        import xarray as xr

        if not dims:
            return archive.expand_dims(FRONT)
        at = np.unravel_index(self.places, [archive.sizes[d] for d in dims])
        return archive.isel({d: xr.Variable((FRONT,), i) for d, i in zip(dims, at, strict=True)})
