"""[transient], [governor], [starter] and [clutch] of a scene: speed that does not repeat.

The numbers of these tables are parameters, such as `governor_gain`: they may also stand in [set],
[axes], [designs] and [sample]. What else [transient] has is the same for all designs of a scene.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, Literal

import numpy as np
from pydantic import Field, create_model

from engine_dyn.engine import Engine
from engine_dyn.quantities.features.feature import Feature
from engine_dyn.quantities.features.transient import (
    FEATURE,
    OF_CHANGES,
    OF_RECORD,
    PARAMETERS,
    TABLES,
    Points,
    Transient,
)
from engine_dyn.transient.fields import LOWEST_COMMAND, MOST_CYCLES
from engine_dyn.transient.limits import ISO_8528_5_G2, TransientLimits
from engine_dyn.types import Floats
from sweeps.base.checks import Strict, check_range
from sweeps.base.dimensions import ELASTICITY
from sweeps.base.errors import SceneError
from sweeps.base.files.csv_tables import read_csv
from sweeps.base.files.regular_files import referred
from sweeps.scene.features.feature import GivenFeature, with_part
from sweeps.scene.values import GivenValues

MOST_RECORDED = 10_000  # Cycles
MOST_STEPS = 10_000

_SIZES = {"load": "load_percent", "torque": "torque_Nm", "power": "power_W"}
"""Ways to say how large a load is, with their columns in files."""

_OF_PARAMETER = {node.name: node for node in PARAMETERS}


class LoadStep(Strict):
    """A load from a time on."""

    time: float = Field(description="a number in s, 0 or more", ge=0.0)
    load: float | None = Field(
        default=None,
        description="a number in percent of the torque at full load, where every cylinder burns",
    )
    torque: float | None = Field(default=None, description="a number in N m, at nominal speed")
    power: float | None = Field(default=None, description="a number in W, at nominal speed")
    ramp: float = Field(
        default=0.0, description="a number in s, 0 or more: how long the change takes", ge=0.0
    )


class CommandStep(Strict):
    """A fuel command from a time on."""

    time: float = Field(description="a number in s, 0 or more", ge=0.0)
    command: float = Field(
        description=f"a number in percent of load, at least {LOWEST_COMMAND:g}", ge=LOWEST_COMMAND
    )
    ramp: float = Field(
        default=0.0, description="a number in s, 0 or more: how long the change takes", ge=0.0
    )


class Missed(Strict):
    """A firing without fuel."""

    cycle: int = Field(description="a whole number from 1", ge=1)
    cylinder: int = Field(description="the number of a cylinder, from 1", ge=1)


class Limits(Strict):
    """Limits after a change of load."""

    fall: float = Field(description="a number in percent of the nominal speed, above 0", gt=0.0)
    rise: float = Field(description="a number in percent of the nominal speed, above 0", gt=0.0)
    band: float = Field(
        description="a number in percent, above 0 and at most 100: the width of the band",
        gt=0.0, le=100.0,
    )  # fmt: skip
    recovery: float = Field(description="a number in s, above 0", gt=0.0)


class _Transient(Strict):
    """Cycles that are followed one by one: loads, fuel, firings that are missed."""

    cycles: int = Field(
        description=f"a whole number from 1 to {MOST_CYCLES}: cycles that are followed at most",
        ge=1, le=MOST_CYCLES,
    )  # fmt: skip
    duration: float | None = Field(
        default=None, description="a number in s above 0: no cycle begins after it", gt=0.0
    )
    load_steps: list[LoadStep] | None = Field(
        default=None, description="a list of tables with time and load, torque or power",
        min_length=1, max_length=MOST_STEPS,
    )  # fmt: skip
    load_file: str | None = Field(
        default=None, description="the path of a CSV file with the columns time_s and one of "
        f"{', '.join(_SIZES.values())}", min_length=1,
    )  # fmt: skip
    load_law: Literal["torque", "power", "exponent"] | None = Field(
        default=None,
        description="'torque' (constant over the speed), 'power' or 'exponent' "
        "(load_exponent); by default that of the sizes, of load in percent 'exponent'",
    )
    command_steps: list[CommandStep] | None = Field(
        default=None, description="a list of tables with time and command, in place of a governor",
        min_length=1, max_length=MOST_STEPS,
    )  # fmt: skip
    missed: list[Missed] = Field(
        default=[], description="a list of tables with cycle and cylinder: firings without fuel",
        max_length=MOST_STEPS,
    )  # fmt: skip
    record: list[int] | None = Field(
        default=None, description="the first and the last cycle of which curves are kept, from 1",
        min_length=2, max_length=2,
    )  # fmt: skip
    limits: Literal["ISO 8528-5 G2"] | Limits | None = Field(
        default=None, description="'ISO 8528-5 G2', or a table with fall, rise, band and recovery"
    )


def _with_numbers(table: str, base: type[Strict] = Strict) -> type[Strict]:
    """Model of a table, with the numbers that are its parameters."""
    fields: Any = {}
    for node in PARAMETERS:
        if node.name.startswith(f"{table}_"):
            unit = f" in {node.unit}" if node.unit not in ("1", "s-1") else ""
            text = f"a number{unit}: {node.long_name}"
            fields[node.name.removeprefix(f"{table}_")] = (
                float | None, Field(default=None, description=text)
            )  # fmt: skip
    says = base.__doc__ if base is not Strict else f"The {table}."
    return create_model(f"{table.capitalize()}Table", __base__=base, __doc__=says, **fields)


MODELS = {table: _with_numbers(table, _Transient if table == "transient" else Strict)
          for table in TABLES}  # fmt: skip


def _take_numbers(engine: Engine, given: Strict, table: str, where: str) -> Engine:
    """Return the engine with the numbers of a table among its values."""
    values = {}
    for key in type(given).model_fields:
        node, value = _OF_PARAMETER.get(f"{table}_{key}"), getattr(given, key)
        if node is not None and value is not None:
            check_range(value, f"{where}[{table}] {key}", node)
            values[node.name] = float(value)
    return replace(engine, values={**engine.values, **values})


def _read_numbers(table: str, engine: Engine, given: Any, folder: Path, where: str) -> Engine:
    return _take_numbers(engine, given, table, where)


def _read(engine: Engine, given: Any, folder: Path, where: str) -> Engine:
    place = f"{where}[transient]"
    engine = _take_numbers(engine, given, "transient", where)
    if given.load_steps is not None and given.load_file is not None:
        raise SceneError(f"{place}: has both load_steps and load_file; give one of them")
    if given.load_file is not None:
        size, load = _of_file(given.load_file, folder, f"{place} load_file")
    else:
        steps = given.load_steps or []
        size = _size(steps, f"{place} load_steps")
        values = [float(getattr(one, size)) for one in steps]
        load = _points(steps, values, f"{place} load_steps")
    laws = {"load": "exponent", "torque": "torque", "power": "power"}
    duration = math.inf if given.duration is None else given.duration
    command = None
    if given.command_steps is not None:
        values = [one.command for one in given.command_steps]
        command = _points(given.command_steps, values, f"{place} command_steps", values[0])
    for what, times in (("a load", load.time), ("a command", command.time if command else [0.0])):
        if times[-1] > duration:
            raise SceneError(
                f"{place} duration = {duration:g} s: {what} at {times[-1]:g} s lies behind it"
            )
    missed = np.array([(m.cycle - 1, m.cylinder - 1) for m in given.missed], dtype=np.int64)
    for cycle in missed[:, 0] if missed.size else ():
        if cycle >= given.cycles:
            raise SceneError(
                f"{place} missed: cycle {cycle + 1} lies behind cycles = {given.cycles}"
            )
    once: set[tuple[int, int]] = set()
    for one in given.missed:
        if (one.cycle, one.cylinder) in once:
            raise SceneError(
                f"{place} missed: cycle {one.cycle}, cylinder {one.cylinder} is given twice; "
                "firings must be unique"
            )
        once.add((one.cycle, one.cylinder))
    return with_part(
        engine, FEATURE.name,
        Transient(
            given.cycles, engine.period, load, size, given.load_law or laws[size],
            _changes(load), duration, command, missed if missed.size else None,
            _record(given, place), _limits(given.limits),
        ),
    )  # fmt: skip


def _changes(load: Points) -> Floats:
    """Times at which the load begins to change: after a while in which it did not."""
    moves = np.diff(load.value) != 0.0
    begins = moves & ~np.append(False, moves[:-1])
    return np.unique(load.time[:-1][begins])


def _record(given: Any, place: str) -> tuple[int, int]:
    """Recorded cycles from 0, without the last."""
    if given.record is None:
        return 0, 0
    first, last = given.record
    if not 1 <= first <= last <= given.cycles or last - first >= MOST_RECORDED:
        raise SceneError(
            f"{place} record = {given.record}: must be two cycles from 1 to {given.cycles}, the "
            f"first and the last of at most {MOST_RECORDED}"
        )
    return first - 1, last


def _size(steps: Sequence[LoadStep], where: str) -> str:
    """Way in which the sizes of all loads are given."""
    sizes = [[key for key in _SIZES if getattr(one, key) is not None] for one in steps]
    for number, keys in enumerate(sizes, start=1):
        if len(keys) != 1:
            has = " and ".join(keys) or "none of them"
            raise SceneError(
                f"{where}, number {number}: has {has}; must have one of {', '.join(_SIZES)}"
            )
        if keys != sizes[0]:
            raise SceneError(
                f"{where}, number {number}: has {keys[0]}, others {sizes[0][0]}; all must be "
                "given in the same way"
            )
    return sizes[0][0] if sizes else "load"


def _points(
    steps: Sequence[Any], values: Sequence[float], where: str, first: float = 0.0
) -> Points:
    """Steps and ramps as points over the time; before the first step there is `first`."""
    time, value = [0.0], [first]
    for number, (one, new) in enumerate(zip(steps, values, strict=True), start=1):
        if one.time < time[-1]:
            raise SceneError(
                f"{where}, number {number}: time = {one.time:g} s: must not lie before the end of "
                f"the one before, {time[-1]:g} s"
            )
        if one.time == 0.0 and one.ramp == 0.0 and len(time) == 1:
            value[0] = new
            continue
        time += [one.time, one.time + one.ramp]
        value += [value[-1], new]
    return Points(np.array(time), np.array(value))


def _of_file(file: str, folder: Path, where: str) -> tuple[str, Points]:
    path = referred(folder, file, where)
    table = read_csv(path, f"{where} {file}", "a table of the load over the time (CSV)")
    here = [size for size, column in _SIZES.items() if column in table.header]
    if "time_s" not in table.header or len(here) != 1:
        raise SceneError(
            f"{table.name}: columns: must be time_s and one of {', '.join(_SIZES.values())}"
        )
    time, value = (np.array(table.numbers(one)) for one in ("time_s", _SIZES[here[0]]))
    falls = np.flatnonzero(np.diff(time) < 0.0)
    if falls.size:
        line = table.lines[int(falls[0]) + 1]
        raise SceneError(f"{table.name}: line {line}: time_s must not descend")
    if time[0] < 0.0:
        raise SceneError(
            f"{table.name}: line {table.lines[0]}: time_s = {time[0]:g}: must be 0 or more"
        )
    return here[0], Points(time, value)


def _limits(given: Limits | str | None) -> TransientLimits | None:
    if isinstance(given, Limits):
        fall, rise, band = (0.01 * value for value in (given.fall, given.rise, given.band))
        return TransientLimits(fall, rise, band, given.recovery)
    return None if given is None else ISO_8528_5_G2


def _words(values: GivenValues) -> tuple[str, ...]:
    part = FEATURE.of(values.engine)
    return ("no_transient" if part is None else f"load_by_{part.law}",)


def _check_asked(values: GivenValues, quantities: Sequence[str], name: str) -> None:
    """Check that what is asked for is given."""
    part = FEATURE.of(values.engine)
    lacks = [] if part is None else [
        (names, key) for names, key, given in (
            (("limits_kept",), "limits", part.limits is not None),
            (OF_CHANGES, "load_steps or load_file, with a change of the load", part.marks.size > 0),
            (("cycles_to_stop",), "fuel_cut, from which they are counted",
             bool(np.isfinite(values.given_or_own("transient_fuel_cut", math.inf).values).any())),
            (OF_RECORD, "record, the first and the last cycle", part.recorded_points > 0),
        ) if not given
    ]  # fmt: skip
    for names, key in lacks:
        for quantity in quantities:
            if quantity.removesuffix(ELASTICITY) in names:
                raise SceneError(
                    f"{name}: [output] quantities: '{quantity}' needs [transient] {key}"
                )


GIVEN = GivenFeature(
    FEATURE, "a table with cycles: the speed is followed in time", MODELS["transient"], _read,
    scenes_only=True, words=_words, check_asked=_check_asked,
    missing="a table [transient] with cycles, and [solver] method = 'transient'",
    line=lambda part: f"the speed is followed in time, for {part.cycles} cycles at most",
)  # fmt: skip

BESIDE: tuple[GivenFeature, ...] = tuple(
    GivenFeature(
        Feature(table, says), f"a table of numbers: {says}", MODELS[table],
        partial(_read_numbers, table), scenes_only=True,
    )
    for table, says in (
        ("governor", "the governor that gives the fuel command"),
        ("starter", "the motor that turns the engine until it runs"),
        ("clutch", "an inertia that is switched in"),
    )
)  # fmt: skip
"""Tables of numbers of what is beside the engine."""
