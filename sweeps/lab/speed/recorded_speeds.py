"""Recordings of the speed of one engine, all on the same intervals."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from engine_dyn.geometry.toothed_wheel import TURN, Wheel
from engine_dyn.periodic_spline import wrapped
from engine_dyn.recordings.encoder import ASIDE
from engine_dyn.recordings.measured_speed import (
    GapAngle,
    SteadySpeeds,
    find_gap_angle,
    steady_cycles,
    steady_turns,
)
from engine_dyn.recordings.teeth import PassedTeeth
from engine_dyn.recordings.tooth_errors import sound_intervals
from engine_dyn.types import Booleans, Floats
from engine_dyn.units import DEGREE, RPM
from sweeps.base.errors import SceneError
from sweeps.lab.speed.measured_files import SpeedRecord, records_of
from sweeps.scene.features.measured import Measured


@dataclass(frozen=True, eq=False)
class RecordedSpeeds:
    """Recordings of one engine, on the same intervals."""

    # The files as the scene names them, and the hashes of their bytes.
    labels: tuple[str, ...]
    sha256: tuple[str, ...]
    remarks: tuple[str, ...]  # Remarks on the recordings, a line each
    # Speeds of each recording [rad/s]: raw ones between the teeth, or samples over the angle; shape
    # (cycles, intervals)
    cycles: list[Floats]
    width: Floats  # Width of the intervals [rad]; shape (intervals,)
    # False for intervals whose speed is far off that of their neighbours in every turn, see
    # `sound_intervals`; shape (intervals,)
    used: Booleans
    period: float  # Angle of the cycle [rad]
    wheel: Wheel | None  # Toothed wheel; None for speed over angle
    angle: Floats | None  # Angles of samples of speed over angle [rad]; shape (intervals,)
    groups: int  # Number of teeth of a turn that could be the first one, by the wheel's pattern
    first_pulse: tuple[int, ...]  # Number of the tooth that each recording begins with, from 1
    # Crank angle of the first tooth [rad], where the scene or marks give it.
    known_gap: float | None
    turn_known: bool  # Whether marks show the turn with which cycles begin
    of_file: tuple[int, ...]  # Number of the file that each recording is, or is a part of

    @property
    def turns(self) -> int:
        """Turns of a cycle."""
        return round(self.period / TURN)

    @property
    def sound(self) -> Booleans:
        """Intervals of the wheel that are used, shape (teeth,)."""
        return self.used[: self.used.size // self.turns]

    @property
    def raw(self) -> Floats:
        """Mean over the cycles of each recording, shape (recordings, intervals)."""
        return _means(self.cycles)

    @property
    def listed(self) -> str:
        """The files and their hashes, a line each."""
        pairs = zip(self.labels, self.sha256, strict=True)
        return "\n".join(f"{label} sha256 {digest}" for label, digest in pairs)

    def gap(self, raw: Floats, angle: Floats, speed: Floats, known: float | None) -> GapAngle:
        """Where the wheel is on the shaft, by the likeness of means and computed speeds.

        `raw`, shape (recordings, intervals), are means of the recordings that count, `speed`
        [rad/s] their computed speeds over the `angle`. A recording whose computed speed is NaN
        tells nothing, and is taken to begin with the first tooth. `known` is the angle of the gap
        [rad], where it is given.
        """
        assert self.wheel is not None
        has = np.isfinite(speed).all(axis=1)
        first = known or 0.0
        alike = np.full((len(raw), self.turns * self.groups), np.nan)
        zero = np.zeros(len(raw), dtype=np.int64)
        if not has.any():
            return GapAngle(first, zero, alike, zero, first + np.zeros(len(raw)))
        gap = find_gap_angle(
            raw[has],
            angle,
            speed[has],
            self.wheel,
            self.period,
            known,
            self.sound,
            self.groups,
            self.turn_known,
        )
        if has.all():
            return gap
        turn, late, start = zero.copy(), zero.copy(), np.full(len(raw), gap.angle)
        turn[has], late[has], start[has] = gap.turn, gap.late, gap.start
        alike[has] = gap.correlation
        return GapAngle(gap.angle, turn, alike, late, start)

    def from_first_tooth(self, gap: GapAngle) -> RecordedSpeeds:
        """Recordings whose intervals begin with the first tooth, and a remark on the choice."""
        if self.groups == 1:
            return self
        assert self.wheel is not None
        said = tuple(
            f"{label}: {self.groups} teeth of {self.wheel.text} could be the first one; that of "
            f"pulse {first + (self.wheel.teeth - late) % self.wheel.teeth} is taken"
            f"{', in best agreement with the computed speed' * bool(np.isfinite(alike))} "
            "(first_tooth takes another one)"
            for label, first, late, alike in zip(
                self.labels, self.first_pulse, gap.late, gap.correlation[:, 0], strict=True
            )
        )
        cycles = gap.from_first_tooth(self.cycles)
        used = np.tile(sound_intervals(_means(cycles), self.wheel), self.turns)
        return replace(self, cycles=cycles, used=used, remarks=self.remarks + said)

    def parts(self, cycles: int) -> RecordedSpeeds:
        """Parts of so many cycles of each recording, each a recording; a rest belongs to the last.

        A recording that is shorter is one part.
        """
        made = [
            (file, number, part)
            for file, one in enumerate(self.cycles)
            for number, part in enumerate(
                np.split(one, cycles * np.arange(1, max(len(one) // cycles, 1)))
            )
        ]
        files = [file for file, *_ in made]
        return replace(
            self,
            labels=tuple(f"{self.labels[file]}, part {n + 1}" for file, n, _ in made),
            sha256=tuple(self.sha256[file] for file in files),
            cycles=[part for *_, part in made],
            first_pulse=tuple(self.first_pulse[file] for file in files if self.first_pulse),
            of_file=tuple(files),
        )

    def middles(self, starts: Floats) -> Floats:
        """Middles of the intervals [rad], shape (recordings, intervals), within one cycle.

        `starts` are the angles at which the recordings begin.
        """
        if self.angle is not None:
            return np.tile(self.angle, (starts.size, 1))
        begin = np.concatenate([[0.0], np.cumsum(self.width)[:-1]])
        middle = starts[:, None] + begin + 0.5 * self.width + 0.5 * self.period
        return np.asarray(middle % self.period - 0.5 * self.period)


def recorded_speeds(
    given: Measured, period: float, name: str, most_samples: int | None = None
) -> RecordedSpeeds:
    """Read the recordings of a scene; the cycle has an angle of `period` [rad].

    A cycle of speed over angle has at most `most_samples` intervals, by default as many as the
    finest recording has. SceneError as of `records_of`, and for a recording without a whole cycle.
    """
    records = records_of(given, period, name)
    wheel, turns, angle = given.wheel, round(period / TURN), None
    if wheel is None:
        angle, cycles = _over_angle(records, period, most_samples)
        width = np.full(angle.size, period / angle.size)
        steady = [steady_cycles(one, width) for one in cycles]
        cycles = [one.cycles for one in steady]
        used = np.ones(angle.size, dtype=np.bool_)
    else:
        steady = [_between_teeth(record, turns, name) for record in records]
        cycles = [one.cycles for one in steady]
        width = np.tile(wheel.width, turns)
        used = np.tile(sound_intervals(_means(cycles), wheel), turns)
    recorded = RecordedSpeeds(
        tuple(r.label for r in records), tuple(r.sha256 for r in records),
        tuple(
            f"{record.label}: {line}"
            for record, one in zip(records, steady, strict=True)
            for line in (*record.remarks, *_drift_remarks(one))
        ),
        cycles, width, used, period, wheel, angle, given.groups,
        tuple(r.teeth.first + 1 for r in records if r.teeth is not None),
        _known_gap(records, name), all(r.turn_known for r in records), tuple(range(len(records))),
    )  # fmt: skip
    return recorded if given.table.part_cycles is None else recorded.parts(given.table.part_cycles)


def first_tooth(start: float, errors: Floats, wheel: Wheel, sound: Booleans) -> float:
    """True angle of the first tooth: sound teeth are on the average where they should be [rad]."""
    shifts = np.concatenate([[0.0], np.cumsum(wheel.width * errors)[:-1]])
    return start - float(shifts[sound & np.roll(sound, 1)].mean())


def _known_gap(records: Sequence[SpeedRecord], name: str) -> float | None:
    """Crank angle of the first tooth [rad], on which the marks of all records must agree."""
    gaps = np.array([record.gap for record in records if record.gap is not None])
    if not gaps.size:
        return None
    away = wrapped(gaps - gaps[0], TURN)
    if np.ptp(away) > ASIDE:
        listed = ", ".join(f"{gap / DEGREE:.4g}" for gap in gaps)
        raise SceneError(
            f"{name}: [measured] mark_column: the first tooth passes at {listed} degrees; must be "
            f"the same within {ASIDE / DEGREE:g} in all files"
        )
    return float(gaps[0] + away.mean())


def _means(cycles: Sequence[Floats]) -> Floats:
    return np.array([one.mean(axis=0) for one in cycles])


def _between_teeth(record: SpeedRecord, turns: int, name: str) -> SteadySpeeds:
    """Cycles of the speed between the teeth, without its drift."""
    assert record.teeth is not None
    try:
        return steady_turns(record.teeth, turns)
    except ValueError as error:
        raise SceneError(f"{name}: [measured] {record.label}: {error}") from None


def _drift_remarks(steady: SteadySpeeds) -> list[str]:
    """Remarks on a drift, and on intervals at the ends."""
    said = []
    if steady.drift is not None:
        first, last, _ = steady.drift
        said.append(
            f"the speed {'rises' if last > first else 'falls'} from {first / RPM:.4g} to "
            f"{last / RPM:.4g} rpm, by {abs(100.0 * steady.drift.in_a_cycle):.2g} % in a cycle: "
            "this drift is taken out of the speeds; delta is that of no steady speed"
        )
    if steady.left_out > 0.05:
        said.append(
            f"{100.0 * steady.left_out:.2g} % of the intervals belong to no whole cycle and are "
            "left out"
        )
    return said


def _over_angle(
    records: Sequence[SpeedRecord], period: float, most: int | None
) -> tuple[Floats, list[Floats]]:
    """Cycles of speed over angle on common angles, those of the finest recording within a limit."""
    given = [(r.angle, r.cycles) for r in records if r.angle is not None and r.cycles is not None]
    count = max(angle.size for angle, _ in given)
    count = count if most is None else min(count, most)
    common: Floats = -0.5 * period + period / count * np.arange(count, dtype=np.float64)
    return common, [
        np.array([np.interp(common, angle, one, period=period) for one in cycles])
        for angle, cycles in given
    ]


@dataclass(frozen=True, eq=False)
class CyclesInARow:
    """Raw speeds of a recording."""

    # Speed without the given errors of teeth [rad/s]; NaN where turns were lost; shape (cycles,
    # intervals)
    speed: Floats
    width: Floats  # Width of the intervals between teeth [rad]; shape (intervals,)
    start: float  # Crank angle at which the first interval of each cycle begins [rad]
    used: Booleans  # False for intervals that `sound_intervals` rejects; shape (intervals,)
    # Whether the turn of the engine's cycle with which the recording begins is known.
    turn_known: bool
    start_from: str  # Source of the angle at which cycles begin, in words

    @property
    def mean(self) -> Floats:
        """Mean over the cycles that are known, shape (intervals,)."""
        return np.asarray(np.nanmean(self.speed, axis=0))


def cycles_in_a_row(
    record: SpeedRecord, given: Measured, angle: Floats, speed: Floats, period: float,
    symmetry: int, where: str,
) -> CyclesInARow:  # fmt: skip
    """Speeds of all cycles from the first whole one on, and where they begin.

    The gap of the wheel is found by the computed `speed` [rad/s] over the `angle` of one cycle
    [rad], from -period/2 on; it repeats `symmetry` times within the cycle, and by so much it cannot
    tell where the gap is. SceneError, with `where` before it, refuses a wheel whose gap cannot be
    found, and fewer than one whole cycle.
    """
    if record.cycles is not None and record.angle is not None:
        step = period / record.angle.size
        return CyclesInARow(
            record.cycles, np.full(record.angle.size, step), float(record.angle[0]) - 0.5 * step,
            np.ones(record.angle.size, dtype=bool), True, "the angles of the file",
        )  # fmt: skip
    assert record.teeth is not None and given.wheel is not None
    wheel, turns = given.wheel, round(period / TURN)
    known = record.gap
    if known is None and TURN * symmetry > period * (1.0 + 1e-9):
        raise SceneError(
            f"{where} gap_angle: missing; must be given, because the speed of {symmetry} equal "
            f"cylinders repeats every {period / symmetry / DEGREE:g} degrees and so cannot "
            "determine it"
        )
    if given.groups > 1 and symmetry > 1:
        raise SceneError(
            f"{where} first_tooth: missing; {given.groups} teeth of the wheel {wheel.text} could "
            "be the first one, and the speed of equal cylinders cannot determine it"
        )
    raw = _rows(record.teeth, turns)
    if not len(raw):
        raise SceneError(f"{where} {record.label}: no whole cycle of {turns} turns was found")
    mean = np.nanmean(raw, axis=0)
    sound = sound_intervals(mean, wheel)
    gap = find_gap_angle(
        mean[None],
        angle,
        speed[None],
        wheel,
        period,
        known,
        sound,
        given.groups,
        record.turn_known,
    )
    start = float(gap.start[0])
    turn_known, by_gap = True, "gap_angle" if given.table.mark_column is None else "the mark"
    start_from = "the correlation of measured and computed speed"
    if record.turn_known:
        start_from = by_gap
    elif turns > 1 and symmetry % turns == 0:
        turn_known = False
        start_from = f"{start_from if known is None else by_gap}, except for the revolution"
        if given.table.gap_angle is not None:
            start = given.table.gap_angle * DEGREE
            start_from = "gap_angle, assumed to belong to the first complete turn of the recording"
    elif known is not None:
        start_from = f"{by_gap}, and the turn from the correlation of measured and computed speed"
    errors = np.zeros(wheel.teeth) if isinstance(given.errors, str) else given.errors
    # Given errors count from the first tooth, and are rolled to the tooth that the rows begin with.
    errors = np.roll(errors, -int(gap.late[0]))
    start = first_tooth(start, errors, wheel, sound)
    return CyclesInARow(
        raw * np.tile(1.0 + errors, turns), np.tile(wheel.width * (1.0 + errors), turns),
        float(wrapped(start, period)), np.tile(sound, turns), turn_known,
        start_from,
    )  # fmt: skip


def _rows(teeth: PassedTeeth, turns: int) -> Floats:
    """Raw speed of each whole cycle from the first to the last, NaN for those with lost turns."""
    number = teeth.turn - teeth.turn[0] // turns * turns
    count = int(number[-1] + 1) // turns
    rows = np.full((count * turns, teeth.wheel.teeth), np.nan)
    inside = number < len(rows)
    rows[number[inside]] = teeth.speed[inside]
    rows = rows.reshape(count, -1)
    rows[np.isnan(rows).any(axis=1)] = np.nan
    known = np.flatnonzero(np.isfinite(rows[:, 0]))
    return rows[known[0] : known[-1] + 1] if known.size else rows[:0]
