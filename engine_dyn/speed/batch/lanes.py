"""Periodic speed of LANES designs at a time, as SIMD lanes over one table.

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
geometric mean to close; else r is iterated, and converges by a factor of about kappa u a pass:
`march` solves the linear part once, and each pass takes off what r has changed by since the last
one, by the recurrence with that for its only input (`answer`). How far this moves r is taken to
first order, which tells whether another pass is needed and closes the last one.

Lanes never exchange anything: a lane whose u no longer changes keeps it ("frozen"), blocks are
filled up by repeating a design, and every sum runs in a fixed order, so a design's numbers cannot
depend on its neighbours. What leaves the range of this method (a load that is strong over one
interval, a speed that falls or rises by much, a torque within rounding of idle) is not answered
here but deferred to the general solver.
"""

from __future__ import annotations

import math

from engine_dyn.compilation import formula, inlined, on_stack, wide_vectors
from engine_dyn.speed.batch.levels import (
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
    ALIASED,
    CHUNK,
    CUBES,
    FOURTHS,
    LARGEST_STEP,
    MOST_IN_SERIES,
    PP,
    PV,
    SQUARES,
    SQUARES_SERIES,
    VV,
    WORK,
    WORK_SERIES,
    Levels,
    P,
    V,
)
from engine_dyn.types import Floats, Integers

__all__ = [
    "CONSTANT",
    "FIELDS",
    "FREE",
    "LANES",
    "LEFT",
    "LINEAR",
    "MOST_NODES",
    "NUMBERS",
    "PAD",
    "POWER",
    "ROOT",
    "SQUARE",
    "VARIABLE",
    "clear",
    "end_of_work",
    "iterate",
    "mean_speed",
    "prepare",
    "rescale",
    "solve_free",
    "solve_linear",
]

Form = tuple[int, ...]
Inertia = tuple[int, ...]

LANES = 32
"""Designs of a block, a power of two. Several vectors: what one waits for is done for another, and
a loop's start and end count less. 64 are 3 to 5 % faster still, but with the steepest diagrams
they would take two megabytes of the stack, which is all that some systems have."""

LINEAR, FREE, ROOT, SQUARE, POWER = (0,), (0, 0), (0,) * 3, (0,) * 4, (0,) * 5
"""What solves a block, its form, told by length: the compiler leaves the others out, and compiles
what a scene needs only. LINEAR: exponent 2 with constant inertia, FREE: exponent 0; the others
iterate: ROOT exponent 1, SQUARE exponent 2 with variable inertia, POWER any."""

CONSTANT, VARIABLE = (0,), (0, 0)
"""Whether the inertia of a block varies over the crank angle, told by length for the same sake."""

PAD = 2
"""Rows beside the first and the last node: the period again."""

MOST_NODES = 1024
"""Most coarse nodes of a period, before they are rounded up: a block's u and r are on the stack."""

# Numbers of a design, one row of lanes each.
SERIES_TERMS = 11
FIELDS = 72
(
    BORE, STROKE, MASS, NOMINAL, INERTIA, EXPONENT, OFFSET, MEAN_TORQUE,
    GAS, ETA, KAPPA, HALF, BETA, DECAY, GAS_WORK, ETA_WORK, GAS_HERE, ETA_HERE, RHO, SIGMA, EULER,
    EULER_FAR, CLOSED, ALIAS, ALIAS_SPEED, SQUARE_MEAN, LEVEL, BENT, SHIFT, START, WORK_END,
    REST_END, RUNNING, HIGH, LOW, CHANGE, LAST, REST_SUM, FROZEN, CODE, MEAN, MOVED, TOP,
    BOTTOM, TOP_LAST, BOTTOM_LAST, PEAK, MISS, WIDE, ERROR, ROW_TABLE, NEXT_TABLE, SWING,
    LOOSE, TURNS, FIRST_SUM, SPEED_SUM, SLACK, THIN,
    TOP_HILLS, BOTTOM_HILLS, PRODUCT, TOP_RIPPLE, BOTTOM_RIPPLE, TOP_TILT, BOTTOM_TILT, MOVING,
    MOVES, KEEPS, MORE, ENERGY_SCALE, SCALE_MOVES,
) = (row * LANES for row in range(FIELDS))  # fmt: skip

NUMBERS = FIELDS * LANES
"""Numbers of a block, all rows."""

SERIES_ROWS = SERIES_TERMS * LANES
"""Memory for the coefficients of q^a from u^2 on."""

LEFT = -1.0
"""Code of a design that is left to the general method."""

NO_LOAD = 1e-30
"""Smallest kappa: its solution is that without load to rounding, and nothing divides by zero."""

DEEPEST, HIGHEST = -0.5, 1.0
"""Range of u in which the series of the logarithm has converged."""

SERIES_RANGE = 0.2
"""Largest u of a design whose powers are series in u, cheaper than roots and logarithms. Designs
decide each for themselves: neighbours must not count."""

MOST_PASSES = 10

FREE_STEP = 1e-3
"""Largest step of the closure that its first two derivatives give to rounding."""

MOST_SCALES, SCALE_STEP = 8, 1e-9
"""Solutions of the power mean at most on the way to a cycle time, and the step of the energy scale
at which it is found."""

LARGEST_ALIAS = 1e-3
"""Largest share of a table that the coarse level may see wrongly; of usual ones it is 1e-4."""

SMALLEST_HALF, LARGEST_HALF = 1e-4, 8.0
"""Range of a: below it the closure -mean(r)/a loses its digits, above it `exp_of` does not hold."""


@inlined
def clear(
    s: Floats, changes: Floats, us: Floats, rs: Floats, tops: Floats, lows: Floats,
    chosen: Integers,
) -> None:  # fmt: skip
    """Fill the memory of a block with zeros, once a kernel."""
    for rows in (s, changes, us, rs, tops, lows):
        for i in range(rows.size):
            rows[i] = 0.0
    for k in range(chosen.size):
        chosen[k] = 0


@formula
def shared(table: Floats, node: int, field: int) -> float:
    """Value of a table that the lanes share, to be read before the loop over them."""
    if table.ndim == 2:
        return table[node, field]
    return 0.0


