"""Formulas and steps of the first-law cycles: the kernel behind `first_law`.

What the equations are stands there; here is how they are followed. While the cylinder is closed,
the unknown is the entropy of its gas, which heat alone changes: it varies little where pressure and
temperature vary most. While it is open, the unknown is the pressure. Both are followed by
`collocation`, in intervals that end wherever the equation is not smooth.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from engine_dyn import status
from engine_dyn.compilation import inlined, kernel
from engine_dyn.geometry.slider_crank import (
    offset_position_at,
    offset_velocity_at,
    position_at,
    sine_of_top,
    sum_of_angles,
    velocity_at,
)
from engine_dyn.pressure.collocation import (
    PLACES,
    POINTS,
    SHORT,
    WEIGHTS,
    Solution,
    curve_at,
    fit,
    guess,
    improve,
    short_exp,
    short_turn,
)
from engine_dyn.types import Floats, Integers
from engine_dyn.units import DEGREE

__all__ = [
    "BURNT",
    "BURNT_OUT",
    "EXPONENT_REACH",
    "HOTTEST",
    "POLYTROPIC",
    "WOSCHNI",
    "WOSCHNI_FACTOR",
    "WOSCHNI_PISTON",
    "Case",
    "integrate",
    "new_memory",
    "smooth_step",
]


ADIABATIC, POLYTROPIC, WOSCHNI = range(3)

MOST_BREAKS = 32
"""Angles at which intervals have to end, at most."""

HOTTEST = 4000.0
"""Beyond this temperature [K] nothing supports a gamma that falls with a straight line."""

# Woschni (1967) as in Heywood, section 12.4: h = 3.26 B^-0.2 p^0.8 T^-0.55 w^0.8 with p in
# kPa, w = 2.28 c_m + 3.24e-3 (V_h T_r)/(p_r V_r) (p - p_m); the second part from combustion on.
WOSCHNI_FACTOR = 3.26 * 1000.0**-0.8
WOSCHNI_PISTON = 2.28
WOSCHNI_COMBUSTION = 3.24e-3

# The exponent of a polytrope changes over this angle to both sides of dead centre.
EXPONENT_REACH = 30.0 * DEGREE

# Intervals are at most this wide, these parts of a combustion, of the lag and of the ramp of a
# valve, and this part of the distance to where the volume would be 0, or the rod would stand
# across: both at complex angles. Narrower ones change no pressure by more than 1e-9 of the largest.
WIDEST = 16.0 * DEGREE
PARTS_OF_COMBUSTION = 5.0
LAGS_OF_INTERVAL = 1.7
PARTS_OF_RAMP = 2.0
PART_OF_DISTANCE = 0.6
# A rate that begins like (phi - start)^m has no derivatives there beyond m: the first intervals
# after it begin small and double.
DOUBLINGS = 6
BURNT = 40.0
"""A combustion has ended where exp(-BURNT) of it is left."""

MOST_IMPROVEMENTS = 20
NEAR = 1e-10
"""Newton's method ends where values change less; its next step would be lost in rounding."""

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
    end: float
    second_end: float


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


class Points(NamedTuple):
    """What depends on angle alone, at the points of an interval; arrays.

    `growth` is V'/V, `logarithm` that of the volume over the trapped one, `heat` its rate over
    angle [Pa], `power` the polytropic exponent; of an open cylinder `heat` is how open it is, and
    `power` the pressure outside. `lower` is the pressure of the motored engine.
    """

    volume: Floats
    growth: Floats
    logarithm: Floats
    heat: Floats
    power: Floats
    lower: Floats


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
def take_geometry(phi: float, h: float, case: Case, points: Points) -> None:
    """Volume and V'/V at the points of an interval."""
    sine, cosine = math.sin(phi), math.cos(phi)
    for i in range(POINTS):
        s, c = short_turn(h * PLACES[i])
        s, c = sum_of_angles(sine, cosine, s, c)
        volume, growth = geometry(s, c, case)
        points.volume[i] = volume
        points.growth[i] = growth / volume


