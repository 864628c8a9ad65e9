"""Series, forces, orders, bearing loads and the torque along the shaft, in scenes."""

from typing import Any

import numpy as np
import pytest
import xarray as xr
from numpy.testing import assert_allclose

import sweeps
from engine_dyn.geometry import kinematic_series, slider_crank
from sweeps.base.errors import SceneError
from sweeps.scene.plan.plan import make_plan
from sweeps.scene.reading import read_scene
from tests.support.scenes import computed, refusal


def test_series_of_the_mechanism() -> None:
    scene = {
        "engine": "marine_80x345",
        "axes": {"crank_ratio": [0.2, 0.5], "truncation": [2, 4], "speed": [60, 70]},
        "output": {"quantities": ["acceleration_coefficient", "acceleration_truncation_error"]},
    }
    plan = make_plan(read_scene(scene))
    assert [s.node.name for s in plan.stages] == scene["output"]["quantities"]
    assert plan.unused == ("speed",)
    found = sweeps.run(scene)
    assert found["acceleration_coefficient"].dims == ("crank_ratio", "order")
    assert found["order"].values.tolist() == list(range(1, 13))  # two-stroke
    assert found["acceleration_truncation_error"].dims == ("crank_ratio", "truncation")
    names = ["acceleration_truncated", "velocity_truncated", "position_truncated"]
    plain = computed(names)
    phi = np.radians(plain["crank_angle"].values)
    wanted = kinematic_series.truncated_acceleration(phi, 9 / 35, 2)
    assert plain["acceleration_truncated"].values == pytest.approx(wanted, abs=1e-12)
    four = computed(names, set={"truncation": 4})
    exact = slider_crank.acceleration(phi, 9 / 35)
    error = np.abs(four["acceleration_truncated"].values - exact).max()
    assert 0.0 < error < np.abs(wanted - exact).max()
    for name in ("position_coefficient", "position_mean", "velocity_truncated",
                 "position_truncation_error"):  # fmt: skip
        with pytest.raises(SceneError, match=f"{name} is that of a centred mechanism"):
            computed([name], set={"pin_offset": 0.002})


@pytest.mark.parametrize(
    ("message", "tables"),
    [
        *((f"truncation = {value:g}: must be an even number from 2 to 40", table)
          for value in (3, 1, 2.5)
          for table in ({"set": {"truncation": value}}, {"axes": {"truncation": [2, value]}})),
    ],
)  # fmt: skip
def test_truncation_is_an_even_number(message: str, tables: dict[str, Any]) -> None:
    """When the scene is read, not while it runs."""
    assert message in refusal({"engine": "ntua", "output": {"quantities": ["imep"]}, **tables})


def test_forces_are_one_anothers_components() -> None:
    found = computed(
        ["piston_force", "gas_force", "inertia_force", "wall_thrust", "rod_force",
         "tangential_force", "radial_force", "gas_tangential_force", "inertia_tangential_force",
         "gas_torque", "inertia_torque", "overturning_moment", "rod_angle", "reduced_torque",
         "tangential_pressure", "piston_pressure"],
        axes={"speed": [900, 1500], "load": [50, 90]},
    )  # fmt: skip
    force = found["gas_force"] + found["inertia_force"]
    size = float(np.abs(force).max())
    beta, theta = np.radians(found["rod_angle"]), np.radians(found["crank_angle"])
    rod, area = found["rod_force"], 0.25 * np.pi * 0.14**2
    torque = found["gas_torque"] + found["inertia_torque"]
    height = 0.09 * np.cos(theta) + 0.35 * np.cos(beta)  # H, of the piston pin above the crank
    for one, other in (
        (found["piston_force"], force),
        (found["wall_thrust"], force * np.tan(beta)),
        (rod * np.cos(beta), force),
        (found["tangential_force"], rod * np.sin(theta + beta)),
        (found["radial_force"], rod * np.cos(theta + beta)),
        # one cylinder: T r is the torque, and the frame bears the opposite
        (found["tangential_force"] * 0.09, torque),
        (found["gas_tangential_force"] * 0.09, found["gas_torque"]),
        (found["inertia_tangential_force"] * 0.09, found["inertia_torque"]),
        (found["overturning_moment"], -torque),
        # (2.8) is printed M_a = N H = -M_s, which cannot both be.
        (found["overturning_moment"], -found["wall_thrust"] * height),
        (found["piston_pressure"] * 1e5 * area, force),
        (found["reduced_torque"] * 1e5 * area * 0.18, torque),
    ):
        assert float(np.abs(one - other).max()) < 1e-12 * size
    # what the inertia needs is not computed on the load
    assert found["inertia_force"].dims == ("speed", "crank_angle")


