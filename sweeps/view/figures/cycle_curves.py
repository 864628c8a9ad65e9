"""Curves over the crank angle: motion, pressure, forces and torques, and any other variable."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from engine_dyn.types import Floats
from sweeps.base.dimensions import COUNTED
from sweeps.view.figures.angle_lines import (
    FRICTION,
    draw_curves,
    draw_lines,
    load_at,
    over_angle,
    set_cycle,
    shade_work,
    trace,
)
from sweeps.view.figures.marks import DASHES, lost_handle, mark_lost
from sweeps.view.figures.scales import comparable, crank_axis, set_log
from sweeps.view.figures.sheet import (
    GREY,
    OWN_ORDINATES,
    Entries,
    Multiples,
    NamedFigures,
    finish,
    multiples,
    new_sheet,
    rc,
    y_label,
)
from sweeps.view.figures.study import Study
from sweeps.view.figures.views import MOST_LINES, MOST_PANELS, StudyAxis, View, facet_of, stem_of
from sweeps.view.figures.wording import middle_of_sentence, symbol_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


MOST_TOGETHER = 6

GROUPS: dict[str, tuple[str, str, tuple[str, ...]]] = {
    "piston_forces": (
        "Forces on the piston", "Force", ("gas_force", "inertia_force", "piston_force")
    ),
    "rod_loads": (
        "Rod loads", "Load, compression positive",
        ("gas_force", "crosshead_inertia_load", "combined_rod_load"),
    ),
    "mechanism_forces": (
        "Forces of the mechanism", "Force",
        ("wall_thrust", "rod_force", "tangential_force", "radial_force"),
    ),
    "mechanism_pressures": (
        "Forces of the mechanism over piston area", "Reduced force",
        ("piston_pressure", "wall_pressure", "rod_pressure", "tangential_pressure",
         "radial_pressure"),
    ),
    "shortened_acceleration": (
        "Acceleration, exact and by the truncated series,", "Reduced acceleration",
        ("acceleration", "acceleration_truncated"),
    ),
    **{
        f"{name}_parts": (
            f"{title} of gas and masses", "Force", (f"gas_{name}", f"inertia_{name}", name)
        )
        for name, title in (
            ("wall_thrust", "Wall thrust"), ("rod_force", "Rod force"),
            ("tangential_force", "Tangential force"), ("radial_force", "Radial force"),
        )
    },
    **{
        f"{name}_pressure_parts": (
            f"{title} of gas and masses over piston area", "Reduced force",
            (f"gas_{name}_pressure", f"inertia_{name}_pressure", f"{name}_pressure"),
        )
        for name, title in (
            ("piston", "Forces"), ("wall", "Wall thrust"), ("rod", "Rod force"),
            ("tangential", "Tangential force"), ("radial", "Radial force"),
        )
    },
}  # fmt: skip
"""What is drawn in one panel: file, title, ordinate and variables."""

REVERSING = ("combined_rod_load",)
"""Loads whose reversal is marked."""


def grouped_names(view: View) -> list[str]:
    """Variables of which at least two of one group are there."""
    return [name for stem in GROUPS for name in _members_of_group(view, stem)]


def groups(study: Study, names: Sequence[str]) -> NamedFigures:
    """Draw each group of which at least two variables are there, along each axis."""
    for stem, (title, ordinate, _) in GROUPS.items():
        members = _members_of_group(study.view, stem)
        for whole, along in study.views_by_axis(members) if members else ():
            if along is None or whole.varies(members, along):
                figure = together(whole, members, along, title, ordinate)
                yield stem_of(stem, whole, along), figure


def _members_of_group(view: View, stem: str) -> list[str]:
    names = [name for name in GROUPS[stem][2] if over_angle(view, name)]
    return names if len(names) > 1 else []


def together(
    whole: View, names: Sequence[str], along: str | None, title: str, ordinate: str,
    look: Callable[[str], dict[str, Any]] | None = None,
) -> Figure:  # fmt: skip
    """Several variables over the crank angle in one panel, or in one for each value of an axis."""
    view = whole.only(names, [along])
    axis = view.axis(along)
    places = [axis.place(index) for index in axis.picked(MOST_TOGETHER)]
    curves = [name for name in names if over_angle(view, name)]
    share = comparable([[trace(view, name, place)[1] for name in curves] for place in places])
    base, each = (0.5, 1.75) if axis else (3.3, 0.0)
    sheet = multiples(len(places), base, each, sharex=True, sharey=share)
    for panel, place in zip(sheet.panels, places, strict=True):
        draw_lines(panel, view, names, place, sheet.entries, look)
        for name in REVERSING:
            if name in curves:
                _shade_reversal(panel, view.title(name), trace(view, name, place), sheet.entries)
        panel.set_title(axis.heading(place))
    set_cycle(sheet.panels, view, (6.3 if axis else 4.6) / sheet.columns, sheet.lowest)
    sheet.label_y(ordinate + view.unit(names[0]), 1.5 if axis else 2.8)
    notes = [*view.notes(names), axis.picked_text(MOST_TOGETHER), "" if share else OWN_ORDINATES]
    return sheet.finish(axis.by(title), notes, view.caption, below=bool(axis))


def _shade_reversal(
    panel: Axes, title: str, curve: tuple[Floats, Floats, str], entries: Entries
) -> None:
    """Shade the angles at which a load has the direction that it has for fewer of them."""
    x, load, _ = curve
    pushing = load > 0.0
    if pushing.all() or not pushing.any():
        return
    reversed_there = pushing if pushing[:-1].mean() < 0.5 else ~pushing
    entries[f"{title}: reversed"] = panel.fill_between(
        x, 0.0, np.where(reversed_there, load, 0.0), color="#d9d9d9", linewidth=0.0, zorder=0
    )


DEVIATION = "Deviation from the mean over the cycle (%)"


def curves(study: Study, names: Sequence[str]) -> NamedFigures:
    """Draw each variable over the crank angle, along each axis that changes it."""
    together = torque_and_speed_names(study.view)  # which draws the nominal design
    for name in names:
        found = list(study.views_of(name))
        others = [(view, along) for view, along in found if along not in COUNTED]
        for view, along in others or [(found[0][0], None)]:
            parts = any(dim in view.array(name).dims for dim in COUNTED)
            if along is not None or parts or name not in together:
                yield stem_of(name, view, along), curve_figure(view, name, along)


def curve_figure(view: View, name: str, along: str | None) -> Figure:
    """One variable over the crank angle: a line for each value of one axis, and facets."""
    # Parts of the engine, such as its throws, have a panel each, whatever else there is.
    parts = [dim for dim in COUNTED if dim in view.array(name).dims]
    facet = parts[0] if parts else facet_of(view, [name], [along]) if along else None
    view = view.only([name], [along, facet])
    axis, across = view.axis(along), view.axis(facet)
    notes = [*view.notes([name]), axis.picked_text()]
    if across:
        sheet, share = _facets(view, name, axis, across)
        notes += ["" if share else OWN_ORDINATES, across.picked_text(MOST_PANELS)]
    else:
        sheet = _one_panel(view, name, axis)
    for panel in sheet.panels:
        room = 6.3 / sheet.columns if across else 5.0
        crank_axis(panel, view.array("crank_angle"), room, named=panel in sheet.lowest)
    return sheet.finish(
        axis.by(view.title(name)), notes, view.caption,
        legend=bool(axis) or name in view.options.targets,
        legend_title=axis.label, below=bool(across),
    )  # fmt: skip


def _one_panel(view: View, name: str, axis: StudyAxis) -> Multiples:
    """Lines of all values in one panel; below it their deviations, where they are far apart."""
    apart = far_apart([trace(view, name, axis.place(i))[1] for i in axis.picked()])
    sheet = multiples(2, 4.9, 0.0, columns=1, sharex=True) if apart else multiples(1, 3.3, 0.0)
    both = ((None, view.label(name)), (deviation, DEVIATION))
    for panel, (change, label) in zip(sheet.panels, both, strict=False):
        draw_curves(panel, view, name, axis, {}, sheet.entries, change)
        y_label(panel, label, 2.2 if apart else 2.8)
    return sheet


def _facets(view: View, name: str, axis: StudyAxis, across: StudyAxis) -> tuple[Multiples, bool]:
    """A panel for each value of a second axis, and whether they have one ordinate."""
    shown = across.picked(MOST_PANELS)
    traces = [
        [trace(view, name, {across.name: i, **axis.place(j)})[1] for j in axis.picked()]
        for i in shown
    ]
    change, label = None, view.label(name)
    if any(far_apart(lines) for lines in traces):
        change, label = deviation, DEVIATION
        traces = [[deviation(line) for line in lines] for lines in traces]
    share = comparable(traces)
    sheet = multiples(len(shown), 0.5, 1.75, sharex=True, sharey=share)
    for panel, index in zip(sheet.panels, shown, strict=True):
        draw_curves(panel, view, name, axis, {across.name: index}, sheet.entries, change)
        panel.set_title(across.tag(index))
    sheet.label_y(label, 1.4)
    return sheet, share


def far_apart(curves: Sequence[Floats]) -> bool:
    """Whether lines lie so far apart that their own swings can hardly be seen."""
    curves = [curve[np.isfinite(curve)] for curve in curves]
    curves = [curve for curve in curves if curve.size]
    if len(curves) < 2 or not all(curve.min() > 0 for curve in curves):
        return False
    means = [float(curve.mean()) for curve in curves]
    swings = [float(np.ptp(curve)) for curve in curves]
    return max(means) - min(means) > 1.5 * max(swings) > 0


def deviation(values: Floats) -> Floats:
    """Deviation of a closed curve from its mean over the cycle, in percent."""
    known = np.isfinite(values)
    known[-1] = False  # the first value again
    mean = values[known].mean() if known.any() else np.nan
    return np.asarray(100 * (values / mean - 1))


KINEMATICS = ("position", "velocity", "acceleration", "rod_angle")
PRESSURES = ("pressure",)


def kinematics(study: Study, names: Sequence[str]) -> NamedFigures:
    """Draw reduced travel, velocity and acceleration, and the rod's angle, over one turn."""
    yield from _stacked(study, "kinematics", "Motion of the slider-crank", names, one_turn=True)


