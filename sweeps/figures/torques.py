"""Torques over the cycle: their components, and the speed that they cause."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from sweeps.figures.marks import DASHES, lost_handle, mark_lost
from sweeps.figures.scales import comparable, left_labels, y_label
from sweeps.figures.sheet import (
    OWN_ORDINATES,
    Entries,
    NamedFigures,
    bare_panels,
    finish,
    grid_of,
    lowest_panels,
    new_sheet,
    rc,
)
from sweeps.figures.study import Study
from sweeps.figures.traces import draw_curves, over_angle, set_cycle, trace
from sweeps.figures.views import View, key_text, pick, picked_text, stem_of
from sweeps.figures.wording import axis_label, symbol_of, title_of, unit_in_brackets

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


COMPONENTS = ("gas_torque", "inertia_torque", "friction_torque")
LOAD_LAW = ("load_exponent", "load_offset")
TORQUES: dict[str, tuple[str, Any, float]] = {
    "torque": ("#000000", "-", 1.6),
    "gas_torque": ("#d1541b", (0, (6, 1.5)), 1.2),
    "inertia_torque": ("#1b4f9c", (0, (4, 1.2, 1, 1.2)), 1.2),
    "friction_torque": ("#c79a1e", (0, (1.2, 1)), 1.4),
    "load_torque": ("#2f7d55", (0, (3, 1, 1, 1, 1, 1)), 1.6),
}
"""Colour, dashes and width of each torque, in all figures; lightness differs as well as hue."""


def component_names(view: View) -> list[str]:
    """Components of the torque, their sum and the load torque, if a component is a curve."""
    if not any(over_angle(view, name) for name in COMPONENTS):
        return []
    return [name for name in (*COMPONENTS, "torque", "load_torque") if view.has(name)]


def torque_components(study: Study, names: Sequence[str]) -> NamedFigures:
    """Draw gas, inertia and friction torque with their sum: nominal, and along each axis."""
    sums = [name for name in names if name != "load_torque"]
    load = [name for name in names if name == "load_torque" and over_angle(study.view, name)]
    title = "Components of the torque"
    view = study.view.only(sums, ())
    figure, panels = new_sheet(1, 1, 3.3)
    entries: Entries = {}
    _torque_lines(panels[0], view, sums, {}, entries)
    set_cycle(panels, view, 4.6, panels)
    y_label(panels[0], "Torque" + unit_in_brackets(view.array(sums[0])), 2.8)
    notes = view.notes(sums)
    yield "torque_components", finish(figure, title, notes, entries, caption=view.caption)
    for whole, along in study.along([*sums, *load]):
        if along is None:
            continue
        if whole.varies(sums, along):
            yield _components_along(whole, [*sums, *load], along, title)
        elif load and along in LOAD_LAW:
            yield _load_law(whole, sums, along, title)


def _components_along(
    whole: View, names: Sequence[str], along: str, title: str
) -> tuple[str, Figure]:
    """Small multiples: one panel of components for each value of an axis."""
    view = whole.only(names, [along])
    axis = view.axis(along)
    picked = pick(axis.size, 6, axis.nominal)
    rows, columns = grid_of(len(picked))
    traced = [name for name in names if over_angle(view, name)]
    share = comparable([[trace(view, name, {along: i})[1] for name in traced] for i in picked])
    figure, panels = new_sheet(rows, columns, 0.5 + 1.75 * rows, sharex=True, sharey=share)
    entries: Entries = {}
    for panel, index in zip(panels, picked, strict=False):
        _torque_lines(panel, view, names, {along: index}, entries)
        panel.set_title(axis.tag(index) + (" (nominal)" if index == axis.nominal else ""))
    bare_panels(panels, len(picked), columns)
    lowest = lowest_panels(panels, len(picked), columns)
    set_cycle(panels[: len(picked)], view, 6.3 / columns, lowest)
    left_labels(panels, columns, "Torque" + unit_in_brackets(view.array(names[0])), 1.5)
    notes = [*view.notes(names), picked_text(axis, 6)]
    if not share:
        notes.append(OWN_ORDINATES)
    stem = stem_of("torque_components", view, along)
    title = f"{title} by {key_text(axis)}"
    spare = panels[len(picked) :]
    return stem, finish(
        figure, title, notes, entries, caption=view.caption, below=True, spare=spare
    )


def _load_law(whole: View, sums: Sequence[str], along: str, title: str) -> tuple[str, Figure]:
    """Where only the load torque changes: components once, load torque for each value."""
    view = whole.only([*sums, "load_torque"], [along])
    axis = view.axis(along)
    figure, panels = new_sheet(2, 1, 4.9, sharex=True)
    entries: Entries = {}
    _torque_lines(panels[0], view, sums, {along: axis.nominal or 0}, entries)
    lines: Entries = {}
    draw_curves(panels[1], view, "load_torque", axis, {}, lines)
    set_cycle(panels, view, 4.6, panels[-1:])
    y_label(panels[0], "Torque" + unit_in_brackets(view.array(sums[0])), 2.0)
    y_label(panels[1], axis_label(view.array("load_torque"), "load_torque"), 2.0)
    panels[0].set_title(f"the same for every {key_text(axis)}")
    for text, line in lines.items():
        sign = "" if axis.words else f"{symbol_of(axis.variable) or key_text(axis)} = "
        entries[f"Load torque, {sign}{text}"] = line
    notes = [*view.notes([*sums, "load_torque"]), picked_text(axis)]
    stem = stem_of("torque_components", view, along)
    return stem, finish(
        figure, f"{title} by {key_text(axis)}", notes, entries, caption=view.caption
    )


def torque_and_speed_names(view: View) -> list[str]:
    """Torque, load torque if it is a curve, and speed; nothing if torque or speed is missing."""
    if not all(over_angle(view, name) for name in ("torque", "omega")):
        return []
    return [name for name in ("torque", "load_torque", "omega") if over_angle(view, name)]


def torque_and_speed(study: Study, names: Sequence[str]) -> NamedFigures:
    """Draw total torque, load torque and, on the other side, the speed that they cause."""
    view = study.view.only(names, ())
    figure, panels = new_sheet(1, 1, 3.3)
    left = panels[0]
    right = left.twinx()
    entries: Entries = {}
    torques = [name for name in names if name != "omega"]
    _torque_lines(left, view, torques, {}, entries)
    x, torque, _ = trace(view, "torque", {})
    if "load_torque" in names:
        # the load may have a gap where the passes start: interpolated for the shading alone
        angle, load, lost = trace(view, "load_torque", {})
        if not lost:
            known = np.isfinite(load)
            load = np.interp(x, angle[known], load[known])
            above = left.fill_between(
                x, torque, load, where=torque > load, interpolate=True, color="#d9d9d9", linewidth=0
            )
            below = left.fill_between(
                x,
                torque,
                load,
                where=torque < load,
                interpolate=True,
                facecolor="white",
                edgecolor="#bdbdbd",
                hatch="////",
                linewidth=0,
            )
            entries["Excess of work: speed rises"] = above
            entries["Deficit of work: speed falls"] = below
    x, speed, lost = trace(view, "omega", {})
    label = title_of(view.array("omega"), "omega") + " (right)"
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
    set_cycle(panels, view, 4.4, panels)
    y_label(left, "Torque" + unit_in_brackets(view.array("torque")), 2.8)
    y_label(right, axis_label(view.array("omega"), "omega"), 2.8)
    notes = view.notes(names)
    yield (
        "torque_and_speed",
        finish(
            figure,
            "Torque, load torque and speed" if "load_torque" in names else "Torque and speed",
            notes,
            entries,
            caption=view.caption,
            below=True,
        ),
    )


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
    for whole, along in study.along(names):
        if along != "cylinders":
            continue
        view = whole.only(names, [along])
        axis = view.axis(along)
        picked = pick(axis.size, 6, axis.nominal)
        figure, panels = new_sheet(
            len(picked), 2, 0.8 + 1.15 * len(picked), sharex=True, sharey="col"
        )
        entries: Entries = {}
        for row, index in enumerate(picked):
            for panel, name in zip(panels[2 * row :], names, strict=False):
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
            text = axis_label(view.array(name), name)
            panel.set_title(f"{text}\n{panel.get_title(loc='left')}", linespacing=1.5)
        notes = [*view.notes(names), picked_text(axis, 6)]
        title = "Torque and speed for different numbers of cylinders"
        yield (
            stem_of("cylinders", view, None),
            finish(figure, title, notes, entries, caption=view.caption, below=True),
        )


def _torque_lines(
    panel: Axes, view: View, names: Sequence[str], index: Mapping[str, int], entries: Entries
) -> None:
    """Torques in their own colours; friction is drawn as it acts, against the rotation."""
    for name in names:
        variable = view.array(name)
        colour, dashes, width = TORQUES[name]
        sign = -1.0 if name == "friction_torque" else 1.0
        label = ("\N{MINUS SIGN}" if sign < 0 else "") + title_of(variable, name)
        if colour == "#000000":
            colour = rc("text.color")  # white where the paper is dark
        style: dict[str, Any] = {"color": colour, "linestyle": dashes, "linewidth": width}
        if "crank_angle" in variable.dims:
            x, y, lost = trace(view, name, index)
        else:
            array = variable.isel({d: i for d, i in index.items() if d in variable.dims})
            x = np.asarray(view.array("crank_angle").values[[0, -1]], dtype=float)
            y = np.full(2, float(array.values))
            lost = "" if np.isfinite(y[0]) else str(view.outcomes(name, array, index))
        if lost:
            mark_lost(panel, lost, colour)
            entries.setdefault(f"{label}: {lost}", lost_handle(lost, colour))
        else:
            (line,) = panel.plot(x, sign * y, **style)
            entries.setdefault(label, line)
