"""Formulas and steps of the first-law cycles: the kernel behind `first_law`.

What the equations are stands there; here is how they are followed. While the cylinder is closed,
the unknown is its energy less the heat released so far, which needs the burnt fraction and not its
rate: one degree smoother where a combustion starts. Steps are of fixed width and order six, and end
wherever the equation is not smooth.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from engine_dyn import status
from engine_dyn.compilation import inlined, kernel, on_stack
from engine_dyn.geometry.slider_crank import (
    offset_position_at,
    offset_velocity_at,
    position_at,
    sine_of_top,
    turned,
    velocity_at,
)
from engine_dyn.types import Floats, Integers
from engine_dyn.units import DEGREE

__all__ = [
    "EXPONENT_REACH",
    "HOTTEST",
    "POLYTROPIC",
    "WOSCHNI",
    "WOSCHNI_FACTOR",
    "WOSCHNI_PISTON",
    "Case",
    "butcher_change",
    "integrate",
    "smooth_step",
]


ADIABATIC, POLYTROPIC, WOSCHNI = range(3)

HOTTEST = 4000.0
"""Beyond this temperature [K] nothing supports a gamma that falls with a straight line."""

# Woschni (1967) as in Heywood, section 12.4: h = 3.26 B^-0.2 p^0.8 T^-0.55 w^0.8 with p in
# kPa, w = 2.28 c_m + 3.24e-3 (V_h T_r)/(p_r V_r) (p - p_m); the second part from combustion on.
WOSCHNI_FACTOR = 3.26 * 1000.0**-0.8
WOSCHNI_PISTON = 2.28
WOSCHNI_COMBUSTION = 3.24e-3

# The exponent of a polytrope changes over this angle to both sides of dead centre.
EXPONENT_REACH = 30.0 * DEGREE

# Steps: at most this wide, this share of a combustion and of the lag of a valve.
LARGEST_STEP = 0.5 * DEGREE
STEPS_OF_COMBUSTION = 24.0
STEPS_OF_LAG = 6.0
STEPS_OF_RAMP = 12.0
# A rate that begins like (phi - start)^m has no derivatives there beyond m: the first steps after
# it begin small and double.
DOUBLINGS = 6

MOST_PASSES = 60
"""Cycles that are followed until the pressure repeats."""
REPEATS = 1e-12

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


# Functions hand numbers over, not arrays: counting references would take half the time.
Place = tuple[float, float, float, float]
"""What depends on angle alone: volume, its derivative, and two numbers more."""
Blown = tuple[float, float, float]
"""Exponent, gamma - 1 and heat loss at the end of the closed part."""


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
    s, c = turned(sine, cosine, top, upright)
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
    return factor * (form + 1.0) / duration * power * math.exp(-factor * power * time)


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


@inlined
def state(energy: float, mass: float, volume: float, case: Case) -> tuple[float, float, float]:
    """Temperature, pressure and gamma - 1 of the closed gas.

    u/R = -ln(G/G_1)/s with G = gamma - 1 = G_1 - s (T - T_1), solved for T; `energy` is that above
    the trapped charge's, `mass` is m R over the swept volume [Pa/K].
    """
    first = case.charge_gamma - 1.0
    drop = -case.gamma_slope * energy / mass
    # expm1(x)/x, which is 1 + x/2 where x is lost beside one.
    rise = 1.0 + 0.5 * drop if abs(drop) < 1e-9 else math.expm1(drop) / drop
    warmer = first * energy / mass * rise
    temperature = case.charge_temperature + warmer
    return temperature, mass * temperature / volume, first - case.gamma_slope * warmer


@inlined
def woschni(pressure: float, temperature: float, above: float, volume: float, case: Case) -> float:
    """Heat that the walls take per angle, over the swept volume [Pa].

    `above` is (p - p_m)/(m R) [K]: T_r/(p_r V_r) of any state of the closed gas is 1/(m R).
    """
    wind = case.piston_wind + WOSCHNI_COMBUSTION * max(above, 0.0)
    transfer = math.exp(0.8 * math.log(pressure * wind) - 0.55 * math.log(temperature))
    area = case.wall_ends + case.wall_liner * volume
    return case.wall_scale * area * transfer * (temperature - case.wall_temperature)


@inlined
def closed_place(phi: float, sine: float, cosine: float, case: Case) -> Place:
    """Volume, its derivative, burnt fraction and exponent at an angle."""
    volume, growth = geometry(sine, cosine, case)
    fraction = burnt(phi, case) if case.heat > 0.0 else 0.0
    power = exponent(phi, case) if case.wall == POLYTROPIC else 0.0
    return volume, growth, fraction, power


@inlined
def closed_rates(
    energy: float, motored: float, mass: float, two: bool, place: Place, case: Case
) -> tuple[float, float, float, float, float]:
    """Rates of energy, of the motored engine's energy and of work; temperature and heat loss.

    `energy` is the internal energy less the heat released so far, which so needs no rate.
    """
    volume, growth, fraction, power = place
    temperature, pressure, gamma_less = state(energy + case.heat * fraction, mass, volume, case)
    work = pressure * growth
    loss, motored_rate = 0.0, 0.0
    if case.wall == POLYTROPIC:
        loss = work * ((power - 1.0) / gamma_less - 1.0)
    elif case.wall == WOSCHNI:
        above = 0.0
        if two:
            cooler, lower, _ = state(motored, mass, volume, case)
            above = (pressure - lower) / mass
            motored_rate = -lower * growth - woschni(lower, cooler, 0.0, volume, case)
        loss = woschni(pressure, temperature, above, volume, case)
    return -work - loss, motored_rate, work, temperature, loss


@inlined
def butcher_change(
    h: float, k1: float, k3: float, k4: float, k5: float, k6: float, k7: float
) -> float:
    """Change over a step of Butcher's method; its second stage has no weight."""
    return h / 120.0 * (11.0 * (k1 + k7) + 81.0 * (k3 + k4) - 32.0 * (k5 + k6))