@formula
def own(table: Floats, common: float, node: int, field: int, k: int) -> float:
    """Value of a lane: what `shared` read, or that of its own table (node, field, lane).

    Which of both is known when this is compiled: Numba prunes the branch by the dimensions.
    """
    if table.ndim == 2:
        return common
    return table[node, field, k]


@formula
def constant(constants: Floats, index: int, k: int) -> float:
    """Return a constant of the lanes' table, or of a lane's own (constant, lane)."""
    if constants.ndim == 1:
        return constants[index]
    return constants[index, k]


@formula
def loss_of(x: float) -> float:
    """1 - exp(-x) for x up to 0.1, to rounding, without the library's call."""
    return x * (1.0 - x / 2.0 * (1.0 - x / 3.0 * (1.0 - x / 4.0 * (1.0 - x / 5.0 * (
        1.0 - x / 6.0 * (1.0 - x / 7.0 * (1.0 - x / 8.0)))))))  # fmt: skip


@formula
def log_of(u: float) -> float:
    """log(1 + u) for u from -0.5 to 1, to 2e-13: the series of the inverse tangent."""
    s = u / (2.0 + u)
    t = s * s
    return 2.0 * s * (1.0 + t * (1.0 / 3.0 + t * (1.0 / 5.0 + t * (1.0 / 7.0 + t * (1.0 / 9.0
        + t * (1.0 / 11.0 + t * (1.0 / 13.0 + t * (1.0 / 15.0 + t * (1.0 / 17.0 + t * (
            1.0 / 19.0 + t * (1.0 / 21.0 + t / 23.0)))))))))))  # fmt: skip


# Polynomials through Chebyshev's points of |u| <= SERIES_RANGE: fewer terms than Taylor's series.


@formula
def root_series(u: float) -> float:
    """sqrt(1 + u) - 1 - u/2 for |u| up to SERIES_RANGE, to 2e-10."""
    t = -0.013766597627549452
    t = 0.016906002491926194 + u * t
    t = -0.020494166543278344 + u * t
    t = 0.027327718813054118 + u * t
    t = -0.03906256848919286 + u * t
    t = 0.06250008045206959 + u * t
    t = -0.125 + u * t
    return u * u * t


@formula
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


@formula
def alias(
    b: float, logarithm: bool, variable: bool, first: bool, g: float, eta: float, c: Floats
) -> float:
    """Mean of q^b, or log q, over the fine less that over the coarse nodes, without the load.

    Taylor's series to fourth order in X, or in g P and eta V; `first` says whether the first order
    counts. `c` are the table's constants.
    """
    # q^b = (1 + g P)^b (1 + eta V)^-b with variable inertia, else (1 + g P - eta V)^b.
    b1, b2 = b, 0.5 * b * (b - 1.0)
    b3 = b2 * (b - 2.0) / 3.0
    b4 = b3 * (b - 3.0) * 0.25
    n1, n2 = -b, 0.5 * b * (b + 1.0)
    n3 = -n2 * (b + 2.0) / 3.0
    n4 = -n3 * (b + 3.0) * 0.25
    m11, m21, m12, m31, m22, m13 = b1 * n1, b2 * n1, b1 * n2, b3 * n1, b2 * n2, b1 * n3
    if logarithm:
        b1, b2, b3, b4 = 1.0, -0.5, 1.0 / 3.0, -0.25
        n1, n2, n3, n4 = -1.0, 0.5, -1.0 / 3.0, 0.25
        m11 = m21 = m12 = m31 = m22 = m13 = 0.0
    if not variable:
        n1, n2, n3, n4 = b1, b2, b3, b4
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
    return total + (b1 * g * c[ALIAS_P] + n1 * e * c[ALIAS_V] if first else 0.0)


@formula
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
def prepare(
    form: Form, inertia: Inertia, step: float, nodes: int, swing_shape: float,
    least_square: float, idle: float, no_steady_state: float, invalid: float, constants: Floats,
    lanes: int, s: Floats,
) -> None:  # fmt: skip
    """Reduced parameters, weights of the recurrence and a first level, from the inputs in `s`."""
    wide_vectors()
    variable = len(inertia) == 2
    free = len(form) == 2
    for k in range(lanes):
        radius = 0.5 * s[STROKE + k]
        lever = 0.25 * math.pi * s[BORE + k] * s[BORE + k] * radius
        throw = s[MASS + k] * radius * radius
        square = s[NOMINAL + k] * s[NOMINAL + k]
        # Divisions take as long as ten multiplications: one for two.
        inverse = 1.0 / (s[INERTIA + k] * square * s[ENERGY_SCALE + k])
        per_energy = 2.0 * inverse
        surplus = s[MEAN_TORQUE + k] - s[OFFSET + k]
        swing = idle * (lever * s[SWING + k] + throw * square * swing_shape)
        g = lever * per_energy
        eta = throw * (inverse * square)
        if variable:  # the inertia has no energy scale
            eta *= s[ENERGY_SCALE + k]
        half = 0.5 * s[EXPONENT + k] if not free else 0.0
        a = half if not free else 1.0
        kappa = surplus * per_energy if not free else 0.0
        per_half = 1.0 / a
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
        kappa = kappa if x <= LARGEST_STEP else LARGEST_STEP / step * per_half
        x = x if x <= LARGEST_STEP else LARGEST_STEP
        loss = loss_of(x)
        # 1 - d^N by doubling of expm1
        whole = -loss_of(x * nodes / 64.0)
        for _ in range(6):
            whole *= 2.0 + whole
        square_of_step = 1.0 + x * x / 12.0
        inverse = 1.0 / (square_of_step * whole)
        bent = inverse * whole
        decay = 1.0 - loss
        rho = 0.5 * loss * per_half
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
        s[CLOSED + k] = -inverse * square_of_step
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
        s[BENT + k] = kappa * step * x / 6.0
        s[FROZEN + k] = 0.0
        s[TURNS + k] = 1.0
        s[MOVED + k] = 0.0
        s[LAST + k] = 1e300
    for k in range(lanes):
        g, eta, a = s[GAS + k], s[ETA + k], s[HALF + k]
        if constants.ndim == 2:
            linear = g * constants[ALIAS_P, k] - eta * constants[ALIAS_V, k]
            s[ALIAS + k] = linear if free else 0.0
            s[ALIAS_SPEED + k] = 0.5 * linear
        else:
            # Exponent 0 has the logarithm for its power, and a = 1.
            s[ALIAS + k] = alias(a, free, variable, free, g, eta, constants) / a
            s[ALIAS_SPEED + k] = alias(0.5, False, variable, True, g, eta, constants)
    if len(form) == 2:
        for k in range(lanes):
            s[LEVEL + k] = level_without_load(variable, s[GAS + k], s[ETA + k], constants, k)


