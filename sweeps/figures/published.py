"""Computed values beside published ones."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from engine_dyn.types import Floats
from sweeps.figures.marks import line_style, shade
from sweeps.figures.scales import left_labels, log_ticks, x_label
from sweeps.figures.sheet import (
    GREY,
    Entries,
    NamedFigures,
    finish,
    grid_of,
    lowest_panels,
    new_sheet,
)
from sweeps.figures.study import Study
from sweeps.figures.views import MOST_PANELS, MOST_ROWS, StudyAxis, View
from sweeps.figures.wording import axis_label, number_text, wrap

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


def published_names(view: View) -> list[str]:
    """Computed variables with published values beside them, over the same axes or more."""
    return [name for name, _ in _pairs(view)]


def _pairs(view: View) -> list[tuple[str, str]]:
    pairs = [
        (str(name), other)
        for name in view.data.data_vars
        if view.has(str(name)) and (other := view.published(str(name), everywhere=True))
    ]
    pairs = [(n, o) for n, o in pairs if set(view.array(n).dims) <= set(view.array(o).dims)]
    return [(n, o) for n, o in pairs if np.isfinite(view.array(o).values.astype(float)).any()]


def published(study: Study, names: Sequence[str]) -> NamedFigures:
    """Draw computed against published: differences case by case, and one against the other."""
    view = study.view
    pairs = _pairs(view)
    several = [
        (name, other)
        for name, other in pairs
        if np.isfinite(view.array(other).values.astype(float)).sum() > 2
    ]
    if several:
        yield "published_parity", _parity(view, several)
    dims = {view.array(other).dims for _, other in pairs}
    if len(dims) == 1 and len(next(iter(dims))) == 1:
        axis = view.axis(str(next(iter(dims))[0]))
        known = np.any([np.isfinite(view.array(o).values.astype(float)) for _, o in pairs], axis=0)
        rows = np.flatnonzero(known)
        if rows.size == 1 and len(pairs) > 1:
            yield "published", _differences_of_one(view, pairs, axis, int(rows[0]))
        elif rows.size <= MOST_ROWS:
            yield "published", _differences(view, pairs, axis, rows)


def _both(view: View, name: str, other: str) -> tuple[Floats, Floats]:
    """Computed and published values, of one shape: a computed one may hold for many designs."""
    known = view.array(other)
    computed = view.array(name).set_dims(dict(known.sizes)).transpose(*known.dims)
    return computed.values.astype(float), known.values.astype(float)


def _percent(computed: Floats, known: Floats) -> Floats:
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(known != 0, 100 * (computed - known) / np.abs(known), np.nan)


def _differences_of_one(
    view: View, pairs: Sequence[tuple[str, str]], axis: StudyAxis, design: int
) -> Figure:
    """Percent by which the values of one design differ from published ones, a row for each."""
    drawn = list(pairs)[:MOST_ROWS]
    figure, panels = new_sheet(1, 1, 0.5 + 0.22 * len(drawn))
    panel = panels[0]
    both = [_both(view, name, other) for name, other in drawn]
    percent = [float(_percent(ours[design], theirs[design])) for ours, theirs in both]
    panel.plot(percent, np.arange(len(drawn)), "o", color=shade(0.15), markersize=4.5)
    names = [view.title(name) for name, _ in drawn]
    _rows(panel, names)
    x_label(panel, "Computed less published (%)", 4.5)
    title = f"Difference from the published values: {axis.tag(design)}"
    return finish(figure, title, view.notes([n for n, _ in drawn], units=False))


def _rows(panel: Axes, names: Sequence[str]) -> None:
    """A named row for each, from above, and a line at no difference."""
    panel.axvline(0.0, color="black", linewidth=0.8, zorder=1)
    for row in range(1, len(names)):
        panel.axhline(row - 0.5, color="#e6e6e6", linewidth=0.5, zorder=0.4)
    panel.grid(False, axis="y")
    panel.tick_params("y", length=0)
    panel.set_yticks(range(len(names)), names)
    panel.set_ylim(len(names) - 0.5, -0.5)


def _differences(
    view: View, pairs: Sequence[tuple[str, str]], axis: StudyAxis, rows: NDArray[np.intp]
) -> Figure:
    """Percent by which computed values differ from published ones, a row for each case."""
    from matplotlib.ticker import FuncFormatter, NullLocator, SymmetricalLogLocator

    figure, panels = new_sheet(1, 1, 0.7 + 0.22 * rows.size)
    panel = panels[0]
    entries: Entries = {}
    every = [np.zeros(1)]
    for rank, (name, other) in enumerate(pairs):
        computed, known = _both(view, name, other)
        percent = _percent(computed[rows], known[rows])
        shift = 0.5 * ((rank + 0.5) / len(pairs) - 0.5)
        style = line_style(rank, len(pairs)) | {"linestyle": "none", "markersize": 4.5}
        (dots,) = panel.plot(percent, np.arange(rows.size) + shift, **style)
        entries[view.title(name)] = dots
        every.append(percent[np.isfinite(percent)])
    _rows(panel, [axis.tag(int(row)) for row in rows])
    size = np.abs(np.concatenate(every))
    if size.max() > 5 and size.max() > 20 * np.median(size):
        panel.set_xscale("symlog", linthresh=0.1, linscale=0.6)
        panel.xaxis.set_major_locator(SymmetricalLogLocator(base=10, linthresh=0.1))
        panel.xaxis.set_minor_locator(NullLocator())
        panel.xaxis.set_major_formatter(FuncFormatter(lambda value, _: number_text(value)))
    x_label(panel, "Computed less published (%)", 4.5)
    title = "Difference from the published values"
    return finish(figure, title, view.notes([n for n, _ in pairs], units=False), entries)


def _parity(view: View, pairs: Sequence[tuple[str, str]]) -> Figure:
    """Computed against published values, one panel for each quantity."""
    drawn = list(pairs)[:MOST_PANELS]
    rows, columns = grid_of(len(drawn))
    figure, panels = new_sheet(rows, columns, 0.2 + 2.6 * rows)
    entries: Entries = {}
    for panel, (name, other) in zip(panels, drawn, strict=False):
        computed, known = (values.ravel() for values in _both(view, name, other))
        good = np.isfinite(computed) & np.isfinite(known)
        both = np.concatenate([computed[good], known[good]])
        variable = view.array(name)
        panel.set_title(wrap(axis_label(variable, name), int(72 / columns)))
        if both.size:
            log = both.min() > 0 and both.max() > 20 * both.min()
            pad = (both.max() / both.min()) ** 0.08 if log else 0.08 * np.ptp(both) or 1.0
            low, high = (
                (both.min() / pad, both.max() * pad)
                if log
                else (both.min() - pad, both.max() + pad)
            )
            (line,) = panel.plot([low, high], [low, high], color=GREY, linewidth=0.8)
            (dots,) = panel.plot(
                known[good], computed[good], "o", color=shade(0.15), markerfacecolor="none"
            )
            entries["Equal"] = line
            entries["Case"] = dots
            panel.set(xlim=(low, high), ylim=(low, high))
            if log:
                panel.set(xscale="log", yscale="log")
                log_ticks(panel.xaxis, low, high, few=True)
                log_ticks(panel.yaxis, low, high, few=True)
            else:
                panel.locator_params(nbins=4)
        panel.set_box_aspect(1)
    for panel in panels[len(drawn) :]:
        panel.set_visible(False)
    for panel in lowest_panels(panels, len(drawn), columns):
        panel.set_xlabel("Published")
    left_labels(panels, columns, "Computed", 1.5)
    notes = view.notes([n for n, _ in pairs])
    title = "Computed against published"
    spare = panels[len(drawn) :]
    return finish(figure, title, notes, entries, below=True, spare=spare)
