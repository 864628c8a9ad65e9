"""Files that scenes and engine files refer to: where they may be, their text, and copies of them.

While a scene is read, the bytes of every such file are kept for its archive. A scene that comes
out of an archive is read from these copies, and from no disk.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field
from pathlib import Path

from sweeps.base.errors import SceneError, one_line, shown
from sweeps.base.files.regular_files import MOST_TEXT, reading, regular_bytes
from sweeps.catalogue import PACKAGE

__all__ = [
    "MOST_RECORDING",
    "file_bytes",
    "add_files_read",
    "kept",
    "kept_files",
    "kept_name",
    "read_text",
    "referred",
    "text_of_bytes",
]

MOST_RECORDING = 1 << 30  # Bytes of a recording of a laboratory

_FILES: ContextVar[_Kept | None] = ContextVar("_FILES", default=None)


@dataclass(frozen=True)
class _Kept:
    """Bytes of files, whether they are all there is (closed), and the folder of the scene.

    `instead` holds files that are no files: tables that a program gives.
    """

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
    given = collected is not None and collected.closed  # no disk is read
    if given or Path(text).is_absolute() or base.is_relative_to(PACKAGE):
        return path
    homes = [base] if collected is None or collected.home is None else [base, collected.home]
    try:
        real = path.resolve()
        inside = any(real.is_relative_to(home.resolve()) for home in homes)
    except (OSError, ValueError, RuntimeError):  # a null character, links in a circle
        return path  # opening the file says what is wrong
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

    What a scene needs of it is kept by whoever reads it (`keep`). Where files are given, it is one
    of them.

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


def text_of_bytes(data: bytes, name: str, what: str) -> str:
    """Return the text of the bytes of a file, as `read_text` does of a file."""
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise SceneError(
            f"{name}: not a text file in UTF-8 (byte {error.start}); expected {what}"
        ) from None
