"""A modelled reciprocating pump: the diagram of a liquid that is not compressed, two levels a turn.

The cylinder has the pressure of the suction line from top to bottom dead centre and that of the
delivery line back to the top, less and more what is lost in the open valve. From a dead centre on,
over an angle in which the valves change and the liquid gives way, the pressure goes from one level
to the other, with two continuous derivatives, so that a cubic spline through points at 0.5 degree
follows it.

Sources
-------
Derived here: without losses and with valves that change at once, the work of a turn is the
difference of the levels times the swept volume.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import ArrayLike

from engine_dyn.geometry import slider_crank
from engine_dyn.geometry.arrangement import TWO_STROKE
from engine_dyn.given_numbers import given_number
from engine_dyn.pressure.diagram import Diagram, never_burns, table_angles
from engine_dyn.pressure.file_fields import FileField, documented, file_units
from engine_dyn.types import Floats
from engine_dyn.units import BAR

FILE_FIELDS: dict[str, FileField] = {
    "crank_ratio": FileField("1", 0.0, 1.0),
    "suction_pressure": FileField("bar", 0.0, 200.0),
    "delivery_pressure": FileField("bar", 0.0, 4000.0),
    "suction_loss": FileField("bar", 0.0, 50.0, ends=True),
    "delivery_loss": FileField("bar", 0.0, 50.0, ends=True),
    "valve_ramp": FileField("degree", 3.0, 90.0),
    "offset_ratio": FileField("1", -10.0, 10.0),
}
"""Fields of the cycle in engine files."""

FILE_UNITS = file_units(FILE_FIELDS)
"""Unit in which a file of a driven machine gives each field, and its size in SI."""


@documented("pump", FILE_FIELDS)
@dataclass(frozen=True, kw_only=True)
class PumpCycle:
    """Parameters of the pump's cycle, in SI units and radians; 0 is top dead centre.

    With w going from 1 to 0 in `valve_ramp` after top dead centre and back after the bottom one,

        p = w (p_d + c_d v^2) + (1 - w) (p_s - c_s v^2),

    v being the piston's velocity over the crank pin's.
    """

    crank_ratio: float  # Crank radius over rod length [1]
    # Pressure of the lines at the valves, absolute [Pa].
    suction_pressure: float
    delivery_pressure: float
    valve_ramp: float  # Angle over which the pressure changes after a dead centre [rad]
    # Difference of pressure across the open valve while the piston is as fast as the crank pin
    # [Pa]; none by default.
    suction_loss: float = 0.0
    delivery_loss: float = 0.0
    # Offset of the piston pin's line over the crank radius [1]; 0 by default.
    offset_ratio: float = 0.0

    def __post_init__(self) -> None:
        """Refuse values that are no cycle; ValueError names field, value and what is allowed."""
        for item in fields(self):
            field = FILE_FIELDS[item.name]
            low, high = field.low, field.high
            value = given_number(item.name, getattr(self, item.name)) / field.size
            if not math.isfinite(value):
                raise ValueError(f"{item.name} = {value}: must be a finite number")
            if not (low <= value <= high if field.ends else low < value < high):
                raise ValueError(f"{item.name} = {value:.6g}{field.words}: must be {field.allowed}")
        if self.delivery_pressure <= self.suction_pressure:
            raise ValueError(
                f"delivery_pressure = {self.delivery_pressure / BAR:.6g} bar: must be above "
                f"suction_pressure, {self.suction_pressure / BAR:.6g} bar"
            )
        if self.suction_loss > 0.5 * self.suction_pressure:
            raise ValueError(
                f"suction_loss = {self.suction_loss / BAR:.6g} bar: must be at most half of "
                "suction_pressure"
            )
        slider_crank.position(0.0, self.crank_ratio, self.offset_ratio)  # refuses what is stuck

    def pressure_and_slope(self, phi: ArrayLike) -> tuple[Floats, Floats]:
        """Absolute pressure [Pa] and its derivative [Pa/rad] at crank angles [rad]."""
        angle = np.mod(np.asarray(phi, dtype=np.float64), TWO_STROKE)
        geometry = self.crank_ratio, self.offset_ratio
        bottom = float(slider_crank.dead_centres(*geometry).bottom)
        v = slider_crank.velocity(angle, *geometry)
        b = slider_crank.acceleration(angle, *geometry)
        delivering = angle >= bottom
        time = np.clip(np.where(delivering, angle - bottom, angle) / self.valve_ramp, 0.0, 1.0)
        step = time**3 * (10.0 + time * (6.0 * time - 15.0))
        rate = 30.0 * (time * (1.0 - time)) ** 2 / self.valve_ramp
        share = np.where(delivering, step, 1.0 - step)
        above = self.delivery_pressure + self.delivery_loss * v**2
        below = self.suction_pressure - self.suction_loss * v**2
        losses = share * self.delivery_loss - (1.0 - share) * self.suction_loss
        slope = np.where(delivering, rate, -rate) * (above - below) + 2.0 * losses * v * b
        return np.asarray(share * above + (1.0 - share) * below), np.asarray(slope)

    def diagram(self, step_degrees: float = 0.5) -> Diagram:
        """Indicator diagram with the exact slopes at its points.

        Its largest pressure lies before dead centre, where `diagram_from_points` would take it for
        a mistake.

        Raises
        ------
        ValueError
            If the step does not divide the turn or is over 10 degrees.
        """
        angle = table_angles(TWO_STROKE, step_degrees)
        return Diagram(angle, *self.pressure_and_slope(angle), TWO_STROKE, never_burns)
