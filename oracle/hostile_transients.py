"""Absurd designs followed in time: each must end in a true outcome.

`python tools/hostile_transients.py` follows 100,000 random designs in some minutes, and says how
they ended; 50 that scipy's DOP853 can follow, too, are compared with it. Fewer are a test.
"""

import math
from typing import Any

import numpy as np

from engine_dyn import status
from engine_dyn.geometry.cylinders import even_cylinders
from engine_dyn.pressure.family import Family
from engine_dyn.pressure.motored import motored
from engine_dyn.transient import TransientEngine, Transients, follow_designs, transient_engine
from oracle.transients import CYCLE, Reference

FASTEST = 3.0  # Speed over the nominal one at which runs end
OF_DOP853 = {
    "dispersion": 0.0, "cylinder_dispersion": 0.0, "fuel_cut": math.inf, "clutch_time": math.inf,
    "starter_torque": 0.0, "starter_speed": 1.0, "starter_release": math.inf,
    "duration": math.inf, "gas_factor": 1.0, "fuel_from": 0.0,
}  # fmt: skip
"""What the reference cannot do, or not at once."""


def hostile_engine(draw: np.random.Generator, family: Family) -> TransientEngine:
    """Engine with one to eight cylinders."""
    return transient_engine(
        family, even_cylinders(int(draw.integers(1, 9)), CYCLE),
        crank_ratio=draw.uniform(0.05, 0.4), command_angle=draw.choice([-CYCLE, -6.0, -0.26, 0.0]),
        row_step=draw.choice([2.5, 10.0, 100.0]),
    )  # fmt: skip


def hostile_designs(draw: np.random.Generator, count: int, cylinders: int) -> dict[str, Any]:
    """Keywords of `follow_designs`: what is given is given to half of the designs."""

    def wild(low: float, high: float) -> Any:
        return np.exp(draw.uniform(math.log(low), math.log(high), count))

    def some(values: Any, otherwise: float = 0.0) -> Any:
        return np.where(draw.random(count) < 0.5, values, otherwise)

    # Most points are steps, and many stand at one instant; every second load is a train of pulses.
    times = np.sort(np.round(draw.uniform(0.0, 2.0, (count, 8)), 1), axis=1)
    torques = draw.normal(0.0, 1000.0, (count, 8)) * (draw.random((count, 8)) < 0.7)
    missed = np.stack([draw.integers(-3, 20, (count, 6)), draw.integers(0, cylinders, (count, 6))],
                      axis=2)  # fmt: skip
    speed = wild(5.0, 500.0)
    limits = np.sort(draw.uniform(-1e3, 1e3, (2, count)), axis=0)
    return {
        "load": (times, torques), "missed": missed, "marks": times[:, ::2],
        "inertia": wild(1e-2, 1e4), "reciprocating_inertia": some(wild(1e-4, 1.0)),
        "lever": wild(1e-6, 1e-2), "gas_factor": some(wild(1e-2, 10.0), 1.0), "speed": speed,
        "start_speed": some(draw.uniform(0.0, 3.0, count) * speed, 0.0),
        "start_command": draw.uniform(-50.0, 150.0, count), "governed": some(1.0),
        "load_exponent": draw.choice([-1.0, 0.0, 1.0, 1.6, 2.0, 7.3, 10.0], count),
        "load_offset": some(draw.normal(0.0, 300.0, count)),
        "friction_constant": some(wild(1e-3, 1e5)), "friction_peak_share": some(wild(1e-9, 1e-3)),
        "friction_linear": some(wild(1e-6, 1e3)), "friction_square": some(wild(1e-9, 1e3)),
        "reference_speed": wild(1.0, 1e3), "gain": some(wild(1.0, 1e6)),
        "integral_gain": some(wild(1.0, 1e6)), "derivative_gain": some(wild(1e-3, 1e5)),
        "droop": some(wild(1e-3, 10.0)), "window": draw.integers(1, 64, count),
        "sampling_time": some(wild(1e-3, 1.0)), "actuator_lag": some(wild(1e-5, 10.0)),
        "dead_time": some(wild(1e-3, 0.5)), "lowest_command": limits[0],
        "highest_command": limits[1], "boost_lag": some(wild(1e-4, 10.0)),
        "boost_margin": some(draw.uniform(0.0, 50.0, count), math.inf),
        "starter_torque": 1e-3 + some(wild(1.0, 1e5)), "starter_speed": wild(1e-2, 1e3),
        "starter_release": some(wild(1e-2, 1e3), math.inf), "fuel_from": some(wild(1.0, 100.0)),
        "fuel_cut": some(wild(1e-3, 10.0), math.inf),
        "clutch_time": some(wild(1e-3, 2.0), math.inf),
        "clutch_inertia": some(wild(1e-3, 1e3)), "clutch_speed": some(wild(1.0, 1e3)),
        "clutch_torque": some(wild(1.0, 1e5), math.inf), "duration": some(wild(1e-2, 10.0), 1e9),
        "dispersion": some(draw.uniform(0.0, 0.5, count)), "seed": draw.integers(0, 10**15, count),
        "cylinder_dispersion": some(draw.uniform(0.0, 0.5, count)),
    }  # fmt: skip


