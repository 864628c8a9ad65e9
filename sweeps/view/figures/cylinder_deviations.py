"""Deviations of the imep of single cylinders by the speed: over cycles, and lasting ones."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from engine_dyn.types import Floats
from sweeps.view.figures.marks import line_style, shade
from sweeps.view.figures.multiples import multiples
from sweeps.view.figures.scales import whole_ticks, y_label
from sweeps.view.figures.sheet import Entries, NamedFigures, finish, new_sheet
from sweeps.view.figures.study import Study
from sweeps.view.figures.views import MOST_PANELS, View, pick
from sweeps.view.figures.wording import file_label

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["deviations"]

NORMAL, LIMIT, MISSED = 0.15, 0.75, "#c03a2b"
"""Lightness of normal cycles and of limits; colour of missed cycles."""


def deviations(study: Study, names: Sequence[str]) -> NamedFigures:
    """Draw the cycles of each recording, and the mean cycles of all."""
    view = study.view
    count = view.data.sizes.get("recording", 1)
    for place in range(count):
        suffix = f"_{place + 1}" if count > 1 else ""
        yield f"cylinder_deviations{suffix}", _over_cycles(view, place)
    yield "cylinder_means", _lasting(view)


def _values(view: View, name: str, dims: int) -> Floats:
    """Values with their dimension `recording`, which is cut away where there is only one."""
    found = view.numbers(name)
    return found if found.ndim == dims else found[None]


def _label(view: View, place: int) -> str:
    return file_label(str(np.atleast_1d(view.array("file").values)[place]))


def _over_cycles(view: View, place: int) -> Figure:
    """A panel for each cylinder: cycles, threshold, and which are called missed."""
    single = _values(view, "imep_deviation_of_cycle", 3)[place]
    missed = _values(view, "missed", 3)[place] > 0.0
    spread, limit, lasting, unsure, weak, dead = (
        _values(view, name, 2)[place]
        for name in ("imep_deviation_of_cycle_std", "missed_threshold", "imep_deviation_lasting",
                     "imep_deviation_lasting_std", "weak", "dead")
    )  # fmt: skip
    lacking = float(_values(view, "imep_of_combustion", 1)[place])
    shown = pick(single.shape[1], MOST_PANELS)
    columns = 1 if len(shown) <= 2 else 2
    sheet = multiples(len(shown), 0.5, 1.75, columns=columns, sharex=True, sharey=True)
    cycle = np.arange(1, len(single) + 1)
    size = 3.0 if cycle.size <= 200 else 1.5
    for panel, number in zip(sheet.panels, shown, strict=True):
        here, gone = single[:, number], missed[:, number]
        band = panel.axhspan(-spread[number], spread[number], color="#e6e6e6", linewidth=0.0,
                             zorder=0)  # fmt: skip
        edge = panel.axhline(limit[number], color=shade(LIMIT), linestyle=(0, (5, 1.5)),
                             linewidth=1.1)  # fmt: skip
        lack = panel.axhline(-lacking, color="black", linestyle=(0, (1.2, 1)), linewidth=0.8)
        (dots,) = panel.plot(cycle[~gone], here[~gone], linestyle="none", marker="o",
                             markersize=size, color=shade(NORMAL))  # fmt: skip
        sheet.entries.update({
            "cycle": dots, "± standard deviation of the errors": band,
            "threshold": edge, "no combustion": lack,
        })  # fmt: skip
        if gone.any():
            (cross,) = panel.plot(cycle[gone], here[gone], linestyle="none", marker="X",
                                  markersize=6.5, color=MISSED, zorder=4)  # fmt: skip
            sheet.entries["classified as misfire"] = cross
        called = ", dead" if dead[number] else ", weak" if weak[number] else ""
        mean = f"{lasting[number]:+.2f}".replace("-", "\N{MINUS SIGN}")
        panel.set_title(f"Cylinder {number + 1}: mean {mean} ± {unsure[number]:.2f} bar{called}")
    sheet.panels[0].set_xlim(0.5, cycle[-1] + 0.5)
    whole_ticks(sheet.panels[0])
    sheet.label_x("Recorded cycle", 6.0 / columns)
    sheet.label_y("Deviation of imep (bar)", 1.6)
    rate = float(view.data.attrs.get("false_alarms", np.nan))
    notes = [_label(view, place), f"threshold for {rate:g} false alarms in a cycle of the engine"]
    if missed.any():
        notes.append(
            "cycles next to a misfire appear stronger, because the misfire is among the cycles "
            "they are compared with"
        )
    if len(shown) < single.shape[1]:
        notes.append(f"{len(shown)} of {single.shape[1]} cylinders shown")
    title = "Deviation of single cycles from the usual value of their cylinder"
    return sheet.finish(title, notes, view.caption)


def _lasting(view: View) -> Figure:
    """Mean cycles of the cylinders with their standard deviations, and the limit of weak ones."""
    figure, (panel,) = new_sheet(1, 1, 3.0)
    mean, unsure, limit = (
        _values(view, name, 2)
        for name in ("imep_deviation_lasting", "imep_deviation_lasting_std", "weak_threshold")
    )
    shown = pick(len(mean), 8)
    cylinder = np.arange(1.0, mean.shape[1] + 1.0)
    entries: Entries = {}
    room = 0.7 / len(shown)
    for rank, place in enumerate(shown):
        style: dict[str, Any] = {**line_style(rank, len(shown)), "linestyle": "none",
                                 "markersize": 5.5}  # fmt: skip
        at = cylinder + room * (rank - 0.5 * (len(shown) - 1))
        drawn = panel.errorbar(at, mean[place], unsure[place], capsize=2.5, elinewidth=0.9, **style)
        entries[_label(view, place)] = drawn.lines[0]
        lines = panel.hlines(limit[place], at - 0.4 * room, at + 0.4 * room,
                             color=style["color"], linewidth=1.4)  # fmt: skip
    entries["classified as weak below"] = lines
    panel.axhline(0.0, color="black", linewidth=0.6)
    panel.set_xticks(cylinder, [f"{c:.0f}" for c in cylinder])
    panel.set_xlim(0.5, cylinder[-1] + 0.5)
    panel.grid(False, axis="x")
    panel.set_xlabel("Cylinder")
    y_label(panel, "Deviation of the mean imep (bar)", 2.4)
    notes = ["from the mean of the other cylinders; bars: standard deviation"]
    if len(shown) < len(mean):
        notes.append(f"{len(shown)} of {len(mean)} recordings shown")
    title = "Lasting deviations of cylinders"
    return finish(figure, title, notes, entries, "", view.caption, below=True)
