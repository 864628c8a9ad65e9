"""Lines over a parameter: numbers against one axis as points joined by lines."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from engine_dyn.types import Floats
from sweeps.base.dimensions import COUNTED, HIGH, LOW
from sweeps.view.figures.marks import (
    doubt_look,
    line_style,
    lost_handle,
    lost_points,
    target_lines,
    target_places,
)
from sweeps.view.figures.scales import degree_ticks, free_scale, parameter_ticks, sensible_span
from sweeps.view.figures.sheet import GREY, Entries, multiples, no_ordinate
from sweeps.view.figures.views import LIMITED, MISFIRE, MOST_PANELS, NO_VALUE, StudyAxis, View
from sweeps.view.figures.wording import HARD_SPACE, equal_lines, name_of, sentence

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

COMPUTED = "Computed"  # Text of the legend for a line that needs no other name


@dataclass(frozen=True)
class Line:
    """Numbers along an axis, and how they are drawn."""

    text: str
    y: Floats
    outcomes: NDArray[Any]  # Reasons why numbers are missing or doubtful, "" for sound ones
    published: Floats | None = None
    x: Floats | None = None  # Abscissas, if not the axis's own values
    strong: bool = False
    band: tuple[Floats, Floats] | None = None  # Lower and upper ends of the uncertainty band
    # Style of the line; by default that of its place among the panel's lines
    look: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class ParameterPanel:
    """A panel over a parameter: its lines, its title, and what else is drawn into it."""

    lines: Sequence[Line]
    title: str = ""
    more: Callable[[Axes, Entries], object] | None = None


def line_of(view: View, name: str, index: Mapping[str, int], text: str, **more: Any) -> Line:
    """One line of a variable: all axes but one are fixed by `index`."""
    other = view.published(name)
    published = view.numbers(other, index) if other else None
    low, high = band_names(name)
    there = low in view.data.variables and high in view.data.variables
    band = (view.numbers(low, index), view.numbers(high, index)) if there else None
    outcomes = view.outcomes(name, view.at(name, index), index)
    return Line(text, view.numbers(name, index), outcomes, published, band=band, **more)


def band_names(name: str) -> tuple[str, str]:
    """Names of the ends of the band of a quantity, as `run --uncertainty` writes them."""
    return name + LOW, name + HIGH


def draw_points(panel: Axes, axis: StudyAxis, lines: Sequence[Line], entries: Entries) -> None:
    """Numbers along an axis as joined points; lost designs are marked on the frame."""
    remarks: Entries = {}
    for rank, line in enumerate(lines):
        style = line_style(rank, len(lines), line.strong and len(lines) > 1)
        x = axis.values if line.x is None else line.x
        if not axis.joined:
            style |= {"linestyle": "none", "markersize": 5.0}
            if axis.name != "cylinders":  # Lines have points side by side, often equal
                x = x + 0.5 * ((rank + 0.5) / len(lines) - 0.5)
        elif x.size < 5 and not line.look:
            style["linewidth"] = 0.7  # Between so few points the curve is not known
        thin = max(x.size // 20, 1) if x.size > 60 else 1
        style |= {"markevery": thin, **line.look}
        y = np.where(np.isfinite(line.y), line.y, np.nan)
        (drawn,) = panel.plot(x, y, **style)
        entries.setdefault(line.text, drawn)
        if line.band is not None and style["linestyle"] != "none":
            filled = panel.fill_between(
                x, *line.band, color=style["color"], alpha=0.2, linewidth=0.0
            )
            entries.setdefault("95 % range due to the uncertain values", filled)
        elif line.band is not None:
            panel.vlines(x, *line.band, color=style["color"], linewidth=1.2)
        if line.published is not None and np.isfinite(line.published).any():
            look = {"linestyle": "none", "marker": "o", "markersize": 7.5, "color": style["color"]}
            (rings,) = panel.plot(x, line.published, markerfacecolor="none", **look)
            single = len(lines) == 1
            entries.setdefault("Published" if single else f"{line.text}, published", rings)
        whys = line.outcomes
        if axis.name in COUNTED:  # The engine has no such part if the value is missing
            whys = np.where(whys == NO_VALUE, "", whys)
        remarks |= mark_outcomes(panel, (x, y, whys), 9.0, thin, style["color"])
    if not any(np.isfinite(line.y).any() for line in lines):
        no_ordinate(panel)
    for text, handle in remarks.items():
        entries.pop(text, None)  # Outcomes come last in a legend
        entries[text] = handle


def mark_outcomes(
    panel: Axes, points: tuple[Floats, Floats, NDArray[Any]], size: float, thin: int = 1,
    colour: Any = GREY,
) -> Entries:  # fmt: skip
    """Mark designs that missed the tolerance, and on the frame those without an answer."""
    from matplotlib.lines import Line2D

    x, y, said = points
    entries: Entries = {}
    for why in sorted({str(one) for one in said if one}):
        places = said == why
        if np.isfinite(y[places]).any():  # The result is a number, though not to the tolerance
            panel.plot(x[places][::thin], y[places][::thin], **doubt_look(size))
            entries[sentence(why)] = Line2D([], [], **doubt_look(size))
        else:
            lost_points(panel, x[places][::thin], why, colour)
            entries[sentence(why)] = lost_handle(why)
    return entries


def common_label(view: View, names: Sequence[str]) -> str:
    """Label for one variable, or for several of one kind: what their long names share."""
    if len(names) == 1:
        return view.label(names[0])
    shared = {str(view.array(name).attrs.get("common_name", "")) for name in names}
    if len(shared) == 1 and all(shared):
        return sentence(*shared) + view.unit(names[0])
    words = [re.findall(r"\w+", name_of(view.array(n), n).lower()) for n in names]
    common = [word for word in words[0] if all(word in other for other in words[1:])]
    common = [word for word in common if word not in ("of", "the", "in", "over", "at", "a")]
    text = " ".join(common) or names[0].split("_")[0].replace("_", " ")
    return sentence(text) + view.unit(names[0])


def told_apart(entries: Entries) -> bool:
    """Whether a legend is needed: not for computed values alone."""
    return list(entries) != [COMPUTED]


def line_figure(
    view: View, names: Sequence[str], along: str, over: str | None = None,
    facet: str | None = None, more: Sequence[Line] = (), text: str = COMPUTED,
) -> Figure:  # fmt: skip
    """Numbers against one axis: a line for each variable, or for each value of a second axis."""
    view = view.only(names, [along, over, facet]).with_values(names, over, facet)
    axis, other, across = view.axis(along), view.axis(over), view.axis(facet)

    def lines_at(at: Mapping[str, int]) -> list[Line]:
        if other:
            return [
                line_of(view, names[0], {**at, other.name: i}, other.text(i),
                        strong=i == other.nominal)
                for i in other.picked()
            ]  # fmt: skip
        if len(names) == 1:
            return [line_of(view, names[0], at, text, strong=True), *more]
        return [line_of(view, name, at, view.title(name)) for name in names]

    label = common_label(view, names)
    shown = across.picked(MOST_PANELS)
    every = [lines_at(across.place(i)) for i in shown]
    if other.name == MISFIRE:  # Mostly it is the same whichever cylinder fails
        ys = [np.concatenate([line.y for line in same]) for same in zip(*every, strict=True)]
        alike = equal_lines([line.text for line in every[0]], ys)
        every = [[replace(lines[i], text=said) for i, said in alike] for lines in every]
    return parameter_figure(
        view, axis, [ParameterPanel(lines, across.tag(i))
                     for lines, i in zip(every, shown, strict=True)],
        names, label, f"{label.split(HARD_SPACE)[0]} against {axis.called}",
        [*view.notes(names), other.picked_text(), across.picked_text(MOST_PANELS)],
        legend_title=other.label,
    )  # fmt: skip


def parameter_figure(
    view: View, axis: StudyAxis, panels: Sequence[ParameterPanel], names: Sequence[str],
    label: str, title: str, notes: Iterable[str], *, each: float = 1.85, share: bool = True,
    from_zero: bool = False, legend_title: str = "",
) -> Figure:  # fmt: skip
    """Draw panels of lines of some variables over one parameter.

    The ordinates, with one `label`, begin at zero if `from_zero`, else their scale follows from
    the numbers. Of several panels a row is `each` inches tall.
    """
    several = len(panels) > 1
    size = (0.5, each) if several else (3.3, 0.0)
    sheet = multiples(len(panels), *size, sharex=True, sharey=share)
    for panel, content in zip(sheet.panels, panels, strict=True):
        draw_points(panel, axis, content.lines, sheet.entries)
        if content.more:
            content.more(panel, sheet.entries)
        target_lines(panel, view, names, sheet.entries)
        target_places(panel, view, axis, sheet.entries)
        panel.set_title(content.title)
    every = [line.y for content in panels for line in content.lines]
    limited = any(name.endswith(LIMITED) for name in names)
    every += [np.ones(1)] if limited else []  # The line of the limit has room on the scale
    room = 5.0 / sheet.columns
    for panel in sheet.panels:
        parameter_ticks(panel, axis, "x", room)
        if not from_zero:
            free_scale(panel, every)
            degree_ticks(panel, view.array(names[0]))
    for panel in sheet.panels if from_zero else ():
        panel.set_ylim(bottom=0.0)  # After all lines are drawn, because it fixes the scale
    span = "" if from_zero else sensible_span(sheet.panels, every)
    sheet.label_x(axis.label, room)
    sheet.label_y(label, 1.6 if several else 2.8)
    return sheet.finish(
        title, [*notes, span], view.caption, legend=told_apart(sheet.entries),
        legend_title=legend_title, below=several,
    )  # fmt: skip
