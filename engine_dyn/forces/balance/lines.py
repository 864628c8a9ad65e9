"""The cylinders of an engine as lines of force across and along the shaft, and orders of forces.

Orders are harmonics of the piston's acceleration, and the ellipses that vectors of one order make.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from engine_dyn.forces.cylinder_harmonics import velocity_harmonics
from engine_dyn.geometry import kinematic_series
from engine_dyn.geometry.arrangement import SAME_ANGLE, TURN
from engine_dyn.geometry.cylinder_means import value_of_sets
from engine_dyn.geometry.cylinders import Cylinders, CylindersByCount
from engine_dyn.types import Booleans, Complexes, Floats


class Lines(NamedTuple):
    """The cylinders as lines of force, from 1 to Z."""

    phase: Floats  # Angle to add to the engine's crank angle to get the cylinder's own [rad]
    direction: Floats  # Angle of the cylinder's axis from the axis of cylinder 1 [rad]
    place: Floats  # Distance from the middle of the crank, in distances of neighbouring throws [1]
    # Place of the bank along the shaft from the middle of all banks, in distances of neighbouring
    # banks [1].
    bank: Floats
    mass_factor: Floats  # Reciprocating mass of the cylinder over the engine's [1]
    radius: Floats  # Crank radius of the cylinder over the engine's; rods are equally long [1]
    throw_share: Floats  # Share of the cylinder in its throw, 1 over the number of rods there [1]
    side: Floats  # Factor on the engine's offset: -1 to the other side of the crank's axis [1]

    def kinds(self, crank_ratio: Any, offset: Any) -> Iterator[tuple[Any, Any, Booleans]]:
        """Own crank ratio and offset of each kind of cylinders, from the engine's, and which."""
        for radius, side in sorted(set(zip(self.radius.tolist(), self.side.tolist(), strict=True))):
            alike = (self.radius == radius) & (self.side == side)
            yield radius * crank_ratio, side * offset / radius, alike


@lru_cache(maxsize=64)
def lines_of(engine: Cylinders) -> Lines:
    """Lines of force of an engine.

    Raises
    ------
    ValueError
        Where its throws are not known.
    """
    made = engine.arrangement
    if made is None:
        raise ValueError(
            f"{len(engine.members)} cylinders: no crank throws are known for this number"
        )
    banks, throws = np.array(made.banks), np.array([t.position for t in made.throws])
    number = np.array([c.bank for c in made.cylinders])
    direction = banks[number]
    place = throws[[c.throw for c in made.cylinders]] - 0.5 * (throws.min() + throws.max())
    return Lines(
        made.phases, direction - direction[0], place, number - 0.5 * (len(banks) - 1),
        np.array(engine.mass_factors, dtype=float), made.radius_factors,
        np.array(engine.throw_shares), np.array([member.side for member in engine.members]),
    )  # fmt: skip


@lru_cache(maxsize=64)
def is_boxer(engine: Cylinders) -> bool:
    """Whether the cylinders stand in opposite pairs, each pair on two opposite pins."""
    made, places = engine.arrangement, engine.along_shaft
    if made is None or places is None or len(made.banks) != 2:
        return False

    def opposite(one: float, other: float) -> bool:
        return abs(abs(np.remainder(one - other, TURN)) - 0.5 * TURN) < SAME_ANGLE

    def is_pair(pair: tuple[int, ...]) -> bool:
        banks = {made.cylinders[k].bank for k in pair}
        pins = [made.throws[made.cylinders[k].throw].angle for k in pair]
        return len(pins) == 2 and len(banks) == 2 and opposite(*pins)

    return opposite(*made.banks) and all(map(is_pair, places))


def default_bank_offset(spacing: Any, cylinders: Any, by_count: CylindersByCount) -> Any:
    """Offset of each bank along the shaft where none is given [m].

    In a boxer the pins of a pair are opposite: its throws are neighbours, one distance of throws
    apart. The forces of the pair are F and -F, so that its moment is F times that distance: of a
    twin m r omega^2 a (1 + lambda), up to higher orders (Power units, lecture 18). In all others
    it is 0: the rods of a pair work in one plane.

    Parameters
    ----------
    spacing : array_like
        Distance of neighbouring throws [m].
    cylinders, by_count
        Set of cylinders of each design, and the sets.
    """
    share = value_of_sets(cylinders, by_count, lambda engine: float(is_boxer(engine)))
    return share * np.asarray(spacing)


MOST = 512  # Highest order of the balance series


def acceleration_harmonics(
    orders: npt.ArrayLike, crank_ratio: npt.ArrayLike, offset: npt.ArrayLike = 0.0
) -> Complexes:
    """Complex amplitudes of the reduced piston acceleration, b = Re sum c_nu e^(i nu phi).

    Parameters
    ----------
    orders : array_like
        Periods a revolution, above 0 and up to 512; the amplitude of orders that are not whole
        numbers is 0.
    crank_ratio, offset : array_like
        As `slider_crank.acceleration`; all three broadcast.

    Returns
    -------
    ndarray
        Exact in lambda. Without offset they are real, 1 for the first order and 0 for the other
        odd ones.

    Raises
    ------
    ValueError
        For an order that is not above 0, or above 512.
    """
    nu = kinematic_series.checked_orders(orders, MOST)
    whole = nu == np.rint(nu)
    ratio, offset_ratio = np.broadcast_arrays(
        np.asarray(crank_ratio, dtype=float), np.asarray(offset, dtype=float)
    )
    if not offset_ratio.any():
        among = np.where(whole, nu, 1.0)
        found_here = kinematic_series.acceleration_coefficients(among, ratio)
        return np.where(whole, found_here, 0.0).astype(np.complex128)
    among, which = np.unique(nu, return_inverse=True)
    # Harmonics of the acceleration follow from the slope of the velocity.
    harmonics = (
        1j * among * velocity_harmonics(among, ratio.reshape(-1, 1), offset_ratio.reshape(-1, 1))
    )
    place, row = np.broadcast_arrays(
        which.reshape(nu.shape), np.arange(ratio.size).reshape(ratio.shape)
    )
    return np.asarray(harmonics[row, place])


class Ellipse(NamedTuple):
    """The ellipse along which the tip of a vector of one order runs."""

    # Semi-axes of the ellipse that the vector describes.
    major: Any
    minor: Any
    # Angle of the long axis from cylinder 1 [rad], above -pi/2 and up to pi/2; 0 for a circle.
    inclination: Any


def ellipse_of(forward: Any, backward: Any, rounding: Any) -> Ellipse:
    """Ellipse of F e^(i nu phi) + B e^(-i nu phi); amplitudes up to `rounding` have no angle.

    Semi-axes |F| + |B| and ||F| - |B||; the long axis lies at half the angle of F B.
    """
    one, other = np.abs(forward), np.abs(backward)
    turned = forward * backward
    there = (one > rounding) & (other > rounding)
    angle = 0.5 * np.angle(np.where(there, turned, 1.0))
    # Rounding must not turn an angle of 90 degrees into -90 degrees.
    angle = np.where(angle <= -0.5 * np.pi + 1e-9, angle + np.pi, angle)
    return Ellipse(one + other, np.abs(one - other), angle)


def direction_of(amplitude: Any, rounding: Any) -> Any:
    """Direction of an amplitude as a complex number of length 1; 1 where there is none."""
    size = np.abs(amplitude)
    there = size > rounding
    return np.where(there, amplitude / np.where(there, size, 1.0), 1.0)
