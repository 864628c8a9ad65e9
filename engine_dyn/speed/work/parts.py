"""What columns are made of: diagrams, friction over the stroke, loads over angle, and masses."""

from __future__ import annotations

from typing import NamedTuple

from engine_dyn.types import Integers

__all__ = ["FIRST_GAS", "FRICTION_PARTS", "SQUARE", "UNIT", "Parts", "RubbedDiagram"]

UNIT, SQUARE, FIRST_GAS = 0, 1, 2
"""Places of the parts that all columns have, and of the first diagram: the work of a pressure of 1,
and the squared velocity."""

FRICTION_PARTS = 4
"""Boundary, mixed, hydrodynamic and skirt, see `engine_dyn.loads.friction`."""


class RubbedDiagram(NamedTuple):
    """What friction over the stroke depends on: the diagram between two rows, and pressures [Pa].

    `row` is a place in the table of the family, `scale` the factor on the pressure.
    """

    row: float
    scale: float
    crankcase: float
    ring: float


class Parts(NamedTuple):
    """What columns are wanted of: rows of the family, friction over the stroke, loads over angle.

    `rows` ascend, friction has `FRICTION_PARTS` parts for each of `rubbed`, and `loads` are gear
    ratios and phases [rad].
    """

    rows: Integers
    rubbed: tuple[RubbedDiagram, ...] = ()
    loads: tuple[tuple[float, float], ...] = ()

    @property
    def first_rubbed(self) -> int:
        """Place of the first part of friction."""
        return FIRST_GAS + self.rows.size

    @property
    def first_load(self) -> int:
        """Place of the first load over angle."""
        return self.first_rubbed + FRICTION_PARTS * len(self.rubbed)

    @property
    def number(self) -> int:
        """Number of parts."""
        return self.first_load + len(self.loads)
