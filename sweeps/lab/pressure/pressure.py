"""Recorded pressure becomes an indicator diagram: the steps, in a fixed order, each reported.

1. columns, 2. unit and calibration, 3. angles: of a pressure over volume by the mechanism; unit,
direction, zero, delay and shift, 4. firing angles of the cylinders, firing or gas exchange, 5.
cycles, 6. pegging, 7. average or one cycle, 8. smoothing, lag of the measuring chain, 9. thinning.
6 to 9 are done where they are asked for.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from engine_dyn.engine import Engine
from engine_dyn.periodic_spline import wrapped
from engine_dyn.recordings.cylinder_geometry import CylinderGeometry, RecordedCycles
from engine_dyn.recordings.dead_centre import looks_motored
from engine_dyn.recordings.heat_release import (
    coefficient_of_variation,
    mean_pressures,
    peak_pressures,
)
from engine_dyn.recordings.level import EXPONENT, Level, peg_by_compression, peg_to_inlet
from engine_dyn.recordings.signal_checks import examine
from engine_dyn.recordings.smoothing import smooth, without_delay
from engine_dyn.types import Floats
from engine_dyn.units import BAR, DEGREE, RPM
from sweeps.base.checks import check_companions, mentioned
from sweeps.base.columns.options import COMPANIONS, PressureOptions
from sweeps.base.columns.recorded_columns import Recording, Signals, signals_of
from sweeps.base.columns.units import (
    angle_factor,
    counts_before,
    is_time_name,
    pressure_unit,
    unit_of_name,
)
from sweeps.base.errors import SceneError, counted, one_line
from sweeps.base.one_thread import linear_algebra_on_one_thread
from sweeps.lab.pressure.cycles_of_signals import (
    COUNTED_BACKWARD,
    crank_angles,
    cut_into_cycles,
    is_half_a_cycle_late,
    with_encoder_angles,
    work_sign,
)
from sweeps.lab.pressure.imported_pressure import (
    EngineMeasures,
    ImportedPressure,
    compared_torque,
    level_of,
    measures_of,
    offer_of,
    unlikely_peak,
    values_on,
)
from sweeps.lab.pressure.work_loops import with_loop_angles
from sweeps.scene.engine.silenced_warnings import STATED_UNIT

USUAL_CRANK_RATIO = 0.28  # Assumed where none is given; the imep depends on it by some percent

MOST_STEP = 10.0 + 1e-6  # Largest usual step of the angle [degree]; radians have 57 times that

MOST_PRESSURE = 1e10  # Largest pressure [Pa]; no sensor measures as much


@linear_algebra_on_one_thread()
def imported(
    recording: Recording, file: str, options: PressureOptions, period: float,
    engine: Engine | EngineMeasures | None = None, angle: Floats | None = None,
) -> ImportedPressure:  # fmt: skip
    """Make cycles and a diagram of a recording, the columns of `file`.

    A cycle is `period` long [rad]; measures and firing angles of the `engine` are used. The `angle`
    of each sample [rad], rising from a top dead centre at 0, is given where it is no column but
    follows from the pulses of an encoder (`engine_dyn.recordings.encoder`).
    """
    said = list(recording.said)
    levels: dict[str, Level] = {}
    warnings = list(recording.remarks)
    degrees = period / DEGREE
    engine = measures_of(engine) if isinstance(engine, Engine) else engine
    _check_together(options, degrees, recording.label)
    if options.encoder_column is not None or options.wheel is not None:
        recording, options, angle = with_encoder_angles(recording, options, degrees, said)
    try:
        geometry = _geometry(engine, options)
        if options.pegging == "compression" and geometry.compression_ratio is None:
            raise SceneError(
                f"{recording.label}: pegging = 'compression': needs compression_ratio, or "
                "geometric_compression_ratio in [values] of the engine file"
            )
        if options.is_loop:
            recording, options, angle = with_loop_angles(
                recording, options, geometry, engine, degrees, said
            )
        recorded = _cycles(recording, options, degrees, engine, angle, said, warnings)
        _say_ratios(engine, options, geometry, said, warnings)
        recorded = {name: _pegged(c, name, geometry, options, said) for name, c in recorded.items()}
        for name, cycles in recorded.items():
            before = f"{name}: " if len(recorded) > 1 else ""
            level, silent = None, ["gap"] if options.is_loop else []
            known = level_of(cycles, name, geometry, options, said)
            if options.pegging is None:
                level = known
                if level is not None:
                    levels[name] = level
                elif not looks_motored(cycles):
                    # Without a pressure level, the dead centre is not known either
                    silent.append("dead_centre")
            signal_remarks = examine(cycles, geometry, silenced=silent, level=level)
            warnings += [
                f"{before}{one}{offer_of(one, cycles, level, options)}" for one in signal_remarks
            ]
            warnings += [f"{before}{line}" for line in unlikely_peak(cycles)]
        warnings += compared_torque(
            recorded, geometry, options, engine, period, recording.label, said
        )
        _describe(recorded, geometry, said)
        done = {
            name: _finished(cycles, name, geometry, options, said, recording.label)
            for name, cycles in recorded.items()
        }
    except ValueError as error:
        if isinstance(error, SceneError):
            raise
        raise SceneError(f"{recording.label}: {mentioned(error)}") from None
    return ImportedPressure(
        file, recording.sha256, recorded, done, geometry,
        tuple(dict.fromkeys(said)), tuple(dict.fromkeys(warnings)),
        engine is not None and {"bore", "stroke"} <= engine.values.keys(),
        options.pegging is not None, levels,
    )  # fmt: skip


def _check_together(options: PressureOptions, degrees: float, label: str) -> None:
    """Refuse keys that need others, or exclude each other."""
    check_companions(options, COMPANIONS, f"{label}:")
    for key in ("delay", "time_constant"):
        if getattr(options, key) and options.speed is None:
            raise SceneError(f"{label}: {key}: needs speed, in rpm")
    if options.pegging == "inlet" and options.inlet_pressure is None:
        raise SceneError(f"{label}: pegging = 'inlet': needs inlet_pressure, in bar")
    if options.average and options.cycle is not None:
        raise SceneError(f"{label}: average and cycle: only one of them")
    for pair in (
        ("angle_increment", "angle_column"),
        ("sample_rate", "time_column"),
        ("gap_angle", "mark_column"),
    ):
        if all(getattr(options, key) is not None for key in pair):
            raise SceneError(f"{label}: {' and '.join(pair)}: only one of them")
    if options.dead_centre is not None and degrees <= 360.0:
        raise SceneError(f"{label}: dead_centre: has no effect on a two-stroke cycle")
    step = options.angle_step
    if step is not None and abs(degrees / step - round(degrees / step)) > 1e-9:
        raise SceneError(f"{label}: angle_step = {step:g}: must divide {degrees:g} degree")


def _cycles(
    recording: Recording, options: PressureOptions, degrees: float, engine: EngineMeasures | None,
    angle: Floats | None, said: list[str], warnings: list[str],
) -> dict[str, RecordedCycles]:  # fmt: skip
    """Cycles of each cylinder, at its own firing dead centre."""
    if angle is not None and options.angle_column is None:
        # `signals_of` demands an increment of the angle; since the angles are known, any will do.
        signals = signals_of(recording, options.model_copy(update={"angle_increment": 1.0}))
        signals = signals._replace(angle=angle / DEGREE, angle_unit="deg")
    else:
        signals = signals_of(recording, options)
    said += signals.said
    pressures = {
        name: _pascal(recording, name, values, signals.units[name], options, said, warnings)
        for name, values in signals.pressures.items()
    }
    for name, values in pressures.items():
        if np.abs(values).max() > MOST_PRESSURE:
            raise SceneError(
                f"{recording.where(name)}: has pressures of "
                f"{np.abs(values).max() / BAR:.3g} bar; must be below {MOST_PRESSURE / BAR:g} bar"
            )
    angles = _degrees(recording, signals, pressures, degrees, options, said)
    steps = np.abs(np.diff(angles))
    if not options.is_loop and steps.size and (step := float(np.median(steps))) > MOST_STEP:
        raise SceneError(
            f"{recording.label}: the angle has steps of {step:.3g} degree; must be at most "
            f"{MOST_STEP:g}; is the angle in degrees?"
        )
    crank_signals = crank_angles(recording, angles, pressures, degrees, options, said)
    crank = crank_signals.angle + _correction(options, said)
    firing = _firing_angles(
        recording, crank, crank_signals.pressures, degrees, options, engine, said
    )
    crank, late = _at_firing(crank, crank_signals, firing, degrees, options, said, warnings)
    first = next(iter(crank_signals.pressures.values()))
    inside = (crank - firing[0] + 0.5 * degrees) % degrees - 0.5 * degrees
    order = np.argsort(inside, kind="stable")
    sign = work_sign(inside[order], first[order])
    peak = is_half_a_cycle_late(inside, first, degrees)[1]
    # A cycle that consumes work is a motored one, or a fired one whose samples are in reverse
    # order. It is motored if its work over the absolute area of its loop, and the angle [degree] of
    # its largest pressure, both exceed the limits below: a reversed fired cycle consumes more work,
    # or has its largest pressure earlier.
    least_work, earliest = -0.12, -2.0 if crank_signals.backward else -5.0
    # Ratio of work to absolute area below which an engine's diagram is taken for a reversed one
    against = -0.05
    if least_work < sign < against and peak > earliest:
        said.append("the cycles consume work and their largest pressure is at dead centre: motored")
    elif sign < against and options.direction is None and not late:
        if float(np.median(np.diff(angles))) < 0.0:
            if crank_signals.backward:
                said.remove(COUNTED_BACKWARD)
                said.append("the rows are in reverse order")
            said.append("otherwise expansion would come before compression")
            way = "forward" if crank_signals.backward else "backward"
            other = options.model_copy(update={"direction": way})
            return _cycles(recording, other, degrees, engine, angle, said, warnings)
        warnings.append(
            "the pressure is higher on compression than on expansion: is the angle counted "
            "backward (direction = 'backward'), or is this not an engine?"
        )
    return {
        name: cut_into_cycles(
            recording,
            crank - fires,
            values,
            degrees,
            name,
            options.angle_step,
            said,
            regular=not options.is_loop,
        )
        for fires, (name, values) in zip(firing, crank_signals.pressures.items(), strict=True)
    }


def _pascal(
    recording: Recording, name: str, values: Floats, stated: str, options: PressureOptions,
    said: list[str], warnings: list[str],
) -> Floats:  # fmt: skip
    """Pressure [Pa] of a column, by the unit that is given, stated, or part of its name."""
    where = recording.where(name)
    stated = stated or unit_of_name(name, recording.label)
    text = options.unit or stated
    if not text and options.calibration is not None:
        text = "V"
    if not text:
        likely, hint = _looks_like(float(np.percentile(values, 99.9)))
        raise SceneError(
            f"{where}: no unit stated{hint}; give it (--unit {likely}, say, or unit = '{likely}')"
        )
    unit = pressure_unit(text)
    if unit is None:
        raise SceneError(
            f"{where}: unit '{one_line(text, 40)}': must be a unit of pressure (bar, kPa, MPa, "
            "psi, Pa ...), or V with calibration"
        )
    in_file = pressure_unit(stated) if stated else None
    if in_file not in (None, unit):
        warnings.append(
            f"{STATED_UNIT}: column '{one_line(name, 60)}': the file says "
            f"{one_line(stated, 40)}, unit = '{one_line(text, 40)}' was given and is used"
        )
    if unit.voltage:
        if options.calibration is None:
            raise SceneError(f"{where}: in {text}: needs calibration, bar per volt and bar at 0 V")
        gain, offset = options.calibration
        said.append(f"pressure: {gain:g} bar per volt, {offset:g} bar at 0 V")
        return np.asarray((values * unit.factor * gain + offset) * BAR)
    if options.calibration is not None:
        raise SceneError(f"{where}: in {text}: calibration is of volts, give unit = 'V'")
    if not unit.gauge and "ambient_pressure" in options.model_fields_set:
        raise SceneError(
            f"{where}: in {one_line(text, 40)}: ambient_pressure is added to gauge pressures; "
            "give unit = 'barg', say"
        )
    ambient = options.ambient_pressure * BAR if unit.gauge else 0.0
    added = f", {options.ambient_pressure:g} bar added" if unit.gauge else ""
    said.append(f"pressure in {text}{added}")
    return np.asarray(values * unit.factor + ambient)


def _looks_like(highest: float) -> tuple[str, str]:
    """Unit in which a largest pressure is plausible, otherwise bar, and the reason for messages."""
    for name, factor in (("MPa", 1e6), ("bar", BAR), ("psi", 6894.76), ("kPa", 1e3), ("Pa", 1.0)):
        if 15e5 < highest * factor < 300e5:
            return name, f" (the largest value, {highest:.4g}, may be in {name})"
    return "bar", ""


def _degrees(
    recording: Recording, signals: Signals, pressures: Mapping[str, Floats], period: float,
    options: PressureOptions, said: list[str],
) -> Floats:  # fmt: skip
    """Angles of the samples [degree]."""
    if signals.angle is None:
        if options.angle_increment is None:
            raise SceneError(f"{recording.label}: has no angles; needs angle_increment, in degree")
        start = -0.5 * period if options.angle_start is None else options.angle_start
        step = options.angle_increment
        shape = next(iter(pressures.values())).shape
        count = round(period / step) if len(shape) > 1 else shape[0]
        if len(shape) > 1 and count + 1 in shape:
            count += 1
        said.append(f"angle from {start:g} degree on, in steps of {step:g}")
        return np.asarray(start + step * np.arange(count), np.float64)
    text = options.angle_unit or signals.angle_unit or unit_of_name(signals.angle_name, "")
    if not text and is_time_name(signals.angle_name):
        raise SceneError(
            f"{recording.where(signals.angle_name)}: is a time; must be crank angles, or "
            "encoder_column and wheel, or angle_increment"
        )
    if not text:
        span = float(np.ptp(signals.angle))
        text = "rad" if span < 13.0 else "deg"
        said.append(f"angle taken to be in {text}")
    factor = angle_factor(text, f"{recording.label}, '{signals.angle_name}'")
    if factor > 0.0 and counts_before(signals.angle_name):
        factor = -factor
    if factor < 0.0:
        said.append("angles count before top dead centre")
    return signals.angle * factor


def _correction(options: PressureOptions, said: list[str]) -> float:
    """Degrees to add to the file's angles, before firing and gas exchange are told apart."""
    moved = options.shift
    if options.zero == "BDC":
        moved -= 180.0
        said.append("zero is bottom dead centre: 180 degree subtracted")
    if options.delay and options.speed is not None:
        late = options.delay * options.speed * 6.0
        moved -= late
        said.append(f"delay of {options.delay:g} s at {options.speed:g} rpm: {late:.4g} degree")
    if options.shift:
        said.append(f"angles shifted by {options.shift:g} degree")
    return moved


