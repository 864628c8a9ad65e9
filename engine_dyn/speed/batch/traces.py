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
    formula,
    inlined,
    on_stack,
    wide_vectors,
)
from engine_dyn.speed.batch.angles import (
    A_DP,
    A_DV,
    A_IP,
    A_IV,
    A_P,
    A_V,
    POINT_FIELDS,
    TILE,
    Angles,
)
from engine_dyn.speed.batch.forms import VARIABLE_INERTIA, Inertia
from engine_dyn.speed.batch.powers import root_remainder
from engine_dyn.speed.batch.state import (
    BETA,
    BEYOND_SERIES,
    CLOSURE_STEP,
    CODE,
    DEFERRED,
    ETA,
    GAS_FACTOR,
    KAPPA,
    KEPT_SIZE,
    LANES,
    LAW_SLOPE,
    PAD,
    SPEED,
    Block,
)
from engine_dyn.speed.batch.two_grid import F_IP, F_IV, P_MOMENT, V_MOMENT, P, TwoGrid, V
from engine_dyn.status import CONVERGED
from engine_dyn.types import Floats, Integers

__all__ = [
    "KEPT_DESIGNS",
    "KEPT_TABLES",
    "Kept",
    "SIX_ROWS",
    "TILE_ROWS",
    "blocks_of",
    "deviation",
    "fill_smooth",
    "keep",
    "make_kept",
    "make_working",
    "take_polynomial",
    "write_block",
    "write_curve",
]

KEPT_DESIGNS, KEPT_TABLES = 1024, 64
"""Designs and tables that are solved before their curves are written: what is kept of them should
stay in the cache, and each call costs as much as some designs."""

TILE_ROWS, SIX_ROWS = TILE * LANES, 6 * LANES


class Kept(NamedTuple):
    """What curves need of solved blocks: (block, lanes of rows). No blocks: nothing is kept.

    `states` are first rows of the state, `deviations` and `remainders` those of a `Block`, empty
    where nothing is iterated, because r is zero; `targets` the places of the results.
    """

    states: Floats
    deviations: Floats
    remainders: Floats
    targets: Integers


def make_kept(blocks: int, nodes: int, iterated: bool) -> Kept:
    """Memory for blocks of tables with `nodes` coarse nodes; only `iterated` ones have r."""
    rows = (nodes + 2 * PAD) * LANES
    return Kept(
        states=np.empty((blocks, KEPT_SIZE)),
        deviations=np.empty((blocks, rows)),
        remainders=np.empty((blocks, rows if iterated else 0)),
        targets=np.zeros((blocks, LANES), dtype=np.int64),
    )


def make_working(angles: Angles, kept: Kept) -> tuple[Floats, Floats, Floats]:
    """Working memory of `driver.write_traces`: its points, smooth and rises."""
    rows = kept.deviations.shape[1]
    return np.empty((angles.node.size, POINT_FIELDS)), np.empty(rows), np.empty(rows)


