"""The graph of parameters and quantities: plain data, put together from one file for each subject.

Planner, command line, README, file attributes and tests all read this table. A node without `make`
is a leaf. Everything is computed in SI units; a file's unit is `unit`, and `si` converts: the SI
value is the file's times `si`. The axes of a node are the union of its needs' axes, plus what it
adds; nobody writes axes by hand.
"""

from __future__ import annotations

import difflib
import functools
from collections.abc import Mapping
from types import MappingProxyType

from engine_dyn.loads.laws import LAWS
from engine_dyn.quantities import (
    balance,
    bearing_loads,
    curve_extremes,
    each_cylinder,
    flywheels,
    friction,
    generator,
    loads,
    mechanism_forces,
    orders,
    parameters,
    pressure,
    running_gear,
    shaft_numbers,
    speed,
    torque,
)
from engine_dyn.quantities.features import FEATURES, characteristic
from engine_dyn.quantities.node import Dimension, Node, check_needs
from engine_dyn.units import DEGREE

# A name of the graph may have several nodes, its variants: `imep` is one formula for a centred
# mechanism and another for an offset one. A scene has exactly one word of each group below, and a
# variant holds where the scene has all words of its `when`. A word that stands in no group is
# refused when the graph is made, so that a typing error cannot wait for a scene that reaches it.
ALTERNATIVES: tuple[Mapping[str, str], ...] = (
    {
        "power_mean": "the nominal speed is a power mean of the speed over angle",
        "cycle_time": "the cycle takes as long as at the nominal speed",
    },
    {
        "by_pressure": "the engine's torque follows from the pressure in its cylinders",
        "by_torque": "it is given over the crank angle",
    },
    {
        "single_acting": "the gas acts on one side of the pistons",
        "double_acting": "it acts on both, and the diagram is that of an effective pressure",
    },
    {
        "centred": "the line of the piston pins meets the crank's axis",
        "offset": "it passes beside the crank's axis somewhere in the scene",
    },
    {
        "equal": "all cylinders of an engine have one pressure, mass and crank radius",
        "unequal": "cylinders of an engine differ, or one does not burn",
    },
    {
        "equal_throws": "all throws of an engine have one crank radius",
        "unequal_throws": "crank radii, bores or diagrams of an engine differ",
    },
    {
        "one_make": "all cylinders of an engine have one bore and the same diagrams",
        "several_makes": "cylinders of an engine have bores or diagrams of their own",
    },
    {
        "plain_rods": "all rods work on a crank pin",
        "articulated_rods": "rods hang on master rods",
    },
    {
        "own_pins": "each cylinder has a throw of its own",
        "shared_pins": "rods share the pin of a throw somewhere in the scene",
    },
    {
        "uniform_friction": "the friction torque is the same over the whole cycle",
        "stroke_friction": "the friction torque varies over the stroke",
    },
    {
        "chen_flynn": "the friction is a + b p_max + c c_m + d c_m^2",
        "patton_nitschke_heywood": "it is the sum of the components' friction",
    },
    {
        "given_cycles": "the diagrams are those of the engine or of the scene",
        "own_cycles": "the scene replaces parameters of the engine's modelled cycle",
    },
    {
        "volume_of_diagrams": "the compression ratio is that of the diagrams, or the engine's",
        "volume_given": "the scene gives a geometric compression ratio",
    },
    {law.name: law.meaning for law in LAWS},
    {
        "motor_of_speed": "the motor's synchronous speed is given",
        "motor_of_slip": "it follows from the nominal speed and the motor's slip there",
    },
    {
        "given_speed": "the nominal speed is given",
        "speed_of_largest": "it follows from the largest speed over the cycle",
        "speed_of_smallest": "it follows from the smallest speed over the cycle",
    },
    {
        "given_inertia": "the moment of inertia, or its parts, are given",
        "wanted_delta": "it follows from a wanted coefficient of speed fluctuation",
    },
    {
        "inertia_whole": "the moment of inertia is given as one number",
        "inertia_in_parts": "it is that of the running gear and of the parts given",
        "inertia_of_shaft": "it is the sum of the discs of the shaft",
    },
    {
        "crank_mass_given": "the mass of a throw is given, reduced to the crank radius",
        "throw_given": "it follows from the throw's mass and the radius of its centre of gravity",
    },
    {
        "no_load_inertia": "the load has no moment of inertia of its own",
        "load_inertia": "the load has a moment of inertia at its own shaft",
    },
    *(group for feature in FEATURES for group in feature.words),
    {
        "no_shaft": "no balance shaft at the crank's speed",
        "shaft": "a balance shaft turns backwards at the crank's speed",
    },
    {
        "no_pair": "no balance shafts at twice the crank's speed",
        "pair": "a pair of balance shafts turns at twice the crank's speed",
    },
)
"""Groups of words with the meaning of each; a scene has exactly one word of each group."""

