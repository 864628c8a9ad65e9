"""Scenes on balance, flywheel and characteristic, and of engines without a diagram."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import sweeps
from engine_dyn import flywheel
from engine_dyn.forces import balance
from engine_dyn.geometry.cylinders import even_cylinders
from sweeps.scene.engine.engine_files import load_engine
from tests.support.commands import ok
from tests.support.scenes import computed, write_scene

pytestmark = pytest.mark.compiled

RPM = math.pi / 30.0


def test_forces_on_axes() -> None:
    found = computed(
        ["shaking_force", "shaking_moment", "shaking_force_max", "shaking_force_major"],
        set={"cylinder_spacing": 0.2},
        axes={"cylinders": [1, 4, 6], "speed": [1000, 1200], "counterweight_fraction": [0, 0.5]},
        output={"angle_step": 10.0, "highest_order": 4},
    )
    assert found["shaking_force"].dims == (
        "cylinders", "speed", "counterweight_fraction", "direction", "crank_angle",
    )  # fmt: skip
    assert found["direction"].values.tolist() == [0.0, 90.0]
    assert found["direction"].attrs["units"] == "degree"
    assert found["shaking_force_major"].dims[-1] == "order"
    assert found["shaking_moment"].attrs["units"] == "N m"
    values = load_engine("ntua", Path()).values
    rod = 0.09 / values["crank_ratio"]
    mass = values["piston_mass"] + values["rod_mass"] * values["rod_centre_of_gravity"] / rod
    phi = np.radians(found["crank_angle"].values)
    for count in (1, 4, 6):
        for share in (0.0, 0.5):
            gear = balance.running_gear(
                even_cylinders(count, 4.0 * math.pi), values["crank_ratio"], 0.09, mass,
                1200 * RPM, turning_mass=-share * mass, spacing=0.2,
            )  # fmt: skip
            here = found.sel(cylinders=count, speed=1200, counterweight_fraction=share)
            force, moment = gear.force(phi), gear.moment(phi)
            assert_allclose(
                here["shaking_force"].values, [force.real, force.imag], rtol=1e-12, atol=1e-8
            )
            assert_allclose(
                here["shaking_moment"].values, [moment.real, moment.imag], rtol=1e-12, atol=1e-8
            )
            assert float(here["shaking_force_max"]) == float(gear.force_max())


def test_counterweights_by_mass_and_by_fraction_agree() -> None:
    by_fraction = computed(
        ["counterweight_required", "shaking_force_max"], engine="b112",
        set={"counterweight_fraction": 0.5, "counterweight_radius": 0.03134},
    )  # fmt: skip
    weight = float(by_fraction["counterweight_required"])
    assert weight == pytest.approx(2.109, abs=6e-4)
    by_mass = computed(
        ["shaking_force_max"], engine="b112",
        set={"counterweight_mass": weight, "counterweight_radius": 0.03134},
    )  # fmt: skip
    assert float(by_mass["shaking_force_max"]) == pytest.approx(
        float(by_fraction["shaking_force_max"]), rel=1e-12
    )
    # without counterweights all that rotates shakes too
    bare = computed(["shaking_force_max"], engine="b112", set={"counterweight_mass": 0.0})
    assert float(bare["shaking_force_max"]) > 2.0 * float(by_mass["shaking_force_max"])


@pytest.mark.parametrize(
    ("scene", "quantity", "message"),
    [
        ({"set": {"counterweight_fraction": 1.2}}, "shaking_force_max",
         "counterweight_fraction = 1.2: must be a finite number from 0 to 1"),
        ({"set": {"counterweight_radius": 0}}, "counterweight_required",
         "counterweight_radius = 0: must be a finite number above 0"),
        ({"set": {"balance_shaft_radius": 0, "balance_shaft_mass": 1}}, "shaking_force_max",
         "balance_shaft_radius = 0: must be a finite number above 0"),
        ({"set": {"balance_shaft_mass": 1}}, "shaking_force_max",
         "'shaking_force_max' needs balance_shaft_radius"),
        ({}, "shaking_moment_max", "needs cylinder_spacing"),
        ({"set": {"counterweight_fraction": 0.5, "counterweight_mass": 1}}, "shaking_force_max",
         "both determine the counterweights"),
        ({"axes": {"cylinders": [1, 11]}}, "shaking_force_max",
         "cylinders = 11: no firing order is known, which 'shaking_force_max' needs"),
        ({"set": {"wanted_delta": 0}}, "inertia_required", "wanted_delta = 0: must be"),
        ({"set": {"wanted_delta": "boat"}}, "inertia_required", "or one of 'pump'"),
        ({"set": {"wanted_delta": 0.1, "inertia": 2}}, "delta", "give one of them"),
        ({"set": {"wanted_delta": 0.1, "flywheel_inertia": 2}}, "delta", "give one of them"),
        ({}, "inertia_required", "needs wanted_delta"),
        ({"set": {"wanted_delta": 0.1, "flywheel_outer_diameter": 0.2,
                  "flywheel_inner_diameter": 0.3}}, "flywheel_mass",
         "flywheel_outer_diameter = 0.2 m with flywheel_inner_diameter = 0.3 m"),
        ({"characteristic": {"kind": "disel"}}, "delta", "did you mean 'diesel'"),
        ({"characteristic": {}}, "delta", "must have either kind or coefficients"),
        ({"characteristic": {"kind": "diesel"}, "set": {"load": 50}}, "delta",
         "load: not allowed together with"),
        ({"characteristic": {"kind": "diesel"}}, "delta", "'delta' needs rated_"),
        ({"set": {"rated_power": 1.0, "rated_speed": 1000}}, "characteristic_power",
         r"needs a table \[characteristic\]"),
    ],
)  # fmt: skip
def test_bad_input(scene: dict[str, Any], quantity: str, message: str) -> None:
    with pytest.raises(sweeps.SceneError, match=message):
        computed([quantity], **scene)


def test_wanted_delta_replaces_the_inertia() -> None:
    names = ["inertia_required", "delta", "omega_max", "inertia_energy_swing_error",
             "inertia_share", "flywheel_inertia_required", "engine_inertia",
             "flywheel_mass"]  # fmt: skip
    given = {"flywheel_outer_diameter": 0.6, "flywheel_inner_diameter": 0.4}
    models = {"inertia_model": ["constant", "variable"]}
    good = computed(
        names, axes={"wanted_delta": ["generator", "pump, coarse"], "speed": [900, 1200]},
        set=given, solver=models,
    )  # fmt: skip
    assert good["wanted_delta"].values.tolist() == [1 / 300, 1 / 20]
    assert_allclose(
        good["delta"], np.broadcast_to(good["wanted_delta"].values[:, None, None], (2, 2, 2)),
        rtol=1e-6,
    )  # fmt: skip
    assert (good["status"] == 0).all()
    # the status tells what the search met, not that the inertia is NaN; to meet it takes long
    none = computed(names, set={**given, "wanted_delta": 1.9})
    assert (none["status"] == 1).all()
    assert none["inertia_required"].isnull().all()
    assert none["omega_max"].isnull().all()
    again = computed(["delta"], axes={"inertia": good["inertia_required"].values[1, :, 0].tolist()})
    assert float(again["delta"][1]) == pytest.approx(1 / 20, rel=1e-6)
    added = good["inertia_required"] - good["engine_inertia"]
    assert_allclose(good["flywheel_inertia_required"], added)
    assert_allclose(good["flywheel_mass"], flywheel.ring_mass(added.values, 0.6, 0.4), rtol=1e-12)


def test_what_the_flywheel_adds_to_auxiliaries_and_load() -> None:
    given = {"wanted_delta": "generator", "auxiliary_inertia": 0.5, "load_inertia": 3.0,
             "gear_ratio": 2.0}  # fmt: skip
    names = ["inertia_required", "flywheel_inertia_required", "engine_inertia", "delta"]
    found = computed(names, set=given)
    alone = computed(names, set={"wanted_delta": "generator"})
    assert float(found["inertia_required"]) == float(alone["inertia_required"])
    added = found["inertia_required"] - found["engine_inertia"] - 0.5 - 4.0 * 3.0
    assert float(found["flywheel_inertia_required"]) == pytest.approx(float(added))
    in_parts = computed(["delta"], set={**{k: v for k, v in given.items() if k != "wanted_delta"},
                                   "flywheel_inertia": float(added)})  # fmt: skip
    assert float(in_parts["delta"]) == pytest.approx(1 / 300, rel=1e-6)
    driven = computed(["inertia_required", "delta"], engine="compressor_79x83",
                      axes={"wanted_delta": [0.02, 0.1]})  # fmt: skip
    assert (driven["status"] == 0).all()
    assert_allclose(driven["delta"], driven["wanted_delta"], rtol=1e-6)


@pytest.mark.parametrize("kind", ["diesel", "propeller"])
def test_the_load_follows_the_speed(kind: str) -> None:
    found = computed(
        ["torque_mean", "brake_power", "characteristic_torque", "characteristic_power",
         "characteristic_load", "delta"],
        axes={"speed": [700, 1000, 1400], "characteristic_share": [0.4, 1.0]},
        set={"rated_power": 20e3, "rated_speed": 1400}, characteristic={"kind": kind},
    )  # fmt: skip
    share = found["characteristic_share"].values
    for brake, curve in (("torque_mean", "characteristic_torque"),
                         ("brake_power", "characteristic_power")):  # fmt: skip
        wanted = found[curve].values[:, None] * share
        assert_allclose(found[brake].values, wanted, rtol=1e-10)
    assert found["characteristic_torque"].dims == ("speed",)
    assert found["delta"].dims == ("speed", "characteristic_share")
    # the same diagram named by its load gives the same
    place = found.sel(speed=1000, characteristic_share=0.4)
    named = computed(["delta"], set={"speed": 1000, "load": float(place["characteristic_load"])})
    assert float(named["delta"]) == pytest.approx(float(place["delta"]), rel=1e-6)


def test_the_load_follows_with_all_that_the_torque_depends_on() -> None:
    found = computed(
        ["torque_mean", "characteristic_torque"], engine="si_four_87x101",
        axes={"auxiliary_torque": [0, 5], "speed": [2000, 4000]},
        set={"rated_power": 60e3, "rated_speed": 5000, "pressure_factor": [1, 1, 0.9, 1]},
        characteristic={"coefficients": [1.0, 1.0]},
        auxiliaries=[{"mean": 3.0, "harmonics": [{"order": 2, "cosine": 1.0}]}],
    )  # fmt: skip
    assert_allclose(
        found["torque_mean"].values,
        np.broadcast_to(found["characteristic_torque"].values, (2, 2)), rtol=1e-10,
    )  # fmt: skip


@pytest.mark.parametrize(
    ("engine", "scene"),
    [
        ("ntua", {"set": {"rated_power": 20e3, "rated_speed": 1400}}),
        ("si_four_87x101", {"set": {"rated_power": 60e3, "rated_speed": 5000, "speed": 3000,
                                    "compression_ratio": 9.0}}),
    ],
)  # fmt: skip
def test_torques_beyond_the_diagrams_are_designs_that_fail(
    engine: str, scene: dict[str, Any]
) -> None:
    names = ["delta", "torque_mean", "characteristic_torque", "characteristic_load", "imep",
             "status", "main_journal_load_max", "omega"]  # fmt: skip
    shares = [0.7, 0.9, 40.0]
    curve = {"kind": "diesel"}
    found = computed(
        names, engine, axes={"characteristic_share": shares}, characteristic=curve, **scene
    )
    assert found["status"].values.tolist() == [0, 0, 4]
    for name in names:
        if name in ("status", "characteristic_torque"):
            continue
        values = found[name].values
        assert np.isfinite(values[:2]).all() and np.isnan(values[2]).all(), name
    alone = computed(
        names, engine, axes={"characteristic_share": shares[:2]}, characteristic=curve, **scene
    )
    for name in names:
        if "characteristic_share" in found[name].dims:
            assert_array_equal(found[name].values[:2], alone[name].values, name)
    none = computed(
        ["delta", "inertia_required"], engine, characteristic=curve,
        set={**scene["set"], "characteristic_share": 40.0, "wanted_delta": 0.02},
    )  # fmt: skip
    assert int(none["status"]) == 4
    assert np.isnan(float(none["inertia_required"]))


@pytest.fixture(scope="module")
def asgari() -> Any:
    return sweeps.run("asgari")


def test_asgari_reproduces_its_source(asgari: Any) -> None:
    """Printed numbers within half a unit of their last digit, a whole unit where they are cut."""
    limits = {
        "rod_mass_at_crank": 5e-4, "rod_mass_at_piston": 5e-4, "rotating_mass": 5e-4,
        "unbalanced_mass": 5e-4, "counterweight_required": 6e-4, "balance_shaft_asgari": 1.5e-3,
        "flywheel_mean_diameter": 1e-12, "cycle_work": 1e-2, "triangle_expansion_work": 2e-2,
        "triangle_torque_max": 0.1, "triangle_torque_mean": 0.1, "triangle_torque_excess": 0.05,
        "inertia_triangular": 5e-3,
    }  # fmt: skip
    first = asgari.isel(design=0)
    for name, limit in limits.items():
        assert float(first[name]) == pytest.approx(float(first[f"{name}_published"]), abs=limit), (
            name
        )
    # printed wrong: see docs/validation.md
    assert float(first["rim_speed"]) == pytest.approx(42.41, abs=5e-3)
    assert float(first["triangle_energy_swing"]) == pytest.approx(352.9, abs=0.05)
    assert float(asgari["delta"]) == pytest.approx(0.04, rel=1e-6)
    # Of the shafts of Table 1, that of (13) leaves least, contrary to the table.
    largest = asgari["shaking_force_max"].values
    assert largest.argmin() == 0
    second = float(first["shaking_force_major"].sel(order=2.0))
    assert_allclose(asgari["shaking_force_major"].sel(order=2.0).values, second, rtol=1e-12)
    assert largest[0] == pytest.approx(second, rel=0.05)


def test_lecture18_has_the_resultants_of_the_lecture() -> None:
    found = sweeps.run("lecture18")
    lam = balance.acceleration_harmonics(2.0, 90.0 / 350.0).real
    names = found["case"].values.tolist()
    for place, case in enumerate(names):
        here = found.isel(design=place)
        expected = {
            "one cylinder": (1.0, lam, 0.0, 0.0),
            "two in line, 180 degrees": (0.0, 2.0 * lam, 1.0, 0.0),
            "four in line": (0.0, 4.0 * lam, 0.0, 0.0),
            "six in line": (0.0, 0.0, 0.0, 0.0),
        }[case]
        got = [
            (here[f"shaking_{what}_major"].sel(order=n) / here["inertia_force_unit"] / lever).values
            for what, lever in (("force", 1.0), ("moment", 0.2))
            for n in (1.0, 2.0)
        ]
        for values, value in zip(got, expected, strict=True):
            assert_allclose(values, value, atol=1e-12)
    # Two in line: the sign is the printed one too. The middle of the crank is between the throws.
    two = found.isel(design=names.index("two in line, 180 degrees"), direction=0)
    phi = np.radians(found["crank_angle"].values)
    moment = -0.2 * two["inertia_force_unit"].values[:, None] * np.cos(phi)
    assert_allclose(two["shaking_moment"], moment, atol=1e-12 * np.abs(moment).max())
    assert_allclose(found["delta"], 0.03, rtol=1e-6)
    assert (found["status"] == 0).all()
    assert_allclose(found["torque_mean"], found["characteristic_torque"], rtol=1e-10)


@pytest.mark.parametrize("engine", ["v8_cross_plane_93x86", "v8_flat_plane_94x93"])
def test_a_v8_has_its_spacing_and_a_missing_fraction_its_reason(
    engine: str, tmp_path: Path
) -> None:
    """Throws that cancel have no best fraction of the force; that of the moment is a half."""
    archive = tmp_path / "v8.nc"
    scene = write_scene(
        tmp_path, ["best_fraction_rms", "shaking_moment_rms"], engine=engine,
        set={"balance_shaft_radius": 0.03}, axes={"counterweight_fraction": [0.4, 0.5, 0.6],
        "balance_shaft_mass": [0.1 * k for k in range(12)]},
    )  # fmt: skip
    ok("run", scene, "-o", archive)
    for more in ((), ("--select", "balance_shaft_mass=0")):  # many rows, and few
        text = " ".join(ok("show", archive, *more).split())
        assert "none if the counterweights of all throws cancel" in text
    with sweeps.open(archive) as found:
        assert np.isnan(found["best_fraction_rms"]).all()
        moment = found["shaking_moment_rms"].values
    if engine.startswith("v8_cross"):
        assert moment[1] < 1e-9 * moment[0]
    assert moment[0] == pytest.approx(moment[2], rel=1e-9)


RADIUS, LENGTH, SPACING, OMEGA = 0.045, 0.15, 0.11, 100.0 * math.pi
TURNING, RECIPROCATING = 0.6 * (1.0 - 0.04 / LENGTH), 0.5 + 0.6 * 0.04 / LENGTH

HEAD = """
title = "V8 of 90 degrees"
cycle = "four-stroke"
"""
VALUES = """
[values]
stroke = 0.09
rod_length = 0.15
piston_mass = 0.5
rod_mass = 0.6
rod_centre_of_gravity = 0.04
crank_mass = 0.0
cylinder_spacing = 0.11
"""
NAMED = HEAD + 'arrangement = "V8 cross-plane"\n' + VALUES + "cylinders = 8\nspeed = 3000\n"
ANGLES = HEAD + VALUES + """
[arrangement]
banks = [0, 90]
throws = [{ angle = 0 }, { angle = 270 }, { angle = 90 }, { angle = 180 }]
cylinders = [
  { throw = 1, bank = 1, firing_angle = 0 }, { throw = 2, bank = 1, firing_angle = 90 },
  { throw = 3, bank = 1, firing_angle = 270 }, { throw = 4, bank = 1, firing_angle = 180 },
  { throw = 1, bank = 2, firing_angle = 450 }, { throw = 2, bank = 2, firing_angle = 540 },
  { throw = 3, bank = 2, firing_angle = 360 }, { throw = 4, bank = 2, firing_angle = 630 },
]
"""  # fmt: skip
BALANCE = ["shaking_force_max", "shaking_moment_max", "shaking_moment_major", "engine_inertia",
           "counterweight_required", "balance_couple_required", "best_fraction_rms"]  # fmt: skip


@pytest.mark.parametrize("text", [NAMED, ANGLES], ids=["named", "angles alone"])
def test_the_balance_of_a_cross_plane_v8(text: str, tmp_path: Path) -> None:
    """(2 m_rod + m_rec) r omega^2 a sqrt(10): the pair of a pin pulls with m_rec all around."""
    path = tmp_path / "v8.toml"
    path.write_text(text, encoding="utf-8")
    assert load_engine(path).values["cylinders"] == 8.0
    scene = {
        "engine": str(path), "output": {"quantities": BALANCE},
        "set": {"speed": 3000.0, "counterweight_mass": 0.0, "counterweight_radius": 0.045},
    }  # fmt: skip
    found = sweeps.run(scene)
    moment = (2.0 * TURNING + RECIPROCATING) * RADIUS * OMEGA**2 * SPACING * math.sqrt(10.0)
    assert moment == pytest.approx(2379.0, abs=0.5)
    first = found["shaking_moment_major"].sel(order=1.0)
    assert float(first) == pytest.approx(moment, rel=1e-12)
    assert float(found["engine_inertia"]) == pytest.approx(0.0126, abs=5e-6)
    assert "no diagrams" in ok("info", path)
