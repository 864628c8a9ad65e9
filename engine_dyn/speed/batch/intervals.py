"""The search for an extreme of u beside one coarse node of every lane.

The curve is known at the coarse nodes; of the two intervals beside a node the slope tells the right
one. It is halved down to two fine nodes, and there is the extreme of the curve itself. A lane looks
at places of its own: rows of shared tables are read at once and turned into lanes, what is added up
for each lane is read in turn, and nothing branches.
"""

from __future__ import annotations

import math

from engine_dyn.compilation import (
    formula,
    indices_on_stack,
    inlined,
    on_stack,
    wide_vectors,
)
from engine_dyn.speed.batch.forms import ITERATED, RATIONAL, VARIABLE_INERTIA, Form, Inertia
from engine_dyn.speed.batch.rational import slope_over_nominal
from engine_dyn.speed.batch.state import (
    BETA,
    CLOSURE_STEP,
    ETA,
    EULER_FAR,
    EULER_NEAR,
    EXTREME,
    EXTREME_ERROR,
    GAS_FACTOR,
    KAPPA,
    LANES,
    LAW_LINEAR,
    LAW_RISE,
    LAW_SLOPE,
    LAW_SQUARE,
    PAD,
    Block,
)
from engine_dyn.speed.batch.two_grid import (
    TwoGrid,
    V,
)
from engine_dyn.speed.batch.values import (
    SLOPES,
    VALUES,
    read_nodes,
    read_pairs,
    shared_value,
    value_at,
)
from engine_dyn.speed.tables.extremes import interpolate, refine
from engine_dyn.types import Floats

__all__ = ["load_of", "search_intervals"]

TWO_ROWS, FOUR_ROWS, EIGHT_ROWS = 2 * LANES, 4 * LANES, 8 * LANES

BEYOND_MIDDLE = 0.1
"""Part of the correction by the middle that the terms after it may make up. The odd ones are
bounded by the tilts of the table; an even one is some (k h)^2/30 of the term before, below a
hundredth for all orders k that the nodes resolve. With 1, two designs in a thousand of a grid
were solved again, which took a third of its time, and differed by 1e-9."""


@formula
def load_of(
    p: float, v: float, moment: float, turning: float, u: float, r: float, turn: float, k: int,
    state: Floats,
) -> tuple[float, float, float, float]:  # fmt: skip
    """Return X, y, the slope of y and tau at a coarse node, with all that its extremes need.

    docs/method.md (120): the recurrence takes X for a line between two coarse nodes; what its first
    moments differ from that is too little to matter but here.
    """
    g, eta, beta = state[GAS_FACTOR + k], state[ETA + k], state[BETA + k]
    tau = 1.0 + turn * v
    # u tau: what moves u for the closure and the first moments is divided by tau there.
    energy = u * tau + state[CLOSURE_STEP + k] - beta * beta * (g * moment - eta * turning)
    x = g * p - eta * v
    return x, x - energy, state[KAPPA + k] * (r + state[LAW_SLOPE + k] * energy), tau


@formula
def bend_of(
    form: Form, dp: float, dv: float, u: float, dy: float, share: float, turn: float,
    k: int, state: Floats,
) -> float:  # fmt: skip
    """Second slope of w = y - beta I at a coarse node: docs/method.md (118).

    From the slopes of P and V there; `share` is 1/(q tau). With F = q^a, F' is a F/q times that of
    u, r is F - 1 - a u tau, and kappa F is kappa + y'. A rational law knows F' itself.
    """
    beta = state[BETA + k]
    if len(form) < ITERATED:
        return -beta * dy
    a, kappa = state[LAW_SLOPE + k], state[KAPPA + k]
    rate = state[GAS_FACTOR + k] * dp - state[ETA + k] * dv - dy
    if len(form) == RATIONAL:
        steep = slope_over_nominal(
            math.sqrt(1.0 + u) - 1.0, state[LAW_RISE + k], state[LAW_LINEAR + k],
            state[LAW_SQUARE + k],
        )  # fmt: skip
        bent = steep * (1.0 + u) * share * (rate - u * turn * dv) - rate
        return a * kappa * bent - beta * dy
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
    return value, BEYOND_MIDDLE * abs(bump)


