"""Numbers over two axes as colours with labelled contours, and the outcomes of the designs."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from engine_dyn import status as outcome
from engine_dyn.types import Floats
from sweeps.base.dimensions import REDUCTION
from sweeps.base.numbers import digits_of
from sweeps.view.figures.marks import (
    LOST,
    LOST_OTHERWISE,
    TARGET_LOOK,
    doubt_look,
    target_lines,
    target_places,
    target_text,
    targets_of,
)
from sweeps.view.figures.scales import parameter_ticks
from sweeps.view.figures.sheet import GREY, Entries, Multiples, NamedFigures, columns_for, multiples
from sweeps.view.figures.study import Study
from sweeps.view.figures.views import MOST_PANELS, SOUND, StudyAxis, View, facet_of, meanings_of
from sweeps.view.figures.wording import sentence, typeset, wrap

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.colors import Colormap, Normalize
    from matplotlib.contour import ContourSet
    from matplotlib.figure import Figure

KEPT = "limits_kept"  # 1 for designs that keep the limits after each change of load

MOST_MARKS = 900
"""Largest number of cells of a map in which designs that missed the tolerance are marked one by
one."""


def map_panels(
    view: View, along: str, up: str, facet: str | None, room: float, each: float = 1.85
) -> tuple[Multiples, float]:
    """Empty maps over two axes, one for each value of a third, and the height of the figure.

    A map is `room` inches wide where it stands alone; `each` is the height of a row of several.
    """
    x, y, across = view.axis(along), view.axis(up), view.axis(facet)
    places = across.picked(MOST_PANELS)
    base, each = (3.9, 0.0) if len(places) == 1 else (0.6, each)
    sheet = multiples(len(places), base, each, sharex=True, sharey=True)
    height = base + each * sheet.rows
    for panel, place in zip(sheet.panels, places, strict=True):
        panel.grid(False)
        panel.spines[:].set_visible(True)
        parameter_ticks(panel, x, "x", room / sheet.columns)
        parameter_ticks(panel, y, "y", 0.7 * height / sheet.rows)
        panel.set_xlim(*cell_edges(x)[[0, -1]].tolist())
        panel.set_ylim(*cell_edges(y)[[0, -1]].tolist())
        panel.set_title(across.tag(place))
    sheet.label_x(x.label, room / sheet.columns)
    sheet.label_y(y.label, height / sheet.rows * 0.75)
    return sheet, height


def map_figure(view: View, name: str, along: str, up: str, facet: str | None = None) -> Figure:
    """A variable over two axes: colours with labelled contours; designs without one hatched."""
    view = view.only([name], [along, up, facet]).with_values([name], facet)
    x, y, across = view.axis(along), view.axis(up), view.axis(facet)
    places = across.picked(MOST_PANELS)
    values, reasons = _tables(view, name, (along, up, facet), places)
    known = values[np.isfinite(values)]
    norm, levels = colour_scale(known)
    two_rows = columns_for(len(places)) == 2
    sheet, height = map_panels(view, along, up, facet, 5.4, 2.2 if two_rows else 1.85)
    whys = sorted({str(why) for why in reasons.ravel() if why})
    sheet.entries.update(_hatches(whys, x.size * y.size > MOST_MARKS))
    for place, panel, table, why in zip(places, sheet.panels, values, reasons, strict=True):
        _map_panel(panel, x, y, table, why, norm, levels)
        _target_contours(panel, view, name, (x, y, table), sheet.entries)
        _draw_regions(panel, view.slice_at(across.place(place)), name, (x, y), sheet.entries)
    if known.size:
        colour_bar(sheet.figure, sheet.panels, norm, levels, view.label(name), height)
    notes = [*view.notes([name]), across.picked_text(MOST_PANELS)]
    return sheet.finish(f"{view.title(name)} over {x.called} and {y.called}", notes, view.caption)


def _tables(
    view: View, name: str, axes: tuple[str, str, str | None], places: Sequence[int]
) -> tuple[Floats, NDArray[Any]]:
    """Values of each map, and reasons for missing numbers, both of shape (maps, up, along)."""
    along, up, facet = axes
    array = view.array(name)
    said = xr.Variable(array.dims, view.outcomes(name, array, {}))
    shape = (len(places), view.axis(up).size, view.axis(along).size)
    order = (*([facet] if facet else []), up, along)
    values, reasons = (
        (one.isel({facet: list(places)}) if facet else one).transpose(*order).values.reshape(shape)
        for one in (array, said)
    )
    return np.asarray(values, dtype=float), reasons


def colour_scale(known: Floats) -> tuple[Normalize, Floats]:
    """Scale of the colours and levels of the contours, for all maps of a figure."""
    from matplotlib.colors import LogNorm, Normalize

    if not known.size:
        return Normalize(0, 1), np.empty(0)
    low, high = float(known.min()), float(known.max())
    log = low > 0 and high > 20 * low
    norm = LogNorm(low, high) if log else Normalize(low, high if high > low else low + 1)
    return norm, _levels(known, log)


def colour_cells(panel: Axes, edges: tuple[Floats, Floats], table: Floats, norm: Normalize) -> None:
    """Colour those cells between edges that have a number."""
    masked = np.ma.masked_invalid(table)
    panel.pcolormesh(*edges, masked, norm=norm, cmap=_light_map(), rasterized=True)


def hatch_lost(panel: Axes, edges: tuple[Floats, Floats], why: NDArray[Any]) -> Entries:
    """Hatch cells without a number by the reason, and return the entries of the legend."""
    whys = sorted({str(one) for one in why.ravel() if one})
    for reason in whys:
        hatch_cells(panel, *edges, why == reason, LOST.get(reason, LOST_OTHERWISE)[1])
    return _hatches(whys, dense=True)


def _map_panel(
    panel: Axes, x: StudyAxis, y: StudyAxis, table: Floats, why: NDArray[Any], norm: Normalize,
    levels: Floats,
) -> None:  # fmt: skip
    """Draw cells for designs, contours through their middles, hatching for missing results."""
    edges = cell_edges(x), cell_edges(y)
    lost = ~np.isfinite(table)
    masked = np.ma.masked_array(table, lost)
    colour_cells(panel, edges, table, norm)
    inside = table[~lost]
    if min(table.shape) > 1 and inside.size:
        digits = digits_of(levels)
        levels = levels[(levels > inside.min()) & (levels < inside.max())]
        if levels.size:
            written = {float(level): typeset(level, digits) for level in levels}
            lines = panel.contour(
                x.values, y.values, masked, levels, colors="black", linewidths=0.7, linestyles="-"
            )
            places = _label_places(panel, lines)
            if places:
                panel.clabel(lines, fmt=written, fontsize=6.5, inline_spacing=3, manual=places)
    for reason in sorted({str(one) for one in why.ravel() if one}):
        where = why == reason
        if lost[where].all():
            hatch_cells(panel, *edges, where, LOST.get(reason, LOST_OTHERWISE)[1])
        elif table.size > MOST_MARKS:
            hatch_cells(panel, *edges, where, LOST_OTHERWISE[1], "none")
        else:
            rows, columns = np.nonzero(where)
            panel.plot(x.values[columns], y.values[rows], clip_on=False, **doubt_look())


def _target_contours(
    panel: Axes, view: View, name: str, shown: tuple[StudyAxis, StudyAxis, Floats], entries: Entries
) -> None:
    """Draw contours at the targets of a map's quantity, and lines at those of its axes."""
    from matplotlib.lines import Line2D

    x, y, table = shown
    for text, value, own in targets_of(view, name):
        masked = np.ma.masked_invalid(table)
        if min(table.shape) > 1 and masked.min() < value < masked.max():
            look = {"colors": own["color"], "linestyles": [own["linestyle"]]}
            panel.contour(x.values, y.values, masked, [value], linewidths=1.8, **look)
            entries.setdefault(text, Line2D([], [], **own))
    target_places(panel, view, x, entries)
    if not y.words and y.name in view.options.targets:
        target_lines(panel, view, [y.name], entries)


