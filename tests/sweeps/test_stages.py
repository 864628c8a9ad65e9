"""Each stage only on its axes, nothing that nobody asked for, and what is really called."""

import json
import os
import subprocess
import sys
from collections.abc import Callable, Iterator, Mapping
from functools import cache
from typing import Any

import pytest

import sweeps
from engine_dyn.quantities.graph import ALTERNATIVES, WORDS
from sweeps.scene.plan.forecast import DIRECT
from sweeps.scene.plan.plan import Plan, make_plan
from sweeps.scene.reading import built_in_scenes, read_scene
from tests.support.scenes import asking
from tests.support.shafts import complete_shaft, shaft_with
from tests.sweeps.processes import ROOT

EVERYTHING = {
    "crank_ratio": [0.2, 0.25, 0.3], "load": [0, 50], "speed": [1000, 1200, 1500, 2000],
    "inertia": [1.0, 2.0], "reciprocating_mass": [5.0, 6.0, 7.0], "load_exponent": [0, 1, 2],
    "cylinders": [1, 2, 4], "crankcase_pressure": [0.0, 1.0],
}  # fmt: skip


def plan_of(*quantities: str, **more: Any) -> Plan:
    scene = {"engine": "ntua", "axes": EVERYTHING, "output": {"quantities": list(quantities)}}
    return make_plan(read_scene({**scene, **more}))


@pytest.mark.parametrize(
    ("name", "axes"),
    [
        ("velocity", {"crank_ratio"}),
        ("pressure", {"load"}),
        ("peak_pressure", {"load"}),
        ("imep", {"crank_ratio", "load"}),
        ("inertia_torque", {"crank_ratio", "speed", "reciprocating_mass", "cylinders"}),
        ("gas_torque", {"crank_ratio", "load", "cylinders", "crankcase_pressure"}),
        ("friction_torque", {"load", "speed", "cylinders"}),
        ("torque_mean", {"crank_ratio", "load", "speed", "cylinders"}),
        ("load_coefficient", {"crank_ratio", "load", "speed", "cylinders", "load_exponent"}),
        ("torque_max", set(EVERYTHING) - {"inertia", "load_exponent"}),
        ("crank_pin_load_max", set(EVERYTHING) - {"inertia", "load_exponent", "cylinders"}),
        ("delta", set(EVERYTHING)),
        ("status", set(EVERYTHING)),
    ],
)
def test_axes_of_quantities(name: str, axes: set[str]) -> None:
    """The table of the mathematics: mean torque is free of masses, inertia, exponent, and so on."""
    stages = {stage.node.name: stage for stage in plan_of(name).stages}
    assert set(stages[name].axes) == axes
    ordered = [axis for axis in EVERYTHING if axis in axes]
    assert list(stages[name].axes) == ordered


def test_scene_larger_than_memory_is_refused_before_computing() -> None:
    axis = {"start": 1.0, "stop": 2.0, "num": 100000}
    scene = asking(
        ["delta", "omega"], axes={"inertia": axis, "speed": {**axis, "start": 1000, "stop": 2000}}
    )
    with pytest.raises(sweeps.SceneError, match=r"10000000000 designs need .* of memory"):
        sweeps.run(scene)


