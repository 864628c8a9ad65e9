"""Remarks on a recorded pressure: its level, what puts it right, and unlikely values."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from engine_dyn.plausibility.usual_ranges import DIAGRAM_CHECKS
from engine_dyn.recordings.cylinder_geometry import CylinderGeometry
from engine_dyn.recordings.dead_centre import imep_of_tenth, looks_motored
from engine_dyn.recordings.findings import Finding
from engine_dyn.recordings.heat_release import mean_pressures
from engine_dyn.recordings.level import Level, recorded_level
from engine_dyn.recordings.recorded_cycles import RecordedCycles
from engine_dyn.units import BAR
from sweeps.base.columns.options import PressureOptions
from sweeps.base.errors import SceneError, counted, one_line
from sweeps.lab.pressure.measures import EngineMeasures
from sweeps.scene.engine.silenced_warnings import BRAKE_TORQUE

__all__ = ["level_of", "offer_of", "too_little_torque", "unlikely_peak"]

LIKE_GAUGE = 0.05 * BAR
"""A level that is too low by the ambient pressure, but for so much, may be gauge pressure."""


def level_of(
    cycles: RecordedCycles, name: str, geometry: CylinderGeometry, said: list[str]
) -> Level | None:
    """Tell level and dead centre of a recording that is not pegged; None where unknown."""
    where = f"'{one_line(name, 60)}': not pegged, level as recorded"
    try:
        level = recorded_level(cycles, geometry)
    except (ValueError, np.linalg.LinAlgError) as error:
        said.append(f"{where}; neither level nor dead centre can be told: {error}")
        return None
    said.append(f"{where}; {level.text}")
    return level


def offer_of(
    finding: Finding, cycles: RecordedCycles, level: Level | None, options: PressureOptions
) -> str:
    """The options that put right what was found, where it is known."""
    motored = looks_motored(cycles) if level is None else level.motored
    if finding.check == "dead_centre" and motored and math.isfinite(finding.value):
        shift = f"{options.shift - finding.value:.2f}"
        return f"; give --shift {shift} (shift = {shift}) for all recordings with this zero"
    if finding.check != "level" or level is None:
        return ""
    inlet = f"{level.inlet / BAR:.2f}"
    away = abs(level.offset + options.ambient_pressure * BAR)
    gauge = away < LIKE_GAUGE + 2.0 * level.uncertainty
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


def too_little_torque(
    recorded: Mapping[str, RecordedCycles], geometry: CylinderGeometry, options: PressureOptions,
    engine: EngineMeasures | None, period: float, label: str,
) -> list[str]:  # fmt: skip
    """A warning where the indicated torque is below that at the shaft, which friction forbids."""
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
        return []
    tenths = [imep_of_tenth(cycles, geometry) for cycles in recorded.values()]
    degree = 10.0 * sum(tenths) / len(tenths) * of_mean_pressure
    return [
        f"{BRAKE_TORQUE}: the indicated torque is {imep * of_mean_pressure:.4g} N m (imep "
        f"{imep / BAR:.4g} bar, {counted(int(count), 'cylinder')}), less than the {brake:.4g} N m "
        f"at the shaft, which cannot be; check dead centre (1 degree is worth {degree:+.3g} N m), "
        "unit and calibration"
    ]
