"""Speed governor, actuator, air and the fuel that a cylinder takes.

Between samples the actuator's first-order lag is exact, as is that of the air between the commands
that cylinders take: neither needs a step of its own.

Sources
-------
Proportional, integral and derivative action with droop, and an integral part that waits while the
output is at its limit (conditional integration): Astrom and Hagglund, PID Controllers, ISA 1995,
ch. 3.5. Words: ISO 3046-4 and ISO 8528-2 (droop, isochronous). Random numbers: Steele, Lea and
Flood, OOPSLA 2014 (splitmix); Box and Muller, Ann. Math. Stat. 29 (1958) 610.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from engine_dyn.compilation import inlined
from engine_dyn.loads.laws import point_before
from engine_dyn.transient.fields import AT
from engine_dyn.transient.tables import Tables
from engine_dyn.transient.work import RING, Work
from engine_dyn.types import Floats

ACTUATOR, OUTPUT, ACTUATOR_TIME, INTEGRAL, SEEN, SAMPLES, LAST_SAMPLE, AIR, AIR_TIME, BURNT = range(
    10
)
WAITING_FIRST, WAITING_END = 10, 11
"""Places in `Work.state`; waiting outputs are counted, and kept in turn."""

LAG, DEAD = AT["actuator_lag"], AT["dead_time"]
LOW, HIGH = AT["lowest_command"], AT["highest_command"]
GAIN, INTEGRAL_GAIN, DERIVATIVE_GAIN = AT["gain"], AT["integral_gain"], AT["derivative_gain"]
DROOP, WINDOW, REFERENCE = AT["droop"], AT["window"], AT["reference_speed"]
BOOST_LAG, BOOST_MARGIN = AT["boost_lag"], AT["boost_margin"]
LEVER, GAS_FACTOR = AT["lever"], AT["gas_factor"]
SEED, DISPERSION, BETWEEN = AT["seed"], AT["dispersion"], AT["cylinder_dispersion"]


@inlined
def begin_governor(command: float, speed: float, work: Work) -> None:
    """Actuator, integral part and air at a command since ever."""
    state = work.state
    for k in range(len(state)):
        state[k] = 0.0
    state[ACTUATOR] = state[OUTPUT] = state[INTEGRAL] = state[AIR] = state[BURNT] = command
    state[SEEN] = speed


@inlined
def _approach(time: float, lag: float, state: Floats) -> None:
    """Bring the actuator to a time at which its input does not change."""
    gap = 0.0
    if lag > 0.0:
        gap = (state[ACTUATOR] - state[OUTPUT]) * math.exp((state[ACTUATOR_TIME] - time) / lag)
    state[ACTUATOR] = state[OUTPUT] + gap
    state[ACTUATOR_TIME] = time


@inlined
def actuator_at(time: float, numbers: Floats, work: Work) -> float:
    """Bring the actuator to a time, by all outputs that reach it until then; its command."""
    state, count = work.state, len(work.queue_time)
    while state[WAITING_FIRST] < state[WAITING_END]:
        place = int(state[WAITING_FIRST]) % count
        if work.queue_time[place] > time:
            break
        _approach(work.queue_time[place], numbers[LAG], state)
        state[OUTPUT] = work.queue_command[place]
        state[WAITING_FIRST] += 1.0
    _approach(time, numbers[LAG], state)
    return state[ACTUATOR]


@inlined
def sample(time: float, angle: float, numbers: Floats, work: Work) -> None:
    """Measure the mean speed over the last intervals, and send a new output to the actuator."""
    state = work.state
    count = int(state[SAMPLES])
    work.ring_angle[count % RING], work.ring_time[count % RING] = angle, time
    state[SAMPLES] = count + 1.0
    since, state[LAST_SAMPLE] = time - state[LAST_SAMPLE], time
    window = int(numbers[WINDOW])
    if count < window:
        return
    back = (count - window) % RING
    if not time > work.ring_time[back]:
        return
    seen = (angle - work.ring_angle[back]) / (time - work.ring_time[back])
    reference, droop = numbers[REFERENCE], 0.01 * numbers[DROOP]
    gap = (reference - seen) / reference
    slope = 0.0
    if count > window and since > 0.0:
        slope = (state[SEEN] - seen) / (reference * since)
    state[SEEN] = seen
    raw = numbers[GAIN] * gap + numbers[DERIVATIVE_GAIN] * slope + state[INTEGRAL]
    raw /= 1.0 + numbers[GAIN] * droop
    output = min(max(raw, numbers[LOW]), numbers[HIGH])
    left = gap - droop * output
    if (raw < numbers[HIGH] or left < 0.0) and (raw > numbers[LOW] or left > 0.0):
        state[INTEGRAL] += numbers[INTEGRAL_GAIN] * left * since
    actuator_at(time, numbers, work)  # so that only outputs wait that have not arrived
    size = len(work.queue_time)
    place = int(state[WAITING_END]) % size
    work.queue_time[place], work.queue_command[place] = time + numbers[DEAD], output
    state[WAITING_END] += 1.0


@inlined
def _hashed(x: Any) -> Any:
    """Mix the bits of a whole number: one step of splitmix."""
    z = np.uint64(x) * np.uint64(0x9E3779B97F4A7C15) + np.uint64(0x632BE59BD9B4E019)
    z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return z ^ (z >> np.uint64(31))


@inlined
def normal(seed: float, cycle: int, cylinder: int) -> float:
    """Normal random number of a firing, the same whenever it is asked for."""
    base = _hashed(np.uint64(int(seed)))
    base = _hashed(base ^ np.uint64(cycle + 2))
    base = _hashed(base ^ np.uint64(cylinder + 1))
    one = (float(base >> np.uint64(11)) + 0.5) / 9007199254740992.0
    two = (float(_hashed(base) >> np.uint64(11)) + 0.5) / 9007199254740992.0
    return math.sqrt(-2.0 * math.log(one)) * math.cos(2.0 * math.pi * two)


@inlined
def take(
    cylinder: int, cycle: int, command: float, motored: bool, time: float, tables: Tables,
    numbers: Floats, work: Work,
) -> None:  # fmt: skip
    """Give a cylinder its command, for the firing in a cycle: what the air and the rows allow.

    The air follows, with its lag, the mean of the commands that cylinders burn.
    """
    state, commands = work.state, tables.commands
    rows = len(commands)
    if numbers[BOOST_LAG] > 0.0:
        state[AIR] += (state[BURNT] - state[AIR]) * (
            1.0 - math.exp((state[AIR_TIME] - time) / numbers[BOOST_LAG])
        )
        command = min(command, state[AIR] + numbers[BOOST_MARGIN])
    state[AIR_TIME] = time
    if numbers[DISPERSION] > 0.0 or numbers[BETWEEN] > 0.0:
        share = numbers[DISPERSION] * normal(numbers[SEED], cycle, cylinder)
        share += numbers[BETWEEN] * normal(numbers[SEED], np.int64(-1), cylinder)
        command += (command - commands[0]) * share
    if motored:
        command = commands[0]
    command = min(max(command, commands[0]), commands[rows - 1])
    low = point_before(command, commands)
    high = low + 1
    part = (command - commands[low]) / (commands[high] - commands[low])
    work.row[cylinder], work.part[cylinder] = low, part
    lower, upper = tables.gas[cylinder, low], tables.gas[cylinder, high]
    own, lever = work.own[cylinder], numbers[LEVER] * numbers[GAS_FACTOR]
    for k in range(len(own)):
        new = lever * (lower[k] + part * (upper[k] - lower[k]))
        work.all_gas[k] += new - own[k]
        own[k] = new
    state[BURNT] += (command - work.held[cylinder]) / len(work.held)
    work.held[cylinder] = command
