"""The nonlinear remainder of the load, iterated."""

from __future__ import annotations

import math

from engine_dyn.compilation import formula, inlined, on_stack, wide_vectors
from engine_dyn.speed.batch.closures import mark_beyond_series
from engine_dyn.speed.batch.forms import (
    ANY_POWER,
    PROPORTIONAL,
    RATIONAL,
    SQUARE_ROOT,
    VARIABLE_INERTIA,
    Form,
    Inertia,
)
from engine_dyn.speed.batch.powers import (
    DEEPEST,
    HIGHEST,
    SERIES_ROWS,
    exp_of,
    fill_series,
    finite,
    inverses,
    log_of,
    power_remainder,
    power_slope,
    root_remainder,
    root_slope,
)
from engine_dyn.speed.batch.rational import (
    fill_rational,
    keeps_its_sense,
    rational_remainder,
    rational_slope,
    remainder_over_speed,
)
from engine_dyn.speed.batch.recurrence import repeat_ends, respond_to_work
from engine_dyn.speed.batch.state import (
    BEYOND_SERIES,
    BY_ROOTS,
    BY_SERIES,
    CHANGE,
    CLOSURE_ALIAS,
    CLOSURE_CONSTANT,
    CLOSURE_STEP,
    CODE,
    DECAY,
    DEFERRED,
    ETA,
    EULER_FAR,
    EULER_NEAR,
    FROZEN,
    ITERATION_COUNT,
    KAPPA,
    LANES,
    LAST_CHANGE,
    LAW_BEND,
    LAW_SLOPE,
    LAW_TWIST,
    MEAN_SQUARE,
    NODE_MAX,
    NODE_MIN,
    PAD,
    PERIOD_FACTOR,
    PREDICTED_SUM,
    REMAINDER_END,
    REMAINDER_START,
    REMAINDER_SUM,
    REMAINDER_WEIGHT,
    RUNNING,
    RUNNING_WEIGHT,
    SHIFT,
    SHIFT_CHANGE,
    SLOPE_DOUBT,
    Block,
)
from engine_dyn.speed.batch.two_grid import CHUNK, V
from engine_dyn.speed.batch.values import shared_value, value_at
from engine_dyn.types import Floats

__all__ = [
    "MOST_PASSES",
    "fill_exact_remainders",
    "fill_remainders",
    "iterate",
    "respond_to_remainders",
]

MOST_PASSES = 10


@formula
def remainder_slope(
    form: Form, u: float, slope: float, turning: float, k: int, series: Floats
) -> float:
    """Slope of the nonlinear remainder r over u."""
    if len(form) == SQUARE_ROOT:
        return root_slope(u, turning)
    if len(form) == PROPORTIONAL:
        return -turning
    if len(form) == RATIONAL:
        return rational_slope(u, slope, turning, k, series)
    return power_slope(u, slope, turning, k, series)


@formula
def remainder_of(form: Form, u: float, k: int, series: Floats) -> float:
    """F - 1 - a u."""
    if len(form) == SQUARE_ROOT:
        return root_remainder(u)
    if len(form) == PROPORTIONAL:
        return 0.0
    if len(form) == RATIONAL:
        return rational_remainder(u, k, series)
    return power_remainder(u, k, series)


