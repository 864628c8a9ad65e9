"""Numbers over two axes: colours with labelled contours."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from engine_dyn import status as outcome
from engine_dyn.types import Floats
from sweeps.figures.marks import LOST, LOST_OTHERWISE, doubt_look
from sweeps.figures.scales import parameter_ticks, x_label, y_label
from sweeps.figures.sheet import (
    GREY,
    Entries,
    bare_panels,
    finish,
    grid_of,
    lowest_panels,
    new_sheet,
)
from sweeps.figures.targets import LOOK, target_lines, target_places, target_text
from sweeps.figures.views import MOST_PANELS, StudyAxis, View, key_text, pick, picked_text
from sweeps.figures.wording import axis_label, digits_of, number_text, sentence, title_of, wrap

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.colors import Colormap, Normalize
    from matplotlib.contour import ContourSet
    from matplotlib.figure import Figure


MOST_MARKS = 900
"""Cells of a map up to which designs that missed the tolerance are marked one by one."""


def map_figure(view: View, name: str, along: str, up: str, facet: str | None = None) -> Figure:
    """A variable over two axes: colours with labelled contours; designs without one hatched."""
    from matplotlib.colors import LogNorm, Normalize

    view = view.only([name], [along, up, facet])
    x, y = view.axis(along), view.axis(up)
    across = view.axis(facet) if facet else None
    places = pick(across.size, MOST_PANELS, across.nominal) if across else [0]
    rows, columns = grid_of(len(places))
    array = view.array(name)
    if facet:
        array = array.isel({facet: places})
    array = array.transpose(*([facet] if facet else []), up, along)
    values = np.asarray(array.values, dtype=float).reshape(-1, y.size, x.size)
    said = xr.Variable(view.array(name).dims, view.outcomes(name, view.array(name), {}))
    if facet:
        said = said.isel({facet: places})
    reasons = said.transpose(*array.dims).values.reshape(values.shape)
    known = values[np.isfinite(values)]
    norm: Normalize = Normalize(0, 1)
    if known.size:
        low, high = float(known.min()), float(known.max())
        log = low > 0 and high > 20 * low
        norm = LogNorm(low, high) if log else Normalize(low, high if high > low else low + 1)
    levels = _levels(known, isinstance(norm, LogNorm)) if known.size else np.empty(0)
    height = 3.9 if rows * columns == 1 else 0.6 + (2.2 if columns == 2 else 1.85) * rows
    figure, panels = new_sheet(rows, columns, height, sharex=True, sharey=True)
    whys = sorted({str(why) for why in reasons.ravel() if why})
    room = 5.4 / columns
    for panel, table, why in zip(panels, values, reasons, strict=False):
        parameter_ticks(panel, x, "x", room)
        parameter_ticks(panel, y, "y", 0.7 * height / rows)
        _map_panel(panel, x, y, table, why, whys, norm, levels)
    entries = _hatches(whys, x.size * y.size > MOST_MARKS)
    for panel, table in zip(panels, values, strict=False):
        _target_contours(panel, view, name, (x, y, table), entries)
    for panel, place in zip(panels, places, strict=False):
        if across:
            panel.set_title(across.tag(place))
    bare_panels(panels, len(places), columns)
    for panel in lowest_panels(panels, len(places), columns):
        x_label(panel, x.label, room)
    for panel in panels[::columns]:
        y_label(panel, y.label, height / rows * 0.75)
    if known.size:
        _colour_bar(figure, panels[: len(places)], norm, levels, axis_label(array, name), height)
    notes = [*view.notes([name]), picked_text(across, MOST_PANELS)]
    title = f"{title_of(array, name)} over {key_text(x)} and {key_text(y)}"
    return finish(figure, title, notes, entries, caption=view.caption, below=True)


def _map_panel(
    panel: Axes,
    x: StudyAxis,
    y: StudyAxis,
    table: Floats,
    why: NDArray[Any],
    whys: Sequence[str],
    norm: Normalize,
    levels: Floats,
) -> None:
    """Cells for designs, contours through their middles, hatching for what is lost."""
    panel.grid(False)
    panel.spines[:].set_visible(True)
    edges = cell_edges(x), cell_edges(y)
    lost = ~np.isfinite(table)
    masked = np.ma.masked_array(table, lost)
    panel.pcolormesh(*edges, masked, norm=norm, cmap=_light_map(), rasterized=True)
    panel.set_xlim(*edges[0][[0, -1]].tolist())
    panel.set_ylim(*edges[1][[0, -1]].tolist())
    inside = table[~lost]
    if min(table.shape) > 1 and inside.size:
        digits = digits_of(levels)
        levels = levels[(levels > inside.min()) & (levels < inside.max())]
        if levels.size:
            written = {float(level): number_text(level, digits) for level in levels}
            lines = panel.contour(
                x.values, y.values, masked, levels, colors="black", linewidths=0.7, linestyles="-"
            )
            places = _label_places(panel, lines)
            if places:
                panel.clabel(lines, fmt=written, fontsize=6.5, inline_spacing=3, manual=places)
    for reason in whys:
        where = why == reason
        if not where.any():
            continue
        if lost[where].all():
            hatch_cells(panel, *edges, where, LOST.get(reason, LOST_OTHERWISE)[1])
        elif table.size > MOST_MARKS:
            hatch_cells(panel, *edges, where, LOST_OTHERWISE[1], "none")
        else:
            rows, columns = np.nonzero(where)
            panel.plot(x.values[columns], y.values[rows], **doubt_look())


def _target_contours(
    panel: Axes, view: View, name: str, shown: tuple[StudyAxis, StudyAxis, Floats], entries: Entries
) -> None:
    """Contours at the targets of a map's quantity, and lines at those of its axes."""
    from matplotlib.lines import Line2D

    x, y, table = shown
    for text, value in view.options.targets.get(name, ()):
        masked = np.ma.masked_invalid(table)
        if min(table.shape) > 1 and masked.min() < value < masked.max():
            look = {"colors": LOOK["color"], "linestyles": [LOOK["linestyle"]], "linewidths": 1.8}
            panel.contour(x.values, y.values, masked, [value], **look)
            entries.setdefault(target_text(view, name, text), Line2D([], [], **LOOK))
    target_places(panel, view, x, entries)
    if not y.words and y.name in view.options.targets:
        target_lines(panel, view, [y.name], entries)


