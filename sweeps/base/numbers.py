"""Numbers for people: how many digits they have, in tables, texts and figures alike."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

DIGITS = 4  # Significant digits for reading; `export` writes those that results carry


def number_text(
    value: float, digits: int = DIGITS, sign: str = "", last: int | None = None, *,
    zeros: bool = True,
) -> str:  # fmt: skip
    """Write a number with some significant digits; of large ones all before the point.

    `sign` is "+" where positive numbers have a sign too. `last` is the power of ten of a digit that
    the text must have, -1 for tenths: see `last_digit`. Without `zeros`, those at the end of a
    fraction are left out.
    """
    if math.isnan(value):
        return "-"
    if value == 0.0:
        return "0"
    if math.isinf(value):
        return f"{value:{sign}}"
    first = math.floor(math.log10(abs(value)))
    if last is not None:
        digits = max(digits, first - last + 1)
    if not 1e-4 <= abs(value) < 1e7:
        return f"{value:{sign}.{digits}g}"
    places = max(0, digits - 1 - first)
    text = f"{value:{sign}.{places}f}"
    if places and (value == round(value) or not zeros):
        text = text.rstrip("0").rstrip(".")
    return text


SAME = 1e-7
"""Difference, relative to the larger of two numbers, up to which they are shown as equal."""


def last_digit(one: Any, other: Any, digits: int = 1) -> int | None:
    """Power of ten of the last digit with which the smallest difference of numbers can be read.

    The difference then has some `digits`. Numbers (or arrays of them) that are the same, but for
    rounding, have none; None where there is no difference.
    """
    differences = np.abs(np.asarray(one, float) - np.asarray(other, float))
    sizes = np.maximum(np.abs(one), np.abs(other))
    told = differences[np.isfinite(differences) & (differences > SAME * sizes)]
    # A difference of 0.1 is not always 0.1 to the last bit
    return math.floor(math.log10(1.0000001 * told.min())) - digits + 1 if told.size else None


def digits_of(values: Any) -> int:
    """Significant digits, `DIGITS` or more, at which different numbers have different texts."""
    known = np.unique(np.asarray(values, float))
    known = known[np.isfinite(known) & (known != 0.0)]
    steps = np.abs(np.diff(known)) > SAME * np.maximum(np.abs(known[1:]), np.abs(known[:-1]))
    known = known[np.concatenate([[True], steps])] if known.size else known
    first = np.floor(np.log10(np.abs(known)))
    plain = (np.abs(known) >= 1e-4) & (np.abs(known) < 1e7)  # As in `number_text`
    for digits in range(DIGITS, 10):
        places = np.where(plain, np.maximum(digits - 1 - first, 0.0), digits - 1 - first)
        with np.errstate(over="ignore", invalid="ignore"):
            rounded = np.rint(known * 10.0**places) / 10.0**places
        if np.unique(rounded).size == known.size:
            return digits
    return DIGITS


def number_texts(values: Sequence[float], last: int | None = None) -> list[str]:
    """Texts of numbers that are read beside each other: they differ where the numbers do."""
    digits = digits_of(values)
    return [number_text(value, digits, last=last) for value in values]


def finest(*lasts: int | None) -> int | None:
    """Return the smallest of some powers of ten; None stands for no demand."""
    return min((last for last in lasts if last is not None), default=None)
