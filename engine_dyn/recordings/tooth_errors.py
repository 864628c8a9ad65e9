"""Tooth spacing errors and the speed: what a wheel shows, and what can be told apart.

Errors of the teeth repeat every turn, the speed of a four-stroke engine every two turns. See
docs/method.md section 15.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from engine_dyn.geometry.toothed_wheel import TURN, Wheel
from engine_dyn.recordings.teeth import PassedTeeth
from engine_dyn.time_over_angle import time_harmonics
from engine_dyn.types import Booleans, Floats

AROUND = 5  # Neighbours on each side of an interval from which its error is found


@dataclass(frozen=True, eq=False)
class ToothErrors:
    """Relative errors of the wheel's intervals."""

    # Tooth error eps: the interval from tooth j to the next is (1 + eps_j) times as wide as
    # nominal; all widths still make a turn; shape (teeth,)
    error: Floats
    # Standard error of each tooth error: over recordings where there are several, otherwise over
    # turns; shape (teeth,)
    uncertainty: Floats


def speed_between(angle: Floats, speed: Floats, edges: Floats, period: float) -> Floats:
    """Angle over time between angles, for a speed that repeats: docs/method.md (108).

    Parameters
    ----------
    angle : ndarray, shape (samples,)
        Angles [rad], uniform over one cycle, its end left out.
    speed : ndarray, shape (..., samples)
        [rad/s].
    edges : ndarray, shape (n + 1,)
        Ascending angles [rad], anywhere.
    period : float
        Angle of the cycle [rad].

    Returns
    -------
    ndarray, shape (..., n)
        [rad/s].
    """
    time = _time_at(angle, speed, edges, period)
    return np.asarray(np.diff(edges) / np.diff(time, axis=-1))


def _time_at(angle: Floats, speed: Floats, at: Floats, period: float) -> Floats:
    """Integral of 1/omega up to some angles [s], exact for the harmonics that samples resolve."""
    mean, terms, rate = time_harmonics(speed, period)
    since = np.ravel(at) - angle[0]
    swing = 2.0 * np.einsum("...k,nk->...n", terms, np.exp(1j * rate * since[:, None])).real
    return np.asarray(swing + mean[..., None] * since)


def speed_through_wheel(
    angle: Floats,
    speed: Floats,
    wheel: Wheel,
    gap_angle: float,
    period: float,
    errors: Floats | float = 0.0,
) -> Floats:
    """Speed that a wheel shows: averaged between its teeth, times their errors.

    docs/method.md (109).

    Parameters
    ----------
    angle, speed, period
        As `speed_between`.
    wheel : Wheel
        Its pattern.
    gap_angle : float
        Crank angle at which the first tooth after the longest gap passes [rad].
    errors : ndarray, shape (teeth,), or 0
        See `ToothErrors`.

    Returns
    -------
    ndarray, shape (..., turns * teeth)
        Nominal width of each interval over the time that it takes [rad/s], for the turns of a
        cycle, from the first tooth at `gap_angle`.
    """
    turns = round(period / TURN)
    width = np.tile(wheel.width * (1.0 + errors), turns)
    edges = gap_angle + np.concatenate([[0.0], np.cumsum(width)])
    time = _time_at(angle, speed, edges, period)
    return np.asarray(np.tile(wheel.width, turns) / np.diff(time, axis=-1))


def tooth_errors(raw: Floats, model: Floats, wheel: Wheel) -> ToothErrors:
    """Tooth errors from raw speeds and the speeds that a model says: docs/method.md (111).

    Parameters
    ----------
    raw : ndarray, shape (..., turns, teeth)
        Nominal width of each interval over its time [rad/s]; leading dimensions are recordings,
        and turns are those of a cycle, or of a recording.
    model : ndarray, of the same shape
        Speed between the same teeth [rad/s]; only its ratios within each recording matter.
    wheel : Wheel
        Its pattern.

    Returns
    -------
    ToothErrors
        The model's own error in what repeats every turn is in them, and their uncertainty does not
        know of it.
    """
    ratio = np.log(model) - np.log(raw)
    recordings = ratio.mean(axis=-2)
    each = np.array([_closed(one, wheel) for one in recordings.reshape(-1, wheel.teeth)])
    if len(each) > 1:
        spread = each.std(axis=0, ddof=1) / np.sqrt(len(each))
    else:
        turns = ratio.reshape(-1, wheel.teeth)
        turns = turns - turns.mean(axis=1, keepdims=True)
        count = len(turns)
        spread = turns.std(axis=0, ddof=1) / np.sqrt(count) if count > 1 else np.full(
            wheel.teeth, np.nan
        )  # fmt: skip
    return ToothErrors(each.mean(axis=0), spread)


