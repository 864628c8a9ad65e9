"""Harmonics of the reduced piston velocity and of its square, for any crank ratio.

The reduced velocity v = c/(r omega) of a centred slider-crank is odd in the crank angle and has one
odd order, the first, docs/method.md (109):

    v(phi) = sin(phi) + sum_j gamma_j sin(2 j phi),    v^2 = mean + sum_m square_m cos(m phi)

The orders fall off by a factor of (lambda/(1 + sqrt(1 - lambda^2)))^2 each, so that few of them are
the velocity to rounding. Everything that is linear in the velocity, such as the work of a pressure,
is therefore a sum of few curves that do not depend on the crank ratio.

Values of lanes are side by side: arrays are (term, lane), flat.
"""

from __future__ import annotations

import math

import numpy as np

from engine_dyn.compilation import inlined, wide_vectors
from engine_dyn.types import Floats

__all__ = [
    "FEW_TERMS",
    "LARGEST_RATIO",
    "MANY_TERMS",
    "order_of",
    "squares_of",
    "weights_of_samples",
]

FEW_TERMS, MANY_TERMS = 8, 16
"""Terms of the velocity: sin(phi), and sines of the orders 2, 4 and so on. The square has twice as
many, of the orders 1, 2, 3 and so on."""

LARGEST_RATIO = {FEW_TERMS: 0.45, MANY_TERMS: 0.8}
"""Largest crank ratio for which so many terms leave less than 3e-10 of the work of a pressure and
of the square: the sums of all further orders, docs/method.md (107)."""


@inlined
def order_of(term: int) -> int:
    """Order of a term of the velocity."""
    return 2 * term if term > 0 else 1


def weights_of_samples(terms: int) -> tuple[Floats, Floats, Floats]:
    """Sines and cosines of the angles at which the velocity is sampled, and what makes terms of it.

    Discrete sine transform over a quarter of a turn, docs/method.md (110). Twice as many intervals
    as terms would be exact up to the orders left out; half as many again make them vanish too.

    Parameters
    ----------
    terms : int
        Terms of the velocity.

    Returns
    -------
    sine, cosine : ndarray, shape (samples,)
        Of the angles, all between 0 and pi/2.
    weights : ndarray, shape (terms - 1, samples)
        Factors on (v - sin(phi))/lambda at the samples.
    """
    intervals = 3 * terms // 2
    angle = 0.5 * math.pi * np.arange(1, intervals) / intervals
    orders = 2.0 * np.arange(1, terms)
    return np.sin(angle), np.cos(angle), 2.0 / intervals * np.sin(np.outer(orders, angle))


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
