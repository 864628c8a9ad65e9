"""Plans with other values: what elasticities and uncertainty have in common.

A scene that asks for either is planned once as it is, and again with other values of some of its
parameters. Each block of all these plans is computed, and their results are combined to variables
of the archive (`sweeps.running.compute.variations`). Only values differ: a changed axis stays an
axis, so whatever designs share, they share with changed values too.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from engine_dyn.pressure.double_acting import OF_EFFECTIVE_PRESSURE
from engine_dyn.quantities.graph import DIMENSIONS, PARAMETERS
from engine_dyn.quantities.node import Node
from engine_dyn.quantities.parameters import SOLVER_COLUMNS
from engine_dyn.types import Booleans, Floats
from sweeps.base.checks import outside
from sweeps.base.dimensions import (
    ELASTICITY,
    EXPLAINED,
    FAILED_DRAWS,
    HIGH,
    LOW,
    PARAMETER,
    SHARE,
    UNCERTAIN,
)
from sweeps.base.errors import SceneError, shown
from sweeps.scene.consistency.pressure import ranges_of
from sweeps.scene.consistency.whole import check_scene
from sweeps.scene.derived_quantities import meanings_of
from sweeps.scene.known_values import Value
from sweeps.scene.model import Scene
from sweeps.scene.sample import drawn


@dataclass(frozen=True, eq=False)
class Variation:
    """Plans of a scene with other values, and the variables that are made of their results."""

    # Dimension of the parameters: `PARAMETER` for elasticities, `UNCERTAIN` for bands.
    dimension: str
    keys: tuple[str, ...]  # Keys of the varied parameters
    quantities: tuple[str, ...]  # Results that are combined
    # Variables of the archive, such as `delta_elasticity`, each with the result that it belongs to
    # and whose dimensions it has.
    variables: tuple[tuple[str, Node], ...]
    # Plans of the scene with other values of the varied parameters. Their type is `Plan` in
    # `sweeps.scene.plan.plan`, which imports this module.
    plans: tuple[Any, ...]
    draws: Floats | None = None  # Drawn values in the units of files; shape (plan, key)


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


QUANTILES = (0.025, 0.975)  # Quantiles at the ends of the bands


def _variables(base: Node, number: int) -> list[Node]:
    """Nodes of the variables of one quantity; `number` draws of it exist at a time."""
    low, high = (f"{100 * q:g} % quantile" for q in QUANTILES)
    band = replace(
        base, needs=(), make=None, adds=(), kind="value", gives=(), when="", outcome="",
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


def _plan_uncertainty(
    scene: Scene, stages: Mapping[str, Any], make_plan: Callable[[Scene], Any], name: str
) -> Variation:
    """Plan the draws of a scene with [uncertainty]; `stages` are those of its plan."""
    # Raises SceneError where no result with one number for each design depends on uncertain values;
    # where a draw is impossible for the engine.
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
    """Check a draw like a scene with the same values in [set]."""
    try:
        check_scene(scene, name)
    except SceneError as error:
        text = str(error)
        for key in uncertain:
            text = text.replace(f"[set] {key}", f"[uncertainty] {key}")
        raise SceneError(text) from None


RATIO = 4.0  # Ratio of one step to the next smaller one

STEPS = (0.02, 0.02 / RATIO, 0.02 / RATIO**2)
"""Relative steps, the largest first. Results bend at rows of the load family, 10 % or more apart: a
step of 2 % meets one of them at most."""

AGREE, DIFFER, ONE_SIDE, UNKNOWN = 0, 1, 2, 3
KINDS = ("both_sides_agree", "sides_differ", "one_side_only", "not_known")
"""Words for the certainty of a derivative, by their numbers."""

KIND = f"{ELASTICITY}_kind"

ENDINGS = {
    ELASTICITY: "elasticity: change of {} in percent for one percent of the parameter",
    f"{ELASTICITY}_error": "estimated error of the elasticity of {}",
    f"{ELASTICITY}_below": "elasticity of {} where the parameter decreases",
    f"{ELASTICITY}_above": "elasticity of {} where the parameter increases",
    KIND: "whether the elasticities of {} on both sides agree",
    "_derivative": "derivative of {} by the parameter, in the unit of each",
}
"""Endings of the names of each quantity's variables."""


