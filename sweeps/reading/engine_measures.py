"""Measures of an engine that a recorded pressure is evaluated with; no diagrams are needed.

Whoever imports a recording often has no diagram yet: the engine file may name the very file that is
to be written, or none.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from engine_dyn.engine import Engine
from engine_dyn.geometry.cylinders import Cylinders
from sweeps.reading.engine_files import (
    PERIODS,
    RATIO,
    compression_ratio_in,
    compression_ratio_of,
    count_cylinders,
    engine_file_of,
    engine_path,
    read_cylinders,
    read_values,
)

__all__ = ["EngineMeasures", "measures_of", "read_engine_measures"]


@dataclass(frozen=True)
class EngineMeasures:
    """What a recorded pressure takes from an engine.

    Attributes
    ----------
    period : float
        Angle of one cycle [rad].
    values : mapping
        Values of parameters in their file units, and `compression_ratio` [1] where it is known.
    own_cylinders : Cylinders, optional
        Where the cylinders fire, if the engine says it.
    """

    period: float
    values: Mapping[str, float]
    own_cylinders: Cylinders | None


def measures_of(engine: Engine) -> EngineMeasures:
    """Measures of an engine; the compression ratio is that of its diagrams, if all have the same.

    Examples
    --------
    >>> from sweeps.reading.engine_files import load_engine
    >>> measures_of(load_engine("boxer_twin_101x70")).values["compression_ratio"]
    10.3
    """
    values = {**_known(engine.compression_ratio), **engine.values}
    return EngineMeasures(engine.period, values, engine.own_cylinders)


def read_engine_measures(name_or_path: str | Path, where: str = "engine") -> EngineMeasures:
    """Read the measures of an engine of the catalogue or of a file, which needs no diagrams.

    Diagrams are not read either, except for their compression ratio. Where no diagram states one,
    that of `[data_sheet.cycle]` is taken.

    Raises
    ------
    SceneError
        For an unknown name, a file that is no engine, and values outside their range.
    """
    path, name = engine_path(name_or_path, None, where)
    given, _ = engine_file_of(path, name)
    period = PERIODS[given.cycle or "four-stroke"]
    values = read_values(given.values, name)
    stated = [
        compression_ratio_of(table, f"{name}: [[diagram]] number {i}")
        for i, table in enumerate(given.diagram, start=1)
    ]
    ratio = _known(compression_ratio_in(given, values, stated, name))
    count = count_cylinders(given, values, period, name)
    own = read_cylinders(given, count, period, name)[1] if count else None
    return EngineMeasures(period, {**ratio, **values}, own)


def _known(ratio: float | None) -> dict[str, float]:
    return {} if ratio is None else {RATIO: ratio}
