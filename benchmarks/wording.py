"""Numbers and tables of the benchmarks' documents."""

from __future__ import annotations

import math
from collections.abc import Sequence

__all__ = ["number", "rows", "small", "span"]


def number(value: float, digits: int = 2) -> str:
    """A count or rate with two digits and thousands marked."""
    if not math.isfinite(value):
        return "-"
    if value == 0.0:
        return "0"
    rounded = float(f"{value:.{digits - 1}e}")
    return f"{rounded:,.0f}" if abs(rounded) >= 10.0 else f"{rounded:g}"


def small(value: float) -> str:
    """An error."""
    return "-" if not math.isfinite(value) else f"{value:.1e}"


def span(seconds: float) -> str:
    """A time in the unit that suits it."""
    if not math.isfinite(seconds):
        return "-"
    for unit, factor in (("s", 1.0), ("ms", 1e3), ("µs", 1e6)):
        if seconds * factor >= 1.0:
            return f"{seconds * factor:.3g} {unit}"
    return f"{seconds * 1e9:.3g} ns"


def rows(head: Sequence[str], body: Sequence[Sequence[str]], right: bool = True) -> list[str]:
    """A table in Markdown; all but the first column to the right unless told otherwise."""
    marks = ["---"] + ["---:" if right else "---"] * (len(head) - 1)
    return ["| " + " | ".join(line) + " |" for line in (head, marks, *body)]
