"""The table of crossings: each of its pairs is refused as it says, and nothing else is."""

from pathlib import Path
from typing import Any

import pytest

from sweeps.scene.consistency.features import FEATURES
from sweeps.scene.crossings import CROSSINGS, HOLDING, KEYS, SEVERAL, SINGLE, Crossing
from sweeps.scene.features import GIVEN_FEATURES
from sweeps.scene.reading import read_scene
from tests.support.engine_files import POINTS, VALUES, indicator_text, points, written
from tests.support.scenes import asking, refusal, toml
from tests.support.shafts import complete_shaft

OF_RUNS = ("a device", "extend")
"""What archives and commands refuse: tests/sweeps/test_cluster.py, test_reduced.py and others."""

TORQUE = '[[diagram]]\nkind = "torque"\nmean = 90\nharmonics = [{ order = 2, sine = 400 }]\n'
DOUBLE = {
    "kind": "double_acting_compressor", "load": 100, "clearance_ratio": 0.12,
    "crank_end_clearance_ratio": 0.15, "piston_rod_diameter": 0.06, "suction_pressure": 5.0,
    "delivery_pressure": 15.0, "suction_loss": 0.1, "delivery_loss": 0.2,
    "compression_exponent": 1.3, "expansion_exponent": 1.25, "valve_ramp": 8.0, "valve_lag": 2.0,
}  # fmt: skip
MOTOR = {"motor_slip": 0.02, "motor_breakdown_slip": 0.15, "motor_breakdown_torque": 6000.0}
RODS = {"arrangement": "radial 5", "cylinders": 5,
        "articulated_rods": {"radius": 0.3, "knuckle_mass": 0.2}}  # fmt: skip
SHARES = {"friction_boundary": 0.2, "ring_pressure": 1.5}
THIRDS = {"mean": 20.0, "angle": "crank", "harmonics": [{"order": 1.0 / 3.0, "sine": 60.0}]}
MEASURED = {"file": "speed.csv", "kind": "speed"}
FAN = {"load_table": "fan.csv"}
BY_COMPONENTS = {"friction_law": "patton_nitschke_heywood"}
HEAT = {"heat": 12.0}
HOLD = {"hold": "brake_torque"}
EXTREME = {"largest_speed": 1210.0}
WEBS = [{"mass": 2.1, "radius": 0.06, "angle": 170, "position": -0.03}]
SAMPLE = {"number": 2, "inertia": {"low": 1.0, "high": 2.0}}
TWO = ["ntua", "b112"]
MODEL, RODLESS = "parameters of the modelled cycle", "articulated_rods"
BURNS, DOUBLED = "misfire, pressure_factor or firing_pattern", "double-acting cylinders"
OF_TORQUE = "an engine that gives its torque"
FOLLOWED: dict[str, Any] = {
    "transient": {"cycles": 3, "command_angle": -15.0}, "solver": {"method": "transient"},
}  # fmt: skip