def _firing_angles(
    recording: Recording, crank: Floats, pressures: Mapping[str, Floats], period: float,
    options: PressureOptions, engine: EngineMeasures | None, said: list[str],
) -> list[float]:  # fmt: skip
    """Angle at which each cylinder fires [degree], the first at 0."""
    count = len(pressures)
    if options.firing_angles is not None:
        if len(options.firing_angles) != count:
            raise SceneError(
                f"{recording.label}: firing_angles: {counted(len(options.firing_angles), 'value')} "
                f"for {counted(count, 'column')} of pressure"
            )
        return list(options.firing_angles)
    if count == 1:
        return [0.0]
    own = None if engine is None else engine.own_cylinders
    members = own.members if own is not None and own.count == count else ()
    firing = [-member.phase / DEGREE % period for member in members]
    peaks = [is_half_a_cycle_late(crank, p, period)[1] for p in pressures.values()]
    apart = [(peak - peaks[0]) % period for peak in peaks]
    if all(min(a, period - a) < 15.0 for a in apart):
        said.append("crank angle of each cylinder counted from its own dead centre")
        return [0.0] * count
    interval = period / count
    guessed = [round(a / interval) * interval % period for a in apart]
    if firing and np.abs(wrapped(np.subtract(apart, firing), period)).max() < 30.0:
        said.append(f"cylinders fire at {_listed(firing)} degree, from the engine file")
        return firing
    if len(set(guessed)) < count:
        raise SceneError(
            f"{recording.label}: the largest pressures of the cylinders are {_listed(apart)} "
            "degree apart, which is not even firing; give firing_angles"
        )
    said.append(f"cylinders fire at {_listed(guessed)} degree, judged from their largest pressures")
    return guessed


