"""The one place that loops over designs.

A sweep is a product of axes. Designs that agree in geometry, diagram and arrangement share one
table of work (`tables`); the others of the product are lanes over it. A kernel takes a range of
blocks, each of up to `LANES` designs of one table, finds every design's values by strides into the
inputs (no column of the whole sweep is ever built) and writes each result to its own place.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from engine_dyn.compilation import inlined, kernel
from engine_dyn.slider_crank import acceleration_at, velocity_at
from engine_dyn.speed import tables
from engine_dyn.speed.euler import march_cycles
from engine_dyn.speed.extremes import interpolate, refine
from engine_dyn.speed.fixed_point import (
    ALPHA,
    ETA,
    GAS,
    HALF,
    KAPPA,
    LANES,
    LOW,
    LOW_NODE,
    MOST_SWEEPS,
    MU,
    NOMINAL,
    TOP,
    TOP_NODE,
    TOTAL,
    iterate,
    solve_linear,
)
from engine_dyn.speed.newton import FLOOR, POWER_MEAN, closure_terms, load_terms, newton
from engine_dyn.speed.picard import MOST_CYCLES, repeat_cycles
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
    TORQUE,
    TORQUE_MIDDLE,
    TORQUE_SLOPE,
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

__all__ = ["LANES", "extremes_of_torque", "march", "mean_gas_torque"]

Floats = npt.NDArray[np.float64]
Integers = npt.NDArray[np.int64]

AUTO, THESIS, PICARD, NEWTON, CLOSED = range(5)

# Inputs of a design, in the order of `offsets`.
INPUTS = 17
(
    RATIO,
    ROW,
    SCALE,
    CRANKCASE,
    BORE,
    STROKE,
    MASS,
    SPEED,
    INERTIA,
    EXPONENT,
    OFFSET,
    MEAN_TORQUE,
    FRICTION,
    START_SPEED,
    PASSES,
    START_ANGLE,
    OUTPUT,
) = range(INPUTS)
TABLE_INPUTS = 4

SCALARS = 8
(
    DELTA,
    DELTA_MIDRANGE,
    OMEGA_MAX,
    OMEGA_MIN,
    OMEGA_MEAN,
    LOAD_FACTOR,
    DELTA_ERROR,
    ITERATIONS,
) = range(SCALARS)

IDLE = 1e-9
"""A mean torque within this share of the torque's range is no load (contract)."""

NEWTON_STEPS = 60

NEARLY_STALLED = 0.25
"""Below this (omega/omega_n)^2 the powers of the closure are sharp enough to ask for more nodes;
above it the means over all nodes are exact to rounding."""


@inlined
def place(
    index: int,
    wanted: Integers,
    shape: Integers,
    strides: Integers,
    positions: Integers,
    position_start: Integers,
    offsets: Integers,
) -> None:
    """Offsets of every input at flat `index` over the axes `wanted`, last axis fastest."""
    for i in range(INPUTS):
        offsets[i] = 0
    for back in range(wanted.size):
        axis = wanted[wanted.size - 1 - back]
        size = shape[axis]
        here = positions[position_start[axis] + index % size]
        index //= size
        for i in range(INPUTS):
            offsets[i] += strides[i, axis] * here


@inlined
def samples_of_cycle(
    ratio: float,
    first: int,
    second: int,
    weight: float,
    scale: float,
    crankcase: float,
    at_sample: Floats,
    sine: Floats,
    cosine: Floats,
    sampled: Floats,
) -> None:
    """Torque shapes at each sample of the cycle, all cylinders: gas, inertia, V and its slope."""
    cylinders, samples = sine.shape
    for j in range(samples):
        gas = shape = square = slope = 0.0
        for i in range(cylinders):
            v = velocity_at(sine[i, j], cosine[i, j], ratio)
            b = acceleration_at(sine[i, j], cosine[i, j], ratio)
            p = scale * ((1.0 - weight) * at_sample[first, i, j] + weight * at_sample[second, i, j])
            gas += (p - crankcase) * v
            shape -= b * v
            square += v * v
            slope += 2.0 * v * b
        sampled[0, j] = gas
        sampled[1, j] = shape
        sampled[2, j] = square
        sampled[3, j] = slope
    mean = 0.0
    for j in range(samples):
        mean += sampled[2, j]
    mean /= samples
    for j in range(samples):
        sampled[2, j] -= mean


