"""Keys that a person may give for files of laboratories, and for recorded pressure in them.

The command `import`, the table [indicator] of a scene and `sweeps.read_pressure` share them.
"""

from __future__ import annotations

from typing import Literal, get_args

from pydantic import Field

from sweeps.base.checks import Companions, Strict

Format = Literal[
    "text", "fixed_width", "xlsx", "mat", "tdms", "mf4", "netcdf", "parquet", "wav", "uff"
]
"""Formats of laboratory files; `sweeps.base.columns.recording` has a reader for each."""


class ReadingChoices(Strict):
    """How a laboratory's file is read, where that is not to be guessed.

    The description of a field completes the sentence "must be ...".
    """

    format: Format | None = Field(
        default=None,
        description=f"one of {', '.join(get_args(Format))}: the format of the file, where the "
        "ending of its name does not tell it",
    )
    separator: str | None = Field(
        default=None, min_length=1, max_length=5,
        description="a string of one character, such as ';', or 'tab' or 'blank'",
    )  # fmt: skip
    decimal: Literal[".", ","] | None = Field(default=None, description="'.' or ','")
    encoding: str | None = Field(
        default=None, max_length=40,
        description="a string: the encoding of a text file, such as 'cp1252' or 'gb18030'",
    )  # fmt: skip
    sheet: str | None = Field(default=None, description="a string: the name of a sheet of an .xlsx")
    group: str | None = Field(
        default=None, description="a string: the name of a group of channels of a .tdms or .mf4"
    )


_COLUMN = "a column's name, or its number from 1"


