"""What holds for every design whatever its solution: ranges of work, torque and inertia.

For one cylinder count, diagram and crank ratio these are numbers; they are tabulated over the crank
ratio (evenly in log(lambda/(1 - lambda))) from formulas of the folder `oracle` and interpolated, so
that ten million designs can be bounded without the kernels.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from engine_dyn.pressure.family import Family
from engine_dyn.types import Floats
from oracle.spline import acceleration, velocity

CYCLE = 4.0 * math.pi
MOST_CYLINDERS = 16
POINTS = 720
"""Over a firing period."""

FIRST, LAST, STEPS = -14.0, 7.2, 266
"""Of log(lambda/(1 - lambda)); a step is 0.08."""

TINY = 1e-300
"""Least size of what is tabulated by its logarithm."""

MARGIN = 0.02
"""For what the interpolation and the samples of the ranges miss (they miss less than 1 %)."""


@dataclass(frozen=True)
class Bounds:
    """Numbers of each design, SI units.

    ``gas_swing`` is the range of the gas work about its mean [J], ``mass_swing`` that of
    m r^2 sum v^2 (times omega^2/2: J), ``torque_least`` and ``torque_most`` bound the range of the
    torque at nominal speed, ``least_square`` and ``most_square`` are the extremes of sum v^2 less
    its mean.
    """

    mean_gas: Floats
    gas_swing: Floats
    mass_swing: Floats
    torque_least: Floats
    torque_most: Floats
    least_square: Floats
    most_square: Floats


class Shapes:
    """Tables over crank ratio for some rows of a family and crankcase pressures."""

    def __init__(self, family: Family, rows: Floats, crankcases: Sequence[float]) -> None:
        self.rows = rows
        self.crankcases = np.asarray(crankcases)
        ratios = 1.0 / (1.0 + np.exp(-np.linspace(FIRST, LAST, STEPS)))[:, None]
        kinds = rows.size * self.crankcases.size
        self.mean = np.zeros((rows.size, STEPS))
        self.swing = np.zeros((MOST_CYLINDERS, kinds, STEPS))
        self.torque = np.zeros((MOST_CYLINDERS, kinds, STEPS))
        self.moment = np.zeros((MOST_CYLINDERS, STEPS))
        self.least = np.zeros((MOST_CYLINDERS, STEPS))
        self.most = np.zeros((MOST_CYLINDERS, STEPS))
        phi = (np.arange(14400) + 0.5) * CYCLE / 14400
        speed = velocity(phi, ratios)
        for i, row in enumerate(rows):
            self.mean[i] = (pressure_of(family, float(row), phi) * speed).mean(axis=1)
        for count in range(1, MOST_CYLINDERS + 1):
            phi = np.arange(POINTS * count) * CYCLE / (POINTS * count)
            v = velocity(phi, ratios)
            square = folded(v * v, count)
            # Powers of the crank ratio, and high ones for many cylinders: lines as logarithms.
            self.least[count - 1] = np.log(np.maximum(square.mean(1) - square.min(1), TINY))
            self.most[count - 1] = np.log(np.maximum(square.max(1) - square.mean(1), TINY))
            self.moment[count - 1] = np.ptp(folded(-v * acceleration(phi, ratios), count), axis=1)
            for i, row in enumerate(rows):
                p = pressure_of(family, float(row), phi)
                for j, crankcase in enumerate(self.crankcases):
                    torque = folded((p - crankcase) * v, count)
                    rest = torque - torque.mean(axis=1, keepdims=True)
                    kind = i * self.crankcases.size + j
                    work = np.cumsum(rest, axis=1) - 0.5 * rest
                    self.swing[count - 1, kind] = np.ptp(work, axis=1) * CYCLE / phi.size
                    self.torque[count - 1, kind] = np.ptp(torque, axis=1)

    def bounds(self, columns: dict[str, Any]) -> Bounds:
        """Bounds of designs, shaped as their columns broadcast."""
        ratio = np.asarray(columns["crank_ratio"])
        place = np.log(ratio / (1.0 - ratio))
        count = np.asarray(columns["cylinders"])
        row = np.searchsorted(self.rows, columns["row"])
        case = np.searchsorted(self.crankcases, columns["crankcase"])
        kind = row * self.crankcases.size + case
        radius = 0.5 * np.asarray(columns["stroke"])
        lever = 0.25 * math.pi * np.asarray(columns["bore"]) ** 2 * radius
        throw = np.asarray(columns["mass"]) * radius**2
        moment = throw * np.asarray(columns["speed"]) ** 2
        gas = lever * at(self.torque, (count - 1, kind), place)
        mass = moment * at(self.moment, (count - 1,), place)
        least = -np.exp(at(self.least, (count - 1,), place))
        most = np.exp(at(self.most, (count - 1,), place))
        return Bounds(
            mean_gas=count * lever * at(self.mean, (row,), place),
            gas_swing=lever * at(self.swing, (count - 1, kind), place),
            mass_swing=throw * (most - least),
            torque_least=np.maximum(np.abs(gas - mass) - MARGIN * (gas + mass), 0.0),
            torque_most=(1.0 + MARGIN) * (gas + mass),
            least_square=least,
            most_square=most,
        )


def pressure_of(family: Family, row: float, phi: Floats) -> Floats:
    """Pressure [Pa] of a row that need not be whole."""
    low = math.floor(row)
    share = row - low
    value = (1.0 - share) * family.row(low)(phi)
    return value + share * family.row(low + 1)(phi) if share > 0.0 else value


def folded(curve: Floats, count: int) -> Floats:
    """Sum of the cylinders' curves over a firing period."""
    return curve.reshape(curve.shape[0], count, -1).sum(axis=1)


def at(table: Floats, which: tuple[Any, ...], place: Floats) -> Floats:
    """Cubic interpolation along the last axis of a table, at log(lambda/(1 - lambda))."""
    x = (place - FIRST) * ((STEPS - 1) / (LAST - FIRST))
    node = np.clip(np.floor(x).astype(np.int64), 1, STEPS - 3)
    t = x - node
    values = [table[(*which, node + k)] for k in (-1, 0, 1, 2)]
    weights = (
        -t * (t - 1.0) * (t - 2.0) / 6.0,
        (t + 1.0) * (t - 1.0) * (t - 2.0) / 2.0,
        -(t + 1.0) * t * (t - 2.0) / 2.0,
        (t + 1.0) * t * (t - 1.0) / 6.0,
    )
    return np.asarray(sum(w * v for w, v in zip(weights, values, strict=True)))