def _draw_regions(
    panel: Axes, view: View, name: str, axes: tuple[StudyAxis, StudyAxis], entries: Entries
) -> None:
    """Draw the border of the designs that keep the limits after changes of load, and of targets.

    The designs with the least inertia among them are marked, unless these are all of a row.
    """
    from matplotlib.collections import LineCollection

    if not view.has(KEPT):
        return
    x, y = axes
    regions: list[tuple[str, str, str, float, Any]] = [
        (KEPT, "Limits after changes of load kept", ">", 1.0, "-")
    ]
    for other, side in view.options.sides.items():
        if other != name and view.has(other):
            regions += [
                (other, target_text(view, other, text), side, value, TARGET_LOOK["linestyle"])
                for text, value in view.options.targets[other]
            ]
    colour = TARGET_LOOK["color"]
    for other, text, side, value, dashes in regions:
        array = view.array(other)
        if not set(array.dims) <= {x.name, y.name}:
            continue
        whole = array.set_dims({y.name: y.size, x.name: x.size}).transpose(y.name, x.name)
        inside = whole.values >= value if side == ">" else whole.values <= value
        if inside.all() or not inside.any():
            continue
        look = {"color": colour, "linestyle": dashes, "linewidth": 1.8, "zorder": 3}
        border = LineCollection(_borders(inside, cell_edges(x), cell_edges(y)), **look)
        entries.setdefault(text, panel.add_collection(border))
        if "inertia" not in (x.name, y.name):
            continue
        rows, columns = np.nonzero(inside)
        inertia = x.values[columns] if x.name == "inertia" else y.values[rows]
        least = inertia == inertia.min()
        if least.sum() < (y if x.name == "inertia" else x).size:
            (star,) = panel.plot(x.values[columns[least]], y.values[rows[least]], "*", color=colour,
                                 markersize=11.0, markeredgecolor="white", zorder=4,
                                 clip_on=False)  # fmt: skip
            entries.setdefault("Lightest of them", star)


