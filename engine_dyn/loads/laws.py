"""How load or driver depend on the speed within the cycle: F(q), q = (omega/omega_n)^2.

F is the torque over its value at the nominal speed. Of a + k omega^alpha it is q^(alpha/2); of a
table or a motor it is T(omega_n sqrt q)/T(omega_n), with kappa of `newton` positive for a load and
negative for a driver: the equation is the same.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from engine_dyn.compilation import inlined
from engine_dyn.loads.piecewise_cubic import piece_at
from engine_dyn.types import Floats

__all__ = [
    "FLOOR",
    "Power",
    "Shape",
    "half_of",
    "is_shape",
    "load_terms",
    "shape_at",
]


FLOOR = 1e-6
"""Below this (omega/omega_n)^2, powers are continued by their tangents, so that an iterate may pass
through where the solution can not be; a solution below it is a stall."""


class Power(NamedTuple):
    """F = q^half, half = alpha/2.

    Laws are told apart by their length, which the compiler knows: it leaves out what a law is not,
    and engines without a table or a motor pay nothing for these.
    """

    half: float


class Shape(NamedTuple):
    """F = T(omega_n sqrt q)/T(omega_n) of a table, or of a motor where the table is empty.

    `nominal` is omega_n [rad/s] and `scale` is 1/T(omega_n); `synchronous` [rad/s] and `slip` are
    those of `driven_machine.motor_torque`, `table` has speed, torque and slope.
    """

    nominal: float
    scale: float
    synchronous: float
    slip: float
    table: Floats


@inlined
def is_shape(law: Power | Shape) -> bool:
    """Whether a law is no power of the speed."""
    return len(law) > 1


@inlined
def half_of(law: Power | Shape) -> float:
    """alpha/2; 1 for what is no power: that of q, which rises with the speed."""
    if len(law) == 1:
        return law.half
    return 1.0


@inlined
def shape_at(omega: float, law: Shape) -> tuple[float, float, float]:
    """Torque of a table or a motor at a speed, and its first two derivatives.

    A table goes on straight beyond its ends, for iterates; a solution there is refused.
    """
    if law.table.shape[1] == 0:
        s, b = 1.0 - omega / law.synchronous, law.slip
        below = 1.0 / (s * s + b * b)
        value = 2.0 * s * b * below
        # d/ds of 2 s b/(s^2 + b^2), once and twice; ds/domega = -1/omega_s
        first = 2.0 * b * (b * b - s * s) * below * below
        second = 4.0 * b * s * (s * s - 3.0 * b * b) * below * below * below
        return value, -first / law.synchronous, second / law.synchronous**2
    speeds, torques, slopes = law.table[0], law.table[1], law.table[2]
    last = speeds.size - 1
    if omega <= speeds[0]:
        return torques[0] + slopes[0] * (omega - speeds[0]), slopes[0], 0.0
    if omega >= speeds[last]:
        return torques[last] + slopes[last] * (omega - speeds[last]), slopes[last], 0.0
    _, step, t, y0, m0, c, d = piece_at(omega, speeds, torques, slopes)
    return (
        y0 + t * (m0 + t * (c + t * d)),
        (m0 + t * (2.0 * c + 3.0 * t * d)) / step,
        (2.0 * c + 6.0 * t * d) / (step * step),
    )


@inlined
def _terms_of_shape(q: float, law: Shape) -> tuple[float, float, float]:
    """F and its first two derivatives of a table or a motor."""
    base = max(q, FLOOR)
    omega = law.nominal * math.sqrt(base)
    value, first, second = shape_at(omega, law)
    rate = 0.5 * omega / base
    value *= law.scale
    slope = law.scale * first * rate
    if q < FLOOR:
        return value + slope * (q - FLOOR), slope, 0.0
    return value, slope, law.scale * (second * rate * rate - 0.5 * first * rate / base)


@inlined
def load_terms(q: float, law: Power | Shape) -> tuple[float, float, float]:
    """F and its first two derivatives, continued by the tangent below `FLOOR`."""
    if len(law) > 1:
        return _terms_of_shape(q, law)
    half = law.half
    if half == 0.0:
        return 1.0, 0.0, 0.0
    base = max(q, FLOOR)
    if half == 1.0:
        value = base
    elif half == 0.5:
        value = math.sqrt(base)
    else:
        value = base**half
    first = half * value / base
    if q < FLOOR:
        return value + first * (q - FLOOR), first, 0.0
    return value, first, (half - 1.0) * first / base
