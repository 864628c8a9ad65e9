"""How load or driver depend on the speed within the cycle: the registry of laws.

Every law gives F(q), q = (omega/omega_n)^2: the torque over its value at the nominal speed,
docs/method.md (35) and (39). For a + k omega^alpha it is q^(alpha/2); for a table or a motor it is
T(omega_n sqrt q)/T(omega_n). The number kappa of `engine_dyn.speed.general.newton` is positive for
a load and negative for a driver, and the equation is the same.

A law has two named tuples. Its *form* is what all designs of a sweep have in common (a table, or
nothing); the law itself belongs to one design. The compiler knows their types and takes the
functions that are registered here for them. Code of other laws is not compiled in, so designs
without a table or a motor pay nothing for these. To add a law is to add its facts to `LAWS`, its
two tuples, and `make_law` and `torque_at` for them; the other functions have a general case.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple

from engine_dyn.compilation import by_type, inlined
from engine_dyn.loads.piecewise_cubic import piece_at
from engine_dyn.types import Floats, Integers

__all__ = [
    "FLOOR",
    "CurveForm",
    "INPUTS",
    "LAWS",
    "LOAD_LAWS",
    "MOTOR_KEYS",
    "Form",
    "Law",
    "LawFacts",
    "Power",
    "PowerForm",
    "covers",
    "gear_of",
    "half_of",
    "is_power",
    "load_terms",
    "make_law",
    "torque_at",
]

FLOOR = 1e-6
"""Below this (omega/omega_n)^2, laws are continued by their tangents, docs/method.md (41), so that
an iterate may pass through values that a solution cannot have; a solution below it is a stall."""

ROUNDED = 1.0 + 1e-9
"""Factor by which rounding may place a speed beyond the ends of a table."""


class LawInput(NamedTuple):
    """An input of the kernels that belongs to laws over speed, see `engine_dyn.speed.fields`."""

    name: str
    unit: str
    meaning: str
    default: float
    quantity: str


INPUTS = (
    LawInput(
        "synchronous_speed", "rad/s", "synchronous speed of the driving motor", 1.0,
        "synchronous_speed",
    ),
    LawInput(
        "breakdown_slip", "1", "slip of the driving motor at its largest torque", 1.0,
        "motor_breakdown_slip",
    ),
    LawInput("load_linear", "N m s", "b of the load k (b omega + c omega^2)", 0.0, "load_linear"),
    LawInput("load_square", "N m s2", "c of the load k (b omega + c omega^2)", 0.0, "load_square"),
    LawInput("gear_ratio", "1", "speed of the load's shaft over the crank's", 1.0, "load_gear"),
)  # fmt: skip
"""Inputs of laws, in the order of their places; the exponent is an input of its own."""

SYNCHRONOUS_SPEED, BREAKDOWN_SLIP, LOAD_LINEAR, LOAD_SQUARE, GEAR_RATIO = range(len(INPUTS))


class PowerForm(NamedTuple):
    """The load over speed is a + k omega^alpha; the field has no meaning."""

    none: int


class CurveForm(NamedTuple):
    """A load (`sign` 1) or a driver (-1) over speed: speeds, torques and slopes of its table.

    The table is empty for an induction motor. `own` says that the table is over the speed of the
    load's own shaft, which is the gear ratio times the crank's.
    """

    sign: float
    own: bool
    table: Floats


class LinearSquareForm(NamedTuple):
    """The load over speed is a + k (b omega + c omega^2); the field has no meaning."""

    none: int


Form = PowerForm | CurveForm | LinearSquareForm


class Power(NamedTuple):
    """F = q^half with half = alpha/2, docs/method.md (35)."""

    half: float


class Curve(NamedTuple):
    """F = T(omega_n sqrt q)/T(omega_n) of a table, or of a motor where the table is empty.

    docs/method.md (39). `nominal` is omega_n [rad/s] and `scale` is 1/T(omega_n); `synchronous`
    [rad/s] and `slip` are those of `motor_torque`, `table` has speed, torque and slope.
    """

    nominal: float
    scale: float
    synchronous: float
    slip: float
    table: Floats


class LinearSquare(NamedTuple):
    """F = w q^(1/2) + (1 - w) q, w = b/(b + c omega_n): a brake or a fan with bearing losses.

    docs/method.md (108).
    """

    weight: float


Law = Power | Curve | LinearSquare


def linear_square_torque(speed: Any, load_linear: Any, load_square: Any) -> Any:
    """B omega + c omega^2 [N m] at a speed [rad/s]."""
    return speed * (load_linear + load_square * speed)


class LawFacts(NamedTuple):
    """What one law over speed is called, and what it needs.

    Attributes
    ----------
    name : str
        Word of the law among the variants of quantities.
    meaning : str
        One line, about the scenes that have it.
    needs : tuple of str
        Nodes of the graph of quantities that it takes of each design.
    keys : tuple of str
        Keys of scenes and engine files that choose it: any of them is enough. Empty where a table
        of its own chooses it.
    form : PowerForm or other, optional
        Form of a load's law that numbers alone give; None where a table or a motor gives it.
    torque : callable, optional
        Torque [N m] of such a law, from the speed [rad/s] and its needs, before the balance's
        factor k; None for a + k omega^alpha, whose k has a unit of its own.
    """

    name: str
    meaning: str
    needs: tuple[str, ...]
    keys: tuple[str, ...] = ()
    form: Form | None = None
    torque: Callable[..., Any] | None = None


MOTOR_KEYS = (
    "motor_synchronous_speed", "motor_breakdown_slip", "motor_breakdown_torque", "motor_slip",
    "motor_gear_ratio",
)  # fmt: skip
"""Any of them given, an induction motor drives."""

LAWS = (
    LawFacts(
        "power_law", "load torque a + k omega^alpha", ("load_exponent",), ("load_exponent",),
        PowerForm(0),
    ),
    LawFacts(
        "linear_square", "load torque a + k (b omega + c omega^2)", ("load_linear", "load_square"),
        ("load_linear", "load_square"), LinearSquareForm(0), linear_square_torque,
    ),
    LawFacts("table", "load or driver has a table over speed", ("load_gear",)),
    LawFacts(
        "motor", "an induction motor drives", ("synchronous_speed", "motor_breakdown_slip"),
        MOTOR_KEYS,
    ),
)  # fmt: skip
"""All laws of load and driver over speed."""

LOAD_LAWS = {law.name: law for law in LAWS if law.form is not None}
"""Laws of a load that numbers alone give. A scene or an engine chooses one by its keys."""


@by_type
def is_power(law: Law) -> bool:
    """Whether a law is a power of the speed: then every periodic solution is stable."""
    return False


@by_type
def half_of(law: Law) -> float:
    """Return alpha/2; for a law that is no power 1, for which F = q rises with the speed."""
    return 1.0


@by_type
def load_terms(q: float, law: Any) -> tuple[float, float, float]:
    """F and its first two derivatives, continued by the tangent below `FLOOR`.

    docs/method.md (35) and (41).
    """
    return _terms_of_torque(q, law)


@inlined
def _terms_of_torque(q: float, law: Any) -> tuple[float, float, float]:
    """F and its derivatives, docs/method.md (39) and (41), of a law that gives a torque."""
    base = max(q, FLOOR)
    omega = law.nominal * math.sqrt(base)
    value, first, second = torque_at(omega, law)
    rate = 0.5 * omega / base
    value *= law.scale
    slope = law.scale * first * rate
    if q < FLOOR:
        return value + slope * (q - FLOOR), slope, 0.0
    return value, slope, law.scale * (second * rate * rate - 0.5 * first * rate / base)


@by_type
def torque_at(omega: float, law: Law) -> tuple[float, float, float]:
    """Torque at a speed [rad/s], in any unit, and its first two derivatives.

    For laws that are no power of the speed, which have `nominal` and `scale`.
    """
    raise TypeError("this law is not registered")


@by_type
def make_law(
    speed: float, exponent: float, values: Floats, at: Integers, form: Form
) -> tuple[Law, float]:
    """Law of a design, docs/method.md (39), and a number with the sign of the mean torque it needs.

    `speed` is the nominal one [rad/s]; `at` are the places of `INPUTS` among the `values`. The
    number is positive for a load, negative for a driver, 0 where there is no torque at the nominal
    speed, and NaN where a table does not cover that speed.
    """
    raise TypeError("this law is not registered")


@by_type
def gear_of(gear_ratio: float, form: Form) -> float:
    """Ratio of the speed that a law depends on to the crank's."""
    return 1.0