def _borders(inside: NDArray[Any], x: Floats, y: Floats) -> list[list[tuple[float, float]]]:
    """Pieces of lines between cells of which one is inside and one is not."""
    rows, columns = np.nonzero(inside[:, 1:] != inside[:, :-1])
    upright = [[(x[c + 1], y[r]), (x[c + 1], y[r + 1])] for r, c in zip(rows, columns, strict=True)]
    rows, columns = np.nonzero(inside[1:] != inside[:-1])
    level = [[(x[c], y[r + 1]), (x[c + 1], y[r + 1])] for r, c in zip(rows, columns, strict=True)]
    return upright + level


def cell_edges(axis: StudyAxis) -> Floats:
    """Borders of cells around the values of an axis, half way on its scale.

    Colours end at the outermost values, beyond which nothing is computed. What is counted or has
    words, with nothing between its values, has whole cells.
    """
    places = np.log(axis.values) if axis.log else axis.values
    if places.size == 1:
        return np.array([places[0] - 0.5, places[0] + 0.5])
    middle = (places[1:] + places[:-1]) / 2
    ends = 2 * places[[0, -1]] - middle[[0, -1]]
    borders = np.concatenate((ends[:1], middle, ends[1:]))
    borders = np.exp(borders) if axis.log else borders
    if axis.joined:
        borders[[0, -1]] = axis.values[[0, -1]]
    return borders


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
    """Colours from light to middle tones, on which black contours and hatching are visible."""
    import matplotlib
    from matplotlib.colors import ListedColormap

    return ListedColormap(matplotlib.colormaps["YlGnBu"](np.linspace(0.04, 0.72, 256)))


