"""Periodic speed of a block of designs that share one table, designs side by side as SIMD lanes.

The reduced problem (symbols of `newton`): with g = 2 A r/(Theta omega_n^2), eta = m r^2/Theta and
kappa = 2 (M_mean - a)/(Theta omega_n^2), each per lane, and the tables P and V of `tables`,

    constant inertia:   q = 1 + c + g P - eta V - z,
    variable inertia:   q = (1 + c + g P - z)/(1 + eta V),
    z' = kappa (F/mu - 1),   F = q^(alpha/2),   mu = mean F,   mean z = 0,

q = (omega/omega_n)^2. The right side has no mean, so every iterate is periodic by itself, and c
follows from the closure (power mean: mu = 1; cycle time: mean q^(-1/2) = 1). z is small, smooth and
linear to leading order: with beta = kappa dF/dq of the mean, z' + beta z is solved by one sweep of
a scalar recurrence (two-point Obreshkov formula, fourth order, A-stable) and the rest converges by
a factor of about beta |1 - F'/mean F'| a sweep. Exponent 2 with constant inertia needs no
iteration, and exponent 0 has z = 0: these are the closed solutions.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from engine_dyn.compilation import inlined
from engine_dyn.speed.newton import CYCLE_TIME, FLOOR
from engine_dyn.speed.tables import GAS_TORQUE, GAS_WORK, SQUARE, SQUARE_SLOPE

__all__ = ["LANES", "LANE_ROWS", "MOST_SWEEPS", "iterate", "solve_linear"]

Floats = npt.NDArray[np.float64]

LANES = 32
"""Designs side by side, at most: enough to hide the recurrence's latency and to pay for what each
loop over lanes costs to enter. Fewer where a table has fewer designs."""

MOST_SWEEPS = 24
"""What has not converged by then is left to Newton's method."""

# One number for each lane, in rows of one flat array: row offsets that the compiler knows let it
# see that rows do not overlap, without which it would not use SIMD.
LANE_ROWS = 40
(
    GAS, ETA, KAPPA, HALF, NOMINAL, TOP, LOW, TOP_NODE, LOW_NODE, TOTAL, MU, C, SLOPE, FIRST,
    SECOND, SHIFT, DRIFT, DECAY, LEFT, RIGHT, CROSS, BETA, START, MEAN, CHANGE, LEAST, MOST,
    PRODUCT, Y, BEFORE, BEFORE_SLOPE, HEAD, HEAD_SLOPE, LOSS, SUM, RUNNING, NOW, NOW_SLOPE,
    INVERSE, TABLE,
) = (row * LANES for row in range(40))  # fmt: skip
"""TABLE is a row for numbers of the table that all lanes share."""


@inlined
def recurrence(k: int, rate: float, width: float, lane: Floats) -> None:
    """Weights of the two-point formula for y' + rate y = R over one interval, of lane k."""
    x = rate * width
    below = 1.0 + 0.5 * x + x * x / 12.0
    lane[LOSS + k] = x / below
    lane[DECAY + k] = 1.0 - x / below
    lane[LEFT + k] = (0.5 * width - width * x / 12.0) / below
    lane[RIGHT + k] = (0.5 * width + width * x / 12.0) / below
    lane[CROSS + k] = width * width / 12.0 / below
    lane[Y + k] = 0.0
    lane[SUM + k] = 0.0


@inlined
def close_period(k: int, nodes: int, lane: Floats) -> None:
    """Start of the recurrence that closes the period, and the mean to take off, of lane k."""
    loss = lane[LOSS + k]
    if loss > 0.0:
        lane[START + k] = lane[Y + k] / -math.expm1(nodes * math.log1p(-loss))
        lane[MEAN + k] = (lane[SUM + k] + lane[Y + k] / loss) / nodes
    else:
        lane[START + k] = 0.0
        lane[MEAN + k] = 0.0


@inlined
def solve_linear(nodes: int, width: float, table: Floats, q: Floats, lane: Floats) -> None:
    """Exponent 2, constant inertia, power mean: q, which F is too, at the nodes, in closed form.

    z' + kappa z = kappa (g P - eta V) is linear with a constant coefficient and its right side has
    no mean.
    """
    lanes = q.shape[1]
    for k in range(lanes):
        recurrence(k, lane[KAPPA + k], width, lane)
        lane[LEFT + k] *= lane[KAPPA + k]
        lane[RIGHT + k] *= lane[KAPPA + k]
        lane[CROSS + k] *= lane[KAPPA + k]
    for j in range(nodes):
        after = j + 1 if j + 1 < nodes else 0
        p0, p1 = table[GAS_WORK, j], table[GAS_WORK, after]
        v0, v1 = table[SQUARE, j], table[SQUARE, after]
        dp = table[GAS_TORQUE, j] - table[GAS_TORQUE, after]
        dv = table[SQUARE_SLOPE, j] - table[SQUARE_SLOPE, after]
        row = q[j]
        for k in range(lanes):
            y = lane[Y + k]
            row[k] = y
            lane[SUM + k] += y
            lane[Y + k] = (
                lane[DECAY + k] * y
                + lane[LEFT + k] * (lane[GAS + k] * p0 - lane[ETA + k] * v0)
                + lane[RIGHT + k] * (lane[GAS + k] * p1 - lane[ETA + k] * v1)
                + lane[CROSS + k] * (lane[GAS + k] * dp - lane[ETA + k] * dv)
            )
    for k in range(lanes):
        close_period(k, nodes, lane)
    for j in range(nodes):
        p0 = table[GAS_WORK, j]
        v0 = table[SQUARE, j]
        row = q[j]
        for k in range(lanes):
            start = lane[START + k]
            z = row[k] + start - lane[MEAN + k]
            lane[START + k] = start * lane[DECAY + k]
            row[k] = 1.0 + lane[GAS + k] * p0 - lane[ETA + k] * v0 - z


