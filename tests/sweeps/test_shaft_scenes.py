"""Scenes with a shaft that twists: the same numbers as by other ways, and what is refused."""

from __future__ import annotations

import copy
import math
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from numpy.testing import assert_allclose, assert_array_equal

import sweeps
from engine_dyn.units import RPM
from sweeps.base.errors import SceneError
from sweeps.decide.explore.shaft_extremes import barred_speeds, worst_of_shaft
from sweeps.scene.plan.plausibility import plausibility_warnings
from tests.support.scenes import refusal
from tests.support.shafts import DIESEL, dense

ENGINE = "diesel_105x137"
FORCED = ["shaft_torque_order", "shaft_torque_phase", "shaft_torque_half_range"]

GEARED: dict[str, Any] = {
    "reciprocating": "added",
    "loss_factor": 0.02,
    "load": "propeller",
    "discs": [
        *({"name": f"throw {i}", "throw": i, "inertia": 0.03, "damping": 1.5} for i in range(1, 7)),
        {"name": "flywheel", "inertia": 2.0},
        {"name": "pinion", "inertia": 0.05},
        {"name": "wheel", "inertia": 1.0},
        {"name": "propeller", "inertia": 5.0, "ground_stiffness": 100.0},
    ],
    "shafts": [
        *({"stiffness": 1.25e6, "diameter": 0.083} for _ in range(5)),
        {"length": 0.2, "diameter": 0.08, "bore": 0.02, "shear_modulus": 80.0},
        {"name": "coupling", "stiffness": 2e4, "loss_factor": 0.15, "damping": 3.0},
        {"between": ["wheel", "propeller"], "stiffness": 1e5},
    ],
    "gears": [{"between": ["pinion", "wheel"], "ratio": -0.4}],
    "dampers": [{"on": "throw 1", "inertia": 0.1, "damping": 20.0, "stiffness": 1e4}],
}
"""Six throws with a damper, a rubber coupling, a gear and a propeller on a branch."""


SWUNG = {"on": "flywheel", "mass": 1.5, "distance": 0.12, "length": 0.0133, "stop_angle": 30.0}
"""A pendulum of order 3.004."""


def run(quantities: list[str], shaft: Any = ENGINE, **tables: Any) -> xr.Dataset:
    """What a scene of the diesel gives; nobody is warned of inertias that are made up."""
    tables.setdefault("set", {"speed": 1500})
    tables.setdefault("engine", ENGINE)
    output = {"quantities": quantities, **tables.pop("output", {})}
    return sweeps.run(shaft=shaft, silenced_warnings=["all"], output=output, **tables)


def changed(**changes: Any) -> dict[str, Any]:
    """The geared shaft with other keys, or values of lists: `discs__6__inertia`."""
    shaft: dict[str, Any] = copy.deepcopy(GEARED)
    for place, value in changes.items():
        *path, last = place.split("__")
        inside: Any = shaft
        for key in path:
            inside = inside[int(key) if key.isdigit() else key]
        if value is None:
            del inside[int(last) if last.isdigit() else last]
        else:
            inside[int(last) if last.isdigit() else last] = value
    return shaft


BARE = changed(
    shafts=[{"stiffness": 1e6}] * 7 + [{"between": ["wheel", "propeller"], "stiffness": 1e5}]
)
"""Without a number that only stresses, limits and heat need."""


def throw_torques(archive: xr.Dataset) -> Any:
    """Complex harmonics of the torque on each throw, (throw, order)."""
    phase = np.radians(archive.throw_torque_phase.values)
    return archive.throw_torque_order.values * np.exp(1j * phase)


def shaft_torques(archive: xr.Dataset) -> Any:
    """Complex harmonics of the torque in each shaft."""
    return archive.shaft_torque_order.values * np.exp(
        1j * np.radians(archive.shaft_torque_phase.values)
    )


def test_the_measured_diesel_is_a_dense_solution_with_torques_of_the_same_archive() -> None:
    found = run(
        [*FORCED, "throw_torque_order", "throw_torque_phase", "natural_frequency"],
        set={"speed": 2170, "load_damping": 0.0},
    )
    torque = np.zeros((9, 24), dtype=complex)
    torque[2:8] = throw_torques(found)
    for place, order in enumerate(found.order.values):
        _, expected = dense(order * 2170 * RPM, torque[:, place], **DIESEL)
        assert_allclose(shaft_torques(found)[:, place], expected, rtol=1e-9)
    # The page's numbers, by openTorsion's matrices; half ranges of orders up to 12 alone are 8064.
    assert found.natural_frequency.values[:3] == pytest.approx([216.6, 592.7, 984.9], abs=0.05)
    assert float(found.shaft_torque_half_range[-1]) == pytest.approx(8041.6, rel=1e-3)


