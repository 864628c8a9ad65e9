"""An archive that is not finished: a folder of finished blocks beside its name, `OUT.nc.partial`.

The folder holds `run.json` (what is computed, in which blocks), a file for each finished block,
the scene for those who compute blocks elsewhere (`sweeps.running.compute.cluster`), and the archive
while it is put together. Every file is written under another name, synced and renamed, so a file
with its final name is complete. A block begins with the hash of all that follows; then comes one
line of JSON (its number, the run that it belongs to, its arrays), then the arrays as they lie in
memory, little-endian. A lock of the operating system keeps a second run away; it ends with the
process that has it.
"""

from __future__ import annotations

import contextlib
import errno
import hashlib
import json
import math
import os
import platform
import re
import secrets
import stat
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import IO, Any

import numpy as np
import numpy.typing as npt

from sweeps.base.errors import NAMED_BADLY, SceneError, one_line
from sweeps.base.files.regular_files import regular_bytes


def made_folder(path: Path) -> None:
    """Make a folder that may exist, and those above it, so that their names last."""
    if path.is_dir():
        return
    if path.parent != path:
        made_folder(path.parent)
    path.mkdir(exist_ok=True)
    sync_folder(path.parent)


def sync_folder(path: Path) -> None:
    """Make the names in a folder last, where the system can do that; OSError where it fails."""
    if not hasattr(os, "O_DIRECTORY"):
        return
    try:
        handle = os.open(path, os.O_RDONLY | os.O_DIRECTORY)
    except PermissionError:  # A folder may be open for writing, but not for reading
        return
    try:
        os.fsync(handle)
    except OSError as error:
        # File systems that cannot sync folders raise these errors, some network ones among them.
        if error.errno not in (errno.EINVAL, errno.ENOSYS, errno.ENOTSUP, errno.EOPNOTSUPP):
            raise
    finally:
        with contextlib.suppress(OSError):  # A failure to close loses nothing
            os.close(handle)


LONGEST_NAME = 255  # Largest number of bytes of a file's name that file systems accept

# Largest number of bytes of `run.json`, which holds the scene with only the lengths of long lists
MOST_HEADER = 1 << 27

MOST_BLOCK = 1 << 32  # Largest number of bytes of the values of a block whose size is not known

MOST_OTHER = 1 << 20  # Largest number of bytes of a block besides its values

_HEADER, _LOCK, _ARCHIVE, _ADDED, _ENDING = "run.json", "lock", "archive.nc", "added.nc", ".new"
_SCENE, _TRIED = "scene.bin", "tried"
_MAGIC = b"engine-dyn block 1 "
_OWN = re.compile(
    rf"({_HEADER}|{_LOCK}|{_ARCHIVE}|{_ADDED}|{_SCENE}|{_TRIED}|block-\d{{6,}}\.bin)"
    rf"((\.[0-9a-f]{{8}})?{re.escape(_ENDING)})?"
)


class Damaged(Exception):
    """A block that is not what was written."""


