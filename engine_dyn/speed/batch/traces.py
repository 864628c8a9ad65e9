"""Speed over crank angle of the designs of blocks that have been solved.

Between the coarse nodes y = beta I + w (symbols of docs/method.md (98)): the antiderivative I of X
carries all that is not smooth, and w is a polynomial of fifth degree through its values, slopes and
second derivatives at two neighbouring coarse nodes. X and I are tabulated once a table at the very
angles that are wanted, by quadrature from the nearest node. What remains for a design is a few
operations an angle:

    u = (X - beta I - w)/tau,   omega = nominal sqrt(1 + u),   omega' omega = nominal^2/2 du/dphi.

Where the engine repeats within the cycle, angles that agree modulo its period are computed once.
The lanes are written through a small tile, which stays in the cache, as rows of the results.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from engine_dyn.compilation import (
    SQUARE_SIDE,
    formula,
    inlined,
    on_stack,
    rows_on_stack,
    turn_square,
    wide_vectors,
)
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
from engine_dyn.speed.batch.forms import VARIABLE_INERTIA, Inertia
from engine_dyn.speed.batch.levels import F_DP, F_IP, F_IV, F_P, P_MOMENT, V_MOMENT, Levels, P, V
from engine_dyn.speed.batch.powers import root_remainder
from engine_dyn.speed.batch.state import (
    BETA,
    BEYOND_SERIES,
    CLOSURE_STEP,
    CODE,
    DEFERRED,
    ETA,
    GAS_FACTOR,
    HALF_EXPONENT,
    KAPPA,
    LANES,
    PAD,
    SPEED,
    Block,
)
from engine_dyn.speed.tables.work_tables import (
    GAS_TORQUE,
    GAS_WORK,
    GAUSS_POINTS,
    SQUARE,
    TORQUE,
    Blend,
    Grid,
    blended,
    mean_of_half,
    steps_of,
    stroke_friction_weights,
)
from engine_dyn.status import CONVERGED
from engine_dyn.types import Floats, Integers

__all__ = [
    "Angles",
    "Kept",
    "blocks_of",
    "fill_points",
    "keep",
    "make_angles",
    "make_kept",
    "make_working",
    "write_block",
]


KEPT_DESIGNS, KEPT_TABLES = 1024, 64
"""Designs and tables that are solved before their curves are written: what is kept of them should
stay in the cache, and each call costs as much as some designs."""

KEPT_FIELDS = 9
K_GAS, K_ETA, K_KAPPA, K_HALF, K_BETA, K_MOVED, K_NOMINAL, K_WIDE, K_CODE = (
    row * LANES for row in range(KEPT_FIELDS)
)
"""What is kept of a block's numbers, one row of lanes each."""

POINT_FIELDS = 6
A_P, A_V, A_IP, A_IV, A_DP, A_DV = range(POINT_FIELDS)
"""Of an angle: P, V, their antiderivatives and slopes."""

TILE = 32
"""Angles that are computed before they are written."""

TILE_ROWS, NUMBER_ROWS, SIX_ROWS = TILE * LANES, KEPT_FIELDS * LANES, 6 * LANES

SAME_ANGLE = 1e-9
"""Angles closer than that share of an interval are the same: the speed differs by less than 1e-12.
"""


class Kept(NamedTuple):
    """What curves need of solved blocks: (block, lanes of rows). No blocks: nothing is kept.

    `numbers` are the KEPT_FIELDS, `deviations` and `remainders` those of a `Block` (these are empty
    where nothing is iterated: r is zero), `targets` the places of the results.
    """

    numbers: Floats
    deviations: Floats
    remainders: Floats
    targets: Integers


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


def make_kept(blocks: int, nodes: int, iterated: bool) -> Kept:
    """Memory for blocks of tables with `nodes` coarse nodes; only `iterated` ones have r."""
    rows = (nodes + 2 * PAD) * LANES
    return Kept(
        numbers=np.empty((blocks, KEPT_FIELDS * LANES)),
        deviations=np.empty((blocks, rows)),
        remainders=np.empty((blocks, rows if iterated else 0)),
        targets=np.zeros((blocks, LANES), dtype=np.int64),
    )


