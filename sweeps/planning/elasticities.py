"""Elasticities: how much each parameter of a design moves a result.

A scene that asks for `delta_elasticity` is planned once as it is, and for each parameter and each
step with that parameter changed by the step; `sweeps.running.elasticities` takes differences of the
results. Only the parameter differs: a changed axis stays an axis, so that whatever designs share,
they share with changed values too.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from engine_dyn.quantities.graph import DIMENSIONS, PARAMETERS
from engine_dyn.quantities.node import Node
from engine_dyn.quantities.parameters import SOLVER_COLUMNS
from engine_dyn.types import Booleans, Floats
from sweeps.checks import outside
from sweeps.dimensions import DESIGN, ELASTICITY, PARAMETER
from sweeps.errors import SceneError, shown
from sweeps.scene.known_values import Value
from sweeps.scene.model import Scene

__all__ = [
    "AGREE",
    "DIFFER",
    "ENDINGS",
    "KIND",
    "KINDS",
    "ONE_SIDE",
    "RATIO",
    "STEPS",
    "UNKNOWN",
    "Changed",
    "Elasticities",
    "changed_parameters",
    "elasticity_nodes",
    "plan_elasticities",
]

RATIO = 4.0
"""Ratio of a step to the next."""

STEPS = (0.02, 0.02 / RATIO, 0.02 / RATIO**2)
"""Relative steps, the largest first. Rows of the load family, where results bend, are 10 % and more
apart: a step of 2 % sees one of them at most."""

_TYPICAL = {"m": 0.01, "degree": 10.0, "N m": 10.0, "rpm": 100.0, "percent": 10.0}
"""Sizes in the units of files, of which steps are taken where a parameter is zero or an angle; of
other units, one."""

AGREE, DIFFER, ONE_SIDE, UNKNOWN = 0, 1, 2, 3
KINDS = ("both_sides_agree", "sides_differ", "one_side_only", "not_known")
"""What is known of a derivative, by these numbers."""

KIND = f"{ELASTICITY}_kind"

ENDINGS = {
    ELASTICITY: "elasticity: change of {} in percent for one percent of the parameter",
    f"{ELASTICITY}_error": "estimated error of the elasticity of {}",
    f"{ELASTICITY}_below": "elasticity of {} where the parameter decreases",
    f"{ELASTICITY}_above": "elasticity of {} where the parameter increases",
    KIND: "whether the elasticities of {} on both sides agree",
    "_derivative": "derivative of {} by the parameter, in the unit of each",
}
"""Variables for each quantity, by the endings of their names."""


@dataclass(frozen=True, eq=False)
class Changed:
    """A parameter, and the plans in which it is changed.

    Attributes
    ----------
    key : str
        The parameter.
    value : Value
        Its values in the units of files, on their dimensions.
    unit : Value
        What the step is a fraction of, on the same dimensions: the value itself, or a typical size.
    relative : Value of bool
        Whether it is the value itself, so that there is an elasticity.
    plans : tuple of (Plan, Plan)
        For each step the plan with smaller and that with larger values. A plan has such plans in
        it: `sweeps.planning.plan` knows this module, which does not know it.
    possible : tuple of (Value, Value)
        For each of these plans, where the changed value is one that the parameter may have.
    """

    key: str
    value: Value
    unit: Value
    relative: Value
    plans: tuple[tuple[Any, Any], ...]
    possible: tuple[tuple[Value, Value], ...]


@dataclass(frozen=True, eq=False)
class Elasticities:
    """What is computed for the elasticities of a plan.

    Attributes
    ----------
    quantities : tuple of str
        Of which.
    changed : tuple of Changed
        By which parameters.
    """

    quantities: tuple[str, ...]
    changed: tuple[Changed, ...]

    @property
    def solutions(self) -> int:
        """Plans beside the one without changes."""
        return sum(2 * len(one.plans) for one in self.changed)


def elasticity_nodes(base: Node) -> list[Node]:
    """Nodes of the variables of one quantity."""
    found = []
    for ending, about in ENDINGS.items():
        symbol = ""
        if ending == ELASTICITY and base.symbol:
            symbol = rf"\partial \ln {base.symbol} / \partial \ln x"
        found.append(
            Node(
                f"{base.name}{ending}", symbol, "" if ending == "_derivative" else "1",
                about.format(base.long_name), adds=(PARAMETER,),
                source="central differences, extrapolated (Richardson 1911)",
            )
        )  # fmt: skip
    return found


def changed_parameters(scene: Scene, leaves: Collection[str], used: set[str]) -> list[str]:
    """Continuous parameters that scene or engine give and that results depend on.

    `leaves` are the names of given values that are in force: what the scene gives may replace what
    the engine does.
    """
    given = {*scene.settings, *scene.axes, *scene.designs, *scene.engine.values}
    return [
        key
        for key, node in PARAMETERS.items()
        if key in given
        and key in leaves
        and key in used
        and not (node.whole or node.even)
        and key not in SOLVER_COLUMNS
    ]


def plan_elasticities(
    scene: Scene,
    dims: Mapping[str, tuple[str, ...]],
    keys: list[str],
    make_plan: Callable[[Scene], Any],
    name: str,
) -> Elasticities:
    """Plan the changed scenes of a scene.

    Parameters
    ----------
    scene : Scene
        What asks for elasticities.
    dims : dict
        Dimensions of the quantities.
    keys : list of str
        The parameters.
    make_plan : callable
        Plans an ordinary scene.
    name : str
        The scene as messages call it.

    Raises
    ------
    SceneError
        Where a quantity is a curve, or nothing that it depends on is continuous.
    """
    for quantity in scene.elasticities:
        where = f"{name}: [output] quantities: {shown(quantity + ELASTICITY)}"
        along = [d for d in dims[quantity] if d in DIMENSIONS]
        if along:
            raise SceneError(
                f"{where}: {quantity} is a curve over {along[0]}; elasticities exist only for "
                "single values"
            )
        if not keys:
            raise SceneError(f"{where}: it depends on no continuous parameter that is given")
    plain = replace(
        scene, quantities=scene.elasticities, elasticities=(), uncertainty=None, reference=None
    )
    return Elasticities(scene.elasticities, tuple(_changed(plain, key, make_plan) for key in keys))


def _changed(scene: Scene, key: str, make_plan: Callable[[Scene], Any]) -> Changed:
    """Plan the scenes in which one parameter is changed."""
    node = PARAMETERS[key]
    values, dims = _given(scene, key)
    relative = (values != 0.0) & (node.unit != "degree")
    unit = np.where(relative, np.abs(values), _TYPICAL.get(node.unit, 1.0))
    plans: list[tuple[Any, Any]] = []
    possible: list[tuple[Value, Value]] = []
    for step in STEPS:
        both = [values + sign * step * unit for sign in (-1.0, 1.0)]
        allowed: list[Booleans] = [~outside(moved, node) for moved in both]
        down, up = (
            # Where a value is not allowed, the design stays as it is, and the side is not known.
            make_plan(_with(scene, key, np.where(inside, moved, values)))
            for moved, inside in zip(both, allowed, strict=True)
        )
        plans.append((down, up))
        possible.append((Value(allowed[0], dims), Value(allowed[1], dims)))
    return Changed(
        key, Value(values, dims), Value(unit, dims), Value(relative, dims), tuple(plans),
        tuple(possible),
    )  # fmt: skip


def _given(scene: Scene, key: str) -> tuple[Floats, tuple[str, ...]]:
    """Values of a parameter in the units of files, and their dimensions."""
    if key in scene.axes:
        return np.asarray(scene.axes[key], dtype=np.float64), (key,)
    if key in scene.designs:
        return scene.designs[key], (DESIGN,)
    single = scene.settings.get(key, scene.engine.values.get(key, math.nan))
    return np.asarray(single, dtype=np.float64), ()


def _with(scene: Scene, key: str, values: Floats) -> Scene:
    """Return the scene with other values of one parameter, in the place where it gives them."""
    if key in scene.axes:
        return replace(scene, axes={**scene.axes, key: values})
    if key in scene.designs:
        return replace(scene, designs={**scene.designs, key: values})
    return replace(scene, settings={**scene.settings, key: float(values)})
