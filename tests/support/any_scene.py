"""Scenes of every kind, drawn by hypothesis: every key of the scene language now and then.

A scene is an engine of the catalogue and some *features* (masses, an offset, a load table, a layout
and so on), each of which gives some keys values near those of engines. Every key then stands in
[set], as an axis or as a column of [designs]. What is asked for is drawn from all quantities, less
those that need what the scene does not give.
"""

import functools
import hashlib
import math
import re
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from hypothesis import reject
from hypothesis import strategies as st

from engine_dyn.quantities.features.characteristic import CHARACTERISTICS
from engine_dyn.quantities.graph import QUANTITIES
from engine_dyn.speed.fields import CLOSURES, INERTIA_MODELS, METHOD_NAMES
from engine_dyn.units import RPM
from sweeps.base.errors import SceneError
from sweeps.scene.engine.engine_files import catalogue
from sweeps.scene.plan.plan import make_plan
from sweeps.scene.reading import read_scene
from sweeps.scene.toml_tables import FAILURES
from tests.support.shafts import complete_shaft

from .engine_files import indicator_text, points

Draw = Any

MOST_DESIGNS = 24

LAYOUTS = {
    1: ("in-line 1",), 2: ("parallel twin 270", "V2 90", "boxer 2"), 3: ("in-line 3", "radial 3"),
    4: ("in-line 4", "V4 90 shared-pin", "boxer 4"), 5: ("in-line 5", "radial 5", "VR5 15"),
    6: ("V6 60 split-pin", "V6 90 shared-pin", "boxer 6", "in-line 6", "VR6 15"),
    7: ("in-line 7", "radial 7"), 8: ("V8 cross-plane", "V8 flat-plane", "boxer 8"),
    10: ("V10 90 shared-pin",), 12: ("V12 60 shared-pin",), 16: ("V16 60 shared-pin",),
}  # fmt: skip

WRITTEN_OUT: dict[str, Any] = {
    "name": "a V-twin of one's own",
    "throws": [{"angle": 0.0, "position": 0.0, "radius_factor": 1.0}],
    "banks": [-30.0, 30.0],
    "cylinders": [{"throw": 1, "bank": 1, "firing_angle": 0.0},
        {"throw": 1, "bank": 2, "firing_angle": 420.0}],
    "uneven": True,
}  # fmt: skip


@functools.cache
def folder() -> Path:
    """Files that scenes name: tables of torque, a measured diagram."""
    path = Path(tempfile.mkdtemp(prefix="any-scene-"))
    degrees = np.arange(0, 360, 4)
    swell = 1.0 + 0.6 * np.cos(np.radians(2 * degrees))
    speeds = np.array([20.0, 1000.0, 3000.0, 20000.0])
    tables = {
        "own.csv": ("load_angle_deg", degrees, 3.0 * swell),
        "crank.csv": ("crank_angle_deg", degrees * 1.0, 2.0 * swell),
        "fan.csv": ("speed_rpm", speeds, 1.0 + 4e-6 * speeds**2),
        "geared fan.csv": ("load_speed_rpm", speeds, 2.0 + 1e-3 * speeds),
        "engine.csv": ("speed_rpm", speeds, 90.0 - 4e-3 * speeds),
    }
    for name, (column, places, torque) in tables.items():
        rows = "".join(f"{x},{y}\n" for x, y in zip(places, torque, strict=True))
        (path / name).write_text(f"{column},torque_Nm\n{rows}")
    (path / "pressure.csv").write_text(indicator_text(points(4.0)))
    return path


@functools.cache
def engine_of(name: str) -> Any:
    """An engine of the catalogue."""
    return read_scene({"engine": name, "output": {"quantities": ["imep"]}}).engine


def near(low: float, high: float) -> st.SearchStrategy[float]:
    """Numbers of few digits, as people write them."""
    steps = 40
    return st.integers(0, steps).map(
        lambda i: float(np.format_float_scientific(low + (high - low) * i / steps, 5))
    )


def around(value: float, share: float = 0.2) -> st.SearchStrategy[float]:
    return near(value * (1.0 - share), value * (1.0 + share))


class Given:
    """What a scene gives so far."""

    def __init__(self, engine: Any, cylinders: int) -> None:
        self.engine = engine
        self.own: dict[str, float] = dict(engine.values)
        self.rod = self.own["stroke"] / 2.0 / self.own["crank_ratio"]
        self.cylinders = cylinders
        self.values: dict[str, st.SearchStrategy[float]] = {}
        """Keys that may stand anywhere, with values for them."""
        self.settings: dict[str, Any] = {}
        """Keys of [set] alone."""
        self.tables: dict[str, Any] = {}
        self.axes: dict[str, Any] = {}
        self.solver: dict[str, Any] = {}


# --- features -----------------------------------------------------------------------------------

