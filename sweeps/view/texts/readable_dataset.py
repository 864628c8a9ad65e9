"""Archives in units that people read, for figures: the same Dataset, converted when it is read."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr
from xarray.backends import BackendArray
from xarray.core import indexing

from sweeps.view.texts.readable_units import READABLE, asked_of_archive, factor


def readable_dataset(dataset: xr.Dataset, units: str | None = None) -> xr.Dataset:
    """Return an archive in readable units: kW, rpm, kN, kJ, mm and l where they read better.

    A unit changes in the whole archive or nowhere, so that what is drawn together stays so. `units`
    are those of single quantities, ``"power=hp,speed=rad/s"``; ``"archive"`` keeps all. SceneError
    refuses names that are no quantities, and units that do not fit.
    """
    variables = {n: v for n, v in dataset.variables.items() if n != "crank_angle"}
    known = {str(name): str(v.attrs.get("units", "")) for name, v in variables.items()}
    chosen: dict[str, str] = {}
    for unit in (set(known.values()) & set(READABLE)) if units != "archive" else ():
        names = [name for name in known if known[name] == unit]
        if _reads_better(dataset, names, unit):
            chosen |= dict.fromkeys(names, READABLE[unit])
    return _in_chosen_units(dataset, chosen | asked_of_archive(units, variables))


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


def _reads_better(dataset: xr.Dataset, names: list[str], unit: str) -> bool:
    """Whether the largest value of a unit has a size that fits the readable unit."""
    wanted = READABLE[unit]
    if wanted == "rpm":
        return True
    most = 0.0
    for name in names:
        array = dataset[name].variable
        if array.dtype.kind not in "iuf" or not array.size:
            continue
        # About 20 000 values, evenly taken, show how large all values are.
        step = max(1, int((array.size / 20_000) ** (1.0 / max(array.ndim, 1))))
        some = np.abs(np.asarray(array[(slice(None, None, step),) * array.ndim].values, float))
        most = max(most, float(some.max(where=np.isfinite(some), initial=0.0)))
    if wanted == "mm":
        return 0.0 < most < 10.0
    return most * factor(unit, wanted) >= 1.0


def _converted(array: xr.DataArray, wanted: str) -> xr.Variable:
    """The same numbers in another unit; read and multiplied on demand."""
    attributes = dict(array.attrs)
    times = factor(str(attributes.get("units", "")) or "1", wanted)
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
