"""The fraction of the reciprocating mass that counterweights best balance."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from engine_dyn.compilation import inlined, kernel
from engine_dyn.types import Complexes, Floats

__all__ = ["least_mean_square", "least_peak"]


Parabola = tuple[float, float, float]
"""Square, half its slope and bend, at the fraction 0."""


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
    fraction = -product / np.where(there, size, 1.0)
    return np.where(there, np.clip(fraction, 0.0, 1.0), np.nan)


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
    """Where the highest of many parabolas is lowest, from 0 to 1."""
    below, above = 0.0, 1.0
    low, high = _highest(square, slope, bend, below), _highest(square, slope, bend, above)
    here = below
    # Each parabola was not known before, and some ten are usual.
    for _ in range(60):
        here = min(max(_lowest_of_two(low, high), below), above)
        known = max(_value(low, here), _value(high, here))
        new = _highest(square, slope, bend, here)
        # A parabola counts as higher if it exceeds the largest known square by more than this.
        if not _value(new, here) > known * (1.0 + 1e-12):
            break
        if new[1] + here * new[2] > 0.0:
            high, above = new, here
        else:
            low, below = new, here
    return here


@inlined
def _highest(square: Floats, slope: Floats, bend: Floats, fraction: float) -> Parabola:
    """Parabola that is highest at a fraction."""
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
    """Where the higher of two parabolas is lowest: at the foot of one of them, or where they meet.

    They meet once between their feet, as each is higher at the foot of the other.
    """
    foot = -one[1] / one[2] if one[2] > 0.0 else 0.0
    foot_of_other = -other[1] / other[2] if other[2] > 0.0 else 0.0
    if _value(one, foot) >= _value(other, foot):
        return foot
    if _value(other, foot_of_other) >= _value(one, foot_of_other):
        return foot_of_other
    square, slope, bend = one[0] - other[0], one[1] - other[1], one[2] - other[2]
    root = math.sqrt(max(slope * slope - bend * square, 0.0))
    # Both roots of bend c^2 + 2 slope c + square, without the difference of near numbers.
    turned = -(slope + math.copysign(root, slope))
    left, right = min(foot, foot_of_other), max(foot, foot_of_other)
    if turned != 0.0 and left <= square / turned <= right:
        return square / turned
    meets = turned / bend if bend != 0.0 else math.inf
    return meets if math.isfinite(meets) else 0.5 * (left + right)
