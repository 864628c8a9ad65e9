"""Measured speeds of cycles that follow each other, with a place for those that were lost."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from engine_dyn.geometry.toothed_wheel import TURN
from engine_dyn.periodic_spline import wrapped
from engine_dyn.recordings.measured_speed import find_gap_angle
from engine_dyn.recordings.teeth import PassedTeeth
from engine_dyn.recordings.tooth_errors import sound_intervals
from engine_dyn.types import Booleans, Floats
from engine_dyn.units import DEGREE
from sweeps.base.errors import SceneError
from sweeps.lab.speed.measured_files import SpeedRecord
from sweeps.lab.speed.recorded_speeds import first_tooth
from sweeps.scene.measured import Measured

__all__ = ["CyclesInARow", "cycles_in_a_row"]


@dataclass(frozen=True, eq=False)
class CyclesInARow:
    """Raw speeds of a recording."""

    # Given errors of teeth taken out [rad/s]; NaN where turns were lost; shape (cycles, intervals)
    speed: Floats
    width: Floats  # Width of the intervals between teeth [rad]; shape (intervals,)
    start: float  # Crank angle at which the first interval of each cycle begins [rad]
    used: Booleans  # False for intervals beside a gap that are far off; shape (intervals,)
    # Whether it is known with which turn of the engine's cycle the recording begins.
    turn_known: bool
    start_from: str  # Start from: where `start` comes from

    @property
    def mean(self) -> Floats:
        """Mean over the cycles that are known, shape (intervals,)."""
        return np.asarray(np.nanmean(self.speed, axis=0))


def cycles_in_a_row(
    record: SpeedRecord, given: Measured, angle: Floats, speed: Floats, period: float,
    symmetry: int, where: str,
) -> CyclesInARow:  # fmt: skip
    """Speeds of all cycles from the first whole one on, and where they begin.

    Parameters
    ----------
    record : SpeedRecord
        Read by `records_of`.
    given : Measured
        The table [measured].
    angle, speed : ndarray, shape (samples,)
        Computed speed [rad/s] over one cycle [rad] from -period/2 on, to find the gap of the wheel.
    period : float
        Of a cycle [rad].
    symmetry : int
        How often the computed speed repeats within the cycle: by so much it cannot tell where the
        gap is.
    where : str
        The table and its scene as messages call them.

    Raises
    ------
    SceneError
        In one line, for a wheel whose gap cannot be found, and fewer than one whole cycle.
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
    found = find_gap_angle(
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
    start = float(found.start[0])
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
    errors = np.roll(errors, -int(found.late[0]))  # from the tooth with which the rows begin
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
