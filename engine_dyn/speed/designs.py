"""The one place that loops over designs.

A sweep is a product of axes. Designs that agree in geometry, diagram and arrangement share one
table of work (`tables`); they follow each other, so that a table is built once. A kernel takes a
range of designs, finds each one's values by strides into the inputs (no column of the whole sweep
is ever built) and writes each result to its own place. Every design is solved by itself, with its
period as SIMD lanes (`segments`): its numbers cannot depend on its neighbours.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from engine_dyn.compilation import (
    formula,
    indices_on_stack,
    inlined,
    kernel,
    on_stack,
    rows_on_stack,
    wide_vectors,
)
from engine_dyn.loads.friction import FRICTIONLESS, StrokeFriction
from engine_dyn.loads.laws import FLOOR, Power, Shape, half_of, is_shape, load_terms, shape_at
from engine_dyn.speed.batch import hills, lanes, panels, traces
from engine_dyn.speed.batch.levels import CHUNK, Levels, fill_levels, make_levels
from engine_dyn.speed.general.cycles import (
    RATES,
    SAMPLE_ROWS,
    SPEEDS,
    Samples,
    outcome,
    run_euler,
    sample_shapes,
    start_speed,
)
from engine_dyn.speed.general.newton import POWER_MEAN, closure_terms, newton
from engine_dyn.speed.general.picard import repeat_cycles
from engine_dyn.speed.general.segments import (
    MOST_SWEEPS,
    POWERS,
    RECORD,
    SEGMENTS,
    Q,
    extremes_at_nodes,
    iterate,
    make_records,
    place_of,
    solve_linear,
    spread,
)
from engine_dyn.speed.general.stiff import follow_work
from engine_dyn.speed.product import (
    BORE,
    BOUNDARY,
    BREAKDOWN,
    CRANKCASE,
    EXPONENT,
    FRICTION,
    GEAR_RATIO,
    HYDRODYNAMIC,
    INERTIA,
    INPUTS,
    LOAD_PHASE,
    LOAD_SCALE,
    MASS,
    MEAN_TORQUE,
    MIXED,
    OFFSET,
    OFFSET_RATIO,
    OUTPUT,
    PASSES,
    RATIO,
    RING,
    ROW,
    SCALE,
    SKIRT,
    SPEED,
    START_ANGLE,
    STROKE,
    SYNCHRONOUS,
    Product,
    count_of,
    offsets_at,
    value_at,
)
from engine_dyn.speed.tables import work_tables
from engine_dyn.speed.tables.extremes import interpolate, refine, slope_between
from engine_dyn.speed.tables.load_over_angle import PLAIN_ROWS, join_load, keep_gas
from engine_dyn.speed.tables.work_tables import (
    GAS_TORQUE,
    GAS_WORK,
    GAS_WORK_MIDDLE,
    GAS_WORK_TILT,
    QUINTIC,
    SHAPE,
    SHAPE_MIDDLE,
    SHAPE_SLOPE,
    SQUARE,
    SQUARE_MIDDLE,
    SQUARE_SLOPE,
    SQUARE_TILT,
    TABLE_ROWS,
    TORQUE,
    TORQUE_MIDDLE,
    TORQUE_SLOPE,
    Blend,
    Grid,
)
from engine_dyn.status import (
    CONVERGED,
    INVALID_INPUT,
    NO_STEADY_STATE,
    NOT_CONVERGED,
    PASSES_DONE,
    STALLED,
    TOLERANCE_NOT_MET,
)
from engine_dyn.types import Floats, Integers

__all__ = [
    "Choice",
    "Curves",
    "NoShape",
    "OverSpeed",
    "Results",
    "Scratch",
    "extremes_of_torque",
    "make_scratch",
    "march",
    "march_lanes",
    "march_panels",
    "mean_gas_torque",
    "write_traces",
]


AUTO, THESIS, PICARD, NEWTON, CLOSED = range(5)

SCALARS = 8
DELTA, DELTA_MIDRANGE, OMEGA_MAX, OMEGA_MIN, OMEGA_MEAN, LOAD_FACTOR, DELTA_ERROR, ITERATIONS = (
    range(SCALARS)
)
SCALAR_ROWS = SCALARS * lanes.LANES

IDLE = 1e-9
"""A mean torque within this share of the torque's range is no load (contract)."""

NEWTON_STEPS = 60

STRONG_LOAD = 1e-3
"""Below this kappa times the width of an interval, what the two-point formula misses is negligible;
above it, it counts in the error, and what is linear is solved without it (`stiff`)."""

CAREFUL = 0.2
"""Share of the tolerance up to which the error of a design solved in lanes may be estimated: what
the coarse level misses is judged by the last term taken, which can be small by chance."""

CERTAIN = 0.01
"""Margin by which a mean over nodes must exceed 1 to prove something about the integral."""

SLACK = 1.0 + 1e-9
"""The mean lies between the extremes up to rounding."""


class Choice(NamedTuple):
    """What all designs of a part have in common.

    `kind` is the class of the load exponent: 0, 1 or 2 for these, 3 for any other, 4 for a law that
    is no power of the speed. `iterated` is the error that iterations may leave, relative to the
    range of q.
    """

    method: int
    kind: int
    variable: bool
    closure: int
    tolerance: float
    iterated: float


class NoShape(NamedTuple):
    """The load over speed is a + k omega^alpha; the number has no meaning (see `load_law`)."""

    none: int


class OverSpeed(NamedTuple):
    """A load (`sign` 1) or driver (-1) over speed: its table, empty for a motor.

    `own` says that the table is over the speed of the load's shaft, the gear ratio times the
    crank's: the shape F(q) is that at this speed.
    """

    sign: float
    own: bool
    table: Floats


class Curves(NamedTuple):
    """Where curves are wanted: node before each angle, share of the interval, place in samples."""

    node: Integers
    share: Floats
    sample: Floats


class Results(NamedTuple):
    """Arrays of results, one entry a design; `wanted[i]` is the row of result i or -1.

    `omega` and `acceleration` have an empty second axis where they are not wanted. `left` notes the
    designs that `lanes` leaves to `march`, and those that are marked in it are left from the
    beginning; empty where nobody asks.
    """

    wanted: Integers
    scalars: Floats
    status: npt.NDArray[np.int8]
    omega: Floats
    acceleration: Floats
    left: npt.NDArray[np.bool_]


class Scratch(NamedTuple):
    """Working memory of one thread.

    `held` tells of which designs `table` and `levels` are, and the points of curves: the place of
    the table in the product, -1 of none.
    """

    table: Floats
    plain: Floats
    middles: Floats
    rates: Floats
    records: Floats
    running: Floats
    curve: Floats
    sampled: Floats
    at: Integers
    shared: Integers
    places: Integers
    varying: Integers
    line: Integers
    held: Integers
    levels: Levels


