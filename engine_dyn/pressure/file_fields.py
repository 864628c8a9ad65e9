"""Fields of modelled cycles as engine files give them: their unit there, and what is allowed.

Python takes SI units and radians, files take bar and degrees. Both stand in the documentation of a
class, so that nobody has to look for the other.
"""

from __future__ import annotations

import textwrap
from collections.abc import Callable, Mapping
from typing import NamedTuple, TypeVar

from engine_dyn.units import BAR, DEGREE, RPM

SIZES = {"1": 1.0, "bar": BAR, "degree": DEGREE, "K": 1.0, "K-1": 1.0, "m": 1.0, "rpm": RPM}
"""SI value of each unit in files."""

_LOSS = "pressure difference across the open {} valve when the piston is as fast as the crank pin"
_WIEBE = "combustion duration of the {}, 0 to 99.9 percent burnt with the usual wiebe_factor"

MEANINGS: Mapping[str, str] = {
    "compression_ratio": "largest over smallest cylinder volume",
    "clearance_ratio": "clearance volume over swept volume",
    "crank_end_clearance_ratio": "clearance volume of the crank end over the volume swept there",
    "piston_rod_diameter": "diameter of the piston rod, below the bore",
    "crank_ratio": "crank radius over rod length",
    "offset_ratio": "offset of the piston pin's line over the crank radius",
    "intake_pressure": "pressure of the intake manifold or scavenge air at the valves, absolute",
    "exhaust_pressure": "pressure of the exhaust manifold at the valves, absolute",
    "suction_pressure": "pressure of the suction line at the valves, absolute",
    "delivery_pressure": "pressure of the delivery line at the valves, absolute",
    "intake_loss": _LOSS.format("intake"),
    "exhaust_loss": _LOSS.format("exhaust"),
    "suction_loss": _LOSS.format("suction"),
    "delivery_loss": _LOSS.format("delivery"),
    "charge_temperature": "temperature of the charge at the closing of the cylinder",
    "heat": "heat of a cycle over the swept volume (1 bar = 0.1 J/cm3); 0 is a motored engine",
    "combustion_start": "start of the combustion",
    "combustion_duration": _WIEBE.format("fuel"),
    "combustion_form": "form exponent of its Wiebe function",
    "premixed_share": "share of the heat released by premixed combustion",
    "premixed_start": "start of the premixed combustion",
    "premixed_duration": _WIEBE.format("premixed part"),
    "premixed_form": "form exponent of its Wiebe function",
    "diffusion_start": "start of the diffusion combustion",
    "diffusion_duration": _WIEBE.format("diffusion part"),
    "diffusion_form": "form exponent of its Wiebe function",
    "wiebe_factor": "factor a in 1 - exp(-a t^(m+1)); ln 1000 if not given",
    "gamma_300": "ratio of specific heats at 300 K",
    "gamma_slope": "decrease of the ratio of specific heats per kelvin",
    "compression_exponent": "polytropic exponent of the compression",
    "expansion_exponent": "polytropic exponent of the expansion",
    "wall_temperature": "mean temperature of the walls",
    "wall_factor": "factor on Woschni's heat transfer coefficient",
    "bore": "bore",
    "stroke": "stroke",
    "speed": "speed of the crank",
    "intake_closing": "angle at which the intake has closed",
    "exhaust_opening": "angle at which the exhaust begins to open",
    "exhaust_closing": "angle at which the exhaust has closed; -exhaust_opening if not given",
    "scavenge_opening": "angle at which the scavenge ports begin to open",
    "valve_ramp": "angle over which a valve opens or closes",
    "valve_lag": "angle over which the pressure difference to the manifold falls to 1/e with the "
    "valve open",
}
"""Meaning of each field of modelled cycles, in words."""


class FileField(NamedTuple):
    """Unit of a field in files and its range there; `ends` says whether the range's ends belong."""

    unit: str
    low: float
    high: float
    ends: bool = False

    @property
    def size(self) -> float:
        """Size of the unit in SI."""
        return SIZES[self.unit]

    @property
    def words(self) -> str:
        """Unit as it follows a number: nothing for numbers without one."""
        return "" if self.unit == "1" else f" {self.unit}"

    @property
    def allowed(self) -> str:
        """Range in words, such as "above 1 and below 45 degree"."""
        low, high = f"{self.low:.6g}", f"{self.high:.6g}{self.words}"
        return f"between {low} and {high}" if self.ends else f"above {low} and below {high}"


def file_units(fields: Mapping[str, FileField]) -> dict[str, tuple[str, float]]:
    """Unit in which an engine file gives each field, and its size in SI."""
    return {name: (item.unit, item.size) for name, item in fields.items()}


Class = TypeVar("Class", bound=type)


def documented(kind: str, fields: Mapping[str, FileField]) -> Callable[[Class], Class]:
    """Add to the documentation of a class the units in which engine files give its fields.

    Parameters
    ----------
    kind : str
        Of the [[diagram]] tables that make this class.
    fields : mapping
        The fields of the class.
    """
    rows = []
    for name, item in fields.items():
        ends = "ends included" if item.ends else "ends excluded"
        rows.append(f"{name} [{item.unit}]: {item.low:.6g} to {item.high:.6g}, {ends}")
    lines = [
        "Notes",
        "-----",
        f'The units in an engine file, [[diagram]] with kind = "{kind}", differ from those in',
        "Python. Unit in the file, and range in that unit:",
        "",
        *rows,
    ]
    text = textwrap.indent("\n".join(lines), "    ")

    def add(cycle: Class) -> Class:
        if cycle.__doc__ is not None:  # `python -OO` removes docstrings
            cycle.__doc__ = f"{cycle.__doc__.rstrip()}\n\n{text}\n    "
        return cycle

    return add
