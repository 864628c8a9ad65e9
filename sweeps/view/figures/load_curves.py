"""Several loads in one chart: pressure, torques and speed over the crank angle."""

from __future__ import annotations

from collections.abc import Sequence

from sweeps.view.figures.curves import DEVIATION, deviation, far_apart
from sweeps.view.figures.scales import y_label
from sweeps.view.figures.sheet import GREY, Entries, NamedFigures, finish, new_sheet
from sweeps.view.figures.study import Study
from sweeps.view.figures.traces import draw_curves, over_angle, set_cycle, trace
from sweeps.view.figures.views import MOST_LINES, View
from sweeps.view.figures.wording import middle_of_sentence

LOAD = "load"
"""The axis that is taken where there is one."""

CURVES = ("pressure", "gas_torque", "torque", "load_torque", "omega")
"""What is drawn over the angle, a panel for each, from above."""

BESIDE = {"gas_torque": "inertia_torque"}
"""What is drawn in a panel too where it is the same for all loads (Kakaitsas, Fig 5.8)."""


def load_curve_names(view: View) -> list[str]:
    """Those of pressure, torques and speed that are curves, if there are two of them."""
    names = [name for name in CURVES if over_angle(view, name)]
    return names if len(names) > 1 else []


def load_curves(study: Study, names: Sequence[str]) -> NamedFigures:
    """Draw pressure, torques and speed over the angle, a line for each load.

    Without loads, the lines are those of another axis of few values.
    """
    found = {along: view for view, along in study.views_by_axis(names) if along is not None}
    few = [axis for axis, view in found.items() if view.axis(axis).size <= MOST_LINES]
    along = LOAD if LOAD in found else few[0] if few else None
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
