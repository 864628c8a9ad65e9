"""The nominal design of an archive: the one that changes are counted from."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from sweeps.base.dimensions import DESIGN, LABELS
from sweeps.base.errors import SceneError
from sweeps.decide.explore.attributes import members_of

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["NOMINAL", "nominal_places"]

NOMINAL = "nominal"


def nominal_places(archive: xr.Dataset, dims: list[str]) -> dict[str, int]:
    """Find the nominal design: the one that is named so, and the engine's own values of axes.

    Parameters
    ----------
    archive : Dataset
        An archive, or a part of it.
    dims : list of str
        Its axes of designs.

    Returns
    -------
    dict of int
        The place along each of the axes.

    Raises
    ------
    SceneError
        Where no design is named so, and where an axis does not have the engine's own value.
    """
    own = members_of(archive, "engine_values")
    places = {}
    for dim in dims:
        if archive.sizes[dim] == 1:
            places[dim] = 0
        elif dim == DESIGN:
            names = [
                list(map(str, archive[label].values)).index(NOMINAL)
                for label in LABELS
                if label in archive.coords and NOMINAL in archive[label].values
            ]
            if not names:
                raise SceneError("relative to nominal: no design is named 'nominal'")
            places[dim] = names[0]
        else:
            places[dim] = _own_place(archive, dim, own.get(dim))
    return places


def _own_place(archive: xr.Dataset, dim: str, value: float | None) -> int:
    """Place of the engine's own value on an axis."""
    if value is None:
        raise SceneError(
            f"relative to nominal: {dim}: the archive has no value of the engine for it; select "
            "the design by values of its axes instead"
        )
    found = np.flatnonzero(np.isclose(archive[dim].values.astype(float), value, rtol=1e-9))
    if not found.size:
        raise SceneError(
            f"relative to nominal: {dim} = {value:g}, the engine's own value, is not on the axis; "
            "select the design by values of its axes instead"
        )
    return int(found[0])
