"""Values of an archive as xarray reads them when they are used; damaged ones are told in one line.

Opening an archive reads none of its values, so damage there is met only later, by whoever uses
them.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import xarray as xr
from xarray.backends import NetCDF4DataStore
from xarray.backends.netCDF4_ import NetCDF4ArrayWrapper
from xarray.core.indexing import LazilyIndexedArray

from sweeps.base.netcdf.netcdf_files import damaged_values, netcdf_library


def dataset_from(path: str | Path) -> xr.Dataset:
    """Open a netCDF file with xarray and the lock of the library; errors are those of xarray.

    Its values raise `SceneError` where they cannot be read.
    """
    # The path is absolute, because the netCDF library takes some relative ones for addresses of
    # servers. No quantity is a time: nothing is decoded as one.
    store = _Store.open(os.path.abspath(path), lock=netcdf_library)
    try:
        return xr.open_dataset(store, decode_times=False, decode_timedelta=False)
    except BaseException:
        store.close()
        raise


class _Values(NetCDF4ArrayWrapper):
    """Values of one variable, with damage reported in one line."""

    def __getitem__(self, key: Any) -> Any:
        wrong_index: IndexError
        with damaged_values(self.datastore.ds.filepath(), self.variable_name):
            try:
                return super().__getitem__(key)
            except IndexError as error:  # A wrong index of the caller is no damage
                wrong_index = error
        raise wrong_index


class _Store(NetCDF4DataStore):
    """xarray's own way to a netCDF file, with values that report damage in one line."""

    def open_store_variable(self, name: str, var: Any) -> xr.Variable:
        variable = super().open_store_variable(name, var)
        values = LazilyIndexedArray(_Values(name, self))
        return xr.Variable(variable.dims, values, variable.attrs, variable.encoding)
