"""What a key of a scene replaces in the engine counts nowhere: neither in values nor in tables."""

import pickle
from pathlib import Path

import numpy as np
import pytest

from engine_dyn.quantities.graph import PARAMETERS, QUANTITIES
from sweeps.scene.crossings import replaced_by
from sweeps.scene.plan.plan import make_plan
from sweeps.scene.reading import read_scene
from tests.support.engine_files import POINTS, SPLIT_PINS, VALUES, written
from tests.support.scenes import asking, computed, refusal, toml

SIZES = {
    "inertia": 2.5, "auxiliary_inertia": 0.1, "flywheel_inertia": 1.5, "load_inertia": 0.4,
    "motor_synchronous_speed": 1250.0, "motor_slip": 0.05, "crank_ratio": 0.27, "rod_length": 0.33,
    "speed": 1100.0, "largest_speed": 1210.0, "smallest_speed": 1190.0, "load_exponent": 1.5,
    "load_linear": 0.3, "load_square": 0.002, "crank_mass": 3.0, "throw_mass": 4.0,
    "throw_radius": 0.05, "counterweight_fraction": 0.5, "counterweight_mass": 6.0,
    "counterweights_factor": 1.2, "synchronising_torque": 2e4, "synchronising_power": 6e4,
    "wanted_delta": 0.02, "reciprocating_mass": 5.0, "piston_mass": 3.0,
}  # fmt: skip
MORE = {
    "motor_slip": {"motor_breakdown_torque": 900.0, "motor_breakdown_slip": 0.2},
    "motor_synchronous_speed": {"motor_breakdown_torque": 900.0, "motor_breakdown_slip": 0.2},
    "throw_mass": {"throw_radius": 0.05}, "throw_radius": {"throw_mass": 4.0},
}  # fmt: skip
"""What belongs to a key."""
NOT_OF_ENGINES = {"wanted_delta", "load_damping", "load_damping_factor"}
"""Of scenes and of shafts."""
OF_HOLDING = {"held_torque", "held_power"}
"""Of engines with diagrams over the load: test_hold.py."""
OF_TORQUE = {"largest_speed", "smallest_speed"}
"""Of engines whose torque is given."""
TORQUE = '\n[[diagram]]\nkind = "torque"\nmean = 90\nharmonics = [{ order = 2, sine = 400 }]\n'
PAIRS = [
    (key, old)
    for key in PARAMETERS
    if key not in OF_HOLDING
    for old in sorted(replaced_by([key]) - NOT_OF_ENGINES - OF_HOLDING)
] + [("reciprocating_mass", "piston_mass")]


def engine_with(folder: Path, more: dict[str, float], without: set[str]) -> Path:
    folder.mkdir(exist_ok=True)
    lines = [line for line in VALUES.splitlines() if line.split(" ")[0] not in {*more, *without}]
    diagram = TORQUE if OF_TORQUE & {*more, *without} else POINTS
    return written(folder, "\n".join([*lines, *(f"{k} = {v}" for k, v in more.items()), diagram]))


def enters(engine: Path, given: dict[str, float]) -> dict[str, bytes]:
    """Everything that stages can take, as bytes."""
    scene = read_scene(asking(["mean_piston_speed"], engine=str(engine), set=given))
    leaves = make_plan(scene).leaves
    taken = {name: leaf.data for name, leaf in leaves.items() if name != "variant_of"}
    return {name: pickle.dumps(data) for name, data in {**taken, "words": scene.words}.items()}


@pytest.mark.parametrize(("key", "old"), PAIRS)
def test_what_a_key_replaces_enters_nothing(key: str, old: str, tmp_path: Path) -> None:
    given = {key: SIZES[key], **MORE.get(key, {})}
    own = {old: SIZES[old], **MORE.get(old, {})}
    without = {*replaced_by(own.keys()), *replaced_by(given.keys())}
    had = enters(engine_with(tmp_path / "had", own, without), given)
    other = {**own, old: 1.1 * own[old]}
    changed = enters(engine_with(tmp_path / "changed", other, without), given)
    assert had == changed
    never = enters(engine_with(tmp_path / "never", {}, {*without, *own}), given)
    # What belongs to the key stays the engine's, and words may name parts that nothing asks for.
    beside = {"words", *MORE.get(old, {})}
    assert {name for name in had if had[name] != never.get(name)} <= beside


WEBS = [{"mass": 2.1, "radius": 0.06, "angle": 170, "position": -0.03},
        {"mass": 0.7, "radius": 0.05, "angle": 35, "position": 0.11}]  # fmt: skip


@pytest.mark.parametrize("given", [{"counterweight_fraction": 0.4}, {"counterweight_mass": 1.3}])
def test_counterweights_that_a_scene_replaces_turn_nowhere(
    given: dict[str, float], tmp_path: Path
) -> None:
    """Every quantity of balance, bearings and bending, beside an engine without the table."""
    text = (
        VALUES.replace(
            "cylinders = 2", "cylinders = 4\ncylinder_spacing = 0.16\nbank_offset = 0.02"
        )
        + POINTS
    )
    text = text.replace("reciprocating_mass = 6.67", "reciprocating_mass = 2\nrod_mass = 1\n"
                        "rod_centre_of_gravity = 0.1\ncrank_mass = 3")  # fmt: skip
    made = ", ".join(f"{key} = {toml(value)}" for key, value in SPLIT_PINS.items())
    text = text.replace("[values]", f"arrangement = {{ {made} }}\n[values]")
    tables = "".join(
        "\n[[counterweights]]\n" + "".join(f"{key} = {value}\n" for key, value in web.items())
        for web in WEBS
    )
    asked = [
        name for name, node in QUANTITIES.items()
        if name.startswith(("bay_", "main_journal", "any_main", "all_main", "shaking", "residual",
                            "counterweight", "best_fraction", "gravity", "mount", "engine_inertia"))
        and not name.endswith("pressure") and "_pressure_" not in name
    ]  # fmt: skip
    found = []
    for folder, own in (("without", text), ("with", text + tables)):
        (tmp_path / folder).mkdir()
        found.append(
            computed(
                asked, engine=str(written(tmp_path / folder, own)), output={"angle_step": 30.0},
                set={"balance_shaft_radius": 0.03, "second_shaft_radius": 0.02, **given},
                mounts=[{"lateral": -0.3}, {"lateral": 0.3}],
            )
        )  # fmt: skip
    for name in asked:
        np.testing.assert_array_equal(found[0][name], found[1][name], err_msg=name)


def test_a_factor_on_counterweights_that_are_replaced_is_refused() -> None:
    given = {"counterweights_factor": 0.5, "counterweight_mass": 1.0}
    said = refusal(asking(["shaking_force_max"], set=given))
    assert "counterweights_factor" in said and "counterweight_mass" in said
