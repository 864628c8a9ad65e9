"""Tables [[idler_gears]]: gears that the crankshaft drives."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from pydantic import Field

from engine_dyn.engine import Engine
from engine_dyn.quantities.features.idler_gears import FEATURE, IdlerGears, of
from sweeps.base.checks import Strict
from sweeps.base.errors import SceneError
from sweeps.scene.features.feature import GivenFeature, with_part
from sweeps.scene.values import GivenValues


class IdlerGearTable(Strict):
    """One gear that the crankshaft drives."""

    inertia: float = Field(
        description="a number in kg m2, 0 or more: its moment of inertia at its own shaft", ge=0.0,
        le=1e9,
    )  # fmt: skip
    ratio: float = Field(
        description="a number, not 0, -100 to 100: its speed over that of the crankshaft, below 0 "
        "where it turns the other way", ge=-100.0, le=100.0,
    )  # fmt: skip
    friction_torque: float = Field(
        default=0.0, ge=0.0, le=1e9,
        description="a number in N m, 0 or more: torque of its bearings and teeth at its own "
        "shaft, against its rotation",
    )  # fmt: skip


def _read(engine: Engine, given: Sequence[IdlerGearTable], folder: Path, where: str) -> Engine:
    for number, one in enumerate(given, start=1):
        if one.ratio == 0.0:
            raise SceneError(f"{where}[[idler_gears]] number {number} ratio = 0: must not be 0")
    rows = [(one.inertia, one.ratio, one.friction_torque) for one in given]
    return with_part(engine, FEATURE.name, IdlerGears(*np.array(rows, dtype=float).T))


def _words(values: GivenValues) -> tuple[str, ...]:
    return ("no_idler_gears" if of(values.engine) is None else "idler_gears",)


GIVEN = GivenFeature(
    FEATURE, "tables [[idler_gears]] with inertia and ratio, one for each", list[IdlerGearTable],
    _read, most=100, words=_words,
    line=lambda gears: f"{len(gears.ratio)} idler gears: {gears.inertia_at_crank:.6g} kg m2 and "
    f"{gears.torque_at_crank:.6g} N m at the crankshaft",
)  # fmt: skip
