"""Shaking forces of many designs over a revolution, by kernels: the largest, the root mean square.

Forces and moments are in kg m and kg m2 here, over the square of the crank's speed: the sum of the
package's description, one cylinder after the other, and what turns with the shafts.

The fraction of the reciprocating mass that counterweights best balance.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from engine_dyn.compilation import formula, inlined, kernel
from engine_dyn.forces.balance.lines import Lines
from engine_dyn.geometry.slider_crank import offset_acceleration_at, sine_of_top
from engine_dyn.types import Complexes, Floats

MOTION = 14
"""Rows of a design's numbers: lambda; e/r; m r; two factors on the places of the lines of force (1
and 0 for forces); size up to which a sum is rounding; amplitudes, the real part and behind it the
imaginary one, of what turns with the crank, against it, and at twice its speed forwards and
backwards."""

LEAST = 5  # Row of a design's numbers that holds the size up to which a sum is rounding
TURN_SAMPLES = 360  # Samples of a revolution among which the largest vector is searched

FINER = 8
"""Refinement of the largest sample: its neighbourhood is sampled FINER times finer in ROUNDS
rounds; a parabola through the last samples then errs by less than 1e-9 of the largest vector."""


def lines_array(lines: Lines, *, moment: bool) -> Floats:
    """Lines of force as the rows that kernels take; without places for a force.

    Rows: cosine and sine of the phase; mass and radius factors times the direction, along and
    across; place, bank, radius and side of `Lines`.
    """
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
    """Fill in six numbers for each cylinder that do not depend on the angle.

    For cylinder k, from index 6 k on: cosine and sine that turn the engine's angle to the crank's,
    lambda, e/r, and the components of its force over its reduced acceleration.
    """
    engine_ratio, engine_offset, reciprocating = (
        motion[0, design], motion[1, design], motion[2, design]
    )  # fmt: skip
    spacing, bank_offset = motion[3, design], motion[4, design]
    for k in range(lines.shape[1]):
        phase_cosine, phase_sine = lines[0, k], lines[1, k]
        along, across, place, bank = lines[2, k], lines[3, k], lines[4, k], lines[5, k]
        radius, side = lines[6, k], lines[7, k]
        ratio = radius * engine_ratio
        offset = side * engine_offset / radius
        top = sine_of_top(ratio, offset)
        upright = math.sqrt(1.0 - top * top)
        own[6 * k] = phase_cosine * upright - phase_sine * top
        own[6 * k + 1] = phase_sine * upright + phase_cosine * top
        own[6 * k + 2], own[6 * k + 3] = ratio, offset
        lever = place * spacing
        lever += bank * bank_offset
        lever *= reciprocating
        own[6 * k + 4], own[6 * k + 5] = lever * along, lever * across


@formula
def _cylinder_at(own: Floats, k: int, cosine: float, sine: float) -> float:
    """Reduced acceleration of the piston of cylinder k at an angle of the engine."""
    s = sine * own[6 * k] + cosine * own[6 * k + 1]
    c = cosine * own[6 * k] - sine * own[6 * k + 1]
    return offset_acceleration_at(s, c, own[6 * k + 2], own[6 * k + 3])


@formula
def _shafts_at(motion: Floats, design: int, c: float, s: float) -> tuple[float, float]:
    """Force of the masses that turn with the crank and with the balance shafts."""
    c2, s2 = c * c - s * s, 2.0 * s * c
    a, b, d, e = motion[6, design], motion[7, design], motion[8, design], motion[9, design]
    x, y = (a + d) * c - (b - e) * s, (b + e) * c + (a - d) * s
    a, b, d, e = motion[10, design], motion[11, design], motion[12, design], motion[13, design]
    return x + (a + d) * c2 - (b - e) * s2, y + (b + e) * c2 + (a - d) * s2


@inlined
def _square_at(motion: Floats, design: int, own: Floats, cylinders: int, angle: float) -> float:
    """Square of the resultant vector at one crank angle [rad]."""
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
    """Components of the resultant vector at all sampled angles."""
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
def mean_squares_of(motion: Floats, lines: Floats, turn: Floats, mean_squares: Floats) -> None:
    """Mean of each design's squared vector, from arrays (MOTION, D), (8, Z) and (2, A)."""
    samples = turn.shape[1]
    own, x, y = np.empty(6 * lines.shape[1]), np.empty(samples), np.empty(samples)
    for design in range(motion.shape[1]):
        _own_of(motion, lines, design, own)
        _vectors(motion, design, own, lines.shape[1], turn, x, y)
        total = 0.0
        for i in range(samples):
            total += _unless_rounding(x[i] * x[i] + y[i] * y[i], motion[LEAST, design])
        mean_squares[design] = total / samples


