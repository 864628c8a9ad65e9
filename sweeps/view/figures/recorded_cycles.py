"""Recorded cycles: their speed in sequence, and the deviations of single cylinders."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from engine_dyn.types import Floats
from engine_dyn.units import RPM
from sweeps.view.figures.marks import line_style, shade
from sweeps.view.figures.scales import whole_ticks
from sweeps.view.figures.sheet import (
    Entries,
    NamedFigures,
    finish,
    multiples,
    new_sheet,
    x_label,
    y_label,
)
from sweeps.view.figures.study import Study
from sweeps.view.figures.views import MOST_PANELS, View, pick
from sweeps.view.figures.wording import file_label

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

TRAINS = {
    "followed": ("cycles in sequence", 0.0, "-", "o"),
    "closed": ("train repeated periodically", 0.55, (0, (5, 1.5)), "s"),
    "repeated": ("each cycle repeated periodically", 0.9, (0, (1.2, 1)), "^"),
}
"""Ways in which cycles follow each other: text of the legend, lightness, dashes and marker."""


def recorded_train(study: Study, names: Sequence[str]) -> NamedFigures:
    """Draw the first cycles in detail, and the mean speed and delta of all."""
    view = study.view
    figure, panels = new_sheet(3, 1, 6.2)
    entries: Entries = {}
    _first_cycles(panels[0], view, entries)
    number = view.numbers("recorded_cycle")
    _train_over_cycles(panels[1], view, "omega_mean_{}", ("followed", "closed"), 1.0 / RPM, entries)
    if view.has("omega_mean_measured"):
        (drawn,) = panels[1].plot(
            number, view.numbers("omega_mean_measured") / RPM, linestyle="none", marker="x",
            color="black", markersize=5.0, zorder=5,
        )  # fmt: skip
        entries["measured"] = drawn
    y_label(panels[1], "Mean speed (rpm)", 1.6)
    _train_over_cycles(panels[2], view, "delta_{}", tuple(TRAINS), 1.0, entries)
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
    """Draw the speed over the angle of the first cycles, counted in cycles."""
    # Largest number of cycles whose speed is drawn over the crank angle
    detail = 4
    number, angle = view.numbers("recorded_cycle")[:detail], view.numbers("crank_angle")
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
        text, lightness, dashes, _ = TRAINS[word]
        values = view.numbers(f"omega_{word}")[: number.size] / RPM
        if word == "repeated":  # Each cycle is a line of its own, as the speed jumps between cycles
            gaps = np.full((values.shape[0], 1), np.nan)
            x, y = np.hstack([at, gaps]).ravel(), np.hstack([values, gaps]).ravel()
        else:
            x, y = at.ravel(), values.ravel()
        (drawn,) = panel.plot(x, y, color=shade(lightness), linestyle=dashes, linewidth=1.1)
        entries[text] = drawn
    panel.set_xlim(at[0, 0], at[-1, -1])
    panel.set_xticks(number, [f"{n:.0f}" for n in number])
    for edge in number[:-1] + 0.5:
        panel.axvline(edge, color="#b8b8b8", linewidth=0.6, zorder=0.5)
    y_label(panel, "Crank speed (rpm)", 1.6)
    count = view.data.sizes["recorded_cycle"]
    what = "All" if count <= detail else f"The first {detail} of {count}"
    panel.set_title(f"{what} cycles, firing dead centre of cylinder 1 at each number")
    x_label(panel, "Recorded cycle", 6.0)


def _train_over_cycles(
    panel: Axes, view: View, form: str, words: Sequence[str], factor: float, entries: Entries
) -> None:
    number = view.numbers("recorded_cycle")
    for rank, word in enumerate(words):
        _, lightness, dashes, marker = TRAINS[word]
        marker = marker if number.size <= 40 else ""
        style = {**line_style(rank, len(words)), "color": shade(lightness), "linestyle": dashes,
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


def deviations(study: Study, names: Sequence[str]) -> NamedFigures:
    """Draw the cycles of each recording, and the mean cycles of all."""
    view = study.view
    count = view.data.sizes.get("recording", 1)
    for place in range(count):
        suffix = f"_{place + 1}" if count > 1 else ""
        yield f"cylinder_deviations{suffix}", _over_cycles(view, place)
    yield "cylinder_means", _lasting(view)


def _values(view: View, name: str, dims: int) -> Floats:
    """Values with their dimension `recording`, which is cut where there is only one."""
    values = view.numbers(name)
    return values if values.ndim == dims else values[None]


def _label(view: View, place: int) -> str:
    return file_label(str(np.atleast_1d(view.array("file").values)[place]))


def _over_cycles(view: View, place: int) -> Figure:
    """Figure with a panel for each cylinder: cycles, threshold, and missed cycles."""
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
        edge = panel.axhline(limit[number], color=shade(0.75), linestyle=(0, (5, 1.5)),
                             linewidth=1.1)  # fmt: skip
        lack = panel.axhline(-lacking, color="black", linestyle=(0, (1.2, 1)), linewidth=0.8)
        (dots,) = panel.plot(cycle[~gone], here[~gone], linestyle="none", marker="o",
                             markersize=size, color=shade(0.15))  # fmt: skip
        sheet.entries.update({
            "cycle": dots, "± standard deviation of the errors": band,
            "threshold": edge, "no combustion": lack,
        })  # fmt: skip
        if gone.any():
            (cross,) = panel.plot(cycle[gone], here[gone], linestyle="none", marker="X",
                                  markersize=6.5, color="#c03a2b", zorder=4)  # fmt: skip
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
    """Figure of the cylinders' mean cycles with standard deviations, and the limit of weak ones."""
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
