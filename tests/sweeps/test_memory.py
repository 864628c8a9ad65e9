"""Peak memory: outputs, and what does not grow with the number of designs.

Measured as the high-water mark of a process of its own, above that of a run of one design, so that
a single further array of the size of an output shows. The kernel is replaced by one that only
allocates its outputs: this is about what is around it.
"""

import json
from pathlib import Path

import pytest

from tests.sweeps.processes import python

pytestmark = pytest.mark.slow  # six processes of eight million designs

STATUS, RESET = Path("/proc/self/status"), Path("/proc/self/clear_refs")

DESIGNS = 8_000_000
"""64 MB for each output."""

STREAMED = 100e6
"""Bytes beyond the loaded libraries of a run with --memory 100MB."""

ALLOWED = 56e6
"""Bytes beyond outputs: less than one array, more than blocks and buffers take."""

PROGRAM = r"""
import json, re, sys
from pathlib import Path
import numpy as np
import sweeps, sweeps.running.archive.netcdf, sweeps.view.texts.archives
from engine_dyn.speed import dispatch as sweep

def solve(*, wanted, family, method, inertia_model, closure, tolerance, cylinders, crank_angle,
          threads, progress, **inputs):
    shape = np.broadcast_shapes(*(np.shape(v) for v in inputs.values()), np.shape(cylinders))
    found = {name: np.full(shape, 0.5) for name in wanted if name != "status"}
    return {**found, "status": np.zeros(shape, np.int8)}

sweep.solve = solve

def peak():
    text = Path("/proc/self/status").read_text()
    return 1024 * int(re.search(r"VmHWM:\s*(\d+) kB", text).group(1))

def run(scene):
    dataset = sweeps.run(scene)
    sweeps.running.archive.netcdf.write(dataset, "out.nc", overwrite=True)
    sweeps.view.texts.archives.outcome_counts(dataset)
    return sum(variable.nbytes for variable in dataset.variables.values())

def stream(scene):
    from sweeps.scene.plan.plan import make_plan
    from sweeps.scene.reading import read_scene
    from sweeps.running.compute.into_archive import run
    from sweeps.running.compute.options import Options
    run(make_plan(read_scene(scene)), Path("out.nc"), Options(overwrite=True, memory=100e6))
    return Path("out.nc").stat().st_size

if sys.argv[2] == "streamed":
    run = stream
small, large = json.loads(sys.argv[1])
run(small)
Path("/proc/self/clear_refs").write_text("5")  # the mark starts again from what is held now
before = peak()
outputs = run(large)
print(json.dumps([peak() - before, outputs]))
"""


def scene(quantities: list[str], axes: dict[str, tuple[float, float]], designs: int) -> object:
    """A product of two axes."""
    numbers = (max(designs // 1000, 2), 1000 if designs > 4 else 2)
    ranges = {
        key: {"start": low, "stop": high, "num": number}
        for (key, (low, high)), number in zip(axes.items(), numbers, strict=True)
    }
    return {"engine": "ntua", "axes": ranges, "output": {"quantities": quantities}}


@pytest.mark.skipif(not RESET.exists(), reason="needs Linux's /proc")
@pytest.mark.parametrize(
    ("quantities", "axes"),
    [
        (["mean_piston_speed"], {"stroke": (0.1, 0.2), "speed": (900, 2000)}),
        # Other units than SI's, and what it is made from nobody asked for.
        (["fmep"], {"stroke": (0.1, 0.2), "speed": (900, 2000)}),
        # Outputs of a kernel on all axes, which needs nothing else on all of them.
        (["delta", "omega_max"], {"inertia": (1, 12), "speed": (900, 2000)}),
        # A kernel that needs friction and mean torque for each design.
        (["delta", "omega_max"], {"stroke": (0.1, 0.2), "speed": (900, 2000)}),
    ],
)
def test_no_second_array_of_the_size_of_an_output(
    quantities: list[str], axes: dict[str, tuple[float, float]], tmp_path: Path
) -> None:
    peak, outputs = measured(quantities, axes, tmp_path, "whole")
    assert outputs > 8 * DESIGNS
    assert peak - outputs < ALLOWED


@pytest.mark.skipif(not RESET.exists(), reason="needs Linux's /proc")
@pytest.mark.parametrize(
    ("quantities", "axes"),
    [
        (["fmep", "mean_piston_speed"], {"stroke": (0.1, 0.2), "speed": (900, 2000)}),
        (["delta", "omega_max"], {"stroke": (0.1, 0.2), "speed": (900, 2000)}),
    ],
)
def test_streaming_keeps_to_its_memory(
    quantities: list[str], axes: dict[str, tuple[float, float]], tmp_path: Path
) -> None:
    peak, written = measured(quantities, axes, tmp_path, "streamed")
    assert written > STREAMED
    assert peak < STREAMED


def measured(
    quantities: list[str], axes: dict[str, tuple[float, float]], folder: Path, how: str
) -> tuple[float, float]:
    """Bytes at the highest beyond those of a small run, and bytes of what came out."""
    scenes = json.dumps([scene(quantities, axes, count) for count in (4, DESIGNS)])
    done = python(PROGRAM, scenes, how, cwd=folder)
    assert done.returncode == 0, done.stderr
    (folder / "out.nc").unlink()
    peak, size = json.loads(done.stdout)
    return peak, size
