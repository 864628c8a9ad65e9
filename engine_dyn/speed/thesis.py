"""The thesis's own method: cycles of explicit Euler steps in omega, one degree each.

docs/method.md (89) and (90); Kakaitsas (2015), section 4.2, eqs. 4.1 and 4.2. It exists to
reproduce printed numbers: this file is validation, apart from the solvers.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from engine_dyn import status
from engine_dyn.compilation import kernel
from engine_dyn.forces.superposition import CrankTrain
from engine_dyn.forces.torque import (
    GasPressure,
    friction_over_stroke,
    gas_torque,
    inertia_torque,
    reciprocating_inertia,
)
from engine_dyn.geometry.cylinders import Cylinders
from engine_dyn.loads.friction import StrokeFriction
from engine_dyn.pressure.family import Family
from engine_dyn.speed.designs import LEVELS, Designs, Task, store, store_nothing
from engine_dyn.speed.fields import IDLE, SCALAR_NAMES, Results
from engine_dyn.speed.general.one_by_one import solve_one_by_one
from engine_dyn.speed.grouping import Call
from engine_dyn.types import Booleans, Floats
from engine_dyn.units import DEGREE

MOST_CYCLES = 30000  # Largest number of cycles that are followed


class Cycle(NamedTuple):
    """Curves of one design at the samples of a cycle.

    `torque` is that of gas, friction and, with constant inertia, of the masses [N m]; `theta` the
    moment of inertia [kg m2] and `turn` its slope.
    """

    torque: Floats
    theta: Floats
    turn: Floats


class Nominal(NamedTuple):
    """Mean and range of the torque at nominal speed [N m]."""

    mean: float
    reach: float


@kernel
def step_cycles(
    cycle: Cycle, offset: float, coefficient: float, exponent: float, start: float, first: int,
    passes: int, speeds: Floats, rates: Floats,
) -> tuple[int, int, float, float, float]:  # fmt: skip
    """Step through cycles of omega [rad/s] by explicit Euler, docs/method.md (89).

    The load is offset + coefficient omega^exponent. From sample `first` on, `speeds` gets the
    samples of the last cycle, `rates` the angular acceleration [rad/s2] there. Returns the number
    of cycles done (`passes`, or until one closes where that is 0), the outcome, and the largest,
    smallest and mean sample of the last cycle.
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
            load = offset + coefficient * omega**exponent
            torque = cycle.torque[j] - load - 0.5 * cycle.turn[j] * omega * omega
            rates[j] = torque / cycle.theta[j]
            omega += rates[j] / omega * DEGREE
        mean = total / count
        # Cycles end when the speeds at both ends of a cycle differ by no more than this [rad/s]:
        # Kakaitsas (2015), section 4.2.
        if passes == 0 and abs(omega - begin) <= 1e-6:
            return number, status.CONVERGED, top, bottom, mean
    code = status.PASSES_DONE if passes > 0 else status.NOT_CONVERGED
    return limit, code if omega > 0.0 else status.STALLED, top, bottom, mean


def _cycle_of(
    value: dict[str, float], family: Family, cylinders: Cylinders, variable: bool
) -> tuple[Cycle, Nominal]:
    """Curves of a design, docs/method.md (27) and (39), and its torque at nominal speed."""
    count, bore, mass = round(cylinders.period / DEGREE), value["bore"], value["mass"]
    angle: Floats = -0.5 * cylinders.period + np.arange(count, dtype=np.float64) * DEGREE
    train = CrankTrain(
        value["crank_ratio"], value["double_radius"], 1, cylinders.period, value["offset_ratio"],
        {1: cylinders},
    )  # fmt: skip
    gas = GasPressure(family, value["row"], value["scale"], value["crankcase_pressure"])
    friction: Any = value["friction_torque"]
    levels = [max(value[name], 0.0) for name in LEVELS]
    if any(levels):
        shape = StrokeFriction._make([*levels, value["ring_pressure"]])
        friction = friction_over_stroke(angle, train, bore, gas, friction, shape)
    engine = gas_torque(angle, train, bore, gas) - friction
    masses = inertia_torque(angle, train, mass, value["speed"])
    torque = engine + masses
    nominal = Nominal(float(torque.mean()), float(np.ptp(torque)))
    if not variable:
        return Cycle(torque, np.full(count, value["inertia"]), np.zeros(count)), nominal
    moving = reciprocating_inertia(angle, train, mass)
    theta = value["inertia"] + moving - moving.mean()
    return Cycle(engine, theta, -2.0 * masses / value["speed"] ** 2), nominal


