"""Tables [[mounts]]: mounts of the engine block."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from pydantic import Field

from engine_dyn.engine import Engine
from engine_dyn.quantities.features.mounts import FEATURE, Mounts, of
from sweeps.base.checks import Strict, mentioned
from sweeps.base.errors import SceneError
from sweeps.scene.features.feature import GivenFeature, with_part
from sweeps.scene.values import GivenValues


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


def _read(engine: Engine, given: Sequence[MountTable], folder: Path, where: str) -> Engine:
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
        mounts = Mounts(
            np.array([one.lateral for one in given]),
            None if None in positions else np.array(positions, dtype=float),
            np.array([one.stiffness for one in given]), heights.pop(),
        )  # fmt: skip
    except ValueError as error:
        raise SceneError(f"{where}[mounts]: {mentioned(error)}") from None
    return with_part(engine, FEATURE.name, mounts)


def _words(values: GivenValues) -> tuple[str, ...]:
    mounts = of(values.engine)
    pitch = mounts is not None and mounts.position is not None
    return ("mounts_with_pitch" if pitch else "mounts_without_pitch",)


MOUNTS = "tables [[mounts]] with lateral, one for each"

GIVEN = GivenFeature(
    FEATURE, MOUNTS, list[MountTable], _read, missing=MOUNTS, most=100, words=_words,
    line=lambda mounts: f"{len(mounts.lateral)} mounts",
)  # fmt: skip
