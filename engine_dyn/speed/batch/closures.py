"""What the closures of a block need: the constant, mean speeds, cycle times."""

from __future__ import annotations

import math

from engine_dyn.compilation import formula, inlined, wide_vectors
from engine_dyn.speed.batch.forms import SQUARE_ROOT, VARIABLE_INERTIA, Form, Inertia
from engine_dyn.speed.batch.powers import SERIES_RANGE, inverses, log_of, root_remainder
from engine_dyn.speed.batch.state import (
    BEYOND_SERIES,
    CLOSURE_STEP,
    CODE,
    CYCLE_TIME,
    ENERGY_SCALE,
    ETA,
    GAS_FACTOR,
    LANES,
    MEAN_SPEED,
    NODE_MAX,
    NODE_MIN,
    PAD,
    SCALE_MOVES,
    SPEED_ALIAS,
    Block,
)
from engine_dyn.speed.batch.two_grid import (
    ALIAS_P,
    ALIAS_PP,
    ALIAS_PPP,
    ALIAS_PPPP,
    ALIAS_PPPV,
    ALIAS_PPV,
    ALIAS_PPVV,
    ALIAS_PV,
    ALIAS_PVV,
    ALIAS_PVVV,
    ALIAS_V,
    ALIAS_VV,
    ALIAS_VVV,
    ALIAS_VVVV,
    CHUNK,
    CUBES,
    FOURTHS,
    PP,
    PV,
    VV,
    TwoGrid,
    V,
)
from engine_dyn.speed.batch.values import constant, shared_value, value_at
from engine_dyn.types import Floats

__all__ = [
    "MOST_SCALES",
    "SCALE_STEP",
    "alias_of_mean",
    "constant_without_load",
    "fill_cycle_time",
    "fill_exact_mean",
    "fill_mean_speed",
    "mark_beyond_series",
    "next_energy_scale",
    "terms_of_power",
]

MOST_SCALES, SCALE_STEP = 8, 1e-9
"""Solutions of the power mean at most on the way to a cycle time, and the step of the energy scale
at which it is found."""


@formula
def terms_of_power(b: float) -> tuple[float, float, float]:
    """Coefficients of u^2, u^3 and u^4 in (q^b - 1)/b, and those of log q for b = 0."""
    second = 0.5 * (b - 1.0)
    third = second * (b - 2.0) / 3.0
    return second, third, third * (b - 3.0) * 0.25


@formula
def alias_of_mean(
    b2: float, b3: float, b4: float, variable: bool, first: bool, g: float, eta: float, c: Floats
) -> float:
    """Mean of u + b2 u^2 + b3 u^3 + b4 u^4 over the fine less that over the coarse nodes.

    docs/method.md (114), without the load, to fourth order; `first` says whether the first order
    counts. `c` are the table's constants.
    """
    # Coefficients of eta V, of its powers, and of products; u is (g P - eta V)/(1 + eta V) with
    # variable inertia, else g P - eta V.
    n1, n2, n3, n4 = -1.0, 1.0 + b2, -1.0 - 2.0 * b2 - b3, 1.0 + 3.0 * (b2 + b3) + b4
    m11, m21, m12 = -1.0 - 2.0 * b2, -2.0 * b2 - 3.0 * b3, 1.0 + 4.0 * b2 + 3.0 * b3
    m31, m22 = -3.0 * b3 - 4.0 * b4, 3.0 * b2 + 9.0 * b3 + 6.0 * b4
    m13 = -1.0 - 6.0 * b2 - 9.0 * b3 - 4.0 * b4
    if not variable:
        n1, n2, n3, n4 = 1.0, b2, b3, b4
        m11, m21, m12 = 2.0 * b2, 3.0 * b3, 3.0 * b3
        m31, m22, m13 = 4.0 * b4, 6.0 * b4, 4.0 * b4
    e = eta if variable else -eta
    g2, e2 = g * g, e * e
    total = g2 * (b2 * c[ALIAS_PP] + g * (b3 * c[ALIAS_PPP] + g * b4 * c[ALIAS_PPPP]))
    total += e2 * (n2 * c[ALIAS_VV] + e * (n3 * c[ALIAS_VVV] + e * n4 * c[ALIAS_VVVV]))
    total += g * e * (
        m11 * c[ALIAS_PV] + g * (m21 * c[ALIAS_PPV] + g * m31 * c[ALIAS_PPPV])
        + e * (m12 * c[ALIAS_PVV] + e * m13 * c[ALIAS_PVVV]) + g * e * m22 * c[ALIAS_PPVV]
    )  # fmt: skip
    return total + (g * c[ALIAS_P] + n1 * e * c[ALIAS_V] if first else 0.0)


