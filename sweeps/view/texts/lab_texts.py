"""Results of the laboratory as texts: measured speeds, trains, cylinders, fits, calibrations."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from engine_dyn.quantities.graph import PARAMETERS
from engine_dyn.units import RPM
from sweeps.base.errors import counted, one_line
from sweeps.scene.engine.modelled_diagrams import KINDS
from sweeps.view.texts.tables import aligned

if TYPE_CHECKING:
    import xarray as xr

    from sweeps.lab.speed.calibration_model import Calibration


def measured_text(comparison: xr.Dataset) -> str:
    """Table of the recordings of `sweeps.measured`, and what was seen in them."""
    columns = (
        ("cycles", "recorded_cycles", "", "{:.0f}"),
        ("delta raw", "delta_measured_raw", "delta_measured_raw_uncertainty", "{:.4f}"),
        ("through wheel", "delta_through_wheel", "", "{:.4f}"),
        ("delta", "delta_measured", "delta_measured_uncertainty", "{:.4f}"),
        ("computed", "delta", "", "{:.4f}"),
        ("correlation raw", "correlation_raw", "", "{:.4f}"),
        ("correlation", "correlation", "", "{:.4f}"),
        ("rms %", "rms_difference_raw", "", "{:.3f}"),
    )
    rows = [["recording", *(title for title, *_ in columns)]]
    for place in range(comparison.sizes["recording"]):
        row = [one_line(comparison["file"].values[place], 40)]
        for title, name, uncertainty, form in columns:
            value = float(comparison[name].values[place]) * (100.0 if title == "rms %" else 1.0)
            text = form.format(value) if np.isfinite(value) else "-"
            unsure = float(comparison[uncertainty].values[place]) if uncertainty else np.nan
            row.append(text + (f" ± {unsure:.4f}" if np.isfinite(unsure) else ""))
        rows.append(row)
    lines = aligned(rows, left=[0])
    if any("±" in cell for row in rows for cell in row):
        lines.append("±: standard error; 95 % are within about twice that")
    attributes = comparison.attrs
    if "wheel" in attributes:
        lines.append(
            f"wheel {attributes['wheel']}; tooth errors {attributes['tooth_errors']}; gap at "
            f"{float(attributes['gap_angle']):.2f} degrees, from {attributes['gap_angle_from']}"
        )
    lines += str(attributes.get("remarks", "")).splitlines()
    return "\n".join(lines)


MOST_ROWS = 40  # Largest number of cycles that are listed


def train_text(train: xr.Dataset) -> str:
    """Table of the cycles, the jump of the closed train, and what was assumed: `follow_cycles`."""
    columns = (
        ("imep bar", "imep", 1.0, "{:.3f}"),
        ("rpm", "omega_mean_followed", 1.0 / RPM, "{:.1f}"),
        ("measured", "omega_mean_measured", 1.0 / RPM, "{:.1f}"),
        ("closed", "omega_mean_closed", 1.0 / RPM, "{:.1f}"),
        ("delta", "delta_followed", 1.0, "{:.5f}"),
        ("closed", "delta_closed", 1.0, "{:.5f}"),
        ("repeated", "delta_repeated", 1.0, "{:.5f}"),
    )
    shown = [column for column in columns if column[1] in train]
    rows = [["cycle", *(title for title, *_ in shown)]]
    numbers = train["recorded_cycle"].values
    for place, number in enumerate(numbers[:MOST_ROWS]):
        row = [str(number)]
        for _, name, factor, form in shown:
            value = float(train[name].values[place]) * factor
            row.append(form.format(value) if np.isfinite(value) else "-")
        rows.append(row)
    lines = aligned(rows)
    if len(numbers) > MOST_ROWS:
        lines.append(f"and {len(numbers) - MOST_ROWS} more cycles")
    start, jump = float(train["start_speed_followed"]), float(train["jump"])
    unit = train["load_coefficient_followed"].attrs.get("units", "")
    lines += [
        f"initial speed {start / RPM:.2f} rpm; if the train is repeated, it starts "
        f"{jump / RPM:+.3f} rpm away from it ({100.0 * jump / start:+.3f} %)",
        f"a change of the first energy is {100.0 * float(train['memory_of_a_cycle']):.3g} % of it "
        f"after a cycle, {100.0 * float(train['memory']):.3g} % at the end",
        f"load coefficient {float(train['load_coefficient_followed']):.6g} {unit}".rstrip()
        + f", train repeated {float(train['load_coefficient_closed']):.6g}",
    ]
    attributes = train.attrs
    lines += [str(attributes["first_speed_and_load_from"]),
              str(attributes["pressures_of_cylinders"])]  # fmt: skip
    if "rms_difference" in attributes:
        next_best = attributes.get("rms_difference_of_cycles_next")
        next_text = "" if next_best is None else f", next best alignment {100.0 * next_best:.3g} %"
        lines.append(
            "rms difference between measured and computed speed "
            f"{100.0 * float(attributes['rms_difference']):.3g} %; of the part that does not "
            f"repeat every cycle {100.0 * float(attributes['rms_difference_of_cycles']):.3g} "
            f"%{next_text}; the speed recording begins in recorded cycle "
            f"{attributes['first_cycle_of_speed']}"
        )
    lines += str(attributes.get("remarks", "")).splitlines()
    return "\n".join(lines)


MOST_LISTED = 20  # Largest number of missed cycles that are named for each cylinder


def deviations_text(deviations: xr.Dataset) -> str:
    """For each recording and cylinder: lasting deviation, threshold, missed cycles."""
    lines: list[str] = []
    for place in range(deviations.sizes["recording"]):
        here = deviations.isel(recording=place)
        lines.append(
            f"{one_line(here['file'].values, 60)}: {int(here['recorded_cycles'])} cycles; a "
            f"misfire lacks {float(here['imep_of_combustion']):.2f} bar; scatter of normal cycles "
            f"{float(here['imep_dispersion']):.2f} bar; tooth passage errors "
            f"{100.0 * float(here['tooth_passage']):.3f} % of a pitch"
        )
        rows = [["cylinder", "mean, bar", "weak below", "misfire below", "found", "misfires"]]
        for number in range(here.sizes["cylinder"]):
            rows.append(_row_of_cylinder(here.isel(cylinder=number)))
        lines += aligned(rows, left=[len(rows[0]) - 1])
    rate = float(deviations.attrs["false_alarms"])
    lines.append(
        f"thresholds for {rate:g} false alarms in a cycle of the engine; wheel "
        f"{deviations.attrs['wheel']}, its gap from {deviations.attrs['gap_angle_from']}"
    )
    lines += str(deviations.attrs.get("remarks", "")).splitlines()
    return "\n".join(lines)


def _row_of_cylinder(one: xr.Dataset) -> list[str]:
    """Row of a table on one cylinder of a recording."""
    called = "dead" if float(one["dead"]) else "weak" if float(one["weak"]) else ""
    places = np.flatnonzero(one["missed"].values > 0.0) + 1
    listed = ", ".join(map(str, places[:MOST_LISTED])) or "none"
    if places.size > MOST_LISTED:
        listed += f" and {places.size - MOST_LISTED} more"
    mean = float(one["imep_deviation_lasting"])
    return [
        str(int(one["cylinder"])),
        f"{mean:+.2f} ± {float(one['imep_deviation_lasting_std']):.2f}"
        + (f" {called}" if called else "     "),
        f"{float(one['weak_threshold']):.2f}",
        f"{float(one['missed_threshold']):.2f}",
        f"{100.0 * float(one['missed_found']):.2f} %",
        listed,
    ]


def fit_text(fit: xr.Dataset) -> str:
    """Lines on fitted values, on what the data tell, on predictions, and remarks on recordings."""
    lines = [f"{fit.attrs['title']}: fit to {counted(fit.sizes['recording'], 'recording')}"]
    width = max(len(str(name)) for name in fit["parameter"].values)
    for name, unit, value, low, high, at_bound in zip(
        fit["parameter"].values, fit["unit"].values, fit["value"].values,
        fit["value_low"].values, fit["value_high"].values, fit["at_bound"].values, strict=True,
    ):  # fmt: skip
        unit = "" if unit == "1" else f" {unit}"
        bound = ", at its bound" if at_bound else ""
        lines.append(
            f"  {name:<{width}}  {value:.5g}{unit}  (95 %: {low:.5g} to {high:.5g}){bound}"
        )
    lines += _correlations(fit)
    likely = float(fit.attrs["likelihood_of_noise"])
    # Where no random draw of noise has residuals as large as those of the fit, the likelihood of
    # noise is only known to be this or less.
    at_most = "at most " if likely <= float(fit.attrs.get("least_likelihood", 0.0)) else ""
    lines.append(
        f"condition number {fit.attrs['condition_number']:.3g}; residuals: reduced chi square "
        f"{fit.attrs['reduced_chi_square']:.3g}, likelihood of noise {at_most}{likely:.3g}"
    )
    if likely < 0.05:
        lines.append(
            "the residuals are larger than the scatter of the cycles explains: something is "
            "missing in the model, and the intervals do not include it"
        )
    for place in range(fit.sizes["recording"]):
        lines.append("  " + _recording(fit.isel(recording=place)))
    lines.append("+-: standard error; 95 % are within about twice that")
    lines += str(fit.attrs.get("remarks", "")).splitlines()
    return "\n".join(lines)


def _correlations(fit: xr.Dataset) -> list[str]:
    """Lines on pairs of values that nearly move together."""
    names, size = fit["parameter"].values, np.asarray(fit["correlation"].values)
    return [
        f"  {names[i]} and {names[j]} are correlated by {size[i, j]:.3f}"
        for i, j in zip(*np.nonzero(np.triu(np.abs(size) > 0.9, 1)), strict=True)
    ]


def _recording(one: xr.Dataset) -> str:
    measured, scatter = (
        float(one["delta_measured_raw"]),
        float(one["delta_measured_raw_uncertainty"]),
    )
    text = (
        f"{one['file'].item()}: raw delta measured {measured:.4f} +- {scatter:.4f}, fitted "
        f"{float(one['delta_through_wheel']):.4f}"
    )
    if "delta_predicted" in one:
        predicted = float(one["delta_predicted"])
        text += (
            f", predicted from the others {predicted:.4f} +- "
            f"{float(one['delta_predicted_deviation']):.4f} "
            f"({100.0 * (predicted / measured - 1.0):+.1f} %)"
        )
    return text


def calibration_text(made: Calibration) -> str:
    """Describe a calibration in lines without a final line feed."""
    from sweeps.lab.speed.calibration_model import heading

    lines = heading(made)
    if made.sheet.diagrams:
        lines.append(f"{counted(made.sheet.diagrams, 'diagram')} of the file replaced.")
    if made.published.places["power"].startswith(f"{made.sheet.name}: "):
        lines.append(
            f"The power, {made.published.power:g} kW, is from the file ([data_sheet]); --power "
            "overrides it."
        )
    was = made.sheet.values.get("speed")
    if was is not None and was != made.published.speed:
        lines.append(
            f"[values] speed: {was:g} rpm in the file; {made.published.speed:g} rpm is written."
        )
    lines += [
        "",
        f"assumed, {counted(len(made.assumed), 'value')}; replace them where you know better:",
    ]
    rated = made.rated.table
    first = made.points[0].table
    for key, reason in made.assumed.items():
        if key in PARAMETERS and key in made.values:
            unit = PARAMETERS[key].unit
            value = f" = {made.values[key]:g}{'' if unit in ('', '1') else f' {unit}'}"
        elif key == "firing_order" and made.order is not None:
            value = " = " + "-".join(map(str, made.order))
        elif key == "kind":
            value = f" = {made.published.kind}"
        elif key in rated:
            value = f" = {rated[key]:g}{KINDS['first_law'].fields[key].words}"
            if first[key] != rated[key]:
                value += f" ({first[key]:g} at {made.points[0].load:g} percent)"
        else:
            value = ""
        lines.append(f"  {key}{value}: {reason}")
    return "\n".join(lines)
