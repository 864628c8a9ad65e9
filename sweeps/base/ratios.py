"""Ratios as people write them: the text "1/200" is the number 0.005, and is shown so again."""

from __future__ import annotations

import math

from sweeps.base.errors import plain_number

# Largest number that a person may give, in any unit: products of several of them stay finite
LARGEST = 1e30

BEYOND = f"must be at most {LARGEST:g} in size"

LARGEST_DIVISOR = 100_000  # Largest n for which a ratio is shown as 1/n


def number_or_ratio(text: str) -> float:
    """Convert a number, or a fraction of two numbers such as "1/200", to a finite number.

    Raises
    ------
    ValueError
        For any other text, for a divisor of zero, and for what is not finite.
    """
    above, stroke, below = text.partition("/")
    value = plain_number(above)
    if stroke:
        divisor = plain_number(below)
        value = value / divisor if divisor else math.nan
    if not math.isfinite(value):
        raise ValueError(text)
    return value


def ratio_text(value: float, digits: int = 6) -> str:
    """Return "1/200" for 0.005, and the number with some digits where it is no such fraction.

    Only fractions that are shorter to read than the number, or that the number rounds, are shown.
    """
    number = f"{value:.{digits}g}"
    if not 0.0 < value <= 0.1:
        return number
    divisor = round(1.0 / value)
    if divisor > LARGEST_DIVISOR or abs(value * divisor - 1.0) > 1e-9:
        return number
    return f"1/{divisor}"
