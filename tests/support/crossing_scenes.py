"""Scenes in which features cross: a fragment for each feature, merged on an engine they can share.

A fragment is a part of a scene. Its table `engine` is a part of the engine file, everything else
stands in the scene as it is. Two fragments that give one key differently cannot stand in one scene.
"""

from __future__ import annotations

import copy
import hashlib
import re
import tempfile
import tomllib
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from engine_dyn.quantities.graph import QUANTITIES
from sweeps import SceneError, plan, read_scene
from tests.support.engine_files import indicator_text, points
from tests.support.scenes import BEARINGS, VALVES, toml

Fragment = dict[str, Any]

ENGINES = Path(__file__).parents[2] / "sweeps" / "catalogue" / "engines"


@cache
def folder() -> Path:
    """Where the files are that scenes name."""
    path = Path(tempfile.mkdtemp(prefix="crossings-"))
    degrees = np.arange(0, 360, 6)
    swell = 1.0 + 0.6 * np.cos(np.radians(2 * degrees))
    speeds = np.array([20.0, 1000.0, 4000.0, 20000.0])
    tables = {
        "fan.csv": ("speed_rpm", speeds, 1.0 + 1e-6 * speeds**2),
        "crank.csv": ("crank_angle_deg", degrees * 1.0, 20.0 * swell),
        "driver.csv": ("speed_rpm", speeds, 900.0 - 4e-3 * speeds),
    }
    for name, (column, places, torque) in tables.items():
        rows = "".join(f"{x},{y}\n" for x, y in zip(places, torque, strict=True))
        (path / name).write_text(f"{column},torque_Nm\n{rows}")
    (path / "pressure.csv").write_text(indicator_text(points(4.0)))
    angles = np.arange(0, 720, 6)
    rows = "".join(f"{a},{2000.0 + 20.0 * np.sin(np.radians(a))}\n" for a in angles)
    (path / "speed.csv").write_text(f"crank_angle_deg,speed_rpm\n{rows}")
    return path


# --- engines --------------------------------------------------------------------------------------


BASES: dict[str, tuple[str, dict[str, Any]]] = {
    "diesel": ("diesel_105x137", {"speed": [1500.0, 2100.0], "inertia": [2.4, 4.0]}),
    "four": ("si_four_87x101", {"speed": [3000.0, 5000.0], "inertia": [0.2, 0.4]}),
    "v6": ("v6_96x81", {"speed": [3500.0, 6000.0], "inertia": [0.2, 0.4]}),
    "boxer": ("boxer_twin_101x70", {"speed": [4000.0, 6500.0], "inertia": [0.1, 0.3]}),
}
"""Engines on which fragments are put, with two values of two axes."""

TORQUE = {"kind": "torque", "mean": 400.0, "harmonics": [
    {"order": 2, "sine": 300.0}, {"order": 4, "cosine": 100.0}]}  # fmt: skip
DOUBLE = {
    "kind": "double_acting_compressor", "load": 100, "clearance_ratio": 0.12,
    "crank_end_clearance_ratio": 0.15, "piston_rod_diameter": 0.06, "suction_pressure": 5.0,
    "delivery_pressure": 15.0, "suction_loss": 0.1, "delivery_loss": 0.2,
    "compression_exponent": 1.3, "expansion_exponent": 1.25, "valve_ramp": 8.0, "valve_lag": 2.0,
}  # fmt: skip
COMPRESSOR = {
    "bore": 0.3, "stroke": 0.15, "rod_length": 0.375, "piston_mass": 60, "rod_mass": 60,
    "rod_centre_of_gravity": 0.12, "crank_mass": 40, "inertia": 60, "speed": 750.0, "cylinders": 2,
    "crankcase_pressure": 1.01325, "friction_constant": 0.3, "friction_peak_pressure": 0.01,
    "friction_mean_piston_speed": 0, "load_offset": 0, "motor_slip": 0.01,
    "motor_breakdown_slip": 0.06, "motor_breakdown_torque": 60000,
}  # fmt: skip

STAGE = {
    "kind": "compressor", "load": 100, "clearance_ratio": 0.06, "suction_pressure": 1.0,
    "delivery_pressure": 3.0, "suction_loss": 0.05, "delivery_loss": 0.2,
    "compression_exponent": 1.3, "expansion_exponent": 1.25, "valve_ramp": 8.0, "valve_lag": 2.0,
}  # fmt: skip

