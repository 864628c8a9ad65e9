r"""The motion of a shaft system from rest, step by step, until it repeats.

Where the solutions that balance every harmonic are not stable, or none is found, the motion itself
shows where it goes. The classical Runge-Kutta method integrates all discs from uniform rotation at
rest twists. A loss factor becomes viscous damping at one frequency: what is found is where Newton's
method begins, and no result.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from engine_dyn.compilation import inlined, kernel
from engine_dyn.torsion.couplings import rest_twists
from engine_dyn.torsion.harmonic_balance import Laws
from engine_dyn.torsion.system import ShaftSystem
from engine_dyn.types import Complexes, Floats, Integers

MOST_STEPS = 8192  # Largest number of steps of a cycle; stiffer systems are left out

CYCLES, REPEATS = 400, 1e-3
"""Largest number of cycles, and largest change of the twists over a cycle, over their range, with
which the motion repeats."""


class Rotor(NamedTuple):
    """One system, referred: nodes and shafts to their parents; shape (M,)."""

    parent: Integers
    inertia: Floats
    disc_damping: Floats
    ground_stiffness: Floats
    stiffness: Floats  # 0 of couplings that are not linear
    damping: Floats
    coupling: Integers  # Number of the coupling that is above a node, or -1
    factor: Floats  # Torque of this coupling over the referred torque


def steps_of_cycle(rotor: Rotor, steepest: Floats, cycle: float) -> int:
    """Number of steps with which the method is stable and exact enough: a power of two.

    `steepest` is the largest slope of each coupling [N m/rad], `cycle` the time of a cycle [s].
    """
    stiff = rotor.stiffness.copy()
    there = rotor.coupling >= 0
    stiff[there] = steepest[rotor.coupling[there]] / rotor.factor[there] ** 2
    total, viscous = rotor.ground_stiffness + stiff, rotor.disc_damping + rotor.damping
    np.add.at(total, rotor.parent[1:], stiff[1:])
    np.add.at(viscous, rotor.parent[1:], rotor.damping[1:])
    fastest = max(
        math.sqrt(2.0 * float((total / rotor.inertia).max())),
        2.0 * float((viscous / rotor.inertia).max()),
    )
    return int(2 ** math.ceil(math.log2(max(512.0, cycle * fastest))))


@inlined
def _value(laws: Laws, case: int, c: int, x: float) -> float:
    """Torque of a table at a twist."""
    low, high = laws.first[c], laws.first[c + 1] - 1
    while high - low > 1:
        middle = (low + high) // 2
        if laws.twist[case, middle] <= x:
            low = middle
        else:
            high = middle
    return float(laws.torque[case, low] + laws.slope[case, low] * (x - laws.twist[case, low]))


@inlined
def _accelerate(
    rotor: Rotor, laws: Laws, case: int, mean: Floats, rest: Floats, slider: Floats, force: Floats,
    state: Floats, rate: Floats,
) -> None:  # fmt: skip
    """Fill in rates of angles and speeds."""
    nodes = rotor.parent.size
    for node in range(nodes):
        angle, speed = state[node], state[nodes + node]
        rate[node] = speed
        rate[nodes + node] = force[node] - rotor.disc_damping[node] * speed
        rate[nodes + node] -= rotor.ground_stiffness[node] * angle
    for node in range(1, nodes):
        parent, c = rotor.parent[node], rotor.coupling[node]
        twist = state[node] - state[parent]
        torque = rotor.stiffness[node] * twist
        torque += rotor.damping[node] * (state[nodes + node] - state[nodes + parent])
        if c >= 0:
            x = twist / rotor.factor[node] + rest[c]
            held = laws.stick[case, c] * (x - slider[c])
            limit = laws.friction[case, c]
            own = _value(laws, case, c, x) + min(max(held, -limit), limit) - mean[c]
            torque += own / rotor.factor[node]
        rate[nodes + node] -= torque
        rate[nodes + parent] += torque
    for node in range(nodes):
        rate[nodes + node] /= rotor.inertia[node]


@kernel
def march(
    rotor: Rotor, laws: Laws, case: int, mean: Floats, rest: Floats, force: Floats, cycle: float,
    twists: Floats,
) -> float:  # fmt: skip
    """Fill in the twists of the couplings over the last cycle; their largest change over it.

    Parameters
    ----------
    rotor, laws, case : Rotor, Laws, int
    mean, rest : ndarray, shape (C,)
        Mean torques and twists at rest.
    force : ndarray, shape (2 n, M)
        Torques on the nodes at the beginning and in the middle of each step.
    cycle : float
        Its time [s].
    twists : ndarray, shape (C, n)
    """
    nodes, steps = rotor.parent.size, force.shape[0] // 2
    h, couplings = cycle / steps, rest.size
    state, stage, total = np.zeros(2 * nodes), np.zeros(2 * nodes), np.zeros(2 * nodes)
    rate, slider, change = np.zeros(2 * nodes), rest.copy(), math.inf
    for _ in range(CYCLES):
        change = 0.0
        for step in range(steps):
            for node in range(1, nodes):
                c = rotor.coupling[node]
                if c < 0:
                    continue
                x = (state[node] - state[rotor.parent[node]]) / rotor.factor[node] + rest[c]
                if laws.friction[case, c] > 0.0:
                    reach = laws.friction[case, c] / laws.stick[case, c]
                    slider[c] = min(max(slider[c], x - reach), x + reach)
                change = max(change, abs(x - twists[c, step]))
                twists[c, step] = x
            total[:] = 0.0
            for part in range(4):
                back = 0.0 if part == 0 else (0.5 if part < 3 else 1.0)
                for i in range(2 * nodes):
                    stage[i] = state[i] + back * h * rate[i]
                at = (2 * step + (0 if part == 0 else 1 if part < 3 else 2)) % (2 * steps)
                _accelerate(rotor, laws, case, mean, rest, slider, force[at], stage, rate)
                weight = 1.0 if part == 0 or part == 3 else 2.0
                for i in range(2 * nodes):
                    total[i] += weight * rate[i]
            for i in range(2 * nodes):
                state[i] += h / 6.0 * total[i]
        span = 0.0
        for c in range(couplings):
            span = max(span, twists[c].max() - twists[c].min())
        change = change / span if span > 0.0 else 0.0
        if not change > 0.01 * REPEATS:
            break
    return change


def marched(
    system: ShaftSystem, shafts: Any, laws: Laws, speed: float, mean: Floats, force: Complexes,
    base: float,
) -> tuple[Complexes | None, bool]:  # fmt: skip
    """Harmonics of the couplings' twists after many cycles of one case, and whether they repeat.

    None where the system is too stiff.

    Parameters
    ----------
    system, laws : ShaftSystem, Laws
        Of one case along their axis.
    shafts : sequence of int
        Shaft of each coupling.
    speed : float
        [rad/s].
    mean : ndarray, shape (1, C)
        Mean torques [N m].
    force : ndarray of complex, shape (M, H)
        Harmonics of the cycle from 0 on of the referred torque on each node [N m].
    base : float
        Order of the first harmonic.
    """
    nodes = system.node_of_shaft[shafts]
    strongest = int(np.abs(force).max(axis=0).argmax())
    stiffness = system.stiffness_at(speed)[0]
    coupling, factor = np.full(system.parent.size, -1), np.ones(system.parent.size)
    coupling[nodes], factor[nodes] = np.arange(nodes.size), system.shaft_factor[0, shafts]
    lag = stiffness * system.loss_factor[0] / (base * max(strongest, 1) * speed)
    rotor = Rotor(
        system.parent, system.inertia[0], system.disc_damping[0], system.ground_stiffness[0],
        np.where(coupling < 0, stiffness, 0.0), system.damping[0] + lag, coupling, factor,
    )  # fmt: skip
    steepest = np.maximum.reduceat(laws.slope[0], laws.first[:-1])
    steepest = steepest + np.where(laws.friction[0] > 0.0, laws.stick[0], 0.0)
    cycle = 2.0 * math.pi / (base * speed)
    steps = max(steps_of_cycle(rotor, steepest, cycle), 4 * force.shape[-1])
    if steps > MOST_STEPS:
        return None, False
    lines = np.zeros((force.shape[0], steps + 1), dtype=np.complex128)
    lines[:, : force.shape[-1]] = force
    over_time = np.ascontiguousarray(steps * np.fft.irfft(lines, 2 * steps).T)
    twists = np.zeros((nodes.size, steps))
    change = march(rotor, laws, 0, mean[0], rest_twists(laws, mean)[0], over_time, cycle, twists)
    whole = np.fft.rfft(twists) / steps
    whole[:, 1:] *= 2.0
    return whole[None, :, : steps // 4], change < REPEATS
