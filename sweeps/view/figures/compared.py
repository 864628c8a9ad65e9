"""Two archives in one chart, with their difference below, and computed beside published values.

Two archives come from `sweeps.decide.explore.compare`: a variable of the second archive has the
name of the first's with `_compared` at its end. A difference is that of the second less the first,
over the first; along a curve that runs through the cycle or the orders, over the first's largest
magnitude, since such curves pass through zero.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from engine_dyn.types import Floats
from sweeps.base.dimensions import COMPARED, PUBLISHED
from sweeps.view.figures.angle_lines import set_cycle, trace
from sweeps.view.figures.marks import DASHES, line_style, shade
from sweeps.view.figures.scales import free_scale, log_ticks, parameter_ticks, whole_ticks
from sweeps.view.figures.sheet import (
    GREY,
    Entries,
    NamedFigures,
    finish,
    multiples,
    new_sheet,
    rc,
    x_label,
    y_label,
)
from sweeps.view.figures.study import Study
from sweeps.view.figures.views import (
    MOST_PANELS,
    MOST_ROWS,
    RUNNING,
    StudyAxis,
    View,
    pick,
    stem_of,
)
from sweeps.view.figures.wording import name_of, plain_text, typeset, with_unit, wrap

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

SECOND = "#c05a1c"


def compared_names(view: View) -> list[str]:
    """Quantities of which there is one of the second archive."""
    names = [str(name) for name in view.data.data_vars if view.has(str(name))]
    return [name for name in names if view.has(name + COMPARED)]


def compared(study: Study, names: Sequence[str]) -> NamedFigures:
    """Draw each quantity that differs: over the cycle, the orders, or along each axis.

    What is one number in both archives is in one chart of bars.
    """
    single = []
    for name in names:
        pair = (name, name + COMPARED)
        dims = study.view.array(name).dims
        running = next((dim for dim in RUNNING if dim in dims), None)
        if not _differs(study.view, name):
            continue
        if not dims:
            single.append(name)
        elif running is not None:
            view = study.view.only(pair, ())
            yield f"compared_{name}{view.suffix}", _running_figure(view, name, running)
        else:
            for whole, along in study.views_by_axis(pair):
                if along is not None:
                    figure = _line_figure(whole, name, along)
                    yield stem_of(f"compared_{name}", whole, along), figure
    if single:
        yield "compared_numbers", _bar_figure(study.view, single[:30])


def labels_of(view: View) -> tuple[str, str]:
    """Names of the two archives."""
    first, second = json.loads(view.data.attrs.get("compared", '["first", "second"]'))
    return plain_text(str(first)), plain_text(str(second))


def _differs(view: View, name: str) -> bool:
    """Whether two archives differ, by some values of each axis."""
    some = {str(d): pick(n, 60) for d, n in view.array(name).sizes.items() if d not in RUNNING}
    one, two = view.numbers(name, some), view.numbers(name + COMPARED, some)
    return bool(((one != two) & ~(np.isnan(one) & np.isnan(two))).any())


def difference(one: Floats, two: Floats, largest: bool = False) -> Floats:
    """Second less first in percent of the first, or of its largest magnitude; NaN where it is 0."""
    base = np.nanmax(np.abs(one), initial=0.0) * np.ones_like(one) if largest else np.abs(one)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(base > 0.0, 100.0 * (two - one) / base, np.nan)


def _drawn(
    panels: Sequence[Axes], x: Floats, curves: tuple[Floats, Floats], labels: Sequence[str],
    entries: Entries, *, largest: bool, marker: str = "",
) -> None:  # fmt: skip
    """Draw the lines of both archives, and their difference."""
    every = max(x.size // 12, 1)
    looks = ((rc("text.color"), "-"), (SECOND, DASHES[1]))
    for curve, label, (colour, dashes) in zip(curves, labels, looks, strict=True):
        (entries[label],) = panels[0].plot(
            x, curve, color=colour, linestyle=dashes, linewidth=1.5, marker=marker, markevery=every
        )
    change = difference(*curves, largest=largest)
    panels[1].plot(x, change, color=SECOND, linewidth=1.2, marker=marker, markevery=every)


def _finished(
    view: View, name: str, panels: Sequence[Axes], entries: Entries, largest: bool
) -> Figure:
    panels[1].axhline(0.0, color=GREY, linewidth=0.6)
    y_label(panels[0], view.label(name), 2.6)
    y_label(panels[1], "Difference (% of the largest)" if largest else "Difference (%)", 1.7)
    first, second = labels_of(view)
    notes = [*view.notes([name]), f"difference: {second} less {first}"]
    figure = panels[0].figure
    title = f"{view.title(name)}: {first} and {second}"
    return finish(figure, title, notes, entries, caption=view.caption, below=True)  # type: ignore[arg-type]


def _running_figure(view: View, name: str, running: str) -> Figure:
    """Curves over the crank angle or over cycles, or stems over the order."""
    _, panels = new_sheet(2, 1, 4.6, sharex=True, height_ratios=(3, 2))
    entries: Entries = {}
    if running == "crank_angle":
        x, one, _ = trace(view, name, {})
        two = trace(view, name + COMPARED, {})[1]
        if two.size != one.size:  # A curve that is open where its passes start has one more point
            x, one = view.numbers("crank_angle"), view.numbers(name)
            two = view.numbers(name + COMPARED)
        _drawn(panels, x, (one, two), labels_of(view), entries, largest=True)
        set_cycle(panels, view, 5.0, panels[-1:])
        return _finished(view, name, panels, entries, True)
    both = view.numbers(name), view.numbers(name + COMPARED)
    if running != "order":
        axis = view.axis(running)
        _drawn(panels, axis.values, both, labels_of(view), entries, largest=True)
        x_label(panels[1], axis.label, 5.0)
        return _finished(view, name, panels, entries, True)
    order = view.numbers("order")
    width = 0.35 * float(np.min(np.diff(order), initial=1.0))
    for side, (values, label) in enumerate(zip(both, labels_of(view), strict=True)):
        colour = (rc("text.color"), SECOND)[side]
        bars = panels[0].bar(order + (side - 0.5) * width, values, width, color=colour)
        entries[label] = bars  # type: ignore[assignment]
    panels[1].bar(order, difference(*both, largest=True), width, color=SECOND)
    x_label(panels[1], view.label("order"), 5.0)
    whole_ticks(panels[1])
    return _finished(view, name, panels, entries, True)


def _line_figure(whole: View, name: str, along: str) -> Figure:
    """Lines of both archives along an axis, for some values of a second axis with an effect."""
    pair = (name, name + COMPARED)
    rest = [d for d in whole.axes(pair) if d != along and not whole.idle(pair, d)]
    over = min(rest, key=lambda dim: whole.data.sizes[dim], default=None)
    view = whole.only(pair, [along, over])
    axis, other = view.axis(along), view.axis(over)
    _, panels = new_sheet(2, 1, 4.6, sharex=True, height_ratios=(3, 2))
    entries: Entries = {}
    every: list[Floats] = []
    for rank, index in enumerate(other.picked(3)):  # More lines could not be told apart
        place = other.place(index)
        curves = view.numbers(name, place), view.numbers(name + COMPARED, place)
        said = f", {other.tag(index)}" if other else ""
        _drawn(
            panels, axis.values, curves, [label + said for label in labels_of(view)], entries,
            largest=False, marker=("o", "s", "^")[rank],
        )  # fmt: skip
        every += curves
    for panel in panels:
        parameter_ticks(panel, axis, "x", 5.0)
    free_scale(panels[0], every)
    x_label(panels[1], axis.label, 5.0)
    if not axis.joined:
        for line in (line for panel in panels for line in panel.lines):
            line.set_linestyle("none")
    return _finished(view, name, panels, entries, False)


def _bar_figure(view: View, names: Sequence[str]) -> Figure:
    """Bars of the differences of single numbers, with both numbers next to each."""
    figure, (panel,) = new_sheet(1, 1, 0.8 + 0.3 * len(names))
    values = [(view.numbers(name), view.numbers(name + COMPARED)) for name in names]
    change = [float(difference(one, two)) for one, two in values]
    panel.barh(range(len(names)), np.nan_to_num(change), 0.55, color=SECOND)
    for row, (name, (one, two), percent) in enumerate(zip(names, values, change, strict=True)):
        said = f"{typeset(float(one), 5)} \N{RIGHTWARDS ARROW} "
        said += with_unit(view.array(name), float(two), 5)
        if np.isfinite(percent):
            said += f" ({percent:+.3g} %)".replace("-", "\N{MINUS SIGN}")
        panel.annotate(
            said, (max(percent, 0.0) if np.isfinite(percent) else 0.0, row), fontsize=7.0,
            textcoords="offset points", xytext=(4, 0), va="center",
        )  # fmt: skip
    panel.set_yticks(range(len(names)), [name_of(view.array(n), n) for n in names])
    panel.set_ylim(len(names) - 0.4, -0.6)
    panel.axvline(0.0, color=rc("text.color"), linewidth=0.8)
    low, high = min(0.0, np.nanmin(change, initial=0.0)), max(0.0, np.nanmax(change, initial=0.0))
    span = high - low or 1.0
    panel.set_xlim(low - 0.05 * span, high + 0.9 * span)  # With room for the numbers beside bars
    panel.grid(False, axis="y")
    x_label(panel, "Difference (%)", 5.0)
    first, second = labels_of(view)
    notes = [*view.notes(names), f"difference: {second} less {first}"]
    return finish(figure, f"Values of {first} and {second}", notes, caption=view.caption)


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
    several = [
        name for name, there in known.items()
        if there.sum() > 2 and np.isfinite(_percent(view, name)).any()
    ]  # fmt: skip
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
    """Computed and published values in one shape: a computed one may hold for many designs."""
    known = view.array(name + PUBLISHED)
    computed = view.array(name).set_dims(dict(known.sizes)).transpose(*known.dims)
    return computed.values.astype(float), known.values.astype(float)


def _percent(view: View, name: str) -> Floats:
    """Difference of computed and published values, in percent of the published ones."""
    computed, known = _both(view, name)
    return difference(known, computed)


def _differences_of_one(view: View, names: Sequence[str], axis: StudyAxis, design: int) -> Figure:
    """Chart of the percent by which one design differs from published values, a row for each."""
    drawn = names[:MOST_ROWS]
    figure, (panel,) = new_sheet(1, 1, 0.5 + 0.22 * len(drawn))
    percent = [float(_percent(view, name)[design]) for name in drawn]
    panel.plot(percent, np.arange(len(drawn)), "o", color=shade(0.15), markersize=4.5)
    _rows(panel, [view.title(name) for name in drawn])
    title = f"Difference from the published values: {axis.tag(design)}"
    return finish(figure, title, view.notes(drawn, units=False))


def _rows(panel: Axes, texts: Sequence[str]) -> None:
    """Draw a named row for each text, from above, and a line at zero difference."""
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
    """Chart of the percent by which computed values differ from published ones, by case."""
    from matplotlib.ticker import FuncFormatter, NullLocator, SymmetricalLogLocator

    # Marks of several quantities stand below each other in a row.
    figure, (panel,) = new_sheet(1, 1, 0.7 + max(0.22, 0.045 * len(names)) * rows.size)
    entries: Entries = {}
    every = [np.zeros(1)]
    for rank, name in enumerate(names):
        percent = _percent(view, name)[rows]
        shift = 0.8 * ((rank + 0.5) / len(names) - 0.5)
        style = line_style(rank, len(names)) | {"linestyle": "none"}
        (entries[view.title(name)],) = panel.plot(percent, np.arange(rows.size) + shift, **style)
        every.append(percent[np.isfinite(percent)])
    _rows(panel, [axis.tag(int(row)) for row in rows])
    size = np.abs(np.concatenate(every))
    notes = view.notes(names, units=False)
    if size.max() > 1 and size.max() > 20 * np.median(size):
        panel.set_xscale("symlog", linthresh=0.1, linscale=0.6)
        panel.xaxis.set_major_locator(SymmetricalLogLocator(base=10, linthresh=0.1))
        panel.xaxis.set_minor_locator(NullLocator())
        panel.xaxis.set_major_formatter(FuncFormatter(lambda value, _: typeset(value)))
        notes.append("scale linear to 0.1 %, logarithmic beyond")
    title = "Difference from the published values"
    return finish(figure, title, notes, entries)


def _parity(view: View, names: Sequence[str]) -> Figure:
    """Computed against published values, one panel for each quantity."""
    drawn = names[:MOST_PANELS]
    sheet = multiples(len(drawn), 0.2, 2.6)
    for panel, name in zip(sheet.panels, drawn, strict=True):
        computed, known = (values.ravel() for values in _both(view, name))
        good = np.isfinite(computed) & np.isfinite(known)
        panel.set_title(wrap(view.label(name), int(72 / sheet.columns)))
        panel.set_box_aspect(1)
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
        look = {"color": shade(0.15), "markerfacecolor": "none", "markersize": 3.0}
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
