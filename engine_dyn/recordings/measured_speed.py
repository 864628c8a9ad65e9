"""Speed over the cycle from the teeth of a wheel: mean and spread over cycles, fluctuation, drift.

The mean of the squared speed over one cycle, from any tooth on, is free of all that repeats every
cycle. Under a constant mean torque it rises evenly with the angle, by the change of kinetic energy.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from engine_dyn.geometry.toothed_wheel import TURN, Wheel
from engine_dyn.periodic_spline import periodic_spline_slopes, wrapped
from engine_dyn.recordings.teeth import FACTOR, PassedTeeth
from engine_dyn.recordings.tooth_errors import ToothErrors
from engine_dyn.types import Booleans, Floats, Integers

SHIFTS = 0.5 * np.pi / 180.0
"""Step of the trial angles of the gap [rad]; a parabola refines the best one."""

NEAR = 12.0 * np.pi / 180.0
"""Distance from the greatest likeness of the raw speeds within which the gap is searched without
errors of teeth [rad]."""


@dataclass(frozen=True)
class Fluctuation:
    """Coefficient of speed fluctuation of a measured speed."""

    delta: float  # Range of the mean speed over cycles, over its mean: (max - min)/mean
    # Standard error of `delta`: by the scatter of both extreme values over cycles, and by errors
    # of their teeth where these were corrected.
    uncertainty: float
    of_cycles: float  # Mean of delta over single cycles; noise makes it larger than `delta`
    scatter: float  # Standard deviation of delta over single cycles


@dataclass(frozen=True, eq=False)
class GapAngle:
    """Where a wheel is on its crankshaft, by the likeness of speeds."""

    # Crank angle at which the first tooth after the longest gap passes [rad], -pi to pi.
    angle: float
    # Turn of the cycle with which each recording begins: its first tooth is at `angle` + 2 pi
    # `turn`; shape (recordings,)
    turn: Integers
    # Correlation of measured and computed speed for each tooth with which the cycle may begin; one
    # column where the turn is known; shape (recordings, turns * groups)
    correlation: Floats
    # Intervals after the first tooth at which each recording begins, on a wheel that repeats; shape
    # (recordings,)
    late: Integers
    start: Floats  # Crank angle at which each recording begins [rad]; shape (recordings,)

    def from_first_tooth(self, rows: Iterable[Floats]) -> list[Floats]:
        """Intervals of a cycle, along the last axis of each recording, from the first tooth on."""
        return [np.roll(row, late, axis=-1) for row, late in zip(rows, self.late, strict=True)]


def cycles_of_turns(
    teeth: PassedTeeth, turns: int, first: int = 0, values: Floats | None = None
) -> Floats:
    """Raw speed of each whole cycle.

    Parameters
    ----------
    teeth : PassedTeeth
        Turns in a row.
    turns : int
        Turns of a cycle: 2 (four-stroke) or 1.
    first : int
        Whether cycles begin with turns of even (0) or odd (1) numbers.
    values : ndarray, shape (turns, teeth), optional
        Those of all turns, in place of the raw speeds.

    Returns
    -------
    ndarray, shape (cycles, turns * teeth)
        [rad/s].

    Raises
    ------
    ValueError
        For a recording without a whole cycle.
    """
    begin = np.flatnonzero(teeth.turn % turns == first % turns)
    begin = begin[begin + turns <= teeth.turn.size]
    begin = begin[teeth.turn[begin + turns - 1] == teeth.turn[begin] + turns - 1]
    if begin.size == 0:
        raise ValueError(
            f"measured speed: no whole cycle of {turns} turns among {teeth.turn.size} turns found"
        )
    values = teeth.speed if values is None else values
    return np.asarray(values[begin[:, None] + np.arange(turns)].reshape(begin.size, -1))


def fluctuation(cycles: Floats, errors: ToothErrors | None = None) -> Fluctuation:
    """Coefficient of speed fluctuation with its uncertainty.

    Parameters
    ----------
    cycles : ndarray, shape (cycles, intervals)
        Speed of each cycle [rad/s], as `cycles_of_turns` gives it.
    errors : ToothErrors, optional
        Taken out of it: docs/method.md (113).
    """
    unsure = np.zeros(cycles.shape[1])
    if errors is not None:
        turns = cycles.shape[1] // errors.error.size
        cycles = cycles * np.tile(1.0 + errors.error, turns)
        unsure = np.tile(np.nan_to_num(errors.uncertainty), turns)
    mean = cycles.mean(axis=0)
    level = mean.mean()
    count = len(cycles)
    spread = cycles / cycles.mean(axis=1, keepdims=True)
    spread = spread.std(axis=0, ddof=1) / np.sqrt(count) if count > 1 else 0.0 * mean
    variance = spread**2 + unsure**2
    top, bottom = int(np.argmax(mean)), int(np.argmin(mean))
    single = np.ptp(cycles, axis=1) / cycles.mean(axis=1)
    return Fluctuation(
        float((mean[top] - mean[bottom]) / level),
        float(np.sqrt(variance[top] + variance[bottom])) if count > 1 else float("nan"),
        float(single.mean()),
        float(single.std(ddof=1)) if count > 1 else float("nan"),
    )


def likeness(one: Floats, other: Floats, weight: Floats | None = None) -> tuple[float, float]:
    """Correlation and root mean square difference of two curves: docs/method.md (115).

    Parameters
    ----------
    one, other : ndarray, shape (n,)
        Values of the same places, each taken over its own mean.
    weight : ndarray, optional
        Such as the width of each interval.

    Returns
    -------
    correlation, rms : float
        The difference is relative to the mean [1].
    """
    share = np.ones(one.size) if weight is None else weight
    share = share / share.sum()
    first, second = one / (share @ one) - 1.0, other / (share @ other) - 1.0
    sizes = np.sqrt((share @ first**2) * (share @ second**2))
    correlation = float(share @ (first * second) / sizes) if sizes > 0.0 else float("nan")
    return correlation, float(np.sqrt(share @ (first - second) ** 2))


def find_gap_angle(
    raw: Floats,
    angle: Floats,
    speed: Floats,
    wheel: Wheel,
    period: float,
    gap_angle: float | None = None,
    used: Booleans | None = None,
    groups: int = 1,
    turn_known: bool = False,
) -> GapAngle:
    """Angle of the first tooth at which computed speeds are most like measured ones.

    Parameters
    ----------
    raw : ndarray, shape (recordings, turns * teeth)
        Mean raw speed of a cycle [rad/s], which may begin with any of its turns.
    angle : ndarray, shape (samples,)
        Angles of the computed speeds [rad], uniform over one cycle, its end left out.
    speed : ndarray, shape (recordings, samples)
        Computed speeds [rad/s].
    wheel : Wheel
        The same for all recordings.
    period : float
        Angle of the cycle [rad].
    gap_angle : float, optional
        Where it is known, only the turn is looked for.
    used : ndarray of bool, shape (teeth,), optional
        Intervals that count; all unless given.
    groups : int
        Teeth of a turn with which a recording could begin, see `Wheel.symmetry`. Without a known
        angle, that of the first recording is the first tooth.
    turn_known : bool
        Whether all cycles begin with their first turn, see `encoder.MarkedTeeth`.
    """
    turns = round(period / TURN)
    possible = 1 if turn_known else turns * groups
    width = np.tile(wheel.width, turns)
    sound = np.ones(wheel.teeth, dtype=bool) if used is None else used
    share = np.where(np.tile(sound, turns), width, 0.0)
    edges = np.concatenate([[0.0], np.cumsum(width)])
    step = TURN / groups
    count = round(step / SHIFTS) if gap_angle is None else 1
    shifts = (0.0 if gap_angle is None else gap_angle) + step / count * np.arange(count)
    shifts = wrapped(shifts, TURN)
    shifts.sort()
    correlation = np.empty((len(raw), possible, count))
    for place, (measured, computed) in enumerate(zip(raw, speed, strict=True)):
        fine, time = _clock(angle, computed, period)
        for steps in range(possible):
            for number, shift in enumerate(shifts):
                start = (shift + step * steps - fine[0]) % period + fine[0]
                seen = width / np.diff(np.interp(start + edges, fine, time))
                correlation[place, steps, number] = likeness(measured, seen, share)[0]
    best = int(np.argmax(correlation.max(axis=1).mean(axis=0)))
    steps = correlation[:, :, best].argmax(axis=1)
    start = shifts[best] + step * steps
    first = float(shifts[best])
    if gap_angle is None:
        first = float(wrapped(start[0], TURN))
        steps = np.rint((start - first) / step).astype(np.int64) % (turns * groups)
    turn, late = steps // groups, steps % groups * (wheel.teeth // groups)
    gap = GapAngle(first, turn, correlation[:, :, best], late, first + step * steps)
    if gap_angle is not None:
        return gap
    in_order = np.array(gap.from_first_tooth(raw))
    starts = first + TURN * turn
    change = _without_errors(in_order, angle, speed, wheel, period, starts, sound)
    return replace(gap, angle=first + change, start=gap.start + change)


def _without_errors(
    raw: Floats, angle: Floats, speed: Floats, wheel: Wheel, period: float, starts: Floats,
    used: Booleans,
) -> float:  # fmt: skip
    """Change of the gap's angle by the part of the speed that errors of teeth cannot cause.

    Errors of the teeth are the same in all turns and recordings: the mean of the logarithms over
    them is left out on both sides, docs/method.md (110). Where nothing is left, there is no change.
    """
    turns = round(period / TURN)
    width = np.tile(wheel.width, turns)
    edges = np.concatenate([[0.0], np.cumsum(width)])

    def rest(speeds: Floats) -> Floats:
        logs = np.log(speeds).reshape(len(speeds), turns, -1)[:, :, used]
        logs = logs - logs.mean(axis=(1, 2), keepdims=True)
        return np.asarray(logs - logs.mean(axis=(0, 1))).reshape(-1, logs.shape[2])

    wanted, share = rest(raw), wheel.width[used]
    if len(wanted) < 2:
        return 0.0
    clocks = [_clock(angle, one, period) for one in speed]
    changes = NEAR * np.linspace(-1.0, 1.0, 2 * round(NEAR / SHIFTS) + 1)
    alike = np.empty(changes.size)
    for place, change in enumerate(changes):
        shown = [
            width / np.diff(np.interp((s + change - f[0]) % period + f[0] + edges, f, time))
            for (f, time), s in zip(clocks, starts, strict=True)
        ]
        one = rest(np.array(shown))
        alike[place] = np.sum(one * wanted * share) / np.sqrt(
            np.sum(one * one * share) * np.sum(wanted * wanted * share) + 1e-300
        )
    best = int(np.argmax(alike))
    if not 0 < best < changes.size - 1:
        return 0.0
    before, here, after = alike[best - 1 : best + 2]
    bend = before - 2.0 * here + after
    return float(changes[best] + (0.5 * (before - after) / bend * SHIFTS if bend < 0.0 else 0.0))


def _clock(angle: Floats, speed: Floats, period: float) -> tuple[Floats, Floats]:
    """Time over the angle of two cycles, by trapezoids of at most a tenth of a degree."""
    parts = max(-(-3600 * round(period / TURN) // angle.size), 1)
    count = angle.size * parts
    fine = angle[0] + period / count * np.arange(2 * count + 1)
    slow = np.interp(fine, angle, 1.0 / speed, period=period)
    steps = 0.5 * (slow[1:] + slow[:-1]) * period / count
    return fine, np.concatenate([[0.0], np.cumsum(steps)])


def orders_of_samples(
    speed: Floats, middle: Floats, width: Floats, orders: Floats
) -> tuple[Floats, Floats]:
    """Orders of a speed that is known as means between teeth, by least squares.

    The mean of a wave over an interval is smaller than the wave, docs/method.md (114); this is
    undone, also where intervals are of unequal width, such as a gap.

    Parameters
    ----------
    speed : ndarray, shape (..., n)
        Means over intervals of one cycle [rad/s].
    middle, width : ndarray, shape (n,)
        Middle and width of each [rad].
    orders : ndarray, shape (m,)
        Orders of the crank's turn, such as 0.5, 1, ...; fewer than n/2.

    Returns
    -------
    amplitude, phase : ndarray, shape (..., m)
        Of cosines, in rad/s and rad: sum of amplitude cos(order phi + phase).
    """
    damping = np.sinc(orders * width[:, None] / TURN)  # sin(x)/x, x half an interval's phase
    waves = np.hstack(
        [
            np.ones((middle.size, 1)),
            damping * np.cos(orders * middle[:, None]),
            damping * np.sin(orders * middle[:, None]),
        ]
    )
    share = np.sqrt(width)[:, None]
    solution, *_ = np.linalg.lstsq(waves * share, (speed * share[:, 0]).T, rcond=None)
    cosine, sine = solution[1 : 1 + orders.size].T, solution[1 + orders.size :].T
    return np.hypot(cosine, sine), np.arctan2(-sine, cosine)


def speed_over_angle(means: Floats, edges: Floats, angle: Floats) -> Floats:
    """Speed at any angles from means between teeth: the slope of a periodic spline through time.

    Parameters
    ----------
    means : ndarray, shape (n,)
        Angle over time between the edges [rad/s].
    edges : ndarray, shape (n + 1,)
        Ascending [rad], over one cycle.
    angle : ndarray
        [rad], anywhere.

    Returns
    -------
    ndarray
        [rad/s]; its means between the edges are those given.
    """
    period = float(edges[-1] - edges[0])
    width = np.diff(edges)
    time = np.concatenate([[0.0], np.cumsum(width / means)])
    slow = time[-1] / period
    swing = time - slow * (edges - edges[0])
    slope = periodic_spline_slopes(edges[:-1], swing[:-1], period)
    slope = np.append(slope, slope[0])
    at = (np.asarray(angle, dtype=float) - edges[0]) % period + edges[0]
    place = np.clip(np.searchsorted(edges, at, side="right") - 1, 0, width.size - 1)
    u = (at - edges[place]) / width[place]
    rise = (swing[place + 1] - swing[place]) / width[place]
    derivative = (
        6.0 * u * (1.0 - u) * rise
        + (1.0 - u) * (1.0 - 3.0 * u) * slope[place]
        + u * (3.0 * u - 2.0) * slope[place + 1]
    )
    return np.asarray(1.0 / (slow + derivative))


FEWEST = 8  # Intervals of a single cycle from which a drift can be told


class Drift(NamedTuple):
    """Change of a speed over a recording."""

    # Speeds at the beginning and end of a run, without its periodic part [rad/s].
    first: float
    last: float
    cycles: float  # Cycles between both speeds

    @property
    def in_a_cycle(self) -> float:
        """Relative change of the speed in a cycle."""
        return float(np.expm1(np.log(self.last / self.first) / max(self.cycles, 0.5)))


class SteadySpeeds(NamedTuple):
    """Speeds of cycles, and the drift that was taken out of them; None where there is none."""

    cycles: Floats  # Speed [rad/s]; each cycle keeps its own mean; shape (cycles, intervals)
    drift: Drift | None  # Largest drift of the runs between faults
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
    return _steady(cycles, level, width, drift, 0.0)


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
    return _steady(cycles, over, width, drift, left_out)


def _level_of_run(teeth: PassedTeeth, run: Integers, n: int) -> tuple[Floats, Drift | None]:
    """Speed level of consecutive turns, with the intervals before and after them."""
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
    """Speeds of an incomplete turn after the last one, as far as its pattern continues."""
    gaps = np.diff(np.concatenate([[last], times[: width.size - 1]]))
    here = width[: gaps.size] / gaps
    ratio = here / speed[: gaps.size]
    wrong = np.flatnonzero((ratio > FACTOR) | (ratio < 1.0 / FACTOR))
    return np.asarray(here[: wrong[0]] if wrong.size else here)


def _level(speed: Floats, width: Floats, n: int) -> tuple[Floats, Drift | None]:
    """Mean square of consecutive speeds over `n` around each, and the drift; None if unknown."""
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
        # One cycle alone has no second level: its own rises from beginning to end by the factor of
        # the step from its end to its beginning.
        start = end = 2.0 * np.tanh(0.5 * _step(np.log(square), width)) * mean[0] / period
    level = np.interp(middle, centre, mean)
    level += np.minimum(middle - centre[0], 0.0) * start
    level += np.maximum(middle - centre[-1], 0.0) * end
    if start == end == 0.0 or not np.all(level > 0.0):
        return np.full(speed.size, mean.mean()), None
    cycles = float(middle[-1] - middle[0]) / period
    return level, Drift(float(np.sqrt(level[0])), float(np.sqrt(level[-1])), cycles)


def _step(values: Floats, width: Floats) -> float:
    """Step from a single cycle's end to its beginning; 0 if it is like steps elsewhere."""
    if values.size < FEWEST:
        return 0.0
    slope = np.diff(values) / (0.5 * (width[1:] + width[:-1]))
    after = values[1:] + slope * 0.5 * width[1:]  # values at the edge after an interval
    before = values[:-1] - slope * 0.5 * width[:-1]  # values at the edge before an interval
    step, within = float(after[-1] - before[0]), after[:-2] - before[2:]
    # A step is drift where it exceeds the root mean square of those between neighbouring intervals
    # elsewhere by more than the factor below.
    return step if abs(step) > 4.0 * float(np.sqrt(np.mean(within**2))) else 0.0


def _steady(
    cycles: Floats, level: Floats, width: Floats, drift: Drift | None, left_out: float
) -> SteadySpeeds:
    """Cycles scaled to the level of their own means, unless that hardly changes their mean."""
    own = level @ width / width.sum()
    steady = np.asarray(cycles * np.sqrt(own[:, None] / level))
    mean = steady.mean(axis=0)
    # A drift is removed if it changes the speed by more than this fraction of the remaining
    # fluctuation in a cycle, or by the whole of it in all, as in a slow run-up.
    fluctuation = float(np.ptp(mean) / mean.mean())
    if drift is not None and (
        abs(drift.in_a_cycle) >= 0.05 * fluctuation
        or abs(drift.last / drift.first - 1.0) >= fluctuation
    ):
        return SteadySpeeds(steady, drift, left_out)
    return SteadySpeeds(cycles, None, left_out)
