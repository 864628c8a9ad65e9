"""[uncertainty] of scenes and engine files: what values that are not well known may be."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from engine_dyn.engine import Engine
from sweeps.base.errors import SceneError
from sweeps.scene.crossings import exclusive_pair
from sweeps.scene.sample import Sample, read_sample
from sweeps.scene.values import GivenValues

__all__ = ["NUMBER", "check_engine_ranges", "read_uncertainty"]

NUMBER = 256
"""Draws unless a scene says otherwise: ends of a 95 % band are then known to some 5 % of its
width."""

_OWN = ("number", "seed")


def read_uncertainty(
    raw: Mapping[str, Any] | None, values: GivenValues, name: str
) -> Sample | None:
    """Read [uncertainty]: the engine's ranges, and those that the scene gives instead or besides.

    What the scene gives in [set], [axes] or [designs] is taken as known, and so is what that
    replaces, unless its [uncertainty] says otherwise of a value of [set].

    Raises
    ------
    SceneError
        For what is no distribution, for keys that vary along an axis, and where nothing is
        uncertain.
    """
    if raw is None:
        return None
    engine, where = values.engine, f"{name}: [uncertainty]"
    if "method" in raw:
        raise SceneError(f"{where} method: unknown key; draws are a Sobol' sequence")
    own = {key: item for key, item in raw.items() if key not in _OWN}
    for key in own:
        if key in values.axes or key in values.designs:
            place = "axes" if key in values.axes else "designs"
            raise SceneError(f"{where} {key}: varies in [{place}]; give it in one place")
    known = {k: item for k, item in engine.uncertainty.items() if not _given_instead(k, values)}
    if not {**known, **own}:
        raise SceneError(
            f"{where}: no uncertain values: the engine file of {engine.name} gives no ranges for "
            "values left open by the scene; give some here, such as "
            "friction_constant = { low = 0.1, high = 0.2 }"
        )
    check_engine_ranges(engine)
    table = {"number": NUMBER, **known, **raw}
    return read_sample(table, where)


def _given_instead(key: str, values: GivenValues) -> bool:
    """Whether the scene gives a value of the engine, or what replaces it: parts of the inertia."""
    own = (*values.settings, *values.axes, *values.designs)
    return values.gives(key) or any(exclusive_pair((key, other)) is not None for other in own)


def check_engine_ranges(engine: Engine) -> None:
    """Check the ranges of an engine file.

    Raises
    ------
    SceneError
        As `read_sample`; for keys that the engine gives no value of.
    """
    if not engine.uncertainty:
        return
    where = f"engine {engine.name}: [uncertainty]"
    for key in _OWN:
        if key in engine.uncertainty:
            raise SceneError(f"{where} {key}: must be in the scene")
    read_sample({"number": 2, **engine.uncertainty}, where)
