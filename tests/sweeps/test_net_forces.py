"""The rod's motion, the angle at a travel, and forces with weight and piston friction, in scenes.

Numbers of textbooks stand in tests/reference/worked_examples.toml: Khurmi 15.8 to 15.21, Sarkar
5.4 and Bevan 12.5 are posed with these quantities.
"""

from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from sweeps.errors import SceneError
from tests.support.scenes import computed

GRAVITY = 9.80665
RADIUS, ROD = 0.09, 0.35  # m, of the engine ntua
MASS = 4.97 + 6.33 * 0.094 / ROD  # kg
NET = ["piston_force", "wall_thrust", "rod_force", "tangential_force", "radial_force"]


@pytest.mark.parametrize("settings", [{}, {"pin_offset": 0.02, "speed": 1000}])
def test_the_rod_turns_as_the_slopes_of_its_angle(settings: dict[str, float]) -> None:
    names = ["rod_angle", "rod_angular_velocity", "rod_angular_acceleration"]
    found = computed(names, set=settings, output={"angle_step": 0.1})
    omega = settings.get("speed", 1200) * np.pi / 30.0
    step = np.radians(0.1)
    angle, speed, acceleration = (found[name].values for name in names)
    for curve, slope in ((np.radians(angle), speed), (speed, acceleration)):
        by_differences = omega * (curve[2:] - curve[:-2]) / (2.0 * step)
        assert by_differences == pytest.approx(slope[1:-1], abs=2e-6 * np.abs(slope).max())
    # At dead centre without offset the big end moves at r omega across the rod.
    if not settings:
        assert float(found["rod_angular_velocity"].sel(crank_angle=0)) == pytest.approx(
            omega * RADIUS / ROD, rel=1e-14
        )


@pytest.mark.parametrize("offset", [0.0, 0.02])
def test_the_angle_at_a_travel_has_that_travel(offset: float) -> None:
    travels = [0.0, 0.03, 0.06, 0.09, 0.18]
    beyond = 0.2  # has no angle, and does not stop the others
    found = computed(
        ["crank_angle_at_travel", "position"], set={"crank_offset": offset},
        axes={"piston_travel": [*travels, beyond]}, output={"angle_step": 0.05},
    )  # fmt: skip
    *angles, none = found["crank_angle_at_travel"].values
    angles = np.array(angles)
    assert np.isnan(none)
    assert (np.diff(angles) > 0.0).all()
    radius = 0.18 / float(found["position"].max())
    back = radius * np.interp(angles, found["crank_angle"], found["position"])
    assert back == pytest.approx(travels, abs=1e-6)
    if offset == 0.0:
        assert angles[[0, -1]].tolist() == [0.0, 180.0]


@pytest.mark.parametrize("inclination", [0.0, 60.0, -90.0, 180.0])
def test_net_forces_written_out(inclination: float) -> None:
    friction, lean = 300.0, np.radians(inclination)
    found = computed(
        ["gas_force", "inertia_force", "weight_force", *(f"net_{name}" for name in NET)],
        set={"piston_friction": friction, "engine_inclination": inclination},
    )
    theta = np.radians(found["crank_angle"].values)
    beta = np.arcsin(RADIUS / ROD * np.sin(theta))
    assert float(found["weight_force"]) == pytest.approx(
        MASS * GRAVITY * np.cos(lean), abs=1e-13 * MASS * GRAVITY
    )
    turning_back = np.isclose(theta % np.pi, 0.0) | np.isclose(theta % np.pi, np.pi)
    down = np.where(turning_back, 0.0, np.sign(np.sin(theta)))
    along = found["gas_force"].values + found["inertia_force"].values
    along = along + MASS * GRAVITY * np.cos(lean) - friction * down
    wanted = {
        "piston_force": along,
        # A cylinder that leans to the side of the falling crank pin lies on that side's wall.
        "wall_thrust": along * np.tan(beta) - MASS * GRAVITY * np.sin(lean),
        "rod_force": along / np.cos(beta),
        "tangential_force": along * np.sin(theta + beta) / np.cos(beta),
        "radial_force": along * np.cos(theta + beta) / np.cos(beta),
    }
    for name, values in wanted.items():
        error = np.abs(found[f"net_{name}"].values - values).max()
        assert error < 1e-13 * np.abs(along).max(), name


def test_weights_at_rest_balance_on_the_frame() -> None:
    """Almost at rest, rod and wall together bear the whole weight, whichever way it points."""
    found = computed(
        ["net_wall_thrust", "net_tangential_force", "net_radial_force", "gas_force"],
        set={"speed": 1e-3, "reciprocating_mass": 5.0}, axes={"engine_inclination": [0, 37, 200]},
    )  # fmt: skip
    theta = np.radians(found["crank_angle"])
    tangential, radial = found["net_tangential_force"], found["net_radial_force"]
    down = radial * np.cos(theta) + tangential * np.sin(theta) - found["gas_force"]
    across = tangential * np.cos(theta) - radial * np.sin(theta) - found["net_wall_thrust"]
    lean = np.radians(found["engine_inclination"])
    near = 1e-11 * float(found["gas_force"].max())
    assert float(np.abs(down - 5.0 * GRAVITY * np.cos(lean)).max()) < near + 1e-6
    assert float(np.abs(across - 5.0 * GRAVITY * np.sin(lean)).max()) < near


@pytest.mark.compiled
@pytest.mark.parametrize(("engine", "first"), [("ntua", 25.0), ("v6_96x81", -5.0)])
def test_net_torque_and_what_it_leaves_alone(engine: str, first: float) -> None:
    """Weights turn nothing in a whole cycle, friction takes F s/pi in each cylinder."""
    asked = ["torque", "gravity_torque", "piston_friction_torque", "net_torque", "delta",
             "piston_force", "cylinder_direction"]  # fmt: skip
    upright = {"cylinders": 1} if engine == "ntua" else {}
    leaning = {**upright, "engine_inclination": 25.0, "piston_friction": 200.0}
    plain, found = (computed(asked, engine, set=values) for values in (upright, leaning))
    for name in ("torque", "delta", "piston_force"):
        assert_array_equal(plain[name].values, found[name].values)
    assert float(found["cylinder_direction"]) == pytest.approx(first)
    net = found["torque"] + found["gravity_torque"] - found["piston_friction_torque"]
    assert_array_equal(found["net_torque"].values, net.values)
    cylinders, stroke = (1, 0.18) if engine == "ntua" else (6, 0.081)
    lost = float(found["piston_friction_torque"].mean())
    assert lost == pytest.approx(200.0 * cylinders * stroke / np.pi, rel=1e-3)
    assert np.abs(found["gravity_torque"].values - plain["gravity_torque"].values).max() > 0.0


@pytest.mark.parametrize(
    ("settings", "quantity", "message"),
    [
        ({"piston_travel": -0.1}, "crank_angle_at_travel",
         "piston_travel = -0.1: must be a finite number 0 or more"),
        ({}, "crank_angle_at_travel", "needs piston_travel"),
        ({"piston_friction": -1}, "net_torque",
         "piston_friction = -1: must be a finite number 0 or more"),
        ({"engine_inclination": 400}, "net_piston_force",
         "engine_inclination = 400: must be a finite number from -360 to 360"),
    ],
)  # fmt: skip
def test_bad_input(settings: dict[str, Any], quantity: str, message: str) -> None:
    with pytest.raises(SceneError, match=message):
        computed([quantity], set=settings)
