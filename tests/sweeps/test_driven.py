"""Scenes with loads over angle and speed, drivers, and the inertia in parts."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from numpy.testing import assert_allclose

import sweeps
from engine_dyn.loads.torque_curves import torque_over_angle
from sweeps.scene.engine.engine_files import load_engine
from sweeps.scene.plan import forecast
from sweeps.scene.plan.plan import make_plan
from sweeps.scene.reading import read_scene
from tests.support.commands import ok
from tests.support.engine_files import ENGINES
from tests.support.scenes import computed, refusal

compiled = pytest.mark.compiled

DEGREES = np.arange(0, 360, 2)
MOTOR = {
    "motor_synchronous_speed": 1250.0, "motor_breakdown_slip": 0.2, "motor_breakdown_torque": 90.0,
}  # fmt: skip
MOTORED = {"load": 0, "friction_constant": 2.0}
"""The engine `ntua` so that its mean torque is negative."""

BALANCE = ["delta", "torque", "load_torque", "driver_torque", "angular_acceleration", "omega"]


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Tables of torque, in the working folder."""
    own = 20.0 + 15.0 * np.cos(np.radians(2 * DEGREES))
    write("own.csv", "load_angle_deg", DEGREES, own, tmp_path)
    write("crank.csv", "crank_angle_deg", 2.0 * DEGREES - 360.0,
          10.0 + 5.0 * np.sin(np.radians(DEGREES)), tmp_path)  # fmt: skip
    speeds = np.array([600.0, 1000.0, 1500.0, 2000.0])
    write("fan.csv", "speed_rpm", speeds, 6e-5 * speeds**2, tmp_path)
    write("engine.csv", "speed_rpm", speeds, [80.0, 70.0, 50.0, 10.0], tmp_path)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def write(name: str, column: str, places: Any, torque: Any, where: Path = Path()) -> None:
    rows = [f"{x},{y}" for x, y in zip(places, torque, strict=True)]
    text = "\n".join(["# made up", f"{column},torque_Nm", *rows])
    (where / name).write_text(text, encoding="utf-8")


def run(quantities: list[str] | None = None, **tables: Any) -> xr.Dataset:
    return sweeps.run({"engine": "ntua", "output": {"quantities": quantities or BALANCE}, **tables})


def scene(**tables: Any) -> dict[str, Any]:
    return {"engine": "ntua", "output": {"quantities": ["delta"]}, **tables}


def refused(**tables: Any) -> str:
    return refusal(scene(**tables))


@compiled
@pytest.mark.parametrize(
    "settings",
    [
        {"load_table": "own.csv", "gear_ratio": 1.5, "load_phase": 30.0, "load_table_factor": 1.2},
        {"load_table": "crank.csv", "load_exponent": 1.0, "load_offset": 5.0},
        {"load_table": "fan.csv", "load_offset": 5.0},
        {"load_linear": 1.0, "load_square": 0.01, "load_offset": 5.0},
        {**MOTORED, **MOTOR},
        {**MOTORED, "driver_table": "engine.csv", "load_table": "own.csv"},
    ],
    ids=["own angle", "crank angle", "speed", "linear and square", "motor", "driver and load"],
)
def test_torques_balance_at_every_angle_and_over_the_cycle(settings: dict[str, Any]) -> None:
    found = run(set=settings, solver={"closure": "cycle_time"})
    assert int(found["status"]) == 0
    rest = found["torque"] - found["load_torque"] + found["driver_torque"]
    inertia = load_engine("ntua", Path()).values
    size = float(np.ptp(found["torque"].values))
    assert_allclose(rest, inertia["inertia"] * found["angular_acceleration"], atol=1e-7 * size)
    # The trapezoidal rule at whole degrees of a curve that is a spline.
    assert abs(float(rest.mean())) < 1e-6 * size
    assert float((1.0 / found["omega"]).mean()) == pytest.approx(30.0 / (np.pi * 1200.0), rel=1e-9)


