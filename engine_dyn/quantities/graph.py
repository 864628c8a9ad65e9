"""The graph of parameters and quantities: plain data, put together from one file for each subject.

Planner, command line, README, file attributes and tests all read this table. A node without `make`
is a leaf. Everything is computed in SI units; a file's unit is `unit`, and `si` converts: the SI
value is the file's times `si`. The axes of a node are the union of its needs' axes, plus what it
adds; nobody writes axes by hand.
"""

from __future__ import annotations

import functools
from collections.abc import Mapping
from types import MappingProxyType

from engine_dyn.quantities import (
    balance,
    bearing_loads,
    curve_means,
    each_cylinder,
    flywheels,
    friction,
    friction_components,
    generator,
    loads,
    mechanism_forces,
    orders,
    parameters,
    pressure,
    rod_loads,
    running_gear,
    series,
    shaft_numbers,
    single_cylinders,
    speed,
    torque,
)
from engine_dyn.quantities.features import FEATURES, characteristic
from engine_dyn.quantities.node import Dimension, Node, check_needs
from engine_dyn.quantities.variants import check_words
from engine_dyn.units import DEGREE

# Archives list parameters in this order; those of new features come last.
_PARAMETERS: tuple[Node, ...] = (
    *parameters.PARAMETERS,
    *single_cylinders.PARAMETERS,
    *balance.PARAMETERS,
    *flywheels.PARAMETERS,
    *characteristic.PARAMETERS,
    *friction_components.PARAMETERS,
    *bearing_loads.PARAMETERS,
    *mechanism_forces.PARAMETERS,
    *shaft_numbers.PARAMETERS,
    *generator.PARAMETERS,
    *(key for feature in FEATURES for key in feature.parameters),
)

_QUANTITIES: tuple[Node, ...] = (
    *running_gear.NODES,
    *pressure.NODES,
    *friction.NODES,
    *friction_components.NODES,
    *torque.NODES,
    *loads.NODES,
    *speed.NODES,
    *balance.NODES,
    *flywheels.NODES,
    *series.NODES,
    *mechanism_forces.NODES,
    *rod_loads.NODES,
    *orders.NODES,
    *bearing_loads.NODES,
    *generator.NODES,
    *(node for feature in FEATURES for node in feature.nodes),
    *each_cylinder.NODES,
)
"""All nodes that are computed, public ones and those on the way to them.
"""

_CURVE_MEANS = curve_means.means_of_curves(_QUANTITIES)

_CONSTANTS = tuple(
    Node(name, "", "1", long_name, kind="constant", public=False)
    for name, long_name in (
        ("family", "indicator diagrams over load"),
        ("cycle", "which of the scene's modelled cycles"),
        ("period", "angle of one cycle"),
        ("curve_period", "angle after which curves repeat: of several cycles by load or pattern"),
        ("closure", "what the nominal speed is the mean of"),
        ("tolerance", "relative error of delta aimed at"),
        ("scale_table", "factor on the pressure over speed"),
        ("driven", "load over angle, load over speed or driver"),
        ("cylinder_set", "which of the scene's sets of cylinders"),
        ("cylinders_by_count", "phases and factors of the cylinders of each set"),
        ("method", "method of the periodic speed"),
        ("inertia_model", "constant or variable inertia"),
        ("double_acting", "pressures of both ends of double-acting cylinders"),
        *((one.constant, one.long_name) for one in FEATURES if one.constant is not None),
        ("variant_of", "which variant of a node the scene has"),
    )
)

