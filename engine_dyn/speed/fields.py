"""The inputs of the kernels: the one table of their names, units, defaults and places.

A kernel finds the values of a design by the places that are named here. Work tables depend on the
inputs that are marked `of_tables`; these come first, so that a kernel can look at them alone.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from engine_dyn.loads import laws

__all__ = [
    "BORE",
    "BOUNDARY_FRICTION",
    "CRANKCASE_PRESSURE",
    "CRANK_RATIO",
    "DEFAULTS",
    "DOUBLE_RADIUS",
    "EXPONENT",
    "FIELDS",
    "FIRST_OF_LAWS",
    "FRICTION_NAMES",
    "FRICTION_TORQUE",
    "GEAR_RATIO",
    "HYDRODYNAMIC_FRICTION",
    "INERTIA",
    "INPUTS",
    "LOAD_PHASE",
    "LOAD_SCALE",
    "LOAD_SQUARE",
    "MASS",
    "MEAN_TORQUE",
    "MIXED_FRICTION",
    "INPUT_NAMES",
    "NAMES_OF_QUANTITIES",
    "OFFSET",
    "OFFSET_RATIO",
    "OF_SPEED_ALONE",
    "OUTPUT",
    "PASSES",
    "RING_PRESSURE",
    "ROW",
    "SCALE",
    "SKIRT_FRICTION",
    "SPEED",
    "START_ANGLE",
    "START_SPEED",
    "TABLE_INPUTS",
    "TABLE_NAMES",
    "TABLE_QUANTITIES",
    "Field",
]


class Field(NamedTuple):
    """One input of the kernels.

    Attributes
    ----------
    name : str
        Keyword of `engine_dyn.speed.dispatch.solve`.
    unit : str
        SI unit.
    meaning : str
        One line.
    default : float or None
        Value where none is given; None where one must be given.
    quantity : str
        Name of the parameter or quantity in `engine_dyn.quantities`.
    of_tables : bool
        Whether the work tables depend on it.
    of_speed_alone : bool
        Whether it matters for the periodic speed only, and not for the torque at nominal speed.
    """

    name: str
    unit: str
    meaning: str
    default: float | None
    quantity: str
    of_tables: bool
    of_speed_alone: bool


_FIELDS: list[Field] = []


def _field(
    name: str, unit: str, meaning: str, default: float | None = None, *, quantity: str = "",
    of_tables: bool = False, of_speed_alone: bool = False,
) -> int:  # fmt: skip
    """Add a row to the table and return its place."""
    _FIELDS.append(Field(name, unit, meaning, default, quantity or name, of_tables, of_speed_alone))
    return len(_FIELDS) - 1


CRANK_RATIO = _field("crank_ratio", "1", "crank radius over rod length", of_tables=True)
ROW = _field("row", "1", "place of the diagram in the family's table", of_tables=True)
SCALE = _field(
    "scale", "1", "factor on the pressure", quantity="pressure_scale", of_tables=True
)  # fmt: skip
CRANKCASE_PRESSURE = _field(
    "crankcase_pressure", "Pa", "absolute pressure below the piston", of_tables=True
)
OFFSET_RATIO = _field(
    "offset_ratio", "1", "offset of the piston-pin line over the crank radius", 0.0, of_tables=True
)
BOUNDARY_FRICTION = _field(
    "boundary_friction", "Pa", "level of the boundary friction of the rings", 0.0, of_tables=True
)
MIXED_FRICTION = _field(
    "mixed_friction", "Pa", "level of the mixed friction of the rings", 0.0, of_tables=True
)
HYDRODYNAMIC_FRICTION = _field(
    "hydrodynamic_friction", "Pa", "level of the hydrodynamic friction of the rings", 0.0,
    of_tables=True,
)  # fmt: skip
SKIRT_FRICTION = _field(
    "skirt_friction", "Pa", "level of the friction of the skirt", 0.0, of_tables=True
)
RING_PRESSURE = _field(
    "ring_pressure", "Pa", "contact pressure of the rings without gas", 0.0, of_tables=True
)
# Those from here to LOAD_SQUARE are, in this order, the first rows of the batch solver's memory; a
# test compares both.
BORE = _field("bore", "m", "diameter of the cylinder")
DOUBLE_RADIUS = _field(
    "double_radius", "m", "two crank radii: the stroke where the pin has no offset"
)
MASS = _field("mass", "kg", "reciprocating mass of a cylinder", quantity="reciprocating_mass")
SPEED = _field("speed", "rad/s", "nominal crank speed")
INERTIA = _field("inertia", "kg m2", "moment of inertia of the whole engine", of_speed_alone=True)
EXPONENT = _field(
    "exponent", "1", "exponent alpha of the load", quantity="load_exponent", of_speed_alone=True
)
OFFSET = _field(
    "offset", "N m", "load torque a that does not depend on the speed", quantity="load_offset",
    of_speed_alone=True,
)  # fmt: skip
MEAN_TORQUE = _field(
    "mean_torque", "N m", "mean torque over the cycle", quantity="torque_mean", of_speed_alone=True
)
FIRST_OF_LAWS = len(_FIELDS)
"""From here on are those of laws over speed, `engine_dyn.loads.laws.INPUTS`."""

for _input in laws.INPUTS:
    _field(_input.name, _input.unit, _input.meaning, _input.default, quantity=_input.quantity)

LOAD_SQUARE = FIRST_OF_LAWS + laws.LOAD_SQUARE
GEAR_RATIO = FIRST_OF_LAWS + laws.GEAR_RATIO
FRICTION_TORQUE = _field("friction_torque", "N m", "mean friction torque, positive")
START_SPEED = _field(
    "start_speed", "rad/s", "speed at which repeated cycles start; 0: nominal", 0.0,
    of_speed_alone=True,
)  # fmt: skip
PASSES = _field(
    "passes", "1", "cycles to repeat; 0: until the cycle closes", 0.0, of_speed_alone=True
)
START_ANGLE = _field(
    "start_angle", "rad", "angle at which repeated cycles start", -math.pi, of_speed_alone=True
)
LOAD_PHASE = _field("load_phase", "rad", "angle of the load at firing dead centre", 0.0)
LOAD_SCALE = _field(
    "load_scale", "1", "factor on a load over angle", 1.0, quantity="load_table_factor"
)
FIELDS = tuple(_FIELDS)
"""All inputs, in the order of their places."""

OUTPUT = len(FIELDS)
"""Place of the results: kernels find where to write in the same way as their inputs."""

INPUTS = OUTPUT + 1
"""Number of places."""

INPUT_NAMES = tuple(field.name for field in FIELDS)

TABLE_NAMES = tuple(field.name for field in FIELDS if field.of_tables)
"""Inputs that the work tables depend on."""

TABLE_QUANTITIES = tuple(field.quantity for field in FIELDS if field.of_tables)
"""The same, under the names of the graph of quantities."""

TABLE_INPUTS = len(TABLE_NAMES)

DEFAULTS = {field.name: field.default for field in FIELDS if field.default is not None}
"""Values of inputs that need not be given."""

OF_SPEED_ALONE = tuple(field.name for field in FIELDS if field.of_speed_alone)
"""Inputs that the torque at nominal speed does not depend on."""

FRICTION_NAMES = (
    "boundary_friction", "mixed_friction", "hydrodynamic_friction", "skirt_friction",
    "ring_pressure",
)  # fmt: skip
"""Inputs that spread the friction over the stroke."""

NAMES_OF_QUANTITIES = {field.quantity: field.name for field in FIELDS}
"""Input of the kernels for each node of the graph of quantities that they take."""

if INPUT_NAMES[:TABLE_INPUTS] != TABLE_NAMES:
    raise AssertionError("inputs that tables depend on must come first")