class Partial:
    """The folder of one unfinished archive."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.key = ""

    @classmethod
    def of(cls, output: Path) -> Partial:
        """Return the folder that belongs to an archive; of a long name, its start and its hash."""
        name = f"{output.name}.partial"
        if len(os.fsencode(name)) > LONGEST_NAME:
            digest = hashlib.sha256(os.fsencode(output.name)).hexdigest()[:16]
            start = os.fsencode(output.name)[: LONGEST_NAME - 40].decode(errors="ignore")
            name = f"{start}.{digest}.partial"
        return cls(output.with_name(name))

    @property
    def archive(self) -> Path:
        """The file in which the archive is put together."""
        return self.path / _ARCHIVE

    @property
    def added(self) -> Path:
        """The archive of the points that `extend` adds."""
        return self.path / _ADDED

    def adding(self) -> Partial:
        """Folder of the points that `extend` adds, while they are being computed."""
        return Partial.of(self.added)

    def has_added_points(self) -> bool:
        """Whether any of the points that `extend` adds are finished."""
        return self.added.exists() or bool(self.adding().finished())

    # --- the run --------------------------------------------------------------------------------

    @contextlib.contextmanager
    def locked(self, output: Path) -> Iterator[None]:
        """Lock the folder for this process; it is created where it does not exist.

        After a failure of what is done meanwhile, the folder is given up. A folder that another
        process has locked, and a name that belongs to something else, are refused.
        """
        if self.path.is_symlink() or (self.path.exists() and not self.path.is_dir()):
            raise SceneError(
                f"{self.path}: exists, but is not a folder of its own; a run needs this name "
                "for the folder of its finished blocks"
            )
        while True:
            made_folder(self.path)
            try:
                stream = _opened_lock(self.path / _LOCK)
            except FileNotFoundError:  # Another run has just removed its folder
                continue
            with _closed_at_the_end(stream):
                if not _lock(stream):
                    raise SceneError(
                        f"{output}: only one run can write to an output at a time, and another "
                        f"run is writing to it ({_holder(stream) or 'it holds the lock'}); wait "
                        "until it ends, or choose another output"
                    )
                if not _is(stream, self.path / _LOCK):
                    continue
                # The text is only shown to runs that find the folder locked: it may fail to be
                # written.
                with contextlib.suppress(OSError):
                    os.ftruncate(stream.fileno(), 0)
                    os.write(
                        stream.fileno(), f"process {os.getpid()} on {platform.node()}".encode()
                    )
                try:
                    yield
                except BaseException:
                    # The folder is removed, unless that has been done already.
                    if _is(stream, self.path / _LOCK):
                        self.give_up()
                    raise
                return

    def writer(self) -> str:
        """The process that is writing here now, such as "process 7 on host"; empty for none."""
        try:
            stream = _opened_lock(self.path / _LOCK, create=False)
        except OSError:
            return ""
        with _closed_at_the_end(stream):
            return "" if _lock(stream) else _holder(stream) or "another process"

    def header(self) -> dict[str, Any] | None:
        """Header of the run in this folder; None where nothing has begun.

        A disk that cannot be read raises OSError: the blocks may be sound all the same.
        """
        try:
            data = regular_bytes(self.path / _HEADER, MOST_HEADER)
            header = json.loads(data.decode("utf-8", "surrogateescape"))
        except (ValueError, RecursionError):
            return None
        except OSError as error:
            if error.errno in (errno.ENOENT, errno.EFBIG, *NAMED_BADLY):
                return None
            raise
        if not isinstance(header, dict) or not all(
            key in header and right(header[key]) for key, right in _MEMBERS.items()
        ):
            return None
        self.key = header["key"]
        return header

    def begin(self, header: Mapping[str, Any]) -> None:
        """Say what is computed here, before the first block."""
        text = json.dumps(header, ensure_ascii=False, sort_keys=True)
        self.key = hashlib.sha256(text.encode("utf-8", "surrogateescape")).hexdigest()
        keyed = json.dumps({**header, "key": self.key}, ensure_ascii=False, indent=1)
        self._write(_HEADER, [keyed.encode("utf-8", "surrogateescape")])

    def clear(self) -> None:
        """Remove the blocks and all else but the folder and its lock."""
        # The header goes last: without it, blocks belong to no run.
        if not self.path.is_dir():
            return
        for path in sorted(self.path.iterdir(), key=lambda p: p.name == _HEADER):
            if path.name == f"{_ADDED}.partial" and not path.is_symlink():
                Partial(path).remove()
            elif path.name != _LOCK and _OWN.fullmatch(path.name):
                path.unlink()

    def remove(self) -> None:
        """Remove the folder, unless there are other people's files in it."""
        self.clear()
        with contextlib.suppress(OSError):
            (self.path / _LOCK).unlink(missing_ok=True)
            self.path.rmdir()

    def give_up(self) -> bool:
        """Remove the folder after a failure, unless something finished is in it; returns that."""
        with contextlib.suppress(OSError):
            if self.finished() or self.has_added_points():
                return True
            self.remove()
        return False

    # --- blocks ---------------------------------------------------------------------------------

    def finished(self) -> list[int]:
        """Numbers of the finished blocks, in order; whether they are damaged is not checked."""
        if not self.path.is_dir():
            return []
        block = re.compile(r"block-(\d{6,})\.bin")
        matches = (block.fullmatch(path.name) for path in self.path.iterdir())
        return sorted(int(match.group(1)) for match in matches if match)

    def write(self, number: int, arrays: Mapping[str, npt.NDArray[Any]]) -> int:
        """Write a finished block; returns the bytes of its values."""
        return self._write_arrays(_name(number), {"number": number}, arrays)

    def read(self, number: int, most: int = MOST_BLOCK) -> dict[str, npt.NDArray[Any]]:
        """Arrays of a finished block, whose values may take at most `most` bytes.

        Raises
        ------
        Damaged
            Where it does not exist, or is not what was written.
        """
        about, arrays = self._read_arrays(_name(number), most)
        if about.get("number") != number:
            raise Damaged(f"{self.path / _name(number)}: belongs to another block")
        return arrays

    def write_scene(
        self, about: Mapping[str, Any], columns: Mapping[str, npt.NDArray[Any]]
    ) -> None:
        """Write what is computed: JSON's types, and columns of numbers."""
        self._write_arrays(_SCENE, {"scene": about}, columns)

    def read_scene(self) -> tuple[dict[str, Any], dict[str, npt.NDArray[Any]]]:
        """The scene that `write_scene` wrote; errors are those of `read`."""
        about, columns = self._read_arrays(_SCENE, MOST_BLOCK)
        if not isinstance(about.get("scene"), dict):
            raise Damaged(f"{self.path / _SCENE}: not in the form that a run writes")
        return about["scene"], columns

    def _write_arrays(
        self, name: str, about: Mapping[str, Any], arrays: Mapping[str, npt.NDArray[Any]]
    ) -> int:
        table, buffers, size = [], [], 0
        for array_name, array in arrays.items():
            plain = np.ascontiguousarray(array, dtype=array.dtype.newbyteorder("<"))
            table.append([array_name, plain.dtype.str, list(array.shape)])
            buffers.append(plain.reshape(-1).view(np.uint8).data)
            size += plain.nbytes
        line = json.dumps({"run": self.key, **about, "arrays": table}).encode() + b"\n"
        digest = hashlib.sha256(line)
        for buffer in buffers:
            digest.update(buffer)
        first = _MAGIC + digest.hexdigest().encode() + b"\n"
        self._write(name, [first, line, *buffers])
        return size

    def _read_arrays(
        self, name: str, most: int
    ) -> tuple[dict[str, Any], dict[str, npt.NDArray[Any]]]:
        path = self.path / name
        try:
            data = regular_bytes(path, most + MOST_OTHER)
        except OSError as error:
            raise Damaged(f"{path}: cannot be read ({one_line(error.strerror)})") from None
        first = data.find(b"\n") + 1
        second = data.find(b"\n", first) + 1
        body = memoryview(data)[first:]
        right = _MAGIC + hashlib.sha256(body).hexdigest().encode() + b"\n"
        if not first or not second or data[:first] != right:
            raise Damaged(f"{path}: damaged")
        # Types of the numbers in blocks and columns.
        kinds = {kind: kind for kind in ("<f8", "<f4", "<i8", "|i1", "|b1")}
        try:
            about = json.loads(bytes(body[: second - first]))
            if about["run"] != self.key:
                raise Damaged(f"{path}: belongs to another run")
            arrays: dict[str, npt.NDArray[Any]] = {}
            for array_name, kind, shape in about["arrays"]:
                dtype = np.dtype(kinds[kind])
                count = math.prod(shape)
                arrays[array_name] = np.frombuffer(data, dtype, count, second).reshape(shape)
                second += count * dtype.itemsize
        except (ValueError, KeyError, TypeError, OverflowError, RecursionError):
            # The hash is right, but another program has written the block.
            raise Damaged(f"{path}: not in the form that a run writes") from None
        return about, arrays

    def discard(self, number: int) -> None:
        """Remove a block."""
        (self.path / _name(number)).unlink(missing_ok=True)

    def try_writing(self) -> None:
        """Write a file and remove it; OSError where that is not possible."""
        self._write(_TRIED, [b"tried"])
        (self.path / _TRIED).unlink(missing_ok=True)

    def tidy(self) -> None:
        """Remove the unfinished files of writers that were killed."""
        for path in self.path.iterdir():
            if path.name.endswith(_ENDING) and _OWN.fullmatch(path.name):
                path.unlink(missing_ok=True)

    def _write(self, name: str, buffers: list[Any]) -> None:
        # Each writer has a temporary name of its own: a worker that was taken for lost may still
        # write the same block.
        new = self.path / f"{name}.{secrets.token_hex(4)}{_ENDING}"
        try:
            new.unlink(missing_ok=True)  # A link in this place would lead the writing elsewhere
            with new.open("xb") as stream:
                for buffer in buffers:
                    stream.write(buffer)
                stream.flush()
                os.fsync(stream.fileno())
            new.replace(self.path / name)
        except BaseException:
            with contextlib.suppress(OSError):
                new.unlink(missing_ok=True)
            raise
        sync_folder(self.path)


