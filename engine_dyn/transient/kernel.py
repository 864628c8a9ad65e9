"""Designs followed in time, one after the other: steps over the crank angle and events in them.

A step lies between two nodes. Within it, the run goes from event to event: points and steps of the
load, samples of the governor at given times, the clutch, the starter's freewheel and its release.
Commands of cylinders and samples at firings are at nodes.
"""

from __future__ import annotations

import math

import numpy as np

from engine_dyn import status
from engine_dyn.compilation import inlined, kernel
from engine_dyn.transient import slow
from engine_dyn.transient.changes import measure
from engine_dyn.transient.fields import AT, Found, Given
from engine_dyn.transient.governor import ACTUATOR, actuator_at, begin_governor, sample, take
from engine_dyn.transient.lobatto import (
    dot,
    fit,
    integral_at,
    integrated,
    largest,
    reaches,
    value_at,
    weigh,
)
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
LINEAR, SQUARE = AT["friction_linear"], AT["friction_square"]
GOVERNED, SAMPLING_TIME = AT["governed"], AT["sampling_time"]
STARTER_TORQUE, STARTER_SPEED = AT["starter_torque"], AT["starter_speed"]
RELEASE, READY = AT["starter_release"], AT["ready_speed"]
FUEL_FROM, FUEL_CUT, CLUTCH_TIME = AT["fuel_from"], AT["fuel_cut"], AT["clutch_time"]
CLUTCH_INERTIA, CLUTCH_SPEED = AT["clutch_inertia"], AT["clutch_speed"]
CLUTCH_TORQUE = AT["clutch_torque"]

OPEN, SLIPPING, LOCKED = range(3)
SYNCHRONOUS, IS_READY = slow.KINDS, slow.KINDS + 1  # Ends of a piece of the crank angle besides
LAST_KIND = IS_READY + 1
REFUSED = -1  # A piece of the crank angle that is too slow for it

# Places in `Work.run`: inertia without its change over the angle; the load and its rate since a
# time; when the next event in time is; friction at no speed; torque of the starter at rest; sense
# of the clutch's slip; angle of the fuel cut; integral of the speed over the angle in this cycle,
# and the squares of its extremes.
(
    TURNING, LOAD, RAMP, SINCE, NEXT, FRICTION, STARTER, SLIP, CUT_AT, TURNED, HIGHEST, LOWEST,
) = range(12)  # fmt: skip

# Places in `Work.counts`: points of the load that have passed; samples at given times; the clutch;
# whether the freewheel overruns, and the engine has started; firings; standstills; pieces of time
# in this cycle; pieces of this step; the outcome.
(
    PASSED, SAMPLED, CLUTCH, OVERRUN, STARTED, FIRINGS, SWINGS, PIECES, EVENTS, OUTCOME,
) = range(10)  # fmt: skip


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
def _inertia(n: int, numbers: Floats, tables: Tables, work: Work) -> None:
    """Put 2 over the inertia at the points of a step into `work`."""
    for k in range(5):
        work.inverse[k] = 2.0 / (work.run[TURNING] + numbers[RECIPROCATING] * tables.squares[n, k])


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
    d: int, cycle: int, n: int, time: float, omega: float, tables: Tables, given: Given,
    work: Work,
) -> None:  # fmt: skip
    """Give their commands to the cylinders that take them at a node, in the beginning to all."""
    numbers, beginning = given.numbers[d], time == 0.0
    if numbers[GOVERNED] > 0.0:
        command = actuator_at(time, numbers, work)
    else:
        times = given.command_time[d if given.command_time.shape[0] > 1 else 0]
        command = _interpolated(time, times, given.command[d if given.command.shape[0] > 1 else 0])
        work.state[ACTUATOR] = command
    cut = abs(omega) < numbers[FUEL_FROM] or time >= numbers[FUEL_CUT]
    for i in range(len(work.held)):
        if beginning or tables.takes[i] == n:
            target = cycle + tables.early[i] if tables.takes[i] == n else 0
            off = cut or _is_missed(d, target, i, given)
            take(i, target, command, off, time, tables, numbers, work)


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
    place: float, end: float, kind: int, numbers: Floats, work: Work
) -> tuple[float, int]:
    """First place up to `end` where the speed passes one that matters, and the kind of it."""
    count, slip = work.counts, work.run[SLIP]
    for what in range(slow.OVERRUN, LAST_KIND):
        sign, level = 0.0, 0.0
        if what == slow.OVERRUN and work.run[STARTER] > 0.0:
            sign, level = -1.0 if count[OVERRUN] else 1.0, numbers[STARTER_SPEED]
        elif what == slow.RELEASED and work.run[STARTER] > 0.0:
            sign, level = 1.0, numbers[RELEASE]
        elif what == SYNCHRONOUS and count[CLUTCH] == SLIPPING:
            sign = -slip
        elif what == IS_READY and count[STARTED] == 0:
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
    n: int, place: float, end: float, width: float, tables: Tables, numbers: Floats, work: Work
) -> None:
    """Compare the squares of the largest and the smallest speed so far with those of a piece."""
    run, square = work.run, work.square
    fast = max(max(max(square[0], square[1]), max(square[2], square[3])), square[4])
    calm = min(min(min(square[0], square[1]), min(square[2], square[3])), square[4])
    # Between points an extreme lies beyond them by less than this.
    beyond = 0.5 * (fast - calm)
    if fast + beyond >= run[HIGHEST] or calm - beyond <= run[LOWEST]:
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
                run[HIGHEST] = max(run[HIGHEST], min(best, fast + beyond))
            else:
                run[LOWEST] = min(run[LOWEST], max(best, max(calm - beyond, 0.5 * calm)))


