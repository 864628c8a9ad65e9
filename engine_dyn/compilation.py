"""The one place that knows Numba's flags and where compiled kernels are kept.

Kernels compile when first called, never on import. Compiled code is cached on disk; the cache is
keyed by a hash of every source file of this package, because Numba itself only looks at the file
that holds the function and would not see an edit in a file it calls (numba#1833, #9483).
"""

from __future__ import annotations

import contextlib
import hashlib
import itertools
import os
import pickle
import platform
import tempfile
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numba
import numpy as np
import numpy.typing as npt
from numba.core import caching, cgutils, codegen, event, types
from numba.core.errors import RequireLiteralValue
from numba.extending import intrinsic
from numba.np import arrayobj

__all__ = [
    "FAST_MATH",
    "formula",
    "indices_on_stack",
    "inlined",
    "kernel",
    "on_compiling",
    "on_stack",
    "own_cache",
    "processor",
    "processor_features",
    "source_hash",
    "threading_layer",
    "wide_vectors",
]

FAST_MATH = {"reassoc", "contract", "nsz", "arcp", "afn"}
"""Rounding may differ from strict IEEE order; NaN and infinity keep their meaning (numba#2919)."""

# Neither exports all that it has.
_codegen: Any = codegen
_numba: Any = numba

_OPTIONS: dict[str, Any] = {"nogil": True, "fastmath": FAST_MATH, "error_model": "numpy"}


@cache
def source_hash() -> str:
    """Hash of all sources of this package and of the versions that compile them."""
    digest = hashlib.sha256()
    folder = Path(__file__).parent
    for path in sorted(folder.rglob("*.py")):
        digest.update(str(path.relative_to(folder)).encode())
        digest.update(path.read_bytes())
    digest.update(f"{numba.__version__} {sorted(FAST_MATH)}".encode())
    return digest.hexdigest()


def processor() -> str:
    """Kind of processor that kernels are compiled for: where it is the same, so are all bits."""
    return str(_settings.CPU_NAME or _codegen.ll.get_host_cpu_name())


def processor_features() -> tuple[str, ...]:
    """Instructions that kernels may use, sorted: a virtual machine may have fewer than its kind."""
    chosen = _settings.CPU_FEATURES
    features = _codegen.get_host_cpu_features() if chosen is None else chosen
    return tuple(sorted(f[1:] for f in features.split(",") if f.startswith("+")))


def threading_layer() -> str:
    """Numba's threading layer, where one is in use; kernels of this package need none."""
    try:
        return str(_numba.threading_layer())
    except ValueError:  # none was started
        return "none; kernels run on a pool of threads"


def _link_privately() -> None:
    """Give every kernel its own copy of what it calls, whoever else calls that.

    Numba links the functions that a kernel calls as weak symbols, which the loader resolves to the
    first copy in the process: with kernels just compiled, that is another one, optimised apart from
    its caller, than with kernels from the cache, and the last digit of a result could tell them
    apart. Only what belongs to kernels of this package is changed.
    """
    library: Any = codegen.CPUCodeLibrary
    optimize = library._optimize_final_module
    own = f"{len(_PACKAGE)}{_PACKAGE}"  # as mangled names have it

    def optimize_alone(self: Any) -> None:
        linkage = _codegen.ll.Linkage
        defined = [f for f in self._final_module.functions if not f.is_declaration]
        kernels = [f.name for f in defined if f.linkage == linkage.external and own in f.name]
        if kernels:
            # Under names of their own too: the loader finds even private functions by name, and
            # private ones may take other arguments than those that everybody calls.
            tag = hashlib.sha256("".join(sorted(kernels)).encode()).hexdigest()[:16]
            for function in defined:
                # What counts references is known to Numba's passes by its name.
                counts = function.name.startswith("NRT_")
                if function.linkage == linkage.linkonce_odr and not counts:
                    function.linkage = linkage.internal
                    function.name = f"{function.name}.{tag}"
        optimize(self)

    library._optimize_final_module = optimize_alone


_PACKAGE = __name__.partition(".")[0]

if hasattr(codegen.CPUCodeLibrary, "_optimize_final_module"):
    _link_privately()


def _stamped(locator: Any) -> Any:
    """Return `locator` with the package's source hash as the stamp of a cached function."""

    def get_source_stamp(self: Any) -> str:
        return source_hash()

    return type(f"Stamped{locator.__name__}", (locator,), {"get_source_stamp": get_source_stamp})


# Numba's own places in Numba's own order: a folder named by NUMBA_CACHE_DIR, beside the source,
# the user's own folder.
_Implementation: Any = type(
    "_Implementation",
    (caching.CompileResultCacheImpl,),
    {"_locator_classes": [_stamped(locator) for locator in caching.CacheImpl._locator_classes]},
)


