"""Whether the friction of a scene is that of one law, and of an engine that this law is for."""

from __future__ import annotations

from typing import Any

import numpy as np

from engine_dyn.geometry.arrangement import FOUR_STROKE
from engine_dyn.quantities.friction_components import NODES
from engine_dyn.quantities.parameters import STROKE_SHARES
from sweeps.base.errors import SceneError
from sweeps.scene.crossings import refused
from sweeps.scene.model import Scene
from sweeps.scene.values import GivenValues

__all__ = ["check_friction_fractions", "check_friction_law"]

OF_COMPONENTS = frozenset(node.name for node in NODES if node.public)
"""Quantities of the law by components."""


def check_friction_law(scene: Scene, name: str) -> None:
    """Check that there is one law of the friction, and that it is for the engine."""
    table = scene.table_of("friction_law")
    if table != "set":
        raise SceneError(
            f"{name}: [{table}] friction_law: must be one value, in [set] or the engine file; "
            "compare scenes with different laws by `engine-dyn compare`"
        )
    asked = next((q for q in scene.quantities if q in OF_COMPONENTS), None)
    if scene.engine.period != FOUR_STROKE and asked:
        where = f"{name}: [output] quantities: '{asked}'"
        two = "friction by components", "a two-stroke engine"
        raise refused(*two, where, engine=scene.engine.name)


def check_friction_fractions(values: GivenValues, name: str) -> None:
    """Check that no design has more friction over the stroke than it has friction."""
    total: Any = 0.0
    of_designs: Any = 0.0
    for key in STROKE_SHARES:
        table, fractions, _ = values.given_or_own(key, 0.0)
        if table == "designs":
            of_designs = of_designs + fractions
        else:
            total += fractions.max()
    total = float(np.max(total + of_designs))
    if total > 1.0 + 1e-12:
        raise SceneError(
            f"{name}: {' + '.join(STROKE_SHARES)} = {total:g} in one design: the sum must be at "
            "most 1"
        )
