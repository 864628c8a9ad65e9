"""Means over the cylinders of an engine, for designs whose cylinders differ.

Designs name their cylinders by a number, the key of `CylindersByCount`; each function computes once
for each of these numbers, and once for cylinders of an engine that are equal.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from engine_dyn.geometry import slider_crank
from engine_dyn.geometry.cylinders import Cylinders, CylindersByCount, Member
from engine_dyn.geometry.masses import mean_square_velocity

SAMPLES = 360  # Number of samples of a revolution for means of the motion of articulated rods


def value_of_sets(
    cylinder_set: Any, by_count: CylindersByCount, of_engine: Callable[[Cylinders], Any]
) -> Any:
    """Take a value for the cylinders of each design.

    Parameters
    ----------
    cylinder_set : array_like of int
        Keys of `by_count`.
    by_count : mapping
        Cylinders of each key.
    of_engine : callable
        The value of one set of cylinders; an array broadcasts with `cylinder_set`.

    Returns
    -------
    ndarray
        In the shape that `cylinder_set` and the values broadcast to.
    """
    counts = np.asarray(cylinder_set)
    total: Any = np.nan
    for count in np.unique(counts):
        total = np.where(counts == count, of_engine(by_count[int(count)]), total)
    return total


def value_of_each(
    of_one: Callable[[Member], Any], numbers: Any, cylinder_set: Any, by_count: CylindersByCount
) -> Any:
    """Take a value of single cylinders, whose numbers, from 1, broadcast; NaN past the last one."""
    asked = np.asarray(numbers)
    total: Any = np.nan
    for number in np.unique(asked).astype(int).tolist():

        def of_engine(engine: Cylinders, number: int = number) -> Any:
            return of_one(engine.members[number - 1]) if number <= engine.count else np.nan

        total = np.where(asked == number, value_of_sets(cylinder_set, by_count, of_engine), total)
    return total


def mean_of_cylinders(
    cylinder_set: Any, by_count: CylindersByCount, of_one: Callable[[Member], Any]
) -> Any:
    """Mean of a value that does not depend on a cylinder's phase, over the cylinders of a design.

    `by_count` has the cylinders of each set, `of_one` gives the value of one cylinder.
    """

    def of_engine(engine: Cylinders) -> Any:
        members = [member._replace(phase=0.0) for member in engine.members]
        each = {member: of_one(member) for member in set(members)}
        return sum(each[member] for member in members) / len(members)

    return value_of_sets(cylinder_set, by_count, of_engine)


def mean_factor(name: str, cylinder_set: Any, by_count: CylindersByCount) -> Any:
    """Mean of a factor of the cylinders [1]: `all_pressure`, `mass` or `radius`."""
    return value_of_sets(
        cylinder_set, by_count, lambda engine: np.mean(getattr(engine, f"{name}_factors"))
    )


def throws_per_cylinder(cylinder_set: Any, by_count: CylindersByCount) -> Any:
    """Number of throws over that of cylinders [1]: 1/2 where two rods share each pin."""
    return value_of_sets(cylinder_set, by_count, lambda engine: np.mean(engine.throw_shares))


def mean_stroke_ratio(
    crank_ratio: Any, offset: Any, cylinder_set: Any, by_count: CylindersByCount
) -> Any:
    """Mean stroke of the cylinders over that of the engine's own throw [1].

    Parameters
    ----------
    crank_ratio, offset : array_like
        The engine's crank radius over rod length, and offset of the pin's line over crank radius.
    cylinder_set, by_count
        As of `value_of_sets`.
    """
    mean = mean_of_cylinders(
        cylinder_set, by_count, lambda member: member.stroke(crank_ratio, offset)
    )
    return mean / slider_crank.dead_centres(crank_ratio, offset).stroke


def mean_displacement_ratio(
    crank_ratio: Any, offset: Any, cylinder_set: Any, by_count: CylindersByCount
) -> Any:
    """Mean displacement of the cylinders over that of the engine's own bore and stroke [1].

    Arguments as of `mean_stroke_ratio`.
    """
    mean = mean_of_cylinders(
        cylinder_set, by_count, lambda member: member.displacement(crank_ratio, offset)
    )
    return mean / slider_crank.dead_centres(crank_ratio, offset).stroke


def mean_square(member: Member, crank_ratio: Any, offset: Any) -> Any:
    """Mean over a revolution of `Member.square`, the squared velocity with the factor on the mass.

    That of an articulated rod is the mean of equally spaced samples: it is smooth and periodic.
    """
    if member.rod is None:
        factor = member.mass_factor * member.radius_factor**2
        return factor * mean_square_velocity(*member.own(crank_ratio, offset))
    angle = np.arange(SAMPLES) * (2.0 * np.pi / SAMPLES)
    ratio, beside = (np.asarray(one)[..., None] for one in (crank_ratio, offset))
    return np.mean(member.square(angle, ratio, beside)[0], axis=-1)


def engine_inertia_of_cylinders(
    reciprocating_mass: Any, rod_mass_at_crank: Any, crank_mass: Any, crank_radius: Any,
    crank_ratio: Any, cylinders: Any, offset: Any, cylinder_set: Any, by_count: CylindersByCount,
) -> Any:  # fmt: skip
    """Cycle mean of the running gear's inertia [kg m2] where masses or crank radii differ.

    Z r^2 (m mean(f_m f_r^2 v^2) + m_rod mean(f_r^2) + m_throw mean(s f_r^2)), with the reduced
    velocity v of each cylinder, its factors f_m on the mass and f_r on the crank radius, and its
    share s in its throw: `masses.engine_inertia` with means over the cylinders. docs/method.md
    (23); Kakaitsas (2015), eq. 3.2, without the auxiliaries.
    """
    reciprocating = mean_of_cylinders(
        cylinder_set, by_count, lambda member: mean_square(member, crank_ratio, offset)
    )
    rods = value_of_sets(
        cylinder_set, by_count, lambda engine: np.mean(np.square(engine.radius_factors))
    )
    throws = value_of_sets(
        cylinder_set, by_count,
        lambda engine: np.mean(np.square(engine.radius_factors) * engine.throw_shares),
    )  # fmt: skip
    return cylinders * crank_radius**2 * (
        reciprocating_mass * reciprocating + rod_mass_at_crank * rods + crank_mass * throws
    )  # fmt: skip
