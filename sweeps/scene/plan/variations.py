"""Plans with other values: what elasticities and uncertainty have in common.

A scene that asks for either is planned once as it is, and again with other values of some of its
parameters. Each block of all these plans is computed, and their results are combined to variables
of the archive (`sweeps.running.compute.elasticities`, `sweeps.running.compute.uncertainty`). Only
values differ: a changed axis stays an axis, so whatever designs share, they share with changed
values too.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

from engine_dyn.quantities.node import Node
from engine_dyn.types import Floats
from sweeps.scene.model import Scene

__all__ = ["Variation", "ordinary", "with_values"]


@dataclass(frozen=True, eq=False)
class Variation:
    """Plans of a scene with other values, and the variables that are made of their results."""

    # Dimension of the parameters in these variables: `PARAMETER` for elasticities, `UNCERTAIN` for
    # bands.
    dimension: str
    keys: tuple[str, ...]  # The parameters
    quantities: tuple[str, ...]  # The results that are combined
    # Each variable, behind the result whose dimensions it has.
    variables: tuple[tuple[str, Node], ...]
    # The plans. A plan has such plans in it: `sweeps.scene.plan.plan` knows this module, which does
    # not know it.
    plans: tuple[Any, ...]
    # The values in the units of files, where they were drawn; shape (plan, key)
    draws: Floats | None = None


def ordinary(scene: Scene, quantities: tuple[str, ...]) -> Scene:
    """Return the scene that asks for these quantities and nothing beside them."""
    return replace(scene, quantities=quantities, elasticities=(), uncertainty=None, reference=None)


def with_values(scene: Scene, values: Mapping[str, Floats]) -> Scene:
    """Return the scene with other values of parameters, in the places where it gives them."""
    axes, designs, settings = {**scene.axes}, {**scene.designs}, {**scene.settings}
    for key, data in values.items():
        if key in axes:
            axes[key] = data
        elif key in designs:
            designs[key] = data
        else:
            settings[key] = float(data)
    return replace(scene, axes=axes, designs=designs, settings=settings)
