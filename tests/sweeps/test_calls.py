"""What is really called: every function of `engine_dyn`, counted while a scene is computed.

Each scene runs in a process of its own with the compiler off, so that the insides of kernels are
calls like any other. A test that fails after a function was renamed is mended in `NAMES`.
"""

import json
from collections.abc import Mapping
from functools import cache
from typing import Any

import pytest

from sweeps.planning.forecast import DIRECT
from tests.sweeps.processes import ROOT, python

NAMES = {
    # The work of the geometries of a block; its argument `table` has curves (node, lane).
    "table": ("speed/batch/work_table.py:fill_work_table",),
    "speed": ("speed/dispatch.py:solve",),
    "torque": ("speed/torque.py:torque_extremes",),
    "mean gas": ("speed/mean_gas.py:mean_gas_torque",),
    "of designs": ("speed/batch/in_blocks.py:solve_blocks",),
    "traces": ("speed/storage.py:store_curves",),
    "iterations": ("speed/batch/solution.py:fill_drive",),
}  # fmt: skip

PROGRAM = """
import json, sys, threading
from pathlib import Path
import engine_dyn
from sweeps.planning.plan import make_plan
from sweeps.running.in_memory import compute
from sweeps.scene.reading import read_scene

scene, table, designs = json.loads(sys.argv[1])
plan = make_plan(read_scene(scene))
folder = str(Path(engine_dyn.__file__).parent)
calls, tables, lock = {}, [], threading.Lock()

def named(code):
    if not code.co_filename.startswith(folder):
        return ""
    return code.co_filename[len(folder) + 1 :].replace("\\\\", "/") + ":" + code.co_name

def count(frame, event, _):
    if event != "call":
        return
    name = named(frame.f_code)
    if name:
        with lock:
            calls[name] = calls.get(name, 0) + 1
            if name in table and named(frame.f_back.f_code) in designs:
                tables.append(list(frame.f_locals["table"].gas.shape))

threading.setprofile(count)
sys.setprofile(count)
results = compute(plan, threads=2)
sys.setprofile(None)
threading.setprofile(None)
print(json.dumps([calls, tables, {name: array.shape for name, array in results.items()}]))
"""


class Called:
    """Calls of one run: how often each function, and the shapes of the tables of designs."""

    def __init__(self, calls: Mapping[str, int], tables: list[list[int]], shapes: Any) -> None:
        self.calls, self.tables, self.shapes = calls, tables, shapes

    def of(self, name: str) -> int:
        """Calls of what `NAMES` names."""
        return sum(self.calls.get(place, 0) for place in NAMES[name])

    def within(self, file: str) -> dict[str, int]:
        """Calls of the functions of one file or folder."""
        assert (ROOT / "engine_dyn" / file.partition(":")[0]).exists(), file
        return {name: n for name, n in self.calls.items() if name.startswith(file)}


@cache
def _run(scene: str) -> Called:
    asked = json.dumps([json.loads(scene), NAMES["table"], NAMES["of designs"]])
    done = python(PROGRAM, asked, environment={"NUMBA_DISABLE_JIT": "1"})
    assert done.returncode == 0, done.stderr
    return Called(*json.loads(done.stdout))


def called(*quantities: str, engine: str = "ntua", **tables: Any) -> Called:
    """Compute a scene and say what it called."""
    output = {"quantities": list(quantities), "angle_step": 10.0}
    return _run(json.dumps({"engine": engine, "output": output, **tables}))


@pytest.mark.parametrize("place", [place for places in NAMES.values() for place in places])
def test_what_is_counted_is_there(place: str) -> None:
    file, _, name = place.partition(":")
    assert f"def {name}(" in (ROOT / "engine_dyn" / file).read_text(encoding="utf-8")


KINEMATICS = ("position", "velocity", "acceleration", "mean_piston_speed", "displacement")


def test_kinematics_never_touch_the_pressure() -> None:
    run = called(*KINEMATICS, axes={"crank_ratio": [0.2, 0.3], "speed": [1000, 1200]})
    assert run.within("geometry/slider_crank.py")
    assert run.within("pressure/") == {}
    assert run.within("forces/torque.py:pressure") == {}
    assert run.within("speed/") == {}


def test_the_gas_work_is_made_once_for_designs_that_share_it() -> None:
    inertias = [2.0 + 0.1 * i for i in range(10)]
    axes = {"inertia": inertias, "reciprocating_mass": [4.0, 5.0], "speed": [1100, 1200]}
    run = called("delta", axes=axes)
    assert run.shapes["delta"] == [10, 2, 2]  # three blocks
    assert run.of("speed") == 1
    assert len(run.tables) == 1
    # The tables of one block are kept at a time: designs that share them follow each other.
    axes = {"crank_ratio": [0.2, 0.25], "reciprocating_mass": [4.0, 5.0], "inertia": inertias}
    ratios = called("delta", axes=axes)
    assert len(ratios.tables) == 3


def test_even_firing_solves_one_firing_period() -> None:
    one = called("delta", axes={"inertia": [2.0, 3.0]})
    two = called("delta", axes={"inertia": [2.0, 3.0]}, set={"cylinders": 2})
    (nodes, _), (part, _) = one.tables[0], two.tables[0]
    assert len(one.tables) == len(two.tables) == 1
    assert 2 * part == nodes


@pytest.mark.parametrize("exponent", [*sorted(DIRECT), 1.3])
def test_load_exponents_in_closed_form_never_iterate_and_others_do(exponent: float) -> None:
    run = called("delta", axes={"inertia": [2.0, 3.0]}, set={"load_exponent": exponent})
    assert run.of("speed") == 1
    assert (run.of("iterations") == 0) == (exponent in DIRECT)


def test_no_trace_is_stored_unless_asked() -> None:
    without = called("delta", axes={"inertia": [2.0, 3.0]})
    assert without.of("traces") == 0
    assert set(without.shapes) == {"delta", "status"}
    stored = called("omega", axes={"inertia": [2.0, 3.0]})
    assert stored.of("traces") > 0
    assert stored.shapes["omega"] == [2, 72]


def test_torque_never_solves_for_the_speed() -> None:
    run = called("torque_max", "torque_mean", "energy_swing", axes={"speed": [1000, 1200]})
    assert run.of("torque") == 1
    assert run.of("mean gas") == 1
    assert run.of("speed") == 0
    assert run.of("iterations") == 0
    assert called("torque_mean", "bmep", axes={"speed": [1000, 1200]}).of("torque") == 0
