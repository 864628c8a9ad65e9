"""Laws over speed that are rational functions of it: docs/method.md (123) and (124).

An induction motor, and a load a + k (b omega + c omega^2), are with e = omega/omega_n - 1

    F - 1 = 2 a e (1 + n e)/(1 - m e + l e^2),

where a is F'(1), the slope over q = (1 + e)^2, which stands for alpha/2 of a power. Of a driver
both F - 1 and kappa have the other sign here, which leaves their product as it is, so that a and
kappa are positive wherever the speed is stable.
"""

from __future__ import annotations

import math

from engine_dyn.compilation import formula, inlined, wide_vectors
from engine_dyn.speed.batch.powers import root_remainder
from engine_dyn.speed.batch.state import (
    BREAKDOWN_SLIP,
    LANES,
    LAW_BEND,
    LAW_LINEAR,
    LAW_RISE,
    LAW_SLOPE,
    LAW_SQUARE,
    LAW_TWIST,
    LOAD_LINEAR,
    LOAD_SQUARE,
    SENSE,
    SPEED,
    SYNCHRONOUS_SPEED,
)
from engine_dyn.types import Floats

__all__ = [
    "fill_linear_square",
    "fill_motor",
    "fill_rational",
    "keeps_its_sense",
    "linear_square_numbers",
    "motor_numbers",
    "rational_remainder",
    "rational_slope",
    "remainder_over_speed",
    "slope_over_nominal",
    "terms_of_rational",
]


@formula
def motor_numbers(
    speed: float, synchronous: float, breakdown_slip: float
) -> tuple[float, float, float, float]:
    """Numbers a, n, m and l of an induction motor, from Kloss's formula, docs/method.md (40).

    They have no meaning at the synchronous speed, where there is no torque.
    """
    ratio = speed / synchronous
    slip = 1.0 - ratio
    least = abs(slip)
    squares = breakdown_slip * breakdown_slip + slip * slip
    less = breakdown_slip * breakdown_slip - slip * slip
    whole = squares * less * least
    inverse = 1.0 / (whole if whole != 0.0 else 1.0)
    of_squares = ratio * less * least * inverse
    return (
        0.5 * ratio * less * less * inverse,
        slip * ratio * squares * least * inverse,
        2.0 * slip * of_squares,
        ratio * of_squares,
    )


@formula
def linear_square_numbers(
    speed: float, linear: float, square: float
) -> tuple[float, float, float, float]:
    """Numbers a, n, m and l of a load k (b omega + c omega^2), docs/method.md (108)."""
    rising = square * speed
    # With w = b/(b + c omega_n), a is 1 - w/2 and n is (1 - w)/(2 - w).
    whole = (linear + rising) * (linear + 2.0 * rising)
    inverse = 1.0 / (whole if whole != 0.0 else 1.0)
    slope = 0.5 * inverse * (linear + 2.0 * rising) * (linear + 2.0 * rising)
    return slope, inverse * rising * (linear + rising), 0.0, 0.0


@formula
def terms_of_rational(n: float, m: float, square: float) -> tuple[float, float, float]:
    """Coefficients of u^2, u^3 and u^4 in (F - 1)/a, docs/method.md (124)."""
    second = n + m
    third = m * second - square
    fourth = m * third - square * second
    return (
        0.5 * second - 0.25,
        0.25 * (third - second) + 0.125,
        0.125 * fourth - 0.1875 * third + 0.15625 * second - 0.078125,
    )


@formula
def remainder_over_speed(e: float, k: int, law: Floats) -> float:
    """F - 1 - a u of the speed's e, from the coefficients of `fill_rational`.

    Nothing is subtracted that is nearly equal: e^2 is a factor of it.
    """
    divisor = 1.0 - e * (law[3 * LANES + k] - law[4 * LANES + k] * e)
    return e * e * (law[k] + e * (law[LANES + k] - e * law[2 * LANES + k])) / divisor


