"""Two archives in one chart: lines of both, and below them their difference in percent.

They come from `sweeps.decide.explore.compare`: a variable of the second archive has the name of the
first's with `_compared` at its end. A difference is that of the second less the first, over the
first; along a curve that runs through the cycle or the orders, over the first's largest magnitude,
since such curves pass through zero.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from engine_dyn.types import Floats
from sweeps.base.dimensions import COMPARED
from sweeps.view.figures.angle_lines import set_cycle, trace
from sweeps.view.figures.marks import DASHES
from sweeps.view.figures.scales import free_scale, parameter_ticks, whole_ticks
from sweeps.view.figures.sheet import (
    GREY,
    Entries,
    NamedFigures,
    finish,
    new_sheet,
    rc,
    x_label,
    y_label,
)
from sweeps.view.figures.study import Study
from sweeps.view.figures.views import RUNNING, View, pick, stem_of
from sweeps.view.figures.wording import name_of, number_text, plain_text, with_unit

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
    """Whether the two are not the same, looked at in some values of each axis."""
    some = {str(d): pick(n, 60) for d, n in view.array(name).sizes.items() if d not in RUNNING}
    one, two = view.numbers(name, some), view.numbers(name + COMPARED, some)
    return bool(((one != two) & ~(np.isnan(one) & np.isnan(two))).any())


def difference(one: Floats, two: Floats, largest: bool = False) -> Floats:
    """Second less first in percent of the first, or of its largest magnitude; NaN where it is 0."""
    base = np.nanmax(np.abs(one), initial=0.0) * np.ones_like(one) if largest else np.abs(one)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(base > 0.0, 100.0 * (two - one) / base, np.nan)


def _pair_of_panels() -> tuple[Figure, list[Axes]]:
    return new_sheet(2, 1, 4.6, sharex=True, height_ratios=(3, 2))


def _drawn(
    panels: Sequence[Axes], x: Floats, curves: tuple[Floats, Floats], labels: Sequence[str],
    entries: Entries, *, largest: bool, marker: str = "",
) -> None:  # fmt: skip
    """Draw the lines of both, and their difference."""
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
    """Curves over the crank angle, or stems over the order."""
    _, panels = _pair_of_panels()
    entries: Entries = {}
    if running == "crank_angle":
        x, one, _ = trace(view, name, {})
        two = trace(view, name + COMPARED, {})[1]
        if two.size != one.size:  # one of them is open at its start
            x, one = view.numbers("crank_angle"), view.numbers(name)
            two = view.numbers(name + COMPARED)
        _drawn(panels, x, (one, two), labels_of(view), entries, largest=True)
        set_cycle(panels, view, 5.0, panels[-1:])
        return _finished(view, name, panels, entries, True)
    order = view.numbers("order")
    both = view.numbers(name), view.numbers(name + COMPARED)
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
    """Both along an axis, for some values of a second one that changes them."""
    pair = (name, name + COMPARED)
    rest = [d for d in whole.axes(pair) if d != along and not whole.idle(pair, d)]
    over = min(rest, key=lambda dim: whole.data.sizes[dim], default=None)
    view = whole.only(pair, [along, over])
    axis, other = view.axis(along), view.axis(over)
    _, panels = _pair_of_panels()
    entries: Entries = {}
    every: list[Floats] = []
    # More values of a second axis would not be told apart.
    for rank, index in enumerate(other.picked(3)):
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
    if axis.words:  # no line runs from one word to the next
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
        said = f"{number_text(float(one), 5)} \N{RIGHTWARDS ARROW} "
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
    panel.set_xlim(low - 0.05 * span, high + 0.9 * span)  # room for the numbers
    panel.grid(False, axis="y")
    x_label(panel, "Difference (%)", 5.0)
    first, second = labels_of(view)
    notes = [*view.notes(names), f"difference: {second} less {first}"]
    return finish(figure, f"Values of {first} and {second}", notes, caption=view.caption)
