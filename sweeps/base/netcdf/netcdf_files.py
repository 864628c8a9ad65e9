"""netCDF files that others made, checked before their values are read.

A file of some kilobytes may claim to hold terabytes (holes, run lengths and compressed zeros take
no room), or lead to other files; both are refused. A damaged one may let the library run for ever,
so each is first read in a child process (`sweeps.base.netcdf.netcdf_child`).
"""

from __future__ import annotations

import errno
import math
import os
import re
import sys
import threading
import warnings
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from functools import lru_cache
from pathlib import Path
from typing import Any

import psutil

from sweeps.base.errors import SceneError, one_line, shown, size_text
from sweeps.base.files.regular_files import opened_file, reading
from sweeps.base.netcdf import ARCHIVE_FORMAT
from sweeps.base.netcdf.netcdf_child import read_apart

LARGEST_CHUNK = 1 << 28
"""Largest number of bytes of one chunk of a netCDF file: reading any value loads its chunk. `run`
writes chunks of one megabyte."""

LARGEST_RATIO = 1040
"""Largest ratio of values to file size. Archives are uncompressed or compressed by zlib, whose best
ratio is 1032 to 1 (zlib, "Technical Details", zlib.net/zlib_tech.html)."""

DAMAGE = (
    OSError, ValueError, RuntimeError, AttributeError, LookupError, TypeError, ArithmeticError,
    AssertionError,
)  # fmt: skip
"""Exceptions that the libraries raise for damaged files, `RecursionError` among them."""

SLAB = 16e6  # Bytes of a variable that are read or copied at a time

_UNTRUSTED: ContextVar[bool] = ContextVar("untrusted", default=False)

# Smallest number of bytes that the reference to a text of a netCDF-4 variable takes
TEXT_REFERENCE = 16


def check_file(path: Path) -> None:
    """Refuse a path that is not a regular file: a missing file, a folder, a pipe or a device."""
    try:
        exists, is_file = path.exists(), path.is_file()
    except (OSError, ValueError):
        exists = is_file = False
    if not is_file:
        problem = "is not a file" if exists else "no such file"
        raise SceneError(f"{path}: {problem}; expected a netCDF archive written by `run`")
    if path.suffix.lower() == ".toml":
        raise SceneError(
            f"{path}: is a TOML file, such as a scene, and no archive; engine-dyn run {path} -o "
            "out.nc computes a scene and writes its archive"
        )


@contextmanager
def untrusted(yes: bool = True) -> Iterator[None]:
    """Read the results of archives too in the child process, before this one opens them.

    Parameters
    ----------
    yes : bool
        Whether to do so; else only the first chunk of each, and all else.
    """
    before = _UNTRUSTED.set(yes or _UNTRUSTED.get())
    try:
        yield
    finally:
        _UNTRUSTED.reset(before)


def check_structure(path: Path) -> None:
    """Raise OSError for a netCDF file that might harm the library, or leads to other files."""
    with opened_file(path) as stream:
        about = os.fstat(stream.fileno())
    state = (about.st_dev, about.st_ino, about.st_size, about.st_mtime_ns, about.st_ctime_ns)
    _check_state(os.path.abspath(path), state, _UNTRUSTED.get())


@lru_cache(maxsize=1000)
def _check_state(path: str, state: tuple[int, ...], whole: bool) -> None:
    """Check a file in one state, once: a command opens the same file several times."""
    del state
    read_apart(Path(path), whole)


def open_netcdf(path: Path, *, own: bool = False) -> Any:
    """Open a netCDF file of this disk that is `own`, or sound without leading to other files.

    The library takes some names for servers, but never absolute paths.

    Raises
    ------
    OSError, ValueError, RuntimeError
        As the library does, and for what is refused.
    """
    import netCDF4

    if not own:
        check_structure(path)
    return netCDF4.Dataset(os.path.abspath(path))


@contextmanager
def opened_table(path: Path, name: str, what: str) -> Iterator[Any]:
    """Open a netCDF file of somebody else, with netCDF's library for this thread alone.

    `name` and `what` are the file as messages call it, and what it should be. A file that cannot be
    opened and a damaged part are refused.
    """
    with netcdf_library:
        with reading(name, what, "a netCDF file", *DAMAGE):
            file = open_netcdf(path)
        with (
            file,
            warnings.catch_warnings(),
            reading(name, what, "a sound netCDF file", *DAMAGE, Warning),
        ):
            warnings.simplefilter("error")  # netCDF4 only warns when it drops attributes
            yield file


@contextmanager
def opened_archive(path: Path, *, own: bool = False) -> Iterator[Any]:
    """Open an archive with netCDF4 after checking it; values come as they are in the file.

    Other threads that read or write netCDF files wait until it is closed. A missing file, and one
    that `run` did not write, are refused. `own` says that this process has just written the
    archive: no other one need read it first.
    """
    check_file(path)
    with netcdf_library:
        try:
            file = open_netcdf(path, own=own)
        except DAMAGE as error:
            reason = one_line(getattr(error, "strerror", None) or error, 200)
            raise SceneError(f"{path}: not a netCDF archive ({reason})") from None
        try:
            with damaged_values(path):
                check_archive(file, path)
            file.set_auto_maskandscale(False)
            yield file
        finally:
            with suppress(RuntimeError):  # Values are read by now; the file may fail to close
                close(file)


def close(file: Any) -> None:
    """Close a file of netCDF4, once: where that fails, a second time would crash the process."""
    try:
        file.close()
    except BaseException:
        file._isopen = 0  # netCDF4 would close it again when it frees the object
        raise


