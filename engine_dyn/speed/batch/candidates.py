"""At which coarse nodes the extremes of a block's designs can be."""

from __future__ import annotations

from engine_dyn.compilation import formula, inlined, on_stack, wide_vectors
from engine_dyn.speed.batch.forms import VARIABLE_INERTIA, Inertia
from engine_dyn.speed.batch.state import (
    BETA,
    CODE,
    DEFERRED,
    ETA,
    GAS_FACTOR,
    LANES,
    LARGEST_INVERSE,
    LOAD_RISE,
    MAX_COUNT,
    MAX_LAST_CHUNK,
    MAX_NODE,
    MAX_RIPPLE,
    MAX_TILT,
    MIN_COUNT,
    MIN_LAST_CHUNK,
    MIN_NODE,
    MIN_RIPPLE,
    MIN_TILT,
    NODE_MAX,
    NODE_MIN,
    PAD,
    Block,
)
from engine_dyn.speed.batch.two_grid import (
    CHUNK,
    HIGHEST_SLOPE,
    HIGHEST_SLOPE_V,
    P_ABOVE,
    P_BELOW,
    RIPPLE,
    RIPPLE_V,
    TILT,
    TILT_V,
    V_ABOVE,
    V_BELOW,
    TwoGrid,
)
from engine_dyn.speed.batch.values import constant, shared_value, value_at
from engine_dyn.types import Floats

__all__ = ["find_candidates", "next_candidate", "note_candidates"]

FIVE_ROWS, SIX_ROWS = 5 * LANES, 6 * LANES


@formula
def note_candidates(
    upward: float, group: int, extreme: int, lanes: int, chunk: Floats, bounds: Floats,
    block: Block, noted: Floats,
) -> None:  # fmt: skip
    """Note at which nodes of a chunk the extreme can be.

    `extreme` is the row of the extreme node, `bounds` are those of `find_candidates`. `noted` gets
    the first such node, the last chunk, how many nodes there are, and the ripple and the tilt of
    these chunks: a row of lanes each. No curve rises above a node by more than the chunk's bound
    above its highest node. Of equal neighbours the first counts.
    """
    state, deviations = block.state, block.deviations
    row, number = (CHUNK * group + PAD - 1) * LANES, float(CHUNK * group)
    here = deviations[row : row + SIX_ROWS]
    bounds = bounds[group * LANES : (group + 1) * LANES]
    extremes = state[extreme : extreme + LANES]
    ripple, ripple_v = shared_value(chunk, group, RIPPLE), shared_value(chunk, group, RIPPLE_V)
    tilt, tilt_v = shared_value(chunk, group, TILT), shared_value(chunk, group, TILT_V)
    for k in range(lanes):
        best, bound = upward * extremes[k], upward * bounds[k]
        u0, u1, u2 = upward * here[k], upward * here[LANES + k], upward * here[2 * LANES + k]
        u3, u4 = upward * here[3 * LANES + k], upward * here[4 * LANES + k]
        u5 = upward * here[5 * LANES + k]
        least = best - (bound - max(max(u1, u2), max(u3, u4))) if bound >= best else 1e300
        is1 = 1.0 if (u1 >= max(least, u2)) & (u1 > u0) else 0.0
        is2 = 1.0 if (u2 >= max(least, u3)) & (u2 > u1) else 0.0
        is3 = 1.0 if (u3 >= max(least, u4)) & (u3 > u2) else 0.0
        is4 = 1.0 if (u4 >= max(least, u5)) & (u4 > u3) else 0.0
        found = (is1 + is2) + (is3 + is4)
        node = number + (is2 if is1 + is2 > 0.0 else 3.0 - is3)
        noted[k] = node if (noted[k] < 0.0) & (found > 0.0) else noted[k]
        noted[LANES + k] = float(group) if bound >= best else noted[LANES + k]
        noted[2 * LANES + k] += found
        share = state[LARGEST_INVERSE + k] if bound >= best else 0.0
        g, eta = share * state[GAS_FACTOR + k], share * state[ETA + k]
        of_p, of_v = (
            value_at(chunk, ripple, group, RIPPLE, k),
            value_at(chunk, ripple_v, group, RIPPLE_V, k),
        )
        noted[3 * LANES + k] = max(noted[3 * LANES + k], g * of_p + eta * of_v)
        of_p, of_v = (
            value_at(chunk, tilt, group, TILT, k),
            value_at(chunk, tilt_v, group, TILT_V, k),
        )
        noted[4 * LANES + k] = max(noted[4 * LANES + k], g * of_p + eta * of_v)


