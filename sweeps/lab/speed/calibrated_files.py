"""Engine files as text, written from a calibration: every number says where it comes from."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

from engine_dyn.quantities.graph import PARAMETERS
from sweeps.base.errors import one_line
from sweeps.lab.speed.calibration_model import PUBLISHED, Calibration
from sweeps.scene.engine.diagram_speeds import SPEEDS
from sweeps.scene.engine.modelled_diagrams import KINDS

__all__ = ["engine_file"]

COLUMN = 40
"""Where comments begin."""

HOLDS = (0.5, 1.2)
"""Lowest and highest speed for which the diagrams are said to hold, over the rated one."""

_OWN = ("title", "name", "cycle", "source", "assumed", "firing_order")

SOURCES = (
    "J. B. Heywood, Internal Combustion Engine Fundamentals, McGraw-Hill 1988: usual values and "
    "the modelled cycle",
    "A. Kolchin and V. Demidov, Design of Automotive Engines, Mir 1984: masses of the crank "
    "mechanism",
    "A. Kakaitsas, Rotational irregularity of piston engines (in Greek), diploma thesis, National "
    "Technical University of Athens, 2015, eq. 3.9: friction",
)
"""Of what is assumed."""


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
    lines += [f"{key} = {_toml(item)}" for key, item in rest.items() if key not in _OWN]
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
    for text in [*sources, *(s for s in SOURCES if s not in sources)]:
        lines += ["", "[[source]]", f"text = {_toml(text)}"]
    return "\n".join(lines) + "\n"


def heading(made: Calibration) -> list[str]:
    """What was done, in lines: what it was fitted to, and what the written numbers make."""
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
                speeds = [float(f"{factor * made.published.speed:.6g}") for factor in HOLDS]
                lines.append(_line(SPEEDS, speeds, "rpm; assumed"))
            continue
        unit = KINDS["first_law"].fields[key].unit
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
    """What is known, so that `calibrate` can do the same again."""
    given = made.published
    lines = ["[data_sheet]", f"kind = {_toml(given.kind)}"]
    for name, (key, unit) in PUBLISHED.items():
        if getattr(given, name) is not None:
            lines.append(_line(key, getattr(given, name), f"{unit}; given"))
    lines.append(f"loads = {_toml(list(given.loads))}")
    if made.sheet.known:
        lines += ["", "[data_sheet.cycle]"]
        for key, value in made.sheet.known.items():
            lines.append(_line(key, value, f"{KINDS['first_law'].fields[key].unit}; given"))
    return lines


def _line(key: str, value: Any, comment: str) -> str:
    return f"{f'{key} = {_toml(value)}':<{COLUMN - 1}} # {comment}"


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
