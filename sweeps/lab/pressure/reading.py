"""Recorded cylinder pressure from a laboratory's file, evaluated with the measures of an engine.

Whoever imports a recording often has no diagram yet: the engine file may name the very file that is
to be written, or none.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

from engine_dyn.engine import Engine
from engine_dyn.geometry.arrangement import FOUR_STROKE, TWO_STROKE
from sweeps.base.arguments import a_path
from sweeps.base.checks import check_structure, plain
from sweeps.base.columns.options import ImportOptions
from sweeps.base.columns.recording import read_recording
from sweeps.lab.pressure.imported_pressure import (
    EngineMeasures,
    ImportedPressure,
    known_ratio,
    measures_of,
)
from sweeps.lab.pressure.pressure import imported
from sweeps.scene.engine.engine_files import (
    PERIODS,
    compression_ratio_in,
    compression_ratio_of,
    count_cylinders,
    engine_file_of,
    engine_path,
    read_cylinders,
    read_values,
)
from sweeps.scene.engine.silenced_warnings import read_silenced
from sweeps.scene.engine.usual_engine import unusual_values


def read_pressure(path: str | Path, **options: Any) -> ImportedPressure:
    """Read recorded cylinder pressure from a laboratory's file.

    Parameters
    ----------
    path : str or Path
        A file of a format that docs/laboratory_files.md lists.
    **options
        The keys of `engine-dyn import` and of [indicator], with underscores: `angle_column`,
        `pressure_column`, `unit`, `shift` [degree], `average`, `pegging`, `smoothing`,
        `angle_step` [degree] and others, see docs/laboratory_files.md; `engine`, a name of the
        catalogue or the path of an engine file (with or without diagrams), or an `Engine`;
        `two_stroke`.

    Returns
    -------
    ImportedPressure
        Cycles of each cylinder [rad, Pa], the diagram, what was done, and what the checks say.

    Raises
    ------
    SceneError
        In one line that names file, place and what would be accepted.

    Examples
    --------
    >>> import numpy as np
    >>> import sweeps
    >>> computed = sweeps.run(engine="ntua", output={"quantities": ["pressure"]})
    >>> table = np.column_stack([computed.crank_angle, computed.pressure * 100])
    >>> np.savetxt("run12.csv", table, delimiter=";", header="angle [deg];p [kPa]", comments="")
    >>> recorded = sweeps.read_pressure("run12.csv", engine="ntua")
    >>> recorded.write("pressure.csv")
    >>> with open("pressure.csv") as file:
    ...     "crank_angle_deg,pressure_bar" in file.read()
    True
    """
    path = a_path(path, "path")
    given = dict(options)
    engine = given.pop("engine", None)
    known = measures_of(engine) if isinstance(engine, Engine) else None
    if engine is not None and known is None:
        given["engine"] = str(engine)
    chosen = check_structure(ImportOptions, plain(given, str(path)), str(path))
    if chosen.engine is not None:
        known = read_engine_measures(chosen.engine)
    two_stroke = chosen.two_stroke or (known is not None and known.period == TWO_STROKE)
    period = TWO_STROKE if two_stroke else FOUR_STROKE
    made = imported(read_recording(path, str(path), chosen), path.name, chosen, period, known)
    if known is None:
        return made
    unusual = unusual_values(known.values, known.silenced, str(chosen.engine or "engine"))
    return replace(made, warnings=(*made.warnings, *unusual))


def read_engine_measures(name_or_path: str | Path, where: str = "engine") -> EngineMeasures:
    """Read the measures of an engine of the catalogue or of a file, which needs no diagrams.

    Diagrams are not read either, except for their compression ratio; where no diagram states one,
    that of `[data_sheet.cycle]` is taken. SceneError refuses an unknown name, a file that is no
    engine, and values outside their range.
    """
    path, name = engine_path(name_or_path, None, where)
    given, _ = engine_file_of(path, name)
    period = PERIODS[given.cycle or "four-stroke"]
    values = read_values(given.values, name)
    stated = [
        compression_ratio_of(table, f"{name}: [[diagram]] number {i}")
        for i, table in enumerate(given.diagram, start=1)
    ]
    ratio = known_ratio(compression_ratio_in(given, values, stated, name))
    count = count_cylinders(given, values, period, name)
    own = read_cylinders(given, count, period, name)[1] if count else None
    silenced = read_silenced(given.silenced_warnings, name)
    return EngineMeasures(period, {**ratio, **values}, own, silenced)
