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

    feature: Feature[Any]  # Physics of the feature, whose name the table or tables have
    says: str  # Allowed values, for messages and schemas
    kind: Any  # Type of the tables for pydantic
    # Reads the part: arguments are the engine so far, the tables, the folder of relative paths and
    # the beginning of messages; returns the engine with the part; raises `SceneError`.
    read: Callable[[Engine, Any, Path, str], Engine] | None = None
    # Reads a part that belongs to the scene and to no engine: arguments are the values of the
    # scene, the table, the folder and the beginning of messages; returns the part.
    read_of_scene: Callable[[GivenValues, Any, Path, str], Any] | None = None
    # Refuses requests of a scene that conflict with the part: arguments are the values of the
    # scene, its quantities and its name; raises `SceneError`.
    check_asked: Callable[[GivenValues, Sequence[str], str], None] | None = None
    # Keys of one table for schemas, where `kind` does not give them. In place of a table with these
    # keys, a text may name one, such as a shaft of the catalogue.
    table: type[Strict] | None = None
    # Whether the part is given by a key: one of [set] in scenes, and one at the top of engine
    # files.
    key: bool = False
    scenes_only: bool = False  # Whether engine files cannot have the part
    # Message where quantities need the part and the engine has none; empty where they do not need
    # it.
    missing: str = ""
    most: int | None = None  # Largest number of tables [[name]]; None for a single table
    # Parameters that [values] of the same engine file must not have; joined by "or", they name a
    # row in `sweeps.scene.crossings`.
    excludes: tuple[str, ...] = ()
    # Part of the engine that a table of the scene replaces; by default the part of the same name.
    replaces: str = ""
    # Whether the part of an engine fits only its own crankshaft: a scene with another crankshaft
    # must not ask for quantities that need the part.
    own_crank: bool = False
    # Whether the scene's own parameters replace the part of its engine.
    dropped: Callable[[GivenValues], bool] | None = None
    # Function from the values of a scene to the words of the feature, one of each group.
    words: Callable[[GivenValues], tuple[str, ...]] = lambda values: ()
    # Function from the part to one line of text, for lists of an engine or a scene.
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
