"""How kernels are compiled: once for each kind of argument, without what only takes time."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]

pytestmark = pytest.mark.compiled

PROGRAM = """
import gc
from numba.core import event
from engine_dyn.compilation import formula, inlined, kernel

seen = []

class Listener(event.Listener):
    def on_start(self, event):
        seen.append((event.data["dispatcher"].py_func.__name__, gc.isenabled()))

    def on_end(self, event):
        pass

event.register("numba:compile", Listener())

@formula
def times(x, n):
    return x * n

@inlined
def sum_of(x, up):
    return times(x, 2) + times(x, 3) if up else -times(x, 4)

@kernel
def both(x):
    return sum_of(x, True) + sum_of(x, False)

@kernel
def wrong(x):
    return x.nothing

assert both(1.5) == 1.5
print(*(f"{name}:{enabled}" for name, enabled in seen), gc.isenabled())
try:
    wrong(1.5)
except Exception:
    print(gc.isenabled())
gc.disable()
assert both(2) == 2
print(gc.isenabled())
"""


def test_parts_compile_once_for_all_constants_and_the_collector_rests_meanwhile() -> None:
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM], capture_output=True, text=True, check=True,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
    )  # fmt: skip
    first, after_error, after_own = done.stdout.splitlines()
    assert first.split() == ["both:False", "sum_of:False", "times:False", "True"]
    # On again after an error too; off where it was off before.
    assert (after_error, after_own) == ("True", "False")


def test_flags_of_numba_have_the_values_that_they_had() -> None:
    """They are got in another way, which is faster."""
    from numba.core.compiler import Flags

    from engine_dyn import compilation

    assert Flags.values.__module__ == compilation.__name__  # else this compares Numba with itself
    flags = Flags()
    assert flags.values() == {name: getattr(flags, name) for name in flags.options}
    flags.nrt, flags.error_model = True, "numpy"
    values = flags.values()
    assert values == {name: getattr(flags, name) for name in flags.options}
    assert values["nrt"] is True and values != Flags().values()
    assert list(values) == list(flags.options)
