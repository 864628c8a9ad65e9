"""Weights of a polynomial through nodes."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from engine_dyn.types import Floats

__all__ = ["BEFORE", "MEAN_BY_PAIRS", "STENCIL", "lagrange_weights", "weights_between"]

MEAN_BY_PAIRS = (802.0 / 1440.0, -93.0 / 1440.0, 11.0 / 1440.0)
"""Weights of the pairs of nodes around an interval, from within, in the mean over it."""

STENCIL = 8
"""Nodes of the polynomial between nodes: three before the interval, three behind it."""

BEFORE = STENCIL // 2 - 1
"""Nodes of the polynomial before the interval."""


def lagrange_weights(t: Floats) -> Floats:
    """Weights of the nodes -3..4 of a polynomial at the fractions t, shape (fraction, STENCIL)."""
    nodes = np.arange(STENCIL) - BEFORE
    return np.stack(
        [np.prod([(t - m) / (node - m) for m in nodes if m != node], axis=0) for node in nodes],
        axis=1,
    )


@lru_cache(maxsize=32)
def weights_between(parts: int) -> Floats:
    """Weights of the nodes at so many equal parts of an interval, shape (part, STENCIL)."""
    return lagrange_weights(np.arange(parts) / parts)
