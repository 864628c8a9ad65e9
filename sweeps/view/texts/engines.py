"""What an engine is, as a text: its values, diagrams, assumptions and sources."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from engine_dyn.pressure.double_acting import ends_of
from engine_dyn.quantities.graph import PARAMETERS
from engine_dyn.units import BAR, RPM
from sweeps.base.errors import as_name, one_line
from sweeps.view.texts.key_texts import unit_text, value_text
from sweeps.view.texts.shafts import shaft_lines

if TYPE_CHECKING:
    from engine_dyn.engine import Engine

__all__ = ["engine_text"]


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
        lines.append(f"  part of the cycle that is solved: {engine.own_cylinders.solved}")
    for what, table in (("load", engine.load_table), ("driver", engine.driver_table)):
        if table is not None:
            lines.append(f"  {what}_table: {table}")
    if engine.auxiliaries is not None:
        lines.append(f"  auxiliaries: {engine.auxiliaries}")
    if engine.counterweights is not None:
        lines.append(f"  {len(engine.counterweights.mass)} counterweights on webs")
    if engine.mounts is not None:
        lines.append(f"  {len(engine.mounts.lateral)} mounts")
    if engine.shaft is not None:
        lines += ["", *shaft_lines(engine.shaft, engine.values, engine.auxiliaries is not None)]
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
    for (load, speed), diagram in zip(points, diagrams, strict=True):
        lines.append(
            f"  load {load:g} percent{speed}: p_max {diagram.peak / BAR:.4g} bar at "
            f"{math.degrees(diagram.peak_angle):.3g} degree, {len(diagram.angle)} points"
        )
    if engine.pressure_scale is not None:
        over, scale = engine.pressure_scale
        lines.append(
            f"  scaled with speed from {over[0]:g} to {over[-1]:g} rpm by factors from "
            f"{min(scale):.4g} to {max(scale):.4g}"
        )
    if engine.assumed:
        lines += ["", "assumed, because not given in the sources"]
        lines += [f"  {key}: {one_line(reason)}" for key, reason in engine.assumed.items()]
    if engine.sources:
        lines += ["", "sources", *(f"  {one_line(source)}" for source in engine.sources)]
    return "\n".join(lines)
