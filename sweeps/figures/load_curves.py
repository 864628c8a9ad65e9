"""Several loads in one chart: pressure, torque and speed over the crank angle."""

from __future__ import annotations

from collections.abc import Sequence

from sweeps.figures.curves import DEVIATION, deviation, far_apart
from sweeps.figures.scales import y_label
from sweeps.figures.sheet import Entries, NamedFigures, finish, new_sheet
from sweeps.figures.study import Study
from sweeps.figures.traces import draw_curves, over_angle, set_cycle
from sweeps.figures.views import MOST_LINES, View, key_text, picked_text
from sweeps.figures.wording import axis_label, title_of

LOAD = "load"
"""The axis that is taken where there is one."""

CURVES = ("pressure", "torque", "load_torque", "omega")
"""What is drawn over the angle, a panel for each, from above."""


def load_curve_names(view: View) -> list[str]:
    """Those of pressure, torques and speed that are curves, if there are two of them."""
    names = [name for name in CURVES if over_angle(view, name)]
    return names if len(names) > 1 else []


def load_curves(study: Study, names: Sequence[str]) -> NamedFigures:
    """Draw pressure, torque and speed over the angle, a line for each load.

    Without loads, the lines are those of another axis of few values.
    """
    found = {along: view for view, along in study.along(names) if along is not None}
    few = [axis for axis, view in found.items() if view.axis(axis).size <= MOST_LINES]
    along = LOAD if LOAD in found else few[0] if few else None
    if along is None:
        return
    whole = found[along]
    shown = [name for name in names if whole.varies([name], along)]
    if len(shown) < 2:
        return  # which a general kind draws
    view = whole.only(shown, [along])
    axis = view.axis(along)
    figure, panels = new_sheet(len(shown), 1, 0.6 + 1.7 * len(shown), sharex=True)
    entries: Entries = {}
    for panel, name in zip(panels, shown, strict=True):
        label = axis_label(view.array(name), name)
        lines = draw_curves(panel, view, name, axis, {}, entries)
        if name == "omega" and far_apart(lines):
            for line in list(panel.lines):
                line.remove()
            panel.relim()
            draw_curves(panel, view, name, axis, {}, {}, deviation)
            panel.autoscale_view(scalex=False)
            label = f"{title_of(view.array(name), name)}: {DEVIATION[0].lower()}{DEVIATION[1:]}"
        y_label(panel, label, 1.6)
    set_cycle(panels, view, 5.0, panels[-1:])
    yield (
        f"{along}_curves{view.suffix}",
        finish(
            figure, f"Curves of the cycle by {key_text(axis)}",
            [*view.notes(shown), picked_text(axis)], entries, axis.label, view.caption,
        ),
    )  # fmt: skip
