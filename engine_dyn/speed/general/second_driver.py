"""A kernel for the designs that the general solver leaves: it follows cycles in time.

Only where there are such designs is it compiled and called.
"""

from __future__ import annotations

import math

from engine_dyn.compilation import kernel
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
)
from engine_dyn.speed.general.cycles import outcome
from engine_dyn.speed.general.driver import ROUNDED, run_picard
from engine_dyn.speed.general.periodic import holds, pulls_back
from engine_dyn.speed.general.reduction import Design, reduce
from engine_dyn.speed.general.scratch import Scratch
from engine_dyn.speed.general.segments import spread
from engine_dyn.speed.general.speeds import speeds_of
from engine_dyn.speed.general.stable_cycle import stable_cycle
from engine_dyn.speed.general.storage import store, store_curves
from engine_dyn.speed.methods import PICARD
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

__all__ = ["solve_left_designs"]


# Longer than usual, as `driver.solve_designs`, whose arguments and order it has.
@kernel
def solve_left_designs(
    chosen: Integers,
    segments: int,
    product: Product,
    row_of: Integers,
    width: float,
    grid: Grid,
    choice: Choice,
    form: Form,
    over_angle: Floats,
    curves: Curves,
    results: Results,
    scratch: Scratch,
) -> None:
    """Solve the designs `chosen`, ascending, for which `driver.solve_designs` found no cycle.

    A design that has no stable cycle near or above the nominal speed gets the outcome that this
    says; one without torque to balance, or whose law repels the nominal speed, keeps its outcome.
    """
    values, table, at, shared = product.values, scratch.table, scratch.at, scratch.shared
    periods = steps_of(grid) // table.shape[1]
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
            work_tables.build(
                values[shared[CRANK_RATIO]], values[shared[OFFSET_RATIO]],
                blend_of(values, shared, row_of), width, grid, table, scratch.middles,
                scratch.rates,
            )  # fmt: skip
            if loaded:
                keep_gas(table, scratch.plain)
            else:
                spread(table, scratch.records)
            ranges = ranges_of(table)
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
        if code != CONVERGED or design.kappa == 0.0 or not pulls_back(design):
            continue
        high = low = mean = math.nan
        error = 0.0
        code, cycles, mu, missed = stable_cycle(design, choice, width, scratch)
        if results.status[at[OUTPUT]] == TOLERANCE_NOT_MET and code != CONVERGED:
            continue
        curve_of, shown = Design(1.0, design.eta, 0.0, design.law, design.nominal), scratch.curve
        if code == CONVERGED:
            high, low, mean, error = speeds_of(
                curve_of, mu, width, choice, segments, shown, scratch
            )
            gear = gear_of(values[at[GEAR_RATIO]], form)
            if high > low:
                below = (high - low) * low / (design.nominal * design.nominal)
                error += missed / below
            if not (low > 0.0):
                code = STALLED
            elif not covers(gear * high, gear * low, form):
                code = INVALID_INPUT
            elif not holds(design, choice.variable, table, scratch.records):
                code = NO_STEADY_STATE
            elif not (low <= mean * ROUNDED and mean <= high * ROUNDED):
                code = NOT_CONVERGED
            elif error > choice.tolerance:
                code = TOLERANCE_NOT_MET
        if choice.method == PICARD and (code == CONVERGED or code == TOLERANCE_NOT_MET):
            delta = (high - low) / mean
            mu = 1.0
            cycles, closed, stalled = run_picard(
                design, width, periods, choice, values, at, scratch
            )
            if not stalled:
                curve_of, shown = design, table
                high, low, mean, _ = speeds_of(
                    curve_of, mu, width, choice, segments, shown, scratch
                )
                stalled = not (low > 0.0)
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