def make_working(angles: Angles, kept: Kept) -> tuple[Floats, Floats, Floats]:
    """Working memory of `driver.write_traces`: its points, ws and ds."""
    rows = kept.deviations.shape[1]
    return np.empty((angles.node.size, POINT_FIELDS)), np.empty(rows), np.empty(rows)


def blocks_of(size: int, designs: int) -> tuple[int, int]:
    """Designs to keep at a time, of `size` with `designs` to a table, and their most blocks."""
    most = min(KEPT_DESIGNS, KEPT_TABLES * designs)
    # Equal shares: each has to build its tables, and smaller ones stay in a nearer cache.
    count = -(-size // -(-size // most))
    return count, count // LANES + count // designs + 3


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
def keep(number: int, block: Block, places: Integers, kept: Kept) -> None:
    """Keep what `write_block` needs of a solved block."""
    state, numbers = block.state, kept.numbers[number]
    for k in range(LANES):
        numbers[K_GAS + k] = state[GAS_FACTOR + k]
        numbers[K_ETA + k] = state[ETA + k]
        numbers[K_KAPPA + k] = state[KAPPA + k]
        numbers[K_HALF + k] = state[HALF_EXPONENT + k]
        numbers[K_BETA + k] = state[BETA + k]
        numbers[K_MOVED + k] = state[CLOSURE_STEP + k]
        numbers[K_NOMINAL + k] = state[SPEED + k]
        numbers[K_WIDE + k] = state[BEYOND_SERIES + k]
        numbers[K_CODE + k] = state[CODE + k]
        kept.targets[number, k] = places[k]
    deviations, remainders = kept.deviations[number], kept.remainders[number]
    for i in range(deviations.size):
        deviations[i] = block.deviations[i]
    for i in range(remainders.size):
        remainders[i] = block.remainders[i]


@inlined
def fill_points(
    ratio: float, shift: float, blend: Blend, grid: Grid, table: Floats, fine: Floats, margin: int,
    angles: Angles, points: Floats, speeds: Floats,
) -> None:  # fmt: skip
    """Fill `points` (angle, POINT_FIELDS) for one crank ratio, offset `shift` and diagram.

    `fine` is the fine level, whose first node has `margin` rows before it. `speeds` is scratch: a
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


@inlined
def fill_smooth(
    inertia: Inertia, step: float, ratio: int, lanes: int, levels: Levels, kept: Floats,
    deviations: Floats, remainders: Floats, ws: Floats, ds: Floats,
) -> None:  # fmt: skip
    """Fill in w and its slope, times a coarse interval, at the coarse nodes and beside both ends.

    They are those of `extrema.load_of`.
    """
    wide_vectors()
    fine, coarse = levels.fine, levels.coarse
    nodes = coarse.shape[0]
    iterated = remainders.size > 0
    # Here, so that the compiler knows that nothing overlaps them.
    numbers = on_stack(NUMBER_ROWS)
    for i in range(NUMBER_ROWS):
        numbers[i] = kept[i]
    for n in range(nodes):
        p, v = coarse[n, P], coarse[n, V]
        ip, iv = fine[ratio * (n + 1), F_IP], fine[ratio * (n + 1), F_IV]
        p_moment, v_moment = coarse[n, P_MOMENT], coarse[n, V_MOMENT]
        # Slices, so that the compiler sees that no index counts from the end.
        row, behind = (n + PAD) * LANES, (n + PAD + 1) * LANES
        u_here, r_here = deviations[row:behind], remainders[row:behind]
        w_here, d_here = ws[row:behind], ds[row:behind]
        for k in range(lanes):
            g, eta, beta = numbers[K_GAS + k], numbers[K_ETA + k], numbers[K_BETA + k]
            tau = 1.0 + eta * v if len(inertia) == VARIABLE_INERTIA else 1.0
            x = g * p - eta * v
            # u tau: what moves u for the closure and the first moments is divided by tau there.
            bent = beta * beta * (g * p_moment - eta * v_moment)
            e = u_here[k] * tau + numbers[K_MOVED + k] - bent
            r = r_here[k] if iterated else 0.0
            w_here[k] = x - e - beta * (g * ip - eta * iv)
            d_here[k] = step * (numbers[K_KAPPA + k] * (r + numbers[K_HALF + k] * e) - beta * x)
    for i in range(PAD * LANES):
        ws[i] = ws[nodes * LANES + i]
        ds[i] = ds[nodes * LANES + i]
        ws[(nodes + PAD) * LANES + i] = ws[PAD * LANES + i]
        ds[(nodes + PAD) * LANES + i] = ds[PAD * LANES + i]


@inlined
def take_polynomial(interval: int, lanes: int, ws: Floats, ds: Floats, c: Floats) -> None:
    """Coefficients of w in a coarse interval, docs/method.md (119): one row of lanes each."""
    # Slices, so that the compiler sees that no index counts from the end.
    first, last = (interval + PAD - 1) * LANES, (interval + PAD + 3) * LANES
    w, d = ws[first:last], ds[first:last]
    for k in range(lanes):
        w_before, left, right, w_behind = (
            w[k], w[LANES + k], w[2 * LANES + k], w[3 * LANES + k]
        )  # fmt: skip
        d_before, d_left, d_right, d_behind = (
            d[k], d[LANES + k], d[2 * LANES + k], d[3 * LANES + k]
        )  # fmt: skip
        # Second derivatives of fourth order, from three nodes each.
        s_left = 2.0 * (w_before - 2.0 * left + right) - 0.5 * (d_right - d_before)
        s_right = 2.0 * (left - 2.0 * right + w_behind) - 0.5 * (d_behind - d_left)
        rise = right - left - d_left - 0.5 * s_left
        turn = d_right - d_left - s_left
        bend = s_right - s_left
        c[k] = left
        c[LANES + k] = d_left
        c[2 * LANES + k] = 0.5 * s_left
        c[3 * LANES + k] = 10.0 * rise - 4.0 * turn + 0.5 * bend
        c[4 * LANES + k] = -15.0 * rise + 7.0 * turn - bend
        c[5 * LANES + k] = 6.0 * rise - 3.0 * turn + 0.5 * bend


@formula
def deviation(
    inertia: Inertia, t: float, p: float, v: float, ip: float, iv: float, k: int, numbers: Floats,
    c: Floats,
) -> float:  # fmt: skip
    """Return u at an angle of a lane, which has the share `t` of a coarse interval before it."""
    g, eta, beta = numbers[K_GAS + k], numbers[K_ETA + k], numbers[K_BETA + k]
    c1, c2, c3 = c[LANES + k], c[2 * LANES + k], c[3 * LANES + k]
    c4, c5 = c[4 * LANES + k], c[5 * LANES + k]
    w = c[k] + t * (c1 + t * (c2 + t * (c3 + t * (c4 + t * c5))))
    u = g * (p - beta * ip) - eta * (v - beta * iv) - w
    return u / (1.0 + eta * v) if len(inertia) == VARIABLE_INERTIA else u


@inlined
def write_curve(
    count: int, rates: bool, inertia: Inertia, turns: float, lanes: int, angles: Angles,
    points: Floats, kept: Floats, targets: Integers, ws: Floats, ds: Floats, result: Floats,
) -> None:  # fmt: skip
    """Write the speed [rad/s], or its rate [rad/s2], of the first `count` designs of a block.

    `kept` are the block's numbers, `turns` is the number of coarse intervals in a radian.
    """
    wide_vectors()
    # Made here, so that the compiler knows that they do not overlap.
    tile, turned = on_stack(TILE_ROWS), on_stack(TILE_ROWS)
    numbers, c = on_stack(NUMBER_ROWS), on_stack(SIX_ROWS)
    for i in range(NUMBER_ROWS):
        numbers[i] = kept[i]
    # Slices, so that the compiler sees that no index counts from the end.
    nominal, beyond = (
        numbers[K_NOMINAL : K_NOMINAL + LANES], numbers[K_WIDE : K_WIDE + LANES]
    )  # fmt: skip
    wide = 0.0
    for k in range(lanes):
        wide += beyond[k]
    for part in range(angles.first_run.size - 1):
        begin = part * TILE
        interval = -1
        for i in range(min(TILE, angles.node.size - begin)):
            j = begin + i
            if angles.interval[j] != interval:
                interval = angles.interval[j]
                take_polynomial(interval, lanes, ws, ds, c)
            t = angles.share[j]
            p, v, ip, iv = points[j, A_P], points[j, A_V], points[j, A_IP], points[j, A_IV]
            dp, dv = points[j, A_DP], points[j, A_DV]
            here = tile[i * LANES : (i + 1) * LANES]
            if rates:
                for k in range(lanes):
                    g, eta, beta = numbers[K_GAS + k], numbers[K_ETA + k], numbers[K_BETA + k]
                    c1, c2, c3 = c[LANES + k], c[2 * LANES + k], c[3 * LANES + k]
                    c4, c5 = c[4 * LANES + k], c[5 * LANES + k]
                    dw = c1 + t * (2.0 * c2 + t * (3.0 * c3 + t * (4.0 * c4 + t * (5.0 * c5))))
                    slope = g * (dp - beta * p) - eta * (dv - beta * v) - turns * dw
                    if len(inertia) == VARIABLE_INERTIA:
                        u = deviation(inertia, t, p, v, ip, iv, k, numbers, c)
                        inverse = 1.0 / (1.0 + eta * v)
                        slope = (slope - u * eta * dv) * inverse
                    here[k] = 0.5 * nominal[k] * nominal[k] * slope
            elif wide > 0.0:
                for k in range(lanes):
                    u = deviation(inertia, t, p, v, ip, iv, k, numbers, c)
                    root = math.sqrt(max(1.0 + u, 0.0))
                    series = 1.0 + 0.5 * u + root_remainder(u)
                    here[k] = nominal[k] * (root if beyond[k] != 0.0 else series)
            else:
                for k in range(lanes):
                    u = deviation(inertia, t, p, v, ip, iv, k, numbers, c)
                    here[k] = nominal[k] * (1.0 + 0.5 * u + root_remainder(u))
        for k in range(0, LANES, SQUARE_SIDE):
            for i in range(0, TILE, SQUARE_SIDE):
                turn_square(tile, i * LANES + k, LANES, turned, k * TILE + i, TILE)
        for k in range(LANES):
            if numbers[K_CODE + k] != CONVERGED:
                for i in range(TILE):
                    turned[k * TILE + i] = math.nan
        for k in range(count):
            if numbers[K_CODE + k] == DEFERRED:
                continue
            for run in range(angles.first_run[part], angles.first_run[part + 1]):
                source, target, length = angles.source[run], angles.target[run], angles.length[run]
                curve = result[targets[k], target : target + length]
                lane = turned[k * TILE + source : k * TILE + source + length]
                for i in range(length):
                    curve[i] = lane[i]


@inlined
def write_block(
    count: int, block: int, inertia: Inertia, step: float, ratio: int, lanes: int,
    levels: Levels, angles: Angles, points: Floats, kept: Kept, ws: Floats, ds: Floats,
    omega: Floats, acceleration: Floats,
) -> None:  # fmt: skip
    """Write the curves of the first `count` designs of a block; NaN where they have none.

    Designs that are deferred to the general solver are not written. `ws` and `ds` are scratch.
    """
    numbers, targets = kept.numbers[block], kept.targets[block]
    fill_smooth(
        inertia,
        step,
        ratio,
        lanes,
        levels,
        numbers,
        kept.deviations[block],
        kept.remainders[block],
        ws,
        ds,
    )
    for rates in (False, True):
        result = acceleration if rates else omega
        if result.shape[1] > 0:
            write_curve(
                count, rates, inertia, 1.0 / step, lanes, angles, points, numbers, targets,
                ws, ds, result,
            )  # fmt: skip
