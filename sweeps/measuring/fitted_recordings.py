"""Recordings that a fit is made to, and how they show a computed speed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from engine_dyn.quantities.graph import PARAMETERS
from engine_dyn.recordings.measured_speed import cycles_of_turns, find_gap_angle
from engine_dyn.recordings.tooth_errors import sound_intervals, speed_through_wheel
from engine_dyn.recordings.wheel import TURN, Wheel
from engine_dyn.types import Booleans, Floats
from engine_dyn.units import DEGREE, RPM
from sweeps.dimensions import DESIGN
from sweeps.errors import SceneError
from sweeps.measuring.computed_speeds import OF_RECORDING, OF_WHEEL, SpeedsOfRecordings
from sweeps.measuring.measured_files import SpeedRecord, records_of
from sweeps.scene.model import Scene

__all__ = ["FittedRecordings", "Seen"]

NO_SPEED = 1.0
"""Size of the logarithms that stand for a design without an answer: a fit steps back from it."""

MOST_SAMPLES = 720
"""Samples of a cycle of speed over angle that a fit takes: a degree of a four-stroke engine."""


@dataclass(frozen=True, eq=False)
class FittedRecordings:
    """Recordings of one engine, on the same intervals.

    Attributes
    ----------
    labels, sha256 : tuple of str
        The files as the scene names them, and the hashes of their bytes.
    remarks : tuple of str
        What was seen in them, a line each.
    places : list of dict
        For each recording the values of all that varies in the scene, and the measured speed.
    cycles : list of ndarray, shape (cycles, intervals)
        Speeds [rad/s]: raw ones between the teeth, or samples over the angle.
    width : ndarray, shape (intervals,)
        [rad].
    used : ndarray of bool, shape (intervals,)
        False for teeth that a sensor sees elsewhere, see `sound_intervals`.
    period : float
        Angle of the cycle [rad].
    wheel : Wheel, optional
        None for speed over angle.
    angle : ndarray, shape (intervals,), optional
        Of speed over angle [rad].
    """

    labels: tuple[str, ...]
    sha256: tuple[str, ...]
    remarks: tuple[str, ...]
    places: list[dict[str, float]]
    cycles: list[Floats]
    width: Floats
    used: Booleans
    period: float
    wheel: Wheel | None
    angle: Floats | None

    @property
    def turns(self) -> int:
        """Turns of a cycle."""
        return round(self.period / TURN)

    @property
    def sound(self) -> Booleans:
        """Intervals of the wheel that are used, shape (teeth,)."""
        return self.used[: self.used.size // self.turns]

    @classmethod
    def of(cls, scene: Scene, name: str) -> FittedRecordings:
        """Read the recordings of a scene.

        Raises
        ------
        SceneError
            One line, see `records_of`; also for a scene that does not say which design a recording
            belongs to.
        """
        assert scene.measured is not None
        period, wheel = float(scene.engine.period), scene.measured.wheel
        records = records_of(scene.measured, period, name)
        turns, angle = round(period / TURN), None
        if wheel is None:
            angle, cycles = _over_angle(records, period)
            width = np.full(angle.size, period / angle.size)
            used = np.ones(angle.size, dtype=np.bool_)
        else:
            cycles = [_between_teeth(record, turns, name) for record in records]
            width = np.tile(wheel.width, turns)
            used = np.tile(
                sound_intervals(np.array([c.mean(axis=0) for c in cycles]), wheel), turns
            )
        for label, one in zip(scene.measured.files, cycles, strict=True):
            if len(one) < 2:
                raise SceneError(
                    f"{name}: [measured] {label}: one cycle has no scatter; a fit needs two or "
                    "more cycles"
                )
        places = []
        for number, speeds in enumerate(cycles):
            time = np.mean(np.sum(width / speeds, axis=1))
            known = _values_of(scene, number, name)
            places.append({**known, "speed": float(period / time / RPM)})
        return cls(
            scene.measured.files, tuple(r.sha256 for r in records),
            tuple(f"{r.label}: {line}" for r in records for line in r.remarks),
            places, cycles, width, used, period, wheel, angle,
        )  # fmt: skip

    def seen(
        self, recordings: Sequence[int], computed: SpeedsOfRecordings, angle: Floats,
        speed: Floats, gap_angle: float | None,
    ) -> Seen:  # fmt: skip
        """How some recordings show computed speeds.

        Parameters
        ----------
        recordings : sequence of int
            Their numbers.
        computed : SpeedsOfRecordings
            Theirs.
        angle, speed : ndarray, shape (samples,), (recordings, samples)
            Computed speeds [rad/s] that tell where the wheel is, and which of the turns fires.
        gap_angle : float, optional
            Where it is known [rad].
        """
        if self.wheel is None:
            return Seen(self, computed, None, np.zeros(len(recordings)))
        raw = np.array([self.cycles[i].mean(axis=0) for i in recordings])
        found = find_gap_angle(raw, angle, speed, self.wheel, self.period, gap_angle, self.sound)
        starts = np.asarray(found.angle + TURN * found.turn, dtype=np.float64)
        return Seen(self, computed, found.angle, starts)


@dataclass(frozen=True, eq=False)
class Seen:
    """Logarithms of computed speeds as perfect teeth or samples show them.

    Attributes
    ----------
    recordings : FittedRecordings
        Their intervals.
    computed : SpeedsOfRecordings
        Of those that are fitted, in their order.
    gap_angle : float, optional
        Crank angle of the first tooth after the longest gap [rad]; None without a wheel.
    starts : ndarray, shape (recordings,)
        Crank angle at which each recording begins [rad].
    """

    recordings: FittedRecordings
    computed: SpeedsOfRecordings
    gap_angle: float | None
    starts: Floats

    def __call__(self, values: Floats) -> list[Floats]:
        """Shape (n, intervals) for each recording, of parameters of shape (n, P)."""
        angle, speed = self.computed.speeds(values)
        shifts = np.zeros(len(values))
        for place, key in enumerate(self.computed.keys):
            if key in OF_WHEEL | OF_RECORDING:
                shifts = shifts + values[:, place] * DEGREE
        found = []
        for number, start in enumerate(self.starts):
            rows = np.full((len(values), self.recordings.width.size), NO_SPEED)
            rows[:, ::2] *= -1.0
            for shift in np.unique(shifts):
                here = (shifts == shift) & np.isfinite(speed[:, number]).all(axis=1)
                rows[here] = np.log(self._shown(angle, speed[here, number], float(start + shift)))
            found.append(rows)
        return found

    def _shown(self, angle: Floats, speed: Floats, start: float) -> Floats:
        """Speeds [rad/s] of shape (n, intervals)."""
        given = self.recordings
        if given.wheel is not None:
            return speed_through_wheel(angle, speed, given.wheel, start, given.period)
        assert given.angle is not None
        at = given.angle + start
        rows = [np.interp(at, angle, one, period=given.period) for one in speed]
        return np.array(rows).reshape(len(speed), -1)

    def middles(self) -> Floats:
        """Middles of the intervals [rad], shape (recordings, intervals), within one cycle."""
        given = self.recordings
        if given.angle is not None:
            return np.tile(given.angle, (self.starts.size, 1))
        begin = np.concatenate([[0.0], np.cumsum(given.width)[:-1]])
        middle = self.starts[:, None] + begin + 0.5 * given.width + 0.5 * given.period
        return np.asarray(middle % given.period - 0.5 * given.period)


def _between_teeth(record: SpeedRecord, turns: int, name: str) -> Floats:
    """Cycles of the speed between the teeth."""
    assert record.teeth is not None
    try:
        return cycles_of_turns(record.teeth, turns)
    except ValueError as error:
        raise SceneError(f"{name}: [measured] {record.label}: {error}") from None


def _over_angle(records: Sequence[SpeedRecord], period: float) -> tuple[Floats, list[Floats]]:
    """Cycles of speed over angle on common angles: those of the finest recording, not too many."""
    given = [r for r in records if r.angle is not None]
    count = min(max(r.angle.size for r in given if r.angle is not None), MOST_SAMPLES)
    angle: Floats = -0.5 * period + period / count * np.arange(count, dtype=np.float64)
    return angle, [
        np.array([np.interp(angle, r.angle, one, period=period) for one in r.cycles])
        for r in given
        if r.angle is not None and r.cycles is not None
    ]


def _values_of(scene: Scene, number: int, name: str) -> dict[str, float]:
    """Values of all that varies in a scene for one recording."""
    assert scene.measured is not None
    at = scene.measured.at
    found = {}
    for key, values in scene.axes.items():
        if isinstance(values, tuple) or key not in PARAMETERS:
            continue
        if key in at:
            found[key] = float(at[key][number])
        elif len(values) == 1:
            found[key] = float(values[0])
        elif key != "speed":  # the measured one
            raise SceneError(
                f"{name}: [measured] at: the scene also varies {key}; give the value that belongs "
                "to each file"
            )
    if scene.designs:
        rows = at.get(DESIGN)
        if rows is None and len(next(iter(scene.designs.values()))) != 1:
            raise SceneError(f"{name}: [measured] at: give the design that belongs to each file")
        row = 0 if rows is None else int(rows[number])
        found |= {key: float(column[row]) for key, column in scene.designs.items()}
    return found
