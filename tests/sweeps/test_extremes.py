"""Extremes of curves: none is below its own curve, whatever the distance of the curve's points.

The pairs of extreme and curve are those that the graph declares. A quantity that reads like an
extreme must be declared, follow from one that is, or stand in `NO_CURVE` with the reason.
"""

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

import sweeps
from engine_dyn.quantities.graph import NODES, QUANTITIES
from sweeps.base.errors import SceneError
from sweeps.scene.plan.plan import make_plan
from sweeps.scene.reading import read_scene
from tests.support.scenes import IN_PASSING

pytestmark = pytest.mark.compiled

STEPS = (5.0, 1.0, 0.1)
"""Of the crank angle [degree]."""

ROUNDING = 1e-9
"""Of a curve's largest size, by how much an extreme may be below it."""

OF_SOLVER = {"excess_energy": 1e-6}
"""The same of what kernels find by polynomials through nodes, to the tolerance 1e-6."""

OF_NOISE = {"excess_energy": 1e-5, "omega": 1e-7}
"""The same of noise, which nodes resolve to that tolerance of delta."""

CLOSE = 2e-4
"""Of a curve's largest size, by how much an extreme may be above points 0.1 degree apart."""

MEANT = re.compile(r"\b(largest|smallest|least|range|peak|worst)\b")
NAMED = re.compile(r"_(max|min|range|largest|peak|swing|compression|tension|half_range)$")

OF_ORDERS = "a sum of orders at angles of its own: no quantity holds the curve"
OF_TURN = "turns with the crank: the same at every angle"
ANGLE, CHOICE = "a place, not a value of the curve", "a choice by an extreme of its own search"
GIVEN, RATIO = "given, or from the mean speed alone", "over a curve that no quantity holds"
NO_CURVE = {
    **dict.fromkeys(("crankshaft_twist_half_range", "disc_angle_half_range",
                     "pendulum_swing_half_range", "shaft_stress_half_range",
                     "propulsion_stress_over_limit",
                     "shaft_stress_over_limit", "shaft_torque_half_range", "shaft_torque_min",
                     "shaft_torque_over_limit", "shaft_twist_half_range",
                     "shaft_torque_nonlinear", "shaft_stress_nonlinear", "coupling_departure",
                     "disc_angle_largest_order", "shaft_torque_largest_order"), OF_ORDERS),
    **dict.fromkeys(("bay_bending_moment", "bay_bending_moment_max"), OF_TURN),
    "bay_bending_moment_cycle_max": "no quantity holds the curve: compared in test_webs_and_mounts",
    **dict.fromkeys(("crank_pin_peak_angle", "piston_pin_peak_angle", "main_journal_peak_angle",
                     "rod_load_reversal"), ANGLE),
    **dict.fromkeys(("best_fraction_peak", "best_fraction_rms", "second_shaft_required"), CHOICE),
    **dict.fromkeys(("delta_of_given_swing", "inertia_of_given_swing", "shaft_stress_limit",
                     "shaft_torque_limit", "flywheel_largest_diameter",
                     "flywheel_smallest_diameter", "rim_largest_diameter",
                     "rim_speed_at_stress_limit"), GIVEN),
    **dict.fromkeys(("acceleration_truncation_error", "position_truncation_error",
                     "velocity_truncation_error", "rod_thrust_error", "rod_torque_error"), RATIO),
    **dict.fromkeys(IN_PASSING, "of a passing, whose cycles differ: no curve holds it"),
    **dict.fromkeys(("largest_speed_fall", "largest_speed_rise", "run_overshoot"),
                    "of means over cycles that do not repeat"),
    **dict.fromkeys(("triangle_energy_swing", "triangle_torque_max"), "of a torque that is drawn"),
}  # fmt: skip

DECLARED = {
    name: node.extreme_of
    for name, variants in NODES.items() for node in variants
    if node.extreme_of is not None and node.extreme_of[0] in QUANTITIES
}  # fmt: skip


def follows(name: str, above: frozenset[str] = frozenset()) -> bool:
    """Whether a quantity is made from an extreme, through numbers alone."""
    # Variants of the load follow from a torque, and those of the torque from a load.
    above |= {name}
    needs = {n for node in NODES[name] if node.kind == "value" for n in node.needs} - above
    return any(n in DECLARED or (n in NODES and follows(n, above)) for n in needs)


