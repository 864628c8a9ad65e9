"""A block of designs, solved."""

from __future__ import annotations

from engine_dyn.compilation import formula
from engine_dyn.speed.arguments import Choice
from engine_dyn.speed.batch.candidates import find_candidates
from engine_dyn.speed.batch.closures import MOST_SCALES, fill_mean_speed, next_energy_scale
from engine_dyn.speed.batch.constant_load import solve_constant_load
from engine_dyn.speed.batch.extrema import extremes
from engine_dyn.speed.batch.forms import CONSTANT_LOAD, LINEAR, Form, Inertia
from engine_dyn.speed.batch.iteration import iterate
from engine_dyn.speed.batch.recurrence import end_of_period, solve_linear
from engine_dyn.speed.batch.reduction import reduce_inputs
from engine_dyn.speed.batch.ripple import clear_ripple
from engine_dyn.speed.batch.state import CODE, DEFERRED, ENERGY_SCALE, SCALE_MOVES, Block
from engine_dyn.speed.batch.storage import store_block
from engine_dyn.speed.batch.two_grid import TwoGrid
from engine_dyn.speed.methods import CYCLE_TIME
from engine_dyn.speed.results import Results
from engine_dyn.types import Integers

__all__ = ["solve_block"]


@formula
def solve_block(
    form: Form, inertia: Inertia, count: int, lanes: int, ratio: int, width: float, shape: float,
    least_square: float, invalid: float, choice: Choice, results: Results, places: Integers,
    two_grid: TwoGrid, block: Block,
) -> None:  # fmt: skip
    """Solve the designs whose inputs and tables are in the lanes; write the first `count` of them.

    `lanes` is LANES, as a number that the compiler does not know, `shape` the range of the inertia
    torque of the table, `least_square` the least of its V, `invalid` the code of an inertia that is
    not positive. Those that are deferred to the general solver have CODE DEFERRED afterwards.
    """
    state = block.state
    coarse = two_grid.coarse.shape[0]
    step = width * ratio
    timed = choice.closure == CYCLE_TIME
    for k in range(lanes):
        state[ENERGY_SCALE + k] = 1.0
        state[SCALE_MOVES + k] = 0.0
    for _ in range(MOST_SCALES):
        reduce_inputs(
            form, inertia, choice.kind, step, coarse, shape, least_square, invalid,
            two_grid.constants, lanes, state,
        )  # fmt: skip
        if len(form) != CONSTANT_LOAD:  # exponent 0 has no load that its work would drive
            end_of_period(step, lanes, two_grid.coarse, two_grid.constants, state)
        if len(form) == LINEAR:
            solve_linear(form, lanes, two_grid.coarse, block)
        elif len(form) == CONSTANT_LOAD:
            solve_constant_load(inertia, lanes, two_grid.coarse, block)
        else:
            iterate(form, inertia, choice.iterated, coarse * step, lanes, two_grid.coarse, block)
            fill_mean_speed(form, inertia, lanes, two_grid, block)
        if not timed or not next_energy_scale(inertia, lanes, two_grid, block):
            break
    for k in range(lanes):
        state[CODE + k] = DEFERRED if state[SCALE_MOVES + k] != 0.0 else state[CODE + k]
    if find_candidates(inertia, step, least_square, lanes, two_grid, block):
        clear_ripple(form, inertia, ratio, two_grid, block)
    extremes(form, inertia, step, ratio, timed, lanes, two_grid, block)
    store_block(count, len(form) != CONSTANT_LOAD, lanes, choice.tolerance, state, places, results)
