"""Work diagrams: p-V and log p - log V of archives, and the sheet of a recorded pressure."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from engine_dyn.types import Floats
from sweeps.figures.marks import line_style, lost_handle, mark_lost, shade
from sweeps.figures.scales import crank_axis, log_ticks, x_label, y_label
from sweeps.figures.sheet import GREY, Entries, NamedFigures, bare_panels, finish, new_sheet
from sweeps.figures.study import Study
from sweeps.figures.traces import over_angle, trace
from sweeps.figures.views import MOST_LINES, StudyAxis, View, key_text, pick, picked_text, stem_of
from sweeps.figures.wording import number_text

if TYPE_CHECKING:
    from matplotlib.axes import Axes


PRESSURE, VOLUME, TRAVEL, RATIO = "pressure", "cylinder_volume", "position", "compression_ratio"

SHEET = (
    "pressure_of_cycle", "heat_release_rate", "heat_released", "imep_of_cycle",
    "peak_pressure_of_cycle", "peak_angle_of_cycle",
)  # fmt: skip
"""What the sheet of a recorded pressure draws beside mean pressure and volume."""

MOST_CYCLES = 60
"""Thin lines of single cycles; more are one grey surface."""

NEAR = (-60.0, 90.0)
"""Crank angles around firing dead centre, in degrees."""

MOST_EXPONENT = 5.0
"""A polytrope that is no gas's is not drawn."""

CYCLES, BAND, MEAN = "#b0b0b0", "#d1541b", "#000000"


# --- any archive -------------------------------------------------------------------------------


def work_names(view: View) -> list[str]:
    """Pressure and what it is drawn over: the volume, or the travel of the piston."""
    if not over_angle(view, PRESSURE) or recorded_names(view):
        return []
    over = [name for name in (VOLUME, TRAVEL) if over_angle(view, name)][:1]
    return [PRESSURE, *over] if over else []


def work_diagrams(study: Study, names: Sequence[str]) -> NamedFigures:
    """Draw p over V, and both logarithmic where the clearance volume is known."""
    # Axes that change the travel of the piston alone leave the loops nearly the same.
    found = study.along(names[:1])
    for whole, along in found:
        view = whole.only(names, [along])
        axis = view.axis(along) if along else None
        logarithmic = names[1] == VOLUME or _ratio(view, {along: 0} if along else {}) is not None
        figure, panels = new_sheet(1, 1 + logarithmic, 3.2)
        entries: Entries = {}
        _work_lines(panels[0], view, names[1], axis, entries, False)
        if logarithmic:
            _work_lines(panels[1], view, names[1], axis, {}, True)
            _logarithmic(panels[1])
        for panel in panels:
            y_label(panel, view.label(PRESSURE), 2.6)
            x_label(panel, _volume_label(view, names[1], logarithmic), 6.0 / len(panels))
        heading = "Work diagrams" + (f" by {key_text(axis)}" if axis else "")
        yield (
            stem_of("work_diagrams", view, along, len(found) == 1),
            finish(
                figure, heading, [*view.notes(names), picked_text(axis)], entries if axis else {},
                axis.label if axis else "", view.caption, below=True,
            ),
        )  # fmt: skip


def _volume_label(view: View, name: str, logarithmic: bool) -> str:
    if name == VOLUME:
        return view.label(VOLUME)
    return "Volume over swept volume" if logarithmic else "Swept part of the stroke"


def _volume(view: View, name: str, place: Mapping[str, int], ratio: float | None) -> Floats:
    """Abscissa: the volume itself, or from the piston's travel over the swept volume."""
    values = trace(view, name, place)[1]
    if name == VOLUME:
        return values
    swept = values / np.nanmax(values)
    return swept if ratio is None else swept + 1.0 / (ratio - 1.0)


def _ratio(view: View, place: Mapping[str, int]) -> float | None:
    """Compression ratio at a place: of an axis, or what the scene sets; None if not known."""
    if RATIO in view.data.coords:
        array = view.data.coords[RATIO]
        value = array.isel({d: i for d, i in place.items() if d in array.dims})
        return float(value) if value.ndim == 0 else None
    try:
        ratio = float(json.loads(view.data.attrs["parameters"])[RATIO])
    except (KeyError, TypeError, ValueError):
        return None
    return ratio if 1.0 < ratio < 1e3 else None


