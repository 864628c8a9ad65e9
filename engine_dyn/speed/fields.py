"""The inputs of the solvers: the one table of their names, units and defaults."""

from __future__ import annotations

import math
from typing import NamedTuple

from engine_dyn.loads import laws

__all__ = [
    "DEFAULTS", "FIELDS", "FRICTION_NAMES", "NAMES_OF_QUANTITIES", "OF_SPEED_ALONE",
    "TABLE_QUANTITIES", "Field",
]  # fmt: skip


class Field(NamedTuple):
    """One input of the solvers, a keyword of `engine_dyn.speed.dispatch.solve`.

    Without a `default` it must be given. `quantity` is the name of the parameter or quantity in
    `engine_dyn.quantities`: `name`, unless it is another.
    """

    name: str
    unit: str
    meaning: str
    default: float | None = None
    quantity: str = ""


_OF_FRICTION = (
    Field("boundary_friction", "Pa", "level of the boundary friction of the rings", 0.0),
    Field("mixed_friction", "Pa", "level of the mixed friction of the rings", 0.0),
    Field("hydrodynamic_friction", "Pa", "level of the hydrodynamic friction of the rings", 0.0),
    Field("skirt_friction", "Pa", "level of the friction of the skirt", 0.0),
    Field("ring_pressure", "Pa", "contact pressure of the rings without gas", 0.0),
)
_OF_TABLES = (
    Field("crank_ratio", "1", "crank radius over rod length"),
    Field("row", "1", "place of the diagram in the family's table"),
    Field("scale", "1", "factor on the pressure", quantity="pressure_scale"),
    Field("crankcase_pressure", "Pa", "absolute pressure below the piston"),
    Field("offset_ratio", "1", "offset of the piston-pin line over the crank radius", 0.0),
    *_OF_FRICTION,
)
_OF_TORQUE = (
    Field("bore", "m", "diameter of the cylinder"),
    Field("double_radius", "m", "two crank radii: the stroke where the pin has no offset"),
    Field("mass", "kg", "reciprocating mass of a cylinder", quantity="reciprocating_mass"),
    Field("speed", "rad/s", "nominal crank speed"),
    Field("friction_torque", "N m", "mean friction torque, positive"),
    Field("load_phase", "rad", "angle of the load at firing dead centre", 0.0),
    Field("load_scale", "1", "factor on a load over angle", 1.0, "load_table_factor"),
    Field("torque_factor", "1", "factor on a torque given for the engine", 1.0),
    *(Field(*one) for one in laws.INPUTS),
)
_OF_SPEED_ALONE = (
    Field("inertia", "kg m2", "moment of inertia of the whole engine"),
    Field("exponent", "1", "exponent alpha of the load", quantity="load_exponent"),
    Field(
        "offset", "N m", "load torque a that does not depend on the speed", quantity="load_offset"
    ),
    Field("mean_torque", "N m", "mean torque over the cycle", quantity="torque_mean"),
    Field("start_speed", "rad/s", "speed at which repeated cycles start; 0: nominal", 0.0),
    Field("passes", "1", "cycles to repeat; 0: until the cycle closes", 0.0),
    Field("start_angle", "rad", "angle at which repeated cycles start", -math.pi),
)

FIELDS = tuple(
    field._replace(quantity=field.quantity or field.name)
    for field in (*_OF_TABLES, *_OF_TORQUE, *_OF_SPEED_ALONE)
)
"""All inputs."""

TABLE_NAMES = tuple(field.name for field in _OF_TABLES)
TABLE_QUANTITIES = tuple(field.quantity for field in FIELDS[: len(_OF_TABLES)])
"""Inputs that the work tables depend on, here and in the graph of quantities."""

DEFAULTS = {field.name: field.default for field in FIELDS if field.default is not None}
"""Values of inputs that need not be given."""

OF_SPEED_ALONE = tuple(field.name for field in _OF_SPEED_ALONE)
"""Inputs that the torque at nominal speed does not depend on."""

FRICTION_NAMES = tuple(field.name for field in _OF_FRICTION)
"""Inputs that spread the friction over the stroke."""

NAMES_OF_QUANTITIES = {field.quantity: field.name for field in FIELDS}
"""Input of the solvers for each node of the graph of quantities that they take."""
