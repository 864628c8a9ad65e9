"""All checks of a whole scene, in the order in which a person wants to hear of them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from sweeps.base.errors import SceneError
from sweeps.scene.consistency.cylinders import check_misfire, extreme_cylinders
from sweeps.scene.consistency.features import check_crossings
from sweeps.scene.consistency.loads import (
    check_driven,
    check_friction_fractions,
    check_friction_law,
)
from sweeps.scene.consistency.outputs import check_needs, check_start
from sweeps.scene.consistency.pressure import check_diagram_count, check_motored, check_ranges
from sweeps.scene.consistency.rod import check_offset, check_ring, check_rod, check_throw_radii
from sweeps.scene.consistency.shaft import check_shaft
from sweeps.scene.crossings import exclusive_pair
from sweeps.scene.model import Scene
from sweeps.scene.values import GivenValues


def check_scene(scene: Scene, name: str) -> None:
    """Check what depends on the engine, or on several parameters.

    Raises
    ------
    SceneError
        For the first thing that does not fit.
    """
    check_ranges(scene, name)
    check_crossings(scene, name)
    check_diagram_count(scene, name)
    check_rod(scene, name)
    check_ring(scene, name)
    extreme_cylinders(scene, name)  # refuses values that no cylinder can have
    check_offset(scene, name)
    check_throw_radii(scene, name)
    check_misfire(scene, name)
    check_friction_law(scene, name)
    check_friction_fractions(scene, name)
    check_motored(scene, name)
    check_driven(scene, name)
    check_shaft(scene, name)
    check_needs(scene, name)
    check_start(scene, name)


def check_places(values: GivenValues, start: Mapping[str, float], name: str) -> None:
    """Check that each key is in one place, and that the rod, the inertia and so on are given once.

    `start` has what [solver] gives of the parameters.

    Raises
    ------
    SceneError
        With both places.
    """
    tables: dict[str, Mapping[str, Any]] = {
        "set": values.settings,
        "axes": values.axes,
        "designs": values.designs,
        "solver": start,
    }
    place: dict[str, str] = {}
    for table, keys in tables.items():
        for key in keys:
            if key in place:
                raise SceneError(
                    f"{name}: {key} is in both [{place[key]}] and [{table}]; give it in one place"
                )
            place[key] = table
    pair = exclusive_pair(place)
    if pair is not None:
        first, second, reason = pair
        raise SceneError(
            f"{name}: {first} (in [{place[first]}]) and {second} (in [{place[second]}]): {reason}"
        )
