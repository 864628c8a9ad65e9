"""Fits to measured speeds: curves, residuals, predictions, and how parameters hang together.

What is drawn is a Dataset of `sweeps.identify`; each recording has a panel, or a group of marks.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from sweeps.view.figures.marks import shade
from sweeps.view.figures.recordings import (
    COMPUTED,
    MEASURED,
    PERCENT,
    Delta,
    delta_figure,
    recording_panels,
    recording_tag,
    through_wheel,
    tooth_figure,
    with_recordings,
)
from sweeps.view.figures.sheet import Entries, NamedFigures, finish, new_sheet
from sweeps.view.figures.study import Study
from sweeps.view.figures.views import View
from sweeps.view.figures.wording import HARD_SPACE, shorten, unit_text

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["fitted_speeds"]

NORMAL = 1.96
"""Standard deviations to each side of a 95 % interval."""

MOST_PARAMETERS = 24
"""Of the map of correlations."""

DELTAS = (
    Delta("delta_measured_raw", "delta_measured_raw_uncertainty", "measured", "o", MEASURED),
    Delta("delta_through_wheel", "", "fitted to all recordings", "D", COMPUTED),
    Delta("delta_predicted", "delta_predicted_deviation", "predicted from the others", "^",
          COMPUTED),
)  # fmt: skip
"""What is drawn of the deltas: measured, fitted, and predicted from the other recordings."""

DARK = 0.55
"""Size of a correlation from which its number is written in white."""


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
    raw = "Raw coefficient" if "wheel" in view.data.attrs else "Coefficient"
    yield "fit_delta", delta_figure(
        view, [row for row in DELTAS if view.has(row.name)], 0.16,
        rf"{raw} of speed fluctuation $\delta$",
        "Speed fluctuation, measured, fitted and predicted", ["bars and ±: 95 % intervals", *notes],
        NORMAL,
    )  # fmt: skip
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
        np.atleast_1d(view.numbers(name)) for name in ("value_low", "value", "value_high")
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
    residual = view.numbers("residual")[place][view.numbers("interval_used") > 0]
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
    wheel = "wheel" in view.data.attrs
    texts = ("measured, raw, mean over cycles" if wheel else "measured, mean over cycles",
             "fitted, through the wheel" if wheel else "fitted")  # fmt: skip
    return through_wheel(panel, view, place, texts)


def _residuals(panel: Axes, view: View, place: int) -> Entries:
    """Residuals over the angle, and where 95 % of noise would be."""
    angle, used = view.numbers("interval"), view.numbers("interval_used") > 0
    residual = np.where(used, view.numbers("residual")[place], np.nan)
    band = panel.axhspan(-NORMAL, NORMAL, color=shade(MEASURED), alpha=0.12, linewidth=0)
    panel.axhline(0.0, color="black", linewidth=0.6)
    marks = "." if angle.size <= 240 else ""
    (line,) = panel.plot(
        angle, residual, color=shade(MEASURED), linewidth=0.6, marker=marks, markersize=3.0
    )
    return {"measured less fitted": line, "95 % of noise": band}


def _correlations(view: View) -> Figure:
    """Map of the correlations of the fitted values."""
    size = view.numbers("correlation")
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