def test_half_ranges_are_of_all_orders_whatever_is_stored() -> None:
    """Of 48 orders beside twelve, and of a dense solution over 28800 angles; at any speed."""
    names = [
        "shaft_torque_half_range",
        "delta_elastic",
        "shaft_loss",
        "crankshaft_twist_half_range",
    ]
    shaft = {
        "reciprocating": "added",
        "discs": [
            {"name": "pulley", "inertia": 0.006},
            *({"name": str(i), "inertia": 0.012, "throw": i} for i in range(1, 5)),
            {"name": "flywheel", "inertia": 0.3},
        ],
        "shafts": [{"stiffness": k} for k in (60e3, 350e3, 350e3, 350e3, 450e3)],
    }  # fmt: skip
    axes = {"speed": [600.0, 2150.0, 2900.0]}
    few, many = (
        run(names, shaft, engine="si_four_87x101", set={}, axes=axes,
            output={"highest_order": highest})
        for highest in (3, 48)
    )  # fmt: skip
    for name in names:
        assert_array_equal(few[name], many[name], err_msg=name)
    found = run(
        [*FORCED, "delta_elastic", "disc_angle_order", "disc_angle_phase"], shaft, set={},
        axes=axes, engine="si_four_87x101", output={"highest_order": 90},
    )  # fmt: skip
    phi = np.arange(28800) * (4.0 * math.pi / 28800)
    phase = np.radians(found.shaft_torque_phase.values)
    harmonics = found.shaft_torque_order.values * np.exp(1j * phase)
    curves = (harmonics @ np.exp(1j * np.outer(found.order, phi))).real
    assert_allclose(found.shaft_torque_half_range, 0.5 * np.ptp(curves, axis=-1), rtol=1e-3)
    turns = np.radians(found.disc_angle_order.isel(disc=5).values) * np.exp(
        1j * np.radians(found.disc_angle_phase.isel(disc=5).values)
    )
    waves = np.exp(1j * np.outer(found.order, phi))
    swing = np.ptp(((1j * found.order.values * turns) @ waves).real, axis=-1)
    assert_allclose(found.delta_elastic, swing, rtol=1e-3)
    # Order 14 meets the pulley's 503 Hz at 2156 rpm.
    assert float(few.shaft_torque_half_range[1, 0]) > 3.0 * 12.7


def test_gear_branch_damper_and_load_are_a_dense_solution() -> None:
    """The load damps by the slope of its law at the crank; its disc turns 0.4 times as fast."""
    found = run(
        [*FORCED, "throw_torque_order", "throw_torque_phase", "torque_mean", "shaft_inertia"],
        GEARED,
    )
    radius, ratio, mass = 0.0685, 0.0685 / 0.207, 2.521
    phi = np.arange(720) * math.pi / 360
    velocity = np.sin(phi) * (1 + ratio * np.cos(phi) / np.sqrt(1 - (ratio * np.sin(phi)) ** 2))
    fast = mass * radius**2 * np.mean(velocity**2)
    omega = 1500 * RPM
    slope = 2.0 * float(found.torque_mean) / omega  # exponent 2 and no constant part
    inertia = [0.03 + fast] * 6 + [2.0, 0.05, 1.0, 5.0, 0.1]
    shafts = [(i, i + 1) for i in range(7)] + [(8, 9), (0, 10)]
    tube = math.pi * 80e9 * (0.08**4 - 0.02**4) / (32 * 0.2)
    assert float(found.shaft_inertia) == pytest.approx(
        sum(inertia[:8]) + 0.1 + 0.16 * 6.0, rel=1e-6
    )
    for place, order in enumerate(found.order.values):
        torque = np.zeros(11, dtype=complex)
        torque[:6] = throw_torques(found)[:, place]
        _, expected = dense(
            order * omega, torque, inertia, [1.25e6] * 5 + [tube, 2e4, 1e5, 1e4], shafts,
            loss_factor=[0.02] * 6 + [0.15, 0.02, 0.0],
            damping=[0.0] * 6 + [3.0, 0.0, 20.0],
            disc_damping=[1.5] * 6 + [0.0] * 3 + [slope / 0.4**2, 0.0],
            ground_stiffness=[0.0] * 9 + [100.0, 0.0], meshes=[(7, 8)], ratios=[-0.4],
        )  # fmt: skip
        assert_allclose(shaft_torques(found)[:, place], expected, rtol=1e-8)


