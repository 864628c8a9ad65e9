"""The table [measured] of a scene: recordings of the speed, and to which designs they belong.

Recordings are read by `sweeps.lab.speed`, not with the scene: they may be large, and archives of
computed results do not need them.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
from pydantic import Field

from engine_dyn.geometry.toothed_wheel import Wheel, wheel_from_angles, wheel_from_text
from engine_dyn.quantities.features.feature import Feature
from engine_dyn.quantities.graph import PARAMETERS
from engine_dyn.types import Floats
from sweeps.base.checks import Companions, check_companions, number
from sweeps.base.columns.options import ReadingChoices
from sweeps.base.dimensions import DESIGN
from sweeps.base.errors import SceneError, not_known, shown
from sweeps.base.files.regular_files import referred
from sweeps.scene.features.feature import GivenFeature
from sweeps.scene.values import GivenValues

KINDS = ("speed", "teeth", "encoder")
MOST_FILES = 1000


class MeasuredTable(ReadingChoices):
    """Measured speed beside the computed one."""

    file: str | list[str] = Field(
        description="a string: the path of a recording, or a list of them, one for each value of "
        "`at`"
    )
    kind: Literal["speed", "teeth", "encoder"] = Field(
        description="'speed' (over crank angle), 'teeth' (times at which they pass) or 'encoder' "
        "(sampled signal)"
    )
    wheel: str | list[float] | None = Field(
        default=None,
        description="a pattern such as '60-2', '36-1', '36-2-1', or the angles of all teeth in "
        "degree, in the order in which they pass",
    )
    column: str | int | None = Field(
        default=None, description="the name of the column with speed, times or signal, or its "
        "number from 1",
    )  # fmt: skip
    angle_column: str | int | None = Field(
        default=None, description="the name or number of the column with the crank angle"
    )
    time_column: str | int | None = Field(
        default=None,
        description="the name or number of the column with the time of the samples; of a speed, in "
        "place of its angle, which is integrated from the first sample on",
    )
    unit: str | None = Field(
        default=None, description="a string: the unit of the column, such as 'rpm', 'rad/s' or 'ms'"
    )
    sample_rate: float | None = Field(
        default=None, description="a number of samples per second, more than 0", gt=0.0
    )
    gap_angle: float | None = Field(
        default=None,
        description="a number of degrees, -720 to 720: the crank angle at which the first tooth "
        "after the longest gap passes",
        ge=-720.0, le=720.0,
    )  # fmt: skip
    first_tooth: int | list[int] | None = Field(
        default=None,
        description="the number, from 1, of a pulse that is the first tooth, for a wheel of which "
        "several could be it; or a list, one for each file",
    )
    mark_column: str | int | None = Field(
        default=None,
        description="the name or number of a column with a mark, once a revolution or once a cycle",
    )
    mark_angle: float = Field(
        default=0.0,
        description="a number of degrees, -720 to 720: where the mark's signal rises",
        ge=-720.0, le=720.0,
    )  # fmt: skip
    angle_shift: float = Field(
        default=0.0,
        description="a number of degrees, -720 to 720, added to the angles of the file",
        ge=-720.0, le=720.0,
    )  # fmt: skip
    reversed: bool = Field(
        default=False, description="true or false: whether the wheel turns against the order given"
    )
    end: Literal["free", "flywheel"] | None = Field(
        default=None, description="'free' or 'flywheel': the end of the crankshaft with the wheel"
    )
    threshold: float | None = Field(default=None, description="a number in the signal's unit")
    hysteresis: float | None = Field(
        default=None, description="a number in the signal's unit, 0 or more", ge=0.0
    )
    edge: Literal["rising", "falling"] | None = Field(
        default=None, description="'rising' or 'falling'"
    )
    tooth_errors: str | list[float] | None = Field(
        default=None,
        description="'others' (estimated from the other recordings), 'all', 'none', or a list of "
        "relative errors of the wheel's intervals, from the first tooth after the gap",
    )
    disc: str | None = Field(
        default=None,
        description="the name of a disc of the shaft, whose speed it is: a torsiogram",
        min_length=1,
    )
    part_cycles: int | None = Field(
        default=None,
        description="a whole number from 2: each file is cut into parts of so many cycles, which "
        "are compared one by one, as those of a run-up",
        ge=2,
    )
    at: dict[str, Any] = Field(
        default={}, description="a table of axes: for each file, the axis value to which it belongs"
    )


@dataclass(frozen=True, eq=False)
class Measured:
    """Recordings of the speed that a scene names."""

    table: MeasuredTable  # Table with columns, threshold and other keys, as the scene gives it
    paths: tuple[Path, ...]  # Paths of the recordings
    files: tuple[str, ...]  # Names of the recordings in the scene
    wheel: Wheel | None  # Toothed wheel and its signals
    # Errors of the wheel's teeth: estimated from the `others` among the recordings, from `all`,
    # `none`, or the relative errors of the intervals between teeth.
    errors: str | Floats
    at: Mapping[str, Floats]  # Values on axes at which each file was recorded
    # Number, from 0, of the pulse in each file that is the first tooth, where given.
    first: tuple[int | None, ...]
    disc: int | None = None  # Number of the disc of the shaft, from 0

    @property
    def groups(self) -> int:
        """Teeth of a turn that could be the first one, as far as the scene tells."""
        told = self.first[0] is not None or self.table.mark_column is not None
        return 1 if self.wheel is None or told else self.wheel.symmetry


def _read(values: GivenValues, given: MeasuredTable, folder: Path, where: str) -> Measured:
    """Check the table; the recordings themselves are not read."""
    where = f"{where}[measured]"
    files = (given.file,) if isinstance(given.file, str) else tuple(given.file)
    if not 1 <= len(files) <= MOST_FILES:
        raise SceneError(f"{where} file: {len(files)} files; must be 1 to {MOST_FILES}")
    paths = tuple(referred(folder, file, f"{where} file") for file in files)
    wheel = _wheel(given, where)
    companions: Companions = {
        ("angle_column", "angle_shift"): {"kind": ("speed",)},
        ("gap_angle", "first_tooth", "reversed", "end", "tooth_errors"): {
            "kind": ("teeth", "encoder")
        },
        ("sample_rate", "threshold", "hysteresis", "edge", "mark_column"): {"kind": ("encoder",)},
        ("time_column",): {"kind": ("encoder", "speed")},
        ("mark_angle",): {"mark_column": ()},
    }
    check_companions(given, companions, where)
    for key in ("gap_angle", "first_tooth"):
        if given.mark_column is not None and getattr(given, key) is not None:
            raise SceneError(
                f"{where} {key} and mark_column: both tell where the wheel is; give one"
            )
    if given.kind == "speed" and None not in (given.time_column, given.angle_column):
        raise SceneError(f"{where} time_column and angle_column: only one of them")
    for key in ("time_column", "unit"):  # Both keys describe the times of a signal
        if given.sample_rate is not None and getattr(given, key) is not None:
            raise SceneError(f"{where} sample_rate and {key}: only one of them")
    return Measured(
        given, paths, files, wheel, _errors(given, wheel, len(files), where),
        _places(given.at, values, len(files), where), _first(given, wheel, len(files), where),
        _disc(given, values, where),
    )  # fmt: skip


def _disc(given: MeasuredTable, values: GivenValues, where: str) -> int | None:
    """Number of the disc whose speed was recorded, which turns with the crank."""
    if given.disc is None:
        return None
    shaft, said = values.engine.shaft, f"{where} disc"
    if shaft is None:
        raise SceneError(f"{said}: the engine has no shaft")
    if given.disc not in shaft.discs:
        known = not_known(given.disc, shaft.discs)
        raise SceneError(f"{said} = {shown(given.disc)}: no such disc{known}")
    disc = shaft.discs.index(given.disc)
    if not shaft.turns_with_crank(disc):
        raise SceneError(f"{said} = {shown(given.disc)}: must turn with the crank, without gears")
    return disc


def _wheel(given: MeasuredTable, where: str) -> Wheel | None:
    """The toothed wheel; speed over angle needs none."""
    if given.kind == "speed":
        if given.wheel is not None:
            raise SceneError(
                f"{where} wheel: not allowed with kind = 'speed', which has no teeth; kind must be "
                "'teeth' or 'encoder'"
            )
        return None
    if given.wheel is None:
        raise SceneError(
            f"{where} wheel: missing; kind = '{given.kind}' needs the pattern of the teeth, such "
            "as '60-2'"
        )
    try:
        wheel = (
            wheel_from_text(given.wheel)
            if isinstance(given.wheel, str)
            else wheel_from_angles(given.wheel)
        )
    except ValueError as error:
        raise SceneError(f"{where} {error}") from None
    return wheel.reversed if given.reversed else wheel


def _first(
    given: MeasuredTable, wheel: Wheel | None, files: int, where: str
) -> tuple[int | None, ...]:
    """Numbers of the pulses in the files that are the first tooth."""
    numbers = given.first_tooth
    if numbers is None:
        return (None,) * files
    if wheel is None or not (wheel.even or wheel.symmetry > 1):
        raise SceneError(
            f"{where} first_tooth: only for a wheel of which several teeth could be the first one"
        )
    listed = numbers if isinstance(numbers, list) else [numbers] * files
    if len(listed) != files or min(listed) < 1:
        raise SceneError(
            f"{where} first_tooth = {shown(numbers)}: must be a number from 1, or one for each of "
            f"{files} files"
        )
    return tuple(number - 1 for number in listed)


def _errors(given: MeasuredTable, wheel: Wheel | None, files: int, where: str) -> str | Floats:
    """Errors of teeth that are subtracted; those from other recordings where there are some."""
    errors = given.tooth_errors
    if errors is None:
        return "others" if wheel is not None and files > 1 else "none"
    if wheel is None:
        raise SceneError(f"{where} tooth_errors: not allowed with kind = 'speed'")
    choices = ("others", "all", "none")
    if isinstance(errors, str):
        if errors not in choices:
            raise SceneError(
                f"{where} tooth_errors = {shown(errors)}: must be one of {', '.join(choices)}, or "
                "a list of numbers"
            )
        if errors == "others" and files < 2:
            raise SceneError(
                f"{where} tooth_errors = 'others': there is only one file; must be 'all', 'none' "
                "or a list of numbers"
            )
        return errors
    values = np.array(errors, dtype=float)
    if values.size != wheel.teeth or np.any(np.abs(values) >= 0.5):
        raise SceneError(
            f"{where} tooth_errors: {values.size} numbers; must be {wheel.teeth}, one for each "
            f"interval of {wheel.text}, each between -0.5 and 0.5"
        )
    return values


def _places(
    at: Mapping[str, Any], values: GivenValues, files: int, where: str
) -> dict[str, Floats]:
    """Values on axes at which the files were recorded."""
    if not at and files > 1:
        count = len(next(iter(values.designs.values()), ()))
        if count == files:
            return {DESIGN: np.arange(count, dtype=float)}
        raise SceneError(
            f"{where} at: missing; give the value of an axis for each of the {files} files, such "
            "as "
            "at = { load = [0, 50, 100] }"
        )
    places = {}
    for key, raw in at.items():
        given = list(raw) if isinstance(raw, list | np.ndarray) else [raw] * files
        if len(given) != files:
            raise SceneError(
                f"{where} at {key}: {len(given)} values for {files} files; must be one for each"
            )
        numbers = np.array([number(one, f"{where} at {key}", PARAMETERS.get(key)) for one in given])
        if key == DESIGN:
            axis = np.arange(1, len(next(iter(values.designs.values()), ())) + 1, dtype=float)
        else:
            axis = np.asarray(values.axes.get(key, ()))
            if axis.size == 0 or axis.dtype.kind not in "if":
                raise SceneError(
                    f"{where} at {key}: not an axis of numbers of this scene; must be a key of "
                    f"[axes]{', or design' if values.designs else ''}"
                )
        nearest = axis[np.argmin(np.abs(axis[:, None] - numbers), axis=0)] if axis.size else numbers
        if axis.size == 0 or np.any(np.abs(nearest - numbers) > 1e-9 * np.abs(numbers)):
            raise SceneError(
                f"{where} at {key}: {shown(numbers.tolist())}: the axis has "
                f"{shown(axis.tolist(), 200)}; must be among them"
            )
        places[key] = nearest - 1.0 if key == DESIGN else nearest
    return places


FEATURE: Feature[Measured] = Feature("measured", "recordings of the speed")
of = FEATURE.of

GIVEN = GivenFeature(
    FEATURE, "a table with file, kind and wheel: recordings of the speed", MeasuredTable,
    read_of_scene=_read, scenes_only=True,
)  # fmt: skip