@formula
def rational_remainder(u: float, k: int, law: Floats) -> float:
    """F - 1 - a u for |u| up to SERIES_RANGE."""
    return remainder_over_speed(0.5 * u + root_remainder(u), k, law)


@formula
def slope_over_nominal(e: float, n: float, m: float, square: float) -> float:
    """F'(q)/F'(1)."""
    divisor = 1.0 - e * (m - square * e)
    return (1.0 + e * (2.0 * n - e * (square + n * m))) / (divisor * divisor * (1.0 + e))


@formula
def rational_slope(u: float, a: float, turning: float, k: int, law: Floats) -> float:
    """Slope F' - a tau of the remainder, `turning` is tau - 1; |u| up to SERIES_RANGE."""
    e = 0.5 * u + root_remainder(u)
    ratio = slope_over_nominal(e, law[5 * LANES + k], law[3 * LANES + k], law[4 * LANES + k])
    return a * (ratio - 1.0 - turning)


@formula
def fill_numbers(
    k: int, numbers: tuple[float, float, float, float], sense: float, state: Floats
) -> None:
    """Rows of one lane: its law, and the sign of the mean torque that it needs."""
    a, n, m, square = numbers
    b2, b3, _ = terms_of_rational(n, m, square)
    state[LAW_SLOPE + k] = a
    state[LAW_BEND + k] = 2.0 * b2
    state[LAW_TWIST + k] = 6.0 * b3
    state[LAW_RISE + k], state[LAW_LINEAR + k], state[LAW_SQUARE + k] = n, m, square
    state[SENSE + k] = sense


@inlined
def fill_motor(lanes: int, state: Floats) -> None:
    """Rows of the law of a motor, which drives below its synchronous speed and brakes above."""
    wide_vectors()
    for k in range(lanes):
        speed, synchronous = state[SPEED + k], state[SYNCHRONOUS_SPEED + k]
        sense = 1.0 if speed > synchronous else -1.0
        sense = 0.0 if speed == synchronous else sense
        numbers = motor_numbers(speed, synchronous, state[BREAKDOWN_SLIP + k])
        fill_numbers(k, numbers, sense, state)


@inlined
def fill_linear_square(lanes: int, state: Floats) -> None:
    """Rows of the law k (b omega + c omega^2)."""
    wide_vectors()
    for k in range(lanes):
        numbers = linear_square_numbers(
            state[SPEED + k], state[LOAD_LINEAR + k], state[LOAD_SQUARE + k]
        )
        fill_numbers(k, numbers, 1.0, state)


@inlined
def fill_rational(lanes: int, state: Floats, law: Floats) -> None:
    """Coefficients of `remainder_over_speed`, and behind them n, from the numbers of the state."""
    wide_vectors()
    for k in range(lanes):
        a, n = state[LAW_SLOPE + k], state[LAW_RISE + k]
        m, square = state[LAW_LINEAR + k], state[LAW_SQUARE + k]
        law[k] = a * (2.0 * (n + m) - 1.0)
        law[LANES + k] = a * (m - 2.0 * square)
        law[2 * LANES + k] = a * square
        law[3 * LANES + k] = m
        law[4 * LANES + k] = square
        law[5 * LANES + k] = n


@formula
def keeps_its_sense(low: float, high: float, k: int, state: Floats) -> bool:
    """Whether F' has the same sign from the smallest u to the largest.

    The numerator of `slope_over_nominal` has a maximum between its two zeros.
    """
    n, m, square = state[LAW_RISE + k], state[LAW_LINEAR + k], state[LAW_SQUARE + k]
    e, f = math.sqrt(max(1.0 + low, 0.0)) - 1.0, math.sqrt(max(1.0 + high, 0.0)) - 1.0
    curved = square + n * m
    return (1.0 + e * (2.0 * n - e * curved) > 0.0) & (1.0 + f * (2.0 * n - f * curved) > 0.0)