def _listed(values: list[float]) -> str:
    return ", ".join(f"{value:g}" for value in values)


def _at_firing(
    crank: Floats, crank_signals: Any, firing: list[float], period: float, options: PressureOptions,
    said: list[str], warnings: list[str],
) -> tuple[Floats, bool]:  # fmt: skip
    """Angles from the firing dead centre of cylinder 1, and whether the peak is far from it."""
    first = next(iter(crank_signals.pressures.values()))
    if period > 360.0 and options.dead_centre == "gas exchange":
        crank = crank + 360.0
        said.append("zero is the gas-exchange dead centre: 360 degree added")
    late, peak = is_half_a_cycle_late(crank - firing[0], first, period)
    if (
        period > 360.0
        and late
        and (options.dead_centre is None or crank_signals.rolls_over == 360.0)
    ):
        crank = crank + 360.0
        said.append("the largest pressure is 360 degree later: firing dead centre moved there")
        late, peak = is_half_a_cycle_late(crank - firing[0], first, period)
    for fires, (name, values) in zip(firing, crank_signals.pressures.items(), strict=True):
        _, at = is_half_a_cycle_late(crank - fires, values, period)
        if abs(at) > 60.0:
            warnings.append(
                f"the largest pressure of '{one_line(name, 60)}' lies at {at:g} degree, not near "
                "a firing dead centre; check zero, shift and firing_angles"
            )
    return crank, abs(peak) > 60.0