def test_a_stiff_shaft_is_the_rigid_engine() -> None:
    """At small fluctuation, with all damping that of the load and friction of the load's law.

    The rigid engine is not linear: what is left falls with the square of delta.
    """
    off = []
    for heavy in (20.0, 200.0):
        shaft = {
            "reciprocating": "included",
            "load": "flywheel",
            "discs": [
                *({"name": f"throw {i}", "throw": i, "inertia": 0.02} for i in range(1, 7)),
                {"name": "flywheel", "inertia": heavy},
            ],
            "shafts": [{"stiffness": 1e12} for _ in range(6)],
        }
        found = run(
            ["delta", "delta_elastic", "crankshaft_twist_half_range"], shaft,
            set={"speed": 1500, "load": 100}, output={"highest_order": 24},
        )  # fmt: skip
        off.append(abs(float(found.delta_elastic / found.delta) - 1.0))
        assert float(found.crankshaft_twist_half_range) < 1e-6
    assert off[0] < 3e-4 and off[1] < 5e-5, off


def test_a_misfire_takes_the_torque_of_its_throw_and_wakes_the_half_order() -> None:
    names = ["shaft_torque_mean", "shaft_torque_order", "torque_mean", "shaft_torque_min",
             "shaft_torque_half_range"]  # fmt: skip
    found = run(names, axes={"misfire": range(7)})
    mean = found.shaft_torque_mean
    assert_allclose(-mean[:, -1], found.torque_mean, rtol=1e-12)
    step = -np.diff(mean.values[:, 1:], axis=1)  # of each throw
    assert np.allclose(step[0], step[0, 0])
    for silent in range(1, 7):
        assert step[silent].argmin() == silent - 1 and step[silent].min() < 0.0
    half = found.shaft_torque_order.sel(order=0.5).isel(shaft=-1)
    assert float(half[0]) < 0.01 * float(half[1:].min())
    # The least of the whole torque: below the mean by at most the range of the vibration.
    lowest = np.abs(mean) - found.shaft_torque_min
    assert (lowest <= 2.0 * found.shaft_torque_half_range).all()
    assert (lowest >= 0.0).all()


@pytest.mark.parametrize("keys", [{}, {"load_exponent": 0}, {"load_damping_factor": 1.0},
                                  {"load_square": 1e-3}])  # fmt: skip
def test_a_mean_torque_that_no_load_balances_has_one_outcome(keys: dict[str, float]) -> None:
    """Rigid engine and shaft have no steady state where the load is more than the torque."""
    found = run(
        ["delta", "delta_elastic", "shaft_torque_half_range"],
        set={"speed": 1500, **keys}, axes={"load_offset": [0.0, 4000.0]},
    )  # fmt: skip
    assert found.status.values.tolist() == found.torsion_status.values.tolist() == [0, 2]
    assert np.isfinite(found.delta_elastic[0]) and np.isnan(found.delta_elastic[1])
    assert np.isnan(found.shaft_torque_half_range[1]).all()


def test_the_load_damps_by_its_law_a_factor_or_a_number(tmp_path: Path) -> None:
    mean = float(run(["torque_mean"]).torque_mean)
    names = ["shaft_torque_half_range", "delta_elastic", "modal_damping_ratio"]

    def same(one: dict[str, Any], other: dict[str, Any], within: float = 1e-11) -> bool:
        found = [run(names, set={"speed": 1500, **keys}) for keys in (one, other)]
        return all(np.allclose(found[0][n], found[1][n], rtol=within) for n in names)

    number = {"load_damping": 2.0 * mean / (1500 * RPM)}
    assert same({}, number)
    assert same({"load_damping_factor": 2.0}, number)
    assert same({"load_exponent": 3.0}, {"load_damping_factor": 3.0})
    assert same({"load_exponent": 0.0}, {"load_damping": 0.0})
    assert not same({"load_damping_factor": 4.0}, number)
    # Of other laws the slope at the mean speed counts.
    omega = 1500 * RPM
    speeds = np.linspace(500, 3000, 400)
    rows = "".join(f"{n},{(n * RPM) ** 2}\n" for n in speeds)
    tmp_path.joinpath("fan.csv").write_text(f"speed_rpm,torque_Nm\n{rows}")
    for law, slope in (
        ({"load_linear": 2.0, "load_square": 0.01}, (2.0 + 0.02 * omega) / (2.0 + 0.01 * omega)),
        ({"load_table": str(tmp_path / "fan.csv")}, 2.0),
    ):
        assert same(law, {"load_damping_factor": slope}, 1e-6)
    # What the scene gives holds over what the shaft does, whichever of the two it is.
    of_shaft = run(names, changed(load_damping=5.0), set={"speed": 1500, "load_damping_factor": 2})
    alone = run(names, GEARED, set={"speed": 1500, "load_damping_factor": 2})
    for name in names:
        assert_array_equal(of_shaft[name], alone[name])


