"""The one place that loops over designs.

A sweep is a product of axes. Designs that agree in geometry, diagram and arrangement share one
table of work (`tables`); the others of the product are lanes over it. A kernel takes a range of
blocks, each of some designs of one table side by side, finds every design's values by strides into
the inputs (no column of the whole sweep is ever built) and writes each result to its own place.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from engine_dyn.compilation import inlined, kernel
from engine_dyn.speed import tables
from engine_dyn.speed.cycles import (
    SAMPLE_ROWS,
    SPEEDS,
    Samples,
    outcome,
    run_euler,
    sample_shapes,
    start_speed,
)
from engine_dyn.speed.extremes import interpolate, refine, slope_between
from engine_dyn.speed.fixed_point import (
    ETA,
    GAS,
    HALF,
    KAPPA,
    LANE_ROWS,
    LANES,
    LOW,
    LOW_NODE,
    MOST_SWEEPS,
    MU,
    NOMINAL,
    TABLE,
    TOP,
    TOP_NODE,
    TOTAL,
    iterate,
    solve_linear,
)
from engine_dyn.speed.newton import FLOOR, POWER_MEAN, closure_terms, load_terms, newton
from engine_dyn.speed.picard import repeat_cycles
from engine_dyn.speed.product import (
    BORE,
    CRANKCASE,
    EXPONENT,
    FRICTION,
    INERTIA,
    INPUTS,
    MASS,
    MEAN_TORQUE,
    OFFSET,
    OUTPUT,
    PASSES,
    RATIO,
    ROW,
    SCALE,
    SPEED,
    START_ANGLE,
    STROKE,
    Product,
    count_of,
    offsets_at,
)
from engine_dyn.speed.tables import (
    GAS_TORQUE,
    GAS_WORK,
    GAS_WORK_MIDDLE,
    SHAPE,
    SHAPE_MIDDLE,
    SHAPE_SLOPE,
    SQUARE,
    SQUARE_MIDDLE,
    SQUARE_SLOPE,
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

__all__ = [
    "Choice",
    "Curves",
    "Results",
    "Scratch",
    "extremes_of_torque",
    "make_scratch",
    "march",
    "mean_gas_torque",
]

Floats = npt.NDArray[np.float64]
Integers = npt.NDArray[np.int64]

AUTO, THESIS, PICARD, NEWTON, CLOSED = range(5)

SCALARS = 8
DELTA, DELTA_MIDRANGE, OMEGA_MAX, OMEGA_MIN, OMEGA_MEAN, LOAD_FACTOR, DELTA_ERROR, ITERATIONS = (
    range(SCALARS)
)

IDLE = 1e-9
"""A mean torque within this share of the torque's range is no load (contract)."""

NEWTON_STEPS = 60

NEARLY_STALLED = 0.25
"""Below this (omega/omega_n)^2 the powers of the closure are sharp enough to ask for more nodes;
above it the means over all nodes are exact to rounding."""


class Choice(NamedTuple):
    """What all designs of a part have in common.

    `kind` is the class of the load exponent: 0, 1 or 2 for these, 3 for any other.
    """

    method: int
    kind: int
    variable: bool
    closure: int
    tolerance: float


class Curves(NamedTuple):
    """Where curves are wanted: node before each angle, share of the interval, place in samples."""

    node: Integers
    share: Floats
    sample: Floats


class Results(NamedTuple):
    """Arrays of results, one entry a design; `wanted[i]` is the row of result i or -1.

    `omega` and `acceleration` have an empty second axis where they are not wanted.
    """

    wanted: Integers
    scalars: Floats
    status: npt.NDArray[np.int8]
    omega: Floats
    acceleration: Floats


class Scratch(NamedTuple):
    """Working memory of one thread."""

    table: Floats
    middles: Floats
    q: Floats
    z: Floats
    powers: Floats
    lane: Floats
    curve: Floats
    sampled: Floats
    codes: Integers
    counts: Integers
    at: Integers


def make_scratch(nodes: int, lanes: int, samples: int) -> Scratch:
    """Working memory for blocks of `lanes` designs with `nodes` nodes a period."""
    return Scratch(
        table=np.empty((TABLE_ROWS, nodes)),
        middles=np.empty((4, nodes)),
        q=np.empty((nodes, lanes)),
        z=np.empty((nodes, lanes)),
        powers=np.empty((nodes, lanes)),
        lane=np.zeros(LANE_ROWS * LANES),
        curve=np.empty((11, nodes)),
        sampled=np.empty((SAMPLE_ROWS, samples)),
        codes=np.zeros(LANES, dtype=np.int64),
        counts=np.zeros(LANES, dtype=np.int64),
        at=np.zeros((LANES, INPUTS), dtype=np.int64),
    )


