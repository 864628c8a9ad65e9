"""The angles of curves over the crank angle, and the work curves of a table at them."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from engine_dyn.compilation import inlined, on_stack, rows_on_stack
from engine_dyn.geometry.cylinders import Cylinders
from engine_dyn.geometry.slider_crank import (
    offset_acceleration_at,
    offset_velocity_at,
    sine_of_top,
    turned,
)
from engine_dyn.loads.friction import (
    stroke_friction_parts_at,
    total_level_at,
    varies_at,
    weighted_sum_at,
)
from engine_dyn.pressure.family import Family
from engine_dyn.pressure.motored import row_with_factor
from engine_dyn.speed.batch.two_grid import F_DP, F_IP, F_P
from engine_dyn.speed.tables.pressure_grid import GAUSS_POINTS, Grid, steps_of
from engine_dyn.speed.tables.work_tables import (
    GAS_TORQUE,
    GAS_WORK,
    SQUARE,
    TORQUE,
    Blend,
    blended,
    mean_of_half,
    stroke_friction_weights,
)
from engine_dyn.types import Floats, Integers

__all__ = [
    "A_DP",
    "A_DV",
    "A_IP",
    "A_IV",
    "A_P",
    "A_V",
    "Angles",
    "POINT_FIELDS",
    "SAME_ANGLE",
    "TILE",
    "fill_points",
    "make_angles",
]

POINT_FIELDS = 6

A_P, A_V, A_IP, A_IV, A_DP, A_DV = range(POINT_FIELDS)
"""Of an angle: P, V, their antiderivatives and slopes."""

TILE = 32
"""Angles that are computed before they are written."""

SAME_ANGLE = 1e-9
"""Angles closer than that share of an interval are the same: the speed differs by less than 1e-12.
"""


class Angles(NamedTuple):
    """Angles of curves, one a class of those that agree modulo the engine's period.

    Attributes
    ----------
    node, offset : ndarray
        Nearest node of the table (up to the number of nodes) and the way from there [rad].
    interval, share : ndarray
        Coarse interval of the angle and the share of it that lies before.
    source, target, length : ndarray
        Runs of neighbours: from angle `source` of a tile on, to place `target` of a curve on.
    first_run : ndarray
        First run of every tile, and the number of them all.
    pressure, sine, cosine : ndarray
        At each angle, for every representative cylinder and each period of the engine that its
        cycle has: (diagram, angle and cylinder).
    between, between_sine, between_cosine : ndarray
        The same at three points of quadrature between node and angle.
    """

    node: Integers
    offset: Floats
    interval: Integers
    share: Floats
    source: Integers
    target: Integers
    length: Integers
    first_run: Integers
    pressure: Floats
    sine: Floats
    cosine: Floats
    between: Floats
    between_sine: Floats
    between_cosine: Floats


def make_angles(
    angles: Floats, family: Family, rows: Integers, engine: Cylinders, nodes: int, ratio: int
) -> Angles:
    """Where the wanted angles [rad] lie in a table of `nodes` nodes, with the pressure there."""
    period = engine.period / engine.symmetry
    width = period / nodes
    place = np.mod(angles, period) / width
    place[place > nodes - SAME_ANGLE] = 0.0
    order = np.argsort(place, kind="stable")
    ordered = place[order]
    begins = np.append(True, np.diff(ordered) > SAME_ANGLE)
    # Classes in the order of their first angle, so that runs are long whatever the spacing.
    leader = np.minimum.reduceat(order, np.flatnonzero(begins))
    first = np.empty(order.size, dtype=np.int64)
    first[order] = leader[np.cumsum(begins) - 1]
    distinct, number = np.unique(first, return_inverse=True)
    place = place[distinct]
    # Runs end where the next angle is not the next class, and with the tile.
    source = number.reshape(-1)
    breaks = (np.diff(source) != 1) | (source[1:] % TILE == 0)
    target = np.flatnonzero(np.append(True, breaks))
    length = np.diff(np.append(target, source.size))
    source = source[target]
    by_tile = np.argsort(source // TILE, kind="stable")
    tiles = np.arange(-(-distinct.size // TILE) + 1)
    first_run = np.searchsorted(source[by_tile] // TILE, tiles)

    node = np.rint(place)
    offset = (place - node) * width
    interval = np.minimum(np.floor(place / ratio).astype(np.int64), nodes // ratio - 1)
    back = np.arange(engine.symmetry) * period
    own = np.concatenate([member.phase - back for member in engine.representatives])
    at = place[:, None] * width + own
    between = (node[:, None] * width + offset[:, None] * np.asarray(GAUSS_POINTS))[:, None, :]
    between = between + own[:, None]

    def pressures(here: Floats) -> Floats:
        found = np.empty((len(rows), *here.shape))
        for place, row in enumerate(rows):
            for number, member in enumerate(engine.representatives):
                of_member = slice(number * engine.symmetry, (number + 1) * engine.symmetry)
                diagram = row_with_factor(family, int(row), member.pressure_factor)
                found[place, :, of_member] = diagram(here[:, of_member])
        return found.reshape(len(rows), -1)

    return Angles(
        node=node.astype(np.int64),
        offset=offset,
        interval=interval,
        share=place / ratio - interval,
        source=source[by_tile] % TILE,
        target=target[by_tile],
        length=length[by_tile],
        first_run=first_run,
        pressure=pressures(at),
        sine=np.sin(at).reshape(-1),
        cosine=np.cos(at).reshape(-1),
        between=pressures(between),
        between_sine=np.sin(between).reshape(-1),
        between_cosine=np.cos(between).reshape(-1),
    )


@inlined
def fill_points(
    ratio: float, shift: float, blend: Blend, grid: Grid, table: Floats, fine: Floats, margin: int,
    angles: Angles, points: Floats, speeds: Floats,
) -> None:  # fmt: skip
    """Fill `points` (angle, POINT_FIELDS) for one crank ratio, offset `shift` and diagram.

    `fine` is the fine grid, whose first node has `margin` rows before it. `speeds` is scratch: a
    number a point of quadrature.
    """
    nodes = table.shape[1]
    cylinders = grid.node_sine.size // nodes
    folds = steps_of(grid) // nodes
    members = grid.masses.size
    friction = blend.friction
    varies, level = varies_at(friction), total_level_at(friction)
    weights = rows_on_stack(4 * members)
    for i in range(4 * members):
        weights[i] = 0.0
    if varies:
        for i in range(members):
            radius = grid.radii[i]
            found = stroke_friction_weights(ratio * radius, shift / radius, blend, grid, i, speeds)
            for j in range(4):
                weights[4 * i + j] = found[j]
    mean = table[TORQUE, 0] - table[GAS_TORQUE, 0]
    mean_square = -table[SQUARE, 0]
    for i in range(cylinders):
        radius = grid.radii[i // folds]
        own, beside = ratio * radius, shift / radius
        top = sine_of_top(own, beside)
        upright = math.sqrt(1.0 - top * top)
        sine, cosine = turned(grid.node_sine[i * nodes], grid.node_cosine[i * nodes], top, upright)
        v = offset_velocity_at(sine, cosine, own, beside)
        mean_square += grid.masses[i // folds] * radius * radius * v * v
    rates = on_stack(3)
    for j in range(angles.node.size):
        torque = square = turn = rate = 0.0
        for i in range(cylinders):
            at = j * cylinders + i
            member = i // folds
            radius = grid.radii[member]
            own, beside = ratio * radius, shift / radius
            mass = grid.masses[member] * radius * radius
            of_member = (
                weights[4 * member],
                weights[4 * member + 1],
                weights[4 * member + 2],
                weights[4 * member + 3],
            )
            top = sine_of_top(own, beside)
            upright = math.sqrt(1.0 - top * top)
            sine, cosine = turned(angles.sine[at], angles.cosine[at], top, upright)
            v = offset_velocity_at(sine, cosine, own, beside)
            pressure = blended(blend, angles.pressure, at) - blend.crankcase
            torque += radius * pressure * v
            if varies:
                parts = stroke_friction_parts_at(friction.ring + pressure, v, angles.sine[at])
                torque -= weighted_sum_at(of_member, parts) - level
            square += mass * v * v
            turn += 2.0 * mass * v * offset_acceleration_at(sine, cosine, own, beside)
            for g in range(3):
                here = 3 * at + g
                sine, cosine = turned(
                    angles.between_sine[here], angles.between_cosine[here], top, upright
                )
                v = offset_velocity_at(sine, cosine, own, beside)
                pressure = blended(blend, angles.between, here) - blend.crankcase
                rates[g] = radius * pressure * v
                if varies:
                    load, sine = friction.ring + pressure, angles.between_sine[here]
                    parts = stroke_friction_parts_at(load, v, sine)
                    rates[g] -= weighted_sum_at(of_member, parts) - level
            rate += mean_of_half(rates[0], rates[1], rates[2])
        offset = angles.offset[j]
        node = angles.node[j]
        wrapped = node if node < nodes else 0
        row = margin + node
        points[j, A_P] = table[GAS_WORK, wrapped] + offset * (rate - mean)
        points[j, A_DP] = torque - mean
        points[j, A_V] = square - mean_square
        points[j, A_DV] = turn
        # The antiderivative of the cubic through both.
        for quantity in range(2):
            left, d_left = fine[row, F_P + quantity], fine[row, F_DP + quantity]
            points[j, A_IP + quantity] = fine[row, F_IP + quantity] + offset * (
                0.5 * (left + points[j, A_P + quantity])
                + offset / 12.0 * (d_left - points[j, A_DP + quantity])
            )