def _geometry(engine: EngineMeasures | None, options: PressureOptions) -> CylinderGeometry:
    """Dimensions of a cylinder, as far as they are known."""
    values: Mapping[str, float] = {} if engine is None else engine.values
    ratio = options.crank_ratio
    ratio = values.get("crank_ratio", USUAL_CRANK_RATIO) if ratio is None else ratio
    compression = options.compression_ratio or values.get("compression_ratio")
    return CylinderGeometry(
        values.get("bore", 1.0), values.get("stroke", 1.0), ratio, compression,
        values.get("pin_offset", 0.0) + values.get("crank_offset", 0.0),
    )  # fmt: skip


def _say_ratios(
    engine: EngineMeasures | None, options: PressureOptions, geometry: CylinderGeometry,
    said: list[str], warnings: list[str],
) -> None:  # fmt: skip
    """Warn of an assumed crank ratio; report the compression ratio, or that it is unknown."""
    if options.crank_ratio is None and (engine is None or "crank_ratio" not in engine.values):
        warnings.append(
            f"crank_ratio: {USUAL_CRANK_RATIO:g} assumed for the imep; give crank_ratio or engine"
        )
    if geometry.compression_ratio is None:
        said.append(
            "compression ratio unknown, so exponents of compression and expansion are not checked; "
            "give compression_ratio, or geometric_compression_ratio in the engine file"
        )
    elif options.compression_ratio is None:
        said.append(f"compression ratio {geometry.compression_ratio:g} of the engine")