def indicator_diagrams(study: Study, names: Sequence[str]) -> NamedFigures:
    """Draw the pressure over the crank angle, with a linear and a logarithmic ordinate."""
    yield from _stacked(study, "indicator_diagrams", "Indicator diagrams", [*names, *names])


def _stacked(
    study: Study, base: str, title: str, drawn: Sequence[str], one_turn: bool = False
) -> NamedFigures:
    """Panels above each other with one crank angle, and a line for each value of an axis.

    A variable that is drawn twice has a logarithmic ordinate the second time, if it is positive.
    """
    names = list(dict.fromkeys(drawn))
    found = study.views_by_axis(names)
    for whole, along in found:
        view = whole.only(names, [along])
        axis = view.axis(along)
        figure, panels = new_sheet(len(drawn), 1, 0.5 + 1.6 * len(drawn), sharex=True)
        entries: Entries = {}
        for number, (panel, name) in enumerate(zip(panels, drawn, strict=True)):
            draw_curves(panel, view, name, axis, {}, entries)
            y_label(panel, view.label(name), 1.6)
            if name in drawn[:number] and np.nanmin(view.numbers(name), initial=np.inf) > 0:
                set_log(panel, "y")
        set_cycle(panels, view, 5.0, panels[-1:], one_turn)
        notes, legend = [*view.notes(names), axis.picked_text()], axis.label
        shown = entries if axis else {}
        finished = finish(figure, axis.by(title), notes, shown, legend, view.caption)
        yield stem_of(base, view, along, len(found) == 1), finished


