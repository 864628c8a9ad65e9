"""CSV files with the torque of a load or a driver, and the keys that name them.

`load_table` gives a torque over an angle or a speed, either of the crank or of the load itself,
over an angle also in closed form; `driver_table` gives one over the crank speed. Both are keys of
engine files and of [set].
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
from pydantic import Field

from engine_dyn.loads.driven_machine import (
    TorqueOverAngle,
    TorqueOverSpeed,
    torque_over_angle,
    torque_over_speed,
)
from engine_dyn.units import DEGREE, RPM
from sweeps.base.checks import Strict, check_structure, mentioned
from sweeps.base.errors import SceneError, one_line, shown
from sweeps.base.files.csv_tables import CsvTable, read_csv, with_line
from sweeps.base.files.regular_files import referred
from sweeps.scene.features.torque_diagrams import Harmonic, harmonics_of

TORQUE_COLUMN, SPEED_COLUMN, OWN_SPEED_COLUMN = "torque_Nm", "speed_rpm", "load_speed_rpm"
OWN_COLUMN = "load_angle_deg"

TORQUE_TABLE_KEYS: Mapping[str, str] = {
    "load_table": "a string: the path of a CSV file with the load's torque_Nm over "
    "crank_angle_deg, load_angle_deg, speed_rpm (of the crank) or load_speed_rpm; or a table with "
    "mean and harmonics",
    "driver_table": "a string: the path of a CSV file with the driver's torque_Nm over speed_rpm",
}
"""Keys that name tables of torque, with what is allowed."""


@dataclass(frozen=True, eq=False)
class TorqueTables:
    """Torque of load and driver of one engine file or scene; None where not given."""

    load: TorqueOverAngle | TorqueOverSpeed | None = None
    driver: TorqueOverSpeed | None = None


def read_torque_tables(raw: Mapping[str, Any], base: Path, where: str) -> TorqueTables:
    """Read the files that the keys name, relative to `base`; None for keys that are missing.

    Raises
    ------
    SceneError
        In one line, with the line of the file where one is wrong.
    """
    tables: dict[str, Any] = {}
    for key, allowed in TORQUE_TABLE_KEYS.items():
        item = raw.get(key)
        if item is None:
            continue
        if isinstance(item, Mapping) and key == "load_table":
            tables["load"] = _in_closed_form(item, f"{where}{key}")
            continue
        if not isinstance(item, str) or not item:
            raise SceneError(f"{where}{key} = {shown(item)}: must be {allowed}")
        path = referred(base, item, f"{where}{key}")
        table = read_csv(path, f"{where}{key} {item}", "a table of torque (CSV)")
        try:
            tables[key.removesuffix("_table")] = _curve(table, driver=key == "driver_table")
        except SceneError:  # an error of the table itself names file and line already
            raise
        except ValueError as error:
            raise SceneError(with_line(mentioned(error), table)) from None
    return TorqueTables(**tables)


class LoadInClosedForm(Strict):
    """Load torque over an angle, in closed form."""

    mean: float = Field(description="a number in N m: the mean torque")
    harmonics: list[Harmonic] = Field(
        description="a list of tables with order, sine and cosine", max_length=200
    )
    angle: Literal["crank", "load"] = Field(
        default="crank", description="'crank' or 'load': whose angle it is"
    )


def _in_closed_form(item: Mapping[str, Any], where: str) -> TorqueOverAngle:
    """Load torque over an angle, in closed form."""
    given = check_structure(LoadInClosedForm, dict(item), where)
    try:
        return harmonics_of(given.harmonics, given.mean, own_angle=given.angle == "load")
    except ValueError as error:
        raise SceneError(f"{where}: {mentioned(error)}") from None


def _curve(table: CsvTable, driver: bool) -> TorqueOverAngle | TorqueOverSpeed:
    columns: tuple[str, ...] = (SPEED_COLUMN,)
    if not driver:
        columns = ("crank_angle_deg", OWN_COLUMN, SPEED_COLUMN, OWN_SPEED_COLUMN)
    here = [column for column in columns if column in table.header]
    if len(here) != 1 or TORQUE_COLUMN not in table.header:
        ours = here or TORQUE_COLUMN in table.header  # else another file may have been named
        names = f" {one_line(', '.join(table.header), 200)}" if ours else ""
        raise SceneError(
            f"{table.name}: columns{names}: must be {TORQUE_COLUMN} and one of {', '.join(columns)}"
        )
    column = here[0]
    places, torque = np.array(table.numbers(column)), np.array(table.numbers(TORQUE_COLUMN))
    if column in (SPEED_COLUMN, OWN_SPEED_COLUMN):
        return torque_over_speed(places * RPM, torque, driver, own_speed=column != SPEED_COLUMN)
    return torque_over_angle(places * DEGREE, torque, own_angle=column == OWN_COLUMN)
