"""Each stage only on the axes that it depends on, and nothing that nobody asked for."""

from typing import Any

import pytest

import sweeps
from engine_dyn.quantities.variants import ALTERNATIVES, WORDS
from sweeps.planning.forecast import text
from sweeps.planning.plan import Plan, make_plan
from sweeps.scene.reading import built_in_scenes, read_scene
from tests.support.scenes import asking
from tests.support.shafts import complete_shaft

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


def test_nothing_else_is_planned() -> None:
    plan = plan_of("velocity")
    assert [stage.node.name for stage in plan.stages] == ["velocity"]
    assert set(plan.unused) == set(EVERYTHING) - {"crank_ratio"}
    assert "not requested: " in text(plan)
    assert "speed_solution" not in text(plan_of("torque_max", "energy_swing", "bmep"))
    # The status comes with what can fail, and only then.
    assert plan_of("delta").outputs == ("delta", "status")
    assert plan_of("torque_max", "imep").outputs == ("torque_max", "imep")


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
    {"engine": "compressor_79x83"},
    {"engine": "compressor_79x83", "set": {"motor_slip": 0.05}},
    {"set": {"load_square": 0.01, "throw_mass": 1.0, "throw_radius": 0.05}},
    {"set": {"friction_law": "patton_nitschke_heywood"}},
    {"shaft": {**complete_shaft(1), "load_damping_factor": 3.0}},
    {"shaft": {**complete_shaft(1), "shafts": [
        {"stiffness": 1e6}, {"stiffness_over_torque": {"torque": [0, 1], "stiffness": [1, 2]}},
        {"between": ["wheel", "load"], "stiffness": 1e5}]}},
    {"characteristic": {"kind": "propeller"}, "set": {"rated_power": 2e4, "rated_speed": 1500}},
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
