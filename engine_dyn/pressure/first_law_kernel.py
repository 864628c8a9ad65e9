"""Steps of the first-law cycles: the kernel behind `first_law`.

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
from engine_dyn.geometry.slider_crank import sum_of_angles
from engine_dyn.pressure.collocation import (
    PLACES,
    POINTS,
    WEIGHTS,
    Solution,
    curve_at,
    fit,
    guess,
    improve,
    short_turn,
)
from engine_dyn.pressure.first_law_formulas import (
    EXPONENT_REACH,
    HOTTEST,
    POLYTROPIC,
    WOSCHNI,
    WOSCHNI_COMBUSTION,
    Case,
    Gas,
    burning,
    burnt,
    exp,
    exponent,
    geometry,
    manifold,
    smooth_step,
    state,
    transfer_of_woschni,
)
from engine_dyn.types import Floats, Integers
from engine_dyn.units import DEGREE

MOST_BREAKS = 32  # Largest number of angles at which integration intervals have to end

# Largest widths of an interval: an angle, parts of a combustion, of a valve's lag and of its ramp,
# and part of the distance to the complex angle where the volume would be 0 or the rod would stand
# across. Narrower intervals change no pressure by more than 1e-9 of the largest.
WIDEST = 16.0 * DEGREE
PARTS_OF_COMBUSTION = 5.0
LAGS_OF_INTERVAL = 1.7
PARTS_OF_RAMP = 2.0
PART_OF_DISTANCE = 0.6
# Number of times that intervals double after the start of a combustion: a rate like (phi - start)^m
# has no derivatives there beyond m, so the first intervals are small.
DOUBLINGS = 6
MOST_IMPROVEMENTS = 20
NEAR = 1e-10
"""Change of values below which Newton's method ends; its next step would be lost in rounding."""

MOST_PASSES = 60  # Largest number of cycles that are followed until the pressure repeats

Blown = tuple[float, float, float]
"""Exponent, gamma - 1 and heat loss at the end of the closed part of the cycle."""


class Points(NamedTuple):
    """Values that depend on the angle alone, at the points of an interval; arrays.

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
    """Values that depend on the angle alone, in an interval of the closed part."""
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
            # d(lost)/dy of the solved variable y, where g = gamma - 1 depends on the temperature.
            rising = pressure * volume * points.growth[i] * ((points.power[i] - 1.0) / g - share)
        elif case.wall == WOSCHNI:
            # Logarithm of the ratio of p^0.8 T^-0.55 (Woschni) to its value in the trapped charge.
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
    # Near dead centre the volume is about c + (1 + lambda) phi^2/4, with the clearance c.
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
        # From the start of combustion on, Woschni's motored pressure is integrated as well.
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
    """Values that depend on the angle alone, in an interval of the open part."""
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
    before = case.compression_exponent if case.wall == POLYTROPIC else case.charge_gamma
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
    if case.wall == WOSCHNI and case.heat > 0.0:
        if case.share > 0.0:
            start = case.start
        if case.share < 1.0:
            start = min(start, case.second_start)
    # The first cycle starts in the middle of the angles at which the cylinder is open, with the
    # manifold's pressure.
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
        if abs(p - trapped) <= 1e-12 * trapped:
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
