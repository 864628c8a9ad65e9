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


@dataclass(frozen=True)
class GivenFeature:
    """A table, or tables, of scenes and engine files, and everything that follows from them."""

    feature: Feature[Any]  # Feature: its physics; the table or tables have its name
    says: str  # Says: what is allowed, for messages and schemas
    kind: Any  # Type of the tables for pydantic
    # From the engine so far, the tables, the folder that their paths start from and what messages
    # begin with, to the engine with the part; raises `SceneError`.
    read: Callable[[Engine, Any, Path, str], Engine]
    # Keys of one table for schemas, where `kind` does not say them; a single one may then also be
    # named by a text.
    table: type[Strict] | None = None
    # Whether it is a key and no table: one of [set] in scenes, and one beside the tables of engine
    # files.
    key: bool = False
    scenes_only: bool = False  # Engine files do not have it
    # Missing: what is said where quantities need the part and the engine has none; empty where they
    # do without it.
    missing: str = ""
    most: int | None = None  # Largest number of tables [[name]]; None for a single table
    # Parameters that [values] of the same engine file may not have; joined by "or", they are the
    # name of their row in `sweeps.scene.crossings`.
    excludes: tuple[str, ...] = ()
    # Whether the scene's own parameters replace the part of its engine.
    dropped: Callable[[GivenValues], bool] = lambda values: False
    # From what a scene gives to the words of the feature that it has: one of each group.
    words: Callable[[GivenValues], tuple[str, ...]] = lambda values: ()
    # From the part to what a list of an engine says of it in one line.
    line: Callable[[Any], str] | None = None

    @property
    def name(self) -> str:
        """Name of the table or tables."""
        return self.feature.name

    @property
    def written(self) -> str:
        """The table as messages name it: [name], or [[name]] where there may be several."""
        if self.key:
            return self.name
        return f"[{self.name}]" if self.most is None else f"[[{self.name}]]"


def with_part(engine: Engine, name: str, part: Any) -> Engine:
    """Return the engine with a part, which replaces its own; with None, without it."""
    parts = {key: own for key, own in engine.parts.items() if key != name}
    return replace(engine, parts=parts if part is None else {**parts, name: part})
