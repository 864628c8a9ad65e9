"""Whether the engine has diagrams for the loads, speeds, cycles and misfires of a scene."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from engine_dyn.pressure.family_grid import FamilyGrid
from engine_dyn.pressure.motored import motored
from engine_dyn.quantities.each_cylinder import OF_CYLINDER
from engine_dyn.units import RPM
from sweeps.base.checks import mentioned
from sweeps.base.dimensions import FIRING_PATTERN
from sweeps.base.errors import SceneError
from sweeps.scene.model import Scene

MOST_DIAGRAMS = 1024
"""Largest number of speeds times loads of one scene, where given diagrams change with the speed:
the table of each takes about a tenth of a megabyte. Modelled cycles of the scene are made block by
block."""


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


def burning_less(scene: Scene) -> str:
    """Place of what lets cylinders burn more or less than their diagram; empty without any."""
    patterns = scene.firing_patterns
    if patterns is not None and any(set(one.firings) != {1.0} for one in patterns.each):
        return f"[{scene.table_of(FIRING_PATTERN)}] {FIRING_PATTERN}"
    silent = scene.given.get("misfire")
    if silent is not None and silent.values.any():
        return f"[{silent.table}] misfire"
    keys = [key for key in scene.cylinder_keys if OF_CYLINDER[key].what == "pressure_factor"]
    replaced = {OF_CYLINDER[key].number for key in keys}
    burns = all((scene.given[key].values == 1.0).all() for key in keys) and all(
        factor == 1.0 or number in replaced
        for engine in (scene.all_cylinders if keys else scene.described)
        for number, factor in enumerate(engine.pressure_factors, 1)
    )
    key = keys[0] if keys else "pressure_factor"
    return "" if burns else f"[{scene.table_of(key)}] {key}"


def check_motored(scene: Scene, name: str) -> None:
    """Check that a pressure without combustion is known where a cylinder needs one."""
    # A governor can cut the fuel of a speed that is followed in time
    place = burning_less(scene) or ("no_transient" not in scene.words and "[transient]")
    if not place:
        return
    diagrams = scene.engine.diagrams
    if scene.indicator is not None:
        diagrams = (scene.indicator,)
    for diagram in diagrams:
        try:
            motored(diagram)
        except ValueError as error:
            raise SceneError(f"{name}: {place}: {mentioned(error)}") from None


class Range(NamedTuple):
    """Lowest and highest value of a key, and what a value outside must be instead."""

    key: str
    low: float
    high: float
    must: str


def ranges_of(scene: Scene) -> Iterator[Range]:
    """Ranges that the diagrams of the engine set."""
    engine, family = scene.engine, scene.engine.family
    cycles = len(scene.recorded_cycles)
    if cycles:
        must = f"from 1 to {cycles}, as many as [indicator] has"
        yield Range("recorded_cycle", 1.0, cycles, must)
    if scene.indicator is not None or not family.diagrams:
        return
    has = f"where engine {engine.name} has diagrams"
    must = f"from {family.low:g} to {family.high:g} percent, {has}"
    if family.low == family.high:
        must = f"the one load of engine {engine.name}, {family.low:g} percent"
    yield Range("load", family.low, family.high, must)
    if engine.pressure_scale is not None:
        low, high = engine.pressure_scale[0][0], engine.pressure_scale[0][-1]
        must = f"from {low:g} to {high:g} rpm, where the diagram of engine {engine.name} is known"
        yield Range("speed", low, high, must)
    if isinstance(family, FamilyGrid):
        low, high = family.speeds[0] / RPM, family.speeds[-1] / RPM
        allowed = f"from {low:g} to {high:g}" if low < high else f"the one speed {low:g}"
        must = f"{allowed} rpm, {has}"
        yield Range("speed", low * (1.0 - 1e-12), high * (1.0 + 1e-12), must)


def check_ranges(scene: Scene, name: str) -> None:
    """Check that the engine's diagrams cover all loads, speeds and cycles of the scene.

    Raises
    ------
    SceneError
        With the first value outside.
    """
    if scene.gives("recorded_cycle") and not scene.recorded_cycles:
        raise SceneError(
            f"{name}: [{scene.table_of('recorded_cycle')}] recorded_cycle: needs [indicator] with "
            "a file of several cycles"
        )
    for key, low, high, must in ranges_of(scene):
        if key in scene.given:
            table, values, _ = scene.given[key]
            bad = (values < low) | (values > high)
            if bad.any():
                raise SceneError(f"{name}: [{table}] {key} = {values[bad][0]:g}: must be {must}")
