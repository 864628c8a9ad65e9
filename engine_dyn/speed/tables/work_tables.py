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
from functools import lru_cache
from typing import NamedTuple
from weakref import WeakKeyDictionary

import numpy as np

from engine_dyn.compilation import inlined, kernel
from engine_dyn.geometry.cylinders import EQUAL, Member
from engine_dyn.geometry.slider_crank import (
    acceleration_at,
    jerk_at,
    offset_acceleration_at,
    offset_jerk_at,
    offset_velocity_at,
    sine_of_top,
    turned,
    velocity_at,
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
from engine_dyn.pressure.cycle_table import CycleTable
from engine_dyn.pressure.diagram import Diagram, values_at
from engine_dyn.pressure.family import Family
from engine_dyn.pressure.motored import row_with_factor
from engine_dyn.types import Floats, Integers

__all__ = [
    "END_WEIGHT",
    "FEWEST_NODES",
    "GAUSS_POINTS",
    "MIDDLE_WEIGHT",
    "MOST_NODES",
    "Blend",
    "Grid",
    "build",
    "build_equal",
    "make_grid",
    "steps_per_cycle",
]

FEWEST_NODES = 720
"""Least number of nodes of a cycle: one a degree, the step of most measured diagrams."""

MOST_NODES = 23040
"""Largest number of nodes of a cycle: five doublings."""

_THIRD = math.sqrt(0.15)
GAUSS_POINTS = (0.5 - _THIRD, 0.5, 0.5 + _THIRD)
END_WEIGHT, MIDDLE_WEIGHT = 5.0 / 18.0, 8.0 / 18.0
"""Three-point Gauss-Legendre quadrature on [0, 1], docs/method.md (49)."""


class Grid(NamedTuple):
    """Pressure of some diagrams at the nodes, the middles and the quadrature points of a cycle.

    Arrays are (diagram, point). Sine and cosine are those of the same points. The points of the
    representative cylinders follow each other, each at its own angles and pressure; `masses` and
    `radii` have the factors on the mass and the crank radius of each cylinder.
    """

    at_node: Floats
    slope_at_node: Floats
    at_middle: Floats
    at_quadrature: Floats
    node_sine: Floats
    node_cosine: Floats
    middle_sine: Floats
    middle_cosine: Floats
    quadrature_sine: Floats
    quadrature_cosine: Floats
    masses: Floats
    radii: Floats


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


@inlined
def steps_of(grid: Grid) -> int:
    """Nodes of a cycle."""
    return grid.node_sine.size // grid.masses.size


def steps_per_cycle(cylinders: int, fewest: int, pieces: int) -> int:
    """Nodes of a cycle: the least number from `fewest` on with a multiple of `pieces` per period.

    `pieces` is even, so that means over every other node tell whether a curve is resolved.
    """
    return -(-fewest // (pieces * cylinders)) * pieces * cylinders


def make_grid(
    family: Family,
    rows: Integers,
    steps: int,
    members: tuple[Member, ...] = (EQUAL,),
) -> Grid:
    """Evaluate the diagrams `rows` of a family on a grid of `steps` intervals, from phi = 0 on.

    `members` are the representative cylinders.
    """
    period = family.period
    turns = _joined([_turns(period, steps, member.phase) for member in members])
    masses = np.array([member.mass_factor for member in members])
    radii = np.array([member.radius_factor for member in members])
    if isinstance(family, CycleTable):
        curves = family.remembered(
            ("grid", rows.tobytes(), steps, members),
            lambda: _sampled_rows(family, rows, steps, members),
        )
        return Grid(*(*curves, *turns, masses, radii))
    if rows.size <= FEW_ROWS:
        cached = [
            _joined(
                [
                    _sampled(row_with_factor(family, row, m.pressure_factor), steps, m.phase)
                    for m in members
                ]
            )
            for row in rows.tolist()
        ]
        # A single diagram is not copied, because cached samples are only read.
        curves = [
            one[0][None] if len(one) == 1 else np.array(one) for one in zip(*cached, strict=True)
        ]
        return Grid(*(*curves, *turns, masses, radii))
    count = len(members)
    of_rows = [np.empty((rows.size, each * steps * count)) for each in (1, 1, 1, 6)]
    for place, member in enumerate(members):
        diagrams = [row_with_factor(family, row, member.pressure_factor) for row in rows.tolist()]
        node, middle, quadrature = _angles(period, steps, member.phase)
        for out, angle, slopes in zip(
            of_rows, (node, node, middle, quadrature), (False, True, False, False), strict=True
        ):
            mine = out[:, place * angle.size : (place + 1) * angle.size]
            values_at(diagrams, angle, mine, slopes)
    return Grid(*(*of_rows, *turns, masses, radii))


def _sampled_rows(
    family: CycleTable, rows: Integers, steps: int, members: tuple[Member, ...]
) -> list[Floats]:
    """As `_sampled` of many rows, those of all members behind each other."""
    found: list[list[Floats]] = [[], [], [], []]
    for member in members:
        node, middle, quadrature = _angles(family.period, steps, member.phase)
        factor = member.pressure_factor
        pieces = (
            *family.sampled(rows, node, factor, slopes=True),
            family.sampled(rows, middle, factor)[0],
            family.sampled(rows, quadrature, factor)[0],
        )
        for whole, piece in zip(found, pieces, strict=True):
            whole.append(piece)
    return [one[0] if len(one) == 1 else np.concatenate(one, axis=1) for one in found]


def _joined(of_members: list[tuple[Floats, ...]]) -> tuple[Floats, ...]:
    """Arrays of all members: those of one kind follow each other."""
    if len(of_members) == 1:
        return of_members[0]
    return tuple(np.concatenate(one) for one in zip(*of_members, strict=True))


def _angles(period: float, steps: int, phase: float) -> tuple[Floats, Floats, Floats]:
    """Nodes, middles and quadrature points of a cycle, in the angle of a cylinder of this phase."""
    width = period / steps
    node: Floats = np.arange(steps, dtype=np.float64) * width
    offsets = np.array([half + 0.5 * point for half in (0.0, 0.5) for point in GAUSS_POINTS])
    quadrature: Floats = (node[:, None] + offsets * width).reshape(-1)
    middle: Floats = np.asarray(node + 0.5 * width)
    return node + phase, middle + phase, quadrature + phase


@lru_cache(maxsize=16)
def _turns(period: float, steps: int, phase: float) -> tuple[Floats, ...]:
    """Sine and cosine of the nodes, the middles and the quadrature points."""
    return tuple(f(angle) for angle in _angles(period, steps, phase) for f in (np.sin, np.cos))


_kept: WeakKeyDictionary[Diagram, dict[tuple[int, float], tuple[Floats, ...]]] = WeakKeyDictionary()
KEPT, LARGEST_KEPT, FEW_ROWS = 3, 3000, 4
"""How many samplings of a diagram are cached, their largest number of nodes, and the number of rows
up to which they are. Without the cache, a single design would spend most of its time on evaluating
splines; for many rows, evaluating all of them together takes less."""


def _sampled(diagram: Diagram, steps: int, phase: float) -> tuple[Floats, ...]:
    """Pressure at the nodes, its slope there, pressure at middles and quadrature points."""
    known = _kept.get(diagram)
    if known is None:
        known = _kept.setdefault(diagram, {})
    if (steps, phase) not in known:
        node, middle, quadrature = _angles(diagram.period, steps, phase)
        found = diagram(node), diagram.derivative(node), diagram(middle), diagram(quadrature)
        if steps <= LARGEST_KEPT:
            while len(known) >= KEPT:
                known.pop(next(iter(known)))
            known[steps, phase] = found
        return found
    return known[steps, phase]


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


@inlined
def take_cubic(
    nodes: int, width: float, table: Floats, value: int, slope: int, middle: Floats, missed: Floats
) -> None:
    """What a cubic through two nodes misses in their middle, docs/method.md (52)."""
    for j in range(nodes):
        after = j + 1 if j + 1 < nodes else 0
        cubic = 0.5 * (table[value, j] + table[value, after]) + 0.125 * width * (
            table[slope, j] - table[slope, after]
        )
        missed[j] = middle[j] - cubic


@inlined
def take_tilt(
    nodes: int, width: float, factor: float, table: Floats, value: int, slope: int, middle: Floats,
    missed: Floats,
) -> None:  # fmt: skip
    """What a cubic misses of the slope in the middle, which is `factor` times `middle`.

    docs/method.md (52).
    """
    for j in range(nodes):
        after = j + 1 if j + 1 < nodes else 0
        ends = table[slope, j] + table[slope, after]
        cubic = 1.5 * (table[value, after] - table[value, j]) - 0.25 * width * ends
        missed[j] = width * factor * middle[j] - cubic


@inlined
def rates_of_work(ratio: float, blend: Blend, grid: Grid, rates: Floats) -> None:
    """Rate of one cylinder's work, docs/method.md (28) over A r, at every quadrature point."""
    first, second = grid.at_quadrature[blend.first], grid.at_quadrature[blend.second]
    before, behind = blend.scale * (1.0 - blend.weight), blend.scale * blend.weight
    sine, cosine = grid.quadrature_sine, grid.quadrature_cosine
    for place in range(rates.size):
        pressure = before * first[place] + behind * second[place] - blend.crankcase
        rates[place] = pressure * velocity_at(sine[place], cosine[place], ratio)


@inlined
def stroke_friction_weights(
    ratio: float, offset: float, blend: Blend, grid: Grid, member: int, speeds: Floats
) -> tuple[float, float, float, float]:
    """Level over cycle mean of each part of the friction of one representative cylinder.

    The factors of docs/method.md (32). `ratio` and `offset` are over its own crank radius; `speeds`
    gets the reduced piston speed at its quadrature points.
    """
    sine, cosine, first, second = points_of(blend, grid, member)
    top = sine_of_top(ratio, offset)
    upright = math.sqrt(1.0 - top * top)
    before, behind = blend.scale * (1.0 - blend.weight), blend.scale * blend.weight
    lift, count = blend.friction.ring - blend.crankcase, sine.size
    boundary = mixed = hydrodynamic = skirt = 0.0
    # All points get the weight of the outer ones, then the middle ones what they lack, because
    # only loops without branches become vectors.
    weight = 3.0 * END_WEIGHT / count
    for i in range(count):
        s, c = turned(sine[i], cosine[i], top, upright)
        speeds[i] = offset_velocity_at(s, c, ratio, offset)
        load = before * first[i] + behind * second[i] + lift
        parts = stroke_friction_parts_at(load, speeds[i], sine[i])
        boundary += weight * parts[0]
        mixed += weight * parts[1]
        hydrodynamic += weight * parts[2]
        skirt += weight * parts[3]
    weight = 3.0 * (MIDDLE_WEIGHT - END_WEIGHT) / count
    for i in range(1, count, 3):
        load = before * first[i] + behind * second[i] + lift
        parts = stroke_friction_parts_at(load, speeds[i], sine[i])
        boundary += weight * parts[0]
        mixed += weight * parts[1]
        hydrodynamic += weight * parts[2]
        skirt += weight * parts[3]
    friction = blend.friction
    return (
        level_over_mean_at(friction.boundary, boundary),
        level_over_mean_at(friction.mixed, mixed),
        level_over_mean_at(friction.hydrodynamic, hydrodynamic),
        level_over_mean_at(friction.skirt, skirt),
    )


@inlined
def points_of(
    blend: Blend, grid: Grid, member: int
) -> tuple[Floats, Floats, Floats, Floats]:  # fmt: skip
    """Sine, cosine and both pressures of a blend at one representative's quadrature points.

    The arrays begin at 0: where the compiler sees that no place is negative, loops become vectors.
    """
    count = 6 * steps_of(grid)
    here = slice(member * count, (member + 1) * count)
    return (
        grid.quadrature_sine[here], grid.quadrature_cosine[here],
        grid.at_quadrature[blend.first, here], grid.at_quadrature[blend.second, here],
    )  # fmt: skip


@inlined
def rates_with_offset(ratio: float, offset: float, blend: Blend, grid: Grid, rates: Floats) -> None:
    """As `rates_of_work`, for an offset, unequal throws and friction: docs/method.md (28), (32).

    `offset` is over the crank radius.
    """
    for member in range(grid.masses.size):
        rates_of_member(ratio, offset, blend, grid, member, rates)


@inlined
def rates_of_member(
    ratio: float, offset: float, blend: Blend, grid: Grid, member: int, rates: Floats
) -> tuple[float, float, float, float]:
    """`rates_with_offset` of one representative cylinder, and the weights of its friction.

    Its crank ratio and offset are over its own radius: the rod and the offset are the engine's.
    """
    radius, friction = grid.radii[member], blend.friction
    own_ratio, own_offset = ratio * radius, offset / radius
    sine, cosine, first, second = points_of(blend, grid, member)
    count = sine.size
    mine = rates[member * count : (member + 1) * count]
    before, behind = blend.scale * (1.0 - blend.weight), blend.scale * blend.weight
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


@inlined
def work_of_half(rates: Floats, place: int) -> float:
    """Mean rate over half an interval from `place` on: Gauss-Legendre, docs/method.md (49)."""
    return END_WEIGHT * (rates[place] + rates[place + 2]) + MIDDLE_WEIGHT * rates[place + 1]


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
def finish(nodes: int, width: float, table: Floats, middles: Floats) -> None:
    """From sums over cylinders: the work without its mean, and what cubics miss.

    docs/method.md (43) and (52).
    """
    total = 0.0
    for j in range(nodes):
        total += table[GAS_WORK, j]
    mean = total / (nodes * width)
    running = 0.0
    mean_work = 0.0
    # The squares of many cylinders nearly add up to a constant. It is subtracted before the mean is
    # taken: rounding in a sum of nearly equal numbers is always on the same side and would remain
    # in the mean, where masses far above the inertia multiply it.
    level = table[SQUARE, 0]
    mean_square = 0.0
    for j in range(nodes):
        whole = table[GAS_WORK, j] - mean * width
        table[GAS_WORK, j] = running
        mean_work += running
        table[SQUARE, j] -= level
        middles[1, j] -= level
        mean_square += table[SQUARE, j]
        middles[0, j] += running - 0.5 * mean * width
        running += whole
        table[GAS_TORQUE, j] = table[TORQUE, j] - mean
    mean_work /= nodes
    mean_square /= nodes
    for j in range(nodes):
        table[GAS_WORK, j] -= mean_work
        middles[0, j] -= mean_work
        table[SQUARE, j] -= mean_square
        middles[1, j] -= mean_square
    take_cubic(nodes, width, table, GAS_WORK, GAS_TORQUE, middles[0], table[GAS_WORK_MIDDLE])
    take_cubic(nodes, width, table, SQUARE, SQUARE_SLOPE, middles[1], table[SQUARE_MIDDLE])
    take_cubic(nodes, width, table, TORQUE, TORQUE_SLOPE, middles[2], table[TORQUE_MIDDLE])
    take_cubic(nodes, width, table, SHAPE, SHAPE_SLOPE, middles[3], table[SHAPE_MIDDLE])
    for j in range(nodes):
        middles[2, j] -= mean
    take_tilt(nodes, width, 1.0, table, GAS_WORK, GAS_TORQUE, middles[2], table[GAS_WORK_TILT])
    take_tilt(nodes, width, -2.0, table, SQUARE, SQUARE_SLOPE, middles[3], table[SQUARE_TILT])


@kernel
def build_unequal(
    ratio: float,
    offset: float,
    blend: Blend,
    nodes: int,
    width: float,
    grid: Grid,
    table: Floats,
    middles: Floats,
    rates: Floats,
) -> None:
    """Fill a table as `build_equal`, for an offset, unequal masses and radii, and friction.

    docs/method.md (32), (34), (50) and (51).
    """
    clear(table, middles)
    steps = steps_of(grid)
    friction = blend.friction
    varies, level = varies_at(friction), total_level_at(friction)
    for member in range(grid.masses.size):
        weights = rates_of_member(ratio, offset, blend, grid, member, rates)
        radius = grid.radii[member]
        own_ratio, own_offset = ratio * radius, offset / radius
        mass = grid.masses[member] * radius * radius
        top = sine_of_top(own_ratio, own_offset)
        upright = math.sqrt(1.0 - top * top)
        for step in range(member * steps, (member + 1) * steps):
            j = step % nodes
            before = 0.5 * width * work_of_half(rates, step * 6)
            behind = 0.5 * width * work_of_half(rates, step * 6 + 3)
            table[GAS_WORK, j] += before + behind
            middles[0, j] += before

            sine, cosine = turned(grid.node_sine[step], grid.node_cosine[step], top, upright)
            v = offset_velocity_at(sine, cosine, own_ratio, own_offset)
            b = offset_acceleration_at(sine, cosine, own_ratio, own_offset)
            pressure = blended(blend, grid.at_node, step) - blend.crankcase
            slope = blended(blend, grid.slope_at_node, step)
            table[TORQUE, j] += radius * pressure * v
            table[TORQUE_SLOPE, j] += radius * (slope * v + pressure * b)
            table[SHAPE, j] -= mass * b * v
            table[SHAPE_SLOPE, j] -= mass * (
                b * b + v * offset_jerk_at(sine, cosine, own_ratio, own_offset)
            )
            table[SQUARE, j] += mass * v * v
            table[SQUARE_SLOPE, j] += 2.0 * mass * v * b
            if varies:
                load, s, c = friction.ring + pressure, grid.node_sine[step], grid.node_cosine[step]
                parts = stroke_friction_parts_at(load, v, s)
                table[TORQUE, j] -= weighted_sum_at(weights, parts) - level
                table[TORQUE_SLOPE, j] -= weighted_sum_at(
                    weights, stroke_friction_slopes_at(load, slope, v, b, s, c)
                )

            sine, cosine = turned(grid.middle_sine[step], grid.middle_cosine[step], top, upright)
            v = offset_velocity_at(sine, cosine, own_ratio, own_offset)
            pressure = blended(blend, grid.at_middle, step) - blend.crankcase
            middles[1, j] += mass * v * v
            middles[2, j] += radius * pressure * v
            middles[3, j] -= mass * offset_acceleration_at(sine, cosine, own_ratio, own_offset) * v
            if varies:
                load, s = friction.ring + pressure, grid.middle_sine[step]
                parts = stroke_friction_parts_at(load, v, s)
                middles[2, j] -= weighted_sum_at(weights, parts) - level
    finish(nodes, width, table, middles)


@kernel
def build_equal(
    ratio: float,
    blend: Blend,
    nodes: int,
    width: float,
    grid: Grid,
    table: Floats,
    middles: Floats,
    rates: Floats,
) -> None:
    """Fill `table` (TABLE_ROWS, nodes) for one crank ratio and diagram, masses equal.

    docs/method.md (34), (50) and (51). The period is `nodes` of the grid's cycle. `middles` (4,
    nodes) and `rates` (quadrature points) are scratch.
    """
    steps = grid.node_sine.size
    clear(table, middles)
    rates_of_work(ratio, blend, grid, rates)
    # Row GAS_WORK first collects the work of whole intervals, `middles` that of their first halves.
    for step in range(steps):
        j = step % nodes
        before = 0.5 * width * work_of_half(rates, step * 6)
        behind = 0.5 * width * work_of_half(rates, step * 6 + 3)
        table[GAS_WORK, j] += before + behind
        middles[0, j] += before

        sine, cosine = grid.node_sine[step], grid.node_cosine[step]
        v = velocity_at(sine, cosine, ratio)
        b = acceleration_at(sine, cosine, ratio)
        pressure = blended(blend, grid.at_node, step) - blend.crankcase
        slope = blended(blend, grid.slope_at_node, step)
        table[TORQUE, j] += pressure * v
        table[TORQUE_SLOPE, j] += slope * v + pressure * b
        table[SHAPE, j] -= b * v
        table[SHAPE_SLOPE, j] -= b * b + v * jerk_at(sine, cosine, ratio)
        table[SQUARE, j] += v * v
        table[SQUARE_SLOPE, j] += 2.0 * v * b

        sine, cosine = grid.middle_sine[step], grid.middle_cosine[step]
        v = velocity_at(sine, cosine, ratio)
        pressure = blended(blend, grid.at_middle, step) - blend.crankcase
        middles[1, j] += v * v
        middles[2, j] += pressure * v
        middles[3, j] -= acceleration_at(sine, cosine, ratio) * v
    finish(nodes, width, table, middles)


@inlined
def build(
    ratio: float, offset: float, blend: Blend, nodes: int, width: float, grid: Grid, table: Floats,
    middles: Floats, rates: Floats,
) -> None:  # fmt: skip
    """Fill a table: by `build_equal` where cylinders are equal, else by `build_unequal`."""
    plain = offset == 0.0 and not varies_at(blend.friction)
    for member in range(grid.masses.size):
        plain = plain and grid.masses[member] == 1.0 and grid.radii[member] == 1.0
    if plain:
        build_equal(ratio, blend, nodes, width, grid, table, middles, rates)
    else:
        build_unequal(ratio, offset, blend, nodes, width, grid, table, middles, rates)
