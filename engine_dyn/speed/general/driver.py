"""The general solver's driver: a kernel that solves any designs, one after the other.

For each design it takes the work table, reduces the inputs, finds the periodic solution and its
extremes, and writes the results.
"""

from __future__ import annotations

import math

from engine_dyn.compilation import inlined, kernel
from engine_dyn.loads.laws import Form, covers, gear_of
from engine_dyn.speed.arguments import Choice, Curves
from engine_dyn.speed.fields import (
    BORE,
    CRANK_RATIO,
    DOUBLE_RADIUS,
    GEAR_RATIO,
    LOAD_PHASE,
    LOAD_SCALE,
    OFFSET_RATIO,
    OUTPUT,
    PASSES,
    START_ANGLE,
)
from engine_dyn.speed.general.cycles import (
    Samples,
    outcome,
    run_euler,
    sample_shapes,
    start_speed,
)
from engine_dyn.speed.general.periodic import (
    fill_curve,
    holds,
    is_stiff,
    pulls_back,
    solve_one,
    take_curve,
)
from engine_dyn.speed.general.picard import repeat_cycles
from engine_dyn.speed.general.reduction import Design, reduce
from engine_dyn.speed.general.scratch import DTAU, DW, TAU, D, Scratch, W
from engine_dyn.speed.general.segments import spread
from engine_dyn.speed.general.speeds import speeds_of
from engine_dyn.speed.general.storage import store, store_curves
from engine_dyn.speed.methods import PICARD, THESIS
from engine_dyn.speed.product import Product, count_of, offsets_at
from engine_dyn.speed.results import Results
from engine_dyn.speed.tables import work_tables
from engine_dyn.speed.tables.load_over_angle import join_load, keep_gas
from engine_dyn.speed.tables.lookup import Ranges, blend_of, ranges_of
from engine_dyn.speed.tables.pressure_grid import Grid, steps_of
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

__all__ = ["run_picard", "solve_designs"]

ROUNDED = 1.0 + 1e-9
"""Factor by which rounding may place the mean speed outside the extremes."""


@inlined
def run_picard(
    design: Design, width: float, periods: int, choice: Choice, values: Floats, at: Integers,
    scratch: Scratch,
) -> tuple[int, bool, bool]:  # fmt: skip
    """Repeat cycles in the energy form; return how many, whether closed and whether stalled.

    Before the call, the records contain the periodic solution; afterwards, the last cycle.
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
    # Without a load torque that depends on the speed, every cycle closes, whatever its speed. The
    # closure then fixes the constant, and the records keep the periodic solution.
    free = passes == 0 and closed and (design.kappa == 0.0 or choice.kind == 0)
    if not stalled and not free:
        take_curve(design, curve, records)
    return cycles, closed, stalled


@kernel
def solve_designs(
    chosen: Integers,
    segments: int,
    product: Product,
    row_of: Integers,
    width: float,
    grid: Grid,
    samples: Samples,
    choice: Choice,
    form: Form,
    over_angle: Floats,
    curves: Curves,
    results: Results,
    scratch: Scratch,
) -> None:
    """Solve the designs `chosen`, ascending: those of one table follow each other.

    `row_of` maps rows of the family to rows of the grid, `width` is the angle between nodes,
    `segments` is SEGMENTS (see `segments.solve_linear`), `form` that of the law over speed.
    `over_angle` is the table of a load over angle (`TorqueOverAngle.table`), empty where there is
    none. The outcomes are those of docs/method.md section 13.3.

    This function is longer than others. Cut into steps, the compiler reassociates sums in another
    way, and the last bits of the angular acceleration and of the method `thesis` change.
    """
    values, table, at, shared = product.values, scratch.table, scratch.at, scratch.shared
    nodes = table.shape[1]
    periods = steps_of(grid) // nodes
    period = width * steps_of(grid)
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
                values[shared[CRANK_RATIO]], values[shared[OFFSET_RATIO]], blend, width, grid,
                table, scratch.middles, scratch.rates,
            )  # fmt: skip
            if loaded:
                keep_gas(table, scratch.plain)
            else:
                spread(table, scratch.records)
            ranges = ranges_of(table)
            if choice.method == THESIS:
                sample_shapes(
                    values[shared[CRANK_RATIO]], values[shared[OFFSET_RATIO]], blend, samples,
                    scratch.sampled,
                )  # fmt: skip
        offsets_at(index % designs, product.other_axes, product, shared, at)
        if loaded:
            lever = 0.125 * math.pi * values[at[BORE]] ** 2 * values[at[DOUBLE_RADIUS]]
            join_load(
                values[at[LOAD_SCALE]], values[at[GEAR_RATIO]], values[at[LOAD_PHASE]], lever,
                width, over_angle, scratch.plain, table,
            )  # fmt: skip
            spread(table, scratch.records)
            ranges = ranges_of(table)
        design, code = reduce(values, at, choice, form, table, ranges)
        solvable = code == CONVERGED
        high = low = mean = math.nan
        mu = 1.0
        error = 0.0
        cycles = 0
        curve_of, shown = design, table
        if solvable:
            code, cycles, mu = solve_one(design, width, choice, segments, scratch)
            if is_stiff(design, width, choice):
                curve_of = Design(1.0, design.eta, 0.0, design.law, design.nominal)
                shown = scratch.curve
            gear = gear_of(values[at[GEAR_RATIO]], form)
            if code == CONVERGED:
                high, low, mean, error = speeds_of(
                    curve_of, mu, width, choice, segments, shown, scratch
                )
                if not (low > 0.0):
                    code = STALLED
                elif not covers(gear * high, gear * low, form):
                    code = INVALID_INPUT
                elif not holds(design, choice.variable, table, scratch.records):
                    code = NO_STEADY_STATE
                elif not (low <= mean * ROUNDED and mean <= high * ROUNDED):
                    # The load is so strong that the nodes do not resolve the curve at all.
                    code = NOT_CONVERGED
                elif error > choice.tolerance:
                    code = TOLERANCE_NOT_MET
        if (code == STALLED or code == NOT_CONVERGED) and not pulls_back(design):
            code = NO_STEADY_STATE
        solvable = solvable and code != NO_STEADY_STATE and code != INVALID_INPUT
        if solvable and (choice.method == THESIS or choice.method == PICARD):
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
            # The error of the method, measured against the periodic solution.
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
