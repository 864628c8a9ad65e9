"""Drivers of the batch solver: blocks of designs in lanes."""

from __future__ import annotations

import math

from engine_dyn.compilation import (
    formula,
    indices_on_stack,
    inlined,
    kernel,
    on_stack,
    rows_on_stack,
    wide_vectors,
)
from engine_dyn.speed.arguments import Choice
from engine_dyn.speed.batch import harmonics, hills, lanes, traces
from engine_dyn.speed.batch.levels import CHUNK, Levels, fill_levels
from engine_dyn.speed.batch.scratch import BlockScratch
from engine_dyn.speed.fields import (
    BORE,
    CRANK_RATIO,
    CRANKCASE_PRESSURE,
    MEAN_TORQUE,
    OFFSET_RATIO,
    OUTPUT,
    ROW,
    SCALE,
)
from engine_dyn.speed.methods import CYCLE_TIME
from engine_dyn.speed.product import (
    Product,
    count_of,
    offsets_at,
    other_offsets_at,
    value_at,
    varies,
    varying_offsets_at,
)
from engine_dyn.speed.results import (
    DELTA,
    DELTA_ERROR,
    DELTA_MIDRANGE,
    IDLE,
    ITERATIONS,
    LOAD_FACTOR,
    OMEGA_MAX,
    OMEGA_MEAN,
    OMEGA_MIN,
    SCALARS,
    Results,
)
from engine_dyn.speed.tables import work_tables
from engine_dyn.speed.tables.lookup import Ranges, blend_of, ranges_of
from engine_dyn.speed.tables.work_tables import Grid
from engine_dyn.status import CONVERGED, INVALID_INPUT, NO_STEADY_STATE
from engine_dyn.types import Floats, Integers

__all__ = [
    "CAREFUL",
    "LANES",
    "NUMBERS",
    "SCALAR_ROWS",
    "WHOLE",
    "hold_table",
    "is_left",
    "keys_of",
    "march_lanes",
    "solve_block",
    "solve_own",
    "store_block",
    "take_common",
    "take_designs",
    "write_traces",
]

CAREFUL = 0.2
"""Fraction of the tolerance up to which the error of a design may be estimated: what the coarse
nodes miss is judged by the last term taken, which can be small by chance, and an error that is
asked for counts the difference SAFETY times. Half of the tolerance was tried: with other exponents
than 0 and 2, one design in seventy then had an error above 1e-7."""

LANES, NUMBERS = lanes.LANES, lanes.NUMBERS
"""Constants to the compiler, which attributes of modules are not."""

WHOLE = -LANES
"""Mask that leaves a multiple of LANES, a power of two, as it is: a count of lanes it was put on is
known to be one, so that loops over lanes are vectors without a remainder."""

SCALAR_ROWS = SCALARS * lanes.LANES


