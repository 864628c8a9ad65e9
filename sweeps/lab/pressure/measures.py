"""Measures of an engine that a recorded pressure is evaluated with; no diagrams are needed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from engine_dyn.engine import Engine
from engine_dyn.geometry.cylinders import Cylinders

__all__ = ["EngineMeasures", "known_ratio", "measures_of"]


@dataclass(frozen=True)
class EngineMeasures:
    """What a recorded pressure takes from an engine."""

    period: float  # Angle of one cycle [rad]
    # Values of parameters in their file units, and `compression_ratio` [1] where it is known.
    values: Mapping[str, float]
    # Own cylinders: where the cylinders fire, if the engine says it.
    own_cylinders: Cylinders | None


def measures_of(engine: Engine) -> EngineMeasures:
    """Measures of an engine; the compression ratio is that of its diagrams, if all have the same.

    Examples
    --------
    >>> from sweeps.scene.engine.engine_files import load_engine
    >>> measures_of(load_engine("boxer_twin_101x70")).values["compression_ratio"]
    10.3
    """
    values = {**known_ratio(engine.compression_ratio), **engine.values}
    return EngineMeasures(engine.period, values, engine.own_cylinders)


def known_ratio(ratio: float | None) -> dict[str, float]:
    """Compression ratio as one of the values, where it is known."""
    return {} if ratio is None else {"compression_ratio": ratio}
