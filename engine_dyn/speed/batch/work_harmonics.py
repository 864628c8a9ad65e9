"""Work curves of designs that have no table in common: sums over harmonics of the piston velocity.

The work of the gas is linear in the reduced velocity, and this is a sum of few sines whose factors
depend on the crank ratio alone (`engine_dyn.geometry.velocity_harmonics`). So the work P of a
pressure p at any crank ratio is a sum of its works against these sines, docs/method.md (112):

    P(phi) = sum_t gamma_t(lambda) P_t(phi),    P_t = int sum_i p_i sin(k_t phi_i) dphi

With an offset the velocity has cosines too. There is one set of curves P_t for each diagram of a
family, and one for a pressure of 1, on which the crankcase pressure acts; the sum V of the squared
velocities is a sum of cosines, and of sines with an offset. They are summed over the cylinders
once. A load over angle is one curve more. Neither a crank ratio, nor a scale of the pressure, nor
a diagram between two others needs another curve: a design adds up its own from `Works`.

What is not linear in the curves is bounded, by its largest value over an interval of crank ratios:
how far a curve rises above its chord between two coarse nodes, for example. The interval, and how
many terms are added up, follow from the crank ratio of a design alone, so its numbers cannot depend
on what else is in the sweep.
"""

from __future__ import annotations

import itertools
import math
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, NamedTuple
from weakref import WeakKeyDictionary

import numpy as np

from engine_dyn.compilation import (
    inlined,
    kernel,
)
from engine_dyn.geometry.cylinders import Member
from engine_dyn.geometry.velocity_harmonics import (
    FEW_TERMS,
    LARGEST_RATIO,
    MANY_TERMS,
    OFFSET_TERMS,
    centred_ratio_at,
    curves_at,
    orders_of,
    samples_of,
)
from engine_dyn.loads.friction import FRICTIONLESS
from engine_dyn.pressure.family import Family
from engine_dyn.speed.arguments import AngleLoad
from engine_dyn.speed.batch.two_grid import (
    CHUNK,
    HIGHEST_SLOPE,
    HIGHEST_SLOPE_V,
    P_ABOVE,
    P_BELOW,
    RIPPLE,
    TILT,
    TwoGrid,
    aliased_beyond,
    fill_two_grid,
    integral_of_quartic,
    make_two_grid,
)
from engine_dyn.speed.pieces import run_pieces
from engine_dyn.speed.tables import work_tables
from engine_dyn.speed.tables.load_over_angle import PLAIN_ROWS, join_load, keep_gas
from engine_dyn.speed.tables.pressure_grid import HALVES_POINTS, Grid, make_grid, steps_of
from engine_dyn.speed.tables.work_tables import (
    GAS_TORQUE,
    GAS_WORK,
    GAS_WORK_MIDDLE,
    SHAPE,
    SQUARE,
    TABLE_ROWS,
    TORQUE,
    Blend,
    bounds_of,
    mean_of_half,
    take_cubic,
)
from engine_dyn.types import Booleans, Floats, Integers

__all__ = [
    "ABOVE",
    "BELOW",
    "BEYOND",
    "BOUNDS_BEFORE_ROWS",
    "CENTRED_INTERVALS",
    "FEW_INTERVALS",
    "FEW_TERMS",
    "FIRST_SQUARE",
    "INTERVAL_COUNT",
    "LEAST",
    "LOAD",
    "MANY_TERMS",
    "OFFSET_TERMS",
    "OF_LOAD",
    "RIPPLES",
    "SQUARE_WORKS",
    "STEEPEST",
    "TILTS",
    "TORQUE_RANGE",
    "UNIT",
    "WORKS_BEFORE_ROWS",
    "WORST",
    "Curves",
    "Works",
    "curves_of",
    "interval_at",
]

RATIOS = (0.0, 0.2, 0.36, LARGEST_RATIO[FEW_TERMS], 0.6, LARGEST_RATIO[MANY_TERMS])
"""Ends of the intervals of crank ratios over which bounds hold."""

