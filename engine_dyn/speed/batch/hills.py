"""Where the speed of a block of designs is highest and lowest, between the nodes of their lanes.

The curve of a design is known at the coarse nodes (`lanes`); each of its hills that may hold the
extreme is searched: two coarse nodes, two fine ones between them, and there the extreme of the
curve itself. A lane looks at places of its own: rows of shared tables are read at once and turned
into lanes, the rest is gathered, and nothing branches.
"""

from __future__ import annotations

import math

from engine_dyn.compilation import (
    SQUARE_SIDE,
    formula,
    indices_on_stack,
    inlined,
    on_stack,
    turn_eights,
    turn_fours,
    turn_pairs,
    wide_vectors,
)
from engine_dyn.speed.batch.harmonics import own_pair, own_pairs
from engine_dyn.speed.batch.lanes import (
    BETA,
    BOTTOM,
    BOTTOM_HILLS,
    BOTTOM_LAST,
    BOTTOM_RIPPLE,
    BOTTOM_TILT,
    CODE,
    ERROR,
    ETA,
    EULER,
    EULER_FAR,
    GAS,
    HALF,
    HIGH,
    KAPPA,
    LANES,
    LEFT,
    LOW,
    MISS,
    MOVED,
    NEXT_TABLE,
    PAD,
    PEAK,
    ROW_TABLE,
    SLACK,
    SQUARE_MEAN,
    THIN,
    TOP,
    TOP_HILLS,
    TOP_LAST,
    TOP_RIPPLE,
    TOP_TILT,
    Form,
    Inertia,
    constant,
    own,
    shared,
)
from engine_dyn.speed.batch.levels import (
    ALIASED,
    CHUNK,
    HIGHEST_SLOPE,
    HIGHEST_SLOPE_V,
    P_ABOVE,
    P_BELOW,
    P_MOMENT,
    RIPPLE,
    RIPPLE_V,
    SQUARES,
    TILT,
    TILT_V,
    V_ABOVE,
    V_BELOW,
    V_MOMENT,
    Levels,
    P,
    V,
)
from engine_dyn.speed.results import CANCELLED, ROUNDING
from engine_dyn.speed.tables.extremes import interpolate, refine
from engine_dyn.speed.tables.work_tables import QUINTIC
from engine_dyn.types import Floats, Integers

__all__ = ["candidates", "clear_ripple", "extremes"]


TWO_ROWS, FOUR_ROWS, FIVE_ROWS, SIX_ROWS = 2 * LANES, 4 * LANES, 5 * LANES, 6 * LANES
EIGHT_ROWS = 8 * LANES


@formula
def take_hills(
    upward: float, group: int, extreme: int, lanes: int, chunk: Floats, s: Floats, us: Floats,
    bounds: Floats, noted: Floats,
) -> None:  # fmt: skip
    """Note which nodes of a chunk have hills that may hold the extreme.

    `extreme` is the row of the extreme node. `noted` gets the first such node, the last chunk, how
    many there are, and the ripple and the tilt of these chunks: a row of lanes each. No hill rises
    above its node by more than the chunk's bound above its highest node. One node a hill: the first
    of equals.
    """
    row, number = (CHUNK * group + PAD - 1) * LANES, float(CHUNK * group)
    here = us[row : row + SIX_ROWS]
    bounds = bounds[group * LANES : (group + 1) * LANES]
    extremes = s[extreme : extreme + LANES]
    ripple, ripple_v = shared(chunk, group, RIPPLE), shared(chunk, group, RIPPLE_V)
    tilt, tilt_v = shared(chunk, group, TILT), shared(chunk, group, TILT_V)
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
        share = s[THIN + k] if bound >= best else 0.0
        g, eta = share * s[GAS + k], share * s[ETA + k]
        of_p, of_v = own(chunk, ripple, group, RIPPLE, k), own(chunk, ripple_v, group, RIPPLE_V, k)
        noted[3 * LANES + k] = max(noted[3 * LANES + k], g * of_p + eta * of_v)
        of_p, of_v = own(chunk, tilt, group, TILT, k), own(chunk, tilt_v, group, TILT_V, k)
        noted[4 * LANES + k] = max(noted[4 * LANES + k], g * of_p + eta * of_v)