EXAMPLES: dict[tuple[str, str], dict[str, Any]] = {
    ("[sample]", "[designs]"): {"sample": SAMPLE, "designs": {"inertia": [1.0, 2.0]}},
    ("elasticities", SEVERAL): {"engine": TWO, "output": {"quantities": ["delta_elasticity"]}},
    ("[uncertainty]", SEVERAL): {"engine": TWO, "uncertainty": {}},
    ("[reference]", SEVERAL): {"engine": TWO, "reference": {"file": "speed.csv"}},
    ("[measured]", SEVERAL): {"engine": TWO, "measured": MEASURED},
    ("[reduce]", "[reference]"): {"reduce": {}, "reference": {"file": "speed.csv"}},
    ("[reduce]", "[measured]"): {"reduce": {}, "measured": MEASURED},
    ("[reduce]", "[uncertainty]"): {"reduce": {}, "uncertainty": {}},
    ("[reduce]", "elasticities"): {"reduce": {}, "output": {"quantities": ["delta_elasticity"]}},
    ("[reduce]", SEVERAL): {"reduce": {}, "engine": TWO},
    ("[reduce]", "texts in [designs] or [sample]"): {
        "reduce": {}, "designs": {"firing_pattern": ["1", "10"]}},
    ("[characteristic]", "[indicator]"): {
        "characteristic": {"kind": "diesel"}, "indicator": {"file": "pressure.csv"}},
    (MODEL, "[indicator]"): {
        "engine": "b112", "set": HEAT, "indicator": {"file": "pressure.csv"}},
    (MODEL, "an engine without diagrams"): {"engine": "bare.toml", "set": HEAT},
    ("largest_speed or smallest_speed", "an engine that gives its pressure"): {"set": EXTREME},
    ("largest_speed or smallest_speed", "a driver"): {
        "engine": "torque.toml", "set": EXTREME | MOTOR},
    (MODEL, "diagrams that are not modelled by the first law"): {"set": HEAT},
    ("bore or crankcase_pressure", DOUBLED): {"engine": "double.toml", "set": {"bore": 0.2}},
    ("a load that varies", "[indicator]"): {
        "axes": {"load": [40, 50]}, "indicator": {"file": "pressure.csv"}},
    ("[characteristic]", DOUBLED): {
        "engine": "double.toml", "characteristic": {"kind": "diesel"}},
    ("load", "[characteristic]"): {"set": {"load": 50}, "characteristic": {"kind": "diesel"}},
    ("hold", "held_torque or held_power"): {"set": HOLD | {"held_power": 1e4}},
    (HOLDING, "[characteristic]"): {"set": HOLD, "characteristic": {"kind": "diesel"}},
    (HOLDING, "[indicator]"): {
        "axes": {"held_power": [1e4, 2e4]}, "indicator": {"file": "pressure.csv"}},
    (HOLDING, OF_TORQUE): {"engine": "torque.toml", "set": HOLD},
    (HOLDING, DOUBLED): {"engine": "double.toml", "set": HOLD},
    (HOLDING, "a driver"): {"set": HOLD | MOTOR},
    (HOLDING, "diagrams for one load"): {"set": HOLD},
    ("[indicator]", OF_TORQUE): {"engine": "torque.toml", "indicator": {"file": "pressure.csv"}},
    ("variable inertia", OF_TORQUE): {
        "engine": "torque.toml", "solver": {"inertia_model": ["constant", "variable"]}},
    ("firing_pattern", OF_TORQUE): {"engine": "torque.toml", "set": {"firing_pattern": "10"}},
    (BURNS, OF_TORQUE): {"engine": "torque.toml", "set": {"misfire": 1}},
    (BURNS, "a compressor or pump"): {"engine": "double.toml", "set": {"misfire": 1}},
    ("[indicator]", DOUBLED): {
        "engine": "double.toml", "indicator": {"file": "two-stroke.csv"}},
    ("parameters of single cylinders", "several numbers of cylinders"): {
        "axes": {"cylinders": [1, 2]}, "set": {"mass_factor_1": 0.9}},
    ("arrangement in [axes]", "several numbers of cylinders"): {
        "axes": {"cylinders": [1, 2], "arrangement": ["V2 90"]}},
    ("arrangement in [axes]", "arrangement in [set]"): {
        "axes": {"arrangement": ["V2 90"]}, "set": {"arrangement": "V2 90", "cylinders": 2}},
    ("arrangement in [axes]", "firing_angles in [set]"): {
        "axes": {"arrangement": ["V2 90"]}, "set": {"firing_angles": [0, 360], "cylinders": 2}},
    ("cylinders", "several arrangements"): {
        "designs": {"arrangement": ["V2 90", "in-line 3"]}, "set": {"cylinders": 2}},
    ("pin_offset", "banks to both sides of the crank's axis (VR)"): {
        "set": {"arrangement": "VR6 15", "cylinders": 6, "crank_offset": 0.02, "pin_offset": 1e-3}},
    ("friction over the stroke", RODLESS): {"set": RODS | SHARES},
    ("balance_shaft_mass", RODLESS): {"set": RODS | {"balance_shaft_mass": 0.2}},
    ("second_shaft_mass", RODLESS): {"set": RODS | {"second_shaft_mass": 0.2}},
    ("firing_pattern", RODLESS): {"set": RODS | {"firing_pattern": "110"}},
    ("[characteristic]", RODLESS): {"set": RODS, "characteristic": {"kind": "diesel"}},
    ("radius_factor", RODLESS): {"set": RODS | {"radius_factor_2": 0.97}},
    ("articulated_rods", "radius_factor or a VR engine"): {
        "set": RODS | {"arrangement": "VR5 15", "crank_offset": 0.02}},
    ("friction over the stroke", SINGLE): {"set": SHARES | {"bore_2": 0.1}},
    ("friction by components", SINGLE): {"set": BY_COMPONENTS | {"bore_2": 0.1}},
    ("[characteristic]", SINGLE): {
        "set": {"bore_2": 0.1}, "characteristic": {"kind": "diesel"}},
    (HOLDING, SINGLE): {
        "engine": "ntua", "set": {"hold": "brake_torque", "cylinders": 2, "bore_2": 0.1}},
    (SINGLE, RODLESS): {"set": RODS | {"bore_2": 0.1}},
    ("another number of cylinders", f"{SINGLE} of the engine"): {
        "engine": "makes.toml", "set": {"cylinders": 3}},
    ("bore_N", DOUBLED): {"engine": "double.toml", "set": {"bore_2": 0.1}},
    ("[indicator]", "diagrams of single cylinders"): {
        "engine": "makes.toml", "indicator": {"file": "pressure.csv"}},
    (MODEL, "diagrams of single cylinders"): {"engine": "makes.toml", "set": HEAT},
    ("firing_pattern over several cycles", "[measured]"): {
        "set": {"firing_pattern": "110"}, "measured": MEASURED},
    ("firing_pattern", "a load over several cycles"): {
        "set": {"firing_pattern": "1", "load_table": THIRDS}},
    ("constants and shares of the friction", "friction by components"): {
        "set": BY_COMPONENTS | {"friction_constant": 0.1}},
    ("friction by components", "a two-stroke engine"): {
        "engine": "double.toml", "set": BY_COMPONENTS},
    ("friction over the stroke", DOUBLED): {"engine": "double.toml", "set": SHARES},
    ("a motor", "driver_table"): {"set": {**MOTOR, "driver_table": "fan.csv"}},
    ("load_linear or load_square", "a driver"): {"set": {**MOTOR, "load_square": 1.0}},
    ("load_linear or load_square", "a load_table over speed"): {"set": {**FAN, "load_square": 1.0}},
    ("a load_table over speed", "a driver"): {"set": {**FAN, **MOTOR}},
    ("method thesis", "another load than a + k omega^alpha"): {
        "set": FAN, "solver": {"method": "thesis"}},
    ("method closed", "another load over speed than a + k omega^alpha"): {
        "set": MOTOR, "solver": {"method": ["auto", "closed"]}},
    ("closure cycle_time", "method thesis"): {
        "solver": {"method": ["auto", "thesis"], "closure": "cycle_time"}},
    **{("[transient]", other): FOLLOWED | more for other, more in {
        OF_TORQUE: {"engine": "torque.toml"}, DOUBLED: {"engine": "double.toml"},
        "a compressor or pump": {"engine": "compressor_79x83"},
        "[indicator]": {"indicator": {"file": "pressure.csv"}},
        "[characteristic]": {"characteristic": {"kind": "diesel"}},
        HOLDING: {"engine": "ntua", "set": HOLD}, MODEL: {"engine": "si_four_87x101", "set": HEAT},
        "diagrams over load and speed": {"engine": "grid.toml"},
        "firing_pattern": {"set": {"firing_pattern": "110"}},
        SINGLE: {"set": {"bore_2": 0.1, "cylinders": 2}},
        "another load than a + k omega^alpha": {"set": FAN},
        "friction by components": {"set": BY_COMPONENTS},
        "friction over the stroke": {"set": SHARES},
    }.items()},
    ("[[idler_gears]]", "[shaft]"): {
        "shaft": complete_shaft(1), "idler_gears": [{"inertia": 0.1, "ratio": 2.0}],
    },
    ("inertia or its parts", "[shaft]"): {"shaft": complete_shaft(1), "set": {"inertia": 2.0}},
    ("several numbers of cylinders", "[shaft]"): {
        "shaft": complete_shaft(1), "axes": {"cylinders": [1, 2]}},
    ("counterweight_fraction or counterweight_mass", "[[counterweights]]"): {
        "counterweights": WEBS, "axes": {"counterweight_mass": [1.0, 2.0]}},
    ("another crankshaft", "[[counterweights]] of the engine"): {
        "engine": "webs.toml", "set": {"arrangement": "parallel twin 270"},
        "output": {"quantities": ["delta", "shaking_force_max"]}},
}  # fmt: skip
"""A scene for each pair; files lie beside it."""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Engines and tables that the examples name."""
    path = tmp_path_factory.mktemp("crossings")
    webs = "".join(f"{key} = {value}\n" for key, value in WEBS[0].items())
    double = "".join(f"{key} = {toml(value)}\n" for key, value in DOUBLE.items())
    made = {
        "bare": VALUES,
        "torque": VALUES.replace("speed = 1200\n", "") + TORQUE,
        "webs": VALUES + POINTS + "[[counterweights]]\n" + webs,
        "grid": VALUES + "".join(f"{POINTS}speed = {speed}\n" for speed in (900, 1500)),
        "makes": VALUES + POINTS + POINTS + "cylinder = 2\n",
        "double": VALUES.replace("four-stroke", "two-stroke").replace("load = 50", "load = 100")
        + f"[[diagram]]\n{double}",
    }
    for name, text in made.items():
        written(path, text).rename(path / f"{name}.toml")
    written(path, VALUES + POINTS)
    (path / "two-stroke.csv").write_text(indicator_text(points()[90:271]))
    (path / "fan.csv").write_text("speed_rpm,torque_Nm\n100,20\n5000,200\n")
    (path / "speed.csv").write_text("crank_angle_deg,speed_rpm\n0,1200\n180,1210\n360,1190\n")
    return path


@pytest.mark.parametrize(
    "row", [one for one in CROSSINGS if one.feature not in OF_RUNS], ids=lambda row: str(row[:2])
)
def test_a_pair_is_refused_as_the_table_says(
    row: Crossing, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(folder)
    tables = {"engine": "mine.toml", "output": {}, **EXAMPLES[row[:2]]}
    quantities = tables["output"].get("quantities", ["delta"])
    engine = "mine" if str(tables["engine"]).endswith(".toml") else tables["engine"]
    says = row.says.format(engine=engine, labels="firing_pattern")
    assert refusal(asking(quantities, **tables))[-len(says) - 2 :] == f": {says}"


def test_each_feature_stands_in_the_table() -> None:
    named = {name for row in CROSSINGS for name in row[:2]}
    # Tables of features need no row; all else is there because of one.
    assert set(FEATURES) <= named | {one.written for one in GIVEN_FEATURES.values()}
    assert len({row[:2] for row in CROSSINGS}) == len(CROSSINGS)


SIZES = {
    "crank_ratio": 0.27, "rod_length": 0.35, "speed": 1200.0, "largest_speed": 1210.0,
    "smallest_speed": 1190.0, "wanted_delta": 0.02, "inertia": 2.0, "flywheel_inertia": 1.0,
    "counterweight_fraction": 0.5, "counterweight_mass": 1.0, "counterweights_factor": 1.1,
    "motor_slip": 0.02, "motor_synchronous_speed": 1250.0, "crank_mass": 3.0, "throw_mass": 4.0,
    "throw_radius": 0.05, "synchronising_torque": 1e4, "synchronising_power": 6e4,
    "load_damping": 2.0, "load_damping_factor": 10.0, "auxiliary_inertia": 0.1,
    "load_inertia": 0.2, "load_exponent": 2.0, "load_linear": 0.1, "load_square": 1e-3,
    "load": 50.0, "held_torque": 90.0, "held_power": 1e4,
}  # fmt: skip


@pytest.mark.parametrize(
    ("first", "second", "says"),
    [(first, other, says) for first, others, says in KEYS for other in others],
)
def test_keys_that_give_the_same_thing_are_refused(first: str, second: str, says: str) -> None:
    scene = asking(["delta"], set={first: SIZES[first]}, axes={second: [SIZES[second]]})
    assert refusal(scene) == f"scene: {first} (in [set]) and {second} (in [axes]): {says}"


def test_half_of_a_refused_pair_is_not_refused(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(folder)
    for tables in (
        {"set": MOTOR}, {"set": FAN}, {"set": RODS}, {"set": SHARES},
        {"engine": "torque.toml", "set": {"speed": 1200}}, {"engine": "makes.toml"},
        {"set": {"bore_2": 0.1}},
        {"engine": "double.toml"}, {"set": {"load_table": THIRDS}}, {"counterweights": WEBS},
        {"engine": "webs.toml", "set": {"arrangement": "parallel twin 270"}},
        {"indicator": {"file": "pressure.csv"}}, {"shaft": complete_shaft(1), "engine": "ntua"},
    ):  # fmt: skip
        read_scene(asking(["delta"], **{"engine": "mine.toml", **tables}))
