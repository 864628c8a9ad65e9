"""Amplitudes over the order: bars for the values of an axis, or a map over the speed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

from engine_dyn.types import Floats
from sweeps.view.figures.maps import (
    cell_edges,
    colour_bar,
    colour_cells,
    colour_scale,
    hatch_lost,
)
from sweeps.view.figures.marks import line_style
from sweeps.view.figures.scales import comparable, degree_ticks, parameter_ticks, whole_ticks
from sweeps.view.figures.shaft_modes import at_largest
from sweeps.view.figures.sheet import (
    OWN_ORDINATES,
    NamedFigures,
    finish,
    multiples,
    new_sheet,
    rc,
    x_label,
    y_label,
)
from sweeps.view.figures.study import Study
from sweeps.view.figures.views import MOST_PANELS, View, facet_of, stem_of

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

NOTHING = 1e-9  # Fraction of the largest order of a figure below which an order is not drawn

SCALES = ("order_frequency",)
"""Proportional to the order: other names of the abscissa, which are drawn only where asked for."""

FAINT = 2e-3  # Fraction of the largest order of a figure below which no bar can be seen


def orders(study: Study, names: Sequence[str]) -> NamedFigures:
    """Draw each variable over the order, along each axis that changes it."""
    for name in names:
        if name in SCALES and name not in study.view.options.quantities:
            continue
        for view, along in study.views_of(name):
            figure = order_figure(view, name, along)
            if figure is not None:
                yield stem_of(name, view, along), figure


def order_figure(view: View, name: str, along: str | None) -> Figure | None:
    """Orders as bars at their order: side by side, or a panel for each value.

    None where every order is zero.
    """
    facet = facet_of(view, [name], [along]) if along else None
    if along and view.data.sizes[along] > 3:
        facet, along = along, None  # Bars of many values would be too narrow
    view = view.only([name], [along, facet]).with_values([name], along, facet)
    axis, across = view.axis(along), view.axis(facet)
    places = [
        [{**across.place(i), **axis.place(j)} for j in axis.picked()]
        for i in across.picked(MOST_PANELS)
    ]
    values = [[view.numbers(name, place) for place in row] for row in places]
    largest = max(_largest(curves) for curves in values)
    if largest == 0.0:
        return None
    least = NOTHING * largest
    order = view.numbers("order")
    angles = view.array(name).attrs.get("units") == "degree"
    rows, left = [], []
    share = comparable(values)
    faint = FAINT * largest if share and not angles else 0.0
    for row, curves in zip(places, values, strict=True):
        known = [
            _has_amplitude(view, name, place, y) if angles else np.abs(y) > least
            for place, y in zip(row, curves, strict=True)
        ]
        if np.any(known) and _largest(curves) >= faint:
            rows.append((row, curves, known))
        else:
            left.append(across.tag(row[0].get(across.name, 0)))
    if not rows:
        return None
    base, each = (0.5, 1.75) if len(rows) > 1 else (3.3, 0.0)
    sheet = multiples(len(rows), base, each, sharex=True, sharey=share)
    there = order[np.any([np.abs(y) > least for row in values for y in row], axis=0)]
    room = float(np.min(np.diff(there if there.size > 1 else order), initial=1.0))
    for panel, (row, curves, known) in zip(sheet.panels, rows, strict=True):
        for rank, (place, y) in enumerate(zip(row, curves, strict=True)):
            draw, some = _marks if angles else _bars, known[rank]
            handle = draw(panel, order[some], y[some], room, (rank, len(row)))
            if np.isfinite(y).any():
                sheet.entries.setdefault(axis.text(place.get(axis.name, 0)), handle)
        panel.set_title(across.tag(row[0].get(across.name, 0)))
        _frame(panel, order, view.array(name))
    sheet.label_x(view.label("order"), 6.3 / sheet.columns)
    sheet.label_y(view.label(name), 1.5 if len(rows) > 1 else 2.8)
    notes = [*view.notes([name]), axis.picked_text(), across.picked_text(MOST_PANELS)]
    notes += [f"almost nothing at any order: {', '.join(left)}"] if left else []
    return sheet.finish(
        (axis or across).by(view.title(name)),
        [*notes, "" if share else OWN_ORDINATES], view.caption,
        legend=bool(axis), legend_title=axis.label, below=bool(across),
    )  # fmt: skip


def _largest(curves: Sequence[Floats]) -> float:
    return max(float(np.nanmax(np.abs(y), initial=0.0)) for y in curves)


def _frame(panel: Axes, order: Floats, variable: xr.Variable) -> None:
    """Draw a line at zero, and set the scales of a panel over all orders."""
    panel.axhline(0.0, color=rc("text.color"), linewidth=0.6)
    degree_ticks(panel, variable)
    panel.set_xlim(order[0] - 0.5, order[-1] + 0.5)
    whole_ticks(panel)


def _side_by_side(places: Floats, room: float, of: tuple[int, int]) -> tuple[Floats, float]:
    """Middles and width of the bars of one of several values, beside those of the others."""
    rank, count = of
    width = room * (0.34 if count == 1 else 0.8 / count)
    return places + (rank - 0.5 * (count - 1)) * width, width


def _bars(panel: Axes, places: Floats, y: Floats, room: float, of: tuple[int, int]) -> Artist:
    """Draw bars at their orders."""
    middles, width = _side_by_side(places, room, of)
    look = {"color": line_style(*of)["color"], "edgecolor": rc("axes.facecolor"), "linewidth": 0.2}
    return panel.bar(middles, y, width, zorder=2.0, **look)  # type: ignore[return-value]


def _marks(panel: Axes, places: Floats, y: Floats, room: float, of: tuple[int, int]) -> Artist:
    """Draw marks at their orders."""
    style = line_style(*of)
    middles, _ = _side_by_side(places, room, of)
    (points,) = panel.plot(
        middles, y, linestyle="none", color=style["color"], marker=style["marker"],
        markersize=3.5, markerfacecolor=style["markerfacecolor"],
    )  # fmt: skip
    return points


def _has_amplitude(view: View, name: str, place: Mapping[str, int], phases: Floats) -> Any:
    """Whether each phase has a meaning: a number whose amplitude in the archive is not 0."""
    known = np.isfinite(phases)
    other = name.removesuffix("_phase") + "_order"
    if other == name or not view.has(other):
        return known
    size = np.abs(view.numbers(other, place))
    return known & (size > NOTHING * np.nanmax(size, initial=0.0))


MAP_HEIGHT = 3.6  # Height in inches of the panel of an order map

FLOOR = 1e-4  # Fraction of the largest amplitude of an order map below which none has a colour


def order_map_names(view: View) -> list[str]:
    """Amplitudes over order and speed."""
    names = [str(name) for name in view.data.data_vars if view.has(str(name))]
    # Orders at one or two speeds are drawn as bars side by side.
    return [
        name
        for name in names
        if {"speed", "order"} <= set(view.array(name).dims)
        and "mode" not in view.array(name).dims  # Quantities of modes are in the Campbell diagram
        and (name not in SCALES or name in view.options.quantities)
        and view.data.sizes["speed"] >= 3
        and not view.axis("speed").words
        and view.array(name).attrs.get("units") != "degree"  # Phases have no height
    ]


def order_maps(study: Study, names: Sequence[str]) -> NamedFigures:
    """Draw each amplitude over order and speed; other axes are cut at one slice."""
    for name in names:
        for whole, along in study.views_by_axis([name]):
            view = at_largest(whole, name).only([name], ["speed"])
            if along == "speed" and _largest([view.numbers(name)]):
                yield stem_of(f"{name}_map", view, None), _order_map(view, name)


def _order_map(view: View, name: str) -> Figure:
    """Amplitudes as colours on a logarithmic scale, where small ones are seen beside large ones."""
    axis, order = view.axis("speed"), view.numbers("order")
    array = view.array(name).transpose("speed", "order")
    half = 0.5 * float(np.min(np.diff(order), initial=1.0))
    # A column for each order, and one without colour before the next, which is narrow or empty.
    x, y = np.stack([order - half, order + half], axis=1).ravel(), cell_edges(axis)
    sizes = np.full((axis.size, 2 * order.size - 1), np.nan)
    sizes[:, ::2] = np.abs(np.asarray(array.values, dtype=float))
    why = np.full(sizes.shape, "", dtype=object)
    why[:, ::2] = np.where(np.isfinite(sizes[:, ::2]), "", view.outcomes(name, array, {}))
    seen = np.isfinite(sizes) & (sizes >= FLOOR * _largest([sizes]))
    figure, (panel,) = new_sheet(1, 1, MAP_HEIGHT)
    norm, levels = colour_scale(sizes[seen])
    colour_cells(panel, (x, y), np.where(seen, sizes, np.nan), norm)
    entries = hatch_lost(panel, (x, y), why)
    panel.grid(False)
    panel.spines[:].set_visible(True)
    parameter_ticks(panel, axis, "y", 0.7 * MAP_HEIGHT)
    drawn = order[seen[:, ::2].any(axis=0)]
    panel.set_xlim(drawn[0] - half, drawn[-1] + half)
    panel.set_ylim(*y[[0, -1]].tolist())
    whole_ticks(panel)
    x_label(panel, view.label("order"), 5.0)
    y_label(panel, axis.label, 3.0)
    colour_bar(figure, [panel], norm, levels, view.label(name), MAP_HEIGHT)
    notes = [*view.notes([name]), f"white: none, or less than 1/{1.0 / FLOOR:.0f} of the largest"]
    title = f"{view.title(name)} over order and speed"
    return finish(figure, title, notes, entries, caption=view.caption)
