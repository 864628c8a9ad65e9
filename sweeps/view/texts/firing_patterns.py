"""Ranked firing patterns as a table for people."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

import numpy as np

from sweeps.base.dimensions import FIRING_PATTERN, OF_PATTERNS
from sweeps.base.errors import counted, one_line
from sweeps.decide.explore.rows import Rows
from sweeps.view.texts.tables import rows_text

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["patterns_text"]


def patterns_text(
    found: xr.Dataset, limit: int = 20, units: str | None = None, width: int | None = None
) -> str:
    """Describe what `sweeps.firing_patterns` returned: a row for each pattern, the best first.

    Parameters
    ----------
    found : Dataset
        The patterns.
    limit : int
        Most rows.
    units, width
        As of `rows_text`.

    Raises
    ------
    SceneError
        For units that do not fit.
    """
    about = json.loads(found.attrs[OF_PATTERNS])
    best = found.isel({FIRING_PATTERN: slice(limit)})
    name = str(about["by"]) + (f" {about['order']:g}" if about["order"] is not None else "")
    table = {
        "firings": best["firings"].values.astype(object),
        name: best["ranked_by"].values,
    }
    attributes = found["ranked_by"].attrs
    rows = Rows(
        table=table, units={name: str(attributes.get("units", "1"))},
        texts={"firings": "", name: str(attributes.get("long_name", ""))}, given=("firings",),
        fixed={}, designs=found.sizes[FIRING_PATTERN], curves=(),
    )  # fmt: skip
    engine = one_line(str(found.attrs.get("engine_title", "")), 80)
    count = counted(found.sizes[FIRING_PATTERN], "firing pattern")
    lines = [f"{engine}: {count} of density {about['density']}", rows_text(rows, units, width)]
    others = sorted(str(d) for d in found[about["by"]].dims if d not in (FIRING_PATTERN, "order"))
    if others:
        lines.append(f"the largest value over {', '.join(others)} counts")
    factor = float(about["pressure_factor"])
    if not np.isclose(factor, 1.0):
        lines.append(
            f"cylinders that fire have {factor:.4g} times the combustion pressure, which keeps the "
            "mean torque"
        )
    return "\n".join(lines)
