"""Scenes whose shaft passes a range of speeds, against time integration of all discs."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from numpy.testing import assert_allclose, assert_array_equal
from scipy.integrate import solve_ivp

import sweeps
from engine_dyn.torsion.system import propulsion_shaft_limits
from engine_dyn.units import MPA, RPM
from sweeps.cli.exits import DESIGNS_FAILED
from sweeps.decide.explore.shaft_extremes import worst_of_shaft
from sweeps.running.compute import into_archive, limits
from sweeps.running.compute.options import Options
from sweeps.scene.plan.plan import make_plan
from sweeps.view.report import shaft_calculation
from sweeps.view.report.sections import outcomes
from tests.support.archives import interrupted
from tests.support.commands import invoke
from tests.support.scenes import refusal, write_scene
from tests.sweeps.test_shaft_excitations import DISCS, engine, of_torque, three
from tests.sweeps.test_shaft_scenes import SWUNG, run, throw_torques

TORQUE, SPEED, STATUS = "shaft_torque_in_passing", "speed_in_passing", "passing_status"
PASSES = [TORQUE, SPEED, STATUS]

UP = {"passing_start": 260.0, "passing_end": 340.0, "speed_ramp": 4.0}
DOWN = {"passing_start": 340.0, "passing_end": 260.0, "speed_ramp": 4.0}
"""Order 1.5 meets the second mode of three discs at 296 rpm."""

WITHIN = 0.01  # Of a half range over a cycle, while the orders change from one cycle to the next


def passed(
    inertia: Any, stiffness: Any, disc_damping: Any, damping: Any, forces: Any, given: Any
) -> Any:  # fmt: skip
    """Largest half range of the torques in a chain of shafts, of all cycles of a pass.

    `forces` returns the harmonics on each disc at a speed, (discs, orders), and the orders.
    """
    count, (first, last, rate) = len(inertia), (given[k] * RPM for k in UP)
    alpha, inertia = np.copysign(rate, last - first), np.asarray(inertia)
    twist = np.diff(np.eye(count), axis=0)
    k, c = np.asarray(stiffness), np.broadcast_to(damping, count - 1)
    held, slowed = twist.T @ (k[:, None] * twist), twist.T @ (c[:, None] * twist)
    slowed = slowed + np.diag(disc_damping)

    def acting(omega: float, phi: float) -> Any:
        harmonics, orders = forces(omega)
        return (harmonics @ np.exp(1j * orders * phi)).real

    state = np.zeros((2, count), dtype=complex)
    harmonics, orders = forces(first)
    for order, own in zip(orders, harmonics.T, strict=True):
        w = order * first
        angle = np.linalg.solve(held + 1j * w * slowed - w**2 * np.diag(inertia), own)
        state += np.array([angle, 1j * w * angle])

    def slope(time: float, now: Any) -> Any:
        torque = acting(first + alpha * time, (first + 0.5 * alpha * time) * time)
        torque = torque - held @ now[:count] - slowed @ now[count:]
        return np.concatenate([now[count:], torque / inertia])

    duration = (last - first) / alpha
    times = np.linspace(0.0, duration, 1 + int(duration * max(first, last) / np.radians(2.5)))
    now = solve_ivp(
        slope, (0.0, duration), state.real.ravel(), "DOP853", times, rtol=1e-6, atol=1e-9
    ).y
    torque = k[:, None] * (twist @ now[:count]) + c[:, None] * (twist @ now[count:])
    cycle = np.floor((first + 0.5 * alpha * times) * times / (4.0 * np.pi)).astype(int)
    whole = [torque[:, cycle == one] for one in range(cycle.max())]
    return np.max([0.5 * np.ptp(one, axis=1) for one in whole], axis=0)


@pytest.mark.parametrize("given", [UP, DOWN], ids=["up", "down"])
@pytest.mark.compiled
def test_a_pass_with_excitations_is_an_integration_of_all_discs(
    tmp_path: Path, given: dict[str, float]
) -> None:
    """A torque over angle, blades in step that grow with the speed, and a table over the speed."""
    path = engine(tmp_path, "[{ order = 1.5, sine = -8000 }, { order = 1, cosine = 500 }]")
    blades = {"on": "propeller", "mean": 0.0, "power": 2, "reference_speed": 400.0,
              "harmonics": [{"order": 2, "amplitude": 900.0, "phase": 20.0}]}  # fmt: skip
    mesh = {"on": "flywheel", "over_speed": [
        {"speed": s, "mean": 0.0, "harmonics": [{"order": 0.5, "cosine": t}]}
        for s, t in ((200, 100.0), (600, 900.0))]}  # fmt: skip
    shafts = [{"stiffness": 4e5, "damping": 120.0}, {"stiffness": 2e5, "damping": 60.0}]
    found = of_torque(
        path, PASSES, three(shafts=shafts, excitations=[blades, mesh]), set=given
    )  # fmt: skip

    def forces(omega: float) -> Any:
        engine = np.array([0.0, 500.0, 8000j, 0.0])
        own = np.array([0, 0, 0, 900.0 * np.exp(1j * np.radians(20.0))])
        over = np.array([np.interp(omega, np.array([200, 600]) * RPM, [100.0, 900.0]), 0, 0, 0])
        torque = np.array([engine, over, own * (omega / (400.0 * RPM)) ** 2])
        return torque, np.array([0.5, 1.0, 1.5, 2.0])

    want = passed(DISCS, [4e5, 2e5], [200.0, 0.0, 0.0], [120.0, 60.0], forces, given)
    assert int(found[STATUS]) == 0
    assert_allclose(found[TORQUE], want, rtol=WITHIN)
    assert ((found[SPEED] > 280.0) & (found[SPEED] < 310.0)).all()


@pytest.mark.slow
@pytest.mark.compiled
def test_a_pass_of_the_measured_diesel_is_an_integration_of_all_discs() -> None:
    """Gas of one load and masses that grow with the square of the speed, from one archive."""
    table = {
        "reciprocating": "included", "flywheel": "disc 9", "load_damping": 0.0,
        "discs": [{"name": f"disc {i + 1}", "inertia": one, "damping": 2.0} | (
            {"throw": i - 1} if 2 <= i < 8 else {}) for i, one in enumerate(INERTIA)],
        "shafts": [{"stiffness": one, "damping": 60.0} for one in STIFFNESS],
    }  # fmt: skip
    given = {"passing_start": 2050.0, "passing_end": 2250.0, "speed_ramp": 200.0}
    output = {"highest_order": 30}
    found = run(PASSES, shaft=table, set={"speed": 2150, **given}, output=output)
    assert int(found[STATUS]) == 0
    names = ["throw_torque_order", "throw_torque_phase", "cylinder_inertia_torque_order",
             "cylinder_inertia_torque_phase"]  # fmt: skip
    orders = run(names, set={"speed": 2150}, output=output)
    # The gas is that of the nominal speed; throws have the torque of the first one, later.
    whole, torque = throw_torques(orders), np.zeros((9, orders.sizes["order"]), dtype=complex)
    first = orders[names[2]].values * np.exp(1j * np.radians(orders[names[3]].values))
    masses = first / (2150.0 * RPM) ** 2 * whole / whole[0]
    gas = whole - masses * (2150.0 * RPM) ** 2

    def forces(omega: float) -> Any:
        torque[2:8] = gas + masses * omega**2
        return torque, orders.order.values

    want = passed(INERTIA, STIFFNESS, 9 * [2.0], 60.0, forces, given)
    assert_allclose(found[TORQUE][2:], want[2:], rtol=WITHIN)


INERTIA = [0.0170, 0.0090, 0.0467, 0.0327, 0.0467, 0.0467, 0.0327, 0.0487, 2.0750]
STIFFNESS = [1.106e6, 1.631e6, 1.253e6, 1.253e6, 1.678e6, 1.253e6, 1.253e6, 1.976e6]


def test_a_slow_pass_has_the_largest_torque_of_steady_running(tmp_path: Path) -> None:
    path = engine(tmp_path, "[{ order = 1.5, sine = -8000 }]")
    drifting = {"on": "propeller", "mean": 0.0,
                "harmonics": [{"order": 37 / 27, "amplitude": 900.0}]}  # fmt: skip
    shafts = [{"stiffness": 4e5, "loss_factor": 0.02}, {"stiffness": 2e5, "loss_factor": 0.03}]
    table = three(shafts=shafts, excitations=[drifting])
    slow = {**UP, "speed_ramp": 0.02}
    found = of_torque(path, PASSES, table, set=slow)
    speeds = np.linspace(260.0, 340.0, 801).tolist()
    axes = {"speed": speeds, "excitation_factor_1": [0, 1]}
    steady = of_torque(path, ["shaft_torque_half_range"], table, axes=axes)
    half = steady["shaft_torque_half_range"]
    # What drifts against the engine adds its own largest value, wherever that is.
    own, both = half.sel(excitation_factor_1=0), half.sel(excitation_factor_1=1)
    want = own.max("speed") + (both - own).max("speed")
    assert_allclose(found[TORQUE], want.transpose("shaft"), rtol=2e-3)


def test_keys_of_a_pass_vary_and_parts_of_a_run_are_the_whole(tmp_path: Path) -> None:
    path = engine(tmp_path, "[{ order = 1.5, sine = -8000 }]")
    table = three(passing_start=300.0, passing_end=500.0, speed_ramp=90.0)
    table["shafts"] = [{"stiffness": 4e5, "damping": 120.0}, {"stiffness": 2e5}]
    axes = {"passing_start": [300.0, 500.0], "passing_end": [350.0, 500.0],
            "speed_ramp": [60.0, 90.0]}  # fmt: skip
    whole = of_torque(path, PASSES, table, axes=axes)
    assert whole[TORQUE].dims == (*axes, "shaft") and whole[STATUS].dims == (*axes,)
    nowhere = (whole.passing_start == whole.passing_end).broadcast_like(whole[STATUS])
    assert_array_equal(whole[STATUS], np.where(nowhere, 4, 0))
    assert_array_equal(np.isnan(whole[TORQUE]).all("shaft"), nowhere)
    single = of_torque(path, PASSES, table)
    at = whole.sel(passing_start=300.0, passing_end=500.0, speed_ramp=90.0)
    for name in PASSES:
        assert_array_equal(at[name], single[name])
    columns = of_torque(
        path, PASSES, table, designs={"speed_ramp": [90.0, 60.0], "passing_start": [300.0, 500.0],
                                      "passing_end": [500.0, 350.0]},
    )  # fmt: skip
    want = whole.sel(passing_start=500.0, passing_end=350.0, speed_ramp=60.0)
    assert_array_equal(columns[TORQUE][1], want[TORQUE])


def test_limits_in_passing_are_those_given_or_of_the_rule(tmp_path: Path) -> None:
    path = engine(tmp_path, "[{ order = 1.5, sine = -8000 }]")
    names = [TORQUE, SPEED, "shaft_stress_in_passing", "shaft_stress_limit_in_passing",
             "shaft_stress_in_passing_over_limit"]  # fmt: skip
    steel = {"tensile_strength": 500.0, "shape_factor": 0.6}
    shafts = [{"stiffness": 4e5, "diameter": 0.2, "transient_stress_limit": 40.0},
              {"stiffness": 2e5, "diameter": 0.25, **steel}]  # fmt: skip
    found = of_torque(path, names, three(shafts=shafts), set={**UP, "rated_speed": 900})
    stress = 16.0 * found[TORQUE].values / (np.pi * np.array([0.2, 0.25]) ** 3) / 1e6
    assert_allclose(found["shaft_stress_in_passing"], stress, rtol=1e-12)
    limits = propulsion_shaft_limits(found[SPEED].values[1] / 900.0, 0.25, 500e6, 0.6)
    assert_allclose(found["shaft_stress_limit_in_passing"], [40.0, limits[1] / MPA], rtol=1e-9)
    ratio = stress / [40.0, limits[1] / MPA]
    assert_allclose(found["shaft_stress_in_passing_over_limit"], ratio, rtol=1e-9)
    worst = {one.quantity for one in worst_of_shaft(found)}
    assert worst == {TORQUE, "shaft_stress_in_passing", "shaft_stress_in_passing_over_limit"}
    both = [{**one, "transient_stress_limit": 30.0} for one in shafts]
    given = of_torque(path, names, three(shafts=both), set={**UP, "rated_speed": 900})
    assert_allclose(given["shaft_stress_limit_in_passing"], 30.0)
    plain = [{key: v for key, v in one.items() if key not in steel} for one in both]
    given = of_torque(path, names, three(shafts=plain), set=UP)  # Without the rated speed
    assert_allclose(given["shaft_stress_limit_in_passing"], 30.0)


def test_beyond_the_speeds_of_a_table_a_pass_has_no_numbers(tmp_path: Path) -> None:
    path = engine(tmp_path, "[{ order = 1.5, sine = -8000 }]")
    tables = {"speed": [200.0, 450.0], "damping": [100.0, 300.0]}
    mesh = {"on": "flywheel", "over_speed": [
        {"speed": s, "mean": 0.0, "harmonics": [{"order": 0.5, "cosine": 9.0}]}
        for s in (250.0, 450.0)]}  # fmt: skip
    table = three(excitations=[mesh])
    axes = {"passing_end": [400.0, 500.0]}
    start = {"passing_start": 300.0, "speed_ramp": 30.0}
    found = of_torque(path, PASSES, table, axes=axes, set=start)
    assert found[STATUS].values.tolist() == [0, 4] and np.isnan(found[TORQUE][1]).all()
    assert f"what has no number has its outcome in {STATUS}." in outcomes(found, {})
    # Damping over the speed is that of the middle of the pass
    slowed = three()
    slowed["discs"][0].pop("damping")
    slowed["discs"][0]["damping_over_speed"] = tables
    found = of_torque(path, PASSES, slowed, axes={"passing_end": [400.0, 700.0]}, set=start)
    fixed = three()
    fixed["discs"][0]["damping"] = 100.0 + 200.0 * 150.0 / 250.0
    want = of_torque(path, PASSES, fixed, set={"passing_end": 400.0, **start})
    assert found[STATUS].values.tolist() == [0, 4]
    assert_allclose(found[TORQUE][0], want[TORQUE], rtol=1e-9)


@pytest.mark.parametrize(
    ("message", "more", "settings"),
    [
        ("passing_start = 0: must be a finite number above 0", {"passing_start": 0.0}, {}),
        ("speed_ramp = -5: must be a finite number above 0", {"speed_ramp": -5.0}, {}),
        ("passing_end = -1: must be a finite number above 0", {}, {"passing_end": -1.0}),
        ("passing_end = 260: must differ from passing_start", {"passing_end": 260.0}, {}),
        ("need speed_ramp", {"speed_ramp": None}, {}),
        ("transient_stress_limit = 0: must be a finite number",
         {"shafts": [{"stiffness": 4e5, "transient_stress_limit": 0.0}, {"stiffness": 2e5}]}, {}),
        ("with pendulums", {"pendulums": [SWUNG]}, {}),
        ("there is no shaft number 3", {}, {"shaft_transient_stress_limit_3": 30.0}),
        ("must be a number", {"passing_start": "slow"}, {}),
    ],
)  # fmt: skip
def test_wrong_input_is_named(
    tmp_path: Path, message: str, more: dict[str, Any], settings: dict[str, Any]
) -> None:
    table = {**three(**{**UP, **more})}
    table = {key: value for key, value in table.items() if value is not None}
    scene = {"engine": engine(tmp_path, "[]"), "shaft": table, "set": settings,
             "output": {"quantities": PASSES}}  # fmt: skip
    assert message in refusal(scene)


def test_what_quantities_of_a_pass_need_is_named(tmp_path: Path) -> None:
    path = engine(tmp_path, "[]")
    over = {"quantities": ["shaft_stress_in_passing_over_limit"]}
    table = three(**UP)
    table["shafts"][0]["diameter"] = 0.2
    assert "needs transient_stress_limit of a shaft" in refusal(
        {"engine": path, "shaft": table, "output": over}
    )
    scene = {"engine": path, "set": UP, "output": {"quantities": ["delta"]}}
    assert "the scene has no shaft" in refusal(scene)


def test_a_report_says_whether_a_pass_is_within_its_limit() -> None:
    names = ["shaft_stress_in_passing_over_limit", SPEED, TORQUE]
    table = three(**UP)
    harmonics = [{"order": 1.5, "amplitude": 8000.0}]
    table["excitations"] = [{"on": "propeller", "mean": 0.0, "harmonics": harmonics}]
    table["discs"] = [{"name": f"throw {i}", "throw": i, "inertia": 0.05} for i in range(1, 7)]
    table["discs"] += [{"name": "flywheel", "inertia": 2.0}, {"name": "propeller", "inertia": 5.0}]
    table["shafts"] = [
        *({"stiffness": 1e6, "diameter": 0.08} for _ in range(6)),
        {"stiffness": 3e4, "diameter": 0.06, "transient_stress_limit": 20.0, "loss_factor": 0.02},
    ]
    table |= {"passing_start": 300.0, "passing_end": 1000.0}
    found = run(names, shaft=table, axes={"speed_ramp": [20, 2000]})
    over = found[names[0]].max("shaft").values
    found[names[0]] = found[names[0]] / over.mean()  # Above at the first ramp, within at the second
    assert over[0] > over[1]
    html = "".join(shaft_calculation.calculation(found, None))
    part = html.partition("Passing a range of speeds")[2]
    assert "Above the limit in passing" in part and "2000 rpm/s is enough" in part
    html = "".join(shaft_calculation.calculation(found.isel(speed_ramp=[1]), None))
    assert "Within the limit in passing" in html


def test_a_shaft_that_fails_is_counted_and_ends_the_command(tmp_path: Path) -> None:
    output, path = tmp_path / "out.nc", engine(tmp_path, "[{ order = 1.5, sine = -8000 }]")
    scene = write_scene(
        tmp_path, [TORQUE], engine=path, shaft=three(**UP), axes={"speed_ramp": [60.0, 1e12]},
        output={"fail_on": ["not_converged"]},
    )  # fmt: skip
    for again in ([], ["--resume"]):  # The second time the archive is complete already
        done = invoke("run", scene, "-o", output, *again)
        assert done.exit_code == DESIGNS_FAILED, done.output
        assert "passing_status: converged 1, not_converged 1" in done.stdout
        assert "designs failed: passing_status not_converged 1 ([output] fail_on)" in done.stderr


@pytest.mark.compiled
def test_a_run_of_passes_resumes_and_its_blocks_are_the_whole(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(limits, "LARGEST_BLOCK", 2e5)
    scene: dict[str, Any] = {
        "engine": engine(tmp_path, "[{ order = 1.5, sine = -8000 }]"),
        "shaft": three(**UP), "axes": {"speed_ramp": np.linspace(60.0, 100.0, 40).tolist()},
        "silenced_warnings": ["all"], "output": {"quantities": PASSES},
    }  # fmt: skip
    plan, output = make_plan(sweeps.read_scene(scene)), tmp_path / "out.nc"
    interrupted(plan, output, monkeypatch, 2)
    done = into_archive.run(plan, output, Options(resume=True))
    assert done.before == 2 and done.blocks > 4
    whole = sweeps.run(scene)
    with xr.open_dataset(output) as found:
        for name in PASSES:
            assert_array_equal(found[name], whole[name])
