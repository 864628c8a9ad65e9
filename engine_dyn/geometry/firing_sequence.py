"""Which firings happen, in sequence: factors on the pressure of firings, and patterns of them.

`Cylinders.with_pattern` gives each cylinder the factors of its own cycles.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TypeVar

SEALED = -1.0  # Factor on the pressure of a cylinder whose valves stay shut: see `pressure.motored`
MOST_CYCLES = 64  # Largest number of cycles after which a firing pattern repeats

LARGEST_FIRING = 4.0
"""Largest factor of a firing pattern: few firings that keep the torque need more pressure each."""

Firings = TypeVar("Firings", tuple[float, ...], str)
"""A firing pattern: a factor, or a letter, for each firing."""

PressureFactor = float | tuple[float, ...]
"""Factor on a cylinder's pressure [1]: for all cycles, or for each cycle of a pattern."""


def checked_pattern(pattern: Sequence[float]) -> tuple[float, ...]:
    """Return a pattern as a tuple; ValueError names a firing that is no factor."""
    if not len(pattern):
        raise ValueError("firing_pattern: empty; must have at least one firing")
    for place, value in enumerate(pattern, start=1):
        if not (0.0 <= value <= LARGEST_FIRING or value == SEALED):
            raise ValueError(
                f"firing_pattern, firing {place} = {value:g}: must be a number from 0 (no "
                f"combustion) to {LARGEST_FIRING:g}"
            )
    return tuple(map(float, pattern))


def cycles_of_pattern(firings: int, cylinders: int) -> int:
    """After how many cycles a pattern of so many firings repeats; ValueError for too many."""
    cycles = firings // math.gcd(firings, cylinders)
    if cycles > MOST_CYCLES:
        raise ValueError(
            f"firing_pattern: {firings} firings of {cylinders} cylinders repeat after {cycles} "
            f"cycles; must be at most {MOST_CYCLES}"
        )
    return cycles


def shortest(pattern: Firings) -> Firings:
    """Part of a pattern, a tuple or a text, that it repeats.

    >>> shortest("110110")
    '110'
    """
    for length in range(1, len(pattern)):
        if len(pattern) % length == 0 and pattern[:length] * (len(pattern) // length) == pattern:
            return pattern[:length]
    return pattern
