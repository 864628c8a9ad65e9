"""Scenes, engines and shafts as texts."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from engine_dyn.plausibility.judgement import indicated_pressure
from engine_dyn.pressure.double_acting import ends_of
from engine_dyn.quantities.each_cylinder import OF_CYLINDER, with_values
from engine_dyn.quantities.features import auxiliaries
from engine_dyn.quantities.graph import ALL_QUANTITIES, PARAMETERS, PATTERNS
from engine_dyn.units import BAR, RPM
from sweeps.base.dimensions import DESIGN
from sweeps.base.errors import as_name, counted, one_line
from sweeps.base.ratios import ratio_text
from sweeps.scene.features import GIVEN_FEATURES
from sweeps.scene.features.shaft import read_shaft
from sweeps.view.texts.key_texts import unit_text, value_text

if TYPE_CHECKING:
    from engine_dyn.engine import Engine
    from engine_dyn.torsion.shaft import Shaft
    from sweeps.scene.model import Scene


def scene_text(scene: Scene, name: str) -> str:
    """Describe a scene, read from what the user named, without computing anything."""
    lines = [f"{name}: {as_name(scene.title)}"]
    lines += [f"  {line}" for line in _comment(scene.path)]
    lines += ["", "engine" if len(scene.engines) == 1 else "engines", *_engine_lines(scene)]
    if scene.engine.shaft is not None:
        values = {**scene.engine.values, **scene.settings}
        lines += [
            "",
            *shaft_lines(scene.engine.shaft, values, auxiliaries.of(scene.engine) is not None),
        ]
    if scene.settings:
        lines += ["", "set"]
        for key, value in scene.settings.items():
            number = ratio_text(value, 10) if key == "wanted_delta" else f"{value:.10g}"
            lines.append(f"  {key} = {number}{_about(key)}")
    words = {k: v for k, v in scene.source.get("set", {}).items() if k not in scene.settings}
    lines += [f"  {key} = {one_line(value, 200)}" for key, value in words.items()]
    lines += ["", f"varies, {counted(math.prod(scene.sizes.values()), 'design')}", *_varying(scene)]
    lines += _driven(scene)
    lines += ["", "computes"]
    for quantity in scene.quantities:
        node = ALL_QUANTITIES[quantity]
        source = f" ({node.source})" if node.source else ""
        unit = unit_text(node.unit or "no single unit")
        lines.append(f"  {quantity}{unit} {node.long_name}{source}")
    lines.append(f"  by method {', '.join(scene.methods)}, closure {scene.closure}")
    if scene.reference is not None:
        columns = ", ".join(scene.reference.columns)
        lines += ["", "published values beside them"]
        lines.append(f"  {one_line(scene.reference.file, 200)}: {columns}")
    sources = dict.fromkeys(source for engine in scene.engines for source in engine.sources)
    if sources:
        lines += ["", "sources", *(f"  {one_line(source)}" for source in sources)]
    return "\n".join(lines)


def _engine_lines(scene: Scene) -> list[str]:
    """Lines of the engines as the scene names them."""
    named: dict[str, Any] = {}
    for one in scene.ordinary_scenes:
        named.setdefault(one.source.get("engine", one.engine.name), one.engine)
    lines = []
    for name, engine in named.items():
        assumed = f", {counted(len(engine.assumed), 'value')} assumed" if engine.assumed else ""
        lines += [
            f"  {as_name(name)}: {as_name(engine.title)}",
            f"  values, sources and assumptions: engine-dyn info {name}{assumed}",
        ]
    return lines


def _comment(path: Path | None) -> list[str]:
    """Comment at the head of the scene's file."""
    if path is None:
        return []
    lines = []
    for line in path.read_text(encoding="utf-8-sig").splitlines():
        if not line.startswith("#"):
            break
        lines.append(line.removeprefix("#").strip())
    return lines


def _about(key: str) -> str:
    node = PARAMETERS[key]
    return f"{unit_text(node.unit)} {node.long_name}"


