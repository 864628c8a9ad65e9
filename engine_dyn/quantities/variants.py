"""The words that select variants of nodes.

A name of the graph may have several nodes, its variants: `imep` is one formula for a centred
mechanism and another for an offset one. A scene has exactly one word of each group below, and a
variant holds where the scene has all words of its `when`. A word that stands in no group is refused
when the graph is made, so that a typing error cannot wait for a scene that reaches it.
"""

from __future__ import annotations

import difflib
from collections.abc import Mapping
from types import MappingProxyType

from engine_dyn.loads.laws import LAWS
from engine_dyn.quantities.features import FEATURES

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
        "unequal_throws": "crank radii of an engine differ",
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
                f"engine_dyn.quantities.variants{hint}"
            )
