"""Cylinders of a scene: its arrangement and factors over those of the engine."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from engine_dyn.geometry.cylinders import Cylinders, even_cylinders
from sweeps.base.checks import mentioned
from sweeps.base.dimensions import ARRANGEMENT
from sweeps.base.errors import SceneError, shown
from sweeps.scene.crossings import refused
from sweeps.scene.engine.cylinder_keys import (
    CYLINDER_KEYS,
    ArrangementTable,
    CylinderKeys,
    arrangement_of,
    cylinders_of_keys,
    name_of,
    read_arrangement,
)
from sweeps.scene.values import GivenValues
from sweeps.scene.word_keys import WordKey


def own_cylinders(keys: CylinderKeys, values: GivenValues, where: str) -> Cylinders | None:
    """Cylinders of the scene's keys over the engine's; they say for which number of cylinders."""
    engine, counts = values.engine, values.counts
    own = engine.own_cylinders
    if not keys.given:
        return own
    count = counts[0]
    if len(counts) > 1:
        lengths = {len(v) for v in keys.given.values() if isinstance(v, tuple)}
        if keys.arrangement is not None:
            try:
                made = arrangement_of(keys.arrangement, engine.period)
            except ValueError as error:
                raise SceneError(f"{where}{mentioned(error)}") from None
            lengths = {len(made.cylinders)}
        count = min(lengths or {counts[0] if own is None else own.count})
        if count not in counts:
            listed = ", ".join(str(z) for z in counts)
            key = next(iter(keys.given))
            raise SceneError(
                f"{where}{key}: is for {count} cylinders, which the scene does not have; must be "
                f"for one of {listed}"
            )
    fits = own is not None and len(own.members) == count
    base = own if own is not None and fits else even_cylinders(count, engine.period)
    return cylinders_of_keys(keys, base, count, where)


def cylinders_along_axis(
    several: tuple[str | ArrangementTable, ...], keys: CylinderKeys, values: GivenValues, name: str
) -> tuple[Cylinders, ...]:
    """Cylinders along the axis `arrangement`, all of one number; none without it."""
    where = f"{name}: [axes] "
    if several and len(values.counts) > 1:
        two = "arrangement in [axes]", "several numbers of cylinders"
        raise refused(*two, f"{where}arrangement")
    made = (own_cylinders(replace(keys, arrangement=a), values, where) for a in several)
    return tuple(cylinders for cylinders in made if cylinders is not None)


def read_arrangement_axis(
    raw: Any, keys: CylinderKeys, name: str
) -> tuple[str | ArrangementTable, ...]:
    """Read [axes] arrangement, texts and tables; `keys` of [set] must not give it too."""
    where = f"{name}: [axes] arrangement"
    if not isinstance(raw, list) or not raw or not all(isinstance(i, str | dict) for i in raw):
        raise SceneError(
            f"{where} = {shown(raw)}: must be a list of strings such as 'V8 flat-plane', or of "
            "tables"
        )
    for key in ("arrangement", "firing_angles"):
        if key in keys.given:
            raise refused("arrangement in [axes]", f"{key} in [set]", where)
    several = tuple(
        read_arrangement(item, f"{where} number {i}") for i, item in enumerate(raw, start=1)
    )
    names = [name_of(one) for one in several]
    for i, text in enumerate(names):
        if text in names[:i]:
            other = "" if isinstance(several[i], str) else " or have different names"
            raise SceneError(
                f"{where}: duplicate {shown(text)}; arrangements must be unique{other}"
            )
    return several


KEY = WordKey(
    ARRANGEMENT, CYLINDER_KEYS[ARRANGEMENT], CYLINDER_KEYS[ARRANGEMENT],
    {"anyOf": [{"type": "string"}, {"$ref": "#/$defs/ArrangementTable"}]},
    read_arrangement_axis, name_of=name_of,
)  # fmt: skip
