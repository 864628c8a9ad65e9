"""Values, integrals and noise of recorded curves by the cubic through four neighbouring samples.

Samples may be unevenly spaced. All of it is linear in the samples, so that weights are found once
for a grid and serve every cycle.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from engine_dyn.recordings.recorded_cycles import RecordedCycles
from engine_dyn.types import Floats, Integers

_GAUSS = np.polynomial.legendre.leggauss(4)


def _lagrange(nodes: Floats, at: Floats) -> Floats:
    """Weights of the values at nodes, shape (..., n), of the polynomial at places, shape (...)."""
    count = nodes.shape[-1]
    weights = np.ones(nodes.shape)
    for i in range(count):
        for j in range(count):
            if i != j:
                weights[..., i] *= (at - nodes[..., j]) / (nodes[..., i] - nodes[..., j])
    return weights


def _around(angle: Floats, period: float) -> tuple[Floats, Integers]:
    """Angles and indices of the four samples around the step after each sample."""
    count = len(angle)
    index = np.arange(count)[:, None] + np.arange(-1, 3)
    turns = np.floor_divide(index, count)
    index = index - count * turns
    return angle[index] + period * turns, index


def work_weights(
    angle: Floats, period: float, slope_of: Callable[[Floats], Floats], start: float, end: float
) -> Floats:
    """Weights w for which sum(w p) is the integral of p V' from `start` to `end`.

    Parameters
    ----------
    angle : ndarray, shape (n,)
        Grid of the pressure [rad].
    period : float
        Of the cycle [rad].
    slope_of : callable
        V' at angles.
    start, end : float
        Within one period of each other [rad].

    Returns
    -------
    ndarray, shape (n,)
    """
    nodes, index = _around(angle, period)
    weights = np.zeros(len(angle))
    for turn in (-1.0, 0.0, 1.0):
        low = np.clip(nodes[:, 1] + turn * period, start, end)
        high = np.clip(nodes[:, 2] + turn * period, start, end)
        half = 0.5 * (high - low)
        if not half.any():
            continue
        for place, share in zip(*_GAUSS, strict=True):
            at = 0.5 * (low + high) + half * place
            part = (share * half * slope_of(at))[:, None]
            np.add.at(weights, index, part * _lagrange(nodes, at - turn * period))
    return weights


def slopes(cycles: RecordedCycles) -> Floats:
    """dp/dphi [Pa/rad] at each sample, by the parabola through it and its neighbours."""
    angle, period, p = cycles.angle, cycles.period, cycles.pressure
    after = np.diff(angle, append=angle[0] + period)
    before = np.roll(after, 1)
    up = (np.roll(p, -1, axis=1) - p) / after
    return np.asarray((up * before + np.roll(up, 1, axis=1) * after) / (before + after))


def delayed(cycles: RecordedCycles, angle: float) -> Floats:
    """Pressure of the same cycles `angle` [rad] later, shape (cycles, samples).

    Cycles follow each other; before the first and behind the last one they repeat themselves.
    """
    count = len(cycles.angle)
    places = cycles.angle - angle
    turns = np.floor((places - cycles.angle[0]) / cycles.period)
    inside = places - turns * cycles.period
    first = np.searchsorted(cycles.angle, inside, side="right") - 1
    offsets = first[:, None] + np.arange(-1, 3)
    over = np.floor_divide(offsets, count)
    nodes = cycles.angle[offsets - over * count] + cycles.period * over
    weights = _lagrange(nodes, inside)
    which = np.arange(cycles.cycles)[:, None, None] + over + turns[:, None].astype(int)
    # A neighbour that was not recorded is the cycle itself.
    own = np.arange(cycles.cycles)[:, None, None]
    which = np.where((which < 0) | (which >= cycles.cycles), own, which)
    values = cycles.pressure[which, offsets - over * count]
    return np.asarray((values * weights).sum(axis=-1))


def misfit_of_neighbours(cycles: RecordedCycles) -> Floats:
    """Difference of each sample from the cubic through two neighbours on either side.

    Divided by the root of the sum of the squared weights: of independent noise it has the standard
    deviation of the noise. Shape (cycles, samples).
    """
    count = len(cycles.angle)
    index = np.arange(count)[:, None] + np.array([-2, -1, 1, 2])
    turns = np.floor_divide(index, count)
    index = index - count * turns
    weights = _lagrange(cycles.angle[index] + cycles.period * turns, cycles.angle)
    misfit = cycles.pressure.copy()
    for k in range(4):
        misfit -= weights[:, k] * cycles.pressure[:, index[:, k]]
    return np.asarray(misfit / np.sqrt(1.0 + (weights**2).sum(axis=1)))
