"""Engine files and the catalogue of engines.

An engine file is TOML: `cycle`, optional `name`, `title`, `firing_order`, or `arrangement` and what
else `sweeps.scene.engine.cylinder_keys` knows of single cylinders; `[values]` with the keys of a
scene; a `[[diagram]]` for each load, or each load at each `speed`, modelled (see
`sweeps.scene.engine.modelled_diagrams`) or read from a CSV file (`kind = "points"`), or one with
the engine's torque (`sweeps.scene.features.torque_diagrams`); the tables and keys of
`sweeps.scene.features`; optional `[pressure_scale]` over speed; `[data_sheet]` for `engine-dyn
calibrate`; `[assumed]` with a reason for every value that the sources do not give; `[[source]]`
with the citations.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import cache, lru_cache
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from engine_dyn.engine import Engine
from engine_dyn.geometry.arrangement import FOUR_STROKE, TWO_STROKE
from engine_dyn.geometry.cylinders import Cylinders, even_cylinders
from engine_dyn.geometry.slider_crank import crank_radius
from engine_dyn.loads.torque_curves import TorqueOverAngle, superposed
from engine_dyn.pressure.cycle_table import ModelledDiagram
from engine_dyn.pressure.diagram import Diagram
from engine_dyn.pressure.family import Family, family_from_diagrams
from engine_dyn.pressure.family_grid import FamilyGrid, grid_from_diagrams
from engine_dyn.quantities.each_cylinder import OF_CYLINDER
from engine_dyn.quantities.features.hold import HELD_KEYS
from engine_dyn.quantities.graph import PARAMETERS
from engine_dyn.quantities.parameters import CYCLE_KEYS
from engine_dyn.quantities.shaft_numbers import OF_SHAFT
from engine_dyn.units import RPM
from sweeps.base.checks import check_range, check_structure, known_key, mentioned, number, plain
from sweeps.base.errors import SceneError, not_known, one_line, shown
from sweeps.base.files.regular_files import add_files_read, kept, kept_files, referred
from sweeps.base.files.toml_files import parse_toml
from sweeps.catalogue import ENGINES
from sweeps.scene.crossings import exclusive_pair, refused
from sweeps.scene.engine.cylinder_diagrams import (
    CYLINDER,
    by_cylinder,
    joined,
    taken_cylinder,
    values_of_cylinder,
    with_diagrams,
)
from sweeps.scene.engine.cylinder_keys import (
    CYLINDER_KEYS,
    arrangement_of,
    cylinders_of_keys,
    read_cylinder_keys,
)
from sweeps.scene.engine.engine_tables import EngineFile, PressureScale
from sweeps.scene.engine.modelled_diagrams import (
    KINDS,
    check_double_acting,
    modelled_diagram,
    no_more,
    taken,
)
from sweeps.scene.engine.silenced_warnings import read_silenced
from sweeps.scene.features import GIVEN_FEATURES, with_features
from sweeps.scene.features.indicator_files import (
    SPEEDS,
    WARNING,
    notes_of,
    read_indicator,
    read_speeds,
)
from sweeps.scene.features.shaft import INERTIA_KEYS, SHAFT_KEYS
from sweeps.scene.features.torque_diagrams import read_torque_diagram, torque_warnings

RATIO, GEOMETRIC = "compression_ratio", "geometric_compression_ratio"
"""Key of [[diagram]] and its points, and a key of [values], which counts where it is given."""

TORQUE = "torque"  # Kind of a [[diagram]] that gives the engine's torque in place of pressure

PERIODS = {"four-stroke": FOUR_STROKE, "two-stroke": TWO_STROKE}


@cache
def catalogue() -> dict[str, Path]:
    """Engines that come with the package: name and file."""
    return {path.stem: path for path in sorted(ENGINES.glob("*.toml"))}


def load_engine(
    name_or_path: str | Path, base: Path | None = None, where: str = "engine"
) -> Engine:
    """Read an engine of the catalogue, or one from a file.

    Parameters
    ----------
    name_or_path : str or Path
        Name in the catalogue, or path of a TOML file (it ends with .toml or has a separator).
    base : Path, optional
        Folder of the scene that names it, where a relative path starts from and stays; without
        one, it starts from the working folder.
    where : str
        What messages begin with when there is no such engine.

    Raises
    ------
    SceneError
        For an unknown name, a file that is no engine, values outside their range, missing values.
    """
    text = str(name_or_path)
    known = catalogue()
    own = known[text] if text in known else ENGINES / f"{text}.toml"
    if kept(own):
        return _read_engine(own, f"engine {text}")
    if text in known:
        engine, files = _of_catalogue(own, own.stat().st_mtime_ns)
        add_files_read(files)
        return engine
    return _read_engine(*engine_path(text, base, where))


def engine_path(name_or_path: str | Path, base: Path | None, where: str) -> tuple[Path, str]:
    """File of an engine, and what messages about it begin with; see `load_engine`."""
    known, text = catalogue(), str(name_or_path)
    if text in known:
        return known[text], f"engine {text}"
    if not (text.endswith(".toml") or "/" in text or "\\" in text):
        raise SceneError(
            f"{where} = {shown(text)}: unknown engine"
            f"{not_known(text, known, also=', or the path of an engine file (.toml)')}"
        )
    path = Path(text) if base is None else referred(base, text, where)
    return path, f"{where} {text}"


@lru_cache(maxsize=16)
def _of_catalogue(path: Path, changed: int) -> tuple[Engine, dict[str, bytes]]:
    # Sessions run many scenes on one engine. With `changed`, the time of the file, a changed file
    # is read again.
    with kept_files() as files:
        return _read_engine(path, f"engine {path.stem}"), files


def engine_file_of(path: Path, name: str) -> tuple[EngineFile, dict[str, Any]]:
    """Tables of an engine file, of which only keys and types are checked, and all as they stand."""
    raw = plain(parse_toml(path, name, "an engine file (TOML)"), name)
    return check_structure(EngineFile, raw, name), raw


def _read_engine(path: Path, name: str) -> Engine:
    given, raw = engine_file_of(path, name)
    values = read_values(given.values, name)
    torque = _torque(given, name, path.parent)
    if torque is None:
        _check_complete(given, values, name)
    period = _period(given, torque, name)
    count = count_cylinders(given, values, period, name)
    if count:
        values["cylinders"] = float(count)
    order, own = (None, None) if not count else read_cylinders(given, count, period, name)
    entries = [
        _diagram(table, f"{name}: [[diagram]] number {i}", path.parent, period, values, own)
        for i, table in enumerate(given.diagram if torque is None else (), start=1)
    ]
    check_double_acting([t.get("kind") for t in given.diagram], given.pressure_scale, name)
    places = by_cylinder([entry.cylinder for entry in entries], count, name)
    of_cylinders = {number: [entries[i] for i in some] for number, some in places.items()}
    diagrams = of_cylinders.pop(0, [])
    families = {
        number: _family(some, name, f" of cylinder {number}")
        for number, some in of_cylinders.items()
    }
    family = joined(_family(diagrams, name), families, name)
    if families:
        own = with_diagrams(own or even_cylinders(count, period), tuple(families))
    if diagrams and family.low == family.high:
        values.setdefault("load", family.low)  # The load is that of all diagrams
    if torque is not None:
        values.setdefault("cylinders", 1.0)
    if diagrams and "load" not in values:
        raise SceneError(f"{name}: [values] load: missing; must be a number")
    scale = _scale(given.pressure_scale, name)
    if diagrams:
        _check_own_point(values, family, scale, name)
    if torque is not None and not count:
        order, own = read_cylinders(given, values["cylinders"], period, name)
    throw_torques: tuple[TorqueOverAngle, ...] = ()
    if torque is not None and given.diagram[0].get("of") == "cylinder":
        own = own or even_cylinders(int(values["cylinders"]), period, order)
        throw_torques = _of_throws(torque, own, name)
        torque = superposed(torque, [member.phase for member in own.members])
    _check_bores(values, name)
    for key in INERTIA_KEYS if raw.get("shaft") is not None else ():
        if key in values:
            raise SceneError(
                f"{name}: [values] {key}: not allowed together with shaft, whose discs have all "
                "inertia"
            )
    engine = Engine(
        name=given.name or path.stem,
        title=one_line(given.title or given.name or path.stem),
        period=period,
        values=values,
        family=family,
        compression_ratio=compression_ratio_in(
            given, values, (entry.ratio for entry in of_cylinders.get(1, diagrams)), name
        ),
        cycles=_cycles(diagrams),
        pressure_scale=scale,
        firing_order=order,
        own_cylinders=own,
        torque=torque,
        throw_torques=throw_torques,
        assumed=dict(given.assumed),
        uncertainty=dict(given.uncertainty),
        sources=tuple(source.text for source in given.source),
        silenced_warnings=read_silenced(given.silenced_warnings, name),
        diagram_speeds=tuple(_speeds_at(d.load, entries) for d in _by_load(diagrams)),
        diagram_warnings=tuple(line for entry in entries for line in entry.warnings)
        + tuple(_between_stages(entries, given.diagram, name))
        + torque_warnings(given.diagram, f"{name}: [[diagram]]"),
    )
    for feature in GIVEN_FEATURES.values():
        for key in feature.excludes if raw.get(feature.name) is not None else ():
            if key in values:
                two = " or ".join(feature.excludes), feature.written
                raise refused(*two, f"{name}: [values] {key}")
    return with_features(engine, given, path.parent, f"{name}: ")


def _between_stages(
    entries: Sequence[_Entry], tables: Sequence[Mapping[str, Any]], name: str
) -> Iterator[str]:
    """Lines on stages of a compressor that draw in more than the stage before delivers [bar]."""
    found: dict[float, list[tuple[float, float]]] = {}
    for entry, table in zip(entries, tables, strict=False):
        if table.get("kind") == "compressor" and any(one.cylinder for one in entries):
            suction, delivered = (
                number(table[f"{end}_pressure"], "", unit="bar") for end in ("suction", "delivery")
            )
            found.setdefault(entry.load, []).append((suction, delivered))
    for stages in found.values():
        stages.sort()
        for (_, delivered), (suction, _) in pairwise(stages):
            if suction > delivered * (1.0 + 1e-9):
                yield (
                    f"{name}: [[diagram]]: stages: a cylinder draws in at suction_pressure = "
                    f"{suction:g} bar, above the {delivered:g} bar that the stage before delivers"
                )


def _check_bores(values: Mapping[str, float], name: str) -> None:
    """Check that bores of single cylinders belong to cylinders of an engine with a bore."""
    for key in (key for key in values if key in OF_CYLINDER):
        if OF_CYLINDER[key].number > values["cylinders"]:
            must = f"must be of one of the {values['cylinders']:g} cylinders"
            raise SceneError(f"{name}: [values] {key}: {must}")
        if "bore" not in values:
            raise SceneError(f"{name}: [values] {key}: needs bore, that of cylinder 1")


def _by_load(entries: Iterable[_Entry]) -> list[_Entry]:
    return sorted(entries, key=lambda entry: entry.load)


def _speeds_at(load: float, entries: Iterable[_Entry]) -> tuple[float, float] | None:
    """Speeds [rpm] for which all diagrams of a load hold; None where none says it."""
    known = [entry.speeds for entry in entries if entry.load == load and entry.speeds is not None]
    return (max(low for low, _ in known), min(high for _, high in known)) if known else None


def _torque(given: EngineFile, name: str, folder: Path) -> TorqueOverAngle | None:
    """Torque over the crank angle that an engine file gives in place of diagrams."""
    kinds = [table.get("kind") for table in given.diagram]
    if TORQUE not in kinds:
        return None
    where = f"{name}: [[diagram]] number {kinds.index(TORQUE) + 1}"
    if len(kinds) > 1:
        raise SceneError(f"{where} kind = '{TORQUE}': must be the only [[diagram]]")
    if given.pressure_scale is not None:
        raise SceneError(f"{name}: [pressure_scale]: not allowed: the file gives a torque")
    return read_torque_diagram(given.diagram[0], where, folder)


def _of_throws(
    torque: TorqueOverAngle, cylinders: Cylinders, name: str
) -> tuple[TorqueOverAngle, ...]:  # fmt: skip
    """Torque on each throw along the shaft, from that of one cylinder."""
    if cylinders.along_shaft is None:
        raise SceneError(f"{name}: firing_order: missing; [[diagram]] of = 'cylinder' needs it, or "
                         "arrangement")  # fmt: skip
    return tuple(
        superposed(torque, [cylinders.members[i].phase for i in throw])
        for throw in cylinders.along_shaft
    )


def _check_complete(given: EngineFile, values: Mapping[str, float], name: str) -> None:
    """Check that a file without a torque has all that every engine needs, but the load."""
    cycle = "cycle: missing; must be 'four-stroke' or 'two-stroke'; only a torque has its own"
    missing = [cycle] if given.cycle is None else []
    counted = given.firing_order or given.arrangement or given.firing_angles
    keys = (*(["speed"] if given.diagram else []), *([] if counted else ["cylinders"]))
    missing += [f"[values] {key}: missing; must be a number" for key in keys if key not in values]
    if missing:
        raise SceneError(f"{name}: {'; '.join(missing)}")


def _period(given: EngineFile, torque: TorqueOverAngle | None, name: str) -> float:
    """Angle of the cycle [rad]: that of a given torque, unless the file states one."""
    if given.cycle is None:
        assert torque is not None  # `_check_complete` refused to lack both
        return torque.period
    period = PERIODS[given.cycle]
    if torque is not None and math.remainder(period, torque.period) > 1e-9:
        raise SceneError(
            f"{name}: cycle = '{given.cycle}': the torque repeats after "
            f"{math.degrees(torque.period):g} degrees; must be left out, or have such a cycle"
        )
    return period


def read_values(raw: Mapping[str, Any], name: str) -> dict[str, float]:
    """Read and check [values]; a rod's length becomes the crank ratio, which a stroke keeps."""
    values: dict[str, float] = {}
    for key, item in raw.items():
        where = f"{name}: [values] {key}"
        if key in CYCLE_KEYS:
            raise SceneError(f"{where}: not allowed here; belongs to a [[diagram]]")
        if key in OF_CYLINDER and OF_CYLINDER[key].what != "bore":
            what = OF_CYLINDER[key].what
            what += "s" if what == "firing_angle" else ""
            raise SceneError(f"{where}: not allowed; the file has {what}, one for each cylinder")
        if key in OF_SHAFT or key in SHAFT_KEYS:
            raise SceneError(f"{where}: not allowed here; belongs to [shaft]")
        if key == "wanted_delta" or key in HELD_KEYS:
            other = "the inertia" if key == "wanted_delta" else "the load"
            raise SceneError(
                f"{where}: not allowed; belongs to a scene; an engine file gives {other}"
            )
        node = known_key(key, f"{name}: [values]")
        assert node is not None
        values[key] = number(item, where, node)
        check_range(values[key], where, node)
    pair = exclusive_pair(values)
    if pair is not None:
        first, second, reason = pair
        raise SceneError(f"{name}: [values] has both {first} and {second}: {reason}")
    if "rod_length" in values:
        values["crank_ratio"] = _crank_ratio(values.pop("rod_length"), values, name)
    rod = 0.5 * values.get("stroke", math.inf) / values.get("crank_ratio", 1.0)
    if values.get("rod_centre_of_gravity", 0.0) > rod * (1.0 + 1e-9):
        raise SceneError(
            f"{name}: [values] rod_centre_of_gravity = {values['rod_centre_of_gravity']:g}: must "
            f"be at most the rod's length, {rod:.6g} m; it is measured from the big end"
        )
    return values


