"""Crossings of a sampled encoder signal: times at which teeth pass, between the samples.

The threshold is chosen so that the crossings fit the wheel; see `teeth_of_signal`. A channel with
one mark a turn or a cycle tells where the wheel stands.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from engine_dyn.geometry.toothed_wheel import TURN, Wheel
from engine_dyn.periodic_spline import wrapped
from engine_dyn.recordings.teeth import PassedTeeth, find_turns
from engine_dyn.types import Floats, Integers
from engine_dyn.units import DEGREE

FEWEST_SAMPLES = 4.0  # Samples between teeth below which pulses may be missed

LARGEST = 1e50
"""Largest value of a signal, in whatever unit; its swing must exceed the inverse of this."""


@dataclass(frozen=True)
class Crossings:
    """Crossings of one threshold in one direction.

    Attributes
    ----------
    time : ndarray
        Times of the crossings, in samples from the first one.
    threshold, hysteresis : float
        In the unit of the signal; a crossing counts when the signal goes on to threshold +
        hysteresis, after it was below threshold - hysteresis (rising).
    edge : str
        ``rising`` or ``falling``.
    """

    time: Floats
    threshold: float
    hysteresis: float
    edge: str


@dataclass(frozen=True, eq=False)
class EncoderSignal:
    """Teeth that a sampled signal shows, and how they were found.

    Attributes
    ----------
    teeth : PassedTeeth
        Turns in which the wheel was found, their times in seconds.
    crossings : Crossings
        Threshold, hysteresis and edge.
    low, high : float
        Levels of the signal between and at teeth: its 2nd and 98th percentile.
    samples_per_tooth : float
        Median number of samples from one tooth to the next one.
    remarks : tuple of str
        What was seen, a line each.
    """

    teeth: PassedTeeth
    crossings: Crossings
    low: float
    high: float
    samples_per_tooth: float
    remarks: tuple[str, ...]


def crossings(
    signal: Floats, threshold: float, hysteresis: float, edge: str = "rising"
) -> Crossings:
    """Find where a signal crosses a threshold in one direction, between its samples.

    Parameters
    ----------
    signal : ndarray, shape (samples,)
        Equidistant samples.
    threshold, hysteresis : float
        A rising crossing counts when the signal reaches threshold + hysteresis after it was below
        threshold - hysteresis; its time is that of the last passage of the threshold before. A
        falling one is a rising one of the negative signal.
    edge : {"rising", "falling"}
        Which.

    Returns
    -------
    Crossings
        Passages are interpolated by the cubic through four samples. Of an edge that passes within
        two or three samples, the straight line between two would be wrong by some hundredths of
        their distance.
    """
    sign = 1.0 if edge == "rising" else -1.0
    turned, level = sign * signal, sign * threshold
    # States are +1 above the band and -1 below it; samples within the band keep the previous state.
    above, below = turned >= level + hysteresis, turned <= level - hysteresis
    outside = np.flatnonzero(above | below)
    up = above[outside]
    reached = outside[1:][up[1:] & ~up[:-1]]
    beyond = turned >= level
    passed = np.flatnonzero(beyond[1:] & ~beyond[:-1])
    before: Integers = passed[np.searchsorted(passed, reached) - 1] if reached.size else reached
    return Crossings(_passages(signal, before, threshold), threshold, hysteresis, edge)


def _passages(signal: Floats, before: Integers, threshold: float) -> Floats:
    """Place where the cubic through four samples passes the threshold: docs/method.md (106)."""
    first = np.clip(before, 1, signal.size - 3) if signal.size > 3 else before
    ends = (first != before) if signal.size > 3 else np.ones(before.size, dtype=bool)
    here, after = signal[before], signal[before + 1]
    straight = (threshold - here) / (after - here)
    if ends.all():
        return np.asarray(before + straight, dtype=float)
    y0, y1, y2, y3 = (signal[first + place] - threshold for place in (-1, 0, 1, 2))
    # Newton's form of the polynomial, in powers of the place between the middle samples.
    cubic = (y3 - 3.0 * y2 + 3.0 * y1 - y0) / 6.0
    square = 0.5 * (y2 - 2.0 * y1 + y0)
    linear = y2 - y1 - square - cubic
    low, high = np.zeros(before.size), np.ones(before.size)
    place = np.clip(straight, 0.0, 1.0)
    # Newton's method on a cubic, with halving where a step leaves the bracket; three or four steps
    # suffice where the cubic is nearly straight.
    for _ in range(8):
        value = y1 + place * (linear + place * (square + place * cubic))
        slope = linear + place * (2.0 * square + place * 3.0 * cubic)
        onwards = (value < 0.0) == (y1 < 0.0)
        low, high = np.where(onwards, place, low), np.where(onwards, high, place)
        with np.errstate(divide="ignore", invalid="ignore"):
            step = place - value / slope
        place = np.where((step >= low) & (step <= high), step, 0.5 * (low + high))
    return np.asarray(before + np.where(ends, straight, place), dtype=float)


def teeth_of_signal(
    signal: Floats,
    interval: float,
    wheel: Wheel,
    *,
    threshold: float | None = None,
    hysteresis: float | None = None,
    edge: str | None = None,
    first: int | None = None,
) -> EncoderSignal:
    """Find the teeth of a wheel in a sampled signal.

    Parameters
    ----------
    signal : ndarray, shape (samples,)
        Equidistant samples of the sensor, such as volts.
    interval : float
        Time between samples [s].
    wheel : Wheel
        Its pattern.
    threshold, hysteresis, edge : optional
        As `crossings`. Each that is not given is tried: thresholds from a tenth to nine tenths of
        the swing, both edges. The one with the fewest faults is taken, and of several that are as
        good the one whose intervals repeat best from turn to turn.
    first : int, optional
        As `find_turns`.

    Returns
    -------
    EncoderSignal

    Raises
    ------
    ValueError
        One line: a signal that is too short, does not swing, has values that are not numbers, is
        sampled too slowly, or in which the pattern is not found (with what was found instead).
    """
    signal = _checked(signal, wheel)
    # Some 200 000 samples, evenly spread, tell both levels well enough.
    low, high = np.percentile(signal[:: max(signal.size // 200_000, 1)], [2.0, 98.0]).tolist()
    swing = high - low
    if not swing > 1.0 / LARGEST:
        raise ValueError(f"encoder signal: is constant at {low:g}")
    # Thresholds to try, as fractions of the swing.
    heights = (
        (0.5, 0.35, 0.2, 0.1, 0.05, 0.65, 0.8, 0.9)
        if threshold is None
        else ((threshold - low) / swing,)
    )
    edges = ("rising", "falling") if edge is None else (edge,)
    tries = []
    for height in heights:
        # A ripple within the hysteresis does not count; the hysteresis is narrower for a threshold
        # near an end of the signal's swing.
        band = min(0.06, 0.4 * min(height, 1.0 - height)) * swing
        band = band if hysteresis is None else hysteresis
        tries += [(low + height * swing, band, one) for one in edges]
    tried = _passed(signal, interval, wheel, tries, first)
    if not tried:
        raise ValueError(
            f"encoder signal: fewer than {wheel.teeth + 1} pulses between {low:g} and {high:g}; "
            f"a turn of the wheel {wheel.text} has {wheel.teeth}"
        )
    # Another edge or threshold may cost the turn that an end of the recording cuts off, not more.
    most = max(len(teeth.turn) for teeth, _ in tried)
    good = [one for one in tried if len(one[0].turn) >= most - 1]
    least = min(teeth.lost for teeth, _ in good)
    teeth, chosen = min(
        (one for one in good if one[0].lost <= least + 1e-9), key=lambda one: one[0].scatter
    )
    samples = float(np.median(np.diff(chosen.time)))
    remarks = [
        f"threshold {chosen.threshold:.4g} ± {chosen.hysteresis:.2g} ({chosen.edge} edge; the "
        f"signal swings from {low:.4g} to {high:.4g})",
        *_clipped(signal),
    ]
    if samples < FEWEST_SAMPLES:
        remarks.append(
            f"{samples:.2g} samples from tooth to tooth: below {FEWEST_SAMPLES:g}, teeth may pass "
            "between samples (aliasing)"
        )
    return EncoderSignal(teeth, chosen, low, high, samples, (*remarks, *teeth.faults))


def _checked(signal: Floats, wheel: Wheel) -> Floats:
    """The samples as floats; ValueError refuses those in which no wheel can be found."""
    signal = np.asarray(signal, dtype=float)
    if signal.ndim != 1 or signal.size < 3 * wheel.teeth:
        raise ValueError(
            f"encoder signal: {signal.size} samples; must be at least three for each of "
            f"{wheel.teeth} teeth"
        )
    if not np.isfinite(signal).all():
        place = int(np.flatnonzero(~np.isfinite(signal))[0])
        raise ValueError(f"encoder signal: sample {place + 1} is not a number")
    if not np.max(np.abs(signal)) < LARGEST:
        raise ValueError(f"encoder signal: values must be below {LARGEST:g}")
    return signal


def _passed(
    signal: Floats, interval: float, wheel: Wheel, tries: Sequence[tuple[float, float, str]],
    first: int | None,
) -> list[tuple[PassedTeeth, Crossings]]:  # fmt: skip
    """Teeth of each threshold, hysteresis and edge that shows the pattern; none without pulses.

    ValueError says why none of those with pulses shows it.
    """
    tried: list[tuple[PassedTeeth, Crossings]] = []
    refusal: ValueError | None = None
    slowest = 0.0
    for threshold, band, edge in tries:
        passages = crossings(signal, threshold, band, edge)
        if passages.time.size < wheel.teeth + 1:
            continue
        slowest = max(slowest, float(np.median(np.diff(passages.time))))
        try:
            teeth = find_turns(passages.time * interval, wheel, first)
        except ValueError as error:
            refusal = refusal or error
            continue
        tried.append((teeth, passages))
    if not tried and 0.0 < slowest < FEWEST_SAMPLES:
        raise ValueError(
            f"encoder signal: {slowest:.2g} samples from pulse to pulse; must be at least "
            f"{FEWEST_SAMPLES:g}, otherwise teeth pass between samples (aliasing); sample faster"
        )
    if not tried and refusal is not None:
        raise refusal
    return tried


def risen(time: Floats, level: Floats, edge: str = "rising") -> Floats:
    """Times of one edge in a log that has the time and the level at each change.

    Parameters
    ----------
    time : ndarray, shape (rows,)
        Of the changes [s]; rows in which the level stays are passed over.
    level : ndarray, shape (rows,)
        After each change, one of two numbers.
    edge : {"rising", "falling"}
        Which.
    """
    high = level > 0.5 * (level.min() + level.max())
    if edge == "falling":
        high = ~high
    return time[1:][high[1:] & ~high[:-1]]


def _clipped(signal: Floats) -> list[str]:
    """Report that many samples have exactly the same extreme value; crossings are not affected."""
    said = []
    for word, extreme in (("above", signal.max()), ("below", signal.min())):
        share = np.count_nonzero(signal == extreme) / signal.size
        # A signal is clipped if more than this share of its samples has one extreme value.
        if share > 0.02:
            said.append(
                f"the signal is cut off {word} at {extreme:.4g} ({100 * share:.0f} % of the "
                "samples); threshold crossings are not affected"
            )
    return said


ASIDE = 5.0 * DEGREE  # How far a mark may pass from its usual place on the wheel [rad]


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
    # The hysteresis is a fifth of the swing on both sides.
    return crossings(level, low + 0.5 * swing, 0.2 * swing).time * interval


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
    if step:  # nearest candidate for the first tooth
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
    """Angles at which the mark passes, from the first tooth of turn 0, and their period [rad]."""
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
    """Mean of angles that repeat with a period, between minus and plus half of the period."""
    turning = np.exp(1j * TURN * at / period).mean()
    return float(np.angle(turning)) * period / TURN