@pytest.mark.parametrize(("engine", "turns"), [("ntua", 2), ("marine_80x345", 1)])
def test_mean_tangential_pressure_is_that_of_the_notes(engine: str, turns: int) -> None:
    found = computed(
        ["tangential_pressure_mean", "reduced_torque_mean", "imep", "tangential_pressure"],
        engine, output={"angle_step": 0.25},
    )  # fmt: skip
    wanted = float(found["imep"]) / (np.pi * turns)
    assert float(found["tangential_pressure_mean"]) == pytest.approx(wanted, rel=1e-9)
    assert float(found["reduced_torque_mean"]) == pytest.approx(0.5 * wanted, rel=1e-9)
    # and of the curve: inertia and crankcase pressure do no work over the cycle
    curve = float(found["tangential_pressure"].mean())
    assert curve == pytest.approx(wanted, rel=1e-5)


def test_kakaitsas_masses_of_the_rod() -> None:
    found = computed(
        ["two_mass_rod_inertia", "rod_inertia_excess", "rotating_force", "specific_mass",
         "inertia_pressure_order", "inertia_force", "rod_torque_error"],
        axes={"rod_inertia": [0.1, 6.33 * 0.094 * 0.256]}, set={"crankcase_pressure": 0},
    )  # fmt: skip
    two = 6.33 * 0.094 * (0.350 - 0.094)
    assert float(found["two_mass_rod_inertia"]) == pytest.approx(two, rel=1e-12)
    assert found["rod_inertia_excess"].values == pytest.approx([0.1 - two, 0.0], abs=1e-15)
    assert found["rod_torque_error"].values[1] == pytest.approx(0.0, abs=1e-12)
    plain = computed(["rod_couple", "rod_inertia_excess", "rod_torque_error", "rod_thrust_error"])
    for name in plain.data_vars:
        assert (plain[name] == 0.0).all(), name
    omega = 1200 * np.pi / 30
    turning = 1.00 + 6.33 * 0.256 / 0.350  # Kakaitsas 4.1 prints 1.00 - 4.63 = 5.63
    assert float(found["rotating_force"]) == pytest.approx(turning * 0.09 * omega**2, rel=1e-12)
    mass = 4.97 + 6.33 * 0.094 / 0.350
    volume = 0.25 * np.pi * 0.14**2 * 0.18
    assert float(found["specific_mass"]) == pytest.approx(mass / volume, rel=1e-12)
    # amplitudes of the inertia force over the piston, by its transform
    force = found["inertia_force"].values
    found_orders = -2.0 * np.fft.rfft(force).real[1:25] / force.size * (-1.0) ** np.arange(1, 25)
    area = 0.25 * np.pi * 0.14**2
    wanted = found["inertia_pressure_order"].values * 1e5 * area
    # the archive's cycle begins at -360 degrees: order nu/2 is turned by nu half turns
    assert wanted[1::2] == pytest.approx(found_orders[1::2] * 1.0, abs=1e-6 * abs(wanted).max())


ORDERS = ["gas_torque", "inertia_torque", "torque", "gravity_torque"]


