"""The task that all designs of a call of a kernel share, and writing the results of a design."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from engine_dyn.compilation import inlined
from engine_dyn.loads.laws import Form
from engine_dyn.speed.results import Results
from engine_dyn.speed.work.interpolation import BEFORE, STENCIL, lagrange_weights
from engine_dyn.types import Floats, Integers

PLACES = 2.0**26
"""Parts of an interval to which places are rounded."""


class Angles(NamedTuple):
    """Where curves are wanted: the node at or before each angle, and weights of those around it.

    Shapes (angle,) and (angle, STENCIL); nodes are the fine ones of a period.
    """

    node: Integers
    weight: Floats


def angles_of(angles: Floats, width: float, nodes: int) -> Angles:
    """Where angles [rad] lie among nodes of this width [rad]."""
    if not angles.size:  # no curve is wanted
        return Angles(np.zeros(0, dtype=np.int64), np.zeros((0, STENCIL)))
    place = np.mod(angles, width * nodes) / width
    # Without what rounding leaves: angles a period apart have the same place.
    place = np.rint(place * PLACES) / PLACES
    node = np.floor(place)
    return Angles(node.astype(np.int64) % nodes, lagrange_weights(place - node))


@inlined
def store(
    target: int, high: float, low: float, mean: float, span: float, mu: float, error: float,
    passes: float, wanted: Integers, scalars: Floats,
) -> None:  # fmt: skip
    """Write one design's numbers, docs/method.md (1). Speeds are in rad/s, `span` is their range.

    `wanted` and `scalars` are as of `Results`. The load factor 1/mu is that of docs/method.md (52).
    """
    values = (span / mean, 2.0 * span / (high + low), high, low, mean, 1.0 / mu, error, passes)
    for result in range(len(values)):
        if wanted[result] >= 0:
            scalars[wanted[result], target] = values[result]


@inlined
def store_nothing(target: int, code: int, results: Results) -> None:
    """Write NaN for a design that has no numbers, and its outcome."""
    results.status[target] = code
    for i in range(len(results.wanted)):
        if results.wanted[i] >= 0:
            results.scalars[results.wanted[i], target] = math.nan
    for curve in (results.omega, results.acceleration):
        for i in range(curve.shape[1]):
            curve[target, i] = math.nan


@inlined
def store_curves(
    target: int, nominal: float, q: Floats, rate: Floats, angles: Angles, results: Results
) -> None:
    """Write speed and angular acceleration of a design at the wanted angles.

    `q` and its slope `rate` are those at the fine nodes. The angular acceleration is half of
    omega_n^2 q', because omega domega/dphi is domega/dt.
    """
    nodes = len(q)
    for i in range(len(angles.node)):
        node = angles.node[i]
        value, slope = q[node], rate[node]
        if angles.weight[i, BEFORE] != 1.0:  # between nodes
            value = slope = 0.0
            for j in range(STENCIL):
                there = node + j - BEFORE
                there += nodes if there < 0 else (-nodes if there >= nodes else 0)
                value += angles.weight[i, j] * q[there]
                slope += angles.weight[i, j] * rate[there]
        if results.omega.shape[1] > 0:
            results.omega[target, i] = nominal * math.sqrt(max(value, 0.0))
        if results.acceleration.shape[1] > 0:
            results.acceleration[target, i] = 0.5 * nominal * nominal * slope


class Task(NamedTuple):
    """Arguments of `dispatch.solve` as kernels take them.

    `method` and `closure` are codes of `engine_dyn.speed.methods`, `variable` says whether the
    inertia varies over the crank angle, `tolerance` is the relative error of delta aimed at,
    `iterated` the error over the range of q that iterations may leave, and curves are wanted at
    `angles`.
    """

    method: int
    variable: bool
    closure: int
    tolerance: float
    iterated: float
    form: Form
    angles: Angles