def test_modes_critical_speeds_and_vector_sums() -> None:
    found = run(
        ["natural_frequency", "critical_speed", "mode_vector_sum", "mode_shape", "mode_node",
         "modal_inertia", "phase_vector_sum"],
    )  # fmt: skip
    expected = 60.0 * found.natural_frequency / found.order
    assert_allclose(found.critical_speed, expected, rtol=1e-12)
    shape = found.mode_shape.values
    assert_allclose(np.abs(shape).max(axis=1), 1.0)
    inertia = np.array(DIESEL["inertia"])
    assert_allclose(found.modal_inertia, (inertia * shape**2).sum(axis=1), rtol=1e-12)
    fire = np.radians([0.0, 480.0, 240.0, 600.0, 120.0, 360.0])  # 1-5-3-6-2-4
    vectors = np.exp(-1j * np.outer(fire, found.order))
    assert_allclose(found.mode_vector_sum, np.abs(shape[:, 2:8] @ vectors), rtol=1e-9, atol=1e-12)
    # One node in the first mode, two in the second.
    assert np.isfinite(found.mode_node).sum(axis=1).values.tolist()[:3] == [1, 2, 3]


def test_limits_are_given_or_those_of_propulsion_shafts() -> None:
    """IACS UR M68 at a speed ratio of 0.5: 600 MPa, 100 mm, c_K = 1 allow 76.0 MPa."""
    changes: dict[str, Any] = {
        "shafts__1__stress_limit": 30.0, "shafts__1__torque_limit": 2e3,
        "shafts__2__diameter": 0.1, "shafts__2__tensile_strength": 700.0,
        "shafts__2__shape_factor": 1.0,
    }  # fmt: skip
    found = run(
        ["shaft_stress_limit", "shaft_stress_half_range", "shaft_stress_over_limit",
         "shaft_torque_over_limit", "shaft_torque_half_range", "propulsion_stress_limit",
         "propulsion_stress_limit_passing", "propulsion_stress_over_limit"],
        changed(**changes), set={"speed": 1000, "rated_speed": 2000},
    )  # fmt: skip
    assert found.shaft_stress_limit.values[1] == 30.0
    assert np.isnan(found.shaft_stress_limit.values[[0, 2]]).all()
    stress, torque = found.shaft_stress_half_range[1], found.shaft_torque_half_range[1]
    assert float(found.shaft_stress_over_limit[1]) == pytest.approx(float(stress) / 30.0)
    assert float(found.shaft_torque_over_limit[1]) == pytest.approx(float(torque) / 2e3)
    assert float(found.propulsion_stress_limit[2]) == pytest.approx(76.0, abs=0.06)
    assert float(found.propulsion_stress_limit_passing[2]) == pytest.approx(1.7 * 76.0, abs=0.1)
    assert np.isnan(found.propulsion_stress_limit.values[[0, 1]]).all()
    over = found.propulsion_stress_over_limit[2]
    assert float(over) == pytest.approx(float(found.shaft_stress_half_range[2]) / 76.0, rel=1e-3)
    alloy = run(
        ["propulsion_stress_limit"], changed(**changes, shafts__2__steel="alloy"),
        set={"speed": 1000, "rated_speed": 2000},
    )  # fmt: skip
    limit = float(alloy.propulsion_stress_limit[2])
    assert limit == pytest.approx(76.0 * 860.0 / 760.0, abs=0.06)


def test_a_coupling_is_unknown_beyond_its_table() -> None:
    """24 N m beyond 5: neither the stiffness of the end, nor a word of a converged design."""
    names = ["shaft_torque_half_range", "natural_frequency", "delta", "shaft_torque_mean"]

    def of(last: float) -> xr.Dataset:
        table = {"torque": [0.0, last], "stiffness": [1e4, 3e4]}
        shaft = changed(shafts__6__stiffness=None, shafts__6__stiffness_over_torque=table)
        return run(names, shaft)

    mean = abs(float(of(5e3).shaft_torque_mean[6]))
    inside, outside = of(1.01 * mean), of(0.99 * mean)
    assert int(inside.torsion_status) == 0
    assert int(outside.torsion_status) == 4 and np.isfinite(float(outside.delta))
    for name in names[:2]:
        assert np.isfinite(inside[name]).all() and np.isnan(outside[name]).all(), name


