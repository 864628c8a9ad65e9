"""Motors, driver tables, loads over speed and angle, gears: against cycles followed in time.

Each group has one machine and one law, and designs with flywheels from heavy to next to nothing, so
that torques answer from hardly at all to very stiffly to the speed. docs/measurements.md says what
is compared.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from typing import Any

import numpy as np
from scipy.interpolate import CubicSpline, PchipInterpolator

from benchmarks import problem
from benchmarks.problem import BORE, CRANKCASE, LEVER, RADIUS, STROKE
from benchmarks.stress.findings import DEFECTS, Findings, Say, count, gathered
from benchmarks.stress.judging import TOLERANCE, VERDICTS
from engine_dyn import diagram_from_points, family_from_diagrams
from engine_dyn.loads.driven_machine import DrivenMachine
from engine_dyn.loads.torque_curves import TorqueOverAngle, torque_over_angle, torque_over_speed
from engine_dyn.pressure.family import Family
from engine_dyn.speed import dispatch
from engine_dyn.speed.torque import mean_gas_torque
from engine_dyn.status import (
    CONVERGED,
    INVALID_INPUT,
    MEANINGS,
    NO_STEADY_STATE,
    NOT_CONVERGED,
    STALLED,
    TOLERANCE_NOT_MET,
)
from engine_dyn.types import Floats
from oracle import in_time
from oracle.designs import table as points_of
from oracle.solution import acceleration, velocity

PART = "Motors, drivers and loads over speed and angle"

CYCLE = 4.0 * math.pi
GROUP = 12
"""Designs of one machine."""

POINTS = 14400
"""Samples of the torque over the cycle, for a periodic cubic spline."""

EXACT = 1e-10
"""Relative tolerance of the integration in time."""

STARTS = 12
"""Of cycles, where those that were followed have not ended."""

MOST_CYCLES = 12
"""Cycles that are followed where nothing was found."""

BORDER = 0.03
"""Smallest omega/omega_n below which running and stalled are told apart by a hair."""

LAWS = ("motor", "driver table", "load table", "linear and square", "power")

ANGLES = np.radians(np.arange(0.0, 360.0, 2.0))


@dataclass(frozen=True)
class Machine:
    """One group: an engine, what it drives or is driven by, and its designs.

    `law` gives F and dF/dq of q = (omega/omega_n)^2 by formulas that share nothing with the
    package; `inputs` are keywords of `dispatch.solve`; `ends` are the speeds over nominal between
    which the law is known.
    """

    name: str
    driven: DrivenMachine
    law: Callable[[Any], tuple[Any, Any]]
    inputs: dict[str, Any]
    fired: bool
    over_angle: tuple[float, float, float] | None
    ends: tuple[float, float] = (0.0, math.inf)


@cache
def diagram(fired: bool) -> tuple[Any, Family]:
    """Points of the pressure as a spline of SciPy, and as a family of the package."""
    degrees, bar = points_of(problem.PRESSURE if fired else problem.MOTORED)
    values = 1e5 * np.array(bar)
    values[-1] = values[0]
    made = diagram_from_points(np.radians(degrees), values)
    spline = CubicSpline(np.radians(degrees), values, bc_type="periodic")
    return spline, family_from_diagrams([0.0], [made])


def lobes(theta: Any) -> Any:
    """Torque over its own angle, of mean 1."""
    return 1.0 + 0.8 * np.cos(theta) + 0.5 * np.sin(3.0 * theta)


@cache
def _lobes_as_points() -> tuple[Any, TorqueOverAngle]:
    """The same as points, for SciPy and for the package."""
    values = lobes(ANGLES)
    closed = np.append(values, values[0])
    spline = CubicSpline(np.append(ANGLES, 2.0 * math.pi), closed, bc_type="periodic")
    return spline, torque_over_angle(ANGLES, values, own_angle=True)


def _log(random: np.random.Generator, low: float, high: float, size: Any = None) -> Any:
    return np.exp(random.uniform(math.log(low), math.log(high), size))


def motor_law(synchronous: float, slip: float) -> Any:
    """Kloss's formula over its value at nominal speed; speeds over nominal."""

    def torque(x: Any) -> tuple[Any, Any]:
        s = 1.0 - x / synchronous
        below = s * s + slip * slip
        return s / below, -(slip * slip - s * s) / below**2 / synchronous

    return _over_nominal(torque)


