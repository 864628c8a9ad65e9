"""What an engine is: plain data, in the units of files, as a catalogue or a person gives it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from engine_dyn.cylinders import Cylinders
from engine_dyn.family_grid import FamilyGrid
from engine_dyn.indicator import Family

__all__ = ["FOUR_STROKE", "Engine"]

FOUR_STROKE = 4.0 * math.pi


@dataclass(frozen=True)
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
        Indicator diagrams over load, or over load and speed.
    pressure_scale : tuple of arrays, optional
        Speed [rpm] and the factor on the diagram at that speed; linear in between.
    firing_order : tuple of int, optional
        Cylinders in the order in which they fire, where it is known.
    own_cylinders : Cylinders, optional
        Arrangement of the engine's own number of cylinders and their factors, where given.
    assumed : mapping
        Reason for every value that the sources do not give.
    sources : tuple of str
        Citations.
    """

    name: str
    title: str
    period: float
    values: Mapping[str, float]
    family: Family | FamilyGrid
    pressure_scale: tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]] | None = None
    firing_order: tuple[int, ...] | None = None
    own_cylinders: Cylinders | None = None
    assumed: Mapping[str, str] = field(default_factory=dict)
    sources: tuple[str, ...] = ()
