"""Where compiled kernels are kept on disk.

The cache is keyed by a hash of every source file of `engine_dyn`, because Numba itself looks only
at the file that holds the function and does not notice an edit in a file that it calls
(numba#1833, #9483).
"""

from __future__ import annotations

import contextlib
import hashlib
import itertools
import os
import pickle
import platform
import tempfile
from functools import cache
from pathlib import Path
from typing import Any

import llvmlite
import numba
from numba.core import caching

from engine_dyn.compilation.announcing import not_kept
from engine_dyn.compilation.settings import COMPILED, NUMBA

__all__ = ["hash_of_sources", "keep_on_disk", "own_cache", "source_hash"]

# The folder of engine_dyn itself, so that every room of the package is covered.
_PACKAGE = Path(__file__).parents[1]

DIGEST_BYTES = hashlib.sha256().digest_size


def hash_of_sources(folder: Path) -> str:
    """Hash of every Python source below a folder, at any depth, and of the compiler's versions."""
    digest = hashlib.sha256()
    for path in sorted(folder.rglob("*.py")):
        digest.update(path.relative_to(folder).as_posix().encode() + b"\0")
        digest.update(hashlib.sha256(path.read_bytes()).digest())
    digest.update(f"numba {numba.__version__}, llvmlite {llvmlite.__version__}".encode())
    return digest.hexdigest()


@cache
def source_hash() -> str:
    """Hash of all sources of this package and of the versions that compile them."""
    return hash_of_sources(_PACKAGE)


# Numba documents no cache classes. Where a version lacks these, kernels are compiled in every
# process: Numba's plain cache would serve stale code after an edit in another file.
_FunctionCache: Any = getattr(caching, "FunctionCache", object)
_IndexDataCacheFile: Any = getattr(caching, "IndexDataCacheFile", object)


class _Files(_IndexDataCacheFile):
    """The files of one kernel. What another version has left, or is damaged, is not there.

    Numba compares the hash of the sources only after it has unpickled the index, which fails where
    another version's index names a module that exists no more. It takes the version of itself from
    the beginning of the file, so the hash is made a part of that.
    """

    def __init__(self, path: str, name: str) -> None:
        super().__init__(path, name, source_hash())
        self._version = f"{numba.__version__} {source_hash()}"

    def _load_index(self) -> Any:
        try:
            return super()._load_index()
        except Exception:  # whatever unpickling stumbles over
            return {}

    def load(self, key: Any) -> Any:
        try:
            return super().load(key)
        except Exception:
            return None

    def _save_data(self, name: str, data: Any) -> None:
        """Put a digest before the machine code: a crash of the system may leave zeros in a file."""
        content = self._dump(data)
        with self._open_for_write(self._data_path(name)) as file:
            file.write(hashlib.sha256(content).digest() + content)

    def _load_data(self, name: str) -> Any:
        with open(self._data_path(name), "rb") as file:
            digest, content = file.read(DIGEST_BYTES), file.read()
        if hashlib.sha256(content).digest() != digest:
            raise ValueError(f"{name}: damaged")
        return pickle.loads(content)


class _Cache(_FunctionCache):
    """Numba's cache of one kernel, in Numba's own places, stamped with the hash of all sources.

    Once it has a place of its own, the shared one is only read.
    """

    def __init__(self, function: Any) -> None:
        super().__init__(function)
        self._shared: Any = None
        self._open(self._cache_path)

    def _open(self, path: str) -> None:
        self._cache_file = _Files(path, self._impl.filename_base)

    def keep_in(self, folder: str) -> None:
        """Write into a folder of this process from now on."""
        locator: Any = self._impl.locator
        if self._shared is None:
            self._shared = self._cache_file
        path = os.path.join(folder, locator.get_suitable_cache_subpath(locator._py_file))
        self._cache_path = locator._cache_path = path
        self._open(path)

    def save_overload(self, signature: Any, data: Any) -> None:
        """Keep a kernel, which no run needs: a full disk must not end the run that compiled it."""
        try:
            super().save_overload(signature, data)
        except OSError as error:
            not_kept(self._cache_path, error)

    def _load_overload(self, signature: Any, context: Any) -> Any:
        found = super()._load_overload(signature, context)
        if found is None and self._shared is not None:
            own, self._cache_file = self._cache_file, self._shared
            try:
                # Another process may be writing it, on a file system that many machines share.
                with contextlib.suppress(OSError):
                    found = super()._load_overload(signature, context)
            finally:
                self._cache_file = own
        return found


_caches: list[_Cache] = []
_own: list[Any] = []


def keep_on_disk(dispatcher: Any) -> None:
    """Give a kernel its cache; without a writable folder it is compiled in every process."""
    # RuntimeError: no folder. The others: a version of Numba whose cache is made otherwise.
    with contextlib.suppress(RuntimeError, AttributeError, TypeError):
        made = _Cache(dispatcher.py_func)
        if _own:
            made.keep_in(_own[0])
        dispatcher._cache = made
        _caches.append(made)


def own_cache() -> str:
    """Keep what this process compiles in a folder that no other process uses; return that folder.

    Numba's cache may mix up two kernels when several processes write to it at once (numba#4807,
    #10128). Folders stay for later processes: each takes the first that is free, for its lifetime.
    What is in the usual cache is used from there. Empty where the compiler is off.
    """
    if not COMPILED:
        return ""
    if not _own:
        folder, lock = _free_folder()
        _own.extend((folder, lock))
        for cached in _caches:
            cached.keep_in(folder)
    return str(_own[0])


def _free_folder() -> tuple[str, Any]:
    """Take a folder for compiled kernels, and the open lock that keeps others away."""
    try:
        import fcntl

        base = NUMBA.CACHE_DIR
        if not base:
            base = os.path.join(tempfile.gettempdir(), f"engine-dyn-{os.getuid()}")
            os.makedirs(base, mode=0o700, exist_ok=True)
            about = os.lstat(base)
            # Compiled code is executed, so a folder that others may write to is refused.
            if about.st_uid != os.getuid() or about.st_mode & 0o077 or os.path.islink(base):
                raise OSError(f"{base}: not a folder of this user alone")
        for number in itertools.count():
            folder = os.path.join(base, f"{platform.node()}-{number}")
            os.makedirs(folder, mode=0o700, exist_ok=True)
            lock = open(os.path.join(folder, "lock"), "a")  # noqa: SIM115
            try:
                fcntl.flock(lock.fileno(), fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                lock.close()
                continue
            return folder, lock
    except (ImportError, OSError):  # no locks here: each process compiles kernels again
        pass
    passing = tempfile.TemporaryDirectory(prefix="engine-dyn-")
    return passing.name, passing