@inlined
def candidates(
    inertia: Inertia, step: float, least_square: float, lanes: int, levels: Levels, s: Floats,
    us: Floats, tops: Floats, lows: Floats,
) -> bool:  # fmt: skip
    """Where the extremes can be: the first node of a hill, the last chunk, the number of hills.

    Between two nodes a curve exceeds the higher of them by no more than it rises above its chord.
    `tops` and `lows` become these bounds. Returns whether there is ripple for `clear_ripple`.
    """
    wide_vectors()
    chunk, constants = levels.chunk, levels.constants
    above, below = on_stack(FIVE_ROWS), on_stack(FIVE_ROWS)
    for k in range(lanes):
        above[k] = below[k] = -1.0
        above[LANES + k] = below[LANES + k] = -1.0
        above[2 * LANES + k] = below[2 * LANES + k] = 0.0
        above[3 * LANES + k] = below[3 * LANES + k] = 0.0
        above[4 * LANES + k] = below[4 * LANES + k] = 0.0
        g, eta = s[GAS + k], s[ETA + k]
        steepest = g * constant(constants, HIGHEST_SLOPE, k)
        steepest += eta * constant(constants, HIGHEST_SLOPE_V, k)
        s[SLACK + k] = 0.125 * step * step * s[BETA + k] * steepest
        s[THIN + k] = 1.0
        if len(inertia) == 2:
            # q exceeds q* where e - q* tau does, which is linear in P and V.
            s[THIN + k] = 1.0 / (1.0 + eta * least_square)
    for group in range(chunk.shape[0]):
        pa, pb = shared(chunk, group, P_ABOVE), shared(chunk, group, P_BELOW)
        va, vb = shared(chunk, group, V_ABOVE), shared(chunk, group, V_BELOW)
        row = group * LANES
        high = deep = 0.0
        for k in range(lanes):
            p_above, p_below = own(chunk, pa, group, P_ABOVE, k), own(chunk, pb, group, P_BELOW, k)
            v_above, v_below = own(chunk, va, group, V_ABOVE, k), own(chunk, vb, group, V_BELOW, k)
            g, eta = s[GAS + k], s[ETA + k]
            if len(inertia) == 2:
                eta *= 1.0 + s[HIGH + k]
            top = tops[row + k] + s[THIN + k] * (g * p_above + eta * v_below + s[SLACK + k])
            low = lows[row + k] - s[THIN + k] * (g * p_below + eta * v_above + s[SLACK + k])
            tops[row + k] = top
            lows[row + k] = low
            high += 1.0 if top >= s[HIGH + k] else 0.0
            deep += 1.0 if low <= s[LOW + k] else 0.0
        if high > 0.0:
            take_hills(1.0, group, HIGH, lanes, chunk, s, us, tops, above)
        if deep > 0.0:
            take_hills(-1.0, group, LOW, lanes, chunk, s, us, lows, below)
    rippled = 0.0
    for k in range(lanes):
        # Without a hill the numbers are none.
        none = (s[CODE + k] == 0.0) & (min(above[k], below[k]) < 0.0)
        s[CODE + k] = LEFT if none else s[CODE + k]
        wanted = s[CODE + k] == 0.0
        s[TOP + k], s[BOTTOM + k] = max(above[k], 0.0), max(below[k], 0.0)
        s[TOP_LAST + k], s[BOTTOM_LAST + k] = above[LANES + k], below[LANES + k]
        s[TOP_RIPPLE + k] = above[3 * LANES + k] if wanted else 0.0
        s[BOTTOM_RIPPLE + k] = below[3 * LANES + k] if wanted else 0.0
        s[TOP_TILT + k], s[BOTTOM_TILT + k] = above[4 * LANES + k], below[4 * LANES + k]
        s[TOP_HILLS + k] = above[2 * LANES + k] if wanted else 0.0
        s[BOTTOM_HILLS + k] = below[2 * LANES + k] if wanted else 0.0
        rippled += s[TOP_RIPPLE + k] + s[BOTTOM_RIPPLE + k]
    return rippled > 0.0


VALUES, SLOPES, INTEGRALS, MIDDLES = 0, 1, 2, 3
"""Pairs of fields of a fine node, one of P and the same of V."""


@formula
def pair_at(
    place: int, pair: int, k: int, fine: Floats, mix: Floats, s: Floats
) -> tuple[float, float]:
    """One of the pairs of a fine node; a lane with curves of its own adds them up."""
    if fine.ndim == 2:
        return fine[place, 2 * pair], fine[place, 2 * pair + 1]
    first, second = int(s[ROW_TABLE + k]), int(s[NEXT_TABLE + k])
    return own_pair(place, pair, k, first, second, fine, mix)