KNOWN: Fragment = {"set": {
    "cylinder_spacing": 0.12, "bank_offset": 0.02, "rod_inertia": 0.004, "pole_pairs": 2,
    "interval_begin": -20.0, "interval_end": 40.0, "given_energy_swing": 400.0,
    "given_energy_fluctuation": 0.3, "angle_deviation_limit": 3.0, "piston_travel": 0.01,
    "engine_inclination": 10.0,
    **BEARINGS, **VALVES,
}}  # fmt: skip
"""What engines of the catalogue mostly do not give, so that more quantities apply."""

# --- features -------------------------------------------------------------------------------------


def _waves(mean: float, first: float, second: float, **more: Any) -> dict[str, Any]:
    return {"mean": mean, "angle": "crank", **more, "harmonics": [
        {"order": 1.0, "sine": first}, {"order": 2.0, "cosine": second}]}  # fmt: skip


def shaft(stiffness: float = 1.2e6, **tables: Any) -> dict[str, Any]:
    """A pulley, a disc for each throw of the engine, a flywheel, a geared load."""
    return {"throws": True, "stiffness": stiffness, **tables}


DAMPER = {"on": "pulley", "inertia": 0.08, "damping": 60.0}
BLADES = [
    {"on": "load", "mean": -30.0, "power": 2, "reference_speed": 1500.0,
     "harmonics": [{"order": 4, "amplitude": 20.0, "phase": 10.0}]},
    {"on": "pulley", "mean": 0.0, "harmonics": [{"order": 2, "sine": 3.0}]},
]  # fmt: skip
"""One that drifts against the engine, behind a gear, and one that keeps step."""

RAMP = {"passing_start": 1800.0, "passing_end": 1600.0, "speed_ramp": 200.0}

PENDULUM = {"on": "flywheel", "mass": 1.0, "distance": 0.1, "length": 0.02}

