"""Work tables: the cumulative work of one period of the torque, common to designs of one geometry.

A table has, at the nodes of one period, the work of the gas and of the reciprocating masses in
reduced form, docs/method.md (22) and (43). Work is one integration smoother than torque, so a table
of it needs few nodes, and a design has only two factors on two tables:

    gas:      P(phi) = int sum_i [(p_i - p_c) v_i - mean] dphi          [Pa]
    inertia:  V(phi) = sum_i v_i^2 - mean                               [1]

because the inertia torque has an exact integral, docs/method.md (24) and (25). Friction over the
stroke, less its mean, is a part of P: divided by piston area and crank radius, it depends only on
the inputs of P and on its level [Pa]. Where the cylinders repeat n times a cycle, the curves of Z/n
of them (`cylinders.Cylinders.representatives`), folded at Phi/n, are those of the whole engine,
docs/method.md (34). Evenly firing equal cylinders need the curve of one.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from engine_dyn.compilation import formula, inlined, kernel, on_stack, wide_vectors
from engine_dyn.geometry.slider_crank import (
    offset_velocity_at,
    sine_of_top,
    turned,
    velocity_and_slopes_at,
)
from engine_dyn.loads.friction import (
    StrokeFriction,
    level_over_mean_at,
    stroke_friction_parts_at,
    stroke_friction_slopes_at,
    total_level_at,
    varies_at,
    weighted_sum_at,
)
from engine_dyn.speed.tables.pressure_grid import (
    END_WEIGHT,
    HALVES_POINTS,
    MIDDLE_WEIGHT,
    Grid,
    steps_of,
)
from engine_dyn.types import Floats

__all__ = [
    "FEWEST_NODES",
    "MOST_NODES",
    "Blend",
    "Cylinder",
    "build",
    "steps_per_cycle",
]

FEWEST_NODES = 720
"""Least number of nodes of a cycle: one a degree, the step of most measured diagrams."""

MOST_NODES = 23040
"""Largest number of nodes of a cycle: five doublings."""


class Blend(NamedTuple):
    """The diagram of a table: (1 - weight) row `first` + weight row `second` of a grid, scaled.

    `crankcase` is the pressure under the piston [Pa].
    """

    first: int
    second: int
    weight: float
    scale: float
    crankcase: float
    friction: StrokeFriction


@inlined
def blended(blend: Blend, pressures: Floats, place: int) -> float:
    """Pressure of a blend at one point of a grid."""
    return blend.scale * (
        (1.0 - blend.weight) * pressures[blend.first, place]
        + blend.weight * pressures[blend.second, place]
    )


@inlined
def bounds_of(curve: Floats) -> tuple[float, float]:
    """Smallest and largest value; NaN where any value is NaN."""
    low = high = curve[0]
    for j in range(curve.size):
        low = curve[j] if curve[j] < low or curve[j] != curve[j] else low
        high = curve[j] if curve[j] > high or curve[j] != curve[j] else high
    return low, high


class Cylinder(NamedTuple):
    """One representative cylinder of a table: its own crank ratio, offset and crank radius.

    Attributes
    ----------
    ratio, offset : float
        Crank radius over rod length, and offset over crank radius, both of its own crank radius.
    radius, mass : float
        Factors on the engine's crank radius, and on m r^2.
    top, upright : float
        Sine and cosine of the crank's angle to the cylinder axis at top dead centre.
    weights : tuple of float
        Level over cycle mean of each part of its friction, docs/method.md (32).
    """

    ratio: float
    offset: float
    radius: float
    mass: float
    top: float
    upright: float
    weights: tuple[float, float, float, float]


@inlined
def cylinder_of(
    ratio: float, offset: float, member: int, weights: tuple[float, float, float, float],
    grid: Grid,
) -> Cylinder:  # fmt: skip
    """One representative cylinder of a grid; `ratio` and `offset` are over the engine's radius."""
    radius = grid.radii[member]
    own_ratio, own_offset = ratio * radius, offset / radius
    top = sine_of_top(own_ratio, own_offset)
    mass = grid.masses[member] * radius * radius
    upright = math.sqrt(1.0 - top * top)
    return Cylinder(own_ratio, own_offset, radius, mass, top, upright, weights)


