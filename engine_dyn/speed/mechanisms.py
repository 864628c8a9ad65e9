"""What solves the designs of a part of a sweep: the mechanisms, which one is used, and how often.

`dispatch` decides by `mechanism_of`, and so does whoever wants to know it beforehand. Whoever wants
to know what was used afterwards calls `dispatch.solve` within `counted`.
"""

from __future__ import annotations

import threading
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field

from engine_dyn.speed.arguments import Choice
from engine_dyn.speed.batch.front import can_solve
from engine_dyn.speed.methods import METHODS
from engine_dyn.types import Integers

__all__ = [
    "GENERAL",
    "OWN_CURVES",
    "MECHANISMS",
    "SHARED_TABLES",
    "Tally",
    "are_shared",
    "counted",
    "is_common",
    "mechanism_of",
    "tally_in_use",
]

SHARED_TABLES = "batch solver with shared tables"
OWN_CURVES = "batch solver with curves of each design"
GENERAL = "general solver"

MECHANISMS = (SHARED_TABLES, OWN_CURVES, GENERAL)

MANY_TABLES, FEW_DESIGNS = 64, 64
"""From MANY_TABLES on, each for fewer designs than FEW_DESIGNS, no tables are built: each design
adds up a curve of its own, see `own_curves`. Results then differ by some 1e-9."""


def are_shared(tables: int, designs: int, special: bool) -> bool:
    """Whether tables are built, and designs have no curves of their own.

    Parameters
    ----------
    tables, designs : int
        Number of tables of the whole sweep, and of designs for each.
    special : bool
        Whether curves depend on inputs for which they cannot be added up from harmonics, such as
        friction over the stroke.
    """
    return tables < MANY_TABLES or designs >= FEW_DESIGNS or special


def is_common(known: bool, angles: int, tables: int, designs: int, special: bool) -> bool:
    """Whether a load over angle may be a part of own curves.

    Parameters
    ----------
    known : bool
        Whether the batch solver knows the law over speed: there is no table of it.
    angles : int
        Number of different angles of the load: gear ratios times phases.
    tables, designs, special
        As of `are_shared`.
    """
    return known and angles == 1 and tables * designs >= MANY_TABLES and not special


def mechanism_of(
    choice: Choice, over_angle: bool, shared: bool, curves: bool, equal_throws: bool,
    angle_load: bool = False,
) -> str:  # fmt: skip
    """Return the mechanism that solves the designs of a part, one of `MECHANISMS`.

    Parameters
    ----------
    choice : Choice
        What all designs of the part have in common.
    over_angle : bool
        Whether there is a load over angle.
    shared : bool
        See `are_shared`.
    curves : bool
        Whether curves over the crank angle are wanted.
    equal_throws : bool
        Whether all crank radii are the engine's.
    angle_load : bool
        Whether own curves can contain the load over angle, see `is_common`. Tables do not contain
        it.
    """
    if not (METHODS[choice.method].in_batch and can_solve(choice, curves)):
        return GENERAL
    if angle_load:
        return OWN_CURVES if equal_throws and not curves else GENERAL
    if over_angle:
        return GENERAL
    return SHARED_TABLES if shared or curves or not equal_throws else OWN_CURVES


@dataclass
class Tally:
    """Numbers of designs by what solved them.

    Attributes
    ----------
    designs : Counter
        Designs given to each mechanism. Designs that are solved again, for their error or because
        they missed the tolerance, count again.
    deferred : int
        Of those given to the batch solver, how many it deferred to the general one.
    """

    designs: Counter[str] = field(default_factory=Counter)
    deferred: int = 0
    _lock: threading.Lock = field(default_factory=threading.Lock, repr=False)

    @property
    def deferred_share(self) -> float:
        """Fraction of the designs given to the batch solver that it deferred; NaN without any."""
        given = self.designs.total() - self.designs[GENERAL]
        return self.deferred / given if given else float("nan")

    @property
    def general_share(self) -> float:
        """Fraction of all designs that the general solver solved; NaN without any."""
        total = self.designs.total()
        return (self.designs[GENERAL] + self.deferred) / total if total else float("nan")

    def noting(self, deferred: Callable[[Integers, int], None]) -> Callable[[Integers, int], None]:
        """Return a function that counts the designs and passes them on."""

        def noted(chosen: Integers, threads: int) -> None:
            with self._lock:
                self.deferred += chosen.size
            deferred(chosen, threads)

        return noted


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