_DIMENSIONS = (
    Dimension(
        "throw", "", "1", "throw along the shaft, with its cylinders, counted from 1; pins that "
        "are split stand in one", whole=True,
    ),
    Dimension(
        "bay", "", "1", "bay of the shaft between two main bearings, with its throw, counted from "
        "1", whole=True,
    ),
    Dimension(
        "piston", "", "1", "piston, by the number of its cylinder, counted from 1", whole=True,
    ),
    Dimension(
        "main_bearing", "j", "1",
        "main journal along the shaft, counted from 1, the first in front of throw 1", whole=True,
    ),
    Dimension(
        "mode", "m", "1", "elastic mode of the shaft, counted from the lowest", whole=True,
    ),
    *(dimension for feature in FEATURES for dimension in feature.dimensions),
    Dimension(
        "order", r"\nu", "1", "order, periods per crankshaft revolution, from 1/2 (two-stroke: 1)",
    ),
    Dimension("every_order", r"\nu", "1", "order that the vibration of a shaft is made of",
              public=False),
    Dimension(
        "crossing", "", "1", "crossing of torque and load, counted along the crank angle",
        whole=True,
    ),
    Dimension("firing_cycle", "", "1", "cycle of a firing pattern, counted from 1", whole=True),
    Dimension(
        "direction", r"\vartheta", "degree",
        "direction perpendicular to the shaft, 0 along cylinder 1, positive in the sense of "
        "rotation", si=DEGREE,
    ),
    Dimension(
        "crank_angle", r"\varphi", "degree",
        "crank angle, 0 at firing top dead centre of cylinder 1, increasing in the sense of "
        "rotation", si=DEGREE,
    ),
    Dimension(
        "close_angle", r"\varphi", "degree", "crank angle at which extremes of the speed are "
        "looked for", si=DEGREE, public=False,
    ),
    Dimension("parameter", "", "1", "parameter that an elasticity is taken by"),
    Dimension("uncertain_parameter", "", "1", "parameter with an uncertain value"),
)  # fmt: skip

DIMENSIONS: Mapping[str, Dimension] = MappingProxyType({d.name: d for d in _DIMENSIONS})
"""Dimensions beside the axes of a scene, in the order of archives."""

ALONG_SHAFT = frozenset({"throw", "bay", "main_bearing"})
"""Dimensions of what needs to know the throws of an engine."""

_POINTS = tuple(
    Node(d.name, d.symbol, d.unit, d.long_name, si=d.si, kind="parameter", public=False)
    for d in _DIMENSIONS
)
"""Leaves that hold the points of the dimensions."""

NODES: Mapping[str, tuple[Node, ...]]
"""Every node by name; a name with variants has one node for each."""

_by_name: dict[str, tuple[Node, ...]] = {}
for _node in (*_PARAMETERS, *_POINTS, *_CONSTANTS, *_QUANTITIES, *_CURVE_MEANS):
    _by_name[_node.name] = (*_by_name.get(_node.name, ()), _node)
NODES = MappingProxyType(_by_name)
check_needs(NODES)
for _node in (variant for variants in NODES.values() for variant in variants):
    check_words(_node.name, _node.when)

PARAMETERS: Mapping[str, Node] = MappingProxyType({n.name: n for n in _PARAMETERS})
"""Parameters that a scene may set or vary."""

NUMBERED: frozenset[str] = frozenset({*single_cylinders.OF_CYLINDER, *shaft_numbers.OF_SHAFT})
"""Parameters that belong to a single cylinder, disc, shaft, gear or damper."""

PATTERNS: Mapping[str, Node] = MappingProxyType(
    {**single_cylinders.PATTERNS, **shaft_numbers.PATTERNS}
)
"""Numbered parameters as lists show them: N stands for the number."""

UNLESS_GIVEN: Mapping[str, float] = MappingProxyType(
    {n.name: n.unless_given for n in _PARAMETERS if n.unless_given is not None}
)
"""Values of parameters, in file units, where neither scene nor engine gives one."""

QUANTITIES: Mapping[str, Node] = MappingProxyType(
    {name: _by_name[name][0] for name in sorted({n.name for n in _QUANTITIES if n.public})}
)
"""Quantities that lists and tables show; a scene may ask for them."""

CURVE_MEANS: Mapping[str, Node] = MappingProxyType({n.name: n for n in _CURVE_MEANS})
"""Root mean square and mean of every curve, by the endings of `curve_means`: lists name these once.
"""

ALL_QUANTITIES: Mapping[str, Node] = MappingProxyType({**QUANTITIES, **CURVE_MEANS})
"""All quantities that a scene may ask for."""

CONSTANTS: tuple[str, ...] = tuple(n.name for n in _CONSTANTS)


class Variants(dict[str, Node]):
    """The variants of nodes that hold for the words of a scene, by name: see `Node.when`.

    They are looked up again and again; each is found when it is first asked for.
    """

    def __init__(self, words: tuple[str, ...]) -> None:
        super().__init__()
        self.words = words

    def __missing__(self, name: str) -> Node:
        for node in NODES[name]:
            if all(word in self.words for word in node.when.split()):
                self[name] = node
                return node
        raise KeyError(f"no variant of {name!r} holds for {', '.join(self.words)}")


variants_of = functools.cache(Variants)
"""The variants for some words: scenes with the same words share them."""
