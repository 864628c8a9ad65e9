"""Whether ripple of the torque can have misled the search for the extremes."""

from __future__ import annotations

from engine_dyn.compilation import formula, inlined
from engine_dyn.speed.batch.forms import ITERATED, VARIABLE_INERTIA, Form, Inertia
from engine_dyn.speed.batch.intervals import load_of
from engine_dyn.speed.batch.state import (
    ETA,
    GAS_FACTOR,
    LANES,
    MAX_RIPPLE,
    MIN_RIPPLE,
    NODE_MAX,
    NODE_MIN,
    PAD,
    Block,
)
from engine_dyn.speed.batch.two_grid import (
    CHUNK,
    P_MOMENT,
    RIPPLE,
    RIPPLE_V,
    V_MOMENT,
    P,
    TwoGrid,
    V,
)
from engine_dyn.speed.batch.values import SLOPES, pair_at, shared_value, value_at
from engine_dyn.types import Floats

__all__ = ["clear_ripple", "is_clear", "load_at", "pair_at"]


@formula
def load_at(
    node: int, r: float, turn: float, k: int, coarse: Floats, state: Floats, deviations: Floats
) -> tuple[float, float, float, float]:  # fmt: skip
    """`load_of` one node."""
    nodes = coarse.shape[0]
    here = node + nodes if node < 0 else (node - nodes if node >= nodes else node)
    p, v = (
        value_at(coarse, shared_value(coarse, here, P), here, P, k),
        value_at(coarse, shared_value(coarse, here, V), here, V, k),
    )
    moment = value_at(coarse, shared_value(coarse, here, P_MOMENT), here, P_MOMENT, k)
    turning = value_at(coarse, shared_value(coarse, here, V_MOMENT), here, V_MOMENT, k)
    return load_of(p, v, moment, turning, deviations[(node + PAD) * LANES + k], r, turn, k, state)


@inlined
def is_clear(
    form: Form, upward: float, inertia: Inertia, ratio: int, k: int, two_grid: TwoGrid,
    bounds: Floats, block: Block,
) -> bool:  # fmt: skip
    """Whether ripple cannot have misled `extrema.search_all`: asked of few lanes, one at a time.

    Wherever the extreme can be, between two coarse nodes, the slope has one zero at most, and if
    that is an extreme, one of the two nodes was taken for a candidate.
    """
    state, deviations, remainders = block.state, block.deviations, block.remainders
    coarse, chunk = two_grid.coarse, two_grid.chunk
    turn = state[ETA + k] if len(inertia) == VARIABLE_INERTIA else 0.0
    best = upward * state[(NODE_MAX if upward > 0.0 else NODE_MIN) + k]
    for group in range(chunk.shape[0]):
        bound = upward * bounds[group * LANES + k]
        of_p = value_at(chunk, shared_value(chunk, group, RIPPLE), group, RIPPLE, k)
        of_v = value_at(chunk, shared_value(chunk, group, RIPPLE_V), group, RIPPLE_V, k)
        if bound < best or max(of_p, of_v) == 0.0:
            continue
        row = (CHUNK * group + PAD) * LANES + k
        highest = upward * deviations[row]
        for i in range(1, CHUNK):
            highest = max(highest, upward * deviations[row + i * LANES])
        least = best - (bound - highest)
        for node in range(CHUNK * group - 1, CHUNK * (group + 1)):
            row = (node + PAD) * LANES + k
            before, left = upward * deviations[row - LANES], upward * deviations[row]
            right, behind = upward * deviations[row + LANES], upward * deviations[row + 2 * LANES]
            if max(left, right) < least:
                continue
            r0 = r2 = 0.0
            if len(form) >= ITERATED:
                r0, r2 = remainders[row], remainders[row + LANES]
            x0, y0, dy0, tau0 = load_at(node, r0, turn, k, coarse, state, deviations)
            x2, y2, dy2, tau2 = load_at(node + 1, r2, turn, k, coarse, state, deviations)
            u0, u2 = (x0 - y0) / tau0, (x2 - y2) / tau2
            falls = rises = 0
            ahead = 0.0
            for i in range(ratio + 1):
                t = i / ratio
                dp, dv = pair_at(
                    ratio * (node + 1) + i, SLOPES, k, two_grid.fine, two_grid.mix, state
                )
                slope = state[GAS_FACTOR + k] * dp - state[ETA + k] * dv - (dy0 + t * (dy2 - dy0))
                slope -= (u0 + t * (u2 - u0)) * turn * dv
                slope *= upward
                falls += 1 if ahead > 0.0 and slope <= 0.0 else 0
                rises += 1 if ahead < 0.0 and slope >= 0.0 else 0
                ahead = slope
            candidate = (left > before and left >= right) or (right > left and right >= behind)
            if falls + rises > 1 or (falls == 1 and not candidate):
                return False
    return True


@inlined
def clear_ripple(form: Form, inertia: Inertia, ratio: int, two_grid: TwoGrid, block: Block) -> None:
    """MAX_RIPPLE and MIN_RIPPLE become 0 where ripple cannot have misled the search."""
    state = block.state
    for k in range(LANES):
        if state[MAX_RIPPLE + k] > 0.0 and is_clear(
            form, 1.0, inertia, ratio, k, two_grid, block.maxima, block
        ):
            state[MAX_RIPPLE + k] = 0.0
        if state[MIN_RIPPLE + k] > 0.0 and is_clear(
            form, -1.0, inertia, ratio, k, two_grid, block.minima, block
        ):
            state[MIN_RIPPLE + k] = 0.0
