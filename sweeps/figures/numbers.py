"""Numbers over the axes of a study: lines, maps, small multiples, tables."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from engine_dyn import status as outcome
from engine_dyn.types import Floats
from sweeps.figures.sheet import (
    GREY,
    LOST,
    LOST_OTHERWISE,
    OWN_ORDINATES,
    Entries,
    Plates,
    bare_panels,
    comparable,
    degree_ticks,
    doubt_look,
    finish,
    free_scale,
    grid_of,
    left_labels,
    line_style,
    log_ticks,
    lost_handle,
    lost_look,
    lost_points,
    lowest_panels,
    new_sheet,
    no_ordinate,
    parameter_ticks,
    x_label,
    y_label,
)
from sweeps.figures.views import (
    MOST_LINES,
    MOST_PANELS,
    MOST_READ,
    NO_VALUE,
    SOUND,
    Study,
    StudyAxis,
    View,
    design_text,
    facet_of,
    is_log,
    is_words,
    key_text,
    meanings_of,
    parameters_of,
    pick,
    picked_text,
    same_over,
    stem_of,
)
from sweeps.figures.wording import (
    HARD_SPACE,
    axis_label,
    digits_of,
    name_of,
    number_text,
    sentence,
    symbol_of,
    title_of,
    unit_in_brackets,
    with_unit,
    wrap,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.colors import Colormap, Normalize
    from matplotlib.contour import ContourSet
    from matplotlib.figure import Figure


MOST_MARKS = 900  # cells of a map of which some are marked singly
MOST_ROWS = 45  # of a chart with a row for each case
# Drawn on common axes where they depend on the same things.
TOGETHER = {
    "omega_extremes": ("omega_max", "omega_mean", "omega_min"),
    "torque_extremes": ("torque_max", "torque_mean", "torque_min"),
}
# What a study is made for: drawn against each of its axes, even where there is a map.
MAIN = ("delta",)
# Its unit changes with the exponent (the file then gives none): not one quantity along that axis.
UNIT_CHANGES = {"load_coefficient": "load_exponent"}


COUNTED = ("cylinder", "main_bearing")
"""Dimensions whose points are parts of an engine: no line runs from one to the next."""

WHOLE = (*COUNTED, "cylinders", "passes", "truncation")
"""Dimensions of whole numbers: there is nothing between them that a map could show."""

FEWEST_OF_MAP = 5
"""Values of an axis below which lines show more than a map."""


@dataclass(frozen=True)
class _Line:
    """Numbers along an axis, what is wrong with each ("" nothing), and published ones beside."""

    text: str
    y: Floats
    said: NDArray[Any]
    published: Floats | None
    x: Floats | None = None  # if not the axis's own values
    strong: bool = False


def _line(view: View, name: str, index: Mapping[str, int], text: str, **more: Any) -> _Line:
    """One line of a variable: all axes but one are fixed by `index`."""
    array = view.array(name)
    array = array.isel({dim: i for dim, i in index.items() if dim in array.dims})
    other = view.published(name)
    published = None
    if other is not None:
        beside = view.array(other)
        beside = beside.isel({dim: i for dim, i in index.items() if dim in beside.dims})
        published = np.asarray(beside.values, dtype=float)
    values = np.asarray(array.values, dtype=float)
    return _Line(text, values, view.outcomes(name, array, index), published, **more)


def _points(panel: Axes, axis: StudyAxis, lines: Sequence[_Line], entries: Entries) -> None:
    """Numbers along an axis as joined points; lost designs are marked on the frame."""
    from matplotlib.lines import Line2D

    remarks: Entries = {}
    for rank, line in enumerate(lines):
        style = line_style(rank, len(lines), line.strong and len(lines) > 1)
        x = axis.values if line.x is None else line.x
        if axis.words or axis.name in COUNTED:
            style["linestyle"] = "none"
        if axis.name in COUNTED:  # side by side, as their parts often have the same load
            x = x + 0.5 * ((rank + 0.5) / len(lines) - 0.5)
        thin = max(x.size // 20, 1) if x.size > 60 else 1
        style["markevery"] = thin
        y = np.where(np.isfinite(line.y), line.y, np.nan)
        (drawn,) = panel.plot(x, y, **style)
        entries.setdefault(line.text, drawn)
        if line.published is not None and np.isfinite(line.published).any():
            look = {"linestyle": "none", "marker": "o", "markersize": 7.5, "color": style["color"]}
            (beside,) = panel.plot(x, line.published, markerfacecolor="none", **look)
            single = len(lines) == 1
            entries.setdefault("Published" if single else f"{line.text}, published", beside)
        for why in sorted({str(said) for said in line.said if said}):
            if why == NO_VALUE and axis.name in COUNTED:
                continue  # the engine has no such part
            places = line.said == why
            if np.isfinite(y[places]).any():  # a number, though not to the tolerance
                panel.plot(x[places][::thin], y[places][::thin], **doubt_look(9.0))
                remarks[sentence(why)] = Line2D([], [], **doubt_look(9.0))
            else:
                lost_points(panel, x[places][::thin], why, style["color"])
                remarks[sentence(why)] = lost_handle(why)
    if not any(np.isfinite(line.y).any() for line in lines):
        no_ordinate(panel)
    for text, handle in remarks.items():
        entries.pop(text, None)  # outcomes come last in a legend
        entries[text] = handle


def _scalar_label(view: View, names: Sequence[str]) -> str:
    """Label for one variable, or for several of one kind: what their long names share."""
    if len(names) == 1:
        return axis_label(view.array(names[0]), names[0])
    words = [re.findall(r"\w+", name_of(view.array(n), n).lower()) for n in names]
    common = [word for word in words[0] if all(word in other for other in words[1:])]
    common = [word for word in common if word not in ("of", "the", "in", "over", "at", "a")]
    text = " ".join(common) or names[0].split("_")[0].replace("_", " ")
    return sentence(text) + unit_in_brackets(view.array(names[0]))


def _scalar_figure(
    view: View,
    names: Sequence[str],
    along: str,
    over: str | None = None,
    facet: str | None = None,
    more: Sequence[_Line] = (),
    text: str = "Computed",
) -> Figure:
    """Numbers against one axis: a line for each variable, or for each value of a second axis."""
    view = view.only(names, [along, over, facet])
    axis = view.axis(along)
    across = view.axis(facet) if facet else None
    other = view.axis(over) if over else None
    panels_at = pick(across.size, MOST_PANELS, across.nominal) if across else [0]
    rows, columns = grid_of(len(panels_at))
    height = 3.3 if rows * columns == 1 else 0.5 + 1.85 * rows
    figure, panels = new_sheet(rows, columns, height, sharex=True, sharey=True)
    entries: Entries = {}
    room = 5.0 / columns
    picked = pick(other.size, MOST_LINES, other.nominal) if other else [0]
    every = []
    for panel, place in zip(panels, panels_at, strict=False):
        at = {facet: place} if facet else {}
        if over and other:
            lines = [
                _line(view, names[0], {**at, over: i}, other.text(i), strong=i == other.nominal)
                for i in picked
            ]
        elif len(names) == 1:
            lines = [_line(view, names[0], at, text, strong=True), *more]
        else:
            lines = [_line(view, name, at, title_of(view.array(name), name)) for name in names]
        _points(panel, axis, lines, entries)
        every += [line.y for line in lines]
        if across:
            panel.set_title(across.tag(place))
    for panel in panels[: len(panels_at)]:
        parameter_ticks(panel, axis, "x", room)
        free_scale(panel, every)
        degree_ticks(panel, view.array(names[0]))
    bare_panels(panels, len(panels_at), columns)
    for panel in lowest_panels(panels, len(panels_at), columns):
        x_label(panel, axis.label, room)
    label = _scalar_label(view, names)
    if facet:
        left_labels(panels, columns, label, 1.6)
    else:
        y_label(panels[0], label, 2.8)
    notes = [*view.notes(names), picked_text(other), picked_text(across, MOST_PANELS)]
    lonely = list(entries) == ["Computed"]
    return finish(
        figure,
        f"{label.split(HARD_SPACE)[0]} against {key_text(axis)}",
        notes,
        {} if lonely else entries,
        other.label if other else "",
        view.caption,
        below=bool(facet),
        spare=panels[len(panels_at) :],
    )


def _edges(axis: StudyAxis) -> Floats:
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


def _map_figure(view: View, name: str, along: str, up: str, facet: str | None = None) -> Figure:
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
    entries = _hatches(whys, x.size * y.size > MOST_MARKS)
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
    edges = _edges(x), _edges(y)
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
            _hatch(panel, *edges, where, LOST.get(reason, LOST_OTHERWISE)[1])
        elif table.size > MOST_MARKS:
            _hatch(panel, *edges, where, LOST_OTHERWISE[1], "none")
        else:
            rows, columns = np.nonzero(where)
            panel.plot(x.values[columns], y.values[rows], **doubt_look())


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


def _hatch(
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


def _field(view: View, name: str) -> Plates:
    """A number over the axes of a study: line, map, or small multiples of them."""
    idle = [dim for dim in view.axes([name]) if view.idle([name], dim)]
    axes = [dim for dim in view.axes([name]) if dim not in idle]
    numbers = [dim for dim in axes if not view.axis(dim).words]
    wide = [d for d in numbers if view.data.sizes[d] >= FEWEST_OF_MAP and d not in WHOLE]
    stem = name
    if len(wide) >= 2:
        # the two longest, in the order of the archive
        chosen = sorted(wide, key=lambda dim: -view.data.sizes[dim])[:2]
        along, up = (dim for dim in axes if dim in chosen)
        facet = facet_of(view, [name], (along, up))
        stem += f"_map_{along}_{up}" + (f"_by_{facet}" if facet else "")
        yield stem + view.suffix, _map_figure(view, name, along, up, facet)
        if name not in MAIN:
            return
        for dim in wide:
            over = min((d for d in axes if d != dim), key=lambda d: view.data.sizes[d])
            yield f"{name}_{dim}{view.suffix}", _scalar_figure(view, [name], dim, over)
        return
    pool = numbers or axes
    along = max(pool, key=lambda dim: (dim in COUNTED, dim not in WHOLE, view.data.sizes[dim]))
    second = facet_of(view, [name], (along,))
    facet = facet_of(view, [name], (along, second)) if second else None
    stem += f"_{along}" + (f"_by_{facet}" if facet else "")
    yield stem + view.suffix, _scalar_figure(view, [name], along, second, facet)
    for dim in numbers if name in MAIN else ():
        if dim != along and view.data.sizes[dim] > 2:
            yield f"{name}_{dim}{view.suffix}", _scalar_figure(view, [name], dim, along)


def _groups(view: View, names: Sequence[str]) -> list[tuple[str, list[str]]]:
    """Variables that share axes, by the name of their figure; all others alone."""
    groups: list[tuple[str, list[str]]] = []
    taken: set[str] = set()
    for stem, members in TOGETHER.items():
        found = [name for name in members if name in names]
        alike = {(view.array(n).dims, view.array(n).attrs.get("units")) for n in found}
        if len(found) > 1 and len(alike) == 1:
            groups.append((stem, found))
            taken |= set(found)
    return groups + [(name, [name]) for name in names if name not in taken]


def all_numbers(study: Study, names: Sequence[str]) -> Plates:
    """All variables without a running dimension."""
    level = [name for name in names if _is_level(study.view, name)]
    if level:
        yield "summary", _summary(study.view, level)
    for stem, group in _groups(study.view, [name for name in names if name not in level]):
        axes = study.view.axes(group)
        if "design" in axes:
            yield from _over_designs(study, stem, group, axes)
            continue
        view = study.view
        mixed = UNIT_CHANGES.get(group[0], "")
        if mixed in axes:
            view = view.cut({mixed: view.default(mixed)})
            axes.remove(mixed)
        if len(axes) == 1:
            yield f"{stem}_{axes[0]}", _scalar_figure(view, group, axes[0])
        elif axes:
            for name in group:
                yield from _field(view, name)


def _is_level(view: View, name: str) -> bool:
    """Whether one number says all of a variable: it has no axis, or none does anything to it.

    So does "no value", where there is none and no design failed.
    """
    axes, array = view.axes([name]), view.array(name)
    if not axes:
        return True
    if array.size <= MOST_READ and not np.isfinite(np.asarray(array.values, dtype=float)).any():
        return bool((view.outcomes(name, array, {}) == NO_VALUE).all())
    return all(view.idle([name], dim) for dim in axes)


def _over_designs(study: Study, stem: str, group: Sequence[str], axes: Sequence[str]) -> Plates:
    """Variables over a list of designs: along each parameter that has a family."""
    if len(axes) > 1:
        if study.base:
            for (_, view), name in ((pair, name) for pair in study.base for name in group):
                yield from _field(view, name)
        else:
            for name in group:
                yield from _field(study.view, name)
        return
    if study.base:
        if group[0] in MAIN:
            for parameter, view in study.base:
                yield stem_of(group[0], view, parameter), _family_figure(study, group[0], parameter)
        else:
            families = [
                (p, view)
                for p, view in study.base
                if p != UNIT_CHANGES.get(group[0]) and view.varies(group, p)
            ]
            if len(families) == 1:
                ((parameter, view),) = families
                yield stem, _scalar_figure(view, group, parameter)
            elif families:
                yield stem, _family_panels(study.view, group, families)
    if not study.base or (group[0] in MAIN and study.apart):
        size = study.view.data.sizes["design"]
        parameters = [
            key for key in parameters_of(study.view.data) if not is_words(study.view.array(key))
        ]
        if size <= MOST_ROWS or not parameters:
            yield f"{stem}_cases", _case_chart(study.view, group)
        else:
            yield f"{stem}_cases", _scatter(study.view, group, parameters)


def _family_figure(study: Study, name: str, parameter: str) -> Figure:
    """One variable against one parameter, with the families that lie elsewhere."""
    view = dict(study.base)[parameter]
    aside = [
        (other, keys)
        for key, other, keys in study.aside
        if key == parameter and not view.axis(parameter).words  # words have no common places
    ]
    more = [
        _line(other, name, {}, other.fixed["design"], x=other.axis(parameter).values)
        for other, _ in aside
    ]
    apart = dict.fromkeys(key for _, keys in aside for key in keys)
    tags = [design_text(study.view.data, key, 0) for key in apart]
    text = f"{', '.join(tags)} (nominal)" if more else "Computed"
    same = [text for text in view.others if text not in tags]
    view = replace(view, others=tuple(same))
    return _scalar_figure(view, [name], parameter, more=more, text=text)


def _line_text(view: View, name: str, group: Sequence[str]) -> str:
    """What a line is called: by its variable where there are several."""
    return title_of(view.array(name), name) if len(group) > 1 else "Computed"


def _family_panels(
    view: View, group: Sequence[str], families: Sequence[tuple[str, View]]
) -> Figure:
    """Small multiples: the same variables along one parameter after the other."""
    picked = families[:MOST_PANELS]
    lines = [
        [_line(family, name, {}, _line_text(family, name, group)) for name in group]
        for _, family in picked
    ]
    ordinates = [[line.y for line in some] for some in lines]
    share = comparable(ordinates)
    rows, columns = grid_of(len(picked))
    figure, panels = new_sheet(rows, columns, 2.05 * rows, sharey=share)
    entries: Entries = {}
    for panel, (parameter, family), some in zip(panels, picked, lines, strict=False):
        _points(panel, family.axis(parameter), some, entries)
    for panel, (parameter, family), own in zip(panels, picked, ordinates, strict=False):
        axis = family.axis(parameter)
        free_scale(panel, [y for each in ordinates for y in each] if share else own)
        parameter_ticks(panel, axis, "x", 5.4 / columns)
        x_label(panel, axis.label, 5.4 / columns)
    for panel in panels[len(picked) :]:
        panel.set_visible(False)
    label = _scalar_label(view, group)
    left_labels(panels, columns, label, 1.5)
    notes = [*view.notes(group), "" if share else OWN_ORDINATES]
    if list(entries) == ["Computed"]:
        entries = {}
    return finish(
        figure,
        f"{label.split(HARD_SPACE)[0]}, one parameter varied at a time",
        notes,
        entries,
        caption=f"Nominal: {', '.join(view.others)}",
        below=True,
        spare=panels[len(picked) :],
    )


def _case_chart(view: View, group: Sequence[str]) -> Figure:
    """Unrelated designs: a row for each."""
    axis = view.axis("design")
    rows = [axis.tag(i) if axis.words else number_text(axis.values[i]) for i in range(axis.size)]
    picked = pick(axis.size, MOST_ROWS)
    figure, panels = new_sheet(1, 1, 0.7 + 0.2 * len(picked))
    panel = panels[0]
    entries: Entries = {}
    for rank, name in enumerate(group):
        line = _line(view, name, {}, _line_text(view, name, group))
        style = line_style(rank, len(group)) | {"linestyle": "none"}
        y = np.arange(len(picked))
        (drawn,) = panel.plot(line.y[picked], y, **style)
        entries[line.text] = drawn
        if line.published is not None and np.isfinite(line.published).any():
            (beside,) = panel.plot(
                line.published[picked],
                y,
                "o",
                markersize=8,
                markerfacecolor="none",
                color=style["color"],
            )
            entries.setdefault("Published", beside)
        for why in sorted({str(said) for said in line.said if said}):
            if why == NO_VALUE and axis.name in COUNTED:
                continue  # the engine has no such part
            places = np.flatnonzero(line.said[picked] == why)
            if np.isfinite(line.y[picked][places]).any():
                panel.plot(line.y[picked][places], places, **doubt_look(9.0))
                continue
            panel.plot(
                np.full(places.size, 0.01),
                places,
                transform=panel.get_yaxis_transform(),
                **lost_look(why, GREY),
            )
            entries.setdefault(sentence(why), lost_handle(why))
    panel.set_yticks(range(len(picked)), [rows[i] for i in picked])
    panel.set_ylim(len(picked) - 0.5, -0.5)
    label = _scalar_label(view, group)
    x_label(panel, label, 4.5)
    notes = [*view.notes(group), picked_text(axis, MOST_ROWS)]
    if list(entries) == ["Computed"]:
        entries = {}
    return finish(figure, f"{label.split(HARD_SPACE)[0]}, case by case", notes, entries)


def _scatter(view: View, group: Sequence[str], parameters: Sequence[str]) -> Figure:
    """Many unrelated designs: the variable against each parameter."""
    from matplotlib.lines import Line2D

    drawn = list(parameters)[:MOST_PANELS]
    rows, columns = grid_of(len(drawn))
    height = 2.05 * rows
    figure, panels = new_sheet(rows, columns, height, sharey=True)
    entries: Entries = {}
    size = view.data.sizes["design"]
    picked = pick(size, 5000)
    lines = [_line(view, name, {}, _line_text(view, name, group)) for name in group]
    for panel, parameter in zip(panels, drawn, strict=False):
        variable = view.array(parameter)
        x = np.asarray(variable.values, dtype=float)[picked]
        for rank, line in enumerate(lines):
            colour = line_style(rank, len(lines))["color"]
            (dots,) = panel.plot(
                x, line.y[picked], ".", color=colour, markersize=2.5, rasterized=True
            )
            entries.setdefault(line.text, dots)
            for why in sorted({str(said) for said in line.said if said}):
                places = line.said[picked] == why
                if np.isfinite(line.y[picked][places]).any():
                    panel.plot(x[places], line.y[picked][places], **doubt_look())
                    entries.setdefault(sentence(why), Line2D([], [], **doubt_look()))
                else:
                    lost_points(panel, x[places], why)
                    entries.setdefault(sentence(why), lost_handle(why))
        known = np.unique(x[np.isfinite(x)])
        if is_log(known):
            panel.set_xscale("log")
            log_ticks(panel.xaxis, known[0], known[-1])
        free_scale(panel, [line.y for line in lines])
        x_label(panel, axis_label(variable, parameter), 5.4 / columns)
    for panel in panels[len(drawn) :]:
        panel.set_visible(False)
    label = _scalar_label(view, group)
    left_labels(panels, columns, label, 1.6)
    notes = list(view.notes(group))
    if len(picked) < size:
        notes.append(f"{len(picked)} of {size} designs shown")
    if list(entries) == ["Computed"]:
        entries = {}
    title = f"{label.split(HARD_SPACE)[0]}, all designs"
    spare = panels[len(drawn) :]
    return finish(figure, title, notes, entries, below=True, spare=spare)


def _summary(view: View, names: Sequence[str]) -> Figure:
    """Single numbers as a table, with those that are the same in all designs."""
    listed = list(names)[:MOST_ROWS]
    figure, panels = new_sheet(1, 1, 0.3 + 0.2 * len(listed))
    panel = panels[0]
    panel.axis("off")
    panel.set(xlim=(0, 1), ylim=(len(listed) + 0.5, -0.7))
    alike = [name for name in listed if view.axes([name])]
    for row, name in enumerate(listed):
        variable = view.only([name], ()).array(name)
        value = float(variable.values)
        if name == "status":
            said = meanings_of(variable).get(int(value), number_text(value))
        elif np.isfinite(value):
            said = with_unit(variable, value)
        else:
            said = str(view.outcomes(name, variable, {}))
        beside = _published_number(view, name)
        if beside is not None:
            said += f" (published: {number_text(beside)})"
        cells = [
            wrap(sentence(name_of(variable, name)), 70).split("\n")[0],
            symbol_of(variable),
            said,
        ]
        for x, text in zip((0.0, 0.62, 0.74), cells, strict=True):
            panel.text(x, row, text, va="center")
        panel.axhline(row + 0.5, color="#dcdcdc", linewidth=0.5)
    notes = []
    if alike:
        these = ", ".join(symbol_of(view.array(n)) or name_of(view.array(n), n) for n in alike)
        notes.append(f"{these}: {same_over(view.axes(alike))}")
    return finish(figure, "Summary", [*view.notes(listed), *notes], caption=view.caption)


def _published_number(view: View, name: str) -> float | None:
    """What is published beside a number: one value, of whichever design."""
    other = view.published(name, everywhere=True)
    if other is None:
        return None
    values = np.asarray(view.array(other).values, dtype=float)
    known = np.unique(values[np.isfinite(values)])
    return float(known[0]) if known.size == 1 else None


def outcomes_map(study: Study) -> Plates:
    """What became of the designs, where two axes or more tell something about it."""
    from matplotlib.patches import Patch

    if not study.view.has("status"):
        return
    view = study.view
    axes = [dim for dim in view.axes(["status"]) if dim != "design"]
    codes = view.array("status").values
    if len(axes) < 2 or np.isin(codes, SOUND).all():
        return
    numeric = [dim for dim in axes if not view.axis(dim).words]
    pool = numeric if len(numeric) >= 2 else axes
    chosen = sorted(pool, key=lambda dim: -view.data.sizes[dim])[:2]
    along, up = (dim for dim in axes if dim in chosen)
    facet = facet_of(view, ["status"], (along, up))
    view = view.only(["status"], [along, up, facet])
    x, y = view.axis(along), view.axis(up)
    across = view.axis(facet) if facet else None
    places = pick(across.size, MOST_PANELS, across.nominal) if across else [0]
    rows, columns = grid_of(len(places))
    height = 3.9 if rows * columns == 1 else 0.6 + 1.85 * rows
    figure, panels = new_sheet(rows, columns, height, sharex=True, sharey=True)
    meanings = meanings_of(view.array("status"))
    present = [int(code) for code in np.unique(codes)]
    hatches = {
        code: "" if code in SOUND else LOST.get(meanings.get(code, ""), LOST_OTHERWISE)[1]
        for code in present
    }
    greys = {code: str(0.97 - 0.09 * rank) for rank, code in enumerate(present)}
    room = 6.0 / columns
    for panel, place in zip(panels, places, strict=False):
        array = view.array("status")
        array = array.isel({facet: place}) if facet else array
        table = array.transpose(up, along).values
        panel.grid(False)
        panel.spines[:].set_visible(True)
        for code in present:
            _hatch(panel, _edges(x), _edges(y), table == code, hatches[code], greys[code])
        parameter_ticks(panel, x, "x", room)
        parameter_ticks(panel, y, "y", 0.7 * height / rows)
        panel.set_xlim(*_edges(x)[[0, -1]].tolist())
        panel.set_ylim(*_edges(y)[[0, -1]].tolist())
        if across:
            panel.set_title(across.tag(place))
    bare_panels(panels, len(places), columns)
    for panel in lowest_panels(panels, len(places), columns):
        x_label(panel, x.label, room)
    for panel in panels[::columns]:
        y_label(panel, y.label, height / rows * 0.75)
    entries: Entries = {
        f"{sentence(meanings.get(code, str(code)))} ({_share(codes == code)})": Patch(
            facecolor=greys[code], edgecolor=GREY, hatch=hatches[code], linewidth=0.5
        )
        for code in present
    }
    notes = [*view.notes(["status"]), picked_text(across, MOST_PANELS)]
    title = f"Outcome of the designs over {key_text(x)} and {key_text(y)}"
    stem = "status" + (f"_by_{facet}" if facet else "")
    yield stem, finish(figure, title, notes, entries, caption=view.caption, below=True)


def _share(where: NDArray[Any]) -> str:
    """A part of all designs, in percent; some are never none."""
    part = 100 * float(np.mean(where))
    return f"{part:.3g} %" if part >= 0.1 else f"{int(where.sum())} of {where.size}"
