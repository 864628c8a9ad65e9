"""Numbers of a list of designs: along one parameter, case by case, or as scattered points."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from sweeps.base.dimensions import REDUCTION
from sweeps.view.figures.lines import (
    COMPUTED,
    COUNTED,
    Line,
    common_label,
    draw_points,
    line_figure,
    line_of,
    mark_outcomes,
    told_apart,
)
from sweeps.view.figures.marks import doubt_look, line_style, lost_handle, lost_look
from sweeps.view.figures.multiples import multiples
from sweeps.view.figures.scales import (
    comparable,
    free_scale,
    log_ticks,
    parameter_ticks,
    sensible_span,
    x_label,
)
from sweeps.view.figures.sheet import GREY, OWN_ORDINATES, Entries, finish, new_sheet
from sweeps.view.figures.study import Study, design_text
from sweeps.view.figures.targets import target_lines
from sweeps.view.figures.views import MOST_PANELS, MOST_ROWS, NO_VALUE, View, is_log, pick
from sweeps.view.figures.wording import HARD_SPACE, number_text, sentence

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def family_figure(study: Study, name: str, parameter: str) -> Figure:
    """One variable against one parameter, with the families that lie elsewhere."""
    view = dict(study.base)[parameter]
    aside = [
        (other, keys)
        for key, other, keys in study.aside
        if key == parameter and not view.axis(parameter).words  # words have no common places
    ]
    more = [
        line_of(other, name, {}, other.fixed["design"], x=other.axis(parameter).values)
        for other, _ in aside
    ]
    apart = dict.fromkeys(key for _, keys in aside for key in keys)
    tags = [design_text(study.view.data, key, 0) for key in apart]
    text = f"{', '.join(tags)} (nominal)" if more else COMPUTED
    same = [text for text in view.others if text not in tags]
    view = replace(view, others=tuple(same))
    return line_figure(view, [name], parameter, more=more, text=text)


def _lines_of(view: View, group: Sequence[str]) -> list[Line]:
    """A line for each variable, called by it where there are several."""
    several = len(group) > 1
    names = {name: view.title(name) if several else COMPUTED for name in group}
    return [line_of(view, name, {}, text) for name, text in names.items()]


def family_panels(view: View, group: Sequence[str], families: Sequence[tuple[str, View]]) -> Figure:
    """Small multiples: the same variables along one parameter after the other."""
    shown = families[:MOST_PANELS]
    lines = [_lines_of(family, group) for _, family in shown]
    ordinates = [[line.y for line in some] for some in lines]
    every = [y for each in ordinates for y in each]
    share = comparable(ordinates)
    sheet = multiples(len(shown), 0.0, 2.05, sharey=share)
    for panel, (parameter, family), some in zip(sheet.panels, shown, lines, strict=True):
        draw_points(panel, family.axis(parameter), some, sheet.entries)
        target_lines(panel, family, group, sheet.entries)
    for panel, (parameter, family), own in zip(sheet.panels, shown, ordinates, strict=True):
        axis = family.axis(parameter)
        free_scale(panel, every if share else own)
        parameter_ticks(panel, axis, "x", 5.4 / sheet.columns)
        x_label(panel, axis.label, 5.4 / sheet.columns)
    label = common_label(view, group)
    sheet.label_y(label, 1.5)
    span = sensible_span(sheet.panels, every) if share else OWN_ORDINATES
    return sheet.finish(
        f"{label.split(HARD_SPACE)[0]}, one parameter varied at a time",
        [*view.notes(group), span], f"Nominal: {', '.join(view.others)}",
        legend=told_apart(sheet.entries),
    )  # fmt: skip


def case_chart(view: View, group: Sequence[str]) -> Figure:
    """Unrelated designs: a row for each."""
    axis = view.axis("design")
    rows = [axis.tag(i) if axis.words else number_text(axis.values[i]) for i in range(axis.size)]
    picked = pick(axis.size, MOST_ROWS)
    figure, (panel,) = new_sheet(1, 1, 0.7 + 0.2 * len(picked))
    entries: Entries = {}
    for rank, line in enumerate(_lines_of(view, group)):
        style = line_style(rank, len(group)) | {"linestyle": "none"}
        y = np.arange(len(picked))
        (drawn,) = panel.plot(line.y[picked], y, **style)
        entries[line.text] = drawn
        if line.published is not None and np.isfinite(line.published).any():
            look = {"markersize": 8, "markerfacecolor": "none", "color": style["color"]}
            (beside,) = panel.plot(line.published[picked], y, "o", **look)
            entries.setdefault("Published", beside)
        for why in sorted({str(said) for said in line.said if said}):
            if why == NO_VALUE and axis.name in COUNTED:
                continue  # the engine has no such part
            places = np.flatnonzero(line.said[picked] == why)
            if np.isfinite(line.y[picked][places]).any():
                panel.plot(line.y[picked][places], places, **doubt_look(9.0))
                continue
            left = panel.get_yaxis_transform()
            panel.plot(np.full(places.size, 0.01), places, transform=left, **lost_look(why, GREY))
            entries.setdefault(sentence(why), lost_handle(why))
    target_lines(panel, view, group, entries, upright=True)
    panel.set_yticks(range(len(picked)), [rows[i] for i in picked])
    panel.set_ylim(len(picked) - 0.5, -0.5)
    label = common_label(view, group)
    x_label(panel, label, 4.5)
    notes = [*view.notes(group), axis.picked_text(MOST_ROWS)]
    title = f"{label.split(HARD_SPACE)[0]}, case by case"
    return finish(figure, title, notes, entries if told_apart(entries) else {})


def scatter(view: View, group: Sequence[str], parameters: Sequence[str]) -> Figure:
    """Many unrelated designs: the variable against each parameter."""
    shown = parameters[:MOST_PANELS]
    sheet = multiples(len(shown), 0.0, 2.05, sharey=True)
    entries = sheet.entries
    size = view.data.sizes["design"]
    picked = pick(size, 5000)
    lines = _lines_of(view, group)
    for panel, parameter in zip(sheet.panels, shown, strict=True):
        x = view.numbers(parameter)[picked]
        for rank, line in enumerate(lines):
            y, colour = line.y[picked], line_style(rank, len(lines))["color"]
            (dots,) = panel.plot(x, y, ".", color=colour, markersize=2.5, rasterized=True)
            entries.setdefault(line.text, dots)
            for text, handle in mark_outcomes(panel, (x, y, line.said[picked]), 4.0).items():
                entries.setdefault(text, handle)
        target_lines(panel, view, group, entries)
        known = np.unique(x[np.isfinite(x)])
        if is_log(known):
            panel.set_xscale("log")
            log_ticks(panel.xaxis, known[0], known[-1])
        free_scale(panel, [line.y for line in lines])
        x_label(panel, view.label(parameter), 5.4 / sheet.columns)
    label = common_label(view, group)
    sheet.label_y(label, 1.6)
    notes = view.notes(group)
    if len(picked) < size:
        notes.append(f"{len(picked)} of {size} designs shown")
    which = "designs that were kept" if REDUCTION in view.data.attrs else "all designs"
    title = f"{label.split(HARD_SPACE)[0]}, {which}"
    return sheet.finish(title, notes, legend=told_apart(entries))
