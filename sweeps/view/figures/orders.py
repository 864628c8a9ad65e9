"""Orders as bars over the order, for the values of an axis in front of each other."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

from engine_dyn.types import Floats
from sweeps.view.figures.marks import line_style
from sweeps.view.figures.multiples import multiples
from sweeps.view.figures.scales import comparable, degree_ticks, whole_ticks
from sweeps.view.figures.sheet import OWN_ORDINATES, NamedFigures, rc
from sweeps.view.figures.study import Study
from sweeps.view.figures.views import MOST_PANELS, View, facet_of, stem_of

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
    facet = facet_of(view, [name], [along]) if along else None
    if along and view.data.sizes[along] > MOST_NESTED:
        facet, along = along, None  # bars of many values hide each other
    view = view.only([name], [along, facet])
    axis, across = view.axis(along), view.axis(facet)
    places = [
        [{**across.place(i), **axis.place(j)} for j in axis.picked()]
        for i in across.picked(MOST_PANELS)
    ]
    values = [[view.numbers(name, place) for place in row] for row in places]
    least = NOTHING * max(float(np.nanmax(np.abs(y), initial=0.0)) for row in values for y in row)
    if least == 0.0:
        return None
    share = comparable(values)
    base, each = (0.5, 1.75) if across else (3.3, 0.0)
    sheet = multiples(len(places), base, each, sharex=True, sharey=share)
    order = view.numbers("order")
    angles = view.array(name).attrs.get("units") == "degree"
    there = order[np.any([np.abs(y) > least for row in values for y in row], axis=0)]
    room = float(np.min(np.diff(there if there.size > 1 else order), initial=1.0))
    for panel, row, curves in zip(sheet.panels, places, values, strict=True):
        any_drawn = False
        for rank, (place, y) in enumerate(zip(row, curves, strict=True)):
            known = _has_amplitude(view, name, place, y) if angles else np.abs(y) > least
            any_drawn |= bool(known.any())
            draw = _marks if angles else _bars
            handle = draw(panel, order[known], y[known], room, (rank, len(row)))
            if np.isfinite(y).any():
                sheet.entries.setdefault(axis.text(place.get(axis.name, 0)), handle)
        if not any_drawn:
            panel.text(0.5, 0.6, "zero at every order", transform=panel.transAxes, ha="center")
        panel.set_title(across.tag(row[0].get(across.name, 0)))
        _frame(panel, order, view.array(name))
    sheet.label_x(view.label("order"), 6.3 / sheet.columns)
    sheet.label_y(view.label(name), 1.5 if across else 2.8)
    notes = [*view.notes([name]), axis.picked_text(), across.picked_text(MOST_PANELS)]
    return sheet.finish(
        (axis or across).by(view.title(name)),
        [*notes, "" if share else OWN_ORDINATES], view.caption,
        legend=bool(axis), legend_title=axis.label, below=bool(across),
    )  # fmt: skip


def _frame(panel: Axes, order: Floats, variable: xr.Variable) -> None:
    """Line at zero, and the scales of a panel over all orders."""
    panel.axhline(0.0, color=rc("text.color"), linewidth=0.6)
    degree_ticks(panel, variable)
    panel.set_xlim(order[0] - 0.5, order[-1] + 0.5)
    whole_ticks(panel)


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


def _has_amplitude(view: View, name: str, place: Mapping[str, int], phases: Floats) -> Any:
    """Where a phase has a meaning: it is a number, and its amplitude in the archive is not 0."""
    known = np.isfinite(phases)
    other = name.removesuffix("_phase") + "_order"
    if other == name or not view.has(other):
        return known
    size = np.abs(view.numbers(other, place))
    return known & (size > NOTHING * np.nanmax(size, initial=0.0))
