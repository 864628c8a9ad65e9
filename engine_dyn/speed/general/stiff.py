"""Strong loads that grow with the square of the speed, constant inertia: exact between nodes too.

In z (symbols of `segments`) all digits of a strong load are lost: z follows the work
W = g P - eta V, which may be 1e10 times the kinetic energy, and q = 1 + W - z has no digits left.
The unknown is therefore y = q - 1 itself, docs/method.md (78):

    y' + kappa y = W',    where y has no mean because W' has none.

The method does not assume that z is smooth. W is the quartic through values, slopes and middles of
the table, and for the cubic W' the solution is known, so that it is exact however much the load
decays over an interval. The slope of y obeys the same equation with W'', so it is not a difference
of nearly equal numbers. The solution is written as a table of its own, that of a speed whose work
is y, without load.
"""

from __future__ import annotations

import math

from engine_dyn.compilation import inlined
from engine_dyn.speed.general.segments import POWERS, SEGMENTS, Q, place_of
from engine_dyn.speed.tables.extremes import interpolate
from engine_dyn.speed.tables.work_tables import (
    GAS_TORQUE,
    GAS_WORK,
    GAS_WORK_MIDDLE,
    GAS_WORK_TILT,
    QUINTIC,
    SQUARE,
    SQUARE_MIDDLE,
    SQUARE_SLOPE,
    SQUARE_TILT,
)
from engine_dyn.types import Floats

__all__ = ["follow_work"]


DEEP = 20
"""Order at which the backward recurrence starts where x < 1; the error of its start vanishes."""


@inlined
def _moments(x: float) -> tuple[float, float, float, float]:
    """Integrals of exp(-x (1 - t)) t^k over [0, 1] for k = 0 to 3.

    docs/method.md (80): x m_k = 1 - k m_(k-1), taken backwards for small x, forwards for large.
    """
    if x < 1.0:
        last = 1.0 / (DEEP + 1.0)
        for k in range(DEEP, 3, -1):
            last = (1.0 - x * last) / k
        third = last
        second = (1.0 - x * third) / 3.0
        first = 0.5 * (1.0 - x * second)
        return 1.0 - x * first, first, second, third
    none = -math.expm1(-x) / x
    first = (1.0 - none) / x
    second = (1.0 - 2.0 * first) / x
    return none, first, second, (1.0 - 3.0 * second) / x


@inlined
def _slope_of_work(
    j: int, width: float, gas: float, eta: float, table: Floats
) -> tuple[float, float, float, float]:
    """Coefficients of W' in t, from 0 to 1 over the interval after node j, times the width.

    docs/method.md (79).
    """
    after = j + 1 if j + 1 < table.shape[1] else 0
    rise = gas * (table[GAS_WORK, after] - table[GAS_WORK, j])
    rise -= eta * (table[SQUARE, after] - table[SQUARE, j])
    left = width * (gas * table[GAS_TORQUE, j] - eta * table[SQUARE_SLOPE, j])
    right = width * (gas * table[GAS_TORQUE, after] - eta * table[SQUARE_SLOPE, after])
    middle = gas * table[GAS_WORK_MIDDLE, j] - eta * table[SQUARE_MIDDLE, j]
    square = 3.0 * rise - 2.0 * left - right
    cube = left + right - 2.0 * rise
    return left, 2.0 * square + 32.0 * middle, 3.0 * cube - 96.0 * middle, 64.0 * middle


@inlined
def follow_work(
    width: float, gas: float, eta: float, kappa: float, table: Floats, solved: Floats,
    records: Floats,
) -> None:  # fmt: skip
    """Solve for y, docs/method.md (81) and (82).

    The records get q at the nodes; `solved` gets values, slopes and middles of y. `solved` has the
    rows of a table, those of V zero. The tilt, of which only the size is used, includes what the
    quartic of W misses: if W' is off by at most T over the width, y is off by at most the lesser of
    T/x and of T times twice QUINTIC.
    """
    nodes = table.shape[1]
    rows = nodes // SEGMENTS
    x = kappa * width
    m0, m1, m2, m3 = _moments(x)
    h0, h1, h2, h3 = _moments(0.5 * x)
    damped = min(1.0, 0.5 / (QUINTIC * x))
    kept, kept_half, lost = math.exp(-x), math.exp(-0.5 * x), -math.expm1(-x * nodes)
    y = slope = 0.0
    for turn in range(2):
        if turn == 1:  # the start that closes the period
            y /= lost
            slope /= lost
        for j in range(nodes):
            c0, c1, c2, c3 = _slope_of_work(j, width, gas, eta, table)
            behind = kept * y + c0 * m0 + c1 * m1 + c2 * m2 + c3 * m3
            slope_behind = kept * slope + c1 * m0 + 2.0 * c2 * m1 + 3.0 * c3 * m2
            if turn == 1:
                middle = kept_half * y + (
                    0.5 * c0 * h0 + 0.25 * c1 * h1 + 0.125 * c2 * h2 + 0.0625 * c3 * h3
                )
                solved[GAS_WORK, j] = y
                solved[GAS_TORQUE, j] = slope / width
                solved[GAS_WORK_MIDDLE, j] = middle - interpolate(
                    0.5, y, behind, slope, slope_behind
                )
                rising = kept_half * slope + 0.5 * c1 * h0 + 0.5 * c2 * h1 + 0.375 * c3 * h2
                cubic = 1.5 * (behind - y) - 0.25 * (slope + slope_behind)
                missed = gas * abs(table[GAS_WORK_TILT, j]) + eta * abs(table[SQUARE_TILT, j])
                solved[GAS_WORK_TILT, j] = abs(rising - cubic) + damped * missed
                solved[SQUARE, j] = solved[SQUARE_SLOPE, j] = 0.0
                solved[SQUARE_MIDDLE, j] = solved[SQUARE_TILT, j] = 0.0
                here = place_of(j, rows)
                records[here + Q] = records[here + POWERS] = 1.0 + y
            y, slope = behind, slope_behind
