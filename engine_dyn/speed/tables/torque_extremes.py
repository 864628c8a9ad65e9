"""Extremes of the torque at nominal speed, and the swing of its work."""

from __future__ import annotations

import math

from engine_dyn.compilation import indices_on_stack, inlined, kernel
from engine_dyn.speed.fields import (
    BORE,
    CRANK_RATIO,
    DOUBLE_RADIUS,
    FRICTION_TORQUE,
    GEAR_RATIO,
    INPUTS,
    LOAD_PHASE,
    LOAD_SCALE,
    MASS,
    OFFSET_RATIO,
    OUTPUT,
    SPEED,
)
from engine_dyn.speed.product import Product, count_of, offsets_at
from engine_dyn.speed.tables import work_tables
from engine_dyn.speed.tables.extremes import refine
from engine_dyn.speed.tables.load_over_angle import join_load, keep_gas
from engine_dyn.speed.tables.lookup import blend_of
from engine_dyn.speed.tables.pressure_grid import Grid
from engine_dyn.speed.tables.work_tables import (
    GAS_TORQUE,
    GAS_WORK,
    GAS_WORK_MIDDLE,
    SHAPE,
    SHAPE_MIDDLE,
    SHAPE_SLOPE,
    SQUARE,
    SQUARE_MIDDLE,
    SQUARE_SLOPE,
    TORQUE,
    TORQUE_MIDDLE,
    TORQUE_SLOPE,
)
from engine_dyn.types import Floats, Integers

__all__ = ["extremes_of_torque", "range_of_sum"]


@inlined
def range_of_sum(
    width: float, a: float, b: float, table: Floats, first: tuple[int, int, int],
    second: tuple[int, int, int],
) -> tuple[float, float]:  # fmt: skip
    """Largest and smallest value of a X + b Y, docs/method.md (90) and (91).

    X and Y are given by their rows of value, slope and middle.
    """
    nodes = table.shape[1]
    high, low = -math.inf, math.inf
    top = bottom = 0
    for j in range(nodes):
        value = a * table[first[0], j] + b * table[second[0], j]
        if value > high:
            high, top = value, j
        if value < low:
            low, bottom = value, j
    for upward in (1.0, -1.0):
        node = top if upward > 0.0 else bottom
        here = a * table[first[1], node] + b * table[second[1], node]
        left = node if here * upward > 0.0 else (node - 1 if node > 0 else nodes - 1)
        right = left + 1 if left + 1 < nodes else 0
        d_left = width * (a * table[first[1], left] + b * table[second[1], left])
        d_right = width * (a * table[first[1], right] + b * table[second[1], right])
        if d_left * upward > 0.0 and d_right * upward < 0.0:
            value, _, _ = refine(
                a * table[first[0], left] + b * table[second[0], left],
                a * table[first[0], right] + b * table[second[0], right],
                d_left,
                d_right,
                a * table[first[2], left] + b * table[second[2], left],
            )
            if upward > 0.0:
                high = value
            else:
                low = value
    return high, low


@kernel
def extremes_of_torque(
    begin: int,
    end: int,
    product: Product,
    row_of: Integers,
    width: float,
    grid: Grid,
    wanted: Integers,
    scalars: Floats,
    over_angle: Floats,
    table: Floats,
    middles: Floats,
    rates: Floats,
    plain: Floats,
) -> None:
    """Extremes of the torque at nominal speed and the energy swing of the designs begin .. end - 1.

    Rows of `wanted` are the largest torque, the smallest torque and the energy swing. The energy
    swing is that of the torque less a load over angle (`over_angle` as in `driver.solve_designs`).
    `table`, `middles`, `rates` and `plain` are scratch.
    """
    values = product.values
    designs = count_of(product.other_axes, product)
    shared, at = indices_on_stack(INPUTS), indices_on_stack(INPUTS)
    for i in range(INPUTS):
        shared[i] = at[i] = 0
    loaded = over_angle.shape[1] > 0
    current = -1
    for index in range(begin, end):
        which = index // designs
        if which != current:
            current = which
            offsets_at(which, product.table_axes, product, product.value_start, shared)
            work_tables.build(
                values[shared[CRANK_RATIO]], values[shared[OFFSET_RATIO]],
                blend_of(values, shared, row_of), width, grid, table, middles, rates,
            )  # fmt: skip
            if loaded:
                keep_gas(table, plain)
        offsets_at(index % designs, product.other_axes, product, shared, at)
        radius = 0.5 * values[at[DOUBLE_RADIUS]]
        lever = 0.25 * math.pi * values[at[BORE]] ** 2 * radius
        moment = values[at[MASS]] * (radius * values[at[SPEED]]) ** 2
        target = at[OUTPUT]
        if wanted[0] >= 0 or wanted[1] >= 0:
            if loaded:  # of the engine alone
                for j in range(table.shape[1]):
                    table[TORQUE, j] = plain[3, j]
            high, low = range_of_sum(
                width, lever, moment, table,
                (TORQUE, TORQUE_SLOPE, TORQUE_MIDDLE), (SHAPE, SHAPE_SLOPE, SHAPE_MIDDLE),
            )  # fmt: skip
            if wanted[0] >= 0:
                scalars[wanted[0], target] = high - values[at[FRICTION_TORQUE]]
            if wanted[1] >= 0:
                scalars[wanted[1], target] = low - values[at[FRICTION_TORQUE]]
        if wanted[2] >= 0:
            if loaded:
                join_load(
                    values[at[LOAD_SCALE]], values[at[GEAR_RATIO]], values[at[LOAD_PHASE]], lever,
                    width, over_angle, plain, table,
                )  # fmt: skip
            high, low = range_of_sum(
                width, lever, -0.5 * moment, table,
                (GAS_WORK, GAS_TORQUE, GAS_WORK_MIDDLE),
                (SQUARE, SQUARE_SLOPE, SQUARE_MIDDLE),
            )  # fmt: skip
            scalars[wanted[2], target] = high - low
