"""The decorators of compiled functions, where these are kept on disk, and when Numba compiles.

Besides this module, only arrays and vectors of kernels and the card import Numba.

With ``NUMBA_DISABLE_JIT=1`` the decorators leave plain Python. Each function is kept in an archive,
which is replaced as a whole. Numba looks only at the file that holds a function: it serves stale
code after an edit in one that it calls (numba#1833, #9483). Its index may mix up what processes
write at once (numba#4807, #10128). So it works in a folder of one process, and what it leaves there
becomes an archive, whose name has a hash of all that determines the code.
"""

from __future__ import annotations

import functools
import hashlib
import logging
import os
import re
import shutil
import sys
import tempfile
import threading
import time
import uuid
import zipfile
from collections.abc import Callable
from contextlib import suppress
from functools import cache
from importlib.metadata import version
from multiprocessing.util import Finalize
from pathlib import Path
from typing import Any

_VERSIONS = ", ".join(f"{name} {version(name)}" for name in ("numba", "llvmlite", "numpy"))
_ROOT = Path(__file__).parents[1]

# Sources are read on import: this process runs the code of that moment, whatever is edited later.
_SOURCES = {
    ".".join(path.relative_to(_ROOT).with_suffix("").parts).removesuffix(".__init__"): (
        path.read_text(encoding="utf-8")
    )
    for path in sorted(_ROOT.glob("engine_dyn/**/*.py"))
}

_IMPORT = re.compile(r"^[ \t]*(?:from|import) (engine_dyn[\w.]*)(?: import (\([^)]*\)|.*))?", re.M)
_imports = cache(lambda text: _IMPORT.findall(re.sub("#.*", "", text)))


def imported(text: str) -> dict[str, str]:
    """Modules that a source imports, directly or not; packages where other names come from them."""
    sources: dict[str, str] = {}
    waiting = [text]
    while waiting:
        for module, words in _imports(waiting.pop()):
            inner = [f"{module}.{word}" for word in re.findall(r"\w+", words)] or [module]
            names = {name if name in _SOURCES else module for name in inner} & _SOURCES.keys()
            waiting += [_SOURCES[name] for name in names - sources.keys()]
            sources |= {name: _SOURCES[name] for name in names}
    return dict(sorted(sources.items()))


@cache
def source_hash() -> str:
    """Hash of all sources of this package and of the versions that compile them."""
    return hashlib.sha256(repr((_SOURCES, _VERSIONS)).encode()).hexdigest()


def archive_of(function: Callable[..., Any]) -> Path:
    """Archive of a function, in a folder of this user alone: what lies there is executed."""
    named = map(os.environ.get, ("NUMBA_CACHE_DIR", "XDG_CACHE_HOME"))
    folder = Path(next(filter(None, named), Path.home() / ".cache"), "engine-dyn")
    folder.mkdir(mode=0o700, parents=True, exist_ok=True)
    about = folder.stat()
    if hasattr(os, "getuid") and (about.st_uid != os.getuid() or about.st_mode & 0o022):
        raise PermissionError(f"{folder}: others may write to it")
    code = function.__code__
    text = _SOURCES.get(function.__module__) or Path(code.co_filename).read_text(encoding="utf-8")
    machine = _VERSIONS, sys.version, processor(), processor_features()
    key = repr((code.co_filename, code.co_firstlineno, text, imported(text), machine)).encode()
    return folder / f"{function.__qualname__}-{hashlib.sha256(key).hexdigest()[:32]}.zip"


def unpacked(archive: Path) -> str:
    """Folder that this process alone has, with what is in an archive that is there and whole."""
    folder = tempfile.mkdtemp(prefix="engine-dyn-")
    Finalize(None, shutil.rmtree, (folder, True), exitpriority=0)  # not run in forks
    whole = False
    with suppress(Exception), zipfile.ZipFile(archive) as content:
        os.utime(archive)
        whole = content.testzip() is None  # after a crash of the system a file may be full of zeros
    if whole:
        shutil.unpack_archive(archive, folder)
    return folder


def pack(folder: str, archive: Path) -> None:
    """Replace an archive by what is in a folder; remove those that nobody used for 60 days."""
    made = f"{archive}.{uuid.uuid4().hex}"
    try:
        os.replace(shutil.make_archive(made, "zip", folder), archive)
        for other in archive.parent.iterdir():
            with suppress(FileNotFoundError):  # another process may have removed the file already
                if other.stat().st_mtime < time.time() - 60 * 86400:
                    other.unlink()
    except (OSError, ValueError) as error:  # zipfile raises ValueError for a clock before 1980
        not_kept(error)
        with suppress(OSError):
            os.unlink(f"{made}.zip")


# Rounding may differ from strict IEEE order; NaN and infinity keep their meaning (numba#2919).
OPTIONS: dict[str, Any] = {
    "nogil": True, "fastmath": {"reassoc", "contract", "nsz", "arcp", "afn"},
    "error_model": "numpy",
}  # fmt: skip


