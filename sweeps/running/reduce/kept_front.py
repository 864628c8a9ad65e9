"""The Pareto front of designs that come a range at a time, and the archive at these designs."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from engine_dyn.types import Floats, Integers
from sweeps.base.fronts import front_of, unbeaten

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["FRONT", "Front"]

FRONT = "front"
"""Dimension along which the designs of a Pareto front lie."""

AT_ONCE = 1 << 16
"""Designs that are compared at a time, at least."""


class Front:
    """Designs that none of those that came so far beats."""

    def __init__(self, numbers: int) -> None:
        self._values: Floats = np.empty((numbers, 0))
        self._places: Integers = np.empty(0, dtype=np.int64)
        self._waiting: list[tuple[Floats, Integers]] = []
        self._count = 0

    @property
    def values(self) -> Floats:
        """Their numbers, of which less is better, in the order of `sweeps.base.fronts.front_of`."""
        self._compare()
        return self._values

    @property
    def places(self) -> Integers:
        """Which designs they are."""
        self._compare()
        return self._places

    def add(self, values: Floats, places: Integers) -> None:
        """Add designs, values of shape (numbers, designs).

        As many are compared at a time as the front has designs, so that however long it becomes,
        each is compared a few times. What the first ones leave of a front spares others the
        sorting.
        """
        for begin in range(0, values.shape[1], AT_ONCE):
            some, here = values[:, begin : begin + AT_ONCE], places[begin : begin + AT_ONCE]
            candidates = unbeaten(self._values, some)
            self._waiting.append((some[:, candidates], here[candidates]))
            self._count += int(np.count_nonzero(candidates))
            if self._count >= max(AT_ONCE, self._places.size):
                self._compare()

    def _compare(self) -> None:
        """Take those that wait into the front."""
        if self._waiting:
            values = np.hstack([self._values, *(some for some, _ in self._waiting)])
            places = np.concatenate([self._places, *(here for _, here in self._waiting)])
            kept = front_of(*values)
            self._values, self._places = values[:, kept], places[kept]
            self._waiting, self._count = [], 0

    def taken_of(self, archive: xr.Dataset, dims: Sequence[str]) -> xr.Dataset:
        """The archive at these designs, along `FRONT`; places count along `dims`."""
        import xarray as xr

        if not dims:
            return archive.expand_dims(FRONT)
        at = np.unravel_index(self.places, [archive.sizes[d] for d in dims])
        return archive.isel({d: xr.Variable((FRONT,), i) for d, i in zip(dims, at, strict=True)})
