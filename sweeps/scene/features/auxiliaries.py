"""Tables [[auxiliaries]] of engine files and scenes: torque of auxiliaries over their own angle."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Literal

from pydantic import Field

from engine_dyn.engine import Engine
from engine_dyn.quantities.features.auxiliaries import (
    FEATURE,
    Auxiliaries,
    Auxiliary,
    of,
    over_crank,
)
from engine_dyn.units import DEGREE
from sweeps.base.checks import check_structure, mentioned
from sweeps.base.errors import SceneError
from sweeps.scene.features.feature import GivenFeature, with_part
from sweeps.scene.features.torque_diagrams import (
    GivenTorque,
    read_torque_diagram,
    torque_warnings,
)
from sweeps.scene.values import GivenValues


class AuxiliaryTable(GivenTorque):
    """Torque of one auxiliary at its own shaft over its own angle, as of a torque diagram."""

    kind: Literal["torque"] = Field(default="torque", description="'torque'")
    ratio: float = Field(
        default=1.0, gt=0.0, le=100.0,
        description="a number above 0, at most 100: its speed over that of the crank",
    )  # fmt: skip
    phase: float = Field(
        default=0.0, ge=-720.0, le=720.0,
        description="a number in degree, -720 to 720: its own angle at firing top dead centre of "
        "cylinder 1",
    )  # fmt: skip


def _read(engine: Engine, given: Sequence[Mapping[str, Any]], folder: Path, where: str) -> Engine:
    each = []
    for number, table in enumerate(given, start=1):
        here = f"{where}[[auxiliaries]] number {number}"
        own = check_structure(AuxiliaryTable, dict(table), here)
        rest = {key: value for key, value in table.items() if key not in ("ratio", "phase")}
        torque = read_torque_diagram({**rest, "kind": own.kind}, here, folder)
        each.append(Auxiliary(torque, own.ratio, own.phase * DEGREE))
    try:
        torque = over_crank(each, engine.period)
    except ValueError as error:
        raise SceneError(f"{where}[[auxiliaries]] {mentioned(error)}") from None
    warnings = torque_warnings(given, f"{where}[[auxiliaries]]")
    return with_part(engine, FEATURE.name, Auxiliaries(torque, warnings))


def _words(values: GivenValues) -> tuple[str, ...]:
    over_angle = of(values.engine) is not None
    return (
        "auxiliaries" if over_angle or values.nonzero("auxiliary_torque") else "bare",
        "angle_auxiliaries" if over_angle else "steady_auxiliaries",
    )


GIVEN = GivenFeature(
    FEATURE, "tables [[auxiliaries]] with ratio, and mean and harmonics, file or areas",
    list[dict[str, Any]], _read, table=AuxiliaryTable, most=20, words=_words,
    line=lambda part: f"auxiliaries: {part.torque}",
)  # fmt: skip
