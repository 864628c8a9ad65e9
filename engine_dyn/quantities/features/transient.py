"""Speed that does not repeat: load steps, governor, start and stop.

The motion is that of `engine_dyn.transient`; here are its keys, and what is asked of it.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from engine_dyn import status
from engine_dyn.forces.torque import piston_area
from engine_dyn.given_numbers import distinct_combinations
from engine_dyn.quantities.features.characteristic import (
    OF_FRICTION,
    OF_TORQUE,
    load_with_torque,
    made_of,
)
from engine_dyn.quantities.features.feature import Feature
from engine_dyn.quantities.node import Dimension, Node, hidden, parameter, variants
from engine_dyn.transient.fields import AT, FIELDS, OF_SPEED, faults
from engine_dyn.transient.limits import TransientLimits, keeps
from engine_dyn.types import Floats, Integers
from engine_dyn.units import DEGREE, RPM

SOURCE = "this project"

ENOUGH = 0.015  # Width of the recovery band over the speed, where no limits are given

POINT_STEP = 2.0 * DEGREE  # Between points of recorded cycles

AT_ONCE = 1_000_000  # Cycles that are followed together: some 100 MB

PERCENT = 0.01


class Points(NamedTuple):
    """Values over the time; two at one time are a step."""

    time: Floats  # [s], not descending
    value: Floats


@dataclass(frozen=True, eq=False)
class Transient:
    """What all designs of a scene have in common while their speed is followed."""

    cycles: int  # Largest number of cycles
    period: float  # Angle of a cycle [rad]
    load: Points
    of_load: str  # What its values are: "load" [percent of `full_load_torque`], "torque" or "power"
    law: str  # "torque", "power" or "exponent": how the load's torque depends on the speed
    marks: Floats  # Times of changes of the load [s], behind which the speed is judged
    duration: float = math.inf  # Time after which no further cycle begins [s]
    command: Points | None = None  # Fuel command [percent], where no governor gives it
    missed: Integers | None = None  # Cycles and cylinders, from 0, of firings without fuel
    record: tuple[int, int] = (0, 0)  # Recorded cycles: the first, from 0, and that behind the last
    limits: TransientLimits | None = None

    @property
    def recorded_points(self) -> int:
        """Points of the recorded cycles, both ends among them."""
        cycles = self.record[1] - self.record[0]
        return cycles * round(self.period / POINT_STEP) + 1 if cycles else 0


def _number(
    name: str, symbol: str, unit: str, meaning: str, default: float | None = 0.0, **more: Any
) -> Node:
    """Key of a number, not below 0 unless said."""
    given = {"low": 0.0, "low_included": True, "unless_given": default, **more}
    return parameter(name, symbol, unit, meaning, SOURCE, **given)


def _field_of(name: str) -> str:
    """Field of `engine_dyn.transient.fields` that a key gives as it is."""
    bare = name.removeprefix("transient_").removeprefix("governor_")
    return "reference_speed" if name == "governor_speed" else bare


def _of_field(name: str, symbol: str, **more: Any) -> Node:
    """Key with the meaning, range and default of its field."""
    field = FIELDS[AT[_field_of(name)]]
    unit, si = ("rpm", RPM) if field.unit == "rad s-1" else (field.unit, 1.0)
    default = field.default
    if default is not None and abs(default) >= 1000.0:
        more = {"make": lambda: default, **more}  # Lists name no number where there is none
    given = {"low_included": field.low_included, "high": field.high,
             "high_included": field.high < math.inf, "whole": field.whole, "si": si}  # fmt: skip
    return _number(name, symbol, unit, field.meaning, None if "make" in more else default,
                   low=field.low, **given, **more)  # fmt: skip


_OF_TORQUE = (
    *(name for name in OF_TORQUE if name not in ("variant_of", "diagram_scale")),
    "pressure_scale", *OF_FRICTION["chen_flynn"],
)  # fmt: skip
"""Nodes of the mean brake torque at any load, where the load follows from no other torque."""


def _start_command(
    *, transient: Transient, load_at_start: Any, variant_of: Callable[[str], Node], family: Any,
    **needs: Any,
) -> Any:  # fmt: skip
    """Command with the torque of the load at the beginning, below the diagrams in a line.

    Where commands are given over the time, the first of them.
    """
    if transient.command is not None:
        return np.broadcast_to(transient.command.value[0], _shape(needs, load_at_start))
    known = {**needs, "family": family}
    found = load_with_torque(load_at_start, "load", known, variant_of)
    loads = np.asarray(family.loads, dtype=float)
    low = [
        np.asarray(made_of("torque_mean", {**known, "load": load}, variant_of))
        for load in loads[:2]  # Engines with one diagram give the command themselves
    ]
    rise = (low[1] - low[0]) / (loads[1] - loads[0])
    with np.errstate(divide="ignore", invalid="ignore"):
        below = loads[0] - (low[0] - load_at_start) / rise
    lost = np.where(load_at_start < low[0], np.where(rise > 0.0, below, loads[0]), loads[-1])
    field = FIELDS[AT["start_command"]]
    return np.clip(np.where(np.isnan(found), lost, found), field.low, field.high)


def _full_load_torque(
    *, variant_of: Callable[[str], Node], family: Any, undisturbed_set: Any, **needs: Any
) -> Any:  # fmt: skip
    load = min(100.0, float(family.loads[-1]))
    known = {**needs, "family": family, "load": load, "cylinder_set": undisturbed_set}
    torque = made_of("torque_mean", known, variant_of)
    return np.broadcast_to(torque, _shape(needs, torque, undisturbed_set))


def _shape(needs: dict[str, Any], *values: Any) -> tuple[int, ...]:
    """Shape of all that varies: a value may depend on fewer of its needs."""
    varying = (value.shape for value in needs.values() if isinstance(value, np.ndarray))
    return np.broadcast_shapes(*map(np.shape, values), *varying)


def _load_size(
    transient: Transient, full_load_torque: Any, speed: Any, transient_step_factor: Any
) -> Any:
    full, nominal, factor = np.broadcast_arrays(full_load_torque, speed, transient_step_factor)
    sizes = {"load": PERCENT * full, "torque": 1.0, "power": 1.0 / nominal}
    return factor * sizes[transient.of_load]


_AS_FIELDS: tuple[tuple[str, str, dict[str, Any]], ...] = (
    ("transient_start_speed", "n_0", {
        "make": lambda governor_speed, governor_droop, transient_start_command: governor_speed
        * (1.0 - PERCENT**2 * governor_droop * transient_start_command)}),
    ("transient_start_command", "y_0", {
        "make": _start_command,
        "needs": ("transient", "load_at_start", "variant_of", *_OF_TORQUE)}),
    ("transient_ready_speed", "n_r", {"make": lambda speed: OF_SPEED["ready_speed"] * speed}),
    ("transient_fuel_from", "n_f", {}),
    ("transient_fuel_cut", "t_f", {}),
    ("transient_boost_lag", r"\tau_b", {}),
    ("transient_boost_margin", "y_b", {}),
    ("transient_dispersion", r"\sigma_c", {}),
    ("transient_cylinder_dispersion", r"\sigma_z", {}),
    ("transient_seed", "i_s", {}),
    ("governor_speed", "n_g", {
        "make": lambda speed, governor_droop: speed / (1.0 - PERCENT * governor_droop)}),
    ("governor_window", "n_w", {}),
    ("governor_sampling_time", "T_s", {}),
    ("governor_dead_time", "T_d", {}),
    ("governor_actuator_lag", "T_a", {}),
    ("governor_lowest_command", "y_1", {}),
    ("governor_highest_command", "y_2", {
        "make": lambda family: min(100.0, float(family.loads[-1]))}),
    ("starter_torque", "M_s", {}),
    ("starter_speed", "n_s", {"make": lambda speed: 1.0 * speed}),
    ("starter_release", "n_e", {}),
    ("clutch_time", "t_c", {}),
    ("clutch_inertia", r"\Theta_c", {}),
    ("clutch_speed", "n_c", {}),
    ("clutch_torque", "M_c", {}),
)  # fmt: skip
"""Keys of numbers that the motion takes as they are: name, symbol and what a field does not say."""

TABLES = ("transient", "governor", "starter", "clutch")
"""Tables of scenes; the numbers of each are parameters that begin with its name."""

PARAMETERS = tuple(sorted((
    _number("transient_command_angle", r"\varphi_c", "degree", "angle from its firing at which a "
            "cylinder takes the fuel command: -360 with a mixture, about -15 with injection", None,
            si=DEGREE, low=-540.0, high=0.0, high_included=True),
    _number("transient_step_factor", "f_s", "1", "factor on the load over the time", 1.0),
    _number("transient_recovery_band", r"\Delta n", "percent", "width of the band around the last "
            "speed, over the nominal speed", None, low_included=False, high=200.0,
            make=lambda transient: 100.0 * (
                ENOUGH if transient.limits is None else transient.limits.band)),
    _number("governor_gain", "K", "1", "percent of fuel command per percent of speed"),
    _number("governor_integral", "K_i", "s-1", "percent of fuel command per percent of speed and "
            "second"),
    _number("governor_derivative", "K_d", "s", "percent of fuel command per percent of speed in a "
            "second"),
    _number("governor_droop", "s", "percent", "fall of the governed speed from no load to full "
            "load", high=90.0, high_included=True),
    *(_of_field(name, symbol, **more) for name, symbol, more in _AS_FIELDS),
), key=lambda node: TABLES.index(node.name.partition("_")[0])))  # fmt: skip

KEY_OF = {_field_of(name): name for name, *_ in _AS_FIELDS}
"""Keys of fields that they give as they are."""

_FIELDS = {
    **KEY_OF, "speed": "speed", "inertia": "inertia", "load_offset": "load_offset",
    "load_exponent": "transient_exponent", "gas_factor": "pressure_scale",
}  # fmt: skip
"""Fields of `engine_dyn.transient.fields` that a node gives as it is."""

_ENGINE = (
    "cylinder_set", "crank_ratio", "offset_ratio", "crankcase_pressure", "transient_command_angle",
)  # fmt: skip
"""Nodes on which the tables of an engine depend."""

_CYCLE = {
    "transient_time": "time", "transient_end_speed": "speed_end",
    "transient_mean_speed": "speed_mean", "transient_highest_speed": "speed_highest",
    "transient_lowest_speed": "speed_lowest", "transient_command": "command",
    "transient_fuel": "burnt",
}  # fmt: skip
_RUN = {"time_to_start": "time_to_start", "transient_end_time": "end_time",
        "cycles_followed": "cycles_done", "cycles_to_stop": "cycles_to_stop"}  # fmt: skip
_CURVES = {"run_angle": "crank_angle", "run_time": "time", "run_speed": "omega",
           "run_load": "load_torque", "run_command": "command"}  # fmt: skip
_MARKS = ("speed_fall", "speed_rise", "recovery_time", "settled_speed", "speed_before_change")

OF_RECORD = tuple(_CURVES)
"""Quantities of recorded cycles."""

OF_CHANGES = (
    *_MARKS, "largest_speed_fall", "largest_speed_rise", "longest_recovery_time", "limits_kept",
)  # fmt: skip
"""Quantities that follow changes of the load."""

GIVES = (
    *_CYCLE, "transient_delta", *_MARKS, *_RUN, *_CURVES, "transient_error", "transient_status",
)  # fmt: skip


def _numbers(needs: dict[str, Any]) -> dict[str, Any]:
    """Fields of the designs, SI units; not yet checked."""
    torque = needs["displacement"] / needs["period"]  # Of a mean effective pressure
    per_speed = needs["mean_piston_speed"] / needs["speed"]
    radius = 0.5 * needs["double_radius"]
    gains = [100.0 * np.asarray(needs[f"governor_{one}"])
             for one in ("gain", "integral", "derivative")]  # fmt: skip
    return {
        **{field: needs[node] for field, node in _FIELDS.items()},
        "lever": piston_area(needs["bore"]) * radius,
        "reciprocating_inertia": needs["reciprocating_mass"] * radius**2,
        "friction_constant": needs["friction_constant"] * torque + needs["auxiliary_torque"]
        + needs["auxiliary_mean"],
        "friction_peak_share": needs["friction_peak_pressure"] * torque,
        "friction_linear": needs["friction_mean_piston_speed"] * per_speed * torque,
        "friction_square": needs["friction_mean_piston_speed_square"] * per_speed**2 * torque,
        "governed": np.any(np.broadcast_arrays(*gains), axis=0),
        "gain": gains[0], "integral_gain": gains[1], "derivative_gain": gains[2],
        "droop": PERCENT * np.asarray(needs["governor_droop"]),
        "recovery_band": 0.5 * PERCENT * np.asarray(needs["transient_recovery_band"]),
        "duration": needs["transient"].duration,
    }  # fmt: skip


def _solve(
    *, wanted: tuple[str, ...], threads: int | None = None, progress: Any = None, **needs: Any
) -> dict[str, Any]:
    from engine_dyn.speed.mechanisms import map_on_threads

    transient: Transient = needs["transient"]
    given = {**_numbers(needs), "load_each": needs["load_size"]}
    arrays = np.broadcast_arrays(
        *(np.asarray(value, dtype=float) for value in given.values()),
        *(np.asarray(needs[name], dtype=float) for name in _ENGINE),
    )
    shape = arrays[0].shape
    numbers = {name: np.ravel(a) for name, a in zip(given, arrays, strict=False)}
    engines, which = distinct_combinations(*(np.ravel(a) for a in arrays[len(given) :]))
    results = _empty(wanted, transient, which.size)
    order = np.argsort(which, kind="stable")
    begin = np.searchsorted(which[order], np.arange(len(engines) + 1))
    together = max(16, AT_ONCE // transient.cycles)
    jobs = [
        (number, order[first : min(first + together, begin[number + 1])])
        for number in range(len(engines))
        for first in range(begin[number], begin[number + 1], together)
    ]
    # Where designs have engines of their own, each is one piece of work
    alone = 1 if len(jobs) > 1 else threads
    made: dict[int, Any] = {}

    def do(job: tuple[int, Integers]) -> int:
        number, places = job
        if number not in made:
            made[number] = _engine(engines[number], needs)
        _follow(made[number], transient, {n: v[places] for n, v in numbers.items()}, places,
                results, alone)  # fmt: skip
        if len(jobs) == len(engines):  # Its tables serve nobody else
            del made[number]
        return places.size

    for done in map_on_threads(do, jobs, threads):
        if progress is not None:
            progress(done)
    return {name: value.reshape(shape + value.shape[1:]) for name, value in results.items()}


def _empty(wanted: tuple[str, ...], transient: Transient, designs: int) -> dict[str, Any]:
    sizes = {
        **dict.fromkeys((*_CYCLE, "transient_delta"), (transient.cycles,)),
        **dict.fromkeys(_MARKS, (transient.marks.size,)),
        **dict.fromkeys(_CURVES, (transient.recorded_points,)),
    }
    results = {name: np.full((designs, *sizes.get(name, ())), np.nan) for name in wanted}
    results["transient_status"] = np.full(designs, float(status.INVALID_INPUT))
    return results


def _engine(row: Floats, needs: dict[str, Any]) -> Any:
    from engine_dyn.transient.tables import transient_engine

    number, crank_ratio, offset_ratio, crankcase, angle = row.tolist()
    return transient_engine(
        needs["family"], needs["cylinders_by_count"][int(number)], crank_ratio=crank_ratio,
        offset_ratio=offset_ratio, crankcase_pressure=crankcase, command_angle=angle,
    )  # fmt: skip


def _follow(
    engine: Any, transient: Transient, numbers: dict[str, Any], places: Integers,
    results: dict[str, Any], threads: int | None,
) -> None:  # fmt: skip
    """Follow some designs of an engine, and store what is wanted at their places."""
    from engine_dyn.transient.api import follow_designs

    each = numbers.pop("load_each")
    good = np.isfinite(each)
    for fault in faults(numbers, engine.family.high):
        good &= ~fault.designs
    places, numbers = places[good], {name: value[good] for name, value in numbers.items()}
    if not places.size:
        return
    given: dict[str, Any] = {}
    if transient.command is not None:
        given["command"] = tuple(transient.command)
    recorded = any(name in results for name in _CURVES)
    if recorded:  # Curves are drawn in lines between the ends of steps
        given |= {"steps": round(transient.period / POINT_STEP), "record": transient.record}
    missed = transient.missed
    found = follow_designs(
        engine, transient.cycles,
        load=(transient.load.time, each[good, None] * transient.load.value),
        marks=transient.marks, missed=() if missed is None else missed,
        estimate="transient_error" in results, threads=threads, **given, **numbers,
    )  # fmt: skip
    marks, speed = found.marks, numbers["speed"][:, None]
    made = {
        **{name: found.cycles[field] for name, field in _CYCLE.items()},
        **{name: found.run[field] for name, field in _RUN.items()},
        # To stand still is what is asked for where the fuel is cut
        "transient_status": np.where(
            (found.outcome == status.STOPPED) & np.isfinite(found.run["cycles_to_stop"]),
            status.FOLLOWED, found.outcome,
        ),
        "transient_error": found.error,
        "transient_delta": found.delta,
        "speed_fall": _beyond(marks["speed_before"] - marks["speed_lowest"], speed),
        "speed_rise": _beyond(marks["speed_highest"] - marks["speed_before"], speed),
        "recovery_time": marks["recovery_time"],
        "settled_speed": marks["speed_after"],
        "speed_before_change": marks["speed_before"],
    }  # fmt: skip
    for name, array in results.items():
        array[places] = made[name] if name in made else _recorded(transient, found, name)


def _recorded(transient: Transient, found: Any, name: str) -> Floats:
    """Values of a curve at the points of the recorded cycles; NaN behind the end of a run."""
    first, last = transient.record
    points = np.linspace(
        first * transient.period, last * transient.period, transient.recorded_points
    ) * (1.0 - 1e-12)  # The last point is not beyond the run's
    values = np.full((len(found.outcome), points.size), np.nan)
    if name == "run_angle":
        values[:] = points
        return values
    for row, angle, curve in zip(
        values, found.curves["crank_angle"], found.curves[_CURVES[name]], strict=True
    ):
        there = np.isfinite(angle)
        if there.any():
            row[:] = np.interp(points, angle[there], curve[there], right=np.nan)
    return values


def _beyond(change: Floats, speed: Floats) -> Floats:
    """Fall or rise in percent of the nominal speed, 0 where there is none."""
    return np.asarray(np.maximum(100.0 * change / speed, 0.0))


def _with_fuel(transient: Transient, transient_fuel_cut: Any) -> Any:
    """Which changes of the load come before the fuel cut: what follows it, no governor can hold."""
    return np.less(transient.marks, transient_fuel_cut)


def _largest(transient: Transient, transient_fuel_cut: Any, **needs: Any) -> Any:
    (values,) = needs.values()
    counts = _with_fuel(transient, transient_fuel_cut)
    return np.where(counts.any(axis=-1), np.where(counts, values, 0.0).max(axis=-1), np.nan)


def _overshoot(transient_mean_speed: Any, speed: Any) -> Any:
    with np.errstate(invalid="ignore"):
        return 100.0 * (np.fmax.reduce(transient_mean_speed / speed, axis=-1) - 1.0)


def _variation(transient_mean_speed: Any, cycles_followed: Any) -> Any:
    """Of the second half of the cycles that were followed."""
    values = np.asarray(transient_mean_speed)
    cycle = np.arange(values.shape[-1])
    done = np.asarray(cycles_followed)
    late = np.where((cycle >= done // 2) & (cycle < done), values, np.nan)
    count = np.maximum(np.sum(~np.isnan(late), axis=-1), 1)
    mean = np.nansum(late, axis=-1) / count
    square = np.nansum((late - mean[..., None]) ** 2, axis=-1) / count
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.sqrt(square) / mean


def _kept(
    speed_fall: Any, speed_rise: Any, recovery_time: Any, transient: Transient,
    transient_fuel_cut: Any,
) -> Any:  # fmt: skip
    limits = transient.limits
    assert limits is not None
    within = keeps(PERCENT * speed_fall, PERCENT * speed_rise, recovery_time, limits)
    judged = ~np.isnan(speed_fall).all(axis=-1)
    within |= ~_with_fuel(transient, transient_fuel_cut)
    return np.where(judged, within.all(axis=-1), np.nan)


def _result(name: str, symbol: str, unit: str, meaning: str, over: str = "", **more: Any) -> Node:
    return Node(name, symbol, unit, meaning, SOURCE, needs=("transient_solution",),
                adds=(over,) if over else (), **more)  # fmt: skip


_NEEDS = tuple(dict.fromkeys((
    "transient", "family", "cylinders_by_count", *_ENGINE, "displacement", "period",
    "mean_piston_speed", "double_radius", "bore", "reciprocating_mass", "friction_constant",
    "friction_peak_pressure", "friction_mean_piston_speed", "friction_mean_piston_speed_square",
    "auxiliary_torque", "auxiliary_mean", "governor_gain", "governor_integral",
    "governor_derivative", "governor_droop", "transient_recovery_band", "load_size",
    *_FIELDS.values(),
)))  # fmt: skip

NODES = (
    Node(
        "full_load_torque", "M_{100}", "N m", "mean brake torque at nominal speed with the highest "
        "diagram, up to 100 percent of load, where every cylinder burns fully", SOURCE,
        # Other scenes have no set in which every cylinder burns fully
        needs=("transient", "variant_of", "undisturbed_set", *(
            name for name in _OF_TORQUE if name not in ("cylinder_set", "pressure_share")
        )),
        make=_full_load_torque,
    ),
    hidden("load_size", "N m", "torque of a load of size 1 at nominal speed", _load_size),
    hidden(
        "load_at_start", "N m", "torque of the load at the beginning",
        lambda transient, load_offset, load_size: load_offset
        + load_size * np.interp(0.0, *transient.load),
    ),
    *variants(
        Node("transient_exponent", "", "1", "exponent of the load's torque", public=False),
        {
            "no_transient": lambda: 0.0,
            "load_by_exponent": lambda load_exponent: load_exponent,
            "load_by_torque": lambda: 0.0,
            "load_by_power": lambda: -1.0,
        },
    ),
    Node(
        "transient_solution", "", "", "speed that does not repeat", SOURCE, kind="stage",
        public=False, outcome="status", gives=GIVES, needs=_NEEDS, make=_solve, width=100_000,
    ),
    _result("transient_time", "t", "s", "time at the end of the cycle", "run_cycle"),
    _result("transient_end_speed", "n_e", "rpm", "speed at the end of the cycle", "run_cycle",
            si=RPM),
    _result("transient_mean_speed", "n_m", "rpm", "mean speed over the cycle's crank angle",
            "run_cycle", si=RPM),
    _result("transient_highest_speed", "n_{max}", "rpm", "highest speed in the cycle", "run_cycle",
            si=RPM),
    _result("transient_lowest_speed", "n_{min}", "rpm", "lowest speed in the cycle", "run_cycle",
            si=RPM),
    _result("transient_delta", r"\delta", "1", "coefficient of speed fluctuation of the cycle",
            "run_cycle"),
    _result("transient_command", "y", "percent", "fuel command of the actuator in the cycle",
            "run_cycle"),
    _result("transient_fuel", "y_b", "percent", "mean command that cylinders burn at its end",
            "run_cycle"),
    Node("transient_load", "M_L", "N m", "torque of the load at the end of the cycle, at nominal "
         "speed", SOURCE, make=lambda transient, transient_time, load_offset, load_size: load_offset
         + load_size * np.interp(transient_time, *transient.load)),
    _result("speed_fall", r"\delta^-", "percent", "fall of the mean speed of a cycle after a "
            "change of load, over the nominal speed", "load_change"),
    _result("speed_rise", r"\delta^+", "percent", "rise of the mean speed of a cycle after a "
            "change of load, over the nominal speed", "load_change"),
    _result("recovery_time", "t_r", "s", "time until the mean speed of a cycle stays in the "
            "recovery band", "load_change"),
    _result("settled_speed", "n_s", "rpm", "mean speed of the last cycle before the next change of "
            "load, or the fuel cut", "load_change", si=RPM),
    _result("speed_before_change", "n_v", "rpm", "mean speed of the last cycle before the change "
            "of load", "load_change", si=RPM),
    *(
        Node(name, symbol, unit, meaning, SOURCE, removes=("load_change",), make=_largest,
             needs=(of, "transient", "transient_fuel_cut"))
        for of, name, symbol, unit, meaning in (
            ("speed_fall", "largest_speed_fall", r"\delta^-", "percent",
             "largest fall of the speed after changes of load"),
            ("speed_rise", "largest_speed_rise", r"\delta^+", "percent",
             "largest rise of the speed after changes of load"),
            ("recovery_time", "longest_recovery_time", "t_r", "s", "longest recovery time"),
        )
    ),
    Node("limits_kept", "g", "1", "whether the limits are kept after each change of load", SOURCE,
         removes=("load_change",), make=_kept, meanings=("exceeded", "kept")),
    Node("run_overshoot", r"\delta_o", "percent", "largest mean speed of a cycle over the nominal "
         "speed, less 100 percent", SOURCE, removes=("run_cycle",), make=_overshoot),
    Node("cycle_speed_variation", "COV", "1", "standard deviation over the mean of the cycles' "
         "mean speeds, second half of the run", SOURCE, removes=("run_cycle",), make=_variation),
    _result("time_to_start", "t_s", "s", "time until the engine has started"),
    _result("transient_end_time", "t_e", "s", "time at which the run ends"),
    _result("cycles_followed", "N", "1", "whole cycles that were followed"),
    _result("cycles_to_stop", "N_s", "1", "cycles from the fuel cut to standstill"),
    _result("run_angle", r"\varphi", "degree", "crank angle since the beginning", "run_point",
            si=DEGREE),
    _result("run_time", "t", "s", "time since the beginning", "run_point"),
    _result("run_speed", "n", "rpm", "speed in the recorded cycles", "run_point", si=RPM),
    _result("run_load", "M_L", "N m", "load torque in the recorded cycles", "run_point"),
    _result("run_command", "y", "percent", "fuel command in the recorded cycles", "run_point"),
    _result("transient_error", r"\varepsilon", "1", "estimated relative error of the speed at the "
            "ends of cycles"),
    _result("transient_status", "", "1", "outcome of the speed that does not repeat",
            public=False),
    *(
        Node("status", "", "1", "outcome of the design", SOURCE, when=word,
             meanings=status.MEANINGS,
             make=lambda transient_status: np.asarray(transient_status).astype(np.int8))
        for word in ("load_by_exponent", "load_by_torque", "load_by_power")
    ),
)  # fmt: skip

FEATURE: Feature[Transient] = Feature(
    "transient", "speed that does not repeat", "transients", NODES, PARAMETERS,
    (
        Dimension("run_cycle", "", "1", "cycle since the beginning, counted from 1", whole=True),
        Dimension("load_change", "", "1", "change of load, counted from 1", whole=True),
        Dimension("run_point", "", "1", "point of recorded cycles, counted from 1", whole=True),
    ),
    sizes=lambda part: (part.cycles, part.marks.size, part.recorded_points),
    words=(
        {
            "no_transient": "the speed repeats",
            "load_by_exponent": "it is followed in time, the load's torque by load_exponent",
            "load_by_torque": "it is followed in time, with a torque that no speed changes",
            "load_by_power": "it is followed in time, with a power that no speed changes",
        },
    ),
    called={
        "recovery_time": "load step, load acceptance, governor, transient",
        "speed_fall": "speed dip, undershoot, load acceptance, block load, governor",
        "speed_rise": "overshoot, load rejection, governor",
        "settled_speed": "droop, isochronous, governor",
        "transient_command": "governor, rack, actuator",
        "limits_kept": "ISO 8528-5, governor, load acceptance",
        "time_to_start": "starter, cranking, run-up",
        "cycles_to_stop": "run-down, coast-down, shutdown",
        "cycle_speed_variation": "idle stability, cyclic dispersion",
    },
    constant="transient",
)  # fmt: skip
