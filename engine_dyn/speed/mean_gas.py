"""Mean over angle of the gas pressure times the reduced piston velocity, of one cylinder or all.

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
from engine_dyn.pressure.cycle_table import CycleTable
from engine_dyn.pressure.family import Family
from engine_dyn.speed.batch import panels
from engine_dyn.speed.batch.mean_gas import mean_gas_between, panels_of
from engine_dyn.speed.tables.mean_gas import mean_gas_of_pairs
from engine_dyn.speed.tables.node_counts import may_be, row_map, rows_needed
from engine_dyn.speed.tables.work_tables import FEWEST_NODES, make_grid
from engine_dyn.types import Floats

__all__ = ["mean_gas_of_equal_throws", "mean_gas_of_unequal_throws", "mean_gas_torque"]

MANY_MEANS, POINTS_OF_MEANS = 512, 10
"""From MANY_MEANS on, mean torques are interpolated between POINTS_OF_MEANS crank ratios in each
panel; the error is rounding."""


def mean_gas_torque(
    crank_ratio: Any,
    row: Any,
    family: Family,
    offset_ratio: Any = 0.0,
    pressure_factor: float = 1.0,
    tables: int | None = None,
) -> Floats:
    """Mean over angle of p c/(r omega) [Pa] for one cylinder, broadcasting.

    docs/method.md (29). Times A r this is the mean torque of the absolute pressure, and of the
    gauge pressure too, because the crankcase pressure does no work over a cycle. The quadrature is
    three-point Gauss-Legendre on half degrees. Means of many are interpolated; `tables` is the
    number of pairs of crank ratio and row of the whole sweep, where these are a block of it.
    """
    offset = may_be(offset_ratio)
    crank_ratio, row, offset_ratio = np.broadcast_arrays(
        np.asarray(crank_ratio, dtype=float), np.asarray(row, dtype=float),
        np.asarray(offset_ratio, dtype=float),
    )  # fmt: skip
    # Copies: kernels ask whether they may write, and of a broadcast array NumPy warns then.
    ratios, offsets, places = (np.array(v).reshape(-1) for v in (crank_ratio, offset_ratio, row))
    result = np.empty(ratios.size)
    rows = rows_needed(places)
    member = Member(0.0, pressure_factor, 1.0)
    row_of, grid = row_map(family, rows), make_grid(family, rows, FEWEST_NODES, (member,))
    rates = np.empty(6 * FEWEST_NODES)
    few = (ratios.size if tables is None else tables) < MANY_MEANS
    if few or offset or isinstance(family, CycleTable):
        mean_gas_of_pairs(ratios, offsets, places, row_of, grid, rates, result)
        return result.reshape(row.shape)
    # The mean is smooth in the crank ratio, so few points in each panel (see `panels`) suffice.
    number = np.empty(ratios.size, dtype=np.int64)
    panels_of(ratios, number)
    used = np.flatnonzero(np.bincount(number))
    points = panels.points_of(used, POINTS_OF_MEANS)
    means = np.zeros((panels.MOST_PANELS, POINTS_OF_MEANS, rows.size))
    at = np.tile(points[used, 0].reshape(-1), rows.size)
    of_rows = np.repeat(rows.astype(float), used.size * POINTS_OF_MEANS)
    found = np.empty(at.size)
    mean_gas_of_pairs(at, np.zeros(at.size), of_rows, row_of, grid, rates, found)
    shape = (rows.size, used.size, POINTS_OF_MEANS)
    means[used] = np.moveaxis(found.reshape(shape), 0, -1)
    mean_gas_between(ratios, places, number, row_of, points, means, result)
    return result.reshape(row.shape)


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
