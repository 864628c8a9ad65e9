"""Extreme and mean speeds of a solution, and an estimate of their error.

docs/method.md chapter 12 on extrema and docs/method.md chapter 13 on the error.
"""

from __future__ import annotations

import math

from engine_dyn.compilation import inlined
from engine_dyn.loads.laws import FLOOR, Law, is_power
from engine_dyn.speed.arguments import Choice
from engine_dyn.speed.general.newton import closure_terms
from engine_dyn.speed.general.periodic import STRONG_LOAD
from engine_dyn.speed.general.reduction import Design
from engine_dyn.speed.general.scratch import Scratch
from engine_dyn.speed.general.segments import (
    POWERS,
    RECORD,
    SEGMENTS,
    Q,
    extremes_at_nodes,
    place_of,
)
from engine_dyn.speed.results import CANCELLED, ROUNDING
from engine_dyn.speed.tables.extremes import interpolate, refine
from engine_dyn.speed.tables.work_tables import (
    GAS_TORQUE,
    GAS_WORK_MIDDLE,
    GAS_WORK_TILT,
    QUINTIC,
    SQUARE,
    SQUARE_MIDDLE,
    SQUARE_SLOPE,
    SQUARE_TILT,
)
from engine_dyn.types import Floats

__all__ = [
    "acts",
    "extreme_of_speed",
    "highest_extremum",
    "load_missed",
    "slope_at",
    "speeds_of",
    "unresolved",
]