@compiled
def test_what_varies_is_an_axis_of_what_depends_on_it() -> None:
    found = run(
        ["delta", "load_torque", "load_coefficient", "torque_mean"],
        set={"load_table": "own.csv"},
        axes={"gear_ratio": [0.5, 1.0], "load_phase": [0.0, 45.0, 90.0]},
    )
    assert found["delta"].dims == ("gear_ratio", "load_phase")
    assert found["load_torque"].dims == ("gear_ratio", "load_phase", "crank_angle")
    assert found["load_coefficient"].dims == ("gear_ratio",)
    assert found["load_coefficient"].attrs["units"] == "N m s2"
    assert found["torque_mean"].dims == ()
    # Mean of the load at the crank: i times its own.
    k = found["load_coefficient"] * (1200.0 * np.pi / 30.0) ** 2
    expected = float(found["torque_mean"]) - np.array([0.5, 1.0]) * 20.0
    assert_allclose(k, expected, rtol=1e-9)
    one = run(set={"load_table": "own.csv", "gear_ratio": 0.5, "load_phase": 45.0})
    assert float(one["delta"]) == pytest.approx(
        float(found["delta"].sel(gear_ratio=0.5, load_phase=45.0)), rel=1e-12
    )


@compiled
def test_load_over_the_crank_angle_has_no_gear() -> None:
    found = run(set={"load_table": "crank.csv"}, axes={"gear_ratio": [0.5, 0.7]})
    assert "gear_ratio" not in found["delta"].dims
    over = torque_over_angle(
        np.radians(2.0 * DEGREES - 360.0), 10.0 + 5.0 * np.sin(np.radians(DEGREES))
    )
    phi = np.radians(found["crank_angle"].values)
    variable = found["load_torque"].values - over(phi)
    # What is left is k omega^2.
    k = variable / found["omega"].values ** 2
    assert_allclose(k, k[0], rtol=1e-9)


@compiled
def test_a_motor_by_its_slip_and_behind_a_gear() -> None:
    keys = {**MOTORED, "motor_breakdown_slip": 0.2, "motor_breakdown_torque": 90.0}
    slip = run(["delta", "driver_factor"], set={**keys, "motor_slip": 0.04},
               axes={"speed": [800.0, 1200.0]})  # fmt: skip
    fixed = run(["delta", "driver_factor"], set={**keys, "motor_synchronous_speed": 1250.0},
                axes={"speed": [800.0, 1200.0]})  # fmt: skip
    assert slip["status"].values.tolist() == [0, 0]
    assert fixed["status"].values.tolist() == [2, 0]  # beyond the breakdown
    assert_allclose(slip["delta"][1], fixed["delta"][1], rtol=1e-12)
    # Speeds at its shaft are i times the crank's, its torque at the crank is i times its own.
    asked = ["delta", "driver_factor", "driver_torque"]
    at_crank = run(asked, set={**MOTORED, **MOTOR})
    own = {
        "motor_synchronous_speed": 1.4 * MOTOR["motor_synchronous_speed"],
        "motor_breakdown_slip": MOTOR["motor_breakdown_slip"],
        "motor_breakdown_torque": MOTOR["motor_breakdown_torque"] / 1.4,
    }
    geared = run(asked, set={**MOTORED, **own}, axes={"motor_gear_ratio": [1.4, 1.41]})
    for name in asked:
        assert_allclose(geared[name][0], at_crank[name], rtol=1e-11)
    # A little more and the motor slips less: less of its torque is there.
    assert geared["driver_factor"][1] > 1.01 * geared["driver_factor"][0]
    assert geared["delta"][1] != geared["delta"][0]
    # Gear or supply that follow the speed: the slip is as given, whatever the gear.
    follows = {"motor_slip": 0.04, "motor_breakdown_slip": 0.2, "motor_breakdown_torque": 90.0}
    found = run(asked, set={**MOTORED, **follows}, axes={"motor_gear_ratio": [1.0, 2.0]})
    assert_allclose(found["driver_factor"][1], 0.5 * found["driver_factor"][0])
    assert_allclose(found["delta"][1], found["delta"][0], rtol=1e-12)