@pytest.mark.parametrize(
    ("engine", "settings"),
    [
        ("diesel_105x137", {}),
        ("v6_96x81", {}),
        ("marine_80x345", {}),
        ("ntua", {"pin_offset": 0.004}),
        ("si_four_87x101", {"pressure_factor": [0.0, 1.0, 1.0, 0.9],
                            "mass_factor": [1.0, 1.0, 1.1, 1.0]}),
    ],
)  # fmt: skip
def test_orders_make_the_curve(engine: str, settings: dict[str, Any]) -> None:
    names = [f"{name}_{part}" for name in ORDERS for part in ("order", "phase")]
    found = computed(
        [*names, "gas_torque", "inertia_torque", "gravity_torque", "friction_torque", "torque"],
        engine, set=settings, output={"angle_step": 0.25, "highest_order": 360},
    )  # fmt: skip
    phi = np.radians(found["crank_angle"])
    for name in ORDERS:
        angle = found["order"] * phi + np.radians(found[f"{name}_phase"])
        waves = (found[f"{name}_order"] * np.cos(angle)).sum("order")
        curve = found[name]
        size = float(np.abs(curve).max())
        rest = np.abs(curve - curve.mean() - waves).max()
        # a spline's third derivative jumps: what is above order 360 is some 1e-3 at most
        assert float(rest) < (1e-3 if name in ("gas_torque", "torque") else 1e-9) * size + 1e-9


def test_orders_cancel_and_throws_add_up() -> None:
    names = ["phase_vector_sum", "torque_order", "cylinder_torque_order"]
    found = computed(names, "diesel_105x137", axes={"cylinders": [1, 4, 6]})
    sums = found["phase_vector_sum"]
    assert sums.sel(cylinders=6, order=[3.0, 6.0, 2.5, 1.0]).values.tolist() == pytest.approx(
        [6.0, 6.0, 0.0, 0.0]
    )
    assert sums.sel(cylinders=4, order=[2.0, 3.0]).values.tolist() == pytest.approx([4.0, 0.0])
    product = sums * found["cylinder_torque_order"]
    assert np.allclose(found["torque_order"], product, rtol=1e-11)
    assert found["cylinder_torque_order"].dims == ("order",)
    found = computed(
        ["throw_torque_order", "throw_torque_phase", "torque_order", "torque_phase"], "v6_96x81"
    )

    def complexes(name: str) -> Any:
        return found[f"{name}_order"] * np.exp(1j * np.radians(found[f"{name}_phase"]))

    whole = complexes("throw_torque").sum("throw")
    limit = 1e-9 * float(found["throw_torque_order"].max())
    assert np.allclose(whole, complexes("torque"), atol=limit)
    assert found.sizes["throw"] == 3  # of a V6


def test_journals_and_their_largest_load() -> None:
    found = computed(["main_journal_load_max", "main_journal_x"], "diesel_105x137",
                axes={"cylinders": [1, 4, 6]})  # fmt: skip
    assert found["main_bearing"].values.tolist() == [1, 2, 3, 4, 5, 6, 7]
    known = np.isfinite(found["main_journal_load_max"]).sum("main_bearing")
    assert known.values.tolist() == [2, 5, 7]
    assert np.isfinite(found["main_journal_x"].sel(cylinders=6)).all()
    found = computed(
        ["crank_pin_load", "crank_pin_load_max", "crank_pin_load_mean", "crank_pin_peak_angle",
         "piston_pin_load", "piston_pin_load_max", "main_journal_load", "main_journal_load_max",
         "main_journal_peak_angle", "crank_pin_x", "crank_pin_y", "crank_pin_radial",
         "crank_pin_tangential", "main_journal_radial", "main_journal_tangential"],
        "v6_96x81", output={"angle_step": 0.05},
    )  # fmt: skip
    for load in ("crank_pin", "piston_pin", "main_journal"):
        largest = found[f"{load}_load"].max("crank_angle")
        assert np.allclose(found[f"{load}_load_max"], largest, rtol=2e-5), load
    pin = found["crank_pin_load"]
    assert float(pin.mean()) == pytest.approx(float(found["crank_pin_load_mean"]), rel=1e-4)
    assert abs(float(pin.idxmax()) - float(found["crank_pin_peak_angle"])) < 0.1
    assert np.allclose(np.hypot(found["crank_pin_x"], found["crank_pin_y"]), pin, rtol=1e-12)
    turned = np.hypot(found["crank_pin_radial"], found["crank_pin_tangential"])
    assert np.allclose(turned, pin, rtol=1e-12)
    turned = np.hypot(found["main_journal_radial"], found["main_journal_tangential"])
    assert np.allclose(turned, found["main_journal_load"], rtol=1e-12)


