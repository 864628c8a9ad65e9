"""Shaking forces of many designs over a revolution, by kernels: the largest, the root mean square.

Forces and moments are in kg m and kg m2 here, over the square of the crank's speed: the sum of the
package's description, one cylinder after the other, and what turns with the shafts.
"""

from __future__ import annotations

import math

import numpy as np

from engine_dyn.compilation import formula, inlined, kernel
from engine_dyn.forces.balance.lines import Lines
from engine_dyn.geometry.slider_crank import offset_acceleration_at, sine_of_top
from engine_dyn.types import Floats

__all__ = ["MOTION", "forces_at", "largest_of", "lines_array", "mean_squares_of", "turns"]

MOTION = 14
"""Rows of a design's numbers."""

RATIO, OFFSET, RECIPROCATING, SPACING, BANK_OFFSET, LEAST = range(6)
"""lambda; e/r; m r; factors on the places of the lines of force (1 and 0 for forces); size up to
which a sum is rounding."""

FORWARD, BACKWARD, SECOND, SECOND_BACK = range(6, MOTION, 2)
"""Amplitudes, the real part and behind it the imaginary one: of what turns with the crank, against
it, and at twice its speed forwards and backwards."""

COSINE, SINE, ALONG, ACROSS, PLACE, BANK, RADIUS, SIDE = range(8)
"""Rows of a line of force: its phase; mass and radius factors times its direction; see `Lines`."""

TURN_SAMPLES = 360
"""Of a revolution, to look for the largest vector."""

FINER = 8
"""The neighbourhood of the largest sample is sampled again, FINER times finer, in ROUNDS rounds;
a parabola through the last samples then errs by less than 1e-9 of the largest vector."""


def lines_array(lines: Lines, *, moment: bool) -> Floats:
    """Lines of force as the rows that kernels take; without places for a force."""
    share = lines.mass_factor * lines.radius
    none = np.zeros(share.size)
    return np.stack([
        np.cos(lines.phase), np.sin(lines.phase), share * np.cos(lines.direction),
        share * np.sin(lines.direction), lines.place if moment else none + 1.0,
        lines.bank if moment else none, lines.radius, lines.side,
    ])  # fmt: skip


def turns(count: int) -> Floats:
    """Cosines and sines of `count` equally spaced angles of a revolution, from 0."""
    angle = np.arange(count, dtype=np.float64) * (2.0 * np.pi / count)
    return np.stack([np.cos(angle), np.sin(angle)])


@inlined
def _own_of(motion: Floats, lines: Floats, design: int, own: Floats) -> None:
    """Numbers of each cylinder of a design, which do not depend on the angle.

    Those of cylinder k stand at 6 k: cosine and sine to turn the engine's angle to the crank's,
    lambda, e/r, and the components of its force over its reduced acceleration.
    """
    for k in range(lines.shape[1]):
        ratio = lines[RADIUS, k] * motion[RATIO, design]
        offset = lines[SIDE, k] * motion[OFFSET, design] / lines[RADIUS, k]
        top = sine_of_top(ratio, offset)
        upright = math.sqrt(1.0 - top * top)
        own[6 * k] = lines[COSINE, k] * upright - lines[SINE, k] * top
        own[6 * k + 1] = lines[SINE, k] * upright + lines[COSINE, k] * top
        own[6 * k + 2], own[6 * k + 3] = ratio, offset
        lever = lines[PLACE, k] * motion[SPACING, design]
        lever += lines[BANK, k] * motion[BANK_OFFSET, design]
        lever *= motion[RECIPROCATING, design]
        own[6 * k + 4], own[6 * k + 5] = lever * lines[ALONG, k], lever * lines[ACROSS, k]


@formula
def _cylinder_at(own: Floats, k: int, cosine: float, sine: float) -> float:
    """Reduced acceleration of cylinder k at the engine's angle."""
    s = sine * own[6 * k] + cosine * own[6 * k + 1]
    c = cosine * own[6 * k] - sine * own[6 * k + 1]
    acceleration: float = offset_acceleration_at(s, c, own[6 * k + 2], own[6 * k + 3])
    return acceleration


@formula
def _shafts_at(motion: Floats, design: int, c: float, s: float) -> tuple[float, float]:
    """What turns with the crank and with balance shafts."""
    c2, s2 = c * c - s * s, 2.0 * s * c
    a, b = motion[FORWARD, design], motion[FORWARD + 1, design]
    d, e = motion[BACKWARD, design], motion[BACKWARD + 1, design]
    x, y = (a + d) * c - (b - e) * s, (b + e) * c + (a - d) * s
    a, b = motion[SECOND, design], motion[SECOND + 1, design]
    d, e = motion[SECOND_BACK, design], motion[SECOND_BACK + 1, design]
    return x + (a + d) * c2 - (b - e) * s2, y + (b + e) * c2 + (a - d) * s2