ALL = 0
PLAIN: dict[str, tuple[int, Any]] = {
    "rod_inertia": (ALL, lambda g: {"rod_inertia": around(g.own["rod_mass"] * g.rod**2 / 7.0)}),
    "rod": (1, lambda g: {
        "crank_ratio": around(g.own["crank_ratio"], 0.15), "rod_length": around(g.rod, 0.1),
    }),
    "size": (2, lambda g: {key: around(g.own[key], 0.1) for key in ("bore", "stroke")}),
    "offset": (2, lambda g: dict.fromkeys(
        ("pin_offset", "crank_offset"), near(-0.05 * g.own["stroke"], 0.05 * g.own["stroke"])
    )),
    "load": (ALL, lambda g: {"load": near(
        max(g.engine.family.low, 0.4 * g.engine.family.high), g.engine.family.high
    )}),
    "friction": (3, lambda _: {
        "friction_constant": near(0.1, 0.5), "friction_peak_pressure": near(0.0, 0.006),
        "friction_mean_piston_speed": near(0.0, 0.15),
        "friction_mean_piston_speed_square": near(0.0, 0.001), "auxiliary_torque": near(0.0, 2.0),
    }),
    "bearings": (ALL, lambda g: {
        f"{bearing}_{size}": around(share * g.own["bore"])
        for bearing, diameter in (("crank_pin", 0.6), ("main_journal", 0.7), ("piston_pin", 0.3))
        for size, share in (("diameter", diameter), ("width", 0.3))
    }),
    "pressure": (ALL, lambda _: {"crankcase_pressure": near(0.9, 1.1)}),
    "cycle": (2, lambda _: {  # by the first law, with other values than the engine's
        "compression_ratio": near(9.0, 11.0), "intake_pressure": near(0.8, 1.0),
        "heat": near(12.0, 20.0), "combustion_start": near(-20.0, -5.0),
        "combustion_duration": near(45.0, 70.0),
    }),
    "count": (ALL, lambda _: {"cylinders": st.sampled_from([1.0, 2.0, 3.0, 4.0, 6.0])}),
    "misfire": (ALL, lambda g: {"misfire": st.integers(0, g.cylinders).map(float)}),
    "flywheel": (ALL, lambda _: {
        "wanted_delta": near(0.01, 0.05), "flywheel_outer_diameter": near(0.45, 0.6),
        "flywheel_inner_diameter": near(0.2, 0.35), "flywheel_density": near(7000.0, 7900.0),
        "rim_speed_limit": near(25.0, 60.0), "rim_speed_lowest": near(5.0, 24.0),
    }),
    "rim": (ALL, lambda _: {
        "rim_stress_limit": near(5.0, 20.0), "rim_mean_diameter": near(0.4, 0.6),
        "rim_width_over_thickness": near(1.0, 4.0), "rim_inertia_share": near(0.7, 1.0),
    }),
    "energy": (ALL, lambda _: {
        "given_energy_swing": near(100.0, 900.0), "given_energy_fluctuation": near(0.1, 2.0),
        "torque_factor": near(0.5, 1.5),
    }),
    "weight": (ALL, lambda _: {
        "engine_inclination": near(-90.0, 90.0), "piston_friction": near(0.0, 300.0),
        "piston_travel": near(0.0, 0.04),
    }),
    "generator": (ALL, lambda _: {
        "pole_pairs": st.integers(1, 4).map(float), "angle_deviation_limit": near(1.0, 5.0),
        "damping_torque": near(0.0, 50.0), "resonance_band": near(0.1, 0.4),
        "interval_begin": near(-90.0, 0.0), "interval_end": near(10.0, 90.0),
    }),
    "grid": (1, lambda _: {
        "synchronising_torque": near(1e3, 1e5), "synchronising_power": near(1e4, 9e5),
    }),
    "truncation": (ALL, lambda _: {"truncation": st.sampled_from([2.0, 4.0, 6.0])}),
    "inertia_alone": (
        ALL, lambda g: {"inertia": around(g.own["inertia"])} if "inertia" in g.own else {}
    ),
    "exponent": (ALL, lambda _: {
        "load_exponent": st.sampled_from([0.0, 0.5, 1.0, 2.0, 3.0]), "load_offset": near(0.0, 2.0),
    }),
}  # fmt: skip
"""Features that are nothing but keys: how many at most are drawn, and values for them."""


def some(draw: Draw, choices: dict[str, Any], most: int, least: int = 1) -> dict[str, Any]:
    """Some of the choices."""
    keys = st.lists(st.sampled_from(list(choices)), min_size=least, max_size=most, unique=True)
    return {key: choices[key] for key in draw(keys)}


def _masses(draw: Draw, given: Given) -> None:
    total = given.own.get("reciprocating_mass", given.own.get("piston_mass", 1.0) * 1.3)
    if draw(st.booleans()):
        given.values["reciprocating_mass"] = around(total)
        return
    if "piston_mass" in given.own:
        given.values |= {k: around(given.own[k]) for k in ("piston_mass", "rod_mass", "crank_mass")}
        if draw(st.booleans()):  # the throw as it is, in place of its mass at the crank radius
            del given.values["crank_mass"]
            given.values["throw_mass"] = around(2.0 * given.own["crank_mass"])
            given.values["throw_radius"] = around(0.25 * given.own["stroke"])
    if "rod_centre_of_gravity" in given.own:
        given.values["rod_centre_of_gravity"] = around(given.own["rod_centre_of_gravity"])