def _variables_of(base: Node) -> list[Node]:
    """Nodes of the variables of one quantity."""
    nodes = []
    for ending, about in ENDINGS.items():
        symbol = ""
        if ending == ELASTICITY and base.symbol:
            symbol = rf"\partial \ln {base.symbol} / \partial \ln x"
        nodes.append(
            Node(
                f"{base.name}{ending}", symbol, "" if ending == "_derivative" else "1",
                about.format(base.long_name), adds=(PARAMETER,),
                source="central differences, extrapolated (Richardson 1911)",
            )
        )  # fmt: skip
    return nodes


def _changed_parameters(scene: Scene, leaves: Collection[str], used: set[str]) -> list[str]:
    """Continuous parameters that scene or engine give and that results depend on."""
    # `leaves` are the names of given values in force: values of the scene may replace those of the
    # engine.
    given = {*scene.settings, *scene.axes, *scene.designs, *scene.engine.values}
    family = scene.engine.family
    if "double_acting" in scene.words:
        given.difference_update(OF_EFFECTIVE_PRESSURE)
    if scene.indicator is not None or (family.diagrams and family.low == family.high):
        given.discard("load")  # The load only names the single diagram
    return [
        key
        for key, node in PARAMETERS.items()
        if key in given
        and key in leaves
        and key in used
        and not (node.whole or node.even)
        and key not in SOLVER_COLUMNS
    ]


def step_unit(node: Node, values: Floats) -> tuple[Floats, Booleans]:
    """Return the size that steps of a parameter are fractions of, and where it is the value itself.

    Only there is an elasticity; elsewhere it is a typical size.
    """
    relative = (values != 0.0) & (node.unit != "degree")
    # Sizes in the units of files that steps are relative to where a parameter is zero or an angle;
    # 1 for other units
    typical = {"m": 0.01, "degree": 10.0, "N m": 10.0, "rpm": 100.0, "percent": 10.0}
    return np.where(relative, np.abs(values), typical.get(node.unit, 1.0)), relative


def changed_values(scene: Scene, node: Node, values: Floats) -> Iterator[tuple[Floats, Booleans]]:
    """Values of a parameter below and above its own, step by step, and where they are allowed.

    Where one is not, or the engine has no diagram there, the design stays as it is, and that side
    is not known.
    """
    unit, _ = step_unit(node, values)
    covered = [(low, high) for key, low, high, _ in ranges_of(scene) if key == node.name]
    for step in STEPS:
        for sign in (-1.0, 1.0):
            moved = values + sign * step * unit
            allowed = ~outside(moved, node)
            for low, high in covered:
                allowed &= (moved >= low) & (moved <= high)
            yield np.where(allowed, moved, values), allowed


def _plan_elasticities(
    scene: Scene, stages: Mapping[str, Any], leaves: Mapping[str, Value], keys: list[str],
    make_plan: Callable[[Scene], Any], name: str,
) -> Variation:  # fmt: skip
    """Plan the changed scenes of a scene; `stages` and `leaves` are those of its plan."""
    # For each of the parameters `keys` in turn, plans follow step by step below and above.
    # Raises SceneError where a quantity is a curve, or depends on no continuous parameter.
    for quantity in scene.elasticities:
        where = f"{name}: [output] quantities: {shown(quantity + ELASTICITY)}"
        curve = [d for d in stages[quantity].dims if d in DIMENSIONS]
        if curve:
            raise SceneError(
                f"{where}: {quantity} is a curve over {curve[0]}; elasticities exist only for "
                "single values"
            )
        if not keys:
            raise SceneError(f"{where}: it depends on no continuous parameter that is given")
    plain = ordinary(scene, scene.elasticities)
    plans = [
        make_plan(with_values(plain, {key: values}))
        for key in keys
        for values, _ in changed_values(scene, PARAMETERS[key], np.asarray(leaves[key].data))
    ]
    variables = [(q, node) for q in scene.elasticities for node in _variables_of(stages[q].node)]
    return Variation(PARAMETER, tuple(keys), scene.elasticities, tuple(variables), tuple(plans))


def variations_of(
    scene: Scene, stages: Mapping[str, Any], leaves: Mapping[str, Value], used: set[str],
    make_plan: Callable[[Scene], Any], name: str,
) -> Iterator[Variation]:  # fmt: skip
    """Plan what a scene asks for with other values: elasticities, then draws of what is uncertain.

    `stages`, `leaves` and `used`, the leaves that results depend on, are those of its plan.
    """
    if scene.elasticities:
        keys = _changed_parameters(scene, leaves, used)
        yield _plan_elasticities(scene, stages, leaves, keys, make_plan, name)
    if scene.uncertainty is not None:
        yield _plan_uncertainty(scene, stages, make_plan, name)
