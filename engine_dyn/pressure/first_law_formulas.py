"""Fields and formulas of the first-law cycles.

Fields: units in files, ranges, and what is not a cycle. Formulas: volume, combustion, state of the
gas, and heat to the walls.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

import numpy as np

from engine_dyn.compilation import inlined
from engine_dyn.geometry.arrangement import FOUR_STROKE
from engine_dyn.geometry.slider_crank import (
    offset_position_at,
    offset_velocity_at,
    position_at,
    sine_of_top,
    sum_of_angles,
    velocity_at,
)
from engine_dyn.pressure.collocation import SHORT, short_exp
from engine_dyn.pressure.file_fields import FileField, file_units
from engine_dyn.types import Floats
from engine_dyn.units import DEGREE

POLYTROPIC, WOSCHNI = 1, 2  # Codes of wall models with heat transfer; 0 is adiabatic

HOTTEST = 4000.0
"""Highest temperature [K] for which a ratio of specific heats that falls linearly is accepted."""

# Woschni (1967) as in Heywood, section 12.4: h = 3.26 B^-0.2 p^0.8 T^-0.55 w^0.8 with p in kPa, w =
# 2.28 c_m + 3.24e-3 (V_h T_r)/(p_r V_r) (p - p_m); the second part counts from combustion on.
WOSCHNI_FACTOR = 3.26 * 1000.0**-0.8
WOSCHNI_PISTON = 2.28
WOSCHNI_COMBUSTION = 3.24e-3

# Angle on both sides of dead centre over which a polytrope's exponent changes.
EXPONENT_REACH = 30.0 * DEGREE

BURNT = 40.0  # A combustion ends where the fraction exp(-BURNT) of it is left

# Number of durations for which a Wiebe function is followed: nothing is left to burn after them,
# and powers of a longer time would overflow.
BURNT_OUT = 4.0


class Case(NamedTuple):
    """One cycle as the kernel sees it: SI units, heats over the swept volume."""

    two_stroke: float
    wall: float
    clearance: float
    crank_ratio: float
    offset_ratio: float
    half_stroke: float
    intake_pressure: float
    exhaust_pressure: float
    intake_loss: float
    exhaust_loss: float
    charge_temperature: float
    charge_gamma: float
    gamma_slope: float
    heat: float
    wiebe_factor: float
    share: float
    start: float
    duration: float
    form: float
    second_start: float
    second_duration: float
    second_form: float
    compression_exponent: float
    expansion_exponent: float
    wall_temperature: float
    wall_scale: float
    wall_ends: float
    wall_liner: float
    piston_wind: float
    closing: float
    opening: float
    ramp: float
    lag: float
    scavenge: float
    returns: float
    end: float
    second_end: float


@inlined
def smooth_step(u: float) -> float:
    """Rise from 0 at u = 0 to 1 at u = 1 with two derivatives zero at both ends."""
    if u <= 0.0:
        return 0.0
    if u >= 1.0:
        return 1.0
    return u * u * u * (10.0 + u * (6.0 * u - 15.0))


@inlined
def geometry(sine: float, cosine: float, case: Case) -> tuple[float, float]:
    """Volume over the swept volume and its derivative over angle; the one place that knows it."""
    ratio, offset = case.crank_ratio, case.offset_ratio
    if offset == 0.0:
        volume = case.clearance + 0.5 * position_at(sine, cosine, ratio)
        return volume, 0.5 * velocity_at(sine, cosine, ratio)
    # Factor from travel over crank radius to volume over swept volume: 0.5 without offset, less
    # with one, because the stroke then exceeds two crank radii.
    share = 0.5 / case.half_stroke
    top = sine_of_top(ratio, offset)
    upright = math.sqrt(1.0 - top * top)
    s, c = sum_of_angles(sine, cosine, top, upright)
    travel = offset_position_at(s, c, ratio, offset, 1.0 - cosine, upright)
    return case.clearance + share * travel, share * offset_velocity_at(s, c, ratio, offset)


@inlined
def wiebe(phi: float, start: float, duration: float, form: float, factor: float) -> float:
    """Burnt fraction, Heywood eq. 9.30."""
    time = (phi - start) / duration
    if time <= 0.0:
        return 0.0
    return -math.expm1(-factor * min(time, BURNT_OUT) ** (form + 1.0))


@inlined
def wiebe_rate(phi: float, start: float, duration: float, form: float, factor: float) -> float:
    """Return the derivative of the burnt fraction over angle."""
    time = (phi - start) / duration
    if time <= 0.0 or time >= BURNT_OUT:
        return 0.0
    power = time**form
    burnt_out = factor * power * time
    if burnt_out > BURNT:
        return 0.0
    return factor * (form + 1.0) / duration * power * math.exp(-burnt_out)


@inlined
def burnt(phi: float, case: Case) -> float:
    """Part of the heat released."""
    total = 0.0
    if case.share > 0.0:
        total = case.share * wiebe(phi, case.start, case.duration, case.form, case.wiebe_factor)
    if case.share < 1.0:
        total += (1.0 - case.share) * wiebe(
            phi, case.second_start, case.second_duration, case.second_form, case.wiebe_factor
        )
    return total


@inlined
def burning(phi: float, case: Case) -> float:
    """Return the derivative of `burnt` over angle."""
    total = 0.0
    if case.share > 0.0:
        total = case.share * wiebe_rate(
            phi, case.start, case.duration, case.form, case.wiebe_factor
        )
    if case.share < 1.0:
        total += (1.0 - case.share) * wiebe_rate(
            phi, case.second_start, case.second_duration, case.second_form, case.wiebe_factor
        )
    return total


@inlined
def exponent(phi: float, case: Case) -> float:
    """Polytropic exponent of an unfired charge."""
    change = case.expansion_exponent - case.compression_exponent
    turned = smooth_step(0.5 * (phi / EXPONENT_REACH + 1.0))
    return case.compression_exponent + change * turned


class Gas(NamedTuple):
    """The closed gas, as its trapped state gives it.

    With G = gamma - 1 = G_1 - s (T - T_1) and A = G_1 + s T_1, the unknown y = Y + A ln(V/V_1),
    Y = ln[(T/T_1) G_1/(A - s T)], has the rate y' = A q'/(m R T), where q' is the heat taken up
    over angle: y is the entropy, times A over m R. `total` is A, `part` is G_1/A, `mass` is m R
    over the swept volume [Pa/K], `volume` is V_1; `transfer` is that of `transfer_of_woschni` in
    the trapped charge, over the area.
    """

    total: float
    part: float
    mass: float
    volume: float
    transfer: float


@inlined
def exp(x: float) -> float:
    """Exponential function, quicker where x is small."""
    return short_exp(x) if abs(x) <= SHORT else math.exp(x)


@inlined
def state(y: float, logarithm: float, gas: Gas, case: Case) -> tuple[float, float]:
    """Temperature, and gamma - 1 over A."""
    grown = exp(y - gas.total * logarithm)
    below = gas.part + (1.0 - gas.part) * grown
    return case.charge_temperature * grown / below, gas.part / below


@inlined
def transfer_of_woschni(
    pressure: float, temperature: float, above: float, volume: float, case: Case
) -> float:
    """Heat that the walls take per angle and kelvin, over the swept volume [Pa/K].

    `above` is (p - p_m)/(m R) [K]: T_r/(p_r V_r) of any state of the closed gas is 1/(m R).
    """
    wind = case.piston_wind + WOSCHNI_COMBUSTION * max(above, 0.0)
    transfer = math.exp(0.8 * math.log(pressure * wind) - 0.55 * math.log(temperature))
    return case.wall_scale * (case.wall_ends + case.wall_liner * volume) * transfer


@inlined
def manifold(phi: float, growth: float, case: Case) -> float:
    """Pressure to which an open cylinder relaxes."""
    if case.two_stroke > 0.0:
        share = smooth_step((phi - case.scavenge) / case.ramp)
        if case.returns > 0.0:
            share *= smooth_step((2.0 * math.pi - case.scavenge - phi) / case.ramp)
        return case.exhaust_pressure + (case.intake_pressure - case.exhaust_pressure) * share
    share = smooth_step(0.5 * ((phi - 2.0 * math.pi) / case.ramp + 1.0))
    square = 4.0 * growth * growth
    intake = case.intake_pressure - case.intake_loss * square
    exhaust = case.exhaust_pressure + case.exhaust_loss * square
    return exhaust + (intake - exhaust) * share


WALLS = ("adiabatic", "polytropic", "woschni")  # Models of the heat transfer to the walls

_GAS = {
    "compression_ratio": FileField("1", 1.5, 40.0),
    "crank_ratio": FileField("1", 0.0, 1.0),
    "intake_pressure": FileField("bar", 0.0, 20.0),
    "exhaust_pressure": FileField("bar", 0.0, 20.0),
    "charge_temperature": FileField("K", 200.0, 700.0),
    "heat": FileField("bar", 0.0, 200.0, ends=True),
    "combustion_start": FileField("degree", -90.0, 90.0),
    "combustion_duration": FileField("degree", 2.0, 270.0),
    # With an exponent below 1 the rate of heat release has a corner that no spline follows.
    "combustion_form": FileField("1", 1.0, 10.0, ends=True),
    "valve_ramp": FileField("degree", 2.0, 90.0),
    "valve_lag": FileField("degree", 0.5, 45.0),
}
_FURTHER = {
    "offset_ratio": FileField("1", -10.0, 10.0),
    "premixed_share": FileField("1", 0.0, 1.0, ends=True),
    "premixed_start": FileField("degree", -90.0, 90.0),
    "premixed_duration": FileField("degree", 2.0, 180.0),
    "premixed_form": FileField("1", 1.0, 10.0, ends=True),
    "wiebe_factor": FileField("1", 1.0, 20.0),
    "gamma_300": FileField("1", 1.0, 5.0 / 3.0, ends=True),
    "gamma_slope": FileField("K-1", 0.0, 3e-4, ends=True),
}
_OF_WALL = {
    POLYTROPIC: {
        "compression_exponent": FileField("1", 1.0, 5.0 / 3.0),
        "expansion_exponent": FileField("1", 1.0, 5.0 / 3.0),
    },
    WOSCHNI: {
        "wall_temperature": FileField("K", 200.0, 1200.0),
        "wall_factor": FileField("1", 0.0, 10.0, ends=True),
        "bore": FileField("m", 0.0, 3.0),
        "stroke": FileField("m", 0.0, 6.0),
        "speed": FileField("rpm", 0.0, 30000.0),
    },
}
_VALVES = {
    "intake_loss": FileField("bar", 0.0, 10.0, ends=True),
    "exhaust_loss": FileField("bar", 0.0, 10.0, ends=True),
    "intake_closing": FileField("degree", -180.0, -45.0),
    "exhaust_opening": FileField("degree", 45.0, 180.0),
}
_PORTS = {
    "exhaust_opening": FileField("degree", 45.0, 180.0),
    "scavenge_opening": FileField("degree", 45.0, 180.0),
    "exhaust_closing": FileField("degree", -180.0, -45.0),
}
FIELDS_OF_WALL: Mapping[str, tuple[str, ...]] = {
    word: tuple(_OF_WALL.get(code, ())) for code, word in enumerate(WALLS)
}
"""Fields that one model of the walls needs, and that the others refuse."""

_WALL_FIELDS = {name: item for part in _OF_WALL.values() for name, item in part.items()}

FOUR_STROKE_FIELDS: Mapping[str, FileField] = {**_GAS, **_FURTHER, **_WALL_FIELDS, **_VALVES}
"""Fields of a FourStrokeCycle in engine files."""
TWO_STROKE_FIELDS: Mapping[str, FileField] = {**_GAS, **_FURTHER, **_WALL_FIELDS, **_PORTS}
"""Fields of a TwoStrokeCycle in engine files."""
FOUR_STROKE_UNITS = file_units(FOUR_STROKE_FIELDS)
"""Unit in which an engine file gives each number of a FourStrokeCycle, and its size in SI."""
TWO_STROKE_UNITS = file_units(TWO_STROKE_FIELDS)
"""Unit in which an engine file gives each number of a TwoStrokeCycle, and its size in SI."""


def wall_code(wall: str) -> int:
    """Place of a model of the walls in WALLS; ValueError for a word that is not one of them."""
    if wall not in WALLS:
        allowed = ", ".join(f"'{word}'" for word in WALLS)
        raise ValueError(f"wall = {wall!r}: must be one of {allowed}")
    return WALLS.index(wall)


def refusals(period: float, columns: Mapping[str, Floats], wall: int) -> Iterator[Any]:
    """Find values that are not a cycle: where (an array), and a function of the place that says it.

    `period` tells a four-stroke cycle from a two-stroke one; `wall` is the place in WALLS.
    """
    four = period == FOUR_STROKE
    known = FOUR_STROKE_FIELDS if four else TWO_STROKE_FIELDS
    ranges = {**_GAS, **_FURTHER, **(_VALVES if four else _PORTS), **_OF_WALL.get(wall, {})}

    def said(name: str, allowed: str) -> Any:
        def message(place: int) -> str:
            value, field = float(columns[name].reshape(-1)[place]), known[name]
            if not math.isfinite(value):
                return f"{name} = {value}: must be a finite number"
            return f"{name} = {value / field.size:.6g}{field.words}: must be {allowed}"

        return message

    for name, item in ranges.items():
        low, high, ends, size = item.low, item.high, item.ends, item.size
        value = columns[name]
        within = (value >= low * size) & (value <= high * size)
        if not ends:
            within &= (value != low * size) & (value != high * size)
        if name == "exhaust_closing":
            within |= np.isnan(value)
        yield ~within, said(name, item.allowed)
    stuck = ~(columns["crank_ratio"] * (1.0 + np.abs(columns["offset_ratio"])) < 1.0)
    text = "such that the crank turns: with the crank radius below the rod"
    yield stuck, said("offset_ratio", text)
    closing, opening = closing_angle(period, columns), columns["exhaust_opening"]
    starts = [columns["combustion_start"]]
    starts.append(np.where(columns["premixed_share"] > 0.0, columns["premixed_start"], starts[0]))
    last = "intake_closing" if four else "exhaust_opening"
    if not four:
        early = columns["scavenge_opening"] <= opening
        yield early, said("scavenge_opening", "after exhaust_opening")
    else:
        for name in ("intake", "exhaust"):
            large = columns[f"{name}_loss"] > 0.5 * columns[f"{name}_pressure"]
            yield large, said(f"{name}_loss", f"at most half of {name}_pressure")
    for name, start in zip(("combustion_start", "premixed_start"), starts, strict=True):
        yield start <= closing, said(name, f"after the cylinder has closed ({last})")
        yield start >= opening, said(name, "before exhaust_opening")
    long = 2.0 * columns["valve_ramp"] > period + closing - opening
    yield long, said("valve_ramp", "at most half the time for which the cylinder is open")


def closing_angle(period: float, columns: Mapping[str, Floats]) -> Floats:
    """Angle [rad] at which the cylinder has closed."""
    if period == FOUR_STROKE:
        return columns["intake_closing"]
    exhaust = columns["exhaust_closing"]
    exhaust = np.where(np.isnan(exhaust), -columns["exhaust_opening"], exhaust)
    return np.asarray(np.maximum(exhaust, -columns["scavenge_opening"]))