W, DW, TAU, DTAU, S = range(5)
"""Rows of `Scratch.curve`; the rest is Newton's."""


@inlined
def blend_of(values: Floats, at: Integers, row_of: Integers) -> Blend:
    """Return the diagram of the design whose inputs lie at `at`."""
    row = values[at[ROW]]
    whole = int(math.floor(row))
    weight = row - whole
    first = row_of[whole]
    second = row_of[whole + 1] if weight > 0.0 else first
    return Blend(first, second, weight, values[at[SCALE]], values[at[CRANKCASE]])


@inlined
def range_of(curve: Floats) -> float:
    """Largest less smallest."""
    high, low = -math.inf, math.inf
    for j in range(curve.size):
        high = max(high, curve[j])
        low = min(low, curve[j])
    return high - low


@inlined
def fill_lane(
    k: int, values: Floats, at: Integers, choice: Choice, table: Floats, lane: Floats
) -> int:
    """Reduced parameters of one design (see `fixed_point`) into its lane; return its outcome."""
    radius = 0.5 * values[at[STROKE]]
    lever = 0.25 * math.pi * values[at[BORE]] ** 2 * radius
    throw = values[at[MASS]] * radius * radius
    speed = values[at[SPEED]]
    energy = 0.5 * values[at[INERTIA]] * speed * speed
    surplus = values[at[MEAN_TORQUE]] - values[at[OFFSET]]
    code = CONVERGED
    # Idle or loaded: the ranges of both parts bound the torque's, and decide nearly always.
    moment = throw * speed * speed
    swing = lever * lane[GAS_RANGE] + moment * lane[SHAPE_RANGE]
    if abs(surplus) <= IDLE * swing:
        high, low = -math.inf, math.inf
        for j in range(table.shape[1]):
            torque = lever * table[TORQUE, j] + moment * table[SHAPE, j]
            high = max(high, torque)
            low = min(low, torque)
        swing = high - low
    if abs(surplus) <= IDLE * swing:
        surplus = 0.0
    elif surplus < 0.0:
        code = NO_STEADY_STATE
    lane[NOMINAL + k] = speed
    lane[HALF + k] = 0.5 * values[at[EXPONENT]]
    lane[GAS + k] = lever / energy
    lane[ETA + k] = throw / values[at[INERTIA]]
    lane[KAPPA + k] = surplus / energy
    lane[MU + k] = 1.0
    if choice.variable and 1.0 + lane[ETA + k] * lane[LEAST_SQUARE] <= 0.0:
        code = INVALID_INPUT
    if choice.method == CLOSED and choice.kind != 0 and choice.kind != 2:
        code = INVALID_INPUT
    if code != CONVERGED:
        # A harmless stand-in, so that the other lanes can go on.
        lane[GAS + k] = 0.0
        lane[ETA + k] = 0.0
        lane[KAPPA + k] = 0.0
    return code


GAS_RANGE, SHAPE_RANGE, LEAST_SQUARE = TABLE, TABLE + 1, TABLE + 2
"""Places in `Scratch.lane` for three numbers of the table."""


@inlined
def fill_curve(k: int, variable: bool, table: Floats, lane: Floats, curve: Floats) -> None:
    """One design's w, w', tau and tau' at the nodes (see `newton`)."""
    gas, eta = lane[GAS + k], lane[ETA + k]
    for j in range(table.shape[1]):
        curve[W, j] = gas * table[GAS_WORK, j]
        curve[DW, j] = gas * table[GAS_TORQUE, j]
        curve[TAU, j] = 1.0
        curve[DTAU, j] = 0.0
        if variable:
            curve[TAU, j] += eta * table[SQUARE, j]
            curve[DTAU, j] = eta * table[SQUARE_SLOPE, j]
        else:
            curve[W, j] -= eta * table[SQUARE, j]
            curve[DW, j] -= eta * table[SQUARE_SLOPE, j]