@inlined
def _begin(d: int, tables: Tables, given: Given, work: Work, found: Found) -> None:
    """Make the memory that of a design at the beginning of its run."""
    numbers, run, count = given.numbers[d], work.run, work.counts
    speed = numbers[START_SPEED]
    begin_series(0.5 * numbers[EXPONENT], work)
    begin_governor(numbers[START_COMMAND], speed, work)
    for k in range(len(run)):
        run[k] = 0.0
    for k in range(len(count)):
        count[k] = 0
    run[TURNING], run[STARTER] = numbers[INERTIA], numbers[STARTER_TORQUE]
    run[NEXT], run[CUT_AT] = -math.inf, -1.0
    run[HIGHEST] = run[LOWEST] = speed * speed
    count[OUTCOME] = GOING
    count[OVERRUN] = speed >= numbers[STARTER_SPEED]
    count[STARTED] = speed >= numbers[READY]
    if speed >= numbers[READY]:
        found.run[d, 0] = 0.0
    for k in range(len(work.all_gas)):
        work.all_gas[k] = -numbers[LEVER] * tables.crankcase_gas[k]
    for i in range(len(work.held)):
        work.held[i] = numbers[START_COMMAND]
        for k in range(len(work.all_gas)):
            work.own[i, k] = 0.0


@inlined
def _node(
    d: int, cycle: int, n: int, angle: float, time: float, omega: float, tables: Tables,
    given: Given, work: Work,
) -> None:  # fmt: skip
    """Do what is to be done when a node is reached."""
    numbers, run, count = given.numbers[d], work.run, work.counts
    if run[CUT_AT] < 0.0 and time >= numbers[FUEL_CUT]:
        run[CUT_AT] = angle
    if tables.fires[n]:
        firings, mean = count[FIRINGS], numbers[START_SPEED]
        if firings >= tables.firings:
            mean = tables.period / (time - work.trace_time[firings - tables.firings])
        elif time > 0.0:
            mean = angle / time
        work.trace_time[firings], work.trace_speed[firings] = time, mean
        count[FIRINGS] = firings + 1
        if numbers[GOVERNED] > 0.0 and numbers[SAMPLING_TIME] == 0.0:
            sample(time, angle, numbers, work)
    if tables.taken[n] or time == 0.0:
        _commands(d, cycle, n, time, omega, tables, given, work)
        run[FRICTION] = _friction(numbers, tables, work)


