r"""Extremes over the cycle of a sum of orders, between samples.

The curve Re sum_nu Q_nu exp(i nu phi) repeats after the cycle; order nu is harmonic h = nu
period/(2 pi) of it. It is sampled at M equally spaced angles. Of the quarter psi = (p + 1/2) 2
pi/M, p = 0 .. M/4 - 1, the cosines and sines of even and of odd harmonics give four sums E_c, E_s,
O_c, O_s, and these give four samples each:

    x(psi)      = E_c + O_c + E_s + O_s        x(-psi)     = E_c + O_c - E_s - O_s
    x(pi + psi) = E_c - O_c + E_s - O_s        x(pi - psi) = E_c - O_c - E_s + O_s

Near the largest and the least sample the polynomial through a sample and its four neighbours is
looked at within half a step. It misses the curve by at most max|x'''''| d^5 0.0118, d = 2 pi/M the
step, and |x'''''| <= sum h^5 |Q|. M is the least of some numbers for which this bound is `BEND`
of the root mean square of the curve, which is no more than half its range. Orders that are less
than `NOTHING` of it do not enter. Both bounds are returned, as one.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from engine_dyn.compilation import inlined
from engine_dyn.types import Booleans, Floats, Integers

BEND, NOTHING = 3e-4, 2e-5
"""Bound on the error of the polynomials, and amplitude of an order that is left out, over the
root mean square of the curve."""

MISSED = 1.5 * 1.5 * 2.5 * 0.5 * 0.5 / 120.0
"""Error of the polynomial half a step from a sample, over d^5 times the fifth derivative."""

LOW = 32
"""Samples of a block: cosines come from a table within it, and are rotated from block to block."""


class Synthesis(NamedTuple):
    """Tables for samples of curves with these orders; G numbers of samples are to choose from."""

    even: Booleans  # Whether the harmonic of an order is even; shape (V,)
    harmonic: Floats  # Harmonic h of each order, a whole number; shape (V,)
    quarters: Integers  # Number of samples in a quarter of the cycle, M/4; shape (G,)
    # Cosine and sine of h psi at the samples psi of the first block, of `LOW` samples; shape (G, V,
    # LOW)
    cosine: Floats
    sine: Floats
    turn: Floats  # Cosine and sine of h times the angle of a block; shape (G, V, 2)


def synthesis(orders: Floats, period: float) -> Synthesis:
    """Tables for these orders; each must have whole periods in the cycle, `period` [rad]."""
    harmonic = orders * (period / (2.0 * math.pi))
    whole = np.rint(harmonic)
    if orders.size and np.abs(harmonic - whole).max() > 1e-9 * whole.max():
        wrong = orders[np.abs(harmonic - whole) > 1e-9 * whole.max()][0]
        raise ValueError(f"orders: {wrong:g}: must have whole periods in the cycle")
    # Sixteen samples a period of the highest order always keep the error of the polynomials between
    # samples below the bound `BEND`.
    most = math.ceil(16 * whole.max(initial=1.0) / (4.0 * LOW))
    doubled = 2 ** np.arange(math.ceil(math.log2(max(most, 2))))
    quarters = LOW * np.unique(np.concatenate([[1], 2 * doubled, 3 * doubled]))
    turns = whole[None, :, None] * (0.5 * math.pi / quarters[:, None, None])
    angle = turns * (np.arange(LOW) + 0.5)
    turn = np.concatenate([np.cos(LOW * turns), np.sin(LOW * turns)], axis=-1)
    return Synthesis(whole % 2.0 == 0.0, whole, quarters, np.cos(angle), np.sin(angle), turn)


@inlined
def extremes_of(
    real: Floats, imaginary: Floats, table: Synthesis, size: Floats, weight: Floats, sums: Floats,
    extremes: Floats,
) -> None:  # fmt: skip
    """Least, largest and the bound on the error of both, of the curve with these harmonics.

    `size` and `weight`, shape (V,), and `sums`, shape (6, M/4), are scratch for the largest M;
    `extremes` gets three numbers.
    """
    square = 0.0
    for order in range(real.size):
        size[order] = math.sqrt(real[order] ** 2 + imaginary[order] ** 2)
    for order in range(real.size):
        square += size[order] ** 2
    effective = math.sqrt(0.5 * square)
    bend, curved, dropped, least = 0.0, 0.0, 0.0, NOTHING * effective
    for order in range(real.size):
        # Between once and twice `least` an order fades in, so that results have no steps.
        part = min(max(size[order] - least, 0.0) / least, 1.0) if least > 0.0 else 0.0
        dropped += (1.0 - part) * size[order]
        square_of_h = table.harmonic[order] ** 2
        curved += square_of_h * size[order]
        bend += square_of_h * square_of_h * table.harmonic[order] * size[order]
        weight[order] = part
    grid, most = 0, (MISSED * bend / (BEND * effective)) ** 0.2 if effective > 0.0 else 0.0
    while 0.5 * math.pi * most > table.quarters[grid] and grid + 1 < table.quarters.size:
        grid += 1
    quarter = table.quarters[grid]
    step = 0.5 * math.pi / quarter
    _sample(real, imaginary, table, grid, weight, sums)
    even_cosine, even_sine, odd_cosine, odd_sine, top, bottom = (
        sums[0], sums[1], sums[2], sums[3], sums[4], sums[5],
    )  # fmt: skip
    for p in range(quarter):
        one, other = even_cosine[p] + odd_cosine[p], abs(even_sine[p] + odd_sine[p])
        back, forth = even_cosine[p] - odd_cosine[p], abs(even_sine[p] - odd_sine[p])
        high, low, beyond, below = one + other, one - other, back + forth, back - forth
        top[p] = beyond if beyond > high else high
        bottom[p] = below if below < low else low
    least, most = bottom[0], top[0]
    for p in range(1, quarter):
        most = top[p] if top[p] > most else most
        least = bottom[p] if bottom[p] < least else least
    # An extreme is at most half a step from a sample, and exceeds it by no more than this.
    lift = 0.125 * curved * step**2
    low, high = least + lift, most - lift
    for p in range(quarter):
        if low < bottom[p] and top[p] < high:
            continue
        for place in (p, 2 * quarter - 1 - p, 2 * quarter + p, 4 * quarter - 1 - p):
            sample = _sample_at(sums, quarter, place)
            if not low < sample < high:
                value = _extreme_near(sums, quarter, place, sample)
                least, most = min(least, value), max(most, value)
    known = square == square
    extremes[0] = least if known else math.nan
    extremes[1] = most if known else math.nan
    extremes[2] = MISSED * bend * step**5 + dropped


@inlined
def _sample_at(sums: Floats, quarter: int, place: int) -> float:
    """The sample at a place of the cycle, from 0 to M - 1, or at most M beside."""
    half = 2 * quarter
    place += 2 * half if place < 0 else (-2 * half if place >= 2 * half else 0)
    turned, psi = (1.0, place) if place < half else (-1.0, place - half)
    if psi < quarter:
        return sums[0, psi] + sums[1, psi] + turned * (sums[2, psi] + sums[3, psi])
    psi = 2 * quarter - 1 - psi
    return sums[0, psi] - sums[1, psi] - turned * (sums[2, psi] - sums[3, psi])


@inlined
def _extreme_near(sums: Floats, quarter: int, place: int, sample: float) -> float:
    """Extreme within half a step of a sample, of the polynomial through five; else the sample."""
    before, after = _sample_at(sums, quarter, place - 1), _sample_at(sums, quarter, place + 1)
    start, end = _sample_at(sums, quarter, place - 2), _sample_at(sums, quarter, place + 2)
    near, far = after - before, end - start
    beside, outer = after + before - 2.0 * sample, end + start - 2.0 * sample
    first, second = (8.0 * near - far) / 12.0, (16.0 * beside - outer) / 12.0
    third, fourth = 0.5 * far - near, outer - 4.0 * beside
    if not abs(first) < abs(second):
        return sample
    away = -first / second
    for _ in range(2):
        slope = first + away * (second + away * (third / 2.0 + away * fourth / 6.0))
        rise = second + away * (third + away * fourth / 2.0)
        away -= slope / rise if rise != 0.0 else 0.0
    if not abs(away) < 0.6:
        return sample
    return sample + away * (
        first + away * (second / 2.0 + away * (third / 6.0 + away * fourth / 24.0))
    )


@inlined
def _sample(
    real: Floats, imaginary: Floats, table: Synthesis, grid: int, weight: Floats, sums: Floats
) -> None:  # fmt: skip
    """Sums of cosines and sines over a quarter, for the orders that have a weight."""
    quarter = table.quarters[grid]
    for p in range(quarter):
        sums[0, p] = sums[1, p] = sums[2, p] = sums[3, p] = 0.0
    blocks = sums.reshape((sums.shape[0], -1, LOW))
    for order in range(real.size):
        if weight[order] == 0.0:
            continue
        first = 0 if table.even[order] else 2
        cosine, sine = table.cosine[grid, order], table.sine[grid, order]
        turn_cosine, turn_sine = table.turn[grid, order, 0], table.turn[grid, order, 1]
        a, b = weight[order] * real[order], -weight[order] * imaginary[order]
        c, s = 1.0, 0.0
        for block in range(quarter // LOW):
            of_cosine, of_sine = blocks[first, block], blocks[first + 1, block]
            p_cosine, p_sine, q_cosine, q_sine = a * c, a * s, b * s, b * c
            for i in range(LOW):
                of_cosine[i] += p_cosine * cosine[i] - p_sine * sine[i]
                of_sine[i] += q_cosine * cosine[i] + q_sine * sine[i]
            c, s = c * turn_cosine - s * turn_sine, s * turn_cosine + c * turn_sine


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
