"""Tables of engine files and scenes: counterweights on the webs, and mounts of the block."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from pydantic import Field

from engine_dyn.engine import Engine
from engine_dyn.forces.mounts import Mounts
from engine_dyn.forces.web_weights import WebWeights
from engine_dyn.units import DEGREE
from sweeps.base.checks import Strict, mentioned
from sweeps.base.errors import SceneError

__all__ = [
    "COUNTERWEIGHTS", "MOST", "MOUNTS", "WEIGHT_KEYS", "CounterweightTable",
    "MountTable", "with_block_tables",
]  # fmt: skip

MOST = 100
"""Counterweights, and mounts, of an engine."""

COUNTERWEIGHTS = "tables [[counterweights]] with mass, radius, angle and position, one for each"
MOUNTS = "tables [[mounts]] with lateral, one for each"

WEIGHT_KEYS = ("counterweight_fraction", "counterweight_mass")
"""Parameters that say what counterweights are without saying where."""


class CounterweightTable(Strict):
    """One counterweight on a web of the crankshaft."""

    mass: float = Field(description="a number in kg, 0 or more", ge=0.0, le=1e5)
    radius: float = Field(
        description="a number in m above 0: distance of its centre of gravity from the axis",
        gt=0.0, le=100.0,
    )  # fmt: skip
    angle: float = Field(
        description="a number in degree, -720 to 720: its direction, with zero and sense of the "
        "angles of throws", ge=-720.0, le=720.0,
    )  # fmt: skip
    position: float = Field(
        description="a number in m, -1000 to 1000: its place along the shaft, from that of throw 1 "
        "away from the free end", ge=-1e3, le=1e3,
    )  # fmt: skip


class MountTable(Strict):
    """One mount of the engine block."""

    lateral: float = Field(
        description="a number in m, -100 to 100: distance from the crankshaft's axis, positive on "
        "the side where an upright crank moves down", ge=-100.0, le=100.0,
    )  # fmt: skip
    position: float | None = Field(
        default=None, ge=-1e3, le=1e3,
        description="a number in m, -1000 to 1000: its place along the shaft, from that of throw 1 "
        "away from the free end",
    )  # fmt: skip
    height: float = Field(
        default=0.0, ge=-100.0, le=100.0,
        description="a number in m, -100 to 100: height above the crankshaft's axis, the same for "
        "all",
    )  # fmt: skip
    stiffness: float = Field(
        default=1.0, gt=0.0, le=1e12,
        description="a number above 0: vertical stiffness over that of the others",
    )  # fmt: skip


def with_block_tables(
    engine: Engine, counterweights: Sequence[CounterweightTable] | None,
    mounts: Sequence[MountTable] | None, where: str,
) -> Engine:  # fmt: skip
    """Return the engine with these counterweights and mounts, each where it is given.

    Counterweights replace what the engine says of them otherwise.

    Raises
    ------
    SceneError
        For mounts that do not hold the block.
    """
    if counterweights is not None:
        rows = [(one.mass, one.radius, one.angle * DEGREE, one.position) for one in counterweights]
        values = {key: value for key, value in engine.values.items() if key not in WEIGHT_KEYS}
        engine = replace(
            engine, values=values, counterweights=WebWeights(*np.array(rows, dtype=float).T)
        )
    if mounts is not None:
        engine = replace(engine, mounts=_mounts(mounts, where))
    return engine


def _mounts(given: Sequence[MountTable], where: str) -> Mounts:
    heights, positions = {one.height for one in given}, [one.position for one in given]
    if len(heights) > 1:
        raise SceneError(
            f"{where}[mounts] height: {min(heights):g} and {max(heights):g}: must be the same for "
            "all"
        )
    if None in positions and any(place is not None for place in positions):
        number = positions.index(None) + 1
        raise SceneError(
            f"{where}[mounts] number {number} position: missing; must be given for all mounts or "
            "none"
        )
    try:
        return Mounts(
            np.array([one.lateral for one in given]),
            None if None in positions else np.array(positions, dtype=float),
            np.array([one.stiffness for one in given]), heights.pop(),
        )  # fmt: skip
    except ValueError as error:
        raise SceneError(f"{where}[mounts]: {mentioned(error)}") from None
