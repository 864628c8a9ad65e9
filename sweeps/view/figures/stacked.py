"""Curves above each other over one crank angle: motion of the piston, indicator diagrams."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from sweeps.view.figures.scales import set_log, y_label
from sweeps.view.figures.sheet import Entries, NamedFigures, finish, new_sheet
from sweeps.view.figures.study import Study
from sweeps.view.figures.traces import draw_curves, set_cycle
from sweeps.view.figures.views import stem_of

KINEMATICS = ("position", "velocity", "acceleration", "rod_angle")
PRESSURE = ("pressure",)


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
