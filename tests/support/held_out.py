"""Held-out designs (oracle) through the packages: their pressure as points, their numbers."""

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np

from engine_dyn import PeriodicSpeed, diagram_from_points, periodic_speed
from engine_dyn.loads.friction import FrictionShape
from engine_dyn.pressure.diagram import Diagram
from engine_dyn.pressure.family import Family, family_from_diagrams
from engine_dyn.speed.torque import mean_gas_torque
from oracle.designs import HeldOut, held_out, table
from oracle.solution import Design

BAR = 1e5


@cache
def items() -> dict[str, HeldOut]:
    return {item.name: item for item in held_out()}


def design_of(name: str) -> Design:
    return items()[name].design


def diagram_of(design: Design, step_degree: float = 0.5) -> Diagram:
    """The pressure curve as a file would give it."""
    degrees, bar = table(design.pressure, step_degree)
    made = diagram_from_points(np.radians(degrees), bar * BAR)
    if design.motored is None:
        return made
    _, bar = table(design.motored, step_degree)
    without = diagram_from_points(np.radians(degrees), bar * BAR)
    return replace(made, motored=lambda: without)


def family_of(design: Design, step_degree: float = 0.5) -> Family:
    return family_from_diagrams([0.0], [diagram_of(design, step_degree)])


KEYWORDS = (
    "bore", "stroke", "crank_ratio", "reciprocating_mass", "inertia", "speed", "cylinders",
    "load_exponent", "load_offset", "friction_torque", "crankcase_pressure", "inertia_model",
    "closure", "offset", "firing_angles", "pressure_factor", "mass_factor", "radius_factor",
)  # fmt: skip
NAMES = {
    "speed": "omega_n", "pressure_factor": "pressure_factors", "mass_factor": "mass_factors",
    "radius_factor": "radius_factors",
}  # fmt: skip
"""Of the oracle's design, where they are others."""


def solved(design: Design, step_degree: float = 0.5, **changes: Any) -> PeriodicSpeed:
    """One design through `periodic_speed`; `changes` are its keywords."""
    values: dict[str, Any] = {name: getattr(design, NAMES.get(name, name)) for name in KEYWORDS}
    if design.friction_shares is not None:
        values["friction_shape"] = FrictionShape(*design.friction_shares, design.ring_pressure)
    return periodic_speed(diagram_of(design, step_degree), **{**values, **changes})


def inputs_of(design: Design, family: Family) -> dict[str, Any]:
    """Keywords of `sweep.solve`, all scalar; arrays may replace any of them."""
    mean_gas = float(mean_gas_torque(design.crank_ratio, 0.0, family))
    lever = 0.25 * np.pi * design.bore**2 * 0.5 * design.stroke
    return {
        "family": family, "crank_ratio": design.crank_ratio, "row": 0.0, "scale": 1.0,
        "crankcase_pressure": design.crankcase_pressure, "bore": design.bore,
        "double_radius": design.stroke, "mass": design.reciprocating_mass,
        "speed": design.omega_n, "inertia": design.inertia, "exponent": design.load_exponent,
        "offset": design.load_offset, "friction_torque": design.friction_torque,
        "mean_torque": design.cylinders * lever * mean_gas - design.friction_torque,
        "cylinders": design.cylinders, "inertia_model": design.inertia_model,
        "closure": design.closure,
    }  # fmt: skip


def torque_inputs_of(design: Design, family: Family) -> dict[str, Any]:
    """The same without what only the speed depends on."""
    own = {"inertia", "exponent", "offset", "mean_torque", "inertia_model", "closure"}
    return {name: value for name, value in inputs_of(design, family).items() if name not in own}
