"""Recordings of the speed as arrays: which column is which, units, teeth, cycles."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from engine_dyn.geometry.toothed_wheel import TURN
from engine_dyn.recordings.encoder import (
    EncoderSignal,
    mark_times,
    risen,
    teeth_from_mark,
    teeth_of_signal,
)
from engine_dyn.recordings.teeth import PassedTeeth, find_turns
from engine_dyn.types import Floats
from engine_dyn.units import DEGREE, RPM
from sweeps.base.columns.options import ReadingChoices
from sweeps.base.columns.recording import Recording, read_recording
from sweeps.base.columns.units import ANGLES, SECONDS, is_time_name, stated_unit
from sweeps.base.errors import SceneError, not_known, one_line, shown
from sweeps.lab.pressure.cycles_of_signals import SAME, unwrapped
from sweeps.scene.features.measured import Measured, MeasuredTable

TURNING_BACK = 0.3
"""Share of steps that do not ascend, from which times of teeth are certainly intervals. A smaller
share, as large as a gap in every second turn makes it, counts if they fit the wheel."""


FEWEST = 12  # Smallest number of samples of a cycle of speed over angle


@dataclass(frozen=True, eq=False)
class SpeedRecord:
    """One recording of the speed."""

    # The file as the scene names it, and the hash of its bytes.
    label: str
    sha256: str
    teeth: PassedTeeth | None  # Turns of the wheel; None for speed over angle
    # Uniform angles [rad] from -period/2 without the end, for speed over angle; shape (n,)
    angle: Floats | None
    cycles: Floats | None  # Speeds at the uniform angles [rad/s]; shape (cycles, n)
    remarks: tuple[str, ...]  # Remarks on the recording, a line each
    # Crank angle of the first tooth [rad], where the scene or a mark gives it.
    gap: float | None = None
    turn_known: bool = False  # Whether a mark once a cycle tells with which turn cycles begin


def records_of(measured: Measured, period: float, name: str) -> list[SpeedRecord]:
    """Read all recordings that a scene names; the cycle has an angle of `period` [rad].

    SceneError, in one line: a file that cannot be read, a column that is not clear, a signal in
    which the wheel is not found, with what was seen in it.
    """
    if measured.table.kind == "encoder":
        return _signals(measured, period, name)
    return [
        _record(measured, place, period, f"{name}: [measured] {file}")
        for place, file in enumerate(measured.files)
    ]


def _recording(measured: Measured, path: Path, where: str) -> Recording:
    keys = {key: getattr(measured.table, key) for key in ReadingChoices.model_fields}
    recording = read_recording(path, where, ReadingChoices(**keys))
    return replace(recording, remarks=(*recording.said, *recording.remarks))


def _record(measured: Measured, place: int, period: float, where: str) -> SpeedRecord:
    """A recording of speed over angle, or of times of teeth."""
    table, file = measured.table, measured.files[place]
    recording = _recording(measured, measured.paths[place], where)
    try:
        if table.kind == "speed":
            angle, cycles, remarks = _speed_over_angle(recording, table, period)
            remarks = (*recording.remarks, *remarks)
            return SpeedRecord(file, recording.sha256, None, angle, cycles, remarks)
        assert measured.wheel is not None
        column = _column(recording, table.column, "column", ("time",))
        stated = _flat(recording, column)
        times = stated * _factor(recording, table.column, ("time",), table.unit, SECONDS, "time")
        said: tuple[str, ...] = ()
        back = np.flatnonzero(np.diff(times) <= 0.0) + 1
        share = back.size / max(times.size, 1)
        if _are_intervals(times, measured.wheel.teeth, share):
            times, stretch = _longest_stretch(times, recording)
            times = np.concatenate([[0.0], np.cumsum(times)])
            said = ("the values do not ascend and are taken as intervals between the teeth",)
            said += stretch
        try:
            teeth = find_turns(times, measured.wheel, measured.first[place])
        except ValueError:
            if not said or share >= TURNING_BACK:
                raise
            before, here = stated[back[0] - 1], stated[back[0]]
            raise SceneError(
                f"{where}, column {shown(column)}, {recording.place(int(back[0]))}: {here:.9g} "
                f"after {before:.9g}; times must ascend (does their counter begin again?), and as "
                "intervals the values do not fit the wheel"
            ) from None
        remarks = (*recording.remarks, *said, *teeth.faults)
        return SpeedRecord(file, recording.sha256, teeth, None, None, remarks, _given_gap(table))
    except SceneError:
        raise
    except ValueError as error:
        raise SceneError(f"{where}: {error}") from None


def _longest_stretch(intervals: Floats, recording: Recording) -> tuple[Floats, tuple[str, ...]]:
    """The most intervals between two marks, where unknown time passes, and a remark."""
    longest = max(np.split(intervals, recording.marks), key=len)
    if len(longest) == len(intervals):
        return intervals, ()
    return longest, (
        f"of {len(intervals)} intervals, the {len(longest)} of the longest stretch without a line "
        "MARK are used: at a mark, time passes that is not logged",
    )


def _are_intervals(times: Floats, teeth: int, share: float) -> bool:
    """Whether positive numbers go back too often for times with a few faults."""
    positive = times.size > teeth and bool(times.min() > 0.0)
    return positive and share >= min(TURNING_BACK, 0.5 / teeth)


def _signals(measured: Measured, period: float, name: str) -> list[SpeedRecord]:
    """Recordings of a sensor, all with one edge and one threshold, in parts of the swing."""
    # The threshold changes where a tooth seems to pass: with a threshold for each recording, the
    # errors of the wheel would differ between recordings.
    table, wheel = measured.table, measured.wheel
    assert wheel is not None
    read, events = [], []
    for path, file, first in zip(measured.paths, measured.files, measured.first, strict=True):
        where = f"{name}: [measured] {file}"
        recording = _recording(measured, path, where)
        signal, interval = _signal(recording, table)
        if not isinstance(interval, float):
            events.append((file, recording, signal, interval))
            continue
        try:
            encoder = teeth_of_signal(
                signal, interval, wheel, threshold=table.threshold, hysteresis=table.hysteresis,
                edge=table.edge, first=first,
            )  # fmt: skip
        except ValueError as error:
            raise SceneError(f"{where}: {error}") from None
        read.append((file, recording, signal, interval, encoder))
    if events and read:
        raise SceneError(
            f"{name}: [measured] {events[0][0]} has levels at their changes, {read[0][0]} samples; "
            "all files must have the same"
        )
    if events:
        return _logs(measured, events, period, name)
    chosen = [(_height(one[-1]), one[-1].crossings.edge) for one in read]
    best = [one[-1] for one in read]
    if len({(round(height, 6), edge) for height, edge in chosen}) > 1:
        merits = []
        for height, edge in chosen:
            again = []
            for (_, _, signal, interval, encoder), first in zip(read, measured.first, strict=True):
                threshold = encoder.low + height * (encoder.high - encoder.low)
                try:
                    again.append(
                        teeth_of_signal(signal, interval, wheel, threshold=threshold, edge=edge,
                                        hysteresis=table.hysteresis, first=first)
                    )  # fmt: skip
                except ValueError:
                    break
            if len(again) == len(read):
                lost = sum(len(one.teeth.turn) for one in best) - sum(
                    len(one.teeth.turn) for one in again
                )
                merits.append(
                    (max(lost - len(read), 0), sum(o.teeth.scatter for o in again), again)
                )
        if merits:
            best = min(merits, key=lambda merit: merit[:2])[2]
    records = []
    for (file, recording, _, interval, _), encoder in zip(read, best, strict=True):
        remarks = (*recording.remarks, *encoder.remarks)
        record = SpeedRecord(file, recording.sha256, encoder.teeth, None, None, remarks)
        time = encoder.crossings.time * interval
        records.append(_marked(record, recording, table, time, interval, period))
    return records


def _logs(
    measured: Measured, events: Sequence[tuple[str, Recording, Floats, Floats]], period: float,
    name: str,
) -> list[SpeedRecord]:  # fmt: skip
    """Logs of levels, all with the edge that loses the fewest turns and repeats best."""
    table, wheel = measured.table, measured.wheel
    assert wheel is not None
    for key in ("threshold", "hysteresis"):
        if getattr(table, key) is not None:
            raise SceneError(
                f"{name}: [measured] {key}: has no effect on {events[0][0]}, which has levels at "
                "their changes"
            )
    tried: list[tuple[int, float, str, list[tuple[Floats, PassedTeeth]]]] = []
    refusal = ""
    for edge in ("rising", "falling") if table.edge is None else (table.edge,):
        logs, turns, scatter = [], 0, 0.0
        for (file, _, level, time), first in zip(events, measured.first, strict=True):
            pulses = risen(time, level, edge)
            try:
                teeth = find_turns(pulses, wheel, first)
            except ValueError as error:
                refusal = refusal or f"{name}: [measured] {file}: {error}"
                break
            turns, scatter = turns + len(teeth.turn), scatter + teeth.scatter
            logs.append((pulses, teeth))
        else:
            tried.append((turns, scatter, edge, logs))
    if not tried:
        raise SceneError(refusal)
    # An edge may lose a turn at an end of each log and still count as good.
    most = max(turns for turns, *_ in tried)
    good = [one for one in tried if one[0] >= most - len(events)]
    *_, edge, best = min(good, key=lambda one: one[1])
    said = f"the level is logged at its changes; the {edge} edge is used"
    records = []
    for (file, recording, _, time), (pulses, teeth) in zip(events, best, strict=True):
        remarks = (*recording.remarks, said, *teeth.faults)
        record = SpeedRecord(file, recording.sha256, teeth, None, None, remarks)
        records.append(_marked(record, recording, table, pulses, time, period))
    return records


def _given_gap(table: MeasuredTable) -> float | None:
    return None if table.gap_angle is None else table.gap_angle * DEGREE


def _marked(
    record: SpeedRecord, recording: Recording, table: MeasuredTable, pulses: Floats,
    time: float | Floats, period: float,
) -> SpeedRecord:  # fmt: skip
    """The record with its teeth counted from the mark of another column, where one is given.

    `time` is the time between samples, or the times at which the level changes.
    """
    if table.mark_column is None:
        return replace(record, gap=_given_gap(table))
    assert record.teeth is not None
    name = _column(recording, table.mark_column, "mark_column")
    level = _flat(recording, name)
    marks = mark_times(level, time) if isinstance(time, float) else risen(time, level)
    try:
        teeth = teeth_from_mark(
            record.teeth, pulses, marks, table.mark_angle * DEGREE, round(period / TURN)
        )
    except ValueError as error:
        raise SceneError(f"{recording.label}, column {shown(name)}: {error}") from None
    how = "once a cycle" if teeth.turn_known else "once a revolution"
    said = (
        f"the mark in {shown(name)} passes {how}: the first tooth passes at "
        f"{round(teeth.angle / DEGREE, 6):.4g} degrees"
    )
    return replace(
        record, teeth=teeth.teeth, gap=teeth.angle, turn_known=teeth.turn_known,
        remarks=(*record.remarks, said),
    )  # fmt: skip


def _height(signal: EncoderSignal) -> float:
    """Threshold as a fraction of the swing."""
    return (signal.crossings.threshold - signal.low) / (signal.high - signal.low)


def _column(
    recording: Recording, wanted: str | int | None, key: str, words: tuple[str, ...] = (),
    without: Sequence[str] = (),
) -> str:  # fmt: skip
    """Name of a column: as given, or the only one with a usual name."""
    names = list(recording.columns)
    if isinstance(wanted, int) and not isinstance(wanted, bool):
        if not 1 <= wanted <= len(names):
            raise SceneError(
                f"{recording.label}: {key} = {wanted}; must be 1 to {len(names)}, or a name"
            )
        return names[wanted - 1]
    if wanted is not None:
        if wanted not in names:
            raise SceneError(
                f"{recording.label}: {key} = {shown(wanted)}: no such column"
                f"{not_known(str(wanted), names)}"
            )
        return str(wanted)
    left = [n for n in names if n not in without]
    named = [n for n in left if any(word in n.lower() for word in words)]
    times = [n for n in left if is_time_name(n)] if "time" in words else []
    named = times if len(times) == 1 else named
    if len(named) == 1:
        return named[0]
    if len(left) == 1:
        return left[0]
    listed = ", ".join(f"{i} {one_line(n, 40)}" for i, n in enumerate(names[:12], start=1))
    over_time = ""
    if key == "angle_column" and any(map(is_time_name, left)):
        over_time = "; of a speed over time, time_column in its place"
    raise SceneError(
        f"{recording.label}: {key}: ambiguous; give the name or number of one of these columns: "
        f"{listed}{over_time}"
    )


def _flat(recording: Recording, name: str) -> Floats:
    values = recording.numbers(name)
    if values.ndim != 1:
        raise SceneError(f"{recording.label}, column {shown(name)}: must be one row of values")
    return values


def _factor(
    recording: Recording, wanted: str | int | None, words: tuple[str, ...], unit: str | None,
    units: Mapping[str, float], what: str,
) -> float:  # fmt: skip
    """SI value of the given unit, or of the one that the file states for the column."""
    name = _column(recording, wanted, "column", words)
    text = recording.columns[name].unit if unit is None else unit
    plain = stated_unit(text, name, units)
    if plain not in units:
        known = ", ".join(key for key in units if key)
        raise SceneError(
            f"{recording.label}, column {shown(name)}: unit {shown(text)} is not a unit of "
            f"{what}; must be one of {known}"
        )
    return units[plain]


def _signal(recording: Recording, table: MeasuredTable) -> tuple[Floats, float | Floats]:
    """Samples of the signal and the time between them; the times of changes of a log of levels."""
    time_name = None
    if table.sample_rate is None:
        time_name = _time_column(recording, table)
    others = [] if time_name is None else [time_name]
    if table.mark_column is not None:
        others.append(_column(recording, table.mark_column, "mark_column"))
    column = _column(recording, table.column, "column", ("encoder",), others)
    if column == time_name:
        raise SceneError(f"{recording.label}: column {shown(column)} is the time of the samples")
    signal = _flat(recording, column)
    if time_name is None:
        assert table.sample_rate is not None
        _check_rate(recording, table.sample_rate, column)
        return signal, 1.0 / table.sample_rate
    time = _flat(recording, time_name)
    time = time * _factor(recording, time_name, (), table.unit, SECONDS, "time")
    if time.size < 2 or not time[-1] > time[0]:
        raise SceneError(f"{recording.label}, column {shown(time_name)}: does not ascend")
    interval = float(time[-1] - time[0]) / (time.size - 1)
    changes = np.count_nonzero(np.diff(signal)) / (time.size - 1)
    off = np.abs(time - time[0] - interval * np.arange(time.size))
    # Even samples lie within half an interval of their places.
    uneven = off.max() > 0.5 * interval
    two_levels = bool(np.isin(signal, (signal.min(), signal.max())).all())
    # Rows of two levels at even times are changes of the level, not samples, if nearly every row
    # changes the level: even with three samples from tooth to tooth, a third of them do not.
    if two_levels and changes > (0.0 if uneven else 0.95):
        return signal, time
    if uneven:
        place = int(np.argmax(np.abs(np.diff(time) - interval))) + 1
        raise SceneError(
            f"{recording.label}, column {shown(time_name)}, {recording.place(place)}: "
            f"{time[place] - time[place - 1]:.6g} s after the sample before, others {interval:.6g} "
            "s; must be samples equally far apart, or two levels at their changes"
        )
    return signal, interval


def _check_rate(recording: Recording, rate: float, column: str) -> None:
    """Refuse a sample rate that differs from that of the times in the file."""
    for name in (name for name in recording.columns if name != column and is_time_name(name)):
        time = _flat(recording, name) * _factor(recording, name, (), None, SECONDS, "time")
        stated = (time.size - 1) / float(np.ptp(time)) if np.ptp(time) > 0.0 else rate
        # The given sample rate and that of the times may differ by one percent.
        if abs(rate / stated - 1.0) > 0.01:
            raise SceneError(
                f"{recording.label}, column {shown(name)}: has {stated:.6g} samples per second; "
                f"sample_rate = {rate:g} must be left out or the same"
            )


def _time_column(recording: Recording, table: MeasuredTable) -> str:
    """Name of the column of times: as given, as usual, or the only one that ascends throughout."""
    if table.time_column is not None:
        return _column(recording, table.time_column, "time_column")
    named = [n for n in recording.columns if is_time_name(n)]
    if len(named) == 1:
        return named[0]
    rising = [
        name
        for name, column in recording.columns.items()
        if column.values.ndim == 1 and column.values.size > 1 and np.all(np.diff(column.values) > 0)
    ]
    if len(rising) == 1:
        return rising[0]
    raise SceneError(
        f"{recording.label}: time_column: not clear which column is the time of the samples; name "
        "it, or give sample_rate"
    )


def _speed_over_angle(
    recording: Recording, table: MeasuredTable, period: float
) -> tuple[Floats, Floats, tuple[str, ...]]:
    """Cycles of speed on uniform angles from -period/2; angles may count on over many cycles.

    Of a speed over time, the angles are its integral from the first sample on.
    """
    over_time = table.time_column is not None
    of_angle = ("angle", "crank", "°", "deg", "winkel", "角", "угол")
    angle_name = _column(
        recording, table.time_column if over_time else table.angle_column,
        "time_column" if over_time else "angle_column", of_angle,
    )  # fmt: skip
    of_speed = (
        "speed", "rpm", "omega", "drehzahl", "转速", "轉速", "回転", "оборот", "скорость",
        "частота",
    )  # fmt: skip
    column = _column(recording, table.column, "column", of_speed, (angle_name,))
    angle = _flat(recording, angle_name)
    angle_units = {"": DEGREE, **{unit: size * DEGREE for unit, size in ANGLES.items()}, "rad": 1.0}
    over, what = (SECONDS, "time") if over_time else (angle_units, "angle")
    angle = angle * _factor(recording, angle_name, (), None, over, what)
    units = {"": RPM, "rpm": RPM, "1/min": RPM, "min-1": RPM, "min^-1": RPM, "u/min": RPM,
             "r/min": RPM, "rad/s": 1.0, "rad s-1": 1.0, "1/s": TURN, "hz": TURN,
             "deg/s": DEGREE}  # fmt: skip
    speed = recording.numbers(column) * _factor(recording, column, (), table.unit, units, "speed")
    if speed.shape[-1] != angle.size:
        raise SceneError(
            f"{recording.label}: {angle.size} angles, {speed.shape[-1]} speeds in a cycle"
        )
    if over_time:
        angle = _integrated(recording, angle_name, angle, speed)
    angle = angle + table.angle_shift * DEGREE
    if angle.size > 1 and np.median(np.diff(angle)) < 0.0:
        angle, speed = angle[::-1], speed[..., ::-1]
    several = angle.size > 1
    degrees = angle / DEGREE
    running, again = degrees, 0.0
    if several and not over_time:
        running, again = unwrapped(degrees, period / DEGREE, recording)
    if 0.0 < again < period / DEGREE - 1.0:
        raise SceneError(
            f"{recording.label}, column {shown(angle_name)}: begins again after {again:g} degrees; "
            f"must run over the cycle of {period / DEGREE:g}, or on over many cycles"
        )
    if again and speed.ndim == 1:  # An end of a cycle that is also the next one's first is dropped
        kept = np.append(np.diff(running) > SAME, True)
        running, speed = running[kept], speed[kept]
    angle = running * DEGREE
    if np.any(np.diff(angle) <= 0.0):
        place = int(np.flatnonzero(np.diff(angle) <= 0.0)[0]) + 1
        raise SceneError(
            f"{recording.label}, column {shown(angle_name)}, {recording.place(place)}: angles must "
            "ascend throughout (over many cycles they run on), or descend throughout"
        )
    if not np.all(speed > 0.0):
        place = int(np.argwhere(~(speed > 0.0))[0][-1])
        raise SceneError(
            f"{recording.label}, column {shown(column)}, {recording.place(place)}: a speed must be "
            "more than 0"
        )
    step = float(np.median(np.diff(angle))) if angle.size > 1 else period
    count = round(period / step)
    if count < FEWEST or angle[-1] - angle[0] < period - 1.5 * step:
        raise SceneError(
            f"{recording.label}: angles span {(angle[-1] - angle[0]) / DEGREE:.6g} degrees in "
            f"steps of {step / DEGREE:.4g}; must span a cycle of {period / DEGREE:g}, with "
            f"{FEWEST} steps or more"
        )
    grid: Floats = -0.5 * period + period / count * np.arange(count, dtype=np.float64)
    if speed.ndim == 2:
        return grid, np.array([np.interp(grid, angle, one, period=period) for one in speed]), ()
    # Only a recording of one cycle is closed on itself; a series of cycles is cut into whole ones
    if angle[-1] - angle[0] < period + 1.5 * step:
        return grid, np.interp(grid, angle, speed, period=period)[None, :], ()
    first = np.ceil((angle[0] + 0.5 * period) / period - 1e-9)
    whole = int(np.floor((angle[-1] + step * 1.01 - grid[0]) / period - first + 1e-9))
    if whole < 1:
        return grid, np.interp(grid, angle, speed, period=period)[None, :], ()
    return grid, np.interp(grid + period * (first + np.arange(whole)[:, None]), angle, speed), ()


def _integrated(recording: Recording, name: str, time: Floats, speed: Floats) -> Floats:
    """Angle over the time [rad], by trapezia of the speed, from 0."""
    back = np.flatnonzero(np.diff(time) <= 0.0)
    if back.size or speed.ndim != 1:
        place = recording.place(int(back[0]) + 1) if back.size else "speeds"
        raise SceneError(
            f"{recording.label}, column {shown(name)}, {place}: times must ascend throughout, with "
            "one speed each"
        )
    steps = 0.5 * (speed[1:] + speed[:-1]) * np.diff(time)
    return np.concatenate([[0.0], np.cumsum(steps)])
