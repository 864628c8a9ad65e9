"""Mean of the gas pressure times the reduced piston velocity, over the cylinders of an engine.

The mean gas torque is this mean times piston area, crank radius and number of cylinders,
docs/method.md (29). The mean is linear in the factor f on a cylinder's pressure above motored,
p = p_motored + f (p - p_motored), so equal throws need two tables at most: that of the diagram and
that of the motored diagram.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from engine_dyn.geometry.cylinder_means import mean_of_cylinders
from engine_dyn.geometry.cylinders import CylindersByCount, Member
from engine_dyn.pressure.family import Family
from engine_dyn.speed.mean_gas import mean_gas_torque

__all__ = ["mean_gas_of_equal_throws", "mean_gas_of_unequal_throws"]


def mean_gas_of_equal_throws(
    crank_ratio: Any, offset: Any, row: Any, family: Family, pressure_factor: Any, tables: int
) -> Any:
    """Mean of p v [Pa] where all crank radii are the engine's.

    Parameters
    ----------
    crank_ratio, offset : array_like
        Crank radius over rod length, and offset of the pin's line over the crank radius.
    row : array_like
        Place of the diagram in the family's table.
    family : Family
        Diagrams.
    pressure_factor : array_like
        Mean factor of the cylinders on the pressure above motored.
    tables : int
        Tables of the whole sweep, of which these designs may be a block: see `dispatch.solve`.
    """
    whole = mean_gas_torque(crank_ratio, row, family, offset, tables=tables)
    factor = np.asarray(pressure_factor)
    if (factor == 1.0).all():
        return whole * factor
    motored = mean_gas_torque(crank_ratio, row, family, offset, pressure_factor=0.0, tables=tables)
    return np.where(factor == 1.0, whole, motored + factor * (whole - motored))


def mean_gas_of_unequal_throws(
    crank_ratio: Any, offset: Any, row: Any, family: Family, cylinder_set: Any,
    by_count: CylindersByCount, tables: int,
) -> Any:  # fmt: skip
    """Mean of p v over cylinders on throws of unequal radius, over the engine's radius [Pa].

    Parameters as of `mean_gas_of_equal_throws` and `cylinder_means.value_of_sets`.
    """

    def of_one(member: Member) -> Any:
        own = member.own(crank_ratio, offset)
        return member.radius_factor * mean_gas_torque(
            own.crank_ratio, row, family, own.offset, member.pressure_factor, tables
        )

    return mean_of_cylinders(cylinder_set, by_count, of_one)
