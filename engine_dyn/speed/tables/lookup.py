"""The diagram of a design's table, and the ranges of a table that solvers need."""

from __future__ import annotations

import math
from typing import NamedTuple

from engine_dyn.compilation import inlined
from engine_dyn.loads.friction import StrokeFriction
from engine_dyn.speed.fields import (
    BOUNDARY_FRICTION,
    CRANKCASE_PRESSURE,
    HYDRODYNAMIC_FRICTION,
    MIXED_FRICTION,
    RING_PRESSURE,
    ROW,
    SCALE,
    SKIRT_FRICTION,
)
from engine_dyn.speed.tables import work_tables
from engine_dyn.speed.tables.work_tables import SHAPE, SQUARE, TORQUE, Blend
from engine_dyn.types import Floats, Integers

__all__ = ["Ranges", "blend_of", "ranges_of"]


@inlined
def blend_of(values: Floats, at: Integers, row_of: Integers) -> Blend:
    """Return the diagram of the design whose inputs lie at `at`."""
    row = values[at[ROW]]
    whole = int(math.floor(row))
    weight = row - whole
    first = row_of[whole]
    second = row_of[whole + 1] if weight > 0.0 else first
    friction = StrokeFriction(
        values[at[BOUNDARY_FRICTION]], values[at[MIXED_FRICTION]],
        values[at[HYDRODYNAMIC_FRICTION]], values[at[SKIRT_FRICTION]], values[at[RING_PRESSURE]],
    )  # fmt: skip
    return Blend(first, second, weight, values[at[SCALE]], values[at[CRANKCASE_PRESSURE]], friction)


class Ranges(NamedTuple):
    """Ranges of the gas and the inertia torque of a table, and the least of its square velocity."""

    gas: float
    shape: float
    least_square: float


@inlined
def ranges_of(table: Floats) -> Ranges:
    """Ranges of a table."""
    low, high = work_tables.bounds_of(table[TORQUE])
    least, most = work_tables.bounds_of(table[SHAPE])
    return Ranges(high - low, most - least, work_tables.bounds_of(table[SQUARE])[0])
