"""Work curves of the designs of a block: each adds up its own from `work_harmonics.Works`.

What is linear in the curves is added up at the coarse nodes for all lanes of a block, and at fine
nodes where somebody asks for them. What is not is bounded by the interval that a design lies in.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from engine_dyn.compilation import (
    SQUARE_SIDE,
    formula,
    inlined,
    on_stack,
    turn_eights,
    wide_vectors,
)
from engine_dyn.geometry.slider_crank import offset_velocity_at, sine_of_top, turned
from engine_dyn.geometry.velocity_harmonics import (
    OFFSET_TERMS,
    TURN_SAMPLES,
    squares_of,
)
from engine_dyn.speed.batch.forms import CONSTANT_LOAD, Form
from engine_dyn.speed.batch.state import GAS_TORQUE_RANGE, LANES
from engine_dyn.speed.batch.two_grid import (
    ALIAS_P,
    ALIAS_V,
    ALIASED,
    CHUNK,
    CONSTANTS,
    CUBES,
    FOURTHS,
    HIGHEST_SLOPE,
    HIGHEST_SLOPE_V,
    NODE_FIELDS,
    P_ABOVE,
    P_BELOW,
    PP,
    PV,
    RIPPLE,
    RIPPLE_V,
    SQUARES,
    TILT,
    TILT_V,
    V_ABOVE,
    V_BELOW,
    VV,
    WORK,
    P,
    TwoGrid,
    V,
)
from engine_dyn.speed.batch.work_harmonics import (
    ABOVE,
    BELOW,
    BOUNDS_BEFORE_ROWS,
    FIRST_SQUARE,
    LOAD,
    OF_LOAD,
    RIPPLES,
    SQUARE_WORKS,
    STEEPEST,
    TILTS,
    TORQUE_RANGE,
    UNIT,
    WORKS_BEFORE_ROWS,
    WORST,
    Works,
)
from engine_dyn.types import Floats, Integers

__all__ = [
    "Lanes",
    "fill_block",
    "has_load",
    "make_own",
    "own_pair",
    "own_pairs",
]

WEIGHTS_OF_TERM = 3 + SQUARE_WORKS
"""Weights of a lane for each term: of the two diagrams, of a pressure of 1, of the squares. The
weight of a load over angle, where there is one, comes behind those of all terms."""

TERM_ROWS, SAMPLE_ROWS = OFFSET_TERMS * LANES, TURN_SAMPLES * LANES

SIDE, SIDE_ROWS = 8, 8 * LANES
"""Terms that are written out: sums of eight products become vectors."""


class Lanes(NamedTuple):
    """What the curves of the lanes of a block follow from, each (lane).

    Attributes
    ----------
    ratios, offsets : ndarray
        Crank radius over rod length, offset over crank radius.
    before, behind : ndarray
        Factors on the pressures of the two diagrams between which the lane's own lies.
    crankcase : ndarray
        Pressure below the piston [Pa].
    loads : ndarray
        Factor on a load over angle over piston area times crank radius [1/m3]; 0 without.
    """

    ratios: Floats
    offsets: Floats
    before: Floats
    behind: Floats
    crankcase: Floats
    loads: Floats


def make_own(nodes: int, refinement: int, works: Works, loaded: bool) -> TwoGrid:
    """Grids of a block whose lanes have curves of their own; the fine one stays a sum.

    With a load over angle lanes have one weight more.
    """
    coarse, terms = nodes // refinement, works.coarse.shape[3]
    return TwoGrid(
        coarse=np.zeros((coarse, NODE_FIELDS, LANES)),
        chunk=np.zeros((coarse // CHUNK, NODE_FIELDS, LANES)),
        fine=works.fine,
        constants=np.zeros((CONSTANTS, LANES)),
        mix=np.zeros((WEIGHTS_OF_TERM * terms + loaded) * LANES),
        units=np.zeros((coarse, 2, LANES)),
        windows=np.zeros((0, 0)),
    )


@inlined
def has_load(terms: int, mix: Floats) -> bool:
    """Whether the weights of lanes have one for a load over angle, see `make_own`."""
    return mix.size > load_weights(terms)


@inlined
def load_weights(terms: int) -> int:
    """Place of the weights of a load over angle among those of the lanes, where there is one."""
    return WEIGHTS_OF_TERM * terms * LANES


@inlined
def weigh(lanes: int, inputs: Lanes, works: Works, mix: Floats) -> None:
    """Numbers by which every lane adds up its curves: (weight, lane), flat.

    For each term, those of the diagram before its own, of the one behind, and of a pressure of 1;
    then those of the squared velocity, and that of a load over angle where there is one.
    """
    wide_vectors()
    terms = works.coarse.shape[3]
    velocity = on_stack(TERM_ROWS)
    squares = mix[3 * terms * LANES : 5 * terms * LANES]
    if terms == OFFSET_TERMS:
        terms_with_offset(lanes, inputs.ratios, inputs.offsets, works, velocity, squares)
    else:
        centred_terms(lanes, inputs.ratios, works, velocity)
        squares_of(terms, LANES, velocity, squares)
    before, behind, crankcase = inputs.before, inputs.behind, inputs.crankcase
    for term in range(terms):
        row = term * LANES
        next_row, unit_row = row + terms * LANES, row + 2 * terms * LANES
        for k in range(lanes):
            mix[row + k] = before[k] * velocity[row + k]
            mix[next_row + k] = behind[k] * velocity[row + k]
            mix[unit_row + k] = -crankcase[k] * velocity[row + k]
    if has_load(terms, mix):
        weights = mix[load_weights(terms) :]
        for k in range(lanes):
            weights[k] = inputs.loads[k]


@inlined
def terms_with_offset(
    lanes: int, ratios: Floats, offsets: Floats, works: Works, velocity: Floats, squares: Floats
) -> None:
    """Terms of the velocity of every lane, and of its square, from samples over a turn."""
    wide_vectors()
    samples, top, upright = on_stack(SAMPLE_ROWS), on_stack(LANES), on_stack(LANES)
    for k in range(lanes):
        top[k] = sine_of_top(ratios[k], offsets[k])
        upright[k] = math.sqrt(1.0 - top[k] * top[k])
    for i in range(TURN_SAMPLES):
        sine, cosine = works.sine[i], works.cosine[i]
        for k in range(lanes):
            s, c = turned(sine, cosine, top[k], upright[k])
            samples[i * LANES + k] = offset_velocity_at(s, c, ratios[k], offsets[k])
    transform(lanes, works.weights, samples, velocity)
    for i in range(SAMPLE_ROWS):
        samples[i] *= samples[i]
    transform(lanes, works.square_weights, samples, squares)


@inlined
def transform(lanes: int, weights: Floats, samples: Floats, to: Floats) -> None:
    """Terms of samples of every lane: (term, lane) and (sample, lane), flat."""
    wide_vectors()
    sums = on_stack(LANES)
    for term in range(weights.shape[0]):
        for k in range(lanes):
            sums[k] = 0.0
        for i in range(weights.shape[1]):
            weight = weights[term, i]
            for k in range(lanes):
                sums[k] += weight * samples[i * LANES + k]
        for k in range(lanes):
            to[term * LANES + k] = sums[k]


@inlined
def centred_terms(lanes: int, ratios: Floats, works: Works, velocity: Floats) -> None:
    """Terms of the velocity of every lane without an offset, docs/method.md (110)."""
    wide_vectors()
    terms = works.coarse.shape[3]
    samples = on_stack(SAMPLE_ROWS)
    for i in range(works.sine.size):
        sine, cosine = works.sine[i], works.cosine[i]
        for k in range(lanes):
            lean = ratios[k] * sine
            samples[i * LANES + k] = sine * cosine / math.sqrt(1.0 - lean * lean)
    for k in range(lanes):
        velocity[k] = 1.0
    for term in range(1, terms):
        row = term * LANES
        for k in range(lanes):
            velocity[row + k] = 0.0
        for i in range(works.sine.size):
            weight = works.weights[term - 1, i]
            for k in range(lanes):
                velocity[row + k] += weight * samples[i * LANES + k]
        for k in range(lanes):
            velocity[row + k] *= ratios[k]


@formula
def add_eight(
    curve: Floats, n: int, term: int, row: int, lanes: int, mix: Floats, values: Floats,
    works: Floats,
) -> None:  # fmt: skip
    """Add to every lane eight terms of a curve at a coarse node, weighted from `row` on.

    To `values` the curve itself, to `works` its integral: both have the same weights.
    """
    a0, a1, a2 = curve[n, 0, term], curve[n, 0, term + 1], curve[n, 0, term + 2]
    a3, a4, a5 = curve[n, 0, term + 3], curve[n, 0, term + 4], curve[n, 0, term + 5]
    a6, a7 = curve[n, 0, term + 6], curve[n, 0, term + 7]
    b0, b1, b2 = curve[n, 1, term], curve[n, 1, term + 1], curve[n, 1, term + 2]
    b3, b4, b5 = curve[n, 1, term + 3], curve[n, 1, term + 4], curve[n, 1, term + 5]
    b6, b7 = curve[n, 1, term + 6], curve[n, 1, term + 7]
    # A slice begins at 0: where the compiler sees that no place is negative, loops become vectors.
    weights = mix[row : row + SIDE_ROWS]
    for k in range(lanes):
        w0, w1, w2, w3 = (
            weights[k], weights[LANES + k], weights[2 * LANES + k], weights[3 * LANES + k]
        )  # fmt: skip
        w4, w5, w6, w7 = (
            weights[4 * LANES + k], weights[5 * LANES + k], weights[6 * LANES + k],
            weights[7 * LANES + k],
        )  # fmt: skip
        values[k] += a0 * w0 + a1 * w1 + a2 * w2 + a3 * w3 + a4 * w4 + a5 * w5 + a6 * w6 + a7 * w7
        works[k] += b0 * w0 + b1 * w1 + b2 * w2 + b3 * w3 + b4 * w4 + b5 * w5 + b6 * w6 + b7 * w7


@inlined
def fill_coarse(
    lanes: int, first: int, second: int, works: Works, mix: Floats, coarse: Floats, units: Floats
) -> None:
    """P, V and their integrals at the coarse nodes of every lane.

    `units` (coarse node, 2, lane) is memory for the work of the crankcase pressure, which repeats
    as V does.
    """
    wide_vectors()
    terms = works.coarse.shape[3]
    of_next, of_unit = terms * LANES, 2 * terms * LANES
    of_square, of_more = 3 * terms * LANES, 4 * terms * LANES
    values, integrals = on_stack(LANES), on_stack(LANES)
    for n in range(coarse.shape[0]):
        node, interval = works.image[0, n], works.image[1, n]
        if node == n or interval == n:
            unit, square = works.coarse[UNIT], works.coarse[FIRST_SQUARE]
            more_square = works.coarse[FIRST_SQUARE + 1]
            for k in range(lanes):
                values[k] = integrals[k] = 0.0
            for i in range(0, terms, SIDE):
                add_eight(unit, n, i, of_unit + i * LANES, lanes, mix, values, integrals)
            keep(lanes, values, integrals, units[n, 0], units[n, 1])
            for k in range(lanes):
                values[k] = integrals[k] = 0.0
            for i in range(0, terms, SIDE):
                add_eight(square, n, i, of_square + i * LANES, lanes, mix, values, integrals)
                add_eight(more_square, n, i, of_more + i * LANES, lanes, mix, values, integrals)
            keep(lanes, values, integrals, coarse[n, V], coarse[n, SQUARES])
        if node != n:
            keep(lanes, units[node, 0], coarse[node, V], units[n, 0], coarse[n, V])
        if interval != n:
            keep(
                lanes,
                units[interval, 1],
                coarse[interval, SQUARES],
                units[n, 1],
                coarse[n, SQUARES],
            )
        before, behind = works.coarse[first], works.coarse[second]
        keep(lanes, units[n, 0], units[n, 1], values, integrals)
        for i in range(0, terms, SIDE):
            add_eight(before, n, i, i * LANES, lanes, mix, values, integrals)
            add_eight(behind, n, i, of_next + i * LANES, lanes, mix, values, integrals)
        if has_load(terms, mix):
            weights = mix[load_weights(terms) :]
            add_one(lanes, works.coarse[LOAD, n, 0, 0], weights, values)
            add_one(lanes, works.coarse[LOAD, n, 1, 0], weights, integrals)
        keep(lanes, values, integrals, coarse[n, P], coarse[n, WORK])


@formula
def keep(lanes: int, one: Floats, other: Floats, to_one: Floats, to_other: Floats) -> None:
    """Copy two rows of lanes."""
    for k in range(lanes):
        to_one[k] = one[k]
        to_other[k] = other[k]


@formula
def own_pair(
    place: int, pair: int, k: int, first: int, second: int, fine: Floats, mix: Floats
) -> tuple[float, float]:
    """One of the pairs of a fine node of lane k: of P, and of V. `mix` is (weight, lane), flat."""
    terms = fine.shape[2] // 4
    gas = squares = 0.0
    for i in range(terms):
        column, row = pair * terms + i, i * LANES + k
        gas += fine[first, place, column] * mix[row]
        gas += fine[second, place, column] * mix[row + terms * LANES]
        gas += fine[UNIT, place, column] * mix[row + 2 * terms * LANES]
        squares += fine[FIRST_SQUARE, place, column] * mix[row + 3 * terms * LANES]
        squares += fine[FIRST_SQUARE + 1, place, column] * mix[row + 4 * terms * LANES]
    if has_load(terms, mix):
        gas += fine[LOAD, place, pair * terms] * mix[load_weights(terms) + k]
    return gas, squares


@formula
def add_turned(
    curve: Floats, column: int, places: Integers, row: int, lanes: int, mix: Floats,
    turned: Floats, to: Floats,
) -> None:  # fmt: skip
    """Add to every lane eight terms of a curve, from a column on, at a place of its own."""
    for k in range(0, lanes, SQUARE_SIDE):
        turn_eights(curve, column, places, k, turned)
    weights = mix[row : row + SIDE_ROWS]
    for k in range(lanes):
        to[k] += (
            turned[k] * weights[k] + turned[LANES + k] * weights[LANES + k]
            + turned[2 * LANES + k] * weights[2 * LANES + k]
            + turned[3 * LANES + k] * weights[3 * LANES + k]
            + turned[4 * LANES + k] * weights[4 * LANES + k]
            + turned[5 * LANES + k] * weights[5 * LANES + k]
            + turned[6 * LANES + k] * weights[6 * LANES + k]
            + turned[7 * LANES + k] * weights[7 * LANES + k]
        )  # fmt: skip


@inlined
def own_pairs(
    pair: int, places: Integers, lanes: int, first: int, second: int, fine: Floats, mix: Floats,
    gas: Floats, squares: Floats,
) -> None:  # fmt: skip
    """As `own_pair`, for every lane, each at a place of its own."""
    wide_vectors()
    turned, sums = on_stack(SIDE_ROWS), on_stack(LANES)
    terms = fine.shape[2] // 4
    for k in range(lanes):
        sums[k] = 0.0
    for i in range(0, terms, SIDE):
        column, row = pair * terms + i, i * LANES
        add_turned(fine[first], column, places, row, lanes, mix, turned, sums)
        row += terms * LANES
        add_turned(fine[second], column, places, row, lanes, mix, turned, sums)
        row += terms * LANES
        add_turned(fine[UNIT], column, places, row, lanes, mix, turned, sums)
    if has_load(terms, mix):
        curve, weights = fine[LOAD], mix[load_weights(terms) :]
        for k in range(lanes):
            sums[k] += curve[places[k], pair * terms] * weights[k]
    for k in range(lanes):
        gas[k] = sums[k]
        sums[k] = 0.0
    for i in range(0, terms, SIDE):
        column, row = pair * terms + i, (3 * terms + i) * LANES
        add_turned(fine[FIRST_SQUARE], column, places, row, lanes, mix, turned, sums)
        row += terms * LANES
        add_turned(fine[FIRST_SQUARE + 1], column, places, row, lanes, mix, turned, sums)
    for k in range(lanes):
        squares[k] = sums[k]


@formula
def mixed(
    lanes: int, one: float, other: float, unit: float, load: float, inputs: Lanes, to: Floats
) -> None:
    """Bound of every lane from those of its two diagrams, of a pressure of 1 and of a load."""
    before, behind, crankcase, loads = (
        inputs.before, inputs.behind, inputs.crankcase, inputs.loads
    )  # fmt: skip
    for k in range(lanes):
        of_gas = before[k] * one + behind[k] * other + crankcase[k] * unit
        to[k] = of_gas + abs(loads[k]) * load


@formula
def equal(lanes: int, value: float, to: Floats) -> None:
    """Set all lanes to one value."""
    for k in range(lanes):
        to[k] = value


@formula
def add_one(lanes: int, factor: float, weights: Floats, to: Floats) -> None:
    """Add one term to every lane."""
    for k in range(lanes):
        to[k] += factor * weights[k]


@inlined
def fill_block(
    form: Form, lanes: int, interval: int, first: int, second: int, inputs: Lanes, works: Works,
    two_grid: TwoGrid, state: Floats,
) -> None:  # fmt: skip
    """Coarse grids of all lanes of a block: between the same two diagrams, in one interval.

    `first` and `second` are the places of the two diagrams.
    """
    wide_vectors()
    coarse, constants = two_grid.coarse, two_grid.constants
    mix, terms = two_grid.mix, works.coarse.shape[3]
    weigh(lanes, inputs, works, mix)
    fill_coarse(lanes, first, second, works, mix, coarse, two_grid.units)
    fill_bounds(lanes, interval, first, second, inputs, works, two_grid, state)
    of_gas, of_squares = on_stack(LANES), on_stack(LANES)
    for k in range(lanes):
        of_gas[k] = of_squares[k] = 0.0
    for i in range(terms):
        row, apart = i * LANES, terms * LANES
        add_one(lanes, works.alias[first, i], mix[row : row + LANES], of_gas)
        row += apart
        add_one(lanes, works.alias[second, i], mix[row : row + LANES], of_gas)
        row += apart
        add_one(lanes, works.alias[UNIT, i], mix[row : row + LANES], of_gas)
        row += apart
        add_one(lanes, works.alias[FIRST_SQUARE, i], mix[row : row + LANES], of_squares)
        row += apart
        add_one(lanes, works.alias[FIRST_SQUARE + 1, i], mix[row : row + LANES], of_squares)
    if has_load(terms, mix):
        add_one(lanes, works.alias[LOAD, 0], mix[load_weights(terms) :], of_gas)
    keep(lanes, of_gas, of_squares, constants[ALIAS_P], constants[ALIAS_V])
    if len(form) >= CONSTANT_LOAD:
        fill_moments(form, lanes, coarse, constants)


@inlined
def fill_bounds(
    lanes: int, interval: int, first: int, second: int, inputs: Lanes, works: Works,
    two_grid: TwoGrid, state: Floats,
) -> None:  # fmt: skip
    """Bounds of the curves of every lane, from those over the interval; arguments as above."""
    wide_vectors()
    chunk, constants = two_grid.chunk, two_grid.constants
    shift = BOUNDS_BEFORE_ROWS - WORKS_BEFORE_ROWS
    bounds, numbers = works.chunk[interval], works.numbers[interval]
    here, after = first + shift, second + shift
    # Without a load its weight is 0.
    of_load = OF_LOAD if has_load(works.coarse.shape[3], two_grid.mix) else 0
    for group in range(chunk.shape[0]):
        one, other, unit, load = (
            bounds[here, group], bounds[after, group], bounds[0, group], bounds[of_load, group]
        )  # fmt: skip
        # The crankcase pressure and the load are subtracted: above is below.
        either, of_either = max(unit[ABOVE], unit[BELOW]), max(load[ABOVE], load[BELOW])
        of_chunk = chunk[group]
        mixed(lanes, one[ABOVE], other[ABOVE], either, of_either, inputs, of_chunk[P_ABOVE])
        mixed(lanes, one[BELOW], other[BELOW], either, of_either, inputs, of_chunk[P_BELOW])
        mixed(
            lanes, one[RIPPLES], other[RIPPLES], unit[RIPPLES], load[RIPPLES], inputs,
            of_chunk[RIPPLE],
        )  # fmt: skip
        mixed(lanes, one[TILTS], other[TILTS], unit[TILTS], load[TILTS], inputs, of_chunk[TILT])
        equal(lanes, bounds[1, group, ABOVE], of_chunk[V_ABOVE])
        equal(lanes, bounds[1, group, BELOW], of_chunk[V_BELOW])
        equal(lanes, bounds[1, group, RIPPLES], of_chunk[RIPPLE_V])
        equal(lanes, bounds[1, group, TILTS], of_chunk[TILT_V])
    one, other, unit, load = numbers[here], numbers[after], numbers[0], numbers[of_load]
    mixed(
        lanes, one[TORQUE_RANGE], other[TORQUE_RANGE], unit[TORQUE_RANGE], load[TORQUE_RANGE],
        inputs, state[GAS_TORQUE_RANGE : GAS_TORQUE_RANGE + LANES],
    )  # fmt: skip
    mixed(
        lanes, one[STEEPEST], other[STEEPEST], unit[STEEPEST], load[STEEPEST], inputs,
        constants[HIGHEST_SLOPE],
    )  # fmt: skip
    equal(lanes, numbers[1, STEEPEST], constants[HIGHEST_SLOPE_V])
    worst = max(max(one[WORST], other[WORST]), max(unit[WORST], load[WORST]))
    equal(lanes, max(worst, numbers[1, WORST]), constants[ALIASED])


@inlined
def fill_moments(form: Form, lanes: int, coarse: Floats, constants: Floats) -> None:
    """Means of the products of P and V that the closure of `form` needs."""
    wide_vectors()
    nodes = coarse.shape[0]
    share = 1.0 / nodes
    for i in range(CUBES, FOURTHS + 5):
        for k in range(lanes):
            constants[i, k] = 0.0
    for k in range(lanes):
        constants[PP, k] = 0.0
        constants[PV, k] = 0.0
        constants[VV, k] = 0.0
    for n in range(nodes):
        works, squares = coarse[n, P], coarse[n, V]
        for k in range(lanes):
            p, v = works[k], squares[k]
            constants[PP, k] += share * p * p
            constants[PV, k] += share * p * v
            constants[VV, k] += share * v * v
        if len(form) == CONSTANT_LOAD:
            for k in range(lanes):
                p, v = works[k], squares[k]
                p2, v2 = share * p * p, share * v * v
                constants[CUBES, k] += p2 * p
                constants[CUBES + 1, k] += p2 * v
                constants[CUBES + 2, k] += v2 * p
                constants[CUBES + 3, k] += v2 * v
                constants[FOURTHS, k] += p2 * p * p
                constants[FOURTHS + 1, k] += p2 * p * v
                constants[FOURTHS + 2, k] += p2 * v * v
                constants[FOURTHS + 3, k] += v2 * v * p
                constants[FOURTHS + 4, k] += v2 * v * v