def test_a_coupling_without_a_mean_torque_stops_no_other_design() -> None:
    """A power that the diagrams do not reach has no torque, by which the table would be read."""
    throws = [{"name": f"throw {i}", "throw": i, "inertia": 0.01, "damping": 1.0}
              for i in range(1, 5)]  # fmt: skip
    table = {"torque": [0.0, 5e3], "stiffness": [1e4, 3e4]}
    shaft = {
        "reciprocating": "included", "load": "load",
        "discs": [*throws, {"name": "flywheel", "inertia": 0.2}, {"name": "load", "inertia": 0.5}],
        "shafts": [*({"stiffness": 1e6} for _ in throws), {"stiffness_over_torque": table}],
    }  # fmt: skip
    archive = run(
        ["shaft_torque_half_range", "natural_frequency"], shaft, engine="si_four_87x101",
        characteristic={"kind": "spark ignition"}, axes={"rated_power": [60e3, 900e3]},
        set={"speed": 3000.0, "rated_speed": 5000.0},
    )  # fmt: skip
    assert archive.torsion_status.values.tolist() == [0, 4]
    for name in ("shaft_torque_half_range", "natural_frequency"):
        known = np.isfinite(archive[name].transpose("rated_power", ...).values)
        assert known[0].all() and not known[1].any(), name


def test_values_that_no_shaft_has_are_warned_of() -> None:
    def said(shaft: Any, **tables: Any) -> str:
        scene = {"engine": ENGINE, "shaft": shaft, "set": {"speed": 1500},
                 "output": {"quantities": ["shaft_stress_half_range"]}, **tables}  # fmt: skip
        return "\n".join(plausibility_warnings(sweeps.plan(scene)))

    assert said(GEARED) == "" and said(ENGINE) == ""
    line = said(changed(shafts__1__stiffness=1250.0))
    assert line.startswith("shaft_section: shaft 2, 'throw 2 - throw 3' of 1250 N m/rad")
    assert said(changed(shafts__1__stiffness=1250.0), silenced_warnings=["shaft_section"]) == ""
    light = changed(**{f"discs__{i}__inertia": 0.004 for i in range(6)}, reciprocating="included")
    assert "152 % of the inertia of a throw's disc, which is said to hold their mean" in said(light)
    # A shaft of 20 mm: more than 1000 MPa, which a report must not call usual.
    thin = changed(**{f"shafts__{i}__diameter": 0.02 for i in range(5)})
    found = sweeps.run(
        engine=ENGINE, shaft=thin, silenced_warnings=["shaft_section"], set={"speed": 1500},
        output={"quantities": ["shaft_stress_half_range"]},
    )  # fmt: skip
    assert float(found.shaft_stress_half_range.max()) > 1000.0
    assert "shaft_stress_half_range" in str(found.attrs["warnings"])


def test_warnings_where_the_rigid_engine_is_far_from_the_shaft() -> None:
    def said(shaft: Any, quantity: str = "delta", **tables: Any) -> str:
        scene = {"engine": ENGINE, "shaft": shaft, "set": {"speed": 2000},
                 "output": {"quantities": [quantity]}, **tables}  # fmt: skip
        return "\n".join(plausibility_warnings(sweeps.plan(scene)))

    # Order 3 is 100 Hz and order 6 200 Hz, against 216.6 Hz.
    line = said(ENGINE)
    assert line.startswith("rigid_shaft: order 6 at 2000 rpm, 200 Hz, moves the flywheel")
    # At resonance it is as large as the response with its damping: the archive's own angle.
    (ratio,) = re.findall(r"flywheel ([\d.]+) times", said(ENGINE, set={"speed": 2166}))
    at = {"set": {"speed": 2166}}
    found = run(["disc_angle_order", "torque_order", "shaft_inertia"], **at).sel(order=6.0)
    angle = found["torque_order"] / (found["shaft_inertia"] * (6.0 * 2166.0 * RPM) ** 2)
    whole = found["disc_angle_order"].isel(disc=-1) * math.pi / 180.0 / angle
    assert float(ratio) == pytest.approx(float(whole), rel=0.02)
    stiff = changed(
        **{f"shafts__{i}__stiffness": 1e9 for i in range(5)}, shafts__5__length=1e-4,
        shafts__6__stiffness=1e9, shafts__7__stiffness=1e9, dampers=[],
    )  # fmt: skip
    assert said(stiff) == ""
    assert said(ENGINE, silenced_warnings=["rigid_shaft"]) == ""
    assert said(ENGINE, "natural_frequency") == ""
    light = changed(**{f"discs__{i}__inertia": 0.01 for i in range(6)})
    line = said(light, "shaft_torque_half_range")
    assert line.startswith("reciprocating_share: the reciprocating masses have 38 % of the inertia")
    assert said(light, "shaft_torque_half_range", silenced_warnings=["reciprocating_share"]) == ""