def _inertia(draw: Draw, given: Given) -> None:
    own = given.own.get("inertia", 0.1)
    kind = draw(st.sampled_from(["whole", "parts", "wanted"]))
    if kind == "whole" and "inertia" in given.own:
        given.values["inertia"] = near(0.8 * own, 4.0 * own)
    elif kind == "parts":
        given.values |= {
            "flywheel_inertia": around(own), "auxiliary_inertia": around(0.1 * own),
            "load_inertia": around(0.3 * own), "gear_ratio": near(0.5, 2.0),
        }  # fmt: skip
    else:
        given.values["wanted_delta"] = near(0.005, 0.05)


def _speed(draw: Draw, given: Given) -> None:
    own, high = given.own["speed"], 1.0
    family = given.engine.family
    if getattr(family, "speeds", None) is not None:
        high = min(1.0, float(family.speeds[-1]) / RPM / own)
    scale = given.engine.pressure_scale
    low = 0.7 * own if scale is None else max(0.7 * own, float(scale[0][0]))
    given.values["speed"] = near(low, high * own)


def _load_law(draw: Draw, given: Given) -> None:
    law = {
        "load_linear": near(0.05, 1.0), "load_square": near(0.001, 0.01),
        "load_exponent": st.sampled_from([0.0, 0.5, 1.0, 2.0, 3.0]), "load_offset": near(0.0, 2.0),
    }  # fmt: skip
    one, other = draw(st.sampled_from([(0, 1), (1, 0), (2, 3)]))
    for place in (one, other)[: draw(st.integers(1, 2))]:
        given.values[list(law)[place]] = law[list(law)[place]]


def _load_table(draw: Draw, given: Given) -> None:
    name = draw(st.sampled_from(["own.csv", "crank.csv", "fan.csv", "geared fan.csv"]))
    given.settings["load_table"] = str(folder() / name)
    if name == "own.csv":
        given.values["gear_ratio"] = st.sampled_from([0.5, 1.0, 1.5, 2.0])
    if name in ("own.csv", "crank.csv"):
        given.values |= {"load_phase": near(-90.0, 90.0), "load_table_factor": near(0.5, 1.5)}


def _driver(draw: Draw, given: Given) -> None:
    """Driven without combustion: friction that nothing overcomes."""
    given.values["load"] = st.just(float(given.engine.family.low))
    given.values["friction_constant"] = near(3.0, 5.0)
    if given.engine.family.low > 5.0 and "motor_slip" not in given.own:
        given.values["friction_constant"] = near(30.0, 40.0)
    if draw(st.booleans()):
        given.settings["driver_table"] = str(folder() / "engine.csv")
        return
    speed = given.own["speed"]
    if draw(st.booleans()):
        given.values |= {"motor_slip": near(0.02, 0.05), "motor_gear_ratio": near(0.5, 2.0)}
    else:
        given.values["motor_synchronous_speed"] = near(1.03 * speed, 1.08 * speed)
    given.values |= {
        "motor_breakdown_slip": near(0.15, 0.3), "motor_breakdown_torque": near(50.0, 200.0),
    }  # fmt: skip


def _friction_over_stroke(draw: Draw, given: Given) -> None:
    names = ("boundary", "mixed", "hydrodynamic", "skirt")
    shares = {f"friction_{name}": near(0.0, 0.24) for name in names}
    given.values |= some(draw, shares, 4, least=0) | {"ring_pressure": near(0.5, 3.0)}


def _components(draw: Draw, given: Given) -> None:
    """Friction of the engine's components: its law, or its quantities beside another law."""
    if draw(st.booleans()):
        given.settings["friction_law"] = draw(
            st.sampled_from(["patton_nitschke_heywood", "chen_flynn", 1])
        )
        if draw(st.booleans()):
            given.values["ring_pressure"] = near(0.5, 3.0)
    given.values |= {
        "geometric_compression_ratio": near(8.0, 20.0), "main_bearings": st.integers(2, 9),
        "valve_train": st.integers(1, 7), "valve_lift": near(0.005, 0.012),
        "valves_per_cylinder": st.integers(2, 4), "camshaft_bearings": st.integers(2, 12),
    } | PLAIN["bearings"][1](given)  # fmt: skip


def _indicator(draw: Draw, given: Given) -> None:
    given.tables["indicator"] = {"file": str(folder() / "pressure.csv")}


def _characteristic(draw: Draw, given: Given) -> None:
    kinds = [{"kind": kind} for kind in CHARACTERISTICS]
    given.tables["characteristic"] = draw(st.sampled_from([*kinds, {"coefficients": [0.6, 0.9]}]))
    given.values |= {
        "rated_power": st.just(1.0 * given.cylinders * given.own["bore"] ** 2 * 5e5),
        "rated_speed": st.just(given.own["speed"]), "characteristic_share": near(0.4, 0.6),
    }  # fmt: skip


