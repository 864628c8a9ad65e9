"""Rules about single keys of a scene, as data: what excludes a key, where its values may lie."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import NamedTuple

from engine_dyn.loads.laws import LOAD_LAWS, MOTOR_KEYS
from engine_dyn.pressure.double_acting import OF_EFFECTIVE_PRESSURE
from engine_dyn.pressure.family_grid import FamilyGrid
from engine_dyn.quantities.parameters import CHEN_FLYNN_KEYS, CYCLE_KEYS, STROKE_SHARES
from engine_dyn.quantities.single_cylinders import OF_CYLINDER
from engine_dyn.units import RPM
from sweeps.base.errors import SceneError
from sweeps.scene.friction_law import BY_COMPONENT, friction_law
from sweeps.scene.model import Scene

__all__ = ["check_exclusions", "check_ranges"]


class Exclusion(NamedTuple):
    """Keys that a scene may not give where something holds, and what is said then."""

    keys: tuple[str, ...]
    holds: Callable[[Scene], bool]
    says: str


_EXCLUSIONS = (
    Exclusion(
        CYCLE_KEYS, lambda scene: scene.indicator is not None,
        "not allowed together with [indicator], which is measured",
    ),
    Exclusion(
        CYCLE_KEYS, lambda scene: not scene.engine.family.diagrams,
        "not allowed: engine {engine} has no diagrams",
    ),
    Exclusion(
        ("largest_speed", "smallest_speed"),
        lambda scene: scene.engine.torque is None or scene.driven.has_driver,
        "not allowed: only for a [[diagram]] of kind 'torque' without a driver; give speed, on "
        "which the torque of engine {engine} depends",
    ),
    Exclusion(
        CYCLE_KEYS, lambda scene: scene.engine.cycles is None,
        "not allowed: engine {engine} has diagrams that are not modelled by the first law; all "
        "[[diagram]] must be 'first_law' or 'two_stroke'",
    ),
    Exclusion(
        OF_EFFECTIVE_PRESSURE, lambda scene: "double_acting" in scene.words,
        "not allowed: the double-acting cylinders of engine {engine} are modelled with its own; "
        "change it in the engine file",
    ),
    Exclusion(
        tuple(OF_CYLINDER), lambda scene: len(scene.counts) > 1,
        "not allowed together with several numbers of cylinders; must be one number",
    ),
    Exclusion(
        (*CHEN_FLYNN_KEYS, *STROKE_SHARES), lambda scene: friction_law(scene) == BY_COMPONENT,
        f"not allowed together with friction_law = '{BY_COMPONENT}', which computes the friction "
        "of the components",
    ),
    Exclusion(
        MOTOR_KEYS, lambda scene: scene.torque_tables.driver is not None,
        "not allowed together with driver_table: give one driver",
    ),
    *(
        Exclusion(law.keys, holds, f"not allowed together with {what}: give one law over speed")
        for law in LOAD_LAWS.values() if law.factored
        for what, holds in (
            ("a driver", lambda scene: scene.driven.has_driver),
            ("a load_table over speed", lambda scene: scene.driven.load_over_speed is not None),
        )
    ),
)  # fmt: skip


def check_exclusions(scene: Scene, name: str) -> None:
    """Check that no key is given that something else in the scene excludes.

    Raises
    ------
    SceneError
        With the first such key and its table; `name` is the scene as messages call it.
    """
    for rule in _EXCLUSIONS:
        key = next((key for key in rule.keys if key in scene.given), None)
        if key is not None and rule.holds(scene):
            says = rule.says.format(engine=scene.engine.name)
            raise SceneError(f"{name}: [{scene.table_of(key)}] {key}: {says}")


class Range(NamedTuple):
    """Lowest and highest value of a key, and what a value outside must be instead."""

    key: str
    low: float
    high: float
    must: str


def _ranges(scene: Scene) -> Iterator[Range]:
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
    for key, low, high, must in _ranges(scene):
        if key in scene.given:
            table, values, _ = scene.given[key]
            bad = (values < low) | (values > high)
            if bad.any():
                raise SceneError(f"{name}: [{table}] {key} = {values[bad][0]:g}: must be {must}")
