"""Parameters that a search may vary: ranges, whole numbers, lists of values, words."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np

from engine_dyn.quantities.node import Node
from engine_dyn.types import Floats
from sweeps.base.checks import known_key, number
from sweeps.base.errors import SceneError, plain_number, shown
from sweeps.base.files.numbers_with_units import PATTERN, with_unit_of_last
from sweeps.base.ratios import number_or_ratio
from sweeps.scene.distributions import Choice, Distribution, WholeNumbers, read_distribution
from sweeps.scene.sample import WORDS, parameters_of
from sweeps.scene.whole_keys import check_of_designs

FORMS = (
    "'inertia = 0.2 to 5' or '0.2 to 5 kg m2' (with the word log after it uniform in the "
    "logarithm), 'cylinders = 4, 6, 8', 'arrangement = in-line 6 | V6 60 split-pin', or keys of "
    "the scene's [sample], such as 'inertia,stroke'"
)
"""Ways to write a text of `over`, for messages."""


@dataclass(frozen=True)
class Space:
    """Parameters that a search varies, each a function of a number between 0 and 1."""

    parameters: Mapping[str, Distribution]  # Distribution of each parameter by its key
    tables: Mapping[str, Any]  # The distributions as [sample] writes them, without units

    def __len__(self) -> int:
        return len(self.parameters)

    def columns(self, positions: Floats) -> dict[str, Any]:
        """Values of the parameters at positions in the unit cube, shape (designs, parameters)."""
        return {
            key: law.of(np.ascontiguousarray(positions[:, number]))
            for number, (key, law) in enumerate(self.parameters.items())
        }

    def without(self, key: str) -> Space:
        """The space of all other parameters."""
        return Space(
            {k: law for k, law in self.parameters.items() if k != key},
            {k: table for k, table in self.tables.items() if k != key},
        )

    @property
    def count(self) -> int | None:
        """How many designs there are; None where a parameter may have any value of a range."""
        counts = [_count(law) for law in self.parameters.values()]
        return None if 0 in counts else math.prod(counts)

    def one_of_each(self) -> Floats:
        """Positions of a few designs that have every word and whole number between them."""
        if not self.parameters:
            return np.empty((1, 0))
        rows = max([2, *(c for c in map(_count, self.parameters.values()) if c)])
        positions = np.full((rows, len(self)), 0.5)
        for column, law in enumerate(self.parameters.values()):
            many = _count(law)
            if many:
                positions[:, column] = (np.arange(rows) % many + 0.5) / many
        return positions

    def all_positions(self) -> Floats:
        """Positions of all designs, where they can be counted; the first parameter slowest."""
        counts = [_count(law) for law in self.parameters.values()]
        middles = [(np.arange(many) + 0.5) / many for many in counts]
        return np.array(list(product(*middles)), dtype=np.float64)


def _count(law: Distribution) -> int:
    """Number of values that a parameter may have; 0 for all values of a range."""
    if isinstance(law, Choice):
        return len(law.values)
    return (law.high - law.low) // law.step + 1 if isinstance(law, WholeNumbers) else 0


def read_space(over: Any, raw: Mapping[str, Any], name: str) -> Space:
    """Read what a search of the scene `name` may vary: ranges in place, and keys of its [sample].

    None stands for all of [sample]. SceneError refuses what is no range or list, unknown keys, and
    a search in which nothing varies.
    """
    sample = raw.get("sample") or {}
    if not isinstance(sample, Mapping):
        raise SceneError(f"{name}: [sample] = {shown(sample)}: must be a table")
    of_scene = {key: sample[key] for key in parameters_of(sample)}
    if over is None:
        tables, where = of_scene, {key: f"{name}: [sample] {key}" for key in of_scene}
    else:
        tables = _in_place(over, of_scene, name)
        where = {
            key: f"{name}: [sample] {key}" if table is of_scene.get(key) else f"over {key}"
            for key, table in tables.items()
        }
    if not tables:
        raise SceneError(
            f"{name}: nothing to search: the scene has no [sample]; name the parameters to search "
            "with over (--over), such as --over 'inertia = 0.2 to 5'"
        )
    parameters, read = {}, {}
    for key, table in tables.items():
        if key not in WORDS:
            check_of_designs(key, where[key], "the search")
        node = known_key(key, where[key].removesuffix(f" {key}"), also=WORDS)
        parameters[key] = read_distribution(table, where[key], node)
        read[key] = table if node is None else _in_numbers(table, where[key], node)
        if key in (raw.get("axes") or {}):
            raise SceneError(
                f"{where[key]}: is an axis of the scene, at whose every value the conditions must "
                "hold; a key cannot be both an axis and searched"
            )
    return Space(parameters, read)


def _in_numbers(table: Any, where: str, node: Node) -> Any:
    """A range or a list whose texts, such as "2 lb ft2", are numbers in the unit of scenes."""
    if isinstance(table, Mapping):
        texts = {k: v for k, v in table.items() if isinstance(v, str) and k != "spacing"}
        return {**table, **{k: number(v, where, node) for k, v in texts.items()}}
    return [number(v, where, node) if isinstance(v, str) else v for v in table]


def _in_place(over: Any, of_scene: Mapping[str, Any], name: str) -> dict[str, Any]:
    """Tables of the parameters that `over` names."""
    if isinstance(over, Mapping):
        return dict(over)
    texts = [over] if isinstance(over, str) else over
    if not isinstance(texts, Sequence) or not all(isinstance(t, str) and t.strip() for t in texts):
        raise SceneError(f"over = {shown(over)}: must be {FORMS}")
    tables: dict[str, Any] = {}
    for text in texts:
        for key, table in _of_text(text, of_scene, name):
            if key in tables:
                raise SceneError(f"over {key}: given twice")
            tables[key] = table
    return tables


def _of_text(text: str, of_scene: Mapping[str, Any], name: str) -> list[tuple[str, Any]]:
    key, sign, values = (part.strip() for part in text.partition("="))
    if not sign:
        parts = []
        for one in (part.strip() for part in text.split(",")):
            if one not in of_scene:
                allowed = f", which has {', '.join(of_scene)}" if of_scene else ""
                raise SceneError(
                    f"over {shown(one)}: not in [sample] of {name}{allowed}; give a range to "
                    f"search it too, such as '{one if one.isidentifier() else 'inertia'} = 0.2 to "
                    "5'"
                )
            parts.append((one, of_scene[one]))
        return parts
    if key in WORDS:
        return [(key, [part.strip() for part in values.split("|")])]
    try:
        return [(key, _numbers(values))]
    except ValueError:
        raise SceneError(f"over {shown(text)}: must be {FORMS}") from None


def _numbers(text: str) -> Any:
    """A range or a list of numbers as [sample] writes them."""
    plain = " ".join(text.split())
    low, between, high = plain.partition(" to " if " to " in plain else "..")
    if not between:
        return [_number(part) for part in with_unit_of_last(text.split(","))]
    ends = with_unit_of_last([low, high.removesuffix(" log")])
    table = dict(zip(("low", "high"), map(_number, ends), strict=True))
    return {**table, "spacing": "log"} if high.endswith(" log") else table


def _number(text: str) -> float | int | str:
    try:
        return int(text)
    except ValueError:
        if re.match(PATTERN, text):
            return text.strip()
        return number_or_ratio(text) if "/" in text else plain_number(text)
