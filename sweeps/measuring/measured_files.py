"""Recordings of the speed as arrays: which column is which, units, teeth, cycles."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from engine_dyn.recordings.encoder import EncoderSignal, risen, teeth_of_signal
from engine_dyn.recordings.teeth import PassedTeeth, find_turns
from engine_dyn.recordings.wheel import TURN
from engine_dyn.types import Floats
from engine_dyn.units import DEGREE, RPM
from sweeps.errors import SceneError, not_known, one_line, shown
from sweeps.reading.laboratory.reading_choices import ReadingChoices
from sweeps.reading.laboratory.recording import Recording, read_recording
from sweeps.scene.measured import Measured, MeasuredTable

__all__ = ["SpeedRecord", "records_of"]

TIME = {"": 1.0, "s": 1.0, "sec": 1.0, "seconds": 1.0, "ms": 1e-3, "us": 1e-6, "µs": 1e-6,
        "μs": 1e-6, "ns": 1e-9, "min": 60.0}  # fmt: skip
ANGLE = {"": DEGREE, "deg": DEGREE, "degree": DEGREE, "degrees": DEGREE, "°": DEGREE,
         "°ca": DEGREE, "degca": DEGREE, "deg ca": DEGREE, "ca": DEGREE, "rad": 1.0}  # fmt: skip
SPEED = {"": RPM, "rpm": RPM, "1/min": RPM, "min-1": RPM, "min^-1": RPM, "u/min": RPM,
         "r/min": RPM, "rad/s": 1.0, "rad s-1": 1.0, "1/s": TURN, "hz": TURN,
         "deg/s": DEGREE}  # fmt: skip

TURNING_BACK = 0.2
"""Share of steps that do not ascend from which on times of teeth are taken as intervals; a gap in
every second turn is enough."""

CHANGING = 0.6
"""Share of the rows that change the level from which on they are the changes, not samples."""

UNEVEN = 0.5
"""Of the time between samples: how far a sample may be from its place."""

FEWEST = 12
"""Samples of a cycle of speed over angle."""


@dataclass(frozen=True, eq=False)
class SpeedRecord:
    """One recording of the speed.

    Attributes
    ----------
    label, sha256 : str
        The file as the scene names it, and the hash of its bytes.
    teeth : PassedTeeth, optional
        Turns of the wheel; None for speed over angle.
    angle : ndarray, shape (n,), or None
        Of speed over angle: uniform angles [rad] from -period/2, its end left out.
    cycles : ndarray, shape (cycles, n), or None
        Speeds there [rad/s].
    remarks : tuple of str
        What was seen in it, a line each.
    """

    label: str
    sha256: str
    teeth: PassedTeeth | None
    angle: Floats | None
    cycles: Floats | None
    remarks: tuple[str, ...]


def records_of(measured: Measured, period: float, name: str) -> list[SpeedRecord]:
    """Read all recordings that a scene names.

    Parameters
    ----------
    measured : Measured
        The table [measured] of a scene.
    period : float
        Angle of the engine's cycle [rad].
    name : str
        The scene as messages call it.

    Raises
    ------
    SceneError
        One line: a file that cannot be read, a column that is not clear, a signal in which the
        wheel is not found (with what was found).
    """
    if measured.table.kind == "encoder":
        return _signals(measured, name)
    return [
        _record(measured, place, period, f"{name}: [measured] {file}")
        for place, file in enumerate(measured.files)
    ]


def _recording(measured: Measured, path: Path, where: str) -> Recording:
    keys = {key: getattr(measured.table, key) for key in ReadingChoices.model_fields}
    return read_recording(path, where, ReadingChoices(**keys))


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
        times = _flat(recording, _column(recording, table.column, "column", ("time",)))
        times = times * _factor(recording, table.column, ("time",), table.unit, TIME, "time")
        said: tuple[str, ...] = ()
        if _are_intervals(times, measured.wheel.teeth):
            times = np.concatenate([[0.0], np.cumsum(times)])
            said = ("the values do not ascend and are taken as intervals between the teeth",)
        teeth = find_turns(times, measured.wheel, measured.first[place])
        remarks = (*recording.remarks, *said, *teeth.faults)
        return SpeedRecord(file, recording.sha256, teeth, None, None, remarks)
    except SceneError:
        raise
    except ValueError as error:
        raise SceneError(f"{where}: {error}") from None


def _are_intervals(times: Floats, teeth: int) -> bool:
    """Whether positive numbers go back too often for times with a few faults."""
    back = float(np.count_nonzero(np.diff(times) <= 0.0))
    return bool(times.size > teeth and times.min() > 0.0) and back >= times.size * min(
        TURNING_BACK, 0.5 / teeth
    )


def _signals(measured: Measured, name: str) -> list[SpeedRecord]:
    """Recordings of a sensor, all with one edge and threshold at one height of the swing.

    Where a tooth seems to pass depends on the threshold: with another one in each recording the
    wheel would have other errors in each.
    """
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
            found = teeth_of_signal(
                signal, interval, wheel, threshold=table.threshold, hysteresis=table.hysteresis,
                edge=table.edge, first=first,
            )  # fmt: skip
        except ValueError as error:
            raise SceneError(f"{where}: {error}") from None
        read.append((file, recording, signal, interval, found))
    if events and read:
        raise SceneError(
            f"{name}: [measured] {events[0][0]} has levels at their changes, {read[0][0]} samples; "
            "all files must have the same"
        )
    if events:
        return _logs(measured, events, name)
    chosen = [(_height(one[-1]), one[-1].crossings.edge) for one in read]
    best = [one[-1] for one in read]
    if len({(round(height, 6), edge) for height, edge in chosen}) > 1:
        merits = []
        for height, edge in chosen:
            again = []
            for (_, _, signal, interval, found), first in zip(read, measured.first, strict=True):
                threshold = found.low + height * (found.high - found.low)
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
    return [
        SpeedRecord(
            file, recording.sha256, found.teeth, None, None, (*recording.remarks, *found.remarks)
        )
        for (file, recording, *_), found in zip(read, best, strict=True)
    ]


def _logs(
    measured: Measured, events: Sequence[tuple[str, Recording, Floats, Floats]], name: str
) -> list[SpeedRecord]:
    """Logs of levels, all with the edge that loses the fewest turns and repeats best."""
    table, wheel = measured.table, measured.wheel
    assert wheel is not None
    tried: list[tuple[int, float, list[SpeedRecord]]] = []
    refusal = ""
    for edge in ("rising", "falling") if table.edge is None else (table.edge,):
        said = f"the level is logged at its changes; the {edge} edge is used"
        records, turns, scatter = [], 0, 0.0
        for (file, recording, level, time), first in zip(events, measured.first, strict=True):
            try:
                teeth = find_turns(risen(time, level, edge), wheel, first)
            except ValueError as error:
                refusal = refusal or f"{name}: [measured] {file}: {error}"
                break
            turns, scatter = turns + len(teeth.turn), scatter + teeth.scatter
            remarks = (*recording.remarks, said, *teeth.faults)
            records.append(SpeedRecord(file, recording.sha256, teeth, None, None, remarks))
        else:
            tried.append((turns, scatter, records))
    if not tried:
        raise SceneError(refusal)
    most = max(turns for turns, *_ in tried)  # the other edge may cost a turn at an end
    good = [one for one in tried if one[0] >= most - len(events)]
    return min(good, key=lambda one: one[1])[2]


def _height(found: EncoderSignal) -> float:
    """Threshold as a fraction of the swing."""
    return (found.crossings.threshold - found.low) / (found.high - found.low)


def _column(
    recording: Recording, wanted: str | int | None, key: str, words: tuple[str, ...] = (),
    without: tuple[str, ...] = (),
) -> str:  # fmt: skip
    """Name of a column: as given, or the one that is clear."""
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
    named = [n for n in names if any(word in n.lower() for word in words)]
    left = [n for n in names if n not in without]
    if len(named) == 1:
        return named[0]
    if len(left) == 1:
        return left[0]
    listed = ", ".join(f"{i} {one_line(n, 40)}" for i, n in enumerate(names[:12], start=1))
    raise SceneError(
        f"{recording.label}: {key}: ambiguous; give the name or number of one of these columns: "
        f"{listed}"
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
    """SI value of the unit that is given, or that the file states for the column."""
    name = _column(recording, wanted, "column", words)
    text = recording.columns[name].unit if unit is None else unit
    last = name.rpartition("_")[2]
    if not text and last.lower() in units:
        text = last  # "time_us"
    plain = text.strip().strip("[]()").strip().lower()
    if plain not in units:
        known = ", ".join(key for key in units if key)
        raise SceneError(
            f"{recording.label}, column {shown(name)}: unit {shown(text)} is not a unit of "
            f"{what}; must be one of {known}"
        )
    return units[plain]


def _signal(recording: Recording, table: MeasuredTable) -> tuple[Floats, float | Floats]:
    """Samples of the signal and the time between them; of a log of levels, their times."""
    time_name = None
    if table.sample_rate is None:
        time_name = _time_column(recording, table)
    column = _column(recording, table.column, "column", ("encoder",), (time_name or "",))
    if column == time_name:
        raise SceneError(f"{recording.label}: column {shown(column)} is the time of the samples")
    signal = _flat(recording, column)
    if time_name is None:
        assert table.sample_rate is not None
        return signal, 1.0 / table.sample_rate
    time = _flat(recording, time_name)
    time = time * _factor(recording, time_name, (), table.unit, TIME, "time")
    if time.size < 2 or not time[-1] > time[0]:
        raise SceneError(f"{recording.label}, column {shown(time_name)}: does not ascend")
    interval = float(time[-1] - time[0]) / (time.size - 1)
    changes = np.count_nonzero(np.diff(signal)) / (time.size - 1)
    off = np.abs(time - time[0] - interval * np.arange(time.size))
    uneven = off.max() > UNEVEN * interval
    two_levels = bool(np.isin(signal, (signal.min(), signal.max())).all())
    if two_levels and changes > (0.0 if uneven else CHANGING):
        return signal, time
    if uneven:
        place = int(np.argmax(np.abs(np.diff(time) - interval))) + 1
        raise SceneError(
            f"{recording.label}, column {shown(time_name)}, {recording.place(place)}: "
            f"{time[place] - time[place - 1]:.6g} s after the sample before, others {interval:.6g} "
            "s; must be samples equally far apart, or two levels at their changes"
        )
    return signal, interval


def _time_column(recording: Recording, table: MeasuredTable) -> str:
    """The column with the time: as given, named so, or the only one that ascends throughout."""
    if table.time_column is not None:
        return _column(recording, table.time_column, "time_column")
    words = ("t", "time", "zeit", "times")
    named = [n for n in recording.columns if _bare(n) in words]
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


def _bare(name: str) -> str:
    """Name of a column of times in lower case, without a unit such as that of "time_us"."""
    first, _, last = name.lower().strip().rpartition("_")
    return first if first and last in TIME else name.lower().strip()


def _speed_over_angle(
    recording: Recording, table: MeasuredTable, period: float
) -> tuple[Floats, Floats, tuple[str, ...]]:
    """Cycles of speed on uniform angles from -period/2; angles may run on over many cycles."""
    angle_name = _column(
        recording, table.angle_column, "angle_column", ("angle", "crank", "°", "deg", "winkel")
    )
    column = _column(recording, table.column, "column", ("speed", "rpm", "omega", "drehzahl"),
                     (angle_name,))  # fmt: skip
    angle = _flat(recording, angle_name)
    angle = angle * _factor(recording, angle_name, (), None, ANGLE, "angle")
    angle = angle + table.angle_shift * DEGREE
    speed = recording.numbers(column) * _factor(recording, column, (), table.unit, SPEED, "speed")
    if speed.shape[-1] != angle.size:
        raise SceneError(
            f"{recording.label}: {angle.size} angles, {speed.shape[-1]} speeds in a cycle"
        )
    if angle.size > 1 and angle[-1] < angle[0]:
        angle, speed = angle[::-1], speed[..., ::-1]
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
        cycles = np.array([np.interp(grid, angle, one, period=period) for one in speed])
        return grid, cycles, ()
    # without a period at its ends a train of cycles is not bent into itself
    if angle[-1] - angle[0] < period + 1.5 * step:
        return grid, np.interp(grid, angle, speed, period=period)[None, :], ()
    first = np.ceil((angle[0] + 0.5 * period) / period - 1e-9)
    whole = int(np.floor((angle[-1] + step * 1.01 - grid[0]) / period - first + 1e-9))
    if whole < 1:
        return grid, np.interp(grid, angle, speed, period=period)[None, :], ()
    places = grid + period * (first + np.arange(whole)[:, None])
    return grid, np.interp(places, angle, speed), ()