def _label_places(panel: Axes, lines: ContourSet) -> list[tuple[float, float]]:
    """The middle of each contour that is long enough for a label, in data coordinates."""
    # matplotlib would label the straightest part, which is often at the border, where it is cut.
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
    panel: Axes, x: Floats, y: Floats, where: NDArray[Any], hatch: str, ground: str = "white"
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


def colour_bar(
    figure: Figure, panels: Sequence[Axes], norm: Normalize, levels: Floats, label: str,
    height: float,
) -> None:  # fmt: skip
    """Draw a colour bar with the contours on it, and ticks at their levels."""
    from matplotlib.cm import ScalarMappable
    from matplotlib.ticker import NullLocator

    bar = figure.colorbar(ScalarMappable(norm, _light_map()), ax=list(panels), aspect=28, pad=0.02)
    bar.outline.set_linewidth(0.6)
    bar.set_label(wrap(label, int(height * 11.5)))
    if levels.size:
        digits = digits_of(levels)
        bar.set_ticks(list(levels), labels=[typeset(level, digits) for level in levels])
        bar.ax.yaxis.set_minor_locator(NullLocator())
        for level in levels:
            bar.ax.axhline(level, color="black", linewidth=0.7)


def outcome_names(view: View) -> list[str]:
    """The status, where there are two axes and some designs failed."""
    if not view.has("status") or len(_outcome_axes(view)) < 2 or REDUCTION in view.data.attrs:
        return []  # A reduced archive has only few of its designs
    return [] if np.isin(view.array("status").values, SOUND).all() else ["status"]


def _outcome_axes(view: View) -> list[str]:
    return [dim for dim in view.axes(["status"]) if dim != "design"]


def outcomes_map(study: Study, names: Sequence[str]) -> NamedFigures:
    """Draw the status of the designs over two axes."""
    from matplotlib.patches import Patch

    view = study.view
    axes = _outcome_axes(view)
    codes = view.array("status").values
    numeric = [dim for dim in axes if not view.axis(dim).words]
    pool = numeric if len(numeric) >= 2 else axes
    chosen = sorted(pool, key=lambda dim: -view.data.sizes[dim])[:2]
    along, up = (dim for dim in axes if dim in chosen)
    facet = facet_of(view, ["status"], (along, up))
    view = view.only(["status"], [along, up, facet])
    x, y, across = view.axis(along), view.axis(up), view.axis(facet)
    sheet, _ = map_panels(view, along, up, facet, 6.0)
    meanings = meanings_of(view.array("status"))
    for rank, code in enumerate(int(code) for code in np.unique(codes)):
        hatch = "" if code in SOUND else LOST.get(meanings.get(code, ""), LOST_OTHERWISE)[1]
        grey = str(0.97 - 0.09 * rank)
        for panel, place in zip(sheet.panels, across.picked(MOST_PANELS), strict=True):
            table = view.at("status", across.place(place)).transpose(up, along).values
            hatch_cells(panel, cell_edges(x), cell_edges(y), table == code, hatch, grey)
        text = f"{sentence(meanings.get(code, str(code)))} ({_fraction_text(codes == code)})"
        sheet.entries[text] = Patch(facecolor=grey, edgecolor=GREY, hatch=hatch, linewidth=0.5)
    notes = [*view.notes(["status"]), across.picked_text(MOST_PANELS)]
    title = f"Outcome of the designs over {x.called} and {y.called}"
    yield "status" + (f"_by_{facet}" if facet else ""), sheet.finish(title, notes, view.caption)


def _fraction_text(where: NDArray[Any]) -> str:
    """A fraction of all designs in percent; a fraction near 0 as a count."""
    part = 100 * float(np.mean(where))
    return f"{part:.3g} %" if part >= 0.1 else f"{int(where.sum())} of {where.size}"