def _crank_ratio(rod: float, values: Mapping[str, float], name: str) -> float:
    """Crank radius over the length of the rod, from the stroke and the offset."""
    if "stroke" not in values:
        raise SceneError(f"{name}: [values] stroke: missing; rod_length needs it")
    crank = values["stroke"] / 2.0
    if rod <= crank:
        raise SceneError(
            f"{name}: [values] rod_length = {rod:g}: must be above half the stroke, {crank:g} m"
        )
    offset = values.get("pin_offset", 0.0) + values.get("crank_offset", 0.0)
    if offset != 0.0:
        try:
            crank = float(crank_radius(values["stroke"], rod, offset))
        except ValueError as error:
            raise SceneError(f"{name}: [values] {mentioned(error)}") from None
    return crank / rod


def count_cylinders(
    given: EngineFile, values: Mapping[str, float], period: float, name: str
) -> int:
    """Cylinders of an engine file, by [values] or else by what tells them apart; 0 if unknown."""
    if "cylinders" in values:
        return int(values["cylinders"])
    keys = read_cylinder_keys(given.model_dump(include=set(CYLINDER_KEYS)), f"{name}: ")
    if keys.arrangement is None:
        return len(given.firing_order or keys.firing_angles or ())
    try:
        return len(arrangement_of(keys.arrangement, period).cylinders)
    except ValueError as error:
        raise SceneError(f"{name}: {mentioned(error)}") from None


