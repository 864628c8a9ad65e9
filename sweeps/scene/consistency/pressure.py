"""Whether the engine has indicator diagrams for the loads, speeds and cycles of a scene."""

from __future__ import annotations

import math

import numpy as np

from engine_dyn.pressure.family_grid import FamilyGrid
from engine_dyn.pressure.motored import motored
from engine_dyn.quantities.single_cylinders import OF_CYLINDER
from engine_dyn.units import RPM
from sweeps.checks import mentioned
from sweeps.errors import SceneError
from sweeps.scene.consistency.cylinders import extreme_cylinders
from sweeps.scene.model import Scene

__all__ = [
    "MOST_DIAGRAMS",
    "check_cycles",
    "check_diagram_count",
    "check_load",
    "check_motored",
    "check_recorded_cycles",
    "check_speed",
]

MOST_DIAGRAMS = 1024
"""Speeds times loads of one scene, where given diagrams change with the speed: each is tabulated,
which takes about a tenth of a megabyte. Modelled cycles of the scene are made block by block."""


def check_load(scene: Scene, name: str) -> None:
    """Check that the engine's diagrams cover all loads."""
    family = scene.engine.family
    given = scene.given.get("load")
    if given is None or scene.indicator is not None:
        return
    table, loads, _ = given
    bad = (loads < family.low) | (loads > family.high)
    if bad.any():
        if family.low == family.high:
            covered = f"the one load of engine {scene.engine.name}, {family.low:g} percent"
        else:
            covered = (
                f"from {family.low:g} to {family.high:g} percent, where engine "
                f"{scene.engine.name} has diagrams"
            )
        raise SceneError(f"{name}: [{table}] load = {loads[bad][0]:g}: must be {covered}")


def check_recorded_cycles(scene: Scene, name: str) -> None:
    """Check that the numbers of recorded cycles are those of cycles that were read."""
    given = scene.given.get("recorded_cycle")
    if given is None:
        return
    table, numbers, _ = given
    count = len(scene.recorded_cycles)
    if not count:
        raise SceneError(
            f"{name}: [{table}] recorded_cycle: needs [indicator] with a file of several cycles"
        )
    if numbers.max() > count:
        raise SceneError(
            f"{name}: [{table}] recorded_cycle = {numbers.max():g}: must be from 1 to {count}, as "
            "many as [indicator] has"
        )


def check_speed(scene: Scene, name: str) -> None:
    """Check that the engine's pressure scale, or its diagrams over speed, cover all speeds."""
    family, scale = scene.engine.family, scene.engine.pressure_scale
    given = scene.given.get("speed")
    if given is None or scene.indicator is not None:
        return
    table, speeds, _ = given
    if scale is not None:
        low, high = float(scale[0][0]), float(scale[0][-1])
        bad = (speeds < low) | (speeds > high)
        if bad.any():
            raise SceneError(
                f"{name}: [{table}] speed = {speeds[bad][0]:g}: must be from {low:g} to {high:g} "
                f"rpm, where the diagram of engine {scene.engine.name} is known"
            )
    if isinstance(family, FamilyGrid):
        low, high = family.speeds[0] / RPM, family.speeds[-1] / RPM
        bad = (speeds < low * (1.0 - 1e-12)) | (speeds > high * (1.0 + 1e-12))
        if bad.any():
            allowed = f"from {low:g} to {high:g}" if low < high else f"the one speed {low:g}"
            raise SceneError(
                f"{name}: [{table}] speed = {speeds[bad][0]:g}: must be {allowed} rpm, where "
                f"engine {scene.engine.name} has diagrams"
            )


def check_cycles(scene: Scene, name: str) -> None:
    """Check that the engine has modelled cycles where the scene changes them."""
    if not scene.cycle_keys:
        return
    key = scene.cycle_keys[0]
    where = f"{name}: [{scene.table_of(key)}] {key}"
    if scene.indicator is not None:
        raise SceneError(f"{where}: not allowed together with [indicator], which is measured")
    if scene.engine.cycles is None:
        raise SceneError(
            f"{where}: not allowed: engine {scene.engine.name} has diagrams that are not modelled "
            "by the first law; all [[diagram]] must be 'first_law' or 'two_stroke'"
        )


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


def check_motored(scene: Scene, name: str) -> None:
    """Check that a pressure without combustion is known where a cylinder needs one."""
    engines = extreme_cylinders(scene, name)
    factors = {factor for engine in engines for factor in engine.pressure_factors}
    silent = scene.given.get("misfire")
    if factors <= {1.0} and (silent is None or not silent.values.any()):
        return
    of_one = [k for k in scene.cylinder_keys if OF_CYLINDER[k].what == "pressure_factor"]
    key = "misfire" if silent is not None else of_one[0] if of_one else "pressure_factor"
    measured = scene.indicator
    for diagram in scene.engine.family.diagrams if measured is None else (measured,):
        try:
            motored(diagram)
        except ValueError as error:
            raise SceneError(f"{name}: [{scene.table_of(key)}] {key}: {mentioned(error)}") from None
