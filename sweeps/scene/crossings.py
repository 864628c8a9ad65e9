"""Features of a scene that do not go together: the one table, and the refusals that it makes.

Features work together unless two of them stand in a row here. Then the pair is refused in one line,
or the scene's feature replaces the other one, which counts nowhere. The page of limits is made from
this table. Which scenes have a feature, and where messages say it stands, is in
`sweeps.scene.consistency.features`; that is also where the rows are checked, except for those that
readers and commands check themselves, before there is a whole scene, by `refused`.
"""

from __future__ import annotations

import itertools
from collections.abc import Collection, Container
from typing import NamedTuple

from engine_dyn.loads.laws import LOAD_LAWS
from engine_dyn.quantities.features.hold import HELD_KEYS
from engine_dyn.quantities.parameters import INERTIA_PARTS
from sweeps.base.errors import SceneError
from sweeps.scene.features import GIVEN_FEATURES


class Crossing(NamedTuple):
    """Two features that are refused together."""

    # Names of the two features; messages state the place of the first one.
    feature: str
    other: str
    says: str  # Text of messages after the place; `{engine}` is the name of the engine.


SEVERAL = "several engines or arrangements"
HOLDING = "hold, held_torque or held_power"
SINGLE = "bores or diagrams of single cylinders"
NOT_WITH = "not allowed together with"
_NOT_OF_TORQUE = "not allowed: engine {engine} gives its torque in place of a pressure"
_EXTREME_OF_TORQUE = (
    "not allowed: only for a [[diagram]] of kind 'torque' without a driver; give speed, on which "
    "the torque of engine {engine} depends"
)