def read_cylinders(
    given: EngineFile, cylinders: float, period: float, name: str
) -> tuple[tuple[int, ...] | None, Cylinders | None]:
    """Firing order, and cylinders that the file describes; None where it says nothing of them."""
    order, count = None, int(cylinders)
    if given.firing_order is not None:
        order = tuple(given.firing_order)
        if sorted(order) != list(range(1, count + 1)):
            raise SceneError(
                f"{name}: firing_order = {list(order)}: must name each of the cylinders "
                f"1 to {count} once"
            )
    keys = read_cylinder_keys(given.model_dump(include=set(CYLINDER_KEYS)), f"{name}: ")
    if order is not None:
        for key in ("arrangement", "firing_angles"):
            if key in keys.given:
                raise SceneError(f"{name}: has both firing_order and {key}: give one of them")
    if order is None and not keys.given:
        return None, None
    own = cylinders_of_keys(keys, even_cylinders(count, period, order), count, f"{name}: ")
    if order is None and own.arrangement is not None:
        order = own.arrangement.firing_order
    return order, own


def compression_ratio_of(table: Mapping[str, Any], where: str) -> float | None:
    """Compression ratio that a [[diagram]] states, of any kind; None where it has none."""
    if "clearance_ratio" in table:  # A ratio of compressors: clearance over swept volume
        clearance = number(table["clearance_ratio"], f"{where} clearance_ratio", unit="1")
        return 1.0 + 1.0 / clearance if clearance > 0.0 else None
    if RATIO not in table:
        return None
    node = PARAMETERS[RATIO]
    value = number(table[RATIO], f"{where} {RATIO}", node)
    check_range(value, f"{where} {RATIO}", node)
    return value