@inlined
def take_closed_points(phi: float, h: float, gas: Gas, case: Case, points: Points) -> None:
    """What depends on angle alone, at the points of an interval of the closed part."""
    take_geometry(phi, h, case, points)
    for i in range(POINTS):
        angle = phi + h * PLACES[i]
        points.logarithm[i] = math.log(points.volume[i] / gas.volume)
        points.heat[i] = case.heat * burning(angle, case) if case.heat > 0.0 else 0.0
        points.power[i] = exponent(angle, case) if case.wall == POLYTROPIC else 0.0


@inlined
def take_closed_rates(
    burning: float, two: bool, gas: Gas, case: Case, points: Points, solution: Solution
) -> tuple[float, float]:
    """Rates of the entropy and their derivatives; work and loss over the width of the interval.

    `burning` is 1, or 0 of the motored engine; with a truth in its place the compiler makes a
    function for each. With `two`, the loss depends on the motored engine's pressure too.
    """
    work, loss = 0.0, 0.0
    for i in range(POINTS):
        y, volume = solution.values[i], points.volume[i]
        temperature, share = state(y, points.logarithm[i], gas, case)
        pressure = gas.mass * temperature / volume
        heat = burning * points.heat[i]
        factor = gas.total / (gas.mass * temperature)
        lost, rising = 0.0, 0.0
        if case.wall == POLYTROPIC:
            g = gas.total * share
            lost = pressure * volume * points.growth[i] * ((points.power[i] - 1.0) / g - 1.0)
            # The loss over T changes with G, and dG/dy = -share (A - G).
            rising = pressure * volume * points.growth[i] * ((points.power[i] - 1.0) / g - share)
        elif case.wall == WOSCHNI:
            # Woschni's powers of p and T, over those of the trapped charge.
            power = 0.25 * math.log(temperature / case.charge_temperature)
            power -= 0.8 * points.logarithm[i]
            more = 0.25
            if two and burning > 0.0:
                above = WOSCHNI_COMBUSTION * max(pressure - points.lower[i], 0.0) / gas.mass
                wind = 1.0 + above / case.piston_wind
                power += 0.8 * math.log(wind)
                if above > 0.0:
                    of_pressure = WOSCHNI_COMBUSTION * temperature / volume
                    more += 0.8 * of_pressure / (wind * case.piston_wind)
            area = case.wall_ends + case.wall_liner * volume
            transfer = gas.transfer * area * exp(power)
            lost = transfer * (temperature - case.wall_temperature)
            rising = share * (more * lost + transfer * temperature)
        if burning == 0.0:
            points.lower[i] = pressure
        solution.rates[i] = factor * (heat - lost)
        solution.slopes[i] = -share * solution.rates[i] - factor * rising
        work += WEIGHTS[i] * pressure * volume * points.growth[i]
        loss += WEIGHTS[i] * lost
    return work, loss


@inlined
def follow_closed(
    h: float, y: float, rate: float, burning: float, two: bool, gas: Gas, case: Case,
    points: Points, solution: Solution,
) -> tuple[float, float, float]:  # fmt: skip
    """Entropy at the end of an interval; work of the gas and loss to the walls over it."""
    guess(solution, y, rate, h)
    end, work, loss = y, 0.0, 0.0
    for _ in range(MOST_IMPROVEMENTS):
        work, loss = take_closed_rates(burning, two, gas, case, points, solution)
        end, change = improve(solution, y, h)
        if change < NEAR:
            break
    return end, h * work, h * loss


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
def next_break(phi: float, breaks: Floats, count: int) -> float:
    """First break after an angle."""
    found = math.inf
    for i in range(count):
        if breaks[i] > phi + 1e-9 and breaks[i] < found:
            found = breaks[i]
    return found


@inlined
def add_combustion(start: float, duration: float, end: float, breaks: Floats, count: int) -> int:
    """Add the start of a combustion, the small first intervals after it, and its end."""
    breaks[count] = start
    h = duration / PARTS_OF_COMBUSTION
    for i in range(DOUBLINGS):
        breaks[count + 1 + i] = start + h * 0.5 ** (DOUBLINGS - i)
    breaks[count + 1 + DOUBLINGS] = end
    return count + 2 + DOUBLINGS


