"""Files that scenes and engine files refer to: where they may lie, their text, and copies of it.

While a scene is read, the bytes of every such file are kept for its archive. A scene that comes
out of an archive is read from these copies, and from no disk.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from pathlib import Path

from sweeps.catalogue import PACKAGE
from sweeps.errors import SceneError, one_line, shown
from sweeps.reading.regular_files import reading, regular_bytes

__all__ = ["keep", "kept", "kept_files", "read_text", "referred"]

_FILES: ContextVar[_Kept | None] = ContextVar("_FILES", default=None)


@dataclass(frozen=True)
class _Kept:
    """Files that were read, whether others may be, and the folder of the scene."""

    files: dict[str, bytes]
    closed: bool
    home: Path | None = None


@contextmanager
def kept_files(
    given: Mapping[str, bytes] | None = None, home: Path | None = None
) -> Iterator[dict[str, bytes]]:
    """Keep the texts that are read inside, by name.

    With `given`, they come from there and from no disk: that is how an archive is read again.
    `home` is the folder of the scene.
    """
    held = _Kept(dict(given or {}), given is not None, home)
    token = _FILES.set(held)
    try:
        yield held.files
    finally:
        _FILES.reset(token)


def kept(path: Path) -> bool | None:
    """Whether a file is among those given; None where files are read from the disk."""
    held = _FILES.get()
    return None if held is None or not held.closed else _name(path) in held.files


def keep(files: Mapping[str, bytes]) -> None:
    """Add files that were read before."""
    held = _FILES.get()
    if held is not None:
        held.files.update(files)


def referred(base: Path, text: str, where: str) -> Path:
    """Path of a file that a scene or an engine file names.

    A relative one starts from the folder of the file that names it, and stays in that folder or
    the scene's, also through links: who runs a scene of somebody else does not want it to look
    elsewhere, as archives hold what was read.

    Raises
    ------
    SceneError
        Where it leads out of them.
    """
    path = base / text
    held = _FILES.get()
    given = held is not None and held.closed  # no disk is read
    if given or Path(text).is_absolute() or base.is_relative_to(PACKAGE):
        return path
    homes = [base] if held is None or held.home is None else [base, held.home]
    try:
        real = path.resolve()
        inside = any(real.is_relative_to(home.resolve()) for home in homes)
    except (OSError, ValueError, RuntimeError):  # a null character, links in a circle
        return path  # opening it says what is wrong
    if not inside:
        raise SceneError(
            f"{where} = {shown(text, 300)}: leads out of the folder of the file that names it; "
            f"must be inside, or the whole path, {one_line(real, 300)}"
        )
    return path


def _name(path: Path) -> str:
    """What a file is kept as; those of the package by the place that they have in it."""
    if path.is_relative_to(PACKAGE):
        return path.relative_to(PACKAGE.parent).as_posix()
    return str(path)


def _bytes(path: Path) -> bytes:
    held = _FILES.get()
    if held is None:
        return regular_bytes(path)
    name = _name(path)
    if held.closed:
        if name not in held.files:
            raise FileNotFoundError(name)
        return held.files[name]
    data = held.files[name] = regular_bytes(path)
    return data


def read_text(path: Path, name: str, what: str) -> str:
    """Return the text of a UTF-8 file (a byte order mark at its start is dropped).

    Raises
    ------
    SceneError
        For a file that is missing, unreadable or not text; `what` says what it should be.
    """
    with reading(name, what):
        data = _bytes(path)
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise SceneError(
            f"{name}: not a text file in UTF-8 (byte {error.start}); expected {what}"
        ) from None
