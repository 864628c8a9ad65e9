"""Curves over the crank angle: motion, pressure, forces and torques, and any other variable."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from engine_dyn.types import Floats
from sweeps.base.dimensions import COUNTED
from sweeps.view.figures.angle_lines import (
    FRICTION,
    AnglePanel,
    angle_figure,
    draw_curves,
    draw_lines,
    load_at,
    over_angle,
    set_cycle,
    shade_work,
    torque_look,
    trace,
)
from sweeps.view.figures.marks import MEAN_LOOK, lost_handle, mark_lost
from sweeps.view.figures.scales import comparable
from sweeps.view.figures.sheet import (
    OWN_ORDINATES,
    Entries,
    NamedFigures,
    finish,
    new_sheet,
    rc,
    y_label,
)
from sweeps.view.figures.study import Study
from sweeps.view.figures.views import MOST_LINES, MOST_PANELS, View, facet_of, stem_of
from sweeps.view.figures.wording import middle_of_sentence, symbol_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# Largest number of panels of a figure with several variables in each: more would be too small
MOST_TOGETHER = 6

DEVIATION = "Deviation from the mean over the cycle (%)"

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
"""Variables that share a panel: name of the file, title, ordinate and the variables."""

# ---- several variables in one panel --------------------------------------------------------------


def grouped_names(view: View) -> list[str]:
    """Variables of which at least two of one group are there."""
    return [name for stem in GROUPS for name in _members_of_group(view, stem)]


def groups(study: Study, names: Sequence[str]) -> NamedFigures:
    """Draw each group of which at least two variables are there, along each axis."""
    for stem, (title, ordinate, _) in GROUPS.items():
        members = _members_of_group(study.view, stem)
        for whole, along in study.views_by_axis(members) if members else ():
            if along is None or whole.varies(members, along):
                yield stem_of(stem, whole, along), _together(whole, members, along, title, ordinate)


def _members_of_group(view: View, stem: str) -> list[str]:
    names = [name for name in GROUPS[stem][2] if over_angle(view, name)]
    return names if len(names) > 1 else []


def _together(
    whole: View, names: Sequence[str], along: str | None, title: str, ordinate: str,
    look: Callable[[str], dict[str, Any]] | None = None,
) -> Figure:  # fmt: skip
    """Several variables over the crank angle in one panel, or in one for each value of an axis."""
    view = whole.only(names, [along])
    axis = view.axis(along)
    places = [axis.place(index) for index in axis.picked(MOST_TOGETHER)]
    curves = [name for name in names if over_angle(view, name)]
    share = comparable([[trace(view, name, place)[1] for name in curves] for place in places])

    draw = partial(_draw_group, view=view, names=names, look=look)
    panels = [AnglePanel(partial(draw, place=place), title=axis.heading(place)) for place in places]
    notes = [*view.notes(names), axis.picked_text(MOST_TOGETHER), "" if share else OWN_ORDINATES]
    return angle_figure(
        view, panels, axis.by(title), notes,
        size=(0.5, 1.75) if axis else (3.3, 0.0), room=6.3 if axis else 4.6, share=share,
        ordinate=ordinate + view.unit(names[0]), tall=1.5 if axis else 2.8, below=bool(axis),
    )  # fmt: skip


def _draw_group(
    panel: Axes, entries: Entries, view: View, names: Sequence[str], place: Mapping[str, int],
    look: Callable[[str], dict[str, Any]] | None,
) -> None:  # fmt: skip
    """Draw lines of several variables; a rod load is shaded where it has its rarer direction."""
    draw_lines(panel, entries, view, names, place, look)
    if "combined_rod_load" not in names:
        return
    x, load, _ = trace(view, "combined_rod_load", place)
    pushing = load > 0.0
    if pushing.any() and not pushing.all():
        rarer = pushing if pushing[:-1].mean() < 0.5 else ~pushing
        entries[f"{view.title('combined_rod_load')}: reversed"] = panel.fill_between(
            x, 0.0, np.where(rarer, load, 0.0), color="#d9d9d9", linewidth=0.0, zorder=0
        )


# ---- one variable, a line for each value of an axis ----------------------------------------------


def curves(study: Study, names: Sequence[str]) -> NamedFigures:
    """Draw each variable over the crank angle, along each axis that changes it."""
    # The figure torque_and_speed shows these variables for the nominal design.
    with_speed = torque_and_speed_names(study.view)
    for name in names:
        views = list(study.views_of(name))
        others = [(view, along) for view, along in views if along not in COUNTED]
        for view, along in others or [(views[0][0], None)]:
            parts = any(dim in view.array(name).dims for dim in COUNTED)
            if along is not None or parts or name not in with_speed:
                yield stem_of(name, view, along), curve_figure(view, name, along)


def curve_figure(view: View, name: str, along: str | None) -> Figure:
    """One variable over the crank angle: a line for each value of one axis, and facets.

    Where lines are far apart, their deviations from their means are drawn too, or in their place.
    """
    # Parts of the engine, such as its throws, always have a panel each.
    parts = [dim for dim in COUNTED if dim in view.array(name).dims]
    facet = parts[0] if parts else facet_of(view, [name], [along]) if along else None
    view = view.only([name], [along, facet]).with_values([name], along, facet)
    axis, across = view.axis(along), view.axis(facet)
    places = [across.place(index) for index in across.picked(MOST_PANELS)]
    traced = [[trace(view, name, place | axis.place(i))[1] for i in axis.picked()]
              for place in places]  # fmt: skip
    apart = any(far_apart(lines) for lines in traced)
    if across and apart:
        traced = [[deviation(line) for line in lines] for lines in traced]
    share = bool(across) and comparable(traced)
    draw = partial(draw_curves, view=view, name=name, axis=axis)
    label = view.label(name)
    if across:
        label = DEVIATION if apart else label
        draw = partial(draw, change=deviation if apart else None)
        panels = [
            AnglePanel(partial(draw, fixed=place), title=across.tag(place.get(across.name, 0)))
            for place in places
        ]
    else:
        panels = [AnglePanel(draw, label)]
        panels += [AnglePanel(partial(draw, change=deviation), DEVIATION)] * apart
    notes = [*view.notes([name]), axis.picked_text(), "" if share or not across else OWN_ORDINATES,
             across.picked_text(MOST_PANELS)]  # fmt: skip
    return angle_figure(
        view, panels, axis.by(view.title(name)), notes,
        size=(0.5, 1.75) if across else (4.9, 0.0) if apart else (3.3, 0.0), share=share,
        columns=None if across else 1, room=6.3 if across else 5.0,
        ordinate=label if across else "",
        tall=1.4 if across else 2.2 if apart else 2.8,
        legend=bool(axis) or name in view.options.targets, legend_title=axis.label,
        below=bool(across),
    )  # fmt: skip


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
    known[-1] = False  # The last value repeats the first
    mean = values[known].mean() if known.any() else np.nan
    return np.asarray(100 * (values / mean - 1))


# ---- several panels above each other -------------------------------------------------------------


def kinematics(study: Study, names: Sequence[str]) -> NamedFigures:
    """Draw reduced travel, velocity and acceleration, and the rod's angle, over one turn."""
    yield from _stacked(study, "kinematics", "Motion of the slider-crank", names, one_turn=True)