@inlined
def closed_step(
    phi: float, h: float, e: float, m: float, mass: float, two: bool, case: Case
) -> tuple[float, float, float]:
    """Energy and motored energy after one step, and its work.

    Butcher's seven stages lie at 0, 1/3, 2/3, 1/3, 1/2, 1/2 and 1 of the step.
    """
    s0, c0 = math.sin(phi), math.cos(phi)
    s6, c6 = math.sin(h / 6.0), math.cos(h / 6.0)
    s3, c3 = turned(s6, c6, s6, c6)
    start = closed_place(phi, s0, c0, case)
    s, c = turned(s0, c0, s3, c3)
    third = closed_place(phi + h / 3.0, s, c, case)
    s, c = turned(s, c, s6, c6)
    half = closed_place(phi + 0.5 * h, s, c, case)
    s, c = turned(s, c, s6, c6)
    later = closed_place(phi + 2.0 * h / 3.0, s, c, case)
    s, c = turned(s, c, s3, c3)
    end = closed_place(phi + h, s, c, case)

    e1, m1, w1, _, _ = closed_rates(e, m, mass, two, start, case)
    g = h / 3.0
    e2, m2, _, _, _ = closed_rates(e + g * e1, m + g * m1, mass, two, third, case)
    g = 2.0 * h / 3.0
    e3, m3, w3, _, _ = closed_rates(e + g * e2, m + g * m2, mass, two, later, case)
    g = h / 12.0
    e4, m4, w4, _, _ = closed_rates(
        e + g * (e1 + 4.0 * e2 - e3), m + g * (m1 + 4.0 * m2 - m3), mass, two, third, case
    )
    g = h / 16.0
    e5, m5, w5, _, _ = closed_rates(
        e + g * (18.0 * e2 - e1 - 3.0 * e3 - 6.0 * e4),
        m + g * (18.0 * m2 - m1 - 3.0 * m3 - 6.0 * m4),
        mass, two, half, case,
    )  # fmt: skip
    g = h / 8.0
    e6, m6, w6, _, _ = closed_rates(
        e + g * (9.0 * e2 - 3.0 * e3 - 6.0 * e4 + 4.0 * e5),
        m + g * (9.0 * m2 - 3.0 * m3 - 6.0 * m4 + 4.0 * m5),
        mass, two, half, case,
    )  # fmt: skip
    g = h / 44.0
    e7, m7, w7, _, _ = closed_rates(
        e + g * (9.0 * e1 - 36.0 * e2 + 63.0 * e3 + 72.0 * e4 - 64.0 * e6),
        m + g * (9.0 * m1 - 36.0 * m2 + 63.0 * m3 + 72.0 * m4 - 64.0 * m6),
        mass, two, end, case,
    )  # fmt: skip
    return (
        e + butcher_change(h, e1, e3, e4, e5, e6, e7),
        m + butcher_change(h, m1, m3, m4, m5, m6, m7),
        butcher_change(h, w1, w3, w4, w5, w6, w7),
    )


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