def test_the_worst_over_speed_and_misfire_and_barred_speeds() -> None:
    names = ["shaft_torque_half_range", "shaft_torque_min", "shaft_torque_over_limit",
             "disc_angle_order"]  # fmt: skip
    shaft = {**GEARED, "shafts": copy.deepcopy(GEARED["shafts"])}
    shaft["shafts"][3]["torque_limit"] = 2500.0
    speeds = np.arange(1000.0, 2401.0, 100.0).tolist()
    found = run(names, shaft, set={}, axes={"misfire": [0, 2], "speed": speeds})
    worst = {(one.quantity, one.place): one for one in worst_of_shaft(found)}
    one = worst["shaft_torque_half_range", "throw 4 - throw 5"]
    torque = found.shaft_torque_half_range.isel(shaft=3)
    assert one.value == float(torque.max()) and one.unit == "N m"
    assert float(torque.sel(one.at)) == one.value
    assert worst["shaft_torque_min", "coupling"].value == float(
        found.shaft_torque_min.isel(shaft=6).min()
    )
    assert {"order", "speed", "misfire"} == set(worst["disc_angle_order", "flywheel"].at)
    ranges = barred_speeds(found)
    assert ranges and {one.place for one in ranges} == {"throw 4 - throw 5"}
    over = found.shaft_torque_over_limit.isel(shaft=3).max("misfire")
    inside = sum((found.speed >= one.low) & (found.speed <= one.high) for one in ranges)
    assert_array_equal(inside.values.astype(bool), over.values > 1.0)
    for one in ranges:  # ends lie where the line through points is 1, or where speeds end
        for end in (one.low, one.high):
            if end not in (1000.0, 2400.0):
                assert float(over.interp(speed=end)) == pytest.approx(1.0)
    with pytest.raises(SceneError, match="shaft_stress_over_limit"):
        barred_speeds(found[["shaft_torque_min"]])
    with pytest.raises(SceneError, match="no quantities of discs or shafts"):
        worst_of_shaft(found[["torsion_status"]])


def test_the_mean_torque_chooses_the_stiffness_of_a_coupling() -> None:
    table = {"torque": [0.0, 500.0, 2000.0], "stiffness": [1e4, 2e4, 8e4]}
    shaft = changed(shafts__6__stiffness=None, shafts__6__stiffness_over_torque=table)
    names = ["shaft_torque_half_range", "natural_frequency", "modal_damping_ratio"]
    speeds = [1000.0, 2300.0]
    found = run([*names, "shaft_torque_mean"], shaft, axes={"speed": speeds}, set={})
    for i in range(2):
        mean = float(abs(found.shaft_torque_mean[i, 6]))
        stiffness = float(np.interp(mean, table["torque"], table["stiffness"]))
        given = run(names, set={"speed": float(found.speed[i]), "shaft_stiffness_7": stiffness},
                    shaft=GEARED)  # fmt: skip
        for name in names:
            assert_allclose(found[name][i], given[name], rtol=1e-11, err_msg=name)
    assert abs(float(found.shaft_torque_mean[0, 6] - found.shaft_torque_mean[1, 6])) > 50.0


def test_an_engine_file_has_a_shaft(tmp_path: Path) -> None:
    own = Path(sweeps.__file__).parent / "catalogue/engines/diesel_105x137.toml"
    text = own.read_text(encoding="utf-8").replace(
        "firing_order", 'shaft = "diesel_105x137"\nfiring_order', 1
    )
    text = text.replace(
        '"diesel_105x137_pressure.csv"', f'"{own.parent}/diesel_105x137_pressure.csv"'
    )
    path = tmp_path / "engine.toml"
    path.write_text(text, encoding="utf-8")
    said = refusal({"engine": str(path), "output": {"quantities": ["delta"]}})
    assert "inertia: not allowed together with shaft" in said
    path.write_text(text.replace("inertia = 2.3552", "# "), encoding="utf-8")
    names = ["natural_frequency", "delta", "shaft_inertia"]
    found = sweeps.run(engine=str(path), set={"speed": 1500}, output={"quantities": names})
    assert float(found.shaft_inertia) == pytest.approx(2.3552)
    other = run(names, GEARED, engine=str(path))
    assert other.natural_frequency[0] < 0.2 * found.natural_frequency[0]