def blocks_of(size: int, designs: int) -> tuple[int, int]:
    """Designs to keep at a time, of `size` with `designs` to a table, and their most blocks."""
    most = min(KEPT_DESIGNS, KEPT_TABLES * designs)
    # Equal shares: each has to build its tables, and smaller ones stay in a nearer cache.
    count = -(-size // -(-size // most))
    return count, count // LANES + count // designs + 3


@inlined
def keep(number: int, block: Block, places: Integers, kept: Kept) -> None:
    """Keep what `write_block` needs of a solved block."""
    state, deviations = kept.states[number], kept.deviations[number]
    remainders, targets = kept.remainders[number], kept.targets[number]
    for i in range(state.size):
        state[i] = block.state[i]
    for i in range(deviations.size):
        deviations[i] = block.deviations[i]
    for i in range(remainders.size):
        remainders[i] = block.remainders[i]
    for k in range(LANES):
        targets[k] = places[k]


@inlined
def fill_smooth(
    inertia: Inertia, step: float, ratio: int, lanes: int, two_grid: TwoGrid, kept: Floats,
    deviations: Floats, remainders: Floats, smooth: Floats, rises: Floats,
) -> None:  # fmt: skip
    """Fill in w and its slope, times a coarse interval, at the coarse nodes and beside both ends.

    They are those of `intervals.load_of`.
    """
    wide_vectors()
    fine, coarse = two_grid.fine, two_grid.coarse
    nodes = coarse.shape[0]
    iterated = remainders.size > 0
    # Here, so that the compiler knows that nothing overlaps them.
    state = on_stack(KEPT_SIZE)
    for i in range(KEPT_SIZE):
        state[i] = kept[i]
    for n in range(nodes):
        p, v = coarse[n, P], coarse[n, V]
        ip, iv = fine[ratio * (n + 1), F_IP], fine[ratio * (n + 1), F_IV]
        p_moment, v_moment = coarse[n, P_MOMENT], coarse[n, V_MOMENT]
        # Slices, so that the compiler sees that no index counts from the end.
        row, behind = (n + PAD) * LANES, (n + PAD + 1) * LANES
        u_here, r_here = deviations[row:behind], remainders[row:behind]
        w_here, d_here = smooth[row:behind], rises[row:behind]
        for k in range(lanes):
            g, eta, beta = state[GAS_FACTOR + k], state[ETA + k], state[BETA + k]
            tau = 1.0 + eta * v if len(inertia) == VARIABLE_INERTIA else 1.0
            x = g * p - eta * v
            # u tau: what moves u for the closure and the first moments is divided by tau there.
            bent = beta * beta * (g * p_moment - eta * v_moment)
            e = u_here[k] * tau + state[CLOSURE_STEP + k] - bent
            r = r_here[k] if iterated else 0.0
            w_here[k] = x - e - beta * (g * ip - eta * iv)
            d_here[k] = step * (state[KAPPA + k] * (r + state[LAW_SLOPE + k] * e) - beta * x)
    for i in range(PAD * LANES):
        smooth[i] = smooth[nodes * LANES + i]
        rises[i] = rises[nodes * LANES + i]
        smooth[(nodes + PAD) * LANES + i] = smooth[PAD * LANES + i]
        rises[(nodes + PAD) * LANES + i] = rises[PAD * LANES + i]


@inlined
def take_polynomial(interval: int, lanes: int, smooth: Floats, rises: Floats, c: Floats) -> None:
    """Coefficients of w in a coarse interval, docs/method.md (119): one row of lanes each."""
    # Slices, so that the compiler sees that no index counts from the end.
    first, last = (interval + PAD - 1) * LANES, (interval + PAD + 3) * LANES
    w, d = smooth[first:last], rises[first:last]
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
    inertia: Inertia, t: float, p: float, v: float, ip: float, iv: float, k: int, state: Floats,
    c: Floats,
) -> float:  # fmt: skip
    """Return u at an angle of a lane, which has the share `t` of a coarse interval before it."""
    g, eta, beta = state[GAS_FACTOR + k], state[ETA + k], state[BETA + k]
    c1, c2, c3 = c[LANES + k], c[2 * LANES + k], c[3 * LANES + k]
    c4, c5 = c[4 * LANES + k], c[5 * LANES + k]
    w = c[k] + t * (c1 + t * (c2 + t * (c3 + t * (c4 + t * c5))))
    u = g * (p - beta * ip) - eta * (v - beta * iv) - w
    return u / (1.0 + eta * v) if len(inertia) == VARIABLE_INERTIA else u


