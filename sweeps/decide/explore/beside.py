"""Two archives beside each other in one dataset, at the values of the axes that both have."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from sweeps.base.dimensions import COMPARED
from sweeps.base.errors import SceneError
from sweeps.decide.explore.attributes import members_of
from sweeps.decide.explore.compare import common_part, unlike

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["beside"]


def beside(
    first: xr.Dataset, second: xr.Dataset, labels: Sequence[str] = ("first", "second")
) -> xr.Dataset:
    """Put the quantities that two archives have in common beside each other.

    Parameters
    ----------
    first, second : Dataset
        Archives as `sweeps.open` or `sweeps.run` returns them. Nothing is read yet.
    labels : sequence of str
        What the two are called in legends.

    Returns
    -------
    Dataset
        The first archive's quantities by their names, the second's with `_compared` at the end of
        the name; attribute `compared` holds the labels as JSON. Attributes of the first that the
        second does not share are left out. Quantities over other axes or in another unit are too.
        An axis that only one of them has is cut at the value that the other has, if it is there.

    Raises
    ------
    SceneError
        Where no quantity is in both at some value of all its axes.

    Examples
    --------
    >>> both = beside(sweeps.open("a.nc"), sweeps.open("b.nc"), ("a", "b"))  # doctest: +SKIP
    >>> both.delta, both.delta_compared  # doctest: +SKIP
    """
    _, one, two = common_part(_at_the_value_of(first, second), _at_the_value_of(second, first))
    names = [
        str(name)
        for name in one.data_vars
        if name in two.data_vars and name != "status" and not unlike(one[name], two[name])
    ]
    if not names:
        raise SceneError(
            "nothing to draw: the archives have no common quantity at the same axis values"
        )
    kept = one[names]
    kept.attrs = {k: v for k, v in first.attrs.items() if second.attrs.get(k) == v}
    kept.attrs["compared"] = json.dumps(list(labels))
    dims = {name: kept[name].dims for name in names}
    return kept.assign({n + COMPARED: two[n].variable.transpose(*dims[n]) for n in names})


def _at_the_value_of(one: xr.Dataset, other: xr.Dataset) -> xr.Dataset:
    """Cut axes that the other archive does not have where they have its value."""
    given = members_of(other, "parameters")
    places = {}
    for dim in map(str, one.dims):
        if dim in other.dims or dim not in given or dim not in one.coords:
            continue
        near = np.flatnonzero(np.isclose(one[dim].values, given[dim], rtol=1e-9, atol=0.0))
        if near.size:
            places[dim] = int(near[0])
    return one.isel(places)