CROSSINGS = (
    # Pairs of whole tables, which are checked before any table is read.
    Crossing(
        "[sample]", "[designs]",
        "only one of them is allowed, because [sample] draws the designs; other parameters that "
        "vary belong in [axes]",
    ),
    Crossing(
        "elasticities", SEVERAL,
        "only for one engine; the scene has several engines or arrangements",
    ),
    Crossing(
        "[uncertainty]", SEVERAL,
        "not allowed with several engines or arrangements, because each has its own uncertain "
        "values",
    ),
    *(
        Crossing(table, SEVERAL, "applies to one engine, but the scene has several")
        for table in ("[reference]", "[measured]")
    ),
    *(
        Crossing("[reduce]", other, f"{NOT_WITH} {other}")
        for other in (
            "[reference]", "[measured]", "[uncertainty]", "elasticities", SEVERAL,
        )
    ),
    Crossing(
        "[reduce]", "texts in [designs] or [sample]",
        f"{NOT_WITH} texts in [designs] or [sample] ({{labels}})",
    ),
    Crossing(
        "[characteristic]", "[indicator]",
        f"{NOT_WITH} [indicator], whose diagram holds at every speed",
    ),
    # Pairs on the pressure in cylinders.
    Crossing(
        "parameters of the modelled cycle", "[indicator]",
        f"{NOT_WITH} [indicator], which is measured",
    ),
    Crossing(
        "parameters of the modelled cycle", "an engine without diagrams",
        "not allowed: engine {engine} has no diagrams",
    ),
    *(
        Crossing(
            feature, "diagrams of single cylinders",
            "not allowed: cylinders of engine {engine} have diagrams of their own",
        )
        for feature in ("[indicator]", "parameters of the modelled cycle")
    ),
    Crossing(
        "largest_speed or smallest_speed", "an engine that gives its pressure", _EXTREME_OF_TORQUE
    ),
    Crossing("largest_speed or smallest_speed", "a driver", _EXTREME_OF_TORQUE),
    Crossing(
        "parameters of the modelled cycle", "diagrams that are not modelled by the first law",
        "not allowed: engine {engine} has diagrams that are not modelled by the first law; all "
        "[[diagram]] must be 'first_law' or 'two_stroke'",
    ),
    Crossing(
        "bore or crankcase_pressure", "double-acting cylinders",
        "not allowed: the double-acting cylinders of engine {engine} are modelled with its own; "
        "change it in the engine file",
    ),
    Crossing(
        "a load that varies", "[indicator]",
        f"{NOT_WITH} [indicator], whose diagram holds for every design",
    ),
    Crossing(
        "[characteristic]", "double-acting cylinders",
        "not allowed: the double-acting cylinders of engine {engine} are a machine that is driven, "
        "which has no load to find",
    ),
    Crossing("load", "[characteristic]", f"{NOT_WITH} [characteristic], which determines it"),
    Crossing(
        "hold", "held_torque or held_power",
        "takes the torque of the undisturbed engine; not allowed together with held_torque or "
        "held_power, which give a number",
    ),
    *(
        Crossing(HOLDING, other, says)
        for other, says in (
            ("[characteristic]", f"{NOT_WITH} [characteristic], whose torque the load follows"),
            ("[indicator]", f"{NOT_WITH} [indicator], whose diagram holds for every design"),
            (
                "an engine that gives its torque",
                "not allowed: engine {engine} gives its torque, which no load changes",
            ),
            (
                "double-acting cylinders",
                "not allowed: the double-acting cylinders of engine {engine} are a machine that is "
                "driven, which has no load to find",
            ),
            ("a driver", f"{NOT_WITH} a driver, which turns the engine whatever its torque is"),
            (
                "diagrams for one load",
                "not allowed: engine {engine} has diagrams for one load alone; there is no load "
                "with another torque",
            ),
        )
    ),
    Crossing("[indicator]", "an engine that gives its torque", _NOT_OF_TORQUE),
    Crossing(
        "variable inertia", "an engine that gives its torque",
        "not allowed: engine {engine} gives its torque, and not the masses that move with its "
        "pistons; must be constant",
    ),
    Crossing(
        "firing_pattern", "an engine that gives its torque",
        "not allowed: engine {engine} gives its torque, not its cylinders",
    ),
    *(
        Crossing("misfire, pressure_factor or firing_pattern", other, says)
        for other, says in (
            ("an engine that gives its torque", _NOT_OF_TORQUE),
            (
                "a compressor or pump",
                "a compressor or pump has no diagram without its own; factors on its pressure "
                "must be 1, and misfire 0",
            ),
        )
    ),
    Crossing(
        "[indicator]", "double-acting cylinders",
        "not allowed: engine {engine} has double-acting cylinders, and it is of one end",
    ),
    # Pairs on cylinders and their mechanism.
    Crossing(
        "parameters of single cylinders", "several numbers of cylinders",
        f"{NOT_WITH} several numbers of cylinders; must be one number",
    ),
    Crossing(
        "arrangement in [axes]", "several numbers of cylinders",
        f"{NOT_WITH} several numbers of cylinders; must be one number",
    ),
    *(
        Crossing("arrangement in [axes]", f"{key} in [set]",
                 f"{NOT_WITH} {key} in [set]; give one of them")
        for key in ("arrangement", "firing_angles")
    ),
    Crossing(
        "cylinders", "several arrangements", "not allowed here; it follows from each arrangement"
    ),
    Crossing(
        "pin_offset", "banks to both sides of the crank's axis (VR)",
        "must be 0 where banks lie to both sides of the crank's axis (VR engines); crank_offset "
        "moves them apart",
    ),
    *(
        Crossing(feature, "articulated_rods", f"{NOT_WITH} articulated_rods")
        for feature in (
            "friction over the stroke", "balance_shaft_mass", "second_shaft_mass",
            "firing_pattern", "[characteristic]", "radius_factor",
        )
    ),
    *(
        Crossing(feature, SINGLE, f"{NOT_WITH} {SINGLE}")
        for feature in (
            "friction over the stroke", "friction by components", "[characteristic]", HOLDING,
        )
    ),
    Crossing(SINGLE, "articulated_rods", f"{NOT_WITH} articulated_rods"),
    Crossing(
        "another number of cylinders", f"{SINGLE} of the engine",
        "not allowed: cylinders of engine {engine} have bores or diagrams of their own; must be "
        "its own number",
    ),
    Crossing(
        "bore_N", "double-acting cylinders",
        "not allowed: the double-acting cylinders of engine {engine} are modelled with one bore",
    ),
    Crossing(
        "articulated_rods", "radius_factor or a VR engine",
        f"{NOT_WITH} radius_factor or a VR engine",
    ),
    Crossing(
        "firing_pattern over several cycles", "[measured]",
        f"{NOT_WITH} [measured], whose speed is that of one cycle",
    ),
    Crossing(
        "firing_pattern", "a load over several cycles",
        f"{NOT_WITH} a load that repeats after more than one cycle",
    ),
    # Pairs on friction.
    Crossing(
        "constants and shares of the friction", "friction by components",
        f"{NOT_WITH} friction_law = 'patton_nitschke_heywood', which computes the friction of the "
        "components",
    ),
    Crossing(
        "friction by components", "a two-stroke engine",
        "the law of Patton, Nitschke and Heywood applies to four-stroke engines; a cycle of engine "
        "{engine} is one revolution",
    ),
    Crossing(
        "friction over the stroke", "double-acting cylinders",
        "must be 0: engine {engine} has double-acting cylinders, whose rings no single pressure "
        "presses on the liner",
    ),
    # Pairs on loads and drivers.
    Crossing("a motor", "driver_table", f"{NOT_WITH} driver_table: give one driver"),
    *(
        Crossing(
            "load_linear or load_square", other, f"{NOT_WITH} {other}: give one law over speed"
        )
        for other in ("a driver", "a load_table over speed")
    ),
    Crossing(
        "a load_table over speed", "a driver",
        f"{NOT_WITH} a driver, whose factor follows from the torque balance; must be over an "
        "angle",
    ),
    # Pairs on a speed that is followed in time.
    *(
        Crossing("[transient]", other, says)
        for other, says in (
            (
                "an engine that gives its torque",
                "not allowed: engine {engine} gives its torque, which no fuel command changes",
            ),
            (
                "double-acting cylinders",
                "not allowed: the double-acting cylinders of engine {engine} burn nothing",
            ),
            (
                "a compressor or pump",
                "not allowed: the cylinders of engine {engine} burn nothing",
            ),
            ("[indicator]", f"{NOT_WITH} [indicator], whose one diagram no fuel command changes"),
            ("[characteristic]", f"{NOT_WITH} [characteristic]; the load is that of [transient]"),
            (HOLDING, f"{NOT_WITH} {HOLDING}; the load is that of [transient]"),
            (
                "parameters of the modelled cycle",
                f"{NOT_WITH} parameters of the modelled cycle; give them in the engine file",
            ),
            (
                "diagrams over load and speed",
                "not allowed: the diagrams of engine {engine} depend on the speed; those over the "
                "load alone are followed in time",
            ),
            ("firing_pattern", f"{NOT_WITH} firing_pattern; [transient] missed has single firings"),
            (SINGLE, f"{NOT_WITH} {SINGLE}"),
            (
                "another load than a + k omega^alpha",
                "supports only the load law a + k omega^alpha, with the k of [transient]; not "
                "another law, a load_table, a driver, or [[auxiliaries]] over an angle",
            ),
            ("friction by components", f"{NOT_WITH} friction_law = 'patton_nitschke_heywood'"),
            (
                "friction over the stroke",
                f"{NOT_WITH} friction over the stroke (friction_boundary and other shares)",
            ),
        )
    ),
    # Pairs on methods of the solver.
    Crossing(
        "method thesis", "another load than a + k omega^alpha",
        "supports only the load law a + k omega^alpha; with another law, load_table, a driver, "
        "[[auxiliaries]] or a torque given for the engine, use one of auto, newton",
    ),
    Crossing(
        "method closed", "another load over speed than a + k omega^alpha",
        "has a closed form of the loads a + k and a + k omega^2 alone; with load_linear, "
        "load_square, a load_table over speed or a driver, use one of auto, newton",
    ),
    Crossing(
        "closure cycle_time", "method thesis",
        "method 'thesis' does not solve for the load coefficient; use one of auto, newton, closed, "
        "or closure = 'power_mean'",
    ),
    # Pairs of features of which one concerns the shaft or the balance.
    Crossing(
        "inertia or its parts", "[shaft]",
        f"{NOT_WITH} a shaft, whose discs have all inertia; give disc_inertia_N",
    ),
    Crossing(
        "several numbers of cylinders", "[shaft]",
        "not allowed to vary with a shaft, which has a disc for each throw",
    ),
    Crossing(
        "[[idler_gears]]", "[shaft]",
        f"{NOT_WITH} a shaft, whose discs have all inertia; give each gear as a disc that gears of "
        "the shaft join",
    ),
    Crossing(
        "counterweight_fraction or counterweight_mass", "[[counterweights]]",
        f"{NOT_WITH} [[counterweights]]; give one of them",
    ),
    Crossing(
        "another crankshaft", "[[counterweights]] of the engine",
        "the [[counterweights]] of engine {engine} are those of its own crankshaft; give "
        "[[counterweights]], counterweight_fraction or counterweight_mass in the scene",
    ),
    # Pairs on runs and archives.
    Crossing("a device", "a scheduler", "not allowed with a scheduler and its workers"),
    Crossing(
        "extend", "[reduce]",
        "was reduced as it was computed, and has not the values that more points would be added "
        "to; run the larger scene",
    ),
    Crossing(
        "extend", "designs that a search has found",
        "its designs were found by a search, which cannot be extended; run `engine-dyn optimise` "
        "with more generations",
    ),
    Crossing(
        "extend", "a sample of method latin_hypercube",
        "a Latin hypercube cannot be extended, because its points depend on their total number; "
        "only 'sobol' and 'saltelli' samples can",
    ),
)  # fmt: skip
"""Pairs of features that are refused; the first one that a scene has is reported."""