def table_law(x: Floats, y: Floats) -> Any:
    """A monotone interpolant, straight beyond its ends; speeds over nominal."""
    curve = PchipInterpolator(x, y)
    slope = curve.derivative()
    ends = [(float(z), float(curve(z)), float(slope(z))) for z in (x[0], x[-1])]

    def torque(at: Any) -> tuple[Any, Any]:
        value, first = curve(at), slope(at)
        for (z, v, s), beyond in zip(ends, (at < x[0], at > x[-1]), strict=True):
            value = np.where(beyond, v + s * (at - z), value)
            first = np.where(beyond, s, first)
        return value, first

    return _over_nominal(torque)


def _over_nominal(torque: Any) -> Any:
    at_nominal = float(torque(1.0)[0])

    def law(q: Any) -> tuple[Any, Any]:
        x = np.sqrt(np.maximum(q, 1e-9))
        value, first = torque(x)
        return value / at_nominal, first / at_nominal * 0.5 / x

    return law


def machine(seed: int, number: int) -> Machine:
    """Draw one group."""
    random = np.random.default_rng([seed, 3000, number])
    name = LAWS[random.choice(5, p=(0.35, 0.25, 0.25, 0.1, 0.05))]
    nominal = float(_log(random, 500.0, 4000.0)) * math.pi / 30.0
    cylinders = int(random.choice((1, 1, 2, 3, 4, 6)))
    ratio = float(random.uniform(0.15, 0.4))
    driver = name in ("motor", "driver table")
    fired = not driver or random.uniform() < 0.3
    _, family = diagram(fired)
    gas = cylinders * LEVER * float(mean_gas_torque(ratio, 0.0, family))
    size = cylinders * LEVER * 6e5
    generates = name == "motor" and fired and random.uniform() < 0.5
    friction = size * float(_log(random, 0.05, 0.5))
    if driver and not generates:
        friction += max(gas, 0.0)
    elif fired:
        friction = min(friction, 0.5 * gas)
    gear = float(random.choice((0.5, 1.0, 1.5, 2.0)))
    inputs: dict[str, Any] = {"exponent": 2.0, "gear_ratio": gear, "offset": 0.0}
    driven, ends, law = DrivenMachine(), (0.0, math.inf), None
    mean = gas - friction
    angle = None
    if random.uniform() < 0.35:  # a part of the torque over the load's own angle
        phase = float(random.uniform(0.0, 2.0 * math.pi))
        scale = float(random.uniform(0.05, 0.5)) * abs(mean) / gear
        angle = (scale, gear, phase)
        inputs |= {"load_scale": scale, "load_phase": phase, "offset": scale * gear}
        driven = replace(driven, over_angle=_lobes_as_points()[1])
    if name == "motor":
        slip = float(_log(random, 1e-3, 0.2)) * (-1.0 if generates else 1.0)
        breakdown = float(_log(random, 1.2, 12.0)) * abs(slip)
        synchronous = 1.0 / (1.0 - slip)
        inputs |= {"synchronous_speed": synchronous * nominal, "breakdown_slip": breakdown}
        driven, law = replace(driven, motor=True), motor_law(synchronous, breakdown)
    elif name in ("driver table", "load table"):
        low, high = ((0.0, 3.0), (0.5, 1.5), (0.8, 1.25))[random.choice(3, p=(0.6, 0.3, 0.1))]
        x = np.sort(np.concatenate([[low, high], random.uniform(low, high, random.integers(1, 9))]))
        x = x[np.append(True, np.diff(x) > 0.01 * (high - low))]
        steep = float(_log(random, 0.3, 60.0))
        if name == "load table":  # it grows with the speed, with a part that does not
            y = 20.0 + 100.0 * np.minimum((x + 0.02) ** steep, 1e4)
        else:  # its torque falls with the speed; it brakes beyond some speed
            y = 100.0 * (1.0 - 2.0 * np.tanh(steep * (x - 1.0 - 0.3 / (1.0 + steep))))
        if random.uniform() < 0.15:  # not monotone
            y *= 1.0 + 0.3 * np.sin(float(random.uniform(3.0, 20.0)) * x)
        own = name == "load table" and random.uniform() < 0.5
        speeds = nominal * (gear if own else 1.0) * x
        curve = torque_over_speed(speeds, y, driver=driver, own_speed=own)
        made: Any = {"driver_over_speed" if driver else "load_over_speed": curve}
        driven = replace(driven, **made)
        law, ends = table_law(x, y), (low, high)
    elif name == "linear and square":
        weight = float(random.uniform())
        inputs |= {"load_linear": weight, "load_square": (1.0 - weight) / nominal}
        driven = replace(driven, load_law="linear_square")
        law = _over_nominal(
            lambda x: (weight * x + (1.0 - weight) * x * x, weight + 2.0 * (1.0 - weight) * x)
        )
    else:
        exponent = float(random.uniform(0.3, 8.0))
        inputs["exponent"] = exponent
        law = _over_nominal(lambda x: (x**exponent, exponent * x ** (exponent - 1.0)))
    # The work of a firing stroke over the kinetic energy: 1 and more is a light flywheel.
    inertia = 2.0 * size / cylinders / (_log(random, 0.02, 200.0, GROUP) * nominal**2)
    mass = _log(random, 1e-3, 0.9, GROUP) * inertia / (cylinders * RADIUS**2)
    inputs |= {
        "crank_ratio": ratio, "row": 0.0, "scale": 1.0, "crankcase_pressure": CRANKCASE,
        "bore": BORE, "double_radius": STROKE, "mass": mass, "speed": nominal, "inertia": inertia,
        "friction_torque": friction, "mean_torque": mean, "cylinders": cylinders,
        "inertia_model": str(random.choice(("constant", "variable"))),
        "closure": str(random.choice(("power_mean", "power_mean", "cycle_time"))),
    }  # fmt: skip
    return Machine(name, driven, law, inputs, fired, angle, ends)