def _hold(draw: Draw, given: Given) -> None:
    """A torque that is held, of the undisturbed engine or a number."""
    size = given.cylinders * given.own["bore"] ** 3
    key = draw(st.sampled_from(["held_torque", "hold", "held_power"]))
    if key == "hold":
        given.settings[key] = draw(st.sampled_from(["brake_torque", "brake_power"]))
    elif key == "held_torque":
        given.values[key] = near(2e4 * size, 6e4 * size)
    else:
        omega = given.own["speed"] * RPM
        given.values[key] = near(2e4 * size * omega, 6e4 * size * omega)


def _layout(draw: Draw, given: Given) -> None:
    """Another arrangement, one for each design, or described in full."""
    kind = draw(st.sampled_from(["text", "axis", "table"]))
    two_stroke = given.engine.period < 10.0
    known = {z: (f"in-line {z}",) for z in range(1, 8)} if two_stroke else LAYOUTS
    if kind == "table" and not two_stroke:
        count, given.settings["arrangement"] = 2, WRITTEN_OUT
    else:
        count = draw(st.sampled_from(sorted(known)))
        names = st.sampled_from(sorted(known[count]))
        if kind == "axis":
            several = st.lists(names, min_size=1, max_size=3, unique=True)
            given.axes["arrangement"] = draw(several)
        else:
            given.settings["arrangement"] = draw(names)
    given.settings["cylinders"] = given.cylinders = count


def _each_cylinder(draw: Draw, given: Given) -> None:
    """Factors of single cylinders, as lists or as parameters."""
    count = given.cylinders
    factors = {
        "pressure_factor": near(0.8, 1.1), "mass_factor": near(0.9, 1.1),
        "radius_factor": near(0.9, 1.1),
    }  # fmt: skip
    if "motor_slip" in given.own:
        del factors["pressure_factor"]  # a compressor has no combustion
    for what, values in some(draw, factors, 3).items():
        first = 2 if what == "radius_factor" else 1
        if draw(st.booleans()):
            listed = draw(st.lists(values, min_size=count, max_size=count))
            given.settings[what] = [1.0, *listed[1:]] if first == 2 else listed
        elif count >= first:
            given.values[f"{what}_{draw(st.integers(first, count))}"] = values
    given.settings.setdefault("cylinders", count)


def _firing_pattern(draw: Draw, given: Given) -> None:
    """Firings over several cycles."""
    patterns = st.sampled_from(
        ["1", "10", "110", "11d", "1 0.9 1.05", "deviation 0.02, 2 cycles, seed 1"]
    )
    if draw(st.booleans()):
        several = draw(st.lists(patterns, min_size=1, max_size=3, unique=True))
        given.axes["firing_pattern"] = several
    else:
        given.settings["firing_pattern"] = draw(patterns)


def _master_rods(draw: Draw, given: Given) -> None:
    """Rods that hang on the first rod of each throw."""
    two_stroke = given.engine.period < 10.0
    names = {3: "radial 3", 5: "radial 5", 12: "V12 60 shared-pin"}
    names = {4: "boxer 4"} if two_stroke else names
    count = draw(st.sampled_from(sorted(names)))
    given.settings |= {"arrangement": names[count], "cylinders": count}
    given.cylinders = count
    radius = 0.0 if two_stroke else draw(near(0.2, 0.5))
    given.settings["articulated_rods"] = {"radius": radius, "knuckle_mass": draw(near(0.1, 0.3))}


def _firing_angles(draw: Draw, given: Given) -> None:
    count, cycle = given.cylinders, round(np.degrees(given.engine.period))
    even = [cycle * i / count for i in range(count)]
    if draw(st.booleans()):
        given.settings["firing_angles"] = [
            0.0, *(angle + draw(near(-10.0, 10.0)) for angle in even[1:]),
        ]  # fmt: skip
    elif count > 1:
        number = draw(st.integers(2, count))
        given.settings["firing_angles"] = even
        angle = even[number - 1]
        given.values[f"firing_angle_{number}"] = near(angle - 9.0, angle + 9.0)
    given.settings.setdefault("cylinders", count)


def _balance(draw: Draw, given: Given) -> None:
    bore, mass = given.own["bore"], given.own["piston_mass"]
    choices = {
        "cylinder_spacing": around(1.3 * bore), "bank_offset": near(0.0, 0.2 * bore),
        "counterweight_fraction": near(0.0, 1.0), "counterweight_mass": around(mass),
        "counterweight_radius": around(0.4 * bore), "balance_shaft_mass": around(mass),
        "balance_shaft_radius": around(0.1 * bore), "second_shaft_mass": around(0.3 * mass),
        "second_shaft_radius": around(0.1 * bore), "balance_couple": around(0.01 * mass * bore),
    }  # fmt: skip
    chosen = some(draw, choices, 8, least=3)
    if {"counterweight_fraction", "counterweight_mass"} <= {*chosen}:
        del chosen[draw(st.sampled_from(["counterweight_fraction", "counterweight_mass"]))]
    given.values |= {key: choices[key] for key in ("cylinder_spacing", "bank_offset")} | chosen