@inlined
def closed_breaks(case: Case, breaks: Floats) -> int:
    """Angles at which the equation of the closed part is not smooth; how many."""
    count = 0
    if case.wall == POLYTROPIC:
        breaks[0], breaks[1] = -EXPONENT_REACH, EXPONENT_REACH
        count = 2
    if case.heat > 0.0 and case.share > 0.0:
        count = add_combustion(case.start, case.duration, case.end, breaks, count)
    if case.heat > 0.0 and case.share < 1.0:
        count = add_combustion(
            case.second_start, case.second_duration, case.second_end, breaks, count
        )
    return count


@inlined
def width_of_combustion(phi: float, width: float, case: Case) -> float:
    """Width of an interval that begins at an angle, where something burns there."""
    if case.heat <= 0.0:
        return width
    if case.share > 0.0 and case.start - 1e-9 < phi < case.end - 1e-9:
        width = min(width, case.duration / PARTS_OF_COMBUSTION)
    if case.share < 1.0 and case.second_start - 1e-9 < phi < case.second_end - 1e-9:
        width = min(width, case.second_duration / PARTS_OF_COMBUSTION)
    return width


@inlined
def width_of_geometry(phi: float, case: Case) -> float:
    """Width of an interval that begins at an angle, by how quickly the volume varies."""
    across = math.acosh(1.0 / (case.crank_ratio * (1.0 + abs(case.offset_ratio))))
    # The volume is about c + (1 + lambda) phi^2/4 near dead centre.
    least = 2.0 * math.sqrt(case.clearance / (1.0 + case.crank_ratio))
    away = abs(phi)
    if phi < 0.0:
        away /= 1.0 + PART_OF_DISTANCE
    return PART_OF_DISTANCE * min(across, max(least, away))


@inlined
def end_of_interval(phi: float, target: float, width: float) -> float:
    """Where an interval ends that begins at an angle, before a target or there."""
    left = target - phi
    if left <= width * 1.000001:
        return target
    return phi + (width if left >= 2.0 * width else 0.5 * left)


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
    start: float,
    angle: Floats,
    sine: Floats,
    cosine: Floats,
    step: float,
    case: Case,
    points: Points,
    fired: Solution,
    motored: Solution,
    pressure: Floats,
    slope: Floats,
    summary: Floats,
    breaks: Floats,
) -> tuple[float, Blown]:
    """Follow the closed cylinder, from its `trapped` pressure to that when the exhaust opens."""
    count, opening = len(angle), case.opening
    breaking = closed_breaks(case, breaks)
    phi = case.closing
    volume, _ = geometry(math.sin(phi), math.cos(phi), case)
    first = case.charge_gamma - 1.0
    total = first + case.gamma_slope * case.charge_temperature
    transfer = 0.0
    if case.wall == WOSCHNI:
        transfer = transfer_of_woschni(trapped, case.charge_temperature, 0.0, volume, case)
        transfer /= case.wall_ends + case.wall_liner * volume
    gas = Gas(
        total, first / total if total != 0.0 else 1.0, trapped * volume / case.charge_temperature,
        volume, transfer,
    )  # fmt: skip
    y, y_motored, rate, rate_motored = 0.0, 0.0, 0.0, 0.0
    work, loss, hottest = 0.0, 0.0, case.charge_temperature
    following = int(math.ceil((phi - angle[0]) / step - 1e-9))
    lower = 0.0
    while phi < opening - 1e-12:
        # From the start of combustion on, Woschni's motored engine is followed beside.
        two = phi >= start - 1e-12
        width = width_of_combustion(phi, min(WIDEST, width_of_geometry(phi, case)), case)
        target = min(next_break(phi, breaks, breaking), opening)
        behind = end_of_interval(phi, target, width)
        h = behind - phi
        take_closed_points(phi, h, gas, case, points)
        if two:
            y_motored, _, _ = follow_closed(
                h, y_motored, rate_motored, 0.0, two, gas, case, points, motored
            )
            rate_motored = motored.rates[POINTS - 1]
        end, gained, lost = follow_closed(h, y, rate, 1.0, two, gas, case, points, fired)
        work, loss = work + gained, loss + lost
        middle = fit(fired, y, h)
        y, rate = end, fired.rates[POINTS - 1]
        if not two:
            y_motored, rate_motored = y, rate
        mark = angle[0] + following * step
        while mark < behind - 1e-12:
            place = following % count
            volume, growth = geometry(sine[place], cosine[place], case)
            here, gain = curve_at(fired, middle, h, 2.0 * (mark - phi) / h - 1.0)
            temperature, share = state(here, math.log(volume / gas.volume), gas, case)
            hottest = max(hottest, temperature)
            p = gas.mass * temperature / volume
            pressure[place] = p
            slope[place] = p * (share * gain - (gas.total * share + 1.0) * growth / volume)
            following += 1
            mark = angle[0] + following * step
        phi = behind
    volume, growth = geometry(math.sin(opening), math.cos(opening), case)
    logarithm = math.log(volume / gas.volume)
    temperature, share = state(y, logarithm, gas, case)
    hottest = max(hottest, temperature)
    p, gamma_less = gas.mass * temperature / volume, gas.total * share
    summary[0], summary[1] = trapped, hottest
    summary[2] = case.heat * burnt(opening, case) if case.heat > 0.0 else 0.0
    summary[3], summary[4] = work, loss
    if case.wall == POLYTROPIC:
        return p, (case.expansion_exponent, gamma_less, 0.0)
    lost = 0.0
    if case.wall == WOSCHNI:
        if opening >= start:
            lower = gas.mass * state(y_motored, logarithm, gas, case)[0] / volume
        above = (p - lower) / gas.mass if opening >= start else 0.0
        lost = transfer_of_woschni(p, temperature, above, volume, case)
        lost *= temperature - case.wall_temperature
    return p, (gamma_less + 1.0, gamma_less, lost)