@inlined
def extreme_near(
    node: int,
    upward: float,
    nodes: int,
    width: float,
    table: Floats,
    gas: float,
    eta: float,
    kappa: float,
    mu: float,
    variable: bool,
    q: Floats,
    force: Floats,
    lane: int,
) -> tuple[float, float]:
    """Extreme of q around its largest (upward = 1) or smallest (-1) node, and the middle's share.

    The slope at a node is exact: q' = (w' - kappa (F/mu - 1) - q tau')/tau.
    """
    slopes = (0.0, 0.0, 0.0)
    for shift in range(3):
        j = node + shift - 1
        j = j + nodes if j < 0 else (j - nodes if j >= nodes else j)
        f = kappa * (force[j, lane] / mu - 1.0)
        if variable:
            slope = (gas * table[GAS_TORQUE, j] - f - q[j, lane] * eta * table[SQUARE_SLOPE, j]) / (
                1.0 + eta * table[SQUARE, j]
            )
        else:
            slope = gas * table[GAS_TORQUE, j] - f - eta * table[SQUARE_SLOPE, j]
        slopes = (slopes[1], slopes[2], slope)
    ahead = slopes[1] * upward > 0.0
    left = node if ahead else (node - 1 if node > 0 else nodes - 1)
    right = left + 1 if left + 1 < nodes else 0
    d_left = (slopes[1] if ahead else slopes[0]) * width
    d_right = (slopes[2] if ahead else slopes[1]) * width
    if not (d_left * upward > 0.0 and d_right * upward < 0.0):
        return q[node, lane], 0.0
    if variable:
        # The middle of q from the middles of energy and inertia, both known.
        tau_left = 1.0 + eta * table[SQUARE, left]
        tau_right = 1.0 + eta * table[SQUARE, right]
        turn_left = eta * table[SQUARE_SLOPE, left]
        turn_right = eta * table[SQUARE_SLOPE, right]
        e_left = q[left, lane] * tau_left
        e_right = q[right, lane] * tau_right
        rise = d_left * tau_left + q[left, lane] * turn_left * width
        fall = d_right * tau_right + q[right, lane] * turn_right * width
        energy = interpolate(0.5, e_left, e_right, rise, fall) + gas * table[GAS_WORK_MIDDLE, left]
        tau = (
            interpolate(0.5, tau_left, tau_right, turn_left * width, turn_right * width)
            + eta * table[SQUARE_MIDDLE, left]
        )
        middle = energy / tau - interpolate(0.5, q[left, lane], q[right, lane], d_left, d_right)
    else:
        middle = gas * table[GAS_WORK_MIDDLE, left] - eta * table[SQUARE_MIDDLE, left]
    value, _, bump = refine(q[left, lane], q[right, lane], d_left, d_right, middle)
    return value, abs(bump)


@inlined
def unresolved(nodes: int, q: Floats, lane: int, half: float, closure: int) -> float:
    """Relative difference of the means over even and odd nodes: of the speed and of the closure."""
    even = odd = even_closure = odd_closure = 0.0
    for j in range(0, nodes, 2):
        even += math.sqrt(max(q[j, lane], 0.0))
        odd += math.sqrt(max(q[j + 1, lane], 0.0))
        value, _ = closure_terms(q[j, lane], half, closure)
        even_closure += value
        value, _ = closure_terms(q[j + 1, lane], half, closure)
        odd_closure += value
    return abs(even - odd) / (even + odd) + abs(even_closure - odd_closure) / nodes


