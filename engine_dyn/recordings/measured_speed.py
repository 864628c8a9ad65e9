"""Speed over the cycle from the teeth of a wheel: mean and spread over cycles, fluctuation."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from engine_dyn.geometry.toothed_wheel import TURN, Wheel
from engine_dyn.periodic_spline import periodic_spline_slopes, wrapped
from engine_dyn.recordings.teeth import PassedTeeth
from engine_dyn.recordings.tooth_errors import ToothErrors
from engine_dyn.types import Booleans, Floats, Integers

__all__ = [
    "Fluctuation",
    "GapAngle",
    "cycles_of_turns",
    "find_gap_angle",
    "fluctuation",
    "likeness",
    "orders_of_samples",
    "speed_over_angle",
]

SHIFTS = 0.5 * np.pi / 180.0
"""Step of the angles that are tried for the gap [rad]; a parabola refines the best one."""

NEAR = 12.0 * np.pi / 180.0
"""How far from the greatest likeness of the raw speeds the gap is looked for without errors of
teeth [rad]."""


@dataclass(frozen=True)
class Fluctuation:
    """Coefficient of speed fluctuation of a measured speed."""

    delta: float  # (max - min)/mean of the mean over cycles
    # Uncertainty: its standard error: of the two extreme values over cycles, and of the errors of
    # their teeth where these are taken out.
    uncertainty: float
    of_cycles: float  # Mean of delta over single cycles; noise makes it larger than `delta`
    scatter: float  # Standard deviation of delta over single cycles


@dataclass(frozen=True, eq=False)
class GapAngle:
    """Where a wheel is on its crankshaft, by the likeness of speeds."""

    # Crank angle at which the first tooth after the longest gap passes [rad], -pi to pi.
    angle: float
    # With which turn of the cycle each recording begins: its first tooth is at `angle` + 2 pi
    # `turn`; shape (recordings,)
    turn: Integers
    # Correlation of measured and computed speed, for each tooth that it could begin with; one
    # column where the turn is known; shape (recordings, turns * groups)
    correlation: Floats
    # How many intervals after the first tooth each recording begins, on a wheel that repeats; shape
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
        Whether all cycles begin with their first turn, see `marks.MarkedTeeth`.
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
    found = np.empty((len(raw), possible, count))
    for place, (measured, computed) in enumerate(zip(raw, speed, strict=True)):
        fine, time = _clock(angle, computed, period)
        for steps in range(possible):
            for number, shift in enumerate(shifts):
                start = (shift + step * steps - fine[0]) % period + fine[0]
                seen = width / np.diff(np.interp(start + edges, fine, time))
                found[place, steps, number] = likeness(measured, seen, share)[0]
    best = int(np.argmax(found.max(axis=1).mean(axis=0)))
    steps = found[:, :, best].argmax(axis=1)
    start = shifts[best] + step * steps
    first = float(shifts[best])
    if gap_angle is None:
        first = float(wrapped(start[0], TURN))
        steps = np.rint((start - first) / step).astype(np.int64) % (turns * groups)
    turn, late = steps // groups, steps % groups * (wheel.teeth // groups)
    gap = GapAngle(first, turn, found[:, :, best], late, first + step * steps)
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
    """Change of the gap's angle that the part of the speeds asks for that no teeth can make.

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
    """Time over the angle of two cycles, by trapezoids of a tenth of a degree or finer."""
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
    damping = np.sinc(orders * width[:, None] / TURN)  # sin(x)/x of half the interval's phase
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