def _store_curves(
    target: int, speeds: Floats, rates: Floats, angles: Floats, results: Results
) -> None:
    """Write the curves of a design; between samples, the speed follows the method's own step."""
    place = np.mod(angles + 0.5 * speeds.size * DEGREE, speeds.size * DEGREE) / DEGREE
    node = np.floor(place + 1e-9).astype(np.int64)
    past = np.maximum(place - node, 0.0) * DEGREE
    speed, rate = speeds[node % speeds.size], rates[node % speeds.size]
    for curve, values in (
        (results.omega, speed + past * rate / speed), (results.acceleration, rate),
    ):  # fmt: skip
        if curve.shape[1] > 0:
            curve[target] = values


def _periodic(call: Call, designs: Designs, task: Task, chosen: Booleans) -> Floats:
    """Delta and its error by the general solver, (2, design), for chosen designs; else NaN."""
    compared, nothing = ("delta", "delta_error"), np.empty((1, 0))
    results = Results(
        np.array([compared.index(n) if n in compared else -1 for n in SCALAR_NAMES]),
        np.full((2, chosen.size), np.nan), np.empty(chosen.size, dtype=np.int8), nothing, nothing,
        np.zeros(0, dtype=np.bool_),
    )  # fmt: skip
    if chosen.any():
        own = np.minimum(np.arange(designs.target.size), chosen.size - 1)
        designs = designs._replace(target=own)
        solve_one_by_one(np.flatnonzero(chosen), task, call.columns, designs, results, last=False)
    return results.scalars


def _outcome(surplus: float, idle: bool, cycle: Cycle) -> int:
    """Outcome before the first step, as in the general solver, docs/method.md (67)."""
    if not (idle or surplus > 0.0):
        return status.NO_STEADY_STATE
    return status.CONVERGED if (cycle.theta > 0.0).all() else status.INVALID_INPUT


def solve_as_printed(call: Call, task: Task, angles: Floats, results: Results) -> None:
    """Solve designs as the thesis does; the error is the difference to the periodic solution.

    The coefficient k follows from the mean of the samples. The error is needed where it is wanted,
    and to judge a cycle that closes.
    """
    piece, designs = call.piece, call.designs()
    family, size = piece.source.family, piece.size
    wanted = results.wanted[SCALAR_NAMES.index("delta_error")] >= 0
    closing = np.broadcast_to(piece.chosen.take("passes") == 0.0, size)
    periodic = _periodic(call, designs, task, closing | wanted)
    count = round(piece.source.cylinders.period / DEGREE)
    speeds, rates = np.zeros(count), np.zeros(count)
    for i in range(size):
        target = int(designs.target[i])
        one = piece.chosen.subset(np.array([i]))
        value = {name: float(one.take(name).flat[0]) for name in one.inputs.arrays}
        cylinders = piece.grouping.cylinders_of(int(value["cylinders"]))
        cycle, nominal = _cycle_of(value, family, cylinders, task.variable)
        surplus = value["mean_torque"] - value["offset"]
        idle = abs(surplus) <= IDLE * nominal.reach
        code = _outcome(surplus, idle, cycle)
        if code != status.CONVERGED:
            store_nothing(target, code, results)
            continue
        surplus = 0.0 if idle else nominal.mean - value["offset"]  # an idle engine has no load
        coefficient = surplus / value["speed"] ** value["exponent"]
        cycles, code, high, low, mean = step_cycles(
            cycle, value["offset"], coefficient, value["exponent"],
            value["start_speed"] or value["speed"],
            (round(value["start_angle"] / DEGREE) + count // 2) % count, int(value["passes"]),
            speeds, rates,
        )  # fmt: skip
        if code in (status.STALLED, status.NOT_CONVERGED):
            store_nothing(target, code, results)
            continue
        delta, error = np.nan_to_num(periodic[:, i], posinf=math.inf)
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