class _Compiled:
    """A function for Python and for kernels, compiled for each of them at its first call."""

    _lock, _process = threading.Lock(), 0
    _kept: tuple[str, Path] | None = None

    def __init__(self, function: Callable[..., Any]) -> None:
        functools.update_wrapper(self, function)
        self.py_func = function

    @functools.cached_property
    def part(self) -> Any:
        """The arrays that kernels see in its place."""
        import numba

        # A kernel has all that it calls inlined: otherwise new and cached functions would be
        # optimised together or apart, and last digits would differ. Without the wrappers for
        # Python, compiling takes a sixth less time.
        wrapped = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}
        return numba.njit(**{"forceinline": True, **wrapped, **OPTIONS})(self.py_func)

    def __call__(self, *given: Any) -> Any:
        # So it is at the first call, and in a forked process, whose folder is another.
        if self._process != os.getpid():
            with self._lock:
                if self._process != os.getpid():
                    self._whole, self._process = self._made(), os.getpid()
        before = seconds_compiling()
        try:
            result = self._whole(*given)
        except OSError as error:  # a full disk stops Numba's cache after compiling
            not_kept(error)
            result = self._whole(*given)
        if self._kept is not None and seconds_compiling() != before:
            pack(*self._kept)
        return result

    def _made(self) -> Any:
        import numba
        from numba.core import config
        from numba.extending import typeof_impl

        if _Compiled not in typeof_impl.registry:
            typeof_impl.register(_Compiled)(lambda compiled, _: numba.typeof(compiled.part))
        listen_for(self.py_func)
        # Newer versions of Numba have the second key, and might take another folder without it.
        ours = {"CACHE_DIR": "", "CACHE_LOCATOR_CLASSES": "UserProvidedCacheLocator"}
        before = {name: getattr(config, name, "") for name in ours}
        try:
            archive = archive_of(self.py_func)
            self._kept = unpacked(archive), archive
            vars(config).update(ours, CACHE_DIR=self._kept[0])
            return numba.njit(cache=True, **OPTIONS)(self.py_func)
        except (OSError, RuntimeError) as error:
            not_kept(error)
            self._kept = None
            return numba.njit(**OPTIONS)(self.py_func)
        finally:
            vars(config).update(before)


if hasattr(os, "register_at_fork"):  # a forked process lacks the thread that may hold the lock
    os.register_at_fork(after_in_child=lambda: setattr(_Compiled, "_lock", threading.Lock()))


def kernel(function: Callable[..., Any]) -> Any:
    """Compile a function without the interpreter lock, for Python to call; kept on disk."""
    return _Compiled(function) if COMPILED else function


inlined = formula = kernel
"""Decorators of functions that kernels call, and Python in tests; formulas take numbers only."""

COMPILING = "compiling kernels for this kind of scene (once; later runs of the kind start at once)"

COMPILED = os.environ.get("NUMBA_DISABLE_JIT", "0") in {"", "0"}
"""False with ``NUMBA_DISABLE_JIT=1``: kernels are then plain Python functions."""


def processor() -> str:
    """Kind of processor that kernels are compiled for: where it is the same, so are all bits."""
    from llvmlite import binding
    from numba.core import config

    return str(vars(config)["CPU_NAME"] or binding.get_host_cpu_name())


def processor_features() -> tuple[str, ...]:
    """Instructions that kernels may use, sorted: a virtual machine may have fewer than its kind."""
    from llvmlite import binding
    from numba.core import config

    chosen = vars(config)["CPU_FEATURES"]
    features = binding.get_host_cpu_features().flatten() if chosen is None else chosen
    return tuple(sorted(f[1:] for f in features.split(",") if f.startswith("+")))


_functions: set[Callable[..., Any]] = set()
_said: set[str] = set()
_tell = [lambda: logging.getLogger("engine_dyn").warning(COMPILING)]


@cache
def _listener() -> Any:
    """Measure the time of compiling this package's functions; nested compilations count once."""
    from numba.core import event

    class Listener(event.TimingListener):
        def notify(self, event: Any) -> None:  # Numba compiles in one thread at a time
            if event.data["dispatcher"].py_func in _functions:
                if "compiling" not in _said:
                    _said.add("compiling")
                    _tell[0]()
                super().notify(event)

    listener = Listener()
    event.register("numba:compile", listener)
    return listener


def listen_for(function: Callable[..., Any]) -> None:
    """Announce the compilation of a function; until the first one, Numba is left as it is."""
    _functions.add(function)
    _listener()


def seconds_compiling() -> float:
    """Seconds that this process has spent compiling kernels so far."""
    return float(_listener().duration) if _functions and _listener().done else 0.0


def on_compiling(tell: Callable[[], None]) -> None:
    """Call `tell` once, when the first kernel has to be compiled; else the logger warns of it."""
    _tell[0] = tell


def not_kept(error: Exception) -> None:
    """Say once, through the logger, that compiled kernels cannot be kept on disk."""
    if "not kept" not in _said:
        _said.add("not kept")
        text = "compiled kernels cannot be cached (%s): later runs will compile them again"
        logging.getLogger("engine_dyn").warning(text, error)