@pytest.mark.parametrize(
    "weights",
    [
        {"axes": {"counterweight_mass": [0.0, 2.0, 9.0]}, "set": {"counterweight_radius": 0.1}},
        {"axes": {"counterweight_fraction": [0.0, 0.5, 1.0]}},
    ],
)
def test_journals_and_the_wall_bear_the_shaking_force(weights: dict[str, Any]) -> None:
    """What the frame gets from journals, wall and head is what the balance says: other code."""
    names = ["main_journal_x", "main_journal_y", "gas_force", "wall_thrust", "shaking_force",
             "gravity_torque"]  # fmt: skip
    found = computed(names, **weights)
    across = found["main_journal_x"].sum("main_bearing") - found["wall_thrust"]
    along = found["main_journal_y"].sum("main_bearing") + found["gas_force"]
    limit = 1e-11 * float(np.abs(found["gas_force"]).max())
    force = found["shaking_force"]
    assert float(np.abs(along - force.sel(direction=0)).max()) < limit
    assert float(np.abs(across - force.sel(direction=90)).max()) < limit
    # one that is not said is none, here: 0 kg, but a fraction of 0 balances all that turns
    bare = computed(["main_journal_y", "gravity_torque"])
    (axis,) = weights["axes"]
    first = found.isel({axis: 0})
    same = axis == "counterweight_mass"
    for name in ("main_journal_y", "gravity_torque"):
        assert bool(np.array_equal(bare[name], first[name])) is same


def test_scene_mosakowski_is_compared_with_equation_16() -> None:
    found = sweeps.run("mosakowski")
    error = found["acceleration_truncation_error"]
    published = found["acceleration_truncation_error_published"]
    assert np.isfinite(published.sel(truncation=2)).all()
    assert np.isnan(published.sel(truncation=4)).all()
    ratio = found["crank_ratio"].values
    equation = ratio / (1.0 + ratio) * (1.0 / np.sqrt(1.0 - ratio**2) - 1.0)
    # Six digits are kept, which is more than a figure shows.
    assert_allclose(published.sel(truncation=2), equation, rtol=5e-6)
    assert_allclose(error.sel(truncation=2), equation, rtol=1e-12)
    # His text: slightly over 1 % at 0.3, over 5 % at 0.5.
    assert 0.01 < float(published.sel(crank_ratio=0.3, truncation=2)) < 0.012
    assert float(published.sel(crank_ratio=0.5, truncation=2)) > 0.05
    assert float(error.sel(crank_ratio=0.5, truncation=4)) < 0.2 * float(
        error.sel(crank_ratio=0.5, truncation=2)
    )


QUANTITIES = [
    "torque_after_throw", "torque_after_throw_range", "first_mode_torque_rms",
    "first_mode_torque_order", "first_mode_vector_sum", "throw_torque_order",
    "throw_torque_phase", "main_journal_load", "main_journal_load_max", "main_journal_load_rms",
    "any_main_journal_load_max", "all_main_journals_load_rms", "cylinder_torque_order",
]  # fmt: skip

SCENES = {
    "ntua": {"cylinders": 6},
    "v8_cross_plane_93x86": {},
    "v6_96x81": {"mass_factor": [1.0, 1.1, 0.9, 1.0, 1.05, 1.0]},
}


@pytest.fixture(scope="module", params=SCENES)
def found(request: pytest.FixtureRequest) -> xr.Dataset:
    speeds = [900.0, 2200.0]
    return sweeps.run(
        engine=request.param, set=SCENES[request.param], axes={"speed": speeds},
        output={"quantities": QUANTITIES, "angle_step": 0.5, "highest_order": 48},
    )  # fmt: skip