def _work_lines(
    panel: Axes, view: View, abscissa: str, axis: StudyAxis | None, entries: Entries, closed: bool
) -> None:
    """One loop for each value of an axis; of the closed cylinder's half if `closed`."""
    picked = pick(axis.size, MOST_LINES, axis.nominal) if axis else [0]
    for rank, index in enumerate(picked):
        place = {axis.name: index} if axis else {}
        _, p, lost = trace(view, PRESSURE, place)
        nominal = axis is not None and index == axis.nominal
        style = line_style(rank, len(picked), nominal)
        text = (axis.text(index) if axis else "") + (" (nominal)" if nominal else "")
        if lost:
            mark_lost(panel, lost, style["color"], rank)
            entries.setdefault(f"{text}: {lost}", lost_handle(lost, style["color"]))
            continue
        volume = _volume(view, abscissa, place, _ratio(view, place))
        style["markevery"] = max(p.size // 8, 1)
        if len(picked) == 1:
            style["marker"] = ""
        (line,) = panel.plot(volume, p, **style)
        entries.setdefault(text, line)


def _logarithmic(panel: Axes) -> None:
    panel.set_xscale("log")
    panel.set_yscale("log")
    for axis, limits in ((panel.xaxis, panel.get_xlim()), (panel.yaxis, panel.get_ylim())):
        log_ticks(axis, *limits)


# --- one recording -----------------------------------------------------------------------------


def recorded_names(view: View) -> list[str]:
    """Variables of an evaluated recording (`sweeps.reading.laboratory.evaluation`)."""
    if not (over_angle(view, PRESSURE) and over_angle(view, SHEET[0])):
        return []
    return [PRESSURE, *(n for n in (VOLUME, "displaced_volume", *SHEET) if view.has(n))]


def recording_sheet(study: Study, names: Sequence[str]) -> NamedFigures:
    """Draw one page about a recording: pressure, work diagrams, heat release, spread of cycles."""
    view = study.view
    many = "recorded_cycle" in view.array(SHEET[0]).dims
    volume = VOLUME if view.has(VOLUME) else "displaced_volume"
    draws = [_whole_cycle, _near_dead_centre, _over_volume]
    if view.has(VOLUME):
        draws.append(_log_log)
    if view.has("heat_released"):
        draws += [_heat_rate, _heat]
    if many:
        draws += [_imep, _peaks]
    rows = -(-len(draws) // 2)
    figure, panels = new_sheet(rows, 2, 0.4 + 2.1 * rows)
    entries: Entries = {}
    for panel, draw in zip(panels, draws, strict=False):
        draw(panel, view, volume, entries)
    bare_panels(panels, len(draws), 2)
    for panel in panels[: len(draws)]:
        y_label(panel, panel.get_ylabel(), 1.7)
    said = view.data.attrs.get("findings", "")
    yield (
        "recorded_pressure",
        finish(
            figure, str(view.data.attrs.get("title", "")) or "Recorded pressure",
            str(view.data.attrs.get("summary", "")).split("; "), entries,
            caption="; ".join(["Checks: " + line for line in str(said).split("\n") if line]),
            below=True,
        ),
    )  # fmt: skip


def _cycles(view: View) -> Floats:
    """Pressure of some cycles, shape (cycles, angles)."""
    array = view.array(SHEET[0])
    if "recorded_cycle" not in array.dims:
        return np.atleast_2d(array.values)
    values = array.transpose("recorded_cycle", "crank_angle").values
    return np.asarray(values[pick(len(values), MOST_CYCLES)])


def _angles(view: View) -> Floats:
    return view.numbers("crank_angle")


def _pressure_lines(panel: Axes, view: View, entries: Entries, near: bool) -> None:
    angle, mean = _angles(view), view.numbers(PRESSURE)
    every = _cycles(view)
    at = (angle >= NEAR[0]) & (angle <= NEAR[1]) if near else np.ones(angle.size, dtype=bool)
    if len(every) > 1:
        lines = panel.plot(
            angle[at], every[:, at].T, color=CYCLES, linewidth=0.4, rasterized=True, zorder=1
        )
        entries.setdefault(f"single cycles ({len(every)} shown)", lines[0])
        array = view.array(SHEET[0]).transpose("recorded_cycle", "crank_angle").values
        if len(array) >= 20 and near:
            low, high = np.percentile(array[:, at], [5.0, 95.0], axis=0)
            (edge,) = panel.plot(angle[at], low, color=BAND, linewidth=0.8, linestyle=(0, (4, 1.5)))
            panel.plot(angle[at], high, color=BAND, linewidth=0.8, linestyle=(0, (4, 1.5)))
            entries.setdefault("5 and 95 % of the cycles", edge)
    (line,) = panel.plot(angle[at], mean[at], color=MEAN, linewidth=1.2, zorder=3)
    entries.setdefault("mean of the cycles" if len(every) > 1 else "recorded cycle", line)


def _whole_cycle(panel: Axes, view: View, volume: str, entries: Entries) -> None:
    _pressure_lines(panel, view, entries, near=False)
    angle = _angles(view)
    panel.set_xlim(float(angle[0]), float(2.0 * angle[-1] - angle[-2]))
    panel.set_ylabel(view.label(PRESSURE))
    crank_axis(panel, view.array("crank_angle"), 2.7)
    panel.set_title("Whole cycle")


def _near_dead_centre(panel: Axes, view: View, volume: str, entries: Entries) -> None:
    _pressure_lines(panel, view, entries, near=True)
    _near_axis(panel, view)
    panel.set_ylabel(view.label(PRESSURE))
    panel.set_title("Around firing dead centre")


def _near_axis(panel: Axes, view: View) -> None:
    panel.set_xlim(*NEAR)
    panel.set_xticks(np.arange(NEAR[0], NEAR[1] + 1.0, 30.0))
    panel.axvline(0.0, color="#b8b8b8", linewidth=0.6, zorder=0.5)
    x_label(panel, view.label("crank_angle"), 2.9)


def _loop(view: View, volume: str) -> tuple[Floats, Floats]:
    v = view.numbers(volume)
    p = view.numbers(PRESSURE)
    return np.append(v, v[0]), np.append(p, p[0])


def _over_volume(panel: Axes, view: View, volume: str, entries: Entries) -> None:
    panel.plot(*_loop(view, volume), color=MEAN)
    panel.set_xlim(left=0.0)
    panel.set_ylim(bottom=0.0)
    panel.set_ylabel(view.label(PRESSURE))
    x_label(panel, view.label(volume), 2.9)
    panel.set_title("p - V")


def _log_log(panel: Axes, view: View, volume: str, entries: Entries) -> None:
    """Both logarithmic, with the polytropes that were fitted."""
    v, p = _loop(view, volume)
    if not np.all(p > 0.0):
        panel.text(0.5, 0.5, "pressure is not positive", transform=panel.transAxes, ha="center",
                   color=GREY)  # fmt: skip
    else:
        panel.plot(v, p, color=MEAN)
    angle = np.append(_angles(view), np.nan)
    for name, colour, dashes in (
        ("compression_exponent", "#1b4f9c", (0, (4, 1.2, 1, 1.2))),
        ("expansion_exponent", "#2f7d55", (0, (6, 1.5))),
    ):
        if not view.has(name):
            continue
        array = view.array(name)
        start, end = (float(array.attrs[key]) for key in ("from_angle", "to_angle"))
        exponent = float(array)
        if not 0.0 < exponent < MOST_EXPONENT:
            continue
        at = (angle >= start) & (angle <= end) & (p > 0.0)
        level = np.exp(np.mean(np.log(p[at] * v[at] ** exponent)))
        # drawn beyond the fitted part, so that a bend shows
        wide = np.geomspace(np.nanmin(v), np.nanmax(v), 2)
        (line,) = panel.plot(wide, level * wide**-exponent, color=colour, linestyle=dashes,
                             linewidth=0.9, zorder=4)  # fmt: skip
        word = name.split("_")[0]
        text = f"{word}, exponent {exponent:.3f} from {number_text(start)}° to {number_text(end)}°"
        entries.setdefault(text, line)
    low, high = float(np.nanmin(p)), float(np.nanmax(p))
    if low > 0.0:
        panel.set_ylim(0.8 * low, 1.3 * high)
    _logarithmic(panel)
    panel.set_ylabel(view.label(PRESSURE))
    x_label(panel, view.label(volume), 2.9)
    panel.set_title("log p - log V")


def _heat_panel(panel: Axes, view: View, name: str, title: str) -> None:
    angle, values = _angles(view), view.numbers(name)
    at = (angle >= NEAR[0]) & (angle <= NEAR[1])
    panel.axhline(0.0, color="#888888", linewidth=0.6)
    panel.plot(angle[at], values[at], color=MEAN)
    _near_axis(panel, view)
    panel.set_ylabel(view.label(name))
    panel.set_title(title)


def _heat_rate(panel: Axes, view: View, volume: str, entries: Entries) -> None:
    _heat_panel(panel, view, "heat_release_rate", "Rate of apparent heat release")


def _heat(panel: Axes, view: View, volume: str, entries: Entries) -> None:
    _heat_panel(panel, view, "heat_released", "Apparent net heat released")


def _imep(panel: Axes, view: View, volume: str, entries: Entries) -> None:
    """Imep of each cycle with its mean and standard deviation."""
    values = view.numbers("imep_of_cycle")
    number = view.numbers("recorded_cycle")
    mean, spread = float(values.mean()), float(values.std(ddof=1))
    panel.axhspan(mean - spread, mean + spread, color="#ececec", linewidth=0.0, zorder=0)
    panel.axhline(mean, color=MEAN, linewidth=0.8)
    panel.plot(number, values, linestyle="none", marker="o", markersize=2.5, color=shade(0.3))
    panel.set_ylabel(view.label("imep_of_cycle"))
    x_label(panel, "Recorded cycle", 2.9)
    panel.set_title("Imep, mean and standard deviation")


def _peaks(panel: Axes, view: View, volume: str, entries: Entries) -> None:
    """Largest pressure of each cycle over its angle."""
    pressure, angle = "peak_pressure_of_cycle", "peak_angle_of_cycle"
    panel.plot(
        np.asarray(view.array(angle).values), np.asarray(view.array(pressure).values),
        linestyle="none", marker="o", markersize=2.5, color=shade(0.3),
    )  # fmt: skip
    panel.set_ylabel(view.label(pressure))
    x_label(panel, view.label(angle), 2.9)
    panel.set_title("Largest pressure over its angle")