def make_scratch(nodes: int, steps: int, samples: int, ratio: int) -> Scratch:
    """Working memory for designs with `nodes` nodes a period and `steps` in the whole grid."""
    records, running = make_records(nodes)
    return Scratch(
        table=np.empty((TABLE_ROWS, nodes)),
        plain=np.empty((PLAIN_ROWS, nodes)),
        middles=np.empty((4, nodes)),
        rates=np.empty(6 * steps),
        records=records,
        running=running,
        curve=np.empty((TABLE_ROWS, nodes)),  # a table, or five rows and eight of Newton's
        sampled=np.empty((SAMPLE_ROWS, samples)),
        at=np.zeros(INPUTS, dtype=np.int64),
        shared=np.zeros(INPUTS, dtype=np.int64),
        places=np.zeros(lanes.LANES, dtype=np.int64),
        varying=np.zeros(INPUTS, dtype=np.int64),
        line=np.zeros(1, dtype=np.int64),
        held=np.full(2, -1, dtype=np.int64),
        levels=make_levels(nodes, ratio),
    )


class Design(NamedTuple):
    """Reduced parameters of one design, see `segments`; `nominal` is its speed [rad/s]."""

    gas: float
    eta: float
    kappa: float
    law: Power | Shape
    nominal: float


class Ranges(NamedTuple):
    """Ranges of the gas and the inertia torque of a table, and the least of its square velocity."""

    gas: float
    shape: float
    least_square: float


LANES, NUMBERS = lanes.LANES, lanes.NUMBERS
"""Constants to the compiler, which attributes of modules are not."""

WHOLE = -LANES
"""Mask that leaves a multiple of LANES, a power of two, as it is: a count of lanes it was put on is
known to be one, so that loops over lanes are vectors without a remainder."""

W, DW, TAU, DTAU, D = range(5)
"""Rows of `Scratch.curve`; the rest is Newton's."""


@inlined
def blend_of(values: Floats, at: Integers, row_of: Integers) -> Blend:
    """Return the diagram of the design whose inputs lie at `at`."""
    row = values[at[ROW]]
    whole = int(math.floor(row))
    weight = row - whole
    first = row_of[whole]
    second = row_of[whole + 1] if weight > 0.0 else first
    friction = StrokeFriction(
        values[at[BOUNDARY]], values[at[MIXED]], values[at[HYDRODYNAMIC]], values[at[SKIRT]],
        values[at[RING]],
    )  # fmt: skip
    return Blend(first, second, weight, values[at[SCALE]], values[at[CRANKCASE]], friction)


@inlined
def ranges_of(table: Floats) -> Ranges:
    """Ranges of a table."""
    low, high = work_tables.bounds_of(table[TORQUE])
    least, most = work_tables.bounds_of(table[SHAPE])
    return Ranges(high - low, most - least, work_tables.bounds_of(table[SQUARE])[0])


@inlined
def law_of(
    values: Floats, at: Integers, choice: Choice, over_speed: NoShape | OverSpeed
) -> tuple[Power | Shape, float]:
    """Load or driver over speed of a design, and the sign of the mean torque that it makes up for.

    The sign is that of a number: 0 where there is no torque at the nominal speed, NaN where a table
    does not cover it.
    """
    if len(over_speed) == 1:
        return Power(0.5 * values[at[EXPONENT]] if choice.kind != 0 else 0.0), 1.0
    speed, table = gear_of(values, at, over_speed) * values[at[SPEED]], over_speed.table
    synchronous, slip = values[at[SYNCHRONOUS]], values[at[BREAKDOWN]]
    shape, _, _ = shape_at(speed, Shape(speed, 1.0, synchronous, slip, table))
    scale = 1.0 / shape if shape != 0.0 else 0.0
    sign = over_speed.sign * scale if covers(over_speed, speed, speed) else math.nan
    return Shape(speed, scale, synchronous, slip, table), sign


@inlined
def gear_of(values: Floats, at: Integers, over_speed: NoShape | OverSpeed) -> float:
    """Speed that a table is over, over the crank's."""
    if len(over_speed) == 1:
        return 1.0
    return values[at[GEAR_RATIO]] if over_speed.own else 1.0


@inlined
def covers(over_speed: NoShape | OverSpeed, high: float, low: float) -> bool:
    """Whether a table over speed covers these speeds."""
    if len(over_speed) > 1:
        speeds = over_speed.table[0]
        if speeds.size > 0:
            return speeds[0] <= low * SLACK and high <= speeds[speeds.size - 1] * SLACK
    return True


@inlined
def reduce(
    values: Floats, at: Integers, choice: Choice, over_speed: NoShape | OverSpeed, table: Floats,
    ranges: Ranges,
) -> tuple[Design, int]:  # fmt: skip
    """Reduced parameters of the design whose inputs lie at `at`, and its outcome so far."""
    radius = 0.5 * values[at[STROKE]]
    lever = 0.25 * math.pi * values[at[BORE]] ** 2 * radius
    throw = values[at[MASS]] * radius * radius
    speed = values[at[SPEED]]
    inertia = values[at[INERTIA]]
    energy = 0.5 * inertia * speed * speed
    surplus = values[at[MEAN_TORQUE]] - values[at[OFFSET]]
    code = CONVERGED
    law, sign = law_of(values, at, choice, over_speed)
    # Idle or loaded: the ranges of both parts bound the torque's, and decide nearly always.
    moment = throw * speed * speed
    swing = lever * ranges.gas + moment * ranges.shape
    if abs(surplus) <= IDLE * swing:
        high, low = -math.inf, math.inf
        for j in range(table.shape[1]):
            torque = lever * table[TORQUE, j] + moment * table[SHAPE, j]
            high = max(high, torque)
            low = min(low, torque)
        swing = high - low
    if abs(surplus) <= IDLE * swing:
        surplus = 0.0
    elif not (surplus * sign > 0.0):
        code = NO_STEADY_STATE
    if sign == 0.0:
        code = NO_STEADY_STATE
    elif math.isnan(sign):
        code = INVALID_INPUT
    if choice.variable and 1.0 + throw / inertia * ranges.least_square <= 0.0:
        code = INVALID_INPUT
    exponent = values[at[EXPONENT]]
    closed = not is_shape(law) and (exponent == 0.0 or exponent == 2.0)
    if choice.method == CLOSED and not closed:
        code = INVALID_INPUT
    return Design(lever / energy, throw / inertia, surplus / energy, law, speed), code


@inlined
def fill_curve(design: Design, variable: bool, table: Floats, curve: Floats) -> None:
    """Fill in w, w', tau and tau' at the nodes (see `newton`)."""
    for j in range(table.shape[1]):
        curve[W, j] = design.gas * table[GAS_WORK, j]
        curve[DW, j] = design.gas * table[GAS_TORQUE, j]
        curve[TAU, j] = 1.0
        curve[DTAU, j] = 0.0
        if variable:
            curve[TAU, j] += design.eta * table[SQUARE, j]
            curve[DTAU, j] = design.eta * table[SQUARE_SLOPE, j]
        else:
            curve[W, j] -= design.eta * table[SQUARE, j]
            curve[DW, j] -= design.eta * table[SQUARE_SLOPE, j]