def indicator_diagrams(study: Study, names: Sequence[str]) -> NamedFigures:
    """Draw the pressure over the crank angle, with a linear and a logarithmic ordinate."""
    yield from _stacked(study, "indicator_diagrams", "Indicator diagrams", [*names, *names])


def _stacked(
    study: Study, base: str, title: str, drawn: Sequence[str], one_turn: bool = False
) -> NamedFigures:
    """Panels above each other with one crank angle, and a line for each value of an axis."""
    # A positive variable that is drawn twice has a logarithmic ordinate the second time.
    names = list(dict.fromkeys(drawn))
    views = study.views_by_axis(names)
    for whole, along in views:
        view = whole.only(names, [along])
        axis = view.axis(along)
        panels = []
        for number, name in enumerate(drawn):
            positive = bool(np.nanmin(view.numbers(name), initial=np.inf) > 0)
            again = name in drawn[:number] and positive
            draw = partial(draw_curves, view=view, name=name, axis=axis, log=again)
            panels.append(AnglePanel(draw, view.label(name)))
        finished = angle_figure(
            view, panels, axis.by(title), [*view.notes(names), axis.picked_text()],
            size=(0.5, 1.6), columns=1, room=5.0, tall=1.6, one_turn=one_turn,
            legend=bool(axis), legend_title=axis.label, below=False,
        )  # fmt: skip
        yield stem_of(base, view, along, len(views) == 1), finished


def load_curve_names(view: View) -> list[str]:
    """Curves among pressure, torques and speed, if there are two of them."""
    wanted = ("pressure", "gas_torque", "torque", "load_torque", "omega")
    names = [name for name in wanted if over_angle(view, name)]
    return names if len(names) > 1 else []


def load_curves(study: Study, names: Sequence[str]) -> NamedFigures:
    """Draw pressure, torques and speed over the angle, a line for each load.

    Without loads, the lines are those of another axis of few values. Where only one variable
    changes, a general kind draws it.
    """
    views = {along: view for view, along in study.views_by_axis(names) if along is not None}
    few = [axis for axis, view in views.items() if view.axis(axis).size <= MOST_LINES]
    along = "load" if "load" in views else few[0] if few else None
    if along is None:
        return
    whole = views[along]
    shown = [name for name in names if whole.varies([name], along)]
    if len(shown) < 2:
        return
    # An inertia torque that is the same for all loads is drawn once (Kakaitsas, Fig 5.8).
    once = "inertia_torque"
    alone = "gas_torque" in shown and over_angle(whole, once) and not whole.varies([once], along)
    view = whole.only([*shown, *([once] if alone else [])], [along])
    axis = view.axis(along)

    def panel_of(name: str) -> AnglePanel:
        lines = [trace(view, name, {along: index})[1] for index in axis.picked()]
        apart = name == "omega" and far_apart(lines)
        changed = f"{view.title(name)}: {middle_of_sentence(DEVIATION)}"

        def draw(panel: Axes, entries: Entries) -> None:
            change = deviation if apart else None
            draw_curves(panel, view, name, axis, entries=entries, change=change)
            if alone and name == "gas_torque":
                x, y, _ = trace(view, once, {along: 0})
                (entries[view.title(once)],) = panel.plot(x, y, **torque_look(once))

        return AnglePanel(draw, changed if apart else view.label(name))

    drawn = angle_figure(
        view, [panel_of(name) for name in shown], axis.by("Curves of the cycle"),
        [*view.notes(shown), axis.picked_text()], size=(0.6, 1.7), columns=1, room=5.0, tall=1.6,
        legend_title=axis.label, below=False,
    )  # fmt: skip
    yield f"{along}_curves{view.suffix}", drawn


