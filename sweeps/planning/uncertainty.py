"""Uncertainty: how much results change where values are not well known.

A scene with [uncertainty] is planned once as it is, and once for each draw of the uncertain values;
`sweeps.running.uncertainty` makes bands of the results. Draws are the same for all designs, so that
what designs share they share in each draw, and differences between designs keep their meaning.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from engine_dyn.quantities.node import Node
from engine_dyn.types import Floats
from sweeps.dimensions import EXPLAINED, HIGH, LOW, SHARE, UNCERTAIN
from sweeps.errors import SceneError
from sweeps.scene.consistency.whole import check_scene
from sweeps.scene.model import Scene
from sweeps.scene.sample import drawn

__all__ = [
    "QUANTILES",
    "Uncertainty",
    "plan_uncertainty",
    "uncertainty_nodes",
]

QUANTILES = (0.025, 0.975)
"""Ends of the bands."""


@dataclass(frozen=True, eq=False)
class Uncertainty:
    """What is computed for the uncertainty of a plan.

    Attributes
    ----------
    quantities : tuple of str
        Of which.
    keys : tuple of str
        The uncertain parameters on which they depend.
    draws : ndarray, shape (number, key)
        Their values in the units of files.
    plans : tuple of Plan
        One for each draw.
    """

    quantities: tuple[str, ...]
    keys: tuple[str, ...]
    draws: Floats
    plans: tuple[Any, ...]


def uncertainty_nodes(base: Node, number: int) -> list[Node]:
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
    scene: Scene, quantities: list[str], make_plan: Callable[[Scene], Any], name: str
) -> Uncertainty:
    """Plan the draws of a scene.

    Parameters
    ----------
    scene : Scene
        Its [uncertainty] is given.
    quantities : list of str
        Those with one number for each design.
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
    if not quantities:
        raise SceneError(
            f"{name}: [uncertainty]: no quantity with one number per design is requested"
        )
    plain = replace(
        scene, quantities=tuple(quantities), elasticities=(), uncertainty=None, reference=None
    )
    known = drawn(scene.uncertainty)
    for draw in range(scene.uncertainty.number):
        _check(_with(plain, known, draw), known, name)
    unused = make_plan(_with(plain, known, 0)).unused_settings
    columns = {key: values for key, values in known.items() if key not in unused}
    if not columns:
        raise SceneError(
            f"{name}: [uncertainty]: no requested quantity depends on {', '.join(known)}"
        )
    number = scene.uncertainty.number
    plans = tuple(make_plan(_with(plain, columns, draw)) for draw in range(number))
    draws = np.column_stack([*columns.values()])
    return Uncertainty(tuple(quantities), tuple(columns), draws, plans)


def _check(scene: Scene, uncertain: Mapping[str, Floats], name: str) -> None:
    """Check a draw as a scene with the same values in [set] is."""
    try:
        check_scene(scene, name)
    except SceneError as error:
        text = str(error)
        for key in uncertain:
            text = text.replace(f"[set] {key}", f"[uncertainty] {key}")
        raise SceneError(text) from None


def _with(scene: Scene, columns: Mapping[str, Floats], draw: int) -> Scene:
    """Return the scene with the values of one draw."""
    values = {key: float(column[draw]) for key, column in columns.items()}
    return replace(scene, settings={**scene.settings, **values})