class PressureOptions(ReadingChoices):
    """Keys of a recorded pressure. The steps are done in the order of the keys.

    The description of a field completes the sentence "must be ...".
    """

    angle_column: str | int | None = Field(default=None, description=_COLUMN)
    pressure_column: str | int | list[str | int] | None = Field(
        default=None, description=f"{_COLUMN}, or a list of them, one for each cylinder"
    )
    columns_are: Literal["cylinders", "cycles"] | None = Field(
        default=None, description="'cylinders' or 'cycles': meaning of several columns of pressure"
    )
    unit: str | None = Field(
        default=None, description="a string: the unit of the pressure, such as 'bar', 'kPa' or 'V'"
    )
    calibration: list[float] | None = Field(
        default=None, min_length=2, max_length=2,
        description="a list of two numbers: bar per volt, and bar at 0 V",
    )  # fmt: skip
    ambient_pressure: float = Field(
        default=1.01325, gt=0.0, le=2.0,
        description="a number in bar, up to 2: added to gauge pressures",
    )  # fmt: skip
    angle_unit: str | None = Field(default=None, description="'deg', 'rad' or 'rev'")
    angle_start: float | None = Field(
        default=None, description="a number in degree: the first angle, of a file without angles"
    )
    angle_increment: float | None = Field(
        default=None, gt=0.0, le=90.0,
        description="a number in degree: the step of the angle, of a file without angles",
    )  # fmt: skip
    volume_column: str | int | None = Field(
        default=None, description=f"{_COLUMN}: the volume of the cylinder, instead of crank angles"
    )
    volume_unit: str | None = Field(default=None, description="a string: 'cm3', 'l', 'm3' or 'in3'")
    travel_column: str | int | None = Field(
        default=None,
        description=f"{_COLUMN}: the travel of the piston from top dead centre, instead of crank "
        "angles",
    )
    travel_unit: str | None = Field(
        default=None, description="a string: '1' or '%' of the stroke, or 'mm'"
    )
    stroke_column: str | int | None = Field(
        default=None,
        description=f"{_COLUMN}: 1 (intake), 2 (compression), 3 (expansion) or 4 (exhaust)",
    )
    encoder_column: str | int | None = Field(
        default=None, description=f"{_COLUMN}: the signal of a toothed wheel, sampled over time"
    )
    wheel: str | None = Field(default=None, description="a pattern such as '60-2' or '36-1'")
    time_column: str | int | None = Field(
        default=None, description=f"{_COLUMN}: the times of the samples"
    )
    sample_rate: float | None = Field(
        default=None, gt=0.0, description="a number of samples per second, above 0"
    )
    gap_angle: float | None = Field(
        default=None, ge=-720.0, le=720.0,
        description="a number in degree, -720 to 720: the crank angle at which the first tooth "
                    "after the longest gap passes (with the edge that is used)",
    )  # fmt: skip
    mark_column: str | int | None = Field(
        default=None,
        description=f"{_COLUMN}: a mark once a revolution or once a cycle, instead of gap_angle",
    )
    mark_angle: float = Field(
        default=0.0, ge=-720.0, le=720.0,
        description="a number in degree, -720 to 720: where the mark's signal rises",
    )  # fmt: skip
    edge: Literal["rising", "falling"] | None = Field(
        default=None, description="'rising' or 'falling': the edge of the teeth that is used"
    )
    threshold: float | None = Field(
        default=None, description="a number in the unit of the wheel's signal"
    )
    hysteresis: float | None = Field(
        default=None, ge=0.0, description="a number in the unit of the wheel's signal, 0 or more"
    )
    direction: Literal["forward", "backward"] | None = Field(
        default=None, description="'forward', or 'backward' where the angle falls with time"
    )
    zero: Literal["TDC", "BDC"] = Field(
        default="TDC", description="'TDC', or 'BDC': bottom dead centre before compression"
    )
    dead_centre: Literal["firing", "gas exchange"] | None = Field(
        default=None, description="'firing' or 'gas exchange': the top dead centre at angle 0"
    )
    shift: float = Field(
        default=0.0, ge=-720.0, le=720.0, description="a number in degree, added to the angles"
    )
    delay: float = Field(
        default=0.0, ge=0.0, le=0.1,
        description="a number in seconds, up to 0.1: delay of the measuring chain",
    )  # fmt: skip
    speed: float | None = Field(
        default=None, gt=0.0, le=1e5, description="a number in rpm, for delay and time_constant"
    )
    firing_angles: list[float] | None = Field(
        default=None, min_length=1, max_length=100,
        description="a list of numbers in degree: where the cylinders fire, the first at 0",
    )  # fmt: skip
    crank_ratio: float | None = Field(
        default=None, gt=0.0, le=0.5,
        description="a number above 0 and up to 0.5: crank radius over rod length, for the imep",
    )  # fmt: skip
    compression_ratio: float | None = Field(
        default=None, gt=1.0, le=50.0, description="a number above 1 and up to 50"
    )
    brake_torque: float | None = Field(
        default=None, gt=0.0, le=1e8,
        description="a number in N m above 0: torque of the whole engine, measured at the shaft "
                    "during the recording, for a check",
    )  # fmt: skip
    pegging: Literal["inlet", "compression"] | None = Field(
        default=None,
        description="'inlet' or 'compression': pegging, how the absolute pressure is determined",
    )
    inlet_pressure: float | None = Field(
        default=None, gt=0.0, le=20.0, description="a number above 0 and up to 20, in bar, absolute"
    )
    pegging_angle: float = Field(
        default=-180.0, ge=-360.0, le=360.0,
        description="a number in degree: where the cylinder pressure equals the inlet pressure",
    )  # fmt: skip
    polytropic_exponent: float | None = Field(
        default=None,
        ge=1.0,
        le=1.7,
        description="a number from 1 to 1.7: polytropic exponent of the compression",
    )
    average: bool = Field(default=False, description="true or false")
    cycle: int | None = Field(default=None, ge=1, description="a whole number: the cycle to use")
    smoothing: Literal["savitzky_golay", "low_pass"] | None = Field(
        default=None, description="'savitzky_golay' or 'low_pass'"
    )
    smoothing_width: float = Field(
        default=4.0, gt=0.0, le=90.0, description="a number in degree: window of 'savitzky_golay'"
    )
    highest_order: float = Field(
        default=60.0,
        gt=0.0,
        description="a number: the highest order, per revolution, that 'low_pass' keeps",
    )
    time_constant: float = Field(
        default=0.0, ge=0.0, le=0.1,
        description="a number in seconds, up to 0.1: of a first-order lag of the measuring chain",
    )  # fmt: skip
    angle_step: float | None = Field(
        default=None, gt=0.0, le=30.0,
        description="a number in degree that divides the cycle: the step of the diagram",
    )  # fmt: skip

    @property
    def is_loop(self) -> bool:
        """Whether the pressure is over volume or travel."""
        return self.volume_column is not None or self.travel_column is not None


COMPANIONS: Companions = {
    ("angle_start",): {"angle_increment": ()},
    ("volume_unit",): {"volume_column": ()},
    ("travel_unit",): {"travel_column": ()},
    ("stroke_column",): {"volume_column": (), "travel_column": ()},
    ("time_column", "sample_rate", "gap_angle", "mark_column", "edge", "threshold", "hysteresis"): {
        "encoder_column": ()
    },
    ("mark_angle",): {"mark_column": ()},
    ("speed",): {"delay": (), "time_constant": ()},
    ("inlet_pressure", "pegging_angle"): {"pegging": ("inlet",)},
    ("polytropic_exponent",): {"pegging": ("compression",)},
    ("smoothing_width",): {"smoothing": ("savitzky_golay",)},
    ("highest_order",): {"smoothing": ("low_pass",)},
}


class ImportOptions(PressureOptions):
    """Keys of a recorded pressure without a scene."""

    engine: str | None = Field(
        default=None,
        description="a string: an engine of the catalogue or the path of an engine file",
    )
    two_stroke: bool = Field(default=False, description="true or false")
