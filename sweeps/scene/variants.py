"""Which variants of quantities hold for a scene: the words that select nodes of the graph.

What each word means stands in `engine_dyn.quantities.variants`.
"""

from __future__ import annotations

from engine_dyn.pressure.family_grid import FamilyGrid
from engine_dyn.quantities.parameters import INERTIA_PARTS
from engine_dyn.quantities.single_cylinders import OF_CYLINDER
from sweeps.reading.engine_files import GEOMETRIC
from sweeps.scene.driven import driven_machine, motor_of_slip
from sweeps.scene.friction_law import friction_law, over_stroke
from sweeps.scene.model import Scene
from sweeps.scene.values import GivenValues

__all__ = ["variant_words"]


def variant_words(scene: Scene) -> tuple[str, ...]:
    """Words that select variants: one of each group of `engine_dyn.quantities.variants`."""
    over_speed = scene.indicator is None and isinstance(scene.engine.family, FamilyGrid)
    if scene.gives("recorded_cycle"):
        diagrams = "over_cycles"
    else:
        diagrams = "over_speed" if over_speed else "over_load"
    scaled = scene.indicator is None and scene.engine.pressure_scale is not None
    return (
        scene.closure,
        *_cylinder_words(scene),
        friction_law(scene),
        diagrams,
        "auxiliaries" if scene.nonzero("auxiliary_torque") else "bare",
        "own_cycles" if scene.cycle_keys else "given_cycles",
        "volume_given" if scene.gives(GEOMETRIC) else "volume_of_diagrams",
        "scale_over_speed" if scaled else "one_scale",
        *_load_words(scene),
        "characteristic" if scene.characteristic is not None else "given_load",
        *_inertia_words(scene),
        "load_inertia" if scene.nonzero("load_inertia") else "no_load_inertia",
        *_balance_words(scene),
    )


def _cylinder_words(scene: Scene) -> tuple[str, ...]:
    centred = not (scene.nonzero("pin_offset") or scene.nonzero("crank_offset"))
    engines = scene.described
    varied = {OF_CYLINDER[key].what for key in scene.cylinder_keys}
    equal = all(engine.equal for engine in engines) and not scene.nonzero("misfire")
    equal = equal and varied <= {"firing_angle"}
    throws = all(engine.equal_throws for engine in engines) and "radius_factor" not in varied
    return (
        "centred" if centred else "offset",
        "equal" if equal else "unequal",
        "equal_throws" if throws else "unequal_throws",
        "stroke_friction" if over_stroke(scene) else "uniform_friction",
    )


def _load_words(scene: Scene) -> tuple[str, ...]:
    driven = driven_machine(scene)
    return (
        driven.law,
        "with_driver" if driven.has_driver else "no_driver",
        "steady_load" if driven.over_angle is None else "angle_load",
        "motor_of_slip" if motor_of_slip(scene) else "motor_of_speed",
    )


def _inertia_words(values: GivenValues) -> tuple[str, ...]:
    in_parts = not values.gives("inertia") and (
        values.gives(*INERTIA_PARTS) or values.engine_gives(*INERTIA_PARTS)
    )
    return (
        "wanted_delta" if values.gives("wanted_delta") else "given_inertia",
        "inertia_in_parts" if in_parts else "inertia_whole",
        "throw_given" if _throw_given(values) else "crank_mass_given",
    )


def _throw_given(values: GivenValues) -> bool:
    """Whether the throws' mass is given as it is, in the scene or, without one there, the engine.

    As of the inertia, what the scene gives holds over what the engine does.
    """
    throw = ("throw_mass", "throw_radius")
    return not values.gives("crank_mass") and (values.gives(*throw) or values.engine_gives(*throw))


def _balance_words(values: GivenValues) -> tuple[str, ...]:
    fraction, mass = "counterweight_fraction", "counterweight_mass"
    # A fraction of the scene replaces the engine's mass.
    weights_given = not values.gives(fraction) and (values.gives(mass) or values.engine_gives(mass))
    # A fraction of 0 is given too.
    counterweights = weights_given or values.gives(fraction) or values.engine_gives(fraction)
    return (
        "weights_given" if weights_given else "weights_by_fraction",
        "counterweights" if counterweights else "no_counterweights",
        "shaft" if values.nonzero("balance_shaft_mass") else "no_shaft",
        "pair" if values.nonzero("second_shaft_mass") else "no_pair",
    )
