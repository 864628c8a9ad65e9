"""Keys whose values are words, lists or tables in place of numbers: one object says all of each."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from sweeps.scene.engine.cylinder_keys import CylinderKeys

__all__ = ["WordKey"]


@dataclass(frozen=True)
class WordKey:
    """A key of [axes] whose values are no numbers; most may stand in [set] or [designs] too.

    Attributes
    ----------
    name : str
        Its name, which `sweeps.base.dimensions.WORD_AXES` has too.
    says : str
        What it means and what is allowed.
    axis_says : str
        What is allowed in [axes].
    schema : dict
        JSON schema of one value.
    read : callable, optional
        From the value in [axes], the keys of cylinders in [set] and the scene as messages call it,
        to the values along the axis; raises `SceneError`. None where another reader takes the axis
        out of a scene before.
    name_of : callable
        From a value along the axis to its text in archives.
    """

    name: str
    says: str
    axis_says: str
    schema: Mapping[str, Any]
    read: Callable[[Any, CylinderKeys, str], tuple[Any, ...]] | None = None
    name_of: Callable[[Any], str] = str
