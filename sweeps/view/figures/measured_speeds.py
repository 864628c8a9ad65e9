"""Measured speeds compared with computed and fitted ones: curves, differences, orders, teeth."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from engine_dyn.types import Floats
from sweeps.view.figures.marks import line_style, shade
from sweeps.view.figures.scales import crank_axis
from sweeps.view.figures.sheet import (
    GREY,
    Entries,
    Multiples,
    NamedFigures,
    finish,
    multiples,
    new_sheet,
    y_label,
)
from sweeps.view.figures.study import Study
from sweeps.view.figures.views import MOST_PANELS, View, pick
from sweeps.view.figures.wording import HARD_SPACE, file_label, shorten, unit_text, value_text

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


Draw = Callable[["Axes", View, int], Entries]
"""Function that draws one recording into a panel and returns the entries of the legend."""

MEASURED, COMPUTED = 0.0, 0.75  # Lightness of the lines of measured and of computed speeds


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
    whole = xr.Dataset(
        {key: variables[key] for key in data.data_vars},
        {key: variables[key] for key in data.coords},
        data.attrs,
    )
    return replace(view, data=whole)


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
        # Recordings whose values differ by less than 1 % are not named by them.
        if values.size == 1 or np.ptp(values) > 0.01 * np.abs(values).max():
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
    """Deltas of all recordings in one panel, with bars of so many standard errors."""
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
    named = pick(count, MOST_PANELS)
    panel.set_xticks(place[named], [recording_tag(view, i) for i in named])
    panel.set_xlim(-0.5, count - 0.5)
    panel.set_ylim(0.0, 1.03 * panel.get_ylim()[1])
    panel.grid(False, axis="x")
    for middle in place[:-1] + 0.5:
        panel.axvline(middle, color=GREY, linewidth=0.4)
    y_label(panel, ordinate, 2.8)
    return finish(figure, title, notes, entries, "", view.caption, below=True)


def recording_panels(
    view: View, title: str, draw: Draw, notes: Sequence[str], tag: Callable[[View, int], str],
    ordinate: str = "Deviation from the mean (%)",
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
    """Show the whole cycle along all panels, named below the lowest ones."""
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


def measured_speeds(study: Study, names: Sequence[str]) -> NamedFigures:
    """Draw a comparison: curves, differences, orders, delta, and the teeth where there are some."""
    view = with_recordings(study.view)
    wheel, notes = str(view.data.attrs.get("wheel", "")), _measured_notes(view)
    yield (
        "measured_speed",
        recording_panels(view, "Measured and computed speed", _corrected, notes, _measured_title),
    )
    if wheel:
        title = f"Raw speed and computed speed seen through the wheel {wheel}"
        yield "measured_speed_raw", recording_panels(view, title, _raw, notes, _title_raw)
    yield "measured_difference", recording_panels(
        view, "Difference of measured and computed speed", _differences, notes,
        _title_raw if wheel else _measured_title, "Measured less computed (% of the mean)",
    )  # fmt: skip
    yield "measured_orders", _orders(view)
    rows: Sequence[Delta] = (
        Delta("delta_measured_raw", "delta_measured_raw_uncertainty", "measured, raw", "o",
              MEASURED),
        Delta("delta_through_wheel", "", "computed, through the wheel", "D", COMPUTED),
        Delta("delta_measured", "delta_measured_uncertainty", "measured, tooth errors out", "s",
              MEASURED),
        Delta("delta", "", "computed", "^", COMPUTED),
    )  # fmt: skip
    step = 0.14
    if not _has_errors(view):  # Without errors of teeth there is one measured delta
        rows, step = (replace(rows[2], text="measured"), rows[3]), 0.2
    yield "measured_delta", delta_figure(
        view, rows, step, r"Coefficient of speed fluctuation $\delta$",
        "Speed fluctuation, measured and computed", [*notes, "bars: standard error"],
    )  # fmt: skip
    if "tooth_error" in names:
        said = str(view.data.attrs.get("tooth_errors", ""))
        source = "as given" if said == "as given" else "estimated from all recordings"
        yield "tooth_errors", tooth_figure(view, wheel, "tooth_error_uncertainty", source)


def _measured_notes(view: View) -> list[str]:
    """Notes on the errors of the teeth, and on recordings that are not shown."""
    attributes = view.data.attrs
    notes = []
    if "tooth_errors" in attributes:
        notes.append(f"tooth errors {attributes['tooth_errors']}")
    count = view.data.sizes["recording"]
    if count > MOST_PANELS:
        notes.append(f"{MOST_PANELS} of {count} recordings shown")
    return notes


def _corrected(panel: Axes, view: View, place: int) -> Entries:
    """Draw the measured mean with the deviation over cycles, and the computed speed."""
    mean, own = (view.numbers(name)[place] for name in ("omega_measured", "omega"))
    curves = mean, view.numbers("omega_measured_std")[place], own
    means = float(mean.mean()), float(own.mean())
    texts = "measured, mean over cycles", "computed"
    return beside(panel, view.numbers("crank_angle"), curves, means, texts)


def _raw(panel: Axes, view: View, place: int) -> Entries:
    """Draw the raw speed of each interval with its band, and the computed speed on the wheel."""
    texts = "raw, mean over cycles", "computed, through the wheel"
    return through_wheel(panel, view, place, texts)


def _measured_title(view: View, place: int, raw: str = "") -> str:
    """Title with the recording, and the correlation of the curves."""
    rms = view.numbers(f"rms_difference{raw}")[place]
    alike = view.numbers(f"correlation{raw}")[place]
    if not np.isfinite(alike):
        return f"{recording_tag(view, place)}\nno computed speed"
    return f"{recording_tag(view, place)}\ncorrelation {alike:.3f}, rms {100 * rms:.2g} %"


def _title_raw(view: View, place: int) -> str:
    return _measured_title(view, place, "_raw")


def _differences(panel: Axes, view: View, place: int) -> Entries:
    """Draw measured less computed speed over the angle, with the standard error of the mean."""
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
    return not str(view.data.attrs.get("tooth_errors", "not")).startswith("not")


def torsiogram(study: Study, names: Sequence[str]) -> NamedFigures:
    """Draw the strongest orders of a disc over the speed, measured and computed."""
    view = with_recordings(study.view)
    speed, orders = view.numbers("speed"), view.numbers("order")
    measured, computed = (view.numbers(name) for name in DISC_ORDERS)
    rank = np.argsort(speed, kind="stable")
    figure, (panel,) = new_sheet(1, 1, 3.6)
    entries: Entries = {}
    strong = sorted(np.argsort(-measured.max(axis=0), kind="stable")[:5])
    for number, one in enumerate(strong):
        style = line_style(number, len(strong))
        (line,) = panel.plot(speed[rank], measured[rank, one], **{**style, "linestyle": "none"})
        panel.plot(speed[rank], computed[rank, one], color=style["color"], linewidth=1.0)
        entries[f"order {orders[one]:g}"] = line
    panel.set_ylim(bottom=0.0)
    panel.set_xlabel(f"Mean speed{view.unit('speed')}")
    y_label(panel, f"Amplitude{view.unit(DISC_ORDERS[0])}", 2.8)
    title = f"Torsiogram of {shorten(str(view.data.attrs.get('disc', 'the disc')))}"
    yield (
        "torsiogram",
        finish(figure, title, ["marks: measured; lines: computed"], entries, "", view.caption),
    )


DISC_ORDERS = ("disc_angle_measured_order", "disc_angle_order")

NORMAL = 1.96  # Half width of a 95 % interval in standard deviations


def fitted_speeds(study: Study, names: Sequence[str]) -> NamedFigures:
    """Draw a fit: curves, residuals, delta, parameters, and the teeth where they were fitted."""
    view = with_recordings(study.view)
    notes = _fit_notes(view)
    yield (
        "fitted_speed",
        recording_panels(
            view, "Measured and fitted speed", _speeds, ["±: 95 % intervals", *notes], _fit_title
        ),
    )
    yield "fit_residuals", recording_panels(
        view, "Residuals of the fit", _residuals, _of_noise(view), recording_tag,
        "Measured less fitted (standard errors)",
    )  # fmt: skip
    raw = "Raw coefficient" if "wheel" in view.data.attrs else "Coefficient"
    rows = (
        Delta("delta_measured_raw", "delta_measured_raw_uncertainty", "measured", "o", MEASURED),
        Delta("delta_through_wheel", "", "fitted to all recordings", "D", COMPUTED),
        Delta("delta_predicted", "delta_predicted_deviation", "predicted from the others", "^",
              COMPUTED),
    )  # fmt: skip
    yield "fit_delta", delta_figure(
        view, [row for row in rows if view.has(row.name)], 0.16,
        rf"{raw} of speed fluctuation $\delta$",
        "Speed fluctuation, measured, fitted and predicted", ["bars and ±: 95 % intervals", *notes],
        NORMAL,
    )  # fmt: skip
    # A map of the correlations of more than 24 parameters would be illegible.
    if "parameter" in view.data.dims and view.data.sizes["parameter"] <= 24:
        yield "fit_correlations", _correlations(view)
    if "tooth_error" in names:
        yield "tooth_errors", tooth_figure(
            view, str(view.data.attrs.get("wheel", "")), "tooth_error_deviation",
            "estimated with the parameters",
        )  # fmt: skip


def _fit_notes(view: View) -> list[str]:
    """Notes with fitted values and their intervals, as many as a line has room for."""
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
    """A value and half its interval, to two digits of the latter, as unbroken text."""
    digits = max(0, 1 - int(np.floor(np.log10(half)))) if half > 0.0 else 4
    text = f"{value:.{digits}f} ± {half:.{digits}f}".replace("-", "\N{MINUS SIGN}")
    sign = unit_text(unit)
    space = "" if sign in ("", "\N{DEGREE SIGN}") else " "
    return f"{text}{space}{sign}".replace(" ", HARD_SPACE)


def _fit_title(view: View, place: int) -> str:
    """Title with the recording, and the size of the residuals."""
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
    """Draw the measured mean with its spread, and the fitted speed as the wheel shows it."""
    wheel = "wheel" in view.data.attrs
    texts = ("measured, raw, mean over cycles" if wheel else "measured, mean over cycles",
             "fitted, through the wheel" if wheel else "fitted")  # fmt: skip
    return through_wheel(panel, view, place, texts)


def _residuals(panel: Axes, view: View, place: int) -> Entries:
    """Draw residuals over the angle, and the range of 95 % of noise."""
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
        # Numbers on dark cells are white.
        panel.text(column, row, text, ha="center", va="center", size=7.0,
                   color="white" if abs(value) > 0.55 else "black")  # fmt: skip
    panel.set_xticks(range(len(names)), names, rotation=35, ha="right", rotation_mode="anchor")
    panel.set_yticks(range(len(names)), names)
    panel.grid(False)
    figure.colorbar(shown, ax=panel, label="Correlation")
    condition = float(view.data.attrs["condition_number"])
    return finish(
        figure, "Correlations of the fitted values", [f"condition number {condition:.3g}"], None,
        "", view.caption,
    )  # fmt: skip