LOAD_AXIS = "load"
"""The axis that is taken where there is one."""

LOAD_CURVES = ("pressure", "gas_torque", "torque", "load_torque", "omega")
"""What is drawn over the angle, a panel for each, from above."""

BESIDE = {"gas_torque": "inertia_torque"}
"""What is drawn in a panel too where it is the same for all loads (Kakaitsas, Fig 5.8)."""


def load_curve_names(view: View) -> list[str]:
    """Those of pressure, torques and speed that are curves, if there are two of them."""
    names = [name for name in LOAD_CURVES if over_angle(view, name)]
    return names if len(names) > 1 else []


def load_curves(study: Study, names: Sequence[str]) -> NamedFigures:
    """Draw pressure, torques and speed over the angle, a line for each load.

    Without loads, the lines are those of another axis of few values.
    """
    found = {along: view for view, along in study.views_by_axis(names) if along is not None}
    few = [axis for axis, view in found.items() if view.axis(axis).size <= MOST_LINES]
    along = LOAD_AXIS if LOAD_AXIS in found else few[0] if few else None
    if along is None:
        return
    whole = found[along]
    shown = [name for name in names if whole.varies([name], along)]
    if len(shown) < 2:
        return  # which a general kind draws
    beside = {
        name: also
        for name, also in BESIDE.items()
        if name in shown and over_angle(whole, also) and not whole.varies([also], along)
    }
    view = whole.only([*shown, *beside.values()], [along])
    axis = view.axis(along)
    figure, panels = new_sheet(len(shown), 1, 0.6 + 1.7 * len(shown), sharex=True)
    entries: Entries = {}
    for panel, name in zip(panels, shown, strict=True):
        lines = [trace(view, name, {along: index})[1] for index in axis.picked()]
        apart = name == "omega" and far_apart(lines)
        draw_curves(panel, view, name, axis, {}, entries, deviation if apart else None)
        changed = f"{view.title(name)}: {middle_of_sentence(DEVIATION)}"
        y_label(panel, changed if apart else view.label(name), 1.6)
        if name in beside:
            x, y, _ = trace(view, beside[name], {along: 0})
            also = view.title(beside[name])
            entries[also] = panel.plot(x, y, color=GREY, linestyle=":", linewidth=1.4)[0]
    set_cycle(panels, view, 5.0, panels[-1:])
    title, notes = axis.by("Curves of the cycle"), [*view.notes(shown), axis.picked_text()]
    drawn = finish(figure, title, notes, entries, axis.label, view.caption)
    yield f"{along}_curves{view.suffix}", drawn


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


