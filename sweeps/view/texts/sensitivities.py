"""Sobol' indices as text for people."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

import numpy as np

from sweeps.base.dimensions import PARAMETER
from sweeps.base.errors import counted, one_line
from sweeps.view.texts.wording import Wording

if TYPE_CHECKING:
    import xarray as xr

MOST_POINTS = 10  # Largest number of points, of axes besides the sample, that are printed


def has_indices(archive: xr.Dataset) -> bool:
    """Whether an archive has the Sobol' indices of all parameters, from `sweeps.sensitivities`."""
    return "sensitivity_method" in archive.attrs and PARAMETER in archive.dims


def sensitivities_text(indices: xr.Dataset) -> str:
    """A table for each quantity, and for each point of the axes besides the sample."""
    methods = json.loads(indices.attrs["sensitivity_method"])
    lines = [one_line(str(indices.attrs["title"]), 200)]
    wording = Wording(indices)
    for quantity, method in methods.items():
        ending = "" if f"{quantity}_first" in indices else "_conditional"
        lines += ["", f"{quantity}: {method}"]
        if ending:
            lines.append(
                "more than 1 % of the designs failed; the indices refer only to designs with "
                "results"
            )
        names = [k for k in ("first", "total") if f"{quantity}_{k}{ending}" in indices]
        first = indices[f"{quantity}_first{ending}"]
        rest = [d for d in first.dims if d != PARAMETER]
        points = [*np.ndindex(*(first.sizes[d] for d in rest))]
        for point in points[:MOST_POINTS]:
            one = indices.isel(dict(zip(rest, point, strict=True)))
            at = [d for d, c in one.coords.items() if c.ndim == 0 and c.dtype.kind in "iuf"]
            where = ", ".join(f"{d} = {wording.both(str(d), one[d].values)}" for d in at)
            left = int(one[f"{quantity}_left_out"].values)
            lines += [f"at {where}"] if where else []
            lines += _table(one, quantity, names, ending)
            if left:
                lines.append(f"  left out: {counted(left, 'design')} without a number")
        if len(points) > MOST_POINTS:
            lines.append(
                f"  {len(points) - MOST_POINTS} more points of {', '.join(map(str, rest))}"
            )
    if any("+-" in line for line in lines):
        share = float(indices.attrs.get("confidence", 0.95))
        lines.append(f"+-: half width of the {100.0 * share:g} % interval")
    return "\n".join(lines)


def _table(one: xr.Dataset, quantity: str, names: list[str], ending: str) -> list[str]:
    """Rows of the parameters, the most important first."""
    values = {name: one[f"{quantity}_{name}{ending}"].values for name in names}
    keys = [str(key) for key in one[PARAMETER].values]
    wide = max(len("parameter"), *(len(key) for key in keys))
    lines = [f"  {'parameter':<{wide}}" + "".join(f"{name:>18}" for name in names)]
    for place in np.argsort(-values[names[-1]], kind="stable"):
        cells = []
        for name in names:
            half = f"{quantity}_{name}_confidence{ending}"
            text = f"{values[name][place]:.3f}"
            if half in one:
                text += f" +- {float(one[half].values[place]):.3f}"
            cells.append(f"{text:>18}")
        lines.append(f"  {keys[place]:<{wide}}" + "".join(cells))
    sums = "".join(f"{values[name].sum():>18.3f}" for name in names)
    return [*lines, f"  {'sum':<{wide}}{sums}"]
