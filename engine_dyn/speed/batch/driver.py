"""Drivers of the batch solver: blocks of designs in lanes."""

from __future__ import annotations

import math

from engine_dyn.compilation import (
    indices_on_stack,
    inlined,
    kernel,
    on_stack,
    wide_vectors,
)
from engine_dyn.speed.arguments import Choice
from engine_dyn.speed.batch import own_curves, traces
from engine_dyn.speed.batch.angles import Angles, fill_points
from engine_dyn.speed.batch.block import solve_block
from engine_dyn.speed.batch.forms import Form, Inertia
from engine_dyn.speed.batch.inputs import take_common, take_designs, take_sorted, take_unvarying
from engine_dyn.speed.batch.scratch import BlockScratch
from engine_dyn.speed.batch.state import (
    DEFERRED,
    FIRST_DIAGRAM,
    GAS_TORQUE_RANGE,
    LANES,
    SECOND_DIAGRAM,
    STATE_SIZE,
    Block,
    with_state,
)
from engine_dyn.speed.batch.storage import note_deferred
from engine_dyn.speed.batch.two_grid import TwoGrid, fill_two_grid
from engine_dyn.speed.batch.work_harmonics import LEAST, TORQUE_RANGE, Works, interval_at
from engine_dyn.speed.fields import (
    CRANK_RATIO,
    INPUTS,
    OFFSET_RATIO,
    ROW,
)
from engine_dyn.speed.product import (
    Product,
    add_offsets,
    count_of,
    offsets_at,
    take_offsets,
)
from engine_dyn.speed.results import Results
from engine_dyn.speed.tables import work_tables
from engine_dyn.speed.tables.lookup import Ranges, blend_of, ranges_of
from engine_dyn.speed.tables.pressure_grid import Grid
from engine_dyn.status import INVALID_INPUT
from engine_dyn.types import Floats, Integers

__all__ = ["hold_table", "keys_of", "solve_by_harmonics", "solve_by_table", "write_traces"]

WHOLE = -LANES
"""Mask that leaves a multiple of LANES, a power of two, as it is: a count of lanes that it was put
on is known to be one, so that loops over lanes are vectors without a remainder. Designs that share
a table take 2 to 6 percent less time by it, sampled ones as long as without."""


@inlined
def hold_table(
    which: int, ratio: int, product: Product, row_of: Integers, width: float, grid: Grid,
    scratch: BlockScratch,
) -> None:  # fmt: skip
    """Make the table of place `which`, and its grids, unless they are there; `shared` tells it."""
    shared, table = scratch.shared, scratch.table
    offsets_at(which, product.table_axes, product, product.value_start, shared)
    if scratch.cached[0] == which:
        return
    work_tables.build(
        product.values[shared[CRANK_RATIO]], product.values[shared[OFFSET_RATIO]],
        blend_of(product.values, shared, row_of), width, grid, table, scratch.middles,
        scratch.rates,
    )  # fmt: skip
    fill_two_grid(table, width, ratio, scratch.two_grid)
    scratch.cached[0] = which


@kernel
def solve_by_table(
    form: Form,
    inertia: Inertia,
    begin: int,
    end: int,
    lanes: int,
    ratio: int,
    product: Product,
    row_of: Integers,
    width: float,
    grid: Grid,
    choice: Choice,
    results: Results,
    scratch: BlockScratch,
    memory: Block,
    deferred: Integers,
    kept: traces.Kept,
) -> int:
    """Solve the designs begin .. end - 1 by the tables that they share.

    Returns how many are deferred.

    `lanes` is LANES, as a number that the compiler does not know. Every `ratio`-th node is a coarse
    one. `deferred` gets the designs that are deferred, `kept` what `write_traces` needs unless it
    is empty. `memory` is that of `scratch.make_block`.
    """
    wide_vectors()
    lanes &= WHOLE
    table = scratch.table
    state = on_stack(STATE_SIZE)
    block = with_state(state, memory)
    two_grid, places = scratch.two_grid, scratch.places
    designs = count_of(product.other_axes, product)
    ranges = Ranges(0.0, 0.0, 0.0)
    current = -1
    count_deferred = number = fields = 0
    index = begin
    while index < end:
        which = index // designs
        if which != current:
            current = which
            hold_table(which, ratio, product, row_of, width, grid, scratch)
            ranges = ranges_of(table)
            fields = take_common(product, scratch, state)
            scratch.line[0] = -1
            for k in range(LANES):
                state[GAS_TORQUE_RANGE + k] = ranges.gas
        count = min(min(end, (which + 1) * designs) - index, LANES)
        take_designs(index, count, designs, fields, product, scratch, places, state)
        solve_block(
            form, inertia, count, lanes, ratio, width, ranges.shape, ranges.least_square,
            float(INVALID_INPUT), choice, results, places, two_grid, block,
        )  # fmt: skip
        for k in range(count):
            if note_deferred(k, places, results, state):
                deferred[count_deferred] = index + k
                count_deferred += 1
        if number < kept.targets.shape[0]:
            traces.keep(number, block, places, kept)
        number += 1
        index += count
    return count_deferred


