"""The keys of scenes and of engine files that belong to no single subject, and what makes them.

What they are is said in `engine_dyn.parameters`. Keys of one subject alone stand beside its
quantities: `each_cylinder`, `balance`, `flywheels`, `features.characteristic`, `mechanism_forces`.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from engine_dyn import parameters
from engine_dyn.geometry import masses, slider_crank
from engine_dyn.loads import driven_machine
from engine_dyn.quantities.node import Node, given

_VARIANTS: Mapping[str, tuple[dict[str, Any], ...]] = {
    "reciprocating_mass": (
        {"make": lambda piston_mass, rod_mass, rod_centre_of_gravity, rod: (
            masses.reciprocating_mass(piston_mass, rod_mass, rod_centre_of_gravity, rod)
        )},
    ),
    "inertia": (
        {"when": "wanted_delta", "make": lambda inertia_required: inertia_required},
        {"when": "given_inertia inertia_in_parts", "make":
            lambda engine_inertia, auxiliary_inertia, flywheel_inertia, inertia_beyond_gear:
            masses.inertia_of_parts(
                engine_inertia, auxiliary_inertia, flywheel_inertia, inertia_beyond_gear
            )},
        {"when": "given_inertia inertia_of_shaft", "make": lambda shaft_inertia: shaft_inertia},
        {"when": "given_inertia inertia_whole"},
    ),
    "motor_synchronous_speed": (
        {"when": "motor_of_slip", "make": driven_machine.synchronous_speed,
         "needs": ("speed", "motor_slip", "motor_gear_ratio")},
        {"when": "motor_of_speed"},
    ),
    "crank_ratio": (
        {"when": "offset", "make": lambda rod_length, stroke, pin_line: (
            slider_crank.crank_radius(stroke, rod_length, pin_line) / rod_length
        )},
        {"when": "centred", "make": lambda rod_length, stroke: 0.5 * stroke / rod_length},
    ),
    "speed": (
        {"when": "given_speed"},
        {"when": "speed_of_largest", "make": lambda speed_found: speed_found},
        {"when": "speed_of_smallest", "make": lambda speed_found: speed_found},
    ),
    "load": ({"when": "given_load"},),
    "recorded_cycle": ({"when": "over_cycles"},),
    # The value 0 is a formula's, because archives would list a value of `unless_given` also where
    # another load law holds.
    "load_linear": ({"make": lambda: 0.0},),
    "load_square": ({"make": lambda: 0.0},),
    "rod_inertia": ({"make": lambda two_mass_rod_inertia: two_mass_rod_inertia},),
    "crank_mass": (
        {"when": "throw_given", "make": lambda throw_mass, throw_radius, double_radius: (
            masses.crank_mass_at_pin(throw_mass, throw_radius, 0.5 * double_radius)
        )},
        {"when": "crank_mass_given"},
    ),
}  # fmt: skip
"""Functions that compute parameters that are not given, with their conditions; others are given."""

PARAMETERS: tuple[Node, ...] = tuple(
    given(name, **more) for name in parameters.PARAMETERS for more in _VARIANTS.get(name, ({},))
)

CYCLE_KEYS = (
    "compression_ratio", "intake_pressure", "heat", "combustion_start", "combustion_duration",
)  # fmt: skip
"""Parameters of a modelled cycle that a scene may replace in the engine's diagrams."""

INERTIA_PARTS = ("auxiliary_inertia", "flywheel_inertia", "load_inertia")
"""Parts of an inertia: if any of them is given, it is that of the running gear and these parts."""

STROKE_SHARES = (
    "friction_boundary", "friction_mixed", "friction_hydrodynamic", "friction_skirt",
)  # fmt: skip
"""Parameters that spread the friction over the stroke."""

CHEN_FLYNN_KEYS = (
    "friction_constant", "friction_peak_pressure", "friction_mean_piston_speed",
    "friction_mean_piston_speed_square",
)  # fmt: skip
"""Constants of the friction mean effective pressure a + b p_max + c c_m + d c_m^2."""

SOLVER_COLUMNS = ("passes", "start_speed", "start_angle")
"""Parameters of the methods that repeat cycles, given in [solver] or as columns of [designs]."""
