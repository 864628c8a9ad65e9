"""Different combinations of numbers among designs."""

from __future__ import annotations

from typing import Any

import numpy as np

from engine_dyn.types import Floats, Integers


def distinct_combinations(*values: Any) -> tuple[Floats, Integers]:
    """Different combinations of some numbers of designs, and which of them each design has.

    NumPy sorts rows of a table as records, which takes 3 to 20 times as long.

    Parameters
    ----------
    *values : array_like
        One number of each design; all broadcast.

    Returns
    -------
    table : ndarray, shape (combinations, numbers)
        In ascending order, the first number first.
    which : ndarray of int
        Row of the table, in the shape that the values broadcast to.

    Examples
    --------
    >>> table, which = distinct_combinations([2, 1, 2, 1], [5, 5, 5, 6])
    >>> table.tolist(), which.tolist()
    ([[1.0, 5.0], [1.0, 6.0], [2.0, 5.0]], [2, 0, 2, 1])
    """
    given = [np.asarray(value, dtype=np.float64) for value in values]
    shape = np.broadcast_shapes(*(value.shape for value in given))
    which = np.zeros((), dtype=np.int64)
    for value in given:
        distinct, number = np.unique(value, return_inverse=True)
        if distinct.size > 1:
            both = which * distinct.size + number.reshape(value.shape)
            # Numbered anew, so that numbers stay small.
            which = np.unique(both, return_inverse=True)[1].reshape(both.shape)
    which = np.array(np.broadcast_to(which, shape))
    first = np.unique(which, return_index=True)[1]
    table = np.stack([np.broadcast_to(value, shape).reshape(-1)[first] for value in given], axis=1)
    return table, which
