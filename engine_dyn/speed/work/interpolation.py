"""Weights of a polynomial through nodes."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from engine_dyn.types import Floats

__all__ = ["STENCIL", "lagrange_weights", "weights_between"]

STENCIL = 8
"""Nodes of the polynomial between nodes: three before the interval, three behind it."""


def lagrange_weights(t: Floats, slopes: bool = False) -> Floats:
    """Weights of the nodes -3..4 of a polynomial at the fractions t, shape (fraction, STENCIL).

    With `slopes`, those of its slope.
    """
    nodes = np.arange(STENCIL) - (STENCIL // 2 - 1.0)
    found = []
    for node in nodes:
        others = nodes[nodes != node]
        polynomial = np.polynomial.Polynomial.fromroots(others) / np.prod(node - others)
        found.append((polynomial.deriv() if slopes else polynomial)(t))
    return np.stack(found, axis=1)


@lru_cache(maxsize=32)
def weights_between(parts: int) -> Floats:
    """Weights of the nodes at so many equal parts of an interval, in value and in slope.

    Shape (2, part, STENCIL).
    """
    at = np.arange(parts) / parts
    return np.stack([lagrange_weights(at, slopes=slopes) for slopes in (False, True)])
