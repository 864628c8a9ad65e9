"""Mean over angle of the gas pressure times the reduced piston velocity, of one cylinder or all.

The mean gas torque is this mean times piston area, crank radius and number of cylinders,
docs/method.md (29). It is a sum of columns as the work is, see `engine_dyn.speed.work`, and linear
in the factor on a cylinder's pressure above motored: equal throws need two means at most.
"""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np

from engine_dyn.compilation import kernel
from engine_dyn.geometry.articulated_rod import ArticulatedRod
from engine_dyn.geometry.cylinder_means import mean_of_cylinders
from engine_dyn.geometry.cylinders import CylindersByCount, Member, PressureFactor
from engine_dyn.pressure.cycle_table import CycleTable
from engine_dyn.pressure.family import Family
from engine_dyn.pressure.memory import remembered
from engine_dyn.pressure.motored import pressures_of_rows
from engine_dyn.speed.work.boxes import Box, box_of, boxes_of
from engine_dyn.speed.work.columns import ATMOSPHERE, mean_weights
from engine_dyn.types import Floats, Integers

ROWS_AT_ONCE = 384  # Diagrams whose pressures are tabulated at a time


def mean_gas_torque(
    crank_ratio: Any, row: Any, family: Family, offset_ratio: Any = 0.0,
    pressure_factor: PressureFactor = 1.0, rod: ArticulatedRod | None = None,
) -> Floats:  # fmt: skip
    """Mean over angle of p c/(r omega) [Pa] for one cylinder, broadcasting.

    docs/method.md (29). Times A r this is the mean torque of the absolute pressure, and of the
    gauge pressure too, because the crankcase pressure does no work over a cycle. The quadrature is
    three-point Gauss-Legendre on half degrees. Of a factor for each cycle it is the mean over them.
    """
    if isinstance(pressure_factor, tuple):
        each = {
            factor: mean_gas_torque(crank_ratio, row, family, offset_ratio, factor, rod)
            for factor in sorted(set(pressure_factor))
        }
        return np.mean([each[factor] for factor in pressure_factor], axis=0)
    given = np.broadcast_arrays(
        *(np.asarray(v, dtype=float) for v in (crank_ratio, offset_ratio, row))
    )
    # Copies: kernels ask whether they may write, and of a broadcast array NumPy warns then.
    ratio, offset, places = (np.array(v).reshape(-1) for v in given)
    result, number = np.empty(ratio.size), boxes_of(ratio, offset, alone=rod is not None)
    for one in np.unique(number).tolist():
        here = np.flatnonzero(number == one)
        box = box_of(one, float(ratio[here[0]]), float(offset[here[0]]))
        low = np.floor(places[here]).astype(np.int64)
        weight = places[here] - low
        rows = np.unique(np.concatenate([low, low + (weight > 0.0)]))
        (means,) = remembered(
            family, ("mean gas", box, pressure_factor, rod, rows.tobytes()),
            partial(_means, family, box, Member(0.0, pressure_factor, 1.0, rod=rod), rows),
        )  # fmt: skip
        factors = box.factors(ratio[here], offset[here])
        result[here] = _add_up(factors, np.searchsorted(rows, low), weight, means)
    return result.reshape(given[0].shape)


def _means(family: Family, box: Box, member: Member, rows: Integers) -> tuple[Floats, ...]:
    """Mean of each diagram times each column of the velocity, shape (row, term)."""
    angle, weights = mean_weights(member, box, family.period)
    found = np.empty((rows.size, len(weights)))
    if isinstance(family, CycleTable):  # at once: it forgets what is not asked for with the next
        family.curves(rows)
    for begin in range(0, rows.size, ROWS_AT_ONCE):
        some = rows[begin : begin + ROWS_AT_ONCE]
        pressure = pressures_of_rows(family, some, angle, member.pressure_factor) - ATMOSPHERE
        _weigh(weights, pressure, found[begin : begin + some.size])
    return (found,)


@kernel
def _weigh(weights: Floats, pressure: Floats, found: Floats) -> None:
    """Sum of pressures times weights, for each row of both."""
    for i in range(pressure.shape[0]):
        for t in range(weights.shape[0]):
            total = 0.0
            for j in range(weights.shape[1]):
                total += weights[t, j] * pressure[i, j]
            found[i, t] = total


@kernel
def _add_up(factors: Floats, row: Integers, weight: Floats, means: Floats) -> Floats:
    """Sum over columns of each design, between two diagrams."""
    found = np.zeros(weight.size)
    for i in range(found.size):
        after = row[i] + (weight[i] > 0.0)
        for t in range(factors.shape[1]):
            mean = (1.0 - weight[i]) * means[row[i], t] + weight[i] * means[after, t]
            found[i] += factors[i, t] * mean
    return found


def mean_gas_of_equal_throws(
    crank_ratio: Any, offset: Any, row: Any, family: Family, pressure_factor: Any
) -> Any:
    """Mean of p v [Pa] where all crank radii are the engine's; arguments as of `mean_gas_torque`.

    `pressure_factor` is the mean factor of the cylinders on the pressure above motored.
    """
    whole = mean_gas_torque(crank_ratio, row, family, offset)
    factor = np.asarray(pressure_factor)
    if (factor == 1.0).all():
        return whole * factor
    motored = mean_gas_torque(crank_ratio, row, family, offset, 0.0)
    return np.where(factor == 1.0, whole, motored + factor * (whole - motored))


def mean_gas_of_unequal_throws(
    crank_ratio: Any, offset: Any, row: Any, family: Family, cylinder_set: Any,
    by_count: CylindersByCount,
) -> Any:  # fmt: skip
    """Mean of p v over cylinders on throws of unequal radius, over the engine's radius [Pa].

    Arguments as of `mean_gas_torque` and `mean_of_cylinders`.
    """

    def of_one(member: Member) -> Any:
        own = member.own(crank_ratio, offset)
        return member.radius_factor * mean_gas_torque(
            own.crank_ratio, row, family, own.offset, member.pressure_factor, member.rod
        )

    return mean_of_cylinders(cylinder_set, by_count, of_one)