def equation(chosen: Machine, place: int, mu: float) -> in_time.Stiff:
    """The equation of motion of one design, docs/method.md (53), from points and formulas."""
    given = chosen.inputs
    nominal, inertia = given["speed"], float(given["inertia"][place])
    mass, ratio, count = float(given["mass"][place]), given["crank_ratio"], given["cylinders"]
    variable = given["inertia_model"] == "variable"
    phi = np.arange(POINTS) * CYCLE / POINTS
    spline, _ = diagram(chosen.fired)
    torque = np.full(POINTS, -given["friction_torque"])
    square = np.zeros(POINTS)
    for i in range(count):
        own = phi - i * CYCLE / count
        v, b = velocity(own, ratio), acceleration(own, ratio)
        # The pressure's points begin half a cycle before firing.
        folded = np.mod(own + 0.5 * CYCLE, CYCLE) - 0.5 * CYCLE
        torque += LEVER * (spline(folded) - CRANKCASE) * v
        square += v * v
        if not variable:
            torque -= mass * RADIUS**2 * nominal**2 * v * b
    if chosen.over_angle is not None:
        scale, gear, phase = chosen.over_angle
        torque -= scale * gear * _lobes_as_points()[0](np.mod(gear * phi + phase, 2.0 * math.pi))
    energy = 0.5 * inertia * nominal**2
    surplus = float(np.mean(torque))
    rate = CubicSpline(
        np.append(phi, CYCLE), (np.append(torque, torque[0]) - surplus) / energy,
        bc_type="periodic",
    )  # fmt: skip
    made = in_time.Stiff(
        lambda at: rate(np.mod(at, CYCLE)), surplus / energy, chosen.law, CYCLE, mu=mu
    )
    if not variable:
        return made
    eta = mass * RADIUS**2 / inertia
    tau = 1.0 + eta * (square - float(np.mean(square)))
    theta = CubicSpline(np.append(phi, CYCLE), np.append(tau, tau[0]), bc_type="periodic")
    return replace(made, theta=lambda at: theta(np.mod(at, CYCLE)))