FRAGMENTS: dict[str, list[Fragment]] = {
    "load over speed": [
        {"set": {"load_linear": 0.2, "load_square": 2e-4}}, {"set": {"load_square": 4e-4}}],
    "load table over speed": [{"set": {"load_table": "fan.csv"}}],
    "load table over an angle": [
        {"set": {"load_table": _waves(20.0, 60.0, 30.0)}},
        {"set": {"load_table": _waves(10.0, 30.0, 80.0), "load_table_factor": 0.7}},
        {"set": {"load_table": _waves(15.0, 50.0, 30.0, angle="load"), "gear_ratio": 2.0,
                 "load_phase": 40.0}}],
    "load over several cycles": [
        {"set": {"load_table": {"mean": 20.0, "angle": "crank",
                                "harmonics": [{"order": 1.0 / 3.0, "sine": 60.0}]}}}],
    "driver table": [{"set": {"driver_table": "driver.csv", "friction_constant": 40.0}}],
    "motor": [
        {"set": {"motor_slip": 0.03, "motor_breakdown_slip": 0.2,
                 "motor_breakdown_torque": 4000.0, "friction_constant": 40.0}},
        {"set": {"motor_slip": 0.02, "motor_breakdown_slip": 0.15,
                 "motor_breakdown_torque": 6000.0, "friction_constant": 35.0}}],
    "characteristic": [
        {"characteristic": {"kind": "diesel"},
         "set": {"rated_power": 60e3, "rated_speed": 6000.0, "characteristic_share": 0.7}}],
    "hold": [  # Engines reach one of the torques, and the other with other cylinders
        {"set": {"hold": "brake_power"}}, {"axes": {"held_torque": [90.0, 150.0]}}],
    "auxiliary torque": [{"set": {"auxiliary_torque": 3.0}}],
    "auxiliaries": [
        {"auxiliaries": [{"ratio": 0.5, "phase": 20.0, "mean": 4.0,
                          "harmonics": [{"order": 4, "sine": 25.0}]}]},
        {"auxiliaries": [{"mean": 3.0, "harmonics": [{"order": 1, "cosine": 20.0}]},
                         {"ratio": 2.0, "mean": 1.0, "harmonics": [{"order": 2, "sine": 9.0}]}]}],
    "load inertia": [{"set": {"load_inertia": 0.1, "gear_ratio": 2.0}}],
    "firing pattern": [
        {"set": {"firing_pattern": "110"}}, {"axes": {"firing_pattern": ["10", "11d"]}},
        {"set": {"firing_pattern": "1 0.9 1.05 1 0.97"}}],
    "misfire": [{"set": {"misfire": 2}}, {"axes": {"misfire": [0, 1, 2]}}],
    "pressure factors": [{"set": {"pressure_factor_1": 0.8}},
                         {"axes": {"pressure_factor_2": [0.7, 1.2]}}],
    "firing angles": [{"set": {"firing_angle_2": 8.0}}],
    "mass factors": [{"set": {"mass_factor_2": 0.9}}, {"axes": {"mass_factor_1": [0.9, 1.1]}}],
    "unequal throws": [{"set": {"radius_factor_2": 0.97}}],
    "bores of single cylinders": [{"set": {"bore_2": 0.07}}, {"axes": {"bore_2": [0.08, 0.1]}}],
    "diagrams of single cylinders": [
        {"engine": {"cycle": "two-stroke", "replace": {**COMPRESSOR, "bore_2": 0.17},
                    "diagram": [STAGE, {**STAGE, "cylinder": 2, "suction_pressure": 3.0,
                                        "delivery_pressure": 9.0}],
                    "arrangement": "in-line 2"}}],
    "another arrangement": [
        {"set": {"arrangement": "in-line 3", "cylinders": 3}},
        {"set": {"arrangement": "V6 90 shared-pin", "cylinders": 6}}],
    "articulated rods": [
        {"set": {"arrangement": "radial 5", "cylinders": 5,
                 "articulated_rods": {"radius": 0.3, "knuckle_mass": 0.2}}},
        {"set": {"arrangement": "V12 60 shared-pin", "cylinders": 12,
                 "articulated_rods": {"radius": 0.4, "knuckle_mass": 0.15}}}],
    "double-acting cylinders": [
        {"engine": {"cycle": "two-stroke", "replace": COMPRESSOR, "diagram": [DOUBLE],
                    "arrangement": "boxer 2"}}],
    "offsets": [{"set": {"pin_offset": 0.002}}, {"axes": {"crank_offset": [-0.003, 0.005]}}],
    "given torque": [{"engine": {"replace": {
        "inertia": 4.0, "speed": 1500.0, "load_exponent": 2, "load_offset": 0},
        "diagram": [TORQUE]}}],
    "indicator": [{"indicator": {"file": "pressure.csv"}}],
    "friction over the stroke": [
        {"set": {"friction_boundary": 0.2, "friction_mixed": 0.2, "friction_hydrodynamic": 0.2,
                 "friction_skirt": 0.1, "ring_pressure": 1.5}},
        {"set": {"friction_hydrodynamic": 0.4, "ring_pressure": 2.5}}],
    "friction by components": [{"set": {"friction_law": "patton_nitschke_heywood"}}],
    "variable inertia": [{"solver": {"inertia_model": "variable"}},
                         {"solver": {"inertia_model": ["constant", "variable"]}}],
    "wanted delta": [{"set": {"wanted_delta": 0.03}}, {"axes": {"wanted_delta": [0.01, 0.05]}}],
    "flywheel as a ring": [{"set": {
        "wanted_delta": 0.03, "flywheel_outer_diameter": 0.5, "flywheel_inner_diameter": 0.3,
        "flywheel_density": "steel"}}],
    "inertia in parts": [{"set": {"flywheel_inertia": 0.3, "auxiliary_inertia": 0.02}}],
    "counterweights on webs": [
        {"counterweights": [{"mass": 1.1, "radius": 0.05, "angle": 175.0, "position": 0.0},
                            {"mass": 0.9, "radius": 0.06, "angle": -30.0, "position": 0.25}]},
        {"counterweights": [{"mass": 2.0, "radius": 0.04, "angle": 90.0, "position": 0.1}],
         "axes": {"counterweights_factor": [0.5, 1.5]}}],
    "counterweight mass": [{"set": {"counterweight_mass": 1.0, "counterweight_radius": 0.05}}],
    "counterweight fraction": [{"set": {"counterweight_fraction": 0.4}},
                               {"axes": {"counterweight_fraction": [0.3, 0.6]}}],
    "balance shaft": [{"set": {"balance_shaft_mass": 0.3, "balance_shaft_radius": 0.02}}],
    "pair of balance shafts": [{"set": {"second_shaft_mass": 0.2, "second_shaft_radius": 0.015}}],
    "mounts": [
        {"mounts": [{"lateral": -0.3}, {"lateral": 0.3}]},
        {"mounts": [{"lateral": x, "position": z, "stiffness": 1.0}
                    for x in (-0.25, 0.25) for z in (-0.2, 0.6)]}],
    "idler gears": [
        {"idler_gears": [{"inertia": 0.01, "ratio": -2.0, "friction_torque": 0.5}]},
        {"idler_gears": [{"inertia": 0.02, "ratio": 0.5}, {"inertia": 0.001, "ratio": 3.0}]}],
    "grid": [{"set": {"synchronising_power": 60e3}},
             {"set": {"synchronising_torque": 3e3, "damping_torque": 20.0}}],
    "shaft": [{"shaft": shaft()}, {"shaft": shaft(6e5, loss_factor=0.02)},
              {"shaft": shaft(excitations=BLADES, **RAMP)},
              {"shaft": shaft(modal_damping=[0.02, 0.05])}],
    "dampers": [{"shaft": shaft(dampers=[DAMPER])},
                {"shaft": shaft(dampers=[{**DAMPER, "stiffness": 1e4, "loss_factor": 0.1}])}],
    "pendulums": [{"shaft": shaft(pendulums=[PENDULUM])}],
    "coupling tables": [{"shaft": shaft(coupling=True)}],
    "keys of single discs": [{"shaft": shaft(), "axes": {"disc_inertia_1": [0.02, 0.04]}}],
    "designs": [{"designs": {"load_offset": [0.0, 2.0], "crankcase_pressure": [1.0, 1.05]}}],
    "sample": [{"sample": {"number": 2, "crankcase_pressure": {"low": 0.98, "high": 1.02}}}],
    "reduce": [{"reduce": {"quantiles": [0.5]}}],
    "uncertainty": [
        {"uncertainty": {"number": 8, "friction_constant": {"low": 0.1, "high": 0.2}}}],
    "elasticities": [{"output": {"elasticities": True}}],
    "several engines": [{"engines": {"stroke": 1.03}}],
    "several arrangements": [{"axes": {"arrangement": ["in-line 4", "V6 90 shared-pin"]}}],
    "measured": [{"measured": {"file": "speed.csv", "kind": "speed"}}],
    "followed in time": [
        {"solver": {"method": "transient"}, "governor": {"gain": 6.0, "integral": 6.0},
         "transient": {"cycles": 6, "command_angle": -15.0, "start_command": 40.0, "record": [2, 2],
                       "limits": "ISO 8528-5 G2", "load_steps": [{"time": 0.05, "load": 60.0}]}},
        {"solver": {"method": "transient"}, "axes": {"transient_fuel_cut": [0.02, 1.0]},
         "starter": {"torque": 300.0, "speed": 400.0}, "clutch": {"time": 0.1, "inertia": 0.1},
         "transient": {"start_speed": 0.0, "cycles": 5, "command_angle": -360.0,
                       "dispersion": 0.02, "load_law": "power",
                       "command_steps": [{"time": 0.0, "command": 80.0}]}}],
    "cycle time as closure": [{"solver": {"closure": "cycle_time"}}],
    "method newton": [{"solver": {"method": "newton"}}],
    "method closed": [{"solver": {"method": "closed"}}],
    "method thesis": [{"solver": {"method": "thesis", "passes": 2}}],
    "several methods": [{"solver": {"method": ["auto", "newton"]}}],
}  # fmt: skip
"""Features by the names of the table of crossings, each in one or more variants."""