@kernel
def largest_of(motion: Floats, lines: Floats, turn: Floats, largest: Floats) -> None:
    """Largest vector of each design, to 1e-9 of it, from arrays (MOTION, D), (8, Z), (2, A)."""
    samples, cylinders = turn.shape[1], lines.shape[1]
    own, x, y = np.empty(6 * cylinders), np.empty(samples), np.empty(samples)
    for design in range(motion.shape[1]):
        _own_of(motion, lines, design, own)
        _vectors(motion, design, own, cylinders, turn, x, y)
        for i in range(samples):
            x[i] = _unless_rounding(x[i] * x[i] + y[i] * y[i], motion[LEAST, design])
        # The highest sample need not lie beside the highest crest of the curve: crests are compared
        # by parabolas through three samples.
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
        largest[design] = math.sqrt(_parabola_top(left, middle, right))
        if total != total:
            largest[design] = math.nan


@formula
def _parabola_top(left: float, middle: float, right: float) -> float:
    """Top of the parabola through three points whose middle one is the highest."""
    bend = 2.0 * middle - left - right
    if not bend > 0.0:
        return middle
    return middle + min((right - left) ** 2 / (8.0 * bend), middle)


Parabola = tuple[float, float, float]
"""A parabola in the fraction c: numbers s, p and q of s + 2 p c + q c^2."""


def least_mean_square(forward: Any, backward: Any, weights: Any, across_weight: float) -> Floats:
    """Fraction c that makes the mean of |R + c G|^2 least, in closed form.

    Parameters
    ----------
    forward, backward : array_like
        Complex amplitudes F and B of the first order of R, the forces without counterweights: F
        turns with the crank and B against it. Other orders are orthogonal to G.
    weights : array_like
        G, the amplitude of the force of counterweights that balance all of the reciprocating mass,
        which turns with the crank.
    across_weight : float
        Factor w on the component across cylinder 1.

    Returns
    -------
    ndarray
        From 0 to 1; NaN where the counterweights of all throws cancel. The mean of the product of
        the components along is Re(F conj(G) + B G)/2, and of those across Re(F conj(G) - B G)/2.
    """
    weight = across_weight**2
    product = (1.0 + weight) * (forward * np.conj(weights)).real
    product = product + (1.0 - weight) * (backward * weights).real
    size = (1.0 + weight) * np.abs(weights) ** 2
    there = size > 0.0
    return np.where(there, np.clip(-product / np.where(there, size, 1.0), 0.0, 1.0), np.nan)


def least_peak(
    x: Floats, y: Floats, weights: Complexes, turn: Floats, across_weight: float
) -> Floats:
    """Fraction c that makes the largest |R + c G|^2 least.

    At each angle |R + c G|^2 is a parabola in c. The highest parabolas at both ends of a bracket
    bound from below what is possible within it: their lowest common point. If another parabola is
    higher there, it replaces one of the two; if none is, the point is the answer (cutting planes
    made of parabolas). Each step finds one more of finitely many parabolas.

    Parameters
    ----------
    x, y : ndarray, shape (designs, angles)
        Components of R.
    weights : ndarray, shape (designs,)
        As of `least_mean_square`.
    turn : ndarray, shape (2, angles)
        Cosines and sines of the angles.
    across_weight : float
        As of `least_mean_square`.

    Returns
    -------
    ndarray, shape (designs,)
        From 0 to 1; NaN where the counterweights of all throws cancel.
    """
    fraction = np.empty(weights.size)
    real, imaginary = (np.ascontiguousarray(part) for part in (weights.real, weights.imag))
    _least_peaks(x, y, real, imaginary, turn, across_weight, fraction)
    return fraction


