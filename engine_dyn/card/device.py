"""Functions compiled for a GPU through numba.cuda, and the few things of it that solvers need.

What the processor's kernels call is compiled for the card as it stands, with other functions behind
a few names. With ``NUMBA_ENABLE_CUDASIM=1`` Numba's simulator runs the same functions in Python.
"""

from __future__ import annotations

import functools
import inspect
import threading
import types
from collections.abc import Callable, Mapping
from contextlib import suppress
from importlib.util import find_spec
from typing import Any

import numpy as np
from numba import cuda
from numba.core import config

new_stream = cuda.stream
new_device_array = cuda.device_array
new_pinned_array = cuda.pinned_array

_launching = threading.Lock()  # the simulator runs one kernel at a time; a card hardly waits


def simulated() -> bool:
    """Whether numba's simulator stands for a card."""
    return bool(vars(config).get("ENABLE_CUDASIM"))


def what_is_missing() -> str:
    """Why no card can be used, in a few words; empty where nothing is missing."""
    if simulated():
        return ""
    if find_spec("numba_cuda") is None:
        return "needs numba-cuda, which is not installed: pip install 'engine-dyn[gpu]'"
    with suppress(Exception):  # the CUDA driver raises several kinds of exceptions
        if cuda.is_available() and len(cuda.gpus):
            return ""
    return "no NVIDIA card with a working driver was found (see nvidia-smi)"


def free_memory() -> int:
    """Bytes of the card's memory that are free."""
    # The simulator reports unlimited memory: a terabyte stands for it.
    return int(min(cuda.current_context().get_memory_info()[0], 1 << 40))


def multiprocessors() -> int:
    """Number of the card's multiprocessors; the simulator has one."""
    return 1 if simulated() else int(cuda.get_current_device().MULTIPROCESSOR_COUNT)


def device_name() -> str:
    """Name of the card."""
    if simulated():
        return "numba's simulator"
    name = cuda.get_current_device().name
    return name.decode() if isinstance(name, bytes) else str(name)


class Launcher:
    """A function as a kernel: each thread calls it with its number, how many there are, and more.

    Parameters
    ----------
    function : callable
        A function (thread, threads, ...), which returns nothing.
    instead : mapping
        What functions of this project that it calls, and those that these call, find behind a name
        of their module: a function, a number, or a mapping, which becomes a module.
    """

    def __init__(self, function: Callable[..., None], instead: Mapping[str, Any]) -> None:
        known: dict[Any, Any] = {}
        # Parts of a kernel are inlined into it, as for the processor.
        options: dict[str, Any] = {"device": True, "forceinline": True}
        jit: Any = _as_it_is if simulated() else cuda.jit(**options)

        def part(value: Any) -> Any:
            if isinstance(value, Mapping):
                module = types.ModuleType("instead")
                vars(module).update({name: part(one) for name, one in value.items()})
                return module
            plain = getattr(value, "py_func", value)
            if not isinstance(plain, types.FunctionType):
                return value
            if not plain.__module__.startswith("engine_dyn."):
                return value
            if plain not in known:
                known[plain] = jit(_with_names(plain, part, instead))
            return known[plain]

        body = _quiet(part(function)) if simulated() else part(function)

        # Kernels of CUDA cannot take `*given`: each argument is written out.
        given = ", ".join(list(inspect.signature(function).parameters)[2:])
        names: dict[str, Any] = {"body": body, "cuda": cuda, "__name__": __name__}
        exec(f"def every({given}): body(cuda.grid(1), cuda.gridsize(1), {given})", names)
        # Limit on the registers of a thread. Without it a kernel takes all 255, and half as many
        # threads run at a time; which is faster has to be measured on a card: `make bench-gpu`.
        more = {} if simulated() else {"max_registers": 128}
        self.kernel = cuda.jit(**more)(names["every"])

    def __call__(self, blocks: int, threads: int, stream: Any, *given: Any) -> None:
        """Start so many blocks of threads; returns before they are done."""
        with _launching:
            kept = vars(config).get("CUDA_LOW_OCCUPANCY_WARNINGS", 0)
            try:
                # Numba would warn of launches with few threads, which are right for few designs.
                vars(config)["CUDA_LOW_OCCUPANCY_WARNINGS"] = 0
                self.kernel[blocks, threads, stream](*given)
            finally:
                vars(config)["CUDA_LOW_OCCUPANCY_WARNINGS"] = kept


def _with_names(
    function: types.FunctionType, part: Callable[[Any], Any], instead: Mapping[str, Any]
) -> Any:
    """A function whose module's names are compiled by `part`; `instead` replaces some of them."""
    module_names = function.__globals__
    names = {name for name in function.__code__.co_names if name in module_names}
    own = {name: part(instead.get(name, module_names[name])) for name in sorted(names)}
    own |= {name: module_names[name] for name in ("__name__", "__builtins__")}
    made = types.FunctionType(function.__code__, own, function.__name__, function.__defaults__)
    return functools.update_wrapper(made, function, updated=())


def _as_it_is(function: Callable[..., Any]) -> Callable[..., Any]:
    return function


def _quiet(function: Callable[..., Any]) -> Callable[..., Any]:
    """A function for the simulator: with plain arrays, which are quick, and without warnings."""

    def silent(thread: int, threads: int, *given: Any) -> None:
        plain = [one if np.isscalar(one) else one.view() for one in given]
        with np.errstate(all="ignore"):
            function(thread, threads, *plain)

    return silent