def _pegged(
    cycles: RecordedCycles, name: str, geometry: CylinderGeometry, options: PressureOptions,
    said: list[str],
) -> RecordedCycles:  # fmt: skip
    """Cycles with the pressure made absolute, if the options ask for it."""
    if options.pegging is None:
        return cycles
    if options.pegging == "inlet":
        level = options.inlet_pressure or math.nan
        pegged = peg_to_inlet(cycles, level * BAR, options.pegging_angle * DEGREE)
        how = f"{level:g} bar at {options.pegging_angle:g} degree"
    else:
        exponent = EXPONENT if options.polytropic_exponent is None else options.polytropic_exponent
        pegged = peg_by_compression(cycles, geometry, exponent)
        how = f"polytropic compression, exponent {exponent:g}"
    offset = pegged.offset / BAR
    spread = f" ({offset.min():.4g} to {offset.max():.4g})" if len(offset) > 1 else ""
    said.append(
        f"pegging of '{one_line(name, 60)}' to {how}: {offset.mean():+.4g} bar{spread}, standard "
        f"uncertainty {pegged.uncertainty.mean() / BAR:.2g} bar"
    )
    return pegged.cycles


def _describe(
    recorded: Mapping[str, RecordedCycles], geometry: CylinderGeometry, said: list[str]
) -> None:
    """Report mean and largest pressures, and differences between cylinders."""
    works: dict[str, float] = {}
    highest: dict[str, float] = {}
    for name, cycles in recorded.items():
        imep = mean_pressures(cycles, geometry).net / BAR
        peak, at = peak_pressures(cycles)
        works[name], highest[name] = float(imep.mean()), float(peak.mean()) / BAR
        motored = looks_motored(cycles)  # With an imep near 0, its relative spread means nothing
        varies = f"; {cycles.cycles} cycles" if cycles.cycles > 1 else ""
        if cycles.cycles > 1 and not motored:
            variation = 100.0 * abs(coefficient_of_variation(imep))
            varies += f", coefficient of variation of imep {variation:.2f} %"
        if cycles.cycles > 1:
            before = ", coefficient of variation" if motored else ","
            variation = 100.0 * coefficient_of_variation(peak)
            varies += f"{before} of the largest pressure {variation:.2f} %"
        if motored:
            varies += f"; motored, loss angle {-float(at.mean()) / DEGREE:.3g} degree"
        said.append(
            f"'{one_line(name, 60)}': imep {works[name]:.4g} bar, largest pressure "
            f"{highest[name]:.4g} bar at {float(at.mean()) / DEGREE:.3g} degree{varies}"
        )
    if len(recorded) > 1:
        mean, top = (sum(v.values()) / len(v) for v in (works, highest))
        for name in recorded:
            said.append(
                f"'{one_line(name, 60)}' differs from the mean of the cylinders: imep "
                f"{100.0 * (works[name] / mean - 1.0):+.2f} %, largest pressure "
                f"{100.0 * (highest[name] / top - 1.0):+.2f} %"
            )


