"""The values that a scene starts from, in SI units: its own, its engine's, and the defaults."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from engine_dyn.quantities.graph import NODES, PARAMETERS, UNLESS_GIVEN, variants_of
from engine_dyn.speed.fields import FRICTION_NAMES
from sweeps.scene.crossings import replaced_by
from sweeps.scene.values import GivenValues

BY_CHOICE = frozenset(
    key for key in PARAMETERS if len({variant.make is None for variant in NODES[key]}) > 1
)
"""Parameters that are given or derived, depending on the words of a scene."""


class Value(NamedTuple):
    """An array, the names of its dimensions, and the SI value of one of its units.

    A constant is anything, without dimensions. Given columns stay in the units of files until a
    stage takes them: a copy of each in SI units would double them.
    """

    data: Any
    dims: tuple[str, ...] = ()
    unit: float = 1.0

    @property
    def si(self) -> Any:
        """The array in SI units; itself where it is so already."""
        return self.data if self.unit == 1.0 else self.data * self.unit


def _single_values(given: Mapping[str, float]) -> dict[str, Value]:
    return {k: Value(np.float64(v), (), PARAMETERS[k].si) for k, v in given.items()}


_DEFAULTS = _single_values(UNLESS_GIVEN)


def known_values(
    values: GivenValues, words: Sequence[str], more: Mapping[str, float]
) -> dict[str, Value]:
    """Parameters that scene or engine give, and neutral values of what the engine does not have.

    Values of the scene count before those of the engine. `words` select variants of quantities;
    `more` are single values that come from elsewhere: [solver], or the measured diagram.
    """
    known = {**_DEFAULTS, **_single_values(_left_in_force(values, words, more))}
    for key, (_, given, dims) in values.given.items():
        if key in PARAMETERS:
            data = np.asarray(given, dtype=np.float64)
            known[key] = Value(data if dims else data[0], dims, PARAMETERS[key].si)
    return known | {k: Value(np.float64(v)) for k, v in _neutral(words).items()}


def _left_in_force(
    values: GivenValues, words: Sequence[str], more: Mapping[str, float]
) -> dict[str, float]:
    """Values of the engine, and single values over them, that the scene leaves in force."""
    # Where the words of a scene select a derived variant of a parameter that also has a given one
    # (the load of a characteristic, the inertia for a wanted delta), the derived value replaces the
    # engine's.
    own = {**values.engine.values, **more}
    variants = variants_of(tuple(words))
    derived = {key for key in BY_CHOICE & own.keys() if variants[key].make is not None}
    replaced = set(replaced_by(values.given.keys()))
    if "reciprocating_mass" in values.given:
        replaced.add("piston_mass")  # Only the reciprocating mass follows from the piston's
    return {key: value for key, value in own.items() if key not in derived and key not in replaced}


def _neutral(words: Sequence[str]) -> dict[str, float]:
    """Neutral values of parts that an engine with some words does not have."""
    neutral: dict[str, float] = {}
    if "centred" in words:
        neutral["offset_ratio"] = 0.0
    if "equal" in words:
        neutral["pressure_share"] = neutral["mass_share"] = 1.0
    if "equal_throws" in words:
        neutral["stroke_share"] = 1.0
    if "uniform_friction" in words:
        neutral |= dict.fromkeys(FRICTION_NAMES, 0.0)
    return neutral
