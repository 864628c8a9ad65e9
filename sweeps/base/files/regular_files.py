"""Opening files that others made: regular files alone, with a limit on their size.

A pipe would be waited for and a device never ends, so both are refused before anything is read.
"""

from __future__ import annotations

import errno
import os
import stat
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO

from sweeps.base.errors import SceneError, counted, one_line, shown, size_text
from sweeps.catalogue import PACKAGE

# Largest number of bytes of a scene, engine file or table; archives keep copies
MOST_TEXT = 1 << 27

MOST_ROWS = 10**8  # Largest number of rows of a table of designs


def opened_file(path: Path) -> IO[bytes]:
    """Open a regular file for reading; OSError where that fails, for pipes and for devices."""
    # Without O_NONBLOCK, opening a pipe would wait for a writer; on regular files the flag has no
    # effect.
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
    """Bytes of a regular file; OSError where that fails, or there are more bytes than `most`."""
    with opened_file(path) as stream:
        if os.fstat(stream.fileno()).st_size > most:
            raise OSError(errno.EFBIG, f"larger than {size_text(most)}", str(path))
        return stream.read(most)  # The file may grow while it is read


def check_rows(rows: int, columns: int, name: str) -> None:
    """Refuse a table that claims more rows than are allowed, or than the memory holds."""
    import psutil

    if rows > MOST_ROWS:
        raise SceneError(f"{name}: {counted(rows, 'row')}; must be at most {MOST_ROWS}")
    # The pieces in which a table is read and the whole columns made of them are in memory together.
    need, free = 2.0 * 8.0 * rows * columns, psutil.virtual_memory().available
    if need > 0.9 * free:
        raise SceneError(
            f"{name}: {counted(rows, 'row')} of {counted(columns, 'column')} need "
            f"{size_text(need)} of memory, {size_text(free)} are free"
        )


@contextmanager
def reading(name: str, what: str, kind: str = "", *errors: type[Exception]) -> Iterator[None]:
    """Turn failures of opening and reading a file into one line.

    `name` and `what` are the file as messages call it, and the kind that is expected. `kind` is the
    format that an existing file turns out not to have, such as "a netCDF file"; `errors` are
    further exceptions that a library raises for such a file.
    """
    # A null character in the name of a file raises a ValueError.
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


MOST_RECORDING = 1 << 30  # Largest number of bytes of a laboratory's recording

_FILES: ContextVar[_Kept | None] = ContextVar("_FILES", default=None)


@dataclass(frozen=True)
class _Kept:
    """Bytes of files that were read, whether they are all (closed), and the scene's folder."""

    # `instead` holds tables that a program gives in place of files.

    files: dict[str, bytes]
    closed: bool
    home: Path | None = None
    instead: Mapping[str, bytes] = field(default_factory=dict)


@contextmanager
def kept_files(
    given: Mapping[str, bytes] | None = None, home: Path | None = None,
    instead: Mapping[Path, bytes] | None = None,
) -> Iterator[dict[str, bytes]]:  # fmt: skip
    """Collect the bytes of all files that are read inside, by name.

    With `given`, files come from there and nothing is read from a disk; scenes of archives are read
    like this. `home` is the folder of the scene. What `instead` holds is read from there although
    other files are read from the disk.
    """
    objects = {kept_name(path): data for path, data in (instead or {}).items()}
    collected = _Kept(dict(given or {}), given is not None, home, objects)
    token = _FILES.set(collected)
    try:
        yield collected.files
    finally:
        _FILES.reset(token)


def kept(path: Path) -> bool | None:
    """Whether a file is among those given; None where files are read from the disk."""
    collected = _FILES.get()
    return None if collected is None or not collected.closed else kept_name(path) in collected.files


def add_files_read(files: Mapping[str, bytes]) -> None:
    """Add files that were read before."""
    collected = _FILES.get()
    if collected is not None:
        collected.files.update(files)


def referred(base: Path, text: str, where: str) -> Path:
    """Path of a file that a scene or an engine file names.

    A relative path starts from the folder of the file that names it, and must stay in that folder
    or in the scene's, also after links are resolved. Archives hold what was read, so a scene of
    somebody else must not be able to read private files.

    Raises
    ------
    SceneError
        For a path that leads out of both folders.
    """
    path = base / text
    collected = _FILES.get()
    given = collected is not None and collected.closed  # Files of an archive are on no disk
    if given or Path(text).is_absolute() or base.is_relative_to(PACKAGE):
        return path
    homes = [base] if collected is None or collected.home is None else [base, collected.home]
    try:
        real = path.resolve()
        inside = any(real.is_relative_to(home.resolve()) for home in homes)
    except (OSError, ValueError, RuntimeError):  # A null character in a path, or links in a circle
        return path  # Opening the file then raises an error that says why
    if not inside:
        raise SceneError(
            f"{where} = {shown(text, 300)}: leads outside the folder of the file that names it; "
            f"must be inside this folder, or be given as the absolute path {one_line(real, 300)}"
        )
    return path


def kept_name(path: Path) -> str:
    """Name under which a file is kept; files of the package by their place in it."""
    if path.is_relative_to(PACKAGE):
        return path.relative_to(PACKAGE.parent).as_posix()
    return str(path)


def _bytes(path: Path, most: int = MOST_TEXT) -> bytes:
    collected = _FILES.get()
    if collected is None:
        return regular_bytes(path, most)
    name = kept_name(path)
    if collected.closed:
        if name not in collected.files:
            raise FileNotFoundError(name)
        return collected.files[name]
    data = collected.instead.get(name) or regular_bytes(path, most)
    collected.files[name] = data
    return data


def file_bytes(path: Path, most: int = MOST_RECORDING) -> bytes:
    """Return the bytes of a file of which no copy is kept: recordings may be large.

    Whoever reads it keeps what a scene needs of it (`add_files_read`). Where files are given, it
    is one of them.

    Raises
    ------
    OSError
        Where it cannot be read, has more bytes than `most`, or is not among the files given.
    """
    collected = _FILES.get()
    if collected is not None and collected.closed:
        return _bytes(path)
    if collected is not None and kept_name(path) in collected.instead:
        return collected.instead[kept_name(path)]
    return regular_bytes(path, most)


def read_text(path: Path, name: str, what: str, most: int = MOST_TEXT) -> str:
    """Return the text of a UTF-8 file of at most so many bytes, without a byte order mark.

    Raises
    ------
    SceneError
        For a file that is missing, unreadable or not text; `what` says what it should be.
    """
    with reading(name, what):
        data = _bytes(path, most)
    return text_of_bytes(data, name, what)


def text_of_bytes(data: bytes, name: str, what: str, before: int = 0) -> str:
    """Return the text of the bytes of a file, as `read_text` does; `before` are those left out."""
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise SceneError(
            f"{name}: not a text file in UTF-8 (byte {before + error.start}); expected {what}"
        ) from None
