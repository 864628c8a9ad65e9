"""Numbers of a list of designs: along one parameter, case by case, or as scattered points."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from sweeps.figures.lines import COUNTED, common_label, draw_points, line_figure, line_of
from sweeps.figures.marks import doubt_look, line_style, lost_handle, lost_look, lost_points
from sweeps.figures.scales import (
    comparable,
    free_scale,
    left_labels,
    log_ticks,
    parameter_ticks,
    sensible_span,
    x_label,
)
from sweeps.figures.sheet import GREY, OWN_ORDINATES, Entries, finish, grid_of, new_sheet
from sweeps.figures.study import Study, design_text
from sweeps.figures.targets import target_lines
from sweeps.figures.views import MOST_PANELS, MOST_ROWS, NO_VALUE, View, is_log, pick, picked_text
from sweeps.figures.wording import HARD_SPACE, axis_label, number_text, sentence, title_of

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
    text = f"{', '.join(tags)} (nominal)" if more else "Computed"
    same = [text for text in view.others if text not in tags]
    view = replace(view, others=tuple(same))
    return line_figure(view, [name], parameter, more=more, text=text)


def _line_text(view: View, name: str, group: Sequence[str]) -> str:
    """What a line is called: by its variable where there are several."""
    return title_of(view.array(name), name) if len(group) > 1 else "Computed"


def family_panels(view: View, group: Sequence[str], families: Sequence[tuple[str, View]]) -> Figure:
    """Small multiples: the same variables along one parameter after the other."""
    picked = families[:MOST_PANELS]
    lines = [
        [line_of(family, name, {}, _line_text(family, name, group)) for name in group]
        for _, family in picked
    ]
    ordinates = [[line.y for line in some] for some in lines]
    share = comparable(ordinates)
    rows, columns = grid_of(len(picked))
    figure, panels = new_sheet(rows, columns, 2.05 * rows, sharey=share)
    entries: Entries = {}
    for panel, (parameter, family), some in zip(panels, picked, lines, strict=False):
        draw_points(panel, family.axis(parameter), some, entries)
        target_lines(panel, family, group, entries)
    for panel, (parameter, family), own in zip(panels, picked, ordinates, strict=False):
        axis = family.axis(parameter)
        free_scale(panel, [y for each in ordinates for y in each] if share else own)
        parameter_ticks(panel, axis, "x", 5.4 / columns)
        x_label(panel, axis.label, 5.4 / columns)
    for panel in panels[len(picked) :]:
        panel.set_visible(False)
    label = common_label(view, group)
    left_labels(panels, columns, label, 1.5)
    span = sensible_span(panels[: len(picked)], [y for o in ordinates for y in o]) if share else ""
    notes = [*view.notes(group), "" if share else OWN_ORDINATES, span]
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


def case_chart(view: View, group: Sequence[str]) -> Figure:
    """Unrelated designs: a row for each."""
    axis = view.axis("design")
    rows = [axis.tag(i) if axis.words else number_text(axis.values[i]) for i in range(axis.size)]
    picked = pick(axis.size, MOST_ROWS)
    figure, panels = new_sheet(1, 1, 0.7 + 0.2 * len(picked))
    panel = panels[0]
    entries: Entries = {}
    for rank, name in enumerate(group):
        line = line_of(view, name, {}, _line_text(view, name, group))
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
    target_lines(panel, view, group, entries, upright=True)
    panel.set_yticks(range(len(picked)), [rows[i] for i in picked])
    panel.set_ylim(len(picked) - 0.5, -0.5)
    label = common_label(view, group)
    x_label(panel, label, 4.5)
    notes = [*view.notes(group), picked_text(axis, MOST_ROWS)]
    if list(entries) == ["Computed"]:
        entries = {}
    return finish(figure, f"{label.split(HARD_SPACE)[0]}, case by case", notes, entries)


def scatter(view: View, group: Sequence[str], parameters: Sequence[str]) -> Figure:
    """Many unrelated designs: the variable against each parameter."""
    from matplotlib.lines import Line2D

    drawn = list(parameters)[:MOST_PANELS]
    rows, columns = grid_of(len(drawn))
    height = 2.05 * rows
    figure, panels = new_sheet(rows, columns, height, sharey=True)
    entries: Entries = {}
    size = view.data.sizes["design"]
    picked = pick(size, 5000)
    lines = [line_of(view, name, {}, _line_text(view, name, group)) for name in group]
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
        target_lines(panel, view, group, entries)
        known = np.unique(x[np.isfinite(x)])
        if is_log(known):
            panel.set_xscale("log")
            log_ticks(panel.xaxis, known[0], known[-1])
        free_scale(panel, [line.y for line in lines])
        x_label(panel, axis_label(variable, parameter), 5.4 / columns)
    for panel in panels[len(drawn) :]:
        panel.set_visible(False)
    label = common_label(view, group)
    left_labels(panels, columns, label, 1.6)
    notes = list(view.notes(group))
    if len(picked) < size:
        notes.append(f"{len(picked)} of {size} designs shown")
    if list(entries) == ["Computed"]:
        entries = {}
    title = f"{label.split(HARD_SPACE)[0]}, all designs"
    spare = panels[len(drawn) :]
    return finish(figure, title, notes, entries, below=True, spare=spare)