def test_every_extreme_names_its_curve() -> None:
    meant = {
        name for name in QUANTITIES for node in NODES[name]
        if node.kind == "value" and (MEANT.search(node.long_name) or NAMED.search(name))
    }  # fmt: skip
    assert len(meant) > 60
    unknown = {name for name in meant - DECLARED.keys() - NO_CURVE.keys() if not follows(name)}
    assert not unknown, (
        "declare `extreme_of` of a public curve, or say in NO_CURVE why there is none"
    )
    assert NO_CURVE.keys() <= meant - DECLARED.keys()


def double_acting(folder: Path) -> dict[str, Any]:
    path = folder / "machine.toml"
    path.write_text(
        'title = "x"\ncycle = "two-stroke"\narrangement = "in-line 1"\n[values]\n'
        "bore = 0.3\nstroke = 0.15\n"
        "rod_length = 0.375\npiston_mass = 60\nrod_mass = 60\nrod_centre_of_gravity = 0.12\n"
        "crank_mass = 40\ninertia = 60\nspeed = 750\ncylinders = 1\ncrankcase_pressure = 1.01325\n"
        "friction_constant = 0.3\nfriction_peak_pressure = 0.01\nfriction_mean_piston_speed = 0\n"
        "load_offset = 0\nmotor_slip = 0.01\nmotor_breakdown_slip = 0.06\n"
        "motor_breakdown_torque = 30000\n[[diagram]]\nload = 100\n"
        'kind = "double_acting_compressor"\nclearance_ratio = 0.12\n'
        "crank_end_clearance_ratio = 0.15\npiston_rod_diameter = 0.06\nsuction_pressure = 5.0\n"
        "delivery_pressure = 15.0\nsuction_loss = 0.1\ndelivery_loss = 0.2\n"
        "compression_exponent = 1.3\nexpansion_exponent = 1.25\nvalve_ramp = 8.0\n"
        "valve_lag = 2.0\n"
    )
    return {"engine": str(path), "set": {"cylinder_spacing": 0.3}}


MOUNTS = [{"lateral": -0.3}, {"lateral": 0.3}]
GRID = {"pole_pairs": 2, "synchronising_torque": 2e3, "angle_deviation_limit": 2.0}
WEBS = [{"mass": 1.0, "radius": 0.05, "angle": 180.0, "position": 0.0}]


def noisy(folder: Path) -> dict[str, Any]:
    """A recording at 0.2 degree with noise, whose crests lie between samples of half a degree."""
    source = sweeps.run(engine="ntua", output={"quantities": ["pressure"], "angle_step": 0.2})
    noise = 0.02 * np.random.default_rng(3).standard_normal(source.crank_angle.size)
    table = np.column_stack([source.crank_angle, source.pressure + noise])
    path = folder / "noisy.csv"
    np.savetxt(path, table, delimiter=",", header="crank_angle_deg,pressure_bar", comments="")
    return {"engine": "ntua", "indicator": {"file": str(path)}}


SCENES: dict[str, Any] = {
    "si": {"engine": "si_four_87x101", "mounts": MOUNTS,
           "set": {"cylinder_spacing": 0.12, "friction_boundary": 0.3, "friction_skirt": 0.2}},
    "diesel": {"engine": "diesel_105x137", "set": {"cylinder_spacing": 0.15, "speed": 1500, **GRID},
               "counterweights": WEBS},
    "compressor": {"engine": "compressor_79x83", "mounts": MOUNTS},
    "double-acting": double_acting,
    "V6": {"engine": "v6_96x81", "set": {"cylinder_spacing": 0.11}},
    "master rods": {"engine": "v8_flat_plane_94x93",
                    "set": {"articulated_rods": {"radius": 0.6, "knuckle_mass": 0.2}}},
    "on the grid": {"engine": "si_four_87x101",
                    "set": {"pole_pairs": 2, "synchronising_torque": 2e3}},
    "two pins": {"engine": "boxer_twin_101x70", "set": {"load": 62.3, "pin_offset": 0.002}},
    "pattern": {"engine": "ntua", "set": {"cylinders": 4, "firing_pattern": "00011",
                                          "cylinder_spacing": 0.12}, "counterweights": WEBS},
    "unequal": {"engine": "ntua", "set": {"cylinders": 3, "misfire": 1, "radius_factor_2": 0.9,
                                          "pressure_factor_3": 0.7}},
    "noisy recording": noisy,
}  # fmt: skip
"""Scenes, or what makes one in a folder."""


