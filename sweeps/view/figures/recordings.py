"""What figures of recordings share: panels over the crank angle, names of recordings, teeth."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from engine_dyn.types import Floats
from sweeps.view.figures.marks import line_style, shade
from sweeps.view.figures.multiples import Multiples, multiples
from sweeps.view.figures.scales import crank_axis, y_label
from sweeps.view.figures.sheet import GREY, Entries, finish, new_sheet
from sweeps.view.figures.views import MOST_PANELS, View, pick
from sweeps.view.figures.wording import file_label, shorten, value_text

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

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
    return file_label(str(view.data["file"].values[place]))


def closed(angle: Floats, values: Floats) -> tuple[Floats, Floats]:
    """A curve over the cycle, with its first point again at the end."""
    turn = 720.0 if angle[-1] - angle[0] > 365.0 else 360.0
    return np.append(angle, angle[0] + turn), np.append(values, values[0])


def weighted_mean(view: View, values: Floats) -> float:
    """Mean over the angle of the intervals that are used."""
    width = view.numbers("interval_width") * view.numbers("interval_used")
    return float(np.sum(values * width) / np.sum(width))


def percent(values: Floats, mean: float) -> Floats:
    """Deviation from a mean in percent."""
    return 100.0 * (values / mean - 1.0)


def beside(
    panel: Axes, angle: Floats, curves: tuple[Floats, Floats, Floats],
    means: tuple[float, float], texts: tuple[str, str], width: float | None = None,
) -> Entries:  # fmt: skip
    """Draw a measured speed with its spread over cycles, and a computed one, over their means."""
    measured, spread, computed = curves
    x, y = closed(angle, percent(measured, means[0]))
    _, half = closed(angle, 100.0 * spread / means[0])
    band = panel.fill_between(x, y - half, y + half, color=shade(MEASURED), alpha=0.2, linewidth=0)
    (line,) = panel.plot(x, y, color=shade(MEASURED), linewidth=width)
    look = {"color": shade(COMPUTED), "linestyle": (0, (5, 1.5)), "linewidth": width}
    (other,) = panel.plot(*closed(angle, percent(computed, means[1])), **look)
    return {texts[0]: line, "± standard deviation over cycles": band, texts[1]: other}


def through_wheel(panel: Axes, view: View, place: int, texts: tuple[str, str]) -> Entries:
    """Draw the raw speed of each interval, and what the computed speed would show there."""
    used = view.numbers("interval_used") > 0
    raw, spread, own = (
        view.numbers(name)[place] for name in ("omega_raw", "omega_raw_std", "omega_through_wheel")
    )
    means = weighted_mean(view, raw), weighted_mean(view, own)
    curves = np.where(used, raw, np.nan), spread, np.where(used, own, np.nan)
    return beside(panel, view.numbers("interval"), curves, means, texts, 0.9)


@dataclass(frozen=True)
class Delta:
    """Marks of one kind of delta: its variable, that of its uncertainty, and how it looks."""

    name: str
    uncertainty: str
    text: str
    marker: str
    lightness: float


def delta_figure(
    view: View, rows: Sequence[Delta], step: float, ordinate: str, title: str,
    notes: Sequence[str], deviations: float = 1.0,
) -> Figure:  # fmt: skip
    """Deltas of all recordings beside each other, with bars of so many standard errors."""
    count = view.data.sizes["recording"]
    figure, (panel,) = new_sheet(1, 1, 3.4)
    place = np.arange(count, dtype=float)
    entries: Entries = {}
    for number, row in enumerate(rows):
        colour = shade(row.lightness)
        style = {**line_style(0, 1), "linestyle": "none", "color": colour, "marker": row.marker,
                 "markerfacecolor": colour if row.uncertainty else "white",
                 "markersize": 5.5}  # fmt: skip
        error = deviations * view.numbers(row.uncertainty) if row.uncertainty else None
        known = error if error is None or np.isfinite(error).any() else None
        x = place + step * (number - 0.5 * (len(rows) - 1))
        y = view.numbers(row.name)
        drawn = panel.errorbar(x, y, known, capsize=2.5, elinewidth=0.9, **style)
        entries[row.text] = drawn.lines[0]
    panel.set_xticks(place, [recording_tag(view, i) for i in range(count)])
    panel.set_xlim(-0.5, count - 0.5)
    panel.set_ylim(0.0, 1.03 * panel.get_ylim()[1])
    panel.grid(False, axis="x")
    for middle in place[:-1] + 0.5:
        panel.axvline(middle, color=GREY, linewidth=0.4)
    y_label(panel, ordinate, 2.8)
    return finish(figure, title, notes, entries, "", view.caption, below=True)


def recording_panels(
    view: View, title: str, draw: Draw, ordinate: str, notes: Sequence[str],
    tag: Callable[[View, int], str],
) -> Figure:  # fmt: skip
    """A panel for each recording over the crank angle, on one ordinate."""
    shown = shown_recordings(view)
    sheet = multiples(len(shown), 0.6, 2.0, sharex=True, sharey=True)
    for panel, place in zip(sheet.panels, shown, strict=True):
        sheet.entries.update(draw(panel, view, place))
        panel.set_title(tag(view, place))
    _cycle_axes(view, sheet)
    sheet.label_y(ordinate, 1.6)
    return sheet.finish(title, notes, view.caption)


def _cycle_axes(view: View, sheet: Multiples) -> None:
    """The whole cycle along all panels, named below the lowest ones."""
    import xarray as xr

    width = float(view.numbers("interval_width").sum())
    if "crank_angle" in view.data.coords:
        variable, start = view.array("crank_angle"), float(view.numbers("crank_angle")[0])
    else:
        variable = xr.Variable((), 0.0, {"long_name": "crank angle", "units": "degree"})
        start = -0.5 * round(width / 360.0) * 360.0
    for panel in sheet.panels:
        panel.set_xlim(start, start + width)
        crank_axis(panel, variable, 6.3 / sheet.columns, named=panel in sheet.lowest)


def tooth_figure(view: View, wheel: str, uncertainty: str, source: str) -> Figure:
    """Errors of the wheel's intervals with their standard errors."""
    figure, (panel,) = new_sheet(1, 1, 2.8)
    tooth = view.numbers("tooth")
    error, unsure = 100.0 * view.numbers("tooth_error"), 100.0 * view.numbers(uncertainty)
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
