"""Firing patterns of a scene: which firings happen, in sequence and over several cycles.

A pattern is a text (a letter or a number for each firing, or a random scatter) or a list of
numbers. An axis has several, a column of designs one for each design.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from engine_dyn.geometry.firing_sequence import LARGEST_FIRING, MOST_CYCLES, SEALED
from sweeps.base.checks import numbers
from sweeps.base.dimensions import DESIGN, FIRING_PATTERN
from sweeps.base.errors import SceneError, shown
from sweeps.scene.engine.cylinder_keys import CylinderKeys
from sweeps.scene.representations import named_some
from sweeps.scene.word_keys import WordKey

PATTERN = (
    "a string: a letter for each firing in sequence, 1 (fires), 0 (no combustion) or d (valves "
    f"shut), such as '110'; or a factor on the combustion pressure from 0 to {LARGEST_FIRING:g} "
    "for each, such as '1 0.95 1.02' or [1, 0.95, 1.02]; or 'deviation 0.03, 32 cycles, seed 1' "
    "(random)"
)
"""Meaning of the key `firing_pattern`, with the allowed values."""

_LETTERS: Mapping[str, float] = {"1": 1.0, "0": 0.0, "d": SEALED}


MOST_FIRINGS, MOST_SEEDS, MOST_TOGETHER = 4096, 1000, 2520
"""Largest number of firings of a pattern, patterns that one text stands for, and cycles after which
all patterns of a scene repeat."""

LONG = 60  # Largest number of letters of the name of a pattern


@dataclass(frozen=True)
class FiringPattern:
    """One pattern."""

    name: str  # Text of the pattern as its name; the beginning of a long one
    firings: tuple[float, ...] = ()  # Factor on the pressure of each firing; empty if random
    # Standard deviation of a random factor around 1, independent from firing to firing.
    deviation: float = 0.0
    cycles: int = 1  # Cycles after which a random pattern repeats
    seed: int = 0  # Seed of the random factors

    def of(self, cylinders: int) -> tuple[float, ...]:
        """Factors for an engine with so many cylinders."""
        if self.firings:
            return self.firings
        draw = np.random.default_rng(self.seed).normal(1.0, self.deviation, self.cycles * cylinders)
        return tuple(np.clip(draw, 0.0, LARGEST_FIRING).tolist())

    def cycles_of(self, cylinders: int) -> int:
        """Cycles after which it repeats."""
        if not self.firings:
            return self.cycles
        return len(self.firings) // math.gcd(len(self.firings), cylinders)


@dataclass(frozen=True)
class FiringPatterns:
    """Patterns of a scene, and which of them each design has."""

    each: tuple[FiringPattern, ...]  # Different patterns of the scene
    dims: tuple[str, ...]  # Dimensions over which patterns vary: none, their axis or the designs
    which: npt.NDArray[np.int64]  # Place of the pattern among `each`, over `dims`

    def cycles_of_each(self, counts: Sequence[int]) -> npt.NDArray[np.int64]:
        """Cycles after which that of each design repeats, for all these numbers of cylinders."""
        cycles = [math.lcm(*map(one.cycles_of, counts)) for one in self.each]
        return np.array(cycles, dtype=np.int64)[self.which]

    def cycles(self, counts: Sequence[int]) -> int:
        """Cycles after which all of them repeat, for engines with these numbers of cylinders."""
        return math.lcm(*np.unique(self.cycles_of_each(counts)).tolist())


def _read_axis(raw: object, keys: CylinderKeys, name: str) -> tuple[FiringPattern, ...]:
    """Patterns in a list; a range of seeds stands for a pattern each."""
    where = f"{name}: [axes] {FIRING_PATTERN}"
    if not isinstance(raw, list) or not raw:
        raise SceneError(f"{where} = {shown(raw)}: must be a list, each {PATTERN}")
    patterns = [
        one for place, item in enumerate(raw, start=1) for one in _read(item, f"{where} {place}")
    ]
    if len(set(patterns)) < len(patterns):
        twice = next(one for place, one in enumerate(patterns) if one in patterns[:place])
        raise SceneError(f"{where}: duplicate {shown(twice.name)}; patterns must be unique")
    names = [one.name for one in patterns]
    return tuple(
        replace(one, name=f"{one.name} {place}") if names.count(one.name) > 1 else one
        for place, one in enumerate(patterns, start=1)
    )


def read_firing_patterns(
    single: object, axis: tuple[FiringPattern, ...], labels: Mapping[str, Sequence[str]],
    counts: Sequence[int], name: str,
) -> FiringPatterns | None:  # fmt: skip
    """Firing patterns of a scene, checked: of [set], [axes] or [designs]; None without one."""
    texts = labels.get(FIRING_PATTERN)
    places = {"[set]": single is not None, "[axes]": bool(axis), "[designs]": texts is not None}
    given = [place for place, is_there in places.items() if is_there]
    if not given:
        return None
    where = f"{name}: {given[0]} {FIRING_PATTERN}"
    if len(given) > 1:
        raise SceneError(f"{name}: {FIRING_PATTERN}: given in {' and '.join(given)}; give it once")
    if single is not None:
        patterns = FiringPatterns((_one(single, where),), (), np.zeros((), dtype=np.int64))
    elif axis:
        patterns = FiringPatterns(axis, (FIRING_PATTERN,), np.arange(len(axis)))
    else:
        assert texts is not None
        different, which = np.unique(np.array(texts), return_inverse=True)
        each = tuple(_one(text, where) for text in different.tolist())
        patterns = FiringPatterns(each, (DESIGN,), which.reshape(-1))
    for one in patterns.each:
        cycles = max(map(one.cycles_of, counts))
        if cycles > MOST_CYCLES:
            raise SceneError(
                f"{where} = {shown(one.name)}: repeats after {cycles} cycles; must be at most "
                f"{MOST_CYCLES}"
            )
    cycles = patterns.cycles(counts)
    if cycles > MOST_TOGETHER:
        names = named_some([one.name for one in patterns.each])
        raise SceneError(
            f"{where}: {names} together repeat after {cycles:,} cycles; must be at most "
            f"{MOST_TOGETHER:,}"
        )
    return patterns


def _one(raw: object, where: str) -> FiringPattern:
    patterns = _read(raw, where)
    if len(patterns) > 1:
        raise SceneError(f"{where} = {shown(raw)}: several seeds are for [axes]; must have one")
    return patterns[0]


def _read(raw: object, where: str) -> list[FiringPattern]:
    """Patterns of a text or list: one, or one for each of its seeds."""
    if isinstance(raw, list) and raw:
        parts = [f"{one:.10g}" for one in numbers(raw, where).tolist()]
        text = " ".join(parts)
    elif isinstance(raw, str) and raw.strip():
        text = " ".join(raw.split())
        random = re.fullmatch(
            r"deviation\s+(?P<deviation>\S+?)\s*,\s*(?P<cycles>\d{1,12})\s+cycles?"
            r"(?:\s*,\s*seeds?\s+(?P<seed>\d{1,12})(?:\s+to\s+(?P<last>\d{1,12}))?)?",
            text,
        )
        if random is not None:
            return _random(random, text, where)
        parts = text.split() if " " in text or "." in text else list(text)
    else:
        raise SceneError(f"{where} = {shown(raw)}: must be {PATTERN}")
    if len(parts) > MOST_FIRINGS:
        raise SceneError(f"{where}: {len(parts)} firings; must be at most {MOST_FIRINGS}")
    firings = tuple(_factor(part, text, where) for part in parts)
    more = f" ... ({len(firings)} firings)"
    return [FiringPattern(text if len(text) <= LONG else text[:LONG] + more, firings)]


def _factor(part: str, text: str, where: str) -> float:
    if part in _LETTERS:
        return _LETTERS[part]
    try:
        value = float(part)
    except ValueError:
        value = math.nan
    if not 0.0 <= value <= LARGEST_FIRING:
        raise SceneError(f"{where} = {shown(text)}: {shown(part)}; must be {PATTERN}")
    return value


def _random(match: re.Match[str], text: str, where: str) -> list[FiringPattern]:
    try:
        deviation = float(match["deviation"])
    except ValueError:
        deviation = math.nan
    cycles, first = int(match["cycles"]), int(match["seed"] or 1)
    last = int(match["last"] or first)
    for wrong, what, allowed in (
        (not 0.0 < deviation <= 0.5, "deviation", "above 0 and at most 0.5"),
        (not 2 <= cycles <= MOST_CYCLES, "cycles", f"from 2 to {MOST_CYCLES}"),
        (not first <= last < first + MOST_SEEDS, "seeds", f"rising, and at most {MOST_SEEDS}"),
        (last >= 1 << 32, "seeds", "below 4294967296"),
    ):
        if wrong:
            raise SceneError(f"{where} = {shown(text)}: {what} must be {allowed}")
    return [
        FiringPattern(f"deviation {deviation:g}, {cycles} cycles, seed {seed}", (), deviation,
                      cycles, seed)
        for seed in range(first, last + 1)
    ]  # fmt: skip


KEY = WordKey(
    FIRING_PATTERN, PATTERN, f"a list, each {PATTERN}",
    {
        "anyOf": [
            {"type": "string", "minLength": 1},
            {"type": "array", "minItems": 1, "items": {"type": "number"}},
        ]
    },
    _read_axis, name_of=lambda one: one.name,
)  # fmt: skip
