"""Measured indicator diagrams from CSV files, and the speeds for which a diagram holds.

A diagram that was recorded, or fitted, at one speed is that of other speeds in part alone: valve
timing, combustion and throttling change. The key `speeds` says from which to which speed it holds;
outside, `plan` and `run` warn.
"""

from __future__ import annotations

import re
from collections.abc import MutableMapping
from pathlib import Path
from typing import Any

import numpy as np

from engine_dyn.geometry.arrangement import FOUR_STROKE
from engine_dyn.pressure.diagram import Diagram, diagram_from_points
from engine_dyn.quantities.graph import PARAMETERS
from engine_dyn.units import BAR, DEGREE
from sweeps.base.checks import check_range, mentioned, number
from sweeps.base.errors import SceneError, shown
from sweeps.base.files.csv_tables import CsvTable, csv_of_text, read_csv, with_line
from sweeps.base.files.regular_files import file_bytes
from sweeps.base.ratios import BEYOND, LARGEST

HEAD = 1 << 16  # Bytes that are searched for notes and for the names of columns

HEADER = "# Cylinder pressure over crank angle: "
"""Beginning of the first line of a diagram that was made from a recording."""

NOT_PEGGED = "not pegged"
"""Words in the notes on a pressure at its recorded level, which was not made absolute."""

WARNING = "warning: "  # Beginning of a note with a warning from the checks of the recording

NAMES = ("crank_angle_deg", "pressure_bar")
WHAT = "an indicator diagram (CSV)"


def read_indicator(path: Path, name: str | None = None, period: float = FOUR_STROKE) -> Diagram:
    """Read a measured indicator diagram from a CSV file.

    Columns `crank_angle_deg` (firing top dead centre = 0, ascending within the cycle) and
    `pressure_bar` (absolute); other columns are ignored. Both ends of the cycle are the same
    angle: one may be missing, both are averaged.

    Parameters
    ----------
    path : Path
        The file.
    name : str, optional
        Name of the file in messages; its path if not given.
    period : float
        4 pi (four-stroke) or 2 pi [rad].

    Raises
    ------
    SceneError
        With the line, where one is wrong.
    """
    label = str(path) if name is None else name
    return _diagram(read_csv(Path(path), label, WHAT, NAMES), period)


def indicator_of_text(text: str, name: str, period: float = FOUR_STROKE) -> Diagram:
    """Return the diagram of a text, as `read_indicator` does of a file."""
    return _diagram(csv_of_text(text, name, WHAT, NAMES), period)


def cycles_of_text(text: str, name: str, period: float = FOUR_STROKE) -> tuple[Diagram, ...]:
    """Return diagrams of all recorded cycles: columns `cycle_1_bar`, `cycle_2_bar` and so on."""
    table = csv_of_text(text, name, WHAT, NAMES)
    cycle = re.compile(r"cycle_[1-9][0-9]*_bar")
    columns = [column for column in table.header if cycle.fullmatch(column)]
    return tuple(_diagram(table, period, column) for column in columns)


def notes_of(path: Path) -> tuple[str, ...]:
    """Notes of an imported diagram that was read from a file."""
    return notes_in(file_bytes(path)[:HEAD].decode("utf-8", "replace"))


def notes_in(text: str) -> tuple[str, ...]:
    """Comment lines above an imported diagram; nothing of other files."""
    lines = text[:HEAD].removeprefix("\ufeff").splitlines()
    if not lines or not lines[0].startswith(HEADER):
        return ()
    notes = []
    for line in lines[:200]:
        if not line.startswith("#"):
            break
        notes.append(line.lstrip("# ").rstrip())
    return tuple(notes)


def _diagram(table: CsvTable, period: float, column: str = NAMES[1]) -> Diagram:
    angle = np.array(table.numbers(NAMES[0])) * DEGREE
    pressure = np.array(table.numbers(column))
    if not np.abs(pressure).max(initial=0.0) <= LARGEST:
        raise SceneError(f"{table.name}: {column}: {BEYOND}")
    pressure *= BAR
    try:
        return diagram_from_points(angle, pressure, period)
    except ValueError as error:
        raise SceneError(with_line(mentioned(error), table)) from None


SPEEDS = "speeds"

MEANING = "lowest and highest speed [rpm] for which the diagram holds; outside, plan and run warn"


def read_speeds(rest: MutableMapping[str, Any], where: str) -> tuple[float, float] | None:
    """Take the lowest and the highest speed [rpm] out of a [[diagram]]; None where it has none.

    They exclude `speed`, which makes a grid over speed.
    """
    given = rest.pop(SPEEDS, None)
    if given is None:
        return None
    if not isinstance(given, list) or len(given) != 2:
        raise SceneError(
            f"{where} {SPEEDS} = {shown(given)}: must be a list of two numbers in rpm: the lowest "
            "and the highest speed for which the diagram holds"
        )
    if "speed" in rest:
        raise SceneError(
            f"{where}: has both speed, for a grid over speed, and {SPEEDS}: give one of them"
        )
    node = PARAMETERS["speed"]
    low, high = (
        number(value, f"{where} {SPEEDS} number {i}", node)
        for i, value in enumerate(given, start=1)
    )
    for i, value in enumerate((low, high), start=1):
        check_range(value, f"{where} {SPEEDS} number {i}", node)
    if low > high:
        raise SceneError(f"{where} {SPEEDS} = [{low:g}, {high:g}]: must ascend")
    return low, high
