"""Whether loads and drivers of a scene fit its speeds and the cycle."""

from __future__ import annotations

from typing import Any

import numpy as np

from engine_dyn.loads.driven_machine import DrivenMachine, TorqueOverSpeed, repeats_of
from engine_dyn.loads.laws import LOAD_LAWS
from engine_dyn.quantities.graph import UNLESS_GIVEN
from engine_dyn.units import RPM
from sweeps.base.checks import mentioned
from sweeps.base.errors import SceneError
from sweeps.scene.model import Scene

__all__ = ["check_driven"]


def check_driven(scene: Scene, name: str) -> None:
    """Check that loads repeat with the cycle and tables over speed cover all nominal speeds."""
    driven = scene.driven
    _check_load_law(driven, scene, name)
    if driven.over_speed is not None:
        what = "load_table" if driven.load_over_speed is not None else "driver_table"
        _check_speeds(driven.over_speed, what, scene, name)
    if driven.over_angle is not None:
        table, ratios, _ = scene.given_or_own("gear_ratio", UNLESS_GIVEN["gear_ratio"])
        try:
            repeats_of(driven.over_angle, ratios, scene.engine.period)
        except ValueError as error:
            where = f"[{table}] " if table else ""
            raise SceneError(f"{name}: {where}{mentioned(error)}") from None


def _check_load_law(driven: DrivenMachine, scene: Scene, name: str) -> None:
    """Check that a law that numbers give gives a torque."""
    law = LOAD_LAWS[driven.load_law]
    if not law.factored or driven.law != law.name:
        return
    columns: list[Any] = []
    zero = True
    for key in law.keys:
        table, values, _ = scene.given_or_own(key, 0.0)
        if table == "designs":
            columns.append(values)
        else:
            zero = zero and bool((values == 0.0).any())
    if columns:
        zero = zero and not np.any(columns, axis=0).all()
    if zero:
        raise SceneError(
            f"{name}: {' and '.join(law.keys)} = 0 in one design: one of them must be more than 0"
        )


def _check_speeds(curve: TorqueOverSpeed, what: str, scene: Scene, name: str) -> None:
    """Check that a table over speed covers all nominal speeds, at the load's own where it has."""
    table, speeds, _ = scene.given_or_own("speed")
    where = f"[{table}] speed" if table else f"speed of engine {scene.engine.name}"
    low, high = curve.low / RPM, curve.high / RPM
    gears = np.ones(1)
    if curve.own_speed:
        of_gear, gears, _ = scene.given_or_own("gear_ratio", UNLESS_GIVEN["gear_ratio"])
        if not of_gear == table == "designs":  # not column by column: all with all
            speeds, gears = np.broadcast_arrays(speeds[:, None], gears)
    there = gears * speeds
    bad = (there < low * (1.0 - 1e-9)) | (there > high * (1.0 + 1e-9))
    if bad.any():
        at_load = f" makes {there[bad][0]:g} of the load" if curve.own_speed else ""
        raise SceneError(
            f"{name}: {where} = {np.broadcast_to(speeds, bad.shape)[bad][0]:g}{at_load}: must "
            f"be from {low:g} to {high:g} rpm, which {what} covers"
        )
