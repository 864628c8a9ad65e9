"""How kernels are compiled: once for each kind of argument, and without touching Numba itself."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from engine_dyn import compilation
from engine_dyn.compilation import announcing, cache, fast_compile

ROOT = Path(__file__).resolve().parents[2]

pytestmark = [pytest.mark.compiled, pytest.mark.quick]


def run(program: str, **environment: str) -> list[str]:
    """Lines that a program prints in a process of its own."""
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True,
        env={**os.environ, "PYTHONPATH": str(ROOT), **environment},
    )  # fmt: skip
    return done.stdout.splitlines()


KERNELS = """
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
    return times(x, 2).nothing
"""

PARTS = f"""
{KERNELS}
assert both(1.5) == 1.5
print(*(f"{{name}}:{{enabled}}" for name, enabled in seen), gc.isenabled())
try:
    wrong(1.5)
except Exception:
    print(gc.isenabled())
gc.disable()
assert both(2) == 2
print(gc.isenabled())
"""


@pytest.mark.parametrize("fast", [True, False])
def test_parts_compile_once_and_the_collector_rests_only_within_kernels(fast: bool) -> None:
    """Where parts compile, within a kernel, the collector is off if compilation is made faster."""
    first, after_error, after_own = run(PARTS, ENGINE_DYN_FAST_COMPILE=str(int(fast)))
    assert first.split() == ["both:True", f"sum_of:{not fast}", f"times:{not fast}", "True"]
    # On again after an error too; off where it was off before.
    assert (after_error, after_own) == ("True", "False")


UNTOUCHED = f"""
import gc, inspect, sys, threading
import numba
from numba.core import codegen, compiler, event

@numba.njit
def before(x):
    return x + 1.0

assert before(1.0) == 2.0  # loads what Numba itself loads late

def snapshot():
    kinds = (type(lambda: None), property, classmethod, staticmethod, type)
    found = {{}}
    for name, module in list(sys.modules.items()):
        if module is None or name.split(".")[0] not in ("numba", "llvmlite"):
            continue
        for owner in (module, *(v for v in vars(module).values() if inspect.isclass(v))):
            whose = owner.__name__ if owner is module else owner.__module__
            if whose.split(".")[0] not in ("numba", "llvmlite"):
                continue  # of the standard library, under a name of Numba's
            for attribute, value in list(vars(owner).items()):
                if isinstance(value, kinds):
                    found[name, getattr(owner, "__qualname__", ""), attribute] = value
    return found

def changed():
    now = snapshot()
    return [key for key, value in original.items() if now.get(key) is not value]

original = snapshot()
callbacks, state = list(gc.callbacks), (gc.isenabled(), gc.get_threshold())
listeners = {{kind: list(found) for kind, found in event._registered.items()}}

import engine_dyn
import engine_dyn.speed.dispatch
assert len(original) > 5000
assert changed() == [], changed()
assert gc.callbacks == callbacks and (gc.isenabled(), gc.get_threshold()) == state
assert {{kind: list(found) for kind, found in event._registered.items()}} == listeners

{KERNELS}

@numba.njit
def meanwhile(x):
    return x + 2.0

@numba.njit
def after(x):
    return x + 3.0

class Watch(event.Listener):
    '''Has another thread compile a function of others while ours compiles.'''

    def on_start(self, event):
        name = event.data["dispatcher"].py_func.__name__
        if name == "both":
            thread.start()
        if name == "meanwhile":
            finished.append(bool(both.overloads))
        if name in ("meanwhile", "after"):
            assert gc.isenabled()
        assert changed() == []

    on_end = lambda self, event: None

thread, finished = threading.Thread(target=meanwhile, args=(1.0,)), []
event.register("numba:compile", Watch())
assert both(1.5) == 1.5
thread.join()
assert finished == [True], "Numba's lock lets one thread compile at a time"
assert after(1.0) == 4.0 and meanwhile(1.0) == 3.0
try:
    wrong(1.5)
except numba.TypingError:
    pass
else:
    raise AssertionError("compiled")
assert changed() == []
assert gc.callbacks == callbacks and (gc.isenabled(), gc.get_threshold()) == state
for foreign in (before, meanwhile, after):
    (made,) = foreign.overloads.values()
    assert type(made.library) is codegen.JITCodeLibrary
