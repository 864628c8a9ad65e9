"""A structured part of an engine as scenes and engine files give it: one object says all of it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from engine_dyn.engine import Engine
from engine_dyn.quantities.features.feature import Feature
from sweeps.base.checks import Strict
from sweeps.scene.values import GivenValues

__all__ = ["GivenFeature", "with_part"]


@dataclass(frozen=True)
class GivenFeature:
    """A table, or tables, of scenes and engine files, and everything that follows from them.

    Attributes
    ----------
    feature : Feature
        Its physics; the table or tables have its name.
    says : str
        What is allowed, for messages and schemas.
    kind : type
        Type of the tables for pydantic.
    read : callable
        From the engine so far, the tables, the folder that their paths start from and what
        messages begin with, to the engine with the part; raises `SceneError`.
    table : class, optional
        Keys of one table for schemas, where `kind` does not say them; a single one may then also be
        named by a text.
    scenes_only : bool
        Engine files do not have it.
    missing : str
        What is said where quantities need the part and the engine has none; empty where they do
        without it.
    most : int, optional
        Largest number of tables [[name]]; None for a single table.
    excludes : tuple of str
        Parameters that [values] of the same engine file may not have; joined by "or", they are the
        name of their row in `sweeps.scene.crossings`.
    dropped : callable
        Whether the scene's own parameters replace the part of its engine.
    words : callable
        From what a scene gives to the words of the feature that it has: one of each group.
    line : callable, optional
        From the part to what a list of an engine says of it in one line.
    """

    feature: Feature[Any]
    says: str
    kind: Any
    read: Callable[[Engine, Any, Path, str], Engine]
    table: type[Strict] | None = None
    scenes_only: bool = False
    missing: str = ""
    most: int | None = None
    excludes: tuple[str, ...] = ()
    dropped: Callable[[GivenValues], bool] = lambda values: False
    words: Callable[[GivenValues], tuple[str, ...]] = lambda values: ()
    line: Callable[[Any], str] | None = None

    @property
    def name(self) -> str:
        """Name of the table or tables."""
        return self.feature.name

    @property
    def written(self) -> str:
        """The table as messages name it: [name], or [[name]] where there may be several."""
        return f"[{self.name}]" if self.most is None else f"[[{self.name}]]"


def with_part(engine: Engine, name: str, part: Any) -> Engine:
    """Return the engine with a part, which replaces its own; with None, without it."""
    parts = {key: own for key, own in engine.parts.items() if key != name}
    return replace(engine, parts=parts if part is None else {**parts, name: part})
