"""What a part of the suite finds, and how it is told."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from benchmarks.tables import small
from benchmarks.workers import in_processes
from engine_dyn.status import MEANINGS

DEFECTS = ("broken", "bits", "lost", "off", "outcome", "uncovered")
"""Counts that should be zero: broken rules, other bits, hangs and crashes, numbers beyond the
tolerance, another outcome, true errors above `delta_error` beyond the share that may be."""

KEPT = 40
"""Designs that are kept of each sort and job."""

Say = Callable[[str], None]


@dataclass
class Findings:
    """Counts of designs, largest values, and designs that are shown.

    Attributes
    ----------
    counts : Counter
        By what, and further by what it is of: ("off", "motor", 0).
    worst : dict
        Largest value of what a row of a table tells.
    arrays : dict
        Parts of arrays, by name.
    examples : list of dict
        Inputs and answers; "what" says why they are kept.
    """

    counts: Counter[tuple[Any, ...]] = field(default_factory=Counter)
    worst: dict[Any, float] = field(default_factory=dict)
    arrays: dict[str, list[Any]] = field(default_factory=dict)
    examples: list[dict[str, Any]] = field(default_factory=list)

    def of(self, *start: Any) -> int:
        """Sum of the counts that begin so."""
        return sum(n for key, n in self.counts.items() if key[: len(start)] == start)

    @property
    def defects(self) -> int:
        """Designs, jobs and bits that should not be."""
        return sum(self.of(what) for what in DEFECTS)

    def total(self, kinds: Iterable[str]) -> int:
        """Sum of the counts of some kinds."""
        return sum(self.of(kind) for kind in kinds)

    def note(self, what: Any, value: float) -> None:
        """Keep a value where it is the largest."""
        self.worst[what] = max(self.worst.get(what, 0.0), value)

    def mark(self, *key: Any, mask: Any, tell: Callable[[int], dict[str, Any]]) -> None:
        """Count designs of a mask, and keep some, of which `tell` tells by place."""
        self.counts[key] += int(np.sum(mask))
        for place in np.flatnonzero(mask)[:KEPT].tolist():
            self.examples.append({"what": " ".join(map(str, key)), **tell(place)})

    def keep(self, **parts: Any) -> None:
        """Add parts to arrays."""
        for name, part in parts.items():
            self.arrays.setdefault(name, []).append(part)

    def array(self, name: str) -> Any:
        """All parts of an array."""
        return np.concatenate(self.arrays.get(name, [np.zeros(0)]))

    def add(self, other: Findings) -> None:
        """Add what another job has found."""
        self.counts.update(other.counts)
        self.examples += other.examples
        for name, parts in other.arrays.items():
            self.arrays.setdefault(name, []).extend(parts)
        for what, value in other.worst.items():
            self.note(what, value)


def gathered(
    work: Callable[[Any], Findings], jobs: list[Any], processes: int, say: Say, what: str
) -> Findings:
    """What all jobs have found, in processes of their own."""
    total = Findings()
    for done, part in enumerate(in_processes(work, jobs, processes), 1):
        total.add(part)
        say(f"{what}: {done} of {len(jobs)}, {total.defects} defects")
    return total


# How it is told -----------------------------------------------------------------------------------


def count(number: int) -> str:
    """Digits in threes."""
    return f"{number:,}".replace(",", " ")


def size(value: float) -> str:
    """An error's size."""
    return "0" if value == 0.0 else small(value)


def rows(part: str, found: Findings) -> list[list[str]]:
    """Every count and every largest value of a part: what, of which kind, and the number."""
    told = [(what, of, count(number)) for (what, *of), number in found.counts.items()]
    told += [
        ("largest", list(of) if isinstance(of, tuple) else [of], size(value))
        for of, value in found.worst.items()
    ]
    lines = [
        [part, what, ", ".join(MEANINGS[w] if isinstance(w, int) else str(w) for w in of), number]
        for what, of, number in told
    ]
    return sorted(lines)