WORDS: Mapping[str, str] = MappingProxyType(
    {w: t for group in ALTERNATIVES for w, t in group.items()}
)
"""All words and their meanings."""


def check_words(name: str, when: str) -> None:
    """Check that the words for which a variant holds exist.

    Parameters
    ----------
    name, when : str
        Name and words of the node.

    Raises
    ------
    ValueError
        For a word that stands in no group.
    """
    for word in when.split():
        if word not in WORDS:
            near = difflib.get_close_matches(word, WORDS, n=1)
            hint = f"; did you mean {near[0]!r}?" if near else ""
            raise ValueError(
                f"node {name!r}: when = {when!r}: {word!r} is no word of "
                f"engine_dyn.quantities.graph{hint}"
            )


# Archives list parameters in this order; those of new features come last.
_PARAMETERS: tuple[Node, ...] = (
    *parameters.PARAMETERS,
    *each_cylinder.PARAMETERS,
    *balance.PARAMETERS,
    *flywheels.PARAMETERS,
    *characteristic.PARAMETERS,
    *friction.PARAMETERS,
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
    *torque.NODES,
    *loads.NODES,
    *speed.NODES,
    *balance.NODES,
    *flywheels.NODES,
    *orders.SERIES_NODES,
    *mechanism_forces.NODES,
    *orders.NODES,
    *bearing_loads.NODES,
    *generator.NODES,
    *(node for feature in FEATURES for node in feature.nodes),
    *each_cylinder.NODES,
)
"""All computed nodes, public ones and those that they need."""

CURVE_MEANS: Mapping[str, Node] = MappingProxyType(
    {n.name: n for n in curve_extremes.means_of_curves(_QUANTITIES)}
)
"""Root mean square and mean of every curve, by the endings of `curve_extremes`; lists name these
once."""

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
        ("undisturbed_set", "the set of which every cylinder burns fully"),
        ("cylinders_by_count", "phases and factors of the cylinders of each set"),
        ("method", "method of the periodic speed"),
        ("inertia_model", "constant or variable inertia"),
        ("double_acting", "pressures of both ends of double-acting cylinders"),
        *((one.constant, one.long_name) for one in FEATURES if one.constant is not None),
        ("variant_of", "which variant of a node the scene has"),
    )
)

DIMENSIONS: Mapping[str, Dimension] = MappingProxyType({d.name: d for d in (
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
)})  # fmt: skip
"""Dimensions beside the axes of a scene, in the order of archives."""

ALONG_SHAFT = frozenset({"throw", "bay", "main_bearing"})
"""Dimensions of nodes that need the engine's throws."""

_by_name: dict[str, tuple[Node, ...]] = {}
for _node in (
    *_PARAMETERS,
    # Nodes without a formula, which hold the values along each dimension.
    *(
        Node(d.name, d.symbol, d.unit, d.long_name, si=d.si, kind="parameter", public=False)
        for d in DIMENSIONS.values()
    ),
    *_CONSTANTS, *_QUANTITIES, *CURVE_MEANS.values(),
):  # fmt: skip
    _by_name[_node.name] = (*_by_name.get(_node.name, ()), _node)
NODES: Mapping[str, tuple[Node, ...]] = MappingProxyType(_by_name)
"""Every node by name; a name with variants has one node for each."""

check_needs(NODES)
for _node in (variant for variants in NODES.values() for variant in variants):
    check_words(_node.name, _node.when)

PARAMETERS: Mapping[str, Node] = MappingProxyType({n.name: n for n in _PARAMETERS})
"""Parameters that a scene may set or vary."""

NUMBERED: frozenset[str] = frozenset({*each_cylinder.OF_CYLINDER, *shaft_numbers.OF_SHAFT})
"""Parameters that belong to a single cylinder, disc, shaft, gear or damper."""

