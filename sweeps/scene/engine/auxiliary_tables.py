"""Tables [[auxiliaries]] of engine files and scenes: torque of auxiliaries over their own angle."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, Literal

from pydantic import Field

from engine_dyn.engine import Engine
from engine_dyn.loads.auxiliaries import Auxiliary, over_crank
from engine_dyn.units import DEGREE
from sweeps.base.checks import check_structure, mentioned
from sweeps.base.errors import SceneError
from sweeps.scene.engine.torque_diagrams import TorqueDiagram, read_torque_diagram, torque_warnings

__all__ = ["AUXILIARIES", "MOST", "AuxiliaryTable", "with_auxiliaries"]

AUXILIARIES = "tables [[auxiliaries]] with ratio, and mean and harmonics, file or areas"

MOST = 20
"""Auxiliaries of an engine."""


class AuxiliaryTable(TorqueDiagram):
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


def with_auxiliaries(
    engine: Engine, given: Sequence[Mapping[str, Any]] | None, folder: Path, where: str
) -> Engine:
    """Return the engine with these auxiliaries, where some are given; they replace its own.

    Raises
    ------
    SceneError
        In one line, for what is no torque, or does not repeat with the cycle.
    """
    if given is None:
        return engine
    found = []
    for number, table in enumerate(given, start=1):
        here = f"{where}[[auxiliaries]] number {number}"
        own = check_structure(AuxiliaryTable, dict(table), here)
        rest = {key: value for key, value in table.items() if key not in ("ratio", "phase")}
        torque = read_torque_diagram({**rest, "kind": own.kind}, here, folder)
        found.append(Auxiliary(torque, own.ratio, own.phase * DEGREE))
    try:
        return replace(
            engine,
            auxiliaries=over_crank(found, engine.period),
            auxiliary_warnings=torque_warnings(given, f"{where}[[auxiliaries]]"),
        )
    except ValueError as error:
        raise SceneError(f"{where}[[auxiliaries]] {mentioned(error)}") from None
