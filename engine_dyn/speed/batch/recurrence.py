"""The recurrence over the coarse nodes, driven by the work of gas and masses."""

from __future__ import annotations

from engine_dyn.compilation import formula, inlined, wide_vectors
from engine_dyn.speed.batch.closures import fill_exact_mean, mark_beyond_series
from engine_dyn.speed.batch.forms import (
    ITERATED,
    LINEAR,
    OF_CONSTANT_INERTIA,
    VARIABLE_INERTIA,
    Form,
    Inertia,
)
from engine_dyn.speed.batch.powers import DEEPEST, HIGHEST, inverses, root_remainder
from engine_dyn.speed.batch.state import (
    BETA,
    CODE,
    DECAY,
    DEFERRED,
    ETA,
    LANES,
    MEAN_SPEED,
    NODE_MAX,
    NODE_MIN,
    P_WEIGHT,
    P_WORK_WEIGHT,
    PAD,
    PERIOD_END,
    PERIOD_FACTOR,
    RUNNING,
    SHIFT,
    SPEED_ALIAS,
    V_WEIGHT,
    V_WORK_WEIGHT,
    Block,
)
from engine_dyn.speed.batch.two_grid import (
    CHUNK,
    LARGEST_STEP,
    MOST_IN_SERIES,
    SQUARES,
    SQUARES_SERIES,
    WORK,
    WORK_SERIES,
    P,
    V,
)
from engine_dyn.speed.batch.values import shared_value, value_at
from engine_dyn.types import Floats

__all__ = ["end_of_period", "repeat_ends", "respond_to_work", "solve_linear", "work_series"]


@formula
def work_series(t: float, first: int, constants: Floats) -> float:
    """Polynomial of SERIES_OF_WORK coefficients from constant `first` on."""
    total = constants[first + 15]
    total = constants[first + 14] + t * total
    total = constants[first + 13] + t * total
    total = constants[first + 12] + t * total
    total = constants[first + 11] + t * total
    total = constants[first + 10] + t * total
    total = constants[first + 9] + t * total
    total = constants[first + 8] + t * total
    total = constants[first + 7] + t * total
    total = constants[first + 6] + t * total
    total = constants[first + 5] + t * total
    total = constants[first + 4] + t * total
    total = constants[first + 3] + t * total
    total = constants[first + 2] + t * total
    total = constants[first + 1] + t * total
    total = constants[first + 0] + t * total
    return total