@inlined
def _due(
    d: int, n: int, place: float, angle: float, time: float, omega: float, y: float,
    tables: Tables, given: Given, work: Work,
) -> tuple[float, float]:  # fmt: skip
    """Do what is due at this time, and find when the next is; what y and the speed are then."""
    numbers, run, count = given.numbers[d], work.run, work.counts
    times = given.load_time[d if given.load_time.shape[0] > 1 else 0]
    loads = given.load_torque[d if given.load_torque.shape[0] > 1 else 0]
    passed, coming, every = count[PASSED], math.inf, numbers[SAMPLING_TIME]
    while passed < len(times) and times[passed] <= time:
        passed += 1
    load, ramp = loads[max(passed - 1, 0)], 0.0
    if passed < len(times):
        coming = times[passed]
        if passed > 0:
            gap = times[passed] - times[passed - 1]
            ramp = (loads[passed] - loads[passed - 1]) / gap
            load += ramp * (time - times[passed - 1])
    run[LOAD], run[RAMP], run[SINCE] = load, ramp, time
    count[PASSED] = passed
    if numbers[GOVERNED] > 0.0 and every > 0.0:
        if count[SAMPLED] * every <= time:
            sample(time, angle, numbers, work)
            while count[SAMPLED] * every <= time:
                count[SAMPLED] += 1
        coming = min(coming, count[SAMPLED] * every)
    if count[CLUTCH] == OPEN and numbers[CLUTCH_TIME] <= time:
        count[CLUTCH] = SLIPPING
        run[SLIP] = 1.0 if omega > numbers[CLUTCH_SPEED] else -1.0
        if not numbers[CLUTCH_TORQUE] < math.inf or omega == numbers[CLUTCH_SPEED]:
            weigh(place, work.end_integral, work.end_value)
            own, more = 2.0 / dot(work.end_value, work.inverse), numbers[CLUTCH_INERTIA]
            both = (own * omega + more * numbers[CLUTCH_SPEED]) / (own + more)
            y += 0.5 * (own + more) * both * both - 0.5 * own * omega * omega
            omega = both
            _lock(n, numbers, tables, work)
    elif count[CLUTCH] == OPEN:
        coming = min(coming, numbers[CLUTCH_TIME])
    run[NEXT] = coming
    work.series[12] = 0.0
    return y, omega


@inlined
def _lock(n: int, numbers: Floats, tables: Tables, work: Work) -> None:
    """From now on, the inertia behind the clutch turns with the shaft."""
    work.counts[CLUTCH] = LOCKED
    work.run[TURNING] += numbers[CLUTCH_INERTIA]
    _inertia(n, numbers, tables, work)


@inlined
def _pass(
    d: int, kind: int, n: int, time: float, omega: float, tables: Tables, numbers: Floats,
    work: Work, found: Found,
) -> float:  # fmt: skip
    """Do what follows when a speed that matters is passed; the energy [J] that comes with it."""
    run, count, more = work.run, work.counts, 0.0
    if kind == slow.OVERRUN:
        count[OVERRUN] = 1 - count[OVERRUN]
    elif kind == slow.RELEASED:
        run[STARTER], count[OVERRUN] = 0.0, 0
    elif kind == IS_READY:
        count[STARTED], found.run[d, 0] = 1, time
    elif kind == SYNCHRONOUS:
        more = 0.5 * numbers[CLUTCH_INERTIA] * omega * omega
        _lock(n, numbers, tables, work)
    work.series[12] = 0.0
    return more


@inlined
def _law(push: float, numbers: Floats, work: Work) -> Law:
    """Torque against the rotation, less the starter's with this torque at rest."""
    run = work.run
    constant = run[FRICTION] + numbers[OFFSET] - push
    if work.counts[CLUTCH] == SLIPPING:
        constant += run[SLIP] * numbers[CLUTCH_TORQUE]
    return Law(
        constant, numbers[LINEAR] + push / numbers[STARTER_SPEED], numbers[SQUARE], run[LOAD],
        run[RAMP], run[SINCE], 1.0 / (numbers[SPEED] * numbers[SPEED]), 0.5 * numbers[EXPONENT],
    )  # fmt: skip


