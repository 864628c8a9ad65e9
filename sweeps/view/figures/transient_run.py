"""A speed that does not repeat: over the time, with fuel command and load, and over the angle."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from sweeps.base.files.numbers_with_units import factor_between
from sweeps.view.figures.marks import LIMIT_LOOK, line_style, lost_handle, lost_look
from sweeps.view.figures.sheet import Entries, NamedFigures, finish, new_sheet, x_label, y_label
from sweeps.view.figures.study import Study
from sweeps.view.figures.views import SOUND, StudyAxis, View, meanings_of, pick, stem_of
from sweeps.view.figures.wording import sentence

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MOST_RUNS = 4  # Lines of one panel: they cross each other

RUNS: dict[str, tuple[str, tuple[str, ...]]] = {
    "transient_run": ("run_time", ("run_speed", "run_command", "run_load")),
    "transient_cycles": (
        "transient_time",
        ("transient_mean_speed", "transient_command", "transient_fuel", "transient_load",
         "transient_delta"),
    ),
}  # fmt: skip
"""Figures over the time: its variable, and what they have panels of, the speed first."""

SPAN = ("transient_lowest_speed", "transient_highest_speed")

JUDGED = (("settled_speed", "Recovery band around the speed at the end"),
          ("speed_before_change", "Limit of fall or rise from the speed before"))  # fmt: skip
"""Speeds from which changes of load are judged, and what is drawn about them."""

RUN_NAMES = (
    *(name for time, panels in RUNS.values() for name in (*panels, time)),
    *SPAN, *(name for name, _ in JUDGED), "status",
)  # fmt: skip
"""Variables of which figures over the time are made."""

TURNS = 720.0  # Crank angle of a phase [degree]: a cycle, or two of a two-stroke engine


def run_names(view: View) -> list[str]:
    """Variables over the time of recorded cycles, or over the ends of cycles."""
    names: list[str] = []
    for time, panels in RUNS.values():
        present = [name for name in panels if view.has(name)]
        names += [*present, time] if present and view.has(time) else []
    return names


def transient_run(study: Study, names: Sequence[str]) -> NamedFigures:
    """Draw the speed over the time, and what else there is beneath it: a figure for each axis."""
    for stem, (time, panels) in RUNS.items():
        present = [name for name in panels if name in names]
        for whole, along in study.views_by_axis(present) if present and time in names else ():
            judged = [name for name, _ in JUDGED if whole.has(name)]
            view = whole.only([*present, time, *judged], [along, "load_change"])
            yield stem_of(stem, view, along), _over_time(view, time, present, view.axis(along))


def _over_time(view: View, time: str, names: Sequence[str], axis: StudyAxis) -> Figure:
    heights = [2.4 if name.endswith("speed") else 1.3 for name in names]
    figure, panels = new_sheet(
        len(names), 1, 0.4 + sum(heights), sharex=True, gridspec_kw={"height_ratios": heights}
    )
    entries: Entries = {}
    ends: Entries = {}
    shaded = names[0] == "transient_mean_speed" and all(map(view.has, SPAN))
    places = axis.picked(MOST_RUNS)
    for rank, index in enumerate(places):
        at = axis.place(index)
        x, colour, why = view.numbers(time, at), line_style(rank, len(places))["color"], ""
        if view.has("status") and view.at("status", at).ndim == 0:
            code = int(view.numbers("status", at))
            why = "" if code in SOUND else meanings_of(view.array("status"))[code]
        for name, panel in zip(names, panels, strict=True):
            y = view.numbers(name, at)
            (drawn,) = panel.plot(x, y, color=colour, linewidth=1.0, zorder=2.5 - 0.1 * rank)
            there = np.flatnonzero(np.isfinite(x + y))[-1:]
            if why:
                panel.plot(x[there], y[there], clip_on=False, zorder=4, **lost_look(why, colour))
                ends[sentence(why)] = lost_handle(why)
        if shaded:
            low, high = (view.numbers(end, at) for end in SPAN)
            panels[0].fill_between(x, low, high, color=colour, alpha=0.22, linewidth=0.0)
        if names[0].endswith("speed") and np.isfinite(x).any():
            _draw_limits(panels[0], view, names[0], at, float(np.nanmax(x)), entries)
        if axis:
            entries[axis.text(index) + axis.mark(index)] = drawn
    for name, panel, height in zip(names, panels, heights, strict=True):
        y_label(panel, view.label(name), height)
        panel.margins(x=0.0)
    x_label(panels[-1], view.label(time), 6.0)
    notes = [*view.notes([*names, time]), axis.picked_text(MOST_RUNS)]
    notes += ["shaded from the lowest to the highest speed of each cycle"] if shaded else []
    title = axis.by("Speed over the time")
    return finish(figure, title, notes, entries | ends, axis.label, view.caption, below=True)


def _draw_limits(
    panel: Axes, view: View, name: str, at: Mapping[str, int], last: float, entries: Entries
) -> None:  # fmt: skip
    """Draw what each change of load is judged by, from there to the next, or to the fuel cut."""
    limits = json.loads(view.data.attrs.get("transient_limits", "{}"))
    begins = np.array(limits.get("changes", ()), dtype=float)
    nominal = _given(view, "speed", at, "rpm", view.array(name).attrs["units"])
    ends = np.fmin(np.append(begins[1:], last), _given(view, "transient_fuel_cut", at, "s", "s"))
    for about, words in JUDGED if begins.size and np.isfinite(nominal) else ():
        levels = view.numbers(about, at) if view.has(about) else begins * np.nan
        for level, begin, end in zip(levels, begins, ends, strict=True):
            if not np.isfinite(level):
                continue  # It is not judged
            if about == "settled_speed":
                half = 0.005 * limits["band"] * nominal
                entries[words] = panel.fill_between(
                    [begin, end], level - half, level + half, color="#e3e3e3", linewidth=0.0,
                    zorder=0,
                )  # fmt: skip
                continue
            look: dict[str, Any] = {**LIMIT_LOOK, "linestyle": (0, (1.2, 1.6))}
            for share in (-limits["fall"], limits["rise"]):
                (entries[words],) = panel.plot([begin, end], 2 * [level + 0.01 * share * nominal],
                                               **look)  # fmt: skip


def _given(view: View, key: str, at: Mapping[str, int], unit: str, wanted: str) -> float:
    """Value of a parameter in a run, NaN where the archive does not have it."""
    value = json.loads(view.data.attrs.get("parameters", "{}")).get(key)
    if key in view.data.coords:
        value, unit = float(view.numbers(key, at)), view.array(key).attrs["units"]
    factor = factor_between(unit, wanted)
    return np.nan if value is None or factor is None else factor * value


def phase_names(view: View) -> list[str]:
    """Speed over the crank angle of recorded cycles."""
    names = ["run_speed", "run_angle"]
    return names if all(map(view.has, names)) else []


def transient_phase(study: Study, names: Sequence[str]) -> NamedFigures:
    """Draw the speed over two turns: the first, some between, and the last recorded ones."""
    for whole, along in study.views_by_axis(["run_speed"]):
        view = whole.only(names, [along])
        axis, turned = view.axis(along), view.numbers("run_angle")
        if np.isnan(turned).all():
            continue
        first = float(np.nanmin(turned))
        shown = pick(round((float(np.nanmax(turned)) - first) / TURNS), 3)
        if not shown:
            continue
        figure, panels = new_sheet(1, len(shown), 2.9, sharey=True)
        entries: Entries = {}
        places = axis.picked(MOST_RUNS)
        for panel, span in zip(panels, shown, strict=True):
            begin = first + span * TURNS
            for rank, index in enumerate(places):
                angle = view.numbers("run_angle", axis.place(index)) - begin
                here = (angle >= -1e-3) & (angle <= TURNS + 1e-3)
                y = view.numbers("run_speed", axis.place(index))
                look = line_style(rank, len(places)) | {"marker": ""}
                (drawn,) = panel.plot(angle[here], y[here], **look)
                if axis:
                    entries[axis.text(index) + axis.mark(index)] = drawn
            panel.set_xlim(0.0, TURNS)
            panel.set_xticks(np.arange(0.0, TURNS + 1.0, 180.0))
            panel.set_title(f"Turns {begin / 360.0 + 1.0:.0f} and {begin / 360.0 + 2.0:.0f}")
            x_label(panel, "Crank angle (degree)", 6.0 / len(shown))
        y_label(panels[0], view.label("run_speed"), 2.4)
        notes = [*view.notes(names), axis.picked_text(MOST_RUNS)]
        title = axis.by("Speed over two turns of the crank")
        finish(figure, title, notes, entries, axis.label, view.caption, below=True)
        yield stem_of("transient_phase", view, along), figure
