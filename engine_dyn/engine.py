"""An engine as plain data, in the units of files, as a catalogue or a person gives it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from engine_dyn.geometry.cylinders import Cylinders
from engine_dyn.loads.driven_machine import TorqueOverAngle
from engine_dyn.pressure.cycle_table import ModelledDiagram
from engine_dyn.pressure.family import Family
from engine_dyn.pressure.family_grid import FamilyGrid
from engine_dyn.torsion.shaft import Shaft
from engine_dyn.types import Floats


@dataclass(frozen=True, eq=False)
class Engine:
    """One engine: values of parameters, its indicator diagrams and where both come from."""

    # Short name of the engine in the catalogue, and one line that describes it.
    name: str
    title: str
    period: float  # Crank angle of one cycle [rad], 4 pi for a four-stroke engine
    # Value of each parameter that the engine gives, in the parameter's file unit.
    values: Mapping[str, float]
    # Indicator diagrams over load, or over load and speed; without a diagram, an engine still has
    # its balance and moments of inertia.
    family: Family | FamilyGrid
    # Largest over smallest volume of a cylinder [1]: the geometric one if it is given, else that of
    # the diagrams; None where the diagrams do not state it, or differ in it.
    compression_ratio: float | None = None
    # Speeds [rpm] and the factor on the diagram's pressure at each of them; linear in between.
    pressure_scale: tuple[Floats, Floats] | None = None
    # For each diagram of the family, the first-law cycle that models it; None for a measured
    # diagram.
    cycles: tuple[ModelledDiagram, ...] | None = None
    # Numbers of the cylinders in the order in which they fire, where that is known.
    firing_order: tuple[int, ...] | None = None
    # Arrangement of the cylinders and their factors, where the engine's file gives them.
    own_cylinders: Cylinders | None = None
    # Torque over the crank angle that is given in place of indicator diagrams, with its mean.
    torque: TorqueOverAngle | None = None
    # Structured parts by the names of their features, which `engine_dyn.quantities.features` lists;
    # `of` of a feature returns its part.
    parts: Mapping[str, Any] = field(default_factory=dict)
    # Why each value was assumed that the engine's sources do not give, by parameter.
    assumed: Mapping[str, str] = field(default_factory=dict)
    sources: tuple[str, ...] = ()  # Citations of the sources of the engine's data
    # Names of plausibility checks whose ranges this engine is meant to leave.
    silenced_warnings: tuple[str, ...] = ()
    # Range or distribution of uncertain values, by parameter, as the engine's file has them.
    uncertainty: Mapping[str, Any] = field(default_factory=dict)
    # Lowest and highest speed [rpm] for which each diagram holds, by load; None where unknown.
    diagram_speeds: tuple[tuple[float, float] | None, ...] = ()
    # Warnings about the diagrams by the checks of the recordings that they were made from.
    diagram_warnings: tuple[str, ...] = ()

    @property
    def shaft(self) -> Shaft | None:
        """Discs and shafts that twist, where the engine has them; their numbers are values."""
        return self.parts.get("shaft")
