"""One variable over the crank angle, a line for each value of an axis."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from engine_dyn.types import Floats
from sweeps.figures.lines import COUNTED
from sweeps.figures.scales import comparable, crank_axis, left_labels, y_label
from sweeps.figures.sheet import (
    OWN_ORDINATES,
    Entries,
    NamedFigures,
    bare_panels,
    finish,
    grid_of,
    lowest_panels,
    new_sheet,
)
from sweeps.figures.study import Study
from sweeps.figures.torques import torque_and_speed_names
from sweeps.figures.traces import draw_curves, trace
from sweeps.figures.views import (
    MOST_LINES,
    MOST_PANELS,
    View,
    facet_of,
    key_text,
    pick,
    picked_text,
    place_on,
    stem_of,
)
from sweeps.figures.wording import axis_label, title_of

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
    axis = view.axis(along) if along else None
    entries: Entries = {}
    notes = [*view.notes([name]), picked_text(axis)]
    label = axis_label(view.array(name), name)
    if facet:
        across = view.axis(facet)
        picked = pick(across.size, MOST_PANELS, across.nominal)
        rows, columns = grid_of(len(picked))
        room, height = 6.3 / columns, 1.4
        traces = [
            [
                trace(view, name, {facet: i, **place_on(axis, j)})[1]
                for j in pick(axis.size if axis else 1, MOST_LINES)
            ]
            for i in picked
        ]
        change = None
        if any(far_apart(lines) for lines in traces):
            change, label = deviation, DEVIATION
            traces = [[deviation(line) for line in lines] for lines in traces]
        share = comparable(traces)
        figure, panels = new_sheet(rows, columns, 0.5 + 1.75 * rows, sharex=True, sharey=share)
        for panel, index in zip(panels, picked, strict=False):
            draw_curves(panel, view, name, axis, {facet: index}, entries, change)
            panel.set_title(across.tag(index))
        notes.append("" if share else OWN_ORDINATES)
        notes.append(picked_text(across, MOST_PANELS))
        bare_panels(panels, len(picked), columns)
        lowest = lowest_panels(panels, len(picked), columns)
    else:
        figure, panels = new_sheet(1, 1, 3.3)
        room, height = 5.0, 2.8
        drawn = draw_curves(panels[0], view, name, axis, {}, entries)
        if far_apart(drawn):
            figure, panels = new_sheet(2, 1, 4.9, sharex=True)
            height, entries = 2.2, {}
            draw_curves(panels[0], view, name, axis, {}, entries)
            draw_curves(panels[1], view, name, axis, {}, {}, deviation)
            y_label(panels[1], DEVIATION, height)
        lowest = list(panels[-1:])
    for panel in lowest:
        crank_axis(panel, view.array("crank_angle"), room)
    for panel in panels[: len(picked) if facet else None]:
        if panel not in lowest:
            crank_axis(panel, view.array("crank_angle"), room, named=False)
    if facet:
        left_labels(panels, columns, label, height)
    else:
        y_label(panels[0], label, height)
    title = title_of(view.array(name), name)
    return finish(
        figure,
        f"{title} by {key_text(axis)}" if axis else title,
        notes,
        entries if axis or name in view.options.targets else None,
        axis.label if axis else "",
        view.caption,
        below=bool(facet),
        spare=panels[len(picked) :] if facet else (),
    )


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
