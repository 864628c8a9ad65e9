"""What figures of recordings share: panels over the crank angle, names of recordings, teeth."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from engine_dyn.types import Floats
from sweeps.figures.marks import shade
from sweeps.figures.scales import crank_axis, left_labels, y_label
from sweeps.figures.sheet import Entries, bare_panels, finish, grid_of, lowest_panels, new_sheet
from sweeps.figures.views import MOST_PANELS, View, pick
from sweeps.figures.wording import shorten, value_text

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = [
    "COMPUTED",
    "MEASURED",
    "PERCENT",
    "Draw",
    "closed",
    "cycle_axes",
    "numbers_of",
    "recording_panels",
    "recording_tag",
    "shown_recordings",
    "tooth_figure",
    "weighted_mean",
    "with_recordings",
]

Draw = Callable[["Axes", View, int], Entries]
"""Draws one recording into a panel, and says what the legend explains."""

MEASURED, COMPUTED = 0.0, 0.75
"""Where on the scale of lightness both stand."""

SAME = 0.01
"""Relative difference up to which recordings are not told apart by a value."""

PERCENT = "Deviation from the mean (%)"


def with_recordings(view: View) -> View:
    """The view with its dimension `recording`, which was cut away where there is only one."""
    data = view.data
    if "recording" in data.dims:
        return view
    import xarray as xr

    variables = {}
    for key, variable in data.variables.items():
        along = variable.dims[:1] in (("crank_angle",), ("interval",), ("order",), ())
        single = (key in data.data_vars and along) or (key in data.coords and not variable.dims)
        variables[key] = variable.expand_dims("recording") if single else variable
    found = xr.Dataset(
        {key: variables[key] for key in data.data_vars},
        {key: variables[key] for key in data.coords},
        data.attrs,
    )
    return replace(view, data=found)


def numbers_of(view: View, name: str) -> Floats:
    """Values of a variable or coordinate."""
    return np.asarray(view.array(name).values, dtype=float)


def shown_recordings(view: View) -> list[int]:
    """Recordings that get a panel."""
    return pick(view.data.sizes["recording"], MOST_PANELS)


def recording_tag(view: View, place: int) -> str:
    """A recording by the value of the axis that it belongs to, or its file."""
    for key, coordinate in view.data.coords.items():
        if coordinate.dims != ("recording",) or key in ("recording", "file", "design_number"):
            continue
        values = coordinate.values
        if coordinate.dtype.kind not in "if":
            return shorten(str(values[place]))
        if values.size == 1 or np.ptp(values) > SAME * np.abs(values).max():
            return value_text(coordinate.variable, str(key), float(values[place]))
    return shorten(str(view.data["file"].values[place]))


def closed(angle: Floats, values: Floats) -> tuple[Floats, Floats]:
    """A curve over the cycle, with its first point again at the end."""
    turn = 720.0 if angle[-1] - angle[0] > 365.0 else 360.0
    return np.append(angle, angle[0] + turn), np.append(values, values[0])


def weighted_mean(view: View, values: Floats) -> float:
    """Mean over the angle of the intervals that are used."""
    width = numbers_of(view, "interval_width") * numbers_of(view, "interval_used")
    return float(np.sum(values * width) / np.sum(width))


def recording_panels(
    view: View, title: str, draw: Draw, ordinate: str, notes: Sequence[str],
    tag: Callable[[View, int], str],
) -> Figure:  # fmt: skip
    """A panel for each recording over the crank angle, on one ordinate."""
    shown = shown_recordings(view)
    rows, columns = grid_of(len(shown))
    figure, panels = new_sheet(rows, columns, 0.6 + 2.0 * rows, sharex=True, sharey=True)
    entries: Entries = {}
    for panel, place in zip(panels, shown, strict=False):
        entries |= draw(panel, view, place)
        panel.set_title(tag(view, place))
    cycle_axes(view, panels, len(shown), columns)
    left_labels(panels, columns, ordinate, 1.6)
    return finish(
        figure, title, notes, entries, "", view.caption, below=True, spare=panels[len(shown) :],
    )  # fmt: skip


def cycle_axes(view: View, panels: Sequence[Axes], count: int, columns: int) -> None:
    """The whole cycle along all panels, named below the lowest ones."""
    import xarray as xr

    width = float(numbers_of(view, "interval_width").sum())
    if "crank_angle" in view.data.coords:
        variable, start = view.array("crank_angle"), float(numbers_of(view, "crank_angle")[0])
    else:
        variable = xr.Variable((), 0.0, {"long_name": "crank angle", "units": "degree"})
        start = -0.5 * round(width / 360.0) * 360.0
    bare_panels(panels, count, columns)
    lowest = lowest_panels(panels, count, columns)
    for panel in panels[:count]:
        panel.set_xlim(start, start + width)
        crank_axis(panel, variable, 6.3 / columns, named=panel in lowest)


def tooth_figure(view: View, wheel: str, uncertainty: str, source: str) -> Figure:
    """Errors of the wheel's intervals with their standard errors."""
    figure, (panel,) = new_sheet(1, 1, 2.8)
    tooth = numbers_of(view, "tooth")
    error, unsure = 100.0 * numbers_of(view, "tooth_error"), 100.0 * numbers_of(view, uncertainty)
    panel.bar(tooth, error, 0.75, color=shade(COMPUTED))
    if np.isfinite(unsure).any():
        panel.errorbar(
            tooth, error, unsure, linestyle="none", color=shade(MEASURED), elinewidth=0.8
        )
    panel.axhline(0.0, color="black", linewidth=0.6)
    panel.set_xlim(0.0, tooth[-1] + 1.0)
    panel.set_xlabel("Interval after the gap; the last is the gap")
    y_label(panel, "Error of the width (%)", 2.2)
    rms = float(np.sqrt(np.nanmean(error**2)))
    notes = [f"{rms:.2g} % rms", f"{source}; bars: standard error"]
    return finish(figure, f"Errors of the wheel {wheel}", notes, None, "", view.caption)