@kernel
def march(
    begin: int,
    end: int,
    table_axes: Integers,
    lane_axes: Integers,
    shape: Integers,
    strides: Integers,
    positions: Integers,
    position_start: Integers,
    values: Floats,
    value_start: Integers,
    row_of: Integers,
    cylinders: int,
    nodes: int,
    width: float,
    at_node: Floats,
    slope_at_node: Floats,
    at_middle: Floats,
    at_quadrature: Floats,
    node_sine: Floats,
    node_cosine: Floats,
    middle_sine: Floats,
    middle_cosine: Floats,
    quadrature_sine: Floats,
    quadrature_cosine: Floats,
    at_sample: Floats,
    sample_sine: Floats,
    sample_cosine: Floats,
    method: int,
    kind: int,
    variable: bool,
    closure: int,
    tolerance: float,
    output_node: Integers,
    output_share: Floats,
    output_sample: Floats,
    wanted: Integers,
    scalars: Floats,
    status: npt.NDArray[np.int8],
    omega: Floats,
    acceleration: Floats,
    table: Floats,
    middles: Floats,
    q: Floats,
    z: Floats,
    force: Floats,
    lane: Floats,
    single: Floats,
    sampled: Floats,
) -> None:
    """Solve the designs of the blocks begin .. end - 1; see `speed.solve` for the arguments.

    `wanted[i]` is the row of `scalars` that gets result i, or -1. The last eight arrays are
    scratch of the calling thread.
    """
    steps = nodes * cylinders
    samples = sample_sine.shape[1]
    designs = 1
    for i in range(lane_axes.size):
        designs *= shape[lane_axes[i]]
    lanes = q.shape[1]
    blocks = (designs + lanes - 1) // lanes
    table_offsets = np.zeros(INPUTS, dtype=np.int64)
    lane_offsets = np.zeros(INPUTS, dtype=np.int64)
    targets = np.zeros(LANES, dtype=np.int64)
    codes = np.zeros(LANES, dtype=np.int64)
    sweeps = np.zeros(LANES, dtype=np.int64)
    counts = np.zeros(LANES, dtype=np.int64)
    current = -1
    ratio = crankcase = scale = weight = gas_range = shape_range = 0.0
    least_square = 0.0
    first = second = 0
    w, dw, tau, dtau, s = single[0], single[1], single[2], single[3], single[4]
    newton_work = single[5:11]

    for block in range(begin, end):
        which = block // blocks
        if which != current:
            current = which
            place(which, table_axes, shape, strides, positions, position_start, table_offsets)
            ratio = values[value_start[RATIO] + table_offsets[RATIO]]
            row = values[value_start[ROW] + table_offsets[ROW]]
            scale = values[value_start[SCALE] + table_offsets[SCALE]]
            crankcase = values[value_start[CRANKCASE] + table_offsets[CRANKCASE]]
            whole = int(math.floor(row))
            weight = row - whole
            first = row_of[whole]
            second = row_of[whole + 1] if weight > 0.0 else first
            tables.build(
                ratio, first, second, weight, scale, crankcase, nodes, steps, width,
                at_node, slope_at_node, at_middle, at_quadrature,
                node_sine, node_cosine, middle_sine, middle_cosine,
                quadrature_sine, quadrature_cosine, table, middles,
            )  # fmt: skip
            gas_range = table[TORQUE].max() - table[TORQUE].min()
            shape_range = table[SHAPE].max() - table[SHAPE].min()
            least_square = table[SQUARE].min()
            if method == THESIS:
                samples_of_cycle(
                    ratio, first, second, weight, scale, crankcase,
                    at_sample, sample_sine, sample_cosine, sampled,
                )  # fmt: skip

        # The block's designs; the last block is filled up with copies of its last design.
        lane_first = (block % blocks) * lanes
        filled = min(lanes, designs - lane_first)
        for k in range(lanes):
            if k < filled:
                place(
                    lane_first + k, lane_axes, shape, strides, positions, position_start,
                    lane_offsets,
                )  # fmt: skip
                for i in range(INPUTS):
                    lane_offsets[i] += table_offsets[i]
            bore = values[value_start[BORE] + lane_offsets[BORE]]
            radius = 0.5 * values[value_start[STROKE] + lane_offsets[STROKE]]
            mass = values[value_start[MASS] + lane_offsets[MASS]]
            speed = values[value_start[SPEED] + lane_offsets[SPEED]]
            inertia = values[value_start[INERTIA] + lane_offsets[INERTIA]]
            lane[ALPHA + k] = values[value_start[EXPONENT] + lane_offsets[EXPONENT]]
            surplus = (
                values[value_start[MEAN_TORQUE] + lane_offsets[MEAN_TORQUE]]
                - values[value_start[OFFSET] + lane_offsets[OFFSET]]
            )
            targets[k] = lane_offsets[OUTPUT]
            lever = 0.25 * math.pi * bore * bore * radius
            throw = mass * radius * radius
            energy = 0.5 * inertia * speed * speed
            lane[NOMINAL + k] = speed
            lane[HALF + k] = 0.5 * lane[ALPHA + k]
            lane[GAS + k] = lever / energy
            lane[ETA + k] = throw / inertia
            codes[k] = CONVERGED
            # Idle or loaded: a bound on the torque's range decides nearly always.
            swing = lever * gas_range + throw * speed * speed * shape_range
            if abs(surplus) <= IDLE * swing:
                highest, lowest = -math.inf, math.inf
                for j in range(nodes):
                    torque = lever * table[TORQUE, j] + throw * speed * speed * table[SHAPE, j]
                    highest = max(highest, torque)
                    lowest = min(lowest, torque)
                swing = highest - lowest
            if abs(surplus) <= IDLE * swing:
                surplus = 0.0
            elif surplus < 0.0:
                codes[k] = NO_STEADY_STATE
            if variable and 1.0 + lane[ETA + k] * least_square <= 0.0:
                codes[k] = INVALID_INPUT
            if method == CLOSED and kind != 0 and kind != 2:
                codes[k] = INVALID_INPUT
            lane[KAPPA + k] = surplus / energy
            if codes[k] != CONVERGED:
                # A harmless stand-in, so that the other lanes can go on.
                lane[GAS + k] = 0.0
                lane[ETA + k] = 0.0
                lane[KAPPA + k] = 0.0
            lane[MU + k] = 1.0
            sweeps[k] = 1

        # The periodic solution at the nodes: q and F of every lane.
        powers = force
        together = method == AUTO or method == THESIS or method == PICARD or (
            method == CLOSED and (kind == 0 or not variable)
        )
        if together:
            if kind == 2 and not variable and closure == POWER_MEAN:
                solve_linear(nodes, width, table, q, lane)
                powers = q  # the exponent is 2: F is q itself
            else:
                iterate(
                    nodes, width, table, kind, variable, closure, 1e-5 * tolerance, q, z, force,
                    lane, sweeps,
                )  # fmt: skip
        for k in range(lanes):
            counts[k] = sweeps[k]
            if codes[k] != CONVERGED or (together and sweeps[k] > 0):
                continue
            for j in range(nodes):
                w[j] = lane[GAS + k] * table[GAS_WORK, j]
                dw[j] = lane[GAS + k] * table[GAS_TORQUE, j]
                if variable:
                    tau[j] = 1.0 + lane[ETA + k] * table[SQUARE, j]
                    dtau[j] = lane[ETA + k] * table[SQUARE_SLOPE, j]
                else:
                    w[j] -= lane[ETA + k] * table[SQUARE, j]
                    dw[j] -= lane[ETA + k] * table[SQUARE_SLOPE, j]
                    tau[j] = 1.0
                    dtau[j] = 0.0
                s[j] = 0.0
            taken, lane[MU + k], _, smallest = newton(
                lane[KAPPA + k], lane[HALF + k], closure, width, nodes, w, dw, tau, dtau, s, newton_work,
                1e-7, NEWTON_STEPS,
            )  # fmt: skip
            counts[k] = abs(taken) + (MOST_SWEEPS if together else 0)
            if taken < 0:
                codes[k] = NOT_CONVERGED if smallest > FLOOR else STALLED
            for j in range(nodes):
                q[j, k] = (1.0 + w[j] + s[j]) / tau[j]
                powers[j, k], _, _ = load_terms(q[j, k], lane[HALF + k])

        # Extremes at the nodes and the mean speed, all lanes together.
        for k in range(lanes):
            lane[TOP + k] = -1e300
            lane[LOW + k] = 1e300
            lane[TOTAL + k] = 0.0
        for j in range(nodes):
            row_of_q = q[j]
            here = float(j)
            for k in range(lanes):
                value = row_of_q[k]
                high, low = lane[TOP + k], lane[LOW + k]
                lane[TOTAL + k] += math.sqrt(value if value > 0.0 else 0.0)
                lane[TOP_NODE + k] = here if value > high else lane[TOP_NODE + k]
                lane[LOW_NODE + k] = here if value < low else lane[LOW_NODE + k]
                lane[TOP + k] = value if value > high else high
                lane[LOW + k] = value if value < low else low

        for k in range(filled):
            error = 0.0
            cycles = float(counts[k])
            largest = smallest = mean = math.nan
            if codes[k] == CONVERGED:
                highest, miss_top = extreme_near(
                    int(lane[TOP_NODE + k]), 1.0, nodes, width, table, lane[GAS + k], lane[ETA + k], lane[KAPPA + k], lane[MU + k],
                    variable, q, powers, k,
                )  # fmt: skip
                lowest, miss_low = extreme_near(
                    int(lane[LOW_NODE + k]), -1.0, nodes, width, table, lane[GAS + k], lane[ETA + k], lane[KAPPA + k], lane[MU + k],
                    variable, q, powers, k,
                )  # fmt: skip
                if not (lowest > FLOOR):
                    codes[k] = STALLED
                else:
                    largest = lane[NOMINAL + k] * math.sqrt(highest)
                    smallest = lane[NOMINAL + k] * math.sqrt(lowest)
                    mean = lane[NOMINAL + k] * lane[TOTAL + k] / nodes
                    swing = largest - smallest
                    miss = 0.5 * lane[NOMINAL + k] * (
                        miss_top / math.sqrt(highest) + miss_low / math.sqrt(lowest)
                    )
                    error = miss / swing if swing > 0.0 else 0.0
                    if lowest < NEARLY_STALLED:
                        error += unresolved(nodes, q, k, lane[HALF + k], closure)
                    if error > tolerance:
                        codes[k] = TOLERANCE_NOT_MET

            if (method == THESIS or method == PICARD) and codes[k] != NO_STEADY_STATE and (
                codes[k] != INVALID_INPUT
            ):
                place(
                    lane_first + k, lane_axes, shape, strides, positions, position_start,
                    lane_offsets,
                )  # fmt: skip
                for i in range(INPUTS):
                    lane_offsets[i] += table_offsets[i] + value_start[i]
                passes = int(values[lane_offsets[PASSES]])
                angle = values[lane_offsets[START_ANGLE]]
                start = values[lane_offsets[START_SPEED]]
                if start <= 0.0:
                    start = lane[NOMINAL + k]
                reference = (largest - smallest) / mean
                if method == THESIS:
                    speed = lane[NOMINAL + k]
                    radius = 0.5 * values[lane_offsets[STROKE]]
                    bore = values[lane_offsets[BORE]]
                    lever = 0.25 * math.pi * bore * bore * radius
                    throw = values[lane_offsets[MASS]] * radius * radius
                    inertia = values[lane_offsets[INERTIA]]
                    average = 0.0
                    for j in range(samples):
                        torque = lever * sampled[0, j] - values[lane_offsets[FRICTION]]
                        average += torque + throw * speed * speed * sampled[1, j]
                        if variable:
                            sampled[5, j] = inertia + throw * sampled[2, j]
                            sampled[6, j] = throw * sampled[3, j]
                        else:
                            torque += throw * speed * speed * sampled[1, j]
                            sampled[5, j] = inertia
                            sampled[6, j] = 0.0
                        sampled[4, j] = torque
                    load = average / samples - values[lane_offsets[OFFSET]]
                    if lane[KAPPA + k] == 0.0:
                        load = 0.0
                    load /= speed ** lane[ALPHA + k]
                    here = int(round(angle / (steps * width) * samples)) + samples // 2
                    here %= samples
                    done, closed, stalled, largest, smallest, mean = march_cycles(
                        sampled[4], sampled[5], sampled[6], samples, steps * width / samples,
                        values[lane_offsets[OFFSET]], load, lane[ALPHA + k], start, here, passes,
                        MOST_CYCLES, sampled[7],
                    )  # fmt: skip
                else:
                    for j in range(nodes):
                        w[j] = lane[GAS + k] * table[GAS_WORK, j]
                        dw[j] = lane[GAS + k] * table[GAS_TORQUE, j]
                        tau[j] = 1.0
                        dtau[j] = 0.0
                        if variable:
                            tau[j] += lane[ETA + k] * table[SQUARE, j]
                            dtau[j] = lane[ETA + k] * table[SQUARE_SLOPE, j]
                        else:
                            w[j] -= lane[ETA + k] * table[SQUARE, j]
                            dw[j] -= lane[ETA + k] * table[SQUARE_SLOPE, j]
                    here = int(round(angle / width)) % nodes
                    ratio_start = (start / lane[NOMINAL + k]) ** 2
                    done, closed, stalled = repeat_cycles(
                        lane[KAPPA + k], lane[HALF + k], width, nodes, w, dw, tau, dtau, s, ratio_start, here,
                        cylinders, passes, 1e-3 * tolerance,
                    )  # fmt: skip
                    if passes == 0 and closed and (lane[KAPPA + k] == 0.0 or kind == 0):
                        # No load torque that depends on speed: every cycle closes; the closure
                        # of the contract fixes the constant.
                        for j in range(nodes):
                            s[j] = q[j, k] * tau[j] - 1.0 - w[j]
                    if not stalled:
                        top_here, low_here, sum_here = -math.inf, math.inf, 0.0
                        for j in range(nodes):
                            q[j, k] = (1.0 + w[j] + s[j]) / tau[j]
                            powers[j, k], _, _ = load_terms(q[j, k], lane[HALF + k])
                            sum_here += math.sqrt(max(q[j, k], 0.0))
                            if q[j, k] > top_here:
                                top_here = q[j, k]
                                lane[TOP_NODE + k] = float(j)
                            if q[j, k] < low_here:
                                low_here = q[j, k]
                                lane[LOW_NODE + k] = float(j)
                        highest, _ = extreme_near(
                            int(lane[TOP_NODE + k]), 1.0, nodes, width, table, lane[GAS + k], lane[ETA + k], lane[KAPPA + k], 1.0,
                            variable, q, powers, k,
                        )  # fmt: skip
                        lowest, _ = extreme_near(
                            int(lane[LOW_NODE + k]), -1.0, nodes, width, table, lane[GAS + k], lane[ETA + k], lane[KAPPA + k], 1.0,
                            variable, q, powers, k,
                        )  # fmt: skip
                        if lowest > FLOOR:
                            largest = lane[NOMINAL + k] * math.sqrt(highest)
                            smallest = lane[NOMINAL + k] * math.sqrt(lowest)
                            mean = lane[NOMINAL + k] * sum_here / nodes
                        else:
                            stalled = True
                cycles = float(done)
                lane[MU + k] = 1.0
                # What this method misses, measured against the periodic solution.
                found = (largest - smallest) / mean
                if reference > 0.0:
                    error += abs(found - reference) / reference
                if stalled:
                    codes[k] = STALLED
                elif passes > 0:
                    codes[k] = PASSES_DONE
                elif not closed:
                    codes[k] = NOT_CONVERGED
                elif not (error <= tolerance):
                    codes[k] = TOLERANCE_NOT_MET
                else:
                    codes[k] = CONVERGED

            target = targets[k]
            status[target] = codes[k]
            good = (
                codes[k] == CONVERGED or codes[k] == TOLERANCE_NOT_MET or codes[k] == PASSES_DONE
            )
            if wanted[DELTA] >= 0:
                scalars[wanted[DELTA], target] = (largest - smallest) / mean if good else math.nan
            if wanted[DELTA_MIDRANGE] >= 0:
                scalars[wanted[DELTA_MIDRANGE], target] = (
                    2.0 * (largest - smallest) / (largest + smallest) if good else math.nan
                )
            if wanted[OMEGA_MAX] >= 0:
                scalars[wanted[OMEGA_MAX], target] = largest if good else math.nan
            if wanted[OMEGA_MIN] >= 0:
                scalars[wanted[OMEGA_MIN], target] = smallest if good else math.nan
            if wanted[OMEGA_MEAN] >= 0:
                scalars[wanted[OMEGA_MEAN], target] = mean if good else math.nan
            if wanted[LOAD_FACTOR] >= 0:
                scalars[wanted[LOAD_FACTOR], target] = 1.0 / lane[MU + k] if good else math.nan
            if wanted[DELTA_ERROR] >= 0:
                scalars[wanted[DELTA_ERROR], target] = error if good else math.nan
            if wanted[ITERATIONS] >= 0:
                scalars[wanted[ITERATIONS], target] = cycles if good else math.nan
            for i in range(output_node.size):
                if omega.shape[0] == 1 and acceleration.shape[0] == 1 and omega.shape[1] == 0:
                    break
                if not good:
                    speed = math.nan
                    rate = math.nan
                elif method == THESIS:
                    position = output_sample[i]
                    j = int(math.floor(position + 1e-9))
                    share = max(position - j, 0.0)
                    after = j + 1 if j + 1 < samples else 0
                    speed = (1.0 - share) * sampled[7, j] + share * sampled[7, after]
                    # The method's own acceleration: the right side of its Euler step at the sample.
                    rate = speed * (sampled[7, after] - sampled[7, j]) * samples / (steps * width)
                else:
                    j = output_node[i]
                    share = output_share[i]
                    after = j + 1 if j + 1 < nodes else 0
                    d0 = d1 = 0.0
                    for end_of in range(2):
                        node = j if end_of == 0 else after
                        f = lane[KAPPA + k] * (powers[node, k] / lane[MU + k] - 1.0)
                        slope = lane[GAS + k] * table[GAS_TORQUE, node] - f
                        turn = lane[ETA + k] * table[SQUARE_SLOPE, node]
                        if variable:
                            slope = (slope - q[node, k] * turn) / (
                                1.0 + lane[ETA + k] * table[SQUARE, node]
                            )
                        else:
                            slope -= turn
                        if end_of == 0:
                            d0 = slope * width
                        else:
                            d1 = slope * width
                    value = interpolate(share, q[j, k], q[after, k], d0, d1)
                    rise = q[after, k] - q[j, k]
                    b = 3.0 * rise - 2.0 * d0 - d1
                    a = d0 + d1 - 2.0 * rise
                    slope = d0 + share * (2.0 * b + 3.0 * share * a)
                    speed = lane[NOMINAL + k] * math.sqrt(max(value, 0.0))
                    rate = 0.5 * lane[NOMINAL + k] * lane[NOMINAL + k] * slope / width
                if omega.shape[1] > 0:
                    omega[target, i] = speed
                if acceleration.shape[1] > 0:
                    acceleration[target, i] = rate


