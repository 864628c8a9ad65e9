"""Periodic speed of one design, by iteration of the load term, on segments that run side by side.

The reduced problem is docs/method.md (46) to (48): with g, eta and kappa of docs/method.md (42),
(22) and (44), and the work tables P and V,

    constant inertia:   q = 1 + c + g P - eta V - z,
    variable inertia:   q = (1 + c + g P - z)/(1 + eta V),
    z' = kappa (F/mu - 1),   F = q^(alpha/2),   mu = mean F,   mean z = 0,

where q = (omega/omega_n)^2. The right side has no mean, so every iterate is periodic by itself, and
c follows from the closure (power mean: mu = 1; cycle time: mean q^(-1/2) = 1). The work z of the
load is small, smooth and linear to leading order. With beta = kappa mean F', one pass of a scalar
recurrence solves z' + beta z = R by Obreshkov's two-point formula, docs/method.md (63) to (65); it
is of fourth order and A-stable. What is not linear converges by the factor of docs/method.md (70)
in each pass. Exponent 2 with constant inertia needs no iteration, and exponent 0 has z = 0: these
are the closed solutions.

The recurrence alone would be serial. It is linear, so all `SEGMENTS` pieces of the period start
from zero at once, and the starts that join them follow afterwards, docs/method.md (66). The memory
has one record for each row of nodes (node = segment * rows + row). All fields of a record lie at
known distances, so the compiler sees that they do not overlap, and the loops over segments become
vectors although there is only one design.
"""

from __future__ import annotations

import math

import numpy as np

from engine_dyn.compilation import by_type, inlined
from engine_dyn.loads.laws import FLOOR, Law, Power, half_of, load_terms
from engine_dyn.speed.methods import CYCLE_TIME
from engine_dyn.speed.tables.work_tables import GAS_TORQUE, GAS_WORK, SQUARE, SQUARE_SLOPE
from engine_dyn.types import Floats

__all__ = [
    "MOST_PASSES",
    "POWERS",
    "Q",
    "RECORD",
    "SEGMENTS",
    "extremes_at_nodes",
    "iterate",
    "make_records",
    "place_of",
    "solve_linear",
    "spread",
]


SEGMENTS = 16
"""Pieces of a period; its nodes are a multiple of them."""

MOST_PASSES = 24
"""Largest number of passes; Newton's method follows where they do not suffice."""

# Fields of a record, each of SEGMENTS numbers. There is one record more than rows: the last repeats
# the first, one segment later, so that every node finds its successor in the next record.
FIELDS = 12
P, DP, V, DV, Q, Z, POWERS, DERIVATIVE, RIGHT, RIGHT_SLOPE, INVERSE, SAFE = (
    field * SEGMENTS for field in range(FIELDS)
)
RECORD = FIELDS * SEGMENTS

# Running numbers, one of each for every segment.
Y, SUM, START, HIGH, LOW, HIGH_ROW, LOW_ROW, TOTAL, FIRST, SLOPE, SECOND, DRIFT, CHANGE, PRODUCT = (
    row * SEGMENTS for row in range(14)
)
RUNNING = 14 * SEGMENTS