VARIED: tuple[dict[str, Any], ...] = (
    {"set": {"pin_offset": 0.001, "misfire": 1, "auxiliary_torque": 1.0,
             "geometric_compression_ratio": 17.0}},
    {"set": {"cylinders": 2, "radius_factor_2": 0.9, "friction_boundary": 0.5,
             "ring_pressure": 1.0}},
    {"set": {"load_inertia": 1.0, "gear_ratio": 2.0, "counterweight_mass": 1.0,
             "balance_shaft_mass": 1.0, "second_shaft_mass": 1.0}},
    {"set": {"wanted_delta": 0.01}, "solver": {"closure": "cycle_time"}},
    {"engine": "v8_flat_plane_94x93"},
    {"engine": "v8_flat_plane_94x93",
     "set": {"articulated_rods": {"radius": 0.6, "knuckle_mass": 0.2}}},
    {"engine": "compressor_79x83"}, {"set": {"cylinders": 2, "bore_2": 0.1}},
    {"engine": "compressor_79x83", "set": {"motor_slip": 0.05}},
    {"set": {"load_square": 0.01, "throw_mass": 1.0, "throw_radius": 0.05}},
    {"set": {"friction_law": "patton_nitschke_heywood"}},
    {"shaft": {**complete_shaft(1), "load_damping_factor": 3.0}},
    {"shaft": {**complete_shaft(1), "modal_damping": 0.02, "excitations": []}},
    {"shaft": {**shaft_with("shaft_bore_1"), "discs": [
        {"name": "throw", "throw": 1, "inertia": 1.0, "damping_over_speed": {
            "speed": [100.0, 9000.0], "damping": [1.0, 2.0]}},
        {"name": "flywheel", "inertia": 1.0}],
        "shafts": [{"stiffness": 1e5}], "flywheel": "flywheel"}},
    {"shaft": {**complete_shaft(1), "shafts": [
        {"stiffness": 1e6}, {"stiffness_over_torque": {"torque": [0, 1], "stiffness": [1, 2]}},
        {"between": ["wheel", "load"], "stiffness": 1e5}]}},
    {"counterweights": [{"mass": 1.0, "radius": 0.05, "angle": 180.0, "position": 0.0}],
     "mounts": [{"lateral": x, "position": abs(x)} for x in (-0.2, 0.0, 0.2)],
     "auxiliaries": [{"mean": 1.0, "harmonics": []}],
     "idler_gears": [{"inertia": 0.01, "ratio": -2.0}]},
    {"characteristic": {"kind": "propeller"}, "set": {"rated_power": 2e4, "rated_speed": 1500}},
    *({"solver": {"method": "transient"}, "transient": {
        "cycles": 2, "command_angle": -15.0, "load_law": law}} for law in (
            "torque", "power", "exponent")),
    {"set": {"hold": "brake_torque"}}, {"set": {"held_power": 2e4}}, {"set": {"held_torque": 90.0}},
)  # fmt: skip
"""Scenes that have, together with the built-in ones, most words that select variants."""

ELSEWHERE = {
    "table", "angle_load", "over_speed", "own_cycles", "over_cycles", "by_torque", "double_acting",
    "speed_of_largest", "speed_of_smallest",
}  # fmt: skip
"""Words of scenes with files or engines of their own: `test_driven`, `test_modelled` ..."""


def test_scenes_have_every_word_and_each_one_of_every_group() -> None:
    every: set[str] = set(ELSEWHERE)
    for scene in (*built_in_scenes(), *VARIED):
        whole = {"engine": "ntua", "output": {"quantities": ["imep"]}}
        words = read_scene(scene if isinstance(scene, str) else {**whole, **scene}).words
        assert len(words) == len(ALTERNATIVES)
        for group in ALTERNATIVES:
            assert len(group.keys() & set(words)) == 1, (scene, group)
        every |= set(words)
    assert every == set(WORDS)


RATED = {"rated_power": 30e3, "rated_speed": 1500}


@pytest.mark.parametrize(
    ("parameter", "more"),
    [
        ("crank_ratio", {"set": {"rod_length": 0.3}}),
        ("inertia", {"set": {"wanted_delta": 0.01}}),
        ("inertia", {"axes": {"flywheel_inertia": [1.0, 2.0]}}),
        ("load", {"set": RATED, "characteristic": {"kind": "diesel"}}),
    ],
)
def test_a_derived_value_replaces_the_engines(parameter: str, more: dict[str, Any]) -> None:
    scene = {"engine": "ntua", "output": {"quantities": ["mean_piston_speed"]}}
    plain, derived = (make_plan(read_scene(raw)) for raw in (scene, {**scene, **more}))
    assert parameter in plain.leaves
    assert parameter not in derived.leaves
    # All other values of the engine stay in force; a characteristic makes the scale a result.
    assert set(plain.leaves) - set(derived.leaves) <= {parameter, "pressure_scale"}


# Calls are counted with the compiler off. A test that fails after a function was renamed is mended
# here.
NAMES = {
    # The work of the geometries of a block; its argument `table` has curves (node, lane).
    "table": ("speed/batch/work_table.py:fill_work_table",),
    "speed": ("speed/dispatch.py:solve",),
    "torque": ("speed/torque.py:torque_extremes",),
    "mean gas": ("speed/torque.py:mean_gas_torque",),
    "of designs": ("speed/batch/in_blocks.py:solve_blocks",),
    "traces": ("speed/designs.py:store_curves",),
    "iterations": ("speed/batch/solution.py:fill_drive",),
}  # fmt: skip

