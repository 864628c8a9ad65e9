"""Waterfall of orders: amplitudes over order and speed, a row of stems for each speed."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from engine_dyn.types import Floats
from sweeps.view.figures.marks import shade
from sweeps.view.figures.scales import x_label, y_label
from sweeps.view.figures.shaft_response import at_largest
from sweeps.view.figures.sheet import GREY, NamedFigures, finish, new_sheet, rc
from sweeps.view.figures.study import Study
from sweeps.view.figures.views import View, stem_of
from sweeps.view.figures.wording import number_text, unit_text

if TYPE_CHECKING:
    from matplotlib.axes import Axes

SPEED, ORDER = "speed", "order"

LEAST_ROWS, MOST_ROWS = 3, 24
"""Speeds: fewer are told apart as stems side by side, more hide each other."""

STEM = 0.95
"""Of the usual distance of two rows: the height of the largest stem, so that none hides another."""

DRAWN = 2e-3
"""Share of the largest amplitude below which a stem is no more than its base line."""


def waterfall_names(view: View) -> list[str]:
    """Amplitudes over order and speed."""
    names = [str(name) for name in view.data.data_vars if view.has(str(name))]
    return [
        name
        for name in names
        if {SPEED, ORDER} <= set(view.array(name).dims)
        and "mode" not in view.array(name).dims  # critical speeds, which the Campbell diagram has
        and view.data.sizes[SPEED] >= LEAST_ROWS
        and not view.axis(SPEED).words
        and view.array(name).attrs.get("units") != "degree"  # phases have no height
    ]


def waterfalls(study: Study, names: Sequence[str]) -> NamedFigures:
    """Draw each amplitude over order and speed; other axes are cut at one slice."""
    for name in names:
        for whole, along in study.views_by_axis([name]):
            if along != SPEED:
                continue
            view = at_largest(whole, name).only([name], [SPEED])
            axis = view.axis(SPEED)
            rows = axis.picked(MOST_ROWS)
            speeds = axis.values[rows]
            values = view.array(name).transpose(SPEED, ORDER).values[rows]
            amplitudes = np.abs(np.asarray(values, dtype=float))
            largest = float(np.nanmax(amplitudes, initial=0.0))
            if not largest:
                continue
            figure, (panel,) = new_sheet(1, 1, min(2.2 + 0.22 * len(rows), 6.0))
            gap = float(np.median(np.diff(np.sort(speeds))))
            factor = STEM * gap / largest  # speed that one unit of amplitude is drawn as
            _rows(panel, view.numbers(ORDER), speeds, amplitudes, factor)
            _scale(panel, unit_text(str(view.array(name).attrs.get("units", ""))), largest, factor)
            x_label(panel, view.label(ORDER), 5.0)
            y_label(panel, axis.label, 3.0)
            title = f"{view.title(name)} over order and speed"
            notes = [*view.notes([name]), axis.picked_text(MOST_ROWS)]
            drawn = finish(figure, title, notes, caption=view.caption)
            yield stem_of(f"{name}_waterfall", view, None), drawn


def _rows(panel: Axes, order: Floats, speeds: Floats, amplitudes: Floats, factor: float) -> None:
    """Draw one row of stems at each speed, the highest speed first and so behind the others."""
    least = DRAWN * float(np.nanmax(amplitudes))
    step = float(np.min(np.diff(order), initial=1.0))
    for place, row in enumerate(np.argsort(-speeds, kind="stable")):
        colour = shade(row / max(len(speeds) - 1, 1))
        base, sizes = speeds[row], amplitudes[row]
        drawn = np.isfinite(sizes) & (sizes > least)
        panel.axhline(base, color="#bbbbbb", linewidth=0.5, zorder=2.5 + place)
        panel.bar(
            order[drawn], factor * sizes[drawn], 0.45 * step, bottom=base, color=colour,
            edgecolor="white", linewidth=0.3, zorder=2 + place,
        )  # fmt: skip
    panel.set_xlim(order[0] - step, order[-1] + step)
    gap = float(np.median(np.diff(np.sort(speeds))))
    tops = speeds + factor * np.nanmax(amplitudes, axis=1, initial=0.0)
    panel.set_ylim(speeds.min() - 0.25 * gap, tops.max() + 0.35 * gap)
    panel.grid(False, axis="y")
    if speeds.size <= 12:
        panel.set_yticks(np.sort(speeds), [number_text(value) for value in np.sort(speeds)])


def _scale(panel: Axes, unit: str, largest: float, factor: float) -> None:
    """Draw a bar of a round amplitude beside the panel: the ordinate shows the speed."""
    power = 10.0 ** np.floor(np.log10(largest))
    length = max(step * power for step in (1.0, 2.0, 5.0) if step * power <= largest)
    low, high = panel.get_ylim()
    top = high - 0.04 * (high - low)
    bottom = top - factor * length
    where = panel.get_yaxis_transform()
    style: dict[str, Any] = {"color": rc("text.color"), "linewidth": 1.0, "clip_on": False}
    panel.plot([1.02, 1.02], [bottom, top], transform=where, **style)
    for end in (bottom, top):
        panel.plot([1.012, 1.028], [end, end], transform=where, **style)
    text = f"{number_text(length)} {unit}".rstrip()
    panel.text(1.04, 0.5 * (bottom + top), text, transform=where, va="center", color=GREY,
               fontsize=7.5)  # fmt: skip
