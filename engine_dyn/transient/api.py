"""Many designs of one engine followed in time, on threads; the same bits on any number of them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from engine_dyn import status
from engine_dyn.given_numbers import given_array
from engine_dyn.plain_arrays import plain
from engine_dyn.speed.mechanisms import map_on_threads
from engine_dyn.transient.fields import (
    AT,
    CURVES,
    CYCLE_RESULTS,
    FIELDS,
    MARK_RESULTS,
    MOST_CYCLES,
    OF_SPEED,
    RUN_RESULTS,
    Found,
    Given,
    faults,
)
from engine_dyn.transient.kernel import FASTEST, follow
from engine_dyn.transient.tables import STEPS, Tables, TransientEngine
from engine_dyn.transient.work import SWITCH, make_work
from engine_dyn.types import Booleans, Floats, Integers

MOST_WAITING = 100_000  # Outputs of a governor on their way to the actuator at once
BLOCK = 16  # Designs of one piece of work

ESTIMATE = 0.1
"""Factor on the difference from a run with half as many steps: fitted, on 560 random load steps, so
that errors above 1e-9 exceed the estimate seldom (at most 3.6 times); their median is a fifth."""


@dataclass(frozen=True, eq=False)
class Transients:
    """Designs that were followed in time, SI units.

    Attributes
    ----------
    outcome : ndarray of int, shape (designs,)
        See `engine_dyn.status`: followed, stopped, not started, runaway, not converged, invalid.
    cycles : dict of str to ndarray, shape (designs, cycles)
        `fields.CYCLE_RESULTS`; NaN behind the end of a run.
    delta : ndarray, shape (designs, cycles)
        Coefficient of speed fluctuation of each cycle.
    marks : dict of str to ndarray, shape (designs, marks)
        `fields.MARK_RESULTS`.
    run : dict of str to ndarray, shape (designs,)
        `fields.RUN_RESULTS`.
    error : ndarray, shape (designs,)
        Estimated largest relative error of the speed at the ends of cycles while above a tenth of
        the nominal speed; infinite where half as many steps have another outcome; NaN if not asked.
    curves : dict of str to ndarray, shape (designs, points)
        crank_angle [rad] since the beginning, time [s], omega [rad/s], load_torque [N m] and
        command [percent], at the ends of the steps of the recorded cycles.

    Examples
    --------
    A disc that friction of 7 N m slows down, without gas; see `follow_designs`:

    >>> import math
    >>> from engine_dyn.geometry.cylinders import even_cylinders
    >>> from engine_dyn.transient import follow_designs, transient_engine
    >>> from sweeps.scene.engine.engine_files import load_engine
    >>> engine = transient_engine(
    ...     load_engine("ntua").family, even_cylinders(1, 4.0 * math.pi), crank_ratio=0.257
    ... )
    >>> found = follow_designs(
    ...     engine, 100, inertia=3.0, lever=1e-12, speed=40.0, friction_constant=7.0, fuel_cut=1e-9
    ... )
    >>> found.outcome, found.run["end_time"].round(3)  # 9 is stopped; 40 rad/s * 3 kg m2/7 N m
    (array([9]), array([17.143]))
    """

    outcome: Integers
    cycles: dict[str, Floats]
    marks: dict[str, Floats]
    run: dict[str, Floats]
    error: Floats
    curves: dict[str, Floats]

    @property
    def delta(self) -> Floats:
        """Coefficient of speed fluctuation, (omega_max - omega_min)/omega_mean."""
        found = self.cycles
        return (found["speed_highest"] - found["speed_lowest"]) / found["speed_mean"]


def follow_designs(
    engine: TransientEngine, cycles: int, *,
    load: tuple[npt.ArrayLike, npt.ArrayLike] = (0.0, 0.0),
    command: tuple[npt.ArrayLike, npt.ArrayLike] | None = None,
    missed: npt.ArrayLike = (), marks: npt.ArrayLike | None = None,
    record: tuple[int, int] = (0, 0), steps: int = STEPS, estimate: bool = True,
    threads: int | None = None, **numbers: npt.ArrayLike,
) -> Transients:  # fmt: skip
    """Follow the speed of designs from crank angle 0 for some cycles.

    Parameters
    ----------
    engine : TransientEngine
        From `tables.transient_engine`: what all designs have in common.
    cycles : int
        Cycles to follow at most; `duration` may end a run before.
    load : pair of array_like, shapes (points,) or (designs, points)
        Times [s], not descending, and the load's torque at nominal speed [N m]. Lines join the
        points, two points at one time are a step; constant before the first and after the last.
    command : pair of array_like, optional
        Times [s] and fuel command [percent of load], in the same way, where there is no governor;
        `start_command` for ever if not given. Of commands beyond the rows of the diagrams, also
        those of a governor, the outermost row is burnt.
    missed : array_like of int, shape (count, 2) or (designs, count, 2)
        Cycles and cylinders, both from 0, of firings without fuel; the cycle is that in which the
        cylinder's firing angle lies. A negative cycle is none.
    marks : array_like, shape (count,) or (designs, count), optional
        Times [s], ascending, from which deviations and the time of recovery are measured up to the
        next, or to the fuel cut; the times of the load's points if not given. NaN where nothing was
        seen, so that marks behind the fuel cut have none.
    record : pair of int
        First cycle whose curves are kept, and the one behind the last.
    steps : int
        Steps a cycle at least.
    estimate : bool
        Whether the error is estimated, from a run with half as many steps.
    threads : int, optional
        One a processor unless given.
    **numbers : array_like, broadcasting to shape (designs,)
        `fields.FIELDS`, SI units, commands in percent of load.

    Returns
    -------
    Transients

    Raises
    ------
    ValueError
        One line for a missing or unknown number, one of `fields.faults`, times that descend or are
        not finite. A design that cannot be followed is no error; its outcome says so.

    Notes
    -----
    The fuel command of a cylinder is a place on the load axis of the diagrams. Load and friction
    are the torque (T_load, T_fr) of E' = T_gas - T_load - T_fr; see `step` and `fields`.

    Examples
    --------
    Load put on a governed engine of six cylinders, with two flywheels:

    >>> import math
    >>> from engine_dyn.geometry.cylinders import even_cylinders
    >>> from engine_dyn.transient import follow_designs, transient_engine
    >>> from sweeps.scene.engine.engine_files import load_engine
    >>> engine = transient_engine(
    ...     load_engine("ntua").family, even_cylinders(6, 4.0 * math.pi), crank_ratio=0.257,
    ...     command_angle=math.radians(-15.0),
    ... )
    >>> found = follow_designs(
    ...     engine, 100, load=([0.0, 2.0, 2.0], [0.0, 0.0, 700.0]), marks=[2.0], speed=157.08,
    ...     inertia=[10.0, 20.0], reciprocating_inertia=0.054, lever=0.001385,
    ...     friction_constant=200.0, governed=1.0, reference_speed=157.08, gain=500.0,
    ...     integral_gain=1000.0, actuator_lag=0.05, highest_command=90.0, lowest_command=-20.0,
    ... )
    >>> (found.marks["speed_lowest"][:, 0] / 157.08).round(3)
    array([0.927, 0.94 ])
    >>> (found.error < 1e-6).tolist()
    [True, True]
    """
    cycles = _whole("cycles", cycles, 1, MOST_CYCLES)
    steps = _whole("steps", steps, 4, 10_000)
    table = _numbers(numbers)
    designs = len(table)
    load_time, load_torque = _points("load", load, designs)
    governed = bool((table[:, AT["governed"]] > 0.0).any())
    if command is None:
        command = (0.0, table[:, AT["start_command"]][:, None])
    elif governed:
        raise ValueError("command: not allowed with a governor, which gives the fuel command")
    command_time, commands = _points("command", command, designs)
    marked = load_time if marks is None else _of_designs("marks", marks, designs)
    if not np.isfinite(marked).all() or (np.diff(marked, axis=1) < 0.0).any():
        raise ValueError("marks: times must be finite and must not descend")
    missing = _missed(missed, designs, engine.cylinders.count)
    begin, end = record
    if not 0 <= begin <= end <= cycles:
        raise ValueError(f"record = {record}: must be cycles from 0 to {cycles}, not descending")
    given = Given(
        table, load_time, load_torque, command_time, commands, missing, marked, begin, end
    )
    tables = engine.tables(steps)
    found = _followed(tables, given, cycles, threads)
    error = np.full(designs, np.nan)
    if estimate:
        rough = _followed(
            engine.tables(max(4, steps // 2)),
            given._replace(first_recorded=0, last_recorded=0, extremes=False), cycles, threads,
        )  # fmt: skip
        error = _error(found, rough, table[:, AT["speed"]])
    return Transients(
        found.outcome, _by_name(CYCLE_RESULTS, found.cycles), _by_name(MARK_RESULTS, found.marks),
        _by_name(RUN_RESULTS, found.run), error,
        {name: found.curves[..., i] for i, name in enumerate(CURVES)},
    )  # fmt: skip


def _by_name(results: tuple[tuple[str, str, str], ...], values: Floats) -> dict[str, Floats]:
    return {name: values[..., i] for i, (name, _, _) in enumerate(results)}


def _followed(tables: Tables, given: Given, cycles: int, threads: int | None) -> Found:
    """Arrays of results, filled block by block."""
    designs, points = len(given.numbers), 0
    if given.last_recorded > given.first_recorded:
        points = (given.last_recorded - given.first_recorded) * len(tables.fires) + 1
    shapes = (
        (cycles, len(CYCLE_RESULTS)), (given.marks.shape[1], len(MARK_RESULTS)),
        (len(RUN_RESULTS),), (points, len(CURVES)),
    )  # fmt: skip
    waiting = _waiting(given.numbers, tables)
    possible = _possible(given.numbers, tables, waiting)
    found = Found(
        np.where(possible, status.FOLLOWED, status.INVALID_INPUT),
        *(np.full((designs, *shape), np.nan) for shape in shapes),
    )
    most = int(waiting[possible].max(initial=0.0))
    firings = cycles * tables.firings + 1
    seen: Any = plain(tables)
    designs_seen, filled = plain(given), plain(found)

    def do(first: int) -> None:
        work = make_work(tables.cylinders, len(tables.fires), most, firings)
        last = min(first + BLOCK, designs)
        follow(first, last, cycles, seen, designs_seen, work, filled)

    for _ in map_on_threads(do, range(0, designs, BLOCK), threads):
        pass
    return found


def _possible(table: Floats, tables: Tables, waiting: Floats) -> Booleans:
    """Which designs have all numbers, an inertia above 0 at all angles, few outputs waiting."""
    inertia, mass, speed = (table[:, AT[n]] for n in ("inertia", "reciprocating_inertia", "speed"))
    least = inertia + mass * float(tables.squares[:, :5].min())
    known = ~np.isnan(table).any(axis=1) & np.isfinite(inertia) & np.isfinite(speed)
    known &= (least > 0.0) & (table[:, AT["start_speed"]] <= FASTEST * speed)
    return known & (waiting <= MOST_WAITING)


def _waiting(table: Floats, tables: Tables) -> Floats:
    """Outputs of the governor that may be on their way to the actuator at once, of each design."""
    fire = tables.nodes[:-1][tables.fires > 0]
    gap = float(np.diff(fire, append=fire[0] + tables.period).min())
    every, speed = table[:, AT["sampling_time"]], table[:, AT["speed"]]
    with np.errstate(divide="ignore", invalid="ignore"):
        shortest = np.where(every > 0.0, every, gap / (2.0 * FASTEST * speed))
        return np.asarray(table[:, AT["dead_time"]] / shortest + 4.0)


def _error(found: Found, rough: Found, nominal: Floats) -> Floats:
    """Estimated error of the speed at the ends of cycles."""
    speed, other = found.cycles[:, :, 1], rough.cycles[:, :, 1]
    with np.errstate(invalid="ignore"):
        apart = np.abs(other / speed - 1.0)
    apart[~(speed > SWITCH * nominal[:, None])] = 0.0
    both = np.nan_to_num(apart, nan=np.inf).max(axis=1)
    error = np.where(found.outcome == rough.outcome, ESTIMATE * both, np.inf)
    return np.where(np.isnan(speed[:, 0]) & (found.outcome == rough.outcome), np.nan, error)


def _numbers(numbers: dict[str, npt.ArrayLike]) -> Floats:
    """Table of the numbers of designs, shape (designs, fields)."""
    unknown = sorted(numbers.keys() - AT.keys())
    if unknown:
        raise ValueError(f"{unknown[0]}: unknown; must be one of {', '.join(AT)}")
    arrays: dict[str, Floats] = {}
    for field in FIELDS:
        if field.name in numbers:
            arrays[field.name] = given_array(field.name, numbers[field.name])
        elif field.name in OF_SPEED and "speed" in arrays:
            arrays[field.name] = OF_SPEED[field.name] * arrays["speed"]
        elif field.default is None:
            raise ValueError(f"{field.name}: missing; must be given [{field.unit}]")
        else:
            arrays[field.name] = np.array(field.default)
    for switch, needed, what in (("governed", "reference_speed", "governor"),
                                 ("starter_torque", "starter_speed", "starter")):  # fmt: skip
        if (arrays[switch] > 0.0).any() and needed not in numbers:
            raise ValueError(f"{needed}: missing; a {what} needs it")
    wide = dict(zip(arrays, np.broadcast_arrays(*arrays.values()), strict=True))
    for name, wrong, must in faults(wide):
        if wrong.any():
            bad = {other: value[wrong].flat[0] for other, value in wide.items()}
            said = must.format_map({other: f"{other}, {value:g}" for other, value in bad.items()})
            raise ValueError(f"{name} = {bad[name]:g}: must be {said}")
    if wide["speed"].ndim > 1:
        raise ValueError("numbers of designs: must be numbers, or lists of one number a design")
    return np.stack([np.atleast_1d(one) for one in wide.values()], axis=1).astype(np.float64)


def _whole(name: str, value: Any, least: int, most: int) -> int:
    number = float(given_array(name, value))
    if not (number == round(number) and least <= number <= most):
        raise ValueError(f"{name} = {number:g}: must be a whole number from {least} to {most}")
    return int(number)


def _of_designs(name: str, given: npt.ArrayLike, designs: int) -> Floats:
    """Numbers of each design, or of all, shape (designs or 1, numbers)."""
    value = np.atleast_1d(given_array(name, given))
    value = value[None] if value.ndim == 1 else value
    if value.ndim != 2 or len(value) not in {1, designs}:
        raise ValueError(f"{name}: must be a list of numbers, or one for each of {designs} designs")
    return np.ascontiguousarray(value)


def _points(
    name: str, points: tuple[npt.ArrayLike, npt.ArrayLike], designs: int
) -> tuple[Floats, Floats]:
    """Points over the time of each design, or of all."""
    time, value = (
        _of_designs(f"{name}, {part}", given, designs)
        for part, given in zip(("times", "values"), points, strict=True)
    )
    if time.shape[1] != value.shape[1] or time.shape[1] == 0:
        raise ValueError(
            f"{name}: {time.shape[1]} times for {value.shape[1]} values: must be one for each"
        )
    for part, array in (("times", time), ("values", value)):
        if not np.isfinite(array).all():
            raise ValueError(f"{name}, {part}: must be finite numbers")
    fall = np.diff(time, axis=1) < 0.0
    if fall.any():
        row, place = np.argwhere(fall)[0]
        raise ValueError(
            f"{name}: time {time[row, place + 1]:g} s after {time[row, place]:g} s: times must not "
            "descend"
        )
    return time, value


def _missed(missed: npt.ArrayLike, designs: int, cylinders: int) -> Integers:
    value = np.asarray(missed)
    value = value.reshape(1, 0, 2) if value.size == 0 else value
    value = value[None] if value.ndim == 2 else value
    if value.ndim != 3 or value.shape[2] != 2 or len(value) not in {1, designs}:
        raise ValueError("missed: must be pairs of a cycle and a cylinder, both from 0")
    if value.size and (value != np.round(value)).any():
        raise ValueError("missed: must be whole numbers")
    wrong = (value[..., 0] >= 0) & ((value[..., 1] < 0) | (value[..., 1] >= cylinders))
    if wrong.any():
        bad = int(value[..., 1][wrong].flat[0])
        raise ValueError(f"missed, cylinder {bad}: must be from 0 to {cylinders - 1}")
    return value.astype(np.int64)
