"""From recorded angles and pressures to cycles on one grid: range, direction, dead centre, gaps.

Angles are in degree here, as files have them: a grid of half degrees stays one.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from engine_dyn.geometry.toothed_wheel import Wheel, wheel_from_text
from engine_dyn.periodic_spline import wrapped
from engine_dyn.recordings.cylinder_geometry import RecordedCycles
from engine_dyn.recordings.encoder import (
    EncoderSignal,
    mark_times,
    teeth_from_mark,
    teeth_of_signal,
)
from engine_dyn.types import Floats
from engine_dyn.units import DEGREE
from sweeps.base.checks import mentioned
from sweeps.base.columns.options import PressureOptions
from sweeps.base.columns.recorded_columns import Recording, named_column, wanted_pressures
from sweeps.base.columns.units import SECONDS, is_time_name, stated_unit
from sweeps.base.errors import SceneError, counted, one_line

SAME = 1e-6  # Angles that differ by less are the same [degree]

MOST_ANGLE = 1e9  # Largest angle that is accepted [degree]; beyond it, rounding errors reach `SAME`

LONGEST = 30.0
"""Longest step between points of a pressure over volume [degree]; longer ones do not tell the
pressure between them."""

COUNTED_BACKWARD = "counted backward: an angle of 10 becomes -10"
"""Remark that an angle was counted backward."""


class CrankAngles(NamedTuple):
    """Angle of each sample, rising over all cycles."""

    angle: Floats  # Ascending crank angles [degree]; shape (samples,)
    pressures: dict[str, Floats]  # Pressures at the ascending angles; shape (samples,)
    rolls_over: float  # Degrees after which the angle in the file begins again; 0 if it does not
    backward: bool  # Whether the angle was counted backward


def crank_angles(
    recording: Recording, angle: Floats, pressures: dict[str, Floats], period: float,
    options: PressureOptions, said: list[str],
) -> CrankAngles:  # fmt: skip
    """Put samples in the order of the crank angle, whatever range and direction the file has.

    Angles and `period` are in degree; pressures have the shape (samples,), (cycles, samples) or
    (samples, cycles). Remarks are added to `said`. SceneError refuses lengths that do not fit, and
    angles that neither rise nor fall.
    """
    flat, angles = {}, angle
    for name, values in pressures.items():
        angles, flat[name] = _in_one_column(recording, name, values, angle, period)
    if np.abs(angles).max() > MOST_ANGLE:
        raise SceneError(f"{recording.label}: has crank angles beyond {MOST_ANGLE:g} degree")
    steps = np.diff(angles)
    usual = float(np.median(steps)) if len(steps) else 0.0
    if usual == 0.0:
        raise SceneError(
            f"{recording.label}: the crank angle does not rise; is this the right column?"
        )
    falls = usual < 0.0
    if falls:
        said.append("angles fall from row to row")
        angles = -angles
    rising, rolls_over = unwrapped(angles, period, recording)
    if rolls_over:  # A sample at the end of a cycle that is also the first of the next is dropped
        kept = np.append((np.diff(rising) > SAME) | (np.diff(angles) > -SAME), True)
        rising = rising[kept]
        flat = {name: values[kept] for name, values in flat.items()}
    several = rising[-1] - rising[0] > period * 1.01
    backward = options.direction == "backward" or (falls and several and options.direction is None)
    if backward:
        said.append(COUNTED_BACKWARD)
    if falls != backward:  # The crank passes the rows of the file in reverse order
        rising = -rising[::-1]
        flat = {name: values[::-1] for name, values in flat.items()}
    return CrankAngles(rising, flat, rolls_over, backward)


def _in_one_column(
    recording: Recording, name: str, values: Floats, angle: Floats, period: float
) -> tuple[Floats, Floats]:
    """Angles and pressures of all cycles, one after the other."""
    count = len(angle)
    if values.ndim == 1:
        if len(values) != count:
            raise SceneError(
                f"{recording.where(name)}: {len(values)} samples, the angle has {count}"
            )
        return angle, values
    if count not in values.shape:
        raise SceneError(
            f"{recording.label}, '{one_line(name, 60)}': {values.shape[0]} by {values.shape[1]}; "
            f"one of them must be the number of angles, {count}"
        )
    rows = values if values.shape[1] == count else values.T
    if len(rows) == 1:
        return angle, rows[0]
    span = float(angle[-1] - angle[0])
    if abs(abs(span) - period) < SAME:  # The last sample is dropped: it is the next cycle's first
        angle, rows = angle[:-1], rows[:, :-1]
    if angle[0] == angle[-1]:
        raise SceneError(f"{recording.label}: the crank angle does not rise")
    turn = np.copysign(period, angle[-1] - angle[0])
    angles = angle[None, :] + turn * np.arange(len(rows))[:, None]
    return angles.reshape(-1), rows.reshape(-1)


def unwrapped(angles: Floats, period: float, recording: Recording) -> tuple[Floats, float]:
    """Angles that rise on and on, and after how many degrees the given ones began again."""
    steps = np.diff(angles)
    usual = float(np.median(steps))
    back = np.flatnonzero(steps < -max(0.5 * float(np.ptp(angles)), 10.0 * usual))
    rolls_over = 0.0
    if len(back):
        span = float(angles.max() - angles.min())
        rolls_over = 360.0 * round((span + usual) / 360.0)
        if rolls_over not in (360.0, 720.0) or rolls_over > period:
            at = int(back[0])
            raise SceneError(
                f"{recording.at(at + 1)}: the crank angle goes from {angles[at]:g} to "
                f"{angles[at + 1]:g}; must rise or fall within a cycle of {period:g} degree"
            )
        turns = np.zeros(len(angles))
        turns[back + 1] = rolls_over
        angles = angles + np.cumsum(turns)
        steps = np.diff(angles)
    wrong = np.flatnonzero(steps < -SAME)
    if len(wrong):
        at = int(wrong[0])
        raise SceneError(
            f"{recording.at(at + 1)}: the crank angle goes from {angles[at]:g} to "
            f"{angles[at + 1]:g}; must rise or fall within a cycle"
        )
    return np.asarray(angles), rolls_over


def work_sign(angle: Floats, pressure: Floats) -> float:
    """Work of a recording over the area of its absolute value: from -1 to 1, above 0 of engines.

    `angle` [degree] counts from top dead centre; the sine stands for the piston's speed.
    """
    weights = np.gradient(angle)
    speed = np.sin(angle * DEGREE)
    above = pressure - pressure.min()
    area = float((above * np.abs(speed) * weights).sum())
    return float((above * speed * weights).sum()) / area if area > 0.0 else 0.0


def is_half_a_cycle_late(angle: Floats, pressure: Floats, period: float) -> tuple[bool, float]:
    """Whether the largest pressure lies near the other dead centre, and where it lies, in degree.

    The other dead centre of a four-stroke cycle, of 720 degrees, is 360 degrees away.
    """
    inside = wrapped(angle, period)
    places = np.floor(inside).astype(np.int64)
    places -= places.min()
    counts = np.bincount(places)
    means = np.bincount(places, weights=pressure) / np.maximum(counts, 1)
    means[counts == 0] = -np.inf
    peak = float(np.argmax(means)) + np.floor(inside.min())
    return abs(peak) > 0.25 * period, peak


def cut_into_cycles(
    recording: Recording, angle: Floats, pressure: Floats, period: float, name: str,
    step: float | None, said: list[str], *, regular: bool = True,
) -> RecordedCycles:  # fmt: skip
    """Cut a signal into cycles, at dead centres of gas exchange where there is a whole one.

    Samples of two cycles are never mixed: what is left of a whole number of cycles is left out.
    Angles, `period` and `step` are in degree; angles rise over all cycles, and 0 is a firing dead
    centre. Cycles that differ are interpolated onto a grid of `step`, or of the usual step. If
    `regular`, a step much longer than those beside it is a gap, otherwise only one of more than
    `LONGEST`; SceneError refuses gaps and less than a cycle. Remarks are added to `said`.
    """
    which = f"'{one_line(name, 60)}'"
    where = f"{recording.label}, {which}"
    usual = float(np.median(np.diff(angle)))
    span = float(angle[-1] - angle[0])
    if regular and span + usual < period - max(5.0, 3.0 * usual):
        two_stroke = ", or 360 of a two-stroke engine" if period > 360.0 else ""
        raise SceneError(
            f"{where}: covers {span + usual:.6g} degree; must be a whole cycle of {period:g} "
            f"degree{two_stroke}"
        )
    number = np.floor(np.round((angle + 0.5 * period) / SAME) * SAME / period).astype(np.int64)
    inside: Floats = np.asarray(np.round(angle - number * period, 7), np.float64)
    # A cycle is whole if the recording reaches its ends within less than a step.
    margin = usual if regular else 0.5 * LONGEST
    first = int(np.ceil((angle[0] - margin + SAME) / period + 0.5))
    last = int(np.floor((angle[-1] + margin + SAME) / period + 0.5))
    if span < period + SAME:
        left = 0.0, 0.0
        cycles = [_one_cycle(inside, pressure, period, where)]
    elif first == last:
        begin = _begins_elsewhere(angle, inside, period)
        end = int(np.searchsorted(angle, angle[begin] + period - SAME))
        left = angle[begin] - angle[0], angle[-1] - angle[begin] - period + usual
        if 0.5 * period - abs(inside[begin]) > margin:
            ends = "dead centres of gas exchange" if period > 360.0 else "bottom dead centres"
            reason = f"no whole cycle between {ends}; one is cut at {inside[begin]:.6g} degree"
            said.append(f"{which}: {reason}")
        rising = begin + np.argsort(inside[begin:end], kind="stable")
        cycles = [(inside[rising], pressure[rising])]
    else:
        edges = pairwise(np.searchsorted(number, np.arange(first, last + 1)))
        cycles = [(inside[low:high], pressure[low:high]) for low, high in edges]
        left = (first - 0.5) * period - angle[0], angle[-1] - (last - 0.5) * period + usual
    for part, degrees in zip(("first", "last"), left, strict=True):
        if degrees > 1.5 * usual:  # A single missing sample at an end is not reported
            said.append(f"{which}: the {part} {degrees:.4g} degree are no whole cycle and left out")
    grids = [grid for grid, _ in cycles]
    if regular:
        for place, grid in enumerate(grids, start=1):
            _check_gaps(grid, period, f"{where}, cycle {place}" if len(grids) > 1 else where)
    lengths = np.array([len(grid) for grid in grids])
    if np.ptp(lengths) == 0:
        spread = float(np.abs(np.array(grids) - grids[0]).max())
        if spread < 0.01 * usual:
            return _recorded(grids[0], np.array([values for _, values in cycles]), period)
    count = round(period / (usual if step is None else step))
    even: Floats = np.linspace(-0.5 * period, 0.5 * period, count, endpoint=False)
    rows = [np.interp(even + k * period, angle, pressure) for k in range(first, last)]
    some = " to ".join(dict.fromkeys((str(lengths.min()), str(lengths.max()))))
    said.append(
        f"{which}: cycles of {some} samples at different angles interpolated onto one grid of "
        f"{count}"
    )
    return _recorded(even, np.array(rows), period)


def _begins_elsewhere(angle: Floats, inside: Floats, period: float) -> int:
    """First sample of a cycle that ends or begins with the recording."""
    # Of the first and the last cycle, the one that is cut nearer to the dead centre of gas exchange
    # is chosen: there a difference of pressure between its two ends does the least harm.
    from_end = int(np.searchsorted(angle, angle[-1] - period + SAME))
    return 0 if abs(inside[0]) >= abs(inside[from_end]) else from_end


def _recorded(angle: Floats, pressure: Floats, period: float) -> RecordedCycles:
    return RecordedCycles(angle * DEGREE, pressure, period * DEGREE)


def _one_cycle(
    inside: Floats, pressure: Floats, period: float, where: str
) -> tuple[Floats, Floats]:
    """One cycle in the order of its angles; samples at one angle (both ends) are averaged."""
    order = np.argsort(inside, kind="stable")
    inside, pressure = inside[order], pressure[order]
    same = np.flatnonzero(np.diff(inside) < SAME)
    highest = float(np.abs(pressure).max())
    for at in same:
        difference = abs(float(pressure[at + 1] - pressure[at]))
        if difference > 0.02 * highest:
            raise SceneError(
                f"{where}: two pressures at {inside[at]:g} degree differ by "
                f"{100.0 * difference / highest:.1f} % of the largest; must be the same within 2 %"
            )
    if len(same):
        pressure = pressure.copy()
        pressure[same] = 0.5 * (pressure[same] + pressure[same + 1])
        keep = np.ones(len(inside), dtype=bool)
        keep[same + 1] = False
        inside, pressure = inside[keep], pressure[keep]
    return inside, pressure


def _check_gaps(angle: Floats, period: float, where: str) -> None:
    """Refuse a cycle with a gap: a step much longer than those on both its sides."""
    if len(angle) < 8:
        raise SceneError(f"{where}: {counted(len(angle), 'sample')}; must be 8 at least")
    steps = np.diff(angle, append=angle[0] + period)
    beside = np.maximum(np.roll(steps, 1), np.roll(steps, -1))
    gap = np.flatnonzero(steps > 2.5 * beside)
    if len(gap):
        at = int(gap[0])
        raise SceneError(
            f"{where}: no samples between {angle[at]:g} and {angle[at] + steps[at]:g} degree "
            f"(steps beside it: {beside[at]:g}); must have no gaps"
        )
    if not np.all(steps > 0.0):
        at = int(np.argmin(steps))
        raise SceneError(f"{where}: the angle {angle[at]:g} degree occurs twice")


MOST_REMARKS = 8  # Largest number of remarks on the signal of the wheel that are reported


def with_encoder_angles(
    recording: Recording, options: PressureOptions, degrees: float, said: list[str]
) -> tuple[Recording, PressureOptions, Floats]:
    """Find the crank angle of samples between the teeth of a wheel; `degrees` make a cycle.

    Returned are the other columns of the samples in whole turns, options with columns of pressure
    by their names (numbers count the columns of the file), and the angle [rad], counted on from
    turn to turn. SceneError refuses missing keys, times that are not even, and a signal without the
    pattern.
    """
    if options.encoder_column is None or options.wheel is None:
        raise SceneError(f"{recording.label}: encoder_column and wheel: give both or neither")
    encoder = named_column(recording, options.encoder_column, "encoder_column")
    signal = recording.numbers(encoder)
    used = {encoder}
    timed = _time_column(recording, options, encoder, said)
    if options.sample_rate is not None:
        interval = 1.0 / options.sample_rate
    elif timed is not None:
        interval = _interval(recording, timed)
    else:
        raise SceneError(f"{recording.label}: encoder_column: needs time_column or sample_rate")
    if timed is not None:
        used.add(timed)
    try:
        wheel = wheel_from_text(options.wheel)
        passed = teeth_of_signal(
            signal, interval, wheel, threshold=options.threshold, hysteresis=options.hysteresis,
            edge=options.edge,
        )  # fmt: skip
    except ValueError as error:
        raise SceneError(f"{recording.label}: {mentioned(error)}") from None
    teeth, gap = passed.teeth, options.gap_angle
    if options.mark_column is not None:
        mark = named_column(recording, options.mark_column, "mark_column")
        used.add(mark)
        try:
            marked = teeth_from_mark(
                teeth, passed.crossings.time * interval,
                mark_times(recording.numbers(mark), interval), options.mark_angle * DEGREE,
                round(degrees / 360.0),
            )  # fmt: skip
        except ValueError as error:
            raise SceneError(f"{recording.where(mark)}: {error}") from None
        teeth, gap = marked.teeth, round(marked.angle / DEGREE, 6)
        how = "once a cycle" if marked.turn_known else "once a revolution"
        said.append(f"the mark in column '{one_line(mark, 60)}' passes {how}")
    which = _first_tooth(passed, wheel, options.mark_column is not None)
    if gap is None:
        raise SceneError(
            f"{recording.label}: gap_angle: missing; must be the crank angle in degree at which "
            f"{which} passes, from a drawing or measured on the engine; or give mark_column, or "
            "read a motored recording with gap_angle = 0 and use the negative of the angle of its "
            "largest pressure, minus the thermodynamic loss angle (usually 0.4 to 1 degree)"
        )
    times: Floats = np.asarray(interval * np.arange(len(signal)), np.float64)
    angle = teeth.angle_at(times, gap * DEGREE)
    inside = np.isfinite(angle)
    said.append(
        f"crank angle from the wheel {wheel.text}: {len(teeth.turn)} turns, {which} at "
        f"{gap:.6g} degree"
    )
    if options.edge is None and options.mark_column is None:
        said.append(
            f"the {passed.crossings.edge} edge was chosen, because its intervals repeat best; if "
            "gap_angle refers to the other edge, one tooth width away, give edge"
        )
    said += [f"signal of the wheel: {remark}" for remark in passed.remarks[:MOST_REMARKS]]
    rest = {
        name: replace(column, values=column.values[inside])
        for name, column in recording.columns.items()
        if name not in used and column.values.shape == signal.shape
    }
    options = options.model_copy(update={"pressure_column": wanted_pressures(recording, options)})
    return replace(recording, columns=rest), options, angle[inside]


def _first_tooth(passed: EncoderSignal, wheel: Wheel, marked: bool) -> str:
    """Words for the edge from which the angle of the wheel counts."""
    place = "after the longest gap"
    if marked and (wheel.even or wheel.symmetry > 1):
        place = "at the mark"
    elif wheel.even:
        place = "of the recording"
    elif wheel.symmetry > 1:
        place = "after the first gap of the recording"
    return f"the {passed.crossings.edge} edge of the first tooth {place}"


def _time_column(
    recording: Recording, options: PressureOptions, encoder: str, said: list[str]
) -> str | None:
    """Name of the column of times: as given, or the only one with a usual name."""
    if options.time_column is not None:
        return named_column(recording, options.time_column, "time_column")
    good = [
        name for name, column in recording.columns.items()
        if name != encoder and is_time_name(name)
        and stated_unit(column.unit, name, SECONDS) in SECONDS
    ]  # fmt: skip
    if len(good) != 1:
        return None
    if options.sample_rate is None:
        said.append(f"column '{good[0]}' taken as the time")
    return good[0]


def _interval(recording: Recording, name: str) -> float:
    """Time between samples [s]."""
    times = recording.numbers(name)
    scale = SECONDS.get(stated_unit(recording.columns[name].unit, name, SECONDS), 1.0)
    count = len(times) - 1
    interval = float(times[-1] - times[0]) / max(count, 1)
    if count < 8 or interval <= 0.0 or np.ptp(np.diff(times)) > 0.5 * interval:
        raise SceneError(
            f"{recording.label}, column '{name}': times must rise in even steps; is this the "
            "right column?"
        )
    return interval * scale
