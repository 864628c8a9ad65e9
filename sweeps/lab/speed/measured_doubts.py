"""Doubts about a comparison of measured and computed speed: what does not fit, in one line each."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from engine_dyn.geometry.toothed_wheel import TURN, Wheel
from engine_dyn.recordings.measured_speed import GapAngle, find_gap_angle
from engine_dyn.types import Booleans, Floats
from engine_dyn.units import DEGREE, RPM

LEAST_LIKENESS = float(np.sqrt(0.5))
"""Correlation below which less than half of the measured speed's variance is in the computed one.
"""

INERTIA_STEP = 0.01  # Relative change of the inertia for the slope of delta over the inertia

FAR_SPEED = 0.01  # Relative difference of the mean speeds from which a remark says that they differ


def gap_doubts(
    gap: GapAngle, is_given: bool, raw: Floats, angle: Floats, speeds: Floats, wheel: Wheel,
    period: float, used: Booleans,
) -> list[str]:  # fmt: skip
    """Whether another angle of the gap is clearly more alike than the one that was given.

    And, with the gap anywhere, whether the recordings are clearly more alike read backwards. The
    comparison is made with `gap`, whose angle the scene gives if `is_given`; all else is as of
    `find_gap_angle`.
    """
    doubts = []
    free = find_gap_angle(raw, angle, speeds, wheel, period, None, used) if is_given else gap
    best, here = _likeness(free), _likeness(gap)
    if is_given and _clearly_more(best, here):
        # The given angle is doubted if the speeds agree clearly better at the best angle than at
        # all angles within `reach` of the given one. Where cylinders fire evenly, the speeds agree
        # equally well at several angles, and one of them may be near. However fine the wheel,
        # `reach` is at least three degrees: a nearer angle may be off by a pitch of the wheel only.
        reach = max(float(np.median(wheel.width)), 3.0 * DEGREE)
        near = max(
            _likeness(find_gap_angle(raw, angle, speeds, wheel, period, gap.angle + away, used))
            for away in np.linspace(-reach, reach, 13)
        )
        if _clearly_more(best, near):
            doubts.append(
                f"gap_angle: a gap at {free.angle / DEGREE:.1f} degrees gives a better "
                f"correlation ({best:.2f} instead of {here:.2f} at {gap.angle / DEGREE:.1f}); "
                "is gap_angle wrong, or the recording reversed?"
            )
    # Only a wheel whose pattern is the same from both sides can be read backwards unnoticed; a
    # recording of any other wheel does not fit its pattern in reverse.
    if np.allclose(np.roll(wheel.width[::-1], -1), wheel.width):
        # Reversal puts the widest interval first; rolling makes it the last one again.
        turned = np.roll(raw[:, ::-1], -1, axis=1)
        back = find_gap_angle(turned, angle, speeds, wheel, period, None, np.roll(used[::-1], -1))
        if _likeness(back) >= LEAST_LIKENESS and _clearly_more(_likeness(back), best):
            doubts.append(
                f"read backwards, with a gap at {back.angle / DEGREE:.1f} degrees, the recordings "
                f"correlate better ({_likeness(back):.2f}, forwards {best:.2f} at best): are they "
                "reversed in time?"
            )
    return doubts


def likeness_doubts(labels: Sequence[str], alike: Sequence[float], wheel: bool) -> list[str]:
    """A line for each recording whose correlation with the computed speed, in `alike`, is small."""
    causes = "the recording is reversed, is the wrong file, or belongs to another value of `at`, "
    causes += (
        "gap_angle is wrong, or noise or tooth errors are as large as the fluctuation"
        if wheel
        else "or angle_shift is wrong"
    )
    return [
        f"{label}: measured and computed speed hardly agree (correlation {one:.2f}; below "
        f"{LEAST_LIKENESS:.2f} less than half of their variation is common): perhaps {causes}"
        for label, one in zip(labels, alike, strict=True)
        if one < LEAST_LIKENESS
    ]


def repeats_every_turn(speeds: Floats, period: float) -> bool:
    """Whether computed speeds have next to no half orders, as of engines that fire evenly.

    The speeds, shape (recordings, samples), are uniform over a cycle of `period` [rad]; those of
    cycles of one turn have no half orders.
    """
    turns = round(period / TURN)
    size = np.sum(np.abs(np.fft.rfft(speeds, axis=1)) ** 2, axis=0)
    number = np.arange(size.size)
    whole = size[(number % turns == 0) & (number > 0)].sum()
    half = size[number % turns != 0].sum()
    # Ratio of half orders to whole ones of the computed speed, root mean square, below which the
    # speed is taken to repeat every turn
    return bool(half < 0.05**2 * whole or turns == 1)


def even_firing_doubt(dependence: Floats) -> str:
    """Remark on errors of the teeth that follow from the model's whole orders alone.

    `dependence` is the relative change of each corrected delta over that of the scene's inertia.
    """
    change = [f"{-10.0 * one:+.1f} %" for one in dependence]
    listed = ", ".join(change) if len(change) <= 6 else f"{', '.join(change[:6])} ..."
    return (
        "the engine fires evenly, so its speed repeats every turn: `measured` cannot distinguish "
        "tooth errors from a wrong inertia, and the corrected delta depends on the scene's "
        f"inertia ({listed} for an inertia 10 % too small), which its uncertainty does not "
        "include; `engine-dyn identify` fits both"
    )


def of_heavier_engine(model: Floats, step: float = INERTIA_STEP) -> Floats:
    """Speeds of a `model` whose inertia is larger by a part `step`: deviations change inversely."""
    logs = np.log(model)
    mean = logs.mean(axis=1, keepdims=True)
    return np.asarray(np.exp(mean + (logs - mean) / (1.0 + step)))


def _likeness(gap: GapAngle) -> float:
    """Mean over recordings of the correlation at the best turn."""
    return float(gap.correlation.max(axis=1).mean())


def _clearly_more(one: float, other: float) -> bool:
    """Whether a correlation leaves clearly less unexplained than another one."""
    # A correlation r is clearly larger if its unexplained share 1 - r^2 is less than half as large.
    return one > max(other, 0.0) and 1.0 - one**2 < 0.5 * (1.0 - max(other, 0.0) ** 2)


def _whole_ratio(ratio: float) -> str:
    """Text of a ratio near 2, 3, 4 or one of their reciprocals; "" for any other."""
    for number in (2, 3, 4):
        for one, text in ((float(number), f"{number}"), (1.0 / number, f"1/{number}")):
            if abs(ratio / one - 1.0) <= FAR_SPEED:
                return text
    return ""


def far_speed_remark(label: str, measured: float, computed: float, changing: str) -> list[str]:
    """Return a remark where mean speeds [rad/s] differ by more than FAR_SPEED, else nothing."""
    ratio = measured / computed
    if abs(ratio - 1.0) <= FAR_SPEED:
        return []
    wrong_unit = 50.0  # Ratio of the mean speeds from which the unit of the times seems wrong
    return [
        f"{label}: measured at {measured / RPM:.1f} rpm, computed at {computed / RPM:.1f} rpm: "
        f"{changing} with the square of the speed; "
        + (
            "is the unit of the times right (unit = 'us', say)?"
            if not 1.0 / wrong_unit < ratio < wrong_unit
            else f"is the wheel's pattern a whole turn? The ratio is {_whole_ratio(ratio)}"
            if _whole_ratio(ratio)
            else "use the measured speed in the scene"
        )
    ]
