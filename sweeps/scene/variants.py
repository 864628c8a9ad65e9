"""Variants of quantities that hold for a scene: the words that select nodes of the graph.

What each word means stands in `engine_dyn.quantities.graph`.
"""

from __future__ import annotations

from collections.abc import Sequence

from engine_dyn.geometry.cylinders import Cylinders
from engine_dyn.geometry.firing_sequence import SEALED
from engine_dyn.pressure.double_acting import ends_of
from engine_dyn.quantities.each_cylinder import OF_CYLINDER
from engine_dyn.quantities.parameters import INERTIA_PARTS
from sweeps.scene.engine.engine_files import GEOMETRIC
from sweeps.scene.features import feature_words
from sweeps.scene.firing_patterns import FiringPatterns
from sweeps.scene.values import GivenValues, friction_law, over_stroke

OF_EXTREMES = {"largest_speed": "speed_of_largest", "smallest_speed": "speed_of_smallest"}
"""Keys in place of the nominal speed, and the words for them."""


def variant_words(
    values: GivenValues, *, closure: str, described: Sequence[Cylinders],
    patterns: FiringPatterns | None, law: str,
) -> tuple[str, ...]:  # fmt: skip
    """Words that select variants: one of each group of `engine_dyn.quantities.graph`.

    `closure` is what the nominal speed means, `described` the cylinders that scene or engine say
    more of than their number, and `law` that of what loads or drives the crankshaft.
    """
    return (
        closure,
        "by_pressure" if values.engine.torque is None else "by_torque",
        "single_acting" if ends_of(values.engine.family) is None else "double_acting",
        *_cylinder_words(values, described, patterns),
        friction_law(values),
        "own_cycles" if values.cycle_keys else "given_cycles",
        "volume_given" if values.gives(GEOMETRIC) else "volume_of_diagrams",
        law,
        "motor_of_slip" if motor_of_slip(values) else "motor_of_speed",
        _speed_word(values),
        *_inertia_words(values),
        "load_inertia" if values.nonzero("load_inertia") else "no_load_inertia",
        *_balance_words(values),
        *feature_words(values),
    )


def _cylinder_words(
    values: GivenValues, engines: Sequence[Cylinders], patterns: FiringPatterns | None
) -> tuple[str, ...]:
    centred = not (values.nonzero("pin_offset") or values.nonzero("crank_offset"))
    varied = {OF_CYLINDER[key].what for key in values.cylinder_keys}
    equal = all(engine.are_equal for engine in engines) and not values.nonzero("misfire")
    equal = equal and varied <= {"firing_angle"} and patterns is None
    several_makes = "bore" in varied or any(engine.several_makes for engine in engines)
    throws = all(engine.equal_throws for engine in engines) and "radius_factor" not in varied
    throws = throws and not several_makes
    if patterns is not None and any(SEALED in one.firings for one in patterns.each):
        # A sealed cylinder's pressure factor is a code: the mean work of a throw's cylinders does
        # not follow from the mean of their pressure factors
        throws = False
    throws = throws and (centred or not any(engine.both_sides for engine in engines))
    own_pins = all(engine.own_pins for engine in engines)
    plain_rods = not any(engine.articulated for engine in engines)
    return (
        "centred" if centred else "offset",
        "equal" if equal else "unequal",
        "equal_throws" if throws else "unequal_throws",
        "several_makes" if several_makes else "one_make",
        "plain_rods" if plain_rods else "articulated_rods",
        "own_pins" if own_pins else "shared_pins",
        "stroke_friction" if over_stroke(values) else "uniform_friction",
    )


def _speed_word(values: GivenValues) -> str:
    for gives in (values.gives, values.engine_gives):
        for key, word in OF_EXTREMES.items():
            if gives(key):
                return word
        if gives("speed"):
            break
    return "given_speed"


def _inertia_words(values: GivenValues) -> tuple[str, ...]:
    in_parts = not values.gives("inertia") and (
        values.gives(*INERTIA_PARTS) or values.engine_gives(*INERTIA_PARTS)
    )
    of_shaft = values.engine.shaft is not None
    # Values of the scene count before those of the engine.
    throw = ("throw_mass", "throw_radius")
    throw_given = not values.gives("crank_mass") and (
        values.gives(*throw) or values.engine_gives(*throw)
    )
    return (
        "wanted_delta" if values.gives("wanted_delta") else "given_inertia",
        "inertia_of_shaft" if of_shaft else "inertia_in_parts" if in_parts else "inertia_whole",
        "throw_given" if throw_given else "crank_mass_given",
    )


def _balance_words(values: GivenValues) -> tuple[str, ...]:
    return (
        "shaft" if values.nonzero("balance_shaft_mass") else "no_shaft",
        "pair" if values.nonzero("second_shaft_mass") else "no_pair",
    )


def motor_of_slip(values: GivenValues) -> bool:
    """Whether the motor's synchronous speed follows from its slip."""
    if values.gives("motor_synchronous_speed"):
        return False
    return values.gives("motor_slip") or values.engine_gives("motor_slip")
