"""Drift of a recorded speed: what changes from cycle to cycle, taken out of what repeats.

The mean of the squared speed over one cycle, from any tooth on, is free of all that repeats every
cycle. Under a constant mean torque it rises evenly with the angle, by the change of kinetic energy.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from engine_dyn.recordings.measured_speed import cycles_of_turns
from engine_dyn.recordings.teeth import FACTOR, PassedTeeth
from engine_dyn.types import Floats, Integers

__all__ = ["Drift", "SteadySpeeds", "steady_cycles", "steady_turns"]

LEAST = 0.05
"""Change of the speed in a cycle, over the fluctuation that is left without it, from which on it is
taken out."""


FEWEST = 8
"""Intervals of a single cycle whose ends tell a drift."""


class Drift(NamedTuple):
    """Change of a speed over a recording."""

    # Speeds at its ends without what repeats [rad/s].
    first: float
    last: float
    cycles: float  # Between them

    @property
    def in_a_cycle(self) -> float:
        """Relative change of the speed in a cycle."""
        return float(np.expm1(np.log(self.last / self.first) / max(self.cycles, 0.5)))


class SteadySpeeds(NamedTuple):
    """Speeds of cycles, and the drift that was taken out of them; None where there is none."""

    cycles: Floats  # [rad/s]; each cycle keeps its own mean; shape (cycles, intervals)
    drift: Drift | None  # The largest one, of runs that faults part
    left_out: float  # Share of the intervals that belong to no whole cycle


def steady_cycles(cycles: Floats, width: Floats) -> SteadySpeeds:
    """Take the drift out of cycles that follow each other.

    Parameters
    ----------
    cycles : ndarray, shape (cycles, intervals)
        Speeds [rad/s].
    width : ndarray, shape (intervals,)
        Angles of the intervals [rad].
    """
    level, drift = _level(cycles.ravel(), np.tile(width, len(cycles)), width.size)
    level = level.reshape(cycles.shape)
    if drift is None or _is_little(cycles, level, width, drift):
        return SteadySpeeds(cycles, None, 0.0)
    return SteadySpeeds(_without(cycles, level, width), drift, 0.0)


def steady_turns(teeth: PassedTeeth, turns: int) -> SteadySpeeds:
    """Find the whole cycles of a wheel's turns, and take the drift out of them.

    Parameters
    ----------
    teeth : PassedTeeth
        Turns in a row; intervals before and after them tell the drift, too.
    turns : int
        Turns of a cycle: 2 (four-stroke) or 1. Cycles begin with turns of even numbers.

    Raises
    ------
    ValueError
        For a recording without a whole cycle.
    """
    cycles, n = cycles_of_turns(teeth, turns), turns * teeth.wheel.teeth
    width = np.tile(teeth.wheel.width, turns)
    level, drifts = np.ones(teeth.interval.shape), []
    for run in np.split(np.arange(teeth.turn.size), np.flatnonzero(np.diff(teeth.turn) != 1) + 1):
        if run.size >= turns:
            level[run], drift = _level_of_run(teeth, run, n)
            drifts.append(drift)
    over = cycles_of_turns(teeth, turns, values=level)
    whole = teeth.before.size + teeth.interval.size + teeth.after.size
    left_out = 1.0 - cycles.size / whole
    drift = max(
        (one for one in drifts if one is not None),
        key=lambda one: abs(one.in_a_cycle),
        default=None,
    )
    if drift is None or _is_little(cycles, over, width, drift):
        return SteadySpeeds(cycles, None, left_out)
    return SteadySpeeds(_without(cycles, over, width), drift, left_out)


def _level_of_run(teeth: PassedTeeth, run: Integers, n: int) -> tuple[Floats, Drift | None]:
    """Level of turns that follow each other, with the intervals before and after all turns."""
    here = teeth.speed[run]
    speed, width = [here.ravel()], [np.tile(teeth.wheel.width, run.size)]
    ahead = 0
    if run[-1] == teeth.turn.size - 1:
        more = _going_on(teeth.wheel.width, here[-1], teeth.time[-1, -1], teeth.after)
        speed.append(more)
        width.append(np.resize(teeth.wheel.width, more.size))
    if run[0] == 0:
        back = teeth.wheel.width[::-1]
        more = _going_on(back, here[0][::-1], -teeth.time[0, 0], -teeth.before[::-1])
        ahead = more.size
        speed.insert(0, more[::-1])
        width.insert(0, np.resize(back, ahead)[::-1])
    level, drift = _level(np.concatenate(speed), np.concatenate(width), n)
    return level[ahead : ahead + here.size].reshape(here.shape), drift


def _going_on(width: Floats, speed: Floats, last: float, times: Floats) -> Floats:
    """Speeds of less than a turn behind the last one, as far as the pattern goes on in it."""
    gaps = np.diff(np.concatenate([[last], times[: width.size - 1]]))
    here = width[: gaps.size] / gaps
    ratio = here / speed[: gaps.size]
    wrong = np.flatnonzero((ratio > FACTOR) | (ratio < 1.0 / FACTOR))
    return np.asarray(here[: wrong[0]] if wrong.size else here)


def _level(speed: Floats, width: Floats, n: int) -> tuple[Floats, Drift | None]:
    """Mean square over a cycle around each interval, and the drift; None where it is not told.

    Parameters
    ----------
    speed, width : ndarray, shape (intervals,)
        Of intervals in a row, at least a cycle of them.
    n : int
        Intervals of a cycle.
    """
    square, edges = speed**2, np.concatenate([[0.0], np.cumsum(width)])
    period, middle = float(edges[n]), 0.5 * (edges[1:] + edges[:-1])
    total = np.concatenate([[0.0], np.cumsum(square * width)])
    mean = (total[n:] - total[:-n]) / period
    centre = edges[: mean.size] + 0.5 * period
    if mean.size > 1:
        reach = min(n, mean.size - 1)
        start = (mean[reach] - mean[0]) / (centre[reach] - centre[0])
        end = (mean[-1] - mean[-1 - reach]) / (centre[-1] - centre[-1 - reach])
    else:
        # from the beginning of the cycle to its end, the level rises by the factor of this step
        start = end = 2.0 * np.tanh(0.5 * _step(np.log(square), width)) * mean[0] / period
    level = np.interp(middle, centre, mean)
    level += np.minimum(middle - centre[0], 0.0) * start
    level += np.maximum(middle - centre[-1], 0.0) * end
    if start == end == 0.0 or not np.all(level > 0.0):
        return np.full(speed.size, mean.mean()), None
    cycles = float(middle[-1] - middle[0]) / period
    return level, Drift(float(np.sqrt(level[0])), float(np.sqrt(level[-1])), cycles)


def _step(values: Floats, width: Floats) -> float:
    """Step from the end of a single cycle to its beginning; 0 where it is as between others."""
    if values.size < FEWEST:
        return 0.0
    slope = np.diff(values) / (0.5 * (width[1:] + width[:-1]))
    after = values[1:] + slope * 0.5 * width[1:]  # at the edges behind two intervals
    before = values[:-1] - slope * 0.5 * width[:-1]  # and before two
    step, within = float(after[-1] - before[0]), after[:-2] - before[2:]
    # Step at the ends of a single cycle, over that between its neighbours elsewhere, that is drift.
    return step if abs(step) > 4.0 * float(np.sqrt(np.mean(within**2))) else 0.0


def _without(cycles: Floats, level: Floats, width: Floats) -> Floats:
    """Cycles at the level of their own means."""
    own = level @ width / width.sum()
    return np.asarray(cycles * np.sqrt(own[:, None] / level))


def _is_little(cycles: Floats, level: Floats, width: Floats, drift: Drift) -> bool:
    """Whether a drift hardly changes what repeats."""
    mean = _without(cycles, level, width).mean(axis=0)
    return abs(drift.in_a_cycle) < LEAST * float(np.ptp(mean) / mean.mean())
