"""A train of recorded cycles as a text."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from engine_dyn.units import RPM
from sweeps.view.texts.tables import aligned

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["train_text"]

MOST_ROWS = 40
"""Cycles that are listed; of more the first ones."""

COLUMNS = (
    ("imep bar", "imep", 1.0, "{:.3f}"),
    ("rpm", "omega_mean_followed", 1.0 / RPM, "{:.1f}"),
    ("measured", "omega_mean_measured", 1.0 / RPM, "{:.1f}"),
    ("closed", "omega_mean_closed", 1.0 / RPM, "{:.1f}"),
    ("delta", "delta_followed", 1.0, "{:.5f}"),
    ("closed", "delta_closed", 1.0, "{:.5f}"),
    ("repeated", "delta_repeated", 1.0, "{:.5f}"),
)


def train_text(found: xr.Dataset) -> str:
    """Table of the cycles, the jump of the closed train, and what was assumed.

    Parameters
    ----------
    found : Dataset
        As `sweeps.follow_cycles` returns it.

    Returns
    -------
    str
        Lines without a final line feed.
    """
    shown = [column for column in COLUMNS if column[1] in found]
    rows = [["cycle", *(title for title, *_ in shown)]]
    numbers = found["recorded_cycle"].values
    for place, number in enumerate(numbers[:MOST_ROWS]):
        row = [str(number)]
        for _, name, factor, form in shown:
            value = float(found[name].values[place]) * factor
            row.append(form.format(value) if np.isfinite(value) else "-")
        rows.append(row)
    lines = aligned(rows)
    if len(numbers) > MOST_ROWS:
        lines.append(f"and {len(numbers) - MOST_ROWS} more cycles")
    start, jump = float(found["start_speed_followed"]), float(found["jump"])
    unit = found["load_coefficient_followed"].attrs.get("units", "")
    lines += [
        f"initial speed {start / RPM:.2f} rpm; if the train is repeated, it starts "
        f"{jump / RPM:+.3f} rpm away from it ({100.0 * jump / start:+.3f} %)",
        f"a change of the first energy is {100.0 * float(found['memory_of_a_cycle']):.3g} % of it "
        f"after a cycle, {100.0 * float(found['memory']):.3g} % at the end",
        f"load coefficient {float(found['load_coefficient_followed']):.6g} {unit}".rstrip()
        + f", train repeated {float(found['load_coefficient_closed']):.6g}",
    ]
    attributes = found.attrs
    lines += [str(attributes["first_speed_and_load_from"]),
              str(attributes["pressures_of_cylinders"])]  # fmt: skip
    if "rms_difference" in attributes:
        next_best = attributes.get("rms_difference_of_cycles_next")
        beside = "" if next_best is None else f", next best alignment {100.0 * next_best:.3g} %"
        lines.append(
            "rms difference between measured and computed speed "
            f"{100.0 * float(attributes['rms_difference']):.3g} %; of the part that does not "
            f"repeat every cycle {100.0 * float(attributes['rms_difference_of_cycles']):.3g} "
            f"%{beside}; the speed recording begins in recorded cycle "
            f"{attributes['first_cycle_of_speed']}"
        )
    lines += str(attributes.get("remarks", "")).splitlines()
    return "\n".join(lines)
