"""A mark that passes a second sensor once a revolution or once a cycle, and the wheel beside it."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from engine_dyn.geometry.toothed_wheel import TURN
from engine_dyn.periodic_spline import wrapped
from engine_dyn.recordings.encoder import crossings
from engine_dyn.recordings.teeth import PassedTeeth, find_turns
from engine_dyn.types import Floats
from engine_dyn.units import DEGREE

__all__ = ["ASIDE", "MarkedTeeth", "mark_times", "teeth_from_mark"]

ASIDE = 5.0 * DEGREE
"""How far a mark may pass from its usual place on the wheel [rad]."""


BAND = 0.2
"""Half the band of the hysteresis of a sampled mark, as a fraction of its swing."""


class MarkedTeeth(NamedTuple):
    """Teeth counted from a mark.

    Attributes
    ----------
    teeth : PassedTeeth
        Their first tooth is the one nearest to the mark, where several could be the first one.
    angle : float
        Crank angle [rad] at which the first tooth passes, from -pi to pi.
    turn_known : bool
        Whether the mark passes once a cycle. If so, turns of even numbers are the first of a cycle:
        those whose first tooth passes at `angle`.
    """

    teeth: PassedTeeth
    angle: float
    turn_known: bool


def mark_times(level: Floats, interval: float) -> Floats:
    """Times [s] at which the signal of a mark rises through half its swing.

    Parameters
    ----------
    level : ndarray, shape (samples,)
        Its samples.
    interval : float
        Time between them [s].
    """
    low, swing = float(level.min()), float(np.ptp(level))
    return crossings(level, low + 0.5 * swing, BAND * swing).time * interval


def teeth_from_mark(
    teeth: PassedTeeth, time: Floats, marks: Floats, angle: float, turns: int
) -> MarkedTeeth:
    """Find where a wheel is on the crankshaft by a mark.

    Parameters
    ----------
    teeth : PassedTeeth
        Turns of the wheel, found in `time`.
    time : ndarray, shape (pulses,)
        Times of all its pulses [s].
    marks : ndarray
        Times at which the mark passes [s].
    angle : float
        Crank angle at which it passes [rad].
    turns : int
        Turns of a cycle: 2 (four-stroke) or 1.

    Raises
    ------
    ValueError
        In one line: a mark that passes fewer than twice, or neither once a revolution nor once a
        cycle.
    """
    wheel = teeth.wheel
    alike = wheel.teeth if wheel.even else wheel.symmetry
    at, period = _places(teeth, marks, turns)
    step = round(_mean(at, TURN) * alike / TURN) % alike
    if step:  # of the teeth that could be the first one, the nearest to the mark
        teeth = find_turns(time, wheel, teeth.first + step * (wheel.teeth // alike))
        at, period = _places(teeth, marks, turns)
    place = _mean(at, period)
    aside = np.abs(wrapped(at - place, period)).max()
    if aside > ASIDE:
        raise ValueError(
            f"mark: passes up to {aside / DEGREE:.3g} degrees beside its mean place on the wheel; "
            f"must be {ASIDE / DEGREE:g} at most, once a revolution or once a cycle"
        )
    first = float(wrapped(angle - place, TURN))
    known = turns > 1 and period > TURN
    if known:
        late = round((angle - place - first) / TURN) % turns
        teeth = replace(teeth, turn=teeth.turn + late)
    return MarkedTeeth(teeth, first, known)


def _places(teeth: PassedTeeth, marks: Floats, turns: int) -> tuple[Floats, float]:
    """Angles at which the mark passes, from the first tooth of turn 0, and its period [rad]."""
    at = teeth.angle_at(marks)
    at = at[np.isfinite(at)]
    apart = float(np.median(np.diff(at))) / TURN if at.size > 1 else 0.0
    if round(apart) not in (1, turns) or abs(apart - round(apart)) > ASIDE / TURN:
        every = f", every {apart:.3g} revolutions" if at.size > 1 else ""
        raise ValueError(
            f"mark: passes {at.size} times in whole revolutions{every}; must be twice or more, "
            "once a revolution or once a cycle"
        )
    return at, round(apart) * TURN


def _mean(at: Floats, period: float) -> float:
    """Mean of angles that repeat with a period, from minus half of it to half of it."""
    turning = np.exp(1j * TURN * at / period).mean()
    return float(np.angle(turning)) * period / TURN