@formula
def fill_remainders(
    first: bool, form: Form, inertia: Inertia, lanes: int, coarse: Floats, series: Floats,
    block: Block,
) -> None:  # fmt: skip
    """Nonlinear remainder r = F - 1 - a u tau at the coarse nodes, its change and its sum.

    `first` says whether there was none before: then all of it is change, and CHANGE becomes the
    most of two neighbouring nodes' mean. Later, frozen lanes change no more, and those beyond the
    series keep the change that `fill_exact_remainders` found. REMAINDER_END becomes the end of the
    recurrence that the change drives. Four nodes are written out: an inner loop over them would
    keep the lanes from being vectors.
    """
    state, deviations = block.state, block.deviations
    remainders, changes = block.remainders, block.changes
    for k in range(lanes):
        state[CHANGE + k] = 0.0
        state[REMAINDER_END + k] = 0.0
        state[REMAINDER_SUM + k] = 0.0
        state[BY_ROOTS + k] = state[BEYOND_SERIES + k] * (1.0 - state[FROZEN + k])
        state[BY_SERIES + k] = (1.0 - state[BEYOND_SERIES + k]) * (1.0 - state[FROZEN + k])
    for group in range(coarse.shape[0] // CHUNK):
        n = CHUNK * group
        row = (n + PAD) * LANES
        vw0, vw1 = shared_value(coarse, n, V), shared_value(coarse, n + 1, V)
        vw2, vw3 = shared_value(coarse, n + 2, V), shared_value(coarse, n + 3, V)
        for k in range(lanes):
            u0, u1 = deviations[row + k], deviations[row + LANES + k]
            u2, u3 = deviations[row + 2 * LANES + k], deviations[row + 3 * LANES + k]
            r0, r1 = remainder_of(form, u0, k, series), remainder_of(form, u1, k, series)
            r2, r3 = remainder_of(form, u2, k, series), remainder_of(form, u3, k, series)
            if len(inertia) == VARIABLE_INERTIA:
                e = state[LAW_SLOPE + k] * state[ETA + k]
                r0 -= u0 * e * value_at(coarse, vw0, n, V, k)
                r1 -= u1 * e * value_at(coarse, vw1, n + 1, V, k)
                r2 -= u2 * e * value_at(coarse, vw2, n + 2, V, k)
                r3 -= u3 * e * value_at(coarse, vw3, n + 3, V, k)
            if not first:
                # Not a choice: of two loads the compiler makes one from places of its own, a
                # gather.
                moves, keeps = state[BY_SERIES + k], state[BY_ROOTS + k]
                old0, old1 = remainders[row + k], remainders[row + LANES + k]
                old2, old3 = remainders[row + 2 * LANES + k], remainders[row + 3 * LANES + k]
                m0, m1 = moves * (r0 - old0), moves * (r1 - old1)
                m2, m3 = moves * (r2 - old2), moves * (r3 - old3)
                r0, r1, r2, r3 = old0 + m0, old1 + m1, old2 + m2, old3 + m3
                m0 += keeps * finite(changes[row + k])
                m1 += keeps * finite(changes[row + LANES + k])
                m2 += keeps * finite(changes[row + 2 * LANES + k])
                m3 += keeps * finite(changes[row + 3 * LANES + k])
                changes[row + k] = m0
                changes[row + LANES + k] = m1
                changes[row + 2 * LANES + k] = m2
                changes[row + 3 * LANES + k] = m3
            else:
                m0, m1, m2, m3 = r0, r1, r2, r3
            remainders[row + k] = r0
            remainders[row + LANES + k] = r1
            remainders[row + 2 * LANES + k] = r2
            remainders[row + 3 * LANES + k] = r3
            d = state[DECAY + k]
            state[REMAINDER_END + k] = (
                d * (d * (d * (d * state[REMAINDER_END + k] + m0) + m1) + m2) + m3
            )
            left, right = r0 + r1, r2 + r3
            state[REMAINDER_SUM + k] += left + right
            if first:
                # Nested as in `respond_to_work`.
                state[CHANGE + k] = max(max(state[CHANGE + k], 0.5 * abs(left)), 0.5 * abs(right))


@inlined
def fill_exact_remainders(
    first: bool, form: Form, inertia: Inertia, lanes: int, coarse: Floats, series: Floats,
    block: Block,
) -> None:  # fmt: skip
    """As `fill_remainders` by roots and powers, for the lanes in BEYOND_SERIES alone."""
    wide_vectors()
    state, deviations = block.state, block.deviations
    remainders, changes = block.remainders, block.changes
    for k in range(lanes):
        wide = state[BEYOND_SERIES + k] != 0.0
        state[CHANGE + k] = 0.0 if wide else state[CHANGE + k]
        state[REMAINDER_END + k] = 0.0 if wide else state[REMAINDER_END + k]
        state[REMAINDER_SUM + k] = 0.0 if wide else state[REMAINDER_SUM + k]
    for n in range(coarse.shape[0]):
        vw = shared_value(coarse, n, V)
        here = deviations[(n + PAD) * LANES : (n + PAD + 1) * LANES]
        known = remainders[(n + PAD) * LANES : (n + PAD + 1) * LANES]
        moved = changes[(n + PAD) * LANES : (n + PAD + 1) * LANES]
        for k in range(lanes):
            a, u, wide = state[LAW_SLOPE + k], here[k], state[BEYOND_SERIES + k] != 0.0
            turn = state[ETA + k] if len(inertia) == VARIABLE_INERTIA else 0.0
            if len(form) == SQUARE_ROOT:
                power = math.sqrt(1.0 + u)
            elif len(form) == PROPORTIONAL:
                power = 1.0 + u
            elif len(form) == RATIONAL:
                power = 1.0 + a * u + remainder_over_speed(math.sqrt(1.0 + u) - 1.0, k, series)
            else:
                power = exp_of(a * log_of(u))
            r = power - 1.0 - a * u * (1.0 + turn * value_at(coarse, vw, n, V, k))
            r = r if wide and state[FROZEN + k] == 0.0 else known[k]
            change = r - (0.0 if first else known[k])
            most = max(state[CHANGE + k], abs(change))
            state[CHANGE + k] = most if wide else state[CHANGE + k]
            state[REMAINDER_END + k] = (
                state[DECAY + k] * state[REMAINDER_END + k] + change
                if wide
                else state[REMAINDER_END + k]
            )
            state[REMAINDER_SUM + k] += r if wide else 0.0
            moved[k] = change
            known[k] = r


@formula
def respond_to_remainders(
    form: Form, inertia: Inertia, lanes: int, coarse: Floats, series: Floats, changes: Floats,
    block: Block,
) -> None:  # fmt: skip
    """Take off u at the coarse nodes what the `changes` of the remainder make of it.

    docs/method.md (100) and (101). That changes the remainder again, by what is taken to first
    order, from its slope half way, at every other node: PREDICTED_SUM and CHANGE are its sum and
    its largest value.
    """
    wide_vectors()
    state, deviations, maxima, minima = block.state, block.deviations, block.maxima, block.minima
    for k in range(lanes):
        state[RUNNING + k] = state[REMAINDER_START + k]
        state[NODE_MAX + k] = -1e300
        state[NODE_MIN + k] = 1e300
        state[CHANGE + k] = 0.0
        state[PREDICTED_SUM + k] = 0.0
    for group in range(coarse.shape[0] // CHUNK):
        n = CHUNK * group
        row, bound = (n + PAD) * LANES, group * LANES
        vw0, vw1 = shared_value(coarse, n, V), shared_value(coarse, n + 1, V)
        vw2, vw3 = shared_value(coarse, n + 2, V), shared_value(coarse, n + 3, V)
        for k in range(lanes):
            d, rho = state[DECAY + k], state[REMAINDER_WEIGHT + k]
            sigma, shift = state[RUNNING_WEIGHT + k], state[SHIFT_CHANGE + k]
            near, far, half = state[EULER_NEAR + k], state[EULER_FAR + k], state[LAW_SLOPE + k]
            ra, rb = changes[row - 2 * LANES + k], changes[row - LANES + k]
            r0, r1 = changes[row + k], changes[row + LANES + k]
            r2, r3 = changes[row + 2 * LANES + k], changes[row + 3 * LANES + k]
            r4, r5 = changes[row + 4 * LANES + k], changes[row + 5 * LANES + k]
            y = state[RUNNING + k]
            # Written out: as a function of its own it rounds otherwise.
            x0 = (sigma * y + (rho * r0 + shift)) - near * (r1 - rb) + far * (r2 - ra)
            y = d * y + r0
            x1 = (sigma * y + (rho * r1 + shift)) - near * (r2 - r0) + far * (r3 - rb)
            y = d * y + r1
            x2 = (sigma * y + (rho * r2 + shift)) - near * (r3 - r1) + far * (r4 - r0)
            y = d * y + r2
            x3 = (sigma * y + (rho * r3 + shift)) - near * (r4 - r2) + far * (r5 - r1)
            state[RUNNING + k] = d * y + r3
            e0 = e1 = e2 = e3 = 0.0
            if len(inertia) == VARIABLE_INERTIA:
                turn = state[ETA + k]
                e0, e1 = (
                    turn * value_at(coarse, vw0, n, V, k),
                    turn * value_at(coarse, vw1, n + 1, V, k),
                )
                e2, e3 = (
                    turn * value_at(coarse, vw2, n + 2, V, k),
                    turn * value_at(coarse, vw3, n + 3, V, k),
                )
                t0, t1, t2, t3 = inverses(1.0 + e0, 1.0 + e1, 1.0 + e2, 1.0 + e3)
                x0, x1, x2, x3 = x0 * t0, x1 * t1, x2 * t2, x3 * t3
            u0, u1 = deviations[row + k], deviations[row + LANES + k]
            u2, u3 = deviations[row + 2 * LANES + k], deviations[row + 3 * LANES + k]
            c0 = x0 * remainder_slope(form, u0 - 0.5 * x0, half, e0, k, series)
            c2 = x2 * remainder_slope(form, u2 - 0.5 * x2, half, e2, k, series)
            state[PREDICTED_SUM + k] -= c0 + c2
            # Nested as in `respond_to_work`.
            state[CHANGE + k] = max(max(state[CHANGE + k], abs(c0)), abs(c2))
            u0, u1, u2, u3 = u0 - x0, u1 - x1, u2 - x2, u3 - x3
            deviations[row + k] = u0
            deviations[row + LANES + k] = u1
            deviations[row + 2 * LANES + k] = u2
            deviations[row + 3 * LANES + k] = u3
            high = max(max(u0, u1), max(u2, u3))
            low = min(min(u0, u1), min(u2, u3))
            maxima[bound + k] = high
            minima[bound + k] = low
            state[NODE_MAX + k] = max(max(state[NODE_MAX + k], max(u0, u1)), max(u2, u3))
            state[NODE_MIN + k] = min(min(state[NODE_MIN + k], min(u0, u1)), min(u2, u3))
    for k in range(lanes):
        state[REMAINDER_SUM + k] += 2.0 * state[PREDICTED_SUM + k]


@formula
def step_of_closure(twist: float, mean_square: float, constant: float, used: float) -> float:
    """What u tau has to move by for the closure, docs/method.md (115).

    `constant` is what its mean should be by the remainder, `used` what that was found with.
    """
    slope = 1.0 + 0.5 * twist * mean_square
    return (constant - used) / slope


@inlined
def iterate(
    form: Form, inertia: Inertia, tolerance: float, period: float, lanes: int, coarse: Floats,
    block: Block,
) -> None:  # fmt: skip
    """Iterate the remainder until every lane is frozen or deferred.

    docs/method.md (100), (113) and (115). `tolerance` is for u, relative to its range; `period` is
    that of the nodes [rad]. The remainders that the block holds in the end are those that u was
    found with.
    """
    wide_vectors()
    state, deviations, remainders = block.state, block.deviations, block.remainders
    changes = block.changes
    nodes = coarse.shape[0]
    series = on_stack(SERIES_ROWS)
    if len(form) == ANY_POWER:
        fill_series(lanes, state, series)
    if len(form) == RATIONAL:
        fill_rational(lanes, state, series)
    for k in range(lanes):
        state[SHIFT + k] = -state[CLOSURE_CONSTANT + k]
        state[FROZEN + k] = 0.0 if state[CODE + k] == 0.0 else 1.0
    respond_to_work(form, inertia, lanes, coarse, block)
    fill_remainders(True, form, inertia, lanes, coarse, series, block)
    for turn in range(MOST_PASSES):
        if turn > 0:
            # The first time, all of the remainder is new.
            new = remainders if turn == 1 else changes
            respond_to_remainders(form, inertia, lanes, coarse, series, new, block)
        if mark_beyond_series(lanes, state):
            fill_exact_remainders(turn == 0, form, inertia, lanes, coarse, series, block)
        running = 0.0
        for k in range(lanes):
            frozen = state[FROZEN + k]
            a, kappa = state[LAW_SLOPE + k], state[KAPPA + k]
            mean = state[REMAINDER_SUM + k] / nodes
            constant = -mean / a - state[CLOSURE_ALIAS + k]
            moved = step_of_closure(
                state[LAW_TWIST + k], state[MEAN_SQUARE + k], constant, state[CLOSURE_CONSTANT + k]
            )
            most = max(state[NODE_MAX + k], -state[NODE_MIN + k])
            # What the next pass would change u by: the integral of a wave of one period.
            reach = kappa * period / (2.0 * math.pi)
            rate = state[CHANGE + k] / max(state[LAST_CHANGE + k], 1e-300)
            remaining = reach * state[CHANGE + k] / (1.0 - rate)
            # The closure's step is Newton's with a slope that is known up to the next moments.
            remaining += abs(moved) * (
                state[SLOPE_DOUBT + k] * (1.0 if len(inertia) == VARIABLE_INERTIA else most)
                + reach * most * (a * abs(state[LAW_BEND + k]) if len(form) == RATIONAL else 1.0)
            )
            bound = tolerance * (state[NODE_MAX + k] - state[NODE_MIN + k]) + 1e-15
            within = state[NODE_MIN + k] > DEEPEST and state[NODE_MAX + k] < HIGHEST
            if len(form) == RATIONAL:
                # A motor whose torque rises with the speed anywhere may have no stable speed.
                falls = keeps_its_sense(state[NODE_MIN + k], state[NODE_MAX + k], k, state)
                within = within and falls
            done = turn > 0 and remaining <= bound and rate < 0.5
            # A frozen lane keeps its u; what it knows of itself stays too.
            state[CLOSURE_STEP + k] = moved if frozen == 0.0 else state[CLOSURE_STEP + k]
            state[LAST_CHANGE + k] = state[CHANGE + k] if frozen == 0.0 else state[LAST_CHANGE + k]
            state[ITERATION_COUNT + k] = turn + 1.0 if frozen == 0.0 else state[ITERATION_COUNT + k]
            stays = frozen != 0.0 or done or not within
            state[CODE + k] = DEFERRED if frozen == 0.0 and not within else state[CODE + k]
            shift = state[SHIFT + k] if stays else state[CLOSURE_ALIAS + k]
            state[SHIFT_CHANGE + k] = shift - state[SHIFT + k]
            state[SHIFT + k] = shift
            state[CLOSURE_CONSTANT + k] = state[CLOSURE_CONSTANT + k] if stays else constant
            state[FROZEN + k] = 1.0 if stays else 0.0
            running += 0.0 if stays else 1.0
        if running == 0.0:
            break
        if turn > 0:
            fill_remainders(False, form, inertia, lanes, coarse, series, block)
            repeat_ends(nodes, lanes, changes)
        else:
            repeat_ends(nodes, lanes, remainders)
        for k in range(lanes):
            state[REMAINDER_START + k] = state[REMAINDER_END + k] * state[PERIOD_FACTOR + k]
    for k in range(lanes):
        state[CODE + k] = DEFERRED if state[FROZEN + k] == 0.0 else state[CODE + k]
    # The remainder too: that of a lane beyond the series is newer than what was repeated for its
    # neighbours.
    repeat_ends(nodes, lanes, remainders)
    repeat_ends(nodes, lanes, deviations)
