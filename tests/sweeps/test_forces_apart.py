"""Forces of gas and masses apart, with weight and piston friction, volume, inertia, rod."""

import math
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from sweeps.base.errors import SceneError
from tests.support.scenes import computed

COMPONENTS = ("wall_thrust", "rod_force", "tangential_force", "radial_force")
PRESSURES = ("piston", "wall", "rod", "tangential", "radial")
STROKE, ROD, BORE = 0.18, 0.35, 0.14  # m, of the engine ntua
AREA = 0.25 * math.pi * BORE**2


def apart(name: str) -> list[str]:
    return [name, f"gas_{name}", f"inertia_{name}"]


@pytest.mark.parametrize(
    ("engine", "settings"),
    [("ntua", {}), ("ntua", {"pin_offset": 0.02}), ("marine_80x345", {}), ("v6_96x81", {})],
)
def test_parts_add_up_and_each_is_what_the_total_is_alone(
    engine: str, settings: dict[str, float]
) -> None:
    asked = [name for one in COMPONENTS for name in apart(one)]
    asked += [name for one in PRESSURES for name in apart(f"{one}_pressure")]
    found = computed([*asked, *apart("reduced_torque")], engine, set=settings)
    gas = computed([*COMPONENTS], engine, set={**settings, "reciprocating_mass": 0.0})
    for name in (*COMPONENTS, *(f"{one}_pressure" for one in PRESSURES), "reduced_torque"):
        whole = found[name]
        error = np.abs(found[f"gas_{name}"] + found[f"inertia_{name}"] - whole).max()
        assert float(error) < 1e-14 * float(np.abs(whole).max()) * 8.0, name
        assert float(np.abs(found[f"inertia_{name}"]).max()) > 0.0
    for name in COMPONENTS:  # without masses the total is the gas's
        assert_array_equal(gas[name].values, found[f"gas_{name}"].values)


def test_parts_by_the_printed_formulas() -> None:
    """Kakaitsas (2.1) to (2.5) and (2.12), Rakopoulos's reduced pressures, written out."""
    found = computed(
        [*(name for one in COMPONENTS for name in apart(one)), "pressure",
         *(name for one in PRESSURES for name in apart(f"{one}_pressure")),
         *apart("reduced_torque"), "reduced_overturning_moment", *apart("overturning_moment")],
    )  # fmt: skip
    phi = np.radians(found["crank_angle"].values)
    ratio, omega, mass = 0.09 / ROD, 40.0 * math.pi, 4.97 + 6.33 * 0.094 / ROD
    beta = np.arcsin(ratio * np.sin(phi))
    bracket = np.cos(2.0 * phi) + ratio**2 * np.sin(phi) ** 4
    acceleration = np.cos(phi) + ratio * bracket / np.cos(beta) ** 3  # (1.8)
    forces = {
        "gas": AREA * (found["pressure"].values - 1.01325) * 1e5,
        "inertia": -mass * 0.09 * omega**2 * acceleration,
    }
    for part, force in forces.items():
        size = np.abs(force).max()
        rod = force / np.cos(beta)
        tangential = rod * np.sin(phi + beta)
        wanted = {
            "wall": force * np.tan(beta), "rod": rod, "tangential": tangential,
            "radial": rod * np.cos(phi + beta),
        }  # fmt: skip
        names = dict(zip(wanted, COMPONENTS, strict=True))
        for one, values in wanted.items():
            error = np.abs(found[f"{part}_{names[one]}"].values - values).max()
            assert error < 1e-13 * size
            error = np.abs(found[f"{part}_{one}_pressure"].values * 1e5 - values / AREA).max()
            assert error < 1e-13 * size / AREA
        torque = found[f"{part}_reduced_torque"].values * 1e5  # mu = p_T/2
        assert np.abs(torque - 0.5 * tangential / AREA).max() < 1e-13 * size / AREA
        overturning = found[f"{part}_overturning_moment"].values
        assert np.abs(overturning + 0.09 * tangential).max() < 1e-13 * size
    assert_array_equal(found["reduced_overturning_moment"], -found["reduced_torque"])


@pytest.mark.parametrize("offset", [0.0, 0.02])
def test_volume_is_that_of_the_closed_triangle(offset: float) -> None:
    found = computed(["cylinder_volume", "pressure", "imep"], set={"pin_offset": offset})
    volume, angle = found["cylinder_volume"], np.radians(found["crank_angle"].values)
    assert volume.attrs["units"] == "cm3"
    assert float(volume.max() / volume.min()) == pytest.approx(
        17.433233, rel=1e-12 if offset == 0.0 else 1e-4
    )
    # the pin at (e, y): the rod's length closes the triangle with the crank at theta
    crank, rod = 0.5 * STROKE, ROD
    if offset:  # the crank ratio of the engine is kept: 0.09/0.35
        for _ in range(60):
            rod = crank / (0.09 / 0.35)
            swept = math.sqrt((rod + crank) ** 2 - offset**2)
            swept -= math.sqrt((rod - crank) ** 2 - offset**2)
            crank *= STROKE / swept
    top = math.asin(offset / (rod + crank))
    theta = angle + top
    height = crank * np.cos(theta) + np.sqrt(rod**2 - (crank * np.sin(theta) - offset) ** 2)
    travel = math.sqrt((rod + crank) ** 2 - offset**2) - height
    wanted = AREA * (STROKE / 16.433233 + travel) * 1e6
    assert_allclose(volume.values, wanted, rtol=1e-9)
    # the work of the loop is imep times the swept volume: the area of the polygon, to its step
    p, v = np.append(found["pressure"], found["pressure"][0]), np.append(volume, volume[0])
    work = np.sum(0.5 * (p[1:] + p[:-1]) * np.diff(v)) * 0.1  # J
    assert work / (AREA * STROKE * 1e5) == pytest.approx(float(found["imep"]), rel=2e-4)


