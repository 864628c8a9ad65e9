"""Results of an identification as text for people."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from sweeps.base.errors import counted

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["fit_text"]

FEW = 0.05
"""Likelihood of noise below which the model is said to lack something."""

CLOSE = 0.9
"""Size of correlations that are told."""


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
    # Of so many draws none was larger: the likelihood is this or less.
    at_most = "at most " if likely <= float(fit.attrs.get("least_likelihood", 0.0)) else ""
    lines.append(
        f"condition number {fit.attrs['condition_number']:.3g}; residuals: reduced chi square "
        f"{fit.attrs['reduced_chi_square']:.3g}, likelihood of noise {at_most}{likely:.3g}"
    )
    if likely < FEW:
        lines.append(
            "the residuals are larger than the scatter of the cycles explains: something is "
            "missing in the model, and the intervals do not include it"
        )
    for place in range(fit.sizes["recording"]):
        lines.append("  " + _recording(fit.isel(recording=place)))
    lines += str(fit.attrs.get("remarks", "")).splitlines()
    return "\n".join(lines)


def _correlations(fit: xr.Dataset) -> list[str]:
    """Pairs of values that nearly move together."""
    names, size = fit["parameter"].values, np.asarray(fit["correlation"].values)
    return [
        f"  {names[i]} and {names[j]} are correlated by {size[i, j]:.3f}"
        for i, j in zip(*np.nonzero(np.triu(np.abs(size) > CLOSE, 1)), strict=True)
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
            f"{float(one['delta_predicted_deviation']):.4f} ({predicted / measured - 1:+.1%})"
        )
    return text