PROGRAM = """
import json, sys, threading
from pathlib import Path
import engine_dyn
from sweeps.scene.plan.plan import make_plan
from sweeps.running.compute.in_memory import compute
from sweeps.scene.reading import read_scene

table, designs = json.loads(sys.argv[1])
folder = str(Path(engine_dyn.__file__).parent)
lock = threading.Lock()

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

for line in sys.stdin:
    plan = make_plan(read_scene(json.loads(line)))
    calls, tables = {}, []
    threading.setprofile(count)
    sys.setprofile(count)
    results = compute(plan, threads=2)
    sys.setprofile(None)
    threading.setprofile(None)
    shapes = {name: array.shape for name, array in results.items()}
    print(json.dumps([calls, tables, shapes]), flush=True)
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


@pytest.fixture(scope="module")
def called() -> Iterator[Callable[..., Called]]:
    """Computes a scene and says what it called. One process does all of them: it starts slowly."""
    asked = json.dumps([NAMES["table"], NAMES["of designs"]])
    with subprocess.Popen(
        [sys.executable, "-c", PROGRAM, asked], cwd=ROOT, text=True,
        stdin=subprocess.PIPE, stdout=subprocess.PIPE,
        env={**os.environ, "PYTHONPATH": str(ROOT), "NUMBA_DISABLE_JIT": "1"},
    ) as process:  # fmt: skip
        stdin, stdout = process.stdin, process.stdout
        assert stdin is not None and stdout is not None

        @cache
        def run(scene: str) -> Called:
            stdin.write(scene + "\n")
            stdin.flush()
            line = stdout.readline()
            assert line, "the process has ended: its words are on the standard error"
            return Called(*json.loads(line))

        def computed(*quantities: str, engine: str = "ntua", **tables: Any) -> Called:
            output = {"quantities": list(quantities), "angle_step": 10.0}
            return run(json.dumps({"engine": engine, "output": output, **tables}))

        yield computed
        stdin.close()


@pytest.mark.parametrize("place", [place for places in NAMES.values() for place in places])
def test_what_is_counted_is_there(place: str) -> None:
    file, _, name = place.partition(":")
    assert f"def {name}(" in (ROOT / "engine_dyn" / file).read_text(encoding="utf-8")


def test_the_gas_work_is_made_once_for_designs_that_share_it(called: Callable[..., Called]) -> None:
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


def test_even_firing_solves_one_firing_period(called: Callable[..., Called]) -> None:
    one = called("delta", axes={"inertia": [2.0, 3.0]})
    two = called("delta", axes={"inertia": [2.0, 3.0]}, set={"cylinders": 2})
    (nodes, _), (part, _) = one.tables[0], two.tables[0]
    assert len(one.tables) == len(two.tables) == 1
    assert 2 * part == nodes


@pytest.mark.parametrize("exponent", [*sorted(DIRECT), 1.3])
def test_load_exponents_in_closed_form_never_iterate_and_others_do(
    exponent: float, called: Callable[..., Called]
) -> None:
    run = called("delta", axes={"inertia": [2.0, 3.0]}, set={"load_exponent": exponent})
    assert run.of("speed") == 1
    assert (run.of("iterations") == 0) == (exponent in DIRECT)


def test_no_trace_is_stored_unless_asked(called: Callable[..., Called]) -> None:
    without = called("delta", axes={"inertia": [2.0, 3.0]})
    assert without.of("traces") == 0
    assert set(without.shapes) == {"delta", "status"}
    stored = called("omega", axes={"inertia": [2.0, 3.0]})
    assert stored.of("traces") > 0
    assert stored.shapes["omega"] == [2, 72]


def test_torque_never_solves_for_the_speed(called: Callable[..., Called]) -> None:
    run = called("torque_max", "torque_mean", "energy_swing", axes={"speed": [1000, 1200]})
    assert run.of("torque") == 1
    assert run.of("mean gas") == 1
    assert run.of("speed") == 0
    assert run.of("iterations") == 0
    assert called("torque_mean", "bmep", axes={"speed": [1000, 1200]}).of("torque") == 0
