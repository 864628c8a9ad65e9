"""The inputs of the solvers: the one table of their names and defaults.

Unit and meaning of each are those of its node: see `engine_dyn.parameters` and the subjects' files
of `engine_dyn.quantities`.
"""

from __future__ import annotations

import math

from engine_dyn.loads.laws import INPUTS, Field

FRICTION_NAMES = (
    "boundary_friction", "mixed_friction", "hydrodynamic_friction", "skirt_friction",
    "ring_pressure",
)  # fmt: skip
"""Inputs that spread the friction over the stroke: levels of its parts [Pa], pressure of rings."""

_OF_TABLES = (
    Field("crank_ratio"), Field("row"), Field("scale", quantity="pressure_scale"),
    Field("crankcase_pressure"), Field("offset_ratio", 0.0),
    *(Field(name, 0.0) for name in FRICTION_NAMES),
)  # fmt: skip
_OF_SPEED_ALONE = (
    Field("inertia"), Field("exponent", quantity="load_exponent"),
    Field("offset", quantity="load_offset"), Field("mean_torque", quantity="torque_mean"),
    Field("start_speed", 0.0),  # 0: that of the nominal speed
    Field("passes", 0.0),  # 0: until the cycle closes
    Field("start_angle", -math.pi),
)  # fmt: skip

FIELDS = tuple(
    field._replace(quantity=field.quantity or field.name)
    for field in (
        *_OF_TABLES, Field("bore"), Field("double_radius"),
        Field("mass", quantity="reciprocating_mass"), Field("speed"), Field("friction_torque"),
        Field("load_phase", 0.0), Field("load_scale", 1.0, "load_table_factor"),
        Field("torque_factor", 1.0), *INPUTS, *_OF_SPEED_ALONE,
    )
)  # fmt: skip
"""All inputs."""

TABLE_NAMES = tuple(field.name for field in _OF_TABLES)
TABLE_QUANTITIES = tuple(field.quantity for field in FIELDS[: len(_OF_TABLES)])
"""Inputs that the work tables depend on, here and in the graph of quantities."""

DEFAULTS = {field.name: field.default for field in FIELDS if field.default is not None}
"""Values of inputs that need not be given."""

OF_SPEED_ALONE = tuple(field.name for field in _OF_SPEED_ALONE)
"""Inputs that the torque at nominal speed does not depend on."""

NAMES_OF_QUANTITIES = {field.quantity: field.name for field in FIELDS}
"""Input of the solvers for each node of the graph of quantities that they take."""
