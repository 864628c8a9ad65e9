"""The kinds of figures that an archive gives, as a text."""

from __future__ import annotations

import xarray as xr

from sweeps.view.figures.drawing import kinds_of
from sweeps.view.figures.options import Options

__all__ = ["kinds_text"]


def kinds_text(dataset: xr.Dataset, options: Options | None = None) -> str:
    """List what `plot --only` can draw of an archive, and what the other kinds need.

    Parameters
    ----------
    dataset : xarray.Dataset
        An archive.
    options : Options, optional
        Slices and quantities that are chosen.
    """
    found = kinds_of(dataset, options)
    wide = max(len(kind.name) for kind, _ in found)
    given = [f"  {kind.name:{wide}}  {kind.shows}" for kind, names in found if names]
    absent = [f"  {kind.name:{wide}}  needs {kind.needs}" for kind, names in found if not names]
    lines = (
        ["figures available for this archive:", *given]
        if given
        else ["no figures available for this archive"]
    )
    return "\n".join([*lines, "", "not available for this archive:", *absent] if absent else lines)
