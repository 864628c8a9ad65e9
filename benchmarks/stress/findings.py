"""What a part of the suite finds."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from benchmarks.workers import in_processes

__all__ = ["DEFECTS", "Findings", "gathered"]

DEFECTS = ("off", "outcome")
"""Verdicts that should not be: numbers beyond the tolerance, and another outcome."""


@dataclass
class Findings:
    """Verdicts on designs, the largest differences, and designs that are shown.

    Attributes
    ----------
    counts : Counter
        Designs by (row of a table, verdict).
    worst : dict
        Largest value of what a row of a table tells.
    examples : list of dict
        Inputs and answers.
    """

    counts: Counter[tuple[Any, str]] = field(default_factory=Counter)
    worst: dict[Any, float] = field(default_factory=dict)
    examples: list[dict[str, Any]] = field(default_factory=list)

    @property
    def size(self) -> int:
        """Designs judged."""
        return self.counts.total()

    @property
    def wrong(self) -> int:
        """Designs whose answer is not true."""
        return sum(self.of(verdict) for verdict in DEFECTS)

    def of(self, verdict: str, row: Any = None) -> int:
        """Designs with a verdict, of one row or of all."""
        return sum(
            count
            for (where, name), count in self.counts.items()
            if name == verdict and row in (None, where)
        )

    def note(self, what: Any, value: float) -> None:
        """Keep a value where it is the largest."""
        self.worst[what] = max(self.worst.get(what, 0.0), value)

    def add(self, other: Findings) -> None:
        """Add what another part has found."""
        self.counts.update(other.counts)
        self.examples += other.examples
        for what, value in other.worst.items():
            self.note(what, value)


def gathered(
    work: Callable[[Any], Findings], jobs: list[Any], processes: int, say: Callable[[str], None],
    what: str,
) -> Findings:  # fmt: skip
    """What all jobs have found, in processes of their own."""
    total = Findings()
    for done, part in enumerate(in_processes(work, jobs, processes), 1):
        total.add(part)
        say(f"{what}: {done} of {len(jobs)}, {total.size} designs, {total.wrong} wrong")
    return total
