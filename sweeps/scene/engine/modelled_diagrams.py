"""Modelled indicator diagrams of engine files: every kind of [[diagram]] but "points".

What a cycle needs of the engine itself (`crank_ratio`, its offset, and for the loss to the walls
`bore`, `stroke` and `speed`) comes from [values], or from the diagram where it says so. The bore
and the crankcase pressure of double-acting cylinders come from [values] alone, as the solver's do.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import MISSING, fields, replace
from functools import lru_cache, partial
from typing import Any, NamedTuple

from engine_dyn.geometry.arrangement import FOUR_STROKE, TWO_STROKE
from engine_dyn.geometry.slider_crank import crank_radius_of_ratio
from engine_dyn.pressure import compressor, diesel_cycle, double_acting
from engine_dyn.pressure.compressor import PUMP_FIELDS, CompressorCycle, PumpCycle
from engine_dyn.pressure.cycle_table import ModelledDiagram
from engine_dyn.pressure.diagram import Diagram, diagram_from_points
from engine_dyn.pressure.diesel_cycle import DieselCycle
from engine_dyn.pressure.double_acting import DoubleActingCycle
from engine_dyn.pressure.file_fields import FileField
from engine_dyn.pressure.first_law import FourStrokeCycle, TwoStrokeCycle
from engine_dyn.pressure.first_law_formulas import (
    FIELDS_OF_WALL,
    FOUR_STROKE_FIELDS,
    TWO_STROKE_FIELDS,
)
from engine_dyn.quantities.graph import PARAMETERS
from sweeps.base.checks import mentioned, number
from sweeps.base.errors import SceneError, not_known, one_line, shown

DOUBLE_ACTING = "double_acting_compressor"
"""Kind of [[diagram]] for cylinders with gas on both sides of the piston."""


class Kind(NamedTuple):
    """A kind of modelled diagram."""

    cycle: type[Any]  # Dataclass of the cycle, whose fields are keys of the table
    period: float  # Period [rad] of engines that may have this kind of diagram
    fields: Mapping[str, FileField]  # Unit and range of each key in files

    @property
    def by_first_law(self) -> bool:
        """Whether the first law gives the pressure; such cycles may lose heat to the walls."""
        return self.cycle in (FourStrokeCycle, TwoStrokeCycle)


KINDS: Mapping[str, Kind] = {
    "diesel_cycle": Kind(DieselCycle, FOUR_STROKE, diesel_cycle.FILE_FIELDS),
    "first_law": Kind(FourStrokeCycle, FOUR_STROKE, FOUR_STROKE_FIELDS),
    "two_stroke": Kind(TwoStrokeCycle, TWO_STROKE, TWO_STROKE_FIELDS),
    "compressor": Kind(CompressorCycle, TWO_STROKE, compressor.FILE_FIELDS),
    DOUBLE_ACTING: Kind(DoubleActingCycle, TWO_STROKE, double_acting.FILE_FIELDS),
    "pump": Kind(PumpCycle, TWO_STROKE, PUMP_FIELDS),
}
"""Kinds of modelled diagrams by their names in files."""

OF_ENGINE = ("crank_ratio", "bore", "stroke", "speed", "crankcase_pressure")
"""Fields of cycles that come from [values] where a diagram lacks them."""


def modelled_diagram(
    name: str, rest: Mapping[str, Any], where: str, period: float, values: Mapping[str, float]
) -> tuple[Diagram, ModelledDiagram | None]:
    """Model the diagram of a [[diagram]] table.

    `name` is one of `KINDS`, `rest` the table without its load and speed, `period` that of the
    engine [rad], and `values` are its [values] in the units of files; messages begin with `where`.
    Returned are the diagram and, for cycles by the first law, what makes it again with other
    values. Refused are a kind that does not suit the engine's cycle, unknown and missing keys, and
    values that no cycle can have.
    """
    cycle, step = modelled_cycle(name, rest, where, period, values)
    try:
        again = ModelledDiagram(cycle, step) if KINDS[name].by_first_law else None
        return _diagram_of(cycle, step), again
    except ValueError as error:
        raise SceneError(f"{where}: {mentioned(error)}") from None


def modelled_cycle(
    name: str, rest: Mapping[str, Any], where: str, period: float, values: Mapping[str, float]
) -> tuple[Any, float]:
    """Cycle of a [[diagram]] table, and the step [degree] in which it is tabulated.

    Parameters and errors are those of `modelled_diagram`.
    """
    kind = KINDS[name]
    if period != kind.period:
        stroke = "four-stroke" if kind.period == FOUR_STROKE else "two-stroke"
        raise SceneError(f"{where} kind = '{name}': must belong to a {stroke} engine")
    fields_given = _fields(kind, rest, where, values)
    offset = values.get("pin_offset", 0.0) + values.get("crank_offset", 0.0)
    if offset != 0.0 and "offset_ratio" not in fields_given:
        if issubclass(kind.cycle, CompressorCycle):
            raise SceneError(
                f"{where} kind = '{name}': modelled without offset; pin_offset and crank_offset "
                "must be 0"
            )
        ratio = _offset_ratio(offset, fields_given["crank_ratio"], values, where)
        fields_given["offset_ratio"] = ratio
    # Degrees between two points of a diagram
    step = number(rest["step"], f"{where} step", unit="degree") if "step" in rest else 0.5
    try:
        return kind.cycle(**fields_given), step
    except ValueError as error:
        raise SceneError(f"{where}: {mentioned(error)}") from None


def check_double_acting(kinds: Sequence[Any], pressure_scale: object, name: str) -> None:
    """Refuse what would be applied to the effective pressure of a double-acting cylinder.

    `kinds` are those of all [[diagram]] of an engine file. Another diagram, and a scale over the
    speed, are refused.
    """
    if DOUBLE_ACTING not in kinds:
        return
    where = f"{name}: [[diagram]] number {kinds.index(DOUBLE_ACTING) + 1} kind = '{DOUBLE_ACTING}'"
    if len(kinds) > 1:
        raise SceneError(f"{where}: must be the only [[diagram]]; one file for each capacity")
    if pressure_scale is not None:
        raise SceneError(f"{where}: not allowed together with [pressure_scale]")


def _fields(
    kind: Kind, rest: Mapping[str, Any], where: str, values: Mapping[str, float]
) -> dict[str, Any]:
    """Fields of the cycle in SI units: those of the table, otherwise those of the engine."""
    inputs: dict[str, Any] = {}
    of_wall: tuple[str, ...] = ()
    usable = list(kind.fields)
    if kind.by_first_law:
        wall = rest.get("wall", "adiabatic")
        if not isinstance(wall, str) or wall not in FIELDS_OF_WALL:
            allowed = "', '".join(FIELDS_OF_WALL)
            raise SceneError(f"{where} wall = {shown(wall)}: must be one of '{allowed}'")
        inputs["wall"] = wall
        of_wall = tuple(FIELDS_OF_WALL[wall])
        others = {f for w, names in FIELDS_OF_WALL.items() if w != wall for f in names}
        usable = [key for key in usable if key not in others]
    no_more(rest, where, ("load", "speed", "kind", "step", *inputs, *usable))
    for item in fields(kind.cycle):
        key = item.name
        field = kind.fields.get(key)
        if key not in usable and (field is not None or key not in OF_ENGINE):
            continue
        if field is not None and key in rest:
            inputs[key] = number(rest[key], f"{where} {key}", unit=field.unit) * field.size
        elif kind.cycle is not DieselCycle and key in OF_ENGINE and key in values:
            inputs[key] = values[key] * (PARAMETERS[key].si if field is None else field.size)
        elif field is None:
            unit = PARAMETERS[key].unit
            raise SceneError(f"{where} {key}: missing; must be a number in {unit}, in [values]")
        elif item.default is MISSING or (key in of_wall and key != "wall_factor"):
            also = "" if key not in OF_ENGINE else ", here or in [values]"
            words = "" if field.unit == "1" else f" in {field.unit}"
            raise SceneError(f"{where} {key}: missing; must be a number{words}{also}")
    return inputs


def _offset_ratio(
    offset: float, crank_ratio: float, values: Mapping[str, float], where: str
) -> float:
    """Offset of the pin's line of travel over the crank radius."""
    if "stroke" not in values:
        raise SceneError(f"{where} stroke: missing; must be in [values] if there is an offset")
    try:
        return offset / float(crank_radius_of_ratio(values["stroke"], crank_ratio, offset))
    except ValueError as error:
        raise SceneError(f"{where} {mentioned(error)}") from None


