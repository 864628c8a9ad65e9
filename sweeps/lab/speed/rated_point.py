"""The rated point: what options say of it, or else the data sheet."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from sweeps.base.checks import number
from sweeps.base.errors import SceneError, not_known, shown
from sweeps.base.files.numbers_with_units import number_with_unit
from sweeps.lab.speed.calibration_model import PUBLISHED, Published
from sweeps.lab.speed.usual_engines import KINDS
from sweeps.scene.engine.data_sheets import Sheet

__all__ = ["LEAST_LOAD", "LOADS", "published"]

LOADS = (10.0, 25.0, 50.0, 75.0, 100.0)
"""Loads that get a diagram unless others are asked for [percent]."""

LEAST_LOAD, MOST_LOAD, MOST_LOADS = 5.0, 120.0, 20

DEFAULT_KIND = "diesel"

_RANGES = {
    "power": (0.05, 2e5),
    "speed": (10.0, 30000.0),
    "peak": (5.0, 400.0),
    "fuel_consumption": (100.0, 2000.0),
}
"""Least and largest of the numbers that data sheets have, in the units of `PUBLISHED`."""


def published(
    sheet: Sheet, prefix: str, given: Mapping[str, float | str | None], kind: str | None,
    loads: list[float] | None,
) -> Published:  # fmt: skip
    """Put together what options say, or else [data_sheet].

    Parameters
    ----------
    sheet : Sheet
        The data sheet.
    prefix : str
        Of the names of `given` in messages: "--" for options.
    given : mapping
        Numbers, or texts with a unit, by the names that `calibrate` has.
    kind, loads
        As `calibrate`.

    Raises
    ------
    SceneError
        For missing numbers and numbers out of any engine's range.
    """
    inside = sheet.published
    found: dict[str, float | None] = {}
    places: dict[str, str] = {}
    for name, (key, unit) in PUBLISHED.items():
        raw: Any = given.get(name)
        option = prefix + name.replace("_", "-") if prefix else name
        places[name] = option
        published, where = getattr(inside, key), f"{sheet.name}: [data_sheet] {key}"
        if published is not None:
            _inside(published, where, name, unit)  # also where an option replaces it
            if raw is None:
                raw, places[name] = published, where
        if raw is None and name == "speed" and "speed" in sheet.values:
            raw, places[name] = sheet.values["speed"], f"{sheet.name}: [values] speed"
        if raw is None:
            if name in ("power", "speed"):
                raise SceneError(
                    f"{sheet.name}: [data_sheet] {name}: missing; must be a number in {unit}, here "
                    f"or as {option}"
                )
            found[name] = None
            continue
        found[name] = _inside(raw, places[name], name, unit)
    where = f"{prefix}kind"
    if kind is None:
        kind, where = inside.kind, f"{sheet.name}: [data_sheet] kind"
    places["kind"] = where
    if kind is None:
        kind, places["kind"] = DEFAULT_KIND, ""
    if not isinstance(kind, str) or kind not in KINDS:
        raise SceneError(
            f"{where} = {shown(kind)}: unknown kind of engine{not_known(str(kind), KINDS)}"
        )
    where = f"{prefix}loads" if loads is not None else f"{sheet.name}: [data_sheet] loads"
    given_loads = loads is not None or inside.loads is not None
    places["loads"] = where if given_loads else f"{prefix}loads, which are 10,25,50,75,100: load"
    wanted = _loads(loads if loads is not None else inside.loads, where)
    power, speed = found["power"], found["speed"]
    assert power is not None and speed is not None
    return Published(kind, power, speed, found["peak"], found["fuel_consumption"], wanted, places)


def _inside(raw: Any, where: str, name: str, unit: str) -> float:
    """A published number, checked against its range."""
    low, high = _RANGES[name]
    value = number_with_unit(raw, where, unit)
    if not low <= value <= high:
        raise SceneError(f"{where} = {shown(raw)}: must be between {low:g} and {high:g} {unit}")
    return value


def _loads(raw: Any, where: str) -> tuple[float, ...]:
    """Loads, ascending and each once; the rated one is among them."""
    if raw is None:
        return LOADS
    if not isinstance(raw, list) or not 1 <= len(raw) <= MOST_LOADS:
        raise SceneError(f"{where} = {shown(raw)}: must be a list of 1 to {MOST_LOADS} percentages")
    found = {100.0}
    for item in raw:
        load = number(item, where)
        if not LEAST_LOAD <= load <= MOST_LOAD:
            raise SceneError(
                f"{where} = {load:g}: must be between {LEAST_LOAD:g} and {MOST_LOAD:g} percent"
            )
        found.add(load)
    return tuple(sorted(found))
