"""The numbers of a design and what is found of it: names, units, meanings, defaults, ranges."""

from __future__ import annotations

import math
from typing import NamedTuple

from engine_dyn.types import Floats, Integers


class Field(NamedTuple):
    """One number of each design, in SI units; without `default` it must be given."""

    name: str
    unit: str
    meaning: str
    default: float | None = None
    low: float = 0.0
    low_included: bool = True
    high: float = math.inf


def _positive(name: str, unit: str, meaning: str, default: float | None = None) -> Field:
    return Field(name, unit, meaning, default, low_included=False)


FIELDS = (
    _positive("inertia", "kg m2", "engine with all that always turns with it, cycle mean"),
    Field("reciprocating_inertia", "kg m2", "reciprocating mass of one cylinder times the crank "
          "radius squared", 0.0),
    _positive("lever", "m3", "piston area times crank radius"),
    _positive("speed", "rad s-1", "nominal speed, to which load and limits refer"),
    Field("start_speed", "rad s-1", "speed at the beginning, at crank angle 0", None),
    Field("start_command", "percent", "fuel command at the beginning, and the governor's output "
          "without deviation", 0.0, -math.inf),
    Field("load_exponent", "1", "exponent alpha of the load's torque over the speed: 0 torque, 2 "
          "propeller, -1 power", 2.0, -1.0, True, 10.0),
    Field("load_offset", "N m", "load torque that depends on nothing", 0.0, -math.inf),
    Field("friction_constant", "N m", "friction torque that neither speed nor pressure change", 0.0),
    Field("friction_peak_share", "N m Pa-1", "friction torque per mean peak pressure of the "
          "cylinders", 0.0),
    Field("friction_linear", "N m s rad-1", "friction torque per speed", 0.0),
    Field("friction_square", "N m s2 rad-2", "friction torque per square of the speed", 0.0),
    Field("governed", "1", "1 with a governor, 0 where the fuel command is given", 0.0, 0.0, True, 1.0),
    _positive("reference_speed", "rad s-1", "speed that the governor holds at command 0; without "
              "droop at every command", 1.0),
    Field("gain", "percent", "command per relative deviation of the speed", 0.0),
    Field("integral_gain", "percent s-1", "command per relative deviation and time", 0.0),
    Field("derivative_gain", "percent s", "command per rate of the relative deviation", 0.0),
    Field("droop", "1", "relative fall of the governed speed from command 0 to 100", 0.0),
    Field("window", "1", "intervals of sampling over which the speed is measured", 1.0, 1.0, True, 64.0),
    Field("sampling_time", "s", "time between samples; 0 samples at each firing", 0.0),
    Field("actuator_lag", "s", "time constant of the actuator", 0.0),
    Field("dead_time", "s", "time from sample to actuator", 0.0),
    Field("lowest_command", "percent", "lower limit of the command", -math.inf, -math.inf),
    Field("highest_command", "percent", "upper limit of the command", math.inf, -math.inf),
    Field("boost_lag", "s", "time constant with which the air follows the fuel that is burnt", 0.0),
    Field("boost_margin", "percent", "command that may be burnt at once beyond the air that is there",
          math.inf),
    Field("starter_torque", "N m", "torque of the starter at rest, at the crankshaft", 0.0),
    _positive("starter_speed", "rad s-1", "speed at which the starter gives no torque, and from which "
              "its freewheel overruns", 1.0),
    Field("starter_release", "rad s-1", "speed at which the starter is switched off", math.inf),
    Field("fuel_from", "rad s-1", "speed from which fuel is burnt", 0.0),
    Field("fuel_cut", "s", "time from which none is", math.inf),
    Field("ready_speed", "rad s-1", "speed at which the engine counts as started", math.inf),
    Field("clutch_time", "s", "time at which a second inertia is switched in", math.inf),
    Field("clutch_inertia", "kg m2", "that inertia, reduced to the crankshaft", 0.0),
    Field("clutch_speed", "rad s-1", "its speed before", 0.0),
    _positive("clutch_torque", "N m", "torque while the clutch slips; infinite: at once, with the "
              "momentum that both have", math.inf),
    Field("dispersion", "1", "standard deviation of the indicated work above the motored one from cycle "
          "to cycle, relative", 0.0, 0.0, True, 0.5),
    Field("cylinder_dispersion", "1", "the same between cylinders", 0.0, 0.0, True, 0.5),
    Field("seed", "1", "number that chooses the dispersion", 0.0, 0.0, True, 2.0**53),
    _positive("duration", "s", "time after which no further cycle begins", math.inf),
    Field("recovery_band", "1", "half of the relative band around the last speed", 0.0075, 0.0, False, 1.0),
)  # fmt: skip
"""Columns of designs, in the order of their places in the table of numbers."""

AT = {field.name: place for place, field in enumerate(FIELDS)}


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


CYCLE_RESULTS = (
    ("time", "s", "time at the end of the cycle"),
    ("speed_end", "rad s-1", "speed at the end of the cycle"),
    ("speed_mean", "rad s-1", "mean speed over the crank angle"),
    ("speed_highest", "rad s-1", "largest speed in the cycle"),
    ("speed_lowest", "rad s-1", "smallest speed in the cycle"),
    ("command", "percent", "command that the actuator had when a cylinder last took it"),
    ("burnt", "percent", "mean command that the cylinders have at the end of the cycle"),
)
"""Results of each cycle: shape (designs, cycles, results)."""

MARK_RESULTS = (
    ("speed_before", "rad s-1", "speed at the mark, mean of the cycle before it"),
    ("speed_lowest", "rad s-1", "smallest mean over a cycle until the next mark"),
    ("speed_highest", "rad s-1", "largest mean over a cycle until the next mark"),
    ("speed_after", "rad s-1", "last mean over a cycle before the next mark"),
    ("recovery_time", "s", "time from the mark until the mean over a cycle stays in the band"),
)
"""Results from each mark to the next, of the speed that is averaged over the last cycle at each
firing: shape (designs, marks, results)."""

RUN_RESULTS = (
    ("time_to_start", "s", "time until the speed first reaches the ready speed"),
    ("end_time", "s", "time at which the run ends"),
    ("cycles_done", "1", "whole cycles that were followed"),
    ("cycles_to_stop", "1", "cycles from the fuel cut to standstill"),
    ("end_angle", "rad", "crank angle at the end of the run, from the beginning of its cycle"),
)
"""Results of each run: shape (designs, results)."""


class Found(NamedTuple):
    """Arrays that kernels fill."""

    outcome: Integers  # See `engine_dyn.status`; shape (designs,)
    cycles: Floats  # `CYCLE_RESULTS`; NaN behind the end of a run
    marks: Floats  # `MARK_RESULTS`
    run: Floats  # `RUN_RESULTS`
    # Crank angle [rad], time [s], speed [rad/s], load torque [N m] and command [percent] at the
    # beginning of each step and the end of the last; shape (designs, recorded steps + 1, 5).
    curves: Floats
