"""Orders as bars over the order, for the values of an axis in front of each other."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from engine_dyn.types import Floats
from sweeps.figures.marks import line_style
from sweeps.figures.scales import comparable, degree_ticks, left_labels, x_label
from sweeps.figures.sheet import (
    OWN_ORDINATES,
    Entries,
    NamedFigures,
    bare_panels,
    finish,
    grid_of,
    lowest_panels,
    new_sheet,
    rc,
)
from sweeps.figures.study import Study
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
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


MOST_NESTED = 3
"""Values of an axis whose bars stand in front of each other; more get a panel each."""

NOTHING = 1e-9
"""Fraction of the largest order of a figure below which an order is not drawn."""


def orders(study: Study, names: Sequence[str]) -> NamedFigures:
    """Draw each variable over the order, along each axis that changes it."""
    for name in names:
        for view, along in study.views_of(name):
            figure = order_figure(view, name, along)
            if figure is not None:
                yield stem_of(name, view, along), figure


def order_figure(view: View, name: str, along: str | None) -> Figure | None:
    """Orders as bars at their order: one in front of the other, or a panel for each value.

    None where every order is zero.
    """
    from matplotlib.ticker import MaxNLocator

    facet = facet_of(view, [name], [along]) if along else None
    if along and view.data.sizes[along] > MOST_NESTED:
        facet, along = along, None  # bars of many values hide each other
    view = view.only([name], [along, facet])
    axis = view.axis(along) if along else None
    across = view.axis(facet) if facet else None
    shown = pick(across.size, MOST_PANELS, across.nominal) if across else [0]
    picked = pick(axis.size, MOST_LINES, axis.nominal) if axis else [0]
    rows, columns = grid_of(len(shown))
    values = [
        [_order_values(view, name, {**place_on(across, i), **place_on(axis, j)}) for j in picked]
        for i in shown
    ]
    if not any(np.nan_to_num(y).any() for each in values for y in each):
        return None
    share = comparable(values)
    height = 0.5 + 1.75 * rows if across else 3.3
    figure, panels = new_sheet(rows, columns, height, sharex=True, sharey=share)
    places = np.asarray(view.data.variables["order"].values, dtype=float)
    angles = view.array(name).attrs.get("units") == "degree"
    least = NOTHING * max(float(np.nanmax(np.abs(y), initial=0.0)) for v in values for y in v)
    there = [np.abs(y) > least for v in values for y in v]
    drawn = places[np.any(there, axis=0)]
    room = float(np.min(np.diff(drawn if drawn.size > 1 else places), initial=1.0))
    entries: Entries = {}
    for panel, index, each in zip(panels, shown, values, strict=False):
        any_drawn = False
        for rank, (value, y) in enumerate(zip(picked, each, strict=True)):
            text = axis.text(value) if axis else title_of(view.array(name), name)
            known = np.isfinite(y)
            if angles:  # an order without amplitude has phase 0, which is not drawn
                known &= _has_amplitude(
                    view, name, {**place_on(across, index), **place_on(axis, value)}
                )
            else:
                known &= np.abs(y) > least
            any_drawn |= bool(known.any())
            handle = (_marks if angles else _bars)(
                panel, places[known], y[known], room, (rank, len(picked))
            )
            if np.isfinite(y).any():
                entries.setdefault(text, handle)
        if not any_drawn:
            panel.text(0.5, 0.6, "zero at every order", transform=panel.transAxes, ha="center")
        panel.axhline(0.0, color=rc("text.color"), linewidth=0.6)
        if angles:
            degree_ticks(panel, view.array(name))
        panel.set_xlim(places[0] - 0.5, places[-1] + 0.5)
        panel.xaxis.set_major_locator(MaxNLocator(integer=True))
        if across:
            panel.set_title(across.tag(index))
    bare_panels(panels, len(shown), columns)
    for panel in lowest_panels(panels, len(shown), columns):
        x_label(panel, axis_label(view.data.variables["order"], "order"), 6.3 / columns)
    label = axis_label(view.array(name), name)
    left_labels(panels, columns, label, 1.5 if across else 2.8)
    title = title_of(view.array(name), name)
    by = axis or across
    notes = [*view.notes([name]), picked_text(axis), picked_text(across, MOST_PANELS)]
    return finish(
        figure, f"{title} by {key_text(by)}" if by else title,
        [*notes, "" if share else OWN_ORDINATES], entries if axis else None,
        axis.label if axis else "", view.caption, below=across is not None,
        spare=panels[len(shown) :] if across else (),
    )  # fmt: skip


def _bars(panel: Axes, places: Floats, y: Floats, room: float, of: tuple[int, int]) -> Artist:
    """Bars at their orders, narrower from value to value so that each is seen; colours of lines."""
    rank, count = of
    width = room * (0.34 if count == 1 else 0.8 * (1.0 - rank / count))
    colour = line_style(rank, count)["color"]
    look = {"color": colour, "edgecolor": rc("axes.facecolor"), "linewidth": 0.3}
    return panel.bar(places, y, width, zorder=2.0 + 0.1 * rank, **look)  # type: ignore[return-value]


def _marks(panel: Axes, places: Floats, y: Floats, room: float, of: tuple[int, int]) -> Artist:
    """Marks at their orders, smaller from value to value so that each is seen."""
    rank, count = of
    style = line_style(rank, count)
    (points,) = panel.plot(
        places, y, linestyle="none", color=style["color"], marker=style["marker"],
        markersize=3.5 + 2.0 * (count - 1 - rank),
        markerfacecolor=style["color"] if rank == count - 1 else "none",
    )  # fmt: skip
    return points


def _has_amplitude(view: View, name: str, place: Mapping[str, int]) -> Any:
    """Where a phase has a meaning: its amplitude, if the archive has it, is not 0."""
    other = name.removesuffix("_phase") + "_order"
    if other == name or not view.has(other):
        return True
    size = np.abs(_order_values(view, other, place))
    return size > NOTHING * np.nanmax(size, initial=0.0)


def _order_values(view: View, name: str, place: Mapping[str, int]) -> Floats:
    array = view.array(name)
    array = array.isel({dim: i for dim, i in place.items() if dim in array.dims})
    return np.asarray(array.values, dtype=float)
