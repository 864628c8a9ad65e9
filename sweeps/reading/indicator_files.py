"""Measured indicator diagrams from CSV files: pressure over crank angle."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from engine_dyn.geometry.arrangement import FOUR_STROKE
from engine_dyn.pressure.diagram import Diagram, diagram_from_points
from engine_dyn.units import BAR, DEGREE
from sweeps.checks import mentioned
from sweeps.errors import SceneError
from sweeps.reading.csv_tables import read_csv, with_line

__all__ = ["read_indicator"]

ANGLE_COLUMN, PRESSURE_COLUMN = "crank_angle_deg", "pressure_bar"


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
    table = read_csv(
        Path(path), label, "an indicator diagram (CSV)", (ANGLE_COLUMN, PRESSURE_COLUMN)
    )
    angle = np.array(table.numbers(ANGLE_COLUMN)) * DEGREE
    pressure = np.array(table.numbers(PRESSURE_COLUMN)) * BAR
    try:
        return diagram_from_points(angle, pressure, period)
    except ValueError as error:
        raise SceneError(with_line(mentioned(error), table)) from None
