"""Torques over the cycle: their components, and the speed that they cause."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from engine_dyn.types import Floats
from sweeps.view.figures.marks import DASHES, lost_handle, mark_lost
from sweeps.view.figures.scales import y_label
from sweeps.view.figures.sheet import Entries, NamedFigures, finish, new_sheet, rc
from sweeps.view.figures.study import Study
from sweeps.view.figures.together import MOST_PANELS, together
from sweeps.view.figures.traces import (
    FRICTION,
    draw_curves,
    draw_lines,
    over_angle,
    set_cycle,
    trace,
)
from sweeps.view.figures.views import View, stem_of
from sweeps.view.figures.wording import symbol_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


COMPONENTS = ("gas_torque", "inertia_torque", FRICTION)
LOAD_LAW = ("load_exponent", "load_offset")
TORQUES: dict[str, tuple[str, Any, float]] = {
    "torque": ("", "-", 1.6),
    "gas_torque": ("#d1541b", (0, (6, 1.5)), 1.2),
    "inertia_torque": ("#1b4f9c", (0, (4, 1.2, 1, 1.2)), 1.2),
    FRICTION: ("#c79a1e", (0, (1.2, 1)), 1.4),
    "load_torque": ("#2f7d55", (0, (3, 1, 1, 1, 1, 1)), 1.6),
}
"""Colour (that of text if empty), dashes and width of each torque, in all figures; lightness
differs as well as hue."""


def _look(name: str) -> dict[str, Any]:
    colour, dashes, width = TORQUES[name]
    return {"color": colour or rc("text.color"), "linestyle": dashes, "linewidth": width}


def component_names(view: View) -> list[str]:
    """Components of the torque, their sum and the load torque, if a component is a curve."""
    if not any(over_angle(view, name) for name in COMPONENTS):
        return []
    return [name for name in (*COMPONENTS, "torque", "load_torque") if view.has(name)]


def torque_components(study: Study, names: Sequence[str]) -> NamedFigures:
    """Draw gas, inertia and friction torque with their sum: nominal, and along each axis."""
    sums = [name for name in names if name != "load_torque"]
    load = [name for name in names if name == "load_torque" and over_angle(study.view, name)]
    title, base = "Components of the torque", "torque_components"
    yield base, together(study.view, sums, None, title, "Torque", _look)
    for whole, along in study.views_by_axis([*sums, *load]):
        if along is None:
            continue
        if whole.varies(sums, along):
            drawn = together(whole, [*sums, *load], along, title, "Torque", _look)
            yield stem_of(base, whole, along), drawn
        elif load and along in LOAD_LAW:
            yield stem_of(base, whole, along), _load_law(whole, sums, along, title)


def _load_law(whole: View, sums: Sequence[str], along: str, title: str) -> Figure:
    """Where only the load torque changes: components once, load torque for each value."""
    view = whole.only([*sums, "load_torque"], [along])
    axis = view.axis(along)
    figure, panels = new_sheet(2, 1, 4.9, sharex=True)
    entries: Entries = {}
    draw_lines(panels[0], view, sums, {along: axis.nominal or 0}, entries, _look)
    lines: Entries = {}
    draw_curves(panels[1], view, "load_torque", axis, {}, lines)
    set_cycle(panels, view, 4.6, panels[-1:])
    y_label(panels[0], "Torque" + view.unit(sums[0]), 2.0)
    y_label(panels[1], view.label("load_torque"), 2.0)
    panels[0].set_title(f"the same for every {axis.called}")
    for text, line in lines.items():
        sign = "" if axis.words else f"{symbol_of(axis.variable) or axis.called} = "
        entries[f"Load torque, {sign}{text}"] = line
    notes = [*view.notes([*sums, "load_torque"]), axis.picked_text()]
    return finish(figure, axis.by(title), notes, entries, caption=view.caption)


def torque_and_speed_names(view: View) -> list[str]:
    """Torque, load torque if it is a curve, and speed; nothing if torque or speed is missing."""
    if not all(over_angle(view, name) for name in ("torque", "omega")):
        return []
    return [name for name in ("torque", "load_torque", "omega") if over_angle(view, name)]


def torque_and_speed(study: Study, names: Sequence[str]) -> NamedFigures:
    """Draw total torque, load torque and, on the other side, the speed that they cause."""
    view = study.view.only(names, ())
    figure, (left,) = new_sheet(1, 1, 3.3)
    right = left.twinx()
    entries: Entries = {}
    draw_lines(left, view, [name for name in names if name != "omega"], {}, entries, _look)
    x, torque, _ = trace(view, "torque", {})
    load = load_at(view, x) if "load_torque" in names else None
    if load is not None:
        shade_work(left, x, torque, load, entries)
    x, speed, lost = trace(view, "omega", {})
    label = view.title("omega") + " (right)"
    if lost:
        mark_lost(left, lost)
        entries[f"{label}: {lost}"] = lost_handle(lost)
        right.set_yticks([])
    else:
        (line,) = right.plot(x, speed, color="#7b2d8b", linestyle=(0, (3, 1)), linewidth=1.6)
        entries[label] = line
        right.margins(y=0.15)
    right.grid(False)
    right.spines["right"].set_visible(True)
    set_cycle([left], view, 4.4, [left])
    y_label(left, "Torque" + view.unit("torque"), 2.8)
    y_label(right, view.label("omega"), 2.8)
    title = "Torque, load torque and speed" if "load_torque" in names else "Torque and speed"
    drawn = finish(figure, title, view.notes(names), entries, caption=view.caption, below=True)
    yield "torque_and_speed", drawn


def load_at(view: View, x: Floats) -> Floats | None:
    """The load torque at crank angles; None where there is none.

    It may have a gap where the passes start, over which it is interpolated.
    """
    angle, load, lost = trace(view, "load_torque", {})
    known = np.isfinite(load)
    return None if lost else np.interp(x, angle[known], load[known])


def shade_work(panel: Axes, x: Floats, torque: Floats, load: Floats, entries: Entries) -> None:
    """Shade the areas between torque and load: the work that the rotating masses take and give."""
    for text, where, look in (
        ("Excess of work: speed rises", torque > load, {"color": "#d9d9d9"}),
        ("Deficit of work: speed falls", torque < load,
         {"facecolor": "white", "edgecolor": "#bdbdbd", "hatch": "////"}),
    ):  # fmt: skip
        style: dict[str, Any] = {"linewidth": 0, **look}
        area = panel.fill_between(x, torque, load, where=where, interpolate=True, **style)
        entries[text] = area


def cylinders_names(view: View) -> list[str]:
    """Torque and speed, where engines with different numbers of cylinders have them."""
    names = torque_and_speed_names(view)
    several = view.data.sizes.get("cylinders", 1) > 1 or (
        "cylinders" in view.data.coords and view.array("cylinders").dims == ("design",)
    )
    return names if several else []


def cylinders(study: Study, names: Sequence[str]) -> NamedFigures:
    """Draw engines of different numbers of cylinders: torque beside speed, a row for each."""
    names = [name for name in names if name != "load_torque"]
    for whole, along in study.views_by_axis(names):
        if along != "cylinders":
            continue
        view = whole.only(names, [along])
        axis = view.axis(along)
        rows = axis.picked(MOST_PANELS)
        figure, panels = new_sheet(len(rows), 2, 0.8 + 1.15 * len(rows), sharex=True, sharey="col")
        entries: Entries = {}
        for panel, (index, name) in zip(panels, ((i, n) for i in rows for n in names), strict=True):
            x, y, lost = trace(view, name, {along: index})
            panel.set_title(axis.tag(index) + (f": {lost}" if lost else ""))
            if lost:
                mark_lost(panel, lost)
                continue
            panel.plot(x, y, color="black", linewidth=1.1)
            mean = float(np.nanmean(y[:-1]))
            line = panel.axhline(mean, color="#c05a1c", linewidth=0.9, linestyle=DASHES[1])
            entries["Mean over the cycle"] = line
        set_cycle(panels, view, 3.0, panels[-2:])
        for panel, name in zip(panels[:2], names, strict=True):
            text = view.label(name)
            panel.set_title(f"{text}\n{panel.get_title(loc='left')}", linespacing=1.5)
        notes = [*view.notes(names), axis.picked_text(MOST_PANELS)]
        title = "Torque and speed for different numbers of cylinders"
        drawn = finish(figure, title, notes, entries, caption=view.caption, below=True)
        yield stem_of("cylinders", view, None), drawn