@inlined
def open_place(phi: float, sine: float, cosine: float, period: float, case: Case) -> Place:
    """Volume, its derivative, how open the cylinder is, and to what pressure, at an angle."""
    volume, growth = geometry(sine, cosine, case)
    opened = smooth_step((phi - case.opening) / case.ramp)
    opened *= smooth_step((case.closing + period - phi) / case.ramp)
    outside = manifold(phi, growth, case) if opened > 0.0 else 0.0
    return volume, growth, opened, outside


@inlined
def gas_rate(
    phi: float,
    pressure: float,
    after: bool,
    volume: float,
    growth: float,
    blown: Blown,
    case: Case,
) -> float:
    """Derivative of the pressure by the gas inside, its exponent as at the closed part's end."""
    heat = 0.0
    if after:
        power, gamma_less, loss = blown
        heat = gamma_less * (case.heat * burning(phi, case) - loss)
    elif case.wall == POLYTROPIC:
        power = case.compression_exponent
    else:
        power = case.charge_gamma
        if case.wall == WOSCHNI:
            loss = woschni(pressure, case.charge_temperature, 0.0, volume, case)
            heat = (1.0 - power) * loss
    return (heat - power * pressure * growth) / volume


@inlined
def open_rate(
    phi: float, pressure: float, after: bool, place: Place, blown: Blown, case: Case
) -> float:
    """Derivative of the pressure while the cylinder is open.

    `after` the exhaust's opening, not before the closing.
    """
    volume, growth, opened, outside = place
    rate = 0.0
    if opened > 0.0:
        rate = opened * (outside - pressure) / case.lag
    if opened == 1.0:
        return rate
    return rate + (1.0 - opened) * gas_rate(phi, pressure, after, volume, growth, blown, case)


@inlined
def open_step(
    phi: float, h: float, p: float, period: float, after: bool, blown: Blown, case: Case
) -> float:
    """Pressure after one step, as in `closed_step`."""
    s0, c0 = math.sin(phi), math.cos(phi)
    s6, c6 = math.sin(h / 6.0), math.cos(h / 6.0)
    s3, c3 = turned(s6, c6, s6, c6)
    to_third, to_half, to_later, to_end = phi + h / 3.0, phi + 0.5 * h, phi + h / 1.5, phi + h
    start = open_place(phi, s0, c0, period, case)
    s, c = turned(s0, c0, s3, c3)
    third = open_place(to_third, s, c, period, case)
    s, c = turned(s, c, s6, c6)
    half = open_place(to_half, s, c, period, case)
    s, c = turned(s, c, s6, c6)
    later = open_place(to_later, s, c, period, case)
    s, c = turned(s, c, s3, c3)
    end = open_place(to_end, s, c, period, case)

    k1 = open_rate(phi, p, after, start, blown, case)
    k2 = open_rate(to_third, p + h / 3.0 * k1, after, third, blown, case)
    k3 = open_rate(to_later, p + h / 1.5 * k2, after, later, blown, case)
    q = p + h / 12.0 * (k1 + 4.0 * k2 - k3)
    k4 = open_rate(to_third, q, after, third, blown, case)
    q = p + h / 16.0 * (18.0 * k2 - k1 - 3.0 * k3 - 6.0 * k4)
    k5 = open_rate(to_half, q, after, half, blown, case)
    q = p + h / 8.0 * (9.0 * k2 - 3.0 * k3 - 6.0 * k4 + 4.0 * k5)
    k6 = open_rate(to_half, q, after, half, blown, case)
    q = p + h / 44.0 * (9.0 * k1 - 36.0 * k2 + 63.0 * k3 + 72.0 * k4 - 64.0 * k6)
    k7 = open_rate(to_end, q, after, end, blown, case)
    return p + butcher_change(h, k1, k3, k4, k5, k6, k7)


