"""Arrays that broadcast against each other: codes of words, and what is not known."""

from __future__ import annotations

from typing import Any

import numpy as np

from engine_dyn.speed.results import CURVE_NAMES
from engine_dyn.status import INVALID_INPUT
from engine_dyn.types import Booleans, Integers

__all__ = ["codes", "discard", "take_unknown"]


def codes(names: tuple[str, ...], value: Any) -> Integers:
    """Places of words among the known names."""
    words = np.asarray(value)
    found = np.array([names.index(word) for word in words.flat], dtype=np.int64)
    return found.reshape(words.shape)


def take_unknown(inputs: dict[str, Any]) -> Booleans:
    """Designs without a diagram, whose `scale` is NaN; it and what follows from it become numbers.

    Kernels do not look for NaN: they solve these designs with another diagram, and what they find
    goes with `discard`.
    """
    unknown = np.isnan(inputs["scale"])
    if unknown.any():
        inputs["scale"] = np.where(unknown, 1.0, inputs["scale"])
        for name in inputs.keys() & {"mean_torque", "friction_torque"}:  # follow from the diagram
            inputs[name] = np.nan_to_num(inputs[name])
    return np.asarray(unknown)


def discard(found: dict[str, Any], unknown: Booleans) -> dict[str, Any]:
    """Results without those of designs without a diagram, which have the status "invalid input"."""
    if unknown.any():
        for name, array in found.items():
            here = unknown[..., None] if name in CURVE_NAMES else unknown
            lost = INVALID_INPUT if name == "status" else np.nan
            np.copyto(array, lost, where=here, casting="unsafe")
    return found
