"""Curves above each other over one crank angle: motion of the piston, indicator diagrams."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np

from sweeps.figures.scales import crank_axis, log_ticks, y_label
from sweeps.figures.sheet import Entries, NamedFigures, finish, new_sheet
from sweeps.figures.study import Study
from sweeps.figures.traces import draw_curves, set_cycle
from sweeps.figures.views import View, picked_text, stem_of, title_by

if TYPE_CHECKING:
    from matplotlib.axes import Axes


KINEMATICS = ("position", "velocity", "acceleration", "rod_angle")
PRESSURE = ("pressure",)


def kinematics(study: Study, names: Sequence[str]) -> NamedFigures:
    """Draw reduced travel, velocity and acceleration, and the rod's angle, over one turn."""

    def one_turn(panels: Sequence[Axes], view: View) -> None:
        low, high = panels[-1].get_xlim()
        if high - low > 360:  # the second turn repeats the first
            panels[-1].set_xlim(0, 360)
            for panel in panels:
                crank_axis(panel, view.array("crank_angle"), 5.0, named=panel is panels[-1])

    title = "Motion of the slider-crank"
    yield from _stacked(study, names, "kinematics", title, names, one_turn)


def indicator_diagrams(study: Study, names: Sequence[str]) -> NamedFigures:
    """Draw the pressure over the crank angle, with a linear and a logarithmic ordinate."""

    def logarithmic(panels: Sequence[Axes], view: View) -> None:
        values = view.array("pressure").values
        known = values[np.isfinite(values)]
        if known.size and known.min() > 0:
            panels[1].set_yscale("log")
            low, high = panels[1].get_ylim()
            log_ticks(panels[1].yaxis, low, high)

    title, twice = "Indicator diagrams", [*names, *names]
    yield from _stacked(study, names, "indicator_diagrams", title, twice, logarithmic)


def _stacked(
    study: Study,
    names: Sequence[str],
    base: str,
    title: str,
    panels_of: Sequence[str],
    adjust: Callable[[Sequence[Axes], View], None],
) -> NamedFigures:
    """Panels above each other with one crank angle, and a line for each value of an axis."""
    found = study.along(names)
    for whole, along in found:
        view = whole.only(names, [along])
        axis = view.axis_along(along)
        figure, panels = new_sheet(len(panels_of), 1, 0.5 + 1.6 * len(panels_of), sharex=True)
        entries: Entries = {}
        for panel, name in zip(panels, panels_of, strict=True):
            draw_curves(panel, view, name, axis, {}, entries)
            y_label(panel, view.label(name), 1.6)
        set_cycle(panels, view, 5.0, panels[-1:])
        adjust(panels, view)
        notes, legend = [*view.notes(names), picked_text(axis)], axis.label if axis else ""
        shown = entries if axis else {}
        drawn = finish(figure, title_by(title, axis), notes, shown, legend, view.caption)
        yield stem_of(base, view, along, len(found) == 1), drawn
