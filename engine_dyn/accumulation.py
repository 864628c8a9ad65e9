"""Sums without rounding and counts in bins: of many numbers, whatever their order and division.

A sum is kept as a fixed-point number in limbs of 32 bits that reaches from the smallest double to
the largest, so that adding is exact and parts may be added in any order (U. Kulisch and W. Miranker
1981, Computer Arithmetic in Theory and Practice, section 5, the long accumulator). Bins are those
of a double's exponent and its first bits of the mantissa: they need no range that is known before,
and have the same relative width everywhere (G. Tene 2012, HdrHistogram).
"""

from __future__ import annotations

import math
from fractions import Fraction
from typing import Any

import numpy as np

from engine_dyn.compilation import kernel
from engine_dyn.types import Floats, Integers

LIMBS = 67
"""Limbs of an exact sum, of 32 bits: 2,046 exponents of doubles, 53 bits, room for 2^32 addends."""

_LIMB = (1 << 32) - 1
_MAGNITUDE = (1 << 63) - 1
_NO_NUMBER = 0x7FF
UNITS_IN_ONE = 1 << 1074  # How many smallest doubles make 1: exact sums count in smallest doubles

SMALLEST, LARGEST = 2.0**-64, 2.0**64
"""Magnitudes between which bins tell numbers apart; smaller ones share the bin of zero."""


def add_exactly(values: Floats, limbs: Integers) -> None:
    """Add numbers to exact sums, in place; NaN and infinities are left out.

    Parameters
    ----------
    values : ndarray, shape (sums, numbers)
        Numbers that are added, at most 2^29 to each sum.
    limbs : ndarray, shape (sums, LIMBS)
        The sums, as `carried` leaves them.
    """
    _add(np.ascontiguousarray(values).view(np.int64), limbs)


@kernel
def _add(bits: Integers, limbs: Integers) -> None:
    for row in range(bits.shape[0]):
        for number in range(bits.shape[1]):
            one = bits[row, number]
            exponent = (one >> 52) & _NO_NUMBER
            if exponent == _NO_NUMBER:
                continue
            mantissa = one & (1 << 52) - 1
            if exponent > 0:
                mantissa += 1 << 52
                exponent -= 1
            place, shift = exponent >> 5, exponent & 31
            low, high = (mantissa & _LIMB) << shift, (mantissa >> 32) << shift
            sign = -1 if one < 0 else 1
            limbs[row, place] += sign * (low & _LIMB)
            limbs[row, place + 1] += sign * ((low >> 32) + (high & _LIMB))
            limbs[row, place + 2] += sign * (high >> 32)
        for place in range(LIMBS - 1):
            carry = limbs[row, place] >> 32
            limbs[row, place] &= _LIMB
            limbs[row, place + 1] += carry


def carried(limbs: Integers) -> None:
    """Bring sums of sums into the one form that each number has, in place.

    All limbs but the last are from 0 to 2^32 - 1 then.
    """
    for place in range(LIMBS - 1):
        carry = limbs[..., place] >> 32
        limbs[..., place] &= _LIMB
        limbs[..., place + 1] += carry


def exact(limbs: Integers) -> Fraction:
    """Value of one sum, shape (LIMBS,)."""
    return Fraction(in_units(limbs), UNITS_IN_ONE)


def in_units(limbs: Integers) -> Any:
    """Sums as whole numbers, of which `UNITS_IN_ONE` are one: objects, shape (...)."""
    return limbs.astype(object) @ [1 << 32 * place for place in range(LIMBS)]


def bins_of(values: Floats, bits: int) -> Integers:
    """Bin of each number, which must be finite: 0 around zero, negative for negative numbers.

    `bits` of the mantissa count: bins are 2^-bits wide at most, relative to the number.
    """
    bins = np.empty(values.shape, np.int64)
    seen = np.ascontiguousarray(values).view(np.int64)
    first, most = _ends(bits)
    np.clip(((seen & _MAGNITUDE) >> (52 - bits)) - first + 1, 0, most, out=bins)
    np.negative(bins, out=bins, where=seen < 0)
    return bins


def count_in_bins(values: Floats, bits: int, lowest: int, counts: Integers) -> None:
    """Count numbers in bins, in place; NaN and infinities are left out.

    Parameters
    ----------
    values : ndarray, shape (rows, numbers)
        Values that are counted.
    bits : int
        As for `bins_of`.
    lowest : int
        Bin of the first column of `counts`.
    counts : ndarray, shape (rows, bins)
        Reaches as far as the bins of the numbers do.
    """
    first, most = _ends(bits)
    _count(np.ascontiguousarray(values).view(np.int64), 52 - bits, first, most, lowest, counts)


@kernel
def _count(
    seen: Integers, shift: int, first: int, most: int, lowest: int, counts: Integers
) -> None:
    for row in range(seen.shape[0]):
        for number in range(seen.shape[1]):
            one = seen[row, number]
            if (one >> 52) & _NO_NUMBER == _NO_NUMBER:
                continue
            place = min(max(((one & _MAGNITUDE) >> shift) - first + 1, 0), most)
            counts[row, (-place if one < 0 else place) - lowest] += 1


def _ends(bits: int) -> tuple[int, int]:
    """Indices of the first bin above zero, counted in a double's own bins, and of the last bin."""
    first, last = np.array([SMALLEST, LARGEST]).view(np.int64) >> (52 - bits)
    return int(first), int(last - first) + 1


def bin_edges(bins: Integers, bits: int) -> Floats:
    """Ends of bins between which their numbers are, shape (2, bins); infinite for the last ones."""
    first, most = _ends(bits)
    magnitude = np.abs(bins)
    inner = np.where(magnitude == 0, 0, magnitude - 1 + first) << (52 - bits)
    outer = (magnitude + first) << (52 - bits)
    near = np.where(magnitude == 0, -SMALLEST, inner.view(np.float64))
    far = np.where(magnitude == most, math.inf, outer.view(np.float64))
    negative = bins < 0
    return np.array([np.where(negative, -far, near), np.where(negative, -near, far)])
