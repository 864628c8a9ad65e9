"""How functions are compiled: when first called, from these sources, without touching Numba."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]

pytestmark = [pytest.mark.compiled, pytest.mark.quick]


def run(program: str, *folders: Path, **environment: str) -> list[str]:
    """Lines that a program prints in a process of its own, which looks for modules in `folders`."""
    path = os.pathsep.join(map(str, folders))
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, cwd=folders[0],
        env={**os.environ, "PYTHONPATH": path, **environment},
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return done.stdout.splitlines()


KERNELS = """
from engine_dyn.compilation import formula, inlined, kernel

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

@kernel
def of_a_kernel(x):
    return 2 * both(x)
"""

UNTOUCHED = """
import inspect, os, sys
from pathlib import Path
import numba
from numba.core import event

settings = dict(vars(numba.config))

@numba.njit
def before(x):
    return x + 1.0

assert before(1.0) == 2.0  # loads what Numba itself loads late

def snapshot():
    kinds = (type(lambda: None), property, classmethod, staticmethod, type)
    found = {}
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
    return [key for key, value in original.items() if now.get(key) is not value] + [
        name for name, value in settings.items() if getattr(numba.config, name, None) != value
    ]

def listeners():
    return {kind: list(found) for kind, found in event._registered.items() if found}

class Events(event.Listener):
    def __init__(self):
        self.names = []

    def on_start(self, event):
        self.names.append(event.data["dispatcher"].py_func.__name__)
        assert changed() == []

    def on_end(self, event):
        assert changed() == []

events = Events()
event.register("numba:compile", events)
original, listened = snapshot(), listeners()
assert len(original) > 5000

import engine_dyn, sweeps
import engine_dyn.speed.dispatch
import kernels
assert events.names == [] and changed() == [] and listeners() == listened
assert not Path(os.environ["NUMBA_CACHE_DIR"], "engine-dyn").exists()

from kernels import both, foreign, of_a_kernel, wrong
assert both(1.5) == 1.5
assert events.names[0] == "both" and {"times", "sum_of"} < set(events.names)
assert both(1.5) == 1.5 and events.names.count("both") == 1
assert of_a_kernel(1.5) == 3.0
assert foreign(1.0) == 4.0 and before(2) == 3.0
try:
    wrong(1.5)
except numba.TypingError:
    pass
else:
    raise AssertionError("compiled")
assert changed() == []

# Ours knows of our functions alone; what others keep on disk lies where it would without us.
((kind, (first, ours)),) = listeners().items()
assert (kind, first) == ("numba:compile", events)
(others,) = Path(os.environ["NUMBA_CACHE_DIR"]).glob("*/kernels.foreign*.nbc")
assert "engine-dyn" not in others.parts
print("untouched")
"""

FOREIGN = """
import numba

@numba.njit(cache=True)
def foreign(x):
    return x + 3.0
"""


def test_numba_of_others_is_untouched(tmp_path: Path) -> None:
    """On import, when nothing is compiled, while ours compile, and after an error."""
    (tmp_path / "kernels.py").write_text(KERNELS + FOREIGN)
    place = str(tmp_path / "cache")
    assert run(UNTOUCHED, tmp_path, ROOT, NUMBA_CACHE_DIR=place) == ["untouched"]


PLAIN = """
import kernels
print(type(kernels.both).__name__, kernels.both(2), kernels.of_a_kernel(1.5))
"""


def test_without_the_compiler_functions_are_plain(tmp_path: Path) -> None:
    (tmp_path / "kernels.py").write_text(KERNELS)
    place = {"NUMBA_CACHE_DIR": str(tmp_path / "cache")}
    assert run(PLAIN, tmp_path, ROOT, NUMBA_DISABLE_JIT="1", **place) == ["function 2 3.0"]
    assert not (tmp_path / "cache").exists()


TIMES = """
import time
from engine_dyn.compilation import seconds_compiling
from kernels import both, foreign, of_a_kernel
foreign(1.5)  # starts Numba, which takes a while
assert seconds_compiling() == 0.0
began = time.perf_counter()
of_a_kernel(1.5)
first, elapsed = seconds_compiling(), time.perf_counter() - began
assert 0.5 * elapsed < first < elapsed, (first, elapsed)
of_a_kernel(1.5)
foreign(2)
assert seconds_compiling() == first
both(2)
assert seconds_compiling() > first
"""


def test_time_of_compilations_within_others_counts_once(tmp_path: Path) -> None:
    """And that of other people's functions not at all."""
    (tmp_path / "kernels.py").write_text(KERNELS + FOREIGN)
    assert run(TIMES, tmp_path, ROOT, NUMBA_CACHE_DIR=str(tmp_path / "cache")) == []


THREADS = """
from concurrent.futures import ThreadPoolExecutor
from numba.core import event
from kernels import both

class Events(event.Listener):
    seen = 0

    def on_start(self, event):
        self.seen += event.data["dispatcher"].py_func is both.py_func

    on_end = lambda self, event: None

events = Events()
event.register("numba:compile", events)
with ThreadPoolExecutor(8) as pool:
    assert list(pool.map(both, [1.5] * 64)) == [1.5] * 64
print(events.seen)
"""


def test_threads_that_come_at_once_compile_once(tmp_path: Path) -> None:
    (tmp_path / "kernels.py").write_text(KERNELS)
    assert run(THREADS, tmp_path, ROOT, NUMBA_CACHE_DIR=str(tmp_path / "cache")) == ["1"]


EDITED = """
import numpy as np
from engine_dyn.compilation import on_compiling, source_hash
from engine_dyn.geometry.masses import velocity_waves
on_compiling(lambda: print("compiled"))
real, _ = velocity_waves(np.array([0.3]), np.array([0.1]), 24)
print(real[0, 1].hex(), source_hash())
"""


@pytest.mark.slow
def test_no_code_is_stale_after_an_edit(tmp_path: Path) -> None:
    """A kernel is compiled again when a module that it calls has changed, and only then."""
    package = tmp_path / "engine_dyn"
    shutil.copytree(ROOT / "engine_dyn", package, ignore=shutil.ignore_patterns("__pycache__"))

    def outcome() -> tuple[bool, str, str]:
        *compiled, line = run(EDITED, tmp_path, NUMBA_CACHE_DIR=str(tmp_path / "cache"))
        value, sources = line.split()
        return compiled == ["compiled"], value, sources

    def edit(name: str, old: str, new: str) -> None:
        path = package / name
        text = path.read_text()
        assert old in text
        path.write_text(text.replace(old, new, 1))

    compiled, value, sources = outcome()
    assert compiled
    assert outcome() == (False, value, sources)
    for room in ("quantities", "forces", "speed"):
        edit(f"{room}/__init__.py", '"""', '# A comment.\n"""')
    compiled, same, others = outcome()
    assert (compiled, same) == (False, value) and others != sources
    formula = "return crank_ratio * offset / (1.0 + crank_ratio)"
    edit("geometry/slider_crank.py", formula, formula.replace("1.0", "1.5"))
    compiled, other, _ = outcome()
    assert compiled and other != value
    edit("geometry/slider_crank.py", formula.replace("1.0", "1.5"), formula)
    assert outcome()[1:] == (value, others)