@formula
def work_series(t: float, first: int, constants: Floats) -> float:
    """Polynomial of SERIES_OF_WORK coefficients from constant `first` on."""
    total = constants[first + 15]
    total = constants[first + 14] + t * total
    total = constants[first + 13] + t * total
    total = constants[first + 12] + t * total
    total = constants[first + 11] + t * total
    total = constants[first + 10] + t * total
    total = constants[first + 9] + t * total
    total = constants[first + 8] + t * total
    total = constants[first + 7] + t * total
    total = constants[first + 6] + t * total
    total = constants[first + 5] + t * total
    total = constants[first + 4] + t * total
    total = constants[first + 3] + t * total
    total = constants[first + 2] + t * total
    total = constants[first + 1] + t * total
    total = constants[first + 0] + t * total
    return total


@inlined
def end_of_work(step: float, lanes: int, coarse: Floats, constants: Floats, s: Floats) -> None:
    """End of the linear recurrence over one period from zero: only the work of X drives it.

    By the table's polynomial in beta h, if it has one.
    """
    wide_vectors()
    if constants.ndim == 1 and coarse.shape[0] <= MOST_IN_SERIES:
        for k in range(lanes):
            t = 2.0 / LARGEST_STEP * step * s[BETA + k] - 1.0
            work = work_series(t, WORK_SERIES, constants)
            squares = work_series(t, SQUARES_SERIES, constants)
            s[WORK_END + k] = s[GAS_WORK + k] * work - s[ETA_WORK + k] * squares
        return
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
    wide_vectors()
    for i in range(PAD):
        before, last = rows[i * LANES : (i + 1) * LANES], rows[(nodes + i) * LANES :]
        first, behind = rows[(PAD + i) * LANES :], rows[(nodes + PAD + i) * LANES :]
        for k in range(lanes):
            before[k] = last[k]
        for k in range(lanes):
            behind[k] = first[k]


@inlined
def beyond_series(lanes: int, s: Floats) -> bool:
    """Mark the lanes in WIDE for which series do not hold; return whether there are any."""
    wide_vectors()
    count = 0.0
    for k in range(lanes):
        wide = max(s[HIGH + k], -s[LOW + k]) > SERIES_RANGE
        s[WIDE + k] = 1.0 if wide else 0.0
        count += s[WIDE + k]
    return count > 0.0


@inlined
def exact_mean(inertia: Inertia, lanes: int, coarse: Floats, s: Floats, us: Floats) -> None:
    """MEAN of the lanes in WIDE: the sum of sqrt(q) - 1 over the coarse nodes by roots."""
    wide_vectors()
    for k in range(lanes):
        s[MEAN + k] = 0.0 if s[WIDE + k] != 0.0 else s[MEAN + k]
    for n in range(coarse.shape[0]):
        vw = shared(coarse, n, V)
        row = (n + PAD) * LANES
        for k in range(lanes):
            turn = s[ETA + k] if len(inertia) == 2 else 0.0
            q = 1.0 + us[row + k] + s[MOVED + k] / (1.0 + turn * own(coarse, vw, n, V, k))
            s[MEAN + k] += math.sqrt(q) - 1.0 if s[WIDE + k] != 0.0 else 0.0


@formula
def inverses(a: float, b: float, c: float, d: float) -> tuple[float, float, float, float]:
    """One division for four: the inverse of each is that of all times the other three."""
    first, second = a * b, c * d
    inverse = 1.0 / (first * second)
    after, before = inverse * second, inverse * first
    return after * b, after * a, before * d, before * c


@formula
def march(
    form: Form, inertia: Inertia, lanes: int, coarse: Floats, s: Floats, us: Floats,
    tops: Floats, lows: Floats,
) -> None:  # fmt: skip
    """Speeds u at the coarse nodes by the linear recurrence, less SHIFT.

    Of form LINEAR, which has no shift, that is all, and the mean speed is summed up on the way.
    Else it is all but what the rest adds, see `answer`.
    """
    wide_vectors()
    for k in range(lanes):
        s[RUNNING + k] = s[WORK_END + k] * s[CLOSED + k]
        s[MEAN + k] = 0.0
        s[HIGH + k] = -1e300
        s[LOW + k] = 1e300
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
            y, shift = s[RUNNING + k], s[SHIFT + k] if len(form) > 2 else 0.0
            u0 = (gas * p0 - shift) - eta * v0 - y
            y = d * y + (g * a0 - e * b0)
            u1 = (gas * p1 - shift) - eta * v1 - y
            y = d * y + (g * a1 - e * b1)
            u2 = (gas * p2 - shift) - eta * v2 - y
            y = d * y + (g * a2 - e * b2)
            u3 = (gas * p3 - shift) - eta * v3 - y
            s[RUNNING + k] = d * y + (g * a3 - e * b3)
            if len(inertia) == 2:
                turn = s[ETA + k]
                t0, t1, t2, t3 = inverses(
                    1.0 + turn * v0, 1.0 + turn * v1, 1.0 + turn * v2, 1.0 + turn * v3
                )  # fmt: skip
                u0, u1, u2, u3 = u0 * t0, u1 * t1, u2 * t2, u3 * t3
            us[row + k] = u0
            us[row + LANES + k] = u1
            us[row + 2 * LANES + k] = u2
            us[row + 3 * LANES + k] = u3
            high = max(max(u0, u1), max(u2, u3))
            low = min(min(u0, u1), min(u2, u3))
            # Not the larger of what is stored and another: where one of two is in its place already
            # the compiler stores under a mask, and what loads it next has to wait.
            s[HIGH + k] = max(max(s[HIGH + k], max(u0, u1)), max(u2, u3))
            s[LOW + k] = min(min(s[LOW + k], min(u0, u1)), min(u2, u3))
            if len(form) == 1:
                tops[bound + k] = high
                lows[bound + k] = low
                roots = (root_series(u0) + root_series(u1)) + (root_series(u2) + root_series(u3))
                s[MEAN + k] += roots
                s[MEAN + k] += 0.5 * ((u0 + u1) + (u2 + u3))