@by_type
def covers(high: float, low: float, form: Form) -> bool:
    """Whether a law is known from the speed `low` to the speed `high` [rad/s]."""
    return True


# --- a + k omega^alpha --------------------------------------------------------------------------


@is_power.of(Power)
def _is_power(law: Power) -> bool:
    return True


@half_of.of(Power)
def _half_of_power(law: Power) -> float:
    return law.half


@make_law.of(PowerForm)
def _make_power(
    speed: float, exponent: float, values: Floats, at: Integers, form: PowerForm
) -> tuple[Power, float]:
    return Power(0.5 * exponent), 1.0


@load_terms.of(Power)
def _terms_of_power(q: float, law: Power) -> tuple[float, float, float]:
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


# --- a + k (b omega + c omega^2) ------------------------------------------------------------------


@make_law.of(LinearSquareForm)
def _make_linear_square(
    speed: float, exponent: float, values: Floats, at: Integers, form: LinearSquareForm
) -> tuple[LinearSquare, float]:
    linear, square = values[at[LOAD_LINEAR]], values[at[LOAD_SQUARE]]
    whole = linear + square * speed
    return LinearSquare(linear / whole if whole > 0.0 else 0.0), whole


@load_terms.of(LinearSquare)
def _terms_of_linear_square(q: float, law: LinearSquare) -> tuple[float, float, float]:
    base = max(q, FLOOR)
    root = math.sqrt(base)
    value = law.weight * root + (1.0 - law.weight) * base
    first = 0.5 * law.weight / root + (1.0 - law.weight)
    if q < FLOOR:
        return value + first * (q - FLOOR), first, 0.0
    return value, first, -0.25 * law.weight / (root * base)


