"""Sums without rounding and counts in bins, against fractions and NumPy's own."""

from fractions import Fraction

import numpy as np
import pytest

from engine_dyn.accumulation import (
    LIMBS,
    SMALLEST,
    add_exactly,
    bin_edges,
    bins_of,
    count_in_bins,
    exact,
)
from engine_dyn.types import Floats


def hard_numbers() -> Floats:
    """Numbers of all magnitudes and signs, that cancel, and some that are none."""
    rng = np.random.default_rng(1)
    wide = rng.normal(size=3000) * 10.0 ** rng.integers(-300, 300, 3000)
    ends = [5e-324, -5e-324, 2.2e-308, 1.7e308, 1.7e308, 0.0, -0.0, np.nan, np.inf, -np.inf]
    return np.concatenate([wide, -wide[:1000] * (1 + 1e-16), ends])


def test_sums_are_those_of_fractions_in_any_order() -> None:
    numbers = hard_numbers()
    finite = numbers[np.isfinite(numbers)]
    whole = np.zeros((1, LIMBS), np.int64)
    add_exactly(numbers[None], whole)
    assert exact(whole[0]) == sum(map(Fraction, finite.tolist()))
    shuffled = np.random.default_rng(2).permutation(numbers)
    parts = np.zeros((1, LIMBS), np.int64)
    for part in np.array_split(shuffled, 7):
        add_exactly(part[None], parts)
    np.testing.assert_array_equal(parts, whole)


@pytest.mark.parametrize("bits", [6, 9])
def test_numbers_are_in_their_bins(bits: int) -> None:
    rng = np.random.default_rng(3)
    numbers = np.concatenate(
        [rng.lognormal(0.0, 9.0, 4000), -rng.lognormal(0.0, 9.0, 4000), [0.0, 1e-30, -1e-30, 1e30]]
    )
    bins = bins_of(numbers, bits)
    low, high = bin_edges(bins, bits)
    assert ((low <= numbers) & (numbers <= high)).all()
    inside = (np.abs(numbers) > SMALLEST) & np.isfinite(low) & np.isfinite(high)
    wide = (high - low)[inside] / np.minimum(np.abs(low), np.abs(high))[inside]
    assert wide.max() <= 2.0**-bits
    order = np.argsort(numbers)
    assert (np.diff(bins[order]) >= 0).all()
    counts = np.zeros((1, bins.max() - bins.min() + 1), np.int64)
    count_in_bins(np.append(numbers, [np.nan, np.inf])[None], bits, int(bins.min()), counts)
    np.testing.assert_array_equal(counts[0], np.bincount(bins - bins.min()))