@inlined
def take_open_points(phi: float, h: float, period: float, case: Case, points: Points) -> None:
    """What depends on angle alone, at the points of an interval of the open part."""
    take_geometry(phi, h, case, points)
    for i in range(POINTS):
        angle = phi + h * PLACES[i]
        growth = points.growth[i] * points.volume[i]
        opened = smooth_step((angle - case.opening) / case.ramp)
        opened *= smooth_step((case.closing + period - angle) / case.ramp)
        points.heat[i] = opened
        points.power[i] = manifold(angle, growth, case)


@inlined
def take_open_rates(
    phi: float, h: float, after: bool, blown: Blown, case: Case, points: Points, solution: Solution
) -> None:
    """Rates of the pressure of the open cylinder and their derivatives.

    The exponent is that at the closed part's end; `after` the exhaust's opening, not before the
    closing.
    """
    power, gamma_less, constant_loss = blown
    for i in range(POINTS):
        pressure, opened = solution.values[i], points.heat[i]
        slope = -opened / case.lag
        rate = slope * (pressure - points.power[i])
        if opened < 1.0:
            heat, rising = 0.0, 0.0
            if after:
                heat = -constant_loss
                if case.heat > 0.0:
                    heat += case.heat * burning(phi + h * PLACES[i], case)
                heat *= gamma_less
            elif case.wall == WOSCHNI:
                heat = transfer_of_woschni(
                    pressure, case.charge_temperature, 0.0, points.volume[i], case
                )
                heat *= (1.0 - power) * (case.charge_temperature - case.wall_temperature)
                rising = 0.8 * heat / pressure
            closed = (1.0 - opened) / points.volume[i]
            growth = power * points.growth[i] * (1.0 - opened)
            rate += closed * heat - growth * pressure
            slope += closed * rising - growth
        solution.rates[i], solution.slopes[i] = rate, slope