def _webs(draw: Draw, given: Given) -> None:
    """Counterweights on webs."""
    numbers = {"mass": near(0.0, 3.0), "radius": near(0.02, 0.2), "angle": near(-180.0, 180.0),
               "position": near(-0.1, 0.5)}  # fmt: skip
    weights = st.lists(st.fixed_dictionaries(numbers), min_size=1, max_size=4)
    given.tables["counterweights"] = draw(weights)
    given.values["cylinder_spacing"] = around(1.3 * given.own["bore"])
    given.values["bank_offset"] = near(0.0, 0.2 * given.own["bore"])
    if draw(st.booleans()):
        given.values["counterweights_factor"] = near(0.0, 2.0)


def _mounts(draw: Draw, given: Given) -> None:
    """Two mounts without places along the shaft, or four with them."""
    width = draw(near(0.1, 0.5))
    places = draw(st.sampled_from([{}, {"height": -0.2}, {"position": 0.6}]))
    given.tables["mounts"] = [{"lateral": x, **places, "stiffness": 1.0} for x in (-width, width)]
    if "position" in places:
        given.tables["mounts"] += [{"lateral": x, "position": -0.2} for x in (-width, width)]
        given.values["cylinder_spacing"] = around(1.3 * given.own["bore"])


def _auxiliaries(draw: Draw, given: Given) -> None:
    """A valve train or a pump."""
    ratios = st.sampled_from([1.0, 2.0] if given.engine.period < 10.0 else [0.5, 1.0, 1.5])
    waves = [{"order": draw(st.sampled_from([1, 2, 4])), "sine": draw(near(0.0, 5.0))}]
    one = {"ratio": draw(ratios), "phase": draw(near(-90.0, 90.0)), "mean": draw(near(0.0, 3.0))}
    given.tables["auxiliaries"] = [{**one, "harmonics": waves}]


def _idler_gears(draw: Draw, given: Given) -> None:
    """One gear or two, of which the second turns the other way."""
    inertia, friction = around(0.01 * given.own.get("inertia", 1.0)), near(0.0, 2.0)
    given.tables["idler_gears"] = [
        {"inertia": draw(inertia), "ratio": ratio, "friction_torque": draw(friction)}
        for ratio in draw(st.sampled_from([[2.0], [2.0, -0.5]]))
    ]


def _shaft(draw: Draw, given: Given) -> None:
    own = given.engine.own_cylinders
    throws = given.cylinders if own is None else len(own.along_shaft or ())
    if not throws:
        return
    given.tables["shaft"] = complete_shaft(throws)
    long, coupling, load = throws, throws + 1, throws + 4
    numbers = {
        "disc_inertia_1": 0.05, f"disc_inertia_{throws + 1}": 3.0, "disc_damping_1": 2.0,
        f"disc_ground_stiffness_{load}": 10.0, f"shaft_stiffness_{coupling}": 5e4,
        f"shaft_loss_factor_{coupling}": 0.1, f"shaft_damping_{coupling}": 5.0,
        f"shaft_length_{long}": 0.1, f"shaft_diameter_{long}": 0.1, f"shaft_bore_{long}": 0.01,
        f"shaft_shear_modulus_{long}": 80.0, f"shaft_stress_limit_{long}": 50.0,
        f"shaft_torque_limit_{long}": 5e3, f"shaft_tensile_strength_{long}": 600.0,
        f"shaft_shape_factor_{long}": 0.8, "shaft_gear_ratio_1": 0.5, "damper_inertia_1": 0.1,
        "damper_damping_1": 20.0, "damper_stiffness_1": 1e4, "damper_loss_factor_1": 0.1,
        "damper_surface_1": 0.2,
        "pendulum_mass_1": 1.0, "pendulum_distance_1": 0.1, "pendulum_length_1": 0.02,
        "pendulum_stop_angle_1": 30.0, "excitation_factor_1": 1.0,
        f"shaft_clearance_{coupling}": 0.1, f"shaft_friction_torque_{coupling}": 20.0,
        f"shaft_friction_stiffness_{coupling}": 1e4,
        f"shaft_transient_stress_limit_{long}": 60.0,
    }  # fmt: skip
    given.values |= {key: around(size) for key, size in some(draw, numbers, 8, least=0).items()}
    key = draw(st.sampled_from(["", "load_damping", "load_damping_factor"]))
    if key:
        given.values[key] = near(0.5, 4.0)


def _stepping(draw: Draw, given: Given) -> None:
    """Methods that go step by step, and where they start."""
    given.solver["method"] = draw(
        st.sampled_from(["thesis", ["auto", "thesis"], ["thesis", "newton"]])
    )
    omega = given.own["speed"] * RPM
    starts = {
        "passes": st.integers(1, 3), "start_speed": near(0.95 * omega, 1.05 * omega),
        "start_angle": st.sampled_from([-180.0, -90.0, 0.0]),
    }  # fmt: skip
    for key, values in some(draw, starts, 3, least=0).items():
        given.solver[key] = draw(values)