NEUTRAL: dict[str, Fragment] = {
    "load table over an angle": {"set": {"load_table": _waves(0.0, 0.0, 0.0)}},
    "auxiliaries": {"auxiliaries": [{"mean": 0.0, "harmonics": [{"order": 1, "sine": 0.0}]}]},
    "auxiliary torque": {"set": {"auxiliary_torque": 0.0}},
    "firing pattern": {"set": {"firing_pattern": "1"}},
    "misfire": {"set": {"misfire": 0}},
    "pressure factors": {"set": {"pressure_factor_1": 1.0}},
    "mass factors": {"set": {"mass_factor_2": 1.0}},
    "unequal throws": {"set": {"radius_factor_2": 1.0}},
    "offsets": {"set": {"pin_offset": 0.0, "crank_offset": 0.0}},
    "friction over the stroke": {"set": {"friction_boundary": 0.0, "friction_skirt": 0.0}},
    "counterweight fraction": {"set": {"counterweight_fraction": 0.0}},
    "counterweights on webs": {"counterweights": [
        {"mass": 0.0, "radius": 0.05, "angle": 175.0, "position": 0.0}]},
    "balance shaft": {"set": {"balance_shaft_mass": 0.0, "balance_shaft_radius": 0.02}},
    "idler gears": {"idler_gears": [{"inertia": 0.0, "ratio": 1.0}]},
    "method newton": {"solver": {"method": "auto"}},
}  # fmt: skip
"""Features with numbers at which they must not matter."""