(ours,) = both.overloads.values()
assert type(ours.library) is not codegen.JITCodeLibrary
print("untouched")
"""


@pytest.mark.parametrize("fast", ["1", "0"])
def test_numba_of_others_is_untouched(fast: str) -> None:
    """On import, while ours compile, while another thread compiles, and after an error."""
    assert run(UNTOUCHED, ENGINE_DYN_FAST_COMPILE=fast) == ["untouched"]


RESULTS = """
import numba
{before}
import numpy as np
import engine_dyn
from engine_dyn.compilation import pipeline

angle = np.linspace(-2.0 * np.pi, 2.0 * np.pi, 360, endpoint=False)
pressure = 1e5 + 5e6 * np.exp(-(((angle - 0.17) / 0.44) ** 2))
diagram = engine_dyn.diagram_from_points(angle, pressure)
for method in ("auto",):
    speed = engine_dyn.periodic_speed(
        diagram, bore=0.14, stroke=0.18, crank_ratio=0.2571, reciprocating_mass=6.67, inertia=2.0,
        speed=125.66, load_exponent=1.6, friction_torque=32.8, method=method,
    )
    print(*(float(value).hex() for value in (speed.delta, speed.omega_max, speed.omega_min)))
print(pipeline.POSSIBLE, speed.status)
"""
OTHER_NUMBA = "numba.__version__ = '0.99.0'"


@pytest.mark.slow
def test_results_are_the_same_to_the_bit_without_fast_compilation(tmp_path: Path) -> None:
    """With another Numba, which knows nothing of our compiler, they are the same but rounding."""
    fast, slow, other = (
        run(
            RESULTS.format(before=before),
            ENGINE_DYN_FAST_COMPILE=on, NUMBA_CACHE_DIR=str(tmp_path / folder),
        )
        for on, before, folder in (("1", "", "1"), ("0", "", "2"), ("1", OTHER_NUMBA, "3"))
    )  # fmt: skip
    assert fast == slow and fast[-1].split() == ["True", "0"]
    assert other[-1].split() == ["False", "0"]
    for line, expected in zip(other[:-1], fast[:-1], strict=True):
        values = [[float.fromhex(word) for word in words.split()] for words in (line, expected)]
        assert values[0] == pytest.approx(values[1], rel=1e-11, abs=0.0)


def test_flags_of_kernels_have_the_values_that_numbas_own_have() -> None:
    """They are got in another way, which is faster."""
    from numba.core.compiler import Flags

    numbas = Flags()
    flags = fast_compile._make_flags()(numbas)
    assert type(flags) is not Flags  # else this compares Numba with itself
    assert flags == numbas and numbas == flags and hash(flags) == hash(numbas)
    assert list(flags.values().items()) == list(numbas.values().items())
    numbas.nrt, numbas.error_model = True, "numpy"
    assert flags != numbas
    flags.nrt, flags.error_model = True, "numpy"
    assert flags == numbas and flags.values()["nrt"] is True
    assert type(flags.copy()) is type(flags) and flags.copy() == flags
    assert flags.get_mangle_string() == numbas.get_mangle_string()


def test_an_edit_in_any_folder_changes_the_hash(tmp_path: Path) -> None:
    package = ROOT / "engine_dyn"
    ignored = shutil.ignore_patterns("__pycache__")
    copy = Path(shutil.copytree(package, tmp_path / "engine_dyn", ignore=ignored))
    original = cache.hash_of_sources(copy)
    assert original == compilation.source_hash()
    folders = {path.parent for path in copy.rglob("*.py")}
    assert len(folders) > 1
    for folder in folders:
        source = min(folder.glob("*.py"))
        text = source.read_bytes()
        source.write_bytes(text + b"\n")
        assert cache.hash_of_sources(copy) != original, source
        source.write_bytes(text)
    deep = copy / "new" / "room"
    deep.mkdir(parents=True)
    (deep / "file.py").write_bytes(b"")
    assert cache.hash_of_sources(copy) != original


def test_time_of_compilers_that_call_each_other_counts_once(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    now = iter([10.0, 11.0, 15.0, 100.0, 101.0])  # the inner compiler does not look at its end
    monkeypatch.setattr(announcing.time, "perf_counter", lambda: next(now))
    before = compilation.seconds_compiling()
    with announcing.timed(), announcing.timed():
        pass
    assert compilation.seconds_compiling() - before == 5.0
    with announcing.timed():
        pass
    assert compilation.seconds_compiling() - before == 6.0
