"""Boxes of crank ratio and pin offset in which velocities are polynomials.

Within a box of both, the reduced piston velocity is a sum of products of Chebyshev polynomials,
docs/solver.md (58), and so is everything that is linear in it. A design's box follows from its own
numbers, so it has the same curves whatever else is computed.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np

from engine_dyn.types import Floats, Integers

DEGREE = 8
"""Number of Chebyshev points of ratio and offset; products of polynomials are kept below this
total degree. Velocities then are exact to 1e-11, and to 1e-8 with the largest offsets. Where
cylinders nearly balance each other, such an error is multiplied."""

RATIO_EDGES = np.array([0.0, 0.2, 0.36, 0.5, 0.6, 0.7, 0.77, 0.82])
"""Edges of boxes of the crank ratio. Boxes shrink towards the ratio at which the crank cannot
turn, so that polynomials of one degree serve all."""

OFFSET_EDGES = np.array([0.0, 0.201, 0.351, 0.501])
"""Edges of boxes of the offset over the crank radius, which exceed round numbers by rounded
lengths. Offsets of either sign have boxes of their own."""

LARGEST_RATIO = np.array([0.82, 0.5, 0.36, 0.36, -1.0])
"""Largest crank ratio without an offset, up to each edge, and beyond the last edge: for larger
ratios, polynomials of this degree are too few."""

KINDS = 2 * len(OFFSET_EDGES) - 1
"""Boxes for each interval of the crank ratio: no offset, a small positive and negative one, ..."""


@dataclass(frozen=True)
class Box:
    """Crank ratios and offsets that have columns in common: centre and half-width of each."""

    ratio: tuple[float, float]
    offset: tuple[float, float] = (0.0, 0.0)

    @cached_property
    def _angles(self) -> list[Floats]:
        """Arc cosines of the Chebyshev points of ratio and offset: one where the width is 0."""
        sizes = (DEGREE if width > 0.0 else 1 for _, width in (self.ratio, self.offset))
        return [(np.arange(size) + 0.5) * np.pi / size for size in sizes]

    @cached_property
    def degrees(self) -> Integers:
        """Degrees of each column's polynomial in ratio and offset, shape (terms, 2)."""
        pairs = np.argwhere(np.ones([angle.size for angle in self._angles]))
        return pairs[pairs.sum(axis=1) < DEGREE]

    @cached_property
    def samples(self) -> Floats:
        """Ratio and offset of every Chebyshev point, shape (samples, 2)."""
        sides = zip((self.ratio, self.offset), self._angles, strict=True)
        points = [centre + width * np.cos(angle) for (centre, width), angle in sides]
        return np.stack(np.meshgrid(*points, indexing="ij"), axis=-1).reshape(-1, 2)

    @cached_property
    def transform(self) -> Floats:
        """Matrix from values at the samples to columns, shape (terms, samples)."""
        full = np.kron(*(chebyshev_matrix(angle) for angle in self._angles))
        one, other = self.degrees.T
        return np.ascontiguousarray(full[one * self._angles[1].size + other])

    def factors(self, ratio: Floats, offset: Floats) -> Floats:
        """Chebyshev polynomials of both, docs/solver.md (58), shape (designs, term)."""
        sides = []
        for value, (centre, width), degree in zip(
            (ratio, offset), (self.ratio, self.offset), self.degrees.max(axis=0), strict=True
        ):
            place = (value - centre) / (width or 1.0)
            # NumPy's function takes twice as long, and computes degrees that no column has.
            side = [np.ones(place.shape), place]
            while len(side) <= degree:
                side.append(2.0 * place * side[-1] - side[-2])
            sides.append(side)
        factors = np.empty((len(self.degrees), ratio.size))
        for product, (one, other) in zip(factors, self.degrees, strict=True):
            np.multiply(sides[0][one], sides[1][other], out=product)
        return np.ascontiguousarray(factors.T)


def chebyshev_matrix(angle: Floats) -> Floats:
    """Matrix from values at the Chebyshev points to coefficients of the polynomials."""
    matrix = 2.0 / angle.size * np.cos(np.outer(np.arange(angle.size), angle))
    matrix[0] *= 0.5
    return np.asarray(matrix)


def boxes_of(
    ratio: Floats, offset: Floats, largest_radius: float = 1.0, alone: bool = False
) -> Integers:
    """Number of the box of each crank; cranks in none, or all where `alone`, have one below 0.

    `largest_radius` is the largest crank radius of the cylinders over the engine's: their own crank
    ratio is that times the engine's, and must lie within the outermost edge.
    """
    own, edge = ratio * largest_radius, np.searchsorted(OFFSET_EDGES, np.abs(offset))
    number = np.searchsorted(RATIO_EDGES[1:-1], own, side="right")
    lies = (own >= 0.0) & (own < LARGEST_RATIO[edge])
    number, lonely = KINDS * number + 2 * edge - (offset > 0.0), ~lies | alone
    if lonely.any():
        crank = np.stack(np.broadcast_arrays(ratio, offset))[:, lonely]
        number[lonely] = -1 - np.unique(crank, axis=1, return_inverse=True)[1].reshape(-1)
    return number


def box_of(number: int, ratio: float, offset: float, largest_radius: float = 1.0) -> Box:
    """Box of a number that `boxes_of` gives; of one below 0, the crank itself."""
    if number < 0:
        return Box((ratio, 0.0), (offset, 0.0))
    return _box(number, largest_radius)


@lru_cache(maxsize=64)
def _box(number: int, largest_radius: float) -> Box:
    """Box with a given number, cached with its derived values."""
    low, high = RATIO_EDGES[number // KINDS :][:2] / largest_radius
    edge, positive = (number % KINDS + 1) // 2, number % KINDS % 2
    near, far = OFFSET_EDGES[edge - 1 : edge + 1] if edge else (0.0, 0.0)
    centre = (0.5 if positive else -0.5) * float(near + far)
    offset = (centre, 0.5 * float(far - near))
    return Box((float(0.5 * (low + high)), float(0.5 * (high - low))), offset)
