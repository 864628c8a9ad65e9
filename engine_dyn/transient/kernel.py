"""Designs followed in time, one after the other: steps over the crank angle and events in them.

A step lies between two nodes. Within it, the run goes from event to event: points and steps of the
load, samples of the governor at given times, the clutch, the starter's freewheel and its release.
Commands of cylinders and samples at firings are at nodes.
"""

from __future__ import annotations

import math

from engine_dyn import status
from engine_dyn.compilation import inlined, kernel
from engine_dyn.transient import slow
from engine_dyn.transient.fields import AT, Found, Given
from engine_dyn.transient.governor import ACTUATOR, actuator_at, begin_governor, sample, take
from engine_dyn.transient.lobatto import dot, fit, integral_at, largest, reaches, value_at, weigh
from engine_dyn.transient.step import solve
from engine_dyn.transient.tables import Tables
from engine_dyn.transient.work import SWITCH, Law, Work, begin_series
from engine_dyn.types import Floats

FASTEST = 3.0
"""Speed over the nominal one at which a run ends: no engine survives it."""

GOING = -1  # Outcome of a run that goes on
MOST_EVENTS = 100  # In a step; beyond it, speeds are no longer looked for in it
MOST_SWINGS = 100  # Standstills after which a shaft swings to and fro, and has stopped
MOST_PIECES = 200  # Pieces of time in a step, mean of a cycle

INERTIA, RECIPROCATING = AT["inertia"], AT["reciprocating_inertia"]
LEVER, GAS_FACTOR = AT["lever"], AT["gas_factor"]
SPEED, START_SPEED, START_COMMAND = AT["speed"], AT["start_speed"], AT["start_command"]
EXPONENT, OFFSET, DURATION = AT["load_exponent"], AT["load_offset"], AT["duration"]
CONSTANT, PEAK_SHARE = AT["friction_constant"], AT["friction_peak_share"]
LINEAR, SQUARE, BAND = AT["friction_linear"], AT["friction_square"], AT["recovery_band"]
GOVERNED, SAMPLING_TIME, STARTER = AT["governed"], AT["sampling_time"], AT["starter_torque"]
STARTER_SPEED, RELEASE, READY = AT["starter_speed"], AT["starter_release"], AT["ready_speed"]
FUEL_FROM, FUEL_CUT, CLUTCH_TIME = AT["fuel_from"], AT["fuel_cut"], AT["clutch_time"]
CLUTCH_INERTIA, CLUTCH_SPEED = AT["clutch_inertia"], AT["clutch_speed"]
CLUTCH_TORQUE = AT["clutch_torque"]

OPEN, SLIPPING, LOCKED = range(3)
SYNCHRONOUS, IS_READY = slow.KINDS, slow.KINDS + 1  # Ends of a piece of the crank angle besides
LAST_KIND = IS_READY + 1


@kernel
def follow(
    first: int, last: int, cycles: int, tables: Tables, given: Given, work: Work, found: Found
) -> None:
    """Follow the designs from `first` up to, without, `last` for so many cycles at most.

    Those whose outcome is invalid input are left out; arrays must be filled with NaN before.
    """
    for d in range(first, last):
        if found.outcome[d] != status.INVALID_INPUT:
            outcome, firings = _run(d, cycles, tables, given, work, found)
            _measure(d, firings, outcome, tables, given, work, found)
            found.outcome[d] = outcome


@inlined
def _interpolated(time: float, times: Floats, values: Floats) -> float:
    """Value of points joined by lines, constant before and after."""
    last = len(times) - 1
    if time < times[0]:
        return values[0]
    for k in range(last):
        if time < times[k + 1]:
            return values[k] + (values[k + 1] - values[k]) * (
                (time - times[k]) / (times[k + 1] - times[k])
            )
    return values[last]


@inlined
def _other_speed(time: float, slip: float, numbers: Floats) -> float:
    """Speed of the inertia behind the slipping clutch."""
    rate = slip * numbers[CLUTCH_TORQUE] / max(numbers[CLUTCH_INERTIA], 1e-300)
    return numbers[CLUTCH_SPEED] + rate * (time - numbers[CLUTCH_TIME])


