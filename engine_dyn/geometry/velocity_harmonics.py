"""Harmonics of the reduced piston velocity and of its square, for any crank ratio.

The reduced velocity v = c/(r omega) of a centred slider-crank is odd in the crank angle and has one
odd order, the first, docs/method.md (109):

    v(phi) = sin(phi) + sum_j gamma_j sin(2 j phi),    v^2 = mean + sum_m square_m cos(m phi)

With an offset both have sines and cosines of all orders.

The orders fall off by a factor of (lambda/(1 + sqrt(1 - lambda^2)))^2 each, so that few of them are
the velocity to rounding. Everything that is linear in the velocity, such as the work of a pressure,
is therefore a sum of few curves that do not depend on the crank ratio.

Values of lanes are side by side: arrays are (term, lane), flat.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from engine_dyn.compilation import inlined, wide_vectors
from engine_dyn.types import Booleans, Floats, Integers

__all__ = [
    "FEW_TERMS",
    "LARGEST_RATIO",
    "MANY_TERMS",
    "TURN_ANGLES",
    "TURN_SAMPLES",
    "OFFSET_TERMS",
    "Samples",
    "centred_ratio",
    "centred_ratio_at",
    "curves_at",
    "orders_of",
    "samples_of",
    "squares_of",
]

FEW_TERMS, MANY_TERMS = 8, 16
"""Terms of the velocity: sin(phi), and sines of the orders 2, 4 and so on. The square has twice as
many, cosines of the orders 1, 2, 3 and so on."""

OFFSET_TERMS = 32
"""Terms of the velocity with an offset: sines of the orders 1 to 16, then cosines of them. The
square has twice as many, of the orders 1 to 32."""

TURN_SAMPLES = 64
"""Samples of the velocity over a turn, from which the terms with an offset follow: the orders from
32 on, which would be taken for lower ones, are then below rounding."""

TURN_ANGLES = 2.0 * math.pi * np.arange(TURN_SAMPLES) / TURN_SAMPLES
"""Angles [rad] of these samples."""

LARGEST_RATIO = {FEW_TERMS: 0.45, MANY_TERMS: 0.8, OFFSET_TERMS: 0.45}
"""Largest crank ratio for which so many terms leave less than 3e-10 of the work of a pressure and
of the square: the sums of all further orders, docs/method.md (107). With an offset it holds for
the `centred_ratio`."""


@inlined
def order_of(term: int) -> int:
    """Order of a term of the velocity without an offset."""
    return 2 * term if term > 0 else 1


def centred_ratio(crank_ratio: Any, offset: Any) -> Any:
    """Crank ratio without an offset whose velocity has its singularities as near.

    They lie where lambda (sin(theta) - e/r) = +-1. `offset` is over the crank radius, e/r. Negative
    or infinite where the crank cannot turn.
    """
    return crank_ratio / (1.0 - crank_ratio * abs(offset))


centred_ratio_at = inlined(centred_ratio)
"""`centred_ratio` of numbers, for kernels."""


class Samples(NamedTuple):
    """Angles at which the velocity is sampled, and what makes terms of the samples.

    Attributes
    ----------
    sine, cosine : ndarray, shape (sample,)
        Of the angles.
    weights : ndarray, shape (term, sample)
        Factors on the samples: without an offset of (v - sin(phi))/lambda, for all terms but the
        first; with an offset of v.
    square_weights : ndarray, shape (term, sample)
        Factors on the samples of v^2; none without an offset, where products of the terms do.
    """

    sine: Floats
    cosine: Floats
    weights: Floats
    square_weights: Floats


def samples_of(terms: int) -> Samples:
    """Samples for so many terms of the velocity.

    Without an offset by a discrete sine transform over a quarter of a turn, docs/method.md (110).
    Twice as many intervals as terms would be exact up to the orders left out; half as many again
    make them vanish too. With an offset by a discrete Fourier transform over a turn.
    """
    if terms == OFFSET_TERMS:
        weights, square_weights = (
            2.0 / TURN_SAMPLES * curves_at(TURN_ANGLES, *orders_of(terms, square))
            for square in (False, True)
        )
        return Samples(np.sin(TURN_ANGLES), np.cos(TURN_ANGLES), weights, square_weights)
    intervals = 3 * terms // 2
    angle = 0.5 * math.pi * np.arange(1, intervals) / intervals
    orders = 2.0 * np.arange(1, terms)
    weights_of_sines = 2.0 / intervals * np.sin(np.outer(orders, angle))
    return Samples(np.sin(angle), np.cos(angle), weights_of_sines, np.zeros((0, 0)))


def curves_at(angle: Floats, orders: Integers, cosines: Booleans) -> Floats:
    """Sines, or cosines where `cosines` says so, of all orders: shape (term, angle)."""
    found = np.empty((orders.size, angle.size))
    for curve, of in ((np.sin, ~cosines), (np.cos, cosines)):
        found[of] = curve(np.multiply.outer(orders[of], angle))
    return found


def orders_of(terms: int, square: bool) -> tuple[Integers, Booleans]:
    """Orders of the terms of the velocity, or of its square, and which of them are cosines."""
    if terms == OFFSET_TERMS:
        half = np.arange(1, (terms if square else terms // 2) + 1)
        return np.tile(half, 2), np.repeat([False, True], half.size)
    if square:
        return np.arange(1, 2 * terms + 1), np.ones(2 * terms, dtype=np.bool_)
    # As `order_of`, which would be compiled once more for being called here.
    orders = np.maximum(1, 2 * np.arange(terms))
    return orders, np.zeros(terms, dtype=np.bool_)


@inlined
def squares_of(terms: int, lanes: int, velocity: Floats, squares: Floats) -> None:
    """Cosine coefficients of v^2 from the sine coefficients of v, docs/method.md (111).

    `velocity` is (terms, lane) and `squares` (2 terms, lane), flat: the orders 1 to 2 terms.
    """
    wide_vectors()
    for i in range(2 * terms * lanes):
        squares[i] = 0.0
    for i in range(terms):
        one = velocity[i * lanes : (i + 1) * lanes]
        for j in range(i, terms):
            other = velocity[j * lanes : (j + 1) * lanes]
            factor = 0.5 if i == j else 1.0
            total = order_of(i) + order_of(j)
            if total <= 2 * terms:
                to = squares[(total - 1) * lanes : total * lanes]
                for k in range(lanes):
                    to[k] -= factor * one[k] * other[k]
            apart = order_of(j) - order_of(i)
            if 0 < apart <= 2 * terms:
                to = squares[(apart - 1) * lanes : apart * lanes]
                for k in range(lanes):
                    to[k] += one[k] * other[k]