@formula
def read_pairs(
    count: int, pair: int, places: Integers, lanes: int, fine: Floats, mix: Floats, s: Floats,
    found: Floats,
) -> None:  # fmt: skip
    """Pairs of fields of every lane's fine node, `count` of them from `pair` on, as rows of lanes.

    `count`, a constant where this is called, is 1, 2 or 4: half the number of rows of `found`.
    """
    if fine.ndim == 2:
        for k in range(0, lanes, SQUARE_SIDE):
            if count == 1:
                turn_pairs(fine, 2 * pair, places, k, found)
            elif count == 2:
                turn_fours(fine, 2 * pair, places, k, found)
            else:
                turn_eights(fine, 2 * pair, places, k, found)
        return
    first, second = int(s[ROW_TABLE]), int(s[NEXT_TABLE])  # the same for all lanes
    for i in range(count):
        gas, squares = found[2 * i * LANES :], found[(2 * i + 1) * LANES :]
        own_pairs(pair + i, places, lanes, first, second, fine, mix, gas, squares)


@formula
def read_nodes(fields: int, places: Integers, lanes: int, coarse: Floats, found: Floats) -> None:
    """Take P, V, P_MOMENT, V_MOMENT, WORK and SQUARES of every lane's coarse node: rows of lanes.

    `fields`, a constant where this is called, is 4, for the first four, or 8: rows of `found`.
    """
    if coarse.ndim == 2:
        for k in range(0, lanes, SQUARE_SIDE):
            if fields == 4:
                turn_fours(coarse, P, places, k, found)
            else:
                turn_eights(coarse, P, places, k, found)
        return
    for field in range(min(fields, SQUARES + 1)):
        row = found[field * LANES : (field + 1) * LANES]
        for k in range(lanes):
            row[k] = own(coarse, 0.0, places[k], field, k)


@formula
def load_of(
    p: float, v: float, moment: float, turning: float, u: float, r: float, turn: float, k: int,
    s: Floats,
) -> tuple[float, float, float, float]:  # fmt: skip
    """Return X, y, the slope of y and tau at a coarse node, with all that its extremes need.

    The recurrence takes X for a line between two coarse nodes; what its first moments differ from
    that is too little to matter but here.
    """
    g, eta, beta = s[GAS + k], s[ETA + k], s[BETA + k]
    tau = 1.0 + turn * v
    # u tau: what moves u for the closure and the first moments is divided by tau there.
    energy = u * tau + s[MOVED + k] - beta * beta * (g * moment - eta * turning)
    x = g * p - eta * v
    return x, x - energy, s[KAPPA + k] * (r + s[HALF + k] * energy), tau


@formula
def load_at(
    node: int, r: float, turn: float, k: int, coarse: Floats, s: Floats, us: Floats
) -> tuple[float, float, float, float]:  # fmt: skip
    """`load_of` one node."""
    nodes = coarse.shape[0]
    here = node + nodes if node < 0 else (node - nodes if node >= nodes else node)
    p, v = (
        own(coarse, shared(coarse, here, P), here, P, k),
        own(coarse, shared(coarse, here, V), here, V, k),
    )
    moment = own(coarse, shared(coarse, here, P_MOMENT), here, P_MOMENT, k)
    turning = own(coarse, shared(coarse, here, V_MOMENT), here, V_MOMENT, k)
    return load_of(p, v, moment, turning, us[(node + PAD) * LANES + k], r, turn, k, s)


@formula
def bend_of(
    form: Form, dp: float, dv: float, u: float, dy: float, share: float, turn: float,
    k: int, s: Floats,
) -> float:  # fmt: skip
    """Second slope of w = y - beta I at a coarse node, kappa r' - beta y'.

    From the slopes of P and V there; `share` is 1/(q tau). With F = q^a, F' is a F/q times that of
    u, r is F - 1 - a u tau, and kappa F is kappa + y'.
    """
    beta = s[BETA + k]
    if len(form) < 3:
        return -beta * dy
    a, kappa = s[HALF + k], s[KAPPA + k]
    rate = s[GAS + k] * dp - s[ETA + k] * dv - dy
    return a * ((kappa + dy) * share * (rate - u * turn * dv) - kappa * rate) - beta * dy