def test_a_setting_without_effect_is_reported(tmp_path: Path) -> None:
    plan = make_plan(read_scene(scene(set={"gear_ratio": 2.0, "crank_mass": 3.0, "load": 50})))
    assert plan.unused_settings == ("gear_ratio", "crank_mass")
    assert "[set] gear_ratio: no requested quantity depends on it" in forecast.text(plan)
    file = tmp_path / "scene.toml"
    file.write_text('engine = "ntua"\n[set]\ngear_ratio = 2\n[output]\nquantities = ["imep"]\n')
    printed = ok("run", file, "-o", tmp_path / "out.nc")
    assert "no requested quantity depends on:  gear_ratio" in printed
    shaft = scene(
        engine="diesel_105x137",
        shaft="diesel_105x137",
        output={"quantities": ["delta"], "modes": 2},
    )
    plan = make_plan(read_scene(shaft))
    assert plan.unused_settings == ("[output] modes",)
    assert "[output] modes: no requested quantity depends on it" in forecast.text(plan)
    # What stands behind other values has an effect.
    for key, value in (("heat", 12.0), ("misfire", 1), ("mass_factor_2", 1.1), ("cylinders", 4)):
        other = scene(engine="si_four_87x101", set={key: value})
        assert make_plan(read_scene(other)).unused_settings == ()
    # A gear turns nothing without a load over its own angle or speed or an inertia behind it.
    for engine, more, unused in (
        ("ntua", {}, ("gear_ratio",)),
        ("ntua", {"load_inertia": 0.0, "flywheel_inertia": 2.0}, ("gear_ratio",)),
        ("compressor_79x83", {}, ("gear_ratio",)), ("compressor_79x83", {"load_inertia": 0.01}, ()),
    ):  # fmt: skip
        raw = scene(engine=engine, set=more, axes={"gear_ratio": [1.0, 2.0]})
        assert make_plan(read_scene(raw)).unused == unused
    raw = scene(engine="diesel_105x137", set={"load_table": "own.csv", "load_exponent": 1.6},
                axes={"gear_ratio": [0.5, 1.5]})  # fmt: skip
    told = forecast.text(make_plan(read_scene(raw)))
    assert "360 or 120 (6 cylinders)" in told
    assert "load over angle: repeats 2, 6 times a cycle" in told


PUMP = """
title = "Plunger pump"
cycle = "two-stroke"
[values]
bore = 0.05
stroke = 0.06
rod_length = 0.2
pin_offset = 0.01
piston_mass = 0.5
rod_mass = 0.8
rod_centre_of_gravity = 0.06
crank_mass = 1.0
inertia = 0.4
cylinders = 3
speed = 300
load = 100
load_offset = 0
friction_constant = 0.3
friction_peak_pressure = 0
friction_mean_piston_speed = 0
crankcase_pressure = 1.01325
motor_synchronous_speed = 1500
motor_gear_ratio = 4.8
motor_breakdown_slip = 0.2
motor_breakdown_torque = 60
[[diagram]]
load = 100
kind = "pump"
suction_pressure = 1.5
delivery_pressure = 61.5
valve_ramp = 5
"""


@compiled
def test_a_pump_on_a_motor(folder: Path) -> None:
    """Torque and power from the work of a turn, the speed from what gear and slip leave."""
    (folder / "pump.toml").write_text(PUMP, encoding="utf-8")
    asked = ["delta", "torque_mean", "imep", "driver_factor", "driver_torque", "omega",
             "brake_power", "displacement"]  # fmt: skip
    found = computed(asked, "pump.toml", axes={"speed": [295.0, 300.0]})
    assert (found["status"] == 0).all()
    swept = 3 * 0.25 * np.pi * 0.05**2 * 0.06
    work = (60e5 + 0.3e5) * swept  # of a turn: the levels' difference, and friction
    # The levels change over 5 degrees, in which the piston moves little.
    assert_allclose(found["torque_mean"], -work / (2.0 * np.pi), rtol=2e-3)
    assert_allclose(found["imep"], -60.0, rtol=2e-3)
    # What the motor gives over a turn is what the pump takes: its table's factor and the slip.
    power = (found["driver_torque"].mean("crank_angle") + found["torque_mean"]) * found["speed"]
    assert abs(power).max() < 1e-6 * abs(found["torque_mean"] * found["speed"]).max()
    slip = 1.0 - 4.8 * found["speed"].values / 1500.0
    torque = 4.8 * 2.0 * 60.0 / (slip / 0.2 + 0.2 / slip)
    assert_allclose(found["driver_factor"], -found["torque_mean"].values / torque, rtol=1e-12)
    # One cylinder's flow stops for half a turn, three's never does: alone it needs a flywheel.
    asked = ["delta", "energy_swing"]
    one = [
        computed(asked, "pump.toml", set={"cylinders": 1, "inertia": inertia})
        for inertia in (0.2, 4.0)
    ]
    assert [int(found["status"]) for found in one] == [1, 0]
    three = computed(asked, "pump.toml")
    assert float(one[1]["energy_swing"]) > 10.0 * float(three["energy_swing"])