@inlined
def search_intervals(
    form: Form, upward: float, inertia: Inertia, step: float, ratio: int, lanes: int,
    two_grid: TwoGrid, block: Block,
) -> None:  # fmt: skip
    """Search beside the `chosen` node of every lane; EXTREME is replaced where more is found.

    Without a branch, so that lanes stay vectors although each looks at a place of its own.
    """
    wide_vectors()
    state, deviations, remainders = block.state, block.deviations, block.remainders
    chosen = block.chosen
    coarse = two_grid.coarse
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
    read_pairs(1, SLOPES, places, lanes, two_grid.fine, two_grid.mix, state, pairs)
    for k in range(lanes):
        node = chosen[k]
        g, eta, a, kappa = (
            state[GAS_FACTOR + k],
            state[ETA + k],
            state[LAW_SLOPE + k],
            state[KAPPA + k],
        )
        turn = eta if len(inertia) == VARIABLE_INERTIA else 0.0
        row = (node + PAD) * LANES + k
        r1 = 0.0
        if len(form) >= ITERATED:
            r1 = remainders[row]
            # What the last Euler-Maclaurin term adds, twice, is above what the next one would.
            far = remainders[row + 2 * LANES] - remainders[row - 2 * LANES]
            near = remainders[row + LANES] - remainders[row - LANES]
            rough = 2.0 * abs(
                22.0 / 82.0 * state[EULER_NEAR + k] * near - state[EULER_FAR + k] * far
            )
            roughs[k] = rough
        # No coarse node beside it is higher: by its slope, the extreme lies before it or behind.
        dp, dv = pairs0[k], pairs1[k]
        u1 = deviations[row] + state[CLOSURE_STEP + k]
        tau = 1.0
        if len(inertia) == VARIABLE_INERTIA:
            tau += turn * value_at(coarse, shared_value(coarse, node, V), node, V, k)
        slope = g * dp - eta * dv - kappa * (r1 + a * u1 * tau) - u1 * turn * dv
        first = node if slope * upward > 0.0 else node - 1
        firsts[k] = first
        places[k] = first + nodes if first < 0 else first
        behind[k] = first + 1 - nodes if first + 1 >= nodes else first + 1
        starts[k] = ratio * (first + 1)
    read_nodes(8, places, lanes, coarse, eights)
    read_nodes(4, behind, lanes, coarse, fours)
    read_pairs(2, SLOPES, starts, lanes, two_grid.fine, two_grid.mix, state, more_fours)
    if len(form) >= ITERATED:
        for k in range(lanes):
            places[k] = starts[k] + ratio
        read_pairs(1, SLOPES, places, lanes, two_grid.fine, two_grid.mix, state, more_pairs)
    for k in range(lanes):
        g, eta, beta = state[GAS_FACTOR + k], state[ETA + k], state[BETA + k]
        turn = eta if len(inertia) == VARIABLE_INERTIA else 0.0
        row = (firsts[k] + PAD) * LANES + k
        r0 = r2 = 0.0
        if len(form) >= ITERATED:
            r0, r2 = remainders[row], remainders[row + LANES]
        x0, y0, dy0, tau0 = load_of(
            eights0[k], eights1[k], eights2[k], eights3[k], deviations[row],
            r0, turn, k, state,
        )  # fmt: skip
        x2, y2, dy2, tau2 = load_of(
            fours0[k], fours1[k], fours2[k], fours3[k],
            deviations[row + LANES], r2, turn, k, state,
        )  # fmt: skip
        # Between the two, y = beta I + w: the antiderivative I of X carries all that is not
        # smooth, and w is the quintic of docs/method.md (119).
        before = g * more_fours2[k] - eta * more_fours3[k]
        work = g * eights4[k] - eta * eights5[k]
        w0, d0 = y0 - beta * before, (dy0 - beta * x0) * step
        w2, d2 = y2 - beta * (before + work), (dy2 - beta * x2) * step
        energy0, energy2 = x0 - y0, x2 - y2
        u0, u2, share0, share2 = energy0, energy2, 0.0, 0.0
        if len(inertia) == VARIABLE_INERTIA:
            inverse = 1.0 / (tau0 * tau2)
            u0, u2 = energy0 * (inverse * tau2), energy2 * (inverse * tau0)
        if len(form) >= ITERATED:
            inverse = 1.0 / ((tau0 + energy0) * (tau2 + energy2))
            share0, share2 = inverse * (tau2 + energy2), inverse * (tau0 + energy0)
        c0 = bend_of(form, more_fours0[k], more_fours1[k], u0, dy0, share0, turn, k, state)
        c2 = bend_of(form, more_pairs0[k], more_pairs1[k], u2, dy2, share2, turn, k, state)
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
        read_pairs(1, SLOPES, behind, lanes, two_grid.fine, two_grid.mix, state, pairs)
        for k in range(lanes):
            t = float(behind[k] - starts[k])
            slope = state[GAS_FACTOR + k] * pairs0[k] - state[ETA + k] * pairs1[k]
            slope -= load_slopes[k] + t * load_bends[k]
            if len(inertia) == VARIABLE_INERTIA:
                turned = state[ETA + k] * pairs1[k]
                slope -= (speeds[k] + t * speed_steps[k]) * turned
            places[k] += part if slope * upward > 0.0 else 0
        part //= 2
    for k in range(lanes):
        behind[k] = places[k] + 1
    read_pairs(4, VALUES, places, lanes, two_grid.fine, two_grid.mix, state, eights)
    read_pairs(2, VALUES, behind, lanes, two_grid.fine, two_grid.mix, state, fours)
    for k in range(lanes):
        g, eta, beta = state[GAS_FACTOR + k], state[ETA + k], state[BETA + k]
        turn = eta if len(inertia) == VARIABLE_INERTIA else 0.0
        w0, d0 = zeroth[k], linear[k]
        c2, c3 = second[k], third[k]
        c4, c5 = fourth[k], fifth[k]
        rough = roughs[k] if len(form) >= ITERATED else 0.0
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
        if len(inertia) == VARIABLE_INERTIA:
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
        more = upward * value > upward * state[EXTREME + k]
        values[k] = value if more else state[EXTREME + k]
        missed = bump if between else (abs(hair) if short else 1.0)
        bumps[k] = rough + missed if more else state[EXTREME_ERROR + k]
    for k in range(lanes):
        state[EXTREME + k], state[EXTREME_ERROR + k] = values[k], bumps[k]