def make_records(nodes: int) -> tuple[Floats, Floats]:
    """Memory for the records of a period and for the running numbers."""
    return np.zeros((nodes // SEGMENTS + 1) * RECORD), np.zeros(RUNNING)


@inlined
def place_of(node: int, rows: int) -> int:
    """Place of a node's first field among the records."""
    return (node % rows) * RECORD + node // rows


@inlined
def spread(table: Floats, records: Floats) -> None:
    """Copy the table of work and its slopes into the records."""
    nodes = table.shape[1]
    rows = nodes // SEGMENTS
    for row in range(rows + 1):
        for k in range(SEGMENTS):
            node = (k * rows + row) % nodes
            here = row * RECORD + k
            records[here + P] = table[GAS_WORK, node]
            records[here + DP] = table[GAS_TORQUE, node]
            records[here + V] = table[SQUARE, node]
            records[here + DV] = table[SQUARE_SLOPE, node]


@inlined
def two_point(rate: float, width: float) -> tuple[float, float, float, float]:
    """Weights of the two-point formula for y' + rate y = R over one interval.

    docs/method.md (63) to (65). Returned are the loss L of y, and the weights of R at the begin and
    at the end of the interval and of the difference of the slopes of R.
    """
    x = rate * width
    below = 1.0 + 0.5 * x + x * x / 12.0
    return (
        x / below,
        (0.5 * width - width * x / 12.0) / below,
        (0.5 * width + width * x / 12.0) / below,
        width * width / 12.0 / below,
    )


@inlined
def join(rows: int, loss: float, running: Floats) -> float:
    """Starts of the segments that join them and close the period, docs/method.md (66).

    Returns the mean over the nodes.
    """
    if not loss > 0.0:
        start = 0.0
        total = 0.0
        for k in range(SEGMENTS):
            running[START + k] = start
            total += running[SUM + k] + start * rows
            start += running[Y + k]
        return total / (rows * SEGMENTS)
    logarithm = math.log1p(-loss)
    kept = math.exp(rows * logarithm)
    end = 0.0
    for k in range(SEGMENTS):
        end = kept * end + running[Y + k]
    start = end / -math.expm1(rows * SEGMENTS * logarithm)
    # The sum over the nodes of a segment of what a start of 1 contributes.
    start_sum = -math.expm1(rows * logarithm) / loss
    total = 0.0
    for k in range(SEGMENTS):
        running[START + k] = start
        total += running[SUM + k] + start * start_sum
        start = kept * start + running[Y + k]
    return total / (rows * SEGMENTS)


@inlined
def solve_linear(
    width: float, gas: float, eta: float, kappa: float, segments: int, records: Floats,
    running: Floats,
) -> None:  # fmt: skip
    """Exponent 2, constant inertia, power mean: q at the nodes, in closed form; F is q.

    docs/method.md (61) and (62): z' + kappa z = kappa (g P - eta V) is linear with a constant
    coefficient, and its right side has no mean. `segments` is SEGMENTS, passed as a number that the
    compiler does not know, so that it makes SIMD loops instead of unrolling them.
    """
    rows = records.size // RECORD - 1
    loss, before, behind, cross = two_point(kappa, width)
    before *= kappa
    behind *= kappa
    cross *= kappa
    decay = 1.0 - loss
    for k in range(segments):
        running[Y + k] = 0.0
        running[SUM + k] = 0.0
    for row in range(rows):
        record = records[row * RECORD : (row + 2) * RECORD]
        for k in range(segments):
            y = running[Y + k]
            record[Z + k] = y
            running[SUM + k] += y
            running[Y + k] = (
                decay * y
                + before * (gas * record[P + k] - eta * record[V + k])
                + behind * (gas * record[RECORD + P + k] - eta * record[RECORD + V + k])
                + cross
                * (
                    gas * (record[DP + k] - record[RECORD + DP + k])
                    - eta * (record[DV + k] - record[RECORD + DV + k])
                )
            )
    mean = join(rows, loss, running)
    for row in range(rows):
        record = records[row * RECORD : (row + 1) * RECORD]
        for k in range(segments):
            start = running[START + k]
            running[START + k] = start * decay
            q = 1.0 + gas * record[P + k] - eta * record[V + k] - (record[Z + k] + start - mean)
            record[Q + k] = q
            record[POWERS + k] = q


@inlined
def powers_of(
    kind: int, law: Law, segments: int, record: Floats, sums: bool, running: Floats
) -> None:
    """F and dF/dq of one record, and its contribution to the sums of F - 1 and of dF/de.

    The record has q, at least FLOOR, in SAFE and 1/tau in INVERSE.
    """
    if kind == 0:
        for k in range(segments):
            record[POWERS + k] = 1.0
        return
    fill_law(kind, segments, record, law)
    if sums:
        for k in range(segments):
            running[FIRST + k] += record[POWERS + k] - 1.0
            running[SLOPE + k] += record[DERIVATIVE + k] * record[INVERSE + k]


@by_type
def fill_law(kind: int, segments: int, record: Floats, law: Law) -> None:
    """F and dF/dq of one record, at the q in SAFE; `kind` as in `Choice`."""
    for k in range(segments):
        value, first, _ = load_terms(record[SAFE + k], law)
        record[POWERS + k] = value
        record[DERIVATIVE + k] = first


@fill_law.of(Power)
def _fill_power(kind: int, segments: int, record: Floats, law: Power) -> None:
    """As `fill_law` for a power, in loops without branches, which become vectors."""
    if kind == 1:
        for k in range(segments):
            root = math.sqrt(record[SAFE + k])
            record[POWERS + k] = root
            record[DERIVATIVE + k] = 0.5 / root
    elif kind == 2:
        for k in range(segments):
            record[POWERS + k] = record[SAFE + k]
            record[DERIVATIVE + k] = 1.0
    else:
        half = half_of(law)
        for k in range(segments):
            record[POWERS + k] = record[SAFE + k] ** half
        for k in range(segments):
            record[DERIVATIVE + k] = half * record[POWERS + k] / record[SAFE + k]


@inlined
def closure_of(kind: int, closure: int, segments: int, record: Floats, running: Floats) -> None:
    """Contribution of one record to the closure's residual and its derivative.

    docs/method.md (58) for exponent 0, (59) for the cycle time; (57) follows from `powers_of`.
    """
    if closure == CYCLE_TIME:
        for k in range(segments):
            root = 1.0 / math.sqrt(record[SAFE + k])
            running[SECOND + k] += root - 1.0
            running[DRIFT + k] -= 0.5 * root * root * root * record[INVERSE + k]
    elif kind == 0:
        for k in range(segments):
            running[PRODUCT + k] *= record[SAFE + k]
            running[DRIFT + k] += record[INVERSE + k] / record[SAFE + k]


@inlined
def total_of(field: int, running: Floats) -> float:
    """Sum of a running number over the segments."""
    total = 0.0
    for k in range(SEGMENTS):
        total += running[field + k]
    return total


@inlined
def right_side(
    gas: float, eta: float, kappa: float, beta: float, mu: float, variable: bool, segments: int,
    record: Floats,
) -> None:  # fmt: skip
    """R = z' + beta z and its slope in one record, docs/method.md (48) and (69)."""
    scale = kappa / mu
    if variable:
        for k in range(segments):
            rate = scale * record[POWERS + k] - kappa
            slope = gas * record[DP + k] - rate - record[Q + k] * (eta * record[DV + k])
            record[RIGHT + k] = rate + beta * record[Z + k]
            record[RIGHT_SLOPE + k] = (
                scale * record[DERIVATIVE + k] * slope * record[INVERSE + k] + beta * rate
            )
    else:
        for k in range(segments):
            rate = scale * record[POWERS + k] - kappa
            slope = gas * record[DP + k] - rate - eta * record[DV + k]
            record[RIGHT + k] = rate + beta * record[Z + k]
            record[RIGHT_SLOPE + k] = scale * record[DERIVATIVE + k] * slope + beta * rate


# Longer than usual: the two halves of a pass have some twenty running sums in common. Functions of
# their own change the last bits, because the compiler may reorder sums within a function.
@inlined
def iterate(
    width: float, gas: float, eta: float, kappa: float, law: Law, kind: int,
    variable: bool, closure: int, tolerance: float, segments: int, records: Floats, running: Floats,
) -> tuple[int, float]:  # fmt: skip
    """Any exponent, either inertia model, either closure: q and F at the nodes, by iteration.

    docs/method.md (67) to (71). `kind` is the class of the exponent: 0, 1 and 2 for these
    exponents, 3 for any other, 4 for a law that is no power. `tolerance` is for q, relative to its
    range. Returns the number of passes and mu; the number is 0 where Newton's method has to follow.
    `segments` is as in `solve_linear`.
    """
    rows = records.size // RECORD - 1
    count = float(rows * SEGMENTS)
    c = mean = 0.0
    decay = mu = 1.0
    last, rate = math.inf, 0.0
    for row in range(rows + 1):
        record = records[row * RECORD : (row + 1) * RECORD]
        for k in range(segments):
            record[Z + k] = 0.0
            record[Q + k] = 1.0
            record[INVERSE + k] = 1.0
        if variable:
            for k in range(segments):
                record[INVERSE + k] = 1.0 / (1.0 + eta * record[V + k])
    for k in range(segments):
        running[START + k] = 0.0
    for number in range(1, MOST_PASSES + 1):
        # First half: z at the nodes from the recurrence, then q, F, and the means.
        for k in range(segments):
            running[FIRST + k] = 0.0
            running[SLOPE + k] = 0.0
            running[SECOND + k] = 0.0
            running[DRIFT + k] = 0.0
            running[CHANGE + k] = 0.0
            running[PRODUCT + k] = 1.0
            running[HIGH + k] = -1e300
            running[LOW + k] = 1e300
        for row in range(rows + 1):
            record = records[row * RECORD : (row + 1) * RECORD]
            for k in range(segments):
                start = running[START + k]
                running[START + k] = start * decay
                z = record[Z + k] + start - mean
                record[Z + k] = z
                record[SAFE + k] = 1.0 + c + gas * record[P + k] - z
            if variable:
                for k in range(segments):
                    record[SAFE + k] *= record[INVERSE + k]
            else:
                for k in range(segments):
                    record[SAFE + k] -= eta * record[V + k]
            for k in range(segments):
                new = record[SAFE + k]
                moved = abs(new - record[Q + k])
                record[Q + k] = new
                change, high, low = running[CHANGE + k], running[HIGH + k], running[LOW + k]
                running[CHANGE + k] = moved if moved > change else change
                running[HIGH + k] = new if new > high else high
                running[LOW + k] = new if new < low else low
                record[SAFE + k] = new if new > FLOOR else FLOOR
            powers_of(kind, law, segments, record, row < rows, running)
            if row < rows:
                closure_of(kind, closure, segments, record, running)
                if kind == 0 and closure != CYCLE_TIME and (row % 8 == 7 or row == rows - 1):
                    # The mean of log q takes one logarithm for eight nodes.
                    for k in range(segments):
                        running[SECOND + k] += math.log(running[PRODUCT + k])
                        running[PRODUCT + k] = 1.0
        change, high, low = 0.0, -1e300, 1e300
        for k in range(SEGMENTS):
            change = max(change, running[CHANGE + k])
            high = max(high, running[HIGH + k])
            low = min(low, running[LOW + k])
        if not (low > FLOOR and high < 1e3):
            # Outside the range of powers Newton's method follows, which also decides whether the
            # engine stalls.
            return 0, 1.0
        first, slope = total_of(FIRST, running), total_of(SLOPE, running)
        mu = 1.0 + first / count
        if closure == CYCLE_TIME or kind == 0:
            shift = -total_of(SECOND, running) / total_of(DRIFT, running)
        else:
            shift = -first / slope
        change = max(change, abs(shift))
        # docs/method.md (71): change * rate/(1 - rate) is what remains of a contraction. The first
        # change says nothing, because it is from the start. A slow component may hide behind a fast
        # one, so the worse of two rates counts.
        bound = tolerance * (high - low) + 4e-16
        if number > 1:
            worse = max(rate, change / last)
            rate = change / last
            assumed = min(worse, 0.99) if number > 2 else 0.99
            if change <= bound or change * assumed <= bound * (1.0 - assumed):
                return number, mu
        last = change
        c += shift  # docs/method.md (68)
        if kind == 0:
            continue
        # Second half: the recurrence of z' + beta z = R, docs/method.md (67).
        beta = kappa * slope / (count * mu)
        if not beta >= 0.0:  # the speed runs away, which the recurrence cannot follow
            return 0, 1.0
        loss, before, behind, cross = two_point(beta, width)
        decay = 1.0 - loss
        for k in range(segments):
            running[Y + k] = 0.0
            running[SUM + k] = 0.0
        right_side(gas, eta, kappa, beta, mu, variable, segments, records[:RECORD])
        for row in range(rows):
            record = records[row * RECORD : (row + 2) * RECORD]
            right_side(gas, eta, kappa, beta, mu, variable, segments, record[RECORD:])
            for k in range(segments):
                y = running[Y + k]
                record[Z + k] = y
                running[SUM + k] += y
                running[Y + k] = (
                    decay * y
                    + before * record[RIGHT + k]
                    + behind * record[RECORD + RIGHT + k]
                    + cross * (record[RIGHT_SLOPE + k] - record[RECORD + RIGHT_SLOPE + k])
                )
        record = records[rows * RECORD :]
        for k in range(segments):
            record[Z + k] = running[Y + k]
        mean = join(rows, loss, running)
    return 0, 1.0


@inlined
def extremes_at_nodes(segments: int, records: Floats, running: Floats) -> tuple[int, int, float]:
    """Nodes of the largest and the smallest q, and the mean of the speed over nominal."""
    rows = records.size // RECORD - 1
    for k in range(segments):
        running[HIGH + k] = -1e300
        running[LOW + k] = 1e300
        running[HIGH_ROW + k] = 0.0
        running[LOW_ROW + k] = 0.0
        running[TOTAL + k] = 0.0
    for row in range(rows):
        record = records[row * RECORD : (row + 1) * RECORD]
        number = float(row)
        for k in range(segments):
            q = record[Q + k]
            high, low = running[HIGH + k], running[LOW + k]
            running[HIGH_ROW + k] = number if q > high else running[HIGH_ROW + k]
            running[LOW_ROW + k] = number if q < low else running[LOW_ROW + k]
            running[HIGH + k] = q if q > high else high
            running[LOW + k] = q if q < low else low
            running[TOTAL + k] += math.sqrt(q if q > 0.0 else 0.0)
    top = bottom = 0
    for k in range(1, SEGMENTS):
        top = k if running[HIGH + k] > running[HIGH + top] else top
        bottom = k if running[LOW + k] < running[LOW + bottom] else bottom
    return (
        top * rows + int(running[HIGH_ROW + top]),
        bottom * rows + int(running[LOW_ROW + bottom]),
        total_of(TOTAL, running) / (rows * SEGMENTS),
    )