@inlined
def end_of_period(
    step: float, lanes: int, coarse: Floats, constants: Floats, state: Floats
) -> None:
    """End of the linear recurrence over one period from zero: only the work of X drives it.

    docs/method.md (106): by the table's polynomial in beta H, if it has one. (113) makes the
    periodic start of it.
    """
    wide_vectors()
    if constants.ndim == 1 and coarse.shape[0] <= MOST_IN_SERIES:
        for k in range(lanes):
            t = 2.0 / LARGEST_STEP * step * state[BETA + k] - 1.0
            work = work_series(t, WORK_SERIES, constants)
            squares = work_series(t, SQUARES_SERIES, constants)
            state[PERIOD_END + k] = (
                state[P_WORK_WEIGHT + k] * work - state[V_WORK_WEIGHT + k] * squares
            )
        return
    for group in range(coarse.shape[0] // CHUNK):
        n = CHUNK * group
        pw0, pw1 = shared_value(coarse, n, WORK), shared_value(coarse, n + 1, WORK)
        pw2, pw3 = shared_value(coarse, n + 2, WORK), shared_value(coarse, n + 3, WORK)
        vw0, vw1 = shared_value(coarse, n, SQUARES), shared_value(coarse, n + 1, SQUARES)
        vw2, vw3 = shared_value(coarse, n + 2, SQUARES), shared_value(coarse, n + 3, SQUARES)
        for k in range(lanes):
            p0 = value_at(coarse, pw0, n, WORK, k)
            p1 = value_at(coarse, pw1, n + 1, WORK, k)
            p2 = value_at(coarse, pw2, n + 2, WORK, k)
            p3 = value_at(coarse, pw3, n + 3, WORK, k)
            v0 = value_at(coarse, vw0, n, SQUARES, k)
            v1 = value_at(coarse, vw1, n + 1, SQUARES, k)
            v2 = value_at(coarse, vw2, n + 2, SQUARES, k)
            v3 = value_at(coarse, vw3, n + 3, SQUARES, k)
            d, g, e = state[DECAY + k], state[P_WORK_WEIGHT + k], state[V_WORK_WEIGHT + k]
            y = d * state[RUNNING + k] + (g * p0 - e * v0)
            y = d * y + (g * p1 - e * v1)
            y = d * y + (g * p2 - e * v2)
            state[RUNNING + k] = d * y + (g * p3 - e * v3)
    for k in range(lanes):
        state[PERIOD_END + k] = state[RUNNING + k]


@inlined
def repeat_ends(nodes: int, lanes: int, rows: Floats) -> None:
    """Repeat the last rows before the first and the first behind the last."""
    wide_vectors()
    for i in range(PAD):
        before, last = rows[i * LANES : (i + 1) * LANES], rows[(nodes + i) * LANES :]
        first, behind = rows[(PAD + i) * LANES :], rows[(nodes + PAD + i) * LANES :]
        for k in range(lanes):
            before[k] = last[k]
        for k in range(lanes):
            behind[k] = first[k]


@formula
def respond_to_work(
    form: Form, inertia: Inertia, lanes: int, coarse: Floats, block: Block
) -> None:  # fmt: skip
    """Deviations u at the coarse nodes by the linear recurrence, less SHIFT: docs/method.md (99).

    Of form LINEAR, which has no shift, that is all, and the mean speed is summed up on the way.
    Else it is all but what the nonlinear remainder adds, see `iteration`.
    """
    wide_vectors()
    state, deviations, maxima, minima = block.state, block.deviations, block.maxima, block.minima
    for k in range(lanes):
        state[RUNNING + k] = state[PERIOD_END + k] * state[PERIOD_FACTOR + k]
        state[MEAN_SPEED + k] = 0.0
        state[NODE_MAX + k] = -1e300
        state[NODE_MIN + k] = 1e300
    for group in range(coarse.shape[0] // CHUNK):
        n = CHUNK * group
        aw0, aw1 = shared_value(coarse, n, WORK), shared_value(coarse, n + 1, WORK)
        aw2, aw3 = shared_value(coarse, n + 2, WORK), shared_value(coarse, n + 3, WORK)
        bw0, bw1 = shared_value(coarse, n, SQUARES), shared_value(coarse, n + 1, SQUARES)
        bw2, bw3 = shared_value(coarse, n + 2, SQUARES), shared_value(coarse, n + 3, SQUARES)
        pw0, pw1 = shared_value(coarse, n, P), shared_value(coarse, n + 1, P)
        pw2, pw3 = shared_value(coarse, n + 2, P), shared_value(coarse, n + 3, P)
        vw0, vw1 = shared_value(coarse, n, V), shared_value(coarse, n + 1, V)
        vw2, vw3 = shared_value(coarse, n + 2, V), shared_value(coarse, n + 3, V)
        row, bound = (n + PAD) * LANES, group * LANES
        for k in range(lanes):
            a0 = value_at(coarse, aw0, n, WORK, k)
            a1 = value_at(coarse, aw1, n + 1, WORK, k)
            a2 = value_at(coarse, aw2, n + 2, WORK, k)
            a3 = value_at(coarse, aw3, n + 3, WORK, k)
            b0 = value_at(coarse, bw0, n, SQUARES, k)
            b1 = value_at(coarse, bw1, n + 1, SQUARES, k)
            b2 = value_at(coarse, bw2, n + 2, SQUARES, k)
            b3 = value_at(coarse, bw3, n + 3, SQUARES, k)
            p0 = value_at(coarse, pw0, n, P, k)
            p1 = value_at(coarse, pw1, n + 1, P, k)
            p2 = value_at(coarse, pw2, n + 2, P, k)
            p3 = value_at(coarse, pw3, n + 3, P, k)
            v0 = value_at(coarse, vw0, n, V, k)
            v1 = value_at(coarse, vw1, n + 1, V, k)
            v2 = value_at(coarse, vw2, n + 2, V, k)
            v3 = value_at(coarse, vw3, n + 3, V, k)
            d, g, e = state[DECAY + k], state[P_WORK_WEIGHT + k], state[V_WORK_WEIGHT + k]
            gas, eta = state[P_WEIGHT + k], state[V_WEIGHT + k]
            y, shift = state[RUNNING + k], state[SHIFT + k] if len(form) >= ITERATED else 0.0
            u0 = (gas * p0 - shift) - eta * v0 - y
            y = d * y + (g * a0 - e * b0)
            u1 = (gas * p1 - shift) - eta * v1 - y
            y = d * y + (g * a1 - e * b1)
            u2 = (gas * p2 - shift) - eta * v2 - y
            y = d * y + (g * a2 - e * b2)
            u3 = (gas * p3 - shift) - eta * v3 - y
            state[RUNNING + k] = d * y + (g * a3 - e * b3)
            if len(inertia) == VARIABLE_INERTIA:
                turn = state[ETA + k]
                t0, t1, t2, t3 = inverses(
                    1.0 + turn * v0, 1.0 + turn * v1, 1.0 + turn * v2, 1.0 + turn * v3
                )  # fmt: skip
                u0, u1, u2, u3 = u0 * t0, u1 * t1, u2 * t2, u3 * t3
            deviations[row + k] = u0
            deviations[row + LANES + k] = u1
            deviations[row + 2 * LANES + k] = u2
            deviations[row + 3 * LANES + k] = u3
            high = max(max(u0, u1), max(u2, u3))
            low = min(min(u0, u1), min(u2, u3))
            # Not the larger of what is stored and another: where one of two is in its place already
            # the compiler stores under a mask, and what loads it next has to wait.
            state[NODE_MAX + k] = max(max(state[NODE_MAX + k], max(u0, u1)), max(u2, u3))
            state[NODE_MIN + k] = min(min(state[NODE_MIN + k], min(u0, u1)), min(u2, u3))
            if len(form) == LINEAR:
                maxima[bound + k] = high
                minima[bound + k] = low
                roots = (root_remainder(u0) + root_remainder(u1)) + (
                    root_remainder(u2) + root_remainder(u3)
                )
                state[MEAN_SPEED + k] += roots
                state[MEAN_SPEED + k] += 0.5 * ((u0 + u1) + (u2 + u3))


@inlined
def solve_linear(form: Form, lanes: int, coarse: Floats, block: Block) -> None:
    """Exponent 2 with constant inertia: u at the coarse nodes, and the mean speed, in one pass."""
    wide_vectors()
    state, deviations = block.state, block.deviations
    nodes = coarse.shape[0]
    respond_to_work(form, OF_CONSTANT_INERTIA, lanes, coarse, block)
    repeat_ends(nodes, lanes, deviations)
    if mark_beyond_series(lanes, state):
        fill_exact_mean(OF_CONSTANT_INERTIA, lanes, coarse, block)
    for k in range(lanes):
        # The mean speed is where the coarse nodes see wrongly, and it is corrected by series.
        within = state[NODE_MIN + k] > DEEPEST and state[NODE_MAX + k] < HIGHEST
        state[CODE + k] = state[CODE + k] if within or state[CODE + k] != 0.0 else DEFERRED
        state[MEAN_SPEED + k] = 1.0 + state[MEAN_SPEED + k] / nodes + state[SPEED_ALIAS + k]