@inlined
def take_curve(k: int, curve: Floats, lane: Floats, q: Floats, powers: Floats) -> None:
    """Solution of one design from its curve back into its lane, with extremes and mean."""
    half = lane[HALF + k]
    lane[TOP + k], lane[LOW + k], lane[TOTAL + k] = -math.inf, math.inf, 0.0
    for j in range(q.shape[0]):
        value = (1.0 + curve[W, j] + curve[S, j]) / curve[TAU, j]
        q[j, k] = value
        powers[j, k], _, _ = load_terms(value, half)
        lane[TOTAL + k] += math.sqrt(max(value, 0.0))
        if value > lane[TOP + k]:
            lane[TOP + k] = value
            lane[TOP_NODE + k] = float(j)
        if value < lane[LOW + k]:
            lane[LOW + k] = value
            lane[LOW_NODE + k] = float(j)


@inlined
def slope_at(
    j: int, k: int, variable: bool, table: Floats, lane: Floats, q: Floats, powers: Floats
) -> float:
    """Exact slope of q at a node: q' = (w' - kappa (F/mu - 1) - q tau')/tau."""
    slope = lane[GAS + k] * table[GAS_TORQUE, j] - lane[KAPPA + k] * (
        powers[j, k] / lane[MU + k] - 1.0
    )
    turn = lane[ETA + k] * table[SQUARE_SLOPE, j]
    if variable:
        return (slope - q[j, k] * turn) / (1.0 + lane[ETA + k] * table[SQUARE, j])
    return slope - turn


@inlined
def extreme_of_speed(
    node: int, upward: float, k: int, width: float, variable: bool, table: Floats, lane: Floats,
    q: Floats, powers: Floats,
) -> tuple[float, float]:  # fmt: skip
    """Extreme of q near its largest (upward = 1) or smallest (-1) node, and the middle's share."""
    nodes = q.shape[0]
    here = slope_at(node, k, variable, table, lane, q, powers)
    ahead = here * upward > 0.0
    left = node if ahead else (node - 1 if node > 0 else nodes - 1)
    right = left + 1 if left + 1 < nodes else 0
    d_left = width * (here if ahead else slope_at(left, k, variable, table, lane, q, powers))
    d_right = width * (slope_at(right, k, variable, table, lane, q, powers) if ahead else here)
    if not (d_left * upward > 0.0 and d_right * upward < 0.0):
        return q[node, k], 0.0
    gas, eta = lane[GAS + k], lane[ETA + k]
    if variable:
        # The middle of q from the middles of energy and inertia, both known.
        tau_left = 1.0 + eta * table[SQUARE, left]
        tau_right = 1.0 + eta * table[SQUARE, right]
        turn_left = eta * table[SQUARE_SLOPE, left] * width
        turn_right = eta * table[SQUARE_SLOPE, right] * width
        energy = gas * table[GAS_WORK_MIDDLE, left] + interpolate(
            0.5, q[left, k] * tau_left, q[right, k] * tau_right,
            d_left * tau_left + q[left, k] * turn_left,
            d_right * tau_right + q[right, k] * turn_right,
        )  # fmt: skip
        tau = eta * table[SQUARE_MIDDLE, left] + interpolate(
            0.5, tau_left, tau_right, turn_left, turn_right
        )
        middle = energy / tau - interpolate(0.5, q[left, k], q[right, k], d_left, d_right)
    else:
        middle = gas * table[GAS_WORK_MIDDLE, left] - eta * table[SQUARE_MIDDLE, left]
    value, _, bump = refine(q[left, k], q[right, k], d_left, d_right, middle)
    return value, abs(bump)


@inlined
def unresolved(k: int, half: float, closure: int, q: Floats) -> float:
    """Relative difference of the means over even and odd nodes: of the speed and of the closure."""
    even = odd = even_closure = odd_closure = 0.0
    for j in range(0, q.shape[0], 2):
        even += math.sqrt(max(q[j, k], 0.0))
        odd += math.sqrt(max(q[j + 1, k], 0.0))
        value, _ = closure_terms(q[j, k], half, closure)
        even_closure += value
        value, _ = closure_terms(q[j + 1, k], half, closure)
        odd_closure += value
    return abs(even - odd) / (even + odd) + abs(even_closure - odd_closure) / q.shape[0]


@inlined
def extremes_at_nodes(q: Floats, lane: Floats) -> None:
    """Extremes at the nodes, where they are, and the sum of the speeds, all lanes together."""
    lanes = q.shape[1]
    for k in range(lanes):
        lane[TOP + k] = -1e300
        lane[LOW + k] = 1e300
        lane[TOTAL + k] = 0.0
    for j in range(q.shape[0]):
        row = q[j]
        here = float(j)
        for k in range(lanes):
            value = row[k]
            high, low = lane[TOP + k], lane[LOW + k]
            lane[TOTAL + k] += math.sqrt(value if value > 0.0 else 0.0)
            lane[TOP_NODE + k] = here if value > high else lane[TOP_NODE + k]
            lane[LOW_NODE + k] = here if value < low else lane[LOW_NODE + k]
            lane[TOP + k] = value if value > high else high
            lane[LOW + k] = value if value < low else low