REPLACED = (
    *(
        (one.written, one.replaces or f"the {one.written} of the engine")
        for one in GIVEN_FEATURES.values()
        if one.replaces or not one.scenes_only
    ),
    ("counterweight_fraction or counterweight_mass", "the [[counterweights]] of the engine"),
    ("a motor", "the driver_table of the engine"),
    ("friction by components", "constants and shares of the friction of the engine"),
    ("reciprocating_mass", "the piston_mass of the engine"),
    ("arrangement or firing_angles", "arrangement, firing order and crank radii of the engine"),
)
"""Parts that a scene gives, each with the part that it replaces, which then counts nowhere."""

KEYS: tuple[tuple[str, tuple[str, ...], str], ...] = (
    ("crank_ratio", ("rod_length",), "both determine the rod length; give one of them"),
    ("load", HELD_KEYS, "the load follows from what is held; give one of them"),
    ("held_torque", ("held_power",), "both determine the torque that is held; give one of them"),
    ("speed", ("largest_speed", "smallest_speed"), "the nominal speed follows; give one of them"),
    ("largest_speed", ("smallest_speed",), "each determines the nominal speed; give one of them"),
    (
        "wanted_delta",
        ("inertia", "flywheel_inertia"),
        "the inertia follows from the wanted delta; give one of them",
    ),
    (
        "counterweight_fraction",
        ("counterweight_mass",),
        "both determine the counterweights; give one of them",
    ),
    (
        "counterweights_factor",
        ("counterweight_fraction", "counterweight_mass"),
        "it is a factor on [[counterweights]], which they replace; give one of them",
    ),
    (
        "motor_slip",
        ("motor_synchronous_speed",),
        "both determine the motor's synchronous speed; give one of them",
    ),
    (
        "crank_mass",
        ("throw_mass", "throw_radius"),
        "both determine the mass of a crank throw at the crank radius; give one of them",
    ),
    (
        "synchronising_torque",
        ("synchronising_power",),
        "both determine the synchronising torque; give one of them",
    ),
    (
        "load_damping",
        ("load_damping_factor",),
        "both determine the damping by the load; give one of them",
    ),
    ("inertia", INERTIA_PARTS, "give the inertia as a whole or in parts"),
    *(
        (key, other.keys, "each defines the load over speed; give one law")
        for law, other in itertools.combinations(LOAD_LAWS.values(), 2)
        for key in law.keys
    ),
)
"""A key, the keys that it excludes because both give the same thing, and the reason.

It holds for [values] of engine files and for [set], [axes] and [designs] of scenes alike. Keys of a
scene replace the excluded keys of its engine."""


def exclusive_pair(keys: Container[str]) -> tuple[str, str, str] | None:
    """Two of the keys that exclude each other, and the reason; None where there are none."""
    for first, others, reason in KEYS:
        second = next((key for key in others if key in keys), None)
        if first in keys and second is not None:
            return first, second, reason
    return None


def replaced_by(keys: Collection[str]) -> frozenset[str]:
    """Keys of an engine that count nowhere where a scene gives these: they exclude each other."""
    replaced: set[str] = set()
    for first, others, _ in KEYS:
        if first in keys:
            replaced.update(others)
        if not set(others).isdisjoint(keys):
            replaced.add(first)
    return frozenset(replaced - set(keys))


def refused(feature: str, other: str, where: str, **names: str) -> SceneError:
    """Return the refusal of a pair; `where` is the place of the feature, as messages say it."""
    (row,) = (row for row in CROSSINGS if row[:2] == (feature, other))
    return SceneError(f"{where}: {row.says.format(**names)}")
