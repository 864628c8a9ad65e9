"""Parameters that a scene gives: in which table each of them stands, and its values there.

The engine's own values hold wherever the scene gives none.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from engine_dyn.engine import Engine
from engine_dyn.quantities.parameters import CYCLE_KEYS
from engine_dyn.quantities.single_cylinders import OF_CYLINDER
from engine_dyn.types import Floats

__all__ = ["GivenValues"]


@dataclass(frozen=True, eq=False, kw_only=True)
class GivenValues:
    """Values of [set], [axes] and [designs], in the units of files, and the engine behind them.

    Attributes
    ----------
    engine : Engine
        The engine whose values hold where the scene gives none.
    settings : dict of float
        Parameters of [set].
    axes : dict
        Values of every axis but `design`: numbers, or words.
    designs : dict of ndarray
        Columns of [designs], equally long; empty without [designs].
    """

    engine: Engine
    settings: dict[str, float]
    axes: dict[str, Floats | tuple[str, ...]]
    designs: dict[str, Floats]

    def gives(self, *keys: str) -> bool:
        """Whether the scene gives any of these parameters."""
        places = (self.settings, self.axes, self.designs)
        return any(key in place for key in keys for place in places)

    def engine_gives(self, *keys: str) -> bool:
        """Whether the engine gives any of these parameters."""
        return any(key in self.engine.values for key in keys)

    def given(self, key: str) -> tuple[str, Floats] | None:
        """Table of the scene that gives a parameter, and its values there; None where none does."""
        if key in self.settings:
            return "set", np.array([self.settings[key]])
        if key in self.designs:
            return "designs", self.designs[key]
        values = self.axes.get(key)
        return None if values is None else ("axes", np.asarray(values, dtype=float))

    def table_of(self, key: str) -> str:
        """Table of the scene that gives a parameter; [set] where none does."""
        return (self.given(key) or ("set", None))[0]

    def given_or_own(self, key: str, default: float = np.nan) -> tuple[str, Floats]:
        """Table and values of a parameter; the engine's value has no table.

        `default` is the value where the engine has none.
        """
        return self.given(key) or ("", np.array([self.engine.values.get(key, default)]))

    def nonzero(self, key: str) -> bool:
        """Whether a parameter is anything but zero somewhere in the scene."""
        return bool(self.given_or_own(key, 0.0)[1].any())

    @property
    def counts(self) -> list[int]:
        """Numbers of cylinders that the scene has, each once."""
        return [int(count) for count in np.unique(self.given_or_own("cylinders")[1])]

    @property
    def cylinder_keys(self) -> tuple[str, ...]:
        """Parameters of single cylinders that the scene gives."""
        return tuple(key for key in OF_CYLINDER if self.gives(key))

    @property
    def cycle_keys(self) -> tuple[str, ...]:
        """Parameters of the modelled cycle that the scene replaces."""
        return tuple(key for key in CYCLE_KEYS if self.gives(key))
