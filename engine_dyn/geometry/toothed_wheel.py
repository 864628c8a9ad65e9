"""Patterns of toothed wheels: where the teeth are that pass a sensor in a turn."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from engine_dyn.types import Floats
from engine_dyn.units import DEGREE

TURN = 2.0 * np.pi
MOST_TEETH = 7200
"""Largest number of teeth: two marks a degree, each with two edges, are more than optical encoders
have."""

FORMS = "60-2, 36-1, 36-2-1, '17 teeth, 2 missing, 16 teeth, 1 missing', or the angles of all teeth"


@dataclass(frozen=True, eq=False)
class Wheel:
    """A toothed wheel on the crankshaft, as it passes its sensor."""

    text: str  # The pattern of teeth in words, such as 60-2
    # Angle of the crank [rad] between the first tooth and each tooth, in the order in which they
    # pass the sensor; the first is 0, and follows the longest gap; shape (teeth,)
    angle: Floats

    def __post_init__(self) -> None:
        """Refuse teeth that do not follow each other within one turn."""
        if not 1 <= len(self.angle) <= MOST_TEETH:
            raise ValueError(f"wheel: {len(self.angle)} teeth; must be 1 to {MOST_TEETH}")
        if self.angle[0] != 0.0 or not np.all(self.width > 0.0):
            raise ValueError("wheel: angles of teeth must ascend from 0 and stay below a turn")

    @property
    def teeth(self) -> int:
        """Number of teeth that there are."""
        return len(self.angle)

    @property
    def width(self) -> Floats:
        """Angle from each tooth to the next one [rad], shape (teeth,)."""
        return np.diff(np.append(self.angle, TURN))

    @property
    def gap(self) -> int:
        """Place of the widest interval; after it comes the first tooth."""
        return int(np.argmax(self.width))

    @property
    def even(self) -> bool:
        """Whether all intervals are alike, so that no tooth can be told from another one."""
        return bool(np.ptp(self.width) < 1e-9)

    @property
    def symmetry(self) -> int:
        """How many teeth of a turn could be the first one, because the wheel repeats.

        1 for a wheel without a gap: its turns are counted from the first pulse.
        """
        return 1 if self.even else _alike(self.width, self.width)

    @property
    def mirrored(self) -> bool:
        """Whether the wheel looks the same in reverse, so that its sense cannot be seen."""
        return _alike(self.width[::-1], self.width) > 0

    @property
    def reversed(self) -> Wheel:
        """The same wheel turning the other way; its first tooth follows the longest gap again."""
        return _from_widths(self.text + ", reversed", self.width[::-1])


def wheel_from_text(text: str) -> Wheel:
    """Wheel of a pattern in words.

    Parameters
    ----------
    text : str
        ``N`` (teeth without a gap), ``N-m`` (N pitches, m teeth missing in one gap), ``N-m-n``
        (several gaps: the teeth that remain stand in groups as equal as possible, of which the
        first follow the gaps that are named first), or groups one by one, such as ``17 teeth, 2
        missing, 16 teeth, 1 missing``. Groups and gaps are in the order in which they pass the
        sensor.

    Raises
    ------
    ValueError
        For a text in none of these forms, and for a wheel without teeth.
    """
    plain = " ".join(text.split())
    if re.fullmatch(r"\d{1,4}(-\d{1,4})*", plain):
        pitches, *gaps = map(int, plain.split("-"))
        left = pitches - sum(gaps)
        if left < max(len(gaps), 1) or any(gap < 1 for gap in gaps):
            raise ValueError(f"wheel: {plain} leaves no teeth; must be like {FORMS}")
        count = max(len(gaps), 1)
        groups = [left // count + (place < left % count) for place in range(count)]
        gaps = gaps or [0]
    elif re.fullmatch(r"\d{1,4} teeth, \d{1,4} missing(, \d{1,4} teeth, \d{1,4} missing)*", plain):
        numbers = list(map(int, re.findall(r"\d+", plain)))
        groups, gaps = numbers[::2], numbers[1::2]
        if min(groups) < 1:
            raise ValueError(f"wheel: {plain}: each group has at least one tooth")
    else:
        raise ValueError(f"wheel: {plain[:60]!r} is not a pattern; must be like {FORMS}")
    if sum(groups) + sum(gaps) > MOST_TEETH:
        raise ValueError(f"wheel: {plain}: more than {MOST_TEETH} pitches")
    widths = []
    for group, gap in zip(groups, gaps, strict=True):
        widths += [1.0] * (group - 1) + [1.0 + gap]
    return _from_widths(plain, np.array(widths))


def wheel_from_angles(degrees: Sequence[float]) -> Wheel:
    """Wheel of a list of teeth.

    Parameters
    ----------
    degrees : sequence of float
        Angle of each tooth [degree] from any zero of the wheel, ascending in the order in which
        they pass the sensor, within one turn.

    Raises
    ------
    ValueError
        For angles that do not ascend or span a turn or more.
    """
    angle = np.asarray(degrees, dtype=float)
    if angle.ndim != 1 or angle.size < 1 or not np.isfinite(angle).all():
        raise ValueError("wheel: must be a list of angles of teeth in degrees")
    if np.any(np.diff(angle) <= 0.0) or angle[-1] - angle[0] >= 360.0:
        raise ValueError("wheel: angles of teeth must ascend and span less than 360 degrees")
    widths = np.diff(np.append(angle, angle[0] + 360.0)) * DEGREE
    return _from_widths(f"{angle.size} given teeth", widths)


def _alike(one: Floats, other: Floats) -> int:
    """Number of shifts after which intervals equal others; only the longest ones are compared."""
    shifts = int(np.argmax(other)) - np.flatnonzero(np.isclose(one, one.max()))
    return sum(np.allclose(np.roll(one, shift), other) for shift in shifts)


def _from_widths(text: str, widths: Floats) -> Wheel:
    """Wheel whose intervals have widths in this ratio, turned so that the longest is the last."""
    longest = int(np.flatnonzero(np.isclose(widths, widths.max()))[0])
    if np.ptp(widths) < 1e-9 * widths.max():  # a wheel without gap: the first tooth stays the first
        longest = len(widths) - 1
    turned = np.roll(widths, len(widths) - 1 - longest)
    return Wheel(text, np.concatenate([[0.0], np.cumsum(turned)[:-1]]) * TURN / turned.sum())