@kernel
def _least_peaks(
    x: Floats, y: Floats, real: Floats, imaginary: Floats, turn: Floats, across_weight: float,
    fraction: Floats,
) -> None:  # fmt: skip
    samples = turn.shape[1]
    square, slope, bend = np.empty(samples), np.empty(samples), np.empty(samples)
    weight = across_weight * across_weight
    for design in range(fraction.size):
        a, b = real[design], imaginary[design]
        for i in range(samples):
            one, other = a * turn[0, i] - b * turn[1, i], a * turn[1, i] + b * turn[0, i]
            p, q = x[design, i], y[design, i]
            square[i] = p * p + weight * (q * q)
            slope[i] = p * one + weight * (q * other)
            bend[i] = one * one + weight * (other * other)
        known = a != 0.0 or b != 0.0
        fraction[design] = _lowest_of_all(square, slope, bend) if known else math.nan


@inlined
def _lowest_of_all(square: Floats, slope: Floats, bend: Floats) -> float:
    """Fraction from 0 to 1 at which the largest of many parabolas is smallest."""
    below, above = 0.0, 1.0
    low, high = _highest(square, slope, bend, below), _highest(square, slope, bend, above)
    here = below
    # Each round takes in one more parabola, the highest at the fraction `here`; some ten rounds are
    # usual.
    for _ in range(60):
        here = min(max(_lowest_of_two(low, high), below), above)
        known = max(_value(low, here), _value(high, here))
        new = _highest(square, slope, bend, here)
        # A parabola that is higher by less than 1e-12 of the square is so by rounding alone.
        if not _value(new, here) > known * (1.0 + 1e-12):
            break
        if new[1] + here * new[2] > 0.0:
            high, above = new, here
        else:
            low, below = new, here
    return here


@inlined
def _highest(square: Floats, slope: Floats, bend: Floats, fraction: float) -> Parabola:
    """Return the parabola that has the largest value at a fraction."""
    best, most = 0, -math.inf
    for i in range(square.size):
        here = square[i] + fraction * (2.0 * slope[i] + fraction * bend[i])
        if here > most:
            best, most = i, here
    return square[best], slope[best], bend[best]


@inlined
def _value(parabola: Parabola, fraction: float) -> float:
    return parabola[0] + fraction * (2.0 * parabola[1] + fraction * parabola[2])


@inlined
def _lowest_of_two(one: Parabola, other: Parabola) -> float:
    """Fraction at which the larger of two parabolas is least: a vertex, or where they meet once."""
    foot = -one[1] / one[2] if one[2] > 0.0 else 0.0
    foot_of_other = -other[1] / other[2] if other[2] > 0.0 else 0.0
    if _value(one, foot) >= _value(other, foot):
        return foot
    if _value(other, foot_of_other) >= _value(one, foot_of_other):
        return foot_of_other
    square, slope, bend = one[0] - other[0], one[1] - other[1], one[2] - other[2]
    root = math.sqrt(max(slope * slope - bend * square, 0.0))
    # Both roots of bend c^2 + 2 slope c + square, without subtracting nearly equal numbers.
    turned = -(slope + math.copysign(root, slope))
    left, right = min(foot, foot_of_other), max(foot, foot_of_other)
    if turned != 0.0 and left <= square / turned <= right:
        return square / turned
    meets = turned / bend if bend != 0.0 else math.inf
    return meets if math.isfinite(meets) else 0.5 * (left + right)
