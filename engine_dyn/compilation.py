"""The one place that knows Numba's flags and where compiled kernels are kept.

Kernels compile when first called, never on import. Compiled code is cached on disk; the cache is
keyed by a hash of every source file of this package, because Numba itself only looks at the file
that holds the function and would not see an edit in a file it calls (numba#1833, #9483).
"""

from __future__ import annotations

import contextlib
import functools
import gc
import hashlib
import inspect
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
from llvmlite import ir
from numba import extending
from numba.core import caching, cgutils, codegen, event, targetconfig, types
from numba.core.errors import RequireLiteralValue
from numba.extending import intrinsic
from numba.np import arrayobj

from engine_dyn.types import Floats, Integers

__all__ = [
    "FAST_MATH",
    "SQUARE_SIDE",
    "by_type",
    "formula",
    "indices_on_stack",
    "inlined",
    "kernel",
    "on_compiling",
    "on_stack",
    "own_cache",
    "processor",
    "processor_features",
    "rows_on_stack",
    "source_hash",
    "threading_layer",
    "turn_eights",
    "turn_fours",
    "turn_pairs",
    "turn_square",
    "wide_vectors",
]

FAST_MATH = {"reassoc", "contract", "nsz", "arcp", "afn"}
"""Rounding may differ from strict IEEE order; NaN and infinity keep their meaning (numba#2919)."""

SQUARE_SIDE = 8
"""Numbers in a row of what `turn_square` transposes."""

# Neither exports all that it has.
_codegen: Any = codegen
_numba: Any = numba

# No references are counted inside kernels: the caller holds all arrays that it hands over, and each
# count is an atomic operation on memory that all threads share. So a kernel makes no arrays but
# those on its stack.
_OPTIONS: dict[str, Any] = {
    "nogil": True, "fastmath": FAST_MATH, "error_model": "numpy", "_nrt": False,
}  # fmt: skip


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


def _compile_as_parts() -> None:
    """Compile what only kernels call as parts of kernels, and no kernel with the parts of another.

    Two things that Numba does for functions that anybody may call do not suit functions that only
    kernels call. It makes machine code of each, which nobody runs, and optimises each by itself,
    which pays for loops only. And it links them as weak symbols, which the loader resolves to the
    first copy in the process: with kernels just compiled, that is another one, optimised apart from
    its caller, than with kernels from the cache, and the last digit of a result could tell them
    apart. So a kernel's copies are its own. Only what belongs to this package is changed.
    """
    library: Any = codegen.CPUCodeLibrary
    optimize, finish = library._optimize_final_module, library._finalize_final_module
    set_environment = _codegen.JITCPUCodegen.set_env
    own = f"{len(_PACKAGE)}{_PACKAGE}"  # as mangled names have it
    linkage = _codegen.ll.Linkage

    def defined_by(self: Any) -> tuple[list[Any], list[str]]:
        """All functions of a module, and the names of those of ours that others may call."""
        defined = [f for f in self._final_module.functions if not f.is_declaration]
        return defined, [f.name for f in defined if f.linkage == linkage.external and own in f.name]

    def is_part(names: list[str]) -> bool:
        return bool(names) and not any("7cpython" in name for name in names)

    def optimize_alone(self: Any) -> None:
        defined, names = defined_by(self)
        formulas = {f.name for f in defined if b"alwaysinline" in f.attributes}
        part = is_part(names)
        if part and formulas.issuperset(names):
            return
        if names and not part:
            # Under names of their own too: the loader finds even private functions by name, and
            # private ones may take other arguments than those that everybody calls.
            tag = hashlib.sha256("".join(sorted(names)).encode()).hexdigest()[:16]
            for function in defined:
                if function.linkage == linkage.linkonce_odr:
                    function.linkage = linkage.internal
                    function.name = f"{function.name}.{tag}"
        optimize(self)

    def finish_kernels(self: Any) -> None:
        if is_part(defined_by(self)[1]):
            self._finalize_dynamic_globals()
            self._finalized = True
        else:
            finish(self)

    def set_environment_of_kernels(self: Any, name: str, environment: Any) -> None:
        if self._engine.get_global_value_address(name):
            set_environment(self, name, environment)

    library._optimize_final_module = optimize_alone
    library._finalize_final_module = finish_kernels
    _codegen.JITCPUCodegen.set_env = set_environment_of_kernels


