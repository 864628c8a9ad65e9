"""Measured speed beside the computed one: curves with bands, differences, orders, teeth.

What is drawn is a Dataset of `sweeps.measured`; each recording has a panel, or a group of marks.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from sweeps.view.figures.marks import shade
from sweeps.view.figures.multiples import multiples
from sweeps.view.figures.recordings import (
    COMPUTED,
    MEASURED,
    PERCENT,
    Delta,
    beside,
    closed,
    delta_figure,
    percent,
    recording_panels,
    recording_tag,
    shown_recordings,
    through_wheel,
    tooth_figure,
    weighted_mean,
    with_recordings,
)
from sweeps.view.figures.sheet import Entries, NamedFigures
from sweeps.view.figures.study import Study
from sweeps.view.figures.views import MOST_PANELS, View

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["measured_speeds"]

DELTAS = (
    Delta("delta_measured_raw", "delta_measured_raw_uncertainty", "measured, raw", "o", MEASURED),
    Delta("delta_through_wheel", "", "computed, through the wheel", "D", COMPUTED),
    Delta("delta_measured", "delta_measured_uncertainty", "measured, tooth errors out", "s",
          MEASURED),
    Delta("delta", "", "computed", "^", COMPUTED),
)  # fmt: skip
DELTAS_ALONE = (replace(DELTAS[2], text="measured"), DELTAS[3])
"""What is drawn of the deltas, and where no tooth errors were taken out."""

DIFFERENCE = "Measured less computed (% of the mean)"


def measured_speeds(study: Study, names: Sequence[str]) -> NamedFigures:
    """Draw a comparison: curves, differences, orders, delta, and the teeth where there are some."""
    view = with_recordings(study.view)
    wheel, notes = str(view.data.attrs.get("wheel", "")), _notes(view)
    yield (
        "measured_speed",
        recording_panels(view, "Measured and computed speed", _corrected, PERCENT, notes, _title),
    )
    if wheel:
        title = f"Raw speed and computed speed seen through the wheel {wheel}"
        yield "measured_speed_raw", recording_panels(view, title, _raw, PERCENT, notes, _title_raw)
    yield "measured_difference", recording_panels(
        view, "Difference of measured and computed speed", _differences, DIFFERENCE, notes,
        _title_raw if wheel else _title,
    )  # fmt: skip
    yield "measured_orders", _orders(view)
    rows, step = (DELTAS, 0.14) if _has_errors(view) else (DELTAS_ALONE, 0.2)
    yield "measured_delta", delta_figure(
        view, rows, step, r"Coefficient of speed fluctuation $\delta$",
        "Speed fluctuation, measured and computed", [*notes, "bars: standard error"],
    )  # fmt: skip
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


def _corrected(panel: Axes, view: View, place: int) -> Entries:
    """Measured mean and band of one standard deviation over cycles, and the computed speed."""
    mean, own = (view.numbers(name)[place] for name in ("omega_measured", "omega"))
    curves = mean, view.numbers("omega_measured_std")[place], own
    means = float(mean.mean()), float(own.mean())
    texts = "measured, mean over cycles", "computed"
    return beside(panel, view.numbers("crank_angle"), curves, means, texts)


def _raw(panel: Axes, view: View, place: int) -> Entries:
    """Raw speed of each interval with its band, and what the computed speed would show there."""
    texts = "raw, mean over cycles", "computed, through the wheel"
    return through_wheel(panel, view, place, texts)


def _title(view: View, place: int, raw: str = "") -> str:
    """Recording, and how alike the curves are."""
    rms = view.numbers(f"rms_difference{raw}")[place]
    alike = view.numbers(f"correlation{raw}")[place]
    if not np.isfinite(alike):
        return f"{recording_tag(view, place)}\nno computed speed"
    return f"{recording_tag(view, place)}\ncorrelation {alike:.3f}, rms {100 * rms:.2g} %"


def _title_raw(view: View, place: int) -> str:
    return _title(view, place, "_raw")


def _differences(panel: Axes, view: View, place: int) -> Entries:
    """Measured less computed speed over the angle, with the standard error of the mean."""
    raw = "wheel" in view.data.attrs
    pair = ("omega_raw", "omega_through_wheel") if raw else ("omega_corrected",
                                                             "omega_between_teeth")  # fmt: skip
    angle, cycles = view.numbers("interval"), view.numbers("recorded_cycles")[place]
    one, other = (view.numbers(name)[place] for name in pair)
    difference = percent(one, weighted_mean(view, one)) - percent(other, weighted_mean(view, other))
    x, y = closed(angle, np.where(view.numbers("interval_used") > 0, difference, np.nan))
    level = weighted_mean(view, view.numbers("omega_raw")[place])
    _, half = closed(angle, 100.0 * view.numbers("omega_raw_std")[place] / level / np.sqrt(cycles))
    band = panel.fill_between(x, y - half, y + half, color=shade(MEASURED), alpha=0.25, linewidth=0)
    (line,) = panel.plot(x, y, color=shade(MEASURED), linewidth=1.0)
    panel.axhline(0.0, color="black", linewidth=0.6)
    text = "raw less computed through the wheel" if raw else "measured less computed"
    return {text: line, "± standard error of the mean": band}


def _orders(view: View) -> Figure:
    """Amplitudes of orders, measured and computed side by side, over the mean speed."""
    shown = shown_recordings(view)
    sheet = multiples(len(shown), 0.6, 2.0, sharex=True, sharey=True)
    orders = view.numbers("order")
    room = 0.5 if orders.size and orders[0] < 1.0 else 1.0
    for panel, place in zip(sheet.panels, shown, strict=True):
        level = view.numbers("omega_mean_measured")[place]
        own = float(view.numbers("omega")[place].mean())
        for name, mean, rank, colour, text in (
            ("omega_measured_order", level, -0.5, MEASURED, "measured"),
            ("omega_order", own, 0.5, COMPUTED, "computed"),
        ):
            values = 100.0 * view.numbers(name)[place] / mean
            bars = panel.bar(orders + rank * 0.38 * room, values, 0.36 * room, color=shade(colour))
            sheet.entries.setdefault(text, bars[0])
        panel.set_title(recording_tag(view, place))
        panel.set_xticks(np.arange(1, orders[-1] + 1))
        panel.grid(False, axis="x")
    for panel in sheet.lowest:
        panel.set_xlabel("Order of the crank's turn")
    sheet.label_y("Amplitude (% of the mean speed)", 1.6)
    notes = ["tooth errors taken out of the measured speed"] if _has_errors(view) else []
    return sheet.finish("Orders of measured and computed speed", notes, view.caption)


def _has_errors(view: View) -> bool:
    said = str(view.data.attrs.get("tooth_errors", "not"))
    return not said.startswith("not")
