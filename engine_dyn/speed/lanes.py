"""Periodic speed of sixteen designs at a time, as SIMD lanes over one table.

The problem is that of `segments` (same symbols), with the power mean as closure:

    constant inertia:   u = X - y,                          u = q - 1,  X = g P - eta V,
    variable inertia:   u = (X - y)/tau,                    tau = 1 + eta V,
    y' = kappa (F - 1),   F = q^a,   a = alpha/2.

Here y is what the load takes, less the constant c of the closure. Split into its linear part and a
rest of second order, y' + beta y = beta X + kappa r with beta = a kappa and r = F - 1 - a u tau: a
recurrence with constant coefficients over the coarse nodes of `levels`. The work of X between nodes
is exact, the rest is integrated by the trapezoidal rule with its first two Euler-Maclaurin
terms, which along a periodic curve add up to corrections at the nodes and leave the sixth order.
Starting the recurrence at y_N/(1 - d^N) closes the period and the power mean at once: both sides
vanish together with the load, so a weak load is as well conditioned as any other. alpha = 2 with
constant inertia has r = 0 and needs no iteration, alpha = 0 has no load term at all, only the
geometric mean to close; else r is iterated, and converges by a factor of about kappa u a pass.

Lanes never exchange anything: a lane whose u no longer changes keeps it ("frozen"), blocks are
filled up by repeating a design, and every sum runs in a fixed order, so a design's numbers cannot
depend on its neighbours. What leaves the range of this method (a load that is strong over one
interval, a speed that falls or rises by much, a torque within rounding of idle) is not answered
here but left to `designs.march`.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from engine_dyn.compilation import inlined
from engine_dyn.speed.extremes import interpolate, refine
from engine_dyn.speed.levels import (
    ALIAS_P,
    ALIAS_V,
    ALIASED,
    CHUNK,
    CUBES,
    FOURTHS,
    HIGHEST_SLOPE,
    HIGHEST_SLOPE_V,
    P_ABOVE,
    P_BELOW,
    P_MOMENT,
    PP,
    PV,
    SQUARES,
    V_ABOVE,
    V_BELOW,
    V_MOMENT,
    VV,
    WORK,
    Levels,
    P,
    V,
)

__all__ = [
    "LANES",
    "LEFT",
    "FIELDS",
    "prepare",
    "extremes",
    "iterate",
    "solve_linear",
]

Floats = npt.NDArray[np.float64]

LANES = 16

PAD = 2
"""Rows beside the first and the last node: the period again."""

# Numbers of a design, one row of lanes each.
TAKEN_A_NODE = 8
POINTS = 6
FIELDS = 72 + 3 * TAKEN_A_NODE + POINTS
(
    BORE, STROKE, MASS, NOMINAL, INERTIA, EXPONENT, OFFSET, MEAN_TORQUE,
    GAS, ETA, KAPPA, HALF, BETA, DECAY, GAS_WORK, ETA_WORK, GAS_HERE, ETA_HERE, RHO, SIGMA, EULER,
    EULER_FAR, CLOSED, ALIAS, ALIAS_SPEED, SQUARE_MEAN, LEVEL, BENT, SHIFT, START, WORK_END,
    REST_END, RUNNING, HIGH, LOW, CHANGE, LAST, REST_SUM, REST_MOST, FROZEN, CODE, MEAN, MOVED, TOP,
    BOTTOM, C0, C1, C2, C3, C4, C5, AT, BASE, ENDED, NODE, AT_NODE, PEAK, MISS, HILLS, ERROR,
    ROW_TABLE, NEXT_TABLE, UNIT_TABLE, ROW_SHARE, NEXT_SHARE, CRANKCASE, SWING, LOOSE, ROUGH, TURNS,
    FIRST_SUM, SECOND_SUM,
) = (row * LANES for row in range(72))  # fmt: skip

TAKEN = 72 * LANES
"""What was gathered at up to three nodes: FINE_FIELDS of them, or six of these, u and r."""

POINT = (72 + 3 * TAKEN_A_NODE) * LANES
"""Weights of the crank ratios between which a lane's own table is interpolated."""

LEFT = -1.0
"""Code of a design that is left to the general method."""

NO_LOAD = 1e-30
"""Smallest kappa: its solution is that without load to rounding, and nothing divides by zero."""

LARGEST_STEP = 0.05
"""Largest beta times the width of a coarse interval: beyond it the coarse level is too coarse."""

DEEPEST, HIGHEST = -0.5, 1.0
"""Range of u in which the series of the logarithm has converged."""

MOST_PASSES = 10

FREE_STEP = 1e-3
"""Largest step of the closure that its first two derivatives give to rounding."""

ROUNDING = 5e-16
"""Error of a speed over nominal that rounding leaves: a relative error of delta, the
smaller that is."""

LARGEST_ALIAS = 1e-3
"""Largest share of a table that the coarse level may see wrongly; of usual ones it is 1e-4."""

SMALLEST_HALF, LARGEST_HALF = 1e-4, 8.0
"""Range of a: below it the closure -mean(r)/a loses its digits, above it `exp_of` does not hold."""


