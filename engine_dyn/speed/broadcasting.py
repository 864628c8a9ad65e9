"""Arrays that broadcast against each other: their shape, codes, and what is not known.

Both fronts of kernels, `dispatch` and `torque`, prepare their arguments with these functions.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from typing import Any

import numpy as np

from engine_dyn.speed.results import CURVE_NAMES
from engine_dyn.status import INVALID_INPUT
from engine_dyn.types import Integers

__all__ = ["codes", "shape_of", "without_unknown"]


def shape_of(*values: Any) -> tuple[int, ...]:
    """Shape that values broadcast to; most values are plain numbers, which are skipped."""
    return np.broadcast_shapes(*(np.shape(v) for v in values if not isinstance(v, float)))


def codes(names: tuple[str, ...], value: Any) -> Integers:
    """Places of words among the known names."""
    words = np.asarray(value)
    found = np.array([names.index(word) for word in words.flat], dtype=np.int64)
    return found.reshape(words.shape)


def without_unknown(solved: Callable[..., dict[str, Any]]) -> Callable[..., dict[str, Any]]:
    """Give designs without a diagram, whose `scale` is NaN, the status "invalid input".

    Kernels do not look for NaN, so they solve these designs with another diagram, and the results
    are discarded.
    """

    @wraps(solved)
    def of_known(*, scale: Any, **arguments: Any) -> dict[str, Any]:
        unknown = np.isnan(scale)
        if not unknown.any():
            return solved(scale=scale, **arguments)
        for name in ("mean_torque", "friction_torque"):  # which follow from the diagram
            if name in arguments:
                arguments[name] = np.nan_to_num(arguments[name])
        found = solved(scale=np.where(unknown, 1.0, scale), **arguments)
        for name, array in found.items():
            here = unknown[..., None] if name in CURVE_NAMES else unknown
            lost = INVALID_INPUT if name == "status" else np.nan
            np.copyto(array, lost, where=here, casting="unsafe")
        return found

    return of_known