def compression_ratio_in(
    given: EngineFile, values: Mapping[str, float], stated: Iterable[float | None], name: str
) -> float | None:
    """Compression ratio of an engine file; None where it says nothing, or diagrams differ.

    The geometric one of [values] comes first, then the one that the diagrams state, `stated` for
    each. Where none of them states any, it is that of the data sheet.
    """
    if GEOMETRIC in values:
        return values[GEOMETRIC]
    stated = list(stated)
    if any(ratio is not None for ratio in stated) or given.data_sheet is None:
        different = set(stated)
        return different.pop() if len(different) == 1 else None
    return compression_ratio_of(given.data_sheet.cycle, f"{name}: [data_sheet.cycle]")


def _scale(given: PressureScale | None, name: str) -> tuple[Any, Any] | None:
    """[pressure_scale] as arrays of speed [rpm] and factor."""
    if given is None:
        return None
    where = f"{name}: [pressure_scale]"
    speed, scale = np.array(given.speed), np.array(given.scale)
    if len(speed) != len(scale) or len(speed) < 2:
        raise SceneError(
            f"{where} has {len(speed)} speeds and {len(scale)} factors: must be equally many, "
            "at least two"
        )
    if (np.diff(speed) <= 0.0).any() or speed[0] < 0.0:
        raise SceneError(f"{where} speed = {shown(given.speed)}: must ascend from 0 or more")
    if (scale <= 0.0).any():
        raise SceneError(f"{where} scale = {shown(given.scale)}: must be above 0")
    return speed, scale


