"""The numbers of a design and what is found of it: names, units, meanings, defaults, ranges."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from typing import NamedTuple

import numpy as np

from engine_dyn.types import Booleans, Floats, Integers

INF = math.inf

MOST_CYCLES = 100_000  # Cycles that are followed at most

LOWEST_COMMAND = -1e3  # Percent of load; the row without combustion lies above it


class Field(NamedTuple):
    """One number of each design, in SI units; without `default` it must be given."""

    name: str
    unit: str
    meaning: str
    default: float | None = None
    low: float = 0.0
    high: float = INF
    low_included: bool = True
    whole: bool = False

    @property
    def allowed(self) -> str:
        """What is allowed, in words."""
        low = f"{'at least' if self.low_included else 'above'} {self.low:g}" * (self.low > -INF)
        high = f"at most {self.high:g}" * (self.high < INF)
        limits = " and ".join(filter(None, (low, high)))
        return f"a whole number {limits}" if self.whole else limits

    def wrong(self, values: Floats) -> Booleans:
        """Which values are not allowed; NaN, a number that a design lacks, is left to outcomes."""
        low = values < self.low if self.low_included else values <= self.low
        return low | (values > self.high) | (self.whole & (values != np.round(values)))


def _above(name: str, unit: str, meaning: str, default: float | None = None) -> Field:
    """Number that must be above 0."""
    return Field(name, unit, meaning, default, low_included=False)


FIELDS = (
    _above("inertia", "kg m2", "engine with all that always turns with it, cycle mean"),
    Field("reciprocating_inertia", "kg m2", "a cylinder's reciprocating mass times r^2", 0.0),
    _above("lever", "m3", "piston area times crank radius"),
    Field("gas_factor", "1", "factor on the pressure of the diagrams", 1.0),
    _above("speed", "rad s-1", "nominal speed, to which load and limits refer"),
    Field("start_speed", "rad s-1", "speed at the beginning"),
    Field("start_command", "percent", "fuel command at the beginning", 0.0, LOWEST_COMMAND, 1e3),
    Field("load_exponent", "1", "exponent of the load's torque over the speed: 0 torque, 2 "
          "propeller, -1 power", 2.0, -1.0, 10.0),
    Field("load_offset", "N m", "load torque that depends on nothing", 0.0, -INF),
    Field("friction_constant", "N m", "friction torque at no speed and pressure", 0.0),
    Field("friction_peak_share", "N m Pa-1", "friction per mean peak pressure of cylinders", 0.0),
    Field("friction_linear", "N m s rad-1", "friction torque per speed", 0.0),
    Field("friction_square", "N m s2 rad-2", "friction torque per square of the speed", 0.0),
    Field("governed", "1", "1 with a governor, 0 where the command is given", 0.0, 0.0, 1.0),
    _above("reference_speed", "rad s-1", "speed that the governor holds at fuel command 0", 1.0),
    Field("gain", "percent", "command per relative deviation of the speed", 0.0),
    Field("integral_gain", "percent s-1", "command per relative deviation and time", 0.0),
    Field("derivative_gain", "percent s", "command per rate of the relative deviation", 0.0),
    Field("droop", "1", "relative fall of the governed speed from command 0 to 100", 0.0),
    Field("window", "1", "samples over which the governor takes the mean speed", 1.0, 1.0, 64.0,
          whole=True),
    Field("sampling_time", "s", "time between samples of the governor; 0 samples at each firing",
          0.0, high=10.0),
    Field("actuator_lag", "s", "time constant of the actuator", 0.0),
    Field("dead_time", "s", "time from a sample to the actuator", 0.0, high=1.0),
    Field("lowest_command", "percent", "lowest fuel command of the governor", LOWEST_COMMAND,
          LOWEST_COMMAND, 1e3),
    Field("highest_command", "percent", "highest fuel command of the governor", 1e3, LOWEST_COMMAND,
          1e3),
    Field("boost_lag", "s", "time constant of the charge air", 0.0),
    Field("boost_margin", "percent", "command that burns at once, beyond that of the charge air",
          INF),
    Field("starter_torque", "N m", "torque of the starter at rest, at the crank", 0.0),
    _above("starter_speed", "rad s-1", "speed from which the starter's freewheel overruns", 1.0),
    Field("starter_release", "rad s-1", "speed at which the starter is switched off", INF),
    Field("fuel_from", "rad s-1", "speed from which fuel is burnt", 0.0),
    Field("fuel_cut", "s", "time from which no fuel is burnt", INF),
    Field("ready_speed", "rad s-1", "speed at which the engine has started"),
    Field("clutch_time", "s", "time at which a second inertia is switched in", INF),
    Field("clutch_inertia", "kg m2", "second inertia, reduced to the crank", 0.0),
    Field("clutch_speed", "rad s-1", "speed of the second inertia before", 0.0),
    _above("clutch_torque", "N m", "torque while the clutch slips; without, at once", INF),
    Field("dispersion", "1", "relative standard deviation of the fuel from cycle to cycle", 0.0,
          high=0.5),
    Field("cylinder_dispersion", "1", "relative standard deviation of the fuel between cylinders",
          0.0, high=0.5),
    Field("seed", "1", "number that chooses the dispersion", 1.0, high=1e15, whole=True),
    _above("duration", "s", "time after which no further cycle begins", INF),
    Field("recovery_band", "1", "half of the relative band around the last speed", 0.0075, 0.0,
          1.0, False),
)  # fmt: skip
"""Columns of designs, in the order of their places in the table of numbers; the meanings and ranges
of keys of scenes, too."""

AT = {field.name: place for place, field in enumerate(FIELDS)}

OF_SPEED = {"start_speed": 1.0, "ready_speed": 0.95}
"""Numbers that are a share of the nominal speed unless given."""

SHORTEST_SAMPLING = 1e-4  # Time between samples [s] at least


class Fault(NamedTuple):
    """A number that some designs cannot have."""

    name: str
    designs: Booleans  # Which designs have it
    must: str  # What is allowed; another number in braces


def faults(numbers: Mapping[str, Floats], last_row: float = INF) -> Iterator[Fault]:
    """Numbers outside their ranges, then those that do not go together; SI units, broadcasting.

    No command may lie beyond `last_row`, the highest load [percent] of the diagrams.
    """
    for field in FIELDS:
        if field.name in numbers:
            yield Fault(field.name, field.wrong(numbers[field.name]), field.allowed)
    for name in ("start_command", "highest_command"):
        if name in numbers:
            beyond = np.greater(numbers[name], last_row)
            yield Fault(name, beyond, f"at most {last_row:g}, the load of the last diagram")
    for name, other, is_wrong, must in _TOGETHER:
        if name in numbers and other in numbers:
            yield Fault(name, is_wrong(numbers[name], numbers[other]), must)


_TOGETHER: tuple[tuple[str, str, Callable[[Floats, Floats], Booleans], str], ...] = (
    ("sampling_time", "sampling_time", lambda every, _: (every > 0.0) & (every < SHORTEST_SAMPLING),
     f"0 or at least {SHORTEST_SAMPLING:g}"),
    ("lowest_command", "highest_command", lambda low, high: low > high,
     "at most {highest_command}"),
    ("start_speed", "starter_torque", lambda speed, torque: (speed == 0.0) & (torque == 0.0),
     "above 0 without a starter's torque"),
)  # fmt: skip
"""Two numbers, whether they do not go together, and what is allowed of the first."""


class Given(NamedTuple):
    """Designs for the kernels; the first axis is the design, or has length 1 for all alike."""

    numbers: Floats  # `FIELDS`, shape (designs, fields)
    load_time: Floats  # [s], not descending; two points at one time are a step; (D or 1, points)
    load_torque: Floats  # Torque at nominal speed [N m]; constant before and after; same shape
    command_time: Floats  # [s], as of the load; (D or 1, points)
    command: Floats  # Fuel command [percent] where no governor gives it
    missed: Integers  # Cycle and cylinder, from 0, of firings without fuel; (D or 1, count, 2)
    marks: Floats  # Times [s] from which deviations are measured, ascending; (D or 1, marks)
    first_recorded: int  # Cycles of which curves are kept, from the first up to, without, the last
    last_recorded: int
    extremes: bool = True  # Whether the largest and smallest speed of cycles are wanted


CYCLE_RESULTS = (
    ("time", "s", "time at the end of the cycle"),
    ("speed_end", "rad s-1", "speed at the end of the cycle"),
    ("speed_mean", "rad s-1", "mean speed over the crank angle"),
    ("speed_highest", "rad s-1", "largest speed in the cycle"),
    ("speed_lowest", "rad s-1", "smallest speed in the cycle"),
    ("command", "percent", "command of the actuator when it was last asked for in the cycle"),
    ("burnt", "percent", "mean command that the cylinders have at the end of the cycle"),
)
"""Results of each cycle: shape (designs, cycles, results)."""

MARK_RESULTS = (
    ("speed_before", "rad s-1", "mean over the cycle before the mark"),
    ("speed_lowest", "rad s-1", "smallest mean over a cycle from there on"),
    ("speed_highest", "rad s-1", "largest mean over a cycle from there on"),
    ("speed_after", "rad s-1", "last mean over a cycle"),
    ("recovery_time", "s", "time from the mark until the mean over a cycle stays in the band"),
)
"""Results from each mark to the next, or to the fuel cut, of the speed averaged at each firing over
the last cycle."""

RUN_RESULTS = (
    ("time_to_start", "s", "time until the speed first reaches the ready speed"),
    ("end_time", "s", "time at which the run ends"),
    ("cycles_done", "1", "whole cycles that were followed"),
    ("cycles_to_stop", "1", "cycles from the fuel cut to standstill"),
    ("end_angle", "rad", "crank angle at the end of the run, from the beginning of its cycle"),
)
"""Results of each run: shape (designs, results)."""

CURVES = ("crank_angle", "time", "omega", "load_torque", "command")
"""Curves [rad, s, rad/s, N m, percent] at the ends of steps of the recorded cycles."""


class Found(NamedTuple):
    """Arrays that kernels fill, the last axis as of the tables above."""

    outcome: Integers  # See `engine_dyn.status`; shape (designs,)
    cycles: Floats  # NaN behind the end of a run
    marks: Floats
    run: Floats
    curves: Floats  # Shape (designs, recorded steps + 1, 5)
