"""Whether loads and drivers fit the speeds and the cycle of a scene, and its friction one law."""

from __future__ import annotations

from typing import Any

import numpy as np

from engine_dyn.geometry.arrangement import FOUR_STROKE
from engine_dyn.loads.driven_machine import DrivenMachine, TorqueOverSpeed, repeats_of
from engine_dyn.loads.laws import LOAD_LAWS
from engine_dyn.quantities.friction import NODES
from engine_dyn.quantities.graph import UNLESS_GIVEN
from engine_dyn.quantities.parameters import STROKE_SHARES
from engine_dyn.units import RPM
from sweeps.base.checks import mentioned
from sweeps.base.errors import SceneError
from sweeps.scene.crossings import refused
from sweeps.scene.model import Scene
from sweeps.scene.values import GivenValues


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


OF_COMPONENTS = frozenset(node.name for node in NODES if node.public)
"""Quantities of the law by components."""


def check_friction_law(scene: Scene, name: str) -> None:
    """Check that there is one law of the friction, and that it is for the engine."""
    table = scene.table_of("friction_law")
    if table != "set":
        raise SceneError(
            f"{name}: [{table}] friction_law: must be one value, in [set] or the engine file; "
            "compare scenes with different laws by `engine-dyn compare`"
        )
    asked = next((q for q in scene.quantities if q in OF_COMPONENTS), None)
    if scene.engine.period != FOUR_STROKE and asked:
        where = f"{name}: [output] quantities: '{asked}'"
        two = "friction by components", "a two-stroke engine"
        raise refused(*two, where, engine=scene.engine.name)


def check_friction_fractions(values: GivenValues, name: str) -> None:
    """Check that no design has more friction over the stroke than it has friction."""
    total: Any = 0.0
    of_designs: Any = 0.0
    for key in STROKE_SHARES:
        table, fractions, _ = values.given_or_own(key, 0.0)
        if table == "designs":
            of_designs = of_designs + fractions
        else:
            total += fractions.max()
    total = float(np.max(total + of_designs))
    if total > 1.0 + 1e-12:
        raise SceneError(
            f"{name}: {' + '.join(STROKE_SHARES)} = {total:g} in one design: the sum must be at "
            "most 1"
        )