def cell_edges(axis: StudyAxis) -> Floats:
    """Borders of cells around the values of an axis, half way on its scale."""
    places = np.log(axis.values) if axis.log else axis.values
    if places.size == 1:
        return np.array([places[0] - 0.5, places[0] + 0.5])
    middle = (places[1:] + places[:-1]) / 2
    ends = places[0] - (middle[0] - places[0]), places[-1] + (places[-1] - middle[-1])
    borders = np.concatenate(([ends[0]], middle, [ends[1]]))
    return np.exp(borders) if axis.log else borders


def _levels(values: Floats, log: bool) -> Floats:
    """Round values for contours, strictly inside the range."""
    from matplotlib.ticker import MaxNLocator

    low, high = float(values.min()), float(values.max())
    if log:
        decades = np.arange(np.floor(np.log10(low)), np.ceil(np.log10(high)) + 1)
        for steps in ((1.0,), (1.0, 3.0), (1.0, 2.0, 5.0), (1.0, 1.5, 2.0, 3.0, 5.0, 7.0)):
            levels = np.sort(np.outer(10.0**decades, steps).ravel())
            levels = levels[(levels > low) & (levels < high)]
            if levels.size >= 5:
                return np.asarray(levels)
    levels = np.asarray(MaxNLocator(8, steps=[1, 2, 2.5, 5, 10]).tick_values(low, high))
    return np.asarray(levels[(levels > low) & (levels < high)], dtype=float)


def _light_map() -> Colormap:
    """Light to middle tones, darker for more: black contours and hatching can be seen on it."""
    import matplotlib
    from matplotlib.colors import ListedColormap

    return ListedColormap(matplotlib.colormaps["YlGnBu"](np.linspace(0.04, 0.72, 256)))


def _label_places(panel: Axes, lines: ContourSet) -> list[tuple[float, float]]:
    """The middle of each contour that is long enough for a label, in data coordinates.

    matplotlib's own choice, the straightest part, is often at the border, which cuts the label.
    """
    places = []
    for segments in lines.allsegs:
        for segment in segments:
            if len(segment) < 2:
                continue
            drawn = panel.transAxes.inverted().transform(panel.transData.transform(segment))
            length = np.append(0.0, np.cumsum(np.hypot(*np.diff(drawn, axis=0).T)))
            middle = int(np.searchsorted(length, length[-1] / 2))
            inside = np.all((drawn[middle] > 0.08) & (drawn[middle] < 0.92))
            if length[-1] > 0.25 and inside:
                places.append((float(segment[middle, 0]), float(segment[middle, 1])))
    return places


def hatch_cells(
    panel: Axes,
    x: Floats,
    y: Floats,
    where: NDArray[Any],
    hatch: str,
    ground: str = "white",
) -> None:
    """Hatch cells of a map; neighbours in a row are one rectangle."""
    from matplotlib.collections import PolyCollection

    boxes = []
    for row, cells in enumerate(where):
        turns = np.flatnonzero(np.diff(np.concatenate(([0], cells.astype(int), [0]))))
        for left, right in turns.reshape(-1, 2):
            corners = [(left, row), (right, row), (right, row + 1), (left, row + 1)]
            boxes.append([(x[i], y[j]) for i, j in corners])
    look: dict[str, Any] = {"facecolors": ground, "edgecolors": GREY, "linewidths": 0.0}
    panel.add_collection(PolyCollection(boxes, hatch=hatch or None, **look))


def _hatches(whys: Sequence[str], dense: bool) -> Entries:
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    doubtful = outcome.MEANINGS[outcome.TOLERANCE_NOT_MET].replace("_", " ")
    return {
        sentence(why): Line2D([], [], **doubt_look())
        if why == doubtful and not dense
        else Patch(
            facecolor="white", edgecolor=GREY, hatch=LOST.get(why, LOST_OTHERWISE)[1], linewidth=0.5
        )
        for why in whys
    }


def _colour_bar(
    figure: Figure,
    panels: Sequence[Axes],
    norm: Normalize,
    levels: Floats,
    label: str,
    height: float,
) -> None:
    """Colour bar with the contours on it, ticks at their levels."""
    from matplotlib.cm import ScalarMappable
    from matplotlib.ticker import NullLocator

    mappable = ScalarMappable(norm, _light_map())
    bar = figure.colorbar(mappable, ax=list(panels), aspect=28, pad=0.02)
    bar.outline.set_linewidth(0.6)
    bar.set_label(wrap(label, int(height * 11.5)))
    if levels.size:
        digits = digits_of(levels)
        bar.set_ticks(list(levels), labels=[number_text(level, digits) for level in levels])
        bar.ax.yaxis.set_minor_locator(NullLocator())
        for level in levels:
            bar.ax.axhline(level, color="black", linewidth=0.7)