def untrue(found: Transients, given: dict[str, Any], cycles: int) -> dict[str, int]:
    """What is not true of the outcomes of designs, and of how many."""
    outcome, run, each = found.outcome, found.run, found.cycles
    followed = outcome == status.FOLLOWED
    done = np.isfinite(each["speed_end"]).sum(axis=1)
    behind = np.arange(cycles) >= done[:, None]
    begin = np.concatenate([np.zeros((len(outcome), 1)), each["time"][:, :-1]], axis=1)
    # A shaft that was turned back has been at some angles several times.
    spent, slack = each["time"] - begin, 1.0 + 1e-9
    low, high, mean = (each[f"speed_{name}"] for name in ("lowest", "highest", "mean"))
    whole = (done == cycles) | (run["end_time"] >= given["duration"])
    known = {status.FOLLOWED, status.STOPPED, status.NOT_STARTED, status.RUNAWAY,
             status.INVALID_INPUT, status.NOT_CONVERGED}  # fmt: skip
    with np.errstate(invalid="ignore", divide="ignore"):
        wrong = {
            "unknown outcome": ~np.isin(outcome, list(known)),
            "followed, but not to the end": followed & ~whole,
            "cycles done": (run["cycles_done"] != done) & (outcome != status.INVALID_INPUT),
            "NaN in a cycle that was followed": np.any(
                [~np.isfinite(values) & ~behind for values in each.values()], axis=(0, 2)),
            "mean speed beyond the extremes": (
                ~behind & (low > 0.0) & ((mean > high * slack) | (mean < low / slack))
            ).any(axis=1),
            "time does not fit the extremes": (
                ~behind & ((spent * high * slack < CYCLE) | (spent * low > CYCLE * slack))
            ).any(axis=1),
            "faster than a runaway": (~behind & (
                each["speed_end"] > FASTEST * given["speed"][:, None] * slack)).any(axis=1),
            "started without reaching the speed": (outcome == status.NOT_STARTED)
            & np.isfinite(run["time_to_start"]),
        }  # fmt: skip
    return {name: int(where.sum()) for name, where in wrong.items() if where.any()}


def of_dop853(engine: TransientEngine, draw: np.random.Generator, wanted: int) -> list[float]:
    """Largest relative errors of the speed of hostile designs that DOP853 can follow."""
    count, cycles, errors = 200, 4, []
    cylinders = engine.cylinders.count
    given = hostile_designs(draw, count, cylinders) | OF_DOP853
    given |= {"start_speed": given["speed"] * draw.uniform(0.5, 2.0, count)}
    found = follow_designs(engine, cycles, **given)
    slowest = np.nanmin(found.cycles["speed_lowest"], axis=1, initial=math.inf)
    good = (found.outcome == status.FOLLOWED) & (slowest > 0.15 * given["speed"])
    commands, family = engine.tables(36).commands, engine.family
    rows = [motored(family.at(0.0)), *(family.at(float(one)) for one in commands[1:])]
    firing = [-member.phase % CYCLE for member in engine.cylinders.members]
    for i in np.flatnonzero(good)[:wanted]:
        numbers = {name: float(value[i]) if np.ndim(value) else float(value)
                   for name, value in given.items()
                   if name not in {"load", "missed", "marks"}}  # fmt: skip
        times, torques = (one[i].tolist() for one in given["load"])
        missed = tuple(map(tuple, given["missed"][i].tolist()))
        exact = Reference(rows, commands, firing, engine.command_angle, engine.crank_ratio,
                          numbers, (times, torques), missed).run(cycles)  # fmt: skip
        error = float(np.abs(found.cycles["speed_end"][i] / exact[:, 1] - 1.0).max())
        errors.append(error)
        if error > 1e-6:
            print(f"error {error:.1e}, estimated {found.error[i]:.1e}: {numbers}")
    return errors