def _transient(draw: Draw, given: Given) -> None:
    """A speed that is followed in time: load, fuel, governor, starter, clutch."""
    given.solver["method"] = "transient"
    size = draw(st.sampled_from(["load", "torque", "power"]))
    most = {"load": 90.0, "torque": 1e5 * given.own["bore"] ** 3, "power": 1e4}[size]
    more = {
        "limits": st.just({"fall": 8.0, "rise": 10.0, "band": 1.0, "recovery": 3.0}),
        "record": st.just([1, 2]), "missed": st.just([{"cycle": 1, "cylinder": 1}]),
        "load_law": st.sampled_from(["torque", "power", "exponent"]), "duration": near(0.1, 1.0),
    }  # fmt: skip
    given.tables["transient"] = {
        "cycles": draw(st.integers(2, 6)), "command_angle": draw(st.sampled_from([-200.0, -15.0])),
        "load_steps": [{"time": 0.001, size: draw(near(0.1 * most, most))}],
        **{key: draw(values) for key, values in some(draw, more, 5, least=0).items()},
    }  # fmt: skip
    own, high = given.own["speed"], given.engine.family.high
    percent, short, part = near(0.0, 0.6 * high), near(0.001, 0.1), near(0.0, 0.1)
    cycle = given.engine.period / (own * RPM)
    early = near(0.1 * cycle, cycle)
    kinds: dict[str, dict[str, Any]] = {
        "transient": {
            "step_factor": near(0.5, 1.5), "start_speed": around(own), "start_command": percent,
            "ready_speed": around(own), "fuel_from": near(0.0, 0.2 * own), "fuel_cut": early,
            "boost_lag": short, "dispersion": part, "cylinder_dispersion": part,
            "seed": st.integers(0, 9).map(float), "recovery_band": near(0.5, 5.0),
        },
        "governor": {
            "speed": around(own, 0.1), "integral": near(0.0, 9.0), "derivative": part,
            "droop": near(0.0, 6.0), "window": st.integers(1, 6).map(float),
            "sampling_time": short, "dead_time": short, "actuator_lag": short,
            "lowest_command": near(-20.0, 0.0), "highest_command": near(0.6 * high, high),
        },
        "starter": {"release": around(0.9 * own)},
        "clutch": {"speed": near(0.0, own), "torque": near(10.0, 100.0)},
    }  # fmt: skip
    needed = {"governor": {"gain": near(2.0, 20.0)}, "clutch": {"time": early, "inertia": part},
              "starter": {"torque": near(100.0, 400.0), "speed": around(own)}}  # fmt: skip
    for table, choices in kinds.items():
        if table == "transient" or draw(st.booleans()):
            numbers = needed.get(table, {}) | some(draw, choices, 10, least=0)
            if table != "transient":
                key = next(iter(numbers))
                given.tables[table] = {key: draw(numbers.pop(key))}
            given.values |= {f"{table}_{key}": values for key, values in numbers.items()}
    if given.engine.family.high == given.engine.family.low:
        given.values["transient_start_command"] = percent
    if "transient_boost_lag" in given.values and draw(st.booleans()):
        given.values["transient_boost_margin"] = percent


FUNCTIONS = (
    _masses, _inertia, _speed, _load_law, _load_table, _driver, _friction_over_stroke, _components,
    _indicator, _characteristic, _hold, _layout, _each_cylinder, _master_rods, _firing_angles,
    _firing_pattern, _balance, _shaft, _stepping, _webs, _mounts, _auxiliaries,
    _idler_gears, _transient,
)  # fmt: skip
FEATURES = {**{one.__name__[1:]: one for one in FUNCTIONS}, **PLAIN}

SIMPLE = (
    "masses", "rod", "size", "speed", "load", "pressure", "friction", "inertia_alone", "exponent",
)  # fmt: skip
"""Features whose scenes `oracle` solves too."""

_EXCLUDE = [{*group.split()} for group in (
    "inertia flywheel", "load_law load_table driver", "load driver characteristic hold",
    "cycle indicator characteristic driver", "indicator hold", "count layout each_cylinder misfire",
    "count layout firing_angles master_rods", "master_rods each_cylinder misfire",
    "master_rods shaft", "master_rods balance", "master_rods friction_over_stroke",
    "master_rods characteristic",
    "count each_cylinder firing_angles misfire",
    "rod_inertia masses", "friction driver", "components bearings",
    "components friction friction_over_stroke driver", "speed driver characteristic",
    "shaft inertia flywheel count layout", "shaft idler_gears",
    "stepping load_table driver", "stepping auxiliaries",
    "balance webs",
    "indicator misfire each_cylinder", "firing_pattern indicator load_table driver master_rods",
    "inertia_alone inertia flywheel shaft",
    "exponent load_law load_table driver characteristic",
    "transient stepping cycle indicator characteristic hold load_table driver load_law "
    "firing_pattern friction_over_stroke components auxiliaries",
)]  # fmt: skip
"""Features that do not go together, because their keys do not."""


def _add(draw: Draw, given: Given, feature: str) -> None:
    if feature not in PLAIN:
        FEATURES[feature](draw, given)
        return
    most, choices = PLAIN[feature][0], PLAIN[feature][1](given)
    given.values |= some(draw, choices, most) if most else choices