@inlined
def iterate(
    nodes: int,
    width: float,
    table: Floats,
    kind: int,
    variable: bool,
    closure: int,
    tolerance: float,
    q: Floats,
    z: Floats,
    force: Floats,
    lane: Floats,
    sweeps: npt.NDArray[np.int64],
) -> None:
    """Any exponent, either inertia model, either closure: q and F at the nodes, by iteration.

    `kind` is the exponent's class, one for all lanes: 0, 1 and 2 for these exponents, 3 for any
    other. Afterwards rows C and MU of `lane` hold c and mu. A lane that has converged is frozen,
    so that its numbers do not depend on its neighbours. `sweeps` returns the sweeps that a lane
    took, or 0 for one that is left to Newton's method.
    """
    lanes = q.shape[1]
    for k in range(lanes):
        lane[C + k] = 0.0
        lane[START + k] = 0.0
        lane[MEAN + k] = 0.0
        lane[DECAY + k] = 1.0
        lane[MU + k] = 1.0
        lane[RUNNING + k] = 1.0
        sweeps[k] = 0
    for j in range(nodes):
        for k in range(lanes):
            z[j, k] = 0.0
            q[j, k] = 1.0
    count = float(nodes)
    log_closure = closure != CYCLE_TIME and kind == 0
    for sweep in range(1, MOST_SWEEPS + 1):
        # First half: z at the nodes from the recurrence, q, F, and the means.
        for k in range(lanes):
            lane[FIRST + k] = 0.0
            lane[SLOPE + k] = 0.0
            lane[SECOND + k] = 0.0
            lane[DRIFT + k] = 0.0
            lane[CHANGE + k] = 0.0
            lane[LEAST + k] = 1e300
            lane[MOST + k] = -1e300
            lane[PRODUCT + k] = 1.0
        for j in range(nodes):
            p = table[GAS_WORK, j]
            v = table[SQUARE, j]
            z_row = z[j]
            q_row = q[j]
            f_row = force[j]
            for k in range(lanes):
                value = z_row[k] + lane[START + k] - lane[MEAN + k]
                lane[START + k] *= lane[DECAY + k]
                lane[NOW + k] = 1.0 + lane[C + k] + lane[GAS + k] * p - value
                z_row[k] = value
            if variable:
                for k in range(lanes):
                    inverse = 1.0 / (1.0 + lane[ETA + k] * v)
                    lane[INVERSE + k] = inverse
                    lane[NOW + k] *= inverse
            else:
                for k in range(lanes):
                    lane[INVERSE + k] = 1.0
                    lane[NOW + k] -= lane[ETA + k] * v
            for k in range(lanes):
                new = lane[NOW + k]
                moved = abs(new - q_row[k])
                q_row[k] = new
                lane[CHANGE + k] = moved if moved > lane[CHANGE + k] else lane[CHANGE + k]
                lane[LEAST + k] = new if new < lane[LEAST + k] else lane[LEAST + k]
                lane[MOST + k] = new if new > lane[MOST + k] else lane[MOST + k]
                lane[NOW + k] = new if new > FLOOR else FLOOR
            if kind == 0:
                for k in range(lanes):
                    f_row[k] = 1.0
            elif kind == 1:
                for k in range(lanes):
                    f = math.sqrt(lane[NOW + k])
                    f_row[k] = f
                    lane[FIRST + k] += f - 1.0
                    lane[SLOPE + k] += 0.5 / f * lane[INVERSE + k]
            elif kind == 2:
                for k in range(lanes):
                    f_row[k] = lane[NOW + k]
                    lane[FIRST + k] += lane[NOW + k] - 1.0
                    lane[SLOPE + k] += lane[INVERSE + k]
            else:
                for k in range(lanes):
                    f_row[k] = lane[NOW + k] ** lane[HALF + k]
                for k in range(lanes):
                    f = f_row[k]
                    lane[FIRST + k] += f - 1.0
                    lane[SLOPE + k] += lane[HALF + k] * f / lane[NOW + k] * lane[INVERSE + k]
            if closure == CYCLE_TIME:
                for k in range(lanes):
                    root = 1.0 / math.sqrt(lane[NOW + k])
                    lane[SECOND + k] += root
                    lane[DRIFT + k] -= 0.5 * root / lane[NOW + k] * lane[INVERSE + k]
            elif kind == 0:
                for k in range(lanes):
                    lane[PRODUCT + k] *= lane[NOW + k]
                    lane[DRIFT + k] += lane[INVERSE + k] / lane[NOW + k]
            if log_closure and (j % 8 == 7 or j == nodes - 1):
                # mean log q, with one logarithm for eight nodes
                for k in range(lanes):
                    lane[SECOND + k] += math.log(lane[PRODUCT + k])
                    lane[PRODUCT + k] = 1.0
        waiting = 0
        for k in range(lanes):
            # FIRST is the sum of F - 1: where F is near 1, a sum of F would lose the difference.
            lane[MU + k] = 1.0 + lane[FIRST + k] / count
            if closure == CYCLE_TIME:
                shift = -(lane[SECOND + k] - count) / lane[DRIFT + k]
            elif kind == 0:
                shift = -lane[SECOND + k] / lane[DRIFT + k]
            else:
                shift = -lane[FIRST + k] / lane[SLOPE + k]
            lane[SHIFT + k] = shift
            low, high = lane[LEAST + k], lane[MOST + k]
            if lane[RUNNING + k] > 0.0 and not (low > FLOOR and high < 1e3):
                # A lane that leaves the range of powers is left to Newton's method, which also
                # decides whether it stalls.
                lane[RUNNING + k] = 0.0
            if lane[RUNNING + k] > 0.0 and sweep > 1:
                bound = tolerance * (high - low) + 4e-16
                if lane[CHANGE + k] <= bound and abs(shift) <= bound:
                    lane[RUNNING + k] = 0.0
                    sweeps[k] = sweep
            if lane[RUNNING + k] > 0.0:
                waiting += 1
        if waiting == 0 or sweep == MOST_SWEEPS:
            return
        # Second half: the recurrence of z' + beta z = R, for the lanes that still run.
        for k in range(lanes):
            if lane[RUNNING + k] > 0.0:
                lane[C + k] += lane[SHIFT + k]
            lane[BETA + k] = lane[KAPPA + k] * lane[SLOPE + k] / (count * lane[MU + k])
            recurrence(k, lane[BETA + k], width, lane)
        if kind == 0:
            for k in range(lanes):
                lane[START + k] = 0.0
                lane[MEAN + k] = 0.0
                lane[DECAY + k] = 1.0
            continue
        for j in range(nodes + 1):
            node = j if j < nodes else 0
            dp = table[GAS_TORQUE, node]
            dv = table[SQUARE_SLOPE, node]
            v = table[SQUARE, node]
            z_row = z[node]
            q_row = q[node]
            f_row = force[node]
            if j < nodes:
                if kind == 1:
                    for k in range(lanes):
                        lane[NOW_SLOPE + k] = 0.5 / f_row[k]
                elif kind == 2:
                    for k in range(lanes):
                        lane[NOW_SLOPE + k] = 1.0
                else:
                    for k in range(lanes):
                        lane[NOW_SLOPE + k] = lane[HALF + k] * f_row[k] / q_row[k]
                for k in range(lanes):
                    f = lane[KAPPA + k] * (f_row[k] / lane[MU + k] - 1.0)
                    dq = lane[GAS + k] * dp - f
                    turn = lane[ETA + k] * dv
                    if variable:
                        dq = (dq - q_row[k] * turn) / (1.0 + lane[ETA + k] * v)
                    else:
                        dq -= turn
                    lane[NOW + k] = f + lane[BETA + k] * z_row[k]
                    lane[NOW_SLOPE + k] = (
                        lane[KAPPA + k] / lane[MU + k] * lane[NOW_SLOPE + k] * dq
                        + lane[BETA + k] * f
                    )
            else:
                for k in range(lanes):
                    lane[NOW + k] = lane[HEAD + k]
                    lane[NOW_SLOPE + k] = lane[HEAD_SLOPE + k]
            if j == 0:
                for k in range(lanes):
                    lane[HEAD + k] = lane[NOW + k]
                    lane[HEAD_SLOPE + k] = lane[NOW_SLOPE + k]
            else:
                for k in range(lanes):
                    lane[Y + k] = (
                        lane[DECAY + k] * lane[Y + k]
                        + lane[LEFT + k] * lane[BEFORE + k]
                        + lane[RIGHT + k] * lane[NOW + k]
                        + lane[CROSS + k] * (lane[BEFORE_SLOPE + k] - lane[NOW_SLOPE + k])
                    )
            for k in range(lanes):
                lane[BEFORE + k] = lane[NOW + k]
                lane[BEFORE_SLOPE + k] = lane[NOW_SLOPE + k]
            if j < nodes:
                for k in range(lanes):
                    lane[SUM + k] += lane[Y + k]
                    z_row[k] = lane[Y + k] if lane[RUNNING + k] > 0.0 else z_row[k]
        for k in range(lanes):
            close_period(k, nodes, lane)
            if not lane[RUNNING + k] > 0.0:
                lane[START + k] = 0.0
                lane[MEAN + k] = 0.0
                lane[DECAY + k] = 1.0