@inlined
def next_break(phi: float, breaks: Floats, count: int) -> float:
    """First break after an angle."""
    found = math.inf
    for i in range(count):
        if breaks[i] > phi + 1e-9 and breaks[i] < found:
            found = breaks[i]
    return found


@inlined
def add_start(start: float, h: float, breaks: Floats, count: int) -> int:
    """Add the start of a combustion and the small first steps after it."""
    breaks[count] = start
    for i in range(DOUBLINGS):
        breaks[count + 1 + i] = start + h * 0.5 ** (DOUBLINGS - i)
    return count + 1 + DOUBLINGS


@inlined
def closed_breaks(case: Case, width: float, breaks: Floats) -> int:
    """Angles at which the equation of the closed part is not smooth; how many."""
    breaks[0], breaks[1] = -EXPONENT_REACH, EXPONENT_REACH
    count = 2
    if case.heat > 0.0 and case.share > 0.0:
        count = add_start(case.start, width, breaks, count)
    if case.heat > 0.0 and case.share < 1.0:
        count = add_start(case.second_start, width, breaks, count)
    return count


@inlined
def open_breaks(case: Case, period: float, breaks: Floats) -> int:
    """Angles at which the equation of the open part is not smooth; how many."""
    end = case.closing + period
    breaks[0], breaks[1] = case.opening + case.ramp, end - case.ramp
    breaks[2] = 0.5 * (case.opening + end)
    if case.two_stroke == 0.0:
        breaks[3], breaks[4] = 2.0 * math.pi - case.ramp, 2.0 * math.pi + case.ramp
        return 5
    breaks[3], breaks[4] = case.scavenge, case.scavenge + case.ramp
    breaks[5] = 2.0 * math.pi - case.scavenge
    breaks[6] = breaks[5] - case.ramp
    return 7


@inlined
def closed_part(
    trapped: float,
    width: float,
    start: float,
    angle: Floats,
    step: float,
    case: Case,
    pressure: Floats,
    slope: Floats,
    summary: Floats,
    breaks: Floats,
) -> tuple[float, Blown]:
    """Follow the closed cylinder, from its `trapped` pressure to that when the exhaust opens."""
    count, opening = angle.size, case.opening
    breaking = closed_breaks(case, width, breaks)
    phi = case.closing
    volume, _ = geometry(math.sin(phi), math.cos(phi), case)
    mass = trapped * volume / case.charge_temperature
    energy, motored, work = 0.0, 0.0, 0.0
    hottest = case.charge_temperature
    following = int(math.ceil((phi - angle[0]) / step - 1e-9))
    while True:
        mark = angle[0] + following * step
        # From the start of combustion on, Woschni's motored engine is followed beside.
        two = phi >= start - 1e-12
        if mark <= phi + 1e-12 or phi >= opening - 1e-12:
            place = closed_place(phi, math.sin(phi), math.cos(phi), case)
            volume, growth, fraction, _ = place
            rate, _, _, temperature, loss = closed_rates(energy, motored, mass, two, place, case)
            hottest = max(hottest, temperature)
            warmer = temperature - case.charge_temperature
            gamma_less = case.charge_gamma - 1.0 - case.gamma_slope * warmer
            p = mass * temperature / volume
            if phi >= opening - 1e-12:
                break
            gain = gamma_less * (rate + case.heat * burning(phi, case))
            pressure[following % count] = p
            slope[following % count] = (gain - p * growth) / volume
            following += 1
            continue
        target = min(min(next_break(phi, breaks, breaking), opening), mark)
        steps = int(math.ceil((target - phi) / width - 1e-9))
        h = (target - phi) / steps
        for i in range(steps):
            energy, motored, gained = closed_step(phi + i * h, h, energy, motored, mass, two, case)
            work += gained
            if not two:
                motored = energy
        phi = target
    summary[0], summary[1] = trapped, hottest
    summary[2] = case.heat * fraction
    summary[3], summary[4] = work, -energy - work
    if case.wall == POLYTROPIC:
        return p, (case.expansion_exponent, gamma_less, 0.0)
    return p, (gamma_less + 1.0, gamma_less, loss)