BOTH = (ENGINES / "compressor_79x83.toml").read_text("utf-8")


@pytest.mark.parametrize(
    ("text", "change", "words"),
    [
        (PUMP, ("61.5", "1.2"),
         "delivery_pressure = 1.2 bar: must be above suction_pressure, 1.5 bar"),
        (PUMP, ("suction_pressure = 1.5", "suction_pressure = 1.5\nsuction_loss = 1"),
         "suction_loss = 1 bar: must be at most half of suction_pressure"),
        (PUMP, ("valve_ramp = 5", "valve_ramp = 0"),
         "valve_ramp = 0 degree: must be above 3 and below 90"),
        (PUMP, ("valve_ramp = 5", ""), "valve_ramp: missing; must be a number in degree"),
        (PUMP, ("valve_ramp = 5", "valve_ramp = 5\nheat = 3"), "heat: unknown key"),
        (PUMP, ('"two-stroke"', '"four-stroke"'),
         "kind = 'pump': must belong to a two-stroke engine"),
        (BOTH, ("[values]", "[values]\ninertia = 1.0"), "has both inertia and flywheel_inertia"),
        (BOTH, ("[values]", "[values]\nmotor_synchronous_speed = 1600"),
         "has both motor_slip and motor_synchronous_speed"),
    ],
)  # fmt: skip
def test_machines_that_are_none(
    folder: Path, text: str, change: tuple[str, str], words: str
) -> None:
    (folder / "pump.toml").write_text(text.replace(*change), encoding="utf-8")
    assert words in refused(engine="pump.toml")


@compiled
def test_an_engine_file_carries_its_driver_and_its_load(folder: Path) -> None:
    there = folder / "machines"
    there.mkdir()
    write("motor.csv", "speed_rpm", [1000.0, 1400.0, 1500.0], [40.0, 30.0, 0.0], there)
    write("belt.csv", "load_angle_deg", DEGREES, 1.0 + np.cos(np.radians(DEGREES)), there)
    text = (ENGINES / "compressor_79x83.toml").read_text("utf-8")
    lines = [line for line in text.splitlines() if not line.startswith("motor_")]
    place = lines.index("[values]")
    lines[place:place] = ['driver_table = "motor.csv"', 'load_table = "belt.csv"', ""]
    (there / "own.toml").write_text("\n".join(lines), encoding="utf-8")
    asked = ["delta", "driver_factor", "load_torque"]
    found = computed(asked, "machines/own.toml", set={"speed": 1450})
    assert int(found["status"]) == 0 and 0.0 < float(found["driver_factor"]) < 2.0
    assert float(found["load_torque"].mean()) == pytest.approx(1.0)
    # The scene's replace the engine's: table by motor, motor by table.
    motor = {"motor_slip": 0.03, "motor_breakdown_slip": 0.2, "motor_breakdown_torque": 30}
    replaced = computed(asked, "machines/own.toml", set={"speed": 1450, **motor})
    assert float(replaced["driver_factor"]) != float(found["driver_factor"])
    table = {"driver_table": "machines/motor.csv", "speed": 1450}
    back = computed(asked, "compressor_79x83", set=table)
    assert int(back["status"]) == 0
    told = ok("info", "machines/own.toml")
    assert "load_table: torque over its own angle, 360 degrees, 180 points, mean 1 N m" in told
    assert "driver_table: torque over the crank speed from 1000 to 1500 rpm, 3 points" in told