@inlined
def take_common(product: Product, scratch: BlockScratch, s: Floats) -> int:
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
    index: int, count: int, designs: int, fields: int, product: Product, scratch: BlockScratch,
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
            other_offsets_at(line * size, scratch.varying[:fields], product, scratch.shared, at)
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
    timed = choice.closure == CYCLE_TIME
    for k in range(width_of_lanes):
        s[lanes.ENERGY_SCALE + k] = 1.0
        s[lanes.SCALE_MOVES + k] = 0.0
    for _ in range(lanes.MOST_SCALES):
        lanes.prepare(
            form, inertia, step, coarse, shape, least_square, IDLE, float(NO_STEADY_STATE), invalid,
            levels.constants, width_of_lanes, s,
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
        if not timed or not lanes.rescale(inertia, width_of_lanes, levels, s, us):
            break
    for k in range(width_of_lanes):
        s[lanes.CODE + k] = lanes.LEFT if s[lanes.SCALE_MOVES + k] != 0.0 else s[lanes.CODE + k]
    if hills.candidates(
        inertia, step, least_square, width_of_lanes, levels, s, us, tops, lows
    ):  # fmt: skip
        hills.clear_ripple(form, inertia, ratio, levels, s, us, rs, tops, lows)
    hills.extremes(
        form, inertia, step, ratio, timed, width_of_lanes, levels, s, us, rs, tops, lows, chosen
    )  # fmt: skip
    store_block(count, len(form) != 2, width_of_lanes, choice.tolerance, s, places, results)


@inlined
def is_left(k: int, places: Integers, results: Results, s: Floats) -> bool:
    """Whether a lane's design is left to `march`; noted where that is asked for."""
    leaves = s[lanes.CODE + k] == lanes.LEFT
    if results.deferred.size > 0:
        leaves = leaves or results.deferred[places[k]]
        results.deferred[places[k]] = leaves
    return leaves


@inlined
def hold_table(
    which: int, ratio: int, product: Product, row_of: Integers, width: float, grid: Grid,
    scratch: BlockScratch,
) -> None:  # fmt: skip
    """Make the table of place `which`, and its levels, unless they are there; `shared` tells it."""
    shared, table = scratch.shared, scratch.table
    offsets_at(which, product.table_axes, product, product.value_start, shared)
    if scratch.cached[0] == which:
        return
    work_tables.build(
        product.values[shared[CRANK_RATIO]], product.values[shared[OFFSET_RATIO]],
        blend_of(product.values, shared, row_of), table.shape[1], width, grid, table,
        scratch.middles, scratch.rates,
    )  # fmt: skip
    fill_levels(table, width, ratio, scratch.levels)
    scratch.cached[0] = which


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
    scratch: BlockScratch,
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
    scratch: BlockScratch,
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
            if scratch.cached[1] != which:
                traces.fill_points(
                    product.values[shared[CRANK_RATIO]], product.values[shared[OFFSET_RATIO]],
                    blend_of(product.values, shared, row_of), grid, scratch.table, levels.fine,
                    ratio, angles, points, scratch.rates,
                )  # fmt: skip
                scratch.cached[1] = which
        count = min(min(end, (which + 1) * designs) - index, lanes.LANES)
        traces.write_block(
            count, block, inertia, width * ratio, ratio, width_of_lanes,
            levels, angles, points, kept, ws, ds, results.omega, results.acceleration,
        )  # fmt: skip
        block += 1
        index += count


@kernel
def keys_of(begin: int, end: int, rows: int, product: Product, keys: Integers) -> None:
    """Interval of crank ratios and row of the designs begin .. end - 1: interval * rows + row.

    Negative for a crank ratio in no interval.
    """
    designs = count_of(product.other_axes, product)
    for index in range(begin, end):
        ratio = value_at(CRANK_RATIO, index // designs, product)
        row = int(math.floor(value_at(ROW, index // designs, product)))
        interval = harmonics.interval_at(ratio)
        keys[index - begin] = interval * rows + row if interval >= 0 else -1


@kernel
def solve_own(
    form: lanes.Form,
    inertia: lanes.Inertia,
    begin: int,
    order: Integers,
    keys: Integers,
    rows: int,
    place_of: Integers,
    last_row: int,
    width_of_lanes: int,
    ratio: int,
    width: float,
    product: Product,
    works: harmonics.Works,
    choice: Choice,
    results: Results,
    scratch: BlockScratch,
    levels: Levels,
    deferred: Integers,
) -> int:
    """Solve designs that have no table in common; return how many are deferred.

    `order` are places behind `begin` sorted by their `keys` (see `keys_of`), so that the designs of
    a block lie between the same two diagrams: `place_of` each row among the `works`. `levels` is
    memory of `harmonics.make_own`. Other arguments as `march_lanes`.
    """
    wide_vectors()
    width_of_lanes &= WHOLE
    values, at, shared, places = product.values, scratch.at, scratch.shared, scratch.places
    nodes = levels.coarse.shape[0] * ratio
    # Made here, so that the compiler knows that they do not overlap.
    s, chosen = on_stack(NUMBERS), indices_on_stack(LANES)
    ratios, before, behind = on_stack(LANES), on_stack(LANES), on_stack(LANES)
    crankcase = on_stack(LANES)
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
    # Inputs that no axis changes are read once: of thirty, few vary.
    offsets_at(0, product.table_axes, product, product.value_start, shared)
    offsets_at(0, product.other_axes, product, shared, at)
    varying, count = scratch.varying, 0
    for field in range(product.strides.shape[1]):
        if varies(field, product):
            varying[count] = field
            count += 1
        elif BORE <= field <= MEAN_TORQUE:
            row_of_field = (field - BORE) * lanes.LANES
            s[row_of_field : row_of_field + lanes.LANES] = values[at[field]]
    varying = varying[:count]
    leaving = 0
    place = 0
    while place < order.size:
        key = keys[order[place]]
        interval, row = key // rows, key % rows
        first, second = place_of[row], place_of[min(row + 1, last_row)]
        count = 1
        while (
            count < lanes.LANES and place + count < order.size and keys[order[place + count]] == key
        ):
            count += 1
        for k in range(lanes.LANES):
            index = begin + order[place + min(k, count - 1)]
            varying_offsets_at(index // designs, index % designs, varying, product, at)
            for i in range(varying.size):
                field = varying[i]
                if BORE <= field <= MEAN_TORQUE:
                    s[(field - BORE) * lanes.LANES + k] = values[at[field]]
            places[k] = at[OUTPUT]
            weight, scale = values[at[ROW]] - row, values[at[SCALE]]
            ratios[k] = values[at[CRANK_RATIO]]
            before[k] = scale * (1.0 - weight)
            behind[k] = scale * weight
            crankcase[k] = values[at[CRANKCASE_PRESSURE]]
            s[lanes.ROW_TABLE + k] = first
            s[lanes.NEXT_TABLE + k] = second
        harmonics.fill_block(
            form, width_of_lanes, interval, first, second, ratios, before, behind, crankcase,
            works, levels, s,
        )  # fmt: skip
        numbers = works.numbers[interval, 1]
        solve_block(
            form, inertia, count, width_of_lanes, ratio, width,
            numbers[harmonics.TORQUE_RANGE], numbers[harmonics.LEAST], lanes.LEFT, choice, results,
            places, levels, s, changes, us, rs, tops, lows, chosen,
        )  # fmt: skip
        for k in range(count):
            if is_left(k, places, results, s):
                deferred[leaving] = begin + order[place + k]
                leaving += 1
        place += count
    return leaving


@inlined
def store_block(
    count: int, loaded: bool, width_of_lanes: int, tolerance: float, s: Floats, places: Integers,
    results: Results,
) -> None:  # fmt: skip
    """Write the numbers of the first `count` lanes as `store` does, but of those that are left.

    A speed that falls to nothing, or an error beyond what is allowed, leaves a design too.
    """
    wide_vectors()
    rows = on_stack(SCALAR_ROWS)
    for k in range(width_of_lanes):
        code, error, nominal = s[lanes.CODE + k], s[lanes.ERROR + k], s[lanes.NOMINAL + k]
        scale = s[lanes.ENERGY_SCALE + k]
        nominal *= math.sqrt(scale)
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
        # 1/mu = scale^(-alpha/2), and 1 where the scale is.
        factor = lanes.exp_of(-s[lanes.HALF + k] * lanes.log_of(scale - 1.0)) if loaded else 1.0
        rows[LOAD_FACTOR * lanes.LANES + k] = (factor if scale != 1.0 else 1.0) + nothing
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
