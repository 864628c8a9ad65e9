"""Memory in which a kernel follows one design after the other, and powers of the speed in it."""

from __future__ import annotations

import math
from typing import Any, NamedTuple, cast

import numpy as np

from engine_dyn.compilation import inlined
from engine_dyn.plain_arrays import plain
from engine_dyn.types import Floats, Integers

SWITCH = 0.1
"""Speed over the nominal one below which time is the independent variable."""


class Work(NamedTuple):
    """Scratch of one thread."""

    gas: Floats  # Work of the gas [J] from the beginning of the step to its five points
    inverse: Floats  # 2 over the inertia [1/(kg m2)] at the points
    square: Floats  # Square of the speed [rad2/s2] at the points
    added: Floats  # Energy that load and friction add from the beginning of the step [J], there
    rate: Floats  # Torque [N m] besides that of the gas, at the points
    slowness: Floats  # 1 over the speed [s/rad] at the points
    time: Floats  # Time [s] at the points
    omega: Floats  # Speed [rad/s] at the points
    gap: Floats  # What is looked for where it vanishes, at the points
    begin_integral: Floats  # Weights of integrals to the place where a piece begins, and of values
    begin_value: Floats
    end_integral: Floats  # The same where it ends
    end_value: Floats
    power: Floats  # Coefficients of a polynomial through values at the points
    work_power: Floats  # Those of the work of the gas, and of the inertia, below the switch
    inertia_power: Floats
    series: Floats  # Series of the torque about a speed, see `expand`
    binomial: Floats  # Binomial coefficients of alpha/2 and of 1/2
    slope: Floats  # Slope of the speed's square over the place [rad2/s2] at the points
    power10: Floats  # Coefficients of a polynomial of degree 9
    # Works [J] of each cylinder with its command, as of `Tables.gas`, and of all together.
    own: Floats
    all_gas: Floats
    # Row of the table that each cylinder's command is in, the fraction towards the next row, and
    # the command [percent].
    row: Integers
    part: Floats
    held: Floats
    run: Floats  # Of the run, see `kernel`
    counts: Integers
    state: Floats  # Governor and actuator, see `governor`
    ring_angle: Floats  # Angles and times of the last samples
    ring_time: Floats
    queue_time: Floats  # When outputs of the governor reach the actuator, and these
    queue_command: Floats
    trace_time: Floats  # Time of each firing, and mean speed over the cycle before it
    trace_speed: Floats


STATES, RING = 12, 66  # Numbers of the governor; samples kept, more than a window has


def make_work(cylinders: int, steps: int, waiting: int, firings: int) -> Work:
    """Scratch for so many cylinders, steps, outputs on their way, and firings of a run."""
    made: list[Any] = [np.zeros(5) for _ in range(16)]
    made += [np.zeros(13), np.zeros(12), np.zeros(5), np.zeros(10)]
    made += [np.zeros((cylinders, 4 * steps)), np.zeros(4 * steps)]
    made += [np.zeros(cylinders, np.int64), np.zeros(cylinders), np.zeros(cylinders)]
    made += [np.zeros(12), np.zeros(10, np.int64)]
    made += [np.zeros(n) for n in (STATES, RING, RING, waiting, waiting, firings, firings)]
    return cast(Work, plain(Work(*made)))


class Law(NamedTuple):
    """Torque against the rotation: constant + linear v + square v^2 + load (v/n)^alpha [N m]."""

    constant: float
    linear: float
    square: float
    load: float  # At nominal speed, at the time `since`
    ramp: float  # Its rate [N m/s]
    since: float
    nominal: float  # 1 over the square of the nominal speed n
    half: float  # Half of the exponent alpha


@inlined
def begin_series(half: float, work: Work) -> None:
    """Binomial coefficients of a design's exponent."""
    one, root = 1.0, 1.0
    for k in range(6):
        work.binomial[k], work.binomial[6 + k] = one, root
        one *= (half - k) / (k + 1.0)
        root *= (0.5 - k) / (k + 1.0)
    work.series[12] = 0.0


@inlined
def expand(square: float, law: Law, work: Work) -> None:
    """Series of the torque in z = v^2/square - 1, without its constant and its square.

    Exponential and logarithm take most of the time of a load like v^1.6; the series, up to z^5,
    needs them once while the speed stays near: its error is below 5e-9 of the load for |z| < 0.05
    and exponents up to 4.
    """
    series, binomial = work.series, work.binomial
    load = math.exp(law.half * math.log(square * law.nominal))
    root = law.linear * math.sqrt(square)
    for k in range(6):
        series[k] = root * binomial[6 + k] + law.load * load * binomial[k]
        series[6 + k] = law.ramp * load * binomial[k]
    series[12] = 1.0 / square


@inlined
def torque_of(square: float, later: float, law: Law) -> float:
    """Torque [N m] at this square of the speed, above 0, and so long after the law's time."""
    torque = law.constant + law.linear * math.sqrt(square) + law.square * square
    load = law.load + law.ramp * later
    if load != 0.0:
        torque += load * math.exp(law.half * math.log(square * law.nominal))
    return torque