@pytest.mark.parametrize(
    ("tables", "words"),
    [
        ({"set": {"load_table": "none.csv"}}, "[set] load_table none.csv: no such file"),
        ({"set": {"load_table": 3}}, "[set] load_table = 3: must be a string"),
        ({"set": {"driver_table": "own.csv"}}, "must be torque_Nm and one of speed_rpm"),
        ({"axes": {"load_table": [1, 2]}}, "[axes] load_table: must be in [set]"),
        ({"set": {"load_table": "own.csv", "gear_ratio": 0.3}},
         "gear_ratio = 0.3: must be a multiple of 0.25"),
        ({"set": {"load_table": "own.csv"}, "axes": {"gear_ratio": [1, 0.3]}},
         "[axes] gear_ratio = 0.3"),
        ({"set": {"load_table": "own.csv"}, "solver": {"method": "thesis"}}, "method = 'thesis'"),
        ({"set": {"load_table": "fan.csv", **MOTOR}}, "not allowed together with a driver"),
        ({"set": {"driver_table": "engine.csv", **MOTOR}}, "give one driver"),
        ({"set": {"inertia": 1.0, "load_inertia": 1.0}}, "inertia as a whole or in parts"),
        ({"set": {"motor_slip": 0.1, **MOTOR}}, "both determine the motor's synchronous speed"),
        ({"set": {"motor_breakdown_slip": 0.2}}, "needs motor_synchronous_speed"),
        ({"set": {"motor_slip": 1.0}}, "motor_slip = 1: must be"),
        ({"set": {"gear_ratio": 0.0}}, "gear_ratio = 0: must be"),
    ],
)  # fmt: skip
def test_bad_input_is_told_in_one_line(tables: dict[str, Any], words: str) -> None:
    assert words in refused(**tables)


@pytest.mark.parametrize(
    ("column", "places", "torque", "words"),
    [
        ("load_angle_deg", range(0, 100, 10), [1.0] * 10, "covers 90 degrees"),
        ("load_angle_deg", [*range(0, 350, 10), 5], [1.0] * 36, "line 38: angle = 5 degree after"),
        ("load_angle_deg", [*range(0, 110, 10), *range(200, 360, 10)], [1.0] * 27,
         "line 14: angle = 200 degree after 100: a gap of 100, allowed are 45"),
        ("speed_rpm", [500, 1500], [1, "nan"], "[set] load_table bad.csv, line 4: torque_Nm = "),
        ("speed_rpm", [500, 1500, 1400], [1, 2, 3], "line 5: speed = 1400 rpm after 1500"),
        ("speed_rpm", [500, 1500], [1, -2], "line 4: torque = -2"),
        ("speed_rpm", [1500], [1], "1 points: must be at least 2"),
        ("angle", [1], [1], "columns angle, torque_Nm: must be torque_Nm and one of crank_angle"),
    ],
)  # fmt: skip
def test_bad_tables_are_told_with_their_line(
    column: str, places: Any, torque: Any, words: str
) -> None:
    write("bad.csv", column, places, torque)
    told = refused(set={"load_table": "bad.csv"})
    assert words in told and told.count("bad.csv") == 1


@compiled
def test_a_load_over_its_own_speed_is_one_over_the_cranks_through_the_gear() -> None:
    """T_L over the load's speed is i T_L(i omega) at the crank: tables of both say the same."""
    speeds = np.array([600.0, 1000.0, 1500.0, 2000.0])
    torque = 6e-5 * speeds**2
    quantities = ["delta", "load_coefficient", "load_torque", "load_torque_nominal", "torque_mean"]
    gears = [0.5, 1.0, 2.0]
    for i in gears:
        write(f"own{i}.csv", "load_speed_rpm", speeds * i, torque / i)
    at_crank = run(quantities, set={"load_table": "fan.csv"}, axes={"inertia": [2.0, 3.0]})
    for i in gears:
        found = run(
            quantities, set={"load_table": f"own{i}.csv", "gear_ratio": i},
            axes={"inertia": [2.0, 3.0]},
        )  # fmt: skip
        for name in quantities:
            assert_allclose(found[name], at_crank[name], rtol=1e-9)
    # The gear as an axis: each as alone, and whatever the table means, its mean takes the engine's.
    table = {"load_table": "own1.0.csv"}
    swept = run(quantities, set=table, axes={"gear_ratio": [0.6, 1.0, 1.5]})
    assert swept["delta"].dims == ("gear_ratio",)
    for i in (0.6, 1.5):
        one = run(quantities, set={**table, "gear_ratio": i})
        assert float(one["delta"]) == pytest.approx(float(swept["delta"].sel(gear_ratio=i)))
    assert_allclose(swept["load_torque_nominal"], swept["torque_mean"], rtol=1e-12)
    # Of a table over the crank's speed the gear is no part.
    other = run(quantities, set={"load_table": "fan.csv"}, axes={"gear_ratio": [0.6, 1.0]})
    assert "gear_ratio" not in other["delta"].dims