def _fits(feature: str, engine: Any) -> bool:
    """Whether an engine has what a feature changes."""
    values, several_loads = engine.values, engine.family.high > engine.family.low
    four_stroke, driven = engine.period > 10.0, "motor_slip" in values
    return {
        "cycle": engine.cycles is not None and four_stroke,
        "indicator": four_stroke,
        "load": several_loads,
        "characteristic": several_loads and engine.pressure_scale is None and not driven,
        "hold": several_loads and not driven,
        "driver": not driven, "load_law": not driven, "load_table": not driven,
        "components": four_stroke,
        "rod_inertia": "rod_mass" in values and "reciprocating_mass" not in values,
        "stepping": not driven, "firing_pattern": not driven, "misfire": not driven,
        "transient": not driven,
    }.get(feature, True)  # fmt: skip


# --- whole scenes -------------------------------------------------------------------------------


@st.composite
def scenes(draw: Draw, *, simple: bool = False) -> dict[str, Any]:
    """Valid scenes, as dicts; `simple`: of the features that `oracle` covers."""
    name = draw(st.sampled_from(sorted(catalogue())))
    engine = engine_of(name)
    allowed = [f for f in (SIMPLE if simple else FEATURES) if _fits(f, engine)]
    # What excludes most of the others would hardly be drawn.
    allowed += [
        f for f in ("driver", "characteristic", "cycle", "shaft", "hold") if f in allowed
    ] * 2
    chosen: set[str] = set()
    for feature in draw(st.lists(st.sampled_from(allowed), min_size=1, max_size=6, unique=True)):
        if not any(feature in group and group & chosen for group in _EXCLUDE):
            chosen.add(feature)
    given = Given(engine, int(engine.values["cylinders"]))
    for feature in FEATURES:
        if feature in chosen:
            _add(draw, given, feature)
    scene: dict[str, Any] = {"engine": name, **given.tables}
    if draw(st.booleans()):
        scene["title"] = "drawn"
    if draw(st.booleans()):
        scene["silenced_warnings"] = draw(
            st.sampled_from([["all"], ["delta"], ["inertia", "delta"]])
        )
    _place(draw, scene, given)
    _solver(draw, scene, given, simple)
    _output(draw, scene, engine, simple)
    if {"pin_offset", "crank_offset"} & given.values.keys():
        # Truncated series are of a centred mechanism: some scenes are refused when they are run.
        series = re.compile(
            "truncat|inertia_pressure_order|"
            "(position|velocity|acceleration|torque)_coefficient|_mean$"
        )
        asked = [name for name in scene["output"]["quantities"] if not series.search(name)]
        scene["output"]["quantities"] = asked or ["torque_max"]
    if "articulated_rods" in given.settings:
        asked = [q for q in scene["output"]["quantities"] if _has_with_rods(scene, q)]
        scene["output"]["quantities"] = asked or ["torque_max"]
    _reference(draw, scene)
    return _valid(scene)


def _has_with_rods(scene: dict[str, Any], quantity: str) -> bool:
    """Whether engines with articulated rods have a quantity."""
    try:
        read_scene({**scene, "output": {"quantities": [quantity]}})
    except SceneError as error:
        return "articulated_rods" not in str(error)
    return True


def _place(draw: Draw, scene: dict[str, Any], given: Given) -> None:
    """Put every key into [set], [axes] or [designs]."""
    settings, axes, designs = dict(given.settings), dict(given.axes), {}
    rows = draw(st.integers(1, 4)) if draw(st.booleans()) else 0
    size = max(rows, 1) * math.prod(map(len, axes.values()))
    for key, values in given.values.items():
        if key in settings:
            continue
        place = draw(st.sampled_from(["set", "axes", "designs"] if rows else ["set", "axes"]))
        if place == "designs":
            designs[key] = draw(st.lists(values, min_size=rows, max_size=rows))
            continue
        several = draw(st.lists(values, min_size=1, max_size=3, unique=True))
        if place == "axes" and size * len(several) <= MOST_DESIGNS:
            size *= len(several)
            axes[key] = _axis(draw, several, key)
        else:
            settings[key] = several[0]
    if designs and draw(st.booleans()):
        designs["case"] = [f"design {i}" for i in range(rows)]
    tables = {"set": settings, "axes": axes, "designs": designs}
    scene |= {name: table for name, table in tables.items() if table}


def _axis(draw: Draw, values: list[float], key: str) -> Any:
    """Values of an axis, as a list or as a range."""
    whole = key in ("cylinders", "misfire", "truncation") or min(values) <= 0.0
    if len(values) < 2 or whole or draw(st.booleans()):
        return values
    spacing = draw(st.sampled_from([{}, {"spacing": "log"}, {"spacing": "linear"}]))
    return {"start": min(values), "stop": max(values), "num": len(values), **spacing}