@inlined
def take_curve(design: Design, curve: Floats, records: Floats) -> None:
    """Solution of a curve back into the records."""
    nodes = curve.shape[1]
    for j in range(nodes):
        here = place_of(j, nodes // SEGMENTS)
        q = (1.0 + curve[D, j]) / curve[TAU, j]
        records[here + Q] = q
        records[here + POWERS], _, _ = load_terms(q, design.law)


@inlined
def must_stall(design: Design, variable: bool, period: float, table: Floats) -> bool:
    """Whether no speed above zero can be periodic; power mean.

    From the least work X on, the load takes at most what it takes in a period, kappa Phi, because
    its mean F is 1. So q >= (X - min X - kappa Phi)/tau wherever that is positive, and F over a
    period cannot be less than what this gives: more than 1 is a contradiction. Newton's method
    would need all its steps to give up.
    """
    gas, eta = design.gas, design.eta
    inertia, masses = (eta, 0.0) if variable else (0.0, eta)
    nodes = table.shape[1]
    least, most = math.inf, -math.inf
    for j in range(nodes):
        work = gas * table[GAS_WORK, j] - masses * table[SQUARE, j]
        least = min(least, work)
        most = max(most, work)
    least += design.kappa * period
    if most - least < 1.0:  # seldom more, and no contradiction then but with thin inertia
        return False
    total = 0.0
    half = half_of(design.law)
    for j in range(nodes):
        work = gas * table[GAS_WORK, j] - masses * table[SQUARE, j] - least
        q = max(work / (1.0 + inertia * table[SQUARE, j]), FLOOR)
        if half > 0.0:
            total += math.exp(half * math.log(q)) - 1.0
        else:
            total += math.log(q)
    return total > CERTAIN * nodes


@inlined
def is_linear(choice: Choice) -> bool:
    """Whether the equation of the speed is linear, with a constant coefficient."""
    linear = choice.kind == 2 and not choice.variable and choice.closure == POWER_MEAN
    return linear and choice.method != NEWTON


@inlined
def is_stiff(design: Design, width: float, choice: Choice) -> bool:
    """Whether a design is solved by `stiff`: its curve is then a table in `Scratch.curve`."""
    return is_linear(choice) and design.kappa * width > STRONG_LOAD


@inlined
def solve_one(
    design: Design, width: float, choice: Choice, segments: int, scratch: Scratch
) -> tuple[int, int, float]:
    """Periodic solution of one design in the records; its outcome, iterations and mu."""
    nodes = scratch.table.shape[1]
    alone = choice.method == NEWTON or (
        choice.method == CLOSED and choice.kind != 0 and choice.variable
    )
    sweeps = 0
    possible = alone or choice.closure != POWER_MEAN or is_shape(design.law)
    if not possible and must_stall(design, choice.variable, width * nodes, scratch.table):
        return STALLED, 1, 1.0
    if not alone:
        if is_linear(choice):
            if is_stiff(design, width, choice):
                follow_work(
                    width, design.gas, design.eta, design.kappa, scratch.table, scratch.curve,
                    scratch.records,
                )  # fmt: skip
            else:
                solve_linear(
                    width, design.gas, design.eta, design.kappa, segments, scratch.records,
                    scratch.running,
                )  # fmt: skip
            return CONVERGED, 1, 1.0
        sweeps, mu = iterate(
            width, design.gas, design.eta, design.kappa, design.law, choice.kind,
            choice.variable, choice.closure, choice.iterated, segments,
            scratch.records, scratch.running,
        )  # fmt: skip
        if sweeps > 0:
            return CONVERGED, sweeps, mu
    fill_curve(design, choice.variable, scratch.table, scratch.curve)
    steps, mu, _, smallest = newton(
        design.kappa, design.law, choice.closure, width, nodes, scratch.curve[W],
        scratch.curve[DW], scratch.curve[TAU], scratch.curve[DTAU], scratch.curve[D],
        scratch.curve[5:], 1e-7, NEWTON_STEPS,
    )  # fmt: skip
    take_curve(design, scratch.curve, scratch.records)
    code = CONVERGED
    if steps < 0:
        code = NOT_CONVERGED if smallest > FLOOR else STALLED
    return code, abs(steps) + (0 if alone else MOST_SWEEPS), mu


@inlined
def holds(design: Design, variable: bool, table: Floats, records: Floats) -> bool:
    """Whether load or driver bring a speed that is a little off back within some cycles.

    A deviation of the energy changes in a period by the factor exp(-int kappa F'/tau). Power laws
    always do; a driver does where its torque falls with the speed.
    """
    if not is_shape(design.law) or design.kappa == 0.0:
        return True
    nodes = table.shape[1]
    total = 0.0
    for j in range(nodes):
        _, first, _ = load_terms(records[place_of(j, nodes // SEGMENTS) + Q], design.law)
        total += first / (1.0 + design.eta * table[SQUARE, j] if variable else 1.0)
    return design.kappa * total > 0.0


@inlined
def pulls_back(design: Design) -> bool:
    """Whether load or driver oppose a deviation from the nominal speed."""
    if not is_shape(design.law) or design.kappa == 0.0:
        return True
    _, first, _ = load_terms(1.0, design.law)
    return design.kappa * first > 0.0


@inlined
def slope_at(
    j: int, design: Design, mu: float, variable: bool, table: Floats, records: Floats
) -> tuple[float, float]:
    """Return q and its exact slope at a node: q' = (w' - kappa (F/mu - 1) - q tau')/tau."""
    here = place_of(j, table.shape[1] // SEGMENTS)
    q = records[here + Q]
    slope = design.gas * table[GAS_TORQUE, j] - design.kappa * (records[here + POWERS] / mu - 1.0)
    turn = design.eta * table[SQUARE_SLOPE, j]
    if variable:
        return q, (slope - q * turn) / (1.0 + design.eta * table[SQUARE, j])
    return q, slope - turn


@inlined
def extreme_of_speed(
    node: int, upward: float, design: Design, mu: float, width: float, variable: bool,
    table: Floats, records: Floats,
) -> tuple[float, float]:  # fmt: skip
    """Extreme of q near its largest (upward = 1) or smallest (-1) node, and what it may miss.

    That is the middle's share and more than what comes after it.
    """
    nodes = table.shape[1]
    q, here = slope_at(node, design, mu, variable, table, records)
    ahead = here * upward > 0.0
    left = node if ahead else (node - 1 if node > 0 else nodes - 1)
    right = left + 1 if left + 1 < nodes else 0
    q_left, d_left = slope_at(left, design, mu, variable, table, records)
    q_right, d_right = slope_at(right, design, mu, variable, table, records)
    d_left *= width
    d_right *= width
    if not (d_left * upward > 0.0 and d_right * upward < 0.0):
        # Beside an extreme node the slope has another sign, unless the nodes do not resolve it.
        return q, abs(here) * width
    if variable:
        # The middle of q from the middles of energy and inertia, both known.
        tau_left = 1.0 + design.eta * table[SQUARE, left]
        tau_right = 1.0 + design.eta * table[SQUARE, right]
        turn_left = design.eta * table[SQUARE_SLOPE, left] * width
        turn_right = design.eta * table[SQUARE_SLOPE, right] * width
        energy = design.gas * table[GAS_WORK_MIDDLE, left] + interpolate(
            0.5, q_left * tau_left, q_right * tau_right,
            d_left * tau_left + q_left * turn_left, d_right * tau_right + q_right * turn_right,
        )  # fmt: skip
        tau = design.eta * table[SQUARE_MIDDLE, left] + interpolate(
            0.5, tau_left, tau_right, turn_left, turn_right
        )
        middle = energy / tau - interpolate(0.5, q_left, q_right, d_left, d_right)
    else:
        middle = design.gas * table[GAS_WORK_MIDDLE, left] - design.eta * table[SQUARE_MIDDLE, left]
    value, _, bump = refine(q_left, q_right, d_left, d_right, middle)
    beyond = design.gas * abs(table[GAS_WORK_TILT, left])
    beyond += design.eta * abs(table[SQUARE_TILT, left])
    tau = min(tau_left, tau_right) if variable else 1.0
    # Twice a quintic: a knot within the interval and what comes after the fifth order add to it.
    return value, abs(bump) + 2.0 * QUINTIC * beyond / tau


@inlined
def highest_hill(
    node: int, upward: float, design: Design, mu: float, width: float, variable: bool,
    table: Floats, records: Floats,
) -> tuple[float, float]:  # fmt: skip
    """Largest (upward = 1) or smallest (-1) q of the curve, and what it may miss.

    `node` is the extreme one. Another hill can be higher between its nodes, even one that no node
    shows: a hill rises above a node beside it by less than that node's slope makes of an interval,
    which is about the largest step between nodes at most.
    """
    best, miss = extreme_of_speed(node, upward, design, mu, width, variable, table, records)
    nodes = table.shape[1]
    rows = nodes // SEGMENTS
    before = upward * records[place_of(nodes - 1, rows) + Q]
    reach = 0.0
    for j in range(nodes):
        here = upward * records[place_of(j, rows) + Q]
        reach = max(reach, abs(here - before))
        before = here
    here = upward * records[place_of(0, rows) + Q]
    for j in range(nodes):
        after = upward * records[place_of(j + 1 if j + 1 < nodes else 0, rows) + Q]
        if here + 2.0 * reach > upward * best and j != node:
            _, slope = slope_at(j, design, mu, variable, table, records)
            rising = slope * upward > 0.0 or (here >= before and here > after)
            if rising and here + abs(slope) * width > upward * best:
                value, its_miss = extreme_of_speed(
                    j, upward, design, mu, width, variable, table, records
                )
                if upward * value > upward * best:
                    best, miss = value, its_miss
        before, here = here, after
    return best, miss


@inlined
def unresolved(law: Power | Shape, closure: int, records: Floats) -> float:
    """Relative difference of the means over even and odd nodes: of the speed and of the closure."""
    rows = records.size // RECORD - 1
    nodes = rows * SEGMENTS
    speed = closed = both = 0.0
    for j in range(nodes):
        q = records[place_of(j, rows) + Q]
        sign = 1.0 if j % 2 == 0 else -1.0
        root = math.sqrt(max(q, 0.0))
        value, _ = closure_terms(q, law, closure)
        both += root
        speed += sign * root
        closed += sign * value
    return abs(speed) / both + abs(closed) / nodes


@inlined
def load_missed(kappa: float, mu: float, width: float, records: Floats) -> float:
    """What the two-point formula misses in q, by third differences of the load's rate.

    Its local error, h^5/720 of a fourth derivative, sums up to h^4/720 of the third, and the cubic
    through the nodes misses h^4/384 of it in the middle of an interval; the rate is
    kappa (F/mu - 1). Eight times that, because near a stall differences are too small.
    """
    rows = records.size // RECORD - 1
    nodes = rows * SEGMENTS
    a = records[place_of(nodes - 3, rows) + POWERS]
    b = records[place_of(nodes - 2, rows) + POWERS]
    c = records[place_of(nodes - 1, rows) + POWERS]
    largest = 0.0
    for j in range(nodes):
        d = records[place_of(j, rows) + POWERS]
        largest = max(largest, abs(d - 3.0 * (c - b) - a))
        a, b, c = b, c, d
    return 8.0 * (1.0 / 720.0 + 1.0 / 384.0) * width * abs(kappa) / mu * largest


@inlined
def speeds_of(
    design: Design, mu: float, width: float, choice: Choice, segments: int, table: Floats,
    scratch: Scratch,
) -> tuple[float, float, float, float]:  # fmt: skip
    """Largest, smallest and mean speed [rad/s], and the share of delta that they may miss.

    Or the share of the smallest speed, where that is more: near a stall it is far less than the
    range, and may miss as much. All are NaN where the smallest is no speed any more.
    """
    records = scratch.records
    top, bottom, mean = extremes_at_nodes(segments, records, scratch.running)
    variable = choice.variable
    high, high_miss = highest_hill(top, 1.0, design, mu, width, variable, table, records)
    low, low_miss = highest_hill(bottom, -1.0, design, mu, width, variable, table, records)
    if not (low > FLOOR):
        return math.nan, math.nan, math.nan, math.nan
    span = high - low
    high, low = math.sqrt(high), math.sqrt(low)
    error = 0.0
    if high > low:
        rounding = lanes.ROUNDING * (1.0 + lanes.CANCELLED * design.eta)
        error = (0.5 * (high_miss / high + low_miss / low) + rounding / low) / (high - low)
    error += unresolved(design.law, choice.closure, records)
    strong = abs(design.kappa) * width > STRONG_LOAD or is_shape(design.law)
    if strong and span > 0.0:
        error += load_missed(design.kappa, mu, width, records) / span
    error *= max(1.0, (high - low) / low)
    return design.nominal * high, design.nominal * low, design.nominal * mean, error


@inlined
def run_picard(
    design: Design, width: float, periods: int, choice: Choice, values: Floats, at: Integers,
    scratch: Scratch,
) -> tuple[int, bool, bool]:  # fmt: skip
    """Repeat cycles in the energy form; how many, whether closed, whether stalled.

    The records hold the periodic solution before, and the last cycle afterwards.
    """
    curve, records = scratch.curve, scratch.records
    nodes = curve.shape[1]
    fill_curve(design, choice.variable, scratch.table, curve)
    passes = int(values[at[PASSES]])
    cycles, closed, stalled = repeat_cycles(
        design.kappa, design.law, width, nodes, curve[W], curve[DW], curve[TAU], curve[DTAU],
        curve[D], (start_speed(values, at) / design.nominal) ** 2,
        int(round(values[at[START_ANGLE]] / width)) % nodes, periods, passes,
        1e-3 * choice.tolerance,
    )  # fmt: skip
    # No load torque that depends on speed: every cycle closes, whatever its speed; the closure
    # fixes the constant, as the periodic solution has it.
    free = passes == 0 and closed and (design.kappa == 0.0 or choice.kind == 0)
    if not stalled and not free:
        take_curve(design, curve, records)
    return cycles, closed, stalled


@kernel
def march(
    chosen: Integers,
    segments: int,
    product: Product,
    row_of: Integers,
    width: float,
    grid: Grid,
    samples: Samples,
    choice: Choice,
    over_speed: NoShape | OverSpeed,
    over_angle: Floats,
    curves: Curves,
    results: Results,
    scratch: Scratch,
) -> None:
    """Solve the designs `chosen`, ascending: those of one table follow each other.

    `row_of` maps rows of the family to rows of the grid, `width` is the angle between nodes,
    `segments` is SEGMENTS (see `segments.solve_linear`). `over_angle` is the table of a load over
    angle (`driven_machine.TorqueOverAngle.table`), empty where there is none.
    """
    values, table, at, shared = product.values, scratch.table, scratch.at, scratch.shared
    scratch.held[0] = -1  # its tables are made here
    nodes = table.shape[1]
    periods = work_tables.steps_of(grid) // nodes
    period = width * work_tables.steps_of(grid)
    designs = count_of(product.other_axes, product)
    ranges = Ranges(0.0, 0.0, 0.0)
    loaded = over_angle.shape[1] > 0
    current = -1
    for index in chosen:
        which = index // designs
        if which != current:
            current = which
            offsets_at(which, product.table_axes, product, product.value_start, shared)
            blend = blend_of(values, shared, row_of)
            work_tables.build(
                values[shared[RATIO]], values[shared[OFFSET_RATIO]], blend, nodes, width, grid,
                table, scratch.middles, scratch.rates,
            )  # fmt: skip
            if loaded:
                keep_gas(table, scratch.plain)
            else:
                spread(table, scratch.records)
            ranges = ranges_of(table)
            if choice.method == THESIS:
                sample_shapes(
                    values[shared[RATIO]], values[shared[OFFSET_RATIO]], blend, samples,
                    scratch.sampled,
                )  # fmt: skip
        offsets_at(index % designs, product.other_axes, product, shared, at)
        if loaded:
            lever = 0.125 * math.pi * values[at[BORE]] ** 2 * values[at[STROKE]]
            join_load(
                values[at[LOAD_SCALE]], values[at[GEAR_RATIO]], values[at[LOAD_PHASE]], lever,
                width, over_angle, scratch.plain, table,
            )  # fmt: skip
            spread(table, scratch.records)
            ranges = ranges_of(table)
        design, code = reduce(values, at, choice, over_speed, table, ranges)
        answerable = code == CONVERGED
        high = low = mean = math.nan
        mu = 1.0
        error = 0.0
        cycles = 0
        curve_of, shown = design, table
        if answerable:
            code, cycles, mu = solve_one(design, width, choice, segments, scratch)
            if is_stiff(design, width, choice):
                curve_of = Design(1.0, design.eta, 0.0, design.law, design.nominal)
                shown = scratch.curve
            gear = gear_of(values, at, over_speed)
            if code == CONVERGED:
                high, low, mean, error = speeds_of(
                    curve_of, mu, width, choice, segments, shown, scratch
                )
                if not (low > 0.0):
                    code = STALLED
                elif not covers(over_speed, gear * high, gear * low):
                    code = INVALID_INPUT
                elif not holds(design, choice.variable, table, scratch.records):
                    code = NO_STEADY_STATE
                elif not (low <= mean * SLACK and mean <= high * SLACK):
                    # A load so strong that the nodes do not see the curve at all.
                    code = NOT_CONVERGED
                elif error > choice.tolerance:
                    code = TOLERANCE_NOT_MET
        if (code == STALLED or code == NOT_CONVERGED) and not pulls_back(design):
            code = NO_STEADY_STATE
        answerable = answerable and code != NO_STEADY_STATE and code != INVALID_INPUT
        if answerable and (choice.method == THESIS or choice.method == PICARD):
            delta = (high - low) / mean
            mu = 1.0
            if choice.method == THESIS:
                cycles, closed, stalled, high, low, mean = run_euler(
                    values, at, design.kappa == 0.0, choice.variable, period, scratch.sampled
                )
            else:
                cycles, closed, stalled = run_picard(
                    design, width, periods, choice, values, at, scratch
                )
                if not stalled:
                    curve_of, shown = design, table
                    high, low, mean, _ = speeds_of(
                        curve_of, mu, width, choice, segments, shown, scratch
                    )
                    stalled = not (low > 0.0)
            # What the method misses, measured against the periodic solution.
            if delta > 0.0:
                error += abs((high - low) / mean - delta) / delta
            code = outcome(stalled, int(values[at[PASSES]]), closed, error, choice.tolerance)
        good = code == CONVERGED or code == TOLERANCE_NOT_MET or code == PASSES_DONE
        store(at[OUTPUT], code, good, high, low, mean, mu, error, cycles, results)
        if curves.node.size > 0:
            store_curves(
                at[OUTPUT], good, curve_of, mu, choice, width, period, curves, shown, scratch,
                results,
            )  # fmt: skip


@inlined
def take_common(product: Product, scratch: Scratch, s: Floats) -> int:
    """Inputs that all designs of a table share into the lanes; the others' fields into `varying`.

    Returns how many vary.
    """
    values, at, axes, varying = product.values, scratch.shared, product.other_axes, scratch.varying
    count = 0
    for field in range(BORE, MEAN_TORQUE + 1):
        varies = False
        for i in range(axes.size):
            varies = varies or product.strides[axes[i], field] != 0
        if varies:
            varying[count] = field
            count += 1
        else:
            row = (field - BORE) * lanes.LANES
            s[row : row + lanes.LANES] = values[at[field]]
    return count


@inlined
def take_designs(
    index: int, count: int, designs: int, fields: int, product: Product, scratch: Scratch,
    places: Integers, s: Floats,
) -> None:  # fmt: skip
    """Inputs of `count` designs from `index` on into the lanes; the last one fills what is over.

    Only of the first `fields` of `scratch.varying`, and the places of results. Designs along the
    last axis are a line: `scratch.at` is where the first of the line `scratch.line` lies, so that
    blocks of the same line need not ask again; along it an input is a stride apart or the same.
    """
    values, at, positions = product.values, scratch.at, product.positions
    axes = product.other_axes
    axis, size, first = 0, 1, 0
    if axes.size > 0:
        axis = axes[axes.size - 1]
        size, first = product.shape[axis], product.position_start[axis]
    k = 0
    while k < lanes.LANES:
        here = index % designs + min(k, count - 1)
        line = here // size
        digit = here - line * size
        if line != scratch.line[0]:
            offsets_at(line * size, axes, product, scratch.shared, at)
            scratch.line[0] = line
        run = min(size - digit, count - k) if k < count else lanes.LANES - k
        along = positions[first + digit : first + digit + run]
        for i in range(fields):
            field = scratch.varying[i]
            row = (field - BORE) * lanes.LANES + k
            here_of = s[row : row + run]
            stride = product.strides[axis, field]
            base = at[field] - stride * positions[first]
            if stride == 0:
                here_of[:] = values[base]
            elif k < count:
                for j in range(run):
                    here_of[j] = values[base + stride * along[j]]
            else:
                here_of[:] = values[base + stride * along[0]]
        if k < count:
            stride = product.strides[axis, OUTPUT]
            base = at[OUTPUT] - stride * positions[first]
            for j in range(run):
                places[k + j] = base + stride * along[j]
        k += run


@formula
def solve_block(
    form: lanes.Form, inertia: lanes.Inertia, count: int, width_of_lanes: int, ratio: int,
    width: float, shape: float, least_square: float, invalid: float, choice: Choice,
    results: Results, places: Integers, levels: Levels, s: Floats, changes: Floats, us: Floats,
    rs: Floats, tops: Floats, lows: Floats, chosen: Integers,
) -> None:  # fmt: skip
    """Solve the designs whose inputs and tables are in the lanes; write the first `count` of them.

    `form` and `inertia` are those of `lanes`, `shape` the range of the inertia torque of the table,
    `least_square` the least of its V. Those that are left to `march` have CODE LEFT afterwards.
    """
    coarse = levels.coarse.shape[0]
    step = width * ratio
    lanes.prepare(
        form, inertia, step, coarse, shape, least_square, IDLE,
        float(NO_STEADY_STATE), invalid, levels.constants, width_of_lanes, s,
    )  # fmt: skip
    if len(form) != 2:  # exponent 0 has no load that its work would drive
        lanes.end_of_work(step, width_of_lanes, levels.coarse, levels.constants, s)
    if len(form) == 1:
        lanes.solve_linear(form, width_of_lanes, levels.coarse, s, us, tops, lows)
    elif len(form) == 2:
        lanes.solve_free(inertia, width_of_lanes, levels.coarse, s, us, tops, lows)
    else:
        lanes.iterate(
            form, inertia, choice.iterated, coarse * step, width_of_lanes,
            levels.coarse, s, changes, us, rs, tops, lows,
        )  # fmt: skip
        lanes.mean_speed(form, inertia, width_of_lanes, levels, s, us)
    if hills.candidates(
        inertia, step, least_square, width_of_lanes, levels, s, us, tops, lows
    ):  # fmt: skip
        hills.clear_ripple(form, inertia, ratio, levels, s, us, rs, tops, lows)
    hills.extremes(
        form, inertia, step, ratio, width_of_lanes, levels, s, us, rs, tops, lows, chosen
    )  # fmt: skip
    store_block(count, width_of_lanes, choice.tolerance, s, places, results)


@inlined
def is_left(k: int, places: Integers, results: Results, s: Floats) -> bool:
    """Whether a lane's design is left to `march`; noted where that is asked for."""
    leaves = s[lanes.CODE + k] == lanes.LEFT
    if results.left.size > 0:
        leaves = leaves or results.left[places[k]]
        results.left[places[k]] = leaves
    return leaves


@inlined
def hold_table(
    which: int, ratio: int, product: Product, row_of: Integers, width: float, grid: Grid,
    scratch: Scratch,
) -> None:  # fmt: skip
    """Make the table of place `which`, and its levels, unless they are there; `shared` tells it."""
    shared, table = scratch.shared, scratch.table
    offsets_at(which, product.table_axes, product, product.value_start, shared)
    if scratch.held[0] == which:
        return
    work_tables.build(
        product.values[shared[RATIO]], product.values[shared[OFFSET_RATIO]],
        blend_of(product.values, shared, row_of), table.shape[1], width, grid, table,
        scratch.middles, scratch.rates,
    )  # fmt: skip
    fill_levels(table, width, ratio, scratch.levels)
    scratch.held[0] = which


@kernel
def march_lanes(
    form: lanes.Form,
    inertia: lanes.Inertia,
    begin: int,
    end: int,
    width_of_lanes: int,
    ratio: int,
    product: Product,
    row_of: Integers,
    width: float,
    grid: Grid,
    choice: Choice,
    results: Results,
    scratch: Scratch,
    left: Integers,
    kept: traces.Kept,
) -> int:
    """Solve the designs begin .. end - 1 by `lanes`; return how many are left to `march`.

    Arguments as `march`; `form` and `inertia` are those of `lanes`; `width_of_lanes` is LANES, as a
    number that the compiler does not know. Every `ratio`-th node is a coarse one. `left` gets the
    designs that are left, `kept` what `write_traces` needs unless it is empty.
    """
    wide_vectors()
    width_of_lanes &= WHOLE
    table = scratch.table
    nodes = table.shape[1]
    # Made here, so that the compiler knows that they do not overlap.
    s, chosen = on_stack(NUMBERS), indices_on_stack(LANES)
    size = (nodes // ratio + 2 * lanes.PAD) * lanes.LANES
    of_rest = size if len(form) > 2 else 0
    # In this order: with the last two apart, exponents with powers took a third longer (Xeon).
    changes = rows_on_stack(of_rest)
    us = rows_on_stack(size)
    rs = rows_on_stack(of_rest)
    tops = rows_on_stack(nodes // ratio // CHUNK * lanes.LANES)
    lows = rows_on_stack(nodes // ratio // CHUNK * lanes.LANES)
    lanes.clear(s, changes, us, rs, tops, lows, chosen)
    levels, places = scratch.levels, scratch.places
    designs = count_of(product.other_axes, product)
    ranges = Ranges(0.0, 0.0, 0.0)
    current = -1
    leaving = block = fields = 0
    index = begin
    while index < end:
        which = index // designs
        if which != current:
            current = which
            hold_table(which, ratio, product, row_of, width, grid, scratch)
            ranges = ranges_of(table)
            fields = take_common(product, scratch, s)
            scratch.line[0] = -1
            for k in range(lanes.LANES):
                s[lanes.SWING + k] = ranges.gas
        count = min(min(end, (which + 1) * designs) - index, lanes.LANES)
        take_designs(index, count, designs, fields, product, scratch, places, s)
        solve_block(
            form, inertia, count, width_of_lanes, ratio, width, ranges.shape, ranges.least_square,
            float(INVALID_INPUT), choice, results, places, levels, s, changes, us, rs, tops,
            lows, chosen,
        )  # fmt: skip
        for k in range(count):
            if is_left(k, places, results, s):
                left[leaving] = index + k
                leaving += 1
        if block < kept.targets.shape[0]:
            traces.keep(block, s, us, rs, places, kept)
        block += 1
        index += count
    return leaving


@kernel
def write_traces(
    inertia: lanes.Inertia,
    begin: int,
    end: int,
    width_of_lanes: int,
    ratio: int,
    product: Product,
    row_of: Integers,
    width: float,
    grid: Grid,
    choice: Choice,
    results: Results,
    scratch: Scratch,
    angles: traces.Angles,
    kept: traces.Kept,
    points: Floats,
    ws: Floats,
    ds: Floats,
) -> None:
    """Write the curves of the designs begin .. end - 1, which `march_lanes` has just solved.

    Arguments as there: it makes the same blocks of them. `points`, `ws` and `ds` are scratch.
    """
    width_of_lanes &= WHOLE
    shared, levels = scratch.shared, scratch.levels
    designs = count_of(product.other_axes, product)
    current = -1
    block = 0
    index = begin
    while index < end:
        which = index // designs
        if which != current:
            current = which
            hold_table(which, ratio, product, row_of, width, grid, scratch)
            if scratch.held[1] != which:
                traces.fill_points(
                    product.values[shared[RATIO]], product.values[shared[OFFSET_RATIO]],
                    blend_of(product.values, shared, row_of), grid, scratch.table, levels.fine,
                    ratio, angles, points, scratch.rates,
                )  # fmt: skip
                scratch.held[1] = which
        count = min(min(end, (which + 1) * designs) - index, lanes.LANES)
        traces.write_block(
            count, block, inertia, width * ratio, ratio, width_of_lanes,
            levels, angles, points, kept, ws, ds, results.omega, results.acceleration,
        )  # fmt: skip
        block += 1
        index += count


@kernel
def keys_of(
    begin: int, end: int, rows: int, parts: int, product: Product, keys: Integers
) -> None:  # fmt: skip
    """Panel and row of the designs begin .. end - 1 as one number: panel * rows + row.

    `parts` as in `panels.panel_at`.
    """
    designs = count_of(product.other_axes, product)
    for index in range(begin, end):
        ratio = value_at(RATIO, index // designs, product)
        row = int(math.floor(value_at(ROW, index // designs, product)))
        keys[index - begin] = panels.panel_at(ratio, parts) * rows + row


@kernel
def march_panels(
    form: lanes.Form,
    inertia: lanes.Inertia,
    begin: int,
    order: Integers,
    keys: Integers,
    rows: int,
    table_of: Integers,
    unit_of: Integers,
    points: Floats,
    width_of_lanes: int,
    ratio: int,
    width: float,
    product: Product,
    bases: panels.Panels,
    choice: Choice,
    results: Results,
    scratch: Scratch,
    levels: Levels,
    left: Integers,
) -> int:
    """Solve designs that share no table by `lanes`; return how many are left to `march`.

    `order` are places behind `begin` sorted by their `keys` (see `keys_of`), so that the designs of
    a block share the tables that their own are interpolated from: `table_of` a key, `unit_of` a
    panel, with `points` (panel, POINTS). `levels` is memory for `panels.make_own`'s levels. Other
    arguments as `march_lanes`.
    """
    wide_vectors()
    width_of_lanes &= WHOLE
    values, at, shared, places = product.values, scratch.at, scratch.shared, scratch.places
    nodes = bases.coarse.shape[1] * ratio
    # Made here, so that the compiler knows that they do not overlap.
    s, chosen = on_stack(NUMBERS), indices_on_stack(LANES)
    size = (nodes // ratio + 2 * lanes.PAD) * lanes.LANES
    of_rest = size if len(form) > 2 else 0
    # In this order: with the last two apart, exponents with powers took a third longer (Xeon).
    changes = rows_on_stack(of_rest)
    us = rows_on_stack(size)
    rs = rows_on_stack(of_rest)
    tops = rows_on_stack(nodes // ratio // CHUNK * lanes.LANES)
    lows = rows_on_stack(nodes // ratio // CHUNK * lanes.LANES)
    lanes.clear(s, changes, us, rs, tops, lows, chosen)
    designs = count_of(product.other_axes, product)
    leaving = 0
    place = 0
    while place < order.size:
        key = keys[order[place]]
        panel = key // rows
        first, unit = table_of[key], unit_of[panel]
        second = table_of[key + 1] if table_of[key + 1] >= 0 else first
        count = 1
        while (
            count < lanes.LANES and place + count < order.size and keys[order[place + count]] == key
        ):
            count += 1
        for k in range(lanes.LANES):
            index = begin + order[place + min(k, count - 1)]
            offsets_at(index // designs, product.table_axes, product, product.value_start, shared)
            offsets_at(index % designs, product.other_axes, product, shared, at)
            for field in range(BORE, MEAN_TORQUE + 1):
                s[(field - BORE) * lanes.LANES + k] = values[at[field]]
            places[k] = at[OUTPUT]
            row = values[at[ROW]]
            panels.take_table(
                k, values[at[RATIO]], row - math.floor(row), values[at[SCALE]],
                values[at[CRANKCASE]], first, second, unit, points[panel], bases, s,
            )  # fmt: skip
        panels.fill_block(form, width_of_lanes, first, second, unit, bases, levels, s)
        solve_block(
            form, inertia, count, width_of_lanes, ratio, width,
            bases.numbers[unit + 1, panels.TORQUE_RANGE],
            bases.numbers[unit + 1, panels.LEAST], lanes.LEFT, choice, results, places, levels, s,
            changes, us, rs, tops, lows, chosen,
        )  # fmt: skip
        for k in range(count):
            if is_left(k, places, results, s):
                left[leaving] = begin + order[place + k]
                leaving += 1
        place += count
    return leaving


@inlined
def store(
    target: int, code: int, good: bool, high: float, low: float, mean: float, mu: float,
    error: float, cycles: int, results: Results,
) -> None:  # fmt: skip
    """Write one design's numbers, NaN where it has none."""
    results.status[target] = code
    for result in range(SCALARS):
        row = results.wanted[result]
        if row < 0:
            continue
        if not good:
            value = math.nan
        elif result == DELTA:
            value = (high - low) / mean
        elif result == DELTA_MIDRANGE:
            value = 2.0 * (high - low) / (high + low)
        elif result == OMEGA_MAX:
            value = high
        elif result == OMEGA_MIN:
            value = low
        elif result == OMEGA_MEAN:
            value = mean
        elif result == LOAD_FACTOR:
            value = 1.0 / mu
        elif result == DELTA_ERROR:
            value = error
        else:
            value = float(cycles)
        results.scalars[row, target] = value


@inlined
def store_block(
    count: int, width_of_lanes: int, tolerance: float, s: Floats, places: Integers,
    results: Results,
) -> None:  # fmt: skip
    """Write the numbers of the first `count` lanes as `store` does, but of those that are left.

    A speed that falls to nothing, or an error beyond what is allowed, leaves a design too.
    """
    wide_vectors()
    rows = on_stack(SCALAR_ROWS)
    for k in range(width_of_lanes):
        code, error, nominal = s[lanes.CODE + k], s[lanes.ERROR + k], s[lanes.NOMINAL + k]
        high, low = nominal * s[lanes.TOP + k], nominal * s[lanes.BOTTOM + k]
        mean = nominal * s[lanes.MEAN + k]
        exact = (low > 0.0) & (error <= CAREFUL * tolerance)
        code = lanes.LEFT if (code == CONVERGED) & (not exact) else code
        s[lanes.CODE + k] = code
        nothing = 0.0 if code == CONVERGED else math.nan
        rows[DELTA * lanes.LANES + k] = (high - low) / mean + nothing
        rows[DELTA_MIDRANGE * lanes.LANES + k] = 2.0 * (high - low) / (high + low) + nothing
        rows[OMEGA_MAX * lanes.LANES + k] = high + nothing
        rows[OMEGA_MIN * lanes.LANES + k] = low + nothing
        rows[OMEGA_MEAN * lanes.LANES + k] = mean + nothing
        rows[LOAD_FACTOR * lanes.LANES + k] = 1.0 + nothing
        rows[DELTA_ERROR * lanes.LANES + k] = error + nothing
        rows[ITERATIONS * lanes.LANES + k] = s[lanes.TURNS + k] + nothing
    codes = s[lanes.CODE : lanes.CODE + lanes.LANES]
    for k in range(count):
        if codes[k] >= 0.0:
            results.status[places[k]] = int(codes[k])
    for result in range(SCALARS):
        row = results.wanted[result]
        if row < 0:
            continue
        found = rows[result * lanes.LANES : (result + 1) * lanes.LANES]
        written = results.scalars[row]
        for k in range(count):
            if codes[k] >= 0.0:
                written[places[k]] = found[k]


@inlined
def store_curves(
    target: int, good: bool, design: Design, mu: float, choice: Choice, width: float,
    period: float, curves: Curves, table: Floats, scratch: Scratch, results: Results,
) -> None:  # fmt: skip
    """Write one design's speed and angular acceleration at the wanted angles."""
    nodes = table.shape[1]
    nominal = design.nominal
    for i in range(curves.node.size):
        if not good:
            speed = rate = math.nan
        elif choice.method == THESIS:
            # Along the method's own step, also from the last sample on, where the next one is the
            # start of the cycle and not its end.
            j = int(math.floor(curves.sample[i] + 1e-9))
            share = max(curves.sample[i] - j, 0.0)
            speed, rate = scratch.sampled[SPEEDS, j], scratch.sampled[RATES, j]
            speed += share * period / scratch.sampled.shape[1] * rate / speed
        else:
            j = curves.node[i]
            after = j + 1 if j + 1 < nodes else 0
            left, d_left = slope_at(j, design, mu, choice.variable, table, scratch.records)
            right, d_right = slope_at(after, design, mu, choice.variable, table, scratch.records)
            share = curves.share[i]
            value = interpolate(share, left, right, d_left * width, d_right * width)
            slope = slope_between(share, left, right, d_left * width, d_right * width)
            speed = nominal * math.sqrt(max(value, 0.0))
            rate = 0.5 * nominal * nominal * slope / width
        if results.omega.shape[1] > 0:
            results.omega[target, i] = speed
        if results.acceleration.shape[1] > 0:
            results.acceleration[target, i] = rate


@inlined
def range_of_sum(
    width: float, a: float, b: float, table: Floats, first: tuple[int, int, int],
    second: tuple[int, int, int],
) -> tuple[float, float]:  # fmt: skip
    """Largest and smallest value of a X + b Y; X, Y are named by rows of value, slope, middle."""
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

    Rows of `wanted`: largest torque, smallest torque, energy swing, which is of the torque less a
    load over angle (`over_angle` as in `march`). `table`, `middles`, `rates` and `plain` are
    scratch.
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
                values[shared[RATIO]], values[shared[OFFSET_RATIO]],
                blend_of(values, shared, row_of), table.shape[1], width, grid, table, middles,
                rates,
            )  # fmt: skip
            if loaded:
                keep_gas(table, plain)
        offsets_at(index % designs, product.other_axes, product, shared, at)
        radius = 0.5 * values[at[STROKE]]
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
                scalars[wanted[0], target] = high - values[at[FRICTION]]
            if wanted[1] >= 0:
                scalars[wanted[1], target] = low - values[at[FRICTION]]
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


@kernel
def mean_gas_torque(
    ratio: Floats, offset: Floats, row: Floats, row_of: Integers, grid: Grid, rates: Floats,
    result: Floats,
) -> None:  # fmt: skip
    """Mean over angle of p c/(r omega) [Pa], one cylinder, for paired ratios, offsets and rows.

    `rates` is scratch.
    """
    for i in range(ratio.size):
        whole = int(math.floor(row[i]))
        weight = row[i] - whole
        first = row_of[whole]
        second = row_of[whole + 1] if weight > 0.0 else first
        blend = Blend(first, second, weight, 1.0, 0.0, FRICTIONLESS)
        if offset[i] == 0.0:
            work_tables.rates_of_work(ratio[i], blend, grid, rates)
        else:
            work_tables.rates_with_offset(ratio[i], offset[i], blend, grid, rates)
        total = 0.0
        for place in range(0, rates.size, 3):
            total += work_tables.work_of_half(rates, place)
        result[i] = total / (rates.size // 3)


@kernel
def panels_of(ratio: Floats, number: Integers) -> None:
    """Panel of every crank ratio."""
    for i in range(ratio.size):
        number[i] = panels.panel_at(ratio[i], 1)


@kernel
def mean_gas_between(
    ratio: Floats, row: Floats, number: Integers, row_of: Integers, points: Floats, means: Floats,
    result: Floats,
) -> None:  # fmt: skip
    """As `mean_gas_torque`, from `means` (panel, point, diagram) at the points of each panel."""
    for i in range(ratio.size):
        whole = int(math.floor(row[i]))
        weight = row[i] - whole
        first = row_of[whole]
        second = row_of[whole + 1] if weight > 0.0 else first
        here = points[number[i]]
        total = 0.0
        for j in range(here.shape[1]):
            share = panels.share_of(j, ratio[i], here)
            mean = means[number[i], j]
            total += share * ((1.0 - weight) * mean[first] + weight * mean[second])
        result[i] = total