OFFSETS = (0.05, 0.2, 0.5)
"""Largest offsets over the crank radius of intervals with an offset."""

CENTRED_INTERVALS = len(RATIOS) - 1
FEW_INTERVALS = RATIOS.index(LARGEST_RATIO[FEW_TERMS])
"""Intervals that FEW_TERMS suffice for."""

INTERVAL_COUNT = CENTRED_INTERVALS + len(OFFSETS) * FEW_INTERVALS
"""Intervals without an offset, then those of the first FEW_INTERVALS for each of OFFSETS."""

BEYOND = -1
"""Interval of a crank ratio, or an offset, for which no number of terms is provided."""

BOUND = 1.05
"""Factor on bounds that were taken at the ends and in the middle of an interval only."""

NUMBERS = 4
TORQUE_RANGE, STEEPEST, LEAST, WORST = range(NUMBERS)
"""Bounds of a curve: range of its torque, its steepest slope, its least value, and the largest
fraction of it that the coarse nodes see wrongly."""

ABOVE, BELOW, RIPPLES, TILTS = range(4)
"""Bounds of a chunk of coarse nodes, see `two_grid`."""

UNIT, FIRST_SQUARE, SQUARE_WORKS, LOAD = 0, 1, 2, 3
WORKS_BEFORE_ROWS = 4
"""Places in `Works`: the work of a pressure of 1; twice as many terms of the squared velocity, in
two places; the work of a load over angle, as the first of the terms; behind them the diagrams."""

OF_LOAD = 2
BOUNDS_BEFORE_ROWS = 3
"""Places in the bounds: of a pressure of 1, of the squared velocity and of a load over angle."""

ROUNDED = 1e-20
"""Mean square of the work of a pressure of 1, and of V, below which they are rounding."""

SAME, TINY = 1e-11, 1e-14
"""Relative and absolute difference of works that differ by rounding only."""

ROWS_AT_ONCE = 64
"""Diagrams whose pressures are tabulated at a time."""

LARGEST_BYTES, KEPT_BYTES = 48_000_000, 128_000_000
"""Works of one arrangement, and those of all arrangements of a family that are kept."""


class Works(NamedTuple):
    """Works against harmonics, as kernels take them.

    Attributes
    ----------
    fine : ndarray, shape (place, fine node, 4 terms)
        Value of every term, then slopes, antiderivatives and middles, as the fine grid of
        `two_grid`.
    coarse : ndarray, shape (place, coarse node, 2, term)
        Value, and integral over the interval behind the node.
    alias : ndarray, shape (place, term)
        Mean over the fine less that over the coarse nodes.
    chunk : ndarray, shape (interval, bound, chunk, 4)
        ABOVE, BELOW, RIPPLES and TILTS of a chunk of coarse nodes.
    numbers : ndarray, shape (interval, bound, NUMBERS)
        Bounds of the whole curve.
    sine, cosine, weights, square_weights : ndarray
        As of `velocity_harmonics.Samples`.
    image : ndarray of int, shape (2, coarse node)
        The first coarse node, and the first interval, where the work of a pressure of 1 and the
        squared velocity are the same, see `images_of`.
    """

    fine: Floats
    coarse: Floats
    alias: Floats
    chunk: Floats
    numbers: Floats
    sine: Floats
    cosine: Floats
    weights: Floats
    square_weights: Floats
    image: Integers


@inlined
def interval_at(ratio: float, offset: float) -> int:
    """Interval in which a crank ratio and an offset lie; BEYOND where none does."""
    if not 0.0 <= ratio <= RATIOS[CENTRED_INTERVALS]:
        return BEYOND
    number = 0
    for i in range(1, CENTRED_INTERVALS):
        number += 1 if ratio > RATIOS[i] else 0
    if offset == 0.0:
        return number
    size = abs(offset)
    # With the largest offset and ratio the centred ratio is positive.
    if size > OFFSETS[-1] or centred_ratio_at(ratio, offset) > RATIOS[FEW_INTERVALS]:
        return BEYOND
    for i in range(len(OFFSETS) - 1):
        number += FEW_INTERVALS if size > OFFSETS[i] else 0
    return CENTRED_INTERVALS + number