def _finished(
    cycles: RecordedCycles, name: str, geometry: CylinderGeometry, options: PressureOptions,
    said: list[str], label: str,
) -> RecordedCycles:  # fmt: skip
    """Average or one cycle, smoothing, thinning, as the options ask."""
    if options.cycle is not None:
        if options.cycle > cycles.cycles:
            raise SceneError(
                f"{label}: cycle = {options.cycle}: '{one_line(name, 60)}' has "
                f"{counted(cycles.cycles, 'whole cycle')}"
            )
        said.append(f"cycle {options.cycle} of {cycles.cycles} taken")
        cycles = replace(cycles, pressure=cycles.pressure[options.cycle - 1 : options.cycle])
    elif options.average and cycles.cycles > 1:
        said.append(f"average of {cycles.cycles} cycles")
        cycles = replace(cycles, pressure=cycles.mean[None, :])
    if options.smoothing is not None:
        smoothed = smooth(
            cycles, geometry, options.smoothing, width=options.smoothing_width * DEGREE,
            highest_order=options.highest_order,
        )  # fmt: skip
        said.append(
            f"smoothing of '{one_line(name, 60)}' ({options.smoothing}): keeps orders up to "
            f"{smoothed.highest_order:.3g}; noise {smoothed.noise_before / BAR:.2g} bar before, "
            f"{smoothed.noise_after / BAR:.2g} bar after; imep changed by "
            f"{smoothed.imep_change / BAR:+.2g} bar, largest pressure by "
            f"{smoothed.peak_change / BAR:+.2g} bar"
        )
        cycles = smoothed.cycles
    if options.time_constant and options.speed is not None:
        cycles = without_delay(cycles, options.speed * RPM, time_constant=options.time_constant)
        said.append(f"first-order lag of {options.time_constant:g} s taken out")
    return _thinned(cycles, options.angle_step, said)


def _thinned(cycles: RecordedCycles, step: float | None, said: list[str]) -> RecordedCycles:
    """Cycles on the grid of a step [degree], by their own samples or by a spline through all."""
    if step is None:
        return cycles
    half = 0.5 * cycles.period
    grid: Floats = np.linspace(-half, half, round(2.0 * half / DEGREE / step), endpoint=False)
    if len(grid) == len(cycles.angle) and np.abs(grid - cycles.angle).max() < 1e-6 * DEGREE:
        return cycles
    near = np.searchsorted(cycles.angle, grid - 1e-6 * DEGREE)
    near = np.minimum(near, len(cycles.angle) - 1)
    if np.abs(cycles.angle[near] - grid).max() < 2e-6 * DEGREE:
        said.append(f"thinned from {len(cycles.angle)} samples to steps of {step:g} degree")
        return RecordedCycles(cycles.angle[near], cycles.pressure[:, near], cycles.period)
    said.append(f"{len(cycles.angle)} samples interpolated onto steps of {step:g} degree (spline)")
    rows = [values_on(grid, replace(cycles, pressure=row[None])) for row in cycles.pressure]
    return RecordedCycles(grid, np.array(rows), cycles.period)