def _solver(draw: Draw, scene: dict[str, Any], given: Given, simple: bool) -> None:
    solver = dict(given.solver)
    if draw(st.booleans()):
        solver["inertia_model"] = draw(
            st.sampled_from([*INERTIA_MODELS, *([] if simple else [list(INERTIA_MODELS)])])
        )
    if "thesis" not in solver.get("method", "") and draw(st.booleans()):
        solver["closure"] = draw(st.sampled_from(CLOSURES))
    if not simple and "method" not in solver and draw(st.booleans()):
        plain = [name for name in METHOD_NAMES if name not in ("thesis", "closed")]
        solver["method"] = draw(st.sampled_from([*plain, plain]))
    if draw(st.booleans()):
        solver["tolerance"] = draw(st.sampled_from([1e-9, 1e-7, 1e-6]))
    if solver:
        scene["solver"] = solver


def _output(draw: Draw, scene: dict[str, Any], engine: Any, simple: bool) -> None:
    asked = draw(st.lists(st.sampled_from(sorted(QUANTITIES)), min_size=1, max_size=5, unique=True))
    if "delta" not in asked and draw(st.integers(0, 3)) == 0:
        asked.append("delta")  # of which a value may be published
    output: dict[str, Any] = {
        "quantities": ["delta", "omega_max", "omega_min"] if simple else asked,
        "angle_step": draw(st.sampled_from([5.0, 7.5, 15.0])),
    }
    if draw(st.booleans()):
        orders = [1.0, 6.0] if engine.period < 10.0 else [1.0, 2.5, 6.0]
        output["highest_order"] = draw(st.sampled_from(orders))
    if "shaft" in scene and draw(st.booleans()):
        output |= draw(st.sampled_from([{"modes": 1}, {"modes_below": 1e4}]))
    if draw(st.booleans()):
        output["fail_on"] = draw(st.lists(st.sampled_from(FAILURES), max_size=2, unique=True))
    scene["output"] = output


def _reference(draw: Draw, scene: dict[str, Any]) -> None:
    """A published value beside the computed ones: of the first point of every axis."""
    axes, quantities = scene.get("axes", {}), scene["output"]["quantities"]
    published = [name for name in quantities if name in ("delta", "imep", "torque_max")]
    lists = all(isinstance(v, list) and isinstance(v[0], float) for v in axes.values())
    if not published or not axes or not lists or "designs" in scene or not draw(st.booleans()):
        return
    head = ",".join([*axes, published[0]])
    row = ",".join(str(number) for number in [*(values[0] for values in axes.values()), 0.05])
    text = f"{head}\n{row}\n"
    path = folder() / f"{hashlib.sha256(text.encode()).hexdigest()[:16]}.csv"
    path.write_text(text)
    scene["reference"] = {"file": str(path)}


def _valid(scene: dict[str, Any]) -> dict[str, Any]:
    """Leave out quantities that need what the scene does not give; other scenes are not drawn."""
    while True:
        try:
            make_plan(read_scene(scene))
        except SceneError as error:
            needing = re.search(r"quantities: (.*?) needs? |scene: (\w+) is that", str(error))
            quantities = scene["output"]["quantities"]
            names = re.findall(r"\w+", (needing[1] or needing[2]) if needing else "")
            left = [quantity for quantity in quantities if quantity not in names]
            if len(left) < len(quantities):
                scene["output"]["quantities"] = left or ["torque_max"]
                continue
            REFUSED.append(str(error))
            reject()
        return scene


REFUSED: list[str] = []
"""Why drawn scenes were refused: a strategy that makes many of these is not one of valid scenes."""


# --- the same scene otherwise -------------------------------------------------------------------


def keys_of(scene: dict[str, Any]) -> set[str]:
    """All keys that a scene has, of all its tables; of single cylinders without their numbers."""
    found = set(scene)
    for table in scene.values():
        found |= set(table) if isinstance(table, dict) else set()
    for axis in scene.get("axes", {}).values():
        found |= set(axis) if isinstance(axis, dict) else set()
    return {re.sub(r"_\d+$", "_*", key) for key in found}


def listed(scene: dict[str, Any]) -> dict[str, Any]:
    """The same scene with every axis as a list, and without published values."""
    axes = {
        name: scene["axes"][name] if isinstance(values, tuple) else np.asarray(values).tolist()
        for name, values in read_scene(scene).axes.items()
        if name in scene.get("axes", {})
    }
    found = {name: table for name, table in scene.items() if name != "reference"}
    return {**found, "axes": axes} if axes else found


def reversed_scene(scene: dict[str, Any]) -> dict[str, Any]:
    """The same scene with its axes in another order, and their values and designs backwards."""
    found = listed(scene)
    if "axes" in found:
        found["axes"] = {name: found["axes"][name][::-1] for name in reversed(found["axes"])}
    if "designs" in found:
        found["designs"] = {name: column[::-1] for name, column in found["designs"].items()}
    return found


def one_of(scene: dict[str, Any], places: dict[str, int]) -> dict[str, Any]:
    """A scene of one design: the point at these places along its axes and designs."""
    found = listed(scene)
    if "axes" in found:
        found["axes"] = {name: [values[places[name]]] for name, values in found["axes"].items()}
    if "designs" in found:
        found["designs"] = {
            name: [column[places["design"]]] for name, column in found["designs"].items()
        }
    return found