@inlined
def combined_extreme(
    node: int,
    upward: float,
    nodes: int,
    width: float,
    a: float,
    b: float,
    table: Floats,
    first: int,
    first_slope: int,
    first_middle: int,
    second: int,
    second_slope: int,
    second_middle: int,
) -> float:
    """Extreme of a X + b Y around a node, X and Y tabulated by value, slope and middle."""
    before = node - 1 if node > 0 else nodes - 1
    after = node + 1 if node + 1 < nodes else 0
    here = a * table[first_slope, node] + b * table[second_slope, node]
    left = node if here * upward > 0.0 else before
    right = after if here * upward > 0.0 else node
    d_left = width * (a * table[first_slope, left] + b * table[second_slope, left])
    d_right = width * (a * table[first_slope, right] + b * table[second_slope, right])
    if not (d_left * upward > 0.0 and d_right * upward < 0.0):
        return a * table[first, node] + b * table[second, node]
    value, _, _ = refine(
        a * table[first, left] + b * table[second, left],
        a * table[first, right] + b * table[second, right],
        d_left,
        d_right,
        a * table[first_middle, left] + b * table[second_middle, left],
    )
    return value


@kernel
def extremes_of_torque(
    begin: int,
    end: int,
    table_axes: Integers,
    lane_axes: Integers,
    shape: Integers,
    strides: Integers,
    positions: Integers,
    position_start: Integers,
    values: Floats,
    value_start: Integers,
    row_of: Integers,
    cylinders: int,
    nodes: int,
    width: float,
    at_node: Floats,
    slope_at_node: Floats,
    at_middle: Floats,
    at_quadrature: Floats,
    node_sine: Floats,
    node_cosine: Floats,
    middle_sine: Floats,
    middle_cosine: Floats,
    quadrature_sine: Floats,
    quadrature_cosine: Floats,
    wanted: Integers,
    scalars: Floats,
    table: Floats,
    middles: Floats,
) -> None:
    """Extremes of the torque at nominal speed and the energy swing, for a range of blocks.

    Arguments as `march`; rows of `wanted`: largest torque, smallest torque, energy swing.
    """
    designs = 1
    for i in range(lane_axes.size):
        designs *= shape[lane_axes[i]]
    blocks = (designs + LANES - 1) // LANES
    table_offsets = np.zeros(INPUTS, dtype=np.int64)
    lane_offsets = np.zeros(INPUTS, dtype=np.int64)
    current = -1
    for block in range(begin, end):
        which = block // blocks
        if which != current:
            current = which
            place(which, table_axes, shape, strides, positions, position_start, table_offsets)
            row = values[value_start[ROW] + table_offsets[ROW]]
            whole = int(math.floor(row))
            weight = row - whole
            first = row_of[whole]
            second = row_of[whole + 1] if weight > 0.0 else first
            tables.build(
                values[value_start[RATIO] + table_offsets[RATIO]], first, second, weight,
                values[value_start[SCALE] + table_offsets[SCALE]],
                values[value_start[CRANKCASE] + table_offsets[CRANKCASE]],
                nodes, nodes * cylinders, width,
                at_node, slope_at_node, at_middle, at_quadrature,
                node_sine, node_cosine, middle_sine, middle_cosine,
                quadrature_sine, quadrature_cosine, table, middles,
            )  # fmt: skip
        lane_first = (block % blocks) * LANES
        for lane in range(lane_first, min(lane_first + LANES, designs)):
            place(lane, lane_axes, shape, strides, positions, position_start, lane_offsets)
            for i in range(INPUTS):
                lane_offsets[i] += table_offsets[i] + value_start[i]
            bore = values[lane_offsets[BORE]]
            radius = 0.5 * values[lane_offsets[STROKE]]
            speed = values[lane_offsets[SPEED]]
            lever = 0.25 * math.pi * bore * bore * radius
            moment = values[lane_offsets[MASS]] * (radius * speed) ** 2
            target = lane_offsets[OUTPUT] - value_start[OUTPUT]
            if wanted[0] >= 0 or wanted[1] >= 0:
                high, low = -math.inf, math.inf
                top = bottom = 0
                for j in range(nodes):
                    torque = lever * table[TORQUE, j] + moment * table[SHAPE, j]
                    if torque > high:
                        high, top = torque, j
                    if torque < low:
                        low, bottom = torque, j
                friction = values[lane_offsets[FRICTION]]
                if wanted[0] >= 0:
                    scalars[wanted[0], target] = combined_extreme(
                        top, 1.0, nodes, width, lever, moment, table,
                        TORQUE, TORQUE_SLOPE, TORQUE_MIDDLE, SHAPE, SHAPE_SLOPE, SHAPE_MIDDLE,
                    ) - friction  # fmt: skip
                if wanted[1] >= 0:
                    scalars[wanted[1], target] = combined_extreme(
                        bottom, -1.0, nodes, width, lever, moment, table,
                        TORQUE, TORQUE_SLOPE, TORQUE_MIDDLE, SHAPE, SHAPE_SLOPE, SHAPE_MIDDLE,
                    ) - friction  # fmt: skip
            if wanted[2] >= 0:
                high, low = -math.inf, math.inf
                top = bottom = 0
                for j in range(nodes):
                    work = lever * table[GAS_WORK, j] - 0.5 * moment * table[SQUARE, j]
                    if work > high:
                        high, top = work, j
                    if work < low:
                        low, bottom = work, j
                highest = combined_extreme(
                    top, 1.0, nodes, width, lever, -0.5 * moment, table,
                    GAS_WORK, GAS_TORQUE, GAS_WORK_MIDDLE, SQUARE, SQUARE_SLOPE, SQUARE_MIDDLE,
                )  # fmt: skip
                lowest = combined_extreme(
                    bottom, -1.0, nodes, width, lever, -0.5 * moment, table,
                    GAS_WORK, GAS_TORQUE, GAS_WORK_MIDDLE, SQUARE, SQUARE_SLOPE, SQUARE_MIDDLE,
                )  # fmt: skip
                scalars[wanted[2], target] = highest - lowest


@kernel
def mean_gas_torque(
    ratio: Floats,
    row: Floats,
    row_of: Integers,
    at_quadrature: Floats,
    sine: Floats,
    cosine: Floats,
    result: Floats,
) -> None:
    """Mean over angle of p c/(r omega) [Pa], one cylinder, for paired crank ratios and rows."""
    points = sine.size
    for i in range(ratio.size):
        whole = int(math.floor(row[i]))
        weight = row[i] - whole
        first = row_of[whole]
        second = row_of[whole + 1] if weight > 0.0 else first
        total = 0.0
        for j in range(points):
            pressure = (1.0 - weight) * at_quadrature[first, j] + weight * at_quadrature[second, j]
            share = 8.0 / 18.0 if j % 3 == 1 else 5.0 / 18.0
            total += share * pressure * velocity_at(sine[j], cosine[j], ratio[i])
        result[i] = total / (points / 3.0)