@formula
def extreme_between(
    left: float, right: float, d_left: float, d_right: float, width: float, g: float, eta: float,
    turn: float, mp: float, mv: float, v_left: float, v_right: float, dv_left: float,
    dv_right: float,
) -> tuple[float, float]:  # fmt: skip
    """Extreme of u between two fine nodes, and what the middle adds to it.

    The middle of q = e/tau comes from those of energy and inertia, both known.
    """
    d_left *= width
    d_right *= width
    tau_left, tau_right = 1.0 + turn * v_left, 1.0 + turn * v_right
    turn_left, turn_right = width * turn * dv_left, width * turn * dv_right
    energy = g * mp - (eta - turn) * mv + interpolate(
        0.5, tau_left + left * tau_left - 1.0, tau_right + right * tau_right - 1.0,
        d_left * tau_left + (1.0 + left) * turn_left,
        d_right * tau_right + (1.0 + right) * turn_right,
    )  # fmt: skip
    off = turn * mv + interpolate(0.5, tau_left - 1.0, tau_right - 1.0, turn_left, turn_right)
    middle = (energy - off) / (1.0 + off) - interpolate(0.5, left, right, d_left, d_right)
    value, _, bump = refine(left, right, d_left, d_right, middle)
    return value, abs(bump)


@inlined
def peaks_near(
    form: Form, upward: float, inertia: Inertia, step: float, ratio: int, lanes: int,
    levels: Levels, s: Floats, us: Floats, rs: Floats, chosen: Integers,
) -> None:  # fmt: skip
    """PEAK and MISS of every lane get the extreme beside its node where it is more than they hold.

    Without a branch, so that lanes stay vectors although each looks at a place of its own.
    """
    wide_vectors()
    coarse = levels.coarse
    nodes = coarse.shape[0]
    share, turns, width = 1.0 / ratio, 1.0 / step, step / ratio
    values, bumps, roughs = on_stack(LANES), on_stack(LANES), on_stack(LANES)
    load_slopes, load_bends = on_stack(LANES), on_stack(LANES)
    speeds, speed_steps = on_stack(LANES), on_stack(LANES)
    zeroth, linear, second = on_stack(LANES), on_stack(LANES), on_stack(LANES)
    third, fourth, fifth = on_stack(LANES), on_stack(LANES), on_stack(LANES)
    pairs, fours, eights = on_stack(TWO_ROWS), on_stack(FOUR_ROWS), on_stack(EIGHT_ROWS)
    more_pairs, more_fours = on_stack(TWO_ROWS), on_stack(FOUR_ROWS)
    starts, places, behind = (
        indices_on_stack(LANES), indices_on_stack(LANES), indices_on_stack(LANES)
    )  # fmt: skip
    firsts = indices_on_stack(LANES)
    eights0, eights1, eights2, eights3, eights4, eights5, eights6, eights7 = (
        eights[0 * LANES : 1 * LANES],
        eights[1 * LANES : 2 * LANES],
        eights[2 * LANES : 3 * LANES],
        eights[3 * LANES : 4 * LANES],
        eights[4 * LANES : 5 * LANES],
        eights[5 * LANES : 6 * LANES],
        eights[6 * LANES : 7 * LANES],
        eights[7 * LANES : 8 * LANES],
    )
    fours0, fours1, fours2, fours3 = (
        fours[0 * LANES : 1 * LANES],
        fours[1 * LANES : 2 * LANES],
        fours[2 * LANES : 3 * LANES],
        fours[3 * LANES : 4 * LANES],
    )
    more_fours0, more_fours1, more_fours2, more_fours3 = (
        more_fours[0 * LANES : 1 * LANES],
        more_fours[1 * LANES : 2 * LANES],
        more_fours[2 * LANES : 3 * LANES],
        more_fours[3 * LANES : 4 * LANES],
    )
    pairs0, pairs1 = (
        pairs[0 * LANES : 1 * LANES],
        pairs[1 * LANES : 2 * LANES],
    )
    more_pairs0, more_pairs1 = (
        more_pairs[0 * LANES : 1 * LANES],
        more_pairs[1 * LANES : 2 * LANES],
    )
    for k in range(lanes):
        places[k] = ratio * (chosen[k] + 1)
    read_pairs(1, SLOPES, places, lanes, levels.fine, levels.mix, s, pairs)
    for k in range(lanes):
        node = chosen[k]
        g, eta, a, kappa = s[GAS + k], s[ETA + k], s[HALF + k], s[KAPPA + k]
        turn = eta if len(inertia) == 2 else 0.0
        row = (node + PAD) * LANES + k
        r1 = 0.0
        if len(form) > 2:
            r1 = rs[row]
            # What the last Euler-Maclaurin term adds, twice, is above what the next one would.
            far = rs[row + 2 * LANES] - rs[row - 2 * LANES]
            near = rs[row + LANES] - rs[row - LANES]
            rough = 2.0 * abs(22.0 / 82.0 * s[EULER + k] * near - s[EULER_FAR + k] * far)
            roughs[k] = rough
        # No coarse node beside it is higher: by its slope, the extreme lies before it or behind.
        dp, dv = pairs0[k], pairs1[k]
        u1 = us[row] + s[MOVED + k]
        tau = 1.0
        if len(inertia) == 2:
            tau += turn * own(coarse, shared(coarse, node, V), node, V, k)
        slope = g * dp - eta * dv - kappa * (r1 + a * u1 * tau) - u1 * turn * dv
        first = node if slope * upward > 0.0 else node - 1
        firsts[k] = first
        places[k] = first + nodes if first < 0 else first
        behind[k] = first + 1 - nodes if first + 1 >= nodes else first + 1
        starts[k] = ratio * (first + 1)
    read_nodes(8, places, lanes, coarse, eights)
    read_nodes(4, behind, lanes, coarse, fours)
    read_pairs(2, SLOPES, starts, lanes, levels.fine, levels.mix, s, more_fours)
    if len(form) > 2:
        for k in range(lanes):
            places[k] = starts[k] + ratio
        read_pairs(1, SLOPES, places, lanes, levels.fine, levels.mix, s, more_pairs)
    for k in range(lanes):
        g, eta, beta = s[GAS + k], s[ETA + k], s[BETA + k]
        turn = eta if len(inertia) == 2 else 0.0
        row = (firsts[k] + PAD) * LANES + k
        r0 = r2 = 0.0
        if len(form) > 2:
            r0, r2 = rs[row], rs[row + LANES]
        x0, y0, dy0, tau0 = load_of(
            eights0[k], eights1[k], eights2[k], eights3[k], us[row],
            r0, turn, k, s,
        )  # fmt: skip
        x2, y2, dy2, tau2 = load_of(
            fours0[k], fours1[k], fours2[k], fours3[k],
            us[row + LANES], r2, turn, k, s,
        )  # fmt: skip
        # Between the two, y = beta I + w: the antiderivative I of X carries all that is not
        # smooth, and the rest is a polynomial by values and two slopes at both ends.
        before = g * more_fours2[k] - eta * more_fours3[k]
        work = g * eights4[k] - eta * eights5[k]
        w0, d0 = y0 - beta * before, (dy0 - beta * x0) * step
        w2, d2 = y2 - beta * (before + work), (dy2 - beta * x2) * step
        energy0, energy2 = x0 - y0, x2 - y2
        u0, u2, share0, share2 = energy0, energy2, 0.0, 0.0
        if len(inertia) == 2:
            inverse = 1.0 / (tau0 * tau2)
            u0, u2 = energy0 * (inverse * tau2), energy2 * (inverse * tau0)
        if len(form) > 2:
            inverse = 1.0 / ((tau0 + energy0) * (tau2 + energy2))
            share0, share2 = inverse * (tau2 + energy2), inverse * (tau0 + energy0)
        c0 = bend_of(form, more_fours0[k], more_fours1[k], u0, dy0, share0, turn, k, s)
        c2 = bend_of(form, more_pairs0[k], more_pairs1[k], u2, dy2, share2, turn, k, s)
        c0, c2 = c0 * step * step, c2 * step * step
        rise, run, turned = w2 - w0 - d0 - 0.5 * c0, d2 - d0 - c0, c2 - c0
        load_slopes[k], load_bends[k] = dy0, (dy2 - dy0) * share
        speeds[k], speed_steps[k] = u0, (u2 - u0) * share
        zeroth[k], linear[k] = w0, d0
        second[k] = 0.5 * c0
        third[k] = 10.0 * rise - 4.0 * run + 0.5 * turned
        fourth[k] = -15.0 * rise + 7.0 * run - turned
        fifth[k] = 6.0 * rise - 3.0 * run + 0.5 * turned
    for k in range(lanes):
        places[k] = starts[k]
    # Halve the interval down to two neighbouring fine nodes; for the sign of the slope, y' and u
    # are lines.
    part = ratio // 2
    while part > 0:
        for k in range(lanes):
            behind[k] = places[k] + part
        read_pairs(1, SLOPES, behind, lanes, levels.fine, levels.mix, s, pairs)
        for k in range(lanes):
            t = float(behind[k] - starts[k])
            slope = s[GAS + k] * pairs0[k] - s[ETA + k] * pairs1[k]
            slope -= load_slopes[k] + t * load_bends[k]
            if len(inertia) == 2:
                turned = s[ETA + k] * pairs1[k]
                slope -= (speeds[k] + t * speed_steps[k]) * turned
            places[k] += part if slope * upward > 0.0 else 0
        part //= 2
    for k in range(lanes):
        behind[k] = places[k] + 1
    read_pairs(4, VALUES, places, lanes, levels.fine, levels.mix, s, eights)
    read_pairs(2, VALUES, behind, lanes, levels.fine, levels.mix, s, fours)
    for k in range(lanes):
        g, eta, beta = s[GAS + k], s[ETA + k], s[BETA + k]
        turn = eta if len(inertia) == 2 else 0.0
        w0, d0 = zeroth[k], linear[k]
        c2, c3 = second[k], third[k]
        c4, c5 = fourth[k], fifth[k]
        rough = roughs[k] if len(form) > 2 else 0.0
        at = float(places[k] - starts[k])
        t, after = at * share, (at + 1.0) * share
        p1, v1 = eights0[k], eights1[k]
        dp1, dv1 = eights2[k], eights3[k]
        ip, iv = eights4[k], eights5[k]
        mp, mv = eights6[k], eights7[k]
        p2, v2 = fours0[k], fours1[k]
        dp2, dv2 = fours2[k], fours3[k]
        x1, x2 = g * p1 - eta * v1, g * p2 - eta * v2
        dx1, dx2 = g * dp1 - eta * dv1, g * dp2 - eta * dv2
        work = g * ip - eta * iv
        y1 = beta * work + w0 + t * (d0 + t * (c2 + t * (c3 + t * (c4 + t * c5))))
        work += width * (
            0.5 * (x1 + x2) + width / 12.0 * (dx1 - dx2) + 8.0 / 15.0 * (g * mp - eta * mv)
        )
        y2 = beta * work + w0
        y2 += after * (d0 + after * (c2 + after * (c3 + after * (c4 + after * c5))))
        dy1 = d0 + t * (2.0 * c2 + t * (3.0 * c3 + t * (4.0 * c4 + t * 5.0 * c5)))
        dy1 = beta * x1 + turns * dy1
        dy2 = d0 + after * (2.0 * c2 + after * (3.0 * c3 + after * (4.0 * c4 + after * 5.0 * c5)))
        dy2 = beta * x2 + turns * dy2
        left, right = x1 - y1, x2 - y2
        d_left, d_right = dx1 - dy1, dx2 - dy2
        if len(inertia) == 2:
            tau1, tau2 = 1.0 / (1.0 + turn * v1), 1.0 / (1.0 + turn * v2)
            left *= tau1
            right *= tau2
            d_left = (d_left - left * turn * dv1) * tau1
            d_right = (d_right - right * turn * dv2) * tau2
        value, bump = extreme_between(
            left, right, d_left, d_right, width, g, eta, turn, mp, mv, v1, v2, dv1, dv2
        )
        # Beside the interval by a hair, where y' was not a line: the parabola at the nearer end.
        beside = d_right * upward > 0.0
        end, slope = (right if beside else left), (d_right if beside else d_left) * width
        curvature = (d_right - d_left) * width
        short = (curvature * upward < 0.0) & (abs(slope) < abs(curvature))
        hair = -0.5 * slope * slope / (curvature if short else 1.0)
        between = (d_left * upward > 0.0) & (d_right * upward < 0.0)
        value = value if between else (
            end + hair if short else upward * max(upward * left, upward * right)
        )  # fmt: skip
        more = upward * value > upward * s[PEAK + k]
        values[k] = value if more else s[PEAK + k]
        missed = bump if between else (abs(hair) if short else 1.0)
        bumps[k] = rough + missed if more else s[MISS + k]
    for k in range(lanes):
        s[PEAK + k], s[MISS + k] = values[k], bumps[k]