@inlined
def open_part(
    phi: float,
    p: float,
    angle: Floats,
    step: float,
    period: float,
    case: Case,
    points: Points,
    solution: Solution,
    pressure: Floats,
    slope: Floats,
    blown: Blown,
    breaks: Floats,
) -> float:
    """Follow the open cylinder from an angle on; its pressure when it has closed."""
    count, end = len(angle), case.closing + period
    middle = 0.5 * (case.opening + end)
    breaking = open_breaks(case, period, breaks)
    following = int(math.ceil((phi - angle[0]) / step - 1e-9))
    across = math.acosh(1.0 / (case.crank_ratio * (1.0 + abs(case.offset_ratio))))
    widest = min(WIDEST, PART_OF_DISTANCE * across, LAGS_OF_INTERVAL * case.lag)
    before = case.charge_gamma
    if case.wall == POLYTROPIC:
        before = case.compression_exponent
    nonlinear = case.wall == WOSCHNI
    while phi < end - 1e-12:
        after = phi < middle - 1e-12
        width = widest
        if phi < case.opening + case.ramp - 1e-12 or phi > end - case.ramp - 1e-12:
            width = min(width, case.ramp / PARTS_OF_RAMP)
        if after:
            width = width_of_combustion(phi, width, case)
        target = min(next_break(phi, breaks, breaking), end)
        behind = end_of_interval(phi, target, width)
        h = behind - phi
        take_open_points(phi, h, period, case, points)
        guess(solution, p, 0.0, h)
        last = p
        for _ in range(MOST_IMPROVEMENTS):
            of_gas = blown if after else (before, 0.0, 0.0)
            take_open_rates(phi, h, after, of_gas, case, points, solution)
            last, change = improve(solution, p, h)
            if not (nonlinear and phi > end - case.ramp - 1e-9) or change < NEAR * p:
                break
        centre = fit(solution, p, h)
        mark = angle[0] + following * step
        while mark < behind - 1e-12:
            place = following % count
            here, gain = curve_at(solution, centre, h, 2.0 * (mark - phi) / h - 1.0)
            pressure[place], slope[place] = here, gain
            following += 1
            mark = angle[0] + following * step
        p, phi = last, behind
    return p


@inlined
def follow(
    case: Case,
    period: float,
    angle: Floats,
    sine: Floats,
    cosine: Floats,
    points: Points,
    fired: Solution,
    motored: Solution,
    pressure: Floats,
    slope: Floats,
    summary: Floats,
    breaks: Floats,
) -> int:
    """Follow a cycle until it repeats; its outcome."""
    step = period / len(angle)
    start = math.inf
    if case.heat > 0.0 and case.share > 0.0:
        start = case.start
    if case.heat > 0.0 and case.share < 1.0:
        start = min(start, case.second_start)
    if case.wall != WOSCHNI:
        start = math.inf

    # Half an open part, from the manifold's pressure, begins near the first cycle's pressure.
    middle = 0.5 * (case.opening + case.closing + period)
    _, growth = geometry(math.sin(middle), math.cos(middle), case)
    p = open_part(
        middle, manifold(middle, growth, case), angle, step, period, case, points, fired, pressure,
        slope, (case.charge_gamma, 0.0, 0.0), breaks,
    )  # fmt: skip
    for _ in range(MOST_PASSES):
        trapped = p
        p, blown = closed_part(
            trapped, start, angle, sine, cosine, step, case, points, fired, motored, pressure,
            slope, summary, breaks,
        )  # fmt: skip
        if case.gamma_slope > 0.0 and summary[1] > HOTTEST:
            return status.INVALID_INPUT
        p = open_part(
            case.opening, p, angle, step, period, case, points, fired, pressure, slope, blown,
            breaks,
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
        r[27], r[28], r[29], r[30], r[31], r[32], r[33], r[34], r[35], r[36],
    )  # fmt: skip


@kernel
def integrate(
    cases: Floats, rows: Integers, period: float, angle: Floats, sine: Floats, cosine: Floats,
    pressures: Floats, slopes: Floats, summary: Floats, outcome: Integers, memory: Floats,
) -> None:  # fmt: skip
    """Fill in the rows `rows` of the tables; `sine` and `cosine` are those of `angle`.

    `memory` is scratch, see `new_memory`.
    """
    of_angle, own, other, breaks = memory[0], memory[1], memory[2], memory[3, 0]
    points = Points(of_angle[0], of_angle[1], of_angle[2], of_angle[3], of_angle[4], of_angle[5])
    fired = Solution(own[0], own[1], own[2], own[3], own[4], own[5])
    motored = Solution(other[0], other[1], other[2], other[3], other[4], other[5])
    for index in range(len(rows)):
        row = rows[index]
        outcome[row] = follow(
            _case_of(cases[row]), period, angle, sine, cosine, points, fired, motored,
            pressures[row], slopes[row], summary[row], breaks,
        )  # fmt: skip
        if outcome[row] != status.CONVERGED:
            for j in range(len(angle)):
                pressures[row, j] = slopes[row, j] = math.nan
            for j in range(len(summary[row])):
                summary[row, j] = math.nan


def new_memory() -> Floats:
    """Scratch of `integrate`: at the points of an interval, and where intervals have to end."""
    return np.zeros((4, 6, max(POINTS, MOST_BREAKS)))
