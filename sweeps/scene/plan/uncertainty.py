"""Uncertainty: how much results change where values are not well known.

A scene with [uncertainty] is planned again for each draw of the uncertain values;
`sweeps.running.compute.uncertainty` makes bands of the results. Draws are the same for all designs,
so that what designs share they share in each draw, and differences between designs keep their
meaning.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from engine_dyn.quantities.graph import DIMENSIONS
from engine_dyn.quantities.node import Node
from sweeps.base.dimensions import EXPLAINED, FAILED_DRAWS, HIGH, LOW, SHARE, UNCERTAIN
from sweeps.base.errors import SceneError
from sweeps.scene.consistency.whole import check_scene
from sweeps.scene.derived_quantities import meanings_of
from sweeps.scene.model import Scene
from sweeps.scene.plan.variations import Variation, ordinary, with_values
from sweeps.scene.sample import drawn

__all__ = ["QUANTILES", "plan_uncertainty"]

QUANTILES = (0.025, 0.975)
"""Ends of the bands."""


def _variables(base: Node, number: int) -> list[Node]:
    """Nodes of the variables of one quantity; `number` draws of it exist at a time."""
    low, high = (f"{100 * q:g} % quantile" for q in QUANTILES)
    band = replace(
        base, needs=(), make=None, adds=(), kind="value", gives=(), when="", can_fail=False,
        width=8 * number,
    )  # fmt: skip
    plain = Node("", "", "1", "")
    return [
        replace(band, name=base.name + LOW, long_name=f"{base.long_name}, {low} of the draws"),
        replace(band, name=base.name + HIGH, long_name=f"{base.long_name}, {high} of the draws"),
        replace(
            plain, name=f"{base.name}{EXPLAINED}",
            long_name=f"share of the variance of the {base.long_name} explained as linear",
        ),
        replace(
            plain, name=f"{base.name}{SHARE}", adds=(UNCERTAIN,),
            long_name=f"share of the variance of the {base.long_name} due to the parameter",
            source="regression coefficients, standardised",
        ),
    ]  # fmt: skip


def plan_uncertainty(
    scene: Scene, stages: Mapping[str, Any], make_plan: Callable[[Scene], Any], name: str
) -> Variation:
    """Plan the draws of a scene.

    Parameters
    ----------
    scene : Scene
        Its [uncertainty] is given.
    stages : dict
        Those of its plan.
    make_plan : callable
        Plans an ordinary scene.
    name : str
        The scene as messages call it.

    Raises
    ------
    SceneError
        Where no result depends on what is uncertain, and none has one number for each design; where
        a draw is one that the engine cannot have.
    """
    assert scene.uncertainty is not None
    quantities = tuple(
        quantity
        for quantity in scene.quantities
        if not set(stages[quantity].dims) & set(DIMENSIONS)
        and quantity != "status"
        and not meanings_of(quantity)
    )
    if not quantities:
        raise SceneError(
            f"{name}: [uncertainty]: no quantity with one number per design is requested"
        )
    plain = ordinary(scene, quantities)
    columns = drawn(scene.uncertainty)
    scenes = [
        with_values(plain, {key: column[draw] for key, column in columns.items()})
        for draw in range(scene.uncertainty.number)
    ]
    for one in scenes:
        _check(one, columns, name)
    unused = make_plan(scenes[0]).unused_settings
    keys = tuple(key for key in columns if key not in unused)
    if not keys:
        raise SceneError(
            f"{name}: [uncertainty]: no requested quantity depends on {', '.join(columns)}"
        )
    plans = tuple(make_plan(one) for one in scenes)
    draws = np.column_stack([columns[key] for key in keys])
    variables = [(q, node) for q in quantities for node in _variables(stages[q].node, len(plans))]
    if "status" in stages:
        variables.append(("status", Node(FAILED_DRAWS, "", "1", "draws without a result")))
    return Variation(UNCERTAIN, keys, quantities, tuple(variables), plans, draws)


def _check(scene: Scene, uncertain: Iterable[str], name: str) -> None:
    """Check a draw as a scene with the same values in [set] is."""
    try:
        check_scene(scene, name)
    except SceneError as error:
        text = str(error)
        for key in uncertain:
            text = text.replace(f"[set] {key}", f"[uncertainty] {key}")
        raise SceneError(text) from None
