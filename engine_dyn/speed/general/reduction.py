"""From the inputs of a design to the few numbers of its equation: docs/method.md chapter 7.

The numbers are those of docs/method.md (22), (42) and (44); the outcomes that they decide at once
are found here too.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from engine_dyn.compilation import inlined
from engine_dyn.loads.laws import Form, Law, is_power, make_law
from engine_dyn.speed.arguments import Choice
from engine_dyn.speed.fields import (
    BORE,
    DOUBLE_RADIUS,
    EXPONENT,
    FIRST_OF_LAWS,
    INERTIA,
    MASS,
    MEAN_TORQUE,
    OFFSET,
    SPEED,
)
from engine_dyn.speed.methods import CLOSED
from engine_dyn.speed.results import IDLE
from engine_dyn.speed.tables.lookup import Ranges
from engine_dyn.speed.tables.work_tables import SHAPE, TORQUE
from engine_dyn.status import CONVERGED, INVALID_INPUT, NO_STEADY_STATE
from engine_dyn.types import Floats, Integers

__all__ = ["Design", "reduce"]


class Design(NamedTuple):
    """Reduced parameters of one design: g, eta, kappa and the law; `nominal` is a speed [rad/s].

    docs/method.md (22), (42) and (44).
    """

    gas: float
    eta: float
    kappa: float
    law: Law
    nominal: float


@inlined
def reduce(
    values: Floats, at: Integers, choice: Choice, form: Form, table: Floats, ranges: Ranges,
) -> tuple[Design, int]:  # fmt: skip
    """Reduced parameters of the design whose inputs lie at `at`, and its outcome so far.

    docs/method.md (22), (42), (44), and (60) for idle.
    """
    radius = 0.5 * values[at[DOUBLE_RADIUS]]
    lever = 0.25 * math.pi * values[at[BORE]] ** 2 * radius
    moving = values[at[MASS]] * radius * radius  # m r^2
    speed = values[at[SPEED]]
    inertia = values[at[INERTIA]]
    energy = 0.5 * inertia * speed * speed
    surplus = values[at[MEAN_TORQUE]] - values[at[OFFSET]]
    code = CONVERGED
    solved_as = values[at[EXPONENT]] if choice.kind != 0 else 0.0
    law, sign = make_law(speed, solved_as, values, at[FIRST_OF_LAWS:], form)
    # Idle, docs/method.md (60): the sum of the ranges of gas and masses is an upper bound of the
    # torque's range and nearly always decides.
    moment = moving * speed * speed
    swing = lever * ranges.gas + moment * ranges.shape
    if abs(surplus) <= IDLE * swing:
        high, low = -math.inf, math.inf
        for j in range(table.shape[1]):
            torque = lever * table[TORQUE, j] + moment * table[SHAPE, j]
            high = max(high, torque)
            low = min(low, torque)
        swing = high - low
    if abs(surplus) <= IDLE * swing:
        surplus = 0.0
    elif not (surplus * sign > 0.0):
        code = NO_STEADY_STATE
    if sign == 0.0:
        code = NO_STEADY_STATE
    elif math.isnan(sign):
        code = INVALID_INPUT
    if choice.variable and 1.0 + moving / inertia * ranges.least_square <= 0.0:
        code = INVALID_INPUT
    exponent = values[at[EXPONENT]]
    closed = is_power(law) and (exponent == 0.0 or exponent == 2.0)
    if choice.method == CLOSED and not closed:
        code = INVALID_INPUT
    return Design(lever / energy, moving / inertia, surplus / energy, law, speed), code