@inlined
def _inertia(n: int, inertia: float, numbers: Floats, tables: Tables, work: Work) -> None:
    """Put 2 over the inertia at the points of a step into `work`."""
    for k in range(5):
        work.inverse[k] = 2.0 / (inertia + numbers[RECIPROCATING] * tables.squares[n, k])


@inlined
def _friction(numbers: Floats, tables: Tables, work: Work) -> float:
    """Friction torque that does not depend on the speed, with the peak pressures of this cycle."""
    total = 0.0
    for i in range(len(work.held)):
        row = work.row[i]
        total += tables.peaks[row] + work.part[i] * (tables.peaks[row + 1] - tables.peaks[row])
    share = numbers[PEAK_SHARE] * numbers[GAS_FACTOR]
    return numbers[CONSTANT] + share * total / len(work.held)


@inlined
def _is_missed(d: int, cycle: int, cylinder: int, given: Given) -> bool:
    design = d if given.missed.shape[0] > 1 else 0
    for m in range(given.missed.shape[1]):
        if given.missed[design, m, 0] == cycle and given.missed[design, m, 1] == cylinder:
            return True
    return False


@inlined
def _commands(
    d: int, cycle: int, n: int, beginning: bool, time: float, square: float, tables: Tables,
    given: Given, work: Work,
) -> None:  # fmt: skip
    """Give their commands to the cylinders that take them at a node, in the beginning to all."""
    numbers = given.numbers[d]
    if numbers[GOVERNED] > 0.0:
        command = actuator_at(time, numbers, work)
    else:
        times = given.command_time[d if given.command_time.shape[0] > 1 else 0]
        command = _interpolated(time, times, given.command[d if given.command.shape[0] > 1 else 0])
        work.state[ACTUATOR] = command
    cut = square < numbers[FUEL_FROM] * numbers[FUEL_FROM] or time >= numbers[FUEL_CUT]
    for i in range(len(work.held)):
        if beginning or tables.takes[i] == n:
            target = 0 if beginning else cycle + tables.early[i]
            off = cut or _is_missed(d, target, i, given)
            take(i, target, command, off, time, tables, numbers, work)


@inlined
def _piece_of_time(
    place: float, omega: float, later: float, longest: float, way: float, width: float,
    starter: float, overrun: bool, slowest: float, law: Law, numbers: Floats, work: Work,
) -> tuple[float, float, float, int]:  # fmt: skip
    """Place, speed, time taken and the kind of the end, at most after the longest time."""
    push, top, release = 0.0 if overrun else starter, numbers[STARTER_SPEED], numbers[RELEASE]
    ends = 0.0 if starter == 0.0 else (-1.0 if overrun else 1.0)
    s1, w1, dt, kind = place, omega, longest, 0
    for what in range(slow.KINDS):
        if (what == slow.STANDSTILL and omega == 0.0) or (what >= slow.OVERRUN and starter == 0.0):
            continue
        low, high, halvings = 0.0, dt, 1
        if what > 0:
            halvings = 60
            if not slow.excess(what, s1, w1, way, ends, top, release) > 0.0:
                continue
        for _ in range(halvings):
            middle = dt if what == 0 else 0.5 * (low + high)
            sm, wm = slow.moved(
                place, omega, later, middle, way, width, push, top, slowest, work.work_power,
                work.inertia_power, law,
            )  # fmt: skip
            if slow.excess(what, sm, wm, way, ends, top, release) > 0.0:
                high, s1, w1 = middle, sm, wm
            else:
                low = middle
        if what > 0:
            dt, kind = high, what
    return s1, w1, dt, kind


@inlined
def _place_of_time(wanted: float, time: float, place: float, width: float, work: Work) -> float:
    """Place in a step at a time that lies in it, by Newton's method."""
    fit(work.slowness, work.power)
    end = place + (1.0 - place) * (wanted - time) / (work.time[4] - time)
    for _ in range(8):
        miss = wanted - work.time[0] - width * integral_at(end, work.power)
        end = min(max(end + miss / (width * value_at(end, work.power)), place), 1.0)
    return end