@formula
def constant_without_load(variable: bool, g: float, eta: float, c: Floats, k: int) -> float:
    """Constant of the closure for exponent 0: the mean of log q vanishes.

    docs/method.md (116): one scalar equation in the moments of the table up to the fourth; what the
    higher ones add is left to the mean over the nodes.
    """
    e = 0.0 if variable else -eta
    g2, e2 = g * g, e * e
    m2 = g2 * constant(c, PP, k) + 2.0 * g * e * constant(c, PV, k) + e2 * constant(c, VV, k)
    m3 = g2 * (g * constant(c, CUBES, k) + 3.0 * e * constant(c, CUBES + 1, k))
    m3 += e2 * (3.0 * g * constant(c, CUBES + 2, k) + e * constant(c, CUBES + 3, k))
    m4 = g2 * g * (g * constant(c, FOURTHS, k) + 4.0 * e * constant(c, FOURTHS + 1, k))
    m4 += e2 * e * (4.0 * g * constant(c, FOURTHS + 3, k) + e * constant(c, FOURTHS + 4, k))
    m4 += 6.0 * g2 * e2 * constant(c, FOURTHS + 2, k)
    # Mean of log tau, which the energy has to match.
    turn = eta if variable else 0.0
    wanted = turn * turn * (
        -0.5 * constant(c, VV, k)
        + turn * (constant(c, CUBES + 3, k) / 3.0 - 0.25 * turn * constant(c, FOURTHS + 4, k))
    )  # fmt: skip
    level = 0.5 * m2 + wanted
    for _ in range(3):
        # log(1 + level) + the mean of log(1 + X/(1 + level))
        inverse = 1.0 / (1.0 + level)
        s2 = m2 * inverse * inverse
        s3 = m3 * inverse * inverse * inverse
        s4 = m4 * inverse * inverse * inverse * inverse
        value = log_of(level) - 0.5 * s2 + s3 / 3.0 - 0.25 * s4 - wanted
        level -= value * (1.0 + level) / (1.0 + s2 - s3 + s4)
    return level


@inlined
def mark_beyond_series(lanes: int, state: Floats) -> bool:
    """Mark the lanes whose u is beyond the range of the series; return whether there are any."""
    wide_vectors()
    count = 0.0
    for k in range(lanes):
        wide = max(state[NODE_MAX + k], -state[NODE_MIN + k]) > SERIES_RANGE
        state[BEYOND_SERIES + k] = 1.0 if wide else 0.0
        count += state[BEYOND_SERIES + k]
    return count > 0.0


@inlined
def fill_exact_mean(inertia: Inertia, lanes: int, coarse: Floats, block: Block) -> None:
    """MEAN_SPEED of the lanes beyond the series: sum of sqrt(q) - 1 over the nodes by roots."""
    wide_vectors()
    state, deviations = block.state, block.deviations
    for k in range(lanes):
        state[MEAN_SPEED + k] = 0.0 if state[BEYOND_SERIES + k] != 0.0 else state[MEAN_SPEED + k]
    for n in range(coarse.shape[0]):
        vw = shared_value(coarse, n, V)
        row = (n + PAD) * LANES
        for k in range(lanes):
            turn = state[ETA + k] if len(inertia) == VARIABLE_INERTIA else 0.0
            q = (
                1.0
                + deviations[row + k]
                + state[CLOSURE_STEP + k] / (1.0 + turn * value_at(coarse, vw, n, V, k))
            )
            state[MEAN_SPEED + k] += math.sqrt(q) - 1.0 if state[BEYOND_SERIES + k] != 0.0 else 0.0


