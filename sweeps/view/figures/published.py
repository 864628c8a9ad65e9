"""Computed values compared with published ones."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from engine_dyn.types import Floats
from sweeps.base.dimensions import PUBLISHED
from sweeps.view.figures.marks import line_style, shade
from sweeps.view.figures.scales import log_ticks
from sweeps.view.figures.sheet import (
    GREY,
    Entries,
    NamedFigures,
    finish,
    multiples,
    new_sheet,
    x_label,
)
from sweeps.view.figures.study import Study
from sweeps.view.figures.views import MOST_PANELS, MOST_ROWS, StudyAxis, View
from sweeps.view.figures.wording import number_text, wrap

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


def published_names(view: View) -> list[str]:
    """Computed variables that have published values, over the same axes or more."""
    names = [str(name) for name in view.data.data_vars if view.has(str(name))]
    return [name for name in names if _has_published(view, name)]


def _has_published(view: View, name: str) -> bool:
    other = view.published(name, everywhere=True)
    if other is None or not set(view.array(name).dims) <= set(view.array(other).dims):
        return False
    return bool(np.isfinite(view.numbers(other)).any())


def published(study: Study, names: Sequence[str]) -> NamedFigures:
    """Draw computed against published: differences case by case, and one against the other."""
    view = study.view
    known = {name: np.isfinite(_both(view, name)[1]) for name in published_names(view)}
    several = [name for name, there in known.items() if there.sum() > 2]
    if several:
        yield "published_parity", _parity(view, several)
    dims = {view.array(name + PUBLISHED).dims for name in known}
    if len(dims) == 1 and len(next(iter(dims))) == 1:
        axis = view.axis(str(next(iter(dims))[0]))
        rows = np.flatnonzero(np.any(list(known.values()), axis=0))
        if rows.size == 1 and len(known) > 1:
            yield "published", _differences_of_one(view, list(known), axis, int(rows[0]))
        elif rows.size <= MOST_ROWS:
            yield "published", _differences(view, list(known), axis, rows)


def _both(view: View, name: str) -> tuple[Floats, Floats]:
    """Computed and published values, of one shape: a computed one may hold for many designs."""
    known = view.array(name + PUBLISHED)
    computed = view.array(name).set_dims(dict(known.sizes)).transpose(*known.dims)
    return computed.values.astype(float), known.values.astype(float)


def _percent(view: View, name: str) -> Floats:
    """Computed less published values, in percent of the published ones."""
    computed, known = _both(view, name)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(known != 0, 100 * (computed - known) / np.abs(known), np.nan)


def _differences_of_one(view: View, names: Sequence[str], axis: StudyAxis, design: int) -> Figure:
    """Percent by which the values of one design differ from published ones, a row for each."""
    drawn = names[:MOST_ROWS]
    figure, (panel,) = new_sheet(1, 1, 0.5 + 0.22 * len(drawn))
    percent = [float(_percent(view, name)[design]) for name in drawn]
    panel.plot(percent, np.arange(len(drawn)), "o", color=shade(0.15), markersize=4.5)
    _rows(panel, [view.title(name) for name in drawn])
    title = f"Difference from the published values: {axis.tag(design)}"
    return finish(figure, title, view.notes(drawn, units=False))


def _rows(panel: Axes, texts: Sequence[str]) -> None:
    """A named row for each, from above, and a line at no difference."""
    panel.axvline(0.0, color="black", linewidth=0.8, zorder=1)
    for row in range(1, len(texts)):
        panel.axhline(row - 0.5, color="#e6e6e6", linewidth=0.5, zorder=0.4)
    panel.grid(False, axis="y")
    panel.tick_params("y", length=0)
    panel.set_yticks(range(len(texts)), texts)
    panel.set_ylim(len(texts) - 0.5, -0.5)
    x_label(panel, "Computed less published (%)", 4.5)


def _differences(
    view: View, names: Sequence[str], axis: StudyAxis, rows: NDArray[np.intp]
) -> Figure:
    """Percent by which computed values differ from published ones, a row for each case."""
    from matplotlib.ticker import FuncFormatter, NullLocator, SymmetricalLogLocator

    figure, (panel,) = new_sheet(1, 1, 0.7 + 0.22 * rows.size)
    entries: Entries = {}
    every = [np.zeros(1)]
    for rank, name in enumerate(names):
        percent = _percent(view, name)[rows]
        shift = 0.5 * ((rank + 0.5) / len(names) - 0.5)
        style = line_style(rank, len(names)) | {"linestyle": "none", "markersize": 4.5}
        (entries[view.title(name)],) = panel.plot(percent, np.arange(rows.size) + shift, **style)
        every.append(percent[np.isfinite(percent)])
    _rows(panel, [axis.tag(int(row)) for row in rows])
    size = np.abs(np.concatenate(every))
    if size.max() > 5 and size.max() > 20 * np.median(size):
        panel.set_xscale("symlog", linthresh=0.1, linscale=0.6)
        panel.xaxis.set_major_locator(SymmetricalLogLocator(base=10, linthresh=0.1))
        panel.xaxis.set_minor_locator(NullLocator())
        panel.xaxis.set_major_formatter(FuncFormatter(lambda value, _: number_text(value)))
    title = "Difference from the published values"
    return finish(figure, title, view.notes(names, units=False), entries)


def _parity(view: View, names: Sequence[str]) -> Figure:
    """Computed against published values, one panel for each quantity."""
    drawn = names[:MOST_PANELS]
    sheet = multiples(len(drawn), 0.2, 2.6)
    for panel, name in zip(sheet.panels, drawn, strict=True):
        computed, known = (values.ravel() for values in _both(view, name))
        good = np.isfinite(computed) & np.isfinite(known)
        panel.set_title(wrap(view.label(name), int(72 / sheet.columns)))
        panel.set_box_aspect(1)
        if not good.any():
            continue
        both = np.concatenate([computed[good], known[good]])
        low, high = float(both.min()), float(both.max())
        log = low > 0 and high > 20 * low
        if log:
            pad = (high / low) ** 0.08
            low, high = low / pad, high * pad
        else:
            pad = 0.08 * (high - low) or 1.0
            low, high = low - pad, high + pad
        (line,) = panel.plot([low, high], [low, high], color=GREY, linewidth=0.8)
        look = {"color": shade(0.15), "markerfacecolor": "none"}
        (dots,) = panel.plot(known[good], computed[good], "o", **look)
        sheet.entries.update({"Equal": line, "Case": dots})
        panel.set(xlim=(low, high), ylim=(low, high))
        if log:
            panel.set(xscale="log", yscale="log")
            log_ticks(panel.xaxis, low, high, few=True)
            log_ticks(panel.yaxis, low, high, few=True)
        else:
            panel.locator_params(nbins=4)
    for panel in sheet.lowest:
        panel.set_xlabel("Published")
    sheet.label_y("Computed", 1.5)
    return sheet.finish("Computed against published", view.notes(names))
