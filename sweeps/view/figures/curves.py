"""One variable over the crank angle, a line for each value of an axis."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from engine_dyn.types import Floats
from sweeps.view.figures.lines import COUNTED
from sweeps.view.figures.multiples import Multiples, multiples
from sweeps.view.figures.scales import comparable, crank_axis, y_label
from sweeps.view.figures.sheet import OWN_ORDINATES, NamedFigures
from sweeps.view.figures.study import Study
from sweeps.view.figures.torques import torque_and_speed_names
from sweeps.view.figures.traces import draw_curves, trace
from sweeps.view.figures.views import MOST_PANELS, StudyAxis, View, facet_of, stem_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure


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
