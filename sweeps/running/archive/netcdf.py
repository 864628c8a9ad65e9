"""Archives: netCDF-4 files, which are either complete or do not exist."""

from __future__ import annotations

import math
import os
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from sweeps.base.arguments import a_path
from sweeps.base.errors import SceneError
from sweeps.base.netcdf.netcdf_files import (
    check_format,
    check_structure,
    close,
    netcdf_library,
    slabs,
)
from sweeps.running.archive.partial import made_folder, sync_folder
from sweeps.running.archive.warnings import ATTRIBUTE
from sweeps.scene.plan.blocks import STEP

if TYPE_CHECKING:
    import xarray as xr

    from sweeps.running.archive.labels import Labels, Variable

__all__ = ["Writer", "chunks_of", "new", "open_archive", "publish", "replaced", "slabs", "write"]

CHUNK = 1 << 17  # Largest number of values in a chunk, about a megabyte

SMALLEST_CHUNK = 1 << 12


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
    with replaced(path) as partial:
        # 64-bit integers that label points fit into 32 bits, which every reader knows.
        encoding = {
            str(n): {"dtype": "int32"} for n, v in dataset.variables.items() if v.dtype == "int64"
        }
        dataset.to_netcdf(partial, format="NETCDF4", engine="netcdf4", encoding=encoding)


@contextmanager
def replaced(path: Path) -> Iterator[Path]:
    """Temporary name beside a file; the file written there is renamed at the end."""
    made_folder(path.parent)
    handle, name = tempfile.mkstemp(prefix=f".{path.name[:100]}.", suffix=".part", dir=path.parent)
    os.close(handle)
    partial = Path(name)
    try:
        yield partial
        # mkstemp's file is for its owner alone; an archive gets the permissions of any new file.
        mask = os.umask(0)
        os.umask(mask)
        partial.chmod(0o666 & ~mask)
        publish(partial, path)
    finally:
        partial.unlink(missing_ok=True)


def open_archive(path: str | Path) -> xr.Dataset:
    """Open an archive for reading; variables are read when used.

    Raises
    ------
    OSError, ValueError
        If there is no such file, or it is no sound netCDF file.
    SceneError
        If it is an archive of a newer format than this version reads; later, where values that are
        used cannot be read.

    Examples
    --------
    >>> import sweeps
    >>> done = sweeps.stream("first", "first.nc")
    >>> with sweeps.open_archive("first.nc") as archive:
    ...     print(dict(archive.sizes))
    {'load': 3, 'inertia': 25}
    """
    from sweeps.running.archive.stored_values import dataset_from

    path = a_path(path, "path")
    check_structure(path)
    with netcdf_library:
        archive = dataset_from(path)
    try:
        check_format(archive.attrs, path)
    except SceneError:
        archive.close()
        raise
    return archive


def publish(partial: Path, path: Path) -> None:
    """Give a finished file its name, so that it survives a loss of power."""
    with partial.open("rb+") as stream:
        os.fsync(stream.fileno())
    partial.replace(path)
    sync_folder(path.parent)


class Writer:
    """An archive while its variables are filled, a range at a time: see `new`."""

    def __init__(self, variables: Mapping[str, Any], labels: Labels) -> None:
        self._variables = variables
        self._watch = labels.watch()

    def put(self, name: str, place: tuple[Any, ...], values: npt.NDArray[Any]) -> None:
        """Write a range of a variable, in the units of files."""
        with netcdf_library:
            self._variables[name][place if place else ...] = values
        self._watch.look(name, place, values)

    @property
    def warnings(self) -> str:
        """Text of plausibility warnings, of all that has been put."""
        return self._watch.text()


@contextmanager
def new(
    path: Path, labels: Labels, lengths: Mapping[str, int], *, level: int = 0
) -> Iterator[Writer]:
    """Create an archive under a temporary name, with all that is known without computing.

    xarray cannot write a part of a variable, so netCDF4 does; other threads wait while it is used.
    The file, which replaces an older one, is what `write` would make of `labels.label`. Blocks of
    these `lengths` are whole numbers of chunks, so that no chunk is written twice; `level` is that
    of compression (zlib), from 0 to 9. netCDF4 raises OSError or RuntimeError where it cannot be
    written.
    """
    import netCDF4

    path.unlink(missing_ok=True)  # A link in this place would lead the writing elsewhere
    with netcdf_library:
        file = netCDF4.Dataset(os.path.abspath(path), "w", format="NETCDF4")
    try:
        with netcdf_library:
            variables = _defined(file, labels, lengths, level)
        writer = Writer(variables, labels)
        yield writer
        with netcdf_library:
            file.setncattr(ATTRIBUTE, writer.warnings)
            close(file)
    except BaseException:
        # A file that cannot be written may also fail to close.
        with netcdf_library, suppress(OSError, RuntimeError):
            if file.isopen():
                close(file)
        raise