def highest(chosen: in_time.Stiff) -> float:
    """(omega/omega_n)^2 at angle 0 above that of every cycle that has the nominal speed."""
    phi = np.arange(POINTS) * CYCLE / POINTS
    work = np.cumsum(chosen.work_rate(phi)) * CYCLE / POINTS
    tau = chosen.theta(phi)
    return float((tau.max() + np.ptp(work) + abs(chosen.kappa) * CYCLE) / tau[0])


def judge(chosen: Machine, place: int, found: dict[str, Any]) -> tuple[str, float, Any]:
    """Verdict on one design, largest relative difference, and the cycle found in time."""
    code = int(found["status"][place])
    nominal = chosen.inputs["speed"]
    timed = chosen.inputs["closure"] == "cycle_time"
    low, high = chosen.ends
    if code in (CONVERGED, TOLERANCE_NOT_MET):
        mu = 1.0 / float(found["load_factor"][place]) if timed else 1.0
        start = float(found["omega"][place, 0] / nominal) ** 2
        cycle = in_time.follow(equation(chosen, place, mu), start, EXACT, closed=1e-8)
        if not cycle.closed:
            near = found["omega_min"][place] < BORDER * nominal
            return ("border" if near else "outcome"), 0.0, cycle
        differs = [
            abs(float(found[key][place]) / (scale * value) - 1.0)
            for key, scale, value in (
                ("delta", 1.0, cycle.delta), ("omega_max", nominal, cycle.highest),
                ("omega_min", nominal, cycle.lowest), ("omega_mean", nominal, cycle.mean),
            )
        ]  # fmt: skip
        if timed:
            differs.append(abs(cycle.time - 1.0))
        worst = max(differs)
        if cycle.lowest < low * (1.0 - 1e-6) or cycle.highest > high * (1.0 + 1e-6):
            return "outcome", worst, cycle
        if code == CONVERGED:
            return ("agrees" if worst <= TOLERANCE else "off"), worst, cycle
        either = max(differs[0], differs[2])
        honest = either <= max(float(found["delta_error"][place]), TOLERANCE)
        return ("honest" if honest else "off"), worst, cycle
    if timed:
        return _judge_without_time(chosen, place, code)
    return _judge_missing(chosen, place, code)


def _judge_missing(chosen: Machine, place: int, code: int) -> tuple[str, float, Any]:
    """Verdict where no numbers were found, for the load as it is given."""
    problem_in_time = equation(chosen, place, 1.0)
    tau = problem_in_time.theta(np.arange(POINTS) * CYCLE / POINTS)
    if code == INVALID_INPUT and float(np.min(tau)) <= 0.0:
        return "agrees", 0.0, None
    if problem_in_time.kappa * float(problem_in_time.law(1.0)[1]) <= 0.0:
        # Repels the nominal speed.
        return ("agrees" if code == NO_STEADY_STATE else "outcome"), 0.0, None
    for start in (1.0, highest(problem_in_time)):
        cycle = in_time.follow(problem_in_time, start, 1e-7, most=MOST_CYCLES, closed=1e-6)
        if cycle.closed:
            break
    low, high = chosen.ends
    if cycle.closed:
        outside = cycle.lowest < low or cycle.highest > high
        if code == INVALID_INPUT and outside:
            return "agrees", 0.0, cycle
        near = cycle.lowest < BORDER or abs(cycle.lowest - low) < 1e-4
        near |= abs(cycle.highest - high) < 1e-4
        return ("border" if near else "outcome"), 0.0, cycle
    if not cycle.stands:
        if code == NO_STEADY_STATE:
            return "agrees", 0.0, cycle
        if not _falls_from_everywhere(problem_in_time):
            return "unknown", 0.0, cycle
    if code == NOT_CONVERGED:
        return "gave up", 0.0, cycle
    return ("agrees" if code in (STALLED, NO_STEADY_STATE) else "outcome"), 0.0, cycle


