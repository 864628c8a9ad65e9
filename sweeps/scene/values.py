"""Parameters that a scene gives: in which table each of them stands, and its values there.

The engine's own values hold wherever the scene gives none.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from engine_dyn.engine import Engine
from engine_dyn.quantities.each_cylinder import OF_CYLINDER
from engine_dyn.quantities.friction import FRICTION_LAWS
from engine_dyn.quantities.parameters import CYCLE_KEYS, STROKE_SHARES
from engine_dyn.quantities.shaft_numbers import OF_SHAFT
from engine_dyn.types import Floats
from sweeps.base.dimensions import DESIGN


class Given(NamedTuple):
    """Where a scene gives a parameter, and what."""

    # Table `set`, `axes` or `designs`; empty for a value of the engine, and for a default
    table: str
    values: npt.NDArray[Any]  # Values in the table, in the units of files; a single one if constant
    dims: tuple[str, ...]  # Dimension along which the parameter varies, if any


@dataclass(frozen=True, eq=False, kw_only=True)
class GivenValues:
    """Values of [set], [axes] and [designs], in the units of files, and the engine behind them."""

    engine: Engine  # Engine whose values hold where the scene gives none
    settings: dict[str, float]  # Parameters of [set]
    # Values of every axis but `design`: numbers, or words.
    axes: dict[str, Floats | tuple[str, ...]]
    designs: dict[str, Floats]  # Columns of [designs], equally long; empty without [designs]
    # Structured parts of the scene that belong to no engine, by the names of their features.
    parts: Mapping[str, Any] = field(default_factory=dict)

    @cached_property
    def given(self) -> dict[str, Given]:
        """Values of the scene by their keys; made once, and only looked up from then on."""
        return {
            **{k: Given("axes", np.asarray(values), (k,)) for k, values in self.axes.items()},
            **{k: Given("designs", column, (DESIGN,)) for k, column in self.designs.items()},
            **{k: Given("set", np.array([value]), ()) for k, value in self.settings.items()},
        }

    def gives(self, *keys: str) -> bool:
        """Whether the scene gives any of these parameters."""
        return not self.given.keys().isdisjoint(keys)

    def engine_gives(self, *keys: str) -> bool:
        """Whether the engine gives any of these parameters."""
        return not self.engine.values.keys().isdisjoint(keys)

    def table_of(self, key: str) -> str:
        """Table of the scene that gives a parameter; [set] where none does."""
        return self.given[key].table if key in self.given else "set"

    def given_or_own(self, key: str, default: float = np.nan) -> Given:
        """A parameter of the scene, or else of the engine.

        `default` is the value where the engine has none.
        """
        return self.given.get(key) or Given(
            "", np.array([self.engine.values.get(key, default)]), ()
        )

    def nonzero(self, key: str) -> bool:
        """Whether a parameter is anything but zero somewhere in the scene."""
        if key in self.given:
            return bool(self.given[key].values.any())
        return self.engine.values.get(key, 0.0) != 0.0

    @cached_property
    def counts(self) -> list[int]:
        """Numbers of cylinders that the scene has, each once."""
        return [int(count) for count in np.unique(self.given_or_own("cylinders").values)]

    @cached_property
    def cylinder_keys(self) -> tuple[str, ...]:
        """Parameters of single cylinders that the scene gives, or its engine."""
        own = self.engine.values
        return tuple(key for key in OF_CYLINDER if key in self.given or key in own)

    @cached_property
    def cylinder_set_keys(self) -> tuple[str, ...]:
        """Parameters that tell cylinders apart: with the engine's bore where one has its own."""
        keys = self.cylinder_keys
        own_bore = any(OF_CYLINDER[key].what == "bore" for key in keys)
        return ("bore", *keys) if own_bore else keys

    @cached_property
    def shaft_keys(self) -> tuple[str, ...]:
        """Parameters that give the numbers of the shaft, of its own and of the scene."""
        shaft = self.engine.shaft
        own = () if shaft is None else shaft.keys
        return (*own, *(key for key in self.given if key in OF_SHAFT and key not in own))

    @cached_property
    def cycle_keys(self) -> tuple[str, ...]:
        """Parameters of the modelled cycle that the scene replaces."""
        return tuple(key for key in CYCLE_KEYS if key in self.given)


# Name of the friction law that adds up the friction of components
BY_COMPONENT = "patton_nitschke_heywood"


def friction_law(values: GivenValues) -> str:
    """Name of the law: that of the scene, or else of its engine."""
    number = values.given_or_own("friction_law", 1.0).values[0]
    return FRICTION_LAWS[int(number) - 1]


def over_stroke(values: GivenValues) -> bool:
    """Whether the friction varies over the stroke.

    By components it does where the pressure of the rings is given: the law says how much of it is
    of rings and skirt. Otherwise it does where shares of it are given.
    """
    if friction_law(values) == BY_COMPONENT:
        return values.nonzero("ring_pressure")
    return any(values.nonzero(share) for share in STROKE_SHARES)
