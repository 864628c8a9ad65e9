"""A structured part of an engine as scenes and engine files give it: one object says all of it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, TypeVar

from engine_dyn.engine import Engine
from engine_dyn.quantities.features.feature import Feature
from sweeps.base.checks import Strict
from sweeps.scene.values import GivenValues

Owner = TypeVar("Owner", bound=Engine | GivenValues)


@dataclass(frozen=True)
class GivenFeature:
    """A table, or tables, of scenes and engine files, and everything that follows from them."""

    feature: Feature[Any]  # Feature: its physics; the table or tables have its name
    says: str  # Says: what is allowed, for messages and schemas
    kind: Any  # Type of the tables for pydantic
    # From the engine so far, the tables, the folder that their paths start from and what messages
    # begin with, to the engine with the part; raises `SceneError`.
    read: Callable[[Engine, Any, Path, str], Engine] | None = None
    # In place of `read`, for a part that belongs to the scene and to no engine: from what the scene
    # gives, the table, the folder and what messages begin with, to the part.
    read_of_scene: Callable[[GivenValues, Any, Path, str], Any] | None = None
    # Refuses what a scene asks for beside the part: from what the scene gives, its quantities and
    # its name; raises `SceneError`.
    check_asked: Callable[[GivenValues, Sequence[str], str], None] | None = None
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
    # What of the engine counts nowhere where a scene has the table; by default the same table.
    replaces: str = ""
    # Whether the part of an engine fits its own crankshaft alone: a scene with another one must not
    # ask for what needs the part.
    own_crank: bool = False
    # Whether the scene's own parameters replace the part of its engine.
    dropped: Callable[[GivenValues], bool] = lambda values: False
    # From what a scene gives to the words of the feature that it has: one of each group.
    words: Callable[[GivenValues], tuple[str, ...]] = lambda values: ()
    # From the part to what a list of its engine, or of its scene, says of it in one line.
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

    def part_of(self, scene: GivenValues) -> Any:
        """Return the part of a scene or of its engine; None where there is none."""
        return self.feature.of(scene.engine if self.read_of_scene is None else scene)

    def given_in(self, source: Mapping[str, Any]) -> bool:
        """Whether the tables of a scene, as it was read, give the part."""
        tables = source.get("set") or {} if self.key else source
        return tables.get(self.name) is not None


def with_part(owner: Owner, name: str, part: Any) -> Owner:
    """Return the engine or scene with a part, which replaces its own; with None, without it."""
    parts = {key: own for key, own in owner.parts.items() if key != name}
    return replace(owner, parts=parts if part is None else {**parts, name: part})