_PACKAGE = __name__.partition(".")[0]


class _WithoutCollector(event.Listener):
    """Keep the garbage collector still while Numba compiles, whatever it compiles.

    It would look through all that the compiler holds again and again: a tenth of the time.
    """

    depth = 0  # parts are compiled within their kernel; Numba compiles in one thread at a time
    enabled = False

    def on_start(self, event: Any) -> None:
        # Counted first: Numba tells the end of what was interrupted here too.
        self.depth += 1
        if self.depth == 1:
            self.enabled = gc.isenabled()
            gc.disable()

    def on_end(self, event: Any) -> None:
        self.depth = max(self.depth - 1, 0)
        if self.depth == 0 and self.enabled:
            gc.enable()
            self.enabled = False


def _compile_sooner() -> None:
    """Take away a quarter of the time that Numba takes beside LLVM.

    For each call in a kernel it looks its flags up by all their values, which it gets one by one
    through properties. They are the same together. That holds for all that this process compiles.
    """
    defaults: dict[type, dict[str, Any]] = {}

    def values(self: Any) -> dict[str, Any]:
        kind = type(self)
        if kind not in defaults:
            defaults[kind] = {name: option.default for name, option in kind.options.items()}
        return {**defaults[kind], **self._values}

    flags: Any = targetconfig.TargetConfig
    flags.values = values


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


# Another version of Numba may do without what is changed here; then all is compiled as it likes.
_MAY_BE_PARTS = all(
    hasattr(owner, name)
    for owner, name in (
        (codegen.CPUCodeLibrary, "_optimize_final_module"),
        (codegen.CPUCodeLibrary, "_finalize_final_module"),
        (codegen.CPUCodeLibrary, "_finalize_dynamic_globals"),
        (_codegen.JITCPUCodegen, "set_env"),
    )
)
if _MAY_BE_PARTS:
    _compile_as_parts()
if all(hasattr(targetconfig.TargetConfig(), name) for name in ("_values", "options", "values")):
    _compile_sooner()
event.register("numba:compile", _WithoutCollector())


def _part_of_kernels(function: Callable[..., Any], options: dict[str, Any]) -> Any:
    """Compile a function for kernels to call, without what Python needs to call it.

    Where Python calls it nevertheless, as tests do, it is compiled once more for that.
    """
    options |= _OPTIONS
    alone: Any = numba.njit(**options)(function)
    if not _MAY_BE_PARTS or not hasattr(alone, "add_overload"):
        return alone
    options |= {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}
    dispatcher: Any = numba.njit(**options)(function)

    def add_for_kernels(compiled: Any) -> None:
        dispatcher.overloads[tuple(compiled.signature.args)] = compiled

    resolve = dispatcher.get_call_template

    # Numba would compile it once for each constant that it is called with; where it ends up in its
    # kernel, LLVM knows the constant anyway.
    def resolve_for_any(arguments: Any, named: dict[str, Any]) -> Any:
        return resolve(
            [types.unliteral(kind) for kind in arguments],
            {name: types.unliteral(kind) for name, kind in named.items()},
        )

    dispatcher.get_call_template = resolve_for_any
    dispatcher.add_overload = add_for_kernels
    dispatcher._compile_for_args = alone._compile_for_args
    return dispatcher


def inlined(function: Callable[..., Any]) -> Any:
    """Compile a function that only other kernels call; it needs no cache.

    No argument is a literal inside: what Numba itself must know is told by length or dimensions.
    """
    return _part_of_kernels(function, {})


def formula(function: Callable[..., Any]) -> Any:
    """Compile a small formula that is inlined wherever it is called, so that loops become vectors.

    The compiler by itself leaves a formula that is called often to a call. No argument is a literal
    inside, but constants are known to LLVM.
    """
    return _part_of_kernels(function, {"forceinline": True})


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
            pointer.align = 64  # else most wide loads and stores reach into two lines of the cache
            width = context.get_constant(types.intp, 8)
            arrayobj.populate_array(
                made, data=pointer, shape=[arguments[0]], strides=[width], itemsize=width,
                meminfo=None,
            )  # fmt: skip
            return made._getvalue()

        return array(size), build

    return on_stack


