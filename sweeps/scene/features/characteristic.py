"""[characteristic] of a scene: the torque over speed that the load follows."""

from __future__ import annotations

import math
from pathlib import Path

from pydantic import Field

from engine_dyn.engine import Engine
from engine_dyn.quantities.features.characteristic import CHARACTERISTICS, FEATURE
from engine_dyn.quantities.features.characteristic import Characteristic as Curve
from sweeps.base.checks import Strict
from sweeps.base.errors import SceneError, not_known, shown
from sweeps.scene.features.feature import GivenFeature, with_part
from sweeps.scene.values import GivenValues


class Characteristic(Strict):
    """Torque over speed that the load follows."""

    kind: str | None = Field(default=None, description=f"one of {', '.join(CHARACTERISTICS)}")
    coefficients: list[float] | None = Field(
        default=None, description="a list of two numbers, A and C in N_e = N_max x [A + C x - "
                                  "x^2], x = n/n_max", min_length=2,
        max_length=2,
    )  # fmt: skip


def _read(engine: Engine, table: Characteristic, folder: Path, where: str) -> Engine:
    where = f"{where}[characteristic]"
    if (table.kind is None) == (table.coefficients is None):
        raise SceneError(f"{where}: must have either kind or coefficients")
    if table.coefficients is not None:
        constant, linear = table.coefficients
        if not (math.isfinite(constant) and math.isfinite(linear)):
            raise SceneError(f"{where} coefficients = {table.coefficients}: must be finite numbers")
        curve = Curve(constant, linear, -1.0, "coefficients of the scene")
        return with_part(engine, FEATURE.name, curve)
    kind = str(table.kind)
    if kind not in CHARACTERISTICS:
        raise SceneError(f"{where} kind = {shown(kind)}: unknown{not_known(kind, CHARACTERISTICS)}")
    return with_part(engine, FEATURE.name, CHARACTERISTICS[kind])


def _words(values: GivenValues) -> tuple[str, ...]:
    return ("given_load" if FEATURE.of(values.engine) is None else "characteristic",)


GIVEN = GivenFeature(
    FEATURE, "a table with kind = 'diesel', or coefficients = [A, C]", Characteristic, _read,
    scenes_only=True, words=_words, replaces="the load of the engine",
    missing="a table [characteristic] with a kind, such as 'diesel'",
    line=lambda curve: f"the load follows a curve over speed: {curve.source}",
)  # fmt: skip
