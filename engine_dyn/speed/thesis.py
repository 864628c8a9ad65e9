"""The thesis's own method: cycles of explicit Euler steps in omega, one degree each.

docs/method.md (89); Kakaitsas (2015), section 4.2, eqs. 4.1 and 4.2. The method is of first order.
Every step adds energy, docs/method.md (90), so that with a constant load torque the mean speed
climbs without end. The method exists to reproduce printed numbers and should not be used for new
ones: this file is validation, apart from the solvers.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from engine_dyn import status
from engine_dyn.compilation import kernel
from engine_dyn.geometry.cylinders import Cylinders
from engine_dyn.loads.friction import stacked_parts
from engine_dyn.pressure.family import Family
from engine_dyn.pressure.motored import pressures_of_rows
from engine_dyn.speed.designs import LEVELS
from engine_dyn.speed.general.one_by_one import solve_one_by_one
from engine_dyn.speed.grouping import Call
from engine_dyn.speed.results import SCALAR_NAMES, Results
from engine_dyn.speed.storage import store, store_nothing
from engine_dyn.speed.task import Task
from engine_dyn.types import Floats
from engine_dyn.units import DEGREE

__all__ = ["CLOSED_CYCLE", "MOST_CYCLES", "solve_as_printed", "step_cycles"]

CLOSED_CYCLE = 1e-6
"""Cycles end when the speeds at both ends of one differ by no more than this [rad/s]: Kakaitsas
(2015), section 4.2."""

MOST_CYCLES = 30000
"""Largest number of cycles."""


class Cycle(NamedTuple):
    """Curves of one design at the samples of a cycle.

    `torque` is that of gas, friction and, with constant inertia, of the masses [N m]; `theta` the
    moment of inertia [kg m2] and `turn` its slope.
    """

    torque: Floats
    theta: Floats
    turn: Floats


class Law(NamedTuple):
    """Load torque a + k omega^alpha: a [N m], k and alpha."""

    offset: float
    coefficient: float
    exponent: float


@kernel
def step_cycles(
    cycle: Cycle, law: Law, width: float, start: float, first: int, passes: int, speeds: Floats,
    rates: Floats,
) -> tuple[int, int, float, float, float]:  # fmt: skip
    """Step through cycles of omega [rad/s] by explicit Euler, docs/method.md (89).

    theta domega/dt = torque - a - k omega^alpha - turn omega^2/2, from sample `first` on, in steps
    of `width` [rad]. `speeds` gets the samples of the last cycle, `rates` the angular acceleration
    [rad/s2] there. Returns the number of cycles done (`passes`, or until one closes where that is
    0), the outcome, and the largest, smallest and mean sample of the last cycle.
    """
    omega, count = start, speeds.size
    limit = passes if passes > 0 else MOST_CYCLES
    top = bottom = mean = 0.0
    for number in range(1, limit + 1):
        begin = omega
        top, bottom, total = -math.inf, math.inf, 0.0
        for i in range(count):
            j = (first + i) % count
            if not (omega > 0.0):
                return number, status.STALLED, top, bottom, mean
            speeds[j] = omega
            top, bottom, total = max(top, omega), min(bottom, omega), total + omega
            load = law.offset + law.coefficient * omega**law.exponent
            torque = cycle.torque[j] - load - 0.5 * cycle.turn[j] * omega * omega
            rates[j] = torque / cycle.theta[j]
            omega += rates[j] / omega * width
        mean = total / count
        if passes == 0 and abs(omega - begin) <= CLOSED_CYCLE:
            return number, status.CONVERGED, top, bottom, mean
    code = status.PASSES_DONE if passes > 0 else status.NOT_CONVERGED
    return limit, code if omega > 0.0 else status.STALLED, top, bottom, mean


def _cycle_of(
    value: dict[str, float], family: Family, cylinders: Cylinders, variable: bool
) -> tuple[Cycle, float]:
    """Curves of a design, docs/method.md (27) and (39), and its mean torque at nominal speed."""
    count = round(cylinders.period / DEGREE)
    angle: Floats = -0.5 * cylinders.period + np.arange(count, dtype=np.float64) * DEGREE
    low = int(math.floor(value["row"]))
    weight = value["row"] - low
    rows = np.array([low, low + (weight > 0.0)])
    gas, shape, square, slope = (np.zeros(count) for _ in range(4))
    levels = np.array([max(value[name], 0.0) for name in LEVELS])
    for member in cylinders.members:
        crank = value["crank_ratio"], value["offset_ratio"]
        phi = angle + member.phase_of(*crank)
        at = member.diagram_angle(phi, *crank)
        both = pressures_of_rows(family, rows, at, member.pressure_factor)
        pressure = value["scale"] * ((1.0 - weight) * both[0] + weight * both[1])
        v, load = member.velocity(phi, *crank), pressure - value["crankcase_pressure"]
        own_square, own_slope = member.square(phi, *crank)
        gas += load * v
        shape -= 0.5 * own_slope
        square += own_square
        slope += own_slope
        if levels.any():
            parts = stacked_parts(
                value["ring_pressure"] + load, v / member.radius_factor, np.sin(phi)
            )
            means = parts.mean(axis=1)
            factors = np.where(means > 0.0, levels / np.where(means > 0.0, means, 1.0), 0.0)
            gas -= factors @ (parts - means[:, None])
    radius = 0.5 * value["double_radius"]
    lever = 0.25 * math.pi * value["bore"] ** 2 * radius
    moving = value["mass"] * radius * radius
    engine = lever * gas - value["friction_torque"]
    masses = moving * value["speed"] ** 2 * shape
    mean = float((engine + masses).mean())
    if not variable:
        still = np.full(count, value["inertia"])
        return Cycle(engine + masses, still, np.zeros(count)), mean
    theta = value["inertia"] + moving * (square - square.mean())
    return Cycle(engine, theta, moving * slope), mean


def _store_curves(
    target: int, speeds: Floats, rates: Floats, angles: Floats, results: Results
) -> None:
    """Write the curves of a design; the speed follows the method's own step between samples."""
    place = np.mod(angles + 0.5 * speeds.size * DEGREE, speeds.size * DEGREE) / DEGREE
    node = np.floor(place + 1e-9).astype(np.int64)
    past = np.maximum(place - node, 0.0) * DEGREE
    speed, rate = speeds[node % speeds.size], rates[node % speeds.size]
    for curve, values in (
        (results.omega, speed + past * rate / speed), (results.acceleration, rate),
    ):  # fmt: skip
        if curve.shape[1] > 0:
            curve[target] = values


