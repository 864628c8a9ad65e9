"""Torque or angle of a shaft over the cycle, as the sum of its orders."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import xarray as xr

from engine_dyn.types import Floats
from sweeps.figures.marks import DASHES, line_style
from sweeps.figures.multiples import multiples
from sweeps.figures.options import with_angle_from_zero
from sweeps.figures.shaft_modes import ORDER, SPEED
from sweeps.figures.shaft_speed import (
    PARTS,
    at_most_loaded,
    largest_along,
    misfires,
    part_text,
    size_of,
    with_worst_misfire,
)
from sweeps.figures.sheet import GREY, NamedFigures, rc
from sweeps.figures.study import Study
from sweeps.figures.traces import line_or_mark, set_cycle, trace
from sweeps.figures.views import MISFIRE, View, stem_of
from sweeps.figures.wording import number_text, with_unit

if TYPE_CHECKING:
    from matplotlib.figure import Figure

STEP = 0.25
"""Degrees between the angles: 120 of them in a period of order 12."""

MOST_PARTS = 3
"""Orders that are drawn beside their sum."""


def shaft_cycle_names(view: View) -> list[str]:
    """Phases of torque and angle whose amplitudes are there; these get other figures too."""
    pairs = [(f"{what}_phase", f"{what}_order") for what in PARTS]
    return [phase for phase, order in pairs if view.has(phase) and view.has(order)]


def shaft_cycles(study: Study, names: Sequence[str]) -> NamedFigures:
    """Draw the sum of the orders over the cycle for the worst part at the worst speed."""
    for name in names:
        what = name.removesuffix("_phase")
        view = at_most_loaded(study.view, what)
        if SPEED in view.array(f"{what}_order").dims:
            size = largest_along(view, size_of(view, what), SPEED)
            view = view.slice_at({SPEED: int(np.argmax(size))})
        view = view.only([f"{what}_order", name], [MISFIRE])
        yield stem_of(f"{what}_cycle", view, None), _cycle(view, what)


def sum_of_orders(degrees: Floats, order: Floats, amplitude: Floats, phase: Floats) -> Floats:
    """Sum of amplitude cos(nu phi + phase) of some orders at crank angles; all in degrees."""
    angles = np.radians(np.multiply.outer(degrees, order) + phase)
    return np.asarray(np.sum(amplitude * np.cos(angles), axis=-1))


def _cycle(view: View, what: str) -> Figure:
    """A panel without misfire and one with the worst: the sum, its half range, large orders."""
    name = f"{what}_order"
    misfire = view.axis(MISFIRE) if misfires(view, name) else view.axis(None)
    shown = with_worst_misfire(view, size_of(view, what)) if misfire else [0]
    places = [misfire.place(index) for index in shown]
    order = view.numbers(ORDER)
    sizes = np.max([np.nan_to_num(view.numbers(name, place)) for place in places], axis=0)
    large = sorted(np.argsort(-sizes, kind="stable")[:MOST_PARTS])
    sheet = multiples(len(shown), 0.6, 2.0, columns=1, sharex=True, sharey=True)
    for panel, place in zip(sheet.panels, places, strict=True):
        curves = {f"order {number_text(order[one])}": [one] for one in large}
        here = _over_angle(view, what, place, {"sum of all orders": [*range(order.size)], **curves})
        for rank, text in enumerate(map(str, here.data.data_vars)):
            style = line_style(rank, len(here.data.data_vars)) | {"marker": "", "linewidth": 0.8}
            if not rank:
                style |= {"color": rc("text.color"), "linewidth": 1.7, "zorder": 3}
            line_or_mark(panel, trace(here, text, {}), style, text, rank, sheet.entries)
        low, high = (float(end(here.numbers("sum of all orders"))) for end in (np.min, np.max))
        for end in (low, high):
            line = panel.axhline(end, color=GREY, linewidth=0.7, linestyle=DASHES[3])
            sheet.entries["largest and least value"] = line
        half = with_unit(view.array(name), 0.5 * (high - low))
        case = misfire.tag(place[MISFIRE]) + ": " if misfire else ""
        panel.set_title(f"{case}half range {half}")
    set_cycle(sheet.panels, here, 4.6, sheet.lowest)
    sheet.label_y(f"{part_text(name).capitalize()}{view.unit(name)}", 1.8)
    title = f"{part_text(name).capitalize()} over the cycle, the sum of its orders"
    return sheet.finish(title, view.notes([name]), view.caption, below=False)


def _over_angle(
    view: View, what: str, place: Mapping[str, int], parts: Mapping[str, list[int]]
) -> View:
    """Sums of some orders as curves over the crank angle, as it is counted in all figures."""
    order, amplitude, phase = (
        view.numbers(name, place) for name in (ORDER, f"{what}_order", f"{what}_phase")
    )
    cycle = 720.0 if np.any(order % 1.0) else 360.0
    degrees = np.arange(-0.5 * cycle, 0.5 * cycle, STEP)
    about = {"long_name": "crank angle", "symbol": r"$\varphi$", "units": "degree"}
    curves = {
        text: ("crank_angle", sum_of_orders(degrees, order[some], amplitude[some], phase[some]))
        for text, some in parts.items()
    }
    data = xr.Dataset(curves, coords={"crank_angle": ("crank_angle", degrees, about)})
    return replace(view, data=with_angle_from_zero(data, view.options))
