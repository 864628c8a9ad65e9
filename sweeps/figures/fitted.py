"""Fits to measured speeds: curves, residuals, predictions, and how parameters hang together.

What is drawn is a Dataset of `sweeps.identify`; each recording has a panel, or a group of marks.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from sweeps.figures.marks import line_style, shade
from sweeps.figures.recordings import (
    COMPUTED,
    MEASURED,
    PERCENT,
    closed,
    numbers_of,
    recording_panels,
    recording_tag,
    tooth_figure,
    weighted_mean,
    with_recordings,
)
from sweeps.figures.scales import y_label
from sweeps.figures.sheet import GREY, Entries, NamedFigures, finish, new_sheet
from sweeps.figures.study import Study
from sweeps.figures.views import View
from sweeps.figures.wording import HARD_SPACE, shorten, unit_text

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["fitted_names", "fitted_speeds"]

NORMAL = 1.96
"""Standard deviations to each side of a 95 % interval."""

MOST_PARAMETERS = 24
"""Of the map of correlations."""

DARK = 0.55
"""Size of a correlation from which its number is written in white."""


def fitted_names(view: View) -> list[str]:
    """All variables of a fit to measured speeds; none of other archives."""
    if not (view.has("omega_through_wheel") and view.has("residual") and view.has("value")):
        return []
    return [str(name) for name in view.data.data_vars]


def fitted_speeds(study: Study, names: Sequence[str]) -> NamedFigures:
    """Draw a fit: curves, residuals, delta, parameters, and the teeth where they were fitted."""
    view = with_recordings(study.view)
    notes = _notes(view)
    yield (
        "fitted_speed",
        recording_panels(
            view,
            "Measured and fitted speed",
            _speeds,
            PERCENT,
            ["±: 95 % intervals", *notes],
            _title,
        ),
    )
    yield "fit_residuals", recording_panels(
        view, "Residuals of the fit", _residuals, "Measured less fitted (standard errors)",
        _of_noise(view), recording_tag,
    )  # fmt: skip
    yield "fit_delta", _deltas(view)
    if "parameter" in view.data.dims and view.data.sizes["parameter"] <= MOST_PARAMETERS:
        yield "fit_correlations", _correlations(view)
    if "tooth_error" in names:
        yield "tooth_errors", tooth_figure(
            view, str(view.data.attrs.get("wheel", "")), "tooth_error_deviation",
            "estimated with the parameters",
        )  # fmt: skip


def _notes(view: View) -> list[str]:
    """What was found, as far as a line has room."""
    data = view.data
    names, units = (np.atleast_1d(data[key].values) for key in ("parameter", "unit"))
    low, value, high = (
        np.atleast_1d(numbers_of(view, name)) for name in ("value_low", "value", "value_high")
    )
    notes = [
        f"{str(name).replace('_', ' ')} {_rounded(one, 0.5 * (last - first), str(unit))}"
        for name, unit, first, one, last in zip(names, units, low, value, high, strict=True)
    ]
    if len(notes) > 4:
        return [*notes[:4], f"and {len(notes) - 4} more"]
    return notes


def _rounded(value: float, half: float, unit: str) -> str:
    """A value and half its interval, to two digits of that, as text that no line breaks."""
    digits = max(0, 1 - int(np.floor(np.log10(half)))) if half > 0.0 else 4
    text = f"{value:.{digits}f} ± {half:.{digits}f}".replace("-", "\N{MINUS SIGN}")
    sign = unit_text(unit)
    space = "" if sign in ("", "\N{DEGREE SIGN}") else " "
    return f"{text}{space}{sign}".replace(" ", HARD_SPACE)


def _title(view: View, place: int) -> str:
    """Recording, and how large what is left is."""
    residual = numbers_of(view, "residual")[place][numbers_of(view, "interval_used") > 0]
    rms = float(np.sqrt(np.mean(residual**2)))
    return f"{recording_tag(view, place)}\nrms residual {rms:.2g} standard errors"


def _of_noise(view: View) -> list[str]:
    attributes = view.data.attrs
    likely = float(attributes["likelihood_of_noise"])
    at_most = "at most " if likely <= float(attributes.get("least_likelihood", 0.0)) else ""
    return [
        f"reduced chi square {float(attributes['reduced_chi_square']):.3g}",
        f"likelihood of noise {at_most}{likely:.2g}",
    ]


def _speeds(panel: Axes, view: View, place: int) -> Entries:
    """Measured mean with its spread over cycles, and the fitted speed as seen through the wheel."""
    angle, used = numbers_of(view, "interval"), numbers_of(view, "interval_used") > 0
    mean, spread, own = (
        numbers_of(view, name)[place]
        for name in ("omega_raw", "omega_raw_std", "omega_through_wheel")
    )
    level, own_level = weighted_mean(view, mean), weighted_mean(view, own)
    mean, own = (np.where(used, curve, np.nan) for curve in (mean, own))
    x, y = closed(angle, 100.0 * (mean / level - 1.0))
    _, half = closed(angle, 100.0 * spread / level)
    band = panel.fill_between(x, y - half, y + half, color=shade(MEASURED), alpha=0.2, linewidth=0)
    (line,) = panel.plot(x, y, color=shade(MEASURED), linewidth=0.9)
    x, y = closed(angle, 100.0 * (own / own_level - 1.0))
    (other,) = panel.plot(x, y, color=shade(COMPUTED), linestyle=(0, (5, 1.5)), linewidth=0.9)
    wheel = "wheel" in view.data.attrs
    return {
        "measured, raw, mean over cycles" if wheel else "measured, mean over cycles": line,
        "± standard deviation over cycles": band,
        "fitted, through the wheel" if wheel else "fitted": other,
    }


def _residuals(panel: Axes, view: View, place: int) -> Entries:
    """Residuals over the angle, and where 95 % of noise would be."""
    angle, used = numbers_of(view, "interval"), numbers_of(view, "interval_used") > 0
    residual = np.where(used, numbers_of(view, "residual")[place], np.nan)
    band = panel.axhspan(-NORMAL, NORMAL, color=shade(MEASURED), alpha=0.12, linewidth=0)
    panel.axhline(0.0, color="black", linewidth=0.6)
    marks = "." if angle.size <= 240 else ""
    (line,) = panel.plot(
        angle, residual, color=shade(MEASURED), linewidth=0.6, marker=marks, markersize=3.0
    )
    return {"measured less fitted": line, "95 % of noise": band}


def _deltas(view: View) -> Figure:
    """Raw delta of every recording: measured, fitted, and predicted from the others."""
    count = view.data.sizes["recording"]
    figure, (panel,) = new_sheet(1, 1, 3.2)
    place = np.arange(count, dtype=float)
    rows = [
        ("delta_measured_raw", "delta_measured_raw_uncertainty", "measured", "o", MEASURED),
        ("delta_through_wheel", "", "fitted to all recordings", "D", COMPUTED),
        ("delta_predicted", "delta_predicted_deviation", "predicted from the others", "^",
         COMPUTED),
    ]  # fmt: skip
    rows = [row for row in rows if view.has(row[0])]
    entries: Entries = {}
    for number, (name, uncertainty, text, marker, lightness) in enumerate(rows):
        colour = shade(lightness)
        style = {**line_style(0, 1), "linestyle": "none", "color": colour, "marker": marker,
                 "markerfacecolor": colour if uncertainty else "white",
                 "markersize": 5.5}  # fmt: skip
        error = NORMAL * np.atleast_1d(numbers_of(view, uncertainty)) if uncertainty else None
        values = np.atleast_1d(numbers_of(view, name))
        shift = 0.16 * (number - 0.5 * (len(rows) - 1))
        drawn = panel.errorbar(place + shift, values, error, capsize=2.5, elinewidth=0.9, **style)
        entries[text] = drawn.lines[0]
    panel.set_xticks(place, [recording_tag(view, i) for i in range(count)])
    panel.set_xlim(-0.5, count - 0.5)
    panel.set_ylim(0.0, 1.03 * panel.get_ylim()[1])
    panel.grid(False, axis="x")
    for middle in place[:-1] + 0.5:
        panel.axvline(middle, color=GREY, linewidth=0.4)
    wheel = "wheel" in view.data.attrs
    raw = "Raw coefficient" if wheel else "Coefficient"
    y_label(panel, rf"{raw} of speed fluctuation $\delta$", 2.6)
    return finish(
        figure, "Speed fluctuation, measured, fitted and predicted",
        ["bars and ±: 95 % intervals", *_notes(view)], entries, "", view.caption, below=True,
    )  # fmt: skip


def _correlations(view: View) -> Figure:
    """Map of the correlations of the fitted values."""
    size = numbers_of(view, "correlation")
    names = [shorten(str(name).replace("_", " ")) for name in view.data["parameter"].values]
    side = (0.42 if len(names) > 6 else 0.6) * len(names)
    room = 0.07 * max(len(name) for name in names)
    figure, (panel,) = new_sheet(1, 1, side + 0.8 * room, width=max(side + room + 1.2, 3.4))
    shown = panel.imshow(size, cmap="RdBu_r", vmin=-1.0, vmax=1.0)
    for row, column in np.ndindex(size.shape):
        value = size[row, column]
        text = f"{value:.2f}".replace("-", "\N{MINUS SIGN}") if np.isfinite(value) else ""
        panel.text(column, row, text, ha="center", va="center", size=7.0,
                   color="white" if abs(value) > DARK else "black")  # fmt: skip
    panel.set_xticks(range(len(names)), names, rotation=35, ha="right", rotation_mode="anchor")
    panel.set_yticks(range(len(names)), names)
    panel.grid(False)
    figure.colorbar(shown, ax=panel, label="Correlation")
    condition = float(view.data.attrs["condition_number"])
    return finish(
        figure, "Correlations of the fitted values", [f"condition number {condition:.3g}"], None,
        "", view.caption,
    )  # fmt: skip