def scene_of(key: str, folder: Path) -> dict[str, Any]:
    made = SCENES[key]
    return made(folder) if callable(made) else made


def asked_of(scene: dict[str, Any]) -> list[str]:
    """Declared extremes that a scene can compute, each with its curve."""
    found = []
    for name, (curve, which) in DECLARED.items():
        both = [name, curve, *([f"{curve}_mean"] if which in ("over_mean", "of_cycles") else [])]
        try:
            make_plan(read_scene({**scene, "output": {"quantities": both}}))
        except SceneError:
            continue
        found.append(name)
    return found


def extreme(found: xr.Dataset, name: str) -> tuple[xr.DataArray, xr.DataArray]:
    """An extreme of the points of its curve, and the largest size of these."""
    curve, which = DECLARED[name]
    points: Any = found[curve]
    if which == "size":
        points = np.hypot(points.isel(direction=0), points.isel(direction=1))
    others = [d for d in points.dims if d not in (*found[name].dims, "crank_angle")]
    cycles = found.sizes.get("firing_cycle", 1)
    if which == "of_cycles":  # their ends belong to them
        of_each = points.sizes["crank_angle"] // cycles
        each = [points.roll(crank_angle=-k * of_each).isel(crank_angle=slice(of_each + 1))
                for k in range(cycles)]  # fmt: skip
        ranges = [one.max("crank_angle") - one.min("crank_angle") for one in each]
        return xr.concat(ranges, "firing_cycle") / found[f"{curve}_mean"], xr.ones_like(points[0])
    high, low = points.max("crank_angle"), points.min("crank_angle")
    size: Any = np.maximum(abs(high), abs(low))
    made: dict[str, Any] = {
        "largest": high, "size": high, "smallest": low, "above": np.maximum(high, 0.0),
        "below": np.maximum(-low, 0.0), "range": high - low, "half_range": 0.5 * (high - low),
        "reversal": np.minimum(high, -low) / np.maximum(high, -low),
    }  # fmt: skip
    if which == "over_mean":
        return (high - low) / found[f"{curve}_mean"], xr.ones_like(size)
    if which == "over_middle":
        return 2.0 * (high - low) / (high + low), xr.ones_like(size)
    value, size = made[which].max(others), size.max(others)  # the worst along the shaft
    return value, xr.ones_like(size) if which == "reversal" else size


@pytest.fixture(scope="module")
def checked() -> set[str]:
    return set()


@pytest.mark.parametrize("key", SCENES)
def test_no_extreme_is_below_its_curve(key: str, tmp_path: Path, checked: set[str]) -> None:
    scene = scene_of(key, tmp_path)
    names = asked_of(scene)
    curves = [DECLARED[name][0] for name in names]
    means = ["omega_mean"] if "omega" in curves else []
    asked = list(dict.fromkeys((*names, *curves, *means)))
    every = [
        sweeps.run({**scene, "output": {"quantities": asked, "angle_step": step}})
        for step in STEPS
    ]  # fmt: skip
    bad: dict[str, float] = {}
    unequal = key in ("unequal", "pattern")  # the worst cylinder need not be the first
    for name in names:
        curve, which = DECLARED[name]
        sign = -1.0 if which == "smallest" else 1.0
        for found in every:
            here = sign * found[name]
            if curve == "excess_energy":  # the curve itself is an integral of its points
                compared = every[-1:]
            else:  # with points at any step
                compared = every
            for points in compared:
                expected, size = extreme(points, name)
                if which == "reversal":
                    continue
                below = (sign * expected - here) / size
                limit = (OF_NOISE if key == "noisy recording" else OF_SOLVER).get(curve, ROUNDING)
                if float(below.max()) > limit:
                    bad[name] = max(float(below.max()), bad.get(name, 0.0))
            change, size = (float(abs(v).max()) for v in (here - sign * every[0][name], here))
            if change > ROUNDING * size:
                bad[f"{name} by step"] = change
        # Not by far above it, where it is the extreme of this curve alone.
        expected, size = extreme(every[-1], name)
        above = float(abs(every[-1][name] - expected).max() / size.max())
        if not unequal and above > CLOSE:
            bad[f"{name} above"] = above
    assert not bad
    checked.update(names)


def test_every_declared_extreme_was_checked(checked: set[str]) -> None:
    if len(checked) > 20:  # with the whole file
        assert checked == DECLARED.keys()
