"""How many modes of a shaft are computed: those asked for, or all that orders may excite."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from engine_dyn.torsion.shaft import Shaft
from engine_dyn.torsion.system import ShaftSystem
from engine_dyn.units import RPM
from sweeps.base.errors import SceneError
from sweeps.scene.known_values import Value
from sweeps.scene.model import Scene
from sweeps.scene.plan.leaves import mean_of


class ModesKept(NamedTuple):
    """Number of modes that are computed, that of the system, and why so many, as people read it."""

    kept: int
    of: int
    why: str

    def __str__(self) -> str:
        return f"{self.kept} of {self.of} modes of the system{self.why and ': '}{self.why}"


def modes_kept(scene: Scene, leaves: Mapping[str, Value]) -> ModesKept:
    """Modes of a scene with a shaft.

    Raises
    ------
    SceneError
        In one line: where more modes are asked for than there are, or none is as low.
    """
    shaft = scene.engine.shaft
    name = scene.path.name if scene.path else "scene"
    if shaft is None:
        for key in ("modes", "modes_below"):
            if getattr(scene, key) is not None:
                raise SceneError(f"{name}: [output] {key}: has no effect: the scene has no shaft")
        return ModesKept(0, 0, "")
    stiff, soft = (_systems(scene, shaft, leaves, ends) for ends in (_largest, _lowest))
    from engine_dyn.torsion.modes import free_parts

    free = min(int(free_parts(system, 1.0)) for system in stiff)
    total = stiff[0].parent.size - free
    if scene.modes is not None:
        if scene.modes > total:
            raise SceneError(
                f"{name}: [output] modes = {scene.modes}: the shaft has {total}; must be at most "
                "as many"
            )
        return ModesKept(scene.modes, total, "as asked for")
    if scene.modes_below is not None:
        count = _below(soft, math.tau * min(scene.modes_below, 1e100)) - free
        if count < 1:
            raise SceneError(
                f"{name}: [output] modes_below = {scene.modes_below:g}: no mode is below it [Hz]"
            )
        return ModesKept(count, total, f"those below {scene.modes_below:g} Hz")
    if "speed" not in scene.known:
        return ModesKept(total, total, "")
    speed = float(np.max(scene.known["speed"].si))
    # Frequencies over the range of orders that still count as within it: below its resonance a mode
    # responds too, and masses that vary are looked at by their mean
    count = _below(soft, 1.25 * scene.highest_order * speed) - free
    # Modes that are computed where nothing is asked for, even above the range of orders
    at_least = 6
    if count >= total or total <= at_least:
        return ModesKept(total, total, "")
    why = f"all that orders up to {scene.highest_order:g} can excite at {speed / RPM:.5g} rpm"
    if count < at_least:
        why += f", and {at_least} at least"
    return ModesKept(max(count, at_least), total, f"{why}; [output] modes gives others")


def _below(systems: list[ShaftSystem], omega: float) -> int:
    """Largest number of modes below a frequency, those of free parts among them."""
    from engine_dyn.torsion.graded import modes_below

    counts = []
    for system in systems:
        stiffness = system.stiffness_at(0.0)
        numbers = system.inertia, stiffness, system.ground_stiffness, system.speed_stiffness
        scratch = np.empty(system.parent.size)
        counts.append(int(modes_below(system.parent, numbers, math.inf, omega**2, scratch)))
    return max(counts)


def _largest(what: str, values: Any) -> Any:
    return np.max(values)


def _lowest(what: str, values: Any) -> Any:
    """Give the end of values that lowers frequencies, or the mean where neither end does."""
    # Of the first the least values lower all frequencies, of the second the largest.
    softening = (
        "shaft_stiffness", "damper_stiffness", "disc_ground_stiffness", "shaft_diameter",
        "shaft_shear_modulus",
    )  # fmt: skip
    heavy = ("disc_inertia", "damper_inertia", "pendulum_mass", "shaft_length", "shaft_bore")
    if what in softening:
        return np.min(values)
    return np.max(values) if what in heavy else np.mean(values)


def _systems(
    scene: Scene, shaft: Shaft, leaves: Mapping[str, Value], end: Any
) -> list[ShaftSystem]:  # fmt: skip
    """Systems with these ends of all that varies, for the least and the largest gear ratios."""
    values = {key: end(key.rpartition("_")[0], scene.known[key].si) for key in scene.shaft_keys}
    try:
        masses = mean_of(scene, leaves, "mean_reciprocating_inertia")
    except KeyError:  # the engine has no masses, and no quantity that needs them
        masses = 0.0
    added = np.full(len(shaft.throws), masses / len(shaft.throws))
    tables = np.full(len(shaft.shafts), np.nan)
    for place, table in shaft.tables.items():
        tables[place] = end("shaft_stiffness", table.stiffness)
    excess = 0.0
    if "wanted_delta" in scene.words:
        # A flywheel that a wanted delta asks for: one still larger lowers no mode.
        excess = 1e3 * shaft.inertia(values, added)
    systems = []
    for pick in (np.min, np.max):
        gears = {key: pick(scene.known[key].si) for key in values if "gear_ratio" in key}
        systems.append(shaft.system({**values, **gears}, added, excess, 0.0, tables))
    return systems