@inlined
def _passed_speed(
    place: float, end: float, starter: float, overrun: bool, slipping: bool, slip: float,
    started: bool, numbers: Floats, work: Work,
) -> tuple[float, int]:  # fmt: skip
    """First place up to `end` where the speed passes one that matters, and the kind of it."""
    kind, top = 0, numbers[STARTER_SPEED]
    for what in range(slow.OVERRUN, LAST_KIND):
        sign, level = 0.0, 0.0
        if what == slow.OVERRUN and starter > 0.0:
            sign, level = -1.0 if overrun else 1.0, top
        elif what == slow.RELEASED and starter > 0.0:
            sign, level = 1.0, numbers[RELEASE]
        elif what == SYNCHRONOUS and slipping:
            sign = -slip
        elif what == IS_READY and not started:
            sign, level = 1.0, numbers[READY]
        if sign == 0.0 or not level < math.inf:
            continue
        past = False
        for k in range(5):
            other = _other_speed(work.time[k], slip, numbers) if what == SYNCHRONOUS else level
            work.gap[k] = work.omega[k] - other
            past = past or sign * work.gap[k] > 0.0
        if past:
            fit(work.gap, work.power)
            where = reaches(0.0, place, end, work.power, sign)
            if where <= end:
                end, kind = where, what
    return end, kind


@inlined
def _extremes(
    n: int, place: float, end: float, width: float, highest: float, lowest: float, tables: Tables,
    numbers: Floats, work: Work,
) -> tuple[float, float]:  # fmt: skip
    """Squares of the largest and the smallest speed so far, with those of a piece."""
    square = work.square
    fast = max(max(max(square[0], square[1]), max(square[2], square[3])), square[4])
    calm = min(min(min(square[0], square[1]), min(square[2], square[3])), square[4])
    # Between points an extreme lies beyond them by less than this.
    beyond = 0.5 * (fast - calm)
    if fast + beyond >= highest or calm - beyond <= lowest:
        for k in range(5):
            torque, place_of = 0.0, 5 * n + k
            for i in range(len(work.held)):
                lower = tables.torques[i, work.row[i], place_of]
                upper = tables.torques[i, work.row[i] + 1, place_of]
                torque += lower + work.part[i] * (upper - lower)
            torque = numbers[GAS_FACTOR] * torque - tables.crankcase_torques[place_of]
            torque = numbers[LEVER] * torque + work.rate[k]
            torque -= 0.5 * square[k] * numbers[RECIPROCATING] * tables.squares[n, 5 + k]
            work.slope[k] = width * work.inverse[k] * torque
        for sign in (1.0, -1.0):
            best = sign * largest(place, end, square, work.slope, work.power10, sign)
            if sign > 0.0:
                highest = max(highest, min(best, fast + beyond))
            else:
                lowest = min(lowest, max(best, max(calm - beyond, 0.5 * calm)))
    return highest, lowest