@inlined
def find_candidates(
    inertia: Inertia, step: float, least_square: float, lanes: int, two_grid: TwoGrid, block: Block
) -> bool:  # fmt: skip
    """Where the extremes can be: the first node, the last chunk, the number of nodes.

    Between two nodes a curve exceeds the higher of them by no more than it rises above its chord,
    docs/method.md (117).
    The maxima and minima of the chunks become these bounds. Returns whether there is ripple for
    `ripple.clear_ripple`.
    """
    wide_vectors()
    state, maxima, minima = block.state, block.maxima, block.minima
    chunk, constants = two_grid.chunk, two_grid.constants
    above, below = on_stack(FIVE_ROWS), on_stack(FIVE_ROWS)
    for k in range(lanes):
        above[k] = below[k] = -1.0
        above[LANES + k] = below[LANES + k] = -1.0
        above[2 * LANES + k] = below[2 * LANES + k] = 0.0
        above[3 * LANES + k] = below[3 * LANES + k] = 0.0
        above[4 * LANES + k] = below[4 * LANES + k] = 0.0
        g, eta = state[GAS_FACTOR + k], state[ETA + k]
        steepest = g * constant(constants, HIGHEST_SLOPE, k)
        steepest += eta * constant(constants, HIGHEST_SLOPE_V, k)
        state[LOAD_RISE + k] = 0.125 * step * step * state[BETA + k] * steepest
        state[LARGEST_INVERSE + k] = 1.0
        if len(inertia) == VARIABLE_INERTIA:
            # q exceeds q* where e - q* tau does, which is linear in P and V.
            state[LARGEST_INVERSE + k] = 1.0 / (1.0 + eta * least_square)
    for group in range(chunk.shape[0]):
        pa, pb = shared_value(chunk, group, P_ABOVE), shared_value(chunk, group, P_BELOW)
        va, vb = shared_value(chunk, group, V_ABOVE), shared_value(chunk, group, V_BELOW)
        row = group * LANES
        high = deep = 0.0
        for k in range(lanes):
            p_above, p_below = (
                value_at(chunk, pa, group, P_ABOVE, k),
                value_at(chunk, pb, group, P_BELOW, k),
            )
            v_above, v_below = (
                value_at(chunk, va, group, V_ABOVE, k),
                value_at(chunk, vb, group, V_BELOW, k),
            )
            g, eta = state[GAS_FACTOR + k], state[ETA + k]
            if len(inertia) == VARIABLE_INERTIA:
                eta *= 1.0 + state[NODE_MAX + k]
            top = maxima[row + k] + state[LARGEST_INVERSE + k] * (
                g * p_above + eta * v_below + state[LOAD_RISE + k]
            )
            low = minima[row + k] - state[LARGEST_INVERSE + k] * (
                g * p_below + eta * v_above + state[LOAD_RISE + k]
            )
            maxima[row + k] = top
            minima[row + k] = low
            high += 1.0 if top >= state[NODE_MAX + k] else 0.0
            deep += 1.0 if low <= state[NODE_MIN + k] else 0.0
        if high > 0.0:
            note_candidates(1.0, group, NODE_MAX, lanes, chunk, maxima, block, above)
        if deep > 0.0:
            note_candidates(-1.0, group, NODE_MIN, lanes, chunk, minima, block, below)
    rippled = 0.0
    for k in range(lanes):
        # Without a candidate the numbers are none.
        none = (state[CODE + k] == 0.0) & (min(above[k], below[k]) < 0.0)
        state[CODE + k] = DEFERRED if none else state[CODE + k]
        wanted = state[CODE + k] == 0.0
        state[MAX_NODE + k], state[MIN_NODE + k] = max(above[k], 0.0), max(below[k], 0.0)
        state[MAX_LAST_CHUNK + k], state[MIN_LAST_CHUNK + k] = above[LANES + k], below[LANES + k]
        state[MAX_RIPPLE + k] = above[3 * LANES + k] if wanted else 0.0
        state[MIN_RIPPLE + k] = below[3 * LANES + k] if wanted else 0.0
        state[MAX_TILT + k], state[MIN_TILT + k] = above[4 * LANES + k], below[4 * LANES + k]
        state[MAX_COUNT + k] = above[2 * LANES + k] if wanted else 0.0
        state[MIN_COUNT + k] = below[2 * LANES + k] if wanted else 0.0
        rippled += state[MAX_RIPPLE + k] + state[MIN_RIPPLE + k]
    return rippled > 0.0


@inlined
def next_candidate(
    upward: float, after: int, last: int, best: float, k: int, deviations: Floats, bounds: Floats
) -> int:
    """Next coarse node of a lane beside which the extreme can be; -1: there is none.

    It lies behind the node `after`, in the chunk `last` at most. `best` is the highest node.
    """
    for group in range((after + 1) // CHUNK, last + 1):
        bound = upward * bounds[group * LANES + k]
        if bound < best:
            continue
        row = (CHUNK * group + PAD) * LANES + k
        u0, u1 = upward * deviations[row - LANES], upward * deviations[row]
        u2, u3 = upward * deviations[row + LANES], upward * deviations[row + 2 * LANES]
        u4, u5 = upward * deviations[row + 3 * LANES], upward * deviations[row + 4 * LANES]
        # No curve rises above a node by more than this chunk's bound above its highest node.
        least = best - (bound - max(max(u1, u2), max(u3, u4)))
        # Of equal neighbours the first counts.
        here = (u1 >= least) & (u1 > u0) & (u1 >= u2), (u2 >= least) & (u2 > u1) & (u2 >= u3)
        there = (u3 >= least) & (u3 > u2) & (u3 >= u4), (u4 >= least) & (u4 > u3) & (u4 >= u5)
        begin = after - CHUNK * group
        if here[0] and begin < 0:
            return CHUNK * group
        if here[1] and begin < 1:
            return CHUNK * group + 1
        if there[0] and begin < 2:
            return CHUNK * group + 2
        if there[1] and begin < 3:
            return CHUNK * group + 3
    return -1