class _Entry(NamedTuple):
    """One [[diagram]]: load [percent], speed [rpm] if any, curve, and function to model it again.

    Compression ratio and speeds [rpm] stand in the table, if known; warnings are those that the
    checks of a recording left in the file.
    """

    load: float
    speed: float | None
    diagram: Diagram
    again: ModelledDiagram | None
    ratio: float | None
    speeds: tuple[float, float] | None = None
    warnings: tuple[str, ...] = ()
    cylinder: int = 0  # Number of the cylinder that it belongs to; 0: of all without their own


def _diagram(
    table: Mapping[str, Any], where: str, folder: Path, period: float, values: Mapping[str, float],
    cylinders: Cylinders | None,
) -> _Entry:  # fmt: skip
    """One [[diagram]]."""
    rest = dict(table)
    cylinder = taken_cylinder(rest, int(values.get("cylinders", 0)), where)
    load_node, speed_node = PARAMETERS["load"], PARAMETERS["speed"]
    load = number(taken(rest, "load", where), f"{where} load", load_node)
    check_range(load, f"{where} load", load_node)
    speed, speeds = None, read_speeds(rest, where)
    if "speed" in rest:
        speed = number(rest.pop("speed"), f"{where} speed", speed_node)
        check_range(speed, f"{where} speed", speed_node)
    kind = taken(rest, "kind", where)
    if kind == "points":
        file = taken(rest, "file", where)
        if not isinstance(file, str):
            raise SceneError(f"{where} file = {shown(file)}: must be a string: the path of a CSV")
        ratio = compression_ratio_of(rest, where)
        no_more(rest, where, ("load", "speed", SPEEDS, "kind", "file", RATIO, CYLINDER))
        path = referred(folder, file, f"{where} file")
        diagram = read_indicator(path, f"{where} {file}", period)
        notes = (note for note in notes_of(path) if note.startswith(WARNING))
        warnings = tuple(f"{where}: {note.removeprefix(WARNING)}" for note in notes)
        return _Entry(load, speed, diagram, None, ratio, speeds, warnings, cylinder)
    if not isinstance(kind, str) or kind not in KINDS:
        known = "', '".join(("points", TORQUE, *KINDS))
        raise SceneError(f"{where} kind = {shown(kind)}: must be one of '{known}'")
    here = values if speed is None else {**values, "speed": speed}
    if cylinder:
        here = values_of_cylinder(values, cylinder, cylinders)
    diagram, again = modelled_diagram(kind, rest, where, period, here)
    ratio = compression_ratio_of(rest, where)
    return _Entry(load, speed, diagram, again, ratio, speeds, cylinder=cylinder)