@inlined
def make_rows(nodes: int) -> tuple[Floats, Floats, Floats, Floats, Floats]:
    """Memory of one block: numbers, u and r at the nodes and beside both ends, their bounds."""
    return (
        np.zeros(FIELDS * LANES),
        np.zeros((nodes + 2 * PAD) * LANES),
        np.zeros((nodes + 2 * PAD) * LANES),
        np.zeros(nodes // CHUNK * LANES),
        np.zeros(nodes // CHUNK * LANES),
    )


@inlined
def shared(table: Floats, node: int, field: int) -> float:
    """Value of a table that the lanes share, to be read before the loop over them."""
    if table.ndim == 2:
        return table[node, field]
    return 0.0


@inlined
def own(table: Floats, common: float, node: int, field: int, k: int) -> float:
    """Value of a lane: what `shared` read, or that of its own table (node, field, lane).

    Which of both is known when this is compiled: Numba prunes the branch by the dimensions.
    """
    if table.ndim == 2:
        return common
    return table[node, field, k]


@inlined
def constant(constants: Floats, index: int, k: int) -> float:
    """Return a constant of the lanes' table, or of a lane's own (constant, lane)."""
    if constants.ndim == 1:
        return constants[index]
    return constants[index, k]


@inlined
def loss_of(x: float) -> float:
    """1 - exp(-x) for x up to 0.1, to rounding, without the library's call."""
    return x * (1.0 - x / 2.0 * (1.0 - x / 3.0 * (1.0 - x / 4.0 * (1.0 - x / 5.0 * (
        1.0 - x / 6.0 * (1.0 - x / 7.0 * (1.0 - x / 8.0)))))))  # fmt: skip


@inlined
def log_of(u: float) -> float:
    """log(1 + u) for u from -0.5 to 1, to rounding: the series of the inverse tangent."""
    s = u / (2.0 + u)
    t = s * s
    return 2.0 * s * (1.0 + t * (1.0 / 3.0 + t * (1.0 / 5.0 + t * (1.0 / 7.0 + t * (1.0 / 9.0
        + t * (1.0 / 11.0 + t * (1.0 / 13.0 + t * (1.0 / 15.0 + t * (1.0 / 17.0 + t * (
            1.0 / 19.0 + t * (1.0 / 21.0 + t / 23.0)))))))))))  # fmt: skip


@inlined
def exp_of(x: float) -> float:
    """exp(x) for x from -8 to 8: the series of a thirty-second, squared five times."""
    y = x / 32.0
    e = 1.0 + y * (1.0 + y / 2.0 * (1.0 + y / 3.0 * (1.0 + y / 4.0 * (1.0 + y / 5.0 * (
        1.0 + y / 6.0 * (1.0 + y / 7.0 * (1.0 + y / 8.0 * (1.0 + y / 9.0))))))))  # fmt: skip
    e *= e
    e *= e
    e *= e
    e *= e
    return e * e


@inlined
def alias(
    b: float, logarithm: bool, variable: bool, first: bool, g: float, eta: float, c: Floats
) -> float:
    """Mean of q^b, or log q, over the fine less that over the coarse nodes, without the load.

    Taylor's series to fourth order in X, or in g P and eta V; `first` says whether the first order
    counts. `c` are the table's constants.
    """
    b1, b2 = b, 0.5 * b * (b - 1.0)
    b3 = b2 * (b - 2.0) / 3.0
    b4 = b3 * (b - 3.0) * 0.25
    if logarithm:
        b1, b2, b3, b4 = 1.0, -0.5, 1.0 / 3.0, -0.25
    if variable:
        # (1 + g P)^b (1 + eta V)^-b
        n1, n2 = -b, 0.5 * b * (b + 1.0)
        n3 = -n2 * (b + 2.0) / 3.0
        n4 = -n3 * (b + 3.0) * 0.25
        m11, m21, m12, m31, m22, m13 = b1 * n1, b2 * n1, b1 * n2, b3 * n1, b2 * n2, b1 * n3
        if logarithm:
            n1, n2, n3, n4 = -1.0, 0.5, -1.0 / 3.0, 0.25
            m11 = m21 = m12 = m31 = m22 = m13 = 0.0
        e = eta
    else:
        n1, n2, n3, n4 = b1, b2, b3, b4
        m11, m21, m12 = 2.0 * b2, 3.0 * b3, 3.0 * b3
        m31, m22, m13 = 4.0 * b4, 6.0 * b4, 4.0 * b4
        e = -eta
    g2, e2 = g * g, e * e
    total = g2 * (b2 * c[5] + g * (b3 * c[8] + g * b4 * c[12]))
    total += e2 * (n2 * c[7] + e * (n3 * c[11] + e * n4 * c[16]))
    total += g * e * (
        m11 * c[6] + g * (m21 * c[9] + g * m31 * c[13]) + e * (m12 * c[10] + e * m13 * c[15])
        + g * e * m22 * c[14]
    )  # fmt: skip
    if first:
        total += b1 * g * c[3] + n1 * e * c[4]
    return total


@inlined
def level_without_load(variable: bool, g: float, eta: float, c: Floats, k: int) -> float:
    """Constant of the closure for exponent 0: the mean of log q vanishes.

    One scalar equation in the moments of the table up to the fourth, by Newton's steps; what the
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
    wanted = 0.0
    if variable:
        wanted = eta * eta * (
            -0.5 * constant(c, VV, k)
            + eta * (constant(c, CUBES + 3, k) / 3.0 - 0.25 * eta * constant(c, FOURTHS + 4, k))
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
def prepare(
    kind: int, variable: bool, step: float, nodes: int, swing_shape: float,
    least_square: float, idle: float, no_steady_state: float, invalid: float, constants: Floats,
    lanes: int, s: Floats,
) -> None:  # fmt: skip
    """Reduced parameters, weights of the recurrence and a first level, from the inputs in `s`."""
    for k in range(lanes):
        radius = 0.5 * s[STROKE + k]
        lever = 0.25 * math.pi * s[BORE + k] * s[BORE + k] * radius
        throw = s[MASS + k] * radius * radius
        square = s[NOMINAL + k] * s[NOMINAL + k]
        energy = 0.5 * s[INERTIA + k] * square
        surplus = s[MEAN_TORQUE + k] - s[OFFSET + k]
        swing = idle * (lever * s[SWING + k] + throw * square * swing_shape)
        g = lever / energy
        eta = throw / s[INERTIA + k]
        half = 0.5 * s[EXPONENT + k] if kind != 0 else 0.0
        a = half if kind != 0 else 1.0
        kappa = surplus / energy if kind != 0 else 0.0
        kappa = kappa if kappa > NO_LOAD else NO_LOAD
        code = 0.0
        code = LEFT if surplus <= swing else code
        code = no_steady_state if surplus < -swing else code
        x = a * kappa * step
        # Not `x > ...`: what is no number is left as well.
        code = code if x <= LARGEST_STEP or code != 0.0 else LEFT
        code = invalid if variable and 1.0 + eta * least_square <= 0.0 else code
        code = code if SMALLEST_HALF <= a <= LARGEST_HALF or code != 0.0 else LEFT
        code = code if constant(constants, ALIASED, k) <= LARGEST_ALIAS or code != 0.0 else LEFT
        kappa = kappa if x <= LARGEST_STEP else LARGEST_STEP / (a * step)
        x = x if x <= LARGEST_STEP else LARGEST_STEP
        loss = loss_of(x)
        # 1 - d^N by doubling of expm1
        whole = -loss_of(x * nodes / 64.0)
        for _ in range(6):
            whole *= 2.0 + whole
        bent = 1.0 / (1.0 + x * x / 12.0)
        decay = 1.0 - loss
        rho = 0.5 * loss / a
        s[CODE + k] = code
        s[GAS + k] = g
        s[ETA + k] = eta
        s[KAPPA + k] = kappa
        s[HALF + k] = a
        s[BETA + k] = a * kappa
        s[DECAY + k] = decay
        s[GAS_WORK + k] = bent * g * loss / step
        s[ETA_WORK + k] = bent * eta * loss / step
        s[GAS_HERE + k] = bent * g
        s[ETA_HERE + k] = bent * eta
        s[RHO + k] = rho + kappa * step * x / 6.0
        s[SIGMA + k] = rho * (1.0 + decay)
        s[EULER + k] = kappa * step * (82.0 / 1440.0)
        s[EULER_FAR + k] = kappa * step * (11.0 / 1440.0)
        s[CLOSED + k] = -1.0 / whole
        s[SHIFT + k] = 0.0
        s[RUNNING + k] = 0.0
        pp = g * g * constant(constants, PP, k)
        pv = g * eta * constant(constants, PV, k)
        vv = eta * eta * constant(constants, VV, k)
        s[SQUARE_MEAN + k] = pp - 2.0 * pv + vv
        loose = s[SQUARE_MEAN + k] + (vv if variable else 0.0)
        s[LOOSE + k] = 4.0 * (1.0 + half * half) * loose
        cross, last = (half, half + 1.0) if variable else (half - 1.0, half - 1.0)
        s[LEVEL + k] = cross * pv - 0.5 * ((half - 1.0) * pp + last * vv)
        if kind == 0:
            s[LEVEL + k] = level_without_load(variable, g, eta, constants, k)
        s[ALIAS + k] = 0.0
        s[ALIAS_SPEED + k] = 0.0
        if constants.ndim == 2:
            linear = g * constants[ALIAS_P, k] - eta * constants[ALIAS_V, k]
            s[ALIAS + k] = linear if kind == 0 else 0.0
            s[ALIAS_SPEED + k] = 0.5 * linear
        if constants.ndim == 1:
            free = kind == 0
            s[ALIAS + k] = alias(half, free, variable, free, g, eta, constants) / a
            s[ALIAS_SPEED + k] = alias(0.5, False, variable, True, g, eta, constants)
        s[BENT + k] = kappa * step * x / 6.0
        s[FROZEN + k] = 0.0
        s[TURNS + k] = 1.0
        s[MOVED + k] = 0.0
        s[LAST + k] = 1e300


@inlined
def end_of_work(lanes: int, coarse: Floats, s: Floats) -> None:
    """End of the linear recurrence over one period from zero: only the work of X drives it."""
    for group in range(coarse.shape[0] // CHUNK):
        n = CHUNK * group
        pw0, pw1 = shared(coarse, n, WORK), shared(coarse, n + 1, WORK)
        pw2, pw3 = shared(coarse, n + 2, WORK), shared(coarse, n + 3, WORK)
        vw0, vw1 = shared(coarse, n, SQUARES), shared(coarse, n + 1, SQUARES)
        vw2, vw3 = shared(coarse, n + 2, SQUARES), shared(coarse, n + 3, SQUARES)
        for k in range(lanes):
            p0 = own(coarse, pw0, n, WORK, k)
            p1 = own(coarse, pw1, n + 1, WORK, k)
            p2 = own(coarse, pw2, n + 2, WORK, k)
            p3 = own(coarse, pw3, n + 3, WORK, k)
            v0 = own(coarse, vw0, n, SQUARES, k)
            v1 = own(coarse, vw1, n + 1, SQUARES, k)
            v2 = own(coarse, vw2, n + 2, SQUARES, k)
            v3 = own(coarse, vw3, n + 3, SQUARES, k)
            d, g, e = s[DECAY + k], s[GAS_WORK + k], s[ETA_WORK + k]
            y = d * s[RUNNING + k] + (g * p0 - e * v0)
            y = d * y + (g * p1 - e * v1)
            y = d * y + (g * p2 - e * v2)
            s[RUNNING + k] = d * y + (g * p3 - e * v3)
    for k in range(lanes):
        s[WORK_END + k] = s[RUNNING + k]


@inlined
def wrap(nodes: int, lanes: int, rows: Floats) -> None:
    """Repeat the last rows before the first and the first behind the last."""
    for i in range(PAD):
        for k in range(lanes):
            rows[i * LANES + k] = rows[(nodes + i) * LANES + k]
            rows[(nodes + PAD + i) * LANES + k] = rows[(PAD + i) * LANES + k]


@inlined
def solve_linear(
    lanes: int, coarse: Floats, s: Floats, us: Floats, tops: Floats, lows: Floats
) -> None:
    """Exponent 2, constant inertia: u at the coarse nodes, and the mean speed, in one pass."""
    nodes = coarse.shape[0]
    for k in range(lanes):
        s[RUNNING + k] = s[WORK_END + k] * s[CLOSED + k]
        s[MEAN + k] = 0.0
        s[HIGH + k] = -1e300
        s[LOW + k] = 1e300
    for group in range(nodes // CHUNK):
        n = CHUNK * group
        aw0, aw1 = shared(coarse, n, WORK), shared(coarse, n + 1, WORK)
        aw2, aw3 = shared(coarse, n + 2, WORK), shared(coarse, n + 3, WORK)
        bw0, bw1 = shared(coarse, n, SQUARES), shared(coarse, n + 1, SQUARES)
        bw2, bw3 = shared(coarse, n + 2, SQUARES), shared(coarse, n + 3, SQUARES)
        pw0, pw1 = shared(coarse, n, P), shared(coarse, n + 1, P)
        pw2, pw3 = shared(coarse, n + 2, P), shared(coarse, n + 3, P)
        vw0, vw1 = shared(coarse, n, V), shared(coarse, n + 1, V)
        vw2, vw3 = shared(coarse, n + 2, V), shared(coarse, n + 3, V)
        row, bound = (n + PAD) * LANES, group * LANES
        for k in range(lanes):
            a0 = own(coarse, aw0, n, WORK, k)
            a1 = own(coarse, aw1, n + 1, WORK, k)
            a2 = own(coarse, aw2, n + 2, WORK, k)
            a3 = own(coarse, aw3, n + 3, WORK, k)
            b0 = own(coarse, bw0, n, SQUARES, k)
            b1 = own(coarse, bw1, n + 1, SQUARES, k)
            b2 = own(coarse, bw2, n + 2, SQUARES, k)
            b3 = own(coarse, bw3, n + 3, SQUARES, k)
            p0 = own(coarse, pw0, n, P, k)
            p1 = own(coarse, pw1, n + 1, P, k)
            p2 = own(coarse, pw2, n + 2, P, k)
            p3 = own(coarse, pw3, n + 3, P, k)
            v0 = own(coarse, vw0, n, V, k)
            v1 = own(coarse, vw1, n + 1, V, k)
            v2 = own(coarse, vw2, n + 2, V, k)
            v3 = own(coarse, vw3, n + 3, V, k)
            d, g, e = s[DECAY + k], s[GAS_WORK + k], s[ETA_WORK + k]
            gas, eta = s[GAS_HERE + k], s[ETA_HERE + k]
            y = s[RUNNING + k]
            u0 = gas * p0 - eta * v0 - y
            y = d * y + (g * a0 - e * b0)
            u1 = gas * p1 - eta * v1 - y
            y = d * y + (g * a1 - e * b1)
            u2 = gas * p2 - eta * v2 - y
            y = d * y + (g * a2 - e * b2)
            u3 = gas * p3 - eta * v3 - y
            s[RUNNING + k] = d * y + (g * a3 - e * b3)
            us[row + k] = u0
            us[row + LANES + k] = u1
            us[row + 2 * LANES + k] = u2
            us[row + 3 * LANES + k] = u3
            high = max(max(u0, u1), max(u2, u3))
            low = min(min(u0, u1), min(u2, u3))
            tops[bound + k] = high
            lows[bound + k] = low
            s[HIGH + k] = max(s[HIGH + k], high)
            s[LOW + k] = min(s[LOW + k], low)
            s[MEAN + k] += (math.sqrt(1.0 + u0) + math.sqrt(1.0 + u1)) + (
                math.sqrt(1.0 + u2) + math.sqrt(1.0 + u3)
            )
    wrap(nodes, lanes, us)
    for k in range(lanes):
        s[MEAN + k] = s[MEAN + k] / nodes + s[ALIAS_SPEED + k]


@inlined
def solve_free(
    variable: bool, lanes: int, coarse: Floats, s: Floats, us: Floats, tops: Floats, lows: Floats
) -> None:
    """Exponent 0: u at the coarse nodes, in one pass.

    No load term: u = X + c, or e/tau - 1 with variable inertia, with the constant c from the
    moments of the table. The mean of log q over the nodes is what these leave of the closure; its
    first two derivatives give the step that is still to be made, MOVED, to rounding.
    """
    nodes = coarse.shape[0]
    for k in range(lanes):
        s[HIGH + k] = -1e300
        s[LOW + k] = 1e300
        s[REST_SUM + k] = 0.0
        s[FIRST_SUM + k] = 0.0
        s[SECOND_SUM + k] = 0.0
    for group in range(nodes // CHUNK):
        bound = group * LANES
        for k in range(lanes):
            tops[bound + k] = -1e300
            lows[bound + k] = 1e300
        for i in range(CHUNK):
            n = CHUNK * group + i
            pw, vw = shared(coarse, n, P), shared(coarse, n, V)
            row = us[(n + PAD) * LANES : (n + PAD + 1) * LANES]
            top, low = tops[bound : bound + LANES], lows[bound : bound + LANES]
            for k in range(lanes):
                p, v = own(coarse, pw, n, P, k), own(coarse, vw, n, V, k)
                u = s[LEVEL + k] + s[GAS + k] * p - s[ETA + k] * v
                inverse = 1.0
                if variable:
                    inverse = 1.0 / (1.0 + s[ETA + k] * v)
                    u *= inverse
                row[k] = u
                top[k] = max(top[k], u)
                low[k] = min(low[k], u)
                inverse /= 1.0 + u
                s[REST_SUM + k] += log_of(u)
                s[FIRST_SUM + k] += inverse
                s[SECOND_SUM + k] += inverse * inverse
        for k in range(lanes):
            s[HIGH + k] = max(s[HIGH + k], tops[bound + k])
            s[LOW + k] = min(s[LOW + k], lows[bound + k])
    wrap(nodes, lanes, us)
    for k in range(lanes):
        mean = s[REST_SUM + k] / nodes + s[ALIAS + k]
        first, second = s[FIRST_SUM + k] / nodes, s[SECOND_SUM + k] / nodes
        step = -mean / first
        moved = step + 0.5 * second * step * step / first
        s[MOVED + k] = moved
        within = s[LOW + k] > DEEPEST and s[HIGH + k] < HIGHEST and abs(moved) < FREE_STEP
        s[CODE + k] = s[CODE + k] if within or s[CODE + k] != 0.0 else LEFT


@inlined
def march_constant(
    lanes: int, coarse: Floats, s: Floats, us: Floats, rs: Floats, tops: Floats, lows: Floats
) -> None:
    """One pass of the recurrence: u at the coarse nodes from r there. Constant inertia."""
    for group in range(coarse.shape[0] // CHUNK):
        n = CHUNK * group
        aw0, aw1 = shared(coarse, n, WORK), shared(coarse, n + 1, WORK)
        aw2, aw3 = shared(coarse, n + 2, WORK), shared(coarse, n + 3, WORK)
        bw0, bw1 = shared(coarse, n, SQUARES), shared(coarse, n + 1, SQUARES)
        bw2, bw3 = shared(coarse, n + 2, SQUARES), shared(coarse, n + 3, SQUARES)
        pw0, pw1 = shared(coarse, n, P), shared(coarse, n + 1, P)
        pw2, pw3 = shared(coarse, n + 2, P), shared(coarse, n + 3, P)
        vw0, vw1 = shared(coarse, n, V), shared(coarse, n + 1, V)
        vw2, vw3 = shared(coarse, n + 2, V), shared(coarse, n + 3, V)
        row, bound = (n + PAD) * LANES, group * LANES
        for k in range(lanes):
            a0 = own(coarse, aw0, n, WORK, k)
            a1 = own(coarse, aw1, n + 1, WORK, k)
            a2 = own(coarse, aw2, n + 2, WORK, k)
            a3 = own(coarse, aw3, n + 3, WORK, k)
            b0 = own(coarse, bw0, n, SQUARES, k)
            b1 = own(coarse, bw1, n + 1, SQUARES, k)
            b2 = own(coarse, bw2, n + 2, SQUARES, k)
            b3 = own(coarse, bw3, n + 3, SQUARES, k)
            p0 = own(coarse, pw0, n, P, k)
            p1 = own(coarse, pw1, n + 1, P, k)
            p2 = own(coarse, pw2, n + 2, P, k)
            p3 = own(coarse, pw3, n + 3, P, k)
            v0 = own(coarse, vw0, n, V, k)
            v1 = own(coarse, vw1, n + 1, V, k)
            v2 = own(coarse, vw2, n + 2, V, k)
            v3 = own(coarse, vw3, n + 3, V, k)
            d, g, e = s[DECAY + k], s[GAS_WORK + k], s[ETA_WORK + k]
            gas, eta = s[GAS_HERE + k], s[ETA_HERE + k]
            rho, sigma, shift = s[RHO + k], s[SIGMA + k], s[SHIFT + k]
            near, far = s[EULER + k], s[EULER_FAR + k]
            ra, rb = rs[row - 2 * LANES + k], rs[row - LANES + k]
            r0, r1 = rs[row + k], rs[row + LANES + k]
            r2, r3 = rs[row + 2 * LANES + k], rs[row + 3 * LANES + k]
            r4, r5 = rs[row + 4 * LANES + k], rs[row + 5 * LANES + k]
            y = s[RUNNING + k]
            u0 = gas * p0 - eta * v0 - (y + rho * r0) + near * (r1 - rb) - far * (r2 - ra) - shift
            y = d * y + (g * a0 - e * b0) + sigma * r0
            u1 = gas * p1 - eta * v1 - (y + rho * r1) + near * (r2 - r0) - far * (r3 - rb) - shift
            y = d * y + (g * a1 - e * b1) + sigma * r1
            u2 = gas * p2 - eta * v2 - (y + rho * r2) + near * (r3 - r1) - far * (r4 - r0) - shift
            y = d * y + (g * a2 - e * b2) + sigma * r2
            u3 = gas * p3 - eta * v3 - (y + rho * r3) + near * (r4 - r2) - far * (r5 - r1) - shift
            s[RUNNING + k] = d * y + (g * a3 - e * b3) + sigma * r3
            change = abs(u0 - us[row + k] - s[MOVED + k])
            running = s[FROZEN + k] == 0.0
            u0 = u0 if running else us[row + k]
            u1 = u1 if running else us[row + LANES + k]
            u2 = u2 if running else us[row + 2 * LANES + k]
            u3 = u3 if running else us[row + 3 * LANES + k]
            us[row + k] = u0
            us[row + LANES + k] = u1
            us[row + 2 * LANES + k] = u2
            us[row + 3 * LANES + k] = u3
            high = max(max(u0, u1), max(u2, u3))
            low = min(min(u0, u1), min(u2, u3))
            tops[bound + k] = high
            lows[bound + k] = low
            s[HIGH + k] = max(s[HIGH + k], high)
            s[LOW + k] = min(s[LOW + k], low)
            s[CHANGE + k] = max(s[CHANGE + k], change)


@inlined
def march_variable(
    lanes: int, coarse: Floats, s: Floats, us: Floats, rs: Floats, tops: Floats, lows: Floats
) -> None:
    """One pass of the recurrence with variable inertia: u = (X - y)/tau."""
    for group in range(coarse.shape[0] // CHUNK):
        n = CHUNK * group
        aw0, aw1 = shared(coarse, n, WORK), shared(coarse, n + 1, WORK)
        aw2, aw3 = shared(coarse, n + 2, WORK), shared(coarse, n + 3, WORK)
        bw0, bw1 = shared(coarse, n, SQUARES), shared(coarse, n + 1, SQUARES)
        bw2, bw3 = shared(coarse, n + 2, SQUARES), shared(coarse, n + 3, SQUARES)
        pw0, pw1 = shared(coarse, n, P), shared(coarse, n + 1, P)
        pw2, pw3 = shared(coarse, n + 2, P), shared(coarse, n + 3, P)
        vw0, vw1 = shared(coarse, n, V), shared(coarse, n + 1, V)
        vw2, vw3 = shared(coarse, n + 2, V), shared(coarse, n + 3, V)
        row, bound = (n + PAD) * LANES, group * LANES
        for k in range(lanes):
            a0 = own(coarse, aw0, n, WORK, k)
            a1 = own(coarse, aw1, n + 1, WORK, k)
            a2 = own(coarse, aw2, n + 2, WORK, k)
            a3 = own(coarse, aw3, n + 3, WORK, k)
            b0 = own(coarse, bw0, n, SQUARES, k)
            b1 = own(coarse, bw1, n + 1, SQUARES, k)
            b2 = own(coarse, bw2, n + 2, SQUARES, k)
            b3 = own(coarse, bw3, n + 3, SQUARES, k)
            p0 = own(coarse, pw0, n, P, k)
            p1 = own(coarse, pw1, n + 1, P, k)
            p2 = own(coarse, pw2, n + 2, P, k)
            p3 = own(coarse, pw3, n + 3, P, k)
            v0 = own(coarse, vw0, n, V, k)
            v1 = own(coarse, vw1, n + 1, V, k)
            v2 = own(coarse, vw2, n + 2, V, k)
            v3 = own(coarse, vw3, n + 3, V, k)
            d, g, e = s[DECAY + k], s[GAS_WORK + k], s[ETA_WORK + k]
            gas, eta, turn = s[GAS_HERE + k], s[ETA_HERE + k], s[ETA + k]
            rho, sigma, shift = s[RHO + k], s[SIGMA + k], s[SHIFT + k]
            near, far = s[EULER + k], s[EULER_FAR + k]
            ra, rb = rs[row - 2 * LANES + k], rs[row - LANES + k]
            r0, r1 = rs[row + k], rs[row + LANES + k]
            r2, r3 = rs[row + 2 * LANES + k], rs[row + 3 * LANES + k]
            r4, r5 = rs[row + 4 * LANES + k], rs[row + 5 * LANES + k]
            y = s[RUNNING + k]
            x = gas * p0 - eta * v0 + near * (r1 - rb) - far * (r2 - ra) - (y + rho * r0) - shift
            u0 = x / (1.0 + turn * v0)
            y = d * y + (g * a0 - e * b0) + sigma * r0
            x = gas * p1 - eta * v1 + near * (r2 - r0) - far * (r3 - rb) - (y + rho * r1) - shift
            u1 = x / (1.0 + turn * v1)
            y = d * y + (g * a1 - e * b1) + sigma * r1
            x = gas * p2 - eta * v2 + near * (r3 - r1) - far * (r4 - r0) - (y + rho * r2) - shift
            u2 = x / (1.0 + turn * v2)
            y = d * y + (g * a2 - e * b2) + sigma * r2
            x = gas * p3 - eta * v3 + near * (r4 - r2) - far * (r5 - r1) - (y + rho * r3) - shift
            u3 = x / (1.0 + turn * v3)
            y = d * y + (g * a3 - e * b3) + sigma * r3
            s[RUNNING + k] = y
            change = abs(u0 - us[row + k] - s[MOVED + k])
            running = s[FROZEN + k] == 0.0
            u0 = u0 if running else us[row + k]
            u1 = u1 if running else us[row + LANES + k]
            u2 = u2 if running else us[row + 2 * LANES + k]
            u3 = u3 if running else us[row + 3 * LANES + k]
            us[row + k] = u0
            us[row + LANES + k] = u1
            us[row + 2 * LANES + k] = u2
            us[row + 3 * LANES + k] = u3
            high = max(max(u0, u1), max(u2, u3))
            low = min(min(u0, u1), min(u2, u3))
            tops[bound + k] = high
            lows[bound + k] = low
            s[HIGH + k] = max(s[HIGH + k], high)
            s[LOW + k] = min(s[LOW + k], low)
            s[CHANGE + k] = max(s[CHANGE + k], change)


@inlined
def rest_root(u: float, tau: float) -> float:
    """Second-order rest F - 1 - a u tau for exponent 1."""
    return math.sqrt(1.0 + u) - 1.0 - 0.5 * u * tau


@inlined
def rest_power(u: float, tau: float, a: float) -> float:
    """Second-order rest F - 1 - a u tau for any exponent."""
    return exp_of(a * log_of(u)) - 1.0 - a * u * tau


@inlined
def rest_of(
    kind: int, variable: bool, lanes: int, coarse: Floats, s: Floats, us: Floats, rs: Floats
) -> None:
    """Second-order rest r = F - 1 - a u tau at the coarse nodes, its sum and its recurrence.

    Four nodes are written out: an inner loop over them would keep the lanes from being vectors.
    """
    for group in range(coarse.shape[0] // CHUNK):
        n = CHUNK * group
        row = (n + PAD) * LANES
        vw0, vw1 = shared(coarse, n, V), shared(coarse, n + 1, V)
        vw2, vw3 = shared(coarse, n + 2, V), shared(coarse, n + 3, V)
        if kind == 1:
            for k in range(lanes):
                e = s[ETA + k] if variable else 0.0
                v0 = own(coarse, vw0, n, V, k)
                v1 = own(coarse, vw1, n + 1, V, k)
                v2 = own(coarse, vw2, n + 2, V, k)
                v3 = own(coarse, vw3, n + 3, V, k)
                rs[row + k] = rest_root(us[row + k], 1.0 + e * v0)
                rs[row + LANES + k] = rest_root(us[row + LANES + k], 1.0 + e * v1)
                rs[row + 2 * LANES + k] = rest_root(us[row + 2 * LANES + k], 1.0 + e * v2)
                rs[row + 3 * LANES + k] = rest_root(us[row + 3 * LANES + k], 1.0 + e * v3)
        elif kind == 2:
            for k in range(lanes):
                e = s[ETA + k] if variable else 0.0
                v0 = own(coarse, vw0, n, V, k)
                v1 = own(coarse, vw1, n + 1, V, k)
                v2 = own(coarse, vw2, n + 2, V, k)
                v3 = own(coarse, vw3, n + 3, V, k)
                rs[row + k] = -us[row + k] * e * v0
                rs[row + LANES + k] = -us[row + LANES + k] * e * v1
                rs[row + 2 * LANES + k] = -us[row + 2 * LANES + k] * e * v2
                rs[row + 3 * LANES + k] = -us[row + 3 * LANES + k] * e * v3
        else:
            for k in range(lanes):
                e = s[ETA + k] if variable else 0.0
                v0 = own(coarse, vw0, n, V, k)
                v1 = own(coarse, vw1, n + 1, V, k)
                v2 = own(coarse, vw2, n + 2, V, k)
                v3 = own(coarse, vw3, n + 3, V, k)
                a = s[HALF + k]
                rs[row + k] = rest_power(us[row + k], 1.0 + e * v0, a)
                rs[row + LANES + k] = rest_power(us[row + LANES + k], 1.0 + e * v1, a)
                rs[row + 2 * LANES + k] = rest_power(us[row + 2 * LANES + k], 1.0 + e * v2, a)
                rs[row + 3 * LANES + k] = rest_power(us[row + 3 * LANES + k], 1.0 + e * v3, a)
        for k in range(lanes):
            r0, r1 = rs[row + k], rs[row + LANES + k]
            r2, r3 = rs[row + 2 * LANES + k], rs[row + 3 * LANES + k]
            d = s[DECAY + k]
            s[REST_END + k] = d * (d * (d * (d * s[REST_END + k] + r0) + r1) + r2) + r3
            s[REST_SUM + k] += (r0 + r1) + (r2 + r3)
            most = max(max(abs(r0), abs(r1)), max(abs(r2), abs(r3)))
            s[REST_MOST + k] = max(s[REST_MOST + k], most)


@inlined
def iterate(
    kind: int, variable: bool, tolerance: float, period: float, lanes: int, coarse: Floats,
    s: Floats, us: Floats, rs: Floats, tops: Floats, lows: Floats,
) -> None:  # fmt: skip
    """Iterate r until every lane is frozen or given up; TURNS counts its passes.

    `tolerance` is for u, relative to its range.
    """
    nodes = coarse.shape[0]
    for i in range((nodes + 2 * PAD) * LANES):
        rs[i] = 0.0
    for k in range(lanes):
        s[START + k] = s[WORK_END + k] * s[CLOSED + k]
        s[SHIFT + k] = -s[LEVEL + k]
        s[FROZEN + k] = 0.0 if s[CODE + k] == 0.0 else 1.0
    for turn in range(MOST_PASSES):
        for k in range(lanes):
            s[RUNNING + k] = s[START + k]
            s[HIGH + k] = -1e300
            s[LOW + k] = 1e300
            s[CHANGE + k] = 0.0
            s[REST_END + k] = 0.0
            s[REST_SUM + k] = 0.0
            s[REST_MOST + k] = 0.0
        if variable:
            march_variable(lanes, coarse, s, us, rs, tops, lows)
        else:
            march_constant(lanes, coarse, s, us, rs, tops, lows)
        rest_of(kind, variable, lanes, coarse, s, us, rs)
        wrap(nodes, lanes, rs)
        running = 0.0
        for k in range(lanes):
            frozen = s[FROZEN + k]
            a, kappa, half = s[HALF + k], s[KAPPA + k], 0.5 * s[EXPONENT + k]
            mean = s[REST_SUM + k] / nodes
            level = -mean / a - s[ALIAS + k]
            turned = 1.0 + 0.5 * (half - 1.0) * (half - 2.0) * s[SQUARE_MEAN + k]
            moved = (level - s[LEVEL + k]) / turned
            most = max(s[HIGH + k], -s[LOW + k])
            reach = kappa * period / (2.0 * math.pi)
            rate = 2.0 * reach * s[REST_MOST + k] / most
            left = reach * s[REST_MOST + k]
            if turn > 0:
                rate = max(rate, s[CHANGE + k] / s[LAST + k])
                left = s[CHANGE + k] * rate / (1.0 - rate)
            # The closure's step is Newton's with a slope that is known up to the next moments.
            left += abs(moved) * (s[LOOSE + k] * (1.0 if variable else most) + reach * most)
            bound = tolerance * (s[HIGH + k] - s[LOW + k]) + 1e-15
            within = s[LOW + k] > DEEPEST and s[HIGH + k] < HIGHEST
            done = left <= bound and rate < 0.5
            # A frozen lane keeps its u; what it knows of itself stays too.
            s[MOVED + k] = moved if frozen == 0.0 else s[MOVED + k]
            s[LAST + k] = (s[CHANGE + k] if turn > 0 else 1e300) if frozen == 0.0 else s[LAST + k]
            s[TURNS + k] = turn + 1.0 if frozen == 0.0 else s[TURNS + k]
            stays = frozen != 0.0 or done or not within
            s[CODE + k] = LEFT if frozen == 0.0 and not within else s[CODE + k]
            s[START + k] = s[START + k] if stays else (
                (s[WORK_END + k] + s[SIGMA + k] * s[REST_END + k]) * s[CLOSED + k]
            )  # fmt: skip
            s[SHIFT + k] = s[SHIFT + k] if stays else s[ALIAS + k] - s[BENT + k] * mean
            s[LEVEL + k] = s[LEVEL + k] if stays else level
            s[FROZEN + k] = 1.0 if stays else 0.0
            running += 0.0 if stays else 1.0
        if running == 0.0:
            break
    for k in range(lanes):
        s[CODE + k] = LEFT if s[FROZEN + k] == 0.0 else s[CODE + k]
    wrap(nodes, lanes, us)


@inlined
def mean_speed(
    kind: int, variable: bool, lanes: int, coarse: Floats, s: Floats, us: Floats
) -> None:
    """Mean of sqrt(q), once u is known at the coarse nodes; exponent 1 has it from its closure."""
    nodes = coarse.shape[0]
    for k in range(lanes):
        s[MEAN + k] = 1.0 if kind == 1 else 0.0
    if kind == 1:
        return
    for group in range(nodes // CHUNK):
        n = CHUNK * group
        row = (n + PAD) * LANES
        vw0, vw1 = shared(coarse, n, V), shared(coarse, n + 1, V)
        vw2, vw3 = shared(coarse, n + 2, V), shared(coarse, n + 3, V)
        for k in range(lanes):
            moved = s[MOVED + k]
            u0, u1 = 1.0 + us[row + k], 1.0 + us[row + LANES + k]
            u2, u3 = 1.0 + us[row + 2 * LANES + k], 1.0 + us[row + 3 * LANES + k]
            if variable:
                eta = s[ETA + k]
                u0 += moved / (1.0 + eta * own(coarse, vw0, n, V, k))
                u1 += moved / (1.0 + eta * own(coarse, vw1, n + 1, V, k))
                u2 += moved / (1.0 + eta * own(coarse, vw2, n + 2, V, k))
                u3 += moved / (1.0 + eta * own(coarse, vw3, n + 3, V, k))
            else:
                u0 += moved
                u1 += moved
                u2 += moved
                u3 += moved
            s[MEAN + k] += (math.sqrt(u0) + math.sqrt(u1)) + (math.sqrt(u2) + math.sqrt(u3))
    for k in range(lanes):
        s[MEAN + k] = s[MEAN + k] / nodes + s[ALIAS_SPEED + k]


@inlined
def candidates(
    variable: bool, step: float, least_square: float, lanes: int, levels: Levels, s: Floats,
    tops: Floats, lows: Floats,
) -> None:  # fmt: skip
    """Where the extremes can be: TOP and BOTTOM get a chunk of nodes each, -1 for several.

    Between two nodes a curve exceeds the higher of them by no more than it rises above its chord.
    `tops` and `lows` become these bounds.
    """
    chunk, constants = levels.chunk, levels.constants
    for k in range(lanes):
        s[TOP + k] = -2.0
        s[BOTTOM + k] = -2.0
    for group in range(chunk.shape[0]):
        pa, pb = shared(chunk, group, P_ABOVE), shared(chunk, group, P_BELOW)
        va, vb = shared(chunk, group, V_ABOVE), shared(chunk, group, V_BELOW)
        row = group * LANES
        number = float(group)
        for k in range(lanes):
            p_above, p_below = own(chunk, pa, group, P_ABOVE, k), own(chunk, pb, group, P_BELOW, k)
            v_above, v_below = own(chunk, va, group, V_ABOVE, k), own(chunk, vb, group, V_BELOW, k)
            g, eta = s[GAS + k], s[ETA + k]
            slack = (
                0.125
                * step
                * step
                * s[BETA + k]
                * (
                    g * constant(constants, HIGHEST_SLOPE, k)
                    + eta * constant(constants, HIGHEST_SLOPE_V, k)
                )
            )
            thin = 1.0
            if variable:
                # q exceeds q* where e - q* tau does, which is linear in P and V.
                thin = 1.0 / (1.0 + eta * least_square)
                eta *= 1.0 + s[HIGH + k]
            top = tops[row + k] + thin * (g * p_above + eta * v_below + slack)
            low = lows[row + k] - thin * (g * p_below + eta * v_above + slack)
            tops[row + k] = top
            lows[row + k] = low
            s[TOP + k] = (
                (number if s[TOP + k] == -2.0 else -1.0) if top >= s[HIGH + k] else s[TOP + k]
            )
            s[BOTTOM + k] = (
                (number if s[BOTTOM + k] == -2.0 else -1.0) if low <= s[LOW + k] else s[BOTTOM + k]
            )


@inlined
def curve_at(
    p: float, v: float, ip: float, iv: float, dp: float, dv: float, t: float, variable: bool,
    turns: float, k: int, s: Floats,
) -> tuple[float, float]:  # fmt: skip
    """Return u and its slope at a fine node, t coarse intervals from the chosen coarse node.

    There y = beta I + w: the antiderivative I of X carries all that is not smooth, and the
    polynomial of fifth degree through w and its slopes at three coarse nodes the rest. `turns` is
    the number of coarse intervals in a radian.
    """
    g, eta, beta = s[GAS + k], s[ETA + k], s[BETA + k]
    c1, c2, c3, c4, c5 = s[C1 + k], s[C2 + k], s[C3 + k], s[C4 + k], s[C5 + k]
    x = g * p - eta * v
    y = beta * (g * ip - eta * iv)
    y += s[C0 + k] + t * (c1 + t * (c2 + t * (c3 + t * (c4 + t * c5))))
    dy = c1 + t * (2.0 * c2 + t * (3.0 * c3 + t * (4.0 * c4 + t * (5.0 * c5))))
    slope = g * dp - eta * dv - beta * x - dy * turns
    if variable:
        tau = 1.0 + eta * v
        u = (x - y) / tau
        return u, (slope - u * eta * dv) / tau
    return x - y, slope


@inlined
def end_at(
    p: float, v: float, ip: float, iv: float, dp: float, dv: float, u: float, r: float,
    variable: bool, g: float, eta: float, beta: float, a: float, kappa: float,
) -> tuple[float, float, float]:  # fmt: skip
    """Return w, its slope and (up to a positive factor) the slope of u at a coarse node."""
    tau = 1.0 + eta * v if variable else 1.0
    x = g * p - eta * v
    dy = kappa * (r + a * u * tau)
    slope = g * dp - eta * dv - dy
    if variable:
        slope -= u * eta * dv
    return x - u * tau - beta * (g * ip - eta * iv), dy - beta * x, slope


@inlined
def extreme_between(
    left: float, right: float, d_left: float, d_right: float, width: float, variable: bool,
    g: float, eta: float, mp: float, mv: float, v_left: float, v_right: float, dv_left: float,
    dv_right: float,
) -> tuple[float, float]:  # fmt: skip
    """Extreme of u between two fine nodes, and what the middle adds to it."""
    d_left *= width
    d_right *= width
    middle = g * mp - eta * mv
    if variable:
        # The middle of q from those of energy and inertia, both known; e = q tau.
        tau_left, tau_right = 1.0 + eta * v_left, 1.0 + eta * v_right
        turn_left, turn_right = width * eta * dv_left, width * eta * dv_right
        energy = g * mp + interpolate(
            0.5, (1.0 + left) * tau_left, (1.0 + right) * tau_right,
            d_left * tau_left + (1.0 + left) * turn_left,
            d_right * tau_right + (1.0 + right) * turn_right,
        )  # fmt: skip
        tau = eta * mv + interpolate(0.5, tau_left, tau_right, turn_left, turn_right)
        middle = energy / tau - 1.0 - interpolate(0.5, left, right, d_left, d_right)
    value, _, bump = refine(left, right, d_left, d_right, middle)
    return value, abs(bump)


@inlined
def take_fine(place: int, target: int, fields: int, k: int, fine: Floats, s: Floats) -> None:
    """Fields of a fine node into lane k of the rows from `target` on.

    A lane with a table of its own has it by interpolation in the crank ratio: the tables of the
    panel's ratios, weighted (`panels`).
    """
    if fine.ndim == 2:
        for field in range(fields):
            s[target + field * LANES + k] = fine[place, field]
    else:
        first, second, unit = int(s[ROW_TABLE + k]), int(s[NEXT_TABLE + k]), int(s[UNIT_TABLE + k])
        a, b, c = s[ROW_SHARE + k], s[NEXT_SHARE + k], s[CRANKCASE + k]
        here, after = fine[first, place], fine[second, place]
        under, squares = fine[unit, place], fine[unit + 1, place]
        w0, w1, w2 = s[POINT + k], s[POINT + LANES + k], s[POINT + 2 * LANES + k]
        w3, w4 = s[POINT + 3 * LANES + k], s[POINT + 4 * LANES + k]
        w5 = s[POINT + 5 * LANES + k]
        for pair in range(fields // 2):
            s[target + 2 * pair * LANES + k] = (
                w0 * (a * here[pair, 0] + b * after[pair, 0] - c * under[pair, 0])
                + w1 * (a * here[pair, 1] + b * after[pair, 1] - c * under[pair, 1])
                + w2 * (a * here[pair, 2] + b * after[pair, 2] - c * under[pair, 2])
                + w3 * (a * here[pair, 3] + b * after[pair, 3] - c * under[pair, 3])
                + w4 * (a * here[pair, 4] + b * after[pair, 4] - c * under[pair, 4])
                + w5 * (a * here[pair, 5] + b * after[pair, 5] - c * under[pair, 5])
            )
            s[target + (2 * pair + 1) * LANES + k] = (
                w0 * squares[pair, 0] + w1 * squares[pair, 1] + w2 * squares[pair, 2]
                + w3 * squares[pair, 3] + w4 * squares[pair, 4] + w5 * squares[pair, 5]
            )  # fmt: skip


@inlined
def take_node(
    node: int, variable: bool, rest: bool, ratio: int, levels: Levels, k: int, s: Floats,
    us: Floats, rs: Floats,
) -> None:  # fmt: skip
    """What is known at a coarse node and its two neighbours, into a lane of TAKEN.

    The recurrence takes X for a line between two coarse nodes; what its first moments differ from
    that is too little to matter but here.
    """
    fine, coarse = levels.fine, levels.coarse
    nodes = coarse.shape[0]
    for i in range(3):
        target = TAKEN + i * TAKEN_A_NODE * LANES + k
        take_fine(ratio * (node + i), target - k, 6, k, fine, s)
        row = (node + i + PAD - 1) * LANES + k
        here = node + i - 1
        here = here + nodes if here < 0 else (here - nodes if here >= nodes else here)
        moment = own(coarse, shared(coarse, here, P_MOMENT), here, P_MOMENT, k)
        turning = own(coarse, shared(coarse, here, V_MOMENT), here, V_MOMENT, k)
        bent = s[GAS + k] * moment - s[ETA + k] * turning
        moved = s[MOVED + k] - s[BETA + k] * s[BETA + k] * bent
        if variable:
            moved /= 1.0 + s[ETA + k] * s[target + LANES]
        s[target + 6 * LANES] = us[row] + moved
        s[target + 7 * LANES] = rs[row] if rest else 0.0
    # What the last Euler-Maclaurin term adds, twice, is above what the next one would.
    s[ROUGH + k] = 0.0
    if rest:
        row = (node + PAD) * LANES + k
        near, far = rs[row + LANES] - rs[row - LANES], rs[row + 2 * LANES] - rs[row - 2 * LANES]
        s[ROUGH + k] = 2.0 * abs(22.0 / 82.0 * s[EULER + k] * near - s[EULER_FAR + k] * far)


@inlined
def chosen_node(upward: float, bound: int, k: int, s: Floats, us: Floats, bounds: Floats) -> int:
    """Coarse node beside the extreme of a lane, -1 where several hills may hold it."""
    group = int(s[bound + k])
    if group < 0:
        return -1
    row = (CHUNK * group + PAD) * LANES + k
    best, node = -1e300, 0
    for i in range(CHUNK):
        u = upward * us[row + i * LANES]
        if u > best:
            best, node = u, i
    # Another hill in the same chunk, high enough to be the one?
    near = 2.0 * best - upward * bounds[group * LANES + k]
    for i in range(CHUNK):
        here = row + i * LANES
        u = upward * us[here]
        if (
            (i > node + 1 or i < node - 1)
            and u >= near
            and u > upward * us[here - LANES]
            and u >= upward * us[here + LANES]
        ):
            return -1
    return CHUNK * group + node


@inlined
def bracket(upward: float, variable: bool, step: float, ratio: int, lanes: int, s: Floats) -> None:
    """From what TAKEN holds of three coarse nodes to the interval that holds the extreme.

    C0 to C5 get the polynomial of w, AT the interval's first fine node, counted from the chosen
    coarse one; ENDED says that this node itself is the extreme.
    """
    for k in range(lanes):
        g, eta, beta, a, kappa = s[GAS + k], s[ETA + k], s[BETA + k], s[HALF + k], s[KAPPA + k]
        here = TAKEN + k
        w0, d0, s0 = end_at(
            s[here], s[here + LANES], s[here + 2 * LANES], s[here + 3 * LANES],
            s[here + 4 * LANES], s[here + 5 * LANES], s[here + 6 * LANES], s[here + 7 * LANES],
            variable, g, eta, beta, a, kappa,
        )  # fmt: skip
        here = TAKEN + TAKEN_A_NODE * LANES + k
        w1, d1, s1 = end_at(
            s[here], s[here + LANES], s[here + 2 * LANES], s[here + 3 * LANES],
            s[here + 4 * LANES], s[here + 5 * LANES], s[here + 6 * LANES], s[here + 7 * LANES],
            variable, g, eta, beta, a, kappa,
        )  # fmt: skip
        here = TAKEN + 2 * TAKEN_A_NODE * LANES + k
        w2, d2, s2 = end_at(
            s[here], s[here + LANES], s[here + 2 * LANES], s[here + 3 * LANES],
            s[here + 4 * LANES], s[here + 5 * LANES], s[here + 6 * LANES], s[here + 7 * LANES],
            variable, g, eta, beta, a, kappa,
        )  # fmt: skip
        d0 *= step
        d1 *= step
        d2 *= step
        even, odd = 0.5 * (w2 + w0) - w1, 0.5 * (w2 - w0) - d1
        even_slope, odd_slope = 0.5 * (d2 - d0), 0.5 * (d2 + d0) - d1
        fourth, fifth = 0.5 * even_slope - even, 0.5 * odd_slope - 1.5 * odd
        s[C0 + k] = w1
        s[C1 + k] = d1
        s[C2 + k] = even - fourth
        s[C3 + k] = odd - fifth
        s[C4 + k] = fourth
        s[C5 + k] = fifth
        ahead = s1 * upward > 0.0
        begins = (s1 if ahead else s0) * upward > 0.0
        ends = (s2 if ahead else s1) * upward < 0.0
        s[AT + k] = 0.0 if ahead else -1.0 * ratio
        s[BASE + k] = ratio * (s[NODE + k] + 1.0)
        s[ENDED + k] = 0.0 if begins and ends else 1.0


@inlined
def search(
    upward: float, variable: bool, step: float, ratio: int, lanes: int, fine: Floats, s: Floats
) -> None:
    """Bisect the interval of every lane down to two neighbouring fine nodes."""
    share, turns = 1.0 / ratio, 1.0 / step
    half = ratio // 2
    while half > 0:
        for k in range(LANES):
            place = int(s[BASE + k] + s[AT + k]) + half
            take_fine(place, TAKEN, 6, k, fine, s)
        for k in range(lanes):
            _, slope = curve_at(
                s[TAKEN + k], s[TAKEN + LANES + k], s[TAKEN + 2 * LANES + k],
                s[TAKEN + 3 * LANES + k], s[TAKEN + 4 * LANES + k], s[TAKEN + 5 * LANES + k],
                (s[AT + k] + half) * share, variable, turns, k, s,
            )  # fmt: skip
            s[AT + k] += half if slope * upward > 0.0 else 0.0
        half //= 2


@inlined
def next_hill(
    upward: float, after: int, nodes: int, k: int, s: Floats, us: Floats, bounds: Floats
) -> int:
    """Next coarse node of a lane, behind `after`, whose hill may hold the extreme; -1: no more."""
    best = s[HIGH + k] if upward > 0.0 else -s[LOW + k]
    for node in range(after + 1, nodes):
        row = (node + PAD) * LANES + k
        u = upward * us[row]
        # One node a hill: the first of equals.
        if (
            upward * bounds[node // CHUNK * LANES + k] >= best
            and u > upward * us[row - LANES]
            and u >= upward * us[row + LANES]
        ):
            return node
    return -1


@inlined
def peaks_near(
    upward: float, variable: bool, rest: bool, step: float, ratio: int, lanes: int, levels: Levels,
    s: Floats, us: Floats, rs: Floats,
) -> None:  # fmt: skip
    """PEAK and MISS of every lane get the extreme beside NODE where it is more than they hold."""
    fine = levels.fine
    for k in range(LANES):
        take_node(int(s[NODE + k]), variable, rest, ratio, levels, k, s, us, rs)
    second = TAKEN + TAKEN_A_NODE * LANES
    for k in range(lanes):
        s[AT_NODE + k] = s[second + 6 * LANES + k]
    bracket(upward, variable, step, ratio, lanes, s)
    search(upward, variable, step, ratio, lanes, fine, s)
    for k in range(LANES):
        place = int(s[BASE + k] + s[AT + k])
        take_fine(place, TAKEN, 8, k, fine, s)
        take_fine(place + 1, second, 8, k, fine, s)
    share, turns = 1.0 / ratio, 1.0 / step
    for k in range(lanes):
        g, eta = s[GAS + k], s[ETA + k]
        left, d_left = curve_at(
            s[TAKEN + k], s[TAKEN + LANES + k], s[TAKEN + 2 * LANES + k],
            s[TAKEN + 3 * LANES + k], s[TAKEN + 4 * LANES + k], s[TAKEN + 5 * LANES + k],
            s[AT + k] * share, variable, turns, k, s,
        )  # fmt: skip
        right, d_right = curve_at(
            s[second + k], s[second + LANES + k], s[second + 2 * LANES + k],
            s[second + 3 * LANES + k], s[second + 4 * LANES + k], s[second + 5 * LANES + k],
            (s[AT + k] + 1.0) * share, variable, turns, k, s,
        )  # fmt: skip
        value, bump = extreme_between(
            left, right, d_left, d_right, step * share, variable, g, eta,
            s[TAKEN + 6 * LANES + k], s[TAKEN + 7 * LANES + k], s[TAKEN + LANES + k],
            s[second + LANES + k], s[TAKEN + 5 * LANES + k], s[second + 5 * LANES + k],
        )  # fmt: skip
        # Rounding can leave both slopes of one sign; then the higher node is the extreme.
        between = d_left * upward > 0.0 and d_right * upward < 0.0
        node = upward * max(upward * left, upward * right)
        value = value if between else node
        bump = bump if between else 0.0
        ended = s[ENDED + k] != 0.0
        value = s[AT_NODE + k] if ended else value
        bump = s[ROUGH + k] + (0.0 if ended else bump)
        more = upward * value > upward * s[PEAK + k]
        s[PEAK + k] = value if more else s[PEAK + k]
        s[MISS + k] = bump if more else s[MISS + k]


@inlined
def peaks(
    upward: float, variable: bool, rest: bool, step: float, ratio: int, lanes: int, levels: Levels,
    s: Floats, us: Floats, rs: Floats, bounds: Floats,
) -> None:  # fmt: skip
    """Largest (upward = 1) or smallest (-1) u of every lane, in PEAK, and the middle's share.

    Lanes with several hills take one after the other; the rest repeat what they have.
    """
    nodes = us.size // LANES - 2 * PAD
    bound = TOP if upward > 0.0 else BOTTOM
    several = False
    for k in range(LANES):
        s[PEAK + k] = -1e300 * upward
        node = chosen_node(upward, bound, k, s, us, bounds)
        s[HILLS + k] = 0.0
        if node < 0:
            node = next_hill(upward, -1, nodes, k, s, us, bounds)
            s[HILLS + k] = 1.0
            several = several or s[CODE + k] == 0.0
        if node < 0:
            s[CODE + k] = s[CODE + k] if s[CODE + k] != 0.0 else LEFT
            node = 0
        s[NODE + k] = node
    while True:
        peaks_near(upward, variable, rest, step, ratio, lanes, levels, s, us, rs)
        if not several:
            break
        several = False
        for k in range(LANES):
            if s[HILLS + k] != 0.0 and s[CODE + k] == 0.0:
                node = next_hill(upward, int(s[NODE + k]), nodes, k, s, us, bounds)
                if node >= 0:
                    s[NODE + k] = node
                    several = True
        if not several:
            break


@inlined
def extremes(
    variable: bool, rest: bool, step: float, ratio: int, lanes: int, levels: Levels, s: Floats,
    us: Floats, rs: Floats, tops: Floats, lows: Floats,
) -> None:  # fmt: skip
    """TOP and BOTTOM become the largest and smallest speed over nominal, ERROR what they miss."""
    peaks(1.0, variable, rest, step, ratio, lanes, levels, s, us, rs, tops)
    for k in range(lanes):
        s[TOP + k] = math.sqrt(1.0 + s[PEAK + k])
        s[ERROR + k] = 0.5 * s[MISS + k] / s[TOP + k]
    peaks(-1.0, variable, rest, step, ratio, lanes, levels, s, us, rs, lows)
    for k in range(lanes):
        high, low = s[TOP + k], math.sqrt(1.0 + s[PEAK + k])
        s[BOTTOM + k] = low
        error = (s[ERROR + k] + 0.5 * s[MISS + k] / low + ROUNDING) / (high - low)
        s[ERROR + k] = error if high > low else 0.0
