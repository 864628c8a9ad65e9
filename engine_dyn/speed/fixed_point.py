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

__all__ = ["LANES", "MOST_SWEEPS", "iterate", "solve_linear"]

Floats = npt.NDArray[np.float64]

LANES = 16
"""Designs side by side: four registers of AVX2 or two of AVX-512 hide the recurrence's latency."""

MOST_SWEEPS = 24
"""What has not converged by then is left to Newton's method."""


@inlined
def solve_linear(
    nodes: int,
    width: float,
    table: Floats,
    gas: Floats,
    eta: Floats,
    kappa: Floats,
    q: Floats,
    force: Floats,
    work: Floats,
) -> None:
    """Exponent 2, constant inertia, power mean: q and F at the nodes, in closed form.

    z' + kappa z = kappa (g P - eta V) is linear with a constant coefficient and its right side has
    no mean. `work` is scratch (rows, LANES).
    """
    factor = width * width / 12.0
    decay, left, right, y, power, one_less = work[0], work[1], work[2], work[3], work[4], work[5]
    cross, total = work[6], work[7]
    for k in range(LANES):
        x = kappa[k] * width
        below = 1.0 + 0.5 * x + x * x / 12.0
        one_less[k] = x / below
        decay[k] = 1.0 - one_less[k]
        # Weights of the right side R at both ends, and of the difference of its slopes.
        left[k] = kappa[k] * (0.5 * width - width * x / 12.0) / below
        right[k] = kappa[k] * (0.5 * width + width * x / 12.0) / below
        cross[k] = kappa[k] * factor / below
        y[k] = 0.0
        total[k] = 0.0
    for j in range(nodes):
        after = j + 1 if j + 1 < nodes else 0
        p0, p1 = table[GAS_WORK, j], table[GAS_WORK, after]
        v0, v1 = table[SQUARE, j], table[SQUARE, after]
        dp = table[GAS_TORQUE, j] - table[GAS_TORQUE, after]
        dv = table[SQUARE_SLOPE, j] - table[SQUARE_SLOPE, after]
        for k in range(LANES):
            q[j, k] = y[k]
            total[k] += y[k]
            y[k] = (
                decay[k] * y[k]
                + left[k] * (gas[k] * p0 - eta[k] * v0)
                + right[k] * (gas[k] * p1 - eta[k] * v1)
                + cross[k] * (gas[k] * dp - eta[k] * dv)
            )
    for k in range(LANES):
        if one_less[k] > 0.0:
            # Start that closes the period, and the mean to take off (rounding only, in theory).
            cycle = -math.expm1(nodes * math.log1p(-one_less[k]))
            power[k] = y[k] / cycle
            total[k] = (total[k] + y[k] / one_less[k]) / nodes
        else:
            power[k] = 0.0
            total[k] = 0.0
    for j in range(nodes):
        p0 = table[GAS_WORK, j]
        v0 = table[SQUARE, j]
        for k in range(LANES):
            z = q[j, k] + power[k] - total[k]
            power[k] *= decay[k]
            q[j, k] = 1.0 + gas[k] * p0 - eta[k] * v0 - z
            force[j, k] = q[j, k]


