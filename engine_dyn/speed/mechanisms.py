"""How many designs each solver solves.

Whoever wants to know it calls `dispatch.solve` within `counted`.
"""

from __future__ import annotations

import threading
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field

__all__ = ["BATCH", "GENERAL", "Tally", "counted", "tally_in_use"]

BATCH, GENERAL = "batch solver", "general solver"


@dataclass
class Tally:
    """Numbers of `designs` that each solver was given; of `deferred` that the batch solver left.

    Designs that are solved again, for their error or because they missed the tolerance, count
    again.
    """

    designs: Counter[str] = field(default_factory=Counter)
    deferred: int = 0
    _lock: threading.Lock = field(default_factory=threading.Lock, repr=False)

    @property
    def deferred_share(self) -> float:
        """Fraction of the designs given to the batch solver that it left; NaN without any."""
        given = self.designs[BATCH]
        return self.deferred / given if given else float("nan")

    @property
    def general_share(self) -> float:
        """Fraction of all designs that the general solver solved; NaN without any."""
        total = self.designs.total()
        return (self.designs[GENERAL] + self.deferred) / total if total else float("nan")

    def note(self, solver: str, designs: int, left: int = 0) -> None:
        """Count designs given to a solver, and those that it left."""
        with self._lock:
            self.designs[solver] += designs
            self.deferred += left


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