def _varying(scene: Scene) -> list[str]:
    """Lines of the axes and of the columns of [designs]."""
    lines = []
    for key, values in scene.axes.items():
        about = _about(key) if key in PARAMETERS else ""
        lines.append(f"  {key} = {_listed(values)}{about}")
    if scene.designs or scene.labels:
        how = "" if scene.sample is None else f"{scene.sample.how}, "
        lines.append(f"  together, {how}{counted(scene.sizes[DESIGN], 'design')}:")
        for label, texts in scene.labels.items():
            said = _listed(texts) if scene.sample is None else scene.sample.parameters[label].words
            lines.append(f"    {label}: {said}")
        for key, values in scene.designs.items():
            said = _listed(values) if scene.sample is None else scene.sample.parameters[key].words
            lines.append(f"    {key} = {said}{_about(key)}")
    return lines or ["  nothing"]


def _driven(scene: Scene) -> list[str]:
    """Lines of tables that only scenes have: a measured diagram, a characteristic."""
    lines = [
        f"  {one.line(one.part_of(scene))}"
        for one in GIVEN_FEATURES.values()
        if one.scenes_only and one.line is not None and one.part_of(scene) is not None
    ]
    return ["", "pressure and load", *lines] if lines else []


def _listed(values: Any) -> str:
    """Text of the values of an axis: all, or the ends and the number."""
    array = np.asarray(values)
    texts = [f"{v:.6g}" for v in array] if array.dtype.kind in "iuf" else [str(v) for v in array]
    texts = [one_line(text, 60) for text in texts]
    distinct = list(dict.fromkeys(texts))
    few = 8  # Largest number of values that are listed; otherwise the ends and the number are shown
    if len(distinct) <= few:
        return ", ".join(distinct)
    if array.dtype.kind in "iuf":
        low, high = np.nanmin(array), np.nanmax(array)
        return f"{len(distinct)} values from {low:.6g} to {high:.6g}"
    return f"{', '.join(distinct[:few])} ... ({len(distinct)})"


def engine_text(engine: Engine) -> str:
    """Describe an engine: its values, which of them are assumed and why, and its sources."""
    family = engine.family
    lines = [as_name(f"{engine.name}: {engine.title}"), "", "values"]
    of_shaft = engine.shaft.keys if engine.shaft else ()
    for key, value in engine.values.items():
        if key in of_shaft:
            continue
        node = PARAMETERS[key]
        mark = "  (assumed)" if key in engine.assumed else ""
        said = value_text(node, value, digits=10)
        lines.append(f"  {key} = {said}{unit_text(node.unit)} {node.long_name}{mark}")
    if engine.firing_order is not None:
        lines.append("  firing order " + "-".join(str(c) for c in engine.firing_order))
    if engine.own_cylinders is not None:
        bores = {k: v for k, v in engine.values.items() if k == "bore" or k in OF_CYLINDER}
        solved = with_values(engine.own_cylinders, bores).solved
        lines.append(f"  part of the cycle that is solved: {solved}")
    for name, feature in GIVEN_FEATURES.items():
        if name in engine.parts and feature.line is not None:
            lines.append(f"  {feature.line(engine.parts[name])}")
    if engine.shaft is not None:
        lines += ["", *shaft_lines(engine.shaft, engine.values, auxiliaries.of(engine) is not None)]
    if engine.torque is not None:
        lines += ["", "diagram", f"  of the engine: {engine.torque}"]
    else:
        lines += ["", "diagrams" if family.diagrams else "no diagrams"]
    speeds = [f" at {s / RPM:g} rpm" for s in getattr(family, "speeds", ())] or [""]
    points = [(load, speed) for speed in speeds for load in family.loads]
    diagrams = family.diagrams
    ends = ends_of(family)
    if ends is not None:
        points = [(load, end) for load, _ in points for end in (", head end", ", crank end")]
        diagrams = (ends.head_end, ends.crank_end)
    for number, own in getattr(family, "of_cylinders", {}).items():
        points += [(load, f", cylinder {number}") for load in own.loads]
        diagrams += own.diagrams
    if len(family.loads) > 1 and ends is None:
        lines[-1] += "; load is the name of a diagram, not a share of the torque"
    for (load, speed), diagram in zip(points, diagrams, strict=True):
        imep = f", imep {indicated_pressure(diagram) / BAR:.3g} bar" if ends is None else ""
        lines.append(
            f"  load {load:g} percent{speed}: p_max {diagram.peak / BAR:.4g} bar at "
            f"{math.degrees(diagram.peak_angle):.3g} degree{imep}, {len(diagram.angle)} points"
        )
    if engine.pressure_scale is not None:
        over, scale = engine.pressure_scale
        lines.append(
            f"  scaled with speed from {over[0]:g} to {over[-1]:g} rpm by factors from "
            f"{min(scale):.4g} to {max(scale):.4g}"
        )
    return "\n".join([*lines, *_origins(engine.assumed, engine.sources)])