@inlined
def solve_block(
    width: float, choice: Choice, table: Floats, scratch: Scratch, powers: Floats
) -> None:
    """Periodic solution of all lanes at the nodes: q and F; outcomes and counts of iterations."""
    nodes, lanes = scratch.q.shape
    lane, q, codes, counts = scratch.lane, scratch.q, scratch.codes, scratch.counts
    for k in range(lanes):
        counts[k] = 1
    alone = choice.method == NEWTON or (
        choice.method == CLOSED and choice.kind != 0 and choice.variable
    )
    if not alone:
        if choice.kind == 2 and not choice.variable and choice.closure == POWER_MEAN:
            solve_linear(nodes, width, table, q, lane)
        else:
            iterate(
                nodes, width, table, choice.kind, choice.variable, choice.closure,
                1e-5 * choice.tolerance, q, scratch.z, powers, lane, counts,
            )  # fmt: skip
    for k in range(lanes):
        if codes[k] != CONVERGED or (not alone and counts[k] > 0):
            continue
        fill_curve(k, choice.variable, table, lane, scratch.curve)
        for j in range(nodes):
            scratch.curve[S, j] = 0.0
        steps, mu, _, smallest = newton(
            lane[KAPPA + k], lane[HALF + k], choice.closure, width, nodes, scratch.curve[W],
            scratch.curve[DW], scratch.curve[TAU], scratch.curve[DTAU], scratch.curve[S],
            scratch.curve[5:], 1e-7, NEWTON_STEPS,
        )  # fmt: skip
        lane[MU + k] = mu
        counts[k] = abs(steps) + (0 if alone else MOST_SWEEPS)
        if steps < 0:
            codes[k] = NOT_CONVERGED if smallest > FLOOR else STALLED
        take_curve(k, scratch.curve, lane, q, powers)
    extremes_at_nodes(q, lane)


@inlined
def speeds_of(
    k: int, width: float, variable: bool, table: Floats, lane: Floats, q: Floats, powers: Floats
) -> tuple[float, float, float, float]:
    """Largest, smallest and mean speed of a lane [rad/s], and what the extremes may miss.

    The extremes are NaN where the smallest is no speed any more.
    """
    nominal = lane[NOMINAL + k]
    high, high_miss = extreme_of_speed(
        int(lane[TOP_NODE + k]), 1.0, k, width, variable, table, lane, q, powers
    )
    low, low_miss = extreme_of_speed(
        int(lane[LOW_NODE + k]), -1.0, k, width, variable, table, lane, q, powers
    )
    if not (low > FLOOR):
        return math.nan, math.nan, math.nan, math.nan
    high, low = math.sqrt(high), math.sqrt(low)
    miss = 0.5 * nominal * (high_miss / high + low_miss / low)
    return nominal * high, nominal * low, nominal * lane[TOTAL + k] / q.shape[0], miss


@inlined
def run_picard(
    k: int, width: float, cylinders: int, choice: Choice, values: Floats, at: Integers,
    scratch: Scratch, powers: Floats,
) -> tuple[int, bool, bool]:  # fmt: skip
    """Repeat the cycles of one lane in the energy form; cycles, whether closed, whether stalled."""
    lane, curve, q = scratch.lane, scratch.curve, scratch.q
    nodes = q.shape[0]
    fill_curve(k, choice.variable, scratch.table, lane, curve)
    passes = int(values[at[PASSES]])
    cycles, closed, stalled = repeat_cycles(
        lane[KAPPA + k], lane[HALF + k], width, nodes, curve[W], curve[DW], curve[TAU],
        curve[DTAU], curve[S], (start_speed(values, at) / lane[NOMINAL + k]) ** 2,
        int(round(values[at[START_ANGLE]] / width)) % nodes, cylinders, passes,
        1e-3 * choice.tolerance,
    )  # fmt: skip
    if passes == 0 and closed and (lane[KAPPA + k] == 0.0 or choice.kind == 0):
        # No load torque that depends on speed: every cycle closes, whatever its speed; the closure
        # fixes the constant.
        for j in range(nodes):
            curve[S, j] = q[j, k] * curve[TAU, j] - 1.0 - curve[W, j]
    if not stalled:
        lane[MU + k] = 1.0
        take_curve(k, curve, lane, q, powers)
    return cycles, closed, stalled


