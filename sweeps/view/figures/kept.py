"""Designs that a reduced archive kept, as cases that figures name."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import xarray as xr

from sweeps.base.dimensions import DESIGN, RANK, REDUCTION
from sweeps.view.figures.views import View

__all__ = ["kept_as_cases", "told_kept"]


def kept_as_cases(data: xr.Dataset) -> xr.Dataset:
    """A reduced archive whose kept designs are named cases, the best of the first search first."""
    if REDUCTION not in data.attrs or DESIGN not in data.dims or RANK not in data:
        return data
    ranks = np.where(data[RANK].values > 0, data[RANK].values, np.iinfo(np.int32).max)
    data = data.isel({DESIGN: np.lexsort(ranks[::-1])})
    if "case" in data.coords:
        return data
    names = [f"design {number}" for number in data[DESIGN].values]
    return data.assign_coords(case=(DESIGN, np.array(names, dtype=object)))


def told_kept(view: View) -> View:
    """A view whose notes say how many designs were kept, of how many."""
    if REDUCTION not in view.data.attrs or DESIGN not in view.data.sizes:
        return view
    every = json.loads(view.data.attrs[REDUCTION])["designs"]
    text = f"{view.data.sizes[DESIGN]:,} designs kept of {every:,}"
    return replace(view, fixed={**view.fixed, DESIGN: text}, had=view.former_dims())