@pytest.mark.parametrize(
    ("shaft", "expected"),
    [
        (changed(shafts__7=None), "disc 'propeller': no shafts or gears join it"),
        (changed(shafts__2__between=["throw 1", "throw 2"]), "form a ring"),
        (changed(shafts__2__stiffness=-1.0), "shafts number 3 stiffness = -1: must be a finite"),
        (changed(shafts__2__stiffness=0), "shafts number 3 stiffness = 0: must be a finite"),
        (changed(shafts__2__stiffness=None), "shafts number 3: stiffness: missing"),
        (changed(shafts__5__stiffness=1e6), "shafts number 6: has both stiffness and length"),
        (changed(shafts__5__diameter=None), "shafts number 6: diameter: missing"),
        (changed(shafts__5__bore=0.08), "shafts number 6 bore = 0.08: must be below the diameter"),
        (changed(shafts__7__between=["wheel", "screw"]), "no such disc"),
        (changed(shafts__7__between=["wheel", "wheel"]), "two different discs"),
        (changed(shafts__7__between=None), "forms a ring|form a ring|no shafts or gears"),
        (changed(discs__0__inertia=0), "discs number 1 inertia = 0: must be a finite"),
        (changed(discs__3__name="throw 1"), "the name 'throw 1' is given twice"),
        (changed(discs__3__throw=1), "throw = 1: is on disc number 1 already"),
        (changed(discs__3__throw=9), "throws 1, 2, 3, 5, 6, 9: must be the numbers of all throws"),
        (changed(discs__5__throw=None), "has discs for 5 throws, the engine diesel_105x137 has 6"),
        (changed(gears__0__ratio=0), "gears number 1 ratio = 0: must not be 0"),
        (changed(gears__0__ratio="fast"), "gears number 1 ratio"),
        (changed(dampers__0__on="throw 9"), "dampers number 1 on = 'throw 9': no such disc"),
        (changed(dampers__0__damping=0, dampers__0__stiffness=0), "nothing holds its ring"),
        (changed(pendulums=[{**SWUNG, "on": "sky"}]), "pendulums number 1 on = 'sky': no such"),
        (changed(pendulums=[{**SWUNG, "length": 0.0}]), "pendulums number 1 length = 0: must be"),
        (changed(shafts__6__stiffness_over_torque={"torque": [0, 1], "stiffness": [1, 2]}),
         "has both stiffness and stiffness_over_torque"),
        (changed(shafts__6__stiffness=None, shafts__6__stiffness_over_torque={
            "torque": [2, 1], "stiffness": [1, 2]}), "must ascend from 0 or more"),
        (changed(shafts__6__stiffness=None, shafts__6__stiffness_over_torque={
            "torque": [0, 1, 2], "stiffness": [1, 2]}), "has 3 torques and 2 stiffnesses"),
        (changed(flywheel="wheels"), "flywheel = 'wheels': no such disc; did you mean 'wheel'"),
        (changed(load="water"), "load = 'water': no such disc"),
        (changed(reciprocating=None), "reciprocating: missing; must be 'included'"),
        (changed(reciprocating="half"), "reciprocating = 'half': must be 'included'"),
        (changed(shafts__2__stress_limit=30e3), r"stress_limit = 30000: .* below 3000 \[MPa\]"),
        (changed(shafts__2__tensile_strength=600e6), r"tensile_strength = 6.* is it in Pa\?"),
        (changed(shafts__5__shear_modulus=80e9), r"shear_modulus = 8.* below 1000 \[GPa\]"),
        (changed(shafts__2__tensile_strength=600.0), "needs shaft_shape_factor_3, shape_factor"),
        (changed(shafts__2__steel="brass"), "steel = 'brass': must be 'carbon' or 'alloy'"),
        (changed(loss_factor=-1,
                 shafts=[{**piece, "loss_factor": 0.1} for piece in GEARED["shafts"]]),
         r"\[shaft\] loss_factor = -1: must be"),
        (changed(shear_modulus=-80.0), r"\[shaft\] shear_modulus = -80: must be"),
        (changed(load_damping=1, load_damping_factor=2), "both load_damping and load_damping_f"),
        (changed(discs=[{"name": f"{i}", "inertia": 1.0} for i in range(41)]), "2 to 40 tables"),
        (changed(shafts__2__stifness=3), "stifness: unknown key; did you mean 'stiffness'"),
        ("diesel_105x138", "unknown shaft; did you mean 'diesel_105x137'"),
        ("nothere.toml", "no such file"),
        (3, "must be a table"),
    ],
)  # fmt: skip
def test_no_shaft(shaft: Any, expected: str) -> None:
    scene = {"engine": ENGINE, "shaft": shaft, "output": {"quantities": ["natural_frequency"]}}
    assert re.search(expected, refusal(scene)), refusal(scene)


