"""Scenes and engine files with the load a + k (b omega + c omega^2)."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import sweeps
from sweeps.base.errors import SceneError
from sweeps.catalogue import ENGINES

SPEED = 1200.0


def scene(**tables: Any) -> dict[str, Any]:
    return {
        "engine": "ntua",
        "output": {
            "quantities": [
                "delta", "load_coefficient", "load_torque", "load_torque_nominal", "torque_mean",
                "omega", "status",
            ],
            "angle_step": 5.0,
        },
        **tables,
    }  # fmt: skip


def test_k_closes_the_balance_and_leaves_the_offset() -> None:
    found = sweeps.run(
        scene(
            set={"load_offset": 6.0, "speed": SPEED},
            axes={"load_linear": [0.4, 2.0], "load_square": [0.0, 0.01], "inertia": [1.5, 6.0]},
        )
    )
    assert (found["status"] == 0).all()
    nominal = SPEED * np.pi / 30.0
    law = found["load_linear"] * nominal + found["load_square"] * nominal**2
    surplus = found["torque_mean"] - 6.0
    assert_allclose(found["load_coefficient"] * law, surplus.broadcast_like(law))
    assert_allclose(found["load_torque_nominal"], found["load_coefficient"] * law)
    omega = found["omega"]
    load = 6.0 + found["load_coefficient"] * (
        found["load_linear"] * omega + found["load_square"] * omega**2
    )
    assert_allclose(found["load_torque"], load.transpose(*found["load_torque"].dims))
    assert found["load_coefficient"].attrs["units"] == "1"


def engine_file(folder: Path, line: str) -> str:
    text = (ENGINES / "ntua.toml").read_text("utf-8")
    assert "\nload_exponent = " in text
    kept = [text for text in text.split("\n") if not text.startswith("load_exponent = ")]
    place = kept.index("[values]") + 1
    file = folder / "braked.toml"
    file.write_text("\n".join([*kept[:place], line, *kept[place:]]), "utf-8")
    return str(file)


def test_an_engine_file_may_give_it_and_a_scene_another(tmp_path: Path) -> None:
    engine = engine_file(tmp_path, "load_linear = 2.0")
    own = sweeps.run({**scene(), "engine": engine})
    same = sweeps.run(scene(set={"load_exponent": 1.0}))
    assert_allclose(own["delta"], same["delta"], rtol=1e-6)
    other = sweeps.run({**scene(set={"load_exponent": 2.0}), "engine": engine})
    assert_array_equal(other["delta"], sweeps.run(scene(set={"load_exponent": 2.0}))["delta"])


@pytest.mark.parametrize(
    ("tables", "says"),
    [
        ({"set": {"load_linear": 0.0, "load_square": 0.0}}, "one of them must be more than 0"),
        ({"axes": {"load_linear": [0.0, 1.0]}}, "one of them must be more than 0"),
        ({"designs": {"load_linear": [1.0, 0.0], "load_square": [0.0, 0.0]}}, "more than 0"),
        ({"set": {"load_linear": -1.0}}, "load_linear = -1"),
        ({"set": {"load_linear": 1.0, "load_exponent": 1.0}}, "give one law"),
        ({"set": {"load_exponent": 1.0}, "axes": {"load_square": [1.0, 2.0]}}, "give one law"),
        ({"set": {"load_square": 1.0, "motor_slip": 0.05}}, "not allowed together with a driver"),
        ({"set": {"load_square": 1.0}, "solver": {"method": "thesis"}}, "supports only"),
    ],
)
def test_bad_input(tables: dict[str, Any], says: str) -> None:
    with pytest.raises(SceneError, match=says):
        sweeps.read_scene(scene(**tables))
