"""How many designs each solver solves: call `dispatch.solve` within `counted`."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar

__all__ = ["BATCH", "GENERAL", "Tally", "counted", "tally_in_use"]

BATCH, GENERAL = "batch solver", "general solver"


class Tally:
    """What was solved by which solver; designs that are solved again count again.

    `notes` has of each piece of work its solver, the number of designs, and how many of these the
    batch solver left to the general one. Threads may add to it.
    """

    def __init__(self) -> None:
        self.notes: list[tuple[str, int, int]] = []

    @property
    def designs(self) -> Counter[str]:
        """Numbers of designs that each solver was given."""
        return sum((Counter({solver: count}) for solver, count, _ in self.notes), Counter())

    @property
    def deferred(self) -> int:
        """Number of designs that the batch solver left."""
        return sum(left for _, _, left in self.notes)

    @property
    def general_share(self) -> float:
        """Fraction of all designs that the general solver solved; NaN without any."""
        total = self.designs.total()
        return (self.designs[GENERAL] + self.deferred) / total if total else float("nan")


_TALLY: ContextVar[Tally | None] = ContextVar("tally", default=None)


def tally_in_use() -> Tally | None:
    """Return the tally of the innermost `counted` around the caller, or None."""
    return _TALLY.get()


@contextmanager
def counted() -> Iterator[Tally]:
    """Count the designs that this thread solves within the block, by what solves them."""
    tally = Tally()
    token = _TALLY.set(tally)
    try:
        yield tally
    finally:
        _TALLY.reset(token)