@inlined
def next_hill(
    upward: float, after: int, last: int, best: float, k: int, us: Floats, bounds: Floats
) -> int:
    """Next coarse node of a lane whose hill may hold the extreme; -1: there is none.

    It lies behind the node `after`, in the chunk `last` at most. `best` is the highest node.
    """
    for group in range((after + 1) // CHUNK, last + 1):
        bound = upward * bounds[group * LANES + k]
        if bound < best:
            continue
        row = (CHUNK * group + PAD) * LANES + k
        u0, u1 = upward * us[row - LANES], upward * us[row]
        u2, u3 = upward * us[row + LANES], upward * us[row + 2 * LANES]
        u4, u5 = upward * us[row + 3 * LANES], upward * us[row + 4 * LANES]
        # No hill rises above its node by more than this chunk's bound above its highest node.
        least = best - (bound - max(max(u1, u2), max(u3, u4)))
        # One node a hill: the first of equals.
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


@inlined
def peaks(
    form: Form, upward: float, inertia: Inertia, step: float, ratio: int, lanes: int,
    levels: Levels, s: Floats, us: Floats, rs: Floats, bounds: Floats, chosen: Integers,
) -> None:  # fmt: skip
    """Largest (upward = 1) or smallest (-1) u of every lane, in PEAK, and what it may miss.

    Lanes with several hills take one after the other; the rest repeat what they have. `chosen` is
    scratch.
    """
    wide_vectors()
    first, last = (TOP, TOP_LAST) if upward > 0.0 else (BOTTOM, BOTTOM_LAST)
    extreme, many = (HIGH, TOP_HILLS) if upward > 0.0 else (LOW, BOTTOM_HILLS)
    firsts, hills = s[first : first + LANES], s[many : many + LANES]
    more = 0.0
    for k in range(lanes):
        s[PEAK + k] = -1e300 * upward
        chosen[k] = int(firsts[k])
        more += 1.0 if hills[k] > 1.0 else 0.0
    peaks_near(form, upward, inertia, step, ratio, lanes, levels, s, us, rs, chosen)
    while more > 0.0:
        more = 0.0
        for k in range(LANES):
            if hills[k] > 1.0:
                best = upward * s[extreme + k]
                node = next_hill(upward, chosen[k], int(s[last + k]), best, k, us, bounds)
                chosen[k] = max(node, 0)
                hills[k] -= 1.0
                more += 1.0 if hills[k] > 1.0 else 0.0
        peaks_near(form, upward, inertia, step, ratio, lanes, levels, s, us, rs, chosen)


@inlined
def clear_hills(
    form: Form, upward: float, inertia: Inertia, ratio: int, k: int, levels: Levels,
    s: Floats, us: Floats, rs: Floats, bounds: Floats,
) -> bool:  # fmt: skip
    """Whether `peaks` cannot have been misled by ripple: asked of few lanes, one at a time.

    Wherever the extreme can be, between two coarse nodes, the slope has one zero at most, and if
    that is an extreme, one of the two nodes was taken for a hill.
    """
    coarse, chunk = levels.coarse, levels.chunk
    turn = s[ETA + k] if len(inertia) == 2 else 0.0
    best = upward * s[(HIGH if upward > 0.0 else LOW) + k]
    for group in range(chunk.shape[0]):
        bound = upward * bounds[group * LANES + k]
        of_p = own(chunk, shared(chunk, group, RIPPLE), group, RIPPLE, k)
        of_v = own(chunk, shared(chunk, group, RIPPLE_V), group, RIPPLE_V, k)
        if bound < best or max(of_p, of_v) == 0.0:
            continue
        row = (CHUNK * group + PAD) * LANES + k
        highest = upward * us[row]
        for i in range(1, CHUNK):
            highest = max(highest, upward * us[row + i * LANES])
        least = best - (bound - highest)
        for node in range(CHUNK * group - 1, CHUNK * (group + 1)):
            row = (node + PAD) * LANES + k
            before, left = upward * us[row - LANES], upward * us[row]
            right, behind = upward * us[row + LANES], upward * us[row + 2 * LANES]
            if max(left, right) < least:
                continue
            r0 = r2 = 0.0
            if len(form) > 2:
                r0, r2 = rs[row], rs[row + LANES]
            x0, y0, dy0, tau0 = load_at(node, r0, turn, k, coarse, s, us)
            x2, y2, dy2, tau2 = load_at(node + 1, r2, turn, k, coarse, s, us)
            u0, u2 = (x0 - y0) / tau0, (x2 - y2) / tau2
            falls = rises = 0
            ahead = 0.0
            for i in range(ratio + 1):
                t = i / ratio
                dp, dv = pair_at(ratio * (node + 1) + i, SLOPES, k, levels.fine, levels.mix, s)
                slope = s[GAS + k] * dp - s[ETA + k] * dv - (dy0 + t * (dy2 - dy0))
                slope -= (u0 + t * (u2 - u0)) * turn * dv
                slope *= upward
                falls += 1 if ahead > 0.0 and slope <= 0.0 else 0
                rises += 1 if ahead < 0.0 and slope >= 0.0 else 0
                ahead = slope
            hill = (left > before and left >= right) or (right > left and right >= behind)
            if falls + rises > 1 or (falls == 1 and not hill):
                return False
    return True


@inlined
def clear_ripple(
    form: Form, inertia: Inertia, ratio: int, levels: Levels, s: Floats, us: Floats,
    rs: Floats, tops: Floats, lows: Floats,
) -> None:  # fmt: skip
    """TOP_RIPPLE and BOTTOM_RIPPLE become 0 where ripple cannot have misled the search."""
    for k in range(LANES):
        if s[TOP_RIPPLE + k] > 0.0 and clear_hills(
            form, 1.0, inertia, ratio, k, levels, s, us, rs, tops
        ):
            s[TOP_RIPPLE + k] = 0.0
        if s[BOTTOM_RIPPLE + k] > 0.0 and clear_hills(
            form, -1.0, inertia, ratio, k, levels, s, us, rs, lows
        ):
            s[BOTTOM_RIPPLE + k] = 0.0


@formula
def products_missed(
    constants: Floats, period: float, span: float, timed: bool, k: int, s: Floats
) -> float:
    """Share of the mean speed that coarse nodes see wrongly, beyond what `lanes` knows of it.

    It counts in the mean of sqrt(1 + u), by the closure in u, and in the time of the cycle, with
    the mean square of u. Lanes
    with tables of their own know it of P and V only, and bound the square by that of half the
    range; with a shared one, of their products too, but not of those with what the load takes of u,
    nor of the fifth order.
    """
    missed = span * span
    if constants.ndim == 1:
        missed = min(1.0, s[BETA + k] * period / math.pi + missed * span) * s[SQUARE_MEAN + k]
    bent = 0.125 + 0.25 * abs(s[HALF + k] - 1.0) + (0.375 if timed else 0.0)
    return bent * missed * constant(constants, ALIASED, k)


@inlined
def extremes(
    form: Form, inertia: Inertia, step: float, ratio: int, timed: bool, lanes: int, levels: Levels,
    s: Floats, us: Floats, rs: Floats, tops: Floats, lows: Floats, chosen: Integers,
) -> None:  # fmt: skip
    """TOP and BOTTOM become the largest and smallest speed over nominal, ERROR what they miss."""
    wide_vectors()
    period = step * levels.coarse.shape[0]
    for side in range(2):
        upward = 1.0 if side == 0 else -1.0
        bounds = tops if side == 0 else lows
        place = TOP if side == 0 else BOTTOM
        found = s[place : place + LANES]
        peaks(form, upward, inertia, step, ratio, lanes, levels, s, us, rs, bounds, chosen)
        rippled, tilted = (TOP_RIPPLE, TOP_TILT) if side == 0 else (BOTTOM_RIPPLE, BOTTOM_TILT)
        ripple, tilt = s[rippled : rippled + LANES], s[tilted : tilted + LANES]
        for k in range(lanes):
            found[k] = math.sqrt(1.0 + s[PEAK + k])
            missed = 0.5 * (s[MISS + k] + ripple[k] + QUINTIC * tilt[k]) / found[k]
            s[ERROR + k] = missed if side == 0 else s[ERROR + k] + missed
    for k in range(lanes):
        span = s[TOP + k] - s[BOTTOM + k]
        rounding = ROUNDING * (1.0 + CANCELLED * s[ETA + k])
        s[ERROR + k] = (s[ERROR + k] + rounding) / span if span > 0.0 else 0.0
        s[ERROR + k] += products_missed(levels.constants, period, span, timed, k, s)
