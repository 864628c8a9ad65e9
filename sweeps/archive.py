"""Archives: netCDF-4 files that are whole or not there."""

from __future__ import annotations

import os
import tempfile
from pathlib import Path

import xarray as xr

__all__ = ["open_archive", "write"]


def write(dataset: xr.Dataset, path: str | Path, *, overwrite: bool = False) -> None:
    """Write a dataset as a netCDF-4 archive.

    The file is written under a temporary name beside the target, synced and renamed: whatever
    happens, the name holds the old file, none, or the complete new one.

    Raises
    ------
    FileExistsError
        If the file exists and `overwrite` is not set.
    OSError
        If it cannot be written.
    """
    path = Path(path)
    if path.exists() and not overwrite:
        raise FileExistsError(f"{path}: exists")
    path.parent.mkdir(parents=True, exist_ok=True)
    handle, name = tempfile.mkstemp(prefix=f".{path.name[:100]}.", suffix=".part", dir=path.parent)
    os.close(handle)
    partial = Path(name)
    try:
        # Where 64-bit integers label something, 32 bits hold it and every reader knows them.
        encoding = {
            str(n): {"dtype": "int32"} for n, v in dataset.variables.items() if v.dtype == "int64"
        }
        dataset.to_netcdf(partial, format="NETCDF4", engine="netcdf4", encoding=encoding)
        with partial.open("rb+") as stream:
            os.fsync(stream.fileno())
        # mkstemp's file is for its owner alone; an archive gets the permissions of any new file.
        mask = os.umask(0)
        os.umask(mask)
        partial.chmod(0o666 & ~mask)
        partial.replace(path)
    finally:
        partial.unlink(missing_ok=True)


def open_archive(path: str | Path) -> xr.Dataset:
    """Open an archive for reading; variables are read when used.

    Raises
    ------
    OSError, ValueError
        If there is no such file, or it is no netCDF file.
    """
    return xr.open_dataset(path, engine="netcdf4")