class SameKeyError(Exception):
    """Two fragments that give one key differently."""


def _merged(first: Any, second: Any, place: str) -> Any:
    if isinstance(first, dict) and isinstance(second, dict) and "kind" not in first:
        found = dict(first)
        for key, value in second.items():
            found[key] = _merged(first[key], value, key) if key in first else value
        return found
    if place == "diagram":
        return [*first, *second]
    if first != second:
        raise SameKeyError(place)
    return first


def merged(*fragments: Fragment) -> Fragment:
    """One fragment of several."""
    found: Fragment = {}
    for fragment in fragments:
        found = _merged(found, copy.deepcopy(fragment), "")
    given: set[str] = set()
    for table in ("set", "axes", "designs"):
        keys = {key for key in found.get(table, {}) if key != "case"}
        if both := given & keys:
            raise SameKeyError(min(both))
        given |= keys
    return found


# --- whole scenes ---------------------------------------------------------------------------------


def _engine_file(own: Path, changes: dict[str, Any]) -> Path:
    """An engine with changes, as a file."""
    if not changes:
        return own
    engine = tomllib.loads(own.read_text(encoding="utf-8"))
    changes = dict(changes)
    if "replace" in changes:
        changes["values"] = changes.pop("replace")
        engine = {"title": "made up"}
    engine |= changes
    head = [f"{key} = {toml(value)}" for key, value in engine.items() if _flat(value)]
    for key, table in engine.items():
        if not _flat(table):
            many = isinstance(table, list)
            for one in table if many else [table]:
                head.append(f"[[{key}]]" if many else f"[{key}]")
                head += [f"{k} = {toml(v)}" for k, v in one.items()]
    text = "\n".join(head) + "\n"
    for file in re.findall(r'"([\w.]+\.csv)"', text):
        if (ENGINES / file).exists():
            (folder() / file).write_bytes((ENGINES / file).read_bytes())
    path = folder() / f"{hashlib.sha256(text.encode()).hexdigest()[:12]}.toml"
    path.write_text(text, encoding="utf-8")
    return path


def _flat(value: Any) -> bool:
    return not isinstance(value, dict) and not (isinstance(value, list) and value
                                                and isinstance(value[0], dict))  # fmt: skip


@cache
def _throws(engine: str, arrangement: str, count: int) -> int:
    given = {"set": {"arrangement": arrangement, "cylinders": count}} if arrangement else {}
    if 'kind = "torque"' in Path(engine).read_text(encoding="utf-8"):
        return 1
    own = read_scene({"engine": engine, **given, "output": {"quantities": ["displacement"]}})
    cylinders = own.own_cylinders or own.engine.own_cylinders
    count = len(getattr(cylinders, "along_shaft", ()) or ())
    return count or int(own.engine.values.get("cylinders", 0))


def _shaft_table(given: dict[str, Any], throws: int) -> dict[str, Any]:
    given = dict(given)
    stiffness = given.pop("stiffness")
    coupling = given.pop("coupling", False)
    given.pop("throws", None)
    soft: dict[str, Any] = {"name": "coupling", "stiffness": 0.05 * stiffness}
    if coupling:
        soft = {
            "name": "coupling",
            "stiffness_over_torque": {
                "torque": [0.0, 500.0, 5000.0],
                "stiffness": [0.03 * stiffness, 0.05 * stiffness, 0.06 * stiffness],
            },
        }
    return {
        "reciprocating": "included",
        "discs": [
            {"name": "pulley", "inertia": 0.02},
            *({"name": f"throw {i}", "throw": i, "inertia": 0.04, "damping": 1.0}
              for i in range(1, throws + 1)),
            {"name": "flywheel", "inertia": 1.0},
            {"name": "pinion", "inertia": 0.05}, {"name": "wheel", "inertia": 0.2},
            {"name": "load", "inertia": 0.6},
        ],
        "shafts": [
            *({"stiffness": stiffness, "diameter": 0.07} for _ in range(throws + 1)), soft,
            {"between": ["wheel", "load"], "stiffness": stiffness},
        ],
        "gears": [{"between": ["pinion", "wheel"], "ratio": -0.6}],
        **given,
    }  # fmt: skip


