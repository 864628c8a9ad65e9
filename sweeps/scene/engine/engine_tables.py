"""The tables of an engine file, as pydantic models: which keys there are, and their types.

Whether values are allowed is checked where a table is read. The JSON schema of engine files
(`sweeps.scene.json_schema`) is made from these models.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Literal

from pydantic import Field

from sweeps.base.checks import Strict
from sweeps.scene.engine.cylinder_keys import CYLINDER_KEYS
from sweeps.scene.engine.silenced_warnings import SILENCED
from sweeps.scene.features import file_with_features
from sweeps.scene.features.shaft_tables import Source

DIAGRAMS = "tables [[diagram]], one for each load"
"""Text for messages, where an engine file has no diagrams."""


class PressureScale(Strict):
    """Factors on the diagrams over speed."""

    speed: list[float] = Field(description="a list of speeds in rpm, ascending")
    scale: list[float] = Field(description="a list of factors on the pressure, one for each speed")


class DataSheet(Strict):
    """What a maker publishes: `engine-dyn calibrate` alone reads it, and makes diagrams of it."""

    kind: str | None = Field(
        default=None, description="a string: the kind of engine, such as 'diesel'"
    )
    power: float | str | None = Field(
        default=None,
        description="a number in kW (rated_power of scenes is in W), or with its unit, such as "
        "'62500 W': the rated brake power",
    )
    speed: float | str | None = Field(
        default=None, description="a number in rpm, or with its unit: the rated speed"
    )
    peak_pressure: float | str | None = Field(
        default=None,
        description="a number in bar, or with its unit, absolute: the largest pressure at rated "
        "power",
    )
    fuel_consumption: float | str | None = Field(
        default=None,
        description="a number in g/kWh, or with its unit: the consumption at rated power",
    )
    loads: list[float] | None = Field(
        default=None, description="a list of loads in percent of the rated mean effective pressure"
    )
    cycle: dict[str, Any] = Field(
        default={},
        description="a table of known properties of the cycle, with the keys of kind = 'first_law'",
    )


class EngineFile(Strict):
    """Tables and keys of an engine file, before values and diagrams are looked at."""

    name: str | None = Field(
        default=None, description="a string: the engine's short name; default: that of the file"
    )
    title: str | None = Field(
        default=None, description="a string: one line about the engine; default: its name"
    )
    cycle: Literal["four-stroke", "two-stroke"] | None = Field(
        default=None,
        description="'four-stroke' or 'two-stroke'; a [[diagram]] of kind = 'torque' has its own",
    )
    firing_order: list[int] | None = Field(
        default=None, description="a list of cylinder numbers in the order in which they fire"
    )
    arrangement: Any = Field(default=None, description=CYLINDER_KEYS["arrangement"])
    firing_angles: Any = Field(default=None, description=CYLINDER_KEYS["firing_angles"])
    pressure_factor: Any = Field(default=None, description=CYLINDER_KEYS["pressure_factor"])
    mass_factor: Any = Field(default=None, description=CYLINDER_KEYS["mass_factor"])
    radius_factor: Any = Field(default=None, description=CYLINDER_KEYS["radius_factor"])
    articulated_rods: Any = Field(default=None, description=CYLINDER_KEYS["articulated_rods"])
    silenced_warnings: list[str] = Field(default=[], description=SILENCED)
    values: dict[str, Any] = Field(description="a table of parameters")
    data_sheet: DataSheet | None = Field(
        default=None, description="a table of published numbers, for `engine-dyn calibrate`"
    )
    diagram: list[dict[str, Any]] = Field(default=[], description=DIAGRAMS, min_length=1)
    pressure_scale: PressureScale | None = Field(
        default=None, description="a table of speed and scale"
    )
    assumed: dict[str, str] = Field(
        default={}, description="a table with a reason, as a string, for each assumed value"
    )
    uncertainty: dict[str, Any] = Field(
        default={}, description="a table with a range or distribution for each uncertain value"
    )
    source: list[Source] = Field(default=[], description="tables [[source]] with one string each")


if not TYPE_CHECKING:  # Type checkers do not see the tables of features as attributes
    EngineFile = file_with_features(EngineFile, scenes=False)