@inlined
def open_part(
    phi: float,
    p: float,
    width: float,
    angle: Floats,
    step: float,
    period: float,
    case: Case,
    pressure: Floats,
    slope: Floats,
    blown: Blown,
    breaks: Floats,
) -> float:
    """Follow the open cylinder from an angle on; its pressure when it has closed."""
    count, end = angle.size, case.closing + period
    middle = 0.5 * (case.opening + end)
    breaking = open_breaks(case, period, breaks)
    following = int(math.ceil((phi - angle[0]) / step - 1e-9))
    while phi < end - 1e-12:
        mark = angle[0] + following * step
        after = phi < middle - 1e-12
        if mark <= phi + 1e-12:
            place = open_place(phi, math.sin(phi), math.cos(phi), period, case)
            pressure[following % count] = p
            slope[following % count] = open_rate(phi, p, after, place, blown, case)
            following += 1
            continue
        target = min(min(next_break(phi, breaks, breaking), end), mark)
        steps = int(math.ceil((target - phi) / width - 1e-9))
        h = (target - phi) / steps
        for i in range(steps):
            p = open_step(phi + i * h, h, p, period, after, blown, case)
        phi = target
    return p


@inlined
def follow(
    case: Case,
    period: float,
    angle: Floats,
    pressure: Floats,
    slope: Floats,
    summary: Floats,
    breaks: Floats,
) -> int:
    """Follow a cycle until it repeats; its outcome."""
    step = period / angle.size
    closed_width, start = LARGEST_STEP, math.inf
    if case.heat > 0.0 and case.share > 0.0:
        closed_width = min(closed_width, case.duration / STEPS_OF_COMBUSTION)
        start = case.start
    if case.heat > 0.0 and case.share < 1.0:
        closed_width = min(closed_width, case.second_duration / STEPS_OF_COMBUSTION)
        start = min(start, case.second_start)
    if case.wall != WOSCHNI:
        start = math.inf
    open_width = min(LARGEST_STEP, case.lag / STEPS_OF_LAG, case.ramp / STEPS_OF_RAMP)

    # Half an open part, from the manifold's pressure, begins near the first cycle's pressure.
    middle = 0.5 * (case.opening + case.closing + period)
    _, growth = geometry(math.sin(middle), math.cos(middle), case)
    p = open_part(
        middle, manifold(middle, growth, case), open_width, angle, step, period, case, pressure,
        slope, (case.charge_gamma, 0.0, 0.0), breaks,
    )  # fmt: skip
    for _ in range(MOST_PASSES):
        trapped = p
        p, blown = closed_part(
            trapped, closed_width, start, angle, step, case, pressure, slope, summary, breaks
        )
        if case.gamma_slope > 0.0 and summary[1] > HOTTEST:
            return status.INVALID_INPUT
        p = open_part(
            case.opening, p, open_width, angle, step, period, case, pressure, slope, blown, breaks,
        )  # fmt: skip
        if abs(p - trapped) <= REPEATS * trapped:
            return status.CONVERGED
    return status.NOT_CONVERGED


@inlined
def _case_of(r: Floats) -> Case:
    return Case(
        r[0], r[1], r[2], r[3], r[4], r[5], r[6], r[7], r[8],
        r[9], r[10], r[11], r[12], r[13], r[14], r[15], r[16], r[17],
        r[18], r[19], r[20], r[21], r[22], r[23], r[24], r[25], r[26],
        r[27], r[28], r[29], r[30], r[31], r[32], r[33], r[34],
    )  # fmt: skip


@kernel
def integrate(
    cases: Floats,
    rows: Integers,
    period: float,
    angle: Floats,
    pressures: Floats,
    slopes: Floats,
    summary: Floats,
    outcome: Integers,
) -> None:
    """Fill in the rows `rows` of the tables."""
    breaks = on_stack(32)
    for i in range(32):
        breaks[i] = 0.0
    for index in range(rows.size):
        row = rows[index]
        outcome[row] = follow(
            _case_of(cases[row]), period, angle, pressures[row], slopes[row], summary[row], breaks
        )
        if outcome[row] != status.CONVERGED:
            pressures[row, :] = math.nan
            slopes[row, :] = math.nan
            summary[row, :] = math.nan
