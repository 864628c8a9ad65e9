"""What a calibration is fitted to, and what comes out of it: plain data."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

from sweeps.base.errors import one_line
from sweeps.lab.speed.usual_engines import KINDS, EngineKind
from sweeps.scene.engine.data_sheets import Sheet

__all__ = ["PUBLISHED", "Calibration", "Point", "Published"]


PUBLISHED: Mapping[str, tuple[str, str]] = {
    "power": ("power", "kW"),
    "speed": ("speed", "rpm"),
    "peak": ("peak_pressure", "bar"),
    "fuel_consumption": ("fuel_consumption", "g/kWh"),
}
"""Numbers of `Published`: their keys in [data_sheet], and units."""


@dataclass(frozen=True)
class Published:
    """What is known of the rated point."""

    kind: str  # Kind of `KINDS`
    # Brake power [kW] and speed [rpm].
    power: float
    speed: float
    peak: float | None  # Largest pressure, absolute [bar]
    fuel_consumption: float | None  # [g/kWh]
    # Percentages of the rated mean effective pressure that get a diagram, ascending, 100 among
    # them.
    loads: tuple[float, ...]
    places: Mapping[str, str]  # Places: where each number stands, as messages call it


class Point(NamedTuple):
    """A fitted diagram, and what the numbers as they are written make."""

    load: float  # Percent
    table: dict[str, Any]  # The [[diagram]] in the units of files
    # Brake power and the one that was aimed at [kW].
    power: float
    goal: float
    # Mean effective pressures [bar].
    imep: float
    bmep: float
    # Largest pressure [bar] and where [degree].
    peak: float
    peak_angle: float
    compression: float  # Largest pressure without combustion [bar]
    air_fuel_ratio: float  # [1]
    fuel_consumption: float  # [g/kWh]


@dataclass(frozen=True, repr=False)
class Calibration:
    """An engine that was fitted to its data sheet.

    Attributes
    ----------
    sheet : Sheet
        What was read.
    published : Published
        What it was fitted to.
    values : dict
        [values] of the engine, given and assumed.
    order : tuple of int, optional
        Firing order that was assumed.
    points : tuple of Point
        The diagrams, by load.
    assumed : dict
        Reason for each number that is assumed.
    fitted : dict
        What each fitted number was fitted to.
    text : str
        The engine file.
    """

    sheet: Sheet
    published: Published
    values: dict[str, float]
    order: tuple[int, ...] | None
    points: tuple[Point, ...]
    assumed: dict[str, str]
    fitted: dict[str, str]
    text: str = ""

    def __repr__(self) -> str:
        about = self.published
        loads = ", ".join(f"{point.load:g}" for point in self.points)
        return (
            f"<Calibration of {one_line(self.sheet.name, 60)}: {about.kind}, {about.power:g} kW at "
            f"{about.speed:g} rpm; diagrams of {loads} % load; `text` is the engine file>"
        )

    @property
    def kind(self) -> EngineKind:
        """Kind of the engine."""
        return KINDS[self.published.kind]

    @property
    def rated(self) -> Point:
        """Point of full load."""
        return next(point for point in self.points if point.load == 100.0)
