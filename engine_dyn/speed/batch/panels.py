"""Tables of designs that share none: interpolated in the crank ratio.

Everything in a table is linear in the pressure and smooth in the crank ratio. So a design's own
table is a sum of tables that many designs share: of the two diagrams that its own lies between, and
of a unit pressure for the crankcase, each at the POINTS crank ratios of its panel. Panels are fixed
intervals of the crank ratio whose width is a share of the distance to 1, where the velocity is
singular; Chebyshev's points in each leave an error of 2 (SPREAD)^-POINTS or about 1e-10 of a table.
Which panel a design lies in depends on its crank ratio alone, so its numbers cannot depend on what
else is in the sweep.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from engine_dyn.compilation import inlined, kernel, wide_vectors
from engine_dyn.loads.friction import FRICTIONLESS
from engine_dyn.speed.batch.lanes import (
    CRANKCASE,
    LANES,
    NEXT_SHARE,
    NEXT_TABLE,
    POINT,
    POINTS,
    ROW_SHARE,
    ROW_TABLE,
    SWING,
    UNIT_TABLE,
    Form,
)
from engine_dyn.speed.batch.levels import (
    ALIAS_P,
    ALIAS_V,
    ALIASED,
    CHUNK,
    CONSTANTS,
    CUBES,
    F_DP,
    F_IP,
    F_MP,
    F_P,
    FOURTHS,
    HIGHEST_SLOPE,
    HIGHEST_SLOPE_V,
    NODE_FIELDS,
    P_ABOVE,
    P_BELOW,
    PP,
    PV,
    RIPPLE,
    RIPPLE_V,
    SQUARES,
    TILT,
    TILT_V,
    V_ABOVE,
    V_BELOW,
    VV,
    WORK,
    Levels,
    P,
    V,
    fill_levels,
    make_levels,
)
from engine_dyn.speed.tables import work_tables
from engine_dyn.speed.tables.work_tables import (
    SHAPE,
    SQUARE,
    TABLE_ROWS,
    TORQUE,
    Blend,
    Grid,
    bounds_of,
)
from engine_dyn.types import Floats, Integers

__all__ = [
    "LEAST",
    "TORQUE_RANGE",
    "Panels",
    "build_panel",
    "bytes_of_table",
    "fill_block",
    "make_build",
    "make_own",
    "make_panels",
    "panel_at",
    "points_of",
    "take_table",
]


MOST_PANELS = 256
"""More than there are panels for crank ratios up to 0.9999, halved ones too."""

SHRINK = 0.92
"""Distance to crank ratio 1 at the end of a panel over that at its beginning."""

BOUND = 1.05
"""Factor on bounds that were taken at the points of a panel only."""

NUMBERS = 4
TORQUE_RANGE, STEEPEST, LEAST, WORST = range(NUMBERS)


class Panels(NamedTuple):
    """Shared tables, numbered: (table, ...).

    `fine` is (table, fine node, pair, point), a pair being value, slope, antiderivative, middle;
    `coarse` (table, coarse node, value or integral, point); `chunk` (table, chunk, kind), a
    kind being above, below, ripple or tilt; `numbers` (table, NUMBERS); `alias` (table, point)
    what the coarse level sees wrongly of the mean. A table is of the work of one diagram; of a unit
    pressure; or, the one after that, of the square velocity V.
    """

    fine: Floats
    coarse: Floats
    chunk: Floats
    numbers: Floats
    alias: Floats


@inlined
def panel_at(ratio: float, parts: int) -> int:
    """Number of the panel in which one crank ratio lies, each panel cut into so many parts."""
    return int(math.floor(parts * math.log1p(-ratio) / math.log(SHRINK)))


def points_of(used: Integers, count: int, parts: int = 1) -> Floats:
    """Crank ratios of the points of some panels, Chebyshev's of the first kind: (panel, 0, point).

    (panel, 1, point) are the denominators of Lagrange's polynomials through them. `parts` as in
    `panel_at`.
    """
    turn = np.cos(np.pi * (2.0 * np.arange(count) + 1.0) / (2.0 * count))
    points = np.zeros((MOST_PANELS, 2, count))
    first, last = SHRINK ** (used / parts), SHRINK ** ((used + 1) / parts)
    points[used, 0] = 1.0 - 0.5 * (first + last)[:, None] + 0.5 * (first - last)[:, None] * turn
    between = points[used, 0][:, :, None] - points[used, 0][:, None, :]
    points[used, 1] = (between + np.eye(count)).prod(axis=-1)
    return points


@inlined
def share_of(point: int, ratio: float, points: Floats) -> float:
    """Share of a point of a panel in what is interpolated at `ratio`."""
    above = 1.0
    for other in range(points.shape[1]):
        if other != point:
            above *= ratio - points[0, other]
    return above / points[1, point]


def bytes_of_table(nodes: int, ratio: int) -> int:
    """Memory of one shared table."""
    return 8 * POINTS * (4 * (nodes + 2 * ratio) + 2 * nodes // ratio)


def make_panels(count: int, nodes: int, ratio: int) -> Panels:
    """Memory of `count` shared tables."""
    coarse = nodes // ratio
    return Panels(
        fine=np.empty((count, nodes + 2 * ratio, 4, POINTS)),
        coarse=np.empty((count, coarse, 2, POINTS)),
        chunk=np.zeros((count, coarse // CHUNK, 4)),
        numbers=np.zeros((count, NUMBERS)),
        alias=np.zeros((count, POINTS)),
    )


def make_own(nodes: int, ratio: int, fine: Floats) -> Levels:
    """Levels of a block whose lanes have a table each; the fine one stays interpolated."""
    coarse = nodes // ratio
    return Levels(
        coarse=np.zeros((coarse, NODE_FIELDS, LANES)),
        chunk=np.zeros((coarse // CHUNK, NODE_FIELDS, LANES)),
        fine=fine,
        constants=np.zeros((CONSTANTS, LANES)),
    )


def make_build(nodes: int, steps: int, ratio: int) -> tuple[Floats, Floats, Floats, Levels]:
    """Working memory of `build_panel`: table, middles, rates, levels."""
    return (
        np.empty((TABLE_ROWS, nodes)), np.empty((4, nodes)), np.empty(6 * steps),
        make_levels(nodes, ratio),
    )  # fmt: skip


@kernel
def build_panel(
    number: int,
    row: int,
    points: Floats,
    width: float,
    ratio: int,
    grid: Grid,
    panels: Panels,
    table: Floats,
    middles: Floats,
    rates: Floats,
    levels: Levels,
) -> None:
    """Shared table `number`: of a row of the grid; with row -1, those of unit pressure and of V."""
    nodes = table.shape[1]
    coarse = nodes // ratio
    unit = row < 0
    # A crankcase at -1 under no pressure: what is left is a pressure of 1.
    scale, crankcase = (0.0, -1.0) if unit else (1.0, 0.0)
    blend = Blend(max(row, 0), max(row, 0), 0.0, scale, crankcase, FRICTIONLESS)
    for quantity in range(2 if unit else 1):
        for field in range(NUMBERS):
            panels.numbers[number + quantity, field] = math.inf if field == LEAST else 0.0
        for group in range(coarse // CHUNK):
            panels.chunk[number + quantity, group, 0] = 0.0
            panels.chunk[number + quantity, group, 1] = 0.0
            panels.chunk[number + quantity, group, 2] = 0.0
            panels.chunk[number + quantity, group, 3] = 0.0
    for i in range(POINTS):
        work_tables.build(points[i], 0.0, blend, nodes, width, grid, table, middles, rates)
        fill_levels(table, width, ratio, levels)
        for quantity in range(2 if unit else 1):
            here = number + quantity
            for n in range(nodes + 2 * ratio):
                panels.fine[here, n, 0, i] = levels.fine[n, F_P + quantity]
                panels.fine[here, n, 1, i] = levels.fine[n, F_DP + quantity]
                panels.fine[here, n, 2, i] = levels.fine[n, F_IP + quantity]
                panels.fine[here, n, 3, i] = levels.fine[n, F_MP + quantity]
            for n in range(coarse):
                panels.coarse[here, n, 0, i] = levels.coarse[n, P + quantity]
                panels.coarse[here, n, 1, i] = levels.coarse[n, WORK + quantity]
            for group in range(coarse // CHUNK):
                above = BOUND * levels.chunk[group, P_ABOVE + 2 * quantity]
                below = BOUND * levels.chunk[group, P_BELOW + 2 * quantity]
                panels.chunk[here, group, 0] = max(panels.chunk[here, group, 0], above)
                panels.chunk[here, group, 1] = max(panels.chunk[here, group, 1], below)
                ripple = BOUND * levels.chunk[group, RIPPLE + quantity]
                panels.chunk[here, group, 2] = max(panels.chunk[here, group, 2], ripple)
                tilt = BOUND * levels.chunk[group, TILT + quantity]
                panels.chunk[here, group, 3] = max(panels.chunk[here, group, 3], tilt)
            torque = SHAPE if quantity == 1 else TORQUE
            low, high = bounds_of(table[torque])
            span = BOUND * (high - low)
            slope = BOUND * levels.constants[HIGHEST_SLOPE_V if quantity == 1 else HIGHEST_SLOPE]
            numbers = panels.numbers
            numbers[here, TORQUE_RANGE] = max(numbers[here, TORQUE_RANGE], span)
            numbers[here, STEEPEST] = max(numbers[here, STEEPEST], slope)
            panels.alias[here, i] = levels.constants[ALIAS_P + quantity]
            numbers[here, WORST] = max(numbers[here, WORST], levels.constants[ALIASED])
            numbers[here, LEAST] = min(numbers[here, LEAST], BOUND * bounds_of(table[SQUARE])[0])


@inlined
def take_table(
    k: int, ratio: float, weight: float, scale: float, crankcase: float, first: int, second: int,
    unit: int, points: Floats, panels: Panels, s: Floats,
) -> None:  # fmt: skip
    """Which shared tables make a lane's own, and by which weights (Lagrange's polynomials)."""
    s[ROW_TABLE + k] = first
    s[NEXT_TABLE + k] = second
    s[UNIT_TABLE + k] = unit
    s[ROW_SHARE + k] = scale * (1.0 - weight)
    s[NEXT_SHARE + k] = scale * weight
    s[CRANKCASE + k] = crankcase
    numbers = panels.numbers
    s[SWING + k] = (
        s[ROW_SHARE + k] * numbers[first, TORQUE_RANGE]
        + s[NEXT_SHARE + k] * numbers[second, TORQUE_RANGE]
        + crankcase * numbers[unit, TORQUE_RANGE]
    )
    for i in range(POINTS):
        s[POINT + i * LANES + k] = share_of(i, ratio, points)


@inlined
def fill_block(
    form: Form,
    lanes: int,
    first: int,
    second: int,
    unit: int,
    panels: Panels,
    levels: Levels,
    s: Floats,
) -> None:
    """Coarse levels of all lanes of a block, which share the shared tables."""
    wide_vectors()
    shared, coarse, chunk, constants = panels.coarse, levels.coarse, levels.chunk, levels.constants
    nodes = coarse.shape[0]
    for n in range(nodes):
        for kind in range(2):
            work, square = (P, V) if kind == 0 else (WORK, SQUARES)
            a, b = shared[first, n, kind], shared[second, n, kind]
            c, v = shared[unit, n, kind], shared[unit + 1, n, kind]
            to_work, to_square = coarse[n, work], coarse[n, square]
            a0, a1, a2, a3, a4, a5 = a[0], a[1], a[2], a[3], a[4], a[5]
            b0, b1, b2, b3, b4, b5 = b[0], b[1], b[2], b[3], b[4], b[5]
            c0, c1, c2, c3, c4, c5 = c[0], c[1], c[2], c[3], c[4], c[5]
            v0, v1, v2, v3, v4, v5 = v[0], v[1], v[2], v[3], v[4], v[5]
            for k in range(lanes):
                w0, w1, w2 = s[POINT + k], s[POINT + LANES + k], s[POINT + 2 * LANES + k]
                w3, w4 = s[POINT + 3 * LANES + k], s[POINT + 4 * LANES + k]
                w5 = s[POINT + 5 * LANES + k]
                here = a0 * w0 + a1 * w1 + a2 * w2 + a3 * w3 + a4 * w4 + a5 * w5
                after = b0 * w0 + b1 * w1 + b2 * w2 + b3 * w3 + b4 * w4 + b5 * w5
                under = c0 * w0 + c1 * w1 + c2 * w2 + c3 * w3 + c4 * w4 + c5 * w5
                to_work[k] = (
                    s[ROW_SHARE + k] * here + s[NEXT_SHARE + k] * after - s[CRANKCASE + k] * under
                )
                to_square[k] = v0 * w0 + v1 * w1 + v2 * w2 + v3 * w3 + v4 * w4 + v5 * w5
    bounds, numbers = panels.chunk, panels.numbers
    for group in range(chunk.shape[0]):
        either = max(bounds[unit, group, 0], bounds[unit, group, 1])
        for k in range(lanes):
            a, b, c = s[ROW_SHARE + k], s[NEXT_SHARE + k], s[CRANKCASE + k] * either
            above = a * bounds[first, group, 0] + b * bounds[second, group, 0]
            below = a * bounds[first, group, 1] + b * bounds[second, group, 1]
            chunk[group, P_ABOVE, k] = above + c
            chunk[group, P_BELOW, k] = below + c
            ripple = a * bounds[first, group, 2] + b * bounds[second, group, 2]
            chunk[group, RIPPLE, k] = ripple + s[CRANKCASE + k] * bounds[unit, group, 2]
            chunk[group, RIPPLE_V, k] = bounds[unit + 1, group, 2]
            tilt = a * bounds[first, group, 3] + b * bounds[second, group, 3]
            chunk[group, TILT, k] = tilt + s[CRANKCASE + k] * bounds[unit, group, 3]
            chunk[group, TILT_V, k] = bounds[unit + 1, group, 3]
            chunk[group, V_ABOVE, k] = bounds[unit + 1, group, 0]
            chunk[group, V_BELOW, k] = bounds[unit + 1, group, 1]
    for k in range(lanes):
        constants[HIGHEST_SLOPE, k] = (
            s[ROW_SHARE + k] * numbers[first, STEEPEST]
            + s[NEXT_SHARE + k] * numbers[second, STEEPEST]
            + s[CRANKCASE + k] * numbers[unit, STEEPEST]
        )
        constants[HIGHEST_SLOPE_V, k] = numbers[unit + 1, STEEPEST]
        constants[ALIASED, k] = max(
            max(numbers[first, WORST], numbers[second, WORST]),
            max(numbers[unit, WORST], numbers[unit + 1, WORST]),
        )
        constants[ALIAS_P, k] = 0.0
        constants[ALIAS_V, k] = 0.0
    alias = panels.alias
    for i in range(POINTS):
        a, b, c = alias[first, i], alias[second, i], alias[unit, i]
        v = alias[unit + 1, i]
        for k in range(lanes):
            weight = s[POINT + i * LANES + k]
            constants[ALIAS_P, k] += weight * (
                s[ROW_SHARE + k] * a + s[NEXT_SHARE + k] * b - s[CRANKCASE + k] * c
            )
            constants[ALIAS_V, k] += weight * v
    if len(form) > 1:
        fill_moments(form, lanes, coarse, constants)


@inlined
def fill_moments(form: Form, lanes: int, coarse: Floats, constants: Floats) -> None:
    """Means of the products of P and V that the closure of `form` needs."""
    wide_vectors()
    nodes = coarse.shape[0]
    share = 1.0 / nodes
    for i in range(CUBES, FOURTHS + 5):
        for k in range(lanes):
            constants[i, k] = 0.0
    for k in range(lanes):
        constants[PP, k] = 0.0
        constants[PV, k] = 0.0
        constants[VV, k] = 0.0
    for n in range(nodes):
        works, squares = coarse[n, P], coarse[n, V]
        for k in range(lanes):
            p, v = works[k], squares[k]
            constants[PP, k] += share * p * p
            constants[PV, k] += share * p * v
            constants[VV, k] += share * v * v
        if len(form) == 2:
            for k in range(lanes):
                p, v = works[k], squares[k]
                p2, v2 = share * p * p, share * v * v
                constants[CUBES, k] += p2 * p
                constants[CUBES + 1, k] += p2 * v
                constants[CUBES + 2, k] += v2 * p
                constants[CUBES + 3, k] += v2 * v
                constants[FOURTHS, k] += p2 * p * p
                constants[FOURTHS + 1, k] += p2 * p * v
                constants[FOURTHS + 2, k] += p2 * v * v
                constants[FOURTHS + 3, k] += v2 * v * p
                constants[FOURTHS + 4, k] += v2 * v * v