def limits_of(interval: int) -> tuple[float, float, float]:
    """Smallest and largest crank ratio, and the largest offset, of an interval."""
    if interval < CENTRED_INTERVALS:
        return RATIOS[interval], RATIOS[interval + 1], 0.0
    place, number = divmod(interval - CENTRED_INTERVALS, FEW_INTERVALS)
    return RATIOS[number], RATIOS[number + 1], OFFSETS[place]


@inlined
def store_term(
    place: int, term: int, width: float, ratio: int, value: Floats, slope: Floats, middle: Floats,
    works: Works,
) -> None:  # fmt: skip
    """Write one curve, and its antiderivative, to the fine and the coarse nodes of `works`.

    `value` and `slope` are those at the nodes, `middle` what a cubic through them misses in the
    middle of the interval behind: docs/method.md (52). The antiderivative integrates the cubics and
    their middles.
    """
    nodes = value.size
    fine, coarse = works.fine[place], works.coarse[place]
    terms = coarse.shape[2]
    slopes, integrals, middles = terms + term, 2 * terms + term, 3 * terms + term
    running = mean = mean_value = mean_coarse = 0.0
    for j in range(nodes):
        after = j + 1 if j + 1 < nodes else 0
        fine[ratio + j, term] = value[j]
        fine[ratio + j, slopes] = slope[j]
        fine[ratio + j, integrals] = running
        fine[ratio + j, middles] = middle[j]
        mean += running
        mean_value += value[j]
        mean_coarse += value[j] if j % ratio == 0 else 0.0
        running += integral_of_quartic(
            width, value[j], value[after], slope[j], slope[after], middle[j]
        )
    # What is left over a period is the mean of the curve between its nodes, near rounding.
    drift = running / nodes
    mean = mean / nodes - drift * 0.5 * (nodes - 1)
    for j in range(nodes):
        fine[ratio + j, integrals] -= mean + drift * j
    for pair in range(4):
        column = pair * terms + term
        for i in range(ratio):
            fine[i, column] = fine[nodes + i, column]
            fine[nodes + ratio + i, column] = fine[ratio + i, column]
    for n in range(nodes // ratio):
        here = ratio * (n + 1)
        coarse[n, 0, term] = fine[here, term]
        coarse[n, 1, term] = fine[here + ratio, integrals] - fine[here, integrals]
    works.alias[place, term] = (mean_value - ratio * mean_coarse) / nodes


@kernel
def build_diagrams(
    places: Integers, rows: Integers, width: float, ratio: int, sines: Floats,
    node_sines: Floats, grid: Grid, works: Works, terms: Floats,
) -> None:  # fmt: skip
    """Works of the diagrams `rows` of the grid against all terms, docs/method.md (112).

    `sines` is (term, quadrature point), `node_sines` (term, node): every term of the velocity
    there, for all cylinders as in `grid`. `terms` is scratch (5, node); a period has that many.
    """
    for i in range(places.size):
        build_diagram(
            places[i], rows[i], width, ratio, sines, node_sines, grid, works, terms
        )  # fmt: skip


@inlined
def build_diagram(
    place: int, row: int, width: float, ratio: int, sines: Floats, node_sines: Floats, grid: Grid,
    works: Works, terms: Floats,
) -> None:  # fmt: skip
    """Works of one diagram, arguments as of `build_diagrams`."""
    value, slope, middle, work, before = terms[0], terms[1], terms[2], terms[3], terms[4]
    nodes = value.size
    pressure, at_node = grid.at_quadrature[row], grid.at_node[row]
    for term in range(works.coarse.shape[3]):
        for j in range(nodes):
            slope[j] = 0.0
            work[j] = 0.0
            before[j] = 0.0
        steps = steps_of(grid)
        for member in range(grid.masses.size):
            count = HALVES_POINTS * steps
            mine = pressure[member * count : (member + 1) * count]
            sine = sines[term, member * count : (member + 1) * count]
            for step in range(0, steps, nodes):
                add_half(0.5 * width, mine, sine, step, before)
                add_half(0.5 * width, mine, sine, 3 * steps + step, work)
                here = member * steps + step
                one, other = at_node[here : here + nodes], node_sines[term, here : here + nodes]
                for j in range(nodes):
                    slope[j] += one[j] * other[j]
        total = 0.0
        for j in range(nodes):
            work[j] += before[j]
        for j in range(nodes):
            total += work[j]
        rate = total / (nodes * width)
        running = mean = 0.0
        for j in range(nodes):
            value[j] = running
            middle[j] = running + before[j] - 0.5 * rate * width
            mean += running
            running += work[j] - rate * width
            slope[j] -= rate
        mean /= nodes
        for j in range(nodes):
            value[j] -= mean
            middle[j] -= mean
        take_cubic(width, value, slope, middle, middle)
        store_term(place, term, width, ratio, value, slope, middle, works)


@inlined
def add_half(width: float, pressure: Floats, sine: Floats, first: int, works: Floats) -> None:
    """Add the integral of pressure times sine over halves of intervals, `width` wide each.

    docs/method.md (49). `first` is the place of the first quadrature point of the first interval;
    the other arguments are those of one cylinder.
    """
    nodes, steps = works.size, pressure.size // HALVES_POINTS
    second, third = first + steps, first + 2 * steps
    p0, p1 = pressure[first : first + nodes], pressure[second : second + nodes]
    p2 = pressure[third : third + nodes]
    s0, s1 = sine[first : first + nodes], sine[second : second + nodes]
    s2 = sine[third : third + nodes]
    for j in range(nodes):
        works[j] += width * mean_of_half(p0[j] * s0[j], p1[j] * s1[j], p2[j] * s2[j])


@kernel
def build_common(
    width: float, ratio: int, phases: Floats, masses: Floats, orders: Integers, cosines: Booleans,
    works: Works, terms: Floats,
) -> None:  # fmt: skip
    """Works of a pressure of 1, and the squared velocity, which have closed forms.

    `phases` and `masses` are those of all cylinders, `orders` and `cosines` those of the terms of
    the velocity, then of its square; `terms` is scratch as in `build_diagram`.
    """
    value, slope, middle = terms[0], terms[1], terms[2]
    nodes, count = value.size, works.coarse.shape[3]
    for number in range((1 + SQUARE_WORKS) * count):
        square = number >= count
        order = float(orders[number])
        # The work of a sine is a cosine over minus its order, that of a cosine a sine over it.
        sine = cosines[number] != square
        for j in range(nodes):
            value[j] = 0.0
            slope[j] = 0.0
            middle[j] = 0.0
        for member in range(phases.size):
            factor = masses[member] if square else (1.0 if sine else -1.0) / order
            behind = 0.5 * math.pi if sine else 0.0  # sin(x) = cos(x - pi/2)
            for j in range(nodes):
                angle = order * (j * width + phases[member]) - behind
                value[j] += factor * math.cos(angle)
                slope[j] -= factor * order * math.sin(angle)
                middle[j] += factor * math.cos(angle + 0.5 * order * width)
        mean = 0.0
        for j in range(nodes):
            mean += value[j]
        mean /= nodes
        for j in range(nodes):
            value[j] -= mean
            middle[j] -= mean
        take_cubic(width, value, slope, middle, middle)
        place = FIRST_SQUARE + (number - count) // count if square else UNIT
        store_term(place, number % count, width, ratio, value, slope, middle, works)


@kernel
def build_bounds(
    interval: int,
    bounds: Integers,
    rows: Integers,
    limits: Floats,
    width: float,
    ratio: int,
    grid: Grid,
    works: Works,
    table: Floats,
    middles: Floats,
    rates: Floats,
    two_grid: TwoGrid,
) -> None:
    """Bounds of the diagrams `rows`, in the places `bounds`, for an interval with these `limits`.

    With row -1, those of a pressure of 1 and of the squared velocity. From tables at the smallest
    and the largest crank ratio and in the middle, with the largest offset of either sign and
    without; the other arrays are scratch.
    """
    for i in range(rows.size):
        build_bound(
            interval, bounds[i], rows[i], limits, width, ratio, grid, works, table, middles, rates,
            two_grid,
        )  # fmt: skip


@inlined
def build_bound(
    interval: int, bound: int, row: int, limits: Floats, width: float, ratio: int, grid: Grid,
    works: Works, table: Floats, middles: Floats, rates: Floats, two_grid: TwoGrid,
) -> None:  # fmt: skip
    """Bounds of one diagram, arguments as of `build_bounds`."""
    unit = row < 0
    # A crankcase at -1 under no pressure: what is left is a pressure of 1.
    scale, crankcase = (0.0, -1.0) if unit else (1.0, 0.0)
    blend = Blend(max(row, 0), max(row, 0), 0.0, scale, crankcase, FRICTIONLESS)
    for quantity in range(2 if unit else 1):
        clear_bound(interval, bound + quantity, works)
    tables = 3 if limits[2] == 0.0 else 9
    for i in range(tables):
        at = limits[0] + 0.5 * (i % 3) * (limits[1] - limits[0])
        offset = limits[2] * (i // 3 - 1.0) if tables > 3 else 0.0
        work_tables.build(at, offset, blend, width, grid, table, middles, rates)
        fill_two_grid(table, width, ratio, two_grid)
        for quantity in range(2 if unit else 1):
            widen_bound(interval, bound + quantity, quantity, table, two_grid, works)


@inlined
def clear_bound(interval: int, bound: int, works: Works) -> None:
    """Bounds of nothing."""
    numbers, chunk = works.numbers[interval, bound], works.chunk[interval, bound]
    for field in range(NUMBERS):
        numbers[field] = math.inf if field == LEAST else 0.0
    for group in range(chunk.shape[0]):
        for kind in range(4):
            chunk[group, kind] = 0.0


@inlined
def widen_bound(
    interval: int, bound: int, quantity: int, table: Floats, two_grid: TwoGrid, works: Works
) -> None:
    """Widen a bound by one table and its grids: for P (quantity 0) or V (1)."""
    numbers, chunk = works.numbers[interval, bound], works.chunk[interval, bound]
    for group in range(chunk.shape[0]):
        of = two_grid.chunk[group]
        chunk[group, ABOVE] = max(chunk[group, ABOVE], BOUND * of[P_ABOVE + 2 * quantity])
        chunk[group, BELOW] = max(chunk[group, BELOW], BOUND * of[P_BELOW + 2 * quantity])
        chunk[group, RIPPLES] = max(chunk[group, RIPPLES], BOUND * of[RIPPLE + quantity])
        chunk[group, TILTS] = max(chunk[group, TILTS], BOUND * of[TILT + quantity])
    low, high = bounds_of(table[SHAPE if quantity == 1 else TORQUE])
    slope = two_grid.constants[HIGHEST_SLOPE_V if quantity == 1 else HIGHEST_SLOPE]
    least = bounds_of(table[SQUARE])[0]
    numbers[TORQUE_RANGE] = max(numbers[TORQUE_RANGE], BOUND * (high - low))
    numbers[STEEPEST] = max(numbers[STEEPEST], BOUND * slope)
    # The work of a pressure of 1, and V, of many cylinders can vanish but for rounding.
    rounded = ROUNDED if bound < BOUNDS_BEFORE_ROWS else 0.0
    numbers[WORST] = max(numbers[WORST], aliased_beyond(rounded, two_grid.constants))
    numbers[LEAST] = min(numbers[LEAST], BOUND * least)


@kernel
def build_load(
    gear: float, phase: float, width: float, ratio: int, load: Floats, table: Floats,
    plain: Floats, two_grid: TwoGrid, works: Works,
) -> None:  # fmt: skip
    """Work of a load over angle and its bounds, docs/method.md (35) and (36).

    Of a factor 1, and over a lever of 1 m3: a lane's weight has both. `load` is
    `TorqueOverAngle.table`, `gear` and `phase` those of its angle. `table` is empty, `plain` is
    scratch.
    """
    for row in range(table.shape[0]):
        for j in range(table.shape[1]):
            table[row, j] = 0.0
    keep_gas(table, plain)
    join_load(1.0, gear, phase, 1.0, width, load, plain, table)
    store_term(
        LOAD, 0, width, ratio, table[GAS_WORK], table[GAS_TORQUE], table[GAS_WORK_MIDDLE], works
    )
    fill_two_grid(table, width, ratio, two_grid)
    for interval in range(works.numbers.shape[0]):
        clear_bound(interval, OF_LOAD, works)
        widen_bound(interval, OF_LOAD, 0, table, two_grid, works)


def images_of(coarse: Floats) -> Integers:
    """First coarse nodes and intervals at which all curves of `coarse` are the same as at each.

    Where cylinders fire evenly, the curves are even about a dead centre; those of one cylinder
    repeat twice in a cycle of four strokes. So half of them, or three quarters, need no sum.
    """
    nodes = coarse.shape[1]
    curves = np.moveaxis(coarse, 1, 0).reshape(nodes, coarse.shape[0], 2, -1)
    scale = np.abs(curves).max(axis=0)
    here = np.arange(nodes)
    image = np.stack([here, here])

    def alike(other: Integers, kind: int) -> bool:
        apart = np.abs(curves[:, :, kind] - curves[other][:, :, kind])
        return bool((apart <= SAME * scale[:, kind] + TINY).all())

    after = (here + nodes // 2) % nodes
    if nodes % 2 == 0 and alike(after, 0) and alike(after, 1):
        image = np.minimum(image, image % (nodes // 2))
    mirrored = np.stack([-here % nodes, nodes - 1 - here])
    if alike(mirrored[0], 0) and alike(mirrored[1], 1):
        image = np.minimum(image, np.take_along_axis(image, mirrored, axis=1))
    return image


class Curves:
    """Works of a family's diagrams for one arrangement of cylinders, built as they are needed.

    Works do not depend on the scene: they are kept from one block of designs to the next. One
    thread at a time may ask for them.

    Parameters
    ----------
    family : Family
        Indicator diagrams.
    members : tuple of Member
        Representative cylinders, whose crank radii are equal.
    steps, nodes : int
        Nodes of a cycle and of a period.
    width : float
        Angle between two nodes [rad].
    refinement : int
        Nodes of a coarse interval.
    terms : int
        Terms of the velocity that are added up.
    load : AngleLoad, optional
        Load over angle, common to all designs.
    most : int
        Diagrams that are kept at a time.
    """

    def __init__(
        self, family: Family, members: tuple[Member, ...], steps: int, nodes: int, width: float,
        refinement: int, terms: int, load: AngleLoad | None, most: int,
    ) -> None:  # fmt: skip
        self.members, self.steps, self.refinement = members, steps, refinement
        self.width, self.most = width, most
        coarse = nodes // refinement
        intervals = INTERVAL_COUNT
        places = WORKS_BEFORE_ROWS + most
        bounds = BOUNDS_BEFORE_ROWS + most
        # Memory that is not written to is not taken from the system.
        self.works = Works(
            np.empty((places, nodes + 2 * refinement, 4 * terms)),
            np.empty((places, coarse, 2, terms)),
            np.empty((places, terms)),
            np.empty((intervals, bounds, coarse // CHUNK, 4)),
            np.empty((intervals, bounds, NUMBERS)),
            *samples_of(terms),
            np.zeros((2, coarse), dtype=np.int64),
        )
        self.place_of = np.full(family.row_count + 1, -1, dtype=np.int64)
        self.bounded = np.zeros((intervals, bounds), dtype=np.bool_)
        # A representative stands for as many cylinders as there are periods in a cycle.
        turns = nodes * width * np.arange(steps // nodes)
        phases = np.add.outer([member.phase for member in members], turns).reshape(-1)
        masses = np.repeat([member.mass_factor for member in members], turns.size)
        orders, cosines = (
            np.concatenate(both)
            for both in zip(orders_of(terms, False), orders_of(terms, True), strict=True)
        )
        build_common(
            width, refinement, phases, masses, orders, cosines, self.works, np.empty((5, nodes))
        )
        self.works.image[:] = images_of(self.works.coarse[:LOAD])
        if load is not None:
            for array in self.works.fine, self.works.coarse, self.works.alias:
                array[LOAD] = 0.0
            build_load(
                load.gear_ratio, load.phase, width, refinement, load.table,
                np.empty((TABLE_ROWS, nodes)), np.empty((PLAIN_ROWS, nodes)),
                make_two_grid(nodes, refinement), self.works,
            )  # fmt: skip
        self._sines: tuple[Floats, Floats] | None = None

    def groups_of(self, keys: Integers, rows: int) -> list[tuple[int, int]]:
        """Cut sorted keys, interval * rows + row, into groups whose works are kept at once."""
        if rows <= self.most:
            return [(0, keys.size)]
        # A key needs its own diagram and the next one.
        different = np.unique(keys)
        most = max(1, self.most // 2)
        starts = np.searchsorted(keys, different[::most])
        return list(itertools.pairwise([*starts.tolist(), keys.size]))

    def provide(self, family: Family, keys: Integers, rows: int, threads: int) -> None:
        """Build what is missing for designs of some keys.

        Parameters
        ----------
        family : Family
            That of the constructor, which is not kept here.
        keys : ndarray of int
            Interval * rows + row; the row is the lower one of the two between which the diagram of
            a design lies.
        rows : int
            Rows of the family.
        threads : int
            Threads at most.
        """
        after = np.minimum(keys % rows + 1, rows - 1)
        pairs = np.stack([np.tile(keys // rows, 2), np.concatenate([keys % rows, after])])
        needed = np.unique(pairs[1])
        missing = needed[self.place_of[needed] < 0]
        if np.count_nonzero(self.place_of >= 0) + missing.size > self.most:
            self.place_of[:] = -1
            self.bounded[:, BOUNDS_BEFORE_ROWS:] = False
            missing = needed
        places = WORKS_BEFORE_ROWS + np.count_nonzero(self.place_of >= 0) + np.arange(missing.size)
        self.place_of[missing] = places
        bounds = self.place_of[pairs[1]] - WORKS_BEFORE_ROWS + BOUNDS_BEFORE_ROWS
        unbounded = np.flatnonzero(~self.bounded[pairs[0], bounds])
        of_rows = np.union1d(missing, pairs[1, unbounded])
        for begin in range(0, of_rows.size, ROWS_AT_ONCE):
            some = of_rows[begin : begin + ROWS_AT_ONCE]
            grid = make_grid(family, some, self.steps, self.members)
            self._build(some, grid, np.isin(some, missing), pairs, threads)

    def _build(
        self, rows: Integers, grid: Grid, missing: Booleans, pairs: Integers, threads: int
    ) -> None:
        """Build the works of the `missing` ones of some rows, and the bounds of all."""
        sines = self._sines_of(grid)
        chosen = np.flatnonzero(missing)
        places = self.place_of[rows]

        def build_works(begin: int, end: int) -> None:
            some = chosen[begin:end]
            build_diagrams(
                places[some], some, self.width, self.refinement, *sines, grid, self.works,
                np.empty((5, self.nodes)),
            )  # fmt: skip

        run_pieces(chosen.size, build_works, threads, None, fewest=8)
        for interval in np.unique(pairs[0]).tolist():
            bounds = places - WORKS_BEFORE_ROWS + BOUNDS_BEFORE_ROWS
            wanted = np.isin(rows, pairs[1, pairs[0] == interval])
            wanted &= ~self.bounded[interval, bounds]
            of_rows, of_bounds = np.flatnonzero(wanted), bounds[wanted]
            if not self.bounded[interval, 0]:
                of_rows, of_bounds = np.append(of_rows, -1), np.append(of_bounds, 0)
            self.bounded[interval, of_bounds] = True
            self._bound(interval, of_rows, of_bounds, grid, threads)

    def _bound(
        self, interval: int, rows: Integers, bounds: Integers, grid: Grid, threads: int
    ) -> None:
        """Build the bounds of some rows of a grid over one interval."""
        limits = np.array(limits_of(interval))

        def build(begin: int, end: int) -> None:
            build_bounds(
                interval, bounds[begin:end], rows[begin:end], limits, self.width, self.refinement,
                grid, self.works, np.empty((TABLE_ROWS, self.nodes)), np.empty((4, self.nodes)),
                np.empty(6 * grid.node_sine.size), make_two_grid(self.nodes, self.refinement),
            )  # fmt: skip

        run_pieces(rows.size, build, threads, None, fewest=8)

    @property
    def size(self) -> int:
        """Bytes that are in use at most."""
        return int(self.works.fine.nbytes + self.works.coarse.nbytes)

    @property
    def nodes(self) -> int:
        """Nodes of a period."""
        return int(self.works.fine.shape[1]) - 2 * self.refinement

    def _sines_of(self, grid: Grid) -> tuple[Floats, Floats]:
        """Every term of the velocity at the quadrature points and nodes of all cylinders."""
        if self._sines is None:
            at_quadrature = np.arctan2(grid.quadrature_sine, grid.quadrature_cosine)
            at_node = np.arctan2(grid.node_sine, grid.node_cosine)
            orders = orders_of(self.works.coarse.shape[3], False)
            self._sines = curves_at(at_quadrature, *orders), curves_at(at_node, *orders)
        return self._sines


def bytes_of_row(nodes: int, refinement: int, terms: int) -> int:
    """Memory of the works of one diagram."""
    return 8 * terms * (4 * (nodes + 2 * refinement) + 2 * nodes // refinement)


_kept: WeakKeyDictionary[Family, dict[tuple[Any, ...], Curves]] = WeakKeyDictionary()
_lock = threading.Lock()


@contextmanager
def curves_of(
    family: Family, members: tuple[Member, ...], steps: int, nodes: int, width: float,
    refinement: int, terms: int, load: AngleLoad | None,
) -> Iterator[Curves]:  # fmt: skip
    """Curves of a family and an arrangement; parameters as of `Curves`.

    What another thread is using meanwhile is made anew for this one. Of all that are kept, those
    that were used last stay, up to KEPT_BYTES.
    """
    of_load = load and (load.table.tobytes(), load.gear_ratio, load.phase)
    key = (members, steps, nodes, refinement, terms, of_load)
    with _lock:
        curves = _kept.setdefault(family, {}).pop(key, None)
    if curves is None:
        most = max(4, LARGEST_BYTES // bytes_of_row(nodes, refinement, terms))
        most = min(most, family.row_count + 1)
        curves = Curves(family, members, steps, nodes, width, refinement, terms, load, most)
    yield curves
    with _lock:
        kept = _kept.setdefault(family, {})
        kept[key] = curves
        size = sum(one.size for one in kept.values())
        while size > KEPT_BYTES and len(kept) > 1:
            size -= kept.pop(next(iter(kept))).size
