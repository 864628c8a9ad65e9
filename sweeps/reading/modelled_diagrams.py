"""Modelled indicator diagrams of engine files: [[diagram]] of any kind but "points".

What a cycle needs of the engine itself (`crank_ratio`, its offset, and for the loss to the walls
`bore`, `stroke` and `speed`) comes from [values], or from the diagram where it says so.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import MISSING, fields, replace
from functools import lru_cache, partial
from typing import Any

from engine_dyn.geometry.arrangement import FOUR_STROKE, TWO_STROKE
from engine_dyn.geometry.slider_crank import crank_radius_of_ratio
from engine_dyn.pressure import compressor, diesel_cycle, pump
from engine_dyn.pressure.compressor import CompressorCycle
from engine_dyn.pressure.diagram import Diagram, diagram_from_points
from engine_dyn.pressure.diesel_cycle import DieselCycle
from engine_dyn.pressure.first_law import FourStrokeCycle, TwoStrokeCycle
from engine_dyn.pressure.first_law_fields import FIELDS_OF_WALL
from engine_dyn.pressure.pump import PumpCycle
from sweeps.checks import mentioned, number
from sweeps.errors import SceneError, not_known, shown

__all__ = ["KINDS", "Rebuild", "modelled_diagram", "no_more", "taken"]

KINDS: Mapping[str, tuple[type[Any], float]] = {
    "diesel_cycle": (DieselCycle, FOUR_STROKE),
    "first_law": (FourStrokeCycle, FOUR_STROKE),
    "two_stroke": (TwoStrokeCycle, TWO_STROKE),
    "compressor": (CompressorCycle, TWO_STROKE),
    "pump": (PumpCycle, TWO_STROKE),
}
"""Kinds of modelled diagrams: what makes them, and the period of the engine [rad]."""

Rebuild = Callable[..., Diagram]

STEP = 0.5
"""Degrees between two points of a diagram."""

_OF_ENGINE = ("crank_ratio", "bore", "stroke", "speed")


def modelled_diagram(
    kind: str, rest: Mapping[str, Any], where: str, period: float, values: Mapping[str, float]
) -> tuple[Diagram, Rebuild | None]:
    """Model the diagram of a [[diagram]] table, whose load and speed are taken out.

    Beside it, what makes it again with other fields (SI): for cycles by the first law.

    Raises
    ------
    SceneError
        For a kind that is not one of the engine's cycle, unknown and missing keys, values that are
        no cycle.
    """
    made, needed = KINDS[kind]
    if period != needed:
        cycle_name = "four-stroke" if needed == FOUR_STROKE else "two-stroke"
        raise SceneError(f"{where} kind = '{kind}': must belong to a {cycle_name} engine")
    units: Mapping[str, tuple[str, float]] = (
        diesel_cycle.FILE_UNITS if made is DieselCycle
        else compressor.FILE_UNITS if made is CompressorCycle
        else pump.FILE_UNITS if made is PumpCycle
        else made.units
    )  # fmt: skip
    given: dict[str, Any] = {}
    wall = None
    if made in (FourStrokeCycle, TwoStrokeCycle):
        wall = rest.get("wall", "adiabatic")
        if not isinstance(wall, str) or wall not in FIELDS_OF_WALL:
            allowed = "', '".join(FIELDS_OF_WALL)
            raise SceneError(f"{where} wall = {shown(wall)}: must be one of '{allowed}'")
        given["wall"] = wall
    others = {f for w, names in FIELDS_OF_WALL.items() if w != wall for f in names}
    usable = [key for key in units if wall is None or key not in others]
    no_more(rest, where, ("load", "speed", "kind", "step", *given, *usable))
    for item in fields(made):
        key = item.name
        if key not in usable:
            continue
        unit, size = units[key]
        if key in rest:
            given[key] = number(rest[key], f"{where} {key}") * size
        elif made is not DieselCycle and key in _OF_ENGINE and key in values:
            given[key] = values[key] * size
        elif item.default is MISSING or (
            wall is not None and key in FIELDS_OF_WALL[wall] and key != "wall_factor"
        ):
            also = "" if key not in _OF_ENGINE else ", here or in [values]"
            words = "" if unit == "1" else f" in {unit}"
            raise SceneError(f"{where} {key}: missing; must be a number{words}{also}")
    offset = values.get("pin_offset", 0.0) + values.get("crank_offset", 0.0)
    if offset != 0.0 and "offset_ratio" not in given:
        if made is CompressorCycle:
            raise SceneError(
                f"{where} kind = '{kind}': is modelled without offset; pin_offset and crank_offset "
                "must be 0"
            )
        given["offset_ratio"] = _offset_ratio(offset, given["crank_ratio"], values, where)
    step = number(rest["step"], f"{where} step") if "step" in rest else STEP
    try:
        cycle_given = made(**given)
        again = partial(_changed, cycle_given, step) if wall is not None else None
        return _diagram_of(cycle_given, step), again
    except ValueError as error:
        raise SceneError(f"{where}: {mentioned(error)}") from None


def _offset_ratio(
    offset: float, crank_ratio: float, values: Mapping[str, float], where: str
) -> float:
    """Offset of the pin's line over the crank radius."""
    if "stroke" not in values:
        raise SceneError(f"{where} stroke: missing; must be in [values] where there is an offset")
    try:
        return offset / float(crank_radius_of_ratio(values["stroke"], crank_ratio, offset))
    except ValueError as error:
        raise SceneError(f"{where} {mentioned(error)}") from None


def _changed(made: Any, step: float, **changes: float) -> Diagram:
    return _diagram_of(replace(made, **changes), step)


@lru_cache(maxsize=256)
def _diagram_of(made: Any, step: float) -> Diagram:
    # Integrating a cycle takes far longer than reading a scene, and sessions read many.
    if isinstance(
        made, CompressorCycle | PumpCycle
    ):  # nothing burns, nothing is left out without combustion
        return made.diagram(step)
    return replace(_without_motored(made, step), motored=partial(_motored_of, made, step))


@lru_cache(maxsize=256)
def _motored_of(made: Any, step: float) -> Diagram:
    # Without heat the start of the combustion has no effect.
    without = made.motored() if isinstance(made, DieselCycle) else replace(made, heat=0.0)
    return _without_motored(without, step)


def _without_motored(made: Any, step: float) -> Diagram:
    if isinstance(made, DieselCycle):
        return diagram_from_points(*made.points(step))
    diagram: Diagram = made.diagram(step)
    return diagram


def taken(table: dict[str, Any], key: str, where: str) -> Any:
    """Take a key out of a table that must have it."""
    if key not in table:
        raise SceneError(f"{where} {key}: missing")
    return table.pop(key)


def no_more(rest: Mapping[str, Any], where: str, known: tuple[str, ...]) -> None:
    """Refuse keys that are not known."""
    for key in rest:
        if key not in known:
            raise SceneError(f"{where} {key}: unknown key{not_known(key, known)}")
