"""What an engine is: plain data, in the units of files, as a catalogue or a person gives it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from engine_dyn.geometry.cylinders import Cylinders
from engine_dyn.loads.driven_machine import TorqueOverAngle, TorqueOverSpeed
from engine_dyn.pressure.cycle_table import ModelledDiagram
from engine_dyn.pressure.family import Family
from engine_dyn.pressure.family_grid import FamilyGrid
from engine_dyn.torsion.shaft import Shaft
from engine_dyn.types import Floats

__all__ = ["Engine"]


@dataclass(frozen=True, eq=False)
class Engine:
    """One engine: values of parameters, its indicator diagrams and where both come from.

    Parameters
    ----------
    name, title : str
        Short name of the catalogue and one line for people.
    period : float
        Angle of one cycle [rad], 4 pi for a four-stroke engine.
    values : mapping
        Value of each parameter that the engine gives, in the parameter's file unit.
    family : Family or FamilyGrid
        Indicator diagrams over load, or over load and speed; without a diagram, an engine still
        has its balance and moments of inertia.
    compression_ratio : float, optional
        Largest over smallest volume of a cylinder [1]: the geometric one if it is given, else that
        of the diagrams; None where they do not say it, or differ in it.
    cycles : tuple of ModelledDiagram, optional
        For each diagram of the family, in its order, the cycle by the first law that it is modelled
        by; None where a diagram is not so modelled.
    pressure_scale : tuple of arrays, optional
        Speed [rpm] and the factor on the diagram at that speed; linear in between.
    firing_order : tuple of int, optional
        Cylinders in the order in which they fire, where it is known.
    own_cylinders : Cylinders, optional
        Arrangement of the engine's own number of cylinders and their factors, where given.
    torque : TorqueOverAngle, optional
        Torque over the crank angle that is given in place of diagrams, with its mean.
    load_table : TorqueOverAngle or TorqueOverSpeed, optional
        What the engine drives, where that is more than a + k omega^alpha.
    driver_table : TorqueOverSpeed, optional
        What drives it; a motor's numbers are among the values instead.
    parts : mapping
        Structured parts by the names of their features, which `engine_dyn.quantities.features`
        lists; `of` of a feature returns its part.
    assumed : mapping
        Reason for every value that the sources do not give.
    sources : tuple of str
        Citations.
    silenced_warnings : tuple of str
        Names of plausibility checks whose ranges this engine is meant to leave.
    uncertainty : mapping
        Range or distribution of values that are not well known, as its file has them.
    diagram_speeds : tuple
        Lowest and highest speed [rpm] for which each diagram holds, by load; None where it is not
        known.
    diagram_warnings : tuple of str
        What the checks of recordings said of its diagrams, as their files tell.
    """

    name: str
    title: str
    period: float
    values: Mapping[str, float]
    family: Family | FamilyGrid
    compression_ratio: float | None = None
    pressure_scale: tuple[Floats, Floats] | None = None
    cycles: tuple[ModelledDiagram, ...] | None = None
    firing_order: tuple[int, ...] | None = None
    own_cylinders: Cylinders | None = None
    torque: TorqueOverAngle | None = None
    load_table: TorqueOverAngle | TorqueOverSpeed | None = None
    driver_table: TorqueOverSpeed | None = None
    parts: Mapping[str, Any] = field(default_factory=dict)
    assumed: Mapping[str, str] = field(default_factory=dict)
    sources: tuple[str, ...] = ()
    silenced_warnings: tuple[str, ...] = ()
    uncertainty: Mapping[str, Any] = field(default_factory=dict)
    diagram_speeds: tuple[tuple[float, float] | None, ...] = ()
    diagram_warnings: tuple[str, ...] = ()

    @property
    def shaft(self) -> Shaft | None:
        """Discs and shafts that twist, where the engine has them; their numbers are values."""
        return self.parts.get("shaft")
