"""Speed over the cycle from the teeth of a wheel: mean and spread over cycles, fluctuation."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from engine_dyn.recordings.teeth import PassedTeeth
from engine_dyn.recordings.tooth_errors import ToothErrors, speed_through_wheel
from engine_dyn.recordings.wheel import TURN
from engine_dyn.types import Floats

__all__ = [
    "Fluctuation",
    "cycles_of_turns",
    "find_gap_angle",
    "fluctuation",
    "likeness",
    "orders_of_samples",
]

SHIFTS = 0.5 * np.pi / 180.0
"""Step of the angles that are tried for the gap [rad]; a parabola refines the best one."""


@dataclass(frozen=True)
class Fluctuation:
    """Coefficient of speed fluctuation of a measured speed.

    Attributes
    ----------
    delta : float
        (max - min)/mean of the mean over cycles.
    uncertainty : float
        Its standard error: of the two extreme values over cycles, and of the errors of their teeth
        where these are taken out.
    of_cycles : float
        Mean of delta over single cycles; noise makes it larger than `delta`.
    scatter : float
        Standard deviation of delta over single cycles.
    """

    delta: float
    uncertainty: float
    of_cycles: float
    scatter: float


def cycles_of_turns(teeth: PassedTeeth, turns: int, first: int = 0) -> Floats:
    """Raw speed of each whole cycle.

    Parameters
    ----------
    teeth : PassedTeeth
        Turns in a row.
    turns : int
        Turns of a cycle: 2 (four-stroke) or 1.
    first : int
        Whether cycles begin with turns of even (0) or odd (1) numbers.

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
    return np.asarray(teeth.speed[begin[:, None] + np.arange(turns)].reshape(begin.size, -1))


def fluctuation(cycles: Floats, errors: ToothErrors | None = None) -> Fluctuation:
    """Coefficient of speed fluctuation with its uncertainty.

    Parameters
    ----------
    cycles : ndarray, shape (cycles, intervals)
        Speed of each cycle [rad/s], as `cycles_of_turns` gives it.
    errors : ToothErrors, optional
        Taken out of it: docs/method.md (147).
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
    """Correlation and root mean square difference of two curves: docs/method.md (149).

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
    raw: Floats, angle: Floats, speed: Floats, teeth: PassedTeeth, period: float
) -> tuple[float, float]:
    """Angle of the first tooth at which a computed speed is most like a measured one.

    Parameters
    ----------
    raw : ndarray, shape (turns * teeth,)
        Mean raw speed of a cycle [rad/s].
    angle, speed, period
        The computed speed, as `tooth_errors.speed_between` takes it.
    teeth : PassedTeeth
        Whose wheel it is.

    Returns
    -------
    gap_angle : float
        [rad], from -period/2 to period/2.
    correlation : float
        There.
    """
    shifts = np.arange(0.0, period, SHIFTS)

    def at(shift: float) -> float:
        seen = speed_through_wheel(angle, speed, teeth.wheel, shift, period)
        return likeness(raw, seen, np.tile(teeth.wheel.width, round(period / TURN)))[0]

    found = np.array([at(float(shift)) for shift in shifts])
    best = int(np.argmax(found))
    before, here, after = found[best - 1], found[best], found[(best + 1) % found.size]
    bend = before - 2.0 * here + after
    shift = float(shifts[best]) + (0.5 * (before - after) / bend * SHIFTS if bend < 0.0 else 0.0)
    return float((shift + 0.5 * period) % period - 0.5 * period), float(here)


def orders_of_samples(
    speed: Floats, middle: Floats, width: Floats, orders: Floats
) -> tuple[Floats, Floats]:
    """Orders of a speed that is known as means between teeth, by least squares.

    The mean of a wave over an interval is smaller than the wave, docs/method.md (148); this is
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
