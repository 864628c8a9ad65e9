"""Keys `load_table` and `driver_table` of engine files and of [set]: CSV files with a torque.

`load_table` gives that of the load over an angle or a speed, either of the crank or of the load
itself, over an angle also in closed form; `driver_table` gives that of a driver over the crank
speed.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Literal

import numpy as np
from pydantic import Field

from engine_dyn.engine import Engine
from engine_dyn.loads.driven_machine import DrivenMachine
from engine_dyn.loads.laws import LOAD_LAWS, MOTOR_KEYS
from engine_dyn.loads.torque_curves import (
    TorqueOverAngle,
    TorqueOverSpeed,
    torque_over_angle,
    torque_over_speed,
)
from engine_dyn.quantities.features import auxiliaries
from engine_dyn.quantities.features.torque_tables import DRIVER, LOAD
from engine_dyn.units import DEGREE, RPM
from sweeps.base.checks import Strict, check_structure, mentioned
from sweeps.base.errors import SceneError, one_line, shown
from sweeps.base.files.csv_tables import CsvTable, read_csv, with_line
from sweeps.base.files.regular_files import referred
from sweeps.scene.features.feature import GivenFeature, with_part
from sweeps.scene.features.torque_diagrams import Harmonic, harmonics_of
from sweeps.scene.values import GivenValues

TORQUE_COLUMN, SPEED_COLUMN, OWN_SPEED_COLUMN = "torque_Nm", "speed_rpm", "load_speed_rpm"
OWN_COLUMN = "load_angle_deg"


class LoadInClosedForm(Strict):
    """Load torque over an angle, in closed form."""

    mean: float = Field(description="a number in N m: the mean torque")
    harmonics: list[Harmonic] = Field(
        description="a list of tables with order, sine and cosine", max_length=200
    )
    angle: Literal["crank", "load"] = Field(
        default="crank", description="'crank' or 'load': whose angle it is"
    )


def _curve(table: CsvTable, driver: bool) -> TorqueOverAngle | TorqueOverSpeed:
    columns: tuple[str, ...] = (SPEED_COLUMN,)
    if not driver:
        columns = ("crank_angle_deg", OWN_COLUMN, SPEED_COLUMN, OWN_SPEED_COLUMN)
    here = [column for column in columns if column in table.header]
    if len(here) != 1 or TORQUE_COLUMN not in table.header:
        # Without a column of ours, another file may have been named, whose content must not be
        # shown.
        ours = here or TORQUE_COLUMN in table.header
        names = f" {one_line(', '.join(table.header), 200)}" if ours else ""
        raise SceneError(
            f"{table.name}: columns{names}: must be {TORQUE_COLUMN} and one of {', '.join(columns)}"
        )
    column = here[0]
    places, torque = np.array(table.numbers(column)), np.array(table.numbers(TORQUE_COLUMN))
    if column in (SPEED_COLUMN, OWN_SPEED_COLUMN):
        return torque_over_speed(places * RPM, torque, driver, own_speed=column != SPEED_COLUMN)
    return torque_over_angle(places * DEGREE, torque, own_angle=column == OWN_COLUMN)


def _of_file(item: Any, folder: Path, where: str, *, driver: bool) -> Any:
    """Torque from a CSV file that a key names."""
    if not isinstance(item, str) or not item:
        allowed = DRIVER_TABLE.says if driver else LOAD_TABLE.says
        raise SceneError(f"{where} = {shown(item)}: must be {allowed}")
    path = referred(folder, item, where)
    table = read_csv(path, f"{where} {item}", "a table of torque (CSV)")
    try:
        return _curve(table, driver)
    except SceneError:  # An error of the table itself names file and line already
        raise
    except ValueError as error:
        raise SceneError(with_line(mentioned(error), table)) from None


def read_load(item: Any, folder: Path, where: str) -> TorqueOverAngle | TorqueOverSpeed:
    """Read a load's torque from the file that `item` names, relative to `folder`, or its table."""
    if not isinstance(item, Mapping):
        torque: TorqueOverAngle | TorqueOverSpeed = _of_file(item, folder, where, driver=False)
        return torque
    given = check_structure(LoadInClosedForm, dict(item), where)
    try:
        return harmonics_of(given.harmonics, given.mean, own_angle=given.angle == "load")
    except ValueError as error:
        raise SceneError(f"{where}: {mentioned(error)}") from None


def read_driver(item: Any, folder: Path, where: str) -> TorqueOverSpeed:
    """Read a driver's torque from the file that the key names, as `read_load` does a load's."""
    torque: TorqueOverSpeed = _of_file(item, folder, where, driver=True)
    return torque


def _with_load(engine: Engine, given: Any, folder: Path, where: str) -> Engine:
    return with_part(engine, LOAD.name, read_load(given, folder, f"{where}{LOAD.name}"))


def _with_driver(engine: Engine, given: Any, folder: Path, where: str) -> Engine:
    return with_part(engine, DRIVER.name, read_driver(given, folder, f"{where}{DRIVER.name}"))


def driven_machine(values: GivenValues) -> DrivenMachine:
    """Load tables, driver tables, motor and auxiliaries of a scene, or else of its engine."""
    engine = values.engine
    load, driver = LOAD.of(engine), DRIVER.of(engine)
    given = auxiliaries.of(engine)
    return DrivenMachine(
        over_angle=load if isinstance(load, TorqueOverAngle) else None,
        load_over_speed=load if isinstance(load, TorqueOverSpeed) else None,
        driver_over_speed=driver,
        motor=driver is None and (values.gives(*MOTOR_KEYS) or values.engine_gives(*MOTOR_KEYS)),
        load_law=_load_law(values),
        engine_torque=engine.torque,
        throw_torques=engine.throw_torques,
        auxiliaries=None if given is None else given.torque,
    )


def _load_law(values: GivenValues) -> str:
    """Name of the load's law over speed, chosen by keys of the scene, otherwise by the engine."""
    for gives in (values.gives, values.engine_gives):
        for law in LOAD_LAWS.values():
            if gives(*law.keys):
                return law.name
    return next(iter(LOAD_LAWS))


def _words_of_load(values: GivenValues) -> tuple[str, ...]:
    over_angle = isinstance(LOAD.of(values.engine), TorqueOverAngle)
    return ("angle_load" if over_angle else "steady_load",)


def _words_of_driver(values: GivenValues) -> tuple[str, ...]:
    return ("with_driver" if driven_machine(values).has_driver else "no_driver",)


LOAD_TABLE = GivenFeature(
    LOAD,
    "a string: the path of a CSV file with the load's torque_Nm over crank_angle_deg, "
    "load_angle_deg, speed_rpm (of the crank) or load_speed_rpm; or a table with mean and "
    "harmonics",
    Any, _with_load, key=True, table=LoadInClosedForm, words=_words_of_load,
    line=lambda torque: f"load_table: {torque}",
)  # fmt: skip

DRIVER_TABLE = GivenFeature(
    DRIVER,
    "a string: the path of a CSV file with the driver's torque_Nm over speed_rpm",
    Any, _with_driver, key=True, words=_words_of_driver,
    replaces="the driver_table and the motor of the engine",
    dropped=lambda values: values.gives(*MOTOR_KEYS),
    line=lambda torque: f"driver_table: {torque}",
)  # fmt: skip