# ---- torques -------------------------------------------------------------------------------------


def component_names(view: View) -> list[str]:
    """Components of the torque, their sum and the load torque, if a component is a curve."""
    components = ("gas_torque", "inertia_torque", FRICTION)
    if not any(over_angle(view, name) for name in components):
        return []
    return [name for name in (*components, "torque", "load_torque") if view.has(name)]


def torque_components(study: Study, names: Sequence[str]) -> NamedFigures:
    """Draw gas, inertia and friction torque with their sum: nominal, and along each axis."""
    sums = [name for name in names if name != "load_torque"]
    load = [name for name in names if name == "load_torque" and over_angle(study.view, name)]
    title, base = "Components of the torque", "torque_components"
    yield base, _together(study.view, sums, None, title, "Torque", torque_look)
    for whole, along in study.views_by_axis([*sums, *load]):
        if along is None:
            continue
        if whole.varies(sums, along):
            drawn = _together(whole, [*sums, *load], along, title, "Torque", torque_look)
            yield stem_of(base, whole, along), drawn
        elif load and along in ("load_exponent", "load_offset"):
            yield stem_of(base, whole, along), _load_law(whole, sums, along, title)


def _load_law(whole: View, sums: Sequence[str], along: str, title: str) -> Figure:
    """Figure in which only the load torque changes: components once, load torque for each value."""
    view = whole.only([*sums, "load_torque"], [along])
    axis = view.axis(along)

    def loads(panel: Axes, entries: Entries) -> None:
        lines: Entries = {}
        draw_curves(panel, view, "load_torque", axis, entries=lines)
        sign = "" if axis.words else f"{symbol_of(axis.variable) or axis.called} = "
        entries.update({f"Load torque, {sign}{text}": line for text, line in lines.items()})

    unchanged = f"the same for every {axis.called}"
    place = axis.place(axis.nominal or 0)
    components = partial(draw_lines, view=view, names=sums, index=place, look=torque_look)
    panels = [AnglePanel(components, "Torque" + view.unit(sums[0]), unchanged),
              AnglePanel(loads, view.label("load_torque"))]  # fmt: skip
    notes = [*view.notes([*sums, "load_torque"]), axis.picked_text()]
    return angle_figure(
        view, panels, axis.by(title), notes, size=(4.9, 0.0), columns=1, room=4.6, tall=2.0,
        below=False,
    )  # fmt: skip


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
    draw_lines(left, entries, view, [n for n in names if n != "omega"], {}, torque_look)
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
    several = view.data.sizes.get("cylinders", 1) > 1 or (
        "cylinders" in view.data.coords and view.array("cylinders").dims == ("design",)
    )
    return torque_and_speed_names(view) if several else []


def cylinders(study: Study, names: Sequence[str]) -> NamedFigures:
    """Draw torque and speed of engines of different numbers of cylinders, a row for each."""
    names = [name for name in names if name != "load_torque"]
    for whole, along in study.views_by_axis(names):
        if along != "cylinders":
            continue
        view = whole.only(names, [along])
        axis = view.axis(along)
        rows = axis.picked(MOST_TOGETHER)
        panels = []
        for index in rows:
            for name in names:
                tag = (f"{view.label(name)}\n" if index == rows[0] else "") + axis.tag(index)
                draw = partial(_with_mean, view=view, name=name, tag=tag, place=axis.place(index))
                panels.append(AnglePanel(draw))
        drawn = angle_figure(
            view, panels, "Torque and speed for different numbers of cylinders",
            [*view.notes(names), axis.picked_text(MOST_TOGETHER)], size=(0.8, 1.15), columns=2,
            room=6.0, share="col",
        )  # fmt: skip
        yield stem_of("cylinders", view, None), drawn


def _with_mean(
    panel: Axes, entries: Entries, view: View, name: str, tag: str, place: Mapping[str, int]
) -> None:
    """One variable of one engine, with its mean over the cycle."""
    x, y, lost = trace(view, name, place)
    panel.set_title(tag + (f": {lost}" if lost else ""), linespacing=1.5)
    if lost:
        mark_lost(panel, lost)
        return
    panel.plot(x, y, color=rc("text.color"), linewidth=1.1)
    entries["Mean over the cycle"] = panel.axhline(float(np.nanmean(y[:-1])), **MEAN_LOOK)
