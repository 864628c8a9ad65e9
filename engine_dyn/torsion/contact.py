"""Torques of couplings that are not linear, over samples and in time steps: the compiled part."""

from __future__ import annotations

import math
from typing import NamedTuple

from engine_dyn.compilation import inlined, kernel
from engine_dyn.loads.laws import point_before
from engine_dyn.types import Floats, Integers

# Part of the stiffness that Newton's method, not the torque, has in the clearance, where otherwise
# no mean torque would tell the mean twist.
SLACK = 1e-6

GROWING, CYCLES, REPEATS = 10, 400, 1e-4
"""Cycles over which the excitation grows; most cycles after these; the change of the twists from
one cycle to the next, over their range, with which the motion repeats."""

DISTURBED = 1.02  # Factor on the deviation from the linear motion once the excitation has grown


class Laws(NamedTuple):
    """Couplings of one case; C of them.

    Points of coupling c are those from `first[c]` to before `first[c + 1]`; the ends go on
    straight. A clearance is a piece without slope.
    """

    first: Integers
    twist: Floats  # rad, ascending; shape (P,)
    torque: Floats  # N m; shape (P,)
    slope: Floats  # from each point to the next [N m/rad]; shape (P,)
    stiffness: Floats  # that of the linear form [N m/rad]; shape (C,)
    friction: Floats  # torque F of the slider [N m]; shape (C,)
    stick: Floats  # stiffness k_f of the spring before it [N m/rad]; shape (C,)


class Steps(NamedTuple):
    """What a step of time makes of a state x of size S: free x + early u + late (u_next - u)."""

    free: Floats  # (S, S)
    early: Floats  # (S, C)
    late: Floats  # (S, C)
    twist: Floats  # Twist of each coupling by the state [rad]; shape (C, S)
    at_once: Floats  # Twist by u at the end of the step, twist late; shape (C, C)


@inlined
def _torque(laws: Laws, c: int, x: float) -> tuple[float, float]:
    """Torque and slope of a coupling's table at a twist."""
    first = laws.first[c]
    place = first + point_before(x, laws.twist[first : laws.first[c + 1]])
    slope = laws.slope[place]
    return laws.torque[place] + slope * (x - laws.twist[place]), slope


@kernel
def torques(
    laws: Laws, delta: Floats, torque: Floats, slope: Floats, grip: Floats, origin: Integers
) -> None:
    """Fill in what twists that repeat give at their samples; all have the shape (C, N).

    Parameters
    ----------
    laws : Laws
    delta : ndarray
        Twists.
    torque, slope : ndarray
        Torque with friction, and slope without it.
    grip : ndarray
        Slope by friction over its stiffness: 1 where it sticks.
    origin : ndarray of int
        Sample since which it sticks; -1 from the mean twist, -2 where it slips.
    """
    couplings, size = delta.shape
    for c in range(couplings):
        x, limit = delta[c], laws.friction[c]
        for i in range(size):
            torque[c, i], rise = _torque(laws, c, x[i])
            slope[c, i] = rise if rise > 0.0 else SLACK * laws.stiffness[c]
            grip[c, i], origin[c, i] = 0.0, -2
        if not limit > 0.0:
            continue
        held, since = laws.stick[c] * (x[0] - x.mean()), -1
        for i in range(2 * size):  # The second period repeats
            j = i % size
            if i > 0:
                held += laws.stick[c] * (x[j] - x[j - 1])
            if abs(held) > limit:
                held, since = math.copysign(limit, held), -2
            elif since == -2:
                since = (j - 1) % size
            if i >= size:
                torque[c, j] += held
                grip[c, j], origin[c, j] = 1.0 if since > -2 else 0.0, since


@kernel
def march(
    laws: Laws, steps: Steps, mean: Floats, linear: Floats, state: Floats, twists: Floats
) -> float:
    """Fill in the twists of the last cycle; their largest change over it, over their range.

    The excitation grows from 0, and what then differs from the linear motion is disturbed.

    Parameters
    ----------
    laws, steps : Laws, Steps
    mean : ndarray, shape (C,)
        Mean twists of the linear form.
    linear : ndarray, shape (C, n)
        Twists of the linear form without the mean, at the steps of a cycle.
    state : ndarray, shape (S,)
        That at rest, by which the twists differ from the linear ones; changed.
    twists : ndarray, shape (C, n)
    """
    couplings, count = linear.shape
    size, before = state.size, state.copy()
    delta, slider, excess, last = mean.copy(), mean.copy(), mean.copy(), mean.copy()
    base = mean.copy()
    change = math.inf
    for c in range(couplings):
        for i in range(size):
            delta[c] += steps.twist[c, i] * state[i]
        own, _ = _torque(laws, c, delta[c])
        slider[c], excess[c] = delta[c], own - laws.stiffness[c] * delta[c]
    for cycle in range(GROWING + CYCLES):
        change = 0.0
        if cycle == GROWING:
            for i in range(size):
                state[i] *= DISTURBED
        for step in range(count):
            share = min((cycle + (step + 1.0) / count) / GROWING, 1.0)
            at = (step + 1) % count
            before[:] = state
            for i in range(size):
                state[i] = 0.0
                for j in range(size):
                    state[i] += steps.free[i, j] * before[j]
                for c in range(couplings):
                    state[i] += (steps.early[i, c] - steps.late[i, c]) * excess[c]
            for c in range(couplings):
                base[c] = mean[c] + share * linear[c, at]
                for i in range(size):
                    base[c] += steps.twist[c, i] * state[i]
            for _ in range(50):
                last[:] = excess
                moved, most = 0.0, 0.0
                for c in range(couplings):
                    x = base[c]
                    for d in range(couplings):
                        x += steps.at_once[c, d] * last[d]
                    own, _ = _torque(laws, c, x)
                    held = laws.stick[c] * (x - slider[c])
                    held = min(max(held, -laws.friction[c]), laws.friction[c])
                    own += held
                    delta[c], excess[c] = x, own - laws.stiffness[c] * x
                    moved = max(moved, abs(excess[c] - last[c]))
                    most = max(most, abs(own) + laws.stiffness[c] * abs(x))
                if moved <= 1e-10 * most:
                    break
            for c in range(couplings):
                for i in range(size):
                    state[i] += steps.late[i, c] * excess[c]
                if laws.friction[c] > 0.0:
                    reach = laws.friction[c] / laws.stick[c]
                    slider[c] = min(max(slider[c], delta[c] - reach), delta[c] + reach)
                change = max(change, abs(delta[c] - twists[c, at]))
                twists[c, at] = delta[c]
        span = 0.0
        for c in range(couplings):
            span = max(span, twists[c].max() - twists[c].min())
        change = change / span if span > 0.0 else 0.0
        if cycle > GROWING + 1 and change < REPEATS:
            break
    return change
