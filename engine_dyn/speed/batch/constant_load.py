"""Exponent 0: the speed without a load term."""

from __future__ import annotations

from engine_dyn.compilation import inlined, wide_vectors
from engine_dyn.speed.batch.closures import fill_exact_mean, mark_beyond_series
from engine_dyn.speed.batch.forms import VARIABLE_INERTIA, Inertia
from engine_dyn.speed.batch.powers import DEEPEST, HIGHEST, log_of, root_remainder
from engine_dyn.speed.batch.recurrence import repeat_ends
from engine_dyn.speed.batch.state import (
    CLOSURE_ALIAS,
    CLOSURE_CONSTANT,
    CLOSURE_STEP,
    CODE,
    DEFERRED,
    ETA,
    GAS_FACTOR,
    INVERSE_SUM,
    LANES,
    MEAN_SPEED,
    MEAN_SQUARE,
    NODE_MAX,
    NODE_MIN,
    PAD,
    Q_PRODUCT,
    SPEED_ALIAS,
    SPEED_SUM,
    Block,
)
from engine_dyn.speed.batch.two_grid import CHUNK, P, V
from engine_dyn.speed.batch.values import shared_value, value_at
from engine_dyn.types import Floats

__all__ = ["FREE_STEP", "solve_constant_load"]

FREE_STEP = 1e-3
"""Largest step of the closure that its first two derivatives give to rounding."""


@inlined
def solve_constant_load(inertia: Inertia, lanes: int, coarse: Floats, block: Block) -> None:
    """Exponent 0: u at the coarse nodes, and the mean speed, in one pass.

    No load term: u = X + c, or e/tau - 1 with variable inertia, with the constant c from the
    moments of the table. The mean of log q over the nodes, the logarithm of their product, is what
    these leave of the closure, docs/method.md (116); its first two derivatives give the step that
    is still to be made, CLOSURE_STEP. The first is the mean of 1/(q tau), summed four nodes over
    one denominator.
    """
    wide_vectors()
    state, deviations, maxima, minima = block.state, block.deviations, block.maxima, block.minima
    nodes = coarse.shape[0]
    for k in range(lanes):
        state[NODE_MAX + k] = -1e300
        state[NODE_MIN + k] = 1e300
        state[Q_PRODUCT + k] = 1.0
        state[INVERSE_SUM + k] = 0.0
        state[SPEED_SUM + k] = 0.0
        state[MEAN_SPEED + k] = 0.0
    for group in range(nodes // CHUNK):
        n = CHUNK * group
        pw0, pw1 = shared_value(coarse, n, P), shared_value(coarse, n + 1, P)
        pw2, pw3 = shared_value(coarse, n + 2, P), shared_value(coarse, n + 3, P)
        vw0, vw1 = shared_value(coarse, n, V), shared_value(coarse, n + 1, V)
        vw2, vw3 = shared_value(coarse, n + 2, V), shared_value(coarse, n + 3, V)
        row, bound = (n + PAD) * LANES, group * LANES
        for k in range(lanes):
            v0, v1 = value_at(coarse, vw0, n, V, k), value_at(coarse, vw1, n + 1, V, k)
            v2, v3 = value_at(coarse, vw2, n + 2, V, k), value_at(coarse, vw3, n + 3, V, k)
            gas, eta, level = state[GAS_FACTOR + k], state[ETA + k], state[CLOSURE_CONSTANT + k]
            u0 = level + gas * value_at(coarse, pw0, n, P, k) - eta * v0
            u1 = level + gas * value_at(coarse, pw1, n + 1, P, k) - eta * v1
            u2 = level + gas * value_at(coarse, pw2, n + 2, P, k) - eta * v2
            u3 = level + gas * value_at(coarse, pw3, n + 3, P, k) - eta * v3
            w0, w1, w2, w3 = 1.0 + u0, 1.0 + u1, 1.0 + u2, 1.0 + u3
            if len(inertia) == VARIABLE_INERTIA:
                t0, t1, t2, t3 = 1.0 + eta * v0, 1.0 + eta * v1, 1.0 + eta * v2, 1.0 + eta * v3
                # One division for four: the inverse of each is that of all times the other three.
                first, second = t0 * t1, t2 * t3
                inverse = 1.0 / (first * second)
                after, before = inverse * second, inverse * first
                w0, w1, w2, w3 = w0 + eta * v0, w1 + eta * v1, w2 + eta * v2, w3 + eta * v3
                u0, u1 = u0 * (after * t1), u1 * (after * t0)
                u2, u3 = u2 * (before * t3), u3 * (before * t2)
                state[Q_PRODUCT + k] *= inverse
            pair, other = w0 * w1, w2 * w3
            whole = pair * other
            state[Q_PRODUCT + k] *= whole
            share = 1.0 / whole
            state[INVERSE_SUM + k] += share * ((w0 + w1) * other + (w2 + w3) * pair)
            r0, r1, r2, r3 = (
                root_remainder(u0),
                root_remainder(u1),
                root_remainder(u2),
                root_remainder(u3),
            )
            r0, r1, r2, r3 = r0 + 0.5 * u0, r1 + 0.5 * u1, r2 + 0.5 * u2, r3 + 0.5 * u3
            state[MEAN_SPEED + k] += (r0 + r1) + (r2 + r3)
            left = (1.0 + r0) * w1 + (1.0 + r1) * w0
            right = (1.0 + r2) * w3 + (1.0 + r3) * w2
            state[SPEED_SUM + k] += share * (left * other + right * pair)
            deviations[row + k] = u0
            deviations[row + LANES + k] = u1
            deviations[row + 2 * LANES + k] = u2
            deviations[row + 3 * LANES + k] = u3
            high = max(max(u0, u1), max(u2, u3))
            low = min(min(u0, u1), min(u2, u3))
            maxima[bound + k] = high
            minima[bound + k] = low
            # Nested as in `respond_to_work`.
            state[NODE_MAX + k] = max(max(state[NODE_MAX + k], max(u0, u1)), max(u2, u3))
            state[NODE_MIN + k] = min(min(state[NODE_MIN + k], min(u0, u1)), min(u2, u3))
    repeat_ends(nodes, lanes, deviations)
    for k in range(lanes):
        mean = log_of(state[Q_PRODUCT + k] - 1.0) / nodes + state[CLOSURE_ALIAS + k]
        first = state[INVERSE_SUM + k] / nodes
        step = -mean / first
        # The second derivative is some 1 + mean(u^2) times the square of the first.
        bent = first * (1.0 + state[MEAN_SQUARE + k])
        moved = step + 0.5 * bent * step * step
        state[CLOSURE_STEP + k] = moved
        within = (
            state[NODE_MIN + k] > DEEPEST
            and state[NODE_MAX + k] < HIGHEST
            and abs(moved) < FREE_STEP
        )
        within = within and abs(state[Q_PRODUCT + k] - 1.0) < -DEEPEST
        state[CODE + k] = state[CODE + k] if within or state[CODE + k] != 0.0 else DEFERRED
        state[MEAN_SPEED + k] += 0.5 * moved * state[SPEED_SUM + k]
    if mark_beyond_series(lanes, state):
        fill_exact_mean(inertia, lanes, coarse, block)
    for k in range(lanes):
        state[MEAN_SPEED + k] = 1.0 + state[MEAN_SPEED + k] / nodes + state[SPEED_ALIAS + k]
