"""A comparison of measured and computed speed as a text."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from sweeps.base.errors import one_line
from sweeps.view.texts.tables import aligned

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["measured_text"]

COLUMNS = (
    ("cycles", "recorded_cycles", "", "{:.0f}"),
    ("delta raw", "delta_measured_raw", "delta_measured_raw_uncertainty", "{:.4f}"),
    ("through wheel", "delta_through_wheel", "", "{:.4f}"),
    ("delta", "delta_measured", "delta_measured_uncertainty", "{:.4f}"),
    ("computed", "delta", "", "{:.4f}"),
    ("correlation raw", "correlation_raw", "", "{:.4f}"),
    ("correlation", "correlation", "", "{:.4f}"),
    ("rms %", "rms_difference_raw", "", "{:.3f}"),
)


def measured_text(found: xr.Dataset) -> str:
    """Table of the recordings, and what was seen in them.

    Parameters
    ----------
    found : Dataset
        As `sweeps.measured` returns it.

    Returns
    -------
    str
        Lines without a final line feed.
    """
    rows = [["recording", *(title for title, *_ in COLUMNS)]]
    for place in range(found.sizes["recording"]):
        row = [one_line(found["file"].values[place], 40)]
        for title, name, uncertainty, form in COLUMNS:
            value = float(found[name].values[place]) * (100.0 if title == "rms %" else 1.0)
            text = form.format(value) if np.isfinite(value) else "-"
            unsure = float(found[uncertainty].values[place]) if uncertainty else np.nan
            row.append(text + (f" ± {unsure:.4f}" if np.isfinite(unsure) else ""))
        rows.append(row)
    lines = aligned(rows, left=[0])
    attributes = found.attrs
    if "wheel" in attributes:
        lines.append(
            f"wheel {attributes['wheel']}; tooth errors {attributes['tooth_errors']}; gap at "
            f"{float(attributes['gap_angle']):.2f} degrees, from {attributes['gap_angle_from']}"
        )
    lines += str(attributes.get("remarks", "")).splitlines()
    return "\n".join(lines)