class _Cache(caching.FunctionCache):
    """Numba's cache of one kernel; with a place of its own it only reads what all share."""

    _impl_class = _Implementation
    _shared: Any = None

    def keep_in(self, folder: str) -> None:
        """Write into a folder of this process from now on."""
        locator: Any = self._impl.locator
        if self._shared is None:
            self._shared = self._cache_file
        path = os.path.join(folder, locator.get_suitable_cache_subpath(locator._py_file))
        self._cache_path = locator._cache_path = path
        name = self._impl.filename_base
        self._cache_file = caching.IndexDataCacheFile(path, name, source_hash())

    def _load_overload(self, signature: Any, context: Any) -> Any:
        found = super()._load_overload(signature, context)
        if found is None and self._shared is not None:
            own, self._cache_file = self._cache_file, self._shared
            try:
                # It may be in the hands of another process, on a file system of many machines.
                with contextlib.suppress(OSError, EOFError, pickle.PickleError):
                    found = super()._load_overload(signature, context)
            finally:
                self._cache_file = own
        return found


_caches: list[_Cache] = []
_own: list[Any] = []


def own_cache() -> str:
    """Keep what this process compiles in a folder that no other process uses; which one.

    Numba's cache may mix up two kernels when several processes write to it at once (numba#4807,
    #10128). Folders stay for later processes: each takes the first that is free, for its lifetime.
    What is in the usual cache is used from there. Empty where the compiler is off.
    """
    if not _compiled:
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

        base = _settings.CACHE_DIR
        if not base:
            base = os.path.join(tempfile.gettempdir(), f"engine-dyn-{os.getuid()}")
            os.makedirs(base, mode=0o700, exist_ok=True)
            about = os.lstat(base)
            # Compiled code is executed: what others may write to is of no use.
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
    except (ImportError, OSError):  # no locks here: kernels are compiled again by each process
        pass
    passing = tempfile.TemporaryDirectory(prefix="engine-dyn-")
    return passing.name, passing


def kernel(function: Callable[..., Any]) -> Any:
    """Compile a function without the interpreter lock, lazily, cached by the package's sources.

    With ``NUMBA_DISABLE_JIT=1`` the plain Python function comes back.
    """
    dispatcher: Any = numba.njit(**_OPTIONS)(function)
    if hasattr(dispatcher, "enable_caching"):
        # Without any writable folder, kernels are compiled every time.
        with contextlib.suppress(RuntimeError):
            dispatcher._cache = _Cache(dispatcher.py_func)
            _caches.append(dispatcher._cache)
            if _own:
                dispatcher._cache.keep_in(_own[0])
    return dispatcher


def inlined(function: Callable[..., Any]) -> Any:
    """Compile a function that only other kernels call; it needs no cache."""
    return numba.njit(**_OPTIONS)(function)


def formula(function: Callable[..., Any]) -> Any:
    """Compile a small formula that is inlined wherever it is called, so that loops become vectors.

    The compiler by itself leaves a formula that is called often to a call.
    """
    return numba.njit(forceinline=True, **_OPTIONS)(function)


def on_compiling(tell: Callable[[], None]) -> None:
    """Call `tell` once, when the first kernel of this process has to be compiled."""

    class Listener(event.Listener):
        told = False

        def on_start(self, event: Any) -> None:
            if not self.told:
                self.told = True
                tell()

        def on_end(self, event: Any) -> None:
            pass

    event.register("numba:compile", Listener())


def _stack_of(kind: Any) -> Callable[..., Any]:
    array = types.Array(kind, 1, "C")

    def on_stack(typing: Any, size: Any) -> Any:
        if not isinstance(size, types.IntegerLiteral):
            raise RequireLiteralValue(size)

        def build(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            made = arrayobj.make_array(array)(context, builder)
            pointer = cgutils.alloca_once(
                builder, context.get_value_type(kind), size=size.literal_value
            )
            width = context.get_constant(types.intp, 8)
            arrayobj.populate_array(
                made, data=pointer, shape=[arguments[0]], strides=[width], itemsize=width,
                meminfo=None,
            )  # fmt: skip
            return made._getvalue()

        return array(size), build

    return on_stack


def _wide(typing: Any) -> Any:
    def build(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        # llvmlite's own set knows attributes without values only; it prints what it holds.
        set.add(builder.function.attributes, '"prefer-vector-width"="512"')
        return context.get_dummy_value()

    return types.none(), build


def _empty(size: int) -> npt.NDArray[np.float64]:
    return np.empty(size)


def _empty_indices(size: int) -> npt.NDArray[np.int64]:
    return np.empty(size, dtype=np.int64)


_settings: Any = numba.config
_compiled = not _settings.DISABLE_JIT
on_stack: Any = intrinsic(_stack_of(types.float64)) if _compiled else _empty
"""Array of a constant number of floats, for kernels: a loop that writes to it and reads other
arrays at places of its own can become vectors, because nothing else can point there."""

indices_on_stack: Any = intrinsic(_stack_of(types.int64)) if _compiled else _empty_indices
"""The same of whole numbers."""

wide_vectors: Any = intrinsic(_wide) if _compiled else lambda: None
"""Says inside a kernel that its vectors should be as wide as the processor has them.

For some processors the compiler prefers half the width, which is meant for programs that use
vectors now and then; here they are all there is. Only the kernel that calls it is affected.
"""
