"""What a shaft system may be, its tree, and values referred through gears."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest

from engine_dyn.torsion import system as systems
from engine_dyn.torsion.system import mean_torques, shaft_system
from tests.support.shafts import DIESEL


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"inertia": [1.0] * 65, "stiffness": 1.0}, "inertia: 65 discs: must be at most 64"),
        ({"inertia": [1.0, -2.0, 1.0]}, "inertia[1] = -2: must not be below 0"),
        ({"inertia": [1.0, 0.0, 1.0]}, "inertia[1] = 0: must be above 0, of a disc with what"),
        ({"inertia": [1.0, np.nan, 1.0]}, "inertia, value 2 = nan: must be a finite number"),
        ({"stiffness": [1.0, -5.0]}, "stiffness[1] = -5: must not be below 0"),
        ({"stiffness": [1.0, 0.0]}, "stiffness[1] = 0: must be above 0, unless damping[1] is"),
        ({"stiffness": [1.0]}, "stiffness: 1 values: must be 2, one for each shaft"),
        ({"loss_factor": -0.1}, "loss_factor[0] = -0.1: must not be below 0"),
        ({"disc_damping": [1.0, 2.0]}, "disc_damping: 2 values: must be 3, one for each disc"),
        ({"shafts": [(0, 1), (1, 3)]}, "shafts[1] = (1, 3): must be two discs, from 0 to 2"),
        ({"shafts": [(0, 1), (1, 0)]}, "shafts[1] = (1, 0): closes a loop: shafts and gears"),
        ({"shafts": [(0, 1), (1, 1)]}, "shafts[1] = (1, 1): closes a loop"),
        ({"meshes": [(0, 2)], "ratios": 2.0}, "meshes[0] = (0, 2): closes a loop"),
        ({"shafts": [(0, 1)], "stiffness": 1.0}, "disc 2: no shafts or meshes join it to disc 0"),
        (
            {"shafts": [(0, 1)], "stiffness": 1.0, "meshes": [(1, 2)], "ratios": 0.0},
            "ratios[0] = 0: must not be 0",
        ),
        ({"crank": 3}, "crank = 3: must be a disc, from 0 to 2"),
        ({"inertia": np.ones((2, 3)), "damping": np.ones((3, 2))}, "designs do not broadcast"),
    ],
)
def test_what_cannot_be_is_refused_in_one_line(changed: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError) as error:
        shaft_system(**{"inertia": [1.0, 1.0, 1.0], "stiffness": [1.0, 1.0], **changed})
    assert message in str(error.value)
    assert "\n" not in str(error.value)


def test_a_system_cannot_be_changed() -> None:
    made = shaft_system([1.0, 2.0], 3.0)
    with pytest.raises(dataclasses.FrozenInstanceError):
        made.inertia = np.ones(2)
    for values in (made.inertia, made.stiffness, made.ratio, made.shaft_factor):
        with pytest.raises(ValueError, match="read-only"):
            values[...] = 1.0


def test_mean_torques_by_hand() -> None:
    """Two cylinders drive a load through a gear that halves the speed and turns it round."""
    made = shaft_system(
        [1.0, 1.0, 1.0, 1.0, 1.0], [10.0, 10.0, 10.0], [(0, 1), (1, 2), (4, 3)], meshes=[(2, 3)],
        ratios=-0.5,
    )  # fmt: skip
    # k (theta_second - theta_first) acts on the first disc, in the crank's sense. The load turns
    # the other way at half the speed: 600 N m in the crank's sense take up the power.
    found = mean_torques(made, [100.0, 200.0, 0.0, 0.0, np.pi], load=4)
    np.testing.assert_allclose(found, [-100.0, -300.0, -600.0])
    assert np.allclose(mean_torques(made, [[100.0, 200.0, 0.0, 0.0, 0.0]], load=0)[0, 0], 200.0)


def test_mean_torques_agree_with_statics() -> None:
    """A soft spring at the load in place of its torque: k times the twist of that solution."""
    torque = np.array([0.0, -30.0, *[150.0] * 6, 0.0])
    made = shaft_system(DIESEL["inertia"], DIESEL["stiffness"], ground_stiffness=[*[0.0] * 8, 5.0])
    stiffness = systems.matrices(made)[1]
    angle = np.linalg.solve(stiffness, torque)
    expected = np.asarray(DIESEL["stiffness"]) * np.diff(angle)
    np.testing.assert_allclose(mean_torques(made, torque, load=8), expected, rtol=1e-9)


@pytest.mark.parametrize(
    ("torque", "load", "message"),
    [([1.0, 2.0, 3.0], 0, "torque: must be 2 values"), ([1.0, 2.0], 2, "load = 2: must be a disc")],
)
def test_mean_torques_refuse(torque: list[float], load: int, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        mean_torques(shaft_system([1.0, 1.0], 1.0), torque, load)
