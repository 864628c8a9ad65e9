"""Archives in units that people read, for figures: the same Dataset, converted when it is read."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr
from xarray.backends import BackendArray
from xarray.core import indexing

from sweeps.base.dimensions import OWN_UNITS
from sweeps.view.texts.readable_units import asked_of_archive, factor, readable_of_archive


def readable_dataset(dataset: xr.Dataset, units: str | None = None) -> xr.Dataset:
    """Return an archive in the units of tables: kW, rpm, kN, kJ, mm and l.

    `units` are those of single quantities, ``"power=hp,speed=rad/s"``; ``"archive"`` keeps all.
    SceneError refuses names that are no quantities, and units that do not fit.
    """
    variables = {n: v for n, v in dataset.variables.items() if n != "crank_angle"}
    return _in_chosen_units(dataset, readable_of_archive(units, variables))


def in_units(dataset: xr.Dataset, units: str | None) -> xr.Dataset:
    """Return an archive in the units that are asked for, as `readable_dataset` takes them."""
    return _in_chosen_units(dataset, asked_of_archive(units, dataset.variables))


def _in_chosen_units(dataset: xr.Dataset, chosen: Mapping[str, str]) -> xr.Dataset:
    """Archive with some variables in other units."""
    new = {
        name: _converted(dataset[name], wanted)
        for name, wanted in chosen.items() if wanted != str(dataset[name].attrs.get("units", ""))
    }  # fmt: skip
    coordinates = {name: one for name, one in new.items() if name in dataset.coords}
    return dataset.assign(
        {name: one for name, one in new.items() if name not in coordinates}
    ).assign_coords(coordinates)


def _converted(array: xr.DataArray, wanted: str) -> xr.Variable:
    """The same numbers in another unit; read and multiplied on demand."""
    attributes = dict(array.attrs)
    times = factor(str(attributes.get("units", "")) or "1", wanted)
    attributes[OWN_UNITS] = attributes.get("units", "")
    attributes["units"] = wanted
    if wanted == "rpm":
        symbol = str(attributes.get("symbol", ""))
        # The symbol of a speed in revolutions per minute is n, that of an angular speed omega.
        attributes["symbol"] = symbol.replace(r"\omega", "n")
    data = indexing.LazilyIndexedArray(_Scaled(array.variable, times))
    return xr.Variable(array.dims, data, attributes)


class _Scaled(BackendArray):
    """An array of a file that is multiplied as it is read."""

    def __init__(self, variable: xr.Variable, times: float) -> None:
        self.variable, self.times = variable, times
        self.shape, self.dtype = variable.shape, np.dtype(float)

    def __getitem__(self, key: indexing.ExplicitIndexer) -> Any:
        return indexing.explicit_indexing_adapter(
            key, self.shape, indexing.IndexingSupport.OUTER, self._read
        )

    def _read(self, key: tuple[Any, ...]) -> Any:
        return np.asarray(self.variable[key].values, dtype=float) * self.times