def _falls_from_everywhere(given: in_time.Stiff) -> bool:
    """Whether a cycle ends slower than it began, from all of some starts, however little slower."""
    return all(
        in_time.after(given, float(start), 1e-7) < start
        for start in np.geomspace(1e-2, highest(given), STARTS)
    )


def _judge_without_time(chosen: Machine, place: int, code: int) -> tuple[str, float, Any]:
    """Verdict where no mu was found: the cycle's time must not be that of nominal speed anywhere.

    The time falls or rises with mu throughout, so a bracket is followed until it is narrow.
    """
    verdict = _judge_missing(chosen, place, code)
    if verdict[0] == "agrees" and code in (NO_STEADY_STATE, INVALID_INPUT):
        return verdict
    sense = 1.0 if equation(chosen, place, 1.0).kappa > 0.0 else -1.0

    def at(m: float) -> Any:
        return in_time.follow(equation(chosen, place, math.exp(sense * m)), 1.0, 1e-7, closed=1e-6)

    # Below `slow` the cycle takes too long or ends at standstill, above `quick` not long enough.
    slow, quick = -1.0, 1.0
    late = cycle = at(quick)
    for _ in range(16):
        m = 0.5 * (slow + quick)
        found = at(m)
        if found.closed and found.time < 1.0:
            quick, cycle = m, found
        else:
            slow, late = m, found
    if not cycle.closed:
        return "unknown", 0.0, cycle
    if not late.closed:  # it comes to standstill before it takes the asked time
        return ("agrees" if code == STALLED else "unknown"), 0.0, cycle
    if cycle.lowest < max(BORDER, chosen.ends[0]) or cycle.highest > chosen.ends[1]:
        return "border", 0.0, cycle
    return "outcome", 0.0, cycle


def compare(job: tuple[int, int]) -> Findings:
    """Solve one group by both; verdicts are counted by law and status."""
    seed, number = job
    chosen = machine(seed, number)
    inputs = chosen.inputs
    _, family = diagram(chosen.fired)
    wanted = ("delta", "omega_max", "omega_min", "omega_mean", "delta_error", "load_factor")
    options = {"family": family, "driven": chosen.driven, "threads": 1, **inputs}
    found = dispatch.solve(wanted=wanted, **options)
    found["omega"] = dispatch.solve(wanted=("omega",), crank_angle=np.zeros(1), **options)["omega"]
    result = Findings()
    for place in range(GROUP):
        code = int(found["status"][place])
        verdict, differs, cycle = judge(chosen, place, found)
        result.counts[verdict, chosen.name, code] += 1
        if verdict == "agrees" and code == CONVERGED:
            result.note(chosen.name, differs)
            result.note((chosen.name, "stiffest"), -cycle.decay)
        if verdict in (*DEFECTS, "unknown") or code == NOT_CONVERGED:
            result.examples.append({
                "what": f"{verdict} {chosen.name}", "group": number, "place": place,
                "status": MEANINGS[code], "differs": differs, "cycle": str(cycle),
                "machine": str(chosen.driven.over_speed or chosen.driven.law),
                **{k: v if isinstance(v, str) else float(np.broadcast_to(v, (GROUP,))[place])
                   for k, v in inputs.items()},
            })  # fmt: skip
    return result


def run(seed: int, designs: int, processes: int, say: Say) -> Findings:
    """Compare groups of designs, in processes of their own."""
    jobs = [(seed, number) for number in range(-(-designs // GROUP))]
    return gathered(compare, jobs, processes, say, "driven machines, groups")


# What is told -------------------------------------------------------------------------------------


def words(found: Findings) -> dict[str, str]:
    """Sentences with figures, by their names."""
    return {
        "driven": f"{count(found.total(VERDICTS))} designs with motors, driver tables and loads "
        "over speed and angle, compared with an integration in time: "
        f"{count(found.defects)} wrong."
    }
