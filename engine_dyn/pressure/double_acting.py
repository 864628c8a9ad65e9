"""A double-acting compressor cylinder: gas on both sides of the piston, a rod through one of them.

The piston of area A and its rod of area a A feel the force p_h A - p_c (1 - a) A - p_0 a A, with
p_h the pressure of the head end, p_c that of the crank end and p_0 that outside, on the rod. A
single-acting cylinder of the pressure

    p = p_h - (1 - a) (p_c - p_0)

has the same force (p - p_0) A. This *effective* pressure is what all torques and forces are made
from; it is the pressure of no gas and may be negative.

The crank end's volume is not the head end's half a turn later: it follows 2 - x(phi), and the rod
is finite. Both ends have the same lines, losses, exponents and valves.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from engine_dyn.geometry.arrangement import TWO_STROKE
from engine_dyn.given_numbers import given_array, given_number
from engine_dyn.pressure import compressor
from engine_dyn.pressure.compressor import CompressorCycle, refusals, tabulate
from engine_dyn.pressure.diagram import Diagram, largest_of_blends, never_burns
from engine_dyn.pressure.family import Family
from engine_dyn.pressure.family_grid import FamilyGrid
from engine_dyn.pressure.file_fields import FileField, documented

FILE_FIELDS: dict[str, FileField] = {
    **compressor.FILE_FIELDS,
    "crank_end_clearance_ratio": FileField("1", 0.0, 0.5),
    "piston_rod_diameter": FileField("m", 0.0, 3.0),
}
"""Fields of the cycle in engine files; `bore` and `crankcase_pressure` are the engine's."""

OF_EFFECTIVE_PRESSURE = ("bore", "crankcase_pressure")
"""Engine parameters that enter the effective pressure, and that no design may change."""


@dataclass(frozen=True, eq=False, kw_only=True)
class DoubleActingDiagram(Diagram):
    """Effective pressure of a double-acting cylinder, with the pressures that it is made of."""

    # Absolute pressure on both sides of the piston; angle 0 is top dead centre for both.
    head_end: Diagram
    crank_end: Diagram
    rod_share: float  # Area of the piston rod over that of the piston [1]

    @property
    def peak_of_ends(self) -> float:
        """Largest tabulated pressure of both ends [Pa]."""
        return max(self.head_end.peak, self.crank_end.peak)

    @property
    def largest(self) -> float:
        """Largest pressure of both ends [Pa], between the knots too."""
        each = (largest_of_blends(end, end, np.zeros(1)) for end in (self.head_end, self.crank_end))
        return max(float(one[0]) for one in each)


def ends_of(family: Family | FamilyGrid) -> DoubleActingDiagram | None:
    """Ends of the double-acting cylinders of an engine with these diagrams; None for others."""
    one = next(iter(family.diagrams), None)
    return one if isinstance(one, DoubleActingDiagram) else None


@documented("double_acting_compressor", FILE_FIELDS)
@dataclass(frozen=True, kw_only=True)
class DoubleActingCycle(CompressorCycle):
    """Parameters of a double-acting compressor, in SI units; those of `CompressorCycle` and more.

    `points` and `volume` are those of the head end, away from the crank.

    Examples
    --------
    >>> from engine_dyn.pressure.double_acting import DoubleActingCycle
    >>> cycle = DoubleActingCycle(
    ...     clearance_ratio=0.12, crank_end_clearance_ratio=0.15, crank_ratio=0.2, bore=0.3,
    ...     piston_rod_diameter=0.06, suction_pressure=5e5, delivery_pressure=15e5,
    ...     suction_loss=0.1e5, delivery_loss=0.2e5, compression_exponent=1.3,
    ...     expansion_exponent=1.25, valve_ramp=0.14, valve_lag=0.035, crankcase_pressure=1e5,
    ... )
    >>> round(cycle.diagram().rod_share, 3)
    0.04
    """

    # Clearance volume of the crank end over the volume that the piston sweeps there [1].
    crank_end_clearance_ratio: float
    # Diameters of the piston rod and of the piston [m].
    piston_rod_diameter: float
    bore: float
    crankcase_pressure: float  # Absolute pressure outside, acting on the rod's area [Pa]

    def __post_init__(self) -> None:
        """Refuse values that are no cycle; ValueError names field, value and what is allowed."""
        super().__post_init__()
        for name in ("bore", "piston_rod_diameter", "crank_end_clearance_ratio"):
            value = given_number(name, getattr(self, name))
            if not (math.isfinite(value) and value > 0.0):
                raise ValueError(f"{name} = {value:.6g}: must be a finite number above 0")
        if not 0.0 <= given_number("crankcase_pressure", self.crankcase_pressure) < math.inf:
            raise ValueError("crankcase_pressure: must be a finite number of 0 or more")
        if self.piston_rod_diameter >= self.bore:
            raise ValueError(
                f"piston_rod_diameter = {self.piston_rod_diameter:.6g} m: must be below the bore, "
                f"{self.bore:.6g} m"
            )
        if self.crank_end_clearance_ratio >= 0.5:
            raise ValueError(
                f"crank_end_clearance_ratio = {self.crank_end_clearance_ratio:.6g}: must be below "
                "0.5"
            )
        columns = {name: given_array(name, value) for name, value in self._of_crank_end().items()}
        for bad, message in refusals(columns, crank_end=True):
            if bad.any():
                raise ValueError(f"{message}, at the crank end")

    def _of_crank_end(self) -> dict[str, float]:
        return {**self._values(), "clearance_ratio": self.crank_end_clearance_ratio}

    def diagram(self, step_degrees: float = 0.5) -> DoubleActingDiagram:
        """Effective pressure, and the diagrams of both ends, with exact slopes at their points.

        Raises
        ------
        ValueError
            If the step does not divide half a turn or is over 10 degrees.
        """
        head = super().diagram(step_degrees)
        half, odd = divmod(head.angle.size, 2)
        if odd:
            raise ValueError(f"step = {step_degrees:g} degree: 180 must be a multiple of it")
        table = tabulate(self._of_crank_end(), step_degrees, crank_end=True)
        pressure, slope = np.roll(table.pressure, half), np.roll(table.slope, half)
        crank = Diagram(head.angle, pressure, slope, TWO_STROKE)
        share = (self.piston_rod_diameter / self.bore) ** 2
        return DoubleActingDiagram(
            head.angle,
            head.pressure - (1.0 - share) * (crank.pressure - self.crankcase_pressure),
            head.slope - (1.0 - share) * crank.slope,
            TWO_STROKE,
            never_burns,
            head_end=head,
            crank_end=crank,
            rod_share=share,
        )
