"""Data of a calibration: rated point, other published values, and the engine file made of it."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

from engine_dyn.quantities.graph import PARAMETERS
from sweeps.base.checks import number
from sweeps.base.errors import SceneError, not_known, one_line, shown
from sweeps.base.files.numbers_with_units import number_with_unit
from sweeps.lab.speed.usual_engines import KINDS, EngineKind
from sweeps.scene.engine.data_sheets import Sheet
from sweeps.scene.engine.modelled_diagrams import KINDS as DIAGRAM_KINDS
from sweeps.scene.features.indicator_files import SPEEDS

PUBLISHED: Mapping[str, tuple[str, str]] = {
    "power": ("power", "kW"),
    "speed": ("speed", "rpm"),
    "peak": ("peak_pressure", "bar"),
    "fuel_consumption": ("fuel_consumption", "g/kWh"),
}
"""Keys in [data_sheet] and units of the numbers of `Published`."""


@dataclass(frozen=True)
class Published:
    """Published values of the rated point."""

    kind: str  # Name of the kind of engine, one of `KINDS`
    # Brake power [kW] and speed [rpm].
    power: float
    speed: float
    peak: float | None  # Largest pressure, absolute [bar]
    fuel_consumption: float | None  # Brake specific fuel consumption [g/kWh]
    # Loads with a diagram, in percent of the rated mean effective pressure, ascending; one is 100.
    loads: tuple[float, ...]
    places: Mapping[str, str]  # Where each number was given, as messages say it


class Point(NamedTuple):
    """A fitted diagram, and what the numbers as they are written make."""

    load: float  # Load of the diagram in percent
    table: dict[str, Any]  # Table [[diagram]] in the units of files
    # Brake power of the cycle and the power that was aimed at [kW].
    power: float
    goal: float
    # Indicated and brake mean effective pressure [bar].
    imep: float
    bmep: float
    # Largest pressure [bar] and its crank angle [degree].
    peak: float
    peak_angle: float
    compression: float  # Largest pressure without combustion [bar]
    air_fuel_ratio: float  # Mass of air over mass of fuel [1]
    fuel_consumption: float  # Brake specific fuel consumption [g/kWh]


@dataclass(frozen=True, repr=False)
class Calibration:
    """An engine that was fitted to its data sheet.

    Attributes
    ----------
    sheet : Sheet
        Data sheet that was read.
    published : Published
        Values that it was fitted to.
    values : dict
        [values] of the engine, given and assumed.
    order : tuple of int, optional
        Firing order that was assumed.
    points : tuple of Point
        The diagrams, by load.
    assumed : dict
        Reason for each number that is assumed.
    fitted : dict
        Published value behind each fitted number.
    text : str
        The engine file.
    """

    sheet: Sheet
    published: Published
    values: dict[str, float]
    order: tuple[int, ...] | None
    points: tuple[Point, ...]
    assumed: dict[str, str]
    fitted: dict[str, str]
    text: str = ""

    def __repr__(self) -> str:
        about = self.published
        loads = ", ".join(f"{point.load:g}" for point in self.points)
        return (
            f"<Calibration of {one_line(self.sheet.name, 60)}: {about.kind}, {about.power:g} kW at "
            f"{about.speed:g} rpm; diagrams of {loads} % load; `text` is the engine file>"
        )

    @property
    def kind(self) -> EngineKind:
        """Kind of the engine."""
        return KINDS[self.published.kind]

    @property
    def rated(self) -> Point:
        """Point of full load."""
        return next(point for point in self.points if point.load == 100.0)


def engine_file(made: Calibration) -> str:
    """Write the engine file of a calibration: TOML that `engine-dyn run` takes."""
    rest = made.sheet.rest
    lines = [f"# {line}" for line in heading(made)]
    lines += ["", *(f"{key} = {_toml(rest[key])}" for key in ("name", "title") if key in rest)]
    lines.append('cycle = "four-stroke"')
    if made.order is not None:
        lines.append(_line("firing_order", list(made.order), "assumed"))
    elif "firing_order" in rest:
        lines.append(_line("firing_order", rest["firing_order"], "given"))
    lines += [
        f"{key} = {_toml(item)}"
        for key, item in rest.items()
        if key not in ("title", "name", "cycle", "source", "assumed", "firing_order")
    ]
    own: Mapping[str, str] = rest.get("assumed", {})
    lines += ["", "[values]"]
    for key, value in made.values.items():
        node = PARAMETERS[key]
        unit = "" if node.unit in ("", "1") else f"{node.unit}; "
        whole = node.whole and float(value).is_integer()
        number = int(value) if whole else value
        whose = "assumed" if key in made.assumed or key in own else "given"
        lines.append(_line(key, number, unit + whose))
    for point in made.points:
        lines += ["", "[[diagram]]", *_diagram(point.table, made)]
    lines += ["", *_data_sheet(made), "", "[assumed]"]
    fitted = "; ".join(f"{key} to {what}" for key, what in made.fitted.items())
    reasons = {
        **own,
        **made.assumed,
        "diagram": f"Modelled, not measured. Fitted: {fitted}.",
        SPEEDS: "Half to 1.2 times the rated speed, as for engines of the catalogue.",
    }
    lines += [f"{_key(key)} = {_toml(reason)}" for key, reason in reasons.items()]
    sources = [source["text"] for source in rest.get("source", [])]
    # Sources that the reasons of assumed values refer to
    source_lines = (
        "J. B. Heywood, Internal Combustion Engine Fundamentals, McGraw-Hill 1988: usual values "
        "and the modelled cycle",
        "A. Kolchin and V. Demidov, Design of Automotive Engines, Mir 1984: masses of the crank "
        "mechanism",
        "A. Kakaitsas, Rotational irregularity of piston engines (in Greek), diploma thesis, "
        "National Technical University of Athens, 2015, eq. 3.9: friction",
    )
    for text in [*sources, *(s for s in source_lines if s not in sources)]:
        lines += ["", "[[source]]", f"text = {_toml(text)}"]
    return "\n".join(lines) + "\n"


def heading(made: Calibration) -> list[str]:
    """Lines on the fit: the values it was fitted to, and those that the written numbers make."""
    given = made.published
    published = f"{given.power:.6g} kW at {given.speed:.6g} rpm"
    if given.peak is not None:
        published += f", largest pressure {given.peak:.6g} bar"
    if given.fuel_consumption is not None:
        published += f", {given.fuel_consumption:.6g} g/kWh"
    lines = [
        f"Made by `engine-dyn calibrate` from {one_line(made.sheet.path.name, 100)}.",
        "No diagram of this engine was measured: these are modelled cycles (first law, one zone).",
        f"Kind: {made.kind.title}. Fitted to {published}.",
        *(f"  {key}: fitted to {what}" for key, what in made.fitted.items()),
        "Results; each load is that share of the rated mean effective pressure:",
        "  load    power  differs   imep   bmep  p_max at degree  compression  air/fuel  fuel",
        "     %       kW        %    bar    bar    bar                     bar         1  g/kWh",
    ]
    for point in made.points:
        differs = 100.0 * (point.power / point.goal - 1.0)
        lines.append(
            f"  {point.load:4.4g} {point.power:8.4g}  {differs:+7.4f} {point.imep:6.2f} "
            f"{point.bmep:6.2f} {point.peak:6.1f} {point.peak_angle:9.1f} {point.compression:12.1f}"
            f" {point.air_fuel_ratio:9.1f} {point.fuel_consumption:6.0f}"
        )
    if max(given.loads) > OVERLOAD:
        lines.append(
            f"  Loads above {OVERLOAD:g} percent: what is usual at full load goes on in straight "
            "lines to them; an engine may not bear them for long."
        )
    if given.peak is not None:
        differs = 100.0 * (made.rated.peak / given.peak - 1.0)
        lines.append(f"  The peak pressure differs by {differs:+.4f} % from the given one.")
    return lines


def _diagram(table: Mapping[str, Any], made: Calibration) -> list[str]:
    """Lines of a [[diagram]]."""
    lines = []
    for key, value in table.items():
        if key in ("load", "kind", "wall"):
            lines.append(f"{key} = {_toml(value)}")
            if key == "load":
                # The file says that its diagrams hold from half to 1.2 times the rated speed.
                speeds = [float(f"{factor * made.published.speed:.6g}") for factor in (0.5, 1.2)]
                lines.append(_line(SPEEDS, speeds, "rpm; assumed"))
            continue
        unit = DIAGRAM_KINDS["first_law"].fields[key].unit
        if key in made.fitted:
            whose = "fitted"
        elif key in made.sheet.known:
            whose = "given"
        else:
            whose = "assumed"
        if key == "premixed_start":
            whose = "as combustion_start"
        elif key == "exhaust_pressure" and made.kind.boosted and whose == "assumed":
            whose = "assumed to follow intake_pressure"
        elif key == "intake_pressure" and made.kind.boosted and table["load"] != 100.0:
            whose = "fitted" if made.kind.throttled else "from that at 100 percent"
        lines.append(_line(key, value, f"{unit}; {whose}"))
    return lines


def _data_sheet(made: Calibration) -> list[str]:
    """Lines of the known values, from which `calibrate` makes the same engine again."""
    given = made.published
    lines = ["[data_sheet]", f"kind = {_toml(given.kind)}"]
    for name, (key, unit) in PUBLISHED.items():
        if getattr(given, name) is not None:
            lines.append(_line(key, getattr(given, name), f"{unit}; given"))
    lines.append(f"loads = {_toml(list(given.loads))}")
    if made.sheet.known:
        lines += ["", "[data_sheet.cycle]"]
        for key, value in made.sheet.known.items():
            lines.append(_line(key, value, f"{DIAGRAM_KINDS['first_law'].fields[key].unit}; given"))
    return lines


def _line(key: str, value: Any, comment: str) -> str:
    return f"{f'{key} = {_toml(value)}':<39} # {comment}"


def _toml(value: Any) -> str:
    """Write a value as TOML: a text, a truth value, a number, a list or an inline table."""
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007F")
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{_key(k)} = {_toml(item)}" for k, item in value.items()) + " }"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(_toml(item) for item in value) + "]"
    if isinstance(value, float) and value.is_integer() and abs(value) < 1e15:
        return f"{value:.1f}"
    return repr(value)


def _key(key: str) -> str:
    bare = key.isascii() and key.replace("_", "").replace("-", "").isalnum()
    return key if bare else json.dumps(key, ensure_ascii=False)


LEAST_LOAD, MOST_LOAD, MOST_LOADS = 5.0, 150.0, 20
OVERLOAD = 110.0  # Largest load [percent] without a remark: the overload of marine engines


def published(
    sheet: Sheet, prefix: str, given: Mapping[str, float | str | None], kind: str | None,
    loads: list[float] | None,
) -> Published:  # fmt: skip
    """Put together what options say, or else [data_sheet].

    `given` are numbers, or texts with a unit, by the names that `calibrate` has, with the `prefix`
    in messages, "--" for options. SceneError refuses missing numbers, and numbers out of any
    engine's range.
    """
    inside = sheet.published
    numbers: dict[str, float | None] = {}
    places: dict[str, str] = {}
    for name, (key, unit) in PUBLISHED.items():
        raw: Any = given.get(name)
        option = prefix + name.replace("_", "-") if prefix else name
        places[name] = option
        published, where = getattr(inside, key), f"{sheet.name}: [data_sheet] {key}"
        if published is not None:
            # A number of the data sheet is checked even if an option replaces it.
            _inside(published, where, name, unit)
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
            numbers[name] = None
            continue
        numbers[name] = _inside(raw, places[name], name, unit)
    where = f"{prefix}kind"
    if kind is None:
        kind, where = inside.kind, f"{sheet.name}: [data_sheet] kind"
    places["kind"] = where
    if kind is None:
        kind, places["kind"] = "diesel", ""
    if not isinstance(kind, str) or kind not in KINDS:
        raise SceneError(
            f"{where} = {shown(kind)}: unknown kind of engine{not_known(str(kind), KINDS)}"
        )
    where = f"{prefix}loads" if loads is not None else f"{sheet.name}: [data_sheet] loads"
    given_loads = loads is not None or inside.loads is not None
    places["loads"] = where if given_loads else f"{prefix}loads, which are 10,25,50,75,100: load"
    wanted = _loads(loads if loads is not None else inside.loads, where)
    power, speed = numbers["power"], numbers["speed"]
    assert power is not None and speed is not None
    return Published(
        kind, power, speed, numbers["peak"], numbers["fuel_consumption"], wanted, places
    )


def _inside(raw: Any, where: str, name: str, unit: str) -> float:
    """A published number, checked against its range."""
    # Range of each number in data sheets, in the units of `PUBLISHED`
    ranges = {
        "power": (0.05, 2e5),
        "speed": (10.0, 30000.0),
        "peak": (5.0, 400.0),
        "fuel_consumption": (100.0, 2000.0),
    }
    low, high = ranges[name]
    value = number_with_unit(raw, where, unit)
    if not low <= value <= high:
        raise SceneError(f"{where} = {shown(raw)}: must be between {low:g} and {high:g} {unit}")
    return value


def _loads(raw: Any, where: str) -> tuple[float, ...]:
    """Loads, ascending and each once, with the rated one."""
    if raw is None:
        return (10.0, 25.0, 50.0, 75.0, 100.0)  # Loads with a diagram by default [percent]
    if not isinstance(raw, list) or not 1 <= len(raw) <= MOST_LOADS:
        raise SceneError(f"{where} = {shown(raw)}: must be a list of 1 to {MOST_LOADS} percentages")
    loads = {100.0}
    for item in raw:
        load = number(item, where, unit="percent")
        if not LEAST_LOAD <= load <= MOST_LOAD:
            raise SceneError(
                f"{where} = {load:g}: must be between {LEAST_LOAD:g} and {MOST_LOAD:g} percent"
            )
        loads.add(load)
    return tuple(sorted(loads))