def _defined(file: Any, labels: Labels, lengths: Mapping[str, int], level: int) -> dict[str, Any]:
    """Define all that an archive holds; its results are returned, to be filled."""
    file.set_fill_off()
    file.setncatts(dict(labels.attributes))
    for name, size in labels.sizes.items():
        file.createDimension(name, size)
    variables: dict[str, Any] = {}
    auxiliary = {n: v for n, v in labels.coordinates.items() if v.dims != (n,)}
    # As in files of xarray, an attribute of the file lists the coordinates that go with no result.
    of_none = [
        n
        for n, c in auxiliary.items()
        if not any(set(c.dims) <= set(v.dims) for v in labels.variables.values())
    ]
    if of_none:
        file.setncattr("coordinates", " ".join(sorted(of_none)))
    for name, variable in (*labels.variables.items(), *labels.coordinates.items()):
        made = _made(file, name, variable, labels, lengths, level)
        if name in labels.variables:
            with_it = sorted(n for n, c in auxiliary.items() if set(c.dims) <= set(variable.dims))
            if with_it:
                made.setncattr("coordinates", " ".join(with_it))
            variables[name] = made
        if variable.data is not None:
            made[...] = variable.data
    return variables


def _made(
    file: Any, name: str, variable: Variable, labels: Labels, lengths: Mapping[str, int], level: int
) -> Any:
    """Define a variable, with its attributes."""
    shape = tuple(labels.sizes[d] for d in variable.dims)
    kind: Any = variable.kind if variable.data is None else variable.data.dtype.str[1:]
    options: dict[str, Any] = {}
    if variable.data is not None and variable.data.dtype.kind in "OU":
        kind = str
    elif shape:
        chunks = chunks_of(variable.dims, shape, lengths)
        # Chunks are written completely: a cache of more than two chunks would only take memory.
        size = 2 * math.prod(chunks) * np.dtype(kind).itemsize
        options = {"chunksizes": chunks, "chunk_cache": size}
        if level:
            options |= {"compression": "zlib", "complevel": level, "shuffle": True}
    if name in labels.variables and np.dtype(kind).kind == "f":
        options["fill_value"] = np.dtype(kind).type(np.nan)
    made = file.createVariable(name, kind, variable.dims, **options)
    made.set_auto_maskandscale(False)
    made.setncatts(dict(variable.attributes))
    return made


def chunks_of(
    dims: tuple[str, ...], shape: tuple[int, ...], lengths: Mapping[str, int]
) -> tuple[int, ...]:
    """Chunks of a variable: about `CHUNK` numbers, and blocks are whole numbers of them.

    The last chunk along a dimension takes as much room as the others: where more than 2 % of
    the file would be unused, chunks are smaller.
    """
    if math.prod(shape) <= CHUNK:
        return shape
    chunks = list(shape)
    for i, dimension in enumerate(dims):
        if dimension in lengths:
            # The length of a short block may have few divisors: its chunks have one position. That
            # of a long block is a multiple of `STEP`, which shorter chunks divide.
            chunks[i] = lengths[dimension] if lengths[dimension] > STEP else 1
    # At most 2 % of the room of all chunks may be unused.
    while (large := math.prod(chunks) > CHUNK) or (
        _waste(shape, chunks) > 0.02 and math.prod(chunks) > SMALLEST_CHUNK
    ):
        halves = [
            i
            for i, (c, n, d) in enumerate(zip(chunks, shape, dims, strict=True))
            if c > 1 and (d not in lengths or c % 2 == 0) and (large or n % c)
        ]
        if not halves:
            break
        longest = max(halves, key=lambda i: chunks[i])
        chunks[longest] = -(-chunks[longest] // 2)
    return tuple(chunks)


def _waste(shape: tuple[int, ...], chunks: list[int]) -> float:
    """Fraction of the room of all chunks that is not used."""
    room = math.prod(-(-n // c) * c for n, c in zip(shape, chunks, strict=True))
    return 1.0 - math.prod(shape) / room
