"""Missed cycles and weak cylinders as a text."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from sweeps.base.errors import one_line
from sweeps.view.texts.tables import aligned

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["deviations_text"]

MOST_LISTED = 20
"""Missed cycles that are named for each cylinder."""


def deviations_text(found: xr.Dataset) -> str:
    """For each recording and cylinder: lasting deviation, threshold, missed cycles.

    Parameters
    ----------
    found : Dataset
        As `sweeps.cylinder_deviations` returns it.

    Returns
    -------
    str
        Lines without a final line feed.
    """
    lines: list[str] = []
    for place in range(found.sizes["recording"]):
        here = found.isel(recording=place)
        lines.append(
            f"{one_line(here['file'].values, 60)}: {int(here['recorded_cycles'])} cycles; a "
            f"misfire lacks {float(here['imep_of_combustion']):.2f} bar; scatter of normal cycles "
            f"{float(here['imep_dispersion']):.2f} bar; tooth passage errors "
            f"{100.0 * float(here['tooth_passage']):.3f} % of a pitch"
        )
        rows = [["cylinder", "mean, bar", "weak below", "misfire below", "found", "misfires"]]
        for number in range(here.sizes["cylinder"]):
            rows.append(_row(here.isel(cylinder=number)))
        lines += aligned(rows, left=[len(rows[0]) - 1])
    rate = float(found.attrs["false_alarms"])
    lines.append(
        f"thresholds for {rate:g} false alarms in a cycle of the engine; wheel "
        f"{found.attrs['wheel']}, its gap from {found.attrs['gap_angle_from']}"
    )
    lines += str(found.attrs.get("remarks", "")).splitlines()
    return "\n".join(lines)


def _row(one: xr.Dataset) -> list[str]:
    """A cylinder of a recording."""
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