@inlined
def _piece_of_time(
    place: float, time: float, omega: float, width: float, numbers: Floats, work: Work
) -> tuple[int, float, float, float]:
    """Kind of the end of a piece of time, and place, time and speed there."""
    run, count, nominal = work.run, work.counts, numbers[SPEED]
    slowest, top, release = SWITCH * nominal, numbers[STARTER_SPEED], numbers[RELEASE]
    overrun, starter = count[OVERRUN] > 0, run[STARTER]
    push = 0.0 if overrun else starter
    ends = 0.0 if starter == 0.0 else (-1.0 if overrun else 1.0)
    for k in range(5):
        work.gap[k] = 2.0 / work.inverse[k]
    fit(work.gap, work.inertia_power)
    fit(work.gas, work.work_power)
    law, later = _law(0.0, numbers, work), time - run[SINCE]
    way, fast = 1.0 if omega > 0.0 else -1.0, abs(omega)
    rest = slow.against(omega, later, law, slowest)
    torque = slow.drive(place, width, work.work_power) + push
    if omega == 0.0:
        hold, pull = max(rest, 0.0), torque - min(rest, 0.0)
        way = 1.0 if pull > 0.0 else -1.0
        if abs(pull) <= hold or count[SWINGS] > MOST_SWINGS:
            count[OUTCOME] = status.STOPPED
            return 0, place, time, omega
    # Short against the step, and against the time in which the torque changes with the speed.
    more = 0.1 * slowest
    change = abs(slow.against(fast + more, later, law, slowest) - rest) / more + push / top
    mass = value_at(place, work.inertia_power)
    dt = width / (slow.SUBSTEPS * max(fast, 0.2 * slowest))
    dt = min(dt, math.sqrt(width * mass / max(abs(torque) + abs(rest), 1e-300)))
    dt = min(dt, mass / max(change, 1e-300))
    dt = run[NEXT] - time if time + dt >= run[NEXT] else dt
    s1, w1, kind = place, omega, 0
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
    count[PIECES] += 1
    if not abs(w1) <= FASTEST * nominal:
        count[OUTCOME] = status.RUNAWAY
        return 0, place, time, omega
    if count[PIECES] > MOST_PIECES * (len(work.all_gas) // 4):
        count[OUTCOME] = status.NOT_CONVERGED
    time = run[NEXT] if time + dt >= run[NEXT] else time + dt
    run[TURNED] += 0.5 * (omega + w1) * (s1 - place) * width
    if kind == slow.STANDSTILL:
        w1 = 0.0
        count[SWINGS] += 1
    elif kind == slow.OVERRUN:
        w1 = top
    ahead = run[SLIP] * (w1 - _other_speed(time, run[SLIP], numbers))
    if kind == 0 and count[CLUTCH] == SLIPPING and ahead <= 0.0:
        kind = SYNCHRONOUS
    if kind == 0 and count[STARTED] == 0 and w1 >= numbers[READY]:
        kind = IS_READY
    run[HIGHEST], run[LOWEST] = max(run[HIGHEST], w1 * w1), min(run[LOWEST], w1 * w1)
    return kind, s1, time, w1


@inlined
def _piece_of_angle(
    n: int, place: float, time: float, omega: float, y: float, energy: float, width: float,
    extremes: bool, tables: Tables, numbers: Floats, work: Work,
) -> tuple[int, float, float, float, float]:  # fmt: skip
    """Kind of the end of a piece of the crank angle, and place, time, speed and y there."""
    run, count = work.run, work.counts
    slowest = SWITCH * numbers[SPEED]
    law = _law(0.0 if count[OVERRUN] else run[STARTER], numbers, work)
    least = 0.25 * slowest * slowest
    if not solve(energy, y, time, place, omega * omega, width, least, law, work):
        return REFUSED, place, time, omega, y
    end, kind, following = 1.0, slow.END, run[NEXT]
    if work.time[4] >= following:
        end, kind = _place_of_time(following, time, place, width, work), 0
    count[EVENTS] += 1
    watched = run[STARTER] > 0.0 or count[CLUTCH] == SLIPPING or count[STARTED] == 0
    if watched and count[EVENTS] <= MOST_EVENTS:
        end, kind = _passed_speed(place, end, kind, numbers, work)
    if extremes:
        _extremes(n, place, end, width, tables, numbers, work)
    o = work.omega
    if place > 0.0:
        run[TURNED] -= width * dot(work.begin_integral, o)
    if end == 1.0:
        run[TURNED] += width * integrated(o[0], o[1], o[2], o[3], o[4])[3]
        y, time, omega = work.added[4], work.time[4], o[4]
    else:
        weigh(end, work.end_integral, work.end_value)
        run[TURNED] += width * dot(work.end_integral, o)
        y = work.added[0] + width * dot(work.end_integral, work.rate)
        time = work.time[0] + width * dot(work.end_integral, work.slowness)
        omega = math.sqrt(dot(work.end_value, work.square))
    if kind == 0:
        time = following
    return kind, end, time, omega, y


@inlined
def _store(
    d: int, cycle: int, time: float, omega: float, period: float, work: Work, found: Found
) -> None:
    """Store the results of a cycle, and begin the next."""
    run, total = work.run, 0.0
    for i in range(len(work.held)):
        total += work.held[i]
    row = found.cycles[d, cycle]
    row[0], row[1], row[2] = time, omega, run[TURNED] / period
    row[3], row[4] = math.sqrt(run[HIGHEST]), math.sqrt(run[LOWEST])
    row[5], row[6] = work.state[ACTUATOR], total / len(work.held)
    run[TURNED], work.counts[PIECES] = 0.0, 0
    run[HIGHEST] = run[LOWEST] = omega * omega


@inlined
def _record(
    d: int, point: int, angle: float, time: float, omega: float, numbers: Floats, work: Work,
    found: Found,
) -> None:  # fmt: skip
    torque = work.run[LOAD] + work.run[RAMP] * (time - work.run[SINCE])
    if numbers[EXPONENT] != 0.0:
        torque *= (max(omega, 1e-9) / numbers[SPEED]) ** numbers[EXPONENT]
    row = found.curves[d, point]
    row[0], row[1], row[2] = angle, time, omega
    row[3], row[4] = torque + numbers[OFFSET], work.state[0]


@kernel
def follow(
    first: int, last: int, cycles: int, tables: Tables, given: Given, work: Work, found: Found
) -> None:
    """Follow the designs from `first` up to, without, `last` for so many cycles at most.

    Each from step to step, and in these from event to event. Those whose outcome is invalid input
    are left out; arrays must be filled with NaN before. The loops stand here and in no function of
    their own: Numba would optimise all that they call once more.
    """
    steps, period, run, count = len(tables.fires), tables.period, work.run, work.counts
    for d in range(first, last):
        if found.outcome[d] == status.INVALID_INPUT:
            continue
        _begin(d, tables, given, work, found)
        numbers = given.numbers[d]
        time, omega, place, y, fresh = 0.0, numbers[START_SPEED], 0.0, 0.0, True
        slowest, fastest = SWITCH * numbers[SPEED], FASTEST * numbers[SPEED]
        # No literals, for which Numba would compile helpers once more.
        cycle, n = np.int64(0), np.int64(0)
        while count[OUTCOME] == GOING:
            width = tables.nodes[n + 1] - tables.nodes[n]
            angle = cycle * period + tables.nodes[n]
            if fresh:
                _node(d, cycle, n, angle, time, omega, tables, given, work)
            for k in range(4):
                work.gas[k + 1] = work.all_gas[4 * n + k]
            _inertia(n, numbers, tables, work)
            point = (cycle - given.first_recorded) * steps + n
            # The end of the last cycle is a point, too; what turns back was there before
            if 0 <= point < found.curves.shape[1] and math.isnan(found.curves[d, point, 1]):
                _record(d, point, angle, time, omega, numbers, work, found)
            by_time = place > 0.0 or not omega > slowest
            energy, y, fresh, inside = omega * omega / work.inverse[0], 0.0, False, True
            count[EVENTS] = 0
            while inside and count[OUTCOME] == GOING:
                if time >= run[NEXT]:
                    here = angle + place * width
                    y, omega = _due(d, n, place, here, time, omega, y, tables, given, work)
                if by_time:
                    kind, place, time, omega = _piece_of_time(
                        place, time, omega, width, numbers, work
                    )
                else:
                    kind, place, time, omega, y = _piece_of_angle(
                        n, place, time, omega, y, energy, width, given.extremes, tables, numbers,
                        work,
                    )  # fmt: skip
                if kind == slow.END:
                    n, place, fresh, inside = n + 1, 0.0, True, False
                elif kind == slow.BEGIN:
                    if n <= tables.back_to[n]:
                        count[OUTCOME] = status.STOPPED
                    else:
                        n, place, inside = n - 1, 1.0, False
                elif kind == REFUSED:
                    by_time = True
                elif kind > 0:
                    y += _pass(d, kind, n, time, omega, tables, numbers, work, found)
            if count[OUTCOME] == GOING and omega > fastest:
                count[OUTCOME] = status.RUNAWAY
            if count[OUTCOME] == GOING and n == steps:
                _store(d, cycle, time, omega, period, work, found)
                cycle, n = cycle + 1, n - steps
                if cycle == cycles or time >= numbers[DURATION]:
                    count[OUTCOME] = status.FOLLOWED
                    if given.first_recorded < cycle <= given.last_recorded:
                        point = (cycle - given.first_recorded) * steps
                        _record(d, point, cycle * period, time, omega, numbers, work, found)
        outcome = count[OUTCOME]
        if not numbers[START_SPEED] > slowest and count[STARTED] == 0 and outcome != status.RUNAWAY:
            outcome = status.NOT_STARTED
        angle = tables.nodes[n] + place * (tables.nodes[n + 1] - tables.nodes[n])
        found.run[d, 1], found.run[d, 2], found.run[d, 4] = time, cycle, angle
        if outcome == status.STOPPED and run[CUT_AT] >= 0.0:
            found.run[d, 3] = cycle + (angle - run[CUT_AT]) / period
        found.outcome[d] = outcome
        measure(d, count[FIRINGS], tables.firings, given, work, found)
