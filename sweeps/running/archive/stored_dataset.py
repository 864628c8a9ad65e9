"""An archive as commands read it that print some of it: a stand-in for xarray's dataset.

Importing xarray and pandas takes longer than all that `info` and `show` do. The classes here have
those names of xarray's that describing an archive and making a table of it need, so that functions
which use no others take both. In Python, archives are xarray's datasets (`sweeps.open`).
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import numpy as np
import numpy.typing as npt

from sweeps.base.netcdf.netcdf_files import damaged_values, opened_archive

if TYPE_CHECKING:
    import xarray as xr

Places = int | range | npt.NDArray[np.int64]
"""Places along a dimension: one of them, which takes the dimension away, or several."""


@dataclass(frozen=True, eq=False)
class StoredVariable:
    """A variable, whose values are read when they are used."""

    dtype: np.dtype[Any]  # Type of the stored values
    # Attributes of the variable, and how it is stored.
    attrs: dict[str, Any]
    encoding: dict[str, Any]
    _data: Any
    _places: dict[str, Places]  # Places along each dimension of the stored data

    @property
    def dims(self) -> tuple[str, ...]:
        """Dimensions of the variable."""
        return tuple(d for d, places in self._places.items() if not isinstance(places, int))

    @property
    def shape(self) -> tuple[int, ...]:
        """Lengths along them."""
        return tuple(len(p) for p in self._places.values() if not isinstance(p, int))

    @property
    def sizes(self) -> dict[str, int]:
        """Lengths by the names of the dimensions."""
        return dict(zip(self.dims, self.shape, strict=True))

    @property
    def ndim(self) -> int:
        """Number of dimensions."""
        return len(self.shape)

    @property
    def size(self) -> int:
        """Number of values."""
        return math.prod(self.shape)

    @property
    def nbytes(self) -> int:
        """Bytes of the values."""
        return self.size * self.dtype.itemsize

    @property
    def values(self) -> npt.NDArray[Any]:
        """The values, read now."""
        key = tuple(_key(places) for places in self._places.values())
        values = self._data[key if key else ...]
        if np.ma.isMaskedArray(values):
            values = np.ma.filled(values.astype(self.dtype), np.nan)
        return np.asarray(values, self.dtype).reshape(self.shape)

    def isel(self, places: Mapping[Any, Any]) -> StoredVariable:
        """Return what is at some places along some dimensions, without reading it."""
        taken = {
            d: _taken(all_of_it, places[d])
            for d, all_of_it in self._places.items()
            if d in places and not isinstance(all_of_it, int)
        }
        return replace(self, _places=self._places | taken)


def _taken(places: range | npt.NDArray[np.int64], which: Any) -> Places:
    """Some of the places along a dimension: one, a slice or a list of them."""
    if isinstance(which, slice):
        return places[which]
    if np.ndim(which) == 0:
        return int(places[which])
    return np.asarray(places, dtype=np.int64)[which]


def _key(places: Places) -> Any:
    """Places as netCDF4 takes them: a range as a slice, which is read far more quickly."""
    if not isinstance(places, range):
        return places
    forwards = places.step > 0
    return slice(places.start, places.stop, places.step) if forwards else np.array(places)


class StoredDataset:
    """The variables of an archive, some of them coordinates.

    Attributes
    ----------
    variables : dict
        All of them, in the order of the file.
    attrs : dict
        Attributes of the archive.
    """

    def __init__(
        self, variables: dict[str, StoredVariable], named: frozenset[str], attrs: dict[str, Any]
    ) -> None:
        self.variables, self.attrs, self._named = variables, attrs, named

    @cached_property
    def sizes(self) -> dict[str, int]:
        """Lengths of the dimensions."""
        return {d: n for v in self.variables.values() for d, n in v.sizes.items()}

    @property
    def dims(self) -> tuple[str, ...]:
        """The dimensions."""
        return tuple(self.sizes)

    @property
    def coords(self) -> dict[str, StoredVariable]:
        """Values along dimensions, and what else is none of the results."""
        return {n: v for n, v in self.variables.items() if n in self._named}

    @property
    def data_vars(self) -> dict[str, StoredVariable]:
        """The results."""
        return {n: v for n, v in self.variables.items() if n not in self._named}

    def __contains__(self, name: object) -> bool:
        return name in self.variables

    def __getitem__(self, name: str) -> StoredVariable:
        return self.variables[name]

    def isel(self, places: Mapping[Any, Any]) -> StoredDataset:
        """Return what is at some places along some dimensions, without reading it."""
        taken = {name: variable.isel(places) for name, variable in self.variables.items()}
        return StoredDataset(taken, self._named, self.attrs)


@contextmanager
def stored_dataset(path: Path, *, own: bool = False) -> Iterator[xr.Dataset]:
    """Open an archive to describe it or to show numbers of it; variables are read when used.

    `own` says that this process has just written it. Type checkers see a dataset of xarray; in fact
    it is a `StoredDataset`. Damaged values are refused when they are used.
    """
    with opened_archive(path, own=own) as file:
        with damaged_values(path):
            dataset = _dataset_of(file, str(path))
        yield cast("xr.Dataset", dataset)


def _dataset_of(file: Any, path: str) -> StoredDataset:
    """All variables of a file of netCDF4, with no values read yet."""
    attributes = {name: file.getncattr(name) for name in file.ncattrs()}
    named = set(str(attributes.pop("coordinates", "")).split())
    variables = {}
    for name, variable in file.variables.items():
        attrs = {key: variable.getncattr(key) for key in variable.ncattrs()}
        named |= {name} if variable.dimensions == (name,) else set()
        named.update(str(attrs.pop("coordinates", "")).split())
        variables[name] = _variable_of(variable, attrs, path)
    return StoredDataset(variables, frozenset(named), attributes)


def _variable_of(variable: Any, attrs: dict[str, Any], path: str) -> StoredVariable:
    """One variable; values that other programs have packed will be read unpacked."""
    # With these attributes, stored values stand for other or missing numbers. `run` writes the last
    # attribute alone, which is NaN.
    packed = {
        key: attrs.pop(key)
        for key in ("scale_factor", "add_offset", "missing_value", "_FillValue")
        if key in attrs
    }
    dims, dtype = variable.dimensions, variable.dtype
    letters = dtype == "S1" and bool(dims)
    if letters:  # Letters lie along the last dimension, as in netCDF-3
        attrs.pop("_Encoding", "")
        dims = dims[:-1]
    if letters or dtype is str:
        dtype = np.dtype(object)
    elif attrs.pop("dtype", "") == "bool":
        dtype = np.dtype(bool)
    elif not all(np.isnan(value).all() for value in packed.values()):
        variable.set_auto_maskandscale(True)
        dtype = dtype if dtype.kind == "f" else np.dtype(float)
    chunks = variable.chunking()
    encoding = dict(variable.filters() or {})
    encoding["chunksizes"] = tuple(chunks) if isinstance(chunks, list) else None
    places: dict[str, Places] = {
        d: range(n) for d, n in zip(dims, variable.shape[: len(dims)], strict=True)
    }
    return StoredVariable(dtype, attrs, encoding, _Values(variable, path, letters), places)


@dataclass(frozen=True, eq=False)
class _Values:
    """Values of a variable of a file; damaged ones raise an error of one line."""

    variable: Any
    path: str
    letters: bool

    def __getitem__(self, key: Any) -> Any:
        with damaged_values(self.path, self.variable.name):
            if not self.letters:
                return self.variable[key]
            from netCDF4 import chartostring

            self.variable.set_auto_chartostring(False)
            return chartostring(self.variable[key], encoding="utf-8")
