"""Writing the results of a design."""

from __future__ import annotations

import math

from engine_dyn.compilation import inlined
from engine_dyn.speed.arguments import Choice, Curves
from engine_dyn.speed.general.cycles import RATES, SPEEDS
from engine_dyn.speed.general.reduction import Design
from engine_dyn.speed.general.scratch import Scratch
from engine_dyn.speed.general.speeds import slope_at
from engine_dyn.speed.methods import THESIS
from engine_dyn.speed.results import (
    DELTA,
    DELTA_ERROR,
    DELTA_MIDRANGE,
    LOAD_FACTOR,
    OMEGA_MAX,
    OMEGA_MEAN,
    OMEGA_MIN,
    SCALARS,
    Results,
)
from engine_dyn.speed.tables.extremes import interpolate, slope_between
from engine_dyn.types import Floats

__all__ = ["store", "store_curves"]


@inlined
def store(
    target: int, code: int, good: bool, high: float, low: float, mean: float, mu: float,
    error: float, cycles: int, results: Results,
) -> None:  # fmt: skip
    """Write one design's numbers, docs/method.md (1), and NaN where it has none.

    The load factor 1/mu is that of docs/method.md (45).
    """
    results.status[target] = code
    for result in range(SCALARS):
        row = results.wanted[result]
        if row < 0:
            continue
        if not good:
            value = math.nan
        elif result == DELTA:
            value = (high - low) / mean
        elif result == DELTA_MIDRANGE:
            value = 2.0 * (high - low) / (high + low)
        elif result == OMEGA_MAX:
            value = high
        elif result == OMEGA_MIN:
            value = low
        elif result == OMEGA_MEAN:
            value = mean
        elif result == LOAD_FACTOR:
            value = 1.0 / mu
        elif result == DELTA_ERROR:
            value = error
        else:
            value = float(cycles)
        results.scalars[row, target] = value


@inlined
def store_curves(
    target: int, good: bool, design: Design, mu: float, choice: Choice, width: float,
    period: float, curves: Curves, table: Floats, scratch: Scratch, results: Results,
) -> None:  # fmt: skip
    """Write one design's speed and angular acceleration at the wanted angles.

    The interpolation is that of docs/method.md (37) in q, with the slopes of docs/method.md (89).
    """
    nodes = table.shape[1]
    nominal = design.nominal
    for i in range(curves.node.size):
        if not good:
            speed = rate = math.nan
        elif choice.method == THESIS:
            # The speed follows the method's own step from the sample before, also after the last
            # sample, because the first sample is the start of the cycle and not its end.
            j = int(math.floor(curves.sample[i] + 1e-9))
            fraction = max(curves.sample[i] - j, 0.0)
            speed, rate = scratch.sampled[SPEEDS, j], scratch.sampled[RATES, j]
            speed += fraction * period / scratch.sampled.shape[1] * rate / speed
        else:
            j = curves.node[i]
            after = j + 1 if j + 1 < nodes else 0
            left, d_left = slope_at(j, design, mu, choice.variable, table, scratch.records)
            right, d_right = slope_at(after, design, mu, choice.variable, table, scratch.records)
            fraction = curves.fraction[i]
            value = interpolate(fraction, left, right, d_left * width, d_right * width)
            slope = slope_between(fraction, left, right, d_left * width, d_right * width)
            speed = nominal * math.sqrt(max(value, 0.0))
            rate = 0.5 * nominal * nominal * slope / width
        if results.omega.shape[1] > 0:
            results.omega[target, i] = speed
        if results.acceleration.shape[1] > 0:
            results.acceleration[target, i] = rate