def _torque_look(name: str) -> dict[str, Any]:
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
    yield base, together(study.view, sums, None, title, "Torque", _torque_look)
    for whole, along in study.views_by_axis([*sums, *load]):
        if along is None:
            continue
        if whole.varies(sums, along):
            drawn = together(whole, [*sums, *load], along, title, "Torque", _torque_look)
            yield stem_of(base, whole, along), drawn
        elif load and along in LOAD_LAW:
            yield stem_of(base, whole, along), _load_law(whole, sums, along, title)


def _load_law(whole: View, sums: Sequence[str], along: str, title: str) -> Figure:
    """Where only the load torque changes: components once, load torque for each value."""
    view = whole.only([*sums, "load_torque"], [along])
    axis = view.axis(along)
    figure, panels = new_sheet(2, 1, 4.9, sharex=True)
    entries: Entries = {}
    draw_lines(panels[0], view, sums, {along: axis.nominal or 0}, entries, _torque_look)
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
    draw_lines(left, view, [name for name in names if name != "omega"], {}, entries, _torque_look)
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
        rows = axis.picked(MOST_TOGETHER)
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
        notes = [*view.notes(names), axis.picked_text(MOST_TOGETHER)]
        title = "Torque and speed for different numbers of cylinders"
        drawn = finish(figure, title, notes, entries, caption=view.caption, below=True)
        yield stem_of("cylinders", view, None), drawn
