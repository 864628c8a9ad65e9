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

    # Short name of the catalogue and one line for people.
    name: str
    title: str
    period: float  # Angle of one cycle [rad], 4 pi for a four-stroke engine
    # Value of each parameter that the engine gives, in the parameter's file unit.
    values: Mapping[str, float]
    # Indicator diagrams over load, or over load and speed; without a diagram, an engine still has
    # its balance and moments of inertia.
    family: Family | FamilyGrid
    # Largest over smallest volume of a cylinder [1]: the geometric one if it is given, else that of
    # the diagrams; None where they do not say it, or differ in it.
    compression_ratio: float | None = None
    # Speed [rpm] and the factor on the diagram at that speed; linear in between.
    pressure_scale: tuple[Floats, Floats] | None = None
    # For each diagram of the family, in its order, the cycle by the first law that it is modelled
    # by; None where a diagram is not so modelled.
    cycles: tuple[ModelledDiagram, ...] | None = None
    # Cylinders in the order in which they fire, where it is known.
    firing_order: tuple[int, ...] | None = None
    # Arrangement of the engine's own number of cylinders and their factors, where given.
    own_cylinders: Cylinders | None = None
    # Torque over the crank angle that is given in place of diagrams, with its mean.
    torque: TorqueOverAngle | None = None
    # Structured parts by the names of their features, which `engine_dyn.quantities.features` lists;
    # `of` of a feature returns its part.
    parts: Mapping[str, Any] = field(default_factory=dict)
    # Reason for every value that the sources do not give.
    assumed: Mapping[str, str] = field(default_factory=dict)
    sources: tuple[str, ...] = ()  # Citations
    # Names of plausibility checks whose ranges this engine is meant to leave.
    silenced_warnings: tuple[str, ...] = ()
    # Range or distribution of values that are not well known, as its file has them.
    uncertainty: Mapping[str, Any] = field(default_factory=dict)
    # Lowest and highest speed [rpm] for which each diagram holds, by load; None where it is not
    # known.
    diagram_speeds: tuple[tuple[float, float] | None, ...] = ()
    # Warnings that checks of recordings gave of its diagrams, as their files tell.
    diagram_warnings: tuple[str, ...] = ()

    @property
    def shaft(self) -> Shaft | None:
        """Discs and shafts that twist, where the engine has them; their numbers are values."""
        return self.parts.get("shaft")