@kernel
def write_traces(
    inertia: Inertia,
    begin: int,
    end: int,
    lanes: int,
    ratio: int,
    product: Product,
    row_of: Integers,
    width: float,
    grid: Grid,
    choice: Choice,
    results: Results,
    scratch: BlockScratch,
    angles: Angles,
    kept: traces.Kept,
    points: Floats,
    smooth: Floats,
    rises: Floats,
) -> None:
    """Write the curves of the designs begin .. end - 1, which `solve_by_table` has just solved.

    Arguments as there: it makes the same blocks of them. `points`, `smooth` and `rises` are
    scratch.
    """
    lanes &= WHOLE
    shared, two_grid = scratch.shared, scratch.two_grid
    designs = count_of(product.other_axes, product)
    current = -1
    number = 0
    index = begin
    while index < end:
        which = index // designs
        if which != current:
            current = which
            hold_table(which, ratio, product, row_of, width, grid, scratch)
            if scratch.cached[1] != which:
                fill_points(
                    product.values[shared[CRANK_RATIO]], product.values[shared[OFFSET_RATIO]],
                    blend_of(product.values, shared, row_of), grid, scratch.table, two_grid.fine,
                    ratio, angles, points, scratch.rates,
                )  # fmt: skip
                scratch.cached[1] = which
        count = min(min(end, (which + 1) * designs) - index, LANES)
        traces.write_block(
            count, number, inertia, width * ratio, ratio, lanes,
            two_grid, angles, points, kept, smooth, rises, results.omega, results.acceleration,
        )  # fmt: skip
        number += 1
        index += count


@kernel
def keys_of(begin: int, end: int, rows: int, product: Product, keys: Integers) -> None:
    """Interval and row of the designs begin .. end - 1: interval * rows + row.

    Negative for a crank ratio, or an offset, in no interval.
    """
    designs = count_of(product.other_axes, product)
    asked, at = indices_on_stack(3), indices_on_stack(INPUTS)
    asked[0], asked[1], asked[2] = CRANK_RATIO, ROW, OFFSET_RATIO
    for index in range(begin, end):
        take_offsets(asked, product.value_start, at)
        add_offsets(index // designs, product.table_axes, asked, product, at)
        ratio = product.values[at[CRANK_RATIO]]
        row = int(math.floor(product.values[at[ROW]]))
        interval = interval_at(ratio, product.values[at[OFFSET_RATIO]])
        keys[index - begin] = interval * rows + row if interval >= 0 else -1


@kernel
def solve_by_harmonics(
    form: Form,
    inertia: Inertia,
    begin: int,
    order: Integers,
    keys: Integers,
    rows: int,
    place_of: Integers,
    last_row: int,
    lanes: int,
    ratio: int,
    width: float,
    product: Product,
    works: Works,
    choice: Choice,
    results: Results,
    scratch: BlockScratch,
    memory: Block,
    two_grid: TwoGrid,
    deferred: Integers,
) -> int:
    """Solve designs that have no table in common, each with curves added up from harmonics.

    Returns how many are deferred.

    `order` are places behind `begin` sorted by their `keys` (see `keys_of`), so that the designs of
    a block lie between the same two diagrams: `place_of` each row among the `works`. `two_grid` is
    memory of `own_curves.make_own`. Other arguments as of `solve_by_table`.
    """
    wide_vectors()
    lanes &= WHOLE
    places = scratch.places
    ratios, offsets, loads = on_stack(LANES), on_stack(LANES), on_stack(LANES)
    before, behind, crankcase = on_stack(LANES), on_stack(LANES), on_stack(LANES)
    inputs = own_curves.Lanes(ratios, offsets, before, behind, crankcase, loads)
    loaded = own_curves.has_load(works.coarse.shape[3], two_grid.mix)
    for k in range(LANES):
        loads[k] = 0.0
    state = on_stack(STATE_SIZE)
    block = with_state(state, memory)
    designs = count_of(product.other_axes, product)
    fields = take_unvarying(product, scratch, state)
    count_deferred = 0
    place = 0
    while place < order.size:
        key = keys[order[place]]
        interval, row = key // rows, key % rows
        first, second = place_of[row], place_of[min(row + 1, last_row)]
        count = 1
        while count < LANES and place + count < order.size and keys[order[place + count]] == key:
            count += 1
        take_sorted(
            begin, order[place : place + count], designs, fields, row, loaded, product, scratch,
            state, inputs,
        )  # fmt: skip
        for k in range(LANES):
            state[FIRST_DIAGRAM + k] = first
            state[SECOND_DIAGRAM + k] = second
        own_curves.fill_block(
            form, lanes, interval, first, second, inputs, works, two_grid, state,
        )  # fmt: skip
        numbers = works.numbers[interval, 1]
        solve_block(
            form, inertia, count, lanes, ratio, width, numbers[TORQUE_RANGE], numbers[LEAST],
            DEFERRED, choice, results, places, two_grid, block,
        )  # fmt: skip
        for k in range(count):
            if note_deferred(k, places, results, state):
                deferred[count_deferred] = begin + order[place + k]
                count_deferred += 1
        place += count
    return count_deferred
