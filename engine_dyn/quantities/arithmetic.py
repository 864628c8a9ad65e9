"""Arithmetic that quantities share where plain operators would not do."""

from __future__ import annotations

import math
from typing import Any

import numpy as np


def balance_of(plus: Any, minus: Any) -> Any:
    """Difference of two torques or pressures; what is only inexact is 0 (the engine idles)."""
    plus, minus = np.asarray(plus), np.asarray(minus)
    difference = plus - minus
    # The velocities that the mean gas torque is made with are exact to this part of the second
    # number without a pin offset, docs/solver.md (58).
    return np.where(np.abs(difference) <= 1e-10 * np.abs(minus), 0.0, difference)


def quotient(numerator: Any, denominator: Any) -> Any:
    """Quotient; NaN where the denominator is 0."""
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(denominator == 0.0, np.nan, np.divide(numerator, denominator))


def power(base: Any, exponent: Any) -> Any:
    """Power whose bits do not depend on how designs are cut into blocks.

    Along a loop with one exponent, NumPy squares where that is 2, takes the root where it is 0.5,
    and calls `pow` elsewhere: the last digit would depend on the shape of the arrays.
    """
    result = base**exponent
    # Exponents for which NumPy has other loops; 0 and 1 give the same bits by every loop.
    for special, function in ((2.0, np.square), (0.5, np.sqrt)):
        if np.any(exponent == special):
            result = np.where(exponent == special, function(base), result)
    return result


def product(**factors: Any) -> Any:
    """Product of all needs of a node."""
    return math.prod(factors.values())
