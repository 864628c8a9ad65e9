"""Whether the engine has indicator diagrams for the loads, speeds and cycles of a scene."""

from __future__ import annotations

import math

import numpy as np

from engine_dyn.pressure.diagram import never_burns
from engine_dyn.pressure.motored import motored
from engine_dyn.quantities.parameters import STROKE_SHARES
from engine_dyn.quantities.single_cylinders import OF_CYLINDER
from sweeps.base.checks import mentioned
from sweeps.base.dimensions import FIRING_PATTERN
from sweeps.base.errors import SceneError
from sweeps.scene.consistency.cylinders import extreme_cylinders
from sweeps.scene.model import Scene

__all__ = [
    "MOST_DIAGRAMS",
    "check_diagram_count",
    "check_double_acting",
    "check_motored",
]

MOST_DIAGRAMS = 1024
"""Speeds times loads of one scene, where given diagrams change with the speed: each is tabulated,
which takes about a tenth of a megabyte. Modelled cycles of the scene are made block by block."""


def check_diagram_count(scene: Scene, name: str) -> None:
    """Check that given diagrams that change with the speed are not too many."""
    if scene.cycle_keys or "over_speed" not in scene.words:
        return
    varying = {"loads": ("load",), "speeds": ("speed",)}
    counts = {}
    for what, keys in varying.items():
        count = math.prod(len(scene.axes[key]) for key in keys if key in scene.axes)
        columns = [scene.designs[key] for key in keys if key in scene.designs]
        counts[what] = count * (np.unique(np.stack(columns), axis=1).shape[1] if columns else 1)
    total = math.prod(counts.values())
    if total > MOST_DIAGRAMS:
        listed = ", ".join(f"{count} {what}" for what, count in counts.items() if count > 1)
        named = ", ".join(key for keys in varying.values() for key in keys if scene.gives(key))
        raise SceneError(
            f"{name}: {named}: {total} diagrams ({listed}): must be at most {MOST_DIAGRAMS} if "
            "they change with the speed"
        )


def check_double_acting(scene: Scene, name: str) -> None:
    """Refuse what would take the effective pressure of double-acting cylinders for that of a gas.

    Pressure factors and misfires are refused by `check_motored`.
    """
    if "double_acting" not in scene.words:
        return
    why = f"engine {scene.engine.name} has double-acting cylinders"
    if scene.indicator is not None:
        raise SceneError(f"{name}: [indicator]: not allowed: {why}, and it is of one end")
    if "stroke_friction" in scene.words:
        raise SceneError(
            f"{name}: {', '.join(STROKE_SHARES)}: must be 0: {why}, whose rings no single pressure "
            "presses on the liner"
        )


def check_motored(scene: Scene, name: str) -> None:
    """Check that a pressure without combustion is known where a cylinder needs one.

    An engine whose torque is given has no pressure at all, and compressors no combustion.
    """
    of_torque = scene.engine.torque is not None
    why = f"not allowed: engine {scene.engine.name} gives its torque in place of a pressure"
    if of_torque and scene.indicator is not None:
        raise SceneError(f"{name}: [indicator]: {why}")
    engines = extreme_cylinders(scene, name)
    factors = {factor for engine in engines for factor in engine.pressure_factors}
    silent, patterns = scene.given.get("misfire"), scene.firing_patterns
    fires = patterns is None or all(set(one.firings) == {1.0} for one in patterns.each)
    if factors <= {1.0} and fires and (silent is None or not silent.values.any()):
        return
    of_one = [k for k in scene.cylinder_keys if OF_CYLINDER[k].what == "pressure_factor"]
    key = "misfire" if silent is not None else of_one[0] if of_one else "pressure_factor"
    key = key if fires else FIRING_PATTERN
    if of_torque:
        raise SceneError(f"{name}: [{scene.table_of(key)}] {key}: {why}")
    diagrams = scene.engine.family.diagrams
    if scene.indicator is not None:
        diagrams = (scene.indicator, *(one for one in diagrams if one.motored is never_burns))
    for diagram in diagrams:
        try:
            motored(diagram)
        except ValueError as error:
            raise SceneError(f"{name}: [{scene.table_of(key)}] {key}: {mentioned(error)}") from None
