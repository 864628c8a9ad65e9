"""netCDF files that others made, checked before their values are read.

A file of some kilobytes may claim to hold terabytes (holes, run lengths and compressed zeros take
no room), or lead to other files; both are refused.
"""

from __future__ import annotations

import errno
import os
import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import psutil

from sweeps.errors import SceneError, one_line, shown, size_text
from sweeps.reading.hdf5_links import external_member
from sweeps.reading.netcdf_lock import netcdf_library

__all__ = [
    "ARCHIVE_FORMAT",
    "TEXT_REFERENCE",
    "check_archive",
    "check_chunks",
    "check_file",
    "check_format",
    "close",
    "open_netcdf",
    "opened_archive",
]

ARCHIVE_FORMAT = 2
"""Format of the archives that this version writes, their attribute `archive_format`.

1, of version 0.1, has no such attribute; it names the files of the catalogue by another folder: see
`sweeps.archive.contents`. A change that an older version would misread raises the number.
"""

LARGEST_CHUNK = 1 << 28
"""Bytes of one chunk of a netCDF file, which reading any of its values loads whole. `run` writes
chunks of one megabyte."""

LARGEST_RATIO = 1040
"""Largest ratio of values to file size. Archives are uncompressed or compressed by zlib, whose best
ratio is 1032 to 1 (zlib, "Technical Details", zlib.net/zlib_tech.html)."""

TEXT_REFERENCE = 16
"""Least bytes that a text of a netCDF-4 variable takes where the variable is stored."""


def check_file(path: Path) -> None:
    """Refuse a path that is not a regular file.

    Raises
    ------
    SceneError
        For a missing file, a folder, a pipe or a device.
    """
    try:
        exists, is_file = path.exists(), path.is_file()
    except (OSError, ValueError):
        exists = is_file = False
    if not is_file:
        problem = "is not a file" if exists else "no such file"
        raise SceneError(f"{path}: {problem}; expected a netCDF archive that `run` wrote")


def open_netcdf(path: Path) -> Any:
    """Open a netCDF file of this disk that does not lead to other files.

    The library takes some names for servers, but never absolute paths.

    Raises
    ------
    OSError, ValueError, RuntimeError
        As the library does.
    """
    import netCDF4

    name = external_member(path)
    if name:
        raise OSError(
            errno.EINVAL,
            f"'{one_line(name, 60)}' is stored outside the file, or nested without end",
        )
    return netCDF4.Dataset(os.path.abspath(path))


@contextmanager
def opened_archive(path: Path) -> Iterator[Any]:
    """Open an archive with netCDF4 after checking it; values come as they are in the file.

    Other threads that read or write netCDF files wait until it is closed.

    Raises
    ------
    SceneError
        For a missing file, and for a file that `run` did not write.
    """
    check_file(path)
    with netcdf_library:
        try:
            file = open_netcdf(path)
        except (OSError, ValueError, RuntimeError, AttributeError) as error:
            reason = one_line(getattr(error, "strerror", None) or error, 200)
            raise SceneError(f"{path}: not a netCDF archive ({reason})") from None
        try:
            check_archive(file, path)
            file.set_auto_maskandscale(False)
            yield file
        finally:
            with suppress(RuntimeError):  # all that was wanted has been read
                close(file)


def close(file: Any) -> None:
    """Close a file of netCDF4, once: where that fails, a second time would crash the process.

    Raises
    ------
    OSError, RuntimeError
        As the library does.
    """
    try:
        file.close()
    except BaseException:
        file._isopen = 0  # the library would try again when the object is freed
        raise


def check_format(attributes: Mapping[str, Any], path: str | Path) -> int:
    """Format of an archive, by its attributes.

    Raises
    ------
    SceneError
        Where it is newer than this version knows, or no number.
    """
    found = str(attributes.get("archive_format", 1))
    if not re.fullmatch(r"[1-9]\d{0,5}", found, re.ASCII):
        raise SceneError(
            f"{path}: archive_format = {shown(found)}: must be a whole number, 1 to "
            f"{ARCHIVE_FORMAT}"
        )
    if int(found) > ARCHIVE_FORMAT:
        raise SceneError(
            f"{path}: an archive of format {found}; this version of engine-dyn reads formats up to "
            f"{ARCHIVE_FORMAT}, a newer version wrote it"
        )
    return int(found)


def check_archive(file: Any, path: Path) -> None:
    """Refuse a netCDF file that `run` did not write, or that claims to hold more than it can.

    Raises
    ------
    SceneError
        For a newer format, for groups, for other types than numbers and texts, for sizes that the
        file has no room for.
    """
    if "scene" not in file.ncattrs() or not isinstance(file.getncattr("scene"), str):
        raise SceneError(
            f"{path}: a netCDF file, but not an archive that `run` wrote (no attribute 'scene')"
        )
    names = [name for name in file.ncattrs() if name == "archive_format"]
    check_format({name: file.getncattr(name) for name in names}, path)
    if file.groups:
        raise SceneError(f"{path}: has groups, which no archive that `run` wrote has")
    size = path.stat().st_size
    free = psutil.virtual_memory().available
    total = at_once = 0
    for name, variable in file.variables.items():
        item = _item_bytes(variable)
        dims = variable.dimensions
        if not item or len(set(dims)) < len(dims):
            what = f"of {shown(str(variable.datatype))}" if not item else "twice along a dimension"
            raise SceneError(
                f"{path}: variable {one_line(name, 60)}: {what}; `run` writes no such variable"
            )
        room = item * check_chunks(variable, item, str(path))
        total += room
        if dims == (name,):  # coordinates are read whole
            at_once += room
    if total > LARGEST_RATIO * size:
        raise SceneError(
            f"{path}: damaged: variables of {size_text(total)} in a file of {size_text(size)}"
        )
    if 2.0 * at_once > 0.9 * free:
        raise SceneError(
            f"{path}: axes of {size_text(at_once)} and their index need {size_text(2.0 * at_once)} "
            f"of memory, {size_text(free)} are free"
        )


def _item_bytes(variable: Any) -> int:
    """Bytes of one value; 0 where it is neither a number nor a text."""
    import numpy as np

    if variable.dtype is str:
        return TEXT_REFERENCE
    kind = variable.datatype
    return int(kind.itemsize) if isinstance(kind, np.dtype) and kind.kind in "iufS" else 0


def check_chunks(variable: Any, item: int, name: str) -> int:
    """Number of values that the chunks of a netCDF variable have room for.

    Raises
    ------
    SceneError
        For a chunk that is larger than `LARGEST_CHUNK`.
    """
    shape: Sequence[int] = variable.shape
    chunks = variable.chunking()
    if not isinstance(chunks, list | tuple) or len(chunks) != len(shape):
        chunks = [1] * len(shape)  # contiguous
    room, chunk = 1, item
    for length, part in zip(shape, chunks, strict=True):
        room *= -(-int(length) // max(int(part), 1)) * max(int(part), 1)
        chunk *= max(int(part), 1)
    if chunk > LARGEST_CHUNK:
        raise SceneError(
            f"{name}: variable {one_line(variable.name, 60)}: chunks of {size_text(chunk)}; must "
            f"be at most {size_text(LARGEST_CHUNK)}"
        )
    return room