PATTERNS: Mapping[str, Node] = MappingProxyType(
    {**each_cylinder.PATTERNS, **shaft_numbers.PATTERNS}
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
"""Variants of all nodes for some words, shared by scenes with the same words."""

SOURCES: Mapping[str, str] = {
    "API": "American Petroleum Institute, Standard 618, Reciprocating compressors for petroleum, "
    "chemical, and gas industry services, 5th edition, paragraph 6.6.4 on the reversal of the rod "
    "load; as others give it, not compared page by page",
    "Asgari": "T. Asgari, A. Mohammadebrahim, N. Meyghani and H. Saraei, Development of balance "
    "shaft and flywheel for single cylinder diesel engine based on analytical approach and "
    "comparison with the simulation result, 2019; in Persian with an English abstract, KIASA "
    "Company and Arak University of Technology, Iran, published by the Iranian Society of Engine",
    "Biezeno": "C. B. Biezeno and R. Grammel, Technische Dynamik, Springer; not compared page by "
    "page",
    "Chen": "S. K. Chen and P. F. Flynn, Development of a single cylinder compression ignition "
    "research engine, SAE paper 650733, 1965, doi:10.4271/650733",
    "Eksergian": "R. Eksergian, Dynamical analysis of machines, Journal of the Franklin Institute, "
    "in parts, volumes 209 to 211, 1930 and 1931",
    "Heywood": "J. B. Heywood, Internal Combustion Engine Fundamentals, McGraw-Hill, 1988",
    "Kakaitsas": "A. S. Kakaitsas, Ανομοιομορφία περιστροφής εμβολοφόρων κινητήρων: υπολογιστική "
    "μελέτη και παραμετρική ανάλυση (Rotational irregularity of piston engines: computational "
    "study and parametric analysis), diploma thesis, supervised by E. G. Giakoumis, National "
    "Technical University of Athens, School of Mechanical Engineering, October 2015; in Greek",
    "IACS": "International Association of Classification Societies, Unified Requirement M68, "
    "dimensions of propulsion shafts and their permissible torsional vibration stresses",
    "Ker": "W. Ker Wilson, Practical Solution of Torsional Vibration Problems, Chapman and Hall; "
    "the method as textbooks give it, not compared page by page",
    "Khurmi": "R. S. Khurmi and J. K. Gupta, Theory of Machines, S. Chand; the definitions as the "
    "book's public companions give them, not compared page by page",
    "Kloss": "M. Kloss on torque and slip of induction motors, usually dated 1908; the formula as "
    "textbooks of electrical machines give it",
    "Kundur": "P. Kundur, Power System Stability and Control, McGraw-Hill, 1994; example 12.2, a "
    "generator on an infinite bus, as others reprint its numbers",
    "Lewis": "F. M. Lewis, Vibration during acceleration through a critical speed, Transactions of "
    "the American Society of Mechanical Engineers, volume 54, 1932, paper APM-54-24; not compared "
    "page by page",
    "Mosakowski": "R. Mosakowski, Zależności na parametry kinematyczne mechanizmu korbowego w "
    "nowym ujęciu (New form of relations for calculating kinematic parameters of crank mechanism), "
    "Gdańsk University of Technology, Department of Internal Combustion Engines and Compressors; "
    "in Polish with an English summary, year and journal are not printed in the copy used",
    "Norton": "R. L. Norton, Design of Machinery, McGraw-Hill: offset slider-crank",
    "Patton": "K. J. Patton, R. C. Nitschke and J. B. Heywood, Development and evaluation of a "
    "friction model for spark-ignition engines, SAE paper 890836, 1989, doi:10.4271/890836",
    "Power": "Power units, lecture 18: Силовые агрегаты, лекция 18, Уравновешивание двигателей "
    "(Balancing of engines), slides of a lecture in Russian; author, institution and year are not "
    "given in the copy used, and no public address is known",
    "Rakopoulos": "Notes in Greek after the book by C. D. Rakopoulos, professor at the National "
    "Technical University of Athens, ΜΕΚ ΙΙ: Εμβάθυνση στην κατασκευή και λειτουργία (Internal "
    "combustion engines II); author and year of the notes are not given in the copy used, and no "
    "public address is known",
    "Rezeka": "S. F. Rezeka and N. A. Henein, A new approach to evaluate instantaneous friction "
    "and its components in internal combustion engines, SAE paper 840179, 1984, "
    "doi:10.4271/840179",
}
"""Full citations, by the first word of the short name that `Node.source` begins with."""