# --- a table over speed, or a motor --------------------------------------------------------------


@torque_at.of(Curve)
def _torque_of_curve(omega: float, law: Curve) -> tuple[float, float, float]:
    """Torque of a table, docs/method.md (37), or of a motor over its breakdown torque, (40).

    Iterates may leave a table, so it is continued by straight lines; a solution there is refused.
    """
    if law.table.shape[1] == 0:
        s, b = 1.0 - omega / law.synchronous, law.slip
        below = 1.0 / (s * s + b * b)
        value = 2.0 * s * b * below
        # The first and the second derivative over s of 2 s b/(s^2 + b^2); ds/domega = -1/omega_s.
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


@make_law.of(CurveForm)
def _make_curve(
    speed: float, exponent: float, values: Floats, at: Integers, form: CurveForm
) -> tuple[Curve, float]:
    there, table = gear_of(values[at[GEAR_RATIO]], form) * speed, form.table
    synchronous, slip = values[at[SYNCHRONOUS_SPEED]], values[at[BREAKDOWN_SLIP]]
    torque, _, _ = torque_at(there, Curve(there, 1.0, synchronous, slip, table))
    scale = 1.0 / torque if torque != 0.0 else 0.0
    sign = form.sign * scale if covers(there, there, form) else math.nan
    return Curve(there, scale, synchronous, slip, table), sign


@gear_of.of(CurveForm)
def _gear_of_curve(gear_ratio: float, form: CurveForm) -> float:
    return gear_ratio if form.own else 1.0


@covers.of(CurveForm)
def _curve_covers(high: float, low: float, form: CurveForm) -> bool:
    speeds = form.table[0]
    if speeds.size > 0:
        return bool(speeds[0] <= low * ROUNDED and high <= speeds[speeds.size - 1] * ROUNDED)
    return True