def _closed(ratio: Floats, wheel: Wheel) -> Floats:
    """Errors whose widths make a turn, from logarithms that lack a common constant."""
    width = wheel.width * np.exp(ratio - ratio.mean())
    return np.asarray(width * (TURN / width.sum()) / wheel.width - 1.0)


def sound_intervals(raw: Floats, wheel: Wheel) -> Booleans:
    """Intervals of the wheel that are not far off their neighbours in every turn.

    Parameters
    ----------
    raw : ndarray, shape (..., turns * teeth)
        Mean raw speeds [rad/s].
    wheel : Wheel
        Its pattern.

    Returns
    -------
    ndarray of bool, shape (teeth,)

    Notes
    -----
    Beside a gap, inductive sensors see teeth at other places, off by a tenth of a pitch and more.
    Far off is by more than ten times the median deviation of all intervals, and by more than
    2 percent.
    """
    mean = np.log(raw).reshape(-1, wheel.teeth).mean(axis=0)
    around = np.stack([np.roll(mean, shift) for shift in range(-AROUND, AROUND + 1)])
    off = np.abs(mean - np.median(around, axis=0))
    if wheel.teeth < 4 * AROUND or wheel.even:
        return np.ones(wheel.teeth, dtype=bool)
    return np.asarray(off <= max(10.0 * float(np.median(off)), 0.02))


def coasting_speed(teeth: PassedTeeth, degree: int = 3) -> Floats:
    """Speed of a run without torques that change over the turn, such as coasting with open valves.

    The time of a whole turn does not depend on the teeth. A polynomial through the times at which
    whole turns are complete gives the time of every interval between.

    Parameters
    ----------
    teeth : PassedTeeth
        The run; at least `degree` + 1 turns.
    degree : int
        Of the polynomial of time over angle.

    Returns
    -------
    ndarray, shape (turns, teeth)
        [rad/s], a model for `tooth_errors`. Where pistons move, multiply it by the mean of
        1/sqrt(Theta(phi)) between the teeth: docs/method.md (112).

    Raises
    ------
    ValueError
        For fewer turns.
    """
    if len(teeth.turn) <= degree:
        raise ValueError(f"coasting run: {len(teeth.turn)} turns; must be at least {degree + 1}")
    whole = np.append(teeth.turn, teeth.turn[-1] + 1).astype(float)
    fit = np.polynomial.Polynomial.fit(
        whole, np.append(teeth.time[:, 0], teeth.time[-1, -1]), degree
    )
    within = np.append(teeth.wheel.angle, TURN) / TURN
    return np.asarray(teeth.wheel.width / np.diff(fit(teeth.turn[:, None] + within), axis=1))


def orders_without_wheel(raw: Floats, wheel: Wheel) -> tuple[Floats, Floats]:
    """Half orders of a four-stroke engine's speed, which no tooth error can change.

    docs/method.md (110).

    Parameters
    ----------
    raw : ndarray, shape (2, teeth)
        Mean raw speed of both turns of a cycle [rad/s].
    wheel : Wheel
        Its pattern.

    Returns
    -------
    difference : ndarray, shape (teeth,)
        Half the difference of the logarithms of both turns.
    relative : ndarray, shape (teeth,)
        What remains: their mean, in which the speed's whole orders and the errors are one.
    """
    logs = np.log(raw)
    return 0.5 * (logs[0] - logs[1]), 0.5 * (logs[0] + logs[1])
