"""Mean, deviation, quantiles and counts of the values of a quantity, a block at a time.

All that is kept are whole numbers, and the smallest and largest value: the result is the same to
the bit however the values are divided, and parts are merged by adding (`engine_dyn.accumulation`).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from engine_dyn.accumulation import (
    LIMBS,
    SMALLEST,
    add_exactly,
    bin_edges,
    bins_of,
    carried,
    count_in_bins,
    exact,
)
from engine_dyn.types import Floats, Integers

MOST_BINS = 64  # Largest number of bins of a histogram for readers


class Statistics:
    """Values of one quantity in each of several cells.

    Attributes
    ----------
    shape : tuple of int
        Cells along each axis over which the statistics do not go.
    sums : ndarray of int, shape (2, cells, LIMBS)
        Of the values, and of their squares.
    low, high : ndarray, shape (cells,)
        The smallest and the largest value; infinite without values.
    bins : ndarray of int, shape (bins,)
        Bins with values, rising, and...
    counts : ndarray of int, shape (cells, bins)
        ...how many they have.
    """

    def __init__(self, shape: Sequence[int]) -> None:
        self.shape = tuple(shape)
        cells = math.prod(self.shape)
        # Bits of the mantissa that separate bins: 0.2 % of a value, 1.6 % for many cells
        self.bits = 9 if cells <= 32 else 6
        self.sums = np.zeros((2, cells, LIMBS), np.int64)
        self.low, self.high = np.full(cells, math.inf), np.full(cells, -math.inf)
        self.bins: Integers = np.empty(0, np.int64)
        self.counts: Integers = np.empty((cells, 0), np.int64)

    def add(self, values: npt.NDArray[Any], place: Sequence[slice]) -> None:
        """Add values, the axes of the cells first, that lie in a range of cells.

        NaN and infinite values are left out.
        """
        here = np.arange(math.prod(self.shape)).reshape(self.shape)[tuple(place)].reshape(-1)
        rows = np.asarray(values, np.float64).reshape(here.size, -1)
        step = max(1, (1 << 20) // here.size)  # Values that are added at a time
        for begin in range(0, rows.shape[1], step):
            self._add(np.ascontiguousarray(rows[:, begin : begin + step]), here)

    def _add(self, rows: Floats, here: Integers) -> None:
        finite = np.isfinite(rows)
        if not finite.all():
            rows = np.where(finite, rows, np.nan)
        low, high = np.fmin.reduce(rows, axis=1), np.fmax.reduce(rows, axis=1)
        self.low[here] = np.fmin(self.low[here], low)
        self.high[here] = np.fmax(self.high[here], high)
        ends = np.array([low, high])[:, np.isfinite(low)]
        if not ends.size:
            return
        for sums, added in zip(self.sums, (rows, rows * rows), strict=True):
            limbs = sums[here]
            add_exactly(added, limbs)
            sums[here] = limbs
        first, last = bins_of(np.array([ends[0].min(), ends[1].max()]), self.bits)
        counts = np.zeros((here.size, last - first + 1), np.int64)
        count_in_bins(rows, self.bits, int(first), counts)
        used = np.flatnonzero(counts.any(axis=0))
        every = np.zeros((len(self.low), used.size), np.int64)
        every[here] = counts[:, used]
        self._add_counts(first + used, every)

    def _add_counts(self, bins: Integers, counts: Integers) -> None:
        together = np.union1d(self.bins, bins)
        summed = np.zeros((len(self.low), together.size), np.int64)
        summed[:, np.searchsorted(together, self.bins)] = self.counts
        summed[:, np.searchsorted(together, bins)] += counts
        self.bins, self.counts = together, summed

    def state(self) -> dict[str, npt.NDArray[Any]]:
        """All that is known, for `merge`."""
        return {
            "sums": self.sums, "low": self.low, "high": self.high, "bins": self.bins,
            "counts": self.counts,
        }  # fmt: skip

    def merge(self, state: Mapping[str, npt.NDArray[Any]]) -> None:
        """Add the values of another part."""
        self.sums = self.sums + state["sums"]
        carried(self.sums)
        self.low, self.high = np.fmin(self.low, state["low"]), np.fmax(self.high, state["high"])
        self._add_counts(state["bins"], state["counts"])

    def results(self, quantiles: Sequence[float]) -> dict[str, npt.NDArray[Any]]:
        """Mean, deviation, smallest, largest, count, quantiles with their errors, by these names.

        The deviation is that of all values (divided by their number). A quantile is as NumPy
        defines it, linear between the two values at its sides, each of which is known to lie in
        a bin; its error is the most that it can be away.
        """
        count = self.counts.sum(axis=1)
        mean, deviation = np.full(count.shape, np.nan), np.full(count.shape, np.nan)
        for cell in np.flatnonzero(count):
            number = int(count[cell])
            first, second = (exact(self.sums[k, cell]) / number for k in (0, 1))
            mean[cell] = float(first)
            deviation[cell] = math.sqrt(max(0.0, float(second - first * first)))
        quantile, error = self._quantiles(count, np.asarray(quantiles))
        none = count == 0
        each = {
            "mean": mean, "deviation": deviation,
            "smallest": np.where(none, np.nan, self.low),
            "largest": np.where(none, np.nan, self.high), "count": count,
        }  # fmt: skip
        shaped = {name: array.reshape(self.shape) for name, array in each.items()}
        shape = (*self.shape, len(quantiles))
        return {
            **shaped,
            "quantile": quantile.reshape(shape),
            "quantile_error": error.reshape(shape),
        }

    def histogram(self, most: int = MOST_BINS) -> tuple[Floats, Integers]:
        """Edges of bins for people, `most` or fewer, and how many values each cell has in them.

        Bins are as wide as a power of two, or, of positive values that span several octaves, parts
        of octaves: no bin of the statistics lies in two of them, so that the counts are exact.
        A negative value on an edge is counted below it.
        """
        shape = (*self.shape, 0)
        if not self.bins.size:
            return np.empty(0), np.empty(shape, np.int64)
        ends = bin_edges(self.bins, self.bits)
        low, high = float(self.low.min()), float(self.high.max())
        # Positive values whose largest is at least 16 times the smallest have bins of equal ratio.
        if self.bins[0] > 0 and high >= 16.0 * low:
            shift = 0
            while (self.bins[-1] - 1 >> shift) - (self.bins[0] - 1 >> shift) >= most:
                shift += 1
            place = self.bins - 1 >> shift
            first = int(place[0])
            edges = bin_edges(1 + (np.arange(first, place[-1] + 2) << shift), self.bits)[0]
        else:
            widths = ends[1] - ends[0]
            width = 2.0 ** math.ceil(
                math.log2(widths.max(where=np.isfinite(widths), initial=SMALLEST))
            )
            while math.floor(high / width) - math.floor(low / width) >= most:
                width *= 2.0
            place = np.floor(np.clip(ends[0], low, high) / width).astype(np.int64)
            first = int(place[0])
            edges = width * np.arange(first, place[-1] + 2)
        counts = np.zeros((len(self.low), len(edges) - 1), np.int64)
        np.add.at(counts.T, place - first, self.counts.T)
        return edges, counts.reshape(*self.shape, -1)

    def _quantiles(self, count: Integers, shares: Floats) -> tuple[Floats, Floats]:
        """Quantiles of each cell, and their largest error."""
        quantile, error = np.full((2, count.size, shares.size), np.nan)
        edges = bin_edges(self.bins, self.bits)
        for cell in np.flatnonzero(count):
            ends = np.clip(edges, self.low[cell], self.high[cell])
            until = np.cumsum(self.counts[cell])
            rank = shares * (count[cell] - 1)
            least, most, middle = np.zeros((3, shares.size))
            for side, weight in ((np.floor(rank), 1.0 - rank % 1.0), (np.ceil(rank), rank % 1.0)):
                place = np.searchsorted(until, side, side="right")
                inside = (side - (until[place] - self.counts[cell, place]) + 0.5) / self.counts[
                    cell, place
                ]
                least += weight * ends[0, place]
                most += weight * ends[1, place]
                middle += weight * (ends[0, place] + inside * (ends[1, place] - ends[0, place]))
            quantile[cell], error[cell] = middle, np.maximum(middle - least, most - middle)
        return quantile, error
