"""Reduction of rod and crank throw to two masses; inertia of the running gear."""

from __future__ import annotations

from typing import Any

import numpy.typing as npt

from engine_dyn.geometry import slider_crank
from engine_dyn.geometry.velocity_waves import mean_square

__all__ = [
    "crank_mass_at_pin",
    "engine_inertia",
    "mean_square_velocity",
    "reciprocating_mass",
    "rod_mass_at_crank",
    "rod_mass_at_piston",
    "rotating_mass",
]


def rod_mass_at_piston(rod_mass: Any, rod_centre_of_gravity: Any, rod_length: Any) -> Any:
    """Part of the rod's mass that reciprocates with the piston pin [kg].

    `rod_centre_of_gravity` is the distance from the big end [m]. Two conditions: same mass, same
    centre of gravity. docs/method.md (19); Kakaitsas (2015), eq. 2.9.
    """
    return rod_mass * rod_centre_of_gravity / rod_length


def rod_mass_at_crank(rod_mass: Any, rod_centre_of_gravity: Any, rod_length: Any) -> Any:
    """Part of the rod's mass that turns with the crank pin [kg].

    docs/method.md (19); Kakaitsas (2015), eq. 2.9.
    """
    return rod_mass * (1.0 - rod_centre_of_gravity / rod_length)


def reciprocating_mass(
    piston_mass: Any, rod_mass: Any, rod_centre_of_gravity: Any, rod_length: Any
) -> Any:
    """Piston with pin and rings plus the rod's reciprocating part [kg].

    docs/method.md (19); Kakaitsas (2015), eq. 2.10. With the rod's mass and the distance of its
    centre of gravity from the big end kept, the split follows the rod's length (Kakaitsas, section
    5.2.3).
    """
    return piston_mass + rod_mass_at_piston(rod_mass, rod_centre_of_gravity, rod_length)


def rotating_mass(
    crank_mass: Any, rod_mass: Any, rod_centre_of_gravity: Any, rod_length: Any,
    throws_per_cylinder: Any = 1.0,
) -> Any:  # fmt: skip
    """Mass of one cylinder that turns, at the crank radius [kg]: throw and the rod's turning part.

    Where rods share a pin, a cylinder has its share of the throw: `throws_per_cylinder`.
    docs/method.md (19); Kakaitsas (2015), eq. 2.11, with a throw for each cylinder.
    """
    rod = rod_mass_at_crank(rod_mass, rod_centre_of_gravity, rod_length)
    return throws_per_cylinder * crank_mass + rod


def crank_mass_at_pin(throw_mass: Any, throw_radius: Any, crank_radius: Any) -> Any:
    """Throw of given mass and centre of gravity, reduced to the crank radius [kg].

    The centrifugal force is the same: docs/method.md section 3.1; Kakaitsas (2015), eq. 2.15.
    """
    return throw_mass * throw_radius / crank_radius


def mean_square_velocity(crank_ratio: npt.ArrayLike, offset: npt.ArrayLike = 0.0) -> Any:
    """Mean of (c/(r omega))^2 over a revolution [1], for any shape of `crank_ratio`.

    `offset` is that of the piston pin's line over the crank radius, and broadcasts.

    The term of docs/method.md (23); exact to rounding up to a crank ratio of 0.996.

    Raises
    ------
    ValueError
        If a crank ratio lies outside (0, 1), or an offset does not let the crank turn.
    """
    slider_crank.dead_centres(crank_ratio, offset)  # refuses them
    return mean_square(crank_ratio, offset)[()]


def inertia_of_parts(
    engine_inertia: Any, auxiliary_inertia: Any, flywheel_inertia: Any, load_inertia: Any,
    gear_ratio: Any = 1.0,
) -> Any:  # fmt: skip
    """Inertia of engine and load at the crank [kg m2]: engine + auxiliaries + flywheel + i^2 load.

    docs/method.md (23); Kakaitsas (2015), eqs. 3.1 and 3.2. The gear ratio i is the load's speed
    over the crank's, and the load's inertia is that at its own shaft: the kinetic energy is equal.
    """
    return engine_inertia + auxiliary_inertia + flywheel_inertia + gear_ratio**2 * load_inertia


def engine_inertia(
    reciprocating_mass: Any,
    rotating_mass: Any,
    crank_radius: Any,
    crank_ratio: Any,
    cylinders: Any,
    offset: Any = 0.0,
) -> Any:
    """Cycle mean of the running gear's inertia [kg m2]: Z (m r^2 mean (c/(r omega))^2 + m_r r^2).

    docs/method.md (23); Kakaitsas (2015), eq. 3.2, without the auxiliaries. The reciprocating part
    is its mean, also over cylinders of unequal mass. `offset` is over the crank radius.
    """
    reciprocating = reciprocating_mass * mean_square_velocity(crank_ratio, offset)
    return cylinders * crank_radius**2 * (reciprocating + rotating_mass)
