"""How load or driver depend on the speed within the cycle: the registry of laws.

A law is a torque over the speed omega. What solvers need of it is F(q), q = (omega/omega_n)^2: the
torque over its value at the nominal speed, docs/method.md (41) and (45). The number kappa is
positive for a load and negative for a driver, and the equation is the same.

Each law is one function of numbers, which gives the torque and its slope, used by both solvers and
by quantities. To add a law is to write that function, to call it in `torque_at`, and to add a row
to `LAWS`: docs/extending.md.

Cubic pieces of curves that are tabulated by values and slopes at points.

Tables of loads over angle, and of loads and drivers over speed, are such curves.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from engine_dyn.compilation import inlined
from engine_dyn.types import Floats

FLOOR = 1e-6
"""Square of omega/omega_n below which tangents continue the laws, docs/method.md (48), so that
an iterate may pass through values that a solution cannot have; a solution below it is a stall."""

ROUNDED = 1.0 + 1e-9  # Factor by which rounding may put a speed beyond the ends of a table

POWER, LINEAR_SQUARE, TABLE, MOTOR = range(4)
"""Codes of the laws of load torque in kernels: their places in `LAWS`."""


class Field(NamedTuple):
    """One input of the solvers, a keyword of `engine_dyn.speed.dispatch.solve`, in SI units.

    Without a `default` it must be given. `quantity` is the node of `engine_dyn.quantities.graph`
    that has its unit and meaning, where that has another name.
    """

    name: str
    default: float | None = None
    quantity: str = ""


INPUTS = (
    Field("synchronous_speed", 1.0), Field("breakdown_slip", 1.0, "motor_breakdown_slip"),
    Field("load_linear", 0.0), Field("load_square", 0.0), Field("gear_ratio", 1.0, "load_gear"),
)  # fmt: skip
"""Solver inputs that belong to laws over speed; the exponent is in `engine_dyn.speed.fields`."""


class Form(NamedTuple):
    """The part of a law that all designs of a sweep have in common."""

    kind: int  # Code of the law: its place in `LAWS`
    sign: float  # Sign of the torque: 1 for a load, -1 for a driver
    # Whether the law is over the speed of the load's own shaft, the gear ratio times the crank's
    # speed.
    own: bool
    table: Floats  # Speed, torque and slope of a table; empty for other laws; shape (3, K)


class Law(NamedTuple):
    """Law of one design: F(q) = T(omega_n sqrt q)/T(omega_n), docs/method.md (41) and (45)."""

    kind: int  # Code of the law: its place in `LAWS`
    # Nominal speed omega_n of the law's shaft [rad/s], and 1/T(omega_n).
    nominal: float
    scale: float
    # First and second number of the law, as `LAWS` names them.
    first: float
    second: float
    table: Floats  # Table of the law, as in `Form`; shape (3, K)


# --- the laws: torque [N m, or any other unit] and its slope over the speed [rad/s] --------------


def power_torque(omega: Any, exponent: Any) -> tuple[Any, Any]:
    """Return omega^alpha and its slope, docs/method.md (41); Kakaitsas (2015), section 3.1."""
    torque = omega**exponent
    return torque, exponent * torque / omega


def linear_square_torque(omega: Any, load_linear: Any, load_square: Any) -> tuple[Any, Any]:
    """Return b omega + c omega^2 and its slope, docs/method.md (47).

    A brake, or a fan with bearing losses.
    """
    return omega * (load_linear + load_square * omega), load_linear + 2.0 * load_square * omega


def slip_torque(omega: Any, synchronous_speed: Any, breakdown_slip: Any) -> tuple[Any, Any]:
    """Torque of an induction motor over its breakdown torque, and its slope: docs/method.md (46).

    Kloss: M/M_b = 2/(s/s_b + s_b/s) with s = 1 - omega/omega_s; above the synchronous speed the
    machine brakes.
    """
    slip = 1.0 - omega / synchronous_speed
    below = 1.0 / (slip * slip + breakdown_slip * breakdown_slip)
    steep = breakdown_slip * breakdown_slip - slip * slip
    slope = -2.0 * breakdown_slip * steep * below * below / synchronous_speed
    return 2.0 * slip * breakdown_slip * below, slope


_power_torque = inlined(power_torque)
_linear_square_torque = inlined(linear_square_torque)
_slip_torque = inlined(slip_torque)


@inlined
def _table_torque(omega: float, table: Floats) -> tuple[float, float]:
    """Torque and slope, docs/method.md (43); straight lines continue the table for iterates."""
    speeds, torques, slopes = table[0], table[1], table[2]
    last = len(speeds) - 1
    if omega <= speeds[0]:
        return torques[0] + slopes[0] * (omega - speeds[0]), slopes[0]
    if omega >= speeds[last]:
        return torques[last] + slopes[last] * (omega - speeds[last]), slopes[last]
    _, step, t, y0, m0, c, d = piece_at(omega, speeds, torques, slopes)
    return y0 + t * (m0 + t * (c + t * d)), (m0 + t * (2.0 * c + 3.0 * t * d)) / step


@inlined
def torque_at(omega: float, law: Law) -> tuple[float, float]:
    """Torque of a law at a speed [rad/s], in any unit, and its slope."""
    if law.kind == POWER:
        # The speed is taken over the nominal speed, because powers of large numbers overflow.
        torque, slope = _power_torque(omega / law.nominal, law.first)
        return torque, slope / law.nominal
    if law.kind == LINEAR_SQUARE:
        return _linear_square_torque(omega, law.first, law.second)
    if law.kind == MOTOR:
        return _slip_torque(omega, law.first, law.second)
    return _table_torque(omega, law.table)


# --- queries of the solvers -----------------------------------------------------------------------


@inlined
def load_terms(q: float, law: Law) -> tuple[float, float]:
    """F(q) and its slope, docs/method.md (41) and (45), continued by the tangent below `FLOOR`."""
    base = max(q, FLOOR)
    root = math.sqrt(base)
    torque, slope = torque_at(law.nominal * root, law)
    value = law.scale * torque
    first = 0.5 * law.scale * slope * law.nominal / root
    if q < FLOOR:
        value += first * (q - FLOOR)
    return value, first


@inlined
def law_of(
    speed: float, first: float, second: float, gear_ratio: float, form: Form
) -> tuple[Law, float]:
    """Law of a design, and a number with the sign of the mean torque that it needs.

    `speed` is the nominal one of the crank [rad/s]; `first` and `second` are the numbers that
    `LAWS` names. The number is positive for a load, negative for a driver, 0 where there is no
    torque at the nominal speed, and NaN where a table does not cover that speed.
    """
    there = gear_ratio * speed if form.own else speed
    torque, _ = torque_at(there, Law(form.kind, there, 1.0, first, second, form.table))
    scale = 1.0 / torque if torque != 0.0 else 0.0
    sign = form.sign * scale if covers(there, there, form) else math.nan
    return Law(form.kind, there, scale, first, second, form.table), sign


@inlined
def is_power(law: Law) -> bool:
    """Whether a law is a power of the speed: then every periodic solution is stable."""
    return law.kind == POWER


@inlined
def is_proportional(first: float, form: Form) -> bool:
    """Whether a law, whose first number is given, is proportional to q: to omega^2."""
    return form.kind == POWER and first == 2.0


@inlined
def slope_of(law: Law) -> tuple[float, bool]:
    """F'(1), and whether a law does not depend on the speed at all, as an exponent 0.

    Then a closure sets the mean speed. A law that is flat at the nominal speed alone, or a table
    that is flat there, holds no speed.
    """
    flat, slope = law.kind != TABLE, 0.0
    for q in (0.25, 4.0, 1.0):
        value, slope = load_terms(q, law)
        flat = flat and value == 1.0 and slope == 0.0
    return slope, flat


@inlined
def covers(high: float, low: float, form: Form) -> bool:
    """Whether a law is known from the speed `low` to the speed `high` [rad/s] of its shaft."""
    speeds = form.table[0]
    if len(speeds) == 0:
        return True
    return bool(speeds[0] <= low * ROUNDED and high <= speeds[len(speeds) - 1] * ROUNDED)


def slope_and_sign(
    speed: Floats, first: Floats, second: Floats, form: Form
) -> tuple[Floats, Floats]:
    """F'(1) of designs whose law has numbers, and a number with the sign of their mean torque.

    F'(1) is half of omega_n T'(omega_n)/T(omega_n); the number is that of `law_of`.
    """
    law = LAWS[form.kind]
    assert law.torque is not None
    if form.kind == POWER:  # half of the exponent; powers of large speeds might overflow
        return 0.5 * first, np.full(first.shape, form.sign)
    torque, slope = law.torque(speed, *(first, second)[: len(law.numbers)])
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(0.5 * speed * slope / torque), form.sign * torque


# --- facts about the laws -------------------------------------------------------------------------


class LawFacts(NamedTuple):
    """Name and needs of one law over speed."""

    name: str  # Word for the law in `Node.when`, which says for which scenes a node holds
    meaning: str  # One line that describes the scenes with the law
    needs: tuple[str, ...]  # Nodes of the graph of quantities that the law takes for each design
    numbers: tuple[str, ...]  # Inputs of kernels that are the law's first and second number
    # Keys of scenes and engine files that choose the law: any of them is enough. Empty where a
    # table in the file chooses it.
    keys: tuple[str, ...] = ()
    # Torque and slope of the law from speed [rad/s] and numbers; None where a table gives it.
    torque: Callable[..., Any] | None = None
    # Whether k is a plain factor on a load's torque [N m]; the k of a + k omega^alpha has another
    # unit.
    factored: bool = False
    drives: bool = False  # Whether the law belongs to a driver


MOTOR_KEYS = (
    "motor_synchronous_speed", "motor_breakdown_slip", "motor_breakdown_torque", "motor_slip",
    "motor_gear_ratio",
)  # fmt: skip
"""Keys of an induction motor; a scene that gives any of them is driven by one."""

LAWS = (
    LawFacts(
        "power_law", "load torque a + k omega^alpha", ("load_exponent",), ("exponent",),
        ("load_exponent",), power_torque,
    ),
    LawFacts(
        "linear_square", "load torque a + k (b omega + c omega^2)", ("load_linear", "load_square"),
        ("load_linear", "load_square"), ("load_linear", "load_square"), linear_square_torque,
        factored=True,
    ),
    LawFacts("table", "load or driver has a table over speed", ("load_gear",), ()),
    LawFacts(
        "motor", "an induction motor drives", ("synchronous_speed", "motor_breakdown_slip"),
        ("synchronous_speed", "breakdown_slip"), MOTOR_KEYS, slip_torque,
        drives=True,
    ),
)  # fmt: skip
"""All laws of load and driver over speed, in the order of their numbers in kernels."""

LOAD_LAWS = {law.name: law for law in LAWS if law.keys and not law.drives}
"""Laws of a load that need no table. A scene or an engine chooses one by its keys."""


@inlined
def point_before(place: float, points: Floats) -> int:
    """Number of the last point that is not above a place, the first or last but one beyond them."""
    low, high = 0, len(points) - 1
    while high - low > 1:
        middle = (low + high) // 2
        if points[middle] <= place:
            low = middle
        else:
            high = middle
    return low


@inlined
def piece_at(
    place: float, points: Floats, values: Floats, slopes: Floats
) -> tuple[int, float, float, float, float, float, float]:
    """Number and width of the piece, t in [0, 1] within it, and its cubic's coefficients.

    docs/method.md (43). The value is y + t (m + t (c + t d)), from the constant y to d of t^3.
    """
    low = point_before(place, points)
    high = low + 1
    step = points[high] - points[low]
    t = (place - points[low]) / step
    y0, m0, m1 = values[low], step * slopes[low], step * slopes[high]
    c = 3.0 * (values[high] - y0) - 2.0 * m0 - m1
    d = -2.0 * (values[high] - y0) + m0 + m1
    return low, step, t, y0, m0, c, d