@lru_cache(maxsize=256)
def _diagram_of(cycle: Any, step: float) -> Diagram:
    # Integrating a cycle takes far longer than reading a scene, and sessions read many scenes with
    # the same cycle.
    if isinstance(cycle, CompressorCycle | PumpCycle):  # Compressors and pumps burn nothing
        return cycle.diagram(step)
    return replace(_without_motored(cycle, step), motored=partial(_motored_of, cycle, step))


@lru_cache(maxsize=256)
def _motored_of(cycle: Any, step: float) -> Diagram:
    # Without heat the start of the combustion has no effect.
    without = cycle.motored() if isinstance(cycle, DieselCycle) else replace(cycle, heat=0.0)
    return _without_motored(without, step)


def _without_motored(cycle: Any, step: float) -> Diagram:
    if isinstance(cycle, DieselCycle):
        return diagram_from_points(*cycle.points(step))
    diagram: Diagram = cycle.diagram(step)
    return diagram


def taken(table: dict[str, Any], key: str, where: str) -> Any:
    """Take a key out of a table that must have it."""
    if key not in table:
        others = f" (other keys: {one_line(', '.join(table), 100)})" if table else ""
        raise SceneError(f"{where} {key}: missing{others}")
    return table.pop(key)


def no_more(rest: Mapping[str, Any], where: str, known: tuple[str, ...]) -> None:
    """Refuse keys that are not known."""
    for key in rest:
        if key not in known:
            raise SceneError(f"{where} {key}: unknown key{not_known(key, known)}")
