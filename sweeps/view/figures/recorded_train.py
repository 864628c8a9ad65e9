"""Recorded cycles in a row: speed as it came, closed on itself, and each cycle for ever."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from engine_dyn.units import RPM
from sweeps.view.figures.marks import line_style, shade
from sweeps.view.figures.scales import whole_ticks, x_label, y_label
from sweeps.view.figures.sheet import Entries, NamedFigures, finish, new_sheet
from sweeps.view.figures.study import Study
from sweeps.view.figures.views import View

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = ["recorded_train"]

DETAIL = 4
"""Cycles whose speed is drawn over the angle."""

FOLLOWED, CLOSED, REPEATED = 0.0, 0.55, 0.9
"""Where they stand on the scale of lightness."""

LOOKS = {"followed": (FOLLOWED, "-", "o"), "closed": (CLOSED, (0, (5, 1.5)), "s"),
         "repeated": (REPEATED, (0, (1.2, 1)), "^")}  # fmt: skip
TEXTS = {"followed": "cycles in sequence", "closed": "train repeated periodically",
         "repeated": "each cycle repeated periodically"}  # fmt: skip
MOST_MARKS = 40
"""Cycles up to which each has a mark."""


def recorded_train(study: Study, names: Sequence[str]) -> NamedFigures:
    """Draw the first cycles in detail, and the mean speed and delta of all."""
    view = study.view
    figure, panels = new_sheet(3, 1, 6.2)
    entries: Entries = {}
    _first_cycles(panels[0], view, entries)
    number = view.numbers("recorded_cycle")
    _over_cycles(panels[1], view, "omega_mean_{}", ("followed", "closed"), 1.0 / RPM, entries)
    if view.has("omega_mean_measured"):
        (drawn,) = panels[1].plot(
            number, view.numbers("omega_mean_measured") / RPM, linestyle="none", marker="x",
            color="black", markersize=5.0, zorder=5,
        )  # fmt: skip
        entries["measured"] = drawn
    y_label(panels[1], "Mean speed (rpm)", 1.6)
    _over_cycles(panels[2], view, "delta_{}", tuple(LOOKS), 1.0, entries)
    y_label(panels[2], r"Coefficient of speed fluctuation $\delta$", 1.6)
    for panel in panels[1:]:
        panel.set_xlim(number[0] - 0.5, number[-1] + 0.5)
        x_label(panel, "Recorded cycle", 6.0)
        whole_ticks(panel)
    title = "Train of recorded cycles"
    yield (
        "recorded_train",
        finish(figure, title, _notes(view), entries, "", view.caption, below=True),
    )


def _first_cycles(panel: Axes, view: View, entries: Entries) -> None:
    """Speed over the angle of the first cycles, counted in cycles."""
    number, angle = view.numbers("recorded_cycle")[:DETAIL], view.numbers("crank_angle")
    turn = 720.0 if angle[-1] - angle[0] > 365.0 else 360.0
    part = (angle - angle[0]) / turn
    at = number[:, None] - 0.5 + part
    if view.has("omega_raw"):
        middle = (view.numbers("interval") - angle[0]) / turn
        x = (number[:, None] - 0.5 + middle).ravel()
        y = view.numbers("omega_raw")[: number.size].ravel() / RPM
        (drawn,) = panel.plot(x, y, linestyle="none", marker=".", color="#a0a0a0", markersize=2.0)
        entries["measured between teeth"] = drawn
    for word in ("repeated", "closed", "followed"):
        colour, dashes, _ = LOOKS[word]
        values = view.numbers(f"omega_{word}")[: number.size] / RPM
        if word == "repeated":  # a line for each: from one to the next the speed jumps
            gaps = np.full((values.shape[0], 1), np.nan)
            x, y = np.hstack([at, gaps]).ravel(), np.hstack([values, gaps]).ravel()
        else:
            x, y = at.ravel(), values.ravel()
        (drawn,) = panel.plot(x, y, color=shade(colour), linestyle=dashes, linewidth=1.1)
        entries[TEXTS[word]] = drawn
    panel.set_xlim(at[0, 0], at[-1, -1])
    panel.set_xticks(number, [f"{n:.0f}" for n in number])
    for edge in number[:-1] + 0.5:
        panel.axvline(edge, color="#b8b8b8", linewidth=0.6, zorder=0.5)
    y_label(panel, "Crank speed (rpm)", 1.6)
    count = view.data.sizes["recorded_cycle"]
    what = "All" if count <= DETAIL else f"The first {DETAIL} of {count}"
    panel.set_title(f"{what} cycles, firing dead centre of cylinder 1 at each number")
    x_label(panel, "Recorded cycle", 6.0)


def _over_cycles(
    panel: Axes, view: View, form: str, words: Sequence[str], factor: float, entries: Entries
) -> None:
    number = view.numbers("recorded_cycle")
    for rank, word in enumerate(words):
        colour, dashes, marker = LOOKS[word]
        marker = marker if number.size <= MOST_MARKS else ""
        style = {**line_style(rank, len(words)), "color": shade(colour), "linestyle": dashes,
                 "marker": marker, "linewidth": 0.9}  # fmt: skip
        panel.plot(number, factor * view.numbers(form.format(word)), **style)


def _notes(view: View) -> list[str]:
    jump = float(view.numbers("jump"))
    start = float(view.numbers("start_speed_followed"))
    memory = 100.0 * float(view.numbers("memory_of_a_cycle"))
    notes = [
        f"repeating the train forces a jump of {jump / RPM:+.2g} rpm ({100.0 * jump / start:+.2g} "
        "%) in the initial speed",
        f"{memory:.3g} % of a change of energy is left after one cycle",
    ]
    if view.has("omega_mean_measured"):
        notes.append("initial speed and load fitted to the measured speed")
    else:
        notes.append("start from the steady state of the mean cycle")
    return notes