@pytest.mark.parametrize("engine", ["ntua", "v6_96x81", "parallel_twin_270"])
def test_inertia_over_the_angle_keeps_the_energy(engine: str) -> None:
    """Theta(phi) omega^2/2 of the solution with variable inertia gains what the torques do."""
    found = computed(
        ["instantaneous_inertia", "instantaneous_engine_inertia", "engine_inertia", "omega",
         "gas_torque", "friction_torque", "load_torque"],
        engine, solver={"inertia_model": "variable", "tolerance": 1e-8},
        output={"angle_step": 0.25},
    )  # fmt: skip
    theta = found["instantaneous_inertia"]
    own = found["instantaneous_engine_inertia"]
    assert float(own.mean()) == pytest.approx(float(found["engine_inertia"]), rel=1e-12)
    assert_allclose(theta - theta.mean(), own - own.mean(), atol=1e-14)
    assert float(theta.max() - theta.min()) > 1e-4 * float(theta.mean())
    energy = (0.5 * theta * found["omega"] ** 2).values
    power = (found["gas_torque"] - found["friction_torque"] - found["load_torque"]).values
    step = math.radians(0.25)
    gained = np.concatenate([[0.0], np.cumsum(0.5 * (power[1:] + power[:-1]) * step)])
    swing = np.ptp(gained)
    # the trapezoidal rule at a quarter of a degree, over a whole cycle
    assert np.abs(energy - energy[0] - gained).max() < 1e-3 * swing


def test_speed_at_the_start() -> None:
    solver = {"method": "thesis", "passes": 3}
    found = computed(
        ["omega_start", "omega"], axes={"inertia": [2.0, 5.0]},
        solver={**solver, "start_angle": 0.0, "start_speed": 125.6},
    )  # fmt: skip
    assert_array_equal(found["omega_start"], found["omega"].sel(crank_angle=0.0))
    assert float(computed(["omega_start"])["omega_start"]) == float(
        computed(["omega"])["omega"].sel(crank_angle=-180.0)
    )
    # A march that is not closed jumps at its start angle.
    with pytest.raises(SceneError) as told:
        computed(
            ["omega_start"], output={"angle_step": 4.0},
            solver={"method": "thesis", "start_angle": 30.0},
        )  # fmt: skip
    assert str(told.value) == (
        "scene: [solver] start_angle = 30: 'omega_start' is a point of the speed curve; must be "
        "one of its angles, in steps of 4 degrees ([output] angle_step)"
    )
    with pytest.raises(SceneError, match=r"\[designs\] start_angle = 2: "):
        computed(
            ["omega_start"], output={"angle_step": 4.0}, solver={"method": "thesis"},
            designs={"start_angle": [0.0, 2.0], "inertia": [2.0, 3.0]},
        )  # fmt: skip
    # Kakaitsas (2015), section 5.4: 119.038 and 124.46 rad/s; the diagrams were fitted.
    found = computed(
        ["omega_start"], set={"crankcase_pressure": 0.0}, solver={"method": "thesis"},
        designs={
            "cylinders": [2, 4], "passes": [20, 6], "start_speed": [125.6, 125.6],
            "start_angle": [0.0, 0.0],
        },
    )  # fmt: skip
    assert found["omega_start"].values == pytest.approx([119.038, 124.46], rel=1e-3)


@pytest.mark.parametrize(
    ("engine", "settings"),
    [
        ("ntua", {"counterweight_mass": 3.0, "counterweight_radius": 0.07}),
        ("ntua", {"counterweight_fraction": 0.5, "pin_offset": 0.01}),
        ("parallel_twin_270", {"counterweight_fraction": 0.4}),
    ],
)
def test_the_shaking_force_is_the_sum_of_its_parts(engine: str, settings: dict[str, float]) -> None:
    found = computed(
        ["reciprocating_force", "throw_force", "counterweight_force", "shaking_force"], engine,
        set=settings,
    )  # fmt: skip
    parts = found["reciprocating_force"] + found["throw_force"] + found["counterweight_force"]
    size = float(np.abs(found["reciprocating_force"]).max())
    assert float(np.abs(parts - found["shaking_force"]).max()) < 1e-12 * size


GRAVITY = 9.80665
RADIUS = 0.5 * STROKE
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