@inlined
def _run(
    d: int, cycles: int, tables: Tables, given: Given, work: Work, found: Found
) -> tuple[int, int]:
    """Outcome of one design and the number of its firings; longer than others: one state machine.

    Its many variables are numbers in registers; as arrays of a state they took half as long again.
    """
    numbers = given.numbers[d]
    steps, period = len(tables.fires), tables.period
    nominal = numbers[SPEED]
    slowest = SWITCH * nominal
    load_times = given.load_time[d if given.load_time.shape[0] > 1 else 0]
    loads = given.load_torque[d if given.load_torque.shape[0] > 1 else 0]
    half = 0.5 * numbers[EXPONENT]
    begin_series(half, work)
    begin_governor(numbers[START_COMMAND], numbers[START_SPEED], work)
    governed, every = numbers[GOVERNED] > 0.0, numbers[SAMPLING_TIME]
    time, inertia = 0.0, numbers[INERTIA]
    square = numbers[START_SPEED] * numbers[START_SPEED]
    omega = numbers[START_SPEED]
    for k in range(4 * steps):
        work.all_gas[k] = -numbers[LEVER] * tables.crankcase_gas[k]
    for i in range(len(work.held)):
        work.held[i] = numbers[START_COMMAND]
        for k in range(4 * steps):
            work.own[i, k] = 0.0
    passed, samples = 0, 0
    clutch, slip = OPEN, 0.0
    starter = numbers[STARTER]
    top, overrun = numbers[STARTER_SPEED], omega >= numbers[STARTER_SPEED]
    started = omega >= numbers[READY]
    if started:
        found.run[d, 0] = 0.0
    from_rest = not omega > slowest
    cut_at, swings, firings, per_cycle = -1.0, 0, 0, 0
    for n in range(steps):
        per_cycle += tables.fires[n]
    outcome, cycle, n, place, fresh, beginning = GOING, 0, 0, 0.0, True, True
    friction = 0.0
    highest = lowest = square
    turned, pieces = 0.0, 0
    load, ramp, since, next_time = 0.0, 0.0, 0.0, -math.inf
    while outcome == GOING:
        width = tables.nodes[n + 1] - tables.nodes[n]
        angle = cycle * period + tables.nodes[n]
        if fresh:
            fresh = False
            if cut_at < 0.0 and time >= numbers[FUEL_CUT]:
                cut_at = angle
            if tables.fires[n]:
                mean = numbers[START_SPEED]
                if firings >= per_cycle:
                    mean = period / (time - work.trace_time[firings - per_cycle])
                elif time > 0.0:
                    mean = angle / time
                work.trace_time[firings], work.trace_speed[firings] = time, mean
                firings += 1
                if governed and every == 0.0:
                    sample(time, angle, numbers, work)
            if beginning or tables.taken[n]:
                _commands(d, cycle, n, beginning, time, square, tables, given, work)
                friction = _friction(numbers, tables, work)
            beginning = False
        for k in range(4):
            work.gas[k + 1] = work.all_gas[4 * n + k]
        _inertia(n, inertia, numbers, tables, work)
        by_time = place > 0.0 or not square > slowest * slowest
        energy = square / work.inverse[0] if place == 0.0 else 0.0
        y, events, end_of_step = 0.0, 0, False
        if given.first_recorded <= cycle < given.last_recorded:
            point = (cycle - given.first_recorded) * steps + n
            _record(d, point, angle, time, omega, half, load, ramp, since, numbers, work, found)
        fitted = False
        while outcome == GOING and not end_of_step:
            # --- what holds until the next event
            while time >= next_time:
                next_time = math.inf
                while passed < len(load_times) and load_times[passed] <= time:
                    passed += 1
                load, ramp, since = loads[max(passed - 1, 0)], 0.0, time
                if 0 < passed < len(load_times):
                    gap = load_times[passed] - load_times[passed - 1]
                    ramp = (loads[passed] - loads[passed - 1]) / gap
                    load += ramp * (time - load_times[passed - 1])
                if passed < len(load_times):
                    next_time = load_times[passed]
                if governed and every > 0.0:
                    if samples * every <= time:
                        sample(time, angle + place * width, numbers, work)
                        while samples * every <= time:
                            samples += 1
                    next_time = min(next_time, samples * every)
                if clutch == OPEN and numbers[CLUTCH_TIME] <= time:
                    slip = 1.0 if omega > numbers[CLUTCH_SPEED] else -1.0
                    clutch = SLIPPING
                    if not numbers[CLUTCH_TORQUE] < math.inf or omega == numbers[CLUTCH_SPEED]:
                        weigh(place, work.end_integral, work.end_value)
                        own, more = 2.0 / dot(work.end_value, work.inverse), numbers[CLUTCH_INERTIA]
                        both = (own * omega + more * numbers[CLUTCH_SPEED]) / (own + more)
                        y += 0.5 * (own + more) * both * both - 0.5 * own * omega * omega
                        clutch, omega, square = LOCKED, both, both * both
                        inertia, fitted = inertia + more, False
                        _inertia(n, inertia, numbers, tables, work)
                elif clutch == OPEN:
                    next_time = min(next_time, numbers[CLUTCH_TIME])
                work.series[12] = 0.0
            dry = friction + numbers[OFFSET]
            if clutch == SLIPPING:
                dry += slip * numbers[CLUTCH_TORQUE]
            if by_time:
                # --- a piece of time
                if not fitted:
                    for k in range(5):
                        work.gap[k] = 2.0 / work.inverse[k]
                    fit(work.gap, work.inertia_power)
                    fit(work.gas, work.work_power)
                    fitted = True
                law = Law(dry, numbers[LINEAR], numbers[SQUARE], load, ramp, since,
                          1.0 / (nominal * nominal), half)  # fmt: skip
                push = 0.0 if overrun else starter
                later = time - since
                way = 1.0 if omega > 0.0 else -1.0
                if omega == 0.0:
                    rest = slow.against(0.0, later, law, slowest)
                    torque = slow.drive(place, width, work.work_power) + push
                    if rest < 0.0:
                        torque, rest = torque - rest, 0.0
                    way = 1.0 if torque > 0.0 else -1.0
                    if abs(torque) <= rest or swings > MOST_SWINGS:
                        outcome = status.STOPPED
                        break
                dt = width / (slow.SUBSTEPS * max(abs(omega), 0.2 * slowest))
                dt = next_time - time if time + dt >= next_time else dt
                s1, w1, dt, kind = _piece_of_time(
                    place, omega, later, dt, way, width, starter, overrun, slowest, law, numbers,
                    work,
                )  # fmt: skip
                if not abs(w1) <= FASTEST * nominal:
                    outcome = status.RUNAWAY
                    break
                time = next_time if time + dt >= next_time else time + dt
                turned += 0.5 * (omega + w1) * (s1 - place) * width
                place, omega = s1, w1
                if kind == slow.STANDSTILL:
                    omega = 0.0
                    swings += 1
                square = omega * omega
                highest, lowest = max(highest, square), min(lowest, square)
                if not started and omega >= numbers[READY]:
                    started, found.run[d, 0] = True, time
                behind = slip * (omega - _other_speed(time, slip, numbers))
                if clutch == SLIPPING and behind <= 0.0:
                    clutch, inertia, fitted = LOCKED, inertia + numbers[CLUTCH_INERTIA], False
                    _inertia(n, inertia, numbers, tables, work)
                if kind == slow.OVERRUN:
                    overrun, omega = not overrun, top
                elif kind == slow.RELEASED:
                    starter, overrun = 0.0, False
                elif kind == slow.END:
                    n, place, fresh, end_of_step = n + 1, 0.0, True, True
                elif kind == slow.BEGIN:
                    if n <= tables.back_to[n]:
                        outcome = status.STOPPED
                    else:
                        n, place, end_of_step = n - 1, 1.0, True
                pieces += 1
                if pieces > MOST_PIECES * steps:
                    outcome = status.NOT_CONVERGED
                continue
            # --- a piece of the crank angle
            push = 0.0 if overrun else starter
            law = Law(dry - push, numbers[LINEAR] + push / top, numbers[SQUARE], load, ramp, since,
                      1.0 / (nominal * nominal), half)  # fmt: skip
            solved, y0, y4 = solve(
                energy, y, time, place, square, width, 0.25 * slowest * slowest, law, work
            )
            if not solved:
                by_time, omega = True, math.sqrt(square)
                continue
            end, kind = 1.0, 0
            timed = work.time[4] >= next_time
            if timed:
                end = _place_of_time(next_time, time, place, width, work)
            events += 1
            if events <= MOST_EVENTS and (starter > 0.0 or clutch == SLIPPING or not started):
                end, kind = _passed_speed(
                    place, end, starter, overrun, clutch == SLIPPING, slip, started, numbers, work
                )
            weigh(end, work.end_integral, work.end_value)
            highest, lowest = _extremes(
                n, place, end, width, highest, lowest, tables, numbers, work
            )
            turned += width * dot(work.end_integral, work.omega)
            if place > 0.0:
                turned -= width * dot(work.begin_integral, work.omega)
            if end == 1.0:
                y, square, time = y4, work.square[4], work.time[4]
            else:
                y = y0 + width * dot(work.end_integral, work.rate)
                time = work.time[0] + width * dot(work.end_integral, work.slowness)
                square = dot(work.end_value, work.square)
            if timed and kind == 0:
                time = next_time
            place, omega = end, math.sqrt(square)
            if kind == slow.OVERRUN:
                overrun, work.series[12] = not overrun, 0.0
            elif kind == slow.RELEASED:
                starter, overrun, work.series[12] = 0.0, False, 0.0
            elif kind == IS_READY:
                started, found.run[d, 0] = True, time
            elif kind == SYNCHRONOUS:
                more = numbers[CLUTCH_INERTIA]
                clutch, inertia, y = LOCKED, inertia + more, y + 0.5 * more * square
                _inertia(n, inertia, numbers, tables, work)
            if place >= 1.0:
                n, place, fresh, end_of_step = n + 1, 0.0, True, True
        if outcome == GOING and square > (FASTEST * nominal) ** 2:
            outcome = status.RUNAWAY
        if outcome == GOING and n == steps:
            _store(d, cycle, time, omega, turned / period, highest, lowest, work, found)
            cycle, n, turned, highest, lowest, pieces = cycle + 1, 0, 0.0, square, square, 0
            if cycle == cycles or time >= numbers[DURATION]:
                outcome = status.FOLLOWED
                if cycle <= given.last_recorded and cycle > given.first_recorded:
                    point = (cycle - given.first_recorded) * steps
                    _record(d, point, cycle * period, time, omega, half, load, ramp, since, numbers,
                            work, found)  # fmt: skip
    if from_rest and not started and outcome != status.RUNAWAY:
        outcome = status.NOT_STARTED
    found.run[d, 1], found.run[d, 2] = time, cycle
    angle = tables.nodes[n] + place * width if 0 <= n < steps else 0.0
    if outcome == status.STOPPED and cut_at >= 0.0:
        found.run[d, 3] = cycle + (angle - cut_at) / period
    found.run[d, 4] = angle
    return outcome, firings