def shaft_text(name: str) -> str:
    """Describe a built-in shaft: discs, shafts and gears with their numbers, and sources."""
    given = read_shaft(name, Path(), "")
    lines = [f'shaft {name}: a scene takes it with shaft = "{name}"', ""]
    lines += shaft_lines(given.shaft, given.values)
    return "\n".join([*lines, *_origins(given.assumed, given.sources)])


def shaft_lines(
    shaft: Shaft, values: Mapping[str, float], auxiliaries: bool = False
) -> list[str]:  # fmt: skip
    """Discs, shafts and gears with the numbers of their keys; rings of dampers come last.

    `values` are in the units of files; the disc of the `auxiliaries` is told where there are some.
    """
    masses = "include" if shaft.includes_reciprocating else "are without"
    lines = [
        f"shaft, {counted(len(shaft.discs), 'disc')}, counted as in keys such as disc_inertia_1; "
        f"discs of throws {masses} the reciprocating masses"
    ]
    for place, name in enumerate(shaft.discs):
        roles = [f"throw {n + 1}" for n, disc in enumerate(shaft.throws) if disc == place]
        parts = ("flywheel", "load", *(("auxiliaries",) if auxiliaries else ()))
        roles += [f"{part} on it" for part in parts if getattr(shaft, part) == place]
        lines.append(_line(place, name, [*roles, *_numbers(shaft, "disc", place, values)]))
    for place, name in enumerate(shaft.shaft_names):
        between = " - ".join(shaft.discs[disc] for disc in shaft.shafts[place])
        joins = [] if between == name else [between]
        lines.append(_line(place, name, [*joins, *_numbers(shaft, "shaft", place, values)]))
    for place, (first, second) in enumerate(shaft.gears):
        ratio = f"ratio = {values[f'shaft_gear_ratio_{place + 1}']:.6g}"
        lines.append(_line(place, f"gear {shaft.discs[first]} - {shaft.discs[second]}", [ratio]))
    return lines


def _line(place: int, name: str, about: list[str]) -> str:
    return f"  {place + 1} {one_line(name, 80)}: {', '.join(about)}"


def _numbers(shaft: Shaft, kind: str, place: int, values: Mapping[str, float]) -> list[str]:
    """Numbers of a disc or shaft, or of a damper where the disc is its ring."""
    texts = []
    for pattern in PATTERNS:
        what = pattern.removesuffix("_N")
        key = shaft.key_of(what, place) if what.startswith(f"{kind}_") else ""
        if key in values and what != "shaft_gear_ratio":
            unit = PARAMETERS[key].unit
            said = f"{what.removeprefix(f'{kind}_')} = {values[key]:.6g}"
            texts.append(said if unit == "1" else f"{said} [{unit}]")
    return texts


def _origins(assumed: Mapping[str, str], sources: Sequence[str]) -> list[str]:
    """Lines on values that are assumed, and on sources."""
    lines = []
    if assumed:
        lines += ["", "assumed, because not given in the sources"]
        lines += [f"  {key}: {one_line(reason)}" for key, reason in assumed.items()]
    if sources:
        lines += ["", "sources", *(f"  {one_line(source)}" for source in sources)]
    return lines