@inlined
def fill_mean_speed(
    form: Form, inertia: Inertia, lanes: int, two_grid: TwoGrid, block: Block
) -> None:  # fmt: skip
    """Mean of sqrt(q) after an iteration; exponent 1 has it from its closure."""
    wide_vectors()
    state, deviations = block.state, block.deviations
    coarse, constants = two_grid.coarse, two_grid.constants
    nodes = coarse.shape[0]
    for k in range(lanes):
        state[MEAN_SPEED + k] = 1.0 if len(form) == SQUARE_ROOT else 0.0
    if len(form) == SQUARE_ROOT:
        return
    for group in range(nodes // CHUNK):
        row = (CHUNK * group + PAD) * LANES
        for k in range(lanes):
            moved = 0.0 if len(inertia) == VARIABLE_INERTIA else state[CLOSURE_STEP + k]
            u0, u1 = deviations[row + k] + moved, deviations[row + LANES + k] + moved
            u2, u3 = (
                deviations[row + 2 * LANES + k] + moved,
                deviations[row + 3 * LANES + k] + moved,
            )
            state[MEAN_SPEED + k] += (root_remainder(u0) + root_remainder(u1)) + (
                root_remainder(u2) + root_remainder(u3)
            )
            state[MEAN_SPEED + k] += 0.5 * ((u0 + u1) + (u2 + u3))
    if len(inertia) == VARIABLE_INERTIA:
        # The closure's step is as small as its tolerance: the mean of 1/tau will do for its slope.
        for k in range(lanes):
            turns = 1.0 + state[ETA + k] * state[ETA + k] * constant(constants, VV, k)
            state[MEAN_SPEED + k] += 0.5 * nodes * state[CLOSURE_STEP + k] * turns
    if mark_beyond_series(lanes, state):
        fill_exact_mean(inertia, lanes, coarse, block)
    for k in range(lanes):
        state[MEAN_SPEED + k] = 1.0 + state[MEAN_SPEED + k] / nodes + state[SPEED_ALIAS + k]


@inlined
def fill_cycle_time(
    inertia: Inertia, lanes: int, coarse: Floats, constants: Floats, block: Block
) -> None:  # fmt: skip
    """CYCLE_TIME becomes the mean of 1/sqrt(q): the cycle's time over that at nominal speed."""
    wide_vectors()
    state, deviations = block.state, block.deviations
    nodes = coarse.shape[0]
    for k in range(lanes):
        state[CYCLE_TIME + k] = 0.0
    for group in range(nodes // CHUNK):
        n = CHUNK * group
        row = (n + PAD) * LANES
        vw0, vw1 = shared_value(coarse, n, V), shared_value(coarse, n + 1, V)
        vw2, vw3 = shared_value(coarse, n + 2, V), shared_value(coarse, n + 3, V)
        for k in range(lanes):
            m0 = m1 = m2 = m3 = state[CLOSURE_STEP + k]
            if len(inertia) == VARIABLE_INERTIA:
                turn = state[ETA + k]
                t0, t1, t2, t3 = inverses(
                    1.0 + turn * value_at(coarse, vw0, n, V, k),
                    1.0 + turn * value_at(coarse, vw1, n + 1, V, k),
                    1.0 + turn * value_at(coarse, vw2, n + 2, V, k),
                    1.0 + turn * value_at(coarse, vw3, n + 3, V, k),
                )  # fmt: skip
                m0, m1, m2, m3 = m0 * t0, m1 * t1, m2 * t2, m3 * t3
            u0, u1 = deviations[row + k] + m0, deviations[row + LANES + k] + m1
            u2, u3 = deviations[row + 2 * LANES + k] + m2, deviations[row + 3 * LANES + k] + m3
            i0, i1, i2, i3 = inverses(
                1.0 + 0.5 * u0 + root_remainder(u0), 1.0 + 0.5 * u1 + root_remainder(u1),
                1.0 + 0.5 * u2 + root_remainder(u2), 1.0 + 0.5 * u3 + root_remainder(u3),
            )  # fmt: skip
            state[CYCLE_TIME + k] += (i0 + i1) + (i2 + i3)
    if mark_beyond_series(lanes, state):
        for k in range(lanes):
            state[CYCLE_TIME + k] = (
                0.0 if state[BEYOND_SERIES + k] != 0.0 else state[CYCLE_TIME + k]
            )
        for n in range(nodes):
            vw = shared_value(coarse, n, V)
            row = (n + PAD) * LANES
            for k in range(lanes):
                turn = state[ETA + k] if len(inertia) == VARIABLE_INERTIA else 0.0
                q = (
                    1.0
                    + deviations[row + k]
                    + state[CLOSURE_STEP + k] / (1.0 + turn * value_at(coarse, vw, n, V, k))
                )
                state[CYCLE_TIME + k] += (
                    1.0 / math.sqrt(q) if state[BEYOND_SERIES + k] != 0.0 else 0.0
                )
    for k in range(lanes):
        g, eta = state[GAS_FACTOR + k], state[ETA + k]
        if constants.ndim == 2:
            seen = g * constants[ALIAS_P, k] - eta * constants[ALIAS_V, k]
        else:
            b2, b3, b4 = terms_of_power(-0.5)
            seen = alias_of_mean(
                b2, b3, b4, len(inertia) == VARIABLE_INERTIA, True, g, eta, constants
            )
        state[CYCLE_TIME + k] = state[CYCLE_TIME + k] / nodes - 0.5 * seen


@inlined
def next_energy_scale(inertia: Inertia, lanes: int, two_grid: TwoGrid, block: Block) -> bool:
    """Next energy scale on the way to the nominal cycle time; whether that of any lane moves.

    docs/method.md (77): with q = rho times a solution of the power mean for energies over rho, the
    time of the cycle is that solution's over sqrt(rho). Its excess over 1 falls about as 1/rho^2,
    so that three solutions are usual. A lane whose scale is found keeps it, and its numbers too.
    """
    wide_vectors()
    state = block.state
    fill_cycle_time(inertia, lanes, two_grid.coarse, two_grid.constants, block)
    moving = 0.0
    for k in range(lanes):
        scale = state[ENERGY_SCALE + k]
        excess = (state[CYCLE_TIME + k] - 1.0) * scale * scale
        x = scale
        for _ in range(4):
            root, inverse = math.sqrt(x), 1.0 / x
            value = root - 1.0 - excess * inverse * inverse
            x -= value / (0.5 / root + 2.0 * excess * inverse * inverse * inverse)
            x = min(4.0, max(0.25, x))
        step = abs(x - scale)
        # Not `step > ...`: what is no number does not move.
        moves = step > SCALE_STEP and state[CODE + k] == 0.0
        state[ENERGY_SCALE + k] = x if moves else scale
        state[SCALE_MOVES + k] = 1.0 if moves else 0.0
        moving += state[SCALE_MOVES + k]
    return moving > 0.0
