"""Largest size and root mean square of vectors over a revolution."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from engine_dyn.types import Complexes, Floats

__all__ = ["TURN_SAMPLES", "largest", "revolution", "root_mean_square"]


TURN_SAMPLES = 360
"""Of a revolution, to look for the largest vector."""

FINER, ROUNDS = 8, 3
"""The neighbourhood of the largest sample is sampled again, FINER times finer, in ROUNDS rounds;
a parabola through the last samples then errs by less than 1e-9 of the largest vector."""


def revolution(count: int) -> Floats:
    """Return `count` equally spaced angles of a revolution [rad], from 0."""
    return np.arange(count, dtype=np.float64) * (2.0 * np.pi / count)


def largest(vectors: Callable[[Floats], Complexes]) -> Floats:
    """Largest size of vectors over a revolution, exact to 1e-9 of it.

    Parameters
    ----------
    vectors : callable
        Vectors of some designs, shape (designs, angles), at angles [rad] of shape (angles,) or
        (designs, angles).
    """
    step = 2.0 * np.pi / TURN_SAMPLES
    square = np.abs(vectors(revolution(TURN_SAMPLES))) ** 2
    left, right = np.roll(square, 1, axis=1), np.roll(square, -1, axis=1)
    # The highest sample may stand beside the second highest crest: parabolas tell them apart.
    crest = np.where((square >= left) & (square >= right), _parabola_top(left, square, right), -1.0)
    centre = np.argmax(crest, axis=1)[:, None] * step
    for _ in range(ROUNDS):
        step /= FINER
        angles = centre + step * np.arange(-FINER, FINER + 1)
        square = np.abs(vectors(angles)) ** 2
        place = np.argmax(square, axis=1)[:, None]
        centre = np.take_along_axis(angles, place, axis=1)
    near = np.abs(vectors(centre + step * np.array([-1.0, 0.0, 1.0]))) ** 2
    return np.sqrt(_parabola_top(near[:, 0], near[:, 1], near[:, 2]))


def _parabola_top(left: Floats, middle: Floats, right: Floats) -> Floats:
    """Top of the parabola through three points, of which the middle one is the highest."""
    bend = 2.0 * middle - left - right
    with np.errstate(divide="ignore", invalid="ignore"):
        above = (right - left) ** 2 / (8.0 * bend)
    return middle + np.where(bend > 0.0, np.minimum(above, middle), 0.0)


def root_mean_square(vectors: Callable[[Floats], Complexes]) -> Floats:
    """Root of the mean square of vectors over a revolution; parameters as `largest`."""
    return np.sqrt((np.abs(vectors(revolution(TURN_SAMPLES))) ** 2).mean(axis=1))