def _family(diagrams: list[_Entry], name: str, whose: str = "") -> Family | FamilyGrid:
    """Diagrams over load, or where all have a speed, over load and speed."""
    if not diagrams:
        return Family(np.empty(0), ())
    with_speed = [(d.load, d.speed * RPM, d.diagram) for d in diagrams if d.speed is not None]
    if with_speed and len(with_speed) < len(diagrams):
        number = [d.speed is None for d in diagrams].index(True) + 1
        raise SceneError(
            f"{name}: [[diagram]] number {number} speed: missing; must be given, because other "
            "diagrams have one"
        )
    try:
        if with_speed:
            return grid_from_diagrams(with_speed)
        return family_from_diagrams([d.load for d in diagrams], [d.diagram for d in diagrams])
    except ValueError as error:
        raise SceneError(f"{name}: [[diagram]]{whose}: {mentioned(error)}") from None


def _cycles(diagrams: list[_Entry]) -> tuple[ModelledDiagram, ...] | None:
    """Cycle that models each diagram, in the family's order; None unless each has one."""
    in_order = sorted(diagrams, key=lambda d: (d.speed or 0.0, d.load))
    cycles = tuple(d.again for d in in_order if d.again is not None)
    return cycles if cycles and len(cycles) == len(diagrams) else None


def _check_own_point(
    values: Mapping[str, float],
    family: Family | FamilyGrid,
    scale: tuple[Any, Any] | None,
    name: str,
) -> None:
    """Check that the engine's own load and speed lie where its diagrams are known."""
    load = values["load"]
    if not family.low <= load <= family.high:
        raise SceneError(
            f"{name}: [values] load = {load:g}: must be within the engine's diagrams, "
            f"{family.low:g} to {family.high:g} percent"
        )
    speed = values["speed"]
    if isinstance(family, FamilyGrid):
        if scale is not None:
            raise SceneError(
                f"{name}: has both [pressure_scale] and diagrams with a speed: give one of them"
            )
        low, high = family.speeds[0] / RPM, family.speeds[-1] / RPM
        if not low * (1.0 - 1e-12) <= speed <= high * (1.0 + 1e-12):
            raise SceneError(
                f"{name}: [values] speed = {speed:g}: must be within the engine's diagrams, "
                f"{low:g} to {high:g} rpm"
            )
    if scale is not None:
        low, high = float(scale[0][0]), float(scale[0][-1])
        if not low <= speed <= high:
            raise SceneError(
                f"{name}: [values] speed = {speed:g}: must be within [pressure_scale], {low:g} to "
                f"{high:g} rpm"
            )
