"""Tables of structured parts, each a file with its keys, its reader and its `GIVEN`.

A new one is a file here and a name in `GIVEN_FEATURES`; its physics stands in
`engine_dyn.quantities.features`. Scenes, engine files, schemas, messages and texts follow.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import Any

from pydantic import Field, create_model

from engine_dyn.engine import Engine
from sweeps.base.checks import Strict
from sweeps.scene.features import (
    auxiliaries,
    characteristic,
    hold,
    idler_gears,
    indicator,
    measured,
    mounts,
    shaft,
    torque_tables,
    transient,
    web_weights,
)
from sweeps.scene.features.feature import GivenFeature, with_part
from sweeps.scene.values import GivenValues

__all__ = [
    "BY_CONSTANT", "GIVEN_FEATURES", "KEYS_OF_SET", "check_asked", "file_with_features",
    "feature_words", "parts_of_scene", "with_features", "without_dropped",
]  # fmt: skip

GIVEN_FEATURES: Mapping[str, GivenFeature] = MappingProxyType(
    {
        feature.name: feature
        for feature in (
            torque_tables.LOAD_TABLE,
            torque_tables.DRIVER_TABLE,
            shaft.GIVEN,
            web_weights.GIVEN,
            mounts.GIVEN,
            auxiliaries.GIVEN,
            indicator.GIVEN,
            characteristic.GIVEN,
            measured.GIVEN,
            idler_gears.GIVEN,
            hold.GIVEN,
            transient.GIVEN,
            *transient.BESIDE,
        )
    }
)
"""Features by name, in the order in which they are read."""

KEYS_OF_SET: Mapping[str, GivenFeature] = MappingProxyType(
    {name: one for name, one in GIVEN_FEATURES.items() if one.key}
)
"""Features that are keys of [set] in scenes, not tables."""

BY_CONSTANT: Mapping[str, GivenFeature] = MappingProxyType(
    {one.feature.constant: one for one in GIVEN_FEATURES.values() if one.feature.constant}
)
"""Features by the node that holds their part, where quantities need the part as a whole."""


def file_with_features(own: type[Strict], *, scenes: bool) -> Any:
    """Return the model of a file: its own keys and docstring, and then the tables of features.

    `scenes` says whether the file is a scene, which has tables that engine files have not.
    """
    keys: Any = {
        one.name: (
            one.kind | None,
            Field(
                default=None, description=one.says, min_length=None if one.most is None else 1,
                max_length=one.most,
            ),
        )
        for one in GIVEN_FEATURES.values()
        if not (one.key if scenes else one.scenes_only)
    }  # fmt: skip
    return create_model(own.__name__, __base__=own, __doc__=own.__doc__, **keys)


def with_features(engine: Engine, given: Strict, folder: Path, where: str) -> Engine:
    """Return the engine with the parts that tables of `given` make, a scene or an engine file.

    Paths in the tables start from `folder`; messages begin with `where`.
    """
    for name, feature in GIVEN_FEATURES.items():
        if feature.read is None:
            continue
        settings = getattr(given, "set", None) if feature.key else None  # Only scenes have [set]
        tables = getattr(given, name, None) if settings is None else settings.get(name)
        if tables is not None:
            place = where if settings is None else f"{where}[set] "
            engine = feature.read(engine, tables, folder, place)
    return engine


def parts_of_scene(
    given: Strict, values: GivenValues, folder: Path, where: str
) -> dict[str, Any]:  # fmt: skip
    """Return the parts that tables of a scene give and that belong to no engine.

    `values` is what else the scene gives; the others and the errors are those of `with_features`.
    """
    return {
        name: feature.read_of_scene(values, table, folder, where)
        for name, feature in GIVEN_FEATURES.items()
        if feature.read_of_scene and (table := getattr(given, name, None)) is not None
    }


def check_asked(values: GivenValues, quantities: Sequence[str], name: str) -> None:
    """Check that the quantities that the scene `name` asks for go with its features."""
    for feature in GIVEN_FEATURES.values():
        if feature.check_asked is not None:
            feature.check_asked(values, quantities, name)


def without_dropped(values: GivenValues) -> Engine:
    """Return the engine without the parts that parameters of the scene replace."""
    engine = values.engine
    for name, feature in GIVEN_FEATURES.items():
        if feature.dropped is not None and feature.dropped(values):
            engine = with_part(engine, name, None)
    return engine


def feature_words(values: GivenValues) -> tuple[str, ...]:
    """Return the words of all features that a scene has."""
    return tuple(word for one in GIVEN_FEATURES.values() for word in one.words(values))
