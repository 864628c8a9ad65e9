"""Recordings that a fit is made to, and how they show a computed speed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from engine_dyn.quantities.graph import PARAMETERS
from engine_dyn.recordings.tooth_errors import speed_through_wheel
from engine_dyn.types import Floats
from engine_dyn.units import DEGREE, RPM
from sweeps.base.dimensions import DESIGN
from sweeps.base.errors import SceneError
from sweeps.lab.speed.computed_speeds import OF_RECORDING, OF_WHEEL, SpeedsOfRecordings
from sweeps.lab.speed.recorded_speeds import RecordedSpeeds, recorded_speeds
from sweeps.scene.model import Scene

__all__ = ["FittedRecordings", "Seen"]

NO_SPEED = 1.0
"""Size of the logarithms that stand for a design without an answer: a fit steps back from it."""

MOST_SAMPLES = 720
"""Samples of a cycle of speed over angle that a fit takes: a degree of a four-stroke engine."""


@dataclass(frozen=True, eq=False)
class FittedRecordings(RecordedSpeeds):
    """Recordings that a fit is made to."""

    # For each recording the values of all that varies in the scene, and the measured speed.
    places: list[dict[str, float]]

    @classmethod
    def of(cls, scene: Scene, name: str) -> FittedRecordings:
        """Read the recordings of a scene.

        Raises
        ------
        SceneError
            One line, see `recorded_speeds`; also for a scene that does not say which design a
            recording belongs to.
        """
        assert scene.measured is not None
        period = float(scene.engine.period)
        read = recorded_speeds(scene.measured, period, name, MOST_SAMPLES)
        if read.groups > 1 and len(read.labels) > 1:
            raise SceneError(
                f"{name}: [measured] first_tooth: missing; {read.groups} teeth of the wheel could "
                "be the first one, and a fit to several recordings needs the same tooth in all"
            )
        for label, one in zip(read.labels, read.cycles, strict=True):
            if len(one) < 2:
                raise SceneError(
                    f"{name}: [measured] {label}: one cycle has no scatter; a fit needs two or "
                    "more cycles"
                )
        places = []
        for number, speeds in enumerate(read.cycles):
            time = np.mean(np.sum(read.width / speeds, axis=1))
            known = _values_of(scene, number, name)
            places.append({**known, "speed": float(period / time / RPM)})
        return cls(**vars(read), places=places)

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
        found = self.gap(self.raw[list(recordings)], angle, speed, gap_angle)
        return Seen(self, computed, found.angle, found.start)


@dataclass(frozen=True, eq=False)
class Seen:
    """Logarithms of computed speeds as perfect teeth or samples show them."""

    recordings: FittedRecordings  # Recordings: their intervals
    computed: SpeedsOfRecordings  # Computed of those that are fitted, in their order
    # Crank angle of the first tooth after the longest gap [rad]; None without a wheel.
    gap_angle: float | None
    starts: Floats  # Crank angle at which each recording begins [rad]; shape (recordings,)

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