@inlined
def iterate(
    nodes: int,
    width: float,
    table: Floats,
    gas: Floats,
    eta: Floats,
    kappa: Floats,
    half: Floats,
    kind: int,
    variable: bool,
    closure: int,
    tolerance: float,
    q: Floats,
    z: Floats,
    force: Floats,
    work: Floats,
    sweeps: npt.NDArray[np.int64],
) -> None:
    """Any exponent, either inertia model, either closure: q and F at the nodes, by iteration.

    `kind` is the exponent's class, one for all lanes: 0, 1 and 2 for these exponents, 3 for any
    other. `work` is scratch (rows, LANES); afterwards work[0] holds c and work[1] mu. A lane that
    has converged is frozen, so that its numbers do not depend on its neighbours. `sweeps` returns
    the sweeps that a lane took, or 0 for one that is left to Newton's method.
    """
    c, mu, slope, first, second, shift, drift = (
        work[0], work[1], work[2], work[3], work[4], work[5], work[6],
    )
    decay, left, right, cross, beta = work[7], work[8], work[9], work[10], work[11]
    start, mean, change, low, high, product = (
        work[12], work[13], work[14], work[15], work[16], work[17],
    )
    y, before, before_slope, head, head_slope, one_less, total = (
        work[18], work[19], work[20], work[21], work[22], work[23], work[24],
    )
    running = work[25]
    for k in range(LANES):
        c[k] = 0.0
        start[k] = 0.0
        mean[k] = 0.0
        decay[k] = 1.0
        mu[k] = 1.0
        sweeps[k] = 0
        running[k] = 1.0
    for j in range(nodes):
        for k in range(LANES):
            z[j, k] = 0.0
            q[j, k] = 1.0
    factor = width * width / 12.0
    count = float(nodes)
    log_closure = closure != CYCLE_TIME and kind == 0
    for sweep in range(1, MOST_SWEEPS + 1):
        # First half: z at the nodes from the recurrence, q, F, and the means.
        for k in range(LANES):
            first[k] = 0.0
            slope[k] = 0.0
            second[k] = 0.0
            drift[k] = 0.0
            change[k] = 0.0
            low[k] = 1e300
            high[k] = -1e300
            product[k] = 1.0
        for j in range(nodes):
            p = table[GAS_WORK, j]
            v = table[SQUARE, j]
            for k in range(LANES):
                value = z[j, k] + start[k] - mean[k]
                z[j, k] = value
                start[k] *= decay[k]
                energy = 1.0 + c[k] + gas[k] * p - value
                if variable:
                    inverse = 1.0 / (1.0 + eta[k] * v)
                    new = energy * inverse
                else:
                    inverse = 1.0
                    new = energy - eta[k] * v
                change[k] = max(change[k], abs(new - q[j, k]))
                low[k] = min(low[k], new)
                high[k] = max(high[k], new)
                q[j, k] = new
                base = max(new, FLOOR)
                if kind == 0:
                    f = 1.0
                    df = 0.0
                elif kind == 1:
                    f = math.sqrt(base)
                    df = 0.5 / f
                elif kind == 2:
                    f = base
                    df = 1.0
                else:
                    f = base ** half[k]
                    df = half[k] * f / base
                force[j, k] = f
                first[k] += f
                slope[k] += df * inverse
                if closure == CYCLE_TIME:
                    root = 1.0 / math.sqrt(base)
                    second[k] += root
                    drift[k] -= 0.5 * root / base * inverse
                elif kind == 0:
                    product[k] *= base
                    drift[k] += inverse / base
            if log_closure and (j % 8 == 7 or j == nodes - 1):
                # mean log q, with one logarithm for eight nodes
                for k in range(LANES):
                    second[k] += math.log(product[k])
                    product[k] = 1.0
        waiting = 0
        for k in range(LANES):
            if closure == CYCLE_TIME:
                residual = second[k] / count - 1.0
                shift[k] = -residual * count / drift[k]
            elif kind == 0:
                shift[k] = -second[k] / drift[k]
            else:
                shift[k] = (1.0 - first[k] / count) * count / slope[k]
            mu[k] = first[k] / count
            if running[k] > 0.0 and not (low[k] > FLOOR and high[k] < 1e3):
                # A lane that leaves the range of powers is left to Newton's method, which also
                # decides whether it stalls.
                running[k] = 0.0
            if running[k] > 0.0 and sweep > 1:
                bound = tolerance * (high[k] - low[k]) + 4e-16
                if change[k] <= bound and abs(shift[k]) <= bound:
                    running[k] = 0.0
                    sweeps[k] = sweep
            if running[k] > 0.0:
                waiting += 1
        if waiting == 0 or sweep == MOST_SWEEPS:
            return
        # Second half: the recurrence of z' + beta z = R, for the lanes that still run.
        for k in range(LANES):
            if running[k] > 0.0:
                c[k] += shift[k]
            beta[k] = kappa[k] * slope[k] / (count * mu[k])
            x = beta[k] * width
            below = 1.0 + 0.5 * x + x * x / 12.0
            one_less[k] = x / below
            decay[k] = 1.0 - one_less[k]
            left[k] = (0.5 * width - width * x / 12.0) / below
            right[k] = (0.5 * width + width * x / 12.0) / below
            cross[k] = factor / below
            y[k] = 0.0
            total[k] = 0.0
        if kind == 0:
            for k in range(LANES):
                start[k] = 0.0
                mean[k] = 0.0
                decay[k] = 1.0
            continue
        for j in range(nodes + 1):
            node = j if j < nodes else 0
            dp = table[GAS_TORQUE, node]
            dv = table[SQUARE_SLOPE, node]
            v = table[SQUARE, node]
            for k in range(LANES):
                if j < nodes:
                    f = kappa[k] * (force[node, k] / mu[k] - 1.0)
                    value = q[node, k]
                    if kind == 1:
                        df = 0.5 / force[node, k]
                    elif kind == 2:
                        df = 1.0
                    else:
                        df = half[k] * force[node, k] / value
                    if variable:
                        inverse = 1.0 / (1.0 + eta[k] * v)
                        dq = (gas[k] * dp - f - value * eta[k] * dv) * inverse
                    else:
                        dq = gas[k] * dp - f - eta[k] * dv
                    r = f + beta[k] * z[node, k]
                    dr = kappa[k] / mu[k] * df * dq + beta[k] * f
                else:
                    r = head[k]
                    dr = head_slope[k]
                if j == 0:
                    head[k] = r
                    head_slope[k] = dr
                else:
                    y[k] = (
                        decay[k] * y[k]
                        + left[k] * before[k]
                        + right[k] * r
                        + cross[k] * (before_slope[k] - dr)
                    )
                before[k] = r
                before_slope[k] = dr
                if j < nodes and running[k] > 0.0:
                    z[node, k] = y[k]
                    total[k] += y[k]
        for k in range(LANES):
            if running[k] > 0.0 and one_less[k] > 0.0:
                start[k] = y[k] / -math.expm1(nodes * math.log1p(-one_less[k]))
                mean[k] = (total[k] + y[k] / one_less[k]) / nodes
            else:
                start[k] = 0.0
                mean[k] = 0.0
                decay[k] = 1.0
