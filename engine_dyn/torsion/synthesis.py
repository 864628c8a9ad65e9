r"""Extremes over the cycle of a sum of orders, between samples.

The curve Re sum_nu Q_nu exp(i nu phi) repeats after the cycle; order nu is harmonic h = nu
period/(2 pi) of it. It is sampled at M = 16 h_max equally spaced angles. Of the quarter psi =
(p + 1/2) 2 pi/M, p = 0 .. M/4 - 1, the cosines and sines of even and of odd harmonics give four
sums E_c, E_s, O_c, O_s, and these give four samples each:

    x(psi)      = E_c + O_c + E_s + O_s        x(-psi)     = E_c + O_c - E_s - O_s
    x(pi + psi) = E_c - O_c + E_s - O_s        x(pi - psi) = E_c - O_c - E_s + O_s

At every sample the parabola through it and its two neighbours is looked at within half a step. It
misses the curve by at most max|x'''| d^3/16, d = 2 pi/M the step, and |x'''| <= sum h^3 |Q|: the
bound that is returned. Of the highest order alone the extreme is missed by 0.06 percent at most.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from engine_dyn.compilation import inlined
from engine_dyn.types import Floats, Integers

__all__ = ["Synthesis", "extremes_of", "half_range", "least_torque", "synthesis"]

SAMPLES = 16
"""Samples a period of the highest order."""


class Synthesis(NamedTuple):
    """Cosines and sines of the orders at a quarter of the samples.

    Attributes
    ----------
    line : ndarray of int, shape (V,)
        Line of each order in the tables.
    even : int
        Lines of even harmonics, which come first.
    cosine, sine : ndarray, shape (V, M/4)
        Of h psi.
    bend : ndarray, shape (V,)
        h^3 d^3/16 of each order, for the bound.
    """

    line: Integers
    even: int
    cosine: Floats
    sine: Floats
    bend: Floats


def synthesis(orders: Floats, period: float) -> Synthesis:
    """Tables for these orders; each must have whole periods in the cycle, `period` [rad]."""
    harmonic = orders * (period / (2.0 * math.pi))
    whole = np.rint(harmonic)
    if orders.size and np.abs(harmonic - whole).max() > 1e-9 * whole.max():
        wrong = orders[np.abs(harmonic - whole) > 1e-9 * whole.max()][0]
        raise ValueError(f"orders: {wrong:g}: must have whole periods in the cycle")
    quarter = 8 * math.ceil(SAMPLES * whole.max(initial=1.0) / 32.0)
    step = 0.5 * math.pi / quarter
    even = whole % 2.0 == 0.0
    order = np.argsort(~even, kind="stable")
    angle = whole[order, None] * ((np.arange(quarter) + 0.5) * step)
    return Synthesis(
        np.argsort(order), int(even.sum()), np.cos(angle), np.sin(angle), (whole * step) ** 3 / 16.0
    )


@inlined
def extremes_of(
    real: Floats, imaginary: Floats, table: Synthesis, sums: Floats, curve: Floats, found: Floats
) -> None:
    """Least, largest and the bound on the error of both, of the curve with these harmonics.

    `sums`, shape (6, M/4), and `curve`, shape (M + 2,), are scratch; `found` gets three numbers.
    """
    quarter = table.cosine.shape[1]
    even_cosine, even_sine, odd_cosine, odd_sine, top, bottom = (
        sums[0], sums[1], sums[2], sums[3], sums[4], sums[5],
    )  # fmt: skip
    sums[:4] = 0.0
    error = 0.0
    for order in range(real.size):
        a, b = real[order], -imaginary[order]
        error += table.bend[order] * math.sqrt(a * a + b * b)
        line = table.line[order]
        cosine, sine = table.cosine[line], table.sine[line]
        if line < table.even:
            for p in range(quarter):
                even_cosine[p] += a * cosine[p]
                even_sine[p] += b * sine[p]
        else:
            for p in range(quarter):
                odd_cosine[p] += a * cosine[p]
                odd_sine[p] += b * sine[p]
    # Samples from psi on, after a place for the last one and before one for the first.
    for p in range(quarter):
        one, other = even_cosine[p] + odd_cosine[p], even_sine[p] + odd_sine[p]
        back, forth = even_cosine[p] - odd_cosine[p], even_sine[p] - odd_sine[p]
        curve[1 + p] = one + other
        curve[2 * quarter - p] = back - forth
        curve[1 + 2 * quarter + p] = back + forth
        curve[4 * quarter - p] = one - other
    curve[0], curve[4 * quarter + 1] = curve[4 * quarter], curve[1]
    for p in range(quarter):
        top[p] = bottom[p] = curve[1 + p]
    for part in range(4):
        for p in range(quarter):
            i = 1 + part * quarter + p
            slope = curve[i + 1] - curve[i - 1]
            bend = 2.0 * curve[i] - curve[i - 1] - curve[i + 1]
            inside = abs(slope) < abs(bend)
            value = curve[i] + (slope * slope / (8.0 * bend) if inside else 0.0)
            top[p] = value if value > top[p] else top[p]
            bottom[p] = value if value < bottom[p] else bottom[p]
    least, most = bottom[0], top[0]
    for p in range(1, quarter):
        most = top[p] if top[p] > most else most
        least = bottom[p] if bottom[p] < least else least
    known = error == error
    found[0] = least if known else math.nan
    found[1] = most if known else math.nan
    found[2] = error


def least_torque(mean: Any, lowest: Any, highest: Any) -> Any:
    """Least of the whole torque over the cycle [N m], in the direction of its mean.

    Below 0 a coupling or a mesh reverses. `mean` as of `system.mean_torques`, `lowest` and
    `highest` as in "torque_extremes".
    """
    steady = np.asarray(mean)
    return np.abs(steady) + np.where(steady < 0.0, -np.asarray(highest), lowest)


def half_range(extremes: Any) -> Any:
    """Half of the range, (largest - least)/2, of extremes along the last axis."""
    values = np.asarray(extremes)
    return 0.5 * (values[..., 1] - values[..., 0])
