"""Keys whose values are words, lists or tables in place of numbers: one object says all of each."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from sweeps.scene.engine.cylinder_keys import CylinderKeys


@dataclass(frozen=True)
class WordKey:
    """A key of [axes] whose values are no numbers; most may stand in [set] or [designs] too."""

    name: str  # Name of the key, also in `sweeps.base.dimensions.WORD_AXES`
    says: str  # Meaning of the key, and allowed values
    axis_says: str  # Allowed values in [axes]
    schema: Mapping[str, Any]  # JSON schema of one value
    # Reads the key from its value in [axes], the keys of cylinders in [set] and the name of the
    # scene in messages, to the values along the axis; raises `SceneError`. None where another
    # reader takes the axis out of a scene before.
    read: Callable[[Any, CylinderKeys, str], tuple[Any, ...]] | None = None
    # Function from a value along the axis to its text in archives
    name_of: Callable[[Any], str] = str