@pytest.mark.parametrize(
    ("tables", "expected"),
    [
        ({"set": {"inertia": 2.0}}, r"\[set\] inertia: not allowed together with a shaft"),
        ({"axes": {"flywheel_inertia": [1, 2]}}, r"\[axes\] flywheel_inertia: not allowed"),
        ({"set": {"disc_inertia_10": 2.0}}, "no disc number 10; the shaft has 9 discs"),
        ({"set": {"damper_inertia_1": 2.0}}, "no damper number 1; the shaft has 0 dampers"),
        ({"set": {"shaft_length_3": 2.0}}, "has no effect: the stiffness of shaft 3 is given"),
        ({"set": {"shaft_bore_3": 0.1}}, "must be below the smallest shaft_diameter_3"),
        ({"set": {"shaft_stiffness_3": -1.0}}, "must be a finite"),
        ({"axes": {"cylinders": [4, 6]}}, "not allowed to vary with a shaft"),
        ({"set": {"cylinders": 4}}, "has discs for 6 throws"),
        ({"set": {"load_damping": 1.0, "load_damping_factor": 1.0}}, "give one of them"),
        ({"shaft": changed(auxiliaries="wheel")},
         r"\[shaft\] auxiliaries = 'wheel': has no effect: neither scene nor engine"),
        *(
            ({"shaft": BARE, "output": {"quantities": [name]}}, f"'{name}' needs {number} of a")
            for name, number in (
                ("shaft_stress_half_range", "diameter"), ("shaft_stress_limit", "stress_limit"),
                ("shaft_torque_over_limit", "torque_limit"),
                ("propulsion_stress_limit", "diameter"), ("pendulum_swing_half_range", "mass"),
                ("pendulum_swing_over_stop", "stop_angle"), ("damper_heat_per_area", "surface"),
            )
        ),
        ({"shaft": None}, "'natural_frequency' needs a shaft"),
        ({"shaft": None, "set": {"disc_inertia_1": 1.0}, "output": {"quantities": ["delta"]}},
         r"\[set\] disc_inertia_1: the scene has no shaft"),
    ],
)  # fmt: skip
def test_keys_that_do_not_fit_the_shaft(tables: dict[str, Any], expected: str) -> None:
    scene = {"engine": ENGINE, "shaft": ENGINE,
             "output": {"quantities": ["natural_frequency"]}, **tables}  # fmt: skip
    scene = {key: table for key, table in scene.items() if table is not None}
    assert re.search(expected, refusal(scene)), refusal(scene)


@pytest.mark.parametrize(
    ("key", "value"),
    [("disc_inertia_7", 1e30), ("disc_inertia_7", 1e-30), ("shaft_stiffness_7", 1e30),
     ("shaft_stiffness_7", 1e-30), ("damper_damping_1", 1e30), ("pendulum_mass_1", 1e6),
     ("pendulum_length_1", 1e-30), ("disc_ground_stiffness_10", 1e30)],
)  # fmt: skip
def test_absurd_numbers_of_one_design_stop_no_other(key: str, value: float) -> None:
    names = ["natural_frequency", "critical_speed", "modal_damping_ratio", "shaft_torque_min",
             "shaft_torque_half_range"]  # fmt: skip
    shaft = changed(pendulums=[SWUNG])
    plain = run(names, shaft)
    own = {
        "disc_inertia_7": 2.0,
        "shaft_stiffness_7": 2e4,
        "damper_damping_1": 20.0,
        "pendulum_mass_1": 1.5,
        "pendulum_length_1": 0.0133,
        "disc_ground_stiffness_10": 100.0,
    }
    found = run(names, shaft, designs={key: [value, own[key]]})
    for name in names:
        assert_array_equal(
            found[name].isel(design=1) if "design" in found[name].dims else found[name],
            plain[name],
            err_msg=name,
        )


def test_an_undamped_resonance_has_a_status_and_no_infinity() -> None:
    """Order 6 meets the first frequency of an undamped shaft exactly; other speeds have numbers."""
    shaft = {
        "reciprocating": "included",
        "discs": [*({"name": f"throw {i}", "throw": i, "inertia": 0.04} for i in range(1, 7)),
                  {"name": "flywheel", "inertia": 2.0}],
        "shafts": [{"stiffness": 1.2e6} for _ in range(6)],
        "load_damping": 0.0,
    }  # fmt: skip
    critical = run(["critical_speed"], shaft).critical_speed.sel(mode=1, order=6)
    found = run(
        ["shaft_torque_half_range"], shaft, axes={"speed": [1500.0, float(critical)]}, set={}
    )
    assert found.torsion_status.values.tolist() == [0, 2]
    assert np.isnan(found.shaft_torque_half_range[1]).all()
    assert np.isfinite(found.shaft_torque_half_range[0]).all()
