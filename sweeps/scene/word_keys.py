"""Keys whose values are words, lists or tables in place of numbers: one object says all of each."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from sweeps.scene.engine.cylinder_keys import CylinderKeys


@dataclass(frozen=True)
class WordKey:
    """A key of [axes] whose values are no numbers; most may stand in [set] or [designs] too."""

    name: str  # Name of the key, which `sweeps.base.dimensions.WORD_AXES` has too
    says: str  # Meaning, and what is allowed
    axis_says: str  # Values that are allowed in [axes]
    schema: Mapping[str, Any]  # JSON schema of one value
    # From the value in [axes], the keys of cylinders in [set] and the scene as messages call it, to
    # the values along the axis; raises `SceneError`. None where another reader takes the axis out
    # of a scene before.
    read: Callable[[Any, CylinderKeys, str], tuple[Any, ...]] | None = None
    name_of: Callable[[Any], str] = str  # From a value along the axis to its text in archives
