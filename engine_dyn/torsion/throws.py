"""What the cylinders of an engine put on the discs of its throws, besides the orders of the torque.

The orders themselves are those of `engine_dyn.forces.harmonics.of_throws`.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from engine_dyn.forces.superposition import along_shaft
from engine_dyn.geometry.cylinder_means import mean_square, value_of_sets
from engine_dyn.geometry.cylinders import Cylinders, CylindersByCount, Member
from engine_dyn.pressure.family import Family

__all__ = ["mean_torques_of_throws", "reciprocating_inertia_of_throws"]


def reciprocating_inertia_of_throws(
    reciprocating_mass: Any, crank_radius: Any, crank_ratio: Any, offset: Any, cylinder_set: Any,
    by_count: CylindersByCount, throws: Any,
) -> Any:  # fmt: skip
    """Cycle mean of the inertia of the reciprocating masses of each throw [kg m2].

    m r^2 sum f_m f_r^2 mean (c/(r omega))^2 over the cylinders of a throw: see
    `masses.engine_inertia`. `throws` are numbers of throws from 1, and broadcast; NaN past the
    last one. Other arguments as of `cylinder_means.engine_inertia_of_cylinders`.
    """

    def of_one(member: Member) -> Any:
        return mean_square(member, crank_ratio, offset)

    moment = reciprocating_mass * crank_radius**2
    return moment * _of_throws(of_one, cylinder_set, by_count, throws)


def mean_torques_of_throws(
    lever: Any, crank_ratio: Any, offset: Any, row: Any, family: Family, friction_torque: Any,
    cylinder_set: Any, by_count: CylindersByCount, throws: Any,
) -> Any:  # fmt: skip
    """Mean torque on each throw [N m]: that of the gas, less each cylinder's share of the friction.

    Parameters
    ----------
    lever : array_like
        Crank radius times piston area times the factor on the diagram [m3].
    crank_ratio, offset, row, family
        As of `engine_dyn.speed.mean_gas.mean_gas_torque`.
    friction_torque : array_like
        Mean, of the whole engine [N m]; all cylinders have the same part of it.
    cylinder_set, by_count, throws
        As of `reciprocating_inertia_of_throws`.
    """
    from engine_dyn.speed.mean_gas import mean_gas_torque

    known: dict[tuple[Any, ...], Any] = {}

    def of_one(member: Member) -> Any:
        key = member.pressure_factor, member.radius_factor, member.side
        if key not in known:
            own = member.own(crank_ratio, offset)
            known[key] = member.radius_factor * mean_gas_torque(
                own.crank_ratio, row, family, own.offset, member.pressure_factor
            )
        return known[key]

    friction = value_of_sets(cylinder_set, by_count, lambda engine: 1.0 / engine.count)
    pistons = _of_throws(lambda _: 1.0, cylinder_set, by_count, throws)
    gas = _of_throws(of_one, cylinder_set, by_count, throws)
    return lever * gas - friction_torque * friction * pistons


def _of_throws(
    of_one: Callable[[Member], Any], cylinder_set: Any, by_count: CylindersByCount, throws: Any
) -> Any:
    """Sum of a value over the cylinders of each throw."""
    numbers = np.asarray(throws)
    total: Any = np.nan
    for number in np.unique(numbers).astype(int):

        def of_engine(engine: Cylinders, number: int = number) -> Any:
            places = along_shaft(engine)
            if number > len(places):
                return np.nan
            return sum(of_one(engine.members[i]) for i in places[number - 1])

        total = np.where(numbers == number, value_of_sets(cylinder_set, by_count, of_engine), total)
    return total
