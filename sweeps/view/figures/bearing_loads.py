"""Loads and pressures of the bearings over the speed: largest and mean of pins and journals."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from sweeps.view.figures.marks import DASHES, MARKERS, shade
from sweeps.view.figures.parameter_lines import Line, ParameterPanel, parameter_figure
from sweeps.view.figures.sheet import NamedFigures
from sweeps.view.figures.study import Study
from sweeps.view.figures.views import MOST_PANELS, View, facet_of, stem_of

JOURNALS = "main_bearing"

BEARINGS = {
    "crank_pin": "crank pin, cylinder 1",
    "piston_pin": "piston pin, cylinder 1",
    "main_journal": "main journal",
}
"""Bearings by the beginnings of the names of their loads, and the words of the legend."""

SIZES = {"_max": "largest", "_mean": "mean"}
"""Endings of the names of loads, and the words of the legend."""


def bearing_load_names(view: View) -> list[str]:
    """Largest and mean loads over the speed, if there are two or more."""
    return _over_speed(view, "load")


def bearing_pressure_names(view: View) -> list[str]:
    """Largest and mean pressures over the speed, if there are two or more."""
    return _over_speed(view, "pressure")


def _over_speed(view: View, what: str) -> list[str]:
    names = [f"{bearing}_{what}{size}" for bearing in BEARINGS for size in SIZES]
    present = [name for name in names if view.has(name) and "speed" in view.array(name).dims]
    return present if len(present) > 1 else []


def bearing_loads(study: Study, names: Sequence[str]) -> NamedFigures:
    """Draw largest and mean loads of all bearings over the speed; of the journals the most loaded.

    Of the main journals, the one whose largest load is greatest over all speeds is drawn, and the
    legend names it.
    """
    yield from _figures(study, names, "load")


def bearing_pressures(study: Study, names: Sequence[str]) -> NamedFigures:
    """Draw the same of the pressures over the projected area."""
    yield from _figures(study, names, "pressure")


def _figures(study: Study, names: Sequence[str], what: str) -> NamedFigures:
    for whole, along in study.views_by_axis(names):
        if along != "speed" or not whole.varies(names, along):
            continue
        facet = facet_of(whole, names, ["speed", JOURNALS])
        view = whole.only(names, ["speed", JOURNALS, facet])
        across = view.axis(facet)
        panels = [
            ParameterPanel(_lines(view.slice_at(across.place(i)), names, what), across.tag(i))
            for i in across.picked(MOST_PANELS)
        ]
        drawn = parameter_figure(
            view, view.axis("speed"), panels, names,
            f"{what.capitalize()} of the bearing" + view.unit(names[0]),
            f"{what.capitalize()}s of the bearings over the speed",
            [*view.notes(names), across.picked_text(MOST_PANELS)], from_zero=True,
        )  # fmt: skip
        yield stem_of(f"bearing_{what}s", view, "speed"), drawn


def _lines(view: View, names: Sequence[str], what: str) -> list[Line]:
    """A line for each variable with numbers: a colour for each bearing, dashes for means."""
    lines, shape = [], view.axis("speed").values.shape
    for rank, (bearing, title) in enumerate(BEARINGS.items()):
        load = f"{bearing}_{what}"
        journal, text = _most_loaded(view, names, load), title
        if journal is not None:
            text += f" {view.axis(JOURNALS).text(journal)}, the most loaded"
        for size, word in SIZES.items():
            if load + size not in names:
                continue
            values = view.numbers(load + size, {} if journal is None else {JOURNALS: journal})
            look = {
                "color": shade(rank / 2), "linestyle": "-" if size == "_max" else DASHES[1],
                "marker": MARKERS[rank], "markerfacecolor": None if size == "_max" else "white",
            }  # fmt: skip
            if np.isfinite(values).any():
                y = np.broadcast_to(values, shape)
                lines.append(Line(f"{text}: {word} {what}", y, np.full(shape, ""), look=look))
    return lines


def _most_loaded(view: View, names: Sequence[str], load: str) -> int | None:
    """The journal with the greatest load of all; None for other bearings."""
    name = next((load + size for size in SIZES if load + size in names), None)
    if name is None or JOURNALS not in view.array(name).dims:
        return None
    values = np.asarray(view.array(name).transpose(JOURNALS, ...).values, dtype=float)
    return int(np.argmax(np.nanmax(values.reshape(len(values), -1), axis=1, initial=-np.inf)))
