"""What columns are made of: diagrams, friction over the stroke, torques over angle, and masses."""

from __future__ import annotations

from typing import NamedTuple

from engine_dyn.types import Booleans, Integers

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
    """What columns are wanted of: rows of the family, friction over the stroke, torques over angle.

    `rows` ascend, friction has `FRICTION_PARTS` parts for each of `rubbed`, and `torques` over an
    angle are that of the load or of the engine, see `DrivenMachine.torques`, with a gear ratio and
    a phase [rad].
    """

    rows: Integers
    rubbed: tuple[RubbedDiagram, ...] = ()
    torques: tuple[tuple[int, float, float], ...] = ()

    @property
    def first_rubbed(self) -> int:
        """Place of the first part of friction."""
        return FIRST_GAS + self.rows.size

    @property
    def first_torque(self) -> int:
        """Place of the first torque over an angle."""
        return self.first_rubbed + FRICTION_PARTS * len(self.rubbed)

    def is_load(self, part: Integers) -> Booleans:
        """Whether places of parts are those of loads over angle."""
        loads = sum(which == 0 for which, _, _ in self.torques)
        return (part >= self.first_torque) & (part < self.first_torque + loads)

    @property
    def number(self) -> int:
        """Number of parts."""
        return self.first_torque + len(self.torques)
