"""What checks of a recording say: one line each."""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["Finding"]


@dataclass(frozen=True)
class Finding:
    """One thing about a recording that is not as it should be. Its text is one line.

    Attributes
    ----------
    check : str
        Under which it is silenced.
    text : str
        The place, the number, what is usual, and what may be meant.
    value : float
        The number, in `unit`; NaN where there is none.
    unit : str
        Unit of `value`.
    """

    check: str
    text: str
    value: float
    unit: str = ""

    def __str__(self) -> str:
        return f"{self.check}: {self.text}"
