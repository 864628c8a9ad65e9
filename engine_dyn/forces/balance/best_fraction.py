"""The fraction of the reciprocating mass that counterweights best balance."""

from __future__ import annotations

import numpy as np

from engine_dyn.types import Complexes, Floats

__all__ = ["least_mean_square", "least_peak"]


MOST_CUTS = 60
"""Of parabolas; each was not known before, and some ten are usual."""

ENOUGH = 1e-12
"""A parabola counts as higher if it exceeds the largest known square by more than this part."""


def least_mean_square(forces: Complexes, weights: Complexes, across_weight: float) -> Floats:
    """Fraction c that makes the mean of |R + c G|^2 least, in closed form.

    Parameters
    ----------
    forces, weights : ndarray, shape (designs, angles)
        R, the forces without counterweights; G, the force of counterweights that balance all of the
        reciprocating mass.
    across_weight : float
        Factor on the component across cylinder 1.

    Returns
    -------
    ndarray, shape (designs,)
        From 0 to 1; NaN where the counterweights of all throws cancel.
    """

    def product(one: Complexes, other: Complexes) -> Floats:
        return np.mean(
            one.real * other.real + across_weight**2 * one.imag * other.imag, axis=1
        )  # fmt: skip

    size = product(weights, weights)
    there = size > 0.0
    fraction = -product(forces, weights) / np.where(there, size, 1.0)
    return np.where(there, np.clip(fraction, 0.0, 1.0), np.nan)


def least_peak(forces: Complexes, weights: Complexes, across_weight: float) -> Floats:
    """Fraction c that makes the largest |R + c G|^2 least; parameters as `least_mean_square`.

    At each angle |R + c G|^2 is a parabola in c. The highest parabolas at both ends of a bracket
    bound from below what is possible within it: their lowest common point. If another parabola is
    higher there, it replaces one of the two; if none is, the point is the answer (cutting planes
    made of parabolas). Each step finds one more of finitely many parabolas.
    """
    parabolas = np.stack([
        one.real * other.real + across_weight**2 * (one.imag * other.imag)
        for one, other in ((forces, forces), (forces, weights), (weights, weights))
    ])  # fmt: skip
    there = parabolas[2].any(axis=1)
    fraction = np.full(len(forces), np.nan)
    active = np.flatnonzero(there)
    ends = np.zeros(active.size), np.ones(active.size)
    low, high = (_highest(parabolas[:, active], end) for end in ends)
    below, above = ends
    for _ in range(MOST_CUTS):
        if not active.size:
            break
        here = np.clip(_lowest_of_two(low, high), below, above)
        known = np.maximum(_value(low, here), _value(high, here))
        new = _highest(parabolas[:, active], here)
        fraction[active] = here
        go = _value(new, here) > known * (1.0 + ENOUGH)
        rises = new[1] + here * new[2] > 0.0
        low, high = np.where(rises, low, new), np.where(rises, new, high)
        below, above = np.where(rises, below, here), np.where(rises, here, above)
        active, low, high = active[go], low[:, go], high[:, go]
        below, above = below[go], above[go]
    return fraction


def _highest(parabolas: Floats, fraction: Floats) -> Floats:
    """Parabolas (square, half its slope, bend at 0) that are highest at a fraction, by design."""
    place = np.argmax(_value(parabolas, fraction[:, None]), axis=1)
    return np.asarray(np.take_along_axis(parabolas, place[None, :, None], axis=2)[..., 0])


def _value(parabola: Floats, fraction: Floats) -> Floats:
    square, slope, bend = parabola
    return np.asarray(square + fraction * (2.0 * slope + fraction * bend))


def _lowest_of_two(one: Floats, other: Floats) -> Floats:
    """Where the higher of two parabolas is lowest: at the foot of one of them, or where they meet.

    They meet once between their feet, as each is higher at the foot of the other.
    """
    foot, foot_of_other = (-p[1] / np.where(p[2] > 0.0, p[2], np.inf) for p in (one, other))
    square, slope, bend = one - other
    root = np.sqrt(np.maximum(slope * slope - bend * square, 0.0))
    # Both roots of bend c^2 + 2 slope c + square, without the difference of near numbers.
    turned = -(slope + np.copysign(root, slope))
    with np.errstate(divide="ignore", invalid="ignore"):
        roots = square / turned, turned / bend
    left, right = np.minimum(foot, foot_of_other), np.maximum(foot, foot_of_other)
    meets = np.where((roots[0] >= left) & (roots[0] <= right), roots[0], roots[1])
    meets = np.where(np.isfinite(meets), meets, 0.5 * (left + right))
    higher = _value(one, foot) >= _value(other, foot)
    other_higher = _value(other, foot_of_other) >= _value(one, foot_of_other)
    return np.where(higher, foot, np.where(other_higher, foot_of_other, meets))
