"""An engine as plain data, in the units of files, as a catalogue or a person gives it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from engine_dyn.geometry.cylinders import Cylinders
from engine_dyn.loads.torque_curves import TorqueOverAngle
from engine_dyn.pressure.cycle_table import ModelledDiagram
from engine_dyn.pressure.diagram import Diagram
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
    # Largest over smallest volume of a cylinder [1], from the engine's geometry, else from its
    # diagrams; None where the diagrams do not state the ratio, or have different ones.
    compression_ratio: float | None = None
    # Factor on the pressure of the diagrams over the speed: speeds [rpm] and the factor at each.
    pressure_scale: tuple[Floats, Floats] | None = None
    # For each diagram of the family, the first-law cycle that models it; None for a measured
    # diagram.
    cycles: tuple[ModelledDiagram, ...] | None = None
    # Numbers of the cylinders in the order in which they fire, where that is known.
    firing_order: tuple[int, ...] | None = None
    # Cylinders with their arrangement and their factors on pressure, mass and crank radius, where
    # the engine's file gives these.
    own_cylinders: Cylinders | None = None
    # Torque over the crank angle that is given in place of indicator diagrams, with its mean.
    torque: TorqueOverAngle | None = None
    # Its parts on the throws along the shaft, where it is the sum of that of each cylinder.
    throw_torques: tuple[TorqueOverAngle, ...] = ()
    # Parts with a structure, such as a shaft, by the name of their feature;
    # `engine_dyn.quantities.features` lists the features.
    parts: Mapping[str, Any] = field(default_factory=dict)
    # By parameter, the reason for each value that is assumed because no source gives one.
    assumed: Mapping[str, str] = field(default_factory=dict)
    sources: tuple[str, ...] = ()  # Citations of the sources of the engine's data
    # Names of plausibility checks that do not warn of this engine, which leaves their ranges on
    # purpose.
    silenced_warnings: tuple[str, ...] = ()
    # Range or distribution of uncertain values, by parameter, as the engine's file has them.
    uncertainty: Mapping[str, Any] = field(default_factory=dict)
    # Lowest and highest speed [rpm] for which each diagram holds, in the order of the diagrams'
    # loads; None where unknown.
    diagram_speeds: tuple[tuple[float, float] | None, ...] = ()
    # Warnings about the diagrams by the checks of the recordings that they were made from.
    diagram_warnings: tuple[str, ...] = ()

    @property
    def diagrams(self) -> tuple[Diagram, ...]:
        """All diagrams; those of single cylinders come last."""
        own = self.family.of_cylinders if isinstance(self.family, Family) else {}
        return (*self.family.diagrams, *(d for one in own.values() for d in one.diagrams))

    @property
    def shaft(self) -> Shaft | None:
        """Discs and shafts that twist, where the engine has them; their numbers are values."""
        return self.parts.get("shaft")