def _name(number: int) -> str:
    return f"block-{number:06d}.bin"


def _whole(value: Any) -> bool:
    return isinstance(value, int) and not isinstance(value, bool) and 0 < value < 1 << 62


def _text(value: Any) -> bool:
    return isinstance(value, str)


_MEMBERS: Mapping[str, Callable[[Any], bool]] = {
    "identity": lambda value: isinstance(value, dict),
    "lengths": lambda value: isinstance(value, dict) and all(map(_whole, value.values())),
    "blocks": _whole,
    "block_bytes": lambda value: isinstance(value, int | float) and 0.0 < value < math.inf,
    "designs": _whole,
    "key": _text,
    "title": _text,
    "output": _text,
    "command_line": _text,
    "started": _text,
}
"""Entries that `run.json` must hold, each with its check; without them it counts as empty."""


def _opened_lock(path: Path, *, create: bool = True) -> IO[str]:
    """Open the file of the lock itself, and not the target of a link in its place."""
    flags = os.O_RDWR | os.O_APPEND | (os.O_CREAT if create else 0)
    flags |= getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_NONBLOCK", 0)
    handle = os.open(path, flags, 0o666)
    if not stat.S_ISREG(os.fstat(handle).st_mode):
        os.close(handle)
        raise OSError(errno.EINVAL, "the lock is not a regular file", str(path))
    return os.fdopen(handle, "a+", encoding="utf-8")


