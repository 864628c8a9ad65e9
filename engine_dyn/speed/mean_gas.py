"""Mean over angle of the gas pressure times the reduced piston velocity, of one cylinder or all.

The mean gas torque is this mean times piston area, crank radius and number of cylinders,
docs/method.md (29). The mean is linear in the factor f on a cylinder's pressure above motored,
p = p_motored + f (p - p_motored), so equal throws need two tables at most: that of the diagram and
that of the motored diagram.
"""

from __future__ import annotations

import threading
from functools import lru_cache
from typing import Any
from weakref import WeakKeyDictionary

import numpy as np

from engine_dyn.geometry.cylinder_means import mean_of_cylinders
from engine_dyn.geometry.cylinders import CylindersByCount, Member
from engine_dyn.geometry.velocity_harmonics import (
    LARGEST_RATIO,
    MANY_TERMS,
    TURN_ANGLES,
    TURN_SAMPLES,
    centred_ratio,
    curves_at,
)
from engine_dyn.pressure.cycle_table import CycleTable
from engine_dyn.pressure.family import Family
from engine_dyn.speed.batch.mean_gas import mean_gas_of_samples, means_of_diagrams
from engine_dyn.speed.tables.mean_gas import mean_gas_of_pairs
from engine_dyn.speed.tables.node_counts import row_map, rows_needed
from engine_dyn.speed.tables.pressure_grid import angles_of_cycle, make_grid
from engine_dyn.speed.tables.work_tables import FEWEST_NODES
from engine_dyn.types import Floats, Integers

__all__ = ["mean_gas_of_equal_throws", "mean_gas_of_unequal_throws", "mean_gas_torque"]

MANY_MEANS = 512
"""From so many on, mean torques are sums over samples of the velocity; the error is rounding."""

ROWS_AT_ONCE = 64
"""Diagrams whose pressures are tabulated at a time."""


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
    three-point Gauss-Legendre on half degrees. Means of many are sums over samples of the velocity;
    `tables` is the number of pairs of crank ratio and row of the whole sweep, where these
    are a block of it.
    """
    crank_ratio, row, offset_ratio = np.broadcast_arrays(
        np.asarray(crank_ratio, dtype=float), np.asarray(row, dtype=float),
        np.asarray(offset_ratio, dtype=float),
    )  # fmt: skip
    # Copies: kernels ask whether they may write, and of a broadcast array NumPy warns then.
    ratios, offsets, places = (np.array(v).reshape(-1) for v in (crank_ratio, offset_ratio, row))
    result = np.empty(ratios.size)
    member = Member(0.0, pressure_factor, 1.0)
    alone = np.ones(ratios.size, dtype=np.bool_)
    many = (ratios.size if tables is None else tables) >= MANY_MEANS
    if many and not isinstance(family, CycleTable):
        centred = centred_ratio(ratios, offsets)
        together = (ratios >= 0.0) & (centred >= 0.0) & (centred <= LARGEST_RATIO[MANY_TERMS])
        alone = ~together
        found = np.empty(int(together.sum()))
        means = _means_of(family, member, rows_needed(places))
        mean_gas_of_samples(
            ratios[together], offsets[together], places[together], means,
            np.sin(TURN_ANGLES), np.cos(TURN_ANGLES), found,
        )  # fmt: skip
        result[together] = found
    if alone.any():
        rows = rows_needed(places[alone])
        row_of, grid = row_map(family, rows), make_grid(family, rows, FEWEST_NODES, (member,))
        rates, found = np.empty(6 * FEWEST_NODES), np.empty(int(alone.sum()))
        mean_gas_of_pairs(ratios[alone], offsets[alone], places[alone], row_of, grid, rates, found)
        result[alone] = found
    return result.reshape(row.shape)


@lru_cache(maxsize=4)
def _curves_of_samples(period: float) -> Floats:
    """Velocity over a cycle that is 1 at one sample and 0 at the others, for each sample.

    The Fourier series through the samples, without a mean: shape (sample, quadrature point).
    """
    orders = np.tile(np.arange(1, TURN_SAMPLES // 2), 2)
    cosines = np.repeat([False, True], orders.size // 2)
    at_samples = curves_at(TURN_ANGLES, orders, cosines)
    points = angles_of_cycle(period, FEWEST_NODES, 0.0)[2]
    together = np.einsum("ki,kp->ip", at_samples, curves_at(points, orders, cosines))
    return np.asarray(2.0 / TURN_SAMPLES * together)


_kept: WeakKeyDictionary[Family, dict[float, Floats]] = WeakKeyDictionary()
_lock = threading.Lock()


def _means_of(family: Family, member: Member, rows: Integers) -> Floats:
    """Factors on samples of the velocity, (row, sample), NaN where not needed so far.

    They are kept with the family, because the next block of a sweep needs them again.
    """
    with _lock:
        of_family = _kept.setdefault(family, {})
        means = of_family.get(member.pressure_factor)
        if means is None:
            means = np.full((family.row_count + 1, TURN_SAMPLES), np.nan)
        missing = rows[np.isnan(means[rows, 0])]
        if missing.size:
            means = means.copy()  # what another thread reads stays
            curves = _curves_of_samples(family.period)
            for begin in range(0, missing.size, ROWS_AT_ONCE):
                some = missing[begin : begin + ROWS_AT_ONCE]
                grid = make_grid(family, some, FEWEST_NODES, (member,))
                means_of_diagrams(
                    grid.at_quadrature, curves, some, np.empty(curves.shape[1]), means
                )
        of_family[member.pressure_factor] = means
        return means


def mean_gas_of_equal_throws(
    crank_ratio: Any, offset: Any, row: Any, family: Family, pressure_factor: Any, tables: int
) -> Any:
    """Mean of p v [Pa] where all crank radii are the engine's.

    Parameters
    ----------
    crank_ratio, offset : array_like
        Crank radius over rod length, and offset of the piston-pin line over the crank radius.
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
