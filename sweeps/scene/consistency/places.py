"""Whether every key of a scene is in one table only, and none excludes another."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from sweeps.base.errors import SceneError
from sweeps.scene.crossings import exclusive_pair
from sweeps.scene.values import GivenValues

__all__ = ["check_places"]


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