@inlined
def _store(
    d: int, cycle: int, time: float, omega: float, mean: float, highest: float, lowest: float,
    work: Work, found: Found,
) -> None:  # fmt: skip
    total = 0.0
    for i in range(len(work.held)):
        total += work.held[i]
    row = found.cycles[d, cycle]
    row[0], row[1], row[2] = time, omega, mean
    row[3], row[4] = math.sqrt(highest), math.sqrt(lowest)
    row[5], row[6] = work.state[ACTUATOR], total / len(work.held)


@inlined
def _record(
    d: int, point: int, angle: float, time: float, omega: float, half: float, load: float,
    ramp: float, since: float, numbers: Floats, work: Work, found: Found,
) -> None:  # fmt: skip
    torque = load + ramp * (time - since)
    if half != 0.0:
        torque *= (max(omega, 1e-9) / numbers[SPEED]) ** (2.0 * half)
    row = found.curves[d, point]
    row[0], row[1], row[2] = angle, time, omega
    row[3], row[4] = torque + numbers[OFFSET], work.state[0]


@inlined
def _measure(
    d: int, firings: int, outcome: int, tables: Tables, given: Given, work: Work, found: Found
) -> None:
    """Deviations and times of recovery, of the speed that is averaged over a cycle."""
    marks = given.marks[d if given.marks.shape[0] > 1 else 0]
    band = given.numbers[d, BAND] * given.numbers[d, SPEED]
    per_cycle = 0
    for n in range(len(tables.fires)):
        per_cycle += tables.fires[n]
    times, speeds = work.trace_time, work.trace_speed
    f = 0
    for m in range(len(marks)):
        until = marks[m + 1] if m + 1 < len(marks) else math.inf
        while f < firings and times[f] <= marks[m]:
            f += 1
        if f == 0 or f == firings:
            continue
        begin, end = f, f
        low = high = speeds[begin]
        while end < firings and times[end] <= until:
            low, high = min(low, speeds[end]), max(high, speeds[end])
            end += 1
        if end == begin:
            continue
        row = found.marks[d, m]
        after = speeds[end - 1]
        row[0], row[1], row[2], row[3] = speeds[begin - 1], low, high, after
        outside = end - 1
        while outside >= begin and abs(speeds[outside] - after) <= band:
            outside -= 1
        if outside < begin:
            row[4] = 0.0
        elif outside + per_cycle < end and outcome == status.FOLLOWED:
            # The speed passes the edge of the band between two firings.
            edge = after + (band if speeds[outside] > after else -band)
            part = (edge - speeds[outside]) / (speeds[outside + 1] - speeds[outside])
            row[4] = times[outside] + part * (times[outside + 1] - times[outside]) - marks[m]
