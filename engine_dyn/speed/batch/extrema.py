"""Extremes of the speed of a block of designs, between the nodes, and what they may miss."""

from __future__ import annotations

import math

from engine_dyn.compilation import (
    formula,
    inlined,
    wide_vectors,
)
from engine_dyn.speed.batch.candidates import next_candidate
from engine_dyn.speed.batch.forms import Form, Inertia
from engine_dyn.speed.batch.intervals import search_intervals
from engine_dyn.speed.batch.state import (
    BETA,
    ERROR,
    ETA,
    EXTREME,
    EXTREME_ERROR,
    LANES,
    LAW_BEND,
    MAX_COUNT,
    MAX_LAST_CHUNK,
    MAX_NODE,
    MAX_RIPPLE,
    MAX_SPEED,
    MAX_TILT,
    MEAN_SQUARE,
    MIN_COUNT,
    MIN_LAST_CHUNK,
    MIN_NODE,
    MIN_RIPPLE,
    MIN_SPEED,
    MIN_TILT,
    NODE_MAX,
    NODE_MIN,
    Block,
)
from engine_dyn.speed.batch.two_grid import ALIASED, TwoGrid
from engine_dyn.speed.batch.values import constant
from engine_dyn.speed.results import CANCELLED, ROUNDING
from engine_dyn.speed.tables.work_tables import QUINTIC
from engine_dyn.types import Floats

__all__ = ["extremes"]


@inlined
def search_all(
    form: Form, upward: float, inertia: Inertia, step: float, ratio: int, lanes: int,
    two_grid: TwoGrid, bounds: Floats, block: Block,
) -> None:  # fmt: skip
    """Largest (upward = 1) or smallest (-1) u of every lane, in EXTREME, and what it may miss.

    Lanes with several candidates take one after the other; the others repeat what they have.
    """
    wide_vectors()
    state, deviations, chosen = block.state, block.deviations, block.chosen
    first, last = (MAX_NODE, MAX_LAST_CHUNK) if upward > 0.0 else (MIN_NODE, MIN_LAST_CHUNK)
    extreme, many = (NODE_MAX, MAX_COUNT) if upward > 0.0 else (NODE_MIN, MIN_COUNT)
    firsts, counts = state[first : first + LANES], state[many : many + LANES]
    more = 0.0
    for k in range(lanes):
        state[EXTREME + k] = -1e300 * upward
        chosen[k] = int(firsts[k])
        more += 1.0 if counts[k] > 1.0 else 0.0
    search_intervals(form, upward, inertia, step, ratio, lanes, two_grid, block)
    while more > 0.0:
        more = 0.0
        for k in range(LANES):
            if counts[k] > 1.0:
                best = upward * state[extreme + k]
                node = next_candidate(
                    upward, chosen[k], int(state[last + k]), best, k, deviations, bounds
                )
                chosen[k] = max(node, 0)
                counts[k] -= 1.0
                more += 1.0 if counts[k] > 1.0 else 0.0
        search_intervals(form, upward, inertia, step, ratio, lanes, two_grid, block)


@formula
def products_missed(
    constants: Floats, period: float, span: float, timed: bool, k: int, state: Floats
) -> float:
    """Share of the mean speed that coarse nodes see wrongly, beyond what is known of it.

    docs/method.md (121). It counts in the mean of sqrt(1 + u), by the closure in u, and in the time
    of the cycle, with the mean square of u. Lanes with curves of their own know it of P and V only,
    and bound the square by that of half the range; with a shared table, of their products too, but
    not of those with what the load takes of u, nor of the fifth order.
    """
    missed = span * span
    if constants.ndim == 1:
        missed = (
            min(1.0, state[BETA + k] * period / math.pi + missed * span) * state[MEAN_SQUARE + k]
        )
    bent = 0.125 + 0.25 * abs(state[LAW_BEND + k]) + (0.375 if timed else 0.0)
    return bent * missed * constant(constants, ALIASED, k)


@inlined
def extremes(
    form: Form, inertia: Inertia, step: float, ratio: int, timed: bool, lanes: int,
    two_grid: TwoGrid, block: Block,
) -> None:  # fmt: skip
    """Largest and smallest speed over nominal, and in ERROR what they and the mean may miss."""
    wide_vectors()
    state = block.state
    period = step * two_grid.coarse.shape[0]
    for side in range(2):
        upward = 1.0 if side == 0 else -1.0
        bounds = block.maxima if side == 0 else block.minima
        place = MAX_SPEED if side == 0 else MIN_SPEED
        found = state[place : place + LANES]
        search_all(form, upward, inertia, step, ratio, lanes, two_grid, bounds, block)
        rippled, tilted = (MAX_RIPPLE, MAX_TILT) if side == 0 else (MIN_RIPPLE, MIN_TILT)
        ripple, tilt = state[rippled : rippled + LANES], state[tilted : tilted + LANES]
        for k in range(lanes):
            found[k] = math.sqrt(1.0 + state[EXTREME + k])
            missed = 0.5 * (state[EXTREME_ERROR + k] + ripple[k] + QUINTIC * tilt[k]) / found[k]
            state[ERROR + k] = missed if side == 0 else state[ERROR + k] + missed
    for k in range(lanes):
        span = state[MAX_SPEED + k] - state[MIN_SPEED + k]
        rounding = ROUNDING * (1.0 + CANCELLED * state[ETA + k])
        # A fluctuation below rounding is left to the general solver, which says what it is worth.
        state[ERROR + k] = (state[ERROR + k] + rounding) / span if span > 0.0 else math.inf
        state[ERROR + k] += products_missed(two_grid.constants, period, span, timed, k, state)
