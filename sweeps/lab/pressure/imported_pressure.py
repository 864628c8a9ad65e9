"""A recorded pressure once it is read: cycles of each cylinder, the diagram, and what was done."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from importlib import metadata
from pathlib import Path

import numpy as np

from engine_dyn.engine import Engine
from engine_dyn.geometry.cylinders import Cylinders
from engine_dyn.periodic_spline import periodic_spline_slopes
from engine_dyn.plausibility.usual_ranges import DIAGRAM_CHECKS
from engine_dyn.pressure.diagram import Diagram
from engine_dyn.recordings.cylinder_geometry import CylinderGeometry, Finding, RecordedCycles
from engine_dyn.recordings.dead_centre import imep_of_tenth, looks_motored
from engine_dyn.recordings.heat_release import mean_pressures
from engine_dyn.recordings.level import Level, recorded_level
from engine_dyn.types import Floats
from engine_dyn.units import BAR, DEGREE
from sweeps.base.columns.options import PressureOptions
from sweeps.base.errors import SceneError, counted, one_line, printable
from sweeps.scene.engine.silenced_warnings import BRAKE_TORQUE
from sweeps.scene.features.indicator_files import HEADER, NOT_PEGGED

# Largest number of cycles of a recording: each becomes a diagram whose tables take a tenth of a
# megabyte of memory
MOST_CYCLES = 1000


@dataclass(frozen=True, eq=False)
class ImportedPressure:
    """Cylinder pressure from a laboratory's file.

    Attributes
    ----------
    file : str
        Name of the raw file, without its folder.
    sha256 : str
        Hash of its bytes.
    recorded : dict of RecordedCycles
        Cycles of each cylinder after pegging, before smoothing, by the name of its column. Each
        counts its angle from its own firing top dead centre.
    cylinders : dict of RecordedCycles
        The same after all steps: one cycle where an average or one cycle was asked for.
    geometry : CylinderGeometry
        That the works follow from; bore and stroke are 1 m unless `sized`.
    steps : tuple of str
        Steps that were taken and their results, in order.
    warnings : tuple of str
        Remarks of the checks.
    sized : bool
        Whether bore and stroke are known.
    pegged : bool
        Whether the pressure was made absolute; otherwise its level is as recorded.
    levels : dict of Level
        Levels that recordings which were not pegged have, where they can be told.
    """

    file: str
    sha256: str
    recorded: dict[str, RecordedCycles] = field(repr=False)
    cylinders: dict[str, RecordedCycles] = field(repr=False)
    geometry: CylinderGeometry = field(repr=False)
    steps: tuple[str, ...]
    warnings: tuple[str, ...]
    sized: bool = True
    pegged: bool = False
    levels: dict[str, Level] = field(default_factory=dict, repr=False)

    @property
    def mean(self) -> RecordedCycles:
        """The diagram: one cycle, the mean of all cylinders on the grid of the first.

        SceneError where there are many cycles and none was chosen.
        """
        members = list(self.cylinders.values())
        first = members[0]
        if first.cycles > 1:
            raise SceneError(
                f"{self.file}: has {first.cycles} cycles, but one diagram is needed: request "
                "their average (--average, or average = true) or one of them (such as --cycle 7, "
                "or cycle = 7)"
            )
        pressure = np.mean([values_on(first.angle, member) for member in members], axis=0)
        return RecordedCycles(first.angle, np.asarray(pressure)[None, :], first.period)

    def text(self, *, cycles: bool = False) -> str:
        """CSV of the diagram, with what was done, as [indicator] of a scene reads it.

        Columns `crank_angle_deg` and `pressure_bar`; of several cylinders also the pressure of
        each. With `cycles`, `pressure_bar` is the mean of all cycles, and `cycle_1_bar`,
        `cycle_2_bar` and so on are the cycles. The same input gives the same text.

        Raises
        ------
        SceneError
            As `mean`; with `cycles`, for several cylinders, and for more than MOST_CYCLES.
        """
        mean = self._mean_of_cycles() if cycles else self.mean
        level = "absolute" if self.pegged else f"level as recorded, {NOT_PEGGED}"
        lines = [
            f"{HEADER}{level}; angle 0 is firing top dead centre",
            f"# raw file: {self.file}",
            f"# sha256 of the raw file: {self.sha256}",
            f"# made by: engine-dyn {metadata.version('engine-dyn')}",
            *(f"# {step}" for step in self.steps),
            *(f"# warning: {warning}" for warning in self.warnings),
        ]
        lines = [printable(" ".join(line.splitlines())) for line in lines]
        columns = {"crank_angle_deg": mean.angle / DEGREE, "pressure_bar": mean.pressure[0] / BAR}
        if len(self.cylinders) > 1:
            for number, member in enumerate(self.cylinders.values(), start=1):
                columns[f"pressure_{number}_bar"] = values_on(mean.angle, member) / BAR
        if cycles:
            (only,) = self.cylinders.values()
            for number, pressure in enumerate(only.pressure, start=1):
                columns[f"cycle_{number}_bar"] = pressure / BAR
        lines.append(",".join(columns))
        rows = zip(*(values.tolist() for values in columns.values()), strict=True)
        lines += [",".join(f"{value:.10g}" for value in row) for row in rows]
        return "\n".join(lines) + "\n"

    def _mean_of_cycles(self) -> RecordedCycles:
        """One cycle, the mean of the cycles of the only cylinder."""
        if len(self.cylinders) > 1:
            raise SceneError(
                f"{self.file}: recorded cycles of {len(self.cylinders)} cylinders; must be of one: "
                "name its pressure_column"
            )
        (only,) = self.cylinders.values()
        if only.cycles > MOST_CYCLES:
            raise SceneError(
                f"{self.file}: {only.cycles} recorded cycles; must be at most {MOST_CYCLES}"
            )
        return RecordedCycles(only.angle, only.mean[None, :], only.period)

    def write(self, path: str | Path, *, overwrite: bool = False) -> None:
        """Write the diagram as CSV (see `text`).

        Raises
        ------
        SceneError
            As `mean`; where the file exists and `overwrite` is not set.
        """
        text = self.text()
        try:
            with Path(path).open("w" if overwrite else "x", encoding="utf-8") as stream:
                stream.write(text)
        except FileExistsError:
            raise SceneError(f"{path}: exists; overwrite = True replaces it") from None


def values_on(angle: Floats, cycle: RecordedCycles) -> Floats:
    """Pressure of the first cycle at other angles, by the periodic cubic spline."""
    if np.array_equal(angle, cycle.angle):
        return np.asarray(cycle.pressure[0])
    slopes = periodic_spline_slopes(cycle.angle, cycle.pressure[0], cycle.period)
    return Diagram(cycle.angle, cycle.pressure[0], slopes, cycle.period)(angle)


@dataclass(frozen=True)
class EngineMeasures:
    """Measures of an engine that a recorded pressure is evaluated with."""

    period: float  # Angle of one cycle [rad]
    # Values of engine parameters by key, in the units of files, with `compression_ratio` if known.
    values: Mapping[str, float]
    own_cylinders: Cylinders | None  # Firing angles of the cylinders, if the engine gives them
    silenced: Sequence[str] = ()  # Plausibility checks that the engine silences


def measures_of(engine: Engine) -> EngineMeasures:
    """Measures of an engine; the compression ratio is that of its diagrams, if all have the same.

    Examples
    --------
    >>> from sweeps.scene.engine.engine_files import load_engine
    >>> measures_of(load_engine("boxer_twin_101x70")).values["compression_ratio"]
    10.3
    """
    values = {**known_ratio(engine.compression_ratio), **engine.values}
    return EngineMeasures(engine.period, values, engine.own_cylinders, engine.silenced_warnings)


def known_ratio(ratio: float | None) -> dict[str, float]:
    """Compression ratio as one of the values, where it is known."""
    return {} if ratio is None else {"compression_ratio": ratio}


def level_of(
    cycles: RecordedCycles, name: str, geometry: CylinderGeometry, options: PressureOptions,
    said: list[str],
) -> Level | None:  # fmt: skip
    """Tell dead centre, and the level if the recording is not pegged; None where unknown."""
    pegged = options.pegging is not None
    where = f"'{one_line(name, 60)}': {'pegged' if pegged else 'not pegged, level as recorded'}"
    try:
        level = recorded_level(cycles, geometry)
    except (ValueError, np.linalg.LinAlgError) as error:
        what = "dead centre cannot" if pegged else "neither level nor dead centre can"
        said.append(f"{where}; {what} be told: {error}")
        return None
    said.append(f"{where}; {level.shift_text if pegged else level.text}")
    # Pressures over the volume have the dead centres of the mechanism.
    if not options.is_loop:
        said.append(_worth_of_shift(cycles, level, name, geometry, options))
    return level


def _worth_of_shift(
    cycles: RecordedCycles, level: Level, name: str, geometry: CylinderGeometry,
    options: PressureOptions,
) -> str:  # fmt: skip
    """What one degree changes, and the option that moves the pressure."""
    degree = -10.0 * imep_of_tenth(cycles, geometry)  # Of a pressure that is moved to earlier
    imep = float(mean_pressures(cycles, geometry).net.mean())
    share = f" ({degree / imep:+.1%})" if imep > 0.0 else ""
    shift = f"{options.shift - level.shift / DEGREE:.1f}"
    how = ""
    if abs(level.shift) > 0.05 * DEGREE:
        how = f"; {_shift_text(shift, options)} would move it so far"
    worth = f"one degree earlier is worth {degree / BAR:+.3g} bar{share} of imep"
    return f"'{one_line(name, 60)}': {worth}{how}"


def _shift_text(shift: str, options: PressureOptions) -> str:
    """The option with the whole shift, which takes the place of one that is given."""
    place = f" in place of --shift {options.shift:g}" if options.shift else ""
    return f"--shift {shift}{place} (shift = {shift})"


def offer_of(
    finding: Finding, cycles: RecordedCycles, level: Level | None, options: PressureOptions
) -> str:
    """The options that put right what was found, where it is known."""
    motored = looks_motored(cycles) if level is None else level.motored
    if finding.check == "dead_centre" and motored and math.isfinite(finding.value):
        shift = f"{options.shift - finding.value:.2f}"
        return f"; give {_shift_text(shift, options)} for all recordings with this zero"
    if finding.check != "level" or level is None:
        return ""
    inlet = f"{level.inlet / BAR:.2f}"
    away = abs(level.offset + options.ambient_pressure * BAR)
    # Pressures that are too low by about the ambient pressure may be gauge pressures.
    gauge = away < 0.05 * BAR + 2.0 * level.uncertainty
    asked = "; is it gauge pressure (such as --unit barg)? If not, give" if gauge else "; give"
    return (
        f"{asked} --pegging inlet --inlet-pressure {inlet} (pegging = 'inlet', inlet_pressure = "
        f"{inlet}), or the inlet pressure that you know"
    )


def unlikely_peak(cycles: RecordedCycles) -> list[str]:
    """A warning where the largest pressure is that of neither an engine nor a compressor."""
    check = next(check for check in DIAGRAM_CHECKS if check.name == "peak_pressure")
    largest = float(cycles.pressure.max()) / check.si
    if check.low <= largest <= check.high:
        return []
    return [
        f"{check.name}: {check.what} is {largest:.3g} {check.unit}; usual is {check.low:g} to "
        f"{check.high:g} {check.unit}; check the unit of the pressure, its calibration and pegging"
    ]


def compared_torque(
    recorded: Mapping[str, RecordedCycles], geometry: CylinderGeometry, options: PressureOptions,
    engine: EngineMeasures | None, period: float, label: str, said: list[str],
) -> list[str]:  # fmt: skip
    """Say the mechanical efficiency that the torque at the shaft gives.

    A warning is returned where the indicated torque is below it, which friction forbids.
    """
    brake = options.brake_torque
    if brake is None:
        return []
    values = {} if engine is None else engine.values
    own = None if engine is None else engine.own_cylinders
    count = values.get("cylinders", 0 if own is None else own.count)
    if not count or not {"bore", "stroke"} <= values.keys():
        raise SceneError(f"{label}: brake_torque: needs an engine with bore, stroke and cylinders")
    works = [float(mean_pressures(cycles, geometry).net.mean()) for cycles in recorded.values()]
    imep = sum(works) / len(works)
    of_mean_pressure = geometry.swept_volume * count / period
    if imep * of_mean_pressure >= brake:
        said.append(
            f"indicated torque {imep * of_mean_pressure:.4g} N m, at the shaft {brake:.4g} N m: "
            f"mechanical efficiency {brake / (imep * of_mean_pressure):.1%}"
        )
        return []
    tenths = [imep_of_tenth(cycles, geometry) for cycles in recorded.values()]
    degree = 10.0 * sum(tenths) / len(tenths) * of_mean_pressure
    return [
        f"{BRAKE_TORQUE}: the indicated torque is {imep * of_mean_pressure:.4g} N m (imep "
        f"{imep / BAR:.4g} bar, {counted(int(count), 'cylinder')}), less than the {brake:.4g} N m "
        f"at the shaft, which cannot be; check dead centre (1 degree is worth {degree:+.3g} N m), "
        "unit and calibration"
    ]