def scene_of(base: str, *fragments: Fragment, quantities: Sequence[str] = ()) -> dict[str, Any]:
    """A scene of the merged fragments on an engine; asks for `delta` unless told otherwise."""
    scene = merged(*fragments)
    engine = scene.pop("engine", {})
    path = _engine_file(ENGINES / f"{BASES[base][0]}.toml", engine)
    axes = dict(BASES[base][1])
    if "replace" in engine:
        own = engine["replace"]
        axes = {"speed": [own["speed"], 1.1 * own["speed"]], "inertia": [own["inertia"], 90.0]}
    settings = scene.setdefault("set", {})
    if not engine:
        known = {**KNOWN["set"]}
        mine = tomllib.loads(path.read_text(encoding="utf-8"))["values"]
        if "reciprocating_mass" in mine:
            known.pop("rod_inertia")
        if "geometric_compression_ratio" in mine:
            known = {k: v for k, v in known.items() if k not in mine}
        scene["set"] = settings = {**known, **settings}
    given = {*settings, *scene.get("axes", {})}
    if "shaft" in scene:
        throws = _throws(str(path), settings.get("arrangement", ""), settings.get("cylinders", 0))
        scene["shaft"] = _shaft_table(scene["shaft"], throws)
        axes.pop("inertia")
        axes["shaft_stiffness_1"] = [scene["shaft"]["shafts"][0]["stiffness"] * f for f in (1, 2)]
    if given & {"flywheel_inertia", "load_inertia", "wanted_delta"}:
        axes.pop("inertia", None)
    own_axes = {key: value for key, value in axes.items() if key not in given}
    more = scene.pop("axes", {})
    if more or "designs" in scene or "sample" in scene:
        own_axes = dict(list(own_axes.items())[:1])  # four to twelve designs
    scene["axes"] = {**own_axes, **more}
    for key in ("load_table", "driver_table"):
        if isinstance(settings.get(key), str):
            settings[key] = str(folder() / settings[key])
    for key in ("indicator", "measured"):
        if key in scene:
            scene[key]["file"] = str(folder() / scene[key]["file"])
    scene["engine"] = str(path)
    if factors := scene.pop("engines", None):
        own = tomllib.loads(path.read_text(encoding="utf-8"))["values"]
        other = {key: factor * own.get(key, 0.1) for key, factor in factors.items()}
        scene["engine"] = [str(path), str(_engine_file(path, {"values": {**own, **other}}))]
    scene["silenced_warnings"] = ["all"]
    output = scene.pop("output", {})
    elastic = output.pop("elasticities", False)
    asked = list(quantities) or ["delta"]
    if elastic:
        asked += ["delta_elasticity", "torque_max_elasticity"]
    scene["output"] = {"angle_step": 30.0, "highest_order": 3.0, "quantities": asked, **output}
    return scene


_NAMES = re.compile(r"'(\w+)'|\b(\w+)\b")
_TOGETHER: dict[str, set[str]] = {}
"""Quantities that were refused for one reason: what refuses one of them refuses all of them."""


def refusal_of_scene(scene: dict[str, Any], quantities: Sequence[str]) -> str:
    try:
        plan({**scene, "output": {**scene["output"], "quantities": [*quantities]}})
    except SceneError as error:
        return str(error)
    return ""


def possible(scene: dict[str, Any]) -> list[str]:
    """Quantities that the scene gives, of all that there are."""
    wanted = [*QUANTITIES]
    kept = [name for name in scene["output"]["quantities"] if name not in QUANTITIES]
    while error := refusal_of_scene(scene, [*wanted, *kept]):
        head, *rest = re.split(r"( needs? | is that | has more )", error, maxsplit=1)
        named = {a or b for a, b in _NAMES.findall(head)}
        reason = "".join(rest)
        here = _TOGETHER.setdefault(reason, set())
        if rest and named & {*wanted}:
            here |= named if len(named & {*wanted}) == 1 else set()
        elif rest and not here & {*wanted} and not refusal_of_scene(scene, ["torque_max", *kept]):
            here |= {name for name in wanted if reason in refusal_of_scene(scene, [name])}
        refused = (here | named) & {*wanted}
        if not refused:
            raise SceneError(error)
        wanted = [name for name in wanted if name not in refused]
    return [*wanted, *kept]