@inlined
def slope_at(
    j: int, design: Design, mu: float, variable: bool, table: Floats, records: Floats
) -> tuple[float, float]:
    """Return q and its exact slope at a node, docs/method.md (89)."""
    here = place_of(j, table.shape[1] // SEGMENTS)
    q = records[here + Q]
    slope = design.gas * table[GAS_TORQUE, j] - design.kappa * (records[here + POWERS] / mu - 1.0)
    turn = design.eta * table[SQUARE_SLOPE, j]
    if variable:
        return q, (slope - q * turn) / (1.0 + design.eta * table[SQUARE, j])
    return q, slope - turn


@inlined
def extreme_of_speed(
    node: int, upward: float, design: Design, mu: float, width: float, variable: bool,
    table: Floats, records: Floats,
) -> tuple[float, float]:  # fmt: skip
    """Extreme of q near its largest (upward = 1) or smallest (-1) node, and a bound of its error.

    docs/method.md (92) is the middle of q. The bound is Delta of docs/method.md (93): the
    correction by the middle, and the largest value of what comes after it.
    """
    nodes = table.shape[1]
    q, here = slope_at(node, design, mu, variable, table, records)
    ahead = here * upward > 0.0
    left = node if ahead else (node - 1 if node > 0 else nodes - 1)
    right = left + 1 if left + 1 < nodes else 0
    q_left, d_left = slope_at(left, design, mu, variable, table, records)
    q_right, d_right = slope_at(right, design, mu, variable, table, records)
    d_left *= width
    d_right *= width
    if not (d_left * upward > 0.0 and d_right * upward < 0.0):
        # Beside an extreme node the slope changes its sign, unless the nodes do not resolve it.
        return q, abs(here) * width
    if variable:
        # docs/method.md (92): the middle of q from those of energy and inertia, which are known.
        tau_left = 1.0 + design.eta * table[SQUARE, left]
        tau_right = 1.0 + design.eta * table[SQUARE, right]
        turn_left = design.eta * table[SQUARE_SLOPE, left] * width
        turn_right = design.eta * table[SQUARE_SLOPE, right] * width
        energy = design.gas * table[GAS_WORK_MIDDLE, left] + interpolate(
            0.5, q_left * tau_left, q_right * tau_right,
            d_left * tau_left + q_left * turn_left, d_right * tau_right + q_right * turn_right,
        )  # fmt: skip
        tau = design.eta * table[SQUARE_MIDDLE, left] + interpolate(
            0.5, tau_left, tau_right, turn_left, turn_right
        )
        middle = energy / tau - interpolate(0.5, q_left, q_right, d_left, d_right)
    else:
        middle = design.gas * table[GAS_WORK_MIDDLE, left] - design.eta * table[SQUARE_MIDDLE, left]
    value, _, bump = refine(q_left, q_right, d_left, d_right, middle)
    beyond = design.gas * abs(table[GAS_WORK_TILT, left])
    beyond += design.eta * abs(table[SQUARE_TILT, left])
    tau = min(tau_left, tau_right) if variable else 1.0
    # docs/method.md (55): twice QUINTIC is the largest value of the quintic.
    return value, abs(bump) + 2.0 * QUINTIC * beyond / tau


@inlined
def highest_extremum(
    node: int, upward: float, design: Design, mu: float, width: float, variable: bool,
    table: Floats, records: Floats,
) -> tuple[float, float]:  # fmt: skip
    """Largest (upward = 1) or smallest (-1) q of the curve, and a bound of its error.

    `node` is the extreme one. Another local extremum may be higher between its nodes, even one that
    no node shows. A local extremum rises above a node beside it by less than the slope of that node
    times the width of the interval, which is about the largest step between nodes at most.
    docs/method.md chapter 12.
    """
    best, miss = extreme_of_speed(node, upward, design, mu, width, variable, table, records)
    nodes = table.shape[1]
    rows = nodes // SEGMENTS
    before = upward * records[place_of(nodes - 1, rows) + Q]
    reach = 0.0
    for j in range(nodes):
        here = upward * records[place_of(j, rows) + Q]
        reach = max(reach, abs(here - before))
        before = here
    here = upward * records[place_of(0, rows) + Q]
    for j in range(nodes):
        after = upward * records[place_of(j + 1 if j + 1 < nodes else 0, rows) + Q]
        if here + 2.0 * reach > upward * best and j != node:
            _, slope = slope_at(j, design, mu, variable, table, records)
            rising = slope * upward > 0.0 or (here >= before and here > after)
            if rising and here + abs(slope) * width > upward * best:
                value, its_miss = extreme_of_speed(
                    j, upward, design, mu, width, variable, table, records
                )
                if upward * value > upward * best:
                    best, miss = value, its_miss
        before, here = here, after
    return best, miss


@inlined
def unresolved(law: Law, closure: int, records: Floats) -> float:
    """Relative difference of the means over even and odd nodes, of the speed and of the closure.

    docs/method.md (94).
    """
    rows = records.size // RECORD - 1
    nodes = rows * SEGMENTS
    speed = closed = both = 0.0
    for j in range(nodes):
        q = records[place_of(j, rows) + Q]
        sign = 1.0 if j % 2 == 0 else -1.0
        root = math.sqrt(max(q, 0.0))
        value, _ = closure_terms(q, law, closure)
        both += root
        speed += sign * root
        closed += sign * value
    return abs(speed) / both + abs(closed) / nodes


@inlined
def load_missed(kappa: float, mu: float, width: float, records: Floats) -> float:
    """Error of the two-point formula in q, by third differences of the load's rate.

    The numerator of docs/method.md (95). The rate is kappa (F/mu - 1). The local errors, h^5/720
    times its fourth derivative, add up to h^4/720 times the third, and the cubic through the nodes
    misses h^4/384 times the third in the middle of an interval. The factor 8 is there because near
    a stall differences are too small.
    """
    rows = records.size // RECORD - 1
    nodes = rows * SEGMENTS
    a = records[place_of(nodes - 3, rows) + POWERS]
    b = records[place_of(nodes - 2, rows) + POWERS]
    c = records[place_of(nodes - 1, rows) + POWERS]
    largest = 0.0
    for j in range(nodes):
        d = records[place_of(j, rows) + POWERS]
        largest = max(largest, abs(d - 3.0 * (c - b) - a))
        a, b, c = b, c, d
    return 8.0 * (1.0 / 720.0 + 1.0 / 384.0) * width * abs(kappa) / mu * largest


@inlined
def acts(design: Design, table: Floats) -> bool:
    """Whether any work is done within the period, so that the speed cannot be constant."""
    total = 0.0
    for j in range(table.shape[1]):
        total += design.gas * abs(table[GAS_TORQUE, j])
        total += design.eta * abs(table[SQUARE_SLOPE, j])
    return total > 0.0


@inlined
def speeds_of(
    design: Design, mu: float, width: float, choice: Choice, segments: int, table: Floats,
    scratch: Scratch,
) -> tuple[float, float, float, float]:  # fmt: skip
    """Largest, smallest and mean speed [rad/s], and the estimated relative error of delta.

    docs/method.md (93) and (96). The estimate is that of the smallest speed, where it is larger:
    near a stall that speed is far less than the range, and its error may be as large. It is 1 where
    the fluctuation is less than rounding. All are NaN where the smallest q is not above FLOOR.
    """
    records = scratch.records
    top, bottom, mean = extremes_at_nodes(segments, records, scratch.running)
    variable = choice.variable
    high, high_miss = highest_extremum(top, 1.0, design, mu, width, variable, table, records)
    low, low_miss = highest_extremum(bottom, -1.0, design, mu, width, variable, table, records)
    if not (low > FLOOR):
        return math.nan, math.nan, math.nan, math.nan
    span = high - low
    high, low = math.sqrt(high), math.sqrt(low)
    error = 0.0
    if high > low:
        rounding = ROUNDING * (1.0 + CANCELLED * design.eta)
        error = (0.5 * (high_miss / high + low_miss / low) + rounding / low) / (high - low)
    elif acts(design, table):
        error = 1.0  # the fluctuation is below rounding, so 0 misses all of it
    error += unresolved(design.law, choice.closure, records)
    strong = abs(design.kappa) * width > STRONG_LOAD or not is_power(design.law)
    if strong and span > 0.0:
        error += load_missed(design.kappa, mu, width, records) / span
    error *= max(1.0, (high - low) / low)
    return design.nominal * high, design.nominal * low, design.nominal * mean, error
