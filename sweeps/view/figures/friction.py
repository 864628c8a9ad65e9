"""Friction by component: mean effective pressures above each other, over an axis or as bars."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from engine_dyn.types import Floats
from sweeps.view.figures.marks import shade
from sweeps.view.figures.parameter_bars import name_rows
from sweeps.view.figures.scales import parameter_ticks, x_label, y_label
from sweeps.view.figures.sheet import Entries, NamedFigures, finish, new_sheet, rc
from sweeps.view.figures.study import Study
from sweeps.view.figures.views import StudyAxis, View, stem_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

COMPONENTS = {
    "fmep_rings": "rings, tension",
    "fmep_ring_gas_pressure": "rings, gas",
    "fmep_skirt": "skirts",
    "fmep_main_bearings": "main bearings",
    "fmep_crank_pin_bearings": "rod bearings",
    "fmep_crankshaft_seals": "crankshaft seals",
    "fmep_valve_train": "valve train",
    "fmep_auxiliaries": "auxiliaries",
}
"""Components from below, as in the order of the thesis's loss categories, and their short names."""

HATCHES = ("", "////", "", "", "....", "\\\\\\\\", "", "xxxx")
"""Neighbours differ in grey print too."""

WHOLE, OF_TORQUE = "fmep", "fmep of the torque"
FMEP = "Friction mean effective pressure"

LINE = "#b3261e"


def friction_names(view: View) -> list[str]:
    """Components of the friction, if there are three or more."""
    found = [name for name in COMPONENTS if view.has(name)]
    return found if len(found) > 2 else []


def friction_components(study: Study, names: Sequence[str]) -> NamedFigures:
    """Draw the components stacked over each axis, and `fmep`; of one design as bars."""
    for whole, along in study.views_by_axis(names):
        if along is None:
            yield _one_design(whole, names)
            continue
        drawn = [*names, *([WHOLE] if whole.has(WHOLE) else [])]
        view = whole.only(drawn, [along])
        axis = view.axis(along)
        figure, (panel,) = new_sheet(1, 1, 3.4)
        entries = _stacked(panel, view, names, axis)
        if WHOLE in drawn:
            form = "-" if axis.joined else "D"
            values = _over(view, WHOLE, axis)
            (line,) = panel.plot(axis.values, values, form, color=LINE, linewidth=1.6)
            entries = {OF_TORQUE: line, **entries}
        panel.set_ylim(bottom=0.0)
        if axis.joined:
            panel.set_xlim(float(np.min(axis.values)), float(np.max(axis.values)))
        parameter_ticks(panel, axis, "x", 5.0)
        x_label(panel, axis.label, 5.0)
        y_label(panel, FMEP + view.unit(names[0]), 2.9)
        title = axis.by("Components of the friction")
        finished = finish(figure, title, view.notes(drawn), entries, caption=view.caption)
        yield stem_of("friction_components", view, along), finished


def _over(view: View, name: str, axis: StudyAxis) -> Floats:
    """Values of a variable along an axis, also where it is the same all along."""
    return np.asarray(np.broadcast_to(view.numbers(name), (axis.size,)))


def _stacked(panel: Axes, view: View, names: Sequence[str], axis: StudyAxis) -> Entries:
    """Areas, or bars where the axis has words, above each other; the topmost is named first."""
    base = np.zeros(axis.size)
    entries: Entries = {}
    for rank, (name, text) in enumerate(COMPONENTS.items()):
        if name not in names:
            continue
        top = base + _over(view, name, axis)
        look = {
            "facecolor": shade(rank / (len(COMPONENTS) - 1)), "hatch": HATCHES[rank],
            "edgecolor": "white", "linewidth": 0.6,
        }  # fmt: skip
        if axis.joined:
            patch = panel.fill_between(axis.values, base, top, **look)
        else:
            patch = panel.bar(axis.values, top - base, 0.6, base, **look)[0]
        entries = {text: patch, **entries}
        base = top
    return entries


def _one_design(whole: View, names: Sequence[str]) -> tuple[str, Figure]:
    """Bars of one design with their values and shares."""
    view = whole.only(names, ())
    values = np.array([float(view.numbers(name)) for name in names])
    figure, (panel,) = new_sheet(1, 1, 1.1 + 0.3 * len(names))
    panel.barh(range(len(names)), values, height=0.62, color=shade(0.35))
    total = float(values.sum())
    for row, value in enumerate(values):
        text = f"{value:.3f}, {100.0 * value / total:.0f} %" if total > 0.0 else f"{value:.3f}"
        look = {"xytext": (3, 0), "textcoords": "offset points", "fontsize": rc("legend.fontsize")}
        panel.annotate(text, (value, row), va="center", **look)
    panel.margins(x=0.18)
    panel.set_xlim(left=0.0)
    texts = [COMPONENTS[name].capitalize() for name in names]
    name_rows(panel, texts, FMEP + view.unit(names[0]))
    notes = [*view.notes(names), f"together {total:.3f} {view.array(names[0]).attrs['units']}"]
    finished = finish(figure, "Components of the friction", notes, caption=view.caption)
    return f"friction_components{view.suffix}", finished
