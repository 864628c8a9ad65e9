"""Work diagrams: p-V and log p - log V of archives, and the sheet of a recorded pressure."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from engine_dyn.types import Booleans, Floats
from sweeps.view.figures.angle_lines import line_or_mark, over_angle, trace
from sweeps.view.figures.marks import line_style, shade
from sweeps.view.figures.scales import crank_axis, set_log
from sweeps.view.figures.sheet import GREY, Entries, NamedFigures, multiples, x_label, y_label
from sweeps.view.figures.study import Study
from sweeps.view.figures.views import StudyAxis, View, pick, stem_of
from sweeps.view.figures.wording import sentence, typeset

if TYPE_CHECKING:
    from matplotlib.axes import Axes

VOLUMES = ("cylinder_volume", "relative_volume", "displaced_volume", "relative_displaced_volume")
"""Volumes that a recorded pressure may have; the first two include the clearance volume."""

SHEET = (
    "pressure_of_cycle", "heat_release_rate", "heat_released", "imep_of_cycle",
    "peak_pressure_of_cycle", "peak_angle_of_cycle",
)  # fmt: skip
"""Variables on the sheet of a recorded pressure, besides mean pressure and volume."""

NEAR = (-60.0, 90.0)
"""First and last crank angle of the panels around firing dead centre, in degrees."""

MEAN = "#000000"


# --- any archive ----------------------------------------------------------------------------------


def work_names(view: View) -> list[str]:
    """Pressure and what it is drawn over: the volume, or the travel of the piston."""
    if not over_angle(view, "pressure") or recorded_names(view):
        return []
    over = [name for name in ("cylinder_volume", "position") if over_angle(view, name)][:1]
    return ["pressure", *over] if over else []


def work_diagrams(study: Study, names: Sequence[str]) -> NamedFigures:
    """Draw p over V, and both logarithmic where the clearance volume is known."""
    # Axes are chosen by the pressure: one that changes only the travel hardly changes the loops.
    views = study.views_by_axis(names[:1])
    for whole, along in views:
        view = whole.only(names, [along])
        axis = view.axis(along)
        logarithmic = names[1] == "cylinder_volume" or _ratio(view, axis.place(0)) is not None
        sheet = multiples(1 + logarithmic, 3.2, 0.0)
        for panel, entries in zip(sheet.panels, (sheet.entries, {}), strict=False):
            _work_lines(panel, view, names[1], axis, entries)
            y_label(panel, view.label("pressure"), 2.6)
            x_label(panel, _volume_label(view, names[1], logarithmic), 6.0 / sheet.columns)
        if logarithmic:
            _logarithmic(sheet.panels[1])
        notes = [*view.notes(names), axis.picked_text()]
        drawn = sheet.finish(
            axis.by("Work diagrams"), notes, view.caption, legend=bool(axis),
            legend_title=axis.label,
        )  # fmt: skip
        yield stem_of("work_diagrams", view, along, len(views) == 1), drawn


def _volume_label(view: View, name: str, logarithmic: bool) -> str:
    if name == "cylinder_volume":
        return view.label("cylinder_volume")
    return "Volume over swept volume" if logarithmic else "Swept part of the stroke"


def _volume(view: View, name: str, place: Mapping[str, int], ratio: float | None) -> Floats:
    """Abscissa: cylinder volume, or volume over swept volume from the travel of the piston."""
    values = trace(view, name, place)[1]
    if name == "cylinder_volume":
        return values
    swept = values / np.nanmax(values)
    return swept if ratio is None else swept + 1.0 / (ratio - 1.0)


def _ratio(view: View, place: Mapping[str, int]) -> float | None:
    """Compression ratio at a place, from an axis or from the scene; None if unknown."""
    if "compression_ratio" in view.data.coords:
        value = view.at("compression_ratio", place)
        return float(value.values) if value.ndim == 0 else None
    try:
        ratio = float(json.loads(view.data.attrs["parameters"])["compression_ratio"])
    except (KeyError, TypeError, ValueError):
        return None
    return ratio if 1.0 < ratio < 1e3 else None


def _work_lines(panel: Axes, view: View, abscissa: str, axis: StudyAxis, entries: Entries) -> None:
    """Draw one loop for each value of an axis."""
    places = axis.picked()
    for rank, index in enumerate(places):
        place = axis.place(index)
        _, p, lost = trace(view, "pressure", place)
        nominal = axis.mark(index)
        style = line_style(rank, len(places), bool(nominal))
        style["markevery"] = max(p.size // 8, 1)
        if len(places) == 1:
            style["marker"] = ""
        volume = p if lost else _volume(view, abscissa, place, _ratio(view, place))
        line_or_mark(panel, (volume, p, lost), style, axis.text(index) + nominal, rank, entries)


def _logarithmic(panel: Axes) -> None:
    set_log(panel, "x")
    set_log(panel, "y")


# --- one recording -----------------------------------------------------------------------------


def recorded_names(view: View) -> list[str]:
    """Variables of an evaluated recording (`sweeps.lab.pressure.evaluation`)."""
    if not (over_angle(view, "pressure") and over_angle(view, SHEET[0])):
        return []
    return ["pressure", *(n for n in (*VOLUMES, *SHEET) if view.has(n))]


def recording_sheet(study: Study, names: Sequence[str]) -> NamedFigures:
    """Draw one page about a recording: pressure, work diagrams, heat release, spread of cycles."""
    view = study.view
    draws: list[Callable[..., Drawn]] = [_whole_cycle, _near_dead_centre, _over_volume]
    if any(view.has(name) for name in VOLUMES[:2]):
        draws.append(_log_log)
    if view.has("heat_released"):
        draws += [
            partial(_heat, name="heat_release_rate", title="Rate of apparent heat release"),
            partial(_heat, name="heat_released", title="Apparent net heat released"),
        ]
    if "recorded_cycle" in view.array(SHEET[0]).dims:
        draws += [_imep, _peaks]
    sheet = multiples(len(draws), 0.4, 2.1, columns=2)
    for panel, draw in zip(sheet.panels, draws, strict=True):
        title, ordinate = draw(panel, view, sheet.entries)
        panel.set_title(title)
        y_label(panel, view.label(ordinate), 1.7)
    attributes = view.data.attrs
    checks = [_sentence(line) for line in str(attributes.get("findings", "")).split("\n") if line]
    caption = " ".join(checks)
    title = str(attributes.get("title", "")) or "Recorded pressure"
    notes = str(attributes.get("summary", "")).split("; ")
    yield "recorded_pressure", sheet.finish(title, notes, caption)


def _sentence(finding: str) -> str:
    """A finding of the checks as a sentence: its name in words, and a stop at its end."""
    name, _, text = finding.partition(": ")
    said = f"{sentence(name.replace('_', ' '))}: {text}" if text else sentence(name)
    return said if said.endswith(("?", ".")) else f"{said}."


Drawn = tuple[str, str]  # Title of a panel, and the variable of its ordinate


def _cycles(view: View) -> Floats:
    """Pressure of all cycles, shape (cycles, angles)."""
    array = view.array(SHEET[0])
    if "recorded_cycle" not in array.dims:
        return np.atleast_2d(array.values)
    return np.asarray(array.transpose("recorded_cycle", "crank_angle").values)


def _near(view: View) -> Booleans:
    """Whether crank angles are near firing dead centre."""
    angle = view.numbers("crank_angle")
    return (angle >= NEAR[0]) & (angle <= NEAR[1])


def _pressure_lines(panel: Axes, view: View, entries: Entries, at: Booleans, band: bool) -> None:
    """Draw single cycles and their mean at some angles; `band` has 90 % of many cycles."""
    angle, every = view.numbers("crank_angle")[at], _cycles(view)[:, at]
    some = every[pick(len(every), 60)]  # More lines of single cycles would become one grey surface
    if len(every) > 1:
        lines = panel.plot(angle, some.T, color="#b0b0b0", linewidth=0.4, rasterized=True, zorder=1)
        entries.setdefault(f"single cycles ({len(some)} shown)", lines[0])
        if len(every) >= 20 and band:
            for edge in np.percentile(every, [5.0, 95.0], axis=0):
                (line,) = panel.plot(
                    angle, edge, color="#d1541b", linewidth=0.8, linestyle=(0, (4, 1.5))
                )
                entries.setdefault("5 and 95 % of the cycles", line)
    (line,) = panel.plot(angle, view.numbers("pressure")[at], color=MEAN, linewidth=1.2, zorder=3)
    entries.setdefault("mean of the cycles" if len(every) > 1 else "recorded cycle", line)


def _whole_cycle(panel: Axes, view: View, entries: Entries) -> Drawn:
    angle = view.numbers("crank_angle")
    _pressure_lines(panel, view, entries, np.ones(angle.size, dtype=bool), False)
    panel.set_xlim(float(angle[0]), float(2.0 * angle[-1] - angle[-2]))
    crank_axis(panel, view.array("crank_angle"), 2.7)
    return "Whole cycle", "pressure"


def _near_dead_centre(panel: Axes, view: View, entries: Entries) -> Drawn:
    _pressure_lines(panel, view, entries, _near(view), True)
    _near_axis(panel, view)
    return "Around firing dead centre", "pressure"


def _near_axis(panel: Axes, view: View) -> None:
    panel.set_xlim(*NEAR)
    panel.set_xticks(np.arange(NEAR[0], NEAR[1] + 1.0, 30.0))
    panel.axvline(0.0, color="#b8b8b8", linewidth=0.6, zorder=0.5)
    x_label(panel, view.label("crank_angle"), 2.9)


def _loop(panel: Axes, view: View) -> tuple[Floats, Floats]:
    """Closed loop of volume and mean pressure; the abscissa gets its label."""
    volume = next(name for name in VOLUMES if view.has(name))
    x_label(panel, view.label(volume), 2.9)
    v, p = view.numbers(volume), view.numbers("pressure")
    return np.append(v, v[0]), np.append(p, p[0])


def _over_volume(panel: Axes, view: View, entries: Entries) -> Drawn:
    panel.plot(*_loop(panel, view), color=MEAN)
    panel.set_xlim(left=0.0)
    panel.set_ylim(bottom=0.0)
    return "p - V", "pressure"


def _log_log(panel: Axes, view: View, entries: Entries) -> Drawn:
    """Draw the loop on logarithmic axes, with the fitted polytropes."""
    v, p = _loop(panel, view)
    if not np.all(p > 0.0):
        panel.text(0.5, 0.5, "pressure is not positive", transform=panel.transAxes, ha="center",
                   color=GREY)  # fmt: skip
    else:
        panel.plot(v, p, color=MEAN)
    angle = np.append(view.numbers("crank_angle"), np.nan)
    for name, colour, dashes in (
        ("compression_exponent", "#1b4f9c", (0, (4, 1.2, 1, 1.2))),
        ("expansion_exponent", "#2f7d55", (0, (6, 1.5))),
    ):
        exponent = float(view.numbers(name)) if view.has(name) else 0.0
        # No gas has a polytropic exponent outside these limits.
        if not 0.0 < exponent < 5.0:
            continue
        start, end = (float(view.array(name).attrs[key]) for key in ("from_angle", "to_angle"))
        at = (angle >= start) & (angle <= end) & (p > 0.0)
        level = np.exp(np.mean(np.log(p[at] * v[at] ** exponent)))
        wide = np.geomspace(np.nanmin(v), np.nanmax(v), 2)  # Over all volumes, so that bends show
        (line,) = panel.plot(wide, level * wide**-exponent, color=colour, linestyle=dashes,
                             linewidth=0.9, zorder=4)  # fmt: skip
        word = name.split("_")[0]
        text = f"{word}, exponent {exponent:.3f} from {typeset(start)}° to {typeset(end)}°"
        entries.setdefault(text, line)
    low, high = float(np.nanmin(p)), float(np.nanmax(p))
    if low > 0.0:
        panel.set_ylim(0.8 * low, 1.3 * high)
    _logarithmic(panel)
    return "log p - log V", "pressure"


def _heat(panel: Axes, view: View, entries: Entries, name: str, title: str) -> Drawn:
    at = _near(view)
    panel.axhline(0.0, color="#888888", linewidth=0.6)
    panel.plot(view.numbers("crank_angle")[at], view.numbers(name)[at], color=MEAN)
    _near_axis(panel, view)
    return title, name


def _imep(panel: Axes, view: View, entries: Entries) -> Drawn:
    """Draw the imep of each cycle with its mean and standard deviation."""
    values = view.numbers("imep_of_cycle")
    mean, spread = float(values.mean()), float(values.std(ddof=1))
    panel.axhspan(mean - spread, mean + spread, color="#ececec", linewidth=0.0, zorder=0)
    panel.axhline(mean, color=MEAN, linewidth=0.8)
    panel.plot(view.numbers("recorded_cycle"), values, "o", markersize=2.5, color=shade(0.3))
    x_label(panel, "Recorded cycle", 2.9)
    return "Imep, mean and standard deviation", "imep_of_cycle"


def _peaks(panel: Axes, view: View, entries: Entries) -> Drawn:
    """Draw the largest pressure of each cycle over its angle."""
    angle, pressure = "peak_angle_of_cycle", "peak_pressure_of_cycle"
    x, y = view.numbers(angle), view.numbers(pressure)
    panel.plot(x, y, "o", markersize=2.5, color=shade(0.3))
    x_label(panel, view.label(angle), 2.9)
    return "Largest pressure over its angle", pressure
