"""Formulas of the first-law cycles: volume, combustion, state of the gas, and heat to the walls."""

from __future__ import annotations

import math
from typing import NamedTuple

from engine_dyn.compilation import inlined
from engine_dyn.geometry.slider_crank import (
    offset_position_at,
    offset_velocity_at,
    position_at,
    sine_of_top,
    sum_of_angles,
    velocity_at,
)
from engine_dyn.pressure.collocation import SHORT, short_exp
from engine_dyn.units import DEGREE

POLYTROPIC, WOSCHNI = 1, 2
"""Codes of walls with heat transfer; 0 is adiabatic."""

HOTTEST = 4000.0
"""Beyond this temperature [K] nothing supports a gamma that falls with a straight line."""

# Woschni (1967) as in Heywood, section 12.4: h = 3.26 B^-0.2 p^0.8 T^-0.55 w^0.8 with p in
# kPa, w = 2.28 c_m + 3.24e-3 (V_h T_r)/(p_r V_r) (p - p_m); the second part from combustion on.
WOSCHNI_FACTOR = 3.26 * 1000.0**-0.8
WOSCHNI_PISTON = 2.28
WOSCHNI_COMBUSTION = 3.24e-3

# The exponent of a polytrope changes over this angle to both sides of dead centre.
EXPONENT_REACH = 30.0 * DEGREE

BURNT = 40.0
"""A combustion has ended where exp(-BURNT) of it is left."""

# Wiebe functions are followed to this many durations: nothing is left, and powers stay finite.
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
    # Over the swept volume, a stroke of more than two crank radii.
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
