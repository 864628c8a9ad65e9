"""Opening files that others made: regular files alone, with a limit on their size.

A pipe would be waited for and a device never ends, so both are refused before anything is read.
"""

from __future__ import annotations

import errno
import os
import stat
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO

import psutil

from sweeps.base.errors import SceneError, counted, one_line, size_text

__all__ = ["MOST_ROWS", "MOST_TEXT", "check_rows", "opened_file", "reading", "regular_bytes"]

MOST_TEXT = 1 << 27  # Bytes of a scene, an engine file or a table of which an archive keeps a copy

MOST_ROWS = 10**8  # Rows of a table of designs


def opened_file(path: Path) -> IO[bytes]:
    """Open a regular file for reading.

    Raises
    ------
    OSError
        Where it cannot be read, or is a pipe or a device.
    """
    # Without this flag, opening a pipe waits for a writer; it has no effect on files.
    flags = os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0)
    handle = os.open(path, flags)
    kind = os.fstat(handle).st_mode
    if stat.S_ISREG(kind):
        return os.fdopen(handle, "rb")
    os.close(handle)
    if stat.S_ISDIR(kind):
        raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), str(path))
    raise OSError(errno.EINVAL, "not a regular file", str(path))


def regular_bytes(path: Path, most: int = MOST_TEXT) -> bytes:
    """Bytes of a regular file.

    Raises
    ------
    OSError
        Where it cannot be read, or has more bytes than `most`.
    """
    with opened_file(path) as stream:
        if os.fstat(stream.fileno()).st_size > most:
            raise OSError(errno.EFBIG, f"larger than {size_text(most)}", str(path))
        return stream.read(most)  # it may grow meanwhile


def check_rows(rows: int, columns: int, name: str) -> None:
    """Refuse a table that claims more rows than are allowed, or than the memory holds.

    Raises
    ------
    SceneError
        With the number of rows.
    """
    if rows > MOST_ROWS:
        raise SceneError(f"{name}: {counted(rows, 'row')}; must be at most {MOST_ROWS}")
    # The pieces and the whole columns made of them are in memory together.
    need, free = 2.0 * 8.0 * rows * columns, psutil.virtual_memory().available
    if need > 0.9 * free:
        raise SceneError(
            f"{name}: {counted(rows, 'row')} of {counted(columns, 'column')} need "
            f"{size_text(need)} of memory, {size_text(free)} are free"
        )


@contextmanager
def reading(name: str, what: str, kind: str = "", *errors: type[Exception]) -> Iterator[None]:
    """Turn failures of opening and reading a file into one line.

    Parameters
    ----------
    name : str
        The file as messages should call it.
    what : str
        What it should be.
    kind : str
        The format that an existing file turns out not to have, such as "a netCDF file".
    *errors : exception types
        Further exceptions that a library raises for such a file.

    Raises
    ------
    SceneError
        For a file that is missing or unreadable.
    """
    # ValueError: a null character in the name.
    failures: tuple[type[Exception], ...] = (OSError, ValueError, *errors)
    try:
        yield
    except SceneError:
        raise
    except FileNotFoundError:
        raise SceneError(f"{name}: no such file; expected {what}") from None
    except failures as error:
        reason = one_line(getattr(error, "strerror", None) or error, 200)
        if kind and not isinstance(error, PermissionError | IsADirectoryError):
            raise SceneError(f"{name}: not {kind} ({reason})") from None
        raise SceneError(f"{name}: cannot be read ({reason}); expected {what}") from None
