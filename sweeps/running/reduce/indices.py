"""Sobol' indices of a quantity from Saltelli's design, some groups of designs at a time.

Each base point has a group of designs: A, then for each parameter j AB_j, which is A with parameter
j from B, then B. With m the mean over all designs and V the variance over all A and B,

    first_j = mean((B - m) (AB_j - A)) / V,    total_j = mean((AB_j - A)^2) / (2 V)

(A. Saltelli et al. 2010, Computer Physics Communications 181, 259, table 2, b and f, as SALib has
them). All that is kept are exact sums over batches of base points (`engine_dyn.accumulation`), so
that indices are the same to the bit however the designs are divided. Their intervals are those of
the jackknife that leaves out one batch at a time (R. G. Miller 1974, Biometrika 61, 1).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from engine_dyn.accumulation import LIMBS, UNITS_IN_ONE, add_exactly, carried, in_units
from engine_dyn.types import Floats, Integers
from sweeps.base.files.libraries import library
from sweeps.scene.sample import Sample

FIRST, FIRST_CONFIDENCE, TOTAL, TOTAL_CONFIDENCE = (
    "first", "first_confidence", "total", "total_confidence",
)  # fmt: skip

NAMES = {
    FIRST: "first-order Sobol' index",
    FIRST_CONFIDENCE: "half width of the confidence interval of the first-order index",
    TOTAL: "total Sobol' index",
    TOTAL_CONFIDENCE: "half width of the confidence interval of the total index",
}

MOST_FAILED = 0.01
"""Largest share of failed designs: with more, indices without their groups do not hold for the
whole ranges."""

CONFIDENCE = 0.95  # Probability that an interval covers the true value


class Indices:
    """Sums of one quantity in each of several cells.

    Parameters
    ----------
    sample : Sample
        The whole one.
    shape : sequence of int
        Cells along each axis beside the designs.

    Attributes
    ----------
    sums : ndarray of int, shape (cells, batches, 3 parameters + 3, LIMBS)
        Of each design's values; of B (AB_j - A) and of (AB_j - A)^2 for each parameter; of A^2
        and B^2 together.
    counts : ndarray of int, shape (cells, batches)
        Groups that are in the sums.
    lacking, dropped : ndarray of int, shape (cells,)
        Designs without a number, and the groups that they are in.
    """

    def __init__(self, sample: Sample, shape: Sequence[int]) -> None:
        self.sample, self.shape = sample, tuple(shape)
        self.many = len(sample.parameters)
        cells = math.prod(self.shape)
        # With many cells there are fewer batches of base points, to take less memory.
        self.batches = min(32 if cells <= 32 else 8, sample.number)
        self.sums = np.zeros((cells, self.batches, 3 * self.many + 3, LIMBS), np.int64)
        self.counts = np.zeros((cells, self.batches), np.int64)
        self.lacking, self.dropped = np.zeros((2, cells), np.int64)

    def add(self, values: npt.NDArray[Any], place: Sequence[slice], first: int) -> None:
        """Add whole groups of designs, which begin at number `first` of the whole sample.

        `values` are one for each design, NaN where there is none, with the axes of the cells first;
        `place` are the cells in which they lie.
        """
        here = np.arange(math.prod(self.shape)).reshape(self.shape)[tuple(place)].reshape(-1)
        groups = np.asarray(values, np.float64).reshape(here.size, -1, self.sample.group)
        good = np.isfinite(groups)
        whole = np.asarray(good.all(axis=2))
        self.lacking[here] += np.count_nonzero(~good, axis=(1, 2))
        self.dropped[here] += np.count_nonzero(~whole, axis=1)
        points = first // self.sample.group + np.arange(groups.shape[1])
        batches = points * self.batches // self.sample.number
        for batch in np.unique(batches):
            inside = batches == batch
            self.counts[here, batch] += np.count_nonzero(whole[:, inside], axis=1)
            self._add(np.where(whole[:, inside, None], groups[:, inside], np.nan), here, batch)

    def _add(self, groups: Floats, here: Integers, batch: int) -> None:
        """Add groups of one batch; groups with NaN are left out."""
        change = groups[..., 1:-1] - groups[..., :1]
        added = np.concatenate([groups, groups[..., -1:] * change, change * change], axis=2)
        each = np.zeros((here.size * added.shape[2], LIMBS), np.int64)
        add_exactly(added.transpose(0, 2, 1).reshape(len(each), -1), each)
        squares = np.zeros((here.size, LIMBS), np.int64)
        add_exactly(_squares(groups[..., [0, -1]].reshape(here.size, -1)), squares)
        sums = self.sums[here, batch]
        sums += np.concatenate([each.reshape(here.size, -1, LIMBS), squares[:, None]], axis=1)
        carried(sums)
        self.sums[here, batch] = sums

    def state(self) -> dict[str, npt.NDArray[Any]]:
        """All that is known, for `merge`: sums of the batches that have any."""
        used = np.flatnonzero(self.counts.any(axis=0))
        return {
            "batches": used, "sums": self.sums[:, used], "counts": self.counts[:, used],
            "lacking": self.lacking, "dropped": self.dropped,
        }  # fmt: skip

    def merge(self, state: Mapping[str, npt.NDArray[Any]]) -> None:
        """Add the groups of another part."""
        used = state["batches"]
        sums = self.sums[:, used] + state["sums"]
        carried(sums)
        self.sums[:, used] = sums
        self.counts[:, used] += state["counts"]
        self.lacking = self.lacking + state["lacking"]
        self.dropped = self.dropped + state["dropped"]

    @property
    def conditional(self) -> bool:
        """Whether so many designs failed that indices are those of the groups that succeeded."""
        designs = (self.counts.sum(axis=1) + self.dropped) * self.sample.group
        return bool((self.lacking > MOST_FAILED * designs).any())

    def results(self) -> dict[str, Floats]:
        """Indices and half widths of their intervals, by the keys of `NAMES`.

        NaN where no group, or for the intervals no second batch, has numbers; 0 where nothing
        varies.
        """
        estimates = np.full((len(NAMES), len(self.counts), self.many), np.nan)
        student = library("scipy.special", "SciPy", "[reduce]", extra="study").stdtrit
        for cell, counts in enumerate(self.counts):
            if not counts.any():
                continue
            used = np.flatnonzero(counts)
            each, groups = in_units(self.sums[cell, used]), counts[used].astype(object)
            whole, every = each.sum(axis=0), groups.sum()
            estimates[::2, cell] = self._of(whole, every)
            if used.size > 1:
                without = [
                    self._of(whole - one, every - n) for one, n in zip(each, groups, strict=True)
                ]
                deviation = np.std(without, axis=0) * math.sqrt(used.size - 1)
                estimates[1::2, cell] = student(used.size - 1, 0.5 + 0.5 * CONFIDENCE) * deviation
        shape = (*self.shape, self.many)
        return {key: estimates[i].reshape(shape) for i, key in enumerate(NAMES)}

    def _of(self, sums: npt.NDArray[Any], groups: int) -> Floats:
        """First-order and total indices, shape (2, parameters), rounded once."""
        # The sums are whole numbers of units 1 / UNITS_IN_ONE, so `variance` is the variance V over
        # all A and B times (2 * groups * UNITS_IN_ONE)^2.
        many = self.many
        values, products, changes = np.split(sums[:-1], [many + 2, 2 * many + 2])
        a, mixed, b = values[0], values[1:-1], values[-1]
        variance = 2 * groups * UNITS_IN_ONE * sums[-1] - (a + b) ** 2
        if variance == 0:
            return np.zeros((2, many))
        products = groups * (many + 2) * UNITS_IN_ONE * products - values.sum() * (mixed - a)
        first = 4 * products / ((many + 2) * variance)
        total = 2 * groups * UNITS_IN_ONE * changes / variance
        return np.array([first, total], np.float64)


def _squares(values: Floats) -> Floats:
    """Squares and their rounding errors, next to each other: constant values have no variance."""
    # T. J. Dekker (1971), Numerische Mathematik 18, 224: a number is split into two halves, whose
    # products are exact.
    shifted = 134217729.0 * values  # The factor is 2^27 + 1
    high = shifted - (shifted - values)
    low = values - high
    square = values * values
    rest = ((high * high - square) + 2.0 * high * low) + low * low
    return np.concatenate([square, rest], axis=1)