@kernel
def march(
    begin: int,
    end: int,
    product: Product,
    row_of: Integers,
    width: float,
    grid: Grid,
    samples: Samples,
    choice: Choice,
    curves: Curves,
    results: Results,
    scratch: Scratch,
) -> None:
    """Solve the designs of the blocks begin .. end - 1.

    `row_of` maps rows of the family to rows of the grid, `width` is the angle between nodes.
    """
    table, lane, q = scratch.table, scratch.lane, scratch.q
    values = product.values
    nodes, lanes = q.shape
    cylinders = grid.node_sine.size // nodes
    period = width * grid.node_sine.size
    designs = count_of(product.lane_axes, product)
    blocks = (designs + lanes - 1) // lanes
    # With exponent 2 the load's power F is q itself.
    powers = q if (
        choice.kind == 2 and not choice.variable and choice.closure == POWER_MEAN
        and choice.method != NEWTON
    ) else scratch.powers  # fmt: skip
    shared = np.zeros(INPUTS, dtype=np.int64)
    current = -1
    for block in range(begin, end):
        which = block // blocks
        if which != current:
            current = which
            offsets_at(which, product.table_axes, product, product.value_start, shared)
            blend = blend_of(values, shared, row_of)
            tables.build(values[shared[RATIO]], blend, nodes, width, grid, table, scratch.middles)
            lane[GAS_RANGE] = range_of(table[TORQUE])
            lane[SHAPE_RANGE] = range_of(table[SHAPE])
            lane[LEAST_SQUARE] = table[SQUARE].min()
            if choice.method == THESIS:
                sample_shapes(values[shared[RATIO]], blend, samples, scratch.sampled)

        # The block's designs; the last block is filled up with copies of its last design.
        first = (block % blocks) * lanes
        filled = min(lanes, designs - first)
        for k in range(lanes):
            design = first + min(k, filled - 1)
            offsets_at(design, product.lane_axes, product, shared, scratch.at[k])
            scratch.codes[k] = fill_lane(k, values, scratch.at[k], choice, table, lane)
        solve_block(width, choice, table, scratch, powers)

        for k in range(filled):
            at = scratch.at[k]
            code = scratch.codes[k]
            cycles = scratch.counts[k]
            high = low = mean = math.nan
            error = 0.0
            if code == CONVERGED:
                high, low, mean, miss = speeds_of(k, width, choice.variable, table, lane, q, powers)
                if not (low > 0.0):
                    code = STALLED
                else:
                    error = miss / (high - low) if high > low else 0.0
                    if low < lane[NOMINAL + k] * math.sqrt(NEARLY_STALLED):
                        error += unresolved(k, lane[HALF + k], choice.closure, q)
                    if error > choice.tolerance:
                        code = TOLERANCE_NOT_MET
            repeats = choice.method == THESIS or choice.method == PICARD
            if repeats and code != NO_STEADY_STATE and code != INVALID_INPUT:
                delta = (high - low) / mean
                if choice.method == THESIS:
                    cycles, closed, stalled, high, low, mean = run_euler(
                        values, at, lane[KAPPA + k] == 0.0, choice.variable, period,
                        scratch.sampled,
                    )  # fmt: skip
                else:
                    cycles, closed, stalled = run_picard(
                        k, width, cylinders, choice, values, at, scratch, powers
                    )
                    if not stalled:
                        high, low, mean, _ = speeds_of(
                            k, width, choice.variable, table, lane, q, powers
                        )
                        stalled = not (low > 0.0)
                # What the method misses, measured against the periodic solution.
                if delta > 0.0:
                    error += abs((high - low) / mean - delta) / delta
                passes = int(values[at[PASSES]])
                code = outcome(stalled, passes, closed, error, choice.tolerance)
            good = code == CONVERGED or code == TOLERANCE_NOT_MET or code == PASSES_DONE
            store(at[OUTPUT], code, good, high, low, mean, lane[MU + k], error, cycles, results)
            if curves.node.size > 0:
                store_curves(
                    k, at[OUTPUT], good, choice, width, period, curves, scratch, powers, results
                )


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
def store_curves(
    k: int, target: int, good: bool, choice: Choice, width: float, period: float, curves: Curves,
    scratch: Scratch, powers: Floats, results: Results,
) -> None:  # fmt: skip
    """Write one design's speed and angular acceleration at the wanted angles."""
    table, lane, q = scratch.table, scratch.lane, scratch.q
    nominal = lane[NOMINAL + k]
    for i in range(curves.node.size):
        if not good:
            speed = rate = math.nan
        elif choice.method == THESIS:
            sampled = scratch.sampled[SPEEDS]
            j = int(math.floor(curves.sample[i] + 1e-9))
            after = j + 1 if j + 1 < sampled.size else 0
            share = max(curves.sample[i] - j, 0.0)
            speed = (1.0 - share) * sampled[j] + share * sampled[after]
            # The method's own: what its step from this sample adds, over the step's time.
            rate = speed * (sampled[after] - sampled[j]) * sampled.size / period
        else:
            j = curves.node[i]
            after = j + 1 if j + 1 < q.shape[0] else 0
            d_left = width * slope_at(j, k, choice.variable, table, lane, q, powers)
            d_right = width * slope_at(after, k, choice.variable, table, lane, q, powers)
            share = curves.share[i]
            value = interpolate(share, q[j, k], q[after, k], d_left, d_right)
            slope = slope_between(share, q[j, k], q[after, k], d_left, d_right)
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
    lanes: int,
    product: Product,
    row_of: Integers,
    width: float,
    grid: Grid,
    wanted: Integers,
    scalars: Floats,
    table: Floats,
    middles: Floats,
) -> None:
    """Extremes of the torque at nominal speed and the energy swing, for a range of blocks.

    Rows of `wanted`: largest torque, smallest torque, energy swing. `table` and `middles` are
    scratch; `lanes` is the number of designs of a block.
    """
    values = product.values
    designs = count_of(product.lane_axes, product)
    blocks = (designs + lanes - 1) // lanes
    shared = np.zeros(INPUTS, dtype=np.int64)
    at = np.zeros(INPUTS, dtype=np.int64)
    current = -1
    for block in range(begin, end):
        which = block // blocks
        if which != current:
            current = which
            offsets_at(which, product.table_axes, product, product.value_start, shared)
            tables.build(
                values[shared[RATIO]], blend_of(values, shared, row_of), table.shape[1], width,
                grid, table, middles,
            )  # fmt: skip
        first = (block % blocks) * lanes
        for design in range(first, min(first + lanes, designs)):
            offsets_at(design, product.lane_axes, product, shared, at)
            radius = 0.5 * values[at[STROKE]]
            lever = 0.25 * math.pi * values[at[BORE]] ** 2 * radius
            moment = values[at[MASS]] * (radius * values[at[SPEED]]) ** 2
            target = at[OUTPUT]
            if wanted[0] >= 0 or wanted[1] >= 0:
                high, low = range_of_sum(
                    width, lever, moment, table,
                    (TORQUE, TORQUE_SLOPE, TORQUE_MIDDLE), (SHAPE, SHAPE_SLOPE, SHAPE_MIDDLE),
                )  # fmt: skip
                if wanted[0] >= 0:
                    scalars[wanted[0], target] = high - values[at[FRICTION]]
                if wanted[1] >= 0:
                    scalars[wanted[1], target] = low - values[at[FRICTION]]
            if wanted[2] >= 0:
                high, low = range_of_sum(
                    width, lever, -0.5 * moment, table,
                    (GAS_WORK, GAS_TORQUE, GAS_WORK_MIDDLE),
                    (SQUARE, SQUARE_SLOPE, SQUARE_MIDDLE),
                )  # fmt: skip
                scalars[wanted[2], target] = high - low


@kernel
def mean_gas_torque(
    ratio: Floats, row: Floats, row_of: Integers, grid: Grid, result: Floats
) -> None:
    """Mean over angle of p c/(r omega) [Pa], one cylinder, for paired crank ratios and rows."""
    points = grid.quadrature_sine.size
    for i in range(ratio.size):
        whole = int(math.floor(row[i]))
        weight = row[i] - whole
        first = row_of[whole]
        second = row_of[whole + 1] if weight > 0.0 else first
        blend = Blend(first, second, weight, 1.0, 0.0)
        total = 0.0
        for place in range(0, points, 3):
            total += tables.work_of_half(blend, grid, ratio[i], place, 1.0)
        # Each half counts for half an interval; there are points/6 intervals.
        result[i] = total / (points / 6.0)