@inlined
def write_curve(
    count: int, rates: bool, inertia: Inertia, turns: float, lanes: int, angles: Angles,
    points: Floats, kept: Floats, targets: Integers, smooth: Floats, rises: Floats, result: Floats,
) -> None:  # fmt: skip
    """Write the speed [rad/s], or its rate [rad/s2], of the first `count` designs of a block.

    `kept` are the block's rows, `turns` is the number of coarse intervals in a radian.
    """
    wide_vectors()
    # Made here, so that the compiler knows that they do not overlap.
    tile, turned = on_stack(TILE_ROWS), on_stack(TILE_ROWS)
    state, c = on_stack(KEPT_SIZE), on_stack(SIX_ROWS)
    for i in range(KEPT_SIZE):
        state[i] = kept[i]
    # Slices, so that the compiler sees that no index counts from the end.
    nominal, beyond = (
        state[SPEED : SPEED + LANES], state[BEYOND_SERIES : BEYOND_SERIES + LANES]
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
                take_polynomial(interval, lanes, smooth, rises, c)
            t = angles.share[j]
            p, v, ip, iv = points[j, A_P], points[j, A_V], points[j, A_IP], points[j, A_IV]
            dp, dv = points[j, A_DP], points[j, A_DV]
            here = tile[i * LANES : (i + 1) * LANES]
            if rates:
                for k in range(lanes):
                    g, eta, beta = state[GAS_FACTOR + k], state[ETA + k], state[BETA + k]
                    c1, c2, c3 = c[LANES + k], c[2 * LANES + k], c[3 * LANES + k]
                    c4, c5 = c[4 * LANES + k], c[5 * LANES + k]
                    dw = c1 + t * (2.0 * c2 + t * (3.0 * c3 + t * (4.0 * c4 + t * (5.0 * c5))))
                    slope = g * (dp - beta * p) - eta * (dv - beta * v) - turns * dw
                    if len(inertia) == VARIABLE_INERTIA:
                        u = deviation(inertia, t, p, v, ip, iv, k, state, c)
                        inverse = 1.0 / (1.0 + eta * v)
                        slope = (slope - u * eta * dv) * inverse
                    here[k] = 0.5 * nominal[k] * nominal[k] * slope
            elif wide > 0.0:
                for k in range(lanes):
                    u = deviation(inertia, t, p, v, ip, iv, k, state, c)
                    root = math.sqrt(max(1.0 + u, 0.0))
                    series = 1.0 + 0.5 * u + root_remainder(u)
                    here[k] = nominal[k] * (root if beyond[k] != 0.0 else series)
            else:
                for k in range(lanes):
                    u = deviation(inertia, t, p, v, ip, iv, k, state, c)
                    here[k] = nominal[k] * (1.0 + 0.5 * u + root_remainder(u))
        for k in range(LANES):
            known = state[CODE + k] == CONVERGED
            for i in range(TILE):
                turned[k * TILE + i] = tile[i * LANES + k] if known else math.nan
        for k in range(count):
            if state[CODE + k] == DEFERRED:
                continue
            for run in range(angles.first_run[part], angles.first_run[part + 1]):
                source, target, length = angles.source[run], angles.target[run], angles.length[run]
                curve = result[targets[k], target : target + length]
                lane = turned[k * TILE + source : k * TILE + source + length]
                for i in range(length):
                    curve[i] = lane[i]


@inlined
def write_block(
    count: int, number: int, inertia: Inertia, step: float, ratio: int, lanes: int,
    two_grid: TwoGrid, angles: Angles, points: Floats, kept: Kept, smooth: Floats, rises: Floats,
    omega: Floats, acceleration: Floats,
) -> None:  # fmt: skip
    """Write the curves of the first `count` designs of a block; NaN where they have none.

    Those that are deferred to the general solver are not written. `smooth` and `rises` are scratch.
    """
    state, targets = kept.states[number], kept.targets[number]
    fill_smooth(
        inertia,
        step,
        ratio,
        lanes,
        two_grid,
        state,
        kept.deviations[number],
        kept.remainders[number],
        smooth,
        rises,
    )
    for rates in (False, True):
        result = acceleration if rates else omega
        if result.shape[1] > 0:
            write_curve(
                count, rates, inertia, 1.0 / step, lanes, angles, points, state, targets,
                smooth, rises, result,
            )  # fmt: skip