def _rows(typing: Any, size: Any) -> Any:
    array = types.Array(types.float64, 1, "C")

    def build(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        made = arrayobj.make_array(array)(context, builder)
        pointer = builder.alloca(context.get_value_type(types.float64), size=arguments[0])
        pointer.align = 64
        width = context.get_constant(types.intp, 8)
        arrayobj.populate_array(
            made, data=pointer, shape=[arguments[0]], strides=[width], itemsize=width, meminfo=None
        )
        return made._getvalue()

    return array(types.intp), build


def _transposed(builder: Any, rows: list[Any]) -> list[Any]:
    """Vectors of SQUARE_SIDE numbers with squares of them transposed, side by side.

    A square has as many numbers a side as there are vectors, 2, 4 or 8.
    """
    numbers = ir.VectorType(ir.IntType(32), SQUARE_SIDE)
    half = 1
    # Squares of one, then two, then four numbers a side change places across the diagonal.
    while half < len(rows):
        for i in range(len(rows)):
            if i & half == 0:
                pair = rows[i], rows[i + half]
                for up in (0, half):
                    mask = [
                        (j & ~half) + up + (SQUARE_SIDE if j & half else 0)
                        for j in range(SQUARE_SIDE)
                    ]
                    rows[i + up] = builder.shuffle_vector(*pair, ir.Constant(numbers, mask))
        half *= 2
    return rows


def _turn(
    typing: Any, source: Any, begin: Any, width: Any, target: Any, to: Any, height: Any
) -> Any:
    vector = ir.VectorType(ir.DoubleType(), SQUARE_SIDE)

    def build(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        def place(array: int, i: int) -> Any:
            kind, begin, step = signature.args[array], arguments[array + 1], arguments[array + 2]
            data = context.make_array(kind)(context, builder, arguments[array]).data
            offset = builder.add(begin, builder.mul(step, ir.Constant(step.type, i)))
            return builder.bitcast(builder.gep(data, [offset]), vector.as_pointer())

        rows = [builder.load(place(0, i), align=8) for i in range(SQUARE_SIDE)]
        for i, row in enumerate(_transposed(builder, rows)):
            builder.store(row, place(3, i), align=8)
        return context.get_dummy_value()

    return types.none(source, types.intp, types.intp, target, types.intp, types.intp), build


def _turn_rows(fields: int) -> Callable[..., Any]:
    """Intrinsic behind `turn_pairs` and its like."""
    part = ir.VectorType(ir.DoubleType(), fields)

    def turn(typing: Any, source: Any, column: Any, places: Any, begin: Any, target: Any) -> Any:
        def build(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            table, at, to = (
                context.make_array(signature.args[i])(context, builder, arguments[i])
                for i in (0, 2, 4)
            )
            width = cgutils.unpack_tuple(builder, table.shape, 2)[1]

            def row(i: int) -> Any:
                number = builder.add(arguments[3], ir.Constant(arguments[3].type, i))
                place = builder.load(builder.gep(at.data, [number]))
                offset = builder.add(builder.mul(place, width), arguments[1])
                here = builder.bitcast(builder.gep(table.data, [offset]), part.as_pointer())
                return builder.load(here, align=8)

            parts = [row(i) for i in range(SQUARE_SIDE)]
            # Vector i holds rows i, i + fields ..., one behind the other.
            while len(parts) > fields:
                both = list(range(2 * parts[0].type.count))
                mask = ir.Constant(ir.VectorType(ir.IntType(32), len(both)), both)
                parts = [
                    builder.shuffle_vector(parts[i], parts[i + fields], mask)
                    for i in range(len(parts))
                    if i & fields == 0
                ]
            for i, turned in enumerate(_transposed(builder, parts)):
                height = cgutils.unpack_tuple(builder, to.shape, 1)[0]
                step = builder.sdiv(height, ir.Constant(height.type, fields))
                offset = builder.add(builder.mul(step, ir.Constant(step.type, i)), arguments[3])
                pointer = builder.bitcast(builder.gep(to.data, [offset]), turned.type.as_pointer())
                builder.store(turned, pointer, align=8)
            return context.get_dummy_value()

        return types.none(source, types.intp, places, types.intp, target), build

    return turn


def _turn_rows_plainly(fields: int) -> Callable[..., None]:
    def turn(
        source: Floats, column: int, places: Integers, begin: int,
        target: Floats,
    ) -> None:  # fmt: skip
        height = target.size // fields
        for k in range(begin, begin + SQUARE_SIDE):
            target[k::height] = source[places[k], column : column + fields]

    return turn


def _turn_plainly(
    source: Floats, begin: int, width: int,
    target: Floats, to: int, height: int,
) -> None:  # fmt: skip
    for i in range(SQUARE_SIDE):
        for k in range(SQUARE_SIDE):
            target[to + height * k + i] = source[begin + width * i + k]


def _wide(typing: Any) -> Any:
    def build(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        # llvmlite's own set knows attributes without values only; it prints what it holds.
        set.add(builder.function.attributes, '"prefer-vector-width"="512"')
        return context.get_dummy_value()

    return types.none(), build


def _empty(size: int) -> Floats:
    return np.empty(size)


def _empty_indices(size: int) -> Integers:
    return np.empty(size, dtype=np.int64)


_settings: Any = numba.config
_compiled = not _settings.DISABLE_JIT
on_stack: Any = intrinsic(_stack_of(types.float64)) if _compiled else _empty
"""Array of a constant number of floats, for kernels: a loop that writes to it and reads other
arrays at places of its own can become vectors, because nothing else can point there."""

indices_on_stack: Any = intrinsic(_stack_of(types.int64)) if _compiled else _empty_indices
"""The same of whole numbers."""

rows_on_stack: Any = intrinsic(_rows) if _compiled else _empty
"""As `on_stack`, of a number that only the kernel knows. Not in a loop: the stack would grow, which
is one or two megabytes on some systems."""

turn_square: Any = intrinsic(_turn) if _compiled else _turn_plainly
"""`turn_square(source, begin, width, target, to, height)` turns a square of SQUARE_SIDE numbers
a side, from place `begin` of rows of `width` to place `to` of rows of `height`. In registers: the
compiler by itself would gather every number."""

turn_pairs: Any = intrinsic(_turn_rows(2)) if _compiled else _turn_rows_plainly(2)
turn_fours: Any = intrinsic(_turn_rows(4)) if _compiled else _turn_rows_plainly(4)
turn_eights: Any = intrinsic(_turn_rows(8)) if _compiled else _turn_rows_plainly(8)
"""`turn_eights(source, column, places, begin, target)` takes eight numbers from a column on of the
rows of `source` that SQUARE_SIDE lanes look at, `places` from `begin` on, and writes them to those
lanes of the eight rows of `target`; its like take fewer. A row is read at once, not gathered."""

wide_vectors: Any = intrinsic(_wide) if _compiled else lambda: None
"""Says inside a kernel that its vectors should be as wide as the processor has them.

For some processors the compiler prefers half the width, which is meant for programs that use
vectors now and then; here they are all there is. Only the kernel that calls it is affected.
"""


def by_type(function: Callable[..., Any]) -> Any:
    """Make a function that the compiler chooses by the type of the last argument.

    The function itself is the general case. What is done instead for a class of named tuples is
    registered with ``@function.of(Class)``. The choice costs nothing at run time, because types are
    known when a kernel is compiled.
    """
    general = inlined(function)
    special: dict[Any, Any] = {}
    arguments = ", ".join(inspect.signature(function).parameters)

    @functools.wraps(function)
    def call(*given: Any) -> Any:  # without the compiler
        return special.get(type(given[-1]), general)(*given)

    def choose(*types: Any) -> Any:
        chosen = special.get(getattr(types[-1], "instance_class", None), general)
        names: dict[str, Any] = {"chosen": chosen}
        # Numba wants the arguments by name.
        exec(f"def forward({arguments}): return chosen({arguments})", names)
        return names["forward"]

    def of(kind: type) -> Callable[[Callable[..., Any]], Any]:
        def register(implementation: Callable[..., Any]) -> Any:
            special[kind] = inlined(implementation)
            return special[kind]

        return register

    options: Any = {**_OPTIONS, "forceinline": True}
    extending.overload(call, jit_options=options, strict=False)(choose)
    call.of = of  # type: ignore[attr-defined]  # functions may have attributes
    return call