@inlined
def _square_at(motion: Floats, design: int, own: Floats, cylinders: int, angle: float) -> float:
    """Square of the vector at one angle [rad]."""
    cosine, sine = math.cos(angle), math.sin(angle)
    x, y = _shafts_at(motion, design, cosine, sine)
    for k in range(cylinders):
        b = _cylinder_at(own, k, cosine, sine)
        x += own[6 * k + 4] * b
        y += own[6 * k + 5] * b
    return _unless_rounding(x * x + y * y, motion[LEAST, design])


@formula
def _unless_rounding(square: float, least: float) -> float:
    return 0.0 if square < least * least else square


@inlined
def _vectors(
    motion: Floats, design: int, own: Floats, cylinders: int, turn: Floats, x: Floats, y: Floats
) -> None:
    """Components of the vector at all angles."""
    cosine, sine = turn[0], turn[1]
    for i in range(x.size):
        x[i], y[i] = _shafts_at(motion, design, cosine[i], sine[i])
    for k in range(cylinders):
        along, across = own[6 * k + 4], own[6 * k + 5]
        for i in range(x.size):
            b = _cylinder_at(own, k, cosine[i], sine[i])
            x[i] += along * b
            y[i] += across * b


@kernel
def forces_at(motion: Floats, lines: Floats, turn: Floats, x: Floats, y: Floats) -> None:
    """Components of the vector of each design, shape (designs, angles).

    Parameters
    ----------
    motion : ndarray, shape (MOTION, D)
        Numbers of the designs.
    lines : ndarray, shape (8, Z)
        Cylinders of all of them: see `lines_array`.
    turn : ndarray, shape (2, A)
        Angles: see `turns`.
    x, y : ndarray, shape (D, A)
        Get the result.
    """
    own = np.empty(6 * lines.shape[1])
    for design in range(motion.shape[1]):
        _own_of(motion, lines, design, own)
        _vectors(motion, design, own, lines.shape[1], turn, x[design], y[design])
        least = motion[LEAST, design]
        for i in range(turn.shape[1]):
            if _unless_rounding(x[design, i] ** 2 + y[design, i] ** 2, least) == 0.0:
                x[design, i] = y[design, i] = 0.0


@kernel
def mean_squares_of(motion: Floats, lines: Floats, turn: Floats, found: Floats) -> None:
    """Mean of the square of the vector of each design; parameters as `forces_at`."""
    samples = turn.shape[1]
    own, x, y = np.empty(6 * lines.shape[1]), np.empty(samples), np.empty(samples)
    for design in range(motion.shape[1]):
        _own_of(motion, lines, design, own)
        _vectors(motion, design, own, lines.shape[1], turn, x, y)
        total = 0.0
        for i in range(samples):
            total += _unless_rounding(x[i] * x[i] + y[i] * y[i], motion[LEAST, design])
        found[design] = total / samples


@kernel
def largest_of(motion: Floats, lines: Floats, turn: Floats, found: Floats) -> None:
    """Largest size of the vector of each design, to 1e-9 of it; parameters as `forces_at`."""
    samples, cylinders = turn.shape[1], lines.shape[1]
    own, x, y = np.empty(6 * cylinders), np.empty(samples), np.empty(samples)
    for design in range(motion.shape[1]):
        _own_of(motion, lines, design, own)
        _vectors(motion, design, own, cylinders, turn, x, y)
        for i in range(samples):
            x[i] = _unless_rounding(x[i] * x[i] + y[i] * y[i], motion[LEAST, design])
        # The highest sample may stand beside the second highest crest: parabolas tell them apart.
        best, crest, total = 0, -1.0, 0.0
        for i in range(samples):
            total += x[i]
            left, right = x[i - 1 if i > 0 else samples - 1], x[i + 1 if i < samples - 1 else 0]
            if x[i] >= left and x[i] >= right:
                top = _parabola_top(left, x[i], right)
                if top > crest:
                    best, crest = i, top
        step = 2.0 * math.pi / samples
        centre = best * step
        for _ in range(3):
            step /= FINER
            place, most = 0, -1.0
            for k in range(-FINER, FINER + 1):
                here = _square_at(motion, design, own, cylinders, centre + k * step)
                if here > most:
                    place, most = k, here
            centre += place * step
        left = _square_at(motion, design, own, cylinders, centre - step)
        middle = _square_at(motion, design, own, cylinders, centre)
        right = _square_at(motion, design, own, cylinders, centre + step)
        found[design] = math.sqrt(_parabola_top(left, middle, right))
        if total != total:
            found[design] = math.nan


@formula
def _parabola_top(left: float, middle: float, right: float) -> float:
    """Top of the parabola through three points, of which the middle one is the highest."""
    bend = 2.0 * middle - left - right
    if not bend > 0.0:
        return middle
    return middle + min((right - left) ** 2 / (8.0 * bend), middle)
