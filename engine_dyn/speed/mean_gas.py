"""Mean gas torque of a cylinder for arrays of crank ratios and diagrams."""

from __future__ import annotations

from typing import Any

import numpy as np

from engine_dyn.geometry.cylinders import Member
from engine_dyn.pressure.family import Family
from engine_dyn.speed.batch import panels
from engine_dyn.speed.batch.mean_gas import mean_gas_between, panels_of
from engine_dyn.speed.tables.mean_gas import mean_gas_of_pairs
from engine_dyn.speed.tables.node_counts import may_be, row_map, rows_needed
from engine_dyn.speed.tables.work_tables import FEWEST_NODES, make_grid
from engine_dyn.types import Floats

__all__ = ["mean_gas_torque"]

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
    if (ratios.size if tables is None else tables) < MANY_MEANS or offset:
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