@inlined
def solve_linear(
    form: Form, lanes: int, coarse: Floats, s: Floats, us: Floats, tops: Floats,
    lows: Floats,
) -> None:  # fmt: skip
    """Exponent 2, constant inertia: u at the coarse nodes, and the mean speed, in one pass."""
    wide_vectors()
    nodes = coarse.shape[0]
    march(form, CONSTANT, lanes, coarse, s, us, tops, lows)
    wrap(nodes, lanes, us)
    if beyond_series(lanes, s):
        exact_mean(CONSTANT, lanes, coarse, s, us)
    for k in range(lanes):
        # The mean speed is where the coarse nodes see wrongly, and it is corrected by series.
        within = s[LOW + k] > DEEPEST and s[HIGH + k] < HIGHEST
        s[CODE + k] = s[CODE + k] if within or s[CODE + k] != 0.0 else LEFT
        s[MEAN + k] = 1.0 + s[MEAN + k] / nodes + s[ALIAS_SPEED + k]


@inlined
def solve_free(
    inertia: Inertia, lanes: int, coarse: Floats, s: Floats, us: Floats, tops: Floats, lows: Floats
) -> None:
    """Exponent 0: u at the coarse nodes, and the mean speed, in one pass.

    No load term: u = X + c, or e/tau - 1 with variable inertia, with the constant c from the
    moments of the table. The mean of log q over the nodes, the logarithm of their product, is what
    these leave of the closure; its first two derivatives give the step that is still to be made,
    MOVED. The first is the mean of 1/(q tau), summed four nodes over one denominator.
    """
    wide_vectors()
    nodes = coarse.shape[0]
    for k in range(lanes):
        s[HIGH + k] = -1e300
        s[LOW + k] = 1e300
        s[PRODUCT + k] = 1.0
        s[FIRST_SUM + k] = 0.0
        s[SPEED_SUM + k] = 0.0
        s[MEAN + k] = 0.0
    for group in range(nodes // CHUNK):
        n = CHUNK * group
        pw0, pw1 = shared(coarse, n, P), shared(coarse, n + 1, P)
        pw2, pw3 = shared(coarse, n + 2, P), shared(coarse, n + 3, P)
        vw0, vw1 = shared(coarse, n, V), shared(coarse, n + 1, V)
        vw2, vw3 = shared(coarse, n + 2, V), shared(coarse, n + 3, V)
        row, bound = (n + PAD) * LANES, group * LANES
        for k in range(lanes):
            v0, v1 = own(coarse, vw0, n, V, k), own(coarse, vw1, n + 1, V, k)
            v2, v3 = own(coarse, vw2, n + 2, V, k), own(coarse, vw3, n + 3, V, k)
            gas, eta, level = s[GAS + k], s[ETA + k], s[LEVEL + k]
            u0 = level + gas * own(coarse, pw0, n, P, k) - eta * v0
            u1 = level + gas * own(coarse, pw1, n + 1, P, k) - eta * v1
            u2 = level + gas * own(coarse, pw2, n + 2, P, k) - eta * v2
            u3 = level + gas * own(coarse, pw3, n + 3, P, k) - eta * v3
            w0, w1, w2, w3 = 1.0 + u0, 1.0 + u1, 1.0 + u2, 1.0 + u3
            if len(inertia) == 2:
                t0, t1, t2, t3 = 1.0 + eta * v0, 1.0 + eta * v1, 1.0 + eta * v2, 1.0 + eta * v3
                # One division for four: the inverse of each is that of all times the other three.
                first, second = t0 * t1, t2 * t3
                inverse = 1.0 / (first * second)
                after, before = inverse * second, inverse * first
                w0, w1, w2, w3 = w0 + eta * v0, w1 + eta * v1, w2 + eta * v2, w3 + eta * v3
                u0, u1 = u0 * (after * t1), u1 * (after * t0)
                u2, u3 = u2 * (before * t3), u3 * (before * t2)
                s[PRODUCT + k] *= inverse
            pair, other = w0 * w1, w2 * w3
            whole = pair * other
            s[PRODUCT + k] *= whole
            share = 1.0 / whole
            s[FIRST_SUM + k] += share * ((w0 + w1) * other + (w2 + w3) * pair)
            r0, r1, r2, r3 = root_series(u0), root_series(u1), root_series(u2), root_series(u3)
            r0, r1, r2, r3 = r0 + 0.5 * u0, r1 + 0.5 * u1, r2 + 0.5 * u2, r3 + 0.5 * u3
            s[MEAN + k] += (r0 + r1) + (r2 + r3)
            left = (1.0 + r0) * w1 + (1.0 + r1) * w0
            right = (1.0 + r2) * w3 + (1.0 + r3) * w2
            s[SPEED_SUM + k] += share * (left * other + right * pair)
            us[row + k] = u0
            us[row + LANES + k] = u1
            us[row + 2 * LANES + k] = u2
            us[row + 3 * LANES + k] = u3
            high = max(max(u0, u1), max(u2, u3))
            low = min(min(u0, u1), min(u2, u3))
            tops[bound + k] = high
            lows[bound + k] = low
            # Nested as in `march`.
            s[HIGH + k] = max(max(s[HIGH + k], max(u0, u1)), max(u2, u3))
            s[LOW + k] = min(min(s[LOW + k], min(u0, u1)), min(u2, u3))
    wrap(nodes, lanes, us)
    for k in range(lanes):
        mean = log_of(s[PRODUCT + k] - 1.0) / nodes + s[ALIAS + k]
        first = s[FIRST_SUM + k] / nodes
        step = -mean / first
        # The second derivative is some 1 + mean(u^2) times the square of the first.
        bent = first * (1.0 + s[SQUARE_MEAN + k])
        moved = step + 0.5 * bent * step * step
        s[MOVED + k] = moved
        within = s[LOW + k] > DEEPEST and s[HIGH + k] < HIGHEST and abs(moved) < FREE_STEP
        within = within and abs(s[PRODUCT + k] - 1.0) < -DEEPEST
        s[CODE + k] = s[CODE + k] if within or s[CODE + k] != 0.0 else LEFT
        s[MEAN + k] += 0.5 * moved * s[SPEED_SUM + k]
    if beyond_series(lanes, s):
        exact_mean(inertia, lanes, coarse, s, us)
    for k in range(lanes):
        s[MEAN + k] = 1.0 + s[MEAN + k] / nodes + s[ALIAS_SPEED + k]


@formula
def rest_series(u: float, k: int, series: Floats) -> float:
    """(1 + u)^a - 1 - a u for |u| up to SERIES_RANGE, to 1e-11, from its coefficients."""
    total = series[10 * LANES + k]
    total = series[9 * LANES + k] + u * total
    total = series[8 * LANES + k] + u * total
    total = series[7 * LANES + k] + u * total
    total = series[6 * LANES + k] + u * total
    total = series[5 * LANES + k] + u * total
    total = series[4 * LANES + k] + u * total
    total = series[3 * LANES + k] + u * total
    total = series[2 * LANES + k] + u * total
    total = series[LANES + k] + u * total
    return u * u * (series[k] + u * total)


@formula
def rest_slope(u: float, half: float, turning: float, k: int, series: Floats) -> float:
    """Slope a (q^(a-1) - tau) of the rest, from the first coefficients of `rest_series`.

    `turning` is tau - 1. For |u| up to SERIES_RANGE, to some 1e-5: its steps are small.
    """
    total = 5.0 * series[3 * LANES + k] + u * (6.0 * series[4 * LANES + k])
    total = 4.0 * series[2 * LANES + k] + u * total
    total = 3.0 * series[LANES + k] + u * total
    return u * (2.0 * series[k] + u * total) - half * turning


@formula
def root_slope(u: float, turning: float) -> float:
    """`rest_slope` of the square root, by a polynomial through Chebyshev's points."""
    total = -0.1613230995497165 + u * 0.14137230040045798
    total = 0.1874766304172176 + u * total
    return u * (-0.24997452593493807 + u * total) - 0.5 * turning


@formula
def slope_of(form: Form, u: float, half: float, turning: float, k: int, series: Floats) -> float:
    """Slope of the rest."""
    if len(form) == 3:  # ROOT
        return root_slope(u, turning)
    if len(form) == 4:  # SQUARE
        return -turning
    return rest_slope(u, half, turning, k, series)


@formula
def answer(
    form: Form, inertia: Inertia, lanes: int, coarse: Floats, s: Floats, series: Floats,
    changes: Floats, us: Floats, tops: Floats, lows: Floats,
) -> None:  # fmt: skip
    """Take off the speeds u at the coarse nodes what the `changes` of the rest make of them.

    That changes the rest again, by what is taken to first order, from its slope half way, at every
    other node: for REST_SUM, and for CHANGE, the most of it.
    """
    wide_vectors()
    for k in range(lanes):
        s[RUNNING + k] = s[START + k]
        s[HIGH + k] = -1e300
        s[LOW + k] = 1e300
        s[CHANGE + k] = 0.0
        s[MORE + k] = 0.0
    for group in range(coarse.shape[0] // CHUNK):
        n = CHUNK * group
        row, bound = (n + PAD) * LANES, group * LANES
        vw0, vw1 = shared(coarse, n, V), shared(coarse, n + 1, V)
        vw2, vw3 = shared(coarse, n + 2, V), shared(coarse, n + 3, V)
        for k in range(lanes):
            d, rho, sigma, shift = s[DECAY + k], s[RHO + k], s[SIGMA + k], s[MOVING + k]
            near, far, half = s[EULER + k], s[EULER_FAR + k], s[HALF + k]
            ra, rb = changes[row - 2 * LANES + k], changes[row - LANES + k]
            r0, r1 = changes[row + k], changes[row + LANES + k]
            r2, r3 = changes[row + 2 * LANES + k], changes[row + 3 * LANES + k]
            r4, r5 = changes[row + 4 * LANES + k], changes[row + 5 * LANES + k]
            y = s[RUNNING + k]
            x0 = (sigma * y + (rho * r0 + shift)) - near * (r1 - rb) + far * (r2 - ra)
            y = d * y + r0
            x1 = (sigma * y + (rho * r1 + shift)) - near * (r2 - r0) + far * (r3 - rb)
            y = d * y + r1
            x2 = (sigma * y + (rho * r2 + shift)) - near * (r3 - r1) + far * (r4 - r0)
            y = d * y + r2
            x3 = (sigma * y + (rho * r3 + shift)) - near * (r4 - r2) + far * (r5 - r1)
            s[RUNNING + k] = d * y + r3
            e0 = e1 = e2 = e3 = 0.0
            if len(inertia) == 2:
                turn = s[ETA + k]
                e0, e1 = turn * own(coarse, vw0, n, V, k), turn * own(coarse, vw1, n + 1, V, k)
                e2, e3 = turn * own(coarse, vw2, n + 2, V, k), turn * own(coarse, vw3, n + 3, V, k)
                t0, t1, t2, t3 = inverses(1.0 + e0, 1.0 + e1, 1.0 + e2, 1.0 + e3)
                x0, x1, x2, x3 = x0 * t0, x1 * t1, x2 * t2, x3 * t3
            u0, u1 = us[row + k], us[row + LANES + k]
            u2, u3 = us[row + 2 * LANES + k], us[row + 3 * LANES + k]
            c0 = x0 * slope_of(form, u0 - 0.5 * x0, half, e0, k, series)
            c2 = x2 * slope_of(form, u2 - 0.5 * x2, half, e2, k, series)
            s[MORE + k] -= c0 + c2
            # Nested as in `march`.
            s[CHANGE + k] = max(max(s[CHANGE + k], abs(c0)), abs(c2))
            u0, u1, u2, u3 = u0 - x0, u1 - x1, u2 - x2, u3 - x3
            us[row + k] = u0
            us[row + LANES + k] = u1
            us[row + 2 * LANES + k] = u2
            us[row + 3 * LANES + k] = u3
            high = max(max(u0, u1), max(u2, u3))
            low = min(min(u0, u1), min(u2, u3))
            tops[bound + k] = high
            lows[bound + k] = low
            s[HIGH + k] = max(max(s[HIGH + k], max(u0, u1)), max(u2, u3))
            s[LOW + k] = min(min(s[LOW + k], min(u0, u1)), min(u2, u3))
    for k in range(lanes):
        s[REST_SUM + k] += 2.0 * s[MORE + k]


@inlined
def fill_series(lanes: int, s: Floats, series: Floats) -> None:
    """Binomial coefficients of q^a from u^2 on."""
    wide_vectors()
    for k in range(lanes):
        series[k] = 0.5 * s[HALF + k] * (s[HALF + k] - 1.0)
    for i in range(1, SERIES_TERMS):
        here = series[i * LANES : (i + 1) * LANES]
        before = series[(i - 1) * LANES : i * LANES]
        for k in range(lanes):
            here[k] = before[k] * (s[HALF + k] - (i + 1.0)) / (i + 2.0)


@formula
def beyond_linear(form: Form, u: float, k: int, series: Floats) -> float:
    """(1 + u)^a - 1 - a u."""
    if len(form) == 3:  # ROOT
        return root_series(u)
    if len(form) == 4:  # SQUARE
        return 0.0
    return rest_series(u, k, series)


@formula
def finite(x: float) -> float:
    """Return x, or some finite number: what a design left behind that was given up.

    Times zero that is nothing, for whoever has the lane next.
    """
    return min(1e300, max(-1e300, x))


@formula
def rest_of(
    first: bool, form: Form, inertia: Inertia, lanes: int, coarse: Floats, s: Floats,
    series: Floats, us: Floats, rs: Floats, changes: Floats,
) -> None:  # fmt: skip
    """Second-order rest r = F - 1 - a u tau at the coarse nodes and its sum.

    What it `changes` by and that one's recurrence; the `first` time, all of it, when CHANGE gets
    the most of two neighbouring nodes' mean. Later lanes that are done change no more, and those
    that have it by roots keep their change. Four nodes are written out: an inner loop over them
    would keep the lanes from being vectors.
    """
    for k in range(lanes):
        s[CHANGE + k] = 0.0
        s[REST_END + k] = 0.0
        s[REST_SUM + k] = 0.0
        s[KEEPS + k] = s[WIDE + k] * (1.0 - s[FROZEN + k])
        s[MOVES + k] = (1.0 - s[WIDE + k]) * (1.0 - s[FROZEN + k])
    for group in range(coarse.shape[0] // CHUNK):
        n = CHUNK * group
        row = (n + PAD) * LANES
        vw0, vw1 = shared(coarse, n, V), shared(coarse, n + 1, V)
        vw2, vw3 = shared(coarse, n + 2, V), shared(coarse, n + 3, V)
        for k in range(lanes):
            u0, u1 = us[row + k], us[row + LANES + k]
            u2, u3 = us[row + 2 * LANES + k], us[row + 3 * LANES + k]
            r0, r1 = beyond_linear(form, u0, k, series), beyond_linear(form, u1, k, series)
            r2, r3 = beyond_linear(form, u2, k, series), beyond_linear(form, u3, k, series)
            if len(inertia) == 2:
                e = s[HALF + k] * s[ETA + k]
                r0 -= u0 * e * own(coarse, vw0, n, V, k)
                r1 -= u1 * e * own(coarse, vw1, n + 1, V, k)
                r2 -= u2 * e * own(coarse, vw2, n + 2, V, k)
                r3 -= u3 * e * own(coarse, vw3, n + 3, V, k)
            if not first:
                # Not a choice: of two loads the compiler makes one from places of its own, a
                # gather.
                moves, keeps = s[MOVES + k], s[KEEPS + k]
                old0, old1 = rs[row + k], rs[row + LANES + k]
                old2, old3 = rs[row + 2 * LANES + k], rs[row + 3 * LANES + k]
                m0, m1 = moves * (r0 - old0), moves * (r1 - old1)
                m2, m3 = moves * (r2 - old2), moves * (r3 - old3)
                r0, r1, r2, r3 = old0 + m0, old1 + m1, old2 + m2, old3 + m3
                m0 += keeps * finite(changes[row + k])
                m1 += keeps * finite(changes[row + LANES + k])
                m2 += keeps * finite(changes[row + 2 * LANES + k])
                m3 += keeps * finite(changes[row + 3 * LANES + k])
                changes[row + k] = m0
                changes[row + LANES + k] = m1
                changes[row + 2 * LANES + k] = m2
                changes[row + 3 * LANES + k] = m3
            else:
                m0, m1, m2, m3 = r0, r1, r2, r3
            rs[row + k] = r0
            rs[row + LANES + k] = r1
            rs[row + 2 * LANES + k] = r2
            rs[row + 3 * LANES + k] = r3
            d = s[DECAY + k]
            s[REST_END + k] = d * (d * (d * (d * s[REST_END + k] + m0) + m1) + m2) + m3
            left, right = r0 + r1, r2 + r3
            s[REST_SUM + k] += left + right
            if first:
                # Nested as in `march`.
                s[CHANGE + k] = max(max(s[CHANGE + k], 0.5 * abs(left)), 0.5 * abs(right))


@inlined
def exact_rest(
    first: bool, form: Form, inertia: Inertia, lanes: int, coarse: Floats, s: Floats, us: Floats,
    rs: Floats, changes: Floats,
) -> None:  # fmt: skip
    """Take the rest of the lanes in WIDE by roots and powers, and how much it changes."""
    wide_vectors()
    for k in range(lanes):
        wide = s[WIDE + k] != 0.0
        s[CHANGE + k] = 0.0 if wide else s[CHANGE + k]
        s[REST_END + k] = 0.0 if wide else s[REST_END + k]
        s[REST_SUM + k] = 0.0 if wide else s[REST_SUM + k]
    for n in range(coarse.shape[0]):
        vw = shared(coarse, n, V)
        here = us[(n + PAD) * LANES : (n + PAD + 1) * LANES]
        rest = rs[(n + PAD) * LANES : (n + PAD + 1) * LANES]
        moved = changes[(n + PAD) * LANES : (n + PAD + 1) * LANES]
        for k in range(lanes):
            a, u, wide = s[HALF + k], here[k], s[WIDE + k] != 0.0
            turn = s[ETA + k] if len(inertia) == 2 else 0.0
            if len(form) == 3:  # ROOT
                power = math.sqrt(1.0 + u)
            elif len(form) == 4:  # SQUARE
                power = 1.0 + u
            else:
                power = exp_of(a * log_of(u))
            r = power - 1.0 - a * u * (1.0 + turn * own(coarse, vw, n, V, k))
            r = r if wide and s[FROZEN + k] == 0.0 else rest[k]
            change = r - (0.0 if first else rest[k])
            most = max(s[CHANGE + k], abs(change))
            s[CHANGE + k] = most if wide else s[CHANGE + k]
            s[REST_END + k] = s[DECAY + k] * s[REST_END + k] + change if wide else s[REST_END + k]
            s[REST_SUM + k] += r if wide else 0.0
            moved[k] = change
            rest[k] = r


@inlined
def iterate(
    form: Form, inertia: Inertia, tolerance: float, period: float, lanes: int,
    coarse: Floats, s: Floats, changes: Floats, us: Floats, rs: Floats, tops: Floats,
    lows: Floats,
) -> None:  # fmt: skip
    """Iterate r until every lane is frozen or given up; TURNS counts its passes.

    `tolerance` is for u, relative to its range. `changes` is scratch, a row a coarse node. What
    `rs` holds in the end is what u was found with.
    """
    wide_vectors()
    nodes = coarse.shape[0]
    series = on_stack(SERIES_ROWS)
    if len(form) == 5:  # POWER
        fill_series(lanes, s, series)
    for k in range(lanes):
        s[SHIFT + k] = -s[LEVEL + k]
        s[FROZEN + k] = 0.0 if s[CODE + k] == 0.0 else 1.0
    march(form, inertia, lanes, coarse, s, us, tops, lows)
    rest_of(True, form, inertia, lanes, coarse, s, series, us, rs, changes)
    for turn in range(MOST_PASSES):
        if turn > 0:
            # The first time, all of the rest is new.
            new = rs if turn == 1 else changes
            answer(form, inertia, lanes, coarse, s, series, new, us, tops, lows)
        if beyond_series(lanes, s):
            exact_rest(turn == 0, form, inertia, lanes, coarse, s, us, rs, changes)
        running = 0.0
        for k in range(lanes):
            frozen = s[FROZEN + k]
            a, kappa, half = s[HALF + k], s[KAPPA + k], 0.5 * s[EXPONENT + k]
            mean = s[REST_SUM + k] / nodes
            level = -mean / a - s[ALIAS + k]
            turned = 1.0 + 0.5 * (half - 1.0) * (half - 2.0) * s[SQUARE_MEAN + k]
            moved = (level - s[LEVEL + k]) / turned
            most = max(s[HIGH + k], -s[LOW + k])
            # What the next pass would change u by: the integral of a wave of one period.
            reach = kappa * period / (2.0 * math.pi)
            rate = s[CHANGE + k] / max(s[LAST + k], 1e-300)
            left = reach * s[CHANGE + k] / (1.0 - rate)
            # The closure's step is Newton's with a slope that is known up to the next moments.
            left += abs(moved) * (
                s[LOOSE + k] * (1.0 if len(inertia) == 2 else most) + reach * most
            )
            bound = tolerance * (s[HIGH + k] - s[LOW + k]) + 1e-15
            within = s[LOW + k] > DEEPEST and s[HIGH + k] < HIGHEST
            done = turn > 0 and left <= bound and rate < 0.5
            # A frozen lane keeps its u; what it knows of itself stays too.
            s[MOVED + k] = moved if frozen == 0.0 else s[MOVED + k]
            s[LAST + k] = s[CHANGE + k] if frozen == 0.0 else s[LAST + k]
            s[TURNS + k] = turn + 1.0 if frozen == 0.0 else s[TURNS + k]
            stays = frozen != 0.0 or done or not within
            s[CODE + k] = LEFT if frozen == 0.0 and not within else s[CODE + k]
            shift = s[SHIFT + k] if stays else s[ALIAS + k] - s[BENT + k] * mean
            s[MOVING + k] = shift - s[SHIFT + k]
            s[SHIFT + k] = shift
            s[LEVEL + k] = s[LEVEL + k] if stays else level
            s[FROZEN + k] = 1.0 if stays else 0.0
            running += 0.0 if stays else 1.0
        if running == 0.0:
            break
        if turn > 0:
            rest_of(False, form, inertia, lanes, coarse, s, series, us, rs, changes)
            wrap(nodes, lanes, changes)
        else:
            wrap(nodes, lanes, rs)
        for k in range(lanes):
            s[START + k] = s[REST_END + k] * s[CLOSED + k]
    for k in range(lanes):
        s[CODE + k] = LEFT if s[FROZEN + k] == 0.0 else s[CODE + k]
    # The rest too: that of a lane in WIDE is newer than what was repeated for its neighbours.
    wrap(nodes, lanes, rs)
    wrap(nodes, lanes, us)


@inlined
def mean_speed(
    form: Form, inertia: Inertia, lanes: int, levels: Levels, s: Floats, us: Floats
) -> None:
    """Mean of sqrt(q) after an iteration; exponent 1 has it from its closure."""
    wide_vectors()
    coarse, constants = levels.coarse, levels.constants
    nodes = coarse.shape[0]
    for k in range(lanes):
        s[MEAN + k] = 1.0 if len(form) == 3 else 0.0
    if len(form) == 3:  # ROOT
        return
    for group in range(nodes // CHUNK):
        row = (CHUNK * group + PAD) * LANES
        for k in range(lanes):
            moved = 0.0 if len(inertia) == 2 else s[MOVED + k]
            u0, u1 = us[row + k] + moved, us[row + LANES + k] + moved
            u2, u3 = us[row + 2 * LANES + k] + moved, us[row + 3 * LANES + k] + moved
            s[MEAN + k] += (root_series(u0) + root_series(u1)) + (root_series(u2) + root_series(u3))
            s[MEAN + k] += 0.5 * ((u0 + u1) + (u2 + u3))
    if len(inertia) == 2:
        # The closure's step is as small as its tolerance: the mean of 1/tau will do for its slope.
        for k in range(lanes):
            turns = 1.0 + s[ETA + k] * s[ETA + k] * constant(constants, VV, k)
            s[MEAN + k] += 0.5 * nodes * s[MOVED + k] * turns
    if beyond_series(lanes, s):
        exact_mean(inertia, lanes, coarse, s, us)
    for k in range(lanes):
        s[MEAN + k] = 1.0 + s[MEAN + k] / nodes + s[ALIAS_SPEED + k]


@inlined
def mean_inverse(
    inertia: Inertia, lanes: int, coarse: Floats, constants: Floats, s: Floats, us: Floats
) -> None:
    """FIRST_SUM becomes the mean of 1/sqrt(q): the time of the cycle over that at nominal speed."""
    wide_vectors()
    nodes = coarse.shape[0]
    for k in range(lanes):
        s[FIRST_SUM + k] = 0.0
    for group in range(nodes // CHUNK):
        n = CHUNK * group
        row = (n + PAD) * LANES
        vw0, vw1 = shared(coarse, n, V), shared(coarse, n + 1, V)
        vw2, vw3 = shared(coarse, n + 2, V), shared(coarse, n + 3, V)
        for k in range(lanes):
            m0 = m1 = m2 = m3 = s[MOVED + k]
            if len(inertia) == 2:
                turn = s[ETA + k]
                t0, t1, t2, t3 = inverses(
                    1.0 + turn * own(coarse, vw0, n, V, k),
                    1.0 + turn * own(coarse, vw1, n + 1, V, k),
                    1.0 + turn * own(coarse, vw2, n + 2, V, k),
                    1.0 + turn * own(coarse, vw3, n + 3, V, k),
                )  # fmt: skip
                m0, m1, m2, m3 = m0 * t0, m1 * t1, m2 * t2, m3 * t3
            u0, u1 = us[row + k] + m0, us[row + LANES + k] + m1
            u2, u3 = us[row + 2 * LANES + k] + m2, us[row + 3 * LANES + k] + m3
            i0, i1, i2, i3 = inverses(
                1.0 + 0.5 * u0 + root_series(u0), 1.0 + 0.5 * u1 + root_series(u1),
                1.0 + 0.5 * u2 + root_series(u2), 1.0 + 0.5 * u3 + root_series(u3),
            )  # fmt: skip
            s[FIRST_SUM + k] += (i0 + i1) + (i2 + i3)
    if beyond_series(lanes, s):
        for k in range(lanes):
            s[FIRST_SUM + k] = 0.0 if s[WIDE + k] != 0.0 else s[FIRST_SUM + k]
        for n in range(nodes):
            vw = shared(coarse, n, V)
            row = (n + PAD) * LANES
            for k in range(lanes):
                turn = s[ETA + k] if len(inertia) == 2 else 0.0
                q = 1.0 + us[row + k] + s[MOVED + k] / (1.0 + turn * own(coarse, vw, n, V, k))
                s[FIRST_SUM + k] += 1.0 / math.sqrt(q) if s[WIDE + k] != 0.0 else 0.0
    for k in range(lanes):
        g, eta = s[GAS + k], s[ETA + k]
        if constants.ndim == 2:
            seen = -0.5 * (g * constants[ALIAS_P, k] - eta * constants[ALIAS_V, k])
        else:
            seen = alias(-0.5, False, len(inertia) == 2, True, g, eta, constants)
        s[FIRST_SUM + k] = s[FIRST_SUM + k] / nodes + seen


@inlined
def rescale(inertia: Inertia, lanes: int, levels: Levels, s: Floats, us: Floats) -> bool:
    """Next energy scale on the way to the nominal cycle time; whether that of any lane moves.

    docs/method.md (77): with q = rho times a solution of the power mean for energies over rho, the
    time of the cycle is that solution's over sqrt(rho). Its excess over 1 falls about as 1/rho^2,
    so that three solutions are usual. A lane whose scale is found keeps it, and its numbers too.
    """
    wide_vectors()
    mean_inverse(inertia, lanes, levels.coarse, levels.constants, s, us)
    moving = 0.0
    for k in range(lanes):
        scale = s[ENERGY_SCALE + k]
        excess = (s[FIRST_SUM + k] - 1.0) * scale * scale
        x = scale
        for _ in range(4):
            root, inverse = math.sqrt(x), 1.0 / x
            value = root - 1.0 - excess * inverse * inverse
            x -= value / (0.5 / root + 2.0 * excess * inverse * inverse * inverse)
            x = min(4.0, max(0.25, x))
        step = abs(x - scale)
        # Not `step > ...`: what is no number does not move.
        moves = step > SCALE_STEP and s[CODE + k] == 0.0
        s[ENERGY_SCALE + k] = x if moves else scale
        s[SCALE_MOVES + k] = 1.0 if moves else 0.0
        moving += s[SCALE_MOVES + k]
    return moving > 0.0
