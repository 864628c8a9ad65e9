"""Ranges of keys of a scene that the diagrams of its engine set, as data."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

from engine_dyn.pressure.family_grid import FamilyGrid
from engine_dyn.units import RPM
from sweeps.base.errors import SceneError
from sweeps.scene.model import Scene

__all__ = ["check_ranges", "ranges_of"]


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