def solve_as_printed(call: Call, task: Task, angles: Floats, results: Results) -> None:
    """Solve designs as the thesis does; the error is the difference to the periodic solution.

    The coefficient k follows from the mean of the samples.
    """
    piece, designs = call.piece, call.designs()
    family, size = piece.source.family, piece.size
    compared = ("delta", "delta_error")
    nothing = np.empty((1, 0))
    periodic = Results(
        np.array([compared.index(n) if n in compared else -1 for n in SCALAR_NAMES]),
        np.full((2, size), np.nan), np.empty(size, dtype=np.int8), nothing, nothing,
        np.zeros(0, dtype=np.bool_),
    )  # fmt: skip
    own = designs._replace(target=np.minimum(np.arange(designs.target.size), size - 1))
    solve_one_by_one(np.arange(size), task, call.columns, own, periodic, last=False)
    count = round(piece.source.cylinders.period / DEGREE)
    speeds, rates = np.zeros(count), np.zeros(count)
    for i in range(size):
        target, code = int(designs.target[i]), int(periodic.status[i])
        if code in (status.NO_STEADY_STATE, status.INVALID_INPUT):
            store_nothing(target, code, results)
            continue
        one = piece.chosen.subset(np.array([i]))
        value = {name: float(one.take(name).flat[0]) for name in one.inputs.arrays}
        cylinders = piece.grouping.cylinders_of(int(value["cylinders"]))
        cycle, mean_torque = _cycle_of(value, family, cylinders, task.variable)
        # An idle engine has no load.
        surplus = mean_torque - value["offset"] if designs.kappa[i] != 0.0 else 0.0
        coefficient = surplus / value["speed"] ** value["exponent"]
        cycles, code, high, low, mean = step_cycles(
            cycle, Law(value["offset"], coefficient, value["exponent"]), DEGREE,
            value["start_speed"] or value["speed"],
            (round(value["start_angle"] / DEGREE) + count // 2) % count, int(value["passes"]),
            speeds, rates,
        )  # fmt: skip
        if code in (status.STALLED, status.NOT_CONVERGED):
            store_nothing(target, code, results)
            continue
        delta, error = np.nan_to_num(periodic.scalars[:, i], posinf=math.inf)
        if delta > 0.0:
            error += abs((high - low) / mean - delta) / delta
        if code == status.CONVERGED and error > task.tolerance:
            code = status.TOLERANCE_NOT_MET
        results.status[target] = code
        store(
            target, high, low, mean, high - low, 1.0, float(error), float(cycles), results.wanted,
            results.scalars,
        )  # fmt: skip
        _store_curves(target, speeds, rates, angles, results)