@contextmanager
def damaged_values(path: str | Path, name: str = "") -> Iterator[None]:
    """Turn what the libraries raise for a damaged part of a file into one line.

    `name` is the variable that is read. The error of a disk that cannot be read stays as it is.
    """
    try:
        yield
    except SceneError:
        raise
    except DAMAGE as error:
        # Error numbers below 0 are those of the netCDF library; EINVAL comes from `read_apart`.
        if isinstance(error, OSError) and (error.errno or 0) > 0 and error.errno != errno.EINVAL:
            raise
        part = f"{name}: " if name else ""
        reason = one_line(getattr(error, "strerror", None) or error, 200)
        raise SceneError(f"{path}: damaged: {part}cannot be read ({reason})") from error


def check_format(attributes: Mapping[str, Any], path: str | Path) -> int:
    """Format of an archive, by its attributes; newer formats than this version's are refused."""
    stated = str(attributes.get("archive_format", 1))
    if not re.fullmatch(r"[1-9]\d{0,5}", stated, re.ASCII):
        raise SceneError(
            f"{path}: archive_format = {shown(stated)}: must be a whole number, 1 to "
            f"{ARCHIVE_FORMAT}"
        )
    if int(stated) > ARCHIVE_FORMAT:
        raise SceneError(
            f"{path}: an archive of format {stated}, written by a newer version; this version of "
            f"engine-dyn reads formats up to {ARCHIVE_FORMAT}"
        )
    return int(stated)


def check_archive(file: Any, path: Path) -> None:
    """Refuse a netCDF file that `run` did not write, or that claims to hold more than it can.

    Newer formats, groups, other types than numbers and texts, and sizes that the file has no room
    for are refused.
    """
    if "scene" not in file.ncattrs() or not isinstance(file.getncattr("scene"), str):
        raise SceneError(
            f"{path}: a netCDF file, but not an archive written by `run` (no attribute 'scene')"
        )
    names = [name for name in file.ncattrs() if name == "archive_format"]
    check_format({name: file.getncattr(name) for name in names}, path)
    if file.groups:
        raise SceneError(f"{path}: has groups, unlike any archive written by `run`")
    size = path.stat().st_size
    free = psutil.virtual_memory().available
    at_once = 0
    for name, variable in file.variables.items():
        item = _item_bytes(variable)
        dims = variable.dimensions
        if not item or len(set(dims)) < len(dims):
            what = f"of {shown(str(variable.datatype))}" if not item else "twice along a dimension"
            raise SceneError(
                f"{path}: variable {one_line(name, 60)}: {what}; `run` writes no such variable"
            )
        room = item * check_chunks(variable, item, str(path))
        if dims == (name,):  # Coordinates are read whole
            at_once += room
    for name, dimension in file.dimensions.items():
        if len(dimension) > LARGEST_RATIO * size:  # Each has a coordinate of a byte or more
            raise SceneError(
                f"{path}: damaged: {len(dimension)} points of {one_line(name, 60)} in a file of "
                f"{size_text(size)}"
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
    """Number of values that a netCDF variable's chunks have room for; large chunks are refused."""
    shape: Sequence[int] = variable.shape
    chunks = variable.chunking()
    if not isinstance(chunks, list | tuple) or len(chunks) != len(shape):
        chunks = [1] * len(shape)  # The variable is stored contiguously
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


def slabs(
    shape: tuple[int, ...], chunks: tuple[int, ...], itemsize: int, limit: float | None = None
) -> Iterator[tuple[slice, ...]]:
    """Ranges that make up an array: whole numbers of chunks, about `limit` bytes at most."""
    limit = SLAB if limit is None else limit
    if not shape:
        yield ()
        return
    row = math.prod(shape[1:]) * itemsize
    if row * chunks[0] <= limit or len(shape) == 1:
        step = max(1, int(limit // max(row * chunks[0], 1))) * chunks[0]
        for begin in range(0, shape[0], step):
            yield (slice(begin, min(begin + step, shape[0])), *(slice(0, n) for n in shape[1:]))
        return
    for begin in range(0, shape[0], chunks[0]):
        first = slice(begin, min(begin + chunks[0], shape[0]))
        for rest in slabs(shape[1:], chunks[1:], itemsize * chunks[0], limit):
            yield (first, *rest)


class _Library:
    """A lock that a thread may take several times, and that can be copied and pickled."""

    # Taking this lock also takes the lock that xarray has for files, where xarray is loaded. xarray
    # reads attributes without any lock: so files are opened by xarray while this lock is held, and
    # xarray uses this lock for what it reads of them later.

    def __init__(self) -> None:
        self._own = threading.RLock()
        self._times = 0
        self._of_xarray: Any = None

    def __reduce__(self) -> str:
        return "netcdf_library"  # A copy is the one lock of its process

    def acquire(self, blocking: bool = True) -> bool:
        """Take the lock; False where another thread has it and one does not wait."""
        if not self._own.acquire(blocking):
            return False
        if not self._times:
            # Code that reads by xarray has imported it already; importing it here would cost half a
            # second.
            backend = sys.modules.get("xarray.backends.netCDF4_")
            self._of_xarray = getattr(backend, "NETCDF4_PYTHON_LOCK", None)
            if self._of_xarray is not None and not self._of_xarray.acquire(blocking):
                self._own.release()
                return False
        self._times += 1
        return True

    def release(self) -> None:
        """Give the lock back."""
        self._times -= 1
        if not self._times and self._of_xarray is not None:
            self._of_xarray.release()
        self._own.release()

    def __enter__(self) -> None:
        self.acquire()

    def __exit__(self, *_: object) -> None:
        self.release()


netcdf_library = _Library()  # Context in which one thread alone uses netCDF4