def steps_per_cycle(cylinders: int, fewest: int, pieces: int) -> int:
    """Nodes of a cycle: the least number from `fewest` on with a multiple of `pieces` per period.

    `pieces` is even, so that means over every other node tell whether a curve is resolved.
    """
    return -(-fewest // (pieces * cylinders)) * pieces * cylinders


TABLE_ROWS = 14
(
    GAS_WORK,
    GAS_TORQUE,
    GAS_WORK_MIDDLE,
    SQUARE,
    SQUARE_SLOPE,
    SQUARE_MIDDLE,
    TORQUE,
    TORQUE_SLOPE,
    TORQUE_MIDDLE,
    SHAPE,
    SHAPE_SLOPE,
    SHAPE_MIDDLE,
    GAS_WORK_TILT,
    SQUARE_TILT,
) = range(TABLE_ROWS)
"""Rows of a table, each with one value for each node of the period:

GAS_WORK P, GAS_TORQUE its slope, SQUARE V and SQUARE_SLOPE (both without their means);
TORQUE sum (p - p_c) v and SHAPE sum -b v, with their slopes, for the extremes of the torque:
docs/method.md (50) and (51).
*_MIDDLE is the true value in the middle of the interval after the node, less that of the cubic
Hermite interpolant. *_TILT is the true slope there, less the cubic's, times the width of the
interval: the quartic through the middle, docs/method.md (53), misses it still.
"""

QUINTIC = 4.0 / math.sqrt(3125.0)
"""Half of the largest value of 8 t^2 (1 - t)^2 (2 t - 1), whose slope in the middle is 1.

Twice this is the factor on a TILT, docs/method.md (54) and (55)."""


STRIP = 64
"""Nodes that are taken at a time. Their values lie on the stack, where the compiler knows that they
overlap nothing, so that loops over them become vectors: a table takes a third of the time."""


@inlined
def take_cubic(width: float, value: Floats, slope: Floats, middle: Floats, missed: Floats) -> None:
    """What a cubic through two nodes misses in their middle, docs/method.md (52)."""
    last = value.size - 1
    for j in range(last):
        missed[j] = middle[j] - cubic_in_middle(
            width, value[j], value[j + 1], slope[j], slope[j + 1]
        )
    missed[last] = middle[last] - cubic_in_middle(
        width, value[last], value[0], slope[last], slope[0]
    )


@formula
def cubic_in_middle(
    width: float, left: float, right: float, left_slope: float, right_slope: float
) -> float:
    """Cubic Hermite interpolant in the middle of an interval, docs/method.md (52)."""
    return 0.5 * (left + right) + 0.125 * width * (left_slope - right_slope)


@inlined
def take_tilt(
    width: float, factor: float, value: Floats, slope: Floats, middle: Floats, missed: Floats
) -> None:
    """What a cubic misses of the slope in the middle, which is `factor` times `middle`.

    docs/method.md (52), times the width of the interval.
    """
    last = value.size - 1
    for j in range(last):
        missed[j] = width * factor * middle[j] - cubic_rise_in_middle(
            width, value[j], value[j + 1], slope[j], slope[j + 1]
        )
    missed[last] = width * factor * middle[last] - cubic_rise_in_middle(
        width, value[last], value[0], slope[last], slope[0]
    )


@formula
def cubic_rise_in_middle(
    width: float, left: float, right: float, left_slope: float, right_slope: float
) -> float:
    """Slope of the cubic Hermite interpolant in the middle, times the width of the interval."""
    return 1.5 * (right - left) - 0.25 * width * (left_slope + right_slope)


@inlined
def pressure_factors(blend: Blend) -> tuple[float, float]:
    """Factors on the pressures of both diagrams of a blend."""
    return blend.scale * (1.0 - blend.weight), blend.scale * blend.weight


@inlined
def stroke_friction_weights(
    ratio: float, offset: float, blend: Blend, grid: Grid, member: int, speeds: Floats
) -> tuple[float, float, float, float]:
    """Level over cycle mean of each part of the friction of one representative cylinder.

    The factors of docs/method.md (32). `ratio` and `offset` are over its own crank radius; `speeds`
    gets the reduced piston speed at its quadrature points.
    """
    sines, cosines, firsts, seconds = points_of(blend, grid, member)
    top = sine_of_top(ratio, offset)
    upright = math.sqrt(1.0 - top * top)
    before, behind = pressure_factors(blend)
    lift, count = blend.friction.ring - blend.crankcase, sines.size
    # Each place of a strip has a sum of its own, so that the loop becomes vectors.
    boundary, mixed, hydrodynamic, skirt = (
        on_stack(STRIP), on_stack(STRIP), on_stack(STRIP), on_stack(STRIP)
    )  # fmt: skip
    for k in range(STRIP):
        boundary[k] = mixed[k] = hydrodynamic[k] = skirt[k] = 0.0
    steps = count // HALVES_POINTS
    for point in range(HALVES_POINTS):
        weight = 3.0 * (MIDDLE_WEIGHT if point % 3 == 1 else END_WEIGHT) / count
        for begin in range(point * steps, (point + 1) * steps, STRIP):
            n = min(STRIP, (point + 1) * steps - begin)
            sine, cosine = sines[begin : begin + n], cosines[begin : begin + n]
            first, second = firsts[begin : begin + n], seconds[begin : begin + n]
            mine = speeds[begin : begin + n]
            for k in range(n):
                s, c = turned(sine[k], cosine[k], top, upright)
                mine[k] = offset_velocity_at(s, c, ratio, offset)
            for k in range(n):
                load = before * first[k] + behind * second[k] + lift
                parts = stroke_friction_parts_at(load, mine[k], sine[k])
                boundary[k] += weight * parts[0]
                mixed[k] += weight * parts[1]
                hydrodynamic[k] += weight * parts[2]
                skirt[k] += weight * parts[3]
    friction = blend.friction
    return (
        level_over_mean_at(friction.boundary, sum_of(boundary)),
        level_over_mean_at(friction.mixed, sum_of(mixed)),
        level_over_mean_at(friction.hydrodynamic, sum_of(hydrodynamic)),
        level_over_mean_at(friction.skirt, sum_of(skirt)),
    )


@inlined
def sum_of(numbers: Floats) -> float:
    """Sum from the first to the last."""
    total = 0.0
    for k in range(numbers.size):
        total += numbers[k]
    return total


@inlined
def points_of(
    blend: Blend, grid: Grid, member: int
) -> tuple[Floats, Floats, Floats, Floats]:  # fmt: skip
    """Sine, cosine and both pressures of a blend at one representative's quadrature points.

    The arrays begin at 0: where the compiler sees that no place is negative, loops become vectors.
    """
    count = HALVES_POINTS * steps_of(grid)
    here = slice(member * count, (member + 1) * count)
    return (
        grid.quadrature_sine[here], grid.quadrature_cosine[here],
        grid.at_quadrature[blend.first, here], grid.at_quadrature[blend.second, here],
    )  # fmt: skip


@inlined
def rates_of_member(
    ratio: float, offset: float, blend: Blend, grid: Grid, member: int, rates: Floats
) -> tuple[float, float, float, float]:
    """Rate of one representative cylinder's work at its quadrature points; weights of its friction.

    docs/method.md (28) and (32) over A r. `ratio` and `offset` are over the engine's crank radius:
    the rod and the offset are the engine's, but the crank radius is its own.
    """
    radius, friction = grid.radii[member], blend.friction
    own_ratio, own_offset = ratio * radius, offset / radius
    sine, cosine, first, second = points_of(blend, grid, member)
    count = sine.size
    mine = rates[member * count : (member + 1) * count]
    before, behind = pressure_factors(blend)
    if not varies_at(friction):
        top = sine_of_top(own_ratio, own_offset)
        upright = math.sqrt(1.0 - top * top)
        for i in range(count):
            s, c = turned(sine[i], cosine[i], top, upright)
            pressure = before * first[i] + behind * second[i] - blend.crankcase
            mine[i] = radius * pressure * offset_velocity_at(s, c, own_ratio, own_offset)
        return 0.0, 0.0, 0.0, 0.0
    weights = stroke_friction_weights(own_ratio, own_offset, blend, grid, member, mine)
    level = total_level_at(friction)
    for i in range(count):
        pressure = before * first[i] + behind * second[i] - blend.crankcase
        parts = stroke_friction_parts_at(friction.ring + pressure, mine[i], sine[i])
        mine[i] = radius * pressure * mine[i] - (weighted_sum_at(weights, parts) - level)
    return weights


@formula
def mean_of_half(start: float, middle: float, end: float) -> float:
    """Mean over half an interval from its three quadrature points: docs/method.md (49)."""
    return END_WEIGHT * (start + end) + MIDDLE_WEIGHT * middle


@inlined
def add_works(width: float, rates: Floats, step: int, works: Floats, first_halves: Floats) -> None:
    """Add the work of whole intervals, and of their first halves, from the node `step` on."""
    nodes, steps = works.size, rates.size // HALVES_POINTS
    r0 = rates[step : step + nodes]
    r1 = rates[steps + step : steps + step + nodes]
    r2 = rates[2 * steps + step : 2 * steps + step + nodes]
    r3 = rates[3 * steps + step : 3 * steps + step + nodes]
    r4 = rates[4 * steps + step : 4 * steps + step + nodes]
    r5 = rates[5 * steps + step : 5 * steps + step + nodes]
    for j in range(nodes):
        first_halves[j] += 0.5 * width * mean_of_half(r0[j], r1[j], r2[j])
    for j in range(nodes):
        works[j] += 0.5 * width * (
            mean_of_half(r0[j], r1[j], r2[j]) + mean_of_half(r3[j], r4[j], r5[j])
        )  # fmt: skip


@inlined
def mean_rate(rates: Floats) -> float:
    """Mean over the cycle of rates at a cylinder's quadrature points, docs/method.md (29)."""
    steps = rates.size // HALVES_POINTS
    total = 0.0
    for step in range(steps):
        total += mean_of_half(rates[step], rates[steps + step], rates[2 * steps + step])
        total += mean_of_half(
            rates[3 * steps + step], rates[4 * steps + step], rates[5 * steps + step]
        )
    return total / (2 * steps)


@inlined
def clear(table: Floats, middles: Floats) -> None:
    """Set a table and its middles to 0."""
    nodes = table.shape[1]
    for row in range(TABLE_ROWS):
        for j in range(nodes):
            table[row, j] = 0.0
    for row in range(4):
        for j in range(nodes):
            middles[row, j] = 0.0


@inlined
def finish(width: float, table: Floats, middles: Floats) -> None:
    """From sums over cylinders: the work without its mean, and what cubics miss.

    docs/method.md (43) and (52).
    """
    nodes = table.shape[1]
    work, torque, square = table[GAS_WORK], table[TORQUE], table[SQUARE]
    total = 0.0
    for j in range(nodes):
        total += work[j]
    mean = total / (nodes * width)
    running = 0.0
    mean_work = 0.0
    # The squares of many cylinders nearly add up to a constant. It is subtracted before the mean is
    # taken: rounding in a sum of nearly equal numbers is always on the same side and would remain
    # in the mean, where masses far above the inertia multiply it.
    level = square[0]
    mean_square = 0.0
    for j in range(nodes):
        whole = work[j] - mean * width
        work[j] = running
        mean_work += running
        square[j] -= level
        mean_square += square[j]
        running += whole
    mean_work /= nodes
    mean_square /= nodes
    slope, works, squares = table[GAS_TORQUE], middles[0], middles[1]
    for j in range(nodes):
        works[j] += work[j] - 0.5 * mean * width - mean_work
    for j in range(nodes):
        work[j] -= mean_work
    for j in range(nodes):
        slope[j] = torque[j] - mean
    for j in range(nodes):
        squares[j] -= level + mean_square
    for j in range(nodes):
        square[j] -= mean_square
    take_cubic(width, work, slope, works, table[GAS_WORK_MIDDLE])
    take_cubic(width, square, table[SQUARE_SLOPE], squares, table[SQUARE_MIDDLE])
    take_cubic(width, torque, table[TORQUE_SLOPE], middles[2], table[TORQUE_MIDDLE])
    take_cubic(width, table[SHAPE], table[SHAPE_SLOPE], middles[3], table[SHAPE_MIDDLE])
    torques = middles[2]
    for j in range(nodes):
        torques[j] -= mean
    take_tilt(width, 1.0, work, slope, torques, table[GAS_WORK_TILT])
    take_tilt(width, -2.0, square, table[SQUARE_SLOPE], middles[3], table[SQUARE_TILT])


@inlined
def add_nodes(
    begin: int, end: int, step: int, own: Cylinder, blend: Blend, grid: Grid, table: Floats
) -> None:  # fmt: skip
    """Add a cylinder's torque, squared velocity and their slopes at the nodes begin .. end - 1.

    docs/method.md (50) and (51). `step` is the place of the node `begin` in the grid.
    """
    n = end - begin
    v, b, jerk = on_stack(STRIP), on_stack(STRIP), on_stack(STRIP)
    pressure, rise = on_stack(STRIP), on_stack(STRIP)
    sine, cosine = grid.node_sine[step : step + n], grid.node_cosine[step : step + n]
    for k in range(n):
        s, c = turned(sine[k], cosine[k], own.top, own.upright)
        v[k], b[k], jerk[k] = velocity_and_slopes_at(s, c, own.ratio, own.offset)
    before, behind = pressure_factors(blend)
    first, second = grid.at_node[blend.first], grid.at_node[blend.second]
    one, other = first[step : step + n], second[step : step + n]
    for k in range(n):
        pressure[k] = before * one[k] + behind * other[k] - blend.crankcase
    first, second = grid.slope_at_node[blend.first], grid.slope_at_node[blend.second]
    one, other = first[step : step + n], second[step : step + n]
    for k in range(n):
        rise[k] = before * one[k] + behind * other[k]
    radius, mass = own.radius, own.mass
    to = table[TORQUE, begin:end]
    for k in range(n):
        to[k] += radius * pressure[k] * v[k]
    to = table[TORQUE_SLOPE, begin:end]
    for k in range(n):
        to[k] += radius * (rise[k] * v[k] + pressure[k] * b[k])
    to = table[SHAPE, begin:end]
    for k in range(n):
        to[k] -= mass * b[k] * v[k]
    to = table[SHAPE_SLOPE, begin:end]
    for k in range(n):
        to[k] -= mass * (b[k] * b[k] + v[k] * jerk[k])
    to = table[SQUARE, begin:end]
    for k in range(n):
        to[k] += mass * v[k] * v[k]
    to = table[SQUARE_SLOPE, begin:end]
    for k in range(n):
        to[k] += 2.0 * mass * v[k] * b[k]
    friction = blend.friction
    if varies_at(friction):
        level = total_level_at(friction)
        torque, slope = table[TORQUE, begin:end], table[TORQUE_SLOPE, begin:end]
        for k in range(n):
            parts = stroke_friction_parts_at(friction.ring + pressure[k], v[k], sine[k])
            torque[k] -= weighted_sum_at(own.weights, parts) - level
        for k in range(n):
            parts = stroke_friction_slopes_at(
                friction.ring + pressure[k], rise[k], v[k], b[k], sine[k], cosine[k]
            )
            slope[k] -= weighted_sum_at(own.weights, parts)


@inlined
def add_middles(
    begin: int, end: int, step: int, own: Cylinder, blend: Blend, grid: Grid, middles: Floats
) -> None:  # fmt: skip
    """Add a cylinder's squared velocity, torque and shape in the middles behind the nodes.

    Arguments as of `add_nodes`.
    """
    n = end - begin
    v, b, pressure = on_stack(STRIP), on_stack(STRIP), on_stack(STRIP)
    sine, cosine = grid.middle_sine[step : step + n], grid.middle_cosine[step : step + n]
    for k in range(n):
        s, c = turned(sine[k], cosine[k], own.top, own.upright)
        v[k], b[k], _ = velocity_and_slopes_at(s, c, own.ratio, own.offset)
    before, behind = pressure_factors(blend)
    first, second = grid.at_middle[blend.first], grid.at_middle[blend.second]
    one, other = first[step : step + n], second[step : step + n]
    for k in range(n):
        pressure[k] = before * one[k] + behind * other[k] - blend.crankcase
    to = middles[1, begin:end]
    for k in range(n):
        to[k] += own.mass * v[k] * v[k]
    to = middles[2, begin:end]
    for k in range(n):
        to[k] += own.radius * pressure[k] * v[k]
    to = middles[3, begin:end]
    for k in range(n):
        to[k] -= own.mass * b[k] * v[k]
    friction = blend.friction
    if varies_at(friction):
        level = total_level_at(friction)
        to = middles[2, begin:end]
        for k in range(n):
            parts = stroke_friction_parts_at(friction.ring + pressure[k], v[k], sine[k])
            to[k] -= weighted_sum_at(own.weights, parts) - level


@kernel
def build(
    ratio: float, offset: float, blend: Blend, width: float, grid: Grid, table: Floats,
    middles: Floats, rates: Floats,
) -> None:  # fmt: skip
    """Fill `table` (TABLE_ROWS, nodes of a period) for one crank ratio, offset and diagram.

    docs/method.md (32), (34), (50) and (51). `offset` is over the crank radius. `middles` (4,
    nodes) and `rates` (quadrature points) are scratch.
    """
    wide_vectors()
    clear(table, middles)
    nodes, steps = table.shape[1], steps_of(grid)
    # Row GAS_WORK first collects the work of whole intervals, `middles` that of their first halves.
    for member in range(grid.masses.size):
        weights = rates_of_member(ratio, offset, blend, grid, member, rates)
        own = cylinder_of(ratio, offset, member, weights, grid)
        count = HALVES_POINTS * steps
        mine = rates[member * count : (member + 1) * count]
        for step in range(0, steps, nodes):
            add_works(width, mine, step, table[GAS_WORK], middles[0])
            at = member * steps + step
            for begin in range(0, nodes, STRIP):
                end = min(begin + STRIP, nodes)
                add_nodes(begin, end, at + begin, own, blend, grid, table)
                add_middles(begin, end, at + begin, own, blend, grid, middles)
    finish(width, table, middles)
