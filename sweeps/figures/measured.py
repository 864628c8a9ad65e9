"""Measured speed beside the computed one: curves with bands, differences, orders, teeth.

What is drawn is a Dataset of `sweeps.measured`; each recording has a panel, or a group of marks.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from engine_dyn.types import Floats
from sweeps.figures.marks import line_style, shade
from sweeps.figures.recordings import (
    COMPUTED,
    MEASURED,
    PERCENT,
    Draw,
    closed,
    cycle_axes,
    numbers_of,
    recording_panels,
    recording_tag,
    shown_recordings,
    tooth_figure,
    weighted_mean,
    with_recordings,
)
from sweeps.figures.scales import left_labels, y_label
from sweeps.figures.sheet import (
    GREY,
    Entries,
    NamedFigures,
    bare_panels,
    finish,
    grid_of,
    lowest_panels,
    new_sheet,
)
from sweeps.figures.study import Study
from sweeps.figures.views import MOST_PANELS, View

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["measured_names", "measured_speeds"]

DIFFERENCE = "Measured less computed (% of the mean)"


def measured_names(view: View) -> list[str]:
    """All variables of a comparison with measured speeds; none of other archives."""
    if not (view.has("omega_measured") and view.has("omega_through_wheel")):
        return []
    return [str(name) for name in view.data.data_vars]


def measured_speeds(study: Study, names: Sequence[str]) -> NamedFigures:
    """Draw a comparison: curves, differences, orders, delta, and the teeth where there are some."""
    view = with_recordings(study.view)
    wheel = str(view.data.attrs.get("wheel", ""))
    yield "measured_speed", _panels(view, "Measured and computed speed", _corrected)
    if wheel:
        title = f"Raw speed and computed speed seen through the wheel {wheel}"
        yield "measured_speed_raw", _panels(view, title, _raw)
    yield "measured_difference", _differences(view)
    yield "measured_orders", _orders(view)
    yield "measured_delta", _deltas(view)
    if "tooth_error" in names:
        said = str(view.data.attrs.get("tooth_errors", ""))
        source = "as given" if said == "as given" else "estimated from all recordings"
        yield "tooth_errors", tooth_figure(view, wheel, "tooth_error_uncertainty", source)


def _notes(view: View) -> list[str]:
    """What was done with the teeth and where the gap is."""
    attributes = view.data.attrs
    notes = []
    if "tooth_errors" in attributes:
        notes.append(f"tooth errors {attributes['tooth_errors']}")
    count = view.data.sizes["recording"]
    if count > MOST_PANELS:
        notes.append(f"{MOST_PANELS} of {count} recordings shown")
    return notes


def _percent(values: Floats, mean: float) -> Floats:
    return 100.0 * (values / mean - 1.0)


def _corrected(panel: Axes, view: View, place: int) -> Entries:
    """Measured mean and band of one standard deviation over cycles, and the computed speed."""
    angle = numbers_of(view, "crank_angle")
    mean, spread = (
        numbers_of(view, name)[place] for name in ("omega_measured", "omega_measured_std")
    )
    own = numbers_of(view, "omega")[place]
    level = float(mean.mean())
    x, y = closed(angle, _percent(mean, level))
    _, half = closed(angle, 100.0 * spread / level)
    band = panel.fill_between(x, y - half, y + half, color=shade(MEASURED), alpha=0.2, linewidth=0)
    (line,) = panel.plot(x, y, color=shade(MEASURED))
    x, y = closed(angle, _percent(own, float(own.mean())))
    (other,) = panel.plot(x, y, color=shade(COMPUTED), linestyle=(0, (5, 1.5)))
    return {
        "measured, mean over cycles": line,
        "± standard deviation over cycles": band,
        "computed": other,
    }


def _raw(panel: Axes, view: View, place: int) -> Entries:
    """Raw speed of each interval with its band, and what the computed speed would show there."""
    angle = numbers_of(view, "interval")
    mean, spread = (numbers_of(view, name)[place] for name in ("omega_raw", "omega_raw_std"))
    own = numbers_of(view, "omega_through_wheel")[place]
    level, other_level = weighted_mean(view, mean), weighted_mean(view, own)
    used = numbers_of(view, "interval_used") > 0
    mean, own = np.where(used, mean, np.nan), np.where(used, own, np.nan)
    x, y = closed(angle, _percent(mean, level))
    _, half = closed(angle, 100.0 * spread / level)
    band = panel.fill_between(x, y - half, y + half, color=shade(MEASURED), alpha=0.2, linewidth=0)
    (line,) = panel.plot(x, y, color=shade(MEASURED), linewidth=0.9)
    x, y = closed(angle, _percent(own, other_level))
    (other,) = panel.plot(x, y, color=shade(COMPUTED), linestyle=(0, (5, 1.5)), linewidth=0.9)
    return {
        "raw, mean over cycles": line,
        "± standard deviation over cycles": band,
        "computed, through the wheel": other,
    }


def _panels(view: View, title: str, draw: Draw) -> Figure:
    """A panel for each recording, on one ordinate."""
    kind = "raw" if draw is _raw else ""
    return recording_panels(
        view, title, draw, PERCENT, _notes(view), lambda view, place: _title(view, place, kind)
    )


def _title(view: View, place: int, kind: str) -> str:
    """Recording, and how alike the curves are."""
    name = "correlation_raw" if kind == "raw" else "correlation"
    rms = numbers_of(view, "rms_difference_raw" if kind == "raw" else "rms_difference")[place]
    alike = numbers_of(view, name)[place]
    return f"{recording_tag(view, place)}\ncorrelation {alike:.3f}, rms {100 * rms:.2g} %"


def _differences(view: View) -> Figure:
    """Measured less computed speed over the angle, with the standard error of the mean."""
    shown = shown_recordings(view)
    rows, columns = grid_of(len(shown))
    figure, panels = new_sheet(rows, columns, 0.6 + 2.0 * rows, sharex=True, sharey=True)
    entries: Entries = {}
    angle, cycles = numbers_of(view, "interval"), numbers_of(view, "recorded_cycles")
    with_wheel = "wheel" in view.data.attrs
    for panel, place in zip(panels, shown, strict=False):
        raw, through, corrected, between, spread = (
            numbers_of(view, name)[place]
            for name in ("omega_raw", "omega_through_wheel", "omega_corrected",
                         "omega_between_teeth", "omega_raw_std")
        )  # fmt: skip
        level = weighted_mean(view, raw)
        x, y = closed(angle, _difference(view, corrected, between))
        if with_wheel:
            y = closed(angle, _difference(view, raw, through))[1]
        y = np.where(closed(angle, numbers_of(view, "interval_used"))[1] > 0, y, np.nan)
        _, half = closed(angle, 100.0 * spread / level / np.sqrt(cycles[place]))
        band = panel.fill_between(x, y - half, y + half, color=shade(MEASURED), alpha=0.25,
                                  linewidth=0)  # fmt: skip
        (line,) = panel.plot(x, y, color=shade(MEASURED), linewidth=1.0)
        panel.axhline(0.0, color="black", linewidth=0.6)
        panel.set_title(_title(view, place, "raw" if with_wheel else ""))
        entries |= {
            "raw less computed through the wheel" if with_wheel else "measured less computed": line,
            "± standard error of the mean": band,
        }
    cycle_axes(view, panels, len(shown), columns)
    left_labels(panels, columns, DIFFERENCE, 1.6)
    return finish(
        figure, "Difference of measured and computed speed", _notes(view), entries, "",
        view.caption, below=True, spare=panels[len(shown) :],
    )  # fmt: skip


def _difference(view: View, one: Floats, other: Floats) -> Floats:
    """Difference of two curves, each over its own mean, in percent."""
    return _percent(one, weighted_mean(view, one)) - _percent(other, weighted_mean(view, other))


def _orders(view: View) -> Figure:
    """Amplitudes of orders, measured and computed side by side, over the mean speed."""
    shown = shown_recordings(view)
    rows, columns = grid_of(len(shown))
    figure, panels = new_sheet(rows, columns, 0.6 + 2.0 * rows, sharex=True, sharey=True)
    orders = numbers_of(view, "order")
    room = 0.5 if orders.size and orders[0] < 1.0 else 1.0
    entries: Entries = {}
    for panel, place in zip(panels, shown, strict=False):
        level = numbers_of(view, "omega_mean_measured")[place]
        own = float(numbers_of(view, "omega")[place].mean())
        for name, mean, rank, colour, text in (
            ("omega_measured_order", level, -0.5, MEASURED, "measured"),
            ("omega_order", own, 0.5, COMPUTED, "computed"),
        ):
            values = 100.0 * numbers_of(view, name)[place] / mean
            bars = panel.bar(orders + rank * 0.38 * room, values, 0.36 * room, color=shade(colour))
            entries.setdefault(text, bars[0])
        panel.set_title(recording_tag(view, place))
        panel.set_xticks(np.arange(1, orders[-1] + 1))
        panel.grid(False, axis="x")
    bare_panels(panels, len(shown), columns)
    for panel in lowest_panels(panels, len(shown), columns):
        panel.set_xlabel("Order of the crank's turn")
    left_labels(panels, columns, "Amplitude (% of the mean speed)", 1.6)
    notes = ["tooth errors taken out of the measured speed"] if _has_errors(view) else []
    return finish(
        figure, "Orders of measured and computed speed", notes, entries, "", view.caption,
        below=True, spare=panels[len(shown) :],
    )  # fmt: skip


def _has_errors(view: View) -> bool:
    said = str(view.data.attrs.get("tooth_errors", "not"))
    return not said.startswith("not")


def _deltas(view: View) -> Figure:
    """Delta of all recordings: raw and corrected with standard errors, beside the computed ones."""
    count = view.data.sizes["recording"]
    figure, (panel,) = new_sheet(1, 1, 3.4)
    place = np.arange(count, dtype=float)
    entries: Entries = {}
    rows: list[tuple[str, str, str, Any, float]] = [
        ("delta_measured_raw", "delta_measured_raw_uncertainty", "measured, raw", "o", -0.21),
        ("delta_through_wheel", "", "computed, through the wheel", "D", -0.07),
        ("delta_measured", "delta_measured_uncertainty", "measured, tooth errors out", "s", 0.07),
        ("delta", "", "computed", "^", 0.21),
    ]
    if not _has_errors(view):
        rows = [(rows[2][0], rows[2][1], "measured", "s", -0.1), (*rows[3][:4], 0.1)]
    for name, uncertainty, text, marker, shift in rows:
        values = numbers_of(view, name)
        colour = shade(MEASURED if uncertainty else COMPUTED)
        style = {**line_style(0, 1), "linestyle": "none", "color": colour, "marker": marker,
                 "markerfacecolor": colour if uncertainty else "white",
                 "markersize": 5.5}  # fmt: skip
        error = numbers_of(view, uncertainty) if uncertainty else None
        known = error if error is None or np.isfinite(error).any() else None
        drawn = panel.errorbar(place + shift, values, known, capsize=2.5, elinewidth=0.9, **style)
        entries[text] = drawn.lines[0]
    panel.set_xticks(place, [recording_tag(view, i) for i in range(count)])
    panel.set_xlim(-0.5, count - 0.5)
    panel.set_ylim(bottom=0.0)
    panel.grid(False, axis="x")
    for middle in place[:-1] + 0.5:
        panel.axvline(middle, color=GREY, linewidth=0.4)
    y_label(panel, r"Coefficient of speed fluctuation $\delta$", 2.8)
    notes = [*_notes(view), "bars: standard error"]
    return finish(
        figure, "Speed fluctuation, measured and computed", notes, entries, "", view.caption,
        below=True,
    )  # fmt: skip
