"""What a scene is about, as a text: its engine, what varies, what is computed, and its sources."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from engine_dyn.quantities.graph import ALL_QUANTITIES, PARAMETERS
from sweeps.base.dimensions import DESIGN
from sweeps.base.errors import as_name, counted, one_line
from sweeps.base.ratios import ratio_text
from sweeps.view.texts.key_texts import unit_text
from sweeps.view.texts.shafts import shaft_lines

if TYPE_CHECKING:
    from sweeps.scene.model import Scene

__all__ = ["scene_text"]

FEW = 8
"""Values that are listed; of more, the ends and the number."""


def scene_text(scene: Scene, name: str) -> str:
    """Describe a scene without computing anything.

    Parameters
    ----------
    scene : Scene
        The scene, read.
    name : str
        The scene as the user named it.
    """
    lines = [f"{name}: {as_name(scene.title)}"]
    lines += [f"  {line}" for line in _comment(scene.path)]
    lines += ["", "engine" if len(scene.engines) == 1 else "engines", *_engine_lines(scene)]
    if scene.engine.shaft is not None:
        values = {**scene.engine.values, **scene.settings}
        lines += [
            "",
            *shaft_lines(scene.engine.shaft, values, scene.engine.auxiliaries is not None),
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
    found = []
    for line in path.read_text(encoding="utf-8-sig").splitlines():
        if not line.startswith("#"):
            break
        found.append(line.removeprefix("#").strip())
    return found


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
    """Lines of the measured diagram and of the curve that the load follows."""
    lines = []
    if scene.indicator is not None:
        lines.append(f"  one pressure diagram for all: {scene.source['indicator']['file']}")
    if scene.characteristic is not None:
        lines.append(f"  the load follows a curve over speed: {scene.characteristic.source}")
    return ["", "pressure and load", *lines] if lines else []


def _listed(values: Any) -> str:
    """Values of an axis: all, or the ends and how many."""
    array = np.asarray(values)
    texts = [f"{v:.6g}" for v in array] if array.dtype.kind in "iuf" else [str(v) for v in array]
    texts = [one_line(text, 60) for text in texts]
    distinct = list(dict.fromkeys(texts))
    if len(distinct) <= FEW:
        return ", ".join(distinct)
    if array.dtype.kind in "iuf":
        low, high = np.nanmin(array), np.nanmax(array)
        return f"{len(distinct)} values from {low:.6g} to {high:.6g}"
    return f"{', '.join(distinct[:FEW])} ... ({len(distinct)})"