@contextlib.contextmanager
def _closed_at_the_end(stream: IO[str]) -> Iterator[None]:
    """Close the file of the lock; nothing is lost where that fails."""
    try:
        yield
    finally:
        with contextlib.suppress(OSError):
            stream.close()


def _holder(stream: IO[str]) -> str:
    """Text that the process with the lock wrote into its file."""
    stream.seek(0)
    return one_line(stream.read(200))


def _lock(stream: IO[str]) -> bool:
    """Lock a file until its process ends; False where another one has it."""
    try:
        import fcntl
    except ImportError:
        return _lock_on_windows(stream)
    try:
        fcntl.flock(stream.fileno(), fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    except OSError:  # On a file system without locks a run is better than a refusal
        return True
    return True


def _lock_on_windows(stream: IO[str]) -> bool:
    import msvcrt

    windows: Any = msvcrt
    try:
        # The lock covers a byte far behind the text, because others cannot read locked bytes.
        stream.seek(1 << 30)
        windows.locking(stream.fileno(), windows.LK_NBLCK, 1)
    except OSError:
        return False
    return True


def _is(stream: IO[str], path: Path) -> bool:
    """Whether an open file is still the file of a name."""
    try:
        return os.path.samestat(os.fstat(stream.fileno()), path.stat())
    except OSError:
        return False
